"""Modes of one plane or of coupled planes: kind, symmetry, participation, a definite basis of coincident modes."""

import itertools
from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import OUT_OF_PLANE, System, flatten_components
from cablestudy.cable.element import basis, lagrange
from cablestudy.cable.tolerances import CABLE

KINDS = ("out-of-plane", "in-plane", "axial")
SYMMETRIES = ("symmetric", "antisymmetric", "mixed")
OUT, IN, AXIAL = range(3)  # places in KINDS
SYMMETRIC, ANTISYMMETRIC, MIXED = range(3)  # places in SYMMETRIES
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
                reordered(part, order) for part in (elastic, geometric, square, shapes)
            )
        self.system, self.square, self.shapes, self._sign = system, square, shapes, sign
        coinciding = clusters(square)
        for cluster in coinciding:
            self._make_definite(*cluster)
        self._energies = system.modal_energies(self.shapes) if coinciding else (elastic, geometric)

    @cached_property
    def kinds(self):
        """Places in KINDS, shape (..., k)."""
        if self.system.axes == OUT_OF_PLANE or not self.square.size:
            return np.full(self.square.shape, OUT)
        (along, out), (elastic, geometric) = _kinetic_shares(self.system, self.shapes), self._energies
        return np.where(out > 0.5, OUT, np.where((along > 0.5) & (elastic > geometric), AXIAL, IN))

    def _make_definite(self, cable, first, last):
        """Choose shapes of coincident modes; their frequencies stay."""
        one, chosen = System(self.system.state.take(cable), self.system.axes), (*cable, ..., slice(first, last))
        some = self.shapes[chosen]
        some = some @ _definite_basis(one, some)
        ascending = np.argsort(sum(one.modal_energies(some)), kind="stable")
        self.shapes[chosen] = some[..., ascending]

    @cached_property
    def errors(self):
        """Estimated relative discretisation error of the frequencies, shape (..., k). [-]

        A share of the energy in the two highest polynomials of the elements, and at least rounding; compared with
        random scenes by tests/test_extremes.py.
        """
        share = unresolved_share(self.system.state.mesh.order)
        left = share * self.system.highest_energy(self.shapes) / (2 * self.square)
        apart = self.square / self.square[..., :1]
        rounding = CABLE.lowest_frequency * np.sqrt(apart)
        if self.system.state.mesh.point_masses:  # which may lie far below all others, and hide them
            rounding = np.maximum(rounding, (CABLE.lowest_frequency * apart) ** 2)
        return np.maximum(left, rounding)

    @cached_property
    def signed(self):
        """The shapes with their first large component positive, shape (..., nodes, d, k)."""
        flat = flatten_components(self.shapes)
        first = np.argmax(np.abs(flat) > 0.5 * np.abs(flat).max(axis=-2, keepdims=True), axis=-2)
        sign = np.sign(np.take_along_axis(flat, first[..., None, :], axis=-2))
        return self.shapes * sign[..., None, :]

    @cached_property
    def symmetries(self):
        """Places in SYMMETRIES, shape (..., k)."""
        # of an axial mode the motion along the cable counts, which reflection reverses
        even = self._sign or _overlap(self.system, self.shapes, _mirror(self.system, self.shapes))
        if self.system.state.mesh.point_masses:  # the form of the cable, whatever it carries and where
            even = even / _overlap(self.system, self.shapes, self.shapes)
        even = even * np.where(self.kinds == AXIAL, -1, 1)
        return np.where(
            even > CABLE.symmetric_overlap, SYMMETRIC, np.where(even < -CABLE.symmetric_overlap, ANTISYMMETRIC, MIXED)
        )

    @cached_property
    def participation(self):
        """-omega^2 psi^T M u_j, u_j the static shape of a unit displacement of end 2 along axis j, shape (..., d, k).

        Craig & Bampton (1968), AIAA Journal 6(7), fixed-interface modes.
        """
        inertia = flatten_components(self.system.inertia(self.system.end_shapes))
        return -self.square[..., None, :] * (inertia.swapaxes(-1, -2) @ flatten_components(self.signed))


def unresolved_share(order):
    """Error of twice the energy of a motion, over that in the two highest polynomials of elements of an order. [-]"""
    return next(share for least, share in SHARES.items() if order >= least)


def ascends(values):
    """True if no value is below the one before."""
    return bool((values[..., 1:] >= values[..., :-1]).all())


def reordered(values, order):
    """Values in another order along the last axis, which is one of shape (..., k) for each cable."""
    between = (1,) * (values.ndim - order.ndim)
    return np.take_along_axis(values, order.reshape(*order.shape[:-1], *between, order.shape[-1]), axis=-1)


def clusters(square):
    """(cable, first, last) of each run of coincident eigenvalues; cable is an index tuple."""
    near = np.diff(square, axis=-1) <= 2 * CABLE.coincident_modes * square[..., 1:]
    found = []
    for cable in {tuple(where[:-1]) for where in np.argwhere(near).tolist()}:
        breaks = np.flatnonzero(~near[cable]) + 1
        edges = np.concatenate([[0], breaks, [square.shape[-1]]]).tolist()
        found += [(cable, a, b) for a, b in itertools.pairwise(edges) if b - a > 1]
    return found


def _definite_basis(system, shapes):
    """Orthogonal matrix that separates coincident modes by symmetry and by motion along the cable and out of plane."""
    along = _along(system, shapes)
    out = shapes[:, -1] if 2 in system.axes else 0 * shapes[:, 0]
    mirror = flatten_components(system.bare_inertia(shapes)).T @ flatten_components(_mirror(system, shapes))
    nodal = system.state.mesh.node_masses[:, None]
    slide, leave = (part.T @ (nodal * part) for part in (along, out))
    return np.linalg.eigh(mirror + mirror.T + 4 * slide + 16 * leave)[1]


def nodal_tangent(state):
    """Unit tangent at each node, shape (..., nodes, 3): of its element, the mean of both where two meet."""
    mesh, element = state.mesh, basis(state.mesh.order)
    parts = lagrange(element.points, element.nodes) @ state.direction
    tangent = np.zeros((*parts.shape[:-3], mesh.nodes, 3))
    tangent[..., :-1, :] = parts[..., :-1, :].reshape(*parts.shape[:-3], -1, 3)
    tangent[..., mesh.order :: mesh.order, :] += parts[..., -1, :]
    return tangent / np.sqrt((tangent**2).sum(axis=-1, keepdims=True))


def _along(system, shapes):
    """Motion along the cable, shape (..., nodes, k)."""
    if system.axes == OUT_OF_PLANE:
        return 0 * shapes[..., 0, :]
    return (nodal_tangent(system.state)[..., None, system.axes] @ shapes)[..., 0, :]


def _kinetic_shares(system, shapes):
    """Share of the kinetic energy along the cable and out of its plane, each of shape (..., k)."""
    nodal = system.state.mesh.node_masses
    squares = (nodal[:, None, None] * shapes**2).sum(axis=-3)
    total = squares.sum(axis=-2)
    out = squares[..., 2, :] if 2 in system.axes else 0.0 * total
    return (nodal @ _along(system, shapes) ** 2) / total, out / total


def _overlap(system, shapes, others):
    """Products of shapes with others by the distributed mass, shape (..., k)."""
    return flatten_components(shapes * system.bare_inertia(others)).sum(axis=-2)


def _mirror(system, shapes):
    """Shapes reflected at mid-length, across the chord."""
    position = system.state.mesh.node_positions
    if np.abs(position + position[::-1] - 1).max() < 1e-9:
        mirrored = shapes[..., ::-1, :, :].copy()
    else:  # point loads make the mesh unsymmetric
        from scipy.interpolate import make_interp_spline

        mirrored = make_interp_spline(position, shapes, k=min(3, len(position) - 1), axis=-3)(1 - position)
    if 0 in system.axes:
        mirrored[..., 0, :] *= -1
    return mirrored
