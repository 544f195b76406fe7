"""The results of a suspension, as sections of a page: statics, load cases, modes, loop, wind."""

from cablestudy.scene.scene import each_case
from cablestudy.scene.words import counted
from cablestudy.study.columns import STATUS
from cablestudy.study.suspension import columns
from cablestudy.study.suspension.notes import assumed_damping, notes_of, strength_warning
from cablestudy.study.suspension.report import mode_notes, mode_table, static_tables
from cablestudy.study.suspension.rows import evaluate_suspensions
from cablestudy.study.suspension.wind_report import remarks_of, wind_tables
from cablestudy.study.table import Field, Table

MODES = 12
KEY_FIGURES = ("max_tension", "min_tension", "max_utilisation", "cable_mass", "frequency_1", "frequency_2")
STATIC = {
    "bodies": "Bodies: places of the reference points, global axes",
    "points": "Free points: places, global axes",
    "cables": "Cables",
    "stiffness": "Stiffness of each body at its reference point: forces [N] and moments [N m] for movements [m] and "
    "rotations [rad]",
}
WIND = {
    "motion": "Bodies and markers in the wind",
    "rotations": "Rotations of the bodies in the wind",
    "open_loop": "The same with the winches at rest",
    "cables": "Tensions of the cables in the wind",
    "actuators": "Actuators in the wind",
}
LOOP = {"loop": "Loop", "coordinates": "Measured coordinates"}


def evaluated(scenes, names):
    """Columns of the whole of some suspensions, those that they have the keys for: columns and rows."""
    chosen = [columns.find(name) for name in names]
    chosen = [column for column in chosen if not columns.why_not(scenes[0], column)]
    return chosen, evaluate_suspensions(scenes, chosen, estimate=True)


def key_figures(page, scene):
    """The numbers that a reader looks for first: `Table` of one row."""
    chosen, (row,) = evaluated([scene], (*KEY_FIGURES, *_of_first_body(scene)))
    page.warn(row.warnings)
    fields = (*(column.field for column in chosen), STATUS)
    return Table(fields, [row.cells], single=True, errors=row.known_errors)


def _of_first_body(scene):
    """RMS in the wind and margin of the loop, where there are such."""
    names = [f"{next(iter(scene.bodies))}.rms"] if scene.wind is not None and scene.bodies else []
    return [*names, *(["gain_margin"] if scene.control is not None else [])]


def sections(page, document, scene):
    """Append the results of a suspension to a page.

    Parameters
    ----------
    page : Page
    document : Document
    scene : SuspensionScene
    """
    from cablestudy.study.suspension.case import SuspensionCase

    case = SuspensionCase(scene, estimate=True)
    with page.section("Statics"):
        _statics(page, case)
    if scene.cases and scene.case is None:
        with page.section("Load cases"):
            _load_cases(page, document, scene)
    elif not scene.cases:
        page.left_out.append("Load cases: the scene has none (key cases)")
    if not page.failures:
        with page.section("Modes"):
            _modes(page, case)
    _in_motion(page, document, case)
    page.note("Model", (*notes_of(case), *assumed_damping(scene)))


def _in_motion(page, document, case):
    """The loop and the wind, where the scene has them."""
    scene = case.scene
    found = {}
    if scene.control is None:
        page.left_out.append("Loop: the scene has none (key control)")
    else:
        with page.section("Loop"):
            found = wind_tables(document, case)
            for name, caption in LOOP.items():
                if name in found:
                    page.table(found[name], caption)
            page.draw(lambda plots: plots.suspension_loop(case.in_wind.movement), "Loop gain, sensitivity and margins")
    if scene.wind is None:
        page.left_out.append("Wind: the scene has none (key wind)")
        return
    with page.section("Wind"):
        found = found or wind_tables(document, case)
        for name, caption in WIND.items():
            if name in found:
                page.table(found[name], caption)
        page.warn(remarks_of(case))
        page.draw(lambda plots: plots.suspension_wind(case), "Spectra, variance and motion in the wind")


def _statics(page, case):
    for name, table in static_tables(case).items():
        page.table(table, STATIC[name])
    page.warn(strength_warning(case))
    page.draw(lambda plots: plots.suspension_views(case), "Three views and a perspective; cables coloured by tension")


def _modes(page, case):
    found = case.modes(MODES)
    count = min(MODES, len(found))
    page.table(mode_table(case, found, range(count)), f"The {count} lowest coupled modes")
    page.note("Modes", mode_notes(case, found, count))
    page.draw(lambda plots: plots.suspension_modes(case, found, count), "Shapes of the lowest coupled modes")


def _load_cases(page, document, scene):
    names, scenes = zip(*((name, of_case) for name, _, of_case in each_case(document, scene)), strict=True)
    chosen, rows = evaluated(scenes, KEY_FIGURES)
    for name, row in zip(names, rows, strict=True):
        page.note(f"Load case {name}", row.notes)
        page.warn(f"load case {name}: {line.removeprefix('warning: ')}" for line in row.warnings)
        if row.failed:
            page.fail(f"Load case {name}", row.cells["status"])
    fields = (Field("case", "case"), *(column.field for column in chosen), STATUS)
    cells = [{"case": name, **row.cells} for name, row in zip(names, rows, strict=True)]
    table = Table(fields, cells, across="case", errors=lambda: (next(row.known_errors()) for row in rows))
    page.table(table, f"The whole suspension in {counted(len(names), 'load case')}")
