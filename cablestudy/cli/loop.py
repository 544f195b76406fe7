"""The command loop."""

import click

from cablestudy.cli.cases import with_case
from cablestudy.cli.error_handling import echo_notes, show
from cablestudy.cli.options import exclude, refuse, save_plot, scene_command
from cablestudy.cli.scene import check_one_table, report_row, show_tables

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
    """The winch loop: margins, sensitivity, bandwidth; over frequency; in time.

    Example: cablestudy loop configs/carlina.yaml --plot loop.png
    """
    exclude({"response": span, "time": duration}, [(("--response",), ("--time",))])
    if duration is None:
        timed = {"--input": input_, "--output": output, "--size": size, "--length": length}
        refuse(timed, "for --time only")
    from cablestudy.scene.scene import load_scene
    from cablestudy.scene.suspension import SuspensionScene
    from cablestudy.study.loop_in_time import TimeOptions
    from cablestudy.study.notes import reference_without_loads
    from cablestudy.study.ssm import read_span

    span = read_span(span) if span else None
    asked = TimeOptions(duration, input_, size, length, output) if duration else None
    sets = with_case(sets, case, "a loop is that of one case: give --case NAME")
    document, model = load_scene(scene, sets, suspensions=True)
    if isinstance(model, SuspensionScene):
        _of_suspension(document, model, span, asked, name, style, plot, explain, quiet)
        return 0
    refuse({"--table": name}, "the scene has one cable")
    from cablestudy.study import loop_report

    table, row = loop_report.loop_table(document, model, explain or style == "json")
    code = report_row(scene, row, explain, quiet, None, None, reference_without_loads(model))
    if asked:
        table = _in_time(asked, document, row.case, plot, quiet)
    else:
        save_plot(plot, lambda plots: plots.loop_margins(row.case, span))
        table = loop_report.response_table(row.case.loop, span) if span else table
    show(table, style)
    return code


def _in_time(asked, document, case, plot, quiet, of_suspension=False):
    """The table of a response in time, its notes printed and its picture drawn."""
    from cablestudy.study import loop_in_time

    if of_suspension:
        from cablestudy.study.suspension.loop_report import time_case
    else:
        time_case = loop_in_time.time_case
    solved = time_case(document, case, asked)
    echo_notes(solved.notes, quiet)
    save_plot(plot, lambda plots: plots.loop_in_time(solved))
    return loop_in_time.time_table(solved)


def _of_suspension(document, scene, span, asked, name, style, plot, explain, quiet):
    """Print the tables of the loop of a suspension, or what it does over frequency or in time."""
    refuse({"--table": name if span or asked else None}, "--response and --time have one table")
    from cablestudy.study.suspension import loop_report
    from cablestudy.study.suspension.case import SuspensionCase
    from cablestudy.study.suspension.notes import notes_of, strength_warning

    loop_report.check_control(document, scene)
    if not (span or asked):
        check_one_table(name, style, TABLES)
    case = SuspensionCase(scene, estimate=explain or style == "json")
    movement = case.in_wind.movement
    echo_notes((*(notes_of(case) if explain else ()), *strength_warning(case)), quiet)
    if asked:
        show(_in_time(asked, document, case, plot, quiet, of_suspension=True), style)
        return
    save_plot(plot, lambda plots: plots.suspension_loop(movement))
    if span:
        show(loop_report.response_table(movement, span), style)
    else:
        show_tables(loop_report.loop_tables(case, name), name, style)
