"""--where, --pareto, --sort and --best on studies: which rows are shown, what is stored, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from command import refusal, rows_of, run, study_file

from cablestudy.scene.study import read_study
from cablestudy.study import pareto
from cablestudy.study.pareto import pareto_front
from cablestudy.study.tolerances import STUDY as TOLERANCES
from cablestudy.sweeps.select import read_selection

# the third one is over strength, the fourth too slack for its weight
STUDY = "vary: [{cable.preload: [1345 N, 600 N, 100 kN, 1 N, 2 kN]}]\ncolumns: [mass, sag]\n"


pytestmark = pytest.mark.usefixtures("rows_once")


@pytest.fixture(autouse=True)
def study(folder):
    """In the working directory of a test."""
    study_file(folder, STUDY)


def shown(*arguments, code=3, style="json"):
    outcome = run("sweep", "study.yaml", "--no-write", "--format", style, *arguments, code=code)
    return rows_of(outcome.out, style), outcome


def preloads(rows):
    """The preloads of rows as the study writes them."""
    written = {1345.0: "1345 N", 600.0: "600 N", 1e5: "100 kN", 1.0: "1 N", 2e3: "2 kN"}
    return ", ".join(written[row["cable.preload_N"]] for row in rows)


def test_the_errors_in_json_are_those_of_the_rows_that_are_shown():
    # bars: each row has an error of its own
    study = STUDY.replace("sag]", "sag, error_estimate]")
    study_file(Path.cwd(), f"set: {{model.elements: 10}}\n{study}")
    for options in ((), ("--where", "sag < 0.2"), ("--sort", "sag"), ("--best", "max sag"), ("--where", "sag > 1 km")):
        table = json.loads(shown(*options)[1].out)
        assert len(table["errors"]) == len(table["rows"])
        for row, errors in zip(table["rows"], table["errors"], strict=True):
            assert max(errors.values(), default=None) == (row["error_estimate"] and max(row["error_estimate"], 1e-12))


def test_where_shows_the_rows_that_satisfy_it():
    known = [row for row in shown()[0] if row["sag_m"] is not None]
    small = [row for row in known if row["sag_m"] < 0.1]
    assert (len(known), len(small)) == (4, 2)
    for condition, expected in {
        "sag < 0.1": small,
        "sag < 100 mm": small,
        "not sag < 0.1": [row for row in known if row not in small],
        "sag < 0.1 or mass > 0": known,
        "cable.preload_N > 1 kN and sag < 0.1": small,
    }.items():
        rows, outcome = shown("--where", condition)
        assert rows == expected
        assert outcome.lines[-1] == f"selected: {len(rows)} of 5 rows"
    for condition, expected in {
        "status != ok": "100 kN, 1 N",
        "status == 'over strength'": "100 kN",
        "cable.preload > 1 kN": "1345 N, 100 kN, 2 kN",
    }.items():
        assert preloads(shown("--where", condition)[0]) == expected


@pytest.mark.parametrize(
    ("condition", "kelvin"),
    [
        ("> 0 degC", [293.15]),
        (">= 32 °F", [273.15, 293.15]),  # 32 degF is 0 degC by definition
        ("== -40 degF", [233.15]),  # where both scales meet
        ("< 273.15", [233.15, 253.15]),  # in SI, as all numbers without a unit
        ("< 273.15 K", [233.15, 253.15]),
    ],
)
def test_a_temperature_is_compared_on_its_scale(condition, kelvin):
    keys = ", ".join(f"{value} degC" for value in (-40, -20, 0, 20))
    cable = "cable.expansion: 12e-6 1/K, cable.reference.temperature: 15 degC"
    study = f"set: {{{cable}, cases: {{day: {{}}}}, case: day}}\n"
    study_file(Path.cwd(), f"{study}vary: [{{cases.day.temperature: [{keys}]}}]\ncolumns: [sag]\n")
    rows, _ = shown("--where", f"cases.day.temperature {condition}", code=0)
    assert [row["cases.day.temperature_K"] for row in rows] == kelvin


def test_no_row_is_an_empty_table():
    assert [shown("--where", "sag < 0", style=style)[0] for style in ("csv", "json", "jsonl")] == [[], [], []]
    assert run("sweep", "study.yaml", "--no-write", "--where", "sag < 0", code=3).out.startswith("| cable.preload")


@pytest.mark.parametrize(
    ("options", "order"),
    [
        ("--quiet", "1345 N, 600 N, 100 kN, 1 N, 2 kN"),
        ("--sort|sag", "100 kN, 2 kN, 1345 N, 600 N, 1 N"),  # empty cells are last
        ("--sort|-sag_m", "600 N, 1345 N, 2 kN, 100 kN, 1 N"),
        ("--sort|chord", "1345 N, 600 N, 100 kN, 1 N, 2 kN"),  # equal rows keep their order; all have a chord
        ("--sort|cable.preload", "1 N, 600 N, 1345 N, 2 kN, 100 kN"),
        ("--sort|cable.preload_N", "1 N, 600 N, 1345 N, 2 kN, 100 kN"),
        ("--sort|-cable.preload", "100 kN, 2 kN, 1345 N, 600 N, 1 N"),
        ("--best|min sag", "100 kN"),  # over strength is an answer
        ("--best|min sag|--where|status == ok", "2 kN"),
        ("--best|min sag|--where|utilisation < 1", "2 kN"),
        ("--best|max sag_m", "600 N"),
        ("--best|min sag|--where|sag > 0.1", "1345 N"),
        ("--best|max cable.preload", "100 kN"),
        ("--best|min chord", "1345 N"),  # the first of equals
    ],
)
def test_sort_and_best(options, order):
    assert preloads(shown(*options.split("|"))[0]) == order


def beaten(points):
    """Which points have one that is at most as large in each coordinate and smaller in one, each compared with each."""
    not_larger = (points[:, None] <= points[None]).all(axis=2)
    smaller = (points[:, None] < points[None]).any(axis=2)
    return (not_larger & smaller).any(axis=0)


@pytest.mark.parametrize("objectives", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("count", [0, 1, 2, 63, 64, 65, 130, 400])
def test_the_front_is_that_of_comparing_each_with_each(count, objectives):
    random = np.random.default_rng([count, objectives])
    for points in (
        random.random((count, objectives)),
        random.integers(0, 9, (count, objectives)).astype(float),  # many ties
        -np.sort(random.random((count, objectives)), axis=0) * random.choice([-1, 1], objectives),
    ):
        assert (pareto_front(points) == ~beaten(points)).all()


@pytest.mark.parametrize("objectives", [2, 3])
def test_the_front_of_many_rows_takes_few_comparisons_though_all_are_on_it(monkeypatch, objectives):
    """Of n rows as many as sorting takes, n log2(n) in all halves and n SMALL / 2 in the smallest, not n^2."""
    rows, compared = 20_000, []
    halves, pairs = pareto._dominated, pareto._at_most_in_all
    monkeypatch.setattr(pareto, "_dominated", lambda by, of: compared.append(len(by) + len(of)) or halves(by, of))
    monkeypatch.setattr(pareto, "_at_most_in_all", lambda by, of: compared.append(len(by) * len(of)) or pairs(by, of))
    points = np.random.default_rng(0).random((rows, objectives))
    points[:, -1] = -points[:, :-1].sum(axis=1)
    assert pareto_front(points).all()
    assert rows < sum(compared) < rows * (np.log2(rows) + TOLERANCES.pareto_points)


@pytest.mark.parametrize(
    ("options", "loads"),
    [
        ("--pareto|min sag, min max_tension", "1345 N, 600 N, 100 kN, 2 kN"),  # each of them costs the other
        ("--pareto|min sag, max horizontal_tension", "100 kN"),
        ("--pareto|min chord", "1345 N, 600 N, 100 kN, 1 N, 2 kN"),  # equal ones are all kept
        ("--pareto|min sag,min max_tension|--sort|sag", "100 kN, 2 kN, 1345 N, 600 N"),
        ("--pareto|min sag,min max_tension|--best|max sag", "600 N"),
        ("--pareto|min sag|--where|sag > 0.1", "1345 N"),
        ("--pareto|min sag, min cable.preload", "1345 N, 600 N, 100 kN, 2 kN"),
        ("--pareto|min sag|--where|sag < 0", ""),
    ],
)
def test_pareto(options, loads):
    rows, outcome = shown(*options.split("|"))
    assert preloads(rows) == loads
    assert outcome.lines[-1] == f"selected: {len(rows)} of 5 rows"


def test_rows_that_lack_an_objective_are_counted():
    _, outcome = shown("--pareto", "min sag, max mass")
    assert outcome.lines[-2] == "--pareto: 1 row without a value of sag_m or mass_kg"


def test_sort_by_status():
    *known, last = [row["status"] for row in shown("--sort", "-status")[0]]
    assert known == ["over strength", "ok", "ok", "ok"]
    assert last.startswith("a mean tension of 1 N")


def test_no_best_row_is_no_answer():
    outcome = run("sweep", "study.yaml", "--no-write", "--best", "min sag", "--where", "sag < 0", code=3)
    assert outcome.out == ""
    assert outcome.lines[-1] == "--best: no row that --where lets pass has a value of sag_m"
    study_file(".", STUDY.replace("1345 N, 600 N, 100 kN, 1 N, 2 kN", "1 N"))
    outcome = run("sweep", "study.yaml", "--no-write", "--best", "min sag", code=3)
    assert outcome.lines[-1] == "--best: no row has a value of sag_m"


def test_the_stored_table_is_the_whole_study():
    run("sweep", "study.yaml", "--out", "whole", code=3)
    outcome = run("sweep", "study.yaml", "--out", "part", "--where", "sag < 0.1", "--sort", "-sag", code=3)
    assert len(outcome.out.splitlines()) == 4
    for name in ("study.csv", "study.md"):
        assert Path("part", name).read_bytes() == Path("whole", name).read_bytes()
    run("sweep", "study.yaml", "--out", "best", "--best", "min sag", "--where", "sag < 0", code=3)
    assert Path("best/study.csv").read_bytes() == Path("whole/study.csv").read_bytes()


def test_a_column_that_the_study_does_not_list_is_computed_and_shown_and_nothing_is_written(folder):
    options = ("--where", "stress < 1 GPa", "--sort", "-end_stiffness", "--format", "json")
    outcome = run("sweep", "study.yaml", *options, code=3)
    rows = rows_of(outcome.out, "json")
    assert list(rows[0]) == ["cable.preload_N", "mass_kg", "sag_m", "stress_MPa", "end_stiffness_N_per_m", "status"]
    assert all(row["stress_MPa"] < 1000 for row in rows)
    stiffness = [row["end_stiffness_N_per_m"] for row in rows]
    assert stiffness == sorted(stiffness, reverse=True)
    assert outcome.lines[0] == "not written: the study does not list stress, end_stiffness"
    assert sorted(path.name for path in folder.iterdir()) == ["study.yaml"]
    assert read_selection(read_study("study.yaml")) is None


def test_a_column_is_asked_for_once():
    study = read_study("study.yaml")
    read_selection(study, "sag < 1 and sag_m > 0 and stress < 5 and stress_MPa > 1", "stress")
    assert study.columns == ("mass", "sag", "stress")
    assert study.asked == ("stress",)


@pytest.mark.parametrize(
    ("arguments", "messages"),
    [
        (["--where", "sagg < 1"], ["--where:1: unknown column 'sagg' (did you mean sag?)"]),
        (["--sort", "masss"], ["--sort: unknown column 'masss' (did you mean mass?)"]),
        (["--sort", ""], ["main sweep: --sort is empty ('main sweep --help' shows how)"]),
        (["--sort", "cable.sagg"], ["--sort: the study does not vary 'cable.sagg' (did you mean cable.preload?)"]),
        (["--best", "mass"], ["--best: expected 'min COLUMN' or 'max COLUMN', got 'mass'"]),
        (["--best", "min mass, max sag"],
         ["--best: one row is best in one column, got 'min mass, max sag' (--pareto takes several)"]),
        (["--best", "least mass"], ["--best: expected 'min COLUMN' or 'max COLUMN', got 'least mass'"]),
        (["--best", "min masss"], ["--best: unknown column 'masss' (did you mean mass?)"]),
        (["--best", "max status"], ["--best: status is text, which has no max"]),
        (["--pareto", "min case"], ["--pareto: unknown column 'case' ('cablestudy columns' lists them)"]),
        (["--pareto", "mass, min sag"], ["--pareto: expected 'min COLUMN' or 'max COLUMN', got 'mass'"]),
        (["--pareto", "min sag,"], ["--pareto: expected 'min COLUMN' or 'max COLUMN', got ''"]),
        (["--pareto", "min masss"], ["--pareto: unknown column 'masss' (did you mean mass?)"]),
        (["--pareto", "min sag, max sag_m"], ["--pareto: sag_m is there twice"]),
        (["--pareto", "min status"], ["--pareto: status is text, which has no min"]),
        (["--pareto", "min sag", "--check"], ["--check and --pareto exclude each other"]),
        (["--best", "min sag", "--sort", "sag"], ["--sort and --best exclude each other: --best shows a single row"]),
        (["--where", "sag <", "--sort", "x"], ["--where:6: expected a column", "--sort: unknown column 'x'"]),
        (["--check", "--where", "sag < 1"], ["--check and --where exclude each other"]),
        (["--check", "--sensitivity"], ["--check and --sensitivity exclude each other"]),
        (["--sensitivity", "--row", "1"], ["--sensitivity and --row exclude each other"]),
        (["--sensitivity", "--best", "min sag"], ["--sensitivity and --best exclude each other"]),
        (["--dry-run", "--sort", "sag", "--check"],
         ["--dry-run and --sort exclude", "--check and --sort exclude", "--dry-run and --check exclude"]),
        (["--where", "utilisation < 1 and deflection < 1 mm"],
         ["--where: deflection needs the key cable.loads, which the scene does not have"]),
    ],
)  # fmt: skip
def test_what_is_refused(folder, arguments, messages):
    outcome = run("sweep", "study.yaml", *arguments, code=2)
    assert outcome.out == ""
    for line, message in zip([line for line in outcome.lines if "not written" not in line], messages, strict=True):
        assert line.startswith(message)
    assert sorted(path.name for path in folder.iterdir()) == ["study.yaml"]


def test_what_varies_as_text_has_neither_least_nor_largest(folder):
    study_file(folder, "vary: [{cable.material: [aramid, steel]}, {gondola.mass: [5 kg, 6 kg]}]\ncolumns: [mass]\n")
    for option, words in (("--pareto", "min cable.material, min mass"), ("--best", "min cable.material")):
        line = refusal("sweep", "study.yaml", "--no-write", option, words)
        assert line == f"{option}: cable.material is text, which has no min"
    assert run("sweep", "study.yaml", "--no-write", "--pareto", "max gondola.mass", "--quiet").out
