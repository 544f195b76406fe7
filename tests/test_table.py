"""Tables as text and back, as files and as parquet, compared with stored ones; the files that a sweep writes."""

import csv
import io
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from unittest.mock import Mock

import pytest
from command import CARLINA, refusal, study_file, table_of, write
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import parquet
from scenes import computed

from cablestudy.errors import SceneError
from cablestudy.scene.study import ALL_COLUMNS, read_study
from cablestudy.study.parquet import write_parquet
from cablestudy.study.table import Field, Table, TableFiles, exact, number, short, signed, stream_csv, write_whole
from cablestudy.study.tolerances import STUDY as TOLERANCES
from cablestudy.sweeps.check import compare, compare_columns

FIELDS = (Field("name", "name"), Field("sag_m", "sag", "m"), Field("status", "status"))
ROWS = [
    {"name": "a, b", "sag_m": 0.1 + 0.2, "status": "ok"},
    {"name": 'quo"te', "sag_m": None, "status": "broken | ünder\nits weight"},
    {"name": 3, "sag_m": 1e-300},
]
TABLE = Table(FIELDS, ROWS)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_reads_back_as_itself(value):
    row = next(iter(csv.DictReader(io.StringIO(Table(FIELDS, [{"sag_m": value}]).render("csv")))))
    assert row["sag_m"] == exact(value) == repr(value)  # the shortest text that does
    assert json.loads(Table(FIELDS, [{"sag_m": value}]).render("jsonl"))["sag_m"] == value


def test_csv_json_and_jsonl_hold_the_same():
    rows = list(csv.DictReader(io.StringIO(TABLE.render("csv"), newline="")))
    assert [row["name"] for row in rows] == ["a, b", 'quo"te', "3"]
    assert [row["sag_m"] for row in rows] == ["0.30000000000000004", "", "1e-300"]
    assert rows[1]["status"] == "broken | ünder\nits weight"
    table = json.loads(TABLE.render("json"))
    assert table["columns"] == {"name": "", "sag_m": "m", "status": ""}
    assert table["rows"] == [json.loads(line) for line in TABLE.render("jsonl").splitlines()]
    assert table["rows"][2] == {"name": 3, "sag_m": 1e-300, "status": None}


def test_a_number_that_is_none_is_not_written_to_json():
    with pytest.raises(ValueError, match="JSON"):
        Table(FIELDS, [{"sag_m": math.nan}]).render("json")


def test_markdown_keeps_its_columns_whatever_is_in_the_cells():
    lines = Table(FIELDS, [ROWS[0], {**ROWS[1], "status": "a | b"}]).render("md").splitlines()
    assert lines[0].startswith("| name")
    assert "sag [m]" in lines[0]
    assert "a \\| b" in lines[3]
    assert len(lines) == 4
    assert Table(FIELDS, []).render("md").count("\n") == 2


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, ""), (0.0, "0"), (1344.7541, "1345"), (24193.1, "24190"), (12345678.9, "12350000"), (1.25e12, "1.25e+12"),
     (0.00012345, "0.0001234"), (1e-7, "1e-07"), (-0.5, "-0.5"), (40, "40"), ("ok", "ok")],
)  # fmt: skip
def test_four_digits_for_people(value, text):
    assert short(value) == text


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (82.1, "+82"), (-7.93, "-7.9"), (12345.0, "+12000"), (2e-5, "+2e-05")]
)
def test_a_difference_has_its_sign(value, text):
    assert signed(value) == text


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    write_whole(str(path), "old\n")
    monkeypatch.setattr(os, "replace", Mock(side_effect=OSError(28, "No space left on device")))
    with pytest.raises(SceneError, match="cannot be written"):
        write_whole(str(path), "new, but longer\n")
    assert path.read_text(encoding="utf-8") == "old\n"
    assert [child.name for child in tmp_path.iterdir()] == ["a.csv"]


def test_a_file_can_be_read_by_others(tmp_path):
    path = tmp_path / "a.csv"
    before = os.umask(0o022)
    try:
        write_whole(str(path), "x\n")
    finally:
        os.umask(before)
    assert path.stat().st_mode & 0o777 == 0o644
    with pytest.raises(SceneError, match=r"no/a\.csv: cannot be written"):
        write_whole("no/a.csv", "x")


def test_a_pipe_is_written_into_and_a_link_to_a_file_stays(tmp_path):
    """As root, a file in the place of /dev/stdout or /dev/null would be there for all."""
    pipe, path, link = tmp_path / "pipe", tmp_path / "a.csv", tmp_path / "link"
    os.mkfifo(pipe)
    end = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_whole(str(pipe), ["x\n", "y\n"])
    assert os.read(end, 99) == b"x\ny\n"
    os.close(end)
    assert pipe.is_fifo()
    write(path, "old\n")
    link.symlink_to(path)
    write_whole(str(link), "new\n")
    assert link.is_symlink()
    assert path.read_text() == "new\n"
    assert sorted(child.name for child in tmp_path.iterdir()) == ["a.csv", "link", "pipe"]


def test_a_stored_table_is_read_back(tmp_path):
    names, rows = stream_csv(write(tmp_path / "a.csv", "# printed, table 6\n\ufeffname,sag_m\n\n# more\n x,\n"))
    assert [name.strip("\ufeff") for name in names] == ["name", "sag_m"]
    assert [(line, list(row.values())) for line, row in rows] == [(5, [" x", ""])]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot be read"),
        (b"", "it is empty"),
        (b"# only\n", "it is empty"),
        (b"a,b\n1\n", "row 1 has 1 cells, and the table 2 columns"),
        (b"a,b\n1,2\n1,2,3\n", "row 2 has 3 cells, and the table 2 columns"),
        (b"a,a\n1,2\n", "column 'a' is there twice"),
        (b'a\n"open\n', "not a table of comma-separated values"),
        (b"\xff\xfe", "not a table of comma-separated values"),
    ],
)
def test_what_is_not_a_table_is_refused(tmp_path, text, message):
    if text is not None:
        (tmp_path / "a.csv").write_bytes(text)
    with pytest.raises(SceneError) as caught:
        list(stream_csv(str(tmp_path / "a.csv"))[1])
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "value"), [("1e3", 1000.0), ("", None), ("ok", None), ("-0.5", -0.5)])
def test_numbers_in_cells(text, value):
    assert number(text) == value


def differences(tmp_path, stored, rtol=1e-6):
    path = write(tmp_path / "stored.csv", stored.replace(" ", "\n") + "\n")
    rows = [{"sag_m": 1.0, "status": "ok"}, {"sag_m": None, "status": "broken"}]
    table = Table(FIELDS[1:], rows)
    return [*compare_columns(table, path), *map(str, compare(table, path, {ALL_COLUMNS: rtol}))]


@pytest.mark.parametrize(
    ("stored", "found"),
    [
        ("sag_m,status 1.0,ok ,broken", []),
        ("sag_m,status 1.0000001,ok ,broken", []),
        ("sag_m,status 1.25,ok ,broken", ["row 1, sag_m: stored 1.25, computed 1.0, ratio 0.8"]),
        ("sag_m,status 0,ok ,broken", ["row 1, sag_m: stored 0, computed 1.0"]),
        ("sag_m,status nan,ok ,broken", ["row 1, sag_m: stored nan, computed 1.0"]),
        ("sag_m,status inf,ok ,broken", ["row 1, sag_m: stored inf, computed 1.0"]),
        ("sag_m,status -1e999,ok ,broken", ["row 1, sag_m: stored -1e999, computed 1.0"]),
        (f"sag_m,status {'1' * 5000},ok ,broken",
         [f"row 1, sag_m: stored {'1' * 99}...{'1' * 98}, computed 1.0"]),
        ("sag_m,status 1.0,ok ,broken1e99999999", ["row 2, status: stored broken1e99999999, computed broken"]),
        ("sag_m,status ,ok 2,broken",
         ["row 1, sag_m: stored empty, computed 1.0", "row 2, sag_m: stored 2, computed empty"]),
        ("sag_m,status 1.0,fine ,broken", ["row 1, status: stored fine, computed ok"]),
        ("sag_m,status 1.0,ok", ["1 rows stored, 2 computed"]),
        ("status,mass_kg ok,1 broken,1",
         ["column mass_kg: stored, not computed", "column sag_m: computed, not stored"]),
        ("status,sag_m ok,1.0 broken,", []),  # the order of columns is no difference
    ],
)  # fmt: skip
def test_differences_from_a_stored_table(tmp_path, stored, found):
    assert differences(tmp_path, stored) == found


def test_the_tolerance_is_relative_to_the_larger(tmp_path):
    assert differences(tmp_path, "sag_m,status 1.1,ok ,broken", 0.1) == []
    assert len(differences(tmp_path, "sag_m,status 1.1,ok ,broken", 0.09)) == 1
    assert differences(tmp_path, "sag_m,status 1.0,ok ,broken", 0.0) == []


def test_the_time_that_a_row_took_is_not_compared(tmp_path):
    table = Table((Field("solve_time_ms", "solve time", "ms"),), [{"solve_time_ms": 2.0}])
    assert list(compare(table, write(tmp_path / "stored.csv", "solve_time_ms\n1.0\n"), {ALL_COLUMNS: 0.0})) == []


@pytest.mark.parametrize("rows", [[], [{"a": 1.5, "b": "x"}], [{"a": 1.5, "b": "x\ny"}, {"a": None}]], ids=len)
def test_pieces_are_what_the_standard_library_writes_at_once(rows):
    fields = (Field("a", "a", "m"), Field("b", "b"))
    plain = [{"a": row["a"], "b": row.get("b")} for row in rows]
    expected = json.dumps({"columns": {"a": "m", "b": ""}, "rows": plain}, ensure_ascii=False, indent=1) + "\n"
    assert "".join(Table(fields, iter(rows)).pieces("json")) == expected
    lines = "".join(Table(fields, iter(rows)).pieces("jsonl"))
    assert lines == "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in plain)


@pytest.mark.parametrize(
    ("old", "new", "same"),
    [
        ("left 1.234 N", "left 1.235 N", True),
        ("left 1.234 N", "left 1.236 N", False),
        ("left 1e99999999 N", "left 1e99999998 N", False),
        ("left", "left 3", False),
        ("left 3", "left3", False),
    ],
)
def test_statuses_agree_but_for_the_last_digit_of_a_number(tmp_path, old, new, same):
    table = Table((Field("status", "status"),), [{"status": new}])
    assert (list(compare(table, write(tmp_path / "a.csv", f"status\n{old}\n"), {})) == []) == same


# --------------------------------------------------------------------------- files of a sweep


@pytest.mark.parametrize(
    ("study", "stem"),
    [("configs/preload.yaml", "preload"), ("a.b.yml", "a.b"), ("<stdin>", "stdin"), ("/x/ünï.yaml", "ünï")],
)
def test_files_are_named_after_the_study(study, stem):
    files = TableFiles("out", study)
    assert (files.csv, files.md) == (os.path.join("out", f"{stem}.csv"), os.path.join("out", f"{stem}.md"))


def study_of(text):
    return read_study(study_file(".", text))


def test_asking_makes_nothing_and_writing_makes_the_folder(folder):
    study = study_of('title: "Two | three"\ncolumns: [sag]\n')
    files = TableFiles("deep/out", study.name)
    files.check_writable()
    assert not (folder / "deep").exists()
    table = computed(study)
    files.write(study, table, "a: 1\n")
    names = sorted(path.name for path in (folder / "deep" / "out").iterdir())
    assert names == ["study.csv", "study.md", "study.run.yaml"]
    assert Path(files.csv).read_text(encoding="utf-8") == table.render("csv")
    assert Path(files.md).read_text(encoding="utf-8") == f"# Two | three\n\n{table.render('md')}"
    assert list(compare(table, files.csv, {ALL_COLUMNS: 0.0})) == []
    assert Path(files.run).read_text(encoding="utf-8") == "a: 1\n"
    files.check_stored()


@pytest.mark.usefixtures("folder")
def test_a_study_without_title_is_headed_by_its_name():
    study = study_of("columns: [sag]\n")
    TableFiles(".", study.name).write(study, computed(study), "a: 1\n")
    assert Path("study.md").read_text(encoding="utf-8").startswith("# study\n\n| ")


def test_a_folder_where_a_table_should_go_is_refused_though_it_came_late(folder):
    (folder / "there" / "study.csv").mkdir(parents=True)  # a folder where the file should go
    study = study_of("columns: [sag]\n")
    with pytest.raises(SceneError, match="cannot be written"):
        TableFiles("there", study.name).write(study, computed(study), "a: 1\n")
    assert [path.name for path in (folder / "there").iterdir()] == ["study.csv"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is closed to root")
def test_a_folder_that_is_closed(folder):
    (folder / "closed").mkdir(mode=0o500)
    with pytest.raises(SceneError, match="cannot be written to"):
        TableFiles("closed", "a.yaml").check_writable()


@pytest.mark.parametrize("end", [".csv", ".md", ".run.yaml", ".rows.sqlite"])
def test_a_folder_in_the_way_of_a_file(folder, end):
    (folder / f"a{end}").mkdir()
    with pytest.raises(SceneError, match=rf"^{re.escape(str(folder))}/a{end}: cannot be written .a folder is there.$"):
        TableFiles(str(folder), "a.yaml").check_writable()


# -------------------------------------------------------------------------------------------------------------- parquet


STUDY = (
    "vary: [{winch.controller.gain: [0.3, {auto: 6 dB}], cable.material: [aramid, steel], gondola.mass: [5, 6]}]\n"
    "columns: [mass, sag, dof]\n"
)


@pytest.mark.usefixtures("folder")
def test_a_study_as_parquet_has_the_cells_of_its_csv():
    study_file(".", STUDY)
    rows = table_of("sweep", "study.yaml")
    for command in ("sweep", "show"):
        words = [sys.executable, "-m", "cablestudy", command, "study.yaml", "--format", "parquet"]
        done = subprocess.run(words, capture_output=True, check=True)
        read = parquet.read_table(io.BytesIO(done.stdout))
        assert read.to_pylist() == [{**row, "winch.controller.gain": str(row["winch.controller.gain"])} for row in rows]
    schema = read.schema
    assert schema.field("gondola.mass_kg").metadata == {b"unit": b"kg"}
    assert schema.field("cable.material").metadata is None
    types = {name: str(schema.field(name).type) for name in schema.names}
    texts = dict.fromkeys(("winch.controller.gain", "cable.material", "status"), "string")
    assert types == dict.fromkeys(schema.names, "double") | texts


def test_rows_are_written_in_parts(monkeypatch):
    monkeypatch.setattr(type(TOLERANCES), "parquet_rows", 10)
    rows = [{"x": None if k == 3 else k / 3, "name": f"row {k}"} for k in range(25)]
    file = io.BytesIO()
    write_parquet(Table((Field("x", "x", "m"), Field("name", "name")), rows), file)
    read = parquet.ParquetFile(file)
    assert read.read().to_pylist() == rows
    assert read.num_row_groups == 3
    assert not file.closed


def test_rows_that_are_made_as_they_are_written_are_not_kept(monkeypatch):
    monkeypatch.setattr(type(TOLERANCES), "parquet_rows", 10)
    made, at_each_write = [], set()

    class Watched(io.BytesIO):
        def write(self, data):
            at_each_write.add(len(made))
            return super().write(data)

    file = Watched()
    write_parquet(Table((Field("x", "x"),), ({"x": made.append(k) or float(k)} for k in range(25))), file)
    assert at_each_write >= {10, 20}  # the first rows before the others are made
    assert parquet.read_table(file).column("x").to_pylist() == made


def test_one_row_is_a_table_too():
    rows, file = table_of("static", CARLINA, "--columns", "sag"), io.BytesIO()
    write_parquet(Table((Field("sag_m", "sag", "m"),), rows), file)
    assert parquet.read_table(file).to_pylist() == rows


def test_without_pyarrow_the_message_says_how_to_get_it(monkeypatch, folder):
    monkeypatch.setattr("cablestudy.cli.tables.find_spec", lambda name: None)
    message = "pyarrow is not installed (pip install 'cablestudy[parquet]')"
    assert message in refusal("sweep", study_file(folder, STUDY), "--format", "parquet")
