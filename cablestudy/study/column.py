"""A result column: name, unit, meaning, and the function that computes it; its number in a case, or why it has none."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from types import NoneType

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.scene.scene import missing
from cablestudy.study.table import Field, header
from cablestudy.study.tolerances import STUDY

SHAPELESS = "a part of the cable without weight is slack: it has no definite form"
LIMP = "a slack cable without weight has no definite form"
MM, UM = 1e3, 1e6
# keys that columns need, as `Column.key`
METAL, DIAMETER, STRONG = "cable.section_area", "cable.section_diameter", "cable.section_breaking_force"
# attribute of the scene that is computed -> the key in the file by which it can be
WRITTEN = {
    "section_area": "area", "section_diameter": "diameter", "section_breaking_force": "breaking_force",
    "section_elastic_modulus": "area", "section_density": "area", "forces_on_end_2": "cases.*.forces.end_2",
    "nonzero_gravity": "gravity",
}  # fmt: skip

# values of `Column.needs`
CLOSED = ("scene", "statics", "stiffness")
SYSTEM = ("gondola", "loop", "wind")  # of gondola and cable as one linear system, which states its own errors
DISCRETE = ("modes", *SYSTEM)


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str  # without its unit
    unit: str
    meaning: str
    # the most expensive result that it uses: scene, statics, stiffness, modes, gondola, loop, wind or run;
    # find: a key that a study solves for; limits: what the limits of the scene compare, in all their load cases
    needs: str
    compute: Callable  # Results -> ndarray, or CableCase -> float
    key: str = ""  # keys of the scene without which it has no value, separated by commas; one|another: either
    each: bool = False  # computed case by case, although it is a closed form
    mode: tuple = ()  # of a mode's frequency: number (from 1), kind, and symmetry or None
    without: str = ""  # key that a scene must not have
    text: bool = False  # whether its cells are texts
    # "form": by how the cable hangs between its ends, which a slack part without weight leaves open: refused there;
    # "sag": by its sag, whose estimated error counts too; empty: by neither
    determined_by: str = ""
    # of a number in which larger ones may cancel: function of the arguments of `compute` for the sum of their sizes
    whole: Callable | None = None
    of_reference: bool = False  # by the reference state alone, in which no steady wind blows
    any_error: bool = False  # whether it has the error that it reaches, which may be above the accuracy of the model
    follows_drag: bool = False  # whether its function counts the error by drag of the wind, if there is any

    @property
    def least_error(self):
        """Estimated relative error of the closed form due to rounding; None of a column without an error. [-]"""
        if self.needs in ("run", "find") or self.text or self.name == "iterations":
            return None
        return 0.0 if self.needs == "scene" else STUDY.rounding

    @cached_property
    def header(self):
        """Name with its unit, as in CSV and JSON."""
        return header(self.name, self.unit)

    @property
    def field(self):
        """Its `Field` in a table."""
        title = self.name if self.needs == "find" else self.name.replace("_", " ")  # a key is shown as files have it
        return Field(self.header, title, self.unit, text=self.text)

    @cached_property
    def keys(self):
        """The keys of `key`, a tuple."""
        return tuple(filter(None, self.key.split(", ")))


def scaled(value_and_error, factor):
    """A number and its relative error, times a factor."""
    value, error = value_and_error
    return factor * value, error


def least_work_first(columns):
    """Columns in the order in which they cost least: list.

    By falling mode number, since the model of a high mode has the lower ones. Columns of the loop come before those of
    the wind: the largest gain then also proves the stability that columns of the wind need.
    """
    return sorted(columns, key=lambda column: (column.needs == "wind", -column.mode[0] if column.mode else 0))


def attribute(scene, path):
    """Attribute of a scene, or entry of its tables, at a path with dots; None where part of the path is missing."""
    for name in path.split("."):
        scene = scene.get(name) if isinstance(scene, dict) else getattr(scene, name, None)
    return scene


def require(document, scene, keys, command):
    """Raise the SceneError of the first of some dotted keys that a command needs and a scene does not have."""
    for key in keys:
        if attribute(scene, key) in (None, {}):
            raise missing(document, key, command)


def lacking_key(scene, column):
    """The first key that a column needs and a scene has no value for, or an empty text."""
    return first_without_value(scene, column.keys)


def first_without_value(scene, keys):
    """The first of some keys of columns, as `Column.key`, that a scene has no value for, or an empty text."""
    for key in keys:
        if all(is_absent(attribute(scene, name)) for name in key.split("|")):
            return written_key(key.split("|")[0])
    return ""


def is_absent(value):
    """True for the value of a key that a scene does not have: None, or an empty text, list or table."""
    return value is None or (isinstance(value, tuple | dict) and not value)


def written_key(key):
    """The key of the file for a key of `Column.key`, which may be an attribute that the scene computes."""
    table, _, name = key.rpartition(".")
    return f"{table}.{WRITTEN[name]}".strip(".") if name in WRITTEN else key


def without_key(column, key):
    """Reason why a scene without a key has no such column; empty for no key."""
    return f"{column.name} needs the key {key}, which the scene does not have" if key else ""


def lacking_error(scene, column):
    """The error of a column that needs a key which its case lacks."""
    return NoSolutionError(f"{column.name} needs the key {lacking_key(scene, column)}, which this case does not have")


def shapeless_error(column, limp):
    """The error of a column `determined_by` the form of a cable that is slack in part, or, if `limp`, all of it."""
    return NoSolutionError(LIMP if limp else f"no {column.name}: {SHAPELESS}")


def not_finite_error(column):
    """The error of a column whose value is not finite."""
    return NoSolutionError(f"{column.header} is not finite")


def of_part(errors, whole, numbers):
    """Relative errors of numbers in which larger ones cancel, from those of these; `whole` as of `Column`. [-]"""
    size = np.abs(numbers)
    return errors * np.divide(np.maximum(whole, size), size, out=np.ones_like(size), where=size > 0)


def number_of(column, case):
    """Number of a result column in one case, without its error."""
    result = column.compute(case)
    return result[0] if isinstance(result, tuple) else result


def value_and_error(column, case):
    """Value of a result column in one case, and its estimated relative error.

    Parameters
    ----------
    column : Column
        The result, such as the sag; one that the scene can have, see `scene_kind.why_not`.
    case : CableCase or SuspensionCase
        A scene in one load case.

    Returns
    -------
    number : float, int or None
        In the unit of the column. None where the case has no such number, though nothing is missing: a loop that is
        stable at any gain has no largest gain.
    error : float or None
        Relative. None where none is stated, NaN where it is not known; from `case.error_of`. [-]

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no value, or it is not finite.
    """
    case.check(column)
    result = column.compute(case)
    number, error = result if isinstance(result, tuple) else (result, None)
    if not isinstance(number, (float, int, NoneType)):
        number = np.asarray(number).item()
    if isinstance(number, float) and not isfinite(number):
        raise lacking_error(case.scene, column) if lacking_key(case.scene, column) else not_finite_error(column)
    error = case.error_of(column, number, error)
    return float(number) + 0.0 if isinstance(number, float) else number, error  # + 0.0: no minus before a zero
