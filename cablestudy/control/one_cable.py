"""One cable, alone or with a gondola and a winch, as a linear system in the modes that it has between fixed ends.

Its coordinates are the absolute modal amplitudes y and the six displacements u of the ends,

    [I  0 ] [y]''   [      ] [y]'   [W^2  p] [y]   [modal forces        ]
    [0  Mr] [u]   + [  C   ] [u]  + [p^T  D] [u] = [forces at the ends  ]

(Craig and Bampton, 1968, with modes normalised to unit mass): those of a `Superelement` with q = y - m u. D is the
static end stiffness plus what the kept modes take off it, Mr the inertia that they leave. C holds 2 zeta W of each mode
for modal damping, and for the ends what the omitted modes add as slow movements of the ends meet them: the sum of 2
zeta p p^T/W^3. Hysteretic damping has no state space: each mode of the moving parts (gondola included) gets the viscous
damping that dissipates the same energy per cycle.
"""

from dataclasses import replace

import numpy as np

from cablestudy.control.proper import channels
from cablestudy.control.statespace import state_space_of
from cablestudy.system.first_order import Allocation, LinearControl
from cablestudy.system.linear import MODAL, LinearSystem, equivalent_viscous
from cablestudy.system.superelement import GONDOLA, GROUND, NAMES

ENDS = len(NAMES)
WINCH = (("winch", "m"),)
OF_GONDOLA = ("gondola_position", "m"), ("gondola_velocity", "m/s")


@np.errstate(all="ignore")  # StateSpace refuses what overflows
def state_space(model, chosen=None, residual=True, nodes=None, gondola=None, location="ground", loop=None, highest=0.0):
    """`StateSpace` of a cable whose ends are moved, or with a gondola on end 2 that is free along x and a winch.

    Parameters
    ----------
    model : Superelement
        With all modes, n of them.
    chosen : ndarray of int, optional
        The modes to keep. Default: all.
    residual : bool
        Whether the static part, the inertia and the modal damping of the omitted modes are kept. If not, their absolute
        amplitudes are held at zero, as the paper truncates them.
    nodes : ndarray, shape (n + 6, 3 j), optional
        Displacements of j nodes along x, y and z by the modes [1/sqrt(kg)] and by the ends [-]: forces there are
        inputs.
    gondola : (float, float), optional
        Mass [kg] and viscous damping [N s/m] of a gondola.
    location : {"ground", "gondola"}
        Of the winch: the paper's model A, in which it moves end 1 along x, or B, in which end 2 stands at x + u.
    loop : Loop or LinearControl, optional
        Of which gain, notch and law close the loop of the winch.
    highest : float
        Frequency up to which a delay of the loop is right, at least. [rad/s]

    Returns
    -------
    StateSpace
        Inputs: the displacements of the ends, or winch and force on the gondola, then the forces on nodes; with a loop
        the reference of the gondola's position, the last one, in place of the winch. Outputs: position and velocity of
        a gondola; the six forces that hold the ends where they are, by the cable alone; with a loop the winch.
        Forces at the ends need derivatives of what is imposed, the gondola's position does not; with a loop that of the
        reference alone, where the law passes it on at once.
    """
    chosen = np.arange(len(model.omega)) if chosen is None else np.asarray(chosen, dtype=int)
    system, whole = linear_system(model, chosen, residual, nodes, gondola, location)
    if loop is None:
        return state_space_of(system, whole)
    (notch,), (law, names) = loop.notches, loop.law.state_space(highest)
    allocation = Allocation(np.eye(len(system))[-1:], np.array([[-1.0 if location == "gondola" else 1.0]]))
    control = LinearControl(allocation, loop.gain, loop.notches, law, names)
    found = state_space_of(system, None, control, (("position", "m"),))
    names = [*(("notch_1", "notch_2") if notch else ()), *names, "winch"]
    states = (*found.states[: 2 * len(system)], *((name, "m") for name in names))
    found = replace(found, states=states, inputs=(("reference", "m"), *found.inputs[1:]))
    return channels(found, [*range(1, len(found.inputs)), 0])


def linear_system(model, chosen, residual, nodes, gondola, location):
    """The real `LinearSystem` of `state_space`, and the same with free ends; arguments as for that."""
    every, n = len(model.omega), len(chosen)
    space, following = np.zeros((every + ENDS, n + ENDS)), chosen if residual else np.arange(every)
    space[chosen, np.arange(n)], space[every:, n:] = 1.0, np.eye(ENDS)
    space[following, n:] = -model.coupling[following]
    nodes = np.zeros((every + ENDS, 0)) if nodes is None else nodes
    names = (*((f"mode_{k + 1}", MODAL) for k in chosen.tolist()), *((name, "m") for name in NAMES))
    forces = tuple((f"force_node_{k // 3 + 1}_{'xyz'[k % 3]}", "N") for k in range(nodes.shape[1]))
    system = LinearSystem(*model.matrices(), (nodes, 0 * nodes, 0 * nodes), inputs=forces).within(space)
    ends, outputs = np.arange(n, n + ENDS), tuple((f"force_{name}", "N") for name in NAMES)
    moving, imposed, inputs, coordinates = [*range(n)], ends, tuple((name, "m") for name in NAMES), names[:n]
    if gondola is not None:
        system = _beside_gondola(system, *gondola)
        moving, imposed, inputs = [*moving, ends[GONDOLA]], ends[[GONDOLA if location == "gondola" else GROUND]], WINCH
        outputs, coordinates = (*OF_GONDOLA, *outputs), (*coordinates, OF_GONDOLA[0])
    every, joined = np.eye(len(system)), np.eye(len(system), n + ENDS)
    joined[n + ENDS :, ends[GONDOLA]] = 1.0  # the gondola moves with its end
    free = joined[:, moving]
    if np.iscomplexobj(system.stiffness):
        part, of_cable = system.within(free), free * (np.arange(len(system)) < n + ENDS)[:, None]
        loss = of_cable @ equivalent_viscous(part.mass, part.stiffness) @ of_cable.T
        system = replace(system, damping=system.damping + loss, stiffness=system.stiffness.real)
    place, none = every[n + ENDS :], 0 * every[n + ENDS :]
    shown = (place, none, system.stiffness[ends]), (none, place, system.damping[ends]), (none, none, system.mass[ends])
    held = tuple(np.pad(-part[ends], ((2 * len(place), 0), (0, 0))) for part in system.b)
    system = replace(system, c=tuple(map(np.concatenate, shown)), d=held, outputs=outputs)
    moved = system.within(free, every[:, imposed], inputs)
    return replace(moved, coordinates=coordinates), replace(system.within(joined), coordinates=names)


def _beside_gondola(cable, mass, damping):
    """A cable and beside it a gondola as one more coordinate, on which the first input acts."""
    last = np.eye(len(cable) + 1)[-1]
    amounts = (cable.mass, mass), (cable.damping, damping), (cable.stiffness, 0.0)
    matrices = [np.pad(part, (0, 1)) + amount * np.outer(last, last) for part, amount in amounts]
    driven = tuple(np.pad(part, ((0, 1), (1, 0))) for part in cable.b)
    driven[0][-1, 0] = 1.0
    return LinearSystem(*matrices, driven, inputs=(("force_gondola", "N"), *cable.inputs))
