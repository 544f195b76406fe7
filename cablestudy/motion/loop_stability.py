"""Gains with which a `ClosedLoop` is stable, its margins, and the search for the largest gain.

With all modes of the cables that a gain could drive (`DrivenCables`), which are more than the model of the loop has.
"""

from dataclasses import dataclass, field
from functools import cached_property, partial
from math import ceil, log2

import numpy as np

from cablestudy.control.gain_limits import undamped
from cablestudy.control.law import law_from
from cablestudy.control.loop import clearly_stable
from cablestudy.control.stable_gains import StableGains
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import ConvergenceError, NoSolutionError, known, outcome_of, without_errors
from cablestudy.motion.driven_cables import DrivenCables
from cablestudy.motion.driven_waves import DrivingBounds
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.cables import Models
from cablestudy.system.coupling_damping import compute_pole_sums
from cablestudy.system.together import computed_together


def _solve_trials(trials):
    """Compute the `limits` of the gains of many `DrivenCables` together; where there are none, they are asked again."""
    Models.groups.compute(trial.models for trial in trials)
    coupling = known(trials, "coupling_damping")
    compute_pole_sums(damping for of_trial in coupling.values() for damping in of_trial)
    DrivenCables.poles.compute(coupling)
    StableGains.limits.compute(known(trials, "gains").values())


@dataclass(frozen=True)
class GainTrials:
    """Results of the search for the largest gain, shared by loops that differ in the gain alone.

    Attributes
    ----------
    effects : DrivingBounds
    driven_cables : dict
        Exponent of a trial gain, a power of two times the lowest frequency of the modes -> `DrivenCables`.
    first_gains : dict
        Gain of a loop -> the gain that its search tries first. [rad/s]
    """

    effects: DrivingBounds
    driven_cables: dict = field(default_factory=dict)
    first_gains: dict = field(default_factory=dict)


def compute_stability(loops):
    """Compute together what tells whether many loops, by their `LoopStability`, are stable with their gains.

    Loops that are unstable without gain are left out.
    """
    stable_without = without_errors({one: outcome_of(one._effects_if_stable) for one in loops})
    unknown = [one for one in stable_without if LoopStability.driven.known(one) is None]
    LoopStability._far_from_unstable.compute(unknown)
    LoopStability.driven.compute([one for one in unknown if one.needs_largest_gain])


class LoopStability:
    """Stable gains and margins of a `ClosedLoop`, each computed when asked for.

    Parameters
    ----------
    closed_loop : ClosedLoop
    """

    def __init__(self, closed_loop):
        self._closed_loop = closed_loop

    @cached_property
    def _trials(self):
        """`GainTrials`, which models with other numbers of modes share too."""
        closed_loop, loops = self._closed_loop, self._closed_loop.plant.loops
        control = closed_loop.scene.control
        key = *(value for name, value in control if name != "gain"), closed_loop.untuned_loop.law
        if key not in loops:
            loops[key] = GainTrials(DrivingBounds(closed_loop))
        return loops[key]

    @property
    def effects(self):
        """`DrivingBounds` of the gain on the modes of single cables."""
        return self._trials.effects

    def _effects_if_stable(self):
        """`effects` of a loop that is stable without gain; raises as `check_open`."""
        self._closed_loop.check_open()
        return self.effects

    @computed_together
    def driven(loops):
        """`DrivenCables` of a gain above that of the loop and above the largest stable one.

        Loops that differ only in their gain share it. The trials of many loops are computed together.

        Raises
        ------
        NoSolutionError, ConvergenceError
            The loop is unstable without gain, or could drive too many modes.
        """
        effects = without_errors({one: outcome_of(one._effects_if_stable) for one in loops})
        DrivingBounds.driving_gain.compute(effects.values())
        searches = {one: one._search_driven_cables() for one in loops}
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

    def _search_driven_cables(self):
        """Raise a trial gain until it is at least the largest stable one: a generator that returns its `DrivenCables`.

        `DrivenCables` give the largest stable gain (`limit`) with all modes of cables that their trial gain could drive
        to instability. This gain is right if it is at most the trial gain; else it becomes the next trial gain. After
        `MOTION.gain_trials` trials it is left as it is, and `limit` refuses a larger one. The `DrivenCables` of each
        trial gain are yielded before their `limit` is used: the caller can compute it for many loops together.

        Raises
        ------
        NoSolutionError, ConvergenceError
            The loop is unstable without gain, or could drive too many modes.
        """
        driven_cables, first_gains = self._trials.driven_cables, self._trials.first_gains
        self._closed_loop.check_open()
        gain = self._closed_loop.untuned_loop.gain
        if gain not in first_gains:
            first_gains[gain] = yield from self._first_trial_gain()
        gain = first_gains[gain]
        powers, driven_of_gain = [], None  # exponents of the trial gains, and the last `DrivenCables`
        for _ in range(MOTION.gain_trials):
            if powers and driven_of_gain.models is not self._closed_loop.modes.models:
                driven_cables.pop(powers[-1], None)  # its models may be large
                driven_of_gain = None
            powers.append(self._exponent(gain))
            driven_of_gain = self._driven_cables_of(gain)
            yield driven_of_gain
            limit = driven_of_gain.limit
            needed_gain = self._gain_to_reach(limit)
            if self._exponent(needed_gain) <= powers[-1]:
                driven_cables.update(dict.fromkeys(powers, driven_of_gain))
                break
            gain = needed_gain
        return driven_of_gain

    def _gain_to_reach(self, limit):
        """Trial gain [rad/s] that confirms a `Limit`, or None: that the loop is stable with any gain."""
        return limit.factor if limit else MOTION.unlimited_gain * self._lowest_frequency

    def _first_trial_gain(self):
        """Find the first of `_trial_gains` that can be judged [rad/s]: a generator, as `_search_driven_cables`."""
        for trial in self._trial_gains:
            try:
                driven_of_gain = self._driven_cables_of(trial)
                yield driven_of_gain
                _ = driven_of_gain.limit
            except (NoSolutionError, ConvergenceError):  # that gain may be far above the largest one
                continue
            return trial
        return self._least_gain_to_try

    @property
    def _lowest_frequency(self):
        """Lowest frequency of the modes, to which trial gains are referred. [rad/s]"""
        return self.effects.omega[0]

    @property
    def _least_gain_to_try(self):
        """Gain of the loop, or a tiny one where that is zero. [rad/s]"""
        return self._closed_loop.untuned_loop.gain or MOTION.little_gain * self._lowest_frequency

    def _exponent(self, gain):
        """Exponent of the power of two, times the lowest frequency, to which a gain [rad/s] is raised for a trial."""
        return ceil(log2(max(gain, MOTION.tiny) / self._lowest_frequency))

    @cached_property
    def _trial_gains(self):
        """Gains with which the search for the largest stable one may begin: list, best first. [rad/s]

        One near the largest stable gain, if it is larger than that of the loop and drives few waves, which spares a
        second trial; and the one up to which `_far_from_unstable` judges the loop. Of stated elements,
        whose modes are all there, rather one far above the largest.
        """
        loop, effects, safety = self._closed_loop.untuned_loop, self.effects, MOTION.first_gain_safety
        gain = self._least_gain_to_try
        trials = [gain / MOTION.nearly_largest_gain]
        for factor in (safety,) if self._closed_loop.plant.model is None else (MOTION.element_gain_safety, safety):
            near_largest = max(gain, factor * (loop.limit_by_modes or 0.0))
            waves = effects.driven_up_to(near_largest) * effects.travel_time / np.pi
            if waves.max(initial=0.0) <= MOTION.first_gain_waves:
                return [near_largest, *trials]
        return trials

    def _driven_cables_of(self, gain):
        """`DrivenCables` of a gain [rad/s] raised to that of the next trial (`_exponent`); other gains share it."""
        power, driven_cables = self._exponent(gain), self._trials.driven_cables
        if power not in driven_cables:
            trial_gain = 2.0**power * self._lowest_frequency
            driven_cables[power] = DrivenCables(self._closed_loop, trial_gain, list(driven_cables.values()))
        return driven_cables[power]

    @property
    def judged_by(self):
        """`DrivenCables` that show a loop with a stated gain to be stable; raises as `driven`."""
        if self._far_from_unstable:  # also where the largest gain is known: no digit depends on what was asked first
            return self._driven_cables_of(self._closed_loop.loop.gain / MOTION.nearly_largest_gain)
        return self._judging

    @property
    def gains(self):
        """`StableGains` with all modes of the cables that the gain, and the largest gain, could drive."""
        return self._judging.gains

    @property
    def _judging(self):
        """`DrivenCables` that judge the gain of the loop, or any gain where it follows from a margin."""
        gain = law_from(self._closed_loop.scene.control)[1]
        return self.driven.for_gain(np.inf if gain is None else gain)

    @cached_property
    def limit(self):
        """`Limit`: the smallest gain at which a pole crosses the imaginary axis; None where none does.

        Raises
        ------
        NoSolutionError
            A mode that is nearly undamped decides.
        ConvergenceError
            Waves or modes of cables that were not looked at may make the limit smaller.
        """
        driven = self.driven
        limit, resolving = driven.limit, driven.resolving
        if limit and limit.undamped:
            gains = self._closed_loop.gains_in_words((1 + CONTROL.above_undamped_limit) * limit.factor)
            raise undamped(1j * limit.omega, self.gains.open_ratio(limit.omega), f"no largest gain: at {gains} ")
        if limit and not resolving.resolves(limit.omega):
            frequency, resolved = limit.omega / (2 * np.pi), resolving.resolved_to / (2 * np.pi)
            raise ConvergenceError(
                f"the loop may become unstable at {frequency:.4g} Hz with a gain of about {limit.factor:.2g} rad/s, "
                f"but waves of the cables are resolved up to {resolved:.4g} Hz: the largest gain is not known"
            )
        if self._exponent(self._gain_to_reach(limit)) > self._exponent(driven.gain):
            raise ConvergenceError(
                f"modes of the cables that a gain of {driven.gain:.2g} rad/s could drive are looked at, and "
                "the loop is stable up to a larger one: the largest gain is not known"
            )
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
        driven, gain = self._judging, self._closed_loop.loop.gain
        margins = driven.gains.margins(gain)
        if driven.resolving is not driven and not driven.resolves(margins.deciding.max(initial=0.0)):
            driven = driven.resolving
            margins = driven.gains.margins(gain)
        return margins, driven

    @cached_property
    def perturbed_margins(self):
        """`Margins` with the errors of the cables' models, see `LoopGainErrors.perturbed_margins`: list."""
        margins, driven = self._margins_and_cables
        return driven.errors.perturbed_margins(margins)

    @cached_property
    def least_margin_error(self):
        """Relative error of the margins, at least: by `simplification` and `of_pole_sums` of `LoopGainErrors`. [-]"""
        margins, driven = self._margins_and_cables
        return driven.errors.simplification + MOTION.margin_safety * driven.errors.of_pole_sums(margins.deciding)

    @cached_property
    def _single_limits_and_cables(self):
        """`Limit` of each measured coordinate alone, with the others closed, and the `DrivenCables` it is of: list.

        These resolve waves across the cables beyond its frequency, as far as they can be.
        """
        driven, gain = self._judging, self._closed_loop.loop.gain
        found = [(limit, driven) for limit in driven.gains.single_limits(gain)]
        for _ in range(MOTION.resolution_trials):
            highest = max((limit.omega for limit, _ in found if not limit.undamped), default=0.0)
            finer = driven.resolving_waves_at(highest)
            if finer is driven:
                break
            again = zip(found, finer.gains.single_limits(gain), strict=True)
            found = [pair if driven.resolves(pair[0].omega) else (limit, finer) for pair, limit in again]
            driven = finer
        return found

    @property
    def single_limits(self):
        """Name of each measured coordinate -> factor by which its gain alone may grow, see `StableGains`: dict."""
        limits = (limit.factor for limit, _ in self._single_limits_and_cables)
        return dict(zip(self._closed_loop.body.measured, limits, strict=True))

    @property
    def errors_of_single_limits(self):
        """Relative error of each of `single_limits`; NaN where it is not known: list. [-]

        It is not where modes that such a gain could drive may not have been looked at.
        """
        gain = self._closed_loop.loop.gain
        return [
            driven.errors.of_single_limit(limit, gain, coordinate) if limit.factor * gain <= driven.gain else np.nan
            for coordinate, (limit, driven) in enumerate(self._single_limits_and_cables)
        ]

    @cached_property
    def stable(self):
        """True if no motion grows, with the winches at rest and with the loop."""
        if self._closed_loop.unstable_open_pole is not None:
            return False
        loop = self._closed_loop.loop
        if loop is None or not loop.gain or self.seen_far_from_unstable:
            return True
        return self.driven.stable(loop.gain)

    @cached_property
    def error_of_decay(self):
        """Relative error of the variance of the motion that would grow first, with nearly the largest gain; else 0. [-]

        Its variance is proportional to 1/d with the decay d of its pole. With the largest gain, which is that with all
        modes of the cables, d is zero; what the model has there instead is the error of d.
        """
        loop = self._closed_loop.loop
        if loop.law.delay or self.seen_far_from_unstable:
            return 0.0
        limit = self.driven.limit
        if limit is None or loop.gain < MOTION.hardly_damped_gain * limit.factor:
            return 0.0
        at_gain, at_limit = (
            poles[np.argmin(np.abs(poles - 1j * limit.omega))] for poles in (loop.poles, loop.poles_with(limit.factor))
        )
        return float(abs(at_limit.real / at_gain.real))

    @property
    def seen_far_from_unstable(self):
        """`_far_from_unstable`, or False where the largest gain is known already."""
        return LoopStability.driven.known(self) is None and self._far_from_unstable

    @property
    def needs_largest_gain(self):
        """True if the search for the largest gain tells whether the loop is stable, or which gain it has."""
        gain = law_from(self._closed_loop.scene.control)[1]
        return gain != 0 and LoopStability._far_from_unstable.known(self) is False

    @computed_together
    def _far_from_unstable(loops):
        """True if the loop is stable, and its gain not nearly the largest one; where this is seen with little work.

        That spares the search for the largest gain. It is left to that search where the gain follows from it, and where
        the law has a delay. What cannot be seen by the poles of the model is computed for many loops together.
        """
        undecided, effects = {}, known(loops, "effects")
        DrivingBounds.responses.compute(effects.values())
        bounded = [own for one, own in effects.items() if one._closed_loop.plant.model is None]
        DrivingBounds.driving_gain.compute(bounded)  # of stated elements all modes are looked at
        for one in loops:
            law, gain = law_from(one._closed_loop.scene.control)
            if not gain or law.delay:
                yield one, False
                continue
            higher_gain = gain / MOTION.nearly_largest_gain
            seen = outcome_of(partial(one._poles_decay_up_to, higher_gain))
            if seen is False:
                undecided[one] = higher_gain
            else:
                yield one, seen
        DrivingBounds.driving_gain.compute(known(undecided, "effects").values())
        trials = {one: outcome_of(partial(one._driven_cables_of, gain)) for one, gain in undecided.items()}
        _solve_trials(dict.fromkeys(without_errors(trials).values()))
        yield from ((one, one._stable_up_to(gain)) for one, gain in undecided.items())

    def _poles_decay_up_to(self, gain):
        """True if all poles of the model decay, with a gain [rad/s] and with that of the loop, and no other mode grows.

        No mode of the cables above those of the model could be driven by the gain (`DrivingBounds`).
        """
        loop = self._closed_loop.untuned_loop
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
        closed_loop, effects, modes = self._closed_loop, self.effects, self._closed_loop.modes
        elements, have_all_modes = modes.models.elements, closed_loop.plant.model is not None
        have_all_modes &= modes.models.complete
        resolved = np.inf if have_all_modes else modes.with_all_modes.omega[-1]
        if resolved < np.inf and effects.driven_up_to(gain).max(initial=0.0) > resolved:
            return False
        fixed = np.sort(np.concatenate([element.omega for element in elements]))
        lowest = fixed[: max(len(modes) - len(closed_loop.layout.free), 0)].max(initial=0.0)
        driven = effects.may_drive(elements, gain)
        return not any(
            (of_cable & (element.omega >= lowest)).any() for of_cable, element in zip(driven, elements, strict=True)
        )
