"""The commands for one scene: static, modes, windrms."""

import click

from cablestudy.cli.cases import ALL, every_case, with_case
from cablestudy.cli.error_handling import NO_ANSWER, echo_notes, show
from cablestudy.cli.options import refuse, save_plot, scene_command
from cablestudy.errors import SceneError

TABLES = ("bodies", "points", "cables", "stiffness")
WIND_TABLES = ("motion", "rotations", "open_loop", "cables", "actuators", "loop", "coordinates")
FORM_TABLES = ("points", "cables")


@scene_command
@click.option("--shape", is_flag=True, help="The coordinates along the cable instead.")
@click.option("--table", "name", type=click.Choice(TABLES), help="Of a suspension: only this table.")
@click.option("--form-finding", "form", is_flag=True, help="Of a suspension: the form by force densities instead.")
def static(scene, sets, case, shape, name, form, style, plot, explain, quiet):
    """Tension, sag, end stiffness and more of one scene; of a suspension bodies, points, cables and stiffness."""
    from cablestudy.scene.scene import load_scene
    from cablestudy.scene.suspension import SuspensionScene
    from cablestudy.study import report
    from cablestudy.study.notes import reference_without_loads

    def row_of(_, model, where, plot=None):
        echo_notes(reference_without_loads(model), quiet)
        table, row = report.static_table(model, explain or style == "json")
        code = report_row(where, row, explain, quiet, plot, lambda plots: plots.static_form(row.case))
        return table, code, row

    if case == ALL:
        refuse({"--shape": shape}, f"--case {ALL} has one row for each case")
        solved = {}

        def row_of_case(document, model, where):
            table, code, row = row_of(document, model, where)
            if not row.failed:
                solved[model.case] = row.case
            return table, code

        code = every_case(scene, sets, style, row_of_case)
        if solved:
            save_plot(plot, lambda plots: plots.case_forms(solved))
        return code
    document, model = load_scene(scene, with_case(sets, case), suspensions=True)
    if isinstance(model, SuspensionScene):
        refuse({"--shape": shape}, "the scene is a suspension")
        if form:
            refuse({"--plot": plot, "--explain": explain}, "--form-finding is no equilibrium of cables with weight")
            _form(model, name, style)
        else:
            _suspension_tables(model, name, style, plot, explain, quiet)
        return 0
    refuse({"--table": name, "--form-finding": form}, "the scene has one cable")
    table, code, row = row_of(document, model, scene, plot)
    if not shape:
        show(table, style)
    elif not row.failed:
        show(report.shape_table(row.case), style)
    return code


def _suspension_tables(scene, name, style, plot, explain, quiet):
    """Print one table of a suspension, or all of them."""
    check_one_table(name, style, TABLES)
    from cablestudy.study.suspension.case import SuspensionCase
    from cablestudy.study.suspension.notes import notes_of, strength_warning
    from cablestudy.study.suspension.report import static_tables

    case = SuspensionCase(scene)
    tables = static_tables(case, name)
    echo_notes((*(notes_of(case) if explain else ()), *strength_warning(case)), quiet)
    save_plot(plot, lambda plots: plots.suspension_views(case))
    show_tables(tables, name, style)


def _form(scene, name, style):
    """Print the form of a net by force densities."""
    check_one_table(name, style, FORM_TABLES)
    if name not in (None, *FORM_TABLES):
        raise SceneError(f"--table {name}: --form-finding has the tables {', '.join(FORM_TABLES)}")
    from cablestudy.study.suspension.report import form_tables

    show_tables(form_tables(scene), name, style)


def check_one_table(name, style, tables):
    """Refuse a format that holds one table only, without the name of one."""
    if name is None and style in ("csv", "jsonl"):
        raise SceneError(f"--format {style}: one table at a time: give --table {', '.join(tables)}")


def show_tables(tables, name, style):
    """Print the table of a name, or all."""
    from cablestudy.study.suspension.report import all_tables

    if name:
        show(tables[name], style)
    else:
        click.echo(all_tables(tables, style), nl=False)


@scene_command
@click.option("-n", "count", type=click.IntRange(1, 100_000), help="How many, from the lowest. Default: 12.")
@click.option("--upto", metavar="FREQ", help="All up to a frequency instead, e.g. 20 Hz.")
def modes(scene, sets, case, count, upto, style, plot, explain, quiet):
    """Frequencies, kinds and participation factors of the cable with fixed ends; of a suspension its coupled modes."""
    if count is not None and upto is not None:
        raise SceneError("-n and --upto exclude each other")
    from cablestudy.scene.scene import load_scene
    from cablestudy.scene.suspension import SuspensionScene
    from cablestudy.scene.units import read_frequency
    from cablestudy.study import case_modes, report
    from cablestudy.study.case import Case
    from cablestudy.study.notes import reference_without_loads

    limit = None if upto is None else read_frequency("--upto", upto)

    def table_of(_, model, where, plot=None):
        solved, found, notes, warnings = case_modes.modes(Case(model), count or 12, limit, estimate=explain)
        lines = [*(notes if explain else ()), *reference_without_loads(model), *warnings]
        if limit is None and len(found) < (count or 12):
            lines.append(f"the model has {len(found)} modes, not {count or 12}")
        echo_notes([line if where == scene else f"{where}: {line}" for line in lines], quiet)
        save_plot(plot, lambda plots: plots.mode_shapes(solved, found))
        return report.mode_table(solved, found), 0

    if case == ALL:
        refuse({"--plot": plot}, f"--case {ALL} has the modes of each case")
        return every_case(scene, sets, style, table_of)
    document, model = load_scene(scene, with_case(sets, case), suspensions=True)
    if isinstance(model, SuspensionScene):
        _suspension_modes(model, count or 12, limit, style, plot, explain, quiet)
    else:
        show(table_of(document, model, scene, plot)[0], style)
    return 0


def _suspension_modes(scene, count, limit, style, plot, explain, quiet):
    """Print the coupled modes of a suspension, so many or all up to a frequency."""
    from cablestudy.study.suspension.case import SuspensionCase
    from cablestudy.study.suspension.notes import notes_of, strength_warning
    from cablestudy.study.suspension.report import mode_notes, mode_table

    case = SuspensionCase(scene)
    found = case.modes(count) if limit is None else case.modes_up_to(limit)
    asked = range(len(found)) if limit is None else found.up_to(limit)
    notes = (*notes_of(case), *mode_notes(case, found, len(asked))) if explain else ()
    echo_notes((*notes, *strength_warning(case)), quiet)
    if limit is None and len(found) < count:
        echo_notes([f"the model has {len(found)} modes, not {count}"], quiet)
    save_plot(plot, lambda plots: plots.suspension_modes(case, found, len(asked)))
    show(mode_table(case, found, asked), style)


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
    from cablestudy.scene.scene import load_scene
    from cablestudy.scene.suspension import SuspensionScene
    from cablestudy.study.notes import reference_without_loads
    from cablestudy.study.wind_report import wind_table

    def row_of(document, model, where, plot=None):
        table, row, remarks = wind_table(document, model, on, estimate=explain or style == "json")
        remarks = (*reference_without_loads(model), *remarks)

        def draw(plots):
            return plots.wind_response(row.case, on or "gondola")

        return table, report_row(where, row, explain, quiet, plot, draw, remarks)

    if case == ALL:
        refuse({"--plot": plot}, f"--case {ALL} has one row for each case")
        return every_case(scene, sets, style, row_of)
    document, model = load_scene(scene, with_case(sets, case), suspensions=True)
    if isinstance(model, SuspensionScene):
        refuse({"--on": on}, "the scene is a suspension, whose key wind.on says so")
        _suspension_wind(document, model, name, style, plot, explain, quiet)
        return 0
    refuse({"--table": name}, "the scene has one cable")
    if model.gondola is None:
        refuse({"--plot": plot}, "the scene has no gondola")
    table, code = row_of(document, model, scene, plot)
    show(table, style)
    return code


def _suspension_wind(document, scene, name, style, plot, explain, quiet):
    """Print one table of a suspension in the wind, or all of them."""
    check_one_table(name, style, WIND_TABLES)
    from cablestudy.study.suspension.case import SuspensionCase
    from cablestudy.study.suspension.notes import notes_of
    from cablestudy.study.suspension.wind_report import remarks_of, wind_tables

    case = SuspensionCase(scene, estimate=explain or style == "json")
    tables = wind_tables(document, case, name)
    echo_notes([*(notes_of(case) if explain else ()), *remarks_of(case)], quiet)
    save_plot(plot, lambda plots: plots.suspension_wind(case))
    show_tables(tables, name, style)


def report_row(scene, row, explain, quiet, plot, draw, remarks=()):
    """Print the notes on a row, and draw it or print why it has no answer; the exit code."""
    echo_notes((*(row.notes if explain else ()), *row.warnings, *remarks), quiet)
    if row.failed:
        click.echo(f"{scene}: {row.cells['status']}", err=True)
        return NO_ANSWER
    save_plot(plot, draw)
    return 0
