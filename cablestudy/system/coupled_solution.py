"""Coupled modes of a suspension as they were found: their errors, their damping, and what moves in each."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.system.damping import damping_ratios
from cablestudy.system.linear import ReducedSystem, compliance_shares, coupled
from cablestudy.system.mode_pairs import pair_modes
from cablestudy.system.tolerances import SYSTEM

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
KINDS = ("in-plane", "out-of-plane", "axial")


@dataclass(frozen=True)
class CableRecord:
    """Mesh and modes that one cable was given, and why.

    Attributes
    ----------
    name : str
    elements, order : int
        Of its mesh; zero for a cable without mass.
    modes, residuals : int
        Coordinates: modes with fixed ends, and vectors that stand for the others.
    first_mode : float
        Its lowest mode with fixed ends; infinite without mass. [Hz]
    limit : float
        Up to which modes are kept. [Hz]
    error : float
        Largest relative error of the frequencies by the modes left out. [-]
    """

    name: str
    elements: int
    order: int
    modes: int
    residuals: int
    first_mode: float
    limit: float
    error: float

    @property
    def reason(self):
        """Why it keeps these modes: one sentence."""
        if not self.elements:
            return "without mass: stiffness only"
        if not self.modes + self.residuals:
            first = f"its first one, at {self.first_mode:.4g} Hz,"
            return f"no modes: {first} changes no frequency by more than {self.error:.1e}"
        count = "1 mode" if self.modes == 1 else f"{self.modes} modes"
        if not np.isfinite(self.limit):
            whole = self.modes == 3 * (self.elements * self.order - 1)
            which = f"all {count}" if whole else f"{count} and vectors for those above"
            return f"{which} of {self.elements} elements of order {self.order}"
        return (
            f"{count} below {self.limit:.4g} Hz and {self.residuals} vectors for those above: "
            f"what is left out changes no frequency by more than {self.error:.1e}"
        )


class Trial:
    """The lowest modes of n rows with one choice of the coordinates of their cables, c of each row.

    Parameters
    ----------
    layout : Layout
        Of these rows; or of one, without an axis of rows.
    coordinates : Coordinates
        Of the cables of one row after the other.
    count : int
        How many modes, k.

    Attributes
    ----------
    omega : ndarray, shape (n, k)
        Infinite where there are fewer modes, not a number where the equilibrium is not stable. [rad/s]
    """

    def __init__(self, layout, coordinates, count):
        self.layout, self.coordinates, models = layout, coordinates, coordinates.models
        self.rows = int(np.prod(layout.shape))
        row = coordinates.cable // (models.cables.count // self.rows)
        self._begin = np.searchsorted(row, np.arange(self.rows + 1))
        self._ends = layout.without_modes(*(part.reshape(*layout.shape, -1, 6, 6) for part in models.ends))
        self._driven = layout.momentum(coordinates.coupling, coordinates.cable)
        self.omega = np.full((self.rows, count), np.inf)
        self._modal, self._bodies = np.zeros((len(row), count)), np.zeros((self.rows, len(layout.free), count))
        for rows, index, system in self._systems(row):
            omega, shapes = system.lowest(count)
            found, modal = omega.shape[-1], index.shape[-1]
            self.omega[rows, :found] = omega
            self._modal[index, :found] = shapes[..., :modal, :]
            self._bodies[rows, :, :found] = shapes[..., modal:, :]

    def take_modes(self, chosen):
        """Some of its modes, chosen by an array of bool."""
        other = copy(self)
        other.omega, other._modal, other._bodies = (
            self.omega[:, chosen],
            self._modal[:, chosen],
            self._bodies[..., chosen],
        )
        return other

    def _systems(self, row):
        """Yield rows, the numbers of their coordinates of cables, and their `ReducedSystem`: of equal size together."""
        if not self.layout.shape:
            yield 0, np.arange(len(row)), self.reduced(0)
            return
        inertia = np.diagonal(self._ends.inertia, axis1=-2, axis2=-1)
        moving = np.bincount(row, coupled(self._driven, inertia[row]), self.rows)
        sizes, kind = np.unique(np.stack([np.diff(self._begin), moving], axis=1), axis=0, return_inverse=True)
        for number, (size, _) in enumerate(sizes.astype(int).tolist()):
            rows = np.flatnonzero(kind.ravel() == number)
            index = self._begin[rows, None] + np.arange(size)
            cables = self.coordinates.omega[index], self._driven[index]
            yield rows, index, ReducedSystem(*cables, self._ends.inertia[rows], self._ends.stiffness[rows])

    def reduced(self, row):
        """`ReducedSystem` of one row."""
        own, matrices = slice(*self._begin[row : row + 2]), (self._ends.inertia, self._ends.stiffness)
        matrices = [part[row] for part in matrices] if self.layout.shape else matrices
        return ReducedSystem(self.coordinates.omega[own], self._driven[own], *matrices)

    @cached_property
    def _moving_ends(self):
        """Squared frequencies and displacements of the ends of all cables, shapes (n c, k) and (n c, 6, k)."""
        square = np.where(np.isfinite(self.omega), self.omega, 0.0) ** 2
        ends = self.layout.ends(self._bodies.reshape(*self.layout.shape, *self._bodies.shape[1:]))
        ends = ends.reshape(-1, 6, square.shape[1])
        return np.repeat(square, len(ends) // self.rows, axis=0), ends

    @cached_property
    def omitted(self):
        """Relative error of the squared frequencies by what the coordinates of each cable leave out.

        Shape (n, c, k). [-]
        """
        omitted = self.coordinates.models.omitted(self.coordinates, *self._moving_ends)
        return omitted.reshape(self.rows, -1, self.omega.shape[1])

    @cached_property
    def unresolved(self):
        """Relative error of the squared frequencies by the mesh of each cable, shape (n, c, k). [-]"""
        amplitudes = self.coordinates.amplitudes(self._modal)
        return self.coordinates.models.unresolved(amplitudes, *self._moving_ends).reshape(self.omitted.shape)

    @cached_property
    def error(self):
        """Estimated relative error of each frequency, shape (n, k). [-]"""
        return np.maximum((np.abs(self.omitted) + self.unresolved).sum(axis=1) / 2, SYSTEM.frequency_rounding)

    def solution(self, row):
        """`Solution` of one row.

        Raises
        ------
        NoSolutionError
            Its equilibrium is not stable.
        """
        model, omega = RowModel(self, row), self.omega[row]
        if np.isnan(omega).any():
            reason = model.layout.equilibrium.stability.reason() or "its stiffness is next to nothing"
            raise NoSolutionError(f"no modes about this equilibrium: {reason}")
        found = slice(np.count_nonzero(np.isfinite(omega)))
        shapes = np.concatenate([self._modal[slice(*self._begin[row : row + 2])], self._bodies[row]])
        return Solution(model, omega[found], shapes[:, found], self.omitted[row, :, found])


class RowModel:
    """Coordinates and matrices of one row of a `Trial`, each made when it is needed.

    Parameters
    ----------
    trial : Trial
    row : int
    """

    def __init__(self, trial, row):
        self._trial, self._row = trial, row

    @cached_property
    def layout(self):
        """`Layout`."""
        layout = self._trial.layout
        return layout.take(self._row) if layout.shape else layout

    @cached_property
    def coordinates(self):
        """`Coordinates` of the cables."""
        coordinates = self._trial.coordinates
        if not self._trial.layout.shape:
            return coordinates
        each = coordinates.models.cables.count // self._trial.rows
        return coordinates.take(each * self._row + np.arange(each))

    @cached_property
    def reduced(self):
        """`ReducedSystem`."""
        return self._trial.reduced(self._row)

    @cached_property
    def kept(self):
        """Coordinates of each cable: list of Kept."""
        return self.coordinates.kept

    @cached_property
    def system(self):
        """The `LinearSystem`."""
        return self.layout.system([one.element for one in self.kept])


@dataclass(frozen=True)
class Solution:
    """Modes of one row with one choice of models and coordinates.

    Attributes
    ----------
    model : RowModel
    omega : ndarray, shape (k,)
        [rad/s]
    shapes : ndarray, shape (n, k)
        Mass-normalised.
    omitted : ndarray, shape (c, k)
        See `Trial`. [-]
    more : Solution or None
        With all modes that were computed, of which these are the lowest; None where these are all.
    """

    model: RowModel
    omega: np.ndarray
    shapes: np.ndarray
    omitted: np.ndarray
    more: "Solution | None" = None

    @property
    def every(self):
        """The `Solution` with all modes that were computed."""
        return self.more or self

    @property
    def layout(self):
        """`Layout`."""
        return self.model.layout

    @property
    def coordinates(self):
        """`Coordinates` of the cables."""
        return self.model.coordinates

    @property
    def reduced(self):
        """`ReducedSystem`."""
        return self.model.reduced

    @property
    def models(self):
        """`Models` of the cables."""
        return self.coordinates.models

    @property
    def kept(self):
        """Coordinates of each cable: list of Kept."""
        return self.model.kept

    @property
    def system(self):
        """The `LinearSystem`."""
        return self.model.system


@dataclass(frozen=True)
class CoupledModes:
    """The lowest modes of a suspension.

    Attributes
    ----------
    frequency : ndarray, shape (k,)
        Undamped. [Hz]
    error : ndarray, shape (k,)
        Estimated relative error of each; not a number for an exact choice of elements. [-]
    coincident : tuple of (int, int)
        First and last number (from 1) of each run of modes whose frequencies agree within their errors: their motions
        may be combined at will.
    solution : Solution
        Models and coordinates of the cables, and the system.
    shapes : ndarray, shape (n, k)
        In the coordinates of the system, mass-normalised.
    finer : callable or None
        Computes modes of a finer model, more of them, for `damped`; None where these modes serve.
    """

    frequency: np.ndarray
    error: np.ndarray
    coincident: tuple
    solution: Solution
    shapes: np.ndarray
    finer: Callable | None = None

    def __len__(self):
        return len(self.frequency)

    @property
    def layout(self):
        """`Layout`."""
        return self.solution.layout

    @property
    def system(self):
        """The `LinearSystem`."""
        return self.solution.system

    def first(self, count):
        """The lowest of these modes, in the same model: themselves, or without a finer one."""
        if count >= len(self):
            return self
        some, runs = self.take(np.arange(count)), tuple(run for run in self.coincident if run[1] <= count)
        return replace(some, coincident=runs, solution=replace(some.solution, more=self.solution.every), finer=None)

    @cached_property
    def damping_ratio(self):
        """Of the pole of each mode, see `damping.damping_ratios`, shape (k,). [-]"""
        found = self.damped
        return damping_ratios(found.system, found.solution.omega, found.shapes)

    @cached_property
    def damped(self):
        """These modes, in their order, of a finer model with more modes of cables: for damping and state spaces.

        Where there is none (see `finer`), these modes themselves.
        """
        found = self.finer and self.finer()
        if not found or len(found) < len(self):
            return self
        return found.take(pair_modes(self, found))

    @cached_property
    def damping_error(self):
        """Estimated relative error of each damping ratio, shape (k,). [-]

        The difference to a coarser model with fewer modes that damping may couple. Not a number for an exact choice of
        elements, and for modal damping, whose effect on a mode that moves the ends of cables grows with their modes.
        """
        cables = self.solution.models.cables
        if cables.modal.any() or self.damped is self:
            return np.full(len(self), np.nan) if cables.heavy.any() else self.error
        ratio = self.damping_ratio
        other = damping_ratios(self.system, self.solution.omega, self.shapes, SYSTEM.coupled_modes // 2)
        for first, last in self.coincident:  # their poles come in any order
            run = slice(first - 1, last)
            other[run] = np.sort(other[run])[np.argsort(np.argsort(ratio[run]))]
        return np.abs(ratio - other) / np.where(ratio > SYSTEM.frequency_rounding, ratio, 1.0)

    def compliance_shares(self, body, axis):
        """Share of each mode in the static compliance of a free motion of a body, see `linear.compliance_shares`.

        Parameters
        ----------
        body, axis : int
            Among all bodies and junctions, and of AXES.

        Returns
        -------
        ndarray, shape (k,)
        """
        motion = int(np.flatnonzero(self.layout.free == 6 * body + axis)[0])
        moved = self.layout.bodies(self.shapes)[motion] / (2 * np.pi * self.frequency)
        return compliance_shares(moved, self.solution.reduced.compliance(motion))

    @cached_property
    def _nodes(self):
        """Places of the nodes of each cable from its end 1, and their displacements: list, see `Models.nodes`."""
        amplitudes = self.solution.coordinates.amplitudes(self.shapes)
        return self.solution.models.nodes(amplitudes, self.layout.ends(self.layout.bodies(self.shapes)))

    @cached_property
    def displacements(self):
        """Of the nodes of each cable in each mode, global axes: list of ndarray, shape (nodes, 3, k). [1/sqrt(kg)]"""
        return [moved for _, moved in self._nodes]

    def nodes(self, mode):
        """Places of the nodes of each cable from its end 1, and their displacements in one mode (from 0), global axes.

        Returns
        -------
        list of (ndarray, ndarray)
            Both of shape (nodes, 3). [m], [1/sqrt(kg)]
        """
        return [(place, moved[..., mode]) for place, moved in self._nodes]

    def take(self, chosen):
        """Some of these modes, by their numbers (from 0), in that order; of which coincide nothing is said."""
        found = self.solution
        some = replace(
            found, omega=found.omega[chosen], shapes=found.shapes[:, chosen], omitted=found.omitted[:, chosen]
        )
        return replace(
            self,
            frequency=self.frequency[chosen],
            error=self.error[chosen],
            coincident=(),
            solution=some,
            shapes=self.shapes[:, chosen],
        )

    def up_to(self, frequency):
        """The modes up to a frequency [Hz], numbers from 0."""
        return np.flatnonzero(self.frequency <= frequency)

    @cached_property
    def _energy(self):
        """Shares of bodies and cables in the kinetic energy: `body_energy` and `cable_energy`."""
        displaced = self.layout.bodies(self.shapes)
        bodies, amplitudes = self.layout.kinetic(displaced), self.solution.coordinates.amplitudes(self.shapes)
        cables = self.solution.models.kinetic(amplitudes, self.layout.ends(displaced))
        whole = bodies.sum(axis=(0, 1)) + cables.sum(axis=(0, 1))
        return bodies / whole, cables / whole

    @property
    def body_energy(self):
        """Shares in the kinetic energy, shape (b, 6, k): x y z of the center of mass, rotation about own axes. [-]"""
        return self._energy[0]

    @property
    def cable_energy(self):
        """Shares in the kinetic energy, shape (c, 3, k): in the plane of the cable, out of it, along the cable. [-]"""
        return self._energy[1]

    @cached_property
    def cables(self):
        """Mesh and modes that each cable was given: tuple of `CableRecord`."""
        return tuple(_record(self.solution, place, name) for place, name in enumerate(self._cable_names))

    @property
    def _cable_names(self):
        return self.layout.equilibrium.suspension.cable_names

    @property
    def body_share(self):
        """Share of the kinetic energy in bodies and junctions, shape (k,). [-]"""
        return self.body_energy.sum(axis=(0, 1))

    @cached_property
    def moves(self):
        """Name of what has the largest share of the kinetic energy in each mode, such as "gondola x" or "n1 in-plane".

        A body, the junctions together or the cables together; of these one by its name where it has more than half.
        """
        return tuple(self._moving(mode) for mode in range(len(self)))

    def _moving(self, mode):
        suspension, energy = self.layout.equilibrium.suspension, self.body_energy[..., mode]
        body_names, count = suspension.body_names, suspension.bodies
        groups = [*energy[:count].sum(axis=1), energy[count:].sum(), self.cable_energy[..., mode].sum()]
        largest = int(np.argmax(np.round(groups, 9)))
        if largest < count:
            return _largest(body_names[largest : largest + 1], AXES, energy[largest : largest + 1], None)
        if largest == count:
            return _largest(body_names[count:], AXES, energy[count:], "points")
        return _largest(self._cable_names, KINDS, self.cable_energy[..., mode], "cables")


def _record(solution, place, name):
    """`CableRecord` of one cable."""
    mesh, kept = solution.models.meshes[place], solution.kept[place]
    return CableRecord(
        name=name,
        elements=mesh.elements if mesh else 0,
        order=mesh.order if mesh else 0,
        modes=kept.modes,
        residuals=kept.residuals,
        first_mode=float(solution.models.first[place]) / (2 * np.pi),
        limit=float(solution.coordinates.limits[place]) / (2 * np.pi),
        error=float(np.abs(solution.omitted[place]).max(initial=0.0)) / 2,
    )


def _largest(names, kinds, energy, all_of_them):
    """Name and kind of the largest part, or a word for all where no name has more than half of the energy."""
    each = energy.sum(axis=1)
    place = int(np.argmax(each))
    if each[place] <= 0.5 * each.sum():
        return all_of_them
    return f"{names[place]} {kinds[int(np.argmax(np.round(energy[place], 9)))]}"
