"""Notes and warnings of a row: what was modelled, what was left out, and how far it can be trusted."""

import numpy as np

from cablestudy.cable.initial_length import BELOW_LEAST
from cablestudy.scene.cable_table import LIKELY_RATIO
from cablestudy.scene.likely_mistakes import bare_number
from cablestudy.scene.words import first_of
from cablestudy.study.columns import over_strength, relative, stress_of, tensions_at_peak
from cablestudy.study.status import SLACK
from cablestudy.study.tolerances import STUDY
from cablestudy.system.superelement import grows_with_modes

STATED_TENSIONS = ("preload",), ("tension", "value")  # of a cable
CLOSED_FORM = "statics and end stiffness: closed form of the elastic catenary, no elements"
NOTHING = ("nothing to model",)
STATIC = (CLOSED_FORM, "left out: inertia and modes, which no column needs")


def of_refined(case, error, tried):
    """Yield notes on the model of the motion, what it leaves out, and what it cost; see `Refinement`."""
    mesh = case.model.mesh
    yield (
        f"motion: {mesh.elements} element(s) of order {mesh.order} about the closed form, {case.dof} unknowns;"
        f" estimated error {error:.1e}, asked for {case.scene.model.accuracy:g}"
    )
    planes = [name for name in ("in_plane", "out_of_plane", "dynamics") if name in case.computed]
    if case.planar and planes in (["in_plane"], ["out_of_plane"]):
        there, excluded = ("in", "across") if planes == ["in_plane"] else ("across", "in")
        yield f"left out: motion {excluded} the cable's plane, since all that is asked for moves {there} it"
    yield f"compared: {tried} models, coarse to fine"


def of_system(case):
    """Yield notes on the linear system of gondola and cable, or of the bare cable, that was solved."""
    closed_loop = max((one.described for one in case.solved_winds), key=lambda one: len(one.motion))
    some = f"{len(closed_loop.modes)} coupled modes up to {closed_loop.modes.frequency[-1]:.4g} Hz"
    more = len(closed_loop.motion) - len(closed_loop.modes)
    what = "the cable" if case.scene.gondola is None else "gondola and cable"
    yield f"motion of {what}: {some}, and {more} static shapes for those above"


def of_gondola(case):
    """Yield a note on the coupled modes of gondola and cable that were computed, where no loop and no wind was."""
    modes = case.gondola_mode.mode.modes
    yield f"motion of gondola and cable: {len(modes)} coupled modes up to {modes.frequency[-1]:.4g} Hz"


def of_fixed(case):
    """Notes on fixed elements; warnings where a stress is too large, or their statics far from the continuous cable."""
    model, error, warnings = case.scene.model, statics_error(case), strength_warning(case)
    averaged = float(case.results.drag_error[case.index]) if case.scene.load_case.grows_with_height else 0.0
    known = f", in which the wind is averaged over the height: estimated error {averaged:.1e}" if averaged else ""
    notes = (
        f"model: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says",
        f"statics: {case.model.convergence}; tensions and sag within {error:.1e} of the closed form{known}",
    )
    if error <= max(STUDY.poor_statics, averaged):
        return notes, warnings
    return notes, (
        *warnings,
        f"warning: tensions or sag of {model.elements} elements of order {model.order} are {100 * error:.2g} % off"
        " those of the continuous cable; take more elements, or model.accuracy instead",
    )


def averaged_wind(load_case, error, remedy=""):
    """A note on a wind that grows with the height and is averaged along cables, at most one. Returns a tuple of str.

    Parameters
    ----------
    load_case : CommonLoadCase
    error : float
        Estimated, of drag that is taken as uniform, relative. [-]
    remedy : str
        What has none.
    """
    if not load_case.grows_with_height or error <= STUDY.poor_statics:
        return ()
    return (
        f"note: the wind is averaged over the height of each cable: estimated error up to {100 * error:.2g} %{remedy}",
    )


def of_closed_form(case, over_strength):
    """Warnings on a case in closed form: a stress above the strength, a wind whose growth matters. Tuple of str."""
    found = strength_warning(case) if over_strength else ()
    if not case.scene.load_case.grows_with_height or case.index in case.results.failures:
        return found
    error = float(case.results.drag_error[case.index])
    return found + averaged_wind(case.scene.load_case, error, "; the elements of model: {elements: 100} follow it")


def judged_by(scene):
    """Whose modes decide whether the loop of a cable of fixed elements is stable: at most one note."""
    if scene.winch is None or scene.winch.controller is None:
        return ()
    return ("loop: judged by the modes of these elements, and not by those of the cable above",)


def of_comparison(errors, status, what="motion"):
    """Yield notes on the comparison of a fixed model with a finer one.

    Parameters
    ----------
    errors : dict
        Header -> relative error, None where it is not known.
    status : str
        Of the finer model's row.
    what : str
        What was compared, in a word.
    """
    known = {name: error for name, error in errors.items() if error is not None}
    unknown = [name for name in errors if name not in known]
    if known:
        worst = max(known, key=known.get)
        yield (
            f"{what}: estimated error {known[worst]:.1e}, of {worst}, "
            f"against a model to an accuracy of {STUDY.reference_accuracy:g}"
        )
    if unknown:
        yield f"{what}: the error of {first_of(unknown, STUDY.listed_columns)} is not known: {status}"


def larger_by_loop(found):
    """A note on what the loop moves more than the winches at rest would, at most one. Returns a tuple of str.

    Parameters
    ----------
    found : iterable of (str, float, float)
        What moves, its RMS displacement with the loop and with the winches at rest [mm]; differences that three digits
        hide do not count.
    """
    shown = [(name, f"{closed:.3g}", f"{at_rest:.3g}") for name, closed, at_rest in found if closed > at_rest]
    larger = [f"{name} {closed} mm, not {at_rest} mm" for name, closed, at_rest in shown if closed != at_rest]
    named = first_of(larger, STUDY.listed_columns)
    return (f"note: with the loop the RMS is larger than with the winch at rest: {named}",) if larger else ()


def beyond_linear(found):
    """A note on what moves farther than its motion is linear, at most one. Returns a tuple of str.

    Parameters
    ----------
    found : iterable of (str, float or None, float or None)
        What moves, its largest expected displacement, and how far it moves linearly; None where there is none. [mm]
    """
    far = [f"{name} (peak {peak:.4g} mm, linear to {reach:.4g} mm)" for name, peak, reach in found
           if None not in (peak, reach) and peak > reach]  # fmt: skip
    return (f"note: beyond the range of linear motion: {first_of(far, STUDY.listed_columns)}",) if far else ()


def slack_warning(row):
    """A warning where the cable of a `Row` goes slack in the wind, at most one. Returns a tuple of str."""
    if SLACK not in row.cells["status"]:
        return ()
    least, _ = tensions_at_peak(row.case)
    return (f"warning: {SLACK}: {least:.4g} N at the largest displacement: the linear numbers do not hold",)


def strength_warning(case):
    """A warning where the stress is above the strength, at most one. Returns a tuple of str.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium.
    """
    if not over_strength(case):
        return ()
    force, area = float(case.given("cable.section_breaking_force")), float(case.given("cable.section_area"))
    if np.isnan(area):
        tension = float(case.statics.max_tension)
        return (f"warning: the tension of {tension:.4g} N is above the breaking force of {force:.4g} N",)
    stress = float(stress_of(case)) / 1e6
    return (f"warning: the stress of {stress:.4g} MPa is above the strength of {force / area / 1e6:.4g} MPa",)


def fixed_gondola(scene):
    """Notes, at most one: modes are those of the cable between fixed ends though it holds a gondola; tuple of str."""
    if scene.gondola is None:
        return ()
    return (
        "note: these are modes between fixed ends, with the gondola held; the column gondola_frequency "
        "('cablestudy find', studies) is that of the gondola on the cable, and as a suspension with a body a scene has "
        "all modes together",
    )


def reference_without_loads(scene):
    """Notes, at most one: the scene states a tension or a sag, and loads, but not whether it holds with them.

    Returns a tuple of str.
    """
    cable = scene.cable
    stated = [key for key in ("preload", "sag", "tension") if getattr(cable, key, None) is not None]
    if not (stated and getattr(cable, "loads", ()) and "loads" not in cable.reference.model_fields_set):
        return ()
    return (
        f"note: cable.{stated[0]} is that of the cable without its point loads; cable.reference.loads: true "
        "states it with them, and false silences this note",
    )


def long_cables(named, length, chord, stated):
    """Notes, at most one, on sags and tensions that only a cable has that is much longer than its span.

    A sag above two spans, or so little tension, is an equilibrium as any other, but mostly a slip of a unit.

    Parameters
    ----------
    named : sequence of str
        What messages call each cable; empty of the only one.
    length, chord : sequence of float
        Unstretched length in the reference state, distance of the ends. [m]
    stated : sequence of (str or None)
        What each states; of a cable that states its length nothing is told.

    Returns
    -------
    tuple of str
    """
    told = [
        f"{name}{': ' if name else ''}the stated {kind.replace('_', ' ')} is that of a cable of {own:.4g} m, "
        f"{own / span:.3g} times the distance of its ends"
        for name, own, span, kind in zip(named, length, chord, stated, strict=True)
        if kind not in (None, "unstretched_length") and own > LIKELY_RATIO[1] * span
    ]
    return (f"note: {first_of(told, STUDY.listed_columns)}",) if told else ()


def long_cable(case):
    """`long_cables` of a scene of one cable; empty where it has no equilibrium."""
    cable = case.scene.cable
    stated = next((key for key in ("sag", "preload", "tension") if getattr(cable, key) is not None), None)
    if stated is None or case.index in case.results.failures:
        return ()
    return long_cables([""], [float(case.reference_length)], [float(cable.chord_length)], [stated])


def share_hint(document, scene, failure):
    """Hint where a tension is refused as too small, and a share of the breaking force is likely to be meant.

    Parameters
    ----------
    document : Document
    scene : CableScene
        The same in SI.
    failure : str
        Why there is no answer.

    Returns
    -------
    str
        Empty, or a blank and the hint in brackets.
    """
    known = getattr(getattr(scene, "cable", None), "section_breaking_force", None)  # a suspension has several cables
    if BELOW_LEAST not in failure or known is None:
        return ""
    for path in STATED_TENSIONS:
        value = document.value["cable"]
        for key in path:
            value = value.get(key) if isinstance(value, dict) else None
        number = bare_number(value)
        if number is not None and 0 < number <= 100:
            share = f"{100 * number if number < 1 else number:.10g} %"
            return f' ({share} of the breaking force: write "{share}")'
    return ""


def assumed_damping(scene):
    """Notes, at most one: a scene without damping gets the default. Returns a tuple of str."""
    if "damping" in scene.cable.model_fields_set:
        return ()
    damping = scene.cable.damping
    return (f"damping: the scene gives none; {damping.model}, with a ratio of {100 * damping.ratio:g} %, is assumed",)


def growing_damping(scene):
    """Notes, at most one: the modal damping of fixed elements grows with their number. Returns a tuple of str."""
    elements = scene.model.elements
    if elements is None or not grows_with_modes(scene.cable.damping):
        return ()
    return (f"note: {unknown_rms_error(f'those of {elements} elements')}",)


def unknown_rms_error(modes):
    """Why an RMS with modal damping states no error, in words; `modes` says how many there are."""
    return (
        f"the error of the RMS is not known: modal damping grows with the number of modes, here {modes}; "
        "hysteretic and Kelvin-Voigt damping have a limit"
    )


def air_damping(case):
    """Notes, at most one, on the damping of gondola and cable by the air. Returns a tuple of str."""
    wind, gondola = case.scene.wind, case.scene.gondola
    if wind is None or not wind.aerodynamic_damping:
        return ()
    switch = "wind.aerodynamic_damping: false leaves it out"
    if gondola is None:
        return (f"aerodynamic damping: the drag of the cable damps its motion ({switch})",)
    return (
        f"aerodynamic damping: {case.gondola_air_damping:.4g} N s/m on the gondola; "
        f"{case.cable_air_damping:.4g} N s/m^2 on the cable too, where the wind on it counts (_cable_wind, _all_wind); "
        f"{switch}",
    )


def statics_error(case):
    """Relative error of the statics of fixed elements against the closed form, the largest of three. [-]

    Of mean tension, largest tension, and sag; a sag below a thousandth of the chord counts relative to that.
    """
    own, closed, index = case.statics, case.results.statics, case.index
    mean, largest, sag = (float(part[index]) for part in (closed.mean_tension, closed.max_tension, closed.sag))
    errors = [
        abs(float(own.sag) - sag) / max(abs(sag), STUDY.flat_cable * float(case.results.span.chord[index])),
        relative(float(own.mean_tension), mean),
        relative(float(own.max_tension), largest),
    ]
    return max(error for error in errors if not np.isnan(error))  # a slack part without weight has no sag


def gondola_notes(case):
    """Lines on which modes share the gondola's motion, where none has half of its static compliance.

    Parameters
    ----------
    case : Case

    Yields
    ------
    str
    """
    mode = case.gondola_mode.mode
    frequency, share, first = mode.modes.frequency, mode.shares, mode.number
    if share[first] >= STUDY.shared_compliance:
        return
    others = sorted(
        (k for k in range(len(share)) if k != first and share[k] >= STUDY.shown_compliance), key=lambda k: -share[k]
    )
    listed = ", ".join(f"{frequency[k]:.4g} Hz ({share[k]:.3g})" for k in others[:6])
    yield (
        f"gondola: the mode of {frequency[first]:.4g} Hz has only {share[first]:.3g} of its static compliance; "
        f"others move it too: {listed}"
    )
    tie = [k for k in others if share[k] >= share[first] * (1 - 10 * (case.scene.model.accuracy or 0.0))]
    if tie:
        yield f"gondola: a tie, within the error the mode of {frequency[tie[0]]:.4g} Hz has as large a share"
