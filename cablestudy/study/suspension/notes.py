"""Notes on a suspension: on its models, on the modes of each cable, and on the movements where cables are lost."""

import numpy as np

from cablestudy.cable.damping import grows_with_modes
from cablestudy.errors import ConvergenceError, NoSolutionError, outcome_of
from cablestudy.scene.words import counted, first_of
from cablestudy.study.columns import find
from cablestudy.study.notes import (
    DAMPING_IN_STATE_SPACES,
    assumed_damping,
    comparison_notes,
    long_cables,
    unknown_with_modal_damping,
)
from cablestudy.study.tolerances import STUDY


def notes_of(case):
    """Notes on how the numbers of a case were computed, the lines of the option --explain.

    Statics, load case, slack cables, motion in the wind, coupled modes, and comparison with a finer model.

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
    equilibrium = case.equilibrium
    record, free = equilibrium.record, int(equilibrium.suspension.free.sum())
    residual = max(float(record.residual), STUDY.noted_force)
    bound = f"{10.0 ** np.ceil(np.log10(residual)):g}"
    return (
        f"statics: {counted(len(equilibrium.suspension.cable_names), 'cable')} in closed form, "
        f"{counted(free, 'free displacement')}; {counted(int(record.steps), 'Newton step')}, "
        f"net force below {bound} of the forces",
        *_of_load_case(case),
        *_of_slack(equilibrium),
        *_of_wind(case),
        *(line for modes in case.largest_modes for line in mode_notes(modes, case.mode_errors(modes))),
        *comparison_notes(case.differences, case.reason),
    )


def strength_warning(case):
    """A warning that names the cables whose stress is above their strength, at most one. Returns a tuple of str.

    Raises
    ------
    NoSolutionError, ConvergenceError
        The case has no stable equilibrium.
    """
    overloaded = [f"{name} (utilisation {utilisation:.4g})" for name, utilisation in case.over_strength.items()]
    listed = first_of(overloaded, STUDY.listed_parts)
    return (f"warning: the stress is above the strength: {listed}",) if overloaded else ()


def warnings_of(case):
    """Warnings and notes on a case in addition to its results, a tuple of str.

    `strength_warning`, `notes_on_lost_cables`, `notes_on_stated`, and `notes.long_cables` for cables much longer than
    their spans.
    """
    reference, index = case.group.reference, case.index
    chord = np.asarray(reference.catenary.span.chord)[index]
    names, stated = reference.suspension.cable_names, reference.suspension.stated
    notes_on_length = long_cables(names, np.asarray(reference.lengths)[index].tolist(), chord.tolist(), stated)
    return (*strength_warning(case), *notes_on_lost_cables(case), *notes_on_stated(case), *notes_on_length)


def notes_on_stated(case):
    """Notes on the meaning of the tensions and sags that a scene states, by a case of it; tuple of str."""
    return *_note_on_moved_bodies(case), *_reference_without_loads(case.scene)


def _reference_without_loads(scene):
    """Notes, at most one: cables have point loads, and none says whether the reference state has them; tuple of str.

    Nothing depends on it where all cables state their unstretched length.
    """
    loaded = [name for name, cable in scene.cables.items()
              if cable.loads and "loads" not in cable.reference.model_fields_set]  # fmt: skip
    if not loaded or all(cable.unstretched_length is not None for cable in scene.cables.values()):
        return ()
    placed = ", and where bodies stand," if scene.solve_for == "lengths" else ""
    return (
        f"note: what cables state{placed} is without the point loads of {first_of(loaded, STUDY.listed_parts)}; "
        "reference.loads: true of these cables states it with them, and false silences this note",
    )


def _note_on_moved_bodies(case):
    """Note on bodies and free points that stated tensions or sags move from their place in the file, at most one.

    Where a cable states a tension or sag, its unstretched length follows with all forces of the scene acting. A force
    that was meant to displace a body then changes the lengths instead, and the body may end up elsewhere. A movement is
    reported if it is larger than the stretch of each cable of the body, by which tension alone could explain it.

    Parameters
    ----------
    case : SuspensionCase

    Returns
    -------
    tuple of str
    """
    scene = case.scene
    if scene.solve_for != "pose" or all(cable.unstretched_length is not None for cable in scene.cables.values()):
        return ()
    if case.group.reference.suspension.force_density is not None:
        return ()
    # tables of bodies and free points, which state `at`
    tables = {**scene.bodies, **{name: point for name, point in scene.points.items() if point.free}}
    moved_bodies = [f"{name} by {distance:.4g} m" for name, distance in _distances_from_places(case, tables).items()]
    if not moved_bodies:
        return ()
    loads = [load for table in tables.values() for load in (*table.force, *getattr(table, "moment", ()))]
    if any(load != 0 for load in loads):
        advice = "their lengths follow with all forces on; a force in a load case (cases.NAME.forces) keeps them"
    else:
        advice = "an unstretched_length of one of its cables, in place of a tension, decides where it is"
    return (
        f"note: the stated tensions or sags move {first_of(moved_bodies, STUDY.listed_parts)} from its place in the "
        f"file (at), more than its cables stretch: {advice}",
    )


def _distances_from_places(case, tables):
    """Distances of bodies and free points from their places in the scene, where stretch does not explain them.

    Left out are those none of whose cables states a tension or a sag, and those no farther away than the largest
    stretch of their cables.

    Parameters
    ----------
    case : SuspensionCase
    tables : dict
        Name of each body or free point -> its table, which states its place `at`.

    Returns
    -------
    dict
        Name -> distance. [m]
    """
    reference, index = case.group.reference, case.index
    suspension, catenary = reference.suspension, reference.catenary
    states_tension = np.array([kind != "unstretched_length" for kind in suspension.stated])
    stretch = np.asarray(catenary.stretched_length - catenary.span.unstretched_length)[index]
    distances = {}
    for body, name in enumerate(suspension.body_names):
        of_body = (suspension.owner[suspension.of_cables] == body).any(axis=-1)  # cables
        distance = float(np.linalg.norm(reference.position[index, body] - tables[name].at))
        if (of_body & states_tension).any() and distance > stretch[of_body].max():
            distances[name] = distance
    return distances


def _of_load_case(case):
    """Yield a note on the load case."""
    scene = case.scene
    if scene.case is None:
        return
    drag = "; drag varies along each cable" if case.group.in_steady_wind else ""
    yield f"load case {scene.case}: on the unstretched lengths of the reference state{drag}"


def _of_slack(equilibrium):
    """Yield a note on slack cables, if there are any."""
    if slack := slack_cables(equilibrium):
        yield f"slack: {first_of(slack, STUDY.listed_parts)}"


def _of_wind(case):
    """Yield notes on the model of the motion in the wind and under control; none where this motion was not computed.

    In this order: modes by which the loop is judged; modes and static shapes of the model; the equilibrium about which
    it is linear, with aerodynamic damping or without; the loop; and modal damping.
    """
    if not case.moves:
        return
    closed_loop, wind = case.analysis.loop_for_notes, case.scene.wind
    modes, strokes = len(closed_loop.modes), sum(not actuator.wheel for actuator in closed_loop.actuators)
    shapes = counted(len(closed_loop.motion) - len(closed_loop.plant.kept) - strokes, "static shape")
    loop = outcome_of(lambda: closed_loop.loop)
    controlled = loop is not None and not isinstance(loop, Exception)  # columns say why there is no gain
    if controlled and case.fixed:
        yield (
            f"loop: judged by the modes of these elements, up to {_highest(closed_loop):.4g} Hz, and not by those "
            "of the cables above"
        )
    kept = f"{counted(modes, 'coupled mode')} up to {closed_loop.modes.frequency[-1]:.4g} Hz"
    yield f"motion: {kept}, {shapes} for those above, {counted(strokes, 'stroke')}"
    if wind is not None:
        state = "about the equilibrium in the mean wind" if wind.mean else "about the equilibrium without wind"
        if case.scene.load_case.wind is not None:
            state = "about the equilibrium in the steady wind of the load case"
        damped = "with" if wind.aerodynamic_damping else "without"
        yield f"wind on {'bodies and cables' if wind.on == 'both' else wind.on}: {state}, {damped} aerodynamic damping"
    if controlled:
        yield from _of_loop(closed_loop, wind)
    if case.damped_by_modes:
        yield "modal damping grows with the number of modes of a cable; hysteretic, kelvin_voigt and viscous do not"


def _of_loop(closed_loop, wind):
    """Yield notes on the loop of the winches."""
    law, coordinates = closed_loop.loop.law, ", ".join(closed_loop.body.measured)
    gains = "" if law.integrates_only else f": {law.described(closed_loop.loop.gain, 4)}"
    yield f"loop of {counted(len(closed_loop.winches), 'cable')} for {coordinates}{gains}"
    yield from law_notes(closed_loop.loop)
    if wind is not None and wind.mean:
        yield "displacements by the mean wind are those with the winches at rest; the loop takes them back in time"
    if closed_loop.scene.control.measured is None and len(closed_loop.body.measured) < len(closed_loop.body.free):
        unmeasured = [name for name in closed_loop.body.free if name not in closed_loop.body.measured]
        yield f"not measured, as no winch moves it to speak of: {', '.join(unmeasured)}"


def law_notes(loop):
    """Lines on the lag of the winches and the delay of a `Loop`."""
    law = loop.law
    if law.bandwidth < np.inf:
        yield f"winches: a lag of first order of {law.bandwidth / (2 * np.pi):.4g} Hz"
    if loop.slight_delay:
        yield f"delay of {law.delay:.4g} s: not in poles and state space: it turns no phase that matters by 1e-6 rad"
    elif law.delay:
        accurate = f"accurate to 1e-7 up to {loop.delay_accurate_up_to / (2 * np.pi):.4g} Hz"
        yield f"delay of {law.delay:.4g} s: Padé approximants, whose phase is {accurate}"


def mode_notes(modes, errors):
    """Yield notes on the coupled modes: their number and errors, the model of each cable, and modes that coincide."""
    error = errors.max(initial=0.0)
    stated = "" if np.isnan(error) else f"; estimated error {error:.1e}"
    yield f"modes: {len(modes)} of a linear model with {len(modes.shapes)} coordinates{stated}"
    reasons = {}
    for cable in modes.cables:
        reasons.setdefault(cable.reason, []).append(cable.name)
    for reason, names in list(reasons.items())[: STUDY.listed_parts]:
        yield f"{first_of(names, STUDY.listed_parts)}: {reason}"
    for first, last in modes.coincident[: STUDY.listed_parts]:
        yield f"modes {first} to {last} coincide: their motions may be combined at will"
    if len(modes.coincident) > STUDY.listed_parts:
        yield f"and {len(modes.coincident) - STUDY.listed_parts} more runs of modes that coincide"


def _highest(closed_loop):
    """Highest frequency of the modes of cables by which the stability of a loop was judged. [Hz]"""
    return closed_loop.stability.driven.resolving.highest_mode / (2 * np.pi)


def damping_notes(scene):
    """Yield notes on the damping that is assumed, and on how a state space represents that of the cables."""
    yield from assumed_damping(scene)
    for law in dict.fromkeys(cable.damping.model for cable in scene.cables.values()):
        yield from DAMPING_IN_STATE_SPACES[law]


def unknown_damping_ratios(modes):
    """Notes, at most one, on damping ratios of `CoupledModes` that depend on the number of modes. Returns a tuple."""
    models = modes.damped.models
    with_modal_damping = {cable for cable, damping in enumerate(models.cables.damping) if grows_with_modes(damping)}
    groups = [group for group in models.groups if not with_modal_damping.isdisjoint(group.cable_indices.tolist())]
    counts = [group.ends.omega.shape[-1] for group in groups]
    if not counts or not len(modes.layout.free):
        return ()
    number = f"{min(counts)} to {max(counts)}" if min(counts) < max(counts) else f"{counts[0]}"
    ratios = "damping ratios of modes that move ends of cables are"
    return (unknown_with_modal_damping(ratios, f"{number} of each cable"),)


def notes_on_lost_cables(case):
    """Notes on a load case with lost cables: what moves and which tensions change, against the case with all cables.

    Parameters
    ----------
    case : SuspensionCase

    Returns
    -------
    tuple of str
        Two notes, or a warning and a note where a body falls; empty where no cable is lost.

    Raises
    ------
    NoSolutionError, ConvergenceError
        Without these cables there is no stable equilibrium.
    """
    lost = case.scene.load_case.lost
    if not lost:
        return ()
    without, slack = f"without {first_of(lost, STUDY.listed_parts)}", slack_cables(case.equilibrium)
    about_equilibrium = (
        f"{'slack: ' + first_of(slack, STUDY.listed_parts) if slack else 'no cable is slack'}; "
        "this is the equilibrium that follows, on the unstretched lengths of the reference state: "
        "the snap itself, which pulls more for a moment, is not computed"
    )
    try:
        movement_texts, fallen_bodies = _movements(case)
        change_texts = _tension_change_texts(case)
    except (NoSolutionError, ConvergenceError) as error:
        return f"note: {without} {about_equilibrium}", f"note: {without} nothing is compared: with all cables, {error}"
    movements = first_of(movement_texts, STUDY.listed_parts) or "nothing moves"
    outcome = f"warning: {without} it falls to where it hangs now" if fallen_bodies else f"note: {without} it stands"
    changes = [f"{word} in {first_of(texts, STUDY.listed_parts)}" for word, texts in change_texts.items() if texts]
    tension_text = "; ".join(changes) or "as before in each cable"
    return f"{outcome}: {movements}; {about_equilibrium}", f"note: {without} the largest tension is {tension_text}"


def fallen(case):
    """Names of bodies and free points that fall where cables are lost: list; raises as `notes_on_lost_cables`."""
    try:
        return _movements(case)[1] if case.scene.load_case.lost else []
    except (NoSolutionError, ConvergenceError):
        return []  # with all cables there is nothing to compare with


def slack_cables(equilibrium):
    """Names of the cables of an `Equilibrium` of one case that hang by their own weight: list."""
    span, tension = equilibrium.catenary.span, np.asarray(equilibrium.catenary.mean_tension)
    slack = np.flatnonzero((np.asarray(span.chord_strain) < 0) & (tension < span.weight))
    return [equilibrium.suspension.cable_names[cable] for cable in slack]


def _tension_change_texts(case):
    """Texts on cables whose largest tension is more, or less, than with all cables, the largest change first.

    Returns
    -------
    dict
        `more`, `less` -> list of str.
    """
    tension = find("max_tension")
    tension_before = dict(zip(case.unbroken.scene.cables, case.unbroken.of_cables(tension).tolist(), strict=True))
    texts = {"more": [], "less": []}
    pairs = zip(case.scene.cables, case.of_cables(tension).tolist(), strict=True)
    changes = [(now / tension_before[name] - 1, name, now) for name, now in pairs if tension_before[name] > 0]
    for change, name, now in sorted(changes, key=lambda item: -round(abs(item[0]), 6)):  # equal ones as in the file
        if abs(change) > STUDY.noted_change:
            texts["more" if change > 0 else "less"].append(f"{name} ({now:.4g} N, {100 * change:+.3g} %)")
    return texts


def _movements(case):
    """Texts on the movements of bodies and free points by lost cables; and names of those that have fallen: lists."""
    equilibrium, unbroken = case.rest, case.unbroken.rest
    distance = np.sqrt(((equilibrium.position - unbroken.position) ** 2).sum(axis=-1))
    trace = (equilibrium.rotation * unbroken.rotation).sum(axis=(-1, -2))
    angle = np.degrees(np.arccos(np.clip((trace - 1) / 2, -1.0, 1.0)))
    span, names, texts = equilibrium.catenary.span, equilibrium.suspension.body_names, []
    longest = float(span.chord.max())
    fallen = (angle > STUDY.standing_turn) | (distance > STUDY.standing_movement * longest)
    for name, metres, degrees in zip(names, distance.tolist(), angle.tolist(), strict=True):
        words = [f"moves by {metres:.4g} m"] if metres > STUDY.noted_movement * longest else []
        words += [f"turns by {degrees:.4g} deg"] if degrees > 1e-5 else []  # less is rounding of the cosine
        texts += [f"{name} {' and '.join(words)}"] if words else []
    return texts, [name for name, has_fallen in zip(names, fallen, strict=True) if has_fallen]
