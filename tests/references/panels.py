"""Quadrature over [0, 1] of functions with a narrow peak at a known place."""

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)


def panels(center, narrow=1e-7):
    """Points and weights on [0, 1], of panels about as long as their distances from a place and from both ends."""
    steps = np.concatenate([[0.0], np.geomspace(narrow, 1.0, 20)])
    edges = np.concatenate([center - steps, center + steps, steps / 2, 1 - steps / 2])
    edges = np.unique(np.clip(edges, 0.0, 1.0))
    middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    return (middle[:, None] + half[:, None] * NODES).ravel(), (half[:, None] * WEIGHTS).ravel()
