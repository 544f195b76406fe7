"""Arguments and options that commands share, and checks of options before anything is computed."""

import itertools
from functools import wraps

import click

from cablestudy.cli.error_handling import announced, handle_errors
from cablestudy.cli.tables import format_options
from cablestudy.errors import SceneError, check_output

PICTURES = (".png", ".svg", ".pdf")
ALL = "all"  # load cases, in one table


def complete_column(context, parameter, incomplete):
    """Shell completion of column names; of suspensions those of the whole, others begin with a name of the scene."""
    from cablestudy.interface.files import column_names

    return [name for name in column_names() if name.startswith(incomplete)]


PATH = click.Path(readable=False)  # completed by shells, and checked by the reader
SCENE = click.argument("scene", metavar="SCENE", type=PATH)
SET = click.option(
    "--set", "sets", multiple=True, metavar="KEY=VALUE", help="Change one key, e.g. cable.diameter=3.7mm. Repeatable."
)
VARY = click.option(
    "--vary",
    multiple=True,
    metavar="KEY=VALUES",
    help="One more dimension, e.g. cable.preload=100N:2kN:20log or gondola.mass=10kg,50kg. Repeatable.",
)
FORMAT = format_options
QUIET = click.option("--quiet", is_flag=True, help="Nothing on standard error but errors.")
JOBS = click.option("--jobs", type=click.IntRange(1, 1024), help="Processes. Default: as many as the work is worth.")
EXPLAIN = click.option("--explain", is_flag=True, help="Say on standard error what was modelled, and how well.")
PLOT = click.option("--plot", metavar="FILE", help="Draw a picture too: .png, .svg or .pdf.")
CASE_HELP = "One of the load cases of the scene"
CASE = click.option("--case", metavar="NAME", help=f"{CASE_HELP}, or all.")
ONE_CASE = click.option("--case", metavar="NAME", help=f"{CASE_HELP}.")
STUDY = click.argument("study", metavar="STUDY", type=PATH)
OUT = click.option("--out", default="results", metavar="DIR", help="Where the files of NAME go. Default: results.")


SELECTION_OPTIONS = (
    click.option("--where", metavar="CONDITION", help="Show only such rows, e.g. 'gondola_rms < 1 mm and sag < 0.5'."),
    click.option(
        "--sort",
        metavar="COLUMN",
        shell_complete=complete_column,
        help="Show the rows in this order; -COLUMN: largest first.",
    ),
    click.option("--best", metavar="'min COLUMN'", help="Show the best row only: 'min COLUMN' or 'max COLUMN'."),
    click.option(
        "--pareto",
        metavar="'min A, max B'",
        help="Show only the rows that no other beats in all of these columns: 'min COLUMN, max COLUMN, ...'.",
    ),
    click.option("--sensitivity", is_flag=True, help="Show Sobol's indices of the columns instead of the rows."),
)
SELECTION = ("--where", "--sort", "--best", "--pareto")


def selection_options(function):
    """Decorator: the options that choose rows of a study."""
    for option in reversed(SELECTION_OPTIONS):
        function = option(function)
    return function


class OneValueEach(click.Command):
    """A command that refuses an empty option, and one given twice unless it is repeatable.

    So no value is dropped without a word.
    """

    def parse_args(self, ctx, args):
        values, _, given = self.make_parser(ctx).parse_args(args=list(args))
        for option in given if not ctx.resilient_parsing else ():
            is_option = option.param_type_name == "option"
            value = values.get(option.name)
            texts = value if isinstance(value, list) else [value]
            if is_option and any(isinstance(text, str) and not text.strip() for text in texts):
                ctx.fail(f"{option.opts[0]} is empty")
            repeatable = option.param_type_name == "argument" or option.is_flag or option.multiple
            if given.count(option) > 1 and not repeatable:
                ctx.fail(f"{option.opts[0]} is given twice, and takes one value")
        return super().parse_args(ctx, args)


def one_case(name, reason):
    """Refuse `--case all` in a command that takes one case, for this reason."""
    if name == ALL:
        raise SceneError(f"--case {ALL}: {reason}")


def plain_command(function):
    """Decorator that makes a function, with its options, a command; its errors are lines on standard error."""
    return click.command(cls=OneValueEach)(handle_errors(function))


def _with_shared(*shared):
    """Decorator that makes a function a command; `shared` are its argument and options that other commands have too."""

    def decorate(function):
        run = announced(function) if SCENE in shared else function  # a study shows its rows itself

        @wraps(function)
        def check_and_run(*, plot, **parameters):
            check_output("--plot", plot, PICTURES, "picture")
            return run(plot=plot, **parameters)

        for option in reversed(shared):
            check_and_run = option(check_and_run)
        return plain_command(check_and_run)

    return decorate


scene_command = _with_shared(SCENE, SET, CASE, FORMAT, PLOT, EXPLAIN, QUIET)
study_command = _with_shared(STUDY, SET, VARY, OUT, FORMAT, PLOT, QUIET)


def exclude(parameters, pairs):
    """Refuse options that exclude each other.

    `parameters` are all of a command, as click names them; `pairs` have two tuples of options each, and none of the
    first may be given with one of the second.
    """
    given = {f"--{name.replace('_', '-')}" for name, value in parameters.items() if value not in (None, False)}
    messages = {}  # two options -> message, each pair once
    for option, other in itertools.chain(*(itertools.product(*pair) for pair in pairs)):
        if {option, other} <= given:
            messages.setdefault(frozenset((option, other)), f"{option} and {other} exclude each other")
    if messages:
        raise SceneError(*messages.values())
