"""One cross-section, stated in each of the ways that a file allows: the same numbers everywhere."""

import math

import pytest
from command import run, study_file, table_of
from scenes import cells, computed, scene_of

from cablestudy.scene.study import read_study
from cablestudy.study.case_table import tables_of

pytestmark = pytest.mark.usefixtures("folder")

MODULUS, DENSITY, STRENGTH, AREA = 150e9, 8300.0, 1520e6, 150e-6  # of a strand of 16 mm, nearly
EA, MASS, FORCE, DIAMETER = MODULUS * AREA, DENSITY * AREA, STRENGTH * AREA, 2 * math.sqrt(AREA / math.pi)
REST = "chord: 80 m, inclination: 40 deg, expansion: 11.5e-6 1/K"
WAYS = {
    "by material": f"elastic_modulus: {MODULUS}, density: {DENSITY}, strength: {STRENGTH}, area: {AREA}",
    "by diameter": f"elastic_modulus: {MODULUS}, density: {DENSITY}, strength: {STRENGTH}, diameter: {DIAMETER!r}",
    "as a whole": f"axial_stiffness: {EA!r}, mass_per_length: {MASS!r}, breaking_force: {FORCE!r}, area: {AREA}",
    "with a fill factor": f"axial_stiffness: {EA!r}, mass_per_length: {MASS!r}, strength: {STRENGTH}, fill_factor: 1, "
    f"diameter: {DIAMETER!r}",
    "over a material": f"material: steel, axial_stiffness: {EA!r}, density: {DENSITY}, breaking_force: {FORCE!r}, "
    f"area: {AREA}",
}
COLUMNS = (
    "area", "diameter", "elastic_modulus", "density", "axial_stiffness", "mass_per_length", "breaking_force", "mass",
    "preload", "sag", "max_tension", "stress", "utilisation", "strain", "end_stiffness", "cable_frequency",
    "lambda_squared",
)  # fmt: skip


def scene_with(cable, *sets):
    """A scene with this section; it is also the file s.yaml."""
    return scene_of(f"cable: {{{REST}, {cable}}}\n", *sets)


def study_with(text):
    """The file of a study upon s.yaml."""
    return study_file(".", text, base="s.yaml")


@pytest.mark.parametrize("tight", ["preload: 22.8 kN", "preload: 10 %", "sag: 0.3 m", "unstretched_length: 79.9 m"])
@pytest.mark.parametrize("way", list(WAYS)[1:])
def test_each_way_to_state_a_section_gives_the_same_numbers(way, tight):
    expected = cells(scene_with(f"{WAYS['by material']}, {tight}"), *COLUMNS)
    if tight == "preload: 10 %":
        assert expected["preload"] == pytest.approx(0.1 * FORCE, rel=1e-14)
    found = cells(scene_with(f"{WAYS[way]}, {tight}"), *COLUMNS)
    for name in COLUMNS:
        # a sag follows from a small difference of lengths, the tension of a stated length from one of strains
        steep = {"sag: 0.3 m": 1e-13, "unstretched_length: 79.9 m": 1e-13}.get(tight, 1e-14)
        assert found[name] == pytest.approx(expected[name], rel=steep), name


def test_derived_numbers_have_the_digits_of_the_products():
    cable = scene_with(f"{WAYS['by material']}, preload: 1 kN").cable
    assert (cable.section_axial_stiffness, cable.section_mass, cable.section_breaking_force) == (EA, MASS, FORCE)
    assert (cable.section_area, cable.section_elastic_modulus, cable.section_density) == (AREA, MODULUS, DENSITY)
    round_ = scene_with(f"{WAYS['by diameter']}, preload: 1 kN").cable
    assert round_.section_area == math.pi * (DIAMETER * DIAMETER) / 4
    assert cable.expansion == 11.5e-6


def test_metal_and_outline_are_two_things():
    strand = WAYS["by material"].replace(f"area: {AREA}", "diameter: 16 mm, fill_factor: 0.75")
    cable = scene_with(f"{strand}, preload: 1 kN").cable
    assert cable.section_area == 0.75 * (math.pi * 0.016**2 / 4)
    area = scene_with(f"{WAYS['by material']}, fill_factor: 0.75, preload: 1 kN").cable
    assert area.section_diameter == pytest.approx(DIAMETER / math.sqrt(0.75), rel=1e-15)
    both = scene_with(f"{WAYS['by material']}, diameter: 16 mm, preload: 1 kN").cable
    assert (both.section_area, both.section_diameter) == (AREA, 0.016)


@pytest.mark.crossed
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("key", ["axial_stiffness", "mass_per_length", "breaking_force", "diameter", "area"])
def test_a_study_of_arrays_gives_the_numbers_of_each_scene(way, key):
    values = {"axial_stiffness": EA, "mass_per_length": MASS, "breaking_force": FORCE, "diameter": 0.016, "area": AREA}
    given = [values[key] * share for share in (1.0, 1.1, 1.3)]
    scene_with(f"{WAYS[way]}, preload: 10 %")
    study = read_study(study_with(f"vary: [{{cable.{key}: {given!r}}}]\ncolumns: [{', '.join(COLUMNS)}]\n"))
    (table,), refused = tables_of(study, range(3))
    assert (len(table), refused) == (3, {})
    rows = computed(study).rows
    for case, row in enumerate(rows):
        alone = cells(study.case(case)[1], *COLUMNS)
        assert [row[name] for name in row if name in alone] == [alone[name] for name in row if name in alone]
        if key in alone:
            scale = {"diameter": 1e3, "area": 1e6}.get(key, 1)
            assert row[next(name for name in row if name.startswith(key))] == pytest.approx(scale * given[case])
        assert row["preload_N"] == pytest.approx(0.1 * row["breaking_force_N"], rel=1e-14)


def test_a_varied_share_stays_as_given_in_the_table():
    whole = f"{WAYS['as a whole']}, preload: 1 kN"
    scene_with(whole)
    study = study_with("vary: [{cable.preload: [5 %, 20 kN, 99 %]}]\ncolumns: [sag, breaking_force]\n")
    rows = table_of("sweep", study, "--no-write")
    assert [row["cable.preload"] for row in rows] == ["5 %", "20 kN", "99 %"]
    preloads = repr(0.05 * FORCE), "20 kN", repr(0.99 * FORCE)
    sags = [cells(scene_with(whole, f"cable.preload={preload}"), "sag")["sag"] for preload in preloads]
    assert [row["sag_m"] for row in rows] == sags


BARE = f"axial_stiffness: {EA!r}, mass_per_length: {MASS!r}, preload: 1 kN"


def test_columns_without_a_key_are_refused_and_left_out_of_static():
    scene_with(BARE)
    (row,) = table_of("static", "s.yaml")
    assert {"area_mm2", "diameter_mm", "stress_MPa", "elastic_modulus_GPa", "density_kg_per_m3"}.isdisjoint(row)
    assert {"breaking_force_N", "utilisation"}.isdisjoint(row)
    assert (row["axial_stiffness_N"], row["mass_per_length_kg_per_m"], row["status"]) == (EA, MASS, "ok")
    lines = run("sweep", study_with("columns: [stress, diameter, utilisation, density]\n"), "--no-write", code=2).lines
    needed = [line.rpartition("needs the key ")[2].split(",")[0] for line in lines]
    assert needed == ["cable.area", "cable.diameter", "cable.breaking_force", "cable.area"]


def test_one_of_the_cases_may_lack_the_key():
    scene_with(BARE)
    study = study_with("vary: [{cable.diameter: [null, 16 mm]}]\ncolumns: [stress, sag]\n")
    first, second = table_of("sweep", study, "--no-write", code=3)
    assert first["status"] == "stress needs the key cable.area, which this case does not have"
    assert (first["stress_MPa"], second["status"]) == (None, "ok")
    assert first["sag_m"] == second["sag_m"]


def test_the_wind_on_the_gondola_needs_no_diameter_and_that_on_the_cable_does():
    wind = "wind: {speed: 6 m/s, turbulence_intensity: 0.15, length_scale: 25 m}\n"
    gondola = "gondola: {mass: 50 kg, area: 0.6 m^2, drag_coefficient: 1.17}\n"
    scene_of(f"cable: {{{REST}, {BARE}, damping: {{loss_factor: 0.02}}}}\n{wind}{gondola}")
    (row,) = table_of("windrms", "s.yaml", "--quiet")
    assert row["gondola_rms_open_loop_mm"] > 0
    assert "needs it" in run("windrms", "s.yaml", "--on", "cable", code=2).err
    assert run("windrms", "s.yaml", "--on", "cable", "--set", "cable.diameter=16 mm", "--quiet").code == 0


PAIR = """\
cable: {{{section}}}
points: {{left: [-2, 0, 2], right: [2, 0, 2], knot: {{at: [0.3, 0, 1], free: true, mass: 2 kg}}}}
cables: {{a: {{from: left, to: knot, preload: 0.02 %}}, b: {{from: right, to: knot, tension_to: 0.03 %}}}}
"""


@pytest.mark.parametrize("way", WAYS)
def test_cables_of_a_suspension_state_sections_in_the_same_ways(way):
    rows = {}
    for name in ("by material", way):
        scene_of(PAIR.format(section=WAYS[name]))
        rows[name] = table_of("static", "s.yaml", "--table", "cables", "--set", "cables.b.tension_to=60 N")
    for found, expected in zip(rows[way], rows["by material"], strict=True):
        numbers_ = {key: value for key, value in expected.items() if isinstance(value, float)}
        assert {key: found[key] for key in numbers_} == pytest.approx(numbers_, rel=1e-9, abs=1e-9)
    assert rows[way][0]["preload_N"] == pytest.approx(2e-4 * FORCE, rel=1e-10)


@pytest.mark.parametrize("text", ["11.5e-6 1/K", "11.5e-6 1/degC", "11.5e-6 1/°C", "0.00115 %/K"])
def test_expansion_is_read_per_kelvin_or_degree(text):
    assert scene_with(BARE, f"cable.expansion={text}").cable.expansion == 11.5e-6
