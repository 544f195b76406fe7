"""The table of materials and ropes, the user's own files of them, and the command that lists both."""

import math
from pathlib import Path

import pytest
from command import CONFIGS, refusal, run, study_file, table_of, write
from scenes import cells, scene_of

from cablestudy.errors import SceneError
from cablestudy.scene.document import read_document
from cablestudy.scene.materials import Material, materials
from cablestudy.scene.scene import load_scene
from cablestudy.scene.schema import scene_schema, suspension_schema
from cablestudy.scene.study import read_study
from cablestudy.scene.units import to_si
from cablestudy.study.case_table import tables_of

pytestmark = pytest.mark.usefixtures("folder")

INCH, POUND, FOOT, SHORT_TON = 0.0254, 4.4482216, 0.3048, 8896.4432
POUND_MASS = 0.45359237


def test_table_9_of_the_paper_is_there_by_its_own_names():
    printed = {  # GPa, kg/m^3, MPa
        "steel": (210, 7800, 1500), "steel-high": (210, 7800, 2000), "polypropylene": (5, 930, 60),
        "polyester": (15, 910, 1150), "nylon": (4, 1140, 1000), "aramid": (70, 1440, 3000),
        "aramid-high": (140, 1440, 3500), "stainless-steel": (200, 7850, 500),
        "stainless-steel-high": (200, 7850, 1000),
    }  # fmt: skip
    expected = {f"paper/{name}": (E * 1e9, density, strength * 1e6) for name, (E, density, strength) in printed.items()}
    of_paper = {name: entry for name, entry in materials().items() if name.startswith("paper/")}
    assert {name: (m.elastic_modulus, m.density, m.strength) for name, m in of_paper.items()} == expected


def test_every_built_in_material_has_its_source_and_numbers_of_its_kind():
    for name, material in materials().items():
        assert material.source, name
        assert 1e9 < material.section_elastic_modulus < 3e11, name
        assert 900 < material.section_density < 9500, name
        assert 0.4 < material.section_fill_factor <= 1, name
        assert 50e6 < material.section_strength < 4e9, name
        assert -2e-5 < (material.expansion or 0) < 2.31e-5, name


# One line of a catalogue or standard each: diameter [m], mass [kg/m], breaking force [N], and by how much the catalogue
# itself scatters about a constant fill factor from size to size.
CATALOGUES = {
    # ASTM A586, table 1, grade 1, class A: 3/4 in, 1.18 lb/ft, 34.0 tons of 2000 lb, 0.338 in^2
    "spiral-strand": (0.75 * INCH, 1.18 * POUND_MASS / FOOT, 34.0 * SHORT_TON, 0.02),
    # ASTM A475, extra high strength, 7 wires: 5/16 in, 205 lb per 1000 ft, 11,200 lb
    "guy-strand": (5 / 16 * INCH, 0.205 * POUND_MASS / FOOT, 11_200 * POUND, 0.04),
    # ISO 2408 and EN 12385-4, 6x36WS-IWRC of 16 mm: 105 kg per 100 m, 161 kN at grade 1770
    "6x36-iwrc": (16e-3, 1.05, 161e3, 0.01),
    # the same with a fibre core, 20 mm: 147 kg per 100 m, 234 kN
    "6x36-fc": (20e-3, 1.47, 234e3, 0.01),
    # EN 12385-10, two layers of z wires: K = 0.607 of d^2 1570 MPa; EN 1993-1-11, table 2.2: 83e-6 N/mm^3, f = 0.84
    "locked-coil": (40e-3, 0.84 * math.pi / 4 * 40**2 * 83e-6 / 9.81 * 1e3, 0.607 * 40**2 * 1570, 0.01),
    # Parafil, technical note PF1, table 2: 10 t type A, 22 mm, 37 kg per 100 m
    "parallel-polyester": (22e-3, 0.37, 10_000 * 9.81, 0.06),
    # Samson, AmSteel-Blue: 3/4 in, 13.3 lb per 100 ft, least strength 58,000 lb
    "hmpe-braid": (0.75 * INCH, 0.133 * POUND_MASS / FOOT, 58_000 * POUND, 0.03),
    # California PUC, General Order 95, table 23: ACSR of 397.5 kcmil 26/7, 0.783 in, 0.5464 lb/ft, 16,190 lb
    "acsr-26/7": (0.783 * INCH, 0.5464 * POUND_MASS / FOOT, 16_190 * POUND, 0.015),
    # DIN 48204, 50/8: 9.6 mm, 194.8 kg/km, 16.81 kN
    "acsr-6/1": (9.6e-3, 0.1948, 16.81e3, 0.025),
    # Alcoa, sag and tension data: 795 kcmil, 1.108 in, 1.094 lb/ft, 31,500 lb
    "acsr-drake": (1.108 * INCH, 1.094 * POUND_MASS / FOOT, 31_500 * POUND, 0.002),
}  # fmt: skip


@pytest.mark.parametrize("name", CATALOGUES)
def test_a_rope_of_a_listed_diameter_has_the_mass_and_the_breaking_force_of_its_catalogue(name):
    diameter, mass, force, scatter = CATALOGUES[name]
    scene = scene_of(f"cable: {{chord: 50 m, material: {name}, diameter: {diameter}, preload: 10 %}}\n")
    found = cells(scene, "mass_per_length", "breaking_force", "preload")
    assert found["mass_per_length"] == pytest.approx(mass, rel=scatter)
    assert found["breaking_force"] == pytest.approx(force, rel=scatter)
    assert found["preload"] == pytest.approx(found["breaking_force"] / 10, rel=1e-12)


def test_parallel_aramid_breaks_at_its_listed_load():
    # Burgoyne (1990): the type G rope of 60 t has 305 mm^2 of Kevlar 49
    assert materials()["parallel-aramid"].strength * 305e-6 == pytest.approx(60_000 * 9.81, rel=0.005)


def test_a_rope_with_a_size_needs_none_and_keeps_its_numbers_to_the_digit():
    text = "cable: {chord: 300 m, material: acsr-drake, preload: 20 %}\n"
    cable = scene_of(text).cable
    assert (cable.section_mass, cable.section_breaking_force) == (1.628, 140.1e3)
    assert (cable.section_area, cable.section_diameter, cable.expansion) == (468.6e-6, 28.14e-3, 18.9e-6)
    thinner = scene_of(text, "cable.diameter=14.07 mm").cable
    assert thinner.section_mass == pytest.approx(1.628 / 4, rel=1e-14)
    assert thinner.section_axial_stiffness == pytest.approx(cable.section_axial_stiffness / 4, rel=1e-14)


# ------------------------------------------------------------------------------------------------------ files of users

ROPES = """\
my-strand: {elastic_modulus: 155 GPa, density: 8200 kg/m^3, strength: 1500 MPa, fill_factor: 0.77, source: my maker}
strand-16: {axial_stiffness: 24 MN, mass_per_length: 1.25 kg/m, breaking_force: 228 kN, area: 153 mm^2, diameter: 16 mm}
steel: {elastic_modulus: 201 GPa, density: 7801}
"""
SCENE = "materials: ropes/mine.yaml\ncable: {chord: 80 m, material: my-strand, diameter: 16 mm, preload: 20 kN}\n"


@pytest.fixture(autouse=True)
def files(folder):
    (folder / "ropes").mkdir()
    write(folder / "ropes" / "mine.yaml", ROPES)
    write(folder / "scene.yaml", SCENE)


def test_a_file_of_materials_is_relative_to_the_scene_that_names_it():
    cable = load_scene("scene.yaml")[1].cable
    assert (cable.elastic_modulus, cable.density, cable.fill_factor) == (155e9, 8200, 0.77)
    Path("deeper").mkdir()
    write("deeper/top.yaml", "base: ../scene.yaml\ncable: {material: steel}\n")
    cable = load_scene("deeper/top.yaml")[1].cable
    assert (cable.elastic_modulus, cable.density, cable.strength) == (201e9, 7801, None)


def test_a_layer_adds_its_materials_to_those_of_its_base():
    more = "base: scene.yaml\nmaterials: more.yaml\ncable: {material: other}\n"
    write("top.yaml", more)
    write("more.yaml", "other: {elastic_modulus: 1 GPa, density: 1000}\n")
    scene = load_scene("top.yaml")[1]
    assert (scene.cable.elastic_modulus, list(scene.materials)) == (1e9, ["my-strand", "strand-16", "steel", "other"])
    changed = load_scene("top.yaml", ["materials.other.elastic_modulus=2 GPa"])[1]
    assert changed.cable.elastic_modulus == 2e9


def test_materials_may_stand_in_the_scene_itself():
    text = "materials: {mine: {elastic_modulus: 5 GPa, density: 900}}\n"
    scene = scene_of(text + "cable: {chord: 10 m, material: mine, area: 1 mm^2, preload: 10 N}\n")
    assert scene.cable.elastic_modulus == 5e9


@pytest.mark.parametrize(("size", "scale"), [("diameter: 20 mm", 4), ("area: 314.16 mm^2", 4), ("diameter: 10 mm", 1)])
def test_a_solid_wire_whose_area_is_rounded_up_is_scaled_to_another_size(size, scale):
    """78.54 mm^2 is more than a circle of 10 mm holds, by 2.3e-6 of it."""
    wire = "{diameter: 10 mm, area: 78.54 mm^2, axial_stiffness: 1 MN, mass_per_length: 0.1 kg/m}"
    cable = scene_of(
        f"materials: {{wire: {wire}}}\ncable: {{chord: 9 m, material: wire, {size}, preload: 9 N}}\n"
    ).cable
    assert (cable.section_axial_stiffness, cable.section_mass) == pytest.approx((scale * 1e6, scale * 0.1), rel=2.4e-6)
    assert cable.section_diameter == pytest.approx(0.01 * scale**0.5, rel=2.4e-6)


def test_a_study_sees_what_the_file_says_and_a_changed_file_is_another_study():
    text = "vary: [{cable.material: [my-strand, strand-16, spiral-strand]}]\ncolumns: [breaking_force]\n"
    first = table_of("sweep", study_file(".", text, "scene.yaml"), "--out", "out")
    area = math.pi * 0.016**2 / 4
    expected = [1500e6 * 0.77 * area, 228e3, 1410e6 * 0.76 * area]
    # strand-16 has an area for its own diameter, 153 mm^2, of which the scene's equal diameter makes the same
    assert [row["breaking_force_N"] for row in first] == pytest.approx(expected, rel=1e-14)
    write("ropes/mine.yaml", ROPES.replace("1500 MPa", "1600 MPa"))
    second = table_of("sweep", "study.yaml", "--out", "out")
    assert second[0]["breaking_force_N"] == pytest.approx(expected[0] * 16 / 15, rel=1e-14)


def test_a_varied_number_of_a_material_changes_the_cables_of_it():
    text = "vary: [{materials.my-strand.elastic_modulus: [100 GPa, 150 GPa]}]\ncolumns: [sag]\n"
    tables, refused = tables_of(read_study(study_file(".", text, "scene.yaml")), range(2))
    assert [table.scene.cable.elastic_modulus for table in tables] == [100e9, 150e9]
    assert refused == {}


def test_cables_of_a_suspension_are_of_the_users_materials_too():
    cables = scene_of(
        "materials: ropes/mine.yaml\ncable: {material: my-strand, diameter: 16 mm, preload: 5 %}\n"
        "points: {knot: {at: [0, 0, 0], free: true, mass: 100}}\n"
        "cables: {a: {from: [-9, 0, 9], to: knot}, b: {from: [9, 0, 9], to: knot, material: strand-16}}\n"
    ).cables
    assert (cables["a"].elastic_modulus, cables["a"].fill_factor) == (155e9, 0.77)
    assert cables["b"].section_axial_stiffness == pytest.approx(24e6, rel=1e-14)
    assert cables["b"].stated_value == pytest.approx(0.05 * 228e3, rel=1e-14)


BAD = {
    "a: {elastic_modulus: 155 GPa, densty: 8200 kg/m^3}": [
        "1:31: materials.a.densty: unknown key (did you mean density?)",
    ],
    "a: {density: 1}": ["1:4: materials.a: missing key: one of axial_stiffness, elastic_modulus"],
    "a: 5": ["1:4: materials.a: expected a mapping with the keys axial_stiffness, elastic_modulus, mass_per_length, "
             "density, breaking_force, strength, area, diameter, fill_factor, expansion, stress_strain, source, got 5"],
    "a: {elastic_modulus: 1 kg, density: 3}": [
        '1:22: materials.a.elastic_modulus: expected a stress in Pa (a number, or text such as "70.3 GPa"), got "1 kg" '
        "(mass)"],
    "a: {axial_stiffness: 1, elastic_modulus: 1, density: 3}": [
        "1:25: materials.a.elastic_modulus: given together with axial_stiffness: give exactly one of axial_stiffness, "
        "elastic_modulus"],
    "a: {elastic_modulus: 1, density: 3, diameter: 1 mm, area: 5 mm^2}": [
        "1:47: materials.a.diameter: a circle of it has 7.85398e-07 m^2, less than 5e-06 m^2"],
    "a: {elastic_modulus: 1, density: 3, fill_factor: 2}": [
        "1:50: materials.a.fill_factor: must be from 0.001 to 1, got 2"],
    "a: {elastic_modulus: 1, density: 3, source: 4}": ["1:45: materials.a.source: expected text, got 4"],
    "- a": ["1:1: expected a mapping (key: value), got a list"],
}  # fmt: skip


@pytest.mark.parametrize("text", BAD)
def test_mistakes_in_a_file_of_materials_are_told_at_their_place_in_it(text):
    write("ropes/mine.yaml", text + "\n")
    for material in ("a", "steel"):
        with pytest.raises(SceneError) as caught:
            load_scene("scene.yaml", [f"cable.material={material}"])
        assert [str(mistake) for mistake in caught.value.mistakes] == [f"ropes/mine.yaml:{line}" for line in BAD[text]]


def test_what_is_no_file_of_materials():
    text = "cable: {chord: 80 m, material: steel, diameter: 16 mm, preload: 20 kN}\n"
    for value, message in {
        "nix.yaml": "scene.yaml:1:12: materials: nix.yaml: no such file",
        "ropes": "scene.yaml:1:12: materials: ropes: a directory, not a file",
        '""': "scene.yaml:1:12: materials: expected the name of a file",
        "5": "scene.yaml:1:12: materials: expected a mapping, got 5",
    }.items():
        write("scene.yaml", f"materials: {value}\n{text}")
        assert refusal("static", "scene.yaml") == message
    write("scene.yaml", text)
    line = refusal("static", "scene.yaml", "--set", "materials=ropes/mine.yaml")
    assert line == (
        '--set materials: expected a mapping of names, got "ropes/mine.yaml" (a file is named in the scene itself)'
    )


def test_a_wrong_material_that_nothing_names_is_told_too():
    write("ropes/mine.yaml", "a: {density: 1}\nb: {elastic_modulus: 1, density: 1}\n")
    assert run("validate", "scene.yaml", "--set", "cable.material=b", code=2).err.startswith("ropes/mine.yaml:1:4: ")


def test_an_unknown_material_is_told_with_the_users_names():
    line = run("static", "scene.yaml", "--set", "cable.material=strand-17", code=2).err
    assert line == '--set cable.material: unknown material "strand-17" (did you mean strand-16?)\n'


# ------------------------------------------------------------------------------------------------------- the command


def test_the_command_lists_built_in_materials_with_their_sources():
    rows = {row["material"]: row for row in table_of("materials")}
    assert list(rows) == list(materials())
    assert rows["spiral-strand"]["elastic_modulus_GPa"] == 150
    assert rows["acsr-drake"]["strength_MPa"] == pytest.approx(140.1e3 / 468.6, rel=1e-12)
    assert rows["polyester"]["density_kg_per_m3"] == 1380
    assert rows["paper/polyester"]["source"] == "Table 9 of the paper"


@pytest.mark.parametrize("named", ["ropes/mine.yaml", "scene.yaml", "study.yaml"])
def test_the_command_lists_the_users_materials_before_those_they_do_not_replace(named):
    write("study.yaml", "base: scene.yaml\ncolumns: [sag]\n")
    rows = table_of("materials", named)
    assert [row["material"] for row in rows[:4]] == ["my-strand", "strand-16", "steel", "polypropylene"]
    assert len(rows) == len(materials()) + 2
    assert (rows[0]["source"], rows[1]["source"]) == ("my maker", "ropes/mine.yaml:2:1")
    assert rows[1]["elastic_modulus_GPa"] == pytest.approx(24e6 / 153e-6 / 1e9, rel=1e-14)


def test_the_command_tells_mistakes_of_all_files_and_scenes_without_materials_list_the_built_in():
    write("bad.yaml", "a: {density: 1}\nb: {elastic_modulus: 1}\n")
    lines = run("materials", "bad.yaml", "nix.yaml", code=2).lines
    assert lines == [
        "bad.yaml:1:4: a: missing key: one of axial_stiffness, elastic_modulus",
        "bad.yaml:2:4: b: missing key: one of mass_per_length, density",
        "nix.yaml: no such file",
    ]
    line = "steel: a material, not a file: 'cablestudy materials' lists it among all"
    assert refusal("materials", "steel") == line
    assert len(table_of("materials", CONFIGS / "carlina.yaml")) == len(materials())


def test_the_schema_knows_the_table_and_its_keys():
    for schema in (scene_schema(), suspension_schema()):
        file, contents = schema["properties"]["materials"]["anyOf"]
        assert (file["type"], contents["type"]) == ("string", "object")
        assert set(schema["$defs"]["Material"]["properties"]) == set(Material.model_fields)


def test_the_places_of_a_scene_stay_its_own():
    document = read_document("scene.yaml")
    assert document.where(("materials",)) == "scene.yaml:1:12"
    assert document.where(("materials", "steel", "density")) == "ropes/mine.yaml:3:44"
    assert to_si(document.value["materials"]["my-strand"]["elastic_modulus"], "Pa") == 155e9
