"""Tables as HTML, with the estimated errors of their numbers: turned, cut or split so that they fit a page."""

import re
from dataclasses import dataclass, field

from cablestudy.pages.markup import boxed, element, text, unit_text
from cablestudy.study.status import OK
from cablestudy.study.table import Field, short, signed
from cablestudy.study.tolerances import STUDY

MOST_ROWS, END_ROWS = 100, 25  # rows of the longest table that is whole, and rows at each end of one that is cut
MOST_COLUMNS = 12  # of a table that is not split
TURNED = (8, 6)  # a table of more columns and at most so many rows has a line for each column
ERROR, LARGEST = "estimated error", "estimated error, at most"
SHORT = 20  # rows of a table that print does not break
AFTER_DOTS = re.compile(r"([._])(?=[a-z])")
HIDDEN = "status"  # field that is left out while it is ok everywhere


@dataclass
class TableGrid:
    """A table as HTML.

    Attributes
    ----------
    head : list of str
        Of the columns. HTML.
    rows : list of (list of str)
        Cells, the first one the head of its row. HTML.
    right : set of int
        Columns whose cells stand on the right.
    foot : list of str
        Cells of a last line, or none. HTML.
    """

    head: list
    rows: list
    right: set = field(default_factory=set)
    foot: list = field(default_factory=list)

    def html(self, caption):
        """The table in a box of its own."""
        heads = "".join(self._cell("th", place, cell, scope="col") for place, cell in enumerate(self.head))
        parts = [
            element("caption", text(caption)),
            element("thead", element("tr", heads)),
            element("tbody", "\n".join(map(self._row, self.rows))),
            element("tfoot", self._row(self.foot)) if self.foot else "",
        ]
        return boxed(element("table", "\n".join(parts), class_="short" if len(self.rows) <= SHORT else ""), caption)

    def _row(self, cells):
        first, *others = cells
        rest = "".join(self._cell("td", place, cell) for place, cell in enumerate(others, 1))
        head = AFTER_DOTS.sub(r"\1<wbr>", first)  # where the names of keys may go on in another line
        return element("tr", self._cell("th", 0, head, scope="row") + rest)

    def _cell(self, tag, place, content, **attributes):
        return element(tag, content, **attributes, class_="number" if place in self.right else "")


def table_html(table, caption, where_all=""):
    """A `Table` as HTML.

    Parameters
    ----------
    table : Table
    caption : str
    where_all : str
        Where all rows are, of a table that may be cut.
    """
    if not len(table.rows):
        return ""
    fields = _shown(table)
    turned = table.across or (fields[0].name if len(fields) > TURNED[0] and len(table.rows) <= TURNED[1] else "")
    if not (table.single or turned):
        return _by_rows(fields, table, caption, where_all)
    errors = list(table.errors()) if table.errors else []
    if table.single:
        return _single(fields, table.rows[0], errors[0] if errors else {}).html(caption)
    return _turned(fields, list(table.rows), errors, turned).html(caption)


@dataclass(frozen=True)
class _Column:
    """A field that is shown, and the one of the differences from its printed values, or None."""

    field: Field
    difference: Field | None = None

    @property
    def name(self):
        return self.field.name

    @property
    def title(self):
        return text(self.field.title)

    @property
    def unit(self):
        return unit_text(self.field.unit if self.difference else self.field.shown_unit)

    @property
    def head(self):
        """Title with unit."""
        return f"{self.title} [{self.unit}]" if self.unit else self.title

    def cell(self, row):
        """The cell in a row; where there is a printed value, that and the difference from it too."""
        computed = text(short(row.get(self.name) if self.difference else self.field.shown(row)))
        printed = self.difference and row.get(self.difference.printed)
        if printed is None:
            return computed
        difference = row.get(self.difference.name)
        known = "" if difference is None else f" ({signed(difference)})"
        return f"{computed}<br>" + element("small", f"printed {printed:.12g}{known}")


def _shown(table):
    """The columns of a table that are shown: list of `_Column`."""
    fields = [one for one in table.fields if not one.hidden]
    if any(one.name == HIDDEN for one in fields) and all(row.get(HIDDEN) == OK for row in table.rows):
        fields = [one for one in fields if one.name != HIDDEN]
    columns = []
    for one in fields:
        if one.printed:
            columns[-1] = _Column(columns[-1].field, one)
        else:
            columns.append(_Column(one))
    return columns


def _single(fields, row, errors):
    """One line for each quantity of the only row."""
    known = [field for field in fields if row.get(field.name) is not None]
    rows = [[one.title, one.cell(row), one.unit, error_text(errors.get(one.name))] for one in known]
    return TableGrid(["quantity", "value", "unit", ERROR], rows, {1, 3})


def _turned(fields, rows, errors, across):
    """One line for each quantity, one column for each row, headed by the cells of the field `across`."""
    head_field = next(field for field in fields if field.name == across)
    known = [one for one in fields if one is not head_field and any(row.get(one.name) is not None for row in rows)]
    largest = _largest(errors)
    lines = [
        [one.title, *(one.cell(row) for row in rows), one.unit, error_text(largest.get(one.name))] for one in known
    ]
    heads = [head_field.cell(row) for row in rows]
    head = ["quantity", *heads, "unit", LARGEST if len(rows) > 1 else ERROR]
    worst = [max(row.values(), default=None) for row in errors] or [None] * len(rows)
    foot = [LARGEST, *map(error_text, worst), "", ""] if len(rows) > 1 and any(worst) else []
    return TableGrid(head, lines, {*range(1, len(rows) + 1), len(rows) + 2}, foot)


def _by_rows(fields, table, caption, where_all):
    """One line for each row: cut where there are many rows, split where there are many columns."""
    total = len(table.rows)
    cut = total > MOST_ROWS
    places = [*range(END_ROWS), *range(total - END_ROWS, total)] if cut else range(total)
    columns = _columns(fields, [table.rows[place] for place in places])
    foot = _beside(columns, fields, table, cut)
    if cut or any(foot[:1]):  # with numbers of the rows before it
        columns.insert(0, ("row", [str(place + 1) for place in places], True))
        foot[:0] = [""] if foot else []
    if foot:
        foot[0] = LARGEST if total > 1 else ERROR
    if cut:
        columns = [(head, [*cells[:END_ROWS], "…", *cells[END_ROWS:]], side) for head, cells, side in columns]
        others = f"; {where_all}" if where_all else ""
        caption = f"{caption}: {2 * END_ROWS} of {total} rows, the first and the last{others}"
    return "".join(_split(columns, foot, caption))


def _columns(fields, rows):
    """Head, cells, and whether they stand on the right, of each field: list of tuples."""
    columns = []
    for one in fields:
        is_text = any(isinstance(row.get(one.name), str) for row in rows)
        columns.append((one.head, [one.cell(row) for row in rows], not is_text))
    return columns


def _beside(columns, fields, table, cut):
    """State the errors of a table: of few columns one by one, in more columns beside them, else the largest of each.

    Returns the cells of a last line, or an empty list.
    """
    largest = _largest(table.errors() if table.errors else ())
    foot = [error_text(largest.get(one.name)) for one in fields]
    stated = [place for place, error in enumerate(foot) if error]
    if cut or len(stated) > 2 or 0 in stated:
        return foot if stated else []
    errors = list(table.errors()) if stated else []
    for place in reversed(stated):
        columns.insert(place + 1, (ERROR, [error_text(row.get(fields[place].name)) for row in errors], True))
    return []


def _split(columns, foot, caption):
    """Yield the parts of a table, each with the first column."""
    first, others = columns[0], columns[1:]
    width = MOST_COLUMNS - 1
    parts = -(-len(others) // width) or 1
    width = -(-len(others) // parts)
    for part in range(parts):
        chosen = [first, *others[part * width : (part + 1) * width]]
        feet = [foot[0], *foot[1:][part * width : (part + 1) * width]] if foot else []
        rows = [list(cells) for cells in zip(*(cells for _, cells, _ in chosen), strict=True)]
        right = {place for place, (_, _, side) in enumerate(chosen) if side}
        whose = caption if parts == 1 else f"{caption} ({part + 1} of {parts})"
        yield TableGrid([head for head, _, _ in chosen], rows, right, feet).html(whose)


def _largest(errors):
    """Header -> largest known error of a column."""
    found = {}
    for row in errors:
        for name, error in row.items():
            found[name] = max(error, found.get(name, 0.0))
    return found


def error_text(error):
    """An estimated relative error as HTML, empty where it is not known: one digit, no less than rounding."""
    if error is None:
        return ""
    if error == 0:
        return "exact"
    digit, exponent = f"{max(error, STUDY.rounding):.0e}".split("e")
    return f"{digit}e{int(exponent)}"
