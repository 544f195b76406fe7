"""Suspensions in equilibrium for the tests of the linear model."""

from dataclasses import replace

import numpy as np

from cablestudy.cable import catenary
from cablestudy.cable.span import Span
from cablestudy.statics import descent, rest
from cablestudy.statics.rigid import from_angles
from cablestudy.statics.suspension import GROUND, Equilibrium, SuspendedSystem

G = 9.81
STANDS = descent.SearchRecord(*(np.array(value) for value in (0, 0.0, 0.0, descent.CONVERGED)))


def suspension(bodies, cables, gravity=G):
    """A `SuspendedSystem` from plain tables.

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
    free = [[axis in part.get("free", axes[:3] if part.get("junction") else axes) for axis in axes] for part in parts]
    return SuspendedSystem(
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
        stated=("unstretched_length",) * len(cables),
        value=np.full(len(cables), np.nan),
    )


def with_lengths(model, lengths):
    """The bodies where they are, on cables of given unstretched lengths: in equilibrium or not."""
    ends = model.ends(model.position, model.rotation)
    span = Span.between(
        ends[:, 0], ends[:, 1], model.axial_stiffness, model.cable_mass, float(model.gravity), np.asarray(lengths)
    )
    return Equilibrium(model, model.position, model.rotation, catenary.solve(span), STANDS)


def hung(model, lengths):
    """The equilibrium on cables of given unstretched lengths."""
    if not model.free.any():
        return with_lengths(model, lengths)
    found = rest.pose(replace(model, value=np.asarray(lengths, dtype=float)))
    assert found.stability.stable
    return found


def chords(model):
    """Distances of the ends of the cables."""
    ends = model.ends(model.position, model.rotation)
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)


def platform(mass=0.3, body=50.0, strain=3e-3, stiffness=4e5, **other):
    """A body of general form on eight cables, four up and four down, with an offset center of mass.

    The cables are `strain` shorter than their chords at first.
    """
    corners = np.array([[s, t, u] for u in (1, -1) for s, t in ((1, 1), (-1, 1), (-1, -1), (1, -1))], dtype=float)
    anchors = corners * [20.0, 15.0, 9.0] + np.linspace(-1, 1, 24).reshape(8, 3)
    angle = np.arctan2(corners[:, 1], corners[:, 0]) + 0.5 * corners[:, 0] * corners[:, 1] * corners[:, 2]
    attachments = np.stack([0.7 * np.cos(angle), 0.6 * np.sin(angle), -0.4 * corners[:, 2]], axis=-1)
    cables = [(tuple(a), ("gondola", tuple(b)), stiffness, mass) for a, b in zip(anchors, attachments, strict=True)]
    inertia = np.array([[4.0, 0.3, -0.2], [0.3, 5.0, 0.1], [-0.2, 0.1, 6.0]])
    gondola = {"mass": body, "center": (0.05, -0.03, -0.1), "inertia": inertia, "at": (0.0, 0.0, 0.0)}
    model = suspension({"gondola": gondola | other}, cables)
    return hung(model, chords(model) * (1 - strain))
