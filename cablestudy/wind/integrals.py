"""Integrals over frequency of the spectra of what gusts move: one cable or many, with the loop closed or open.

A resonance that nothing damps has no finite variance. Where the gusts do not excite it, it is left out.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.wind.tolerances import WIND
from cablestudy.wind.variance import Panels, mixed_variances, variances

TURN = 2 * np.pi


@dataclass(frozen=True)
class Integrals:
    """Integrals over frequency in some gusts.

    Attributes
    ----------
    panels : Panels
        On which the spectrum of the gusts and the weights are resolved.
    gusts : Gusts
    weights : dict
        Name -> factor of the spectra at the frequencies of the panels, shape (n,).
    least : float
        Damping ratio up to which a motion counts as not damped. [-]
    """

    panels: Panels
    gusts: object
    weights: dict
    least: float = WIND.undamped

    @staticmethod
    def on(edges, gusts, weights, least=WIND.undamped):
        """`Integrals` on panels between edges [Hz] with weights that are functions of frequency [Hz]."""
        panels = Panels(edges)
        return Integrals(panels, gusts, {name: of(panels.frequency) for name, of in weights.items()}, least)

    @cached_property
    def noise(self):
        """`Noise` of the gusts on the panels."""
        return self.gusts.noise(self.panels.frequency)

    def variances(self, response, names=None):
        """Variances of the outputs, weighted by the weights of some names, by default all.

        Parameters
        ----------
        response : Residues or DelayedResponse
            Of a stable system, by the inputs of the gusts.
        names : sequence of str, optional

        Returns
        -------
        ndarray, shape (w, o)
        """
        weights = np.stack([self.weights[name] for name in names or self.weights])
        known, rest = response.split(TURN * self.panels.highest)
        known = known.take(damped(known, self.least))
        if rest is None:
            return variances(known, self.panels, self.noise, weights)
        return mixed_variances(known, rest, self.gusts.matrix_times, self.panels, self.noise, weights)

    def undamped(self, response, whole, stiffness):
        """Of each output the pole that nothing damps, of those that the gusts excite the one that moves it most.

        Parameters
        ----------
        response : Residues or DelayedResponse
        whole : ndarray, shape (o,)
            Variances of its outputs.
        stiffness : ndarray, shape (o,)
            Energy per square of each output, by which they are compared; 0 of one that does not matter.

        Returns
        -------
        ndarray, complex, shape (o,)
            0 of an output that no such pole moves. [rad/s]
        """
        known, _ = response.split(TURN * self.panels.highest)
        left = known.take(~damped(known, self.least) & (known.poles != 0))
        if not len(left.poles):
            return np.zeros(len(whole), dtype=complex)
        size, inputs = np.abs(left.poles), left.inputs[:, :, None]
        force = (left.inputs * self.gusts.matrix_times(size / TURN, inputs.conj())[..., 0]).sum(axis=1).real
        own = np.abs(left.outputs.T) ** 2 * stiffness * (force / (2 * self.least * size))[:, None]  # at most
        energy = whole * stiffness
        rounded = WIND.still * max(own.max(), energy.max())
        excited = own > np.maximum(WIND.undamped_share * energy, rounded)
        return np.where(excited.any(axis=0), left.poles[np.argmax(own, axis=0)], 0.0)


def damped(residues, least=WIND.undamped):
    """Which poles of a stable system have a damping ratio above one, and above rounding.

    Of a complex stiffness those below the real axis grow: they are no resonances.
    """
    rate, size = np.abs(residues.poles.real), np.abs(residues.poles)
    oscillating = np.abs(residues.poles.imag) > least * size
    return (rate > least * size) & (~oscillating | (rate > WIND.decay_rounding * size.max(initial=0.0)))
