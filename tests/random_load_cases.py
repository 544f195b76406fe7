"""Random load cases over the whole range of their keys, and the same cables by the 50-digit catenary."""

import math

import numpy as np
from mpmath import mp
from references import catenary_mp

UPRIGHT = math.pi / 2


def power(rng, low, high):
    """A number of any magnitude between two powers of ten."""
    return float(10 ** rng.uniform(low, high))


def scene_data(seed):
    """The keys of random scene number `seed` with one load case: temperature, ice, wind and point loads."""
    rng = np.random.default_rng(seed)
    chord, mass = power(rng, -1, 4), power(rng, -3, 2)
    angle = float(rng.choice([0.0, rng.uniform(-1.5, 1.5), UPRIGHT, -UPRIGHT], p=[0.3, 0.5, 0.1, 0.1]))
    stiffness = mass * 9.81 * chord * power(rng, 1, 6)
    cable = {
        "chord": chord, "inclination": angle, "axial_stiffness": stiffness, "mass_per_length": mass,
        "diameter": power(rng, -4, -0.5), "breaking_force": 0.01 * stiffness,
        "expansion": float(rng.choice([1, -1])) * power(rng, -6, -3), "loads": _loads(rng),
        "reference": {"loads": bool(rng.random() < 0.3)},
    }  # fmt: skip
    form = rng.choice(["length", "preload", "tension"], p=[0.6, 0.2, 0.2])
    if form == "length":
        cable["unstretched_length"] = chord * float(rng.choice([1 - power(rng, -6, -1.5), 1 + power(rng, -6, 0.5)]))
    elif form == "preload":
        cable["preload"] = stiffness * power(rng, -6, -2)
    else:
        at = str(rng.choice(["end_1", "end_2", "horizontal", "mean", "max"]))
        cable["tension"] = {"at": at, "value": stiffness * power(rng, -6, -2)}
    data = {"cable": cable, "cases": {"day": _day(rng)}, "case": "day", "ground": float(rng.choice([-1e3, 0.0]))}
    if rng.random() < 0.3:
        data["ground"] = [[-1e6, -5.0], [0.0, 0.0], [chord / 3, chord / 10], [1e6, 7.0]]
    if rng.random() < 0.15:
        data["gravity"] = float(rng.choice([0.0, power(rng, -6, 3)]))
    return data


def _loads(rng):
    """Up to two loads: masses of 1e-12 to 1e9 kg and forces, also next to the ends."""
    loads = []
    for _ in range(rng.choice([0, 1, 2])):
        fraction = rng.choice([power(rng, -12, -1), 1 - power(rng, -12, -1), rng.uniform(0.01, 0.99)])
        load = {"fraction": float(np.clip(fraction, 1e-12, 1 - 1e-12))}
        if rng.random() < 0.7:
            load["mass"] = power(rng, -12, 9)
        else:
            load["force"] = [float(part) * power(rng, -6, 6) for part in rng.normal(size=3)]
        loads.append(load)
    return loads


def _day(rng):
    """A load case: any temperature, ice up to the span and beyond, winds up to 1e6 m/s."""
    day = {}
    if rng.random() < 0.8:
        day["temperature"] = float(rng.choice([73.15, 1273.15, 60, 5000, rng.uniform(60, 1500)]))
    kind = rng.random()
    if kind < 0.4:
        day["ice"] = {"thickness": power(rng, -4, 3), "density": power(rng, -3, 4)}
    elif kind < 0.6:
        day["ice"] = {"weight": power(rng, -6, 9)}
    if rng.random() < 0.6:
        wind = {"direction": float(rng.choice([0, UPRIGHT, rng.uniform(-6, 6)]))}
        wind |= {"speed": power(rng, -3, 6)} if rng.random() < 0.5 else {"pressure": power(rng, -6, 12)}
        if rng.random() < 0.3:
            wind["cable_drag_coefficient"] = float(rng.choice([0, power(rng, -3, 3)]))
        day["wind"] = wind
    return day


@mp.workdps(60)
def truth(data):
    """Tensions and reactions [N] of a scene that states its length, by the 50-digit catenary; None where it has none.

    The uniform drag is that of the chord. ArithmeticError: no convergence.
    """
    cable, day, gravity = data["cable"], data["cases"]["day"], mp.mpf(data.get("gravity", 9.81))
    upright = abs(cable["inclination"]) == UPRIGHT
    cosine, sine = (0, np.sign(cable["inclination"])) if upright else (
        mp.cos(cable["inclination"]), mp.sin(cable["inclination"]))  # fmt: skip
    along = mp.matrix([cosine, 0, sine])
    warm = 1 + mp.mpf(cable["expansion"]) * (mp.mpf(day.get("temperature", 288.15)) - mp.mpf(288.15))
    ice, thickness = day.get("ice", {}), mp.mpf(day.get("ice", {}).get("thickness", 0))
    mass = mp.mpf(cable["mass_per_length"]) / warm
    mass += mp.pi * mp.mpf(ice.get("density", 900)) * thickness * (mp.mpf(cable["diameter"]) + thickness)
    upwards = mp.matrix([0, 0, mass * gravity])
    upwards[2] += mp.mpf(ice.get("weight", 0)) if gravity else 0
    upwards -= _drag(day.get("wind"), along, mp.mpf(cable["diameter"]) + 2 * thickness)
    length, weight = mp.mpf(cable["unstretched_length"]) * warm, mp.norm(upwards)
    vertical = upwards / weight if weight else mp.matrix([0, 0, 1])
    level = along - mp.fdot(along, vertical) * vertical
    if mp.norm(level) < mp.mpf(10) ** -30:
        return None  # an upright cable: the reference needs a horizontal distance
    level /= mp.norm(level)
    aside = mp.matrix([vertical[i - 2] * level[i - 1] - vertical[i - 1] * level[i - 2] for i in range(3)])
    axes = [level, aside, vertical]
    loads = []
    for load in cable["loads"]:
        force = mp.matrix([mp.mpf(part) for part in load.get("force", (0, 0, 0))])
        force[2] -= mp.mpf(load.get("mass", 0)) * gravity
        loads.append((mp.mpf(load["fraction"]) * length, [mp.fdot(axis, force) for axis in axes]))
    chord = mp.mpf(cable["chord"])
    place = [chord * mp.fdot(axis, along) for axis in axes]
    first = catenary_mp.solve_loaded(place, length, mp.mpf(cable["axial_stiffness"]), weight, loads)
    last = [sum((load[i] for _, load in loads), mp.mpf(0)) - first[i] for i in range(3)]
    last[2] -= weight * length
    ends = [[mp.fsum(part * axis[i] for part, axis in zip(end, axes, strict=True)) for i in range(3)]
            for end in (first, last)]  # fmt: skip
    found = {"preload": catenary_mp.mean_tension_loaded(first, length, weight, loads)}
    for number, end in enumerate(ends, 1):
        found[f"tension_{number}"] = mp.norm(mp.matrix(end))
        found[f"reaction_{number}_vertical"] = -end[2]
        found[f"reaction_{number}_horizontal"] = mp.hypot(end[0], end[1])
    return found


def _drag(wind, along, diameter):
    """Force per unstretched length of a steady wind on the straight cable. [N/m]"""
    if wind is None:
        return mp.zeros(3, 1)
    pressure = mp.mpf(wind["pressure"]) if "pressure" in wind else mp.mpf("0.6") * mp.mpf(wind["speed"]) ** 2
    direction = mp.mpf(wind["direction"])
    blows = mp.matrix([mp.cos(direction), mp.sin(direction), 0])
    across = blows - mp.fdot(blows, along) * along
    return mp.mpf(wind.get("cable_drag_coefficient", "1.2")) * pressure * diameter * mp.norm(across) * across
