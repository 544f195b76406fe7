"""The command trade."""

import sys

import click

from cablestudy.cli.cases import with_case
from cablestudy.cli.error_handling import NO_ANSWER, echo_notes, show
from cablestudy.cli.options import save_plot, scene_command


@scene_command
@click.option(
    "--columns",
    "names",
    metavar="A,B,...",
    help="What to compare. Default: stiffness, frequencies; also wind of a gondola, and tension of a suspension.",
)
@click.option("--repeats", type=click.IntRange(1, 1000), default=5, help="Of each timing. Default: 5.")
@click.option("--out", metavar="DIR", help="Write trade-SCENE.csv and trade-SCENE.md there.")
def trade(scene, sets, case, names, repeats, out, style, plot, explain, quiet):
    """Error against time for every model that a user can choose, from closed form to high order."""
    import shlex

    from cablestudy.scene.scene import load_scene
    from cablestudy.study import trade as study
    from cablestudy.study.table import TableFiles

    sets = with_case(sets, case, "models are compared for one case: give --case NAME")
    document, model = load_scene(scene, sets, suspensions=True)
    columns, notes = study.columns_to_compare(document, model, names)
    place = None if out is None else TableFiles(out, study.file_name(scene))
    if place:
        place.check_writable()
    echo_notes(notes, quiet)
    if sys.stderr.isatty() and not quiet:
        with click.progressbar(
            length=(repeats + 1) * len(study.models_of(model, columns)), label="models", file=sys.stderr
        ) as bar:
            found = study.compare(model, columns, repeats, progress=bar.update)
    else:
        found = study.compare(model, columns, repeats)
    echo_notes([*(study.notes_of(found) if explain else ()), *found.reference.warnings], quiet)
    title = shlex.join([scene, *(word for change in sets for word in ("--set", change))])
    for name, reason in found.reference.failures.items():
        click.echo(f"{scene}: {name}: {reason}", err=True)
    save_plot(plot, lambda plots: plots.trade_plot(found, f"Error against time: {title}"))
    if place:
        study.write(found, place, title)
        echo_notes([f"written: {place.csv}, {place.md}"], quiet)
    show(study.table_of(found, shown=style == "md"), style)
    return NO_ANSWER if found.reference.failures else 0
