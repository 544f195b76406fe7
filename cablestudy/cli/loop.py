"""The command loop."""

import click

from cablestudy.cli.cases import with_case
from cablestudy.cli.error_handling import echo_notes, show
from cablestudy.cli.options import exclude, refuse, save_plot, scene_command
from cablestudy.cli.scene import report_row

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
    """The winch loop: margins, sensitivity, bandwidth; over frequency; in time.

    Example: cablestudy loop configs/carlina.yaml --plot loop.png
    """
    exclude({"response": span, "time": duration}, [(("--response",), ("--time",))])
    if duration is None:
        refuse({"--input": input_, "--size": size, "--length": length}, "for --time only")
    from cablestudy.scene.scene import load_scene
    from cablestudy.study import loop_in_time, loop_report
    from cablestudy.study.notes import reference_without_loads
    from cablestudy.study.ssm import read_span

    span = read_span(span) if span else None
    asked = loop_in_time.TimeOptions(duration, input_ or "winch", size, length) if duration else None
    sets = with_case(sets, case, "a loop is that of one case: give --case NAME")
    document, model = load_scene(scene, sets)
    table, row = loop_report.loop_table(document, model, explain or style == "json")
    code = report_row(scene, row, explain, quiet, None, None, reference_without_loads(model))
    if asked:
        solved = loop_in_time.time_case(document, row.case, asked)
        echo_notes(solved.notes, quiet)
        save_plot(plot, lambda plots: plots.loop_in_time(solved, row.case))
        table = loop_in_time.time_table(solved)
    else:
        save_plot(plot, lambda plots: plots.loop_margins(row.case, span))
        table = loop_report.response_table(row.case.loop, span) if span else table
    show(table, style)
    return code
