"""The commands for one scene: static, modes, windrms."""

import click

from cablestudy.cli.cases import ALL
from cablestudy.cli.error_handling import finish
from cablestudy.cli.options import refuse, scene_command
from cablestudy.errors import SceneError

TABLES = ("bodies", "points", "cables", "stiffness")
WIND_TABLES = ("motion", "rotations", "open_loop", "cables", "actuators", "loop", "coordinates")
FORM_TABLES = ("points", "cables")


def read(scene, sets, case):
    """The scene in one of its load cases, or as it is for `--case all`."""
    from cablestudy.interface import read

    return read(scene, sets, None if case == ALL else case)


def compute(scene, case, what, **options):
    """What a command computes of a scene, or of all its load cases: Answer."""
    return (scene.compute_cases if case == ALL else scene.compute)(what, **options)


@scene_command
@click.option("--shape", is_flag=True, help="The coordinates along the cables instead.")
@click.option("--table", "name", type=click.Choice(TABLES), help="Of a suspension: only this table.")
@click.option("--form-finding", "form", is_flag=True, help="Of a suspension: the form by force densities instead.")
def static(scene, sets, case, shape, name, form, style, plot, explain, quiet):
    """Tension, sag, end stiffness and more of one scene; of a suspension bodies, points, cables and stiffness."""
    if case == ALL:
        refuse({"--shape": shape}, f"--case {ALL} has one row for each case")
    read_scene = read(scene, sets, case)
    what, options = "shape" if shape else "static", {"estimate": explain or style == "json"}
    if read_scene.is_suspension:
        if case == ALL:
            refuse({"--plot": plot, "--form-finding": form}, "of a suspension it is that of one case")
        if shape:
            refuse({"--table": name, "--form-finding": form}, "--shape has the coordinates alone")
        else:
            check_one_table(name, style, FORM_TABLES if form else TABLES)
            options["table"] = name
        if form:
            refuse({"--plot": plot, "--explain": explain}, "--form-finding is no equilibrium of cables with weight")
            what, options = "form", {"table": name}
    else:
        refuse({"--table": name, "--form-finding": form}, "the scene has one cable")
    return finish(scene, compute(read_scene, case, what, **options), style, plot, explain, quiet)


def check_one_table(name, style, tables):
    """Refuse a table that there is not, and a format that holds one table only without the name of one."""
    if name is None and style in ("csv", "jsonl", "parquet"):
        raise SceneError(f"--format {style}: one table at a time: give --table {', '.join(tables)}")
    if name not in (None, *tables):
        raise SceneError(f"--table {name}: --form-finding has the tables {', '.join(tables)}")


@scene_command
@click.option("-n", "count", type=click.IntRange(1, 100_000), help="How many, from the lowest. Default: 12.")
@click.option("--upto", metavar="FREQ", help="All up to a frequency instead, e.g. 20 Hz.")
@click.option("--cable", metavar="NAME", help="Of a suspension: modes of this cable, its ends held.")
def modes(scene, sets, case, count, upto, cable, style, plot, explain, quiet):
    """Frequencies, kinds and participation factors of the cable with fixed ends; of a suspension its coupled modes."""
    if count is not None and upto is not None:
        raise SceneError("-n and --upto exclude each other")
    if case == ALL:
        refuse({"--plot": plot}, f"--case {ALL} has the modes of each case")
    read_scene, options = read(scene, sets, case), {"count": count, "upto": upto, "estimate": explain}
    if read_scene.is_suspension:
        options["cable"] = cable
    else:
        refuse({"--cable": cable}, "the scene has one cable")
    return finish(scene, compute(read_scene, case, "modes", **options), style, plot, explain, quiet)


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
        refuse({"--plot": plot}, f"--case {ALL} has one row for each case")
    read_scene, options = read(scene, sets, case), {"estimate": explain or style == "json"}
    if read_scene.is_suspension:
        refuse({"--on": on}, "the scene is a suspension, whose key wind.on says so")
        check_one_table(name, style, WIND_TABLES)
        options["table"] = name
    else:
        refuse({"--table": name}, "the scene has one cable")
        options["on"] = on
    return finish(scene, compute(read_scene, case, "windrms", **options), style, plot, explain, quiet)
