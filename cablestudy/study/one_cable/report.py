"""Tables of the commands static and modes."""

import numpy as np

from cablestudy.cable.geometry import points_along
from cablestudy.errors import NoSolutionError
from cablestudy.study.cable_columns import COLUMNS
from cablestudy.study.column import CLOSED, SHAPELESS, lacking_key
from cablestudy.study.table import Field, Table
from cablestudy.study.tolerances import STUDY

PARTICIPATION = "N/(m sqrt(kg))"  # unit
STATE = Field("state", "state", text=True)  # of a conductor with permanent elongation, see `LinearCables.labels`


def static_table(scene, estimate=False):
    """`Table` and `Row` of every static and stiffness column that a scene has the keys for.

    With `estimate` also of the errors of deflections by fixed elements; the errors of other statics cost nothing.
    """
    from cablestudy.study.one_cable.rows import evaluate

    columns = [column for column in COLUMNS if column.needs in CLOSED and not lacking_key(scene, column)]
    row = evaluate(scene, columns, estimate)
    if scene.cable.stress_strain is None:
        return row.table(columns), row
    return row.table(columns, [(STATE, str(row.case.results.state[row.case.index]))]), row


def shape_table(case):
    """Table of the static shape of a case, point by point; with loads, also of the deflections."""
    deflections = {}
    if len(case.span.load_positions):
        from cablestudy.study.deflection import nodal_deflections

        mesh, full, linear = nodal_deflections(case)
        positions, deflections = mesh.node_positions, {"deflection": full, "linear_deflection": linear}
    elif case.exact_statics:
        positions = np.linspace(0.0, 1.0, STUDY.shape_points)
    else:
        positions = case.state.mesh.node_positions
    if case.exact_statics and case.form.slack:
        raise NoSolutionError(SHAPELESS)
    columns = columns_along(case.form, case.end_1, positions)
    for word, deflection in deflections.items():
        components = zip("xyz", (deflection @ case.span.frame).T, strict=True)
        columns |= {f"{word}_{axis}_m": component for axis, component in components}
    return Table(fields_along(columns), rows_along(columns))


def columns_along(cable, end_1, positions):
    """Header -> values along a `Catenary` or `State` from its end 1 [m]: arc length, global coordinates, tension.

    `positions`, shape (j,), are shares of the unstretched length.
    """
    coordinates, tension = points_along(cable, positions) + end_1, cable.at(positions)[1].reshape(len(positions), -1)
    columns = {"s_m": positions * float(cable.span.unstretched_length)}
    columns |= {f"{axis}_m": coordinate for axis, coordinate in zip("xyz", coordinates.T, strict=True)}
    return columns | {"tension_N": np.linalg.norm(tension, axis=-1)}


def fields_along(headers):
    """Fields of columns by their headers, which end with the unit."""
    words = [(name, *name.rpartition("_")) for name in headers]
    return tuple(Field(name, word.replace("_", " "), unit) for name, word, _, unit in words)


def rows_along(columns):
    """Rows of a table: list of dict header -> number, from header -> array."""
    return [dict(zip(columns, map(float, values), strict=True)) for values in zip(*columns.values(), strict=True)]


def mode_table(case, modes):
    """Table of the `Modes` of a case."""
    participation = np.abs(case.participation(modes))
    # a participation is rounding relative to the largest of all modes and to the largest that its mode could have
    moving_mass = case.span.mass * case.span.unstretched_length * case.state.mesh.node_masses.sum()
    largest = (2 * np.pi * modes.frequency) ** 2 * np.sqrt(moving_mass)
    floor = 1e-12 * np.maximum(largest, participation.max(initial=0.0))
    field = Field("participation", "participation", PARTICIPATION)
    further_columns = {field: np.where(participation > floor, participation, 0.0)}
    return modes_as_rows(case, modes, range(len(modes)), further_columns)


def modes_as_rows(case, modes, chosen, further_columns):
    """Table of some modes of a case.

    Parameters
    ----------
    case : CableCase
    modes : Modes
    chosen : sequence of int
        Indices of the modes shown.
    further_columns : dict
        `Field` -> values of all modes, shown after number, type, symmetry and frequency.
    """
    fields = (*(Field(name, name) for name in ("number", "type", "symmetry")), Field("frequency_Hz", "frequency", "Hz"))
    numbers = modes.frequency, *further_columns.values()
    lines = [(int(k) + 1, modes.kind[k], modes.symmetry[k], *(float(values[k]) for values in numbers)) for k in chosen]
    return Table.of((*fields, *further_columns), lines, errors=lambda: _errors_of_modes(case, modes, chosen))


def _errors_of_modes(case, modes, chosen):
    """Yield the estimated error of each chosen frequency, where it is known: header -> number."""
    from cablestudy.study.one_cable.case_modes import frequency_errors

    errors, _ = frequency_errors(case, modes.first(int(max(chosen, default=-1)) + 1))
    for k in chosen:
        yield {} if errors[k] is None else {"frequency_Hz": errors[k]}
