"""Gondola and winch loop of cases."""

from dataclasses import replace
from math import ceil

import numpy as np

from cablestudy.cable.element import PER_WAVE
from cablestudy.control.complex_stiffness import ComplexStiffness, damping_ratio
from cablestudy.control.gondola import coupled_modes, damped_pole, gondola_mode
from cablestudy.control.law import INTEGRATOR, Law
from cablestudy.control.plant import Notch, Plant
from cablestudy.control.stability import MOST_MODES, Waves, driven_up_to, too_many
from cablestudy.control.winch import Loop
from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.study.cache import share
from cablestudy.study.models import MAX_MODES

RESOLVED = 1e-7  # largest error of the frequency of a mode that the gain could drive
RESERVE = 9  # orders of each element beyond those that its waves need
HIGHEST, MOST_ORDERS = 44, 600  # of an element, and of the longest smooth piece
MOST_TO_CONFIRM = 900  # of a piece, of a cable that confirms a largest gain
FINER = 1.3  # models that follow each other, in orders
TRIALS = 4
LIMIT_STEP = 1.25  # of the frequency up to which modes are resolved
RESPONSE_SHARE = 0.01  # of the accuracy: error by modes that the response leaves out
NO_DAMPING, NEARLY_REAL = 1e-12, 1e-6  # ratio that is none; imaginary part over size of a pole without oscillation
LIGHT, DISTINCT = (1e-4, 0.1), 0.8  # damping ratios, and share, with which the gondola's pole is found at once


def coupled_of(cases):
    """Undamped frequencies of gondola and cable together of some cases.

    Parameters
    ----------
    cases : sequence of Case

    Returns
    -------
    list
        For each case frequencies [Hz] and their shares in the gondola's static compliance; or the error that says why
        there are none.
    """
    return [_or_error(_coupled, case) for case in cases]


def _coupled(case):
    limit, inertia = case.gondola_modes * case.gondola_frequency_static, case.end_inertia
    stiffness, mass = case.end_stiffness_along(0), case.scene.gondola.mass
    # the slow modes of heavy masses leave only rounding of the moments of the others
    every = bool(case.model.mesh.point_masses) and case.excited.dof <= MAX_MODES
    limit = np.inf if every else limit
    while True:
        modes = case.excited.modes(case.excited.dof) if every else case.excited.up_to(limit)
        count = int(np.searchsorted(modes.frequency, limit, side="right"))
        complete = modes.complete and count == len(modes)
        participation = case.participation(modes)[:count]
        frequency, share = coupled_modes(mass, stiffness, modes.frequency[:count], participation, inertia)
        needed = case.gondola_modes * float(frequency[gondola_mode(share)])
        if complete or needed <= 1.5 * limit:
            return frequency, share
        limit = needed


def loop_of(case):
    """The winch loop of a case; without a controller its gain is zero.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Loop

    Raises
    ------
    NoSolutionError, ConvergenceError
    """
    controller = _controller(case)
    if controller is None:
        return Loop.of(case.plant, 0.0)
    gain = law_of(case)[1]
    if gain is not None:
        return Loop.of(case.plant, gain)
    auto = controller.gain.auto
    return Loop.of(case.plant, 0.0).with_margins(auto.gain_margin, auto.sensitivity)


def plant_of(case, rate=0.0):
    """All of the loop that does not depend on the gain.

    Parameters
    ----------
    case : Case
    rate : float
        Viscous damping of the cable by the air, per mass. [1/s]

    Returns
    -------
    Plant

    Raises
    ------
    NoSolutionError, ConvergenceError
    """
    scene, controller = case.scene, _controller(case)
    accuracy = scene.model.accuracy if case.exact_statics else None
    return Plant(
        with_viscous(case.end_model_along_x, rate),
        scene.gondola.mass,
        scene.winch.location if scene.winch else "ground",
        _notch(case, controller.notch) if controller else None,
        2 * np.pi * case.gondola_frequency,
        RESPONSE_SHARE * accuracy if accuracy else 0.0,
        _resolution(case, rate) if accuracy or scene.cable.damping.model != "modal" else None,
        case.results.known_of_plants.setdefault((*case.plant_key, rate), {}),
        case.gondola_air_damping,
        law_of(case)[0],
    )


def law_of(case):
    """The `Law` of the winch of a case, and what it is multiplied by [rad/s]; None where that follows from a margin.

    With a proportional or derivative part the gain of the loop is K_i + K_p w + K_d w^2 at the gondola's frequency w on
    the static end stiffness, which no refinement changes.
    """
    winch, controller = case.scene.winch, _controller(case)
    if controller is None:
        return INTEGRATOR, 0.0
    omega = None if controller.integrates_only else 2 * np.pi * case.gondola_frequency_static
    return law_from(controller, winch, omega)


def law_from(controller, drive, omega=None):
    """The `Law` of a `Controller` and a `Drive`, and what it is multiplied by [rad/s]: None where a margin decides.

    That is K_i + K_p w + K_d w^2 at a frequency w [rad/s]; without one K_i.
    """
    turn = 2 * np.pi
    driven = {"delay": drive.delay, "bandwidth": np.inf if drive.bandwidth is None else turn * drive.bandwidth}
    if not isinstance(controller.gain, float | int):
        return Law(**driven), None
    if controller.integrates_only:
        return Law(**driven), float(controller.gain)
    gains = controller.gain, controller.proportional_gain, controller.derivative_gain
    whole = sum(gain * (omega or 0.0) ** order for order, gain in enumerate(gains))
    corner = np.inf if controller.derivative_filter is None else turn * controller.derivative_filter
    return Law(*(gain / whole for gain in gains), corner=corner, **driven), float(whole)


def with_viscous(cable, rate):
    """A `Superelement` with more viscous damping, per mass [1/s]."""
    return replace(cable, viscous=cable.viscous + rate) if rate else cable


def loop_in_air(case, loop):
    """A loop of a case with the damping of its cable by the air.

    Parameters
    ----------
    case : Case
    loop : Loop

    Returns
    -------
    Loop
        The one given where the air does not damp the cable.

    Raises
    ------
    NoSolutionError, ConvergenceError
    """
    return Loop.of(case.plant_in_air, loop.gain) if case.cable_air_rate else loop


def gondola_damping_ratio(case):
    """Damping ratio of the gondola's mode, the winch at rest.

    Parameters
    ----------
    case : Case

    Returns
    -------
    float
        [-]

    Raises
    ------
    NoSolutionError
        So much damping that no oscillation is left of that mode.
    """
    damping, omega, mass = case.scene.cable.damping, 2 * np.pi * case.gondola_frequency, case.scene.gondola.mass
    try:
        pole = damped_pole(case.end_model_along_x, mass, case.gondola_air_damping, omega)
        ratio = -pole.real / abs(pole)
    except NoSolutionError:  # so much damped strain that modes are spoilt by rounding
        pole, ratio = -omega + 0j, 1.0
    if damping.model == "modal":
        if abs(ratio) < NO_DAMPING:
            return 0.0
        if ratio > 0 and abs(pole.imag) < NEARLY_REAL * abs(pole):
            return 1.0
        if not (0.3 * omega < abs(pole) < 3 * omega and ratio > 0):
            raise NoSolutionError("the gondola's mode is damped so much that it is no oscillation")
        return float(ratio)
    if LIGHT[0] < ratio < LIGHT[1] and case.gondola_share > DISTINCT and abs(abs(pole) / omega - 1) < LIGHT[1]:
        return float(ratio)
    # where modes share the motion, or damping is very small or large, it is followed from no damping to all of it
    amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
    stiffness = ComplexStiffness(case.excited, case.frame[:, 0], damping.viscous / float(case.span.mass))
    return damping_ratio(stiffness, mass, omega, damping.model, amount, case.gondola_air_damping)


def loop_at_rest_of(case):
    """The loop of a case with the winch at rest, which needs no gain.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Loop

    Raises
    ------
    NoSolutionError, ConvergenceError
    """
    return Loop.of(case.plant, 0.0)


def prepare(cases):
    """Compute the coupled modes of cases, once for those that share them; what one cannot have it says when asked.

    Parameters
    ----------
    cases : sequence of Case
    """
    cases = [case for case in cases if case.scene.gondola is not None and case.scene.gondola.mass is not None]
    share(cases, "coupled", coupled_of)


def _or_error(function, case):
    """What a function gives for a case, or the error that it raises."""
    try:
        return function(case)
    except CablestudyError as error:
        return error


def _controller(case):
    return case.scene.winch.controller if case.scene.winch else None


def _notch(case, notch):
    if notch is None:
        return None
    frequency = notch.frequency
    if frequency == "coupled":
        frequency = case.gondola_frequency
    elif frequency == "static":
        frequency = case.gondola_frequency_static
    turn = 2 * np.pi
    return Notch(turn * frequency, notch.damping_ratio, turn * notch.rolloff_frequency, notch.rolloff_damping_ratio)


def _resolution(case, rate):
    """What gives a plant the cable with every mode right that a gain could drive: see `Plant.resolved`."""
    found, known = {}, []

    def resolved(plant, gain, finer):
        if not known:
            known.append(_waves(case))
        limit = driven_up_to(plant, known[0], gain)
        # in steps, so that gains that are alike share a model
        limit = float(plant.main * LIMIT_STEP ** np.ceil(np.log(limit / plant.main) / np.log(LIMIT_STEP)))
        if (limit, finer) not in found:
            cable = _resolved(case, plant, gain, limit, known[0].time_across, finer)
            found[limit, finer] = with_viscous(cable, rate)
        return found[limit, finer], limit

    return resolved


def _waves(case):
    """`Waves` at the ends of the cable of a case."""
    span, tangents = case.span, case.catenary.at(np.array([0.0, 1.0]))[1]
    tension = np.sqrt((tangents**2).sum(axis=-1))
    cosine = (tangents @ span.frame[:, 0]) / tension
    across = np.sqrt(tension * span.mass) * np.maximum(1 - cosine**2, 0.0)
    along = np.sqrt(span.axial_stiffness * span.mass) * cosine**2
    time = float(span.unstretched_length * np.sqrt(span.mass / span.axial_stiffness))
    mesh = case.model.mesh
    part = float(np.diff(np.unique([0.0, *mesh.node_positions[mesh.carried > 0], 1.0])).min())
    return Waves(float(across.max()), float(along.max()), float(case.results.travel_time[case.index]), time, part)


def _resolved(case, plant, gain, limit, time, finer):
    """The superelement of a case whose modes up to a frequency [rad/s], those that a gain could drive, are resolved.

    With elements whose orders are `finer` times what these modes need.
    """
    half_waves, said = limit / np.pi * time if np.isfinite(limit) else np.inf, plant.said(gain, 4)
    longest = float(case.results.longest_segment[case.index])
    orders = PER_WAVE * half_waves * longest
    modes = half_waves * (sum(len(axes) for axes in case.excited.planes) - 1)  # across the cable
    if not orders <= MOST_ORDERS or (plant.drives_every_mode and modes > MOST_MODES):
        raise too_many(said, int(min(modes, 1e9)), limit)
    several = max(1, ceil(orders / (HIGHEST - RESERVE)))
    own = case.level[0] * case.level[1] if case.level else 0
    total = finer * (orders + several * RESERVE)
    if finer > 1 and total > MOST_TO_CONFIRM:
        raise too_many(said, int(modes), limit)
    total = own if total <= own else ceil(total)
    for _ in range(TRIALS):
        elements = ceil(total / HIGHEST)
        order = ceil(total / elements)
        level = case.level if total == own else (elements, order)
        model = case if level == case.level else case.refined(*level)
        modes = model.excited.modes(model.excited.dof)
        if modes.errors[2 * np.pi * modes.frequency <= limit].max(initial=0.0) <= RESOLVED:
            return model.end_model_along_x
        total = ceil(FINER * total) + 2
    raise NoSolutionError(f"the modes that {said} could drive, up to {limit / (2 * np.pi):.4g} Hz, are not resolved")
