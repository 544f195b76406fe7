"""A suspension in modes and static responses as coordinates z, with actuators on its bodies, moved by winches and wind.

    M z'' + C z' + K z = f + B0 v + B1 v' + B2 v'' + sum over actuators of p (g_v s + g_p) h(s) r.z

f are the forces on the coordinates and v the lengths that winches reel in. Each actuator measures the movement r.z of
its body (`measured`); its force or torque is (g_v s + g_p) h(s) r.z with gains g_v and g_p and a high-pass filter
h = s/(s + w_h), or h = 1; p (`acts`) is the force on each coordinate per force or torque.

A reaction mass m_a adds its stroke q along an axis a to the coordinates. The mass of the body includes it, so that q
adds m_a q' a.d' + m_a q'^2/2 to the kinetic energy, d being the displacement of its position. Of its weight remains the
moment m_a g q (a x e_z). Its force, from r.z = a.d, acts between body and mass: on q alone. A wheel of inertia J turns
freely about its axis, so the body has J less about it; its torque on the body is -g_v times the angular velocity about
it.
"""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.statics.rigid import cross_matrix
from cablestudy.system.linear import LinearSystem


@dataclass(frozen=True)
class Actuator:
    """A reaction mass, or a reaction wheel.

    Attributes
    ----------
    name : str
    wheel : bool
    body : int
    position : ndarray, shape (3,)
        Of a mass, from the reference point, body axes. [m]
    axis : ndarray, shape (3,)
        Unit vector, body axes. [-]
    inertia : float
        Mass [kg], or moment of inertia about the axis [kg m^2].
    omega, damping_ratio : float
        Of a mass on its spring. [rad/s], [-]
    velocity_gain, position_gain : float
        Force per velocity [N s/m] and displacement [N/m] of the body, or torque per angular velocity [N m s/rad].
    corner : float
        Of the high-pass filter; 0 without one. [rad/s]
    """

    name: str
    wheel: bool
    body: int
    position: np.ndarray
    axis: np.ndarray
    inertia: float
    omega: float = 0.0
    damping_ratio: float = 0.0
    velocity_gain: float = 0.0
    position_gain: float = 0.0
    corner: float = 0.0


@dataclass(frozen=True)
class ActuatorFeedback:
    """Feedback of an actuator from the movement that it measures.

    Attributes
    ----------
    measured : ndarray, shape (..., m)
        Movement of the body along or about the axis per coordinate. [m], [rad]
    acts : ndarray, shape (..., m)
        Force on each coordinate per force or torque of the actuator.
    velocity_gain, position_gain, corner : float or ndarray, shape (...)
        As in `Actuator`.
    """

    measured: np.ndarray
    acts: np.ndarray
    velocity_gain: float
    position_gain: float
    corner: float

    @property
    def filtered(self):
        """True with a high-pass filter, which all rows have or none."""
        return bool(np.any(self.corner))

    def within(self, space):
        """The feedback with new coordinates q, z = S q, with S of shape (..., m, r)."""
        measured, acts = ((row[..., None, :] @ space)[..., 0, :] for row in (self.measured, self.acts))
        return replace(self, measured=measured, acts=acts)

    def gain(self, s):
        """Force or torque per movement, (g_v s + g_p) h(s)."""
        return (self.velocity_gain * s + self.position_gain) * (s / (s + self.corner) if self.filtered else 1.0)


def motion_of_rows(whole: LinearSystem, omega, shapes, winches, damping, load_stiffness=0.0, held=0.0):
    """Reduce n suspensions to m shapes Phi each, without actuators: z = Phi q.

    Parameters
    ----------
    whole : LinearSystem
        The n suspensions ("rows") in all N coordinates z, see `control.suspension.suspension_systems`.
    omega : ndarray, shape (n, m)
        W: angular frequencies of the shapes. [rad/s]
    shapes : ndarray, shape (n, N, m)
        Phi: mass-normalised, orthogonal for mass and stiffness, see `motion.reduction_basis`.
    winches : int
        Number of winches, which are the first inputs of `whole`.
    damping : ndarray, shape (n, m, m), or 0
        Damping of the amplitudes q in addition to that of `whole`.
    load_stiffness : ndarray, shape (n, m, m), or 0
        L: stiffness of these amplitudes by loads that turn with what moves, not symmetric.
    held : ndarray, shape (n, m, winches), or 0
        Forces that hold the amplitudes against these loads per length that each winch reels in.

    Returns
    -------
    LinearSystem
        Of n rows: q'' + (Phi^T C Phi + `damping`) q' + (W^2 + L + i Phi^T Im(K) Phi) q = Phi^T (B0 v + B1 v' + B2
        v''). The inputs v are the lengths that the winches reel in; outputs are those of `whole`.
    """
    count, transposed = omega.shape[-1], np.swapaxes(shapes, -1, -2)
    stiffness = np.zeros((*omega.shape, count), whole.stiffness.dtype)
    index = np.arange(count)
    stiffness[..., index, index] = omega**2  # the shapes are orthogonal for mass and stiffness
    if np.iscomplexobj(stiffness):  # hysteretic damping
        stiffness.imag[:] = transposed @ whole.stiffness.imag @ shapes
    mass = np.zeros(stiffness.shape)
    mass[..., index, index] = 1.0
    return LinearSystem(
        mass,
        transposed @ whole.damping @ shapes + damping,
        stiffness + load_stiffness,
        tuple(transposed @ matrix[..., :winches] - held * (order == 0) for order, matrix in enumerate(whole.b)),
        c=tuple(matrix @ shapes for matrix in whole.c),
        d=tuple(matrix[..., :winches] for matrix in whole.d),
        scale=omega,
        shapes=shapes,
    )


def with_actuators(layout, system, actuators):
    """A `LinearSystem` of `motion_of_rows`, of one row, with actuators: strokes of masses are its last coordinates."""
    if not actuators:
        return system
    strokes = sum(not actuator.wheel for actuator in actuators)
    matrices = system.mass, system.damping, system.stiffness
    mass, damping, stiffness, feedback = actuated(layout, system.shapes, *matrices, actuators)
    own = [actuator.omega for actuator in actuators if not actuator.wheel]
    return replace(
        system,
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        b=tuple(with_strokes(matrix.T, strokes).T for matrix in system.b),
        c=tuple(with_strokes(matrix, strokes) for matrix in system.c),
        scale=np.concatenate([system.scale, own]),
        feedback=feedback,
    )


def with_strokes(matrix, strokes):
    """A matrix by coordinates, shape (..., m), with columns of zeros for `strokes`, shape (..., m + strokes)."""
    if not strokes:
        return matrix
    return np.concatenate([matrix, np.zeros((*matrix.shape[:-1], strokes))], axis=-1)


def actuated(layout, shapes, mass, damping, stiffness, actuators):
    """Add actuators to the matrices of a suspension: strokes of reaction masses become further coordinates.

    A reaction mass m_a with the stroke q along the axis a has the kinetic energy m_a q' a.d' + m_a q'^2/2 in addition
    to that of the body, d being the displacement of its position. Of its weight remains the moment m_a g q (a x e_z). A
    wheel turns freely about its axis: its moment of inertia about it is taken off the mass matrix.

    Parameters
    ----------
    layout : Layout
        Bodies of the suspension.
    shapes : ndarray, shape (n, m)
        Columns: displacements of the n coordinates of the suspension by each of the m coordinates of the matrices. The
        last rows are the free displacements of bodies.
    mass, damping, stiffness : ndarray, shape (m, m)
        Without actuators.
    actuators : sequence of Actuator

    Returns
    -------
    mass, damping, stiffness : ndarray, shape (m + j, m + j)
        With the strokes of j reaction masses as the last coordinates; with their springs and dampers.
    feedback : tuple of ActuatorFeedback
        Controlled force or torque of each actuator, which is not in the matrices.
    """
    if not actuators:
        return mass, damping, stiffness, ()
    count, strokes = len(mass), sum(not actuator.wheel for actuator in actuators)
    mass, damping, stiffness = (np.pad(matrix, (0, strokes)) for matrix in (mass, damping, stiffness))
    feedback, stroke = [], count
    for actuator in actuators:
        movements = _movements(layout, actuator, shapes)
        # by the coordinates: movement of the body along the axis a, about a, and g (theta x a)_z, theta its rotation
        along, about, weight = (np.append(row, np.zeros(strokes)) for row in movements)
        velocity_gain, inertia, corner = actuator.velocity_gain, actuator.inertia, actuator.corner
        if actuator.wheel:
            mass -= inertia * np.outer(about, about)
            feedback.append(ActuatorFeedback(about, -about, velocity_gain, 0.0, corner))
            continue
        _add_stroke(mass, stroke, inertia * along, inertia)  # kinetic energy m_a q' a.d' + m_a q'^2/2
        # moment m_a g q (a x e_z) of the weight, and the spring
        _add_stroke(stiffness, stroke, inertia * weight, inertia * actuator.omega**2)
        damping[stroke, stroke] = 2 * inertia * actuator.damping_ratio * actuator.omega
        force = np.eye(count + strokes)[stroke]
        feedback.append(ActuatorFeedback(along, force, velocity_gain, actuator.position_gain, corner))
        stroke += 1
    return mass, damping, stiffness, tuple(feedback)


def _add_stroke(matrix, stroke, coupling, diagonal):
    """Add a stroke to a symmetric matrix, in place: its entry on the diagonal, and its coupling to each coordinate."""
    matrix[stroke] += coupling
    matrix[:, stroke] += coupling
    matrix[stroke, stroke] = diagonal


def _movements(layout, actuator, shapes):
    """Movement of a body at an actuator along its axis, about it, and g (theta x a)_z, by coordinates; each (m,)."""
    equilibrium = layout.equilibrium
    rotation = equilibrium.rotation[actuator.body]
    movement = layout.displaced(layout.bodies(shapes))[actuator.body]
    axis, arm = rotation @ actuator.axis, rotation @ actuator.position
    along = axis @ (movement[:3] - cross_matrix(arm) @ movement[3:])
    upwards = np.array([0.0, 0.0, float(equilibrium.suspension.gravity)])
    return along, axis @ movement[3:], np.cross(axis, upwards) @ movement[3:]
