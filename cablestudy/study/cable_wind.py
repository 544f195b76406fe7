"""The wind on the cable itself, as a force on the gondola; and the vortices that the cable sheds.

A force per length f(s) along the cable acts on the gondola as the integral of h(s) f(s), where h is the static shape
for a movement of end 2 along x, and what each mode adds to it (`force_transmission`). The mean wind is horizontal,
with the speed that the gondola has; each component of the turbulence has the spectrum of the longitudinal one, and two
components are uncorrelated. What the paper leaves open is where the wind comes from: each number is
the larger one of wind across and along the vertical plane of the cable, between which those of a straight cable lie.
"""

import numpy as np

from cablestudy.control.force_transmission import modal_force_transmission
from cablestudy.study.loops import with_viscous
from cablestudy.system.superelement import GONDOLA, GROUND
from cablestudy.wind.cable_gusts import CableGusts
from cablestudy.wind.coherence import at_points, ratio_of, rod, tangents
from cablestudy.wind.drag import drag_matrices
from cablestudy.wind.spectrum import speed_spectrum

DIRECTIONS = ("across", "along")
AT_ONCE = 2000  # frequencies
STILL = 1e-9  # share of what moves that no more than rounding leaves
TRAVEL_POINTS = 2000


class CableWind:
    """How the wind on the cable of a case, which damps the cable too, moves the gondola."""

    def __init__(self, case):
        dynamics, span, model = case.dynamics, case.span, with_viscous(case.end_model, case.cable_air_rate)
        state, self._wind = case.state, case.scene.wind
        observable = np.abs(model.participation[:, [GONDOLA, GROUND]]).max(axis=1, initial=0.0)
        observable = np.flatnonzero(observable > 1e-9 * observable.max(initial=0.0))  # as the loop has them
        self.model = model.select(observable)
        self._rod = rod(state.mesh, state.stretch)
        self.length = self._rod.length * float(span.unstretched_length)
        shapes = np.zeros((state.mesh.nodes, 3, len(observable) + 1))
        along = span.frame[:, GONDOLA - 3]
        for system in dynamics.systems:
            axes = list(system.axes)
            shapes[:, axes, 0] = system.end_shapes @ along[axes]
        shapes[..., 1:] = case.dynamics.modes(len(model.omega)).shapes[..., : len(model.omega)][..., observable]
        points = self._rod.points[0]
        self._shapes = at_points(state.mesh, shapes, points)
        self._tangent = tangents(state.mesh, state.direction, points)
        self._blowing = blowing(span)

    def loads(self, direction):
        """Drag by each component of the turbulence on static shape and modes, in the rod's functions: (c, n + 1, r).

        Components without a force on the gondola are left out. `direction` of the mean wind, "across" or "along": from
        the vertical plane of the cable.
        """
        return drag_loads(self._rod, self._shapes, drag_matrices(self._tangent, self._blowing[direction]))

    def moves(self, direction):
        """Whether a mean wind in a direction exerts a force on the gondola."""
        return len(self.loads(direction)) > 0

    def gusts(self, direction, span):
        """`CableGusts` on the modes and then the gondola, over rho C_d d v sigma length."""
        wind, loads = self._wind, self.loads(direction)

        def turbulence(frequency):
            return speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)

        return CableGusts(self._rod, np.roll(loads, -1, axis=1), ratio_of(wind, self.length), turbulence, span)

    def spectrum(self, direction):
        """Spectrum of the force on the gondola over (rho C_d d v sigma length)^2, a function.

        Of frequencies, shape (m,) [Hz] -> shape (m,) [1/Hz]; None where no force acts on the gondola.
        """
        loads, wind, ratio = self.loads(direction), self._wind, ratio_of(self._wind, self.length)
        if not len(loads):
            return None

        def part(frequency):
            shares = modal_force_transmission(self.model, 2j * np.pi * frequency)
            load = loads[:, :1] + shares @ loads[:, 1:]
            turbulence = speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)
            return turbulence * self._rod.variance(load, ratio(frequency))

        def whole(frequency):
            pieces = np.split(frequency, range(AT_ONCE, len(frequency), AT_ONCE))
            return np.concatenate([part(piece) for piece in pieces])

        return whole


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


def transverse_travel_time(case):
    """How long a transverse wave takes from end to end: the integral of sqrt(m |r'|/T) over the cable. [s]"""
    span = case.span
    places = (np.arange(TRAVEL_POINTS) + 0.5) / TRAVEL_POINTS
    tension = np.sqrt((case.catenary.at(places)[1] ** 2).sum(axis=-1))
    slowness = np.sqrt(span.mass * (1 / np.maximum(tension, np.finfo(float).tiny) + 1 / span.axial_stiffness))
    return float(slowness.mean() * span.unstretched_length)
