"""A cable in a wind that changes along it, cut into pieces: no closed form, no elements, no mean along the cable.

With the tension vector N = T t and the load f(r, t, stretch) per unstretched length, r' = (1 + T/EA) t and N' = -f.
Each piece is one step of the classical Runge-Kutta method with the load where it is; N at end 1 is found by scipy so
that the last piece ends where the cable does.
"""

import math

import numpy as np
from scipy.optimize import root


def drag(width, pressure, direction, weight, stretched=True):
    """Load of weight and drag: a function of place, tangent and stretch.

    Parameters
    ----------
    width : float
        Drag coefficient times diameter. [m]
    pressure : callable
        Place -> dynamic pressure there. [Pa]
    direction : float
        Where the wind blows to, from x towards y. [rad]
    weight : float
        Per unstretched length. [N/m]
    stretched : bool
        Whether the wind meets the stretched length, or the unstretched one.
    """
    blows, down = np.array([np.cos(direction), np.sin(direction), 0.0]), np.array([0.0, 0.0, weight])

    def load(place, tangent, stretch):
        across = blows - tangent * (tangent @ blows)
        met = width * pressure(place) * (stretch if stretched else 1.0)
        return met * math.sqrt(across @ across) * across - down

    return load


def solve(end_1, end_2, stiffness, length, load, start, pieces=400, point_loads=None):
    """Places and tension vectors at the ends of the pieces, shape (pieces + 1, 3) each. [m], [N]

    Parameters
    ----------
    start : ndarray, shape (3,)
        Tension vector at end 1 with which the search begins. [N]
    point_loads : dict, optional
        Number of pieces before it -> force, shape (3,); the tension vector there is that beyond it. [N]
    """

    def rates(place, force):
        tension = math.sqrt(force @ force)
        stretch, tangent = 1 + tension / stiffness, force / tension
        rate = np.empty((2, 3))
        rate[0], rate[1] = stretch * tangent, -load(place, tangent, stretch)
        return rate

    def along(force):
        step, found = length / pieces, [np.array([end_1, force])]
        for _ in range(pieces):
            now = found[-1]
            one = rates(*now)
            two = rates(*(now + step / 2 * one))
            three = rates(*(now + step / 2 * two))
            now = now + step / 6 * (one + 2 * two + 2 * three + rates(*(now + step * three)))
            found.append(now - [np.zeros(3), (point_loads or {}).get(len(found), np.zeros(3))])
        return np.array(found)

    scale = np.linalg.norm(start)
    found = root(lambda force: along(force * scale)[-1, 0] - end_2, np.asarray(start) / scale, tol=1e-11)
    assert np.abs(found.fun).max() < 1e-7 * length
    whole = along(found.x * scale)
    return whole[:, 0], whole[:, 1]
