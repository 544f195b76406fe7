"""The path of a point load that travels along its cable from end to end, unstretched lengths fixed."""

import re
from dataclasses import dataclass

from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.scene.document import read_document
from cablestudy.scene.fields import suggestion
from cablestudy.scene.scene import CABLE, read_scene
from cablestudy.scene.words import first_of
from cablestudy.study.columns import find
from cablestudy.study.point_loads import FIELDS, NO_GROUND, fields_in, lacks_clearance, loaded_cables, rows_of_loads
from cablestudy.study.scene_kind import kind_of
from cablestudy.study.table import Field, Table
from cablestudy.study.table_rows import OK, STATUS
from cablestudy.study.tolerances import STUDY

OF_CABLE = [find(name).field for name in ("max_tension", "angle_1", "angle_2")]


@dataclass(frozen=True)
class LoadPath:
    """Positions of a load that travels along a cable, with the equilibrium in each."""

    name: str  # of the load
    cables: list  # of CableCase or HangingCable: the cable with the load in each position that has an answer
    table: Table  # a row for each position, by its share of the unstretched length
    failures: list  # of str: why rows lack an answer, or a clearance, with their positions


def load_path(document, scene, option):
    """`LoadPath` of a scene, with one of its point loads at many places along its cable.

    The places divide the cable into equal parts. All cables keep the unstretched lengths of the reference state.

    The `option` is the name of the load, `load1` or `CABLE.load1`, and after a colon the number of positions, 39 by
    default; SceneError if there is no such load, or the number is wrong. NoSolutionError or ConvergenceError if there
    is no reference state.
    """
    name, count = _load_and_count(option, scene.load_paths)
    (owner, _, own_name), kind = name.rpartition("."), kind_of(scene)
    frozen, path = read_scene(read_document(kind.freeze(document, scene))), scene.load_paths[name]  # lengths stated
    load, fractions = frozen.value_at(path), [(k + 1) / (count + 1) for k in range(count)]
    cables, rows, failures = [], [], {}
    for fraction in fractions:
        row, load_at_fraction = {"fraction": fraction}, load.model_copy(update={"at": None, "fraction": fraction})
        try:
            loaded = loaded_cables(kind.case(frozen.with_value(path, load_at_fraction)))
            if owner not in loaded:  # the cable is lost in the load case
                raise NoSolutionError(f"{owner} is not there")
            row |= _row(loaded[owner], int(own_name.removeprefix("load")))
            cables.append(loaded[owner])
            status = NO_GROUND if lacks_clearance(row) else OK
        except (NoSolutionError, ConvergenceError) as error:
            status = str(error)
        if status != OK:
            failures.setdefault(status, []).append(f"{fraction:.4g}")
        rows.append(row | {"status": status})
    texts = [
        f"{name} at {first_of(positions, STUDY.listed_positions)} of the length: {status}"
        for status, positions in failures.items()
    ]
    return LoadPath(name, cables, _table(rows), texts)


def _load_and_count(option, names):
    """Name of a load and number of positions; SceneError where one of them is wrong."""
    name, colon, count = option.partition(":")
    name = name if name in names else name.removeprefix(f"{CABLE}.")  # as of a suspension
    if name not in names:
        raise SceneError(f"--locus {option}: no such load ({suggestion(name, list(names))})")
    position_count = int(count) if re.fullmatch(r"[0-9]{1,4}", count) else 0
    if colon and not 0 < position_count <= STUDY.most_path_positions:
        raise SceneError(
            f"--locus {option}: how many places: expected a whole number from 1 to {STUDY.most_path_positions}"
        )
    return name, position_count or STUDY.path_positions


def _row(cable, number):
    """Cells of a load on its cable, by its number from 1, and of the cable."""
    angles = [float(find(column).compute(cable)) for column in ("angle_1", "angle_2")]
    cells_of_cable = zip([field.name for field in OF_CABLE], (float(cable.form.max_tension), *angles), strict=True)
    return rows_of_loads(cable)[number - 1] | dict(cells_of_cable)


def _table(rows):
    """Table of the rows, without the tensions on both sides of the load: `max_tension` is the larger one."""
    on_both_sides = [FIELDS["tension_1"], FIELDS["tension_2"]]
    fields_of_load = [field for field in fields_in(rows) if field not in on_both_sides]
    return Table((Field("fraction", "fraction", label=True), *fields_of_load, *OF_CABLE, STATUS), rows)
