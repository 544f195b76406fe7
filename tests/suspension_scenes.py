"""Suspensions in equilibrium for the tests of the linear model."""

from dataclasses import replace

import numpy as np
import suspensions

from cablestudy.cable import catenary
from cablestudy.cable.span import Span
from cablestudy.statics import descent, rest
from cablestudy.statics.suspension import Equilibrium

G = 9.81
AXES = ("x", "y", "z", "rx", "ry", "rz")
STANDS = descent.SearchRecord(*(np.array(value) for value in (0, 0.0, 0.0, descent.CONVERGED)))


def suspension(bodies, cables, gravity=G):
    """A `SuspendedSystem` from plain tables, its cables c1, c2, ... of lengths that are not known yet.

    Parameters
    ----------
    bodies : dict
        name -> dict with `at`, and where they differ from nothing `angles`, `mass`, `center`, `inertia`, `force`,
        `free`; a junction has `junction=True` and comes last.
    cables : list of (end, end, EA, mass per length)
        An end is a place, or (name of a body, place from its reference point in its axes).
    """
    parts = [_part(name, **table) for name, table in bodies.items()]
    bodies = len(parts) - sum("junction" in table for table in bodies.values())
    found = suspensions.suspension(parts[:bodies], [suspensions.cable(*one) for one in cables], parts[bodies:], gravity)
    return replace(found, cable_names=tuple(f"c{i + 1}" for i in range(len(cables))))


def _part(name, at=(0, 0, 0), angles=(0, 0, 0), mass=0.0, inertia=None, free=None, junction=False, **other):
    free = (AXES[:3] if junction else AXES) if free is None else free
    part = suspensions.body(name, at, mass, attitude=angles, free=[axis in free for axis in AXES], **other)
    return part | {"inertia": np.zeros((3, 3)) if inertia is None else inertia}


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
