"""Markdown laid out to the width of a terminal, and the options --columns, --top and --digits."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from itertools import pairwise

import pytest
from command import CARLINA, CONFIGS, refusal, rows_of, run, stored_table, study_file, table_of, write

from cablestudy.study.markdown import fitted, text_width, whole
from cablestudy.study.table import Field, Table

STATUS = Field("status", "status", unless="ok")
LENGTHS = tuple(Field(f"length_of_part_{k}_m", f"length of part {k}", "m") for k in range(1, 7))
ROWS = [{**{field.name: 1.5 + k for field in LENGTHS}, "status": "ok"} for k in range(6)]
WIDE = Table((*LENGTHS, STATUS), ROWS)
WIDTHS = range(30, 200, 7)


def cells(line):
    return [cell.strip() for cell in line.strip("|").split("|")]


def columns_of(text):
    """Head and cells of each column of a Markdown table; rows without a first cell go on with the row above."""
    first, _, *lines = text.splitlines()
    heads, rows = cells(first), []
    for line in lines:
        own = cells(line)
        if own[0] or (not rows and own[-1] not in ("[m]",)):
            rows.append(own)
        else:
            target = rows[-1] if rows else heads
            target[:] = [f"{above} {below}".strip() for above, below in zip(target, own, strict=True)]
    return {head: list(column) for head, column in zip(heads, zip(*rows, strict=True), strict=True)}


@pytest.mark.parametrize("width", WIDTHS)
def test_no_line_is_wider_than_the_terminal_and_what_is_left_out_is_named(width):
    text, left_out = fitted(WIDE, width)
    assert max(map(text_width, text.splitlines())) <= width
    names = [f"length_of_part_{k}" for k in range(1, 7)]
    shown = names[: text.splitlines()[0].count("|") - 1]
    assert left_out == names[len(shown) :]  # from the right
    body = text.splitlines()[-6:]
    assert [cells(line) for line in body] == [[f"{1.5 + k:g}"] * len(shown) for k in range(6)]


def test_wider_terminals_show_more():
    counts = [len(fitted(WIDE, width)[1]) for width in WIDTHS]
    assert all(more >= fewer for more, fewer in pairwise(counts))
    assert (counts[0], counts[-1]) == (4, 0)  # "part 1 [m]": two of them in 30 characters


def test_a_status_is_hidden_while_all_rows_are_ok_and_kept_when_one_is_not():
    assert "status" not in fitted(WIDE, 200)[0]
    failed = Table(WIDE.fields, [*ROWS[:-1], {**ROWS[-1], "status": "the cable without weight has no definite form"}])
    text, left_out = fitted(failed, 60)
    assert "status" not in left_out
    found = columns_of(text)
    assert found["status"][-1] == "the cable without weight has no definite form"
    assert max(map(len, text.splitlines())) <= 60


def test_few_rows_stand_side_by_side_where_they_fit_better():
    named = Table((Field("cable", "cable"), *LENGTHS), [{"cable": "left", **ROWS[0]}, {"cable": "right", **ROWS[1]}])
    lines = fitted(named, 60)[0].splitlines()
    assert cells(lines[0]) == ["quantity", "left", "right", "unit"]
    assert cells(lines[2]) == ["length of part 1", "1.5", "2.5", "m"]
    assert len(lines) == 2 + 6
    assert fitted(named, 60)[1] == []
    unnamed = fitted(Table(LENGTHS, ROWS[:2]), 60)[0]
    assert cells(unnamed.splitlines()[0]) == ["quantity", "row 1", "row 2", "unit"]
    assert fitted(Table(LENGTHS, ROWS[:2]), 200)[0].startswith("| length of part 1 [m] |")
    with_heads_on_two_lines = fitted(Table(LENGTHS, ROWS[:2]), 100)[0].splitlines()
    assert [cells(line) for line in with_heads_on_two_lines[-2:]] == [["1.5"] * 6, ["2.5"] * 6]


def test_cases_side_by_side_are_divided_into_tables_that_fit():
    rows = [{"case": name, "sag_m": 1.0 + k, "status": "ok"} for k, name in enumerate("abcde")]
    table = Table((Field("case", "case"), Field("sag_m", "sag", "m"), STATUS), rows, across="case")
    blocks = fitted(table, 34)[0].split("\n\n")
    assert [cells(block.splitlines()[0])[1:-1] for block in blocks] == [["a", "b", "c"], ["d", "e"]]
    assert len(fitted(table, 80)[0].split("\n\n")) == 1


def test_long_texts_are_wrapped_and_numbers_are_not():
    meaning = "mean tension of the cable over its unstretched length, in the reference state"
    table = Table((Field("column", "column"), Field("n", "n"), Field("meaning", "meaning")),
                  [{"column": f"c{k}", "n": 0.1234, "meaning": meaning} for k in range(5)])  # fmt: skip
    text, left_out = fitted(table, 50)
    assert left_out == []
    assert columns_of(text) == {"column": [f"c{k}" for k in range(5)], "n": ["0.1234"] * 5, "meaning": [meaning] * 5}
    assert max(map(len, text.splitlines())) <= 50


def test_printed_values_are_left_out_first():
    fields = (LENGTHS[0], Field("printed_m", "printed", "m", hidden=True),
              Field("difference_m", "printed (Δ)", "", printed="printed_m"), *LENGTHS[1:4])  # fmt: skip
    table = Table(fields, [{**row, "printed_m": 1.0, "difference_m": 0.5} for row in ROWS])
    assert fitted(table, 60)[1] == ["printed values"]
    assert fitted(table, 200)[1] == []


def test_wide_characters_count_as_two():
    assert text_width("abü") == 3
    assert text_width("ケーブル") == 8
    assert text_width("e\N{COMBINING ACUTE ACCENT}") == 1
    lines = "".join(whole(Table((Field("a", "a"), Field("b", "b")), [{"a": "ケ", "b": 1}, {"a": "xy", "b": 2}])))
    assert len({text_width(line) for line in lines.splitlines()}) == 1


def on_terminal(width, *arguments):
    """What a command prints on a terminal of some width, and its notes."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 40, width, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    command = [sys.executable, "-m", "cablestudy", *map(str, arguments)]
    with subprocess.Popen(command, stdout=theirs, stderr=subprocess.PIPE, env=environment, text=True) as done:
        os.close(theirs)
        text = b""
        try:
            while piece := os.read(ours, 65536):
                text += piece
        except OSError:  # Linux: the command has closed its end
            pass
        os.close(ours)
        return text.decode().replace("\r\n", "\n"), done.stderr.read()


def test_a_terminal_gets_what_fits_and_a_pipe_everything():
    study = CONFIGS / "preload.yaml"
    text, notes = on_terminal(80, "sweep", study, "--no-write")
    assert max(map(len, text.splitlines())) <= 80
    assert notes.startswith("wider than this terminal, left out: ")
    assert all(word in notes for word in ("gondola_frequency", "--columns"))
    assert "status" not in text
    assert on_terminal(80, "sweep", study, "--no-write", "--quiet") == (text, "")
    piped = run("sweep", study, "--no-write").out.splitlines()[2:]
    whole_table = on_terminal(400, "sweep", study, "--no-write")[0].splitlines()[2:]
    assert [cells(line)[:-1] for line in piped] == [cells(line) for line in whole_table]
    asked = ("sweep", study, "--no-write", "--format", "csv")
    assert on_terminal(20, *asked)[0] == run(*asked).out


@pytest.mark.parametrize("style", ["csv", "json", "jsonl"])
def test_columns_and_top(style):
    options = ("--columns", "end_stiffness,sag_m", "--top", 2, "--format", style)
    rows = rows_of(run("sweep", CONFIGS / "preload.yaml", "--no-write", *options).out, style)
    whole_table = table_of("sweep", CONFIGS / "preload.yaml", "--no-write")
    names = ["cable.unstretched_length_m", "end_stiffness_N_per_m", "sag_m", "status"]
    assert [list(row) for row in rows] == [names] * 2
    # in the whole table a column shows what varies
    shown = [
        dict(zip(names, [row["unstretched_length_m"], *map(row.get, names[1:])], strict=True)) for row in whole_table
    ]
    assert rows == shown[:2]


def test_columns_of_markdown_and_of_one_row():
    lines = run("static", CARLINA, "--columns", "sag,preload_N").out.splitlines()
    assert [cells(line)[0] for line in lines] == ["quantity", ":-----------", "sag", "preload"]
    (row,) = table_of("static", CARLINA, "--columns", "sag")
    assert list(row) == ["sag_m"]
    lines = run("sweep", CONFIGS / "preload.yaml", "--no-write", "--columns", "sag_printed_m,status").out.splitlines()
    assert cells(lines[0]) == ["cable.unstretched_length [m]", "printed [m]", "status"]


def test_columns_without_a_value_stand_there_where_no_other_has_one():
    unstable = "--set", "winch.controller.gain=8000"
    lines = run("windrms", CARLINA, *unstable, "--columns", "gondola_rms", "--quiet", code=3).out.splitlines()
    assert [cells(line) for line in lines[2:]] == [["gondola rms", "", "mm"]]


def test_every_table_takes_them(folder):
    study_file(folder, "vary: [{gondola.mass: [5 kg, 6 kg, 7 kg]}]\ncolumns: [mass]\n")
    for command in (
        ["modes", CARLINA, "--columns", "number,frequency"],
        ["columns", "--columns", "column,unit"],
        ["materials", "--columns", "material,density"],
        ["sweep", "study.yaml", "--dry-run", "--columns", "row,gondola.mass"],
        ["sweep", "study.yaml", "--columns", "gondola.mass_kg,status"],
    ):
        assert [len(row) for row in table_of(*command, "--top", 2)] == [2, 2]
    find = ("find", CARLINA, "sag = 1 m", "--by", "cable.preload", "--columns", "mass,status")
    assert [len(row) for row in table_of(*find, "--top", 2)] == [4]  # --columns are those beside key and goal
    (row,) = table_of("validate", "study.yaml", "--columns", "cases")
    assert row == {"cases": 3}


def test_a_column_that_the_study_does_not_list_is_computed(folder):
    study_file(folder, "vary: [{gondola.mass: [5 kg, 6 kg]}]\ncolumns: [mass]\n")
    outcome = run("sweep", "study.yaml", "--columns", "gondola.mass,sag", "--format", "json")
    assert [list(row) for row in rows_of(outcome.out, "json")] == [["gondola.mass_kg", "sag_m", "status"]] * 2
    assert outcome.err == "not written: the study does not list sag\n"
    assert run("sweep", "study.yaml", "--columns", "mass,status").err.startswith("written: results/study.csv")


@pytest.mark.parametrize(
    ("asked", "shown"),
    [
        ("sag", ["gondola.mass_kg", "cable.area_m2", "sag_m", "status"]),
        ("area,sag", ["gondola.mass_kg", "area_mm2", "sag_m", "status"]),  # the same in another unit
        ("mass,gondola.mass", ["mass_kg", "gondola.mass_kg", "status"]),
        ("status,cable.area,gondola.mass", ["status", "cable.area_m2", "gondola.mass_kg"]),
    ],
)
@pytest.mark.parametrize("command", ["sweep", "show"])
def test_what_varies_and_the_status_stay_in_a_table_of_chosen_columns(folder, asked, shown, command):
    vary = "vary: [{gondola.mass: [5 kg, 6 kg]}, {cable.area: [20 mm^2, 24 mm^2]}]\n"
    study_file(folder, vary + "columns: [mass, sag, area]\n")
    run("sweep", "study.yaml")
    rows = table_of(command, "study.yaml", "--columns", asked)
    assert [list(row) for row in rows] == [shown] * 4
    whole_rows = table_of("show", "study.yaml", "--columns", "gondola.mass,cable.area,area,mass,sag")
    assert rows == [{name: row[name] for name in shown} for row in whole_rows]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["static", CARLINA, "--columns", "sagg"], "--columns: the table has no column 'sagg' (did you mean sag?)"),
        (["modes", CARLINA, "--columns", "xyz"],
         "--columns: the table has no column 'xyz' (it has number, type, symmetry, frequency, participation, "
         "lock_in_speed)"),
        (["sweep", CONFIGS / "preload.yaml", "--columns", "sagg,sag"],
         "--columns: unknown column 'sagg' (did you mean sag?)"),
        (["sweep", CONFIGS / "preload.yaml", "--check", "--top", "3"], "--check and --top exclude each other"),
        (["static", CONFIGS / "suspensions" / "fast.yaml", "--columns", "sag"],
         "--columns: one table at a time: give --table bodies, points, cables, stiffness"),
        (["static", CARLINA, "--columns", "sag,"],
         "cablestudy static: Invalid value for '--columns': expected names joined by commas "
         "('cablestudy static --help' shows how)"),
        (["static", CARLINA, "--top", "0"],
         "cablestudy static: Invalid value for '--top': 0 is not in the range x>=1 "
         "('cablestudy static --help' shows how)"),
    ],
)  # fmt: skip
def test_what_is_refused(arguments, message):
    outcome = run(*arguments, code=2)
    assert outcome.out == ""
    assert [line.replace("main ", "cablestudy ") for line in outcome.lines if "note: " not in line] == [message]


def test_unknown_columns_are_told_together_and_no_picture_is_overwritten(folder):
    write("cable.svg", "of before")
    outcome = run("static", CARLINA, "--columns", "sagg,sag,preloda", "--plot", "cable.svg", code=2)
    assert outcome.lines == [
        "--columns: the table has no column 'sagg' (did you mean sag?)",
        "--columns: the table has no column 'preloda' (did you mean preload?)",
    ]
    assert (folder / "cable.svg").read_text() == "of before"


DIGITS = [
    (["static", CARLINA], "preload_N", "preload"),
    (["static", CONFIGS / "suspensions" / "mast-guys.yaml", "--table", "cables"], "preload_N", "preload [N]"),
    (["modes", CARLINA, "-n", "2"], "frequency_Hz", "frequency [Hz]"),
    (["find", CARLINA, "sag = 1 m", "--by", "cable.preload"], "sag_m", "sag [m]"),
    (["sweep", CONFIGS / "preload.yaml", "--no-write"], "sag_m", "sag [m]"),
]


@pytest.mark.crossed
@pytest.mark.parametrize(("command", "name", "head"), DIGITS)
@pytest.mark.parametrize("digits", [2, 4, 9])
def test_numbers_have_the_digits_that_are_asked_for(command, name, head, digits):
    """Those of the exact number, as python rounds it, where an exponent is not shorter."""
    row = table_of(*command)[0]
    table = [cells(line) for line in run(*command, "--digits", digits).out.splitlines()]
    upright = table[0][0] == "quantity"
    shown = next(line[1] for line in table if line[0] == head) if upright else table[2][table[0].index(head)]
    assert float(shown) == float(f"{row[name]:.{digits}g}")
    assert len(shown.replace(".", "").strip("0")) <= digits


def test_digits_of_all_tables_of_a_suspension():
    scene = CONFIGS / "suspensions" / "mast-guys.yaml"
    usual, more = (run("static", scene, *options).out for options in ((), ("--digits", 8)))
    height = next(row["z_m"] for row in table_of("static", scene, "--table", "points") if row["name"] == "top")
    assert f" {height:.4g} |" in usual
    assert f" {height:.8g} |" in more
    assert "20000.000" not in more


def test_the_stored_table_is_whole_and_keeps_its_digits(folder):
    study_file(folder, "vary: [{gondola.mass: [5 kg, 6 kg]}]\ncolumns: [mass, sag]\n")
    shown = run("sweep", "study.yaml", "--digits", 9, "--columns", "mass", "--top", 1).out
    assert f"{1440 * 2.69e-6 * 184.4883:.9g}" in shown  # density, area and length of configs/carlina.yaml
    assert [list(row) for row in stored_table()] == [["gondola.mass_kg", "mass_kg", "sag_m", "status"]] * 2
    stored = (folder / "results" / "study.md").read_text(encoding="utf-8")
    run("sweep", "study.yaml", "--restart")
    assert (folder / "results" / "study.md").read_text(encoding="utf-8") == stored


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--digits", "0"], "Invalid value for '--digits': 0 is not in the range 1<=x<=17"),
        (["--digits", "18"], "Invalid value for '--digits': 18 is not in the range 1<=x<=17"),
        (["--digits", "x"], "Invalid value for '--digits': 'x' is not a whole number"),
        (["--digits", "6", "--format", "csv"], "Invalid value for '--digits': no effect: csv has all digits"),
    ],
)
def test_digits_that_are_refused(arguments, message):
    assert message in refusal("static", CARLINA, *arguments)
