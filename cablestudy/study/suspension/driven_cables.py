"""Modes of the cables that a gain could drive, and the largest gain with all modes of the cables.

Which a gain could drive is decided by a bound (`driven_waves`). The largest gain is the smallest one at which any pole
crosses the imaginary axis: where an eigenvalue of the loop gain is real and negative, all modes of the cables' elements
being in it (`control.loop_gain`). Frequencies beside the poles of the model, and of the modes that the gain could
drive, show all crossings. Waves across a cable take power from those along it where it sags, so that the pole that
crosses first decides how far they are resolved; it is sought again with them.

Another law than an integrator may make the loop gain large far above the frequencies of the body. All modes are then
needed up to where the loop gain of waves that do not return is below BROAD, as for one cable.

Damping by the air couples all modes of a cable, actuators have coordinates of their own, and so much damped strain may
be there that rounding spoils the response of a cable: then the largest gain is that of a model.
"""

from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.activity import doing
from cablestudy.control.gain_limits import ASIDE, TOGETHER, Limit, limit_near
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.margins_crossings import crossings, refined
from cablestudy.control.margins_grid import curve, frequencies
from cablestudy.control.stability import NEGLIGIBLE, too_many
from cablestudy.control.suspension import load_off_ends
from cablestudy.study.suspension.driven_waves import ACROSS, Effects, dense
from cablestudy.system.cables import Models
from cablestudy.system.coupled_modes import Search

MOST_WAVES, MOST_OF_CABLE = 240, 1600  # half-waves along a cable that are resolved, and its modes that are computed
MOST_MODES = 300  # modes of cables that a gain could drive; more are refused
TRIALS, BEYOND = 5, 1.2  # of the frequency up to which waves across the cables are resolved, over that of the pole
MODES_TOGETHER = np.arange(5.0)  # shifts of the poles of modes that nearly coincide, over that of one alone
TURN = 2 * np.pi
ZERO = 1e-9  # size of a pole over that of the largest, below which it is that of an integral


class DrivenCables:
    """Modes of single cables that a gain could drive, and the largest gain with them.

    Parameters
    ----------
    movement : Movement
        With a loop.
    gain : float
        [rad/s]

    Attributes
    ----------
    broad : float
        Frequency up to which all modes are needed. [rad/s]
    models : Models
        Of the cables, with the waves resolved that the gain could drive.
    chosen : list of (ndarray of bool, shape (n,))
        Modes of each cable that the gain could drive.
    exact : bool
        Whether the largest gain is known.
    limit : Limit or None
        None where the loop is stable for every gain.
    errors : tuple of 2 float
        Estimated, of the largest gain and its frequency, relative; not a number where they are not known. [-]

    Raises
    ------
    NoSolutionError
        They are too many.
    """

    def __init__(self, movement, gain):
        self._movement, self._gain, self._effects = movement, gain, Effects(movement)
        linear, self._base = movement.linear, movement.modes.solution
        self._elements = linear.model is not None  # an exact choice, which nothing resolves further
        self.exact = not movement.actuators and not (linear.drag and linear.scene.wind.aerodynamic_damping)
        self.limit, self.errors = None, (np.nan, np.nan)
        resolved_to = self._base.omega[-1]
        for _ in range(TRIALS):
            self.models = self._models(resolved_to)
            self.exact = self.exact and not self.loop_gain.spoilt
            self.chosen = self._chosen()
            self.limit = self._least_crossing() if self.exact else None
            resolved = self.limit is None or self._elements or self.limit.omega <= resolved_to
            if resolved or resolved_to == self._farthest:
                break
            resolved_to = min(BEYOND * self.limit.omega, self._farthest)
        if self.limit and resolved:
            self.errors = self._errors()

    @cached_property
    def broad(self):
        """Frequency up to which all modes are needed; 0 of an integrator. [rad/s]"""
        return 0.0 if self._movement.loop.law.integrates_only else self._effects.loop_up_to(self._gain)

    @cached_property
    def _highest(self):
        """Frequencies up to which waves across and along each cable are driven or needed, shape (2, c). [rad/s]"""
        found = np.maximum(self._effects.driven_up_to(self._gain), self.broad)
        if found.max(initial=0.0) > self._base.omega[-1]:
            doing(f"modes of the cables that {self._in_words} could drive are sought up to {found.max() / TURN:.4g} Hz")
        return found

    @property
    def _in_words(self):
        return self._movement.loop.law.said(self._gain, 4)

    @property
    def _farthest(self):
        """Frequency up to which waves across all cables can be resolved. [rad/s]"""
        return max(self._base.omega[-1], np.pi * MOST_WAVES / self._effects.travel_time[ACROSS].max(initial=1e-300))

    def _models(self, resolved_to):
        """`Models` of the cables, waves across them resolved up to a frequency at least. [rad/s]"""
        base, highest, time = self._base, self._highest, self._effects.travel_time
        if self._elements:
            return Models(base.models.cables, base.models.meshes, fixed=True)
        if max(highest.max(initial=0.0), resolved_to) <= base.omega[-1]:
            return base.models
        waves = np.maximum(highest, [[resolved_to], [0.0]]) * time / np.pi
        kind, cable = np.unravel_index(np.argmax(waves), waves.shape)
        if waves[kind, cable] > max(MOST_WAVES, resolved_to * time[ACROSS].max() / np.pi) * (1 + 1e-9):
            raise too_many(self._in_words, int(min(waves[kind, cable], 1e9)), highest[kind, cable])
        linear, cables = self._movement.linear, base.models.cables
        search = Search(linear.equilibrium, len(base.omega), linear.accuracy, cables=cables)
        return Models(cables, cables.meshes(search.orders_of(waves.max(axis=0))), most=MOST_OF_CABLE)

    def _chosen(self):
        driven = self._effects.driven(self.loop_gain, self._gain)
        found = [own | (one.omega < self.broad) for own, one in zip(driven, self.models.elements, strict=True)]
        number = sum(int(own.sum()) for own in found)
        if number > MOST_MODES and not self._elements:
            raise too_many(self._in_words, number, self._highest.max(initial=0.0))
        return found

    @property
    def loop_gain(self):
        """`LoopGain` with all modes of the models."""
        movement, effects, layout = self._movement, self._effects, self._movement.layout
        stiffness, mass = (dense(part) for part in layout.own)
        off = dense(layout.moved).T @ load_off_ends(movement.equilibrium, movement.winches)
        places = effects.moved, effects.reeled, off, effects.measured
        shares, controller = movement.allocation.shares, movement.loop.controller
        return LoopGain(mass, stiffness, self.models.elements, *places, shares, controller)

    def _least_crossing(self):
        """`Limit` of the smallest gain at which a pole crosses the imaginary axis; None where none does.

        Notes
        -----
        With l the eigenvalue of L, 1 + g l(s) = 0, so that the pole moves by 1/(g dl/ds) per relative change of g.
        Where it grows by less than NEGLIGIBLE of its frequency with a gain ASIDE above, it is called unstable only
        from the gain on with which it grows by that much.
        """
        movement, loop_gain, poles = self._movement, self.loop_gain, [self._movement.open_poles]
        for cable, own in enumerate(self.chosen):
            above = np.flatnonzero(own & (loop_gain.elements[cable].omega > self._base.omega[-1]))
            if len(above):
                alone = loop_gain.elements[cable].omega[above]
                moved, _ = loop_gain.poles_of(cable, above)
                shift = (np.abs(moved) - alone)[:, None] * MODES_TOGETHER
                poles.append((moved.real[:, None] + 1j * (alone[:, None] + shift)).ravel())
        law, poles = movement.loop.law, np.concatenate(poles)
        poles = poles[np.abs(poles) > ZERO * np.abs(poles).max()]
        omega, _, values = curve(loop_gain, frequencies(poles, movement.notches, law), upto=law.judged_up_to)
        rest, best = crossings(omega[None], values[None]).sorted(), None
        while len(rest) and (best is None or rest.factor[0] < best.factor):
            near = rest.factor <= TOGETHER * rest.factor[0]
            found, rest = refined(loop_gain, rest.take(near)), rest.take(~near)
            found = found.take(found.outward) if len(found) else found
            if len(found):
                growth = (1j / (found.factor * found.slope)).real
                share = NEGLIGIBLE * found.place / growth
                factor = found.factor * (1 + np.where(share > ASIDE, share, 0.0))
                least = int(np.argmin(factor))
                if best is None or factor[least] < best.factor:
                    best = Limit(float(factor[least]), float(found.place[least]))
        return best

    def _errors(self):
        """Estimated relative errors of gain and frequency of a `Limit` by the meshes, and by modal damping: two. [-]

        The frequencies of the modes are shifted by their own errors. Modal damping of half of the modes, the highest
        ones, is left out: it has no limit as modes are added.
        """
        loop_gain, limit = self.loop_gain, self.limit
        wrong = [np.zeros(len(element.omega)) for element in loop_gain.elements]
        for group in self.models.groups:
            cables, count = group.ends.omega.shape
            each = np.broadcast_to(np.eye(count), (cables, count, count))
            energy = group.ends.highest_energy(each, np.zeros((cables, 6, count)))
            for place, cable in enumerate(group.places.tolist()):
                wrong[cable] = np.minimum(energy[place] / group.ends.omega[place] ** 2 / 2, 0.5)

        def halved(ratio):
            return np.where(np.arange(len(ratio)) < len(ratio) / 2, ratio, 0.0)

        elements = loop_gain.elements
        shifted = [
            replace(one, omega=one.omega * (1 - own), participation=one.participation * (1 - own)[:, None] ** 2)
            for one, own in zip(elements, wrong, strict=True)
        ]
        fewer = [replace(one, damping_ratio=halved(one.damping_ratio)) for one in elements]
        found = [limit_near(replace(loop_gain, elements=elements), limit) for elements in (shifted, fewer)]
        if None in found:
            return np.nan, np.nan
        both = [(abs(one.factor / limit.factor - 1), abs(one.omega / limit.omega - 1)) for one in found]
        return tuple(map(float, np.sum(both, axis=0)))
