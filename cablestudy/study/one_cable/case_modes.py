"""Modes of a case, by elements refined to the accuracy that its scene states, or by the elements that it fixes."""

from collections import Counter

import numpy as np

from cablestudy.errors import CablestudyError, ConvergenceError
from cablestudy.study import notes
from cablestudy.study.one_cable.asked_modes import AskedModes
from cablestudy.study.one_cable.elements import solve_elements
from cablestudy.study.refinement import Refinement, refine
from cablestudy.study.tolerances import STUDY
from cablestudy.system.comparison import relative


def modes(case, count=None, upto=None, estimate=False):
    """Compute the lowest modes of a cable, with frequencies to the accuracy of its scene, and notes on the model.

    Parameters
    ----------
    case, count, upto
        As of `solved_modes`, which raises the same errors.
    estimate : bool
        Whether the notes have an estimated error of the frequencies of fixed elements, which costs a second solution.

    Returns
    -------
    case : CableCase
        The same case, with the elements by which the modes are computed.
    modes : Modes
    notes, warnings : tuple of str
        About model and accuracy.
    """
    solved_case, modes_found, search = solved_modes(case, count, upto)
    if search is None:
        written, warnings = notes.of_fixed(case)
        return case, modes_found, (*written, *(notes_on_errors(case, modes_found) if estimate else ())), warnings
    error = max(stated_errors(solved_case, modes_found), default=0.0)
    written = tuple(notes.of_refined(solved_case, error, search.tried))
    return solved_case, modes_found, written, notes.strength_warning(case)


def solved_modes(case, count=None, upto=None):
    """Compute the lowest modes of a cable, and return the search for fine enough elements.

    Parameters
    ----------
    case : CableCase
    count : int, optional
        Number of modes, from the lowest; fewer where a model with a fixed number of elements has no more.
    upto : float, optional
        Compute all modes up to this frequency instead. [Hz]

    Returns
    -------
    case : CableCase
        The same case, with the elements by which the modes are computed.
    modes : Modes
    search : Refinement or None
        Search for the coarsest elements to the accuracy of the scene; None where the scene fixes the elements.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium, or the finest model does not reach the accuracy or lacks modes.
    """

    def modes_with(level):
        """The modes asked for, by a case of the same scene at one level of refinement."""
        if upto is not None:
            computed = level.dynamics.up_to(upto)
            return computed.first(int(np.searchsorted(computed.frequency, upto, side="right")))
        computed = level.dynamics.modes(count)
        if level.exact_statics and len(computed) < count:
            raise ConvergenceError(f"{count} modes are too many: the finest model has {len(computed)}")
        return computed.first(count)

    if not case.exact_statics:
        return case, modes_with(case), None

    def frequencies_of(finer, _):
        """Frequencies and estimated errors by the index of the mode; no failures."""
        computed = modes_with(finer)
        return dict(enumerate(computed.frequency.tolist())), dict(enumerate(computed.errors.tolist())), {}

    # half-waves along the cable of the highest mode: a first guess of its elements
    waves = count or 2 * upto * float(case.results.travel_time[case.index])
    search = Refinement(case, frequencies_of, waves)
    refine([search], solve_elements)
    for error in search.failures.values():
        raise error
    return search.used, modes_with(search.used), search


def frequency_errors(case, modes_of_case):
    """Estimated relative error of the frequency of each mode of a cable.

    Where the scene states an accuracy, the errors are those of its refined model (`stated_errors`). Where the scene
    fixes the number of elements, a frequency f is compared with f_r of a finer model, whose own relative error is e_r:

        error = |f/f_r - 1| + e_r

    A mode is compared with that of the same number among the modes of its kind (in-plane, out-of-plane, axial). Where
    loads act out of the cable's plane, modes are of no kind, and it is compared with that of the same number among all.

    Parameters
    ----------
    case : CableCase
    modes_of_case : Modes
        Its lowest modes.

    Returns
    -------
    errors : list of float
        One for each mode, None where it is not known. [-]
    reason : str
        Message of the failure by which some are not known; empty where there was none.
    """
    if case.exact_statics:
        return stated_errors(case, modes_of_case), ""
    if not case.planar:
        try:
            finer, finer_modes, _ = solved_modes(case.finer, len(modes_of_case))
        except CablestudyError as error:
            return [None] * len(modes_of_case), str(error)
        difference = np.abs(modes_of_case.frequency / finer_modes.frequency - 1)
        return (difference + stated_errors(finer, finer_modes)).tolist(), ""
    numbers, labels = Counter(), []
    for kind in modes_of_case.kind:
        numbers[kind] += 1
        labels.append((numbers[kind], kind, None))
    # axial modes, which need many waves, have a model of their own
    asked = {axial: AskedModes(label for label in labels if (label[1] == "axial") == axial) for axial in (True, False)}
    finer_cases = {axial: case.finer.asking_for(modes) for axial, modes in asked.items()}
    by_drag, errors, reason = float(case.finer.results.mode_error[case.finer.index]), [], ""
    for frequency, label in zip(modes_of_case.frequency.tolist(), labels, strict=True):
        try:
            reference, error = finer_cases[label[1] == "axial"].frequency(*label)
        except CablestudyError as failure:
            errors.append(None)
            reason = str(failure)
        else:
            errors.append(relative(frequency, reference) + error + by_drag)
    return errors, reason


def stated_errors(case, modes_of_case):
    """Relative errors of frequencies about the closed form: of elements and rounding, and of the form itself. List."""
    return (np.maximum(modes_of_case.errors, STUDY.rounding) + case.results.mode_error[case.index]).tolist()


def notes_on_errors(case, modes_of_case):
    """Notes on the errors of the frequencies of fixed elements: tuple of str, empty where they are refined."""
    if case.exact_statics:
        return ()
    errors, reason = frequency_errors(case, modes_of_case)
    return tuple(notes.comparison_notes({f"mode {number}": error for number, error in enumerate(errors, 1)}, reason))
