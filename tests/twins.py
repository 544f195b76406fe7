"""Twins: a scene of one cable as the file of a suspension, of the same physics.

The cable `cable` runs from a fixed place to the body `gondola`. There are three twins, since a scene of one cable
answers questions about three systems:

* `held`: the body is held in all directions. Statics, load cases, the stiffness at end 2, modes with fixed ends.
* `swinging`: the body is free along x, and a dead force holds it where end 2 is, as the scene of one cable assumes. Its
  cable states the unstretched length, since its tension is given by that force and would not determine its place.
* `blown`: the wind on the cable alone, from one side.

What both files leave to defaults that differ is written out: the mean wind displaces nothing (`mean: false`; the one
cable's `mean_displacement` is a number of its own), it blows along x, which is how the gondola moves, and acts on the
body alone; turbulence is that along the wind.
"""

import math
from collections.abc import Mapping

from solved import end_force, solve

from cablestudy.scene.units import to_si

ENDS = ("ends", "chord", "inclination")
STATED = ("unstretched_length", "preload", "sag", "tension")
DRIVE = ("delay", "bandwidth", "max_speed")
SHARED = ("gravity", "materials", "model", "ground", "exposure", "case")

# ----------------------------------------------------------------------------------------------- columns of one cable

OF_CABLE = (
    "preload", "horizontal_tension", "max_tension", "min_tension", "unstretched_length", "stretched_length", "chord",
    "sag", "sag_ratio", "mass", "axial_stiffness", "mass_per_length", "strain", "lambda_squared", "lowest_point",
    "swing", "reaction_1_horizontal", "reaction_1_vertical", "reaction_2_horizontal", "reaction_2_vertical", "angle_1",
    "angle_2", "inclination_from_plumb",
)  # fmt: skip
STATICS = {name: f"cable.{name}" for name in OF_CABLE} | {
    "tension_1": "cable.tension_from",
    "tension_2": "cable.tension_to",
}
# with a key of the scene without which neither file has the column
SECTION = {
    name: f"cable.{name}" for name in ("diameter", "area", "elastic_modulus", "density", "stress", "catenary_constant")
}
STRENGTH = {name: f"cable.{name}" for name in ("breaking_force", "utilisation")}
LOADED = {name: f"cable.{name}" for name in ("deflection", "linear_deflection", "nonlinearity", "load_sag")}
VORTICES = {f"shedding_frequency{end}": f"cable.shedding_frequency{end}" for end in ("", "_low", "_high")}
GROUND = {"clearance": "cable.clearance"}
STIFFNESS = {
    "end_stiffness": "gondola.stiffness_xx",
    "end_stiffness_yy": "gondola.stiffness_yy",
    "end_stiffness_zz": "gondola.stiffness_zz",
    "end_stiffness_xz": "gondola.stiffness_xz",
    "end_stiffness_along": "cable.end_stiffness_along",
}
LINEAR = {"linear_range": "gondola.linear_range_x"}
COUPLED = {
    "gondola_frequency": "gondola.frequency_x",
    "gondola_share": "gondola.share_x",
    "gondola_damping_ratio": "gondola.damping_ratio_x",
}
LOOP = {name: name for name in (
    "gain", "largest_gain", "gain_margin", "phase_crossover", "phase_margin", "gain_crossover", "delay_margin",
    "sensitivity_peak", "sensitivity_frequency", "bandwidth", "disk_margin", "disk_gain_margin", "disk_phase_margin",
)}  # fmt: skip
OPEN_WIND = {
    "gondola_rms_open_loop": "gondola.rms_x_open_loop",
    "gondola_rms_velocity_open_loop": "gondola.rms_velocity_open_loop",
}
WIND = {"gondola_rms": "gondola.rms_x", "gondola_rms_velocity": "gondola.rms_velocity"} | {
    name: name for name in ("winch_rms_speed", "winch_peak_speed")
}
PEAK = {"peak": "gondola.peak"}  # where `wind.mean` is false
IMAGED = {"exposure": "gondola.exposure"}
CORRECTED = {"corrected": "gondola.corrected"}
BOTH = {"corrected_exposure": "gondola.corrected_exposure"}
# of the larger one of wind across and along the plane of the cable
CABLE_WIND = {
    f"gondola_{quantity}{state}_cable_wind": f"gondola.{twin}{state}"
    for quantity, twin in (("rms", "rms_x"), ("rms_velocity", "rms_velocity"))
    for state in ("", "_open_loop")
}
# with a gondola tensions in the wind are quasi-static, by its displacement; of a suspension from the RMS of the tension
OF_TENSION = {name: f"cable.{name}" for name in ("least_tension", "peak_utilisation", "slack_probability")}
BARE_CABLE = {"tension_rms": "cable.rms_tension", "midspan_rms": "cable.midspan_rms"} | OF_TENSION

STATIC = STATICS | STIFFNESS | SECTION | STRENGTH | GROUND | LOADED
VARIANCES = OPEN_WIND | WIND | PEAK | IMAGED | CORRECTED | BOTH | CABLE_WIND | BARE_CABLE

# Columns of one cable that have no twin, and why.
NO_TWIN = {
    "gondola_frequency_static": "frequency_static_K counts a third of the cable's mass",
    "mean_displacement": "linear for one cable; of a suspension that of the equilibrium in the wind",
    "force_displacement": "the twin is held at the place that it has under that force; test_load_case_forces.py",
    "limit_margin": "of the limits that a scene states, which name its own columns; test_limits.py",
    "governing": "the same",
    **{
        f"gondola_rms{quantity}{state}_all_wind": "gondola and cable in uncorrelated winds; of a suspension in one wind"
        for quantity in ("", "_velocity")
        for state in ("", "_open_loop")
    },
}


# ------------------------------------------------------------------------------------------------------------- twins


def number(value, unit):
    """A number of a scene, in SI."""
    return float(to_si(value, unit))


def end_places(cable):
    """Places of the two ends of the table `cable` of a scene, shape (2, 3). [m]"""
    if "ends" in cable:
        return [[number(part, "m") for part in end] for end in cable["ends"]]
    chord, angle = number(cable["chord"], "m"), number(cable.get("inclination", 0.0), "rad")
    cosine = 0.0 if abs(angle) == math.pi / 2 else math.cos(angle)
    return [[0.0, 0.0, 0.0], [chord * cosine, 0.0, chord * math.sin(angle)]]


def held(scene):
    """The twin whose body is held: for statics, stiffness at end 2 and modes with fixed ends. A mapping."""
    begin, end = end_places(scene["cable"])
    cable = {key: value for key, value in scene["cable"].items() if key not in ENDS}
    twin = {key: scene[key] for key in SHARED if key in scene}
    twin["cables"] = {"cable": {**cable, "from": begin, "to": "gondola.eye"}}
    twin["bodies"] = {"gondola": _body(scene, end)}
    if "cases" in scene:
        twin["cases"] = {name: _case(case) for name, case in scene["cases"].items()}
    return twin


def swinging(scene):
    """The twin whose body is free along x, with winch, control and wind on the body. A mapping."""
    twin = held(scene)
    body, cable = twin["bodies"]["gondola"], twin["cables"]["cable"]
    length = solve(scene, "unstretched_length").values["unstretched_length"]
    twin["cables"]["cable"] = {key: value for key, value in cable.items() if key not in STATED}
    twin["cables"]["cable"]["unstretched_length"] = length
    body |= {"free": ["x"], "force": [-float(end_force(scene)[0]) - _steady_force(scene), 0.0, 0.0]}
    winch = scene.get("winch")
    if winch is not None:
        end = "to" if winch.get("location") == "gondola" else "from"
        twin["winches"] = {"cable": {"end": end, "direction": [1.0, 0.0, 0.0]}}
        if winch.get("controller") is not None:
            twin["control"] = winch["controller"] | {key: winch[key] for key in DRIVE if key in winch}
    if "wind" in scene and "wind" in body:
        twin["wind"] = _wind(scene["wind"]) | {"on": "bodies", "direction": 0.0}
    if "correction" in scene:
        twin["correction"] = scene["correction"] | {"marker": "gondola.eye"}
        body["markers"] = {"eye": [0.0, 0.0, 0.0]}
    return twin


def blown(scene, across):
    """The twin in the wind on its cable alone, across the vertical plane of the cable or along it. A mapping.

    The body swings where the scene has a gondola, and is held where it has none. Its wind is the same along the cable.
    """
    twin = swinging(scene) if "gondola" in scene else held(scene)
    begin, end = end_places(scene["cable"])
    along = math.atan2(end[1] - begin[1], end[0] - begin[0])
    wind = _wind(scene["wind"])
    spread = next(key for key in ("turbulence_intensity", "turbulence_rms") if key in wind)
    wind[spread] = [wind[spread]] * 3
    direction = along + (math.pi / 2 if across else 0.0)
    twin["wind"] = wind | {"on": "cables", "direction": direction, "coherence_decay": 0.0}
    return twin


def _body(scene, end):
    gondola = scene.get("gondola") or {"mass": 1.0}
    body = {"at": end, "mass": gondola["mass"], "free": [], "attachments": {"eye": [0.0, 0.0, 0.0]}}
    if "area" in gondola and "drag_coefficient" in gondola:
        body["wind"] = {key: gondola[key] for key in ("area", "drag_coefficient")}
    return body


def _case(case):
    """A load case: its point loads are those of the cable."""
    return case | {"loads": {"cable": case["loads"]}} if "loads" in case else case


def _wind(wind):
    return {key: value for key, value in wind.items() if key != "coherence_length"} | {"mean": False}


def _steady_force(scene):
    """Force along x of the steady wind of the load case on the gondola, with the formula of files.md. [N]"""
    wind, gondola = chosen_case(scene).get("wind"), scene.get("gondola")
    if not isinstance(wind, Mapping) or not gondola or "drag_coefficient" not in gondola:
        return 0.0
    if "pressure" in wind:
        pressure = number(wind["pressure"], "Pa")
    else:
        pressure = number(wind.get("air_density", 1.2), "kg/m^3") / 2 * number(wind["speed"], "m/s") ** 2
    drag = number(gondola["drag_coefficient"], "") * number(gondola["area"], "m^2")
    return pressure * drag * math.cos(number(wind.get("direction", 0.0), "rad"))


def chosen_case(scene):
    """The table of the chosen load case; empty where none is chosen."""
    return scene.get("cases", {}).get(scene.get("case"), {})


def without(scene, *keys):
    """A scene without some of its keys."""
    return {key: value for key, value in scene.items() if key not in keys}
