"""One cable, alone or with a gondola and a winch, as a linear system in the modes that it has between fixed ends.

Its coordinates are the absolute modal amplitudes y and the six displacements u of the ends,

    [I  0 ] [y]''   [      ] [y]'   [W^2  p] [y]   [modal forces        ]
    [0  Mr] [u]   + [  C   ] [u]  + [p^T  D] [u] = [forces at the ends  ]

(Craig and Bampton, 1968, with modes normalised to unit mass): those of a `Superelement`, whose amplitudes are
q = y - m u with the coupling m of its modes to the ends; p = -W^2 m. D is the static end stiffness plus what the kept
modes take off it, Mr the inertia that they leave. C holds 2 zeta W of each mode of damping ratio zeta, and for the ends
what the omitted modes add as slow movements of the ends meet them: the sum of 2 zeta p p^T/W^3. Hysteretic damping has
no state space: each mode of the moving parts (gondola included) gets the viscous damping that dissipates the same
energy per cycle. Load stiffness of the cable is added to its stiffness; it is not symmetric, and modes are without it.
"""

from dataclasses import replace

import numpy as np

from cablestudy.control.statespace import channels, state_space_of
from cablestudy.control.tolerances import CONTROL
from cablestudy.system.first_order import Allocation, LinearControl
from cablestudy.system.linear import MODAL, LinearSystem, equivalent_viscous
from cablestudy.system.superelement import GONDOLA, GROUND, NAMES

ENDS = len(NAMES)
WINCH = (("winch", "m"),)
OF_GONDOLA = ("gondola_position", "m"), ("gondola_velocity", "m/s")
FORCES = tuple((f"force_{name}", "N") for name in NAMES)


@np.errstate(all="ignore")  # StateSpace refuses what overflows
def state_space(model, chosen=None, residual=True, nodes=None, gondola=None, location="ground", loop=None, highest=0.0):
    """`StateSpace` of one cable: with moved ends, or with a winch and a gondola on end 2 that is free along x.

    Parameters
    ----------
    model : Superelement
        The cable with all its n modes with fixed ends.
    chosen : ndarray of int, optional
        Indices of the modes to keep, from 0. Default: all.
    residual : bool
        True to keep the static part, the inertia and the modal damping of the modes left out. Else their absolute
        amplitudes are held at zero, as in the paper that this program follows.
    nodes : ndarray, shape (n + 6, 3 j), optional
        Displacements of j nodes along x, y and z by the modes [1/sqrt(kg)] and by the ends [-]: forces on these nodes
        are inputs.
    gondola : (float, float), optional
        Mass [kg] and viscous damping [N s/m] of a gondola.
    location : {"ground", "gondola"}
        Where the winch stands. On the ground it moves end 1 along x (the paper's model A). On the gondola it moves end
        2 along x relative to the gondola (model B).
    loop : Loop or LinearControl, optional
        Its gain, notch and law close the loop from the gondola's position to the winch.
    highest : float
        Frequency up to which, at least, a delay of the loop is approximated well. [rad/s]

    Returns
    -------
    StateSpace
        Inputs without a gondola: the six displacements of the ends; with one: winch and force on the gondola. Then come
        the forces on nodes. With a loop the reference of the gondola's position, the last input, takes the place of the
        winch.

        Outputs: position and velocity of a gondola; the six forces that hold the ends against the cable alone; with a
        loop the movement of the winch. The forces depend on derivatives of imposed displacements too (D1, D2). The
        gondola's position does not, unless the law of a loop passes the reference on to the winch directly.
    """
    chosen = np.arange(len(model.omega)) if chosen is None else np.asarray(chosen, dtype=int)
    system, free_cable = linear_system(model, chosen, residual, nodes, gondola, location)
    if loop is None:
        return state_space_of(system, free_cable)
    law, law_names = loop.law.state_space_of(loop.law.approximants(highest))
    # measured is the last coordinate, the gondola's position: the winch moves it forwards, or backwards if on board
    rates = np.array([[-1.0 if location == "gondola" else 1.0]])
    allocation = Allocation(np.eye(len(system))[-1:], np.eye(1), rates)
    control = LinearControl(allocation, loop.gain, loop.notches, law, law_names)
    closed = state_space_of(system, loop=control, measured=(("position", "m"),))
    loop_states = [*(("notch_1", "notch_2") if loop.notches[0] else ()), *law_names, "winch"]
    states = (*closed.states[: 2 * len(system)], *((name, "m") for name in loop_states))
    closed = replace(closed, states=states, inputs=(("reference", "m"), *closed.inputs[1:]))
    return channels(closed, [*range(1, len(closed.inputs)), 0])  # the reference last


def channel_names(with_loop):
    """Names of the inputs and of the outputs of `state_space` with a gondola, without forces on nodes: two lists."""
    winch, inputs, outputs = WINCH[0][0], ["force_gondola"], [name for name, _ in (*OF_GONDOLA, *FORCES)]
    return ([*inputs, "reference"], [*outputs, winch]) if with_loop else ([winch, *inputs], outputs)


def linear_system(model, chosen, residual, nodes, gondola, location):
    """The real `LinearSystem` of `state_space`, and the same with free ends; arguments as for that."""
    system, modes = _free_cable(model, chosen, residual, nodes), len(chosen)
    ends = np.arange(modes, modes + ENDS)
    names = (*((f"mode_{k + 1}", MODAL) for k in chosen.tolist()), *((name, "m") for name in NAMES))
    if gondola is None:
        free, imposed, inputs, outputs = np.arange(modes), ends, names[modes:], FORCES
        free_names = names[:modes]
    else:
        system = _with_separate_gondola(system, *gondola)
        free = np.append(np.arange(modes), ends[GONDOLA])
        imposed, inputs = ends[[GONDOLA if location == "gondola" else GROUND]], WINCH
        free_names, outputs = (*names[:modes], OF_GONDOLA[0]), (*OF_GONDOLA, *FORCES)
    attached = np.eye(len(system), modes + ENDS)  # motions in which the gondola moves with its end
    attached[modes + ENDS :, ends[GONDOLA]] = 1.0
    system, scale = _viscous(system, attached[:, free], modes + ENDS), None
    loads = _load_stiffness(model, chosen, residual)
    if loads is not None:
        system = replace(system, stiffness=system.stiffness + np.pad(loads, (0, len(system) - len(loads))))
        scale = np.append(model.omega[chosen], np.ones(len(free) - modes))
    system = _with_outputs(system, ends, outputs)
    with_imposed_ends = system.within(attached[:, free], np.eye(len(system))[:, imposed], inputs)
    with_imposed_ends = replace(with_imposed_ends, coordinates=free_names, scale=scale)
    return with_imposed_ends, replace(system.within(attached), coordinates=names)


def _free_cable(model, chosen, residual, nodes):
    """`LinearSystem` of a cable with free ends: absolute amplitudes of chosen modes, six ends, forces on nodes.

    Absolute amplitudes y = q + m u of the omitted modes follow the ends statically, y = m u (q = 0), with `residual`;
    else they are held at zero, q = -m u. Load stiffness is not in the system.
    """
    modes, kept = len(model.omega), len(chosen)
    space, subtracted = np.zeros((modes + ENDS, kept + ENDS)), chosen if residual else np.arange(modes)
    space[chosen, np.arange(kept)], space[modes:, kept:] = 1.0, np.eye(ENDS)
    space[subtracted, kept:] = -model.coupling[subtracted]
    nodes = np.zeros((modes + ENDS, 0)) if nodes is None else nodes
    forces = tuple((f"force_node_{k // 3 + 1}_{'xyz'[k % 3]}", "N") for k in range(nodes.shape[1]))
    relative = LinearSystem(*model.matrices(), (nodes, 0 * nodes, 0 * nodes), inputs=forces)
    system = relative.within(space)
    # modal damping of absolute amplitudes does not act on the ends: what is left where the terms cancel is rounding
    terms = np.abs(space).T @ np.abs(relative.damping) @ np.abs(space)
    damping = np.where(np.abs(system.damping) > CONTROL.cancelled_damping * terms, system.damping, 0.0)
    return replace(system, damping=damping)


def _load_stiffness(model, chosen, residual):
    """Load stiffness of the coordinates of `_free_cable`, shape (k + 6, k + 6); None without."""
    loads = (model.condense if residual else model.truncate)(chosen).load_stiffness
    if loads is None:
        return None
    relative, modes = np.eye(len(loads)), len(chosen)  # q = y - m u
    relative[:modes, modes:] = -model.coupling[chosen]
    return relative.T @ loads @ relative


def _viscous(system, free, of_cable):
    """The system with viscous damping for hysteretic damping of the cable, whose coordinates are the first ones.

    Each mode of the `free` motions, columns, has as much as dissipates the same energy per cycle.
    """
    if not np.iscomplexobj(system.stiffness):
        return system
    moving = system.within(free)
    shapes = free * (np.arange(len(system)) < of_cable)[:, None]
    loss = shapes @ equivalent_viscous(moving.mass, moving.stiffness) @ shapes.T
    return replace(system, damping=system.damping + loss, stiffness=system.stiffness.real)


def _with_outputs(system, ends, names):
    """The system with outputs: position and velocity of a gondola, its last coordinate; forces that hold the ends."""
    gondola = np.eye(len(system))[ends[-1] + 1 :]
    none = np.zeros_like(gondola)
    rows = (
        (gondola, none, system.stiffness[ends]),
        (none, gondola, system.damping[ends]),
        (none, none, system.mass[ends]),
    )
    direct = tuple(np.pad(-forces[ends], ((2 * len(gondola), 0), (0, 0))) for forces in system.b)
    return replace(system, c=tuple(map(np.concatenate, rows)), d=direct, outputs=names)


def _with_separate_gondola(cable, mass, damping):
    """`LinearSystem` of a cable, and of a gondola apart from it as last coordinate, on which the first input acts."""
    last = np.eye(len(cable) + 1)[-1]
    of_gondola = (cable.mass, mass), (cable.damping, damping), (cable.stiffness, 0.0)
    matrices = [np.pad(matrix, (0, 1)) + amount * np.outer(last, last) for matrix, amount in of_gondola]
    b = tuple(np.pad(matrix, ((0, 1), (1, 0))) for matrix in cable.b)
    b[0][-1, 0] = 1.0
    return LinearSystem(*matrices, b, inputs=(("force_gondola", "N"), *cable.inputs))
