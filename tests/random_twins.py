"""Random scenes of one cable that both files can say: their keys follow from a number, the same in every run."""

import math

import numpy as np

FORMS = ("taut", "inclined", "sagging", "steep", "askew", "weightless")
DAMPINGS = ("modal", "hysteretic", "strongly hysteretic", "kelvin_voigt", "viscous", "both")


def random_scene(seed, form=None, model=None):
    """Scene number `seed`: a mapping in SI.

    Form of the cable and damping run through all their combinations, place and law of the winch too; the rest is drawn.
    `form`, one of FORMS, and `model`, that table of the file, are fixed where they are given.
    """
    draw = np.random.default_rng([seed, 23])
    damping = DAMPINGS[(seed // len(FORMS)) % len(DAMPINGS)] if form is None else DAMPINGS[seed % len(DAMPINGS)]
    form = form or FORMS[seed % len(FORMS)]
    cable, length = _cable(draw, form)
    scene = {"gravity": 0.0 if form == "weightless" else 9.81, "cable": cable | {"damping": _damping(draw, damping)}}
    scene["gondola"] = {"mass": _power(draw, 1.0, 3.0), "area": 0.6, "drag_coefficient": 1.17}
    if seed % 3 == 1:
        cable_load = _load(draw, cable, length)
        scene["cable"]["loads"] = [cable_load]
    if seed % 4 == 2:
        scene |= _cases(draw, cable, length)
    scene["winch"] = _winch(draw, seed)
    scene["wind"] = _wind(draw, seed)
    if seed % 5 == 0:
        scene["exposure"] = _power(draw, -3, -1)
    if seed % 5 in (0, 1):
        scene["correction"] = {"bandwidth": _power(draw, 0, 1.3), "delay": 2e-3}
    scene["model"] = model or _model(draw, seed)
    return scene


def straight_scene(seed):
    """A level cable without weight, where reeling it in is the same as moving its end along x; two elements."""
    scene = random_scene(seed, "weightless", {"elements": 2, "order": 5})
    for key in ("cases", "case"):
        scene.pop(key, None)
    for load in scene["cable"].get("loads", ()):  # a mass alone leaves it straight
        load.pop("force", None)
        load["mass"] = 0.3
    scene["winch"] = _winch(np.random.default_rng([seed, 24]), seed % 2 + 2 * (seed // len(DAMPINGS)))
    return scene


def _power(draw, low, high):
    return float(10 ** draw.uniform(low, high))


def _cable(draw, form):
    """The table `cable` without damping and loads, and about its unstretched length."""
    chord = float(draw.uniform(40, 250))
    angle = {"inclined": draw.uniform(-0.6, 0.6), "steep": draw.uniform(0.7, 1.3), "sagging": draw.uniform(-0.3, 0.3),
             "askew": draw.uniform(-0.5, 0.5)}.get(form, 0.0)  # fmt: skip
    turn = float(draw.uniform(-0.6, 0.6)) if form == "askew" else 0.0
    begin = np.array([1.0, -2.0, 5.0])
    along = [math.cos(angle) * math.cos(turn), math.cos(angle) * math.sin(turn), math.sin(angle)]
    diameter, modulus, density = _power(draw, -2.6, -1.8), _power(draw, 10.3, 11.3), float(draw.uniform(1300, 8000))
    section = math.pi * diameter**2 / 4
    cable = {
        "ends": [begin.tolist(), (begin + chord * np.array(along)).tolist()], "diameter": diameter,
        "elastic_modulus": modulus, "density": density, "strength": 2e9, "expansion": 1.2e-5,
    }  # fmt: skip
    if form == "sagging" or (form == "askew" and draw.random() < 0.5):
        slack = _power(draw, -4, -2)
        if draw.random() < 0.4:
            return cable | {"sag": chord * math.sqrt(3 / 8 * slack)}, chord * (1 + slack)
        return cable | {"unstretched_length": chord * (1 + slack)}, chord * (1 + slack)
    tension = float(draw.uniform(1e-3, 5e-3)) * modulus * section
    length = chord / (1 + tension / (modulus * section))
    kind = draw.integers(3)
    if kind == 0:
        return cable | {"preload": tension}, length
    if kind == 1:
        return cable | {"tension": {"at": str(draw.choice(["end_1", "end_2", "max"])), "value": tension}}, length
    return cable | {"unstretched_length": length}, length


def _damping(draw, kind):
    size = _power(draw, -2.3, -1.7)
    return {
        "modal": {"ratio": size},
        "hysteretic": {"loss_factor": 0.02},
        "strongly hysteretic": {"loss_factor": 0.2},
        "kelvin_voigt": {"time": _power(draw, -3.5, -2.5), "viscous": 1e-3},
        "viscous": {"viscous": _power(draw, -2.5, -1.5)},
        "both": {"loss_factor": 0.02, "viscous": 0.01},
    }[kind]


def _load(draw, cable, length):
    """A point load: a force at a share of the length, and a mass in one of two; small beside the tension."""
    weight = 9.81 * cable["density"] * math.pi * cable["diameter"] ** 2 / 4 * length
    found = {"fraction": float(draw.uniform(0.2, 0.8))}
    if draw.random() < 0.5:
        return found | {"mass": 0.2 * weight / 9.81}
    return found | {"force": [0.0, 0.1 * weight * float(draw.random() < 0.5), -0.3 * weight]}


def _cases(draw, cable, length):
    """Load cases, and the one that is chosen."""
    cases = {
        "cold": {"temperature": 258.15},
        "ice": {"temperature": 268.15, "ice": {"thickness": cable["diameter"] / 2, "density": 900.0}},
        "storm": {"wind": {"speed": 10.0, "direction": float(draw.uniform(-3, 3)), "air_density": 1.25}},
        "visitor": {"loads": [_load(draw, cable, length)]},
    }
    return {"cases": cases, "case": str(draw.choice(list(cases)))}


def _winch(draw, seed):
    """A winch on the ground or on board, with an integrator and a notch, a drive with a delay, or PID."""
    gain, kind = _power(draw, -2.5, -1.3), seed // 2 % 4
    winch = {"location": ("ground", "gondola")[seed % 2]}
    if kind == 0:
        return winch | {"controller": {"gain": gain}}
    if kind == 1:
        return winch | {"controller": {"gain": gain, "notch": {"frequency": "static"}}, "delay": 0.02}
    if kind == 2:
        pid = {
            "gain": gain,
            "proportional_gain": 0.01,
            "derivative_gain": 0.01,
            "derivative_filter": 5.0,
            "notch": "none",
        }
        return winch | {"controller": pid, "bandwidth": 20.0, "delay": 0.005}
    return winch | {"controller": {"gain": {"auto": 12.0}, "notch": {"frequency": "coupled", "damping_ratio": 0.1}}}


def _wind(draw, seed):
    return {
        "speed": float(draw.uniform(3, 12)), "turbulence_intensity": 0.15, "length_scale": float(draw.uniform(15, 80)),
        "spectrum": ("von_karman", "kaimal", "davenport")[seed % 3], "admittance": ("vickery", "none")[seed % 2],
        "aerodynamic_damping": seed % 7 == 3, "mean": False, "coherence_length": 1e9,
    }  # fmt: skip


def _model(draw, seed):
    """Exactly some elements, or an accuracy."""
    kinds = (
        {"elements": 3, "order": 5}, {"elements": 4, "order": 4}, {"accuracy": 1e-4}, {"elements": 8},
        {"elements": 3, "order": 4, "mass": "consistent"}, {"accuracy": 1e-6},
    )  # fmt: skip
    return dict(kinds[(seed + seed // 6) % len(kinds)])
