"""The loop gain of a suspension with all modes of its cables that a gain could drive, and what follows from it.

Which modes a gain could drive is decided by a bound (`driven_waves`). The largest gain is the smallest one at which any
pole crosses the imaginary axis: where an eigenvalue of the loop gain is real and negative (`control.loop_gain`). All
modes of the cables' elements are in it; where damping couples them, and the accuracy allows it, six vectors stand for
those far above what the gain could drive (`system.cable_coordinates`). Frequencies beside the poles of the model, and
of the modes that the gain could drive, show all crossings. Waves across a cable take power from those along it where it
sags, so that the pole that crosses first decides how far they are resolved; it is sought again with them.

Another law than an integrator may make the loop gain large far above the frequencies of the body. All modes are then
needed up to where the loop gain of waves that do not return is below BROAD.
"""

from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from cablestudy.activity import doing
from cablestudy.control.gain_limits import StableGains, limit_near, too_many
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.margins import Margins
from cablestudy.control.motion import actuated
from cablestudy.control.suspension import load_off_ends
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import ConvergenceError
from cablestudy.study.suspension.driven_waves import ACROSS, dense
from cablestudy.study.tolerances import STUDY
from cablestudy.system.cable_coordinates import residual_vectors
from cablestudy.system.cables import Models
from cablestudy.system.coupled_modes import Search
from cablestudy.system.linear import LinearSystem

MODES_TOGETHER = np.arange(5.0)  # shifts of the poles of modes that nearly coincide, over that of one alone
TURN = 2 * np.pi


def open_poles(closed_loop):
    """Poles of a `ClosedLoop` with the winches at rest, without those that are zero but for rounding. [rad/s]

    With about those of modes that were computed and are not in its model.
    """
    poles = np.append(closed_loop.open_poles, closed_loop.plant.other_poles)
    return poles[np.abs(poles) > STUDY.zero_pole * closed_loop.modes.solution.omega[0]]


class DrivenCables:
    """The loop gain with the modes of single cables that a gain could drive.

    Where so much strain is damped that rounding spoils the response of a cable, it is that of the coupled modes.

    Parameters
    ----------
    closed_loop : ClosedLoop
        With control, and stable without.
    gain : float
        [rad/s]
    others : sequence of DrivenCables
        Of other gains of this loop: what is equal is shared.

    Attributes
    ----------
    models : Models
        Of the cables, with the waves resolved that the gain could drive.
    kept : list of Kept
        What is in the loop gain of each cable: modes, and vectors that stand for the others.
    loop_gain : LoopGain or callable
    poles : ndarray
        Without control: those of the model, and about where those of the modes are that the gain could drive. [rad/s]
    gains : StableGains
        The largest gain among them, right if it is at most `gain`.

    Raises
    ------
    NoSolutionError
        They are too many.
    """

    def __init__(self, closed_loop, gain, others=()):
        self._closed_loop, self._gain, self._effects = closed_loop, gain, closed_loop.effects
        self._base, self._elements = closed_loop.modes.solution, closed_loop.plant.model is not None
        resolved_to = self._highest_resolved
        models = self._models(resolved_to)
        for _ in range(STUDY.resolution_trials):
            self._resolve(models, resolved_to, others)
            limit = self.gains.limit
            self.resolved = limit is None or self._elements or limit.omega <= resolved_to
            if self.resolved or resolved_to == self._farthest or limit.factor > gain:
                break
            resolved_to = min(STUDY.resolved_beyond * limit.omega, self._farthest)
            models = self._models(resolved_to)

    @property
    def _spoilt(self):
        return not isinstance(self.loop_gain, LoopGain)

    @cached_property
    def broad(self):
        """Frequency up to which all modes are needed; 0 of an integrator. [rad/s]"""
        return 0.0 if self._closed_loop.given_loop.law.integrates_only else self._effects.loop_up_to(self._gain)

    @cached_property
    def _highest(self):
        """Frequencies up to which waves across and along each cable are driven or needed, shape (2, c). [rad/s]"""
        found = np.maximum(self._effects.driven_up_to(self._gain), self.broad)
        if found.max(initial=0.0) > self._highest_resolved:
            doing(f"modes of the cables that {self._in_words} could drive are sought up to {found.max() / TURN:.4g} Hz")
        return found

    @property
    def highest_mode(self):
        """Highest frequency of the modes of single cables in the loop gain. [rad/s]"""
        return max(one.element.omega[: one.modes].max(initial=0.0) for one in self.kept)

    @property
    def _highest_resolved(self):
        """Highest frequency that the models of the modes resolve, those beyond the modes of the model too. [rad/s]"""
        return self._base.with_all_modes.omega[-1]

    @property
    def _in_words(self):
        return self._closed_loop.given_loop.law.described(self._gain, 4)

    @property
    def _farthest(self):
        """Frequency up to which waves across all cables can be resolved. [rad/s]"""
        return max(
            self._highest_resolved, np.pi * STUDY.resolved_waves / self._effects.travel_time[ACROSS].max(initial=1e-300)
        )

    def _models(self, resolved_to):
        """`Models` of the cables, waves across them resolved up to a frequency at least. [rad/s]"""
        base, highest, time = self._base, self._highest, self._effects.travel_time
        resolved = max(highest.max(initial=0.0), resolved_to) <= self._highest_resolved
        if (resolved and base.models.complete) or self._elements:
            return base.models if base.models.complete else Models(base.models.cables, base.models.meshes, fixed=True)
        waves = np.maximum(highest, [[resolved_to], [0.0]]) * time / np.pi
        kind, cable = np.unravel_index(np.argmax(waves), waves.shape)
        if waves[kind, cable] > max(STUDY.resolved_waves, resolved_to * time[ACROSS].max() / np.pi) * (1 + 1e-9):
            raise too_many(self._in_words, int(min(waves[kind, cable], 1e9)), highest[kind, cable])
        plant, cables = self._closed_loop.plant, base.models.cables
        search = Search(plant.equilibrium, len(base.omega), plant.accuracy, cables=cables)
        meshes = cables.meshes(search.orders_of(waves.max(axis=0)))
        models = Models(cables, meshes, most_modes=STUDY.driven_modes_of_cable)
        try:
            models.first  # noqa: B018 all modes are computed
        except ConvergenceError as error:
            up_to = waves[kind, cable] / time[kind, cable] / 2
            raise ConvergenceError(f"{self._in_words} needs modes of a cable up to {up_to:.4g} Hz: {error}") from None
        return models

    @property
    def _shared(self):
        """What is the same for others with equal models and modes."""
        return self.models, self.kept, self.loop_gain

    def _own_modes(self, models, resolved_to, share=1.0):
        """Which modes of each cable are in the loop gain: list of ndarray of bool, shape (n,).

        With a `share` below 1 up to this share of the frequencies. All where damping couples none of them, where that
        spares little, and for a high accuracy.
        """
        plant, found = self._closed_loop.plant, [np.ones(len(one.omega), dtype=bool) for one in models.elements]
        if self._elements or plant.accuracy <= STUDY.all_modes_from:
            return found
        for cable, element in enumerate(models.elements):
            kept = self._up_to(cable, element, resolved_to, *(share * one for one in STUDY.kept_multiples))
            coupled = plant.braked or element.strain is not None or element.uneven
            if coupled and np.count_nonzero(kept) + STUDY.vectors < STUDY.worth * len(kept):
                found[cable] = kept
        return found

    def _up_to(self, cable, element, resolved_to, driven, resolved):
        """Modes of a cable up to multiples of what the gain could drive and of what is resolved, array of bool."""
        across, along = driven * self._highest[:, cable]
        kept = element.omega < max(across, resolved * resolved_to)
        return kept | (self._effects.along(cable, element) & (element.omega < along))

    def _chosen(self):
        """Modes of each cable that the gain could drive, or that are needed: list of (ndarray of bool, shape (n,))."""
        driven, found = self._effects.driven(self.loop_gain, self._gain), []
        for own, kept, element in zip(driven, self.kept, self.loop_gain.elements, strict=True):
            found.append((own | (element.omega < self.broad)) & (np.arange(len(own)) < kept.modes))
        number = sum(int(own.sum()) for own in found)
        if number > CONTROL.driven_modes and not self._elements:
            raise too_many(self._in_words, number, self._highest.max(initial=0.0))
        return found

    def _loop_gain(self, kept):
        """`LoopGain` with what is `kept` of the cables; a function, of the coupled modes, where rounding spoils it."""
        closed_loop, effects = self._closed_loop, self._effects
        layout, plant = closed_loop.layout, closed_loop.plant
        stiffness, mass = (dense(part) for part in layout.body_matrices)
        elements = [one.element for one in plant.in_air(self.models, kept)]
        damping = np.zeros_like(mass) + plant.air_on_bodies(np.eye(len(mass))) + dense(layout.damping)
        *matrices, feedback = actuated(layout, np.eye(len(mass)), mass, damping, stiffness, closed_loop.actuators)
        bodies = LinearSystem(*matrices, feedback=feedback)

        def widened(part):
            return np.concatenate([part, np.zeros((*part.shape[:-1], len(bodies) - len(mass)))], axis=-1)

        off = dense(layout.connection).T @ load_off_ends(closed_loop.equilibrium, closed_loop.winches)
        places = widened(effects.moved), effects.reeled, widened(off.T).T, widened(effects.measured)
        shares, controller = closed_loop.allocation.shares, closed_loop.given_loop.controller
        found = LoopGain(bodies, elements, *places, shares, controller, windows=plant.accuracy > STUDY.all_modes_from)
        return closed_loop.given_loop.unit_gain if found.spoilt else found

    def _poles(self):
        """Poles of the model, and estimates of those of modes above it that the gain could drive. [rad/s]"""
        poles = [open_poles(self._closed_loop)]
        if self._spoilt:
            return poles[0]
        chosen, highest = self._chosen(), (1 - STUDY.uncertain_pole) * self._highest_resolved
        for cable, own in enumerate(chosen):
            near = np.flatnonzero(own & (self.loop_gain.elements[cable].omega > STUDY.may_be_above * highest))
            if len(near):
                moved, _ = self.loop_gain.poles_of(cable, near)
                alone = self.loop_gain.elements[cable].omega[near]
                above = np.maximum(np.abs(moved), alone) > highest
                moved, alone = moved[above], alone[above]
                shift = (np.abs(moved) - alone)[:, None] * MODES_TOGETHER
                poles.append((moved.real[:, None] + 1j * (alone[:, None] + shift)).ravel())
        return np.concatenate(poles)

    def _resolve(self, models, resolved_to, others):
        """Set models and all that follows from them, taken from one of the other `DrivenCables` where it is equal."""
        own = self._own_modes(models, resolved_to)
        others = [one for one in others if one.models.equal(models) and all(map(np.array_equal, one._own, own))]
        self._own, self._resolved_to = own, resolved_to
        if others:
            self.models, self.kept, self.loop_gain = others[0]._shared
        else:
            self.models, self.kept = models, models.with_modes(own)
            self.loop_gain = self._loop_gain(self.kept)
        self.poles, notches, law = self._poles(), self._closed_loop.notches, self._closed_loop.given_loop.law
        self.gains = StableGains(self.loop_gain, self.poles, notches, law, self._gain)

    def with_critical_modes(self, plant, gain):
        """Copy of a `Plant` with modes of single cables near the one that would grow first as the gain is raised.

        Added are those that the gain could drive, or all where rounding spoils the response of a cable. The plant
        itself where `gain` [rad/s] is not just below the largest, or the plant's own modes reach to that mode.
        """
        limit, base = self.gains.limit, self._base
        if (
            limit is None
            or limit.omega <= base.omega[-1]
            or not STUDY.nearly_largest_gain * limit.factor < gain < limit.factor
        ):
            return plant
        critical = [np.zeros(len(in_loop), dtype=bool) for in_loop in self._own]
        driven = [np.ones(kept.modes, dtype=bool) for kept in self.kept] if self._spoilt else self._chosen()
        for cable, (in_loop, kept) in enumerate(zip(self._own, self.kept, strict=True)):
            critical[cable][in_loop] = driven[cable][: kept.modes]
            critical[cable] &= np.abs(self.models.elements[cable].omega / limit.omega - 1) < STUDY.critical_modes
        search = Search(plant.equilibrium, len(base.omega), plant.accuracy, cables=self.models.cables)
        band = (1 - STUDY.critical_modes) * limit.omega, (1 + STUDY.critical_modes) * limit.omega
        modes = search.with_chosen(self.models, base.coordinates.limits, critical, *band)
        return plant.with_modes(modes, len(modes) - len(base.omega))

    # ------------------------------------------------------------------------------------------------------- errors

    @cached_property
    def _perturbed(self):
        """Loop gains that differ by what the models leave open: list of `LoopGain`.

        The frequencies of the modes are shifted by errors of the mesh. Modal damping of half of the modes, the highest
        ones, is left out: it has no limit as modes are added. Vectors stand for more of them.
        """
        elements, found = self.loop_gain.elements, []
        wrong = [np.zeros(len(element.omega)) for element in elements]
        for group in self.models.groups:
            for cable in group.cable_indices.tolist():
                wrong[cable] = self._by_mesh(cable, group.take(np.array([cable])).ends)
        found.append([
            replace(one, omega=one.omega * (1 - own), participation=one.participation * (1 - own)[:, None] ** 2)
            for one, own in zip(elements, wrong, strict=True)
        ])  # fmt: skip
        if any(one.strain is None and one.damping_ratio.any() for one in elements):
            lower = [np.arange(len(one.omega)) < len(one.omega) / 2 for one in elements]
            found.append([
                replace(one, damping_ratio=np.where(own, one.damping_ratio, 0.0)) if one.strain is None else one
                for one, own in zip(elements, lower, strict=True)
            ])  # fmt: skip
        found = [replace(self.loop_gain, elements=elements, near=self.loop_gain) for elements in found]
        if self._few:
            fewer = self._own_modes(self.models, self._resolved_to, STUDY.coarser_share)
            found.append(self._loop_gain(self.models.with_modes(fewer)))
        return found

    def _by_mesh(self, cable, ends):
        """Relative errors of the frequencies of what is kept of a cable, of which `ends` are the `Ends`, shape (n,).

        Far above what decides on the loop errors of single modes cancel: the mesh has the response of all of them
        together, six vectors, to the errors of these.
        """
        element, shapes = self.loop_gain.elements[cable], self.kept[cable].shapes
        square = element.omega**2

        def error(amplitudes, square):
            energy = ends.highest_energy(amplitudes[None], np.zeros((1, 6, len(square))))[0]
            return np.minimum(energy / square / 2, 0.5)

        alone = STUDY.single_mode_errors
        found, far = error(shapes, square), ~self._up_to(cable, element, self._resolved_to, alone, alone)
        together = residual_vectors(element.omega[None], element.coupling[None], far[None])[0]
        together = together[:, together.any(axis=0)]
        share = together**2 + np.finfo(float).tiny
        joint = share @ error(shapes @ together, square @ together**2) / share.sum(axis=1)
        return np.where(far, np.minimum(found, joint), found)

    @property
    def by_others(self):
        """Least relative error of margins by vectors for other modes, or poles found in windows; 0 without. [-]"""
        return STUDY.by_other_modes if self._few or self.loop_gain.windowed else 0.0

    @property
    def _few(self):
        """True if vectors stand for other modes."""
        return any(one.residuals for one in self.kept)

    @cached_property
    def errors(self):
        """Estimated relative errors of the largest gain and its frequency; not a number where not known: two. [-]"""
        limit = self.gains.limit
        if limit is None or not self.resolved or self._elements or self._spoilt:
            return np.nan, np.nan
        found = [limit_near(loop_gain, limit) for loop_gain in self._perturbed]
        if None in found:
            return np.nan, np.nan
        both = [(abs(one.factor / limit.factor - 1), abs(one.omega / limit.omega - 1)) for one in found]
        return tuple(map(float, STUDY.largest_gain_safety * np.sum(both, axis=0) + self.by_others))

    def perturbed_margins(self, margins, gain):
        """`Margins` of the perturbed loop gains, near the frequencies that decide the margins with a gain [rad/s]."""
        if self._elements or self._spoilt:
            return []
        omega, near = margins.omega, margins.deciding
        chosen = (np.abs(omega[:, None] - near) < STUDY.margin_window * near).any(axis=1)
        chosen[0] = True
        return [Margins(partial(_times, gain, loop_gain), omega[chosen]) for loop_gain in self._perturbed]


def _times(gain, loop_gain, s):
    return gain * loop_gain(s)
