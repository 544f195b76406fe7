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

The highest modes that a gain could drive follow from the same bound for waves. A wave that runs back and forth along a
cable, of modal mass 1, has the force W sqrt(2 z/tau) on both of its ends, tau being its travel time and z that of its
direction. A wave across a cable of length l stretches it too where it sags: by the tension
EA (mu g/T) sqrt(2/(mu l)) 2/(W tau).
"""

from dataclasses import dataclass
from functools import cached_property
from math import ceil, prod, sqrt
from operator import attrgetter

import numpy as np

from cablestudy.cable.geometry import points_along
from cablestudy.cable.matrices import dense, solve
from cablestudy.cable.records import stack, take_rows
from cablestudy.control.loop_gain_poles import poles_of_modes
from cablestudy.control.notch import NotchedLaw
from cablestudy.control.tolerances import CONTROL
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.determinacy import MOTIONS
from cablestudy.statics.rigid import cross_matrix
from cablestudy.statics.suspension import outward_tangents
from cablestudy.system.condensed_cables import laws_of
from cablestudy.system.together import batches, computed_together

# growth over frequency by a gain that is no instability, however small the decay
UNDAMPED = CONTROL.negligible_growth / 4
RANGE = np.geomspace(1.0, 1e8, 481)  # frequencies at which the bound is computed, over the lowest of the modes
ACROSS, ALONG = 0, 1  # directions of waves, across a cable and along it: rows of arrays


class DrivingBounds:
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
    connection : ndarray, shape (c, 6, d)
        G: displacements of both ends of each cable by the free displacements.
    reeling : ndarray, shape (c, 6, i)
        H: displacements of both ends by the lengths that winches reel in.
    """

    def __init__(self, closed_loop):
        self.closed_loop, self.equilibrium = closed_loop, closed_loop.equilibrium
        self.cables = closed_loop.modes.models.cables
        self.omega = RANGE * closed_loop.modes.omega[0]
        self.connection = closed_loop.plant.end_movements
        self.reeling = closed_loop.plant.winched_ends.movements.reshape(self.cables.count, 6, -1)

    @cached_property
    def travel_time(self):
        """Travel time of waves across and along each cable, shape (2, c). [s]"""
        span = self.cables.catenary.span
        along = span.unstretched_length * np.sqrt(span.mass / span.axial_stiffness)
        return np.array([self.cables.travel_time, along])

    @cached_property
    def air(self):
        """Lower bound of the rate at which waves across each cable decay by the air, shape (c,). [1/s]"""
        airflow, span, force = self.closed_loop.plant.airflow, self.cables.catenary.span, np.zeros(self.cables.count)
        for drag in airflow.damping_drags if airflow else []:
            chord = span.frame[:, 0]
            speed = np.linalg.norm(drag.velocity - (chord @ drag.velocity)[:, None] * chord, axis=-1)
            if drag.profile is not None:
                end_1 = self.equilibrium.ends[self.equilibrium.suspension.of_cables, 0]
                points = points_along(self.cables.catenary, np.linspace(0.0, 1.0, MOTION.least_drag_points))
                pressure = drag.profile.of_each(len(force)).pressure(points + end_1[:, None])
                speed = speed * np.sqrt(pressure.min(axis=-1))
            force += drag.density * drag.cables * speed / 2  # across the wind; along it twice as much
        return force / (2 * np.where(self.cables.heavy, span.mass, np.inf))

    @cached_property
    def outward_tangents(self):
        """`statics.suspension.outward_tangents` of the equilibrium."""
        return outward_tangents(self.equilibrium)

    def along(self, cable, element):
        """Which modes of a cable between fixed ends are along it, array of bool, shape (n,); the air damps the others.

        Those whose force on an end, along the cable, is a good part of W sqrt(2 z/tau), that of a wave along it.
        """
        span, tangent = self.cables.catenary.span, self.outward_tangents[0][cable, 0]
        impedance = np.sqrt(span.axial_stiffness[cable] * span.mass[cable])
        squared_force = (element.coupling[:, :3] @ tangent) ** 2 * element.omega**2  # over W^2
        return squared_force * self.travel_time[ALONG, cable] >= MOTION.axial_share * 2 * impedance

    def _decay(self, cable, element):
        """Lower bound of the rate at which the modes of a cable between fixed ends decay, shape (n,). [1/s]"""
        if element.air is not None:  # its own decay has the damping by the air
            return element.decay
        return element.decay + np.where(self.along(cable, element), 0.0, self.air[cable])

    @property
    def _signature(self):
        """Sizes of all arrays, by which effects are found that are computed together: tuple."""
        return self.reeling.shape, self.measured.shape, self.connection.shape

    @property
    def _size(self):
        """Side of a square matrix with as many entries as `driving_gain` and `responses` have numbers."""
        return ceil(sqrt(sum(map(prod, self._signature)) * len(self.omega)))

    @cached_property
    def measured(self):
        """P: measured coordinates by the free displacements, shape (k, d)."""
        layout = self.closed_loop.layout
        body = layout.displaced(np.eye(len(layout.free)))[self.closed_loop.body.index]
        return body[[MOTIONS.index(name) for name in self.closed_loop.body.measured]]

    @computed_together
    def responses(effects):
        """`BodyResponses` at the frequencies."""
        for members in batches(effects, attrgetter("_signature"), attrgetter("_size")):
            responses = _responses_of_rows(members)
            yield from ((one, take_rows(responses, row)) for row, one in enumerate(members))

    def _shift_per_gain(self, cable, index, coupling):
        """Bound on the shift of poles of n modes of a cable per gain, |C1 N| |b| |A| |P u|/(2 W), shape (n,).

        `index` tells which of the frequencies is that of each mode; `coupling`, shape (n, 6), is m of `Superelement`.
        """
        square = self.omega[index, None] ** 2
        force = square * (coupling @ self.connection[cable])  # W^2 G^T m
        responses = self.responses
        measured = np.abs(responses.of_measured[index] @ force[..., None])
        pushed = np.abs(responses.of_winches[index] @ force[..., None])
        push = np.abs(square * (coupling @ self.reeling[cable])) + pushed[..., 0]
        winches = (responses.winch_gain[index] @ measured)[..., 0]
        return (push * winches).sum(axis=-1) / (2 * self.omega[index])

    def driven_up_to(self, gain):
        """Frequency up to which the gain could drive waves across and along each cable, shape (2, c). [rad/s]

        Zero where it drives none.
        """
        return np.where(self.driving_gain < gain, self.omega, 0.0).max(axis=-1)

    @computed_together
    def driving_gain(effects):
        """Gain above which waves across and along each cable could be driven, shape (2, c, f). [rad/s]"""
        DrivingBounds.responses.compute(effects)
        for members in batches(effects, attrgetter("_signature"), attrgetter("_size")):
            yield from zip(members, _driving_gains_of_rows(members), strict=True)

    def shortest_part(self, cable):
        """Length of the shortest part of a cable, which masses on it divide, over that of the cable. [-]"""
        positions = np.unique([0.0, *(position for position, _ in self.cables.point_masses[cable]), 1.0])
        return np.diff(positions).min()

    def loop_up_to(self, gain):
        """Frequency up to which the loop gain is above `broad_loop_gain` where waves do not return. [rad/s]"""
        controller = self.closed_loop.untuned_loop.controller(1j * self.omega)[:, None, :]
        unit_gain = self.responses.measured_by_winches @ self.closed_loop.body.allocation.matrix * controller
        size = gain * np.abs(np.linalg.eigvals(unit_gain)).max(axis=1)
        return float(self.omega[size > MOTION.broad_loop_gain].max(initial=0.0))

    def may_drive(self, elements, gain):
        """Which modes of each cable a gain could drive by the bound of the module's docstring: list, as `driven_modes`.

        Parameters
        ----------
        elements : list of Superelement
            Of all cables.
        gain : float
            [rad/s]
        """
        of_cables = []
        for cable, element in enumerate(elements):
            # index of the frequency of the bound next above each mode
            index = np.clip(np.searchsorted(self.omega, element.omega), 0, len(self.omega) - 1)
            bound = gain * self._shift_per_gain(cable, index, element.coupling)
            of_cables.append(bound > self._harmless_shift(self._decay(cable, element), element.omega))
        return of_cables

    @staticmethod
    def _harmless_shift(decay, omega):
        """Shift of poles by a gain up to which it drives no mode, of modes with a rate of decay [1/s], shape (n,)."""
        return np.maximum(MOTION.driven_decay * decay, UNDAMPED * omega)


def driven_modes(effects, loop_gains, gains):
    """Decide which modes of each cable a gain of the winches could make grow, for many suspensions ("rows").

    It could if it shifts the pole of the mode by more than `MOTION.driven_decay` times its rate of decay. For most
    modes the upper bound on the shift (module's docstring) excludes this. For the others the shift and the decay of
    their poles are estimated. Bodies that move with a mode damp it, too: one across a cable by little else, perhaps.

    Parameters
    ----------
    effects : list of DrivingBounds
        Bounds on the effects of a gain, of each row.
    loop_gains : list of LoopGain
        Of each row; `elements` have the n modes of each cable.
    gains : list of float
        [rad/s]

    Returns
    -------
    list of (list of ndarray of bool, shape (n,))
        For each row and cable: True for modes that the gain could make grow.
    """
    rows = list(zip(effects, loop_gains, gains, strict=True))
    driven = [own.may_drive(loop_gain.elements, gain) for own, loop_gain, gain in rows]
    numbers = [[np.flatnonzero(of_cable) for of_cable in of_row] for of_row in driven]
    for (own, loop_gain, gain), of_row, pair in zip(rows, driven, poles_of_modes(loop_gains, numbers), strict=True):
        edges = np.cumsum([np.count_nonzero(of_cable) for of_cable in of_row])[:-1]
        parts = zip(loop_gain.elements, of_row, *(np.split(array, edges) for array in pair), strict=True)
        for cable, (element, of_cable, poles, shift) in enumerate(parts):
            by_air = own._decay(cable, element)[of_cable] - element.decay[of_cable]  # lower bound, see `air`
            harmless = own._harmless_shift(by_air - poles.real, element.omega[of_cable])
            of_cable[of_cable] = ~(gain * np.abs(shift) <= harmless)  # driven, too, where the shift is no number
    return driven


@dataclass(frozen=True)
class BodyResponses:
    """Responses of suspensions (...) whose cables do not return waves, at f frequencies.

    With the symbols of the module's docstring: Z is the dynamic stiffness of the bodies, P u are the k measured
    coordinates of their d free displacements u, F v are the forces on the bodies by the lengths v of the i winches, A
    allocates coordinates to winches, and C1 N is the control law of unit gain with notches.

    Attributes
    ----------
    of_measured : ndarray, complex, shape (..., f, k, d)
        P Z^-1: measured coordinates by forces on the bodies.
    of_winches : ndarray, complex, shape (..., f, i, d)
        F^T Z^-1.
    measured_by_winches : ndarray, complex, shape (..., f, k, i)
        P Z^-1 F: measured coordinates by lengths that winches reel in.
    winch_gain : ndarray, shape (..., f, i, k)
        |A| |C1 N|: lengths that winches reel in by measured coordinates, per gain. [s]
    """

    of_measured: np.ndarray
    of_winches: np.ndarray
    measured_by_winches: np.ndarray
    winch_gain: np.ndarray


def _stacked(owners, *names):
    """Attributes of n objects, with the row first: iterable of arrays."""
    return (np.array([getattr(owner, name) for owner in owners]) for name in names)


def _responses_of_rows(effects):
    """`BodyResponses` of n suspensions ("rows") at f frequencies, from their `DrivingBounds` with equal array sizes."""
    connection, reeling, measured, omega = _stacked(effects, "connection", "reeling", "measured", "omega")
    w = omega[..., None, None]
    # K + i w z at the ends of the cables: at rest, and by waves that leave their ends, shape (n, c, 6, 6) each
    end_stiffness, impedance = np.array([one.cables.end_stiffness for one in effects]), _impedance_of_rows(effects)

    def on_bodies(of_ends, motions):
        """Forces on bodies by motions of all ends, from matrices of the ends of each cable, shape (n, 1, d, ...)."""
        return (np.swapaxes(connection, -1, -2) @ of_ends @ motions).sum(axis=1)[:, None]

    bodies = [[dense(matrix) for matrix in one.closed_loop.layout.body_matrices] for one in effects]
    body_stiffness, mass = (np.array(of_rows)[:, None] for of_rows in zip(*bodies, strict=True))
    stiffness, waves = on_bodies(end_stiffness, connection), on_bodies(impedance, connection)
    dynamic_stiffness = stiffness + body_stiffness + 1j * w * waves - w**2 * mass  # Z
    force = on_bodies(end_stiffness, reeling) + 1j * w * on_bodies(impedance, reeling)  # F
    of_rows = np.repeat(np.swapaxes(measured, 1, 2)[:, None], omega.shape[1], axis=1)  # P^T
    right_side = np.concatenate([of_rows, force], axis=-1, dtype=complex)
    solution = np.swapaxes(solve(dynamic_stiffness, right_side), -1, -2)  # Z is symmetric
    of_measured, of_winches = np.split(solution, [measured.shape[1]], axis=2)
    return BodyResponses(of_measured, of_winches, of_measured @ force, _winch_gains(effects, omega))


def _winch_gains(effects, omega):
    """|A| |C1 N| of n rows at the frequencies of each, shape (n, f): shape (n, f, i, k). [s]"""
    loops, row = [one.closed_loop.untuned_loop for one in effects], np.repeat(np.arange(len(omega)), omega.shape[1])
    controller = NotchedLaw.of_rows([loop.controller for loop in loops], row, 1j * omega.ravel())
    allocation = np.abs(np.array([loop.allocation.matrix for loop in loops]))
    return allocation[:, None] * np.abs(controller).reshape(*omega.shape, 1, -1)


def _impedance_of_rows(effects):
    """z at both ends of each cable, block diagonal, shape (n, c, 6, 6); zero of a cable without mass. [kg/s]"""
    direction, tension = stack([one.outward_tangents for one in effects])
    mass, stiffness = _stacked([one.cables.catenary.span for one in effects], "mass", "axial_stiffness")
    mass = np.where(np.array([one.cables.heavy for one in effects]), mass, 0.0)
    along, across = np.sqrt(stiffness * mass)[..., None, None], np.sqrt(tension * mass[..., None])
    impedance = np.zeros((*mass.shape, 6, 6))
    for end in range(2):
        onto_tangent = direction[:, :, end, :, None] * direction[:, :, end, None, :]  # t t^T
        rows = slice(3 * end, 3 * end + 3)
        own = along * onto_tangent + across[:, :, end, None, None] * (np.eye(3) - onto_tangent)
        impedance[:, :, rows, rows] = own
    return impedance


def _driving_gains_of_rows(effects):
    """`DrivingBounds.driving_gain` of n rows with arrays of equal sizes, shape (n, 2, c, f). [rad/s]"""
    stacked = _stacked([one.responses for one in effects], "of_measured", "of_winches", "winch_gain")
    responses = [np.ascontiguousarray(part.transpose(0, 3, 2, 1)) for part in stacked]
    heavy = np.array([one.cables.heavy for one in effects])
    gain = np.full((*heavy.shape, 2, len(RANGE)), np.inf)
    for cable in np.flatnonzero(heavy.any(axis=0)).tolist():
        rows = np.flatnonzero(heavy[:, cable])
        chosen = [effects[row] for row in rows.tolist()]
        gain[rows, cable] = _driving_gain_of_cable(chosen, cable, *(part[rows] for part in responses))
    return np.swapaxes(gain, 1, 2)


def _driving_gain_of_cable(effects, cable, of_measured, of_winches, winch_gain):
    """Gain above which waves across and along one cable could be driven, in n suspensions, (n, 2, f). [rad/s]

    A wave is taken as a mode of the frequency W. With the bound x on the shift of its pole per gain (see the module's
    docstring), and its rate of decay a, this gain is

        gain = r a/(x s),   x = |C1 N| |b| |A| |P u|/(2 W),   r = `MOTION.driven_decay`.

    The safety factor is s = `MOTION.driven_wave_safety`. r a is at least `UNDAMPED` W, a growth that is no instability.
    Of the four waves across of `_waves` the one with the largest x counts, and so of the two along.

    `of_measured`, `of_winches` and `winch_gain`, shapes (n, d, k, f), (n, d, i, f) and (n, k, i, f), are P Z^-1, F^T
    Z^-1 and |A| |C1 N| from `_responses_of_rows`, with the axes behind the row reversed: d free displacements of
    bodies, k measured coordinates, i winches.
    """
    forces, decay, across, by_sag, along = _waves(effects, cable)
    connection, reeling, omega = _stacked(effects, "connection", "reeling", "omega")

    def of_waves(values):
        """Sizes for four waves across, then two along, shape (n, 6, ..., f), of values for the seven `forces`."""
        shape = len(values), *[1] * (values.ndim - 2), -1
        waves_across = across.reshape(shape) * values[:, :4] + by_sag.reshape(shape) * values[:, 4:5]
        return np.abs(np.concatenate([waves_across, along.reshape(shape) * values[:, 5:]], axis=1))

    def by_bodies(response):
        """Response, shape (n, d, ..., f), to the forces at the bodies that hold the cable, shape (n, 7, ..., f)."""
        products = forces @ connection[:, cable] @ response.reshape(*response.shape[:2], -1)
        return products.reshape(*forces.shape[:2], *response.shape[2:])

    measured = of_waves(by_bodies(of_measured))
    push = of_waves((forces @ reeling[:, cable])[..., None]) + of_waves(by_bodies(of_winches))
    shift = (push * (winch_gain[:, None] * measured[:, :, :, None]).sum(axis=2)).sum(axis=2) * omega[:, None] ** 3 / 2
    harmless = np.maximum(MOTION.driven_decay * decay, UNDAMPED * omega[:, None]) / MOTION.driven_wave_safety
    with np.errstate(divide="ignore"):  # waves that move no winch
        return harmless / np.stack([shift[:, :4].max(axis=1), shift[:, 4:].max(axis=1)], axis=1)


def _waves(effects, cable):
    """Forces on the ends of one cable in n rows, by waves across and along it, taken as modes of f frequencies W.

    A wave of modal mass 1 exerts on both ends the force W sqrt(2 z/tau): z is sqrt(T mu) across and sqrt(EA mu) along
    the cable, tau the travel time, T the tension and mu the mass per length. Where a cable of length l sags under
    gravity g, a wave across it stretches it, too, by the tension EA (mu g/T) sqrt(2/(mu l)) 2/(W tau). Masses on the
    cable divide it: the shortest part has the largest forces on its ends, and is taken for all.

    Returns
    -------
    forces : ndarray, shape (n, 7, 6)
        Unit vectors of the forces on end 1, x, y, z, then on end 2: of the four waves across, of the tension by their
        sag, of the two waves along. [-]
    decay : ndarray, shape (n, 2, f)
        Rates at which waves across and along decay. [1/s]
    across, by_sag, along : ndarray, shape (n, f)
        Sizes over W^2 of the forces by waves across, of the tension by their sag, and of the forces by waves along: m
        of `Superelement`. [sqrt(kg)]
    """
    travel_time, air, omega = _stacked(effects, "travel_time", "air", "omega")
    names = "axial_stiffness", "mass", "unstretched_length", "gravity"
    spans = _stacked([one.cables.catenary.span for one in effects], *names)
    stiffness, mass, length, gravity = (part[:, cable, None] for part in spans)  # (n, 1) each
    direction, tension = (part[:, cable] for part in stack([one.outward_tangents for one in effects]))  # at both ends
    tension = tension.max(axis=1)[:, None]
    shortest = np.array([one.shortest_part(cable) for one in effects])[:, None]
    across_time, along_time = (shortest * travel_time[:, way, cable, None] for way in (ACROSS, ALONG))
    across = np.sqrt(2 * np.sqrt(tension * mass) / across_time) / omega
    along = np.sqrt(2 * np.sqrt(stiffness * mass) / along_time) / omega
    # waves across stretch the cable where it sags, see the module's docstring
    by_sag = stiffness * mass * gravity / tension * np.sqrt(2 / (mass * length)) * 2 / across_time / omega**3
    # forces on both ends, in phase or opposite: two waves along, four across in two normal directions
    signs, tangents = np.repeat([[1.0, 1.0], [1.0, -1.0]], 3, axis=1), direction.reshape(-1, 1, 6)
    normals = (_normals(direction)[:, :, None] * signs).reshape(-1, 4, 6)
    decay = _wave_decay([one.cables.damping[cable] for one in effects], mass, shortest != 1, omega)
    decay[:, ACROSS] += air[:, cable, None]
    return np.concatenate([normals, tangents, signs * tangents], axis=1), decay, across, by_sag, along


def _wave_decay(damping, mass, divided, omega):
    """Rates at which waves across and along a cable of n rows decay without wind, shape (n, 2, f). [1/s]

    By its mass per length, shape (n, 1) [kg/m]. Masses that divide the cable take half of the viscous part at most, see
    `stability`.
    """
    laws = {name: values[:, None] for name, values in laws_of(damping).items()}
    viscous = np.array([law.viscous for law in damping])[:, None] / mass / np.where(divided, 4, 2)
    across = viscous + laws["ratio"] * omega
    return np.stack([across, across + (laws["loss"] + laws["time"] * omega) * omega / 2], axis=1)


def _normals(direction):
    """Two unit vectors across a cable at both of its ends, shape (n, 2, 6), for its tangents there, (n, 2, 3)."""
    cross = cross_matrix(direction)
    normal = (cross @ np.eye(3)[np.abs(direction).argmin(axis=-1)][..., None])[..., 0]
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.stack([normal, (cross @ normal[..., None])[..., 0]], axis=1).reshape(-1, 2, 6)
