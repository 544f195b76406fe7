"""One suspension in the mean wind as a linear system without its loop: coordinates, actuators, damping by the air.

Scenes that differ only in the loop of the winches, in the exposure time or the correcting mirror of a telescope, or in
gusts share it: `in_wind` adds these.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.matrices import dense
from cablestudy.cable.records import stack
from cablestudy.control.motion import Actuator, actuated, motion_of_rows, with_actuators
from cablestudy.control.suspension import Marker, SystemParts, suspension_systems
from cablestudy.control.winches import ENDS, Winch, WinchedEnds
from cablestudy.errors import NoSolutionError, outcome_of
from cablestudy.motion.airflow import load_stiffness_of_bodies
from cablestudy.motion.left_out_modes import BodiesOnAllModes
from cablestudy.motion.reduction_basis import MIDSPAN, applied_loads, loads_and_bases, space_with_fewer_modes
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.actuator_tables import ReactionWheel
from cablestudy.statics.suspension import AXES
from cablestudy.system.connected import observed
from cablestudy.system.linear import LinearSystem
from cablestudy.system.state_rows import state_rows
from cablestudy.system.together import batches, computed_together
from cablestudy.wind.strips import midspan_shapes


def winches_of(scene, cable_names):
    """The `Winch` of each cable that has one, in the order of the scene: list."""
    return [
        Winch(cable_names.index(name), ENDS.index(winch.end), winch.direction and _unit(winch.direction))
        for name, winch in scene.winches.items()
    ]


def _unit(vector):
    """Unit vector along a direction of the file, which may have any length."""
    return np.array(vector) / np.sqrt(sum(part * part for part in vector))


def markers_of(scene):
    """The `Marker` of each marker of each body: list."""
    return [
        Marker(name, number, position)
        for number, body in enumerate(scene.bodies.values())
        for name, position in body.markers.items()
    ]


def actuators_of(scene):
    """The `Actuator` of each actuator: list."""
    names, actuators = list(scene.bodies), []
    for name, table in scene.actuators.items():
        body = names.index(table.body) if table.body else 0
        axis = _unit(table.axis)
        corner = 2 * np.pi * (table.high_pass or 0.0)
        if isinstance(table, ReactionWheel):
            gain = table.rate_gain
            actuator = Actuator(name, True, body, np.zeros(3), axis, table.inertia, velocity_gain=gain, corner=corner)
        else:
            spring = 2 * np.pi * table.frequency, table.damping_ratio
            gains = table.velocity_gain, table.position_gain
            actuator = Actuator(name, False, body, np.array(table.at), axis, table.mass, *spring, *gains, corner)
        actuators.append(actuator)
    return actuators


@dataclass(eq=False)
class Plant:
    """A suspension about its equilibrium in the mean wind, without loop.

    Attributes
    ----------
    scene : SuspensionScene
    equilibrium : Equilibrium
        Equilibrium of this case, in the mean wind.
    airflow : Airflow or None
        Air about this case, which may damp it; None without wind.
    modes : CoupledModes
        Modes of the suspension that the model has.
    accuracy : float
        Relative accuracy of their frequencies. [-]
    model : FixedModel or None
        Elements that the scene states; where it is None the accuracy decides.
    driven : int
        How many of the modes, the last ones, were added to the lowest ones because a mode near their frequencies would
        grow first if the gain were raised (`DrivenCables.with_critical_modes`).
    loops : dict
        Control -> results shared by all gains and by models with other numbers of modes, to be filled (`ClosedLoop`).
    responses : bool
        True if static responses to the inertia and damping forces of moving bodies and winches are coordinates too.
    complete : bool
        True if the model has modes too that no output depends on.
    midspans : bool
        True if the displacements of the cables at mid-span are outputs.
    points : bool
        True if static responses to loads on free points are coordinates too, as those to loads on bodies always are.
    """

    scene: object
    equilibrium: object
    airflow: object
    modes: object
    accuracy: float
    model: object
    driven: int = 0
    loops: dict = field(default_factory=dict)
    responses: bool = False
    complete: bool = False
    midspans: bool = False
    points: bool = False

    def __post_init__(self):
        self.drag, self.layout = self.airflow and self.airflow.drag, self.modes.layout
        self.winches = winches_of(self.scene, self.equilibrium.suspension.cable_names)
        self.markers, self.actuators = markers_of(self.scene), actuators_of(self.scene)

    @cached_property
    def winched_ends(self):
        """`WinchedEnds`: how winches move the ends of the cables."""
        return WinchedEnds([self.layout], [self.winches])

    @cached_property
    def end_movements(self):
        """G: displacements of both ends of each cable by the free displacements, shape (c, 6, d)."""
        cables = len(self.equilibrium.suspension.cable_names)
        return dense(self.layout.connection).reshape(cables, 6, len(self.layout.free))

    @cached_property
    def with_all_modes(self):
        """Copy for a state space: with the modes that no output depends on, and with loads on free points as inputs."""
        points = self.layout.free.max(initial=0) >= 6 * self.equilibrium.suspension.bodies
        if len(self.kept) == len(self.modes) and (self.points or not points):
            return self
        return replace(self, complete=True, points=True, loops={})

    @cached_property
    def outputs(self):
        """Name of each output -> its row: displacements of bodies, markers, and perhaps mid-spans; tensions."""
        return {name: row for row, (name, _unit) in enumerate(self.full_system.outputs)}

    @computed_together
    def _system_and_observed(plants):
        """`LinearSystem` with all coordinates, and which of these outputs depend on; raises as `_parts_of_system`.

        Plants with arrays of equal sizes are computed together: no digit of one depends on the others.
        """
        for members in batches(plants, lambda plant: plant._parts_of_system.signature, _size):
            systems = suspension_systems([plant._parts_of_system for plant in members])
            for row, (plant, mask) in enumerate(zip(members, observed(systems), strict=True)):
                yield plant, (systems.take(row), mask)

    @property
    def full_system(self):
        """`LinearSystem` with all coordinates of the cables, see `control.suspension.suspension_systems`."""
        return self._system_and_observed[0]

    @property
    def refused(self):
        """True if the plant has too many coordinates for a linear system."""
        return isinstance(outcome_of(lambda: self._parts_of_system), NoSolutionError)

    @cached_property
    def _parts_of_system(self):
        """`SystemParts` of the full system; raises NoSolutionError where it has too many coordinates."""
        models, kept = self.modes.models, self.modes.kept
        midspans = midspan_shapes(models, kept, self.equilibrium.catenary) if self.midspans else ()
        parts = SystemParts(self.layout, self.in_air(models, kept), self.winches, self.markers, midspans)
        parts.check_size()
        return parts

    @computed_together
    def _loads_and_basis(plants):
        """Loads whose static responses are coordinates, and the `basis`, see `reduction_basis.loads_and_bases`."""
        Plant._system_and_observed.compute(plants)
        yield from loads_and_bases(plants, _size)

    @property
    def basis(self):
        """Frequencies, shape (m,), and shapes, (n, m), of the coordinates: modes, then static responses to loads."""
        return self._loads_and_basis[1]

    @cached_property
    def kept(self):
        """Numbers from 0 of the modes that are coordinates of the model: those that outputs depend on, or all."""
        every = np.arange(len(self.modes))
        if self.complete:
            return every
        is_observed = self._observed_modes(self.modes.shapes)
        return every[is_observed] if is_observed.any() else every

    def _observed_modes(self, shapes):
        """Which of some mode shapes, shape (n, k), outputs depend on: ndarray of bool, shape (k,)."""
        if (coordinates := self._system_and_observed[1]).all():
            return np.ones(shapes.shape[1], dtype=bool)
        shapes = shapes[coordinates]
        mass = self.full_system.mass[np.ix_(coordinates, coordinates)]
        return (shapes * (mass @ shapes)).sum(axis=0) > MOTION.unseen_energy

    @property
    def other_poles(self):
        """Estimated poles of modes that were computed and are not in the model, by the damping of their shapes. [rad/s]

        s = i W - (c + h/W)/2, c and h being the viscous and hysteretic damping of the shape.
        """
        computed, count, system = self.modes.with_all_modes, len(self.modes), self.full_system
        if len(computed.omega) <= count:
            return np.zeros(0, dtype=complex)
        omega, shapes = computed.omega[count:], computed.shapes[:, count:]
        is_observed = self._observed_modes(shapes)
        omega, shapes = omega[is_observed], shapes[:, is_observed]
        matrices = system.damping, system.stiffness.imag
        viscous, hysteretic = (np.einsum("nk,nk->k", shapes, matrix @ shapes) for matrix in matrices)
        by_air = self.air_on_bodies(shapes)
        viscous = viscous + (np.diagonal(by_air) if np.ndim(by_air) else by_air)
        return 1j * omega - (viscous + hysteretic / omega) / 2

    @cached_property
    def coarse_space(self):
        """Basis of a space of the coordinates with fewer modes, static responses and all strokes, shape (m, r).

        Where an accuracy decides on the model, static responses are those to winches and loads only: where responses to
        the forces of moving bodies matter, so may what they leave out (3e-5 of an RMS without them, 1.5e-3 in truth).
        Where the scene states the elements, all static responses are kept.
        """
        return space_with_fewer_modes(self, applied_loads(self) if self.model is None else self._loads_and_basis[0])

    @cached_property
    def coarse_motion(self):
        """`motion` in the coordinates of `coarse_space`: `LinearSystem`, which all loops share."""
        return self.motion.within(self.coarse_space)

    @cached_property
    def coarse_space_in_time(self):
        """Basis as in `coarse_space`, but with static responses to winches and loads only, also for stated elements.

        A step excites waves of all frequencies in the cables, which only static responses represent. Responses to
        moving bodies are left out here to see what they change.
        """
        return self.coarse_space if self.model is None else space_with_fewer_modes(self, applied_loads(self))

    @property
    def lacked_compliance(self):
        """Largest share in the static compliance of a free displacement that the lowest modes, `fewer_modes`, lack."""
        lowest = slice(int(MOTION.fewer_modes * len(self.modes)))
        shares = self.modes.shares_of(np.arange(len(self.layout.free)))[:, lowest]
        return float((1 - shares.sum(axis=1)).max(initial=0.0))

    @cached_property
    def all_modes(self):
        """`BodiesOnAllModes`, which all loops share."""
        return BodiesOnAllModes(self)

    @computed_together
    def stiffness_of_outputs(plants):
        """Estimate of the energy per square of each output, by which different outputs are compared, shape (o,)."""

        def numbers(plant):
            return plant.motion.signature, *(one.wheel for one in plant.actuators)

        for members in batches(plants, numbers, _size):
            motion = LinearSystem.of_rows([plant.motion for plant in members])
            count, outputs = len(motion), state_rows(motion, actuators=members[0].actuators).outputs
            squares = np.abs(outputs[..., : 2 * count]) ** 2
            parts = motion.stiffness.real, motion.damping, motion.mass
            stiffness, damping, mass = (np.diagonal(part, axis1=-2, axis2=-1) for part in parts)
            # an overdamped coordinate moves no faster than at K/C of its displacement, however light it is
            mass = np.maximum(mass, damping**2 / stiffness)
            by_displacements = squares[..., :count] * (motion.unit**2 / stiffness)[:, None, :]
            compliance = (by_displacements + squares[..., count:] / mass[:, None, :]).sum(axis=-1)
            yield from zip(members, 1 / np.maximum(compliance, np.finfo(float).tiny), strict=True)

    @property
    def has_air_damping(self):
        """True if the air damps what moves."""
        return self.airflow is not None and self.airflow.damps

    def in_air(self, models, kept):
        """Superelements of the cables of some `Models` with aerodynamic damping and stiffness: list of ReducedCable."""
        return self.airflow.damped(models, kept, self.equilibrium) if self.airflow else kept

    def air_on_bodies(self, shapes):
        """Aerodynamic damping of coordinates by the drag on bodies, see `damping_of_bodies`; 0 without."""
        return self.airflow.damping_of_bodies(self.layout, shapes) if self.airflow else 0.0

    @cached_property
    def load_stiffness_of_bodies(self):
        """Stiffness of the free displacements by loads on bodies: `airflow.load_stiffness_of_bodies`, shape (d, d)."""
        return load_stiffness_of_bodies(self.layout, self.airflow)

    @cached_property
    def loads_turn(self):
        """True if loads turn with what moves: dead moments, or the mean drag where the air damps."""
        kept = self._parts_of_system.kept
        return self.load_stiffness_of_bodies.any() or any(one.element.load_stiffness is not None for one in kept)

    def holding_loads(self, shapes):
        """Forces on all n coordinates that hold motions against loads, see `Layout.holding_loads`, shape (n, m + i).

        Of m shapes, (n, m), then of lengths that i winches reel in.
        """
        elements, winches = [cable.element for cable in self._parts_of_system.kept], len(self.winches)
        if not self.loads_turn:
            return np.zeros((len(shapes), shapes.shape[1] + winches))
        reeled = self.winched_ends.movements.reshape(len(elements), 6, winches)
        return self.layout.holding_loads(elements, self.load_stiffness_of_bodies, shapes, reeled)

    def load_stiffness(self, shapes):
        """`holding_loads` on the shapes themselves, shape (m, m + i): a stiffness that is not symmetric."""
        return shapes.T @ self.holding_loads(shapes)

    @cached_property
    def bodies(self):
        """`LinearSystem` of the bodies without cables: free displacements, then strokes of what moves on the bodies."""
        layout = self.layout
        stiffness, mass = (dense(matrix) for matrix in layout.body_matrices)
        damping = np.zeros_like(mass) + self.air_on_bodies(np.eye(len(mass))) + dense(layout.damping)
        stiffness = stiffness + self.load_stiffness_of_bodies
        *matrices, feedback = actuated(layout, np.eye(len(mass)), mass, damping, stiffness, self.actuators)
        return LinearSystem(*matrices, feedback=feedback)

    @cached_property
    def movements(self):
        """Outputs that are movements of bodies and markers: rows, shape (r,), by the free displacements, shape (r, d).

        Of bodies displacements and rotations, of markers displacements.
        """
        axes = tuple(f".{axis}" for axis in AXES)
        rows = [row for name, row in self.outputs.items() if name.endswith(axes) and MIDSPAN not in name]
        return np.array(rows, dtype=int), self.full_system.c[0].real[rows, -len(self.layout.free) :]

    @property
    def tension_rows(self):
        """Outputs that are tensions, the last ones: two of each cable, shape (2 c,)."""
        outputs = len(self.outputs)
        return np.arange(outputs - 2 * len(self.equilibrium.suspension.cable_names), outputs)

    @property
    def loads_on_bodies(self):
        """Forces on the coordinates of `motion` by unit forces on the free displacements of bodies, shape (m, d)."""
        shapes = self.layout.bodies(self.basis[1])
        return np.pad(shapes.T, ((0, len(self.motion) - shapes.shape[1]), (0, 0)))

    @computed_together
    def motion(plants):
        """`LinearSystem` in the coordinates of the model, then the strokes of reaction masses.

        Raises NoSolutionError where the plant has too many coordinates for a linear system.
        """
        Plant._loads_and_basis.compute(plants)
        for members in batches(plants, lambda plant: (plant.full_system.signature, plant.basis[1].shape), _size):
            systems = LinearSystem.of_rows([plant.full_system for plant in members])
            omega, shapes = stack([plant.basis for plant in members])
            air = (plant.air_on_bodies(plant.basis[1]) for plant in members)
            air = np.array([np.broadcast_to(of_row, (omega.shape[-1],) * 2) for of_row in air])
            loads = np.array([plant.load_stiffness(plant.basis[1]) for plant in members])
            loads = np.split(loads, [omega.shape[-1]], axis=-1)
            motions = motion_of_rows(systems, omega, shapes, len(members[0].winches), air, *loads)
            for row, plant in enumerate(members):
                yield plant, with_actuators(plant.layout, motions.take(row), plant.actuators)

    @cached_property
    def viscous_motion(self):
        """`motion` for a state space: with viscous damping in place of hysteretic, see `LinearSystem.viscous`."""
        viscous = self.full_system.viscous()
        if viscous is self.full_system:
            return self.motion
        omega, shapes = self.basis
        rows, air = stack([viscous]), self.air_on_bodies(shapes)
        loads = np.split(self.load_stiffness(shapes)[None], [len(omega)], axis=-1)
        reduced = motion_of_rows(rows, omega[None], shapes[None], len(self.winches), air, *loads)
        return with_actuators(self.layout, reduced.take(0), self.actuators)


def _size(plant):
    """Number of coordinates of the full system of a plant."""
    return plant._parts_of_system.size
