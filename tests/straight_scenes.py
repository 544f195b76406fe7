"""Suspensions on nearly massless cables as plain mappings, for `references.straight_suspension`."""

from copy import deepcopy

import numpy as np
from suspension_cases import case_of

NOTCH = {"frequency": 1.1, "damping_ratio": 0.05, "rolloff_frequency": 10.0, "rolloff_damping_ratio": 1.0}
WIND = {
    "speed": 6.0, "turbulence_intensity": [0.15, 0.12, 0.08], "length_scale": 25.0, "on": "bodies", "mean": False,
}  # fmt: skip


def with_changes(text, **changes):
    """The same with other values, at paths with `__` for a dot."""
    text = deepcopy(text)
    for path, value in changes.items():
        *tables, key = path.split("__")
        place = text
        for table in tables:
            place = place.setdefault(table, {})
        place[key] = deepcopy(value)
    return text


def closed_loop_of(text):
    """`ClosedLoop` of a case, unstable or not, with at most 40 modes."""
    return case_of(text).analysis.closed_loop_of(40)


def cable(time=0.0, stiffness=1e5):
    """The table `cable`."""
    return {"elastic_modulus": 1e8, "area": stiffness / 1e8, "density": 1e-5,
            "damping": {"model": "kelvin_voigt", "time": time}}  # fmt: skip


def platform(time=3e-3, strain=6e-3, stiffness=1e5, **changes):
    """A body of general form on eight cables, with three winches on the ground and one on board."""
    corners = np.array([[s, t, u] for u in (1, -1) for s, t in ((1, 1), (-1, 1), (-1, -1), (1, -1))], dtype=float)
    anchors = corners * [20.0, 15.0, 9.0] + np.linspace(-1, 1, 24).reshape(8, 3)
    angle = np.arctan2(corners[:, 1], corners[:, 0]) + 0.5 * corners.prod(axis=1)
    inside = np.stack([0.7 * np.cos(angle), 0.6 * np.sin(angle), -0.4 * corners[:, 2]], axis=-1)
    lengths = np.linalg.norm(anchors - inside, axis=-1) * (1 - strain)
    body = {
        "at": [0.0, 0.0, 0.0], "mass": 50.0, "center_of_mass": [0.05, -0.03, -0.1],
        "inertia": [4.0, 5.0, 6.0, 0.3, -0.2, 0.1],
        "attachments": {f"a{i}": place.tolist() for i, place in enumerate(inside)},
        "markers": {"focus": [0.1, 0.2, -0.5]},
    }  # fmt: skip
    cables = {
        f"c{i}": {"from": anchor.tolist(), "to": f"gondola.a{i}", "unstretched_length": float(length)}
        for i, (anchor, length) in enumerate(zip(anchors, lengths, strict=True))
    }
    text = {"cable": cable(time, stiffness), "bodies": {"gondola": body}, "cables": cables}
    return with_changes(text, **changes)


FOUR_WINCHES = {"c0": {}, "c1": {}, "c2": {}, "c7": {"end": "to"}}
LOOP = {"measured": ["x", "y", "z"], "gain": 0.4, "notch": NOTCH, "allocation": {"weights": {"c1": 3.0}}}
ACTUATORS = {
    "mass_x": {"at": [0.1, 0.0, 0.2], "axis": [1.0, 0.2, 0.1], "mass": 2.0, "frequency": 0.3, "damping_ratio": 0.4,
               "velocity_gain": 60.0, "position_gain": 20.0, "high_pass": 0.05, "stroke": 1.0, "force": 1e4},
    "mass_z": {"at": [0.0, -0.1, 0.1], "axis": [0.0, 0.0, 1.0], "mass": 1.0, "frequency": 0.5, "damping_ratio": 0.3,
               "velocity_gain": 20.0, "stroke": 1.0, "force": 1e4},
    "wheel": {"axis": [0.0, 0.1, 1.0], "inertia": 0.2, "rate_gain": 3.0, "high_pass": 0.1, "momentum": 1e3,
              "torque": 1e3},
}  # fmt: skip
BODY_WIND = {"area": [0.6, 0.5, 0.4], "drag_coefficient": 1.17, "center_of_pressure": [0.05, -0.1, 0.2]}


def everything(**changes):
    """The platform with wind on it, winches, masses and a wheel."""
    own = {"winches": FOUR_WINCHES, "control": LOOP, "actuators": ACTUATORS, "wind": WIND,
           "bodies__gondola__wind": BODY_WIND}  # fmt: skip
    return platform(**(own | changes))


def one_axis(free=("x",), time=0.0, gravity=0.0, span=10.0, strain=1e-2, mass=20.0, **changes):
    """A body between two cables along x, free in one direction by default: stiffness 2 EA/L along x, 2 T/l across."""
    own = span * (1 - strain)
    body = {"at": [0.0, 0.0, 0.0], "mass": mass, "inertia": [4.0, 5.0, 6.0], "attachments": {"a": [0.0, 0.0, 0.0]},
            "free": list(free)}  # fmt: skip
    cables = {
        "west": {"from": [-span, 0.0, 0.0], "to": "gondola.a", "unstretched_length": own},
        "east": {"from": [span, 0.0, 0.0], "to": "gondola.a", "unstretched_length": own},
    }
    text = {"gravity": gravity, "cable": cable(time), "bodies": {"gondola": body}, "cables": cables}
    return with_changes(text, **changes)


def two_bodies(time=4e-3, strain=6e-3, apart=12.0, **changes):
    """Two bodies in a row along y, each on six cables, and one cable between them; six winches, three on each."""
    text = {"cable": cable(time), "bodies": {}, "cables": {}, "winches": {}}
    corners = [(9, 1, 8), (-8, 2, 9), (-1, -6, 7), (8, -5, -8), (-7, -6, -9), (1, 7, -8)]
    inside = [
        (0.5, 0.3, 0.4),
        (-0.5, 0.2, 0.4),
        (0.1, -0.6, 0.3),
        (0.4, -0.5, -0.4),
        (-0.5, -0.3, -0.5),
        (0.0, 0.6, -0.4),
    ]
    for number, name in enumerate(("first", "second")):
        at = np.array([0.0, number * apart, 0.0])
        places = {f"a{i}": list(place) for i, place in enumerate(inside)} | {"side": [0.0, 0.5 - number, 0.0]}
        text["bodies"][name] = {
            "at": at.tolist(), "mass": 30.0 + 15 * number, "inertia": [3.0, 4.0, 5.0], "attachments": places,
            "center_of_mass": [0.0, 0.02, -0.05],
        }  # fmt: skip
        for i, (corner, place) in enumerate(zip(corners, inside, strict=True)):
            anchor = np.array(corner) + at
            length = float(np.linalg.norm(anchor - at - place)) * (1 - strain)
            key = f"{name[0]}{i}"
            text["cables"][key] = {"from": anchor.tolist(), "to": f"{name}.a{i}", "unstretched_length": length}
    text["cables"]["link"] = {
        "from": "first.side",
        "to": "second.side",
        "unstretched_length": (apart - 1) * (1 - strain),
    }
    return with_changes(text, **changes)
