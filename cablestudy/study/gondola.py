"""The gondola's mode on the cable of cases: its frequency, and its damping ratio."""

import numpy as np

from cablestudy.control.complex_stiffness import ComplexStiffness, damping_ratio
from cablestudy.control.gondola import coupled_modes, damped_pole, gondola_mode
from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.study.cache import share
from cablestudy.study.models import MAX_MODES

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
        pole = damped_pole(case.end_model_along_x, mass, case.gondola_air_damping, omega, case.gondola_share > DISTINCT)
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
