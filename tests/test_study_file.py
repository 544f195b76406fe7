"""Study files: grid and zip, what each case is, and every mistake at its place."""

from itertools import islice, product

import pytest
from command import write

from cablestudy.errors import SceneError
from cablestudy.scene.document import read_file
from cablestudy.scene.scene import is_study
from cablestudy.scene.study import read_study
from cablestudy.study.prepare import check_cases

SCENE = """\
cable:
  ends: [[0, 0, 0], [185.8, 0, 0]]
  material: aramid
  area: 2.69 mm^2
  unstretched_length: 184.4883 m
model: {elements: 40}
"""
ACCELERATION = 'expected an acceleration in m/s^2 (a number, or text such as "9.81 m/s^2")'
HEAD = "base: scene.yaml\ncolumns: [sag, preload]\n"


@pytest.fixture(autouse=True)
def scene(folder):
    """In the working directory of a test."""
    write("scene.yaml", SCENE)


def study_of(text, *sets):
    return read_study(write("study.yaml", text), sets)


def mistakes_of(text, *sets):
    with pytest.raises(SceneError) as caught:
        check_cases(study_of(text, *sets))
    return str(caught.value).splitlines()


def overrides_of(vary):
    return [overrides for overrides, _ in study_of(f"{HEAD}vary:\n{vary}").cases()]


def test_a_study_without_anything_varied_is_one_case():
    study = study_of(HEAD)
    assert (study.count, study.title, study.columns, study.plot) == (1, "", ("sag", "preload"), None)
    assert [overrides for overrides, _ in study.cases()] == [{}]


def test_entries_multiply_with_the_last_one_fastest_and_keys_of_one_go_together():
    cases = overrides_of("  - {cable.area: [1 mm^2, 2 mm^2]}\n  - {gondola.mass: [10, 20, 30]}\n")
    assert [tuple(case.values()) for case in cases] == list(product(["1 mm^2", "2 mm^2"], [10, 20, 30]))
    cases = overrides_of("  - {cable.area: [1 mm^2, 2 mm^2], gondola.mass: {from: 1 kg, to: 2 kg, count: 2}}\n")
    assert cases == [{"cable.area": "1 mm^2", "gondola.mass": "1 kg"}, {"cable.area": "2 mm^2", "gondola.mass": "2 kg"}]


def test_values_may_be_mappings_and_null_removes():
    study = study_of(HEAD + "set: {gondola: {mass: 5}}\nvary:\n- {cable.damping: [{ratio: 0.1}, {loss_factor: 0.2}]}\n")
    assert [scene.cable.damping.model for _, scene in study.cases()] == ["modal", "hysteretic"]
    study = study_of(HEAD + "set: {model: null}\nvary:\n- {gondola: [{mass: 5}, null]}\n")
    assert [scene.gondola and scene.gondola.mass for _, scene in study.cases()] == [5, None]
    assert study.case(0)[1].model.accuracy == 1e-4


def test_alternatives_are_named_changes_that_multiply_with_other_entries():
    study = study_of(
        HEAD + "set: {gravity: 5}\nvary:\n- alternative:\n    as it is: {}\n"
        "    light: {cable.density: 700 kg/m^3, gravity: 1}\n    heavy: {cable.density: 2000 kg/m^3}\n"
        "- {gondola.mass: [1, 2]}\n"
    )
    names, densities = ("as it is", "light", "heavy"), (None, "700 kg/m^3", "2000 kg/m^3")
    cases = [(overrides, study.document_of(place).value) for place, (overrides, _) in enumerate(study.cases())]
    assert [overrides for overrides, _ in cases] == [
        {"alternative": name, "gondola.mass": mass} for name in names for mass in (1, 2)
    ]
    assert [value["cable"].get("density") for _, value in cases] == [one for one in densities for _ in range(2)]
    assert [value["gravity"] for _, value in cases] == [5, 5, 1, 1, 5, 5]
    assert study.varied == ("alternative", "gondola.mass")
    assert study.set_keys == ("cable.density", "gravity", "gondola.mass")
    same = study_of(HEAD + "vary: [{alternative: {a: {gravity: 1}}}]\n")
    other = study_of(HEAD + "vary: [{alternative: {a: {gravity: 2}}}]\n")
    assert same.resolved() != other.resolved()


def test_an_alternative_may_choose_the_load_case_and_go_with_other_keys():
    cases = study_of(
        HEAD + "set: {cases: {wet: {loads: [{at: 10 m, mass: 1 kg}]}}}\n"
        "vary: [{alternative: {dry: {}, wet: {case: wet}}, gondola.mass: [1, 2]}]\n"
    ).cases()
    assert [(overrides, scene.case, scene.gondola.mass) for overrides, scene in cases] == [
        ({"alternative": "dry", "gondola.mass": 1}, None, 1.0),
        ({"alternative": "wet", "gondola.mass": 2}, "wet", 2.0),
    ]


def test_layers_lie_upon_each_other():
    study = study_of(HEAD + "set: {cable.diameter: 1 mm}\nvary:\n- {cable.preload: [1 kN, 2 kN]}\n", "gravity=1")
    scenes = [scene for _, scene in study.cases()]
    assert [scene.cable.preload for scene in scenes] == [1000, 2000]
    assert {scene.cable.unstretched_length for scene in scenes} == {None}
    assert {(scene.cable.area, scene.cable.diameter, scene.gravity) for scene in scenes} == {(None, 0.001, 1)}
    assert study.set == {"cable.diameter": "1 mm"}
    assert study.varied == ("cable.preload",)
    study = study_of(HEAD + "set: {cable.diameter: 1 mm}\n", "cable.area=3 mm^2")
    assert study.case(0)[1].cable.area == 3e-6


def test_cases_are_reached_one_by_one_and_lazily():
    entries = "- gravity: {from: 1, to: 10, count: 1000}\n- gondola.mass: {from: 1, to: 9, count: 9000}\n"
    study = study_of(f"{HEAD}vary:\n{entries}")
    assert study.count == 9_000_000
    check_cases(study)
    assert study.overrides(study.count - 1) == {"gravity": 10, "gondola.mass": 9}
    assert study.case(1)[0]["gravity"] == 1
    assert len(list(islice(study.cases(), 3))) == 3
    with pytest.raises(IndexError):
        study.case(study.count)


def test_names_in_a_study_are_relative_to_the_study(folder):
    (folder / "sub").mkdir()
    write("sub/table.csv", "sag_m\n1\n")
    text = HEAD.replace("scene.yaml", "../scene.yaml") + "reference: table.csv\n"
    write("sub/study.yaml", text + "plot: {x: sag, y: preload, logx: true}\n")
    study = read_study("sub/study.yaml")
    assert study.reference_path == "sub/table.csv"
    assert (study.plot.x, study.plot.y, study.plot.logx, study.plot.logy) == ("sag", ("preload",), True, False)
    assert study.where(("columns", 1)) == "sub/study.yaml:2:16"
    assert is_study(read_file("sub/study.yaml"))
    assert not is_study(read_file("scene.yaml"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SCENE, "1:1: this is a scene (it has the key cable): use 'cablestudy static'; "
                "a study of it is a file with the line base: study.yaml ('cablestudy new study' writes one)"),
        ("columns: [sag]", "1:1: missing key: base"),
        ("base: scene.yaml", "1:1: missing key: columns"),
        ("base: scene.yaml\ncolumns: []", "2:10: columns: expected at least 1 item, got 0"),
        ("base: scene.yaml\ncolumns: sag", '2:10: columns: expected a list, got "sag"'),
        ("base: scene.yaml\ncolumns: [sag, 5, a, sag]", "2:16: columns.1: expected text, got 5"),
        ("base: absent.yaml\ncolumns: [sag]", "1:7: base: absent.yaml: no such file"),
        (HEAD + "colums: 1", "3:1: colums: unknown key (did you mean columns?)"),
        ("base: scene.yaml\ncolumn: [sag]\nplot: {x: sag, y: sag}", "2:1: column: unknown key (did you mean columns?)"),
        ("bas: scene.yaml\ncolumns: [sag]", "1:1: bas: unknown key (did you mean base?)"),
        (HEAD + "reference: absent.csv", "3:12: reference: absent.csv: no such file"),
        (HEAD + "plot: {x: sag}", "3:7: plot: missing key: y"),
        (HEAD + "plot: {x: sag, y: sag, logx: 1}", "3:30: plot.logx: expected true or false, got 1"),
        (HEAD + "check: 1e-6", "3:8: check: expected a mapping, got 1e-06"),
        (HEAD + "check: {rtol: -1}", "3:15: check.rtol: must not be negative, got -1"),
        (HEAD + "check: {sag: 1 m}",
         '3:14: check.sag: expected a pure number (a number, or text such as "5 %"), got "1 m" (length)'),
        (HEAD + "set: [1]", "3:6: set: expected a mapping, got a list"),
        (HEAD + "set: {cable.densty: 1}", "3:7: cable.densty: unknown key (did you mean density?)"),
        (HEAD + "set: {vary: []}",
         "3:7: vary: unknown key of a scene: it is one of a study, of which set and --set change the scene"),
        (HEAD + "set: {cable.material.x: 1}", "3:25: cable.material.x: cable.material is 'aramid', which has no key x"),
        (HEAD + "set: {gravity: 1}\nvary: [{gravity: [2]}]",
         "3:16: gravity: has no effect: the study varies this key, or one that replaces it"),
        (HEAD + "vary: {a: [1]}", '3:7: vary: expected a list, got a mapping (each item of a list begins with "- ")'),
        (HEAD + "vary: [{}]", "3:8: vary.0: an entry without a key"),
        (HEAD + "vary: [{gravity: 5}]",
         "3:18: vary.0.gravity: expected a list of values, or a range {from, to, count}, got 5"),
        (HEAD + "vary: [{gravity: []}]", "3:18: vary.0.gravity: expected at least one value"),
        (HEAD + "vary: [{gravity: {from: 1, to: 2}}]",
         "3:18: vary.0.gravity: a range needs the key count (from, to, count, spacing)"),
        (HEAD + "vary: [{gravity: [1, 2], gondola.mass: [1, 2, 3]}]",
         "3:8: vary.0: keys of one entry go together and need equally many values: gravity 2, gondola.mass 3"),
        (HEAD + "vary: [{gravity: [1]}, {gravity: [2]}]", "3:34: vary.1.gravity: varies in an entry above already"),
        (HEAD + "vary: [{gravity: {from: 1, to: 2, count: 10000}}, {cable.sag: {from: 1, to: 2, count: 10000}}]",
         "3:7: vary: 100000000 cases (at most 10000000)"),
        (HEAD + "vary: [" + ", ".join(f"{{{key}: {{from: 1, to: 2, count: 10000000}}}}"
                                      for key in ("gravity", "gondola.mass", "cable.sag")) + "]",
         "3:7: vary: 1000000000000000000000 cases (at most 10000000)"),
        (HEAD + "vary: [{gravity: [1, -1, x]}]",
         f'3:22: gravity: must not be negative, got -1\nstudy.yaml:3:26: gravity: {ACCELERATION}, got "x"'),
        (HEAD + "vary: [{cable.densty: [1]}]", "3:9: cable.densty: unknown key (did you mean density?)"),
        (HEAD + "vary: [{cable.temperature: [1, 2, 3]}]", "3:9: cable.temperature: unknown key (did you mean "
         "cable.reference.temperature or cases.NAME.temperature?)"),
        (HEAD + "vary: [{cable.length: [1, 2, 3]}]",
         "3:9: cable.length: unknown key (did you mean chord or unstretched_length?)"),
        (HEAD + "vary: [{case: all}]", "3:15: vary.0.case: all: the scene has no cases"),
        (HEAD + "vary: [{cable.sag: all}]",
         "3:20: vary.0.cable.sag: expected a list of values, or a range {from, to, count}, got \"all\""),
        (HEAD + "vary: [{alternative: [a, b]}]",
         "3:22: vary.0.alternative: expected name: {key: value, ...} for each alternative, got a list"),
        (HEAD + "vary: [{alternative: {}}]",
         "3:22: vary.0.alternative: expected at least one alternative, as name: {key: value, ...}"),
        (HEAD + "vary: [{alternative: {' ': {gravity: 1}}}]",
         "3:28: vary.0.alternative. : an alternative needs a name"),
        (HEAD + "vary: [{alternative: {a: {cable.damping: {ratio: 1}, cable.damping.ratio: 2}}}]",
         "3:75: vary.0.alternative.a.cable.damping.ratio: cannot vary together with cable.damping: one of them "
         "contains the other"),
        (HEAD + "vary: [{alternative: {a: {cable.damping: {ratio: 1}}}}, {cable.damping.ratio: [2]}]",
         "3:79: vary.1.cable.damping.ratio: cannot vary together with cable.damping: one of them contains the other"),
        (HEAD + "vary: [{alternative: {a: 3, b: {}}}]",
         "3:26: vary.0.alternative.a: expected {key: value, ...}, got 3"),
        (HEAD + "vary: [{alternative: {a: {gravity: 1}}, gravity: [2]}]",
         "3:50: vary.0.gravity: varies in an entry above already"),
        (HEAD + "vary: [{gravity: [2]}, {alternative: {a: {gravity: 1}}}]",
         "3:52: vary.1.alternative.a.gravity: varies in an entry above already"),
        (HEAD + "vary: [{alternative: {a: {}}}, {alternative: {b: {}}}]",
         "3:46: vary.1.alternative: varies in an entry above already"),
        (HEAD + "vary: [{alternative: {a: {}, b: {}}, gravity: [1, 2, 3]}]",
         "3:8: vary.0: keys of one entry go together and need equally many values: alternative 2, gravity 3"),
        (HEAD + "vary: [{alternative: {a: {cable.densty: 1}}}]",
         "3:27: cable.densty: unknown key (did you mean density?)"),
        (HEAD + "vary: [{alternative: {a: {gravity: 1}, b: {gravity: -1}}}]",
         "3:53: gravity: must not be negative, got -1"),
        (HEAD + "set: {gravity: 1}\nvary: [{alternative: {a: {gravity: 1}, b: {gravity: 2}}}]",
         "3:16: gravity: has no effect: the study varies this key, or one that replaces it"),
        (HEAD + "gondola: {mass: 5}", "3:1: gondola: unknown key of a study: it is one of a scene, which set changes "
         "by dotted keys, as set: {gravity: 9.8}"),
        (HEAD + "vary: [{gravity.x: [1]}]", f"3:21: gravity: {ACCELERATION}, got a mapping"),
        (HEAD + "vary: [{cable.breaking_force: [1 N]}, {cable.strength: [1 Pa]}]",
         "3:40: cable.strength: given together with breaking_force: give exactly one of breaking_force, strength"),
    ],
)  # fmt: skip
def test_a_mistake_is_reported_at_its_place(text, message):
    assert "\n".join(mistakes_of(text + "\n")) == f"study.yaml:{message}"


CASES = "cases: {dry: {}, wet: {loads: [{at: 10 m, mass: 1 kg}]}}\n"


def test_all_load_cases_may_vary():
    write("scene.yaml", SCENE + CASES)
    study = study_of(HEAD + "set: {cases.late.loads: [{at: 90 m, mass: 1 kg}]}\nvary: [{case: all}]\n")
    listed = study_of(HEAD + "set: {cases.late.loads: [{at: 90 m, mass: 1 kg}]}\nvary: [{case: [dry, wet, late]}]\n")
    assert study.resolved() == listed.resolved()
    assert [scene.case for _, scene in study.cases()] == ["dry", "wet", "late"]
    study = read_study(write("study.yaml", HEAD), ["cases.wet=null"], ["case=all", "gravity=1,2"])
    assert [(scene.case, scene.gravity) for _, scene in study.cases()] == [("dry", 1), ("dry", 2)]


def test_a_mistake_of_every_case_is_reported_once():
    write("scene.yaml", SCENE.replace("material: aramid", "elastic_modulus: 70 GPa"))
    line = "scene.yaml:2:3: cable: missing key: one of mass_per_length, density (or give material)"
    assert mistakes_of(HEAD + "vary: [{gravity: [1, 2, 3]}]\n") == [line]
    write("scene.yaml", SCENE)
    first, *_ = mistakes_of(HEAD + "vary: [{cable.tension.at: [end_1, end_2]}, {gravity: [1, 2]}]\n")
    assert first == "study.yaml:3:28: cable.tension: missing key: value"


def test_a_scene_upon_a_base_is_no_study():
    for text, key, line in (("base: scene.yaml\nwinch: {}\n", "winch", 2), ("gravity: 3\nbodies: {}\n", "gravity", 1)):
        (found,) = mistakes_of(text)
        assert found.startswith(f"study.yaml:{line}:1: this is a scene (it has the key {key}): use 'cablestudy static'")


def test_a_set_option_that_the_study_varies_is_refused():
    text = HEAD + "vary: [{cable.area: [1 mm^2]}]\n"
    assert mistakes_of(text, "cable.area=2 mm^2", "cable.diameter=1 mm") == [
        f"--set {key}: has no effect: the study varies this key, or one that replaces it"
        for key in ("cable.area", "cable.diameter")
    ]


def test_a_study_upon_a_study_is_refused():
    write("scene.yaml", SCENE + "vary: []\n")
    assert mistakes_of(HEAD) == ["scene.yaml:7:1: this is a study (it has the key vary): a base must be a scene"]


def test_at_most_100_mistakes_are_shown():
    found = mistakes_of(HEAD + f"vary: [{{gravity: {[-value for value in range(1, 501)]}}}]\n")
    assert len(found) == 101
    assert found[-1] == "study.yaml: and 400 more mistakes"


def test_values_of_a_range_that_are_wrong_in_one_way_are_one_mistake():
    (found,) = mistakes_of(HEAD + "vary: [{gravity: {from: -2, to: 2, count: 500}}]\n")
    assert found.endswith("gravity: must not be negative, got -2")  # not -1.9919...


def test_many_cases_are_checked_entry_by_entry():
    masses = ", ".join(str(mass) for mass in range(1, 1200))
    text = HEAD + f"vary:\n- {{gravity: [1, 2]}}\n- {{gondola.mass: [{masses}, -7]}}\n"
    found = mistakes_of(text)
    assert len(found) == 1
    assert found[0].endswith("gondola.mass: must be positive, got -7")
    wrong_end = HEAD + "vary: [{gravity: {from: 1, to: -1, count: 5000}}]\n"
    assert mistakes_of(wrong_end) == ["study.yaml:3:18: gravity: must not be negative, got -1"]
