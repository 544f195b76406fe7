"""Statics of fixed elements as arrays: rows alone, in a batch and reversed, failures beside others; bars by hand."""

import numpy as np
import pytest
from command import study_file

from cablestudy.scene.study import read_study
from cablestudy.study.columns import find
from cablestudy.study.scene_values import tables_of
from cablestudy.study.study_rows import evaluate, evaluate_tables

NAMES = ["preload", "horizontal_tension", "max_tension", "min_tension", "sag", "swing", "lowest_point", "end_stiffness",
         "end_stiffness_xz", "end_stiffness_yy", "end_stiffness_along", "reaction_1_vertical", "stretched_length",
         "iterations"]  # fmt: skip
MIXED = """
set: {cable: {chord: 185.8 m, inclination: 0 deg, elastic_modulus: 70.3 GPa, density: 1440, area: 2.69 mm^2,
      unstretched_length: 184 m}}
vary:
  - {cable.inclination: [0 deg, 60 deg]}
  - {cable.unstretched_length: [183 m, 200 m]}
  - {model: [{elements: 40, order: 1}, {elements: 2, order: 8}, {elements: 1, order: 1}]}
  - {cable.loads: [[], [{at: 50 m, force: [0, 3 N, -10 N]}], [{fraction: 0.3, mass: 2 kg}]]}
columns: [sag]
"""


def study_of(text, folder):
    return read_study(study_file(folder, text))


def test_digits_do_not_depend_on_other_rows(tmp_path):
    scenes = [scene for _, scene in study_of(MIXED, tmp_path).cases()]
    columns = [find(name) for name in NAMES]
    together, back = evaluate(scenes, columns), evaluate(scenes[::-1], columns)[::-1]
    assert {row.cells["status"] == "ok" for row in together} == {True, False}  # one element bears no load
    for scene, row, other in zip(scenes, together, back, strict=True):
        alone = evaluate([scene], columns)[0]
        assert row.cells == other.cells == alone.cells
        assert row.errors == other.errors == alone.errors


def test_a_table_has_the_numbers_of_its_rows(tmp_path):
    study = study_of(
        "vary: [{cable.unstretched_length: {from: 183 m, to: 300 m, count: 9}}]\ncolumns: [sag]\n",
        tmp_path,
    )
    columns = [find(name) for name in NAMES]
    tables, _ = tables_of(study, range(study.count))
    found = evaluate_tables(tables, columns)
    rows = evaluate([scene for _, scene in study.cases()], columns)
    assert len(found) == 9
    for case, row in enumerate(rows):
        numbers, status, errors, _ = found[case]
        assert numbers == [row.cells[column.header] for column in columns]
        assert status == row.cells["status"]
        assert errors == {name: error for name, error in row.errors.items() if error > 1e-12}


def test_two_bars_hang_as_a_triangle(tmp_path):
    """Two inextensible bars, half of the weight at their joint: the sag is that of a triangle, T = W/(2 sin a)."""
    chord, length, density, area = 8.0, 10.0, 1000.0, 1e-4
    study = study_of(
        "set:\n  cable: {chord: 8 m, elastic_modulus: 1e9 GPa, density: 1000, area: 1e-4 m^2, "
        "unstretched_length: 10 m}\n  model: {elements: 2, order: 1}\nvary: [{gravity: [9.81, 1.62]}]\n"
        "columns: [sag]\n",
        tmp_path,
    )
    rows = evaluate([scene for _, scene in study.cases()], [find("sag"), find("horizontal_tension")])
    depth = np.sqrt(length**2 - chord**2) / 2
    for row, gravity in zip(rows, (9.81, 1.62), strict=True):
        joint = density * area * length * gravity / 2
        assert row.cells["sag_m"] == pytest.approx(depth, rel=1e-9)
        assert row.cells["horizontal_tension_N"] == pytest.approx(joint / 2 * (chord / 2) / depth, rel=1e-9)
