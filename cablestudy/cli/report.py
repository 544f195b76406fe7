"""The command report."""

import click

from cablestudy.cli.cases import CASE
from cablestudy.cli.error_handling import NO_ANSWER, echo_notes, handle_errors, interruptible
from cablestudy.cli.options import JOBS, PATH, QUIET, SET, VARY


@click.command()
@click.argument("path", metavar="SCENE|STUDY", type=PATH)
@SET
@VARY
@CASE
@click.option("--out", metavar="FILE.html", help="Where the page goes. Default: NAME.html in this folder.")
@click.option("--title", metavar="TEXT", help="Heading of the page. Default: the title of the study, or NAME.")
@JOBS
@QUIET
@handle_errors
def report(path, sets, vary, case, out, title, jobs, quiet):
    """A scene or a study as one page of HTML: what was given, results, pictures, errors, provenance."""
    from cablestudy.pages.report import write_report

    with interruptible(lambda: ["interrupted: nothing is written"]):
        words = click.get_current_context().obj["words"]
        found = write_report(path, out, sets, vary, case, title, jobs, words, quiet)
    echo_notes(found.warnings, quiet)
    for reason in found.failures:
        click.echo(f"{path}: {reason}", err=True)
    echo_notes([f"written: {found.path}"], quiet)
    return NO_ANSWER if found.failures else 0
