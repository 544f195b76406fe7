"""Conductors with permanent elongation, of suspensions; see `study.conductors`."""

from dataclasses import replace

import numpy as np

from cablestudy.cable.catenary_in_drag import bounded_errors
from cablestudy.cable.records import take_rows
from cablestudy.cable.vectors import cross, times
from cablestudy.statics import block_stiffness
from cablestudy.study.conductors import (
    Conductors,
    distinct_without_case,
    lengthenings,
    tensions_along,
    uneven_errors,
)
from cablestudy.study.suspension.load_cases import CablesOfCase, cables_left, loaded_state, numbers_at_rest
from cablestudy.study.suspension.numbers import kind_of_case
from cablestudy.study.tolerances import STUDY


class SuspendedConductors:
    """Suspensions with the linear cables that hang as their conductors do.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        n of them, alike.
    at_rest : callable
        Scenes, and their `SuspendedSystem` -> `Equilibrium` in the reference state, and a message for each scene that
        has none.

    Attributes
    ----------
    reference : Equilibrium
        Of the new conductors in the reference state, shape (n,).
    problems : list of str
        Why there is none, empty where there is.
    of_case : CablesOfCase
        Of all cables in their cases.
    labels : ndarray of str, shape (n, c)
        See `LinearCables.labels`; empty of linear cables.
    """

    def __init__(self, scenes, at_rest):
        different, rows = distinct_without_case(scenes)  # suspensions in no load case, and which one each scene is
        self._scenes, self._at_rest, self._numbers = different, at_rest, numbers_at_rest(different)
        has_set = [[cable.stress_strain is not None for cable in scene.cables.values()] for scene in different]
        self._names, self._stretching = list(different[0].cables), np.array(has_set)[rows]
        shape = len(different), len(self._names)
        conductors = Conductors(different, shape, self._solve_reference, self._solve_cases, independent=False)
        reference, self._lengths = conductors.reference
        self.reference, self.problems = reference.take(rows), [self._problems[row] for row in rows.tolist()]
        self._linear = linear = conductors.equivalent_cables(rows, scenes)
        self.of_case = self._cables(rows, linear.stiffness, linear.elongation, linear.length_ratio)
        self.labels = np.where(self._stretching, linear.labels, "")

    def uneven_errors(self, equilibrium):
        """Largest of `conductors.uneven_errors` of the cables of each suspension, shape (n,). [-]"""
        present = np.array([self._names.index(name) for name in equilibrium.suspension.cable_names])  # none of the lost
        stretching = self._stretching[:, present]
        row, cable = np.nonzero(stretching)
        indices, error = (row, present[cable]), np.zeros(stretching.shape)
        error[row, cable] = uneven_errors(take_rows(self._linear, indices), equilibrium.catenary.take((row, cable)))
        return error.max(axis=-1)

    def movements(self, equilibrium):
        """Errors of positions [m] and attitudes [rad] by conductors that are linear along each cable, shape (n, b, 6).

        What the `lengthenings` of a cable change of the forces at its ends moves the bodies. The sizes of the movements
        by all cables are added up.
        """
        suspension, stiffness = equilibrium.suspension, equilibrium.catenary.global_end_stiffness
        present = np.array([self._names.index(name) for name in suspension.cable_names])
        row, cable = np.nonzero(self._stretching[:, present])
        linear = take_rows(self._linear, (row, present[cable]))
        longer = lengthenings(linear, equilibrium.catenary.take((row, cable)))
        owner, free, arms = suspension.owner[suspension.of_cables], suspension.free, equilibrium.arms
        # by both lengthenings of each cable; on the ground in the last place
        loads = np.zeros((len(stiffness), len(present), 2, len(free) + 1, 6))
        force = times(stiffness[row, cable][:, None], longer)
        for end, sign in ((0, -1.0), (1, 1.0)):
            moment = cross(arms[row, cable, end][:, None], force)
            at_end = sign * np.concatenate([force, moment], axis=-1)
            np.add.at(loads, (row, cable, slice(None), owner[cable, end]), at_end)
        on_free = block_stiffness.free_values(suspension, loads[..., :-1, :]).reshape(len(loads), 2 * len(present), -1)
        moved = block_stiffness.displacements(equilibrium.blocks, suspension, np.swapaxes(on_free, -1, -2))
        movements = np.zeros((*equilibrium.position.shape[:-1], 6))
        movements[:, free] = bounded_errors(STUDY.conductor_movement * np.abs(moved).sum(axis=-1))
        return movements

    def _cables(self, rows, stiffness, elongation, length_ratio):
        """`CablesOfCase` of some of the suspensions, from these attributes of `LinearCables` in their cases."""
        mass = self._numbers.cable_mass[rows]
        return CablesOfCase(self._lengths[rows], 1.0 + elongation, stiffness, mass, length_ratio)

    def _solve_reference(self, stiffness, elongation, _):
        """Tensions in the reference state, mean and along cables [N]; its `Equilibrium` and unstretched lengths [m]."""
        numbers, stretch = self._numbers, 1.0 + elongation
        states_length = np.array([kind == "unstretched_length" for kind in numbers.stated])
        linear = replace(
            numbers,
            axial_stiffness=stiffness,
            cable_mass=numbers.cable_mass / stretch,
            value=np.where(states_length, numbers.value * stretch, numbers.value),
        )
        equilibrium, self._problems = self._at_rest(self._scenes, linear)
        tension = np.where(equilibrium.record.converged[:, None], equilibrium.catenary.mean_tension, np.nan)
        return tension, tensions_along(equilibrium.catenary), (equilibrium, equilibrium.lengths / stretch)

    def _solve_cases(self, rows, scenes, reference, *linear):
        """Mean tensions of suspensions in load cases, shape (k, c), and along the cables: see `Conductors`. [N]"""
        at_rest, _ = reference
        tension, groups = np.full(linear[0].shape, np.nan), {}
        along = np.full((*tension.shape, STUDY.conductor_points), np.nan)
        for index, scene in enumerate(scenes):
            groups.setdefault(kind_of_case(scene), []).append(index)
        for indices in groups.values():
            rows_of_group = rows[indices]
            cables = self._cables(rows_of_group, *(array[indices] for array in linear))
            loaded_scenes = [scenes[index].without_lost() for index in indices]
            cables_present = cables_left(at_rest, loaded_scenes[0])
            equilibrium = loaded_state(at_rest.take(rows_of_group), loaded_scenes, cables=cables).equilibrium
            converged = equilibrium.record.converged[:, None]
            of_group = np.where(converged, equilibrium.catenary.mean_tension, np.nan)
            tension[np.ix_(indices, cables_present)] = of_group
            along[np.ix_(indices, cables_present)] = tensions_along(equilibrium.catenary)
        return tension, along


def conductors_of(scenes, at_rest):
    """`SuspendedConductors` of suspensions, with its parameters; None where no cable has permanent elongation."""
    if all(cable.stress_strain is None for scene in scenes for cable in scene.cables.values()):
        return None
    return SuspendedConductors(scenes, at_rest)
