"""Conductors that stretch for good, of suspensions; see `study.conductors`."""

from dataclasses import replace

import numpy as np

from cablestudy.study.conductors import Conductors, uneven_errors
from cablestudy.study.suspension.load_cases import CablesOfCase, cables_left, loaded_state
from cablestudy.study.suspension.numbers import kind_of_case


class SuspendedConductors:
    """Suspensions with the linear cables that hang as their conductors do.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        n of them, alike.
    numbers : SuspendedSystem
    at_rest : callable
        `SuspendedSystem` -> `Equilibrium` in the reference state.

    Attributes
    ----------
    reference : Equilibrium
        Of the new conductors in the reference state, shape (n,).
    of_case : CablesOfCase
        Of all cables in their cases.
    labels : ndarray of str, shape (n, c)
        See `LinearCables.labels`; empty of linear cables.
    """

    def __init__(self, scenes, numbers, at_rest):
        self._numbers, self._at_rest = numbers, at_rest
        listed = [[cable.stress_strain is not None for cable in scene.cables.values()] for scene in scenes]
        self._stretching = np.array(listed)
        conductors = Conductors(scenes, self._stretching.shape, self._stated, self._loaded, alone=False)
        _, self.reference, lengths = conductors.reference
        self._found = conductors.in_their_cases()
        linear = self._found.stiffness, self._found.longer, self._found.share
        self.of_case = self._cables(slice(None), lengths, *linear)
        self.labels = np.where(self._stretching, self._found.labels, "")

    def _cables(self, rows, lengths, stiffness, longer, share):
        return CablesOfCase(lengths[rows], 1.0 + longer, stiffness, self._numbers.cable_mass[rows], share)

    def _stated(self, stiffness, longer, _):
        """Mean tensions [N] in the reference state, its `Equilibrium`, and lengths without tension there [m]."""
        numbers, warm = self._numbers, 1.0 + longer
        length = np.array([kind == "unstretched_length" for kind in numbers.given])
        found = self._at_rest(
            replace(
                numbers,
                axial_stiffness=stiffness,
                cable_mass=numbers.cable_mass / warm,
                value=np.where(length, numbers.value * warm, numbers.value),
            )
        )
        tension = np.where(found.record.converged[:, None], found.catenary.mean_tension, np.nan)
        return tension, found, found.lengths / warm

    def _loaded(self, rows, scenes, reference, *linear):
        """Mean tensions of suspensions in some cases. [N]"""
        tension, groups = np.full(linear[0].shape, np.nan), {}
        for place, scene in enumerate(scenes):
            groups.setdefault(kind_of_case(scene), []).append(place)
        for places in groups.values():
            chosen = rows[places]
            cables = self._cables(chosen, reference[2], *(part[places] for part in linear))
            some = [scenes[place].without_lost() for place in places]
            left = cables_left(reference[1], some[0])
            found = loaded_state(reference[1].take(chosen), some, cables=cables).equilibrium
            own = np.where(found.record.converged[:, None], found.catenary.mean_tension, np.nan)
            tension[np.ix_(places, left)] = own
        return tension

    def uneven_errors(self, equilibrium):
        """Largest of `conductors.uneven_errors` of the cables of each suspension, shape (n,). [-]"""
        left = np.array([self._numbers.cable_names.index(name) for name in equilibrium.suspension.cable_names])
        row, cable = np.nonzero(self._stretching[:, left])
        there, found, error = (row, left[cable]), self._found, np.zeros((len(self._stretching), len(left)))
        linear = equilibrium.catenary.take((row, cable))
        error[row, cable] = uneven_errors(found.condition.take(there), found.strain[there], linear)
        return error.max(axis=-1)


def conductors_of(scenes, numbers, at_rest):
    """`SuspendedConductors` of suspensions, parameters as of these; None where no cable stretches for good."""
    if all(cable.stress_strain is None for scene in scenes for cable in scene.cables.values()):
        return None
    return SuspendedConductors(scenes, numbers, at_rest)
