"""A scene that is written in another way has the same numbers within stated errors: in the wind and under control too.

None of the ways changes what is described. Of a suspension: a cable cut in two at a junction without mass, a mass on a
cable or at a junction, two cables side by side in place of one, another order of the parts, the mirror image. Of one
cable: what states the length, loads in parts, a load case or what it makes of the cable, the ends in the other order.
"""

import math
from copy import deepcopy
from functools import partial

import numpy as np
import pytest
from command import CONFIGS
from solved import solve

from cablestudy.cable.geometry import points_along
from cablestudy.scene.control_tables import AllocationTable
from cablestudy.scene.load_tables import Load
from cablestudy.scene.scene import load_scene
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.study.suspension.case import SuspensionCase

NAMES = (
    "gondola.z", "gondola.frequency_x", "gondola.share_z", "gondola.damping_ratio_y", "gondola.rms_x", "gondola.rms_rz",
    "gondola.focus.rms_velocity", "gondola.rms_open_loop", "gondola.peak", "d2.rms_tension", "gain_margin",
    "phase_margin", "winch_rms_speed",
)  # fmt: skip
CUT, SHARE = "u1", 0.37
CUTS = (1e-3, 1e-4)  # accuracies


@pytest.fixture(scope="module")
def scene():
    """Carlina's gondola on six cables with winches, whose lengths are stated."""
    scene = load_scene(CONFIGS / "suspensions" / "carlina-net-wind.yaml", ["model.accuracy=1e-3"])[1]
    lengths = SuspensionCase(scene).group.cables.reference_length[0].tolist()
    cables = {
        name: cable.model_copy(update={
            "unstretched_length": length, "axial_stiffness": float(cable.section_axial_stiffness),
            "mass_per_length": float(cable.section_mass), "diameter": float(cable.section_diameter),
            "elastic_modulus": None, "density": None, "area": None, "strength": None,
        })
        for (name, cable), length in zip(scene.cables.items(), lengths, strict=True)
    }  # fmt: skip
    return scene.model_copy(update={"cables": cables, "solve_for": "pose", "tensions": None})


def changed(scene, cables=None, **update):
    """The scene with other cables beside its own, and other tables."""
    return scene.model_copy(update={"cables": scene.cables | (cables or {}), **update})


def cut(scene, mass, accuracy=1e-3):
    """A cable in two parts at a junction of a mass, whose own motion, to the accuracy, would take many more modes."""
    case = SuspensionCase(loaded(scene, mass))
    cable, number = scene.cables[CUT], case.cable(CUT)
    place = (
        case.equilibrium.ends[number, 0] + points_along(case.equilibrium.catenary.take(number), np.array([SHARE]))[0]
    )
    junction = type(scene.points["up1"]).model_validate({"at": place.tolist(), "free": True, "mass": mass})
    first, second = (
        cable.model_copy(update={"unstretched_length": share * cable.unstretched_length, end: "junction"})
        for share, end in ((SHARE, "to"), (1 - SHARE, "from_"))
    )
    model = scene.model.model_copy(update={"accuracy": accuracy})
    return changed(scene, {CUT: first, "second": second}, points=scene.points | {"junction": junction}, model=model)


def loaded(scene, mass):
    """A mass on that cable."""
    return changed(scene, {CUT: scene.cables[CUT].model_copy(update={"loads": (Load(fraction=SHARE, mass=mass),)})})


def doubled(scene):
    """Two cables side by side in place of one, each with half of everything and a winch of half the cost."""
    cable, names = scene.cables[CUT], (CUT, "second")
    half = {name: getattr(cable, name) / 2 for name in ("axial_stiffness", "mass_per_length", "diameter")}
    control = scene.control.model_copy(update={"allocation": AllocationTable(weights=dict.fromkeys(names, 0.5))})
    winches = scene.winches | {"second": scene.winches[CUT]}
    return changed(scene, dict.fromkeys(names, cable.model_copy(update=half)), control=control, winches=winches)


def reversed_parts(scene):
    """All parts in the reverse order."""
    tables = {name: getattr(scene, name) for name in ("points", "bodies", "cables", "winches")}
    return scene.model_copy(update={name: dict(reversed(table.items())) for name, table in tables.items()})


def mirrored(scene):
    """The mirror image, in the vertical plane along x."""

    def image(place):
        return place[0], -place[1], place[2]

    gondola = scene.bodies["gondola"]
    attachments = {name: image(place) for name, place in gondola.attachments.items()}
    points = {name: point.model_copy(update={"at": image(point.at)}) for name, point in scene.points.items()}
    bodies = {"gondola": gondola.model_copy(update={"attachments": attachments})}
    wind = scene.wind.model_copy(update={"direction": -scene.wind.direction})
    return changed(scene, points=points, bodies=bodies, wind=wind)


@pytest.fixture(scope="module")
def own(scene):
    """The row of the scene itself."""
    return solve(scene, *NAMES)


def check_equal(first, second, rounding=0.0):
    """Numbers of two rows are the same within the errors that both state."""
    assert first.status == second.status == "ok"
    for name, value in first.values.items():
        error = (first.errors[name] or 0.0) + (second.errors[name] or 0.0) + rounding
        assert second.values[name] == pytest.approx(value, rel=error), name


@pytest.mark.parametrize(("one", "other"), [
    *((None, partial(cut, mass=1e-9, accuracy=accuracy)) for accuracy in CUTS),
    (lambda scene: loaded(scene, 3.0), lambda scene: cut(scene, 3.0)),
    (None, doubled),
    (None, reversed_parts),
    (None, mirrored),
], ids=[*(f"cut {one}" for one in CUTS), "a mass", "side by side", "reverse order", "mirror image"])  # fmt: skip
def test_what_is_written_differently_is_the_same(scene, own, one, other):
    check_equal(solve(one(scene), *NAMES) if one else own, solve(other(scene), *NAMES), rounding=1e-9)


def test_the_motion_of_a_junction_takes_modes_only_where_it_is_asked_for(scene):
    motion = SuspensionCase(cut(scene, 1e-9, 1e-2)).analysis
    modes, with_points = (len(one.closed_loop.modes) for one in (motion, motion.with_points))
    assert modes == len(SuspensionCase(scene).analysis.closed_loop.modes) < with_points


# a body on three cables that sag by some metres
HUNG = {
    "cable": {"damping": {"loss_factor": 0.02}},
    "bodies": {"eye": {"at": [0, 0, 0], "mass": 17.0, "free": ["x", "y", "z"], "attachments": {"ring": [0, 0, 0]}}},
    "cables": {
        name: {"from": end, "to": "eye.ring", "unstretched_length": length}
        for name, end, length in (("a", [-17.6, 6.5, 7.2], 20.9), ("b", [12.4, 13.1, 6.1], 19.4),
                                  ("c", [2.4, -16.0, 8.5], 18.9))
    },
    "wind": {"speed": 3.0, "direction": 0.3, "turbulence_intensity": [0.15, 0.12, 0.08], "length_scale": 25.0,
             "coherence_decay": 20.0, "on": "cables", "mean": False, "aerodynamic_damping": False},
    "model": {"accuracy": 1e-4},
}  # fmt: skip


def hung(strands):
    """That scene with each cable as several ones side by side, each with its share of everything."""
    section = {"axial_stiffness": 6e6, "mass_per_length": 1.3, "diameter": 0.012}
    shared = HUNG["cable"] | {key: value / strands for key, value in section.items()}
    cables = {f"{name}{k}": cable for name, cable in HUNG["cables"].items() for k in range(strands)}
    return SuspensionScene.model_validate(HUNG | {"cable": shared, "cables": cables})


def test_gusts_along_a_cable_that_sags_are_those_between_two_at_the_same_place():
    """The coherence is that of the distance of two places, along a cable and between two."""
    names = [f"eye.{name}" for name in ("rms_x", "rms_y", "rms_z", "rms", "rms_velocity")]
    one, two = (solve(hung(strands), *names) for strands in (1, 2))
    assert all(one.errors[name] + two.errors[name] < 3e-4 for name in names)
    check_equal(one, two)


# one cable: statics and modes

STATICS_AND_MODES = (
    "preload", "horizontal_tension", "max_tension", "min_tension", "stretched_length", "sag", "lowest_point",
    "load_sag", "deflection", "linear_deflection", "swing", "end_stiffness", "end_stiffness_yy", "end_stiffness_xz",
    "inplane_frequency_1", "inplane_frequency_2", "outofplane_frequency_1", "axial_frequency_1",
)  # fmt: skip
LENGTH, DIAMETER, WARMER, MOVE = 104.0, 0.012, 20.0, 0.3
STRETCH = 1 + 1.2e-5 * WARMER
CASES = {
    "warm": {"temperature": 288.15 + WARMER},
    "ice": {"ice": {"thickness": 0.01, "density": 900.0}},
    "moved": {"moves": {"end_2": [MOVE, 0.0, 0.0]}},
    "visitor": {"loads": [{"fraction": 0.7, "mass": 5.0}]},
    "storm": {"wind": {"speed": 20.0, "direction": 1.2, "air_density": 1.2}},
}


def base(case=None, **cable):
    """A sagging inclined cable with a mass on it, in one of the load cases, with other keys of the cable."""
    own = {
        "ends": [[0.0, 0.0, 0.0], [97.0, 0.0, 31.0]], "unstretched_length": LENGTH, "axial_stiffness": 1e7,
        "mass_per_length": 0.8, "diameter": DIAMETER, "expansion": 1.2e-5, "loads": [{"fraction": 0.3, "mass": 4.0}],
    }  # fmt: skip
    chosen = {} if case is None else {"cases": deepcopy(CASES), "case": case}
    kept = {key: value for key, value in (own | cable).items() if value is not None}
    return {"cable": kept, "model": {"accuracy": 1e-6}, **chosen}


def by_sag():
    """The same cable by its sag, which its load takes part in."""
    return base(unstretched_length=None, sag=solve(base(), "sag").values["sag"], reference={"loads": True})


def in_the_storm_by_pressure():
    """The wind by half of the pressure and a gust factor."""
    scene = base("storm")
    scene["cases"]["storm"]["wind"] = {"pressure": 0.6 * 20.0**2 / 2, "gust_factor": math.sqrt(2), "direction": 1.2}
    return scene


HALVES = [{"at": 0.3 * LENGTH, "mass": 1.0}, {"at": 0.3 * LENGTH, "mass": 3.0}]
ICE_MASS = math.pi * 900.0 * 0.01 * (DIAMETER + 0.01)
WAYS = {
    "by its sag": (base(), by_sag),
    "a mass in two parts": (base(), lambda: base(loads=HALVES)),
    "a force of nothing": (base(), lambda: base(loads=[*base()["cable"]["loads"], {"at": 0.1, "force": [0, 0, 0]}])),
    "ends in the other order": (base(), lambda: base(ends=base()["cable"]["ends"][::-1],
                                                     loads=[{"fraction": 0.7, "mass": 4.0}])),
    "as long as warm": (base("warm"), lambda: base(unstretched_length=LENGTH * STRETCH, mass_per_length=0.8 / STRETCH)),
    "as heavy as with ice": (base("ice"), lambda: base(mass_per_length=0.8 + ICE_MASS)),
    "between the moved ends": (base("moved"), lambda: base(ends=[[0, 0, 0], [97.0 + MOVE, 0, 31.0]])),
    "the load of the case": (base("visitor"), lambda: base(loads=[{"fraction": 0.3, "mass": 4.0},
                                                                  {"fraction": 0.7, "mass": 5.0}])),
    "wind by its pressure": (base("storm"), in_the_storm_by_pressure),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_a_cable_that_is_written_differently_is_the_same(way):
    one, other = WAYS[way]
    check_equal(solve(one, *STATICS_AND_MODES), solve(other(), *STATICS_AND_MODES), rounding=1e-10)
