"""A suspension as a state space: which coupled modes are kept, between which inputs and outputs."""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from cablestudy.control.statespace import state_space_of
from cablestudy.control.suspension import labels, second_order
from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.study.ssm import DEFAULT_MODES, fewest_modes
from cablestudy.study.ssm_tables import Curve
from cablestudy.study.suspension.case import MOST_MODES, SuspensionCase
from cablestudy.study.suspension.linear_motion import markers_of, winches_of
from cablestudy.study.suspension.notes import damping_notes, notes_of, strength_warning
from cablestudy.study.suspension.report import mode_notes
from cablestudy.study.suspension.report import mode_table as coupled_mode_table
from cablestudy.study.suspension.ssm_control import choose_controlled, pairs_of
from cablestudy.system.coupled import Layout

RESPONSE_MODES = 96  # beyond which a response does not ask for more by itself


@dataclass(frozen=True)
class SuspensionChoice:
    """A suspension with the coupled modes to keep.

    Attributes
    ----------
    case : SuspensionCase
    found : CoupledModes
        The lowest modes.
    whole : LinearSystem
        In the coordinates of cables and bodies.
    chosen : ndarray of int
        Modes to keep, from 0.
    pairs : list of tuple of int
        Numbers of each output and input that a response refers to; errors refer to the first.
    highest : float or None
        Highest frequency of the response asked for. [Hz]
    """

    case: SuspensionCase
    found: object
    whole: object
    chosen: np.ndarray
    pairs: list
    highest: float | None = None

    @property
    def modes(self):
        """1/W^2 of all modes of the linear model, see `LinearSystem.strain_modes`. [s^2]"""
        return self.whole.strain_modes[0]

    @property
    def inputs(self):
        """Name and unit of each input."""
        return self.whole.inputs

    @property
    def outputs(self):
        """Name and unit of each output."""
        return self.whole.outputs

    @property
    def pair(self):
        """The first of the pairs."""
        return self.pairs[0]

    def response(self, pair, frequency):
        """The output of a pair for a unit of its input, shape (m,), at frequencies [Hz]."""
        return self.kept.response(*pair, frequency)

    @property
    def poles(self):
        """Of what a response shows. [rad/s]"""
        return np.linalg.eigvals(self.system().a)

    @cached_property
    def kept(self):
        """`LinearSystem` of the chosen modes."""
        return self.whole.keep(self.chosen)

    def system(self):
        """The `StateSpace`; NoSolutionError where it overflows."""
        return state_space_of(self.kept, self.whole)

    @property
    def notes(self):
        """What is modelled and what is left out: list of str."""
        omitted = float(np.delete(self.whole.inertia_share(*self.pair), self.chosen).sum())
        output, input_ = self.pair
        names = f"{self.whole.inputs[input_][0]} and {self.whole.outputs[output][0]}"
        return [
            *notes_of(self.case),
            *mode_notes(self.case, self.found, int(max(self.chosen, default=-1)) + 1),
            f"left out: {len(self.modes) - len(self.chosen)} modes, which carry {omitted:.3g} of the inertia between "
            f"{names}; their static part is kept in D",
            "not in A, B, C, D: what velocity and acceleration of winches and forces add to tensions at once"
            " (D1 and D2 of the file)",
            *_no_winches(self.case.scene),
            *damping_notes(self.case.scene),
        ]

    @property
    def warnings(self):
        """A stress above the strength, a response beyond the modes kept: list of str."""
        kept, found = self.found.frequency[self.chosen], [*strength_warning(self.case)]
        if self.highest is None or kept.max(initial=0.0) >= self.highest or len(self.chosen) == len(self.modes):
            return found
        last = f"the highest mode kept is at {kept.max():.4g} Hz" if len(kept) else "no mode is kept"
        return [
            *found,
            f"warning: {last}: of those above only the static part is in the response; see --modes and --upto",
        ]


def _no_winches(scene):
    if not scene.winches:
        yield "winches: the scene names none, and no cable is reeled in"


def choose(document, scene, options, highest=None):
    """Choose the coupled modes to keep.

    Parameters
    ----------
    document : Document
        Of the scene, for the places of mistakes.
    scene : SuspensionScene
    options : Options
        Those that have no meaning for a suspension are not looked at.
    highest : float, optional
        Of a response [Hz]: without other choice the modes up to it are kept, at least DEFAULT_MODES and not many more
        than RESPONSE_MODES.

    Returns
    -------
    SuspensionChoice or ControlledChoice

    Raises
    ------
    SceneError
        `options.input` or `options.output` is unknown, the model has fewer modes than `options.count`, or the scene
        has no loop or no actuators to be attached.
    NoSolutionError, ConvergenceError
        There is no stable equilibrium, there are no such modes, or not to the accuracy.
    """
    if options.attached:
        return choose_controlled(document, scene, options, highest)
    case = SuspensionCase(scene)
    inputs, outputs = labels(Layout(case.equilibrium), *_winches_and_markers(case))
    if not inputs:
        raise NoSolutionError("a state space needs an input: one of the winches, or a body or point that is free")
    pairs = pairs_of(options, inputs, outputs)
    if options.error is not None:
        return _fewest(case, options.error, pairs[0], highest)
    if options.upto:
        found = case.modes_up_to(options.limit)
        return SuspensionChoice(
            case, found, linear_model(case, found.damped), found.up_to(options.limit), pairs, highest
        )
    size = MOST_MODES if scene.model.elements is not None else options.count or DEFAULT_MODES
    found = case.modes(size)
    if options.count is not None and len(found) < options.count:
        raise SceneError(f"--modes {options.count}: the model has {len(found)} modes")
    while options.count is None and highest and len(found) == size < RESPONSE_MODES and found.frequency[-1] < highest:
        size *= 2
        found = case.modes(size)
    return SuspensionChoice(
        case, found, linear_model(case, found.damped), np.arange(len(found))[: options.count], pairs, highest
    )


def _fewest(case, error, pair, highest):
    """The `SuspensionChoice` of the fewest modes that leave out a share of the inertia; of equal ones all or none."""
    size, before = MOST_MODES if case.scene.model.elements is not None else DEFAULT_MODES, ""
    while True:
        try:
            found = case.modes(size)
        except ConvergenceError as failure:
            raise ConvergenceError(f"{before}{failure}") from None
        whole = linear_model(case, found.damped)
        names = whole.inputs[pair[1]][0], whole.outputs[pair[0]][0]
        share, allowed = whole.inertia_share(*pair), np.arange(len(found))
        try:
            chosen = fewest_modes(share, allowed, error, f"the {len(found)}", names)
        except NoSolutionError as lacking:
            if len(found) < size or size == MOST_MODES:
                raise
            before = f"{lacking}; of more, "
            size = min(2 * size, MOST_MODES)
            continue
        for first, last in found.coincident:
            run = np.arange(first - 1, last)
            if np.isin(run, chosen).any():
                chosen = np.union1d(chosen, run)
        return SuspensionChoice(case, found, whole, chosen, [pair], highest)


def _winches_and_markers(case):
    """Those of the scene, as the linear model takes them: lists of Winch and of Marker."""
    return winches_of(case.scene, list(case.scene.cables)), markers_of(case.scene)


def linear_model(case, found):
    """`LinearSystem` from the winches of the scene and forces on its bodies to displacements and tensions.

    Hysteretic damping is viscous in it, as a state space needs.

    Parameters
    ----------
    case : SuspensionCase
    found : CoupledModes
        Of which it has the coordinates.
    """
    return second_order(found.layout, found.solution.kept, *_winches_and_markers(case)).viscous()


def mode_table(choice):
    """Table of the modes that a choice keeps."""
    return coupled_mode_table(choice.case, choice.found, choice.chosen)


def curves(choice):
    """List of `Curve`: each output over each input."""
    found = []
    for output, input_ in choice.pairs:
        (above, above_unit), (below, below_unit) = choice.outputs[output], choice.inputs[input_]
        below_unit = f"({below_unit})" if " " in below_unit else below_unit
        unit = "" if above_unit == below_unit else f"{above_unit}/{below_unit}"
        name = f"{above}_over_{below}" if len(choice.pairs) > 1 else ""
        value = partial(choice.response, (output, input_))
        found.append(Curve(name, f"response of {above} to {below}", unit, value))
    return found
