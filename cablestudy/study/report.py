"""Tables of the commands static, modes, columns and validate."""

import numpy as np

from cablestudy.cable.catenary import split
from cablestudy.errors import SceneError
from cablestudy.scene.document import apply_sets, read_file, resolve_base
from cablestudy.scene.likely_mistakes import likely_mistakes
from cablestudy.scene.sampling import FEWEST
from cablestudy.scene.scene import is_study, read_scene
from cablestudy.scene.study import study_of
from cablestudy.scene.words import counted
from cablestudy.study.all_columns import find
from cablestudy.study.case_modes import errors_of
from cablestudy.study.columns import COLUMNS, FAMILIES, STATUS, lacks, written_key
from cablestudy.study.prepare import prepare
from cablestudy.study.row import evaluate
from cablestudy.study.suspension.columns import families
from cablestudy.study.table import Field, Table

PARTICIPATION = "N/(m sqrt(kg))"  # unit
SHAPE_POINTS = 41  # along a cable in closed form


def static_table(scene, estimate=False):
    """`Table` and `Row` of every static and stiffness column that a scene has the keys for.

    `estimate`: whether to estimate the errors of deflections by fixed elements; those of other statics cost nothing.
    """
    kinds = ("scene", "statics", "stiffness")
    columns = [column for column in COLUMNS if column.needs in kinds and not lacks(scene, column)]
    row = evaluate(scene, columns, estimate)
    fields = (*(column.field for column in columns), STATUS)
    return Table(fields, [row.cells], single=True, errors=row.known_errors), row


def shape_table(case):
    """Table of the static shape of a case, point by point; with loads, also of the deflections."""
    moved = {}
    if len(case.span.load_positions):
        from cablestudy.study.deflection import nodal_deflections

        mesh, full, linear = nodal_deflections(case)
        positions, moved = mesh.node_positions, {"deflection": full, "linear_deflection": linear}
    elif case.exact_statics:
        positions = np.linspace(0.0, 1.0, SHAPE_POINTS)
    else:
        positions = case.state.mesh.node_positions
    places, tension = shape(case, positions)
    data = {"s_m": positions * float(case.span.unstretched_length)}
    data |= {f"{axis}_m": coordinate for axis, coordinate in zip("xyz", places.T, strict=True)}
    data["tension_N"] = tension
    for word, block in moved.items():
        data |= {f"{word}_{axis}_m": part for axis, part in zip("xyz", (block @ case.span.frame).T, strict=True)}
    words = [name.rpartition("_") for name in data]
    fields = [Field(name, word.replace("_", " "), unit) for name, (word, _, unit) in zip(data, words, strict=True)]
    rows = [dict(zip(data, map(float, values), strict=True)) for values in zip(*data.values(), strict=True)]
    return Table(tuple(fields), rows)


def shape(case, positions):
    """Global coordinates [m], shape (j, 3), and tension [N] at shares of the unstretched length."""
    displacement, tension = case.statics.shape(positions)
    local = displacement + np.outer(positions * (1 + float(case.span.chord_strain)), [1.0, 0.0, 0.0])
    return np.asarray(case.end_1) + local @ case.span.frame * float(case.span.unstretched_length), tension


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
    rows = [
        {
            "number": int(k) + 1,
            "type": modes.kind[k],
            "symmetry": modes.symmetry[k],
            "frequency_Hz": float(modes.frequency[k]),
            **{field.name: float(values[k]) for field, values in more.items()},
        }
        for k in chosen
    ]
    return Table((*fields, *more), rows, errors=lambda: _errors_of_modes(case, modes, chosen))


def _errors_of_modes(case, modes, chosen):
    """Yield the estimated error of each chosen frequency, where it is known: header -> number."""
    errors, _ = errors_of(case, modes.first(int(max(chosen, default=-1)) + 1))
    for k in chosen:
        yield {} if errors[k] is None else {"frequency_Hz": errors[k]}


def columns_table(text=""):
    """Table of columns: what it is of (one cable, or a suspension), name, unit, meaning, what it needs.

    Parameters
    ----------
    text : str
        Only those with this text in their names; blanks are underscores, as in headings.

    Raises
    ------
    SceneError
        There is none.
    """
    asked = "_".join(text.split())
    kinds = {"cable": (*COLUMNS, *FAMILIES), "suspension": families()}
    found = [(kind, c) for kind, columns in kinds.items() for c in columns if asked in c.header]
    if not found:  # perhaps one of a family: sag of n1, or mode 3
        try:
            found = [("suspension" if "." in asked or asked.startswith("frequency_") else "cable", find(asked))]
        except ValueError as error:
            raise SceneError(str(error)) from None
    rows = [
        {"of": kind, "column": c.header, "unit": c.unit, "meaning": c.meaning, "needs": c.needs, "key": keys_of(c)}
        for kind, c in found
    ]
    return Table(tuple(Field(name, name) for name in rows[0]), rows)


def keys_of(column):
    """The keys that a column needs, as the file has them."""
    return ", ".join(written_key(key).replace("|", " or ").replace("load_case.", "cases.*.") for key in column.keys)


def shape_positions(case):
    """Shares of the unstretched length at which a picture draws the static shape, loads included: shape (j,)."""
    edges = np.cumsum(split(case.span).fraction)
    return np.unique(np.concatenate([np.linspace(0.0, 1.0, 401), edges[:-1]]))


def validate_table(files, sets=()):
    """Read and check files, with `--set` options.

    Returns
    -------
    table : Table
        File, kind, number of cases (of a scene its load cases, or 1), status.
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
            rows.append({"file": file, "status": counted(len(error.mistakes), "mistake")})
    return Table(tuple(Field(name, name) for name in ("file", "kind", "cases", "status")), rows), mistakes, notes


def _validate(file, sets):
    document = read_file(file)
    if is_study(document):
        study = study_of(document, sets)
        prepare(study)
        notes, sample = [], study.sample
        if sample and sample.method == "saltelli" and sample.count < FEWEST:
            few = f"sample: {sample.count} points; --sensitivity needs at least {FEWEST}"
            notes = [f"{study.where(('sample', 'count'))}: {few}"]
        return "study", study.count, [*study.likely_mistakes(), *study.notes, *notes]
    document = apply_sets(resolve_base(document), sets)
    return "scene", len(read_scene(document).cases) or 1, likely_mistakes(document)
