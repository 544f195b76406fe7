"""What the winch acts on: gondola, cable and notch, all that does not depend on the gain.

With x the gondola's place, u the winch's and F a force on the gondola:

    (M s^2 + c s + k_xx) x + k_xu u = F,    u = -C(s) x on the ground,  u = +C(s) x on the gondola

C = gain C1(s) N(s), C1 the control law (`law`), 1/s of an integrator, c viscous damping by the air. On the ground
the winch moves end 1; on the gondola end 2 stands at x + u, so that k_xu = k_xx. Either way the loop gain is
L = gain L1 with L1 = C1 N G, G(0) = 1.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cablestudy.control.gain_limits import UNDAMPED
from cablestudy.control.gondola import gondola_mode
from cablestudy.control.law import INTEGRATOR, Law
from cablestudy.control.margins_grid import frequencies
from cablestudy.control.notch import Notch
from cablestudy.control.stability import LargestGain, largest_gain, loop_up_to
from cablestudy.errors import NoSolutionError
from cablestudy.system.first_order import Allocation, equations
from cablestudy.system.linear import assemble, upper
from cablestudy.system.superelement import GONDOLA, GROUND, Superelement

POLES = 1e-5, 1e-9  # error of the poles by modes that are left out, and variance that these have at resonance
CANCELLED = 0.1  # distance of a pole from a zero, over its width, up to which they cancel
APART = 0.3  # relative distance of the gondola's pole from all others, so that it needs no eigenvector to be found
LARGE = 0.3  # of the largest share in the gondola's static compliance
NEWTON_STEPS = 30
NEAR = 20  # times the gondola's frequency: beyond it resonances need no breakpoints of their own


@dataclass(frozen=True)
class Plant:
    """Gondola, cable and what filters the winch.

    Attributes
    ----------
    cable : Superelement
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
    notch : Notch or None
    natural : float or None
        Undamped frequency of the gondola's mode, where it is known already. [rad/s]
    tolerance : float
        Relative error of the response that modes may cause which are left out of it; 0 keeps all. [-]
    resolved : callable or None
        For stability: (Plant, gain [rad/s], factor of the orders of its elements) -> Superelement whose modes are right
        as far as the gain could drive them, and the frequency up to which they are [rad/s]. Without it all modes of
        `cable` count.
    known : dict
        Verdicts by gain; "limit": `LargestGain`, None, or the error that says why there is none. Models of the same
        plant at several levels of refinement share it: cables of their own decide on it.
    damping : float
        Viscous, on the gondola. [N s/m]
    law : Law
        What the winch does with what the notch passes.
    """

    cable: Superelement
    mass: float
    location: str = "ground"
    notch: Notch | None = None
    natural: float | None = None
    tolerance: float = 0.0
    resolved: Callable | None = field(default=None, compare=False)
    known: dict = field(default_factory=dict, repr=False, compare=False)
    damping: float = 0.0
    law: Law = INTEGRATOR

    @property
    def winch_end(self):
        """Which of the six ends the winch moves."""
        return GONDOLA if self.location == "gondola" else GROUND

    @property
    def ends(self):
        """Which of the six ends the gondola and the winch move."""
        return GONDOLA, self.winch_end

    @cached_property
    def _limit(self):
        """`Limit` or None, or the error that says why there is none."""
        if "limit" not in self.known:
            try:
                self.known["limit"] = largest_gain(self)
            except NoSolutionError as error:
                self.known["limit"] = error
        known = self.known["limit"]
        return known.of(self) if isinstance(known, LargestGain) else known

    @property
    def limit_error(self):
        """Estimated relative error of the largest gain; 0 where it is not known. [-]"""
        known = self.known.get("limit")
        return known.error if isinstance(known, LargestGain) else 0.0

    @property
    def largest_gain(self):
        """Below it the loop is stable; None when it always is; see `stability.largest_gain`. [rad/s]"""
        if isinstance(self._limit, NoSolutionError):
            raise self._limit
        return self._limit and self._limit.factor

    @property
    def limit_frequency(self):
        """Where the largest gain puts a pole on the imaginary axis; None where there is no such gain. [Hz]"""
        return self.largest_gain and self._limit.omega / (2 * np.pi)

    def stable(self, gain):
        """Whether the loop is stable with a gain [rad/s]; raises as `stability.ResolvedLoop`."""
        if gain not in self.known:
            found = loop_up_to(self, gain)
            self.known[gain] = found.unstable(found.gain) == 0
        return self.known[gain]

    def controller(self, s):
        """C over its gain. [s]"""
        if self._integrator:
            return (1 / s) if self.notch is None else self.notch(s) / s
        return self.law(s) if self.notch is None else self.law(s) * self.notch(s)

    @cached_property
    def _integrator(self):
        return self.law == INTEGRATOR

    @property
    def broad(self):
        """Whether the law is no integrator, so that the loop gain may be large far above the gondola's frequency."""
        return not self._integrator

    @property
    def drives_every_mode(self):
        """Whether each mode that moves the gondola counts: of no integrator, or of a gondola lighter than its cable."""
        return self.broad or self.mass < float(self.cable.inertia[GONDOLA, GONDOLA])

    def right_up_to(self, omega):
        """Up to where a delay is right in a state space with modes of some frequencies. [rad/s]"""
        return min(max(omega.max(initial=0.0), NEAR * self.main), self.law.reach) if self.law.delay else 0.0

    def said(self, gain, digits=6):
        """The gain of the controller in words."""
        return self.law.said(gain, digits)

    def system_of(self, cable):
        """`LinearSystem` of the gondola on a model of the cable, driven by the winch."""
        unit = np.eye(6)
        system = assemble([cable], unit[:, [GONDOLA]], np.array([[self.mass]]), unit[:, [self.winch_end]])
        if not self.damping:
            return system
        damping = system.damping.copy()
        damping[-1, -1] += self.damping
        return replace(system, damping=damping)

    def closed_of(self, cable, highest=None):
        """A of the closed loop with a model of the cable, as A0 + gain A1; a delay is right up to `highest` [rad/s]."""
        return self.feedback(self.system_of(cable), highest)

    def feedback(self, system, highest=None):
        """The same of a `LinearSystem` of gondola and cable."""
        measured = np.zeros((1, len(system)))
        measured[0, -1] = 1.0 if self.location == "gondola" else -1.0
        highest = self.right_up_to(np.zeros(0)) if highest is None else highest
        law, _ = self.law.state_space(highest)
        found = equations(system, Allocation(measured, np.array([[-1.0]])), (self.notch,), law)
        return found.fixed, found.scaled[0]

    def balance_of(self, cable, s, gain):
        """M s^2 + c s + k_xx + C k_xu, with the sign of the loop, which is zero at its poles, shape (m,). [N/m]"""
        own, driven = self.stiffness_of(cable, s)
        return self.alone(s, own) + gain * self.controller(s) * driven

    def unit_gain_of(self, cable, s):
        """L for a gain of 1 rad/s with a model of the cable, shape (m,). [-]"""
        own, driven = self.stiffness_of(cable, s)
        return self.controller(s) * driven / self.alone(s, own)

    @np.errstate(divide="ignore", invalid="ignore")  # on the pole of an undamped mode it is infinite
    def unit_matrix(self, cable, s):
        """The same as matrices, shape (m, 1, 1)."""
        return self.unit_gain_of(cable, s)[:, None, None]

    def frequencies(self, poles):
        """`margins_grid.frequencies` of some poles with this notch and law. [rad/s]"""
        return frequencies(poles, (self.notch,), self.law)

    def alone(self, s, own):
        """M s^2 + c s + k_xx, k_xx being `own`, shape (m,). [N/m]"""
        return self.mass * s**2 + self.damping * s + own

    def unit_gain(self, s):
        """L for a gain of 1 rad/s, shape (m,). [-]"""
        return self.unit_gain_of(self.responding, s)

    def stiffness(self, s):
        """See `stiffness_of`, with the modes that the response needs."""
        return self.stiffness_of(self.responding, s)

    def stiffness_of(self, cable, s):
        """k_xx, and what the winch acts through with the sign of the loop, each of shape (m,). [N/m]"""
        if self.location == "gondola":
            own = cable.dynamic_stiffness(s, [GONDOLA], [GONDOLA])[:, 0, 0]
            return own, own
        both = cable.dynamic_stiffness(s, [GONDOLA], [GONDOLA, GROUND])[:, 0]
        return both[:, 0], -both[:, 1]

    @cached_property
    def excited(self):
        """The cable with only the modes that the gondola or the winch moves."""
        # by the mass p^2/W^4 that moves: p itself grows with the stiffness, and would hide all but axial modes
        size = np.abs(self.cable.coupling[:, [GONDOLA, GROUND]]).max(axis=1, initial=0.0)
        chosen = size > 1e-9 * size.max(initial=0.0)
        return self.cable if chosen.all() else self.cable.select(np.flatnonzero(chosen))

    @cached_property
    def responding(self):
        """The cable with the modes that the response needs to its tolerance."""
        cable = self.excited
        # with modal damping a mode costs next to nothing; uneven viscous damping couples all of them
        if cable.strain is None or cable.uneven or not self.tolerance:
            return cable
        return cable.select(self.needed(cable, self.tolerance, self.tolerance))

    @cached_property
    def pole_modes(self):
        """Modes of `excited` that matter for where poles are."""
        return self.needed(self.excited, *POLES)

    @cached_property
    def pole_model(self):
        """The cable with these modes."""
        return self.excited.condense(self.pole_modes)

    @cached_property
    def _pole_system(self):
        return self.system_of(self.pole_model)

    @property
    def coupled(self):
        """Undamped frequencies of gondola and cable [Hz], and their shares in the gondola's static compliance."""
        omega, shares = self.system_of(self.excited).modes
        return omega / (2 * np.pi), shares[0]

    @cached_property
    def main(self):
        """Undamped frequency of the gondola's mode. [rad/s]"""
        if self.natural is not None:
            return self.natural
        frequency, share = self.coupled
        return float(2 * np.pi * frequency[gondola_mode(share)])

    def needed(self, cable, shift, variance, about=None, raised=None):
        """Modes of a cable that change the gondola's motion.

        Parameters
        ----------
        cable : Superelement
        shift : float
            Relative change of the gondola's motion near its frequency that the others may make together.
        variance : float
            Share of the variance in the wind that the others may have at their resonances.
        about : float
            Another frequency than the gondola's. [rad/s]
        raised : callable, optional
            By which factors the variance is weighted at frequencies [Hz], over that at the gondola's. [-]

        Returns
        -------
        ndarray of int
        """
        main = about or self.main
        omega, static = cable.omega, float(cable.stiffness[GONDOLA, GONDOLA])
        own, other = (np.abs(cable.coupling[:, end]) for end in (GONDOLA, self.winch_end))
        total = self.mass + max(float(cable.inertia[GONDOLA, GONDOLA]), 0.0)
        near = np.minimum(1.0, 3 * main / omega)
        change = own * np.maximum(own, other) / total * near**2
        loss, decay = 0.0, cable.decay
        if cable.strain is not None:
            loss = float(np.abs(cable.strain.factor(1j * main)))
            coupled = (cable.strain.modes / omega[:, None] / omega) ** 2
            np.fill_diagonal(coupled, 0.0)
            held = np.abs(cable.strain.coupling[:, GONDOLA]) / (omega * np.sqrt(static))
            change = change + loss**2 * (coupled.max(axis=1, initial=0.0) * near + held**2)
            change = change + loss * held * own * near * main / np.sqrt(static)
        # at its resonance the mode moves the gondola by phi, and the gondola's stiffness damps it
        moved = self._moved(cable)
        decay = decay + moved**2 * loss * static / (2 * omega)
        whole = max(float(loss), 1e-3) * main / 2 + self.damping / (2 * self.mass)
        ratio = np.where(decay > 0, whole / np.where(decay > 0, decay, 1.0), np.inf)
        finite = np.where(np.isfinite(ratio), ratio, 1e12)
        resonant = np.where(moved > 0, (moved * np.sqrt(self.mass)) ** 4, 0.0) * finite
        resonant = resonant * np.where(omega > main, 1.0, (main / omega) ** 3)
        if raised is not None:
            resonant = resonant * raised(omega / (2 * np.pi))
        return np.union1d(largest(change, shift), largest(resonant, variance))

    def _moved(self, cable):
        """About by how much each mode of a cable at its resonance moves the gondola, shape (n,). [1/sqrt(kg)]"""
        static, omega = float(cable.stiffness[GONDOLA, GONDOLA]), cable.omega
        force = np.abs(cable.coupling[:, GONDOLA]) * omega**2
        return force / np.maximum(np.abs(static - self.mass * omega**2), 0.03 * static)

    @cached_property
    def closed(self):
        """A of the closed loop as A0 + gain A1, with the modes that matter for where poles are."""
        return self.feedback(self._pole_system)

    @cached_property
    def _closed_poles(self):
        return {}

    def closed_poles(self, gain):
        """Poles with control, upper half plane and real axis, shape (k,). [rad/s]"""
        if gain not in self._closed_poles:
            fixed, scaled = self.closed
            self._closed_poles[gain] = upper(np.linalg.eigvals(fixed + gain * scaled))
        return self._closed_poles[gain]

    @cached_property
    def open_poles(self):
        """Poles of gondola and cable without control, upper half plane and real axis, shape (k,). [rad/s]"""
        return self._pole_system.poles

    @cached_property
    def gondola_pole(self):
        """Of the poles without control with a large share in the static compliance of the gondola the one nearest to
        the gondola's undamped frequency. [rad/s]"""
        poles = self.open_poles
        close = np.abs(np.abs(poles) - self.main) < APART * self.main
        if close.sum() != 1:  # the eigenvectors decide
            poles, shares = self._pole_system.pole_shares
            close = shares[0] >= LARGE * shares[0].max()
        poles = poles[close]
        return self.pole_near(complex(poles[np.argmin(np.abs(np.abs(poles) - self.main))]), self.excited)

    def pole_near(self, s, cable, gain=0.0):
        """A pole near a place with a model of the cable, by the secant method; the place where it does not settle."""
        begin, before = s, s * (1 + 1e-6)
        last = complex(self.balance_of(cable, np.array([before]), gain)[0])
        for _ in range(NEWTON_STEPS):
            value = complex(self.balance_of(cable, np.array([s]), gain)[0])
            if value == last:
                return s
            change = value * (s - before) / (value - last)
            before, last, s = s, value, s - change
            if not abs(s - begin) < 0.1 * abs(begin):
                return begin
            if abs(change) <= 1e-13 * abs(s):
                return s
        return begin

    def observable(self, poles):
        """Those poles of x/F that no zero cancels: no pole of the cable with fixed ends. [rad/s]"""
        zeros = self.pole_model.poles
        if not len(zeros) or not len(poles):
            return poles
        gap = np.abs(poles[:, None] - zeros).min(axis=1)
        return poles[gap > CANCELLED * np.abs(poles.real)]

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


def largest(sizes, allowed):
    """Numbers of the largest of some sizes, so many that the sum of the others is at most `allowed`."""
    order = np.argsort(sizes, kind="stable")
    omitted = np.searchsorted(np.cumsum(sizes[order]), allowed, side="right")
    return order[omitted:]
