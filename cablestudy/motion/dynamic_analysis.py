"""A suspension in the wind and under control, with as many modes as the accuracy of its results needs."""

from dataclasses import dataclass, fields
from functools import cached_property, partial

import numpy as np

from cablestudy.control.margins import Margins
from cablestudy.errors import known, outcome_of, outcomes
from cablestudy.motion.gust_response import GustResponse
from cablestudy.motion.loop_stability import LoopStability
from cablestudy.motion.model_search import closed_loops_of, search_models, stable_without_loop
from cablestudy.motion.motion_models import MotionModels
from cablestudy.motion.tolerances import MOTION
from cablestudy.motion.turbulence import VALUE_AND_RATE
from cablestudy.system.comparison import error_of_root, relative
from cablestudy.system.together import computed_together


@dataclass(eq=False)
class DynamicAnalysis(MotionModels):
    """One case of a study in motion: modes, loop and response to the wind, with as many modes as the accuracy needs.

    Its fields are those of `MotionModels`.

    Attributes
    ----------
    together : list of DynamicAnalysis
        Analyses of many rows whose numbers are computed in the same calls.
    """

    def __post_init__(self):
        self.together = [self]

    @computed_together
    def _loop_and_response(analyses):
        """`closed_loop` and `response`; raises as `response`."""
        return search_models(analyses).items()

    def response_with(self, closed_loop, before):
        """`GustResponse` of a stable `ClosedLoop`, None without wind; `before` is that of the model tried before."""
        self._check(closed_loop)
        if self.airflow is None:
            return None
        # the change from the fewest modes to the next says little of the change after it
        compared = self.sizes.compared and len(closed_loop.modes) > self.sizes.computed(0)
        least = self.sizes.least_error(closed_loop.modes)
        return GustResponse(self.in_wind(closed_loop), self.scene, before if compared else None, least)

    def with_critical_modes(self, closed_loop, response):
        """`ClosedLoop`, see `with_critical_modes` there, and its `GustResponse` or None."""
        if closed_loop.loop is not None and closed_loop.with_critical_modes is not closed_loop:
            closed_loop = closed_loop.with_critical_modes
            least = self.sizes.least_error(closed_loop.modes)
            response = response and GustResponse(self.in_wind(closed_loop), self.scene, least=least)
        return closed_loop, response

    def _check(self, closed_loop):
        """Refuse an unstable `ClosedLoop`: NoSolutionError that names the growing motion."""
        closed_loop.check_open()
        if not closed_loop.stability.stable:
            self.closed_loop_with(self.sizes.usual[0]).check_stable()
            closed_loop.check_stable()

    @property
    def solved(self):
        """True if the motion was computed, that of an unstable loop with its winches at rest too."""
        outcomes = DynamicAnalysis._loop_and_response.known(self), DynamicAnalysis.loop_for_margins.known(self)
        at_rest = DynamicAnalysis._without_control.known(self)
        found = any(not isinstance(outcome, Exception | None) for outcome in outcomes)
        return found or (at_rest is not None and at_rest.solved)

    @property
    def closed_loop(self):
        """`ClosedLoop`; raises as `response`."""
        return self._loop_and_response[0]

    @property
    def loop_for_notes(self):
        """The `ClosedLoop` that notes describe: `closed_loop` if its response was computed, else `loop_for_margins`."""
        outcome = DynamicAnalysis._loop_and_response.known(self)
        return self.loop_for_margins if isinstance(outcome, Exception | None) else self.closed_loop

    @property
    def response(self):
        """`GustResponse` to the wind.

        Raises
        ------
        NoSolutionError, ConvergenceError
            What moves is unstable, or the variances cannot be computed.
        """
        return self._loop_and_response[1]

    @computed_together
    def loop_for_margins(analyses):
        """`ClosedLoop` with the fewest modes, for numbers of the loop: its loop gain has all modes of the cables.

        With the loop it may be unstable.

        Raises
        ------
        NoSolutionError, ConvergenceError
            It is unstable with the winches at rest, or there are no modes to the accuracy.
        """
        sizes = outcomes(analyses, "sizes_to_try")
        for analysis, closed_loop in closed_loops_of(sizes).items():
            yield analysis, outcome_of(partial(stable_without_loop, closed_loop))

    @computed_together
    def _limits_begun(analyses):
        """True: the search for the largest gain has begun, if there is a loop."""
        loops = known(_controlled(analyses), "loop_for_margins")
        LoopStability.driven.compute([one.stability for one in loops.values()])
        return dict.fromkeys(analyses, True).items()

    @property
    def _with_limits(self):
        """`loop_for_margins` for its largest gain, whose search begins in one call for many rows; raises as that."""
        _ = self._limits_begun
        return self.loop_for_margins

    @computed_together
    def _margins_begun(analyses):
        """True: the `Margins` of the loops that are stable were searched, in one call for many rows."""
        margins = known(_controlled(analyses), "_margins")
        for search in (Margins.crossovers, Margins.peaks, Margins.bandwidth):
            search.compute(margins.values())
        return dict.fromkeys(analyses, True).items()

    @property
    def _margins(self):
        """`Margins` of the loop; raises as `check_stable`."""
        _ = self._with_limits.stability.driven  # which then decides on stability too
        self.check_stable()
        return self.loop_for_margins.stability.margins

    def check_stable(self):
        """Refuse an unstable loop: NoSolutionError; raises as `loop_for_margins` too."""
        self._check(self.loop_for_margins)

    @property
    def at_rest(self):
        """`DynamicAnalysis` with the winches at rest: it shares the modes and plants, and has as many modes."""
        return self if self.scene.control is None else self._without_control

    @computed_together
    def _without_control(analyses):
        """`DynamicAnalysis` of the same scene without control, winches at rest; those of many are computed together.

        Without what a telescope sees: no column shows it with the winches at rest, and no model has modes for it.
        """
        controlled = _controlled(analyses)
        others = [analysis._with_scene(control=None, exposure=None, correction=None) for analysis in controlled]
        for analysis, other in zip(controlled, others, strict=True):
            other.sizes, counts = analysis.sizes, outcome_of(lambda a=analysis: a.sizes_to_try)
            if not isinstance(counts, Exception):  # a loop that cannot be computed has none
                other.sizes_to_try = counts
            other.together = others
            yield analysis, other

    @cached_property
    def finer(self):
        """`DynamicAnalysis` of a bare cable with the next larger number of modes; None where there is no larger one."""
        sizes, count = sorted({*self.sizes.usual, MOTION.more_modes[0]}), len(self.closed_loop.modes)
        if self.model is not None or count not in sizes[:-1]:
            return None
        return self._with(fewest_modes=sizes[sizes.index(count) + 1])

    @cached_property
    def with_midspans(self):
        """`DynamicAnalysis` whose outputs have the mid-spans of the cables."""
        return self._with(midspans=True)

    @computed_together
    def with_points(analyses):
        """`DynamicAnalysis` with the motion of free points as accurate as that of bodies; it has plants of its own."""
        others = [analysis._with(points=True) for analysis in analyses]
        for analysis, other in zip(analyses, others, strict=True):
            other.together = others
            yield analysis, other

    @property
    def without_actuators(self):
        """`DynamicAnalysis` without actuators, which shares what does not depend on them."""
        return self._with_scene(actuators={})

    def _with_scene(self, **update):
        """`DynamicAnalysis` of the scene with some keys changed that the equilibrium does not depend on."""
        return self._with(scene=self.scene.model_copy(update=update))

    def _with(self, **changes):
        """`DynamicAnalysis`, of a subclass too, with some attributes changed; it shares the dicts that are filled."""
        return DynamicAnalysis(**{one.name: getattr(self, one.name) for one in fields(DynamicAnalysis)} | changes)

    @property
    def _limit_errors(self):
        """Estimated relative errors of the largest gain and of its frequency. [-]"""
        return self._with_limits.stability.driven.errors.of_limit

    def margin(self, name):
        """A number of `Margins` by its name, and its estimated relative error due to the models of the cables."""
        _ = self._margins_begun
        margin, perturbed = getattr(self._margins, name), self.loop_for_margins.stability.perturbed_margins
        if not perturbed:
            return margin, np.nan
        error = MOTION.margin_safety * sum(relative(margin, getattr(margins, name)) for margins in perturbed)
        return margin, error + self.loop_for_margins.stability.least_margin_error

    @property
    def gain(self):
        """Gain of the loop [rad/s], and its estimated relative error: 0 of one that the scene states."""
        if isinstance(self.scene.control.gain, int | float):
            return self.loop_for_margins.loop.gain, 0.0
        gain = self._with_limits.loop.gain
        return gain, max(self._limit_errors[0], self.margin("sensitivity_peak")[1])

    @property
    def largest_gain(self):
        """Gain below which the loop is stable [rad/s], None where there is none; and its estimated relative error."""
        limit = self._with_limits.stability.limit
        return limit and limit.factor, self._limit_errors[0]

    @property
    def gain_margin(self):
        """Largest over stated gain [dB], None where there is no limit; and its estimated relative error."""
        gain = self.loop_for_margins.loop.gain
        limit = self._with_limits.stability.limit if gain else None
        if limit is None:
            return None, self._limit_errors[0] if gain else 0.0
        margin, error = float(20 * np.log10(limit.factor / gain)), self._limit_errors[0]
        return margin, 20 * np.log10(1 + error) / abs(margin) if margin else error

    @property
    def phase_crossover(self):
        """Frequency of the pole that the largest gain puts on the axis [Hz], None without limit; its relative error."""
        gain = self.loop_for_margins.loop.gain
        limit = self._with_limits.stability.limit if gain else None
        if limit is None:
            return None, self._limit_errors[0] if gain else 0.0
        return limit.omega / (2 * np.pi), self._limit_errors[1]

    def response_of(self, open_loop):
        """`GustResponse` with the winches at rest, or with the loop; raises as `response`."""
        return (self.at_rest if open_loop else self).response

    def rms(self, names, variance, open_loop):
        """RMS of some outputs together, the root of the sum of their variances, and its estimated relative error.

        Parameters
        ----------
        names : sequence of str
            Names of outputs; those that the model lacks are left out.
        variance : str
            One of `Variances.weighted`, such as "value" or "rate".
        open_loop : bool
            True with the winches at rest.

        Returns
        -------
        rms : float
            In SI.
        error : float
            Zero of outputs that are held. Not a number for stated elements, whose own error is not known, nor with
            modal damping. [-]
        """
        response, variances, names = self._variances_of(names, variance, open_loop)
        total = variances.sum_of(variance, names)
        if not total > 0:
            return np.sqrt(total), 0.0 if self.model is None else np.nan
        if not self.sizes.error_known:
            return np.sqrt(total), np.nan
        own_error, modes = error_of_root(variances.error_of(variance, names) / total), response.closed_loop.modes
        return np.sqrt(total), self._with_safety(own_error, modes, of_motion=variance in VALUE_AND_RATE)

    def _with_safety(self, error, modes, of_motion):
        """Relative error of an RMS that is stated, from that estimated from one model with some `CoupledModes`. [-]

        It is taken `MOTION.one_model_safety` times, but not above the accuracy by that alone. Of what a telescope sees,
        which depends on high modes, the highest ones say less if they do not suffice: no such bound then.
        """
        accuracy = self.sizes.accuracy
        most = accuracy if of_motion or error <= accuracy else np.inf
        return max(error, min(MOTION.one_model_safety * error, most), self.sizes.least_error(modes))

    def sum_of_variances(self, names, variance):
        """Sum of the variances of some outputs with the loop; arguments are those of `rms`."""
        _, variances, names = self._variances_of(names, variance, open_loop=False)
        return variances.sum_of(variance, names)

    def _variances_of(self, names, variance, open_loop):
        """`GustResponse`, its `Variances`, and those of some names that the model has; arguments are those of `rms`."""
        response = self.response_of(open_loop)
        variances = response.variances if variance in VALUE_AND_RATE else response.in_images
        names = [name for name in names if name in variances.rows]
        response.check_damped(names)
        return response, variances, names

    def largest_rms(self, names, variance="value", open_loop=False):
        """Largest RMS of some outputs, each by itself, and its estimated relative error, see `rms`."""
        return max((self.rms([name], variance, open_loop) for name in names), key=lambda value: value[0])

    def mean_tensions(self, name):
        """Tension at both ends of a cable in the mean wind, shape (2,). [N]"""
        cable = self.equilibrium.suspension.cable_names.index(name)
        return np.linalg.norm(self.equilibrium.end_forces[cable], axis=-1)


def _controlled(analyses):
    """Those of some analyses that have a loop: list."""
    return [analysis for analysis in analyses if analysis.scene.control is not None]
