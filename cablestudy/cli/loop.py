"""The command loop."""

import click

from cablestudy.cli.cases import one_case
from cablestudy.cli.error_handling import finish
from cablestudy.cli.options import exclude, scene_command
from cablestudy.errors import refuse_options

TABLES = ("loop", "coordinates")


@scene_command
@click.option(
    "--response", "span", metavar="FROM:TO:COUNT",
    help="Loop gain, sensitivity and complementary sensitivity over frequency, e.g. 0.01Hz:100Hz:200; resonances have "
    "rows of their own.",
)  # fmt: skip
@click.option("--time", "duration", metavar="DURATION[:COUNT]", help="Response in time instead, e.g. 60s or 60s:2001.")
@click.option(
    "--input", "input_", metavar="NAME",
    help="Of --time: a step of the winch (the default) or of the reference, a gust, or a step of the wind speed: "
    "winch, reference, gust, wind. Of a suspension winch.CABLE and reference.x.",
)  # fmt: skip
@click.option("--output", metavar="NAME", help="Of --time of a suspension: what of its pose, as gondola.x.")
@click.option("--size", metavar="SIZE", help="Of the input. Default: 1 mm, or 3 standard deviations of the turbulence.")
@click.option("--length", metavar="TIME", help="Of a gust. Default: length scale of the turbulence over wind speed.")
@click.option("--table", "name", type=click.Choice(TABLES), help="Of a suspension: only this table.")
def loop(scene, sets, case, span, duration, input_, output, size, length, name, style, plot, explain, quiet):
    """The winch loop: margins, sensitivity, bandwidth; over frequency; in time."""
    from cablestudy.interface import read

    exclude({"response": span, "time": duration}, [(("--response",), ("--time",))])
    timed = {"input": input_, "output": output, "size": size, "length": length}
    if duration is None:
        refuse_options({f"--{option}": value for option, value in timed.items()}, "for --time only")
    if span or duration:
        refuse_options({"--table": name}, "--response and --time have one table")
    one_case(case, "a loop is that of one case: give --case NAME")
    read_scene, options = read(scene, sets, case), {"response": span, "time": duration} | (timed if duration else {})
    found = read_scene.compute("loop", estimate=explain or style == "json", table=name, **options)
    return finish(scene, found, style, plot, explain, quiet)
