"""The cable of a scene as a state space: which modes, with what on it, as file, table and frequency response."""

import os
from dataclasses import dataclass, replace

import numpy as np

from cablestudy.control import export, reduction, statespace
from cablestudy.control.ends import GONDOLA, NAMES
from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.scene.scene import missing
from cablestudy.scene.units import read_frequency
from cablestudy.study import row
from cablestudy.study.case import MAX_MODES, Case
from cablestudy.study.columns import broken
from cablestudy.study.table import write_whole

KINDS = {"inplane": "in-plane", "outofplane": "out-of-plane", "axial": "axial"}
DEFAULT_MODES = 12  # of a model that is as fine as the accuracy asks for
LOWEST, HIGHEST = 1e-100, 1e100  # response frequencies; squares of others might be no numbers [Hz]
MAX_FREQUENCIES = 10_000_000
END = "end_2_x"
PLACES = {"ground": "A, winch on the ground", "gondola": "B, winch on the gondola"}


@dataclass(frozen=True)
class Wish:
    """What the user asks for; checked when made.

    Attributes
    ----------
    count, upto, error : str, int, float or None
        At most one: so many modes, all up to a frequency, or as many as the error needs.
    kinds : str or None
        Names of KINDS, separated by commas.
    residual : bool
    attached : {None, "gondola", "loop"}
    wind : bool
        Whether forces on the nodes are inputs.
    input, output : str
        End displacement and end force that errors and responses are about.
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
            raise SceneError(f"--modes {self.count}: at most {MAX_MODES} can be had")
        if self.error is not None and not 0 < self.error < 1:
            raise SceneError(f"--error: must be between 0 and 1, got {self.error:g}")
        wrong = [name for name in self._kind_names if name not in KINDS]
        if wrong:
            raise SceneError(f"--kinds: unknown kind {', '.join(map(repr, wrong))} (allowed: {', '.join(KINDS)})")
        _ = self.limit

    @property
    def _kind_names(self):
        return list(KINDS) if self.kinds is None else [name.strip().replace("-", "") for name in self.kinds.split(",")]

    @property
    def wanted_kinds(self):
        """As `Modes.kind` has them."""
        return [KINDS[name] for name in self._kind_names]

    @property
    def limit(self):
        """Of --upto. [Hz]"""
        return None if self.upto is None else read_frequency("--upto", self.upto)

    @property
    def pair(self):
        """Index of the force and of the displacement among the six."""
        return NAMES.index(self.output), NAMES.index(self.input)


def read_span(text):
    """Ends and number of the frequencies of FROM:TO:COUNT.

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
        Not such a text, a range that is reversed, reaches zero or leaves all reason, too few or too many.
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
    """Refuse a file of unknown kind, or where none can be written, before anything is computed."""
    if path is None:
        return
    if os.path.splitext(path)[1].lower() not in export.KINDS:
        raise SceneError(f"--out {path}: unknown kind of file (allowed: {', '.join(export.KINDS)})")
    if os.path.isdir(path) or not os.access(os.path.dirname(path) or ".", os.W_OK):
        raise SceneError(f"--out {path}: cannot be written")


@dataclass(frozen=True)
class Choice:
    """A scene's cable with the modes to keep.

    Attributes
    ----------
    wish : Wish
    case : Case
        With the discretisation that is used.
    modes : Modes
        All of `case.end_model`.
    chosen : ndarray of int
    notes, warnings : tuple of str
    """

    wish: Wish
    case: Case
    modes: object
    chosen: np.ndarray
    notes: tuple
    warnings: tuple

    @property
    def kept(self):
        """EndModel of the chosen modes."""
        model = self.case.end_model
        return model.select(self.chosen) if self.wish.residual else reduction.truncated(model, self.chosen)

    def system(self):
        """The StateSpace, alone or with what is attached."""
        case, wish = self.case, self.wish
        options = {"chosen": self.chosen, "residual": wish.residual, "forces": _nodal(self) if wish.wind else None}
        if wish.attached == "loop":
            return statespace.closed(replace(case.loop, cable=case.end_model), **options)
        if wish.attached == "gondola":
            return statespace.coupled(case.end_model, case.scene.gondola.mass, location(case.scene), **options)
        return statespace.cable(case.end_model, **options)


def location(scene):
    """Where the winch is; on the ground when the scene has none."""
    return scene.winch.location if scene.winch else "ground"


def choose(document, scene, wish):
    """The modes to keep.

    Parameters
    ----------
    document : Document
        Of the scene.
    scene : Scene
    wish : Wish

    Returns
    -------
    Choice

    Raises
    ------
    SceneError
        What is to be attached is missing, or more modes are asked for than there are.
    NoSolutionError, ConvergenceError
        No such modes, or not to the accuracy.
    """
    if wish.attached and scene.gondola is None:
        raise missing(document, "gondola", f"ssm --with {wish.attached}")
    if wish.attached == "loop" and (scene.winch is None or scene.winch.controller is None):
        raise missing(document, "winch" if scene.winch is None else "winch.controller", "ssm --with loop")
    case, found, known, notes = _candidates(Case(scene), wish)
    allowed = [k for k in found.select() if k < known and found.kind[k] in wish.wanted_kinds]
    chosen = _chosen(case, found, np.array(allowed, dtype=int), wish)
    if not wish.residual and not found.complete:
        raise NoSolutionError(f"--no-residual needs every mode of the model, and only {len(found)} can be had")
    choice = Choice(wish, case, found, chosen, tuple(notes), ())
    return Choice(wish, case, found, chosen, (*notes, *_about(choice)), tuple(_warnings(choice)))


def _candidates(case, wish):
    """Case, all modes of its model, how many of them are to its accuracy, notes."""
    if not case.exact_statics:
        reason = broken(case)
        if reason:
            raise NoSolutionError(reason)
        found = case.dynamics.modes(min(case.dynamics.dof, MAX_MODES))
        model = case.scene.model
        note = f"motion: {model.elements} elements of order {model.order}, {model.mass} mass, as the scene says"
        return case, found, len(found), [note]
    size, reached = wish.count or DEFAULT_MODES, ""
    while True:
        try:
            finer, some, notes, _ = row.modes(case, None if wish.upto else size, wish.limit)
        except ConvergenceError as failure:
            raise ConvergenceError(f"{reached}{failure}") from None
        found = finer.dynamics.modes(min(finer.dynamics.dof, MAX_MODES))
        of_kind = [k for k in range(len(some)) if some.kind[k] in wish.wanted_kinds]
        lacking = f"the {len(some)} lowest modes are not enough for what is asked"
        if wish.upto:
            enough = True
        elif wish.error is None:
            enough = len(of_kind) >= (wish.count or 0)
        else:
            share = reduction.share_omitted(finer.end_model, *([k] for k in wish.pair))
            left = share.sum() - share[of_kind].sum()
            enough = left <= wish.error
            lacking = (
                f"--error {wish.error:g}: the {len(some)} lowest modes leave out {left:.3g} of the inertia between "
                f"{wish.input} and {wish.output} (a model of fixed model.elements has no more modes than it needs)"
            )
        if enough:
            return finer, found, len(some), list(notes)
        reached = f"{lacking}; of more, "
        if size >= MAX_MODES:
            raise NoSolutionError(f"{lacking}, and no more than {MAX_MODES} can be had")
        size = min(2 * size, MAX_MODES)


def _chosen(case, found, allowed, wish):
    """Indices of the modes to keep, of those that are allowed."""
    if wish.upto:
        return allowed[found.frequency[allowed] <= wish.limit]
    if wish.error is not None:
        share = reduction.share_omitted(case.end_model, *([k] for k in wish.pair))
        room = wish.error - (share.sum() - share[allowed].sum())
        if room < 0:
            raise NoSolutionError(
                f"--error {wish.error:g} cannot be had with these kinds of modes: "
                f"without the others it is {share.sum() - share[allowed].sum():.3g}"
            )
        return allowed[reduction.fewest(share[allowed], room)]
    if wish.count is not None and len(allowed) < wish.count:
        words = "" if wish.kinds is None else f"{' and '.join(wish.wanted_kinds)} "
        raise SceneError(f"--modes {wish.count}: the model has {len(allowed)} {words}modes")
    return allowed[: wish.count]


def _about(choice):
    """What is modelled and what is left out."""
    case, wish = choice.case, choice.wish
    strain = case.end_model.strain
    share = reduction.share_omitted(case.end_model, *([k] for k in wish.pair))
    omitted = float(np.delete(share, choice.chosen).sum())
    yield (
        f"left out: {len(choice.modes) - len(choice.chosen)} modes, which carry {omitted:.3g} of the inertia between "
        f"{wish.input} and {wish.output}; their static part is {'kept in D' if wish.residual else 'left out too'}"
    )
    if wish.attached != "loop":
        yield "not in A, B, C, D: what a moved end feels of its own speed and acceleration (D1 and D2 of the file)"
    if wish.attached == "gondola" and case.scene.winch is None:
        yield "winch: on the ground, since the scene has none"
    if strain is not None and strain.law == "hysteretic":
        yield "damping: hysteretic, which no state space has; each mode got the ratio that loses the same energy"
    elif strain is not None:
        yield "damping: Kelvin-Voigt, exact"


def _warnings(choice):
    if not choice.wish.residual:
        stiffness = (model.stiffness[GONDOLA, GONDOLA] for model in (choice.kept, choice.case.end_model))
        wrong, right = map(float, stiffness)
        yield (
            f"warning: --no-residual leaves out the static part of the omitted modes: "
            f"static stiffness {wrong:.5g} N/m instead of {right:.5g} N/m"
        )
    if choice.wish.attached == "loop":
        try:
            choice.case.loop.check_stable()
        except NoSolutionError as error:
            yield f"warning: {error}"


def _nodal(choice):
    """Forces on the interior nodes along x, y and z, numbered from 0 at end 1."""
    case, frame = choice.case, choice.case.span.frame
    inner = choice.modes.shapes[1:-1]
    modal = np.einsum("nak,ag->kng", inner, frame).reshape(inner.shape[2], -1)
    carried = np.zeros((6, len(inner), 3))
    for system in case.dynamics.systems:
        axes = list(system.axes)
        second = system.end_shapes[1:-1]
        for end, shapes in enumerate((np.eye(len(axes)) - second, second)):
            # the share of a force along a at a node that an end holds along b
            carried[np.ix_([3 * end + b for b in axes], range(len(inner)), axes)] = shapes.transpose(2, 0, 1)
    turn = np.kron(np.eye(2), frame)
    carried = turn.T @ (carried @ frame).reshape(6, -1)
    labels = tuple((f"force_node_{k + 1}_{axis}", "N") for k in range(len(inner)) for axis in "xyz")
    return statespace.Forces(modal, carried, labels)


def size_line(choice, system):
    """One line on the size of a state space."""
    return (
        f"state space: {len(system.states)} states, {len(system.inputs)} inputs, {len(system.outputs)} outputs; "
        f"{len(choice.chosen)} of {len(choice.modes)} modes"
    )


def write(system, path):
    """A file of the kind that its name says, whole or not at all."""
    write_whole(path, export.KINDS[os.path.splitext(path)[1].lower()](system))
