"""Command `windrms`: what the wind does to the gondola, with and without the winch loop."""

from dataclasses import dataclass, field, replace
from math import ceil, frexp, hypot, inf, ldexp, log, prod

import numpy as np

from cablestudy.control.plant import NEAR
from cablestudy.errors import NoSolutionError
from cablestudy.wind import rms
from cablestudy.wind.imaging import correction_weight, exposure_weight
from cablestudy.wind.peak import peak_factor
from cablestudy.wind.spectrum import admittance, force_spectrum, speed_spectrum

TOLERANCE = 1e-6  # relative, of each variance
BELOW = (0.1, 1.0, 10.0)  # frequencies up to which the share of the variance is given [Hz]
SLOW, FAST = 1e-2, 3e3  # range over the slowest and fastest of gondola and wind in which much may happen,
SLOWER = np.array([1e-6, 1e-4, 1e-2])  # and boundaries below it, over its lower end
STEP = 10  # by which that range is widened at once
FASTEST = 1e6  # wind, over the gondola's frequency, beyond which it is white for all that moves
FAR = 1e100  # wind over gondola and gondola over wind beyond which squares are no numbers
NUMBERS = ("displacement", "velocity", "open_displacement", "open_velocity")


@dataclass(frozen=True)
class GondolaResponse:
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
    imaged : dict
        What a telescope sees of the displacement, by the names of `weights_of`. [m]
    """

    displacement: float
    velocity: float
    open_displacement: float
    open_velocity: float
    error: float
    shares: tuple
    evaluations: int
    imaged: dict = field(default_factory=dict)


def weights_of(scene):
    """Which parts of the gondola's motion a telescope sees: name -> factor of the spectrum, of frequencies [Hz].

    `exposure`, within one exposure; `corrected`, behind the correcting mirror; `corrected_exposure`, both; as far as
    the scene has them.
    """
    weights = {}
    if scene.exposure is not None:
        weights["exposure"] = lambda frequency: exposure_weight(frequency, scene.exposure)
    if scene.correction is not None:
        mirror = scene.correction.bandwidth, scene.correction.delay
        weights["corrected"] = lambda frequency: correction_weight(frequency, *mirror)
    if len(weights) == 2:
        exposed, corrected = weights.values()
        weights["corrected_exposure"] = lambda frequency: exposed(frequency) * corrected(frequency)
    return weights


def mirror_poles(correction):
    """Pole of the correcting mirror that is nearest to zero, s + 2 pi bandwidth exp(-s delay) = 0: a list. [rad/s]"""
    from scipy.special import lambertw

    if correction is None:
        return []
    fastest, delay = 2 * np.pi * correction.bandwidth, correction.delay
    return [complex(lambertw(-fastest * delay) / delay if delay else -fastest)]


def spectra_of(loop, force, weights=()):
    """Spectra of the gondola: displacement and velocity with control, displacement and velocity without.

    Parameters
    ----------
    loop : Loop
    force : callable
        Frequencies [Hz] -> spectrum of the force on the gondola [N^2/Hz].
    weights : collection of callable
        Frequencies [Hz] -> further factors of the displacement with control [-].

    Returns
    -------
    callable
        Frequencies, shape (n,) [Hz] -> shape (4 + number of weights, n). [m^2/Hz], [m^2/s^2/Hz]
    """

    def spectra(frequency):
        alone, held = loop.squares(frequency)
        driven = force(frequency)
        result = np.empty((4 + len(weights), len(frequency)))
        np.multiply(held, driven, out=result[0])
        np.multiply(alone, driven, out=result[2])
        np.multiply(result[:4:2], (2 * np.pi * frequency) ** 2, out=result[1:4:2])
        for row, weight in zip(result[4:], weights, strict=True):
            np.multiply(result[0], weight(frequency), out=row)
        return result

    return spectra


def force_of(case):
    """The spectrum of the wind's force on the gondola of a case: frequencies [Hz] -> [N^2/Hz]."""
    gondola, wind = case.scene.gondola, case.scene.wind
    return lambda frequency: force_spectrum(frequency, wind, gondola.area, gondola.drag_coefficient)


def cable_force_of(case):
    """The spectrum of the wind's force on the gondola by way of the cable, from where it moves the gondola more.

    Parameters
    ----------
    case : Case

    Returns
    -------
    callable
        Frequencies of the range that matters, in order [Hz] -> [N^2/Hz]; zero where nothing reaches the gondola.
    """
    from cablestudy.study.cable_wind import DIRECTIONS, CableWind

    wind, on_cable = case.scene.wind, CableWind(case)
    size = prod((
        wind.air_density, wind.cable_drag_coefficient, case.scene.wind_diameter, on_cable.length, wind.speed,
        wind.turbulence,
    ))  # fmt: skip
    spectra = list(filter(None, [on_cable.spectrum(direction) for direction in DIRECTIONS]))
    loop = case.loop_in_air.whole

    def force(frequency):
        found = [size**2 * spectrum(frequency) for spectrum in spectra]
        moved = [np.trapezoid(spectra_of(loop, lambda _, f=f: f)(frequency)[0], frequency) for f in found]
        return found[int(np.argmax(moved))] if found else np.zeros_like(frequency)

    return force


def tolerance_of(scene):
    """How well the variances of a scene are integrated: better than its model is, and TOLERANCE at least. [-]"""
    return min(TOLERANCE, (scene.model.accuracy or 1.0) / 10)


def respond(loop, force, corner, tolerance=TOLERANCE, cable=False, weights=None, mirror=()):
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
    cable : bool
        Whether every mode of the cable may stand in the spectrum, since the force comes along the cable, or since
        weights raise what is fast.
    weights : dict, optional
        Of `weights_of`.
    mirror : sequence of complex
        Poles of the mirror in these. [rad/s]

    Returns
    -------
    GondolaResponse

    Raises
    ------
    NoSolutionError
        Wind and gondola are too far apart, or the variance is no number.
    """
    main = float(np.abs(loop.gondola_pole)) / (2 * np.pi)
    weights = weights or {}
    spectra = spectra_of(loop, force, weights.values())
    poles = np.concatenate([loop.plant.every_pole if cable else [], loop.observable_poles, mirror])
    fastest = NEAR * max(main, loop.excited.omega.min(initial=np.inf) / (2 * np.pi) if cable else 0.0)
    edges = panels(main, corner, poles, fastest, FASTEST * main if weights else 0.0)
    found = rms.integrate(spectra, edges, tolerance)
    # a loop without gain is flat below the range
    variance = found.value + below_range(found) * np.array([not loop.gain, 0, 1, 0] + [0] * len(weights))
    if not (np.isfinite(variance) & (variance > 0)).all():
        raise NoSolutionError("the wind's force on the gondola is too small or too large for a number")
    below = np.cumsum(found.panels[:, 0]) / found.value[0]
    shares = tuple(np.interp(BELOW, found.edges[1:], below).tolist())
    numbers = np.sqrt(variance).tolist()
    error, imaged = float((found.error / variance).max()), dict(zip(weights, numbers[4:], strict=True))
    return GondolaResponse(*numbers[:4], error, shares, found.evaluations, imaged)


def panels(main, corner, poles, fastest, high=0.0, what="the gondola"):
    """Boundaries of the panels over which a response to the wind is integrated.

    Parameters
    ----------
    main : float
        Frequency of what moves most. [Hz]
    corner : float
        Where the force spectrum begins to fall. [Hz]
    poles : ndarray, shape (k,)
        [rad/s]
    fastest : float
        Below it each pole has boundaries of its own around it. [Hz]
    high : float
        Up to where the range goes at least. [Hz]
    what : str
        Moves, for the message.

    Returns
    -------
    ndarray
        Ascending. [Hz]

    Raises
    ------
    NoSolutionError
        Wind and motion are too far apart.
    """
    if not main / FAR < corner < main * FAR:
        raise NoSolutionError(f"wind of {corner:.3g} Hz (speed/length_scale) is too far from {what}'s {main:.3g} Hz")
    centre, width = np.abs(poles) / (2 * np.pi), np.abs(poles.real) / (2 * np.pi)
    near = centre < fastest
    # in steps, and not at the wind's corner, so that loops in different winds are evaluated at the same frequencies
    calm = SLOW * main / STEP ** max(0, ceil(log(main / corner, STEP)))
    high = max(high, FAST * main * STEP ** max(0, ceil(log(min(corner / main, FASTEST), STEP))))
    marks = np.concatenate([BELOW, centre[~near]])
    edges = rms.breakpoints(calm, high, centre[near], width[near], marks[(calm < marks) & (marks < high)], main)
    slow = [mark for mark in BELOW if calm * SLOWER[0] < mark < calm * (1 - 1e-9)]
    return np.concatenate([np.sort([*(calm * SLOWER), *slow]), edges])


def below_range(found):
    """Integrals below the range of an `Integral`, of spectra that are flat there as in its lowest panel."""
    first, second = found.edges[:2]
    return found.panels[0] * (first / (second - first))


def response_of(case, loop, tolerance=None):
    """RMS of the gondola of a case by the wind on the gondola.

    Parameters
    ----------
    case : Case
    loop : Loop
    tolerance : float
        Relative, of each variance.

    Returns
    -------
    GondolaResponse

    Raises
    ------
    NoSolutionError
        The loop is unstable, or a number is too large for one.
    ConvergenceError
        The integral does not settle.
    """
    loop.check_stable()
    scene, (unit, corner, factors) = case.scene, unit_force(case)
    tolerance, weights = tolerance or tolerance_of(scene), weights_of(scene)
    if weights:  # they raise motion that is faster than the gondola's, and modes that hardly matter without them
        found = respond(loop.whole, unit, corner, tolerance, True, weights, mirror_poles(scene.correction))
    else:
        found = respond(loop, unit, corner, tolerance)
    return _scaled(found, *factors)


def winch_response_of(case, loop):
    """As `response_of`, with `winch_speed` [m/s] and `winch_acceleration` [m/s^2] of a winch on which the loop acts.

    Both are factors of the spectrum of the displacement: |s C|^2 and |s^2 C|^2.
    """
    loop.check_stable()

    def weight(order):
        return lambda frequency: np.abs(
            loop.gain * loop.controller(2j * np.pi * frequency) * (2j * np.pi * frequency) ** order
        ) ** 2  # fmt: skip

    weights = {"winch_speed": weight(1), "winch_acceleration": weight(2)}
    force, corner, factors = unit_force(case)
    return _scaled(respond(loop.whole, force, corner, tolerance_of(case.scene), True, weights), *factors)


def winch_speed_of(response, wind):
    """RMS of the winch's speed, and its expected largest value within the wind's duration (Davenport, 1964). [m/s]"""
    rms, acceleration = (response.imaged[name] for name in ("winch_speed", "winch_acceleration"))
    return rms, float(peak_factor(acceleration / (2 * np.pi * rms), wind.duration)) * rms


def unit_force(case):
    """The spectrum of the wind's force on the gondola of a case over its size, its corner [Hz], factors of its root.

    The response is linear in the force, whose square might not be a number.
    """
    gondola, wind = case.scene.gondola, case.scene.wind

    def unit(frequency):
        turbulence = speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)
        return turbulence * admittance(frequency, wind.speed, gondola.area, wind.admittance)

    factors = wind.air_density, gondola.drag_coefficient, gondola.area, wind.speed, wind.turbulence
    return unit, wind.speed / wind.length_scale, factors


def cable_response_of(case, loop):
    """RMS of the gondola of a case by the wind on the cable.

    Parameters
    ----------
    case : Case
    loop : Loop
        With the damping of the cable by the air.

    Returns
    -------
    GondolaResponse
        Each number the larger one of wind across and along the cable; shares of the variance for that of the larger
        displacement.

    Raises
    ------
    NoSolutionError, ConvergenceError
        As `response_of`.
    """
    from cablestudy.study.cable_wind import DIRECTIONS, CableWind

    loop.check_stable()
    wind, on_cable = case.scene.wind, CableWind(case)
    spectra = filter(None, [on_cable.spectrum(direction) for direction in DIRECTIONS])
    corner, tolerance = wind.speed / wind.length_scale, tolerance_of(case.scene)
    # the wind on the cable shakes modes that a force on the gondola hardly does
    found = [respond(loop.whole, spectrum, corner, tolerance, cable=True) for spectrum in spectra]
    if not found:  # a straight cable without weight does not pass on what is normal to it
        return GondolaResponse(0.0, 0.0, 0.0, 0.0, 0.0, (0.0,) * len(BELOW), 0)
    worst = max(found, key=lambda response: response.displacement)
    worst = replace(
        worst,
        error=max(response.error for response in found),
        evaluations=sum(response.evaluations for response in found),
        **{name: max(getattr(response, name) for response in found) for name in NUMBERS},
    )
    size = wind.air_density, wind.cable_drag_coefficient, case.scene.wind_diameter, on_cable.length
    return _scaled(worst, *size, wind.speed, wind.turbulence)


def combine(first, second):
    """RMS by two forces that have nothing to do with each other: variances add; of what is imaged nothing is kept.

    Parameters
    ----------
    first, second : GondolaResponse

    Returns
    -------
    GondolaResponse
    """
    numbers = {name: hypot(getattr(first, name), getattr(second, name)) for name in NUMBERS}
    weights = [(part.displacement / (numbers["displacement"] or 1.0)) ** 2 for part in (first, second)]
    shares = tuple(
        sum(weight * share for weight, share in zip(weights, pair, strict=True))
        for pair in zip(first.shares, second.shares, strict=True)
    )
    return GondolaResponse(
        **numbers,
        error=max(first.error, second.error),
        shares=shares,
        evaluations=first.evaluations + second.evaluations,
    )


def _scaled(response, *factors):
    """A response to some force for one that is larger by a product, which alone might not be a number."""
    times = scaling(*factors)
    imaged = {name: times(number) for name, number in response.imaged.items()}
    return replace(response, imaged=imaged, **{name: times(getattr(response, name)) for name in NUMBERS})


def scaling(*factors):
    """What multiplies a number by all factors, whose product alone might not be a number."""
    mantissa, exponent = frexp(1.0)
    for factor in factors:
        part, power = frexp(factor)
        mantissa, exponent = mantissa * part, exponent + power
    mantissa, power = frexp(mantissa)  # of few factors: no product of mantissas is too small

    def times(number):
        part, own = frexp(number)
        try:
            return ldexp(part * mantissa, own + exponent + power)
        except OverflowError:
            return inf

    return times
