"""Random suspensions over all that one can be, and what the program says of them against the truth."""

import json
import math
import time
import traceback
import warnings

import numpy as np
from random_scenes import Cell, TooLong, limited
from references.suspension_truth import Cable, Holder, Statics, Unknown, double, rotated
from suspension_cases import case_of

from cablestudy.errors import CablestudyError

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
STATED = ("unstretched_length", "preload", "sag", "tension_to")
STATIC = ("place", "turn", "mean_tension", "tension_from", "tension_to", "max_tension", "stated", "stiffness")
ACCURACIES = (1e-3, 1e-4, 1e-6)
MODES = 8
TAUT = 1e-15  # of the length: what rounding of places changes; over a strain, it changes a tension


def scene_data(seed, states=True):
    """The keys of random suspension number `seed`.

    Anchors lie around and above, some below. Lengths are such that a share of the cables sags; with `states`, some
    cables state a tension or sag instead, those that they have in equilibrium with these lengths.
    """
    rng = np.random.default_rng([seed, 12])

    def power(low, high):
        return float(10 ** rng.uniform(low, high))

    def vector(size):
        return [float(x) for x in rng.uniform(-size, size, 3)]

    size, gravity = power(0, 3), 0.0 if rng.random() < 0.05 else float(rng.choice([9.81, 1.62, 274.0]))
    bodies, points, cables = {}, {}, {}
    lengths = rng.random() < 0.2
    several = 1 if lengths or rng.random() < 0.7 else 2
    mass = power(-3, 6)
    force = mass * (gravity or 1.0)  # what all cables carry in size
    for name in "ab"[:several]:
        own, half = mass * power(-0.5, 0.5), size * power(-2, -0.7)
        rest = size * rng.uniform(-0.3, 0.3, 3)
        bodies[name] = {
            "at": [float(x) for x in rest], "attitude": vector(0.3), "mass": own,
            "center_of_mass": [float(x) for x in rng.normal(size=3) * 0.2 * half + [0, 0, -0.3 * half]],
            "inertia": [float(x) for x in own * half**2 * rng.uniform(0.4, 0.7, 3)], "attachments": {},
        }  # fmt: skip
        if rng.random() < 0.3:
            bodies[name]["force"] = vector(0.3 * force)
        if rng.random() < 0.1:
            bodies[name]["moment"] = vector(0.05 * force * half)
        if rng.random() < 0.15:
            bodies[name]["free"] = [axis for axis in AXES if rng.random() < 0.6] or ["z"]
        bodies[name]["_half"] = half
    for number in range(0 if lengths else rng.choice([0, 1, 2, 3], p=(0.5, 0.25, 0.15, 0.1))):
        at = [float(x) for x in size * rng.uniform(-0.5, 0.5, 3)]
        points[f"p{number}"] = {"at": at, "free": True, "mass": mass * power(-4, -0.5)}
    count = int(rng.integers(3, 13))
    count = max(count, 3 * len(bodies) + 2 * len(points))
    strain, heavy = power(-8, -2.5), power(-5, 0.3)  # of cables under their load; weight of a cable over it
    below = rng.random() < 0.4
    owners = [*bodies] * 3 + [*points] * 2
    while len(owners) < count:
        owners.append(str(rng.choice([*bodies, *points])))

    def end(owner):
        if owner in points:
            return owner, np.array(points[owner]["at"])
        body = bodies[owner]
        name, half = f"e{len(body['attachments'])}", body["_half"]
        place = rng.uniform(-half, half, 3)
        place[2] += half / 2
        body["attachments"][name] = [float(x) for x in place]
        R = double(rotated(body["attitude"]))
        return f"{owner}.{name}", np.array(body["at"]) + R @ place

    turn = rng.uniform(0, 2 * math.pi)
    for number, owner in enumerate(owners):
        to, there = end(owner)
        other = [name for name in (*bodies, *points) if name != owner]
        if other and number >= 3 and rng.random() < 0.2:
            begin, here = end(str(rng.choice(other)))
        else:
            angle = turn + 2 * math.pi * number * 0.381966 + rng.normal() * 0.2
            height = rng.uniform(0.4, 1.2) if number < 3 * len(bodies) or not below else rng.uniform(-1, 1)
            here = size * np.array([math.cos(angle), math.sin(angle), height])
            begin = [float(x) for x in here]
        chord = float(np.linalg.norm(there - here))
        stiffness = force / strain * power(-0.5, 0.5)
        kind = rng.choice(["taut", "near", "slack"], p=(0.5, 0.25, 0.25))
        ratio = {"taut": 1 - strain * rng.uniform(0, 1), "near": 1 + rng.normal() * 3e-3, "slack": 1 + power(-3, -0.5)}
        per_length = heavy * force / ((gravity or 9.81) * size)
        area = power(-6, -2)
        cables[f"c{number}"] = {
            "from": begin, "to": to, "area": area, "elastic_modulus": stiffness / area, "density": per_length / area,
            "unstretched_length": chord * float(ratio[kind]),
        }  # fmt: skip
    for body in bodies.values():
        del body["_half"]
    data = {"gravity": gravity, "points": points, "bodies": bodies, "cables": cables}
    if lengths:
        return _for_lengths(data, rng, force)
    other = rng.random() < 0.4
    chosen = [name for name in cables if rng.random() < 0.4]
    kinds = {name: str(rng.choice(STATED[1:], p=(0.5, 0.2, 0.3))) for name in chosen}
    return _stating(data, kinds, rng) if states and other and kinds else data


def _for_lengths(data, rng, force):
    """Lengths to be found: what no cable states, but one that keeps its own now and then."""
    (body,) = data["bodies"].values()
    for place, cable in enumerate(data["cables"].values()):
        if place or len(data["cables"]) < 8 or rng.random() < 0.7:
            del cable["unstretched_length"]
    if len(data["cables"]) < 6 + len(body.get("free", AXES)) // 6 or rng.random() < 0.3:
        body["attitude"] = "free"
    tensions = {"method": str(rng.choice(["balanced", "least", "closest"]))}
    if tensions["method"] == "closest":
        tensions["reference"] = force * float(rng.uniform(0.2, 2))
    if rng.random() < 0.5:
        tensions["max"] = force * 10 ** float(rng.uniform(0, 3))
    return {**data, "solve_for": "lengths", "tensions": tensions}


def _stating(data, kinds, rng):
    """The same suspension, whose cables state what they have in its equilibrium; the search begins elsewhere."""
    try:
        case = case_of(data)
        truth = truth_of(data, case.equilibrium)
        mean, _, to, _ = truth.tensions()
        cables = {name: dict(cable) for name, cable in data["cables"].items()}
        for name, kind in kinds.items():
            index = list(cables).index(name)
            value = {"preload": mean, "tension_to": to}[kind][index] if kind != "sag" else truth.sag(index)
            if value > 1e-12:
                del cables[name]["unstretched_length"]
                cables[name][kind] = float(value)
    except (CablestudyError, Unknown, ArithmeticError):
        return data
    size = max(np.abs(cable["from"]).max() for cable in cables.values() if not isinstance(cable["from"], str))
    moved = {}
    for table in ("bodies", "points"):
        moved[table] = {
            name: {**part, "at": [float(x) for x in part["at"] + rng.normal(size=3) * 0.02 * size]}
            for name, part in data[table].items()
        }
    return {**data, **moved, "cables": cables}


def truth_of(data, equilibrium):
    """`Statics` near an equilibrium of the program, with its lengths; raises Unknown."""
    holders, names = [], [*data["bodies"], *(name for name, point in data["points"].items() if point.get("free"))]
    held = tuple(axis in AXES[:3] for axis in AXES)
    for body in data["bodies"].values():
        free = tuple(axis in body.get("free", AXES) for axis in AXES)
        holders.append(
            Holder(body["mass"], free, body["center_of_mass"], body["inertia"], body.get("force", (0, 0, 0)),
                   body.get("moment", (0, 0, 0)))
        )  # fmt: skip
    for name in names[len(holders) :]:
        holders.append(Holder(data["points"][name]["mass"], held, force=data["points"][name].get("force", (0, 0, 0))))

    def end(where):
        if not isinstance(where, str):
            return None, where
        owner, _, attachment = where.partition(".")
        if attachment:
            return names.index(owner), data["bodies"][owner]["attachments"][attachment]
        return (names.index(owner), (0, 0, 0)) if owner in names else (None, data["points"][owner])

    cables = [
        Cable((end(cable["from"]), end(cable["to"])), cable["elastic_modulus"] * cable["area"],
              cable["density"] * cable["area"])
        for cable in data["cables"].values()
    ]  # fmt: skip
    lengths = equilibrium.lengths
    return Statics.near(data["gravity"], holders, cables, lengths, equilibrium.position, equilibrium.rotation)


def errors_of_statics(data, case, truth):
    """Name of a static number -> (its value, its error, what the truth may be wrong by), all relative."""
    found = case.equilibrium
    span, bodies = found.catenary.span, len(data["bodies"])
    size = float(span.chord.max())
    places = np.array([double(p).ravel() for p in truth.positions])
    turns = np.array([double(R) for R in truth.rotations])
    tension = truth.tensions()
    # a tension of a taut cable, and a stiffness of taut cables, hang on the last digits of places
    doubt = TAUT * size * float((span.axial_stiffness / (span.chord * tension[3])).max())
    own = np.array([
        found.catenary.mean_tension, *np.moveaxis(np.linalg.norm(found.end_forces, axis=-1), -1, 0),
        found.catenary.max_tension,
    ])  # fmt: skip
    wrong = np.abs(own - tension) / tension[3]
    numbers = {
        "place": (size, np.abs(found.position - places).max() / size, TAUT),
        "turn": (1.0, np.abs(found.rotation @ np.swapaxes(turns, -1, -2) - np.eye(3)).max(), 4 * TAUT),
    }
    for name, values, error in zip(STATIC[2:6], tension, wrong, strict=True):
        numbers[name] = float(values.max()), float(error.max()), doubt
    stated = {"preload": tension[0], "tension_to": tension[2], "unstretched_length": found.lengths}
    error = [0.0]
    for index, cable in enumerate(data["cables"].values()):
        for kind in STATED:
            if kind in cable:
                value = truth.sag(index) if kind == "sag" else stated[kind][index]
                error.append(abs(value / cable[kind] - 1))
    numbers["stated"] = 1.0, max(error), doubt
    points = range(bodies, len(truth.holders))
    worst = 0.0
    for body in range(bodies):
        K = truth.body_stiffness(body, points)
        scale = np.sqrt(np.repeat(np.abs(np.diag(K)).reshape(2, 3).max(axis=1), 3))
        worst = max(worst, (np.abs(found.body_stiffness[body] - K) / np.outer(scale, scale)).max())
    numbers["stiffness"] = 1.0, worst, doubt
    return numbers


def examine(seed, every=False, limit=60):
    """The cells of one suspension, at one accuracy; with `every` at all of them.

    A warning, or an exception that is not the program's own, is a cell with the note "crash: ..."; what took more than
    `limit` seconds of CPU one with "slow: ..."; what the program refuses one with "refused: ..." and the reason.
    """
    rng = np.random.default_rng([seed, 1])
    accuracies = ACCURACIES if every else (float(rng.choice(ACCURACIES)),)
    cells, begin, spent = [], time.process_time(), 0.0

    def cell(column, value=None, estimate=None, error=None, doubt=0.0, note=""):
        cells.append(Cell(seed, accuracies[0], column, True, value, estimate, error, doubt, note, 0, spent))

    try:
        with limited(limit), warnings.catch_warnings():
            warnings.simplefilter("error")
            data = scene_data(seed)
            begin = time.process_time()
            case = case_of(data)
            found = case.equilibrium
            estimate = case.statics_error(None)
            spent = time.process_time() - begin
            truth = truth_of(data, found)
            for name, (value, error, doubt) in errors_of_statics(data, case, truth).items():
                cell(name, value, estimate, error, doubt)
            cells += [one for accuracy in accuracies for one in _modes(seed, data, truth, accuracy)]
    except (CablestudyError, Unknown) as why:
        said = "refused" if isinstance(why, CablestudyError) else "no truth"
        spent = time.process_time() - begin
        cell("frequency" if cells else "place", note=f"{said}: {why}")
    except TooLong as stop:
        files = [frame.filename for frame in traceback.extract_tb(stop.__traceback__)]
        place = "the truth" if any("references" in file for file in files) else "the program"
        cell("place", note=f"slow: {limit} s of CPU, the last of them in {place}")
    except Exception as failure:
        last = traceback.extract_tb(failure.__traceback__)[-1]
        cell("place", note=f"crash: {failure!r} at {last.filename.split('/')[-1]}:{last.lineno}")
    return cells


def _modes(seed, data, truth, accuracy):
    """Cells of the lowest frequencies."""
    case = case_of({**data, "model": {"accuracy": accuracy}})
    begin = time.process_time()
    modes = case.modes(MODES)
    spent = time.process_time() - begin
    count = min(MODES, len(modes))
    try:
        expected, doubt = truth.frequencies(count)
    except Unknown as why:
        return [Cell(seed, accuracy, "frequency", True, None, None, None, 0.0, f"no truth: {why}", 0, spent)]
    error = np.abs(modes.frequency[:count] / expected - 1)
    return [
        Cell(seed, accuracy, f"frequency_{k + 1}", True, float(modes.frequency[k]), max(float(modes.error[k]), 1e-12),
             float(error[k]), float(doubt[k]), "", len(modes.shapes), spent)
        for k in range(count)
    ]  # fmt: skip


def replay(seed):
    """What a user types to see this suspension."""
    return f"echo '{json.dumps(scene_data(seed))}' | cablestudy static -"
