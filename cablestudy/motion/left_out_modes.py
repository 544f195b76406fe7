"""Errors of variances by the modes of cables that a model leaves out, such as a wave along a cable above its modes.

A model has the lowest modes, and static responses in place of the others. Where a wave along a cable lies above these
modes, a static response moves the bodies with another frequency than the wave does, in a model with fewer modes too:
comparing the two shows nothing of it. Here the bodies stand on the dynamic stiffness of the cables with all modes of
their elements: in the notation of `control.loop_gain` forces on them move them by

    u = R(s) f,   R(s) = (Z(s) + g F(s) A C1(s) N(s) P)^-1,

and the tension at an end with the tangent t is t^T S(s) (G u + H v), with the lengths v that winches reel in. With the
responses Y of an output to forces on the bodies, by all modes and by the model, its spectrum W in the gusts changes by

    W (|Y_all|^2/|Y_model|^2 - 1)

whose integral over the frequencies above the modes of the model is the change of the variance.
"""

from functools import cached_property

import numpy as np

from cablestudy.cable.matrices import dense
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.motion import with_strokes
from cablestudy.motion.left_out_spectra import UpperSpectra, refined_grid, weighted_integrals
from cablestudy.motion.tolerances import MOTION
from cablestudy.motion.turbulence import VALUE_AND_RATE
from cablestudy.statics.suspension import outward_tangents
from cablestudy.system.coupling_damping import compute_pole_sums
from cablestudy.system.together import computed_together


class BodiesOnAllModes:
    """Responses of the bodies of a `Plant` to forces on them, by all modes of the cables that may add to a variance.

    The winches are at rest.

    Parameters
    ----------
    plant : Plant

    Attributes
    ----------
    highest : float
        Frequency up to which the plant has all modes: the highest except for those that were added, far above perhaps,
        because the loop would drive them first (`Plant.driven`). [rad/s]
    """

    def __init__(self, plant):
        self._plant, self._models = plant, plant.modes.models
        self.highest = plant.modes.omega[-1 - plant.driven]
        self._end_movements = plant.end_movements

    @cached_property
    def _elements(self):
        """Elements of each cable, in the air, with the modes that the plant may have, or that may add to a variance."""
        added = []
        for element, by_bodies in zip(self._models.elements, self._end_movements, strict=True):
            of_cable = _variances_added(element.omega, element.coupling @ by_bodies, element.omega)
            added.append(np.where(element.omega > MOTION.left_out_from * self.highest, of_cable, 0.0))
        least = MOTION.left_out_share * max((of_cable.max(initial=0.0) for of_cable in added), default=0.0)
        pairs = zip(self._models.elements, added, strict=True)
        chosen = [(element.omega <= self.highest) | (of_cable > least) for element, of_cable in pairs]
        kept = self._plant.in_air(self._models, self._models.with_modes(chosen))
        return [of_cable.element for of_cable in kept]

    @cached_property
    def change_at_most(self):
        """Change of the integral of a spectrum above the modes of the plant, at most, over that integral. [-]

        It is `MOTION.left_out_change_at_most`, but of one free displacement, of the mass M, it follows from the modes.
        One of a cable between fixed ends, with the coupling c and the damping ratio zeta, adds r = c^2/M to this mass
        below its frequency and takes it off above: by that it changes the spectrum by about r, and by its resonance by
        pi/8 r^2/zeta. Modes may coincide: r is added up, and so is r/zeta.
        """
        if len(self._plant.bodies) != 1 or len(self._plant.layout.free) != 1:
            return MOTION.left_out_change_at_most
        shares, peaks = 0.0, 0.0
        for element, by_bodies in zip(self._models.elements, self._end_movements, strict=True):
            share = (element.coupling @ by_bodies)[:, 0] ** 2 / dense(self._plant.modes.model.reduced.inertia)[0, 0]
            above = element.omega > MOTION.left_out_from * self.highest
            ratio = np.maximum(element.decay / element.omega, MOTION.undamped_motion)
            shares, peaks = shares + share.sum(), peaks + (share / ratio)[above].sum()
        by_shares, by_peaks = MOTION.left_out_change_of_one
        return float(shares * (by_shares + by_peaks * peaks))

    @computed_together
    def loop_gain(bodies):
        """`LoopGain` without a loop, whose receptance is R; None where rounding spoils the response of a cable."""
        loop_gains = {one: one._loop_gain for one in bodies}
        usable = [loop_gain for loop_gain in loop_gains.values() if not loop_gain.ill_conditioned]
        compute_pole_sums(damping for loop_gain in usable for damping in loop_gain.coupling_damping)
        yield from ((one, None if loop_gain.ill_conditioned else loop_gain) for one, loop_gain in loop_gains.items())

    @property
    def _loop_gain(self):
        """`loop_gain`, whether or not rounding spoils it."""
        plant, cables = self._plant, len(self._end_movements)
        size, free = len(plant.bodies), len(plant.layout.free)
        return LoopGain(
            plant.bodies,
            elements=[element.with_loads_at_rest for element in self._elements],
            connection=with_strokes(self._end_movements, size - free),
            reeling=np.zeros((cables, 6, 0)),
            winch_loads=np.zeros((size, 0)),
            measured=np.zeros((0, size)),
            allocation=np.zeros((0, 0)),
            controller=None,
            windows=True,
        )

    @cached_property
    def _resonances(self):
        """Poles of the modes of each cable between fixed ends, upper half plane [rad/s], and what they add: pairs."""
        pairs = []
        for element, by_bodies in zip(self._elements, self._end_movements, strict=True):
            decay = np.maximum(element.decay, MOTION.undamped_motion * element.omega)
            of_cable = _variances_added(element.omega, element.coupling @ by_bodies, decay)
            above = element.omega > MOTION.left_out_from * self.highest
            pairs.append((1j * element.omega - element.decay, np.where(above, of_cable, 0.0)))
        return pairs

    def resonances(self, of_each_cable):
        """Poles of the modes of cables that add most to variances, complex, shape (r,). [rad/s]

        They are those that add most of all cables together or, with `of_each_cable`, of each cable by itself.
        """
        largest = [added.max(initial=0.0) for _, added in self._resonances]
        largest = largest if of_each_cable else [max(largest, default=0.0)] * len(largest)
        pairs = zip(self._resonances, largest, strict=True)
        chosen = [poles[added > MOTION.left_out_resonances * most] for (poles, added), most in pairs]
        return np.concatenate([np.zeros(0, dtype=complex), *chosen])  # none of no cable

    def movements(self, at_rest):
        """`UpperSpectra` of the movements of bodies, winches at rest: also of loops that only integrate.

        `at_rest` is the `Turbulence` with the winches at rest.
        """
        rows, of_bodies = self._plant.movements
        return UpperSpectra(at_rest, rows, lambda s: of_bodies @ self.receptance(s), change_at_most=self.change_at_most)

    def tensions(self, at_rest):
        """`UpperSpectra` of the tensions of cables, winches at rest: of integrating loops too; as `movements`."""

        def by_all_modes(s):
            return self.tensions_by(self.loop_gain, s, self.receptance(s))

        return UpperSpectra(at_rest, self._plant.tension_rows, by_all_modes, of_each_cable=True)

    def receptance(self, s):
        """Free displacements of bodies by forces on them, shape (f, d, d)."""
        free = len(self._plant.layout.free)
        return self.loop_gain.receptance(s)[:, :free, :free]

    def tensions_by(self, loop_gain, s, displacements, released=None):
        """Tensions at both ends of all cables, shape (f, 2 c, j), by all modes of the elements of a `LoopGain`.

        By free displacements of the bodies, shape (f, d, j), and lengths that winches let out, (f, i, j), None of none.
        """
        tensions = []
        for cable, element in enumerate(loop_gain.elements_at_all_ends):
            ends = self._end_movements[cable] @ displacements
            if released is not None:
                ends = ends - loop_gain.reeling[cable] @ released
            forces = (element.dynamic_stiffness(s) @ ends).reshape(len(s), 2, 3, -1)
            tensions.append((self._outward_tangents[cable, :, None] @ forces)[:, :, 0])
        return np.concatenate(tensions, axis=1)

    @cached_property
    def _outward_tangents(self):
        """Unit tangents at the ends of the cables that point out of them, shape (c, 2, 3)."""
        return outward_tangents(self._plant.equilibrium)[0]


def _variances_added(omega, coupling, decay):
    """Estimate what resonances of modes add to the variances of bodies, over an unknown factor, shape (n,).

    A mode with a coupling c to the bodies, shape (n, d), and a decay a [1/s] adds about c^4 S/(a w^2), and the spectrum
    S of the gusts falls with w^(-5/3).
    """
    return np.linalg.norm(coupling, axis=-1) ** 4 / (decay * omega ** (11 / 3))


class LeftOutModes:
    """Errors of the variances of a `LoopInWind` by the modes that its model leaves out: sizes of their changes.

    Parameters
    ----------
    in_wind : LoopInWind
        Stable.
    """

    def __init__(self, in_wind):
        self._closed_loop, self._plant_in_wind = in_wind.closed_loop, in_wind.plant_in_wind
        self._plant, self._turbulence = in_wind.closed_loop.plant, in_wind.turbulence
        self._loop, self._known_changes = self._turbulence.loop, {}

    def of_movements(self, weights, variances, others, least):
        """Errors of the variances of movements of bodies and markers, shape (w, o); 0 of other outputs.

        Parameters
        ----------
        weights : dict
            Name -> function of frequency [Hz], as in `Turbulence.weighted_variances`.
        variances, others : ndarray, shape (w, o)
            Variances of the model, and their errors from other causes: changes smaller than these are not resolved.
        least : float
            Smallest relative error that an RMS is stated with, infinite if none: smaller changes are not computed.
        """
        rows, change = self._plant.movements[0], np.zeros(variances.shape)
        if len(rows) and np.isfinite(least):
            change[:, rows] = self._changes(self._movements, weights, variances[:, rows], others[:, rows], least)
        return change

    def of_tensions(self, variances, others, least):
        """Errors of the variances of tensions and their rates, shape (2, o); 0 of others; as `of_movements`."""
        rows, change = self._plant.tension_rows, np.zeros(variances.shape)
        if len(self._plant.layout.free) and np.isfinite(least):
            change[:, rows] = self._changes(self._tensions, VALUE_AND_RATE, variances[:, rows], others[:, rows], least)
        return change

    def of_winch_speeds(self, variances, others, least):
        """Errors of the variances of speeds and accelerations of winches, shape (2, i); as `of_movements`."""
        if not (self._moves_winches and np.isfinite(least)):
            return np.zeros(variances.shape)
        return self._changes(self._winch_speeds, VALUE_AND_RATE, variances, others, least)

    @cached_property
    def _movements(self):
        """`UpperSpectra` of the movements of bodies."""
        if not self._counts_loop:
            return self._plant_in_wind.movements_with_all_modes
        rows, of_bodies = self._plant.movements
        return UpperSpectra(self._turbulence, rows, lambda s: of_bodies @ self._receptance(s))

    @cached_property
    def _tensions(self):
        """`UpperSpectra` of the tensions of cables."""
        all_modes = self._plant.all_modes
        if not self._counts_loop:
            return self._plant_in_wind.tensions_with_all_modes

        def by_all_modes(s):
            displacements = self._receptance(s)
            return all_modes.tensions_by(self._with_loop, s, displacements, self._released(s, displacements))

        return UpperSpectra(self._turbulence, self._plant.tension_rows, by_all_modes, of_each_cable=True)

    @property
    def turbulence(self):
        """`Turbulence` of the model in whose spectra changes of movements and tensions are sought."""
        return self._turbulence if self._counts_loop else self._plant_in_wind.at_rest

    @property
    def _counts_loop(self):
        """True if motions above the model's modes depend on the loop, so that their responses are those with it closed.

        They do behind a law with other parts than an integral, and where the loop would drive one of them first as its
        gain is raised.
        """
        loop = self._loop
        return loop is not None and (self._plant.driven > 0 or not loop.law.integrates_only)

    @property
    def _moves_winches(self):
        """True if motions above the model's modes may move winches: of an integrator where a notch passes them too."""
        loop = self._loop
        if loop is None or self._counts_loop:
            return loop is not None
        return any(notch and notch.rolloff_omega > self._plant.all_modes.highest for notch in loop.notches)

    def _released(self, s, displacements):
        """Lengths that winches let out by forces on the bodies, by free displacements by these, both (f, ..., d)."""
        loop = self._loop
        commands = loop.controller(s)[:, :, None] * (self._closed_loop.stability.effects.measured @ displacements)
        return loop.gain * (loop.allocation.matrix @ commands)

    @cached_property
    def _winch_speeds(self):
        """`UpperSpectra` of the speeds of winches."""

        receptance = self._receptance if self._counts_loop else self._plant.all_modes.receptance

        def by_all_modes(s):
            return s[:, None, None] * self._released(s, receptance(s))

        return UpperSpectra(self._turbulence, self._turbulence.speeds, by_all_modes)

    def _receptance(self, s):
        """Free displacements of bodies by forces on them, with the loop closed, by `_with_loop`, shape (f, d, d)."""
        free = len(self._plant.layout.free)
        return self._with_loop.receptance(s, self._loop.gain)[:, :free, :free]

    @property
    def unknown(self):
        """True if rounding spoils the response of a cable, so that no change is known."""
        return (self._with_loop if self._counts_loop else self._plant.all_modes.loop_gain) is None

    @cached_property
    def _with_loop(self):
        """`LoopGain` of the loop with all modes that count; None where rounding spoils the response of a cable."""
        loop_gain = self._closed_loop.stability.judged_by.loop_gain
        return loop_gain if isinstance(loop_gain, LoopGain) else None

    def at_most(self, weights, variances, least):
        """Upper bound of `of_movements` that takes little time, shape (w, o); zero of weights by which none matters."""
        rows, bound = self._plant.movements[0], np.zeros(variances.shape)
        if len(rows) and np.isfinite(least):
            bound[:, rows] = self._at_most(self._movements, weights, variances[:, rows], least)
        return bound

    @property
    def needs_bodies_at_rest(self):
        """True if errors of variances of movements follow from `BodiesOnAllModes.loop_gain`."""
        return not self._counts_loop

    @staticmethod
    def _at_most(spectra, weights, variances, least):
        """Upper bound of the changes of the variances of the r outputs of `UpperSpectra`, (w, r); see `at_most`."""
        bound = spectra.change_at_most * weighted_integrals(spectra.coarse, spectra.of_model, weights)
        return bound * (bound > spectra.least_changes(variances, least)).any(axis=1, keepdims=True)

    def _changes(self, spectra, weights, variances, others, least):
        """`_new_changes`, once for all exposures and mirrors, of which the variances of displacements are the same."""
        key = spectra, *weights.values(), variances.tobytes(), others.tobytes(), least
        if key not in self._known_changes:
            self._known_changes[key] = self._new_changes(spectra, weights, variances, others, least)
        return self._known_changes[key]

    def _new_changes(self, spectra, weights, variances, others, least):
        """Estimate by how much the modes that the model leaves out change the variances of r outputs, shape (w, r).

        The estimate is |integral of weight (S_all - S_model)| over frequency, times `MOTION.left_out_safety`: S are the
        spectra of an output with all modes and with those of the model (`spectra`). It is zero if no change can be as
        large as `least` says, and if rounding spoils the response with all modes (`unknown`).

        `weights` has w functions of frequency [Hz], one for each kind of variance. `variances` and `others`, both (w,
        r), are those by the model, and their errors due to other causes: a change that is small compared with these
        need not be exact. `least` is the least relative change of an RMS that matters.
        """
        if not self._at_most(spectra, weights, variances, least).any() or self.unknown:
            return np.zeros(variances.shape)
        smallest = np.maximum(spectra.least_changes(variances, least), others)

        @np.errstate(divide="ignore", invalid="ignore")  # where nothing moves
        def matters(omega, squares):
            """True for intervals in which a peak may change a variance by more than `smallest`, shape (f - 1,)."""
            spectrum, frequency = spectra.forcing(omega) * squares.max(axis=1), omega / (2 * np.pi)
            known = zip(weights.values(), smallest, strict=True)
            shares = [weight(frequency)[:, None] * spectrum / of_weight for weight, of_weight in known]
            density = np.max(shares, axis=(0, 2))
            return MOTION.left_out_flank * np.maximum(density[:-1], density[1:]) * np.diff(frequency) > 1

        omega, squares = refined_grid(spectra.squares, *spectra.first, matters)
        changes = spectra.forcing(omega) * (squares[:, 0] - squares[:, 1])
        return MOTION.left_out_safety * weighted_integrals(omega, changes, weights)
