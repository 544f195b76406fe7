"""Modes of one plane or of coupled planes: kind, symmetry, participation, a definite basis of coincident modes."""

import itertools
from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import OUT_OF_PLANE, System, flatten_components
from cablestudy.cable.element import basis, lagrange
from cablestudy.cable.tolerances import CABLE

KINDS = ("out-of-plane", "in-plane", "axial")
SYMMETRIES = ("symmetric", "antisymmetric", "mixed")
OUT, IN, AXIAL = range(3)  # indices of KINDS
SYMMETRIC, ANTISYMMETRIC, MIXED = range(3)  # indices of SYMMETRIES
SHARES = {9: 0.12, 0: 0.3}  # least order -> error over the energy of the two highest orders, by tests/test_extremes.py


class PlaneModes:
    """Modes of one system, of one cable or of a batch, in ascending frequency; the modes are the last axis throughout.

    Parameters
    ----------
    system : System
    inner : ndarray, shape (..., dof, k)
        Shapes of the inner nodes, orthonormal by the mass of a cable of unit mass.
    sign : int
        1 if all shapes are symmetric about mid-length, -1 if antisymmetric, 0 otherwise.
    """

    def __init__(self, system, inner, sign=0):
        *lead, _, count = inner.shape
        nodes, axes = system.state.mesh.nodes, len(system.axes)
        shapes = np.zeros((*lead, nodes, axes, count))
        shapes[..., 1:-1, :, :] = inner.reshape(*lead, nodes - 2, axes, count)
        elastic, geometric = system.modal_energies(shapes)
        square = elastic + geometric
        if not ascends(square):
            order = np.argsort(square, axis=-1, kind="stable")
            elastic, geometric, square, shapes = (
                reordered(values, order) for values in (elastic, geometric, square, shapes)
            )
        self.system, self.square, self.shapes, self._sign = system, square, shapes, sign
        coinciding = clusters(square)
        for cluster in coinciding:
            self._make_definite(*cluster)
        self._energies = system.modal_energies(self.shapes) if coinciding else (elastic, geometric)

    @cached_property
    def kinds(self):
        """Kind of each mode, an index of KINDS, shape (..., k)."""
        if self.system.axes == OUT_OF_PLANE or not self.square.size:
            return np.full(self.square.shape, OUT)
        (along, out), (elastic, geometric) = _kinetic_shares(self.system, self.shapes), self._energies
        return np.where(out > 0.5, OUT, np.where((along > 0.5) & (elastic > geometric), AXIAL, IN))

    def _make_definite(self, cable, begin, end):
        """Replace shapes of coincident modes, from index `begin` to `end`, by those of `_definite_basis`."""
        system, cluster = System(self.system.state.take(cable), self.system.axes), (*cable, ..., slice(begin, end))
        shapes = self.shapes[cluster]
        shapes = shapes @ _definite_basis(system, shapes)
        ascending = np.argsort(sum(system.modal_energies(shapes)), kind="stable")
        self.shapes[cluster] = shapes[..., ascending]

    @cached_property
    def errors(self):
        """Estimated relative discretisation error of the frequencies, shape (..., k). [-]

        A share of the energy in the two highest polynomials of the elements, and at least rounding; compared with
        random scenes by tests/test_extremes.py.
        """
        system, shapes = self.system, self.shapes
        tensions = system.tension_vectors(self.square[..., None, None, :] * system.inertia(shapes), shapes)
        share = unresolved_share(system.state.mesh.order)
        unresolved = share * system.highest_energy(shapes, tensions) / (2 * self.square)
        over_lowest = self.square / self.square[..., :1]
        rounding = CABLE.lowest_frequency * np.sqrt(over_lowest)
        if system.state.mesh.point_masses:  # their mode may lie far below all others, and hide these
            rounding = np.maximum(rounding, (CABLE.lowest_frequency * over_lowest) ** 2)
        return np.maximum(unresolved, rounding)

    @cached_property
    def signed(self):
        """Shapes, their first component above half of the largest one positive, shape (..., nodes, d, k)."""
        flat = flatten_components(self.shapes)
        first_large = np.argmax(np.abs(flat) > 0.5 * np.abs(flat).max(axis=-2, keepdims=True), axis=-2)
        sign = np.sign(np.take_along_axis(flat, first_large[..., None, :], axis=-2))
        return self.shapes * sign[..., None, :]

    @cached_property
    def symmetries(self):
        """Symmetry of each mode, an index of SYMMETRIES, shape (..., k)."""
        overlap = self._sign or _overlap(self.system, self.shapes, _mirror(self.system, self.shapes))
        if self.system.state.mesh.point_masses:  # the form of the cable, whatever it carries and where
            overlap = overlap / _overlap(self.system, self.shapes, self.shapes)
        # of an axial mode the motion along the cable counts, which reflection reverses
        overlap = overlap * np.where(self.kinds == AXIAL, -1, 1)
        antisymmetric = overlap < -CABLE.symmetric_overlap
        return np.where(overlap > CABLE.symmetric_overlap, SYMMETRIC, np.where(antisymmetric, ANTISYMMETRIC, MIXED))

    @cached_property
    def participation(self):
        """-omega^2 psi^T M u_j, u_j the static shape of a unit displacement of end 2 along axis j, shape (..., d, k).

        Craig & Bampton (1968), AIAA Journal 6(7), fixed-interface modes.
        """
        inertia = flatten_components(self.system.inertia(self.system.end_shapes))
        return -self.square[..., None, :] * (inertia.swapaxes(-1, -2) @ flatten_components(self.signed))


def unresolved_share(order):
    """Estimated error of a motion's energy over that in the two highest polynomials of elements of an order. [-]"""
    return next(share for least_order, share in SHARES.items() if order >= least_order)


def ascends(values):
    """True if no value is below the one before."""
    return bool((values[..., 1:] >= values[..., :-1]).all())


def reordered(values, order):
    """Values, shape (..., components, k) or (..., k), with the k modes of each cable in an order, shape (..., k)."""
    between = (1,) * (values.ndim - order.ndim)
    return np.take_along_axis(values, order.reshape(*order.shape[:-1], *between, order.shape[-1]), axis=-1)


def coincident(square):
    """True for each of ascending eigenvalues, shape (..., k), that coincides with the one before."""
    follows = np.diff(square, axis=-1) <= 2 * CABLE.coincident_modes * square[..., 1:]
    return np.concatenate([np.zeros_like(square[..., :1], dtype=bool), follows], axis=-1)


def clusters(square):
    """(cable, begin, end) of each run of coincident ones among ascending eigenvalues; cable is an index tuple."""
    coincides, runs = coincident(square), []
    for cable in {tuple(index[:-1]) for index in np.argwhere(coincides).tolist()}:
        runs += [(cable, *run) for run in runs_of(coincides[cable][1:])]
    return runs


def runs_of(with_next):
    """(begin, end) of each run of two or more of n numbers: list; `with_next` says which go with the next, (n - 1,)."""
    edges = [0, *(np.flatnonzero(~with_next) + 1).tolist(), len(with_next) + 1]
    return [(begin, end) for begin, end in itertools.pairwise(edges) if end - begin > 1]


def _definite_basis(system, shapes):
    """Orthogonal matrix that separates coincident modes by symmetry and by motion along the cable and out of plane."""
    mass = system.state.mesh.node_masses[:, None]
    along = _motion_along_cable(system, shapes)
    out = shapes[:, -1] if 2 in system.axes else 0 * shapes[:, 0]
    along_product, out_product = along.T @ (mass * along), out.T @ (mass * out)
    mirror_product = flatten_components(system.bare_inertia(shapes)).T @ flatten_components(_mirror(system, shapes))
    # weights of powers of four: the eigenvalues of the three differ, and so are separated
    return np.linalg.eigh(mirror_product + mirror_product.T + 4 * along_product + 16 * out_product)[1]


def nodal_tangent(state):
    """Unit tangent at each node, shape (..., nodes, 3): that of its element, the mean of two where elements meet."""
    mesh, element = state.mesh, basis(state.mesh.order)
    by_element = lagrange(element.points, element.nodes) @ state.direction
    tangent = np.zeros((*by_element.shape[:-3], mesh.nodes, 3))
    tangent[..., :-1, :] = by_element[..., :-1, :].reshape(*by_element.shape[:-3], -1, 3)
    tangent[..., mesh.order :: mesh.order, :] += by_element[..., -1, :]
    return tangent / np.sqrt((tangent**2).sum(axis=-1, keepdims=True))


def _motion_along_cable(system, shapes):
    """Motion along the cable, shape (..., nodes, k)."""
    if system.axes == OUT_OF_PLANE:
        return 0 * shapes[..., 0, :]
    return (nodal_tangent(system.state)[..., None, system.axes] @ shapes)[..., 0, :]


def _kinetic_shares(system, shapes):
    """Share of the kinetic energy along the cable and out of its plane, each of shape (..., k)."""
    mass = system.state.mesh.node_masses
    by_component = (mass[:, None, None] * shapes**2).sum(axis=-3)
    total = by_component.sum(axis=-2)
    out = by_component[..., 2, :] if 2 in system.axes else 0.0 * total
    return (mass @ _motion_along_cable(system, shapes) ** 2) / total, out / total


def _overlap(system, shapes, others):
    """psi^T M phi of each shape psi with one of others phi, by the distributed mass M, shape (..., k)."""
    return flatten_components(shapes * system.bare_inertia(others)).sum(axis=-2)


def _mirror(system, shapes):
    """Shapes reflected at mid-length, across the chord."""
    position = system.state.mesh.node_positions
    if np.abs(position + position[::-1] - 1).max() < 1e-9:  # a mirror image except for rounding
        mirrored = shapes[..., ::-1, :, :].copy()
    else:  # point loads make the mesh unsymmetric
        from scipy.interpolate import make_interp_spline

        mirrored = make_interp_spline(position, shapes, k=min(3, len(position) - 1), axis=-3)(1 - position)
    if 0 in system.axes:
        mirrored[..., 0, :] *= -1
    return mirrored
