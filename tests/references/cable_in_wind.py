"""A cable in a wind that changes along it, cut into pieces: no closed form, no elements, no mean along the cable.

With the tension vector N = T t and the load f(r, t, stretch) per unstretched length, r' = (1 + T/EA) t and N' = -f.
Each piece is one step of the classical Runge-Kutta method with the load where it is; N at end 1 is found by Newton's
method so that the last piece ends where the cable does: four cables at once, for the derivatives.
"""

import numpy as np
from scipy.interpolate import BarycentricInterpolator

STEPS = 40


def drag(width, pressure, direction, weight, stretched=True):
    """Load of weight and drag: a function of place and tangent, shape (..., b, 3), and stretch, shape (..., b, 1).

    Parameters
    ----------
    width : float or ndarray, shape (...)
        Drag coefficient times diameter. [m]
    pressure : callable
        Places, shape (..., b, 3) [m] -> dynamic pressure there, a number or of shape (..., b). [Pa]
    direction : float
        Where the wind blows to, from x towards y. [rad]
    weight : float or ndarray, shape (...)
        Per unstretched length. [N/m]
    stretched : bool
        Whether the wind meets the stretched length, or the unstretched one.
    """
    blows, down = np.array([np.cos(direction), np.sin(direction), 0.0]), np.multiply.outer(weight, [[0.0, 0.0, 1.0]])
    width = np.asarray(width)[..., None, None]

    def load(place, tangent, stretch):
        across = blows - tangent * (tangent @ blows)[..., None]
        met = width * np.asarray(pressure(place))[..., None] * (stretch if stretched else 1.0)
        return met * np.sqrt(np.vecdot(across, across))[..., None] * across - down

    return load


def solve(end_1, end_2, stiffness, length, load, start, pieces=400, point_loads=None):
    """Places and tension vectors at the ends of the pieces of some cables, shape (pieces + 1, ..., 3) each. [m], [N]

    Parameters
    ----------
    end_1, end_2 : ndarray, shape (..., 3)
    stiffness, length : float or ndarray, shape (...)
    start : ndarray, shape (..., 3)
        Tension vectors at end 1 with which the search begins. [N]
    point_loads : dict, optional
        Number of pieces before it -> force, shape (..., 3); the tension vector there is that beyond it. [N]
    """
    size, step = np.asarray(length), np.asarray(length)[..., None, None] / pieces
    stiffness, point_loads = np.asarray(stiffness)[..., None, None], point_loads or {}

    def rates(now):
        place, force = now
        tension = np.sqrt(np.vecdot(force, force))[..., None]
        stretch, tangent = 1 + tension / stiffness, force / tension
        return np.array([stretch * tangent, -load(place, tangent, stretch)])

    def along(forces):
        """Places and tension vectors of cables that begin with some of these, shape (pieces + 1, 2, ..., b, 3)."""
        found = [np.array([np.broadcast_to(end_1[..., None, :], forces.shape), forces])]
        for piece in range(1, pieces + 1):
            now = found[-1]
            one = rates(now)
            two = rates(now + step / 2 * one)
            three = rates(now + step / 2 * two)
            now = now + step / 6 * (one + 2 * two + 2 * three + rates(now + step * three))
            if piece in point_loads:
                now[1] -= point_loads[piece][..., None, :]
            found.append(now)
        return np.array(found)

    force, back = np.array(start, dtype=float), np.zeros(3)
    small, least = 1e-6 * np.linalg.norm(force, axis=-1)[..., None, None], np.inf
    for _ in range(STEPS):
        whole = along(force[..., None, :] + small * np.eye(4, 3, -1))
        gap = whole[-1, 0] - end_2[..., None, :]
        if (np.abs(gap[..., 0, :]).max(axis=-1) < 1e-12 * size).all():
            return whole[:, 0, ..., 0, :], whole[:, 1, ..., 0, :]
        left = np.linalg.norm(gap[..., 0, :], axis=-1)
        too_far = ((left > least) & (least > 1e-6 * size))[..., None]  # of a slack cable a whole step may lead there
        least = np.where(too_far[..., 0], least, left)
        rate = (gap[..., 1:, :] - gap[..., :1, :]).swapaxes(-1, -2) / small
        back = np.where(too_far, back / 2, np.linalg.solve(rate, gap[..., 0, :, None])[..., 0])
        force = force + np.where(too_far, back, -back)
    raise AssertionError(gap)


def statics(place, force, loaded=()):
    """Columns of a cable from places and tension vectors at the ends of its pieces, as `solve` gives them: dict.

    `loaded` are the numbers of pieces before its point loads, where it bends, and for `load_sag`.
    """
    end, moved = place[-1] - place[0], place - place[0]
    run = np.hypot(end[0], end[1])
    along, across = moved[:, :2] @ end[:2] / run, moved[:, :2] @ [-end[1], end[0]] / run
    below = along * end[2] / run - moved[:, 2]
    after = np.searchsorted(along, run / 2)  # mid-span by the four ends of pieces about it, between two point loads
    edges = np.array([0, *sorted(loaded), len(place) - 1])
    first, last = edges[edges < after].max(), edges[edges >= after].min()
    about = np.s_[(begin := int(np.clip(after - 2, first, last - 3))) : begin + 4]
    sag, aside = BarycentricInterpolator(along[about], np.transpose([below, across])[about])(run / 2)
    found = {"sag": sag, "swing": np.degrees(np.arctan2(abs(aside), abs(sag))), "lowest_point": place[:, 2].min()}
    for number, on_cable in ((1, -force[0]), (2, force[-1])):
        level = np.hypot(*on_cable[:2])
        found[f"reaction_{number}_horizontal"], found[f"reaction_{number}_vertical"] = level, on_cable[2]
        found[f"angle_{number}"] = np.degrees(np.arctan2(on_cable[2], level))
        found[f"tension_{number}"] = np.linalg.norm(on_cable)
    return found | ({"load_sag": below[list(loaded)].max()} if loaded else {})


def chain_stiffness(force, stiffness, length):
    """Stiffness of a chain of equal bars with tension vectors at its nodes, shape (3 n + 3, 3 n + 3). [N/m]"""
    count = len(force) - 1
    matrix = np.zeros((3 * count + 3, 3 * count + 3))
    for bar, on_bar in enumerate((force[1:] + force[:-1]) / 2):
        place = np.s_[3 * bar : 3 * bar + 6]
        matrix[place, place] += np.kron([[1, -1], [-1, 1]], bar_stiffness(on_bar, stiffness, length / count))
    return matrix


def bar_stiffness(force, stiffness, length, loss=0.0):
    """Stiffness of a bar with a tension vector, an unstretched length and a loss factor of its strain, (3, 3). [N/m]"""
    tension = np.linalg.norm(force)
    along = np.outer(force, force) / tension**2
    across = tension / (length * (1 + tension / stiffness))
    return (1 + 1j * loss if loss else 1.0) * stiffness / length * along + across * (np.eye(3) - along)
