"""Tables of `windrms` and `loop` for a suspension: motion, rotations, cables, actuators, loop and its coordinates."""

from dataclasses import replace

import numpy as np

from cablestudy.errors import SceneError
from cablestudy.scene.words import counted, first_of
from cablestudy.study.column import lacking_key, require
from cablestudy.study.notes import beyond_linear, larger_by_loop, unknown_with_modal_damping
from cablestudy.study.suspension.part_columns import cable_columns, linear_ranges
from cablestudy.study.suspension.report import NAME, cells_of, chosen_tables, fields_by_name, table_by_name
from cablestudy.study.suspension.wind_columns import (
    LOOP,
    WINCHES,
    actuator_columns,
    displacement_columns,
    exceeded_limits,
    link_force_column,
    peak_along,
    rotation_columns,
    slackened,
    tension_columns,
)
from cablestudy.study.table import Field, Table
from cablestudy.study.table_rows import SLACK
from cablestudy.study.tolerances import STUDY

OPEN = "_open_loop"
TABLES = {  # name -> the key of the scene that it needs
    "motion": "bodies",
    "rotations": "bodies",
    "open_loop": "control",
    "cables": "cables",
    "actuators": "actuators",
    "links": "links",
    "loop": "control",
    "coordinates": "control",
}
COORDINATE_FIELDS = (
    Field("coordinate", "coordinate", label=True),
    Field("notch_frequency_Hz", "notch frequency", "Hz"),
    Field("gain_margin_dB", "gain margin of this one alone", "dB"),
)


def wind_tables(document, case, only=None):
    """Make the tables of the command `windrms` for a case in the wind: motion, rotations, cables and others.

    Parameters
    ----------
    document : Document
        Of its scene, for the lines of mistakes.
    case : SuspensionCase
    only : str, optional
        Name of a table: no other is made.

    Returns
    -------
    tables : dict
        Name -> Table, without tables whose key (see `TABLES`) the scene does not have.
    failures : tuple of str
        Why cells of the tables are empty: an unstable loop, a motion that nothing damps.

    Raises
    ------
    SceneError
        The scene has no wind, or nothing for the table `only`.
    NoSolutionError, ConvergenceError
        The motion, or the loop, cannot be computed.
    """
    return _tables(case, _chosen_names(document, case.scene, only), _loop_columns)


def fields_in_wind(document, scene, name):
    """The fields of a table of `wind_tables`, known before it is computed: tuple of `Field`; raises as that does."""
    _chosen_names(document, scene, name)
    if name in ROWS:
        return (NAME, *fields_by_name(columns_by_name(scene, name)).values())
    return fields_of_loop(name, _loop_columns(scene))


def _chosen_names(document, scene, only):
    """Names of the tables of `wind_tables`, whose arguments these are: list of str."""
    require(document, scene, ["wind"], "windrms")
    chosen = chosen_tables(TABLES, only)
    if only and not getattr(scene, chosen[only]):
        raise SceneError(f"--table {only}: the scene has no {chosen[only]}")
    return [name for name in names_of_tables(scene) if name in chosen]


def names_of_tables(scene):
    """Names of the tables that `wind_tables` makes of a `SuspensionScene`: list of str."""
    return [name for name, key in TABLES.items() if getattr(scene, key)]


def loop_tables(case, only=None):
    """The tables `loop` and `coordinates`, or the one named by `only`; returns and raises as `wind_tables`."""
    return _tables(case, chosen_tables(dict.fromkeys(("loop", "coordinates")), only), lambda _: LOOP)


def fields_of_loop(name, columns=LOOP):
    """The fields of a table of `loop_tables`, whose table `loop` has these columns: tuple of `Field`."""
    return COORDINATE_FIELDS if name == "coordinates" else tuple(column.field for column in columns)


def _tables(case, names, loop_columns):
    """Tables of some names, and why cells of them are empty: dict, and tuple of str.

    `loop_columns`: function of the scene for the columns of the table `loop`. Raises as `wind_tables`, of a loop that
    is not stable too.
    """
    _, failures = case.analysis.loop_for_margins.stability.stable, []
    tables = {name: _table_of(name, case, failures, loop_columns) for name in names}
    return tables, tuple(dict.fromkeys(failures))


def _bodies_and_markers(scene):
    """Names of the bodies and markers."""
    markers = {body: [f"{body}.{marker}" for marker in table.markers] for body, table in scene.bodies.items()}
    return [name for body, of_body in markers.items() for name in (body, *of_body)]


def _closed_loop(columns):
    """Those of some columns that are with the loop."""
    return [column for column in columns if OPEN not in column.name]


def _open_loop(name):
    """Columns of a body or marker with the winches at rest, without that in their names."""
    columns = displacement_columns(name) + ([] if "." in name else rotation_columns(name))
    return [replace(column, name=column.name.replace(OPEN, "")) for column in columns if OPEN in column.name]


def _cable_columns(name):
    """Tensions in the wind, and the utilisation at rest."""
    return [*tension_columns(name), *(column for column in cable_columns(name) if column.name == f"{name}.utilisation")]


def columns_by_name(scene, table):
    """The columns of each row of a table of ROWS, of those whose keys the scene has: dict of name -> list of Column."""
    names, columns_of = ROWS[table]
    columns = {name: columns_of(scene, name) for name in names(scene)}
    return {name: [column for column in columns[name] if not lacking_key(scene, column)] for name in columns}


ROWS = {  # name of a table -> functions: of a scene, the names of the rows; of the scene and such a name, its columns
    "motion": (_bodies_and_markers, lambda scene, name: _closed_loop(displacement_columns(name))),
    "rotations": (lambda scene: scene.bodies, lambda scene, name: _closed_loop(rotation_columns(name))),
    "open_loop": (_bodies_and_markers, lambda scene, name: _open_loop(name)),
    "cables": (lambda scene: scene.cables, lambda scene, name: _cable_columns(name)),
    "actuators": (
        lambda scene: scene.actuators,
        lambda scene, name: actuator_columns(name, hasattr(scene.actuators[name], "torque")),
    ),
    "links": (lambda scene: scene.links, lambda scene, name: [link_force_column(name)]),
}


def _table_of(name, case, failures, loop_columns):
    """The table of a name, see `_tables`; why cells are empty is appended to `failures`."""
    if name == "loop":
        columns = loop_columns(case.scene)
        cells, errors = cells_of(case, {column.header: column for column in columns}, failures)
        return Table(fields_of_loop(name, columns), [cells], single=True, errors=lambda: iter([errors]))
    if name == "coordinates":
        return _coordinate_table(case)
    columns = columns_by_name(case.scene, name)
    return table_by_name(case, columns, columns.get, failures=failures)


def _loop_columns(scene):
    """Columns of the loop in the wind, of winches too where their speed is limited."""
    return (*LOOP, *(WINCHES if scene.control.max_speed else ()))


def _coordinate_table(case):
    """Table of measured coordinates: frequency of the notch, and gain margin alone, which an unstable loop lacks."""
    closed_loop, limits, lines = case.analysis.loop_for_margins, _single_limits(case), []
    for name, notch in zip(closed_loop.body.measured, closed_loop.body.notches, strict=True):
        limit = limits.get(name, np.inf)
        frequency = notch and float(notch.omega / (2 * np.pi))
        margin = float(20 * np.log10(limit)) if 0 < limit < np.inf else None
        lines.append((f"{closed_loop.body.name}.{name}", frequency, margin))

    def errors():
        of_factors = closed_loop.stability.errors_of_single_limits if limits else [np.nan] * len(lines)
        for (_, _, margin), error in zip(lines, of_factors, strict=True):
            yield {"gain_margin_dB": float(20 * np.log10(1 + error) / abs(margin))} if margin and error >= 0 else {}

    return Table.of(COORDINATE_FIELDS, lines, errors=errors)


def _single_limits(case):
    """`LoopStability.single_limits` of a case; empty of a loop that does nothing or is unstable."""
    closed_loop = case.analysis.loop_for_margins
    return closed_loop.stability.single_limits if closed_loop.loop.gain and closed_loop.stability.stable else {}


def remarks_on_coordinates(case, tables):
    """Notes on coordinates without which the loop is unstable, if `tables` has that of coordinates: tuple of str."""
    if "coordinates" not in tables:
        return ()
    body = case.analysis.loop_for_margins.body.name
    return tuple(
        f"note: no gain margin of {body}.{name} alone: the loop is unstable without this coordinate"
        for name, limit in _single_limits(case).items()
        if limit == 0
    )


def _peaks_and_ranges(case):
    """Yield body and axis, the largest expected displacement along it, and how far it is linear. [mm]"""
    for name in case.scene.bodies:
        for axis, column in enumerate(linear_ranges(name)):
            yield f"{name}.{'xyz'[axis]}", peak_along(case, name, axis), column.compute(case)[0]


def remarks_of(case, tables):
    """Warnings and notes on numbers in the wind: exceeded limits, slack cables, unknown errors: list of str.

    And, where the `tables` show both, a note on motions that the loop makes larger.
    """
    lines = [f"warning: {text}: the linear numbers do not hold" for text in exceeded_limits(case).values()]
    lines += remarks_on_coordinates(case, tables)
    if slack := slackened(case):
        lines.append(f"warning: {SLACK}: {first_of(slack, STUDY.listed_parts)}: the linear numbers do not hold")
    motion = case.analysis
    if motion.model is None and motion.sizes.damping_grows:
        modes = counted(len(motion.closed_loop.modes), "mode")
        lines.append(unknown_with_modal_damping("the error of the RMS is", modes))
    if "motion" in tables:
        lines += beyond_linear(_peaks_and_ranges(case))
    if "motion" in tables and "open_loop" in tables:
        pairs = zip(tables["motion"].rows, tables["open_loop"].rows, strict=True)
        lines += larger_by_loop((row["name"], row["rms_mm"], at_rest["rms_mm"]) for row, at_rest in pairs)
    return lines
