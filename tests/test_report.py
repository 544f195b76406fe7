"""The tables of the commands that look at one scene, and of those that compute nothing."""

import numpy as np
import pytest
from command import CARLINA, CONFIGS, SLACK, run, table_of
from references import catenary_mp
from scenes import INCLINED, PAPER, SAGGING, G

from cablestudy.study.cable_columns import COLUMNS

FIG_4 = str(CONFIGS / "point-load.yaml")


def test_static_shows_every_column_that_the_scene_has_a_value_for():
    every = {c.header for c in COLUMNS if c.needs in ("scene", "statics", "stiffness")}
    every -= {"clearance_m", "force_displacement_mm"}  # neither has a ground, or a load case with a force
    loads = {c.header for c in COLUMNS if c.key.startswith("cable.loads")}
    assert set(table_of("static", FIG_4)[0]) == every | {"status"}
    assert set(table_of("static", CARLINA)[0]) == every - loads | {"status"}
    bare = table_of("static", CARLINA, "--set", "gondola=null", "--set", "cable.strength=null")[0]
    of_gondola = {"gondola_frequency_static_Hz", "mean_displacement_mm", "linear_range_mm"}
    assert set(table_of("static", CARLINA)[0]) - set(bare) == {"breaking_force_N", "utilisation", *of_gondola}


@pytest.mark.parametrize("twin", [PAPER, INCLINED, SAGGING], ids=["taut", "inclined", "sagging"])
def test_the_shape_of_bars_is_that_of_the_reference(twin):
    ends = f"cable.ends=[[0, 0, 0], [{twin.a}, 0, {twin.b}]]"
    sets = (ends, f"cable.unstretched_length={twin.length}", f"cable.area={twin.area}")
    rows = table_of("static", CARLINA, "--shape", *(part for one in sets for part in ("--set", one)))
    assert [row["s_m"] for row in rows] == pytest.approx(np.arange(41) * twin.length / 40, rel=1e-12)
    found = np.array([[row["x_m"], row["y_m"], row["z_m"]] for row in rows])
    assert found == pytest.approx(twin.chain().nodes, rel=0, abs=1e-10 * twin.chord)


def test_the_shape_in_closed_form_is_that_of_50_digits():
    rows = table_of("static", SLACK, "--shape")
    EA, weight = SAGGING.stiffness, SAGGING.mass * G
    force = catenary_mp.solve_loaded((SAGGING.a, 0, SAGGING.b), SAGGING.length, EA, weight)
    for row in rows[::8]:
        place = catenary_mp.shape_loaded(force, row["s_m"], SAGGING.length, EA, weight)
        assert [row["x_m"], row["y_m"], row["z_m"]] == pytest.approx([float(p) for p in place], abs=1e-9)
        tension = catenary_mp.tension_vector(force, row["s_m"], SAGGING.length, weight)
        assert row["tension_N"] == pytest.approx(float(sum(t * t for t in tension) ** 0.5), rel=1e-10)


def test_the_shape_of_turned_and_shifted_ends():
    sets = ("--set", "cable.ends=[[1, 2, 3], [1, -183.8, 3]]")
    rows, plain = table_of("static", CARLINA, "--shape", *sets), table_of("static", CARLINA, "--shape")
    for row, other in zip(rows, plain, strict=True):
        assert [row["x_m"], 2 - row["y_m"], row["z_m"] - 3] == pytest.approx([1, other["x_m"], other["z_m"]], abs=1e-9)


def test_a_failed_scene_has_an_empty_row_and_no_shape():
    outcome = run("static", CARLINA, "--set", "cable.preload=1 N", "--format", "csv", code=3)
    assert outcome.out.count("\n") == 2
    assert run("static", CARLINA, "--set", "cable.preload=1 N", "--shape", code=3).out == ""


def test_mode_table():
    rows = table_of("modes", CARLINA, "-n", 6)
    assert list(rows[0]) == ["number", "type", "symmetry", "frequency_Hz", "participation", "lock_in_speed_m_per_s"]
    assert [row["type"] for row in rows].count("out-of-plane") == 3
    assert all(row["participation"] == 0 for row in rows if row["type"] == "out-of-plane")
    assert all(row["participation"] > 0 for row in rows if row["type"] != "out-of-plane")


def test_validate_counts_cases_and_goes_on_after_a_bad_file():
    outcome = run("validate", CONFIGS / "preload.yaml", "absent.yaml", CARLINA, "--format", "csv", code=2)
    header, *lines = outcome.out.splitlines()
    assert header == "file,kind,cases,status"
    ends = ("preload.yaml,study,6,ok", "absent.yaml,,,1 mistake", "carlina.yaml,scene,1,ok")
    assert all(line.endswith(end) for line, end in zip(lines, ends, strict=True))
    assert outcome.lines == ["absent.yaml: no such file"]
