"""The coupled mode of a body along a coordinate: the mode with the largest share in the static compliance there."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.column import first_of_largest, relative
from cablestudy.study.tolerances import STUDY
from cablestudy.system.cable_coordinates import Kept
from cablestudy.system.coupled_solution import CoupledModes
from cablestudy.system.damped_pole import damped_pole
from cablestudy.system.damping import damped_poles
from cablestudy.system.suspension import AXES
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class BodyMode:
    """The mode with the largest share in the static compliance of a body along one of its coordinates.

    Attributes
    ----------
    modes : CoupledModes
        The lowest modes of the suspension.
    body, axis : int
        Number of the body among all bodies and junctions, and of the coordinate among `system.suspension.AXES`.
    """

    modes: CoupledModes
    body: int
    axis: int

    @classmethod
    def search(cls, modes_of, name, body, axis):
        """Find the mode: more of the lowest modes are computed until those left out together have less than its share.

        Parameters
        ----------
        modes_of : callable
            Number of modes -> `CoupledModes`, at least so many of the lowest, or all where there are fewer.
        name : str
            Name of the body, for messages.
        body, axis : int

        Raises
        ------
        NoSolutionError
            The lowest `most_body_modes` modes leave more of the static compliance than any of them has.
        """
        count = STUDY.first_body_modes
        while True:
            modes = modes_of(count)
            if not len(modes):
                raise NoSolutionError("the model has 0 modes")
            mode = cls(modes, body, axis)
            share = mode.shares
            if share[mode.number] >= 1 - share.sum() or len(modes) < count:
                return mode
            if count >= STUDY.most_body_modes:
                raise NoSolutionError(
                    f"the lowest {len(modes)} modes have {share.sum():.2g} of the static compliance of {name} along "
                    f"{AXES[axis]}: none of them has the largest share for certain"
                )
            count = min(2 * count, STUDY.most_body_modes)

    @property
    def frequency(self):
        """Undamped frequency [Hz] and its estimated relative error, not a number for an exact choice of elements."""
        return float(self.modes.frequency[self.number]), float(self.modes.error[self.number])

    @cached_property
    def number(self):
        """Number of the mode among the `modes`, from 0."""
        return largest_share(self.shares)

    @cached_property
    def shares(self):
        """Share of each of the modes in the static compliance, shape (k,). [-]"""
        return self.modes.compliance_shares(self.body, self.axis)

    @property
    def share(self):
        """Share in the static compliance, by a finer model, and its estimated relative error. [-]

        The error is the change to the finer model, or what the errors of the frequencies of that allow
        (`_error_by_mixing`) where this is larger; not a number for an exact choice of elements.
        """
        fine = self.modes.damped
        number, shares = self._number_in(fine), fine.compliance_shares(self.body, self.axis)
        share = shares[number]
        if np.isnan(self.modes.error[self.number]):
            return float(share), np.nan
        by_mixing = _error_by_mixing(number, shares, fine.frequency, fine.error)
        return float(share), float(max(STUDY.rounding, abs(share - self.shares[self.number]) / share, by_mixing))

    def damping_ratio(self, airflow=None):
        """Damping ratio of the pole of this mode, and its estimated relative error. [-]

        All modes of the cables are in the model of the pole; with an exact choice of elements, those of the coupled
        modes. A mode that does not oscillate has the ratio 1, and a ratio of no more than rounding is zero. The error
        is the change from coarser meshes; it is not a number for an exact choice of elements, for modal damping, which
        grows with the number of modes, and without oscillation.

        Parameters
        ----------
        airflow : Airflow, optional
            Its aerodynamic damping is added.

        Returns
        -------
        ratio, error : float

        Raises
        ------
        ConvergenceError
            The pole is not found.
        """
        fine, exact = self.modes.damped, np.isnan(self.modes.error[self.number])
        models, search = fine.solution.models, _PoleSearch(fine, self._number_in(fine), airflow)
        models_and_kept = (models, fine.solution.kept) if exact else _with_all_modes(models)
        pole = search.pole(*models_and_kept)
        ratio = _ratio(pole)
        if exact or ratio == 1:
            return ratio, np.nan
        if not ratio:
            return ratio, STUDY.rounding
        coarse_models = _with_all_modes(models, coarser=SYSTEM.finer_orders)
        coarse_pole = search.pole_near(pole, STUDY.known_pole_distance, *coarse_models)
        error = max(STUDY.rounding, STUDY.coarser_mesh_safety * relative(_ratio(coarse_pole), ratio))
        return ratio, np.nan if models.cables.modal.any() else error

    def _number_in(self, modes):
        """Number of this mode among those of a finer model, where modes that coincide may come in another order."""
        number = self.number + 1  # runs count from 1
        run = next(((first, last) for first, last in self.modes.coincident if first <= number <= last), None)
        if run is None:
            return self.number
        first, last = run
        return first - 1 + largest_share(modes.compliance_shares(self.body, self.axis)[first - 1 : last])


def to_accuracy(number_of, modes, accuracy):
    """A number of a mode with its error: by the first of several models whose error is within an accuracy, or the last.

    Parameters
    ----------
    number_of : callable
        `BodyMode` -> number and its estimated relative error, not a number for an exact choice of elements.
    modes : iterable of BodyMode
        One mode of ever higher accuracies, each computed when it is needed.
    accuracy : float or None
        None for an exact choice of elements.
    """
    for mode in modes:
        value, error = number_of(mode)
        if np.isnan(error) or error <= accuracy:
            break
    return value, error


def largest_share(share):
    """Number of the mode with the largest share, shape (m,), the lowest of equal ones."""
    return first_of_largest(share, STUDY.equal_shares)


def _error_by_mixing(number, shares, frequency, error):
    """Relative error of the share of one mode by those of the frequencies of all modes, of a model too stiff. [-]

    With eigenvalues l and relative errors e of frequencies the model adds to the stiffness a positive semidefinite
    matrix with 2 e l on the diagonal, whose other entries are at most the geometric means of these. To first order it
    adds to a mode k the modes j with the factors of at most 2 sqrt(e_j l_j e_k l_k)/|l_j - l_k|. The eigenvalue itself
    changes by 2 e_k, and inertia that modes left out would add changes a share by at most as much again.

    Parameters
    ----------
    number : int
        Of the mode, from 0.
    shares, frequency, error : ndarray, shape (m,)
        Of the modes.
    """
    eigenvalues = frequency**2
    amplitudes, added = np.sqrt(shares * eigenvalues), np.sqrt(error * eigenvalues)
    gap = np.abs(eigenvalues - eigenvalues[number])
    apart = gap > STUDY.equal_shares * eigenvalues[number]  # modes that coincide are one pair, whose sum counts
    factors = 2 * added[number] * added[apart] / gap[apart]
    by_modes = (amplitudes[apart] * factors).sum() / amplitudes[number]
    return float(2 * by_modes + 4 * error[number])


def _ratio(pole):
    """Damping ratio of a pole. [-]"""
    ratio = float(-pole.real / abs(pole))
    return ratio if ratio > STUDY.undamped_rounding else 0.0


@dataclass(frozen=True)
class _PoleSearch:
    """The search for the damped pole of one coupled mode.

    Attributes
    ----------
    modes : CoupledModes
        Modes of the suspension, with damping.
    number : int
        Number of the mode among them, from 0.
    airflow : Airflow or None
        Its aerodynamic damping is added.
    """

    modes: CoupledModes
    number: int
    airflow: object

    def pole(self, models, kept):
        """The pole, with the modes of the cables that are `kept` (a `Kept` of each cable) of `Models`. [rad/s]

        The search begins, with light damping, at the pole of the undamped shape alone, s^2 + c s + w^2 + i h = 0 with
        the viscous and hysteretic damping c and h of this shape, else at the pole of the model of the coupled modes.
        The result is -w, w the undamped frequency, where the mode does not oscillate.
        """
        omega, shapes = self.modes.solution.omega[: self.number + 1], self.modes.shapes[:, : self.number + 1]
        system = self.modes.system if self.airflow is None else self.airflow.damped_system(self.modes)
        shape, matrices = shapes[:, -1], (system.damping, system.stiffness.imag)
        viscous, hysteretic = (float(shape @ (matrix @ shape)) for matrix in matrices)
        alone = 1j * np.sqrt(omega[-1] ** 2 + 1j * hysteretic - viscous**2 / 4) - viscous / 2
        ratio = -alone.real / abs(alone)
        if not ratio:
            return 1j * omega[-1]
        if ratio < STUDY.light_damping:
            try:
                return self.pole_near(alone, STUDY.pole_distance * ratio, models, kept)
            except ConvergenceError:  # another mode is near
                pass
        near = damped_poles(system, omega, shapes)[0][-1]
        return -omega[-1] + 0j if np.isnan(near) else self.pole_near(near, STUDY.known_pole_distance, models, kept)

    def pole_near(self, near, far, models, kept):
        """`damped_pole` within a relative distance `far` of the pole `near`; models and kept modes as for `pole`."""
        layout, damping = self.modes.layout, 0.0
        if self.airflow is not None:
            kept = self.airflow.damped(models, kept, layout.equilibrium)
            damping = self.airflow.damping_of_bodies(layout, np.eye(len(layout.free)))
        displacements = layout.bodies(self.modes.shapes[:, [self.number]])[:, 0]
        return damped_pole(layout, [cable.element for cable in kept], near, displacements, damping, far)


def _with_all_modes(models, coarser=0):
    """`Models` of an order that is lower by `coarser`, and a `Kept` of each cable with all of its modes: a pair."""
    models = models.with_all_modes(STUDY.damped_pole_freedoms, coarser)
    return models, [Kept(element, len(element.omega), np.eye(len(element.omega))) for element in models.elements]
