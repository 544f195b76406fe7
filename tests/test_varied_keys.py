"""Varied keys as columns: numbers in SI with the unit in the name where every value is one, else text as written."""

from pathlib import Path

import pytest
from command import run, study_file

from cablestudy.scene.study import read_study
from cablestudy.study.table import Field, Table, short
from cablestudy.study.varied_keys import varied_keys

pytestmark = pytest.mark.usefixtures("folder")


@pytest.mark.parametrize(
    ("values", "header", "title", "cells"),
    [
        ("cable.preload: [100 N, 1.3 kN, 2]", "cable.preload_N", "cable.preload [N]", [100.0, 1300.0, 2.0]),
        ("cable.diameter: [1.85 mm, 0.3 cm]", "cable.diameter_m", "cable.diameter [m]", [0.00185, 0.003]),
        ("cable.elastic_modulus: [70.3 GPa]", "cable.elastic_modulus_Pa", "cable.elastic_modulus [Pa]", [70.3e9]),
        ("gravity: [9.81, 1]", "gravity_m_per_s2", "gravity [m/s^2]", [9.81, 1.0]),
        ("cable.preload: [5 %, 7 %]", "cable.preload_percent", "cable.preload [%]", [5.0, 7.0]),
        ("cable.preload: [5 %, 20 kN]", "cable.preload", "cable.preload", ["5 %", "20 kN"]),
        ("wind.turbulence_intensity: [15 %, 0.1]", "wind.turbulence_intensity", "wind.turbulence_intensity",
         [0.15, 0.1]),
        ("winch.controller.notch.frequency: [coupled, 1 Hz]", "winch.controller.notch.frequency",
         "winch.controller.notch.frequency", ["coupled", "1 Hz"]),
        ("winch.controller.gain: [0.3, {auto: 6 dB}]", "winch.controller.gain", "winch.controller.gain",
         [0.3, '{"auto": "6 dB"}']),
        ("model.elements: [10, 40]", "model.elements", "model.elements", [10, 40]),
        ("cable.material: [aramid]", "cable.material", "cable.material", ["aramid"]),
        ("cable.preload: {from: 1 kN, to: 3 kN, count: 3}", "cable.preload_N", "cable.preload [N]",
         [1000.0, 2000.0, 3000.0]),
    ],
)  # fmt: skip
def test_name_unit_and_cells(values, header, title, cells):
    study = read_study(study_file(".", f"vary: [{{{values}}}]\ncolumns: [mass]\n"))
    (varied,) = varied_keys(study)
    assert (varied.header, varied.field.name) == (header, header)
    assert title == f"{varied.field.title} [{varied.field.unit}]".removesuffix(" []")
    assert [varied.cell(study.overrides(case)[varied.key]) for case in range(study.count)] == cells


def test_csv_has_the_digits_of_the_study():
    study_file(".", "vary: [{cable.chord: [185.8 m, 185.8 m], exposure: [1.85 ms, 0.1 ms]}]\ncolumns: [mass]\n")
    lines = run("sweep", "study.yaml", "--no-write", "--format", "csv").out.splitlines()
    assert [line.rpartition(",")[0].split(",")[:2] for line in lines] == [
        ["cable.chord_m", "exposure_s"], ["185.8", "0.00185"], ["185.8", "0.0001"],
    ]  # fmt: skip


def test_markdown_shows_as_many_digits_as_tell_values_apart():
    rows = [{"x": 185.668, "y": 185.668}, {"x": 185.7, "y": 185.7}]
    table = Table((Field("x", "x", distinct=True), Field("y", "y")), rows)
    assert table.render("md").splitlines()[2:] == ["| 185.67 | 185.7 |", "|  185.7 | 185.7 |"]
    assert short(185.668, 6) == "185.668"


def test_a_table_that_an_earlier_version_stored_as_text_is_told():
    study_file(".", "vary: [{gondola.mass: [5 kg]}]\ncolumns: [mass]\n")
    run("sweep", "study.yaml")
    stored = Path("results/study.csv")
    text = stored.read_text(encoding="utf-8")
    stored.write_text(text.replace("gondola.mass_kg", "gondola.mass").replace("\n5.0,", "\n5 kg,"), encoding="utf-8")
    assert run("sweep", "study.yaml", "--check", code=1).lines == [
        "results/study.csv: column gondola.mass: stored as text by an earlier version, now gondola.mass_kg: "
        "sweep it anew without --check"
    ]
    run("sweep", "study.yaml")
    assert stored.read_text(encoding="utf-8") == text


def test_rows_of_an_earlier_version_are_used_again(folder):
    """Stored rows hold no varied keys: what they are called is no reason to compute anew."""
    study_file(".", "vary: [{gondola.mass: [5 kg, 6 kg]}]\ncolumns: [mass]\n")
    run("sweep", "study.yaml")
    table = Path("results/study.csv").read_bytes()
    assert run("sweep", "study.yaml", "--resume").lines[0].startswith("2 of 2 rows")
    assert Path("results/study.csv").read_bytes() == table


def test_a_plot_takes_a_varied_key_with_its_unit_or_without():
    for name in ("gondola.mass", "gondola.mass_kg"):
        study_file(".", f"vary: [{{gondola.mass: [5 kg, 6 kg]}}]\ncolumns: [mass]\nplot: {{x: {name}, y: mass}}\n")
        run("sweep", "study.yaml", "--no-write", "--plot", "a.svg")
        assert Path("a.svg").stat().st_size > 1000
