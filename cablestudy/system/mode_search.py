"""Search for the coupled modes of a suspension to an accuracy.

The errors are estimated from a single model: the energy of each mode in the highest polynomials of the elements tells
what the mesh of each cable leaves out (`cables.Models.mesh_error`), and what the coordinates of the cables leave out
adds a known mass (`cables.Models.truncation_error`). Cables whose mesh is too coarse are refined.
"""

from functools import partial
from math import ceil

import numpy as np

from cablestudy.cable.damping import grows_with_modes
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import ConvergenceError, NoSolutionError, outcome_of
from cablestudy.system.cables import Models, has_more_modes
from cablestudy.system.coupled import Layout
from cablestudy.system.coupled_solution import modes_of_row
from cablestudy.system.coupled_trial import Trial
from cablestudy.system.hanging_cables import fixed_meshes
from cablestudy.system.tolerances import SYSTEM

ORDER_STEPS = np.array([6, 8, 10, 12, 14, 16, 20, 24, 32, 40])  # sums of orders to begin with: cables then share a mesh


class Search:
    """Search for the lowest modes of n suspensions, called rows, with equal names and connections, c cables each.

    Rows are solved together until each has its accuracy. No digit of a row depends on the others.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of these rows, shape (n,); or of one, without an axis of rows.
    count : int
        Number of modes of each row, from the lowest.
    accuracy : float
        Relative, of the frequencies. [-]
    cables : Cables
        Of one row after the other.
    damped : bool
        True if the modes serve for damping too: on finer meshes, with more modes of the cables.
    shaped : bool
        True if the modes serve for the form of each cable too, also of those whose own modes lie far above the lowest
        ones: see `shaping_modes`.
    """

    def __init__(self, equilibrium, count, accuracy, cables, damped=False, shaped=False):
        self.layout, self.count, self.accuracy, self.cables = Layout(equilibrium), count, accuracy, cables
        self._rows, self._damped, self._shaped = int(np.prod(self.layout.shape)), damped, shaped
        self._heavy = cables.heavy.reshape(self._rows, -1)
        self._travel_time = cables.travel_time.reshape(self._rows, -1)

    def solve(self):
        """Find the modes of each row (suspension) to the accuracy, on meshes that are refined until it is reached.

        Returns
        -------
        list of (CoupledModes or Exception), one for each row
            An exception says why a row has no modes. NoSolutionError: the equilibrium is not stable, or a cable with
            mass hangs folded, or slack without weight. ConvergenceError: there is no equilibrium, or the accuracy
            cannot be reached.
        """
        outcomes = self.refused
        rows = np.array([row for row, refused in enumerate(outcomes) if refused is None], dtype=int)
        if not len(rows):
            return outcomes
        highest = self._first_guess(rows)
        orders, limits = self._orders(rows, highest), self._first_limits(rows, highest)
        for _ in range(SYSTEM.mesh_trials):
            cables = self._cables_of(rows)
            meshes = cables.meshes(orders.ravel() + SYSTEM.finer_orders * self._damped)
            models = Models(cables, meshes, modes_of_large=self._modes_up_to(limits, rows))
            trials, highest, limits = self._with_enough_coordinates(rows, models, highest, limits)
            for k, row in enumerate(rows.tolist()):
                finer = partial(self._finer_modes, row, orders[k], limits[k], highest[k])
                outcomes[row] = self._accurate_modes(row, trials[k], finer)
            coarse = [k for k, row in enumerate(rows.tolist()) if outcomes[row] is None]
            if not coarse:
                return outcomes
            trials_of_coarse = [trials[k] for k in coarse]
            mesh_errors = [trial.mesh_error[row].max(axis=-1, initial=0.0) for trial, row in trials_of_coarse]
            rows, orders, highest, limits = (array[coarse] for array in (rows, orders, highest, limits))
            orders = self._refined_orders(rows, orders, np.stack(mesh_errors), highest)
        failure = self._accuracy_error("finer meshes of the cables do not help")
        return [failure if outcome is None else outcome for outcome in outcomes]

    def _accurate_modes(self, row, outcome, finer):
        """Modes of one row to the accuracy, the error that there are none, or None where the mesh is too coarse.

        `outcome` is the trial of the row and its index there, or an error, see `_with_enough_coordinates`; `finer`
        makes modes of a finer model, which damping needs.
        """
        if isinstance(outcome, Exception):
            return outcome
        trial, row_of_trial = outcome
        error = trial.error[row_of_trial]
        if error.max(initial=0.0) > self.accuracy:
            return None
        serves_for_damping = self._damped or not self._heavy[row].any()
        return outcome_of(partial(modes_of_row, trial, row_of_trial, error, None if serves_for_damping else finer))

    def _refined_orders(self, rows, orders, mesh_errors, highest):
        """Sums of element orders along each cable for the next meshes, shape (m, c).

        They are higher where the mesh makes too large an error. `orders` are those of the last meshes, `mesh_errors`
        the largest relative errors of a squared frequency due to the mesh of each cable, of which accuracy/c is
        allowed; both of shape (m, c). `highest` is the highest frequency found. [rad/s]
        """
        excess = np.maximum(mesh_errors * mesh_errors.shape[1] / self.accuracy, 1.0)
        refinements = np.ceil(np.log10(excess) / SYSTEM.finer_digits)
        added = SYSTEM.finer_orders * refinements * np.ceil(orders / SYSTEM.highest_order)
        return np.where(excess > 1, np.maximum(orders + added, self._orders(rows, highest)), orders)

    def with_modes_in_band(self, models, limits, chosen, lowest, highest):
        """Find the lowest modes of the only suspension, and those in a band of frequency, with chosen modes of cables.

        Parameters
        ----------
        models : Models
            Elements and modes with fixed ends of the c cables.
        limits : ndarray, shape (c,)
            Frequency of each cable below which its modes are coordinates. [rad/s]
        chosen : list of (ndarray of bool, shape (n,))
            For each cable, which of its n modes are coordinates in any case.
        lowest, highest : float
            Ends of the band of frequency. [rad/s]

        Returns
        -------
        CoupledModes
            The `count` lowest modes, and all in the band. Their errors are those by the meshes alone.

        Raises
        ------
        NoSolutionError
            The equilibrium is not stable.
        """
        coordinates = models.coordinates(limits, chosen)
        trial = Trial(self.layout, coordinates, len(coordinates.omega) + len(self.layout.free))
        omega = trial.omega[0]
        trial = trial.take_modes((np.arange(len(omega)) < self.count) | ((omega > lowest) & (omega < highest)))
        return modes_of_row(trial, 0, np.maximum(trial.mesh_error[0].sum(axis=0) / 2, SYSTEM.frequency_rounding))

    def solve_stated_elements(self, model):
        """Find the modes of each row (suspension) with the elements that the scene states, whatever their accuracy is.

        Parameters
        ----------
        model : FixedModel
            These elements, the same for each cable.

        Returns
        -------
        list of (CoupledModes or Exception), one for each row
            An exception says why a row has no modes: as for `solve`, or because its elements have no equilibrium.
        """
        outcomes, batches, meshes = self.refused, {}, fixed_meshes(self.cables, model)
        for row, refused in enumerate(outcomes):
            if refused is None:
                batches.setdefault(self._batch_of_elements(row, meshes), []).append(row)
        for (row_alone, _), rows in batches.items():
            of_rows = self._modes_of_elements(np.array(rows), row_alone is not None, meshes)
            for row, outcome in zip(rows, of_rows, strict=True):
                outcomes[row] = outcome
        return outcomes

    def _batch_of_elements(self, row, meshes):
        """Key of the rows whose stated elements are solved in one call.

        It is the row itself, if that is solved alone: with many elements, or in a steady wind; and True if loads on its
        cables act across their planes, and couple the motion in and out of them.
        """
        cables, loads = self._cable_indices([row]), self.cables.catenary.span.load_forces
        large = any(meshes[cable] and has_more_modes(meshes[cable]) for cable in cables)
        alone = large or self.cables.in_steady_wind[cables].any()
        return row if alone else None, bool(np.any(loads[cables, :, 2]))

    def _modes_of_elements(self, rows, alone, meshes):
        """Modes of some rows (suspensions) with stated elements: list of (CoupledModes or Exception).

        The rows are solved in one call, or each by itself if this call fails. All modes of each cable are computed and
        kept. If `alone` is True, the one row has cables of many elements or in a steady wind, and only as many modes of
        each cable are computed as are needed; modal damping then follows from a model with more (`_damped_by_all`).

        Parameters
        ----------
        rows : ndarray of int
            Indices of the rows.
        alone : bool
            Whether the row is solved alone, see `_batch_of_elements`.
        meshes : list of (Mesh or None)
            Elements of each cable of all rows; None of a cable without mass.
        """
        cables, meshes_of_rows = self._cables_of(rows), [meshes[cable] for cable in self._cable_indices(rows)]
        most_modes = min(self._modes_needed(rows), SYSTEM.modes_of_cable) if alone else SYSTEM.modes_of_cable
        models = Models(cables, meshes_of_rows, fixed=True, most_modes=most_modes)
        limits = np.where(cables.heavy, np.inf, 0.0)  # frequency up to which each cable keeps its modes
        try:
            trial = self._trial(models, limits, rows)
        except (NoSolutionError, ConvergenceError) as error:
            if len(rows) == 1:
                return [error]
            return [outcome for row in rows for outcome in self._modes_of_elements(np.array([row]), alone, meshes)]
        modal = any(grows_with_modes(damping) for damping in cables.damping)
        finer = None
        if modal and not models.complete:  # the only row: of several all modes are computed
            finer = partial(self._damped_by_all, rows, meshes_of_rows)
        unknown_errors = np.full(self.count, np.nan)
        return [outcome_of(partial(modes_of_row, trial, row, unknown_errors, finer)) for row in range(len(rows))]

    def _damped_by_all(self, rows, meshes):
        """`CoupledModes` of a single row with stated elements, for damping: by more modes of cables than it keeps.

        `modes_of_cable` modes of each cable are coordinates. The modal damping of up to `modally_damped_modes` others
        acts as on slow movements of the ends, see `Superelement.combine`.
        """
        cables, kept = self._cables_of(rows), SYSTEM.modes_of_cable
        models = Models(cables, meshes, fixed=True, most_modes=SYSTEM.modally_damped_modes)
        limits = np.zeros(cables.count)
        for group in models.groups:
            omega = np.sort(group.ends.omega, axis=-1)
            limits[group.cable_indices] = omega[:, kept] if omega.shape[-1] > kept else np.inf
        count = self.count + SYSTEM.modes_beyond
        return modes_of_row(self._trial(models, limits, rows, count), 0, np.full(count, np.nan))

    def _finer_modes(self, row, orders, limits, highest):
        """`CoupledModes` of one row, of a finer model with more modes of cables, some beyond those asked for."""
        rows, count = np.array([row]), self.count + SYSTEM.modes_beyond
        cables = self._cables_of(rows)
        limits = np.where(limits > 0, np.maximum(SYSTEM.wider * limits, SYSTEM.damping_limit * highest), 0.0)
        trial = self._trial(Models(cables, cables.meshes(orders + SYSTEM.finer_orders)), limits, rows, count)
        return modes_of_row(trial, 0, trial.error[0])

    @property
    def refused(self):
        """Reasons why rows have no modes, whatever the accuracy: list of (Exception or None)."""
        equilibrium, names = self.layout.equilibrium, self.layout.equilibrium.suspension.cable_names
        no_equilibrium = ~np.broadcast_to(equilibrium.record.converged, self.layout.shape).ravel()
        folded = self.cables.folded.reshape(self._rows, -1)
        shapeless = self.cables.shapeless.reshape(self._rows, -1)
        reasons = [None] * self._rows
        for row in np.flatnonzero(no_equilibrium | folded.any(axis=1) | shapeless.any(axis=1)).tolist():
            if no_equilibrium[row]:
                reasons[row] = ConvergenceError("modes need an equilibrium, and the search for the pose found none")
            elif folded[row].any():
                name = names[int(np.argmax(folded[row]))]
                text = f"{name} hangs folded: somewhere it has no tension, and no stiffness about it"
                reasons[row] = NoSolutionError(text)
            else:
                listed = ", ".join(np.array(names)[shapeless[row]])
                text = f"{listed}: slack and without weight, so that nothing determines where its mass is"
                reasons[row] = NoSolutionError(text)
        return reasons

    def _layout_of(self, rows):
        """`Layout` of some rows."""
        return self.layout if len(rows) == self._rows else self.layout.take(rows)

    def _cable_indices(self, rows):
        """Indices of the cables of some rows among those of all."""
        cables_of_row = self.cables.count // self._rows
        return (cables_of_row * np.asarray(rows)[:, None] + np.arange(cables_of_row)).ravel()

    def _cables_of(self, rows):
        """`Cables` of some rows."""
        return self.cables if len(rows) == self._rows else self.cables.take(self._cable_indices(rows))

    @property
    def _margin(self):
        """Multiple of the highest frequency up to which the modes of cables are kept at first. [-]"""
        margin = max(SYSTEM.least_mode_limit, SYSTEM.mode_limit * self.accuracy ** (-1 / SYSTEM.left_out_power))
        return max(SYSTEM.damping_limit, SYSTEM.wider * margin) if self._damped else margin

    @property
    def _least_margin(self):
        """Least `_margin` of cables whose first mode is among those asked for, or near. [-]"""
        return SYSTEM.damping_limit / SYSTEM.wider if self._damped else 1.0

    def _modes_up_to(self, limits, rows):
        """Estimate of the number of modes of each cable of some rows up to its limit [rad/s], with some more."""
        waves = (limits * self._travel_time[rows]).ravel() / np.pi
        modes = np.ceil(SYSTEM.modes_beyond + SYSTEM.wider * self.cables.across * waves)
        return np.minimum(modes, SYSTEM.modes_of_cable).astype(int)

    def _modes_needed(self, row):
        """Number of modes of each cable of one row that stated elements need: others change no digit."""
        highest = SYSTEM.mode_limit * SYSTEM.exact_elements ** (-1 / SYSTEM.left_out_power) * self._first_guess(row)[0]
        return 8 + ceil(2 * highest * self._travel_time[row].max(initial=0.0) / np.pi)

    def _first_guess(self, rows):
        """Estimate of the highest angular frequency asked for: cables as strings, bodies on their static stiffness.

        Returns
        -------
        ndarray, shape (len(rows),)
        """
        layout, cables, harmonics = self._layout_of(rows), self.cables, np.arange(1, self.count + 1)
        time = -np.sort(-np.where(self._heavy, self._travel_time, 0.0)[rows], axis=1)
        time = time[:, : self.count]  # no more cables have one of the lowest modes
        first_omega = np.divide(np.pi, time, out=np.full(time.shape, np.inf), where=time > 0)
        strings = np.repeat((first_omega[..., None] * harmonics).reshape(len(rows), -1), cables.across, axis=1)
        index = self._cable_indices(rows)
        of_ends = (
            matrix[index].reshape(*layout.shape, -1, 6, 6) for matrix in (cables.end_stiffness, cables.straight_inertia)
        )
        bodies = layout.without_modes(*of_ends).lowest(self.count)[0].reshape(len(rows), -1)
        omega = np.sort(np.concatenate([strings, bodies], axis=1), axis=1)[:, : self.count]
        return np.where(np.isfinite(omega), omega, 0.0).max(axis=1, initial=0.0)

    def _orders(self, rows, highest):
        """Sum of orders along each cable of m rows, (m, c), that resolves waves up to `highest` [rad/s], (m,)."""
        waves = highest[:, None] * self._travel_time[rows] / np.pi
        return self.orders_of(np.maximum(waves, shaping_modes(self.accuracy)) if self._shaped else waves)

    def orders_of(self, waves):
        """Sum of orders along each cable from which some half-waves are resolved to the accuracy, shape (..., c)."""
        orders = CABLE.orders_per_half_wave * waves - SYSTEM.orders_per_digit * np.log10(self.accuracy)
        steps = ORDER_STEPS[np.minimum(np.searchsorted(ORDER_STEPS, orders), len(ORDER_STEPS) - 1)]
        return np.where(orders <= ORDER_STEPS[-1], steps, 8 * np.ceil(orders / 8))

    def _first_limits(self, rows, highest):
        """Frequency up to which each of c cables of m rows keeps its modes in the first trial, shape (m, c). [rad/s]

        Let w be the highest frequency that is asked for, W the first one of a cable and r the share of all cables in
        the mass of a row. Without its modes the cable changes w^2 by about r (w/W)^2, relative. It keeps none, a limit
        of zero, if this is well below the accuracy and W well above w. Else it keeps those up to a multiple of w
        (`_margin`); if the modes must give the form of cables too (`shaped`), up to `shaping_modes` times W at least.
        """
        # Dunkerley: masses on a string lower its first mode at most by this
        lowering = np.sqrt(1 + (np.pi / 2) ** 2 * self.cables.carried).reshape(self._rows, -1)[rows]
        first_omega = np.pi / np.maximum(self._travel_time[rows], 1e-300) / lowering
        highest = highest[:, None]
        body_mass = np.asarray(self.layout.equilibrium.suspension.mass)
        body_mass = np.broadcast_to(body_mass, (*self.layout.shape, body_mass.shape[-1])).reshape(self._rows, -1)[rows]
        cable_mass = self.cables.mass.reshape(self._rows, -1)[rows].sum(axis=1, keepdims=True)
        mass_share = cable_mass / (cable_mass + body_mass.sum(axis=1, keepdims=True))
        error, allowed = mass_share * (highest / first_omega) ** 2, SYSTEM.no_modes_error * SYSTEM.coordinates_share
        far_above = (error <= allowed * self.accuracy) & (SYSTEM.near_highest * highest < first_omega)
        limits = np.where(far_above, 0.0, self._margin * highest)
        if self._shaped:
            limits = np.maximum(limits, shaping_modes(self.accuracy) * first_omega)
        return np.where(self._heavy[rows], limits, 0.0)

    def _with_enough_coordinates(self, rows, models, highest, limits):
        """Solve rows (suspensions) with more and more modes of cables.

        A row is solved when the error by the modes left out is within its part of the accuracy (`coordinates_share`).
        `highest`, shape (m,), and `limits`, (m, c), are first estimates as in `_judge`.

        Returns
        -------
        outcomes : list of ((Trial, int) or Exception)
            For each row a `Trial` with its modes, or one that shows it to be not stable, and the index of the row in
            this trial. A ConvergenceError if no trial had enough coordinates.
        highest, limits : ndarray, shapes (m,) and (m, c)
            The highest frequency found in the last trial of each row, and the limits after it. [rad/s]
        """
        outcomes = [self._accuracy_error("too many modes of cables")] * len(rows)
        highest, limits, pending = highest.copy(), limits.copy(), np.arange(len(rows))
        for _ in range(SYSTEM.limit_trials):
            tried_limits = limits[pending]
            models = models.with_modes_up_to(limits.ravel())
            pending_models = models if len(pending) == len(rows) else models.take(self._cable_indices(pending))
            trial = self._trial(pending_models, tried_limits.ravel(), rows[pending])
            judged = self._judge(trial, pending_models, rows[pending], highest[pending], tried_limits)
            good, highest[pending], limits[pending] = judged
            stable = ~np.isnan(trial.omega).any(axis=1)
            for row_of_trial in np.flatnonzero(good | ~stable).tolist():
                outcomes[pending[row_of_trial]] = trial, row_of_trial
            pending = pending[~good & stable]
            if not len(pending):
                break
        return outcomes, highest, limits

    def _judge(self, trial, models, rows, highest, limits):
        """Decide for each of m rows of a trial if its c cables keep enough modes; else widen their limits.

        They do if three conditions hold: all modes were found; the error due to modes of cables left out is within its
        part of the accuracy; and cables with own modes near those asked for keep enough of them.

        Returns
        -------
        good : ndarray of bool, shape (m,)
        highest : ndarray, shape (m,)
            Highest frequency that was found; a multiple of the previous estimate where too few modes were found.
            [rad/s]
        limits : ndarray, shape (m, c)
            Frequency up to which each cable keeps its modes: that of the trial where it is good, else a higher one.
            [rad/s]
        """
        allowed = 2 * SYSTEM.coordinates_share * self.accuracy  # of squared frequencies
        too_few = np.isinf(trial.omega).any(axis=1) & self._heavy[rows].any(axis=1)
        found = np.where(np.isfinite(trial.omega), trial.omega, 0.0).max(axis=1, initial=0.0)
        highest = np.where(too_few, SYSTEM.wider * highest, found)
        # cables whose first mode is among those asked for, or near: they keep modes at least up to these
        near = models.lowest_omega.reshape(limits.shape) < SYSTEM.near_highest * highest[:, None]
        error = np.abs(trial.truncation_error)
        good = ~too_few & (error.sum(axis=1).max(axis=-1, initial=0.0) <= allowed)
        good &= (~near | (limits >= self._least_margin * highest[:, None])).all(axis=1)
        wider = self._wider_limits(error.max(axis=-1, initial=0.0), allowed, limits, near, highest)
        return good, highest, np.where(good[:, None], limits, wider)

    def _wider_limits(self, error, allowed, limits, near, highest):
        """Limits of the modes of cables for the next trial, shape (m, c).

        They are wider where the modes left out make too large an error. The error of a cable falls about as limit^-n, n
        = `left_out_power`. If it is x > 1 times the value allowed, the limit grows in proportion to x^(1/n), within
        bounds. That value is half of `allowed`, the error of a squared frequency, divided equally among the cables of a
        row that make an error. Cables that keep modes, or have one `near` those asked for, have limits of at least
        `_margin` times `highest`.
        """
        cables_with_error = np.maximum(np.count_nonzero(error, axis=1), 1)[:, None]
        excess = np.maximum(2 * error * cables_with_error / allowed, 1.0)
        growth = SYSTEM.growth_safety * excess ** (1 / SYSTEM.left_out_power)
        growth = np.clip(growth, SYSTEM.least_growth, SYSTEM.most_growth)
        wider = np.where(excess > 1, growth * limits, limits)
        has_modes = (excess > 1) | near | (wider > 0)
        return np.where(has_modes, np.maximum(wider, self._margin * highest[:, None]), wider)

    def _accuracy_error(self, why):
        """`ConvergenceError` of an accuracy that cannot be reached, with the reason."""
        return ConvergenceError(f"accuracy {self.accuracy:g} of the coupled modes cannot be reached: {why}")

    def _trial(self, models, limits, rows, count=None):
        """`Trial` of some rows, with the modes of their cables up to limits."""
        return Trial(self._layout_of(rows), models.coordinates(limits), count or self.count)


def shaping_modes(accuracy):
    """Number of modes in each plane that gives the shape of a cable under any load to an accuracy. [-]

    A force at mid-span moves a string in the form of a triangle: its k-th sine, k odd, is 1/k^2 of the first. Under
    forces that are not coherent the k-th sine therefore adds 1/k^4 of the first to the variance at mid-span. All sines
    above K add 1/(6 K^3), and change the RMS by half of that.
    """
    return (12 * accuracy) ** (-1 / 3)
