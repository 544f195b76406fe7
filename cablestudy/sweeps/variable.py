"""Variables that an option names in the rows of a study: a column or a varied key, and its values in a unit."""

import re
from dataclasses import dataclass
from difflib import get_close_matches

from pandas.api.types import is_numeric_dtype

from cablestudy.errors import Mistakes
from cablestudy.scene.scene import quantity_of
from cablestudy.scene.units import common_factor, si_or
from cablestudy.study.columns import column_named, find
from cablestudy.study.scene_kind import why_not
from cablestudy.study.varied_keys import TEXT, varied_key

OF_REFERENCE = re.compile("_(printed|difference)(_|$)")  # in a name: see `prepare.reference_header`


@dataclass(frozen=True)
class Variable:
    """A column or a varied key of a study, as an operand of a condition, or as the quantity that rows are sorted by."""

    name: str  # of its cells in a frame
    unit: str | None  # of its numbers; None for a varied key that is no quantity
    is_text: bool = False  # never numbers
    is_varied: bool = False  # numbers, or text

    def getter(self, unit=None):
        """Function that takes the cells of this variable from the frame of a study's rows, in a unit or its own.

        The frame is that of `rows.Rows.frame`; the cells are a Series of Float64, or of objects where some of them are
        text. ValueError if the unit has another dimension.
        """
        ratio = 1.0 if None in (self.unit, unit) else float(common_factor(self.unit, unit))

        def cells(frame):
            column = frame[self.name]
            if self.is_text:
                return column
            if self.is_varied and not is_numeric_dtype(column):
                numbers = column.map(lambda cell: si_or(cell, cell, self.unit or ""))
                return numbers.map(lambda cell: cell if isinstance(cell, str) else cell * ratio)
            return column.astype("Float64") * ratio

        return cells


def variable(name, study, option):
    """Find the column or varied key of a study that an option, named for messages, names: `Variable`.

    A column may be named with its unit or without; one that the study does not have is added to it. ValueError if there
    is neither a column nor a varied key of this name; the message suggests one.
    """
    if varied := varied_key(study, name):
        quantity = quantity_of(varied.key)
        unit = quantity.unit if varied.unit is TEXT and quantity else varied.unit
        return Variable(varied.header, unit, _is_text(study, varied, unit), is_varied=True)
    column = column_named(study, name) if study.find else None
    if column and column.needs == "find":
        return Variable(column.header, column.unit)
    if "." in name:
        _refuse_unknown(name, study)
    column = find(name)
    if column.name != "status" and not {column.name, column.header}.intersection(study.columns):
        study.ask(column.name, option)
    return Variable(column.header, column.unit, is_text=column.text)


def _is_text(study, varied, unit):
    """True if no value of a varied key is a number."""
    if varied.unit is not TEXT:
        return False
    (values,) = (values for entry in study.entries for key, values, _ in entry.columns if key == varied.key)
    return all(isinstance(si_or(cell, cell, unit or ""), str) for cell in map(varied.cell, values))


def ask_columns(study, names):
    """Add those columns of the option --columns that a study does not have to it.

    SceneError for names of neither a column nor a varied key, nor of printed values.
    """
    with Mistakes() as mistakes:
        for name in names:
            with mistakes.at("--columns"):
                if not (study.reference_path and OF_REFERENCE.search(name)):
                    variable(name, study, "--columns")


def _refuse_unknown(name, study):
    """Raise ValueError for a name with a dot that is no column of the scene of the study's first row."""
    scene = study.case(0)[1]
    try:
        reason = why_not(scene, find(name))
    except ValueError as error:
        reason = str(error)
    if reason:
        similar = get_close_matches(name, study.varied, 1)
        hint = f"did you mean {similar[0]}?" if similar else f"varied: {', '.join(study.varied) or 'nothing'}"
        raise ValueError(f"the study does not vary {name!r} ({hint}), and it is no column: {reason}")
