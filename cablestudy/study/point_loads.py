"""Point loads on cables in equilibrium: positions, slopes and tensions of the cable on both sides."""

import numpy as np

from cablestudy.cable.geometry import below_chord, heights_above, points_along, tensions_at_point_loads
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import NoSolutionError
from cablestudy.scene.load_tables import load_name
from cablestudy.study.column import SHAPELESS
from cablestudy.study.table import Field, Table

# quantity of each load in a table -> unit; 1 is the side of end 1, slopes are positive where the cable rises to end 2
UNITS = {"x": "m", "y": "m", "z": "m", "sag": "m", "clearance": "m", "slope_1": "deg", "slope_2": "deg",
         "tension_1": "N", "tension_2": "N"}  # fmt: skip
NO_GROUND = "no clearance: the ground is not known there"
FIELDS = {name: Field(f"{name}_{unit}", name.replace("_", " "), unit) for name, unit in UNITS.items()}


def rows_of_loads(cable):
    """Cells of a table of the point loads on a cable: position, slope and tension of the cable on both sides of each.

    `sag` is the vertical distance from the chord down to the load, `clearance` that from the load down to the ground:
    None where the ground is not known there, and left out if the scene has no ground. `slope_1` and `tension_1` are on
    the side of end 1, `slope_2` and `tension_2` on that of end 2; a slope is positive where the cable rises towards
    end 2.

    Parameters
    ----------
    cable : CableCase or HangingCable

    Returns
    -------
    list of dict
        For each load, in the order of the file: header of FIELDS (name and unit) -> number.
    """
    loads, ground = cable.scene.loads, cable.scene.ground
    # arc lengths of the loads over the unstretched length
    shares = np.array([load.at / cable.reference_length if load.fraction is None else load.fraction for load in loads])
    from_end_1 = points_along(cable.form, shares)
    rounding = CABLE.distance_rounding * np.asarray(cable.form.span.chord)
    from_end_1 = np.where(np.abs(from_end_1) > rounding, from_end_1, 0.0)
    # tension: vectors on the sides of end 1 and end 2, shape (loads, 2, 3)
    positions, tension = from_end_1 + cable.end_1, tensions_at_point_loads(cable.form, shares)
    columns = dict(zip("xyz", positions.T, strict=True)) | {"sag": below_chord(cable.form, shares, from_end_1)}
    if ground is not None:
        columns["clearance"] = heights_above(positions, ground)
    slopes = np.degrees(np.arctan2(tension[..., 2], np.hypot(tension[..., 0], tension[..., 1])))
    on_both_sides = (*slopes.T, *np.sqrt((tension**2).sum(axis=-1)).T)
    columns |= dict(zip(("slope_1", "slope_2", "tension_1", "tension_2"), on_both_sides, strict=True))
    headers = [FIELDS[name].name for name in columns]
    numbers = (np.stack(list(columns.values()), axis=-1) + 0.0).tolist()
    return [{h: None if np.isnan(n) else n for h, n in zip(headers, row, strict=True)} for row in numbers]


def loaded_cables(case):
    """The cables of a `CableCase` or `SuspensionCase` that carry point loads.

    Returns
    -------
    dict
        Name of the cable in a suspension, empty of the only one -> `HangingCable` or `CableCase`.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium, or a cable has no definite form.
    """
    cables = {}
    for name in dict.fromkeys(load.rpartition(".")[0] for load in case.scene.load_paths):
        cable = cables[name] = case.hanging(name)
        if cable.exact_statics and cable.form.slack:
            raise NoSolutionError(f"{name}: {SHAPELESS}" if name else SHAPELESS)
    return cables


def loads_table(cables, failures):
    """Table with a row for each load on some `loaded_cables`; reasons for empty cells are appended to `failures`."""
    numbered = [(name, *pair) for name, cable in cables.items() for pair in enumerate(rows_of_loads(cable), 1)]
    rows = [{"load": load_name(name, number), **row} for name, number, row in numbered]
    failures += [f"{row['load']}: {NO_GROUND}" for row in rows if lacks_clearance(row)]
    return Table((Field("load", "load", label=True), *fields_in(rows)), rows)


def fields_in(rows):
    """Fields of the table, those of FIELDS for which some row has a cell: list."""
    return [field for field in FIELDS.values() if any(field.name in row for row in rows)]


def lacks_clearance(row):
    """True if the ground under the load of a row is not known, though the scene has one."""
    return row.get(FIELDS["clearance"].name, 0.0) is None
