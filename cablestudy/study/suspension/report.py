"""Tables of the commands static and modes for a suspension."""

from dataclasses import replace

import numpy as np

from cablestudy.cable.catenary import split
from cablestudy.errors import CablestudyError, Mistakes, NoSolutionError, SceneError
from cablestudy.scene.scene import missing
from cablestudy.statics.force_density import cables_without_force_density, find_form
from cablestudy.statics.suspension import AXES
from cablestudy.study.notes import comparison_notes
from cablestudy.study.one_cable.report import STATE, columns_along, fields_along, rows_along
from cablestudy.study.suspension.notes import slack_cables
from cablestudy.study.suspension.numbers import numbers_of
from cablestudy.study.suspension.part_columns import (
    body_columns,
    cable_columns,
    link_columns,
    missing_key,
    point_columns,
)
from cablestudy.study.table import Field, Table
from cablestudy.study.table_rows import Row
from cablestudy.study.tolerances import STUDY
from cablestudy.system.mode_pairs import pair_modes
from cablestudy.system.tolerances import SYSTEM

NAME = Field("name", "name", label=True)
# columns of cables that a terminal shows where it has not room for all
FIRST = ("preload", "max_tension", "unstretched_length", "sag", "utilisation", "clearance")


def static_tables(case, only=None, failures=None):
    """Make the tables of the command `static` for a case: bodies, points, cables, stiffness, and links if it has any.

    Parameters
    ----------
    case : SuspensionCase
    only : str, optional
        Name of a table: no other is made.
    failures : list of str, optional
        Reasons why cells have no value are appended; without this list the first such reason is raised.

    Returns
    -------
    dict
        Name -> Table.

    Raises
    ------
    NoSolutionError, ConvergenceError
        The case has no stable equilibrium.
    """
    suspension = case.equilibrium.suspension
    bodies, points = np.split(np.array(suspension.body_names, dtype=object), [suspension.bodies])

    def columns_of_cable(name):
        columns = cable_columns(name) if name in case.scene.cables else []  # none of a lost cable
        return [column for column in columns if not missing_key(case.scene, name, column)]

    def of_cables():
        names = case.with_all_cables.cables
        return _with_state(case, table_by_name(case, names, columns_of_cable, cable_columns(""), failures))

    makers = {  # of bodies without the last column, the mass; of points the coordinates alone
        "bodies": lambda: table_by_name(case, bodies, lambda name: body_columns(name)[:-1], body_columns("")[:-1]),
        "points": lambda: table_by_name(case, points, lambda name: point_columns(name)[:3], point_columns("")[:3]),
        "cables": lambda: _with_secondary_columns(of_cables()),
        "stiffness": lambda: _stiffness_table(case),
    }
    if case.scene.links:
        makers["links"] = lambda: table_by_name(case, list(case.scene.links), link_columns, failures=failures)
    return {name: make() for name, make in chosen_tables(makers, only).items()}


def chosen_tables(tables, only):
    """The items of a dict of tables, or of functions that make them, whose name is `only`; all where that is None.

    Raises
    ------
    SceneError
        There is none of that name.
    """
    if only not in (None, *tables):
        raise SceneError(f"--table {only}: there are the tables {', '.join(tables)}")
    return {name: table for name, table in tables.items() if only in (None, name)}


def _with_secondary_columns(table):
    """The table of the cables with all columns but FIRST as those that a narrow terminal leaves out."""
    fields = (replace(field, secondary=not (field.label or field.plain in FIRST)) for field in table.fields)
    return replace(table, fields=tuple(fields))


def _with_state(case, table):
    """The table of the cables with a column of their states, if any has one.

    These are lost, slack or taut where a load case has lost cables; of a conductor with permanent elongation, the load
    case or creep that governs its length.
    """
    conductors = case.group.conductor_states(case.index)
    if not (case.scene.load_case.lost or any(conductors)):
        return table
    states = {name: state for name, state in zip(case.with_all_cables.cables, conductors, strict=False) if state}
    if case.scene.load_case.lost:
        states = (
            dict.fromkeys(case.scene.cables, "taut") | states | dict.fromkeys(slack_cables(case.equilibrium), "slack")
        )
        states |= dict.fromkeys(case.with_all_cables.cables.keys() - case.scene.cables.keys(), "lost")
    rows = [{"name": row["name"], STATE.name: states.get(row["name"], ""), **row} for row in table.rows]
    return replace(table, fields=(table.fields[0], replace(STATE, label=True), *table.fields[1:]), rows=rows)


def table_by_name(case, names, columns_of, order=(), failures=None):
    """Table with one row for each name, of bodies, cables or others, and one column for each of their quantities.

    Parameters
    ----------
    case : SuspensionCase
    names : sequence of str
        Names of the rows.
    columns_of : callable
        Name -> list of Column of its row. The names of these columns begin with this name and a dot, which the table
        leaves out.
    order : sequence of Column
        All columns in the order of the table, as `columns_of` makes them for the name "". By default the order is that
        in which columns first appear in the rows.
    failures : list of str, optional
        Reasons why cells have no value are appended; without this list the first such reason is raised.
    """
    columns = {name: columns_of(name) for name in names}
    fields = fields_by_name({"": order}) | fields_by_name(columns)
    rows, errors = [], []
    for name in names:
        cells, known_errors = cells_of(case, {_field(column, name).name: column for column in columns[name]}, failures)
        rows.append({"name": name} | cells)
        errors.append(known_errors)
    used_fields = [field for field in fields.values() if not rows or any(field.name in row for row in rows)]
    return Table((NAME, *used_fields), rows, errors=lambda: iter(errors))


def fields_by_name(columns):
    """Fields of a `table_by_name` but NAME, from the columns of each name: dict of name in the table -> `Field`."""
    fields = [_field(column, name) for name, columns_of_name in columns.items() for column in columns_of_name]
    return {field.name: field for field in fields}


def cells_of(case, columns, failures=None):
    """Compute columns of a case: two dicts, name in the table -> value, and -> its relative error where it is known.

    Parameters
    ----------
    case : SuspensionCase
    columns : dict
        Name in the table -> Column.
    failures : list of str, optional
        Where a value does not exist, the reason is appended, and the value is None.

    Raises
    ------
    NoSolutionError
        A value does not exist, and `failures` is not given.
    ConvergenceError
        A value is not found to the accuracy.
    """
    row = Row(case)
    for column in columns.values():
        row.compute(column)
        if error := row.failures.get(column.header):
            if failures is None or not isinstance(error, NoSolutionError):
                raise error
            failures.append(str(error))
    errors = {name: row.errors.get(column.header) for name, column in columns.items()}
    cells = {name: row.cells.get(column.header) for name, column in columns.items()}
    return cells, {name: error for name, error in errors.items() if error is not None}


def _field(column, name):
    """The `Field` of a column whose name begins with that of a body or cable and a dot."""
    start = len(name) + 1
    return Field(column.header[start:], column.name[start:].replace("_", " "), column.unit)


def _stiffness_table(case):
    """The 6x6 stiffness of each body, one line for each force and moment."""
    suspension = case.equilibrium.suspension
    fields = [Field(axis, axis, label=axis not in AXES) for axis in ("body", "row", *AXES)]
    lines = [
        (name, axis, *map(float, line))
        for name in suspension.body_names[: suspension.bodies]
        for axis, line in zip(AXES, case.body_stiffness(name), strict=True)
    ]
    return Table.of(fields, lines)


def form_tables(document, scene):
    """Tables of the form of a cable net by the force density method (Schek 1974).

    A force density q is the tension T of a cable over the distance l of its ends, T = q l. Where it is given for each
    cable, equilibrium of the free points is linear in their positions.

    Parameters
    ----------
    document : Document
        Of the scene, for the places of missing keys.
    scene : SuspensionScene

    Returns
    -------
    dict
        Name -> Table. `points`: positions of the free points [m]; `cables`: q [N/m], T [N] and l [m] of each cable that
        states a force density.

    Raises
    ------
    SceneError
        Cables at free points state no force density.
    NoSolutionError
        The force densities do not hold a point.
    """
    numbers = numbers_of([scene])
    with Mistakes() as mistakes:
        for name in cables_without_force_density(numbers):
            with mistakes.at():
                raise missing(document, f"cables.{name}.force_density", "static --form-finding")
    if numbers.force_density is None:
        raise SceneError("--form-finding: no effect: no cable ends at a free point")
    form, tension = find_form(numbers)
    density = form.force_density[0]
    points = (NAME, *(Field(f"{axis}_m", axis, "m") for axis in "xyz"))
    cables = (NAME, Field("force_density_N_per_m", "force density", "N/m"), Field("tension_N", "tension", "N"),
              Field("length_m", "length", "m"))  # fmt: skip
    positions = zip(form.body_names[form.bodies :], form.position[0, form.bodies :].tolist(), strict=True)
    has_density = np.isfinite(density)
    # tension over force density is the distance of the ends
    numbers = np.stack([density, tension[0], tension[0] / density], axis=-1)[has_density].tolist()
    names = np.array(form.cable_names, dtype=object)[has_density].tolist()
    return {
        "points": Table.of(points, ([name, *position] for name, position in positions)),
        "cables": Table.of(cables, ([name, *line] for name, line in zip(names, numbers, strict=True))),
    }


def mode_table(case, modes, chosen):
    """Table of coupled modes of cables and bodies, with the errors of frequencies and damping ratios.

    Parameters
    ----------
    case : SuspensionCase
    modes : CoupledModes
        Modes of this case.
    chosen : sequence of int
        Indices, from 0, of the modes that are rows.

    Returns
    -------
    Table
        Number, frequency, damping ratio, the part that moves most, and the share of kinetic energy in bodies.
    """
    fields = (
        Field("number", "number"),
        Field("frequency_Hz", "frequency", "Hz"),
        Field("damping_ratio", "damping ratio"),
        Field("moves", "moves"),
        Field("body_share", "body share"),
    )
    share = np.where(modes.body_share > STUDY.rounding, modes.body_share, 0.0)
    damping = np.where(np.abs(modes.damping_ratio) > STUDY.rounding, modes.damping_ratio, 0.0)
    lines = [
        (k + 1, float(modes.frequency[k]), float(damping[k]), modes.moves[k], float(share[k])) for k in map(int, chosen)
    ]

    def errors():
        """Yield the known errors of each row; computed only if they are shown, as a finer model may be needed."""
        frequency, ratio = mode_errors(case, modes, int(max(chosen, default=-1)) + 1)
        for index in map(int, chosen):
            errors_of_mode = {"frequency_Hz": float(frequency[index]), "damping_ratio": float(ratio[index])}
            yield {name: error for name, error in errors_of_mode.items() if not np.isnan(error)}

    return Table.of(fields, lines, errors=errors)


def shape_table(case, failures):
    """Table of points along the static shapes of all cables, one cable after the other.

    Parameters
    ----------
    case : SuspensionCase
    failures : list of str
        For each cable that is left out, the reason why it has no definite form is appended.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no stable equilibrium.
    """
    equilibrium, rows, headers = case.rest, [], ("s_m", "x_m", "y_m", "z_m", "tension_N")
    for cable, name in enumerate(equilibrium.suspension.cable_names):
        catenary = equilibrium.catenary.take(cable)
        if catenary.slack:
            failures.append(f"{name} is slack and without weight: it has no definite form")
            continue
        edges = np.cumsum(split(catenary.span).fraction)[:-1]
        positions = np.unique(np.concatenate([np.linspace(0.0, 1.0, STUDY.shape_points), edges]))
        columns = columns_along(catenary, equilibrium.ends[cable, 0], positions)
        rows += [{"cable": name, **row} for row in rows_along(columns)]
    return Table((Field("cable", "cable", label=True), *fields_along(headers)), rows)


def mode_errors(case, modes, count):
    """Estimated relative errors of frequency and damping ratio of the lowest coupled modes.

    A model to an accuracy states its errors. Where the scene fixes the elements, a number x of a mode is compared with
    x_f of a finer model, whose own relative error is e_f:

        error = |x - x_f| / |x_f| + e_f

    The mode of the finer model is the one with the most similar shape. Where the finer model fails,
    `case.reason` says why, and no error is known.

    Parameters
    ----------
    case : SuspensionCase
    modes : CoupledModes
        Modes of this case.
    count : int
        Number of modes, from the lowest on.

    Returns
    -------
    frequency, damping_ratio : ndarray, shape (count,)
        NaN where they are not known; 0 where both x and x_f are zero, as for a mode without damping. [-]
    """
    if not case.fixed:
        by_drag = case.group.mode_errors[case.index]
        return case.mode_errors(modes)[:count], modes.damping_error[:count] + by_drag
    errors = np.full((2, count), np.nan)
    try:
        finer = case.finer.modes(count + SYSTEM.modes_beyond)
    except CablestudyError as error:
        case.reason = str(error)
        return errors
    compared = min(count, len(modes), len(finer))
    partner = pair_modes(modes.take(np.arange(compared)), finer)
    pairs = (  # numbers of this model, of the finer one, and errors of these
        (modes.frequency, finer.frequency, finer.error),
        (modes.damping_ratio, finer.damping_ratio, finer.damping_error),
    )
    for row, (numbers, reference, error) in zip(errors, pairs, strict=True):
        numbers, reference, error = numbers[:compared], reference[partner], error[partner]
        nonzero = np.abs(reference) > STUDY.rounding  # not a mode without damping
        difference = np.abs(numbers - reference) / np.where(nonzero, np.abs(reference), 1.0)
        row[:compared] = np.where(nonzero, difference + error, np.nan)
        row[:compared][~nonzero & (np.abs(numbers) <= STUDY.rounding)] = 0.0  # shown as zero
    return errors


def mode_notes(case, modes, count):
    """Notes on the errors of the lowest coupled modes of fixed elements, none of others: tuple of str."""
    if not case.fixed:
        return ()
    errors = [None if np.isnan(error) else error for error in mode_errors(case, modes, count)[0].tolist()]
    return tuple(comparison_notes({f"mode {k}": error for k, error in enumerate(errors, 1)}, case.reason))
