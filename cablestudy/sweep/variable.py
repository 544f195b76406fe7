"""What an option names in the rows of a study: a column or a varied key, and its values in a unit."""

from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache

from pandas.api.types import is_numeric_dtype

from cablestudy.scene.scene import quantity_of
from cablestudy.scene.units import DIMENSIONS, common_factor, factor, split
from cablestudy.study.columns import find


@dataclass(frozen=True)
class Variable:
    """A column or a varied key, as an operand."""

    name: str  # of its cells in a frame
    unit: str | None  # of its numbers, SI for a varied key; None for a varied key that is no quantity
    is_text: bool = False  # never numbers
    is_varied: bool = False  # its cells are as written

    def getter(self, unit=None):
        """Function of a frame, from `rows.Rows.frame`, that returns its cells.

        Parameters
        ----------
        unit : str or None
            Of the numbers returned; None for the column's own unit, and for SI of a varied key.

        Returns
        -------
        callable
            DataFrame -> Series of Float64, or of objects where some of them are text.

        Raises
        ------
        ValueError
            The unit has another dimension.
        """
        ratio = 1.0 if None in (self.unit, unit) else float(common_factor(self.unit, unit))

        def cells(frame):
            column = frame[self.name]
            if self.is_text:
                return column
            if self.is_varied:
                column = column.map(lambda cell: _varied_value(cell, unit))
                return column.astype("Float64") if is_numeric_dtype(column) else column
            return column.astype("Float64") * ratio

        return cells


def variable(name, study, option):
    """The Variable of a name; a column that the study does not have is added to it, as `option` asks for it.

    Raises
    ------
    ValueError
        Neither a column nor a varied key; the message suggests one.
    """
    if name in study.varied:
        quantity = quantity_of(name)
        return Variable(name, quantity and quantity.unit, is_varied=True)
    if "." in name:
        near = get_close_matches(name, study.varied, 1)
        listed = f"did you mean {near[0]}?" if near else f"varied: {', '.join(study.varied) or 'nothing'}"
        raise ValueError(f"the study does not vary {name!r} ({listed})")
    column = find(name)
    if column.name != "status" and not {column.name, column.header}.intersection(study.columns):
        study.ask(column.name, option)
    return Variable(column.header, column.unit, is_text=column.name == "status")


@lru_cache(maxsize=65536)
def _varied_value(cell, unit):
    """A varied value as a float in a unit (None: SI), or unchanged when it is no quantity."""
    try:
        number, own = split(cell) if isinstance(cell, str) else (None, "")
        ratio = common_factor(own or si_unit(unit), unit) if unit is not None else factor(own, si_unit(own))
        return float(ratio) * float(cell) if number is None else float(number * ratio)
    except (ValueError, OverflowError):
        return cell


@lru_cache(maxsize=256)
def si_unit(unit):
    """The SI unit of the same dimension; the unit itself when none of DIMENSIONS fits."""
    for known in DIMENSIONS if unit else ():
        try:
            factor(unit, known)
        except ValueError:
            continue
        return known
    return unit
