"""Suspensions for tests, described briefly; numeric values in SI units."""

from dataclasses import replace

import numpy as np

from cablestudy.statics.rigid import from_angles
from cablestudy.statics.suspension import GROUND, SuspendedSystem


def body(name, at, mass, attitude=(0, 0, 0), center=(0, 0, 0), inertia=(1, 1, 1), force=(0, 0, 0), moment=(0, 0, 0),
         free=(True,) * 6):  # fmt: skip
    """A rigid body."""
    return {
        "name": name, "at": at, "mass": mass, "attitude": attitude, "center": center, "inertia": np.diag(inertia),
        "force": force, "moment": moment, "free": free,
    }  # fmt: skip


def point(name, at, mass=0.0, force=(0, 0, 0)):
    """A junction."""
    free = (True, True, True, False, False, False)
    return body(name, at, mass, inertia=(0, 0, 0), force=force, free=free)


def cable(start, end, stiffness, mass=0.0, given="unstretched_length", value=np.nan, density=np.nan):
    """A cable between two ends: a place on the ground (x, y, z), or (name of body, place on it), or the name alone."""
    return {
        "ends": (start, end), "stiffness": stiffness, "mass": mass, "given": given, "value": value, "density": density,
    }  # fmt: skip


def suspension(bodies, cables, points=(), gravity=9.81):
    """A `SuspendedSystem` of one case; bodies, cables and points as the functions above make them."""
    parts = [*bodies, *points]
    names = [part["name"] for part in parts]

    def end(where):
        if isinstance(where, str):
            return names.index(where), (0.0, 0.0, 0.0)
        if isinstance(where[0], str):
            return names.index(where[0]), where[1]
        return GROUND, where

    ends = [[end(where) for where in line["ends"]] for line in cables]

    def stacked(key, rows):
        return np.array([row[key] for row in rows], dtype=float)

    return SuspendedSystem(
        gravity=np.asarray(gravity, dtype=float),
        body_names=tuple(names),
        position=stacked("at", parts),
        rotation=from_angles(stacked("attitude", parts)),
        mass=stacked("mass", parts),
        center=stacked("center", parts),
        inertia=stacked("inertia", parts),
        force=stacked("force", parts),
        moment=stacked("moment", parts),
        free=np.array([part["free"] for part in parts], dtype=bool),
        junctions=len(points),
        cable_names=tuple(f"c{i}" for i in range(len(cables))),
        owner=np.array([[owner for owner, _ in pair] for pair in ends]),
        attachment=np.array([[place for _, place in pair] for pair in ends], dtype=float),
        axial_stiffness=stacked("stiffness", cables),
        cable_mass=stacked("mass", cables),
        stated=tuple(line["given"] for line in cables),
        value=stacked("value", cables),
        force_density=stacked("density", cables),
    )


def with_values(suspension, kind, values):
    """The same suspension whose cables all state `kind`."""
    return replace(suspension, stated=(kind,) * len(suspension.stated), value=np.asarray(values, dtype=float))


def trifilar(count=3, radius=0.8, height=20.0, mass=50.0, below=0.4, stiffness=1e7, line=1e-9, **more):
    """A body on vertical cables whose lengths are such that it hangs at the origin: closed forms at hand."""
    angles = 2 * np.pi * np.arange(count) / count
    places = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(count)], axis=-1)
    tension = mass * 9.81 / count
    length = height / (1 + tension / stiffness)
    return suspension(
        [body("disk", (0, 0, 0), mass, center=(0, 0, -below), **more)],
        [cable(place + np.array([0, 0, height]), ("disk", place), stiffness, line, value=length) for place in places],
    )


def heavy(mass=1e9):
    """A body on six cables of 0.5 kg/m and EA 1e7 N, which 1e9 kg make 160 times as long."""
    rng = np.random.default_rng(7)
    angles = np.pi / 3 * np.arange(6)
    anchors = np.stack([20 * np.cos(angles), 20 * np.sin(angles), np.full(6, 15.0)], axis=-1)
    places = anchors[[1, 1, 3, 3, 5, 5]] * [0.05, 0.05, 0]
    lines = [
        cable(tuple(a), ("b", tuple(p)), 1e7, 0.5, value=24.0 + rng.uniform(-0.2, 0.2))
        for a, p in zip(anchors, places, strict=True)
    ]
    return suspension([body("b", (0, 0, 0), mass, center=(0, 0, -0.2))], lines)


def sagging(seed=3, **more):
    """Two bodies, two junctions and eight cables, sagging and taut, without any symmetry; at rest near its start."""
    rng = np.random.default_rng(seed)
    anchors = [(9, 1, 8), (-8, 5, 9), (-1, -9, 7), (8, -6, 8), (-7, -6, 9)]
    lines = [
        (anchors[0], ("a", (0.4, 0.1, 0.2))), (anchors[1], ("a", (-0.3, 0.3, 0.1))),
        (anchors[2], ("a", (0, -0.4, 0.3))),
        (anchors[3], "p"), ("p", ("b", (0.3, 0.0, 0.2))), (anchors[4], "q"), ("q", ("b", (-0.2, -0.2, 0.3))),
        (("a", (0.1, 0.0, -0.2)), ("b", (0.0, 0.3, 0.1))), ("q", ("a", (0, 0, 0.4))),
        (anchors[1], ("b", (0.1, 0.2, 0.4))),
    ]  # fmt: skip
    bodies = [
        body("a", (0.2, 0.3, 3.0), 40.0, attitude=(0.1, -0.2, 0.3), center=(0.05, -0.02, -0.1), force=(3, -5, 10)),
        body("b", (1.0, -4.0, 2.0), 25.0, attitude=(-0.1, 0.1, 0.0), center=(0, 0.03, -0.08)),
    ]
    points = [point("p", (4.0, -5.0, 4.0), 1.0), point("q", (-3.0, -4.0, 4.5), 0.0, force=(2, 0, 0))]
    whole = suspension(bodies, [cable(*ends, 2e5, 0.3, value=1.0) for ends in lines], points)
    ends = whole.ends(whole.position, whole.rotation)
    chord = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)
    return with_values(whole, "unstretched_length", chord * (1 + rng.uniform(-1e-3, 3e-2, len(chord))))


def turned(one, seed, order=True):
    """One case turned about z by a random angle, its cables in random order; and the rotation.

    Places of the turned one times the rotation matrix are those of `one`.
    """
    rng = np.random.default_rng(seed)
    turn = from_angles(np.array([0, 0, rng.uniform(-np.pi, np.pi)]))
    count = len(one.stated)
    order = rng.permutation(count) if order else np.arange(count)
    attachment = np.where((one.owner == GROUND)[..., None], one.attachment @ turn.T, one.attachment)
    rotates = np.arange(len(one.body_names)) < one.bodies
    by_cable = {
        name: getattr(one, name)[order]
        for name in ("owner", "axial_stiffness", "cable_mass", "value", "force_density", "load_positions",
                     "load_fractions", "load_masses")
        if getattr(one, name) is not None
    }  # fmt: skip
    return replace(
        one,
        position=one.position @ turn.T,
        rotation=np.where(rotates[:, None, None], turn @ one.rotation, one.rotation),
        force=one.force @ turn.T,
        moment=one.moment @ turn.T,
        attachment=attachment[order],
        stated=tuple(one.stated[i] for i in order),
        cable_names=tuple(one.cable_names[i] for i in order),
        **by_cable,
    ), turn


def stacked(cases):
    """Suspensions of one topology as the cases of one, shape (n,); names are those of the first."""
    first = cases[0]
    for one in cases:
        assert one.stated == first.stated
        assert np.array_equal(one.owner, first.owner)
    arrays = {name: np.stack([getattr(one, name) for one in cases]) for name in first._arrays}
    return replace(first, **arrays)
