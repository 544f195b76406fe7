"""Undamped modes of suspensions with one choice of meshes and coordinates of their cables: one trial of a search."""

from copy import copy
from functools import cached_property

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.system.reduced import ReducedSystem, coupled
from cablestudy.system.tolerances import SYSTEM


class Trial:
    """The k lowest undamped modes of n suspensions, called rows, with one choice of coordinates of their c cables each.

    Parameters
    ----------
    layout : Layout
        Of these rows; or of one, without an axis of rows.
    coordinates : Coordinates
        Of the cables of one row after the other, N in all.
    count : int
        k.

    Attributes
    ----------
    omega : ndarray, shape (n, k)
        Infinite where there are fewer modes, NaN where the equilibrium is not stable. [rad/s]
    """

    def __init__(self, layout, coordinates, count):
        self.layout, self.coordinates, models = layout, coordinates, coordinates.models
        self.rows = int(np.prod(layout.shape))
        row = coordinates.cable // (models.cables.count // self.rows)  # of each coordinate
        self._begin = np.searchsorted(row, np.arange(self.rows + 1))  # first coordinate of each row
        self._without_modes = layout.without_modes(*(ends.reshape(*layout.shape, -1, 6, 6) for ends in models.ends))
        self._momentum = layout.momentum(coordinates.coupling, coordinates.cable)
        self.omega = np.full((self.rows, count), np.inf)
        self._cable_shapes = np.zeros((len(row), count))  # mass-normalised, in the coordinates of all cables,
        self._body_shapes = np.zeros((self.rows, len(layout.free), count))  # and in the free displacements of bodies
        for rows, index, system in self._systems(row):
            omega, shapes = system.lowest(count)
            modes, modal = omega.shape[-1], index.shape[-1]
            self.omega[rows, :modes] = omega
            self._cable_shapes[index, :modes] = shapes[..., :modal, :]
            self._body_shapes[rows, :, :modes] = shapes[..., modal:, :]

    def take_modes(self, chosen):
        """`Trial` with some of its modes, chosen by an array of bool."""
        taken = copy(self)
        taken.omega = self.omega[:, chosen]
        taken._cable_shapes, taken._body_shapes = self._cable_shapes[:, chosen], self._body_shapes[..., chosen]
        return taken

    def _systems(self, row):
        """Yield the undamped systems of all n rows (suspensions) in stacks of rows with matrices of equal sizes.

        Rows of one stack have equally many coordinates of cables, and equally many of these are coupled to bodies.
        `row` is the row of each of the N coordinates of all cables.

        Yields
        ------
        rows : ndarray of int, shape (m,), or 0
            Indices of the rows of a stack; 0 if there is one row only, without an axis of rows.
        index : ndarray of int, shape (m, size), or (size,)
            For each of these rows, indices of its cables' coordinates among all N.
        system : ReducedSystem
        """
        if not self.layout.shape:
            yield 0, np.arange(len(row)), self.reduced(0)
            return
        matrices = self._without_modes
        inertia = np.diagonal(matrices.inertia, axis1=-2, axis2=-1)
        coupled_count = np.bincount(row, coupled(self._momentum, inertia[row]), self.rows)
        sizes = np.stack([np.diff(self._begin), coupled_count], axis=1)
        sizes_of_stacks, stack_of_row = np.unique(sizes, axis=0, return_inverse=True)
        for stack, (size, _) in enumerate(sizes_of_stacks.astype(int).tolist()):
            rows = np.flatnonzero(stack_of_row.ravel() == stack)
            index = self._begin[rows, None] + np.arange(size)
            of_cables = self.coordinates.omega[index], self._momentum[index]
            yield rows, index, ReducedSystem(*of_cables, matrices.inertia[rows], matrices.stiffness[rows])

    def reduced(self, row):
        """`ReducedSystem` of one row."""
        index, matrices = slice(*self._begin[row : row + 2]), self._without_modes
        inertia, stiffness = matrices.inertia, matrices.stiffness
        if self.layout.shape:
            inertia, stiffness = inertia[row], stiffness[row]
        return ReducedSystem(self.coordinates.omega[index], self._momentum[index], inertia, stiffness)

    @cached_property
    def _moving_ends(self):
        """Squared frequencies and displacements of the ends of all cables, shapes (n c, k) and (n c, 6, k)."""
        square = np.where(np.isfinite(self.omega), self.omega, 0.0) ** 2
        ends = self.layout.ends(self._body_shapes.reshape(*self.layout.shape, *self._body_shapes.shape[1:]))
        ends = ends.reshape(-1, 6, square.shape[1])
        return np.repeat(square, len(ends) // self.rows, axis=0), ends

    def amplitudes(self, rows, shapes):
        """Amplitudes of all modes of the cables with fixed ends in one motion of each of some rows.

        Parameters
        ----------
        rows : sequence of int
        shapes : sequence of ndarray, shape (coordinates,)
            The motion of each of these rows, in the coordinates of its cables and bodies. Other rows are at rest.

        Returns
        -------
        list of ndarray, shape (g, n, 1)
            One for each group of cables on a mesh, see `Coordinates.amplitudes`.
        """
        by_cables = np.zeros((len(self.coordinates.omega), 1))
        for row, shape in zip(rows, shapes, strict=True):
            begin, end = self._begin[row : row + 2]
            by_cables[begin:end, 0] = shape[: end - begin]
        return self.coordinates.amplitudes(by_cables)

    @cached_property
    def truncation_error(self):
        """Relative error of the squared frequencies due to modes that each cable leaves out, shape (n, c, k). [-]"""
        error = self.coordinates.models.truncation_error(self.coordinates, *self._moving_ends)
        return error.reshape(self.rows, -1, self.omega.shape[1])

    @cached_property
    def mesh_error(self):
        """Relative error of the squared frequencies due to the mesh of each cable, shape (n, c, k). [-]"""
        amplitudes = self.coordinates.amplitudes(self._cable_shapes)
        return self.coordinates.models.mesh_error(amplitudes, *self._moving_ends).reshape(self.truncation_error.shape)

    @cached_property
    def error(self):
        """Estimated relative error of each frequency, shape (n, k). [-]"""
        return np.maximum((np.abs(self.truncation_error) + self.mesh_error).sum(axis=1) / 2, SYSTEM.frequency_rounding)

    @cached_property
    def rounding(self):
        """Relative error of each frequency by the rounding of the stiffness of the cables, shape (n, k). [-]

        In a soft mode forces of stiff cables nearly cancel, and what their rounding leaves is a share of

            sum over the cables of |u|^T |k| |u|/w^2,

        u being the displacements of the ends of a cable in the mass-normalised mode, k its static stiffness.
        """
        square, ends = self._moving_ends
        displacements, stiffness = np.abs(ends), np.abs(self.coordinates.models.ends[0])
        terms = (displacements * (stiffness @ displacements)).sum(axis=1) / np.where(square > 0, square, np.inf)
        return SYSTEM.stiffness_rounding * terms.reshape(self.rows, -1, self.omega.shape[1]).sum(axis=1)

    def modes_of(self, row):
        """Model and modes of finite frequency of one row.

        Parameters
        ----------
        row : int
            Index of the row.

        Returns
        -------
        model : RowModel
        omega : ndarray, shape (k,)
            Angular frequencies, ascending. [rad/s]
        shapes : ndarray, shape (coordinates, k)
            Mass-normalised, in the coordinates of all cables and then of the bodies.
        truncation_error : ndarray, shape (c, k)
            `truncation_error` of this row. [-]

        Raises
        ------
        NoSolutionError
            Its equilibrium is not stable.
        """
        model, omega = RowModel(self, row), self.omega[row]
        if np.isnan(omega).any():
            reason = model.layout.equilibrium.stability.reason() or "its stiffness is almost nothing"
            raise NoSolutionError(f"no modes about this equilibrium: {reason}")
        finite = slice(np.count_nonzero(np.isfinite(omega)))  # frequencies ascend
        begin, end = self._begin[row : row + 2]
        shapes = np.concatenate([self._cable_shapes[begin:end], self._body_shapes[row]])
        return model, omega[finite], shapes[:, finite], self.truncation_error[row, :, finite]


class RowModel:
    """Coordinates and matrices of one row of a `Trial`, each made when it is needed and then kept.

    Parameters
    ----------
    trial : Trial
    row : int
    """

    def __init__(self, trial, row):
        self.trial, self.row = trial, row

    @cached_property
    def layout(self):
        """`Layout`."""
        layout = self.trial.layout
        return layout.take(self.row) if layout.shape else layout

    @property
    def laws(self):
        """Law of damping of each of its cables, and whether viscous damping is added: tuple."""
        cables = self.trial.coordinates.models.cables
        count = cables.count // self.trial.rows
        damping = cables.damping[count * self.row : count * (self.row + 1)]
        return tuple((law.model, law.viscous > 0) for law in damping)

    @property
    def modal(self):
        """True if some cable has modal damping."""
        return bool(self.trial.coordinates.models.cables.modal.reshape(self.trial.rows, -1)[self.row].any())

    @property
    def complete(self):
        """True if all modes of its cables are computed."""
        return not self.trial.coordinates.models.large.reshape(self.trial.rows, -1)[self.row].any()

    @cached_property
    def coordinates(self):
        """`Coordinates` of the cables."""
        coordinates = self.trial.coordinates
        if not self.trial.layout.shape:
            return coordinates
        cables_of_row = coordinates.models.cables.count // self.trial.rows
        indices = cables_of_row * self.row + np.arange(cables_of_row)
        return coordinates.take(indices, self.layout.equilibrium.catenary)

    @cached_property
    def reduced(self):
        """`ReducedSystem`."""
        return self.trial.reduced(self.row)

    @cached_property
    def system(self):
        """The `LinearSystem`."""
        return self.layout.system([kept.element for kept in self.coordinates.kept])
