"""The results of one cable, as sections of a page: statics, load cases, modes, loop, wind."""

from cablestudy.scene.scene import each_case
from cablestudy.study import case_modes
from cablestudy.study.case import Case
from cablestudy.study.case_tables import joined
from cablestudy.study.columns import COLUMNS, STATUS, lacks
from cablestudy.study.notes import reference_without_loads
from cablestudy.study.report import mode_table, static_table
from cablestudy.study.row import evaluate
from cablestudy.study.table import Table
from cablestudy.study.wind_report import wind_table

MODES = 12
LOOP = ("gain_margin", "phase_margin", "bandwidth", "largest_gain", "gondola_damping_ratio")
KEY_FIGURES = (
    "max_tension", "utilisation", "sag", "clearance", "end_stiffness", "cable_frequency", "gondola_frequency",
    "gondola_rms", "midspan_rms", "gain_margin",
)  # fmt: skip


def key_figures(page, scene):
    """The numbers that a reader looks for first: `Table` of one row."""
    by_name = {column.name: column for column in COLUMNS}
    columns = [by_name[name] for name in KEY_FIGURES if name in by_name and not lacks(scene, by_name[name])]
    has_gondola = scene.gondola is not None
    columns = [c for c in columns if not (has_gondola and c.name == "midspan_rms")]
    row = evaluate(scene, columns, estimate=True)
    page.warn((*row.warnings, *reference_without_loads(scene)))
    return Table((*(column.field for column in columns), STATUS), [row.cells], single=True, errors=row.known_errors)


def sections(page, document, scene):
    """Append the results of a scene to a page.

    Parameters
    ----------
    page : Page
    document : Document
    scene : Scene
    """
    with page.section("Statics"):
        _statics(page, scene)
    if scene.cases and scene.case is None:
        with page.section("Load cases"):
            _load_cases(page, document, scene)
    elif not scene.cases:
        page.left_out.append("Load cases: the scene has none (key cases)")
    with page.section("Modes"):
        _modes(page, scene)
    if scene.winch is not None and scene.winch.controller is not None:
        with page.section("Loop"):
            _loop(page, scene)
    else:
        page.left_out.append("Loop: the scene has no winch with a controller (key winch.controller)")
    if scene.wind is not None:
        with page.section("Wind"):
            _wind(page, document, scene)
    else:
        page.left_out.append("Wind: the scene has none (key wind)")


def _row(page, title, row):
    """Keep what a row says of itself; whether it has an answer."""
    page.note(title, row.notes)
    page.warn(row.warnings)
    if row.failed:
        page.fail(title, row.cells["status"])
    return not row.failed


def _statics(page, scene):
    table, row = static_table(scene, estimate=True)
    answered = _row(page, "Statics", row)
    page.table(table, f"Statics{_of_case(scene)}")
    if answered:
        page.draw(lambda plots: plots.static_form(row.case), f"Static form{_of_case(scene)}")


def _of_case(scene):
    if scene.case is not None:
        return f", load case {scene.case}"
    return ", without a load case" if scene.cases else ""


def _load_cases(page, document, scene):
    tables, solved = {}, {}
    for name, _, of_case in each_case(document, scene):
        tables[name], row = static_table(of_case, estimate=True)
        if _row(page, f"Load case {name}", row):
            solved[name] = row.case
    page.table(joined(tables), "Statics in each load case")
    if solved:
        page.draw(lambda plots: plots.case_forms(solved), "Static forms in the load cases")


def _modes(page, scene):
    case, found, notes, warnings = case_modes.modes(Case(scene), MODES, estimate=True)
    page.note("Modes", notes)
    page.warn(warnings)
    page.table(mode_table(case, found), f"The {len(found)} lowest modes with fixed ends")
    page.draw(lambda plots: plots.mode_shapes(case, found), "Shapes of the lowest modes")


def _loop(page, scene):
    by_name = {column.name: column for column in COLUMNS}
    columns = [by_name[name] for name in LOOP if not lacks(scene, by_name[name])]
    row = evaluate(scene, columns, estimate=True)
    _row(page, "Loop", row)
    fields = (*(column.field for column in columns), STATUS)
    page.table(Table(fields, [row.cells], single=True, errors=row.known_errors), "Winch loop")


def _wind(page, document, scene):
    table, row, remarks = wind_table(document, scene, estimate=True)
    answered = _row(page, "Wind", row)
    page.note("Wind", (line.removeprefix("note: ") for line in remarks))
    page.table(table, "Gondola in the wind" if scene.gondola is not None else "Cable in the wind")
    if answered and scene.gondola is not None:
        page.draw(lambda plots: plots.wind_response(row.case, "gondola"), "Spectra and variance in the wind")
