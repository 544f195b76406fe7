"""Why a pose search ended without an equilibrium, in words: what force is left, or what a cable cannot have."""

import numpy as np

from cablestudy.system import stated, tangent
from cablestudy.system.descent import REASONS, UNMET
from cablestudy.system.rigid import size
from cablestudy.system.tolerances import SYSTEM

MOTIONS = ("along x", "along y", "along z", "about x", "about y", "about z")


def explain(equilibrium):
    """Reason why a case has no equilibrium, of one whose record did not converge.

    Parameters
    ----------
    equilibrium : Equilibrium
        Of one case: where the search ended.

    Returns
    -------
    str
        As "no convergence in the largest number of steps (100 steps): 4600 N m about z are left on disk".
    """
    record = equilibrium.record
    text = f"{REASONS[int(record.reason)]} ({int(record.steps)} steps)"
    detail = _unmet(equilibrium) if record.reason == UNMET else _left(equilibrium)
    return f"{text}: {detail}" if detail else text


def _left(equilibrium):
    """The largest force or moment that nothing balances, or the dead moment that turns a body on and on.

    What is left there when the search is given up depends on the last digits of its beginning: it is not told.
    """
    suspension, tension = equilibrium.suspension, equilibrium.catenary.max_tension
    net, scale = tangent.net_forces(suspension, equilibrium.rotation, equilibrium.arms, equilibrium.end_forces, tension)
    sizes = np.ones_like(net)
    sizes[..., 3:] = tangent.body_sizes(suspension)[..., None]
    with np.errstate(over="ignore"):  # no other force at all, where every cable hangs loose without gravity
        share = np.where(suspension.free, np.abs(net / sizes), 0.0) / np.maximum(scale, np.finfo(float).tiny)[..., None]
    share = np.nan_to_num(share)
    turning = np.where(suspension.moment.any(axis=-1)[:, None], share, 0.0)
    turning[:, :3] = 0.0
    if turning.max() > SYSTEM.wrong_value:
        body = int(turning.max(axis=-1).argmax())
        moment = f"{size(suspension.moment[body]):.4g} N m on {suspension.body_names[body]}"
        return f"the dead moment of {moment} may be more than the cables can hold"
    body, motion = divmod(int(share.argmax()), 6)
    left = f"{abs(net[body, motion]):.4g} {'N' if motion < 3 else 'N m'}"
    return f"{left} {MOTIONS[motion]} are left on {suspension.body_names[body]}"


def _unmet(equilibrium):
    """The cable whose stated value is the farthest from what it has, and the least tension that it can have."""
    suspension, cables = equilibrium.suspension, equilibrium.catenary
    has = stated.values(cables, suspension.given)
    error = np.nan_to_num(np.abs(has / suspension.value - 1))
    cable = int(error.argmax())
    if error[cable] < SYSTEM.wrong_value:
        return ""
    kind, value = suspension.given[cable], suspension.value[cable]
    unit = "m" if kind in ("sag", "unstretched_length") else "N"
    text = f"{suspension.cable_names[cable]} has a {kind} of {has[cable]:.4g} {unit} instead of {value:.4g} {unit}"
    if error[cable] < SYSTEM.nearly_right_value:
        text = f"the {kind} of {suspension.cable_names[cable]} comes within {error[cable]:.0e} of {value:.4g} {unit}"
    least = stated.least_preload(cables.span)[cable]
    if kind == "preload" and value < least:
        text += f"; its own weight gives it at least {least:.4g} N there"
    return text
