"""A suspension in modes and static responses as coordinates z, with actuators on its bodies, moved by winches and wind.

    M z'' + C z' + K z = f + B0 v + B1 v' + B2 v'' + sum over actuators of p (g_v s + g_p) h(s) r.z

f are the forces on the coordinates and v the lengths that winches reel in. Each actuator measures the movement r.z of
its body (`measured`); its force or torque is (g_v s + g_p) h(s) r.z with gains g_v and g_p and a high-pass filter
h = s/(s + w_h), or h = 1; p (`acts`) is the force on each coordinate per force or torque.

A reaction mass m_a adds its stroke q along an axis a to the coordinates. The mass of the body includes it, so that q
adds m_a q' a.d' + m_a q'^2/2 to the kinetic energy, d being the displacement of its place. Of its weight remains the
moment m_a g q (a x e_z). Its force, from r.z = a.d, acts between body and mass: on q alone. A wheel of inertia J turns
freely about its axis, so the body has J less about it; its torque on the body is -g_v times the angular velocity about
it.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.system.damping import ritz
from cablestudy.system.linear import LinearSystem
from cablestudy.system.rigid import cross_matrix


@dataclass(frozen=True)
class Actuator:
    """A reaction mass, or a reaction wheel.

    Attributes
    ----------
    name : str
    wheel : bool
    body : int
    place : ndarray, shape (3,)
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
    place: np.ndarray
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
    measured : ndarray, shape (m,)
        Movement of the body along or about the axis per coordinate. [m], [rad]
    acts : ndarray, shape (m,)
        Force on each coordinate per force or torque of the actuator.
    velocity_gain, position_gain, corner : float
        As in `Actuator`.
    """

    measured: np.ndarray
    acts: np.ndarray
    velocity_gain: float
    position_gain: float
    corner: float

    def gain(self, s):
        """Force or torque per movement, (g_v s + g_p) h(s)."""
        return (self.velocity_gain * s + self.position_gain) * (s / (s + self.corner) if self.corner else 1.0)


def basis(system, modes, loads):
    """Reduction basis of a suspension: its lowest modes, and Ritz vectors that make the static response to loads exact.

    Parameters
    ----------
    system : LinearSystem
        The suspension in all n coordinates, see `control.suspension.second_order`.
    modes : CoupledModes
        Its undamped modes.
    loads : ndarray, shape (n, r)
        Forces on the coordinates.

    Returns
    -------
    omega : ndarray, shape (m,)
        Frequencies of the modes, then of the Ritz vectors, ascending. [rad/s]
    shapes : ndarray, shape (n, m)
        Their shapes, mass-normalised.
    """
    added_omega, added = ritz(system, modes.shapes, system.compliance(loads))
    order = np.argsort(added_omega)
    omega = np.concatenate([modes.solution.omega, added_omega[order]])
    return omega, np.concatenate([modes.shapes, added[:, order]], axis=1)


def motion(layout, whole: LinearSystem, omega, shapes, winches, actuators=(), damping=0.0):
    """Reduce a suspension to the amplitudes of m shapes and add its actuators: `LinearSystem`.

    Its coordinates are the m amplitudes, then the strokes of reaction masses; its inputs the lengths v that winches
    reel in.

    Parameters
    ----------
    layout : Layout
    whole : LinearSystem
        The suspension in all n coordinates, see `control.suspension.second_order`.
    omega, shapes : ndarray, shapes (m,) and (n, m)
        Reduction basis, see `basis`.
    winches : int
        How many of the inputs of `whole`, the first ones, are winches.
    actuators : sequence of Actuator
    damping : ndarray, shape (m, m), or 0
        Damping of the amplitudes in addition to that of `whole`.
    """
    strokes, count = sum(not actuator.wheel for actuator in actuators), len(omega)
    stiffness = np.diag(omega**2).astype(whole.stiffness.dtype)  # the shapes are orthogonal for mass and stiffness
    if np.iscomplexobj(stiffness):  # hysteretic damping
        stiffness.imag[:] = shapes.T @ whole.stiffness.imag @ shapes
    matrices = np.eye(count), shapes.T @ whole.damping @ shapes + damping, stiffness
    *matrices, feedback = actuated(layout, shapes, *matrices, actuators)

    return LinearSystem(
        *matrices,
        tuple(with_strokes((shapes.T @ matrix[:, :winches]).T, strokes).T for matrix in whole.b),
        c=tuple(with_strokes(matrix @ shapes, strokes) for matrix in whole.c),
        d=tuple(matrix[:, :winches] for matrix in whole.d),
        scale=np.concatenate([omega, [actuator.omega for actuator in actuators if not actuator.wheel]]),
        feedback=feedback,
        shapes=shapes,
    )


def with_strokes(matrix, strokes):
    """A matrix by coordinates, shape (..., m), with columns of zeros for so many strokes, shape (..., m + strokes)."""
    if not strokes:
        return matrix
    return np.concatenate([matrix, np.zeros((*matrix.shape[:-1], strokes))], axis=-1)


def actuated(layout, shapes, mass, damping, stiffness, actuators):
    """Add actuators to the matrices of a suspension: strokes of reaction masses become further coordinates.

    Parameters
    ----------
    layout : Layout
    shapes : ndarray, shape (n, m)
        The m coordinates of the matrices in terms of the n of the suspension, whose last ones are the free
        displacements of bodies.
    mass, damping, stiffness : ndarray, shape (m, m)
        Without actuators.
    actuators : sequence of Actuator

    Returns
    -------
    mass, damping, stiffness : ndarray, shape (m + j, m + j)
        With the strokes of j reaction masses as the last coordinates, and without the inertia of wheels about their
        axes.
    feedback : tuple of ActuatorFeedback
        The controlled force or torque of each actuator.
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
        # kinetic energy m_a q' a.d' + m_a q'^2/2, and moment m_a g q (a x e_z) of the weight beside a spring
        for matrix, row, diagonal in ((mass, along, 1.0), (stiffness, weight, actuator.omega**2)):
            matrix[stroke] += inertia * row
            matrix[:, stroke] += inertia * row
            matrix[stroke, stroke] = inertia * diagonal
        damping[stroke, stroke] = 2 * inertia * actuator.damping_ratio * actuator.omega
        force = np.eye(count + strokes)[stroke]
        feedback.append(ActuatorFeedback(along, force, velocity_gain, actuator.position_gain, corner))
        stroke += 1
    return mass, damping, stiffness, tuple(feedback)


def _movements(layout, actuator, shapes):
    """Movement of a body at an actuator along its axis, about it, and g (theta x a)_z, by coordinates; each (m,)."""
    equilibrium = layout.equilibrium
    rotation = equilibrium.rotation[actuator.body]
    movement = layout.displaced(layout.bodies(shapes))[actuator.body]
    axis, arm = rotation @ actuator.axis, rotation @ actuator.place
    along = axis @ (movement[:3] - cross_matrix(arm) @ movement[3:])
    upwards = np.array([0.0, 0.0, float(equilibrium.suspension.gravity)])
    return along, axis @ movement[3:], np.cross(axis, upwards) @ movement[3:]
