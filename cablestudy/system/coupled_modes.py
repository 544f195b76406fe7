"""Search for the coupled modes of a suspension to an accuracy.

The errors come from one model: the energy of each mode in the highest polynomials of the elements tells what the mesh
of each cable leaves out (`cables.Models.unresolved`), and what the coordinates of the cables leave out adds a known
mass (`cables.Models.omitted`). Cables whose mesh is too coarse are refined.
"""

from dataclasses import replace
from functools import cached_property, partial
from math import ceil

import numpy as np

from cablestudy.cable.element import PER_WAVE
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.system.cables import HIGHEST_ORDER, MAX_MODES, UNDAMPED, Cables, Models, fixed_meshes
from cablestudy.system.coupled import Layout
from cablestudy.system.coupled_solution import NOISE, CoupledModes, Solution
from cablestudy.system.superelement import grows_with_modes

PER_DIGIT = 0.9  # orders of a cable's mesh for each digit of the accuracy
STEPS = np.array([6, 8, 10, 12, 14, 16, 20, 24, 32, 40])  # sums of orders to begin with: cables then share a mesh
STEP, DIGITS = 2, 2.0  # orders that are added where a mesh is too coarse, and digits that they gain at least
ALLOWED = 0.5  # share of the accuracy that what is left out of the coordinates may take
POWER = 6  # of the highest frequency over the limit of the modes kept, to which the error by those left out grows
MARGIN, SHARPER = 1.5, 0.2  # least such limit over the highest frequency; factor of accuracy^(-1/POWER)
NEAR = 1.5  # multiple of the highest frequency up to which the first mode of a cable may be among those asked for
WIDER = 1.5  # growth of that multiple, and of limits, where it does not suffice
LEAST_GROWTH, MOST_GROWTH, SAFETY = 1.15, 3.0, 1.1  # of a limit in one trial; factor on what its error calls for
DAMPED = 3.0  # least multiple of the highest frequency up to which the finer model for damping keeps modes
FAR = 0.5  # estimated error by cables without modes over the error allowed, up to which they are tried
LEVELS, TRIALS = 8, 12
EXACT = 1e-10  # error of a frequency that modes of cables may leave where the choice of elements is exact
MOST_DAMPED = 1800  # modes of a cable of such elements whose modal damping counts: an eigenvalue problem of a second


class Search:
    """The lowest modes of a suspension to an accuracy.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of one case.
    count : int
    accuracy : float
        Relative, of the frequencies. [-]
    damping : Damping or sequence of Damping
        Of all cables, or of each.
    model : FixedModel, optional
        An exact choice of elements, in place of an accuracy; all their modes are kept.
    cables : Cables, optional
        Where they were computed with those of other cases.

    Raises
    ------
    ConvergenceError, NoSolutionError
        There is no equilibrium, or a cable with mass hangs folded, or slack without weight.
    """

    def __init__(self, equilibrium, count, accuracy=1e-4, damping=UNDAMPED, model=None, cables=None):
        self.equilibrium, self.count, self.accuracy, self._model = equilibrium, count, accuracy, model
        self.layout, self.cables = (
            Layout(equilibrium),
            cables or Cables(equilibrium.catenary, damping, equilibrium.end_stiffness, model and model.drag),
        )
        if not equilibrium.record.converged:
            raise ConvergenceError("modes need an equilibrium, and the search for the pose found none")
        if self.cables.folded.any():
            name = equilibrium.suspension.cable_names[int(np.argmax(self.cables.folded))]
            raise NoSolutionError(f"{name} hangs folded: somewhere it has no tension, and no definite motion")
        if self.cables.shapeless.any():
            names = ", ".join(np.array(equilibrium.suspension.cable_names)[self.cables.shapeless])
            raise NoSolutionError(f"{names}: slack and without weight, so that nothing determines where its mass is")

    def solve(self, models=None):
        """`CoupledModes`.

        Parameters
        ----------
        models : Models, optional
            On the meshes `first_meshes`, where they were computed with those of other cases.

        Raises
        ------
        NoSolutionError
            The equilibrium is not stable, or a cable has no motion.
        ConvergenceError
            The accuracy cannot be had.
        """
        cables = self.cables
        if self._model is not None:
            return self._of_elements()
        if not cables.heavy.any():
            solution = self._modes(Models(cables, [None] * cables.count), np.zeros(cables.count))
            return self._finished(solution, np.full(len(solution.omega), NOISE))
        highest, limits = self._first_guess, None
        orders = self._orders(highest)
        for _ in range(LEVELS):
            models = models or Models(cables, cables.meshes(orders))
            solution = self._resolved(models, highest, limits)
            limits, highest, error = solution.coordinates.limits, solution.omega[-1], solution.error
            if error.max() <= self.accuracy:
                return self._finished(solution, error, partial(self._finer, orders, limits, highest, error))
            coarse = np.maximum(solution.unresolved.max(axis=1) * cables.count / self.accuracy, 1.0)
            more = STEP * np.ceil(np.log10(coarse) / DIGITS) * np.ceil(orders / HIGHEST_ORDER)
            finer = np.maximum(orders + more, self._orders(highest))
            orders, models = np.where(coarse > 1, finer, orders), None
        raise ConvergenceError(
            f"accuracy {self.accuracy:g} of the coupled modes cannot be had: finer meshes of the cables do not help"
        )

    def with_chosen(self, models, limits, chosen):
        """`CoupledModes` of all coordinates of the cables: modes up to a limit, and chosen ones far above.

        Parameters
        ----------
        models : Models
        limits, chosen
            As for `Models.coordinates`.

        Returns
        -------
        CoupledModes
            Their errors are those by the meshes.

        Raises
        ------
        NoSolutionError
            The equilibrium is not stable.
        """
        solution = self._modes(models, limits, chosen)
        found = self._finished(solution, np.full(len(solution.omega), NOISE))
        return replace(found, error=np.maximum(solution.unresolved.sum(axis=0) / 2, NOISE))

    def _of_elements(self):
        """`CoupledModes` of an exact choice of elements, with some modes of each cable."""
        cables = self.cables
        models = Models(cables, fixed_meshes(cables, self._model), fixed=True, most=min(self._most, MAX_MODES))
        solution = self._modes(models, np.where(cables.heavy, np.inf, 0.0))
        modal = any(grows_with_modes(one) for one in cables.damping)
        finer = partial(self._damped_by_all, models.meshes) if modal and not models.complete else None
        return self._finished(solution, np.full(len(solution.omega), np.nan), finer)

    def _damped_by_all(self, meshes):
        """`CoupledModes` of elements with MAX_MODES of each cable, and the modal damping of all.

        That of the others is what it does to slow movements of the ends: see `Superelement.combine`.
        """
        models, limits = Models(self.cables, meshes, fixed=True, most=MOST_DAMPED), np.zeros(self.cables.count)
        for group in models.groups:
            omega = np.sort(group.ends.omega, axis=-1)
            limits[group.places] = omega[:, MAX_MODES] if omega.shape[-1] > MAX_MODES else np.inf
        solution = self._modes(models, limits)
        return self._finished(solution, np.full(len(solution.omega), np.nan))

    def _finer(self, orders, limits, highest, error):
        """`CoupledModes` of a finer model with more modes of cables."""
        models = Models(self.cables, self.cables.meshes(orders + STEP))
        limits = np.where(limits > 0, np.maximum(WIDER * limits, DAMPED * highest), 0.0)
        return self._finished(self._modes(models, limits), error)

    @property
    def _margin(self):
        """Multiple of the highest frequency up to which the modes of cables are kept at first. [-]"""
        return max(MARGIN, SHARPER * self.accuracy ** (-1 / POWER))

    @property
    def _most(self):
        """How many modes of each cable an exact choice of elements needs: the others change no digit."""
        highest = SHARPER * EXACT ** (-1 / POWER) * self._first_guess
        return 8 + ceil(2 * highest * self.cables.travel_time.max(initial=0.0) / np.pi)

    @property
    def first_meshes(self):
        """With which the search begins: list of (Mesh or None), one for each cable."""
        cables = self.cables
        return cables.meshes(self._orders(self._first_guess)) if cables.heavy.any() else [None] * cables.count

    @cached_property
    def _first_guess(self):
        """Estimate of the highest angular frequency asked for: cables as strings, bodies on their static stiffness."""
        cables, many = self.cables, np.arange(1, self.count + 1)
        time = cables.travel_time[cables.heavy]
        time = np.sort(time)[::-1][: self.count]  # no more cables have one of the lowest modes
        strings = np.repeat(np.pi * many / time[:, None], cables.across)
        bodies = self.layout.without_modes(cables.end_stiffness, cables.straight).frequencies(self.count)
        both = np.sort(np.concatenate([strings, bodies]))[: self.count]
        return both[-1] if len(both) else 0.0

    def _orders(self, highest):
        """Sum of orders along each cable from which waves up to a frequency are resolved to the accuracy."""
        return self.orders_of(highest * self.cables.travel_time / np.pi)

    def orders_of(self, waves):
        """Sum of orders along each cable from which some half-waves are resolved to the accuracy, shape (c,)."""
        orders = PER_WAVE * waves - PER_DIGIT * np.log10(self.accuracy)
        steps = STEPS[np.minimum(np.searchsorted(STEPS, orders), len(STEPS) - 1)]
        return np.where(orders <= STEPS[-1], steps, 8 * np.ceil(orders / 8))

    def _limits(self, highest):
        """Angular frequency up to which each cable keeps its modes: zero where all lie far above."""
        # Dunkerley: masses on a string lower its first mode at most by this
        slower = np.sqrt(1 + (np.pi / 2) ** 2 * self.cables.carried)
        first = np.pi / np.maximum(self.cables.travel_time, 1e-300) / slower
        share = self.cables.mass.sum() / (self.cables.mass.sum() + np.sum(self.equilibrium.suspension.mass))
        far = (share * (highest / first) ** 2 <= FAR * ALLOWED * self.accuracy) & (NEAR * highest < first)
        return np.where(far | ~self.cables.heavy, 0.0, self._margin * highest)

    def _resolved(self, models, highest, limits):
        """The modes with so many coordinates that what these leave out is within the accuracy."""
        limits = self._limits(highest) if limits is None else limits
        allowed = 2 * ALLOWED * self.accuracy  # of squared frequencies
        for _ in range(TRIALS):
            solution = self._modes(models, limits)
            few = len(solution.omega) < self.count
            highest = WIDER * highest if few else solution.omega[-1]
            near = models.first < NEAR * highest
            omitted = np.abs(solution.omitted)
            if not few and omitted.sum(axis=0).max() <= allowed and (limits[near] >= highest).all():
                return solution
            largest = omitted.max(axis=1, initial=0.0)
            much = np.maximum(2 * largest * max(1, np.count_nonzero(largest)) / allowed, 1.0)
            growth = np.clip(SAFETY * much ** (1 / POWER), LEAST_GROWTH, MOST_GROWTH)
            limits = np.where(much > 1, growth * limits, limits)
            limits = np.where((much > 1) | near | (limits > 0), np.maximum(limits, self._margin * highest), limits)
        raise ConvergenceError(
            f"accuracy {self.accuracy:g} of the coupled modes cannot be had: too many modes of cables"
        )

    def _modes(self, models, limits, chosen=None):
        coordinates = models.coordinates(limits, chosen)
        reduced = self.layout.reduced(coordinates)
        try:
            omega, shapes = reduced.lowest(self.count)
        except NoSolutionError:
            reason = self.equilibrium.stability.reason() or "its stiffness is next to nothing"
            raise NoSolutionError(f"no modes about this equilibrium: {reason}") from None
        omitted = models.omitted(coordinates, omega**2, self.layout.ends(self.layout.bodies(shapes)))
        return Solution(self.layout, coordinates, reduced, omega, shapes, omitted)

    def _finished(self, solution, error, finer=None):
        alike = np.where(np.isnan(error), NOISE, error)
        coincident = tuple(runs(solution.omega, alike))
        shapes, error = solution.shapes.copy(), error.copy()
        weighed = (np.arange(len(shapes)) + 1.0)[:, None] * solution.reduced.weighed(shapes)
        for first, last in coincident:
            some = shapes[:, first - 1 : last]
            error[first - 1 : last] = error[first - 1 : last].max()  # their order is not certain
            # modes that coincide: separated by which coordinates move
            mixed = some.T @ weighed[:, first - 1 : last]
            shapes[:, first - 1 : last] = some @ np.linalg.eigh(mixed + mixed.T)[1]
        frequency = solution.omega / (2 * np.pi)
        return CoupledModes(frequency, error, coincident, self.layout, solution, shapes, finer)


def coupled_modes(equilibrium, count, accuracy=1e-4, damping=UNDAMPED, model=None, cables=None):
    """The lowest coupled modes of a suspension: see `Search`."""
    return Search(equilibrium, count, accuracy, damping, model, cables).solve()


def coupled_modes_of_cases(equilibria, catenary, count, accuracy, damping):
    """The lowest coupled modes of many cases with the same cables, whose first models are computed together.

    Parameters
    ----------
    equilibria : sequence of Equilibrium
        n of them.
    catenary : Catenary
        Of shape (n c,): the cables of one case after the other.
    count, accuracy
        See `Search`.
    damping : sequence of Damping
        Of n c cables.

    Returns
    -------
    list of (CoupledModes or Exception)
        The NoSolutionError or ConvergenceError of a case that has none.
    """
    static = np.concatenate([equilibrium.end_stiffness for equilibrium in equilibria])
    whole, found, searches = Cables(catenary, damping, static), [], []
    each = len(damping) // max(1, len(equilibria))
    meshes = [None] * len(damping)
    for first, equilibrium in zip(range(0, len(damping), each), equilibria, strict=True):
        try:
            search = Search(equilibrium, count, accuracy, cables=whole.take(first, equilibrium.catenary))
            meshes[first : first + each] = search.first_meshes
        except (NoSolutionError, ConvergenceError) as error:
            search = error
        searches.append(search)
    models = Models(whole, meshes)
    for place, search in enumerate(searches):
        if isinstance(search, Search):
            try:
                search = search.solve(models.take(search.cables, place * each))
            except (NoSolutionError, ConvergenceError) as error:
                search = error
        found.append(search)
    return found


def runs(omega, error):
    """First and last number (from 1) of each run of frequencies that agree within their errors."""
    near = np.diff(omega) <= (error[1:] + error[:-1]) * omega[1:]
    first = 0
    for place in range(len(omega)):
        if place == len(near) or not near[place]:
            if place > first:
                yield first + 1, place + 1
            first = place + 1
