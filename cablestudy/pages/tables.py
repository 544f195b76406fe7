"""Tables as HTML, with the estimated errors of their numbers: turned, cut or split so that they fit a page."""

import re
from dataclasses import dataclass

from cablestudy.pages.markup import boxed, element, text, unit_text
from cablestudy.pages.tolerances import PAGES
from cablestudy.study.table import Field, short, signed
from cablestudy.study.table_rows import OK
from cablestudy.study.tolerances import STUDY

ERROR, LARGEST = "estimated error", "estimated error, at most"
AFTER_DOTS = re.compile(r"([._])(?=[a-z])")
HIDDEN = "status"  # field that is left out while it is ok everywhere


@dataclass
class CellColumn:
    """One column of a table of cells of HTML; of the first column each is the head of its row."""

    head: str
    cells: list
    right: bool = False  # whether they stand on the right
    foot: str = ""  # cell of the last line, which is there if any column has one


def columns_of(heads, rows, right=()):
    """Columns of a table given by its rows, lists of cells; those of the indices `right` stand on the right: list."""
    columns = enumerate(zip(heads, zip(*rows, strict=True), strict=True))
    return [CellColumn(head, list(cells), index in right) for index, (head, cells) in columns]


def grid_html(columns, caption):
    """HTML of a table of `CellColumn`, in a box that scrolls if it is too wide: str."""
    kinds = [_kind(column) for column in columns]
    heads = [element("th", column.head, scope="col", class_=kind) for column, kind in zip(columns, kinds, strict=True)]
    foot = [column.foot for column in columns]
    rows = list(zip(*(column.cells for column in columns), strict=True))
    parts = [
        element("caption", text(caption)),
        element("thead", element("tr", "".join(heads))),
        element("tbody", "\n".join(_line(cells, kinds) for cells in rows)),
        element("tfoot", _line(foot, kinds)) if any(foot) else "",
    ]
    kind = "short" if len(rows) <= PAGES.unbroken_rows else ""
    return boxed(element("table", "\n".join(parts), class_=kind), caption)


def _kind(column):
    """Class of CSS of a `CellColumn`: of numbers, or of words that stay on one line; empty for longer texts."""
    if column.right:
        return "number"
    return "word" if max(map(len, column.cells), default=0) <= PAGES.unbroken_characters else ""


def _line(cells, kinds):
    """One line of a table, of cells of HTML and their classes of CSS."""
    head, *others = cells
    head = AFTER_DOTS.sub(r"\1<wbr>", head)  # where the names of keys may go on in another line
    others = "".join(element("td", cell, class_=kind) for cell, kind in zip(others, kinds[1:], strict=True))
    return element("tr", element("th", head, scope="row", class_=kinds[0]) + others)


def table_html(table, caption, where_all=""):
    """Lay out a `Table` for a page of HTML, with the estimated errors of its numbers.

    The HTML has a line for each row of the table. The table is turned, with a line for each column, if it is a single
    row by nature (`table.single`), or if the values of one of its fields head the columns: of `table.across`, or, where
    it has many columns and few rows (`PAGES.turned_columns`, `turned_rows`), of the first one.

    A table that is not turned is cut if it has more than `PAGES.table_rows`, to `end_rows` at each end; `where_all`
    says in its caption where a reader finds all rows. Empty for a table without rows.
    """
    if not len(table.rows):
        return ""
    columns = _shown_columns(table)
    is_wide = len(columns) > PAGES.turned_columns and len(table.rows) <= PAGES.turned_rows
    across = table.across or (columns[0].name if is_wide else "")  # the field that heads the columns of a turned table
    if table.single or across:
        return grid_html(_turned(columns, table, across), caption)
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
        if len(computed) > PAGES.unbroken_characters:
            computed = element("span", computed, class_="text")
        printed = self.difference and row.get(self.difference.printed)
        if printed is None:
            return computed
        difference = row.get(self.difference.name)
        in_brackets = "" if difference is None else f" ({signed(difference)})"
        return f"{computed}<br>" + element("small", f"printed {printed:.12g}{in_brackets}")


def _shown_columns(table):
    """The columns of a table on a page: list of `_Column`.

    Without hidden ones, nor the status where all is well, or of a single row, whose reason is above the table.
    A difference from a printed value joins the value's column.
    """
    left_out = {HIDDEN} if table.single or all(row.get(HIDDEN) == OK for row in table.rows) else ()
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
    """List of `CellColumn` with a line for each quantity, and a column for each row, headed by its cell of `across`."""
    errors = list(table.errors()) if table.errors else []
    heading = None if table.single else next(column for column in columns if column.name == across)
    shown = [c for c in columns if c is not heading and any(row.get(c.name) is not None for row in table.rows)]
    feet = _largest_of_rows(errors, len(table.rows))
    quantities = CellColumn("quantity", [column.title for column in shown], foot=LARGEST if any(feet) else "")
    values = [
        CellColumn(heading.cell(row) if heading else "value", [c.cell(row) for c in shown], right=True, foot=foot)
        for row, foot in zip(table.rows, feet, strict=True)
    ]
    cell_columns = [quantities, *values, CellColumn("unit", [column.unit for column in shown])]
    largest = _largest(errors)
    if largest or table.single:
        of_quantities = [error_text(largest.get(column.name)) for column in shown]
        cell_columns.append(CellColumn(LARGEST if len(values) > 1 else ERROR, of_quantities, right=True))
    return cell_columns


def _largest_of_rows(errors, count):
    """Text of the largest error of each of `count` rows: list; empty texts for one row, and where no error is known."""
    largest = [max(row.values(), default=None) for row in errors]
    return list(map(error_text, largest)) if count > 1 and any(largest) else [""] * count


def _by_rows(columns, table, caption, where_all):
    """HTML with one line for each row: cut where there are many rows, split where there are many columns."""
    total = len(table.rows)
    is_cut = total > PAGES.table_rows
    indices = [*range(PAGES.end_rows), *range(total - PAGES.end_rows, total)] if is_cut else range(total)
    cell_columns = _cell_columns(columns, table, [table.rows[index] for index in indices], is_cut)
    if is_cut or cell_columns[0].foot:  # with numbers of the rows before it
        cell_columns.insert(0, CellColumn("row", [str(index + 1) for index in indices], right=True))
    if any(column.foot for column in cell_columns):
        cell_columns[0].foot = LARGEST if total > 1 else ERROR
    if is_cut:
        for column in cell_columns:
            column.cells.insert(PAGES.end_rows, "…")
        others = f"; {where_all}" if where_all else ""
        caption = f"{caption}: {2 * PAGES.end_rows} of {total} rows, the first and the last{others}"
    return "".join(_split(cell_columns, caption))


def _cell_columns(columns, table, rows, is_cut):
    """The cells of columns in some rows, with estimated errors: list of `CellColumn`; numbers stand on the right.

    Where at most two columns have errors, and all rows are shown, each is followed by a column of its errors. Else its
    foot is its largest error.
    """
    largest = _largest(table.errors() if table.errors else ())
    with_error = {column.name for column in columns if column.name in largest}
    in_columns = not is_cut and len(with_error) <= 2 and columns[0].name not in with_error
    errors = list(table.errors()) if in_columns and with_error else []
    cell_columns = []
    for column in columns:
        name, has_text = column.name, any(isinstance(row.get(column.name), str) for row in rows)
        foot = "" if in_columns else error_text(largest.get(name))
        cell_columns.append(CellColumn(column.head, [column.cell(row) for row in rows], not has_text, foot))
        if in_columns and name in with_error:
            cell_columns.append(CellColumn(ERROR, [error_text(row.get(name)) for row in errors], right=True))
    return cell_columns


def _split(columns, caption):
    """Yield the HTML of the parts of a table, of at most `PAGES.table_columns` each, the first of them in all."""
    first, *others = columns
    count = -(-len(others) // (PAGES.table_columns - 1)) or 1
    width = -(-len(others) // count)  # parts about equally wide
    for part in range(count):
        title = caption if count == 1 else f"{caption} ({part + 1} of {count})"
        yield grid_html([first, *others[part * width : (part + 1) * width]], title)


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
