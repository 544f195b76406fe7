"""Reasons why a pose search ended without an equilibrium, in words: a force that is left, or what no cable can have."""

import numpy as np

from cablestudy.cable.vectors import size
from cablestudy.statics import stated, tangent
from cablestudy.statics.descent import DISAGREED, REASONS, UNMET
from cablestudy.statics.fitted_lengths import least_preload
from cablestudy.statics.tolerances import STATICS

MOTIONS = ("along x", "along y", "along z", "about x", "about y", "about z")


def explain(equilibrium):
    """Reason, for an error message, why the search for the equilibrium of a case did not converge.

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
    if record.reason == DISAGREED:  # the last search was under fixed forces of the wind: it leaves no net force to name
        return REASONS[DISAGREED]
    text = f"{REASONS[int(record.reason)]} ({int(record.steps)} steps)"
    detail = _describe_unmet(equilibrium) if record.reason == UNMET else _describe_net_force(equilibrium)
    return f"{text}: {detail}" if detail else text


def _describe_net_force(equilibrium):
    """Text for an error message: the force or moment left unbalanced on a body, as "4600 N m about z are left on disk".

    `equilibrium` is one case. Of several forces the largest one relative to those on its body (the scale of
    `tangent.net_forces`) is named. Under a dead moment, a constant one that the scene prescribes, a body may turn on
    and on. The moment left then depends on where the search was given up, so that the dead moment is named instead.
    """
    suspension, tension = equilibrium.suspension, equilibrium.catenary.max_tension
    net, scale = tangent.net_forces(suspension, equilibrium.rotation, equilibrium.arms, equilibrium.end_forces, tension)
    with np.errstate(over="ignore"):  # the scale is zero where all cables hang loose without gravity
        unbalanced = np.where(suspension.free, np.abs(net / tangent.motion_units(suspension)), 0.0)
        relative = np.nan_to_num(unbalanced / np.maximum(scale, np.finfo(float).tiny)[..., None])
    relative_moment = np.where(suspension.moment.any(axis=-1)[:, None], relative, 0.0)  # on bodies with a dead moment
    relative_moment[:, :3] = 0.0
    if relative_moment.max() > STATICS.wrong_value:
        body = int(relative_moment.max(axis=-1).argmax())
        moment = f"{size(suspension.moment[body]):.4g} N m on {suspension.body_names[body]}"
        return f"the dead moment of {moment} may be more than the cables can hold"
    body, motion = divmod(int(relative.argmax()), 6)
    force = f"{abs(net[body, motion]):.4g} {'N' if motion < 3 else 'N m'}"
    return f"{force} {MOTIONS[motion]} are left on {suspension.body_names[body]}"


def _describe_unmet(equilibrium):
    """Text on the cable farthest from its stated value, with its least preload if that is more; empty without one."""
    suspension, cables = equilibrium.suspension, equilibrium.catenary
    actual = stated.actual_values(cables, suspension.stated)
    error = np.nan_to_num(np.abs(actual / suspension.value - 1))
    cable = int(error.argmax())
    if error[cable] < STATICS.wrong_value:
        return ""
    kind, value, name = suspension.stated[cable], suspension.value[cable], suspension.cable_names[cable]
    unit = "m" if kind in ("sag", "unstretched_length") else "N"
    text = f"{name} has a {kind} of {actual[cable]:.4g} {unit} instead of {value:.4g} {unit}"
    if error[cable] < STATICS.nearly_right_value:
        text = f"the {kind} of {name} comes within {error[cable]:.0e} of {value:.4g} {unit}"
    least = least_preload(cables.span)[cable]
    if kind == "preload" and value < least:
        text += f"; its own weight gives it at least {least:.4g} N there"
    return text
