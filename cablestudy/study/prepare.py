"""Checks of a study before anything is computed, and the columns, fields and printed values of its table."""

from contextlib import suppress
from dataclasses import replace
from difflib import get_close_matches
from functools import partial

from cablestudy.errors import Mistake, Mistakes, SceneError
from cablestudy.scene.mistakes import UNKNOWN, at_most, in_order
from cablestudy.scene.scene import field_of, quantity_of
from cablestudy.scene.study import ALL_COLUMNS
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.words import counted
from cablestudy.study.case_table import tables_of
from cablestudy.study.columns import column_named, find, find_header, key_column
from cablestudy.study.find import check_goal
from cablestudy.study.goal import goal_of_study
from cablestudy.study.limits import limits_of
from cablestudy.study.scene_kind import why_not
from cablestudy.study.table import Field, number, stream_csv
from cablestudy.study.table_rows import STATUS
from cablestudy.study.varied_keys import varied_key, varied_keys

OF_CASES = {"base", "set", "vary", "sample", "find"}  # keys of a study that decide on the scenes of its cases
OF_ONE_KEY = (UNKNOWN, "expected")  # beginnings of messages that no other key can make wrong
NEVER_COMPARED = "solve_time"  # differs from run to run
# key -> columns any of which makes a column of its own for the varied key superfluous
SHOWN_BY = {
    "cable.area": ("area", "diameter"),
    "cable.diameter": ("diameter", "area"),
    **{f"cable.{name}": (name,) for name in (
        "unstretched_length", "preload", "sag", "elastic_modulus", "density", "axial_stiffness", "mass_per_length",
        "breaking_force", "chord")},
}  # fmt: skip


def prepare(study):
    """Check a study before anything is computed, and read its columns and the printed values that it is compared with.

    Parameters
    ----------
    study : StudyFile
        Its `wrong_keys` are keys that could not be read. Only what does not depend on them is checked.

    Returns
    -------
    columns : list of Column
        Columns of the study's table.
    reference : tuple of (list of str, list of dict)
        Headers of the printed values, and for each case header -> printed number; two empty lists without such values.

    Raises
    ------
    SceneError
        All mistakes in cases, goal, limits, columns, tolerances, plot and printed values, without those that only
        follow from others.
    """
    columns, printed = [], ([], [])
    scene, mistakes = _first_scene(study)
    with mistakes.at():
        columns = columns_of(study, scene)
    of_scene = (_check_goal, _check_limits) if scene else ()
    check_plot = partial(_check_plot, unknown={found.key for found in mistakes if found.message.startswith(UNKNOWN)})
    for check in of_scene if "columns" in study.wrong_keys else (*of_scene, tolerances_of, check_plot):
        with mistakes.at():
            check(study)
    if columns and not study.wrong_keys:
        with mistakes.at():
            printed = _printed_values(study, columns)
    if mistakes:
        raise SceneError(*in_order(mistakes))
    return columns, printed


def _first_scene(study):
    """Scene of the first case, None where it is wrong or not known; and the `Mistakes` in the cases."""
    mistakes, scene = Mistakes(), None
    if "base" not in study.wrong_keys:
        with mistakes.at():
            check_cases(study)
        with suppress(SceneError):
            scene = study.case(0)[1]
    if OF_CASES.isdisjoint(study.wrong_keys):
        return scene, mistakes
    return None, Mistakes(found for found in mistakes if found.message.startswith(OF_ONE_KEY))


def _check_goal(study):
    """Raise SceneError for a goal that the first case cannot have."""
    if study.find:
        check_goal(goal_of_study(study), study.document_of(0))


def _check_limits(study):
    """Raise SceneError for limits that the first case cannot have."""
    limits_of(study.case(0)[1], study.document_of(0))


def check_cases(study):
    """Raise the mistakes of `cases_to_check`, each once, at most 100: SceneError.

    Values at one place, of a range or a sample, that are wrong in one way are one mistake. It shows the value of fewest
    digits, which is mostly an end of the range.
    """
    mistakes = {}
    for _, error in sorted(tables_of(study, study.cases_to_check())[1].items()):
        for found in error.mistakes:
            text, *_ = found.message.partition(", got ")
            shortest = mistakes.setdefault((found.where, found.key, text), found)
            if len(found.message) < len(shortest.message):
                mistakes[found.where, found.key, text] = found
    if mistakes:
        raise SceneError(*at_most(list(mistakes.values()), study.name))


def _check_plot(study, unknown):
    """Raise SceneError for names under `plot:` that are neither columns of the study nor varied keys.

    A name that is misspelt elsewhere is one mistake alone, see `_is_misspelt`.
    """
    if not study.plot:
        return
    names = {("x",): study.plot.x} | {("y", index): name for index, name in enumerate(study.plot.y)}
    names |= {("color",): study.plot.color}
    with Mistakes() as mistakes:
        for path, name in names.items():
            with mistakes.at(study.where(("plot", *path)), f"plot.{path[0]}"):
                is_varied = name is not None and (varied_key(study, name) or _may_be_varied(study, name))
                if name is not None and not is_varied and not _is_misspelt(study, name, unknown):
                    _drawn_column(study, name)


def _may_be_varied(study, name):
    """True for the name of a key of a scene where what varies in the study is not known."""
    return not OF_CASES.isdisjoint(study.wrong_keys) and field_of(name) is not None


def _is_misspelt(study, name, unknown=()):
    """True for a name that the study misspells as a column that it lists, or as one of its keys that are `unknown`."""
    return bool(get_close_matches(name, [*unknown, *_unknown_columns(study)], 1))


def _unknown_columns(study):
    """Yield the names of columns that the study lists and that do not exist."""
    for name in study.columns:
        try:
            column_named(study, name)
        except ValueError:
            yield name


def _drawn_column(study, name):
    """Raise ValueError for a name that is no column of the study, or text."""
    try:
        column = _study_column(study, name)
    except ValueError:
        if "." not in name:
            raise
        near = get_close_matches(name, [*study.varied, *study.columns], 1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        raise ValueError(f"{name} is neither a column of the study nor a varied key{hint}") from None
    if column.text:
        raise ValueError(f"{column.name} is text")


def columns_of(study, scene):
    """Look up the columns that a study names; the key that it solves for, if any, is the first of them.

    Parameters
    ----------
    study : StudyFile
    scene : CableScene, SuspensionScene or None
        That of the first case. Without it, columns are not checked for keys that scenes lack.

    Returns
    -------
    list of Column

    Raises
    ------
    SceneError
        A column is unknown or listed twice, or none of the first `SCENE.checked_cases` has the keys that it needs.
    """
    columns = [key_column(study.find.by)] if study.find and quantity_of(study.find.by) else []
    with Mistakes() as mistakes:
        for index, name in enumerate(study.columns):
            by_option = index >= len(study.columns) - len(study.asked)  # columns of the command line are the last
            with mistakes.at(study.where(("columns", index)), "" if by_option else f"columns.{index}"):
                column = find(name)
                if any(column.header == other.header for other in columns):
                    raise ValueError(f"{column.name} is listed twice")
                columns.append(column)
                first_cases = (study.case(index)[1] for index in range(min(study.count, SCENE.checked_cases)))
                if scene and (reason := why_not(scene, column)) and all(why_not(case, column) for case in first_cases):
                    raise ValueError(reason)
    return columns


def _study_column(study, name):
    """The column of a name, with its unit or without; ValueError where the study does not list it."""
    column = column_named(study, name)
    if column.needs != "find" and not {column.name, column.header}.intersection(study.columns):
        raise ValueError(f"{name} is not among the study's columns")
    return column


def header_of(study, name):
    """Header of the column that a tolerance names; ValueError where it is not in the study, or never compared."""
    column = _study_column(study, name)
    if column.text or column.name == NEVER_COMPARED:
        raise ValueError(f"{name} {'is text' if column.text else 'is never compared'}")
    return column.header


def tolerances_of(study):
    """The relative tolerances that a study file states: header, or ALL_COLUMNS -> number; SceneError for mistakes."""
    tolerances = {}
    with Mistakes() as mistakes:
        for name, value in study.tolerances.items():
            with mistakes.at(study.source.where(("check", name), of_key=True), f"check.{name}"):
                if _may_be_varied(study, name) or _is_misspelt(study, name):
                    continue
                header = name if name == ALL_COLUMNS else header_of(study, name)
                if header in tolerances:
                    raise ValueError("given twice")
                tolerances[header] = value
    return tolerances


def _printed_values(study, columns):
    """Read the CSV file of a study's printed values: numbers of a publication that its results are compared with.

    Returns as the second result of `prepare`; the number of an empty cell is None. SceneError if the file does not fit
    the study: other columns, another number of rows, or cells that are no numbers.
    """
    if study.reference_path is None:
        return [], []
    where = study.where(("reference",))
    try:
        names, lines = stream_csv(study.reference_path)
        rows = [row for _, row in lines]
    except SceneError as error:  # its messages name the file of the table
        raise SceneError(*(Mistake(where, "reference", str(mistake)) for mistake in error.mistakes)) from None
    numbers = [{name: number(row[name]) for name in names} for row in rows]
    messages = [*_misfits(study, [column.header for column in columns], names, len(rows)), *_no_numbers(rows, numbers)]
    if messages:
        raise SceneError(*(Mistake(where, "reference", f"{study.reference_path}: {text}") for text in messages))
    return names, numbers


def _misfits(study, headers, names, count):
    """Yield what of printed values does not fit a study: columns that it does not have, another number of rows."""
    for name in (name for name in names if name not in headers):
        hint = "".join(f" (did you mean {near!r}?)" for near in get_close_matches(name, headers, 1))
        yield f"column {name!r} is not among the study's columns{hint}"
    if count != study.count:
        yield f"{counted(count, 'row')}, and the study has {counted(study.count, 'case')}"


def _no_numbers(rows, numbers):
    """Yield what is wrong with printed values whose cells are neither empty nor numbers."""
    for row_number, (row, numbers_of_row) in enumerate(zip(rows, numbers, strict=True), 1):
        for name, value in numbers_of_row.items():
            if value is None and row[name].strip():
                yield f"row {row_number}, {name}: not a number: {row[name]!r}"


def _is_loaded(study):
    """True if the first case of a study has point loads or a load case, or the study varies the case."""
    try:
        _, scene = study.case(0)
    except SceneError:
        return False
    return "case" in study.set_keys or bool(getattr(scene, "loads", ()) or scene.case)


def fields_of(study, columns, referenced):
    """Tuple of the fields of a study's table; `referenced` are the headers of columns that have printed values."""
    column_names = {column.name for column in columns}
    if _is_loaded(study):  # what is stated holds in the reference state, the column in the case
        column_names.difference_update(("preload", "sag"))
    fields = [key.field for key in varied_keys(study) if not column_names.intersection(SHOWN_BY.get(key.key, ()))]
    for column in columns:
        if column.name == "status":
            continue
        fields.append(column.field)
        if column.header in referenced:
            printed, difference = (reference_header(column.header, word) for word in ("printed", "difference"))
            fields.append(Field(printed, "printed", column.unit, hidden=True))
            fields.append(Field(difference, "printed (Δ)", column.unit, printed=printed))
    return (*fields, replace(STATUS, kept=True))


def reference_header(header, word):
    """Name with a word before the unit: `sag_m` -> `sag_printed_m`."""
    column = find_header(header)
    return f"{column.name}_{word}{column.header[len(column.name) :]}"
