"""Integrals over frequency of the spectra of motions in gusts: one cable or many, with the loop closed or open.

A resonance that nothing damps has no finite variance: the integrals leave it out. `Integrals.undamped` finds those that
the gusts excite, for which the caller must report that the variance is infinite.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.records import stack
from cablestudy.wind.tolerances import WIND
from cablestudy.wind.variance import Panels, variances, variances_with_remainder


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

    @cached_property
    def all_weights(self):
        """The w weights at the n frequencies of the panels, shape (w, n)."""
        return np.array(list(self.weights.values()))

    def shapes_with(self, residues):
        """Sizes of all arrays of these integrals of a response, `Residues`: rows with equal ones go together. Tuple."""
        arrays = residues.inputs, residues.outputs, self.all_weights, self.noise.matrices
        upper = residues.one_sided or np.count_nonzero(residues.poles.imag >= 0)
        groups = ((group.start, group.stop) for group in self.noise.groups)
        return *(array.shape for array in arrays), upper, *groups

    def variances(self, response):
        """Variances of the outputs of a system in the gusts: integrals of their spectra times each weight.

        Poles with a damping ratio up to `least_damping_ratio` are left out, see `undamped`.

        Parameters
        ----------
        response : Residues or DelayedResponse
            Response of the o outputs of a stable system to the inputs of the gusts.

        Returns
        -------
        ndarray, shape (w, o)
            For the w weights, in squares of the units of the outputs.
        """
        return variances_of_rows([self], [response])[0]

    def undamped(self, response, variance, stiffness):
        """Find, for each output, an undamped motion that makes its variance infinite: the pole that moves it most.

        A pole l_j other than zero is undamped if its damping ratio is not above z = `least_damping_ratio`, or if its
        decay is no more than rounding; see `damped`. It makes the variance of an output infinite only if the gusts
        excite it: if, with the damping ratio z, its energy in the output,

            |c_j|^2 (b_j S b_j^H)/(2 z |l_j|) stiffness,

        would exceed the share `WIND.undamped_share` of the energy of all other motion, variance times stiffness. S is
        the spectral matrix of the gusts; b_j and c_j are the input and output vectors of the pole.

        Parameters
        ----------
        response : Residues or DelayedResponse
            Response of the o outputs of a stable system to the inputs of the gusts.
        variance : ndarray, shape (o,)
            Variances of the outputs without undamped motions.
        stiffness : ndarray, shape (o,)
            Energy per square of each output, by which outputs are compared; 0 for one that does not matter.

        Returns
        -------
        ndarray, complex, shape (o,)
            Pole [rad/s]; 0 for an output that no excited undamped motion moves.
        """
        sum_over_poles, _ = response.split(2 * np.pi * self.panels.highest)
        least = self.least_damping_ratio
        undamped = sum_over_poles.take(~damped(sum_over_poles, least) & (sum_over_poles.poles != 0))
        if not len(undamped.poles):
            return np.zeros(len(variance), dtype=complex)
        omega, inputs = np.abs(undamped.poles), undamped.inputs
        spectra = self.gusts.noise(omega / (2 * np.pi)).times(inputs[:, :, None].conj())[..., 0]
        force_spectrum = (inputs * spectra).sum(axis=1)
        # of each pole (rows) in each output (columns), as if its damping ratio were the least
        variance_at_least_damping = (force_spectrum.real / (2 * least * omega))[:, None]
        energy = np.abs(undamped.outputs.T) ** 2 * stiffness * variance_at_least_damping
        total_energy = variance * stiffness
        rounding = WIND.still * max(energy.max(), total_energy.max())
        excited = energy > np.maximum(WIND.undamped_share * total_energy, rounding)
        return np.where(excited.any(axis=0), undamped.poles[np.argmax(energy, axis=0)], 0.0)


def variances_of_rows(integrals, responses):
    """Variances of outputs in gusts for many independent systems ("rows"): integrals of spectrum times weight.

    Undamped poles are left out. Rows whose arrays have equal shapes are computed together, as many as a processor's
    cache holds; no digit of a row depends on the others.

    Parameters
    ----------
    integrals : list of Integrals
        For each row: gusts, points of quadrature over frequency, and w weights, which are functions of frequency.
    responses : list of (Residues or DelayedResponse)
        For each row: response of its o outputs to its gusts, as a sum over poles.

    Returns
    -------
    list of ndarray, shape (w, o)
        For each row: variance of each output with each weight, in squares of the units of the outputs.
    """
    found, rows_by_shapes, residues = [None] * len(integrals), {}, {}  # residues: row -> its sum over damped poles
    for row, (integral, response) in enumerate(zip(integrals, responses, strict=True)):
        # a delay leaves a remainder, smooth over frequency, in addition to the sum over poles; without delay it is None
        poles, remainder = response.split(2 * np.pi * integral.panels.highest)
        poles = _without_undamped(poles, integral.least_damping_ratio)
        if remainder is None:
            residues[row] = poles
            rows_by_shapes.setdefault(integral.shapes_with(poles), []).append(row)
        else:
            found[row] = variances_with_remainder(
                poles, remainder, integral.panels, integral.noise, integral.all_weights
            )
    for rows in rows_by_shapes.values():
        resolvents = len(residues[rows[0]].poles) * integrals[rows[0]].all_weights.shape[-1]  # entries of each row
        at_once = max(1, WIND.resolvent_entries // max(1, resolvents))
        for begin in range(0, len(rows), at_once):
            members = rows[begin : begin + at_once]
            panels = Panels(np.array([integrals[row].panels.edges for row in members]))
            noise = stack([integrals[row].noise for row in members])
            weights = np.array([integrals[row].all_weights for row in members])
            of_members = variances(stack([residues[row] for row in members]), panels, noise, weights)
            for row, variance in zip(members, of_members, strict=True):
                found[row] = variance
    return found


def _without_undamped(residues, least_damping_ratio):
    """`Residues` without the poles that are not `damped`.

    Poles that do not resonate stay. Their covariances are divided by their rates of decay, which may be zero by chance:
    these are at least that of the least damping ratio, which changes nothing else.
    """
    poles, least = residues.poles, least_damping_ratio * np.abs(residues.poles)
    too_slow = ~_resonates(residues, least_damping_ratio) & (np.abs(poles.real) < least)
    if too_slow.any():
        residues = replace(residues, poles=np.where(too_slow, -least + 1j * poles.imag, poles))
    is_damped = damped(residues, least_damping_ratio)
    return residues if is_damped.all() else residues.take(is_damped)


def damped(residues, least_damping_ratio=WIND.undamped):
    """True for the poles of a stable system that do not resonate, or decay by more than rounding and a least ratio."""
    rate, size = np.abs(residues.poles.real), np.abs(residues.poles)
    oscillating = np.abs(residues.poles.imag) > least_damping_ratio * size
    rounding = WIND.decay_rounding * size[oscillating].max(initial=0.0)
    decays = (rate > least_damping_ratio * size) & (~oscillating | (rate > rounding))
    return decays | ~_resonates(residues, least_damping_ratio)


def _resonates(residues, least_damping_ratio):
    """True for poles to which frequencies above zero come close.

    They do not to those below the real axis. With a complex stiffness the upper pole of a mode decays by the hysteresis
    and by viscous damping, and the lower one by their difference: it may grow, and stay by chance.
    """
    return (not residues.one_sided) | (residues.poles.imag >= -least_damping_ratio * np.abs(residues.poles))
