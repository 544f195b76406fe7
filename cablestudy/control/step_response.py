"""Overshoot, rise time and settling time of a response to a step (Ogata, Modern Control Engineering, section 5.3)."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.control.tolerances import CONTROL


@dataclass(frozen=True)
class StepResponse:
    """Numbers of a response to a step.

    A response to a disturbance may end near zero (`CONTROL.ends_near_zero`).

    Attributes
    ----------
    final : float
        Its value after a long time. [as the response]
    size : float
        Value to which shares refer: the final one, or the largest one of a response that ends near zero.
    overshoot : float or None
        Largest value beyond the final one, over the final one; None of a response that ends near zero. [-]
    rise_time : float or None
        From `rise[0]` to `rise[1]` of the final value; None of a response that ends near zero, or if it takes longer
        than the times sampled. [s]
    settling_time : float or None
        Time from which on the response stays within `settling_band` times `size` of the final value; None if never. [s]
    resolved : bool
        True if the points of time are close enough for these numbers.
    """

    final: float
    size: float
    overshoot: float | None
    rise_time: float | None
    settling_time: float | None
    resolved: bool = True

    @property
    def ends_near_zero(self):
        """True if the response ends near zero."""
        return self.overshoot is None

    def agrees(self, other):
        """True if the numbers of another `StepResponse` differ by no more than `enough_points`."""
        allowed, pairs = CONTROL.enough_points, [(self.rise_time, other.rise_time)]
        pairs.append((self.settling_time, other.settling_time))
        if any((time is None) != (other_time is None) for time, other_time in pairs):
            return False
        near = abs((self.overshoot or 0.0) - (other.overshoot or 0.0)) <= allowed
        return near and all(time is None or abs(time - other_time) <= allowed * abs(time) for time, other_time in pairs)


def step_response(time, value, final):
    """The `StepResponse` of a response from rest; None where it is zero throughout, or nothing is known of its end.

    Parameters
    ----------
    time, value : ndarray, shape (m,)
        Uniform times from zero [s], and the response to a step at time zero.
    final : float
        Its value after a long time; nan where that is not known.
    """
    largest = float(np.abs(value).max())
    if not (np.isfinite(final) and largest > 0 and len(time) >= 2 * CONTROL.fewest_points):
        return None
    fine, coarse = (_by_spline(time[::step], value[::step], final, largest) for step in (1, 2))
    return fine if fine.agrees(coarse) else replace(fine, resolved=False)


def _by_spline(time, value, final, largest):
    """`StepResponse` of a response to a step, sampled at uniform times from zero, by a cubic spline.

    `final` is the value after a long time, `largest` the largest size of the values, by which the spline is scaled.
    """
    from scipy.interpolate import CubicSpline

    sign, final_share = np.copysign(1.0, final), abs(final) / largest
    curve = CubicSpline(time, sign * value / largest)
    # of a response that is zero during a delay: `solve` finds roots where there are none by coefficients of 1e-170
    curve.c[np.abs(curve.c) < CONTROL.spline_rounding * np.abs(curve.c).max(axis=1, keepdims=True)] = 0.0
    follows = final_share >= CONTROL.ends_near_zero  # else it ends near zero
    size = final_share if follows else 1.0
    overshoot = rise = None
    if follows:
        turns = curve.derivative().roots(extrapolate=False)
        highest = curve(np.append(turns[np.isfinite(turns)], time[-1])).max()
        overshoot = max(0.0, float(highest) / final_share - 1.0)
        begin, end = (_times_at(curve, share * final_share).min(initial=np.inf) for share in CONTROL.rise)
        rise = float(end - begin) if end < np.inf else None
    settling = None
    if abs(curve(time[-1]) - final_share) <= CONTROL.settling_band * size:
        crossings = [_times_at(curve, final_share + side * CONTROL.settling_band * size) for side in (-1, 1)]
        settling = float(np.concatenate(crossings).max(initial=0.0))
    return StepResponse(final, size * largest, overshoot, rise, settling)


def _times_at(curve, level):
    """Times at which a curve has a value. [s]"""
    times = curve.solve(level, extrapolate=False)
    return times[np.isfinite(times)]
