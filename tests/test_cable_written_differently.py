"""A scene of one cable that is written in another way has the same numbers within stated errors: statics and modes.

None of the ways changes what hangs there: what states the length, loads in parts, a load case or what it makes of the
cable, the ends in the other order.
"""

import math
from copy import deepcopy

import pytest
from solved import solve

NAMES = (
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
def test_what_is_written_differently_is_the_same(way):
    one, other = WAYS[way]
    first, second = solve(one, *NAMES), solve(other(), *NAMES)
    assert first.status == second.status == "ok"
    for name in NAMES:
        error = first.errors[name] + second.errors[name] + 1e-10
        assert second.values[name] == pytest.approx(first.values[name], rel=error), name
