"""The command find."""

import click

from cablestudy.cli.cases import ONE_CASE, one_case
from cablestudy.cli.error_handling import announced, finish, handle_errors
from cablestudy.cli.options import FORMAT, QUIET, SCENE, SET, complete_column
from cablestudy.errors import refuse_options


@click.command()
@SCENE
@click.argument("goal", metavar="'COLUMN = VALUE'|limits", shell_complete=complete_column)
@click.option("--by", required=True, metavar="KEY", help="The key that is solved for, e.g. cable.preload.")
@click.option(
    "--between",
    metavar="LOW:HIGH",
    help="Range of the key, e.g. 100N:10kN. Default: about its value in the scene, growing to all that it allows.",
)
@SET
@ONE_CASE
@FORMAT
@click.option("--columns", "names", metavar="A,B,...", help="Columns beside it. Default: tensions, sag and length.")
@QUIET
@handle_errors
@announced
def find(scene, goal, by, between, names, sets, case, style, quiet):
    """The value of a key for which a column takes a value: one row for each that there is. With `limits` the range in
    which all limits of the scene hold, in all of their load cases: one row for each end, with what governs there."""
    from cablestudy.interface import compute_find

    if goal.strip() == "limits":
        refuse_options({"--case": case}, "limits say themselves in which load cases they hold")
    one_case(case, "a search takes one case: give --case NAME")
    found = compute_find(scene, sets, case, goal=goal, by=by, between=between, columns=names)
    return finish(scene, found, style, quiet=quiet)
