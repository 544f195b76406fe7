"""One suspension in the mean wind with the loop of its winches."""

from dataclasses import replace
from functools import cached_property
from math import ceil, log2

import numpy as np

from cablestudy.control.gain_limits import undamped
from cablestudy.control.law import law_from
from cablestudy.control.loop import Loop, allocate, moved_by_winches, unstable_pole
from cablestudy.control.notch import Notch
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import ConvergenceError, NoSolutionError, outcome_of, result_of
from cablestudy.scene.suspension_tables import MOTIONS
from cablestudy.study.suspension.driven_cables import DrivenCables
from cablestudy.study.suspension.driven_waves import Effects
from cablestudy.study.suspension.turbulence import Turbulence
from cablestudy.study.tolerances import STUDY
from cablestudy.system.suspension import AXES

TURN = 2 * np.pi


class ClosedLoop:
    """A suspension about its equilibrium in the mean wind, with its loop.

    Parameters
    ----------
    scene : SuspensionScene
    plant : Plant
        Of this scene, or of one that differs in the loop, the exposure or the correction.
    """

    def __init__(self, scene, plant):
        self.scene, self.plant, self.modes = scene, plant, plant.modes
        self.equilibrium, self.drag, self.layout = plant.equilibrium, plant.drag, plant.layout
        self.winches, self.markers, self.actuators = plant.winches, plant.markers, plant.actuators

    @property
    def motion(self):
        """`LinearSystem`."""
        return self.plant.motion

    @property
    def gusts(self):
        """`Gusts` on the coordinates."""
        return self.plant.gusts

    @property
    def outputs(self):
        """Name of each output -> its row: displacements of bodies, markers, tensions."""
        return self.plant.outputs

    @cached_property
    def turbulence(self):
        """`Turbulence` with the loop where it does something, else with the winches at rest."""
        return Turbulence(self.plant, self.loop) if self.loop and self.loop.gain else self.plant.at_rest

    # --------------------------------------------------------------------------------------------------- loop

    @cached_property
    def body(self):
        """Number of the body that is controlled."""
        name = self.scene.control.body
        return list(self.scene.bodies).index(name) if name else 0

    @property
    def body_name(self):
        """Name of the body that is controlled."""
        return self.equilibrium.suspension.body_names[self.body]

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
        control = self.scene.control
        names = list(control.measured or self.free)
        moved = self._of_body(self.motion.shapes)
        rows = np.zeros((6, len(self.motion)))
        rows[:, : moved.shape[1]] = moved
        on, end = np.nonzero(self.equilibrium.suspension.owner == self.body)
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
                raise NoSolutionError(f"control.measured: no winch moves {', '.join(idle)} of {self.body_name}")
        names = [name for name, does in zip(names, moves, strict=True) if does]
        return names, rows[moves], sizes[moves]

    def _of_body(self, shapes):
        """Displacements of the controlled body in shapes of the suspension, shape (6, r)."""
        return self.layout.displaced(self.layout.bodies(shapes))[self.body]

    @property
    def measured(self):
        """Names of what is measured: list of str."""
        return self._measurable[0]

    @property
    def measured_outputs(self):
        """Names among the `outputs` of what is measured: list of str."""
        return [f"{self.body_name}.{AXES[MOTIONS.index(name)]}" for name in self.measured]

    @cached_property
    def notches(self):
        """Notch of each measured coordinate: tuple of (Notch or None)."""
        table = self.scene.control.notch
        if table is None:
            return (None,) * len(self.measured)
        frequencies = [table.frequency] * len(self.measured)
        if table.frequency == "coupled":
            frequencies = self.coupled_frequencies
        elif table.frequency == "static":
            frequencies = self._static_frequencies()
        return tuple(
            Notch(TURN * own, table.damping_ratio, TURN * table.rolloff_frequency, table.rolloff_damping_ratio)
            for own in frequencies
        )

    @cached_property
    def _shares(self):
        """Share of each mode of the model in the static compliance of each measured coordinate, shape (k, m). [-]"""
        kept = self.plant.kept
        moved = self._measurable[1][:, : len(kept)] / self.modes.solution.omega[kept]
        return moved**2 / self._compliance[:, None]

    @cached_property
    def _compliance(self):
        """Static, of each measured coordinate, shape (k,). [m/N], [rad/(N m)]"""
        rows = self._measurable[1]
        stiffness = self.motion.dynamic_stiffness(np.zeros(1))[0].real
        return (rows * np.linalg.solve(stiffness, rows.T).T).sum(axis=1)

    @property
    def knows_notches(self):
        """True if no mode that the model lacks may have a larger share than the one that a notch `coupled` is of."""
        table = self.scene.control and self.scene.control.notch
        if not table or table.frequency != "coupled":
            return True
        return bool((self._shares.max(axis=1) > 1 - self._shares.sum(axis=1)).all())

    @property
    def coupled_frequencies(self):
        """Frequency of the mode with the largest share in the static compliance of each measured coordinate. [Hz]"""
        shares = self._shares / self._shares.max(axis=1, keepdims=True)
        return self.modes.frequency[self.plant.kept[np.argmax(np.round(shares, 9), axis=1)]]

    def _static_frequencies(self):
        """Frequency of each measured coordinate on its static compliance with the body's own mass. [Hz]"""
        inertia = np.diagonal(self.layout.mass[self.body])[[MOTIONS.index(name) for name in self.measured]]
        return 1 / np.sqrt(self._compliance * inertia) / TURN

    @cached_property
    def allocation(self):
        """`Allocation` of errors to winches."""
        control = self.scene.control
        given = control.allocation.weights if control.allocation else {}
        weights = np.array([given.get(name, 1.0) for name in self.scene.winches])
        return allocate(self.motion, *self._measurable[1:], weights)

    @cached_property
    def loop(self):
        """The `Loop`, or None without control.

        Raises
        ------
        NoSolutionError
            No gain follows from a margin, or nothing moves what is measured.
        """
        control = self.scene.control
        if control is None:
            return None
        if isinstance(control.gain, (int, float)):
            return replace(self.given_loop, gains=self.gains) if self.given_loop.law.delay else self.given_loop
        auto, limit = control.gain.auto, self.largest_gain
        most = limit and limit / 10 ** (auto.gain_margin / 20)
        gain = self.gains.gain_of_peak(auto.sensitivity, most)
        if gain is None:
            raise NoSolutionError("no gain follows from a gain margin: the loop is stable for every gain")
        return replace(self.given_loop, gain=gain, gains=self.gains)

    @cached_property
    def given_loop(self):
        """The loop with its gain, or with next to none where the gain follows from a margin."""
        law, gain = law_from(self.scene.control)
        given = STUDY.little_gain * self.modes.solution.omega[0] if gain is None else gain
        return Loop(self.motion, self.allocation, given, self.notches, law)

    @cached_property
    def _of_all_gains(self):
        """Shared by loops that differ in the gain alone, and by models with other numbers of modes: three.

        `Effects`; `DrivenCables` by powers of two of the gain; and the gain that is tried first, by that of the loop.
        """
        control = repr((self.scene.control.model_copy(update={"gain": None}), self.given_loop.law))
        if control not in self.plant.loops:
            self.plant.loops[control] = Effects(self), {}, {}
        return self.plant.loops[control]

    @property
    def effects(self):
        """`Effects` of the gain on the modes of single cables."""
        return self._of_all_gains[0]

    @property
    def driven(self):
        """`DrivenCables` of a gain above that of the loop and above the largest one; loops that differ in it share it.

        Raises
        ------
        NoSolutionError, ConvergenceError
            The loop is unstable without gain, or could drive too many modes.
        """
        return result_of(self._driven)

    @cached_property
    def _driven(self):
        """`driven`, or the error that says why there is none: computed once for a row."""
        return outcome_of(self._found_driven)

    def _found_driven(self):
        """`driven`, of growing gains."""
        _, known, begins = self._of_all_gains
        self.check_open()
        gain = self.given_loop.gain or STUDY.little_gain
        if gain not in begins:
            begins[gain] = self._first_gain(gain, known)
        gain = begins[gain]
        tried, found = [], None
        for _ in range(STUDY.gain_trials):
            if tried and found.models is not self.modes.solution.models:
                known.pop(tried[-1])  # its models may be large
                found = None
            tried.append(ceil(log2(gain)))
            found = self._driven_by(gain, known)
            limit = found.gains.limit
            more = limit.factor if limit else STUDY.unlimited_gain * self.modes.solution.omega[0]
            if more <= 2.0 ** tried[-1]:
                known.update(dict.fromkeys(tried, found))
                break
            gain = more
        return found

    def _first_gain(self, gain, known):
        """A gain near the largest one, if it is above one [rad/s] and few waves follow from it, else that one.

        Of an exact choice of elements, whose modes are all there, rather one far above it.
        """
        safety, effects = STUDY.first_gain_safety, self.effects
        for above in (safety,) if self.plant.model is None else (STUDY.element_gain_safety, safety):
            near = max(gain, above * (self.given_loop.limit_by_modes or 0.0))
            waves = effects.driven_up_to(near) * effects.travel_time / np.pi
            if waves.max(initial=0.0) <= STUDY.first_gain_waves:
                break
        else:
            return gain
        try:
            self._driven_by(near, known)
        except (NoSolutionError, ConvergenceError):  # that gain may be far above the largest one
            return gain
        return near

    def _driven_by(self, gain, known):
        """`DrivenCables` of a gain [rad/s], to the next power of two; of `known` ones by these powers, to be filled."""
        power = ceil(log2(gain))
        if power not in known:
            known[power] = DrivenCables(self, 2.0**power, list(known.values()))
        return known[power]

    @property
    def gains(self):
        """`StableGains` with all modes of the cables that the gain, and the largest gain, could drive."""
        return self.driven.gains

    @property
    def limit(self):
        """`Limit` of the gain, or None: that of all loops that differ in the gain alone.

        Raises
        ------
        NoSolutionError
            A mode as good as undamped decides.
        """
        limit = self.gains.limit
        if limit and limit.undamped:
            gains = self._gains_in_words((1 + CONTROL.above_undamped_limit) * limit.factor)
            raise undamped(1j * limit.omega, self.gains.open_ratio(limit.omega), f"no largest gain: at {gains} ")
        return limit

    @property
    def largest_gain(self):
        """Below it the loop is stable; None where it always is. [rad/s]"""
        return self.limit and self.limit.factor

    @cached_property
    def margins(self):
        """`Margins` of the loop, which is stable."""
        return self.gains.margins(self.loop.gain)

    @cached_property
    def perturbed_margins(self):
        """`DrivenCables.perturbed_margins` of these."""
        return self.driven.perturbed_margins(self.margins, self.loop.gain)

    @cached_property
    def single_limits(self):
        """`StableGains.single_limits`, by the name of the measured coordinate: dict."""
        return dict(zip(self.measured, self.gains.single_limits(self.loop.gain).tolist(), strict=True))

    @cached_property
    def with_critical_modes(self):
        """Copy with the modes that would grow first where its gain is nearly the largest one."""
        plant = self.driven.with_critical_modes(self.plant, self.loop.gain)
        return self if plant is self.plant else ClosedLoop(self.scene, plant)

    @cached_property
    def with_all_modes(self):
        """Copy with the modes that no output depends on: for a state space."""
        plant = self.plant.with_all_modes
        return self if plant is self.plant else ClosedLoop(self.scene, plant)

    @cached_property
    def stable(self):
        """True if no motion grows, with the winches at rest and with the loop."""
        if unstable_pole(self.open_poles) is not None:
            return False
        return self.loop is None or not self.gains.unstable(self.loop.gain)

    @property
    def open_poles(self):
        """Eigenvalues with the winches at rest. [rad/s]"""
        return self.motion.eigen.poles

    def check_open(self):
        """Refuse what grows with the winches at rest: NoSolutionError, with the motion and why."""
        if (pole := unstable_pole(self.open_poles)) is not None:
            cause = "actuators" if self.actuators else "aerodynamic damping"
            raise NoSolutionError(f"unstable without winches ({cause}): {self._named(pole, self.motion)}")

    def check_stable(self):
        """Refuse what grows.

        Raises
        ------
        NoSolutionError
            With the motion that grows, and why.
        """
        self.check_open()
        if not self.stable:
            raise NoSolutionError(self._complaint)

    @cached_property
    def _complaint(self):
        """Which motion grows with the loop, and below which gain none does."""
        loop, pole = self.loop, self.loop.unstable_pole
        moving = self._named(pole, loop) if pole else f"a motion of {self.gains.limit.omega / TURN:.4g} Hz grows"
        found = f"the loop is unstable at {self._gains_in_words(loop.gain)}: {moving}; "
        try:
            limit = self.largest_gain
        except NoSolutionError as error:
            return found + str(error)
        if limit is None:
            return found + "no gain below it is the largest stable one"
        below = f"{limit:.4g} rad/s" if loop.law.integrates_only else f"{limit / loop.gain:.4g} times these gains"
        return f"{found}stable below {below}"

    def _gains_in_words(self, gain):
        """Those of the law for what it is multiplied by [rad/s]."""
        return self.given_loop.law.described(gain, 4).removeprefix("a gain of ")

    def mode_name(self, place):
        """Number of a coordinate, what it moves and its frequency, in words."""
        if place >= len(self.plant.kept):
            return "a motion above the modes of the model"
        mode = int(self.plant.kept[place])
        return f"mode {mode + 1} ({self.modes.moves[mode]}, {self.modes.frequency[mode]:.4g} Hz)"

    def _named(self, pole, moving):
        """The motion of a growing pole of a `LinearSystem` or `Loop` in words."""
        dynamic = moving.dynamic_stiffness(np.array([pole]))[0]
        shape = np.linalg.svd(dynamic)[2][-1].conj()
        energy = np.abs(shape * pole) ** 2
        place = int(np.argmax(energy))
        rate = f"grows by {pole.real:.3g}/s at {abs(pole.imag) / TURN:.4g} Hz"
        strokes = [one.name for one in self.actuators if not one.wheel]
        stroke = place - (len(self.motion) - len(strokes))
        return f"{strokes[stroke] if stroke >= 0 else self.mode_name(place)} {rate}"
