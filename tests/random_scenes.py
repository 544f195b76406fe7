"""Random scenes over the whole range of what a cable can be, and what the program says of them against the truth."""

import json
import math
import signal
import time
import traceback
import warnings
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from mpmath import mp
from references.scene_truth import Cable, Truth, Unknown

from cablestudy.errors import NoSolutionError
from cablestudy.scene.scene import CableScene
from cablestudy.study.columns import find
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.rows import evaluate

ACCURACIES = (1e-2, 1e-4, 1e-6, 1e-8)
STATIC = (
    "preload", "horizontal_tension", "max_tension", "min_tension", "unstretched_length", "stretched_length", "sag",
    "end_stiffness", "end_stiffness_yy", "end_stiffness_zz",
)  # fmt: skip
MOTION = (
    "cable_frequency", "inplane_frequency_3", "outofplane_frequency_1", "outofplane_frequency_2", "axial_frequency_1",
)  # fmt: skip
ROUNDING = 1e-12  # the least error that is stated
DROWNED = 8  # transverse half-waves beside the first axial mode, from which on it is hard to find


def scene_data(seed):
    """The keys of random scene number `seed`: log-uniform over every range, where they make sense together."""
    rng = np.random.default_rng(seed)

    def power(low, high):
        return float(10 ** rng.uniform(low, high))

    chord = power(-3, 6)
    upright = math.pi / 2
    angle = (0.0, upright, -upright, rng.uniform(-1.55, 1.55), None)[rng.choice(5, p=(0.25, 0.06, 0.06, 0.48, 0.15))]
    if angle is None:  # almost vertical
        angle = float(rng.choice([-1, 1])) * (upright - power(-6, -1))
    gravity = 0.0 if rng.random() < 0.07 else power(-6, 3)
    mass = power(-5, 2)  # per length
    form = rng.choice(["preload", "taut", "slack", "sag"], p=(0.25, 0.25, 0.35, 0.15))
    if not gravity and form in ("slack", "sag"):
        form = "taut"
    strain, slackness = power(-12, math.log10(0.3)), power(-9, 2)
    length = chord / (1 + strain) if form in ("preload", "taut") else chord * (1 + slackness)
    # EA over the force that acts: to 1e12, and not so soft that the cable is stretched to many times its length
    weight = mass * gravity * length
    stiffness = (weight or power(-6, 6)) * power(0.5, 12)
    cable = {"chord": chord, "inclination": float(angle)}
    loads = []
    for _ in range(rng.choice([0, 1, 2, 3], p=(0.6, 0.2, 0.1, 0.1))):
        size = min((weight or stiffness * 1e-6) * power(-3, 3), stiffness / 5)
        way = rng.choice(3, p=(0.5, 0.3, 0.2))
        vector = rng.normal(size=3)
        vector /= np.linalg.norm(vector)
        force = ((0, 0, -1), (0, 0, 1), tuple(vector))[way]
        at = length * rng.uniform(0.02, 0.98)
        loads.append({"at": float(at), "force": [float(size * f) for f in force]})
    if form == "preload" and strain * stiffness < weight:
        form = "taut"  # there is a least tension, about half the weight
    if form == "preload":
        cable["preload"] = strain * stiffness
    elif form == "sag":
        cable["sag"] = chord * power(-6, 1)
    else:
        cable["unstretched_length"] = length
    area = power(-8, -2)
    cable |= {"area": area, "elastic_modulus": stiffness / area, "density": mass / area, "loads": loads}
    if form in ("preload", "sag"):
        cable["loads"] = [load for load in loads if form == "preload"]
        cable["reference"] = {"loads": True}
    data = {"gravity": gravity, "cable": cable}
    # a gondola whose mode is among the first hundred of its cable's, not far above them all
    force = max(weight, strain * stiffness if form in ("preload", "taut") else 0.0, 1e-12 * stiffness)
    least = mass * length * max(1e-2, stiffness / force / 1e4)
    if least < 1e9 and rng.random() < 0.9:
        data["gondola"] = {"mass": power(max(-3.0, math.log10(least)), 9)}
        loss = power(-5, 0.3)  # Kelvin-Voigt: at most this, at the frequency of the gondola on the straight cable
        slow = math.sqrt(data["gondola"]["mass"] * length / stiffness)
        cable["damping"] = {"loss_factor": loss} if rng.random() < 0.5 else {"time": loss * slow}
    return data


def scene_of(data, accuracy):
    """A `CableScene`."""
    return CableScene.model_validate({**data, "model": {"accuracy": accuracy}})


def truth_of(data, span):
    """The reference of a scene; where tension or sag is given, of the length that the program found."""
    cable = data["cable"]
    with mp.workdps(60):
        length = cable.get("unstretched_length") or mp.mpf(cable["chord"]) / (1 + mp.mpf(float(span.chord_strain)))
    damping = cable.get("damping", {})
    return Truth(
        Cable(
            cable["chord"], cable["inclination"], length, cable["elastic_modulus"] * cable["area"],
            cable["density"] * cable["area"], data["gravity"],
            tuple((load["at"], tuple(load["force"])) for load in cable["loads"]),
            data.get("gondola", {}).get("mass", 0.0), damping.get("loss_factor", 0.0), damping.get("time", 0.0),
        )
    )  # fmt: skip


def expected(truth, data, name):
    """(value, error of the reference) of a column; raises Unknown."""
    cable = data["cable"]
    if name in STATIC[:7]:
        if name in cable:
            return cable[name], 0.0  # what was asked for
        if truth.folded and truth.weight and name in ("min_tension", "horizontal_tension"):
            return 0.0, 0.0
        if name not in truth.statics:
            raise Unknown("mid-span is not one place")
        value = float(truth.statics[name])
        size = cable["chord"] if name == "sag" else float(truth.statics["max_tension"])
        value = value if abs(value) > 1e-24 * size else 0.0  # what is left of a limit is nothing
        return value, 0.0
    if name.startswith("end_stiffness") or name == "gondola_frequency_static":
        place = {"end_stiffness_yy": 1, "end_stiffness_zz": 2}.get(name, 0)
        if truth.folded and abs(cable["inclination"]) == math.pi / 2 and place < 2:
            return 0.0, 0.0
        value = float(truth.end_stiffness[place, place])
        if name == "gondola_frequency_static":
            value = math.sqrt(value / data["gondola"]["mass"]) / (2 * math.pi)
        return value, 0.0
    if name == "cable_frequency":
        return truth.frequency("in-plane", 1)
    if name == "axial_frequency_1":
        return truth.axial(1)
    if name.startswith(("inplane", "outofplane")):
        kind, number = name.split("_frequency_")
        return truth.frequency({"inplane": "in-plane", "outofplane": "out-of-plane"}[kind], int(number))
    try:
        return getattr(truth, name)()
    except np.linalg.LinAlgError as failure:
        raise Unknown(f"the reference: {failure}") from None


@dataclass
class Cell:
    """One number of one scene at one accuracy, asked for alone or with the other columns of motion.

    `error` is None where there is no truth, `estimate` where the program refused or states none, as of a mode that does
    not oscillate: the number is then exact; `cpu` is what the row cost [s].
    """

    seed: int
    accuracy: float
    column: str
    together: bool
    value: float | None
    estimate: float | None
    error: float | None
    doubt: float
    note: str
    dof: int = 0
    cpu: float = 0.0

    @property
    def excess(self):
        """Error, less what the reference itself may be wrong by, over the error that the program states."""
        if self.error is None:
            return 0.0
        return max(self.error - 3 * self.doubt, 0.0) / max(self.estimate or 0.0, 1e-300)

    @property
    def caution(self):
        """Stated error over the error; None where the error is lost in rounding or in the reference."""
        if self.error is None or self.error < max(ROUNDING, 3 * self.doubt):
            return None
        return self.estimate / self.error


def columns_for(data, truth):
    """Names of what is asked of a scene."""
    names = [*STATIC, *MOTION]
    if truth.folded:
        return names
    if not truth.straight and truth.axial_waves > 100:
        names.remove("axial_frequency_1")  # no mode moves along the cable alone: it drowns among the transverse ones
    if "gondola" in data:
        names += ["gondola_frequency_static", "gondola_frequency", "gondola_damping_ratio"]
    return names


class TooLong(BaseException):
    """A scene took too long."""


@contextmanager
def limited(seconds):
    """End what takes more seconds of CPU, with `TooLong`: again every second, for what swallows it."""

    def stop(*_):
        raise TooLong

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def rows_for(seed, names, every=(), drowned=False, in_turn=()):
    """Yield (columns, accuracy): the rows that a scene is asked for.

    What is static in one row; of the columns of motion each alone in half of all scenes, and in a quarter of them all
    but the axial one together; each row at one accuracy. With `every` all of them in every scene, at each of these
    accuracies; with `in_turn` every row in every scene, at the first of these accuracies, the second, and so on.
    An axial mode that is `drowned` among transverse ones takes as long as all else: one in ten is asked for.
    """
    rng = np.random.default_rng([seed, 1])
    static = [name for name in names if name in STATIC or name == "gondola_frequency_static"]
    moving = [name for name in names if name not in static]
    yield static, 1e-4
    # an axial mode may take, or be refused for, a hundred times the waves of all others
    rows = [(0.1 if drowned and "axial" in name else 0.5, [name]) for name in moving]
    rows += [(0.25, [name for name in moving if "axial" not in name])]
    for number, (share, row) in enumerate(rows):
        taken, place = rng.random() < share, rng.integers(len(ACCURACIES))
        one = in_turn and (in_turn[number % len(in_turn)],)
        for accuracy in every or one or (ACCURACIES[place : place + 1] if taken else ()):
            yield row, accuracy


def examine(seed, every=(), limit=60, in_turn=()):
    """The cells of one scene; with `every` or `in_turn`, of every row, see `rows_for`.

    A warning or an exception that is not the program's own is a cell with the note "crash: ...", and what took more
    than `limit` seconds of CPU one with "slow: ...".
    """
    data = scene_data(seed)
    cells, names, accuracy, begin = [], ["preload"], 1e-4, time.process_time()
    try:
        with limited(limit):
            truth = truth_of(data, CableCase(scene_of(data, 1e-4)).span)
            known = {}
            try:
                wanted = columns_for(data, truth)
            except ArithmeticError as why:  # the reference found no equilibrium
                wanted = [*STATIC, *MOTION]
                known = dict.fromkeys(wanted, (f"no truth: {why}", 0.0))
            drowned = not (known or truth.folded or truth.straight) and truth.axial_waves > DROWNED
            for names, accuracy in rows_for(seed, wanted, every, drowned, in_turn):
                found = _cells(seed, data, truth, names, accuracy, known)
                if "sag" in names and all(cell.note.startswith("refused") for cell in found):  # is it only the sag?
                    found = [cell for name in names for cell in _cells(seed, data, truth, [name], accuracy, known)]
                cells += found
    except NoSolutionError as why:
        note = f"refused: {why}"
    except TooLong as stop:
        files = [frame.filename for frame in traceback.extract_tb(stop.__traceback__)]
        place = "the truth" if any("references" in file for file in files) else "the program"
        note = f"slow: {limit} s of CPU, the last of them in {place}"
    except Exception as failure:
        note = f"crash: {failure!r}"
    else:
        return cells
    spent = time.process_time() - begin
    return [*cells, Cell(seed, accuracy, names[0], len(names) > 1, None, None, None, 0.0, note, 0, spent)]


def _cells(seed, data, truth, names, accuracy, known):
    """Cells of one row of the program; `known` keeps what is expected of a column."""
    columns = [find(name) for name in names]
    together = len(names) > 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        begin = time.process_time()
        try:
            row = evaluate(scene_of(data, accuracy), [*columns, *map(find, ("error_estimate", "dof"))])
        except Exception as failure:
            note = f"crash: {type(failure).__name__}: {failure}"
            return [Cell(seed, accuracy, name, together, None, None, None, 0.0, note) for name in names]
        cpu = time.process_time() - begin
    found = []
    for column in columns:
        value, note = row.cells[column.header], ""
        error, doubt = None, 0.0
        if value is None:
            note = f"refused: {row.cells['status']}"
        else:
            if column.name not in known:
                known[column.name] = _known(truth, data, column.name)
            exact, doubt = known[column.name]
            if isinstance(exact, str):
                note, doubt = exact, 0.0
            else:
                error = abs(value - exact) / abs(exact) if exact else float(value != exact)
        estimate = row.errors.get(column.header)
        found.append(
            Cell(seed, accuracy, column.name, together, value, estimate, error, doubt, note, row.cells["dof"] or 0, cpu)
        )
    return found


def _known(truth, data, name):
    """(value, error of the reference) of a column, or (why there is none, 0)."""
    try:
        return expected(truth, data, name)
    except (Unknown, ArithmeticError) as why:
        return f"no truth: {why}", 0.0


def replay(seed):
    """What a user types to see this scene."""
    return f"echo '{json.dumps(scene_data(seed))}' | cablestudy static -"
