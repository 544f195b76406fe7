"""Linear cables in place of conductors with permanent elongation, in scenes of one cable; see `study.conductors`."""

from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.cable.newton import UNDETERMINED
from cablestudy.study import load_cases
from cablestudy.study.conductors import Conductors, LinearCables, distinct_without_case, tensions_along
from cablestudy.study.one_cable.loaded_cables import loaded_cables
from cablestudy.study.one_cable.reference_length import chord_strain
from cablestudy.study.stated_numbers import StatedNumbers


@dataclass(frozen=True)
class EquivalentCables:
    """Linear cables that take the place of n conductors with permanent elongation, one in each scene.

    Attributes
    ----------
    linear : LinearCables
        The n linear cables.
    chord_strain : ndarray, shape (n,)
        Chord strain of the new conductors in the reference state. [-]
    reasons : dict
        Index of a scene -> why there is no such linear cable.
    """

    linear: LinearCables
    chord_strain: np.ndarray
    reasons: dict


def equivalent_cables(values):
    """Find linear cables that replace conductors with permanent elongation in their load cases, for n scenes.

    Such a conductor has a curved stress-strain law and stays longer after creep or a high load. The linear cable that
    replaces it has, in its equilibrium, equal tension, equal length and the slope of its stress-strain curve.

    Parameters
    ----------
    values : StatedNumbers or CaseTable
        Values of n scenes of one cable, all of which have such conductors, or none; a `CaseTable` never has.

    Returns
    -------
    EquivalentCables or None
        None where the cables are linear.
    """
    if values.scenes[0].cable.stress_strain is None:
        return None
    distinct_scenes, indices = distinct_without_case(values.scenes)
    values_without_case = StatedNumbers(distinct_scenes)

    def solve_reference(stiffness, elongation, _):
        """Tensions and state without load case, as `Conductors` asks for them."""
        return _reference_state(values_without_case, stiffness, elongation)

    def solve_cases(chosen, cases, reference, *linear):
        """Tensions in load cases, as `Conductors` asks for them; the mean is NaN without an equilibrium."""
        chord_strains, _ = reference
        cables = LinearCables(*linear, condition=None, strain=None, earlier_errors=None, labels=None)
        loaded = loaded_cables(StatedNumbers(cases), EquivalentCables(cables, chord_strains[chosen], {}))
        catenary = solve(loaded.span)
        exists = catenary.record.converged | (catenary.record.reason == UNDETERMINED)
        exists[list(loaded.reasons)] = False
        return np.where(exists, catenary.mean_tension, np.nan), tensions_along(catenary)

    conductors = Conductors(distinct_scenes, (len(distinct_scenes),), solve_reference, solve_cases, independent=True)
    cables = conductors.equivalent_cables(indices, values.scenes)
    chord_strains, reasons = conductors.reference
    reasons = {index: reasons[row] for index, row in enumerate(indices.tolist()) if row in reasons}
    return EquivalentCables(cables, chord_strains[indices], reasons)


def _reference_state(values, stiffness, elongation):
    """Solve the equilibria of n new conductors without load case, each as a linear cable of given EA and elongation.

    In this reference state each scene states a length, tension or sag, from which the unstretched length follows.

    Parameters
    ----------
    values : StatedNumbers
        Values of the n scenes.
    stiffness : ndarray, shape (n,)
        EA of the linear cables. [N]
    elongation : ndarray, shape (n,)
        Unstretched length of the linear cable over the length of the conductor without tension, minus 1. [-]

    Returns
    -------
    tension : ndarray, shape (n,)
        Mean tension, NaN where there is no such cable. [N]
    along : ndarray, shape (n, t)
        Tension at t Gauss points along each cable, see `tensions_along`. [N]
    state : (ndarray, dict)
        Chord over the length of the conductor without tension, minus 1, shape (n,) [-]; and index of a scene -> why
        there is no such cable.
    """
    span, stretch = load_cases.bare_spans(values), 1.0 + elongation
    span = replace(span, axial_stiffness=stiffness, mass=span.mass / stretch)
    strain, reasons = chord_strain(span, values, stretch)
    with_loads = values.number("cable.reference.loads") > 0
    bare = solve(span.with_chord_strain(strain))
    tension, along = bare.mean_tension, tensions_along(bare)
    if with_loads.any():
        loaded_span = load_cases.with_loads(span, values, of_case=False, length_ratio=stretch).with_chord_strain(strain)
        loaded = solve(loaded_span)
        tension = np.where(with_loads, loaded.mean_tension, tension)
        along = np.where(with_loads[:, None], tensions_along(loaded), along)
    tension = np.where(np.isin(np.arange(len(values)), list(reasons)), np.nan, tension)
    return tension, along, (strain * stretch + elongation, reasons)
