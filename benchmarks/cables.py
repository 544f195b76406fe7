"""What is measured: a thousand cables, the paper's scene with them in it, the truth about them; and the stopwatch."""

import functools
import json
import math
import os
import sys
import tempfile
import time
from dataclasses import dataclass

HERE = os.path.dirname(os.path.abspath(__file__))
COUNT = 1000
CHORD, AREA, MODULUS, DENSITY, GRAVITY = 185.8, 2.69e-6, 70.3e9, 1440.0, 9.81  # the paper's Table 1
EA, MASS = MODULUS * AREA, DENSITY * AREA
WEIGHT = MASS * GRAVITY
SLACKEST, TAUTEST, STEEPEST = -0.004, 0.010, math.radians(60)  # (chord - length)/length, and inclination [rad]
CONVERGED = 1e-9  # accuracy of our own frequencies, once they are held against the continuous cable


@dataclass(frozen=True)
class Cable:
    """One of the thousand.

    Attributes
    ----------
    inclination : float
        [rad]
    length : float
        Unstretched. [m]
    """

    inclination: float
    length: float

    @property
    def across(self):
        """Horizontal distance of the ends. [m]"""
        return CHORD * math.cos(self.inclination)

    @property
    def rise(self):
        """Of end 2 above end 1. [m]"""
        return CHORD * math.sin(self.inclination)


def cables():
    """COUNT cables spread evenly over length and inclination, the same in every run (a lattice, no chance)."""
    for i in range(COUNT):
        strain = SLACKEST + (TAUTEST - SLACKEST) * math.modf((i + 0.5) * 0.7548776662466927)[0]
        yield Cable(STEEPEST * math.modf((i + 0.5) * 0.5698402909980532)[0], CHORD / (1 + strain))


@functools.cache
def paper():
    """The scene of configs/carlina.yaml."""
    from cablestudy.scene.scene import load_scene

    return load_scene(os.path.join(HERE, os.pardir, "configs", "carlina.yaml"))[1]


def changed(scene, accuracy=None, wind=None, **cable):
    """A scene with some values changed: accuracy instead of a fixed model, wind speed [m/s], keys of the cable."""
    update = {}
    if cable:
        update["cable"] = scene.cable.model_copy(update=cable)
    if wind is not None:
        update["wind"] = scene.wind.model_copy(update={"speed": wind})
    if accuracy is not None:
        update["model"] = scene.model.model_copy(update={"elements": None, "accuracy": accuracy})
    return scene.model_copy(update=update)


def scene_of(cable, accuracy):
    """One of the thousand as a scene."""
    where = {"ends": None, "chord": CHORD, "inclination": cable.inclination}
    return changed(paper(), accuracy, **where, unstretched_length=cable.length, strength=None)


def study_of(cables, accuracy, columns):
    """A study whose rows are some of the thousand, as the file of a study states them: `StudyFile`."""
    from cablestudy.scene.study import read_study

    inclinations = [f"{math.degrees(cable.inclination)!r} deg" for cable in cables]
    lengths = [f"{cable.length!r} m" for cable in cables]
    content = {
        "base": os.path.join(HERE, os.pardir, "configs", "carlina.yaml"),
        "set": {
            "cable.chord": f"{CHORD} m",
            "cable.strength": None,
            "model": {"accuracy": accuracy},
        },
        "vary": [{"cable.inclination": inclinations, "cable.unstretched_length": lengths}],
        "columns": list(columns),
    }
    with tempfile.TemporaryDirectory(prefix="cablestudy-bench-") as folder:
        path = os.path.join(folder, "study.yaml")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(content, file)  # which is YAML too
        return read_study(path)


def exact(cable):
    """Horizontal tension, largest tension, mean tension, sag of a cable, by 50 digits of its own. [N], [N], [N], [m]"""
    from mpmath import mp

    reference = _references("catenary_mp")
    with mp.workdps(50):
        geometry = mp.mpf(cable.across), mp.mpf(cable.rise), mp.mpf(cable.length)
        H, V0 = reference.solve(*geometry, mp.mpf(EA), mp.mpf(WEIGHT))
        L, w = geometry[2], mp.mpf(WEIGHT)
        largest = max(mp.hypot(H, V0), mp.hypot(H, V0 + w * L))
        values = H, largest, reference.mean_tension(H, V0, L, w), reference.sag(H, V0, L, mp.mpf(EA), w)
        return tuple(map(float, values))


def continuous(cable, count, plane):
    """Lowest frequencies of the continuous cable in one plane, "in" or "out", by integral equations. [Hz]"""
    reference = _references("continuous_cable")
    return reference.frequencies(cable.across, cable.rise, cable.length, EA, MASS, GRAVITY, count, plane=plane)


def _references(name):
    """A module of the tests' references, which are independent of the program."""
    import importlib

    tests = os.path.join(HERE, os.pardir, "tests")
    if tests not in sys.path:
        sys.path.insert(0, tests)
    return importlib.import_module(f"references.{name}")


def seconds(function):
    """CPU time of one call, without equilibria of calls before it. [s]

    What others do on the machine meanwhile counts less than in time on the wall.
    """
    from cablestudy.statics import equilibria

    equilibria.forget()
    begin = time.process_time()
    function()
    return time.process_time() - begin


def least(function, runs=5):
    """Least CPU time of a few calls. [s]"""
    return min(seconds(function) for _ in range(runs))


def median(values):
    """Median of numbers."""
    ordered = sorted(values)
    return (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]) / 2


def verdict(met):
    """One word."""
    return "met" if met else "MISSED"
