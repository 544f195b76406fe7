"""Result columns by name, of one cable and of suspensions; reasons why a scene cannot have a column; table of all."""

from cablestudy.errors import SceneError
from cablestudy.scene.scene import quantity_of
from cablestudy.study import columns as of_one_cable
from cablestudy.study.column import Column, written_key
from cablestudy.study.scene_kind import kind_of
from cablestudy.study.suspension import columns as of_suspensions
from cablestudy.study.suspension import part_columns
from cablestudy.study.table import Field, Table

OF_SUSPENSIONS = {c.name for c in part_columns.WHOLE} - {c.name for c in of_one_cable.COLUMNS}
HEADERS = {c.header for c in part_columns.WHOLE if c.name in OF_SUSPENSIONS}


def find(name):
    """The column of a name, with or without its unit; ValueError with a suggestion where there is none."""
    if "." in name or name.startswith("frequency_") or name in OF_SUSPENSIONS | HEADERS:
        return of_suspensions.find(name)
    return of_one_cable.find(name)


def key_column(key):
    """The column of a key that is a quantity and that a study solves for, in SI; ValueError where it is none."""
    quantity = quantity_of(key)
    if quantity is None:
        raise ValueError(f"{key} holds no number")
    return Column(key, quantity.unit, "solved for", "find", None)


def column_named(study, name):
    """The column of a name in a study: of the key that it solves for, by the key or its header, or any other."""
    if study.find and quantity_of(study.find.by):
        key = key_column(study.find.by)
        if name in (key.name, key.header):
            return key
    return find(name)


def find_header(header):
    """The column of a header of a stored table: as of `find`, or of the key that its study solved for."""
    try:
        return find(header)
    except ValueError:
        key = header.rpartition("_")[0]
        while key:  # units have underscores, and so have keys
            if quantity_of(key) and key_column(key).header == header:
                return key_column(key)
            key = key.rpartition("_")[0]
        return key_column(header)


def why_not(scene, column):
    """Reason for which a scene cannot have a column; empty where it can."""
    return kind_of(scene).why_not(scene, column)


def columns_table(text=""):
    """Table of the result columns that the program can compute, for the command `columns`.

    A row has the kind of scene that can have the column (`cable` or `suspension`), its header, unit and meaning, the
    stage of the computation that gives it, and the keys that the scene must state.

    Parameters
    ----------
    text : str
        Only columns with this text in their names or units; blanks in it stand for the underscores of headers.

    Raises
    ------
    SceneError
        No column has this text in its header, or is named so.
    """
    text_in_header = "_".join(text.split())
    kinds = {"cable": (*of_one_cable.COLUMNS, *of_one_cable.FAMILIES), "suspension": of_suspensions.families()}
    columns_of_kind = [(kind, c) for kind, columns in kinds.items() for c in columns if text_in_header in c.header]
    if not columns_of_kind:  # perhaps a member of a family, which is listed as a pattern only: n1.sag, or frequency_3
        try:
            column = find(text_in_header)
        except ValueError as error:
            raise SceneError(str(error)) from None
        of_suspension = "." in text_in_header or text_in_header.startswith("frequency_")
        columns_of_kind = [("suspension" if of_suspension else "cable", column)]
    rows = [
        {"of": kind, "column": c.header, "unit": c.unit, "meaning": c.meaning, "needs": c.needs, "key": keys_of(c)}
        for kind, c in columns_of_kind
    ]
    return Table(tuple(Field(name, name) for name in rows[0]), rows)


def keys_of(column):
    """The keys that a column needs, as the file has them."""
    return ", ".join(written_key(key).replace("|", " or ").replace("load_case.", "cases.*.") for key in column.keys)
