"""The command ssm."""

import click

from cablestudy.cli.error_handling import echo_notes, show
from cablestudy.cli.options import refuse, save_plot, scene_command
from cablestudy.errors import SceneError


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
@click.option("--input", "input_", metavar="NAME", help="For --response and --error. Default: end_2_x, or the first.")
@click.option("--output", metavar="NAME", help="A force of the cable, as end_2_x, or an output of a suspension.")
def ssm(scene, sets, out, count, upto, error, kinds, no_residual, attached, wind, span, input_, output,
        style, plot, explain, quiet):  # fmt: skip
    """A cable or a suspension as a state space: file, kept modes, frequency response."""
    if plot and not span:
        raise SceneError("--plot: needs --response, which it draws")
    if error is None and (attached or not span):
        use = "--with shows the response of the gondola" if span else "for --response and --error only"
        refuse({"--input": input_, "--output": output}, use)
    from cablestudy.scene.scene import load_scene
    from cablestudy.scene.suspension import SuspensionScene
    from cablestudy.study import ssm as study

    study.check_file(out)
    options = study.Options(count, upto, error, kinds, not no_residual, attached, wind, input_, output)
    span = study.read_span(span) if span else None
    document, model = load_scene(scene, sets, suspensions=True)
    if isinstance(model, SuspensionScene):
        single = {"--kinds": kinds, "--no-residual": no_residual, "--with": attached, "--wind": wind}
        refuse(single, "the scene is a suspension")
        from cablestudy.study.suspension import ssm as suspension

        choice, tables = suspension.choose(model, options, span and span[1]), suspension
    else:
        from cablestudy.study import ssm_tables as tables

        choice = study.choose(document, model, options)
    echo_notes(choice.notes if explain else (), quiet)
    echo_notes(choice.warnings, quiet)
    if out or not span:
        _write(choice, out, quiet)
    if span:
        _show_response(tables.curves(choice), span, style, plot)
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


def _show_response(curves, span, style, plot):
    """Print the frequency response and, where a file is given, draw it."""
    from cablestudy.study import ssm_tables as tables

    save_plot(plot, lambda plots: plots.bode(curves, *tables.drawn(span, curves)))
    show(tables.response_table(span, curves), style)
