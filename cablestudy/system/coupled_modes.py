"""Coupled modes of a suspension with their errors, their damping, and what moves in each.

The errors come from two models: the meshes of all cables are refined until the frequencies of two levels agree; what
the coordinates of the cables leave out adds a known mass (`cables.Models.omitted`).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.element import PER_WAVE
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.system.cables import UNDAMPED, Cables, Models, fixed_meshes
from cablestudy.system.coupled import Layout
from cablestudy.system.damping import COUPLED, damping_ratios
from cablestudy.system.linear import LinearSystem

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
KINDS = ("in-plane", "out-of-plane", "axial")
PER_DIGIT, MORE_ORDERS = 0.9, 1.0  # orders of a cable's mesh, as in the refinement of one cable
STEPS = np.array([8, 12, 16, 24, 32, 40])  # sums of orders to begin with: few, so that many cables share a mesh
STEP, GROWTH = 2, 1.3  # orders from one level to the next; growth where two levels do not agree
ALLOWED = 0.25  # share of the accuracy that what is left out of the coordinates may take
MARGIN = 2.0  # modes are kept up to this multiple of the highest frequency
NEAR = 1.5  # multiple of the highest frequency up to which the first mode of a cable may be among those asked for
WIDER = 1.5  # growth of that multiple where it does not suffice
FAR = 0.5  # estimated error by cables without modes over the error allowed, up to which they are tried
LEVELS, TRIALS = 8, 12
NOISE = 1e-12  # error of a frequency by rounding


@dataclass(frozen=True)
class CableRecord:
    """What one cable was given, and why.

    Attributes
    ----------
    name : str
    elements, order : int
        Of its mesh; zero for a cable without mass.
    modes, residuals : int
        Coordinates: modes with fixed ends, and vectors that stand for the others.
    first_mode : float
        Its lowest mode with fixed ends; infinite without mass. [Hz]
    limit : float
        Up to which modes are kept. [Hz]
    error : float
        Largest relative error of the frequencies by the modes left out. [-]
    """

    name: str
    elements: int
    order: int
    modes: int
    residuals: int
    first_mode: float
    limit: float
    error: float

    @property
    def reason(self):
        """Why it keeps these modes: one sentence."""
        if not self.elements:
            return "without mass: stiffness only"
        if not self.modes + self.residuals:
            first = f"its first one, at {self.first_mode:.4g} Hz,"
            return f"no modes: {first} changes no frequency by more than {self.error:.1e}"
        if not np.isfinite(self.limit):
            return f"all {self.modes} modes of {self.elements} elements of order {self.order}"
        return (
            f"{self.modes} modes below {self.limit:.4g} Hz and {self.residuals} vectors for those above: "
            f"what is left out changes no frequency by more than {self.error:.1e}"
        )


@dataclass(frozen=True)
class Solution:
    """Modes of one choice of models and coordinates.

    Attributes
    ----------
    models : Models
    kept : list of Kept
    limits : ndarray, shape (c,)
        Up to which modes are kept; see `Models.keep`. [rad/s]
    system : LinearSystem
    omega : ndarray, shape (k,)
        [rad/s]
    shapes : ndarray, shape (n, k)
    omitted : ndarray, shape (c, k)
        Relative error of the squared frequencies by what the coordinates leave out. [-]
    """

    models: Models
    kept: list
    limits: np.ndarray
    system: LinearSystem
    omega: np.ndarray
    shapes: np.ndarray
    omitted: np.ndarray

    def amplitudes(self, shapes):
        """Of all modes of each cable, about its static shapes: list of ndarray, shape (n, r)."""
        begin, found = 0, []
        for one in self.kept:
            n = len(one.element.omega)
            found.append(one.shapes @ shapes[begin : begin + n])
            begin += n
        return found


@dataclass(frozen=True)
class CoupledModes:
    """The lowest modes of a suspension.

    Attributes
    ----------
    frequency : ndarray, shape (k,)
        Undamped. [Hz]
    error : ndarray, shape (k,)
        Estimated relative error of each; not a number for an exact choice of elements. [-]
    body_energy : ndarray, shape (b, 6, k)
        Shares of the kinetic energy: x y z of the center of mass, rotation about the body's own axes. [-]
    cable_energy : ndarray, shape (c, 3, k)
        In the plane of the cable, out of it, along the cable. [-]
    coincident : tuple of (int, int)
        First and last number (from 1) of each run of modes whose frequencies agree within their errors: their motions
        may be combined at will.
    cables : tuple of CableRecord
    layout : Layout
    solution : Solution
        Models and coordinates of the cables, and the system: what a state space is made of.
    shapes : ndarray, shape (n, k)
        In the coordinates of the system, mass-normalised.
    before : Solution or None
        Of the level before, where the models were refined.
    """

    frequency: np.ndarray
    error: np.ndarray
    body_energy: np.ndarray
    cable_energy: np.ndarray
    coincident: tuple
    cables: tuple
    layout: Layout
    solution: Solution
    shapes: np.ndarray
    before: Solution | None = None

    def __len__(self):
        return len(self.frequency)

    @property
    def system(self):
        """The `LinearSystem`."""
        return self.solution.system

    @cached_property
    def damping_ratio(self):
        """Of the pole of each mode, see `damping.damping_ratios`, shape (k,). [-]"""
        return damping_ratios(self.system, self.solution.omega, self.shapes)

    @cached_property
    def damping_error(self):
        """Estimated relative error of each damping ratio, shape (k,). [-]

        The difference of two levels, the coarser one with fewer modes that damping may couple. Not a number without
        two, and for modal damping, whose effect on a mode that moves the ends of cables grows with their modes.
        """
        cables = self.solution.models.cables
        modal = any(one.model == "modal" and one.ratio for one in cables.damping)
        if self.before is None or (modal and cables.heavy.any()):
            return np.full(len(self), np.nan) if cables.heavy.any() else self.error
        ratio, other = (
            self.damping_ratio.copy(),
            damping_ratios(self.before.system, self.before.omega, self.before.shapes, COUPLED // 2),
        )
        for first, last in self.coincident:  # their poles come in any order
            for values in (ratio, other):
                values[first - 1 : last].sort()
        return np.abs(ratio - other) / np.where(ratio > 0, ratio, 1.0)

    def nodes(self, mode):
        """Places of the nodes of each cable from its end 1, and their displacements in one mode (from 0), global axes.

        Returns
        -------
        list of (ndarray, ndarray)
            Both of shape (nodes, 3). [m], [1/sqrt(kg)]
        """
        shape = self.shapes[:, [mode]]
        found = self.solution.models.nodes(self.solution.amplitudes(shape), self.layout.ends(self.layout.bodies(shape)))
        return [(place, moved[..., 0]) for place, moved in found]

    def up_to(self, frequency):
        """The modes up to a frequency [Hz], numbers from 0."""
        return np.flatnonzero(self.frequency <= frequency)

    @property
    def body_share(self):
        """Share of the kinetic energy in bodies and junctions, shape (k,). [-]"""
        return self.body_energy.sum(axis=(0, 1))

    @cached_property
    def moves(self):
        """What has the largest share of the kinetic energy in each mode, such as "gondola x" or "n1 in-plane".

        A body, the junctions together or the cables together; of these one by its name where it has more than half.
        """
        return tuple(self._moving(mode) for mode in range(len(self)))

    def _moving(self, mode):
        suspension, energy = self.layout.equilibrium.suspension, self.body_energy[..., mode]
        body_names, count = suspension.body_names, suspension.bodies
        groups = [*energy[:count].sum(axis=1), energy[count:].sum(), self.cable_energy[..., mode].sum()]
        largest = int(np.argmax(np.round(groups, 9)))
        if largest < count:
            return _largest(body_names[largest : largest + 1], AXES, energy[largest : largest + 1], None)
        if largest == count:
            return _largest(body_names[count:], AXES, energy[count:], "points")
        names = [record.name for record in self.cables]
        return _largest(names, KINDS, self.cable_energy[..., mode], "cables")


def _largest(names, kinds, energy, all_of_them):
    """Name and kind of the largest part, or a word for all where no name has more than half of the energy."""
    each = energy.sum(axis=1)
    place = int(np.argmax(each))
    if each[place] <= 0.5 * each.sum():
        return all_of_them
    return f"{names[place]} {kinds[int(np.argmax(np.round(energy[place], 9)))]}"


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
    """

    def __init__(self, equilibrium, count, accuracy=1e-4, damping=UNDAMPED, model=None):
        self.equilibrium, self.count, self.accuracy, self._model = equilibrium, count, accuracy, model
        names = equilibrium.suspension.cable_names
        self.layout, self.cables = Layout(equilibrium), Cables(equilibrium.catenary, damping, names)

    def solve(self):
        """`CoupledModes`.

        Raises
        ------
        NoSolutionError
            The equilibrium is not stable, or a cable has no motion.
        ConvergenceError
            The accuracy cannot be had.
        """
        if not self.equilibrium.record.converged:
            raise ConvergenceError("modes need an equilibrium, and the search for the pose found none")
        if self._model is not None:
            limits = np.where(self.cables.heavy, np.inf, 0.0)
            models = Models(self.cables, fixed_meshes(self.cables, self._model), fixed=True)
            return self._finished(self._modes(models, limits), None)
        if not self.cables.heavy.any():
            solution = self._modes(Models(self.cables, [None] * self.cables.count), np.zeros(self.cables.count))
            return self._finished(solution, np.full(len(solution.omega), NOISE))
        highest = self._first_guess()
        orders = self._orders(highest)
        before, limits = None, None
        for _ in range(LEVELS):
            models = Models(self.cables, self.cables.meshes(orders))
            solution = self._resolved(models, highest, limits)
            limits = WIDER * solution.limits  # damping shows what fewer coordinates leave out
            least = self._orders(solution.omega.max(initial=0.0))
            if (least > orders).any():  # more waves than the first guess
                orders, before = np.maximum(orders, least), None
                continue
            if before is not None and len(before.omega) == len(solution.omega):
                error = self._error(before, solution)
                if error.max(initial=0.0) <= self.accuracy:
                    return self._finished(solution, error, before)
                orders = GROWTH * orders
            before, orders = solution, orders + STEP
        raise ConvergenceError(
            f"accuracy {self.accuracy:g} of the coupled modes cannot be had: two models do not agree"
        )

    def _first_guess(self):
        """Estimate of the highest angular frequency asked for: cables as strings, bodies on their static stiffness."""
        cables, many = self.cables, np.arange(1, self.count + 1)
        time = cables.travel_time[cables.heavy]
        time = np.sort(time)[::-1][: self.count]  # no more cables have one of the lowest modes
        strings = np.repeat(np.pi * many / time[:, None], 2)
        bodies = self.layout.system(cables.straight).lowest(self.count)[0]
        both = np.sort(np.concatenate([strings, bodies]))[: self.count]
        return both[-1] if len(both) else 0.0

    def _orders(self, highest):
        """Sum of orders along each cable from which waves up to a frequency are resolved to the accuracy."""
        waves = highest * self.cables.travel_time / np.pi
        orders = PER_WAVE * waves - PER_DIGIT * np.log10(self.accuracy) + MORE_ORDERS
        steps = STEPS[np.minimum(np.searchsorted(STEPS, orders), len(STEPS) - 1)]
        return np.where(orders <= STEPS[-1], steps, 8 * np.ceil(orders / 8))

    def _limits(self, highest):
        """Angular frequency up to which each cable keeps its modes: zero where all lie far above."""
        first = np.pi / np.maximum(self.cables.travel_time, 1e-300)
        share = self.cables.mass.sum() / (self.cables.mass.sum() + np.sum(self.equilibrium.suspension.mass))
        far = (share * (highest / first) ** 2 <= FAR * ALLOWED * self.accuracy) & (NEAR * highest < first)
        return np.where(far | ~self.cables.heavy, 0.0, MARGIN * highest)

    def _resolved(self, models, highest, limits):
        """The modes with so many coordinates that what these leave out is within the accuracy."""
        limits = self._limits(highest) if limits is None else limits
        first = np.array([element.omega.min(initial=np.inf) for element in models.elements])
        allowed = 2 * ALLOWED * self.accuracy  # of squared frequencies
        for _ in range(TRIALS):
            solution = self._modes(models, limits)
            few = len(solution.omega) < self.count
            highest = WIDER * highest if few else solution.omega[-1]
            near = first < NEAR * highest
            omitted = np.abs(solution.omitted)
            if not few and omitted.sum(axis=0).max() <= allowed and (limits[near] >= highest).all():
                return solution
            largest = omitted.max(axis=1, initial=0.0)
            much = largest > allowed / (2 * max(1, np.count_nonzero(largest)))
            limits = np.where(much, WIDER * limits, limits)
            limits = np.where(much | near | (limits > 0), np.maximum(limits, MARGIN * highest), limits)
        raise ConvergenceError(
            f"accuracy {self.accuracy:g} of the coupled modes cannot be had: too many modes of cables"
        )

    def _modes(self, models, limits):
        kept = models.keep(limits)
        system = self.layout.system([one.element for one in kept])
        try:
            omega, shapes = system.lowest(self.count)
        except NoSolutionError:
            reason = self.equilibrium.stability.reason() or "its stiffness is next to nothing"
            raise NoSolutionError(f"no modes about this equilibrium: {reason}") from None
        ends = self.layout.ends(self.layout.bodies(shapes))
        return Solution(models, kept, limits, system, omega, shapes, models.omitted(kept, omega**2, ends))

    def _error(self, before, solution):
        """Relative error of each frequency: difference of two levels, modes left out, rounding."""
        difference = np.abs(before.omega / solution.omega - 1)
        return np.maximum(difference + np.abs(solution.omitted).sum(axis=0) / 2, NOISE)

    def _finished(self, solution, error, before=None):
        modes = len(solution.omega)
        exact = error is None
        error = np.full(modes, np.nan) if exact else error
        coincident = tuple(runs(solution.omega, np.full(modes, NOISE) if exact else error))
        shapes = solution.shapes.copy()
        moving = np.arange(len(shapes)) + 1.0
        for first, last in coincident:
            some = shapes[:, first - 1 : last]
            # modes that coincide: separated by which coordinates move
            mixed = some.T @ (moving[:, None] * (solution.system.mass @ some))
            shapes[:, first - 1 : last] = some @ np.linalg.eigh(mixed + mixed.T)[1]
        displaced = self.layout.bodies(shapes)
        bodies = self.layout.kinetic(displaced)
        cables = solution.models.kinetic(solution.amplitudes(shapes), self.layout.ends(displaced))
        whole = bodies.sum(axis=(0, 1)) + cables.sum(axis=(0, 1))
        return CoupledModes(
            frequency=solution.omega / (2 * np.pi),
            error=error,
            body_energy=bodies / whole,
            cable_energy=cables / whole,
            coincident=coincident,
            cables=tuple(self._record(solution, place) for place in range(self.cables.count)),
            layout=self.layout,
            solution=solution,
            shapes=shapes,
            before=before,
        )

    def _record(self, solution, place):
        mesh, kept = solution.models.meshes[place], solution.kept[place]
        full = solution.models.elements[place].omega
        return CableRecord(
            name=self.equilibrium.suspension.cable_names[place],
            elements=mesh.elements if mesh else 0,
            order=mesh.order if mesh else 0,
            modes=kept.modes,
            residuals=len(kept.element.omega) - kept.modes,
            first_mode=float(full[0]) / (2 * np.pi) if len(full) else np.inf,
            limit=float(solution.limits[place]) / (2 * np.pi),
            error=float(np.abs(solution.omitted[place]).max(initial=0.0)) / 2,
        )


def coupled_modes(equilibrium, count, accuracy=1e-4, damping=UNDAMPED, model=None):
    """The lowest coupled modes of a suspension: see `Search`."""
    return Search(equilibrium, count, accuracy, damping, model).solve()


def runs(omega, error):
    """First and last number (from 1) of each run of frequencies that agree within their errors."""
    near = np.diff(omega) <= (error[1:] + error[:-1]) * omega[1:]
    first = 0
    for place in range(len(omega)):
        if place == len(near) or not near[place]:
            if place > first:
                yield first + 1, place + 1
            first = place + 1
