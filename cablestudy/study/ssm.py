"""The cable of a scene as a state space: which modes are kept, what is attached, and the file."""

import os
from dataclasses import dataclass, replace

import numpy as np

from cablestudy.control import export, reduction, statespace
from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.scene.scene import missing
from cablestudy.scene.units import read_frequency
from cablestudy.study import case_modes, notes
from cablestudy.study.case import MAX_MODES, Case
from cablestudy.study.columns import broken
from cablestudy.study.table import write_whole
from cablestudy.system.superelement import GONDOLA, NAMES

KINDS = {"inplane": "in-plane", "outofplane": "out-of-plane", "axial": "axial"}
DEFAULT_MODES = 12  # of a model that is as fine as the accuracy asks for
LOWEST, HIGHEST = 1e-100, 1e100  # response frequencies, whose squares neither underflow nor overflow [Hz]
MAX_FREQUENCIES = 10_000_000
END = "end_2_x"
PLACES = {"ground": "A, winch on the ground", "gondola": "B, winch on the gondola"}


@dataclass(frozen=True)
class Options:
    """The options of the command.

    Attributes
    ----------
    count, upto, error : int, str, float or None
        At most one of: a number of modes, a frequency up to which all are kept, an error.
    kinds : str or None
        Names of KINDS, separated by commas.
    residual : bool
        Whether the static part of omitted modes is kept.
    attached : {None, "gondola", "loop"}
    wind : bool
        Whether forces on the nodes are inputs.
    input, output : str
        End displacement and end force that errors and responses refer to.

    Raises
    ------
    SceneError
        Values that are not allowed, or that exclude each other.
    """

    count: int | None = None
    upto: str | None = None
    error: float | None = None
    kinds: str | None = None
    residual: bool = True
    attached: str | None = None
    wind: bool = False
    input: str = END
    output: str = END

    def __post_init__(self):
        if sum(value is not None for value in (self.count, self.upto, self.error)) > 1:
            raise SceneError("--modes, --upto and --error exclude each other")
        if self.count is not None and self.count > MAX_MODES:
            raise SceneError(f"--modes {self.count}: at most {MAX_MODES} are computed")
        if self.error is not None and not 0 < self.error < 1:
            raise SceneError(f"--error: must be between 0 and 1, got {self.error:g}")
        wrong = [name for name in self._kind_names if name not in KINDS]
        if wrong:
            raise SceneError(f"--kinds: unknown kind {', '.join(map(repr, wrong))} (allowed: {', '.join(KINDS)})")
        _ = self.limit  # raises for a text that is no frequency

    @property
    def _kind_names(self):
        return list(KINDS) if self.kinds is None else [name.strip().replace("-", "") for name in self.kinds.split(",")]

    @property
    def wanted_kinds(self):
        """Kinds of modes to keep, in the words of `Modes.kind`."""
        return [KINDS[name] for name in self._kind_names]

    @property
    def limit(self):
        """Frequency of --upto. [Hz]"""
        return None if self.upto is None else read_frequency("--upto", self.upto)

    @property
    def pair(self):
        """Indices of the force and of the displacement among the six ends."""
        return NAMES.index(self.output), NAMES.index(self.input)


def read_span(text):
    """Reads FROM:TO:COUNT, the range and number of response frequencies.

    Parameters
    ----------
    text : str
        For example `0.01Hz:100Hz:2000`; a bare number is in Hz.

    Returns
    -------
    low, high : float
        [Hz]
    count : int

    Raises
    ------
    SceneError
        Not of this form, a range that is reversed or beyond LOWEST and HIGHEST, too few or too many frequencies.
    """
    option = f"--response {text}"
    parts = text.split(":")
    if len(parts) != 3:
        raise SceneError(f"{option}: expected FROM:TO:COUNT, for example 0.01Hz:100Hz:2000")
    low, high = (read_frequency(option, part) for part in parts[:2])
    if low >= high:
        raise SceneError(f"{option}: FROM must be below TO")
    if low < LOWEST or high > HIGHEST:
        raise SceneError(f"{option}: frequencies must be between {LOWEST:g} and {HIGHEST:g} Hz")
    count = parts[2].strip()
    if not (count.isascii() and count.isdigit()) or len(count) > 9 or not 2 <= int(count) <= MAX_FREQUENCIES:
        raise SceneError(f"{option}: COUNT must be a whole number from 2 to {MAX_FREQUENCIES}")
    return low, high, int(count)


def check_file(path):
    """Refuses an output file of unknown kind or in a folder that is not writable, before anything is computed."""
    if path is None:
        return
    if os.path.splitext(path)[1].lower() not in export.KINDS:
        raise SceneError(f"--out {path}: unknown kind of file (allowed: {', '.join(export.KINDS)})")
    if os.path.isdir(path) or not os.access(os.path.dirname(path) or ".", os.W_OK):
        raise SceneError(f"--out {path}: cannot be written")


@dataclass(frozen=True)
class Choice:
    """The cable of a scene with the modes to keep.

    Attributes
    ----------
    options : Options
    case : Case
        With the discretisation that is used.
    modes : Modes
        All of `case.end_model`.
    chosen : ndarray of int
        Indices of the modes to keep.
    notes, warnings : tuple of str
    """

    options: Options
    case: Case
    modes: object
    chosen: np.ndarray
    notes: tuple
    warnings: tuple

    @property
    def kept(self):
        """Superelement of the chosen modes."""
        model = self.case.end_model
        return model.select(self.chosen) if self.options.residual else reduction.truncated(model, self.chosen)

    def system(self):
        """The StateSpace of the cable, alone or with gondola or winch loop.

        Raises
        ------
        NoSolutionError
            Entries that are not finite.
        """
        case, options = self.case, self.options
        kept = {"chosen": self.chosen, "residual": options.residual}
        kept["forces"] = nodal_forces(case, self.modes) if options.wind else None
        if options.attached == "loop":
            return statespace.closed(replace(case.loop, cable=case.end_model), **kept)
        if options.attached == "gondola":
            return statespace.coupled(case.end_model, case.scene.gondola.mass, location(case.scene), **kept)
        return statespace.cable(case.end_model, **kept)


def location(scene):
    """Location of the winch; on the ground for a scene without one."""
    return scene.winch.location if scene.winch else "ground"


def choose(document, scene, options):
    """Chooses the modes to keep.

    Parameters
    ----------
    document : Document
        Of the scene.
    scene : Scene
    options : Options

    Returns
    -------
    Choice

    Raises
    ------
    SceneError
        Gondola or winch is missing, or the model has fewer modes than asked for.
    NoSolutionError, ConvergenceError
        There are no such modes, or not to the accuracy.
    """
    if options.attached and scene.gondola is None:
        raise missing(document, "gondola", f"ssm --with {options.attached}")
    if options.attached == "loop" and (scene.winch is None or scene.winch.controller is None):
        raise missing(document, "winch" if scene.winch is None else "winch.controller", "ssm --with loop")
    case, found, accurate, notes = _candidates(Case(scene), options)
    allowed = [k for k in found.select() if k < accurate and found.kind[k] in options.wanted_kinds]
    chosen = _chosen(case, found, np.array(allowed, dtype=int), options)
    if not options.residual and not found.complete:
        raise NoSolutionError(f"--no-residual needs every mode of the model, and only {len(found)} are computed")
    choice = Choice(options, case, found, chosen, tuple(notes), ())
    return replace(choice, notes=(*notes, *_about(choice)), warnings=tuple(_warnings(choice)))


def _candidates(case, options):
    """Case with its final model, all modes of the model, how many of these meet the accuracy, and notes."""
    if not case.exact_statics:
        reason = broken(case)
        if reason:
            raise NoSolutionError(reason)
        found = case.dynamics.modes(min(case.dynamics.dof, MAX_MODES))
        model = case.scene.model
        note = f"motion: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says"
        return case, found, len(found), [note]
    size, reached = options.count or DEFAULT_MODES, ""
    while True:
        try:
            finer, some, notes, _ = case_modes.modes(case, None if options.upto else size, options.limit)
        except ConvergenceError as failure:
            raise ConvergenceError(f"{reached}{failure}") from None
        lacking = _lacking(finer, some, options)
        if not lacking:
            found = finer.dynamics.modes(min(finer.dynamics.dof, MAX_MODES))
            return finer, found, len(some), list(notes)
        if size >= MAX_MODES:
            raise NoSolutionError(f"{lacking}, and no more than {MAX_MODES} are computed")
        reached = f"{lacking}; of more, "
        size = min(2 * size, MAX_MODES)


def _lacking(case, modes, options):
    """Why the lowest modes are not enough for what is asked; empty when they are."""
    of_kind = [k for k in range(len(modes)) if modes.kind[k] in options.wanted_kinds]
    if options.error is not None:
        share = reduction.inertia_share(case.end_model, *options.pair)
        omitted = share.sum() - share[of_kind].sum()
        if omitted > options.error:
            return (
                f"--error {options.error:g}: the {len(modes)} lowest modes leave out {omitted:.3g} of the inertia "
                f"between {options.input} and {options.output} "
                f"(with a fixed number of model.elements all modes of the model are used)"
            )
    elif not options.upto and len(of_kind) < (options.count or 0):
        return f"the {len(modes)} lowest modes are not enough for what is asked"
    return ""


def _chosen(case, found, allowed, options):
    """Indices of the modes to keep, among those that are allowed."""
    if options.upto:
        return allowed[found.frequency[allowed] <= options.limit]
    if options.error is not None:
        share = reduction.inertia_share(case.end_model, *options.pair)
        excluded = share.sum() - share[allowed].sum()
        if excluded > options.error:
            raise NoSolutionError(
                f"--error {options.error:g} cannot be reached with these kinds of modes: "
                f"without the others it is {excluded:.3g}"
            )
        return allowed[reduction.fewest(share[allowed], options.error - excluded)]
    if options.count is not None and len(allowed) < options.count:
        words = "" if options.kinds is None else f"{' and '.join(options.wanted_kinds)} "
        raise SceneError(f"--modes {options.count}: the model has {len(allowed)} {words}modes")
    return allowed[: options.count]


def _about(choice):
    """Notes on what is modelled and what is left out."""
    case, options = choice.case, choice.options
    strain = case.end_model.strain
    share = reduction.inertia_share(case.end_model, *options.pair)
    omitted = float(np.delete(share, choice.chosen).sum())
    static = "kept in D" if options.residual else "left out too"
    yield (
        f"left out: {len(choice.modes) - len(choice.chosen)} modes, which carry {omitted:.3g} of the inertia between "
        f"{options.input} and {options.output}; their static part is {static}"
    )
    if options.attached != "loop":
        yield "not in A, B, C, D: forces at a moved end by its own velocity and acceleration (D1 and D2 of the file)"
    if options.attached == "gondola" and case.scene.winch is None:
        yield "winch: on the ground, since the scene has no winch"
    yield from notes.assumed_damping(case.scene)
    if strain is not None and strain.law == "hysteretic":
        yield "damping: hysteretic, which has no state space; each mode has the ratio that dissipates the same energy"
    elif strain is not None:
        yield "damping: Kelvin-Voigt, exact"


def _warnings(choice):
    """A wrong static stiffness, an unstable loop."""
    if not choice.options.residual:
        stiffness = (model.stiffness[GONDOLA, GONDOLA] for model in (choice.kept, choice.case.end_model))
        wrong, right = map(float, stiffness)
        yield (
            f"warning: --no-residual leaves out the static part of the omitted modes: "
            f"static stiffness {wrong:.5g} N/m instead of {right:.5g} N/m"
        )
    if choice.options.attached == "loop":
        try:
            choice.case.loop.check_stable()
        except NoSolutionError as error:
            yield f"warning: {error}"


def nodal_forces(case, modes):
    """Forces on the interior nodes along x, y and z, numbered from 0 at end 1.

    Parameters
    ----------
    case : Case
    modes : Modes
        All of `case.end_model`.

    Returns
    -------
    statespace.Forces
    """
    frame, inner = case.span.frame, modes.shapes[1:-1]
    modal = np.einsum("nak,ag->kng", inner, frame).reshape(inner.shape[2], -1)
    transfer = np.zeros((6, len(inner), 3))
    for system in case.dynamics.systems:
        axes = list(system.axes)
        second = system.end_shapes[1:-1]
        for end, shapes in enumerate((np.eye(len(axes)) - second, second)):
            # share of a force along a at a node that an end takes along b
            transfer[np.ix_([3 * end + b for b in axes], range(len(inner)), axes)] = shapes.transpose(2, 0, 1)
    both_frames = np.kron(np.eye(2), frame)
    transfer = both_frames.T @ (transfer @ frame).reshape(6, -1)
    labels = tuple((f"force_node_{k + 1}_{axis}", "N") for k in range(len(inner)) for axis in "xyz")
    return statespace.Forces(modal, transfer, labels)


def size_line(choice, system):
    """A line with the size of a state space."""
    return (
        f"state space: {len(system.states)} states, {len(system.inputs)} inputs, {len(system.outputs)} outputs; "
        f"{len(choice.chosen)} of {len(choice.modes)} modes"
    )


def write(system, path):
    """Writes a state space in the format of the file name's ending, completely or not at all."""
    write_whole(path, export.KINDS[os.path.splitext(path)[1].lower()](system))
