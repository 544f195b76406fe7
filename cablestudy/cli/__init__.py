"""The command line: parse, call, print, exit code.

The commands are those of `help.GROUPS`.
"""

import os
import sys

import click

from cablestudy.cli.error_handling import WRONG_USE, exit_interrupted
from cablestudy.cli.help import Grouped
from cablestudy.cli.tables import discard_output
from cablestudy.threads import VARIABLES
from cablestudy.version import __version__


class OneLine(Grouped):
    """A group of commands whose usage errors are one line each, like all other errors."""

    def main(self, *arguments, standalone_mode=True, **options):
        """Run the command line, with the arguments of `click.Group.main`, and end the program with its exit code."""
        words = arguments[0] if arguments else options.get("args")
        options["obj"] = {"words": list(sys.argv[1:] if words is None else words)}  # for messages that repeat them
        if not standalone_mode:
            return super().main(*arguments, standalone_mode=False, **options)
        try:
            sys.exit(super().main(*arguments, standalone_mode=False, **options) or 0)
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            code = WRONG_USE
        except click.UsageError as error:
            # click names no command where the last option lacks its value
            named = [word for word in options["obj"]["words"][:1] if word in self.commands]
            command = error.ctx.command_path if error.ctx else " ".join(["cablestudy", *named])
            message = " ".join(error.format_message().split()).rstrip(".")
            message = message.replace("not a valid integer range", "not a whole number")
            click.echo(f"{command}: {message} ('{command} --help' shows how)", err=True)
            code = WRONG_USE
        except click.Abort:
            click.echo("interrupted", err=True)
            exit_interrupted()
        except OSError as error:  # the disk is full, for example, or the directory was removed
            nameless = "the current directory" if isinstance(error, FileNotFoundError) else "standard output"
            click.echo(f"{error.filename or nameless}: {error.strerror or error}", err=True)
            discard_output()
            code = WRONG_USE
        sys.exit(code)

    def invoke(self, ctx):
        """Run a command; click would print an empty line for Ctrl-C, and take an EOFError for one."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise click.Abort from None
        except EOFError as error:  # of a compiled module that is cut short, for example
            raise RuntimeError("a file ends too early") from error


@click.group(cls=OneLine, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="cablestudy")
def main():
    """Suspended cables: form, tensions, stiffness, modes, winch control and wind.

    `cablestudy new guy` writes a commented scene to begin with; each command shows examples with --help.

    SCENE and STUDY are YAML files, or - for standard input. Tables go to standard output, everything else to standard
    error. Exit codes: 0 done, 1 a check failed, 2 wrong usage, file or value, 3 some case has no answer.
    """
    for name in VARIABLES:  # see `threads`: before numpy is imported that needs no library
        os.environ.setdefault(name, "1")
    os.environ.pop("MPLBACKEND", None)  # of windows, and pictures are files: an unknown one would end matplotlib
