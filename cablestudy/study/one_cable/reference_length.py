"""Unstretched lengths of cables by the tension, sag or length that scenes of one cable state in the reference state."""

from functools import partial
from itertools import product

import numpy as np

from cablestudy.cable import initial_length
from cablestudy.errors import NoSolutionError
from cablestudy.study import load_cases
from cablestudy.study.tolerances import STUDY


def chord_strain(span, values, length_ratio=None):
    """Find the unstretched lengths L of n cables, as chord strains e = c/L - 1 with the chord c between the ends.

    A scene states the length itself, or a tension or sag in the reference state, the equilibrium without a load case.
    From a tension or sag the strain is found by a search.

    Parameters
    ----------
    span : Span
        The cables without point loads, fields of shape (n,).
    values : StatedNumbers or CaseTable
        Values of the n scenes.
    length_ratio : ndarray, shape (n,), optional
        Unstretched lengths of `span` over the lengths that the scenes state; by default 1. Different from 1 for linear
        cables in place of conductors. [-]

    Returns
    -------
    strain : ndarray, shape (n,)
        e; `STUDY.stand_in_strain` for a cable in `reasons`. [-]
    reasons : dict
        Index of a scene -> why no length gives the stated tension or sag.
    """
    strain, reasons = np.zeros(len(values)), {}
    length = values.number("cable.unstretched_length")
    length = length if length_ratio is None else length * length_ratio
    states_length = np.isfinite(length)
    strain[states_length] = (span.chord[states_length] - length[states_length]) / length[states_length]
    with_loads = values.number("cable.reference.loads") > 0
    # rows of scenes, and their cables: tension or sag is stated for the cable without its point loads, or with them
    groups = [(~with_loads, span)]
    if with_loads.any():
        groups.append((with_loads, load_cases.with_loads(span, values, of_case=False, length_ratio=length_ratio)))
    for (rows, spans), search in product(groups, _searches(values)):
        _search_strain(spans, rows, search, strain, reasons)
    return strain, reasons


def _searches(values):
    """List the quantities that cables may state instead of a length, each with its searches for the chord strain.

    Returns
    -------
    list of (ndarray, callable, callable)
        Stated values of the n scenes, shape (n,), NaN where there is none; search for many cables; and search
        for one cable with more effort, which may raise NoSolutionError.
    """
    searches = [(values.number("cable.sag"), initial_length.strains_for_sag, initial_length.no_strain_for_sag)]
    tensions = [(values.number("cable.stated_preload"), "mean")]
    positions = values.words("cable.tension.at")
    stated = values.number("cable.stated_tension")
    tensions += [(np.where(positions == at, stated, np.nan), at) for at in set(positions) - {""}]
    for tension, at in tensions:
        search_many, search_one = initial_length.strains_for_tension, initial_length.shorter_strain_for_tension
        searches.append((tension, partial(search_many, at=at), partial(search_one, at=at)))
    return searches


def _search_strain(span, of_state, search, strain, reasons):
    """Find the chord strains (chord over unstretched length, minus 1) of cables with a stated tension, or a stated sag.

    Parameters
    ----------
    span : Span
        The n cables, with their point loads or without.
    of_state : ndarray of bool, shape (n,)
        True for cables whose stated values are for these loads.
    search : tuple
        Stated values, shape (n,), NaN where there is none; search for many cables; and search for one cable,
        which may raise NoSolutionError (`_searches`).
    strain : ndarray, shape (n,)
        The strains found are written into it. [-]
    reasons : dict
        Index of a scene -> why no length gives the stated value; filled in likewise.
    """
    target, search_many, search_one = search
    cases = np.flatnonzero(of_state & np.isfinite(target))
    if not len(cases):
        return
    strain[cases] = search_many(span.take(cases), target[cases])
    for case in cases[~np.isfinite(strain[cases])].tolist():
        try:
            strain[case] = search_one(span.take(case), target[case])
        except NoSolutionError as error:
            reasons[case], strain[case] = str(error), STUDY.stand_in_strain
