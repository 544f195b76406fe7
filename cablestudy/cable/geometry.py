"""Geometry of a cable in equilibrium, in global axes: lowest point, sag, swing, angles of the chord, clearance.

Functions take a `Catenary`, of one cable or of a batch, or the `State` of the elements of one cable. Places are
measured from end 1. The tension vector is linear along each segment, so that a cable is parallel to a given slope where
a linear function of the arc length vanishes.
"""

import numpy as np

from cablestudy.cable.bracketing import zeros_between
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import NoSolutionError


def points_along(cable, positions):
    """Global coordinates along a cable, from end 1.

    Parameters
    ----------
    cable : Catenary or State
    positions : ndarray, shape (..., j)
        Unstretched arc length over unstretched length. [-]

    Returns
    -------
    ndarray, shape (..., j, 3)
        [m]
    """
    span = cable.span
    local = np.array(cable.displacement_at(positions))
    local[..., 0] += (1 + np.asarray(span.chord_strain))[..., None] * positions
    return span.in_frame(local * np.asarray(span.unstretched_length)[..., None, None], "global")


def lowest_point(cable):
    """Height of the lowest point of a cable above end 1, an end where that is lower, shape (...). [m]"""
    return points_along(cable, cable.extremes(np.array([0.0, 0.0, 1.0])))[..., 2].min(axis=-1)


def reach_beyond_ends(cable):
    """Horizontal distance by which cables reach beyond their ends, along their run; 0 of a vertical chord, (...). [m]

    Loads or a wind that push a steep cable aside may take all of it there. No point of it is then halfway between its
    ends but near one of them, and distances from its chord are those from the chord's line.
    """
    run = cable.span.frame[..., 0, :] * np.array([1.0, 1.0, 0.0])
    horizontal = np.hypot(run[..., 0], run[..., 1])
    upright, length = horizontal <= CABLE.distance_rounding, horizontal * cable.span.chord
    normal = run / np.where(upright, 1.0, horizontal)[..., None]
    along = (points_along(cable, cable.extremes(normal)) * normal[..., None, :]).sum(axis=-1)
    beyond = np.maximum(0.0, np.maximum(along.max(axis=-1) - length, -along.min(axis=-1)))
    return np.where(upright, 0.0, beyond)


def midspan(cable, upright=0.5):
    """Place of mid-span along a cable: the point halfway, horizontally, between its ends, where sag is measured.

    Parameters
    ----------
    cable : Catenary or State
        Equilibrium in closed form, or by finite elements.
    upright : float or ndarray, shape (...)
        Place where the chord is vertical. [-]

    Returns
    -------
    ndarray, shape (...)
        Arc length of this point over the unstretched length. [-]

    Notes
    -----
    Of a `Catenary` whose uniform load is vertical, `midspan.arc_length_at_midspan` gives more digits.
    """
    chord = cable.span.frame[..., 0, :2] * np.asarray(cable.span.chord)[..., None]
    run = np.hypot(chord[..., 0], chord[..., 1])  # horizontal distance of the ends
    along_run = chord / np.where(run > 0, run, 1.0)[..., None]
    position = np.array(np.broadcast_to(upright, run.shape), dtype=float)

    def beyond_half(trial, index):
        """Horizontal distance from mid-span to some of the cables at an arc length, positive towards end 2. [m]"""
        position.flat[index] = trial
        beyond = (points_along(cable, position[..., None])[..., 0, :2] * along_run).sum(axis=-1) - run / 2
        return beyond.flat[index]

    # others have no run to halve, except for rounding
    sloping = np.flatnonzero(run > CABLE.upright_chord * np.asarray(cable.span.chord))
    position.flat[sloping] = zeros_between(beyond_half, np.zeros(len(sloping)), np.ones(len(sloping)), sloping)
    return position


def sag_and_swing(cable, position):
    """Sag of a cable below the middle of its chord, and angle by which a side wind swings it out of the vertical plane.

    Parameters
    ----------
    cable : Catenary or State
        Equilibrium in closed form, or by finite elements; of one cable or, with leading axes `...`, of several.
    position : ndarray, shape (...)
        Arc length at mid-span over unstretched length, see `midspan`. [-]

    Returns
    -------
    sag : ndarray, shape (...)
        Vertical distance from the middle of the chord down to the cable at mid-span. [m]
    swing : ndarray, shape (...)
        Angle between the vertical and the line from the middle of the chord to the cable there; 0 for a vertical chord.
        [rad]
    """
    span, length = cable.span, np.asarray(cable.span.chord)
    chord = span.frame[..., 0, :] * length[..., None]
    from_chord = points_along(cable, np.asarray(position)[..., None])[..., 0, :] - chord / 2
    run = np.hypot(chord[..., 0], chord[..., 1])  # horizontal distance of the ends
    across = np.stack([-chord[..., 1], chord[..., 0]], axis=-1) / np.where(run > 0, run, 1.0)[..., None]
    sideways = (from_chord[..., :2] * across).sum(axis=-1)
    rounding = CABLE.distance_rounding * length
    sideways = np.where((run > rounding) & (np.abs(sideways) > rounding), sideways, 0.0)
    return -from_chord[..., 2], np.arctan2(np.abs(sideways), np.abs(from_chord[..., 2]))


def chord_angles(chord):
    """Angles of the chords of cables, whatever the direction of the load.

    Parameters
    ----------
    chord : ndarray, shape (..., 3)
        Unit vectors from end 1 to end 2, global axes. [-]

    Returns
    -------
    inclination : ndarray, shape (...)
        Above the horizontal, positive where end 2 is the higher one. [rad]
    from_plumb : ndarray, shape (...)
        Between the chord and the vertical, from 0 to pi/2. [rad]
    """
    run, rise = np.hypot(chord[..., 0], chord[..., 1]), chord[..., 2]
    run, rise = (np.where(np.abs(x) > CABLE.level_chord, x, 0.0) for x in (run, rise))  # rounding is no angle
    return np.arctan2(rise, run), np.arctan2(run, np.abs(rise))


def load_sag(cable):
    """Vertical distance from the chord down to the point load that hangs lowest below it, of one cable. [m]

    Parameters
    ----------
    cable : Catenary or State

    Raises
    ------
    NoSolutionError
        The cable carries no point load.
    """
    span = cable.span
    if not span.load_positions.shape[-1]:
        raise NoSolutionError("the cable carries no point load")
    shares = span.load_positions / span.unstretched_length
    return float(below_chord(cable, shares, points_along(cable, shares)).max())


def below_chord(cable, shares, points):
    """Vertical distance from the chord of one cable down to points on it, shape (k,). [m]

    Parameters
    ----------
    cable : Catenary or State
    shares : ndarray, shape (k,)
        Of the unstretched length. [-]
    points : ndarray, shape (k, 3)
        Their coordinates from end 1. [m]
    """
    span = cable.span
    chord = span.frame[0] * float(span.chord)
    run = np.hypot(*chord[:2])
    if run > CABLE.upright_chord * float(span.chord):  # else at the same share of the length, as for `sag`
        shares = points[:, :2] @ chord[:2] / run**2
    return shares * chord[2] - points[:, 2]


def tensions_at_point_loads(cable, shares):
    """Tension vectors of one cable just before and just after each of its point loads, each pointing towards end 2.

    Parameters
    ----------
    cable : Catenary or State
        Equilibrium in closed form, or by finite elements.
    shares : ndarray, shape (k,)
        Arc lengths of the point loads over the unstretched length. [-]

    Returns
    -------
    ndarray, shape (k, 2, 3)
        On the side of end 1 and on that of end 2 of each load, global axes. [N]
    """
    edges = np.asarray(cable.edges)[1:-1]  # between segments, a point load at each
    segment_before = np.searchsorted(edges, shares - CABLE.coincident_loads)  # the segment that ends at the load
    segment_after = np.searchsorted(edges, shares + CABLE.coincident_loads)  # the segment that begins there
    begin_forces, end_forces = cable.mid_forces - cable.half_changes, cable.mid_forces + cable.half_changes
    both_sides = np.stack([end_forces[segment_before], begin_forces[segment_after]], axis=-2)
    return cable.span.in_frame(both_sides, "global")


def heights_above(points, ground):
    """Vertical distance from points down to the ground, NaN where it is not known, shape (k,). [m]

    Parameters
    ----------
    points : ndarray, shape (k, 3)
        Global coordinates. [m]
    ground : float or sequence of (float, float)
        As of `clearance`.
    """
    if isinstance(ground, float):
        return points[:, 2] - ground
    x, z = np.array(ground, dtype=float).T
    return points[:, 2] - np.interp(points[:, 0], x, z, left=np.nan, right=np.nan)


def clearance(cable, end_1, ground):
    """Least vertical distance from one cable down to the ground; negative where the cable would be below ground. [m]

    Parameters
    ----------
    cable : Catenary or State
        Equilibrium of one cable, in closed form or by finite elements.
    end_1 : sequence of 3 floats
        Place of end 1. [m]
    ground : float or sequence of (float, float)
        A level, or x and z of points between which the ground is straight. [m]

    Raises
    ------
    NoSolutionError
        The cable leaves the range of x where the ground is known.
    """
    if isinstance(ground, float):
        return float(end_1[2] + lowest_point(cable) - ground)
    x, z = np.array(ground, dtype=float).T
    # the distance is least above a corner of the ground, or where the cable is parallel to it, or ends
    slopes = np.diff(z) / np.diff(x)
    candidates = [cable.extremes(np.array(normal)) for normal in ((1.0, 0.0, 0.0), *((-s, 0.0, 1.0) for s in slopes))]
    summits = np.concatenate([[True], np.diff(slopes) < 0, [True]])  # above another corner the distance has no minimum
    candidates.append(_crossings(cable, x[summits] - end_1[0]))
    points = points_along(cable, np.concatenate(candidates)) + np.asarray(end_1)
    low, high = points[:, 0].min(), points[:, 0].max()
    if low < x[0] - 1e-9 * (high - low) or high > x[-1] + 1e-9 * (high - low):  # except for rounding
        raise NoSolutionError(
            f"the ground is known from x = {x[0]:.6g} m to {x[-1]:.6g} m, the cable is from {low:.6g} m to {high:.6g} m"
        )
    return float((points[:, 2] - np.interp(points[:, 0], x, z)).min())


def _crossings(cable, x):
    """Arc lengths at which one cable passes coordinates x from end 1, shape (k,) [m]: shares of its length, (j,)."""
    edges = np.asarray(cable.edges)
    distance = points_along(cable, edges)[:, 0] - x[:, None]
    coordinate, segment = np.nonzero(distance[:, :-1] * distance[:, 1:] < 0)

    def distance_at(share, index):
        return points_along(cable, share)[:, 0] - x[index]

    return zeros_between(distance_at, edges[segment], edges[segment + 1], coordinate)
