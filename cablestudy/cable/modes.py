"""Eigenmodes of a cable with fixed ends: the lowest, all up to a frequency, or all; their kind and symmetry.

Modes come from the compliance K^-1 M, so that the lowest are the most accurate; each frequency is then the Rayleigh
quotient of its shape, with energies summed as squares. In-plane and out-of-plane motion are solved apart where they
decouple.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE, State, System
from cablestudy.errors import ConvergenceError, NoSolutionError

DENSE_LIMIT = 150  # degrees of freedom up to which a full eigen-solution is cheaper than Lanczos
ALL_LIMIT = 3000  # degrees of freedom up to which all modes are given
PURE = 0.8  # overlap with the mirrored shape from which a mode counts as symmetric: nine tenths of its energy
COINCIDENT = 1e-12  # relative distance of frequencies below which the solver's choice of shapes is arbitrary
KINDS = ("out-of-plane", "in-plane", "axial")
SYMMETRIES = ("symmetric", "antisymmetric", "mixed")
OUT, IN, AXIAL = range(3)  # places in KINDS
SYMMETRIC, ANTISYMMETRIC, MIXED = range(3)  # places in SYMMETRIES
PLANAR = (IN_PLANE, OUT_OF_PLANE)
FIRST = 16  # modes that are asked for at first
ALL_AT_ONCE = 200  # degrees of freedom up to which all modes cost little more than some


@dataclass(frozen=True)
class Modes:
    """Modes in ascending frequency.

    Attributes
    ----------
    frequency : ndarray, shape (k,)
        [Hz]
    shapes : ndarray, shape (nodes, 3, k)
        Chord frame, mass-normalised, ends included (at rest). [1/sqrt(kg)]
    kind : tuple of str
        "in-plane", "out-of-plane" or "axial".
    symmetry : tuple of str
        "symmetric", "antisymmetric" or "mixed".
    participation : ndarray, shape (k, 3)
        |psi^T K21 e_j| for end 2 moving along axis j of the chord frame, with its sign. [N/(m sqrt(kg))]
    complete : bool
        True when the model has no more modes.
    """

    frequency: np.ndarray
    shapes: np.ndarray
    kind: tuple
    symmetry: tuple
    participation: np.ndarray
    complete: bool

    def __len__(self):
        return len(self.frequency)

    def first(self, count):
        """Only the lowest `count` modes."""
        if count >= len(self):
            return self
        return Modes(
            self.frequency[:count],
            self.shapes[..., :count],
            self.kind[:count],
            self.symmetry[:count],
            self.participation[:count],
            False,
        )

    def select(self, kind=None, symmetry=None):
        """Indices of the modes of a kind and symmetry, ascending in frequency."""
        return [
            i
            for i in range(len(self))
            if (kind is None or self.kind[i] == kind) and (symmetry is None or self.symmetry[i] == symmetry)
        ]


class Dynamics:
    """The free vibration of a cable about an equilibrium.

    Parameters
    ----------
    state : State
    length, mass : float
        Unstretched length [m] and mass per unstretched length [kg/m].
    planes : tuple of tuple of int
        The directions that move, those together that do not decouple: PLANAR, one of its two, or (SPATIAL,).
    """

    def __init__(self, state: State, length, mass, planes=PLANAR):
        self.state, self.length, self.mass = state, float(length), float(mass)
        self.systems = tuple(System(state, axes) for axes in planes)
        self._found = None

    @property
    def dof(self):
        """Free displacements in all. [-]"""
        return sum(system.dof for system in self.systems)

    @cached_property
    def unit_frequency(self):
        """Frequency that belongs to the eigenvalue 1. [Hz]"""
        return np.sqrt(self.state.force / self.mass) / self.length / (2 * np.pi)

    @cached_property
    def end_stiffness(self):
        """Condensed static stiffness of end 2, end 1 fixed, chord frame, shape (3, 3). [N/m]

        Zero in the directions that do not move.
        """
        stiffness = np.zeros((3, 3))
        for system in self.systems:
            stiffness[np.ix_(system.axes, system.axes)] = system.end_stiffness
        return stiffness * self.state.force / self.length

    def modes(self, count):
        """At least the `count` lowest modes, or all there are; what was found before is kept.

        Parameters
        ----------
        count : int

        Returns
        -------
        Modes

        Raises
        ------
        ConvergenceError
        """
        if self._found is None or (len(self._found) < count and not self._found.complete):
            self._found = self.lowest(self.dof if self.dof <= ALL_AT_ONCE else count)
        return self._found

    def up_to(self, frequency):
        """All modes up to a frequency [Hz], and at least one beyond it where there is one."""
        count = FIRST
        while True:
            modes = self.modes(count)
            if modes.complete or modes.frequency[-1] > frequency * (1 + COINCIDENT):
                return modes
            count *= 2

    def frequency(self, number, kind, symmetry=None):
        """Frequency of mode `number` (from 1) of a kind and symmetry. [Hz]

        Raises
        ------
        NoSolutionError
            The model has no such mode.
        """
        count = FIRST
        while True:
            modes = self.modes(count)
            found = modes.select(kind, symmetry)
            if len(found) >= number:
                return float(modes.frequency[found[number - 1]])
            if modes.complete:
                words = " ".join(word for word in (symmetry, kind) if word)
                raise NoSolutionError(f"the model has {len(found)} {words} modes, not {number}")
            count *= 2

    def lowest(self, count):
        """The lowest modes.

        Parameters
        ----------
        count : int
            How many; all when the model has fewer.

        Returns
        -------
        Modes

        Raises
        ------
        ConvergenceError
            Too many modes of a large model, or an eigen-solution that failed.
        """
        parts = [self._solve(system, min(count, system.dof)) for system in self.systems]
        return self._merge(parts, count)

    def _solve(self, system, count):
        """Shapes of one system, shape (nodes, d, k), and their squared frequencies in units."""
        axes = len(system.axes)
        if count == 0:
            return system, np.zeros(0), np.zeros((self.state.mesh.nodes, axes, 0))
        if system.dof <= DENSE_LIMIT or (count > system.dof // 4 and system.dof <= ALL_LIMIT):
            inner = _dense(system, count)
        elif count <= system.dof // 4:
            inner = _lanczos(system, count)
        else:
            raise ConvergenceError(
                f"{count} modes of a model with {system.dof} unknowns: "
                f"above {ALL_LIMIT} unknowns at most a quarter of the modes can be had"
            )
        shapes = np.zeros((self.state.mesh.nodes, axes, inner.shape[1]))
        shapes[1:-1] = inner.reshape(-1, axes, inner.shape[1])
        elastic, geometric = system.modal_energies(shapes)
        return system, elastic + geometric, shapes

    def _merge(self, parts, count):
        """Sort the modes of all systems, name them, and give them units."""
        named = [_describe(system, square, shapes) for system, square, shapes in parts]
        square, kind, symmetry = (np.concatenate([part[i] for part in named]) for i in (0, 2, 3))
        order = _stable_order(square, kind, symmetry)
        position = np.empty(len(order), dtype=int)
        position[order] = np.arange(len(order))
        shapes = np.zeros((self.state.mesh.nodes, 3, len(order)))
        participation = np.zeros((len(order), 3))
        begin = 0
        for (system, _, _), (own, shape, _, _) in zip(parts, named, strict=True):
            axes, place = list(system.axes), position[begin : begin + len(own)]
            begin += len(own)
            shapes[:, np.array(axes)[:, None], place] = shape
            participation[place[:, None], axes] = _participation(system, own, shape)
        kept, total = order[:count], self.mass * self.length
        return Modes(
            frequency=np.sqrt(square[kept]) * self.unit_frequency,
            shapes=shapes[..., :count] / np.sqrt(total),
            kind=tuple(KINDS[i] for i in kind[kept]),
            symmetry=tuple(SYMMETRIES[i] for i in symmetry[kept]),
            participation=participation[:count] * (self.state.force / self.length / np.sqrt(total)),
            complete=len(kept) == self.dof,
        )


def _dense(system, count):
    """Lowest modes of a small system, from its compliance in mass-normalised coordinates."""
    from scipy.linalg import cholesky, eigh, qr, solve_triangular

    mass = system.mass
    if mass.nnz > system.dof:  # M = R^T R
        root = cholesky(mass.toarray())
        flexible, _ = system.solve(root.T)
        compliance = root @ flexible
    else:
        root = np.sqrt(mass.diagonal())
        flexible, _ = system.solve(np.diag(root))
        compliance = root[:, None] * flexible
    chosen = None if 4 * count > system.dof else (system.dof - count, system.dof - 1)
    driver = "evr" if chosen else "evd"  # all of them are had faster by the latter
    value, vector = eigh((compliance + compliance.T) / 2, subset_by_index=chosen, driver=driver, check_finite=False)
    # the stiffest modes of an almost inextensible cable are below the rounding of the softest
    if value[0] < -1e-13 * system.dof * value[-1]:
        raise ConvergenceError("a mode without positive stiffness: the state is not a stable equilibrium")
    vector = vector[:, ::-1][:, :count]
    shapes, _ = system.solve(root.T @ vector if root.ndim > 1 else root[:, None] * vector)
    shapes = shapes / np.maximum(value[::-1][:count], 1e-18 * value[-1])
    # the solution has magnified what a high mode had of the low ones in rounding: take it off again, lowest first
    pure, size = qr(root @ shapes if root.ndim > 1 else root[:, None] * shapes, mode="economic", check_finite=False)
    pure = pure * np.sign(np.diagonal(size))
    return solve_triangular(root, pure) if root.ndim > 1 else pure / root[:, None]


def _lanczos(system, count):
    """Lowest modes of a large system by shift-inverted Lanczos iteration about zero, from a fixed start."""
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    dof = system.dof
    inverse = LinearOperator((dof, dof), matvec=lambda right: system.solve(right)[0], dtype=float)
    begin = 1 + np.modf(np.arange(1, dof + 1) * (np.sqrt(5) - 1) / 2)[0]  # no symmetry, same every time
    try:
        _, vector = eigsh(
            inverse, count, M=system.mass, sigma=0.0, OPinv=inverse, v0=begin, ncv=min(dof, max(2 * count + 10, 30))
        )
    except ArpackNoConvergence as error:
        raise ConvergenceError(f"eigenmodes: {error}") from None
    return vector


def _describe(system, square, shapes):
    """(eigenvalues, shapes, kinds, symmetries) of the modes, ascending, with a definite choice where they coincide."""
    if not len(square):  # a single bar has nothing that moves
        return square, shapes, np.zeros(0, dtype=int), np.zeros(0, dtype=int)
    order = np.argsort(square, kind="stable")
    square, shapes = square[order], shapes[..., order]
    shapes = shapes / np.sqrt(_mass_product(system, shapes, shapes))
    mirrored = _mirror(system, shapes)
    for first, last in _clusters(square):
        chosen = slice(first, last)
        turn = _definite_basis(system, shapes[..., chosen], mirrored[..., chosen])
        shapes[..., chosen] = shapes[..., chosen] @ turn
        mirrored[..., chosen] = mirrored[..., chosen] @ turn
        # the shapes are a choice, their frequencies are not: they keep those that were found
        turned = np.argsort(sum(system.modal_energies(shapes[..., chosen])), kind="stable")
        square[first + turned] = np.sort(square[chosen])
    elastic, geometric = system.modal_energies(shapes)
    along, out = _kinetic_shares(system, shapes)
    kind = np.where(out > 0.5, OUT, np.where((along > 0.5) & (elastic > geometric), AXIAL, IN))
    # an axial mode is named by its motion along the cable, which a mirror turns round
    even = _mass_product(system, shapes, mirrored) * np.where(kind == AXIAL, -1, 1)
    symmetry = np.where(even > PURE, SYMMETRIC, np.where(even < -PURE, ANTISYMMETRIC, MIXED))
    return square, shapes * _signs(shapes), kind, symmetry


def _clusters(square):
    """Ranges of modes whose eigenvalues coincide, longer than one."""
    if not len(square):
        return []
    breaks = np.flatnonzero(np.diff(square) > 2 * COINCIDENT * square[1:]) + 1
    edges = np.concatenate([[0], breaks, [len(square)]])
    return [(a, b) for a, b in itertools.pairwise(edges) if b - a > 1]


def _definite_basis(system, shapes, mirrored):
    """Orthogonal matrix that tells apart coinciding modes by symmetry and by motion along and out of the plane."""
    along = _along(system, shapes)
    weighted = _apply_mass(system, shapes)
    out = shapes[:, -1] if 2 in system.axes else 0 * shapes[:, 0]
    mirror = np.einsum("nak,nal->kl", weighted, mirrored)
    nodal = _nodal_mass(system)
    slide = np.einsum("n,nk,nl->kl", nodal, along, along)
    leave = np.einsum("n,nk,nl->kl", nodal, out, out)
    _, turn = np.linalg.eigh(mirror + mirror.T + 4 * slide + 16 * leave)
    return turn


def _stable_order(square, kind, symmetry):
    """Places in ascending order of the eigenvalues; modes that coincide in the order of kind and symmetry."""
    order = np.argsort(square, kind="stable")
    for first, last in _clusters(square[order]):
        chosen = order[first:last]
        order[first:last] = chosen[np.lexsort((symmetry[chosen], kind[chosen]))]
    return order


def _apply_mass(system, shapes):
    """Mass times shapes, ends at rest."""
    inner = shapes[1:-1]
    product = np.zeros_like(shapes)
    product[1:-1] = (system.mass @ inner.reshape(-1, inner.shape[-1])).reshape(inner.shape)
    return product


def _mass_product(system, left, right):
    """Diagonal of left^T M right, shape (k,)."""
    return np.einsum("nak,nak->k", left, _apply_mass(system, right))


def _nodal_mass(system):
    """Mass gathered at each node, shape (nodes,)."""
    from cablestudy.cable.element import basis

    mesh = system.state.mesh
    shares = (mesh.sizes[:, None] * basis(mesh.order).shares).ravel()
    index = mesh.element_nodes.ravel()
    return np.bincount(index, weights=shares, minlength=mesh.nodes)


def _nodal_tangent(system):
    """Unit tangent at each node, shape (nodes, 3): of its element, the mean of both where two meet."""
    from cablestudy.cable.element import basis, lagrange

    state = system.state
    element = basis(state.mesh.order)
    to_nodes = lagrange(element.points, element.nodes)
    tangent = np.zeros((state.mesh.nodes, 3))
    np.add.at(tangent, state.mesh.element_nodes, np.einsum("iq,eqa->eia", to_nodes, state.direction))
    return tangent / np.linalg.norm(tangent, axis=1, keepdims=True)


def _along(system, shapes):
    """Motion along the cable, shape (nodes, k)."""
    if system.axes == OUT_OF_PLANE:
        return 0 * shapes[:, 0]
    return np.einsum("na,nak->nk", _nodal_tangent(system)[:, system.axes], shapes)


def _kinetic_shares(system, shapes):
    """Share of the kinetic energy along the cable and out of its plane, each of shape (k,)."""
    nodal = _nodal_mass(system)
    total = np.einsum("n,nak->k", nodal, shapes**2)
    out = shapes[:, -1] if 2 in system.axes else 0 * shapes[:, 0]
    return (nodal @ _along(system, shapes) ** 2) / total, (nodal @ out**2) / total


def _mirror(system, shapes):
    """Shapes seen in a mirror at right angles to the chord, at mid-length."""
    mesh = system.state.mesh
    position = mesh.node_positions
    if np.abs(position + position[::-1] - 1).max() < 1e-9:
        mirrored = shapes[::-1].copy()
    else:  # point loads need not stand symmetrically
        from scipy.interpolate import make_interp_spline

        mirrored = make_interp_spline(position, shapes, k=min(3, len(position) - 1))(1 - position)
    if 0 in system.axes:
        mirrored[:, 0] *= -1
    return mirrored


def _participation(system, square, shapes):
    """psi^T K21 e_j = -omega^2 psi^T M u_j, with u_j the static shape for a unit movement of end 2 along j."""
    if not len(square):
        return np.zeros((0, len(system.axes)))
    weighted = _apply_mass(system, shapes)
    flat = system.end_shapes.reshape(-1, len(system.axes))
    return -square[:, None] * (weighted.reshape(len(flat), shapes.shape[-1]).T @ flat)


def _signs(shapes):
    """+1 or -1 for each shape: its first large component counts as positive."""
    flat = shapes.reshape(-1, shapes.shape[-1])
    first = np.argmax(np.abs(flat) > 0.5 * np.abs(flat).max(axis=0), axis=0)
    return np.sign(flat[first, np.arange(flat.shape[1])])
