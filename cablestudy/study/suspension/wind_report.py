"""Tables of `windrms` and `loop` for a suspension: motion, rotations, cables, actuators, loop and its coordinates."""

from dataclasses import replace
from functools import partial

import numpy as np

from cablestudy.errors import SceneError
from cablestudy.scene.words import counted, first_of
from cablestudy.study.column import lacks, require
from cablestudy.study.notes import beyond_linear, larger_by_loop, unknown_rms_error
from cablestudy.study.suspension.part_columns import cable_columns, has_key, linear_ranges
from cablestudy.study.suspension.report import cells_of, chosen_tables, table_by_name
from cablestudy.study.suspension.wind_columns import (
    LOOP,
    WINCHES,
    actuator_columns,
    displacement_columns,
    exceeded_limits,
    link_force_column,
    peak_along,
    slackened,
    tension_columns,
    turn_columns,
)
from cablestudy.study.table import Field, Table
from cablestudy.study.table_rows import SLACK
from cablestudy.study.tolerances import STUDY

OPEN = "_open_loop"


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
    scene = case.scene
    require(document, scene, ["wind"], "windrms")
    chosen = chosen_tables(TABLES, only)
    if only and not getattr(scene, chosen[only][0]):
        raise SceneError(f"--table {only}: the scene has no {chosen[only][0]}")
    return make_tables(case, {name: chosen[name][1] for name in names_of_tables(scene) if name in chosen})


def names_of_tables(scene):
    """Names of the tables that `wind_tables` makes of a `SuspensionScene`: list of str."""
    return [name for name, (key, _) in TABLES.items() if getattr(scene, key)]


def loop_tables(case, only=None):
    """The tables `loop` and `coordinates`, or the one named by `only`; returns and raises as `wind_tables`."""
    makers = {"loop": loop_table, "coordinates": coordinate_table}
    return make_tables(case, chosen_tables(makers, only))


def make_tables(case, makers):
    """Tables by their names, and why cells of them are empty: tuple of str.

    Parameters
    ----------
    case : SuspensionCase
    makers : dict
        Name -> function of the case and a list of failures, which makes the table.

    Raises
    ------
    NoSolutionError, ConvergenceError
        The motion, or the loop, cannot be computed, stable or not.
    """
    _, failures = case.analysis.loop_for_margins.stability.stable, []
    tables = {name: make(case, failures) for name, make in makers.items()}
    return tables, tuple(dict.fromkeys(failures))


def _bodies_and_markers(scene):
    """Names of the bodies and markers."""
    markers = {body: [f"{body}.{marker}" for marker in table.markers] for body, table in scene.bodies.items()}
    return [name for body, of_body in markers.items() for name in (body, *of_body)]


def _closed_loop(columns_of):
    """Function of a name: columns with the loop, of those of a function."""
    return lambda name: [column for column in columns_of(name) if OPEN not in column.name]


def _open_loop(name):
    """Columns of a body or marker with the winches at rest, without that in their names."""
    columns = displacement_columns(name) + ([] if "." in name else turn_columns(name))
    return [replace(column, name=column.name.replace(OPEN, "")) for column in columns if OPEN in column.name]


def _cable_columns(scene, name):
    """Tensions in the wind, and the utilisation at rest of a cable whose strength is known."""
    static = [column for column in cable_columns(name) if column.name == f"{name}.utilisation"]
    tensions = [column for column in tension_columns(name) if not lacks(scene, column)]
    return [*tensions, *(column for column in static if has_key(scene, name, column))]


def _actuator_columns(scene):
    """Function of a name: columns of that reaction mass or wheel."""
    return lambda name: actuator_columns(name, hasattr(scene.actuators[name], "torque"))


def _by_name(case, names, columns_of, failures):
    """Table with one row for each name, without the columns whose keys the scene lacks."""

    def computable(name):
        return [column for column in columns_of(name) if not lacks(case.scene, column)]

    return table_by_name(case, names, computable, failures=failures)


def loop_table(case, failures, more=()):
    """Gain, margins, peak of the sensitivity and more columns of a `SuspensionCase`.

    Parameters
    ----------
    case : SuspensionCase
    failures : list
        Why cells are empty: it is filled.
    more : sequence of Column
    """
    columns = (*LOOP, *more)
    cells, errors = cells_of(case, {column.header: column for column in columns}, failures)
    return Table(tuple(column.field for column in columns), [cells], single=True, errors=lambda: iter([errors]))


def coordinate_table(case, _):
    """Table of measured coordinates: frequency of the notch, and gain margin alone, which an unstable loop lacks."""
    closed_loop = case.analysis.loop_for_margins
    limits = closed_loop.stability.single_limits if closed_loop.loop.gain and closed_loop.stability.stable else {}
    lines = []
    for name, notch in zip(closed_loop.body.measured, closed_loop.body.notches, strict=True):
        limit = limits.get(name, np.inf)
        frequency = notch and float(notch.omega / (2 * np.pi))
        margin = float(20 * np.log10(limit)) if 0 < limit < np.inf else None
        lines.append((f"{closed_loop.body.name}.{name}", frequency, margin))
    fields = (
        Field("coordinate", "coordinate", label=True),
        Field("notch_frequency_Hz", "notch frequency", "Hz"),
        Field("gain_margin_dB", "gain margin of this one alone", "dB"),
    )
    return Table.of(fields, lines)


TABLES = {  # name -> the key of the scene that it needs, and what makes it of a case
    "motion": ("bodies", lambda case, why: _by_name(
        case, _bodies_and_markers(case.scene), _closed_loop(displacement_columns), why)),
    "rotations": ("bodies", lambda case, why: _by_name(case, list(case.scene.bodies), _closed_loop(turn_columns), why)),
    "open_loop": ("control", lambda case, why: _by_name(case, _bodies_and_markers(case.scene), _open_loop, why)),
    "cables": ("cables", lambda case, why: table_by_name(
        case, list(case.scene.cables), partial(_cable_columns, case.scene), failures=why)),
    "actuators": ("actuators", lambda case, why: _by_name(
        case, list(case.scene.actuators), _actuator_columns(case.scene), why)),
    "links": ("links", lambda case, why: _by_name(
        case, list(case.scene.links), lambda name: [link_force_column(name)], why)),
    "loop": ("control", lambda case, why: loop_table(case, why, WINCHES if case.scene.control.max_speed else ())),
    "coordinates": ("control", coordinate_table),
}  # fmt: skip


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
    if slack := slackened(case):
        lines.append(f"warning: {SLACK}: {first_of(slack, STUDY.listed_parts)}: the linear numbers do not hold")
    motion = case.analysis
    if motion.model is None and motion.sizes.damping_grows:
        lines.append(f"note: {unknown_rms_error(counted(len(motion.closed_loop.modes), 'mode'))}")
    if "motion" in tables:
        lines += beyond_linear(_peaks_and_ranges(case))
    if "motion" in tables and "open_loop" in tables:
        pairs = zip(tables["motion"].rows, tables["open_loop"].rows, strict=True)
        lines += larger_by_loop((row["name"], row["rms_mm"], at_rest["rms_mm"]) for row, at_rest in pairs)
    return lines
