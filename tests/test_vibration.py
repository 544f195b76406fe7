"""Vibration in the wind: lock-in speeds of modes, tension over weight, Den Hartog's criterion."""

import json

import pytest
from command import CONFIGS, refused_in_one_line, run, table_of, with_sets
from scenes import G

LINE, GUY, CARLINA = (str(CONFIGS / f"{name}.yaml") for name in ("line", "guy", "carlina"))
DRAKE = 28.14e-3  # m, materials.yaml
STROUHAL = 0.2
MAST = {
    "cable": {"material": "guy-strand", "diameter": "16 mm", "preload": "20 kN"},
    "points": {"top": {"at": [0, 0, 30], "free": True, "mass": 500}},
    "cables": {"a": {"from": [30, 0, 0], "to": "top"}, "b": {"from": [-30, 0, 0], "to": "top"},
               "mast": {"from": [0, 0, 60], "to": "top", "diameter": "32 mm", "preload": "60 kN"},
               "c": {"from": [0, 30, 0], "to": "top"}, "d": {"from": [0, -30, 0], "to": "top"}},
}  # fmt: skip


def speeds(rows):
    return [row["lock_in_speed_m_per_s"] for row in rows]


def test_a_mode_locks_in_where_the_vortices_have_its_frequency():
    rows = table_of("modes", LINE, "-n", 5)
    assert speeds(rows) == pytest.approx([row["frequency_Hz"] * DRAKE / STROUHAL for row in rows], rel=1e-14)
    iced = table_of("modes", LINE, "-n", 5, "--case", "ice")
    around = DRAKE + 2 * 15e-3
    assert speeds(iced) == pytest.approx([row["frequency_Hz"] * around / STROUHAL for row in iced], rel=1e-14)


def test_axial_modes_and_cables_of_unknown_diameter_have_none():
    rows = table_of("modes", CARLINA, "--set", "model={elements: 4}")
    assert {row["type"] for row in rows if row["lock_in_speed_m_per_s"] is None} == {"axial"}
    changes = ["cable.material=null", "cable.axial_stiffness=3 MN", "cable.mass_per_length=1 kg/m", "cases=null",
               "cable.preload=20 kN", "cable.reference=null"]  # fmt: skip
    unknown = table_of("modes", LINE, "-n", 3, *with_sets(*changes))
    assert "lock_in_speed_m_per_s" not in unknown[0]


def test_a_coupled_mode_has_the_diameter_of_the_cable_that_moves_most(tmp_path):
    scene = tmp_path / "mast.yaml"
    scene.write_text(json.dumps(MAST), encoding="utf-8")
    rows = table_of("modes", scene, "-n", 30)
    seen = set()
    for row in rows:
        name, _, _ = row["moves"].rpartition(" ")
        width = {"a": 16e-3, "b": 16e-3, "c": 16e-3, "d": 16e-3, "mast": 32e-3}.get(name)
        seen.add(width)
        expected = None if width is None else pytest.approx(row["frequency_Hz"] * width / STROUHAL, rel=1e-14)
        assert row["lock_in_speed_m_per_s"] == expected
    assert seen >= {16e-3, None}
    alone = table_of("modes", scene, "--cable", "mast", "-n", 3)
    assert speeds(alone) == pytest.approx([row["frequency_Hz"] * 32e-3 / STROUHAL for row in alone], rel=1e-14)


def test_the_catenary_constant_is_the_horizontal_tension_over_the_weight():
    expected = 0.2 * 140.1e3 / (1.628 * G)
    assert table_of("static", LINE)[0]["catenary_constant_m"] == pytest.approx(expected, rel=1e-9)
    (row,) = table_of("find", LINE, "catenary_constant = 1125 m", "--by", "cable.tension.value")
    assert row["cable.tension.value_N"] == pytest.approx(1125 * 1.628 * G, rel=1e-6)
    told = run("modes", LINE, "-n", 1, "--explain").err
    assert f"horizontal tension over weight per length: {expected:.4g} m" in told
    assert all(f"{limit} m (" in told for limit in (1000, 1125, 1225, 1425))
    assert "weight per length" not in run("modes", LINE, "-n", 1, "--explain", "--case", "ice").err


@pytest.mark.parametrize(
    ("material", "published", "unknown"),
    [("aac-dahlia", True, False), ("acsr-6/1", True, False), ("guy-strand", False, True), ("steel", False, True),
     ("own", True, True)],
)  # fmt: skip
def test_safe_values_are_those_of_aluminium_alone(material, published, unknown):
    """Of a material of the scene nothing is known but its numbers."""
    own = "materials={own: {elastic_modulus: 70 GPa, density: 2700 kg/m^3, expansion: 2e-5}}"
    sets = ["cable.diameter=16 mm", f"cable.material={material}", "cable.preload=9 kN", "cases=null"]
    sets += [own] if material == "own" else []
    told = run("modes", GUY, "-n", 1, "--explain", *(word for one in sets for word in ("--set", one))).err
    (line,) = [line for line in told.splitlines() if "weight per length" in line]
    assert ("1000 m (" in line) == published
    assert ("no published" in line) == unknown
    assert material == "own" or not unknown or f"for {material} no" in line


def test_without_gravity_there_is_no_catenary_constant():
    assert "catenary_constant_m" not in table_of("static", CARLINA, "--set", "gravity=0")[0]
    done = run("find", CARLINA, "catenary_constant = 100 m", "--by", "cable.diameter", "--set", "gravity=0", code=2)
    assert "gravity" in done.err
    run("modes", CARLINA, "-n", 1, "--set", "gravity=0", "--explain")


@pytest.mark.parametrize(
    ("slope", "words"), [(-2.5, "= -1.3, below 0"), (-1.2, "= 0, not below 0"), (3.1, "= 4.3, not below 0")]
)
def test_den_hartogs_criterion(slope, words):
    ice = ["--case", "ice", "--set", f"cases.ice.ice.lift_slope={slope}"]
    assert f"dC_L/dalpha + C_D {words}" in run("modes", LINE, "-n", 1, *ice).err
    assert "Den Hartog" not in run("modes", LINE, "-n", 1, "--case", "ice").err
    other = run("modes", LINE, "-n", 1, *ice, "--set", "cases.ice.ice.drag_coefficient=1.7").err
    assert f"dC_L/dalpha + C_D = {slope + 1.7:.4g}" in other


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("cases.ice.ice.lift_slope=steep", "lift_slope"),
        ("cases.ice.ice.lift_slope=2 m", "lift_slope"),
        ("cases.ice.ice.lift_slope=1e9", "lift_slope"),
        ("cases.ice.ice.lift_slope=[1]", "lift_slope"),
        ("cases.ice.ice.drag_coefficient=-1", "drag_coefficient"),
        ("cases.ice.ice={lift_slope: -2}", "thickness, weight"),
        ("cases.ice.ice.lift=-2", "unknown key"),
    ],
)
def test_a_wrong_value_is_one_line(change, words, folder):
    refused_in_one_line(folder, words, "modes", LINE, "--set", change)
