"""Which modes of a cable to keep, and the error of leaving the others out."""

from dataclasses import replace

import numpy as np

from cablestudy.system.linear import shares


def truncated(model, chosen):
    """The model with some modes and without the static part and the inertia of the others, as the paper truncates it.

    The absolute amplitude y = q + m u of the others is held at zero; D stays K11 of all modes, so that the static
    stiffness is wrong.

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
    kept, omitted = model.select(chosen), np.setdiff1d(np.arange(len(model.omega)), chosen)
    held, strain, carried = -model.coupling[omitted], kept.strain, kept.carried  # q = -m u
    if strain is not None:
        whole = model.strain
        mixed = held.T @ whole.coupling[omitted]
        strain = replace(
            strain,
            coupling=strain.coupling + whole.modes[np.ix_(chosen, omitted)] @ held,
            ends=strain.ends + mixed + mixed.T + held.T @ whole.modes[np.ix_(omitted, omitted)] @ held,
        )
    if carried is not None:
        moved = np.zeros_like(carried)
        moved[:, len(kept.omega) :] = model.carried[:, omitted] @ held
        carried = carried + moved
    return replace(
        kept,
        stiffness=model.stiffness + held.T @ (model.omega[omitted, None] ** 2 * held),
        inertia=model.inertia - held.T @ held,
        strain=strain,
        carried=carried,
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
    mass = np.abs(model.coupling)
    return shares(mass[:, force] * mass[:, displacement])


def fewest(share, allowed):
    """Indices of the fewest modes, ascending, for which the shares of the omitted ones add up to at most `allowed`.

    Parameters
    ----------
    share : ndarray, shape (n,)
        See `inertia_share`. [-]
    allowed : float
        [-]
    """
    order = np.argsort(share, kind="stable")
    omitted = np.searchsorted(np.cumsum(share[order]), allowed, side="right")
    return np.sort(order[omitted:])
