"""The loop gain of a suspension with all modes of its cables that a gain could drive, and what follows from it.

A gain could drive a mode if it could turn the decay of the mode into growth; a bound decides for which modes that is
impossible (`driven_waves`). The largest stable gain is the smallest one at which any pole crosses the imaginary
axis: where an eigenvalue of the loop gain is real and negative (`control.loop_gain`). All modes of the cables' elements
are in the loop gain; where damping couples them, and the accuracy allows it, six vectors represent those far above what
the gain could drive (`system.cable_coordinates`). So that no crossing is missed, the loop gain is computed at
frequencies near the poles of the model and of the modes that the gain could drive. Where a cable sags, waves across
it take power from those along it: waves across must be resolved beyond the frequency of the pole that crosses first.
The gain could drive none of these waves, so that no other pole comes to cross: the crossing is located again in the
loop gain of finer elements, near where it was found.

A control law other than an integrator may make the loop gain large far above the frequencies of the bodies. All modes
are then needed up to the frequency above which the loop gain on cables that reflect no wave is below
`broad_loop_gain`.

Step by step:

1. meshes that resolve the waves which it could drive, those of the coupled modes if fine enough (`resolved_waves`);
2. the modes that enter the loop gain by themselves (`modes_in_loop`); six vectors represent the others;
3. the loop gain of bodies and cables (`loop_gain_of`);
4. the poles near which it is computed (`poles`), and the gains at which poles cross (`gains`);
5. where the first of these is beyond what the meshes resolve, finer meshes, in which it is located again
   (`_limit_and_resolving`).
"""

from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from cablestudy.cable.matrices import dense
from cablestudy.control.gain_limits import limit_near, limits_near, too_many
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.loop_gain_poles import narrow_poles, poles_of_modes
from cablestudy.control.motion import with_strokes
from cablestudy.control.stable_gains import StableGains
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import ConvergenceError, outcome_of, without_errors
from cablestudy.motion.driven_waves import driven_modes
from cablestudy.motion.loop_gain_errors import LoopGainErrors
from cablestudy.motion.resolved_waves import ResolvedWaves
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.mode_search import Search
from cablestudy.system.together import computed_together

MODES_TOGETHER = np.arange(5.0)  # shifts of the poles of modes that nearly coincide, over that of one alone
ON_THE_WAY = np.arange(1.0, 6.0) / 5  # from the frequency with fixed ends to an estimated pole


def open_poles(closed_loop):
    """Poles of a `ClosedLoop` with the winches at rest, without those that are zero except for rounding. [rad/s]

    Those of modes that were computed and are not in its model are estimated.
    """
    poles = np.append(closed_loop.open_poles, closed_loop.plant.other_poles)
    return poles[np.abs(poles) > MOTION.zero_pole * closed_loop.modes.omega[0]]


class DrivenCables(ResolvedWaves):
    """Loop gain of a suspension with the modes of single cables that a gain could drive, and the stable gains by it.

    A gain could drive a mode, or a wave, if it could turn its decay into growth (`driven_waves`). Modes of a single
    cable are those with fixed ends. Where so much strain is damped that rounding spoils the response of a cable, the
    loop gain of the coupled modes of the suspension is used instead.

    Parameters
    ----------
    closed_loop : ClosedLoop
        With control, and stable with the winches at rest.
    gain : float
        Gain of the controller. [rad/s]
    others : sequence of DrivenCables
        Those of other gains of this loop: models and loop gain are taken from one whose modes are equal.
    resolved_to : float
        Frequency up to which waves across the cables are resolved, at least. [rad/s]

    Attributes
    ----------
    models : Models
        Elements of the cables, fine enough for the waves that the gain could drive.
    resolved_to : float
        Frequency up to which waves across all cables are resolved. [rad/s]

    Raises
    ------
    NoSolutionError, ConvergenceError
        There are more half-waves along a cable than can be resolved, or no modes to the accuracy.
    """

    def __init__(self, closed_loop, gain, others=(), resolved_to=0.0):
        super().__init__(closed_loop, gain, resolved_to)
        models = self.resolving_models()
        self._alike = [other for other in others if other.models.equal(models)]
        self.models = self._alike[0].models if self._alike else models

    @cached_property
    def _in_loop(self):
        """`modes_in_loop` of the models, whose modes are computed; raises ConvergenceError where there are none."""
        try:
            return self.modes_in_loop(self.models)
        except ConvergenceError as error:
            highest = np.maximum(self._highest_driven, [[self.resolved_to], [0.0]]).max() / (2 * np.pi)
            examined = f"the loop is examined up to {self._gain_in_words}"
            message = f"{examined}, which needs modes of a cable up to {highest:.4g} Hz: {error}"
            raise ConvergenceError(message) from None

    @cached_property
    def _kept_and_loop_gain(self):
        """`kept` and `loop_gain`, those of other `DrivenCables` where these have the same modes in the loop."""
        in_loop = self._in_loop
        for other in self._alike:
            if all(map(np.array_equal, other._in_loop, in_loop)):
                return other._kept_and_loop_gain
        kept = self.models.with_modes(in_loop)
        return kept, self.loop_gain_of(kept)

    @property
    def kept(self):
        """Modes of each cable in the loop gain, and vectors that represent its others: list of ReducedCable."""
        return self._kept_and_loop_gain[0]

    @property
    def loop_gain(self):
        """L over the gain: s, shape (f,) -> shape (f, k, k); `LoopGain` or callable; raises as `_in_loop`."""
        return self._kept_and_loop_gain[1]

    @property
    def coupling_damping(self):
        """`CouplingDamping` of each cable in the loop gain whose modes damping couples: list."""
        return [] if self.ill_conditioned else self.loop_gain.coupling_damping

    @cached_property
    def gains(self):
        """`StableGains` by the loop gain; its `limit` is right if it is at most the gain, and resolved: see `limit`.

        Raises
        ------
        NoSolutionError
            The gain could drive more modes than can be computed.
        """
        notches, law = self.closed_loop.body.notches, self.closed_loop.untuned_loop.law
        return StableGains(self.loop_gain, self.poles, notches, law, self.gain)

    @cached_property
    def errors(self):
        """`LoopGainErrors`: of its `limit`, and of margins."""
        return LoopGainErrors(self)

    @property
    def limit(self):
        """`Limit` of the smallest gain at which a pole crosses; None where none does; raises as `gains`.

        Where it is at most the gain, waves across the cables are resolved beyond its frequency, as far as they can be.
        """
        return self._limit_and_resolving[0]

    @property
    def resolving(self):
        """`DrivenCables` with the loop gain by which `limit` was located: finer ones, or itself; raises as `gains`."""
        return self._limit_and_resolving[1]

    @cached_property
    def _limit_and_resolving(self):
        """`limit` and `resolving`: meshes are refined until they resolve the waves at the limit, as far as they can."""
        driven, limits = self, self.gains.limits
        for _ in range(MOTION.resolution_trials):
            if not limits or limits[0].factor > self.gain:
                break
            finer = driven.resolving_waves_at(limits[0].omega)
            if finer is driven:
                break
            driven, limits = finer, finer._limits_near(limits)
        return (driven._located_by_equations(limits[0]) if limits else None), driven

    def _located_by_equations(self, limit):
        """A `Limit` located without poles in windows, which are less accurate; itself where there are none."""
        if self.ill_conditioned or not self.loop_gain.windowed or limit.undamped or limit.factor > self.gain:
            return limit
        by_equations = self.loop_gain.by_equations
        return limit if by_equations is self.loop_gain else limit_near(by_equations, limit) or limit

    def resolving_waves_at(self, omega):
        """`DrivenCables` that resolve waves across the cables beyond a frequency [rad/s], as far as they can be.

        Itself where it does, or where none can resolve more.
        """
        resolved_to = min(MOTION.resolved_beyond * omega, self._highest_resolvable)
        if self.resolves(omega) or resolved_to <= self.resolved_to:
            return self
        return DrivenCables(self.closed_loop, self.gain, resolved_to=resolved_to)

    def _limits_near(self, limits):
        """`Limit` of each crossing that may be the first one, near those of coarser models: list, ascending.

        By local searches, each of which locates the crossings of all eigenvalues near a limit; from all frequencies
        where that does not find one.
        """
        located, unmatched = [], []  # limits; those of them that are none yet of the coarser models
        for limit in limits:
            if located and limit.factor > MOTION.limit_of_finer * min(found.factor for found in located):
                break
            if not any(map(limit.resembles, unmatched)):
                found = [] if limit.undamped else list(limits_near(self.loop_gain, limit))
                if not found:
                    return self.gains.limits
                located, unmatched = located + found, unmatched + found
            unmatched.remove(min(unmatched, key=lambda other: abs(other.omega - limit.omega)))
        return sorted(located, key=lambda limit: limit.factor)

    def stable(self, gain):
        """True if a loop with a gain [rad/s], at most that of these modes, is stable, which it is without gain.

        Raises
        ------
        NoSolutionError
            As `gains`; the delay is too long to judge the loop.
        """
        self.gains.check_delay(gain)
        if self.limit is None or gain < self.limit.factor:
            return True
        near = self.gains.crosses_within(MOTION.limit_of_finer, gain, self.resolved_to)
        return not (self.resolving if near else self).gains.unstable(gain)

    def for_gain(self, gain):
        """`DrivenCables` that judge a loop with a gain [rad/s]: `resolving` where it is nearly the largest one."""
        limit = self.limit
        return self if limit is None or gain <= MOTION.nearly_largest_gain * limit.factor else self.resolving

    @property
    def ill_conditioned(self):
        """True if rounding spoils the response of a cable: the loop gain is then that of the coupled modes."""
        return not isinstance(self.loop_gain, LoopGain)

    @property
    def highest_mode(self):
        """Highest frequency of the modes of single cables in the loop gain. [rad/s]"""
        return max(kept.element.omega[: kept.modes].max(initial=0.0) for kept in self.kept)

    def _needed_modes(self, modes_driven):
        """Modes of each cable that the gain could drive, as in `driven_modes`, or that are needed: list of such arrays.

        Raises
        ------
        NoSolutionError
            There are too many of them.
        """
        needed = []
        for driven, kept, element in zip(modes_driven, self.kept, self.loop_gain.elements, strict=True):
            is_mode = np.arange(len(driven)) < kept.modes  # vectors that represent modes come after them
            needed.append((driven | (element.omega < self.all_modes_up_to)) & is_mode)
        count = sum(int(modes.sum()) for modes in needed)
        if count > CONTROL.driven_modes and not self.fixed_elements:
            raise too_many(self._gain_in_words, count, CONTROL.driven_modes, self._highest_driven.max(initial=0.0))
        return needed

    def loop_gain_of(self, kept):
        """Build the loop gain L divided by the gain g, L/g = P Z^-1 F A C1 N, with chosen modes of each cable.

        At a complex frequency s, Z is the dynamic stiffness of the bodies on their cables, F the forces on the bodies
        per length that winches reel in, P gives the measured coordinates, A allocates these to winches, and C1 N is the
        control law of unit gain behind its notches.

        Parameters
        ----------
        kept : list of ReducedCable
            Modes of each cable, and vectors that represent its other modes.

        Returns
        -------
        LoopGain or callable
            Function of s, shape (f,) [rad/s] -> L/g, shape (f, k, k), for k measured coordinates [s]. Where rounding
            spoils the response of a cable, L/g of the coupled modes takes its place: `Loop.unit_gain`.
        """
        closed_loop, effects = self.closed_loop, self._effects
        layout, plant = closed_loop.layout, closed_loop.plant
        strokes = len(plant.bodies) - len(layout.free)
        own_loads = plant.winched_ends.loads(dense(layout.connection)[None], layout.free)[0]
        loop_gain = LoopGain(
            plant.bodies,
            elements=self.elements_of(kept),
            connection=with_strokes(effects.connection, strokes),
            reeling=effects.reeling,
            winch_loads=with_strokes(own_loads.T, strokes).T,
            measured=with_strokes(effects.measured, strokes),
            allocation=closed_loop.body.allocation.matrix,
            controller=closed_loop.untuned_loop.controller,
            windows=plant.accuracy > MOTION.all_modes_from,
        )
        return closed_loop.untuned_loop.unit_gain if loop_gain.ill_conditioned else loop_gain

    def elements_of(self, kept):
        """`Superelement` of each cable in the loop gain, in the air: list; `kept` is that of `loop_gain_of`."""
        return [in_air.element for in_air in self.closed_loop.plant.in_air(self.models, kept)]

    @computed_together
    def poles(trials):
        """Poles of the model, and estimates of those of modes above it that the gain could drive. [rad/s]

        NoSolutionError of too many modes. Each of the trials has a loop gain.
        """
        yield from ((one, open_poles(one.closed_loop)) for one in trials if one.ill_conditioned)
        trials = [one for one in trials if not one.ill_conditioned]
        loop_gains = [one.loop_gain for one in trials]
        driven = driven_modes([one._effects for one in trials], loop_gains, [one.gain for one in trials])
        needed = {one: outcome_of(partial(one._needed_modes, modes)) for one, modes in zip(trials, driven, strict=True)}
        yield from ((one, error) for one, error in needed.items() if isinstance(error, Exception))
        needed = without_errors(needed)
        above = [one._modes_that_may_be_above(modes) for one, modes in needed.items()]
        loop_gains = [one.loop_gain for one in needed]
        estimated = [poles for poles, _ in poles_of_modes(loop_gains, above)]
        of_rows = [one._poles_and_starts(*pair) for one, *pair in zip(needed, above, estimated, strict=True)]
        poles, starts, errors = map(list, zip(*of_rows, strict=True)) if of_rows else ([], [], [])
        narrow = narrow_poles(loop_gains, poles, starts, errors)
        yield from ((one, np.concatenate(pair)) for one, *pair in zip(needed, poles, narrow, strict=True))

    @property
    def _highest_surely_known(self):
        """Frequency below which the poles of all modes are certainly among those of the model. [rad/s]"""
        return (1 - MOTION.uncertain_pole) * self._highest_resolved

    def _modes_that_may_be_above(self, needed):
        """Indices of the needed modes of each cable whose poles may lie above those of the model: list of ndarray."""
        least = MOTION.may_be_above * self._highest_surely_known
        pairs = zip(needed, self.loop_gain.elements, strict=True)
        return [np.flatnonzero(modes & (element.omega > least)) for modes, element in pairs]

    def _poles_and_starts(self, modes, estimated):
        """Poles near which the loop gain is computed, and points where searches for narrow poles begin.

        Both lists, of shape (N,), begin with the poles of the model. Each mode of a cable whose pole may lie above
        those, or whose W does, adds five entries. With its frequency W with fixed ends, its estimated pole p
        (`estimated`, of all `modes`) and the shift d = |p| - W they are

            poles     Re p + i (W + j d), j = 0 to 4,
            starts    the same; if |d| is large, Re p + i (W + j d/5), j = 1 to 5.

        The multiples of d serve for modes that nearly coincide: a pole of j such modes is shifted by up to about j d.
        The third result are the distances at which a pole may be from each start, over its frequency: |d|/W, at least
        the accuracy.
        """
        elements, highest = self.loop_gain.elements, self._highest_surely_known
        fixed = np.concatenate([element.omega[own] for element, own in zip(elements, modes, strict=True)])  # W
        above = np.maximum(np.abs(estimated), fixed) > highest
        estimated, fixed = estimated[above, None], fixed[above, None]
        shift, of_model = np.abs(estimated) - fixed, open_poles(self.closed_loop)
        far, accuracy = np.abs(shift) > MOTION.far_from_fixed * fixed, self.closed_loop.plant.accuracy
        poles = estimated.real + 1j * (fixed + shift * MODES_TOGETHER)
        starts = estimated.real + 1j * (fixed + shift * np.where(far, ON_THE_WAY, MODES_TOGETHER))
        errors = np.maximum(accuracy, np.abs(shift) / fixed) + np.zeros_like(starts.imag)
        starts, errors = np.append(of_model, starts), np.append(np.full(len(of_model), accuracy), errors)
        return np.append(of_model, poles), starts, errors

    def with_critical_modes(self, plant, gain):
        """Copy of a `Plant` with further modes, near the one that would grow first as the gain is raised.

        With a gain near the largest stable one this mode is hardly damped, and gusts excite it. Added are the modes
        near its frequency that the gain could drive, or all modes there where rounding spoils the response of a cable.
        The plant itself is returned where `gain` [rad/s] is unstable or below `nearly_largest_gain` of the largest
        stable one, or where the modes of the plant reach up to that frequency.
        """
        limit, base = self.limit, plant.modes
        if limit is None or limit.omega <= base.omega[-1]:
            return plant
        if not MOTION.nearly_largest_gain * limit.factor < gain < limit.factor:
            return plant
        models, critical = self.resolving.models, self.resolving._critical_modes(limit)
        search = Search(plant.equilibrium, len(base.omega), plant.accuracy, cables=models.cables)
        band = (1 - MOTION.critical_modes) * limit.omega, (1 + MOTION.critical_modes) * limit.omega
        modes = search.with_modes_in_band(models, base.model.coordinates.limits, critical, *band)
        return replace(plant, modes=modes, driven=len(modes) - len(base.omega))

    def _critical_modes(self, limit):
        """Modes of each cable that the gain could drive, near the frequency of a `Limit`: list of bool, shape (n,)."""
        elements = self.models.elements
        driven = [True] * len(elements) if self.ill_conditioned else self._effects.may_drive(elements, self.gain)
        return [
            in_loop & of_cable & (np.abs(element.omega / limit.omega - 1) < MOTION.critical_modes)
            for element, in_loop, of_cable in zip(elements, self._in_loop, driven, strict=True)
        ]
