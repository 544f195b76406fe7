"""Columns of suspensions by their names: which there are, and why a suspension cannot have one."""

import re
from dataclasses import replace
from functools import lru_cache
from itertools import product

from cablestudy.scene.fields import suggestion
from cablestudy.statics.suspension import AXES
from cablestudy.study.column import lacks
from cablestudy.study.columns import FAMILIES
from cablestudy.study.columns import find as find_of_one
from cablestudy.study.suspension.part_columns import (
    FORCES,
    INSTEAD,
    WHOLE,
    all_cable_columns,
    body_columns,
    body_frequency_column,
    cable_mode_column,
    force_displacements,
    frequency_column,
    linear_ranges,
    link_columns,
    missing_key,
    mode_columns,
    point_columns,
    static_frequency_column,
    stiffness_column,
)
from cablestudy.study.suspension.wind_columns import (
    actuator_columns,
    link_force_column,
    midspan_column,
    place_columns,
    tension_columns,
    turn_columns,
    wind_columns_of,
)
from cablestudy.study.tolerances import STUDY

# beginnings of the names of columns that bodies have for many axes or numbers
OF_BODIES = "stiffness_", "frequency_", "share_", "damping_ratio_", "linear_range_", "force_displacement_"
MODE = re.compile(r"((?:[^.]+\.)?)frequency_(\d{1,6})(?:_Hz)?")
OF_CABLE_MODES = re.compile("|".join(family.name.replace("_K", r"_\w+") for family in FAMILIES))


def families():
    """All columns, to be printed with BODY, POINT, CABLE, ... for names and K for numbers: list of Column."""
    first_frequencies = {
        "BODY.frequency_K": body_frequency_column("BODY", 1),
        "BODY.frequency_static_K": static_frequency_column("BODY", 1),
        "frequency_K": frequency_column(1),
    }
    numbered = [replace(column, name=name) for name, column in first_frequencies.items()]
    stiffness = [*(stiffness_column("BODY", axis, axis) for axis in AXES), *linear_ranges("BODY")]
    stiffness += [*force_displacements("BODY"), *mode_columns("BODY")]
    of_whole = [column for column in WHOLE if column.needs != "run"]
    of_owners = [*body_columns("BODY"), *stiffness, *point_columns("POINT"), *all_cable_columns("CABLE"), *numbered]
    in_wind = [*place_columns("BODY"), *turn_columns("BODY"), *place_columns("BODY.MARKER"), *place_columns("POINT")]
    in_wind += [*tension_columns("CABLE"), midspan_column("CABLE")]
    modes_of_cable = [cable_mode_column(family, "CABLE") for family in FAMILIES]
    of_links = [*link_columns("LINK"), link_force_column("LINK")]
    return [*of_owners, *modes_of_cable, *in_wind, *actuator_columns("ACTUATOR"), *of_links, *of_whole]


def find(name):
    """`Column` of a suspension by its name, with or without its unit, such as `gondola.x_m` or `max_tension`.

    Bodies and cables may have any name: `why_not` says if those of a scene have the column.

    Parameters
    ----------
    name : str

    Raises
    ------
    ValueError
        No such column; the message suggests one.
    """
    if match := MODE.fullmatch(name):  # frequency_K, or BODY.frequency_K
        owner, number = match[1][:-1], int(match[2])
        if 0 < number <= STUDY.highest_mode_number:
            return body_frequency_column(owner, number) if owner else frequency_column(number)
        raise ValueError(
            f"unknown column {name!r} (frequency_K: K is a whole number from 1 to {STUDY.highest_mode_number})"
        )
    owner, dot, quantity = name.partition(".")
    if dot and OF_CABLE_MODES.fullmatch(quantity):
        return cable_mode_column(find_of_one(quantity), owner)
    columns = _columns_of_path(name.rpartition(".")[0]) if dot else WHOLE
    for column in columns:
        if owner and name in (column.name, column.header):
            return column
    numbered = f"{owner}.frequency_K" if dot else "frequency_K"
    of_cable_modes = [f"{owner}.{family.name}" for family in FAMILIES] if dot else []
    hint = suggestion(name, [numbered, *of_cable_modes, *(column.name for column in columns)])
    raise ValueError(f"unknown column of a suspension {name!r} ({hint})")


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
        *place_columns(path),
        *turn_columns(path),
        *tension_columns(path),
        midspan_column(path),
        *actuator_columns(path),
    )


def why_not(scene, column):
    """Reason for which a suspension cannot have a column, in words; empty where it can.

    Nothing of this name is in the scene, it has no such column, or the scene lacks a key that the column needs.

    Parameters
    ----------
    scene : SuspensionScene
    column : Column
    """
    owner, dot, quantity = column.name.partition(".")  # owner: name of a body, point, cable, link or actuator
    if not dot:
        return _why_not_of_whole(scene, column)
    columns = _columns_of_owners(scene)
    in_wind = [other.name for other in wind_columns_of(scene, column.name.rpartition(".")[0])]
    if column.name in in_wind:
        key = lacks(scene, column)
        return f"{column.name} needs the key {key}, which the scene does not have" if key else ""
    if owner in scene.actuators:
        return f"{owner} has no column {quantity} ({suggestion(column.name, in_wind)})"
    if owner not in columns:
        fixed = f"{owner} is a fixed point, which has no columns"
        missing = f"no body, free point, cable or link {owner} ({suggestion(owner, columns)})"
        return fixed if owner in scene.points else missing
    if OF_CABLE_MODES.fullmatch(quantity) and owner in scene.cables:
        return ""
    names = [*(other.name for other in columns[owner](owner)), *in_wind]
    if column.name not in names and not (owner in scene.bodies and quantity.startswith(OF_BODIES)):
        return f"{owner} has no column {quantity} ({suggestion(column.name, names)})"
    if column.key == FORCES and not scene.load_case.forces:
        return f"{column.name} needs the key cases.*.forces, which the scene does not have"
    key = missing_key(scene, owner, column) if owner in scene.cables else ""
    return f"{column.name} needs the key {key}, which the scene does not have" if key else ""


def of_each_cable(scene, name):
    """Name and `Column` of each cable for a quantity such as `sag`: list of pairs.

    Empty where `name` is no quantity of cables, or a column of the whole suspension.
    """
    if "." in name or any(name in (column.name, column.header) for column in WHOLE):
        return []
    try:
        return [(cable, find(f"{cable}.{name}")) for cable in scene.cables]
    except ValueError:
        return []


def _columns_of_owners(scene):
    """Name of each body, free point, cable and link -> function that lists the columns of that name."""
    junctions = [name for name, point in scene.points.items() if point.free]
    kinds = (scene.bodies, body_columns), (junctions, point_columns), (scene.cables, all_cable_columns)
    kinds = *kinds, (scene.links, link_columns)
    return {name: columns for names, columns in kinds for name in names}


def _why_not_of_whole(scene, column):
    """Reason as of `why_not`, for a column of the whole suspension, without a name before it."""
    strong = any(cable.section_breaking_force is not None for cable in scene.cables.values())
    if column.name in ("max_utilisation", "max_peak_utilisation") and not strong:
        return f"{column.name} needs the strength or breaking_force of a cable, which the scene does not have"
    if of_whole := next((other for other in WHOLE if other.name == column.name), None):
        key = "" if of_whole.name == "max_utilisation" else lacks(scene, of_whole)
        return f"{column.name} needs the key {key}, which the scene does not have" if key else ""
    if MODE.fullmatch(column.name):
        return ""
    hint = ""
    if column.name in INSTEAD or f".{column.name}" in {other.name for other in all_cable_columns("")}:
        hint = f"; here it is CABLE.{INSTEAD.get(column.name, column.name)}"
    return f"{column.name} is a column of a single cable{hint}"
