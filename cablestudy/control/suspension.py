"""A suspension as a linear system: winches and forces are its inputs, displacements and tensions its outputs."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.matrices import dense
from cablestudy.cable.records import stack, with_arrays
from cablestudy.control.tolerances import CONTROL
from cablestudy.control.winches import ENDS, EndMovement, WinchedEnds
from cablestudy.errors import NoSolutionError
from cablestudy.statics.rigid import cross_matrix
from cablestudy.statics.suspension import AXES
from cablestudy.system.assemble import assemble_dense
from cablestudy.system.coupled import Layout
from cablestudy.system.linear import MODAL

LOADS = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
LENGTHS, LOAD_UNITS = ("m", "m", "m", "rad", "rad", "rad"), ("N", "N", "N", "N m", "N m", "N m")


@dataclass(frozen=True)
class Marker:
    """A point of a body whose motion is an output."""

    name: str
    body: int
    position: tuple  # of 3 float, from the reference point, body axes [m]


@dataclass(frozen=True)
class SystemParts:
    """Parts of the linear system of one suspension, from which `suspension_systems` assembles it.

    Attributes
    ----------
    layout : Layout
        Bodies and cables about the equilibrium.
    kept : list of ReducedCable
        Modes and residual vectors of each cable that are coordinates.
    winches : sequence of Winch
        Winches that reel in cables, or move their ends; and movements of fixed ends.
    markers : sequence of Marker
        Places on bodies whose displacements are outputs.
    midspans : sequence of ndarray, shape (3, k)
        For each cable, displacement at mid-span per unit of its k coordinates, modes and then six ends, along the axes
        of its chord frame (`wind.strips.midspan_shapes`). Default: mid-spans are no outputs.
    """

    layout: Layout
    kept: list
    winches: list = ()
    markers: list = ()
    midspans: list = ()

    @property
    def size(self):
        """Number of coordinates of the system."""
        return len(self.layout.free) + sum(len(cable.element.omega) for cable in self.kept)

    def check_size(self):
        """Refuse a system with too many coordinates: NoSolutionError."""
        if self.size > CONTROL.state_space_coordinates:
            raise NoSolutionError(
                f"the linear model has {self.size} coordinates, and a state space is made of at most "
                f"{CONTROL.state_space_coordinates}"
            )

    @property
    def signature(self):
        """Names and numbers that suspensions have in common whose systems are assembled together: tuple."""
        suspension = self.layout.equilibrium.suspension
        strains = [cable.element.strain for cable in self.kept]
        return (
            tuple((cable.modes, len(cable.element.omega)) for cable in self.kept),
            any(strain is not None and strain.law == "hysteretic" for strain in strains),
            tuple((winch.cable, winch.end, winch.direction is None) for winch in self.winches),
            tuple((marker.name, marker.body) for marker in self.markers),
            bool(self.midspans),
            (suspension.cable_names, suspension.body_names, suspension.link_names),
            self.layout.free.tobytes(),
            suspension.owner.tobytes(),
            id(self.layout) if self.layout.large else None,  # a large one is assembled by itself
        )


def suspension_system(layout, kept, winches=(), markers=()):
    """Assemble the `LinearSystem` of one suspension, with the arguments of `SystemParts`; see `suspension_systems`.

    Raises
    ------
    NoSolutionError
        There are too many coordinates.
    """
    parts = SystemParts(layout, kept, winches, markers)
    parts.check_size()
    return suspension_systems([parts]).take(0)


def suspension_systems(parts):
    """Assemble the `LinearSystem` of n suspensions ("rows") from winches and forces to displacements and tensions.

    Parameters
    ----------
    parts : list of SystemParts
        Of each row. Rows must have equal `SystemParts.signature`.

    Returns
    -------
    LinearSystem
        Of n rows, with dense matrices. Its coordinates are the modal amplitudes of all cables, then the free
        displacements of bodies and points.

        Inputs: `winch.CABLE`, the length reeled in or the displacement of the end [m]; `CABLE.end_1_x` and so on, the
        displacement of a fixed end [m]; then, for each free displacement of a body, its load, one of `BODY.force_x` to
        `BODY.moment_z` at the reference point [N], [N m].

        Outputs: the free displacements of bodies, `BODY.MARKER.x` and so on, `CABLE.midspan.x` and so on [m], [rad];
        `LINK.force`; `CABLE.force_end_1_x` and so on, which holds a fixed end whose movement is an input;
        `CABLE.tension_from`, `CABLE.tension_to` [N]. In a state space displacements need no derivatives of inputs;
        forces and tensions at ends that are moved do.

    Notes
    -----
    A winch moves the end of its cable, which gives the input matrices B0, B1 and B2 of its displacement, speed and
    acceleration. It also changes the loads on the bodies directly, by the weight that it takes off the cable
    (`WinchedEnds.lifted`) and by the lever arm of the cable's force (`moments`), which is added to B0. Loads on bodies
    and points follow the winches among the inputs. Load stiffness of cables is in the tensions; in K, which is
    symmetric, and in B0 it is not (`Plant.motion` adds it).
    """
    first, layouts = parts[0], [row.layout for row in parts]
    layout = first.layout
    ends = WinchedEnds(layouts, [row.winches for row in parts])
    matrices = stack([[cable.element.matrices() for cable in row.kept] for row in parts])  # M, C and K of each cable
    connection = np.array([dense(at.connection) for at in layouts])  # G, shape (n, 6 c, d)
    system = _with_moved_ends(parts, matrices, connection, ends.movements)
    total, free = len(system), system.bodies
    modal = total - free
    by_length, by_speed, by_acceleration = system.b
    by_length = by_length.copy()
    by_length[:, modal:] += ends.loads(connection, layout.free)
    if any(cable.element.load_stiffness is not None for row in parts for cable in row.kept):
        loads = [_load_stiffness(parts, cable) for cable in range(len(first.kept))]
        matrices = [(*of_cable[:2], of_cable[2] + own) for of_cable, own in zip(matrices, loads, strict=True)]
    c, d = _outputs(parts, matrices, connection, ends)
    input_names, output_names = labels(layout, first.winches, first.markers, bool(first.midspans))
    system = replace(
        system,
        b=(by_length, by_speed.real, by_acceleration.real),
        c=c,
        d=d,
        coordinates=_coordinates(layout, first.kept),
        inputs=input_names[: len(first.winches)],
        outputs=output_names,
    )
    loads_on_bodies = np.broadcast_to(np.eye(total)[:, modal:], (len(parts), total, free))
    return system.with_forces(loads_on_bodies, input_names[len(first.winches) :])


def _load_stiffness(parts, cable):
    """`Superelement.load_stiffness` of one cable of n suspensions, zero where it has none, shape (n, m + 6, m + 6)."""
    elements = [row.kept[cable].element for row in parts]
    none = np.zeros((len(elements[0].omega) + 6,) * 2)
    return np.array([none if one.load_stiffness is None else one.load_stiffness for one in elements])


def _with_moved_ends(parts, matrices, connection, movements):
    """`LinearSystem` of n suspensions, whose inputs are the displacements of cable ends by winches, without outputs.

    Arguments are those of `_outputs`; `movements` is H, shape (n, 6 c, i), see `WinchedEnds`.
    """
    layouts = [row.layout for row in parts]
    if layouts[0].large:  # of one row, and sparse
        system = layouts[0].system([cable.element for cable in parts[0].kept], movements[0])
        return with_arrays(system, lambda matrix: dense(matrix)[None])
    stiffness, mass = stack([at.body_matrices for at in layouts])
    system = assemble_dense(matrices, connection, mass, movements, stiffness)
    if layouts[0].equilibrium.links is None:
        return system
    return system.with_damped_bodies(np.array([at.damping for at in layouts]))


def _of_bodies(layout, words, units):
    """Name and unit of each free displacement, or of its load, from six `words` and six `units`."""
    names = layout.equilibrium.suspension.body_names
    return tuple((f"{names[row // 6]}.{words[row % 6]}", units[row % 6]) for row in layout.free.tolist())


def labels(layout, winches=(), markers=(), midspans=False):
    """Name and unit of each input and each output of `suspension_systems`, mid-spans among them or not: two tuples."""
    suspension = layout.equilibrium.suspension
    cables, bodies = suspension.cable_names, suspension.body_names
    reeled = [(winch.name(cables), "m") for winch in winches]
    inputs = (*reeled, *_of_bodies(layout, LOADS, LOAD_UNITS))
    points = [f"{bodies[marker.body]}.{marker.name}" for marker in markers]
    points += [f"{cable}.midspan" for cable in cables if midspans]
    of_points = [(f"{point}.{axis}", "m") for point in points for axis in "xyz"]
    forces = [f"{link}.force" for link in suspension.link_names]
    forces += [winch.force(cables) for winch in winches if isinstance(winch, EndMovement)]
    forces += [f"{cable}.tension_{end}" for cable in cables for end in ENDS]
    outputs = (*_of_bodies(layout, AXES, LENGTHS), *of_points, *((force, "N") for force in forces))
    return inputs, outputs


def _coordinates(layout, kept):
    """Name and unit of each coordinate."""
    coordinates = []
    for name, cable in zip(layout.equilibrium.suspension.cable_names, kept, strict=True):
        residuals = len(cable.element.omega) - cable.modes
        coordinates += [(f"{name}.mode_{k + 1}", MODAL) for k in range(cable.modes)]
        coordinates += [(f"{name}.residual_{k + 1}", MODAL) for k in range(residuals)]
    return (*coordinates, *_of_bodies(layout, AXES, LENGTHS))


def _outputs(parts, matrices, connection, ends):
    """C0, C1, C2 and D0, D1, D2 of n suspensions, shapes (n, o, N) and (n, o, i), by the derivatives of z and of v.

    z are the N coordinates and v the lengths that i winches reel in. The o outputs are displacements of bodies, of
    markers and at mid-spans, then forces of links and on moved ends, then tensions. C0 and D0 are complex where damping
    is hysteretic. `matrices` are M, C and K of each cable, for its modes and then its six end displacements;
    `connection`, shape (n, 6 c, d), is G: the displacements of the ends of all cables per free displacement.
    """
    layouts, winches = [row.layout for row in parts], ends.movements.shape[-1]
    modal = sum(stiffness.shape[-1] - 6 for *_, stiffness in matrices)

    def by_bodies(matrix):
        """C of outputs by the free displacements of bodies alone, from a matrix of shape (n, p, d); and D of zeros."""
        c = np.pad(matrix, ((0, 0), (0, 0), (modal, 0)))
        return c, np.zeros((*c.shape[:2], winches))

    # of each part of the outputs its C0 and D0, C1 and D1, C2 and D2
    outputs = [_static(*by_bodies(_displacements(layouts, [row.markers for row in parts])))]
    if parts[0].midspans:
        midspans = stack([row.midspans for row in parts])
        outputs.append(_static(*_of_cables(midspans, connection, ends.movements, modal)))
    if layouts[0].equilibrium.suspension.link_names:
        stiffness, damping, elongation = _of_links(layouts)
        factors = stiffness, damping, np.zeros_like(damping)
        outputs.append([by_bodies(factor[..., None] * elongation) for factor in factors])
    moved = [winch for winch in parts[0].winches if isinstance(winch, EndMovement)]
    if moved:
        sides = np.broadcast_to(np.eye(6), (len(parts), len(matrices), 6, 6))
        rows = [6 * one.cable + 3 * one.end + int(np.argmax(one.direction)) for one in moved]
        of_ends = _end_forces(sides, matrices, connection, ends, modal)
        outputs.append([(c[:, rows], d[:, rows]) for c, d in of_ends])
    outputs.append(_tensions(matrices, connection, ends, modal))
    c = tuple(np.concatenate([part[order][0] for part in outputs], axis=1) for order in range(3))
    d = tuple(np.concatenate([part[order][1] for part in outputs], axis=1) for order in range(3))
    return c, d


def _static(c, d):
    """Matrices (C_j, D_j), j = 0, 1, 2, of outputs that do not depend on velocities and accelerations: list."""
    return [(c, d), (0 * c, 0 * d), (0 * c, 0 * d)]


def _of_links(layouts):
    """Stiffness and damping of the l links of n suspensions, shape (n, l), and elongations by bodies, (n, l, d)."""
    pairs = [(at.equilibrium.suspension, at.elongation) for at in layouts]
    return stack([(suspension.link_stiffness, suspension.link_damping, elongation) for suspension, elongation in pairs])


def _displacements(layouts, markers):
    """Displacements by the free displacements of n rows: themselves, then those of markers; shape (n, p, d)."""
    count, free = len(layouts), layouts[0].free
    of_all_bodies = np.eye(6 * len(layouts[0].equilibrium.suspension.body_names))[:, free]
    displacements = [np.broadcast_to(np.eye(len(free)), (count, len(free), len(free)))]
    for of_rows in zip(*markers, strict=True):
        body = of_rows[0].body
        rotation = np.array([at.equilibrium.rotation[body] for at in layouts])
        arm = (rotation @ np.array([marker.position for marker in of_rows], dtype=float)[..., None])[..., 0]
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
    """C_j and D_j, j = 0, 1, 2, of the tensions at both ends of all c cables, shapes (n, 2 c, N) and (n, 2 c, i): list.

    A tension is the component, along the outward unit tangent t, of the force on an end of the cable; arguments are
    those of `_end_forces`.
    """
    along = np.zeros((*ends.direction.shape[:-1], 6))  # from forces on both ends of each cable to tensions
    along[..., 0, :3], along[..., 1, 3:] = ends.direction[..., 0, :], ends.direction[..., 1, :]
    return _end_forces(along, matrices, connection, ends, modal)


def _end_forces(along, matrices, connection, ends, modal):
    """C_j and D_j, j = 0, 1, 2, of components of the forces on the ends of all c cables: list.

    With the modes q of a cable, its end displacements u = G x + H v and its matrices A = K, C, M for j = 0, 1, 2, the
    j-th derivatives of q, x and v add A_uq q + A_uu u to the forces. A winch takes the weight of the length v off its
    own end: this force (`ends.lifted`) is subtracted in D_0. `along`, shape (n, c, r, 6), has r components of each
    cable, by the forces on its two ends; `modal` is the number of modal amplitudes of all cables; other arguments are
    those of `_outputs`.
    """
    found = []
    for matrix in (2, 1, 0):  # stiffness, damping, mass
        forces = [along[:, cable] @ of_cable[matrix][:, -6:] for cable, of_cable in enumerate(matrices)]
        found.append(_of_cables(forces, connection, ends.movements, modal))
    static = found[0][1]
    static -= (along @ ends.lifted.reshape(*along.shape[:2], 6, static.shape[-1])).reshape(static.shape)
    return found
