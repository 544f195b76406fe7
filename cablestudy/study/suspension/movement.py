"""One suspension in the mean wind as a linear model: coordinates, actuators, gusts, and the loop of its winches."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.control.motion import Actuator, basis, motion
from cablestudy.control.plant import Notch
from cablestudy.control.pose_loop import PoseLoop, allocate, growing, moved_by_winches
from cablestudy.control.pose_margins import gain_beside, largest_gain, sensitivity_peak, single_limits
from cablestudy.control.suspension import FROM, TO, Marker, Winch, labels, second_order
from cablestudy.errors import NoSolutionError
from cablestudy.scene.actuator_tables import ReactionWheel
from cablestudy.scene.suspension_tables import MOTIONS
from cablestudy.system.coupled import Layout
from cablestudy.system.coupled_modes import coupled_modes
from cablestudy.wind.gusts import gusts
from cablestudy.wind.mean import Drag
from cablestudy.wind.strips import strips

TURN = 2 * np.pi
FEWEST = 40  # modes of the linear model at first
FEWER = 0.7  # of the modes, with which the error by those left out is estimated
LITTLE = 1e-6  # gain over the lowest frequency, of a loop whose gain follows from a margin
DEPENDENT = 1e-10  # size of a static response over the largest, below which it is rounding


def drag_of(scenes, body_names, cable_names):
    """`Drag` of scenes of equal names, with a leading axis of cases.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        With wind.
    body_names, cable_names : sequence of str
        Bodies and junctions, and cables, in the order of the `Suspension`.
    """
    winds = [scene.wind for scene in scenes]
    angle = np.array([wind.direction for wind in winds])
    speed = np.array([wind.speed for wind in winds])
    level = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    bodies, centers = np.zeros((2, len(scenes), len(body_names), 3))
    cables = np.zeros((len(scenes), len(cable_names)))
    for case, scene in enumerate(scenes):
        wind = scene.wind
        if wind.on != "bodies":
            diameters = [scene.cables[name].section_diameter for name in cable_names]
            cables[case] = wind.cable_drag_coefficient * np.array(diameters)
        for place, name in enumerate(body_names):
            own = scene.bodies[name].wind if name in scene.bodies else None
            if own and wind.on != "cables":
                bodies[case, place] = own.drag_coefficient * np.array(own.areas)
                centers[case, place] = own.center_of_pressure
    density = np.array([wind.air_density for wind in winds])
    return Drag(speed[:, None] * level, density, cables, bodies, centers)


def winches_of(scene, cable_names):
    """The `Winch` of each cable that has one, in the order of the scene: list."""
    place = {name: number for number, name in enumerate(cable_names)}
    return [Winch(place[name], TO if winch.end == "to" else FROM) for name, winch in scene.winches.items()]


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
        axis = np.array(table.axis) / np.sqrt(sum(part * part for part in table.axis))
        corner = TURN * (table.high_pass or 0.0)
        if isinstance(table, ReactionWheel):
            gain = table.rate_gain
            one = Actuator(name, True, body, np.zeros(3), axis, table.inertia, velocity_gain=gain, corner=corner)
        else:
            spring, gains = (TURN * table.frequency, table.damping_ratio), (table.velocity_gain, table.position_gain)
            one = Actuator(name, False, body, np.array(table.at), axis, table.mass, *spring, *gains, corner)
        found.append(one)
    return found


class Movement:
    """A suspension about its equilibrium in the mean wind.

    Parameters
    ----------
    scene : SuspensionScene
    equilibrium : Equilibrium
        In the mean wind, of this case.
    drag : Drag or None
        Of this case; None without wind.
    modes : int or CoupledModes
        Coupled modes in the model, or how many.
    accuracy : float
        Relative, of their frequencies. [-]
    model : FixedModel, optional
    """

    def __init__(self, scene, equilibrium, drag=None, modes=FEWEST, accuracy=1e-4, model=None):
        self.scene, self.equilibrium, self.drag, self.accuracy, self.model = scene, equilibrium, drag, accuracy, model
        if isinstance(modes, int):
            damping = [cable.damping for cable in scene.cables.values()]
            modes = coupled_modes(equilibrium, modes, accuracy, damping, model).damped
        self.modes = modes
        self.layout = Layout(equilibrium)
        suspension = equilibrium.suspension
        self.winches, self.markers = winches_of(scene, suspension.cable_names), markers_of(scene)
        self.actuators = actuators_of(scene)

    def with_modes(self, modes):
        """The same with other modes, `CoupledModes`."""
        return Movement(self.scene, self.equilibrium, self.drag, modes, self.accuracy, self.model)

    @property
    def free_count(self):
        """How many displacements are free."""
        return len(self.layout.free)

    @cached_property
    def outputs(self):
        """Name of each output -> its row: displacements of bodies, markers, tensions."""
        _, outputs = labels(self.layout, self.winches, self.markers)
        return {name: row for row, (name, _unit) in enumerate(outputs)}

    @cached_property
    def _whole(self):
        return second_order(self.layout, self.modes.solution.kept, self.winches, self.markers)

    @cached_property
    def _loads(self):
        """Forces on the coordinates of the suspension by winches and by loads on bodies."""
        winches, bodies = len(self.winches), 6 * self.equilibrium.suspension.bodies
        of_bodies = winches + np.flatnonzero(self.layout.free < bodies)
        return self._whole.driven[0][:, [*range(winches), *of_bodies.tolist()]]

    @cached_property
    def _basis(self):
        """Frequencies and shapes of the coordinates: modes, and the static responses to the loads."""
        return basis(self.modes, self._loads)

    @cached_property
    def fewer(self):
        """A space of the coordinates with fewer modes, all static responses and all strokes, shape (m, r)."""
        omega, shapes = self._basis
        modes, strokes = int(FEWER * len(self.modes)), len(self.motion) - len(omega)
        static = (shapes.T @ self._loads / omega[:, None] ** 2)[modes:]
        left, size, _ = np.linalg.svd(static, full_matrices=False)
        left = left[:, size > DEPENDENT * size.max(initial=0.0)]
        space = np.zeros((len(self.motion), modes + left.shape[1] + strokes))
        space[:modes, :modes] = np.eye(modes)
        space[modes : len(omega), modes : modes + left.shape[1]] = left
        space[len(omega) :, modes + left.shape[1] :] = np.eye(strokes)
        return space

    @cached_property
    def fewer_motion(self):
        """The `Motion` in that space."""
        return self.motion.within(self.fewer)

    @cached_property
    def fewer_loop(self):
        """The `PoseLoop` in that space, or None."""
        return self.loop and replace(self.loop.within(self.fewer), motion=self.fewer_motion)

    @cached_property
    def _blown(self):
        """`Gusts` and aerodynamic damping; None and 0 without wind."""
        if self.drag is None:
            return None, 0.0
        _, shapes = self._basis
        along = strips(self.modes.solution, self.layout, shapes, self.drag)
        along_wind = self.drag.velocity / np.sqrt((self.drag.velocity**2).sum())
        own = (np.swapaxes(self.equilibrium.rotation, -1, -2) @ along_wind[:, None])[..., 0]
        scene, names = self.scene, self.equilibrium.suspension.body_names
        areas = np.zeros(len(names))
        for place, name in enumerate(names):
            table = scene.bodies[name].wind if name in scene.bodies else None
            areas[place] = (np.array(table.areas) * own[place] ** 2).sum() if table else 0.0
        found, damping = gusts(scene.wind, self.drag, self.layout, shapes, along, areas)
        return found, damping if scene.wind.aerodynamic_damping else 0.0

    @property
    def gusts(self):
        """`Gusts` on the coordinates."""
        return self._blown[0]

    @cached_property
    def motion(self):
        """`Motion`."""
        omega, shapes = self._basis
        winches = len(self.winches)
        return motion(self.layout, self._whole, omega, shapes, winches, self.actuators, self._blown[1])

    # --------------------------------------------------------------------------------------------------- loop

    @cached_property
    def body(self):
        """Number of the body that is controlled."""
        name = self.scene.control.body
        return list(self.scene.bodies).index(name) if name else 0

    @property
    def free(self):
        """Names of what of the controlled body is free: list of str."""
        held = self.equilibrium.suspension.free[self.body]
        return [name for name, free in zip(MOTIONS, held, strict=True) if free]

    @cached_property
    def _measurable(self):
        """Names of the measured coordinates, their rows, and lengths that make rotations comparable.

        Raises
        ------
        NoSolutionError
            A coordinate is measured that no winch moves.
        """
        control, suspension = self.scene.control, self.equilibrium.suspension
        names = list(control.measured or self.free)
        moved = self._of_body(self.motion.shapes)
        rows = np.zeros((6, len(self.motion)))
        rows[:, : moved.shape[1]] = moved
        on, end = np.nonzero(suspension.owner == self.body)
        arms = self.equilibrium.arms[on, end]
        radius = np.sqrt((arms**2).sum(axis=-1).mean()) if len(arms) else 1.0
        sizes = np.array([1.0, 1.0, 1.0, radius, radius, radius])
        sizes = np.where(sizes > 0, sizes, 1.0)
        places = [MOTIONS.index(name) for name in names]
        rows, sizes = rows[places], sizes[places]
        moves, _ = moved_by_winches(self.motion, rows, sizes)
        if not moves.all():
            idle = [name for name, does in zip(names, moves, strict=True) if not does]
            if control.measured or not moves.any():
                body = suspension.body_names[self.body]
                which = ", ".join(idle)
                raise NoSolutionError(f"control.measured: no winch moves {which} of {body}")
        names = [name for name, does in zip(names, moves, strict=True) if does]
        return names, rows[moves], sizes[moves]

    def _of_body(self, shapes):
        """Displacements of the controlled body in shapes of the suspension, shape (6, r)."""
        return self.layout.displaced(self.layout.bodies(shapes))[self.body]

    def measured_of(self, shapes):
        """What is measured of shapes of the suspension, shape (k, r)."""
        return self._of_body(shapes)[[MOTIONS.index(name) for name in self.measured]]

    @property
    def measured(self):
        """Names of what is measured: list of str."""
        return self._measurable[0]

    @cached_property
    def notches(self):
        """Notch of each measured coordinate: tuple of (Notch or None)."""
        table = self.scene.control.notch
        if table is None:
            return (None,) * len(self.measured)
        frequencies = [table.frequency] * len(self.measured)
        if table.frequency == "coupled":
            frequencies = self._coupled_frequencies()
        elif table.frequency == "static":
            frequencies = self._static_frequencies()
        return tuple(
            Notch(TURN * own, table.damping_ratio, TURN * table.rolloff_frequency, table.rolloff_damping_ratio)
            for own in frequencies
        )

    def _coupled_frequencies(self):
        """Frequency of the mode with the largest share in the static compliance of each measured coordinate. [Hz]"""
        compliance = (self._measurable[1][:, : len(self.modes)] / self.modes.solution.omega) ** 2
        return self.modes.frequency[np.argmax(np.round(compliance / compliance.max(axis=1, keepdims=True), 9), axis=1)]

    def _static_frequencies(self):
        """Frequency of each measured coordinate on its static compliance with the body's own mass. [Hz]"""
        rows = self._measurable[1]
        stiffness = self.motion.dynamic_stiffness(np.zeros(1))[0].real
        compliance = (rows * np.linalg.solve(stiffness, rows.T).T).sum(axis=1)
        inertia = np.diagonal(self.layout.mass[self.body])[[MOTIONS.index(name) for name in self.measured]]
        return 1 / np.sqrt(compliance * inertia) / TURN

    @cached_property
    def allocation(self):
        """`Allocation` of errors to winches."""
        control = self.scene.control
        given = control.allocation.weights if control.allocation else {}
        weights = np.array([given.get(name, 1.0) for name in self.scene.winches])
        return allocate(self.motion, *self._measurable[1:], weights)

    @cached_property
    def loop(self):
        """The `PoseLoop`, or None without control.

        Raises
        ------
        NoSolutionError
            No gain follows from a margin, or nothing moves what is measured.
        """
        control = self.scene.control
        if control is None:
            return None
        if isinstance(control.gain, (int, float)):
            return self._given_loop
        if self.largest_gain is None:
            raise NoSolutionError("no gain follows from a gain margin: the loop is stable for every gain")
        return self._given_loop.with_gain(self.largest_gain / 10 ** (control.gain.auto.gain_margin / 20))

    @cached_property
    def _given_loop(self):
        """The loop with its gain, or with next to none where the gain follows from a margin."""
        gain = self.scene.control.gain
        given = float(gain) if isinstance(gain, (int, float)) else LITTLE * self.modes.solution.omega[0]
        return PoseLoop(self.motion, self.allocation, given, self.notches)

    @cached_property
    def _limit(self):
        """`Limit` of the gain, or None."""
        return largest_gain(self._given_loop)

    @property
    def largest_gain(self):
        """Below it the loop is stable; None where it always is. [rad/s]"""
        return self._limit and self._limit.factor

    @cached_property
    def gain_error(self):
        """Relative change of the largest gain by the highest modes; not a number where it is not known. [-]"""
        if self.loop is None or self._limit is None:
            return np.nan
        fewer = gain_beside(self.fewer_loop, self._limit)
        return np.nan if fewer is None else abs(fewer / self.largest_gain - 1)

    @cached_property
    def sensitivity_peak(self):
        """Largest singular value of the sensitivity at the measured coordinates. [-]"""
        return sensitivity_peak(self.loop)

    @cached_property
    def single_limits(self):
        """See `pose_margins.single_limits`, by the name of the measured coordinate: dict."""
        return dict(zip(self.measured, single_limits(self.loop).tolist(), strict=True))

    @property
    def stable(self):
        """Whether no motion grows, with the winches at rest and with the loop."""
        loop = self.loop
        return growing(self.open_poles) is None and (loop is None or not loop.gain or loop.growing is None)

    @property
    def open_poles(self):
        """Eigenvalues with the winches at rest. [rad/s]"""
        return self.motion.eigen.poles

    def check_stable(self):
        """Refuse what grows.

        Raises
        ------
        NoSolutionError
            With the motion that grows, and why.
        """
        loop = self.loop
        if (pole := growing(self.open_poles)) is not None:
            cause = "actuators" if self.actuators else "aerodynamic damping"
            raise NoSolutionError(f"unstable without winches ({cause}): {self._named(pole, self.motion)}")
        if loop is not None and loop.gain and (pole := loop.growing) is not None:
            limit = self.largest_gain
            stable = f"; stable below {limit:.4g} rad/s" if limit else ""
            raise NoSolutionError(f"the loop is unstable at {loop.gain:.4g} rad/s: {self._named(pole, loop)}{stable}")

    def mode_name(self, place):
        """Number of a coordinate, what it moves and its frequency, in words."""
        if place >= len(self.modes):
            return "a motion above the modes of the model"
        return f"mode {place + 1} ({self.modes.moves[place]}, {self.modes.frequency[place]:.4g} Hz)"

    def _named(self, pole, moving):
        """The motion of a growing pole of a `Motion` or `PoseLoop` in words."""
        dynamic = moving.dynamic_stiffness(np.array([pole]))[0]
        shape = np.linalg.svd(dynamic)[2][-1].conj()
        energy = np.abs(shape * pole) ** 2
        place = int(np.argmax(energy))
        rate = f"grows by {pole.real:.3g}/s at {abs(pole.imag) / TURN:.4g} Hz"
        strokes = [one.name for one in self.actuators if not one.wheel]
        stroke = place - (len(self.motion) - len(strokes))
        return f"{strokes[stroke] if stroke >= 0 else self.mode_name(place)} {rate}"
