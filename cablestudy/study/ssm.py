"""The cable of a scene as a state space: which modes are kept, what is attached, and the file."""

import os
import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control import export, statespace
from cablestudy.control.proper import channels, proper
from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError, refuse_options
from cablestudy.scene.fields import suggestion
from cablestudy.scene.scene import missing
from cablestudy.scene.units import read_frequency
from cablestudy.study.case import MAX_MODES, Case
from cablestudy.study.case_modes import about_errors, modes
from cablestudy.study.notes import assumed_damping, strength_warning
from cablestudy.study.table import write_whole
from cablestudy.system.superelement import GONDOLA, NAMES

KINDS = {"inplane": "in-plane", "outofplane": "out-of-plane", "axial": "axial"}
DEFAULT_MODES = 12  # of a model to an accuracy
LOWEST, HIGHEST = 1e-100, 1e100  # response frequencies, whose squares neither underflow nor overflow [Hz]
MAX_FREQUENCIES = 10_000_000
MOST_STATES = 1000  # of which the poles are found in a second or two
END = "end_2_x"
NEAR = 20  # times the gondola's frequency: up to there a delay is right at least
FEW = 12  # names that a message lists all, beside the nearest one
DAMPING_NOTES = {
    "modal": (),
    "hysteretic": (
        "damping: hysteretic, which has no state space: viscous in A, each mode with the ratio that dissipates the "
        "same energy",
    ),
    "kelvin_voigt": ("damping: Kelvin-Voigt, exact",),
}

# input and output of the response of one cable with a gondola
SHOWN = {"gondola": ("winch", "gondola_position"), "loop": ("force_gondola", "gondola_position")}


@dataclass(frozen=True)
class StateSpaceOptions:
    """The options of the command; SceneError for values that are not allowed, or that exclude each other.

    At most one of `count`, `upto` and `error` is given.
    """

    count: int | None = None  # number of modes
    upto: str | None = None  # frequency up to which all modes are kept
    error: float | None = None  # share of the inertia that may be left out
    kinds: str | None = None  # names of KINDS, separated by commas
    residual: bool = True  # whether the static part of omitted modes is kept
    attached: str | None = None  # None, "gondola" or "loop"
    wind: bool = False  # whether forces on the nodes are inputs
    input: str | None = None  # inputs and outputs that errors and responses refer to, names separated by commas
    output: str | None = None
    proper: bool = False  # whether the file has accelerations as inputs instead of derivatives of them

    def __post_init__(self):
        if sum(value is not None for value in (self.count, self.upto, self.error)) > 1:
            raise SceneError("--modes, --upto and --error exclude each other")
        if self.count is not None and self.count > MAX_MODES:
            raise SceneError(f"--modes {self.count}: at most {MAX_MODES} are computed")
        if self.error is not None and not 0 < self.error < 1:
            raise SceneError(f"--error: must be between 0 and 1, got {self.error:g}")
        if self.error is not None and max(len(self.inputs), len(self.outputs)) > 1:
            raise SceneError("--error: refers to one --input and one --output")
        _ = self.kinds_kept, self.limit  # raise SceneError

    @cached_property
    def kinds_kept(self):
        """Kinds of modes to keep, as `Modes.kind` names them."""
        names = list(KINDS) if self.kinds is None else [name.strip().replace("-", "") for name in self.kinds.split(",")]
        wrong = [name for name in names if name not in KINDS]
        if wrong:
            raise SceneError(f"--kinds: unknown kind {', '.join(map(repr, wrong))} (allowed: {', '.join(KINDS)})")
        return [KINDS[name] for name in names]

    @cached_property
    def limit(self):
        """Frequency of --upto. [Hz]"""
        return None if self.upto is None else read_frequency("--upto", self.upto)

    @property
    def inputs(self):
        """Names of the inputs: tuple, empty for the one that is shown by default, or for all of a file."""
        return _names(self.input)

    @property
    def outputs(self):
        """Names of the outputs, as `inputs`."""
        return _names(self.output)

    @property
    def ends(self):
        """Of a single cable, names of the displaced end and of the end with the force."""
        return self.all_ends[0]

    @property
    def all_ends(self):
        """Names of each pair of an output and an input: list of (str, str)."""
        if self.attached:  # names are those of the state space, for the file
            return [(END, END)]
        outputs = [name.removeprefix("force_") for name in self.outputs or (END,)]
        return [(displaced, end) for end in outputs for displaced in self.inputs or (END,)]

    @property
    def pair(self):
        """Indices of the force and of the displacement among the six ends of a single cable; SceneError."""
        return self.pairs[0]

    @property
    def pairs(self):
        """Numbers of each pair of an output and an input: list of (int, int); SceneError."""
        return [
            (number_of("--output", end, NAMES), number_of("--input", displaced, NAMES))
            for displaced, end in self.all_ends
        ]


def _names(text):
    """The names in a text, separated by commas, each once: tuple of str."""
    return tuple(dict.fromkeys(name.strip() for name in (text or "").split(",") if name.strip()))


def number_of(option, name, names):
    """Place of a name among those allowed for an option; SceneError if it is none of them."""
    if name not in names:
        near = suggestion(name, names)
        listed = f" allowed: {', '.join(names)}" if near.startswith("did") and len(names) <= FEW else ""
        raise SceneError(f"{option} {name}: unknown ({near}{listed})")
    return list(names).index(name)


def read_span(text):
    """Read FROM:TO:COUNT, the range and number of response frequencies, for example `0.01Hz:100Hz:2000`.

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
    if not re.fullmatch("[0-9]{1,9}", count) or not 2 <= int(count) <= MAX_FREQUENCIES:
        raise SceneError(f"{option}: COUNT must be a whole number from 2 to {MAX_FREQUENCIES}")
    return low, high, int(count)


def check_file(path):
    """Raise SceneError for an output file of unknown kind, or that cannot be written, before anything is computed."""
    if path is None:
        return
    if os.path.splitext(path)[1].lower() not in export.KINDS:
        raise SceneError(f"--out {path}: unknown kind of file (allowed: {', '.join(export.KINDS)})")
    if os.path.isdir(path) or not os.access(os.path.dirname(path) or ".", os.W_OK):
        raise SceneError(f"--out {path}: cannot be written")


@dataclass(frozen=True)
class Choice:
    """The cable of a scene with the modes to keep."""

    options: StateSpaceOptions
    case: Case  # with the discretisation that is used
    modes: object  # `Modes`, all of `case.end_model`
    chosen: np.ndarray  # indices of the modes to keep
    about_model: tuple  # notes on the discretisation

    @property
    def kept(self):
        """Superelement of the chosen modes."""
        model = self.case.end_model
        return model.condense(self.chosen) if self.options.residual else model.truncate(self.chosen)

    def system(self):
        """The StateSpace of the cable, alone or with gondola or winch loop; NoSolutionError where it overflows."""
        case, options = self.case, self.options
        kept = {"chosen": self.chosen, "residual": options.residual}
        kept["forces"] = nodal_forces(case, self.modes) if options.wind else None
        if options.attached == "loop":
            return statespace.closed(self.loop, **kept, highest=self.right_up_to)
        if options.attached == "gondola":
            winch = case.scene.winch
            location = winch.location if winch else "ground"
            kept["damping"] = case.gondola_air_damping
            return statespace.coupled(case.end_model, case.scene.gondola.mass, location, **kept)
        return statespace.cable(case.end_model, **kept)

    @property
    def whole(self):
        """The `Movement` that has the loop, stable or not; raises as `InWind.controlled`."""
        return self.case.in_wind.controlled

    @property
    def loop(self):
        """The `WinchLoop` of all modes of `case.end_model`; raises as `whole`, and where no gain can be had."""
        scene, loop = self.case.scene, self.whole.loop
        return statespace.WinchLoop(
            self.case.end_model,
            scene.gondola.mass,
            scene.winch.location,
            loop.gain,
            loop.notches[0],
            loop.law,
            self.case.gondola_air_damping,
        )

    @property
    def right_up_to(self):
        """Frequency up to which the delay of the loop is right; 0 without one. [rad/s]"""
        law = self.whole.loop.law
        if not law.delay:
            return 0.0
        highest = self.case.end_model.omega[self.chosen].max(initial=0.0)
        return min(max(highest, NEAR * 2 * np.pi * self.case.gondola_mode.frequency[0]), law.reach)

    @property
    def poles(self):
        """Of what a response shows, with gondola or loop none where there are more than MOST_STATES. [rad/s]"""
        if self.options.attached:
            a = self.system().a
            return np.linalg.eigvals(a) if len(a) <= MOST_STATES else np.zeros(0, dtype=complex)
        kept = self.kept
        moved = sum(np.abs(np.prod(kept.participation[:, list(pair)], axis=1)) for pair in self.options.pairs)
        shown = moved > 1e-20 * moved.max(initial=0.0)  # others are zero but for rounding
        ratio = np.minimum(kept.damping_ratio[shown], 1.0)
        return kept.omega[shown] * (-ratio + 1j * np.sqrt(1 - ratio**2))

    @property
    def notes(self):
        """Notes on what is modelled and what is left out: list of str."""
        case, options = self.case, self.options
        share = case.end_model.inertia_share(*options.pair)
        omitted = float(np.delete(share, self.chosen).sum())
        static = "kept in D" if options.residual else "left out too"
        notes = [
            *self.about_model,
            *about_errors(case, self.modes.first(int(max(self.chosen, default=-1)) + 1)),
            f"left out: {len(self.modes) - len(self.chosen)} modes, which carry {omitted:.3g} of the inertia between "
            f"{' and '.join(options.ends)}; their static part is {static}",
        ]
        if options.attached != "loop":
            notes.append(
                "not in A, B, C, D: forces at a moved end by its own velocity and acceleration (D1 and D2 of the file; "
                "--proper takes the acceleration as input, and has them)"
            )
        if options.attached == "gondola" and case.scene.winch is None:
            notes.append("winch: on the ground, since the scene has no winch")
        if options.attached and case.gondola_air_damping:
            notes.append(
                f"aerodynamic damping: {case.gondola_air_damping:.4g} N s/m on the gondola "
                f"(wind.aerodynamic_damping: false leaves it out)"
            )
        if options.attached == "loop" and case.scene.winch.delay:
            right = self.right_up_to / (2 * np.pi)
            notes.append(f"delay: Padé approximants, whose phase is right to 1e-7 up to {right:.4g} Hz")
        strain = case.end_model.strain
        law = "modal" if strain is None else strain.law
        return [*notes, *assumed_damping(case.scene), *DAMPING_NOTES[law]]

    @property
    def warnings(self):
        """A stress above the strength, a wrong static stiffness, an unstable loop: list of str."""
        warnings = list(strength_warning(self.case))
        if not self.options.residual:
            wrong, right = (float(model.stiffness[GONDOLA, GONDOLA]) for model in (self.kept, self.case.end_model))
            warnings.append(
                f"warning: --no-residual leaves out the static part of the omitted modes: "
                f"static stiffness {wrong:.5g} N/m instead of {right:.5g} N/m"
            )
        if self.options.attached == "loop":
            try:
                self.case.in_wind.check_stable()
            except NoSolutionError as error:
                warnings.append(f"warning: {error}")
        return warnings


def has_loss_factor(dampings):
    """True if any of some `Damping` is hysteretic."""
    return any(damping.model == "hysteretic" and damping.loss_factor for damping in dampings)


def viscous_note(dampings):
    """That hysteretic damping is viscous in A, at most one line.

    Parameters
    ----------
    dampings : sequence of scene.cable_table.DampingTable
        Of all cables.
    """
    if has_loss_factor(dampings):
        yield (
            "note: hysteretic damping is viscous in A, B, C, D, with the same loss of each mode at its frequency: "
            "margins and RMS of this model differ a little from those of 'cablestudy loop' and 'windrms'"
        )


def check_channel(options, responds):
    """Refuse an input or output of `StateSpaceOptions` that is not what the response of a gondola shows.

    Without a response any.
    """
    attached, shown = options.attached, (None, None)
    use = "for --response, --error and --out only"
    if responds:
        shown = SHOWN[attached]
        use = f"--with {attached} shows the response from {shown[0]} to {shown[1]}"
    for name, given, default in zip(("input", "output"), (options.input, options.output), shown, strict=True):
        refuse_options({f"--{name}": given != default and given}, use)


def choose(document, scene, options):
    """Choose the modes to keep.

    Parameters
    ----------
    document : Document
        Of the scene, for the places of mistakes.
    scene : CableScene
    options : StateSpaceOptions

    Returns
    -------
    Choice

    Raises
    ------
    SceneError
        Gondola or winch is missing, or the model has fewer modes than `options.count`.
    NoSolutionError, ConvergenceError
        There are no such modes, or not to the accuracy.
    """
    _ = options.pair  # raises SceneError
    _check_attached(document, scene, options.attached)
    fixed, before = scene.model.elements is not None, ""
    size = MAX_MODES if fixed else options.count or DEFAULT_MODES
    while True:
        try:
            case, some, notes, _ = modes(Case(scene), None if options.upto else size, options.limit)
        except ConvergenceError as failure:
            raise ConvergenceError(f"{before}{failure}") from None
        found = case.dynamics.modes(min(case.dynamics.dof, MAX_MODES))
        try:
            chosen = _chosen(case, found, len(some), options)
            break
        except (SceneError, NoSolutionError) as lacking:
            if fixed:
                raise
            if size == MAX_MODES:
                raise NoSolutionError(f"{lacking}, and no more than {MAX_MODES} are computed") from None
            before = f"{lacking} (with a fixed number of model.elements, of all modes of the model); of more, "
        size = min(2 * size, MAX_MODES)
    if not options.residual and not found.complete:
        raise NoSolutionError(f"--no-residual needs every mode of the model, and only {len(found)} are computed")
    return Choice(options, case, found, chosen, notes)


def _check_attached(document, scene, attached):
    """Refuse a gondola or a winch loop that the scene does not have."""
    if attached and scene.gondola is None:
        raise missing(document, "gondola", f"ssm --with {attached}")
    if attached == "loop" and (scene.winch is None or scene.winch.controller is None):
        raise missing(document, "winch" if scene.winch is None else "winch.controller", "ssm --with loop")


def _chosen(case, found, accurate, options):
    """Indices of the modes to keep, of the lowest that are accurate; SceneError or NoSolutionError for too few."""
    allowed = [k for k in found.select() if k < accurate and found.kind[k] in options.kinds_kept]
    allowed = np.array(allowed, dtype=int)
    if options.upto:
        return allowed[found.frequency[allowed] <= options.limit]
    kinds = "" if options.kinds is None else f"{' and '.join(options.kinds_kept)} "
    if options.error is not None:
        share = case.end_model.inertia_share(*options.pair)
        which = f"the {kinds}ones of the {accurate}" if kinds else f"the {accurate}"
        return fewest_modes(share, allowed, options.error, which, options.ends)
    if options.count is not None and len(allowed) < options.count:
        among = f" among its {accurate} lowest" if kinds else ""
        raise SceneError(f"--modes {options.count}: the model has {len(allowed)} {kinds}modes{among}")
    return allowed[: options.count]


def fewest_modes(share, allowed, error, which, names):
    """The fewest modes that leave out no more than a share of the inertia.

    Parameters
    ----------
    share : ndarray, shape (n,)
        See `Superelement.inertia_share`. [-]
    allowed : ndarray of int
        The modes that may be kept.
    error : float
        The share that may be left out. [-]
    which : str
        The modes allowed, in words.
    names : tuple of str
        Of the input and the output.

    Returns
    -------
    ndarray of int

    Raises
    ------
    NoSolutionError
        All that may be kept leave out more.
    """
    excluded = share.sum() - share[allowed].sum()
    if excluded > error:
        raise NoSolutionError(
            f"--error {error:g}: {which} lowest modes leave out {excluded:.3g} of the inertia "
            f"between {' and '.join(names)}"
        )
    order = np.argsort(share[allowed], kind="stable")
    omitted = np.searchsorted(np.cumsum(share[allowed][order]), error - excluded, side="right")
    return allowed[np.sort(order[omitted:])]


def nodal_forces(case, modes):
    """`statespace.Forces` on the interior nodes along x, y and z, numbered from 0 at end 1.

    Parameters
    ----------
    case : Case
    modes : Modes
        All of `case.end_model`.
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


def exported(system, options):
    """The `StateSpace` as it is written: the channels that `options` name, and proper where they say so.

    Raises
    ------
    SceneError
        No such input or output.
    """
    inputs = [number_of("--input", name, system.input_names) for name in options.inputs]
    known = system.output_names
    outputs = [f"force_{name}" if f"force_{name}" in known else name for name in options.outputs]
    outputs = [number_of("--output", name, known) for name in outputs]
    if inputs or outputs:
        system = channels(system, inputs, outputs)
    return proper(system) if options.proper else system


def improper_note(system):
    """Note on what a program that takes A, B, C, D alone does not have: list of str, at most one."""
    names = system.improper
    if not names:
        return []
    which = statespace.first_of(names)
    return [
        f"note: ss(A, B, C, D) lacks what the derivatives of {which} add at once, D1 and D2 of the file; "
        "--proper has it in A, B, C, D"
    ]


def size_line(choice, system):
    """A line with the size of a state space."""
    return (
        f"state space: {len(system.states)} states, {len(system.inputs)} inputs, {len(system.outputs)} outputs; "
        f"{len(choice.chosen)} of {len(choice.modes)} modes"
    )


def write(system, path):
    """Write a state space in the format of the file name's ending, completely or not at all."""
    write_whole(path, export.KINDS[os.path.splitext(path)[1].lower()](system))
