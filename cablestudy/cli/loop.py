"""The commands loop and ssm: the linear model with its winches."""

import click

from cablestudy.cli.error_handling import finish
from cablestudy.cli.options import exclude, one_case, scene_command
from cablestudy.errors import SceneError, refuse_options

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
    options = {"response": span, "time": duration} | (timed if duration else {})
    options |= {"estimate": explain or style == "json", "table": name}
    answer = read(scene, sets, case).compute("loop", **options)
    return finish(scene, answer, style, plot, explain, quiet)


def joined(context, parameter, texts):
    """The names of an option that is given several times, separated by commas; None without it."""
    return ",".join(texts) or None


@scene_command
@click.option("--out", metavar="FILE", help="Write the state space: .npz, .mat or .json.")
@click.option("--modes", "count", type=click.IntRange(min=1), metavar="N", help="Keep so many, from the lowest.")
@click.option("--upto", metavar="FREQ", help="Keep all up to a frequency instead, e.g. 20 Hz.")
@click.option("--error", type=float, metavar="E", help="Keep the fewest that leave out this share of the inertia.")
@click.option("--kinds", metavar="KINDS", help="Keep only these: inplane,axial,outofplane.")
@click.option("--no-residual", is_flag=True, help="Drop the static part of omitted modes too, as the paper does.")
@click.option(
    "--with",
    "attached",
    type=click.Choice(["gondola", "loop", "actuators"]),
    help="On end 2: gondola, or winch loop. Of a suspension: winch loop, or actuators only.",
)
@click.option("--wind", is_flag=True, help="Forces on the nodes of cables as inputs too.")
@click.option(
    "--response",
    "span",
    metavar="FROM:TO:COUNT",
    help="Frequency response, e.g. 0.01Hz:100Hz:2000; resonances have rows of their own.",
)
@click.option(
    "--input", "input_", metavar="NAMES", multiple=True, callback=joined,
    help="Of --response and --error (default: end_2_x, or the first); of --out: the only inputs. Repeatable, or A,B.",
)  # fmt: skip
@click.option(
    "--output", metavar="NAMES", multiple=True, callback=joined,
    help="The same: forces of the cable, as end_2_x, or other outputs.",
)  # fmt: skip
@click.option(
    "--proper", is_flag=True,
    help="Of --out: accelerations as inputs, positions and velocities as states, so that D1 and D2 are zero.",
)  # fmt: skip
def ssm(scene, sets, case, out, count, upto, error, kinds, no_residual, attached, wind, span, input_, output, proper,
        style, plot, explain, quiet):  # fmt: skip
    """A cable or a suspension as a state space: file, kept modes, frequency response."""
    from cablestudy.interface import read

    one_case(case, "a state space is that of one case: give --case NAME")
    loaded_scene = read(scene, sets, case)
    options = {
        "count": count, "upto": upto, "error": error, "kinds": kinds, "residual": not no_residual,
        "attached": attached, "wind": wind, "input": input_, "output": output, "proper": proper,
    }  # fmt: skip
    if plot and not span and attached != "loop":
        raise SceneError("--plot: needs --response, which it draws")
    refuse_options({"--proper": proper and not out}, "it changes the file of --out")
    return finish(scene, loaded_scene.compute("ssm", out=out, response=span, **options), style, plot, explain, quiet)
