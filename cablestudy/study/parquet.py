"""Tables as Parquet: the optional extra `cablestudy[parquet]`."""

from itertools import islice

from cablestudy.study.table import exact
from cablestudy.study.tolerances import STUDY


def write_parquet(table, file):
    """Write a table as Parquet to an open binary file, from its beginning to its end: a pipe will do.

    Numbers are float64 and everything else is text; the metadata of each field has its `unit`.
    """
    import pyarrow
    from pyarrow.parquet import ParquetWriter

    texts = {field.name for field in table.fields if _holds_text(field, table.rows)}
    schema = pyarrow.schema([
        pyarrow.field(
            field.name,
            pyarrow.string() if field.name in texts else pyarrow.float64(),
            metadata={"unit": field.unit} if field.unit else None,
        )
        for field in table.fields
    ])  # fmt: skip
    rows = iter(table.rows)
    with ParquetWriter(file, schema) as writer:
        while block := list(islice(rows, STUDY.parquet_rows)):
            columns = [[_cell(row.get(name), name in texts) for row in block] for name in schema.names]
            arrays = [pyarrow.array(cells, kind) for cells, kind in zip(columns, schema.types, strict=True)]
            writer.write_batch(pyarrow.record_batch(arrays, schema=schema))


def _holds_text(field, rows):
    """True if some cells of a column are text; rows that are computed as they are written are not looked at."""
    return field.text or (isinstance(rows, list) and any(isinstance(row.get(field.name), str) for row in rows))


def _cell(value, text):
    """A value as text or as a float, None where there is none."""
    if value is None:
        return None
    return (value if isinstance(value, str) else exact(value)) if text else float(value)
