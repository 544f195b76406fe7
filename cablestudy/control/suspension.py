"""A suspension as a linear system: winches and forces are its inputs, displacements and tensions its outputs.

Reeling in dL at an end of a cable moves that end out along its tangent by (1 + T/EA) dL, T being the tension there.
That is exact for the rest of the cable; the force at the winch itself is that of the place where the cable now ends,
which differs by the weight w dL of what was reeled in. As in the statics of a shorter cable, that piece is there no
more: its mass is not added to a body on which the winch stands.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError
from cablestudy.system.linear import MODAL, LinearSystem
from cablestudy.system.matrices import dense
from cablestudy.system.rigid import cross_matrix
from cablestudy.system.suspension import AXES, GROUND, outward

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
    displacements = np.zeros((len(direction), 2, 3, len(winches)))
    for column, winch in enumerate(winches):
        if winch.direction is not None:
            displacements[winch.cable, winch.end, :, column] = winch.direction
            continue
        stretch = 1 + tension[winch.cable, winch.end] / equilibrium.catenary.span.axial_stiffness[winch.cable]
        displacements[winch.cable, winch.end, :, column] = stretch * direction[winch.cable, winch.end]
    return displacements.reshape(6 * len(direction), len(winches))


def load_off_ends(equilibrium, winches):
    """Forces on the ends of all cables by the load that each winch takes off its own end, shape (6 c, i). [N/m]"""
    span = equilibrium.catenary.span
    lifted = np.zeros((len(span.chord), 2, 3, len(winches)))
    for column, winch in enumerate(winches):
        if winch.direction is not None:
            continue
        load = span.mass[winch.cable] * span.gravity[winch.cable]
        lifted[winch.cable, winch.end, :, column] = load * np.broadcast_to(span.vertical, (len(lifted), 3))[winch.cable]
    return lifted.reshape(6 * len(lifted), len(winches))


def winch_loads(layout, winches):
    """Loads on bodies and points per movement of each winch, with bodies and cables at rest, shape (d, i).

    They are by the load that a winch takes off its own end, see `load_off_ends`, and by the arm of the cable: where a
    winch on a body moves the end by v d, the force F of the cable has the additional moment v d x F about the body. One
    that reels moves the end along F, without a moment. [N/m, N]
    """
    equilibrium, suspension = layout.equilibrium, layout.equilibrium.suspension
    moments = np.zeros((len(suspension.body_names), 6, len(winches)))
    for column, winch in enumerate(winches):
        body = suspension.owner[winch.cable, winch.end]
        if winch.direction is not None and body != GROUND:
            moments[body, 3:, column] = np.cross(winch.direction, equilibrium.end_forces[winch.cable, winch.end])
    lifted = layout.connection.T @ load_off_ends(equilibrium, winches)
    return lifted + moments.reshape(6 * len(moments), len(winches))[layout.free]


def second_order(layout, kept, winches=(), markers=(), midspans=()):
    """Assemble the `LinearSystem` of a suspension from winches and forces to displacements and tensions.

    Its coordinates are the modal amplitudes of all cables, then the free displacements of bodies and points.

    Parameters
    ----------
    layout : Layout
    kept : list of Kept
        Modes and residual vectors of each cable.
    winches : sequence of Winch
    markers : sequence of Marker
    midspans : sequence of ndarray, shape (3, k)
        Displacement at mid-span of each cable by its modes and ends, see `wind.strips.midspan_shapes`; by default none
        is an output.

    Returns
    -------
    LinearSystem
        Inputs: `winch.CABLE` (length reeled in, m), then `BODY.force_x` to `BODY.moment_z` of all free displacements,
        at the reference point. Outputs: those displacements, `BODY.MARKER.x` and so on, `CABLE.midspan.x` and so on
        along the axes of its chord frame, `LINK.force`, `CABLE.tension_from`, `CABLE.tension_to`. Displacements need no
        derivatives of inputs in the state space; tensions at moved ends do.

    Raises
    ------
    NoSolutionError
        There are too many coordinates.
    """
    equilibrium = layout.equilibrium
    free, modal = len(layout.free), sum(len(cable.element.omega) for cable in kept)
    if free + modal > CONTROL.state_space_coordinates:
        raise NoSolutionError(
            f"the linear model has {free + modal} coordinates, and a state space is made of at most "
            f"{CONTROL.state_space_coordinates}"
        )
    end_movements = reeled(equilibrium, winches)
    system = layout.system([cable.element for cable in kept], end_movements)
    mass, damping, stiffness = (dense(matrix) for matrix in (system.mass, system.damping, system.stiffness))
    lifted = load_off_ends(equilibrium, winches)
    b = tuple(_winch_forces(system, modal, winch_loads(layout, winches)))
    c, d = outputs(layout, kept, end_movements, lifted, markers, midspans)
    input_names, output_names = labels(layout, winches, markers, bool(midspans))
    names = _coordinates(layout, kept), input_names[: len(winches)], output_names
    driven_by_winches = LinearSystem(mass, damping, stiffness, b, free, c, d, *names)
    return driven_by_winches.with_forces(np.eye(free + modal)[:, modal:], input_names[len(winches) :])


def _winch_forces(system, modal, loads):
    """Forces on the coordinates by movements of winches, their rates and accelerations: 3 ndarray of shape (n, i)."""
    static, *by_rates = (dense(matrix) for matrix in system.b)
    static = static.copy()
    static[modal:] += loads
    return [static, *(matrix.real for matrix in by_rates)]


def _of_bodies(layout, words, units):
    """Name and unit of each free displacement, or of its load, from six `words` and six `units`."""
    names = layout.equilibrium.suspension.body_names
    return tuple((f"{names[row // 6]}.{words[row % 6]}", units[row % 6]) for row in layout.free.tolist())


def labels(layout, winches=(), markers=(), midspans=False):
    """Name and unit of each input and of each output of `second_order`, mid-spans among them or not: two tuples."""
    suspension = layout.equilibrium.suspension
    inputs = [(f"winch.{suspension.cable_names[winch.cable]}", "m") for winch in winches]
    bodies = suspension.body_names
    places = [f"{bodies[marker.body]}.{marker.name}.{axis}" for marker in markers for axis in "xyz"]
    places += [f"{name}.midspan.{axis}" for name in suspension.cable_names if midspans for axis in "xyz"]
    forces = [(f"{name}.force", "N") for name in suspension.link_names]
    forces += [(f"{name}.tension_{end}", "N") for name in suspension.cable_names for end in ENDS]
    displacements = [*_of_bodies(layout, AXES, LENGTHS), *((place, "m") for place in places)]
    return (*inputs, *_of_bodies(layout, LOADS, LOAD_UNITS)), (*displacements, *forces)


def _coordinates(layout, kept):
    """Name and unit of each coordinate."""
    coordinates = []
    for name, cable in zip(layout.equilibrium.suspension.cable_names, kept, strict=True):
        residuals = len(cable.element.omega) - cable.modes
        coordinates += [(f"{name}.mode_{k + 1}", MODAL) for k in range(cable.modes)]
        coordinates += [(f"{name}.residual_{k + 1}", MODAL) for k in range(residuals)]
    return (*coordinates, *_of_bodies(layout, AXES, LENGTHS))


def outputs(layout, kept, end_movements, lifted, markers, midspans=()):
    """Output matrices of a suspension: C0, C1, C2 of z, z', z'' and D0, D1, D2 of v, v', v''.

    z are the coordinates and v the lengths that winches reel in. Outputs are displacements of bodies, of markers and at
    mid-spans, then forces of links, then tensions.

    Parameters
    ----------
    layout, kept, markers, midspans
        As for `second_order`.
    end_movements, lifted : ndarray, shape (6 c, i)
        Displacements of all ends by the winches, and the loads that these take off, see `reeled` and `load_off_ends`.

    Returns
    -------
    c, d : tuple of 3 ndarray, shapes (o, n) and (o, i)
        The first of each is complex where damping is hysteretic.
    """
    suspension, free = layout.equilibrium.suspension, len(layout.free)
    modal = sum(len(cable.element.omega) for cable in kept)
    displacements = np.eye(6 * len(suspension.body_names))[:, layout.free]  # of all bodies by the free ones
    displacement_rows = [np.eye(free)]  # by the free displacements: themselves, then those of markers
    for marker in markers:
        arm = layout.equilibrium.rotation[marker.body] @ np.asarray(marker.place, dtype=float)
        marker_rows = np.concatenate([np.eye(3), -cross_matrix(arm)], axis=1)
        displacement_rows.append(marker_rows @ displacements[6 * marker.body : 6 * marker.body + 6])
    of_displacements = np.concatenate(displacement_rows)
    of_displacements = np.concatenate([np.zeros((len(of_displacements), modal)), of_displacements], axis=1)
    by_winches = np.zeros((len(of_displacements), end_movements.shape[1]))
    midspan_c, midspan_d = _midspans(layout, kept, end_movements, midspans, modal)
    of_displacements = np.concatenate([of_displacements, midspan_c])
    by_winches = np.concatenate([by_winches, midspan_d])
    # displacements do not depend on velocities and accelerations, links and tensions do
    c_without_tensions = [of_displacements * (order == 0) for order in range(3)]
    if suspension.link_names:
        stretch = np.pad(layout.elongation, ((0, 0), (modal, 0)))
        factors = suspension.link_stiffness, suspension.link_damping, np.zeros(len(stretch))
        link_forces = [factor[:, None] * stretch for factor in factors]
        c_without_tensions = [np.concatenate(pair) for pair in zip(c_without_tensions, link_forces, strict=True)]
        by_winches = np.pad(by_winches, ((0, len(stretch)), (0, 0)))
    tensions = _tensions(layout, kept, end_movements, lifted, modal)
    pairs = zip(c_without_tensions, tensions, strict=True)
    c = [np.concatenate([others, of_tensions]) for others, (of_tensions, _) in pairs]
    d = [np.concatenate([by_winches * (order == 0), of_tensions]) for order, (_, of_tensions) in enumerate(tensions)]
    return tuple(c), tuple(d)


def _midspans(layout, kept, imposed, midspans, modal):
    """Displacements at mid-span by the coordinates and by the winches: two ndarray, shapes (3 c, n) and (3 c, i)."""
    ends, count = dense(layout.connection), 3 * len(midspans)
    c, d, begin = np.zeros((count, modal + ends.shape[1])), np.zeros((count, imposed.shape[1])), 0
    for cable, shapes in enumerate(midspans):
        modes = len(kept[cable].element.omega)
        rows, end_rows = slice(3 * cable, 3 * cable + 3), slice(6 * cable, 6 * cable + 6)
        c[rows, begin : begin + modes] = shapes[:, :modes]
        c[rows, modal:] = shapes[:, modes:] @ ends[end_rows]
        d[rows] = shapes[:, modes:] @ imposed[end_rows]
        begin += modes
    return c, d


def _tensions(layout, kept, end_movements, lifted, modal):
    """Output matrices of the tensions at both ends of all c cables: list of pairs (C_j, D_j) for j = 0, 1, 2.

    C_j, shape (2 c, n), multiplies the j-th derivative of the coordinates z, and D_j, shape (2 c, i), that of the
    lengths v reeled in. Parameters as of `outputs`; `modal` is the number of modal amplitudes.
    """
    direction, _ = outward(layout.equilibrium)
    ends = dense(layout.connection)
    matrices = [cable.element.matrices() for cable in kept]
    dtypes = [np.result_type(float, *(stiffness for _, _, stiffness in matrices)), float, float]
    c = [np.zeros((2 * len(kept), modal + ends.shape[1]), dtype) for dtype in dtypes]
    d = [np.zeros((2 * len(kept), end_movements.shape[1]), dtype) for dtype in dtypes]
    first_mode = 0  # coordinate of the modes of a cable
    for cable, (mass, damping, stiffness) in enumerate(matrices):
        modes, rows = len(kept[cable].element.omega), slice(2 * cable, 2 * cable + 2)
        end_rows = slice(6 * cable, 6 * cable + 6)
        along = np.zeros((2, 6))  # from forces on the ends to tensions
        along[0, :3], along[1, 3:] = direction[cable]
        for order, matrix in enumerate((stiffness, damping, mass)):
            tension = along @ matrix[modes:]
            c[order][rows, first_mode : first_mode + modes] = tension[:, :modes]
            c[order][rows, modal:] = tension[:, modes:] @ ends[end_rows]
            d[order][rows] = tension[:, modes:] @ end_movements[end_rows]
        d[0][rows] -= along @ lifted[end_rows]
        first_mode += modes
    return list(zip(c, d, strict=True))
