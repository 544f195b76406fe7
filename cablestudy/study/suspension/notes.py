"""Notes on a suspension: what was modelled, and what each cable was given."""

import numpy as np

from cablestudy.scene.words import counted, first_of
from cablestudy.study.ssm import DAMPING_NOTES

LISTED = 12  # cables, or runs of modes, that are named one by one
LEAST = 1e-16  # net force over the forces: what is less is rounding


def notes_of(case):
    """Lines for --explain.

    Parameters
    ----------
    case : SuspensionCase

    Returns
    -------
    tuple of str
        Empty where the case has no equilibrium, or none was computed.
    """
    if not case.solved:
        return ()
    found = case.equilibrium
    record, free = found.record, int(found.suspension.free.sum())
    residual = float(record.residual)
    shown = f"{residual:.1e}" if residual > LEAST else f"below {LEAST:g}"
    return (
        f"statics: {counted(len(found.suspension.cable_names), 'cable')} in closed form, "
        f"{counted(free, 'free displacement')}; {counted(int(record.steps), 'Newton step')}, "
        f"net force {shown} of the forces",
        *_of_slack(found),
        *(line for modes in case.largest_modes for line in _of_modes(modes)),
    )


def _of_slack(found):
    """Cables that hang by their own weight: the mean tension is below it."""
    span, tension = found.catenary.span, np.asarray(found.catenary.mean_tension)
    slack = np.flatnonzero((np.asarray(span.chord_strain) < 0) & (tension < span.weight))
    if len(slack):
        yield f"slack: {first_of([found.suspension.cable_names[place] for place in slack], LISTED)}"


def _of_modes(modes):
    """What each cable was given for the coupled modes, and which modes coincide."""
    error = modes.error.max(initial=0.0)
    stated = "" if np.isnan(error) else f"; estimated error {error:.1e}"
    yield f"modes: {len(modes)} of a linear model with {len(modes.shapes)} coordinates{stated}"
    reasons = {}
    for cable in modes.cables:
        reasons.setdefault(cable.reason, []).append(cable.name)
    for reason, names in list(reasons.items())[:LISTED]:
        yield f"{first_of(names, LISTED)}: {reason}"
    for first, last in modes.coincident[:LISTED]:
        yield f"modes {first} to {last} coincide: their motions may be combined at will"
    if len(modes.coincident) > LISTED:
        yield f"and {len(modes.coincident) - LISTED} more runs of modes that coincide"


def damping_notes(scene):
    """Which damping is assumed, and how a state space represents that of the cables: lines."""
    cables = scene.cables
    silent = [name for name, cable in cables.items() if "damping" not in cable.model_fields_set]
    if silent:
        named = first_of(silent, LISTED) if len(silent) < len(cables) else "the scene"
        damping = cables[silent[0]].damping
        assumed = f"{damping.model}, with a ratio of {100 * damping.ratio:g} %, is assumed"
        yield f"damping: none is given for {named}; {assumed}"
    for law in dict.fromkeys(cable.damping.model for cable in cables.values()):
        yield from DAMPING_NOTES[law]
