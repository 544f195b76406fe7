"""What the winch acts on: gondola, cable and notch, all that does not depend on the gain.

With x the gondola's place, u the winch's and F a force on the gondola:

    (M s^2 + k_xx) x + k_xu u = F,    u = -C(s) x on the ground,  u = +C(s) x on the gondola

On the ground (A) the winch moves end 1; on the gondola (B) end 2 stands at x + u, so that k_xu = k_xx. Either way the
loop gain is L = C G with G(0) = 1.

What takes iterations is done for many plants at once; a single one is a batch of one.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.control.ends import GONDOLA, GROUND
from cablestudy.control.gondola import coupled_modes_of
from cablestudy.control.nyquist import LIGHT, curves_of, passages_of, whole_curve
from cablestudy.control.together import Together, zeros_of
from cablestudy.control.transfer import Transfer
from cablestudy.errors import CablestudyError, NoSolutionError

NEAR = 20  # times the gondola's frequency
SEEN = 0.1  # of its width: the distance of a pole of the plant from one of the cable up to which they cancel
FAINT = 3e-5  # the same up to which nothing of either is left
BESIDE = 1e-4  # of its size, beside a pole, where it is asked how much the gondola moves there
UNDAMPED = 1e-8  # damping ratio of the gondola below which it is taken for none


class Plant:
    """Gondola, cable and what filters the winch.

    Parameters
    ----------
    cable : EndModel
    mass : float
        Of the gondola. [kg]
    location : {"ground", "gondola"}
    notch : Notch or None
    undamped : tuple of 2 ndarray or None
        `coupled`, where it is known already.
    """

    def __init__(self, cable, mass, location, notch, undamped=None):
        self.cable, self.mass, self.location, self.notch, self.undamped = cable, mass, location, notch, undamped

    @cached_property
    def felt(self):
        """The cable with only the modes that the gondola or the winch feels."""
        # by the mass p^2/W^4 that moves: p itself grows with the stiffness, and would hide all but axial modes
        size = np.abs(self.cable.participation[:, [GONDOLA, GROUND]]).max(axis=1, initial=0.0) / self.cable.omega**2
        chosen = size > 1e-9 * size.max(initial=0.0)
        return self.cable if chosen.all() else self.cable.select(np.flatnonzero(chosen))

    @cached_property
    def transfer(self):
        """Force on the gondola for a displacement of its end, and of the winch's."""
        return Transfer(self.felt, [GONDOLA], [GONDOLA, GROUND])

    def stiffness(self, s):
        """k_xx, and what the winch acts through with the sign of the loop, each of shape (m,). [N/m]"""
        own, other = self.transfer.rows(s)
        return own, own if self.location == "gondola" else -other

    def controller(self, s):
        """C over its gain. [s]"""
        return (1 / s) if self.notch is None else self.notch(s) / s

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
        stiffness = float(cable.stiffness[GONDOLA, GONDOLA])
        problem = self.mass, stiffness, cable.omega / (2 * np.pi), cable.participation[:, GONDOLA], moments
        return coupled_modes_of([problem])[0]

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
    def first_poles(self):
        """About where the poles without control are, those hardly felt to rounding. [rad/s]"""
        if self.cable.strain is not None:
            return _poles_of_strain(self.felt, self.mass)
        frequency, share = self.coupled
        omega = 2 * np.pi * frequency
        ratio = np.interp(omega, self.felt.omega, self.felt.damping_ratio) if len(self.felt.omega) else 0 * omega
        ratio = (ratio * (1 - share)).astype(complex)
        return omega * (np.sqrt(ratio**2 - 1) - ratio)

    @cached_property
    def main(self):
        """Of the undamped motion in which the gondola moves most. [rad/s]"""
        frequency, share = self.coupled
        return 2 * np.pi * float(frequency[np.argmax(share)])

    @cached_property
    def open_poles(self):
        """Poles of gondola and cable without control, upper half plane and real axis, shape (k,). [rad/s]"""
        found = self.zeros(0.0, self.first_poles)
        # beside a mode that is hardly felt the pole cannot be told from the mode's own
        return np.where(np.isfinite(found), found, self.first_poles)

    @property
    def gondola_pole(self):
        """That of the motion in which the gondola moves most, without control. [rad/s]"""
        return self._seen[0]

    @property
    def seen_poles(self):
        """Poles without control that no pole of the cable cancels; those far above the gondola's only about. [rad/s]"""
        return self._seen[1]

    @property
    def faint_poles(self):
        """Poles without control, not far above the gondola's, that those of the cable all but cancel. [rad/s]"""
        return self._seen[2]

    @cached_property
    def _seen(self):
        return find_poles([self])[0]

    def near(self, poles):
        """Those poles that are not far above the gondola's: the others are hardly moved by the winch, nor felt."""
        return poles[np.abs(poles) < NEAR * np.abs(self.gondola_pole)]

    def visible(self, poles):
        """Those poles that no pole of the cable, which is a zero of x/F, cancels but for a tenth of their width."""
        return poles[self.gap(poles) > (SEEN * poles.real) ** 2]

    def gap(self, poles):
        """Square of the distance of each pole from the nearest one of the cable. [rad^2/s^2]"""
        if not len(self.cable_poles) or not len(poles):
            return np.full(len(poles), np.inf)
        across = poles.imag[:, None] - self.cable_poles.imag
        across *= across
        along = poles.real[:, None] - self.cable_poles.real
        along *= along
        across += along
        return across.min(axis=1)

    def zeros(self, gain, begin):
        """Poles with control near some places, at one gain or a gain each; NaN where there is none near."""
        return zeros_of(Together([self]), np.zeros(len(begin), dtype=int), gain + np.zeros(len(begin)), begin)

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

    @cached_property
    def curve(self):
        """See `nyquist.curves_of`."""
        self.check_damped()
        return curves_of([self])[0]

    @cached_property
    def whole_curve(self):
        """See `nyquist.whole_curve`."""
        self.check_damped()
        return whole_curve(self)

    @cached_property
    def passages(self):
        """See `nyquist.Passages`."""
        return self._with_every(passages_of([self], [self.curve])[0])

    @cached_property
    def _every_passage(self):
        return passages_of([self], [self.whole_curve])[0]

    def _with_every(self, passages):
        return replace(passages, every=lambda: self._every_passage) if passages.circle else passages

    @property
    def damped(self):
        """Whether `check_damped` passes."""
        return -self.gondola_pole.real >= UNDAMPED * np.abs(self.gondola_pole)


def find_poles(plants):
    """Poles without control as far as they are seen.

    Parameters
    ----------
    plants : list of Plant

    Returns
    -------
    list of (complex, ndarray, ndarray)
        The gondola's, those that no pole of the cable cancels, from NEAR times the gondola's on only about, and those
        that one all but cancels. [rad/s]
    """
    chosen, gaps = [], []
    for plant in plants:
        first = plant.first_poles
        gaps.append(plant.gap(first))
        size = np.abs(first)
        main = np.argmin(np.abs(size - plant.main))
        light = (first.real >= -LIGHT * size).all()  # a guess that is near another pole can be told from it
        apart = gaps[-1] > (FAINT * first.real) ** 2
        wanted = (size < 1.1 * NEAR * plant.main) & apart if light else size > 0
        wanted[main] = True
        chosen.append(wanted)
    which = np.repeat(np.arange(len(plants)), [int(wanted.sum()) for wanted in chosen])
    begin = np.concatenate([plant.first_poles[wanted] for plant, wanted in zip(plants, chosen, strict=True)])
    found = zeros_of(Together(plants), which, np.zeros(len(begin)), begin)
    # beside a mode that is hardly felt the pole cannot be told from the mode's own
    found = np.where(np.isfinite(found), found, begin)
    ends, result = np.searchsorted(which, np.arange(len(plants) + 1)), []
    for plant, wanted, gap, a, b in zip(plants, chosen, gaps, ends[:-1], ends[1:], strict=True):
        near = found[a:b]
        poles = plant.first_poles.astype(complex)
        poles[wanted], gap[wanted] = near, plant.gap(near)
        gondola = _main_pole(plant, near)
        seen = gap > (SEEN * poles.real) ** 2
        result.append((gondola, poles[seen], poles[wanted & ~seen]))
    return result


def _main_pole(plant, poles):
    """Of some poles that of the motion in which the gondola moves most. [rad/s]"""
    if plant.cable.strain is not None and len(poles) > 1:
        # damped strain moves it past others: of those where M s^2 + k_xx rises as slowly as M s^2, to either side
        aside = BESIDE * np.abs(poles) * np.array([[1j], [-1j]])
        places = poles + aside
        with np.errstate(divide="ignore", invalid="ignore"):
            rise = np.abs(plant.mass * places**2 + plant.stiffness(places.ravel())[0].reshape(places.shape))
            felt = np.nan_to_num((np.abs(2 * plant.mass * poles * aside) / rise).min(axis=0))
        poles = poles[felt >= felt.max() / 3]
    return poles[np.argmin(np.abs(np.abs(poles) - plant.main))]


def prepare(plants):
    """Let many plants know their poles and passages, by one iteration for all.

    A plant that has none says why when it is asked.

    Parameters
    ----------
    plants : list of Plant
    """
    waiting = []
    for plant in plants:
        try:
            if "_seen" not in plant.__dict__:
                plant.first_poles, plant.cable_poles  # noqa: B018
                waiting.append(plant)
        except CablestudyError:
            continue
    if waiting:
        for plant, seen in zip(waiting, find_poles(waiting), strict=True):
            plant.__dict__["_seen"] = seen
    waiting = [plant for plant in plants if "_seen" in plant.__dict__ and "passages" not in plant.__dict__]
    waiting = [plant for plant in waiting if plant.damped]
    if waiting:
        for plant, found in zip(waiting, passages_of(waiting, curves_of(waiting)), strict=True):
            plant.__dict__["passages"] = plant._with_every(found)


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
