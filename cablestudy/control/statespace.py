"""A `LinearSystem`, with the loop of its winches or without one, as a state space with labels.

States are modal amplitudes q times their frequency W, displacements, and the rates of both, so that entries of A grow
like W. Outputs may depend on velocities and accelerations of inputs, which A, B, C, D cannot express:
y = C x + D u + D1 u' + D2 u'' with D1 and D2 in `StateSpace.derivatives`. Where derivatives of an input act on a state,
the state is its quantity less a multiple of the input; outputs are never shifted.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.system.linear import MASSLESS_MOTION, MODAL, LinearSystem
from cablestudy.system.state_rows import state_rows

if TYPE_CHECKING:
    import control
    import scipy.signal
    from numpy.typing import ArrayLike, NDArray

Labels = tuple[tuple[str, str], ...]  # name and unit of each
RATES = ("velocity", "acceleration")
PER_SECOND = {"m": ("m/s", "m/s^2"), "rad": ("rad/s", "rad/s^2")}


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
        """Inputs whose velocity or acceleration acts on an output directly (D1, D2): list of str."""
        acting = np.concatenate(self.derivatives).any(axis=0)
        return [name for name, does in zip(self.input_names, acting, strict=True) if does]

    def _warn_improper(self, method: str) -> None:
        """Warn that A, B, C, D lack D1 and D2."""
        if self.improper:
            warnings.warn(
                f"{method}: A, B, C, D lack D1 and D2, the direct effect of the derivatives of "
                f"{first_of(self.improper)} on outputs; state_space(proper=True) has them, with acceleration as input",
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
        """Frequency response C (s I - A)^-1 B + D at m values of s, by a linear solve for each.

        Parameters
        ----------
        s : array_like, shape (m,)
            Complex numbers, none of them a pole. [rad/s]
        derivatives : bool
            True to add s D1 + s^2 D2, the effect of velocities and accelerations of inputs on the outputs.

        Returns
        -------
        ndarray, complex, shape (m, o, i)
            For o outputs and i inputs.

        Raises
        ------
        SceneError
            `s` is no array of finite numbers, or `derivatives` no bool.
        NoSolutionError
            The response to some s is not finite: s is a pole, or the response overflows.
        """
        if not isinstance(derivatives, (bool, np.bool_)):
            raise SceneError(f"response: derivatives: expected True or False, got a {type(derivatives).__name__}")
        points = _points(s)[:, None, None]
        eye, input_matrix = np.eye(len(self.a)), self.b.astype(complex)[None]
        try:
            with np.errstate(all="ignore"):  # what overflows is refused below
                value = self.c @ np.linalg.solve(points * eye - self.a, input_matrix) + self.d
                if derivatives:
                    value = value + points * self.derivatives[0] + points**2 * self.derivatives[1]
        except np.linalg.LinAlgError:
            raise NoSolutionError("response: s: one of the values is a pole") from None
        infinite = ~np.isfinite(value).all(axis=(1, 2))
        if infinite.any():
            raise NoSolutionError(f"response: s: the response to {points[infinite][0, 0, 0]:.6g} rad/s is not finite")
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


def _check_finite(**matrices):
    """Raise NoSolutionError for matrices with an entry that is not finite, naming them."""
    wrong = [name for name, matrix in matrices.items() if not np.isfinite(matrix).all()]
    if wrong:
        raise NoSolutionError(f"the state space overflows: {', '.join(wrong)} would have entries that are not finite")


@np.errstate(all="ignore")  # StateSpace refuses what overflows
def state_space_of(system, second_order=None, loop=None, measured=(), actuators=(), added=False):
    """Convert a `LinearSystem` of second order to a labelled `StateSpace`, with its loop closed or without one.

    The states are the coordinates z (those that are modal amplitudes times their frequency W) and the rates z', then
    those of actuators and loop. Multiples of the inputs are taken off them so that no derivative of an input acts on a
    state (see `_from_rows`).

    Parameters
    ----------
    system : LinearSystem
        With real matrices and labels. Its first inputs are the lengths that winches reel in, or displacements; with a
        loop the others are forces.
    second_order : LinearSystem, optional
        System whose M, C and K the result keeps for the user: one cable with free ends, or a suspension with all its
        modes.
    loop : LinearControl, optional
        Loop that measures coordinates of the system and moves the winches.
    measured : tuple of (str, str)
        Name and unit of each coordinate that the loop measures.
    actuators : sequence of Actuator
        Reaction masses and wheels of the system.
    added : bool
        True for further inputs, after the references: the lengths that winches reel in, in addition to what the loop
        commands.

    Returns
    -------
    StateSpace
        Inputs: those of the system; with a loop the reference of each measured coordinate in place of the winches.
        Outputs: those of the system; with a loop the length that it reels in at each winch; then stroke and force of
        each reaction mass, momentum and torque of each wheel.

    Raises
    ------
    NoSolutionError
        Something that moves has no mass, or entries overflow.
    """
    winches, count = len(loop.allocation.matrix) if loop else len(system.inputs), len(system.outputs)
    forces, direct = system.b[0][:, winches:], system.d[0][:, winches:]
    winch_b, winch_d = (tuple(part[:, :winches] for part in parts) for parts in (system.b, system.d))
    try:
        rows = state_rows(replace(system, b=winch_b, d=winch_d, scale=_scale(system)), forces, loop, actuators)
    except np.linalg.LinAlgError:
        raise NoSolutionError(MASSLESS_MOTION) from None
    state_rate, output_rows = rows.state_rate, rows.outputs
    states, inputs, outputs = _states(system, actuators), list(system.inputs), [*system.outputs]
    if loop:  # the forces act on outputs directly, and the lengths reeled in come after the outputs of the system
        end = len(state_rate) + len(measured) + len(inputs)  # of the columns of x and u
        output_rows[:count, end - forces.shape[1] : end] += direct
        output_rows = np.insert(output_rows, count, rows.reeled, axis=0)
        outputs += inputs[:winches]
        inputs = [*((f"reference.{name}", unit) for name, unit in measured), *inputs]
        states += _states_of_loop(loop, measured, rows.equations.winches.shape[1])
    for actuator in actuators:
        units = {"momentum": "N m s", "torque": "N m"} if actuator.wheel else {"stroke": "m", "force": "N"}
        outputs += [(f"{actuator.name}.{quantity}", unit) for quantity, unit in units.items()]
    closed = _from_rows(state_rate, output_rows, states, inputs, outputs, second_order)
    if added or not loop:
        return closed
    return channels(closed, np.delete(np.arange(len(inputs)), len(measured) + np.arange(winches)))


def _scale(system):
    """Factor of each coordinate as a state, shape (n,): from the system, or W of modal amplitudes and 1 of others."""
    if system.scale is not None:
        return system.scale
    modal = np.array([unit == MODAL for _, unit in system.coordinates], dtype=bool)
    return np.where(modal, np.sqrt(np.diagonal(system.stiffness)), 1.0)


def _states(system, actuators):
    """Name and unit of each state of the system with its actuators: list."""
    names, strokes = system.coordinates, [f"{one.name}.stroke" for one in actuators]
    placed = [
        (f"{name}_amplitude", f"{unit}/s") if unit == MODAL or name in strokes else (name, unit) for name, unit in names
    ]
    placed += [(f"{name.removesuffix('_position')}_velocity", f"{unit}/s") for name, unit in names]
    return placed + [(f"{one.name}.low_pass", "rad" if one.wheel else "m") for one in actuators if one.corner]


def _states_of_loop(loop, measured, movements):
    """Name and unit of each state of a loop, the last ones of as many movements of the winches: list."""
    pairs = zip(measured, loop.notches, strict=True)
    found = [(f"notch.{name}_{k}", unit) for (name, unit), notch in pairs for k in (1, 2) if notch]
    found += [(f"{name}.winches_{k + 1}", "m") for k in range(movements) for name in loop.law_names]
    return found + [(f"winches_{k + 1}", "m") for k in range(movements)]


def _from_rows(state_rate, output_rows, states, inputs, outputs, second_order=None):
    """`StateSpace` of x' and y as rows over x, u, u', u'' (`system.state_rows`), no derivatives on the states.

    With x = q + G1 u + G2 u', G2 = B2 and G1 = B1 + A B2,

        q' = A q + (B0 + A G1) u,      y = C x + E0 u + E1 u' + E2 u'' = C q + (E0 + C G1) u + (E1 + C G2) u' + E2 u''.
    """
    starts = len(state_rate) + len(inputs) * np.arange(3)
    a, *b_parts = np.split(state_rate, starts, axis=1)
    c, *e_parts = np.split(output_rows, starts, axis=1)
    first = b_parts[1] + a @ b_parts[2]
    b, d, by_velocity = b_parts[0] + a @ first, e_parts[0] + c @ first, e_parts[1] + c @ b_parts[2]
    terms = np.abs(e_parts[1]) + np.abs(c) @ np.abs(b_parts[2])
    by_velocity[np.abs(by_velocity) <= CONTROL.cancelled_velocity * terms] = 0.0
    derivatives = by_velocity, e_parts[2]
    return StateSpace(a, b, c, d, tuple(states), tuple(inputs), tuple(outputs), derivatives, second_order)


def channels(system, inputs=(), outputs=()):
    """The `StateSpace` with some of its inputs and outputs, by their numbers and in that order; empty keeps all."""
    kept = list(outputs) or slice(None), list(inputs) or slice(None)
    rows, columns = (np.arange(size)[part] for size, part in zip(system.d.shape, kept, strict=True))
    entries = np.ix_(rows, columns)
    return replace(
        system,
        b=system.b[:, columns],
        c=system.c[rows],
        d=system.d[entries],
        inputs=tuple(system.inputs[k] for k in columns),
        outputs=tuple(system.outputs[k] for k in rows),
        derivatives=tuple(part[entries] for part in system.derivatives),
        second_order=None,
    )


def proper(system):
    """Turn the terms D1 u' + D2 u'' of the outputs into states and inputs, for programs that know A, B, C, D alone.

    An input u whose acceleration acts on an output is replaced by u'', and u and u' become states. If only its velocity
    acts, it is replaced by u', and u becomes a state. Other inputs stay as they were.

    Parameters
    ----------
    system : StateSpace
        y = C x + D u + D1 u' + D2 u''.

    Returns
    -------
    StateSpace
        With D1 = D2 = 0 and exactly the same response. The added states are integrators: the system drifts unless the
        new input is the velocity or acceleration of a movement that ends.
    """
    first, second = system.derivatives
    # of each input the order of its highest derivative that acts on an output
    orders = [2 if two.any() else 1 if one.any() else 0 for one, two in zip(first.T, second.T, strict=True)]
    n, extra = len(system.a), sum(orders)
    a, b = np.pad(system.a, (0, extra)), np.pad(system.b, ((0, extra), (0, 0)))
    c, d = np.pad(system.c, ((0, 0), (0, extra))), system.d.copy()
    states, inputs, state = list(system.states), list(system.inputs), n
    for column, order in enumerate(orders):
        if not order:
            continue
        name, unit = system.inputs[column]
        rates = PER_SECOND.get(unit, (f"{unit}/s", f"{unit}/s^2"))
        # u and u' as states, or u alone
        a[:n, state], c[:, state] = system.b[:, column], system.d[:, column]
        b[:, column], d[:, column] = 0.0, (first, second)[order - 1][:, column]
        b[state + order - 1, column] = 1.0
        states.append((name, unit))
        if order == 2:
            a[state, state + 1] = 1.0
            c[:, state + 1] = first[:, column]
            states.append((f"{name}_velocity", rates[0]))
        inputs[column] = (f"{name}_{RATES[order - 1]}", rates[order - 1])
        state += order
    zeros = np.zeros_like(d), np.zeros_like(d)
    return replace(system, a=a, b=b, c=c, d=d, states=tuple(states), inputs=tuple(inputs), derivatives=zeros,
                   second_order=None)  # fmt: skip
