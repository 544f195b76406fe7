"""Conductors that stretch for good, of scenes of one cable; see `study.conductors`."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.study import load_cases
from cablestudy.study.conductors import Conductors, LinearCables, but_for_their_cases, uneven_errors
from cablestudy.study.reference_length import chord_strain
from cablestudy.study.scene_values import SceneValues


@dataclass(frozen=True)
class HangingAlike:
    """Linear cables that take the place of those of n scenes that stretch for good.

    Attributes
    ----------
    rows : ndarray of int, shape (k,)
        Which scenes have them.
    cables : LinearCables
        Of these, shape (k,).
    chord_strain : ndarray, shape (k,)
        Of the new conductors in the reference state. [-]
    reasons : dict
        Place among these -> why there is no such cable.
    """

    rows: np.ndarray
    cables: LinearCables
    chord_strain: np.ndarray
    reasons: dict

    def in_place_of(self, span, values, strain, reasons):
        """Spans with the stiffness of these cables, and `changed` of `load_cases.loaded_spans`, shape (2, n).

        `strain` and `reasons` are filled in.
        """
        stiffness, longer = np.array(span.axial_stiffness), np.array(load_cases.elongation(values))
        stiffness[self.rows], longer[self.rows] = self.cables.stiffness, self.cables.longer
        share = np.ones(len(stiffness))
        share[self.rows] = self.cables.share
        strain[self.rows] = self.chord_strain
        for row in self.rows.tolist():
            reasons.pop(row, None)
        reasons.update((int(self.rows[place]), reason) for place, reason in self.reasons.items())
        return replace(span, axial_stiffness=stiffness), np.array([longer, share])

    def labels_of(self, count):
        """`LinearCables.labels` of all scenes, empty of those with linear cables: ndarray, shape (n,)."""
        labels = np.full(count, "", dtype=object)
        labels[self.rows] = self.cables.labels
        return labels


def hanging_alike(values, results):
    """`HangingAlike` of scenes with conductors that stretch for good; None where there is none.

    Parameters
    ----------
    values : SceneValues or CaseTable
        The latter has no such conductors.
    results : type
        `Results`.
    """
    scenes = getattr(values, "scenes", ())
    rows = [row for row, scene in enumerate(scenes) if scene.cable.stress_strain is not None]
    if not rows:
        return None
    scenes = [scenes[row] for row in rows]
    different, like = but_for_their_cases(scenes)
    known, found = SceneValues(different), {}

    def stated(stiffness, longer, _):
        found["strain"], found["reasons"], tension = _stated(known, stiffness, longer)
        return tension, found["strain"]

    def loaded(chosen, cases, reference, *linear):
        cables = LinearCables(*linear, None, None, None)
        alike = HangingAlike(np.arange(len(chosen)), cables, reference[1][chosen], {})
        hanging = results(SceneValues(cases), alike)
        tension = np.array(hanging.catenary.mean_tension)
        tension[list(hanging.failures)] = np.nan
        return tension

    conductors = Conductors(different, (len(different),), stated, loaded, alone=True)
    cables = conductors.in_their_cases(like, scenes)
    reasons = {place: found["reasons"][row] for place, row in enumerate(like.tolist()) if row in found["reasons"]}
    return HangingAlike(np.array(rows), cables, conductors.reference[1][like], reasons)


def _stated(values, stiffness, longer):
    """New conductors in the reference state: chord strains, of their length without tension there, reasons where there
    is none, and mean tensions [N]."""
    span, warm = load_cases.bare_spans(values), 1.0 + longer
    span = replace(span, axial_stiffness=stiffness, mass=span.mass / warm)
    strain, reasons = chord_strain(span, values, warm)
    loaded = values.given("cable.reference.loads") > 0
    tension = solve(span.with_chord_strain(strain)).mean_tension
    if loaded.any():
        with_loads = load_cases.with_loads(span, values, of_case=False, warm=warm).with_chord_strain(strain)
        tension = np.where(loaded, solve(with_loads).mean_tension, tension)
    tension = np.where(np.isin(np.arange(len(values)), list(reasons)), np.nan, tension)
    return strain * warm + longer, reasons, tension


def uneven_stretch_errors(results):
    """`conductors.uneven_errors` of `Results`, zero of linear cables, shape (n,). [-]"""
    alike, error = results.alike, np.zeros(len(results.values))
    error[alike.rows] = uneven_errors(alike.cables.condition, alike.cables.strain,
                                                 results.catenary.take(alike.rows))  # fmt: skip
    return error
