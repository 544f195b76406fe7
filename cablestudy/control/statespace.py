"""The cable, alone or with gondola and winch, as a linear system of first order with labelled states.

All of it follows from the second-order model in the absolute modal coordinates y and the six end displacements u,

    [I  0 ] [y]''   [      ] [y]'   [W^2  p] [y]   [modal forces        ]
    [0  Mr] [u]   + [  C   ] [u]  + [p^T  D] [u] = [forces at the ends  ]

(Craig and Bampton, 1968, with modes normalised to unit mass). D is the static end stiffness plus what the kept modes
take off it, Mr the inertia that they leave. C holds 2 zeta W of each mode for modal damping, and for the ends what the
omitted modes add as slow movements of the ends meet them: the sum of 2 zeta p p^T/W^3. Kelvin-Voigt damping of
the strain is exact. Hysteretic damping has no state space: each mode of the moving parts (gondola included) gets the
viscous damping that dissipates the same energy per cycle. States are W y and dy/dt, so that entries of A grow like W.

Forces at a moved end that are proportional to its acceleration (Mr) and velocity need derivatives of the inputs, which
A, B, C, D do not contain; `StateSpace.derivatives` does: y = C x + D u + D1 u' + D2 u''. With the winch loop closed
those of the winch are known, and only the reference has a D1, where the law passes it on at once. Where derivatives of
an input act on a state, the state is its quantity less a multiple of the input; outputs are never shifted.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cablestudy.control.law import INTEGRATOR, Law
from cablestudy.control.proper import channels
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.system.first_order import Allocation, LinearControl, rows
from cablestudy.system.linear import MASSLESS_MOTION, MODAL, LinearSystem, equivalent_viscous
from cablestudy.system.superelement import GONDOLA, GROUND, NAMES

if TYPE_CHECKING:
    from collections.abc import Callable

    import control
    import scipy.signal
    from numpy.typing import ArrayLike, NDArray

    from cablestudy.system.superelement import Superelement

ENDS = len(NAMES)


Labels = tuple[tuple[str, str], ...]  # name and unit of each


@dataclass(frozen=True)
class StateSpace:
    """dx/dt = A x + B u, y = C x + D u + D1 u' + D2 u''; NoSolutionError where an entry overflows."""

    a: NDArray[np.float64]  # shape (n, n)
    b: NDArray[np.float64]  # (n, i)
    c: NDArray[np.float64]  # (o, n)
    d: NDArray[np.float64]  # (o, i)
    states: Labels  # name and unit of each
    inputs: Labels
    outputs: Labels
    derivatives: tuple[NDArray[np.float64], NDArray[np.float64]]  # D1 and D2, each of shape (o, i)
    second_order: LinearSystem | None = None  # M, C and K of the same cable with its ends free; None for a closed loop

    def __repr__(self) -> str:
        pairs = (
            (names, first_of(names) if len(names) > CONTROL.listed_names else ", ".join(names))
            for names in (self.input_names, self.output_names)
        )
        inputs, outputs = (f"{len(names)} ({shown})" for names, shown in pairs)
        return f"StateSpace(states: {len(self.states)}, inputs: {inputs}, outputs: {outputs})"

    def __post_init__(self) -> None:
        _check_finite(A=self.a, B=self.b, C=self.c, D=self.d, D1=self.derivatives[0], D2=self.derivatives[1])
        if self.second_order is not None:
            order = self.second_order
            _check_finite(mass=order.mass, damping=order.damping, stiffness=order.stiffness)

    @property
    def state_names(self) -> list[str]:
        """List of str."""
        return [name for name, _ in self.states]

    @property
    def input_names(self) -> list[str]:
        """List of str."""
        return [name for name, _ in self.inputs]

    @property
    def output_names(self) -> list[str]:
        """List of str."""
        return [name for name, _ in self.outputs]

    @property
    def improper(self) -> list[str]:
        """Inputs whose velocity or acceleration acts on an output at once (D1, D2): list of str."""
        acting = np.concatenate(self.derivatives).any(axis=0)
        return [name for name, does in zip(self.input_names, acting, strict=True) if does]

    def _warn_improper(self, method: str) -> None:
        """Warn that A, B, C, D are not all of it."""
        if self.improper:
            warnings.warn(
                f"{method}: A, B, C, D lack D1 and D2, what the derivatives of {first_of(self.improper)} add to the "
                f"outputs at once; state_space(proper=True) has them, with accelerations as inputs",
                stacklevel=3,
            )

    def to_scipy(self) -> scipy.signal.StateSpace:
        """A, B, C, D as scipy.signal.StateSpace; where there are D1 and D2 a warning says that they are left out."""
        from scipy.signal import StateSpace as System

        self._warn_improper("to_scipy")
        return System(self.a, self.b, self.c, self.d)

    def to_control(self) -> control.StateSpace:
        """A, B, C, D as control.StateSpace of python-control, with its names; warns as `to_scipy`."""
        import control

        self._warn_improper("to_control")
        labels = {"states": self.state_names, "inputs": self.input_names, "outputs": self.output_names}
        return control.ss(self.a, self.b, self.c, self.d, **labels)

    def response(self, s: ArrayLike, derivatives: bool = False) -> NDArray[np.complex128]:
        """Frequency response C (s I - A)^-1 B + D, by a linear solve for each s; complex, shape (m, o, i).

        Parameters
        ----------
        s : array_like, shape (m,)
            Complex numbers, none of them a pole. [rad/s]
        derivatives : bool
            Whether s D1 + s^2 D2 is added.

        Raises
        ------
        SceneError
            What is given for s or derivatives is something else.
        NoSolutionError
            The response to some s is not finite: that is a pole, or it overflows.
        """
        if not isinstance(derivatives, (bool, np.bool_)):
            raise SceneError(f"response: derivatives: expected True or False, got a {type(derivatives).__name__}")
        points = _points(s)[:, None, None]
        eye, forced = np.eye(len(self.a)), self.b.astype(complex)[None]
        try:
            with np.errstate(all="ignore"):  # what overflows is refused below
                value = self.c @ np.linalg.solve(points * eye - self.a, forced) + self.d
                if derivatives:
                    value = value + points * self.derivatives[0] + points**2 * self.derivatives[1]
        except np.linalg.LinAlgError:
            raise NoSolutionError("response: s: one of the values is a pole") from None
        wrong = ~np.isfinite(value).all(axis=(1, 2))
        if wrong.any():
            raise NoSolutionError(f"response: s: the response to {points[wrong][0, 0, 0]:.6g} rad/s is not finite")
        return value


def _points(s: Any) -> NDArray[np.complex128]:
    """Values of s as an array, shape (m,); SceneError for anything else."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what is masked, which becomes nan
        try:
            given = np.asarray(s)
        except (TypeError, ValueError):  # rows of different lengths
            given = np.asarray(None)
    if given.ndim == 1 and given.dtype.kind in "iufc":
        with np.errstate(all="ignore"):  # of a number that no float holds
            points = given.astype(complex)
        if np.isfinite(points).all():
            return points
    found = f"an array of shape {given.shape} of {given.dtype}" if given.ndim else f"a {type(s).__name__}"
    raise SceneError(f"response: s: expected a list or array of finite complex numbers in rad/s, got {found}")


def first_of(names):
    """The first of some names, and how many more there are."""
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"


@dataclass(frozen=True)
class Forces:
    """Forces along the cable as inputs, for example by the wind."""

    modal: np.ndarray  # psi^T: modal force of each, for every mode of the model, shape (n, j) [1/sqrt(kg)]
    static_transfer: np.ndarray  # share of each that the fixed ends take statically, as forces there, shape (6, j) [-]
    labels: tuple  # name and unit of each


@np.errstate(all="ignore")  # StateSpace refuses what overflows
def cable(model, chosen=None, residual=True, forces=None):
    """`StateSpace` of the cable alone: end displacements, then `forces`, to the six forces that hold the ends there.

    Parameters
    ----------
    model : Superelement
        With all modes.
    chosen : ndarray of int, optional
        The modes to keep. Default: all.
    residual : bool
        Whether the static part, the inertia and the modal damping of the omitted modes are kept. If not, the model is
        truncated as in the paper, with D = K11 of the whole model.
    forces : Forces, optional
    """
    system = _free_cable(model, chosen, residual, forces)
    n = len(system) - ENDS
    return state_space_of(*_moving(system, np.arange(n), n + np.arange(ENDS), [(name, "m") for name in NAMES]))


@np.errstate(all="ignore")
def coupled(model, mass, location="ground", chosen=None, residual=True, forces=None, damping=0.0):
    """`StateSpace` of a cable with a gondola on end 2, free along x, and a winch that moves an end along x.

    All other displacements of the ends are held at rest.

    Parameters
    ----------
    model, chosen, residual, forces
        As for `cable`.
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
        The paper's model A, in which the winch moves end 1, or B, in which end 2 stands at x + u.
    damping : float
        Viscous, on the gondola. [N s/m]

    Returns
    -------
    StateSpace
        Inputs: winch u, force on the gondola, then `forces`. Outputs: position and velocity of the gondola, forces at
        the ends. The gondola's position needs no `derivatives`.
    """
    return state_space_of(*_coupled(model, mass, location, chosen, residual, forces, damping))


def _coupled(model, mass, location, chosen, residual, forces, damping):
    """The two systems of `_moving` for `coupled`."""
    system = _free_cable(model, chosen, residual, forces)
    n = len(system) - ENDS
    end = GONDOLA if location == "gondola" else GROUND
    return _moving(system, np.append(np.arange(n), n + GONDOLA), [n + end], [("winch", "m")], (mass, damping))


@dataclass(frozen=True)
class WinchLoop:
    """Gondola, cable, and a winch that holds the gondola, in the notation of `control.law`.

    Attributes
    ----------
    cable : Superelement
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
        Of the winch.
    gain : float
        [rad/s]
    notch : Notch or None
    law : Law
    damping : float
        Viscous, on the gondola. [N s/m]
    """

    cable: Superelement
    mass: float
    location: str
    gain: float
    notch: Callable[[NDArray], NDArray] | None = None
    law: Law = INTEGRATOR
    damping: float = 0.0

    def controller(self, s):
        """C1 N for complex s, shape (m,). [s]"""
        return self.law(s) if self.notch is None else self.law(s) * self.notch(s)


@np.errstate(all="ignore")
def closed(loop, chosen=None, residual=True, forces=None, highest=0.0):
    """Gondola, cable and winch with the winch loop closed.

    Derivatives of the reference, where the law passes it on at once, act on the forces at the ends (D1); no others do.

    Parameters
    ----------
    loop : WinchLoop
    chosen, residual, forces
        As for `cable`, of the modes of `loop.cable`.
    highest : float
        Frequency up to which a delay is right, at least. [rad/s]

    Returns
    -------
    StateSpace
        Inputs: force on the gondola, then `forces`, then the reference of the gondola's position. Outputs: those of
        `coupled`, then the winch. States: those of `coupled`, two of the notch where there is one, those of the law,
        the winch (the integrator).
    """
    system, _ = _coupled(loop.cable, loop.mass, loop.location, chosen, residual, forces, loop.damping)
    law, names = loop.law.state_space(highest)
    measured, sign = np.eye(len(system))[-1:], -1.0 if loop.location == "gondola" else 1.0
    control = LinearControl(Allocation(measured, np.array([[sign]])), loop.gain, (loop.notch,), law, names)
    by_force, held = system.b[0][:, 1:], system.d[0][:, 1:]
    driven, follow = (tuple(part[:, :1] for part in parts) for parts in (system.b, system.d))
    scaled = replace(system, b=driven, d=follow, scale=_scale(system))
    _, whole, (reeled, _), shown = rows(scaled, by_force, control)
    end = len(whole) + (whole.shape[1] - len(whole)) // 3
    shown[:, end - held.shape[1] : end] += held
    names = [*(("notch_1", "notch_2") if loop.notch else ()), *names, "winch"]
    states = *_states(system, ()), *((name, "m") for name in names)
    inputs, outputs = (("reference", "m"), *system.inputs), (*system.outputs, ("winch", "m"))
    found = _from_rows(whole, np.concatenate([shown, reeled]), states, inputs, outputs)
    return channels(found, [*range(2, len(inputs)), 0])  # without what is added to the movement of the winch


def _free_cable(model, chosen, residual, forces):
    """`LinearSystem` of a superelement with free ends: absolute amplitudes of n kept modes, then the ends.

    Inputs are forces along the cable. Omitted modes contribute to D and Mr, or to nothing without `residual`.
    """
    chosen = np.arange(len(model.omega)) if chosen is None else np.asarray(chosen, dtype=int)
    source = model.condense(chosen) if residual else model.truncate(chosen)
    n = len(chosen)
    absolute = np.eye(n + ENDS)
    absolute[:n, n:] = -source.coupling  # amplitudes about the static shapes: q = y - m u
    mass, damping, stiffness = (absolute.T @ part @ absolute for part in source.matrices())
    labels, generalised = (), np.zeros((n + ENDS, 0))
    if forces is not None:
        # y is the absolute movement: the kept modes bring their part of the static forces at the ends
        kept = chosen if residual else np.arange(len(model.omega))
        rest = forces.static_transfer - model.coupling[kept].T @ forces.modal[kept]
        labels, generalised = tuple(forces.labels), np.concatenate([forces.modal[chosen], rest])
    names = (*((f"mode_{k + 1}", MODAL) for k in chosen), *((name, "m") for name in NAMES))
    driven = generalised, 0 * generalised, 0 * generalised
    return LinearSystem(mass, damping, stiffness, driven, coordinates=names, inputs=labels)


def _check_finite(**matrices):
    """Raise NoSolutionError for matrices with an entry that is not finite, naming them."""
    wrong = [name for name, matrix in matrices.items() if not np.isfinite(matrix).all()]
    if wrong:
        raise NoSolutionError(f"the state space overflows: {', '.join(wrong)} would have entries that are not finite")


def _moving(cable, free, imposed, inputs, gondola=None):
    """A `_free_cable` whose coordinates `free` move while `imposed` are inputs, and itself: two real `LinearSystem`.

    On the last free one is a gondola of some mass [kg] and viscous damping [N s/m], where these are given.
    """
    n, within, whole = len(cable) - ENDS, np.ix_(free, free), cable
    if gondola is not None:
        there = np.zeros(cable.mass.shape)
        there[free[-1], free[-1]] = 1.0
        mass, damping = gondola
        whole = replace(cable, mass=cable.mass + mass * there, damping=cable.damping + damping * there)
    if np.iscomplexobj(cable.stiffness):
        loss = np.zeros(cable.mass.shape)
        loss[within] = equivalent_viscous(whole.mass[within], whole.stiffness[within])
        cable, whole = (
            replace(one, damping=one.damping + loss, stiffness=one.stiffness.real) for one in (cable, whole)
        )
    parts, outputs = (cable.stiffness, cable.damping, cable.mass), [(f"force_{name}", "N") for name in NAMES]
    # what is imposed, then forces: on the coordinates, and on the ends
    pairs = tuple(zip(parts, cable.b, strict=True))
    driven = [np.concatenate([-part[np.ix_(free, imposed)], force[free]], axis=1) for part, force in pairs]
    follow = [np.concatenate([part[n:, imposed], -force[n:]], axis=1) for part, force in pairs]
    moved = [part[n:, free] for part in parts]
    inputs, coordinates = [*inputs, *cable.inputs], [cable.coordinates[place] for place in free]
    if gondola is not None:
        place, coordinates[-1] = len(imposed), ("gondola_position", "m")
        inputs.insert(place, ("force_gondola", "N"))
        outputs = [("gondola_position", "m"), ("gondola_velocity", "m/s"), *outputs]
        driven, follow = ([np.insert(part, place, 0.0, axis=1) for part in parts] for parts in (driven, follow))
        moved, follow = ([np.pad(part, ((2, 0), (0, 0))) for part in parts] for parts in (moved, follow))
        driven[0][-1, place] = moved[0][0, -1] = moved[1][1, -1] = 1.0
    kept = LinearSystem(
        whole.mass[within],
        whole.damping[within],
        whole.stiffness[within],
        tuple(driven),
        c=tuple(moved),
        d=tuple(follow),
        coordinates=tuple(coordinates),
        inputs=tuple(inputs),
        outputs=tuple(outputs),
    )
    return kept, whole


@np.errstate(all="ignore")  # StateSpace refuses what overflows
def state_space_of(system, second_order=None, loop=None, measured=(), actuators=(), added=False):
    """`StateSpace` of a `LinearSystem` with real matrices and labels, with its loop closed or without one.

    States are z, times W of modal amplitudes, and z', each less a multiple of the inputs; then those of `Equations`.

    Parameters
    ----------
    system : LinearSystem
        Its first inputs are the lengths that winches reel in, or displacements; with a loop the others are forces.
    second_order : LinearSystem, optional
        M, C and K of the same before any modes were left out.
    loop : LinearControl or Loop, optional
        Of these coordinates.
    measured : tuple of (str, str)
        Name and unit of what the loop measures.
    actuators : sequence of Actuator
        Those of the system.
    added : bool
        Whether lengths that winches reel in beyond those of the loop are inputs too, after the references.

    Returns
    -------
    StateSpace
        Inputs: those of the system; with a loop the reference of each measured coordinate in place of the winches.
        Outputs: those of the system, with a loop the length that each winch has reeled in, then stroke and force of
        each reaction mass, momentum and torque of each wheel.

    Raises
    ------
    NoSolutionError
        Something that moves has no mass, or entries overflow.
    """
    winches, count = len(loop.allocation.shares) if loop else len(system.inputs), len(system.outputs)
    forces, direct = system.b[0][:, winches:], system.d[0][:, winches:]
    driven, follow = (tuple(part[:, :winches] for part in parts) for parts in (system.b, system.d))
    try:
        found, whole, (reeled, _), shown = rows(
            replace(system, b=driven, d=follow, scale=_scale(system)), forces, loop, actuators
        )
    except np.linalg.LinAlgError:
        raise NoSolutionError(MASSLESS_MOTION) from None
    states, inputs, outputs = _states(system, actuators), list(system.inputs), [*system.outputs]
    if loop:
        end = len(whole) + len(measured) + len(inputs)
        shown[:count, end - forces.shape[1] : end] += direct
        shown = np.insert(shown, count, reeled, axis=0)
        outputs += inputs[:winches]
        inputs = [*((f"reference.{name}", unit) for name, unit in measured), *inputs]
        states += _states_of_loop(loop, measured, found.winches.shape[1])
    for one in actuators:
        units = {"momentum": "N m s", "torque": "N m"} if one.wheel else {"stroke": "m", "force": "N"}
        outputs += [(f"{one.name}.{what}", unit) for what, unit in units.items()]
    closed = _from_rows(whole, shown, states, inputs, outputs, second_order)
    if added or not loop:
        return closed
    return channels(closed, np.delete(np.arange(len(inputs)), len(measured) + np.arange(winches)))


def _scale(system):
    """That of the system, or W of modal amplitudes, and one, shape (n,)."""
    if system.scale is not None:
        return system.scale
    modal = np.array([unit == MODAL for _, unit in system.coordinates], dtype=bool)
    return np.where(modal, np.sqrt(np.diagonal(system.stiffness)), 1.0)


def _states(system, actuators):
    """Name and unit of each state of the system with its actuators: list."""
    names, every = system.coordinates, system.scale is not None
    placed = [(f"{name}_amplitude", f"{unit}/s") if every or unit == MODAL else (name, unit) for name, unit in names]
    placed += [(f"{name.removesuffix('_position')}_velocity", f"{unit}/s") for name, unit in names]
    return placed + [(f"{one.name}.low_pass", "rad" if one.wheel else "m") for one in actuators if one.corner]


def _states_of_loop(loop, measured, movements):
    """Name and unit of each state of a loop, the last ones of as many movements of the winches: list."""
    pairs = zip(measured, loop.notches, strict=True)
    found = [(f"notch.{name}_{k}", unit) for (name, unit), notch in pairs for k in (1, 2) if notch]
    found += [(f"{name}.winches_{k + 1}", "m") for k in range(movements) for name in loop.law_names]
    return found + [(f"winches_{k + 1}", "m") for k in range(movements)]


def _from_rows(whole, shown, states, inputs, outputs, second_order=None):
    """`StateSpace` of x' and y as rows over x, u, u', u'' (`first_order.rows`), without derivatives on the states.

    With x = q + G1 u + G2 u', G2 = B2 and G1 = B1 + A B2,

        q' = A q + (B0 + A G1) u,      y = C x + E0 u + E1 u' + E2 u'' = C q + (E0 + C G1) u + (E1 + C G2) u' + E2 u''.
    """
    places = len(whole) + len(inputs) * np.arange(3)
    a, *given = np.split(whole, places, axis=1)
    c, *direct = np.split(shown, places, axis=1)
    first = given[1] + a @ given[2]
    b, d, derivatives = given[0] + a @ first, direct[0] + c @ first, (direct[1] + c @ given[2], direct[2])
    return StateSpace(a, b, c, d, tuple(states), tuple(inputs), tuple(outputs), derivatives, second_order)
