"""Modes and models of many rows, each step for all rows together: as many modes as the numbers of each row need."""

import itertools
from dataclasses import replace
from functools import partial

import numpy as np

from cablestudy.activity import doing
from cablestudy.cable.records import concatenate
from cablestudy.errors import known, outcome_of, outcomes, result_of, without_errors
from cablestudy.motion.gust_response import GustResponse
from cablestudy.motion.loop_stability import compute_stability
from cablestudy.motion.plant import Plant
from cablestudy.motion.turbulence import Turbulence
from cablestudy.system.coupled_modes import coupled_modes_of_cases


def search_models(analyses):
    """Find for each of many analyses a model with as many modes as its accuracy needs, and its response to gusts.

    Models with more and more modes are tried (`DynamicAnalysis.sizes_to_try`), until the variances of motions are
    accurate enough. Without wind the first model serves. In each round the models, and their variances, of all analyses
    that need another one are computed together.

    Parameters
    ----------
    analyses : list of DynamicAnalysis

    Returns
    -------
    dict
        Analysis -> (`ClosedLoop`, `GustResponse` or None without wind), or the error that says why there are none.
    """
    found, responses = {}, dict.fromkeys(analyses)  # responses: with the previous model of each analysis
    # analyses that need another model, with the numbers of modes that they try, or the error that there are none
    pending = outcomes(analyses, "sizes_to_try")
    for trial in itertools.count():
        loop_outcomes = closed_loops_of(pending, trial)
        closed_loops = without_errors(loop_outcomes)
        response_outcomes = _responses_with(closed_loops, responses)
        responses = without_errors(response_outcomes)
        found |= loop_outcomes | response_outcomes
        in_wind = ((analysis, response) for analysis, response in responses.items() if response is not None)
        GustResponse.left_out.compute([one for analysis, one in in_wind if not analysis.sizes.surely_suffice(one)])
        larger = {}
        for analysis, response in responses.items():
            closed_loop, sizes = closed_loops[analysis], pending[analysis]
            # no model is larger: this is the last size to try, or there are no more modes
            largest = trial + 1 == len(sizes) or len(closed_loop.modes) < sizes[trial]
            if response is None or largest or analysis.sizes.suffice(response):
                found[analysis] = outcome_of(partial(analysis.with_critical_modes, closed_loop, response))
            else:
                larger[analysis] = sizes
        if not larger:
            break
        pending = larger
    final = [response for _, response in without_errors(found).values() if response is not None]
    for response in final:
        response.together = final
    return found


def _responses_with(closed_loops, previous):
    """Responses to gusts with the models of many analyses, and their variances, computed together.

    `closed_loops` and `previous` are dicts by analysis: its `ClosedLoop`, and its `GustResponse` with its previous,
    smaller model or None. The result has a `GustResponse` for each, None without wind, or the error that says why there
    is none.
    """
    controlled = {one: loop for one, loop in closed_loops.items() if loop.scene.control is not None}
    stated = [analysis.in_wind(loop) for analysis, loop in controlled.items() if loop.gain_is_stated]
    Turbulence.space.compute(known(stated, "turbulence").values())
    compute_stability([closed_loop.stability for closed_loop in controlled.values()])
    responses = {
        analysis: outcome_of(partial(analysis.response_with, closed_loop, previous[analysis]))
        for analysis, closed_loop in closed_loops.items()
    }
    in_wind = [response for response in without_errors(responses).values() if response is not None]
    Plant.stiffness_of_outputs.compute([response.closed_loop.plant for response in in_wind])
    Turbulence.all_variances.compute([response.turbulence for response in in_wind])
    GustResponse.left_out_at_most.compute(in_wind)
    return responses


def closed_loops_of(sizes, trial=0):
    """Build the `ClosedLoop` of each analysis with one of the numbers of modes to try.

    It is a suspension with its control loop, if it has one. The equations of motion of all analyses are computed
    together.

    Parameters
    ----------
    sizes : dict
        Analysis -> numbers of modes that it tries (`DynamicAnalysis.sizes_to_try`), or the error that it has none.
    trial : int
        Index of the number that is taken, from 0.

    Returns
    -------
    dict
        Analysis -> `ClosedLoop`, or the error that says why there is none.
    """
    found = {}
    for analysis, of_analysis in sizes.items():
        found[analysis] = of_analysis
        if not isinstance(of_analysis, Exception):
            doing(f"motion with {of_analysis[trial]} modes")
            found[analysis] = outcome_of(partial(analysis.closed_loop_with, of_analysis[trial]))
    plants = [closed_loop.plant for closed_loop in without_errors(found).values()]
    Plant.motion.compute([plant for plant in plants if not plant.refused])
    return found


def stable_without_loop(closed_loop):
    """The `ClosedLoop`, checked to be stable with the winches at rest; raises the error that came in its place, too."""
    result_of(closed_loop).check_open()
    return closed_loop


def solve_modes(analyses, equilibrium):
    """Compute the modes that many analyses need first, in few calls, and keep them in `DynamicAnalysis.modes`.

    Analyses whose first models agree in number of modes, accuracy, planes and elements (`DynamicAnalysis.first_model`)
    are computed in one call, which costs less than one for each. What these analyses need later is computed for all of
    them as soon as one needs it (`DynamicAnalysis.together`).

    Parameters
    ----------
    analyses : list of DynamicAnalysis
        Of n suspensions with equal names and connections; the dict of modes of each is filled.
    equilibrium : Equilibrium
        Equilibria of these suspensions, shape (n,).
    """
    for analysis in analyses:
        analysis.together = analyses
    for (count, accuracy, planes, elements), indices in _indices_by_first_model(analyses).items():
        group, model = [analyses[index] for index in indices], elements
        damping = [cable.damping for analysis in group for cable in analysis.scene.cables.values()]
        if elements and elements.drag is not None:
            model = replace(elements, drag=concatenate([analysis.model.drag for analysis in group]))
        rows = equilibrium.take(np.array(indices))
        modes_of_group = coupled_modes_of_cases(rows, count, accuracy, damping, planes, damped=True, model=model)
        for analysis, modes in zip(group, modes_of_group, strict=True):
            # the modes with damping, or the error that says why there are none
            result = modes if isinstance(modes, Exception) else outcome_of(lambda modes=modes: modes.damped)
            analysis.modes[count] = result


def _indices_by_first_model(analyses):
    """Indices of analyses whose first modes are not known, of each first model: dict of `first_model` -> list of int.

    Of analyses that share their dict of modes one represents all, the last.
    """
    by_model = {}  # first model -> {id of a dict of modes: index of an analysis that has it}
    for index, analysis in enumerate(analyses):
        count, *_ = analysis.first_model
        if count not in analysis.modes:
            by_model.setdefault(analysis.first_model, {})[id(analysis.modes)] = index
    return {model: list(index_by_dict.values()) for model, index_by_dict in by_model.items()}
