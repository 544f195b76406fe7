"""Columns of the parts of a suspension at rest and of its modes: of a body, free point, cable or link, and of all.

`gondola.x`, `n1.max_tension`: the name of a part, a dot and a quantity; those in the wind are in `wind_columns`.
Functions take a `SuspensionCase` and return a number, or a number and its estimated relative error.
"""

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from cablestudy.cable.geometry import chord_angles
from cablestudy.errors import NoSolutionError
from cablestudy.statics.suspension import AXES
from cablestudy.study.cable_columns import COLUMNS
from cablestudy.study.column import Column, first_without_value
from cablestudy.study.suspension.numbers import SingleCable
from cablestudy.study.suspension.wind_columns import LOOP, PEAK_UTILISATION, WINCHES

# columns of a single cable -> those that cables of a suspension have instead
INSTEAD = {"tension_1": "tension_from", "tension_2": "tension_to"}
# columns of a single cable that a cable of a suspension has too; the others are of its ends along x, or of loads on it
OF_CABLES = tuple(
    column
    for column in COLUMNS
    if column.needs in ("scene", "statics")
    and (not column.key or column.key.startswith("cable.section_"))
    and column.name not in ("iterations", *INSTEAD)
)
# name -> column of a cable that is in no table of the command static; with another meaning where one is stated here
FURTHER_OF_CABLES = {
    column.name: replace(column, meaning=meaning or column.meaning)
    for name, meaning in {
        "end_stiffness_along": "static stiffness along the chord, one end held",
        "deflection": "displacement of the point load that moves most, along its force, from the unloaded form between "
        "the same ends",
        "linear_deflection": "",
        "nonlinearity": "",
        "load_sag": "",
        "catenary_constant": "",
        "shedding_frequency": "",
        "shedding_frequency_low": "",
        "shedding_frequency_high": "",
    }.items()
    for column in COLUMNS
    if column.name == name
}
# column of one cable -> that of a cable or a body of a suspension, for their names CABLE and BODY
TWINS = {
    **{own: f"CABLE.{twin}" for own, twin in INSTEAD.items()},
    **{column.name: f"CABLE.{column.name}" for column in (*OF_CABLES, *FURTHER_OF_CABLES.values())},
    "clearance": "CABLE.clearance",
    **{f"end_stiffness{end}": f"BODY.stiffness_{axes}" for end, axes in {
        "": "xx", "_yy": "yy", "_zz": "zz", "_xz": "xz"}.items()},
    **{f"gondola_{name}": f"BODY.{name}_x" for name in ("frequency", "share", "damping_ratio")},
    "mean_displacement": "BODY.mean_x",
    **{name: f"BODY.{name}_x" for name in ("linear_range", "force_displacement")},
    **{name: f"BODY.{name}" for name in ("peak", "exposure", "corrected", "corrected_exposure")},
}  # fmt: skip
# likewise, of a cable with fixed ends only
TWINS_OF_BARE_CABLE = {
    "tension_rms": "CABLE.rms_tension",
    **{name: f"CABLE.{name}" for name in ("midspan_rms", "slack_probability", "least_tension", "peak_utilisation")},
}
# all of these, and columns of one cable to which those of a suspension come near
OF_ONE_CABLE = {
    **TWINS,
    **TWINS_OF_BARE_CABLE,
    "cable_frequency": "CABLE.inplane_frequency_1",
    "gondola_frequency_static": "BODY.frequency_static_1",
    **{f"gondola_rms{state}": f"BODY.rms_x{state}" for state in ("", "_open_loop")},
    **{f"gondola_rms_velocity{state}": f"BODY.rms_velocity{state}" for state in ("", "_open_loop")},
}
TENSIONS = tuple(
    replace(column, name=INSTEAD[column.name], meaning=f"tension at the end `{INSTEAD[column.name][8:]}`")
    for column in COLUMNS
    if column.name in INSTEAD
)
CLEARANCE = next(column for column in COLUMNS if column.name == "clearance")
LOWEST_POINT = next(column for column in COLUMNS if column.name == "lowest_point")
INCLINATION = Column(
    "inclination", "deg", "angle of the chord above the horizontal, from `from` to `to`", "statics",
    lambda results: np.degrees(chord_angles(results.span.frame[..., 0, :])[0]),
)  # fmt: skip
CABLE_MASS = next(column for column in OF_CABLES if column.name == "mass")
ANGLES = ("roll", "pitch", "yaw")
UNITS = {(False, False): "N/m", (False, True): "N/rad", (True, False): "N", (True, True): "N m/rad"}
FORCES = "load_case.forces"


# ------------------------------------------------------------------------------------------------- of one cable


def missing_key(scene, cable, column):
    """The first key that a column of the cable of a name needs and a scene has no value for, or an empty text."""
    own = f"cables.{cable}."
    keys = [key.replace(own, "cable.") for key in column.keys]
    return first_without_value(SingleCable(scene, cable), keys).replace("cable.", own, 1) if keys else ""


def _of_cable(column, name):
    """Column of the quantity of a `column` of single cables, for the cable `name` of a suspension: `Column`."""

    def compute(case):
        if key := missing_key(case.scene, name, named):
            raise NoSolutionError(f"{named.name} needs the key {key}, which this case does not have")
        if column.determined_by:
            _refuse_shapeless(case, name)
        if column is CLEARANCE and isinstance(case.scene.ground, float):  # of all cables at once
            return case.of_cables(LOWEST_POINT)[case.cable(name)] - case.scene.ground
        if column.each:
            return column.compute(case.hanging(name))
        stated = column.needs == "scene"
        return case.stated_of_cable(column, name) if stated else case.of_cables(column)[case.cable(name)]

    key = column.key.replace("cable.", f"cables.{name}.")
    named = replace(column, name=f"{name}.{column.name}", compute=compute, key=key)
    return named


def _refuse_shapeless(case, name):
    """Raise where a cable is slack and has no weight: it may lie in any form between its ends."""
    if case.form.slack[case.cable(name)]:
        raise NoSolutionError(
            f"{name} is slack and without weight: it has no definite form, so no sag, swing, lowest point, clearance "
            "or angles at its ends"
        )


def cable_mode_column(column, name):
    """Column of the frequency of a mode, a `column` of single cables, for the cable `name` with its ends fixed."""
    return replace(column, name=f"{name}.{column.name}", meaning=f"{column.meaning}, ends fixed",
                   compute=lambda case: case.cable_modes.frequency(name, column))  # fmt: skip


def cable_columns(name):
    """The columns of one cable in the tables of the command static: list of Column."""
    return [_of_cable(column, name) for column in (*OF_CABLES, *TENSIONS, INCLINATION, CLEARANCE)]


@lru_cache(maxsize=64)
def all_cable_columns(name):
    """The columns of one cable without its tension in the wind: tuple of Column."""
    return *cable_columns(name), *(_of_cable(column, name) for column in FURTHER_OF_CABLES.values())


# ----------------------------------------------------------------------------------------- of a body or a free point


def _coordinate(name, axis):
    """Column of a coordinate of a body or free point."""
    return Column(f"{name}.{'xyz'[axis]}", "m", f"position of its reference point along {'xyz'[axis]}", "statics",
                  lambda case: case.coordinate(name, axis))  # fmt: skip


def _angle(name, axis):
    """Column of roll, pitch or yaw of a body."""

    def compute(case):
        value, error = case.coordinate(name, 3 + axis)
        return np.degrees(value), error

    meaning = f"{ANGLES[axis]} of the attitude R = Rz(yaw) Ry(pitch) Rx(roll)"
    return Column(f"{name}.{ANGLES[axis]}", "deg", meaning, "statics", compute)


def _mass(name):
    """Column of the mass of a body, free point, or cable."""

    def compute(case):
        scene = case.scene
        if name in scene.cables:  # whose column has the same name
            return case.of_cables(CABLE_MASS)[case.cable(name)], case.statics_error(CABLE_MASS)
        return scene.bodies[name].mass if name in scene.bodies else scene.points[name].mass

    return Column(f"{name}.mass", "kg", "mass of the body or point", "scene", compute)


def stiffness_column(name, row, column):
    """Column of an entry of the stiffness matrix of a body; row and column are names of AXES."""
    indices, unit = (AXES.index(row), AXES.index(column)), UNITS[len(row) == 2, len(column) == 2]
    meaning = f"force or moment {row} per displacement or rotation {column} of its reference point, all loads included"
    return Column(f"{name}.stiffness_{row}{column}", unit, meaning, "stiffness",
                  lambda case: case.stiffness_entry(name, *indices))  # fmt: skip


def body_frequency_column(name, number):
    """Column of the frequency of a mode with most of its kinetic energy in a body."""

    def compute(case):
        modes, index = case.mode_of(name, number)
        return modes.frequency[index], case.mode_errors(modes)[index]

    meaning = "frequency of the K-th mode with more than half of its kinetic energy in the body"
    return Column(f"{name}.frequency_{number}", "Hz", meaning, "modes", compute)


def force_displacements(name):
    """The columns of the displacements of a body or free point by the forces of a load case: list of Column."""

    def compute(case, axis):
        displacement, error = case.force_displacement(name, axis)
        return 1e3 * displacement, error

    return [
        Column(f"{name}.force_displacement_{axis}", "mm", f"displacement along {axis} by the forces of the load case, "
               "its other loads acting throughout", "statics", partial(compute, axis=number), FORCES)
        for number, axis in enumerate(AXES[:3])
    ]  # fmt: skip


def mode_columns(name):
    """The columns of the mode of a body or free point along each axis: list of Column."""
    return [column for axis in AXES for column in _mode_along(name, axis)]


def _mode_along(name, axis):
    """Yield columns of the mode in which a body or point moves most along an axis: frequency, share, damping ratio.

    It is the mode with the largest share in the static compliance 1/k along the axis: phi^2/w^2 over 1/k, with the
    movement phi of the body in the mode of angular frequency w.

    Parameters
    ----------
    name : str
        Name of the body or free point.
    axis : str
        One of `AXES`: x, y, z for displacements, rx, ry, rz for rotations.

    Yields
    ------
    Column
    """
    axis_index = AXES.index(axis)

    def with_drag(case, number_and_error, mixed=True):
        """A number, and its relative error increased by that by drag (`Group.mode_errors`).

        `mixed` numbers are those of the shape of the mode, which that drag mixes with others.
        """
        (number, error), by_drag = number_and_error, case.group.mode_errors[case.index]
        if mixed and by_drag:
            by_drag += case.mode_along(name, axis_index).error_by_mixing(by_drag)
        return number, error + by_drag

    of_compliance = f"of its static compliance {f'about {axis[1]}' if axis_index > 2 else f'along {axis}'}"
    yield Column(f"{name}.frequency_{axis}", "Hz", f"coupled mode with the largest share {of_compliance}", "modes",
                 lambda case: with_drag(case, case.mode_along(name, axis_index).frequency, mixed=False))  # fmt: skip
    yield Column(f"{name}.share_{axis}", "", f"share {of_compliance} in that mode, phi^2/w^2 over 1/k", "modes",
                 lambda case: with_drag(case, case.mode_along(name, axis_index).share))  # fmt: skip
    yield Column(f"{name}.damping_ratio_{axis}", "", "damping ratio of that mode, winches at rest, with aerodynamic "
                 "damping where the scene has wind", "modes",
                 lambda case: with_drag(case, case.mode_along(name, axis_index).damping_ratio))  # fmt: skip


def static_frequency_column(name, number):
    """Column of a frequency of a body on its static stiffness."""

    def compute(case):
        frequencies = case.static_frequencies(name)
        if number > len(frequencies):
            raise NoSolutionError(f"{name} has {len(frequencies)} free displacements, not {number}")
        return frequencies[number - 1]

    meaning = "frequency on the static stiffness, with a third of its cables' mass, other bodies held; K from 1 to 6"
    return Column(f"{name}.frequency_static_{number}", "Hz", meaning, "stiffness", compute)


def linear_ranges(name):
    """The columns of the linear ranges of a body or free point along x, y and z: list of Column."""

    def compute(case, axis):
        displacement, error = case.linear_range(name, axis)
        return (None if displacement is None else 1e3 * displacement), error + case.statics_error(None)

    return [
        Column(f"{name}.linear_range_{axis}", "mm", f"displacement along {axis}, of either sign, at which the "
               "restoring force of its cables differs by 5 % from linear, all else held; empty where it does not",
               "stiffness", partial(compute, axis=number))
        for number, axis in enumerate(AXES[:3])
    ]  # fmt: skip


def point_columns(name):
    """The columns of a free point: list of Column."""
    statics = [*(_coordinate(name, axis) for axis in range(3)), _mass(name), *linear_ranges(name)]
    return [*statics, *force_displacements(name), *(column for axis in AXES[:3] for column in _mode_along(name, axis))]


def body_columns(name):
    """The columns of a body, without the entries of its stiffness and its frequencies: list of Column."""
    return [*(_coordinate(name, axis) for axis in range(3)), *(_angle(name, axis) for axis in range(3)), _mass(name)]


def link_columns(name):
    """The columns of a link at rest: list of Column."""
    return [
        Column(f"{name}.force", "N", "force along the link, positive where it pulls", "statics",
               lambda case: case.link(name)[:2]),
        Column(f"{name}.length", "m", "distance of the two places of the link", "statics",
               lambda case: case.link(name)[2]),
    ]  # fmt: skip


# ------------------------------------------------------------------------------------------ of the whole suspension


def frequency_column(number):
    """Column of a frequency of the whole suspension."""
    return Column(f"frequency_{number}", "Hz", "K-th frequency of the whole suspension", "modes",
                  lambda case: case.frequency(number), mode=(number,))  # fmt: skip


def _over_all(name, unit, meaning, values, extreme, key="", of_reference=False):
    """Column of the least, largest or sum, by a ufunc `extreme`, of numbers of all cables that have them.

    `values` is a function of `CableResults` for these numbers, shape (n, c), NaN where a cable has none.
    """

    def compute(case):
        group = case.group
        return group.cables.over_all(name, values, extreme)[case.index] if group.cable_indices else None

    return Column(name, unit, meaning, "statics", compute, key, of_reference=of_reference)


WHOLE = (
    *LOOP,
    *WINCHES,
    _over_all("min_tension", "N", "smallest tension in any cable", lambda r: r.statics.min_tension, np.fmin),
    _over_all("max_tension", "N", "largest tension in any cable", lambda r: r.statics.max_tension, np.fmax),
    _over_all("max_utilisation", "", "largest tension over breaking force of any cable", lambda r: r.utilisation,
              np.fmax, "cables.*.section_breaking_force"),
    PEAK_UTILISATION,
    _over_all("cable_mass", "kg", "mass of all cables", CABLE_MASS.compute, np.add, of_reference=True),
    *(replace(column, compute=lambda case: int(case.equilibrium.record.steps))
      for column in COLUMNS if column.name == "iterations"),
    *(column for column in COLUMNS if column.needs in ("limits", "run")),
)  # fmt: skip
