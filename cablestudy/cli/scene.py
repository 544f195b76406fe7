"""The commands for one scene: static, modes, windrms, loop, ssm, report, find, trade."""

import click

from cablestudy.cli.error_handling import FAILED_CHECK, NO_ANSWER, announced, echo_notes, finish, interruptible
from cablestudy.cli.options import (
    ALL,
    CASE,
    FORMAT,
    JOBS,
    ONE_CASE,
    PATH,
    QUIET,
    SCENE,
    SET,
    VARY,
    complete_column,
    exclude,
    one_case,
    plain_command,
    scene_command,
)
from cablestudy.cli.tables import COLUMNS, check_columns, check_one_table, split_names
from cablestudy.errors import SceneError, check_output, refuse_options

TABLES = ("bodies", "points", "cables", "stiffness", "links")
LOADS = "loads"  # the table of both kinds of scene
WIND_TABLES = ("motion", "rotations", "open_loop", "cables", "actuators", "links", "loop", "coordinates")
LOOP_TABLES = ("loop", "coordinates")


def read(scene, sets, case):
    """The scene in one of its load cases, or as it is for `--case all`."""
    from cablestudy.interface import read

    return read(scene, sets, None if case == ALL else case)


def compute(scene, case, command, style=None, **options):
    """Answer of a command for a scene, or for all its load cases: `Answer`; its tables are to be shown in a `Style`."""
    if style is not None:
        table = options.get("table")
        if table is None:
            check_one_table(scene.table_names(command), style)
        elif empty := scene.table_without_rows(command, table, case == ALL):
            check_columns(empty, style)
    return (scene.compute_cases if case == ALL else scene.compute)(command, **options)


@scene_command
@click.option("--shape", is_flag=True, help="The coordinates along the cables instead.")
@click.option(
    "--table",
    "name",
    type=click.Choice((*TABLES, LOADS)),
    help="loads: each point load on a cable; for suspensions: show only this table.",
)
@click.option("--locus", metavar="LOAD[:COUNT]", help="The path of a load that travels, e.g. load1, CABLE.load1:99.")
@click.option("--limits", is_flag=True, help="The limits of the scene instead, each in the load case that governs.")
@click.option("--form-finding", "form", is_flag=True, help="Suspensions only: the form by force densities instead.")
def static(scene, sets, case, shape, limits, name, locus, form, style, plot, explain, quiet):
    """Tension, sag, end stiffness and more of one scene; of a suspension bodies, points, cables and stiffness."""
    given = {"--shape": shape, "--limits": limits, "--table": name, "--locus": locus, "--form-finding": form}
    check_options_of_static(given | {"--case": case, "--plot": plot, "--explain": explain})
    if limits:
        answer = read(scene, sets, None).compute("limits")
        code = finish(scene, answer, style, plot, quiet=quiet)
        return code or FAILED_CHECK * any(row["status"] != "ok" for row in answer.table.rows)
    estimate = {"estimate": explain or style == "json"}
    if shape:
        command, options = "shape", estimate
    elif locus is not None:
        command, options = "locus", {"load": locus}
    elif form:
        command, options = "form", {"table": name}
    elif name == LOADS:
        command, options = "loads", estimate
    else:
        command, options = "static", estimate | {"table": name}
    return finish(scene, compute(read(scene, sets, case), case, command, style, **options), style, plot, explain, quiet)


def check_options_of_static(given):
    """Refuse options of the command `static` that have no effect together with others: SceneError.

    `given` is a dict of the name of each option -> its value; None, or False, where it is not given.
    """

    def refuse(names, reason):
        refuse_options({name: given[name] for name in names.split()}, reason)

    if given["--case"] == ALL:
        refuse("--shape --locus --form-finding", f"--case {ALL} has one row for each case")
    if given["--limits"]:
        others = "--case --shape --table --locus --form-finding --explain"
        refuse(others, "--limits has each limit in the load cases that the scene says")
    elif given["--shape"]:
        refuse("--table --locus --form-finding", "--shape has the coordinates alone")
    elif given["--locus"] is not None:
        refuse("--table --form-finding --explain", "--locus has the path alone")
    elif given["--form-finding"]:
        refuse("--plot --explain", "--form-finding is no equilibrium of cables with weight")


@scene_command
@click.option("-n", "count", type=click.IntRange(1, 100_000), help="Number of modes, from the lowest. Default: 12.")
@click.option("--upto", metavar="FREQ", help="All up to a frequency instead, e.g. 20 Hz.")
@click.option("--cable", metavar="NAME", help="Modes of this cable with fixed ends.")
@click.option("--coupled", is_flag=True, help="One cable only: modes as of a suspension, coupled with its gondola.")
@click.option("--animate", metavar="FILE", help="Draw the modes in motion too: .gif, or .html of one file.")
def modes(scene, sets, case, count, upto, cable, coupled, animate, style, plot, explain, quiet):
    """Frequencies, kinds and participation factors of the cable with fixed ends; of a suspension its coupled modes."""
    if count is not None and upto is not None:
        raise SceneError("-n and --upto exclude each other")
    if case == ALL:
        refuse_options({"--plot": plot, "--animate": animate}, f"--case {ALL} has the modes of each case")
    check_output("--animate", animate, (".gif", ".html"), "picture")
    options = {"count": count, "upto": upto, "cable": cable, "coupled": coupled, "estimate": explain}
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
    help="What the wind acts on. Default: gondola, or a cable without one. For suspensions see the key wind.on.",
)
@click.option("--table", "name", type=click.Choice(WIND_TABLES), help="Suspensions only: show only this table.")
def windrms(scene, sets, case, style, plot, on, name, explain, quiet):
    """RMS of the gondola in the wind, with and without the winch loop; loop margins. Without a gondola, of the cable;
    of a suspension, of its bodies, markers, cables and actuators."""
    if case == ALL:
        refuse_options({"--plot": plot}, f"--case {ALL} has one row for each case")
    options = {"on": on, "table": name, "estimate": explain or style == "json"}
    return finish(
        scene, compute(read(scene, sets, case), case, "windrms", style, **options), style, plot, explain, quiet
    )


@plain_command
@click.argument("path", metavar="SCENE|STUDY", type=PATH)
@SET
@VARY
@CASE
@click.option("--out", metavar="FILE.html", help="Where the page goes. Default: NAME.html in this folder.")
@click.option("--title", metavar="TEXT", help="Heading of the page. Default: the title of the study, or NAME.")
@COLUMNS
@click.option("--where", metavar="CONDITION", help="Studies only: show only such rows, e.g. 'sag < 0.5 m'.")
@JOBS
@QUIET
def report(path, sets, vary, case, out, title, columns, where, jobs, quiet):
    """A scene or a study as one page of HTML: what was given, results, pictures, errors, provenance."""
    from cablestudy.pages.report import write_report

    with interruptible(lambda: ["interrupted: nothing is written"]):
        words = click.get_current_context().obj["words"]
        written = write_report(path, out, sets, vary, case, title, jobs, words, quiet, columns or (), where)
    echo_notes(written.warnings, quiet)
    for reason in written.failures:
        click.echo(f"{path}: {reason}", err=True)
    echo_notes([f"written: {written.path}"], quiet)
    return NO_ANSWER if written.failures else 0


@plain_command
@SCENE
@click.argument("goal", metavar="'COLUMN = VALUE'|limits", shell_complete=complete_column)
@click.option("--by", required=True, metavar="KEY", help="The key that is solved for, e.g. cable.preload.")
@click.option(
    "--between",
    metavar="LOW:HIGH",
    help="Range of the key, e.g. 100N:10kN. Default: about its value in the scene, growing to all that it allows.",
)
@SET
@ONE_CASE
@FORMAT
@click.option("--columns", "names", metavar="A,B,...", help="Further columns. Default: tensions, sag and length.")
@QUIET
@announced
def find(scene, goal, by, between, names, sets, case, style, quiet):
    """The value of a key for which a column takes a value: one row for each solution. With `limits` the range in which
    all limits of the scene hold, in all of their load cases: one row for each end, with what governs there."""
    from cablestudy.interface import compute_find

    if goal.strip() == "limits":
        refuse_options({"--case": case}, "limits say themselves in which load cases they hold")
    one_case(case, "a search takes one case: give --case NAME")
    answer = compute_find(scene, sets, case, goal=goal, by=by, between=between, columns=names)
    return finish(scene, answer, style, quiet=quiet)


@scene_command
@click.option(
    "--columns",
    "names",
    metavar="A,B,...",
    help="What to compare. Default: stiffness, frequencies; also wind of a gondola, and tension of a suspension.",
)
@click.option("--repeats", type=click.IntRange(1, 1000), default=5, help="Repeats of each timing. Default: 5.")
@click.option("--out", metavar="DIR", help="Write trade-SCENE.csv and trade-SCENE.md there.")
def trade(scene, sets, case, names, repeats, out, style, plot, explain, quiet):
    """Error against time for every model that a user can choose, from closed form to high order."""
    one_case(case, "models are compared for one case: give --case NAME")
    answer = read(scene, sets, case).compute("trade", columns=names, repeats=repeats, out=out, shown=style == "md")
    return finish(scene, answer, style, plot, explain, quiet)


@scene_command
@click.option(
    "--response", "span", metavar="FROM:TO:COUNT",
    help="Loop gain, sensitivity and complementary sensitivity over frequency, e.g. 0.01Hz:100Hz:200; resonances have "
    "rows of their own.",
)  # fmt: skip
@click.option("--time", "duration", metavar="DURATION[:COUNT]", help="Response in time instead, e.g. 60s or 60s:2001.")
@click.option(
    "--input", "input_", metavar="NAME",
    help="With --time: a step of the winch (the default) or of the reference, a gust, or a step of the wind speed: "
    "winch, reference, gust, wind. For suspensions winch.CABLE and reference.x.",
)  # fmt: skip
@click.option("--output", metavar="NAME", help="With --time: coordinate of the body, e.g. gondola.x.")
@click.option(
    "--size", metavar="SIZE", help="Size of the input. Default: 1 mm, or 3 standard deviations of the turbulence."
)
@click.option(
    "--length", metavar="TIME", help="Duration of a gust. Default: length scale of the turbulence over wind speed."
)
@click.option("--table", "name", type=click.Choice(LOOP_TABLES), help="Suspensions only: show only this table.")
def loop(scene, sets, case, span, duration, input_, output, size, length, name, style, plot, explain, quiet):
    """The winch loop: margins, sensitivity, bandwidth; over frequency; in time."""
    exclude({"response": span, "time": duration}, [(("--response",), ("--time",))])
    timed = {"input": input_, "output": output, "size": size, "length": length}
    if duration is None:
        refuse_options({f"--{option}": value for option, value in timed.items()}, "for --time only")
    if span or duration:
        refuse_options({"--table": name}, "--response and --time have one table")
    one_case(case, "a loop is that of one case: give --case NAME")
    options = {"response": span, "time": duration} | (timed if duration else {})
    options |= {"estimate": explain or style == "json", "table": name}
    answer = compute(read(scene, sets, case), case, "loop", None if span or duration else style, **options)
    return finish(scene, answer, style, plot, explain, quiet)


def joined(context, parameter, texts):
    """Callback of click: the names of an option that may be given several times, separated by commas; None without."""
    return ",".join(name for text in texts for name in split_names(context, parameter, text)) or None


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
    help="On end 2: gondola, or winch loop. For suspensions: winch loop, or actuators only.",
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
    help="With --response and --error (default: end_2_x, or the first); with --out: the only inputs. Repeatable, "
    "or A,B.",
)  # fmt: skip
@click.option(
    "--output", metavar="NAMES", multiple=True, callback=joined,
    help="Likewise: forces of the cable, e.g. end_2_x, or other outputs.",
)  # fmt: skip
@click.option(
    "--proper", is_flag=True,
    help="With --out: accelerations as inputs, positions and velocities as states, so that D1 and D2 are zero.",
)  # fmt: skip
def ssm(scene, sets, case, out, count, upto, error, kinds, no_residual, attached, wind, span, input_, output, proper,
        style, plot, explain, quiet):  # fmt: skip
    """A cable or a suspension as a state space: file, kept modes, frequency response."""
    one_case(case, "a state space is that of one case: give --case NAME")
    if out and not span:
        refuse_options({"--columns": style.columns, "--top": style.top}, "--out writes a file; --response has a table")
    loaded_scene = read(scene, sets, case)
    options = {
        "count": count, "upto": upto, "error": error, "kinds": kinds, "residual": not no_residual,
        "attached": attached, "wind": wind, "input": input_, "output": output, "proper": proper,
    }  # fmt: skip
    if plot and not span and attached != "loop":
        raise SceneError("--plot: needs --response, which it draws")
    refuse_options({"--proper": proper and not out}, "it changes the file of --out")
    return finish(scene, loaded_scene.compute("ssm", out=out, response=span, **options), style, plot, explain, quiet)
