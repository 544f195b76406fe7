"""Every script in benchmarks/ runs, with sizes that tell no speed: what they measure is for a quiet machine."""

import os
import re
import subprocess
import sys

import processors
import pytest
from campaign import campaign
from command import LONGEST, ROOT

FOLDER = ROOT / "benchmarks"
# section of docs/benchmarks.md -> words of rows that it must have
SECTIONS = {
    "Compared with other programs": ("cablestudy", "cablestudy, accuracy 1e-06"),
    "Rows of a sweep": ("sweep of 2, no two of one cable", "modal, sweep of 2 diameters", "accuracy 1e-10"),
    "Sweeps": ("`sweep --jobs 2`, tables written", "`--jobs 1`", "`--scheduler`, 2 dask workers"),
    "Effort against size": ("250", "2500", "exponent"),
    "Suspensions": ("cablestudy", "sweep of 2 over wind.speed", "24", "exponent"),
    "Start-up": ("`cablestudy --help`",),
}
SHORT = ("Compared with other programs", "Rows of a sweep", "Effort against size", "Start-up")
NOT_FINITE = re.compile(r"\b(nan|inf|none)\b", re.IGNORECASE)


def script(name, *arguments, code=0):
    """What a script of benchmarks/ prints; its exit code must be the expected one."""
    command = [sys.executable, FOLDER / name, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, timeout=LONGEST)
    assert done.returncode == code, done.stderr
    return done.stdout if code == 0 else done.stderr


def test_sections_of_the_benchmarks_are_measured():
    names = campaign(SECTIONS, SHORT)
    _, *sections = script("run.py", "--tiny", *names).split("\n## ")
    assert sorted(text.partition("\n")[0] for text in sections) == sorted(names)
    for text in sections:
        rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("|")]
        for first in SECTIONS[text.partition("\n")[0]]:
            (row,) = [row for row in rows if row[0] == first][:1]
            assert any(re.match(r"[-\d]", cell) for cell in row[1:]), row
        assert [row for row in rows if NOT_FINITE.search(" ".join(row))] == []
        assert "NOT identical" not in text


def test_the_sections_are_those_of_the_page():
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert re.findall("^## (.*)$", page, re.MULTILINE) == list(SECTIONS)
    assert "no section 'Speed'" in script("run.py", "Speed", code=2)


def test_a_sweep_is_killed_and_goes_on():
    assert "1 kills" in script("kills.py", 1)


def test_every_script_is_run_here_or_used_by_one_that_is():
    """The others by tests of their own: test_extremes, test_interface_arguments, test_twins."""
    run_or_used = {"run.py", "kills.py", "extremes.py", "processors.py", "python_calls.py", "twins.py"}
    for path in FOLDER.glob("*.py"):
        run_or_used |= {f"{name}.py" for name in re.findall(r"^(?:import|from) (\w+)", path.read_text(), re.MULTILINE)}
    assert {path.name for path in FOLDER.glob("*.py")} <= run_or_used


WITH_NAME = "import numpy; numpy.ones((2, 2)) @ numpy.ones((2, 2))"


def test_each_core_type_is_taken_by_its_name_and_none_twice(monkeypatch, capsys):
    """The types of OpenBLAS that this machine can run, for `make processors`."""
    monkeypatch.setattr(processors, "X86", campaign(processors.X86, ("Nehalem", "Haswell", "SkylakeX", "Zen")))
    if reason := processors.main():
        pytest.skip(reason)
    names, cores = capsys.readouterr().out.split(), []
    assert names
    for name in names:
        told = os.environ | {"OPENBLAS_CORETYPE": name, "OPENBLAS_VERBOSE": "2"}
        one = subprocess.run([sys.executable, "-c", WITH_NAME], env=told, capture_output=True, text=True, check=True)
        cores.append(next(line for line in (one.stdout + one.stderr).splitlines() if line.startswith("Core: ")))
    assert len(set(cores)) == len(names)
