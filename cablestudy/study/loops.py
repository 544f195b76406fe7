"""Gondola and winch loop of cases: what takes iterations is found for many cases at once, and for one as for many."""

from dataclasses import replace

import numpy as np

from cablestudy.control import gondola, winch
from cablestudy.control.winch import Loop, Notch
from cablestudy.errors import CablestudyError
from cablestudy.study.cache import share


def coupled_of(cases):
    """Undamped frequencies of gondola and cable together of some cases.

    Parameters
    ----------
    cases : sequence of Case

    Returns
    -------
    list
        For each case frequencies [Hz] and the gondola's share in them; or the error that says why there are none.
    """
    found, waiting = [None] * len(cases), {}
    for index, case in enumerate(cases):
        try:
            waiting[index] = case.gondola_modes * case.gondola_frequency_static, case.end_inertia
        except CablestudyError as error:
            found[index] = error
    while waiting:
        problems, complete = {}, {}
        for index, (limit, inertia) in list(waiting.items()):
            case = cases[index]
            try:
                modes = case.excited.up_to(limit)
            except CablestudyError as error:
                found[index] = error
                del waiting[index]
                continue
            stiffness, participation = case.end_stiffness_along(0), case.participation(modes)
            problems[index] = case.scene.gondola.mass, stiffness, modes.frequency, participation, inertia
            complete[index] = modes.complete
        for index, solved in zip(problems, gondola.coupled_modes_of(list(problems.values())), strict=True):
            limit, inertia = waiting[index]
            needed = cases[index].gondola_modes * float(solved[0][np.argmax(solved[1])])
            if complete[index] or needed <= 1.5 * limit:
                found[index] = solved
                del waiting[index]
            else:
                waiting[index] = needed, inertia
    return found


def loop_of(case):
    """The winch loop of a case; without a controller its gain is zero.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Loop
    """
    found = _loops_of([case])[0]
    if isinstance(found, Exception):
        raise found
    return found


def loop_at_rest_of(case):
    """The loop of a case with the winch held, also where no gain follows from a margin.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Loop
    """
    return _without_gain(case).at_rest


def prepare(cases, loops=True):
    """Let cases know their coupled modes and their loops, poles and passages with them, by one iteration for all.

    What a case cannot have it says when it is asked. Cases that share a loop share it here too.

    Parameters
    ----------
    cases : sequence of Case
        At most as many as the cache keeps.
    loops : bool
        Whether the loops are needed at all.
    """
    cases = [case for case in cases if case.scene.gondola is not None and case.scene.gondola.mass is not None]
    share(cases, "coupled", coupled_of)
    if loops:
        winch.prepare(share(cases, "loop", _loops_of))


def _loops_of(cases):
    """Loops or errors, as `coupled_of`."""
    found = []
    for case in cases:
        try:
            found.append(_without_gain(case))
        except CablestudyError as error:
            found.append(error)
    # a gain that follows from a margin needs the passages
    asking = [index for index, case in enumerate(cases) if isinstance(found[index], Loop) and _margin(case)]
    winch.prepare([found[index] for index in asking])
    for index in asking:
        try:
            found[index] = found[index].with_margin(_margin(cases[index]).gain_margin)
        except CablestudyError as error:
            found[index] = error
    return found


def _controller(case):
    return case.scene.winch.controller if case.scene.winch else None


def _margin(case):
    """What the gain follows from; None where it is given."""
    controller = _controller(case)
    return None if controller is None or isinstance(controller.gain, float | int) else controller.gain.auto


def _without_gain(case):
    """The loop; where the gain is still to be found it is none."""
    scene, controller = case.scene, _controller(case)
    loop = Loop(
        case.end_model_along_x,
        scene.gondola.mass,
        scene.winch.location if scene.winch else "ground",
        undamped=case.coupled if case.excited.small and case.excited.modes(1).complete else None,  # of all modes
    )
    if controller is None:
        return loop
    gain = float(controller.gain) if isinstance(controller.gain, float | int) else 0.0
    return replace(loop, notch=_notch(case, controller.notch), gain=gain)


def _notch(case, notch):
    if notch is None:
        return None
    frequency = notch.frequency
    if frequency == "coupled":
        frequency = case.gondola_frequency
    elif frequency == "static":
        frequency = case.gondola_frequency_static
    turn = 2 * np.pi
    return Notch(turn * frequency, notch.damping_ratio, turn * notch.rolloff_frequency, notch.rolloff_damping_ratio)
