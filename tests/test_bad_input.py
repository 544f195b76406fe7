"""Everything that a user can write wrong, through the command line: exit code 2, one line each, nothing written."""

import re
from pathlib import Path

import pytest
from command import CARLINA, CONFIGS, process, run, write

SCENE = """\
gravity: 9.81
cable:
  ends: [[0, 0, 0], [185.8 m, 0, 0]]
  elastic_modulus: 70.3 GPa
  density: 1440 kg/m^3
  area: 2.69 mm^2
  unstretched_length: 184.4883 m
gondola: {mass: 50 kg}
model: {elements: 40}
"""
STUDY = """\
base: scene.yaml
vary:
  - {cable.density: [1440 kg/m^3, 7800 kg/m^3]}
columns: [sag, preload]
reference: printed.csv
"""
PRINTED = "sag_m,preload_N\n0.12,1345\n0.65,1343\n"
PLACE = re.compile(r"[^:]+:\d+:\d+: ")


@pytest.fixture(autouse=True)
def files(folder):
    """In the working directory: a scene, a study upon it, its printed values."""
    for name, text in (("scene.yaml", SCENE), ("study.yaml", STUDY), ("printed.csv", PRINTED)):
        write(name, text)


def refused(folder, *arguments, stdin=None):
    """Lines of standard error of a command that must be refused without a trace."""
    before = sorted(folder.rglob("*"))
    outcome = run(*arguments, stdin=stdin, code=2)
    assert outcome.out == ""
    assert "Traceback" not in outcome.err
    assert sorted(folder.rglob("*")) == before
    assert outcome.lines
    return outcome.lines


def changed(old, new, text=SCENE):
    assert old in text
    return text.replace(old, new, 1)


# what is wrong, in the file, and the line that says so; tests/test_scene.py and test_document.py have every message
SCENES = {
    "misspelt key": (("gravity", "gravty"), "1:1: gravty: unknown key (did you mean gravity?)"),
    "zero with a unit": (("2.69 mm^2", "0 mm^2"), "6:9: cable.area: must be positive"),
    "true for a number": (("9.81", "true"), "1:10: gravity: expected an acceleration"),
    "nothing for a number": (("area: 2.69 mm^2", "area:"), "3:3: cable: missing key: one of area, diameter"),
}


@pytest.mark.parametrize("command", ["static", "modes"])
@pytest.mark.parametrize("what", SCENES)
def test_a_bad_scene_is_refused_in_one_line_at_its_place(folder, what, command):
    change, line = SCENES[what]
    write("bad.yaml", changed(*change))
    (found,) = refused(folder, command, "bad.yaml")
    assert found.startswith(f"bad.yaml:{line}")


def test_a_bad_scene_is_refused_by_sweep_and_validate_too(folder):
    write("scene.yaml", changed("2.69 mm^2", "0"))
    line = "scene.yaml:6:9: cable.area: must be positive, got 0"
    assert refused(folder, "sweep", "study.yaml") == [line]
    assert run("validate", "scene.yaml", "study.yaml", code=2).lines == [line, line]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "bad.yaml: empty file"),
        (b"hello\n", "bad.yaml:1:1: expected a mapping (key: value), got 'hello'"),
        (b"\xff\xfe\x00", "bad.yaml:1:1: byte 0xff is not UTF-8 text (is this a YAML file?)"),
    ],
)
@pytest.mark.parametrize("command", ["static", "sweep"])
def test_files_that_are_neither_scene_nor_study_are_refused(folder, command, content, message):
    Path("bad.yaml").write_bytes(content)
    assert refused(folder, command, "bad.yaml") == [message]
    assert refused(folder, command, "-", stdin=content) == [message.replace("bad.yaml", "<stdin>")]


@pytest.mark.parametrize("command", ["static", "modes", "sweep"])
def test_missing_files_are_refused(folder, command):
    assert refused(folder, command, "absent.yaml") == ["absent.yaml: no such file"]
    assert refused(folder, command, ".") == [".: a directory, not a file"]


def test_scenes_and_studies_given_to_the_wrong_command_are_refused(folder):
    for command in ("static", "modes"):
        line = "study.yaml:2:1: this is a study (it has the key vary): use 'cablestudy sweep'"
        assert refused(folder, command, "study.yaml") == [line]
    (line,) = refused(folder, "sweep", "scene.yaml")
    assert line.startswith("scene.yaml:2:1: this is a scene (it has the key cable): use 'cablestudy static'; a study")


def test_several_mistakes_are_reported_at_once_in_the_order_of_the_file(folder):
    text = SCENE
    for change in (("gravity", "gravty"), ("70.3 GPa", "70.3 GN"), ("2.69 mm^2", "-1"), ("50 kg", "0")):
        text = changed(*change, text)
    write("bad.yaml", text)
    found = refused(folder, "static", "bad.yaml", "--set", "model.elements=0")
    assert found[0].startswith("--set model.elements: expected a whole number")
    assert all(PLACE.match(line) for line in found[1:])
    assert [line.split(":")[1] for line in found[1:]] == ["1", "4", "6", "8"]


# what is wrong in the study, the study, and the line that says so; test_study_file.py has more
STUDIES = {
    "column of a part": (
        ("preload]", "stiffness_zz]"),
        ["4:16: columns.1: unknown column 'stiffness_zz' (of one cable end_stiffness_zz; a part of a suspension has"],
    ),
    "unknown column": (("preload]", "prelod]"), ["4:16: columns.1: unknown column 'prelod' (did you"]),
    "no mode 0": (("preload]", "axial_frequency_0]"), ["4:16: columns.1: unknown column 'axial_frequency_0' "]),
    "a column twice": (("preload]", "sag_m]"), ["4:16: columns.1: sag is listed twice"]),
    "no strength": (("preload]", "utilisation]"), ["4:16: columns.1: utilisation needs the key cable.breaking_force"]),
    "no loads": (("preload]", "deflection]"), ["4:16: columns.1: deflection needs the key cable.loads"]),
    "no wind": (("preload]", "gondola_rms]"), ["4:16: columns.1: gondola_rms needs the key gondola.area"]),
    "a bad value": (("7800 kg/m^3", "7800 kg"), ["3:35: cable.density: expected a density"]),
    "its own base": (("scene.yaml", "study.yaml"), ["1:7: base: base files in a circle"]),
    "a directory as reference": (("printed.csv", "."), ["5:12: reference: .: a directory, not a file"]),
    "tolerances of what is not there": (
        ("reference: printed.csv", "check: {rtol: 1e-9, sagg: 1e-3, mass: 0, sag: 0, sag_m: 1, status: 1}"),
        [
            "5:21: check.sagg: unknown column 'sagg' (did you mean sag?)",
            "5:33: check.mass: mass is not among the study's columns",
            "5:50: check.sag_m: given twice",
            "5:60: check.status: status is not among the study's columns",
        ],
    ),
    "a column that the plot has right": (
        ("preload]", "prelod]\nplot: {x: sag, y: preload}"),
        ["4:16: columns.1: unknown column 'prelod'"],
    ),
    "a key that the plot has right": (
        ("{cable.density: [1440 kg/m^3, 7800 kg/m^3]}", "{cable.densty: [1, 2]}\nplot: {x: cable.density, y: sag}"),
        ["3:6: cable.densty: unknown key (did you mean density?)"],
    ),
    "a bad plot": (("reference: printed.csv", "plot: {x: sag, y: mass}"), ["5:19: plot.y: mass is not among"]),
}


@pytest.mark.parametrize("what", STUDIES)
def test_a_bad_study_is_refused_before_anything_is_computed(folder, what, monkeypatch):
    monkeypatch.setattr("cablestudy.sweeps.chunks.evaluate_tables", None)
    change, lines = STUDIES[what]
    write("study.yaml", changed(*change, STUDY))
    found = refused(folder, "sweep", "study.yaml")
    assert all(one.startswith(f"study.yaml:{line}") for one, line in zip(found, lines, strict=True))


WRONG_SCENE = """\
base: scene.yaml
cable: {diameter: 3 kg}
case: summer
limits: {a: sagg <= 3 m, b: {that: sag <= 3 m, cases: [winter]}, c: {that: sag <= 3 m, cases: [ice]}, d: sag}
cases: {ice: {loads: [{fraction: 2, mass: 1}]}}
"""


def test_mistakes_in_keys_and_in_names_of_load_cases_and_columns_are_told_at_once(folder):
    """The file has both: pydantic compares names only where each key is right alone, limits are read after it."""
    write("bad.yaml", WRONG_SCENE)
    expected = {
        "2:19": "cable.diameter: expected a length", "3:7": 'case: unknown case "summer" (allowed: ice)',
        "4:13": "limits.a: unknown column 'sagg'", "4:56": 'limits.b.cases.0: unknown load case "winter"',
        "4:106": "limits.d: expected COLUMN <= NUMBER", "5:34": "cases.ice.loads.0.fraction: must be between 0 and 1",
    }  # fmt: skip
    for command in ("static", "validate", "report"):
        found = run(command, "bad.yaml", code=2).lines
        assert [line.split(": ")[0] for line in found] == [f"bad.yaml:{at}" for at in expected], command
        assert all(text in line for line, text in zip(found, expected.values(), strict=True))
    names = WRONG_SCENE.replace("cable: {diameter: 3 kg}\n", "").replace("fraction: 2", "fraction: 0.2")
    write("bad.yaml", names.replace(", d: sag}", "}"))
    found = refused(folder, "static", "bad.yaml")
    assert [line.split(":")[1:3] for line in found] == [["2", "7"], ["3", "13"], ["3", "56"]]


WRONG = """\
title: [a]
base: scene.yaml
set: {cable.aera: 1 mm^2}
vary:
  - {cable.elastic_modulus: [70 GPa, 2 kg]}
  - {cable.density: {from: 1000, to: 2000, count: 3, spacing: lg}}
columns: [sag, foo, sag_m]
reference: absent.csv
check: {foo: 1e-3, sgg: 1e-3}
plot: {x: gravity, y: [foo, sgg]}
colour: 4
"""


def test_mistakes_of_all_parts_of_a_study_are_told_at_once(folder):
    """And none that only follow from others: of `foo` in check and plot, of the density that does not vary."""
    write("study.yaml", WRONG)
    expected = {
        "1:8": "title: expected text", "3:7": "cable.aera: unknown key", "5:38": "cable.elastic_modulus: expected a",
        "6:21": "vary.1.cable.density: spacing", "7:16": "columns.1: unknown column 'foo'",
        "7:21": "columns.2: sag is listed twice", "8:12": "reference: absent.csv: no such file",
        "9:20": "check.sgg: unknown column 'sgg'", "10:29": "plot.y: unknown column 'sgg'", "11:1": "colour: unknown",
    }  # fmt: skip
    for command in ("sweep", "validate", "report"):
        found = run(command, "study.yaml", code=2).lines
        lines = [f"study.yaml:{at}: {text}" for at, text in expected.items()]
        assert all(one.startswith(line) for one, line in zip(found, lines, strict=True))
    write("study.yaml", WRONG.replace("scene.yaml", "absent.yaml"))
    without_base = [at for at in expected if at not in ("3:7", "5:38")]
    *lines, of_option = refused(folder, "sweep", "study.yaml", "--vary", "gravity=")
    assert of_option.startswith("--vary gravity")
    assert [":".join(line.split(":")[1:3]) for line in lines] == [without_base[0], "2:7", *without_base[1:]]


@pytest.mark.parametrize(
    ("table", "messages"),
    [
        ("sag_m,preload_N\n0.12,1345\n", ["1 row, and the study has 2 cases"]),
        ("sag_m,preload_N\n1,2\n3,4\n5,6\n", ["3 rows, and the study has 2 cases"]),
        ("sag_m,mass_kg\n1,2\n3,4\n", ["column 'mass_kg' is not among the study's columns"]),
        # names have units, as those of the table that it is compared with
        ("sag,preload_N\n1,2\n3,4\n", ["column 'sag' is not among the study's columns (did you mean 'sag_m'?)"]),
        ("sag_m,preload_N\n1,much\n,nan\n", [f"row {n}, preload_N: not a number: '{cell}'"
                                             for n, cell in ((1, "much"), (2, "nan"))]),
        ("sag_m,preload_N\n1,2,3\n4\n", [f"row {n} has {cells} cells, and the table 2 columns"
                                         for n, cells in ((1, 3), (2, 1))]),
        ("sag_m,sag_m\n1,2\n3,4\n", ["column 'sag_m' is there twice"]),
        ("", ["not a table of comma-separated values (it is empty)"]),
    ],
)  # fmt: skip
def test_a_reference_table_that_does_not_fit(folder, table, messages):
    write("printed.csv", table)
    found = refused(folder, "sweep", "study.yaml")
    beginning = "study.yaml:5:12: reference: printed.csv"
    for line, message in zip(found, messages, strict=True):
        assert line.startswith(beginning)
        assert line.endswith(message)


def test_outputs_that_cannot_be_written_are_refused(folder):
    write("file", "x")
    for out in ("file", "file/below"):
        assert refused(folder, "sweep", "study.yaml", "--out", out) == [f"--out {out}: file is a file, not a folder"]
    line = "results/study.csv: no such file to compare with (run the sweep without --check first)"
    assert refused(folder, "sweep", "study.yaml", "--check") == [line]
    for command, file in (("static", "scene.yaml"), ("modes", "scene.yaml"), ("sweep", "study.yaml")):
        line = "--plot x.gif: unknown kind of picture (allowed: .png, .svg, .pdf)"
        assert refused(folder, command, file, "--plot", "x.gif") == [line]
    assert refused(folder, "static", "scene.yaml", "--plot", "no/x.png") == ["--plot no/x.png: no such folder"]


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("gravty=1", "--set gravty: unknown key (did you mean gravity?)"),
        ("gravity", "--set gravity: expected key=value, for example cable.area=3 mm^2"),
        ("gondola.mass.x=1", "--set gondola.mass.x: gondola.mass is '50 kg', which has no key x"),
        ("cable=5", "--set cable: expected a mapping with the keys axial_stiffness, "),
        ("cable.ends.7=1", "--set cable.ends.7: cable.ends has 2 items, counted"),
        ("model.order=65", "--set model.order: expected a whole number from 1 to 64, got 65"),
        ("cable.loads=[{at: 185 m, force: [0, 0, 1]}]", "--set cable.loads: cable.loads.0.at: 185 m is not on the"),
        ("cable.damping={model: modal, ratio: -0.01}", "--set cable.damping: "),
        ("cable.damping={model: hysteretic, loss_factor: -1}", "--set cable.damping: "),
        ("cable.damping={model: viscous}", "--set cable.damping"),
        ("wind.speed=0", "--set wind.speed: must be positive, got 0"),
        ("wind.speed=6 m", "--set wind.speed: expected a speed"),
        ("wind.spectrum=karman", "--set wind.spectrum: "),
        ("wind.admittance=all", "--set wind.admittance: "),
        ("winch.location=roof", "--set winch.location: "),
        ("winch.controller.gain=auto", "--set winch.controller.gain: "),
        ("winch.controller.gain={auto: {gain_margin: 0 dB}}", "--set winch.controller.gain"),
        ("winch.controller.notch=some", "--set winch.controller.notch: "),
        # what made the program stop with a traceback, or numpy warn; test_scene has the ranges of all keys
        ("cable.elastic_modulus=1e-12", "--set cable.elastic_modulus: times the area of the cross-section is 2.69e-18"),
        ("gravity=1e308", "--set gravity: must be 0, or from 1e-30 to 1e+06 m/s^2, got 1e+308"),
        ("cable.preload=1e300 N", '--set cable.preload: must be from 1e-24 to 1e+24 N, got "1e300 N"'),
        ("cable.ends.1.0=1e300", "--set cable.ends.1.0: must be from -1e+09 to 1e+09 m, got 1e+300"),
        ("winch.controller.gain={auto: {gain_margin: 6 dB, sensitivity: 1}}",
         "--set winch.controller.gain: winch.controller.gain.auto.sensitivity: must be from 1.001 to"),
        ("<<=1", "--set <<: unknown key (keys are not merged: "),
        ("cable.\udcff=1", f'{CARLINA}:3:3: cable: expected text in UTF-8, got "\\udcff"'),  # a byte that is none
    ],
)  # fmt: skip
def test_a_bad_set_option(folder, option, message):
    for command in ("static", "modes", "windrms", "ssm"):
        (found,) = refused(folder, command, CARLINA, "--set", option)
        assert found.startswith(message)


def test_a_value_with_both_quotes_is_shown_as_it_is(folder):
    text = "5'3" + '"'
    (found,) = refused(folder, "static", "scene.yaml", "--set", "gravity=" + text)
    assert f'got "{text}" (' in found


def test_a_column_in_capitals_has_a_hint(folder):
    assert "(did you mean sag?)" in refused(folder, "static", "scene.yaml", "--columns", "SAG")[0]
    assert "(did you mean sag?)" in refused(folder, "sweep", "study.yaml", "--columns", "SAG")[0]


def test_a_key_that_several_tables_have_is_suggested_once(folder):
    write("scene.yaml", "cables: {}\nbody: {}\n")
    found = refused(folder, "static", "scene.yaml")
    assert any("body: unknown key (did you mean control.body or actuators.NAME.body?)" in line for line in found)


BLANK = "write {}, with a blank after the colon"


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("cable.damping={loss_factor:0.02}",
         f"--set cable.damping: cable.damping.loss_factor:0.02: unknown key ({BLANK.format('loss_factor: 0.02')})"),
        ("cable.damping={ratio: 0.02, viscus: }",
         "--set cable.damping: cable.damping.viscus: unknown key (did you mean viscous?)"),
        ("cable.loads=[{at: 2 m, mass: 3, weight: null}]",
         "--set cable.loads: cable.loads.0.weight: unknown key (allowed: at, fraction, force, mass)"),
        ("cable.densty=null", "--set cable.densty: unknown key (did you mean density?)"),
        ("cases={calm: }", "--set cases: cases.calm: no value (an empty mapping is written {})"),
        ("cases.calm=null", "--set cases.calm: unknown case calm (there is none)"),
        ("materials={rope: {elastic_modulus: 3 GPa, density: 900, strength:3 }}",
         f"--set materials: materials.rope.strength:3: unknown key ({BLANK.format('strength: 3')})"),
    ],
)  # fmt: skip
def test_an_unknown_key_without_a_value_is_refused(folder, option, message):
    assert refused(folder, "static", "scene.yaml", "--set", option) == [message]


def test_a_key_without_a_value_is_refused_at_its_place_in_any_file(folder):
    flow = "  damping: {ratio:0.02}\n"
    write("base.yaml", changed("gondola:", f"{flow}gondola:"))
    write("scene.yaml", "base: base.yaml\ngravty:\n")
    unknown = f"cable.damping.ratio:0.02: unknown key ({BLANK.format('ratio: 0.02')})"
    lines = [f"base.yaml:8:13: {unknown}", "scene.yaml:2:1: gravty: unknown key (did you mean gravity?)"]
    assert refused(folder, "static", "scene.yaml") == lines
    assert refused(folder, "sweep", "study.yaml") == lines
    assert refused(folder, "static", "scene.yaml", "--set", "cable.damping={ratio: 0.1}") == lines[1:]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("vary: [{cable.damping: [{ratio: 0.1}, {ratio:0.02}]}]\ncolumns: [sag]\n",
         f"2:39: cable.damping.ratio:0.02: unknown key ({BLANK.format('ratio: 0.02')})"),
        ("vary: [{cable.densty: [null]}]\ncolumns: [sag]\n",
         "2:9: cable.densty: unknown key (did you mean density?)"),
        ("vary: [{cable.area:[1 mm^2]}]\ncolumns: [sag]\n", "2:19: a colon behind a key is followed by a blank"),
        ("set: {cable.area:0.5 mm^2}\nvary: [{gravity: [9]}]\ncolumns: [sag]\n",
         f"2:26: cable.area:0.5 mm^2: no value ({BLANK.format('cable.area: 0.5 mm^2')})"),
        ("vary: [{gravity: [9]}]\ncolumns: [sag]\ncheks:\n", "4:1: cheks: unknown key (did you mean check?)"),
    ],
)  # fmt: skip
def test_a_key_without_a_value_is_refused_in_a_study(folder, text, message):
    write("study.yaml", f"base: scene.yaml\n{text}")
    assert refused(folder, "sweep", "study.yaml") == [f"study.yaml:{message}"]


@pytest.mark.parametrize(
    ("gondola", "key"),
    [
        ("", "wind"),
        ("gondola: {mass: 50 kg}", "gondola.area"),
        ("gondola: {mass: 50 kg, drag_coefficient: 1}", "gondola.area"),
        ("gondola: {mass: 50 kg, area: 1 m^2}", "gondola.drag_coefficient"),
        ("gondola: {mass: 50 kg, area: 1 m^2, drag_coefficient: 1}", "wind"),
    ],
)
def test_windrms_names_the_key_that_it_needs(folder, gondola, key):
    write("scene.yaml", changed("gondola: {mass: 50 kg}", gondola))
    (found,) = refused(folder, "windrms", "scene.yaml")
    assert all(part in found for part in ("scene.yaml", key, "windrms"))


def test_a_process_of_its_own_shows_no_traceback_either(folder):
    write("bad.yaml", changed("2.69 mm^2", ".nan"))
    outcome = process("static", "bad.yaml")
    assert (outcome.code, outcome.out, len(outcome.lines)) == (2, "", 1)
    assert PLACE.match(outcome.err)


def test_the_files_in_configs_are_valid():
    files = sorted(str(path) for path in CONFIGS.glob("*.yaml"))
    outcome = run("validate", *files, "--format", "csv")
    assert CARLINA in files
    assert outcome.out.count(",ok\n") == len(files)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["static", "a\nb.yaml"], r"a\nb.yaml: no such file"),
        (["static", ""], "expected the name of a file, got ''"),
        (["static", "scene.yaml", "--set", "\x1b[31mx=3"], r"--set \x1b[31mx: unknown key"),
        (["static", "scene.yaml", "--set", "gravity=1e-320"], "--set gravity: must be 0, or from 1e-30 to 1e+06 m/s^2"),
        (["static", "scene.yaml", "--plot", ".svg"], "--plot .svg: unknown kind of picture"),
        (["static", "scene.yaml", "--plot", "x" * 300 + ".svg"], "--plot xxx"),
        (["modes", "scene.yaml", "--upto", " "], "modes: --upto is empty"),
        (["sweep", "study.yaml", "--out", ""], "sweep: --out is empty"),
        (["static", "scene.yaml", "--set", "gravity=1", "--set", ""], "static: --set is empty"),
        (["ssm", "scene.yaml", "--response", "1Hz:2Hz:3", "--input", ","], "ssm: Invalid value"),
        (["find", "scene.yaml", "sag = 1 m", "--by", "cable.damping"], "--by cable.damping: holds no number"),
    ],
)  # fmt: skip
def test_odd_names_and_empty_options_are_one_line(folder, arguments, line):
    (found,) = refused(folder, *arguments)
    assert found.removeprefix("main ").startswith(line)  # the name of the program in tests
