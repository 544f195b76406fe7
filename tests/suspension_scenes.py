"""Suspensions in equilibrium for the tests of the linear model."""

import numpy as np
from scipy.optimize import least_squares

from cablestudy.cable import catenary
from cablestudy.cable.span import Span
from cablestudy.system.rigid import from_angles
from cablestudy.system.suspension import GROUND, Equilibrium, Suspension

G = 9.81


def suspension(bodies, cables, gravity=G):
    """A `Suspension` from plain tables.

    Parameters
    ----------
    bodies : dict
        name -> dict with `at`, and where they differ from nothing `angles`, `mass`, `center`, `inertia`, `force`,
        `free`; a junction has `junction=True` and comes last.
    cables : list of (end, end, EA, mass per length)
        An end is a place, or (name of a body, place from its reference point in its axes).
    """
    names, parts = list(bodies), list(bodies.values())
    count = len(parts)

    def each(key, default):
        return np.array([np.asarray(part.get(key, default), dtype=float) for part in parts]).reshape(
            count, *np.shape(default)
        )

    def owner(end):
        return names.index(end[0]) if isinstance(end[0], str) else GROUND

    def place(end):
        return end[1] if isinstance(end[0], str) else end

    axes = ("x", "y", "z", "rx", "ry", "rz")
    free = [
        [axis in part.get("free", axes[:3] if part.get("junction") else axes) for axis in axes] for part in parts
    ]
    return Suspension(
        gravity=np.array(gravity),
        body_names=tuple(names),
        position=each("at", np.zeros(3)),
        rotation=from_angles(each("angles", np.zeros(3))),
        mass=each("mass", 0.0),
        center=each("center", np.zeros(3)),
        inertia=each("inertia", np.zeros((3, 3))),
        force=each("force", np.zeros(3)),
        moment=each("moment", np.zeros(3)),
        free=np.array(free, dtype=bool).reshape(count, 6),
        junctions=sum(bool(part.get("junction")) for part in parts),
        cable_names=tuple(f"c{i + 1}" for i in range(len(cables))),
        owner=np.array([[owner(one), owner(two)] for one, two, _, _ in cables]),
        place=np.array([[place(one), place(two)] for one, two, _, _ in cables], dtype=float),
        axial_stiffness=np.array([cable[2] for cable in cables], dtype=float),
        cable_mass=np.array([cable[3] for cable in cables], dtype=float),
        given=("unstretched_length",) * len(cables),
        value=np.full(len(cables), np.nan),
    )


def with_lengths(model, lengths):
    """The bodies where they are, on cables of given unstretched lengths: in equilibrium or not."""
    ends = model.ends(model.position, model.rotation)
    span = Span.between(
        ends[:, 0], ends[:, 1], model.axial_stiffness, model.cable_mass, float(model.gravity), np.asarray(lengths)
    )
    return Equilibrium(model, model.position, model.rotation, catenary.solve(span), None)


def balanced(model, lengths):
    """The equilibrium with the bodies where they are whose lengths are near the given ones: by least squares."""
    free = model.free.ravel()

    def net(factor):
        state = with_lengths(model, lengths * (1 + factor))
        return net_forces(state).ravel()[free]

    scale = np.abs(with_lengths(model, lengths).end_forces).max()
    found = least_squares(lambda factor: net(factor) / scale, np.zeros(len(lengths)), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    state = with_lengths(model, lengths * (1 + found.x))
    assert np.abs(net_forces(state).ravel()[free]).max(initial=0.0) < 1e-9 * scale
    return state


def net_forces(state):
    """Force and moment on each body about its reference point, all loads counted, shape (b, 6)."""
    model = state.suspension
    total = np.zeros((len(model.body_names), 6))
    weight = np.stack([0 * model.mass, 0 * model.mass, -model.mass * model.gravity], axis=-1)
    total[:, :3] = model.force + weight
    for body in range(len(total)):
        total[body, 3:] = model.moment[body] + np.cross(state.rotation[body] @ model.center[body], weight[body])
    for (cable, end), body in np.ndenumerate(model.owner):
        if body != GROUND:
            force = state.end_forces[cable, end]
            total[body, :3] += force
            total[body, 3:] += np.cross(state.arms[cable, end], force)
    return total


def platform(mass=0.3, body=50.0, strain=3e-3, stiffness=4e5, angles=(0.1, -0.05, 0.3), slack=False):
    """A body of general form on eight cables, four up and four down, with an offset center of mass."""
    corners = np.array([[s, t, u] for u in (1, -1) for s, t in ((1, 1), (-1, 1), (-1, -1), (1, -1))], dtype=float)
    anchors = corners * [20.0, 15.0, 9.0] + np.linspace(-1, 1, 24).reshape(8, 3)
    attachments = corners[:, [1, 0, 2]] * [-0.6, 0.5, -0.4]
    cables = [(tuple(a), ("gondola", tuple(b)), stiffness, mass) for a, b in zip(anchors, attachments, strict=True)]
    inertia = np.array([[4.0, 0.3, -0.2], [0.3, 5.0, 0.1], [-0.2, 0.1, 6.0]])
    model = suspension(
        {"gondola": dict(mass=body, center=(0.05, -0.03, -0.1), inertia=inertia, angles=angles)}, cables
    )
    ends = model.ends(model.position, model.rotation)
    chord = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    if slack:
        return balanced(model, chord * 1.004)
    return balanced(model, chord * (1 - strain))
