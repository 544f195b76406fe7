"""Vibration of cables in the wind by rules for power lines: lock-in with vortices, safe tension, galloping."""

from dataclasses import replace

import numpy as np

from cablestudy.motion.airflow import wind_diameters
from cablestudy.study.columns import find
from cablestudy.study.table import Field
from cablestudy.study.tolerances import STUDY
from cablestudy.system.comparison import first_of_largest
from cablestudy.wind.drag import STROUHAL

LOCK_IN = Field("lock_in_speed_m_per_s", "lock-in speed", "m/s")
AXIAL = "axial"  # kind of the modes that vortices do not drive
SAFE = (
    "safe for a single aluminium conductor without dampers are up to 1000 m (open and flat, with snow or near water), "
    "1125 m (open and flat), 1225 m (few obstacles), 1425 m (trees, buildings), at the mean temperature of the coldest "
    "month, before creep (CIGRE Technical Brochure 273, 2005)"
)
ALUMINIUM = ("acsr-", "aac-")  # built-in materials that these values are for, as their names begin
OTHERS = "for another material no published value is known here"


def with_lock_in(table, diameters):
    """Add to a table of modes the wind speed at which each may lock in with vortices: v = f D/St, with St = 0.2.

    Parameters
    ----------
    table : Table
        A row for each mode, with its frequency f.
    diameters : sequence of float or None
        Diameter D of the cable that moves in each mode, ice included; None where no cable moves across its axis, or the
        diameter is not known. [m]

    Returns
    -------
    Table
        Unchanged where no diameter is known.
    """
    if not any(diameters):
        return table
    rows = [
        row | {LOCK_IN.name: row["frequency_Hz"] * diameter / STROUHAL if diameter else None}
        for row, diameter in zip(table.rows, diameters, strict=True)
    ]

    def errors():
        for row, errors_of_row in zip(rows, table.errors(), strict=True):
            has_error = row[LOCK_IN.name] is not None and "frequency_Hz" in errors_of_row
            yield errors_of_row | ({LOCK_IN.name: errors_of_row["frequency_Hz"]} if has_error else {})

    return replace(table, fields=(*table.fields, LOCK_IN), rows=rows, errors=errors)


def diameters_of_modes(table, diameter):
    """The diameter for each mode of one cable in a table, see `with_lock_in`: list."""
    return [None if row["type"] == AXIAL else diameter for row in table.rows]


def diameters_of_coupled_modes(table, scene):
    """The diameter for each coupled mode of a `SuspensionScene` in a table, see `with_lock_in`: list.

    Of the cable that moves most; of a mode of several cables where they have one diameter.
    """
    of_cables = dict(zip(scene.cables, wind_diameters(scene).tolist(), strict=True))
    common = next(iter(of_cables.values())) if len(set(of_cables.values())) == 1 else None
    modes_of_rows = [row["moves"].rpartition(" ") for row in table.rows]
    return [common if not name and kind == "cables" else None if kind == AXIAL else of_cables.get(name)
            for name, _, kind in modes_of_rows]  # fmt: skip


def galloping_notes(load_case):
    """A note on Den Hartog's criterion, dC_L/dalpha + C_D < 0, of the ice of a load case; tuple of str, at most one.

    Den Hartog (1932), Transactions of the AIEE 51, 1074.
    """
    ice = load_case.ice
    if ice is None or ice.lift_slope is None:
        return ()
    damping = ice.lift_slope + ice.drag_coefficient
    verdict = (
        "below 0: with this ice the cable may gallop, in modes across the wind; amplitudes are not computed"
        if damping < 0
        else "not below 0: with this ice it does not gallop across the wind without twisting"
    )
    return (f"note: Den Hartog's criterion: dC_L/dalpha + C_D = {damping:.4g}, {verdict}",)


def tension_notes(scene, values):
    """Note on the largest ratio H/w of the cables of a scene: horizontal tension over weight per length.

    Power lines with a larger H/w than published safe values are likely to suffer from aeolian vibration. There is no
    note in a load case with ice or wind, since the safe values are for everyday tensions; nor without gravity, nor
    where no cable has a horizontal tension. Returns a tuple of str, at most one; `values` are the statics of this scene
    alone, `Results` or `CableResults`.
    """
    only_links = not scene.cables
    if only_links or scene.nonzero_gravity is None or scene.load_case.ice or scene.load_case.wind:
        return ()
    constants = np.ravel(find("catenary_constant").compute(values))
    index = first_of_largest(constants, STUDY.equal_values)
    name, largest = list(scene.cables)[index], float(constants[index])
    of_cable, material = f" of {name}" if len(constants) > 1 else "", scene.cables[name].material
    if material is None or material in scene.materials:
        safe = f"{SAFE}; {OTHERS}"
    elif material.startswith(ALUMINIUM):
        safe = SAFE
    else:
        safe = f"for {material} no published safe value is known here (those of CIGRE are for aluminium conductors)"
    return (f"horizontal tension over weight per length{of_cable}: {largest:.4g} m; {safe}",) if largest > 0 else ()
