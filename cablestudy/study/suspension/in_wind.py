"""A suspension in the wind and under control: with as many modes as its numbers need."""

from functools import cached_property

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.scene.words import counted
from cablestudy.study.columns import relative
from cablestudy.study.suspension.driven_modes import gain_error, with_driven_modes
from cablestudy.study.suspension.linear_motion import LinearMotion
from cablestudy.study.suspension.movement import Movement
from cablestudy.study.suspension.response import ACCURACY, CLOSED, OPEN, Response
from cablestudy.wind.peak import peak_factor

COUNTS = (64, 100, 160)  # modes of the models that are tried
ELEMENTS = (250,)  # of a model with an exact choice of elements
SAFETY = 2.0  # on the change of a margin by fewer modes
PEAKS = ("sensitivity_peak", "sensitivity_frequency", "disk_margin", "disk_gain_margin", "disk_phase_margin")
ROUNDING = 1e-14  # of a displacement by the mean wind over the longest chord: what is less is shown as zero


class InWind:
    """One case.

    Parameters
    ----------
    scene : SuspensionScene
    calm : Equilibrium
        Without wind.
    equilibrium : Equilibrium
        In the mean wind, or in the steady wind of its load case.
    drag : Drag or None
    model : FixedModel or None
    known : dict
        What cases of this equilibrium share: it is filled.
    """

    def __init__(self, scene, calm, equilibrium, drag, model, known):
        self.scene, self._calm, self._equilibrium, self._drag, self._model = scene, calm, equilibrium, drag, model
        self._known = known
        self._accuracy = scene.model.accuracy or ACCURACY

    def movement_of(self, count):
        """`Movement` with so many modes, which may be unstable.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There are no modes to the accuracy.
        """
        scene = self.scene
        linear = count, repr((scene.winches, scene.actuators))
        if linear not in self._known:
            self._known[linear] = LinearMotion(scene, self._equilibrium, self._drag, count, self._accuracy, self._model)
        moving = *linear, repr(scene.control)
        if moving not in self._known:
            self._known[moving] = Movement(scene, self._known[linear])
        return self._known[moving]

    @cached_property
    def _outcome(self):
        """Movement and response to the wind, or the error that says why there are none: computed once for a row."""
        try:
            return self._settled()
        except (NoSolutionError, ConvergenceError) as error:
            return error

    def _settled(self):
        """Movement with as many modes as needed, and its response to the wind; raises as `response`."""
        for count in COUNTS if self._model is None else ELEMENTS:
            movement = self.movement_of(count)
            response = Response(movement, self.scene) if self._drag is not None else None
            if response is None or len(movement.modes) < count:
                break
            if movement.stable and response.moving_error <= 2 * self._accuracy:
                break
        if movement.loop is not None:
            if movement not in self._known:
                self._known[movement] = with_driven_modes(movement)
            wider = self._known[movement]
            same = wider.linear is movement.linear and wider.loop.gain == movement.loop.gain
            response = response and (response if same else Response(wider, self.scene))
            movement = wider
        movement.check_stable()
        return movement, response

    @property
    def short_of_accuracy(self):
        """What was tried where the RMS of the bodies has a larger error than asked for; else empty.

        Raises
        ------
        NoSolutionError, ConvergenceError
            As `response`.
        """
        error = self.response.moving_error / 2
        if self._model is not None or error <= self._accuracy:
            return ""
        tried = [str(count) for count in COUNTS if count <= len(self.movement.modes)]
        models = f"{counted(len(tried), 'model')} of {', '.join(tried)} modes"
        return f"{models} tried: estimated error of the RMS {error:.1e}, asked for {self._accuracy:g}"

    @property
    def solved(self):
        """Whether the motion was computed."""
        return "_outcome" in self.__dict__ and not isinstance(self._outcome, Exception)

    @property
    def _found(self):
        if isinstance(self._outcome, Exception):
            raise self._outcome
        return self._outcome

    @property
    def movement(self):
        """`Movement`; raises as `response`."""
        return self._found[0]

    @property
    def response(self):
        """`Response` to the wind.

        Raises
        ------
        NoSolutionError, ConvergenceError
            What moves is unstable, or the variances cannot be had.
        """
        return self._found[1]

    @cached_property
    def loop_error(self):
        """Estimated relative error of the largest gain; not a number for an exact choice of elements. [-]"""
        return gain_error(self.movement) if self._model is None else np.nan

    def margin(self, name):
        """A number of `Margins` by its name, and its estimated relative error by what fewer modes change in it."""
        found = getattr(self.movement.loop.margins, name)
        if self._model is not None:
            return found, np.nan
        try:
            error = SAFETY * relative(found, getattr(self.movement.fewer_loop.margins, name))
            chosen = name in PEAKS and self.movement.linear.wide is not None
            return found, max(error, self.loop_error) if chosen else error  # modes far above may raise the peak too
        except NoSolutionError:  # with fewer modes it cannot be judged
            return found, np.nan

    @property
    def gain(self):
        """Gain of the loop [rad/s], and its estimated relative error: 0 of one that the scene states."""
        gain = self.movement.loop.gain
        if isinstance(self.scene.control.gain, int | float):
            return gain, 0.0
        return gain, max(self.loop_error, self.margin("sensitivity_peak")[1])

    @property
    def gain_margin(self):
        """Largest over stated gain [dB], None where there is no limit; and its estimated relative error."""
        limit, gain = self.movement.largest_gain, self.movement.loop.gain
        if not (limit and gain):
            return None, self.loop_error
        found = float(20 * np.log10(limit / gain))
        return found, 20 * np.log10(1 + self.loop_error) / abs(found) if found else self.loop_error

    @property
    def phase_crossover(self):
        """Frequency of the pole that the largest gain puts on the axis [Hz], None where there is no limit; its error.

        Estimated as that of the largest gain; relative.
        """
        limit = self.movement.limit if self.movement.loop.gain else None
        if limit is None:
            return None, self.loop_error
        found = limit.omega
        if self.movement.limit_errors is not None:
            return found / (2 * np.pi), self.movement.limit_errors[1] if self._model is None else np.nan
        other = self.movement.limit_with_other_modes
        error = np.nan if other is None or self._model is not None else SAFETY * relative(found, other.omega)
        return found / (2 * np.pi), error

    def rms(self, names, variance, open_loop):
        """Root of the sum of variances of some outputs, and its estimated relative error; 0 of what is held.

        Not a number for an exact choice of elements, whose own error is not known.
        """
        found, state = self.response.variances, OPEN if open_loop else CLOSED
        rows = [found.rows[name] for name in names if name in found.rows]
        total = found.weighted[variance][state, rows].sum()
        error = found.error[variance][state, rows].sum() / (2 * total) if total > 0 else 0.0
        return np.sqrt(total), error if self._model is None else np.nan

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
        return float(size.max()), float(peak[fastest]), fastest, relative if self._model is None else np.nan

    def mean_displacement(self, name):
        """Of a body, or of a marker BODY.MARKER, by the mean wind, the winches at rest, shape (3,). [m]"""
        owner, _, marker = name.partition(".")
        if not self.scene.wind.mean and self.scene.load_case.wind is None:
            return np.zeros(3)
        body = self._calm.suspension.body_names.index(owner)
        place = np.array(self.scene.bodies[owner].markers[marker] if marker else (0.0, 0.0, 0.0))
        before, after = self._calm, self._equilibrium
        turned = (after.rotation[body] - before.rotation[body]) @ place
        moved = after.position[body] - before.position[body] + turned
        return np.where(np.abs(moved) > ROUNDING * before.catenary.span.chord.max(), moved, 0.0)

    def mean_tensions(self, name):
        """Tension at both ends of a cable in the mean wind, shape (2,). [N]"""
        cable = self._equilibrium.suspension.cable_names.index(name)
        return np.linalg.norm(self._equilibrium.end_forces[cable], axis=-1)
