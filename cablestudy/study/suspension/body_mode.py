"""The coupled mode of a body along one of its coordinates: that with the largest share in its static compliance."""

from dataclasses import dataclass

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.columns import relative
from cablestudy.study.tolerances import STUDY
from cablestudy.system.cable_coordinates import Kept
from cablestudy.system.coupled_solution import CoupledModes
from cablestudy.system.damped_pole import damped_pole
from cablestudy.system.damping import damped_poles
from cablestudy.system.suspension import AXES
from cablestudy.system.tolerances import SYSTEM


@dataclass(frozen=True)
class BodyMode:
    """One of some coupled modes.

    Attributes
    ----------
    modes : CoupledModes
    number : int
        Of the mode among them, from 0.
    body, axis : int
        Among all bodies and junctions, and of `system.suspension.AXES`.
    """

    modes: CoupledModes
    number: int
    body: int
    axis: int

    @classmethod
    def search(cls, modes_of, name, body, axis):
        """The mode with the largest share, computing modes from the lowest until those left out cannot have a larger.

        Parameters
        ----------
        modes_of : callable
            Number of modes -> `CoupledModes`, at least so many of the lowest, or all where there are fewer.
        name : str
            Of the body, for messages.
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
            share = modes.compliance_shares(body, axis)
            number = largest_share(share)
            if share[number] >= 1 - share.sum() or len(modes) < count:
                return cls(modes, number, body, axis)
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

    @property
    def shares(self):
        """Share of each of the modes in the static compliance, shape (k,). [-]"""
        return self.modes.compliance_shares(self.body, self.axis)

    @property
    def share(self):
        """Share in the static compliance, by a finer model, and its estimated relative error: the change to that. [-]

        The error is not a number for an exact choice of elements.
        """
        fine = self.modes.damped
        found = fine.compliance_shares(self.body, self.axis)[self._number_in(fine)]
        error = max(STUDY.rounding, abs(found - self.shares[self.number]) / found)
        return float(found), np.nan if np.isnan(self.modes.error[self.number]) else float(error)

    def damping_ratio(self, airflow=None):
        """Damping ratio of the pole of this mode, and its estimated relative error. [-]

        The pole is that with all modes of the cables. A mode that does not oscillate has the ratio 1, and a ratio of no
        more than rounding is zero. The error is the change from coarser meshes. It is not a number where the scene
        fixes the elements, for modal damping, which grows with the number of modes, and without oscillation.

        Parameters
        ----------
        airflow : Airflow, optional
            Adds its aerodynamic damping.

        Returns
        -------
        ratio, error : float

        Raises
        ------
        ConvergenceError
            Its pole is not found.
        """
        fine, exact = self.modes.damped, np.isnan(self.modes.error[self.number])
        models, search = fine.solution.models, _PoleSearch(fine, self._number_in(fine), airflow)
        pole = search.pole(*((models, fine.solution.kept) if exact else _with_all_modes(models)))
        found = _ratio(pole)
        if exact or found == 1:
            return found, np.nan
        if not found:
            return found, STUDY.rounding
        coarse = search.pole_near(
            pole, STUDY.known_pole_distance, *_with_all_modes(models, coarser=SYSTEM.finer_orders)
        )
        error = max(STUDY.rounding, STUDY.coarser_mesh_safety * relative(_ratio(coarse), found))
        return found, np.nan if models.cables.modal.any() else error

    def _number_in(self, modes):
        """Number of this mode among those of a finer model, where modes that coincide may come in another order."""
        run = next((run for run in self.modes.coincident if run[0] <= self.number + 1 <= run[1]), None)
        if run is None:
            return self.number
        return run[0] - 1 + largest_share(modes.compliance_shares(self.body, self.axis)[run[0] - 1 : run[1]])


def to_accuracy(number_of, modes, accuracy):
    """The first number of some modes whose error is within an accuracy, or the last one, with its error.

    Parameters
    ----------
    number_of : callable
        `BodyMode` -> number and its estimated relative error, not a number for an exact choice of elements.
    modes : iterable of BodyMode
        Of ever higher accuracies, each computed when it is needed.
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
    return int(np.argmax(share >= share.max() * (1 - STUDY.equal_shares)))


def _ratio(pole):
    """Damping ratio of a pole. [-]"""
    ratio = float(-pole.real / abs(pole))
    return ratio if ratio > STUDY.undamped_rounding else 0.0


@dataclass(frozen=True)
class _PoleSearch:
    """The search for the damped pole of one of some coupled modes.

    Attributes
    ----------
    modes : CoupledModes
    number : int
        From 0.
    airflow : Airflow or None
    """

    modes: CoupledModes
    number: int
    airflow: object

    def pole(self, models, kept):
        """The pole with what is `Kept` of the cables of some `Models`; -w where the mode does not oscillate. [rad/s]

        Of little damping it is looked for from the losses of the undamped shape on, else from the pole of the model.
        """
        omega, shapes = self.modes.solution.omega[: self.number + 1], self.modes.shapes[:, : self.number + 1]
        system = self.modes.system if self.airflow is None else self.airflow.damped_system(self.modes)
        shape, parts = shapes[:, -1], (system.damping, system.stiffness.imag)
        viscous, lost = (float(shape @ (part @ shape)) for part in parts)
        ratio = (viscous + lost / omega[-1]) / (2 * omega[-1])
        if not ratio:
            return 1j * omega[-1]
        if ratio < STUDY.light_damping:
            try:
                return self.pole_near(omega[-1] * (1j - ratio), STUDY.pole_distance * ratio, models, kept)
            except ConvergenceError:  # another mode is near
                pass
        near = damped_poles(system, omega, shapes)[0][-1]
        return -omega[-1] + 0j if np.isnan(near) else self.pole_near(near, STUDY.known_pole_distance, models, kept)

    def pole_near(self, near, far, models, kept):
        """`damped_pole` no farther from a place than some share of its size, other arguments as of `pole`."""
        layout, damping = self.modes.layout, 0.0
        if self.airflow is not None:
            kept = self.airflow.damped(models, kept, layout.equilibrium)
            damping = self.airflow.damping_of_bodies(layout, np.eye(len(layout.free)))
        moved = layout.bodies(self.modes.shapes[:, [self.number]])[:, 0]
        return damped_pole(layout, [one.element for one in kept], near, moved, damping, far)


def _with_all_modes(models, coarser=0):
    """Some `Models`, or coarser ones, of an order less by so many, and all modes of their cables: list of Kept."""
    models = models.with_all_modes(STUDY.damped_pole_freedoms, coarser)
    return models, [Kept(one, len(one.omega), np.eye(len(one.omega))) for one in models.elements]
