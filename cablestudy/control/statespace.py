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
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cablestudy.control.reduction import truncated
from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.system.linear import MODAL, LinearSystem
from cablestudy.system.superelement import GONDOLA, GROUND, NAMES

if TYPE_CHECKING:
    import control
    import scipy.signal
    from numpy.typing import ArrayLike, NDArray

ENDS = len(NAMES)


Labels = tuple[tuple[str, str], ...]  # name and unit of each
FEW = 4  # names that a representation lists all


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
            (names, first_of(names) if len(names) > FEW else ", ".join(names))
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
    second_order = _second_order(model, chosen, residual, forces)
    n = len(second_order.names)
    return _first_order(second_order, np.arange(n), n + np.arange(ENDS), [(name, "m") for name in NAMES])


@np.errstate(all="ignore")
def coupled(model, mass, location="ground", chosen=None, residual=True, forces=None, damping=0.0):
    """A gondola on end 2, free along x, and a winch that moves an end along x; all other ends at rest.

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
    second_order = _second_order(model, chosen, residual, forces)
    n = len(second_order.names)
    end = GONDOLA if location == "gondola" else GROUND
    free, inputs = np.append(np.arange(n), n + GONDOLA), [("winch", "m")]
    return _first_order(second_order, free, [n + end], inputs, mass, damping)


@np.errstate(all="ignore")
def closed(loop, chosen=None, residual=True, forces=None):
    """Gondola, cable and winch with the winch loop closed.

    Derivatives of the reference, where the law passes it on at once, act on the forces at the ends (D1); no others do.

    Parameters
    ----------
    loop : Loop
    chosen, residual, forces
        As for `cable`, of the modes of `loop.cable`.

    Returns
    -------
    StateSpace
        Inputs: force on the gondola, then `forces`, then the reference of the gondola's position. Outputs: those of
        `coupled`, then the winch. States: those of `coupled`, those of the controller's filter, as two of the notch
        where there is one, the winch (the integrator).
    """
    plant = coupled(loop.cable, loop.mass, loop.location, chosen, residual, forces, loop.damping)
    omega = loop.cable.omega if chosen is None else loop.cable.omega[chosen]
    filtering, names = loop.filter_to(loop.plant.right_up_to(omega))
    fed = feedback(plant, [0], [filtering], loop.shares)
    n, size = len(plant.a), len(fed.a)
    c = np.pad(plant.c, ((0, 1), (0, size - n)))
    c[:-1, -1], c[-1, -1] = plant.d[:, 0], 1.0
    b = np.concatenate([fed.b[:, 2:], fed.b[:, :1]], axis=1)  # nothing is added to the movement of the winch
    d = np.pad(plant.d[:, 1:], ((0, 1), (0, 1)))
    # the winch is a state: its velocity by states and inputs is known, and so is its acceleration
    velocity, given = fed.a[-1], b[-1]
    d1, d2 = (matrix[:, 0] for matrix in plant.derivatives)
    c[:-1] += np.outer(d1, velocity) + np.outer(d2, velocity @ fed.a)
    d[:-1] += np.outer(d1, given) + np.outer(d2, velocity @ b)
    first = np.zeros_like(d)
    first[:-1] = np.outer(d2, given)
    states = (*plant.states, *((name, "m") for name in names), ("winch", "m"))
    inputs, outputs = (*plant.inputs[1:], ("reference", "m")), (*plant.outputs, ("winch", "m"))
    return StateSpace(fed.a, b, c, d, states, inputs, outputs, (first, np.zeros_like(d)))


@dataclass(frozen=True)
class Feedback:
    """The closed loop x' = A x + B u of k measured coordinates and i winches.

    Attributes
    ----------
    a : ndarray, shape (n, n)
        States: those of the plant, of the filter of each coordinate, the winches without what is added to them.
    b : ndarray, shape (n, k + i + j)
        Inputs: reference of each measured coordinate, what is added to the movement of each winch, forces.
    measured : tuple of 2 ndarray, shapes (k, n) and (k, k + i + j)
        The coordinates by states and inputs.
    """

    a: np.ndarray
    b: np.ndarray
    measured: tuple


def feedback(plant, measured, filters, shares):
    """`Feedback` of winches that integrate what is measured: v' = shares F (y - reference).

    Parameters
    ----------
    plant : StateSpace
        Its first inputs are the winches, the others forces.
    measured : sequence of int
        Which of its outputs are measured: displacements, which need no derivatives of the inputs.
    filters : sequence of tuple of 4 ndarray
        F of each coordinate as a state space: a, b, c, d.
    shares : ndarray, shape (i, k)
        Velocity of each winch per filtered coordinate, gain and sign included.
    """
    measured = list(measured)
    n, count, winches = len(plant.a), len(measured), len(shares)
    size = n + sum(len(own) for own, *_ in filters) + winches
    inputs = count + len(plant.inputs)
    a, b = np.zeros((size, size)), np.zeros((size, inputs))
    a[:n, :n], a[:n, size - winches :], b[:n, count:] = plant.a, plant.b[:, :winches], plant.b
    observed, at_once = np.zeros((count, size)), np.zeros((count, inputs))
    observed[:, :n], observed[:, size - winches :] = plant.c[measured], plant.d[measured, :winches]
    at_once[:, count:] = plant.d[measured]
    error = at_once - np.eye(count, inputs)
    filtered, given, begin = np.zeros((count, size)), np.zeros((count, inputs)), n
    for place, (own, into, shown, direct) in enumerate(filters):
        states = slice(begin, begin + len(own))
        a[states], b[states] = np.outer(into, observed[place]), np.outer(into, error[place])
        a[states, states] += own
        filtered[place], given[place] = direct * observed[place], direct * error[place]
        filtered[place, states] += shown
        begin += len(own)
    a[size - winches :], b[size - winches :] = shares @ filtered, shares @ given
    return Feedback(a, b, (observed, at_once))


@dataclass(frozen=True)
class _Model:
    """The second-order model of the module's docstring, for n kept modes; matrices of shape (n + 6, n + 6)."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    hysteretic: np.ndarray | None  # loss factor times elastic stiffness
    omega: np.ndarray  # shape (n,) [rad/s]
    names: tuple  # of the modes, by their number in the model
    forces: np.ndarray  # shape (n + 6, j): generalised force of each force along the cable on each coordinate
    labels: tuple  # name and unit of these forces


def _second_order(model, chosen, residual, forces):
    """`_Model` of a superelement; omitted modes contribute to D and Mr, or to nothing without `residual`."""
    chosen = np.arange(len(model.omega)) if chosen is None else np.asarray(chosen, dtype=int)
    source = model.condense(chosen) if residual else truncated(model, chosen)
    n = len(chosen)
    mass = np.eye(n + ENDS)
    mass[n:, n:] = source.residual_inertia
    participation = source.participation
    stiffness = np.block([[np.diag(source.omega**2), participation], [participation.T, source.feedthrough]])
    damping, hysteretic, absolute = source.viscous * mass, None, np.eye(n + ENDS)
    absolute[:n, n:] = -source.coupling  # amplitudes about the static shapes: q = y - m u
    if source.uneven:
        carried = source.carried @ absolute
        damping = damping - source.viscous * carried.T @ carried
    if source.strain is None:
        damping[:n, :n] += np.diag(2 * source.damping_ratio * source.omega)
        damping[n:, n:] += source.residual_damping
    else:
        elastic = source.strain.amount * absolute.T @ source.strain.matrix @ absolute
        if source.strain.law == "kelvin_voigt":
            damping = damping + elastic
        else:
            hysteretic = elastic
    labels, generalised = (), np.zeros((n + ENDS, 0))
    if forces is not None:
        # y is the absolute movement: the kept modes bring their part of the static forces at the ends
        kept = chosen if residual else np.arange(len(model.omega))
        rest = forces.static_transfer - model.coupling[kept].T @ forces.modal[kept]
        labels, generalised = tuple(forces.labels), np.concatenate([forces.modal[chosen], rest])
    names = tuple(f"mode_{k + 1}" for k in chosen)
    return _Model(mass, damping, stiffness, hysteretic, source.omega, names, generalised, labels)


def _check_finite(**matrices):
    """Raise NoSolutionError for matrices with an entry that is not finite, naming them."""
    wrong = [name for name, matrix in matrices.items() if not np.isfinite(matrix).all()]
    if wrong:
        raise NoSolutionError(f"the state space overflows: {', '.join(wrong)} would have entries that are not finite")


def _equivalent_viscous(mass, elastic, stiffness):
    """Viscous damping that gives each mode of (mass, stiffness) the energy loss per cycle of hysteretic damping.

    Its damping ratio is then half of the loss factor times the elastic share of its stiffness.
    """
    root = np.sqrt(mass)
    scaled = stiffness / np.outer(root, root)
    _check_finite(stiffness=scaled)
    square, vector = np.linalg.eigh(scaled)
    omega = np.sqrt(np.maximum(square, 0.0))
    shapes = vector / root[:, None]
    rate = np.einsum("ik,ij,jk->k", shapes, elastic, shapes) / np.where(omega > 0, omega, 1.0)
    weighted = mass[:, None] * shapes
    return weighted * rate @ weighted.T


def _first_order(model, free, driven, inputs, gondola=None, viscous=0.0):
    """StateSpace whose coordinates `free` move and `driven` are inputs.

    A gondola [kg], damped by the air [N s/m], is on the last free one.
    """
    n, moving = len(model.names), len(free)
    within, across = np.ix_(free, free), np.ix_(free, driven)
    mass, damping = np.diagonal(model.mass)[free].copy(), model.damping.copy()
    if gondola is not None:
        mass[-1] += gondola
    if model.hysteretic is not None:
        damping[within] += _equivalent_viscous(mass, model.hysteretic[within], model.stiffness[within])
    matrices = model.stiffness, damping, model.mass
    k, c = (matrix[within] / mass[:, None] for matrix in matrices[:2])
    if gondola is not None:
        c[-1, -1] += viscous / mass[-1]
    given = [-matrix[across] / mass[:, None] for matrix in matrices]
    body = np.eye(moving)[:, moving - (gondola is not None) :]
    acceleration = np.concatenate([body, model.forces[free]], axis=1) / mass[:, None]
    scale = np.concatenate([model.omega, np.ones(moving - n)])
    # outputs: position and velocity of the gondola, then the forces at the ends
    held = np.concatenate([np.zeros((ENDS, body.shape[1])), -model.forces[n:]], axis=1)
    rows = [held, *(matrix[n:, free] for matrix in matrices), *(matrix[n:, driven] for matrix in matrices)]
    if gondola is not None:
        rows = [np.pad(block, ((2, 0), (0, 0))) for block in rows]
        rows[1][0, -1] = rows[2][1, -1] = 1.0
    a, b, output, d, derivatives = first_order((k, c), given, acceleration, scale, rows[1:4], rows[4:], rows[0])
    return StateSpace(
        a, b, output, d, *_labels(model, inputs, gondola), derivatives, _free_cable(model, damping, gondola, viscous)
    )


def first_order(matrices, given, acceleration, scale, moved, imposed, held):
    """A, B, C, D and D1, D2 of z'' = -k z - c z' + g0 v + g1 v' + g2 v'' + acceleration f.

    Parameters
    ----------
    matrices : tuple of 2 ndarray, shape (n, n)
        k and c.
    given : tuple of 3 ndarray, shape (n, i)
        g0, g1 and g2.
    acceleration : ndarray, shape (n, j)
        By forces f.
    scale : ndarray, shape (n,)
        States are scale times z, and z', each less a multiple of v.
    moved, imposed : tuple of 3 ndarray, shapes (o, n) and (o, i)
        Outputs by z, z', z'' and by v, v', v''.
    held : ndarray, shape (o, j)
        Outputs by forces.

    Returns
    -------
    a, b, c, d : ndarray
    derivatives : tuple of 2 ndarray
        Inputs are v, then f.
    """
    k, c = matrices
    n, (r0, r1, r2), (s0, s1, s2) = len(k), moved, imposed
    # with z = y + b2 v and z' = y' + b1 v + b2 v' no derivative of v is left in the equations
    b2 = given[2]
    b1 = given[1] - c @ b2
    b0 = given[0] - k @ b2 - c @ b1
    a = np.block([[np.zeros((n, n)), np.diag(scale)], [-k / scale, -c]])
    b = np.block([[scale[:, None] * b1, np.zeros_like(acceleration)], [b0, acceleration]])
    output = np.concatenate([r0 / scale, r1], axis=1) + r2 @ a[n:]
    d = np.concatenate([r0 @ b2 + r1 @ b1 + r2 @ b0 + s0, r2 @ acceleration + held], axis=1)
    first, second = r1 @ b2 + r2 @ b1 + s1, r2 @ b2 + s2
    return a, b, output, d, tuple(np.concatenate([rows, np.zeros_like(held)], axis=1) for rows in (first, second))


@np.errstate(all="ignore")  # StateSpace refuses what overflows
def state_space_of(system, whole=None):
    """`StateSpace` of a `LinearSystem` with real matrices and labels.

    States are z, times W of modal amplitudes, and z', each less a multiple of the inputs.

    Parameters
    ----------
    system : LinearSystem
    whole : LinearSystem, optional
        Its M, C and K before any modes were left out.

    Raises
    ------
    NoSolutionError
        Something that moves has no mass, or entries overflow.
    """
    n, i = len(system), len(system.inputs)
    try:
        solved = np.linalg.solve(
            system.mass, np.concatenate([system.stiffness, system.damping, *system.driven], axis=1)
        )
    except np.linalg.LinAlgError:
        raise NoSolutionError("the state space needs a mass of everything that moves") from None
    matrices, given = (solved[:, :n], solved[:, n : 2 * n]), np.split(solved[:, 2 * n :], [i, 2 * i], axis=1)
    modal = np.array([unit == MODAL for _, unit in system.coordinates], dtype=bool)
    scale = np.where(modal, np.sqrt(np.diagonal(system.stiffness)), 1.0)
    # forces are inputs like the others, only without effect of their derivatives
    forces = np.zeros((n, 0)), np.zeros((len(system.outputs), 0))
    a, b, c, d, derivatives = first_order(matrices, given, forces[0], scale, system.moved, system.follow, forces[1])
    placed = [
        (f"{name}_amplitude", f"{unit}/s") if unit == MODAL else (name, unit) for name, unit in system.coordinates
    ]
    states = *placed, *((f"{name}_velocity", f"{unit}/s") for name, unit in system.coordinates)
    return StateSpace(a, b, c, d, states, system.inputs, system.outputs, derivatives, whole or system)


def _labels(model, inputs, gondola):
    """Name and unit of each state, input and output."""
    position = [(f"{name}_amplitude", f"{MODAL}/s") for name in model.names]
    velocity = [(f"{name}_velocity", f"{MODAL}/s") for name in model.names]
    outputs, inputs = [(f"force_{name}", "N") for name in NAMES], list(inputs)
    if gondola is not None:
        moved = [("gondola_position", "m"), ("gondola_velocity", "m/s")]
        position, velocity, outputs = [*position, moved[0]], [*velocity, moved[1]], [*moved, *outputs]
        inputs.append(("force_gondola", "N"))
    return (*position, *velocity), (*inputs, *model.labels), tuple(outputs)


def _free_cable(model, damping, gondola, viscous):
    """`LinearSystem` of the cable with free ends and the gondola, damped by the air, on end 2."""
    mass, damping, end = model.mass.copy(), damping.copy(), len(model.names) + GONDOLA
    if gondola is not None:
        mass[end, end] += gondola
        damping[end, end] += viscous
    names = (*((name, MODAL) for name in model.names), *((name, "m") for name in NAMES))
    return LinearSystem(mass, damping, model.stiffness, coordinates=names)
