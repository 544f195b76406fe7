"""Dense matrices of second order, M z'' + C z' + K z = F: their poles, and what is left of some coordinates."""

import numpy as np


def cross(v):
    """[v x]."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def state_matrix(M, C, K):
    """A of x' = A x with x = (z, z'), shape (2 n, 2 n)."""
    zero = np.zeros_like(M)
    return np.block([[zero, np.eye(len(M))], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])


def poles(M, C, K):
    """Eigenvalues of it, shape (2 n,). [rad/s]"""
    return np.linalg.eigvals(state_matrix(M, C, K))


def condensed(matrix, kept):
    """A matrix for some of its coordinates, the others eliminated, shape (k, k)."""
    inner = np.setdiff1d(np.arange(len(matrix)), kept)
    passed_on = np.linalg.solve(matrix[np.ix_(inner, inner)], matrix[np.ix_(inner, kept)])
    return matrix[np.ix_(kept, kept)] - matrix[np.ix_(kept, inner)] @ passed_on
