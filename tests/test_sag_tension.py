"""configs/line.yaml and published sag-tension tables of a conductor.

Final sags and tensions of ACSR Drake (795 kcmil, 26/7) by Alcoa's program Sag and Tension: a span of 700 ft is printed
as Table 14.5 in Thrash and others, "Sag and tension of conductor", in Grigsby (ed.), *Electric Power Generation,
Transmission, and Distribution*; one of 1000 ft in Alcoa's sample problem of extra heavy loading. Printed is the tension
halfway between the horizontal one and that at the supports. And ground wires of steel, as a maker's page has them.
"""

import numpy as np
import pytest
from command import CONFIGS, table_of
from scenes import cells, scene_of

pytestmark = pytest.mark.usefixtures("folder")

FOOT, POUND, KILOGRAM_FORCE = 0.3048, 4.4482216152605, 9.80665
WEIGHT = 1.094  # of the bare conductor [lbf/ft]
# (degF, lbf/ft): final sag [ft] and tension [lbf], initial sag and tension; from 167 degF on the aluminium is slack
TABLE_700 = {
    (0, 2.509): (13.61, 11318, 13.55, 11361), (32, 2.094): (13.93, 9224, 13.33, 9643),
    (-20, WEIGHT): (8.22, 8161, 7.60, 8824), (0, WEIGHT): (9.19, 7301, 8.26, 8115),
    (30, WEIGHT): (10.75, 6242, 9.39, 7142), (60, WEIGHT): (12.36, 5429, 10.65, 6300),
    (90, WEIGHT): (13.96, 4809, 11.99, 5596), (120, WEIGHT): (15.52, 4330, 13.37, 5020),
    (167, WEIGHT): (16.97, 3960, 15.53, 4326), (212, WEIGHT): (18.04, 3728, 17.52, 3837),
}  # fmt: skip
TABLE_1000 = {  # stretched by 1.5 in of ice before; from 30 degF on the aluminium is slack
    (0, 5.961): (41.11, 18287, 41.11, 18287), (0, 2.509): (34.86, 9054, 31.53, 10000),
    (32, 2.094): (35.47, 7429, 31.49, 8358), (-20, WEIGHT): (30.11, 4564, 24.72, 5549),
    (0, WEIGHT): (31.25, 4399, 25.84, 5311), (30, WEIGHT): (32.77, 4197, 27.48, 4996),
    (60, WEIGHT): (33.63, 4091, 29.09, 4721), (90, WEIGHT): (34.49, 3990, 30.67, 4482),
    (120, WEIGHT): (35.33, 3896, 32.20, 4271), (167, WEIGHT): (36.64, 3759, 34.51, 3988),
    (212, WEIGHT): (37.87, 3638, 36.64, 3759),
}  # fmt: skip
TAUT = {  # final sag and tension of those rows in which both metals are taut, so that the conductor is linear
    700: {key: row[:2] for key, row in list(TABLE_700.items())[:8]},
    1000: {key: row[:2] for key, row in list(TABLE_1000.items())[1:5]},
}
LINE = """
cable:
  chord: {span} ft
  axial_stiffness: {stiffness} lbf
  mass_per_length: 1.094 lb/ft
  diameter: 1.108 in
  expansion: {expansion} 1/degR
  tension: {{at: horizontal, value: {tension} lbf}}
  reference: {{temperature: 0 degF}}
gravity: 9.80665
cases: {{day: {{temperature: {temperature} degF, ice: {{weight: {ice} lbf/ft}}}}}}
case: day
"""


def by_hand(span, sag, tension, weight):
    """Length over span less one, by the parabola, and the mean tension, of a printed row."""
    flat = sag / span
    return 8 / 3 * flat**2 - 32 / 5 * flat**4, tension - weight * sag / 6


def constants(span, table):
    """EA [lbf] by the rows with and without ice and wind at 0 degF, expansion [1/degF] by the two coldest rows."""
    rows = {key: by_hand(span, *row, key[1]) for key, row in table.items()}
    bare, loaded, cold = rows[0, WEIGHT], rows[0, 2.509], rows[-20, WEIGHT]
    stiffness = (loaded[1] - bare[1]) / (loaded[0] - bare[0])
    return stiffness, (bare[0] - cold[0] - (bare[1] - cold[1]) / stiffness) / 20


def test_both_tables_are_of_one_conductor():
    """So that what one gives may be used for the other: a final modulus of 69.6 GPa, 18.8e-6 1/K."""
    (one, warm_one), (other, warm_other) = (constants(span, table) for span, table in TAUT.items())
    assert one == pytest.approx(other, rel=2e-3)
    assert warm_one == pytest.approx(warm_other, rel=1e-2)


@pytest.mark.parametrize(("span", "other"), [(700, 1000), (1000, 700)])
def test_a_published_sag_tension_table(span, other):
    """One tension of a table, and EA and expansion of the other table, give the whole table to 0.3 %."""
    stiffness, expansion = constants(other, TAUT[other])
    sag, tension = TAUT[span][0, WEIGHT]
    for (temperature, weight), (sag_there, tension_there) in TAUT[span].items():
        text = LINE.format(span=span, stiffness=stiffness, expansion=expansion, tension=tension - WEIGHT * sag / 2,
                           temperature=temperature, ice=weight - WEIGHT)  # fmt: skip
        found = cells(scene_of(text), "sag", "horizontal_tension", "tension_1")
        assert found["sag"] / FOOT == pytest.approx(sag_there, rel=3e-3), (temperature, weight)
        halfway = (found["horizontal_tension"] + found["tension_1"]) / 2 / POUND
        assert halfway == pytest.approx(tension_there, rel=3e-3), (temperature, weight)


def test_ice_of_half_an_inch_weighs_what_is_printed():
    """57 lb/ft^3 around 1.108 in: 2.094 lbf/ft with the conductor."""
    text = LINE.format(span=700, stiffness=7.3e6, expansion=1e-5, tension=7000, temperature=0, ice=0)
    found = cells(scene_of(text, "cases.day.ice={thickness: 0.5 in, density: 57 lb/ft^3}"), "reaction_1_vertical")
    weight = 2 * found["reaction_1_vertical"] / POUND / (700 * (1 - (7000 / 7.3e6)))  # per unstretched length, nearly
    assert weight == pytest.approx(2.094, rel=2e-3)


# Janta Cables, ground wires of seven wires of galvanised steel, jantacable.com/stay-wires-earth-wires-core-wires: mm^2,
# kg/km, kgf at 32 degC; span [m]: sag at 32 degC, tension and sag at 53 degC [m, kgf]
GROUND_WIRES = {
    "7/3.15": (54.55, 428, 1142, {260: (3.17, 1007, 3.59), 275: (3.54, 1013, 3.99), 320: (4.80, 1031, 5.31),
                                  350: (5.74, 1041, 6.30), 380: (6.76, 1050, 7.36), 400: (7.50, 1056, 8.11)}),
    "7/3.66": (73.65, 575, 1627, {260: (2.99, 1430, 3.40), 275: (3.34, 1439, 3.78), 320: (4.52, 1463, 5.03),
                                  350: (5.41, 1477, 5.96), 380: (6.38, 1490, 6.97), 400: (7.07, 1497, 7.68)}),
    "7/4.06": (90.62, 706, 2002, {260: (2.98, 1760, 3.39), 275: (3.33, 1770, 3.77), 320: (4.51, 1800, 5.02),
                                  350: (5.40, 1817, 5.95), 380: (6.37, 1833, 6.95), 400: (7.05, 1842, 7.67)}),
}  # fmt: skip


@pytest.mark.parametrize("name", GROUND_WIRES)
def test_published_tables_of_ground_wires(name):
    """From the tension of one day follow that of a warmer one and all sags, to the last printed digit."""
    area, mass, tension, spans = GROUND_WIRES[name]
    for span, (sag, warm_tension, warm_sag) in spans.items():
        text = f"""
cable:
  chord: {span} m
  area: {area} mm^2
  mass_per_length: {mass} kg/km
  elastic_modulus: {1.933e6 * KILOGRAM_FORCE * 1e4} Pa
  expansion: 11.5e-6
  tension: {{at: horizontal, value: {tension * KILOGRAM_FORCE}}}
  reference: {{temperature: 32 degC}}
gravity: {KILOGRAM_FORCE}
cases: {{warm: {{temperature: 53 degC}}}}
"""
        for sets, sagging, pull in (((), sag, tension), (("case=warm",), warm_sag, warm_tension)):
            found = cells(scene_of(text, *sets), "sag", "horizontal_tension")
            assert found["sag"] == pytest.approx(sagging, abs=0.01)
            assert found["horizontal_tension"] / KILOGRAM_FORCE == pytest.approx(pull, abs=1)


def state_change(change, pull, thickness=0.0):
    """Tension along the chord of configs/line.yaml by the parabola and the state-change equation. [N]

    Of the load per length counts what is across the chord: the weight times its cosine, and all of the wind.
    """
    run, rise = 300.0, 8.0
    chord, cosine = np.hypot(run, rise), run / np.hypot(run, rise)
    stiffness, mass, expansion, diameter = 77e9 * 468.6e-6, 1.628, 18.9e-6, 28.14e-3
    bare = 9.81 * mass
    iced = bare + 9.81 * 900 * np.pi * thickness * (diameter + thickness)

    def slack(tension, weight, pull=0.0):
        return (np.hypot(weight * cosine, pull) * chord / tension) ** 2 / 24

    first = 0.2 * 140.1e3 / cosine
    low, high = 1e3, 140e3
    for _ in range(100):
        middle = (low + high) / 2
        stretched = (middle - first) / stiffness + expansion * change
        low, high = (middle, high) if slack(middle, iced, pull) - slack(first, bare) > stretched else (low, middle)
    return middle


@pytest.mark.parametrize(
    ("name", "change", "pull", "thickness"),
    [("everyday", 0, 0, 0), ("cold", -45, 0, 0), ("hot", 65, 0, 0), ("ice", -20, 0, 0.015),
     ("storm", -10, 0.5 * 1.25 * 30**2 * 28.14e-3, 0)],
)  # fmt: skip
def test_the_stored_line_follows_the_state_change_equation(name, change, pull, thickness):
    rows = {row["case"]: row for row in table_of("static", CONFIGS / "line.yaml", "--case", "all")}
    assert rows[name]["preload_N"] == pytest.approx(state_change(change, pull, thickness), rel=2e-3)
