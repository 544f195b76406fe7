"""Goal of a search: a column, the value that it is to take, and the key that is solved for."""

import re
from dataclasses import dataclass
from math import isfinite

from cablestudy.errors import Mistakes, SceneError
from cablestudy.scene.fields import Quantity
from cablestudy.scene.layers import mapping_at, split_key, value_at
from cablestudy.scene.scene import quantity_of, read_scene
from cablestudy.scene.study import Find
from cablestudy.scene.units import common_factor, expected, show, split
from cablestudy.study.column import Column
from cablestudy.study.columns import find, key_column
from cablestudy.study.table import celsius, shown_unit

SIGN = re.compile("([<>=!]+)")
LIMITS = "limits"  # in place of COLUMN = VALUE: the values of a key for which all limits of the scene hold
_GOAL = "expected COLUMN = VALUE, for example 'sag = 2 m'"


@dataclass(frozen=True)
class Goal:
    """Goal of a search: the value that a result column is to take, and the key that is varied to reach it."""

    column: Column
    value: float  # that the column is to take, in its unit
    key: Column  # of the values of the key that is solved for, from `columns.key_column`
    quantity: Quantity  # unit of the key and limits of its values
    between: tuple | None  # range of the key, rising, in SI
    locations: dict  # part (column, value, by, between) -> for messages (its position, its key in a file or "")

    def __str__(self):
        unit = f" {self.column.unit}" if self.column.unit else ""
        return f"{self.column.name} = {self.value:.6g}{unit}"

    @property
    def elsewhere(self):
        """Advice for messages how to search another range."""
        return f"{self.locations['between'][1] or '--between LOW:HIGH'} searches elsewhere"

    def of_key(self, *values):
        """Values of the key with the unit that tables for people show, for messages."""
        unit = shown_unit(self.quantity.unit)
        shown_values = map(celsius, values) if unit != self.quantity.unit else values
        return " ".join(filter(None, (" to ".join(f"{value:.6g}" for value in shown_values), unit)))


def read_find(goal, by, between):
    """Split the arguments of the command `find` into their parts, as texts; `read_goal` reads their values.

    Parameters
    ----------
    goal : str
        COLUMN = VALUE, for example `sag = 2 m`; or LIMITS.
    by : str
        Key that is varied.
    between : str or None
        Range of the key, for example `100 N:10 kN`.

    Returns
    -------
    stated : Find
        Column, value, key and range.
    locations : dict
        Name of each part (column, value, by, between) -> its place for messages: (option of the command, "").

    Raises
    ------
    SceneError
        The goal or the range is not of this form.
    """
    goal = "limit_margin = 0" if goal.strip() == LIMITS else goal
    column, sign, value = (
        (part.strip() for part in SIGN.split(goal, maxsplit=1)) if SIGN.search(goal) else (goal, "", "")
    )
    if column and value and sign != "=":
        raise SceneError(f"find takes =, not {sign}: write {show(f'{column} = {value}')}")
    column = "_".join(column.split())  # as in the headings of Markdown
    if not (column and sign and value) or SIGN.search(value):
        raise SceneError(f"{_GOAL}, got {show(goal)}")
    ends = None
    if between is not None:
        ends = tuple(part.strip() for part in between.split(":"))
        if len(ends) != 2 or not all(ends):
            raise SceneError(f"--between {between}: expected LOW:HIGH, for example 100N:10kN")
    options = {"column": "find", "value": "find", "by": f"--by {by}", "between": f"--between {between}"}
    locations = {part: (option, "") for part, option in options.items()}
    return Find.model_construct(column=column, value=value, by=by, between=ends), locations


def goal_of_study(study):
    """The `Goal` of a study with `find`; errors are those of `read_goal`."""
    locations = {part: (study.source.where(("find", part)), f"find.{part}") for part in Find.model_fields}
    return read_goal(study.find, locations, study.document)


def read_goal(stated, locations, document):
    """Read and check the parts of a goal, and convert its numbers to the units of its column and its key.

    Parameters
    ----------
    stated : Find
        The parts as the user wrote them.
    locations : dict
        Name of each part (column, value, by, between) -> its place for messages: (position, its key in a file or "").
    document : Document
        File of the scene, for the messages on a key that does not exist and on a tension in percent.

    Returns
    -------
    Goal
    """
    parts = {}
    # part -> (other parts that must have been read, without a mistake, for it; function of these that reads it)
    steps = {
        "column": ((), lambda: _number_column(stated.column)),
        "value": (("column",), lambda column: number_in_unit(stated.value, column, lambda: read_scene(document))),
        "by": ((), lambda: _quantity_of_key(stated.by, document)),
        "between": (("by",), lambda quantity: stated.between and _range(stated.between, quantity)),
    }
    with Mistakes() as mistakes:
        for part, (needs, read) in steps.items():
            if parts.keys() >= set(needs):
                with mistakes.at(*locations[part]):
                    parts[part] = read(*(parts[name] for name in needs))
    return Goal(parts["column"], parts["value"], key_column(stated.by), parts["by"], parts["between"], locations)


def _number_column(name):
    """The column of a name, which holds numbers that depend on the scene."""
    column = find(name)
    if column.text:
        raise ValueError(f"{column.name} is text: no value of a key can be found for it")
    if column.needs == "run" or column.name == "iterations":
        raise ValueError(f"{column.name} describes the computation: no value of a key can be found for it")
    return column


def number_in_unit(value, column, scene_of):
    """Read a number that a user compares a result column with, and convert it to the unit of the column.

    Parameters
    ----------
    value : float or str
        Number in the unit of the column, or text of a number with a unit of its own.
    column : Column
    scene_of : callable
        Function of no argument that returns the scene, or raises SceneError. It serves one message only: that a tension
        in percent of the breaking force must be written as a force.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        No finite number, a unit of another dimension, or a percentage of a force.
    """
    try:
        number, unit = split(value) if isinstance(value, str) else (value, "")
    except ValueError as error:
        unit = f" in {column.unit}, or with a unit" if column.unit else ""
        raise ValueError(f"{column.name}: expected a number{unit}, got {show(value)}{error}") from None
    if unit in ("%", "percent") and column.unit == "N":
        raise ValueError(_share_message(float(number) / 100, value, column, scene_of))
    try:
        number = float(number * common_factor(unit, column.unit) if unit else number)
    except ValueError as error:
        raise ValueError(f"{column.name}: {error}") from None
    if not isfinite(number):
        raise ValueError(f"{column.name}: expected a finite number, got {show(value)}")
    return number


def _share_message(share, value, column, scene_of):
    """Message on a tension in percent, with the force to write instead where the scene has a breaking force."""
    try:
        scene = scene_of()
    except SceneError:  # it may lack what is to be found
        scene = None
    cables, owner = scene.cables if scene else {}, column.name.rpartition(".")[0]
    cable = cables.get(owner) if owner or len(cables) > 1 else next(iter(cables.values()), None)
    force = getattr(cable, "section_breaking_force", None)
    hint = "give the tension in N; of the breaking force, utilisation = is a share"
    if force:
        stated = f"{column.name} = {share * force:.6g} N"
        hint = f"write {stated}, which is that share of the breaking force of {force:.6g} N"
    return f"{column.name}: expected a force, got {show(value)}: {hint}"


def _quantity_of_key(key, document):
    """The `Quantity` of a key; ValueError where it is none, or several numbers."""
    path = split_key(key)
    quantity = quantity_of(key)
    items = value_at(document.value, path)
    if quantity is not None and isinstance(items, list):
        example = ".".join((*path, *(["0", "0"] if items and isinstance(items[0], list) else ["0"])))
        raise ValueError(f"holds several numbers: give one of them, for example {example}")
    if quantity is None:
        try:
            read_scene(document.with_sets([(key, 1, "")]))
        except SceneError as error:
            unknown = [mistake.message for mistake in error.mistakes if mistake.message.startswith("unknown")]
            if unknown:
                raise ValueError(unknown[0]) from None
        example = _with_a_name(path, document) or "cable.preload"
        raise ValueError(f"holds no number that varies continuously: give a quantity, for example {example}")
    return quantity


def _with_a_name(path, document):
    """A key with a name that a path lacks, such as bodies.cabin.mass for bodies.mass; empty where there is none."""
    table, rest = mapping_at(document.value, path[:1]), path[1:]
    names = [name for name, value in table.items() if isinstance(value, dict)]
    keys = (".".join((path[0], name, *rest)) for name in names if rest)
    return next(filter(quantity_of, keys), "")


def _range(ends, quantity):
    """The two ends of a range of a key, rising, in SI."""
    low, high = (quantity.read(end) for end in ends)
    if not (isinstance(low, float) and isinstance(high, float)):
        raise ValueError(f"expected {expected(quantity.unit)}, got {show(ends[0])} and {show(ends[1])}")
    if low >= high:
        raise ValueError(f"the first end must be below the second, got {show(ends[0])} and {show(ends[1])}")
    return low, high
