"""The commands for one scene: static, modes, windrms."""

import click

from cablestudy.cli.error_handling import NO_ANSWER, echo_notes, show
from cablestudy.cli.options import save_plot, scene_command
from cablestudy.errors import SceneError


@scene_command
@click.option("--shape", is_flag=True, help="The coordinates along the cable instead.")
def static(scene, sets, shape, style, plot, explain, quiet):
    """Tension, sag, end stiffness and more of one scene."""
    from cablestudy.scene.scene import load_scene
    from cablestudy.study import report

    _, model = load_scene(scene, sets)
    table, row = report.static_table(model)
    code = report_row(scene, row, explain, quiet, plot, lambda plots: plots.static_form(row.case))
    if not shape:
        show(table, style)
    elif not row.failed:
        show(report.shape_table(row.case), style)
    return code


@scene_command
@click.option("-n", "count", type=click.IntRange(1, 100_000), help="How many, from the lowest. Default: 12.")
@click.option("--upto", metavar="FREQ", help="All up to a frequency instead, e.g. 20 Hz.")
def modes(scene, sets, count, upto, style, plot, explain, quiet):
    """Frequencies, kinds and participation factors of the cable with fixed ends."""
    if count is not None and upto is not None:
        raise SceneError("-n and --upto exclude each other")
    from cablestudy.scene.scene import load_scene
    from cablestudy.scene.units import read_frequency
    from cablestudy.study import case_modes, report
    from cablestudy.study.case import Case

    limit = None if upto is None else read_frequency("--upto", upto)
    _, model = load_scene(scene, sets)
    case, found, notes, warnings = case_modes.modes(Case(model), count or 12, limit, estimate=explain)
    echo_notes((*(notes if explain else ()), *warnings), quiet)
    if limit is None and len(found) < (count or 12):
        echo_notes([f"the model has {len(found)} modes, not {count or 12}"], quiet)
    save_plot(plot, lambda plots: plots.mode_shapes(case, found))
    show(report.mode_table(case, found), style)


@scene_command
@click.option(
    "--on",
    type=click.Choice(["gondola", "cable", "both"]),
    default="gondola",
    show_default=True,
    help="What the wind acts on.",
)
def windrms(scene, sets, style, plot, on, explain, quiet):
    """RMS of the gondola in the wind, with and without the winch loop; loop margins."""
    from cablestudy.scene.scene import load_scene
    from cablestudy.study.wind_report import wind_table

    document, model = load_scene(scene, sets)
    table, row, remarks = wind_table(document, model, on, estimate=explain or style == "json")
    code = report_row(scene, row, explain, quiet, plot, lambda plots: plots.wind_response(row.case, on), remarks)
    show(table, style)
    return code


def report_row(scene, row, explain, quiet, plot, draw, remarks=()):
    """Print the notes on a row, and draw it or print why it has no answer; the exit code."""
    echo_notes((*(row.notes if explain else ()), *row.warnings, *remarks), quiet)
    if row.failed:
        click.echo(f"{scene}: {row.cells['status']}", err=True)
        return NO_ANSWER
    save_plot(plot, draw)
    return 0
