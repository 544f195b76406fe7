"""The control law of the winch behind its notch: integral, proportional and derivative part, delay and lag of a drive.

    C1(s) = [w_i/s + w_p + w_d s/(1 + s/w_f)] exp(-s T)/(1 + s/w_b)

Stability and margins take exp(-s T) itself, over frequency. As a state space the delay is a chain of equal Padé
approximants of order [8/8] (Golub and Van Loan, Matrix Computations, 2013, section 9.3.1), as many as make the phase
right to 8e-9 rad each up to a stated frequency. Their magnitude is one at all frequencies, as that of the delay. Where
the loop gain is below a third neither it nor its approximant can encircle -1; up to there both agree to 8e-9, so that
by Rouche's theorem both loops have equally many unstable poles, except where |1 + L| is as small as that.
"""

from dataclasses import dataclass
from functools import cache, reduce
from math import ceil, factorial

import numpy as np

from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import NoSolutionError
from cablestudy.system.first_order import NOTHING


@dataclass(frozen=True)
class Law:
    """The control law C1 of the module's docstring, without its gain: PID controller, delay and lag of the drive.

    Attributes
    ----------
    integral, proportional, derivative : float
        w_i [-], w_p [s], w_d [s^2]: their products with the gain of the loop [rad/s] are the gains of the controller.
    corner : float
        w_f, of the filter of the derivative part. [rad/s]
    delay : float
        T. [s]
    bandwidth : float
        w_b; infinite of a drive without lag, which only an integrator may have. [rad/s]
    """

    integral: float = 1.0
    proportional: float = 0.0
    derivative: float = 0.0
    corner: float = np.inf
    delay: float = 0.0
    bandwidth: float = np.inf

    @property
    def integrates_only(self):
        """True if there is neither a proportional nor a derivative part."""
        return not (self.proportional or self.derivative)

    @property
    def relative_gains(self):
        """Gains of the parts over the gain of the loop: w_i, w_p and w_d."""
        return self.integral, self.proportional, self.derivative

    @property
    def corners(self):
        """Poles of the filter of the derivative part and of the drive, shape (p,). [rad/s]"""
        return np.array([-omega for omega in (self.corner, self.bandwidth) if omega < np.inf], dtype=complex)

    def __call__(self, s):
        """C1, for complex s, shape (m,). [s]"""
        value = self.integral / s
        if not self.integrates_only:
            value = value + self.proportional + self.derivative * s / (1 + s / self.corner)
        if self.bandwidth < np.inf:
            value = value / (1 + s / self.bandwidth)
        if not self.delay:
            return value
        power = -s * self.delay
        return value * np.exp(np.minimum(power.real, CONTROL.followed_growth) + 1j * power.imag)

    def described(self, gain, digits=6):
        """Gains of the controller in words; `gain` multiplies the law. [rad/s]"""
        if self.integrates_only:
            return f"a gain of {gain:.{digits}g} rad/s"
        units, gains = {"integral": " rad/s", "proportional": "", "derivative": " s"}, []
        for (part, unit), relative_gain in zip(units.items(), self.relative_gains, strict=True):
            if relative_gain:
                gains.append(f"{gain * relative_gain:.{digits}g}{unit} ({part})")
        return f"gains of {', '.join(gains)}" if len(gains) > 1 else f"a gain of {gains[0]}"

    def approximants(self, highest):
        """Number of approximants that make the delay right up to a frequency [rad/s]."""
        return max(1, ceil(highest * self.delay / CONTROL.pade_phase)) if self.delay else 0

    def state_space_of(self, count):
        """`state_space` with a number of approximants of the delay; without the delay for 0."""
        chain, names = [], []
        if count:
            chain += [_pade(self.delay / count)] * count
            names += [f"delay_{k + 1}" for k in range(CONTROL.pade_order * count)]
        if self.bandwidth < np.inf:
            chain.append(self._drive)
            names += ["drive", "derivative"][: len(self._drive[0])]
        return reduce(series, chain, NOTHING), names

    @property
    def reach(self):
        """Frequency up to which the delay can be approximated. [rad/s]"""
        return CONTROL.pade_number * CONTROL.pade_phase / self.delay if self.delay else np.inf

    @property
    def judged_up_to(self):
        """Frequency above which a loop gain is not followed: whatever it does there, `check_reach` refuses. [rad/s]"""
        return CONTROL.followed_beyond * self.reach

    def check_reach(self, highest, gain):
        """Refuse a gain [rad/s] whose loop gain is above `harmless_delayed_gain` up to too high a frequency.

        Raises
        ------
        NoSolutionError
        """
        if highest > self.reach:
            turn = 2 * np.pi
            raise NoSolutionError(
                f"stability with a delay of {self.delay:.4g} s is not judged at {self.described(gain, 4)}: the "
                f"loop gain is above {CONTROL.harmless_delayed_gain:g} up to {highest / turn:.4g} Hz, "
                f"and a delay is approximated up to {self.reach / turn:.4g} Hz"
            )

    @property
    def _drive(self):
        """s times the bracket behind the lag; states: e/(1 + s/w_b), and the filter of the derivative part."""
        lag = self.bandwidth
        if not self.derivative:
            output = self.integral - self.proportional * lag
            return np.array([[-lag]]), np.array([lag]), np.array([output]), self.proportional * lag
        corner, direct = self.corner, (self.proportional + self.derivative * self.corner) * lag
        a = np.array([[-lag, 0.0], [-corner * lag, -corner]])
        return a, np.array([lag, corner * lag]), np.array([self.integral - direct, -self.derivative * corner]), direct


INTEGRATOR = Law()


def series(first, second):
    """State space a, b, c, d of two state spaces in series, each with one input and one output."""
    (a1, b1, c1, d1), (a2, b2, c2, d2) = first, second
    if not len(a1) and d1 == 1.0:
        return second
    a = np.block([[a1, np.zeros((len(a1), len(a2)))], [np.outer(b2, c1), a2]])
    return a, np.concatenate([b1, b2 * d1]), np.concatenate([d2 * c1, c2]), d1 * d2


@cache
def _pade_poles():
    """Poles of the approximant of exp(-s) in the upper half plane; its zeros are their negatives."""
    n = CONTROL.pade_order
    coefficients = [
        factorial(2 * n - k) * factorial(n) / (factorial(2 * n) * factorial(k) * factorial(n - k))
        for k in range(n, -1, -1)
    ]
    poles = np.roots(coefficients)
    return poles[poles.imag > 0]


def _pade(delay):
    """Approximant of exp(-s delay) as a state space: all-pass sections 1 - 4 r s/(s^2 + 2 r s + w^2) in a chain.

    States are scaled so that A + A^T = -C^T C: what goes in comes out or is stored, (|x|^2)' = u^2 - y^2. The
    eigenvalues of such a chain are sensitive to rounding, but none of them is moved to the right.
    """
    sections = []
    for pole in _pade_poles() / delay:
        w, r = abs(pole), -pole.real
        a = np.array([[0.0, w], [-w, -2 * r]])
        coupling = 2 * np.sqrt(r)
        sections.append((a, np.array([0.0, coupling]), np.array([0.0, -coupling]), 1.0))
    return reduce(series, sections)


def law_from(control):
    """The `Law` of a `Control`, and its integral gain, by which the law is multiplied: None where a margin decides.

    [rad/s]
    """
    turn = 2 * np.pi
    drive = {"delay": control.delay, "bandwidth": np.inf if control.bandwidth is None else turn * control.bandwidth}
    if not isinstance(control.gain, float | int):
        return Law(**drive), None
    gain = float(control.gain)
    if control.integrates_only:
        return Law(**drive), gain
    corner = np.inf if control.derivative_filter is None else turn * control.derivative_filter
    return Law(1.0, control.proportional_gain / gain, control.derivative_gain / gain, corner=corner, **drive), gain
