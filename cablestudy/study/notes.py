"""Notes and warnings of a row: the model, what it leaves out, and its errors; each function returns or yields texts."""

from functools import cache

import numpy as np

from cablestudy.cable.damping import grows_with_modes
from cablestudy.cable.initial_length import BELOW_LEAST
from cablestudy.scene.layers import value_at
from cablestudy.scene.likely_mistakes import bare_number
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.words import counted, first_of
from cablestudy.study.cable_columns import COLUMNS, over_strength, stress_of
from cablestudy.study.motion_columns import least_tension
from cablestudy.study.table_rows import SLACK
from cablestudy.study.tolerances import STUDY
from cablestudy.system.comparison import relative

STATED_TENSIONS = ("preload",), ("tension", "value")  # paths in the table of a cable
CLOSED_FORM = "statics and end stiffness: closed form of the elastic catenary, no elements"
NOTHING = ("nothing to model",)
STATIC = (CLOSED_FORM, "left out: inertia and modes, which no column needs")
DAMPING_IN_STATE_SPACES = {
    "modal": (),
    "hysteretic": (
        "damping: hysteretic, which has no state space: viscous in A, each mode with the ratio that dissipates the "
        "same energy",
    ),
    "kelvin_voigt": ("damping: Kelvin-Voigt, exact",),
}


def of_refined(case, error, tried):
    """Yield notes on the model of the motion, what it leaves out, and what it cost; see `Refinement`."""
    mesh = case.state.mesh
    yield (
        f"motion: {counted(mesh.elements, 'element')} of order {mesh.order} about the closed form, {case.dof} unknowns;"
        f" estimated error {error:.1e}, asked for {case.scene.model.accuracy:g}"
    )
    planes = [name for name in ("in_plane", "out_of_plane", "dynamics") if name in case.computed]
    if case.planar and planes in (["in_plane"], ["out_of_plane"]):
        asked_motion, excluded = ("in", "across") if planes == ["in_plane"] else ("across", "in")
        yield f"left out: motion {excluded} the cable's plane, since all that is asked for moves {asked_motion} it"
    yield f"compared: {counted(tried, 'model')}{', coarse to fine' if tried > 1 else ''}"


def of_system(case):
    """Yield notes on the linear system of gondola and cable, or of the bare cable, that was solved."""
    closed_loop = max((wind.loop_for_notes for wind in case.solved_winds), key=lambda wind: len(wind.motion))
    kept = f"{counted(len(closed_loop.modes), 'coupled mode')} up to {closed_loop.modes.frequency[-1]:.4g} Hz"
    static_shapes = len(closed_loop.motion) - len(closed_loop.modes)
    yield f"motion of {_moving(case)}: {kept}, and {counted(static_shapes, 'static shape')} for those above"


def of_coupled_modes(case):
    """Yield a note on the coupled modes of the cable and its gondola that were computed, without loop and wind."""
    bare = case.scene.gondola is None
    modes = case.computed["suspension"].largest_modes[0] if bare else case.gondola_mode.mode.modes
    yield f"motion of {_moving(case)}: {counted(len(modes), 'coupled mode')} up to {modes.frequency[-1]:.4g} Hz"


def _moving(case):
    """Words for what moves."""
    return "the cable" if case.scene.gondola is None else "gondola and cable"


def of_fixed(case):
    """Notes on fixed elements; warnings where a stress is too large, or their statics far from the continuous cable."""
    model, error, warnings = case.scene.model, statics_error(case), strength_warning(case)
    notes = (
        f"model: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says",
        f"statics: {case.convergence}; tensions and sag within {error:.1e} of the closed form",
    )
    if error <= STUDY.poor_statics:
        return notes, warnings
    return notes, (
        *warnings,
        f"warning: tensions or sag of {model.elements} elements of order {model.order} are {100 * error:.2g} % off"
        " those of the continuous cable; take more elements, or model.accuracy instead",
    )


def of_closed_form(case, over_strength):
    """Warnings on a case in closed form: tuple of str.

    They are on a stress above the strength, a sag that says little, and a wind whose growth with height matters.
    """
    warnings = strength_warning(case) if over_strength else ()
    if case.index not in case.results.failures:
        warnings += _beyond_ends(case)
    return warnings


def _beyond_ends(case):
    """At most one warning: loads or wind push a cable beyond its ends, so that its sag says little. Tuple of str."""
    results, index = case.results, case.index
    reach = float(results.reach_beyond_ends[index])
    if reach <= STUDY.rounding * results.span.chord[index]:
        return ()
    return (f"warning: the cable reaches {reach:.4g} m beyond its ends, so that sag, below its chord, says little",)


def judged_by(scene):
    """At most one note, on a loop: modes of the fixed elements, not of the cable, decide whether it is stable."""
    if scene.winch is None or scene.winch.controller is None:
        return ()
    return ("loop: judged by the modes of these elements, and not by those of the cable above",)


def comparison_notes(errors, status, quantity="motion"):
    """Yield notes on the errors of a model with a fixed number of elements, estimated by comparison with a finer model.

    Parameters
    ----------
    errors : dict
        Header of each compared column -> relative error, None where it is not known. [-]
    status : str
        Reason why errors are not known: status text of the results of the finer model.
    quantity : str
        Word for the compared columns, such as `motion`.

    Yields
    ------
    str
    """
    known_errors = {name: error for name, error in errors.items() if error is not None}
    unknown = [name for name in errors if name not in known_errors]
    if known_errors:
        worst = max(known_errors, key=known_errors.get)
        yield (
            f"{quantity}: estimated error {known_errors[worst]:.1e}, of {worst}, "
            f"against a model to an accuracy of {STUDY.reference_accuracy:g}"
        )
    if unknown:
        yield f"{quantity}: the error of {first_of(unknown, STUDY.listed_columns)} is not known: {status}"


def larger_by_loop(motions):
    """A note on RMS displacements that are larger with the loop than without, at most one. Returns a tuple of str.

    Parameters
    ----------
    motions : iterable of (str, float, float)
        Name of a displacement, its RMS with the loop and with the winches at rest [mm]; differences that three digits
        hide do not count.
    """
    rounded = [(name, f"{closed:.3g}", f"{at_rest:.3g}") for name, closed, at_rest in motions if closed > at_rest]
    larger = [f"{name} {closed} mm, not {at_rest} mm" for name, closed, at_rest in rounded if closed != at_rest]
    named = first_of(larger, STUDY.listed_columns)
    return (f"note: with the loop the RMS is larger than with the winch at rest: {named}",) if larger else ()


def beyond_linear(motions):
    """A note on displacements beyond the linear range, at most one. Returns a tuple of str.

    Parameters
    ----------
    motions : iterable of (str, float or None, float or None)
        Name of a displacement, its largest expected value, and its linear range; None where there is none. [mm]
    """
    exceeding = [f"{name} (peak {peak:.4g} mm, linear to {linear_range:.4g} mm)" for name, peak, linear_range in motions
           if None not in (peak, linear_range) and peak > linear_range]  # fmt: skip
    listed = first_of(exceeding, STUDY.listed_columns)
    return (f"note: beyond the range of linear motion: {listed}",) if exceeding else ()


def slack_warning(row):
    """A warning where the cable of a `Row` goes slack in the wind, at most one. Returns a tuple of str."""
    if SLACK not in row.cells["status"]:
        return ()
    least, _ = least_tension(row.case)
    return (f"warning: {SLACK}: {least:.4g} N at the largest displacement: the linear numbers do not hold",)


def strength_warning(case):
    """A warning where the stress is above the strength, at most one: tuple of str. An error without equilibrium."""
    if not over_strength(case):
        return ()
    force, area = float(case.number("cable.section_breaking_force")), float(case.number("cable.section_area"))
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
        "note: these are modes between fixed ends, with the gondola held; --coupled has those of cable and gondola",
    )


def reference_without_loads(scene):
    """Notes, at most one: the scene states a tension or a sag, and loads, but not whether it holds with them.

    Returns a tuple of str.
    """
    cable = scene.cable
    stated = [key for key in ("preload", "sag", "tension") if getattr(cable, key) is not None]
    if not (stated and cable.loads and "loads" not in cable.reference.model_fields_set):
        return ()
    return (
        f"note: cable.{stated[0]} is that of the cable without its point loads; cable.reference.loads: true "
        "states it with them, and false silences this note",
    )


def long_cables(names, length, chord, stated):
    """Note on cables whose stated sag or tension makes them much longer than the distance of their ends.

    A sag above two spans, or so little tension, is an equilibrium as any other, but mostly a mistaken unit.

    Parameters
    ----------
    names : sequence of str
        Name of each cable in the note; a single cable may have the name "", which is not shown.
    length, chord : sequence of float
        Unstretched length of each cable in the reference state, and distance of its ends. [m]
    stated : sequence of (str or None)
        Key by which each cable states its length, tension or sag; there is no note on a stated length.

    Returns
    -------
    tuple of str
        One note on all such cables; empty without one.
    """
    texts = [
        f"{name}{': ' if name else ''}the stated {key.replace('_', ' ')} is that of a cable of {cable_length:.4g} m, "
        f"{cable_length / span:.3g} times the distance of its ends"
        for name, cable_length, span, key in zip(names, length, chord, stated, strict=True)
        if key not in (None, "unstretched_length") and cable_length > SCENE.likely_length_ratio[1] * span
    ]
    return (f"note: {first_of(texts, STUDY.listed_columns)}",) if texts else ()


def long_cable(case):
    """`long_cables` of a scene of one cable; empty where it has no equilibrium."""
    cable = case.scene.cable
    stated = next((key for key in ("sag", "preload", "tension") if getattr(cable, key) is not None), None)
    if stated is None or case.index in case.results.failures:
        return ()
    return long_cables([""], [float(case.reference_length)], [float(cable.chord_length)], [stated])


def share_hint(document, scene, failure):
    """Hint, in brackets after a blank, behind the message on a stated tension that is too small (the `failure`).

    A number without a unit is in newtons. The tensions 0.2 and 20 are unlikely, but 20 % of the breaking force is
    usual. The hint is empty where a share is not likely to be meant.
    """
    if BELOW_LEAST not in failure or scene.cable.section_breaking_force is None:
        return ""
    for path in STATED_TENSIONS:
        number = bare_number(value_at(document.value, ("cable", *path)))
        if number is not None and 0 < number <= 100:
            share = f"{100 * number if number < 1 else number:.10g} %"
            return f' ({share} of the breaking force: write "{share}")'
    return ""


def above_accuracy(rows):
    """A note on numbers whose estimated error is above the accuracy that the scene asks for, at most one: tuple of str.

    Errors are compared as they are printed, with two digits. A probability that with its error is next to none has no
    note: that of one in a billion is always a large part of it. Nor has a number in which larger ones cancel, as the
    vertical force where a cable is level.

    Parameters
    ----------
    rows : iterable of (dict, dict, float or None)
        For each row of a table: name of a number -> its estimated relative error, None where it is not known [-]; name
        -> value, of probabilities at least; and the accuracy, None of a scene that states its elements instead [-].
    """
    above, asked = {}, set()  # name -> errors
    for errors, values, accuracy in rows:
        for name, error in errors.items() if accuracy is not None else ():
            if error is None or _is_remainder(name):
                continue
            if is_probability(name) and (values[name] or 0.0) * (1 + error) < STUDY.rare:
                continue
            if float(f"{error:.1e}") > accuracy:
                above.setdefault(name, []).append(error)
                asked.add(accuracy)
    if not above:
        return ()
    names = sorted(above, key=lambda name: -max(above[name]))
    texts = [f"{name} ({_up_to(max(above[name]))}, {counted(len(above[name]), 'row')})" for name in names]
    accuracies = " to ".join(f"{accuracy:g}" for accuracy in sorted({min(asked), max(asked)}))
    return (f"note: estimated errors above model.accuracy, {accuracies}: {first_of(texts, STUDY.listed_columns)}",)


def _quantity(name):
    """The name of a number without its cable before, or its table behind it."""
    return name.rpartition(".")[2].partition(" of ")[0]


def is_probability(name):
    """True of the name of a probability, with its cable or table or without."""
    return _quantity(name).startswith("slack_probability")


def _is_remainder(name):
    """True of the name of what remains of larger numbers (`Column.whole`), with its cable or table or without."""
    return _quantity(name) in _remainders()


@cache
def _remainders():
    """Headers of the columns of cables in which larger numbers cancel: set."""
    return {column.header for column in COLUMNS if column.whole is not None}


def _up_to(error):
    """Words for the largest of some estimated relative errors; of one above 1 no digit tells anything."""
    return "above 1" if error > 1 else f"up to {error:.1e}"


def assumed_damping(scene):
    """Notes, at most one: cables without damping get the default. Returns a tuple of str."""
    cables = scene.cables
    without_damping = [name for name, cable in cables.items() if "damping" not in cable.model_fields_set]
    if not without_damping:
        return ()
    names = first_of(without_damping, STUDY.listed_parts) if len(without_damping) < len(cables) else "the scene"
    damping = cables[without_damping[0]].damping
    return (
        f"damping: none is given for {names}; {damping.model}, with a ratio of {100 * damping.ratio:g} %, is assumed",
    )


def growing_damping(scene):
    """Notes, at most one: the modal damping of fixed elements grows with their number. Returns a tuple of str."""
    elements = scene.model.elements
    if elements is None or not grows_with_modes(scene.cable.damping):
        return ()
    return (unknown_with_modal_damping("the error of the RMS is", f"those of {elements} elements"),)


def unknown_with_modal_damping(what, modes):
    """A note that something is not known because damping is modal; `modes` is its part on their number."""
    return (
        f"note: {what} not known: modal damping grows with the number of modes, here {modes}; "
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
    on_cable = (
        f"{case.cable_air_damping:.4g} N s/m^2 on the cable too, where the wind on it counts (_cable_wind, _all_wind)"
    )
    if case.in_steady_wind:
        on_cable = "the steady wind of the load case damps the cable too"
    return (f"aerodynamic damping: {case.gondola_air_damping:.4g} N s/m on the gondola; {on_cable}; {switch}",)


def statics_error(case):
    """Relative error of the statics of fixed elements against the closed form. [-]

    The largest one of mean tension, largest tension, and sag; a sag below a thousandth of the chord counts relative to
    that.
    """
    numbers = []
    for results, row in (case.by_elements, (case.results, case.index)):
        statics = results.statics
        numbers.append([float(of_all[row]) for of_all in (statics.mean_tension, statics.max_tension, statics.sag)])
    (mean, largest, sag), (closed_mean, closed_largest, closed_sag) = numbers
    least_sag = STUDY.flat_cable * float(case.results.span.chord[case.index])
    errors = [
        abs(sag - closed_sag) / max(abs(closed_sag), least_sag),
        relative(mean, closed_mean),
        relative(largest, closed_largest),
    ]
    return max(error for error in errors if not np.isnan(error))  # a slack part without weight has no sag


def gondola_notes(case):
    """Yield notes where no single mode dominates the motion of the gondola, whose frequency then means little.

    The columns of the gondola describe the mode with the largest share in its static compliance along x (displacement
    over force). Where this share is less than a half, the notes list up to six other modes that move the gondola, and
    one whose share is as large within the error.
    """
    mode = case.gondola_mode.mode
    frequency, share, dominant = mode.modes.frequency, mode.shares, mode.number
    if share[dominant] >= STUDY.shared_compliance:
        return
    others = [k for k in range(len(share)) if k != dominant and share[k] >= STUDY.shown_compliance]
    others.sort(key=lambda k: -share[k])
    listed = ", ".join(f"{frequency[k]:.4g} Hz ({share[k]:.3g})" for k in others[:6])
    yield (
        f"gondola: the mode of {frequency[dominant]:.4g} Hz has only {share[dominant]:.3g} of its static "
        f"compliance; others move it too: {listed}"
    )
    least_equal_share = share[dominant] * (1 - 10 * (case.scene.model.accuracy or 0.0))
    equal = [k for k in others if share[k] >= least_equal_share]
    if equal:
        yield f"gondola: a tie, within the error the mode of {frequency[equal[0]]:.4g} Hz has as large a share"
