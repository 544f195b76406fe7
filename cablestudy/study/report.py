"""Tables of the commands static, modes, columns and validate."""

import numpy as np

from cablestudy.cable.catenary import split
from cablestudy.errors import SceneError
from cablestudy.scene.document import apply_sets, read_file, resolve_base
from cablestudy.scene.sampling import FEWEST
from cablestudy.scene.scene import is_study, read_scene
from cablestudy.scene.study import study_of
from cablestudy.study.columns import COLUMNS, FAMILIES, lacks
from cablestudy.study.fields import STATUS, field_of
from cablestudy.study.prepare import prepare
from cablestudy.study.row import evaluate
from cablestudy.study.table import Field, Table

SHAPE_POINTS = 41  # along a cable in closed form
MODE_FIELDS = (
    Field("number", "number"),
    Field("type", "type"),
    Field("symmetry", "symmetry"),
    Field("frequency_Hz", "frequency", "Hz"),
    Field("participation", "participation", "N/(m sqrt(kg))"),
)


def static_row(scene):
    """The row of every static and stiffness column that a scene has the keys for.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    Row
    list of Column
    """
    wanted = [
        column for column in COLUMNS if column.needs in ("scene", "statics", "stiffness") and not lacks(scene, column)
    ]
    return evaluate(scene, wanted), wanted


def static_table(row, columns):
    """The table of `static_row`.

    Returns
    -------
    Table
    """
    return Table((*map(field_of, columns), STATUS), [row.cells], single=True, errors=row.known_errors)


def shape_table(case):
    """The static shape of a case, point by point; with loads, also the deflections.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Table
    """
    fields = [
        Field("s_m", "s", "m"),
        *(Field(f"{axis}_m", axis, "m") for axis in "xyz"),
        Field("tension_N", "tension", "N"),
    ]
    moved = None
    if len(case.span.load_positions):
        from cablestudy.study.deflection import nodal_deflections

        mesh, full, linear = nodal_deflections(case)
        positions = mesh.node_positions
        moved = [block @ case.span.frame for block in (full, linear)]
        fields += [Field(f"{word}_{axis}_m", f"{word} {axis}".replace("_", " "), "m")
                   for word in ("deflection", "linear_deflection") for axis in "xyz"]  # fmt: skip
    elif case.exact_statics:
        positions = np.linspace(0.0, 1.0, SHAPE_POINTS)
    else:
        positions = case.state.mesh.node_positions
    length = float(case.span.unstretched_length)
    places, tension = shape(case, positions)
    data = [positions * length, *places.T, tension]
    if moved:
        data += [column for block in moved for column in block.T]
    names = [field.name for field in fields]
    rows = [dict(zip(names, map(float, values), strict=True)) for values in zip(*data, strict=True)]
    return Table(tuple(fields), rows)


def shape(case, positions):
    """Global coordinates [m], shape (j, 3), and tension [N] at shares of the unstretched length."""
    displacement, tension = case.statics.shape(positions)
    local = displacement + np.outer(positions * (1 + float(case.span.chord_strain)), [1.0, 0.0, 0.0])
    return np.array(case.scene.cable.end_1) + local @ case.span.frame * float(case.span.unstretched_length), tension


def mode_table(case, modes):
    """Modes as rows.

    Parameters
    ----------
    case : Case
    modes : Modes

    Returns
    -------
    Table
    """
    participation = np.abs(case.participation(modes))
    # a participation is rounding relative to the largest of all modes and to the largest that its mode could have
    largest = (2 * np.pi * modes.frequency) ** 2 * np.sqrt(case.span.mass * case.span.unstretched_length)
    floor = 1e-12 * np.maximum(largest, participation.max(initial=0.0))
    rows = [
        {
            "number": i + 1,
            "type": modes.kind[i],
            "symmetry": modes.symmetry[i],
            "frequency_Hz": float(modes.frequency[i]),
            "participation": float(participation[i]) if participation[i] > floor[i] else 0.0,
        }
        for i in range(len(modes))
    ]
    return Table(MODE_FIELDS, rows)


def columns_table():
    """The table of all columns: name, unit, meaning, what it needs.

    Returns
    -------
    Table
    """
    fields = tuple(Field(name, name) for name in ("column", "unit", "meaning", "needs", "key"))
    rows = [
        {"column": c.header, "unit": c.unit, "meaning": c.meaning, "needs": c.needs, "key": c.key}
        for c in (*COLUMNS, *FAMILIES)
    ]
    return Table(fields, rows)


def shape_positions(case):
    """Shares of the unstretched length at which a picture draws the static shape, loads included: shape (j,)."""
    edges = np.cumsum(split(case.span).fraction)
    return np.unique(np.concatenate([np.linspace(0.0, 1.0, 401), edges[:-1]]))


def validate_table(files, sets=()):
    """Read and check files.

    Parameters
    ----------
    files : sequence of str
    sets : sequence of str

    Returns
    -------
    table : Table
        File, kind, number of cases, status.
    mistakes : list of Mistake
    notes : list of str
        Warnings about files without a mistake.
    """
    rows, mistakes, notes = [], [], []
    for file in files:
        try:
            kind, cases, known = _validate(file, sets)
            notes += known
            rows.append({"file": file, "kind": kind, "cases": cases, "status": "ok"})
        except SceneError as error:
            mistakes += error.mistakes
            rows.append({"file": file, "status": f"{len(error.mistakes)} mistake(s)"})
    return Table(tuple(Field(name, name) for name in ("file", "kind", "cases", "status")), rows), mistakes, notes


def _validate(file, sets):
    document = read_file(file)
    if is_study(document):
        study = study_of(document, sets)
        prepare(study)
        notes, sample = list(study.notes), study.sample
        if sample and sample.method == "saltelli" and sample.count < FEWEST:
            notes.append(f"sample: {sample.count} points; --sensitivity needs at least {FEWEST}")
        return "study", study.count, [f"{study.where(('sample', 'count'))}: {note}" for note in notes]
    read_scene(apply_sets(resolve_base(document), sets))
    return "scene", 1, []
