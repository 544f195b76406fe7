"""The commands for one scene: static, modes, windrms."""

import click

from cablestudy.cli.cases import ALL
from cablestudy.cli.error_handling import FAILED_CHECK, echo_notes, finish
from cablestudy.cli.options import check_picture, scene_command
from cablestudy.errors import SceneError, refuse_options

TABLES = ("bodies", "points", "cables", "stiffness", "links")
LOADS = "loads"  # the table of both kinds of scene
WIND_TABLES = ("motion", "rotations", "open_loop", "cables", "actuators", "links", "loop", "coordinates")


def read(scene, sets, case):
    """The scene in one of its load cases, or as it is for `--case all`."""
    from cablestudy.interface import read

    return read(scene, sets, None if case == ALL else case)


def compute(scene, case, what, **options):
    """Answer of a command for a scene, or for all its load cases: `Answer`."""
    return (scene.compute_cases if case == ALL else scene.compute)(what, **options)


@scene_command
@click.option("--shape", is_flag=True, help="The coordinates along the cables instead.")
@click.option(
    "--table",
    "name",
    type=click.Choice((*TABLES, LOADS)),
    help="Each point load on a cable (loads); of a suspension: only this table.",
)
@click.option("--locus", metavar="LOAD[:COUNT]", help="The path of a load that travels, e.g. load1, CABLE.load1:99.")
@click.option("--limits", is_flag=True, help="The limits of the scene instead, each in the load case that governs.")
@click.option("--form-finding", "form", is_flag=True, help="Of a suspension: the form by force densities instead.")
def static(scene, sets, case, shape, limits, name, locus, form, style, plot, explain, quiet):
    """Tension, sag, end stiffness and more of one scene; of a suspension bodies, points, cables and stiffness."""
    what, options = "static", {"estimate": explain or style == "json"}
    if case == ALL:
        refuse_options(
            {"--shape": shape, "--locus": locus, "--form-finding": form}, f"--case {ALL} has one row for each case"
        )
    if limits:
        others = {"--case": case, "--shape": shape, "--table": name, "--locus": locus, "--form-finding": form}
        refuse_options(others | {"--explain": explain}, "--limits has each limit in the load cases that the scene says")
        found = read(scene, sets, None).compute("limits")
        code = finish(scene, found, style, plot, quiet=quiet)
        return code or FAILED_CHECK * any(row["status"] != "ok" for row in found.table.rows)
    if shape:
        refuse_options({"--table": name, "--locus": locus, "--form-finding": form}, "--shape has the coordinates alone")
        what = "shape"
    elif locus is not None:
        refuse_options({"--table": name, "--form-finding": form, "--explain": explain}, "--locus has the path alone")
        what, options = "locus", {"load": locus}
    elif form:
        refuse_options({"--plot": plot, "--explain": explain}, "--form-finding is no equilibrium of cables with weight")
        what, options = "form", {"table": name}
    elif name == LOADS:
        what = "loads"
    else:
        options["table"] = name
    return finish(scene, compute(read(scene, sets, case), case, what, **options), style, plot, explain, quiet)


@scene_command
@click.option("-n", "count", type=click.IntRange(1, 100_000), help="How many, from the lowest. Default: 12.")
@click.option("--upto", metavar="FREQ", help="All up to a frequency instead, e.g. 20 Hz.")
@click.option("--cable", metavar="NAME", help="Of a suspension: modes of this cable, its ends held.")
@click.option("--animate", metavar="FILE", help="Draw the modes in motion too: .gif, or .html of one file.")
def modes(scene, sets, case, count, upto, cable, animate, style, plot, explain, quiet):
    """Frequencies, kinds and participation factors of the cable with fixed ends; of a suspension its coupled modes."""
    if count is not None and upto is not None:
        raise SceneError("-n and --upto exclude each other")
    if case == ALL:
        refuse_options({"--plot": plot, "--animate": animate}, f"--case {ALL} has the modes of each case")
    check_picture(animate, "--animate", (".gif", ".html"))
    options = {"count": count, "upto": upto, "cable": cable, "estimate": explain}
    answer = compute(read(scene, sets, case), case, "modes", **options)
    code = finish(scene, answer, style, plot, explain, quiet)
    if animate:
        answer.save_animation(animate)
        echo_notes([f"written: {animate}"], quiet)
    return code


@scene_command
@click.option(
    "--on",
    type=click.Choice(["gondola", "cable", "both"]),
    help="What the wind acts on. Default: gondola, or a cable without one. Of a suspension it is the key wind.on.",
)
@click.option("--table", "name", type=click.Choice(WIND_TABLES), help="Of a suspension: only this table.")
def windrms(scene, sets, case, style, plot, on, name, explain, quiet):
    """RMS of the gondola in the wind, with and without the winch loop; loop margins. Without a gondola, of the cable;
    of a suspension, of its bodies, markers, cables and actuators."""
    if case == ALL:
        refuse_options({"--plot": plot}, f"--case {ALL} has one row for each case")
    options = {"on": on, "table": name, "estimate": explain or style == "json"}
    return finish(scene, compute(read(scene, sets, case), case, "windrms", **options), style, plot, explain, quiet)
