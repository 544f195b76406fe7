"""The cables of scenes as one `Span` with an axis of cases."""

from dataclasses import replace

import numpy as np

from cablestudy.cable import initial_length
from cablestudy.cable.span import Span
from cablestudy.errors import NoSolutionError

STAND_IN_STRAIN = 1e-3  # of a cable that does not exist: taut, so that arrays hold a solvable cable in its place


def spans_of(values):
    """The cables of scenes, their unstretched lengths found where a preload or a sag is given.

    Parameters
    ----------
    values : SceneValues

    Returns
    -------
    span : Span
        Fields of shape (n,); a taut cable takes the place of one that does not exist.
    reasons : dict
        Case -> why its cable does not exist.
    """
    positions, forces = values.loads
    span = Span.between(
        *values.ends,
        values.given("cable.axial_stiffness"),
        values.given("cable.mass_per_length"),
        values.given("gravity"),
        load_positions=positions,
        load_forces=forces,
        chord=values.given("cable.chord_length"),
    )
    strain, reasons = _chord_strain(span, values)
    span = span.with_chord_strain(strain)
    return _loads_on_cable(span, reasons), reasons


def _chord_strain(span, values):
    """Chord strain of each cable, and reasons where there is none."""
    strain, reasons = np.zeros(len(values)), {}
    length = values.given("cable.unstretched_length")
    given = np.isfinite(length)
    strain[given] = (span.chord[given] - length[given]) / length[given]
    for key, search, search_one in (
        ("cable.preload", initial_length.strains_for_tension, initial_length.closer_strain_for_tension),
        ("cable.sag", initial_length.strains_for_sag, initial_length.no_strain_for_sag),
    ):
        target = values.given(key)
        chosen = np.flatnonzero(np.isfinite(target))
        if not len(chosen):
            continue
        strain[chosen] = search(span.take(chosen), target[chosen])
        for case in chosen[~np.isfinite(strain[chosen])].tolist():
            try:
                strain[case] = search_one(span.take(case), target[case])
            except NoSolutionError as error:
                reasons[case], strain[case] = str(error), STAND_IN_STRAIN
    return strain, reasons


def _loads_on_cable(span, reasons):
    """The span with the loads of stand-ins on the cable; adds the cables that end before a load to the reasons."""
    count = span.load_positions.shape[-1]
    if not count:
        return span
    length, last = span.unstretched_length, span.load_positions[:, -1]
    for case in np.flatnonzero(last >= length).tolist():
        reasons.setdefault(case, f"the load at {last[case]:.6g} m is beyond the cable's end, at {length[case]:.6g} m")
    if not reasons:
        return span
    positions, absent = span.load_positions.copy(), list(reasons)
    positions[absent] = length[absent, None] * np.arange(1, count + 1) / (count + 1)
    return replace(span, load_positions=positions)
