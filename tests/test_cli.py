"""The command line: exit codes, what goes to which stream, formats, pipes, signals, and what is imported when."""

import json
import math
import os
import py_compile
import shlex
import signal
import subprocess
import sys
import tomllib
from functools import partial
from pathlib import Path

import click
import pytest
import yaml
from campaign import campaign
from command import (
    CARLINA,
    CONFIGS,
    LONGEST,
    ROOT,
    SLACK,
    process,
    python,
    refusal,
    rows_of,
    run,
    study_file,
    table_of,
    with_sets,
    write,
)
from picture import undrawn
from solved import contents
from twins import held, swinging, without

import cablestudy
from cablestudy import __version__
from cablestudy.cli import main
from cablestudy.cli.options import OneValueEach
from cablestudy.interface import reference
from cablestudy.study.one_cable import report

GUY = CONFIGS / "guy.yaml"

pytestmark = pytest.mark.usefixtures("folder")

PRELOAD = str(CONFIGS / "preload.yaml")
TOO_SLACK = ("--set", "cable.preload=1 N")
HEAVY = ("numpy", "scipy", "pandas", "pydantic", "pint", "matplotlib", "yaml")
SUSPENSIONS = "cablestudy.study.suspension.case"
LOOPS = "cablestudy.control.loop_gain"
PARTS = ("scipy.optimize", "scipy.interpolate", "scipy.linalg", "scipy.signal", SUSPENSIONS, LOOPS)  # slow to import


COMMANDS = {
    0: [f"{command} CARLINA --set model.elements=1" for command in ("static", "modes")],  # a single bar has no mode
    2: [
        "static", "static CARLINA --set", "static CARLINA --sett gravity=1", "modes CARLINA -n 0",
        "modes CARLINA -n 3 --upto 3Hz", "modes CARLINA --upto 3m", "modes CARLINA --upto -3",
        "modes CARLINA --upto nan", "schema table", "trade CARLINA --repeats 0",
        "sweep PRELOAD --no-write --jobs 0", "sweep PRELOAD --no-write --rtol 1e-3",
        "sweep PRELOAD --check --rtol nan", "sweep PRELOAD --check --rtol -1",
    ],
    3: ["trade CARLINA --set cable.preload=1N", "modes SLACK -n 100000"],  # less than its weight asks for; too many
}  # fmt: skip


@pytest.mark.parametrize(("command", "code"), [(one, code) for code, several in COMMANDS.items() for one in several])
def test_exit_codes(command, code):
    files = {"CARLINA": CARLINA, "SLACK": SLACK, "PRELOAD": PRELOAD}
    outcome = run(*(files.get(word, word) for word in command.split()), code=code)
    assert "Traceback" not in outcome.err
    if code == 2:
        assert outcome.out == ""
        assert outcome.err


@pytest.mark.parametrize(
    "arguments",
    [["static", CARLINA], ["static", CARLINA, "--shape"], ["modes", CARLINA], ["sweep", PRELOAD, "--no-write"],
     ["validate", CARLINA, PRELOAD], ["columns"]],
    ids=" ".join,
)  # fmt: skip
def test_formats_say_the_same(arguments):
    texts = {style: run(*arguments, "--format", style).out for style in ("md", "csv", "json", "jsonl")}
    tables = {style: rows_of(texts[style], style) for style in ("csv", "json", "jsonl")}
    assert tables["json"] == tables["jsonl"]
    columns = json.loads(texts["json"])["columns"]
    for one, other in zip(tables["csv"], tables["json"], strict=True):
        assert list(one) == list(other) == list(columns)
        assert one == {name: cell if cell != "" else None for name, cell in other.items()}
    lines = texts["md"].splitlines()
    assert all(line.startswith("|") and line.endswith("|") for line in lines)
    assert all(set(line) <= set("|:-") for line in lines[1:2])
    if arguments[0] != "static" or "--shape" in arguments:
        assert len(lines) == 2 + len(tables["csv"])


@pytest.mark.parametrize(
    ("arguments", "size", "most"),
    [
        (["modes", "--set", "model.elements=1000000"], "12 modes of a model with 1999998 unknowns", 294117),
        (["modes", "-n", "2500", "--set", "model.elements=10000"], "2500 modes of a model with 19998 unknowns", 3000),
        (["ssm", "--set", "model.elements=10000"], "600 modes of a model with 19998 unknowns", 8264),
        (["windrms", "--set", "model.elements=10000"], "436 modes of a model with 19998 unknowns", 11337),
        (["static", "--set", "model={elements: 20000, order: 64}"], "20000 elements of order 64 have 1280000 nodes",
         1000000),
    ],
    ids=lambda value: " ".join(value[:1]) if isinstance(value, list) else None,
)  # fmt: skip
def test_a_model_that_is_too_large_is_refused_with_its_size(arguments, size, most):
    (line,) = run(arguments[0], CARLINA, *arguments[1:], code=3).lines
    assert all(words in line for words in (size, f"(at most {most}", "fewer elements"))


def test_json_carries_units_and_a_single_scene_is_one_row():
    table = json.loads(run("static", CARLINA, "--format", "json").out)
    names = ("end_stiffness_N_per_m", "density_kg_per_m3", "status")
    assert [table["columns"][name] for name in names] == ["N/m", "kg/m^3", ""]
    (row,) = table["rows"]
    assert (row["status"], row["unstretched_length_m"]) == ("ok", 184.4883)  # as it was given


@pytest.mark.parametrize("style", ["md", "csv", "json", "jsonl"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("command", "module", "function"),
    [
        ("static", report, "static_table"),
        ("modes", report, "mode_table"),
        ("validate", reference, "validate_table"),
        ("columns", reference, "columns_table"),
    ],
)
def test_a_number_that_is_not_finite_is_never_printed(monkeypatch, command, module, function, value, style):
    original = getattr(module, function)

    def spoilt(*arguments):
        found = original(*arguments)
        table = found[0] if isinstance(found, tuple) else found
        table.rows[-1][table.fields[0].name] = value
        return found

    monkeypatch.setattr(module, function, spoilt)
    line = refusal(command, *([] if command == "columns" else [GUY]), "--format", style, code=3)
    assert line.endswith(" is not a finite number")


def test_markdown_has_four_digits_and_units():
    text = run("static", CARLINA).out
    assert "| preload                  |      1345 | N      |" in text
    assert text.startswith("| quantity")


def test_dash_is_standard_input_and_set_changes_keys(folder):
    text = (CONFIGS / "carlina.yaml").read_text(encoding="utf-8")
    assert run("static", "-", stdin=text).out == run("static", CARLINA).out
    # the stress of 1 kN on a circle of 2 mm: F/(pi d^2/4) = 318.3 MPa
    (row,) = table_of("static", CARLINA, *with_sets("cable.diameter=2mm", "cable.preload=1 kN", "gravity=0"))
    assert row["stress_MPa"] == pytest.approx(1000 / math.pi, rel=1e-12)
    study = f"base: {CARLINA}\nvary: [{{gondola.mass: [1, 2]}}]\ncolumns: [gondola_frequency_static]\n"
    run("sweep", "-", stdin=study)
    left = {path.name for path in (folder / "results").iterdir()}
    assert left == {"stdin.csv", "stdin.md", "stdin.run.yaml", "stdin.rows.sqlite"}
    assert run("static", "-", stdin="", code=2).err == "<stdin>: empty file\n"


def test_paths_are_relative_to_the_file_that_names_them(folder):
    (folder / "önline").mkdir()
    write(folder / "önline" / "cäble.yaml", f"base: {CARLINA}\n")
    study_file(folder / "önline", "vary: [{gravity: [1, 2]}]\ncolumns: [sag]\n", base="cäble.yaml")
    rows = table_of("sweep", "önline/study.yaml", "--no-write")
    assert [row["gravity_m_per_s2"] for row in rows] == [1, 2]
    assert rows[1]["sag_m"] == pytest.approx(2 * rows[0]["sag_m"], rel=1e-4)  # taut: in proportion to the weight


def test_notes_go_to_standard_error_and_quiet_silences_them(folder):
    plain = run("static", CARLINA)
    assert plain.err == ""
    explained = run("static", CARLINA, "--explain")
    assert (explained.out, "40 elements of order 1" in explained.err) == (plain.out, True)
    assert "no elements" in run("static", SLACK, "--explain").err
    assert "estimated error" in run("modes", SLACK, "--explain").err
    assert run("static", CARLINA, "--explain", "--quiet").err == ""
    noisy, quiet = run("modes", CARLINA, "-n", "500"), run("modes", CARLINA, "-n", "500", "--quiet")
    assert noisy.lines[-1] == "the model has 117 modes, not 500"
    assert (quiet.out, quiet.err) == (noisy.out, "")
    assert run("sweep", PRELOAD, "--quiet").err == ""
    assert run("sweep", PRELOAD, "--check").err == "results/preload.csv: agrees\n"
    assert run("sweep", PRELOAD, "--check", "--quiet").err == ""


@pytest.mark.parametrize(
    ("words", "written"),
    [
        (("sweep", PRELOAD, "--plot", "a.png"), ["results/preload.csv", "results/preload.md", "a.png"]),
        (("sweep", PRELOAD, "--shard", "1/1"), ["results/preload.shard-1-of-1.sqlite"]),
        (("static", CARLINA, "--plot", "b.png"), ["b.png"]),
        (("ssm", CARLINA, "--out", "c.npz"), ["c.npz"]),
        (("report", PRELOAD), ["preload.html"]),
        (("new", "guy"), ["guy.yaml"]),
    ],
)
@undrawn()
def test_quiet_hides_what_was_written_too(folder, words, written):
    said = run(*words).err
    assert all(name in said for name in written)
    for name in written:
        (folder / name).unlink()
    assert run(*words, "--quiet").err == ""
    assert all((folder / name).is_file() for name in written)


@pytest.mark.parametrize("command", ["windrms", "ssm", "modes"])
def test_damping_that_is_assumed_is_said(folder, command):
    text = (CONFIGS / "carlina.yaml").read_text(encoding="utf-8")
    bare = "".join(line for line in text.splitlines(keepends=True) if "damping: {model: modal, ratio" not in line)
    write(folder / "bare.yaml", bare)
    said = "damping: none is given for the scene; modal, with a ratio of 1 %, is assumed"
    found = run(command, "bare.yaml", "--explain")
    assert (said in found.lines) == (command != "modes")  # undamped modes need none
    assert said not in run(command, CARLINA, "--explain").err
    assert said not in run(command, "bare.yaml", "--explain", "--set", "cable.damping.ratio=0.01").err
    assert said not in run(command, "bare.yaml").err
    assert found.out == run(command, CARLINA).out


def test_errors_are_shown_even_when_quiet():
    for command in ("static", "modes"):
        assert run(command, CARLINA, "--quiet", *TOO_SLACK, code=3).lines[0].startswith(f"{CARLINA}: a mean tension of")
    assert run("static", CARLINA, "--quiet", "--set", "gravty=1", code=2).err.startswith("--set gravty: unknown key")


@pytest.mark.parametrize("model", ["{elements: 40}", "{accuracy: 1e-4}"])
def test_a_stress_above_the_strength_is_an_answer(model):
    """Aramid of 3000 MPa and 2.69 mm^2 holds 8.07 kN."""
    damping = "cable.damping={model: hysteretic, loss_factor: 0.02}"
    sets = with_sets("cable.preload=100 kN", f"model={model}", damping, "winch=null")
    said = "warning: the stress of 3.717e+04 MPa is above the strength of 3000 MPa"
    for command, *options in (("static",), ("modes", "-n", 3), ("ssm", "--modes", 3), ("windrms",)):
        outcome = run(command, CARLINA, *options, *sets)
        assert [line for line in outcome.lines if "strength" in line] == [said], command
        assert outcome.out
        assert "strength" not in run(command, CARLINA, *options, *sets, "--quiet").err
    (row,) = table_of("static", CARLINA, *sets)
    assert row["status"] == "over strength"
    assert row["utilisation"] == pytest.approx(100e3 / 2.69e-6 / 3000e6, rel=1e-4)
    assert "| over strength |" in run("static", CARLINA, *sets).out
    assert len(table_of("static", CARLINA, "--shape", *sets)) == 41
    # the frequencies of a taut string, which an answer has
    string = math.sqrt(100e3 / (1440 * 2.69e-6) * (1 + 100e3 / (70.3e9 * 2.69e-6))) / (2 * 185.8)
    assert table_of("modes", CARLINA, *sets)[0]["frequency_Hz"] == pytest.approx(string, rel=3e-4)


def test_a_tension_above_the_breaking_force_of_a_cable_without_an_area(folder):
    """H = 12 kN and half of its weight at the ends: 10 times 9.81 N."""
    section = "axial_stiffness: 1 GN, mass_per_length: 1 kg/m, breaking_force: 12 kN"
    write(folder / "rope.yaml", f"cable: {{chord: 20 m, {section}, preload: 12 kN}}\n")
    (row,) = table_of("static", "rope.yaml")
    warning = "warning: the tension of 1.2e+04 N is above the breaking force of 1.2e+04 N"
    assert run("static", "rope.yaml").lines == [warning]
    assert row["status"] == "over strength"
    assert 1 < row["utilisation"] < math.hypot(1, 10 * 9.81 / 12e3)


@pytest.mark.parametrize("count", campaign([1, 2, 116, 117, 118, 1000], [1, 116, 117, 118]))
def test_modes_one_two_all_and_more_than_there_are(count):
    rows = table_of("modes", CARLINA, "-n", count)
    assert [row["number"] for row in rows] == list(range(1, min(count, 117) + 1))  # 39 free nodes in space
    frequencies = [row["frequency_Hz"] for row in rows]
    assert frequencies == sorted(frequencies)
    assert frequencies[0] == pytest.approx(1.59, abs=0.005)  # Table 2


def test_modes_up_to_a_frequency_with_a_unit():
    everything = [row["frequency_Hz"] for row in table_of("modes", CARLINA, "-n", 117)]
    for written, limit in (("8", 8), ("8 Hz", 8), ("0.02 kHz", 20), ("1 Hz", 1), (everything[3], everything[3])):
        found = [row["frequency_Hz"] for row in table_of("modes", CARLINA, "--upto", written)]
        assert found == pytest.approx([f for f in everything if f <= limit], rel=1e-12)
    assert table_of("modes", SLACK, "--upto", "0.1 Hz") == []


@pytest.mark.parametrize("name", main.list_commands(None))
def test_help_names_every_option_and_says_what_it_does(name):
    command = main.get_command(None, name)
    text = run(name, "--help").out
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help, parameter.name
            assert all(option in text for option in parameter.opts)
    assert command.help
    assert isinstance(command, OneValueEach)  # which refuses an option given twice
    assert f"  {name} " in run("--help").out


def test_every_command_that_reads_has_the_common_options():
    for name in ("static", "modes", "sweep", "validate"):
        options = {option for parameter in main.get_command(None, name).params for option in parameter.opts}
        assert {"--set", "--format", "--quiet"} <= options
        assert name == "validate" or {"--explain", "--plot"} <= options


def test_python_m_cablestudy_is_the_command():
    assert process("--version").out == f"cablestudy, version {__version__}\n"
    missing = "cablestudy static: Missing argument 'SCENE' ('cablestudy static --help' shows how)\n"
    assert process("static").err == missing
    message = "Option '--locus' requires an argument ('cablestudy static --help' shows how)"
    assert process("static", "--locus").err == f"cablestudy static: {message}\n"


def test_the_licence_is_in_the_project_file():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["license"] == "BSD-3-Clause"
    (name,) = project["license-files"]
    assert (ROOT / name).read_text(encoding="utf-8").startswith("BSD 3-Clause License\n")


IMPORTS = f"""
import json, os, sys
from cablestudy.cli import main
commands = json.load(sys.stdin)
for place, command in enumerate(commands):
    if place and (child := os.fork()):
        assert os.waitpid(child, 0)[1] == 0
        continue
    try:
        with open(os.devnull, "w") as sys.stdout:
            main(command)
    except SystemExit as stop:
        assert not stop.code, stop.code
    imported = sorted(set({(*HEAVY, *PARTS)!r}) & sys.modules.keys())
    sys.__stdout__.write(json.dumps(imported) + chr(10))
    sys.__stdout__.flush()
    if place:
        os._exit(0)
"""


def imported(*commands):
    """Set of those of HEAVY and PARTS that are imported by each command: the first in a process, others in its forks.

    So each has what the first one imports.
    """
    printed = python(IMPORTS, input=json.dumps([list(map(str, words)) for words in commands]))
    found = [set(json.loads(line)) for line in printed.splitlines()]
    assert len(found) == len(commands)
    return found


def test_help_imports_nothing_but_click():
    assert imported(("--help",), ("sweep", "--help"), ("--version",)) == [set(), set(), set()]


def test_a_command_imports_only_what_it_needs(folder):
    scene = folder / "plain.yaml"
    write(scene, "cable: {ends: [[0, 0, 0], [10, 0, 0]], elastic_modulus: 1e9, density: 1000, area: 1e-6,\n"
                     "        unstretched_length: 9.9}\n")  # fmt: skip
    csv = "--format", "csv"
    numbers, study, tables, units, columns, column_rows = imported(
        ("static", scene, *csv), ("sweep", CONFIGS / "preload.yaml", "--out", folder), ("static", scene),
        ("static", scene, "--set", "cable.area=0.01 inch^2"), ("columns",), ("columns", *csv),
    )  # fmt: skip
    for found in (numbers, study, column_rows):
        assert found & {"pint", "pandas", "matplotlib"} == set()
    assert "pandas" not in tables | columns
    assert "pint" in units


NEEDED = {
    ("static", "guy.yaml"): set(),  # lengths from a preload, units such as kg/m^3
    ("static", "line.yaml"): set(),  # the clearance above a profile of the ground
    ("static", "suspensions/trifilar.yaml"): {SUSPENSIONS},
    ("static", "suspensions/cable-robot.yaml"): {SUSPENSIONS},  # tensions that no bound changes
    ("modes", "carlina.yaml"): set(),  # masses are lumped
    ("windrms", "carlina.yaml"): {LOOPS},
    ("loop", "carlina.yaml"): {LOOPS},
    ("static", "suspensions/net-2x2.yaml"): {SUSPENSIONS},  # form by force densities, few free points
    ("static", "suspensions/carlina-balloon-wind.yaml"): {SUSPENSIONS},  # a body on a free point
    ("windrms", "suspensions/fast-wind.yaml"): {SUSPENSIONS, LOOPS},  # mean wind on cables
}


def test_what_is_slow_to_import_is_imported_for_what_needs_it_alone():
    """Half of the time of most commands on one scene is that of imports."""
    found = imported(*((command, CONFIGS / file, "--quiet") for command, file in NEEDED))
    for command, modules in zip(NEEDED, found, strict=True):
        assert modules - {"numpy", "pydantic", "yaml"} <= NEEDED[command], command


@pytest.mark.parametrize(
    "command",
    ["static SLACK --shape --set model.elements=5000", "columns", "schema scene",
     "sweep study.yaml --dry-run --format md", "sweep study.yaml --dry-run --format jsonl"],
)  # fmt: skip
def test_a_reader_that_has_had_enough_ends_the_command_quietly(folder, command):
    study_file(folder, "vary: [{gravity: {from: 1, to: 9, count: 1000000}}]\ncolumns: [mass]\n")
    command = [sys.executable, "-m", "cablestudy", *command.replace("SLACK", SLACK).split()]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
        assert child.stdout.readline()
        child.stdout.close()
        error = child.stderr.read()
        assert child.wait(timeout=LONGEST) == 0
    assert error == b""


SHORT, LONG = ("[1345 N, 1 N]", 1), ("{from: 1 N, to: 2 N, count: 100}", 1)  # preloads, processes
BY_PROCESSES = "{from: 1 N, to: 2 N, count: 3000}", 2


@pytest.mark.parametrize(("preloads", "jobs"), campaign([SHORT, LONG, BY_PROCESSES], [SHORT, LONG]))
def test_a_reader_that_has_had_enough_hides_no_failure(folder, preloads, jobs):
    """The exit code is that of a command that is read to the end, of tables that a pipe holds whole and of others."""
    study = study_file(folder, f"vary: [{{cable.preload: {preloads}}}]\ncolumns: [sag]\n")
    command = [sys.executable, "-m", "cablestudy", "sweep", study, "--no-write", "--quiet", "--jobs", str(jobs)]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "pipesize": 4096}
    with subprocess.Popen(command, **streams) as child:
        child.stdout.close()
        assert child.wait(timeout=LONGEST) == 3


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no such device here")
@pytest.mark.parametrize("word", ["columns", "--help", "--version"])
def test_a_full_disk_is_one_line_and_no_traceback(word):
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "cablestudy", word]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=LONGEST)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert done.stderr.startswith("standard output: ")


@pytest.mark.parametrize("redirection", [">&-", "<&-"])
def test_a_closed_stream_is_one_line_and_no_traceback(redirection):
    command = f"{sys.executable} -m cablestudy static - {redirection}"
    options = {"shell": True, "stdin": subprocess.DEVNULL, "timeout": LONGEST}
    done = subprocess.run(command, capture_output=True, text=True, **options)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "closed" in done.stderr or "empty file" in done.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no such device here")
@pytest.mark.parametrize("redirection", ["2>&-", "2>/dev/full"])
def test_what_standard_error_cannot_take_ends_nothing(folder, redirection):
    """Table, files and exit codes are those of a command whose lines are read."""
    refused = "vary: [{cable.preload: [1345 N, 1 N]}]\ncolumns: [sag]\n"
    commands = ("sweep", study_file(folder, refused)), ("static", "nothing.yaml")
    for arguments, code in zip(commands, (3, 2), strict=True):
        command = shlex.join([sys.executable, "-m", "cablestudy", *arguments])
        options = {"shell": True, "stdout": subprocess.PIPE, "text": True, "timeout": LONGEST, "check": False}
        done = subprocess.run(f"{command} {redirection}", **options)
        assert len(list((folder / "results").iterdir())) == 4
        assert (done.returncode, done.stdout) == (code, run(*arguments, code=code).out)


def test_a_sweep_in_a_program_without_standard_error(folder, monkeypatch):
    """As programs have none that a desktop starts."""
    monkeypatch.setattr(sys, "stderr", None)
    table = cablestudy.sweep(study_file(folder, "vary: [{cable.preload: [1345 N]}]\ncolumns: [preload]\n"))
    assert table["preload_N"].tolist() == pytest.approx([1345], rel=1e-6)


def test_a_terminal_without_some_letters_is_no_reason_to_fail(folder):
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    outcome = process("sweep", PRELOAD, "--row", 2, env=environment)
    assert outcome.code == 0, outcome.err
    write(folder / "cäble.yaml", f"base: {CARLINA}\n")
    assert "gravty" in process("static", "cäble.yaml", "--set", "gravty=1", env=environment).err


def test_a_current_directory_that_was_removed_is_named(folder):
    command = f"mkdir here; cd here; rmdir ../here; {sys.executable} -m cablestudy sweep {PRELOAD} --out new"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "the current directory: No such file or directory\n")


def test_processes_of_a_sweep_import_nothing_from_the_current_directory(folder):
    write(folder / "signal.py", "raise SystemExit\n")
    (folder / "bin").mkdir()
    write(folder / "bin" / "script.py", "from cablestudy.__main__ import main\nif __name__ == '__main__': main()\n")
    command = [sys.executable, "bin/script.py", "sweep", PRELOAD, "--jobs", "2", "--out", "new"]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 0


def test_a_backend_of_windows_that_is_not_there_is_no_reason_to_fail(folder):
    environment = {**os.environ, "MPLBACKEND": "none such"}
    outcome = process("static", CARLINA, "--plot", "form.svg", env=environment)
    assert (outcome.code, outcome.lines[-1]) == (0, "written: form.svg")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_json_is_utf_8_whatever_the_locale(folder, encoding):
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    write(folder / "cable.yaml", f"base: {CARLINA}\ncases: {{süd Ω: {{}}}}\n")
    row = json.loads(process("static", "cable.yaml", "--case", "all", "--format", "jsonl", env=environment).out)
    assert row["case"] == "süd Ω"
    assert "[A-Za-zµμΩ°%(1]" in process("schema", "study", env=environment).out


@pytest.mark.skipif(sys.platform != "linux", reason="file names of any bytes are Linux")
def test_a_file_whose_name_is_no_text(folder):
    os.rename(study_file(folder, "columns: [sag]\n"), b"bad\xff.yaml")
    outcome = process("sweep", "bad\udcff.yaml")
    assert (outcome.code, len(outcome.lines)) == (0, 1)
    assert sorted(name[4:] for name in os.listdir(b"results")) == [b".csv", b".md", b".rows.sqlite", b".run.yaml"]
    with open("results/bad\udcff.md", encoding="utf-8") as file:
        assert file.read().startswith("# bad\\udcff\n")


def test_a_line_break_in_the_name_of_a_file_makes_no_second_line(folder):
    write("a\nb.yaml", "base: scene.yaml\n")
    write("scene.yaml", (CONFIGS / "guy.yaml").read_text())
    with undrawn():
        assert run("static", "a\nb.yaml", "--plot", "c\nd.svg", "--columns", "sag").lines == ["written: c\\nd.svg"]
    (line,) = run("static", "a\nb.yaml", "--set", "cable.preload=1 N", code=3).lines
    assert line.startswith("a\\nb.yaml: ")


def interrupted_in_import_of(module, folder, *arguments, **options):
    """A command that gets SIGINT while it imports a module, in code that this makes from text; what it left."""
    code = "import os, signal, time; os.kill(os.getpid(), signal.SIGINT); time.sleep(1); raise ImportError('went on')"
    write(folder / f"{module}.py", f"exec({code!r})\n")
    options.setdefault("preexec_fn", partial(signal.signal, signal.SIGINT, signal.SIG_DFL))  # tests may ignore it
    path = os.pathsep.join(filter(None, (str(folder), os.environ.get("PYTHONPATH"))))
    return process(*arguments, env={**os.environ, "PYTHONPATH": path}, **options)


@pytest.mark.crossed
@pytest.mark.parametrize("module", ["click", "difflib", "yaml", "numpy", "pydantic"])
@pytest.mark.parametrize("command", ["static", "sweep"])
def test_ctrl_c_while_modules_are_imported_is_one_line(module, command, tmp_path):
    done = interrupted_in_import_of(module, tmp_path, command, CARLINA if command == "static" else PRELOAD)
    assert (done.code, done.out, len(done.lines)) == (130, "", 1)
    assert done.err.startswith("interrupted")


def test_a_damaged_compiled_module_is_no_interruption(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "pycache_prefix", str(tmp_path))
    path = Path(py_compile.compile(Path(cablestudy.__file__).parent / "scene" / "strict_yaml.py"))
    path.write_bytes(path.read_bytes()[:-9])
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    done = process("static", CARLINA, "--columns", "sag", env=environment)
    assert done.code == 1
    assert "EOFError" in done.err
    assert "strict_yaml" in done.err


def test_the_package_imports_nothing_before_ctrl_c_has_its_handler():
    code = "import sys; before = set(sys.modules); import cablestudy.__main__; print(*set(sys.modules) - before)"
    new = set(python(code).split())
    assert {name for name in new if "cablestudy" in name} == {"cablestudy", "cablestudy.version", "cablestudy.__main__"}
    assert "typing" not in new  # nor click, numpy, pandas or pydantic, which import it


def test_ctrl_c_that_is_ignored_as_in_the_background_of_a_shell_stays_ignored(tmp_path):
    ignored = partial(signal.signal, signal.SIGINT, signal.SIG_IGN)
    done = interrupted_in_import_of("click", tmp_path, "static", CARLINA, preexec_fn=ignored)
    assert done.code == 1
    assert "went on" in done.err


@pytest.mark.parametrize("command", ["static", "windrms", "loop"])
def test_top_of_a_table_of_one_row_is_refused(command):
    message = "--top: no effect: the table has one row (--columns A,B,... chooses what is shown of it)"
    assert refusal(command, CARLINA, "--top", "3") == message


def test_modes_of_a_scene_with_a_gondola_say_that_it_is_held():
    said = run("modes", CARLINA, "-n", "2").lines
    assert said[0].startswith("note: these are modes between fixed ends, with the gondola held; --coupled")
    assert "fixed ends" not in run("modes", CARLINA, "-n", "2", "--set", "gondola=null", "--set", "winch=null").err
    assert run("modes", CARLINA, "-n", "2", "--quiet").err == ""
    (line,) = run("modes", CARLINA, "-n", "2", "--coupled").lines
    assert line.startswith("note: damping ratios of modes that move ends of cables are not known")
    told = run("modes", CARLINA, "-n", "2", "--coupled", "--explain").lines
    assert told[0] == "modes: 2 of a linear model with 118 coordinates"  # 39 nodes of bars, and the gondola


@pytest.mark.parametrize("scene", ["slack.yaml", "carlina-inclined.yaml"])
def test_coupled_modes_of_gondola_and_cable_are_those_of_the_suspension(tmp_path, scene):
    path = CONFIGS / scene
    sets = ("model={accuracy: 1e-6}", "cable.damping={model: kelvin_voigt, time: 1 ms}", "winch=null")
    options = with_sets(*sets)
    twin = tmp_path / "twin.yaml"
    write(twin, yaml.safe_dump(swinging(contents(path, *sets))))
    columns = "-n", "9", "--columns", "frequency_Hz,damping_ratio,body_share"
    own, of_twin = table_of("modes", path, "--coupled", *options, *columns), table_of("modes", twin, *columns)
    for name in own[0]:
        expected = [row[name] for row in of_twin]
        assert [row[name] for row in own] == pytest.approx(expected, rel=1e-5, abs=1e-9)
    frequency = table_of("windrms", path, *options)[0]["gondola_frequency_Hz"]
    assert min(abs(row["frequency_Hz"] / frequency - 1) for row in own) < 1e-6


@pytest.mark.parametrize(("scene", "case"), [("guy.yaml", ["--case", "storm"]), ("point-load.yaml", [])])
def test_coupled_modes_of_a_cable_with_fixed_ends_are_those_of_the_suspension(tmp_path, scene, case):
    one, twin = tmp_path / "one.yaml", tmp_path / "twin.yaml"
    bare = without(contents(CONFIGS / scene, "model={accuracy: 1e-4}"), "gondola", "winch")
    write(one, yaml.safe_dump(bare))
    write(twin, yaml.safe_dump(held(bare)))
    options = "-n", "9", *case, "--columns", "frequency_Hz,damping_ratio,moves"
    rows, of_twin = table_of("modes", one, "--coupled", *options), table_of("modes", twin, *options)
    for row, other in zip(rows, of_twin, strict=True):
        assert row["frequency_Hz"] == pytest.approx(other["frequency_Hz"], rel=2e-5)
        assert row["damping_ratio"] == pytest.approx(other["damping_ratio"], rel=1e-3)
        assert row["moves"] == other["moves"]


def test_coupled_is_refused_where_the_modes_are_coupled():
    line = refusal("modes", CONFIGS / "suspensions" / "fast.yaml", "--coupled")
    assert line == "--coupled: no effect: without --cable the modes of a suspension are coupled"
