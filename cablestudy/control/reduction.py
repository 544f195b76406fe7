"""Which modes to keep, and what leaving the others out costs."""

from dataclasses import replace

import numpy as np

ENDS = 6


def truncated(model, chosen):
    """The paper's plain truncation: D stays K11 of all modes, so that the static stiffness is wrong.

    Parameters
    ----------
    model : Superelement
        With all modes.
    chosen : ndarray of int

    Returns
    -------
    Superelement
        With `stiffness` and `inertia` as the truncation has them.
    """
    kept = model.select(chosen)
    scaled = kept.participation / kept.omega[:, None]
    carried = scaled / kept.omega[:, None]
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
        inertia=model.residual_inertia + carried.T @ carried,
        strain=strain,
    )


def share_omitted(model, rows, columns):
    """What each mode carries of the inertia between movements of the ends: |m_r m_c|, relative to all together.

    Parameters
    ----------
    model : Superelement
        With all modes.
    rows, columns : sequence of int
        Forces and displacements, of the six.

    Returns
    -------
    ndarray, shape (n,)
        The largest over the pairs; its sum over omitted modes bounds their share in the first term of the response
        that their static part, kept in D, does not cover: |p_r p_c| w^2/W^4. [-]
    """
    carried = np.abs(model.participation) / model.omega[:, None] ** 2
    products = carried[:, rows][:, :, None] * carried[:, columns][:, None, :]
    total = products.sum(axis=0)
    return (products / np.where(total > 0, total, 1.0)).max(axis=(1, 2), initial=0.0)


def fewest(share, allowed):
    """The fewest modes whose omitted rest is at most `allowed`.

    Parameters
    ----------
    share : ndarray, shape (n,)
        See `share_omitted`. [-]
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
    """E, R, S for y instead of the movement about the static shapes, shape (n + 6, n + 6)."""
    strain, turn = model.strain, absolute(model)
    return turn.T @ np.block([[strain.modes, strain.coupling], [strain.coupling.T, strain.ends]]) @ turn


def absolute(model, sign=1):
    """From (y, u) to (q, u), or back with sign -1: q = y - m u."""
    n = len(model.omega)
    turn = np.eye(n + ENDS)
    turn[:n, n:] = sign * model.participation / model.omega[:, None] ** 2
    return turn
