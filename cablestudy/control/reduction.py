"""Which modes of a cable to keep, and the error of leaving the others out."""

from dataclasses import replace

import numpy as np

ENDS = 6


def truncated(model, chosen):
    """The model with some modes and without the static part of the others, as the paper truncates it.

    D stays K11 of all modes, so that the static stiffness is wrong.

    Parameters
    ----------
    model : Superelement
        With all modes.
    chosen : ndarray of int
        Modes to keep.

    Returns
    -------
    Superelement
        With `stiffness` and `inertia` as the truncation has them.
    """
    kept = model.select(chosen)
    scaled = kept.participation / kept.omega[:, None]
    mass = scaled / kept.omega[:, None]
    strain = kept.strain
    if strain is not None:
        n = len(kept.omega)
        rows = np.concatenate([chosen, len(model.omega) + np.arange(ENDS)])
        back = absolute(kept, -1)
        elastic = back.T @ elastic_matrix(model)[np.ix_(rows, rows)] @ back
        strain = replace(strain, modes=elastic[:n, :n], coupling=elastic[:n, n:], ends=elastic[n:, n:])
    return replace(
        kept,
        stiffness=model.feedthrough - scaled.T @ scaled,
        inertia=model.residual_inertia + mass.T @ mass,
        strain=strain,
    )


def inertia_share(model, force, displacement):
    """Share of each mode in the inertia |p_r p_c|/W^4 between a displacement of the ends and a force there.

    Parameters
    ----------
    model : Superelement
        With all modes.
    force, displacement : int
        Which of the six end forces r and end displacements c.

    Returns
    -------
    ndarray, shape (n,)
        Sums to one. Its sum over omitted modes bounds their share in the lowest term of the response that their
        static part, kept in D, does not cover: |p_r p_c| w^2/W^4. [-]
    """
    mass = np.abs(model.participation) / model.omega[:, None] ** 2
    product = mass[:, force] * mass[:, displacement]
    total = product.sum()
    return product / (total if total > 0 else 1.0)


def fewest(share, allowed):
    """The fewest modes for which the shares of the omitted ones add up to at most `allowed`.

    Parameters
    ----------
    share : ndarray, shape (n,)
        See `inertia_share`. [-]
    allowed : float
        [-]

    Returns
    -------
    ndarray of int
        Ascending.
    """
    order = np.argsort(share, kind="stable")
    omitted = np.searchsorted(np.cumsum(share[order]), allowed, side="right")
    return np.sort(order[omitted:])


def elastic_matrix(model):
    """E, R and S of `Strain` for the absolute coordinates (y, u), shape (n + 6, n + 6)."""
    strain, transform = model.strain, absolute(model)
    return transform.T @ np.block([[strain.modes, strain.coupling], [strain.coupling.T, strain.ends]]) @ transform


def absolute(model, sign=1):
    """Transform from absolute modal coordinates (y, u) to those about the static shapes (q, u): q = y - m u.

    With sign -1 the inverse. Shape (n + 6, n + 6).
    """
    n = len(model.omega)
    transform = np.eye(n + ENDS)
    transform[:n, n:] = sign * model.participation / model.omega[:, None] ** 2
    return transform
