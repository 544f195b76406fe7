"""Meshes along a cable: elements of about equal length, or so many on each piece as waves along it need.

A piece is a part of the cable along which its tension changes smoothly enough for a single element.
"""

import itertools
from functools import lru_cache
from math import ceil

import numpy as np

from cablestudy.cable.catenary import GAUSS_POINTS
from cablestudy.cable.element import Mesh
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import NoSolutionError


def mesh_segments(fractions, elements, order=1, mass="lumped", point_masses=()):
    """Mesh of a cable with a node at each of its k point loads, and elements of about equal length between them.

    Each segment between two loads, or a load and an end, has one element at least. Loads that almost coincide, or are
    almost at an end, do not make a segment.

    Parameters
    ----------
    fractions : ndarray, shape (k + 1,)
        Share of the unstretched length of each segment. [-]
    elements : int
        Total number of elements.
    order : int
        Polynomial order of the elements.
    mass : {"lumped", "consistent", "blended"}
        Mass matrix: diagonal, by exact integration, or the mean of both.
    point_masses : tuple of (float, float)
        For each point mass its position as a share of the unstretched length, and its mass over that of the cable; it
        is put on the nearest edge of an element. [-]

    Returns
    -------
    Mesh

    Raises
    ------
    NoSolutionError
        Fewer elements than segments.
    """
    edges = _without_close(_segment_edges(fractions))
    lengths = np.diff(edges)
    segments = len(lengths)
    if elements < segments:
        raise NoSolutionError(f"{segments - 1} point loads need at least {segments} elements, got {elements}")
    # elements beyond the first one of each segment: whole numbers by the method of the largest remainder
    quota = np.maximum(lengths * elements - 1, 0.0)
    quota *= (elements - segments) / quota.sum() if quota.sum() > 0 else 0.0
    floor = np.floor(quota + 1e-9)  # a whole number less rounding is that number
    counts = 1 + floor.astype(int)
    counts[np.argsort(floor - quota, kind="stable")[: elements - counts.sum()]] += 1
    return mesh_pieces(tuple(edges), tuple(counts.tolist()), order, mass, point_masses)


def pieces(fractions, singularities):
    """Divide a cable into pieces, short where its tension T(s) changes sharply, so that one element suits each piece.

    On a segment T(s) is analytic except for a complex point s0 and its conjugate. A piece is halved if it is longer
    than the distance from its middle to s0 and than `CABLE.shortest_piece`. The error of the polynomials on a piece
    then falls geometrically with their order.

    Parameters
    ----------
    fractions : ndarray, shape (k + 1,)
        Share of the unstretched length of each segment between the k point loads. [-]
    singularities : ndarray of complex, shape (k + 1,)
        s0 of each segment: complex arc length, over the unstretched length, at which T would vanish
        (`Catenary.singularities`). [-]

    Returns
    -------
    tuple of float
        Edges of the pieces over the unstretched length, from 0 to 1. [-]
    """
    edges = [0.0]
    segments = itertools.pairwise(_segment_edges(fractions))
    for segment, singularity in zip(segments, singularities.tolist(), strict=True):
        undecided = [segment]  # intervals (low, high) that may have to be halved, the next one last
        while undecided:
            low, high = undecided.pop()
            middle = (low + high) / 2
            if high - low > max(abs(middle - singularity), CABLE.shortest_piece):
                undecided += [(middle, high), (low, middle)]
            else:
                edges.append(high)
    return tuple(edges)


def edges_of_pieces(catenary, moving):
    """Edges of the `pieces` of each of c cables: list of tuple of float.

    Parameters
    ----------
    catenary : Catenary
        Of shape (c,).
    moving : ndarray of bool, shape (c,)
        False for cables that need no pieces, such as those without mass: each is a single one.
    """
    singularities, fraction = catenary.singularities, catenary.segments.fraction
    loaded = fraction.shape[-1] > 1
    bent = (np.abs(0.5 - singularities) < 1)[:, 0]  # of a cable without loads
    divided = (bent | loaded) & moving
    return [pieces(fraction[i], singularities[i]) if divided[i] else (0.0, 1.0) for i in range(len(divided))]


def mesh_by_waves(catenary, cable, edges, elements, order, point_masses=()):
    """`Mesh` of one cable in pieces with as many elements on each as the time demands that a wave takes along it.

    Parameters
    ----------
    catenary : Catenary
        Of shape (c,).
    cable : int
        Index of the cable.
    edges : tuple of float
        Edges of its pieces.
    elements : int
        Number of elements of the piece that a wave takes longest to pass; the others have at least one.
    order : int
    point_masses : tuple
        See `Mesh`.
    """
    shares = [1.0] * (len(edges) - 1)
    if len(shares) > 1 and elements > 1:
        shares = _travel_shares(catenary.take(cable), edges)
    counts = tuple(ceil(elements * share - 1e-9) or 1 for share in shares)  # a whole number and rounding is no more
    return mesh_pieces(edges, counts, order, point_masses=point_masses)


def _travel_shares(catenary, edges):
    """Relative times that a transverse wave takes along the pieces of one cable, by which elements are distributed.

    The wave speed is sqrt(T/m) with the tension T and the mass per length m, so that the time is the integral of
    sqrt(m/T) ds, by Gauss's rule; the longest is 1. `edges` are the n + 1 ends of the n pieces along the cable, shares
    of the unstretched length, ascending from 0 to 1.
    """
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    low, high = np.array(edges[:-1]), np.array(edges[1:])
    positions = (low[:, None] + high[:, None] + (high - low)[:, None] * nodes) / 2
    force = catenary.tension_at(positions.ravel())
    tension = np.maximum(np.sqrt((force**2).sum(axis=-1)), CABLE.least_divisor).reshape(positions.shape)
    time = (high - low) * ((1 / np.sqrt(tension)) @ weights)
    return (time / time.max()).tolist()


@lru_cache(maxsize=256)
def mesh_pieces(edges, counts, order, mass="lumped", point_masses=()):
    """`Mesh` with a number of equal elements for each piece, the same object for the same arguments.

    Parameters
    ----------
    edges : tuple of float, length k + 1
    counts : tuple of int, length k
    point_masses : tuple
        See `Mesh`; each is put on the nearest edge.
    """
    pieces = zip(itertools.pairwise(edges), counts, strict=True)
    element_edges = [low + (high - low) * np.arange(count) / count for (low, high), count in pieces]
    return Mesh(np.array(_without_close([*np.concatenate(element_edges), 1.0])), order, mass, point_masses)


def _segment_edges(fractions):
    """Edges of segments on [0, 1], from the fractions of the k + 1 segments: a list of k + 2 numbers."""
    return [0.0, *np.cumsum(fractions)[:-1].tolist(), 1.0]


def _without_close(edges):
    """Ascending edges on [0, 1] without those closer than `merged_loads` to the one before or to the last one."""
    kept = [0.0]
    for edge in edges[1:-1]:
        if kept[-1] + CABLE.merged_loads < edge < 1 - CABLE.merged_loads:
            kept.append(edge)
    return [*kept, 1.0]
