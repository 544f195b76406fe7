"""Columns of suspensions: numbers of a body, a point or a cable by its name, and of the whole.

`gondola.x`, `n1.max_tension`: the name of a body, a free point or a cable, a dot, and a quantity. Functions take a
`SuspensionCase` and return a number.
"""

import re
from dataclasses import replace

import numpy as np

from cablestudy.scene.fields import suggestion
from cablestudy.study.columns import COLUMNS, MAX_MODE_NUMBER, Column
from cablestudy.system.rigid import to_angles
from cablestudy.system.suspension import AXES

# columns of a single cable that a cable of a suspension has too; the others are of its ends along x, or of loads on it
OF_CABLES = tuple(
    column
    for column in COLUMNS
    if column.needs in ("scene", "statics")
    and column.key in ("", "cable.strength")
    and column.name not in ("inclination", "rise", "iterations")
)
ANGLES = ("roll", "pitch", "yaw")
UNITS = {(False, False): "N/m", (False, True): "N/rad", (True, False): "N", (True, True): "N m/rad"}
MODE = re.compile(r"frequency_([1-9]\d{0,3})(_Hz)?")
STIFFNESS = re.compile(r"stiffness_(r?[xyz])(r?[xyz])(_\w+)?")


def _of_cable(column, name):
    """A column of single cables for one cable of a suspension."""

    def compute(case):
        place = list(case.scene.cables).index(name)
        return np.broadcast_to(column.compute(case.cables), (len(case.scene.cables),))[place]

    key = f"cables.{name}.strength" if column.key else ""
    return replace(column, name=f"{name}.{column.name}", compute=compute, key=key)


def _end_tension(name, end, word):
    def compute(case):
        return np.linalg.norm(case.equilibrium.end_forces[list(case.scene.cables).index(name), end])

    return Column(f"{name}.tension_{word}", "N", f"tension at the end `{word}`", "statics", compute)


def cable_columns(name):
    """The columns of one cable: list of Column."""
    ends = [_end_tension(name, end, word) for end, word in enumerate(("from", "to"))]
    return [*(_of_cable(column, name) for column in OF_CABLES), *ends]


def _place(case, name):
    return case.equilibrium.suspension.body_names.index(name)


def _coordinate(name, axis):
    def compute(case):
        return case.equilibrium.position[_place(case, name), axis]

    return Column(f"{name}.{'xyz'[axis]}", "m", f"place of its reference point along {'xyz'[axis]}", "statics", compute)


def _angle(name, axis):
    def compute(case):
        return np.degrees(to_angles(case.equilibrium.rotation[_place(case, name)])[axis])

    meaning = "of its attitude R = Rz(yaw) Ry(pitch) Rx(roll)"
    return Column(f"{name}.{ANGLES[axis]}", "deg", meaning, "statics", compute)


def _mass(name):
    def compute(case):
        return case.scene.bodies[name].mass if name in case.scene.bodies else case.scene.points[name].mass

    return Column(f"{name}.mass", "kg", "mass", "scene", compute)


def _stiffness(name, row, column):
    def compute(case):
        return case.equilibrium.body_stiffness[_place(case, name), AXES.index(row), AXES.index(column)]

    unit = UNITS[len(row) == 2, len(column) == 2]
    meaning = f"force or moment {row} per movement {column} of its reference point, all loads counted"
    return Column(f"{name}.stiffness_{row}{column}", unit, meaning, "stiffness", compute)


def _body_frequency(name, number):
    def compute(case):
        modes, place = case.mode_of(name, number)
        return modes.frequency[place], modes.error[place]

    meaning = "of the K-th mode with more than half of its kinetic energy in it"
    return Column(f"{name}.frequency_{number}", "Hz", meaning, "modes", compute)


def _frequency(number):
    def compute(case):
        modes = case.modes(number)
        return modes.frequency[number - 1], modes.error[number - 1]

    return Column(f"frequency_{number}", "Hz", "K-th frequency of all", "modes", compute, mode=(number,))


def point_columns(name):
    """The columns of a free point: list of Column."""
    return [*(_coordinate(name, axis) for axis in range(3)), _mass(name)]


def body_columns(name):
    """The columns of a body, without the entries of its stiffness and its frequencies: list of Column."""
    return [*(_coordinate(name, axis) for axis in range(3)), *(_angle(name, axis) for axis in range(3)), _mass(name)]


WHOLE = (
    Column("min_tension", "N", "smallest tension in any cable", "statics",
           lambda c: c.cables.statics.min_tension.min()),
    Column("max_tension", "N", "largest tension in any cable", "statics",
           lambda c: c.cables.statics.max_tension.max()),
    Column("max_utilisation", "", "largest stress over strength of any cable", "statics",
           lambda c: np.nanmax(_utilisation(c)), "cables.*.strength"),
    Column("cable_mass", "kg", "mass of all cables", "statics",
           lambda c: (c.cables.span.mass * c.cables.span.unstretched_length).sum()),
    *(column for column in COLUMNS if column.needs == "run"),
)  # fmt: skip


def _utilisation(case):
    stress = case.cables.statics.max_tension / case.cables.given("cable.section_area")
    return stress / case.cables.given("cable.strength")


def families():
    """Columns that stand for many, with words in capitals for names and numbers, for lists: list of Column."""
    columns = [*body_columns("BODY"), *point_columns("POINT")[:3], *cable_columns("CABLE")]
    numbered = [_body_frequency("BODY", 1), _frequency(1)]
    columns += [replace(column, name=column.name[:-1] + "K") for column in numbered]
    return [*columns, *(_stiffness("BODY", axis, axis) for axis in AXES), *WHOLE]


def find(scene, name):
    """The column of a name in a suspension, with or without its unit.

    Parameters
    ----------
    scene : SuspensionScene
    name : str

    Returns
    -------
    Column

    Raises
    ------
    ValueError
        No such column; the message suggests one.
    """
    owner, dot, quantity = name.partition(".")
    if not dot:
        if match := MODE.fullmatch(name):
            return _frequency(_number(name, match))
        return _among(WHOLE, name, "a suspension has columns such as BODY.x, CABLE.max_tension and frequency_1")
    junctions = [point for point, table in scene.points.items() if table.free]
    if owner in scene.cables:
        return _among(cable_columns(owner), name)
    if owner in junctions:
        return _among(point_columns(owner), name)
    if owner in scene.bodies:
        if match := MODE.fullmatch(quantity):
            return _body_frequency(owner, _number(name, match))
        if match := STIFFNESS.fullmatch(quantity):
            column = _stiffness(owner, match[1], match[2])
            if name in (column.name, column.header):
                return column
        return _among(body_columns(owner), name)
    known = [*scene.bodies, *junctions, *scene.cables]
    if owner in scene.points:
        raise ValueError(f"unknown column {name!r}: {owner} is a fixed point")
    raise ValueError(f"unknown column {name!r}: no body, free point or cable {owner} ({suggestion(owner, known)})")


def _number(name, match):
    if int(match[1]) > MAX_MODE_NUMBER:
        raise ValueError(f"unknown column {name!r} (frequency_K: K is a whole number from 1 to {MAX_MODE_NUMBER})")
    return int(match[1])


def _among(columns, name, advice=""):
    for column in columns:
        if name in (column.name, column.header):
            return column
    hint = suggestion(name, [column.name for column in columns])
    raise ValueError(f"unknown column {name!r} ({hint}{'; ' + advice if advice else ''})")
