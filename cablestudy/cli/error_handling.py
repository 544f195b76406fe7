"""Errors and signals become lines and exit codes; notes go to standard error and tables to standard output."""

import sys
from contextlib import contextmanager
from functools import wraps

import click

from cablestudy.activity import ActivityDisplay, end_display
from cablestudy.cli.tables import check_columns, check_one_table, show, show_tables, while_it_is_read
from cablestudy.errors import CablestudyError, ConvergenceError, NoSolutionError, SceneError, one_line, printable

FAILED_CHECK, WRONG_USE, NO_ANSWER, INTERRUPTED = 1, 2, 3, 130


def handle_errors(command):
    """Decorator of a command, which returns an exit code: prints the errors that it raises on standard error.

    The name of its `scene`, if it has one, is put before messages that name no file.
    """

    @wraps(command)
    def run(*arguments, **options):
        try:
            if sys.stdout is None:
                raise SceneError("standard output: closed")
            if hasattr(sys.stdout, "reconfigure"):  # the encoding of a terminal may lack characters of a table
                sys.stdout.reconfigure(errors="backslashreplace")
            code = 0
            with while_it_is_read():
                code = command(*arguments, **options)
            return code
        except SceneError as error:
            for mistake in error.mistakes:
                click.echo(str(mistake), err=True)
            return error.exit_code
        except CablestudyError as error:
            echo_notes(getattr(error, "__notes__", ()), options.get("quiet", False))
            where = f"{options['scene']}: " if "scene" in options else ""
            click.echo(printable(where + one_line(error)), err=True)
            return error.exit_code

    return run


def announced(command):
    """Show that a command with the option `quiet` is at work, where it takes long."""

    @wraps(command)
    def run(*arguments, quiet, **options):
        with ActivityDisplay(command.__name__, quiet):
            return command(*arguments, quiet=quiet, **options)

    return run


@contextmanager
def interruptible(explanation):
    """The first Ctrl-C or SIGTERM ends the block: prints the lines that `explanation` returns, and exits."""
    from cablestudy.interrupts import Interrupts

    try:
        with Interrupts():
            yield
    except KeyboardInterrupt:
        echo_notes(explanation())
        exit_interrupted()


def exit_interrupted():
    """End the program with the exit code of Ctrl-C."""
    exec("")  # python forgets that the signal came during an import: it would exit by it, and not with the code
    sys.exit(INTERRUPTED)


def echo_notes(lines, quiet=False):
    """Print notes on standard error, unless `quiet`."""
    for line in () if quiet else lines:
        click.echo(printable(line), err=True)


def finish(scene, answer, style, plot=None, explain=False, quiet=False):
    """Print the notes, failures and tables of an `Answer`, save its picture, and return the exit code of the command.

    Messages begin with the name of the scene. With `explain` they say what was modelled; if `quiet`, only failures and
    tables are printed. SceneError if an option has no effect on this answer; then nothing is written.
    """
    end_display()
    _check_effects(answer, style, plot)
    echo_notes((*(answer.explain() if explain else ()), *answer.warnings), quiet)
    if written := answer.write():
        echo_notes([f"written: {', '.join(written)}"], quiet)
    for failure in answer.failures:
        click.echo(printable(f"{scene}: {failure}"), err=True)
    code = NO_ANSWER if answer.failures else 0
    if plot and answer.draw:
        try:
            answer.save_figure(plot)
            echo_notes([f"written: {plot}"], quiet)
        except (ConvergenceError, NoSolutionError) as error:
            if (reason := one_line(error)) not in answer.failures:
                click.echo(printable(f"{scene}: {reason}"), err=True)
            code = NO_ANSWER
    if answer.table is not None:
        show(answer.table, style)
    elif answer.tables:
        show_tables(answer, style)
    return code


def _check_effects(answer, style, plot):
    """Refuse options that have no effect on an `Answer`, or that take one table where it has several: SceneError."""
    if style.top and answer.table is not None and answer.table.single:
        raise SceneError("--top: no effect: the table has one row (--columns A,B,... chooses what is shown of it)")
    if answer.table is not None:
        check_columns(answer.table, style)
    else:
        check_one_table(answer.tables, style)
    if plot and answer.draw is None and not answer.failures:
        raise SceneError("--plot: no effect: there is no picture of this")
