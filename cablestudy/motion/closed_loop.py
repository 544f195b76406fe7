"""One suspension in the mean wind with the control loop of its winches."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.control.law import law_from
from cablestudy.control.loop import Loop, unstable_pole
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.motion.controlled_body import ControlledBody
from cablestudy.motion.loop_stability import LoopStability
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.coupled_modes import coupled_modes


class ClosedLoop:
    """A suspension about its equilibrium in the mean wind, with the control loop that its scene may have.

    The loop measures coordinates of a body and moves winches, which reel in cables.

    Parameters
    ----------
    scene : SuspensionScene
    plant : Plant
        The suspension without its loop: of this scene, or of one that differs in the loop, the exposure or the
        correction alone.
    """

    def __init__(self, scene, plant):
        self.scene, self.plant, self.modes = scene, plant, plant.modes
        self.equilibrium, self.drag, self.layout = plant.equilibrium, plant.drag, plant.layout
        self.winches, self.markers, self.actuators = plant.winches, plant.markers, plant.actuators

    @property
    def motion(self):
        """`LinearSystem` of the suspension with its winches at rest."""
        return self.plant.motion

    @property
    def outputs(self):
        """Name of each output -> its row: displacements of bodies, markers, tensions."""
        return self.plant.outputs

    # --------------------------------------------------------------------------------------------------- loop

    @property
    def gain_is_stated(self):
        """True with a loop that is known without its largest gain: one with a gain above zero and without a delay."""
        if self.scene.control is None:
            return False
        law, gain = law_from(self.scene.control)
        return bool(gain) and not law.delay

    @cached_property
    def body(self):
        """The `ControlledBody`."""
        return ControlledBody(self.scene, self.plant)

    @cached_property
    def loop(self):
        """The `Loop` with its gain; None for a scene without control.

        A gain that the scene states is taken as it is. An automatic gain is the largest one that keeps both the gain
        margin and the peak of the sensitivity (I + L)^-1 that the scene asks for, L being the loop gain. If its gain is
        automatic or it has a delay, the `Loop` also has `StableGains`, the gains with which it is stable.

        Raises
        ------
        NoSolutionError
            No gain follows from the margin or the sensitivity; or no winch moves what is measured.
        ConvergenceError
            The largest gain, from which a margin is counted, is not known.
        """
        control = self.scene.control
        if control is None:
            return None
        untuned, stability = self.untuned_loop, self.stability
        if isinstance(control.gain, (int, float)):
            return replace(untuned, gains=stability.gains) if untuned.law.delay else untuned
        auto, limit = control.gain.auto, stability.largest_gain
        gain_at_margin = None if limit is None else limit / 10 ** (auto.gain_margin / 20)
        gain = stability.gains.gain_of_peak(auto.sensitivity, gain_at_margin)
        if gain is None:
            raise NoSolutionError("no gain follows from a gain margin: the loop is stable for every gain")
        return replace(untuned, gain=gain, gains=stability.gains)

    @cached_property
    def untuned_loop(self):
        """The `Loop` with the gain of the scene, or with a tiny one where the gain is yet to follow from a margin."""
        law, gain = law_from(self.scene.control)
        if gain is None:
            gain = MOTION.little_gain * self.modes.omega[0]
        return Loop(self.motion, self.body.allocation, gain, self.body.notches, law)

    @cached_property
    def stability(self):
        """`LoopStability`: its stable gains and margins."""
        return LoopStability(self)

    @cached_property
    def with_critical_modes(self):
        """Copy whose model has the modes that would grow first; itself unless its gain is nearly the largest one."""
        if not self.loop.gain or self.stability.seen_far_from_unstable:
            return self
        plant = self.stability.driven.with_critical_modes(self.plant, self.loop.gain)
        return self if plant is self.plant else ClosedLoop(self.scene, plant)

    @cached_property
    def with_all_modes(self):
        """Copy for a state space, see `Plant.with_all_modes`."""
        plant = self.plant.with_all_modes
        return self if plant is self.plant else ClosedLoop(self.scene, plant)

    def with_modes(self, chosen):
        """Copy with some of its modes, by their indices from 0, and static responses in place of all others."""
        return ClosedLoop(self.scene, replace(self.plant, modes=self.modes.take(chosen), driven=0, loops={}))

    @cached_property
    def with_twice_the_modes(self):
        """Copy with twice as many modes; None of stated elements, or where these are too many or cannot be computed."""
        plant, count, cables = self.plant, 2 * len(self.modes), self.modes.models.cables
        if plant.model is not None or count > MOTION.more_modes[-1]:
            return None
        try:
            modes = coupled_modes(plant.equilibrium, count, plant.accuracy, cables=cables, damped=True)
        except ConvergenceError:
            return None
        return ClosedLoop(self.scene, replace(plant, modes=modes.damped, driven=0))

    @property
    def open_poles(self):
        """Eigenvalues with the winches at rest. [rad/s]"""
        return self.motion.eigen.poles

    @property
    def unstable_open_pole(self):
        """The unstable pole that grows fastest with the winches at rest; None where all are stable."""
        return None if self.motion.dissipates else unstable_pole(self.open_poles)

    def check_open(self):
        """Refuse what grows with the winches at rest: NoSolutionError, with the motion and why."""
        if (pole := self.unstable_open_pole) is not None:
            motion = self._unstable_motion(pole, self.motion)
            raise NoSolutionError(f"unstable without winches ({self._cause_of_growth}): {motion}")

    @property
    def _cause_of_growth(self):
        """Words for what makes a motion grow with the winches at rest; damping by the air takes energy only."""
        if self.actuators:
            return "actuators"
        air = self.plant.airflow
        if air is None or not air.damps:
            return "dead moments"
        return "drag that turns with what moves"

    def check_stable(self):
        """Refuse what grows.

        Raises
        ------
        NoSolutionError
            With the motion that grows, and why.
        """
        self.check_open()
        if not self.stability.stable:
            raise NoSolutionError(self._instability_message)

    @cached_property
    def _instability_message(self):
        """Message of an unstable loop: which motion grows, and below which gain none does."""
        loop, pole = self.loop, self.loop.unstable_pole
        if pole:
            motion = self._unstable_motion(pole, loop)
        else:
            motion = f"a motion of {self.stability.driven.limit.omega / (2 * np.pi):.4g} Hz grows"
        message = f"the loop is unstable at {self.gains_in_words(loop.gain)}: {motion}; "
        try:
            limit = self.stability.largest_gain
        except (NoSolutionError, ConvergenceError) as error:
            return message + str(error)
        if limit is None:
            return message + "no gain below it is the largest stable one"
        below = f"{limit:.4g} rad/s" if loop.law.integrates_only else f"{limit / loop.gain:.4g} times these gains"
        return f"{message}stable below {below}"

    def gains_in_words(self, gain):
        """The gains of the law's parts in words, `gain` [rad/s] being the factor of the law."""
        return self.untuned_loop.law.described(gain, 4).removeprefix("a gain of ")

    def mode_name(self, coordinate):
        """Number, moving part and frequency of the mode of a coordinate of `motion`, counted from 0, in words."""
        if coordinate >= len(self.plant.kept):
            return "a motion above the modes of the model"
        mode = int(self.plant.kept[coordinate])
        return f"mode {mode + 1} ({self.modes.moves[mode]}, {self.modes.frequency[mode]:.4g} Hz)"

    def _unstable_motion(self, pole, system):
        """The motion of an unstable pole in words: the coordinate with most of its energy, and its rate of growth.

        `system` is a `LinearSystem` or `Loop`. Its shape is the null vector of the dynamic stiffness at the pole.
        """
        stiffness = system.dynamic_stiffness(np.array([pole]))[0]
        shape = np.linalg.svd(stiffness)[2][-1].conj()
        energy = np.abs(shape * pole) ** 2
        coordinate = int(np.argmax(energy))
        oscillates = abs(pole.imag) > MOTION.undamped_motion * abs(pole)
        at = f"at {abs(pole.imag) / (2 * np.pi):.4g} Hz" if oscillates else "without oscillating"
        growth = f"grows by {pole.real:.3g}/s {at}"
        masses = [actuator.name for actuator in self.actuators if not actuator.wheel]
        stroke = coordinate - (len(self.motion) - len(masses))  # the last coordinates are the strokes of masses
        return f"{masses[stroke] if stroke >= 0 else self.mode_name(coordinate)} {growth}"
