"""Tables on standard output: the options --format, --columns, --top and --digits, and the width of a terminal."""

import os
import shutil
import sys
from contextlib import contextmanager
from dataclasses import replace
from functools import wraps
from importlib.util import find_spec
from math import isfinite

import click

from cablestudy.errors import Mistakes, NoSolutionError, SceneError

STYLES = ("md", "csv", "json", "jsonl", "parquet")
ONE_TABLE = ("csv", "jsonl", "parquet")  # those that hold one table


class Style(str):
    """The format of a table, one of STYLES, which carries the part of the table that is shown."""

    def __new__(cls, style, columns, top, digits):
        text = super().__new__(cls, style)
        text.columns = tuple(columns)  # names with or without units; empty for all columns
        text.top = top  # how many rows are shown; None for all
        text.digits = digits  # significant ones of numbers in Markdown; None for the usual ones
        return text

    def of(self, table):
        """The part of a `Table` that is shown, with its digits."""
        table = table.chosen(self.columns_of(table), self.top)
        return table if self.digits is None else replace(table, digits=self.digits)

    def columns_of(self, table):
        """`columns`; none for a table of names and their status alone, as for load cases that all have no answer."""
        return self.columns if any(not (field.label or field.kept) for field in table.fields) else ()


def split_names(context, parameter, text):
    """Callback of click: the names in a text, separated by commas, each once; None without the option."""
    if text is None:
        return None
    from cablestudy.interface.kinds import names_in

    try:
        return names_in(text)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


def _check_style(context, parameter, style):
    """Callback of click: the format itself; one that cannot be written here is refused."""
    if style == "parquet" and find_spec("pyarrow") is None:
        raise click.BadParameter("pyarrow is not installed (pip install 'cablestudy[parquet]')")
    if style == "parquet" and sys.stdout.isatty():
        raise click.BadParameter("parquet is not for a terminal: add > FILE.parquet")
    if style in ("json", "jsonl"):
        write_utf8()
    return style


def write_utf8():
    """Write JSON into files and pipes, which is UTF-8 whatever encoding the locale has."""
    if hasattr(sys.stdout, "reconfigure") and not sys.stdout.isatty():
        sys.stdout.reconfigure(encoding="utf-8")


FORMAT = click.option(
    "--format", "style", type=click.Choice(STYLES), default="md", callback=_check_style, help="Default: md."
)
COLUMNS = click.option(
    "--columns", metavar="A,B,...", callback=split_names, help="Show only these columns, in this order."
)
DIGITS = click.option(
    "--digits", type=click.IntRange(1, 17), metavar="N", help="Significant digits of Markdown. Default: 4."
)
TOP = click.option("--top", type=click.IntRange(min=1), metavar="N", help="Show only the first N rows.")


def format_options(command):
    """Decorator: --format, --top, --digits and, unless the command has its own, --columns, together as `style`."""
    own_options = [name for option in getattr(command, "__click_params__", ()) for name in option.opts]

    @wraps(command)
    def styled(*arguments, style, top, digits, columns=None, **parameters):
        if digits is not None and style != "md":
            raise click.BadParameter(f"no effect: {style} has all digits", param_hint="'--digits'")
        return command(*arguments, style=Style(style, columns or (), top, digits), **parameters)

    for option in (DIGITS, TOP, *(() if "--columns" in own_options else (COLUMNS,)), FORMAT):
        styled = option(styled)
    return styled


@contextmanager
def while_it_is_read():
    """Write standard output in the block, and drop what is left where its reader has closed the pipe, as `| head` does.

    The command goes on behind the block: its exit code is that of a command whose output is read to the end.
    """
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        discard_output()


def discard_output():
    """Redirect standard output to the null device, so that flushing its buffer at exit does not fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def show(table, style):
    """Print a table on standard output in the format of a `Style`; Markdown on a terminal is fitted to its width.

    NoSolutionError if a cell is not finite; rows that are computed only as they are printed are not checked.
    """
    for row in table.rows if isinstance(table.rows, list) else ():
        for name, value in row.items():
            if isinstance(value, float) and not isfinite(value):
                raise NoSolutionError(f"{name} is not a finite number")
    check_columns(table, style)
    table = style.of(table)
    with while_it_is_read():
        if style == "md" and sys.stdout.isatty():
            _show_fitted(table)
        elif style == "parquet":
            from cablestudy.interface.files import write_parquet

            write_parquet(table, sys.stdout.buffer)
        else:
            sys.stdout.writelines(table.pieces(style))


def check_columns(table, style):
    """Refuse the columns of a `Style` that a table does not have, each in a line: SceneError."""
    with Mistakes() as mistakes:
        for name in style.columns_of(table):
            with mistakes.at():
                _check_column(table, name)


def _check_column(table, name):
    """Refuse a column that a table does not have, and say so where it is one of other tables."""
    try:
        table.field(name)
    except SceneError:
        from cablestudy.interface.files import is_column

        if not is_column(name):
            raise
        hint = "it is a column of another command, or of a study; 'cablestudy columns' lists all"
        raise SceneError(f"--columns: the table has no column {name!r} ({hint})") from None


def check_one_table(names, style):
    """Raise SceneError where several tables, of these names, are to be shown in a `Style` that takes one of them."""
    option = f"--format {style}" if style in ONE_TABLE else "--columns" if style.columns else ""
    if names and option:
        raise SceneError(f"{option}: one table at a time: give --table {', '.join(names)}")


def show_tables(answer, style):
    """Print the tables of a suspension: as Markdown one below the other, else as one object."""
    answer = replace(answer, tables={name: style.of(table) for name, table in answer.tables.items()})
    if style == "md" and sys.stdout.isatty():
        filled = {name: table for name, table in answer.tables.items() if table.rows}
        for index, (name, table) in enumerate(filled.items()):
            click.echo(f"{'' if index == 0 else chr(10)}## {name}\n")
            _show_fitted(table)
    else:
        with while_it_is_read():
            click.echo(answer.render(style), nl=False)


def _show_fitted(table):
    """Print a table as wide as the terminal, and a note on the columns that are left out."""
    from cablestudy.interface.files import fitted

    width = shutil.get_terminal_size().columns
    text, left_out = fitted(table, width)
    sys.stdout.write(text)
    sys.stdout.flush()
    context = click.get_current_context(silent=True)
    if left_out and not (context and context.params.get("quiet")):
        names = ", ".join(left_out)
        click.echo(f"wider than this terminal, left out: {names} (--columns A,B,... chooses)", err=True)
