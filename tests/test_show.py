"""show: what is stored of a study is shown and nothing is computed; sweep: a complete run is not computed again."""

from contextlib import closing
from pathlib import Path

import pytest
from command import edit_rows, interrupt, rows_of, run, study_file, table_of, write

from cablestudy.sweeps import fingerprint
from cablestudy.sweeps.database import Database

pytestmark = pytest.mark.usefixtures("folder")

ROWS, TABLE, RECORD = (Path(f"results/study.{end}") for end in ("rows.sqlite", "csv", "run.yaml"))
STUDY = "vary: [{gondola.mass: [5 kg, 6 kg, 7 kg], cable.material: [aramid, steel, nylon]}]\ncolumns: [mass, sag]\n"


@pytest.fixture
def swept():
    """The rows of a study that is computed and stored."""
    study_file(".", STUDY)
    return table_of("sweep", "study.yaml")


def count(computed):
    """How many cases were computed since it was last asked."""
    cases = sum(cases for cases, _ in computed)
    computed.clear()
    return cases


def show(*arguments, code=0):
    outcome = run("show", "study.yaml", "--format", "json", *arguments, code=code)
    return rows_of(outcome.out, "json") if outcome.out else [], outcome.lines


def test_rows_and_table_show_the_same(swept, computed):
    assert show() == (swept, [f"{ROWS}: 3 rows"])
    ROWS.unlink()
    assert show() == (swept, [f"{TABLE}: 3 rows"])
    RECORD.unlink()
    assert show() == (swept, [f"{TABLE}: 3 rows"])
    assert show("--quiet") == (swept, [])
    assert computed == []


@pytest.mark.parametrize("stored", [ROWS, TABLE], ids=["rows", "table"])
def test_rows_are_chosen_as_in_a_sweep(swept, computed, stored):
    if stored is TABLE:
        ROWS.unlink()
    heavy = [row for row in swept if row["gondola.mass_kg"] > 5]
    assert show("--where", "gondola.mass > 5 kg")[0] == heavy
    assert show("--where", "cable.material == nylon")[0] == swept[2:]
    assert show("--sort", "-gondola.mass_kg", "--top", 2)[0] == swept[:0:-1]
    assert show("--best", "max sag")[0] == [max(swept, key=lambda row: row["sag_m"])]
    assert show("--pareto", "min mass")[0] == [min(swept, key=lambda row: row["mass_kg"])]
    assert show("--columns", "sag,gondola.mass,status")[0] == [
        {name: row[name] for name in ("sag_m", "gondola.mass_kg", "status")} for row in swept
    ]
    run("show", "study.yaml", "--plot", "a.svg")
    assert Path("a.svg").exists()
    assert computed == []
    assert show("--sort", "stress", code=2)[1][-1] == (
        f"{stored}: no column stress: 'cablestudy sweep' with these options computes it"
    )
    assert show("--sensitivity", "--best", "min sag", code=2)[1] == ["--sensitivity and --best exclude each other"]


def test_an_interrupted_sweep_shows_the_rows_that_are_done(swept):
    for path in (TABLE, RECORD):
        path.unlink()
    interrupt(ROWS, "DELETE FROM rows WHERE row = 2")
    again = "cablestudy sweep study.yaml --resume"
    notes = [f"{ROWS}: 2 of 3 rows are done; to go on: {again}", f"{ROWS}: 2 rows"]
    assert show() == ([swept[0], swept[2]], notes)
    assert run("sweep", "study.yaml", "--resume").lines[0] == "2 of 3 rows are there already"
    assert show()[0] == swept


@pytest.mark.parametrize(
    ("old", "new", "lines"),
    [
        ("7 kg", "8 kg", ["of the study before it was edited: what varies changed"]),
        ("[mass, sag]", "[mass, sag, stress]", ["of the study before it was edited: the columns changed"]),
        ("columns:", "set: {gravity: 5}\ncolumns:", ["gravity: not given there, 5 now"]),
    ],
)
def test_a_table_of_another_study_is_told(swept, old, new, lines):
    study_file(".", STUDY.replace(old, new))
    hint = "nothing to show; to compute the study as it is now: cablestudy sweep study.yaml"
    assert show(code=2)[1] == [*(f"{path}: {line}" for path in (ROWS, TABLE) for line in lines), hint]


def test_a_table_alone_is_compared_with_what_varies(swept):
    for path in (ROWS, RECORD):
        path.unlink()
    study_file(".", STUDY.replace("7 kg", "8 kg"))
    assert show(code=2)[1][0] == f"{TABLE}: row 3, gondola.mass_kg: stored 7.0, now 8.0"
    study_file(".", STUDY.replace(", 7 kg", "").replace(", nylon", ""))
    assert show(code=2)[1][0] == f"{TABLE}: 3 rows, and the study has 2 cases"
    study_file(".", STUDY.replace("sag]", "stress]"))
    edited = f"{TABLE}: of the study before it was edited, or of an earlier version: no column stress_MPa"
    assert show(code=2)[1][0] == edited


def test_rows_that_a_sweep_is_at_work_on_are_left_alone(swept):
    with closing(Database(str(ROWS))) as database, database.transaction():
        database.execute("UPDATE about SET value = value")
        assert show() == (swept, [f"{TABLE}: 3 rows"])
        TABLE.unlink()
        assert show(code=2)[1] == [
            f"{ROWS}: another sweep is at work on it",
            "nothing to show before it ends; Ctrl-C ends it too, and keeps the rows that are done",
        ]


def test_a_varied_key_that_a_column_shows_can_be_asked_for():
    study_file(".", "vary: [{cable.preload: [1 kN, 2 kN]}]\ncolumns: [preload]\n")
    rows = table_of("sweep", "study.yaml", "--columns", "cable.preload,preload")
    assert [row["cable.preload_N"] for row in rows] == [1000.0, 2000.0]
    assert show("--columns", "cable.preload_N,preload")[0] == rows
    ROWS.unlink()
    assert show("--columns", "cable.preload_N,preload")[0] == rows


def test_a_column_that_is_not_stored_names_the_varied_key_that_is_meant(swept):
    assert show("--where", "material == 'steel'", code=2)[1] == [
        "--where:1: unknown column 'material' ('cablestudy columns' lists them)"
    ]
    study_file(".", "vary: [{cable.diameter: [2 mm, 3 mm]}]\ncolumns: [sag]\n")
    run("sweep", "study.yaml", "--restart")
    assert show("--where", "diameter < 2.5 mm", code=2)[1] == [
        f"{ROWS}: no column diameter: did you mean cable.diameter? "
        "else 'cablestudy sweep' with these options computes it"
    ]
    assert len(show("--where", "cable.diameter < 2.5 mm")[0]) == 1


def test_nothing_is_stored():
    study_file(".", STUDY)
    assert show("--set", "gravity=5", code=2)[1] == [
        f"{TABLE}: no such file, nor {ROWS}",
        "nothing to show; to compute the study as it is now: cablestudy sweep study.yaml --set gravity=5",
    ]


def test_another_version_is_told_and_a_sweep_computes_anew(swept, computed, monkeypatch):
    monkeypatch.setattr(fingerprint, "RESULTS_VERSION", fingerprint.RESULTS_VERSION + 1)
    fingerprint.versions.cache_clear()
    try:
        assert show()[1][0].startswith(f"{ROWS}: version of results: ")
        assert computed == []
        run("sweep", "study.yaml", "--jobs", 1)
        assert count(computed) == 3
    finally:
        monkeypatch.undo()
        fingerprint.versions.cache_clear()


def test_a_complete_run_is_not_computed_again(swept, computed):
    reused = "3 rows as stored; --restart computes anew"
    assert run("sweep", "study.yaml", "--where", "sag < 1 m").lines[0] == reused
    assert run("sweep", "study.yaml", "--sort", "sag").lines[0] == reused
    interrupt(ROWS)  # killed while it wrote its table
    assert run("sweep", "study.yaml").lines[0] == reused
    assert computed == []
    for options in (["--restart"], ["--no-write"], ["--check"], ["--row", 2], ["--explain"]):
        run("sweep", "study.yaml", "--jobs", 1, *options)
        assert count(computed) == (1 if "--row" in options else 3), options
    study_file(".", STUDY.replace("[mass, sag]", "[mass]"))
    run("sweep", "study.yaml", "--jobs", 1)
    assert count(computed) == 3


def test_errors_of_fixed_elements_are_computed_when_json_asks_for_them(computed):
    study_file(".", "set: {model.elements: 4}\nvary: [{gravity: [9, 10]}]\ncolumns: [cable_frequency]\n")
    run("sweep", "study.yaml", "--jobs", 1)
    assert run("sweep", "study.yaml").lines[0] == "2 rows as stored; --restart computes anew"
    run("sweep", "study.yaml", "--jobs", 1, "--format", "json")
    assert count(computed) == 4


def overwrite_pages():
    """Leave the first page of the rows, which says what they are."""
    content = ROWS.read_bytes()
    ROWS.write_bytes(content[:4096] + b"x" * (len(content) - 4096))


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda: interrupt(ROWS, "DELETE FROM rows WHERE row = 2"), "2 of 3 rows are done"),
        (lambda: edit_rows(ROWS, "UPDATE about SET value = '{}' WHERE name = 'study'"), "that its rows belong to was"),
        (overwrite_pages, "is damaged"),
    ],
)
def test_the_table_is_shown_where_it_has_more_than_the_rows(swept, damage, told):
    damage()
    assert show() == (swept, [f"{TABLE}: 3 rows"])
    TABLE.unlink()
    assert told in show(code=None)[1][0]


DIGITS = "1" * 5000


@pytest.mark.parametrize("cell", ["nan", "inf", "1e999", "-inf", DIGITS, "many", "²"], ids=range(7))
def test_a_cell_that_is_no_finite_number_is_named_by_line_row_and_column(swept, cell):
    for path in (ROWS, RECORD):
        path.unlink()
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    cells = lines[2].split(",")
    place = lines[0].split(",").index("sag_m")
    lines[2] = ",".join([*cells[:place], cell, *cells[place + 1 :]])
    write(TABLE, "# edited\n" + "\n".join(lines) + "\n")
    rows, said = show(code=2)
    assert rows == []
    assert said[0].startswith(f"{TABLE}:4: row 2, sag_m: not a finite number: '{cell[:20]}")
    assert len(said) == 2
    assert max(map(len, said)) < 600


OF_OTHER_KINDS = "{versions: {}, study: {scene: 1, vary: 2, columns: 3}}"
DAMAGED = [f"[{DIGITS}]", "a: [", "{versions: {}, study: {}}", "[" * 5000, "\0", OF_OTHER_KINDS, "study: x", "- 1", ""]


@pytest.mark.parametrize("text", DAMAGED, ids=range(len(DAMAGED)))
def test_a_damaged_record_is_as_none(swept, text):
    ROWS.unlink()
    write(RECORD, text)
    assert show() == (swept, [f"{TABLE}: 3 rows"])


@pytest.mark.parametrize("style", ["md", "csv", "json", "jsonl"])
def test_nothing_is_printed_of_rows_that_are_damaged(swept, style):
    """They are left out before the first of them is printed, as a sweep that is resumed does."""
    edit_rows(ROWS, "UPDATE rows SET cells = '[1.0, 2.0]' WHERE row = 3")
    assert run("show", "study.yaml", "--format", style).lines == [f"{TABLE}: 3 rows"]
    for path in (TABLE, RECORD):
        path.unlink()
    outcome = run("show", "study.yaml", "--format", style)
    assert outcome.lines == [
        f"{ROWS}: left out what is not as it was written: row 3",
        f"{ROWS}: 2 of 3 rows are done; to go on: cablestudy sweep study.yaml --resume",
        f"{ROWS}: 2 rows",
    ]
    if style == "json":
        assert rows_of(outcome.out, style) == swept[:2]
