"""The results of a scene as sections of a page: statics, load cases, modes, loop, wind; see `interface.scene`."""

from dataclasses import replace

from cablestudy.study.columns import attribute
from cablestudy.study.table import Field, Table

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
NOTE = "note: "  # how a warning begins that is none
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
OF_EACH_CABLE = ("sag", "clearance")  # columns of cables that stand in a table of their own for all load cases
OF_CASES = (
    ("min_tension_N", "smallest tension", "N", min),
    ("max_tension_N", "largest tension", "N", max),
    ("utilisation", "largest utilisation", "", max),
)


def sections(page, scene):
    """Append the results of a scene, of one cable or a suspension, to a page.

    Parameters
    ----------
    page : Page
    scene : interface.scene.CableScene
    """
    model, known = scene.model, {}
    several = bool(model.cases) and model.case is None
    with page.section("Statics"):
        _answer(page, scene, "static", headed=not several)
    if several:
        with page.section("Load cases"):
            _cases(page, scene)
    elif not model.cases:
        page.left_out.append("load cases: the scene has none (key cases)")
    with page.section("Modes"):
        _answer(page, scene, "modes")
    if attribute(model, scene.loop_key) is not None:
        with page.section("Loop"):
            found = _answer(page, scene, "loop")
            known = {name: {field.name for field in table.fields} for name, table in found.tables.items()}
    if model.wind is not None:
        with page.section("Wind"):
            _answer(page, scene, "windrms", known)
    for key, what in (("wind", "wind"), (scene.loop_key, "loop")):
        if attribute(model, key) is None:
            page.left_out.append(f"{what}: the scene has none (key {key})")


def limits(page, scene):
    """Append each limit where its margin is least, to a page that is headed by the least margin."""
    answer = scene.compute("limits")
    _add_messages(page, "limits", answer)
    page.table(answer.table, "Limits, each where its margin is least; margins relative to the limit")
    page.key_figure(answer.table, "margin", "least margin of the limits", min)


def _answer(page, scene, what, known=None, headed=True):
    """What a command computes: tables without the columns that are known, picture, notes; returns the `Answer`.

    `known` has the names of columns by the name of their table; `headed`: whether numbers of it are key figures.
    """
    answer, tables = scene.compute(what, estimate=True), {}
    _add_messages(page, what, answer)
    for name, table in answer.tables.items():
        new = tuple(field for field in table.fields if field.name not in (known or {}).get(name, ()))
        if any(not field.label for field in new):
            status = tuple(field for field in table.fields if field.name == "status" and field not in new)
            tables[name] = replace(table, fields=new + status)
    for name, table in tables.items():
        page.results(table, _caption(scene, what, name))
    if headed:
        _key_figures(page, what, tables)
    if answer.draw is not None:
        page.draw(answer.draw, PICTURES[what] + _of_case(scene))
    return answer


def _key_figures(page, what, tables):
    """The numbers of tables that a reader looks for first."""
    for name, column, title, pick in KEY_FIGURES[what]:
        if name in tables:
            page.key_figure(tables[name], column, title, pick)


def _add_messages(page, what, answer):
    """Notes, warnings and failures of an answer."""
    page.note(CAPTIONS[what], answer.explain())
    page.note(CAPTIONS[what], (line.removeprefix(NOTE) for line in answer.warnings if line.startswith(NOTE)))
    page.warn(line for line in answer.warnings if not line.startswith(NOTE))
    for reason in answer.failures:
        page.fail(CAPTIONS[what], reason)


def _caption(scene, what, name):
    return (CABLES[what] if name == "cables" else CAPTIONS[name or what]) + _of_case(scene)


def _of_case(scene):
    return "" if scene.model.case is None else f", load case {scene.model.case}"


def _cases(page, scene):
    """Statics in each load case: of several cables the extremes of all, and sag and clearance of each.

    The key figures are those of the case that governs.
    """
    answer = scene.compute_cases("static", estimate=True)
    page.warn(answer.warnings)
    for reason in answer.failures:
        page.fail("Load cases", reason)
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
    _key_figures(page, "static", answer.tables)
    if answer.draw is not None:
        page.draw(answer.draw, "Static forms in the load cases")


def _extremes(cables, cases):
    """Table of the extreme tensions of all cables in each of some load cases."""
    rows, errors = {name: {"case": name} for name in cases}, {name: {} for name in cases}
    for row, own in zip(cables.rows, cables.errors(), strict=True):
        found, worst = rows[row["case"]], errors[row["case"]]
        for column, _, _, pick in OF_CASES:
            if row.get(column) is not None:
                found[column] = pick(row[column], found.get(column, row[column]))
                worst[column] = max(worst.get(column, 0.0), own.get(column, 0.0))
    fields = (Field("case", "case"), *(Field(column, title, unit) for column, title, unit, _ in OF_CASES))
    return Table(fields, list(rows.values()), across="case", errors=lambda: iter(errors.values()))


def _of_each_cable(cables, column, cases):
    """Table of one number of each cable, a row each, in each of some load cases."""
    rows, errors = {}, {}
    for row, own in zip(cables.rows, cables.errors(), strict=True):
        rows.setdefault(row["name"], {"name": row["name"]})[row["case"]] = row.get(column)
        errors.setdefault(row["name"], {}).update(
            {row["case"]: own[column]} if column in own else {}
        )  # none of a lost one
    fields = Field("name", "cable", label=True), *(Field(case, case) for case in cases)
    return Table(fields, list(rows.values()), errors=lambda: iter(errors.values()))
