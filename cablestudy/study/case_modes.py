"""The modes of a case, to its accuracy."""

from collections import Counter

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError
from cablestudy.study import notes
from cablestudy.study.case import Case
from cablestudy.study.columns import find, relative
from cablestudy.study.models import solve_models
from cablestudy.study.refinement import Refinement, reference_scene, refine
from cablestudy.study.row import evaluate


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
    used, found, search = solved_modes(case, count, upto)
    if search is None:
        written, warnings = notes.of_fixed(case)
        return case, found, (*written, *(about_errors(case, found) if estimate else ())), warnings
    error = max(search.errors.values(), default=0.0)
    return used, found, tuple(notes.of_refined(used, error, search.tried)), notes.strength_warning(case)


def solved_modes(case, count=None, upto=None):
    """The modes of a case to its accuracy, as `modes` but without notes, with the search for the elements.

    Parameters
    ----------
    case, count, upto
        As for `modes`.

    Returns
    -------
    case : Case
    modes : Modes
    search : Refinement or None
        None where the scene fixes the elements.

    Raises
    ------
    NoSolutionError, ConvergenceError
    """

    def modes_with(elements):
        """Modes with the elements of a case of the same scene."""
        if upto is not None:
            found = elements.dynamics.up_to(upto)
            return found.first(int(np.searchsorted(found.frequency, upto, side="right")))
        found = elements.dynamics.modes(count)
        if elements.exact_statics and len(found) < count:
            raise ConvergenceError(f"{count} modes are too many: the finest model has {len(found)}")
        return found.first(count)

    if not case.exact_statics:
        return case, modes_with(case), None

    def sample(finer, _):
        """Frequencies and estimated errors by the number of the mode; no failures."""
        found = modes_with(finer)
        return dict(enumerate(found.frequency.tolist())), dict(enumerate(found.errors.tolist())), {}

    # half-waves along the cable of the highest mode: a first guess of its elements
    waves = count or 2 * upto * float(case.results.travel_time[case.index])
    search = Refinement(case, sample, waves)
    refine([search], solve_models)
    for error in search.failures.values():
        raise error
    return search.used, modes_with(search.used), search


def errors_of(case, found):
    """Estimated relative error of each frequency of a case.

    Where the scene fixes the elements it is the difference from a finer model. A mode is compared with the mode of the
    same number among those of its kind (in-plane, out-of-plane, axial); where loads act out of the cable's plane, and
    no mode is of one kind, with the mode of the same number among all.

    Parameters
    ----------
    case : Case
    found : Modes

    Returns
    -------
    errors : list of float
        None where it is not known. [-]
    reason : str
        Why some are not known.
    """
    if case.exact_statics:
        return found.errors.tolist(), ""
    scene, errors, seen = reference_scene(case.scene), [None] * len(found), Counter()
    if not case.planar:
        try:
            _, finer, *_ = modes(Case(scene), len(found))
        except CablestudyError as error:
            return errors, str(error)
        return (np.abs(found.frequency / finer.frequency - 1) + finer.errors).tolist(), ""
    parts, reason = {True: {}, False: {}}, ""  # axial modes, which need many waves, and the others: place -> column
    for k, kind in enumerate(found.kind):
        seen[kind] += 1
        parts[kind == "axial"][k] = find(f"{kind.replace('-', '')}_frequency_{seen[kind]}")
    for columns in parts.values():
        finer = evaluate(scene, list(columns.values()))
        reason = finer.cells["status"] if finer.failed else reason
        for k, column in columns.items():
            truth = finer.cells[column.header]
            if truth is not None:
                errors[k] = relative(float(found.frequency[k]), truth) + finer.errors[column.header]
    return errors, reason


def about_errors(case, found):
    """Notes on the errors of the frequencies of fixed elements, none of others."""
    if case.exact_statics:
        return ()
    errors, reason = errors_of(case, found)
    return tuple(notes.of_comparison({f"mode {k}": error for k, error in enumerate(errors, 1)}, reason))
