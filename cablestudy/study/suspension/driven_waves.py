"""Upper bound on the shift of the poles of single cables' modes by a gain of the winches: which modes it could drive.

A mode of a cable with fixed ends, of frequency W and unit amplitude, is coupled by m (`system.superelement`) to the
displacements of the ends: G u by displacements u of the bodies, H v by lengths v that the winches reel in. The mode
moves the bodies by u = Z(W)^-1 W^2 G^T m, and v pushes the mode by b^T v, b = W^2 H^T m + F^T u, F v being the forces
on the bodies. Near i W the loop makes v = -gain A C1 N P u: P u is what is measured, C1 the control law of unit gain,
N its notches, A the allocation to the winches. The pole of the mode thus moves by at most

    gain |C1 N| |b| |A| |P u|/(2 W).

Where that is below `driven_decay` times the rate of decay of the mode, no gain up to this one makes it grow, alone or
with as many modes as nearly coincide. Z is the stiffness of the bodies on cables whose waves do not return,

    Z(W) = K + i W (sum of G^T z G) - W^2 M,    z = sqrt(EA mu) t t^T + sqrt(T mu) (I - t t^T),

K the static stiffness with the cables, M the mass of the bodies, t the tangent at an end of a cable, T its tension, mu
its mass per length: K is right where W is low, z where it is high.

The highest modes that a gain could drive follow from the same bound for waves. A wave that runs to and fro along a
cable, of modal mass 1, has the force W sqrt(2 z/tau) on both of its ends, tau being its travel time and z that of its
direction. A wave across a cable of length l stretches it too where it sags: by the tension
EA (mu g/T) sqrt(2/(mu l)) 2/(W tau).
"""

from functools import cached_property

import numpy as np

from cablestudy.control.suspension import reeled
from cablestudy.control.tolerances import CONTROL
from cablestudy.scene.determinacy import MOTIONS
from cablestudy.study.tolerances import STUDY
from cablestudy.system.matrices import dense, solve
from cablestudy.system.rigid import cross_matrix
from cablestudy.system.suspension import outward

# growth over frequency by a gain that is no instability, however small the decay
UNDAMPED = CONTROL.negligible_growth / 4
RANGE = np.geomspace(1.0, 1e8, 481)  # frequencies at which the bound is computed, over the lowest of the modes
ACROSS, ALONG = 0, 1  # directions of waves, across a cable and along it: rows of arrays


class Effects:
    """Effects of the gain on the modes of single cables: the bound of the module's docstring, and what follows from it.

    Shapes: c cables, i winches, k measured coordinates, d free displacements of bodies, f frequencies.

    Parameters
    ----------
    closed_loop : ClosedLoop
        With a loop.

    Attributes
    ----------
    omega : ndarray, shape (f,)
        Frequencies at which the bound is computed. [rad/s]
    moved : ndarray, shape (c, 6, d)
        G: displacements of both ends of each cable by the free displacements.
    reeled : ndarray, shape (c, 6, i)
        H: displacements of both ends by the lengths that winches reel in.
    """

    def __init__(self, closed_loop):
        self.closed_loop, self.equilibrium = closed_loop, closed_loop.equilibrium
        self.cables = closed_loop.modes.solution.models.cables
        self.omega = RANGE * closed_loop.modes.solution.omega[0]
        self.moved = dense(closed_loop.layout.connection).reshape(self.cables.count, 6, -1)
        self.reeled = reeled(self.equilibrium, closed_loop.winches).reshape(self.cables.count, 6, -1)

    @cached_property
    def travel_time(self):
        """Travel time of waves across and along each cable, shape (2, c). [s]"""
        span = self.cables.catenary.span
        along = span.unstretched_length * np.sqrt(span.mass / span.axial_stiffness)
        return np.stack([self.cables.travel_time, along])

    @cached_property
    def air(self):
        """Lower bound of the rate at which waves across each cable decay by the air, shape (c,). [1/s]"""
        plant, span = self.closed_loop.plant, self.cables.catenary.span
        if not plant.braked:
            return np.zeros(self.cables.count)
        chord, velocity = span.frame[:, 0], plant.drag.velocity
        speed = np.linalg.norm(velocity - (chord @ velocity)[:, None] * chord, axis=-1)
        force = plant.drag.density * plant.drag.cables * speed / 2  # across the wind; along it twice as much
        return force / (2 * np.where(self.cables.heavy, span.mass, np.inf))

    def along(self, cable, element):
        """Which modes of a cable between fixed ends are along it, array of bool, shape (n,); the air damps the others.

        Those whose force on an end, along the cable, is a good part of W sqrt(2 z/tau), that of a wave along it.
        """
        span, tangent = self.cables.catenary.span, outward(self.equilibrium)[0][cable, 0]
        impedance = np.sqrt(span.axial_stiffness[cable] * span.mass[cable])
        squared_force = (element.coupling[:, :3] @ tangent) ** 2 * element.omega**2  # over W^2
        return squared_force * self.travel_time[ALONG, cable] >= STUDY.axial_share * 2 * impedance

    def _decay(self, cable, element):
        """Lower bound of the rate at which the modes of a cable between fixed ends decay, shape (n,). [1/s]"""
        if element.air is not None:  # its own decay has the damping by the air
            return element.decay
        return element.decay + np.where(self.along(cable, element), 0.0, self.air[cable])

    @cached_property
    def _impedance(self):
        """z at both ends of each cable, block diagonal, shape (c, 6, 6); zero of a cable without mass. [kg/s]"""
        direction, tension = outward(self.equilibrium)
        span, impedance = self.cables.catenary.span, np.zeros((self.cables.count, 6, 6))
        mass = np.where(self.cables.heavy, span.mass, 0.0)
        along, across = np.sqrt(span.axial_stiffness * mass), np.sqrt(tension * mass[:, None])
        for end in range(2):
            onto_tangent = direction[:, end, :, None] * direction[:, end, None, :]  # t t^T
            rows = slice(3 * end, 3 * end + 3)
            impedance[:, rows, rows] = along[:, None, None] * onto_tangent
            impedance[:, rows, rows] += across[:, end, None, None] * (np.eye(3) - onto_tangent)
        return impedance

    @cached_property
    def measured(self):
        """P: measured coordinates by the free displacements, shape (k, d)."""
        layout = self.closed_loop.layout
        body = layout.displaced(np.eye(len(layout.free)))[self.closed_loop.body.index]
        return body[[MOTIONS.index(name) for name in self.closed_loop.body.measured]]

    @cached_property
    def _responses(self):
        """P Z^-1, shape (f, k, d), F^T Z^-1, shape (f, i, d), and P Z^-1 F, shape (f, k, i), at the frequencies."""
        layout, moved = self.closed_loop.layout, self.moved
        moved_transposed = np.swapaxes(moved, 1, 2)
        body_stiffness, mass = (dense(matrix) for matrix in layout.body_matrices)
        # by cables at rest and by waves that leave their ends: of Z, and of the forces F of winches on the bodies
        of_cables = self.cables.end_stiffness, self._impedance
        stiffness, waves = ((moved_transposed @ part @ moved).sum(axis=0) for part in of_cables)
        static_force, wave_force = ((moved_transposed @ part @ self.reeled).sum(axis=0) for part in of_cables)
        omega = self.omega[:, None, None]
        force = static_force + 1j * omega * wave_force
        measured = np.broadcast_to(self.measured, (len(omega), *self.measured.shape))
        right_side = np.concatenate([measured, force.swapaxes(1, 2)], axis=1)
        dynamic_stiffness = stiffness + body_stiffness + 1j * omega * waves - omega**2 * mass
        solution = solve(dynamic_stiffness, right_side.swapaxes(1, 2)).swapaxes(1, 2)  # Z is symmetric
        of_measured, of_winches = solution[:, : len(self.measured)], solution[:, len(self.measured) :]
        return of_measured, of_winches, of_measured @ force

    @cached_property
    def _winch_gain(self):
        """|A| |C1 N|: response of winches to what is measured, per gain, at the frequencies, shape (f, i, k). [s]"""
        controller = self.closed_loop.untuned_loop.controller(1j * self.omega)
        return np.abs(self.closed_loop.body.allocation.shares) * np.abs(controller)[:, None]

    def _shift_per_gain(self, cable, index, coupling):
        """Bound on the shift of poles of modes of a cable per gain, |C1 N| |b| |A| |P u|/(2 W), shape (n,).

        Parameters
        ----------
        cable : int
        index : ndarray of int, shape (n,)
            Which of the frequencies is that of each mode.
        coupling : ndarray, shape (n, 6)
            m of `Superelement`. [sqrt(kg)]
        """
        square = self.omega[index, None] ** 2
        force = square * (coupling @ self.moved[cable])  # W^2 G^T m
        measured, pushed = (np.abs(part[index] @ force[..., None]) for part in self._responses[:2])
        push = np.abs(square * (coupling @ self.reeled[cable])) + pushed[..., 0]
        winches = (self._winch_gain[index] @ measured)[..., 0]
        return (push * winches).sum(axis=-1) / (2 * self.omega[index])

    def driven_up_to(self, gain):
        """Frequency up to which the gain could drive waves across and along each cable, shape (2, c). [rad/s]

        Zero where it drives none.
        """
        return np.where(self._driving_gain < gain, self.omega, 0.0).max(axis=-1)

    @cached_property
    def _driving_gain(self):
        """Gain above which waves across and along each cable could be driven, shape (2, c, f). [rad/s]"""
        gain = np.full((2, self.cables.count, len(self.omega)), np.inf)
        responses = *self._responses[:2], self._winch_gain
        responses = [np.ascontiguousarray(part.transpose(2, 1, 0)) for part in responses]
        for cable in np.flatnonzero(self.cables.heavy).tolist():
            gain[:, cable] = self._driving_gain_of(cable, *responses)
        return gain

    def _driving_gain_of(self, cable, of_measured, of_winches, winch_gain):
        """`_driving_gain` of one cable, (2, f), by `_responses` and `_winch_gain` with their last axis first."""
        forces, across, by_sag, along, decay = self._waves(cable)

        def of_waves(values):
            """Sizes for four waves across, then two along, shape (6, ..., f), of values for the `forces`."""
            return np.abs(np.concatenate([across * values[:4] + by_sag * values[4:5], along * values[5:]]))

        moved = forces @ self.moved[cable]
        measured, pushed = (
            of_waves((moved @ part.reshape(len(part), -1)).reshape(len(forces), *part.shape[1:]))
            for part in (of_measured, of_winches)
        )
        push = of_waves((forces @ self.reeled[cable])[..., None]) + pushed
        shift = (push * (winch_gain * measured[:, :, None]).sum(axis=1)).sum(axis=1) * self.omega**3 / 2
        harmless = np.maximum(STUDY.driven_decay * decay, UNDAMPED * self.omega) / STUDY.driven_wave_safety
        with np.errstate(divide="ignore"):  # waves that move no winch
            return harmless / np.stack([shift[:4].max(axis=0), shift[4:].max(axis=0)])

    def _waves(self, cable):
        """Waves across and along a cable, taken as modes at each of the f frequencies.

        Masses on the cable divide it: the shortest part has the largest forces on its ends, and is taken for all.

        Returns
        -------
        forces : ndarray, shape (7, 6)
            Directions of forces on both ends: of the four waves across, along the cable by its sag, of two along it.
        across, by_sag, along : ndarray, shape (f,)
            Sizes of the forces of the module's docstring, over W^2, by waves across, their stretching, and those along:
            m of `Superelement`. [sqrt(kg)]
        decay : ndarray, shape (2, f)
            Rates at which waves across and along decay. [1/s]
        """
        omega, span = self.omega, self.cables.catenary.span
        values = span.axial_stiffness, span.mass, span.unstretched_length, span.gravity
        stiffness, mass, length, gravity = (float(value[cable]) for value in values)
        direction, tension = (part[cable] for part in outward(self.equilibrium))
        tension = float(tension.max())
        part_ends = np.unique([0.0, *(position for position, _ in self.cables.point_masses[cable]), 1.0])
        shortest = np.diff(part_ends).min()
        time = shortest * self.travel_time[:, cable]
        across, along = np.sqrt(2 * np.sqrt(np.array([tension, stiffness]) * mass) / time)[:, None] / omega
        # waves across stretch the cable where it sags, see the module's docstring
        by_sag = stiffness * mass * gravity / tension * np.sqrt(2 / (mass * length)) * 2 / time[ACROSS] / omega**3
        # forces on both ends, in phase or opposite: two waves along, four across in two normal directions
        signs, tangents = np.repeat([[1.0, 1.0], [1.0, -1.0]], 3, axis=1), direction.reshape(6)
        normals = (_normals(direction)[:, None] * signs).reshape(4, 6)
        decay = self._wave_decay(cable, mass, divided=shortest != 1)
        decay[ACROSS] += self.air[cable]
        return np.concatenate([normals, tangents[None], signs * tangents]), across, by_sag, along, decay

    def _wave_decay(self, cable, mass, divided):
        """Rates at which waves across and along a cable of a mass per length [kg/m] decay without wind, shape (2, f).

        [1/s]. Masses that divide the cable take half of the viscous part at most, see `stability`.
        """
        damping, omega = self.cables.damping[cable], self.omega
        viscous = damping.viscous / mass / (4 if divided else 2)
        if damping.model == "modal":
            return viscous + damping.ratio * np.stack([omega, omega])
        loss = damping.loss_factor if damping.model == "hysteretic" else damping.time * omega
        return viscous + np.stack([0.0 * omega, loss * omega / 2])

    def loop_up_to(self, gain):
        """Frequency up to which the loop gain is above `broad_loop_gain` where waves do not return. [rad/s]"""
        controller = self.closed_loop.untuned_loop.controller(1j * self.omega)[:, None, :]
        unit_gain = self._responses[2] @ self.closed_loop.body.allocation.shares * controller
        size = gain * np.abs(np.linalg.eigvals(unit_gain)).max(axis=1)
        return float(self.omega[size > STUDY.broad_loop_gain].max(initial=0.0))

    def driven(self, loop_gain, gain):
        """Decide which modes of each cable a gain could make grow: list of ndarray of bool, shape (n,).

        First by the bound of the module's docstring; modes that exceed it are judged by the estimated shift of their
        own poles. Those poles count the damping by moving bodies too: a mode across a cable may have hardly any other.

        Parameters
        ----------
        loop_gain : LoopGain
            Its `elements` have the n modes of each cable that are judged.
        gain : float
            [rad/s]
        """
        of_cables = []
        for cable, element in enumerate(loop_gain.elements):
            is_driven = self.may_drive(cable, element, gain)
            if is_driven.any():
                omega, poles, shift = element.omega[is_driven], *loop_gain.poles_of(cable, np.flatnonzero(is_driven))
                by_air = self._decay(cable, element)[is_driven] - element.decay[is_driven]  # lower bound, see `air`
                is_driven[is_driven] = gain * np.abs(shift) > self._harmless_shift(by_air - poles.real, omega)
            of_cables.append(is_driven)
        return of_cables

    def may_drive(self, cable, element, gain):
        """Which modes of a cable a gain could drive by the bound of the module's docstring: array of bool, shape (n,).

        Parameters
        ----------
        cable : int
        element : Superelement
            Of this cable.
        gain : float
            [rad/s]
        """
        # index of the frequency of the bound next above each mode
        index = np.clip(np.searchsorted(self.omega, element.omega), 0, len(self.omega) - 1)
        bound = gain * self._shift_per_gain(cable, index, element.coupling)
        return bound > self._harmless_shift(self._decay(cable, element), element.omega)

    @staticmethod
    def _harmless_shift(decay, omega):
        """Shift of poles by a gain up to which it drives no mode, of modes with a rate of decay [1/s], shape (n,)."""
        return np.maximum(STUDY.driven_decay * decay, UNDAMPED * omega)


def _normals(direction):
    """Two unit vectors across a cable at both of its ends, shape (2, 6), for its tangents there, shape (2, 3)."""
    cross = cross_matrix(direction)
    normal = (cross @ np.eye(3)[np.abs(direction).argmin(axis=1)][..., None])[..., 0]
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return np.stack([normal, (cross @ normal[..., None])[..., 0]]).reshape(2, 6)
