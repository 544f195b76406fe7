"""The cables of scenes, for the core: all at once where they carry equally many loads."""

import numpy as np

from cablestudy.cable import initial_length
from cablestudy.cable.span import Span, merged_loads
from cablestudy.errors import NoSolutionError


def load_count(scene):
    """At how many places the cable of a scene carries loads. [-]"""
    return len({load.at for load in scene.cable.loads})


def spans_of(scenes):
    """The cables of scenes that carry loads at equally many places.

    Parameters
    ----------
    scenes : sequence of Scene

    Returns
    -------
    span : Span
        Of those that exist, fields of shape (k,).
    there : ndarray of int, shape (k,)
        Which they are.
    reasons : dict
        Index -> why a cable does not exist.
    """
    cables = [scene.cable for scene in scenes]
    merged = [merged_loads((load.at, load.force) for load in cable.loads) for cable in cables]
    span = Span.between(
        np.array([cable.end_1 for cable in cables]),
        np.array([cable.end_2 for cable in cables]),
        np.array([cable.axial_stiffness for cable in cables]),
        np.array([cable.mass_per_length for cable in cables]),
        np.array([scene.gravity for scene in scenes]),
        load_positions=np.array([[place for place, _ in loads] for loads in merged]),
        load_forces=np.array([[force for _, force in loads] for loads in merged]).reshape(len(cables), -1, 3),
        chord=np.array([cable.chord_length for cable in cables]),
    )
    strain, reasons = _chord_strain(span, cables)
    span = span.with_chord_strain(strain)
    length = span.unstretched_length
    last = span.load_positions.max(axis=-1, initial=-np.inf)
    for index in np.flatnonzero(last >= length):
        reasons[index] = f"the load at {last[index]:.6g} m is beyond the cable's end, at {length[index]:.6g} m"
    there = np.array([index for index in range(len(cables)) if index not in reasons], dtype=int)
    return span.take(there), there, reasons


def _chord_strain(span, cables):
    """Chord strains, and reasons for those that there are none of."""
    strain, reasons = np.zeros(len(cables)), {}
    length = _given(cables, "unstretched_length")
    chosen = np.flatnonzero(np.isfinite(length))
    strain[chosen] = (span.chord[chosen] - length[chosen]) / length[chosen]
    for key, batch, single in (
        ("preload", initial_length.strains_for_tension, initial_length.closer_strain_for_tension),
        ("sag", initial_length.strains_for_sag, initial_length.no_strain_for_sag),
    ):
        wanted = _given(cables, key)
        chosen = np.flatnonzero(np.isfinite(wanted))
        if not len(chosen):
            continue
        strain[chosen] = batch(span.take(chosen), wanted[chosen])
        for index in chosen[~np.isfinite(strain[chosen])]:
            try:
                strain[index] = single(span.take(index), wanted[index])
            except NoSolutionError as error:
                reasons[index] = str(error)
    return strain, reasons


def _given(cables, key):
    """A value of each cable, not a number where it is not given."""
    return np.array([getattr(cable, key) for cable in cables], dtype=float)
