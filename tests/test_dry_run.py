"""sweep --dry-run: the cases as a table, in every format, in little memory; --vary; varied keys as columns."""

import itertools
import tracemalloc
from pathlib import Path

import pytest
from campaign import campaign
from command import CONFIGS, refusal, rows_of, run, study_file, table_of, write

from cablestudy.errors import SceneError
from cablestudy.scene.study import read_study
from cablestudy.study.prepare import check_cases
from cablestudy.study.table import Field, Table, short
from cablestudy.study.varied_keys import varied_keys
from cablestudy.sweeps.rows import cases_table

pytestmark = pytest.mark.usefixtures("folder")

VARY = """\
vary:
  - {cable.material: [aramid, "steel"], cable.preload: [1 kN, 2 kN]}
  - {gondola.mass: {from: 1, to: 100, count: 3, spacing: log}}
  - {winch.controller.notch: [none, {frequency: static}]}
columns: [mass, sag]
"""


FIELDS = {
    "cable.preload_N": Field("cable.preload_N", "cable.preload", "N"),
    "gondola.mass_kg": Field("gondola.mass_kg", "gondola.mass", "kg"),
    "gravity_m_per_s2": Field("gravity_m_per_s2", "gravity", "m/s^2", distinct=True),
}


def cases(text=VARY):
    return table_of("sweep", study_file(".", text), "--dry-run")


@pytest.mark.crossed
@pytest.mark.parametrize("style", ["md", "csv", "json", "jsonl"])
@pytest.mark.parametrize(
    "text",
    [VARY, "columns: [sag]\n", "vary: [{gravity: {from: 1, to: 2, count: 1000}}]\ncolumns: [sag]\n"],
    ids=["mixed", "nothing varied", "numbers"],
)
def test_every_format_has_the_same_cases(style, text):
    rows = cases(text)
    table = Table(tuple(FIELDS.get(name, Field(name, name)) for name in rows[0]), rows)
    assert run("sweep", "study.yaml", "--dry-run", "--format", style).out == table.render(style)


def test_the_cases_are_those_that_the_sweep_computes(folder):
    rows = cases()
    assert [row["row"] for row in rows] == list(range(1, 13))
    study = read_study("study.yaml")
    assert [row["gondola.mass_kg"] for row in rows] == [study.overrides(i)["gondola.mass"] for i in range(12)]
    assert rows[0] == {"row": 1, "cable.material": "aramid", "cable.preload_N": 1000.0, "gondola.mass_kg": 1.0,
                       "winch.controller.notch": "none"}  # fmt: skip
    assert rows[1]["winch.controller.notch"] == '{"frequency": "static"}'
    assert sorted(path.name for path in folder.iterdir()) == ["study.yaml"]


def test_a_wrong_study_is_refused_before_the_first_line():
    study_file(".", VARY.replace("2 kN]", "2 mm]"))
    assert "cable.preload: expected a force" in refusal("sweep", "study.yaml", "--dry-run")


def test_a_load_case_that_varies_is_shown_beside_the_number_of_its_row():
    text = "vary: [{case: [everyday, storm]}]\ncolumns: [sag]\n"
    rows = table_of("sweep", study_file(".", text, base=str(CONFIGS / "guy.yaml")), "--dry-run")
    assert rows == [{"row": 1, "case": "everyday"}, {"row": 2, "case": "storm"}]


@pytest.fixture
def million():
    """A study of a million cases."""
    vary = "[{gravity: {from: 1, to: 9, count: 1000}}, {cable.area: {from: 1 mm^2, to: 2 mm^2, count: 1000}}]"
    return read_study(study_file(".", f"vary: {vary}\ncolumns: [mass]\n"))


def test_a_million_cases_take_no_memory(million):
    assert million.count == 1_000_000
    count = campaign(5_000, 1_200)
    for style in ("md", "csv", "json", "jsonl"):
        tracemalloc.start()
        lines = sum(piece.count("\n") for piece in itertools.islice(cases_table(million).pieces(style), count))
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert lines == 2 + 1001 + 2 if style == "md" else lines >= count - 1
        assert peak < 5e6


def test_markdown_shows_both_ends_of_a_million_cases(million):
    lines = cases_table(million).render("md").splitlines()
    first = [lines[row].split("|")[1].strip() for row in (2, 501, 502, 503, 1002)]
    assert first == ["1", "500", "…", "999501", "1000000"]
    left_out = "999000 of 1000000 rows are left out here, from 501 to 999500; csv, json and jsonl have them all."
    assert lines[-1] == left_out


def varied(*vary, text="columns: [mass, sag]\n", sets=()):
    study = read_study(study_file(".", text), sets, vary)
    check_cases(study)
    return [study.overrides(i) for i in range(study.count)]


LEVEL, STEEP = [[0, 0, 0], [9, 0, 0]], [[0, 0, 0], [8, 0, 1]]


@pytest.mark.parametrize(
    ("option", "values"),
    [
        ("gravity=1:3:3", [1, 2, 3]),
        ("gravity=1:3:3linear", [1, 2, 3]),
        ("gravity = 1 : 3 : 3 linear", [1, 2, 3]),
        ("cable.preload=100N:10kN:3log", ["100 N", "1000 N", "10000 N"]),
        ("cable.area=3 mm^2,4mm^2", ["3 mm^2", "4mm^2"]),
        ("cable.material=steel", ["steel"]),
        ("cable.ends=[[0,0,0],[9,0,0]],[[0,0,0],[8,0,1]]", [LEVEL, STEEP]),
        ("winch.controller.notch=none,{frequency: 1 Hz}", ["none", {"frequency": "1 Hz"}]),
    ],
)
def test_dimensions_from_the_command_line(option, values):
    sets = ["cable.unstretched_length=9"] if "ends" in option else []
    key = option.partition("=")[0].strip()
    assert varied(option, sets=sets) == [{key: value} for value in values]


def test_they_multiply_and_run_fastest_in_their_order():
    text = "vary: [{gravity: [1, 2]}]\ncolumns: [mass]\n"
    cases = varied("cable.area=1e-6,2e-6", "cable.preload=1kN,2kN", text=text)
    assert [tuple(case.values()) for case in cases[:4]] == [
        (1, 1e-6, "1kN"), (1, 1e-6, "2kN"), (1, 2e-6, "1kN"), (1, 2e-6, "2kN"),
    ]  # fmt: skip
    assert len(cases) == 8


def test_they_replace_what_the_study_fixes_and_what_excludes_them():
    text = "set: {cable.diameter: 1 mm, gravity: 3}\ncolumns: [mass]\n"
    study = read_study(study_file(".", text), vary=["cable.area=1e-6,2e-6", "gravity=4,5"])
    scene = study.case(3)[1]
    assert (scene.cable.area, scene.cable.diameter, scene.gravity) == (2e-6, None, 5)


def test_printed_values_are_left_out_beside_other_cases():
    options = ("--vary", "cable.area=24 mm^2,20 mm^2", "--no-write", "--format", "json")
    outcome = run("sweep", CONFIGS / "preload.yaml", *options)
    rows = rows_of(outcome.out, "json")
    assert len(rows) == 12
    assert not [name for name in rows[0] if "printed" in name]
    assert outcome.err == "paper/table6.csv left out: its rows are those of the study without --vary\n"


COLUMNS = "columns: [mass]\n"
HOW = "expected KEY=FROM:TO:COUNT, KEY=FROM:TO:COUNTlog or KEY=A,B,C, for example cable.preload=100N:2kN:20log"
AREA = "vary: [{cable.area: [1 mm^2]}]\n"


@pytest.mark.parametrize(
    ("text", "options", "messages"),
    [
        *(("", [option], [f"--vary gravity: {HOW}"]) for option in ("gravity", "gravity=1:2", "gravity=1:2:3:4")),
        ("", ["gravity="], [f"--vary gravity=: {HOW}"]),
        ("", ["a..b=1"], ["--vary a..b: a key is written as names joined by dots, for example cable.area"]),
        ("", ["gravity=1:2:x"],
         ['--vary gravity: count: expected a whole number, with log behind it for equal ratios, got "x"']),
        ("", ["gravity=1:2:0"], ["--vary gravity: count: expected a whole number from 1 to 10000000, got 0"]),
        ("", ["gravity=1:2:1"], ["--vary gravity: count: a range of one value needs equal ends"]),
        ("", ["gravity=0:2:3log"], ["--vary gravity: spacing: log needs ends of one sign, not zero, got 0 and 2"]),
        ("", ["gravity=:2:3"], ['--vary gravity: from: expected a number, or text such as "10 kg", got null']),
        ("", ["cable.preload=1N:2:3"],
         ['--vary cable.preload: from and to: give both with a unit or both without, got "1N" and 2']),
        ("", ["cable.preload=1N:2mm:3"], ['--vary cable.preload: "mm" (length) and "N" (force) do not fit each other']),
        ("", ["gravity=[1"], ["--vary gravity: "]),
        ("", ["gravity=1,,2"], ["--vary gravity: "]),
        ("", ["gravity=1,-2,x"],
         ["--vary gravity: must not be negative, got -2", "--vary gravity: expected an acceleration"]),
        ("", ["cable.densty=1,2"], ["--vary cable.densty: unknown key (did you mean density?)"]),
        ("", ["gravity=1,2", "gravity=3,4"], ["--vary gravity: varies already"]),
        (AREA, ["cable.area=1,2"], ["--vary cable.area: varies already"]),
        (AREA, ["cable.diameter=1,2"],
         ["--vary cable.diameter: cannot vary together with cable.area: they exclude each other"]),
        ("", ["cable.sag=1,2", "cable.preload=1,2"],
         ["--vary cable.preload: cannot vary together with cable.sag: they exclude each other"]),
        ("vary: [{gondola: [{mass: 3}]}]\n", ["gondola.mass=1,2"],
         ["--vary gondola.mass: cannot vary together with gondola: one of them contains the other"]),
        ("sample: {method: sobol, count: 4, over: {cable.area: {from: 1, to: 2}}}\n", ["cable.diameter=1,2"],
         ["--vary cable.diameter: cannot vary together with cable.area: they exclude each other"]),
        ("", ["gravity=1:2:10000", "gondola.mass=1:2:10000"], ["--vary: 100000000 cases (at most 10000000)"]),
        ("", ["gravity", "cable.preload=1:x:3"], [f"--vary gravity: {HOW}", "--vary cable.preload: to: expected"]),
    ],
)  # fmt: skip
def test_a_wrong_dimension_is_refused_by_its_name(text, options, messages):
    with pytest.raises(SceneError) as caught:
        varied(*options, text=text + COLUMNS)
    found = str(caught.value).splitlines()
    assert len(found) == len(messages), found
    for line, message in zip(found, messages, strict=True):
        assert line.startswith(message)
    arguments = [part for option in options for part in ("--vary", option)]
    outcome = run("sweep", "study.yaml", *arguments, "--no-write", code=2)
    assert outcome.lines == found


def test_a_set_option_beside_a_dimension_has_no_effect():
    for key in ("cable.area", "cable.diameter"):
        with pytest.raises(SceneError, match=f"--set {key}: has no effect: the study varies this key"):
            varied("cable.area=1e-6,2e-6", sets=[f"{key}=1 mm^2"])
    assert varied("cable.area=1e-6,2e-6", sets=["gravity=3"])


# ----------------------------------------------------------------------------------------------- varied keys as columns


# numbers in SI with the unit in the name where every value is one, else text as written
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
        ("cable.loads: [null, [{at: 1 m, force: [0, 0, 1]}]]", "cable.loads", "cable.loads",
         ["null", '[{"at": "1 m", "force": [0, 0, 1]}]']),
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
    assert [line.split(",")[:2] for line in lines] == [
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
    write(stored, text.replace("gondola.mass_kg", "gondola.mass").replace("\n5.0,", "\n5 kg,"))
    told = "column gondola.mass: stored as text by an earlier version, now gondola.mass_kg: sweep it anew without"
    assert refusal("sweep", "study.yaml", "--check", code=1) == f"results/study.csv: {told} --check"
    run("sweep", "study.yaml")
    assert stored.read_text(encoding="utf-8") == text


def test_rows_of_an_earlier_version_are_used_again(folder):
    """Stored rows hold no varied keys: what they are called is no reason to compute anew."""
    study_file(".", "vary: [{gondola.mass: [5 kg, 6 kg]}]\ncolumns: [mass]\n")
    run("sweep", "study.yaml")
    table = Path("results/study.csv").read_bytes()
    assert run("sweep", "study.yaml", "--resume").lines[0].startswith("2 of 2 rows")
    assert Path("results/study.csv").read_bytes() == table
