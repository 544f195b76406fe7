"""Bound on what a gain of the winches does to the modes of single cables.

A mode of a cable with fixed ends, of frequency W, moves the bodies by u = Z(W)^-1 W^2 G^T m per unit amplitude, and a
length v that the winches reel in pushes it by b = W^2 H^T m + F^T u, F being the forces on the bodies. Near i W the
winches make v = -gain C1 A N P u of what is measured, P u, so that its pole moves by at most

    gain |C1 N| |b| |A| |P u|/(2 W).

Where that is below `driven_decay` of the rate at which the mode decays, no gain up to this one makes it grow, nor do
as many modes together as nearly coincide. Z is the stiffness of the bodies on cables whose waves do not return,

    Z(W) = K + i W (sum of G^T z G) - W^2 M,    z = sqrt(EA m) t t^T + sqrt(T m) (I - t t^T),

t the tangent, T the tension, m the mass per length of a cable: K is right where W is low, z where it is high.

How high modes must be looked at follows from the same bound for waves. A wave that runs to and fro along a cable, of
modal mass 1, has the force W sqrt(2 z/t) on both of its ends, t being its travel time. One across the cable stretches
it too where it sags: by the tension EA (m g/T) sqrt(2/(m l)) 2/(W t).
"""

from functools import cached_property

import numpy as np

from cablestudy.control.suspension import reeled
from cablestudy.control.tolerances import CONTROL
from cablestudy.scene.suspension_tables import MOTIONS
from cablestudy.study.tolerances import STUDY
from cablestudy.system.rigid import cross_matrix
from cablestudy.system.suspension import outward

# growth over frequency by a gain that is no instability, however small the decay
UNDAMPED = CONTROL.negligible_growth / 4
RANGE = np.geomspace(1.0, 1e8, 481)  # frequencies at which the bound is computed, over the lowest of the modes
ACROSS, ALONG = 0, 1


class Effects:
    """Shift of the poles of modes of single cables per gain: the bound of the module's docstring.

    Parameters
    ----------
    closed_loop : ClosedLoop
        With a loop.
    """

    def __init__(self, closed_loop):
        self.closed_loop, self.equilibrium = closed_loop, closed_loop.equilibrium
        self.cables = closed_loop.modes.solution.models.cables
        self.omega = RANGE * closed_loop.modes.solution.omega[0]
        self.moved = dense(closed_loop.layout.connection).reshape(self.cables.count, 6, -1)
        self.reeled = reeled(self.equilibrium, closed_loop.winches).reshape(self.cables.count, 6, -1)

    @cached_property
    def travel_time(self):
        """Of waves across and along each cable, shape (2, c). [s]"""
        span = self.cables.catenary.span
        along = span.unstretched_length * np.sqrt(span.mass / span.axial_stiffness)
        return np.stack([self.cables.travel_time, along])

    @cached_property
    def air(self):
        """Rate at which the air makes waves across each cable decay at least, shape (c,). [1/s]"""
        plant, span = self.closed_loop.plant, self.cables.catenary.span
        if not plant.braked:
            return np.zeros(self.cables.count)
        chord, velocity = span.frame[:, 0], plant.drag.velocity
        speed = np.linalg.norm(velocity - (chord @ velocity)[:, None] * chord, axis=-1)
        force = plant.drag.density * plant.drag.cables * speed / 2  # across the wind; along it twice as much
        return force / (2 * np.where(self.cables.heavy, span.mass, np.inf))

    def along(self, cable, element):
        """Which modes of a cable between fixed ends are along it: the others are damped by the air, shape (n,)."""
        span, direction = self.cables.catenary.span, outward(self.equilibrium)[0][cable, 0]
        impedance = np.sqrt(span.axial_stiffness[cable] * span.mass[cable])
        force = (element.coupling[:, :3] @ direction) ** 2 * element.omega**2 * self.travel_time[ALONG, cable]
        return force >= STUDY.axial_share * 2 * impedance

    def _decay(self, cable, element):
        """Rate at which the modes of a cable between fixed ends decay at least, shape (n,). [1/s]"""
        return element.decay + np.where(self.along(cable, element), 0.0, self.air[cable])

    @cached_property
    def _impedance(self):
        """z of the six ends of each cable, without mass zero, shape (c, 6, 6). [kg/s]"""
        direction, tension = outward(self.equilibrium)
        span, found = self.cables.catenary.span, np.zeros((self.cables.count, 6, 6))
        mass = np.where(self.cables.heavy, span.mass, 0.0)
        along, across = np.sqrt(span.axial_stiffness * mass), np.sqrt(tension * mass[:, None])
        for end in range(2):
            tangent, rows = direction[:, end, :, None] * direction[:, end, None, :], slice(3 * end, 3 * end + 3)
            found[:, rows, rows] = along[:, None, None] * tangent
            found[:, rows, rows] += across[:, end, None, None] * (np.eye(3) - tangent)
        return found

    @cached_property
    def measured(self):
        """P: measured coordinates by the free displacements, shape (k, d)."""
        layout = self.closed_loop.layout
        body = layout.displaced(np.eye(len(layout.free)))[self.closed_loop.body]
        return body[[MOTIONS.index(name) for name in self.closed_loop.measured]]

    @cached_property
    def _responses(self):
        """P Z^-1, shape (f, k, d), F^T Z^-1, shape (f, i, d), and P Z^-1 F, shape (f, k, i), at the frequencies."""
        layout, moved = self.closed_loop.layout, self.moved
        backwards, stiffness = np.swapaxes(moved, 1, 2), self.cables.end_stiffness
        own, mass = (dense(part) for part in layout.body_matrices)
        static, passed = ((backwards @ part @ moved).sum(axis=0) for part in (stiffness, self._impedance))
        pulled, waves = ((backwards @ part @ self.reeled).sum(axis=0) for part in (stiffness, self._impedance))
        measured = self.measured
        omega = self.omega[:, None, None]
        force = pulled + 1j * omega * waves
        right = np.concatenate([np.broadcast_to(measured, (len(omega), *measured.shape)), force.swapaxes(1, 2)], axis=1)
        value = static + own + 1j * omega * passed - omega**2 * mass
        found = np.linalg.solve(value, right.swapaxes(1, 2)).swapaxes(1, 2)  # Z is symmetric
        seen, forced = found[:, : len(measured)], found[:, len(measured) :]
        return seen, forced, seen @ force

    @cached_property
    def _winches(self):
        """|A| |C1 N| at the frequencies, shape (f, i, k)."""
        controller = self.closed_loop.given_loop.controller(1j * self.omega)
        return np.abs(self.closed_loop.allocation.shares) * np.abs(controller)[:, None]

    def of(self, cable, place, coupling):
        """Shift of poles per gain, shape (..., n).

        Parameters
        ----------
        cable : int
        place : ndarray of int, shape (n,)
            Which of the frequencies.
        coupling : ndarray, shape (..., n, 6)
            m of `Superelement`. [sqrt(kg)]
        """
        measured, forced, _ = self._responses
        omega = self.omega[place, None]
        force = omega**2 * (coupling @ self.moved[cable])
        seen = np.abs((measured[place] @ force[..., None])[..., 0])
        pushed = np.abs(omega**2 * (coupling @ self.reeled[cable]))
        pushed = pushed + np.abs((forced[place] @ force[..., None])[..., 0])
        made = (self._winches[place] @ seen[..., None])[..., 0]
        return (pushed * made).sum(axis=-1) / (2 * omega[:, 0])

    def driven_up_to(self, gain):
        """Frequency up to which the gain could drive waves across and along each cable, shape (2, c). [rad/s]

        Zero where it drives none.
        """
        return np.where(self._driving_gain < gain, self.omega, 0.0).max(axis=-1)

    @cached_property
    def _driving_gain(self):
        """Gain above which waves across and along each cable could be driven, shape (2, c, f). [rad/s]"""
        omega, every = self.omega, np.arange(len(self.omega))
        gain = np.full((2, self.cables.count, len(omega)), np.inf)
        for cable in np.flatnonzero(self.cables.heavy).tolist():
            for kind, (coupling, decay) in enumerate(self._waves(cable)):
                least = np.maximum(STUDY.driven_decay * decay, UNDAMPED * omega) / STUDY.driven_wave_safety
                with np.errstate(divide="ignore"):  # waves that move no winch
                    gain[kind, cable] = least / self.of(cable, every, coupling).max(axis=0)
        return gain

    def _waves(self, cable):
        """Coupling m, shape (w, f, 6), and rate of decay, shape (f,), of the w waves across a cable; the same along it.

        See the module's docstring. Masses on the cable divide it: the shortest part has the largest forces on its ends.
        """
        omega, span = self.omega, self.cables.catenary.span
        values = span.axial_stiffness, span.mass, span.unstretched_length, span.gravity
        stiffness, mass, length, gravity = (float(value[cable]) for value in values)
        direction, tension = (part[cable] for part in outward(self.equilibrium))
        shortest = np.diff(np.unique([0.0, *(place for place, _ in self.cables.point_masses[cable]), 1.0])).min()
        damping, highest, time = self.cables.damping[cable], float(tension.max()), shortest * self.travel_time[:, cable]
        # masses take half of it at most, see `stability`
        viscous = damping.viscous / mass / (2 if shortest == 1 else 4)
        if damping.model == "modal":
            decay_across = decay_along = viscous + damping.ratio * omega
        else:
            loss = damping.loss_factor if damping.model == "hysteretic" else damping.time * omega
            decay_across, decay_along = viscous + 0.0 * omega, viscous + loss * omega / 2
        across, along = np.sqrt(2 * np.sqrt(np.array([highest, stiffness]) * mass) / time)[:, None] / omega
        by_sag = stiffness * mass * gravity / highest * np.sqrt(2 / (mass * length)) * 2 / time[ACROSS] / omega**3
        # forces on both ends, in phase or opposite
        signs, tangents = np.repeat([[1.0, 1.0], [1.0, -1.0]], 3, axis=1), direction.reshape(6)
        normals = (_normals(direction)[:, None] * signs).reshape(4, 1, 6)
        return (
            (across[:, None] * normals + by_sag[:, None] * tangents, decay_across + self.air[cable]),
            (along[:, None] * (signs * tangents)[:, None], decay_along),
        )

    def loop_up_to(self, gain):
        """Frequency up to which the loop gain is above `broad_loop_gain` where waves do not return. [rad/s]"""
        control = self.closed_loop.given_loop.controller(1j * self.omega)[:, None, :]
        passed = self._responses[2] @ self.closed_loop.allocation.shares * control
        return float(
            self.omega[gain * np.abs(np.linalg.eigvals(passed)).max(axis=1) > STUDY.broad_loop_gain].max(initial=0.0)
        )

    def driven(self, loop_gain, gain):
        """Which modes of each cable a gain could drive: list of ndarray of bool, shape (n,).

        A mode across a cable hardly strains it, and decays by what it makes the bodies do: that counts too. What passes
        the bound is decided by the shift of its own pole.

        Parameters
        ----------
        loop_gain : LoopGain
            With the modes that are looked at.
        gain : float
            [rad/s]
        """
        found = []
        for cable, element in enumerate(loop_gain.elements):
            omega, decay = element.omega, self._decay(cable, element)
            place = np.clip(np.searchsorted(self.omega, omega), 0, len(self.omega) - 1)
            effect = gain * self.of(cable, place, element.coupling)
            driven = effect > np.maximum(STUDY.driven_decay * decay, UNDAMPED * omega)
            if driven.any():
                poles, shift = loop_gain.poles_of(cable, np.flatnonzero(driven))
                whole = (decay - element.decay)[driven] - poles.real
                least = np.maximum(STUDY.driven_decay * whole, UNDAMPED * omega[driven])
                driven[driven] = gain * np.abs(shift) > least
            found.append(driven)
        return found


def _normals(direction):
    """Two unit vectors across a cable at both of its ends, shape (2, 6), for its tangents there, shape (2, 3)."""
    turned = cross_matrix(direction)
    first = (turned @ np.eye(3)[np.abs(direction).argmin(axis=1)][..., None])[..., 0]
    first = first / np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, (turned @ first[..., None])[..., 0]]).reshape(2, 6)


def dense(matrix):
    """A matrix as an array, sparse or not."""
    return matrix if isinstance(matrix, np.ndarray) else matrix.toarray()
