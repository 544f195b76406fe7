"""The command loop."""

import click

from cablestudy.cli.cases import one_case
from cablestudy.cli.error_handling import finish
from cablestudy.cli.options import exclude, refuse, scene_command

INPUTS = ("winch", "reference", "gust", "wind")


@scene_command
@click.option(
    "--response", "span", metavar="FROM:TO:COUNT",
    help="Loop gain, sensitivity and complementary sensitivity over frequency, e.g. 0.01Hz:100Hz:200; resonances have "
    "rows of their own.",
)  # fmt: skip
@click.option("--time", "duration", metavar="DURATION[:COUNT]", help="Response in time instead, e.g. 60s or 60s:2001.")
@click.option(
    "--input", "input_", type=click.Choice(INPUTS),
    help="Of --time: a step of the winch (default), of the reference, a gust, or a step of the wind speed.",
)  # fmt: skip
@click.option("--size", metavar="SIZE", help="Of the input. Default: 1 mm, or 3 standard deviations of the turbulence.")
@click.option("--length", metavar="TIME", help="Of a gust. Default: length scale of the turbulence over wind speed.")
def loop(scene, sets, case, span, duration, input_, size, length, style, plot, explain, quiet):
    """The winch loop: margins, sensitivity, bandwidth; over frequency; in time."""
    from cablestudy.interface import load

    exclude({"response": span, "time": duration}, [(("--response",), ("--time",))])
    if duration is None:
        refuse({"--input": input_, "--size": size, "--length": length}, "for --time only")
    one_case(case, "a loop is that of one case: give --case NAME")
    options = {"input": input_ or "winch", "size": size, "length": length} if duration else {}
    found = load(scene, sets, case).compute(
        "loop", response=span, time=duration, estimate=explain or style == "json", **options
    )
    return finish(scene, found, style, plot, explain, quiet)
