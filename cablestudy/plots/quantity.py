"""Quantities that a study can draw along an axis or as a colour: a column, or a varied key."""

from dataclasses import dataclass

from cablestudy.plots.words import axis_label, column_words, key_words, quantity_text, unit_text, value_text
from cablestudy.scene.scene import quantity_of
from cablestudy.scene.units import split, to_si
from cablestudy.study.columns import column_named
from cablestudy.study.prepare import SHOWN_BY, reference_header
from cablestudy.study.table import shown_unit
from cablestudy.study.varied_keys import varied_key

SI = (0.0, 1.0)  # scale of a quantity that is shown in the unit of its cells


@dataclass(frozen=True)
class DrawnQuantity:
    """A column or a varied key of a study's table."""

    name: str  # of the cells in rows
    words: str  # for people
    unit: str  # in which it is shown
    scale: tuple = SI  # the cell of 0 and that of 1 in this unit
    printed: str | None = None  # name of the printed values
    categories: tuple | None = None  # its values where they are no numbers
    key: str | None = None  # the varied key, if it is one

    @property
    def label(self):
        """Label of an axis."""
        return axis_label(self.words, self.unit)

    @property
    def names(self):
        """Its values as text where they are no numbers: list, else empty."""
        return [value_text(name) for name in self.categories or ()]

    def value(self, row, printed=False):
        """Its number in a row, of categories their position; None where the row has none."""
        cell = row.get(self.printed) if printed and self.printed else None
        cell = row.get(self.name) if cell is None else cell
        if cell is None:
            return None
        if self.categories is not None:
            return float(self.categories.index(str(cell)))
        if isinstance(cell, str):
            return None
        low, high = self.scale
        return float(cell) if self.scale == SI else float(f"{(cell - low) / (high - low):.12g}")

    def text(self, row):
        """Its value in a row as text."""
        cell = row.get(self.name)
        if cell is None:
            return "none"
        return value_text(cell) if self.categories is not None else quantity_text(self.value(row), self.unit)

    def level(self, position):
        """One of its values, as `value` gives them, as text."""
        if self.categories is None:
            return quantity_text(position, self.unit)
        return self.names[int(position)]


def quantity_named(study, name, rows):
    """The `DrawnQuantity` of a column or varied key, with or without its unit."""
    varied = varied_key(study, name)
    return _column(study, name) if varied is None else _varied(study, varied, rows)


def quantities_varied(study, rows):
    """The `DrawnQuantity` of each varied key, entry by entry of the study: list of lists."""
    return [[quantity_named(study, key, rows) for key in entry.keys] for entry in study.entries]


def _column(study, name):
    """`DrawnQuantity` of a column."""
    column = column_named(study, name)
    if column.needs == "find":
        return DrawnQuantity(column.header, key_words(column.name), *_shown(column.unit))
    printed = reference_header(column.header, "printed")
    return DrawnQuantity(column.header, column_words(column.name), column.unit, printed=printed)


def _varied(study, varied, rows):
    """`DrawnQuantity` of a varied key in the unit of its first value; without cells, of the column that shows it."""
    key = varied.key
    if rows and varied.header not in rows[0]:
        shown = [column_named(study, name) for name in SHOWN_BY.get(key, ())]
        column = next((column for column in shown if column.header in rows[0]), None)
        if column:
            return DrawnQuantity(column.header, key_words(key), column.unit, key=key)
    cells = [row[varied.header] for row in rows if row.get(varied.header) is not None]
    if any(isinstance(cell, str) for cell in cells) or (varied.unit is None and quantity_of(key)):
        categories = tuple(dict.fromkeys(map(str, cells)))
        return DrawnQuantity(varied.header, key_words(key), "", categories=categories, key=key)
    unit, scale = _written_unit(study, varied)
    return DrawnQuantity(varied.header, key_words(key), unit_text(unit), scale, key=key)


def _shown(unit):
    """The unit that people read, and the cells of 0 and 1 in it."""
    shown = shown_unit(unit)
    return shown, SI if shown == unit else (to_si(f"0 {shown}", unit), to_si(f"1 {shown}", unit))


def _written_unit(study, varied):
    """Unit of the first value of a key as the study has it, of a temperature degC, and the cells of 0 and 1 in it."""
    first = next(values[0] for entry in study.entries for key, values, _ in entry.columns if key == varied.key)
    unit = varied.unit or ""
    if not isinstance(first, str) or unit in ("%", "K"):
        return _shown(unit)
    written = split(first)[1]
    return written, (to_si(f"0 {written}", unit), to_si(f"1 {written}", unit))
