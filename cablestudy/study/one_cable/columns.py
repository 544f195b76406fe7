"""Columns of suspensions for a scene of one cable.

Such a column is one of one cable by another name, or it is computed for the cable, with its gondola if it has one, as a
case of a suspension.
"""

from dataclasses import replace
from functools import cache, cached_property

import numpy as np

from cablestudy.scene.one_cable import CABLE, GONDOLA, as_suspension
from cablestudy.study.cable_columns import family_member, is_of_one_cable
from cablestudy.study.column import attribute, lacking_key, without_key
from cablestudy.study.columns import find
from cablestudy.study.motion_columns import check_winch_speed
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.rows import evaluate_cases
from cablestudy.study.one_cable.system import equilibria_of
from cablestudy.study.refinement import reference_scene
from cablestudy.study.suspension import columns as of_suspensions
from cablestudy.study.suspension import part_columns
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.equilibrium_errors import EquilibriumErrors
from cablestudy.study.suspension.group import Group
from cablestudy.study.tolerances import STUDY


def _by_twin(twins):
    """Name of a column in a suspension -> its name in a scene of one cable, from `TWINS` or a like table: dict."""
    return {twin.replace("CABLE", CABLE).replace("BODY", GONDOLA): own for own, twin in twins.items()}


# name of a column in a suspension -> its name in a scene of one cable
ALIASES = {
    "cable_mass": "mass",
    "max_utilisation": "utilisation",
    f"{GONDOLA}.stiffness_zx": "end_stiffness_xz",
    **_by_twin(part_columns.TWINS),
}
# likewise, of a cable with fixed ends only
OF_BARE_CABLE = _by_twin(part_columns.TWINS_OF_BARE_CABLE) | {"max_peak_utilisation": "peak_utilisation"}
# keys of a suspension -> those of a scene of one cable
KEYS = {"control": "winch.controller", f"cables.{CABLE}.section_breaking_force": "cable.section_breaking_force"}


@cache
def name_in_one_cable(name, bare):
    """The name that a column of suspensions has in a scene of one cable, `bare` without a gondola; empty for none."""
    owner, _, quantity = name.partition(".")
    if owner == CABLE and family_member(quantity):
        return quantity
    return ALIASES.get(name, OF_BARE_CABLE.get(name, "") if bare else "")


def column_of_one_cable(column, bare):
    """Translate a column of suspensions (many cables and bodies) for a scene of one cable: `Column`.

    It is replaced by the column of one cable for the same quantity: `gondola.frequency_x` by `gondola_frequency`. Where
    there is none, the result is a new column, which treats the cable and its gondola as a suspension. A column of one
    cable is returned as it is.

    Parameters
    ----------
    column : Column
        Column of one cable or of suspensions.
    bare : bool
        Whether the scene has no gondola.
    """
    if is_of_one_cable(column):
        return column
    if name := name_in_one_cable(column.name, bare):
        return find(name)
    # stage of a suspension -> stage of one cable, where coupled modes are those of a gondola, if there is one, and each
    # suspension is made about an equilibrium
    needs = {"modes": "gondola", "scene": "statics"}.get(column.needs, column.needs)
    closed_loop = column.needs == "wind" and "_open_loop" not in column.name

    def compute(case):
        if closed_loop:
            check_winch_speed(case)
        suspension = suspension_of(case)
        result = column.compute(suspension)
        return result if isinstance(result, tuple) else (result, suspension.statics_error(column))

    follows_drag = column.follows_drag or column.needs == "modes"
    changes = {"needs": needs, "compute": compute, "each": True, "mode": (), "follows_drag": follows_drag}
    return replace(column, key=_keys(column, bare), **changes)


def _keys(column, bare):
    """Keys of a scene of one cable, `bare` without a gondola, that a column of suspensions needs."""
    keys = [*([] if bare else [f"{GONDOLA}.mass"]), *(KEYS.get(key, key) for key in column.keys)]
    return ", ".join([*keys, f"{GONDOLA}.area", f"{GONDOLA}.drag_coefficient"] if column.needs == "wind" else keys)


def why_not(scene, column):
    """Reason for which a scene of one cable cannot have a column; empty where it can."""
    bare = scene.gondola is None
    own_column, owners = column_of_one_cable(column, bare), {CABLE, "", *([] if bare else [GONDOLA])}
    owner = "" if is_of_one_cable(column) else column.name.rpartition(".")[0]
    if owner in scene.cases:
        name = column.name.partition(".")[2]
        return f"{owner} is a load case: --case {owner}, or vary: [{{case: [{owner}]}}], has the column {name}"
    if owner in owners:
        if own_column.without and attribute(scene, own_column.without) is not None:
            return f"{column.name} is of a cable with fixed ends: the scene must not have the key {own_column.without}"
        if key := lacking_key(scene, own_column):
            return without_key(column, key)
        if is_of_one_cable(column) or name_in_one_cable(column.name, bare):
            return ""
    return of_suspensions.why_not(as_suspension(scene), column)


def evaluate(scenes, columns, estimate=False):
    """Rows as in `rows.evaluate_cases`, with columns of suspensions too: cells have the headers asked for."""
    bare = all(scene.gondola is None for scene in scenes)
    own_columns = {column.header: column_of_one_cable(column, bare) for column in columns}
    rows = evaluate_cases(scenes, list({column.header: column for column in own_columns.values()}.values()), estimate)
    if all(header == column.header for header, column in own_columns.items()):
        return rows
    return [_with_asked_headers(row, own_columns) for row in rows]


def _with_asked_headers(row, own_columns):
    """A row with other headers: `own_columns` is header asked for -> the column computed for it."""
    headers = {header: column.header for header, column in own_columns.items()}
    cells = {header: row.cells[computed] for header, computed in headers.items()}
    errors = {header: row.errors[computed] for header, computed in headers.items() if computed in row.errors}
    return replace(row, cells={**cells, "status": row.cells["status"]}, errors=errors)


# ----------------------------------------------------------- one cable, with its gondola or without, as a suspension


class OneCableGroup(Group):
    """A `Group` of one case whose body, if it has one, is held where end 2 of its cable is.

    Its errors of statics are those of the cable: that by a drag which changes along the cable is among them, since rows
    of one cable add it to the errors of motion. The position of end 2 has none.

    Parameters
    ----------
    case : CableCase
        With an equilibrium.
    """

    def __init__(self, case):
        self._case = case
        super().__init__([as_suspension(case.scene)])
        rounding = np.array([max(STUDY.rounding, case.statics_error)])
        self.errors = EquilibriumErrors(self.reference, self.reference, None, rounding)

    def _reference_state(self, _):
        """No conductors, whose errors are in those of the case, and its equilibrium."""
        return None, equilibria_of([self._case]), [""]

    def _loaded_state(self):
        """None, since that equilibrium is under the loads of the case."""

    def failure(self, _):
        """None, since the case has an equilibrium."""

    @property
    def mode_errors(self):
        """Relative error of all frequencies by what the equilibrium leaves out, shape (1,). [-]"""
        return np.array([self._case.mode_error])

    def steady_drag(self, _):
        """Drag of the steady wind on the cable, as `FixedModel.drag`."""
        return self._case.results.drag.take([self._case.index])


class OneCableAsSuspension(SuspensionCase):
    """`SuspensionCase` of a `CableCase`, for columns that only a suspension has a function for."""

    def __init__(self, case):
        case.results.check(case.index)
        super().__init__(as_suspension(case.scene), OneCableGroup(case))
        self._case = case

    @cached_property
    def finer(self):
        """`OneCableAsSuspension` with a model to the accuracy `reference_accuracy`, for comparison."""
        return suspension_of(CableCase(reference_scene(self._case.scene)))

    @property
    def analysis(self):
        """`DynamicAnalysis` of the gondola with its winch loop, and in the wind on it."""
        return self._case.analysis


def suspension_of(case):
    """The `OneCableAsSuspension` of a case, made once."""
    if "suspension" not in case.computed:
        case.computed["suspension"] = OneCableAsSuspension(case)
    return case.computed["suspension"]
