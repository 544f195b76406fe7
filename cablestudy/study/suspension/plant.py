"""One suspension in the mean wind as a linear system without its loop: coordinates, actuators, gusts.

Scenes that differ only in the loop of the winches, or in the exposure time or the correcting mirror of a telescope,
share it.
"""

from copy import copy
from functools import cached_property

import numpy as np

from cablestudy.control.loop_state_space import ExactResponse, by_forces, winch_speeds
from cablestudy.control.motion import Actuator, basis, motion
from cablestudy.control.suspension import FROM, TO, Marker, Winch, second_order
from cablestudy.scene.actuator_tables import ReactionWheel
from cablestudy.study.suspension.tension_waves import change_by_waves
from cablestudy.study.suspension.turbulence import OWN, Turbulence
from cablestudy.study.tolerances import STUDY
from cablestudy.system.connected import observed
from cablestudy.system.matrices import dense
from cablestudy.system.residues import delayed_response, residues
from cablestudy.wind.mean import Drag
from cablestudy.wind.strips import midspan_shapes

TURN = 2 * np.pi


def drag_of(scenes, body_names, cable_names):
    """Collect the mean wind and the drag areas of scenes in one `Drag`, with a leading axis of cases.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        With wind, and with equal names of bodies and cables.
    body_names, cable_names : sequence of str
        Bodies and junctions, and cables, in the order of the `SuspendedSystem`.

    Returns
    -------
    Drag
        Its arrays have the axis of cases. Drag is 0 where a scene has no wind on the cables, or none on the bodies.
    """
    winds = [scene.wind for scene in scenes]
    angle = np.array([wind.direction for wind in winds])
    speed = np.array([wind.speed for wind in winds])
    direction = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    areas, centers = np.zeros((2, len(scenes), len(body_names), 3))
    widths = np.zeros((len(scenes), len(cable_names)))
    for case, scene in enumerate(scenes):
        if scene.wind.on != "bodies":
            widths[case] = scene.wind.cable_drag_coefficient * wind_diameters(scene)
        if scene.wind.on != "cables":
            areas[case], centers[case] = drag_areas_of_bodies(scene, body_names)
    density = np.array([wind.air_density for wind in winds])
    return Drag(speed[:, None] * direction, density, widths, areas, centers)


def wind_diameters(scene):
    """Diameter of each cable that the wind sees, ice included, shape (c,). [m]"""
    return np.array([scene.load_case.of_cable(name).wind_diameter(cable) for name, cable in scene.cables.items()])


def drag_areas_of_bodies(scene, body_names):
    """Areas of bodies and junctions in the wind, and their centres of pressure.

    Returns
    -------
    areas : ndarray, shape (b, 3)
        Drag coefficient times area along each body axis. [m^2]
    centers : ndarray, shape (b, 3)
        Centres of pressure from the reference points, body axes. [m]
    """
    areas, centers = np.zeros((2, len(body_names), 3))
    for body, name in enumerate(body_names):
        table = scene.bodies[name].wind if name in scene.bodies else None
        if table:
            areas[body] = table.drag_coefficient * np.array(table.areas)
            centers[body] = table.center_of_pressure
    return areas, centers


def winches_of(scene, cable_names):
    """The `Winch` of each cable that has one, in the order of the scene: list."""
    cable = {name: number for number, name in enumerate(cable_names)}
    ends, winches = {"from": FROM, "to": TO}, []
    for name, winch in scene.winches.items():
        winches.append(Winch(cable[name], ends[winch.end], winch.direction and _unit(winch.direction)))
    return winches


def _unit(vector):
    """Unit vector along a direction of the file, which may have any length."""
    return np.array(vector) / np.sqrt(sum(part * part for part in vector))


def markers_of(scene):
    """The `Marker` of each marker of each body: list."""
    return [
        Marker(name, number, place)
        for number, body in enumerate(scene.bodies.values())
        for name, place in body.markers.items()
    ]


def actuators_of(scene):
    """The `Actuator` of each actuator: list."""
    names, actuators = list(scene.bodies), []
    for name, table in scene.actuators.items():
        body = names.index(table.body) if table.body else 0
        axis = _unit(table.axis)
        corner = TURN * (table.high_pass or 0.0)
        if isinstance(table, ReactionWheel):
            gain = table.rate_gain
            actuator = Actuator(name, True, body, np.zeros(3), axis, table.inertia, velocity_gain=gain, corner=corner)
        else:
            spring, gains = (TURN * table.frequency, table.damping_ratio), (table.velocity_gain, table.position_gain)
            actuator = Actuator(name, False, body, np.array(table.at), axis, table.mass, *spring, *gains, corner)
        actuators.append(actuator)
    return actuators


class Plant:
    """A suspension about its equilibrium in the mean wind, without loop.

    Parameters
    ----------
    scene : SuspensionScene
    equilibrium : Equilibrium
        Equilibrium of this case, in the mean wind.
    airflow : Airflow or None
        Air about this case; None without wind.
    modes : CoupledModes
        Modes of the suspension that the model has.
    accuracy : float
        Relative accuracy of their frequencies. [-]
    model : FixedModel, optional
        Exact choice of elements; by default the accuracy decides.
    driven : int
        How many of the modes, the last ones, were added to the lowest ones because a mode near their frequencies would
        grow first if the gain were raised (`DrivenCables.with_critical_modes`).
    loops : dict, optional
        Control -> results shared by all gains and by models with other numbers of modes, to be filled (`ClosedLoop`).
    responses : bool
        True if static responses to the inertia and damping forces of moving bodies and winches are coordinates too.
    complete : bool
        True if the model has modes too that no output depends on.
    midspans : bool
        True if the displacements of the cables at mid-span are outputs.
    mean_drag : SteadyDrag, optional
        Drag of the mean wind on the cables, shape (c,), which the equilibrium takes as uniform along each.
    """

    def __init__(
        self,
        scene,
        equilibrium,
        airflow,
        modes,
        accuracy=1e-4,
        model=None,
        driven=0,
        loops=None,
        responses=False,
        complete=False,
        midspans=False,
        mean_drag=None,
    ):
        self.scene, self.equilibrium, self.accuracy, self.model = scene, equilibrium, accuracy, model
        self.airflow, self.drag = airflow, airflow and airflow.drag
        self.modes, self.driven, self.loops = modes, driven, {} if loops is None else loops
        self.responses, self._complete = responses, complete
        self.layout = modes.layout
        suspension = equilibrium.suspension
        self.midspans, self.mean_drag = midspans, mean_drag
        self.winches, self.markers = winches_of(scene, suspension.cable_names), markers_of(scene)
        self.actuators = actuators_of(scene)

    def with_modes(self, modes, driven):
        """Copy with other `CoupledModes`, of which the loop could drive the last ones, `driven` in number."""
        state = self.scene, self.equilibrium, self.airflow
        model = modes, self.accuracy, self.model, driven, self.loops, self.responses
        return Plant(*state, *model, midspans=self.midspans, mean_drag=self.mean_drag)

    @cached_property
    def with_all_modes(self):
        """Copy with the modes that no output depends on: for a state space."""
        if len(self.kept) == len(self.modes):
            return self
        state = self.scene, self.equilibrium, self.airflow
        model = self.modes, self.accuracy, self.model, self.driven
        others = {"midspans": self.midspans, "mean_drag": self.mean_drag}
        return Plant(*state, *model, responses=self.responses, complete=True, **others)

    @cached_property
    def outputs(self):
        """Name of each output -> its row: displacements of bodies, markers, and perhaps mid-spans; tensions."""
        return {name: row for row, (name, _unit) in enumerate(self._full_system.outputs)}

    @cached_property
    def _full_system(self):
        """`LinearSystem` with all coordinates of the cables, see `control.suspension.second_order`."""
        models, kept = self.modes.solution.models, self.modes.solution.kept
        midspans = midspan_shapes(models, kept, self.equilibrium.catenary) if self.midspans else ()
        return second_order(self.layout, self.in_air(models, kept), self.winches, self.markers, midspans)

    @cached_property
    def _loads(self):
        """Forces on the coordinates of the suspension whose static responses are coordinates of the model, (n, r).

        `_applied_loads`; the inertia of the responses to those at mid-spans of cables without a mode of their own in
        the model, which would else have the frequency of a string under one force, a tenth too high; with `responses`
        those by inertia and damping of moving bodies and winches, and by the inertia of the response to these: they are
        what modes left out do to the motion and the damping of others, see `LinearSystem.few`.
        """
        system, winches, applied = self._full_system, len(self.winches), self._applied_loads
        if self.midspans:
            without_modes = self.modes.solution.models.first > TURN * self.modes.frequency[-1]
            loads = self._midspan_loads[:, np.repeat(without_modes, 3)]
            applied = np.concatenate([applied, system.mass @ system.compliance(loads)], axis=1)
        if not self.responses:
            return applied
        of_bodies = np.s_[:, len(system) - system.bodies :]
        moving = [part[of_bodies] for part in (system.mass, system.damping, system.stiffness.imag)]
        moving += [part[:, :winches] for part in (system.b[0].imag, system.b[1].real, system.b[2].real)]
        moving = np.concatenate(moving, axis=1)
        moving = moving[:, moving.any(axis=0)]
        return np.concatenate([applied, moving, system.mass @ system.compliance(moving)], axis=1)

    @cached_property
    def _applied_loads(self):
        """Forces on the coordinates by winches, by loads on bodies, and at mid-spans that are outputs, shape (n, r)."""
        winches, system = len(self.winches), self._full_system
        of_bodies = winches + np.flatnonzero(self.layout.free < 6 * self.equilibrium.suspension.bodies)
        loads = system.b[0].real[:, [*range(winches), *of_bodies.tolist()]], self._midspan_loads
        return np.concatenate(loads, axis=1)

    @property
    def _midspan_loads(self):
        """Forces on the coordinates by unit forces at mid-spans that are outputs, shape (n, r)."""
        at_midspan = [row for name, row in self.outputs.items() if ".midspan." in name]
        return self._full_system.c[0][at_midspan].real.T

    @cached_property
    def _basis(self):
        """Frequencies, shape (m,), and shapes, (n, m), of the coordinates: modes, then static responses to `_loads`."""
        omega, shapes = basis(self._full_system, self.modes, self._loads)
        kept = np.concatenate([self.kept, np.arange(len(self.modes), len(omega))])
        return omega[kept], shapes[:, kept]

    @cached_property
    def kept(self):
        """Numbers from 0 of the modes that are coordinates of the model: those that outputs depend on, or all."""
        every = np.arange(len(self.modes))
        if self._complete:
            return every
        is_observed = self._observed_modes(self.modes.shapes)
        return every[is_observed] if is_observed.any() else every

    def _observed_modes(self, shapes):
        """Which of some mode shapes, shape (n, k), outputs depend on: ndarray of bool, shape (k,)."""
        if (coordinates := observed(self._full_system)).all():
            return np.ones(shapes.shape[1], dtype=bool)
        shapes = shapes[coordinates]
        mass = self._full_system.mass[np.ix_(coordinates, coordinates)]
        return (shapes * (mass @ shapes)).sum(axis=0) > STUDY.unseen_energy

    @property
    def other_poles(self):
        """Estimated poles of modes that were computed and are not in the model, by the damping of their shapes. [rad/s]

        s = i W - (c + h/W)/2, c and h being the viscous and hysteretic damping of the shape.
        """
        computed, count, system = self.modes.solution.with_all_modes, len(self.modes), self._full_system
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

        The highest of the lowest modes are left out; modes that the loop could drive stay. To an accuracy the static
        responses are those to winches and loads alone: where those to the forces of moving bodies matter, what they
        leave out may too (3e-5 of an RMS without them, 1.5e-3 in truth). Of exact elements all of them are kept.
        """
        (omega, shapes), count = self._basis, len(self.kept)
        modes = np.count_nonzero(self.kept < len(self.modes) - self.driven)
        lowest = int(STUDY.fewer_modes * modes)
        replaced = np.concatenate([np.arange(lowest, modes), np.arange(count, len(omega))])
        loads = self._applied_loads if self.model is None else self._loads
        static = (shapes.T @ loads / omega[:, None] ** 2)[replaced]
        static, sizes, _ = np.linalg.svd(static, full_matrices=False)
        static = static[:, sizes > STUDY.dependent_response * sizes.max(initial=0.0)]
        unit = np.eye(len(self.motion))
        driven, strokes = unit[:, modes:count], unit[:, len(omega) :]
        return np.concatenate([unit[:, :lowest], driven, unit[:, replaced] @ static, strokes], axis=1)

    @property
    def lacked_compliance(self):
        """Largest share in the static compliance of a free displacement that the lowest modes, `fewer_modes`, lack."""
        solution = self.modes.solution
        lowest = slice(int(STUDY.fewer_modes * len(self.modes)))
        displacements = self.layout.bodies(solution.shapes[:, lowest]) / solution.omega[lowest]
        compliance = np.diagonal(np.linalg.inv(dense(solution.reduced.stiffness)))
        return float((1 - (displacements**2).sum(axis=1) / compliance).max(initial=0.0))

    @cached_property
    def coarse_motion(self):
        """The `motion` in `coarse_space`."""
        return self.motion.within(self.coarse_space)

    def residues_of(self, motion, loop=None, space=None, speeds=False):
        """Response of all outputs to the gusts, as a sum over poles: `Residues`, or `DelayedResponse` with a delay.

        Parameters
        ----------
        motion : LinearSystem
            `motion` of this object, or that in a space of its coordinates.
        loop : Loop, optional
            Loop about this motion; without a loop the winches are at rest.
        space : ndarray, shape (m, r), optional
            Basis of the space of `motion`, where it is one of fewer coordinates than this object has.
        speeds : bool
            True for the speeds of the winches instead of the outputs.
        """
        input_matrix = self.gusts.input_matrix
        forces = np.zeros((len(self.motion), input_matrix.shape[1]))  # gusts do not act on the strokes of masses
        forces[: len(input_matrix)] = input_matrix
        forces = forces if space is None else space.T @ forces
        arguments = motion, forces, loop, self.actuators, self._direct
        state_space = winch_speeds(*arguments) if speeds else by_forces(*arguments)
        approximate = residues((loop or motion).eigen, *state_space)
        if loop is None or not loop.law.delay:
            return approximate
        # the poles are those of a Padé approximant: above `right_up_to` the winches hardly move, and those at rest hold
        exact = ExactResponse(*arguments)
        response, poles_at_rest = (exact.winch_speeds, exact.hardly_moved) if speeds else (exact.outputs, exact.alone)
        return delayed_response(response, approximate, poles_at_rest, loop.right_up_to)

    @property
    def _direct(self):
        """Change of each output by the inputs of `Gusts.input_matrix` where nothing moves, shape (o, i).

        The tensions are the last outputs, two of each cable: each is less by the force of the gusts that reaches its
        end statically.
        """
        gusts = self.gusts
        direct = np.zeros((len(self.outputs), gusts.input_matrix.shape[1]))
        first_tension = len(direct) - 2 * len(self.layout.equilibrium.suspension.cable_names)
        cables = np.array([cable for group in gusts.strips for cable in group.cables], dtype=int)
        rows = (first_tension + 2 * cables[:, None] + np.arange(2)).ravel()
        direct[rows, len(gusts.input_matrix) + np.arange(len(rows))] = -1.0
        return direct

    @cached_property
    def at_rest(self):
        """`Turbulence` with the winches at rest."""
        return Turbulence(self)

    @cached_property
    def change_by_waves(self):
        """`tension_waves.change_by_waves` of the outputs and of their rates, which all loops share, shape (2, o)."""
        return change_by_waves(self, OWN)

    @cached_property
    def gusts(self):
        """`Gusts` on the coordinates; None without wind."""
        return self.airflow and self.airflow.gusts(self.modes.solution, self.layout, self._basis[1])

    def blown_by(self, airflow):
        """Copy in the gusts of another `Airflow` that damps the suspension alike; itself where the gusts are equal."""
        if airflow is None or airflow.side == self.airflow.side:
            return self
        _ = self.motion  # computed before copying: both share it
        other = copy(self)
        other.airflow = airflow
        for name in ("gusts", "at_rest", "change_by_waves"):
            other.__dict__.pop(name, None)
        return other

    @property
    def braked(self):
        """True if the air damps what moves."""
        return self.airflow is not None and self.airflow.damps

    def in_air(self, models, kept):
        """Superelements of the cables of some `Models` with their aerodynamic damping: list of Kept."""
        return self.airflow.damped(models, kept, self.equilibrium) if self.airflow else kept

    def air_on_bodies(self, shapes):
        """Aerodynamic damping of coordinates by the drag on bodies, see `damping_of_bodies`; 0 without."""
        return self.airflow.damping_of_bodies(self.layout, shapes) if self.airflow else 0.0

    @cached_property
    def motion(self):
        """`LinearSystem` in the coordinates of the model, then the strokes of reaction masses."""
        return self._motion_of(self._full_system)

    @cached_property
    def viscous_motion(self):
        """`motion` for a state space: with viscous damping in place of hysteretic, see `LinearSystem.viscous`."""
        viscous = self._full_system.viscous()
        return self.motion if viscous is self._full_system else self._motion_of(viscous)

    def _motion_of(self, system):
        """A `LinearSystem` of all coordinates of the cables reduced to those of the model, with actuators and air."""
        omega, shapes = self._basis
        damping = self.air_on_bodies(shapes)
        return motion(self.layout, system, omega, shapes, len(self.winches), self.actuators, damping)
