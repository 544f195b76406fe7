"""The mean wind on a suspension: forces on bodies and cables, and the equilibrium that they lead to.

With the components u_k of the wind along the axes of a body and its drag areas C_d A_k along them, the force on its
centre of pressure is

    f_k = rho/2 C_d A_k |u| u_k,

in body axes. Of the wind on a cable only the part u_n across its chord counts, and the force per stretched length is
rho/2 C_d d |u_n| u_n, taken as uniform along the cable. Both forces depend on the attitude of bodies and cables, so
an equilibrium is sought under fixed forces, the forces are computed again in that equilibrium, and so on until both
agree. Where that takes many equilibria, or goes back and forth, as for a light body with a large area, the next forces
are combined from several of those before. Undamped modes about the equilibrium take the forces as dead loads, those on
bodies at their centres of pressure, which turn with the bodies. The change of the forces themselves with the attitude
of bodies and cables is the load stiffness of the motion in the wind (`strips`, `gusts.stiffness_of_bodies`).
"""

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from cablestudy.cable.records import take_rows
from cablestudy.cable.steady_drag import Profile
from cablestudy.cable.vectors import size
from cablestudy.statics.descent import DISAGREED, ROUNDED
from cablestudy.statics.equilibria import pose
from cablestudy.statics.tangent import GROUND
from cablestudy.statics.tolerances import STATICS
from cablestudy.wind.tolerances import WIND

LOADS = ("force", "eccentric_loads", "cable_wind")  # fields of a `SuspendedSystem` that the wind changes


@dataclass(frozen=True)
class Drag:
    """Wind, and the drag areas of a suspension; `...` are the axes of cases.

    Attributes
    ----------
    velocity : ndarray, shape (..., 3)
        Mean wind, global axes. [m/s]
    density : ndarray, shape (...)
        Of the air. [kg/m^3]
    cables : ndarray, shape (..., c)
        Drag coefficient times diameter of each cable; zero where the wind on it is left out. [m]
    bodies : ndarray, shape (..., b, 3)
        Drag coefficient times area along each axis of each body and junction. [m^2]
    centers : ndarray, shape (..., b, 3)
        Centres of pressure from the reference points, body axes. [m]
    stretched : bool
        True if the wind acts on the stretched length of a cable, False if on the unstretched length.
    profile : Profile or None
        Change of the pressure of the wind with height; None where there is none.
    """

    velocity: np.ndarray
    density: np.ndarray
    cables: np.ndarray
    bodies: np.ndarray
    centers: np.ndarray
    stretched: bool = True
    profile: Profile | None = None

    def take(self, case):
        """`Drag` of one case."""
        return take_rows(self, case)


def body_forces(drag, rotation):
    """Mean force on each body at its centre of pressure [N], and the arm of that centre [m], global axes.

    Parameters
    ----------
    drag : Drag
    rotation : ndarray, shape (..., b, 3, 3)

    Returns
    -------
    force, arm : ndarray, shape (..., b, 3)
    """
    in_body_axes = (np.swapaxes(rotation, -1, -2) @ drag.velocity[..., None, :, None])[..., 0]
    speed = size(drag.velocity)[..., None, None]
    force = np.asarray(drag.density)[..., None, None] / 2 * drag.bodies * speed * in_body_axes
    return (rotation @ force[..., None])[..., 0], (rotation @ drag.centers[..., None])[..., 0]


def body_loads(drag, position, rotation):
    """Mean force on each body, shape (..., b, 3) [N], and its eccentric load, shape (..., b, 3, 3) [N m].

    `position` has the shape (..., b, 3), `rotation` (..., b, 3, 3); see `SuspendedSystem.eccentric_loads`.
    """
    force, arm = body_forces(drag, rotation)
    if drag.profile is not None:
        force = force * drag.profile.pressure(position + arm)[..., None]
    return force, drag.centers[..., :, None] * force[..., None, :]


def cable_loads(drag, catenary, end_1=None):
    """Mean force per unstretched length on each cable, global axes, shape (..., c, 3). [N/m]

    Parameters
    ----------
    drag : Drag
    catenary : Catenary
        Of shape (..., c).
    end_1 : ndarray, shape (..., c, 3), optional
        Positions of ends 1 of the cables; needed where the wind has a profile only. [m]
    """
    chord = catenary.span.frame[..., 0, :]
    wind = np.broadcast_to(drag.velocity[..., None, :], chord.shape)
    across = wind - chord * (wind * chord).sum(axis=-1, keepdims=True)
    stretch = 1 + catenary.mean_tension / catenary.span.axial_stiffness if drag.stretched else 1.0
    factor = np.asarray(drag.density)[..., None] / 2 * drag.cables * stretch * size(across)
    if drag.profile is not None:
        factor = factor * drag.profile.over(factor.shape[-1]).mean_pressure(catenary, end_1)
    return factor[..., None] * across


def _where_case(mask, values, others):
    """`values` of the cases in a mask, shape (...), and `others` of all other cases; both have the shape (..., any)."""
    return np.where(mask.reshape(mask.shape + (1,) * (np.ndim(others) - mask.ndim)), values, others)


def equilibrium_in_wind(without_wind, drag):
    """Find the equilibrium in the mean wind, with the unstretched lengths of the equilibrium without wind.

    The forces of the wind are computed at one equilibrium, the next equilibrium is found under them, and so on until
    forces and attitude agree.

    Parameters
    ----------
    without_wind : Equilibrium
        With any axes of cases.
    drag : Drag
        With the same axes.

    Returns
    -------
    Equilibrium
        Its record states for each case whether the search failed, or forces and positions do not agree.

    Notes
    -----
    A case has ended where the ends of cables move from one equilibrium to the next by no more than rounding (`agreed`);
    or where these movements fall no longer and are no larger than the uncertainty of the ends due to rounding
    (`rounded`, see `uncertainty.uncertainty_of`); or where no equilibrium was found. Where the wind has a profile,
    `agreed` and `rounded` also require that the loads on the cables are settled.
    """
    lengths = np.asarray(without_wind.lengths)
    suspension = replace(
        without_wind.suspension,
        stated=("unstretched_length",) * lengths.shape[-1],
        value=lengths,
        position=without_wind.position,
        rotation=without_wind.rotation,
    )
    equilibrium, inputs = without_wind, None
    tried = deque(maxlen=WIND.combined_equilibria)  # inputs of the last searches, and those that follow from each
    shape = np.shape(without_wind.record.converged)
    ended, close = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    least_change, reason = np.full(shape, np.inf), np.full(shape, DISAGREED)
    for _ in range(WIND.mean_wind_equilibria):
        new_inputs = _inputs_in_wind(suspension, equilibrium, drag)
        if ended.any():  # a case that has ended keeps its digits while others go on
            new_inputs = {name: _where_case(ended, inputs[name], new) for name, new in new_inputs.items()}
        if inputs:
            tried.append((inputs, new_inputs))
        combines = ~close & ~ended & (len(tried) == tried.maxlen)
        if combines.any():
            combined = _combined_loads(tried)
            new_inputs = new_inputs | {name: _where_case(combines, combined[name], new_inputs[name]) for name in LOADS}
        inputs, previous = new_inputs, equilibrium
        equilibrium = pose(replace(suspension, **inputs))
        change = size(equilibrium.ends - previous.ends).max(axis=(-1, -2))
        settled = _loads_settled(drag, equilibrium, inputs["cable_wind"])
        rounding = STATICS.sum_rounding * STATICS.rounding * np.abs(equilibrium.ends).max(axis=(-1, -2, -3))
        close = change <= rounding
        agreed = close & settled & ~combines  # combined forces may hardly change before they agree with the attitude
        rounded = settled & ~close & (change >= WIND.mean_wind_progress * least_change)
        least_change = np.minimum(least_change, change)
        if (rounded & ~ended).any():  # else the costly uncertainty is not needed
            rounded &= change <= _end_uncertainty(equilibrium)
        failed = ~np.asarray(equilibrium.record.converged)
        new_reason = np.where(rounded & ~failed, ROUNDED, equilibrium.record.reason)
        reason = np.where(~ended & (agreed | rounded | failed), new_reason, reason)
        ended = ended | agreed | rounded | failed
        if ended.all():
            break
    return replace(equilibrium, record=replace(equilibrium.record, reason=reason[()]))


def _inputs_in_wind(suspension, equilibrium, drag):
    """Fields of the `SuspendedSystem` for the next search: loads by the wind on an equilibrium, and the start; dict."""
    force, eccentric = body_loads(drag, equilibrium.position, equilibrium.rotation)
    if suspension.eccentric_loads is not None:
        eccentric = eccentric + suspension.eccentric_loads
    return {
        "force": suspension.force + force,
        "eccentric_loads": eccentric,
        "cable_wind": _cable_loads_at(equilibrium, drag),
        "position": equilibrium.position,
        "rotation": equilibrium.rotation,
    }


def _combined_loads(tried):
    """Loads for the next search, a dict by `LOADS`, from pairs of inputs of searches and inputs that follow from them.

    The loads of each kind count over the largest of them in its case.
    """
    _, last = tried[-1]
    shape = np.shape(last["cable_wind"])[:-2]
    rows = {name: last[name].reshape(*shape, -1) for name in LOADS}
    largest = {name: np.abs(row).max(axis=-1, initial=np.finfo(float).tiny)[..., None] for name, row in rows.items()}

    def flat(inputs):
        """All loads of each case in a row, shape (..., numbers of loads)."""
        return np.concatenate([inputs[name].reshape(*shape, -1) / largest[name] for name in LOADS], axis=-1)

    arguments, values = np.stack([flat(inputs) for inputs, _ in tried]), np.stack([flat(after) for _, after in tried])
    ends = np.cumsum([rows[name].shape[-1] for name in LOADS])
    parts = np.split(next_argument(arguments, values), ends[:-1], axis=-1)
    return {name: (part * largest[name]).reshape(last[name].shape) for name, part in zip(LOADS, parts, strict=True)}


def _cable_loads_at(equilibrium, drag):
    """`cable_loads` of the cables where an equilibrium has them."""
    end_1 = equilibrium.ends[..., equilibrium.suspension.of_cables, 0, :]
    return cable_loads(drag, equilibrium.catenary, end_1)


def _loads_settled(drag, equilibrium, loads):
    """True for cases whose cables hang where a wind with a profile exerts these loads on them; for all without one."""
    if drag.profile is None:
        return np.ones(np.shape(equilibrium.record.converged), dtype=bool)
    change = size(_cable_loads_at(equilibrium, drag) - loads)
    return (change <= WIND.mean_wind_load * size(loads)).all(axis=-1)


def _end_uncertainty(equilibrium):
    """Largest displacement of an end of a cable that rounding leaves undetermined, of each case. [m]"""
    uncertainty = equilibrium.uncertainty.pose
    if not uncertainty.size:
        return np.zeros(np.shape(equilibrium.record.converged))
    translation, rotation = (sizes.max(axis=(-1, -2)) for sizes in (uncertainty[..., :3], uncertainty[..., 3:]))
    arms = np.where(equilibrium.suspension.owner != GROUND, size(equilibrium.arms), 0.0).max(axis=(-1, -2))
    return np.sqrt(3) * (translation + rotation * arms)


# ------------------------------------------------------------------------------ acceleration of a fixed-point iteration


def next_argument(arguments, values):
    """Next argument of a fixed-point iteration by Anderson acceleration, shape (..., n), each case by itself.

    Of some arguments x_i and values g_i = g(x_i) it is the combination sum of a_i g_i, sum of a_i = 1, for which the
    sum of a_i (g_i - x_i) is least: where g is linear this is the argument in their space that is nearest to the fixed
    point, even if the iteration itself would diverge (Anderson, Iterative procedures for nonlinear integral equations,
    Journal of the ACM 12, 1965; Walker and Ni, SIAM Journal on Numerical Analysis 49, 2011).

    Parameters
    ----------
    arguments, values : ndarray, shape (k, ..., n)
        x_i and g(x_i) of k steps, the last one last. The n components of x are of comparable size.
    """
    residual, value = values[-1] - arguments[-1], values[-1]
    changes = np.moveaxis(np.diff(values - arguments, axis=0), 0, -1)  # of the residuals from step to step
    weights = np.linalg.pinv(changes, rcond=STATICS.dependent_steps) @ residual[..., None]
    return value - (np.moveaxis(np.diff(values, axis=0), 0, -1) @ weights)[..., 0]
