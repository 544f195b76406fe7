"""Margins of a loop gain of k coordinates over frequency; k = 1 for one cable.

L is the loop gain at what is measured, S = (I + L)^-1 the sensitivity and T = L (I + L)^-1 = I - S the complementary
sensitivity; the size of such a matrix is its largest singular value (Skogestad and Postlethwaite, Multivariable
Feedback Control, 2005, sections 2.2, 2.4 and 3.3). A phase that is common to all eigenvalues of L, as that of a further
delay, brings the loop to the limit of stability where it turns an eigenvalue of size 1 to -1.

The disk margin is that of Seiler, Packard and Gahinet (An introduction to disk margins, IEEE Control Systems Magazine
40(5), 2020) without skew: the loop is stable with each factor (1 + d/2)/(1 - d/2) of the loop gain,
|d| < alpha, alpha = 1/max |S - 1/2|. Several coordinates may have such factors of their own at once, also coupled ones
(I + D/2)(I - D/2)^-1 with a complex matrix D of size below alpha = 1/max size(S - I/2). For factors that are not
coupled this is a lower bound: the structured singular value would give the largest.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from operator import attrgetter

import numpy as np

from cablestudy.cable.matrices import inverse
from cablestudy.control.curves import at_frequencies, by_parts, eigenvalues
from cablestudy.control.margins_grid import highest, zero_crossings
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError
from cablestudy.system.together import batches, computed_together

SHIFTS = np.array([0.0, 0.5])  # of S by multiples of I: for the peak of the sensitivity, and for the disk margin
# bound, where the loop gain is small, on how far a peak at or near a frequency lies above the size of I, over that of
# S - I there: a peak near a frequency is at most `peak_reach` times its visible height higher
PEAK_OVER_DEVIATION = 2 * (1 + 2 * CONTROL.peak_reach)


@dataclass(eq=False)
class Margins:
    """Margins of stability of a stable loop over frequency: phase, delay, sensitivity, disk margin and bandwidth.

    What is sought over frequency is sought for many loops in one call (`computed_together`).

    Attributes
    ----------
    unit_gain : callable
        L over the gain: s, shape (f,) -> shape (f, k, k).
    omega : ndarray, shape (f,)
        Ascending frequencies, close enough to show every turn of L and S; see `margins_grid.frequencies`. [rad/s]
    gain : float
        [rad/s]
    check_peak : callable
        Called with the frequency of a peak of the sensitivity or of the disk margin [rad/s]: raises NoSolutionError
        where that peak is that of a nearly undamped mode, whose height is rounding.
    matrices : ndarray, shape (f, k, k), optional
        L over the gain at these frequencies, where it is known.
    """

    unit_gain: Callable
    omega: np.ndarray
    gain: float = 1.0
    check_peak: Callable = lambda omega: None
    matrices: np.ndarray | None = None

    def loop_gain(self, s):
        """L at s of shape (f,), shape (f, k, k)."""
        return self.gain * self.unit_gain(s)

    @cached_property
    def _curve(self):
        """Frequencies at which L is finite [rad/s], and L there, shape (f, k, k)."""
        matrices = by_parts(self.unit_gain, 1j * self.omega) if self.matrices is None else self.matrices
        finite = np.isfinite(matrices).all(axis=(-2, -1))
        return self.omega[finite], self.gain * matrices[finite]

    @cached_property
    def _sensitivity(self):
        """S at the frequencies of `_curve`, shape (f, k, k)."""
        return sensitivity(self._curve[1])

    @property
    def _measured(self):
        """Number of measured coordinates, k."""
        return self._curve[1].shape[-1]

    @property
    def _signature(self):
        """Sizes of all arrays, by which loops are found whose loop gains are computed together: tuple."""
        return self._measured, getattr(self.unit_gain, "signature", None)

    @computed_together
    def crossovers(margins):
        """Frequencies at which an eigenvalue of L has the size 1 [rad/s], and its angle from -1 [deg], shape (c,)."""
        for members, loop_gains in _of_many(margins):
            curves = [(omega, _log_sizes(matrices)) for omega, matrices in (one._curve for one in members)]
            found = zero_crossings(lambda omega, loop, of=loop_gains: _log_sizes(of(omega, loop)), curves)
            omega, rank = (np.concatenate(parts) for parts in zip(*found, strict=True))
            values = eigenvalues(loop_gains(omega, np.repeat(np.arange(len(found)), [len(own) for own, _ in found])))
            index = np.take_along_axis(np.argsort(np.abs(values), axis=1), rank[:, None], axis=1)
            angle, end = np.degrees(np.angle(-np.take_along_axis(values, index, axis=1)[:, 0])), 0
            for one, (own, _) in zip(members, found, strict=True):
                begin, end = end, end + len(own)
                yield one, (own, angle[begin:end])

    @computed_together
    def peaks(margins):
        """Largest singular value over frequency [-], and its frequency [rad/s], of S and of S - I/2: two pairs."""
        for members, loop_gains in _of_many(margins):

            def size_at(omega, which, loop_gains=loop_gains):
                loop, shift = np.divmod(which, len(SHIFTS))
                return _size(sensitivity(loop_gains(omega, loop)), SHIFTS[shift][:, None, None])

            curves = [(one._curve[0], one._sizes(shift)) for one in members for shift in SHIFTS.tolist()]
            found = highest(size_at, curves, CONTROL.equal_peaks)
            yield from zip(members, zip(found[::2], found[1::2], strict=True), strict=True)

    def _sizes(self, shift):
        """Largest singular value of S - shift I at the frequencies of `_curve`, where a highest one may be, shape (f,).

        Where L is small, S is nearly I: a bound on their difference tells at which frequencies the highest peak cannot
        be, and S need not be computed.
        """
        omega, matrices = self._curve
        size_of_identity, value = abs(1 - shift), np.zeros(len(omega))
        gain = np.minimum(np.sqrt((np.abs(matrices) ** 2).sum(axis=(-2, -1))), CONTROL.small_gain)
        deviation = gain / (1 - gain)  # bound on the size of S - I for a loop gain of size `gain` < 1
        large = gain == CONTROL.small_gain
        value[large] = _size(self._sensitivity[large], shift)
        highest_known = value.max(initial=size_of_identity)
        # bound on a peak at or near each frequency, above the size of I: S is needed where it may be the highest
        reach = PEAK_OVER_DEVIATION * deviation + CONTROL.flat_peak * highest_known
        may_be_highest = ~large & (reach >= highest_known - size_of_identity)
        value[may_be_highest] = _size(self._sensitivity[may_be_highest], shift)
        value[~large & ~may_be_highest] = size_of_identity
        return value

    @cached_property
    def _peak(self):
        """Largest size of S over frequency [-], and its frequency [rad/s]: 1 and None where none is larger than 1."""
        value, omega = self.peaks[0]
        if not value > 1:
            return 1.0, None
        self.check_peak(omega)
        return value, omega

    @cached_property
    def _disk(self):
        """alpha [-], and the frequency that decides it [rad/s]: 2 and None where the real part of L is nowhere < 0."""
        value, omega = self.peaks[1]
        if not value > 0.5 * (1 + CONTROL.passive):
            return 2.0, None
        self.check_peak(omega)
        return 1 / value, omega

    @property
    def phase_margin(self):
        """Least angle between -1 and an eigenvalue of L of size 1; None where there is none. [deg]"""
        phase = self.crossovers[1]
        return float(np.abs(phase).min()) if len(phase) else None

    @property
    def gain_crossover(self):
        """Frequency of the phase margin; None where there is none. [Hz]"""
        omega, phase = self.crossovers
        return float(omega[np.argmin(np.abs(phase))] / (2 * np.pi)) if len(omega) else None

    @property
    def delay_margin(self):
        """Least further delay that makes the loop unstable; None where no eigenvalue of L has the size 1. [s]"""
        omega, phase = self.crossovers
        return float((np.radians(phase % 360) / omega).min()) if len(omega) else None

    @property
    def sensitivity_peak(self):
        """Largest size of S over all frequencies. [-]"""
        return self._peak[0]

    @property
    def sensitivity_frequency(self):
        """Frequency of the largest sensitivity, the lowest of equal ones; None where it is 1, at infinity. [Hz]"""
        return self._peak[1] and self._peak[1] / (2 * np.pi)

    @property
    def disk_margin(self):
        """alpha of the module's docstring, at most 2. [-]"""
        return self._disk[0]

    @property
    def disk_frequency(self):
        """Frequency that decides the disk margin; None where it is 2. [Hz]"""
        return self._disk[1] and self._disk[1] / (2 * np.pi)

    @property
    def disk_gain_margin(self):
        """Gains may grow or fall by less than (1 + alpha/2)/(1 - alpha/2); None where alpha is 2. [dB]"""
        if self._disk[1] is None:
            return None
        half = self.disk_margin / 2
        return float(20 * np.log10((1 + half) / (1 - half)))

    @property
    def disk_phase_margin(self):
        """Phases may turn by less than 2 atan(alpha/2). [deg]"""
        return float(np.degrees(2 * np.arctan(self.disk_margin / 2)))

    @property
    def deciding(self):
        """Frequencies at which the loop gain decides the margins, shape (d,). [rad/s]"""
        peaks = [*(omega for _, omega in self.peaks), self.bandwidth and 2 * np.pi * self.bandwidth]
        return np.append(self.crossovers[0], [omega for omega in peaks if omega])

    @computed_together
    def bandwidth(margins):
        """First frequency at which the largest singular value of T falls below 1/sqrt(2); None without one. [Hz]"""
        for members, loop_gains in _of_many(margins):
            curves = [one._up_to_bandwidth for one in members]

            def log_size_at(omega, loop, loop_gains=loop_gains):
                return _log_size_of_rest(sensitivity(loop_gains(omega, loop)))

            for one, (_, sizes), (zeros, _) in zip(members, curves, zero_crossings(log_size_at, curves), strict=True):
                zeros = zeros[1:] if sizes[0, 0] < 0 else zeros  # the first one is where T rises before it falls
                yield one, float(zeros[0] / (2 * np.pi)) if len(zeros) else None

    @property
    def _up_to_bandwidth(self):
        """Frequencies [rad/s], shape (f,), up to the first at which T is below 1/sqrt(2), and ln(sqrt(2) size of T)."""
        omega, count = self._curve[0], len(self._curve[0])  # count: how many of the frequencies are looked at
        sizes, block = np.zeros((0, 1)), CONTROL.frequencies_at_once
        while len(sizes) < count:  # in blocks, no farther than the first passage
            of_block = _log_size_of_rest(self._sensitivity[len(sizes) : len(sizes) + block])
            sizes = np.concatenate([sizes, of_block])
            below = np.flatnonzero((sizes[:-1, 0] > 0) & (sizes[1:, 0] <= 0))
            count = below[0] + 2 if len(below) else count
        return omega[:count], sizes[:count]


def _of_many(margins):
    """Yield lists of `Margins` that are sought in one call, and their loop gains L.

    These are one function: frequencies and numbers of the loops, both of shape (f,) -> shape (f, k, k).
    """
    for members in batches(margins, attrgetter("_signature"), attrgetter("_measured")):
        functions, gain = [one.unit_gain for one in members], np.array([one.gain for one in members])

        def loop_gains(omega, loop, functions=functions, gain=gain):
            order = np.argsort(loop, kind="stable")
            matrices = at_frequencies(functions, loop[order], omega[order])
            return (gain[loop[order], None, None] * matrices)[np.argsort(order)]

        yield members, loop_gains


def _size(matrices, shift):
    """Largest singular value of matrices less a multiple of I, shape (f,); 0 of those that are not finite."""
    return np.nan_to_num(largest(matrices - shift * np.eye(matrices.shape[-1])), nan=0.0, posinf=0.0)


def _log_size_of_rest(sensitivities):
    """ln(sqrt(2) size of T), T = I - S, shape (f, 1): it passes zero at the bandwidth."""
    return _logarithm(np.sqrt(2) * largest(np.eye(sensitivities.shape[-1]) - sensitivities)[:, None])


def _log_sizes(matrices):
    """Logarithm of the sizes of eigenvalues, ascending, within `far_from_one` of 0, shape (f, k, k) -> (f, k)."""
    logarithms = np.full(matrices.shape[:-1], -CONTROL.far_from_one)
    bound = np.sqrt((np.abs(matrices) ** 2).sum(axis=(-2, -1)))  # no eigenvalue is larger than this
    large = bound > np.exp(-CONTROL.far_from_one)
    logarithms[large] = _logarithm(np.sort(np.abs(eigenvalues(matrices[large])), axis=1))
    return logarithms


def _logarithm(value):
    """Natural logarithm, within `far_from_one` of 0."""
    return np.clip(np.log(np.maximum(value, np.finfo(float).tiny)), -CONTROL.far_from_one, CONTROL.far_from_one)


def sensitivity(matrices):
    """(I + L)^-1, shape (f, k, k); infinite where I + L is singular."""
    return_difference = np.eye(matrices.shape[-1]) + matrices
    if matrices.shape[-1] == 1:
        with np.errstate(divide="ignore", invalid="ignore"):
            return 1 / return_difference
    return inverse(return_difference)


def largest(matrices):
    """Largest singular value, shape (f, k, k) -> (f,); infinite of a matrix that is not finite."""
    if matrices.shape[-1] == 1:
        return np.abs(matrices[:, 0, 0])
    value, finite = np.full(len(matrices), np.inf), np.isfinite(matrices).all(axis=(-2, -1))
    squared = np.swapaxes(matrices[finite].conj(), -1, -2) @ matrices[finite]
    value[finite] = np.sqrt(np.linalg.eigvalsh(squared)[..., -1])  # these eigenvalues cost less than singular values
    return value


def gain_of_peak(unit_gain, omega, peak, most):
    """Find the largest gain g <= `most` for which no singular value of the sensitivity (I + g L)^-1 exceeds `peak`.

    Parameters
    ----------
    unit_gain : callable
        L, the loop gain divided by its gain: s, shape (f,) [rad/s] -> shape (f, k, k). [s]
    omega : ndarray, shape (f,)
        Frequencies to begin with, ascending, close enough to show how L changes. [rad/s]
    peak : float
        Largest singular value that is allowed, above 1. [-]
    most : float
        Upper bound, with which the search begins. [rad/s]

    Returns
    -------
    gain, omega : float
        g, and the frequency of the peak; None in place of the frequency where g is `most`. [rad/s]

    Raises
    ------
    NoSolutionError
        The search did not end.

    Notes
    -----
    At one frequency a singular value equals `peak` for the gains g = 1/m at which the matrix

        m^2 [(I + g L)^H (I + g L) - I/peak^2] = (1 - 1/peak^2) m^2 I + m (L + L^H) + L^H L

    is singular. A value above `peak` at one gain stays above it down to the next lower of these gains. So the search
    lowers g to the least of these lower gains over all frequencies, and repeats this until no value exceeds `peak`.
    """

    def largest_at(function, gain):
        """Largest value over frequency of a function of L and of a gain, and its frequency."""
        return highest(lambda omega, _: function(loop_gain_at(omega), gain), [(omega, function(value, gain))])[0]

    def loop_gain_at(omega):
        return _finite(by_parts(unit_gain, 1j * omega))

    gain, peak_omega, value = most, None, loop_gain_at(omega)  # value: L, shape (f, k, k)
    for _ in range(CONTROL.gain_steps):
        height, top = largest_at(_sensitivity_size, gain)
        if height <= peak * (1 + CONTROL.peak_reached):
            break
        if top not in omega:  # the narrow peak counts in the next search too
            index = np.searchsorted(omega, top)
            omega, value = np.insert(omega, index, top), np.insert(value, index, loop_gain_at(np.array([top])), axis=0)
        inverse, peak_omega = largest_at(partial(_next_below, peak), gain)
        gain = 1 / max(inverse, (1 + CONTROL.peak_reached) / gain)  # rounding may hide a gain that is nearly reached
    else:
        raise NoSolutionError(f"no gain with a sensitivity of at most {peak:g} was found in {CONTROL.gain_steps} steps")
    return gain, peak_omega


def _sensitivity_size(value, gain):
    """Largest singular value of (I + gain L)^-1, shape (f,), `value` being L, shape (f, k, k)."""
    return 1 / np.maximum(_least_singular_value(value, gain), np.finfo(float).tiny)


def _least_singular_value(value, gain):
    """Least singular value of I + gain L, shape (f,), `value` being L, shape (f, k, k)."""
    return np.linalg.svd(np.eye(value.shape[-1]) + gain * value, compute_uv=False)[:, -1]


def _finite(value):
    """Matrices with 0 in place of those that are not finite, shape (f, k, k)."""
    return np.where(np.isfinite(value).all(axis=(-2, -1), keepdims=True), value, 0.0)


def _next_below(peak, value, gain):
    """1/g for the largest g < `gain` with which a singular value of (I + g L)^-1 is `peak`, at f frequencies. [s]

    m = 1/g is an eigenvalue of a quadratic problem, which is solved as a linear one of twice the size:

        det[(1 - 1/peak^2) m^2 I + m (L + L^H) + L^H L] = 0.

    L, shape (f, k, k), is the loop gain divided by its gain (`value`). m is zero where the sensitivity is not above
    `peak` with `gain`, or no such g is found.
    """
    size, factor, result = value.shape[-1], 1 - peak**-2, np.zeros(len(value))
    higher = np.flatnonzero(_least_singular_value(value, gain) * peak < 1)  # where the sensitivity is above the peak
    value = value[higher]
    conjugate = np.swapaxes(value.conj(), -1, -2)
    companion = np.zeros((len(value), 2 * size, 2 * size), dtype=complex)
    companion[:, :size, size:] = np.eye(size)
    companion[:, size:, :size] = -conjugate @ value / factor
    companion[:, size:, size:] = -(value + conjugate) / factor
    m = np.linalg.eigvals(companion)
    below = (np.abs(m.imag) <= CONTROL.real_eigenvalue * np.abs(m)) & (m.real * gain > 1)  # real, and g < gain
    least_m = np.where(below, m.real, np.inf).min(axis=1, initial=np.inf)  # 1/g of the largest g
    result[higher] = np.where(np.isfinite(least_m), least_m, 0.0)
    return result
