"""Registry of result columns: find one by its name, list all.

A name alone is a column of one cable, or of a whole suspension; a name with an owner before it (`gondola.rms_x`,
`n1.sag`) is one of a part. The columns themselves are defined in `cable_columns`, and in `part_columns` and
`wind_columns` of `study/suspension/`.
"""

import re
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from itertools import product

from cablestudy.errors import SceneError
from cablestudy.scene.fields import suggestion
from cablestudy.scene.scene import quantity_of
from cablestudy.statics.suspension import AXES
from cablestudy.study.cable_columns import COLUMNS, FAMILIES, family_member
from cablestudy.study.column import Column, written_key
from cablestudy.study.suspension.part_columns import (
    OF_ONE_CABLE,
    WHOLE,
    all_cable_columns,
    body_columns,
    body_frequency_column,
    cable_mode_column,
    force_displacements,
    frequency_column,
    linear_ranges,
    link_columns,
    mode_columns,
    point_columns,
    static_frequency_column,
    stiffness_column,
)
from cablestudy.study.suspension.wind_columns import (
    actuator_columns,
    displacement_columns,
    link_force_column,
    midspan_column,
    rotation_columns,
    tension_columns,
)
from cablestudy.study.table import Field, Table
from cablestudy.study.tolerances import STUDY

COUPLED_MODE = re.compile(r"((?:[^.]+\.)?)frequency_(\d{1,6})(?:_Hz)?")  # frequency_K, BODY.frequency_K
OF_SUSPENSIONS = tuple(column for column in WHOLE if column.name not in {own.name for own in COLUMNS})


def find(name):
    """Look up a column by its name, with or without its unit, such as `sag`, `gondola.x_m` or `frequency_3`.

    No scene is consulted. A part of a suspension may have any name, so any name is accepted before the dot;
    `scene_kind.why_not` then says if a scene has the column.

    Parameters
    ----------
    name : str

    Returns
    -------
    Column

    Raises
    ------
    ValueError
        No such column; the message suggests one.
    """
    path, dot, quantity = name.rpartition(".")
    if match := COUPLED_MODE.fullmatch(name):
        column = _of_coupled_mode(match[1][:-1], int(match[2]))
        hint = f"frequency_K: K is a whole number from 1 to {STUDY.highest_mode_number}"
    elif dot:
        column, hint = _of_part(path, name), ""
    else:
        column, hint = _column_of_name(name, (*COLUMNS, *OF_SUSPENSIONS)) or family_member(name), ""
    if column is None:
        raise ValueError(f"unknown column {name!r} ({hint or _suggestion(path, quantity)})")
    return column


def _column_of_name(name, columns):
    """The one of some columns that has a name, with or without its unit; None where there is none."""
    return next((column for column in columns if name in (column.name, column.header)), None)


def _of_coupled_mode(body, number):
    """Column of the frequency of a coupled mode, of all or of a body; None for a number beyond all."""
    if not 0 < number <= STUDY.highest_mode_number:
        return None
    return body_frequency_column(body, number) if body else frequency_column(number)


def _of_part(path, name):
    """Column of the part of a suspension at a path, with the path before the name; None where there is none."""
    if not path:
        return None
    owner, _, quantity = name.partition(".")
    mode = family_member(quantity)
    return cable_mode_column(mode, owner) if mode else _column_of_name(name, _columns_of_path(path))


def _suggestion(path, quantity):
    """A column with a similar name, or where all are listed, for the message on an unknown column."""
    name = f"{path}.{quantity}" if path else quantity
    family = next((f.name for f in FAMILIES if re.fullmatch(f.name.replace("_K", r"_\w+"), quantity)), None)
    if family:
        return f"{family}: K is a whole number from 1 to {STUDY.highest_mode_number}"
    if path:
        before = f"{path.partition('.')[0]}."
        families = [f"{before}{family}" for family in ("frequency_K", *(family.name for family in FAMILIES))]
        return suggestion(name, [*families, *(column.name for column in _columns_of_path(path))])
    if "safety" in name:
        return "did you mean utilisation? it is 1 over the safety factor"
    if of_part := _column_of_name(f"NAME.{name}", _columns_of_path("NAME")):
        own_names = (own for own, twin in OF_ONE_CABLE.items() if twin.partition(".")[2] == of_part.name[5:])
        of_one = next((f"of one cable {own}; " for own in own_names), "")
        return f"{of_one}a part of a suspension has it: {of_part.name}, with the name of a body, point or cable"
    names = [column.name for column in (*COLUMNS, *FAMILIES, *OF_SUSPENSIONS)]
    spellings = name, re.sub(r"\d+", "K", name), name.lower()
    similar = next(filter(None, (get_close_matches(spelling, names, 1) for spelling in spellings)), None)
    return f"did you mean {similar[0]}?" if similar else "'cablestudy columns' lists them"


@lru_cache(maxsize=64)
def _columns_of_path(path):
    """Columns that a body, BODY.MARKER, free point, cable, link or actuator of a name could have: tuple of Column."""
    owner = path.partition(".")[0]
    return (
        *body_columns(owner),
        *all_cable_columns(owner),
        *(stiffness_column(owner, row, column) for row, column in product(AXES, AXES)),
        *(static_frequency_column(owner, number) for number in range(1, len(AXES) + 1)),
        *linear_ranges(owner),
        *force_displacements(owner),
        *mode_columns(owner),
        *link_columns(owner),
        *displacement_columns(path),
        *rotation_columns(path),
        *tension_columns(path),
        midspan_column(path),
        *actuator_columns(path),
    )


# ------------------------------------------------------------------------------------- keys that a study solves for


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
    """The column of a header of a stored table: as in `find`, or of the key that its study solved for."""
    try:
        return find(header)
    except ValueError:
        key = header.rpartition("_")[0]
        while key:  # units have underscores, and so have keys
            if quantity_of(key) and key_column(key).header == header:
                return key_column(key)
            key = key.rpartition("_")[0]
        return key_column(header)


# ---------------------------------------------------------------------------------------------------- all columns


def columns_table(text=""):
    """Table of the result columns that the program can compute, for the command `columns`.

    Parameters
    ----------
    text : str
        Only columns with this text in their headers (name and unit); blanks in it stand for underscores.

    Returns
    -------
    Table
        A row for each column: kind of scene that can have it (`cable` or `suspension`), header, unit, meaning, the most
        expensive result that it uses (such as `statics` or `modes`), and the keys that the scene must state.

    Raises
    ------
    SceneError
        No header has this text, and no column has this name.
    """
    text_in_header = "_".join(text.split())
    kinds = {"cable": (*COLUMNS, *FAMILIES), "suspension": patterns_of_suspensions()}
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


def patterns_of_suspensions():
    """Columns of suspensions for a list: with BODY, POINT, CABLE, ... for names and K for numbers; list of Column."""
    first_frequencies = {
        "BODY.frequency_K": body_frequency_column("BODY", 1),
        "BODY.frequency_static_K": static_frequency_column("BODY", 1),
        "frequency_K": frequency_column(1),
    }
    return [
        *body_columns("BODY"),
        *(stiffness_column("BODY", axis, axis) for axis in AXES),
        *linear_ranges("BODY"),
        *force_displacements("BODY"),
        *mode_columns("BODY"),
        *point_columns("POINT"),
        *all_cable_columns("CABLE"),
        *(replace(column, name=name) for name, column in first_frequencies.items()),
        *(cable_mode_column(family, "CABLE") for family in FAMILIES),
        # in the wind
        *displacement_columns("BODY"),
        *rotation_columns("BODY"),
        *displacement_columns("BODY.MARKER"),
        *displacement_columns("POINT"),
        *tension_columns("CABLE"),
        midspan_column("CABLE"),
        *actuator_columns("ACTUATOR"),
        *link_columns("LINK"),
        link_force_column("LINK"),
        *(column for column in WHOLE if column.needs != "run"),
    ]


def keys_of(column):
    """The keys that a column needs, as the file has them."""
    return ", ".join(written_key(key).replace("|", " or ").replace("load_case.", "cases.*.") for key in column.keys)
