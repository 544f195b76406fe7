"""Tables as HTML, with the estimated errors of their numbers: turned, cut or split so that they fit a page."""

import re
from dataclasses import dataclass, field

from cablestudy.pages.markup import boxed, element, text, unit_text
from cablestudy.pages.tolerances import PAGES
from cablestudy.study.table import Field, short, signed
from cablestudy.study.table_rows import OK
from cablestudy.study.tolerances import STUDY

ERROR, LARGEST = "estimated error", "estimated error, at most"
AFTER_DOTS = re.compile(r"([._])(?=[a-z])")
HIDDEN = "status"  # field that is left out while it is ok everywhere


@dataclass
class TableGrid:
    """A table of cells of HTML."""

    head: list  # heads of the columns
    rows: list  # lists of cells, the first one the head of its row
    right: set = field(default_factory=set)  # indices of the columns whose cells stand on the right
    foot: list = field(default_factory=list)  # cells of a last line, or none

    def html(self, caption):
        """HTML of the table, in a box that scrolls if it is too wide: str."""
        heads = "".join(self._cell("th", column, cell, scope="col") for column, cell in enumerate(self.head))
        parts = [
            element("caption", text(caption)),
            element("thead", element("tr", heads)),
            element("tbody", "\n".join(map(self._row, self.rows))),
            element("tfoot", self._row(self.foot)) if self.foot else "",
        ]
        kind = "short" if len(self.rows) <= PAGES.unbroken_rows else ""
        return boxed(element("table", "\n".join(parts), class_=kind), caption)

    def _row(self, cells):
        """One line of the table."""
        head, *others = cells
        head = AFTER_DOTS.sub(r"\1<wbr>", head)  # where the names of keys may go on in another line
        others_html = "".join(self._cell("td", column, cell) for column, cell in enumerate(others, 1))
        return element("tr", self._cell("th", 0, head, scope="row") + others_html)

    def _cell(self, tag, column, content, **attributes):
        """One cell, of a column from 0."""
        return element(tag, content, **attributes, class_="number" if column in self.right else "")


def table_html(table, caption, where_all=""):
    """Lay out a `Table` for a page of HTML, with the estimated errors of its numbers.

    The HTML has a line for each row of the table. In three cases the table is turned, with a line for each column:

    - it is a single row by nature (`table.single`);
    - the values of one of its fields head the columns (`table.across`);
    - it has many columns and few rows (`PAGES.turned_columns`, `turned_rows`): the values of its first column are the
      heads.

    A table that is not turned is cut if it has more than `PAGES.table_rows`, to `end_rows` at each end; `where_all`
    says in its caption where a reader finds all rows. Empty for a table without rows.
    """
    if not len(table.rows):
        return ""
    columns = _shown_columns(table)
    is_wide = len(columns) > PAGES.turned_columns and len(table.rows) <= PAGES.turned_rows
    across = table.across or (columns[0].name if is_wide else "")  # the field that heads the columns of a turned table
    if table.single or across:
        return _turned(columns, table, across).html(caption)
    return _by_rows(columns, table, caption, where_all)


@dataclass(frozen=True)
class _Column:
    """A field that is shown, and the field of its differences from printed values, or None."""

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
        in_brackets = "" if difference is None else f" ({signed(difference)})"
        return f"{computed}<br>" + element("small", f"printed {printed:.12g}{in_brackets}")


def _shown_columns(table):
    """The columns of a table on a page: list of `_Column`.

    Without hidden ones, nor the status where all is well; a difference from a printed value joins the value's column.
    """
    left_out = {HIDDEN} if all(row.get(HIDDEN) == OK for row in table.rows) else ()
    columns = []
    for shown in table.fields:
        if shown.hidden or shown.name in left_out:
            continue
        if shown.printed:  # a difference, which the column before it shows too
            columns[-1] = _Column(columns[-1].field, difference=shown)
        else:
            columns.append(_Column(shown))
    return columns


def _turned(columns, table, across):
    """TableGrid with a line for each quantity, and a column for each row, headed by its cell of the field `across`."""
    rows, errors = list(table.rows), list(table.errors()) if table.errors else []
    heading = None if table.single else next(column for column in columns if column.name == across)
    heads = ["value"] if table.single else [heading.cell(row) for row in rows]
    largest = _largest(errors)
    lines = [
        [column.title, *(column.cell(row) for row in rows), column.unit, error_text(largest.get(column.name))]
        for column in columns
        if column is not heading and any(row.get(column.name) is not None for row in rows)
    ]
    head = ["quantity", *heads, "unit", LARGEST if len(rows) > 1 else ERROR]
    if not (largest or table.single):
        return TableGrid(head[:-1], [cells[:-1] for cells in lines], {*range(1, len(rows) + 1)})
    largest_of_rows = [max(row.values(), default=None) for row in errors] or [None] * len(rows)
    has_foot = len(rows) > 1 and any(largest_of_rows)
    foot = [LARGEST, *map(error_text, largest_of_rows), "", ""] if has_foot else []
    return TableGrid(head, lines, {*range(1, len(rows) + 1), len(rows) + 2}, foot)


@dataclass
class _CellColumn:
    """Cells of one column of a table with a line for each row. HTML."""

    head: str
    cells: list
    right: bool  # whether they stand on the right
    foot: str = ""  # cell of the last line


def _by_rows(columns, table, caption, where_all):
    """HTML with one line for each row: cut where there are many rows, split where there are many columns."""
    total = len(table.rows)
    is_cut = total > PAGES.table_rows
    indices = [*range(PAGES.end_rows), *range(total - PAGES.end_rows, total)] if is_cut else range(total)
    cell_columns = _cell_columns(columns, table, [table.rows[index] for index in indices], is_cut)
    has_foot = any(column.foot for column in cell_columns)
    if is_cut or cell_columns[0].foot:  # with numbers of the rows before it
        cell_columns.insert(0, _CellColumn("row", [str(index + 1) for index in indices], right=True))
    if has_foot:
        cell_columns[0].foot = LARGEST if total > 1 else ERROR
    if is_cut:
        for column in cell_columns:
            column.cells.insert(PAGES.end_rows, "…")
        others = f"; {where_all}" if where_all else ""
        caption = f"{caption}: {2 * PAGES.end_rows} of {total} rows, the first and the last{others}"
    return "".join(_split(cell_columns, has_foot, caption))


def _cell_columns(columns, table, rows, is_cut):
    """The cells of columns in some rows, with estimated errors: list of `_CellColumn`; numbers stand on the right.

    Where at most two columns have errors, and all rows are shown, each is followed by a column of its errors. Else its
    foot is its largest error.
    """
    largest = _largest(table.errors() if table.errors else ())
    with_error = {column.name for column in columns if column.name in largest}
    beside = not is_cut and len(with_error) <= 2 and columns[0].name not in with_error
    errors = list(table.errors()) if beside and with_error else []
    cell_columns = []
    for column in columns:
        name, has_text = column.name, any(isinstance(row.get(column.name), str) for row in rows)
        foot = "" if beside else error_text(largest.get(name))
        cell_columns.append(_CellColumn(column.head, [column.cell(row) for row in rows], not has_text, foot))
        if beside and name in with_error:
            cell_columns.append(_CellColumn(ERROR, [error_text(row.get(name)) for row in errors], right=True))
    return cell_columns


def _split(cell_columns, has_foot, caption):
    """Yield the HTML of the parts of a table, of at most `PAGES.table_columns` each, the first of them in all."""
    first, others = cell_columns[0], cell_columns[1:]
    width = PAGES.table_columns - 1
    count = -(-len(others) // width) or 1
    width = -(-len(others) // count)  # parts about equally wide
    for part in range(count):
        columns = [first, *others[part * width : (part + 1) * width]]
        rows = [list(cells) for cells in zip(*(column.cells for column in columns), strict=True)]
        right = {index for index, column in enumerate(columns) if column.right}
        foot = [column.foot for column in columns] if has_foot else []
        title = caption if count == 1 else f"{caption} ({part + 1} of {count})"
        yield TableGrid([column.head for column in columns], rows, right, foot).html(title)


def _largest(errors):
    """Field name -> largest known error of a column, from those of each row."""
    largest = {}
    for row in errors:
        for name, error in row.items():
            largest[name] = max(error, largest.get(name, 0.0))
    return largest


def error_text(error):
    """An estimated relative error as HTML, empty where it is not known: one digit, no less than rounding, up to 1."""
    if error is None:
        return ""
    if error > 1:
        return "above 1"
    if error == 0:
        return "exact"
    digit, exponent = f"{max(error, STUDY.rounding):.0e}".split("e")
    return f"{digit}e{int(exponent)}"
