"""Where a command meets the world: errors become lines and exit codes, notes and tables go their ways."""

import os
import sys
from functools import wraps

import click

from cablestudy.errors import CablestudyError, SceneError

FAILED_CHECK, WRONG_USE, NO_ANSWER, INTERRUPTED = 1, 2, 3, 130


def edge(command):
    """Turn domain errors into lines on standard error and an exit code, here and nowhere else."""

    @wraps(command)
    def run(*arguments, **options):
        try:
            if sys.stdout is None:
                raise SceneError("standard output: closed")
            if hasattr(sys.stdout, "reconfigure"):  # a terminal may lack a letter of what is printed
                sys.stdout.reconfigure(errors="backslashreplace")
            command(*arguments, **options)
            sys.stdout.flush()
        except SceneError as error:
            for mistake in error.mistakes:
                click.echo(str(mistake), err=True)
            sys.exit(error.exit_code)
        except CablestudyError as error:
            where = f"{options['scene']}: " if "scene" in options else ""
            click.echo(where + " ".join(str(error).split()), err=True)
            sys.exit(error.exit_code)
        except BrokenPipeError:  # the reader has had enough, `| head` for example
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(0)
        except OSError as error:  # a full disk: what is still in the buffer must not fail again at exit
            click.echo(f"{error.filename or 'standard output'}: {error.strerror or error}", err=True)
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(WRONG_USE)

    return run


def say(lines, quiet=False):
    """Notes on standard error."""
    for line in () if quiet else lines:
        click.echo(line, err=True)


def show(table, style):
    """The table on standard output, and nothing else."""
    sys.stdout.writelines(table.pieces(style))
