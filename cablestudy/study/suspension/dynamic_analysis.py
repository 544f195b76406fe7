"""A suspension in the wind and under control, with as many modes as the accuracy of its results needs."""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial

import numpy as np

from cablestudy.cable.damping import any_grows_with_modes
from cablestudy.cable.steady_drag import concatenate
from cablestudy.control.law import law_from
from cablestudy.control.margins import Margins
from cablestudy.errors import outcome_of, result_of, without_errors
from cablestudy.scene.words import counted
from cablestudy.study.column import relative
from cablestudy.study.notes import unknown_rms_error
from cablestudy.study.suspension.closed_loop import ClosedLoop
from cablestudy.study.suspension.gust_response import GustResponse
from cablestudy.study.suspension.model_search import closed_loops_of, search_models, stable_without_loop
from cablestudy.study.suspension.plant import Plant
from cablestudy.study.suspension.turbulence import OWN
from cablestudy.study.tolerances import STUDY
from cablestudy.system.coupled_modes import coupled_modes, coupled_modes_of_cases, shaping_modes
from cablestudy.system.together import computed_together
from cablestudy.wind.peak import peak_factor


@dataclass(eq=False)
class DynamicAnalysis:
    """One case of a study in motion: modes, loop and response to the wind, with as many modes as the accuracy needs.

    Attributes
    ----------
    scene : SuspensionScene
    without_wind : Equilibrium
        Equilibrium without wind.
    equilibrium : Equilibrium
        Equilibrium in the mean wind, or in the steady wind of its load case.
    airflow : Airflow or None
        None without turbulent wind.
    model : FixedModel or None
        Exact choice of elements; None where the scene states an accuracy.
    plants_and_loops : dict
        `Plant` and `ClosedLoop` by keys, to be filled; cases of this equilibrium whose winds damp it alike share it.
    cables : Cables, optional
        Cables of this equilibrium, with damping.
    modes : dict
        Number of modes -> `CoupledModes` of this equilibrium, or the error that says why there are none; to be filled,
        by `solve_modes` for many cases at once. The key (number, "shaped") is that of modes for mid-spans, `shaped` of
        `Search`. Cases of this equilibrium in other winds share the dict too.
    mean_drag : SteadyDrag, optional
        As of `Plant`.
    midspans, points : bool
        As of `Plant`: whether outputs have the mid-spans of cables; whether free points are as accurate as bodies.
    fewest_modes : int
        Least number of modes of a model.
    together : list of DynamicAnalysis
        Analyses of many rows whose numbers are computed in the same calls.
    """

    scene: object
    without_wind: object
    equilibrium: object
    airflow: object
    model: object
    plants_and_loops: dict
    cables: object = None
    modes: dict = field(default_factory=dict)
    mean_drag: object = None
    midspans: bool = False
    points: bool = False
    fewest_modes: int = 0

    def __post_init__(self):
        self._accuracy = self.scene.model.accuracy or STUDY.fixed_model_accuracy
        self.together = [self]

    def closed_loop_of(self, count, responses=False, among=0):
        """`ClosedLoop`, stable or not, with a number of modes; cases that agree in all that it depends on share it.

        Parameters
        ----------
        count : int
            Number of modes.
        responses : bool
            Whether static responses to the inertia and damping of moving bodies are coordinates too, see `Plant`.
        among : int
            Number of modes that are computed, if it is larger: `count` of them, the lowest, are taken.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There are no modes to the accuracy.
        """
        scene, (winches, control), shared = self.scene, self._keys, self.plants_and_loops
        computed, loops = max(count, among), shared.setdefault(winches, {})
        # each level of keys adds what the next object depends on: plant, plant in a wind, loop, loop in this wind
        plant_key = count, computed, responses, winches, self.midspans, self.points
        if plant_key not in shared:
            modes = self._modes_of(computed).first(count)
            arguments = scene, self.equilibrium, self.airflow, modes, self._accuracy, self.model
            others = {"midspans": self.midspans, "points": self.points, "mean_drag": self.mean_drag}
            shared[plant_key] = Plant(*arguments, loops=loops, responses=responses, **others)
        plant_in_wind_key = *plant_key, self.airflow and self.airflow.side
        if plant_in_wind_key not in shared:
            shared[plant_in_wind_key] = shared[plant_key].with_airflow(self.airflow)
        loop_key, closed_loop_key = (*plant_key, control), (*plant_in_wind_key, control)
        if loop_key not in shared:
            shared[loop_key] = ClosedLoop(scene, shared[plant_in_wind_key])
        if closed_loop_key not in shared:
            shared[closed_loop_key] = shared[loop_key].with_plant(shared[plant_in_wind_key])
        return shared[closed_loop_key]

    @cached_property
    def _keys(self):
        """Texts of the winches and actuators, and of the control, for the keys of plants and loops that cases share."""
        return repr((self.scene.winches, self.scene.actuators)), repr(self.scene.control)

    def _modes_of(self, count):
        """`CoupledModes`, the lowest `count` of them with damping; raises as `closed_loop_of`."""
        if count not in self.modes:
            self.modes[count] = self._coupled_modes(count)
        modes = result_of(self.modes[count])
        if not self.midspans or self.model is not None:
            return modes
        if modes.fewest_modes_of_cable >= modes.solution.models.cables.across * shaping_modes(self._accuracy):
            return modes
        if (count, "shaped") not in self.modes:
            self.modes[count, "shaped"] = self._coupled_modes(count, shaped=True)
        return self.modes[count, "shaped"]

    def _coupled_modes(self, count, shaped=False):
        """`CoupledModes` with damping; `shaped` as of `Search`. Raises as `closed_loop_of`."""
        damping = [cable.damping for cable in self.scene.cables.values()]
        arguments = self.equilibrium, count, self._accuracy, damping, self.model, self.cables
        return coupled_modes(*arguments, damped=True, shaped=shaped).damped

    @property
    def first_model(self):
        """Key of the model that is tried first: rows whose keys are equal have their modes computed together.

        Number of modes, accuracy, planes of the motion of the cables, and elements without their drag, or None.
        """
        drag, planes = self.model and self.model.drag, self.cables and self.cables.planes
        elements = self.model and replace(self.model, drag=drag and (drag.profile is None,))
        return self._computed_modes(self._model_sizes[0]), self._accuracy, planes, elements

    def _computed_modes(self, count):
        """Number of modes that are computed for a model of `count`: enough for meshes that serve the loop too."""
        return max(count, min(self._count_for_cables(STUDY.few_modes), self._usual_counts[0]))

    def _count_for_cables(self, numbers):
        """Number of modes of the whole: `numbers` are a constant and a number for each cable."""
        return numbers[0] + numbers[1] * len(self.scene.cables)

    def lowest_modes(self, count):
        """At least `count` `CoupledModes`, or all; those of the model that is tried first, if it has so many.

        Raises
        ------
        NoSolutionError, ConvergenceError
            As `closed_loop_of`.
        """
        return self._modes_of(self._computed_modes(max(count, self._model_sizes[0])))

    @cached_property
    def sizes_to_try(self):
        """Numbers of modes of the models that are tried, from the fewest on with which notch frequencies are known.

        Fewer than the usual ones only where they have nearly all of the compliance of the bodies.
        """
        for count in (*self._model_sizes, *(STUDY.more_modes if self.model is None else ())):
            closed_loop = self.closed_loop_with(count)
            enough = count >= self._usual_counts[0] or closed_loop.plant.lacked_compliance < STUDY.lacked_compliance
            if (enough and closed_loop.body.notch_frequencies_known) or len(closed_loop.modes) < count:
                break
        return tuple(size for size in self._model_sizes if size >= count) or (count,)

    @cached_property
    def _model_sizes(self):
        """Numbers of modes of models, ascending, from the fewest that may do.

        Small models come first where cables are few and few modes are excited: by wind on free bodies alone, and a loop
        that only integrates. Modal damping, unless of an exact choice of elements, depends on the number of modes: it
        is then one of the usual numbers.
        """
        scene, usual, exact = self.scene, self._usual_counts, self.model is not None
        all_excited = self.airflow is not None and self.airflow.on_cables
        all_excited |= scene.control is not None and not law_from(scene.control)[0].integrates_only
        small = map(self._count_for_cables, (STUDY.few_modes,) if exact else (STUDY.fewest_modes, STUDY.few_modes))
        small = [count for count in small if count < usual[0]]
        count_matters = self._modal_damping_counts and not exact
        if not small or all_excited or count_matters or not self.equilibrium.suspension.free.any():
            return tuple(count for count in usual if count >= self.fewest_modes) or (self.fewest_modes,)
        return *small, *usual

    @property
    def _usual_counts(self):
        """Numbers of modes of models of many cables, or of cables of which all modes are excited: ascending."""
        if self.model is not None:
            return (STUDY.element_modes,)
        if self.cables is not None and self.cables.planes:
            return STUDY.plane_model_modes
        return STUDY.model_modes if self._modal_damping_counts else (*STUDY.model_modes, STUDY.more_modes[0])

    def closed_loop_with(self, count):
        """`closed_loop_of` a number of modes that is tried; where those left out matter they have responses."""
        responses = count < self._usual_counts[0] or self._models_compared or self._lacks_motion_of_bodies(count)
        return self.closed_loop_of(count, responses, self._computed_modes(count))

    def _lacks_motion_of_bodies(self, count):
        """True if modes, `count` of them, lack much of the static compliance of a body: it moves in higher ones.

        Of a free point too, where its motion is asked for.
        """
        modes, suspension = self._modes_of(self._computed_modes(count)).first(count), self.equilibrium.suspension
        free = suspension.free if self.points else suspension.free[: suspension.bodies]
        shares = (modes.compliance_shares(*motion).sum() for motion in np.argwhere(free))
        return any(share < 1 - STUDY.lacked_motion for share in shares)

    @property
    def _models_compared(self):
        """True if models are compared with each other: those to an accuracy, of few cables and few excited modes."""
        return self.model is None and self._model_sizes[0] < self._usual_counts[0]

    @computed_together
    def _search_outcome(analyses):
        """`ClosedLoop` and response to the wind, or the error that says why there are none."""
        return search_models(analyses).items()

    def response_with(self, closed_loop, before):
        """`GustResponse` of a stable `ClosedLoop`, None without wind; `before` is that of the model tried before."""
        self._check(closed_loop)
        if self.airflow is None:
            return None
        # the change from the fewest modes to the next says little of the change after it
        compared = self._models_compared and len(closed_loop.modes) > self._computed_modes(0)
        return GustResponse(closed_loop, self.scene, before if compared else None, self._least_error(closed_loop))

    def _least_error(self, closed_loop):
        """Relative error of an RMS that is stated at least, infinite where none is known.

        Found on random scenes: larger for the smallest model.
        """
        if not self._error_known:
            return np.inf
        modes = len(closed_loop.modes)
        fewest = modes == self._model_sizes[0] < self._computed_modes(modes)
        return (STUDY.resolved_by_fewest if fewest else STUDY.resolved) * self._accuracy

    def with_critical_modes(self, closed_loop, response):
        """`ClosedLoop`, see `with_critical_modes` there, and its `GustResponse` or None."""
        if closed_loop.loop is not None and closed_loop.with_critical_modes is not closed_loop:
            closed_loop = closed_loop.with_critical_modes
            response = response and GustResponse(closed_loop, self.scene, least=self._least_error(closed_loop))
        return closed_loop, response

    def modes_suffice(self, response):
        """True if the RMS of bodies in a `GustResponse` are accurate, by the modes left out and by quadrature."""
        accuracy, by_quadrature = self._accuracy, response.integration_error / 2
        allowed = STUDY.element_modes_change if self.model else max(accuracy - by_quadrature, accuracy / 2)
        return response.displacement_truncation_error <= 2 * allowed  # of a variance, which is twice that of its root

    def _check(self, closed_loop):
        """Refuse an unstable `ClosedLoop`: NoSolutionError that names the growing motion."""
        closed_loop.check_open()
        if not closed_loop.stable:
            self.closed_loop_with(self._usual_counts[0]).check_stable()
            closed_loop.check_stable()

    @property
    def _modal_damping_counts(self):
        """True if damping is modal, so that it grows with the number of modes, and the ends of some cable move."""
        ends_move = self.equilibrium.suspension.free.any() or bool(self.scene.winches)
        return ends_move and any_grows_with_modes(self.scene.cables.values())

    @property
    def modal_damping_note(self):
        """Text of a note where modal damping leaves the error of the RMS unknown; else empty; raises as `response`."""
        if self.model is not None or not self._modal_damping_counts:
            return ""
        return unknown_rms_error(counted(len(self.closed_loop.modes), "mode"))

    @property
    def _error_known(self):
        """True if errors of RMS are known: not for an exact choice of elements, nor with modal damping."""
        return self.model is None and not self._modal_damping_counts

    @property
    def solved(self):
        """True if the motion was computed, that of an unstable loop with its winches at rest too."""
        outcomes = DynamicAnalysis._search_outcome.known(self), DynamicAnalysis._controlled_outcome.known(self)
        at_rest = DynamicAnalysis._without_control.known(self)
        found = any(not isinstance(outcome, Exception | None) for outcome in outcomes)
        return found or (at_rest is not None and at_rest.solved)

    @property
    def _loop_and_response(self):
        """`closed_loop` and `response`; raises as `response`."""
        return result_of(self._search_outcome)

    @property
    def closed_loop(self):
        """`ClosedLoop`; raises as `response`."""
        return self._loop_and_response[0]

    @property
    def described(self):
        """`closed_loop`, or of an unstable loop, or where no response was asked for, `controlled`; raises as that."""
        outcome = DynamicAnalysis._search_outcome.known(self)
        return self.controlled if isinstance(outcome, Exception | None) else self.closed_loop

    @property
    def response(self):
        """`GustResponse` to the wind.

        Raises
        ------
        NoSolutionError, ConvergenceError
            What moves is unstable, or the variances cannot be had.
        """
        return self._loop_and_response[1]

    @computed_together
    def _controlled_outcome(analyses):
        """`controlled`, or the error that says why there is none."""
        sizes = {analysis: outcome_of(lambda a=analysis: a.sizes_to_try) for analysis in analyses}
        for analysis, closed_loop in closed_loops_of(sizes).items():
            yield analysis, outcome_of(partial(stable_without_loop, closed_loop))

    @property
    def controlled(self):
        """`ClosedLoop` with the fewest modes, for numbers of the loop: its loop gain has all modes of the cables.

        With the loop it may be unstable.

        Raises
        ------
        NoSolutionError, ConvergenceError
            It is unstable with the winches at rest, or there are no modes to the accuracy.
        """
        return result_of(self._controlled_outcome)

    @computed_together
    def _limits_begun(analyses):
        """True: the search for the largest gain has begun, if there is a loop."""
        outcomes = [analysis._controlled_outcome for analysis in analyses if analysis.scene.control is not None]
        ClosedLoop.driven_outcome.compute(one for one in outcomes if isinstance(one, ClosedLoop))
        return dict.fromkeys(analyses, True).items()

    @property
    def _with_limits(self):
        """`controlled` for its largest gain, whose search begins in one call for many rows; raises as `controlled`."""
        _ = self._limits_begun
        return self.controlled

    @computed_together
    def _margins_begun(analyses):
        """True: the `Margins` of the loops that are stable were searched, in one call for many rows."""
        controlled = [analysis for analysis in analyses if analysis.scene.control is not None]
        found = without_errors({analysis: outcome_of(lambda a=analysis: a._margins) for analysis in controlled})
        margins = list(found.values())
        for search in (Margins.crossovers, Margins.peaks, Margins.bandwidth):
            search.compute(margins)
        return dict.fromkeys(analyses, True).items()

    @property
    def _margins(self):
        """`Margins` of the loop; raises as `check_stable`."""
        _ = self._with_limits.driven  # which then decides on stability too
        self.check_stable()
        return self.controlled.margins

    def check_stable(self):
        """Refuse an unstable loop: NoSolutionError; raises as `controlled` too."""
        self._check(self.controlled)

    @property
    def at_rest(self):
        """`DynamicAnalysis` with the winches at rest: it shares the modes and plants, and has as many modes."""
        return self if self.scene.control is None else self._without_control

    @computed_together
    def _without_control(analyses):
        """`DynamicAnalysis` of the same scene without control, winches at rest; those of many are computed together.

        Without what a telescope sees: no column shows it with the winches at rest, and no model has modes for it.
        """
        controlled = [analysis for analysis in analyses if analysis.scene.control]
        others = [analysis._with_scene(control=None, exposure=None, correction=None) for analysis in controlled]
        for analysis, other in zip(controlled, others, strict=True):
            other._model_sizes, counts = analysis._model_sizes, outcome_of(lambda a=analysis: a.sizes_to_try)
            if not isinstance(counts, Exception):  # a loop that cannot be had has none
                other.sizes_to_try = counts
            other.together = others
            yield analysis, other

    @cached_property
    def finer(self):
        """`DynamicAnalysis` of a bare cable with the next larger number of modes; None where there is no larger one."""
        sizes, count = sorted({*self._usual_counts, STUDY.more_modes[0]}), len(self.closed_loop.modes)
        if self.model is not None or count not in sizes[:-1]:
            return None
        return self._with(fewest_modes=sizes[sizes.index(count) + 1])

    @cached_property
    def with_midspans(self):
        """`DynamicAnalysis` whose outputs have the mid-spans of the cables."""
        return self._with(midspans=True)

    @computed_together
    def with_points(analyses):
        """`DynamicAnalysis` with the motion of free points as accurate as that of bodies; its plants differ by that."""
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
        """Estimated relative errors of the largest gain and of its frequency, by models and by the mean drag. [-]"""
        driven = self._with_limits.driven
        return tuple(np.add(driven.errors, driven.drag_errors).tolist())

    def margin(self, name):
        """A number of `Margins` by its name, and its estimated relative error by the models of the cables."""
        _ = self._margins_begun
        margin, perturbed = getattr(self._margins, name), self.controlled.perturbed_margins
        if not perturbed:
            return margin, np.nan
        error = STUDY.margin_safety * sum(relative(margin, getattr(margins, name)) for margins in perturbed)
        return margin, error + self.controlled.simplification_error

    @property
    def gain(self):
        """Gain of the loop [rad/s], and its estimated relative error: 0 of one that the scene states."""
        if isinstance(self.scene.control.gain, int | float):
            return self.controlled.loop.gain, 0.0
        gain = self._with_limits.loop.gain
        return gain, max(self._limit_errors[0], self.margin("sensitivity_peak")[1])

    @property
    def largest_gain(self):
        """Gain below which the loop is stable [rad/s], None where there is none; and its estimated relative error."""
        return self._with_limits.largest_gain, self._limit_errors[0]

    @property
    def gain_margin(self):
        """Largest over stated gain [dB], None where there is no limit; and its estimated relative error."""
        gain = self.controlled.loop.gain
        limit = self._with_limits.largest_gain if gain else None
        if not limit:
            return None, self._limit_errors[0] if gain else 0.0
        margin, error = float(20 * np.log10(limit / gain)), self._limit_errors[0]
        return margin, 20 * np.log10(1 + error) / abs(margin) if margin else error

    @property
    def phase_crossover(self):
        """Frequency of the pole that the largest gain puts on the axis [Hz], None without limit; its relative error."""
        gain = self.controlled.loop.gain
        limit = self._with_limits.limit if gain else None
        if limit is None:
            return None, self._limit_errors[0] if gain else 0.0
        return limit.omega / (2 * np.pi), self._limit_errors[1]

    def response_of(self, open_loop):
        """`GustResponse` with the winches at rest, or with the loop; raises as `response`."""
        return (self.at_rest if open_loop else self).response

    def rms(self, names, variance, open_loop):
        """RMS of some outputs together, the root of the sum of their variances, and its estimated relative error.

        `names` are names of outputs, those that the model lacks left out; `variance` one of `Variances.weighted`, such
        as "value" or "rate". The error is 0 of outputs that are held; it is not a number for an exact choice of
        elements, whose own error is not known, nor with modal damping.
        """
        response, variances, names, total = self._variance_of(names, variance, open_loop)
        if not total > 0:
            return np.sqrt(total), 0.0 if self.model is None else np.nan
        error, accuracy = variances.error_of(variance, names) / (2 * total), self._accuracy
        # of what a telescope sees, which hangs on high modes, the highest ones say less if they do not suffice
        highest = np.inf if variance not in OWN and error > accuracy else accuracy
        error = max(error, min(STUDY.one_model_safety * error, highest), self._least_error(response.closed_loop))
        return np.sqrt(total), error if self._error_known else np.nan

    def _variance_of(self, names, variance, open_loop):
        """Sum of the variances of some outputs, as for `rms`, with the `GustResponse` and `Variances` that it is of.

        Returns
        -------
        response : GustResponse
        variances : Variances
        names : list of str
            Those outputs that the model has.
        total : float
        """
        response = self.response_of(open_loop)
        variances = response.variances if variance in OWN else response.seen
        names = [name for name in names if name in variances.rows]
        response.check_damped(names)
        rows = [variances.rows[name] for name in names]
        return response, variances, names, variances.weighted[variance][rows].sum()

    def largest_rms(self, names, variance="value", open_loop=False):
        """Largest RMS of some outputs, each by itself, and its estimated relative error, see `rms`."""
        return max((self.rms([name], variance, open_loop) for name in names), key=lambda value: value[0])

    def peak(self, names, mean, crossings=0.0, mean_error=0.0):
        """Largest size that some outputs are expected to reach in the wind, |mean| + g RMS, and its relative error.

        Parameters
        ----------
        names : sequence of str
            Names of the outputs, whose RMS is that of all together.
        mean : float
            Their mean value, in their unit.
        crossings : float
            Least relative error of the rate at which the mean is crossed. [-]
        mean_error : float
            Relative error of the mean value. [-]

        Notes
        -----
        g is Davenport's peak factor of the rate of up-crossings, RMS of the velocity/(2 pi RMS of the displacement).
        """
        rms, error = self.rms(names, "value", open_loop=False)
        if not rms:
            return abs(mean), error + mean_error
        rms_rate, rate_error = self.rms(names, "rate", open_loop=False)
        change, error = self._expected_peak(rms, rms_rate / (2 * np.pi * rms), error, rate_error, crossings)
        peak = abs(mean) + change
        return peak, (error * change + mean_error * abs(mean)) / peak

    def peak_of_change(self, names):
        """Largest change from their mean that some outputs are expected to have in the wind, g RMS of `peak`.

        Its error, which costs much for tensions, is not computed.
        """
        rms, rms_rate = (np.sqrt(self._variance_of(names, variance, False)[-1]) for variance in ("value", "rate"))
        return peak_factor(rms_rate / (2 * np.pi * rms), self.scene.wind.duration) * rms if rms else rms

    @cached_property
    def winch_speeds(self):
        """Speeds of winches: largest RMS and largest peak expected in the wind, and the number of the winch of this.

        Returns
        -------
        rms, peak : tuple of 2 float
            Speed [m/s], and its estimated relative error [-].
        fastest : int
            Number of the winch from 0.

        Raises
        ------
        NoSolutionError, ConvergenceError
            As `response`.
        """
        if self.response.loop is None:
            return (0.0, 0.0), (0.0, 0.0), 0
        variances, errors = self.response.winch_speeds
        divisor = np.where(variances > 0, variances, 1.0)
        (rms, rms_rate), (error, rate_error) = np.sqrt(variances), errors / (2 * divisor)
        crossing_rate = rms_rate / (2 * np.pi * np.sqrt(divisor[0]))
        closed_loop = self.response.closed_loop
        highest = 2 * np.pi * closed_loop.modes.frequency[-1]
        # a notch passes motions above it larger than those of the body, up to its roll-off: those above the modes too
        more = any(notch and notch.rolloff_omega > highest for notch in closed_loop.loop.notches)
        crossings = STUDY.crossings if more else 0.0
        peaks, peak_errors = self._expected_peak(rms, crossing_rate, error, rate_error, crossings)
        largest, fastest = int(np.argmax(rms)), int(np.argmax(peaks))
        known = 0.0 if self._error_known else np.nan
        return (
            (float(rms[largest]), error[largest] + known),
            (float(peaks[fastest]), peak_errors[fastest] + known),
            fastest,
        )

    def _expected_peak(self, rms, crossing_rate, error, rate_error, crossings=0.0):
        """Davenport's peak factor times RMS, and its relative error by those of RMS and rate of crossings, arrays too.

        The error of the rate, by the one of the RMS of the derivative, counts as at least `crossings`. [-]
        """
        factor = peak_factor(crossing_rate, self.scene.wind.duration)
        larger_rate = crossing_rate * (1 + np.maximum(rate_error + error, crossings))
        return factor * rms, error + peak_factor(larger_rate, self.scene.wind.duration) / factor - 1

    def mean_displacement(self, name):
        """Displacement of a body, or of a marker BODY.MARKER, by the mean wind, winches at rest, shape (3,). [m]"""
        owner, _, marker = name.partition(".")
        if not self.scene.wind.mean and self.scene.load_case.wind is None:
            return np.zeros(3)
        body = self.without_wind.suspension.body_names.index(owner)
        arm = np.array(self.scene.bodies[owner].markers[marker] if marker else (0.0, 0.0, 0.0))
        before, after = self.without_wind, self.equilibrium
        by_rotation = (after.rotation[body] - before.rotation[body]) @ arm
        displacement = after.position[body] - before.position[body] + by_rotation
        return np.where(np.abs(displacement) > STUDY.mean_wind_rounding * before.longest, displacement, 0.0)

    def mean_tensions(self, name):
        """Tension at both ends of a cable in the mean wind, shape (2,). [N]"""
        cable = self.equilibrium.suspension.cable_names.index(name)
        return np.linalg.norm(self.equilibrium.end_forces[cable], axis=-1)


def solve_modes(analyses, equilibrium):
    """Compute the coupled modes that many analyses need first, all cases together, and keep them in each analysis.

    What these analyses need later is computed for all of them too, when one is asked for it. One computation for many
    cases of a study costs less than one for each. Cases whose first models have the same key
    (`DynamicAnalysis.first_model`) are computed together.

    Parameters
    ----------
    analyses : list of DynamicAnalysis
        Of n suspensions with equal names and connections; the dict of modes of each is filled.
    equilibrium : Equilibrium
        Equilibria of these suspensions, shape (n,).
    """
    for analysis in analyses:
        analysis.together = analyses
    indices_by_model = {}  # key of the first model -> {id of a dict of modes: index of one analysis that shares it}
    for index, analysis in enumerate(analyses):
        if analysis.first_model[0] not in analysis.modes:
            indices_by_model.setdefault(analysis.first_model, {})[id(analysis.modes)] = index
    for (count, accuracy, planes, elements), by_dict in indices_by_model.items():
        indices = list(by_dict.values())
        group, model = [analyses[index] for index in indices], elements
        damping = [cable.damping for analysis in group for cable in analysis.scene.cables.values()]
        if elements and elements.drag is not None:
            model = replace(elements, drag=concatenate([analysis.model.drag for analysis in group]))
        arguments = equilibrium.take(np.array(indices)), count, accuracy, damping, planes
        for analysis, modes in zip(group, coupled_modes_of_cases(*arguments, damped=True, model=model), strict=True):
            # the modes with damping, or the error that says why there are none
            result = modes if isinstance(modes, Exception) else outcome_of(lambda modes=modes: modes.damped)
            analysis.modes[count] = result
