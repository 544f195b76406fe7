"""Mutated files of configs/ given to the commands: each must end with an answer or with messages, and write nothing.

    python tests/fuzz.py [--first 0] [--count 3000] [--keep FOLDER]

or `make attack`. Scenes of one cable, suspensions and studies are mutated, some get mutated `--set` options too. File
number n is the same in every run. Every command runs in a process of its own (a fork of this one, in which
everything is imported already) with a limit on time and memory. A finding is printed as a line of JSON, and its file is
kept in FOLDER; the exit code is 1 if there is any.
"""

import argparse
import copy
import json
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import traceback
from collections import Counter
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import yaml

from cablestudy.cli import main as cablestudy

CONFIGS = Path(__file__).parent.parent / "configs"
SECONDS, BYTES = 30.0, 1 << 30  # of processor time and memory that a run may take
STOPPED = 2 * int(SECONDS)  # seconds of processor time after which it is killed
LONGEST = 1000  # characters of a line on standard error
SCENE_COMMANDS = (["static"], ["modes"], ["windrms"], ["ssm"])
# of which a file gets one more; behind the name of the file
MORE_COMMANDS = (
    ["loop"], ["loop", "--response", "0.1Hz:10Hz:9"], ["loop", "--time", "5s:21"], ["ssm", "--response", "0.1:10:9"],
    ["ssm", "--with", "loop"], ["find", "sag = 1 m", "--by", "cable.preload"], ["static", "--case", "all"],
    ["find", "gondola_frequency = 1 Hz", "--by", "gondola.mass"], ["windrms", "--on", "both"], ["static", "--explain"],
)  # fmt: skip
SUSPENSION_COMMANDS = (
    ["static"], ["static", "--explain"], ["static", "--case", "all"], ["static", "--form-finding"],
    ["modes", "-n", "6"], ["windrms"], ["windrms", "--table", "motion"], ["loop"],
    ["loop", "--response", "0.1Hz:10Hz:9"], ["ssm", "--modes", "4"], ["ssm", "--with", "loop", "--modes", "4"],
    ["ssm", "--with", "actuators", "--modes", "4"],
    ["find", "max_tension = 1 kN", "--by", "cable.diameter", "--between", "1mm:30mm"],
    ["find", "max_utilisation = 0.1", "--by", "gravity"],
)  # fmt: skip
STUDY_COMMAND = ["sweep", "--no-write", "--jobs", "1"]
ROWS = 4  # of most studies of suspensions one of the first rows is computed: all of them take up to a minute
FORMATS = ("md", "csv", "json", "jsonl")

EXTREME = ["0", "-1", "1", "1e308", "-1e308", "1e-308", "5e-324", "1e160", "1e-160", "1e303", "1e400", "1e30", "1e-30",
           "1e9", "1e-9", ".nan", ".inf", "-.inf", "nan", "inf", "0x10", "1_000", "١", "1e", "--1",
           "1" * 400]  # fmt: skip
UNITS = ["m", "mm", "kg", "Hz", "N", "rad/s", "m/s", "kg/m^3", "GPa", "deg", "furlong", "m^^2", "m m", "1/0", "degC",
         "%", "kg/", "m**999999", "m^1e9", "°", "lambda", "__import__('os')", "m^-400", "dB", "()", "m*"]  # fmt: skip
TYPES = ["null", "true", "no", "[]", "{}", '""', "text", "[1, 2, 3]", "{a: 1}", "3", "2.5", "[[[]]]", "2020-01-01", "~",
         "- 1", "!!binary aGk=", "!!python/object:os.system {}", "!!float x", "!unknown 1", "? 1", "|", ">-", "@", "%",
         '"\\x1b[31m"', '"\\0"', '"\\u2028"', "'", '"']  # fmt: skip
# keys that scenes and studies know, with values that are right in some file
KNOWN = {
    "gravity": ["9.81", "0", "1.62 m/s^2"],
    "model": ["{accuracy: 1e-4}", "{accuracy: 1e-8}", "{accuracy: 1e-15}", "{elements: 1}", "{elements: 7, order: 3}",
              "{elements: 2, order: 2, mass: consistent}", "{elements: 400}", "{elements: 1000000}"],
    "damping": ["{ratio: 0}", "{ratio: 2}", "{loss_factor: 0.02}", "{model: kelvin_voigt, time: 1 ms}",
                "{time: 1e160}"],
    "gain": ["0", "1e-6", "10", "1000", "{auto: {gain_margin: 6 dB}}", "{auto: {phase_margin: 60 deg}}"],
    "notch": ["none", "{frequency: coupled}", "{frequency: 1e-82}", "{frequency: 3 Hz, damping_ratio: 0}"],
    "loads": ["[{at: 50 m, force: [0, 1, -1]}]", "[{at: 50 m, force: [0, 0, -1]}, {at: 50 m, force: [0, 0, 1]}]", "[]"],
    "location": ["ground", "gondola"],
    "preload": ["10 N", "1 kN", "1 MN"],
    "sag": ["1 mm", "5 m", "100 m"],
    "unstretched_length": ["150 m", "186 m", "1 km"],
    "ends": ["[[0, 0, 0], [0, 0, 100]]", "[[0, 0, 0], [1e-6, 0, 100]]", "[[0, 0, 0], [100, 0, 0]]"],
    "chord": ["100 m"],
    "mass": ["1 g", "1e9 kg", "50 kg"],
    "on": ["cable"],
    "columns": ["[sag, gondola_frequency, gondola_rms]", "[axial_frequency_3, status]", "[]", "[sag, sag]"],
    "vary": ["[{cable.preload: [100 N, 1 kN]}]", "[{gondola.mass: {from: 1 kg, to: 100 kg, count: 3, spacing: log}}]",
             "[{gravity: {from: 0, to: 1e300, count: 1000000000}}]"],
    "base": ["carlina.yaml", "fuzz.yaml", "/dev/null", ".", "absent.yaml", "preload.yaml", "slack.yaml"],
}  # fmt: skip


NAMES = ["-1", "=1+1", "@a", "a b", " a", "a ", "a.b", "a,b", "a=b", "a:b", "ä", "名前", "🙂", "\u202ea", "a\u0301",
         "x" * 300, "null", "true", "1", "status", "all", "case", "x", "cable", "__class__", "<b>", "a|b", "%s",
         "{0}", "$(id)", "../a", "NaN"]  # fmt: skip


class Raw(str):
    """Text that goes into a file as it is."""


class Pairs(list):
    """A mapping as a list of [key, value], in which a key can stand twice."""


def tree(data):
    """A document as Pairs, lists and texts."""
    if isinstance(data, dict):
        return Pairs([key, tree(value)] for key, value in data.items())
    return [tree(value) for value in data] if isinstance(data, list) else str(data)


def emit(node):
    """A node in YAML's flow style."""
    if isinstance(node, Pairs):
        return "{" + ", ".join(f"{scalar(key)}: {emit(value)}" for key, value in node) + "}"
    return "[" + ", ".join(map(emit, node)) + "]" if isinstance(node, list) else scalar(node)


def scalar(text):
    """A plain scalar where the text can be one, else quoted."""
    if isinstance(text, Raw) or re.fullmatch(r"[\w.][\w./ +^*-]*|-?[\d.][\w./ +^*-]*", text):
        return text
    return json.dumps(text, ensure_ascii=False)


def written(top):
    """A document, one line for each of its keys."""
    return "".join(f"{scalar(key)}: {emit(value)}\n" for key, value in top)


def slots(node):
    """Yield (container, index) of every value below a node."""
    for index, item in enumerate(node if isinstance(node, list) else ()):
        yield node, index
        yield from slots(item[1] if isinstance(node, Pairs) else item)


def get(container, index):
    return container[index][1] if isinstance(container, Pairs) else container[index]


def put(container, index, value):
    if isinstance(container, Pairs):
        container[index][1] = value
    else:
        container[index] = value


def pick_value(rng, top):
    return rng.choice(list(slots(top)))


def maps(top):
    """All mappings of a document."""
    return [top, *(get(*slot) for slot in slots(top) if isinstance(get(*slot), Pairs))]


def pick_pair(rng, top):
    return rng.choice([(node, index) for node, index in slots(top) if isinstance(node, Pairs)])


def drop(rng, top):
    node, index = pick_value(rng, top)
    del node[index]


def duplicate(rng, top):
    node, index = pick_value(rng, top)
    node.insert(rng.randrange(len(node) + 1), node[index])


def rename(rng, top):
    node, index = pick_pair(rng, top)
    key = node[index][0]
    place = rng.randrange(len(key) + 1)
    typo = key[:place] + rng.choice(["x", "_", " ", "é", "\u202e", "."]) + key[place:]
    others = [typo, key[:place] + key[place + 1 :], key.upper(), rng.choice(list(KNOWN)), Raw("<<"), Raw("? "), ""]
    node[index] = [rng.choice(others), node[index][1]]


def retype(rng, top):
    put(*pick_value(rng, top), Raw(rng.choice(TYPES)))


NUMBER = re.compile(r"([-+]?\d+\.?\d*(?:e[-+]?\d+)?)(.*)$")


def replace_number(rng, top, text_of):
    """Put a text made of the digits and the unit of a number in its place."""
    if numbers := [(node, index) for node, index in slots(top) if NUMBER.match(str(get(node, index)))]:
        slot = rng.choice(numbers)
        put(*slot, text_of(*NUMBER.match(get(*slot)).groups()))


def scale(rng, top):
    """Another number of the same kind."""

    def scaled(number, unit):
        factor = 10 ** rng.choice([rng.uniform(-0.3, 0.3), rng.uniform(-3, 3), rng.uniform(-15, 15)])
        return Raw(f"{float(number) * factor:.6g}{unit}")

    replace_number(rng, top, scaled)


def magnify(rng, top):
    """An extreme number."""
    replace_number(rng, top, lambda number, unit: Raw(rng.choice(EXTREME) + unit))


def negate(rng, top):
    """Another sign, or zero."""
    replace_number(rng, top, lambda number, unit: Raw(f"{rng.choice([0.0, -1.0]) * float(number):g}{unit}"))


def reunit(rng, top):
    replace_number(rng, top, lambda number, unit: f"{number} {rng.choice(UNITS)}")


def graft_in_place(rng, top):
    """A key of the document gets another of its known values."""
    if there := [(node, k) for node, k in slots(top) if isinstance(node, Pairs) and node[k][0] in KNOWN]:
        node, index = rng.choice(there)
        node[index][1] = Raw(rng.choice(KNOWN[node[index][0]]))


def graft(rng, top):
    """A known key anywhere."""
    key = rng.choice(list(KNOWN))
    rng.choice(maps(top)).append([key, Raw(rng.choice(KNOWN[key]))])


def transplant(rng, top):
    """A part of the document in another place of it."""
    put(*pick_value(rng, top), copy.deepcopy(get(*pick_value(rng, top))))


def anchor(rng, top):
    """Merge keys, anchors and aliases, right and wrong."""
    node, index = pick_value(rng, top)
    text = emit(get(node, index))
    kind = rng.randrange(6)
    if kind == 0:
        put(node, index, Raw(f"&a {text}"))
        put(*pick_value(rng, top), Raw("*a"))
    elif kind == 1:
        put(node, index, Raw(rng.choice(["*a", "*", "&", "&a", "&a [*a]", "&a {x: *a}", "&a &b 1"])))
    elif kind == 2:
        bomb = "[" + ", ".join(f"&b{k} [{', '.join([f'*b{k - 1}'] * 9)}]" for k in range(1, 12)) + "]"
        put(node, index, Raw(bomb.replace("*b0", "1")))
    else:
        merged = ["3", "*a", "[1, 2]", "{gravity: 1}", "null", "[{a: 1}, {a: 2}]", "text", "{<<: {a: 1}}", text]
        merged = rng.choice(merged)
        rng.choice(maps(top)).insert(0, [Raw("<<"), Raw(merged)])


def nest(rng, top):
    node, index = pick_value(rng, top)
    depth = rng.choice([2, 30, 300, 3000, 30_000])
    opening, closing = rng.choice([("[", "]"), ("{a: ", "}"), ("[{a: ", "}]")])
    put(node, index, Raw(opening * depth + emit(get(node, index)) + closing * depth))


def lengthen(rng, top):
    node, index = pick_value(rng, top)
    size = rng.choice([1_000, 100_000])
    texts = ["x" * size, "1" * size, "9.8 " + "m" * size, "[" + "1, " * size + "1]", '"' + "\\t" * size + '"']
    text = rng.choice(texts)
    if isinstance(node, Pairs) and rng.random() < 0.3:
        node[index] = ["k" * size, node[index][1]]
    else:
        put(node, index, Raw(text))


def rename_everywhere(rng, top):
    """A name of a suspension or case that is hard to handle, wherever it stands."""
    named = [get(node, k) for node, k in slots(top) if isinstance(node, Pairs) and node[k][0] in TABLES_OF_NAMES]
    if named := [table for table in named if isinstance(table, Pairs) and table]:
        table = rng.choice(named)
        pair = rng.choice(table)
        old, pair[0] = pair[0], rng.choice(NAMES)
        for node, k in slots(top):
            text = get(node, k)
            if isinstance(text, str) and old in (text, text.partition(".")[0]):
                put(node, k, pair[0] + text[len(old) :])


TABLES_OF_NAMES = ("points", "bodies", "cables", "cases", "attachments", "markers", "actuators", "materials")


def crossbreed(rng, top):
    """A part of another document, at the place that it has there or at the same key anywhere."""
    other = tree(SOURCES[rng.choice(list(SOURCES))])
    key, value = rng.choice([node[k] for node, k in slots(other) if isinstance(node, Pairs)])
    there = [(node, k) for node, k in slots(top) if isinstance(node, Pairs) and node[k][0] == key]
    if there and rng.random() < 0.7:
        put(*rng.choice(there), value)
    else:
        rng.choice(maps(top)).append([key, value])


def swap(rng, top):
    """Two values, each in the other's place."""
    one, other = pick_value(rng, top), pick_value(rng, top)
    first, second = get(*one), get(*other)
    put(*one, copy.deepcopy(second))
    put(*other, copy.deepcopy(first))


MILD = (scale, scale, graft_in_place, negate)
ROUGH = (drop, duplicate, rename, retype, magnify, reunit, graft, transplant, anchor, nest, lengthen,
         rename_everywhere, crossbreed, swap)  # fmt: skip


def damage(rng, data):
    """Damage to the bytes of a file: cut, characters changed, lines moved, control characters."""
    place = rng.randrange(len(data) + 1)
    kind = rng.randrange(9)
    if kind == 0:
        return data[:place]
    if kind == 7:
        return data.replace(b"\n", b"\r\n")
    if kind == 8:
        return b"\xef\xbb\xbf" + data.replace(b": ", b":\t", rng.randrange(3))
    if kind == 1:
        strange = [b"\0", b"\x07", b"\x1b[31m", b"\x7f", b"\xff", b"\xc3", "\u2028".encode(), b"\xef\xbb\xbf", b"\x85",
                   b"\t", b"\r", b"\n", b"---\n", b"...\n", b"%YAML 1.1\n", b"#", b":", b"- ", b"{", b"]", b'"', b"&a ",
                   b"<<: 3\n"]  # fmt: skip
        return data[:place] + rng.choice(strange) + data[place:]
    if kind == 2:
        return data[:place] + data[place + 1 :]
    if kind == 3:
        return data[:place] + data[rng.randrange(len(data) + 1) :]
    lines = data.splitlines(keepends=True) or [b""]
    line = rng.randrange(len(lines))
    if kind == 4:
        lines.insert(rng.randrange(len(lines) + 1), lines[line])
    elif kind == 5:
        lines[line] = b" " * rng.randrange(1, 5) + lines[line]
    else:
        return b"\xff\xfe" + data.decode(errors="replace").encode("utf-16-le")
    return b"".join(lines)


def sources():
    """Scenes (their bases put in) and studies of configs/ as trees, by name."""
    found = {}
    for path in sorted([*CONFIGS.glob("*.yaml"), *(CONFIGS / "suspensions").glob("*.yaml")]):
        if path.name not in SLOW:
            found[path.name] = read(path)
    return found


def read(path):
    """The plain values of a file, of a scene upon those of its bases."""
    data = yaml.load(path.read_text(encoding="utf-8"), yaml.BaseLoader)
    return data if STUDY_KEYS & set(data) or "base" not in data else over(read(path.parent / data.pop("base")), data)


def over(lower, upper):
    """Mappings, one upon the other."""
    if not (isinstance(lower, dict) and isinstance(upper, dict)):
        return upper
    return lower | {key: over(lower[key], value) if key in lower else value for key, value in upper.items()}


SLOW = ("net-30x30.yaml",)
STUDY_KEYS = {"vary", "sample", "columns"}
SOURCES = sources()


SCENES = [name for name in SOURCES if not STUDY_KEYS & set(SOURCES[name])]


def chosen(number):
    """A generator of random numbers for file `number`, and the name of the file that it began as."""
    rng = random.Random(f"cablestudy {number}")
    # scenes are few and reach more code
    return rng, rng.choice(SCENES if rng.random() < 0.6 else list(SOURCES))


def mutated(number):
    """File number `number`: its bytes, and what it began as: study, suspension or scene."""
    rng, name = chosen(number)
    top = tree(SOURCES[name])
    mild = rng.random() < 0.6  # such files reach the solvers
    for _ in range(rng.choice([1, 1, 2, 3] if mild else [1, 1, 1, 2, 3])):
        if top:
            rng.choice(MILD if mild else ROUGH)(rng, top)
    data = written(top).encode(errors="surrogatepass")
    kind = "study" if name not in SCENES else "suspension" if "cables" in SOURCES[name] else "scene"
    return data if mild or rng.random() < 0.8 else damage(rng, data), kind


def mutated_sets(number):
    """Options `--set` that go with a file, mostly none."""
    rng = random.Random(f"cablestudy sets {number}")
    found, data = [], SOURCES[rng.choice(list(SOURCES))]
    while rng.random() < 0.15:
        path, value = [], data
        while isinstance(value, (dict, list)) and value and (not path or rng.random() < 0.85):
            key = rng.choice(list(value) if isinstance(value, dict) else range(len(value)))
            path.append(str(key))
            value = value[key]
        if rng.random() < 0.1:
            path.insert(rng.randrange(len(path) + 1), rng.choice(NAMES))
        texts = [*EXTREME, *TYPES, *(f"{rng.choice(EXTREME)} {unit}" for unit in UNITS), *NAMES]
        value = rng.choice(texts) if rng.random() < 0.8 else emit(tree(value))
        found += ["--set", f"{'.'.join(path)}={value}".replace("\0", "")]
    return found


@dataclass(frozen=True)
class Run:
    """How a command ended: exit code (negative: the signal that ended it), processor time [s], memory [bytes]."""

    arguments: list
    code: int
    out: str
    err: str
    seconds: float
    memory: int


def run(arguments, folder):
    """Run a command in a fork of this process."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = os.fork()
        if not child:
            _child(arguments, folder, out.fileno(), err.fileno())
        _, status, usage = os.wait4(child, 0)
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read().decode(errors="backslashreplace"))
    seconds = usage.ru_utime + usage.ru_stime
    return Run(arguments, os.waitstatus_to_exitcode(status), *texts, seconds, usage.ru_maxrss * 1024)


def _child(arguments, folder, out, err):
    """The command, its limits and its streams; never returns."""
    code = 1
    try:
        os.dup2(out, 1)
        os.dup2(err, 2)
        os.chdir(folder)
        resource.setrlimit(resource.RLIMIT_CPU, (STOPPED, STOPPED + 10))  # first SIGXCPU, then SIGKILL
        resource.setrlimit(resource.RLIMIT_AS, (4 * BYTES, 4 * BYTES))
        signal.alarm(60 * STOPPED)  # for what waits without computing, on a busy machine
        cablestudy(arguments, prog_name="cablestudy")
    except SystemExit as end:
        code = end.code or 0
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(code)


def faults(done):
    """Yield what is wrong with the end of a command."""
    lines = done.err.splitlines()
    # a sweep that says how long it will take may take so long, and a search that says what it is at
    announced = re.search(r"^(\d+ of \d+ rows, .* (\d\d s|min|h) left|\w+: \d\d+ s, .+)$", done.err, re.MULTILINE)
    if "Traceback" in done.err:
        yield f"traceback: {lines[-1][:200]}"
    elif done.code not in (0, 2, 3) and not (announced and done.code == -signal.SIGXCPU):
        yield f"exit code {done.code}"
    yield from (f"warning: {line[-200:]}" for line in lines if "Warning: " in line)
    longest = max(map(len, lines), default=0)
    for wrong, what in (
        (done.seconds > SECONDS and not announced, f"{done.seconds:.0f} s"),
        (done.memory > BYTES, f"{done.memory / BYTES:.1f} GB"),
        (done.code in (2, 3) and not lines, f"exit code {done.code} without a message"),
        (longest > LONGEST, f"a message of {longest} characters"),
        (re.search(r"[\x00-\x08\x0b-\x1f\x7f]", done.err), "a control character in a message"),
        (done.code == 2 and done.out and done.arguments[0] != "validate", "a table beside a refusal"),
        (re.search(r"\b(nan|inf|NaN|Infinity)\b", done.out), "a number that is not finite"),
    ):
        if wrong:
            yield what


def content(folder):
    """Names and bytes of all files."""
    return {path: path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()}


def examine(number, folder):
    """Yield (Run, faults) of each command on a file; of a file that is refused, of two commands."""
    data, kind = mutated(number)
    (Path(folder) / "fuzz.yaml").write_bytes(data)
    before = content(folder)
    study, several = kind == "study", kind == "suspension"
    style = ["--format", FORMATS[2 * (number % 2) if several else number % len(FORMATS)]]
    sets = [] if study else mutated_sets(number)
    first = study_command(number) if study else (SUSPENSION_COMMANDS if several else SCENE_COMMANDS)[number % 4]
    commands = [["validate"], first]
    if number % 50 == 0:
        commands += [["static"], STUDY_COMMAND]  # also of the wrong kind of file
    for place, command in enumerate(commands):
        done = run([command[0], "fuzz.yaml", *command[1:], *style, *sets], folder)
        found = list(faults(done))
        after = content(folder)
        if after != before:
            new = sorted(after.keys() - before)
            found.append("written: " + ", ".join(str(path.relative_to(folder)) for path in new))
            for path in new:
                path.unlink()
        yield done, found
        if place == 0 and done.code == 0 and several:
            commands += [SUSPENSION_COMMANDS[(number // 4 + k) % len(SUSPENSION_COMMANDS)] for k in (0, 5)]
        elif place == 0 and done.code == 0 and not study:
            commands += [command for command in SCENE_COMMANDS if command != first]
            commands.append(MORE_COMMANDS[number // 4 % len(MORE_COMMANDS)])


def study_command(number):
    """The command for the study that file `number` began as."""
    small = (CONFIGS / chosen(number)[1]).exists() or number % 10 == 0
    return STUDY_COMMAND if small else [*STUDY_COMMAND, "--row", str(1 + number % ROWS)]


def prepared(folder):
    """Copy configs/ to a folder, and run each command once so that everything is imported."""
    shutil.copytree(CONFIGS, folder, dirs_exist_ok=True)
    for path in (CONFIGS / "suspensions").glob("*.yaml"):  # bases of their studies are beside them
        shutil.copy(path, folder)
    with open(os.devnull, "w") as sink, redirect_stdout(sink):
        for command in (*([*command, f"{folder}/carlina.yaml"] for command in SCENE_COMMANDS),
                        *([name, f"{folder}/fast-wind.yaml"] for name in ("static", "modes", "ssm", "windrms", "loop")),
                        [*STUDY_COMMAND, f"{folder}/emodulus.yaml"]):  # fmt: skip
            cablestudy([*command, "--quiet"], standalone_mode=False)


def main():
    """Run the files that were asked for; print findings and, at the end, how the runs ended."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=3000)
    parser.add_argument("--keep", type=Path, help="folder for the files of findings")
    options = parser.parse_args()
    ends, findings = Counter(), 0
    with tempfile.TemporaryDirectory(prefix="cablestudy-fuzz-") as folder:
        prepared(folder)
        for number in range(options.first, options.first + options.count):
            for done, found in examine(number, folder):
                ends[done.arguments[0], done.code] += 1
                if not found:
                    continue
                findings += 1
                line = {"file": number, "command": " ".join(done.arguments), "found": found}
                line["seconds"] = round(done.seconds, 1)
                sys.stdout.write(json.dumps(line, ensure_ascii=False) + "\n")
                sys.stdout.flush()
                if options.keep:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    (options.keep / f"{number}.yaml").write_bytes(mutated(number)[0])
                    (options.keep / f"{number}.{done.arguments[0]}.txt").write_text(done.err[-20_000:])
    for (command, code), count in sorted(ends.items()):
        sys.stdout.write(f"{command}: {count} times exit code {code}\n")
    sys.stdout.write(f"{options.count} files, {findings} findings\n")
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
