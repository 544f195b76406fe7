"""The modes of a case, to its accuracy."""

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError
from cablestudy.study import notes
from cablestudy.study.case import Case
from cablestudy.study.models import solve_models
from cablestudy.study.refinement import AccuracyNeeds, Search, reference_scene, refine


def modes(case, count=None, upto=None, estimate=False):
    """The modes of a case, to its accuracy.

    Parameters
    ----------
    case : Case
    count : int, optional
        How many, from the lowest; fewer when a fixed model has no more.
    upto : float, optional
        All up to this frequency instead. [Hz]
    estimate : bool
        Whether the error of fixed elements is to be estimated, for the notes.

    Returns
    -------
    case : Case
        With the discretisation that was used.
    modes : Modes
    notes, warnings : tuple of str

    Raises
    ------
    NoSolutionError, ConvergenceError
    """

    def found_by(other):
        if upto is not None:
            found = other.dynamics.up_to(upto)
            return found.first(int(np.searchsorted(found.frequency, upto, side="right")))
        found = other.dynamics.modes(count)
        if other.exact_statics and len(found) < count:
            raise ConvergenceError(f"{count} modes are too many: the finest model has {len(found)}")
        return found.first(count)

    if not case.exact_statics:
        found, (written, warnings) = found_by(case), notes.of_fixed(case)
        return case, found, (*written, *(_about_frequencies(case, found) if estimate else ())), warnings

    def sample(finer, _):
        found = found_by(finer)
        return dict(enumerate(found.frequency.tolist())), dict(enumerate(found.errors.tolist())), {}

    waves = count or 2 * upto * float(case.results.travel_time[case.index])
    needs = AccuracyNeeds(waves, lambda _, values: max(values.values(), default=0.0), single=True)
    search = Search(case, sample, needs)
    refine([search], solve_models)
    for error in search.failures.values():
        raise error
    finer, error = search.used, max(search.errors.values(), default=0.0)
    return finer, found_by(finer), tuple(notes.of_refined(finer, error, search.tried)), notes.strength_warning(case)


def _about_frequencies(case, found):
    """Note on the error of the frequencies of fixed elements, against a finer model."""
    try:
        _, exact, *_ = modes(Case(reference_scene(case.scene)), len(found))
    except CablestudyError as error:
        return (f"motion: the error is not known: {error}",)
    errors = np.abs(found.frequency / exact.frequency - 1)
    worst = int(np.argmax(errors))
    return (f"motion: estimated error {errors[worst]:.1e}, of mode {worst + 1}",)
