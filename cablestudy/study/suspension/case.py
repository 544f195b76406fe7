"""One case of a suspension: its equilibrium, what its cables carry, its coupled modes; each computed when needed."""

from functools import cached_property

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError
from cablestudy.scene.suspension import Tensions
from cablestudy.study.columns import ROUNDING, stress_of
from cablestudy.study.results import ClosedStatics
from cablestudy.study.suspension.numbers import numbers_of, topology_of
from cablestudy.system import lengths, statics
from cablestudy.system.cables import FixedModel
from cablestudy.system.coupled import Layout
from cablestudy.system.coupled_modes import coupled_modes
from cablestudy.system.descent import REASONS
from cablestudy.system.rigid import cross_matrix
from cablestudy.system.suspension import Equilibrium

STIFFNESS_ROUNDING = 1e-13  # of an entry over the geometric mean of those on the diagonal
MOST_MODES = 400  # that are searched for the K-th mode of a body
FIRST = 12  # modes computed at first for all up to a frequency
MORE = 8  # modes beyond those asked for that are computed at first, for modes of a body


class CableResults:
    """Statics of all cables of one case, with the attributes of `Results` that columns of cables need.

    Parameters
    ----------
    scene : SuspensionScene
    catenary : Catenary
        Of shape (c,).
    """

    def __init__(self, scene, catenary):
        self._cables, self.catenary, self.span = list(scene.cables.values()), catenary, catenary.span

    @cached_property
    def statics(self):
        """`ClosedStatics`, fields of shape (c,)."""
        return ClosedStatics(self.catenary)

    @property
    def mass(self):
        """Of each cable, shape (c,). [kg]"""
        return self.span.mass * self.span.unstretched_length

    @property
    def utilisation(self):
        """Largest stress over strength of each cable, shape (c,), not a number without a strength. [-]"""
        return stress_of(self) / self.given("cable.strength")

    def given(self, path):
        """A number that each cable states, shape (c,), not a number where it states none."""
        name = path.removeprefix("cable.")
        if name == "chord_length":
            return self.span.chord
        values = [getattr(cable, name, None) for cable in self._cables]
        return np.array([np.nan if value is None else value for value in values], dtype=float)


class SuspensionCase:
    """One suspension.

    Parameters
    ----------
    scene : SuspensionScene
    found : Equilibrium or CablestudyError, optional
        Its equilibrium, or why there is none, where it was computed with those of others.
    """

    def __init__(self, scene, found=None):
        self.scene, self._found, self._modes = scene, found, {}

    @cached_property
    def equilibrium(self):
        """`Equilibrium` of this case.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is none, or it is not stable.
        """
        found = equilibria([self.scene])[0] if self._found is None else self._found
        if isinstance(found, Exception):
            raise found
        return found

    @property
    def known(self):
        """The equilibrium, or None where there is none or it was not needed."""
        try:
            return None if self._found is None and "equilibrium" not in self.__dict__ else self.equilibrium
        except CablestudyError:
            return None

    @property
    def largest_modes(self):
        """Of the modes that were computed those of the largest number: a list of at most one `CoupledModes`."""
        return [self._modes[max(self._modes)]] if self._modes else []

    @cached_property
    def cables(self):
        """`CableResults`."""
        return CableResults(self.scene, self.equilibrium.catenary)

    def cable(self, name):
        """Place of a cable among all."""
        return self.equilibrium.suspension.cable_names.index(name)

    def body(self, name):
        """Place of a body or free point among all."""
        return self.equilibrium.suspension.body_names.index(name)

    @cached_property
    def size_of_scene(self):
        """Longest chord. [m]"""
        return float(self.equilibrium.catenary.span.chord.max())

    def body_stiffness(self, name):
        """6x6 of a body, shape (6, 6), rounding shown as zero; see `Equilibrium.body_stiffness`."""
        matrix = self.equilibrium.body_stiffness[self.body(name)]
        size = np.sqrt(np.abs(np.diagonal(matrix)))
        return np.where(np.abs(matrix) > STIFFNESS_ROUNDING * np.outer(size, size), matrix, 0.0)

    def static_frequencies(self, name):
        """Frequencies of a body on its static stiffness with a third of its cables' mass at their ends, ascending. [Hz]

        Junctions follow without their mass and other bodies are at rest: an estimate for cables that are light and taut.
        """
        from scipy.linalg import eigvalsh

        place, found = self.body(name), self.equilibrium
        suspension, mass = found.suspension, Layout(found).mass[self.body(name)]
        cable, end = np.nonzero(suspension.owner == place)
        moved = np.concatenate([np.broadcast_to(np.eye(3), (len(cable), 3, 3)), -cross_matrix(found.arms[cable, end])], -1)
        mass = mass + (np.swapaxes(moved, -1, -2) @ moved * self.cables.mass[cable, None, None] / 3).sum(axis=0)
        free = np.ix_(suspension.free[place], suspension.free[place])
        stiffness = self.body_stiffness(name)[free]
        squared = eigvalsh((stiffness + stiffness.T) / 2, mass[free])
        return np.sqrt(np.maximum(squared, 0.0)) / (2 * np.pi)

    def frequency(self, number):
        """Frequency of a mode by its number (from 1) [Hz], and its estimated relative error.

        Raises
        ------
        NoSolutionError, ConvergenceError
        """
        modes = self.modes(number)
        if len(modes) < number:
            raise NoSolutionError(f"the model has {len(modes)} modes, not {number}")
        return modes.frequency[number - 1], modes.error[number - 1]

    def statics_error(self, column):
        """Estimated relative error of a column that needs no motion: none of what the scene states. [-]"""
        return 0.0 if column.needs == "scene" else max(ROUNDING, float(self.equilibrium.record.correction))

    @property
    def size(self):
        """Coordinates of the linear model; 0 where none was made. [-]"""
        return max((len(modes.shapes) for modes in self._modes.values()), default=0)

    @property
    def model(self):
        """`FixedModel` of the scene, or None where it states an accuracy."""
        model = self.scene.model
        return FixedModel(model.elements, model.order, model.mass) if model.elements else None

    def modes(self, count):
        """The lowest coupled modes, at least so many where there are: `CoupledModes`.

        Raises
        ------
        NoSolutionError, ConvergenceError
        """
        known = [modes for asked, modes in self._modes.items() if asked >= count]
        if known:
            return known[0]
        damping = [cable.damping for cable in self.scene.cables.values()]
        accuracy = self.scene.model.accuracy or 1.0
        self._modes[count] = coupled_modes(self.equilibrium, count, accuracy, damping, self.model)
        return self._modes[count]

    def modes_up_to(self, frequency):
        """All coupled modes up to a frequency [Hz], and at least one above it if there is one: `CoupledModes`.

        Raises
        ------
        NoSolutionError, ConvergenceError
        """
        count = FIRST
        while True:
            modes = self.modes(count)
            if len(modes) < count or modes.frequency[-1] > frequency:
                return modes
            count *= 2

    def mode_of(self, body, number):
        """Modes, and place in them of the mode `number` (from 1) with more than half of its kinetic energy in a body.

        Raises
        ------
        NoSolutionError
            There is no such mode among the lowest MOST_MODES.

        Notes
        -----
        The shares of a body in all modes add up to its free degrees of freedom at most, so that the search ends when
        too little is left for the modes that are missing.
        """
        place = self.body(body)
        free = self.equilibrium.suspension.free[place].sum()
        count = number + MORE
        while True:
            modes = self.modes(count)
            share = modes.body_energy[place].sum(axis=0)
            of_body = np.flatnonzero(share > 0.5)
            if len(of_body) >= number:
                return modes, int(of_body[number - 1])
            exhausted = free - share.sum() < 0.5 * (number - len(of_body))
            if exhausted or len(modes) < count or count >= MOST_MODES:
                raise NoSolutionError(
                    f"{len(of_body)} of the lowest {len(modes)} modes have more than half of their kinetic energy in "
                    f"{body}, not {number}"
                )
            count = min(2 * count, MOST_MODES)


def equilibria(scenes):
    """Equilibria of many scenes, those of equal names and connections solved together.

    Parameters
    ----------
    scenes : sequence of SuspensionScene

    Returns
    -------
    list of (Equilibrium or CablestudyError)
        Each of one case.
    """
    groups = {}
    for place, scene in enumerate(scenes):
        key = (repr(topology_of(scene)), scene.solve_for, repr(scene.tensions))
        groups.setdefault(key, []).append(place)
    found = [None] * len(scenes)
    for places in groups.values():
        for place, one in zip(places, _of_group([scenes[place] for place in places]), strict=True):
            found[place] = one
    return found


def _of_group(scenes):
    """`equilibria` of scenes of equal topology."""
    suspension, problems = numbers_of(scenes), [""] * len(scenes)
    try:
        if scenes[0].solve_for == "lengths":
            equilibrium, problems = lengths.solve(suspension, **_distribution(scenes[0], suspension))
        else:
            equilibrium = statics.pose(suspension)
    except (NoSolutionError, ConvergenceError) as error:
        if len(scenes) == 1:
            return [error]
        return [one for scene in scenes for one in _of_group([scene])]
    return [_checked(_taken(equilibrium, case), problem) for case, problem in enumerate(problems)]


def _distribution(scene, suspension):
    """Arguments of `lengths.solve` that a scene states."""
    found = suspension.free.copy()
    for place, body in enumerate(scene.bodies.values()):
        found[place, :3] = False
        found[place, 3:] &= body.attitude == "free"
    tensions = scene.tensions or Tensions()
    reference = tensions.reference or 0.0
    if isinstance(reference, dict):
        reference = np.array([reference.get(name, np.nan) for name in scene.cables])
    high = np.inf if tensions.max is None else tensions.max
    return {"method": tensions.method, "low": tensions.min, "high": high, "reference": reference, "found": found}


def _taken(equilibrium, case):
    """One case of a batch."""
    record = type(equilibrium.record)(*(np.asarray(part)[case] for part in vars(equilibrium.record).values()))
    return Equilibrium(
        equilibrium.suspension.take(case),
        equilibrium.position[case],
        equilibrium.rotation[case],
        equilibrium.catenary.take(case),
        record,
    )


def _checked(equilibrium, problem):
    """An equilibrium, or the error that says why it is none or not stable."""
    record = equilibrium.record
    if problem:
        return NoSolutionError(str(problem))
    if not record.converged:
        return ConvergenceError(f"no equilibrium: {REASONS[int(record.reason)]} ({int(record.steps)} steps)")
    reason = equilibrium.stability.reason()
    return NoSolutionError(reason) if reason else equilibrium
