"""A suspension as a state space: which coupled modes are kept, between which inputs and outputs."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.control.statespace import state_space_of
from cablestudy.control.suspension import labels, suspension_system
from cablestudy.control.winches import EndMovement
from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.motion.plant import markers_of, winches_of
from cablestudy.motion.tolerances import MOTION
from cablestudy.statics.suspension import GROUND
from cablestudy.study.ssm import check_channel, pairs_of
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.node_forces import with_node_forces
from cablestudy.study.suspension.notes import damping_notes, notes_of, strength_warning, unknown_damping_ratios
from cablestudy.study.suspension.report import mode_notes
from cablestudy.study.suspension.ssm_control import CoupledChoice, choose_controlled, chosen_modes
from cablestudy.study.tolerances import STUDY
from cablestudy.system.coupled import Layout
from cablestudy.system.coupled_solution import of_system
from cablestudy.system.modal_reduction import inertia_shares, keep_modes, truncate_modes


@dataclass(frozen=True)
class SuspensionChoice(CoupledChoice):
    """A suspension with the coupled modes to keep."""

    found: object  # `CoupledModes`, the lowest ones
    whole: object  # `LinearSystem` in the coordinates of cables and bodies
    chosen: np.ndarray  # modes to keep, from 0

    @property
    def modes(self):
        """1/W^2 of all modes of the linear model, see `LinearSystem.strain_modes`. [s^2]"""
        return self.whole.strain_modes[0]

    def response(self, pair, frequency):
        """The output of a pair for a unit of its input, shape (m,), at frequencies [Hz]."""
        return self.reduced.response(*pair, frequency)

    @property
    def share(self):
        """Share of each mode in the inertia between these, see `LinearSystem.inertia_share`, shape (n,). [-]"""
        return inertia_shares(self.whole, *self.pairs[0])

    @cached_property
    def reduced(self):
        """`LinearSystem` of the chosen modes."""
        return (keep_modes if self.options.residual else truncate_modes)(self.whole, self.chosen)

    def system(self):
        """The `StateSpace`; NoSolutionError where it overflows."""
        return state_space_of(self.reduced, self.whole)

    @property
    def notes(self):
        """Notes on what is modelled and what is left out: list of str."""
        return [
            *notes_of(self.case),
            *mode_notes(self.case, self.found, int(max(self.chosen, default=-1)) + 1),
            *unknown_damping_ratios(self.found),
            self.left_out(self.share),
            "not in A, B, C, D: the direct effect of velocity and acceleration of inputs on tensions and forces on ends"
            " (D1 and D2 of the file)",
            *([] if self.case.scene.winches else ["winches: the scene names none, and no cable is reeled in"]),
            *(["drag of the steady wind: a dead load"] if self.case.scene.load_case.wind else []),
            *damping_notes(self.case.scene),
        ]

    @property
    def warnings(self):
        """A stress above the strength, a response beyond the modes kept: list of str."""
        truncated = self._truncated(lambda pair, frequency: self.whole.response(*pair, frequency))
        return [*strength_warning(self.case), *truncated, *self._response_beyond()]


def check_options(options, responds, out):
    """Refuse `StateSpaceOptions` that have no effect: SceneError; parameters as for `one_cable.ssm.check_options`."""
    if not out and options.error is None and not responds:
        check_channel(options)


def choose(document, scene, options, highest=None):
    """Choose the coupled modes that a state space of a suspension keeps, as the options of the command `ssm` ask for.

    Parameters
    ----------
    document : Document
        Of the scene, for file and line in messages.
    scene : SuspensionScene
    options : StateSpaceOptions
        The lowest modes by number (`count`) or up to a frequency (`upto`), or the fewest that leave out no more than a
        share of the inertia (`error`), of some `kinds` or of all; what is attached: nothing, actuators, or the loop;
        names of inputs and outputs. The number of modes that are computed is doubled until they suffice.
    highest : float, optional
        Highest frequency of a response. Without a choice by the options, the modes up to it are kept, at least
        `STUDY.default_modes` and not many more than `STUDY.response_modes`. [Hz]

    Returns
    -------
    SuspensionChoice or ControlledChoice
        The latter with actuators or the loop attached.

    Raises
    ------
    SceneError
        `options.input` or `options.output` is unknown, the model has fewer modes than `options.count`, or the scene
        has no loop or no actuators to be attached.
    NoSolutionError, ConvergenceError
        There is no stable equilibrium, or no such modes; or these cannot be computed to the accuracy.
    """
    if options.attached:
        return choose_controlled(document, scene, options, highest)
    case = SuspensionCase(scene)
    inputs, outputs = labels(Layout(case.equilibrium), *_winches_and_markers(case, options))
    if not inputs:
        raise NoSolutionError(
            "a state space needs an input: a winch, an end of a cable, or a body or point that is free"
        )
    if not options.wind:
        pairs_of(options, inputs, outputs)  # raises SceneError before anything is computed
    size = MOTION.most_body_modes if case.fixed else options.count or STUDY.default_modes
    found, too_few = _found(case, options, size, highest), ""
    while True:
        choice = _with_all_modes(case, options, found, highest)
        share = None if options.error is None else (choice.share, choice.names)
        try:
            return replace(choice, chosen=chosen_modes(choice.found, options, share))
        except (SceneError, NoSolutionError) as lacking:
            if len(found) < size or size >= MOTION.most_body_modes:
                raise
            too_few, size = f"{lacking}; of more, ", min(2 * size, MOTION.most_body_modes)
        try:
            found = case.modes(size)
        except ConvergenceError as failure:
            raise ConvergenceError(f"{too_few}{failure}") from None


def _found(case, options, size, highest):
    """The lowest `CoupledModes`: a number of them, or up to the frequency of the options or of a response [Hz].

    Raises as `choose`.
    """
    if options.upto:
        return case.modes_up_to(options.limit)
    found, reached = case.modes(size), 0.0 if options.count or options.error else highest or 0.0
    while len(found) == size < STUDY.response_modes and found.frequency[-1] < reached:
        size *= 2
        found = case.modes(size)
    return found


def _with_all_modes(case, options, found, highest):
    """The `SuspensionChoice` that keeps all of the modes `found`.

    Where kinds are asked for, the modes are those of the linear model itself: close ones may be in another order there.
    """
    damped = found.damped
    whole = linear_model(case, damped, options)
    if options.kinds is not None:
        found, whole = of_system(damped, whole)
    return SuspensionChoice(options, case, highest, found, whole, np.arange(len(found)))


def _winches_and_markers(case, options):
    """Winches and markers of the scene, as the linear model takes them: lists of Winch and of Marker.

    Movements of the fixed ends of cables are among the winches where the options name one of them, or the force that
    holds one, and where nothing else is an input.
    """
    scene, suspension = case.scene, case.equilibrium.suspension
    cables, named = list(scene.cables), {*options.inputs, *options.outputs}
    winches, ends = winches_of(scene, cables), _movements_of_ends(suspension)
    is_named = any(named & {end.name(cables), end.force(cables)} for end in ends)
    if is_named or not (winches or suspension.free.any()):
        winches = winches + ends
    return winches, markers_of(scene)


def _movements_of_ends(suspension):
    """Movements along x, y and z of all ends of cables that are fixed, also on bodies that are held: list."""
    owner = suspension.owner[suspension.of_cables]
    fixed = (owner == GROUND) | ~suspension.free.any(axis=1)[owner] if len(suspension.free) else owner == GROUND
    return [EndMovement(*place, axis) for place in np.argwhere(fixed).tolist() for axis in np.eye(3)]


def linear_model(case, found, options):
    """`LinearSystem` from winches or moved ends and forces on bodies to displacements, forces on ends and tensions.

    Hysteretic damping is viscous in it, as a state space needs.

    Parameters
    ----------
    case : SuspensionCase
    found : CoupledModes
        Of which it has the coordinates.
    options : StateSpaceOptions
        The names of inputs and outputs; and whether forces on the nodes of the cables (`wind`) are inputs too.
    """
    system = suspension_system(found.layout, found.kept, *_winches_and_markers(case, options)).viscous()
    return with_node_forces(system, found.layout, found.model.coordinates) if options.wind else system
