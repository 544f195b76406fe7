"""Arc length of a catenary at mid-span, halfway along the horizontal between its ends: where its sag is measured."""

import numpy as np

from cablestudy.cable.records import take_rows
from cablestudy.cable.segment import segment_terms
from cablestudy.cable.tolerances import CABLE

EPSILON = float(np.finfo(float).eps)


def arc_length_at_midspan(catenary):
    """Place of mid-span along each cable of a `Catenary`: the point halfway, horizontally, between its ends.

    Returns
    -------
    ndarray, shape (...)
        Arc length of this point over the unstretched length; 1/2 for a vertical cable with horizontal loads, where
        mid-span has no meaning. [-]

    Notes
    -----
    The first part of a segment (between two point loads), of arc length x, spans the horizontal distance

        H x (1/EA + 2 (1 + excess)/S)

    H is the horizontal tension, S the sum of the tensions at both ends of this part, and 2 (1 + excess)/S the mean of
    1/T along it (`segment_terms`); Newton's method within a bracket finds x. Without horizontal loads H is common to
    all segments and cancels: a vertical cable has the limit of an inclined one. (The root finders of
    scipy.optimize.elementwise take four times as long.)
    """
    span, terms, fraction = catenary.span, catenary.terms, catenary.segments.fraction
    stiffness = np.asarray(span.axial_stiffness, dtype=float)[..., None]
    scale = np.maximum(np.abs(terms.horizontal).max(axis=-1, keepdims=True), CABLE.least_divisor)
    relative_horizontal = terms.horizontal / scale
    distance = relative_horizontal * fraction * (1 / stiffness + 2 * (1 + terms.excess) / terms.sum_of_tensions)
    segment_ends = np.cumsum(distance, axis=-1)  # horizontal distances from end 1, to a common factor
    half = segment_ends[..., -1:] / 2  # of mid-span
    segment = np.minimum((segment_ends < half).sum(axis=-1, keepdims=True), segment_ends.shape[-1] - 1)

    def in_segment(values):
        """Values of the segment in which mid-span is, shape (..., 1), from those of all segments."""
        return np.take_along_axis(np.broadcast_to(values, segment_ends.shape), segment, axis=-1)

    length_in_segment = _arc_length_at(
        half - in_segment(segment_ends - distance),
        EPSILON * half,
        in_segment(fraction),
        in_segment(relative_horizontal),
        stiffness,
        np.asarray(span.weight)[..., None],
        np.asarray(span.cosine)[..., None],
        np.asarray(span.sine)[..., None],
        *map(in_segment, catenary.tension),
    )
    position = (in_segment(np.cumsum(fraction, axis=-1) - fraction) + length_in_segment)[..., 0]
    return np.where((np.abs(span.cosine) == 0) & (span.transverse_load > 0), 0.5, position)


def _arc_length_at(target, rounding, length, *properties):
    """Arc length x along a segment at which the cable is at a given horizontal distance from the segment's end 1.

    x is over the length of the cable, from 0 to the `length` of the segment; the distance `target` is over a scale of
    forces, and found to the accuracy `rounding` [1/N]. The properties are the horizontal tension over the same scale,
    EA, the weight of the cable, cosine and sine of the inclination of its chord, and the three components of the
    tension vector at mid-segment, chord frame. All arrays have the shape (..., 1) of the target.
    """
    parts = [np.broadcast_to(values, target.shape).ravel() for values in (target, rounding, length, *properties)]
    low, high, x = np.zeros(target.size), parts[2], parts[2] / 2
    solution, active = np.empty_like(x), np.arange(x.size)
    for _ in range(CABLE.midspan_steps):
        distance, accuracy, length, horizontal, stiffness, weight, cosine, sine, q, n, y = parts
        shift = weight * (x - length) / 2  # of the tension vector, from mid-segment to the middle of the piece up to x
        piece = segment_terms((q + shift * sine, n + shift * cosine, y), weight * x, cosine, sine)
        gap = distance - horizontal * x * (1 / stiffness + 2 * (1 + piece.excess) / piece.sum_of_tensions)
        low, high = np.where(gap > 0, x, low), np.where(gap > 0, high, x)
        slope = np.maximum(horizontal, CABLE.least_divisor) * (
            1 / stiffness + 1 / np.maximum(piece.tensions[1], CABLE.least_divisor)
        )
        trial = x + gap / slope
        trial = np.where((trial > low) & (trial < high), trial, (low + high) / 2)
        trial = np.where(np.abs(gap) > accuracy, trial, x)
        moving = np.abs(trial - x) > 4e-16  # rounding of a share of the length
        solution[active] = x = trial
        if not moving.any():
            break
        if not moving.all():  # nearly vertical cables need more steps than all others
            active, low, high, x, parts = take_rows((active, low, high, x, parts), moving)
    return solution.reshape(target.shape)
