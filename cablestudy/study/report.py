"""Tables of the commands static and modes."""

import numpy as np

from cablestudy.cable.catenary import split
from cablestudy.study.columns import COLUMNS, lacks
from cablestudy.study.row import evaluate
from cablestudy.study.statics import ClosedStatics
from cablestudy.study.table import Field, Table
from cablestudy.study.tolerances import STUDY

PARTICIPATION = "N/(m sqrt(kg))"  # unit
STATE = Field("state", "state", text=True)  # of a conductor that stretches for good, see `LinearCables.labels`


def static_table(scene, estimate=False):
    """`Table` and `Row` of every static and stiffness column that a scene has the keys for.

    `estimate`: whether to estimate the errors of deflections by fixed elements; those of other statics cost nothing.
    """
    kinds = ("scene", "statics", "stiffness")
    columns = [column for column in COLUMNS if column.needs in kinds and not lacks(scene, column)]
    row = evaluate(scene, columns, estimate)
    if scene.cable.stress_strain is None:
        return row.table(columns), row
    return row.table(columns, [(STATE, str(row.case.results.state[row.case.index]))]), row


def shape_table(case):
    """Table of the static shape of a case, point by point; with loads, also of the deflections."""
    moved = {}
    if len(case.span.load_positions):
        from cablestudy.study.deflection import nodal_deflections

        mesh, full, linear = nodal_deflections(case)
        positions, moved = mesh.node_positions, {"deflection": full, "linear_deflection": linear}
    elif case.exact_statics:
        positions = np.linspace(0.0, 1.0, STUDY.shape_points)
    else:
        positions = case.state.mesh.node_positions
    data = _along(case.span, positions, *shape(case, positions))
    for word, block in moved.items():
        data |= {f"{word}_{axis}_m": part for axis, part in zip("xyz", (block @ case.span.frame).T, strict=True)}
    return Table(_fields_along(data), _rows_along(data))


def _along(span, positions, places, tension):
    """Header -> values along a cable: arc length, coordinates, tension."""
    data = {"s_m": positions * float(span.unstretched_length)}
    data |= {f"{axis}_m": coordinate for axis, coordinate in zip("xyz", places.T, strict=True)}
    return data | {"tension_N": tension}


def _fields_along(headers):
    words = [(name, *name.rpartition("_")) for name in headers]
    return tuple(Field(name, word.replace("_", " "), unit) for name, word, _, unit in words)


def _rows_along(data):
    return [dict(zip(data, map(float, values), strict=True)) for values in zip(*data.values(), strict=True)]


def shapes_table(cables):
    """Table of the static shapes of cables in closed form, point by point, one cable after the other.

    Parameters
    ----------
    cables : dict
        Name -> `Catenary` of the cable, and the place of its end 1, shape (3,) [m].
    """
    rows, headers = [], ("s_m", "x_m", "y_m", "z_m", "tension_N")
    for name, (catenary, begin) in cables.items():
        edges = np.cumsum(split(catenary.span).fraction)[:-1]
        positions = np.unique(np.concatenate([np.linspace(0.0, 1.0, STUDY.shape_points), edges]))
        found = _placed(ClosedStatics(catenary), catenary.span, begin, positions)
        rows += [{"cable": name, **row} for row in _rows_along(_along(catenary.span, positions, *found))]
    return Table((Field("cable", "cable", label=True), *_fields_along(headers)), rows)


def shape(case, positions):
    """Global coordinates [m], shape (j, 3), and tension [N] at shares of the unstretched length."""
    return _placed(case.statics, case.span, case.end_1, positions)


def _placed(statics, span, begin, positions):
    """`shape` of the statics of a cable whose end 1 is at a place."""
    displacement, tension = statics.shape(positions)
    local = displacement + np.outer(positions * (1 + float(span.chord_strain)), [1.0, 0.0, 0.0])
    return np.asarray(begin) + local @ span.frame * float(span.unstretched_length), tension


def mode_table(case, modes):
    """Table of the `Modes` of a case."""
    participation = np.abs(case.participation(modes))
    # a participation is rounding relative to the largest of all modes and to the largest that its mode could have
    moving = case.span.mass * case.span.unstretched_length * case.state.mesh.node_masses.sum()
    largest = (2 * np.pi * modes.frequency) ** 2 * np.sqrt(moving)
    floor = 1e-12 * np.maximum(largest, participation.max(initial=0.0))
    field = Field("participation", "participation", PARTICIPATION)
    more = {field: np.where(participation > floor, participation, 0.0)}
    return modes_as_rows(case, modes, range(len(modes)), more)


def modes_as_rows(case, modes, chosen, more):
    """Table of chosen modes of a case, by indices: number, kind, symmetry, frequency, and more (Field -> values)."""
    fields = (*(Field(name, name) for name in ("number", "type", "symmetry")), Field("frequency_Hz", "frequency", "Hz"))
    numbers = modes.frequency, *more.values()
    lines = [(int(k) + 1, modes.kind[k], modes.symmetry[k], *(float(values[k]) for values in numbers)) for k in chosen]
    return Table.of((*fields, *more), lines, errors=lambda: _errors_of_modes(case, modes, chosen))


def _errors_of_modes(case, modes, chosen):
    """Yield the estimated error of each chosen frequency, where it is known: header -> number."""
    from cablestudy.study.case_modes import frequency_errors

    errors, _ = frequency_errors(case, modes.first(int(max(chosen, default=-1)) + 1))
    for k in chosen:
        yield {} if errors[k] is None else {"frequency_Hz": errors[k]}


def shape_positions(case):
    """Shares of the unstretched length at which a picture draws the static shape, loads included: shape (j,)."""
    edges = np.cumsum(split(case.span).fraction)
    return np.unique(np.concatenate([np.linspace(0.0, 1.0, 401), edges[:-1]]))
