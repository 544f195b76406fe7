"""Integrals over frequency of the spectra of motions in gusts: one cable or many, with the loop closed or open.

A resonance that nothing damps has no finite variance: the integrals leave it out. `Integrals.undamped` finds those that
the gusts excite, for which the caller must report that the variance is infinite.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.wind.tolerances import WIND
from cablestudy.wind.variance import Panels, variances, variances_with_remainder

TURN = 2 * np.pi


@dataclass(frozen=True)
class Integrals:
    """Integrals over frequency of the spectra of outputs in gusts, each spectrum times one or several weights.

    Attributes
    ----------
    panels : Panels
        Intervals of frequency on which the spectrum of the gusts and the weights are resolved.
    gusts : Gusts
    weights : dict
        Name -> factor of the spectra at the frequencies of the panels, shape (n,).
    least_damping_ratio : float
        Damping ratio up to which a motion counts as not damped. [-]
    """

    panels: Panels
    gusts: object
    weights: dict
    least_damping_ratio: float = WIND.undamped

    @staticmethod
    def on(edges, gusts, weights, least_damping_ratio=WIND.undamped):
        """`Integrals` on panels between edges [Hz] with weights that are functions of frequency [Hz]."""
        panels = Panels(edges)
        values = {name: weight(panels.frequency) for name, weight in weights.items()}
        return Integrals(panels, gusts, values, least_damping_ratio)

    @cached_property
    def noise(self):
        """`Noise` of the gusts on the panels."""
        return self.gusts.noise(self.panels.frequency)

    def variances(self, response, names=None):
        """Variances of the outputs of a system in the gusts: integrals of their spectra times each weight.

        Poles with a damping ratio up to `least_damping_ratio` are left out, see `undamped`.

        Parameters
        ----------
        response : Residues or DelayedResponse
            Response of the o outputs of a stable system to the inputs of the gusts.
        names : sequence of str, optional
            Names of the w weights, by default all.

        Returns
        -------
        ndarray, shape (w, o)
            In squares of the units of the outputs.
        """
        weights = np.stack([self.weights[name] for name in names or self.weights])
        # a delay leaves a remainder, smooth over frequency, beside the sum over poles; without delay it is None
        sum_over_poles, remainder = response.split(TURN * self.panels.highest)
        sum_over_poles = sum_over_poles.take(damped(sum_over_poles, self.least_damping_ratio))
        if remainder is None:
            return variances(sum_over_poles, self.panels, self.noise, weights)
        excitation = self.gusts.matrix_times, self.panels, self.noise
        return variances_with_remainder(sum_over_poles, remainder, *excitation, weights)

    def undamped(self, response, variance, stiffness):
        """Find, for each output, the undamped motion that makes its variance infinite: the pole that moves it most.

        Motions that the gusts do not excite are left out: they leave the variance finite. A motion counts as excited
        if it would have a visible share of the energy with the damping ratio `least_damping_ratio`.

        Parameters
        ----------
        response : Residues or DelayedResponse
            As for `variances`.
        variance : ndarray, shape (o,)
            Variances of the outputs without undamped motions.
        stiffness : ndarray, shape (o,)
            Energy per square of each output, by which outputs are compared; 0 for one that does not matter.

        Returns
        -------
        ndarray, complex, shape (o,)
            Pole [rad/s]; 0 for an output that no excited undamped motion moves.
        """
        sum_over_poles, _ = response.split(TURN * self.panels.highest)
        least = self.least_damping_ratio
        undamped = sum_over_poles.take(~damped(sum_over_poles, least) & (sum_over_poles.poles != 0))
        if not len(undamped.poles):
            return np.zeros(len(variance), dtype=complex)
        omega, inputs = np.abs(undamped.poles), undamped.inputs
        force_spectrum = (inputs * self.gusts.matrix_times(omega / TURN, inputs[:, :, None].conj())[..., 0]).sum(axis=1)
        # of each pole (rows) in each output (columns), as if its damping ratio were the least
        variance_at_least_damping = (force_spectrum.real / (2 * least * omega))[:, None]
        energy = np.abs(undamped.outputs.T) ** 2 * stiffness * variance_at_least_damping
        total_energy = variance * stiffness
        rounding = WIND.still * max(energy.max(), total_energy.max())
        excited = energy > np.maximum(WIND.undamped_share * total_energy, rounding)
        return np.where(excited.any(axis=0), undamped.poles[np.argmax(energy, axis=0)], 0.0)


def damped(residues, least_damping_ratio=WIND.undamped):
    """True for the poles of a stable system with a damping ratio above the least, and a decay above rounding.

    With a complex stiffness the poles below the real axis grow: they are no resonances.
    """
    rate, size = np.abs(residues.poles.real), np.abs(residues.poles)
    oscillating = np.abs(residues.poles.imag) > least_damping_ratio * size
    return (rate > least_damping_ratio * size) & (~oscillating | (rate > WIND.decay_rounding * size.max(initial=0.0)))
