"""Schemas, templates and names of columns, and tables and files as they leave the program; see also `reference`."""

from cablestudy.study.markdown import fitted as fitted
from cablestudy.study.parquet import write_parquet as write_parquet
from cablestudy.study.table import write_whole as write_whole


def schema(kind):
    """JSON Schema of a "scene", "suspension" or "study": dict."""
    from cablestudy.scene import schema as schemas

    return getattr(schemas, f"{kind}_schema")()


def template(kind):
    """A commented file of a kind, such as "guy", to begin with: str."""
    from importlib.resources import files

    return (files("cablestudy") / "templates" / f"{kind}.yaml").read_text(encoding="utf-8")


def is_column(name):
    """True if a study could have a column of this name, with or without its unit: bool."""
    from cablestudy.study.columns import find

    try:
        find(name)
    except ValueError:
        return False
    return True


def column_names():
    """Names with units of the columns of one cable and of the whole of a suspension: list of str."""
    from cablestudy.study.cable_columns import COLUMNS
    from cablestudy.study.suspension.part_columns import WHOLE

    return list(dict.fromkeys(column.header for column in (*COLUMNS, *WHOLE)))
