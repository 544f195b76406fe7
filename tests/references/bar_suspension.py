"""Dense matrices of a whole suspension: each cable as equal bars (`bars`), rigid bodies added by hand.

Displacements: the inner nodes of one cable after the other, then x y z rx ry rz of each body at its reference point.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from . import bars, links
from .dense import cross

TURNS = 12  # in which drag and form settle: the change falls by ten in each


@dataclass(frozen=True)
class Dense:
    """K, M, the elastic part of K, and C of the links, of the displacements above.

    Attributes
    ----------
    K, M, elastic, by_links : ndarray, shape (n, n)
        Of the free displacements.
    cables : list of tuple
        Of each cable K, M and the elastic part of K of its nodes, shape (3 (n + 1), 3 (n + 1)).
    maps : list of ndarray, shape (3 (n + 1), n)
        Displacements of these nodes.
    chains : list of Chain
    """

    K: np.ndarray
    M: np.ndarray
    elastic: np.ndarray
    by_links: np.ndarray
    cables: list
    maps: list
    chains: list

    def modes(self):
        """Frequencies and mass-normalised shapes. [Hz]"""
        value, vector = scipy.linalg.eigh(self.K, self.M)
        return np.sqrt(value) / (2 * np.pi), vector

    def damping(self, law, per_length):
        """C of the nodes of each cable, a list, and C of the whole, shape (n, n); `law` as of `cable_damping`."""
        own = [
            cable_damping(law, *matrices, float(mass)) for matrices, mass in zip(self.cables, per_length, strict=True)
        ]
        return own, self.by_links + sum(turn.T @ part @ turn for turn, part in zip(self.maps, own, strict=True))


def cable_damping(damping, k, mass, elastic, per_length):
    """C of the nodes of one cable, which weighs `per_length` [kg/m]: modal, Kelvin-Voigt and viscous per length."""
    found = damping.get("time", 0.0) * elastic + damping.get("viscous", 0.0) / per_length * mass
    inner = slice(3, -3)
    if ratio := damping.get("ratio", 0.0):  # of each mode between fixed ends, on absolute motion
        square, shapes = scipy.linalg.eigh(k[inner, inner], mass[inner, inner])
        weighted = mass[inner, inner] @ shapes
        found[inner, inner] += weighted * (2 * ratio * np.sqrt(square)) @ weighted.T
    return found


def body_matrices(equilibrium, body):
    """Mass, and stiffness by end forces of the continuous cables and by dead loads, of one body; shape (6, 6) each.

    That of dead moments is not symmetric, and nothing else is.
    """
    model = equilibrium.suspension
    places, forces = model.ends(equilibrium.position, equilibrium.rotation), equilibrium.catenary.end_forces("global")
    R, m = equilibrium.rotation[body], float(model.mass[body])
    r = R @ model.center[body]
    mass = np.block(
        [[m * np.eye(3), -m * cross(r)], [m * cross(r), R @ model.inertia[body] @ R.T - m * cross(r) @ cross(r)]]
    )
    turning = -cross([0, 0, -m * float(model.gravity)]) @ cross(r)
    for cable, end in np.argwhere(model.owner[: len(model.cable_names)] == body):
        turning -= cross(forces[cable, end]) @ cross(places[cable, end] - equilibrium.position[body])
    if model.eccentric_loads is not None:
        eccentric = R @ model.eccentric_loads[body]  # sum of r F^T
        turning += np.trace(eccentric) * np.eye(3) - eccentric
    return mass, np.pad((turning + turning.T) / 2 - cross(model.moment[body]) / 2, (3, 0))


def dense(equilibrium, n, blown=None):
    """The suspension in its equilibrium with n bars for each cable.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of cables with mass; the bodies' geometric stiffness takes the end forces of the continuous cables.
    n : int
    blown : callable, optional
        Cable and vector of one of its bars [m] -> drag on this bar [N], which the cable hangs in; by default the
        uniform load of the equilibrium.
    """
    model, span = equilibrium.suspension, equilibrium.catenary.span
    cables, bodies = len(model.cable_names), len(model.body_names)
    inner = 3 * (n - 1)
    size = cables * inner + 6 * bodies
    K, M, elastic, by_links = np.zeros((4, size, size))
    found, maps, chains = [], [], []
    places = model.ends(equilibrium.position, equilibrium.rotation)
    for cable in range(cables):
        L, EA, m = (float(a[cable]) for a in (span.unstretched_length, span.axial_stiffness, span.mass))
        wind = model.cable_wind[cable] * L / n if model.cable_wind is not None else np.zeros(3)
        pushed = [(node, wind) for node in range(1, n)] if wind.any() else ()
        vector, weight = places[cable, 1] - places[cable, 0], m * float(model.gravity)
        chain = bars.solve_spatial(vector, L, EA, weight, n, pushed)
        for _ in range(TURNS if blown else 0):
            drag = np.array([blown(cable, bar) for bar in chain.vectors]) / 2
            pushed = [(node, drag[node - 1] + drag[node]) for node in range(1, n)]
            chain = bars.solve_spatial(vector, L, EA, weight, n, pushed)
        k, mass = bars.matrices(chain, L, EA, m)
        turn = np.zeros((3 * n + 3, size))
        turn[3:-3, cable * inner : (cable + 1) * inner] = np.eye(inner)
        for end, rows in ((0, slice(0, 3)), (1, slice(-3, None))):
            body = model.owner[cable, end]
            if body >= 0:
                columns = slice(cables * inner + 6 * body, cables * inner + 6 * body + 6)
                arm = places[cable, end] - equilibrium.position[body]
                turn[rows, columns] = np.concatenate([np.eye(3), -cross(arm)], axis=1)
        K += turn.T @ k @ turn
        M += turn.T @ (mass[:, None] * turn)
        stretched = bars.elastic_matrix(chain, L, EA)
        elastic += turn.T @ stretched @ turn
        found.append((k, np.diag(mass), stretched))
        maps.append(turn)
        chains.append(chain)
    for body in range(bodies):
        place = slice(cables * inner + 6 * body, cables * inner + 6 * body + 6)
        for whole, own in zip((M, K), body_matrices(equilibrium, body), strict=True):
            whole[place, place] += own
    if model.link_names:
        own = slice(cables * inner, None)
        spring, by_links[own, own] = links.matrices(equilibrium)
        K[own, own] += spring
    free = np.concatenate([np.ones(cables * inner, dtype=bool), model.free.ravel()])
    parts = (matrix[np.ix_(free, free)] for matrix in (K, M, elastic, by_links))
    return Dense(*parts, found, [turn[:, free] for turn in maps], chains)
