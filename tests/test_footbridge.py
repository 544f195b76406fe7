"""The bridge of `cablestudy new footbridge`: equilibrium by hand, and its lowest mode by the string of equal masses."""

import math

import pytest
from command import table_of
from scenes import G, tables_of_new

pytestmark = pytest.mark.usefixtures("folder")
HORIZONTAL, SPACING, BEAM, CLAMP = 35240.0, 6.0, 900.0, 5.0


def tables(*options):
    return tables_of_new("footbridge", ("bodies", "points", "cables"), *options)


def test_the_horizontal_tension_times_the_sag_is_the_moment_of_the_dead_load():
    """About the lowest clamp: the weights left of it, each at its place, against the force of the saddle."""
    bodies, points, cables = tables()
    hangers = [cables[f"hanger_l{k}"]["mass_kg"] for k in range(1, 6)]
    masses = [BEAM / 2 + CLAMP + hanger for hanger in hangers]
    segments = [cables[f"main_l{k}"]["mass_kg"] for k in range(1, 7)]
    whole = (sum(masses) + sum(segments)) * G
    left = G * (masses[0] * 12 + masses[1] * 6 + segments[0] * 15 + segments[1] * 9 + segments[2] * 3)
    sag = 5.0 - points["l3"]["z_m"]
    assert whole / 2 * 18 - left == pytest.approx(HORIZONTAL * sag, rel=1e-4)
    assert 2 * cables["main_l1"]["reaction_1_vertical_N"] == pytest.approx(whole, rel=1e-9)
    for k in range(1, 6):
        assert abs(bodies[f"beam{k}"]["z_m"]) < 0.003  # a level deck
        assert cables[f"hanger_r{k}"]["inclination_from_plumb_deg"] == pytest.approx(0, abs=1e-3)
        assert cables[f"hanger_r{k}"]["reaction_1_horizontal_N"] == 0  # and no rounding of it


def test_the_crowd_is_held_by_the_saddles_and_the_hangers():
    _, _, dead = tables()
    found = table_of("static", "footbridge.yaml", "--table", "cables", "--case", "crowd")
    crowd = {row["name"]: row for row in found}
    more = crowd["main_l1"]["reaction_1_vertical_N"] - dead["main_l1"]["reaction_1_vertical_N"]
    assert 4 * more == pytest.approx(5 * 30e3, rel=1e-9)
    assert crowd["hanger_l2"]["tension_to_N"] - dead["hanger_l2"]["tension_to_N"] == pytest.approx(15e3, rel=1e-3)


def test_people_on_the_left_half_turn_the_beams_to_the_left():
    bodies, _, cables = tables("--case", "left")
    assert bodies["beam3"]["roll_deg"] < 0  # y = 1 m goes down
    own = cables["hanger_l3"]["tension_to_N"] - cables["hanger_r3"]["tension_to_N"]
    assert own == pytest.approx(7500.0, rel=0.02)  # 15 kN at half of the arm of 1 m


def test_the_lowest_mode_is_the_antisymmetric_one_of_a_string_with_equal_masses():
    """w^2 = 4 H/(a m) sin^2(pi k/(2 (n + 1))), n = 5, k = 2 (Rayleigh, Theory of Sound, section 120), of a flat string.

    The sag, a tenth of the span, and the hangers, which swing, raise it by a few per cent.
    """
    _, _, cables = tables()
    mass = BEAM / 2 + CLAMP + cables["main_l3"]["mass_kg"] + cables["hanger_l3"]["mass_kg"]
    flat = math.sqrt(4 * HORIZONTAL / (SPACING * mass)) * math.sin(math.pi / 6) / (2 * math.pi)
    modes = table_of("modes", "footbridge.yaml", "-n", "3")
    assert flat < modes[0]["frequency_Hz"] < 1.08 * flat
    assert modes[0]["moves"].endswith(" z")
