"""The command ssm."""

import click

from cablestudy.cli.error_handling import echo_notes, show
from cablestudy.cli.options import refuse, save_plot, scene_command
from cablestudy.errors import SceneError

ENDS = [f"end_{end}_{axis}" for end in (1, 2) for axis in "xyz"]


@scene_command
@click.option("--out", metavar="FILE", help="Write the state space: .npz, .mat or .json.")
@click.option("--modes", "count", type=click.IntRange(min=1), metavar="N", help="Keep so many, from the lowest.")
@click.option("--upto", metavar="FREQ", help="Keep all up to a frequency instead, e.g. 20 Hz.")
@click.option("--error", type=float, metavar="E", help="Keep the fewest that leave out this share of the inertia.")
@click.option("--kinds", metavar="KINDS", help="Keep only these: inplane,axial,outofplane.")
@click.option("--no-residual", is_flag=True, help="Drop the static part of omitted modes too, as the paper does.")
@click.option("--with", "attached", type=click.Choice(["gondola", "loop"]), help="On end 2: gondola, or winch loop.")
@click.option("--wind", is_flag=True, help="Forces on the cable's nodes as inputs too.")
@click.option("--response", "span", metavar="FROM:TO:COUNT", help="Frequency response, e.g. 0.01Hz:100Hz:2000.")
@click.option("--input", "displacement", type=click.Choice(ENDS), help="For --response and --error. Default: end_2_x.")
@click.option("--output", "force", type=click.Choice(ENDS), help="The force there. Default: end_2_x.")
def ssm(scene, sets, out, count, upto, error, kinds, no_residual, attached, wind, span, displacement, force,
        style, plot, explain, quiet):  # fmt: skip
    """The cable as a state space: file, kept modes, frequency response."""
    if plot and not span:
        raise SceneError("--plot: needs --response, which it draws")
    if error is None and (attached or not span):
        use = "--with shows the response of the gondola" if span else "for --response and --error only"
        refuse({"--input": displacement, "--output": force}, use)
    from cablestudy.scene.scene import load_scene
    from cablestudy.study import ssm as study
    from cablestudy.study import ssm_tables as tables

    study.check_file(out)
    ends = displacement or study.END, force or study.END
    options = study.Options(count, upto, error, kinds, not no_residual, attached, wind, *ends)
    span = study.read_span(span) if span else None
    document, model = load_scene(scene, sets)
    choice = study.choose(document, model, options)
    echo_notes(choice.notes if explain else (), quiet)
    echo_notes(choice.warnings, quiet)
    if out or not span:
        _write(choice, out, quiet)
    if span:
        _show_response(choice, span, style, plot)
    elif not out:
        show(tables.mode_table(choice), style)


def _write(choice, out, quiet):
    """Report the size of the state space and, where a file is given, write it."""
    from cablestudy.study import ssm as study

    system = choice.system()
    echo_notes([study.size_line(choice, system)], quiet)
    if out:
        study.write(system, out)
        echo_notes([f"written: {out}"], quiet)


def _show_response(choice, span, style, plot):
    """Print the frequency response and, where a file is given, draw it."""
    from cablestudy.study import ssm_tables as tables

    curves = tables.curves(choice)
    save_plot(plot, lambda plots: plots.bode(curves, *tables.drawn(span, curves)))
    show(tables.response_table(span, curves), style)
