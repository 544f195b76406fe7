"""Eigenmodes of a cable with fixed ends: the lowest, all up to a frequency, or all; their kind and symmetry.

Modes come from the compliance K^-1 M, so that the lowest are the most accurate; each frequency is then the Rayleigh
quotient of its shape, with energies summed as squares. In-plane and out-of-plane motion are solved apart where they
decouple. Small models of many cables are solved in one call.
"""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE, State, System
from cablestudy.cable.element import basis, lagrange
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
SHARES = {9: 0.12, 0: 0.3}  # of what the two highest orders from some order on change: at least a frequency's error
ROUNDING = 4e-16  # error of the lowest frequency; it grows with the frequency
ALL_AT_ONCE = 200  # degrees of freedom up to which all modes cost little more than some


class Motion:
    """Modes of one system, of one cable or of many, each plane for itself; what few ask for is computed when asked for.

    Parameters
    ----------
    system : System
    shapes : ndarray, shape (..., nodes, d, k)
        Orthonormal by the mass of a cable of unit mass.
    """

    def __init__(self, system, shapes):
        elastic, geometric = system.modal_energies(shapes)
        square = elastic + geometric
        if not _ascends(square):
            order = np.argsort(square, axis=-1, kind="stable")
            elastic, geometric, square = (_sort(part, order) for part in (elastic, geometric, square))
            shapes = _sort(shapes, order[..., None, None, :])
        self.system, self.square, self.shapes = system, square, shapes
        clusters = _clusters(self.square)
        if clusters:
            for cluster in clusters:
                self._make_definite(*cluster)
            elastic, geometric = system.modal_energies(self.shapes)
        self.kinds = np.full(self.square.shape, OUT)
        if system.axes != OUT_OF_PLANE and self.square.shape[-1]:
            along, out = _kinetic_shares(system, self.shapes)
            self.kinds = np.where(out > 0.5, OUT, np.where((along > 0.5) & (elastic > geometric), AXIAL, IN))

    def _make_definite(self, cable, first, last):
        """Choose shapes of coinciding modes; their frequencies are no choice: they keep those that were found."""
        one, chosen = System(self.system.state.take(cable), self.system.axes), (*cable, ..., slice(first, last))
        some = self.shapes[chosen]
        some = some @ _definite_basis(one, some, _mirror(one, some))
        turned = np.argsort(sum(one.modal_energies(some)), kind="stable")
        self.shapes[chosen] = some[..., turned]

    @cached_property
    def error(self):
        """Estimated relative error of the frequencies by the order of the elements, shape (..., k). [-]

        What a model of an order lower by two would change; held against random scenes by tests/test_extremes.py.
        """
        order = self.system.state.mesh.order
        share = next(share for least, share in SHARES.items() if order >= least)
        left = share * self.system.highest_energy(self.shapes) / (2 * self.square)
        noise = ROUNDING * np.sqrt(self.square / self.square[..., :1])
        return np.maximum(left, noise)

    @cached_property
    def signed(self):
        """The shapes with their first large component positive."""
        return self.shapes * _signs(self.shapes)[..., None, None, :]

    @cached_property
    def symmetries(self):
        """Places in SYMMETRIES, shape (..., k)."""
        # an axial mode is named by its motion along the cable, which a mirror turns round
        even = _mass_product(self.system, self.shapes, _mirror(self.system, self.shapes))
        even = even * np.where(self.kinds == AXIAL, -1, 1)
        return np.where(even > PURE, SYMMETRIC, np.where(even < -PURE, ANTISYMMETRIC, MIXED))

    @cached_property
    def participation(self):
        """psi^T K21 e_j = -omega^2 psi^T M u_j, with u_j the static shape for a unit movement of end 2 along j."""
        axes = len(self.system.axes)
        weighted = _apply_mass(self.system, self.signed)
        flat = weighted.reshape(*weighted.shape[:-3], -1, weighted.shape[-1])
        moved = self.system.end_shapes
        return -self.square[..., None] * (flat.swapaxes(-1, -2) @ moved.reshape(*moved.shape[:-3], -1, axes))


def _ascends(values):
    """Whether no value is below the one before."""
    return bool((values[..., 1:] >= values[..., :-1]).all())


def _sort(values, order):
    """Values in another order along the last axis; as they are without one."""
    return values if order is None else np.take_along_axis(values, order, axis=-1)


class Together:
    """Modes of all systems of one cable or of many, in ascending frequency.

    Parameters
    ----------
    motions : list of Motion
    dynamics : Dynamics
    """

    def __init__(self, motions, dynamics):
        self._motions, self._dynamics = motions, dynamics
        self.square, self.kinds = (self._all(name) for name in ("square", "kinds"))
        self._order = None
        if not _ascends(self.square) or _clusters(self.square):
            self._sort()

    def _sort(self):
        """Ascending frequencies; modes that coincide in the order of kind and symmetry."""
        self._order = np.argsort(self.square, axis=-1, kind="stable")
        for cable, first, last in _clusters(self._sorted(self.square)):
            chosen = self._order[cable][first:last].copy()
            names = self._all("symmetries")[cable][chosen], self.kinds[cable][chosen]
            self._order[cable][first:last] = chosen[np.lexsort(names)]

    def _all(self, name):
        return np.concatenate([getattr(motion, name) for motion in self._motions], axis=-1)

    def _sorted(self, values):
        return values if self._order is None else _sort(values, self._order)

    @property
    def frequency(self):
        """Shape (..., k). [Hz]"""
        return np.sqrt(self._sorted(self.square)) * np.asarray(self._dynamics.unit_frequency)[..., None]

    @property
    def sorted_kinds(self):
        """Places in KINDS, shape (..., k)."""
        return self._sorted(self.kinds)

    @cached_property
    def errors(self):
        """Estimated relative errors of the frequencies, shape (..., k). [-]"""
        return self._sorted(self._all("error"))

    @cached_property
    def symmetries(self):
        """Places in SYMMETRIES, shape (..., k)."""
        return self._sorted(self._all("symmetries"))

    @cached_property
    def shapes(self):
        """Shape (..., nodes, 3, k). [1/sqrt(kg)]"""
        mesh, lead, begin = self._dynamics.state.mesh, self.square.shape[:-1], 0
        shapes = np.zeros((*lead, mesh.nodes, 3, self.square.shape[-1]))
        for motion in self._motions:
            end = begin + motion.square.shape[-1]
            shapes[..., list(motion.system.axes), begin:end] = motion.signed
            begin = end
        total = np.sqrt(self._dynamics.mass * self._dynamics.length)
        order = None if self._order is None else self._order[..., None, None, :]
        return _sort(shapes, order) / total[..., None, None, None]

    @cached_property
    def participation(self):
        """Shape (..., k, 3). [N/(m sqrt(kg))]"""
        dynamics, begin = self._dynamics, 0
        found = np.zeros((*self.square.shape, 3))
        for motion in self._motions:
            end = begin + motion.square.shape[-1]
            found[..., begin:end, list(motion.system.axes)] = motion.participation
            begin = end
        scale = np.asarray(dynamics.state.force / dynamics.length / np.sqrt(dynamics.mass * dynamics.length))
        if self._order is not None:
            found = np.take_along_axis(found, self._order[..., None], axis=-2)
        return found * scale[..., None, None]


@dataclass(frozen=True)
class Modes:
    """Modes in ascending frequency, of one cable or of many.

    Attributes
    ----------
    frequency : ndarray, shape (..., k)
        [Hz]
    kinds : ndarray of int, shape (..., k)
        Places in KINDS.
    complete : bool
        True when the model has no more modes.
    together : Together
        That of all cables that were solved at once,
    cable : tuple of int
        and which of them this is.
    """

    frequency: np.ndarray
    kinds: np.ndarray
    complete: bool
    together: Together
    cable: tuple = ()

    def __len__(self):
        return self.frequency.shape[-1]

    @property
    def shapes(self):
        """Chord frame, mass-normalised, ends included (at rest), shape (..., nodes, 3, k). [1/sqrt(kg)]"""
        return self.together.shapes[self.cable][..., : len(self)]

    @property
    def symmetries(self):
        """Places in SYMMETRIES, shape (..., k)."""
        return self.together.symmetries[self.cable][..., : len(self)]

    @property
    def errors(self):
        """Estimated relative errors of the frequencies, elements resolving the waves that belong to them. [-]"""
        return self.together.errors[self.cable][..., : len(self)]

    @property
    def participation(self):
        """psi^T K21 e_j for end 2 moving along axis j of the chord frame, shape (..., k, 3). [N/(m sqrt(kg))]"""
        return self.together.participation[self.cable][..., : len(self), :]

    @cached_property
    def kind(self):
        """Of one cable: "in-plane", "out-of-plane" or "axial" for each mode."""
        return tuple(KINDS[i] for i in self.kinds.tolist())

    @cached_property
    def symmetry(self):
        """Of one cable: "symmetric", "antisymmetric" or "mixed" for each mode."""
        return tuple(SYMMETRIES[i] for i in self.symmetries.tolist())

    def take(self, cable):
        """Those of one cable of many."""
        return Modes(self.frequency[cable], self.kinds[cable], self.complete, self.together, (cable,))

    def first(self, count):
        """Only the lowest `count` modes."""
        if count >= len(self):
            return self
        return Modes(self.frequency[..., :count], self.kinds[..., :count], False, self.together, self.cable)

    def numbered(self, number, kind, symmetry=None):
        """Where mode `number` (from 1) of a kind and symmetry stands, shape (..., k): true in one place, or in none."""
        wanted = self.kinds == KINDS.index(kind)
        if symmetry is not None:
            wanted = wanted & (self.symmetries == SYMMETRIES.index(symmetry))
        return wanted & (np.cumsum(wanted, axis=-1) == number)

    def select(self, kind=None, symmetry=None):
        """Indices of the modes of one cable of a kind and symmetry, ascending in frequency."""
        return [
            i
            for i in range(len(self))
            if (kind is None or self.kind[i] == kind) and (symmetry is None or self.symmetry[i] == symmetry)
        ]


class Dynamics:
    """The free vibration of a cable about an equilibrium, or of many whose models are alike.

    Parameters
    ----------
    state : State
        Of one cable or, with a leading axis, of many.
    length, mass : float or ndarray
        Unstretched length [m] and mass per unstretched length [kg/m].
    planes : tuple of tuple of int
        The directions that move, those together that do not decouple: PLANAR, one of its two, or (SPATIAL,).
    """

    def __init__(self, state: State, length, mass, planes=PLANAR):
        self.length, self.mass = np.asarray(length, dtype=float), np.asarray(mass, dtype=float)
        self._state, self._planes, self._mesh = state, planes, state.mesh
        self._found, self._table, self._spectra, self._among = None, {}, {}, None

    def take(self, index):
        """One cable of many, which finds its modes when another one of them does."""
        one = Dynamics(self._state, self.length[index], self.mass[index], self._planes)
        one._among = self, index
        return one

    @cached_property
    def state(self):
        """The equilibrium: `State`."""
        return self._state if self._among is None else self._state.take(self._among[1])

    @cached_property
    def systems(self):
        """The tangent in each of the planes: `System`."""
        return tuple(System(self.state, axes) for axes in self._planes)

    @property
    def dof(self):
        """Free displacements in all. [-]"""
        return (self._mesh.nodes - 2) * sum(len(axes) for axes in self._planes)

    @property
    def small(self):
        """Whether the modes of many such models are found together."""
        return self.dof <= ALL_AT_ONCE

    @cached_property
    def unit_frequency(self):
        """Frequency that belongs to the eigenvalue 1, shape (...). [Hz]"""
        return np.sqrt(self.state.force / self.mass) / self.length / (2 * np.pi)

    @cached_property
    def end_stiffness(self):
        """Condensed static stiffness of end 2, end 1 fixed, chord frame, shape (..., 3, 3). [N/m]

        Zero in the directions that do not move.
        """
        stiffness = np.zeros((*np.shape(self.length), 3, 3))
        for system in self.systems:
            rows, columns = np.ix_(system.axes, system.axes)
            stiffness[..., rows, columns] = system.end_stiffness
        return stiffness * np.asarray(self.state.force / self.length)[..., None, None]

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
            if self._among is not None:
                whole, index = self._among
                self._found = whole.modes(count).take(index)
            else:
                self._found = self.lowest(self.dof if self.small and 2 * count > self.dof else count)
        return self._found

    def up_to(self, frequency):
        """All modes of one cable up to a frequency [Hz], and at least one beyond it where there is one."""
        count = self.dof if self.small else FIRST
        while True:
            modes = self.modes(count)
            if modes.complete or modes.frequency[-1] > frequency * (1 + COINCIDENT):
                return modes
            count *= 2

    def frequency(self, number, kind, symmetry=None):
        """Frequency of mode `number` (from 1) of a kind and symmetry of one cable. [Hz]

        Raises
        ------
        NoSolutionError
            The model has no such mode.
        """
        return self.frequencies(((number, kind, symmetry),))[0][0]

    def frequencies(self, which, errors=False):
        """Frequencies of some modes of one cable, and their estimated relative errors.

        Parameters
        ----------
        which : tuple of tuple
            Number (from 1), kind and symmetry or None of each.
        errors : bool
            Whether the errors are wanted too; see `Modes.errors`.

        Returns
        -------
        frequency, error : list of float
            [Hz], [-]; the errors are empty where they are not wanted.

        Raises
        ------
        NoSolutionError
            The model has no such mode.
        """
        count = max(2 * number for number, _, _ in which)
        while True:
            found, wrong, complete = self._among_lowest(count, which, errors)
            missing = [mode for mode, frequency in zip(which, found, strict=True) if frequency != frequency]
            if not missing:
                return found, wrong
            if complete:
                number, kind, symmetry = missing[0]
                words = " ".join(word for word in (symmetry, kind) if word)
                there = len(self.modes(count).select(kind, symmetry))
                raise NoSolutionError(f"the model has {there} {words} modes, not {number}")
            count *= 2

    def _among_lowest(self, count, which, errors):
        """The same of the lowest `count` modes, not a number where one is none of them, and whether these are all."""
        if self._among is not None:
            whole, cable = self._among
            found, wrong, complete = whole._among_lowest(count, which, errors)
            return found[cable], wrong[cable] if errors else [], complete
        key = (count, which, errors)
        if key not in self._table:
            modes, places = self.modes(count), []
            for mode in which:
                here = modes.numbered(*mode)
                places.append(np.where(here.any(axis=-1), (here * np.arange(len(modes))).sum(axis=-1), len(modes)))
            places = np.stack(places, axis=-1)

            def picked(values):
                padded = np.concatenate([values, np.full((*values.shape[:-1], 1), np.nan)], axis=-1)
                return np.take_along_axis(padded, places, axis=-1).tolist()

            self._table[key] = picked(modes.frequency), picked(modes.errors) if errors else [], modes.complete
        return self._table[key]

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
        together = Together([self._solve(system, min(count, system.dof)) for system in self.systems], self)
        frequency, kinds = together.frequency[..., :count], together.sorted_kinds[..., :count]
        return Modes(frequency, kinds, frequency.shape[-1] == self.dof, together)

    def _solve(self, system, count):
        """`Motion` of one system, its lowest modes."""
        mesh, axes, lead = self.state.mesh, len(system.axes), np.shape(self.length)
        shapes = np.zeros((*lead, mesh.nodes, axes, count))
        if count == 0:  # a single bar has nothing that moves
            return Motion(system, shapes)
        if system.dof <= DENSE_LIMIT or (count > system.dof // 4 and system.dof <= ALL_LIMIT):
            if system.axes not in self._spectra:
                self._spectra[system.axes] = _spectrum(system)
            inner = _shapes(system, *self._spectra[system.axes], count)
        elif count <= system.dof // 4:
            every = [System(self.state.take(cable), system.axes) for cable in np.ndindex(lead)]
            inner = np.stack([_lanczos(one, count) for one in every]).reshape(*lead, system.dof, count)
        else:
            raise ConvergenceError(
                f"{count} modes of a model with {system.dof} unknowns: "
                f"above {ALL_LIMIT} unknowns at most a quarter of the modes can be had"
            )
        shapes[..., 1:-1, :, :] = inner.reshape(*lead, -1, axes, count)
        return Motion(system, shapes)


def _spectrum(system):
    """B R and the eigenvectors of its square for small systems, lowest frequency first; M = R R^T, K^-1 = B^T B.

    Returns
    -------
    flexible, vector : ndarray, shapes (..., n q d, dof) and (..., dof, dof)
    """
    root = _root(system.mass)
    flexible = system.root * root if root.ndim == 1 else system.root @ root
    return flexible, np.linalg.eigh(flexible.swapaxes(-1, -2) @ flexible)[1][..., ::-1]


def _root(mass):
    """R with M = R R^T: its diagonal, shape (dof,), or the whole."""
    return np.sqrt(mass.diagonal()) if mass.nnz == mass.shape[0] else np.linalg.cholesky(mass.toarray())


def _shapes(system, flexible, vector, count):
    """The lowest shapes of what `_spectrum` found, orthonormal by the mass, shape (..., dof, count)."""
    shapes = flexible.swapaxes(-1, -2) @ (flexible @ vector[..., :count])
    # what a high mode has of the low ones by rounding is taken off again, lowest first
    pure, size = np.linalg.qr(shapes / np.sqrt((shapes**2).sum(axis=-2, keepdims=True)))
    pure = pure * np.sign(np.diagonal(size, axis1=-2, axis2=-1))[..., None, :]
    root = _root(system.mass)
    return pure / root[:, None] if root.ndim == 1 else np.linalg.solve(root.T, pure)


def _lanczos(system, count):
    """Lowest modes of a large system by shift-inverted Lanczos iteration about zero, from a fixed start."""
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    dof = system.dof
    inverse = LinearOperator((dof, dof), matvec=lambda right: system.solve(right.reshape(-1, 1))[:, 0], dtype=float)
    begin = 1 + np.modf(np.arange(1, dof + 1) * (np.sqrt(5) - 1) / 2)[0]  # no symmetry, same every time
    try:
        _, vector = eigsh(
            inverse, count, M=system.mass, sigma=0.0, OPinv=inverse, v0=begin, ncv=min(dof, max(2 * count + 10, 30))
        )
    except ArpackNoConvergence as error:
        raise ConvergenceError(f"eigenmodes: {error}") from None
    return vector


def _clusters(square):
    """(cable, first, last) of modes whose eigenvalues coincide, longer than one; a cable is a tuple."""
    near = np.diff(square, axis=-1) <= 2 * COINCIDENT * square[..., 1:]
    found = []
    for cable in {tuple(where[:-1]) for where in np.argwhere(near).tolist()}:
        breaks = np.flatnonzero(~near[cable]) + 1
        edges = np.concatenate([[0], breaks, [square.shape[-1]]]).tolist()
        found += [(cable, a, b) for a, b in itertools.pairwise(edges) if b - a > 1]
    return found


def _definite_basis(system, shapes, mirrored):
    """Orthogonal matrix that tells apart coinciding modes by symmetry and by motion along and out of the plane."""
    along = _along(system, shapes)
    weighted = _apply_mass(system, shapes)
    out = shapes[:, -1] if 2 in system.axes else 0 * shapes[:, 0]
    mirror = np.einsum("nak,nal->kl", weighted, mirrored)
    nodal = _nodal_mass(system.state.mesh)
    slide = np.einsum("n,nk,nl->kl", nodal, along, along)
    leave = np.einsum("n,nk,nl->kl", nodal, out, out)
    _, turn = np.linalg.eigh(mirror + mirror.T + 4 * slide + 16 * leave)
    return turn


def _apply_mass(system, shapes):
    """Mass times shapes, ends at rest."""
    inner, mass = shapes[..., 1:-1, :, :], system.mass
    product = np.zeros_like(shapes)
    if mass.nnz == system.dof:
        product[..., 1:-1, :, :] = mass.diagonal().reshape(-1, len(system.axes), 1) * inner
    else:
        flat = inner.reshape(*inner.shape[:-3], system.dof, -1)
        product[..., 1:-1, :, :] = _times(mass, flat).reshape(inner.shape)
    return product


def _times(matrix, flat):
    """A sparse matrix times stacked dense ones, each alone."""
    if flat.ndim == 2:
        return matrix @ flat
    return np.stack([matrix @ part for part in flat])


def _mass_product(system, left, right):
    """Diagonal of left^T M right, shape (..., k)."""
    product = left * _apply_mass(system, right)
    return product.reshape(*product.shape[:-3], -1, product.shape[-1]).sum(axis=-2)


def _nodal_mass(mesh):
    """Mass gathered at each node, shape (nodes,)."""
    nodal = np.zeros(mesh.nodes)
    np.add.at(nodal, mesh.element_nodes, mesh.sizes[:, None] * basis(mesh.order).shares)
    return nodal


def _nodal_tangent(state):
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
    return (_nodal_tangent(system.state)[..., system.axes, None] * shapes).sum(axis=-2)


def _kinetic_shares(system, shapes):
    """Share of the kinetic energy along the cable and out of its plane, each of shape (..., k)."""
    nodal = _nodal_mass(system.state.mesh)
    total = nodal @ (shapes**2).sum(axis=-2)
    out = shapes[..., -1, :] if 2 in system.axes else 0 * shapes[..., 0, :]
    return (nodal @ _along(system, shapes) ** 2) / total, (nodal @ out**2) / total


def _mirror(system, shapes):
    """Shapes seen in a mirror at right angles to the chord, at mid-length."""
    mesh = system.state.mesh
    position = mesh.node_positions
    if np.abs(position + position[::-1] - 1).max() < 1e-9:
        mirrored = shapes[..., ::-1, :, :].copy()
    else:  # point loads need not stand symmetrically
        from scipy.interpolate import make_interp_spline

        mirrored = make_interp_spline(position, shapes, k=min(3, len(position) - 1), axis=-3)(1 - position)
    if 0 in system.axes:
        mirrored[..., 0, :] *= -1
    return mirrored


def _signs(shapes):
    """+1 or -1 for each shape, shape (..., k): its first large component counts as positive."""
    flat = shapes.reshape(*shapes.shape[:-3], -1, shapes.shape[-1])
    first = np.argmax(np.abs(flat) > 0.5 * np.abs(flat).max(axis=-2, keepdims=True), axis=-2)
    return np.sign(np.take_along_axis(flat, first[..., None, :], axis=-2)[..., 0, :])
