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
from cablestudy.control.margins_grid import distinct, near_poles
from cablestudy.control.motion import with_strokes
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
            elements=self._elements,
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
        """`_Spectra` of the movements of bodies, winches at rest: also of loops that only integrate.

        `at_rest` is the `Turbulence` with the winches at rest.
        """
        rows, of_bodies = self._plant.movements
        return _Spectra(at_rest, rows, lambda s: of_bodies @ self.receptance(s), change_at_most=self.change_at_most)

    def tensions(self, at_rest):
        """`_Spectra` of the tensions of cables, winches at rest: also of loops that only integrate; as `movements`."""

        def by_all_modes(s):
            return self.tensions_by(self.loop_gain, s, self.receptance(s))

        return _Spectra(at_rest, self._plant.tension_rows, by_all_modes, of_each_cable=True)

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
        """`_Spectra` of the movements of bodies."""
        if not self._counts_loop:
            return self._plant_in_wind.movements_with_all_modes
        rows, of_bodies = self._plant.movements
        return _Spectra(self._turbulence, rows, lambda s: of_bodies @ self._receptance(s))

    @cached_property
    def _tensions(self):
        """`_Spectra` of the tensions of cables."""
        all_modes = self._plant.all_modes
        if not self._counts_loop:
            return self._plant_in_wind.tensions_with_all_modes

        def by_all_modes(s):
            displacements = self._receptance(s)
            return all_modes.tensions_by(self._with_loop, s, displacements, self._released(s, displacements))

        return _Spectra(self._turbulence, self._plant.tension_rows, by_all_modes, of_each_cable=True)

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
        """`_Spectra` of the speeds of winches."""

        receptance = self._receptance if self._counts_loop else self._plant.all_modes.receptance

        def by_all_modes(s):
            return s[:, None, None] * self._released(s, receptance(s))

        return _Spectra(self._turbulence, self._turbulence.speeds, by_all_modes)

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
        """Upper bound of the changes of the variances of the r outputs of `_Spectra`, shape (w, r); see `at_most`."""
        bound = spectra.change_at_most * _integrals(spectra.coarse, spectra.of_model, weights)
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

        omega, squares = _refined(spectra.squares, *spectra.first, matters)
        changes = spectra.forcing(omega) * (squares[:, 0] - squares[:, 1])
        return MOTION.left_out_safety * _integrals(omega, changes, weights)


def _integrals(omega, values, weights):
    """Sizes of the integrals over frequency of weighted values, shape (f, r), at frequencies [rad/s]: shape (w, r)."""
    frequency = omega / (2 * np.pi)
    weighted = [weight(frequency)[:, None] * values for weight in weights.values()]
    return np.abs(np.trapezoid(weighted, frequency, axis=1))


class _Spectra:
    """Spectra of r outputs in the gusts by a model, above its modes, and their responses by all modes and by the model.

    Responses are those to forces on the bodies. Each is computed when asked for, and kept: with the winches at rest all
    loops share them.

    Parameters
    ----------
    turbulence : Turbulence
        Of the model.
    rows : slice or ndarray of int
        Which of `Turbulence.all_residues` these outputs are.
    by_all_modes : callable
        s, shape (f,) -> response to forces on the d free displacements, by all modes, shape (f, r, d).
    of_each_cable : bool
        True if resonances of each cable are looked at, not only those that add most to the motion of bodies.
    change_at_most : float
        See `BodiesOnAllModes.change_at_most`. [-]

    Attributes
    ----------
    coarse : ndarray
        Frequencies, ascending, at which the response of the model shows how it falls. [rad/s]
    """

    def __init__(
        self, turbulence, rows, by_all_modes, of_each_cable=False, change_at_most=MOTION.left_out_change_at_most
    ):
        self.plant, self._turbulence, self._by_all_modes = turbulence.plant, turbulence, by_all_modes
        self._rows, self._of_each, self.change_at_most = rows, of_each_cable, change_at_most
        low, high = MOTION.left_out_from * self.plant.all_modes.highest, 2 * np.pi * turbulence.range[1]
        self.coarse = np.geomspace(low, max(high, low), MOTION.left_out_points)

    @cached_property
    def _by_model(self):
        """Response by the model to forces on the free displacements, as `by_all_modes`."""
        return self._turbulence.response_to_forces(self.plant.loads_on_bodies, self._rows)

    def squares(self, omega):
        """Squared responses to forces, by all modes and by the model, shape (f, 2, r)."""
        both = self._by_all_modes(1j * omega), self._by_model(1j * omega)
        return np.stack([(np.abs(response * self._units) ** 2).sum(axis=-1) for response in both], axis=1)

    @cached_property
    def _units(self):
        """Forces on the free displacements that each do the same work at rest, shape (d,)."""
        return 1 / np.sqrt(np.diagonal(np.linalg.inv(dense(self.plant.modes.model.reduced.stiffness))))

    @cached_property
    def first(self):
        """Frequencies to begin with: `coarse`, and close to poles of the model and resonances; and `squares` there."""
        poles = (self._turbulence.loop or self.plant.motion).eigen.poles
        poles = np.concatenate([self.plant.all_modes.resonances(self._of_each), poles[poles.imag > 0]])
        omega = distinct(np.append(self.coarse, near_poles(poles)))
        omega = omega[(omega >= self.coarse[0]) & (omega <= self.coarse[-1])]
        return _where_finite(omega, self.squares(omega))

    @cached_property
    def of_model(self):
        """W of the module's docstring: spectra by the model at the frequencies `coarse`, shape (f, r)."""
        residues = self._turbulence.all_residues.of_outputs(self._rows)
        response = np.swapaxes(residues.response(1j * self.coarse), -1, -2)
        return self._turbulence.in_wind.gusts.input_spectra(self.coarse / (2 * np.pi), response)

    @cached_property
    def _forcing(self):
        """W/|Y_model|^2, smoother than both, at the frequencies `coarse`, shape (f, r)."""
        omega, squares = self.first
        squares = _interpolated(self.coarse, omega, squares[:, 1])
        return np.divide(self.of_model, squares, out=np.zeros_like(squares), where=squares > 0)

    def forcing(self, omega):
        """`_forcing` interpolated at other frequencies, shape (f, r)."""
        return _interpolated(omega, self.coarse, self._forcing)

    def least_changes(self, variances, least):
        """Changes of variances, shape (w, r), by which RMS change by a relative error `least`: of the root twice it.

        An output whose motion has almost no energy counts with the share `MOTION.left_out_small` of the largest one.
        """
        stiffness = np.append(self.plant.stiffness_of_outputs, np.ones(len(self.plant.winches)))[self._rows]
        least_variances = MOTION.left_out_small * (variances * stiffness).max(axis=1, keepdims=True) / stiffness
        return 2 * least * np.maximum(variances, least_variances)


def _interpolated(omega, known, values):
    """Values, shape (k, r), known at some frequencies, linearly interpolated at others: shape (f, r)."""
    return np.stack([np.interp(omega, known, of_output) for of_output in values.T], axis=-1)


def _where_finite(omega, values):
    """Frequencies at which all values, shape (f, ...), are finite, and these values."""
    known = np.isfinite(values).reshape(len(omega), -1).all(axis=1)
    return omega[known], values[known]


def _refined(function, omega, values, matters):
    """Refine a grid of frequencies where a function changes fast, by halving intervals.

    An interval is halved where the logarithm of the function may change by more than `MOTION.left_out_change` across
    it, by the steepest slope there or next to it. It must also be wider than `MOTION.left_out_step` times its
    frequency, and matter.

    Parameters
    ----------
    function : callable
        Frequencies [rad/s], shape (f,) -> values, 0 or more, shape (f, ...). Where they are NaN the frequency is left
        out.
    omega : ndarray, shape (f,)
        The grid to begin with, ascending. [rad/s]
    values : ndarray, shape (f, ...)
        Of the function on this grid.
    matters : callable
        Frequencies and values on a grid -> ndarray of bool, shape (f - 1,), False for intervals not to be halved.

    Returns
    -------
    omega, values : ndarray
        The refined grid and the values there, shapes as those of the first one.
    """
    for _ in range(MOTION.left_out_rounds):
        logarithm, width = np.log(np.maximum(values, MOTION.tiny)).reshape(len(omega), -1), np.diff(omega)[:, None]
        slope = np.pad(np.abs(np.diff(logarithm, axis=0)) / width, ((1, 1), (0, 0)))
        # the slope to either side too: it shows a peak between two frequencies with equal values
        steepest = np.maximum(np.maximum(slope[:-2], slope[2:]), slope[1:-1])
        fast = (steepest * width > MOTION.left_out_change).any(axis=1)
        fast &= (np.diff(omega) > MOTION.left_out_step * omega[1:]) & matters(omega, values)
        if not fast.any():
            break
        between = (omega[:-1] + omega[1:])[fast] / 2
        order = np.argsort(np.append(omega, between), kind="stable")
        omega, values = np.append(omega, between)[order], np.concatenate([values, function(between)])[order]
        omega, values = _where_finite(omega, values)
    return omega, values
