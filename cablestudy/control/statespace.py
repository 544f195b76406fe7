"""The cable, alone or with gondola and winch, as a linear system of first order with labelled states.

All of it comes from the second-order model in y (modal movement, absolute) and the six ends u, with m = -p/W^2:

    [I  0 ] [y]''   [      ] [y]'   [W^2  p] [y]   [modal forces        ]
    [0  Mr] [u]   + [  C   ] [u]  + [p^T  D] [u] = [forces at the ends  ]

D is the static end stiffness and what the kept modes take off it, Mr the inertia that they leave. C holds 2 zeta W of
each mode; Kelvin-Voigt strain damping is exact; hysteretic damping has no state space, and each mode of the moving
parts (gondola included) gets the equivalent ratio. States are W y and dy/dt, so that entries of A grow like W.

What a moved end feels of its own acceleration (Mr) and speed needs derivatives of the input, which D cannot hold:
`StateSpace.derivatives` has them, y = C x + D u + D1 u' + D2 u''. With the winch closed nothing is left over. For the
same reason a state is its quantity less a share of the input where the input's derivatives act on it; outputs are not.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.reduction import ENDS, elastic_matrix, truncated
from cablestudy.system.superelement import GONDOLA, GROUND, NAMES

MODAL = "sqrt(kg) m"  # unit of a modal amplitude


@dataclass(frozen=True)
class SecondOrder:
    """M x'' + C x' + K x = forces.

    Attributes
    ----------
    mass, damping, stiffness : ndarray, shape (n, n)
    coordinates : tuple of (str, str)
        Name and unit of each.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    coordinates: tuple


@dataclass(frozen=True)
class StateSpace:
    """dx/dt = A x + B u, y = C x + D u + D1 u' + D2 u''.

    Attributes
    ----------
    a, b, c, d : ndarray
        Shapes (n, n), (n, i), (o, n), (o, i).
    states, inputs, outputs : tuple of (str, str)
        Name and unit of each.
    derivatives : tuple of 2 ndarray, shape (o, i)
        D1 and D2: what no state space can hold.
    second_order : SecondOrder or None
        The same cable with its ends free; None for a closed loop.
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    states: tuple
    inputs: tuple
    outputs: tuple
    derivatives: tuple
    second_order: SecondOrder | None = None

    def response(self, s, derivatives=False):
        """C (s I - A)^-1 B + D by a linear solve for each s.

        Parameters
        ----------
        s : ndarray, shape (m,)
            [rad/s]
        derivatives : bool
            With s D1 + s^2 D2.

        Returns
        -------
        ndarray, complex, shape (m, o, i)
        """
        s = np.asarray(s, dtype=complex)[:, None, None]
        value = self.c @ np.linalg.solve(s * np.eye(len(self.a)) - self.a, self.b.astype(complex)[None]) + self.d
        return value + s * self.derivatives[0] + s**2 * self.derivatives[1] if derivatives else value


@dataclass(frozen=True)
class Forces:
    """Forces along the cable as inputs, the wind for example.

    Attributes
    ----------
    modal : ndarray, shape (n, j)
        psi^T: modal force of each, for every mode of the model. [1/sqrt(kg)]
    carried : ndarray, shape (6, j)
        Share of each that the ends hold at rest, as forces at the ends. [-]
    labels : tuple of (str, str)
        Name and unit.
    """

    modal: np.ndarray
    carried: np.ndarray
    labels: tuple


def cable(model, chosen=None, residual=True, forces=None):
    """The cable alone: its ends are moved, and push back.

    Parameters
    ----------
    model : Superelement
        With all modes.
    chosen : ndarray of int, optional
        The modes to keep; all without it.
    residual : bool
        Keep the static part and the inertia of the omitted modes. Without: the paper's plain truncation, D = K11 of
        the whole model.
    forces : Forces, optional

    Returns
    -------
    StateSpace
        Inputs: the six end displacements, then `forces`. Outputs: the six forces at the ends that hold them there.
    """
    parts = _parts(model, chosen, residual, forces)
    n = len(parts.names)
    unit = np.eye(n + ENDS)
    return _first_order(parts, unit[:, :n], unit[:, n:], [(name, "m") for name in NAMES])


def coupled(model, mass, location="ground", chosen=None, residual=True, forces=None):
    """Gondola on end 2, free along x, and a winch that moves an end along x; all other ends at rest.

    Parameters
    ----------
    model, chosen, residual, forces
        As for `cable`.
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
        The paper's model A, in which the winch moves end 1, or B, in which end 2 stands at x + u.

    Returns
    -------
    StateSpace
        Inputs: winch u, force on the gondola, then `forces`. Outputs: position and velocity of the gondola, forces at
        the ends. The gondola's position is exact, without `derivatives`.
    """
    parts = _parts(model, chosen, residual, forces)
    n = len(parts.names)
    unit = np.eye(n + ENDS)
    free = np.concatenate([unit[:, :n], unit[:, [n + GONDOLA]]], axis=1)
    end = GONDOLA if location == "gondola" else GROUND
    return _first_order(parts, free, unit[:, [n + end]], [("winch", "m")], mass)


def closed(loop, chosen=None, residual=True, forces=None):
    """Gondola, cable and winch with the winch controlled; exact, without derivatives of inputs.

    Parameters
    ----------
    loop : Loop
    chosen, residual, forces
        As for `cable`, of the modes of `loop.cable`.

    Returns
    -------
    StateSpace
        Inputs: force on the gondola, then `forces`. Outputs: those of `coupled`, and the winch. States: those of
        `coupled`, two of the notch where there is one, the winch (the integrator).
    """
    plant = coupled(loop.cable, loop.mass, loop.location, chosen, residual, forces)
    sign = 1.0 if loop.location == "gondola" else -1.0
    filtering = [] if loop.notch is None else [("notch_1", "m"), ("notch_2", "m")]
    extra = len(filtering) + 1
    a = np.pad(plant.a, (0, extra))
    a[: len(plant.a), -1] = plant.b[:, 0]
    c = np.pad(plant.c, ((0, 1), (0, extra)))
    c[:-1, -1], c[-1, -1] = plant.d[:, 0], 1.0
    b, d = np.pad(plant.b[:, 1:], ((0, extra), (0, 0))), np.pad(plant.d[:, 1:], ((0, 1), (0, 0)))
    seen = c[0]  # the gondola's position
    rate = sign * loop.gain * seen
    if loop.notch is not None:
        a[-3:-1] = _rolloff(loop.notch, seen)
        passed, first, second = _notch_output(loop.notch)
        rate = passed * rate
        rate[-3:-1] = sign * loop.gain * first, sign * loop.gain * second
    a[-1] = rate
    # with the winch a state, its speed and acceleration are known
    speed, acceleration = (matrix[:, 0] for matrix in plant.derivatives)
    c[:-1] += np.outer(speed, rate) + np.outer(acceleration, rate @ a)
    d[:-1] += np.outer(acceleration, rate @ b)
    states = (*plant.states, *filtering, ("winch", "m"))
    return StateSpace(
        a, b, c, d, states, plant.inputs[1:], (*plant.outputs, ("winch", "m")), (np.zeros_like(d), np.zeros_like(d))
    )


def _rolloff(notch, seen):
    """Rows of A for the notch's two states, driven by what it sees: w^2/q and s w/q, q = s^2 + 2 z w s + w^2."""
    rows = np.zeros((2, len(seen)))
    rows[0, -2] = notch.rolloff_omega
    rows[1] = notch.rolloff_omega * seen
    rows[1, -3:-1] += -notch.rolloff_omega, -2 * notch.rolloff_damping_ratio * notch.rolloff_omega
    return rows


def _notch_output(notch):
    """Shares of what the notch sees and of its two states in what it gives. [-]"""
    w1, w2 = notch.omega, notch.rolloff_omega
    passed = (w2 / w1) ** 2
    damped = notch.damping_ratio * w1 - notch.rolloff_damping_ratio * w2
    return passed, passed * (w1**2 - w2**2) / w2**2, passed * 2 * damped / w2


@dataclass(frozen=True)
class _Parts:
    """The second-order model of the module's head, for the kept modes.

    Attributes
    ----------
    mass, damping, stiffness : ndarray, shape (n + 6, n + 6)
    hysteretic : ndarray, shape (n + 6, n + 6), or None
        Loss factor times elastic stiffness.
    omega : ndarray, shape (n,)
        [rad/s]
    names : tuple of str
        Of the modes, by their number in the model.
    forces : ndarray, shape (n + 6, j)
        What each of the forces along the cable does to each coordinate.
    labels : tuple of (str, str)
        Of these forces.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    hysteretic: np.ndarray | None
    omega: np.ndarray
    names: tuple
    forces: np.ndarray
    labels: tuple


def _parts(model, chosen, residual, forces):
    """`_Parts` of an end model; what is left out goes to D and Mr, or is lost without `residual`."""
    chosen = np.arange(len(model.omega)) if chosen is None else np.asarray(chosen, dtype=int)
    source = model.select(chosen) if residual else truncated(model, chosen)
    n = len(chosen)
    empty = np.zeros((n, ENDS))
    mass = np.block([[np.eye(n), empty], [empty.T, source.residual_inertia]])
    squares = np.diag(source.omega**2)
    stiffness = np.block([[squares, source.participation], [source.participation.T, source.feedthrough]])
    damping, hysteretic = source.viscous * mass, None
    if source.strain is None:
        damping[:n, :n] += np.diag(2 * source.damping_ratio * source.omega)
    elif source.strain.law == "kelvin_voigt":
        damping = damping + source.strain.amount * elastic_matrix(source)
    else:
        hysteretic = source.strain.amount * elastic_matrix(source)
    labels, acting = (), np.zeros((n + ENDS, 0))
    if forces is not None:
        # y is the whole movement: of what the ends carry at rest, the modes bring their part
        brought = np.s_[chosen] if residual else np.s_[:]
        lever = model.participation[brought] / model.omega[brought, None] ** 2
        rest = forces.carried + lever.T @ forces.modal[brought]
        labels, acting = tuple(forces.labels), np.concatenate([forces.modal[chosen], rest])
    names = tuple(f"mode_{k + 1}" for k in chosen)
    return _Parts(mass, damping, stiffness, hysteretic, source.omega, names, acting, labels)


def _equivalent(elastic, mass, stiffness):
    """Viscous damping that gives each mode of (mass, stiffness) its hysteretic share, half of its elastic one."""
    root = np.sqrt(mass)
    square, vector = np.linalg.eigh(stiffness / np.outer(root, root))
    omega = np.sqrt(np.maximum(square, 0.0))
    shapes = vector / root[:, None]
    rate = np.einsum("ik,ij,jk->k", shapes, elastic, shapes) / np.where(omega > 0, omega, 1.0)
    weighted = mass[:, None] * shapes
    return weighted * rate @ weighted.T


def _first_order(parts, free, driven, inputs, gondola=None):
    """StateSpace for (y, u) = free @ moving + driven @ inputs; a gondola is the last of `moving`."""
    n, moving, mass = len(parts.names), free.shape[1], np.diagonal(free.T @ parts.mass @ free).copy()
    if gondola is not None:
        mass[-1] += gondola
    damping = parts.damping
    if parts.hysteretic is not None:
        elastic, stiffness = (free.T @ matrix @ free for matrix in (parts.hysteretic, parts.stiffness))
        damping = damping + free @ _equivalent(elastic, mass, stiffness) @ free.T
    k, c = (free.T @ matrix @ free / mass[:, None] for matrix in (parts.stiffness, damping))
    given = [-(free.T @ matrix @ driven) / mass[:, None] for matrix in (parts.stiffness, damping, parts.mass)]
    body = np.eye(moving)[:, moving - (gondola is not None) :]
    push = np.concatenate([body, free.T @ parts.forces], axis=1) / mass[:, None]
    # moving = z + shift u and moving' = v + kick u + shift u' leave no derivative of u in z' and v'
    shift = given[2]
    kick = given[1] - c @ shift
    late = given[0] - k @ shift - c @ kick
    scale = np.concatenate([parts.omega, np.ones(moving - n)])
    a = np.block([[np.zeros((moving, moving)), np.diag(scale)], [-k / scale, -c]])
    b = np.block([[scale[:, None] * kick, np.zeros_like(push)], [late, push]])
    # outputs: the ends' forces, before them the gondola's position and velocity
    r0, r1, r2 = (matrix[n:] @ free for matrix in (parts.stiffness, damping, parts.mass))
    s0, s1, s2 = (matrix[n:] @ driven for matrix in (parts.stiffness, damping, parts.mass))
    held = np.concatenate([np.zeros((ENDS, body.shape[1])), -parts.forces[n:]], axis=1)
    if gondola is not None:
        above = np.zeros((2, moving))
        r0, r1, r2 = (np.concatenate([above, rows]) for rows in (r0, r1, r2))
        s0, s1, s2, held = (np.concatenate([np.zeros((2, rows.shape[1])), rows]) for rows in (s0, s1, s2, held))
        r0[0, -1] = r1[1, -1] = 1.0
    output = np.concatenate([r0 / scale, r1], axis=1) + r2 @ a[moving:]
    d = np.concatenate([r0 @ shift + r1 @ kick + r2 @ late + s0, r2 @ push + held], axis=1)
    first, second = r1 @ shift + r2 @ kick + s1, r2 @ shift + s2
    nothing = np.zeros_like(held)
    derivatives = tuple(np.concatenate([rows, nothing], axis=1) for rows in (first, second))
    return StateSpace(
        a, b, output, d, *_labels(parts, inputs, gondola), derivatives, _free_cable(parts, damping, gondola)
    )


def _labels(parts, inputs, gondola):
    """States, inputs and outputs: name and unit of each."""
    place = [(f"{name}_amplitude", f"{MODAL}/s") for name in parts.names]
    speed = [(f"{name}_velocity", f"{MODAL}/s") for name in parts.names]
    outputs, inputs = [(f"force_{name}", "N") for name in NAMES], list(inputs)
    if gondola is not None:
        moved = [("gondola_position", "m"), ("gondola_velocity", "m/s")]
        place, speed, outputs = [*place, moved[0]], [*speed, moved[1]], [*moved, *outputs]
        inputs.append(("force_gondola", "N"))
    return (*place, *speed), (*inputs, *parts.labels), tuple(outputs)


def _free_cable(parts, damping, gondola):
    """`SecondOrder` of the cable with free ends, the gondola on end 2."""
    mass = parts.mass.copy()
    if gondola is not None:
        mass[len(parts.names) + GONDOLA, len(parts.names) + GONDOLA] += gondola
    names = (*((name, MODAL) for name in parts.names), *((name, "m") for name in NAMES))
    return SecondOrder(mass, damping, parts.stiffness, names)
