"""The results of a scene as sections of a page: statics, load cases, modes, loop, wind; see `interface.scene`."""

from dataclasses import replace

from cablestudy.errors import CablestudyError
from cablestudy.pages.page import one_line
from cablestudy.study.table import Field, Table

CAPTIONS = {
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
    "loop": "Loop",
    "coordinates": "Measured coordinates of the loop",
}
LOOP = ("loop", "coordinates")  # tables of a suspension in the wind that are of the loop, where it has one
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
        ("cables", "utilisation", "largest utilisation", max),
    ),
    "modes": (("", "frequency_Hz", "lowest frequency", min),),
    "loop": (("", "gain_margin_dB", "gain margin", min), ("", "phase_margin_deg", "phase margin", min)),
    "windrms": (
        ("", "gondola_frequency_Hz", "frequency of the gondola", max),
        ("", "gondola_rms_mm", "RMS of the gondola", max), ("", "midspan_rms_mm", "RMS at mid-span", max),
        ("motion", "rms_mm", "largest RMS in the wind", max), ("loop", "gain_margin_dB", "gain margin", min),
    ),
}  # fmt: skip
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
    scene : interface.scene.Scene
    """
    model = scene.model
    with page.section("Statics"):
        _answer(page, scene, "static")
    if model.cases and model.case is None:
        with page.section("Load cases"):
            (_cases_of_suspension if scene.is_suspension else _cases_of_cable)(page, scene)
    elif not model.cases:
        page.left_out.append("load cases: the scene has none (key cases)")
    with page.section("Modes"):
        _answer(page, scene, "modes")
    if scene.is_suspension:
        _suspension_in_motion(page, scene)
    else:
        _cable_in_motion(page, scene)
    for key, what in (("wind", "wind"), ("control" if scene.is_suspension else "winch.controller", "loop")):
        if not _has(model, key):
            page.left_out.append(f"{what}: the scene has none (key {key})")


def _has(model, key):
    """Whether a scene has what a dotted key names."""
    for name in key.split("."):
        model = model and getattr(model, name)
    return model is not None


def _cable_in_motion(page, scene):
    known = ()
    if _has(scene.model, "winch.controller"):
        with page.section("Loop"):
            known = [field.name for field in _answer(page, scene, "loop").table.fields]
    if scene.model.wind is not None:
        with page.section("Wind"):
            _answer(page, scene, "windrms", known)


def _suspension_in_motion(page, scene):
    """With wind the loop is that in the wind, which damps the motion, and both are computed once."""
    found = None
    if scene.model.control is not None and scene.model.wind is None:
        with page.section("Loop"):
            _answer(page, scene, "loop")
    elif scene.model.control is not None:
        with page.section("Loop"):
            found = scene.compute("windrms", estimate=True)
            _tables(page, scene, "windrms", {name: found.tables[name] for name in LOOP})
            page.draw(lambda plots: plots.loop_margins(found.case.in_wind.controlled), PICTURES["loop"])
    if scene.model.wind is not None:
        with page.section("Wind"):
            found = found or scene.compute("windrms", estimate=True)
            _told(page, "windrms", found)
            tables = {name: table for name, table in found.tables.items() if name not in LOOP}
            _tables(page, scene, "windrms", tables)
            if found.draw is not None:
                page.draw(found.draw, PICTURES["windrms"])


def _answer(page, scene, what, known=()):
    """What a command computes: tables without the columns that are known, picture, notes; returns the `Answer`."""
    answer = scene.compute(what, estimate=True)
    _told(page, what, answer)
    tables = {"": answer.table} if answer.table is not None else answer.tables
    if known:
        left = tuple(field for field in answer.table.fields if field.name not in known or field.name == "status")
        tables = {"": replace(answer.table, fields=left)}
    _tables(page, scene, what, tables)
    if answer.draw is not None:
        page.draw(answer.draw, PICTURES[what] + _of_case(scene))
    return answer


def _tables(page, scene, what, tables):
    """Tables with their captions; the numbers among them that a reader looks for first."""
    for name, table in tables.items():
        page.table(table, _caption(scene, what, name))
    for name, column, title, pick in KEY_FIGURES[what]:
        if name in tables:
            page.key_figure(tables[name], column, title, pick)


def _told(page, what, answer):
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


def _cases_of_cable(page, scene):
    answer = scene.compute_cases("static", estimate=True)
    page.warn(answer.warnings)
    for reason in answer.failures:
        page.fail("Load cases", reason)
    page.table(answer.table, "Statics in each load case")
    if answer.draw is not None:
        page.draw(answer.draw, "Static forms in the load cases")


def _cases_of_suspension(page, scene):
    """Extreme tensions of the whole in each load case."""
    rows, errors = [], []
    for name, of_case in scene.cases.items():
        row, worst = {"case": name}, {}
        try:
            answer = of_case.compute("static")
        except CablestudyError as error:
            page.fail(f"Load case {name}", one_line(error))
        else:
            page.warn(f"load case {name}: {line.removeprefix('warning: ')}" for line in answer.warnings)
            cables = answer.tables["cables"]
            for column, _, _, pick in OF_CASES:
                known = [one[column] for one in cables.rows if one.get(column) is not None]
                row |= {column: pick(known)} if known else {}
                worst[column] = max((one.get(column, 0.0) for one in cables.errors()), default=0.0)
        rows.append(row)
        errors.append(worst)
    fields = (Field("case", "case"), *(Field(column, title, unit) for column, title, unit, _ in OF_CASES))
    page.table(Table(fields, rows, across="case", errors=lambda: iter(errors)), "Extremes of all cables")
