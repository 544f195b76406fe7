"""The command trade."""

import click

from cablestudy.cli.cases import one_case
from cablestudy.cli.error_handling import finish
from cablestudy.cli.options import scene_command


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
    from cablestudy.interface import read

    one_case(case, "models are compared for one case: give --case NAME")
    found = read(scene, sets, case).compute("trade", columns=names, repeats=repeats, out=out, shown=style == "md")
    return finish(scene, found, style, plot, explain, quiet)
