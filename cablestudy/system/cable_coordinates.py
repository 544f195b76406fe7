"""Coordinates of the cables of a suspension: their lowest modes with fixed ends, and residual vectors for the others.

The residual vectors replace the modes left out by their response to the inertia forces of the static shapes,

    V = K^-1 M U,

K and M being those of the cable with fixed ends and U its static shapes, one for each end displacement: at most six
vectors, which leave an error of the order (w/W)^6 in the dynamic mass at the ends for a motion at w (W the lowest mode
left out; Ritz vectors: Wilson, Yuan and Dickens, Earthquake Engineering and Structural Dynamics 10, 1982).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.system.ends import Ends
from cablestudy.system.superelement import Superelement
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class ReducedCable:
    """One cable in its coordinates: some modes with fixed ends, and vectors that represent the others.

    Attributes
    ----------
    element : Superelement
        The cable in these coordinates.
    modes : int
        Number of modes with fixed ends that are kept.
    shapes : ndarray, shape (n, k)
        The coordinates in terms of all modes of the model: those kept, then residual vectors.
    """

    element: Superelement
    modes: int
    shapes: np.ndarray

    @property
    def residuals(self):
        """Number of vectors that represent the other modes."""
        return len(self.element.omega) - self.modes


@dataclass(frozen=True)
class MeshGroup:
    """Group of g cables that have the same mesh, so that their arrays can be computed together.

    Attributes
    ----------
    cable_indices : ndarray of int, shape (g,)
        Index of each cable of the group among all cables.
    ends : Ends
        Modes of these cables with fixed ends, and matrices of their ends.
    """

    cable_indices: np.ndarray
    ends: Ends

    def find(self, chosen):
        """Find the cables of this group that are in a list of chosen cables.

        Parameters
        ----------
        chosen : ndarray of int
            Indices of cables among all cables, ascending.

        Returns
        -------
        rows : slice or ndarray of int
            Indices of the cables found in the arrays of this group.
        positions : ndarray of int
            Indices of the cables found in `chosen`.
        """
        positions = np.searchsorted(chosen, self.cable_indices)
        rows = np.flatnonzero(chosen.take(positions, mode="clip") == self.cable_indices)
        positions = positions[rows]
        if len(rows) and rows[-1] - rows[0] == len(rows) - 1:
            rows = slice(rows[0], rows[-1] + 1)  # a view of their arrays
        return rows, positions

    def take(self, chosen):
        """`MeshGroup` of the cables of this group that are in `chosen`, with their indices there; None without any."""
        rows, positions = self.find(chosen)
        return MeshGroup(positions, self.ends.take(rows)) if len(positions) else None

    def nodes(self, amplitudes, ends):
        """Positions and displacements of the nodes of each of these cables, see `Models.nodes`: list.

        Parameters
        ----------
        amplitudes : ndarray, shape (g, n, r)
        ends : ndarray, shape (g, 6, r)
        """
        return self.in_global_axes(self.ends.nodal_displacements(amplitudes, ends))

    def in_global_axes(self, displacements):
        """`nodes` from displacements in the chord frame, shape (g, nodes, 3, r)."""
        state, frame = self.ends.state, self.ends.state.span.frame
        displacements = np.einsum("gnir,gij->gnjr", displacements, frame)
        straight = state.mesh.node_positions[:, None] * np.array([1.0, 0.0, 0.0])
        positions = (1 + state.span.chord_strain)[:, None, None] * straight + state.displacement  # over the length
        positions = positions * state.span.unstretched_length[:, None, None] @ frame
        return list(zip(positions, displacements, strict=True))

    def coordinates(self, kept, vectors):
        """Reduced coordinates of the g cables of the group: modes with fixed ends, residual vectors for the others.

        Residual vectors are combinations of the modes left out, see `residual_vectors`.

        Parameters
        ----------
        kept : ndarray of bool, shape (g, n)
            True for those of the n modes of each cable that are kept as coordinates.
        vectors : ndarray of bool, shape (g,)
            True for cables that get residual vectors; the others lose the modes left out without a substitute.

        Returns
        -------
        GroupCoordinates
            With the frequencies sqrt(v^T W^2 v) and the couplings v^T m of each vector v: W are the frequencies of the
            modes and m their momenta per velocity of the six ends.
        """
        omega, coupling = self.ends.omega, self.ends.coupling
        shapes = residual_vectors(omega, coupling, ~kept & vectors[:, None])
        not_zero = (shapes != 0).any(axis=-2)
        vector_omega = np.sqrt((omega[..., None] ** 2 * shapes**2).sum(axis=-2))
        vector_coupling = shapes.swapaxes(-1, -2) @ coupling
        return GroupCoordinates(
            group=self,
            vectors=shapes,
            omega=np.concatenate([omega, np.where(not_zero, vector_omega, 1.0)], axis=-1),
            coupling=np.concatenate([coupling, vector_coupling], axis=-2),
            used=np.concatenate([kept, not_zero], axis=-1),
        )


@dataclass(frozen=True)
class GroupCoordinates:
    """Coordinates of the g cables of a group: some of their n modes with fixed ends, and residual vectors.

    Modes that are no coordinates stay in the arrays, with `used` False.

    Attributes
    ----------
    group : MeshGroup
    vectors : ndarray, shape (g, n, k)
        Residual vectors in terms of the modes, orthonormal, k = min(6, n); zero where there are fewer.
    omega : ndarray, shape (g, n + k)
        Of all modes, then of the residual vectors. [rad/s]
    coupling : ndarray, shape (g, n + k, 6)
        Their momentum per velocity of the ends. [sqrt(kg)]
    used : ndarray of bool, shape (g, n + k)
        True for the modes and vectors that are coordinates.
    """

    group: MeshGroup
    vectors: np.ndarray
    omega: np.ndarray
    coupling: np.ndarray
    used: np.ndarray

    @property
    def modes(self):
        """Number of modes that each cable has in all, n."""
        return self.vectors.shape[-2]

    def truncation_error(self, square, ends):
        """Relative error of squared frequencies of a suspension by the modes of cables that its coordinates omit.

        Parameters
        ----------
        square : ndarray, shape (g, r)
            w^2: squared angular frequencies of r modes of the suspension, for each of the g cables. [rad^2/s^2]
        ends : ndarray, shape (g, 6, r)
            u: displacements of both ends of each cable along x, y, z in these mass-normalised modes. [1/sqrt(kg)]

        Returns
        -------
        ndarray, shape (g, r)
            Part of the error that each cable makes. [-]

        Notes
        -----
        A mode of a cable, with fixed ends, the frequency W and the momentum m per velocity of the ends, would add the
        modal mass (m u)^2 w^2/(W^2 - w^2) to that of the suspension, which is 1. The error is the sum of this over the
        modes left out, less the same sum over the residual vectors, which supply a part of that mass.
        """
        is_mode = np.arange(self.used.shape[-1]) < self.modes
        sign = np.where(self.used, -1.0 * ~is_mode, 1.0 * is_mode)  # modes that are not used, less vectors that are
        momentum = self.coupling @ ends
        ratio = square[:, None] / self.omega[..., None] ** 2
        amplification = np.where(ratio < 1 - 1e-9, ratio / np.maximum(1 - ratio, 1e-9), 1e9)  # w^2/(W^2 - w^2), bounded
        return (sign[..., None] * momentum**2 * amplification).sum(axis=-2)

    def amplitudes(self, coordinates):
        """Amplitudes of all modes, shape (g, n, r), from those of the coordinates, cable by cable, shape (N, r)."""
        values = np.zeros((*self.used.shape, coordinates.shape[-1]))
        values[self.used] = coordinates
        return values[:, : self.modes] + self.vectors @ values[:, self.modes :]


@dataclass(frozen=True)
class Coordinates:
    """The coordinates of all cables, one cable after the other.

    Attributes
    ----------
    models : Models
    of_groups : list of GroupCoordinates
        Those of the cables of each group.
    limits : ndarray, shape (c,), or None
        Angular frequency up to which modes of each cable are kept, see `Models.coordinates`; None where the modes were
        chosen one by one. [rad/s]
    """

    models: object
    of_groups: list
    limits: np.ndarray | None = None

    def take(self, cables, catenary):
        """`Coordinates` of some cables, by their indices, ascending, with the `Catenary` of these."""
        models, of_groups = self.models.take(cables, self.models.cables.take(cables, catenary)), []
        for coordinates in self.of_groups:
            rows, positions = coordinates.group.find(cables)
            if len(positions):
                arrays = {name: getattr(coordinates, name)[rows] for name in ("vectors", "omega", "coupling", "used")}
                of_groups.append(GroupCoordinates(models.groups[len(of_groups)], **arrays))
        return Coordinates(models, of_groups, None if self.limits is None else self.limits[cables])

    @cached_property
    def _cable_and_order(self):
        """Cable of each coordinate of all groups, and the order that puts cables one after the other."""
        cables = [np.repeat(each.group.cable_indices, each.used.sum(axis=-1)) for each in self.of_groups]
        cable = np.concatenate([np.zeros(0, dtype=int), *cables])
        return cable, np.argsort(cable, kind="stable")

    @property
    def cable(self):
        """Index of the cable of each coordinate, shape (N,)."""
        cable, order = self._cable_and_order
        return cable[order]

    @cached_property
    def omega(self):
        """Angular frequency of each coordinate alone, with fixed ends, shape (N,). [rad/s]"""
        omega = np.concatenate([np.zeros(0), *(each.omega[each.used] for each in self.of_groups)])
        return omega[self._cable_and_order[1]]

    @cached_property
    def coupling(self):
        """Momentum of each coordinate per velocity of the ends of its cable, shape (N, 6). [sqrt(kg)]"""
        coupling = np.concatenate([np.zeros((0, 6)), *(each.coupling[each.used] for each in self.of_groups)])
        return coupling[self._cable_and_order[1]]

    def amplitudes(self, shapes):
        """Amplitudes of all modes of the cables of each group: list of ndarray, shape (g, n, r).

        Parameters
        ----------
        shapes : ndarray, shape (N or more, r)
            The first N rows are those of the coordinates of the cables.
        """
        by_group = np.empty((len(self.omega), shapes.shape[-1]))
        by_group[self._cable_and_order[1]] = shapes[: len(self.omega)]
        amplitudes, begin = [], 0
        for coordinates in self.of_groups:
            end = begin + np.count_nonzero(coordinates.used)
            amplitudes.append(coordinates.amplitudes(by_group[begin:end]))
            begin = end
        return amplitudes

    @cached_property
    def kept(self):
        """Coordinates of each cable with its `Superelement`: list of ReducedCable."""
        elements = self.models.elements
        kept = [ReducedCable(element, 0, np.zeros((0, 0))) for element in elements]
        for coordinates in self.of_groups:
            n, unit = coordinates.modes, np.eye(coordinates.modes)
            for row, cable in enumerate(coordinates.group.cable_indices.tolist()):
                used, element = coordinates.used[row], elements[cable]
                modes = int(np.count_nonzero(used[:n]))
                shapes = np.concatenate([unit[:, used[:n]], coordinates.vectors[row][:, used[n:]]], axis=1)
                kept[cable] = ReducedCable(element if modes == n else element.combine(shapes), modes, shapes)
        return kept


def residual_vectors(omega, coupling, omitted):
    """Residual vectors of g cables: combinations of the modes left out, which replace these.

    They span the static response V = K^-1 M U of the modes left out to the inertia forces of the six static shapes U,
    with K and M of the cable with fixed ends. In terms of the modes, row j of V is m_j/W_j^2.

    Parameters
    ----------
    omega : ndarray, shape (g, n)
        W: angular frequencies of the n modes with fixed ends of each cable. [rad/s]
    coupling : ndarray, shape (g, n, 6)
        m: momentum of each mode per velocity of each of the six end displacements. [sqrt(kg)]
    omitted : ndarray of bool, shape (g, n)
        True for modes that are left out.

    Returns
    -------
    ndarray, shape (g, n, k)
        The vectors as columns: amplitudes of the modes, orthonormal, ascending in frequency; k = min(6, n). If fewer
        vectors are independent except for rounding, the other columns are zero.
    """
    if not omitted.any():
        return np.zeros((*omega.shape, min(coupling.shape[-1], omega.shape[-1])))
    response = np.where(omitted[..., None], coupling / omega[..., None] ** 2, 0.0)  # V, amplitudes of the modes
    vectors, singular, _ = np.linalg.svd(response, full_matrices=False)
    independent = singular > SYSTEM.dependent_residual * singular.max(axis=-1, keepdims=True, initial=0.0)
    vectors = vectors * independent[..., None, :]
    stiffness = vectors.swapaxes(-1, -2) @ (omega[..., None] ** 2 * vectors)
    rotation = np.linalg.eigh(stiffness)[1]  # to vectors with a frequency each
    by_frequency = vectors @ rotation
    is_unit = (by_frequency**2).sum(axis=-2, keepdims=True) > 0.5  # else one of the zeros, except for rounding
    return np.where(is_unit, by_frequency, 0.0)
