"""One suspension in the mean wind as a linear model without its loop: coordinates, actuators, gusts.

Scenes that differ in the loop of the winches, the exposure or the correction alone share it.
"""

from copy import copy
from functools import cached_property

import numpy as np

from cablestudy.control.loop_state_space import ExactResponse, by_forces, winch_speeds
from cablestudy.control.motion import Actuator, basis, motion
from cablestudy.control.suspension import FROM, TO, Marker, Winch, labels, second_order
from cablestudy.scene.actuator_tables import ReactionWheel
from cablestudy.study.suspension.tension_waves import change_by_waves
from cablestudy.study.suspension.turbulence import OWN, Turbulence
from cablestudy.study.tolerances import STUDY
from cablestudy.system.connected import observed
from cablestudy.system.coupled import Layout
from cablestudy.system.linear import dense
from cablestudy.system.residues import delayed_response, residues
from cablestudy.wind.mean import Drag
from cablestudy.wind.strips import midspan_shapes

TURN = 2 * np.pi


def drag_of(scenes, body_names, cable_names):
    """`Drag` of scenes of equal names, with a leading axis of cases.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        With wind.
    body_names, cable_names : sequence of str
        Bodies and junctions, and cables, in the order of the `SuspendedSystem`.
    """
    winds = [scene.wind for scene in scenes]
    angle = np.array([wind.direction for wind in winds])
    speed = np.array([wind.speed for wind in winds])
    level = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    bodies, centers = np.zeros((2, len(scenes), len(body_names), 3))
    cables = np.zeros((len(scenes), len(cable_names)))
    for case, scene in enumerate(scenes):
        if scene.wind.on != "bodies":
            cables[case] = scene.wind.cable_drag_coefficient * wind_diameters(scene)
        if scene.wind.on != "cables":
            bodies[case], centers[case] = offered_by_bodies(scene, body_names)
    density = np.array([wind.air_density for wind in winds])
    return Drag(speed[:, None] * level, density, cables, bodies, centers)


def wind_diameters(scene):
    """Diameter of each cable that the wind sees, ice included, shape (c,). [m]"""
    return np.array([scene.load_case.of_cable(name).wind_diameter(cable) for name, cable in scene.cables.items()])


def offered_by_bodies(scene, body_names):
    """Areas of bodies and junctions in the wind, and their centres of pressure.

    Returns
    -------
    areas : ndarray, shape (b, 3)
        Drag coefficient times area along each body axis. [m^2]
    centers : ndarray, shape (b, 3)
        Centres of pressure from the reference points, body axes. [m]
    """
    areas, centers = np.zeros((2, len(body_names), 3))
    for place, name in enumerate(body_names):
        own = scene.bodies[name].wind if name in scene.bodies else None
        if own:
            areas[place] = own.drag_coefficient * np.array(own.areas)
            centers[place] = own.center_of_pressure
    return areas, centers


def winches_of(scene, cable_names):
    """The `Winch` of each cable that has one, in the order of the scene: list."""
    place = {name: number for number, name in enumerate(cable_names)}
    ends, found = {"from": FROM, "to": TO}, []
    for name, winch in scene.winches.items():
        found.append(Winch(place[name], ends[winch.end], winch.direction and _unit(winch.direction)))
    return found


def _unit(vector):
    """A direction of the file, of any length, as a unit vector."""
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
    names, found = list(scene.bodies), []
    for name, table in scene.actuators.items():
        body = names.index(table.body) if table.body else 0
        axis = _unit(table.axis)
        corner = TURN * (table.high_pass or 0.0)
        if isinstance(table, ReactionWheel):
            gain = table.rate_gain
            one = Actuator(name, True, body, np.zeros(3), axis, table.inertia, velocity_gain=gain, corner=corner)
        else:
            spring, gains = (TURN * table.frequency, table.damping_ratio), (table.velocity_gain, table.position_gain)
            one = Actuator(name, False, body, np.array(table.at), axis, table.mass, *spring, *gains, corner)
        found.append(one)
    return found


class Plant:
    """A suspension about its equilibrium in the mean wind, without loop.

    Parameters
    ----------
    scene : SuspensionScene
    equilibrium : Equilibrium
        In the mean wind, of this case.
    airflow : Airflow or None
        Of this case; None without wind.
    modes : CoupledModes
        In the model.
    accuracy : float
        Relative, of their frequencies. [-]
    model : FixedModel, optional
    driven : int
        How many of the modes, the last ones, are there because the loop would drive them first.
    loops : dict, optional
        By control, what all gains share (`ClosedLoop`), and models with other numbers of modes too: it is filled.
    responses : bool
        Whether the modes left out answer to the inertia and damping forces of what bodies and winches move too.
    complete : bool
        Whether the model has modes that no output depends on too.
    midspans : bool
        Whether the displacements of the cables at mid-span are outputs.
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
    ):
        self.scene, self.equilibrium, self.accuracy, self.model = scene, equilibrium, accuracy, model
        self.airflow, self.drag = airflow, airflow and airflow.drag
        self.modes, self.driven, self.loops = modes, driven, {} if loops is None else loops
        self.responses, self._complete = responses, complete
        self.layout = Layout(equilibrium)
        suspension = equilibrium.suspension
        self.midspans = midspans
        self.winches, self.markers = winches_of(scene, suspension.cable_names), markers_of(scene)
        self.actuators = actuators_of(scene)

    def with_modes(self, modes, driven):
        """Copy with other `CoupledModes`, so many of which, the last ones, the loop could drive."""
        known = self.scene, self.equilibrium, self.airflow
        found = modes, self.accuracy, self.model, driven, self.loops, self.responses
        return Plant(*known, *found, midspans=self.midspans)

    @cached_property
    def with_all_modes(self):
        """Copy with the modes that no output depends on: for a state space."""
        if len(self.kept) == len(self.modes):
            return self
        known = self.scene, self.equilibrium, self.airflow, self.modes, self.accuracy, self.model, self.driven
        return Plant(*known, responses=self.responses, complete=True, midspans=self.midspans)

    @cached_property
    def outputs(self):
        """Name of each output -> its row: displacements of bodies, markers, and perhaps mid-spans; tensions."""
        _, outputs = labels(self.layout, self.winches, self.markers, self.midspans)
        return {name: row for row, (name, _unit) in enumerate(outputs)}

    @cached_property
    def _whole(self):
        models, kept = self.modes.solution.models, self.modes.solution.kept
        midspans = midspan_shapes(models, kept, self.equilibrium.catenary) if self.midspans else ()
        return second_order(self.layout, self.in_air(models, kept), self.winches, self.markers, midspans)

    @cached_property
    def _loads(self):
        """Forces on the coordinates of the suspension by winches and by loads on bodies.

        With `responses` also those by inertia and damping of what bodies and winches move, and by the inertia of the
        answer to these: it is what modes left out do to the motion and the damping of others, see `LinearSystem.few`.
        """
        whole, winches, found = self._whole, len(self.winches), self._plain_loads
        if not self.responses:
            return found
        moved = np.s_[:, len(whole) - whole.bodies :]
        acting = [part[moved] for part in (whole.mass, whole.damping, whole.stiffness.imag)]
        acting += [part[:, :winches] for part in (whole.b[0].imag, whole.b[1].real, whole.b[2].real)]
        acting = np.concatenate(acting, axis=1)
        acting = acting[:, acting.any(axis=0)]
        return np.concatenate([found, acting, whole.mass @ whole.compliance(acting)], axis=1)

    @property
    def _plain_loads(self):
        """Forces on the coordinates by winches, by loads on bodies alone, and at mid-spans that are shown."""
        winches = len(self.winches)
        of_bodies = winches + np.flatnonzero(self.layout.free < 6 * self.equilibrium.suspension.bodies)
        at_midspan = [row for name, row in self.outputs.items() if ".midspan." in name]
        loads = self._whole.b[0].real[:, [*range(winches), *of_bodies.tolist()]], self._whole.c[0][at_midspan].real.T
        return np.concatenate(loads, axis=1)

    @cached_property
    def _basis(self):
        """Frequencies and shapes of the coordinates: modes, and the static responses to the loads."""
        omega, shapes = basis(self.modes, self._loads)
        kept = np.concatenate([self.kept, np.arange(len(self.modes), len(omega))])
        return omega[kept], shapes[:, kept]

    @cached_property
    def kept(self):
        """Numbers from 0 of the modes that are coordinates of the model: those that outputs depend on, or all."""
        every = np.arange(len(self.modes))
        if self._complete:
            return every
        seen = self._seen(self.modes.shapes)
        return every[seen] if seen.any() else every

    def _seen(self, shapes):
        """Which of some mode shapes, shape (n, k), outputs depend on: ndarray of bool."""
        if (there := observed(self._whole)).all():
            return np.ones(shapes.shape[1], dtype=bool)
        shapes = shapes[there]
        return (shapes * (self._whole.mass[np.ix_(there, there)] @ shapes)).sum(axis=0) > STUDY.unseen_energy

    @property
    def other_poles(self):
        """About where the poles are of modes that were computed and are not in the model. [rad/s]

        By what their undamped shapes lose.
        """
        every, count, whole = self.modes.solution.with_all_modes, len(self.modes), self._whole
        if len(every.omega) <= count:
            return np.zeros(0, dtype=complex)
        omega, shapes = every.omega[count:], every.shapes[:, count:]
        seen = self._seen(shapes)
        omega, shapes = omega[seen], shapes[:, seen]
        viscous, lost = (np.einsum("nk,nk->k", shapes, part @ shapes) for part in (whole.damping, whole.stiffness.imag))
        braked = self.air_on_bodies(shapes)
        viscous = viscous + (np.diagonal(braked) if np.ndim(braked) else braked)
        return 1j * omega - (viscous + lost / omega) / 2

    @cached_property
    def coarse_space(self):
        """A space of the coordinates with fewer modes, static responses and all strokes, shape (m, r).

        Of the lowest modes the highest are left out; modes that the loop could drive stay. To an accuracy the static
        responses are those to winches and loads alone: where those to what modes left out do to others matter, what
        they leave out may too (3e-5 of an RMS without them, 1.5e-3 in truth). Of exact elements all of them are kept.
        """
        (omega, shapes), count = self._basis, len(self.kept)
        size, modes = len(self.motion), np.count_nonzero(self.kept < len(self.modes) - self.driven)
        left = np.arange(int(STUDY.fewer_modes * modes), modes)
        others = np.concatenate([left, np.arange(count, len(omega))])
        loads = self._plain_loads if self.model is None else self._loads
        static = (shapes.T @ loads / omega[:, None] ** 2)[others]
        static, values, _ = np.linalg.svd(static, full_matrices=False)
        static = static[:, values > STUDY.dependent_response * values.max(initial=0.0)]
        kept = np.eye(size)
        responses = kept[:, others] @ static
        return np.concatenate(
            [kept[:, : int(STUDY.fewer_modes * modes)], kept[:, modes:count], responses, kept[:, len(omega) :]], axis=1
        )

    @property
    def lacked(self):
        """Largest share in the static compliance of a free displacement that the lowest modes, of `fewer`, have not."""
        solution = self.modes.solution
        lowest = slice(int(STUDY.fewer_modes * len(self.modes)))
        moved = self.layout.bodies(solution.shapes[:, lowest]) / solution.omega[lowest]
        compliance = np.diagonal(np.linalg.inv(dense(solution.reduced.stiffness)))
        return float((1 - (moved**2).sum(axis=1) / compliance).max(initial=0.0))

    @cached_property
    def coarse_motion(self):
        """The `motion` in that space."""
        return self.motion.within(self.coarse_space)

    def residues_of(self, motion, loop=None, space=None, speeds=False):
        """`Residues` of all outputs, of actuators too, by the inputs of `Gusts`; a `DelayedResponse` with delay.

        Parameters
        ----------
        motion : LinearSystem
            That of this object, or in a space of its coordinates.
        loop : Loop, optional
            Of this motion.
        space : ndarray, shape (m, r), optional
        speeds : bool
            The speeds of the winches, instead of the outputs.
        """
        into = self.gusts.input_matrix
        forces = np.zeros((len(self.motion), into.shape[1]))  # strokes are not blown
        forces[: len(into)] = into
        forces = forces if space is None else space.T @ forces
        driven = motion, forces, loop, self.actuators, self._direct
        found = residues((loop or motion).eigen, *(winch_speeds if speeds else by_forces)(*driven))
        if loop is None or not loop.law.delay:
            return found
        exact = ExactResponse(*driven)
        response, fast = (exact.winch_speeds, exact.hardly_moved) if speeds else (exact.outputs, exact.alone)
        return delayed_response(response, found, fast, loop.right_up_to)

    @property
    def _direct(self):
        """Change of each output by the inputs of `Gusts.input_matrix` where nothing moves, shape (o, i).

        The tensions are the last outputs, two of each cable: each is less by the force of the gusts that reaches its
        end statically.
        """
        gusts = self.gusts
        found = np.zeros((len(self.outputs), gusts.input_matrix.shape[1]))
        tensions = len(found) - 2 * len(self.layout.equilibrium.suspension.cable_names)
        for place, strip in enumerate(gusts.strips):
            for end in range(2):
                found[tensions + 2 * strip.cable + end, len(gusts.input_matrix) + 2 * place + end] = -1.0
        return found

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
        """Copy in the gusts of an `Airflow` that damps it as much as its own, or as none."""
        if airflow is None or airflow.side == self.airflow.side:
            return self
        _ = self.motion  # which both have
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
        """`LinearSystem`."""
        return self._motion_of(self._whole)

    @cached_property
    def viscous_motion(self):
        """`motion` for a state space: with viscous damping in place of hysteretic, see `LinearSystem.viscous`."""
        whole = self._whole.viscous()
        return self.motion if whole is self._whole else self._motion_of(whole)

    def _motion_of(self, whole):
        omega, shapes = self._basis
        damping = self.air_on_bodies(shapes)
        return motion(self.layout, whole, omega, shapes, len(self.winches), self.actuators, damping)
