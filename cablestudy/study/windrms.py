"""Command `windrms`: what the wind does to the gondola, with and without the winch loop."""

from copy import copy
from dataclasses import dataclass, field, replace
from functools import partial
from math import frexp, hypot, inf, ldexp, prod

import numpy as np

from cablestudy.control.gondola_residues import at_rest, closed, shaken_by
from cablestudy.control.plant import largest
from cablestudy.errors import NoSolutionError
from cablestudy.wind.cable_gusts import INTERPOLATED, BodyGusts
from cablestudy.wind.imaging import seen_weights
from cablestudy.wind.integrals import ALONG_CABLES, UNDAMPED, Integrals, frequency_range
from cablestudy.wind.peak import peak_factor
from cablestudy.wind.spectrum import admittance, force_spectrum, speed_spectrum
from cablestudy.wind.variance import frequency_edges, smooth_on

TOLERANCE = 1e-6  # relative, of each variance
BELOW = (0.1, 1.0, 10.0)  # frequencies up to which the share of the variance is given [Hz]
SHIFT, RESONANT = 1e-5, 1e-9  # as `plant.POLES`: for the modes that are kept, before vectors stand for the others
LEFT, TRUE = 0.01, 30.0  # of the tolerance: resonances left out that the wind on the cable shakes; factor of safety
SMALL = 24  # coordinates of a system that costs less with all of them than twice with fewer
ORDERS = 1, 2, 3, 4, 6  # of these vectors
SHAKEN = 8  # modes that the wind on the cable shakes, to whose damping forces they answer, for each order but the first
QUADRATURE = 1e-10  # error of the variances by the rule on the panels: that of Davenport's spectrum is 4e-11
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
    imaged : dict
        What a telescope sees of the displacement, by the names of `seen_weights`. [m]
    """

    displacement: float
    velocity: float
    open_displacement: float
    open_velocity: float
    error: float
    shares: tuple
    imaged: dict = field(default_factory=dict)


def weights_of(scene):
    """`seen_weights` of a scene."""
    return seen_weights(scene.exposure, scene.correction)


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
        alone, held = (value.real**2 + value.imag**2 for value in loop.compliances(2j * np.pi * frequency))
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


def respond(loop, force, corner, tolerance=TOLERANCE, weights=None, winch=False):
    """RMS of the gondola under a force on it, by the poles of its response.

    Parameters
    ----------
    loop : Loop
        Stable.
    force : callable
        Frequencies [Hz] -> spectrum of the force on the gondola [N^2/Hz], smooth.
    corner : float
        Where the force spectrum begins to fall. [Hz]
    tolerance : float
        Relative, of each variance: error by vectors that stand for modes of the cable.
    weights : dict, optional
        Of `seen_weights`.
    winch : bool
        Whether `winch_speed` [m/s] and `winch_acceleration` [m/s^2] are wanted among what is `imaged`.

    Returns
    -------
    GondolaResponse

    Raises
    ------
    NoSolutionError
        Wind and gondola are too far apart, the variance is no number, or a motion is as good as undamped.
    """
    weights, plant = weights or {}, loop.plant
    span = frequency_range(gondola_frequency(loop), corner, loop.gain, bool(weights) or winch)
    integrals = _Integrals(loop, BodyGusts(force), span, weights, winch)
    kept = plant.needed(plant.excited, SHIFT, min(RESONANT, tolerance), raised=integrals.raised)
    return _respond(integrals, plant.system_of(plant.excited), kept, tolerance)


def respond_along(loop, cable, gusts_on, corner, tolerance=TOLERANCE):
    """As `respond`, under forces along the cable.

    Parameters
    ----------
    loop : Loop
    cable : Superelement
        With all modes that the gondola or the winch moves.
    gusts_on : callable
        See `frequency_range` [Hz] -> `CableGusts` on these modes and the gondola.
    corner, tolerance
        As for `respond`.
    """
    plant, span = loop.plant, frequency_range(gondola_frequency(loop), corner, loop.gain)
    gusts, system = gusts_on(span), plant.system_of(cable)
    integrals = _Integrals(loop, gusts, span, {}, least=ALONG_CABLES)
    kept = plant.needed(cable, SHIFT, min(RESONANT, tolerance))
    few = system.few(kept, ORDERS[0])
    whole = integrals.within(few).variances(system.within(few))
    shaken = shaken_by(system, gusts.own(np.append(cable.omega, plant.main) / (2 * np.pi))[:-1])
    share = np.maximum(shaken / whole[[0, 2]].min(), shaken * cable.omega**2 / whole[[1, 3]].min())
    kept = np.union1d(kept, largest(share, LEFT * tolerance))
    found = _respond(integrals, system, kept, tolerance, kept[np.argsort(-share[kept], kind="stable")])
    return replace(found, error=found.error + TRUE * LEFT * tolerance + INTERPOLATED)


def _respond(integrals, system, kept, tolerance, shaken=()):
    """`GondolaResponse` with some modal coordinates of a `LinearSystem`, and as many vectors as the tolerance takes.

    Damped strain couples the modes: vectors of higher order answer also to the modes that the wind shakes, given with
    those that move the gondola most first. Without them the difference of two orders is no error of the velocity.
    """
    if len(system) <= SMALL:
        return integrals.response(integrals.variances(system), 0.0)
    found, error = None, np.inf
    for orders in ORDERS:
        before, space = found, system.few(kept, orders, shaken[: SHAKEN * (orders - 1)])
        found = integrals.within(space).variances(system.within(space))
        if len(space) == space.shape[1]:
            error = 0.0
        elif before is not None:
            error = (np.abs(found - before)[found > 0] / found[found > 0]).max(initial=0.0)
        if error <= tolerance:
            return integrals.response(found, error)
    return integrals.response(integrals.variances(system), 0.0)


def gondola_frequency(loop):
    """Of the gondola's pole, the winch at rest. [Hz]"""
    return float(np.abs(loop.gondola_pole)) / (2 * np.pi)


class _Integrals:
    """Variances of the gondola's motion, and of the winch's.

    Parameters
    ----------
    loop : Loop
    gusts : BodyGusts or CableGusts
    span : tuple of 3 float
        See `frequency_range`. [Hz]
    weights : dict
        Of `seen_weights`.
    winch : bool
        Whether the winch matters too.
    least : float
        Damping ratio up to which a motion counts as not damped. [-]
    """

    def __init__(self, loop, gusts, span, weights, winch=False, least=UNDAMPED):
        self._loop, self._seen, self._winch = loop, weights, winch
        delay = loop.plant.law.delay if loop.gain else 0.0
        edges = smooth_on(frequency_edges(*span, BELOW, delay), [gusts.spectrum, *weights.values()])
        below = {limit: partial(np.greater, limit) for limit in BELOW}
        every = {"value": np.ones_like, "rate": partial(_derivative, 1), **below, **weights}
        self._held, more = list(every), {"acceleration": partial(_derivative, 2)} if winch else {}
        self._integrals = Integrals.on(edges, gusts, every | more, least)

    def within(self, space):
        """The same in the gusts on coordinates in a space, shape (n, r)."""
        found = copy(self)
        found._integrals = replace(self._integrals, gusts=self._integrals.gusts.within(space))
        return found

    def raised(self, frequency):
        """By which factor the variances count resonances at frequencies [Hz] more than that of the gondola. [-]

        As `Plant.needed` takes it: over that of the velocity in white noise.
        """
        loop, main = self._loop, np.array([gondola_frequency(self._loop)])
        factors = [lambda f: f**2, *self._seen.values()]
        if self._winch:
            factors += [lambda f, k=k: np.abs(loop.controller(2j * np.pi * f) * f**k) ** 2 for k in (1, 2)]
        found, spectrum = np.max([of(frequency) / of(main) for of in factors], axis=0), self._integrals.gusts.spectrum
        return found * (main / frequency) ** 2 * spectrum(frequency) / spectrum(main)

    def variances(self, system):
        """Displacement and velocity with the loop, then without, shares below BELOW, what is seen, speed, acceleration.

        Parameters
        ----------
        system : LinearSystem
            In the coordinates of the gusts.

        Returns
        -------
        ndarray
        """
        inputs = self._integrals.gusts.inputs(len(system))
        alone = at_rest(system, inputs)
        if not self._loop.gain:
            held = self._of(alone, self._held)[:, 0]
            return np.concatenate([np.insert(held, 2, held[:2]), np.zeros(2 * self._winch)])
        found = self._of(closed(self._loop, system, inputs))
        held = np.insert(found[: len(self._held), 0], 2, self._of(alone, self._held[:2])[:, 0])
        return np.concatenate([held, found[[1, -1], 1]]) if self._winch else held

    def response(self, found, error):
        """`GondolaResponse` of such variances with some relative error."""
        if not (np.isfinite(found) & (found > 0)).all():
            raise NoSolutionError("the wind's force on the gondola is too small or too large for a number")
        below = np.s_[4 : 4 + len(BELOW)]
        shares, numbers = found[below] / found[0], np.sqrt(np.delete(found, below)).tolist()
        names = [*self._seen, *(("winch_speed", "winch_acceleration") if self._winch else ())]
        imaged = dict(zip(names, numbers[4:], strict=True))
        return GondolaResponse(*numbers[:4], float(error) + QUADRATURE, tuple(shares.tolist()), imaged)

    def _of(self, response, names=None):
        """Variances of the gondola's place, and of the winch's, shape (w, o).

        Raises
        ------
        NoSolutionError
            The wind excites a motion of the gondola that nothing damps.
        """
        found = self._integrals.variances(response, names)
        worst = self._integrals.undamped(response, found[0], np.eye(found.shape[1])[0])[0]
        if worst:
            raise NoSolutionError(
                f"undamped: the wind moves the gondola at {abs(worst) / (2 * np.pi):.4g} Hz, where the damping ratio "
                f"is {abs(worst.real) / abs(worst):.1e}, so that no RMS is finite (cable.damping)"
            )
        return found


def _derivative(order, frequency):
    """Factor of the spectrum of a derivative at frequencies [Hz]."""
    return ((2 * np.pi * frequency) ** 2) ** order


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
    unit, corner, factors = unit_force(case)
    tolerance = tolerance or tolerance_of(case.scene)
    return _scaled(respond(loop, unit, corner, tolerance, weights_of(case.scene)), *factors)


def winch_response_of(case, loop):
    """As `response_of`, with `winch_speed` [m/s] and `winch_acceleration` [m/s^2] of a winch on which the loop acts."""
    loop.check_stable()
    force, corner, factors = unit_force(case)
    return _scaled(respond(loop, force, corner, tolerance_of(case.scene), winch=True), *factors)


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
    every = [partial(on_cable.gusts, direction) for direction in DIRECTIONS if on_cable.moves(direction)]
    corner, tolerance = wind.speed / wind.length_scale, tolerance_of(case.scene)
    found = [respond_along(loop, on_cable.model, gusts_on, corner, tolerance) for gusts_on in every]
    if not found:  # a straight cable without weight does not pass on what is normal to it
        return GondolaResponse(0.0, 0.0, 0.0, 0.0, 0.0, (0.0,) * len(BELOW))
    worst = max(found, key=lambda response: response.displacement)
    numbers = {name: max(getattr(response, name) for response in found) for name in NUMBERS}
    worst = replace(worst, error=max(response.error for response in found), **numbers)
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
