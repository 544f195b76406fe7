"""The results of a scene as sections of a page: statics, load cases, modes, loop, wind; see `interface.scene`."""

from dataclasses import replace
from difflib import get_close_matches

from cablestudy.errors import Mistakes
from cablestudy.interface.files import is_column
from cablestudy.interface.scene_commands import lines_with_cases
from cablestudy.study.column import attribute
from cablestudy.study.columns import find
from cablestudy.study.one_cable.wind_report import BELOW
from cablestudy.study.table import Field, Table, join_tables

CAPTIONS = {
    "limits": "Limits",
    "static": "Statics",
    "modes": "The lowest modes",
    "windrms": "In the wind",
    "bodies": "Bodies: places of the reference points, global axes",
    "points": "Free points: places, global axes",
    "stiffness": "Stiffness of each body at its reference point, all loads counted: forces [N] and moments [N m] for "
    "displacements [m] and rotations [rad]",
    "motion": "Bodies and markers in the wind",
    "rotations": "Rotations of the bodies in the wind",
    "open_loop": "Bodies and markers in the wind, the winches at rest",
    "actuators": "Actuators in the wind",
    "links": "Links",
    "loop": "Loop",
    "coordinates": "Measured coordinates of the loop",
}
LOADS = "Point loads{}; slope and tension on the sides of end 1 and end 2"
CABLES = {"static": "Cables", "windrms": "Tensions of the cables in the wind"}
PICTURES = {
    "static": "Static form",
    "modes": "Shapes of the lowest modes",
    "loop": "Loop gain, sensitivity and margins",
    "windrms": "Spectra and variance in the wind",
}
# what a reader looks for first: table of a suspension or "", column, name, and which of several rows
KEY_FIGURES = {
    "static": (
        ("", "max_tension_N", "largest tension", max), ("", "utilisation", "utilisation", max),
        ("", "sag_m", "sag", max), ("", "clearance_m", "clearance", min),
        ("cables", "max_tension_N", "largest tension", max), ("cables", "min_tension_N", "smallest tension", min),
        ("cables", "utilisation", "largest utilisation", max), ("cables", "clearance_m", "clearance", min),
    ),
    "modes": (("", "frequency_Hz", "lowest frequency", min),),
    "loop": tuple(
        (table, column, title, min)
        for table in ("", "loop")
        for column, title in (("gain_margin_dB", "gain margin"), ("phase_margin_deg", "phase margin"))
    ),
    "windrms": (
        ("", "gondola_frequency_Hz", "frequency of the gondola", max),
        ("", "gondola_rms_mm", "RMS of the gondola", max), ("", "midspan_rms_mm", "RMS at mid-span", max),
        ("motion", "rms_mm", "largest RMS in the wind", max),
    ),
}  # fmt: skip
# columns of tables of results that are none of a study, with their units and without
ONLY_IN_TABLES = (
    "case", "name", "load", "slope_1_deg", "slope_1", "slope_2_deg", "slope_2", "body", "row", "rx", "ry", "rz",
    "number", "type", "symmetry", "frequency_Hz", "frequency", "participation", "lock_in_speed_m_per_s",
    "lock_in_speed", "damping_ratio", "moves", "body_share", "coordinate", "notch_frequency_Hz", "notch_frequency",
    *(f"variance_share_below_{limit:g}_Hz" for limit in BELOW), "integration_error",
)  # fmt: skip
OF_EACH_CABLE = ("sag", "clearance")  # columns of cables that stand in a table of their own for all load cases
OF_CASES = (
    ("min_tension_N", "smallest tension", "N", min),
    ("max_tension_N", "largest tension", "N", max),
    ("utilisation", "largest utilisation", "", max),
)


def check_columns(names):
    """Refuse names that no table of results of a scene can have, each in a line: SceneError.

    Tables of the parts of a suspension name a column as a study does, without the part before it.
    """
    with Mistakes() as mistakes:
        for name in names:
            with mistakes.at("--columns"):
                _check_column(name)


def _check_column(name):
    """Raise ValueError for the name of a column that no table of results of a scene can have."""
    part, _, quantity = name.rpartition(".")
    if name in ONLY_IN_TABLES or (not part and (is_column(name) or is_column(f"part.{name}"))):
        return
    if is_column(name):
        raise ValueError(f"no table has a column {name!r} (give {quantity}: its table has a row for each part)")
    similar = get_close_matches(name, ONLY_IN_TABLES, 1, cutoff=0.75)
    if similar:
        raise ValueError(f"unknown column {name!r} (did you mean {similar[0]}?)")
    find(name)


def sections(page, scene):
    """Compute the results of a scene and append them to a page: statics, load cases, modes, loop and wind.

    Sections for which the scene lacks a key are left out, and listed as left out.
    """
    model, columns_of_loop = scene.model, {}  # columns of the loop are not shown in the wind again
    all_cases = bool(model.cases) and model.case is None
    with page.section("Statics"):
        _add_statics(page, scene, headed=not all_cases)
    if all_cases:
        with page.section("Load cases"):
            _add_load_cases(page, scene)
    elif not model.cases:
        page.left_out.append("load cases: the scene has none (key cases)")
    with page.section("Modes"):
        _add_answer(page, scene, "modes")
    for title, command, key in (("Loop", "loop", scene.loop_key), ("Wind", "windrms", "wind")):
        if attribute(model, key) is not None:
            with page.section(title):
                tables = _add_answer(page, scene, command, left_out=columns_of_loop).tables
                columns_of_loop = {name: {field.name for field in table.fields} for name, table in tables.items()}
    for key, noun in (("wind", "wind"), (scene.loop_key, "loop")):
        if attribute(model, key) is None:
            page.left_out.append(f"{noun}: the scene has none (key {key})")


def _add_statics(page, scene, headed):
    """Append the statics of a scene, and its point loads; `headed` as in `_add_answer`."""
    _add_answer(page, scene, "static", headed=headed)
    if scene.model.load_paths:
        answer = scene.compute("loads")
        _add_point_loads(page, answer.tables, answer.failures, LOADS.format(_of_case(scene)))


def limits(page, scene):
    """Append each limit where its margin is least, to a page that is headed by the least margin."""
    answer = scene.compute("limits")
    _add_messages(page, "limits", answer)
    # what must hold says the limit; that it does is a result, shown where all do, unlike the status of other tables
    shown = [field for field in answer.table.fields if field.name != "limit"]
    fields = tuple(replace(field, name="holds") if field.name == "status" else field for field in shown)
    rows = [{**row, "holds": row.get("status")} for row in answer.table.rows]
    table = replace(answer.table, fields=fields, rows=rows)
    page.table(table, "Limits, each where its margin is least; margins relative to the limit")
    page.key_figure(answer.table, "margin", "least margin of the limits", min)


def _add_answer(page, scene, command, left_out=None, headed=True):
    """Compute one command for a scene, and append its tables, picture and notes to a page: its `Answer`.

    `left_out`: name of a table -> columns that are not shown; `headed`: whether the main numbers are also key figures
    at the head of the page.
    """
    answer, tables = scene.compute(command, estimate=True), {}
    _add_messages(page, command, answer)
    for name, table in answer.tables.items():
        shown = tuple(field for field in table.fields if field.name not in (left_out or {}).get(name, ()))
        if any(not field.label for field in shown):  # labels alone are no table
            status = tuple(field for field in table.fields if field.name == "status" and field not in shown)
            tables[name] = replace(table, fields=shown + status)
    for name, table in tables.items():
        caption = CABLES[command] if name == "cables" else CAPTIONS[name or command]
        page.results(table, caption + _of_case(scene))
    if headed:
        _add_key_figures(page, command, tables)
    if answer.draw is not None:
        page.draw(answer.draw, PICTURES[command] + _of_case(scene))
    return answer


def _add_key_figures(page, command, tables):
    """Show above all sections the numbers of the tables of a command that a reader looks for first."""
    for name, column, title, pick in KEY_FIGURES[command]:
        if name in tables:
            page.key_figure(tables[name], column, title, pick)


def _add_messages(page, command, answer):
    """Add the notes, warnings and failures of an `Answer` to a page."""
    page.note(CAPTIONS[command], answer.explain())
    page.warn(CAPTIONS[command], answer.warnings)
    page.fail(CAPTIONS[command], *answer.failures)


def _of_case(scene):
    """End of a caption that names the load case chosen, or the reference state; empty for a scene without any."""
    if scene.model.case is None:
        return ", reference state" if scene.model.cases else ""
    return f", load case {scene.model.case}"


def _add_load_cases(page, scene):
    """Compute the statics of a scene in all of its load cases, and append them to a page.

    A scene of one cable has one table. A scene of several cables has a table of the extreme tensions of all cables with
    the largest utilisation, and tables of sag and clearance of each cable. The key figures at the head of the page are
    those of the governing case.
    """
    answer = scene.compute_cases("static", estimate=True)
    page.warn("Load cases", answer.warnings)
    page.fail("Load cases", *answer.failures)
    if answer.table is not None:
        page.results(answer.table, "Statics in each load case")
    elif answer.tables:
        cables = answer.tables["cables"]
        page.table(_extremes(cables, list(scene.cases)), "Extremes of all cables")
        for field in page.chosen(cables, OF_EACH_CABLE):
            if any(row.get(field.name) is not None for row in cables.rows):
                title = f"{field.title.capitalize()} of each cable"
                unit = f" [{field.unit}]" if field.unit else ""
                page.table(_of_each_cable(cables, field.name, list(scene.cases)), title + unit)
    _add_loads_of_cases(page, scene)
    _add_key_figures(page, "static", answer.tables)
    if answer.draw is not None:
        page.draw(answer.draw, "Static forms in the load cases")


def _add_loads_of_cases(page, scene):
    """Append a table of the point loads on cables in those load cases that have any."""
    loaded = {name: case.compute("loads") for name, case in scene.cases.items() if case.model.load_paths}
    tables = join_tables({name: answer.tables for name, answer in loaded.items()})
    failures = lines_with_cases({name: answer.failures for name, answer in loaded.items()})
    _add_point_loads(page, tables, failures, LOADS.format(" in the load cases"))


def _add_point_loads(page, tables, failures, caption):
    """Append the table of the point loads of `tables`, if there is one, and why cells have no value."""
    for table in tables.values():
        page.results(table, caption)
    page.fail("Point loads", *failures)


def _extremes(cables, cases):
    """Table of the extreme tensions of all cables in each load case; `cables` has a row for each cable in each case."""
    rows, errors = {name: {"case": name} for name in cases}, {name: {} for name in cases}
    for cable, cable_errors in zip(cables.rows, cables.errors(), strict=True):
        extremes, largest_errors = rows[cable["case"]], errors[cable["case"]]
        for column, _, _, pick in OF_CASES:
            if cable.get(column) is not None:
                extremes[column] = pick(cable[column], extremes.get(column, cable[column]))
                largest_errors[column] = max(largest_errors.get(column, 0.0), cable_errors.get(column, 0.0))
    fields = (Field("case", "case"), *(Field(column, title, unit) for column, title, unit, _ in OF_CASES))
    return Table(fields, list(rows.values()), across="case", errors=lambda: iter(errors.values()))


def _of_each_cable(cables, column, cases):
    """Table of one column of the cables, a row for each cable and a column for each load case; see `_extremes`."""
    rows, errors = {}, {}
    for cable, cable_errors in zip(cables.rows, cables.errors(), strict=True):
        if cable.get("name") is None:  # a load case without an answer
            continue
        name, case = cable["name"], cable["case"]
        rows.setdefault(name, {"name": name})[case] = cable.get(column)
        errors_of_row = errors.setdefault(name, {})
        if column in cable_errors:  # a lost cable has none
            errors_of_row[case] = cable_errors[column]
    fields = Field("name", "cable", label=True), *(Field(case, case) for case in cases)
    return Table(fields, list(rows.values()), errors=lambda: iter(errors.values()))
