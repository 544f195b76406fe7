"""Options of the command `ssm`, of one cable and of suspensions; how many modes are needed; notes, and the file."""

import os
import re
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from cablestudy.control import export, statespace
from cablestudy.control.statespace import channels, proper
from cablestudy.errors import NoSolutionError, SceneError, check_output, refuse_options
from cablestudy.scene.fields import suggestion
from cablestudy.scene.units import read_positive
from cablestudy.scene.words import counted
from cablestudy.study.ssm_tables import Curve
from cablestudy.study.table import write_whole
from cablestudy.study.tolerances import STUDY
from cablestudy.system.linear import LinearSystem

KINDS = {"inplane": "in-plane", "outofplane": "out-of-plane", "axial": "axial"}


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
    attached: str | None = None  # None, "gondola", "actuators" or "loop"
    wind: bool = False  # whether forces on the nodes are inputs
    input: str | None = None  # inputs and outputs that errors and responses refer to, names separated by commas
    output: str | None = None
    proper: bool = False  # whether the file has accelerations as inputs instead of derivatives of them

    def __post_init__(self):
        if sum(value is not None for value in (self.count, self.upto, self.error)) > 1:
            raise SceneError("--modes, --upto and --error exclude each other")
        if self.count is not None and self.count > STUDY.modes_at_ends:
            raise SceneError(f"--modes {self.count}: at most {STUDY.modes_at_ends} are computed")
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
        return None if self.upto is None else read_positive("--upto", self.upto, "Hz")

    @property
    def inputs(self):
        """Names of the inputs: tuple, empty for the one that is shown by default, or for all of a file."""
        return _names(self.input)

    @property
    def outputs(self):
        """Names of the outputs, as `inputs`."""
        return _names(self.output)


def _names(text):
    """The names in a text, separated by commas, each once: tuple of str."""
    return tuple(dict.fromkeys(name.strip() for name in (text or "").split(",") if name.strip()))


def number_of(option, name, names):
    """Place of a name among those allowed for an option; SceneError if it is none of them."""
    if name not in names:
        near = suggestion(name, names)
        listed = f" allowed: {', '.join(names)}" if near.startswith("did") and len(names) <= STUDY.listed_names else ""
        raise SceneError(f"{option} {name}: unknown ({near}{listed})")
    return list(names).index(name)


def force_at(name):
    """Name of the force on an end, such as CABLE.force_end_1_x, from that of its movement; other names as they are."""
    return re.sub(r"(^|\.)(end_[12]_[xyz])$", r"\1force_\2", name)


def pairs_of(options, inputs, outputs, first=0, prefix=""):
    """Combine each output that the user names with each input that the user names, as indices.

    Parameters
    ----------
    options : StateSpaceOptions
        The names that the user gave.
    inputs, outputs : sequence of (str, str)
        Names and units of all inputs and of all outputs.
    first : int
        Index that is taken where no output, or no input, is named.
    prefix : str
        Prefix that a user may write before each name.

    Returns
    -------
    list of (int, int)
        Indices of output and input; the input varies faster.

    Raises
    ------
    SceneError
        An unknown name.
    """

    def indices(option, chosen, labels):
        """Indices of the names that are chosen by an option, among all labels (name, unit); `first` without any."""
        names, chosen = [name for name, _unit in labels], [name.removeprefix(prefix) for name in chosen]
        if option == "--output":
            chosen = [name if name in names else force_at(name) for name in chosen]
        return [number_of(option, name, names) for name in chosen] or [first]

    output_indices = indices("--output", options.outputs, outputs)
    input_indices = indices("--input", options.inputs, inputs)
    return [(output, input_) for output in output_indices for input_ in input_indices]


class Choice:
    """Modes that a state space keeps, and its responses.

    Subclasses add `options`, `case`, all `modes`, and `chosen`, the indices of those kept; `response`, the frequency
    response for a pair of indices of output and input; and `shown`, the system with these inputs and outputs.
    """

    title = None  # of a picture of its responses, where their names do not say it

    @property
    def inputs(self):
        """Names and units of the inputs."""
        return self.reduced.inputs

    @property
    def outputs(self):
        """Names and units of the outputs."""
        return self.reduced.outputs

    @staticmethod
    def label(above, below):
        """Label of a curve: the response of an output to an input."""
        return f"response of {above} to {below}"

    @property
    def pairs(self):
        """Pairs of indices (output, input) of the responses: list. Errors are those of the first. Raises SceneError."""
        return pairs_of(self.options, self.inputs, self.outputs)

    @property
    def names(self):
        """Names of the input and the output of the first pair."""
        output, input_ = self.pairs[0]
        return self.inputs[input_][0], self.outputs[output][0]

    def curves(self):
        """List of `Curve`: each output over each input."""
        return curves_between(self, self.pairs, self.response, self.label)

    def left_out(self, share):
        """A line on the modes that are not chosen: how many, how much of the inertia of the first pair they carry.

        Parameters
        ----------
        share : ndarray, shape (n,)
            Of each mode in it. [-]
        """
        static, count = "kept in D" if self.options.residual else "left out too", len(share) - len(self.chosen)
        return (
            f"left out: {counted(count, 'mode')}, which {'carries' if count == 1 else 'carry'} "
            f"{float(np.delete(share, self.chosen).sum()):.3g} of the inertia between {' and '.join(self.names)} "
            f"(no error of a response is stated: more modes show it); "
            f"{'its' if count == 1 else 'their'} static part is {static}"
        )


def curves_between(system, pairs, response, label=Choice.label):
    """List of `Curve` for pairs of indices (output, input), of a `Choice` or a `StateSpace`.

    `response` is a function of such a pair and frequencies [Hz], `label` one of the names of output and input.
    """
    found = []
    for output, input_ in pairs:
        (above, above_unit), (below, below_unit) = system.outputs[output], system.inputs[input_]
        name = f"{above}_over_{below}" if len(pairs) > 1 else ""
        value = partial(response, (output, input_))
        found.append(Curve(name, label(above, below), response_unit(above_unit, below_unit), value))
    return found


def response_of(system, pair, frequency):
    """An output of a `StateSpace` for a unit of an input, by a pair of their indices, shape (m,), at frequencies [Hz].

    Not finite at a pole.
    """
    none = np.zeros(system.a.shape)
    b, c = (system.b, 0 * system.b, 0 * system.b), (system.c, 0 * system.c, 0 * system.c)
    of_first_order = LinearSystem(none, np.eye(len(none)), -system.a, b, c=c, d=(system.d, *system.derivatives))
    return of_first_order.response(*pair, frequency)


def response_unit(above, below):
    """Unit of an output over an input, from theirs; empty where they are equal."""
    return "" if above == below else f"{above}/{f'({below})' if ' ' in below else below}"


def read_response_range(text):
    """Read FROM:TO:COUNT, the range and number of response frequencies, for example `0.01Hz:100Hz:2000`.

    Parameters
    ----------
    text : str
        Value of the option --response.

    Returns
    -------
    low, high : float
        Ends of the range. [Hz]
    count : int
        Number of frequencies.

    Raises
    ------
    SceneError
        Not of this form, a range that is reversed or beyond `STUDY.lowest_response` and `STUDY.highest_response`, too
        few or too many frequencies.
    """
    option = f"--response {text}"
    parts = text.split(":")
    if len(parts) != 3:
        raise SceneError(f"{option}: expected FROM:TO:COUNT, for example 0.01Hz:100Hz:2000")
    low, high = (read_positive(option, part, "Hz") for part in parts[:2])
    if low >= high:
        raise SceneError(f"{option}: FROM must be below TO")
    if low < STUDY.lowest_response or high > STUDY.highest_response:
        raise SceneError(
            f"{option}: frequencies must be between {STUDY.lowest_response:g} and {STUDY.highest_response:g} Hz"
        )
    count = parts[2].strip()
    if not re.fullmatch("[0-9]{1,9}", count) or not 2 <= int(count) <= STUDY.response_frequencies:
        raise SceneError(f"{option}: COUNT must be a whole number from 2 to {STUDY.response_frequencies}")
    return low, high, int(count)


def check_file(path):
    """Refuse an output file of unknown kind, or that cannot be written, before anything is computed: SceneError."""
    check_output("--out", path, export.KINDS, "file")


def has_loss_factor(dampings):
    """True if any of some `Damping` is hysteretic."""
    return any(damping.model == "hysteretic" and damping.loss_factor for damping in dampings)


def viscous_note(dampings):
    """Yield a note, at most one: hysteretic damping is viscous in A.

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


def check_channel(options):
    """Refuse options --input and --output where no response, error or file refers to them: SceneError."""
    refuse_options({"--input": options.input, "--output": options.output}, "for --response, --error and --out only")


def fewest_modes(share, allowed, error, which, names):
    """Choose the fewest modes of a state space that together leave out no more than a given share of the inertia.

    Parameters
    ----------
    share : ndarray, shape (n,)
        Share of each of n modes in the inertia between an input and an output: in the term of the response that grows
        with w^2, which static displacements do not cover. They add up to 1; see `Superelement.inertia_share`. [-]
    allowed : ndarray of int
        Indices of the modes that may be kept.
    error : float
        Share that may be left out. [-]
    which : str
        The allowed modes in words, for the message.
    names : tuple of str
        Names of the input and the output, for the message.

    Returns
    -------
    ndarray of int
        Indices of the modes that are kept, rising.

    Raises
    ------
    NoSolutionError
        Even all allowed modes leave out more.
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


def exported(system, options):
    """The `StateSpace` as it is written: the channels that `options` name, and proper where they say so.

    Raises SceneError as `named_channels`.
    """
    inputs, outputs = named_channels(options, system.input_names, system.output_names)
    if inputs or outputs:
        system = channels(system, inputs, outputs)
    return proper(system) if options.proper else system


def named_channels(options, input_names, output_names):
    """Indices of the inputs and of the outputs that options name; SceneError for one that is not among these names."""
    inputs = [number_of("--input", name, input_names) for name in options.inputs]
    return inputs, [number_of("--output", force_at(name), output_names) for name in options.outputs]


def improper_note(system):
    """Note on the direct terms D1 and D2, which a program that takes A, B, C, D alone does not have: list of str."""
    names = system.improper
    if not names:
        return []
    which = statespace.first_of(names)
    return [
        f"note: ss(A, B, C, D) lacks the direct effect of the derivatives of {which}, D1 and D2 of the file; "
        "--proper has it in A, B, C, D"
    ]


def size_line(choice, system):
    """A line with the size of a state space."""
    sizes = (("state", system.states), ("input", system.inputs), ("output", system.outputs))
    modes = f"{len(choice.chosen)} of {counted(len(choice.modes), 'mode')}"
    return f"state space: {', '.join(counted(len(names), word) for word, names in sizes)}; {modes}"


def write(system, path):
    """Write a state space in the format of the file name's ending, completely or not at all; return (path,)."""
    write_whole(path, export.KINDS[os.path.splitext(path)[1].lower()](system))
    return (path,)
