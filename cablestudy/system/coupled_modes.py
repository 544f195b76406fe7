"""Search for the coupled modes of a suspension to an accuracy.

The errors come from one model: the energy of each mode in the highest polynomials of the elements tells what the mesh
of each cable leaves out (`cables.Models.unresolved`), and what the coordinates of the cables leave out adds a known
mass (`cables.Models.omitted`). Cables whose mesh is too coarse are refined.
"""

from functools import partial
from math import ceil

import numpy as np

from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import ConvergenceError, NoSolutionError, outcome_of, result_of
from cablestudy.system.cables import UNDAMPED, Cables, Models, fixed_meshes, has_more_modes
from cablestudy.system.coupled import Layout
from cablestudy.system.coupled_solution import CoupledModes, Trial
from cablestudy.system.superelement import grows_with_modes
from cablestudy.system.tolerances import SYSTEM

STEPS = np.array([6, 8, 10, 12, 14, 16, 20, 24, 32, 40])  # sums of orders to begin with: cables then share a mesh


class Search:
    """The lowest modes of suspensions with equal names and connections, c cables each, to an accuracy: of n rows.

    Rows are solved together until each has its accuracy. No digit of a row depends on the others.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of these rows, shape (n,); or of one, without an axis of rows.
    count : int
    accuracy : float
        Relative, of the frequencies. [-]
    cables : Cables
        Of one row after the other.
    damped : bool
        Whether the modes serve for damping too: on finer meshes, with more modes of the cables.
    """

    def __init__(self, equilibrium, count, accuracy, cables, damped=False):
        self.layout, self.count, self.accuracy, self.cables = Layout(equilibrium), count, accuracy, cables
        self._rows, self._damped = int(np.prod(self.layout.shape)), damped
        self._heavy, self._travel_time = (part.reshape(self._rows, -1) for part in (cables.heavy, cables.travel_time))

    def solve(self):
        """`CoupledModes` of each row, or why it has none: list of (CoupledModes or Exception).

        NoSolutionError: there is no equilibrium, or it is not stable; a cable with mass hangs folded, or slack without
        weight. ConvergenceError: the accuracy cannot be had.
        """
        found = self.refused
        rows = np.array([row for row, refused in enumerate(found) if refused is None], dtype=int)
        if not len(rows):
            return found
        highest = self._first_guess(rows)
        orders, limits = self._orders(rows, highest), self._limits(rows, highest)
        for _ in range(SYSTEM.mesh_trials):
            cables = self._cables_of(rows)
            models = Models(cables, cables.meshes(orders.ravel() + SYSTEM.finer_orders * self._damped))
            trials, highest, limits = self._resolved(rows, models, highest, limits)
            coarse, again = np.ones(orders.shape), np.zeros(len(rows), dtype=bool)
            for place, (row, outcome) in enumerate(zip(rows.tolist(), trials, strict=True)):
                if isinstance(outcome, Exception):
                    found[row] = outcome
                    continue
                trial, number = outcome
                error, unresolved = trial.error[number], trial.unresolved[number].max(axis=-1, initial=0.0)
                coarse[place] = np.maximum(unresolved * len(unresolved) / self.accuracy, 1.0)
                again[place] = error.max(initial=0.0) > self.accuracy
                if not again[place]:
                    serves = self._damped or not self._heavy[row].any()
                    finer = partial(self._finer, row, orders[place], limits[place], highest[place])
                    found[row] = outcome_of(partial(finished, trial, number, error, None if serves else finer))
            more = (
                SYSTEM.finer_orders
                * np.ceil(np.log10(coarse) / SYSTEM.finer_digits)
                * np.ceil(orders / SYSTEM.highest_order)
            )
            finer = np.maximum(orders + more, self._orders(rows, highest))
            orders = np.where(coarse > 1, finer, orders)
            rows, highest, limits, orders = (part[again] for part in (rows, highest, limits, orders))
            if not len(rows):
                return found
        words = "finer meshes of the cables do not help"
        return [self._too_accurate(words) if one is None else one for one in found]

    def with_chosen(self, models, limits, chosen, lowest, highest):
        """`CoupledModes` of one row: the lowest, and those far above of which chosen modes of cables are a part.

        Parameters
        ----------
        models : Models
        limits, chosen
            As for `Models.coordinates`.
        lowest, highest : float
            Frequencies between which they lie. [rad/s]

        Returns
        -------
        CoupledModes
            Their errors are those by the meshes.

        Raises
        ------
        NoSolutionError
            The equilibrium is not stable.
        """
        coordinates = models.coordinates(limits, chosen)
        trial = Trial(self.layout, coordinates, len(coordinates.omega) + len(self.layout.free))
        omega = trial.omega[0]
        trial = trial.take_modes((np.arange(len(omega)) < self.count) | ((omega > lowest) & (omega < highest)))
        return finished(trial, 0, np.maximum(trial.unresolved[0].sum(axis=0) / 2, SYSTEM.frequency_rounding))

    def of_elements(self, model):
        """`CoupledModes` of each row with an exact choice of elements, with some modes of each cable.

        Parameters
        ----------
        model : FixedModel

        Returns
        -------
        list of (CoupledModes or Exception)
            Why a row has none: as `solve` gives it; or these elements have no equilibrium.
        """
        found, alike, meshes = self.refused, {}, fixed_meshes(self.cables, model)
        for row, refused in enumerate(found):
            if refused is None:
                alike.setdefault(self._kind_of_elements(row, meshes), []).append(row)
        for kind, rows in alike.items():
            for row, outcome in zip(rows, self._elements_of(np.array(rows), kind >= 0, meshes), strict=True):
                found[row] = outcome
        return found

    def _kind_of_elements(self, row, meshes):
        """A number that rows share whose elements are solved together; one of its own, from 0, of a row alone."""
        places, loads = self._places([row]), self.cables.catenary.span.load_forces
        large = any(meshes[place] and has_more_modes(meshes[place]) for place in places)
        alone = large or self.cables.blown[places].any()
        return row if alone else -1 - bool(np.any(loads[places, :, 2]))

    def _elements_of(self, rows, alone, meshes):
        """`of_elements` of some rows: list; where those of one have no equilibrium, of one after the other."""
        cables, own = self._cables_of(rows), [meshes[place] for place in self._places(rows)]
        most = min(self._most(rows), SYSTEM.modes_of_cable) if alone else SYSTEM.modes_of_cable
        models = Models(cables, own, fixed=True, most=most)
        try:
            trial = self._tried(models, np.where(cables.heavy, np.inf, 0.0), rows)
        except (NoSolutionError, ConvergenceError) as error:
            if len(rows) == 1:
                return [error]
            return [outcome for row in rows for outcome in self._elements_of(np.array([row]), alone, meshes)]
        modal = any(grows_with_modes(one) for one in cables.damping)
        finer = partial(self._damped_by_all, rows, own) if modal and not models.complete else None
        unknown = np.full(self.count, np.nan)
        return [outcome_of(partial(finished, trial, number, unknown, finer)) for number in range(len(rows))]

    def _damped_by_all(self, rows, meshes):
        """`CoupledModes` of elements of one row with `modes_of_cable` of each cable, and the modal damping of all.

        That of the others is what it does to slow movements of the ends: see `Superelement.combine`.
        """
        cables = self._cables_of(rows)
        models, limits = Models(cables, meshes, fixed=True, most=SYSTEM.modally_damped_modes), np.zeros(cables.count)
        for group in models.groups:
            omega = np.sort(group.ends.omega, axis=-1)
            limits[group.places] = (
                omega[:, SYSTEM.modes_of_cable] if omega.shape[-1] > SYSTEM.modes_of_cable else np.inf
            )
        count = self.count + SYSTEM.modes_beyond
        return finished(self._tried(models, limits, rows, count), 0, np.full(count, np.nan))

    def _finer(self, row, orders, limits, highest):
        """`CoupledModes` of one row, of a finer model with more modes of cables, some beyond those asked for."""
        one, count = np.array([row]), self.count + SYSTEM.modes_beyond
        cables = self._cables_of(one)
        limits = np.where(limits > 0, np.maximum(SYSTEM.wider * limits, SYSTEM.damping_limit * highest), 0.0)
        trial = self._tried(Models(cables, cables.meshes(orders + SYSTEM.finer_orders)), limits, one, count)
        return finished(trial, 0, trial.error[0])

    @property
    def refused(self):
        """Why rows have no modes, whatever the accuracy: list of (Exception or None)."""
        equilibrium, names = self.layout.equilibrium, self.layout.equilibrium.suspension.cable_names
        lost = ~np.broadcast_to(equilibrium.record.converged, self.layout.shape).ravel()
        folded, shapeless = (part.reshape(self._rows, -1) for part in (self.cables.folded, self.cables.shapeless))
        found = [None] * self._rows
        for row in np.flatnonzero(lost | folded.any(axis=1) | shapeless.any(axis=1)).tolist():
            if lost[row]:
                found[row] = ConvergenceError("modes need an equilibrium, and the search for the pose found none")
            elif folded[row].any():
                name = names[int(np.argmax(folded[row]))]
                text = f"{name} hangs folded: somewhere it has no tension, and no definite motion"
                found[row] = NoSolutionError(text)
            else:
                every = ", ".join(np.array(names)[shapeless[row]])
                found[row] = NoSolutionError(
                    f"{every}: slack and without weight, so that nothing determines where its mass is"
                )
        return found

    def _layout_of(self, rows):
        """`Layout` of some rows."""
        return self.layout if len(rows) == self._rows else self.layout.take(rows)

    def _places(self, rows):
        """Numbers of the cables of some rows among all."""
        each = self.cables.count // self._rows
        return (each * np.asarray(rows)[:, None] + np.arange(each)).ravel()

    def _cables_of(self, rows):
        """`Cables` of some rows."""
        return self.cables if len(rows) == self._rows else self.cables.take(self._places(rows))

    @property
    def _margin(self):
        """Multiple of the highest frequency up to which the modes of cables are kept at first. [-]"""
        margin = max(SYSTEM.least_mode_limit, SYSTEM.mode_limit * self.accuracy ** (-1 / SYSTEM.left_out_power))
        return max(SYSTEM.damping_limit, SYSTEM.wider * margin) if self._damped else margin

    @property
    def _least(self):
        """Least such multiple for cables whose first mode is among those asked for, or near. [-]"""
        return SYSTEM.damping_limit / SYSTEM.wider if self._damped else 1.0

    def _most(self, row):
        """How many modes of each cable of one row an exact choice of elements needs: the others change no digit."""
        highest = SYSTEM.mode_limit * SYSTEM.exact_elements ** (-1 / SYSTEM.left_out_power) * self._first_guess(row)[0]
        return 8 + ceil(2 * highest * self._travel_time[row].max(initial=0.0) / np.pi)

    def _first_guess(self, rows):
        """Estimate of the highest angular frequency asked for: cables as strings, bodies on their static stiffness.

        Returns
        -------
        ndarray, shape (len(rows),)
        """
        layout, cables, many = self._layout_of(rows), self.cables, np.arange(1, self.count + 1)
        time = -np.sort(-np.where(self._heavy, self._travel_time, 0.0)[rows], axis=1)
        time = time[:, : self.count]  # no more cables have one of the lowest modes
        first = np.divide(np.pi, time, out=np.full(time.shape, np.inf), where=time > 0)
        strings = np.repeat((first[..., None] * many).reshape(len(rows), -1), cables.across, axis=1)
        places = self._places(rows)
        ends = (part[places].reshape(*layout.shape, -1, 6, 6) for part in (cables.end_stiffness, cables.straight))
        bodies = layout.without_modes(*ends).lowest(self.count)[0].reshape(len(rows), -1)
        both = np.sort(np.concatenate([strings, bodies], axis=1), axis=1)[:, : self.count]
        return np.where(np.isfinite(both), both, 0.0).max(axis=1, initial=0.0)

    def _orders(self, rows, highest):
        """Sum of orders along each cable of some rows from which waves up to a frequency are resolved, as `orders_of`.

        Parameters
        ----------
        rows : ndarray of int, shape (m,)
        highest : ndarray, shape (m,)
            [rad/s]
        """
        return self.orders_of(highest[:, None] * self._travel_time[rows] / np.pi)

    def orders_of(self, waves):
        """Sum of orders along each cable from which some half-waves are resolved to the accuracy, shape (..., c)."""
        orders = CABLE.orders_per_half_wave * waves - SYSTEM.orders_per_digit * np.log10(self.accuracy)
        steps = STEPS[np.minimum(np.searchsorted(STEPS, orders), len(STEPS) - 1)]
        return np.where(orders <= STEPS[-1], steps, 8 * np.ceil(orders / 8))

    def _limits(self, rows, highest):
        """Angular frequency up to which each cable of some rows keeps its modes: zero where all lie far above."""
        # Dunkerley: masses on a string lower its first mode at most by this
        slower = np.sqrt(1 + (np.pi / 2) ** 2 * self.cables.carried).reshape(self._rows, -1)[rows]
        first, highest = np.pi / np.maximum(self._travel_time[rows], 1e-300) / slower, highest[:, None]
        bodies = np.asarray(self.layout.equilibrium.suspension.mass)
        bodies = np.broadcast_to(bodies, (*self.layout.shape, bodies.shape[-1])).reshape(self._rows, -1)[rows]
        cables = self.cables.mass.reshape(self._rows, -1)[rows].sum(axis=1, keepdims=True)
        share = cables / (cables + bodies.sum(axis=1, keepdims=True))
        far = (share * (highest / first) ** 2 <= SYSTEM.no_modes_error * SYSTEM.coordinates_share * self.accuracy) & (
            SYSTEM.near_highest * highest < first
        )
        return np.where(far | ~self._heavy[rows], 0.0, self._margin * highest)

    def _resolved(self, rows, models, highest, limits):
        """The modes of rows with so many coordinates that what these leave out is within the accuracy.

        Parameters
        ----------
        rows : ndarray of int, shape (m,)
        models : Models
            Of their cables.
        highest : ndarray, shape (m,)
            Estimate of the highest frequency. [rad/s]
        limits : ndarray, shape (m, c)
            To begin with.

        Returns
        -------
        outcomes : list of ((Trial, int) or Exception)
            Modes of each row, or of one that is not stable, and its number among those of the trial.
        highest, limits : ndarray
            Of these modes.
        """
        allowed = 2 * SYSTEM.coordinates_share * self.accuracy  # of squared frequencies
        found, waiting = [self._too_accurate("too many modes of cables")] * len(rows), np.arange(len(rows))
        highest, limits = highest.copy(), limits.copy()
        for _ in range(SYSTEM.limit_trials):
            some = models if len(waiting) == len(rows) else models.take(self._places(waiting))
            trial, kept = self._tried(some, limits[waiting].ravel(), rows[waiting]), limits[waiting]
            few = np.isinf(trial.omega).any(axis=1) & self._heavy[rows[waiting]].any(axis=1)
            top = np.where(np.isfinite(trial.omega), trial.omega, 0.0).max(axis=1, initial=0.0)
            top = np.where(few, SYSTEM.wider * highest[waiting], top)
            near = some.first.reshape(kept.shape) < SYSTEM.near_highest * top[:, None]
            omitted = np.abs(trial.omitted)
            good = ~few & (omitted.sum(axis=1).max(axis=-1, initial=0.0) <= allowed)
            good &= (~near | (kept >= self._least * top[:, None])).all(axis=1)
            stable = ~np.isnan(trial.omega).any(axis=1)
            for number in np.flatnonzero(good | ~stable).tolist():
                found[waiting[number]] = trial, number
            largest = omitted.max(axis=-1, initial=0.0)
            many = np.maximum(np.count_nonzero(largest, axis=1), 1)[:, None]
            much = np.maximum(2 * largest * many / allowed, 1.0)
            wider = np.where(
                much > 1,
                np.clip(
                    SYSTEM.growth_safety * much ** (1 / SYSTEM.left_out_power), SYSTEM.least_growth, SYSTEM.most_growth
                )
                * kept,
                kept,
            )
            enough = np.maximum(wider, self._margin * top[:, None])
            wider = np.where((much > 1) | near | (wider > 0), enough, wider)
            highest[waiting], limits[waiting] = top, np.where(good[:, None], kept, wider)
            waiting = waiting[~good & stable]
            if not len(waiting):
                break
        return found, highest, limits

    def _too_accurate(self, why):
        return ConvergenceError(f"accuracy {self.accuracy:g} of the coupled modes cannot be had: {why}")

    def _tried(self, models, limits, rows, count=None):
        """`Trial` of some rows."""
        return Trial(self._layout_of(rows), models.coordinates(limits), count or self.count)


def finished(trial, row, error, finer=None):
    """`CoupledModes` of one row of a `Trial`.

    Parameters
    ----------
    trial : Trial
    row : int
    error : ndarray, shape (k,)
        Estimated relative error of each frequency. [-]
    finer : callable, optional
        See `CoupledModes`.

    Raises
    ------
    NoSolutionError
        The equilibrium is not stable.
    """
    solution = trial.solution(row)
    error, shapes = error[: len(solution.omega)].copy(), solution.shapes.copy()
    coincident = tuple(runs(solution.omega, np.where(np.isnan(error), SYSTEM.frequency_rounding, error)))
    number = np.arange(len(shapes))[:, None] + 1.0
    for first, last in coincident:
        alike = slice(first - 1, last)
        error[alike] = error[alike].max()  # their order is not certain
        # modes that coincide: separated by which coordinates move
        mixed = shapes[:, alike].T @ (number * solution.reduced.weighed(shapes[:, alike]))
        shapes[:, alike] = shapes[:, alike] @ np.linalg.eigh(mixed + mixed.T)[1]
    return CoupledModes(solution.omega / (2 * np.pi), error, coincident, solution, shapes, finer)


def coupled_modes(equilibrium, count, accuracy=1e-4, damping=UNDAMPED, model=None, cables=None, damped=False):
    """The lowest `CoupledModes` of one suspension.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of one case.
    count, accuracy, damped
        See `Search`.
    damping : Damping or sequence of Damping
        Of all cables, or of each.
    model : FixedModel, optional
        An exact choice of elements, in place of an accuracy; all their modes are kept.
    cables : Cables, optional
        With their damping, where they are known.

    Raises
    ------
    NoSolutionError, ConvergenceError
        As `Search.solve` gives them.
    """
    drag = model and model.drag
    static = equilibrium.end_stiffness[equilibrium.suspension.of_cables]
    cables = cables or Cables(equilibrium.catenary, damping, static, drag)
    search = Search(equilibrium, count, accuracy, cables, damped)
    return result_of((search.of_elements(model) if model else search.solve())[0])


def coupled_modes_of_cases(equilibrium, count, accuracy, damping, planes=None, damped=False, model=None):
    """The lowest coupled modes of many cases with equal names and connections.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of shape (n,).
    count, accuracy, damped
        See `Search`.
    damping : sequence of Damping
        Of the n c cables, those of one case after the other.
    planes : tuple, optional
        As for `Cables`.
    model : FixedModel, optional
        As for `coupled_modes`, its drag that on all of these cables.

    Returns
    -------
    list of (CoupledModes or Exception)
        See `Search.solve`.
    """
    count_of_cases, each = equilibrium.lengths.shape
    if Layout(equilibrium).large:  # sparse matrices: one after the other
        found = []
        for case in range(count_of_cases):
            own = slice(each * case, each * (case + 1))
            about = equilibrium.take(case), count, accuracy, damping[own], model and model.take(own)
            found.append(outcome_of(partial(coupled_modes, *about, damped=damped)))
        return found
    catenary = equilibrium.catenary.take(tuple(np.indices((count_of_cases, each)).reshape(2, -1)))
    static = equilibrium.end_stiffness[:, equilibrium.suspension.of_cables].reshape(-1, 3, 3)
    cables = Cables(catenary, damping, static, model and model.drag, planes)
    search = Search(equilibrium, count, accuracy, cables, damped)
    return search.of_elements(model) if model else search.solve()


def runs(omega, error):
    """First and last number (from 1) of each run of frequencies that agree within their errors."""
    near = np.diff(omega) <= (error[1:] + error[:-1]) * omega[1:]
    first = 0
    for place in range(len(omega)):
        if place == len(near) or not near[place]:
            if place > first:
                yield first + 1, place + 1
            first = place + 1
