"""Drag of a steady wind along a cable: only the part of the wind across it counts.

With the unit vector u of the wind and the tangent t of the cable, u_n = u - t (t . u), the force per unstretched length
is C_d q D (1 + strain) |u_n| u_n with the drag coefficient C_d, the dynamic pressure q and the diameter D. The uniform
load has the chord's direction for t, and no strain. Over the height h above the ground q may grow as (h/h_0)^(2 a),
with the exponent a of the speed; the uniform load then has the mean of q along the cable where it hangs.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.cable.element import basis, lagrange
from cablestudy.cable.geometry import points_along
from cablestudy.cable.records import take_rows, with_arrays
from cablestudy.cable.tolerances import CABLE

ALONG_CHORD = np.array([1.0, 0.0, 0.0])  # chord frame


@dataclass(frozen=True)
class Profile:
    """Power law by which the wind grows with the height above the ground.

    Arrays have an entry for each load case (row), or for each row and cable: the axes `...`.

    Attributes
    ----------
    exponent : ndarray, shape (...)
        Of the speed; zero where the wind is the same at all heights. [-]
    height : ndarray, shape (...)
        Height above the ground at which the pressure is the stated one. [m]
    ground : ndarray of float or object, shape (...)
        Height of level ground; if any ground is not level, tuples (x, z) of arrays: points between which the ground is
        straight. [m]
    """

    exponent: np.ndarray
    height: np.ndarray
    ground: np.ndarray

    @classmethod
    def of(cls, exponent, height, grounds):
        """Wind profile of n load cases, speed ~ (height above ground)^exponent; None if no wind grows with the height.

        Parameters
        ----------
        exponent : ndarray, shape (n,)
            Exponent of each case; NaN where the wind is uniform. [-]
        height : ndarray, shape (n,)
            Height above the ground at which the wind is stated; NaN where the wind is uniform. [m]
        grounds : sequence of (float, tuple or None)
            For each case the height of level ground, or points (x, z) between which the ground is straight, or None for
            the height 0. [m]
        """
        exponent = np.nan_to_num(exponent)
        if not exponent.any():
            return None
        if any(isinstance(ground, tuple) for ground in grounds):
            ground_of_rows = np.empty(len(exponent), dtype=object)
            for row, ground in enumerate(grounds):
                points = ground if isinstance(ground, tuple) else [(0.0, ground or 0.0)]
                ground_of_rows[row] = tuple(np.array(points, dtype=float).T)
        else:
            ground_of_rows = np.array([level or 0.0 for level in grounds])
        return cls(exponent, np.where(exponent > 0, height, 1.0), ground_of_rows)

    def over(self, count):
        """`Profile` with a last axis of `count` cables, which all have that of their row."""
        return with_arrays(self, lambda array: np.broadcast_to(array[..., None], (*array.shape, count)))

    def take(self, rows):
        """`Profile` of some rows."""
        return take_rows(self, rows)

    def of_each(self, count):
        """`Profile` of shape (count,) from one of shape (1,)."""
        return self.take(np.zeros(count, dtype=int))

    def pressure(self, points):
        """Dynamic pressure over the stated one at points, shape (..., k, 3) [m]: none at and below the ground.

        Returns
        -------
        ndarray, shape (..., k)
            Exactly 1 where the wind is uniform. [-]
        """
        of_points = (1,) * (points.ndim - 1 - self.exponent.ndim)  # further axes
        exponent, height, ground = (
            field.reshape(field.shape + of_points) for field in (self.exponent, self.height, self.ground)
        )
        above_ground = points[..., 2] - (self._ground_under(points[..., 0]) if ground.dtype == object else ground)
        return np.where(exponent > 0, (np.maximum(above_ground, 0.0) / height) ** (2 * exponent), 1.0)

    def gradient(self, points):
        """Gradient of `pressure` at points, shape (..., k, 3), by central differences. [1/m]"""
        step = CABLE.pressure_step * np.eye(3)
        changes = [self.pressure(points + along) - self.pressure(points - along) for along in step]
        return np.stack(changes, axis=-1) / (2 * CABLE.pressure_step)

    def mean_pressure(self, cable, end_1):
        """Mean of `pressure` along cables where they hang, by Gauss's rule, shape (...). [-]

        Parameters
        ----------
        cable : Catenary
            Of the shape (...).
        end_1 : ndarray, shape (..., 3)
            Places of their ends 1. [m]
        """
        nodes, weights = np.polynomial.legendre.leggauss(CABLE.drag_points)
        pressure = self.pressure(points_along(cable, (1 + nodes) / 2) + end_1[..., None, :])
        return np.where(self.exponent > 0, np.nan_to_num((pressure * weights).sum(axis=-1) / 2, nan=1.0), 1.0)

    def _ground_under(self, x):
        """Height of the ground at x, shape (..., k); beyond the points of a ground that of the last one. [m]"""
        level = np.empty(x.shape)
        for row in np.ndindex(self.ground.shape):
            level[row] = np.interp(x[row], *self.ground[row])
        return level


@dataclass(frozen=True)
class SteadyDrag:
    """Drag of a steady wind on cables; `...` are their axes.

    Attributes
    ----------
    normal_drag : ndarray, shape (...)
        Drag per length of a cable at right angles to the wind, C_d q D. [N/m]
    direction : ndarray, shape (..., 3)
        Of the wind, global axes. [-]
    profile : Profile or None
        How q changes with the height; None where it does not.
    end_1 : ndarray, shape (..., 3), or None
        Places of their ends 1, with a profile. [m]
    mean : ndarray, shape (...), or None
        Mean pressure over the stated one in their uniform loads, with a profile. [-]
    """

    normal_drag: np.ndarray
    direction: np.ndarray
    profile: Profile | None = None
    end_1: np.ndarray | None = None
    mean: np.ndarray | None = None

    def take(self, index):
        """`SteadyDrag` on several of the cables, or on one."""
        return take_rows(self, index)

    def uniform(self, chord):
        """Uniform force per unstretched length, by directions of the chord, both of shape (..., 3). [N/m]"""
        return self.normal_drag[..., None] * self.times_mean_pressure(across(self.direction, chord))

    def times_mean_pressure(self, values):
        """Values of cables, shape (..., 3), or at points along them, (..., k, 3), times their mean pressures."""
        if self.profile is None:
            return values
        return values * self.mean.reshape(self.mean.shape + (1,) * (np.ndim(values) - self.mean.ndim))

    def times_local_pressure(self, values, points):
        """Values at points along cables, shape (..., k, 3), times the pressures there.

        `points()` returns the points from ends 1, shape (..., k, 3) [m]; it is called only if there is a profile.
        """
        if self.profile is None:
            return values
        end_1 = self.end_1.reshape(self.mean.shape + (1,) * (np.ndim(values) - self.mean.ndim - 1) + (3,))
        return values * self.profile.pressure(points() + end_1)[..., None]


def across(direction, tangent):
    """|u_n| u_n of a unit vector u, with its part u_n across a tangent, shape (..., 3). [-]"""
    normal = direction - tangent * (direction * tangent).sum(axis=-1, keepdims=True)
    return np.sqrt((normal**2).sum(axis=-1, keepdims=True)) * normal


def turning_matrices(tangent, wind_direction):
    """Matrices from the change of r' to that of the mean drag per unstretched length, of a cable that turns.

    With the unit vector u of the wind and its part u_n across the tangent t, the drag |r'| |u_n| u_n changes by

        [|u_n| u_n t^T - (t.u) (u_n u_n^T/|u_n| + |u_n| (I - t t^T)) - |u_n| t u_n^T] times the change of r'.

    Parameters
    ----------
    tangent : ndarray, shape (..., 3)
        Unit vectors t along the cable. [-]
    wind_direction : ndarray, shape (3,)
        u. [-]

    Returns
    -------
    ndarray, shape (..., 3, 3)
        Over rho/2 C_d d v^2, with the speed v. [-]
    """
    along = (tangent @ wind_direction)[..., None]  # t.u
    normal = wind_direction - tangent * along  # u_n
    a = np.sqrt((normal**2).sum(axis=-1, keepdims=True))
    unit = normal / np.where(a > 0, a, 1.0)  # zero where the cable is along the wind
    both = normal[..., :, None] * tangent[..., None, :]  # u_n t^T
    across = np.eye(3) - tangent[..., :, None] * tangent[..., None, :]
    turned = along[..., None] * (unit[..., :, None] * unit[..., None, :] + across)
    return a[..., None] * (both - np.swapaxes(both, -1, -2) - turned)


def uneven_drag(drag):
    """Make the function that computes the uneven part of the drag: that on the curved cable less that on its chord.

    The drag on the chord is part of the uniform load; `equilibrium.solve_many` adds the uneven part. With the unit
    vector u of the wind and its part u_n across a direction, this force per unstretched length is

        C_d q D ((1 + strain) p |u_n| u_n across the tangent t - (mean of p) |u_n| u_n across the chord e)

    C_d q D is the drag at right angles to the wind at the stated pressure q, and p the local pressure over q.

    Parameters
    ----------
    drag : SteadyDrag
        Of the wind on n cables.

    Returns
    -------
    callable or None
        `State` of these n cables -> the force at the q Gauss points of each of e elements, chord frame, shape
        (n, e, q, 3) [N/m]; None where no wind blows on any of them.
    """
    if not drag.normal_drag.any():
        return None

    def at_gauss_points(state):
        """Drag of the tangent with the local pressure, less that of the chord with the mean pressure."""
        wind = (state.span.frame @ drag.direction[..., None])[:, None, None, :, 0]  # unit vector, chord frame
        on_tangent = state.stretch[..., None] * across(wind, state.direction)  # over C_d q D, as the next
        on_tangent = drag.times_local_pressure(on_tangent, lambda: gauss_point_coordinates(state))
        on_chord = drag.times_mean_pressure(across(wind, ALONG_CHORD))
        return drag.normal_drag[:, None, None, None] * (on_tangent - on_chord)

    return at_gauss_points


def gauss_point_coordinates(state):
    """Coordinates of the Gauss points of elements from end 1, global axes, shape (n, e, q, 3). [m]"""
    mesh, span = state.mesh, state.span
    element = basis(mesh.order)
    local = lagrange(element.nodes, element.points) @ state.displacement[:, mesh.element_nodes]
    local[..., 0] += (1 + np.asarray(span.chord_strain))[:, None, None] * mesh.point_positions
    local *= span.unstretched_length[:, None, None, None]
    return span.in_frame(local.reshape(len(local), -1, 3), "global").reshape(local.shape)
