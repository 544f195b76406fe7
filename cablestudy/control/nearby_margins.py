"""Margins of a loop gain L' that differs little from a loop gain L, whose own are known.

They are sought only where those of L are decided. An eigenvalue l of L that decides at the frequency w, with left and
right eigenvectors p and q, becomes l' of L' there, and moves along the frequency as before: with d = ln(l'/l),

    ln l'(w + dw) = ln l(w) + d + dw (p^T dL/dw q)/(l p^T q).

Margins are of first order, and a peak of a singular value is that of the parabola through its values at three
frequencies about the known one. Where L' differs too much for that, or L turns too fast, `nearby_margins` gives None.
"""

import numpy as np

from cablestudy.control.margins import Margins, largest, sensitivity
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError

THREE = np.array([-1.0, 0.0, 1.0])  # frequencies about a known one, in steps


class _DifferenceError(Exception):
    """L' differs too much from L for an estimate to first order."""


@np.errstate(divide="ignore", invalid="ignore")  # what is not finite is refused
def nearby_margins(known, unit_gain):
    """Estimate the `Margins` of a loop gain L' that differs little from a loop gain L with known margins.

    Parameters
    ----------
    known : Margins
        The margins of L, with its crossovers and peaks.
    unit_gain : callable
        L' divided by the gain of L: s, shape (f,) [rad/s] -> shape (f, k, k). [s] It is called once, at the frequencies
        that decide the margins of L: its crossovers, the bandwidth, and three frequencies about each of two peaks,
        those of the sensitivity and of the disk margin.

    Returns
    -------
    Margins or None
        To first order in L' - L; None where L' differs too much for that, or L has no peak above the size of I. Where
        L has that of a nearly undamped mode, peaks are not estimated.
    """
    (crossovers, angles), count = known.crossovers, len(known.crossovers[0])
    try:
        peaks = 2 * np.pi * np.array([known.sensitivity_frequency, known.disk_frequency])
    except TypeError:  # no peak above the size of I
        return None
    except NoSolutionError:  # the height of one is rounding
        peaks = np.zeros(0)
    step = CONTROL.nearby_peak * np.array([_bracket(known.omega, omega) for omega in peaks])
    about_peaks = (peaks[:, None] + step[:, None] * THREE).ravel()
    passed = np.append(crossovers, [2 * np.pi * known.bandwidth] if known.bandwidth else [])
    about_passed = (passed[:, None] * (1 + CONTROL.nearby_step * THREE)).ravel()
    # L at three frequencies about each peak, then about each frequency that is passed; L' too, but there alone
    of_known = known.loop_gain(1j * np.append(about_peaks, about_passed))
    of_known = of_known.reshape(-1, 3, *of_known.shape[1:])
    at_peaks, at_passed = of_known[: len(peaks)], of_known[len(peaks) :]
    changed = known.gain * unit_gain(1j * np.append(about_peaks, passed))
    changed_at_peaks, changed_at_passed = np.split(changed, [len(about_peaks)])
    changed_at_peaks = changed_at_peaks.reshape(at_peaks.shape)
    nearby = Margins(unit_gain, known.omega, known.gain)
    try:
        nearby.crossovers = _crossovers(crossovers, angles, at_passed[:count], changed_at_passed[:count])
        if len(peaks):
            nearby.peaks = (
                _peak(known.sensitivity_peak, peaks[0], step[0], 0.0, at_peaks[0], changed_at_peaks[0]),
                _peak(1 / known.disk_margin, peaks[1], step[1], 0.5, at_peaks[1], changed_at_peaks[1]),
            )
        nearby.bandwidth = known.bandwidth and _bandwidth(passed[-1], at_passed[-1], changed_at_passed[-1])
    except (_DifferenceError, np.linalg.LinAlgError):
        return None
    return nearby


def _check_first_order(slope, curvature, shift, change):
    """Raise `_DifferenceError` unless terms of second order are small compared with the slope and with `change`.

    `change` is the change of the sought value by `shift`; its part of second order is curvature times shift^2.
    """
    bend, least = CONTROL.nearby_bend, CONTROL.nearby_rounding
    bending = np.abs(curvature * shift)
    small = (bending <= bend * np.abs(slope)) & (bending * np.abs(shift) <= np.maximum(bend * np.abs(change), least))
    if not np.all(small):
        raise _DifferenceError


def _crossovers(omega, angles, known, changed):
    """`Margins.crossovers` of L' near those of L, which is `known` at three frequencies about each, L' there alone."""
    value, slope, curvature = _eigenvalues(known, -np.exp(1j * np.radians(angles)), CONTROL.nearby_step * omega)
    ratios = np.linalg.eigvals(changed) / value[:, None]
    change = np.log(ratios[np.arange(len(ratios)), np.abs(ratios - 1).argmin(axis=1)])  # ln(l'/l) of the nearest l'
    if not (np.abs(change) < CONTROL.nearby_change).all():
        raise _DifferenceError
    shift = -change.real / slope.real  # to where the size is 1
    turn = (change + slope * shift).imag
    _check_first_order(slope.real, curvature, shift, turn)
    return omega + shift, angles + np.degrees(turn)


def _eigenvalues(matrices, expected, step):
    """Eigenvalues l of a loop gain nearest to expected ones, and two derivatives of ln l by the frequency, (c,) each.

    `matrices`, shape (c, 3, k, k), are a `step` [rad/s] before each frequency, there, and a step after it. The
    derivatives have the eigenvectors as they are.
    """
    before, at, after = np.moveaxis(matrices, 1, 0)
    values, right = np.linalg.eig(at)
    index = np.arange(len(values)), np.abs(values - expected[:, None]).argmin(axis=1)
    left, right = np.linalg.inv(right)[index][:, None], np.swapaxes(right, 1, 2)[index][:, :, None]
    differences = (after - before) / 2, after - 2 * at + before
    first, second = ((left @ difference @ right)[:, 0, 0] / values[index] for difference in differences)
    return values[index], first / step, (second - first**2) / step**2


def _bandwidth(omega, known, changed):
    """Bandwidth of L' [Hz] near that of L [rad/s], which is `known` at three frequencies about it, L' there alone."""
    identity, step = np.eye(changed.shape[-1]), CONTROL.nearby_step * omega
    before, at, after, there = np.log(largest(identity - sensitivity(np.concatenate([known, changed[None]]))))
    slope, curvature = (after - before) / (2 * step), (after - 2 * at + before) / step**2
    shift = (at - there) / slope
    _check_first_order(slope, curvature, shift, there - at)
    return float(omega + shift) / (2 * np.pi)


def _bracket(omega, peak):
    """Distance of the frequencies before and after a peak, among ascending ones. [rad/s]"""
    index = np.clip(np.searchsorted(omega, peak), 1, len(omega) - 2)
    return omega[index + 1] - omega[index - 1]


def _peak(height, omega, step, shift, known, changed):
    """Highest singular value of S - shift I of L', and its frequency [rad/s], near those of L: `height` and `omega`.

    L and L' are `known` and `changed` at three frequencies, a step apart [rad/s], about this one.
    """
    tops = []  # of the parabolas through three values: their offsets in steps, and heights
    for matrices in known, changed:
        before, at, after = largest(sensitivity(matrices) - shift * np.eye(matrices.shape[-1]))
        slope, curvature = (after - before) / 2, after - 2 * at + before
        if not curvature < 0:
            raise _DifferenceError
        tops.append((-slope / curvature, at - slope**2 / (2 * curvature)))
    (offset, top), (changed_offset, changed_top) = tops
    if not abs(changed_offset - offset) < 1:
        raise _DifferenceError
    return float(height + changed_top - top), float(omega + step * (changed_offset - offset))
