"""A suspension as a linear system: winches and forces are its inputs, displacements and tensions its outputs.

Reeling in dL at an end of a cable moves that end out along its tangent by (1 + T/EA) dL, T being the tension there.
That is exact for the rest of the cable; the force at the winch itself is that of the place where the cable now ends,
which differs by the weight w dL of what was reeled in. As in the statics of a shorter cable, that piece is there no
more: its mass is not added to a body on which the winch stands.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.matrices import dense
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError
from cablestudy.statics.rigid import cross_matrix
from cablestudy.statics.suspension import AXES, GROUND, tangents
from cablestudy.system.assemble import assemble_dense
from cablestudy.system.coupled import Layout
from cablestudy.system.linear import MODAL, LinearSystem

FROM, TO = 0, 1
ENDS = ("from", "to")
LOADS = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
LENGTHS, LOAD_UNITS = ("m", "m", "m", "rad", "rad", "rad"), ("N", "N", "N", "N m", "N m", "N m")


@dataclass(frozen=True)
class Winch:
    """A winch that reels in a cable, or moves its end."""

    cable: int
    end: int = FROM  # FROM or TO
    direction: np.ndarray | None = None  # unit vector along which it moves the end, global axes; None reels in [-]


@dataclass(frozen=True)
class Marker:
    """A place on a body whose motion is an output."""

    name: str
    body: int
    place: tuple  # of 3 float, from the reference point, body axes [m]


class _Ends:
    """Effect of winches on the ends of the c cables, of n suspensions ("rows") with equal names and connections.

    A winch that reels in v moves the end of its cable along the tangent t by (1 + T/EA) v, T being the tension there,
    and takes the weight of the length v off it. A winch that moves an end in a direction d displaces it by v d.

    Parameters
    ----------
    layouts : list of Layout
        Bodies and cables of each row.
    winches : list of (list of Winch)
        The i winches of each row. Those of equal index are on the same end of the same cable in all rows, and of the
        same kind.

    Attributes
    ----------
    direction : ndarray, shape (n, c, 2, 3)
        Unit tangents at both ends, which point out of the cables. [-]
    movements : ndarray, shape (n, 6 c, i)
        H: displacements of the six ends of all cables per movement of each winch. [-]
    lifted : ndarray, shape (n, 6 c, i)
        Forces on the ends of all cables, against the uniform load, per movement of each winch: by the load (weight)
        that it takes off. [N/m]
    moments : ndarray, shape (n, 6 b, i)
        Loads on the b bodies and points per movement of each winch: moments d x F of the force F of the cable on the
        body, where a winch moves its end in a direction d. [N]
    """

    def __init__(self, layouts, winches):
        equilibria, spans = zip(*((at.equilibrium, at.equilibrium.catenary.span) for at in layouts), strict=True)
        suspension = equilibria[0].suspension
        forces = np.stack([equilibrium.end_forces[suspension.of_cables] for equilibrium in equilibria])
        self.direction, tension = tangents(forces)
        count, cables, *_ = forces.shape
        movements, lifted = np.zeros((2, count, cables, 2, 3, len(winches[0])))
        moments = np.zeros((count, len(suspension.body_names), 6, len(winches[0])))
        for column, of_rows in enumerate(zip(*winches, strict=True)):
            cable, end = of_rows[0].cable, of_rows[0].end
            if of_rows[0].direction is None:
                stretch = 1 + tension[:, cable, end] / np.array([span.axial_stiffness[cable] for span in spans])
                movements[:, cable, end, :, column] = stretch[:, None] * self.direction[:, cable, end]
                load = np.array([span.mass[cable] * span.gravity[cable] for span in spans])
                vertical = np.array([np.broadcast_to(span.vertical, (cables, 3))[cable] for span in spans])
                lifted[:, cable, end, :, column] = load[:, None] * vertical
                continue
            movements[:, cable, end, :, column] = along = np.array([winch.direction for winch in of_rows])
            body = suspension.owner[cable, end]
            if body != GROUND:
                moments[:, body, 3:, column] = np.cross(along, forces[:, cable, end])
        of_ends, of_bodies = (count, 6 * cables, len(winches[0])), (count, 6 * moments.shape[1], len(winches[0]))
        self.movements, self.lifted = movements.reshape(of_ends), lifted.reshape(of_ends)
        self.moments = moments.reshape(of_bodies)


def reeling(equilibrium, winches):
    """H: displacements of the six ends of all cables per movement of each winch, shape (6 c, i). [-]"""
    return _Ends([Layout(equilibrium)], [winches]).movements[0]


def winch_loads(layout, winches):
    """Loads on bodies and points per movement of each winch, with bodies and cables at rest, shape (d, i).

    They are by the load that a winch takes off its own end, and by the arm of the cable: where a
    winch on a body moves the end by v d, the force F of the cable has the additional moment v d x F about the body. One
    that reels moves the end along F, without a moment. [N/m, N]
    """
    ends = _Ends([layout], [winches])
    return layout.connection.T @ ends.lifted[0] + ends.moments[0][layout.free]


def suspension_system(layout, kept, winches=(), markers=(), midspans=()):
    """Assemble the `LinearSystem` of a suspension.

    Its inputs are movements of winches, and loads on bodies and points. Its outputs are displacements, forces of links
    and tensions of cables. Its coordinates are the modal amplitudes of all cables, then the free displacements of
    bodies and points.

    Parameters
    ----------
    layout : Layout
        Bodies and cables about the equilibrium.
    kept : list of ReducedCable
        Modes and residual vectors of each cable that are coordinates.
    winches : sequence of Winch
        Winches that reel in cables, or move their ends.
    markers : sequence of Marker
        Places on bodies whose displacements are outputs.
    midspans : sequence of ndarray, shape (3, k)
        For each cable, displacement at mid-span per unit of its k coordinates, modes and then six ends, along the axes
        of its chord frame (`wind.strips.midspan_shapes`). Default: mid-spans are no outputs.

    Returns
    -------
    LinearSystem
        Inputs: `winch.CABLE`, the length reeled in or the displacement of the end [m]; then, for each free displacement
        of a body, its load, one of `BODY.force_x` to `BODY.moment_z` at the reference point [N], [N m].

        Outputs: the free displacements of bodies, `BODY.MARKER.x` and so on, `CABLE.midspan.x` and so on [m], [rad];
        `LINK.force`, `CABLE.tension_from`, `CABLE.tension_to` [N]. In a state space displacements need no derivatives
        of inputs; tensions at ends that winches move do.

    Raises
    ------
    NoSolutionError
        There are too many coordinates.
    """
    check_size(layout, kept)
    return suspension_systems([layout], [kept], [winches], [markers], [midspans]).take(0)


def check_size(layout, kept):
    """Refuse a system with too many coordinates, arguments as of `suspension_system`: NoSolutionError."""
    coordinates = len(layout.free) + sum(len(cable.element.omega) for cable in kept)
    if coordinates > CONTROL.state_space_coordinates:
        raise NoSolutionError(
            f"the linear model has {coordinates} coordinates, and a state space is made of at most "
            f"{CONTROL.state_space_coordinates}"
        )


def signature(layout, kept, winches, markers, midspans):
    """Names and numbers that rows of `suspension_systems` have in common, arguments as of one of them: tuple."""
    suspension = layout.equilibrium.suspension
    of_cables = *((cable.modes, len(cable.element.omega)) for cable in kept), bool(midspans)
    hysteretic = any(cable.element.strain is not None and cable.element.strain.law == "hysteretic" for cable in kept)
    of_winches = *((winch.cable, winch.end, winch.direction is None) for winch in winches), hysteretic
    of_markers = tuple((marker.name, marker.body) for marker in markers)
    names = suspension.cable_names, suspension.body_names, suspension.link_names
    alone = id(layout) if layout.large else None  # a large one is assembled by itself
    return of_cables, of_winches, of_markers, names, layout.free.tobytes(), suspension.owner.tobytes(), alone


def suspension_systems(layouts, kept, winches, markers, midspans):
    """Assemble the `LinearSystem` of n suspensions ("rows") from winches and forces to displacements and tensions.

    Parameters
    ----------
    layouts : list of Layout
        Bodies and cables of each row about the equilibrium. Rows must have equal `signature`.
    kept : list of (list of ReducedCable)
        For each row, the modes and residual vectors of each cable that are coordinates.
    winches : list of (sequence of Winch)
    markers : list of (sequence of Marker)
        For each row, places on bodies whose displacements are outputs.
    midspans : list of (sequence of ndarray, shape (3, k))
        For each row, the displacement at mid-span of each cable by its k coordinates, modes and then six ends; an empty
        sequence for no such outputs.

    Returns
    -------
    LinearSystem
        Of n rows, with dense matrices; coordinates, inputs and outputs are those of `suspension_system`.

    Notes
    -----
    A winch moves the end of its cable, which gives the input matrices B0, B1 and B2 of its displacement, speed and
    acceleration. It also changes the loads on the bodies at once, by the weight that it takes off the cable
    (`_Ends.lifted`) and by the lever arm of the cable's force (`_Ends.moments`), which is added to B0. Loads on bodies
    and points follow the winches among the inputs.
    """
    layout, winch_count = layouts[0], len(winches[0])
    ends = _Ends(layouts, winches)
    matrices = [[cable.element.matrices() for cable in of_row] for of_row in kept]
    matrices = [tuple(map(np.stack, zip(*of_rows, strict=True))) for of_rows in zip(*matrices, strict=True)]
    if layout.large:  # of one row, and sparse
        system = layout.system([cable.element for cable in kept[0]], ends.movements[0])
        system = system.with_arrays(lambda matrix: dense(matrix)[None])
    else:
        connection = np.stack([at.connection for at in layouts])
        stiffness, mass = (np.stack(of_rows) for of_rows in zip(*(at.body_matrices for at in layouts), strict=True))
        system = assemble_dense(matrices, connection, mass, ends.movements, stiffness)
        if layout.equilibrium.links is not None:
            system = system.with_damped_bodies(np.stack([at.damping for at in layouts]))
    connection = np.stack([dense(at.connection) for at in layouts])
    modal, free = len(system) - system.bodies, system.bodies
    static, *by_rates = system.b
    static = static.copy()
    static[:, modal:] += np.swapaxes(connection, -1, -2) @ ends.lifted + ends.moments[:, layout.free]
    c, d = _outputs(layouts, matrices, connection, ends, markers, midspans)
    input_names, output_names = labels(layout, winches[0], markers[0], bool(midspans[0]))
    names = _coordinates(layout, kept[0]), input_names[:winch_count], output_names
    b = static, *(matrix.real for matrix in by_rates)
    driven_by_winches = LinearSystem(system.mass, system.damping, system.stiffness, b, free, c, d, *names)
    forces = np.broadcast_to(np.eye(free + modal)[:, modal:], (len(layouts), free + modal, free))
    return driven_by_winches.with_forces(forces, input_names[winch_count:])


def _of_bodies(layout, words, units):
    """Name and unit of each free displacement, or of its load, from six `words` and six `units`."""
    names = layout.equilibrium.suspension.body_names
    return tuple((f"{names[row // 6]}.{words[row % 6]}", units[row % 6]) for row in layout.free.tolist())


def labels(layout, winches=(), markers=(), midspans=False):
    """Name and unit of each input and each output of `suspension_system`, mid-spans among them or not: two tuples."""
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


def _outputs(layouts, matrices, connection, ends, markers, midspans):
    """Output matrices of n suspensions: y = C0 z + C1 z' + C2 z'' + D0 v + D1 v' + D2 v''.

    z are the N coordinates (modal amplitudes of all cables, then the d free displacements of bodies) and v the lengths
    that i winches reel in. The o outputs y are displacements of bodies, of markers and at mid-spans, then forces of
    links, then tensions at both ends of each cable.

    Parameters
    ----------
    layouts : list of Layout
        Bodies and cables of each suspension.
    matrices : list of tuple of 3 ndarray, shape (n, m + 6, m + 6)
        For each of the c cables M, C and K, for its m modes and then its six end displacements.
    connection : ndarray, shape (n, 6 c, d)
        G: displacements of the ends of all cables per free displacement.
    ends : _Ends
        Displacements of the ends by the winches.
    markers : list of (sequence of Marker)
        For each suspension, places on bodies whose displacements are outputs.
    midspans : list of (sequence of ndarray, shape (3, m + 6))
        For each suspension, displacement at mid-span of each cable by its modes and ends; empty for no such outputs.

    Returns
    -------
    c, d : tuple of 3 ndarray, shapes (n, o, N) and (n, o, i)
        C0, C1, C2 and D0, D1, D2. C0 and D0 are complex where damping is hysteretic.
    """
    suspension, movements = layouts[0].equilibrium.suspension, ends.movements
    modal = sum(stiffness.shape[-1] - 6 for *_, stiffness in matrices)

    def without_winches(c):
        """Matrices C of outputs on which the winches do not act at once, and D of zeros."""
        return c, np.zeros((*c.shape[:2], movements.shape[-1]))

    # each part has C and D of order 0, 1 and 2: displacements do not depend on velocities and accelerations
    displacements = [without_winches(np.pad(_displacements(layouts, markers), ((0, 0), (0, 0), (modal, 0))))]
    if midspans[0]:
        of_cables = list(map(np.stack, zip(*midspans, strict=True)))
        displacements.append(_of_cables(of_cables, connection, movements, modal))
    parts = [[(c * (order == 0), d * (order == 0)) for order in range(3)] for c, d in displacements]
    if suspension.link_names:
        stretch = np.stack([np.pad(at.elongation, ((0, 0), (modal, 0))) for at in layouts])
        suspensions = [at.equilibrium.suspension for at in layouts]
        stiffness, damping = (np.stack([np.broadcast_to(getattr(one, name), stretch.shape[1]) for one in suspensions])
                              for name in ("link_stiffness", "link_damping"))  # fmt: skip
        factors = stiffness, damping, np.zeros_like(damping)
        parts.append([without_winches(factor[..., None] * stretch) for factor in factors])
    parts.append(_tensions(matrices, connection, ends, modal))
    by_order = [zip(*of_order, strict=True) for of_order in zip(*parts, strict=True)]
    joined = [[np.concatenate(matrices, axis=1) for matrices in of_order] for of_order in by_order]
    return tuple(zip(*joined, strict=True))


def _displacements(layouts, markers):
    """Displacements by the free displacements of n rows: themselves, then those of markers; shape (n, p, d)."""
    count, free = len(layouts), layouts[0].free
    of_all_bodies = np.eye(6 * len(layouts[0].equilibrium.suspension.body_names))[:, free]
    displacements = [np.broadcast_to(np.eye(len(free)), (count, len(free), len(free)))]
    for of_rows in zip(*markers, strict=True):
        body = of_rows[0].body
        rotation = np.stack([at.equilibrium.rotation[body] for at in layouts])
        arm = (rotation @ np.array([marker.place for marker in of_rows], dtype=float)[..., None])[..., 0]
        unit = np.broadcast_to(np.eye(3), (count, 3, 3))
        of_marker = np.concatenate([unit, -cross_matrix(arm)], axis=-1)
        displacements.append(of_marker @ of_all_bodies[6 * body : 6 * body + 6])
    return np.concatenate(displacements, axis=1)


def _of_cables(of_each, connection, movements, modal):
    """Outputs of single cables by all N coordinates and by the winches, shapes (n, c r, N) and (n, c r, i).

    Of each of the c cables `of_each` has r outputs, shape (n, r, m + 6), per unit of its m modes and of its six end
    displacements u = G x + H v, with G of `connection` and H of `movements`; `modal` is the number of all modes.
    """
    count, _, free = connection.shape
    outputs, dtype, first_mode = of_each[0].shape[1] if of_each else 0, np.result_type(float, *of_each), 0
    c = np.zeros((count, len(of_each), outputs, modal + free), dtype)
    d = np.zeros((count, len(of_each), outputs, movements.shape[-1]), dtype)
    for cable, rows in enumerate(of_each):
        modes, ends = rows.shape[-1] - 6, slice(6 * cable, 6 * cable + 6)
        c[:, cable, :, first_mode : first_mode + modes] = rows[..., :modes]
        c[:, cable, :, modal:] = rows[..., modes:] @ connection[:, ends]
        d[:, cable] = rows[..., modes:] @ movements[:, ends]
        first_mode += modes
    return tuple(matrix.reshape(count, len(of_each) * outputs, matrix.shape[-1]) for matrix in (c, d))


def _tensions(matrices, connection, ends, modal):
    """Output matrices of the tensions at both ends of all c cables of n suspensions.

    A tension is the component, along the outward unit tangent t, of the force on an end of the cable. With the modes q
    of a cable, its end displacements u = G x + H v and its matrices A = K, C, M for j = 0, 1, 2, the j-th derivatives
    of q, x and v add t^T (A_uq q + A_uu u). The load that a winch takes off its own end is subtracted from D_0.

    Parameters
    ----------
    matrices : list of tuple of 3 ndarray, shape (n, m + 6, m + 6)
        For each cable M, C and K, for its m modes and then its six end displacements.
    connection : ndarray, shape (n, 6 c, d)
        G: displacements of the ends of all cables per free displacement x of the bodies.
    ends : _Ends
        Tangents, and H: displacements of the ends per length v reeled in.
    modal : int
        Number of modal amplitudes of all cables.

    Returns
    -------
    list of 3 (ndarray, ndarray), shapes (n, 2 c, N) and (n, 2 c, i)
        C_j and D_j, by which the j-th derivatives of the N coordinates (modal amplitudes, then x) and of v are
        multiplied.
    """
    along = np.zeros((*ends.direction.shape[:-1], 6))  # from forces on both ends of each cable to tensions
    along[..., 0, :3], along[..., 1, 3:] = ends.direction[..., 0, :], ends.direction[..., 1, :]
    found = []
    for matrix in (2, 1, 0):  # stiffness, damping, mass
        forces = [along[:, cable] @ of_cable[matrix][:, -6:] for cable, of_cable in enumerate(matrices)]
        found.append(_of_cables(forces, connection, ends.movements, modal))
    static = found[0][1]
    static -= (along @ ends.lifted.reshape(*along.shape[:2], 6, static.shape[-1])).reshape(static.shape)
    return found
