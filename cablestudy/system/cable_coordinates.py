"""Coordinates of the cables of a suspension: their lowest modes with fixed ends, and vectors that stand for the others.

The modes left out are replaced by their response to the inertia forces of the static shapes,

    V = K^-1 M U,

at most six vectors, which leave an error of the order (w/W)^6 in the mass that a motion at w meets (W the lowest mode
left out; Ritz vectors: Wilson, Yuan and Dickens, Earthquake Engineering and Structural Dynamics 10, 1982).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.system.ends import Ends
from cablestudy.system.superelement import Superelement
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class Kept:
    """Coordinates of one cable in the whole system.

    Attributes
    ----------
    element : Superelement
        In these coordinates.
    modes : int
        Modes with fixed ends that are kept.
    shapes : ndarray, shape (n, k)
        The coordinates in terms of all modes of the model: those kept, then residual vectors.
    """

    element: Superelement
    modes: int
    shapes: np.ndarray

    @property
    def residuals(self):
        """How many vectors stand for the others."""
        return len(self.element.omega) - self.modes


@dataclass(frozen=True)
class MeshGroup:
    """Cables on one mesh.

    Attributes
    ----------
    places : ndarray of int, shape (g,)
        Which of the cables.
    ends : Ends
    """

    places: np.ndarray
    ends: Ends

    def rows(self, places):
        """Which of these cables are among some, and their numbers there.

        Parameters
        ----------
        places : ndarray of int
            Numbers of cables, ascending.

        Returns
        -------
        rows : slice or ndarray of int
        numbers : ndarray of int
        """
        number = np.searchsorted(places, self.places)
        rows = np.flatnonzero(places.take(number, mode="clip") == self.places)
        number = number[rows]
        if len(rows) and rows[-1] - rows[0] == len(rows) - 1:
            rows = slice(rows[0], rows[-1] + 1)  # a view of their arrays
        return rows, number

    def take(self, places):
        """Those among some cables, by their numbers there; None without any."""
        rows, number = self.rows(places)
        return MeshGroup(number, self.ends.take(rows)) if len(number) else None

    def nodes(self, amplitudes, ends):
        """Places and displacements of the nodes of each of these cables, see `Models.nodes`: list.

        Parameters
        ----------
        amplitudes : ndarray, shape (g, n, r)
        ends : ndarray, shape (g, 6, r)
        """
        return self.placed(self.ends.motion(amplitudes, ends))

    def placed(self, moved):
        """Places and displacements of the nodes, as `nodes`, from those in the chord frame, shape (g, nodes, 3, r)."""
        state, frame = self.ends.state, self.ends.state.span.frame
        moved = np.einsum("gnir,gij->gnjr", moved, frame)
        straight = state.mesh.node_positions[:, None] * np.array([1.0, 0.0, 0.0])
        places = (1 + state.span.chord_strain)[:, None, None] * straight + state.displacement
        places = places * state.span.unstretched_length[:, None, None] @ frame
        return list(zip(places, moved, strict=True))

    def coordinates(self, kept, vectors):
        """The coordinates of these cables: `GroupCoordinates`.

        Parameters
        ----------
        kept : ndarray of bool, shape (g, n)
            Which modes are coordinates.
        vectors : ndarray of bool, shape (g,)
            Of which cables vectors stand for the other modes.
        """
        omega, coupling = self.ends.omega, self.ends.coupling
        shapes = residual_vectors(omega, coupling, ~kept & vectors[:, None])
        square, backward = omega[..., None] ** 2, shapes.swapaxes(-1, -2)
        there = (shapes != 0).any(axis=-2)
        own = np.sqrt((square * shapes**2).sum(axis=-2))
        return GroupCoordinates(
            group=self,
            vectors=shapes,
            omega=np.concatenate([omega, np.where(there, own, 1.0)], axis=-1),
            coupling=np.concatenate([coupling, backward @ coupling], axis=-2),
            used=np.concatenate([kept, there], axis=-1),
        )


@dataclass(frozen=True)
class GroupCoordinates:
    """Coordinates of the cables of a group: of its n modes with fixed ends the lowest, and residual vectors.

    Attributes
    ----------
    group : MeshGroup
    vectors : ndarray, shape (g, n, 6)
        Residual vectors in terms of the modes, orthonormal; zero where there are fewer.
    omega : ndarray, shape (g, n + 6)
        Of all modes, then of the residual vectors. [rad/s]
    coupling : ndarray, shape (g, n + 6, 6)
        Their momentum per velocity of the ends. [sqrt(kg)]
    used : ndarray of bool, shape (g, n + 6)
        Which of them are coordinates.
    """

    group: MeshGroup
    vectors: np.ndarray
    omega: np.ndarray
    coupling: np.ndarray
    used: np.ndarray

    @property
    def modes(self):
        """How many each cable has in all, n."""
        return self.vectors.shape[-2]

    def omitted(self, square, ends):
        """Mass that is left out, shape (g, r), for squared frequencies of shape (g, r); see `Models.omitted`."""
        left = np.ones(self.used.shape)
        left[:, self.modes :] = -1.0  # the residual vectors stand for a part of what the modes left out would add
        left[self.used != (left < 0)] = 0.0
        moved = self.coupling @ ends
        ratio = square[:, None] / self.omega[..., None] ** 2
        ratio = np.where(ratio < 1 - 1e-9, ratio / np.maximum(1 - ratio, 1e-9), 1e9)
        return (left[..., None] * moved**2 * ratio).sum(axis=-2)

    def amplitudes(self, coordinates):
        """Of all modes, shape (g, n, r), from those of the coordinates in use, cable by cable, shape (N, r)."""
        whole = np.zeros((*self.used.shape, coordinates.shape[-1]))
        whole[self.used] = coordinates
        return whole[:, : self.modes] + self.vectors @ whole[:, self.modes :]


@dataclass(frozen=True)
class Coordinates:
    """The coordinates of all cables, one cable after the other.

    Attributes
    ----------
    models : Models
    parts : list of GroupCoordinates
        Those of the cables of each group.
    limits : ndarray, shape (c,), or None
        Up to which modes are kept, see `Models.coordinates`; None of modes that were chosen.
    """

    models: object
    parts: list
    limits: np.ndarray | None = None

    def take(self, places):
        """Those of some cables, by their numbers, ascending."""
        models, parts = self.models.take(places), []
        for part in self.parts:
            rows, number = part.group.rows(places)
            if len(number):
                arrays = {name: getattr(part, name)[rows] for name in ("vectors", "omega", "coupling", "used")}
                parts.append(GroupCoordinates(models.groups[len(parts)], **arrays))
        return Coordinates(models, parts, None if self.limits is None else self.limits[places])

    @cached_property
    def _numbered(self):
        """Cable of each coordinate of all groups, and the order that puts cables one after the other."""
        none = np.zeros(0, dtype=int)
        cable = np.concatenate([none, *(np.repeat(part.group.places, part.used.sum(axis=-1)) for part in self.parts)])
        return cable, np.argsort(cable, kind="stable")

    @property
    def cable(self):
        """Of which cable each is, shape (N,)."""
        cable, order = self._numbered
        return cable[order]

    @cached_property
    def omega(self):
        """Angular frequency of each alone, with fixed ends, shape (N,). [rad/s]"""
        return np.concatenate([np.zeros(0), *(part.omega[part.used] for part in self.parts)])[self._numbered[1]]

    @cached_property
    def coupling(self):
        """Momentum of each per velocity of the ends of its cable, shape (N, 6). [sqrt(kg)]"""
        every = [part.coupling[part.used] for part in self.parts]
        return np.concatenate([np.zeros((0, 6)), *every])[self._numbered[1]]

    def amplitudes(self, shapes):
        """Of all modes of the cables of each group: list of ndarray, shape (g, n, r).

        Parameters
        ----------
        shapes : ndarray, shape (N or more, r)
            Their first rows are those of the coordinates.
        """
        unordered = np.empty((len(self.omega), shapes.shape[-1]))
        unordered[self._numbered[1]] = shapes[: len(self.omega)]
        found, begin = [], 0
        for part in self.parts:
            end = begin + np.count_nonzero(part.used)
            found.append(part.amplitudes(unordered[begin:end]))
            begin = end
        return found

    @cached_property
    def kept(self):
        """Coordinates of each cable with its `Superelement`: list of Kept."""
        elements = self.models.elements
        found = [Kept(element, 0, np.zeros((0, 0))) for element in elements]
        for part in self.parts:
            n, unit = part.modes, np.eye(part.modes)
            for place, cable in enumerate(part.group.places.tolist()):
                used, element = part.used[place], elements[cable]
                kept = int(np.count_nonzero(used[:n]))
                shapes = np.concatenate([unit[:, used[:n]], part.vectors[place][:, used[n:]]], axis=1)
                found[cable] = Kept(element if kept == n else element.combine(shapes), kept, shapes)
        return found


def residual_vectors(omega, coupling, left):
    """Response of the modes left out to the inertia of the static shapes.

    Parameters
    ----------
    omega : ndarray, shape (g, n)
        Of the modes with fixed ends. [rad/s]
    coupling : ndarray, shape (g, n, 6)
        See `Superelement`. [sqrt(kg)]
    left : ndarray of bool, shape (g, n)
        Which modes are left out.

    Returns
    -------
    ndarray, shape (g, n, k)
        In terms of the modes, orthonormal, those with the lowest frequency first; k is 6 or n, and vectors that
        rounding would determine are zero.
    """
    if not left.any():
        return np.zeros((*omega.shape, min(coupling.shape[-1], omega.shape[-1])))
    square = np.where(left, omega**2, 0.0)[..., None]
    response = np.where(left[..., None], coupling / omega[..., None] ** 2, 0.0)
    vectors, size, _ = np.linalg.svd(response, full_matrices=False)
    vectors = vectors * (size > SYSTEM.dependent_residual * size.max(axis=-1, keepdims=True, initial=0.0))[..., None, :]
    turned = np.linalg.eigh(vectors.swapaxes(-1, -2) @ (square * vectors))[1]
    found = vectors @ turned
    return np.where((found**2).sum(axis=-2, keepdims=True) > 0.5, found, 0.0)
