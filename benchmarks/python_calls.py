"""Wrong and odd calls of the Python interface: each must end with a result, or with one line that names the argument.

    python benchmarks/python_calls.py [--calls 4000] [--seed 1] [--only NAME]

Every argument of every public function and method is given each of some 60 odd values, alone and inside what it takes
(as the value of a key of `set`, as an item of `columns`, ...), the others right. Every fifth call has two odd ones.
Calls come in a random order that the seed fixes, so that a smaller number is a sample; some 13,000 are all of them.
A finding is printed as a line of JSON; the exit code is 1 if there is any. What is one: an error that is not
the program's own, or of Python at the check of the arguments; one that names neither the argument nor what it got; a
warning of a library; a number that is not finite; more than 30 s of processor time.
"""

import argparse
import datetime
import inspect
import io
import itertools
import json
import math
import os
import random
import re
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import matplotlib

matplotlib.use("agg")

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import cablestudy as cs
from cablestudy.control import statespace
from cablestudy.interface import answer, arguments

SECONDS = 30  # of processor time that a call may take
DOOR, STATE_SPACE = arguments.__file__, statespace.__file__  # where arguments are checked
LONGEST = 1000  # characters of a message
CABLE = {
    "cable": {"chord": 100, "material": "aramid", "diameter": "2 mm", "preload": "1 kN", "damping": {"ratio": 0.01}},
    "gondola": {"mass": 50, "area": 0.6, "drag_coefficient": 1.17},
    "winch": {"location": "ground", "controller": {"gain": 0.3}},
    "wind": {"speed": 6, "turbulence_intensity": 0.15, "length_scale": 25},
    "model": {"elements": 10},
    "cases": {"cold": {"temperature": "-10 degC"}},
}
SUSPENSION = {
    "cable": {"material": "aramid", "diameter": "2 mm", "damping": {"model": "kelvin_voigt", "time": "1 ms"}},
    "bodies": {
        "gondola": {
            "at": [0, 0, 0], "mass": 20, "inertia": [4, 5, 6], "attachments": {"a": [0, 0, 0]}, "free": ["x"],
            "wind": {"area": 0.3, "drag_coefficient": 1.2},
        }
    },
    "cables": {
        "west": {"from": [-10, 0, 0], "to": "gondola.a", "preload": "1 kN"},
        "east": {"from": [10, 0, 0], "to": "gondola.a", "preload": "1 kN"},
    },
    "winches": {"west": {}},
    "control": {"gain": 0.05, "notch": "none"},
    "wind": {"speed": 6, "turbulence_intensity": 0.15, "length_scale": 25},
    "model": {"elements": 4, "order": 2},
    "cases": {"cold": {"temperature": "-10 degC"}},
}  # fmt: skip
STUDY = {"base": CABLE, "vary": [{"cable.diameter": ["2 mm", "3 mm"]}], "columns": ["sag", "mass"]}


class Odd:
    """An object that nothing is known of."""


ODD = {
    "None": lambda: None, "empty text": str, "text": lambda: "x", "text with dots": lambda: "cable.diameter",
    "text with =": lambda: "cable.diameter=3 mm", "blank": lambda: " ", "quantity": lambda: "3 mm",
    "line break": lambda: "a\nb", "zero byte": lambda: "a\0b", "other script": lambda: "缆索",
    "surrogate": lambda: "\ud800", "long text": lambda: "x" * 100_000, "option": lambda: "--set",
    "dollar": lambda: "$\\frac{a$",
    "0": lambda: 0, "-1": lambda: -1, "3": lambda: 3, "2.5": lambda: 2.5, "True": lambda: True, "nan": lambda: math.nan,
    "inf": lambda: math.inf, "1e400": lambda: 1e400, "1e300": lambda: 1e300, "10**400": lambda: 10**400,
    "10**5000": lambda: 10**5000, "complex": lambda: 1 + 2j, "fraction": lambda: Fraction(10**400, 3),
    "[]": list, "{}": dict, "()": tuple, "[1, 2]": lambda: [1, 2], "[x]": lambda: ["x"], "nested": lambda: [[[["x"]]]],
    "recursive": lambda: recursive(), "mapping of objects": lambda: {"a": Odd()}, "numbers as keys": lambda: {1: 2},
    "tuple as key": lambda: {(1, 2): 3}, "range": lambda: range(3), "object": Odd, "class": lambda: Odd,
    "function": lambda: len, "module": lambda: math, "generator": lambda: (i for i in range(3)), "set": lambda: {1, 2},
    "bytes": lambda: b"x", "path": lambda: Path("x"), "path of bytes": lambda: os.fsencode("x"),
    "datetime": lambda: datetime.datetime(2020, 1, 1), "exception": lambda: ValueError("x"),
    "float64": lambda: np.float64(3), "float32": lambda: np.float32(0.1), "float16": lambda: np.float16(3),
    "longdouble": lambda: np.longdouble("1e4000"), "int8": lambda: np.int8(3), "uint64": lambda: np.uint64(2**63),
    "bool_": lambda: np.True_, "str_": lambda: np.str_("x"), "complex64": lambda: np.complex64(1j),
    "datetime64": lambda: np.datetime64("2020-01-01"), "array of no dimension": lambda: np.array(3.0),
    "array": lambda: np.array([1.0, 2.0]), "array of two dimensions": lambda: np.ones((2, 2)),
    "array of nan": lambda: np.array([math.nan]), "array of objects": lambda: np.array([Odd()]),
    "array of text": lambda: np.array(["x", "y"]), "masked": lambda: np.ma.masked,
    "record": lambda: np.zeros(2, "i4,f8"),
    "Series": lambda: pd.Series([1.0, 2.0]), "Series of text": lambda: pd.Series(["x"]),
    "Series with names": lambda: pd.Series({"cable.diameter": "3 mm"}), "DataFrame": lambda: pd.DataFrame({"a": [1]}),
    "Index": lambda: pd.Index(["x"]), "NA": lambda: pd.NA, "Timestamp": lambda: pd.Timestamp(0),
}  # fmt: skip
# argument -> forms in which an odd value stands inside what it takes
INSIDE = {
    "path": (lambda odd: {"cable": odd}, lambda odd: {"cable": {**CABLE["cable"], "diameter": odd}},
             lambda odd: {"base": odd}, lambda odd: {**SUSPENSION, "cables": {"west": odd}}),
    "study": (lambda odd: {**STUDY, "vary": odd}, lambda odd: {**STUDY, "columns": odd},
              lambda odd: {**STUDY, "vary": [{"cable.diameter": odd}]}),
    "set": (lambda odd: {"cable.diameter": odd}, lambda odd: [odd], lambda odd: {"gondola": odd}),
    "vary": (lambda odd: {"cable.diameter": odd}, lambda odd: {"cable.preload": [odd, "1 kN"]}, lambda odd: [odd],
             lambda odd: {"cable.preload": {"from": 100, "to": odd, "count": 3}}),
    "columns": (lambda odd: ["sag", odd],),
    "between": (lambda odd: (100, odd),),
    "response": (lambda odd: (0.1, odd, 3), lambda odd: (0.1, 1, odd)),
    "s": (lambda odd: [odd],),
}  # fmt: skip


def recursive():
    """A list that contains itself."""
    items = []
    items.append(items)
    return items


@dataclass(frozen=True)
class Call:
    """One call: a target, and what is odd about its arguments."""

    target: str
    odd: tuple  # of (argument, name of the odd value, place in INSIDE or -1)

    @property
    def is_outside(self):
        """Whether an odd value is an argument itself: what stands inside a mapping is named by its key."""
        return all(place < 0 or argument not in ("path", "study") for argument, _, place in self.odd)

    def value(self, argument, name, place):
        """The odd value, made anew."""
        found = ODD[name]()
        return found if place < 0 else INSIDE[argument][place](found)

    def __str__(self):
        shown = (
            f"{argument}={name}" + (f" inside {place}" if place >= 0 else "") for argument, name, place in self.odd
        )
        return f"{self.target}({', '.join(shown)})"


def targets():
    """Name -> function and arguments that are right, for all public functions and methods."""
    scenes = {"Scene": cs.load(CABLE), "Suspension": cs.load(SUSPENSION)}
    goal = {"Scene": "sag = 10 mm", "Suspension": "west.sag = 1 mm"}
    by = {"Scene": "cable.preload", "Suspension": "cables.west.preload"}
    found = {
        "load": (cs.load, {"path": CABLE}),
        "trade": (cs.trade, {"path": CABLE, "columns": "sag", "repeats": 1}),
        "find": (cs.find, {"path": CABLE, "goal": goal["Scene"], "by": by["Scene"]}),
        "sweep": (cs.sweep, {"study": STUDY}),
        "report": (cs.report, {"path": CABLE, "out": "page.html"}),
        "Scene": (cs.Scene, {"path": "x", "changes": (), **vars_of(scenes["Scene"])}),
        "SceneError": (cs.SceneError, {}),
    }
    for kind, scene in scenes.items():
        given = {
            "loop_response": {"response": "0.1Hz:1Hz:3"}, "loop_in_time": {"time": "1 s"},
            "find": {"goal": goal[kind], "by": by[kind]},
            "trade": {"columns": "sag" if kind == "Scene" else "gondola.x", "repeats": 1},
        }  # fmt: skip
        methods = [name for name in dir(scene) if callable(getattr(scene, name))]
        found |= {f"{kind}.{name}": (getattr(scene, name), given.get(name, {})) for name in methods}
        found[f"{kind}.compute"] = (scene.compute, {"what": "static"})
        model = scene.state_space(modes=1)
        found |= {f"{kind} StateSpace.{name}": (getattr(model, name), {}) for name in ("to_scipy", "to_control")}
        found[f"{kind} StateSpace.response"] = (model.response, {"s": [1j]})
    return found


def vars_of(scene):
    return {"document": scene.document, "model": scene.model}


def singles(found):
    """Every odd value for every argument of every target."""
    for target, (function, _) in found.items():
        for argument, parameter in inspect.signature(function).parameters.items():
            if parameter.kind in (parameter.VAR_KEYWORD, parameter.VAR_POSITIONAL):
                continue
            for place in range(-1, len(INSIDE.get(argument, ()))):
                is_right = place < 0 and parameter.default is None  # to give None, which is no odd call
                yield from (
                    Call(target, ((argument, name, place),)) for name in ODD if not (is_right and name == "None")
                )
        yield Call(target, (("unknown", "3", -1),))


def pair(alone, found, generator):
    """Two odd arguments of one target."""
    target = generator.choice([name for name, (function, _) in found.items() if several(function)])
    own = [call.odd[0] for call in alone if call.target == target]
    while True:
        first, second = generator.sample(own, 2)
        if first[0] != second[0]:
            return Call(target, (first, second))


def several(function):
    """Whether a function has two arguments or more."""
    return len(inspect.signature(function).parameters) > 1


class TooLongError(BaseException):
    """More than SECONDS of processor time."""


def stop(*_):
    raise TooLongError


def run(call, found, unfinite):
    """The findings of one call: list of str; and how it ended: str."""
    function, given = found[call.target]
    odd = {argument: call.value(argument, name, place) for argument, name, place in call.odd}
    unfinite.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        try:
            result = function(**{**given, **odd})
            ended, faults = "a result", list(result_faults(result))
        except TooLongError:
            ended, faults = "too long", [f"more than {SECONDS} s"]
        except Exception as error:
            ended, faults = type(error).__name__, list(error_faults(error, call, odd))
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
    faults += [f"{one.category.__name__}: {one.message!s:.200}" for one in caught if not is_of_one_cable(one)]
    return faults + [f"not finite: {name}" for name in unfinite], ended


def is_of_one_cable(warning):
    """Whether a warning is a line of the program, which it gives where it is called."""
    return warning.category is UserWarning and warning.filename == __file__


def error_faults(error, call, odd):
    """What is wrong with an error."""
    message, kind, last = str(error), type(error), traceback.extract_tb(error.__traceback__)[-1]
    of_check = isinstance(error, TypeError | ValueError) and last.filename in (DOOR, STATE_SPACE, __file__)
    if not (of_check or isinstance(error, cs.CablestudyError)):
        yield f"raised in {Path(last.filename).name}:{last.lineno}: {kind.__name__}: {message:.200}"
    if not message.strip() or len(message) > LONGEST * (message.count("\n") + 1):
        yield f"a message of {len(message)} characters"
    if isinstance(error, cs.SceneError | TypeError | ValueError) and not any(
        "<mapping>" in message or has_word(message, f"{name.rstrip('_')}_?") or mentions(message, odd[name])
        for name in odd
    ):
        yield f"names no argument: {message:.200}"


def has_word(message, pattern):
    """Whether a word stands in a message by itself: `s` is not named by `expected`."""
    return re.search(rf"(?<!\w){pattern}(?!\w)", message) is not None


def mentions(message, value):
    """Whether a message shows the beginning of a value that is text; of a mapping it names a key, or one it lacks."""
    if isinstance(value, pd.Series | dict):
        return "key" in message or any(has_word(message, re.escape(str(key))) for key in value)
    begin = re.split("[\n=]", str(value)[:20])[0].strip(" -") if isinstance(value, str | Path) else ""
    return bool(begin) and begin.partition(".")[0] in message


def result_faults(result):
    """What is wrong with a result."""
    if isinstance(result, Figure):
        result.savefig(io.BytesIO(), format="png")
        matplotlib.pyplot.close(result)
    elif isinstance(result, answer.Values):
        yield from (f"{name} is {value}" for name, value in result.items() if is_wrong(value))
        result._repr_html_()
    elif isinstance(result, answer.Tables | answer.Answer):
        result._repr_html_()
    elif isinstance(result, statespace.StateSpace):
        repr(result)
    elif isinstance(result, np.ndarray) and not np.isfinite(result).all():
        yield "an entry is not finite"
    elif isinstance(result, cs.Scene):
        repr(result)


def is_wrong(value):
    return isinstance(value, float) and not math.isfinite(value)


def watch_tables(unfinite):
    """Let every table that becomes a data frame report cells that are no finite numbers; None is an empty one."""
    plain = answer.frame_of

    def watched(table):
        unfinite.extend(name for row in table.rows for name, value in row.items() if is_wrong(value))
        return plain(table)

    answer.frame_of = watched


def main():
    """The campaign of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--calls", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="targets with this text in their names")
    asked = parser.parse_args()
    signal.signal(signal.SIGPROF, stop)
    generator, unfinite, ends, begin = random.Random(asked.seed), [], Counter(), time.process_time()
    watch_tables(unfinite)
    found = {name: one for name, one in targets().items() if asked.only in name}
    alone = list(singles(found))
    generator.shuffle(alone)
    turn = itertools.cycle(alone)
    calls = [pair(alone, found, generator) if k % 5 == 4 else next(turn) for k in range(asked.calls)]
    findings = 0
    with tempfile.TemporaryDirectory(prefix="cablestudy-calls-") as folder:
        home = Path.cwd()
        os.chdir(folder)
        try:
            for call in calls:
                faults, ended = run(call, found, unfinite)
                ends[ended] += 1
                findings += bool(faults)
                for fault in faults:
                    sys.stdout.write(json.dumps({"call": str(call), "fault": fault}) + "\n")
                    sys.stdout.flush()
        finally:
            os.chdir(home)
    for ended, count in ends.most_common():
        sys.stdout.write(f"{count} times {ended}\n")
    seconds = time.process_time() - begin
    sys.stdout.write(f"{asked.calls} calls, {findings} findings, {seconds:.0f} s\n")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
