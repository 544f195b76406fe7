"""The command ssm."""

import click

from cablestudy.cli.cases import one_case
from cablestudy.cli.error_handling import finish
from cablestudy.cli.options import refuse, scene_command
from cablestudy.errors import SceneError


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
    read_scene = read(scene, sets, case)
    options = {
        "count": count, "upto": upto, "error": error, "kinds": kinds, "residual": not no_residual,
        "attached": attached, "wind": wind, "input": input_, "output": output, "proper": proper,
    }  # fmt: skip
    check(options, read_scene.is_suspension, bool(span), plot, out)
    return finish(scene, read_scene.compute("ssm", out=out, response=span, **options), style, plot, explain, quiet)


# input and output of the response of one cable with a gondola
SHOWN = {"gondola": ("winch", "gondola_position"), "loop": ("force_gondola", "gondola_position")}


def check(options, several, responds, plot, out):
    """Refuse options that have no effect, or that need others.

    Parameters
    ----------
    options : dict
        Name -> value, as of the state space.
    several : bool
        Whether the scene is a suspension.
    responds : bool
        Whether a response is asked for.
    plot, out : str or None
    """
    attached = options["attached"]
    if plot and not responds and not (several and attached == "loop"):
        raise SceneError("--plot: needs --response, which it draws")
    if several:
        refuse({"--with gondola": attached == "gondola"}, "the bodies of a suspension are always attached")
        kinds = "in a coupled mode cables and bodies move in several planes: it is of no kind"
        refuse({"--kinds": options["kinds"]}, kinds)
        shapes = "actuators and loop act on static shapes beside the modes that are kept"
        refuse({"--no-residual": attached and not options["residual"]}, shapes)
        lowest = "with actuators or loop the lowest modes are kept, see --modes and --upto"
        refuse({"--error": options["error"] if attached else None}, lowest)
    else:
        refuse({"--with actuators": attached == "actuators"}, "the scene has one cable")
    refuse({"--proper": options["proper"] and not out}, "it changes the file of --out")
    if not out and options["error"] is None and (not responds or (attached and not several)):
        refuse_channel(options, responds)


def refuse_channel(options, responds):
    """Refuse an input or output that is not what the response of a gondola shows; without a response, any."""
    attached, shown = options["attached"], (None, None)
    use = "for --response, --error and --out only"
    if responds:
        shown = SHOWN[attached]
        use = f"--with {attached} shows the response from {shown[0]} to {shown[1]}"
    named = zip(("input", "output"), shown, strict=True)
    refuse({f"--{name}": options[name] if options[name] != default else None for name, default in named}, use)
