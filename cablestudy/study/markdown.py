"""Tables as Markdown: whole, or laid out to the width of a terminal."""

import re
from itertools import chain, zip_longest
from textwrap import wrap
from typing import NamedTuple
from unicodedata import combining, east_asian_width

from cablestudy.study.tolerances import STUDY

UNIT = re.compile(r"\[.*\]")  # at the end of a head


class TextGrid(NamedTuple):
    """The texts of a table: column heads, `left` or `right` of each column, and rows of cells."""

    heads: list
    sides: list
    body: list

    def columns(self, indices):
        """`TextGrid` of the columns with some indices."""
        heads, sides, *body = ([row[index] for index in indices] for row in (self.heads, self.sides, *self.body))
        return TextGrid(heads, sides, body)

    def widths(self):
        """Width of each column, as wide as its widest cell."""
        return [max(map(text_width, column)) for column in zip(self.heads, *self.body, strict=True)]


def whole(table):
    """Yield a table as text, its `digits` significant ones in each number, first and last rows of a long one."""
    fields = [field for field in table.fields if not field.hidden]
    rows, omitted = (table.rows, 0) if table.across else _first_and_last(table.rows)
    yield rendered(_grid(table, fields, rows, omitted), padding=2)
    if omitted:
        yield _note_on_rows(table, omitted)


def fitted(table, width):
    """Lay out a table as Markdown text that is no wider than a terminal.

    Of many rows only the first and the last are shown. A status that is ok in all rows is hidden, and long texts are
    wrapped. Tables that are `single` or `across` are transposed: one line for each quantity. If another table is too
    wide, its heads are wrapped, onto lines below the rule. If that is not enough, it is transposed if it has few rows;
    else columns are left out from the right: first values printed in a source, then secondary ones, then the others.

    Returns
    -------
    text : str
    omitted_fields : list of str
        Names of the columns left out, without units; "printed values" stands for all columns of printed values.
    """
    rows, omitted = _first_and_last(table.rows)
    fields = [field for field in table.fields if not field.hidden and not _is_redundant(field, rows)]
    grid = _grid(table, fields, rows, omitted)
    if table.single or table.across:
        return _in_blocks(grid, width), []
    fitting = wrapped(grid, width) or wrapped(grid, width, heads=True)
    if fitting is None and 0 < len(rows) <= STUDY.few_rows:
        names = fields[0].name if _is_unique_text(fields[0], rows) else ""
        return _in_blocks(_side_by_side(fields, rows, names, table.digits), width), []
    fitting, kept = (fitting, list(range(len(fields)))) if fitting else _with_columns_left_out(grid, fields, width)
    text = rendered(fitting or grid.columns(kept)) + (_note_on_rows(table, omitted) if omitted else "")
    omitted_fields = [field for index, field in enumerate(fields) if index not in kept]
    return text, list(dict.fromkeys("printed values" if field.printed else field.plain for field in omitted_fields))


def _with_columns_left_out(grid, fields, width):
    """The grid with wrapped heads and as many columns as fit, None where not one does; and the indices of these.

    Columns are left out from the right: printed values first, then secondary ones, and why a row failed last.
    """

    def order(index):
        field = fields[index]
        return not field.printed, not field.secondary, bool(field.unless), -index

    fitting, indices = wrapped(grid, width, heads=True), list(range(len(fields)))
    for index in sorted(indices[1:], key=order):
        if fitting is None:
            indices.remove(index)
            fitting = wrapped(grid.columns(indices), width, heads=True)
    return fitting, indices


def _is_redundant(field, rows):
    """True if all cells of a column are the text with which it need not be shown, such as `ok`."""
    return field.unless and all(row.get(field.name) == field.unless for row in rows)


def _is_unique_text(field, rows):
    """True if the cells of a column are texts, all different, which can name the rows."""
    names = {row.get(field.name) for row in rows}
    return len(names) == len(rows) and all(isinstance(name, str) for name in names)


def _first_and_last(rows):
    """The rows shown, first and last ones of many, and the number of those left out between them."""
    left_out, half = max(0, len(rows) - STUDY.table_rows), STUDY.table_rows // 2
    return ([*rows[:half], *rows[-half:]] if left_out else list(rows)), left_out


def _note_on_rows(table, left_out):
    """Line of text on the rows that are left out in the middle of a table."""
    total, half = len(table.rows), STUDY.table_rows // 2
    return (
        f"\n{left_out} of {total} rows are left out here, from {half + 1} to {total - half}"
        "; csv, json and jsonl have them all.\n"
    )


# ------------------------------------------------------------------------------------------------------- layouts


def _grid(table, fields, rows, left_out):
    """The `TextGrid` of some rows of a table."""
    if table.single or table.across:
        return _side_by_side(fields, rows, table.across, table.digits, ["value"] if table.single else None)
    return _rows(fields, rows, left_out, table.digits)


def _rows(fields, rows, left_out, digits):
    """One line for each row."""
    # printed values stand beside the column that says their unit
    heads = [f"{f.title} [{f.shown_unit}]" if f.unit and not f.printed else f.title for f in fields]
    body = _cells(fields, rows, digits)
    if left_out:
        body.insert(STUDY.table_rows // 2, ["…"] * len(fields))
    return TextGrid(heads, [_side(field.name, rows) for field in fields], body)


def _side_by_side(fields, rows, names, digits, heads=None):
    """One line for each quantity that has a value, for each of them where none has one, and one column for each row.

    `names` is the field of their heads, or empty; then heads that are not given are `row 1`, `row 2`, ...
    """
    others = [field for field in fields if field.name != names]
    with_value = [field for field in others if any(row.get(field.name) is not None for row in rows)] or others
    columns = zip(with_value, zip(*_cells(with_value, rows, digits), strict=True), strict=True)
    heads = heads or [str(row[names]) if names else f"row {number}" for number, row in enumerate(rows, 1)]
    return TextGrid(
        ["quantity", *heads, "unit"],
        ["left", *["right"] * len(rows), "left"],
        [[field.title, *cells, field.shown_unit] for field, cells in columns],
    )


def _cells(fields, rows, digits):
    """The cells of each row."""
    counts = [_digits([field.shown(row) for row in rows], digits) if field.distinct else digits for field in fields]
    return [[_cell(field, row, count) for field, count in zip(fields, counts, strict=True)] for row in rows]


def _side(name, rows):
    """Alignment of the cells of a column: numbers `right`, texts `left`."""
    return "left" if not rows or any(isinstance(row.get(name), str) for row in rows) else "right"


def _in_blocks(grid, width):
    """Text of a grid with a line for each quantity and a column for each row, as several tables if it is too wide."""
    values = range(1, len(grid.heads) - 1)
    for block_count in range(1, len(values) + 1):
        count = -(-len(values) // block_count)
        blocks = [(0, *values[start : start + count], len(grid.heads) - 1) for start in range(0, len(values), count)]
        fitting = [wrapped(grid.columns(indices), width, STUDY.narrowest_column // 2) for indices in blocks]
        if all(fitting):
            break
    return "\n".join(rendered(block or grid.columns(indices)) for block, indices in zip(fitting, blocks, strict=True))


def wrapped(grid, width, narrowest=STUDY.narrowest_column, heads=False):
    """Wrap the texts of a grid onto several lines, so that it is as narrow as a terminal; None where it is still wider.

    Columns of texts are wrapped to the width `narrowest` at least, or a third of the terminal. If `heads` may be
    wrapped too, their first line stands above the rule, the others are rows below it.
    """
    # no line break within a unit, until its no-break spaces become blanks again
    whole_units = [UNIT.sub(lambda unit: unit[0].replace(" ", "\xa0"), head) for head in grid.heads]
    longest = map(_on_two_lines, whole_units) if heads else grid.heads
    columns = list(zip(*grid.body, strict=True)) or [()] * len(grid.heads)
    widths = grid.widths()
    narrowest = min(narrowest, width // 3)
    least_widths = [_least_width(*column, narrowest) for column in zip(longest, columns, strict=True)]
    for _ in range(sum(widths) + 3 * len(widths) + 1 - width):  # excess characters, taken from the widest columns
        widest = max(range(len(widths)), key=lambda index: (widths[index] > least_widths[index], widths[index]))
        if widths[widest] == least_widths[widest]:
            return None
        widths[widest] -= 1
    first_line, *body = ([head.replace("\xa0", " ") for head in line] for line in _lines_of(whole_units, widths))
    body += chain.from_iterable(_lines_of(row, widths) for row in grid.body)
    return TextGrid(first_line, grid.sides, body)


def _least_width(head, cells, narrowest):
    """The least width of a column whose texts may be wrapped, but no numbers."""
    width_of_cells = max(map(text_width, cells), default=0)
    return max(text_width(head), min(width_of_cells, narrowest) if any(map(_is_text, cells)) else width_of_cells)


def _is_text(cell):
    """True if a cell is neither empty nor a number."""
    try:
        float(cell or 0)
    except ValueError:
        return True
    return False


def _on_two_lines(head):
    """The longer line of a head on two lines, divided between the words where that line is shortest."""
    words = head.split(" ")
    halves = [max(" ".join(words[:index]), " ".join(words[index:]), key=text_width) for index in range(1, len(words))]
    return min((head, *halves), key=text_width)


def _lines_of(row, widths):
    """The cells of a row on as many lines as their widths need: list of rows."""
    lines = [wrap(cell, width) if text_width(cell) > width else [cell] for cell, width in zip(row, widths, strict=True)]
    return [list(cells) for cells in zip_longest(*lines, fillvalue="")]


def rendered(grid, padding=0):
    """A grid as Markdown, without line breaks in its cells; columns are at least `padding` wider than their heads."""
    import tabulate

    tabulate.MIN_PADDING = padding
    heads, *body = ([" ".join(cell.splitlines()).strip() for cell in row] for row in (grid.heads, *grid.body))
    return tabulate.tabulate(body, heads, "pipe", disable_numparse=True, colalign=grid.sides if body else None) + "\n"


def text_width(text):
    """Characters that a text takes on a terminal."""
    if text.isascii():
        return len(text)
    return sum(0 if combining(character) else 2 if east_asian_width(character) in "WF" else 1 for character in text)


# --------------------------------------------------------------------------------------------------------- cells


def _digits(values, least):
    """The fewest significant digits, not below `least`, with which different numbers are different texts."""
    numbers = {value for value in values if isinstance(value, float)}
    counts = range(least, STUDY.most_digits)
    return next(
        (count for count in counts if len({short(n, count) for n in numbers}) == len(numbers)), STUDY.most_digits
    )


def _cell(field, row, digits):
    """Text of a cell; of a difference from a printed value, both the value and the difference."""
    if not field.printed:
        return short(field.shown(row), digits).replace("|", "\\|")
    printed, difference = row.get(field.printed), row.get(field.name)
    if printed is None:
        return ""
    return f"{printed:.12g}" if difference is None else f"{printed:.12g} ({signed(difference)})"


def short(value, digits=STUDY.table_digits):
    """Text of a value with significant `digits`, without an exponent from 1e-4 to 1e8."""
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    if value == 0:
        return "0"
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e8:
        text = f"{float(text):.0f}" if abs(value) >= 1 else f"{float(text):f}"
    return text


def signed(value):
    """Text of a difference with its sign, two significant digits."""
    if value == 0:
        return "0"
    text = f"{value:+.2g}"
    return f"{float(text):+.0f}" if "e" in text and 1 <= abs(value) < 1e6 else text
