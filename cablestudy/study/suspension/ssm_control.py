"""A suspension with its actuators, and with the loop of its winches, as a state space: how many modes are kept."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.control.loop import unstable_pole
from cablestudy.control.motion import with_strokes
from cablestudy.control.statespace import state_space_of
from cablestudy.control.suspension import labels
from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.motion.plant import actuators_of, markers_of, winches_of
from cablestudy.motion.response_in_time import labelled, measured_by
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.words import counted
from cablestudy.study.column import require
from cablestudy.study.loop_report import unstable
from cablestudy.study.ssm import (
    Choice,
    StateSpaceOptions,
    fewest_modes,
    named_channels,
    number_of,
    response_of,
    response_unit,
)
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.node_forces import with_node_forces
from cablestudy.study.suspension.notes import damping_notes, law_notes, notes_of, strength_warning
from cablestudy.study.suspension.report import mode_table
from cablestudy.study.tolerances import STUDY
from cablestudy.system.coupled import Layout
from cablestudy.system.modal_reduction import inertia_shares

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

    def _truncated(self, right_response):
        """Yield a warning, at most one: the static response of the first pair as truncated, and the right one."""
        if self.options.residual:
            return
        pair, still, (below, above) = self.pairs[0], np.zeros(1), self.names
        wrong, right = (float(response(pair, still)[0].real) for response in (self.response, right_response))
        unit = response_unit(self.outputs[pair[0]][1], self.inputs[pair[1]][1])
        yield (
            "warning: --no-residual leaves out the static part of the omitted modes: static response of "
            f"{above} to {below} {wrong:.5g} {unit} instead of {right:.5g} {unit}".replace("  ", " ").rstrip()
        )

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
    found: object  # `CoupledModes`, the lowest ones
    chosen: np.ndarray  # which of them are kept, from 0

    @property
    def modes(self):
        """Numbers of all modes of the linear model."""
        return range(len(self.found.shapes))

    @cached_property
    def reduced(self):
        """The `StateSpace`; NoSolutionError where it overflows."""
        return self._state_space(self.options.residual)

    def _state_space(self, residual):
        """The `StateSpace` with static shapes, as coordinates, in place of the modes left out, or without them."""
        closed_loop, motion = self.closed_loop, self.closed_loop.plant.viscous_motion
        kept, every = len(self.chosen), motion.shapes.shape[1]
        names = [f"mode_{k + 1}" for k in self.chosen.tolist()] + [f"residual_{k + 1}" for k in range(every - kept)]
        plant, control = closed_loop.plant, self.loop and self.loop.linear
        loads, shapes = plant.loads_on_bodies, with_strokes(motion.shapes, len(motion) - every)
        if not residual:
            left = np.delete(np.arange(len(motion)), np.arange(kept, every))
            space, names, loads, shapes = np.eye(len(motion))[:, left], names[:kept], loads[left], shapes[:, left]
            motion, control = replace(motion.within(space), scale=motion.scale[left]), control and control.within(space)
        system = labelled(closed_loop, motion, names, loads)
        if self.options.wind:
            system = with_node_forces(system, closed_loop.layout, plant.modes.model.coordinates, shapes)
        measured = measured_by(closed_loop) if self.loop else ()
        return state_space_of(system, None, control, measured, closed_loop.actuators)

    def system(self):
        """The `StateSpace`, see `reduced`."""
        return self.reduced

    def response(self, pair, frequency):
        """The output of a pair for a unit of its input, shape (m,), at frequencies [Hz]."""
        return response_of(self.reduced, pair, frequency)

    @property
    def notes(self):
        """Notes on what is modelled and what is left out: list of str."""
        scene, kept = self.case.scene, len(self.chosen)
        lowest = "lowest " if kept == max(self.chosen) + 1 else ""
        others = self.closed_loop.motion.shapes.shape[1] - kept
        shapes = f"{others} shapes (residual)" if self.options.residual else "no shapes"
        about = "without wind" if scene.wind is None else "in the mean wind"
        derivatives = any(matrix.any() for matrix in self.reduced.derivatives)
        direct = (
            "of a reference on tensions (D1"
            if self.loop
            else "and acceleration of winches on tensions and actuators (D1 and D2"
        )
        return [
            *notes_of(self.case),
            f"kept: the {kept} {lowest}modes, and {shapes} for the static part of the others",
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
        truncated = self._truncated(lambda *at: response_of(self._state_space(True), *at))
        return [*strength_warning(self.case), *truncated, *self._response_beyond(), *further]


def _of_loop(closed_loop):
    """Gain and notches of the loop: one line."""
    pairs = zip(closed_loop.body.measured, closed_loop.loop.notches, strict=True)
    notches = [f"{name} {notch.omega / (2 * np.pi):.4g} Hz" for name, notch in pairs if notch]
    law, gain = closed_loop.loop.law, closed_loop.loop.gain
    gains = f"gain {gain:.4g} rad/s" if law.integrates_only else law.described(gain, 4)
    yield f"loop: {gains}; notches: {', '.join(notches) or 'none'}"


def chosen_modes(found, options, share=None):
    """Indices of the modes to keep, ascending, from 0.

    Parameters
    ----------
    found : CoupledModes
        The lowest ones.
    options : StateSpaceOptions
        Modes of bodies, which are of no kind, are kept with those of the `kinds`; with an `error` those that coincide
        are kept together.
    share : (ndarray, tuple of str), optional
        Share of each mode in the inertia between an input and an output, shape (n,), see `inertia_shares`, and the
        names of both; for an `error`.

    Raises
    ------
    SceneError, NoSolutionError
        There are fewer modes than `count`; all of them leave out more than the `error`.
    """
    allowed, every, kinds = np.arange(len(found)), counted(len(found), "mode"), ""
    if options.kinds is not None:
        kinds = f" {' and '.join(options.kinds_kept)}"
        allowed = np.flatnonzero([kind in ("", *options.kinds_kept) for kind in found.kinds])
    if options.upto:
        return allowed[found.frequency[allowed] <= options.limit]
    if options.error is not None:
        which = f"the{kinds} ones of the {len(found)}" if kinds else f"the {len(found)}"
        chosen = fewest_modes(share[0], allowed, options.error, which, share[1])
        for first, last in found.coincident:  # counted from 1
            run = np.arange(first - 1, last)
            if np.isin(run, chosen).any():
                chosen = np.union1d(chosen, np.intersect1d(run, allowed))
        return chosen
    if options.count is not None and len(allowed) < options.count:
        among = f"{len(allowed)}{kinds} modes among its {len(found)} lowest" if kinds else every
        raise SceneError(f"--modes {options.count}: the model has {among}")
    return allowed[: options.count]


def choose_controlled(document, scene, options, highest=None):
    """Choose the modes of a suspension with actuators or loop that a state space keeps: `ControlledChoice`.

    Gain and notch filters of the loop follow from a model with many modes. The state space closes this loop on the
    model of the modes kept.

    Parameters
    ----------
    document : Document
        Of the scene, for file and line in messages.
    scene : SuspensionScene
    options : StateSpaceOptions
        `attached`: "actuators" or "loop"; others as of `ssm.choose`.
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
    if measured is not None and not options.wind:
        named_channels(options, *_channel_names(case, measured))
    size = max(options.count or 0, MOTION.model_modes[0])
    full_loop = case.analysis.closed_loop_of(size)
    if measured is None:  # follows from what the winches move
        measured = full_loop.body.measured
        if not options.wind:  # else the names depend on the elements
            named_channels(options, *_channel_names(case, measured))
    if options.upto:
        full_loop = _with_mode_above(case.analysis, full_loop, options.limit, np.inf)
    elif highest and not (options.count or options.error):
        full_loop = _with_mode_above(case.analysis, full_loop, highest, STUDY.loop_response_modes)
    full_loop, chosen = _chosen(case, full_loop, size, options, measured)
    if not len(chosen):
        of_kinds = f" {' or '.join(options.kinds_kept)}" if options.kinds else ""
        below = f"below {options.limit:.4g} Hz; the lowest" if options.upto else "among the lowest, of which the first"
        raise NoSolutionError(f"no{of_kinds} mode is {below} is at {full_loop.modes.frequency[0]:.4g} Hz")
    if len(chosen) == max(chosen) + 1:
        reduced_loop = _with_modes(case.analysis, full_loop, len(chosen))
        found = reduced_loop.modes
    else:
        reduced_loop, found = full_loop.with_modes(chosen), full_loop.modes
    loop, reduced_loop = None, reduced_loop.with_all_modes
    if options.attached == "loop":
        allocation = replace(full_loop.body.allocation, measured=reduced_loop.body.allocation.measured)
        loop = replace(full_loop.loop, motion=reduced_loop.plant.viscous_motion, allocation=allocation)
    return ControlledChoice(options, case, highest, full_loop, reduced_loop, loop, found, chosen)


def _chosen(case, closed_loop, size, options, measured):
    """The `ClosedLoop` with enough modes, at first so many (`size`), and the `chosen_modes` of it; raises as that."""
    while True:
        share = None if options.error is None else _inertia_shares(case, closed_loop, options, measured)
        try:
            return closed_loop, chosen_modes(closed_loop.modes, options, share)
        except (SceneError, NoSolutionError):
            if options.upto or len(closed_loop.modes) < size or size >= MOTION.most_body_modes:
                raise
            size = min(2 * size, MOTION.most_body_modes)
        closed_loop = case.analysis.closed_loop_of(size)


def _inertia_shares(case, closed_loop, options, measured):
    """Share of each mode in the inertia between an input and an output, the winches at rest, and the names of both.

    A reference moves the winches as the loop shares its error among them, and winches are outputs as they answer to the
    coordinates that the loop measures. SceneError for outputs of actuators.
    """
    inputs, outputs = _channel_names(case, measured)
    given, shown = (options.inputs or inputs)[0], (options.outputs or outputs)[0]
    system = closed_loop.plant.full_system.viscous()
    if options.wind:
        system = with_node_forces(system, closed_loop.layout, closed_loop.modes.model.coordinates)
    own_inputs, own_outputs = ([name for name, _ in pairs] for pairs in (system.inputs, system.outputs))
    if given in own_inputs:
        column = np.eye(len(own_inputs))[own_inputs.index(given)]
    else:  # reference.x
        rates = closed_loop.body.allocation.matrix[:, number_of("--input", given, inputs)]
        column = np.pad(rates, (0, len(own_inputs) - len(rates)))
    if shown in own_outputs:
        row = np.eye(len(own_outputs))[own_outputs.index(shown)]
    elif measured and shown in own_inputs:  # winch.CABLE
        row = np.zeros(len(own_outputs))
        rates = closed_loop.body.allocation.matrix[own_inputs.index(shown)]
        row[[own_outputs.index(name) for name in closed_loop.body.measured_outputs]] = rates
    else:
        raise SceneError(
            f"--error: no share of the inertia is known for --output {shown}, but for displacements and tensions"
        )
    b, c = ([part @ column[:, None] for part in system.b], [row[None] @ part for part in system.c])
    return inertia_shares(replace(system, b=tuple(b), c=tuple(c)), 0, 0), (given, shown)


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
