"""Notes on a suspension: what was modelled, what each cable was given, and what follows where cables are lost."""

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.scene.words import counted, first_of
from cablestudy.study.columns import find
from cablestudy.study.notes import averaged_wind, long_cables, of_comparison
from cablestudy.study.ssm import DAMPING_NOTES
from cablestudy.study.tolerances import STUDY
from cablestudy.system.superelement import grows_with_modes


def notes_of(case):
    """Lines for --explain.

    Parameters
    ----------
    case : SuspensionCase

    Returns
    -------
    tuple of str
        Empty where the case has no equilibrium, or none was computed.
    """
    if not case.solved:
        return ()
    found = case.equilibrium
    record, free = found.record, int(found.suspension.free.sum())
    residual = max(float(record.residual), STUDY.noted_force)
    shown = f"{10.0 ** np.ceil(np.log10(residual)):g}"
    return (
        f"statics: {counted(len(found.suspension.cable_names), 'cable')} in closed form, "
        f"{counted(free, 'free displacement')}; {counted(int(record.steps), 'Newton step')}, "
        f"net force below {shown} of the forces",
        *_of_load_case(case),
        *_of_slack(found),
        *_of_wind(case),
        *(line for modes in case.largest_modes for line in _of_modes(modes)),
        *of_comparison(case.differences, case.reason),
    )


def strength_warning(case):
    """A warning that names the cables whose stress is above their strength, at most one. Returns a tuple of str.

    Raises
    ------
    NoSolutionError, ConvergenceError
        The case has no stable equilibrium.
    """
    weak = [f"{name} (utilisation {share:.4g})" for name, share in case.over_strength.items()]
    return (f"warning: the stress is above the strength: {first_of(weak, STUDY.listed_parts)}",) if weak else ()


def warnings_of(case):
    """Warnings and notes on a case beside its results, a tuple of str.

    `strength_warning`, `averaged_wind`, `lost_notes`, `moved_note`, and where cables state what only a much longer
    cable has `notes.long_cables`.
    """
    reference, place = case.group.reference, case.index
    chord = np.asarray(reference.catenary.span.chord)[place]
    names, given = reference.suspension.cable_names, reference.suspension.given
    long = long_cables(names, np.asarray(reference.lengths)[place].tolist(), chord.tolist(), given)
    averaged = averaged_wind(case.scene.load_case, case.group.drag_error(case.index))
    return (*strength_warning(case), *averaged, *lost_notes(case), *moved_note(case), *long)


def moved_note(case):
    """A note on free points and bodies that stated tensions and sags move, at most one. Returns a tuple of str.

    The lengths follow from what is stated with all forces on, so that a force beside those that are always there cuts
    the cables anew. What moves less than the longest stretch of its cables may as well have been pulled there.
    """
    scene = case.scene
    if scene.solve_for != "pose" or all(cable.unstretched_length is not None for cable in scene.cables.values()):
        return ()
    reference = case.group.reference
    suspension = reference.suspension
    stating = np.array([kind != "unstretched_length" for kind in suspension.given])
    if suspension.force_density is not None:
        return ()
    catenary, place = reference.catenary, case.index
    stretch = np.asarray(catenary.stretched_length - catenary.span.unstretched_length)[place]
    holders = {**scene.bodies, **{name: point for name, point in scene.points.items() if point.free}}
    told = []
    for body, name in enumerate(suspension.body_names):
        own = (suspension.owner[suspension.of_cables] == body).any(axis=-1)
        moved = float(np.linalg.norm(reference.position[place, body] - holders[name].at))
        if (own & stating).any() and moved > stretch[own].max():
            told.append(f"{name} by {moved:.4g} m")
    if not told:
        return ()
    return (
        f"note: the stated tensions or sags move {first_of(told, STUDY.listed_parts)} from its place in the file (at), "
        "more than its cables stretch: their lengths follow with all forces on; "
        "a force in a load case (cases.NAME.forces) keeps "
        "them",
    )


def _of_load_case(case):
    """What the load case is about, and what its drag leaves out."""
    scene = case.scene
    if scene.case is None:
        return
    error = case.group.drag_error(case.index)
    drag = f"; drag is uniform along each cable: estimated error {error:.1e}" if error else ""
    yield f"load case {scene.case}: on the unstretched lengths of the reference state{drag}"


def _of_slack(found):
    """Cables that hang by their own weight: the mean tension is below it."""
    if slack := slack_cables(found):
        yield f"slack: {first_of(slack, STUDY.listed_parts)}"


def _of_wind(case):
    """How the motion in the wind and under control was computed, where it was."""
    if not case.moves:
        return
    closed_loop, wind = case.in_wind.described, case.scene.wind
    modes, strokes = len(closed_loop.modes), sum(not one.wheel for one in closed_loop.actuators)
    shapes = counted(len(closed_loop.motion) - len(closed_loop.plant.kept) - strokes, "static shape")
    if closed_loop.loop is not None and case.model is not None:
        yield (
            f"loop: judged by the modes of these elements, up to {_highest(closed_loop):.4g} Hz, and not by those "
            "of the cables above"
        )
    some = f"{modes} coupled modes up to {closed_loop.modes.frequency[-1]:.4g} Hz"
    yield f"motion: {some}, {shapes} for those above, {counted(strokes, 'stroke')}"
    if wind is not None:
        about = "about the equilibrium in the mean wind" if wind.mean else "about the equilibrium without wind"
        if case.scene.load_case.wind is not None:
            about = "about the equilibrium in the steady wind of the load case"
        damped = "with" if wind.aerodynamic_damping else "without"
        yield f"wind on {'bodies and cables' if wind.on == 'both' else wind.on}: {about}, {damped} aerodynamic damping"
    if closed_loop.loop is not None:
        yield from _of_loop(closed_loop, wind)
    if case.damped_by_modes:
        yield "modal damping grows with the number of modes of a cable; hysteretic, kelvin_voigt and viscous do not"


def _of_loop(closed_loop, wind):
    law, for_ = closed_loop.loop.law, ", ".join(closed_loop.measured)
    gains = "" if law.integrates_only else f": {law.described(closed_loop.loop.gain, 4)}"
    yield f"loop of {counted(len(closed_loop.winches), 'cable')} for {for_}{gains}"
    yield from law_notes(closed_loop.loop)
    if wind is not None and wind.mean:
        yield "displacements by the mean wind are those with the winches at rest; the loop takes them back in time"
    if closed_loop.scene.control.measured is None and len(closed_loop.measured) < len(closed_loop.free):
        left = [name for name in closed_loop.free if name not in closed_loop.measured]
        yield f"not measured, as no winch moves it to speak of: {', '.join(left)}"


def law_notes(loop):
    """Lines on the lag of the winches and the delay of a `Loop`."""
    law = loop.law
    if law.bandwidth < np.inf:
        yield f"winches: a lag of first order of {law.bandwidth / (2 * np.pi):.4g} Hz"
    if loop.slight_delay:
        yield f"delay of {law.delay:.4g} s: not in poles and state space: it turns no phase that matters by 0.005 rad"
    elif law.delay:
        right = loop.right_up_to / (2 * np.pi)
        yield f"delay of {law.delay:.4g} s: Padé approximants, whose phase is right to 1e-7 up to {right:.4g} Hz"


def _of_modes(modes):
    """What each cable was given for the coupled modes, and which modes coincide."""
    error = modes.error.max(initial=0.0)
    stated = "" if np.isnan(error) else f"; estimated error {error:.1e}"
    yield f"modes: {len(modes)} of a linear model with {len(modes.shapes)} coordinates{stated}"
    reasons = {}
    for cable in modes.cables:
        reasons.setdefault(cable.reason, []).append(cable.name)
    for reason, names in list(reasons.items())[: STUDY.listed_parts]:
        yield f"{first_of(names, STUDY.listed_parts)}: {reason}"
    yield from _of_modal_damping(modes.damped.solution.models)
    for first, last in modes.coincident[: STUDY.listed_parts]:
        yield f"modes {first} to {last} coincide: their motions may be combined at will"
    if len(modes.coincident) > STUDY.listed_parts:
        yield f"and {len(modes.coincident) - STUDY.listed_parts} more runs of modes that coincide"


def _highest(closed_loop):
    """Of all modes of cables that a loop was judged with. [Hz]"""
    return closed_loop.driven.highest_mode / (2 * np.pi)


def damping_notes(scene):
    """Which damping is assumed, and how a state space represents that of the cables: lines."""
    yield from assumed_damping(scene)
    for law in dict.fromkeys(cable.damping.model for cable in scene.cables.values()):
        yield from DAMPING_NOTES[law]


def assumed_damping(scene):
    """Which damping is assumed, at most one line."""
    cables = scene.cables
    silent = [name for name, cable in cables.items() if "damping" not in cable.model_fields_set]
    if silent:
        named = first_of(silent, STUDY.listed_parts) if len(silent) < len(cables) else "the scene"
        damping = cables[silent[0]].damping
        assumed = f"{damping.model}, with a ratio of {100 * damping.ratio:g} %, is assumed"
        yield f"damping: none is given for {named}; {assumed}"


def _of_modal_damping(models):
    """Why damping ratios depend on the models of cables with modal damping."""
    damped = {place for place, one in enumerate(models.cables.damping) if grows_with_modes(one)}
    counts = [group.ends.omega.shape[-1] for group in models.groups if not damped.isdisjoint(group.places.tolist())]
    if counts:
        number = f"{min(counts)} to {max(counts)}" if min(counts) < max(counts) else f"{counts[0]}"
        yield (
            f"damping ratios: modal damping grows with the number of modes, {number} of each cable here: take "
            "hysteretic, kelvin_voigt or viscous"
        )


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
    begin, slack = f"without {first_of(lost, STUDY.listed_parts)}", slack_cables(case.equilibrium)
    ends = (
        f"{'slack: ' + first_of(slack, STUDY.listed_parts) if slack else 'no cable is slack'}; "
        "this is the equilibrium that follows, on the unstretched lengths of the reference state: "
        "the snap itself, which pulls more for a moment, is not computed"
    )
    try:
        moved, down = _movements(case)
        changes = _changes(case)
    except (NoSolutionError, ConvergenceError) as error:
        return f"note: {begin} {ends}", f"note: {begin} nothing is compared: with all cables, {error}"
    told = first_of(moved, STUDY.listed_parts) or "nothing moves"
    stands = f"warning: {begin} it falls to where it hangs now" if down else f"note: {begin} it stands"
    parts = [f"{word} in {first_of(names, STUDY.listed_parts)}" for word, names in changes.items() if names]
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
        if abs(change) > STUDY.noted_change:
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
    fallen = (turned > STUDY.standing_turn) | (moved > STUDY.standing_movement * now.catenary.span.chord.max())
    parts = []
    for name, far, angle in zip(now.suspension.body_names, shift.tolist(), turn.tolist(), strict=True):
        words = [f"moves by {far:.4g} m"] * (far > 0) + [f"turns by {angle:.4g} deg"] * (angle > 0)
        parts += [f"{name} {' and '.join(words)}"] if words else []
    return parts, [name for name, down in zip(now.suspension.body_names, fallen, strict=True) if down]
