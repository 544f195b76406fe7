"""A cable with fixed ends in the wind: RMS of its displacement at mid-span and of the tensions at its ends.

With q the amplitudes of the modes with fixed ends, the wind is a force per length rho C_d d v G u' along the cable, u'
the turbulence and G the matrix of `wind.drag`, and the cable that moves meets the wind with its own velocity:

    q'' + (C + C_a) q' + W^2 q = integral of rho C_d d v psi^T G u',    C_a = integral of rho C_d d v psi^T G psi,

C being the damping of the cable (`system.superelement`). Displacement and tension follow from q and from the static
shape h for a movement of an end along its tangent t: the tension changes by

    integral of rho C_d d v h^T G u' - t^T (M_eq q'' + C_eq q' + K_eq q),

with the rows of M, C and K that join the end to the modes. Turbulence as in `one_cable_system`: its components are
uncorrelated and equal, coherent over some length; wind across and wind along the vertical plane of the cable are
compared. The motion is linear about the equilibrium without wind.
"""

from dataclasses import dataclass
from math import frexp, inf, ldexp

import numpy as np

from cablestudy.cable.element import basis, lagrange
from cablestudy.errors import NoSolutionError
from cablestudy.system.linear import upper
from cablestudy.system.residues import Residues
from cablestudy.wind.cable_gusts import INTERPOLATED, CableGusts
from cablestudy.wind.coherence import at_points, ratio_of, rod, tangents
from cablestudy.wind.drag import cable_damping, drag_matrices
from cablestudy.wind.integrals import ALONG_CABLES, QUADRATURE, Integrals, frequency_range
from cablestudy.wind.spectrum import speed_spectrum
from cablestudy.wind.variance import frequency_edges, smooth_on

DIRECTIONS = ("across", "along")
STILL = 1e-9  # share of what moves that no more than rounding leaves
MOST_MODES = 160  # of one plane: static displacements by the others fall with the cube of their number, 1e-7
NOTHING = 100  # times the floor of a spectrum: a variance below it is none
CHECKED = np.array([0.1, 0.7, 3.0])  # frequencies, over the lowest pole's, at which the sum over poles is checked
TRUSTED = 1e-9  # difference between the sum over poles and solved systems


@dataclass(frozen=True)
class CableMotion:
    """RMS of a cable in the wind.

    Attributes
    ----------
    midspan : float
        Along that axis of the chord frame, and in that wind, for which it is largest. [m]
    tension : float
        At the end, and in the wind, for which it is largest. [N]
    error : float
        Estimated relative error of a variance by quadrature and interpolation. [-]
    """

    midspan: float
    tension: float
    error: float


@dataclass(frozen=True)
class _Outputs:
    """Linear combinations of q, q' and q'' and of the drag on static shapes: o of them, of n modes.

    Attributes
    ----------
    place, rate, acceleration : ndarray, shape (o, n)
    static : ndarray, shape (o, j)
        Of the drag on j static shapes.
    """

    place: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    static: np.ndarray


def cable_motion_of(case):
    """`CableMotion` of a case whose cable has fixed ends.

    Parameters
    ----------
    case : Case

    Returns
    -------
    CableMotion

    Raises
    ------
    NoSolutionError
        The case has a gondola, a mode is not damped, or a number is too large for one.
    """
    if case.scene.gondola is not None:
        raise NoSolutionError("the motion of a cable in the wind is computed for fixed ends: leave out the gondola")
    moving, wind = _Cable(case), case.scene.wind
    variance = [moving.variances(part, direction) for part in moving.parts for direction in DIRECTIONS]
    scale = wind.air_density, wind.cable_drag_coefficient, case.scene.wind_diameter
    times = scaling(*scale, moving.length, wind.speed, wind.turbulence)
    largest = np.sqrt(np.max(variance, axis=0))
    return CableMotion(times(float(largest[:3].max())), times(float(largest[3:].max())), QUADRATURE + INTERPOLATED)


class _Cable:
    """The cable of a case, its modes and the shapes by which the wind acts on it.

    Attributes
    ----------
    parts : list of ndarray of int
        Modes that move together: in the plane and out of it, or all.
    length : float
        Stretched. [m]
    """

    def __init__(self, case):
        self._case, self._wind = case, case.scene.wind
        state, span, self._model = case.state, case.span, case.end_model
        self._rod = rod(state.mesh, state.stretch)
        self.length = self._rod.length * float(span.unstretched_length)
        modes = case.dynamics.modes(len(self._model.omega)).shapes[..., : len(self._model.omega)]
        ends = case.catenary.at(np.array([0.0, 1.0]))[1]
        ends = ends / np.sqrt((ends**2).sum(axis=-1, keepdims=True))  # unit tangents, chord frame
        held = np.zeros((state.mesh.nodes, 3, 2))
        for system in case.dynamics.systems:
            axes = list(system.axes)
            second = system.end_shapes
            held[:, axes, 0] = (np.eye(len(axes)) - second) @ ends[0, axes]
            held[:, axes, 1] = second @ ends[1, axes]
        points = self._rod.points[0]
        shapes = at_points(state.mesh, np.concatenate([held, modes], axis=-1), points)
        self._tangent = tangents(state.mesh, state.direction, points)
        self._held, self._shapes = shapes[..., :2], shapes[..., 2:]
        self._middle = _at(state.mesh, float(case.results.catenary.middle[case.index]), modes)
        self._ends = np.zeros((6, 2))  # global axes
        self._ends[:3, 0], self._ends[3:, 1] = ends @ span.frame
        self._blowing = blowing(span)
        aside = (np.abs(modes[:, :2]).max(axis=(0, 1)) == 0) & case.planar
        parts = [np.flatnonzero(chosen)[:MOST_MODES] for chosen in (~aside, aside)]
        self.parts = [part for part in parts if len(part)]
        self._aside = aside

    def variances(self, part, direction):
        """Variances of the place of mid-span along the chord frame and of the tensions.

        Over the square of rho C_d d v sigma length, shape (5,). `part` are modes that move together, `direction` is
        that of the mean wind.
        """
        moved, outputs, gusts_on = self.response(part, direction)
        if gusts_on is None:
            return np.zeros(5)
        wind, size = self._wind, np.abs(upper(outputs.poles))
        main = float(size.min()) / (2 * np.pi)
        span = frequency_range(main, wind.speed / wind.length_scale, what="the cable")
        gusts = gusts_on(span)
        edges, found = smooth_on(frequency_edges(*span), [gusts.spectrum]), np.zeros(5)
        integrals = Integrals.on(edges, gusts, {"value": np.ones_like}, ALONG_CABLES)
        found[moved] = integrals.variances(outputs)[0]
        _check_damped(integrals.undamped(outputs, found[moved], self._energy(2 * np.pi * main)[moved]))
        if not np.isfinite(found).all():
            raise NoSolutionError("the wind's force on the cable is too large for a number")
        return np.where(found > NOTHING * STILL**2 * np.array([*[found[:3].max()] * 3, 1.0, 1.0]), found, 0.0)

    def _energy(self, omega):
        """Energy per square of the place of mid-span along three axes and of two tensions, about, shape (5,)."""
        span, pulled = self._case.span, (self._ends * (self._model.stiffness @ self._ends)).sum(axis=0)
        return np.append(np.full(3, float(span.mass * span.unstretched_length) * omega**2), 1 / pulled)

    def response(self, part, direction):
        """How the wind on some modes that move together moves the cable.

        Returns
        -------
        moved : list of int
            Of mid-span along the chord frame and the tensions at both ends those that move.
        outputs : Residues
            Of these, by the drag on the two static shapes and on the modes.
        gusts_on : callable or None
            Range as of `frequency_range` [Hz] -> the drag, `CableGusts`; None without any.
        """
        matrices = drag_matrices(self._tangent, self._blowing[direction])
        shapes = np.concatenate([self._held, self._shapes[..., part]], axis=-1)
        loads = drag_loads(self._rod, shapes, matrices)
        loads[np.abs(loads) < STILL * np.abs(shapes).max(axis=(0, 1, 2))[:, None]] = 0.0
        if not loads[:, 2:].any():
            return None, None, None
        drag = self._damping(shapes, matrices)
        moved, outputs = self._outputs(part, drag)
        wind, ratio = self._wind, ratio_of(self._wind, self.length)

        def turbulence(frequency):
            return speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)

        def gusts_on(span):
            return CableGusts(self._rod, loads, ratio, turbulence, span)

        return moved, _System(*self._matrices(part, drag)).residues(outputs), gusts_on

    def _damping(self, shapes, matrices):
        """C_a of static shapes and modes, shape (2 + n, 2 + n). [1/s]"""
        whole = 2 * cable_damping(self._wind, self._case.scene.wind_diameter) * self.length
        drag = np.einsum("eq,eqab,eqbk->eqak", self._rod.shares, matrices, shapes, optimize=True)
        return whole * np.tensordot(shapes, drag, axes=((0, 1, 2), (0, 1, 2)))

    def _matrices(self, part, drag):
        """Frequencies, damping and what of the stiffness is not their square, of the modes."""
        model = self._model.select(part)
        damping = np.diag(2 * model.damping_ratio * model.omega if model.strain is None else 0 * model.omega)
        damping = damping + model.viscous * np.eye(len(part)) + drag[2:, 2:]
        if model.uneven:
            carried = model.carried[:, : len(part)]
            damping = damping - model.viscous * carried.T @ carried
        if model.strain is None:
            return model.omega, damping, np.zeros_like(damping)
        if model.strain.law == "kelvin_voigt":
            return model.omega, damping + model.strain.amount * model.strain.modes, np.zeros_like(damping)
        return model.omega, damping, 1j * model.strain.amount * model.strain.modes

    def _outputs(self, part, drag):
        """Of mid-span along the chord frame and the tensions at both ends those that move, by number; `_Outputs`."""
        model, n = self._model.select(part), len(part)
        coupling = self._ends.T @ model.coupling.T
        rate, place = model.viscous * coupling + drag[:2, 2:], np.zeros((2, n), dtype=complex)
        if model.uneven:
            rate = rate - model.viscous * (model.carried[:, n:] @ self._ends).T @ model.carried[:, :n]
        if model.strain is None:
            rate = rate + coupling * (2 * model.damping_ratio * model.omega)
        else:
            strained = model.strain.amount * (self._ends.T @ model.strain.coupling.T)
            if model.strain.law == "kelvin_voigt":
                rate = rate + strained
            else:
                place = 1j * strained
        none = np.zeros((3, n))
        # a movement of an end along its tangent moves nothing across the plane
        moved = [2] if self._aside[part].all() else [0, 1, 3, 4] if self._case.planar else list(range(5))
        return moved, _Outputs(
            np.concatenate([self._middle[:, part], -place])[moved],
            np.concatenate([none, -rate])[moved],
            np.concatenate([none, -coupling])[moved],
            np.concatenate([np.zeros((3, 2)), np.eye(2)])[moved],
        )


class _System:
    """q'' + C q' + (W^2 + S) q = f as a sum over poles.

    Parameters
    ----------
    omega : ndarray, shape (n,)
        W. [rad/s]
    damping, more : ndarray, shape (n, n)
        C [1/s] and S [1/s^2], complex where hysteretic.

    Attributes
    ----------
    poles : ndarray, shape (2 n,)
        [rad/s]
    inputs : ndarray, shape (2 n, n)
        Share of each force in each pole's motion.
    """

    def __init__(self, omega, damping, more):
        self._one_sided = np.iscomplexobj(more)
        n, slowness = len(omega), np.diag(1 / omega)
        try:
            with np.errstate(all="ignore"):  # what is not finite is not trusted
                # of (W q, q') the inverse of A, so that the slow poles are the most accurate
                give = np.linalg.inv(np.eye(n) + slowness @ more @ slowness)
                inverse = [[-give @ slowness @ damping @ slowness, -give @ slowness], [slowness, np.zeros((n, n))]]
                value, vectors = np.linalg.eig(np.block(inverse))
                self.poles = 1 / value
                self._shapes, self.inputs = vectors[:n] / omega[:, None], np.linalg.inv(vectors)[:, n:]
                error = self._error(damping, np.diag(omega**2) + more)
        except np.linalg.LinAlgError:  # two modes that are one, or numbers that are not finite
            error = np.inf
        if not error <= TRUSTED:
            raise NoSolutionError("rounding spoils the modes of the cable in the wind: another damping may help")

    def _error(self, damping, stiffness):
        """Relative difference between the sum over poles and solved systems. [-]"""
        errors = []
        for s in 1j * CHECKED * np.abs(self.poles).min():
            exact = np.linalg.inv(s**2 * np.eye(len(damping)) + s * damping + stiffness)
            wrong = self._shapes / (s - self.poles) @ self.inputs - exact
            errors.append(np.abs(wrong).max() / np.abs(exact).max())
        return np.max(errors)

    def residues(self, outputs):
        """`Residues` of `_Outputs` by the drag on static shapes and on the modes."""
        place, rate, acceleration = (
            part @ self._shapes for part in (outputs.place, outputs.rate, outputs.acceleration)
        )
        shown = place + self.poles * (rate + self.poles * acceleration)
        given = np.concatenate([np.zeros((len(self.poles), outputs.static.shape[1])), self.inputs], axis=1)
        direct = np.concatenate([outputs.static, outputs.acceleration], axis=1)
        return Residues(self.poles, given, shown, direct, self._one_sided)


def _at(mesh, place, shapes):
    """Shapes, (nodes, 3, k), at one place of the cable, over its unstretched length: (3, k)."""
    which = int(np.clip(np.searchsorted(mesh.edges, place, side="left") - 1, 0, mesh.elements - 1))
    local = np.array([(place - mesh.edges[which]) / mesh.sizes[which]])
    return np.tensordot(lagrange(basis(mesh.order).nodes, local)[0], shapes[mesh.element_nodes[which]], axes=1)


def _check_damped(poles):
    """Refuse a cable with a mode that nothing damps; `poles` of `Integrals.undamped`."""
    if not poles.any():
        return
    poles = poles[poles != 0]
    worst = poles[np.argmin(np.abs(poles))]
    ratio = max(0.0, -worst.real / abs(worst))
    raise NoSolutionError(
        f"undamped: the damping ratio of the cable's mode of {abs(worst) / (2 * np.pi):.4g} Hz is {ratio:.2g}, below "
        f"{ALONG_CABLES:g}, so that no RMS is finite (cable.damping)"
    )


def blowing(span):
    """Unit vectors of the mean wind in the chord frame of a `Span`: across and along its vertical plane."""
    return {"across": np.array([0.0, 0.0, 1.0]), "along": span.frame @ span.level}


def drag_loads(rod, shapes, matrices):
    """Drag by each component of the turbulence on some shapes, in the functions of a `Rod`.

    Parameters
    ----------
    rod : Rod
    shapes : ndarray, shape (n, q, 3, k)
        At its points.
    matrices : ndarray, shape (n, q, 3, 3)
        See `drag_matrices`.

    Returns
    -------
    ndarray, shape (c, k, r)
        Of the c components with any force on the shapes.
    """
    drag = np.einsum("eqak,eqac->ceqk", shapes, matrices, optimize=True)
    drag = drag.reshape(3, -1, drag.shape[-1])
    whole = np.abs(shapes).max(axis=(0, 1, 2))
    moved = (np.abs(drag) > STILL * np.where(whole > 0, whole, 1.0)).any(axis=(1, 2))
    return (rod.collect @ drag[moved]).transpose(0, 2, 1)


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
