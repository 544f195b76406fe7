"""The coupled mode of a body along a coordinate: the mode with the largest share in the static compliance there.

Modes that coincide may be combined at will, and have one share together.
"""

from dataclasses import dataclass
from functools import cached_property, partial
from itertools import chain

import numpy as np

from cablestudy.errors import NoSolutionError, outcome_of
from cablestudy.motion.body_damping import damping_ratios
from cablestudy.motion.tolerances import MOTION
from cablestudy.statics.suspension import AXES
from cablestudy.system.comparison import first_of_largest
from cablestudy.system.coupled_solution import CoupledModes
from cablestudy.system.together import computed_together


class RefinedMode:
    """Mode of a body along one of its coordinates, and its numbers to the accuracy of a scene by ever finer models.

    It is the mode with the largest share of the body's static compliance along the coordinate, see `BodyMode`. Each
    number comes with its estimated relative error, which is NaN where the scene states the elements of the
    cables.

    Parameters
    ----------
    first : callable
        Returns the `BodyMode` of the models that other numbers have too; raises NoSolutionError, ConvergenceError.
    with_accuracy : callable
        Factor -> `BodyMode` with the accuracy of the scene times this factor; raises likewise.
    accuracy : float or None
        Relative accuracy that the scene asks for; None for stated elements. [-]
    airflow : callable
        Returns the `Airflow` whose aerodynamic damping counts, or None.
    together : callable
        Returns the modes of many rows whose damping ratios are computed in one call: list of RefinedMode.
    rounding : float
        Relative error due to rounding, at least. [-]
    """

    def __init__(self, first, with_accuracy, accuracy, airflow, together, rounding=0.0):
        self._first, self._with_accuracy, self.accuracy, self._rounding = first, with_accuracy, accuracy, rounding
        self._airflow, self._rows = airflow, together

    @property
    def mode(self):
        """`BodyMode` of the first model by which it is certain which mode this is (`BodyMode.certain`).

        Of the finest where none is. Raises as `first`.
        """
        return self._mode_and_accuracies[0]

    @cached_property
    def _mode_and_accuracies(self):
        """`mode`, and how many of the accuracies `MOTION.accuracy_factors` were tried for it: tuple."""
        mode, tried = self._first(), 1
        while self.accuracy is not None and tried < len(MOTION.accuracy_factors) and not mode.certain:
            finer = outcome_of(partial(self._with_accuracy, MOTION.accuracy_factors[tried]))
            if isinstance(finer, Exception):
                break
            mode, tried = finer, tried + 1
        return mode, tried

    @property
    def frequency(self):
        """Undamped frequency. [Hz]"""
        value, error = self.mode.frequency
        return value, np.maximum(error, self._rounding)

    @cached_property
    def share(self):
        """Share of the static compliance of the body along the coordinate. [-]"""
        for mode in self._models(compared=True):
            value, error = mode.share
            if np.isnan(error) or error <= self.accuracy:
                break
        return value, np.maximum(error, self._rounding)

    def error_by_mixing(self, error):
        """Relative error of the share by a relative error of all frequencies that the models do not include. [-]"""
        return self.mode.error_by_mixing(error)

    @property
    def damping_ratio(self):
        """Damping ratio of its pole, the winches at rest: 1 without oscillation. [-]"""
        return self.damping.value, np.maximum(self.damping.error, self._rounding)

    @property
    def together(self):
        """Modes of all rows whose damping ratios are computed in one call: list of RefinedMode."""
        return self._rows()

    @computed_together
    def damping(modes):
        """`DampingRatio`; raises as `body_damping.damping_ratios` says."""
        return zip(modes, damping_ratios(modes), strict=True)

    def damped_models(self):
        """Yield pairs of the `BodyMode` of one model and the `Airflow` that damps it, of ever finer models."""
        for mode in self._models():
            yield mode, self._airflow()

    def _models(self, compared=False):
        """Yield `BodyMode`s of ever finer models; with `compared` only those that a finer mesh was compared with."""
        mode, tried = self._mode_and_accuracies
        if self.accuracy is None:
            return iter([mode])
        again = compared and not mode.compared
        factors = MOTION.accuracy_factors[tried - 1 if again else tried :]
        return chain([] if again else [mode], map(self._with_accuracy, factors))


@dataclass(frozen=True)
class BodyMode:
    """The mode with the largest share in the static compliance of a body along one of its coordinates.

    The static compliance is the displacement by a unit force; the share of a mass-normalised mode of frequency w and
    displacement z there is z^2/w^2 over this compliance. The shares of all modes add up to one.

    Attributes
    ----------
    modes : CoupledModes
        The lowest modes of the suspension.
    body, axis : int
        Number of the body among all bodies and junctions, and of the coordinate among `statics.suspension.AXES`.
    """

    modes: CoupledModes
    body: int
    axis: int

    @classmethod
    def search(cls, modes_of, name, body, axis):
        """Find the mode with the largest share, among as many of the lowest modes as it takes to be certain.

        More and more modes are computed. As the shares of all modes add up to one, the search ends when all modes that
        are not computed have together no larger a share than the mode found; modes whose frequencies agree within their
        errors count as one. It ends, too, when all modes are computed.

        Parameters
        ----------
        modes_of : callable
            Number of modes -> `CoupledModes`, at least so many of the lowest, or all where there are fewer.
        name : str
            Name of the body, for messages.
        body, axis : int
            Number of the body among all bodies and junctions, and of the coordinate among `statics.suspension.AXES`.

        Returns
        -------
        BodyMode

        Raises
        ------
        NoSolutionError
            The lowest `MOTION.most_body_modes` modes leave more of the static compliance than any of them has; or there
            are no modes.
        """
        count = MOTION.first_body_modes
        while True:
            modes = modes_of(count)
            if not len(modes):
                raise NoSolutionError("the model has 0 modes")
            mode = cls(modes, body, axis)
            total = mode.shares.sum()
            if mode.share_with_coincident >= 1 - total or len(modes) < count:
                return mode
            if count >= MOTION.most_body_modes:
                raise NoSolutionError(
                    f"the lowest {len(modes)} modes have {total:.2g} of the static compliance of {name} along "
                    f"{AXES[axis]}: none of them has the largest share for certain"
                )
            count = min(2 * count, MOTION.most_body_modes)

    @property
    def frequency(self):
        """Undamped frequency [Hz] and its estimated relative error, NaN for stated elements."""
        return float(self.modes.frequency[self.number]), float(self.modes.error[self.number])

    @cached_property
    def number(self):
        """Number of the mode among the `modes`, from 0; of modes that coincide that with the largest share."""
        run = self.modes.run_of(largest_share(self.modes.over_coincident(self.shares)))
        return run.start + largest_share(self.shares[run])

    @cached_property
    def shares(self):
        """Share of each of the modes in the static compliance, shape (k,). [-]"""
        return self.modes.compliance_shares(self.body, self.axis)

    @property
    def share_with_coincident(self):
        """Share of the mode in the static compliance, with those that coincide with it. [-]"""
        return self.shares[self.modes.run_of(self.number)].sum()

    @property
    def share(self):
        """Share in the static compliance, by a finer model, and its estimated relative error. [-]

        The error is the change to the finer model, or what the errors of the frequencies of that allow
        (`error_by_mixing`) where this is larger; NaN for stated elements.
        """
        fine, run = self.damped[0], self.modes.run_of(self.number)
        share = fine.compliance_shares(self.body, self.axis)[run].sum()
        if self.exact:
            return float(share), np.nan
        by_mixing = self.error_by_mixing()
        return float(share), float(max(MOTION.rounding, abs(share - self.share_with_coincident) / share, by_mixing))

    def error_by_mixing(self, error=None):
        """Relative error of the share by the errors of the frequencies of all modes. [-]

        `error` is one of all of them that takes the place of those of the modes. [-]
        """
        fine, number = self.damped
        errors = fine.error if error is None else np.full(len(fine), error)
        return self._error_by_mixing(fine, self.modes.run_of(self.number), number, errors)

    def _error_by_mixing(self, modes, run, number, errors):
        """Relative error of the share of a mode, by its number and the slice `run` of those that coincide with it. [-]

        By relative errors of the frequencies of all of these `CoupledModes`, shape (k,).
        """
        shares = modes.compliance_shares(self.body, self.axis)
        share = shares[run].sum()
        shares[run], shares[number] = 0.0, share
        # modes above those computed count as one, at the frequency of the highest, with the error of this mode
        rest, above = max(1 - shares.sum(), 0.0), max(modes.frequency[-1], MOTION.next_mode * modes.frequency[number])
        every = np.append(shares, rest), np.append(modes.frequency, above), np.append(errors, errors[number])
        return error_by_mixing(number, *every)

    @cached_property
    def certain(self):
        """True if no errors of the frequencies could give another mode the larger share; True for stated elements."""
        if self.exact:
            return True
        run, shares = self.modes.run_of(self.number), self.modes.over_coincident(self.shares)
        others = np.flatnonzero(shares > MOTION.contending_share * self.share_with_coincident)
        others = [other for other in others.tolist() if not run.start <= other < run.stop]
        if not others:
            return True

        def error_of(number):
            return self._error_by_mixing(self.modes, self.modes.run_of(number), number, self.modes.error)

        least = shares[self.number] * (1 - error_of(self.number))
        return all(shares[other] * (1 + error_of(other)) < least for other in others)

    @property
    def exact(self):
        """True for stated elements."""
        return bool(np.isnan(self.modes.error[self.number]))

    @property
    def compared(self):
        """True if the modes for damping are of a finer model."""
        return self.modes.damped is not self.modes

    @cached_property
    def damped(self):
        """`CoupledModes` for damping, and the number of this mode among them, from 0."""
        fine, run = self.modes.damped, self.modes.run_of(self.number)  # those that coincide may come in another order
        return fine, run.start + largest_share(fine.compliance_shares(self.body, self.axis)[run])


def largest_share(share):
    """Number of the mode with the largest share, shape (m,), the lowest of equal ones."""
    return first_of_largest(share, MOTION.equal_shares)


def error_by_mixing(number, shares, frequency, error):
    """Bound the relative error of the share of mode k in a static compliance, by frequency errors of all modes.

    A model that is too stiff gets the eigenvalues l = w^2 too large, and mixes the modes. With e the relative errors of
    frequencies, the error of the stiffness is a positive semidefinite matrix with 2 e l on the diagonal. Its other
    entries are at most the geometric means of these. To first order it adds to mode k each mode j with a factor of at
    most

        2 sqrt(e_j l_j e_k l_k)/|l_j - l_k|.

    Inertia that the model leaves out adds at most 2 sqrt(e_j e_k) l_k/|l_j - l_k|, which is more for modes below k.
    With a_j = sqrt(share_j l_j) and f_j the larger of both factors, the bound is

        2 sum of (a_j f_j)/a_k + 4 e_k,

    the last term being the change of the eigenvalue itself, 2 e_k, and as much again for the inertia. Modes that
    coincide with k are not in the sum.

    Parameters
    ----------
    number : int
        k, from 0.
    shares, frequency, error : ndarray, shape (m,)
        Share [-], frequency in any unit, and its relative error e [-] of each mode.

    Returns
    -------
    float
        [-]
    """
    eigenvalues = frequency**2
    amplitudes, own = np.sqrt(shares * eigenvalues), eigenvalues[number]
    added = np.sqrt(error * np.maximum(eigenvalues, own))
    gap = np.abs(eigenvalues - own)
    apart = gap > MOTION.equal_shares * own
    factors = 2 * added[number] * added[apart] / gap[apart]
    by_modes = (amplitudes[apart] * factors).sum() / amplitudes[number]
    return float(2 * by_modes + 4 * error[number])
