"""Columns of the keys that a study varies: numbers in SI where every value is a number, else text as in the file."""

import json
from dataclasses import dataclass

from cablestudy.scene.scene import quantity_of
from cablestudy.scene.units import common_factor, split, to_si
from cablestudy.study.table import Field, header, short, shown_unit

PERCENT = "%"  # unit of shares of the breaking force; other pure numbers have none
TEXT = None


@dataclass(frozen=True)
class VariedKey:
    """A varied key of a study and its column."""

    key: str  # dotted
    unit: str | None  # of the numbers in its column, "" of pure ones; TEXT where a value is no quantity
    text: bool = False  # whether some of its cells are text

    @property
    def header(self):
        """Name of its column in CSV and JSON: `cable.preload_N`; without a unit the key itself."""
        return header(self.key, self.unit)

    @property
    def field(self):
        """The field of its column."""
        return Field(self.header, self.key, self.unit or "", distinct=True, text=self.text, varied=True)

    def cell(self, written):
        """A value of the study as its cell.

        Parameters
        ----------
        written : object
            As the study has it: "1.85 mm", 0.325, "coupled", a list.

        Returns
        -------
        float, int or str
            A number in the unit of the column; where that is TEXT, plain numbers and text as they are, and JSON of
            anything else.
        """
        if self.unit is not TEXT:
            return _number(written, self.unit)
        plain = isinstance(written, str | int | float) and not isinstance(written, bool)
        return written if plain else json.dumps(written, ensure_ascii=False)

    def label(self, cell):
        """A cell as people read it: `100 N`."""
        return f"{short(self.field.shown({self.header: cell}))} {shown_unit(self.unit or '')}".rstrip()


def varied_keys(study):
    """The varied keys of a study, in order: list of VariedKey."""
    columns = [(key, values) for entry in study.entries for key, values, _ in entry.columns]
    return [_varied_key(key, values) for key, values in columns]


def varied_key(study, name):
    """The VariedKey of a name, with or without its unit; None where the study varies no such key."""
    return next((varied for varied in varied_keys(study) if name in (varied.key, varied.header)), None)


def _varied_key(key, values):
    """The VariedKey of a key with these values."""
    if not isinstance(values, list):
        values = [values[0], values[len(values) - 1]]  # those of a range or a sample have one unit
    unit = _unit_of(quantity_of(key), values)
    cells = map(VariedKey(key, unit).cell, values if unit is TEXT else ())
    return VariedKey(key, unit, any(isinstance(cell, str) for cell in cells))


def _unit_of(quantity, values):
    """The unit in which all values of a key are numbers, or TEXT."""
    for unit in () if quantity is None else (quantity.unit, PERCENT):
        try:
            for value in values:
                _number(value, unit)
        except ValueError:
            continue
        return unit
    return TEXT


def _number(written, unit):
    """A value of the study as a number in a unit; ValueError where it is no such number."""
    if unit != PERCENT:
        return to_si(written, unit)
    if not (isinstance(written, str) and written.rstrip().endswith(PERCENT)):
        raise ValueError("not a share")
    number, unit_of_share = split(written)
    return float(number * common_factor(unit_of_share, PERCENT))
