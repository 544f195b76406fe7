"""One suspension in the mean wind with the loop of its winches."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.control.gain_limits import largest_gain, limit_near, sensitive_gain, single_limits
from cablestudy.control.plant import Notch
from cablestudy.control.pose_loop import PoseLoop, allocate, growing, moved_by_winches
from cablestudy.errors import NoSolutionError
from cablestudy.scene.suspension_tables import MOTIONS
from cablestudy.study.loops import law_from

TURN = 2 * np.pi
LITTLE = 1e-6  # gain over the lowest frequency, of a loop whose gain follows from a margin


class Movement:
    """A suspension about its equilibrium in the mean wind, with its loop.

    Parameters
    ----------
    scene : SuspensionScene
    linear : LinearMotion
        Of this scene, or of one that differs in the loop, the exposure or the correction.
    exact : (Limit or None, tuple of 2 float), optional
        The largest gain with all modes of the cables, and the relative errors of it and of its frequency.
    coarse : Limit, optional
        The largest gain of a model with fewer modes.
    """

    def __init__(self, scene, linear, exact=None, coarse=None):
        self.scene, self.linear, self.modes, self._exact, self.coarse = scene, linear, linear.modes, exact, coarse
        self.equilibrium, self.drag, self.layout = linear.equilibrium, linear.drag, linear.layout
        self.winches, self.markers, self.actuators = linear.winches, linear.markers, linear.actuators

    @property
    def motion(self):
        """`LinearSystem`."""
        return self.linear.motion

    @property
    def gusts(self):
        """`Gusts` on the coordinates."""
        return self.linear.gusts

    @property
    def outputs(self):
        """Name of each output -> its row: displacements of bodies, markers, tensions."""
        return self.linear.outputs

    @cached_property
    def fewer_loop(self):
        """The `PoseLoop` in the space `LinearMotion.fewer`, or None."""
        linear = self.linear
        return self.loop and replace(self.loop.within(linear.fewer), motion=linear.fewer_motion)

    @cached_property
    def residues(self):
        """`LinearMotion.residues` with the loop, where it does something, and with the winches at rest: list."""
        open_, loop = self.linear.residues, self.loop
        return [self.linear.residues_of(self.motion, loop), open_] if loop and loop.gain else [open_]

    @cached_property
    def fewer_residues(self):
        """The same in the space `LinearMotion.fewer`."""
        linear, loop = self.linear, self.fewer_loop
        open_ = linear.fewer_residues
        return [linear.residues_of(loop.motion, loop, linear.fewer), open_] if loop and loop.gain else [open_]

    @property
    def winch_residues(self):
        """`Residues` of the speeds of the winches, and those in the space `LinearMotion.fewer`."""
        linear, fewer = self.linear, self.fewer_loop
        return (
            linear.residues_of(self.motion, self.loop, speeds=True),
            linear.residues_of(fewer.motion, fewer, linear.fewer, speeds=True),
        )

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
        auto, limit = control.gain.auto, self.largest_gain
        most = limit and limit / 10 ** (auto.gain_margin / 20)
        gain = sensitive_gain(self._given_loop, auto.sensitivity, most)
        if gain is None:
            raise NoSolutionError("no gain follows from a gain margin: the loop is stable for every gain")
        return self._given_loop.with_gain(gain)

    @cached_property
    def _given_loop(self):
        """The loop with its gain, or with next to none where the gain follows from a margin."""
        law, gain = law_from(self.scene.control, self.scene.control)
        given = LITTLE * self.modes.solution.omega[0] if gain is None else gain
        return PoseLoop(self.motion, self.allocation, given, self.notches, law)

    @property
    def limit(self):
        """`Limit` of the gain, or None: that of all loops that differ in the gain alone."""
        return self.limit_of_model if self._exact is None else self._exact[0]

    @property
    def limit_of_model(self):
        """The same with the modes of the model, and those from which they were chosen."""
        chosen, wide = self._limits
        return wide or chosen

    @property
    def limit_errors(self):
        """Estimated relative errors of its gain and frequency where all modes of the cables decide, else None. [-]"""
        return None if self._exact is None else self._exact[1]

    @property
    def loop_key(self):
        """All of the loop but its gain, by which loops share what does not depend on that: str."""
        return repr((self.scene.control.model_copy(update={"gain": None}), self._given_loop.law))

    @property
    def limit_change(self):
        """By how much, relative, the modes that were not chosen change the largest gain; None where it is not known.

        [-]
        """
        chosen, wide = self._limits
        return wide and abs(wide.factor / chosen.factor - 1)

    @property
    def limit_with_other_modes(self):
        """`Limit`, or None, of the modes that were chosen, or of the highest left out where none were: for errors."""
        chosen, wide = self._limits
        return chosen if wide else limit_near(self.fewer_loop, chosen) or self.coarse

    @cached_property
    def _limits(self):
        """`Limit`, or None, with the modes of the model, and with those from which they were chosen."""
        key, limits = self.loop_key, self.linear.limits
        if key not in limits:
            found = largest_gain(self._given_loop)
            wide = found and self.linear.wide and limit_near(self._wide_loop, found)
            limits[key] = found, wide
        return limits[key]

    @property
    def _wide_loop(self):
        """The loop with all modes from which those of the model were chosen."""
        linear = self.linear
        return Movement(self.scene, linear.with_modes(linear.wide, range(len(linear.wide)), 0))._given_loop

    @property
    def largest_gain(self):
        """Below it the loop is stable; None where it always is. [rad/s]"""
        return self.limit and self.limit.factor

    @cached_property
    def single_limits(self):
        """`gain_limits.single_limits`, by the name of the measured coordinate: dict."""
        return dict(zip(self.measured, single_limits(self.loop).tolist(), strict=True))

    @property
    def stable(self):
        """Whether no motion grows, with the winches at rest and with the loop."""
        loop = self.loop
        if growing(self.open_poles) is not None:
            return False
        return loop is None or not loop.gain or (loop.growing is None and not self._beyond_model)

    @property
    def _beyond_model(self):
        """Whether the gain is above its limit by a mode that the model of the motion has not."""
        if self._exact is None or self._exact[0] is None or self.loop.gain <= self._exact[0].factor:
            return False
        own = self.limit_of_model
        return own is None or self.loop.gain < own.factor

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
        if not self.stable:
            pole = loop.growing
            moving = self._named(pole, loop) if pole else f"a motion of {self.limit.omega / TURN:.4g} Hz grows"
            limit = self.largest_gain
            below = f"{limit:.4g} rad/s" if loop.law.integrates_only else f"{limit / loop.gain:.4g} times these gains"
            stable = f"; stable below {below}" if limit else ""
            said = loop.law.said(loop.gain, 4).removeprefix("a gain of ")
            raise NoSolutionError(f"the loop is unstable at {said}: {moving}{stable}")

    def mode_name(self, place):
        """Number of a coordinate, what it moves and its frequency, in words."""
        if place >= len(self.modes):
            return "a motion above the modes of the model"
        return f"mode {place + 1} ({self.modes.moves[place]}, {self.modes.frequency[place]:.4g} Hz)"

    def _named(self, pole, moving):
        """The motion of a growing pole of a `LinearSystem` or `PoseLoop` in words."""
        dynamic = moving.dynamic_stiffness(np.array([pole]))[0]
        shape = np.linalg.svd(dynamic)[2][-1].conj()
        energy = np.abs(shape * pole) ** 2
        place = int(np.argmax(energy))
        rate = f"grows by {pole.real:.3g}/s at {abs(pole.imag) / TURN:.4g} Hz"
        strokes = [one.name for one in self.actuators if not one.wheel]
        stroke = place - (len(self.motion) - len(strokes))
        return f"{strokes[stroke] if stroke >= 0 else self.mode_name(place)} {rate}"
