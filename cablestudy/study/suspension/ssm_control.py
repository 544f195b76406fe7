"""A suspension with its actuators, and with the loop of its winches, as a state space: how many modes are kept."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.control.loop import unstable_pole
from cablestudy.control.statespace import state_space_of
from cablestudy.control.suspension import labels
from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.motion.plant import actuators_of, markers_of, winches_of
from cablestudy.motion.response_in_time import labelled, measured_by
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.words import counted
from cablestudy.study.column import require
from cablestudy.study.loop_report import unstable
from cablestudy.study.ssm import Choice, StateSpaceOptions, named_channels, response_of
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.notes import damping_notes, law_notes, notes_of, strength_warning
from cablestudy.study.suspension.report import mode_table
from cablestudy.study.tolerances import STUDY
from cablestudy.system.coupled import Layout

NEEDS = {"loop": "control", "actuators": "actuators"}  # keys of the scene


@dataclass(frozen=True)
class CoupledChoice(Choice):
    """Modes that a state space keeps of a suspension, with or without control.

    Subclasses add `found`, the computed `CoupledModes`, and `shown`, the linear system or state space of those kept.
    """

    options: StateSpaceOptions
    case: SuspensionCase
    highest: float | None  # highest frequency of the response asked for [Hz]

    @property
    def poles(self):
        """Poles of the system whose response is shown. [rad/s]"""
        return np.linalg.eigvals(self.system().a)

    def mode_table(self):
        """Table of the modes that are kept."""
        return mode_table(self.case, self.found, self.chosen)

    def _response_beyond(self):
        """Yield a warning where a response is asked for beyond the modes that are kept, and others are left out."""
        kept = self.found.frequency[self.chosen]
        if self.highest is None or kept.max(initial=0.0) >= self.highest or len(kept) == len(self.modes):
            return
        last = f"the highest mode kept is at {kept.max():.4g} Hz" if len(kept) else "no mode is kept"
        part = "only the static part" if self.options.residual else "nothing"
        yield f"warning: {last}: of those above {part} is in the response; see --modes and --upto"


@dataclass(frozen=True)
class ControlledChoice(CoupledChoice):
    """A suspension with actuators or loop, and as many of its lowest coupled modes as are kept."""

    whole: object  # `ClosedLoop` with enough modes, from which `loop` follows
    closed_loop: object  # `ClosedLoop` with the modes that are kept: `whole`, or one with fewer modes
    loop: object  # `Loop` of `whole` on the modes that are kept; None where it is open, and the winches are inputs

    @property
    def found(self):
        """The `CoupledModes` that are kept."""
        return self.closed_loop.modes

    @property
    def chosen(self):
        """Which of them, from 0: all."""
        return np.arange(len(self.found))

    @property
    def modes(self):
        """Numbers of all modes of the linear model."""
        return range(len(self.found.shapes))

    @cached_property
    def reduced(self):
        """The `StateSpace`; NoSolutionError where it overflows."""
        closed_loop, motion = self.closed_loop, self.closed_loop.plant.viscous_motion
        kept, every = len(closed_loop.modes), motion.shapes.shape[1]
        names = [f"mode_{k + 1}" for k in range(kept)] + [f"residual_{k + 1}" for k in range(every - kept)]
        system = labelled(closed_loop, motion, names, closed_loop.plant.loads_on_bodies)
        measured = measured_by(closed_loop) if self.loop else ()
        loop = self.loop and self.loop.linear
        return state_space_of(system, None, loop, measured, closed_loop.actuators)

    def system(self):
        """The `StateSpace`, see `reduced`."""
        return self.reduced

    def response(self, pair, frequency):
        """The output of a pair for a unit of its input, shape (m,), at frequencies [Hz]."""
        return response_of(self.reduced, pair, frequency)

    @property
    def notes(self):
        """Notes on what is modelled and what is left out: list of str."""
        scene, kept = self.case.scene, len(self.found)
        others = self.closed_loop.motion.shapes.shape[1] - kept
        about = "without wind" if scene.wind is None else "in the mean wind"
        derivatives = any(matrix.any() for matrix in self.reduced.derivatives)
        direct = (
            "of a reference on tensions (D1"
            if self.loop
            else "and acceleration of winches on tensions and actuators (D1 and D2"
        )
        return [
            *notes_of(self.case),
            f"kept: the {kept} lowest modes, and {others} shapes (residual) for the static part of the others",
            f"about: the equilibrium {about}",
            *([*_of_loop(self.whole), *law_notes(self.loop)] if self.loop else ()),
            *([f"not in A, B, C, D: the direct effect of the velocity {direct} of the file)"] if derivatives else []),
            *damping_notes(scene),
        ]

    @property
    def warnings(self):
        """A stress above the strength, what is unstable, and a response beyond the modes kept: list of str."""
        reasons = unstable(self.whole) if self.loop or unstable_pole(self.whole.open_poles) is not None else ()
        if not reasons and unstable_pole(self.poles) is not None:
            reasons = ("with the modes kept a motion grows, with more of them none does; see --modes",)
        further = (f"warning: {reason}" for reason in reasons)
        return [*strength_warning(self.case), *self._response_beyond(), *further]


def _of_loop(closed_loop):
    """Gain and notches of the loop: one line."""
    pairs = zip(closed_loop.body.measured, closed_loop.loop.notches, strict=True)
    notches = [f"{name} {notch.omega / (2 * np.pi):.4g} Hz" for name, notch in pairs if notch]
    law, gain = closed_loop.loop.law, closed_loop.loop.gain
    gains = f"gain {gain:.4g} rad/s" if law.integrates_only else law.described(gain, 4)
    yield f"loop: {gains}; notches: {', '.join(notches) or 'none'}"


def choose_controlled(document, scene, options, highest=None):
    """Choose the lowest modes of a suspension with actuators or loop that a state space keeps: `ControlledChoice`.

    Gain and notch filters of the loop follow from a model with many modes. The state space closes this loop on the
    model of the modes kept.

    Parameters
    ----------
    document : Document
        Of the scene, for file and line in messages.
    scene : SuspensionScene
    options : StateSpaceOptions
        `attached`: "actuators" or "loop". Number of modes: `count`, or all up to the frequency `upto`. `error` is None.
    highest : float, optional
        Highest frequency of the response asked for. Without `count` and `upto`, the modes kept reach it if a limited
        number of modes does. [Hz]

    Raises
    ------
    SceneError
        The scene lacks the loop or the actuators, an input or output of the options is unknown, or there are fewer
        modes than `options.count`.
    NoSolutionError, ConvergenceError
        There is no stable equilibrium, no loop for it, or no mode below `options.upto`.
    """
    require(document, scene, [NEEDS[options.attached]], f"ssm --with {options.attached}")
    case = SuspensionCase(scene)
    measured = scene.control.measured if options.attached == "loop" else ()
    if measured is not None:
        named_channels(options, *_channel_names(case, measured))
    full_loop = reduced_loop = case.analysis.closed_loop_of(max(options.count or 0, MOTION.model_modes[0]))
    if measured is None:  # follows from what the winches move
        named_channels(options, *_channel_names(case, full_loop.body.measured))
    if options.count:
        if len(full_loop.modes) < options.count:
            raise SceneError(f"--modes {options.count}: the model has {counted(len(full_loop.modes), 'mode')}")
        reduced_loop = _with_modes(case.analysis, full_loop, options.count)
    elif options.upto:
        full_loop = _with_mode_above(case.analysis, full_loop, options.limit, np.inf)
        frequency = full_loop.modes.frequency
        if frequency[0] > options.limit:
            raise NoSolutionError(f"no mode is below {options.limit:.4g} Hz; the lowest is at {frequency[0]:.4g} Hz")
        reduced_loop = _with_modes(case.analysis, full_loop, int((frequency <= options.limit).sum()))
    elif highest:
        full_loop = reduced_loop = _with_mode_above(case.analysis, full_loop, highest, STUDY.loop_response_modes)
    loop, reduced_loop = None, reduced_loop.with_all_modes
    if options.attached == "loop":
        allocation = replace(full_loop.body.allocation, measured=reduced_loop.body.allocation.measured)
        loop = replace(full_loop.loop, motion=reduced_loop.plant.viscous_motion, allocation=allocation)
    return ControlledChoice(options, case, highest, full_loop, reduced_loop, loop)


def _channel_names(case, measured):
    """Names of the inputs and outputs of `ControlledChoice.reduced`, of a loop that measures something: two lists."""
    scene = case.scene
    named = labels(Layout(case.equilibrium), winches_of(scene, list(scene.cables)), markers_of(scene))
    inputs, outputs = ([name for name, _ in pairs] for pairs in named)
    winches = len(scene.winches)
    quantities = {False: ("stroke", "force"), True: ("momentum", "torque")}
    of_actuators = [f"{one.name}.{word}" for one in actuators_of(scene) for word in quantities[one.wheel]]
    if not measured:
        return inputs, outputs + of_actuators
    return [f"reference.{name}" for name in measured] + inputs[winches:], outputs + inputs[:winches] + of_actuators


def _with_modes(analysis, whole, count):
    """The `ClosedLoop` with the lowest `count` of the modes of another one, or this one if it has so many."""
    return whole if count == len(whole.modes) else analysis.closed_loop_of(count)


def _with_mode_above(analysis, closed_loop, frequency, most):
    """A `ClosedLoop` with a mode above a frequency [Hz], of at most about `most` modes, or with all there are."""
    size = MOTION.model_modes[0]
    while len(closed_loop.modes) == size < most and closed_loop.modes.frequency[-1] < frequency:
        size *= 2
        closed_loop = analysis.closed_loop_of(size)
    return closed_loop
