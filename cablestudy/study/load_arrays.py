"""Point loads of cables as arrays with an axis of cables, and how many positions they have."""

from operator import add

import numpy as np

NO_LOAD = np.nan, np.nan, (0.0, 0.0, 0.0), 0.0  # an entry of `merged_loads` where a cable has fewer loads than others


def load_arrays(loads_of_cables):
    """Point loads of n cables as arrays; loads of one cable at the same position are added.

    k is the largest number of loaded positions on a cable; the other cables have empty entries at the end.

    Parameters
    ----------
    loads_of_cables : list of tuple of Load
        For each cable its loads.

    Returns
    -------
    positions : ndarray, shape (n, k)
        Arc length from end 1 on the unstretched cable; NaN of a load whose fraction is stated, and of an empty entry.
        [m]
    fractions : ndarray, shape (n, k)
        Share of the unstretched length; NaN of a load whose arc length is stated, and of an empty entry. [-]
    forces : ndarray, shape (n, k, 3)
        Global axes, without the weight of `masses`. [N]
    masses : ndarray, shape (n, k)
        [kg]
    """
    if not any(loads_of_cables):
        return tuple(np.zeros((len(loads_of_cables), 0, *size)) for size in ((), (), (3,), ()))
    merged = [merged_loads(loads) for loads in loads_of_cables]
    count = max(map(len, merged))
    entries = [load for loads in merged for load in (*loads, *[NO_LOAD] * (count - len(loads)))]
    positions, fractions, forces, masses = map(np.array, zip(*entries, strict=True))
    shape = len(merged), count
    return positions.reshape(shape), fractions.reshape(shape), forces.reshape(*shape, 3), masses.reshape(shape)


def merged_loads(loads):
    """(position, fraction, force, mass) of point loads, those at one position added, ascending from end 1."""
    merged = {}
    for load in loads:
        position = np.nan if load.at is None else load.at, np.nan if load.fraction is None else load.fraction
        key, mass = (load.at, load.fraction), 0.0 if load.mass is None else load.mass
        force = (0.0, 0.0, 0.0) if load.force is None else load.force
        if key in merged:
            *_, other_force, other_mass = merged[key]
            force, mass = tuple(map(add, other_force, force)), other_mass + mass
        merged[key] = (*position, force, mass)
    return sorted(merged.values(), key=lambda load: load[:2])


def load_count(scene):
    """Number of positions at which the cable carries point loads, in the reference state and in its load case. [-]"""
    return (position_count(scene.cable.loads), position_count(loads)) if (loads := scene.loads) else (0, 0)


def position_count(loads):
    """Number of positions of point loads. [-]"""
    return len({(load.at, load.fraction) for load in loads}) if loads else 0
