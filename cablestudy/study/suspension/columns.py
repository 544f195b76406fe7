"""Columns that a suspension has: why it cannot have one, and those that a quantity of its cables stands for."""

from cablestudy.scene.fields import suggestion
from cablestudy.study.cable_columns import family_member
from cablestudy.study.column import lacking_key, without_key
from cablestudy.study.columns import COUPLED_MODE, find
from cablestudy.study.suspension.part_columns import (
    FORCES,
    OF_ONE_CABLE,
    WHOLE,
    all_cable_columns,
    body_columns,
    link_columns,
    missing_key,
    point_columns,
)
from cablestudy.study.suspension.wind_columns import wind_columns_of

# beginnings of the names of columns that bodies have for many axes or numbers
OF_BODIES = "stiffness_", "frequency_", "share_", "damping_ratio_", "linear_range_", "force_displacement_"


def why_not(scene, column):
    """Tell why a suspension cannot have a column, such as `gondola.rms_x`: one sentence, empty where it can.

    Reasons are that nothing of the name before the dot is in the scene, that this part has no such column, or that the
    scene lacks a key that the column needs.

    Parameters
    ----------
    scene : SuspensionScene
    column : Column

    Returns
    -------
    str
    """
    owner, dot, quantity = column.name.partition(".")  # owner: name of a body, point, cable, link or actuator
    if not dot:
        return _why_not_of_whole(scene, column)
    in_wind = [other.name for other in wind_columns_of(scene, column.name.rpartition(".")[0])]
    if column.name in in_wind:
        return without_key(column, lacking_key(scene, column))
    if owner in scene.actuators:
        return f"{owner} has no column {quantity} ({suggestion(column.name, in_wind)})"
    return _why_no_owner(scene, owner) or _why_not_of_owner(scene, owner, column, in_wind)


def _why_no_owner(scene, owner):
    """Reason why no part of the scene of this name has columns; empty where one has."""
    if owner in scene.points and not scene.points[owner].free:
        return f"{owner} is a fixed point, which has no columns"
    columns = _columns_of_owners(scene)
    return "" if owner in columns else f"no body, free point, cable or link {owner} ({suggestion(owner, columns)})"


def _why_not_of_owner(scene, owner, column, in_wind):
    """Reason as in `why_not` for a column at rest of a part of the scene; `in_wind` are the names of its others."""
    quantity = column.name.partition(".")[2]
    if family_member(quantity) and owner in scene.cables:
        return ""
    names = [*(other.name for other in _columns_of_owners(scene)[owner](owner)), *in_wind]
    if column.name not in names and not (owner in scene.bodies and quantity.startswith(OF_BODIES)):
        return f"{owner} has no column {quantity} ({suggestion(column.name, names)})"
    if column.key == FORCES and not scene.load_case.forces:
        return without_key(column, "cases.*.forces")
    return without_key(column, missing_key(scene, owner, column) if owner in scene.cables else "")


def of_each_cable(scene, name):
    """Name and `Column` of each cable for a quantity such as `sag`: list of pairs.

    Empty where `name` is no quantity of cables, or a column of the whole suspension.
    """
    if "." in name or any(name in (column.name, column.header) for column in WHOLE):
        return []
    try:
        return [(cable, find(f"{cable}.{name}")) for cable in scene.cables]
    except ValueError:
        return []


def _columns_of_owners(scene):
    """Name of each body, free point, cable and link -> function that lists the columns of that name."""
    junctions = [name for name, point in scene.points.items() if point.free]
    kinds = (scene.bodies, body_columns), (junctions, point_columns), (scene.cables, all_cable_columns)
    kinds = *kinds, (scene.links, link_columns)
    return {name: columns for names, columns in kinds for name in names}


def _why_not_of_whole(scene, column):
    """Reason as in `why_not`, for a column of the whole suspension, without a name before it."""
    strong = any(cable.section_breaking_force is not None for cable in scene.cables.values())
    if column.name in ("max_utilisation", "max_peak_utilisation") and not strong:
        return f"{column.name} needs the strength or breaking_force of a cable, which the scene does not have"
    if of_whole := next((other for other in WHOLE if other.name == column.name), None):
        key = "" if of_whole.name == "max_utilisation" else lacking_key(scene, of_whole)
        return without_key(column, key)
    if COUPLED_MODE.fullmatch(column.name):
        return ""
    hint = _name_of_twin(scene, column.name)
    return f"{column.name} is a column of a single cable{hint and f'; here it is {hint}'}"


def _name_of_twin(scene, name):
    """Name that a column of one cable has in a suspension, with CABLE and BODY if there are several; empty for none."""
    twin = f"CABLE.{name}" if family_member(name) else OF_ONE_CABLE.get(name, "")
    for word, names in (("CABLE", scene.cables), ("BODY", scene.bodies)):
        if len(names) == 1:
            twin = twin.replace(word, *names)
    return twin
