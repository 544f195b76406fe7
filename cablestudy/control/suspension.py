"""A suspension as a linear system of first order: winches and forces in, displacements and tensions out.

Reeling in dL at an end of a cable moves that end out along its tangent by (1 + T/EA) dL, T being the tension there.
That is exact for the rest of the cable; the force at the winch itself is that of the place where the cable now ends,
which differs by the weight w dL of what was reeled in. As in the statics of a shorter cable, that piece is there no
more: its mass is not added to a body on which the winch stands.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.statespace import state_space_of
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError
from cablestudy.system.linear import MODAL, LinearSystem, dense
from cablestudy.system.rigid import cross_matrix
from cablestudy.system.suspension import AXES, outward

FROM, TO = 0, 1
ENDS = ("from", "to")
LOADS = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
LENGTHS, LOAD_UNITS = ("m", "m", "m", "rad", "rad", "rad"), ("N", "N", "N", "N m", "N m", "N m")


@dataclass(frozen=True)
class Winch:
    """A winch that reels in a cable, or moves its end.

    Attributes
    ----------
    cable : int
    end : {FROM, TO}
    direction : ndarray, shape (3,), optional
        Unit vector along which it moves the end, global axes; without it it reels in the cable. [-]
    """

    cable: int
    end: int = FROM
    direction: np.ndarray | None = None


@dataclass(frozen=True)
class Marker:
    """A place on a body whose motion is an output.

    Attributes
    ----------
    name : str
    body : int
    place : tuple of 3 float
        From the reference point, body axes. [m]
    """

    name: str
    body: int
    place: tuple


def reeled(equilibrium, winches):
    """H: displacements of the six ends of all cables per movement of each winch, shape (6 c, i). [-]"""
    direction, tension = outward(equilibrium)
    moved = np.zeros((len(direction), 2, 3, len(winches)))
    for place, winch in enumerate(winches):
        if winch.direction is not None:
            moved[winch.cable, winch.end, :, place] = winch.direction
            continue
        stretch = 1 + tension[winch.cable, winch.end] / equilibrium.catenary.span.axial_stiffness[winch.cable]
        moved[winch.cable, winch.end, :, place] = stretch * direction[winch.cable, winch.end]
    return moved.reshape(6 * len(direction), len(winches))


def load_off_ends(equilibrium, winches):
    """Forces on the ends of all cables by the load that each winch takes off its own end, shape (6 c, i). [N/m]"""
    span = equilibrium.catenary.span
    lifted = np.zeros((len(span.chord), 2, 3, len(winches)))
    for place, winch in enumerate(winches):
        if winch.direction is not None:
            continue
        load = span.mass[winch.cable] * span.gravity[winch.cable]
        lifted[winch.cable, winch.end, :, place] = load * np.broadcast_to(span.vertical, (len(lifted), 3))[winch.cable]
    return lifted.reshape(6 * len(lifted), len(winches))


def state_space(layout, kept, winches=(), markers=()):
    """`StateSpace` of `second_order` with all its coordinates; hysteretic damping is viscous there."""
    return state_space_of(second_order(layout, kept, winches, markers).viscous())


def second_order(layout, kept, winches=(), markers=(), midspans=()):
    """The suspension from winches and forces to displacements and tensions.

    Parameters
    ----------
    layout : Layout
    kept : list of Kept
        Coordinates of each cable.
    winches : sequence of Winch
    markers : sequence of Marker
    midspans : sequence of ndarray, shape (3, k)
        Of each cable, see `wind.strips.midspan_shapes`; by default none is an output.

    Returns
    -------
    LinearSystem
        Inputs: `winch.CABLE` (m reeled in), then `BODY.force_x` to `BODY.moment_z` of all free displacements, at the
        reference point. Outputs: those displacements, `BODY.MARKER.x` and so on, `CABLE.midspan.x` and so on along
        the axes of its chord frame, `LINK.force`, `CABLE.tension_from`,
        `CABLE.tension_to`. Displacements need no derivatives of inputs in the state space; tensions at moved ends do.

    Raises
    ------
    NoSolutionError
        There are too many coordinates.

    """
    equilibrium = layout.equilibrium
    free, modal = len(layout.free), sum(len(one.element.omega) for one in kept)
    if free + modal > CONTROL.state_space_coordinates:
        raise NoSolutionError(
            f"the linear model has {free + modal} coordinates, and a state space is made of at most "
            f"{CONTROL.state_space_coordinates}"
        )
    imposed = reeled(equilibrium, winches)
    system = layout.system([one.element for one in kept], imposed)
    mass, damping, stiffness = (dense(part) for part in (system.mass, system.damping, system.stiffness))
    lifted = load_off_ends(equilibrium, winches)
    driven = _winch_forces(layout, system, modal, lifted)
    loads = np.eye(free + modal)[:, modal:]
    driven = [np.concatenate([part, loads * (order == 0)], axis=1) for order, part in enumerate(driven)]
    moved, follow = outputs(layout, kept, imposed, lifted, markers, midspans)
    inputs, names = labels(layout, winches, markers, bool(midspans))
    held = np.zeros((len(names), free))
    return LinearSystem(
        mass,
        damping,
        stiffness,
        tuple(driven),
        free,
        moved,
        tuple(np.concatenate([part, held], axis=1) for part in follow),
        _coordinates(layout, kept),
        inputs,
        names,
    )


def _winch_forces(layout, system, modal, lifted):
    static, *moving = (dense(part) for part in system.b)
    static = static.copy()
    static[modal:] += layout.connection.T @ lifted
    return [static, *(part.real for part in moving)]


def _of_bodies(layout, words, units):
    """Name and unit of what belongs to each free displacement."""
    names = layout.equilibrium.suspension.body_names
    return tuple((f"{names[place // 6]}.{words[place % 6]}", units[place % 6]) for place in layout.free.tolist())


def labels(layout, winches=(), markers=(), midspans=False):
    """Name and unit of each input and of each output of `second_order`, mid-spans among them or not: two tuples."""
    suspension = layout.equilibrium.suspension
    inputs = [(f"winch.{suspension.cable_names[winch.cable]}", "m") for winch in winches]
    places = [f"{suspension.body_names[marker.body]}.{marker.name}.{axis}" for marker in markers for axis in "xyz"]
    places += [f"{name}.midspan.{axis}" for name in suspension.cable_names if midspans for axis in "xyz"]
    forces = [(f"{name}.force", "N") for name in suspension.link_names]
    forces += [(f"{name}.tension_{end}", "N") for name in suspension.cable_names for end in ENDS]
    moved = [*_of_bodies(layout, AXES, LENGTHS), *((place, "m") for place in places)]
    return (*inputs, *_of_bodies(layout, LOADS, LOAD_UNITS)), (*moved, *forces)


def _coordinates(layout, kept):
    """Name and unit of each coordinate."""
    found = []
    for name, one in zip(layout.equilibrium.suspension.cable_names, kept, strict=True):
        residuals = len(one.element.omega) - one.modes
        found += [(f"{name}.mode_{k + 1}", MODAL) for k in range(one.modes)]
        found += [(f"{name}.residual_{k + 1}", MODAL) for k in range(residuals)]
    return (*found, *_of_bodies(layout, AXES, LENGTHS))


def outputs(layout, kept, imposed, lifted, markers, midspans=()):
    """Output matrices C0, C1, C2 of z, z', z'' and D0, D1, D2 of v, v', v''.

    Parameters
    ----------
    layout, kept, markers, midspans
        As for `second_order`.
    imposed, lifted : ndarray, shape (6 c, i)
        See `reeled` and `load_off_ends`.

    Returns
    -------
    moved, follow : tuple of 3 ndarray, shapes (o, n) and (o, i)
        By the coordinates, and by the winches; the first of each is complex where damping is hysteretic.
    """
    suspension, free = layout.equilibrium.suspension, len(layout.free)
    modal = sum(len(one.element.omega) for one in kept)
    place = np.eye(6 * len(suspension.body_names))[:, layout.free]
    rows = [np.eye(free)]
    for marker in markers:
        arm = layout.equilibrium.rotation[marker.body] @ np.asarray(marker.place, dtype=float)
        moving = np.concatenate([np.eye(3), -cross_matrix(arm)], axis=1)
        rows.append(moving @ place[6 * marker.body : 6 * marker.body + 6])
    shown = np.concatenate(rows)
    shown = np.concatenate([np.zeros((len(shown), modal)), shown], axis=1)
    still = np.zeros((len(shown), imposed.shape[1]))
    middles, follow_winches = _midspans(layout, kept, imposed, midspans, modal)
    shown, still = np.concatenate([shown, middles]), np.concatenate([still, follow_winches])
    tensions, shown = _tensions(layout, kept, imposed, lifted, modal), [shown * (order == 0) for order in range(3)]
    if suspension.link_names:
        stretch = np.pad(layout.elongation, ((0, 0), (modal, 0)))
        factors = suspension.link_stiffness, suspension.link_damping, np.zeros(len(stretch))
        shown = [np.concatenate([part, factor[:, None] * stretch]) for part, factor in zip(shown, factors, strict=True)]
        still = np.pad(still, ((0, len(stretch)), (0, 0)))
    moved = [np.concatenate([own, part]) for own, (part, _) in zip(shown, tensions, strict=True)]
    follow = [np.concatenate([still * (order == 0), part]) for order, (_, part) in enumerate(tensions)]
    return tuple(moved), tuple(follow)


def _midspans(layout, kept, imposed, midspans, modal):
    """Displacements at mid-span by the coordinates and by the winches: two ndarray, shapes (3 c, n) and (3 c, i)."""
    ends, count = dense(layout.connection), 3 * len(midspans)
    moved, follow, begin = np.zeros((count, modal + ends.shape[1])), np.zeros((count, imposed.shape[1])), 0
    for cable, shapes in enumerate(midspans):
        n, rows, own = len(kept[cable].element.omega), slice(3 * cable, 3 * cable + 3), slice(6 * cable, 6 * cable + 6)
        moved[rows, begin : begin + n] = shapes[:, :n]
        moved[rows, modal:] = shapes[:, n:] @ ends[own]
        follow[rows] = shapes[:, n:] @ imposed[own]
        begin += n
    return moved, follow


def _tensions(layout, kept, imposed, lifted, modal):
    """Changes of tension at the ends: parts by z, z' and z'', each with that by v, v' and v''."""
    direction, _ = outward(layout.equilibrium)
    ends = dense(layout.connection)
    matrices = [one.element.matrices() for one in kept]
    kinds = [np.result_type(float, *(parts[2] for parts in matrices)), float, float]
    moved = [np.zeros((2 * len(kept), modal + ends.shape[1]), kind) for kind in kinds]
    follow = [np.zeros((2 * len(kept), imposed.shape[1]), kind) for kind in kinds]
    begin = 0
    for cable, (one, (mass, damping, stiffness)) in enumerate(zip(kept, matrices, strict=True)):
        n, own = len(one.element.omega), slice(6 * cable, 6 * cable + 6)
        pulled = np.zeros((2, 6))
        pulled[0, :3], pulled[1, 3:] = direction[cable]
        for order, matrix in enumerate((stiffness, damping, mass)):
            force, rows = pulled @ matrix[n:], slice(2 * cable, 2 * cable + 2)
            moved[order][rows, begin : begin + n] = force[:, :n]
            moved[order][rows, modal:] = force[:, n:] @ ends[own]
            follow[order][rows] = force[:, n:] @ imposed[own]
        follow[0][rows] -= pulled @ lifted[own]
        begin += n
    return list(zip(moved, follow, strict=True))
