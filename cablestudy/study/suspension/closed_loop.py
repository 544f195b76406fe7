"""One suspension in the mean wind with the control loop of its winches."""

from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from math import ceil, log2

import numpy as np

from cablestudy.control.gain_limits import StableGains, undamped
from cablestudy.control.law import law_from
from cablestudy.control.loop import Loop, clearly_stable, unstable_pole
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import ConvergenceError, NoSolutionError, outcome_of, result_of, without_errors
from cablestudy.study.suspension.controlled_body import ControlledBody
from cablestudy.study.suspension.driven_cables import DrivenCables
from cablestudy.study.suspension.driven_waves import Effects
from cablestudy.study.suspension.left_out_modes import LeftOutModes
from cablestudy.study.suspension.turbulence import Turbulence
from cablestudy.study.tolerances import STUDY
from cablestudy.system.cables import Models
from cablestudy.system.coupled_modes import coupled_modes
from cablestudy.system.coupling_damping import compute_pole_sums
from cablestudy.system.together import computed_together

TURN = 2 * np.pi


def _solve_trials(trials):
    """Compute the `limits` of the gains of many `DrivenCables` together; where there are none, they are asked again."""
    Models.groups.compute(trial.models for trial in trials)
    coupling = without_errors({trial: outcome_of(partial(getattr, trial, "coupling_damping")) for trial in trials})
    compute_pole_sums(damping for of_trial in coupling.values() for damping in of_trial)
    DrivenCables.poles_outcome.compute(coupling)
    gains = without_errors({trial: outcome_of(partial(getattr, trial, "gains")) for trial in trials})
    StableGains.limits.compute(gains.values())


class ClosedLoop:
    """A suspension about its equilibrium in the mean wind, with the loop that `control` of its scene describes.

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

    def with_plant(self, plant):
        """Copy about a `Plant` that differs in the gusts alone (`Plant.with_airflow`); itself about its own.

        What was computed of its loop and its stability is shared.
        """
        if plant is self.plant:
            return self
        other = copy(self)
        other.plant = plant
        for name in ("turbulence", "left_out_modes", "with_critical_modes", "with_all_modes"):
            other.__dict__.pop(name, None)
        return other

    @property
    def motion(self):
        """`LinearSystem` of the suspension with its winches at rest."""
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
        """`Turbulence` with the loop, or with the winches at rest where there is none or its gain is zero."""
        return Turbulence(self.plant, self.loop) if self.loop and self.loop.gain else self.plant.at_rest

    @cached_property
    def left_out_modes(self):
        """`LeftOutModes`, whose responses all exposures and mirrors share."""
        return LeftOutModes(self)

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
            return replace(self.untuned_loop, gains=self.gains) if self.untuned_loop.law.delay else self.untuned_loop
        auto, limit = control.gain.auto, self.largest_gain
        gain_with_margin = limit and limit / 10 ** (auto.gain_margin / 20)
        gain = self.gains.gain_of_peak(auto.sensitivity, gain_with_margin)
        if gain is None:
            raise NoSolutionError("no gain follows from a gain margin: the loop is stable for every gain")
        return replace(self.untuned_loop, gain=gain, gains=self.gains)

    @cached_property
    def untuned_loop(self):
        """The `Loop` with the gain of the scene, or with a tiny one where the gain is yet to follow from a margin."""
        law, gain = law_from(self.scene.control)
        if gain is None:
            gain = STUDY.little_gain * self.modes.solution.omega[0]
        return Loop(self.motion, self.body.allocation, gain, self.body.notches, law)

    @cached_property
    def _shared_by_gains(self):
        """Results shared by loops that differ in the gain alone, and by models with other numbers of modes: three.

        `Effects`; power of two of a gain -> `DrivenCables`; gain of a loop -> the gain that is tried first for it.
        """
        control = repr((self.scene.control.model_copy(update={"gain": None}), self.untuned_loop.law))
        if control not in self.plant.loops:
            self.plant.loops[control] = Effects(self), {}, {}
        return self.plant.loops[control]

    @property
    def effects(self):
        """`Effects` of the gain on the modes of single cables."""
        return self._shared_by_gains[0]

    def _effects_if_stable(self):
        """`effects` of a loop that is stable without gain; raises as `check_open`."""
        self.check_open()
        return self.effects

    @property
    def driven(self):
        """`DrivenCables` of a gain above that of the loop and above the largest one; loops that differ in it share it.

        Raises
        ------
        NoSolutionError, ConvergenceError
            The loop is unstable without gain, or could drive too many modes.
        """
        return result_of(self.driven_outcome)

    @computed_together
    def driven_outcome(closed_loops):
        """`driven`, or the error that says why there is none; the trials of many loops are computed together."""
        effects = without_errors({one: outcome_of(one._effects_if_stable) for one in closed_loops})
        Effects.driving_gain.compute(effects.values())
        searches = {one: one._driven_cables_tried() for one in closed_loops}
        while searches:
            trials = {}
            for one, search in list(searches.items()):
                try:
                    trials[one] = next(search)
                except StopIteration as end:
                    outcome = end.value
                except (NoSolutionError, ConvergenceError) as error:
                    outcome = error
                else:
                    continue
                del searches[one]
                yield one, outcome
            _solve_trials(dict.fromkeys(trials.values()))  # loops of other exposures share theirs

    def _driven_cables_tried(self):
        """Find `DrivenCables` with all modes of cables that decide on the largest stable gain, which is returned.

        Trials: `DrivenCables` with all modes that a trial gain could drive have a largest stable gain; where this is
        above the trial gain, it is the next trial gain. Where the loop is stable with every gain,
        `STUDY.unlimited_gain` times the lowest frequency stands for the largest one. Each trial is yielded before its
        `limit` is asked for. Raises as `driven`.
        """
        _, driven_cables, first_gains = self._shared_by_gains
        self.check_open()
        gain = self.untuned_loop.gain
        if gain not in first_gains:
            first_gains[gain] = yield from self._first_gain_tried()
        gain = first_gains[gain]
        # exponents of the gains tried, powers of two, and their `DrivenCables`
        powers, driven_of_gain = [], None
        for _ in range(STUDY.gain_trials):
            if powers and driven_of_gain.models is not self.modes.solution.models:
                driven_cables.pop(powers[-1], None)  # its models may be large
                driven_of_gain = None
            powers.append(ceil(log2(gain)))
            driven_of_gain = self._driven_cables_of(gain)
            yield driven_of_gain
            limit = driven_of_gain.limit
            needed_gain = limit.factor if limit else STUDY.unlimited_gain * self.modes.solution.omega[0]
            if needed_gain <= 2.0 ** powers[-1]:
                driven_cables.update(dict.fromkeys(powers, driven_of_gain))
                break
            gain = needed_gain
        return driven_of_gain

    def _first_gain_tried(self):
        """Gain for the first `DrivenCables` of the loop, the first of `_trial_gains` that can be judged. [rad/s]"""
        for trial in self._trial_gains:
            try:
                driven_of_gain = self._driven_cables_of(trial)
                yield driven_of_gain
                _ = driven_of_gain.limit
            except (NoSolutionError, ConvergenceError):  # that gain may be far above the largest one
                continue
            return trial
        return self.untuned_loop.gain or STUDY.little_gain

    @cached_property
    def _trial_gains(self):
        """Gains with which the search for the largest stable one may begin: list, best first. [rad/s]

        One near the largest stable gain, if it is larger than that of the loop and drives few waves, which spares a
        second trial; and the one up to which `_far_from_unstable` judges the loop. Of an exact choice of elements,
        whose modes are all there, rather one far above the largest.
        """
        gain, safety, effects = self.untuned_loop.gain or STUDY.little_gain, STUDY.first_gain_safety, self.effects
        trials = [gain / STUDY.nearly_largest_gain]
        for factor in (safety,) if self.plant.model is None else (STUDY.element_gain_safety, safety):
            near_largest = max(gain, factor * (self.untuned_loop.limit_by_modes or 0.0))
            waves = effects.driven_up_to(near_largest) * effects.travel_time / np.pi
            if waves.max(initial=0.0) <= STUDY.first_gain_waves:
                return [near_largest, *trials]
        return trials

    def _driven_cables_of(self, gain):
        """`DrivenCables` of a gain [rad/s] raised to the next power of two, shared by loops of other gains."""
        power, driven_cables = ceil(log2(gain)), self._shared_by_gains[1]
        if power not in driven_cables:
            driven_cables[power] = DrivenCables(self, 2.0**power, list(driven_cables.values()))
        return driven_cables[power]

    @property
    def first_gains(self):
        """`StableGains` of the first trial of `driven`, by which its search begins; raises as `driven`."""
        self.check_open()
        return self._driven_cables_of(self._trial_gains[0]).gains

    @property
    def judged_by(self):
        """`DrivenCables` that show a loop with a stated gain to be stable; raises as `driven`."""
        if self._far_from_unstable:  # also where the largest gain is known: no digit depends on what was asked first
            return self._driven_cables_of(self.loop.gain / STUDY.nearly_largest_gain)
        return self._judging

    @property
    def gains(self):
        """`StableGains` with all modes of the cables that the gain, and the largest gain, could drive."""
        return self._judging.gains

    @property
    def _judging(self):
        """`DrivenCables` that judge the gain of the loop, or any gain where it follows from a margin."""
        gain = law_from(self.scene.control)[1]
        return self.driven.for_gain(np.inf if gain is None else gain)

    @property
    def limit(self):
        """`Limit`: the smallest gain at which a pole crosses the imaginary axis; None where none does.

        Raises
        ------
        NoSolutionError
            A mode as good as undamped decides.
        """
        limit = self.driven.limit
        if limit and limit.undamped:
            gains = self._gains_in_words((1 + CONTROL.above_undamped_limit) * limit.factor)
            raise undamped(1j * limit.omega, self.gains.open_ratio(limit.omega), f"no largest gain: at {gains} ")
        return limit

    @property
    def largest_gain(self):
        """Gain below which the loop is stable; None where it is with every gain. [rad/s]"""
        return self.limit and self.limit.factor

    @property
    def margins(self):
        """`Margins` of the loop, which is stable."""
        return self._margins_and_cables[0]

    @cached_property
    def _margins_and_cables(self):
        """`margins`, and their `DrivenCables`, which resolve waves across cables where the margins are decided."""
        driven, gain = self._judging, self.loop.gain
        margins = driven.gains.margins(gain)
        if driven.resolving is not driven and not driven.resolves(margins.deciding.max(initial=0.0)):
            driven = driven.resolving
            margins = driven.gains.margins(gain)
        return margins, driven

    @cached_property
    def perturbed_margins(self):
        """`Margins` with the errors of the cables' models, see `DrivenCables.perturbed_margins`: list."""
        margins, driven = self._margins_and_cables
        return driven.perturbed_margins(margins, self.loop.gain)

    @cached_property
    def simplification_error(self):
        """Relative error of the margins, at least: both `simplification_error` and `pole_sum_error` of `driven`. [-]"""
        margins, driven = self._margins_and_cables
        return driven.simplification_error + driven.pole_sum_error(margins.deciding)

    @cached_property
    def single_limits(self):
        """Name of each measured coordinate -> factor by which its gain alone may grow, see `StableGains`: dict."""
        driven, resolving = self._judging, self.driven.resolving
        finer = None if resolving is driven else resolving.loop_gain
        limits = driven.gains.single_limits(self.loop.gain, finer, driven.resolved_to)
        return dict(zip(self.body.measured, limits.tolist(), strict=True))

    @cached_property
    def with_critical_modes(self):
        """Copy whose model has the modes that would grow first; itself unless its gain is nearly the largest one."""
        if self._seen_far_from_unstable:
            return self
        plant = self.driven.with_critical_modes(self.plant, self.loop.gain)
        return self if plant is self.plant else ClosedLoop(self.scene, plant)

    @cached_property
    def with_all_modes(self):
        """Copy with the modes that no output depends on: for a state space."""
        plant = self.plant.with_all_modes
        return self if plant is self.plant else ClosedLoop(self.scene, plant)

    @cached_property
    def with_twice_the_modes(self):
        """Copy with twice as many modes; None of exact elements, or where these are too many or cannot be computed."""
        plant, count, cables = self.plant, 2 * len(self.modes), self.modes.solution.models.cables
        if plant.model is not None or count > STUDY.more_modes[-1]:
            return None
        try:
            modes = coupled_modes(plant.equilibrium, count, plant.accuracy, cables=cables, damped=True)
        except ConvergenceError:
            return None
        return ClosedLoop(self.scene, plant.with_modes(modes.damped, driven=0))

    @cached_property
    def stable(self):
        """True if no motion grows, with the winches at rest and with the loop."""
        if self._growing_open_pole is not None:
            return False
        if self.loop is None or self._seen_far_from_unstable:
            return True
        return self.driven.stable(self.loop.gain)

    @property
    def _seen_far_from_unstable(self):
        """`_far_from_unstable`, or False where the largest gain is known already."""
        return ClosedLoop.driven_outcome.known(self) is None and self._far_from_unstable

    @cached_property
    def _far_from_unstable(self):
        """True if the loop is stable, and its gain not nearly the largest one; where this is seen with little work.

        That spares the search for the largest gain. It is left to that search where the gain follows from it, and where
        the law has a delay.
        """
        law, gain = law_from(self.scene.control)
        if not gain or law.delay:
            return False
        higher_gain = gain / STUDY.nearly_largest_gain
        return self._poles_decay_up_to(higher_gain) or self._stable_up_to(higher_gain)

    def _poles_decay_up_to(self, gain):
        """True if all poles of the model decay, with a gain [rad/s] and with that of the loop, and no other mode grows.

        No mode of the cables above those of the model could be driven by the gain (`Effects`).
        """
        loop = self.untuned_loop
        if not loop.law.integrates_only or not self._drives_no_other_modes(gain):
            return False
        return clearly_stable(loop.poles) and clearly_stable(loop.poles_with(gain))

    def _stable_up_to(self, gain):
        """True if the loop is stable with all gains up to this one [rad/s], with all modes that it could drive."""
        try:
            limit = self._driven_cables_of(gain).limit
        except (NoSolutionError, ConvergenceError):  # more modes than can be computed
            return False
        return limit is None or limit.factor > gain

    def _drives_no_other_modes(self, gain):
        """True if a gain [rad/s] could drive no mode of the cables above the modes of the model, by a bound.

        The lowest n - d modes of the cables with fixed ends lie below mode n of the whole, d being the number of free
        displacements (interlacing of eigenvalues under constraints: Courant and Hilbert, I.4.3).
        """
        effects, solution, elements = self.effects, self.modes.solution, self.modes.solution.models.elements
        have_all_modes = self.plant.model is not None and solution.models.complete
        resolved = np.inf if have_all_modes else solution.with_all_modes.omega[-1]
        if resolved < np.inf and effects.driven_up_to(gain).max(initial=0.0) > resolved:
            return False
        fixed = np.sort(np.concatenate([element.omega for element in elements]))
        lowest = fixed[: max(len(self.modes) - len(self.layout.free), 0)].max(initial=0.0)
        driven = effects.may_drive(elements, gain)
        return not any(
            (of_cable & (element.omega >= lowest)).any() for of_cable, element in zip(driven, elements, strict=True)
        )

    @property
    def open_poles(self):
        """Eigenvalues with the winches at rest. [rad/s]"""
        return self.motion.eigen.poles

    @property
    def _growing_open_pole(self):
        """The pole that grows fastest with the winches at rest; None where none grows."""
        return None if self.motion.dissipates else unstable_pole(self.open_poles)

    def check_open(self):
        """Refuse what grows with the winches at rest: NoSolutionError, with the motion and why."""
        if (pole := self._growing_open_pole) is not None:
            cause = "actuators" if self.actuators else "aerodynamic damping"
            raise NoSolutionError(f"unstable without winches ({cause}): {self._growing_motion(pole, self.motion)}")

    def check_stable(self):
        """Refuse what grows.

        Raises
        ------
        NoSolutionError
            With the motion that grows, and why.
        """
        self.check_open()
        if not self.stable:
            raise NoSolutionError(self._instability_message)

    @cached_property
    def _instability_message(self):
        """Message of an unstable loop: which motion grows, and below which gain none does."""
        loop, pole = self.loop, self.loop.unstable_pole
        if pole:
            motion = self._growing_motion(pole, loop)
        else:
            motion = f"a motion of {self.driven.limit.omega / TURN:.4g} Hz grows"
        message = f"the loop is unstable at {self._gains_in_words(loop.gain)}: {motion}; "
        try:
            limit = self.largest_gain
        except NoSolutionError as error:
            return message + str(error)
        if limit is None:
            return message + "no gain below it is the largest stable one"
        below = f"{limit:.4g} rad/s" if loop.law.integrates_only else f"{limit / loop.gain:.4g} times these gains"
        return f"{message}stable below {below}"

    def _gains_in_words(self, gain):
        """The gains of the law's parts in words, `gain` [rad/s] being the factor of the law."""
        return self.untuned_loop.law.described(gain, 4).removeprefix("a gain of ")

    def mode_name(self, coordinate):
        """Number, moving part and frequency of the mode of a coordinate of `motion`, counted from 0, in words."""
        if coordinate >= len(self.plant.kept):
            return "a motion above the modes of the model"
        mode = int(self.plant.kept[coordinate])
        return f"mode {mode + 1} ({self.modes.moves[mode]}, {self.modes.frequency[mode]:.4g} Hz)"

    def _growing_motion(self, pole, system):
        """The motion of a growing pole in words: the coordinate with most of its energy, and its rate of growth.

        `system` is a `LinearSystem` or `Loop`. Its shape is the null vector of the dynamic stiffness at the pole.
        """
        stiffness = system.dynamic_stiffness(np.array([pole]))[0]
        shape = np.linalg.svd(stiffness)[2][-1].conj()
        energy = np.abs(shape * pole) ** 2
        coordinate = int(np.argmax(energy))
        growth = f"grows by {pole.real:.3g}/s at {abs(pole.imag) / TURN:.4g} Hz"
        masses = [actuator.name for actuator in self.actuators if not actuator.wheel]
        stroke = coordinate - (len(self.motion) - len(masses))  # the last coordinates are the strokes of masses
        return f"{masses[stroke] if stroke >= 0 else self.mode_name(coordinate)} {growth}"
