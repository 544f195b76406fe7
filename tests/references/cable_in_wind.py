"""A cable in a wind that changes along it, cut into pieces: no closed form, no elements, no mean along the cable.

With the tension vector N = T t and the load f(r, t, stretch) per unstretched length, r' = (1 + T/EA) t and N' = -f.
Each piece is one step of the classical Runge-Kutta method with the load where it is; N at end 1 is found by Newton's
method so that the last piece ends where the cable does: four cables at once, for the derivatives.
"""

import numpy as np

STEPS = 40


def drag(width, pressure, direction, weight, stretched=True):
    """Load of weight and drag: a function of place and tangent, shape (3, b), and stretch, shape (b,).

    Parameters
    ----------
    width : float
        Drag coefficient times diameter. [m]
    pressure : callable
        Places, shape (3, b) [m] -> dynamic pressure there. [Pa]
    direction : float
        Where the wind blows to, from x towards y. [rad]
    weight : float
        Per unstretched length. [N/m]
    stretched : bool
        Whether the wind meets the stretched length, or the unstretched one.
    """
    blows, down = np.array([np.cos(direction), np.sin(direction), 0.0]), np.array([0.0, 0.0, weight])

    def load(place, tangent, stretch):
        across = blows[:, None] - tangent * (blows @ tangent)
        met = width * pressure(place) * (stretch if stretched else 1.0)
        return met * np.sqrt((across * across).sum(axis=0)) * across - down[:, None]

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

    def rates(now):
        place, force = now
        tension = np.sqrt((force * force).sum(axis=0))
        stretch, tangent = 1 + tension / stiffness, force / tension
        return np.array([stretch * tangent, -load(place, tangent, stretch)])

    def along(forces):
        """Places and tension vectors of the cables that begin with some of these, shape (pieces + 1, 2, 3, b)."""
        step, found = length / pieces, [np.array([np.repeat(end_1[:, None], forces.shape[1], axis=1), forces])]
        for _ in range(pieces):
            now = found[-1]
            one = rates(now)
            two = rates(now + step / 2 * one)
            three = rates(now + step / 2 * two)
            now = now + step / 6 * (one + 2 * two + 2 * three + rates(now + step * three))
            if len(found) in (point_loads or {}):
                now[1] -= point_loads[len(found)][:, None]
            found.append(now)
        return np.array(found)

    force, small = np.array(start, dtype=float), 1e-6 * np.linalg.norm(start)
    least, step = np.inf, np.zeros(3)
    for _ in range(STEPS):
        whole = along(force[:, None] + small * np.eye(3, 4, 1))
        gap = whole[-1, 0] - end_2[:, None]
        left = np.linalg.norm(gap[:, 0])
        if np.abs(gap[:, 0]).max() < 1e-12 * length:
            return whole[:, 0, :, 0], whole[:, 1, :, 0]
        if left > least and least > 1e-6 * length:  # of a slack cable a whole step may lead too far
            step = step / 2
            force = force + step
            continue
        least = left
        step = np.linalg.solve((gap[:, 1:] - gap[:, :1]) / small, gap[:, 0])
        force = force - step
    raise AssertionError(gap)


def statics(place, force, loaded=()):
    """Columns of a cable from places and tension vectors at the ends of its pieces, as `solve` gives them: dict.

    `loaded` are the numbers of pieces before its point loads, for `load_sag`.
    """
    end, moved = place[-1] - place[0], place - place[0]
    run = np.hypot(end[0], end[1])
    along, across = moved[:, :2] @ end[:2] / run, moved[:, :2] @ [-end[1], end[0]] / run
    below = along * end[2] / run - moved[:, 2]
    sag, aside = (np.interp(run / 2, along, values) for values in (below, across))
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
