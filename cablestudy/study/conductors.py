"""Linear cables that hang as conductors with permanent elongation do, in the state that each scene asks for.

A tension or sag that a scene states is that of the new conductor in the reference state; the length without tension of
this conductor holds for all states. The load that stretches a conductor is the load case in which its mean tension is
largest; creep is that of 10 years without a load case. In the state `final` the load follows the creep.

Motion and stiffness about the equilibrium follow the final moduli of the parts that are tight, as does a tension that
falls and comes back. An end that the force of a load case has moved followed the curve.

The permanent sets by creep and load do not depend on the case that a scene is in: scenes that differ in nothing else
share them.

The catenary is that of a linear cable. At a strain of the conductor, the tangent of its curve gives a linear cable
(`cable.stress_strain`), whose mean tension in turn gives the next strain: Newton's method, to the strain at which
conductor and linear cable have the same tension.
"""

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.catenary_in_drag import bounded_errors
from cablestudy.cable.records import take_rows
from cablestudy.cable.stress_strain import NO_SET, TERMS, Condition, Curves, linear_cable, uneven_strain
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import size
from cablestudy.study.tolerances import STUDY

NAMES = tuple(field.name for field in fields(Curves))
BEYOND = " beyond its curve"  # where a curve is not measured, and goes on along its tangent
CREPT, LOADED = ("after_creep", "final"), ("after_load", "final")  # states with a permanent set by creep, by load


@dataclass(frozen=True)
class LinearCables:
    """Linear cables that hang as conductors do: arrays of shape (...)."""

    stiffness: np.ndarray  # EA [N]
    elongation: np.ndarray  # unstretched length over that of the new conductor in the reference state, minus 1 [-]
    # length without tension of the conductor in its case over the unstretched length of the linear cable: ice and wind
    # are stated per length of the conductor [-]
    length_ratio: np.ndarray
    condition: Condition  # of the conductors
    strain: np.ndarray  # of the conductors at their mean tension [-]
    # errors of their strain by the length of the new conductors and the permanent sets, shape (..., 2): of the mean
    # strain, and along the cable; see `uneven_errors` [-]
    earlier_errors: np.ndarray
    # of str: the state, of `final` the one that leaves the conductor longer, and the parts that are slack or stretched
    # beyond what their curve is measured to
    labels: np.ndarray


def curves_of(cables, shape):
    """`Curves` of a list of cables, of shape `shape`; those of a linear cable are straight lines."""
    numbers_of_cables = [_numbers(cable) for cable in cables]
    arrays = [np.array([numbers[name] for numbers in numbers_of_cables], dtype=float) for name in NAMES]
    return Curves(*(array.reshape(*shape, *array.shape[1:]) for array in arrays))


def _numbers(cable):
    """Name of each field of `Curves` -> its numbers for one cable."""
    stress_strain, stiffness = cable.stress_strain, cable.section_axial_stiffness
    if stress_strain is None:
        line = [[0.0, stiffness] + [0.0] * (TERMS - 2), [0.0] * TERMS]
        numbers = line, line, np.ones((2, 2)), [stiffness, 0.0], [cable.expansion or 0.0, 0.0]
        return dict(zip(NAMES, (*numbers, cable.reference.temperature), strict=True))
    area, parts = cable.section_area, ("outer", "core")
    curves = {curve: [stress_strain.coefficients(name, curve) for name in parts] for curve in ("initial", "creep")}
    properties = [stress_strain.parts.get(name) for name in parts]
    moduli = [stress_strain.final_modulus(name) if part else 0.0 for name, part in zip(parts, properties, strict=True)]
    return {
        **{curve: area * np.array([factors for factors, _ in part_curves]) for curve, part_curves in curves.items()},
        "ends": [[end for _, end in part_curves] for part_curves in curves.values()],
        "final": [area * modulus for modulus in moduli],
        "expansion": [part.expansion if part else 0.0 for part in properties],
        "temperature": stress_strain.measured_at,
    }


def distinct_without_case(scenes):
    """Find the distinct ones among n scenes, regardless of their load cases.

    The permanent elongation of a conductor does not depend on the load case in which a scene is: it is computed once
    for each distinct scene.

    Parameters
    ----------
    scenes : sequence of scenes
        n scenes. Their values are compared by identity: copies of one scene for several load cases are equal, scenes
        that were read from files separately are not.

    Returns
    -------
    different : list of scenes
        The distinct scenes, in no load case.
    indices : ndarray of int, shape (n,)
        Index into `different` for each of the n scenes.
    """
    different, indices = {}, []
    for scene in scenes:
        key = tuple(id(value) for name, value in scene if name != "case")
        indices.append(different.setdefault(key, (len(different), scene))[0])
    return [scene.in_case(None) for _, scene in different.values()], np.array(indices)


@dataclass(frozen=True)
class PermanentSets:
    """Permanent elongations ("sets") of the outer strands and the core of each conductor, `shape` of `Conductors`.

    Attributes
    ----------
    by_creep : ndarray, shape (..., 2)
        By creep, where a conductor has crept. [-]
    sets : ndarray, shape (..., 2)
        By creep and the heaviest load case. [-]
    by_load : ndarray, shape (..., 2)
        By this case alone. [-]
    heaviest : ndarray of str, shape (...)
        Name of this case; empty without one.
    errors : ndarray, shape (..., 2)
        `earlier_errors` of `LinearCables`. [-]
    """

    by_creep: np.ndarray
    sets: np.ndarray
    by_load: np.ndarray
    heaviest: np.ndarray
    errors: np.ndarray


class Conductors:
    """Stranded conductors of n scenes, with nonlinear curves of tension over strain, as equivalent linear cables.

    A conductor has two parts, outer strands and core. Each has a permanent elongation ("set"), by creep and by load.
    Arrays with a value for each cable have `shape`: (n,) in scenes of one cable, (n, c) in scenes of c cables.

    Parameters
    ----------
    scenes : sequence of scenes
        n scenes of one kind with equal connections, in no load case.
    shape : tuple of int
        (n,) or (n, c).
    solve_reference : callable
        Solves all scenes without load case. Its arguments are arrays: `stiffness`, `elongation` and `length_ratio` of
        `LinearCables`. It returns mean tensions [N], tensions at points along the cables (`tensions_along`), and the
        state that it found, for `solve_cases`.
    solve_cases : callable
        Solves k of the scenes in their load cases. Its arguments are the indices of the scenes, these scenes, the state
        from `solve_reference`, and the three arrays. It returns mean tensions, and tensions along the cables. [N]
    independent : bool
        Whether the tension of a cable depends on its own strain only, and not on that of other cables.

    Attributes
    ----------
    curves : Curves
        Curves of tension over strain of all conductors.
    states : ndarray of str, of `shape`
        Which permanent elongation the scene asks for: `initial` (none), `after_creep`, `after_load` or `final` (both).
    reference : object
        State from `solve_reference` with the new conductors.
    """

    def __init__(self, scenes, shape, solve_reference, solve_cases, independent):
        cables = [cable for scene in scenes for cable in scene.cables.values()]
        self._scenes, self._shape, self._solve_cases, self._independent = scenes, shape, solve_cases, independent
        self.curves = curves_of(cables, shape)
        self.states = np.array([cable.conductor_state or "initial" for cable in cables]).reshape(shape)
        reference_temperature = np.array([cable.reference.temperature for cable in cables]).reshape(shape)
        new = Condition(self.curves, reference_temperature, self.curves.unset, np.zeros(shape, dtype=bool))
        self._slack_strain = new.slack_strain

        def tension_at(*tangent):
            tension, self._along, self.reference = solve_reference(*self._linear(tangent, new))
            return tension

        self._strain = new.settle(
            tension_at, self._slack_strain + STUDY.first_conductor_strain, independent, STUDY.conductor_tension
        )
        tension_at(self._strain, *new.tension_and_slope(self._strain))
        self._length_errors = _strain_errors(new, self._strain, self._along) * [1.0, 0.0]  # it leaves no set

    def _linear(self, tangent, condition, rows=slice(None)):
        """`stiffness`, `elongation` and `length_ratio` of the linear cables with these strains, tensions and slopes."""
        stiffness, ratio = linear_cable(*tangent)
        return stiffness, ratio / (1.0 + self._slack_strain[rows]) - 1.0, (1.0 + condition.slack_strain) / ratio

    def _solve_strains(self, rows, scenes, condition):
        """Strains of some conductors in their cases, mean tensions there, and `tensions_along` them.

        Tensions are NaN without an equilibrium.
        """
        solved = []

        def tension_at(*tangent):
            solved.append(self._solve_cases(rows, scenes, self.reference, *self._linear(tangent, condition, rows)))
            return solved[-1][0]

        strain = condition.settle(tension_at, self._strain[rows], self._independent, STUDY.conductor_tension)
        return strain, *solved[-1]

    def _condition(self, rows, scenes, sets, creeping=False):
        """`Condition` of the conductors of some scenes at the temperatures of their cases, with permanent sets."""
        temperature = np.array([
            cable.reference.temperature if scene.load_case.temperature is None else scene.load_case.temperature
            for scene in scenes for cable in scene.cables.values()
        ]).reshape(len(scenes), *self._shape[1:])  # fmt: skip
        return Condition(take_rows(self.curves, rows), temperature, sets, np.full(temperature.shape, creeping))

    @cached_property
    def _sets_by_creep(self):
        """Permanent sets of all conductors by 10 years of creep under the everyday tension; errors of the strain."""
        rows = np.arange(len(self._scenes))
        condition = self._condition(rows, self._scenes, self.curves.unset, creeping=True)
        strain, _, along = self._solve_strains(rows, self._scenes, condition)
        return condition.sets_after(strain), _strain_errors(condition, strain, along)

    @cached_property
    def _permanent_sets(self):
        """`PermanentSets` of each conductor in its state."""
        unset, with_creep, with_load = self.curves.unset, np.isin(self.states, CREPT), np.isin(self.states, LOADED)
        by_creep, errors = unset, self._length_errors
        if with_creep.any():
            by_creep = np.where(with_creep[..., None], self._sets_by_creep[0], unset)
            errors = errors + np.where(with_creep[..., None], self._sets_by_creep[1], 0.0)
        if not with_load.any():
            return PermanentSets(by_creep, by_creep, unset, np.full(self._shape, "", dtype=object), errors)
        sets, by_load, heaviest, errors_by_load = self._sets_by_load(by_creep)
        errors = errors + np.where(with_load[..., None], errors_by_load, 0.0)
        sets = np.where(with_load[..., None], sets, by_creep)
        return PermanentSets(by_creep, sets, by_load, heaviest, errors)

    def _sets_by_load(self, sets):
        """Add to the permanent sets of conductors those by their heaviest load case, and return both.

        The heaviest case is the one in which the mean tension of the conductor is largest. All load cases of all
        scenes are solved together, but those in which cables are lost.

        Parameters
        ----------
        sets : ndarray, shape (..., 2)
            Permanent sets before the load: none, or those by creep. [-]

        Returns
        -------
        sets, by_load, heaviest, errors
            As the attributes of `PermanentSets`. The name of the heaviest case has the suffix BEYOND where the strain
            is beyond the measured curve; `errors` are those of the strain, since the tension varies along the cable.
        """
        rows_and_scenes = [(row, scene.in_case(name))
                           for row, scene in enumerate(self._scenes) for name, case in scene.cases.items()
                           if not getattr(case, "lost", ())]  # fmt: skip
        largest, by_load = np.zeros(self._shape), self.curves.unset.copy()
        heaviest, errors = np.full(self._shape, "", dtype=object), np.zeros((*self._shape, 2))
        if not rows_and_scenes:
            return sets, by_load, heaviest, errors
        rows, scenes = np.array([row for row, _ in rows_and_scenes]), [scene for _, scene in rows_and_scenes]
        condition = self._condition(rows, scenes, sets[rows])
        strain, tension, along = self._solve_strains(rows, scenes, condition)
        strain_errors = _strain_errors(condition, strain, along)
        beyond = condition.beyond(strain).any(axis=-1)
        for index, row in enumerate(rows.tolist()):
            heavier = tension[index] > largest[row]
            # sets by this load alone: from the strain, on the curves of a conductor without earlier sets
            without_sets = replace(take_rows(condition, index), sets=np.full(sets[row].shape, NO_SET))
            new_sets = without_sets.sets_after(strain[index])
            by_load[row] = np.where(heavier[..., None], new_sets, by_load[row])
            label = np.where(beyond[index], f"{scenes[index].case}{BEYOND}", scenes[index].case)
            heaviest[row] = np.where(heavier, label, heaviest[row])[()]
            largest[row] = np.where(heavier, tension[index], largest[row])
            errors[row] = np.where(heavier[..., None], strain_errors[index], errors[row])
        return np.maximum(sets, by_load), by_load, heaviest, errors

    def _moved_by_force(self, scenes):
        """True of scenes in which a force of their case moves an end of the cable, shape (n, ...)."""
        forces = [getattr(scene.load_case.forces, "end_2", ()) for scene in scenes]
        return np.array([any(force) for force in forces]).reshape(-1, *(1,) * (len(self._shape) - 1))

    def equivalent_cables(self, rows, scenes):
        """Linear cables that represent the nonlinear conductors of k scenes, each in its load case.

        A linear cable has the strain and the tension of the conductor in equilibrium. The state of a conductor says
        which permanent elongation ("set") it has: none, by creep, by load, or both (`final`).

        Parameters
        ----------
        rows : ndarray of int, shape (k,)
            For each of the k scenes the index of its original among the n scenes of this object: the two differ in the
            load case only.
        scenes : sequence of scenes
            k scenes, each in its load case.

        Returns
        -------
        LinearCables
            Shape (k,), or (k, c) in scenes of c cables.
        """
        permanent, states = take_rows(self._permanent_sets, rows), self.states[rows]
        with_creep, with_load = np.isin(states, CREPT), np.isin(states, LOADED)
        condition = self._condition(rows, scenes, permanent.sets)
        strain, _, _ = self._solve_strains(rows, scenes, condition)
        tension, slope = condition.tension_and_slope(strain)
        # small motion about the equilibrium follows the final moduli; an end that a force has moved followed the curve
        slope = np.where(self._moved_by_force(scenes), slope, condition.elastic(strain))
        linear = self._linear((strain, tension, slope), condition, rows)
        labels = np.array(states, dtype=object)
        if with_load.any():
            # creep or load governs, whichever alone leaves the conductor longer: with less tension at the same strain
            by_creep_alone, _ = replace(condition, sets=permanent.by_creep).tension_and_slope(strain)
            by_load_alone, _ = replace(condition, sets=permanent.by_load).tension_and_slope(strain)
            creep_governs = with_creep & (by_creep_alone <= by_load_alone)
            governing = np.where(creep_governs, "after_creep", "after_load (" + permanent.heaviest + ")")
            labels = np.where(with_load, governing, labels)
        slack = (condition.parts(strain)[0] == 0) & (condition.curves.final > 0)
        for marked, text in ((slack, " slack"), (condition.beyond(strain), BEYOND)):
            for index, name in enumerate((", outer", ", core")):
                labels = np.where(marked[..., index], labels + name + text, labels)
        return LinearCables(*linear, condition, strain, permanent.errors, labels)


def tensions_along(catenary):
    """Tension of cables at Gauss points along them, shape (..., k). [N]"""
    nodes, _ = np.polynomial.legendre.leggauss(STUDY.conductor_points)
    return np.sqrt((catenary.tension_at((1 + nodes) / 2) ** 2).sum(axis=-1))


@np.errstate(all="ignore")  # tensions are NaN without an equilibrium
def _strain_errors(condition, strain, along):
    """Errors of a strain as the tension varies, with `tensions_along` the cables, shape (..., 2). [-]

    The size of `stress_strain.uneven_strain`, and that by which the permanent set that the strain leaves a part may
    differ along the cable from the one at the mean tension.
    """
    _, weights = np.polynomial.legendre.leggauss(STUDY.conductor_points)
    tension, slope = condition.tension_and_slope(strain)
    change = np.abs(along - tension[..., None]).max(axis=-1) / slope
    of_sets = np.abs(condition.set_slopes(strain)).max(axis=-1) * change
    return np.stack([np.abs(uneven_strain(condition, strain, along, weights / 2)), of_sets], axis=-1)


def errors_along(linear, catenary):
    """Errors e and e' of the strains of k conductors as linear cables: of the mean, and along each, (k,). [-]

    See `uneven_errors`, with its parameters.
    """
    condition, strain, tension = linear.condition, linear.strain, tensions_along(catenary)
    mean = _strain_errors(condition, strain, tension)[..., 0] + linear.earlier_errors[..., 0]
    with np.errstate(all="ignore"):
        difference = np.abs(1 / condition.tension_and_slope(strain)[1] - 1 / condition.elastic(strain))
    uneven = difference * np.abs(tension - catenary.mean_tension[:, None]).max(axis=-1)
    return mean, uneven + linear.earlier_errors[..., 1]


def lengthenings(linear, catenary):
    """Movements of the free end 2 of k conductors by e and e' of `errors_along`, global axes, shape (k, 2, 3). [m]

    By e it is e times the vector between the ends. e' is largest where the tension T differs most from its mean T_m,
    and moves the end by e' L times the mean of (T - T_m)/max |T - T_m| times the tangent.
    """
    span, (mean, uneven) = catenary.span, errors_along(linear, catenary)
    nodes, weights = np.polynomial.legendre.leggauss(STUDY.conductor_points)
    vectors = span.in_frame(catenary.tension_at((1 + nodes) / 2), "global")
    tension = size(vectors)
    apart, tangent = tension - catenary.mean_tension[:, None], vectors / np.maximum(tension, STUDY.tiny)[..., None]
    share = apart / np.maximum(np.abs(apart).max(axis=-1, keepdims=True), STUDY.tiny)
    turned = (weights[:, None] / 2 * share[..., None] * tangent).sum(axis=-2)
    by_mean, by_uneven = mean * span.chord, uneven * span.unstretched_length
    return np.stack([by_mean[:, None] * span.frame[:, 0], by_uneven[:, None] * turned], axis=-2)


def uneven_errors(linear, catenary):
    """Estimate the relative errors of k equilibria in which a linear cable represents each nonlinear conductor.

    A linear cable has the strain of the conductor at the mean tension T_m only, but the tension T varies along the
    cable. The estimate is the sum of two errors of first order, times a safety factor (`CABLE.second_order`):

    * of the tension, e L K/T_m, with the length L and the end stiffness K along the chord. The mean strain of the
      conductor exceeds its strain at T_m by e, which lengthens it by e L. e includes the same error of earlier steps,
      `linear.earlier_errors`: of the length found in the reference state, of the permanent elongation.
    * of the positions of points, e' = |1/EA_c - 1/EA| max |T - T_m|. EA_c is the slope of the conductor's curve of
      tension over strain, EA the stiffness that it has when unloaded and loaded again ("final moduli"). Permanent sets
      that earlier tensions have left vary along the cable too.

    Parameters
    ----------
    linear : LinearCables
        The k linear cables, and the conductors for which they stand.
    catenary : Catenary
        Equilibria of the linear cables, shape (k,).

    Returns
    -------
    ndarray, shape (k,)
        At most `CABLE.unknown_error`. [-]
    """
    mean, uneven = errors_along(linear, catenary)
    mean_tension = np.maximum(catenary.mean_tension, np.finfo(float).tiny)
    with np.errstate(all="ignore"):
        of_tension = mean * catenary.span.unstretched_length * catenary.end_stiffness[..., 0, 0] / mean_tension
    return bounded_errors(CABLE.second_order * (of_tension + uneven))
