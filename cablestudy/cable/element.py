"""A cable element of any order: nodes, quadrature and mass on [0, 1].

Positions are interpolated at Gauss-Lobatto points, and strain is taken at `order` Gauss points: order 1 is a straight
bar of constant strain, and no order locks. Lumped mass is Lobatto quadrature.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.polynomial import legendre

MASSES = ("lumped", "consistent", "blended")


@dataclass(frozen=True)
class Basis:
    """Reference element; q = order Gauss points, p + 1 = order + 1 nodes, all on [0, 1]."""

    nodes: np.ndarray  # shape (p + 1,)
    points: np.ndarray  # Gauss points, at which the strain is sampled, shape (q,)
    weights: np.ndarray  # Gauss weights, shape (q,)
    derivative: np.ndarray  # of the nodal functions at the Gauss points, shape (q, p + 1)
    shares: np.ndarray  # integral of each nodal function, the nodal loads of a uniform load, shape (p + 1,)


def _lobatto(order):
    """Gauss-Lobatto nodes, the ends and the zeros of P_p', and weights on [-1, 1]; by Newton's method."""
    x = -np.cos(np.pi * np.arange(order + 1) / order)
    p, p_below = np.eye(order + 1)[order], np.eye(order + 1)[order - 1]  # coefficients of P_p and P_(p-1)
    for _ in range(50):
        value = legendre.legval(x, p)
        step = (x * value - legendre.legval(x, p_below)) / ((order + 1) * value)
        x = x - step
        if np.abs(step).max() < 1e-15:  # rounding of numbers up to 1
            break
    x = (x - x[::-1]) / 2
    x[0], x[-1] = -1.0, 1.0
    return x, 2 / (order * (order + 1) * legendre.legval(x, p) ** 2)


@lru_cache(maxsize=128)
def basis(order):
    """The reference element of an order from 1 to 64: `Basis`."""
    x, lobatto_weights = _lobatto(order)
    points, weights = legendre.leggauss(order)
    slopes = np.stack([legendre.legval(points, legendre.legder(p)) for p in np.eye(order + 1)])  # of P_0 to P_p
    derivative = 2 * np.linalg.solve(legendre.legvander(x, order).T, slopes).T
    derivative -= derivative.mean(axis=1, keepdims=True)  # no strain by translation, to the last digit
    return Basis((x + 1) / 2, (points + 1) / 2, weights / 2, derivative, lobatto_weights / 2)


@lru_cache(maxsize=128)
def highest_projection(order):
    """Projection of values at the Gauss points of an element on its two highest polynomials, shape (q, q). [-]"""
    element = basis(order)
    values = legendre.legvander(2 * element.points - 1, order - 1)[:, -2:]
    inverse_norms = 2 * np.arange(order)[-2:] + 1  # on [0, 1]
    return (values * inverse_norms) @ (values.T * element.weights)


def lagrange(nodes, x):
    """Lagrange polynomials of nodes, shape (k,), at positions x, shape (...): barycentric form, shape (..., k). [-]"""
    differences = nodes[:, None] - nodes[None, :] + np.eye(len(nodes))
    weights = 1 / differences.prod(axis=1)
    distance = x[..., None] - nodes
    is_node = distance == 0
    terms = weights / np.where(is_node, 1.0, distance)
    on_node = is_node.any(axis=-1, keepdims=True)
    return np.where(on_node, is_node, terms / np.where(on_node, 1.0, terms.sum(axis=-1, keepdims=True)))


@lru_cache(maxsize=128)
def mass_matrix(order, mass):
    """Mass of a reference element of unit mass, shape (order + 1, order + 1). [-]

    Parameters
    ----------
    mass : {"lumped", "consistent", "blended"}
        Lobatto quadrature (diagonal), exact integration, or the mean of both (order 1: fourth-order frequencies).
    """
    element = basis(order)
    lumped = np.diag(element.shares)
    if mass == "lumped":
        return lumped
    points, weights = legendre.leggauss(order + 1)
    nodal = legendre.legvander(2 * element.nodes - 1, order)
    values = np.linalg.solve(nodal.T, legendre.legvander(points, order).T).T
    consistent = values.T @ (weights[:, None] / 2 * values)
    return consistent if mass == "consistent" else (lumped + consistent) / 2


@dataclass(frozen=True, eq=False)
class Mesh:
    """Elements along one cable, n of one order; lengths as shares of the unstretched length."""

    edges: np.ndarray  # element boundaries, shape (n + 1,)
    order: int
    mass: str = "lumped"  # one of MASSES
    point_masses: tuple = ()  # carried: pairs (share of the length, mass over that of the cable)

    @cached_property
    def elements(self):
        """Number of elements. [-]"""
        return len(self.edges) - 1

    @cached_property
    def nodes(self):
        """Number of nodes. [-]"""
        return self.elements * self.order + 1

    @cached_property
    def mirror_symmetric(self):
        """True if the mesh is its own mirror image at mid-length, and carries nothing."""
        return not self.point_masses and bool(np.abs(self.edges + self.edges[::-1] - 1).max() < 1e-15)

    @cached_property
    def element_nodes(self):
        """Index of the nodes of each element, shape (n, order + 1)."""
        return np.arange(self.elements)[:, None] * self.order + np.arange(self.order + 1)

    @cached_property
    def sizes(self):
        """Length of each element, shape (n,). [-]"""
        return np.diff(self.edges)

    def located(self, positions):
        """Element of each position, at an edge the one before it, and the position in it on [0, 1]; both (...)."""
        element = np.clip(np.searchsorted(self.edges, positions, side="left") - 1, 0, self.elements - 1)
        return element, (positions - self.edges[element]) / self.sizes[element]

    @cached_property
    def node_positions(self):
        """Arc length of each node over the unstretched length, shape (nodes,). [-]"""
        inner = self.edges[:-1, None] + self.sizes[:, None] * basis(self.order).nodes[:-1]
        return np.append(inner.ravel(), 1.0)

    @cached_property
    def node_weights(self):
        """Share of the unstretched length that is lumped at each node, shape (nodes,). [-]"""
        weights = np.zeros(self.nodes)
        np.add.at(weights, self.element_nodes, self.sizes[:, None] * basis(self.order).shares)
        return weights

    @cached_property
    def bare(self):
        """Copy of the mesh without point masses."""
        return replace(self, point_masses=()) if self.point_masses else self

    @cached_property
    def carried(self):
        """Point masses at each node over the mass of the cable, shape (nodes,). [-]"""
        masses = np.zeros(self.nodes)
        for share, mass in self.point_masses:
            masses[self.order * np.argmin(np.abs(self.edges - share))] += mass
        return masses

    @cached_property
    def node_masses(self):
        """Lumped mass of each node over the mass of the cable, with that of the point masses, shape (nodes,). [-]"""
        return self.node_weights + self.carried

    @cached_property
    def point_weights(self):
        """Share of the unstretched length of each Gauss point, shape (n, q). [-]"""
        return self.sizes[:, None] * basis(self.order).weights

    @cached_property
    def point_positions(self):
        """Arc length of each Gauss point over the unstretched length, shape (n, q). [-]"""
        return self.edges[:-1, None] + self.sizes[:, None] * basis(self.order).points
