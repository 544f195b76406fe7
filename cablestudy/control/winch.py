"""The winch loop: an integrator with a notch that moves a cable end to hold the gondola.

With x the gondola's place, u the winch's and F a force on the gondola:

    (M s^2 + k_xx) x + k_xu u = F,    u = -C(s) x on the ground,  u = +C(s) x on the gondola

On the ground (A) the winch moves end 1; on the gondola (B) end 2 stands at x + u, so that k_xu = k_xx. Either way the
loop gain is L = C G with G(0) = 1.

Stability is decided by counting how often L passes the negative real axis beyond -1 (Nyquist), each passage located to
rounding; no matrix of the size of the model is factorised.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cablestudy.control.ends import GONDOLA, GROUND, EndModel, Transfer
from cablestudy.control.gondola import coupled_modes
from cablestudy.errors import NoSolutionError

ASIDE = np.concatenate([[0.0], 0.2 * 1.6 ** np.arange(16)])  # grid beside a pole, in half-widths
PER_DECADE = 40
REACH = 0.12  # of a pole's frequency: farther aside the grid of all decades is the finer one
BESIDE = 1e-4  # of its size, beside a pole, where it is asked how much the gondola moves there
NEAR = 20  # times the gondola's frequency
SECANT_STEPS = 40
SETTLED = 1e-8  # relative change: the error left is that of the last two steps, multiplied
ROOT_STEPS = 120
FOLLOWED = 300  # steps at most in which a pole is followed over the gain
UNDAMPED = 1e-8  # damping ratio of the gondola below which it is taken for none


@dataclass(frozen=True)
class Notch:
    """N(s) = [(s^2 + 2 z1 w1 s + w1^2)/w1^2] [w2^2/(s^2 + 2 z2 w2 s + w2^2)].

    Attributes
    ----------
    omega, damping_ratio : float
        Of the notch. [rad/s], [-]
    rolloff_omega, rolloff_damping_ratio : float
        [rad/s], [-]
    """

    omega: float
    damping_ratio: float
    rolloff_omega: float
    rolloff_damping_ratio: float

    def __call__(self, s):
        """Value at s. [-]"""
        zero = (s**2 + 2 * self.damping_ratio * self.omega * s + self.omega**2) / self.omega**2
        pole = s**2 + 2 * self.rolloff_damping_ratio * self.rolloff_omega * s + self.rolloff_omega**2
        return zero * self.rolloff_omega**2 / pole


@dataclass(frozen=True)
class Passages:
    """Where the loop gain for a gain of 1 rad/s passes the negative real axis.

    Attributes
    ----------
    omega : ndarray, shape (k,)
        [rad/s]
    depth : ndarray, shape (k,)
        -L there: the loop is at its limit for a gain of 1/depth. [s/rad]
    turn : ndarray of int, shape (k,)
        +1 from below to above (two poles to the right once the gain is above 1/depth), -1 back.
    """

    omega: np.ndarray
    depth: np.ndarray
    turn: np.ndarray

    def unstable_poles(self, gain):
        """How many closed-loop poles lie to the right at a gain."""
        return int(2 * self.turn[self.depth * gain > 1].sum())

    @property
    def largest_gain(self):
        """Below it the loop is stable; None when it always is. [rad/s]"""
        for depth in np.sort(self.depth)[::-1]:
            if self.turn[self.depth >= depth].sum() != 0:
                return float(1 / depth)
        return None


@dataclass(frozen=True)
class Loop:
    """Gondola, cable and winch.

    Attributes
    ----------
    cable : EndModel
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
    gain : float
        k_i of C = (k_i/s) N(s). [rad/s]
    notch : Notch or None
    undamped : tuple of 2 ndarray or None
        `coupled`, where it is known already.
    """

    cable: EndModel
    mass: float
    location: str = "ground"
    gain: float = 0.0
    notch: Notch | None = None
    undamped: tuple | None = None

    @property
    def at_rest(self):
        """The same with the winch held."""
        return replace(self, gain=0.0)

    @cached_property
    def felt(self):
        """The cable with only the modes that the gondola or the winch feels."""
        # by the mass p^2/W^4 that moves: p itself grows with the stiffness, and would hide all but axial modes
        size = np.abs(self.cable.participation[:, [GONDOLA, GROUND]]).max(axis=1, initial=0.0) / self.cable.omega**2
        return self.cable.select(np.flatnonzero(size > 1e-9 * size.max(initial=0.0)))

    @cached_property
    def _transfer(self):
        return Transfer(self.felt, [GONDOLA], [GONDOLA, GROUND])

    def stiffness(self, s):
        """k_xx, and what the winch acts through with the sign of the loop, each of shape (m,). [N/m]"""
        both = self._transfer(s)[:, 0]
        return both[:, 0], both[:, 0] if self.location == "gondola" else -both[:, 1]

    def controller(self, s):
        """C over its gain. [s]"""
        return (1 / s) if self.notch is None else self.notch(s) / s

    def compliances(self, s):
        """x/F without and with control, each of shape (m,). [m/N]"""
        own, driven = self.stiffness(s)
        alone = self.mass * s**2 + own
        return 1 / alone, 1 / (alone + self.gain * self.controller(s) * driven)

    def unit_gain(self, s):
        """L for a gain of 1 rad/s, shape (m,). [-]"""
        own, driven = self.stiffness(s)
        return self.controller(s) * driven / (self.mass * s**2 + own)

    @cached_property
    def coupled(self):
        """Undamped frequencies of gondola and cable [Hz] and the gondola's share in them, each of shape (k,)."""
        if self.undamped is not None:
            return self.undamped
        cable = self.felt
        square, first = cable.omega**2, cable.participation[:, GONDOLA] ** 2
        omitted = max(float(cable.residual_inertia[GONDOLA, GONDOLA]), 0.0)
        moments = ((first / square**2).sum() + omitted, (first / square**3).sum(), (first / square**4).sum())
        return coupled_modes(
            self.mass,
            float(cable.stiffness[GONDOLA, GONDOLA]),
            cable.omega / (2 * np.pi),
            cable.participation[:, GONDOLA],
            moments,
        )

    @cached_property
    def cable_poles(self):
        """Poles of the cable with fixed ends, upper half plane and real axis. [rad/s]"""
        cable = self.felt
        if cable.strain is not None and len(cable.omega):
            value = cable.poles[0]
            return 1j * np.sqrt(value) if cable.strain.law == "hysteretic" else value[value.imag >= 0]
        ratio = cable.damping_ratio.astype(complex)
        bend = np.sqrt(ratio**2 - 1)
        poles = np.concatenate([cable.omega * (bend - ratio), -cable.omega * (bend + ratio)])
        return poles[poles.imag >= 0]

    @cached_property
    def open_poles(self):
        """Poles of gondola and cable without control, upper half plane and real axis, shape (k,). [rad/s]"""
        if self.cable.strain is not None:
            begin = _poles_of_strain(self.felt, self.mass)
        else:
            frequency, share = self.coupled
            omega = 2 * np.pi * frequency
            ratio = np.interp(omega, self.felt.omega, self.felt.damping_ratio) if len(self.felt.omega) else 0 * omega
            ratio = (ratio * (1 - share)).astype(complex)
            begin = omega * (np.sqrt(ratio**2 - 1) - ratio)
        found = self._zeros(0.0, begin)
        # beside a mode that is hardly felt the pole cannot be told from the mode's own
        return np.where(np.isfinite(found), found, begin)

    @cached_property
    def gondola_pole(self):
        """That of the motion in which the gondola moves most, without control. [rad/s]"""
        frequency, share = self.coupled
        poles = self.open_poles
        if self.cable.strain is not None and len(poles) > 1:
            # damped strain moves it past others: of those where M s^2 + k_xx rises as slowly as M s^2, to either side
            aside = BESIDE * np.abs(poles) * np.array([[1j], [-1j]])
            places = poles + aside
            with np.errstate(divide="ignore", invalid="ignore"):
                rise = np.abs(self.mass * places**2 + self.stiffness(places.ravel())[0].reshape(places.shape))
                felt = np.nan_to_num((np.abs(2 * self.mass * poles * aside) / rise).min(axis=0))
            poles = poles[felt >= felt.max() / 3]
        return poles[np.argmin(np.abs(np.abs(poles) - 2 * np.pi * frequency[np.argmax(share)]))]

    def near(self, poles):
        """Those poles that are not far above the gondola's: the others are hardly moved by the winch, nor felt."""
        return poles[np.abs(poles) < NEAR * np.abs(self.gondola_pole)]

    @cached_property
    def closed_poles(self):
        """Poles that the open ones and the passages lead to, for laying a grid; not all of them, not for counting."""
        begin = np.concatenate([self.near(self.open_poles), 1j * self.passages.omega])
        found = self._zeros(self.gain, begin)
        return found[np.isfinite(found) & (found.imag > 0)]

    def visible(self, poles):
        """Those poles that no pole of the cable, which is a zero of x/F, cancels but for a tenth of their width."""
        if not len(self.cable_poles) or not len(poles):
            return poles
        apart = np.abs(poles[:, None] - self.cable_poles).min(axis=1)
        return poles[apart > 0.1 * np.abs(poles.real)]

    def _zeros(self, gain, begin):
        """Poles of the loop near some places, at one gain or a gain each; NaN where there is none near."""
        poles = self.cable_poles
        if self.notch is not None:
            damping, sign = complex(self.notch.rolloff_damping_ratio), np.array([1, -1])
            poles = np.append(poles, self.notch.rolloff_omega * (sign * np.sqrt(damping**2 - 1) - damping))
        near = poles[np.argmin(np.abs(begin[:, None] - poles), axis=1)] if len(poles) else None

        def balance(s):
            own, driven = self.stiffness(s)
            value = self.mass * s**2 + own + gain * self.controller(s) * driven
            # a zero hides beside a pole of cable or notch, without which it is as plain as any other
            return value if near is None else value * (s - near)

        return _secant(balance, begin)

    def _growing(self):
        """Poles to the right, each followed from where it passes the imaginary axis. [rad/s]"""
        passed = self.passages
        out = (passed.turn > 0) & (passed.depth * self.gain > 1)
        s, begin = 1j * passed.omega[out], 1 / passed.depth[out]
        steps = int(min(FOLLOWED, 2 + np.log(self.gain / begin.min()) / np.log(1.25)))
        for part in np.linspace(0, 1, steps + 1)[1:]:
            found = self._zeros(begin ** (1 - part) * self.gain**part, s)
            s = np.where(np.isfinite(found), found, s)
        # should one be lost on the way, it is looked for about there
        about = np.outer(np.abs(s), np.outer(np.geomspace(0.1, 10, 9), np.exp(1j * np.linspace(0.1, 1.5, 6))).ravel())
        final = self._zeros(self.gain, np.concatenate([s, about.ravel()]))
        every = np.concatenate([final[np.isfinite(final)], self.closed_poles])
        return every[every.real > 0]

    @cached_property
    def grid(self):
        """Angular frequencies that resolve every pole of the cable and of the gondola on it. [rad/s]"""
        poles = [self.visible(self.open_poles), self.cable_poles]
        if self.notch is not None:
            poles.append(self.notch.omega * (1j - np.array([self.notch.damping_ratio])))
        poles = np.concatenate(poles)
        centre = np.abs(poles)
        width = np.maximum(np.abs(poles.real), 1e-9 * centre)[:, None] * ASIDE
        low, high = 1e-4 * centre.min(), 1e3 * centre.max()
        smooth = np.geomspace(low, high, int(PER_DECADE * np.log10(high / low)))
        beside = np.where(width < REACH * centre[:, None], width, 0.0)
        points = np.unique(
            np.concatenate([smooth, (centre[:, None] + beside).ravel(), (centre[:, None] - beside).ravel()])
        )
        return points[np.concatenate([[True], np.diff(points) > 1e-14 * points[1:]])]

    @cached_property
    def _sampled(self):
        """The grid and the unit gain on it, but for places upon the pole of an undamped mode, which have no value."""
        self.check_damped()
        with np.errstate(divide="ignore", invalid="ignore"):
            value = self.unit_gain(1j * self.grid)
        there = np.isfinite(value)
        return self.grid[there], value[there]

    @property
    def _on_grid(self):
        return self._sampled[1]

    def _brackets(self, where):
        """The grid intervals of some places."""
        grid = self._sampled[0]
        return grid[where], grid[where + 1]

    @cached_property
    def passages(self):
        """See `Passages`."""
        value = self._on_grid
        where = np.flatnonzero(
            (value.imag[:-1] * value.imag[1:] < 0) & (np.minimum(value.real[:-1], value.real[1:]) < 0)
        )
        omega = _between(lambda w: self.unit_gain(1j * w).imag, *self._brackets(where))
        depth = -self.unit_gain(1j * omega).real if len(omega) else np.zeros(0)
        turn = np.where(value.imag[where] < 0, 1, -1)
        keep = depth > 0
        return Passages(omega[keep], depth[keep], turn[keep])

    @property
    def largest_gain(self):
        """Below it the loop is stable; None when it always is. [rad/s]"""
        return self.passages.largest_gain

    @property
    def gain_margin(self):
        """Largest stable gain over the gain; None when there is no limit. [dB]"""
        limit = self.largest_gain
        return None if limit is None or not self.gain else float(20 * np.log10(limit / self.gain))

    @property
    def phase_margin(self):
        """Least angle between L and -1 where |L| = 1, over all such places; None when there is none. [deg]"""
        size = np.abs(self.gain * self._on_grid) - 1
        where = np.flatnonzero(size[:-1] * size[1:] < 0)
        omega = _between(lambda w: np.abs(self.gain * self.unit_gain(1j * w)) - 1, *self._brackets(where))
        if not len(omega):
            return None
        angle = np.degrees(np.angle(-self.unit_gain(1j * omega)))
        return float(np.abs(angle).min())

    @property
    def bandwidth(self):
        """Where the closed loop L/(1 + L) first falls to 1/sqrt(2); None when it never does. [Hz]"""

        def excess(omega):
            loop = self.gain * self.unit_gain(1j * omega)
            return np.abs(loop / (1 + loop)) - np.sqrt(0.5)

        loop = self.gain * self._on_grid
        value = np.abs(loop / (1 + loop)) - np.sqrt(0.5)
        where = np.flatnonzero((value[:-1] > 0) & (value[1:] <= 0))[:1]
        omega = _between(excess, *self._brackets(where))
        return float(omega[0] / (2 * np.pi)) if len(omega) else None

    def check_damped(self):
        """Refuse a gondola whose resonance nothing bounds.

        Raises
        ------
        NoSolutionError
        """
        pole = self.gondola_pole
        if -pole.real < UNDAMPED * np.abs(pole):
            raise NoSolutionError(
                f"undamped: the damping ratio of the gondola at {np.abs(pole) / (2 * np.pi):.4g} Hz is "
                f"{max(0.0, -pole.real / np.abs(pole)):.2g}, below {UNDAMPED:g}, so that no RMS is finite and no gain "
                f"stable (cable.damping, or more elements)"
            )

    def check_stable(self):
        """Refuse an unstable loop.

        Raises
        ------
        NoSolutionError
            With an unstable pole and the largest stable gain; or the gondola is not damped.
        """
        self.check_damped()
        if not self.gain or not self.passages.unstable_poles(self.gain):
            return
        right = self._growing()
        pole = ""
        if len(right):
            worst = right[np.argmax(right.real)]
            pole = f": a motion of {worst.imag / (2 * np.pi):.4g} Hz grows by {worst.real:.3g} 1/s"
        raise NoSolutionError(
            f"unstable loop at a gain of {self.gain:.6g} rad/s{pole}; "
            f"the largest stable gain is {self.largest_gain:.6g} rad/s"
        )

    def with_margin(self, margin):
        """The same loop with the gain that leaves a margin.

        Parameters
        ----------
        margin : float
            Of gain. [dB]

        Returns
        -------
        Loop

        Raises
        ------
        NoSolutionError
            No gain makes this loop unstable, so that none follows from a margin.
        """
        if self.largest_gain is None:
            raise NoSolutionError("no gain follows from a gain margin: the loop is stable for every gain")
        return replace(self, gain=self.largest_gain / 10 ** (margin / 20))


def _poles_of_strain(cable, mass):
    """Poles of a gondola on a cable whose strain is damped, upper half plane and real axis, to rounding. [rad/s]"""
    n, strain = len(cable.omega), cable.strain
    carried = -cable.participation[:, [GONDOLA]] / cable.omega[:, None] ** 2
    total = mass + cable.inertia[GONDOLA, GONDOLA]

    def whole(modes, coupling, end):
        # the gondola scaled to unit mass, like the modes
        corner = np.array([[end / total]])
        return np.block([[modes, coupling / np.sqrt(total)], [coupling.T / np.sqrt(total), corner]])

    inertia = whole(np.eye(n), carried, total)
    stiff = whole(np.diag(cable.omega**2), np.zeros((n, 1)), cable.stiffness[GONDOLA, GONDOLA])
    elastic = whole(strain.modes, strain.coupling[:, [GONDOLA]], strain.ends[GONDOLA, GONDOLA])
    if strain.law == "hysteretic":
        return 1j * np.sqrt(np.linalg.eigvals(np.linalg.solve(inertia, stiff + 1j * strain.amount * elastic)))
    stiff, elastic = np.linalg.solve(inertia, stiff), np.linalg.solve(inertia, strain.amount * elastic)
    one, none = np.eye(n + 1), np.zeros((n + 1, n + 1))
    fast = np.linalg.eigvals(np.block([[none, one], [-stiff, -elastic]]))
    # the slow ones are lost in rounding beside the fast ones, and are the fast ones of the inverse
    slow = 1 / np.linalg.eigvals(np.block([[-np.linalg.solve(stiff, elastic), -np.linalg.inv(stiff)], [one, none]]))
    middle = np.sqrt(np.abs(fast).max() * np.abs(slow).min())
    value = np.concatenate([fast[np.abs(fast) > middle], slow[np.abs(slow) <= middle]])
    return value[value.imag >= 0]


def _secant(function, begin):
    """Complex zeros near some places, by the secant method; what does not settle becomes NaN."""
    s = np.array(begin, dtype=complex)
    change = np.full(s.shape, np.inf)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # at a pole there is no value
        before = s * (1 + 1e-7)
        last = function(before)
        for _ in range(SECANT_STEPS):
            value = function(s)
            rise = value - last
            move = np.where(rise != 0, value * (s - before) / np.where(rise != 0, rise, 1.0), 0.0)
            size, limit = np.abs(move), 0.3 * np.abs(s)
            move = np.where(size > limit, move * limit / np.where(size > 0, size, 1.0), move)
            settled = change < SETTLED  # a secant through two places that are one leads nowhere
            before, last, s = s, value, np.where(settled, s, s - move)
            change = np.where(settled, change, np.abs(move) / np.abs(s))
            if (change < SETTLED).all():
                break
        return np.where(change < 1e-8, s, np.nan)


def _between(function, low, high):
    """Zeros of a real function, one in each bracket: false position after Anderson and Bjoerck (1973).

    scipy.optimize.elementwise.find_root does the same in three times the time, for want of simplicity.
    """
    a, b = np.array(low), np.array(high)
    values = function(np.concatenate([a, b]))
    fa, fb = values[: len(a)], values[len(a) :]
    settled = np.zeros(len(a), dtype=bool)
    for step in range(ROOT_STEPS):
        rise = fb - fa
        place = b - fb * (b - a) / np.where(rise != 0, rise, 1.0)
        inside = (place - a) * (place - b) <= 0
        place = np.where(inside & (step % 8 != 7), place, (a + b) / 2)
        settled |= (fb == 0) | (np.minimum(np.abs(place - b), np.abs(b - a)) <= 1e-12 * np.abs(b))
        if settled.all():
            break
        place = np.where(settled, b, place)
        value = function(place)
        across = value * fb <= 0
        share = 1 - value / np.where(fb != 0, fb, 1.0)
        a, fa = np.where(across, b, a), np.where(across, fb, fa * np.where(share > 0, share, 0.5))
        b, fb = place, value
    return b
