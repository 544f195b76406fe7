"""Lengths that follow from what scenes of one cable state of their reference state: a tension, a sag, or a length."""

from functools import partial
from itertools import product

import numpy as np

from cablestudy.cable import initial_length
from cablestudy.errors import NoSolutionError
from cablestudy.study import load_cases
from cablestudy.study.tolerances import STUDY


def chord_strain(span, values, length_ratio=None):
    """Chord strain of each cable in its reference state, and reasons where there is none.

    Parameters
    ----------
    span : Span
        Without point loads, fields of shape (n,).
    values : SceneValues or CaseTable
    length_ratio : ndarray, shape (n,), optional
        Unstretched lengths of the spans over those that the scenes mean. [-]
    """
    strain, reasons = np.zeros(len(values)), {}
    length = values.given("cable.unstretched_length")
    length = length if length_ratio is None else length * length_ratio
    given = np.isfinite(length)
    strain[given] = (span.chord[given] - length[given]) / length[given]
    loaded = values.given("cable.reference.loads") > 0
    states = [(~loaded, span)]
    if loaded.any():
        states.append((loaded, load_cases.with_loads(span, values, of_case=False, length_ratio=length_ratio)))
    for (chosen, state), search in product(states, _searches(values)):
        _search_strain(state, chosen, search, strain, reasons)
    return strain, reasons


def _searches(values):
    """What cables may state instead of a length: values, shape (n,), search of many, search of one or its refusal."""
    found = [(values.given("cable.sag"), initial_length.strains_for_sag, initial_length.no_strain_for_sag)]
    stated = [(values.given("cable.stated_preload"), "mean")]
    places = values.words("cable.tension.at")
    stated += [(np.where(places == at, values.given("cable.stated_tension"), np.nan), at) for at in set(places) - {""}]
    for tension, at in stated:
        many, one = initial_length.strains_for_tension, initial_length.closer_strain_for_tension
        found.append((tension, partial(many, at=at), partial(one, at=at)))
    return found


def _search_strain(span, chosen, search, strain, reasons):
    """Find the chord strain of the chosen cables that state a value; `strain` and `reasons` are filled in."""
    target, search_many, search_one = search
    chosen = np.flatnonzero(chosen & np.isfinite(target))
    if not len(chosen):
        return
    strain[chosen] = search_many(span.take(chosen), target[chosen])
    for case in chosen[~np.isfinite(strain[chosen])].tolist():
        try:
            strain[case] = search_one(span.take(case), target[case])
        except NoSolutionError as error:
            reasons[case], strain[case] = str(error), STUDY.stand_in_strain
