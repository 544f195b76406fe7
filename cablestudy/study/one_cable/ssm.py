"""The cable of a scene as a state space: which modes are kept, and the gondola or winch loop that is attached."""

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from cablestudy.control.one_cable import channel_names, state_space
from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.scene import one_cable
from cablestudy.study.column import require
from cablestudy.study.loop_report import LOOP_KEYS, unstable
from cablestudy.study.notes import DAMPING_IN_STATE_SPACES, assumed_damping, strength_warning
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.case_modes import modes, notes_on_errors
from cablestudy.study.one_cable.report import PARTICIPATION, modes_as_rows
from cablestudy.study.ssm import (
    Choice,
    StateSpaceOptions,
    check_channel,
    curves_between,
    fewest_modes,
    named_channels,
    pairs_of,
    response_of,
)
from cablestudy.study.ssm_tables import Curve
from cablestudy.study.table import Field
from cablestudy.study.tolerances import STUDY
from cablestudy.system.superelement import GONDOLA, GROUND, NAMES

NEEDS = {None: (), "gondola": ("gondola",), "loop": LOOP_KEYS}  # keys of the scene
# input and output of the usual response
SHOWN = {"gondola": ("winch", "gondola_position"), "loop": ("force_gondola", "gondola_position")}
# name of an input or output in a suspension -> its name here
OF_SUSPENSIONS = one_cable.NAMES | {
    f"{one_cable.GONDOLA}.force_x": SHOWN["loop"][0],
    f"{one_cable.GONDOLA}.x": SHOWN["loop"][1],
}
LOCATIONS = {"ground": "A, winch on the ground", "gondola": "B, winch on the gondola"}


@dataclass(frozen=True)
class CableChoice(Choice):
    """State space of the cable of a scene: the modes that it keeps, what is attached, its responses and notes."""

    options: StateSpaceOptions
    case: CableCase  # with the discretisation that is used
    modes: object  # `Modes`, all of `case.end_model`
    chosen: np.ndarray  # indices of the modes to keep
    about_model: tuple  # notes on the discretisation
    inputs = tuple((name, "m") for name in NAMES)
    outputs = tuple((name, "N") for name in NAMES)

    @property
    def pairs(self):
        """Numbers of each force at the ends and displacement of them; of the end with the gondola where it has one."""
        return _pairs_of_ends(self.options)

    @property
    def model(self):
        """`Superelement` of the cable with all its modes, with a gondola in the air that damps its motion."""
        return self.case.end_model_in_wind if self.options.attached else self.case.end_model

    @cached_property
    def kept(self):
        """Superelement of the chosen modes."""
        return self.model.condense(self.chosen) if self.options.residual else self.model.truncate(self.chosen)

    @property
    def gondola(self):
        """Mass [kg] and viscous damping [N s/m] of what is attached to end 2."""
        return self.case.scene.gondola.mass, self.case.gondola_air_damping

    @property
    def location(self):
        """Location of the winch, on the ground or on the gondola: str."""
        winch = self.case.scene.winch
        return winch.location if winch else "ground"

    def system(self):
        """The StateSpace of the cable, alone or with gondola or winch loop; NoSolutionError where it overflows."""
        case, options = self.case, self.options
        nodes = nodal_shapes(case) if options.wind else None
        about = self.model, self.chosen, options.residual, nodes
        if not options.attached:
            return state_space(*about)
        loop, highest = (self.whole.loop, self.delay_accurate_up_to) if options.attached == "loop" else (None, 0.0)
        return state_space(*about, self.gondola, self.location, loop, highest)

    @property
    def whole(self):
        """The `ClosedLoop` that has the loop, stable or not; raises as `DynamicAnalysis.loop_for_margins`."""
        return self.case.analysis.loop_for_margins

    @property
    def delay_accurate_up_to(self):
        """Frequency up to which the approximated delay of the loop is accurate; 0 without one. [rad/s]"""
        law = self.whole.loop.law
        if not law.delay:
            return 0.0
        highest = self.case.end_model.omega[self.chosen].max(initial=0.0)
        return min(
            max(highest, STUDY.delay_accurate_up_to * 2 * np.pi * self.case.gondola_mode.frequency[0]), law.reach
        )

    @property
    def poles(self):
        """Poles in the response; none of gondola or loop where there are more than `cable_states`. [rad/s]"""
        if self.options.attached:
            a = self.system().a
            return np.linalg.eigvals(a) if len(a) <= STUDY.cable_states else np.zeros(0, dtype=complex)
        kept = self.kept
        products = sum(np.abs(np.prod(kept.participation[:, list(pair)], axis=1)) for pair in self.pairs)
        excited = products > 1e-20 * products.max(initial=0.0)  # others are zero except for rounding
        ratio = np.minimum(kept.damping_ratio[excited], 1.0)
        return kept.omega[excited] * (-ratio + 1j * np.sqrt(1 - ratio**2))

    def mode_table(self):
        """Table of the modes that are kept."""
        model = self.case.end_model
        participation = np.abs(model.participation[:, [GROUND, GONDOLA]])
        participation = np.where(participation > 1e-12 * participation.max(initial=0.0), participation, 0.0)
        more = {
            Field("damping_ratio", "damping ratio"): model.damping_ratio,
            Field("participation_end_1", "participation end 1", PARTICIPATION): participation[:, 0],
            Field("participation_end_2", "participation end 2", PARTICIPATION): participation[:, 1],
        }
        return modes_as_rows(self.case, self.modes, self.chosen, more)

    @property
    def _usual(self):
        """What is attached, where its usual response is shown and no other one is named: "gondola", "loop" or None."""
        options, attached = self.options, self.options.attached
        usual = attached and zip((options.input, options.output), SHOWN[attached], strict=True)
        return attached if attached and all(name in (None, own) for name, own in usual) else None

    @property
    def title(self):
        """Title of a picture of the usual responses with a gondola."""
        return "gondola position over winch movement" if self._usual == "gondola" else None

    def curves(self):
        """List of `Curve`: those named; by default A and B with a gondola, x/F with a loop, else force on an end."""
        if self.options.attached and not self._usual:
            system = self.system()
            pairs = pairs_of(self.options, system.inputs, system.outputs)
            return curves_between(system, pairs, partial(response_of, system))
        if self._usual == "gondola":
            return [Curve(name, label, "", partial(self._by_winch, name)) for name, label in LOCATIONS.items()]
        if self._usual == "loop":
            return [Curve("", "gondola position over the force on it, loop closed", "m/N", self._by_force)]
        return super().curves()

    @staticmethod
    def label(above, below):
        """Label of a curve: the force at one end over the displacement of another."""
        return f"force at {above} over displacement of {below}".replace("_", " ")

    @np.errstate(all="ignore")
    def response(self, pair, frequency):
        """Force at an end for a unit displacement of another, all others at rest, shape (m,). [N/m]"""
        force, displacement = pair
        return self.kept.dynamic_stiffness(2j * np.pi * frequency, [force], [displacement])[:, 0, 0]

    def _at_gondola(self, location, s):
        """Force on the gondola per its displacement, and per that of a winch, shape (m,) both. [N/m]"""
        own, ground = self.kept.dynamic_stiffness(s, [GONDOLA], [GONDOLA, GROUND])[:, 0].T
        mass, damping = self.gondola
        return mass * s**2 + damping * s + own, -own if location == "gondola" else -ground

    @np.errstate(all="ignore")
    def _by_winch(self, location, frequency):
        """Position of the gondola for a unit displacement of the winch, as in the paper's Fig. 8, shape (m,). [-]"""
        own, driven = self._at_gondola(location, 2j * np.pi * frequency)
        return driven / own

    @np.errstate(all="ignore")
    def _by_force(self, frequency):
        """Position of the gondola for a unit force on it with the loop closed, shape (m,). [m/N]"""
        s, loop = 2j * np.pi * frequency, self.whole.loop
        own, driven = self._at_gondola(self.location, s)
        sign = -1 if self.location == "gondola" else 1
        return 1 / (own + sign * loop.gain * loop.controller(s)[:, 0] * driven)

    @property
    def notes(self):
        """Notes for the user on what the state space models and what it leaves out: list of str."""
        case, options = self.case, self.options
        notes = [
            *self.about_model,
            *notes_on_errors(case, self.modes.first(int(max(self.chosen, default=-1)) + 1)),
            self.left_out(case.end_model.inertia_share(*self.pairs[0])),
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
        if case.in_steady_wind:
            turned = "turns with the cable (wind.aerodynamic_damping: false leaves that out)"
            notes.append(f"drag of the steady wind: {'a dead load' if self.model.load_stiffness is None else turned}")
        if options.attached == "loop" and case.scene.winch.delay:
            limit = self.delay_accurate_up_to / (2 * np.pi)
            notes.append(f"delay: Padé approximants, whose phase is accurate to 1e-7 up to {limit:.4g} Hz")
        strain = case.end_model.strain
        law = "modal" if strain is None else strain.law
        return [*notes, *assumed_damping(case.scene), *DAMPING_IN_STATE_SPACES[law]]

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
            warnings += [f"warning: {reason}" for reason in unstable(self.case.analysis)]
        return warnings


def check_options(options, responds, out):
    """Refuse `StateSpaceOptions` that have no effect: SceneError.

    Parameters
    ----------
    options : StateSpaceOptions
    responds : bool
        Whether a response is shown.
    out : str or None
        File that the state space is written to.
    """
    if not (out or options.error is not None or responds):
        check_channel(options)


def with_own_names(options):
    """`StateSpaceOptions` with the names of one cable in place of those that suspensions have for the same."""

    def own(names):
        own_names = (OF_SUSPENSIONS.get(name, name.removeprefix(f"{one_cable.CABLE}.")) for name in names)
        return ",".join(own_names) or None

    return replace(options, input=own(options.inputs), output=own(options.outputs))


def choose(document, scene, options, highest=None):
    """Choose the modes of a cable that its state space keeps, by number, frequency or error.

    Only modes whose frequency is within the accuracy of the scene are kept. If there are too few of them, twice as many
    are computed with a finer model, up to `STUDY.modes_at_ends`. If the scene fixes the number of elements, the model
    is not made finer, and all of its modes may be kept.

    Parameters
    ----------
    document : Document
        File of the scene, for the positions of mistakes.
    scene : CableScene
    options : StateSpaceOptions
        Of the command `ssm`. It gives the number of modes (`count`), their highest frequency (`upto`), or the share of
        the inertia that omitted modes may have (`error`). Only modes of `kinds` are kept. `attached` is "gondola" or
        "loop" if that is attached to the cable.
    highest : float, optional
        Without effect: the number of modes does not follow from the frequencies of a response. [Hz]

    Returns
    -------
    CableChoice

    Raises
    ------
    SceneError
        Gondola or winch is missing, or the model has fewer modes than `options.count`.
    NoSolutionError, ConvergenceError
        There are no such modes, or not to the accuracy.
    """
    options = with_own_names(options)
    _ = _pairs_of_ends(options)  # raises SceneError
    attached = options.attached
    require(document, scene, NEEDS[attached], f"ssm --with {attached}")
    # names of forces on nodes are known when there are elements; an error may refer to ends that are no channels
    if attached and not options.wind and options.error is None:
        named_channels(options, *channel_names(attached == "loop"))
    fixed, reason_for_more = scene.model.elements is not None, ""
    count = STUDY.modes_at_ends if fixed else options.count or STUDY.default_modes
    while True:
        try:
            case, accurate_modes, notes, _ = modes(CableCase(scene), None if options.upto else count, options.limit)
        except ConvergenceError as failure:
            raise ConvergenceError(f"{reason_for_more}{failure}") from None
        all_modes = case.dynamics.modes(min(case.dynamics.dof, STUDY.modes_at_ends))
        try:
            chosen = _chosen(case, all_modes, len(accurate_modes), options)
            break
        except (SceneError, NoSolutionError) as too_few:
            if fixed:
                raise
            if count == STUDY.modes_at_ends:
                raise NoSolutionError(f"{too_few}, and no more than {STUDY.modes_at_ends} are computed") from None
            reason_for_more = f"{too_few} (with a fixed number of model.elements, of all modes of the model); of more, "
        count = min(2 * count, STUDY.modes_at_ends)
    if not options.residual and not all_modes.complete:
        raise NoSolutionError(f"--no-residual needs every mode of the model, and only {len(all_modes)} are computed")
    return CableChoice(options, case, all_modes, chosen, notes)


def _chosen(case, found, accurate, options):
    """Indices of the modes to keep, of the lowest that are accurate; SceneError or NoSolutionError for too few."""
    allowed = [k for k in found.select() if k < accurate and found.kind[k] in options.kinds_kept]
    allowed = np.array(allowed, dtype=int)
    if options.upto:
        return allowed[found.frequency[allowed] <= options.limit]
    kinds = "" if options.kinds is None else f"{' and '.join(options.kinds_kept)} "
    if options.error is not None:
        pair = force, displacement = _pairs_of_ends(options)[0]
        share = case.end_model.inertia_share(*pair)
        which = f"the {kinds}ones of the {accurate}" if kinds else f"the {accurate}"
        return fewest_modes(share, allowed, options.error, which, (NAMES[displacement], NAMES[force]))
    if options.count is not None and len(allowed) < options.count:
        among = f" among its {accurate} lowest" if kinds else ""
        raise SceneError(f"--modes {options.count}: the model has {len(allowed)} {kinds}modes{among}")
    return allowed[: options.count]


def _pairs_of_ends(options):
    """Pairs of indices (force, displacement) of the ends that the options name: list.

    With a gondola or loop it is the end of the gondola alone. SceneError for an unknown name.
    """
    if options.attached:  # the names are those of the state space, for the file
        return [(GONDOLA, GONDOLA)]
    return pairs_of(options, CableChoice.inputs, CableChoice.outputs, GONDOLA, "force_")


def nodal_shapes(case):
    """Displacements of the inner nodes along x, y and z by modes and ends, shape (n + 6, 3 j), see `state_space`."""
    elements, row = case.elements
    shapes = elements.ends(case.dynamics.planes).shapes[row][1:-1]
    return np.einsum("nak,ag->kng", shapes, case.span.frame).reshape(shapes.shape[-1], -1)
