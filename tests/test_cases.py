"""Cases as tables: the scenes and the refusals of each case read as a document; a case computes what is asked for."""

import json

import numpy as np
import pytest
from campaign import campaign
from command import CONFIGS, SLACK, write
from scenes import CHORD, LENGTH, scene

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.scene.scene import load_scene
from cablestudy.scene.study import read_study
from cablestudy.study.case_table import tables_of
from cablestudy.study.columns import find
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.results import Results
from cablestudy.study.stated_numbers import StatedNumbers
from cablestudy.study.study_rows import evaluate_tables

SCENE = """\
cable:
  chord: 185.8 m
  elastic_modulus: 70.3 GPa
  density: 1440 kg/m^3
  area: 2.69 mm^2
  unstretched_length: 184.4883 m
  loads: [{at: 60 m, force: [0, 0, -1]}]
gondola: {mass: 50 kg}
winch: {controller: {gain: 0.3}}
wind: {speed: 6 m/s, turbulence_intensity: 0.15, length_scale: 25 m}
"""
GRID = (
    "- {cable.diameter: {from: 1 mm, to: 3 mm, count: 5}}\n- {wind.speed: {from: 1, to: 10, count: 4, spacing: log}}\n"
)


@pytest.fixture(autouse=True)
def scene_file(folder):
    write(folder / "scene.yaml", SCENE)


def study_of(more):
    write("study.yaml", "base: scene.yaml\ncolumns: [sag]\n" + more)
    return read_study("study.yaml")


def one_by_one(study):
    """Scene, or messages of the refusal, of every case read as a document."""
    found = {}
    for case in range(study.count):
        try:
            found[case] = study.case(case)[1]
        except SceneError as error:
            found[case] = str(error)
    return found


def in_tables(study):
    """Tables of all cases, and scene, or messages of the refusal, of each."""
    tables, refused = tables_of(study, range(study.count))
    found = {case: str(error) for case, error in refused.items()}
    for table in tables:
        found |= {int(case): table.scene_of(index) for index, case in enumerate(table.cases)}
    return tables, found


# what varies, and how many tables the cases make
STUDIES = {
    "nothing": ("", 1),
    "a grid": ("vary:\n" + GRID, 1),
    "keys together": ("vary: [{cable.diameter: [1 mm, 2 mm], cable.preload: {from: 1 kN, to: 2 kN, count: 2}}]", 1),
    "a sample": ("sample: {method: sobol, count: 8, over: {cable.sag: {from: 1 cm, to: 1 m, spacing: log}}}", 1),
    "a design": ("sample: {method: saltelli, count: 4, over: {gravity: {from: 9 m/s^2, to: 10 m/s^2}}}", 1),
    "materials beside a grid": ("vary:\n- {cable.material: [steel, nylon]}\n" + GRID, 2),
    "tables inside tables": ("vary: [{winch.controller.notch.damping_ratio: [0.1, 0.2], gondola.area: [1, 2]}]", 1),
    "a load's place": ("vary: [{cable.loads.0.at: [1 m, 2 m]}]", 2),
    "an angle": ("vary: [{cable.inclination: [1 deg, 2 deg, 90 deg, -90 deg]}]", 1),
    "a load's mass and force": ("vary: [{cable.loads.0.mass: [1 kg, 2 kg]}, {cable.loads.0.force.2: [-3, 4]}]", 1),
    "coordinates of an end": (
        "set: {cable.loads: [], cable.ends: [[0, 0, 0], [180 m, 0, 0]]}\n"
        "vary: [{cable.ends.1.2: [0, 9 m, 700 m]}, {cable.ends.1.0: [0, 175 m]}]", 1),
    "points": ("set: {cable.loads: []}\nvary: [{cable.ends: [[[0, 0, 0], [180, 0, 9]], [[0, 0, 0], [181, 0, 9]]]}]", 2),
    "words and mappings": (
        "vary: [{winch.controller.notch.frequency: [1 Hz, coupled, 2 Hz]}, "
        "{winch.controller.gain: [1, {auto: {gain_margin: 6}}, 2]}]",
        6,
    ),
    "a key that is removed": ("vary: [{gondola.area: [1, null, 2]}]", 2),
    "values of the wrong kind": ("vary: [{gravity: [1, -1, 2 kg, 1e9, .nan, [1], {a: 1}, text, 3]}]", 1),
    "a first value that is wrong": ("vary: [{gravity: [-1, 1, 2]}]", 1),
    "numbers that do not fit each other": (
        "vary: [{cable.chord: {from: 100 m, to: 300 m, count: 5}}, "
        "{cable.unstretched_length: [30 m, 200 m, 20 km]}]", 1),
    "products out of range": (
        "vary: [{cable.area: {from: 1e-18, to: 1e9, count: 7, spacing: log}}, "
        "{cable.elastic_modulus: [1e12, 1e-12, 1e30]}]", 1),
    "area and diameter": ("vary: [{cable.area: [1 mm^2, 2 mm^2]}, {cable.diameter: [1 mm, 2 mm]}]", 1),
    "alternatives at once": ("vary: [{cable.elastic_modulus: [1e9, 2e9]}, {cable.axial_stiffness: [1e5, 2e5]}]", 0),
    "an unknown key": ("vary: [{cable.densty: [1, 2]}]", 0),
    "what the scene lacks": ("set: {gondola: null}\nvary: [{gondola.area: [1, 2]}]", 0),
}  # fmt: skip


@pytest.mark.parametrize("what", STUDIES)
def test_tables_hold_what_the_documents_say(what):
    text, count = STUDIES[what]
    study = study_of(text)
    tables, found = in_tables(study)
    assert found == one_by_one(study)
    assert len(tables) == count


def test_properties_of_a_scene_of_arrays_are_those_of_each_case():
    study = study_of("vary:\n" + GRID)
    (table,), _ = tables_of(study, range(3, 17))
    assert table.cases.tolist() == list(range(3, 17))
    assert list(table.values) == ["cable.diameter", "wind.speed"]
    for name in ("section_area", "section_diameter", "section_axial_stiffness", "section_mass"):
        each = [getattr(study.case(case)[1].cable, name) for case in table.cases.tolist()]
        assert getattr(table.scene.cable, name).tolist() == each, name
    assert table.scene.wind.turbulence.tolist() == [study.case(k)[1].wind.turbulence for k in table.cases.tolist()]
    assert table.scene.cable.density == 1440.0


@pytest.mark.parametrize("what", ["an angle", "a load's mass and force", "coordinates of an end"])
def test_arrays_of_a_table_are_those_of_its_scenes(what):
    study = study_of(STUDIES[what][0])
    (table,), _ = tables_of(study, range(study.count))
    alone = StatedNumbers([study.case(case)[1] for case in table.cases.tolist()])
    pairs = [(table.ends, alone.ends)] + [(table.loads(of_case), alone.loads(of_case)) for of_case in (False, True)]
    for arrays, expected in pairs:
        for array, other in zip(arrays, expected, strict=True):
            assert np.array_equal(array, other, equal_nan=True)
    assert np.array_equal(table.number("cable.chord_length"), alone.number("cable.chord_length"))


def numbers_in(value, path=()):
    """Path and value of each number in nested mappings and lists."""
    if isinstance(value, float):
        yield path, value
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else ()
    for name, inner in items:
        yield from numbers_in(inner, (*path, str(name)))


def contents(scenes_or_refusals):
    """Case -> all that a scene says, or the refusal."""
    return {case: found if isinstance(found, str) else found.model_dump() for case, found in scenes_or_refusals.items()}


VARIED = ["guy.yaml", "suspensions/trifilar.yaml", "zipline.yaml", "point-load.yaml"]  # zipline has ground points


@pytest.mark.parametrize("name", campaign(VARIED, VARIED[:3]))
def test_any_number_of_a_scene_may_vary(name):
    """Each number larger and smaller by a thousandth, and of the other sign: scenes, refusals and rows as alone."""
    columns, varied = [find("max_tension"), find("sag")], 0
    for path, value in numbers_in(load_scene(CONFIGS / name)[1].model_dump()):
        values = [value * factor for factor in (1, 1.001, 0.999, -1)] if value else [0.0, 1e-3, -1e-3]
        text = {"base": str(CONFIGS / name), "vary": [{".".join(path): values}], "columns": ["max_tension"]}
        write("study.yaml", json.dumps(text))
        try:
            study = read_study("study.yaml")
        except SceneError:  # no key of a file, such as what a material implies
            continue
        varied += 1
        tables, found = in_tables(study)
        assert contents(found) == contents(one_by_one(study)), path
        if "suspensions" not in name:
            alone = {}
            for table in tables:
                for index in range(len(table)):
                    alone |= evaluate_tables([table.take(np.array([index]))], columns)
            assert evaluate_tables(tables, columns) == alone, path
    assert varied > 20


def test_cases_unlike_others_are_solved_together(monkeypatch):
    study = study_of("set: {gondola: null}\nvary: [{cable.loads.0.at: {from: 10 m, to: 170 m, count: 9}}]")
    batches = []

    class Counted(Results):
        def __init__(self, values):
            batches.append(len(values))
            super().__init__(values)

    monkeypatch.setattr("cablestudy.study.one_cable.rows.Results", Counted)
    monkeypatch.setattr("cablestudy.study.one_cable.static_columns.Results", Counted)
    tables, _ = tables_of(study, range(study.count))
    rows = evaluate_tables(tables, [find("sag")])
    assert batches == [study.count]
    monkeypatch.undo()
    assert rows == {case: row for table in tables for case, row in evaluate_tables([table], [find("sag")]).items()}


def test_the_diameter_of_areas_is_rounded_as_that_of_one():
    study = study_of("vary: [{cable.area: {from: 1 mm^2, to: 2 mm^2, count: 999}}]")
    (table,), _ = tables_of(study, range(study.count))
    each = [study.case(case)[1].cable.section_diameter for case in range(study.count)]
    assert np.array_equal(table.scene.cable.section_diameter, each)


def test_no_cases_are_no_tables():
    assert tables_of(study_of("vary:\n" + GRID), []) == ([], {})


def test_a_wrong_case_leaves_the_others_in_one_table():
    study = study_of("vary: [{gravity: {from: 5, to: -5, count: 11}}]")
    (table,), refused = tables_of(study, range(11))
    assert table.scene.gravity.tolist() == [5, 4, 3, 2, 1, 0]
    assert sorted(refused) == [6, 7, 8, 9, 10]
    assert str(refused[6]).endswith("gravity: must not be negative, got -1")


# ------------------------------------------------------------------------------------------------------------- one case


def test_the_span_of_a_scene():
    span = CableCase(scene()).span
    assert (span.chord, float(span.cosine), float(span.sine)) == (CHORD, 1.0, 0.0)
    assert span.unstretched_length == pytest.approx(LENGTH, rel=1e-15)
    upright = CableCase(scene("cable.chord=10", "cable.inclination=-90 deg", "cable.preload=1 kN")).span
    assert (float(upright.cosine), float(upright.sine)) == (0.0, -1.0)
    turned = CableCase(scene("cable.ends=[[1, 2, 3], [1, 102, 3]]", "cable.preload=1 kN")).span
    assert turned.horizontal == pytest.approx([0, 1, 0])
    assert turned.chord == 100


@pytest.mark.parametrize(("wanted", "column"), [("cable.preload=500 N", "mean_tension"), ("cable.sag=2 m", "sag")])
@pytest.mark.parametrize("model", ["model=null", "model.elements=40"])
def test_a_wanted_tension_or_sag_is_had(wanted, column, model):
    number = float(wanted.partition("=")[2].split()[0])
    found = getattr(CableCase(scene(wanted, model)).statics, column)
    # solved for the continuous cable; 40 bars are 1e-4 beside it
    assert found == pytest.approx(number, rel=1e-10 if model == "model=null" else 2e-4)


def test_loads_beyond_the_end_are_refused_once_the_length_is_known():
    load = "cable.loads=[{at: 185 m, force: [0, 0, -1]}]"
    with pytest.raises(NoSolutionError, match="ends before its last load, at 185 m"):
        _ = CableCase(scene("cable.preload=10 kN", load, "cable.reference.loads=true")).span
    with pytest.raises(NoSolutionError, match="the load at 185 m is beyond the cable's end, at 176"):
        _ = CableCase(scene("cable.preload=10 kN", load)).span


def test_a_hundred_thousand_bars_are_static_in_a_moment():
    fine, exact = CableCase(scene("model.elements=100000", base=SLACK)), CableCase(scene(base=SLACK))
    assert fine.statics.mean_tension == pytest.approx(exact.statics.mean_tension, rel=1e-9)
    assert fine.statics.sag == pytest.approx(exact.statics.sag, rel=1e-9)
