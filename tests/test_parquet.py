"""--format parquet: numbers, texts, units, in parts, and what it needs."""

import io
import subprocess
import sys
from itertools import count

import pytest
from command import CARLINA, refusal, study_file, table_of
from pyarrow import parquet

from cablestudy.study.parquet import write_parquet
from cablestudy.study.table import Field, Table
from cablestudy.study.tolerances import STUDY as TOLERANCES

pytestmark = pytest.mark.usefixtures("folder")

STUDY = (
    "vary: [{winch.controller.gain: [0.3, {auto: 6 dB}], cable.material: [aramid, steel], gondola.mass: [5, 6]}]\n"
    "columns: [mass, sag, dof]\n"
)


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


def test_rows_that_are_made_as_they_are_written_are_not_kept():
    made = count()
    table = Table((Field("x", "x"),), ({"x": float(next(made))} for _ in range(120_000)))
    file = io.BytesIO()
    write_parquet(table, file)
    assert parquet.read_table(file).column("x").to_pylist() == list(map(float, range(120_000)))


def test_one_row_is_a_table_too():
    rows, file = table_of("static", CARLINA, "--columns", "sag"), io.BytesIO()
    write_parquet(Table((Field("sag_m", "sag", "m"),), rows), file)
    assert parquet.read_table(file).to_pylist() == rows


def test_without_pyarrow_the_message_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr("cablestudy.cli.tables.find_spec", lambda name: None)
    message = "pyarrow is not installed (pip install 'cablestudy[parquet]')"
    assert message in refusal("sweep", study_file(".", STUDY), "--format", "parquet")
