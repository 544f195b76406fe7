"""Files, columns and materials: the commands that compute nothing, and tables and files as they leave the program."""

from cablestudy.study.markdown import fitted as fitted
from cablestudy.study.parquet import write_parquet as write_parquet
from cablestudy.study.table import write_whole as write_whole


def validate(files, set=()):
    """Read and check scenes and studies.

    Parameters
    ----------
    files : sequence of str
    set : sequence of str, optional
        Texts KEY=VALUE.

    Returns
    -------
    table : Table
        File, kind, number of cases, status.
    mistakes : list of Mistake
    notes : list of str
    """
    from cablestudy.study.files import validate_table

    return validate_table(files, tuple(set))


def schema(kind):
    """JSON Schema of a kind of file: dict.

    Parameters
    ----------
    kind : {"scene", "suspension", "study"}
    """
    from cablestudy.scene import schema as schemas

    return getattr(schemas, f"{kind}_schema")()


def keys(kind, beginning=""):
    """Every key of a kind of file, or those that begin so: unit, default, meaning, what is allowed: Table.

    Parameters
    ----------
    kind : {"scene", "suspension", "study"}
    beginning : str, optional
        A dotted key.
    """
    from cablestudy.study.files import key_table

    return key_table(kind, beginning)


def template(kind):
    """A commented file to begin with: str.

    Parameters
    ----------
    kind : {"guy", "line", "section", "zipline", "footbridge", "gondola", "suspension", "study"}
    """
    from importlib.resources import files

    return (files("cablestudy") / "templates" / f"{kind}.yaml").read_text(encoding="utf-8")


def columns(text=""):
    """Every column, or those with a text in their names: what it is of, name, unit, meaning, what it needs: Table."""
    from cablestudy.study.columns import columns_table

    return columns_table(text)


def materials(files=()):
    """Materials and ropes with their numbers and sources, of files and built-in: Table."""
    from cablestudy.study.files import materials_table

    return materials_table(files)


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
