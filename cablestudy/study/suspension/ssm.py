"""A suspension as a state space: which coupled modes are kept, between which inputs and outputs."""

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from cablestudy.control.statespace import state_space_of
from cablestudy.control.suspension import labels, outward, second_order
from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError, refuse_options
from cablestudy.study.ssm import DEFAULT_MODES, fewest_modes
from cablestudy.study.ssm_tables import Curve
from cablestudy.study.suspension.body_mode import MOST_MODES
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.linear_motion import markers_of, winches_of
from cablestudy.study.suspension.notes import damping_notes, notes_of, strength_warning
from cablestudy.study.suspension.report import mode_notes
from cablestudy.study.suspension.report import mode_table as coupled_mode_table
from cablestudy.study.suspension.ssm_control import choose_controlled, pairs_of
from cablestudy.system.coupled import Layout
from cablestudy.system.linear import dense
from cablestudy.wind.strips import nodal_shapes

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
    residual : bool
        Whether the static part of the other modes is kept.
    """

    case: SuspensionCase
    found: object
    whole: object
    chosen: np.ndarray
    pairs: list
    highest: float | None = None
    residual: bool = True

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
        return self.whole.keep(self.chosen) if self.residual else self.whole.truncate(self.chosen)

    def system(self):
        """The `StateSpace`; NoSolutionError where it overflows."""
        return state_space_of(self.kept, self.whole)

    @property
    def notes(self):
        """Notes on what is modelled and what is left out: list of str."""
        omitted = float(np.delete(self.whole.inertia_share(*self.pair), self.chosen).sum())
        output, input_ = self.pair
        names = f"{self.whole.inputs[input_][0]} and {self.whole.outputs[output][0]}"
        static = "kept in D" if self.residual else "left out too"
        return [
            *notes_of(self.case),
            *mode_notes(self.case, self.found, int(max(self.chosen, default=-1)) + 1),
            f"left out: {len(self.modes) - len(self.chosen)} modes, which carry {omitted:.3g} of the inertia between "
            f"{names}; their static part is {static}",
            "not in A, B, C, D: what velocity and acceleration of winches and forces add to tensions at once"
            " (D1 and D2 of the file)",
            *_no_winches(self.case.scene),
            *damping_notes(self.case.scene),
        ]

    @property
    def warnings(self):
        """A stress above the strength, a response beyond the modes kept: list of str."""
        kept, found = self.found.frequency[self.chosen], [*strength_warning(self.case), *self._truncated()]
        if self.highest is None or kept.max(initial=0.0) >= self.highest or len(self.chosen) == len(self.modes):
            return found
        last = f"the highest mode kept is at {kept.max():.4g} Hz" if len(kept) else "no mode is kept"
        part = "only the static part" if self.residual else "nothing"
        return [*found, f"warning: {last}: of those above {part} is in the response; see --modes and --upto"]

    def _truncated(self):
        """What a truncation makes of the static response of the first pair: at most one line."""
        if self.residual:
            return
        (output, input_), still = self.pair, np.zeros(1)
        wrong, right = (float(one.response(output, input_, still)[0].real) for one in (self.kept, self.whole))
        names = f"{self.outputs[output][0]} to {self.inputs[input_][0]}"
        unit = response_unit(self.outputs[output][1], self.inputs[input_][1])
        yield (
            "warning: --no-residual leaves out the static part of the omitted modes: static response of "
            f"{names} {wrong:.5g} {unit} instead of {right:.5g} {unit}".replace("  ", " ").rstrip()
        )


def _no_winches(scene):
    if not scene.winches:
        yield "winches: the scene names none, and no cable is reeled in"


def check_options(options):
    """Refuse `StateSpaceOptions` that have no effect: SceneError."""
    kinds = "in a coupled mode cables and bodies move in several planes: it is of no kind"
    refuse_options({"--kinds": options.kinds}, kinds)
    shapes = "actuators and loop act on static shapes beside the modes that are kept"
    refuse_options({"--no-residual": options.attached and not options.residual}, shapes)
    lowest = "with actuators or loop the lowest modes are kept, see --modes and --upto"
    refuse_options({"--error": options.attached and options.error}, lowest)


def choose(document, scene, options, highest=None):
    """Choose the coupled modes to keep.

    Parameters
    ----------
    document : Document
        Of the scene, for the places of mistakes.
    scene : SuspensionScene
    options : StateSpaceOptions
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
        if options.wind:
            raise SceneError("--wind: of a suspension without actuators and loop only")
        return choose_controlled(document, scene, options, highest)
    return replace(_choose(scene, options, highest), residual=options.residual)


def _choose(scene, options, highest):
    """`choose` of a suspension without actuators and loop."""
    case = SuspensionCase(scene)
    inputs, outputs = labels(Layout(case.equilibrium), *_winches_and_markers(case))
    if not inputs and not options.wind:
        raise NoSolutionError("a state space needs an input: one of the winches, or a body or point that is free")
    if not options.wind:
        pairs_of(options, inputs, outputs)  # raises SceneError before anything is computed
    if options.error is not None:
        return _fewest(case, options, highest)
    if options.upto:
        found = case.modes_up_to(options.limit)
        return _choice(case, options, found, found.up_to(options.limit), highest)
    size = MOST_MODES if scene.model.elements is not None else options.count or DEFAULT_MODES
    found = case.modes(size)
    if options.count is not None and len(found) < options.count:
        raise SceneError(f"--modes {options.count}: the model has {len(found)} modes")
    while options.count is None and highest and len(found) == size < RESPONSE_MODES and found.frequency[-1] < highest:
        size *= 2
        found = case.modes(size)
    return _choice(case, options, found, np.arange(len(found))[: options.count], highest)


def _choice(case, options, found, chosen, highest):
    """The `SuspensionChoice` of some of the modes found."""
    whole = linear_model(case, found.damped, options.wind)
    return SuspensionChoice(case, found, whole, chosen, pairs_of(options, whole.inputs, whole.outputs), highest)


def _fewest(case, options, highest):
    """The `SuspensionChoice` of the fewest modes that leave out a share of the inertia; of equal ones all or none."""
    size, before = MOST_MODES if case.scene.model.elements is not None else DEFAULT_MODES, ""
    while True:
        try:
            found = case.modes(size)
        except ConvergenceError as failure:
            raise ConvergenceError(f"{before}{failure}") from None
        every = np.arange(len(found))
        choice = _choice(case, options, found, every, highest)
        (output, _), (input_, _) = choice.outputs[choice.pair[0]], choice.inputs[choice.pair[1]]
        share = choice.whole.inertia_share(*choice.pair)
        try:
            chosen = fewest_modes(share, every, options.error, f"the {len(found)}", (input_, output))
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
        return replace(choice, chosen=chosen)


def _winches_and_markers(case):
    """Those of the scene, as the linear model takes them: lists of Winch and of Marker."""
    return winches_of(case.scene, list(case.scene.cables)), markers_of(case.scene)


def linear_model(case, found, nodes=False):
    """`LinearSystem` from the winches of the scene and forces on its bodies to displacements and tensions.

    Hysteretic damping is viscous in it, as a state space needs.

    Parameters
    ----------
    case : SuspensionCase
    found : CoupledModes
        Of which it has the coordinates.
    nodes : bool
        Whether forces on the nodes of the cables are inputs too.
    """
    kept = found.solution.kept
    system = second_order(found.layout, kept, *_winches_and_markers(case)).viscous()
    return with_node_forces(system, found.layout, found.solution.models, kept) if nodes else system


def with_node_forces(system, layout, models, kept):
    """A `LinearSystem` of `control.suspension.second_order` with forces on inner nodes as further inputs.

    Parameters
    ----------
    system : LinearSystem
        In the coordinates of cables and bodies; its last outputs are the tensions, two of each cable.
    layout : Layout
    models : Models
        Of the c cables.
    kept : list of Kept
        Their coordinates in the system.

    Returns
    -------
    LinearSystem
        With the inputs `CABLE.force_node_1_x` and so on, global axes, numbered from the end `from` on. [N]
    """
    names, (direction, _) = layout.equilibrium.suspension.cable_names, outward(layout.equilibrium)
    sizes, ends = [len(one.element.omega) for one in kept], dense(layout.moved)
    begin, tensions = np.cumsum([0, *sizes]), len(system.outputs) - 2 * len(kept)
    forces, direct, labels = [], [], []
    for cable, _, _, shapes in nodal_shapes(models, kept, np.flatnonzero(models.cables.heavy)):
        moved, size = shapes[1:-1].reshape(-1, shapes.shape[-1]), sizes[cable]
        force, through = np.zeros((len(system), len(moved))), np.zeros((len(system.outputs), len(moved)))
        force[begin[cable] : begin[cable + 1]] = moved[:, :size].T
        force[begin[-1] :] = ends[6 * cable : 6 * cable + 6].T @ moved[:, size:].T
        # what the ends take statically is no force of the cable on them
        taken = moved[:, size:].reshape(-1, 2, 3)
        through[tensions + 2 * cable : tensions + 2 * cable + 2] = -np.einsum("ea,fea->ef", direction[cable], taken)
        forces.append(force)
        direct.append(through)
        nodes = range(1, len(shapes) - 1)
        labels += [(f"{names[cable]}.force_node_{node}_{axis}", "N") for node in nodes for axis in "xyz"]
    if not forces:
        return system
    forces, direct = np.concatenate(forces, axis=1), np.concatenate(direct, axis=1)
    return replace(
        system,
        b=tuple(np.concatenate([part, forces * (order == 0)], axis=1) for order, part in enumerate(system.b)),
        d=tuple(np.concatenate([part, direct * (order == 0)], axis=1) for order, part in enumerate(system.d)),
        inputs=(*system.inputs, *labels),
    )


def response_unit(above, below):
    """Unit of an output over an input, from theirs; empty where they are equal."""
    return "" if above == below else f"{above}/{f'({below})' if ' ' in below else below}"


def mode_table(choice):
    """Table of the modes that a choice keeps."""
    return coupled_mode_table(choice.case, choice.found, choice.chosen)


def curves(choice):
    """List of `Curve`: each output over each input."""
    found = []
    for output, input_ in choice.pairs:
        (above, above_unit), (below, below_unit) = choice.outputs[output], choice.inputs[input_]
        unit = response_unit(above_unit, below_unit)
        name = f"{above}_over_{below}" if len(choice.pairs) > 1 else ""
        value = partial(choice.response, (output, input_))
        found.append(Curve(name, f"response of {above} to {below}", unit, value))
    return found
