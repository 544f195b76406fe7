"""A suspension in the wind and under control: with as many modes as its numbers need."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.activity import doing
from cablestudy.cable.steady_drag import concatenate
from cablestudy.control.law import law_from
from cablestudy.errors import outcome_of, result_of
from cablestudy.scene.words import counted
from cablestudy.study.columns import relative
from cablestudy.study.notes import unknown_rms_error
from cablestudy.study.suspension.closed_loop import ClosedLoop
from cablestudy.study.suspension.gust_response import GustResponse
from cablestudy.study.suspension.plant import Plant
from cablestudy.study.suspension.turbulence import OWN
from cablestudy.study.tolerances import STUDY
from cablestudy.system.coupled_modes import coupled_modes, coupled_modes_of_cases
from cablestudy.system.superelement import any_grows_with_modes
from cablestudy.wind.peak import peak_factor


class DynamicAnalysis:
    """One case.

    Parameters
    ----------
    scene : SuspensionScene
    without_wind : Equilibrium
        Without wind.
    equilibrium : Equilibrium
        In the mean wind, or in the steady wind of its load case.
    airflow : Airflow or None
    model : FixedModel or None
    known : dict
        Plants and loops shared by the cases of this equilibrium whose winds damp it alike: it is filled.
    cables : Cables, optional
        Of this equilibrium, with damping.
    modes : dict, optional
        `CoupledModes` of this equilibrium, or why there are none, by their number, which cases in other winds share
        too: it is filled, by `solve_modes` with those of many cases.
    """

    def __init__(self, scene, without_wind, equilibrium, airflow, model, known, cables=None, modes=None):
        self.scene, self.airflow, self._model = scene, airflow, model
        self._without_wind, self._equilibrium = without_wind, equilibrium
        self._known, self._cables, self._modes = known, cables, {} if modes is None else modes
        self._accuracy, self._midspans, self._least = scene.model.accuracy or STUDY.fixed_model_accuracy, False, 0

    def closed_loop_of(self, count, responses=False, among=0):
        """`ClosedLoop` with a number of modes, which may be unstable; computed once for the cases that share it.

        Parameters
        ----------
        count : int
        responses : bool
            See `Plant`.
        among : int
            How many modes are computed, if more: these are the lowest of them.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There are no modes to the accuracy.
        """
        scene, (winches, control) = self.scene, self._keys
        computed, loops = max(count, among), self._known.setdefault(winches, {})
        plant_key = count, computed, responses, winches, self._midspans
        if plant_key not in self._known:
            modes = self._modes_of(computed).first(count)
            arguments = scene, self._equilibrium, self.airflow, modes, self._accuracy, self._model
            self._known[plant_key] = Plant(*arguments, loops=loops, responses=responses, midspans=self._midspans)
        plant_in_wind_key = *plant_key, self.airflow and self.airflow.side
        if plant_in_wind_key not in self._known:
            self._known[plant_in_wind_key] = self._known[plant_key].blown_by(self.airflow)
        closed_loop_key = *plant_in_wind_key, control
        if closed_loop_key not in self._known:
            self._known[closed_loop_key] = ClosedLoop(scene, self._known[plant_in_wind_key])
        return self._known[closed_loop_key]

    @cached_property
    def _keys(self):
        """Texts that stand for the winches and actuators, and for the control, in the keys of what cases share."""
        return repr((self.scene.winches, self.scene.actuators)), repr(self.scene.control)

    def _modes_of(self, count):
        """The lowest `CoupledModes`, as damping needs them."""
        if count not in self._modes:
            damping = [cable.damping for cable in self.scene.cables.values()]
            about = self._equilibrium, count, self._accuracy, damping, self._model, self._cables
            self._modes[count] = coupled_modes(*about, damped=True).damped
        return result_of(self._modes[count])

    @property
    def first_model(self):
        """The model that is tried first: rows for which it is equal have their modes computed together.

        Number of modes, accuracy, planes of the motion of the cables, and elements without their drag, or None.
        """
        drag = self._model and self._model.drag
        elements = self._model and replace(self._model, drag=drag and (drag.profile is None,))
        return self._solved(self._tried[0]), self._accuracy, self._cables and self._cables.planes, elements

    def _solved(self, count):
        """How many modes are computed where so many are in a model: meshes of cables that serve the loop too."""
        return max(count, min(self._few(STUDY.few_modes), self._many[0]))

    def _few(self, parts):
        """A number of modes, and so many of each cable, together."""
        return parts[0] + parts[1] * len(self.scene.cables)

    def lowest_modes(self, count):
        """At least so many `CoupledModes` where there are, those of the model that is tried first if it has them.

        Raises
        ------
        NoSolutionError, ConvergenceError
            As `closed_loop_of`.
        """
        return self._modes_of(self._solved(max(count, self._tried[0])))

    @cached_property
    def _counts(self):
        """Modes of the models that are tried: from the fewest on with which the frequencies of notches are known.

        Fewer than of many cables only where these hold nearly all of what loads do to bodies.
        """
        for count in (*self._tried, *(STUDY.more_modes if self._model is None else ())):
            closed_loop = self._with(count)
            enough = count >= self._many[0] or closed_loop.plant.lacked < STUDY.lacked_compliance
            if (enough and closed_loop.knows_notches) or len(closed_loop.modes) < count:
                break
        return tuple(one for one in self._tried if one >= count) or (count,)

    @cached_property
    def _tried(self):
        """Numbers of modes, ascending.

        Fewer first where cables are few and few modes are excited: by wind on free bodies alone, and a loop that only
        integrates. Modal damping, unless of an exact choice of elements, depends on their number: it is then that of
        many cables.
        """
        scene, many, exact = self.scene, self._many, self._model is not None
        all_excited = self.airflow is not None and self.airflow.on_cables
        all_excited |= scene.control is not None and not law_from(scene.control)[0].integrates_only
        few = [
            count
            for count in map(self._few, (STUDY.few_modes,) if exact else (STUDY.fewest_modes, STUDY.few_modes))
            if count < many[0]
        ]
        if not few or all_excited or (self._modal and not exact) or not self._equilibrium.suspension.free.any():
            return tuple(count for count in many if count >= self._least) or (self._least,)
        return *few, *many

    @property
    def _many(self):
        if self._model is not None:
            return (STUDY.element_modes,)
        return STUDY.plane_model_modes if self._cables is not None and self._cables.planes else STUDY.model_modes

    def _with(self, count):
        """`closed_loop_of` one of these numbers; of few cables modes left out have more responses."""
        return self.closed_loop_of(count, count < self._many[0] or self._compared, self._solved(count))

    @property
    def _compared(self):
        """Whether models are compared with each other: those to an accuracy, of few cables and few excited modes."""
        return self._model is None and self._tried[0] < self._many[0]

    @cached_property
    def _outcome(self):
        """`ClosedLoop` and response to the wind, or the error that says why there are none: computed once for a row."""
        return outcome_of(self._settled)

    def _settled(self):
        """`ClosedLoop` with as many modes as needed, and its response to the wind; raises as `response`."""
        response = None
        for count in self._counts:
            doing(f"motion with {count} modes")
            closed_loop = self._with(count)
            self._check(closed_loop)
            # what the fewest modes change says little of those after them
            before = response if self._compared and count > self._solved(0) else None
            response = GustResponse(closed_loop, self.scene, before) if self.airflow is not None else None
            if response is None or len(closed_loop.modes) < count or self._suffices(response):
                break
        if closed_loop.loop is not None and closed_loop.with_critical_modes is not closed_loop:
            closed_loop = closed_loop.with_critical_modes
            response = response and GustResponse(closed_loop, self.scene)
        return closed_loop, response

    def _suffices(self, response):
        """Whether the modes left out of a `GustResponse` and its quadrature leave the RMS of bodies the accuracy."""
        accuracy, others = self._accuracy, response.integration_error / 2
        return response.moving_error <= 2 * (
            STUDY.element_modes_change if self._model else max(accuracy - others, accuracy / 2)
        )

    def _check(self, closed_loop):
        """Refuse an unstable `ClosedLoop`: NoSolutionError that names the growing motion."""
        closed_loop.check_open()
        if not closed_loop.stable:
            self._with(self._many[0]).check_stable()
            closed_loop.check_stable()

    @property
    def _modal(self):
        """Whether the damping grows with the number of modes, where the ends of some cable move or are reeled in."""
        ends_move = self._equilibrium.suspension.free.any() or bool(self.scene.winches)
        return ends_move and any_grows_with_modes(self.scene.cables.values())

    @property
    def doubt(self):
        """Reason why the error of the RMS of the bodies is not known, or is larger than asked for: str, else empty.

        Raises
        ------
        NoSolutionError, ConvergenceError
            As `response`.
        """
        if self._model is not None:
            return ""
        if self._modal:
            return unknown_rms_error(counted(len(self.closed_loop.modes), "mode"))
        analyses = self, self.__dict__.get("_without_control")
        variance_error = max(wind.response.moving_error for wind in analyses if wind is not None and wind.solved)
        error = variance_error / 2  # of the root
        if error <= self._accuracy:
            return ""
        tried = [str(count) for count in self._tried if count <= len(self.closed_loop.modes)]
        models = f"{counted(len(tried), 'model')} of {', '.join(tried)} modes"
        return (
            f"motion in the wind: {models} tried: estimated error of the RMS {error:.1e}, asked for {self._accuracy:g}"
        )

    @property
    def _error_known(self):
        """Whether errors of RMS are known: not for an exact choice of elements, nor with modal damping."""
        return self._model is None and not self._modal

    @property
    def solved(self):
        """True if the motion was computed, that of an unstable loop with its winches at rest too."""
        outcomes = [self.__dict__[name] for name in ("_outcome", "_judged") if name in self.__dict__]
        at_rest = self.__dict__.get("_without_control")
        return any(not isinstance(result, Exception) for result in outcomes) or (at_rest is not None and at_rest.solved)

    @property
    def _found(self):
        return result_of(self._outcome)

    @property
    def closed_loop(self):
        """`ClosedLoop`; raises as `response`."""
        return self._found[0]

    @property
    def described(self):
        """`closed_loop`, or of an unstable loop, or where no response was asked for, `controlled`; raises as that."""
        outcome = self.__dict__.get("_outcome")
        return self.controlled if outcome is None or isinstance(outcome, Exception) else self.closed_loop

    @property
    def response(self):
        """`GustResponse` to the wind.

        Raises
        ------
        NoSolutionError, ConvergenceError
            What moves is unstable, or the variances cannot be had.
        """
        return self._found[1]

    @cached_property
    def _judged(self):
        """The `ClosedLoop` of `controlled`, or the error that says why there is none: computed once for a row."""
        return outcome_of(self._with_fewest)

    def _with_fewest(self):
        closed_loop = self._with(self._counts[0])
        closed_loop.check_open()
        return closed_loop

    @property
    def controlled(self):
        """`ClosedLoop` with the fewest modes, for numbers of the loop: its loop gain has all modes of the cables.

        With the loop it may be unstable.

        Raises
        ------
        NoSolutionError, ConvergenceError
            It is unstable with the winches at rest, or there are no modes to the accuracy.
        """
        return result_of(self._judged)

    def check_stable(self):
        """Refuse an unstable loop: NoSolutionError; raises as `controlled` too."""
        self._check(self.controlled)

    @property
    def at_rest(self):
        """The analysis with the winches at rest, sharing what does not depend on the loop, and the models tried."""
        return self if self.scene.control is None else self._without_control

    @cached_property
    def _without_control(self):
        other = self._changed(control=None)
        other._tried, counts = self._tried, outcome_of(lambda: self._counts)
        if not isinstance(counts, Exception):  # a loop that cannot be had has none
            other._counts = counts
        return other

    @cached_property
    def finer(self):
        """The analysis of a bare cable with the next larger number of modes; None without one or more modes."""
        known, count = (*self._many, STUDY.more_modes[0]), len(self.closed_loop.modes)
        if self._model is not None or count not in known[:-1]:
            return None
        other = self._changed()
        other._least = known[known.index(count) + 1]
        return other

    @cached_property
    def with_midspans(self):
        """`DynamicAnalysis` whose outputs have the mid-spans of the cables."""
        other = self._changed()
        other._midspans = True
        return other

    @property
    def without_actuators(self):
        """`DynamicAnalysis` without actuators, which shares what does not depend on them."""
        return self._changed(actuators={})

    def _changed(self, **update):
        """`DynamicAnalysis` of the scene with some keys changed that the equilibrium does not depend on."""
        about = self._without_wind, self._equilibrium, self.airflow, self._model, self._known, self._cables, self._modes
        other = DynamicAnalysis(self.scene.model_copy(update=update), *about)
        other._midspans, other._least = self._midspans, self._least
        return other

    @property
    def loop_error(self):
        """Estimated relative error of the largest gain; not a number for an exact choice of elements. [-]"""
        return self.controlled.driven.errors[0]

    @property
    def loop_doubt(self):
        """Why the error of the largest gain is larger than asked for, in words; else empty; raises as `controlled`."""
        error = self.loop_error
        if self._model is not None or not error > self._accuracy:
            return ""
        return f"loop: estimated error of the largest gain {error:.1e}, asked for {self._accuracy:g}"

    def margin(self, name):
        """A number of `Margins` by its name, and its estimated relative error by what the cables' models leave open."""
        self.check_stable()
        found, others = getattr(self.controlled.margins, name), self.controlled.perturbed_margins
        if not others:
            return found, np.nan
        error = STUDY.margin_safety * sum(relative(found, getattr(other, name)) for other in others)
        return found, error + self.controlled.driven.by_others

    @property
    def gain(self):
        """Gain of the loop [rad/s], and its estimated relative error: 0 of one that the scene states."""
        gain = self.controlled.loop.gain
        if isinstance(self.scene.control.gain, int | float):
            return gain, 0.0
        return gain, max(self.loop_error, self.margin("sensitivity_peak")[1])

    @property
    def largest_gain(self):
        """Gain below which the loop is stable [rad/s], None where there is none; and its estimated relative error."""
        return self.controlled.largest_gain, self.loop_error

    @property
    def gain_margin(self):
        """Largest over stated gain [dB], None where there is no limit; and its estimated relative error."""
        gain = self.controlled.loop.gain
        limit = self.controlled.largest_gain if gain else None
        if not limit:
            return None, self.loop_error if gain else 0.0
        found = float(20 * np.log10(limit / gain))
        return found, 20 * np.log10(1 + self.loop_error) / abs(found) if found else self.loop_error

    @property
    def phase_crossover(self):
        """Frequency of the pole that the largest gain puts on the axis [Hz], None where there is no limit; its error.

        Estimated as that of the largest gain; relative.
        """
        gain = self.controlled.loop.gain
        limit = self.controlled.limit if gain else None
        if limit is None:
            return None, self.loop_error if gain else 0.0
        found = limit.omega
        return found / (2 * np.pi), self.controlled.driven.errors[1]

    def response_of(self, open_loop):
        """`GustResponse` with the winches at rest, or with the loop; raises as `response`."""
        return (self.at_rest if open_loop else self).response

    def rms(self, names, variance, open_loop):
        """Root of the sum of variances of some outputs, and its estimated relative error; 0 of what is held.

        Not a number for an exact choice of elements, whose own error is not known, nor with modal damping.
        """
        response = self.response_of(open_loop)
        found = response.variances if variance in OWN else response.seen
        names = [name for name in names if name in found.rows]
        response.check_damped(names)
        rows = [found.rows[name] for name in names]
        total = found.weighted[variance][rows].sum()
        if not total > 0:
            return np.sqrt(total), 0.0 if self._model is None else np.nan
        error, accuracy = found.error_of(variance, names) / (2 * total), self._accuracy
        modes = len(response.closed_loop.modes)
        least = STUDY.resolved_by_fewest if modes == self._tried[0] < self._solved(modes) else STUDY.resolved
        error = max(error, min(STUDY.one_model_safety * error, accuracy), least * accuracy)
        return np.sqrt(total), error if self._error_known else np.nan

    def largest_rms(self, names, variance="value", open_loop=False):
        """`rms` of the one of some outputs that has the largest."""
        return max((self.rms([name], variance, open_loop) for name in names), key=lambda found: found[0])

    def peak(self, names, mean, crossings=0.0):
        """Mean and peak factor times RMS of the size of some outputs, and its estimated relative error.

        Parameters
        ----------
        names : sequence of str
        mean : float
        crossings : float
            Least relative error of the rate at which the mean is crossed. [-]
        """
        size, error = self.rms(names, "value", open_loop=False)
        if not size:
            return abs(mean), error
        (rate, wrong), duration = self.rms(names, "rate", open_loop=False), self.scene.wind.duration
        crossed = rate / (2 * np.pi * size)
        factor = peak_factor(crossed, duration)
        more = peak_factor(crossed * (1 + max(wrong + error, crossings)), duration)
        return abs(mean) + factor * size, error + more / factor - 1

    @cached_property
    def winch_speeds(self):
        """Of the fastest winch: RMS, largest expected within the wind's duration [m/s] and its number; their error. [-]

        Raises
        ------
        NoSolutionError, ConvergenceError
            As `response`.
        """
        if self.response.loop is None:
            return 0.0, 0.0, 0, 0.0
        (speed, rate), (error, _) = self.response.winch_speeds
        size = np.sqrt(speed)
        moving = np.where(size > 0, size, 1.0)
        peak = peak_factor(np.sqrt(rate) / (2 * np.pi * moving), self.scene.wind.duration) * size
        fastest = int(np.argmax(peak))
        relative = error[fastest] / (2 * speed[fastest]) if speed[fastest] else 0.0
        return float(size.max()), float(peak[fastest]), fastest, relative if self._error_known else np.nan

    def mean_displacement(self, name):
        """Of a body, or of a marker BODY.MARKER, by the mean wind, the winches at rest, shape (3,). [m]"""
        owner, _, marker = name.partition(".")
        if not self.scene.wind.mean and self.scene.load_case.wind is None:
            return np.zeros(3)
        body = self._without_wind.suspension.body_names.index(owner)
        place = np.array(self.scene.bodies[owner].markers[marker] if marker else (0.0, 0.0, 0.0))
        before, after = self._without_wind, self._equilibrium
        turned = (after.rotation[body] - before.rotation[body]) @ place
        moved = after.position[body] - before.position[body] + turned
        return np.where(np.abs(moved) > STUDY.mean_wind_rounding * before.longest, moved, 0.0)

    def mean_tensions(self, name):
        """Tension at both ends of a cable in the mean wind, shape (2,). [N]"""
        cable = self._equilibrium.suspension.cable_names.index(name)
        return np.linalg.norm(self._equilibrium.end_forces[cable], axis=-1)


def solve_modes(analyses, equilibrium):
    """Compute, of many cases together, the coupled modes that each analysis needs first, and keep them in it.

    Parameters
    ----------
    analyses : list of DynamicAnalysis
        Of suspensions with equal names and connections, n of them.
    equilibrium : Equilibrium
        Of these, shape (n,).
    """
    missing = {}  # first model -> place of one analysis for each dict of modes, which several may share
    for place, analysis in enumerate(analyses):
        if analysis.first_model[0] not in analysis._modes:
            missing.setdefault(analysis.first_model, {})[id(analysis._modes)] = place
    for (count, accuracy, planes, elements), by_dict in missing.items():
        places = list(by_dict.values())
        batch, model = [analyses[place] for place in places], elements
        damping = [cable.damping for analysis in batch for cable in analysis.scene.cables.values()]
        if elements and elements.drag is not None:
            model = replace(elements, drag=concatenate([analysis._model.drag for analysis in batch]))
        arguments = equilibrium.take(np.array(places)), count, accuracy, damping, planes, True, model
        for analysis, modes in zip(batch, coupled_modes_of_cases(*arguments), strict=True):
            result = modes if isinstance(modes, Exception) else outcome_of(lambda modes=modes: modes.damped)
            analysis._modes[count] = result
