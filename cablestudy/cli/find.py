"""The command find."""

import click

from cablestudy.cli.cases import CASE, with_case
from cablestudy.cli.error_handling import NO_ANSWER, echo_notes, handle_errors, show
from cablestudy.cli.options import FORMAT, QUIET, SCENE, SET, complete_column


@click.command()
@SCENE
@click.argument("goal", metavar="'COLUMN = VALUE'", shell_complete=complete_column)
@click.option("--by", required=True, metavar="KEY", help="The key that is solved for, e.g. cable.preload.")
@click.option(
    "--between",
    metavar="LOW:HIGH",
    help="Range of the key, e.g. 100N:10kN. Default: about its value in the scene, growing to all that it allows.",
)
@click.option("--columns", "names", metavar="A,B,...", help="Columns beside it. Default: tensions, sag and length.")
@SET
@CASE
@FORMAT
@QUIET
@handle_errors
def find(scene, goal, by, between, names, sets, case, style, quiet):
    """The value of a key for which a column takes a value: one row for each that there is."""
    from cablestudy.scene.document import apply_sets, read_document
    from cablestudy.study import find as study
    from cablestudy.study.goal import read_find, read_goal

    sets = with_case(sets, case, "a search takes one case: give --case NAME")
    document = apply_sets(read_document(scene), sets)
    asked = read_goal(*read_find(goal, by, between), document)
    columns = study.shown_columns(asked, document, names)
    found = study.solve(asked, document)
    table, rows = study.find_table(asked, found, columns)
    echo_notes(dict.fromkeys((*found.notes, *(warning for row in rows for warning in row.warnings))), quiet)
    if len(found.values) > 1:
        echo_notes([f"{len(found.values)} values of {by}"], quiet)
    show(table, style)
    return NO_ANSWER if any(row.failed for row in rows) else 0
