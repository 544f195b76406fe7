"""Conductors that stretch for good: the linear cables that hang as they do, in the state that each scene asks for.

A stated tension or sag is that of the new conductor in the reference state; its length without tension there is the one
that all states share. The load that stretches a conductor is the case in which its mean tension is largest; creep is
that of the conductor without a case, for 10 years. In the state `final` it creeps first and is loaded then.

Motion and stiffness are those about the equilibrium with the final moduli of the parts that are tight: what falls below
the tension of a day, and comes back, follows these. The end that the force of a load case pushes goes along the curve.

What creep and load leave does not depend on the case that a scene is in: scenes that differ in nothing else share it.

The catenary is that of a linear cable. At a strain e of the conductor its tangent gives one (`cable.stress_strain`),
whose mean tension in turn gives the next strain: Newton's method, to the strain at which both have one tension.
"""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from cablestudy.cable.stress_strain import NO_SET, TERMS, Condition, Curves, linear_cable, uneven_strain
from cablestudy.study.load_cases import bounded
from cablestudy.study.tolerances import STUDY

NAMES = tuple(field.name for field in fields(Curves))
BEYOND = " beyond its curve"  # where a curve is not measured, and goes on along its tangent
CREPT, LOADED = ("after_creep", "final"), ("after_load", "final")  # states with a permanent set by creep, by load


@dataclass(frozen=True)
class LinearCables:
    """Linear cables that hang as conductors do, shape (...).

    Attributes
    ----------
    stiffness : ndarray, shape (...)
        EA. [N]
    longer : ndarray, shape (...)
        Unstretched length over that of the new conductor in the reference state, less one. [-]
    share : ndarray, shape (...)
        Length of the conductor without tension, as it is in the case, over that unstretched length: ice and wind are
        those per length of it. [-]
    condition : Condition
        Of the conductors.
    strain : ndarray, shape (...)
        At their mean tension. [-]
    labels : ndarray of str, shape (...)
        The state, of `final` the one that leaves the conductor longer, and the parts that are slack or stretched beyond
        what their curve is measured to.
    """

    stiffness: np.ndarray
    longer: np.ndarray
    share: np.ndarray
    condition: Condition
    strain: np.ndarray
    labels: np.ndarray


def curves_of(cables, shape):
    """Curves of some cables, of a linear one straight ones, shape `shape`.

    Parameters
    ----------
    cables : list of CableProperties
    shape : tuple of int
    """
    listed = [_numbers(cable) for cable in cables]
    arrays = [np.array([numbers[name] for numbers in listed], dtype=float) for name in NAMES]
    return Curves(*(array.reshape(*shape, *array.shape[1:]) for array in arrays))


def _numbers(cable):
    table, stiffness = cable.stress_strain, cable.section_axial_stiffness
    if table is None:
        line = [[0.0, stiffness] + [0.0] * (TERMS - 2), [0.0] * TERMS]
        numbers = line, line, np.ones((2, 2)), [stiffness, 0.0], [cable.expansion or 0.0, 0.0]
        return dict(zip(NAMES, (*numbers, cable.reference.temperature), strict=True))
    area, both = cable.section_area, ("outer", "core")
    found = {curve: [table.coefficients(name, curve) for name in both] for curve in ("initial", "creep")}
    parts = [table.parts.get(name) for name in both]
    return {
        **{curve: area * np.array([factors for factors, _ in own]) for curve, own in found.items()},
        "ends": [[end for _, end in own] for own in found.values()],
        "final": [area * table.final_modulus(name) if part else 0.0 for name, part in zip(both, parts, strict=True)],
        "expansion": [part.expansion if part else 0.0 for part in parts],
        "temperature": table.measured_at,
    }


def but_for_their_cases(scenes):
    """Scenes that differ in more than the load case that they are in, without one, and which of them each scene is.

    Parameters
    ----------
    scenes : sequence of scenes
        n of them. Their copies share all values but the case; scenes that were read twice count as different.

    Returns
    -------
    different : list of scenes
    rows : ndarray of int, shape (n,)
    """
    different, rows = {}, []
    for scene in scenes:
        key = tuple(id(value) for name, value in scene if name != "case")
        rows.append(different.setdefault(key, (len(different), scene))[0])
    return [scene.model_copy(update={"case": None}) for _, scene in different.values()], np.array(rows)


class Conductors:
    """Conductors of n scenes, and what their states leave of them.

    Parameters
    ----------
    scenes : sequence of scenes
        n of them, of one kind and alike, in no case.
    shape : tuple of int
        Of what each cable has: (n,), or (n, c).
    stated : callable
        `stiffness`, `longer` and `share` of `LinearCables`, of `shape` -> mean tensions in the reference state [N],
        and what `loaded` needs of it.
    loaded : callable
        Indices of some scenes, the same with the cases that they shall have, what `stated` found, and the same three of
        their cables -> mean tensions. [N]
    alone : bool
        As of `Condition.settle`.
    """

    def __init__(self, scenes, shape, stated, loaded, alone):
        cables = [cable for scene in scenes for cable in scene.cables.values()]
        self._scenes, self._shape, self._loaded, self._alone = scenes, shape, loaded, alone
        self.curves = curves_of(cables, shape)
        self.states = np.array([cable.conductor_state or "initial" for cable in cables]).reshape(shape)
        at_rest = np.array([cable.reference.temperature for cable in cables]).reshape(shape)
        new = Condition(self.curves, at_rest, self.curves.unset, np.zeros(shape, dtype=bool))
        self._begin = new.slack_strain

        def tension_at(*tangent):
            self.reference = stated(*self._linear(tangent, new))
            return self.reference[0]

        self._strain = new.settle(
            tension_at, self._begin + STUDY.first_conductor_strain, alone, STUDY.conductor_tension
        )
        tension_at(self._strain, *new.pull(self._strain))

    def _linear(self, tangent, condition, rows=slice(None)):
        """`stiffness`, `longer` and `share` of the linear cables at strains, tensions and slopes."""
        stiffness, ratio = linear_cable(*tangent)
        return stiffness, ratio / (1.0 + self._begin[rows]) - 1.0, (1.0 + condition.slack_strain) / ratio

    def _settled(self, rows, scenes, condition):
        """Strains of some conductors in their cases, and mean tensions there, not a number without an equilibrium."""
        tensions = []

        def tension_at(*tangent):
            tensions.append(self._loaded(rows, scenes, self.reference, *self._linear(tangent, condition, rows)))
            return tensions[-1]

        strain = condition.settle(tension_at, self._strain[rows], self._alone, STUDY.conductor_tension)
        return strain, tensions[-1]

    def _condition(self, rows, scenes, sets, creeping=False):
        temperature = np.array([
            cable.reference.temperature if scene.load_case.temperature is None else scene.load_case.temperature
            for scene in scenes for cable in scene.cables.values()
        ]).reshape(len(scenes), *self._shape[1:])  # fmt: skip
        return Condition(self.curves.take(rows), temperature, sets, np.full(temperature.shape, creeping))

    @cached_property
    def _sets_by_creep(self):
        """Sets that the everyday tension leaves in 10 years, in all."""
        rows = np.arange(len(self._scenes))
        condition = self._condition(rows, self._scenes, self.curves.unset, creeping=True)
        return condition.sets_after(self._settled(rows, self._scenes, condition)[0])

    @cached_property
    def _sets(self):
        """Sets by creep, sets in all, sets by the heaviest cases alone, and the names of these, of each state."""
        unset, crept, loaded = self.curves.unset, np.isin(self.states, CREPT), np.isin(self.states, LOADED)
        by_creep = np.where(crept[..., None], self._sets_by_creep, unset) if crept.any() else unset
        if not loaded.any():
            return by_creep, by_creep, unset, np.full(self._shape, "", dtype=object)
        sets, by_load, heaviest = self._sets_by_load(by_creep)
        return by_creep, np.where(loaded[..., None], sets, by_creep), by_load, heaviest

    def _sets_by_load(self, sets):
        """Sets that the heaviest cases leave beside those from before, those of the cases alone, and their names."""
        pairs = [(row, scene.model_copy(update={"case": name}))
                 for row, scene in enumerate(self._scenes) for name, case in scene.cases.items()
                 if not getattr(case, "lost", ())]  # fmt: skip
        largest, alone = np.zeros(self._shape), self.curves.unset.copy()
        heaviest = np.full(self._shape, "", dtype=object)
        if not pairs:
            return sets, alone, heaviest
        rows, scenes = np.array([row for row, _ in pairs]), [scene for _, scene in pairs]
        condition = self._condition(rows, scenes, sets[rows])
        strain, tension = self._settled(rows, scenes, condition)
        beyond = condition.beyond(strain).any(axis=-1)
        for place, row in enumerate(rows.tolist()):
            heavier = tension[place] > largest[row]
            here = Condition(condition.curves.take(place), condition.temperature[place],
                             np.full(sets[row].shape, NO_SET), condition.creeping[place])  # fmt: skip
            left = here.sets_after(strain[place])
            alone[row] = np.where(heavier[..., None], left, alone[row])
            name = np.where(beyond[place], f"{scenes[place].case}{BEYOND}", scenes[place].case)
            heaviest[row] = np.where(heavier, name, heaviest[row])[()]
            largest[row] = np.where(heavier, tension[place], largest[row])
        return np.maximum(sets, alone), alone, heaviest

    def _pushed(self, scenes):
        """Which cables a force of their case has pushed to where they are, from where it began, shape (n, ...)."""
        forces = [getattr(scene.load_case.forces, "end_2", ()) for scene in scenes]
        return np.array([any(force) for force in forces]).reshape(-1, *(1,) * (len(self._shape) - 1))

    def in_their_cases(self, rows, scenes):
        """`LinearCables` of scenes, each in its case and its state.

        Parameters
        ----------
        rows : ndarray of int, shape (k,)
            Which of all each scene is, but for its case.
        scenes : sequence of scenes
            k of them.
        """
        by_creep, sets, by_load, heaviest = (part[rows] for part in self._sets)
        states = self.states[rows]
        crept, loaded = np.isin(states, CREPT), np.isin(states, LOADED)
        condition = self._condition(rows, scenes, sets)
        strain, _ = self._settled(rows, scenes, condition)
        tension, slope = condition.pull(strain)
        slope = np.where(self._pushed(scenes), slope, condition.elastic(strain))
        linear = self._linear((strain, tension, slope), condition, rows)
        labels = np.array(states, dtype=object)
        if loaded.any():
            softer = [Condition(condition.curves, condition.temperature, left, condition.creeping).pull(strain)[0]
                      for left in (by_creep, by_load)]  # fmt: skip
            governs = np.where(crept & (softer[0] <= softer[1]), "after_creep", "after_load (" + heaviest + ")")
            labels = np.where(loaded, governs, labels)
        slack = (condition.parts(strain)[0] == 0) & (condition.curves.final > 0)
        for told, what in ((slack, " slack"), (condition.beyond(strain), BEYOND)):
            for part, name in enumerate((", outer", ", core")):
                labels = np.where(told[..., part], labels + name + what, labels)
        return LinearCables(*linear, condition, strain, labels)


def uneven_errors(condition, strain, catenary):
    """Relative errors from taking k conductors as linear along the cable, where the tension varies, shape (k,). [-]

    The sum of two, both to first order. That of the tension: a conductor's mean strain exceeds its strain at the mean
    tension and lengthens it, which changes the tension by the stiffness of the span. That of the places of points: off
    the mean tension its strain differs from that of the linear cable, whose slope is that of the final moduli.

    Parameters
    ----------
    condition : Condition
    strain : ndarray, shape (k,)
        At the mean tensions. [-]
    catenary : Catenary
        Of the linear cables in their place.
    """
    nodes, weights = np.polynomial.legendre.leggauss(STUDY.conductor_points)
    force = catenary.at((1 + nodes) / 2)[1]
    tension, mean = np.sqrt((force**2).sum(axis=-1)), np.maximum(catenary.mean_tension, np.finfo(float).tiny)
    with np.errstate(all="ignore"):
        extra_strain = np.abs(uneven_strain(condition, strain, tension, weights / 2))
        error = extra_strain * catenary.span.unstretched_length * catenary.end_stiffness[..., 0, 0] / mean
        slopes = np.abs(1 / condition.pull(strain)[1] - 1 / condition.elastic(strain))
        error = error + slopes * np.abs(tension - mean[:, None]).max(axis=-1)
    return bounded(STUDY.second_order * error)
