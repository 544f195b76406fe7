"""Overshoot, rise time and settling time of a response to a step (Ogata, Modern Control Engineering, section 5.3)."""

from dataclasses import dataclass

import numpy as np

from cablestudy.control.tolerances import CONTROL


@dataclass(frozen=True)
class StepResponse:
    """How a response to a step goes on.

    Attributes
    ----------
    final : float
        Where it ends. [as the response]
    size : float
        To which its shares refer: the final value, and of a response that is taken back the largest displacement.
    overshoot : float or None
        Largest value beyond the final one over that; None of a response that is taken back. [-]
    rise_time : float or None
        From `rise[0]` to `rise[1]` of the final value; None of a response that is taken back, or within the time. [s]
    settling_time : float or None
        From which on it stays within `settling_band` of its size about the final value; None if never. [s]
    resolved : bool
        Whether the points of time are close enough for these numbers.
    """

    final: float
    size: float
    overshoot: float | None
    rise_time: float | None
    settling_time: float | None
    resolved: bool = True

    @property
    def taken_back(self):
        """True if it ends near zero, as the response to a disturbance does."""
        return self.overshoot is None

    def agrees(self, other):
        """True if the numbers of another one are the same to `enough_points`."""
        pairs = [(getattr(self, name), getattr(other, name)) for name in ("rise_time", "settling_time")]
        if any((one is None) != (two is None) for one, two in pairs):
            return False
        near = abs((self.overshoot or 0.0) - (other.overshoot or 0.0)) <= CONTROL.enough_points
        return near and all(one is None or abs(one - two) <= CONTROL.enough_points * abs(one) for one, two in pairs)


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
    found, coarse = (_numbers(time[::k], value[::k], final, largest) for k in (1, 2))
    return found if found.agrees(coarse) else StepResponse(**vars(found) | {"resolved": False})


def _numbers(time, value, final, largest):
    """The `StepResponse` by cubic splines through points of time."""
    from scipy.interpolate import CubicSpline

    sign, goal = np.copysign(1.0, final), abs(final) / largest
    curve = CubicSpline(time, sign * value / largest)
    follows = goal >= CONTROL.taken_back
    size = goal if follows else 1.0
    overshoot = rise = None
    if follows:
        turns = curve.derivative().roots(extrapolate=False)
        highest = curve(np.append(turns[np.isfinite(turns)], time[-1])).max()
        overshoot = max(0.0, float(highest) / goal - 1.0)
        first, last = (_times(curve, share * goal).min(initial=np.inf) for share in CONTROL.rise)
        rise = float(last - first) if last < np.inf else None
    settling = None
    if abs(curve(time[-1]) - goal) <= CONTROL.settling_band * size:
        crossings = [_times(curve, goal + side * CONTROL.settling_band * size) for side in (-1, 1)]
        settling = float(np.concatenate(crossings).max(initial=0.0))
    return StepResponse(final, size * largest, overshoot, rise, settling)


def _times(curve, level):
    """When a curve has a value."""
    times = curve.solve(level, extrapolate=False)
    return times[np.isfinite(times)]
