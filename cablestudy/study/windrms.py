"""Command `windrms`: what the wind does to the gondola, with and without the winch loop."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.control.winch import Loop, Notch
from cablestudy.wind import rms
from cablestudy.wind.spectrum import admittance, force_spectrum, speed_spectrum

TOLERANCE = 1e-6  # relative, of each variance
BELOW = (0.1, 1.0, 10.0)  # frequencies up to which the share of the variance is given [Hz]
NARROW = 20  # poles up to so many times the gondola's frequency get panels of their own
SLOW, FAST = 1e-7, 3e3  # range of integration over the slowest and fastest of gondola and wind


@dataclass(frozen=True)
class Response:
    """RMS of the gondola along x.

    Attributes
    ----------
    displacement, velocity : float
        With the winch loop; as without it where there is none. [m], [m/s]
    open_displacement, open_velocity : float
        Without it. [m], [m/s]
    error : float
        Largest estimated relative error of the four by integration. [-]
    shares : tuple of float
        Of the variance of the displacement below each of BELOW. [-]
    evaluations : int
        Frequencies that it took. [-]
    """

    displacement: float
    velocity: float
    open_displacement: float
    open_velocity: float
    error: float
    shares: tuple
    evaluations: int


def loop_of(case):
    """The winch loop of a case; without a controller its gain is zero.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Loop
    """
    scene = case.scene
    controller = scene.winch.controller if scene.winch else None
    loop = Loop(case.end_model, scene.gondola.mass, scene.winch.location if scene.winch else "ground")
    if controller is None:
        return loop
    loop = replace(loop, notch=_notch(case, controller.notch))
    if isinstance(controller.gain, float | int):
        return replace(loop, gain=float(controller.gain))
    return loop.with_margin(controller.gain.auto.gain_margin)


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


def spectra_of(loop, force):
    """Spectra of the gondola: displacement and velocity with control, displacement and velocity without.

    Parameters
    ----------
    loop : Loop
    force : callable
        Frequencies [Hz] -> spectrum of the force on the gondola [N^2/Hz].

    Returns
    -------
    callable
        Frequencies, shape (n,) [Hz] -> shape (4, n). [m^2/Hz], [m^2/s^2/Hz]
    """

    def spectra(frequency):
        omega = 2 * np.pi * frequency
        alone, held = (np.abs(compliance) ** 2 for compliance in loop.compliances(1j * omega))
        driven = force(frequency)
        return np.stack([held * driven, held * driven * omega**2, alone * driven, alone * driven * omega**2])

    return spectra


def force_of(case):
    """The spectrum of the wind's force on the gondola of a case: frequencies [Hz] -> [N^2/Hz]."""
    gondola, wind = case.scene.gondola, case.scene.wind
    return lambda frequency: force_spectrum(frequency, wind, gondola.area, gondola.drag_coefficient)


def respond(loop, force, corner, tolerance=TOLERANCE):
    """RMS of the gondola under a force spectrum.

    Parameters
    ----------
    loop : Loop
        Stable.
    force : callable
        Frequencies [Hz] -> spectrum of the force on the gondola [N^2/Hz].
    corner : float
        Where the force spectrum begins to fall. [Hz]
    tolerance : float
        Relative, of each variance.

    Returns
    -------
    Response
    """
    spectra = spectra_of(loop, force)
    poles = loop.visible(loop.open_poles if not loop.gain else np.concatenate([loop.open_poles, loop.closed_poles]))
    centre, width = np.abs(poles) / (2 * np.pi), np.abs(poles.real) / (2 * np.pi)
    main = np.abs(loop.gondola_pole) / (2 * np.pi)
    near = centre < NARROW * main
    low, high = SLOW * min(main, corner), FAST * max(main, corner)
    edges = rms.breakpoints(low, high, centre[near], width[near], (*BELOW, corner, *centre[~near]))
    found = rms.integrate(spectra, edges, tolerance)
    # below the range a loop without gain is flat
    flat = spectra(np.array([low]))[:, 0] * low
    variance = found.value + flat * np.array([not loop.gain, 0, 1, 0])
    below = np.cumsum(found.panels[:, 0]) / found.value[0]
    shares = tuple(float(np.interp(mark, found.edges[1:], below)) if mark < high else 1.0 for mark in BELOW)
    return Response(*map(float, np.sqrt(variance)), float((found.error / variance).max()), shares, found.evaluations)


def response_of(case, loop, tolerance=TOLERANCE):
    """RMS of the gondola of a case in its wind.

    Parameters
    ----------
    case : Case
    loop : Loop
    tolerance : float
        Relative, of each variance.

    Returns
    -------
    Response

    Raises
    ------
    NoSolutionError
        The loop is unstable.
    ConvergenceError
        The integral does not settle.
    """
    loop.check_stable()
    gondola, wind = case.scene.gondola, case.scene.wind

    def unit(frequency):
        turbulence = speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)
        return turbulence * admittance(frequency, wind.speed, gondola.area, wind.admittance)

    # the response is linear in the force, whose square might not be a number
    found = respond(loop, unit, wind.speed / wind.length_scale, tolerance)
    size = wind.air_density * gondola.drag_coefficient * gondola.area * wind.speed * wind.turbulence
    names = ("displacement", "velocity", "open_displacement", "open_velocity")
    return replace(found, **{name: size * getattr(found, name) for name in names})
