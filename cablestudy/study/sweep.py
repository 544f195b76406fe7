"""A study: vary -> cases -> rows -> table."""

import json
import signal
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from math import inf

from cablestudy.errors import Mistake, NoSolutionError, SceneError
from cablestudy.scene.study import CHECK_ALL
from cablestudy.study.columns import Column, find, lacks
from cablestudy.study.row import evaluate
from cablestudy.study.table import Field, Table, number, read_csv

# columns that show what a key varies
SHOWN_BY = {
    "cable.area": ("area", "diameter"),
    "cable.diameter": ("diameter", "area"),
    "cable.unstretched_length": ("unstretched_length",),
    "cable.preload": ("preload",),
    "cable.sag": ("sag",),
    "cable.elastic_modulus": ("elastic_modulus",),
    "cable.density": ("density",),
    "cable.chord": ("chord",),
}
STATUS = Field("status", "status")


def columns_of(study):
    """The columns that a study names.

    Parameters
    ----------
    study : Study

    Returns
    -------
    list of Column

    Raises
    ------
    SceneError
        Unknown or repeated columns, or one that needs a key which the scene lacks.
    """
    columns, mistakes = [], []
    _, scene = study.case(0)
    for place, name in enumerate(study.columns):
        asked = place >= len(study.columns) - len(study.asked)
        about = study.where(("columns", place)), "" if asked else f"columns.{place}"
        try:
            column = find(name)
        except ValueError as error:
            mistakes.append(Mistake(*about, str(error)))
            continue
        if any(column.header == other.header for other in columns):
            mistakes.append(Mistake(*about, f"{column.name} is listed twice"))
        elif lacks(scene, column) and _every_case_lacks(study, column):
            message = f"{column.name} needs the key {lacks(scene, column)}, which the scene does not have"
            mistakes.append(Mistake(*about, message))
        columns.append(column)
    if mistakes:
        raise SceneError(*mistakes)
    return columns


def _every_case_lacks(study, column):
    return all(lacks(study.case(index)[1], column) for index in range(min(study.count, CHECK_ALL)))


def reference_of(study, columns):
    """The printed values of a study, row by row.

    Parameters
    ----------
    study : Study
    columns : list of Column

    Returns
    -------
    names : list of str
        Headers of the columns that have printed values.
    rows : list of dict
        Header -> number or None.

    Raises
    ------
    SceneError
        The table does not fit the study.
    """
    if study.reference_path is None:
        return [], []
    names, rows = read_csv(study.reference_path)
    where = study.where(("reference",))
    headers = {column.header for column in columns}
    mistakes = [
        Mistake(where, "reference", f"{study.reference_path}: column {name!r} is not among the study's columns")
        for name in names
        if name not in headers
    ]
    if len(rows) != study.count:
        message = f"{study.reference_path}: {len(rows)} rows, and the study has {study.count} cases"
        mistakes.append(Mistake(where, "reference", message))
    for place, row in enumerate(rows, 1):
        for name in names:
            parsed = number(row[name]) if row[name].strip() else 0.0
            if parsed is None or not abs(parsed) < inf:
                message = f"{study.reference_path}: row {place}, {name}: not a number: {row[name]!r}"
                mistakes.append(Mistake(where, "reference", message))
    if mistakes:
        raise SceneError(*mistakes)
    return names, [{name: number(row[name]) for name in names} for row in rows]


def prepare(study):
    """Everything that can be wrong with a study, found before anything is computed.

    Parameters
    ----------
    study : Study

    Returns
    -------
    columns : list of Column
    reference : tuple
        As from `reference_of`.

    Raises
    ------
    SceneError
    """
    study.check()
    columns = columns_of(study)
    for name in (study.plot.x, *study.plot.y) if study.plot else ():
        try:
            header = find(name).header
        except ValueError as error:
            raise SceneError(Mistake(study.where(("plot",)), "plot", str(error))) from None
        if header not in {column.header for column in columns}:
            message = f"{name} is not among the study's columns"
            raise SceneError(Mistake(study.where(("plot",)), "plot", message))
    return columns, reference_of(study, columns)


def run(study, jobs=1):
    """Compute a study.

    Parameters
    ----------
    study : Study
    jobs : int
        Processes. [-]

    Returns
    -------
    table : Table
    notes : list of tuple of str
        What was modelled, row by row.

    Raises
    ------
    SceneError
        Something is wrong with the study; nothing has been computed.
    """
    columns, reference = prepare(study)
    names = tuple(column.name for column in columns)
    cases = list(study.cases())
    compute = partial(_cells, names=names)
    scenes = [scene for _, scene in cases]
    if jobs > 1 and len(scenes) > 1:
        # Ctrl-C reaches the processes too, and shall end them at once
        calm = {"initializer": signal.signal, "initargs": (signal.SIGINT, signal.SIG_DFL)}
        try:
            with ProcessPoolExecutor(min(jobs, len(scenes)), **calm) as pool:
                results = list(pool.map(compute, scenes, chunksize=max(1, len(scenes) // (4 * jobs))))
        except BrokenProcessPool:
            raise NoSolutionError("one of the processes ended by itself: too little memory for so many jobs?") from None
    else:
        results = [compute(scene) for scene in scenes]
    rows = []
    for place, ((overrides, _), (cells, _)) in enumerate(zip(cases, results, strict=True)):
        rows.append({**written(overrides), **cells, **_printed(cells, reference, place)})
    return Table(_fields(study, columns, reference[0]), rows), [notes for _, notes in results]


def _cells(scene, names):
    """Cells and notes of one case; takes and gives only what another process can receive."""
    row = evaluate(scene, [find(name) for name in names])
    return row.cells, row.notes


def written(overrides):
    """What varies, as the user wrote it: numbers and text, and JSON of anything else.

    Parameters
    ----------
    overrides : dict
        As from `Study.overrides`.

    Returns
    -------
    dict
    """
    plain = {}
    for key, value in overrides.items():
        number_or_text = isinstance(value, (str, int, float)) and not isinstance(value, bool)
        plain[key] = value if number_or_text else json.dumps(value, ensure_ascii=False)
    return plain


def _printed(cells, reference, place):
    names, rows = reference
    added = {}
    for name in names:
        printed, computed = rows[place][name], cells[name]
        added[beside(name, "printed")] = printed
        known = printed is not None and computed is not None
        difference = computed - printed if known else None
        if known and abs(difference) < 1e-12 * abs(printed):
            difference = 0.0
        added[beside(name, "difference")] = difference
    return added


def beside(header, word):
    """`sag_m` -> `sag_printed_m`."""
    column = find(header)
    return f"{column.name}_{word}{column.header[len(column.name) :]}"


def _fields(study, columns, referenced):
    shown = {column.name for column in columns}
    fields = [Field(key, key) for key in study.varied if not shown.intersection(SHOWN_BY.get(key, ()))]
    for column in columns:
        if column.name == "status":
            continue
        fields.append(field_of(column))
        if column.header in referenced:
            printed, difference = beside(column.header, "printed"), beside(column.header, "difference")
            fields.append(Field(printed, "printed", column.unit, hidden=True))
            fields.append(Field(difference, "printed (Δ)", "", beside=printed))
    return (*fields, STATUS)


def field_of(column: Column):
    """A column as a field of a table."""
    return Field(column.header, column.name.replace("_", " "), column.unit)
