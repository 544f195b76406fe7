"""Notes on a load case with lost cables: whether the others hold what they held, and what they carry instead."""

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.scene.words import first_of
from cablestudy.study.columns import find

LISTED = 12  # cables, bodies, or runs of modes, that are named one by one
LEAST_CHANGE = 5e-5  # of a tension, relative, that is told
# of what stands: rotation of a body [deg], and movement over the longest chord [-]; what moves more has fallen
MOST_TURNED, MOST_MOVED = 30.0, 0.1


def lost_notes(case):
    """Notes on a load case with lost cables, against the same load case with all cables.

    Parameters
    ----------
    case : SuspensionCase

    Returns
    -------
    tuple of str
        Empty where no cable is lost.

    Raises
    ------
    NoSolutionError, ConvergenceError
        Without these cables there is no stable equilibrium.
    """
    lost = case.scene.load_case.lost
    if not lost:
        return ()
    begin, slack = f"without {first_of(lost, LISTED)}", slack_cables(case.equilibrium)
    ends = (
        f"{'slack: ' + first_of(slack, LISTED) if slack else 'no cable is slack'}; this is the equilibrium that "
        "follows, on the unstretched lengths of the reference state: the snap itself, which pulls more for a moment, "
        "is not computed"
    )
    try:
        moved, down = _movements(case)
        changes = _changes(case)
    except (NoSolutionError, ConvergenceError) as error:
        return f"note: {begin} {ends}", f"note: {begin} nothing is compared: with all cables, {error}"
    told = first_of(moved, LISTED) or "nothing moves"
    stands = f"warning: {begin} it falls to where it hangs now" if down else f"note: {begin} it stands"
    parts = [f"{word} in {first_of(names, LISTED)}" for word, names in changes.items() if names]
    tension = "; ".join(parts) or "as before in each cable"
    return f"{stands}: {told}; {ends}", f"note: {begin} the largest tension is {tension}"


def fallen(case):
    """Bodies and free points that fall where cables are lost, by their names; raises as `lost_notes`: list."""
    try:
        return _movements(case)[1] if case.scene.load_case.lost else []
    except (NoSolutionError, ConvergenceError):
        return []  # with all cables there is nothing to compare with


def slack_cables(found):
    """Names of the cables of an `Equilibrium` of one case that hang by their own weight: list."""
    span, tension = found.catenary.span, np.asarray(found.catenary.mean_tension)
    slack = np.flatnonzero((np.asarray(span.chord_strain) < 0) & (tension < span.weight))
    return [found.suspension.cable_names[place] for place in slack]


def _changes(case):
    """Cables whose largest tension is more or less than with all cables, those that change most first: two lists."""
    tension = find("max_tension")
    before = dict(zip(case.unbroken.scene.cables, case.unbroken.of_cables(tension).tolist(), strict=True))
    found = {"more": [], "less": []}
    pairs = zip(case.scene.cables, case.of_cables(tension).tolist(), strict=True)
    changes = [(now / before[name] - 1, name, now) for name, now in pairs if before[name] > 0]
    for change, name, now in sorted(changes, key=lambda one: -round(abs(one[0]), 6)):  # alike in their order
        if abs(change) > LEAST_CHANGE:
            found["more" if change > 0 else "less"].append(f"{name} ({now:.4g} N, {100 * change:+.3g} %)")
    return found


def _movements(case):
    """How far bodies and free points are from where they are with all cables, in words; and which have fallen."""
    now, before = case.equilibrium, case.unbroken.equilibrium
    moved = np.sqrt(((now.position - before.position) ** 2).sum(axis=-1))
    trace = (now.rotation * before.rotation).sum(axis=(-1, -2))
    turned = np.degrees(np.arccos(np.clip((trace - 1) / 2, -1.0, 1.0)))
    # rounding of the cosine of a small angle is not told
    shift, turn = (np.where(part > least, part, 0.0) for part, least in ((moved, 1e-9), (turned, 1e-5)))
    fallen = (turned > MOST_TURNED) | (moved > MOST_MOVED * now.catenary.span.chord.max())
    parts = []
    for name, far, angle in zip(now.suspension.body_names, shift.tolist(), turn.tolist(), strict=True):
        words = [f"moves by {far:.4g} m"] * (far > 0) + [f"turns by {angle:.4g} deg"] * (angle > 0)
        parts += [f"{name} {' and '.join(words)}"] if words else []
    return parts, [name for name, down in zip(now.suspension.body_names, fallen, strict=True) if down]
