"""The command new: commented files to begin with."""

import os
import resource
import tomllib
from fnmatch import fnmatch
from functools import partial
from importlib.resources import files

import pytest
from command import ROOT, process, refusal, refused_in_one_line, run, table_of, write
from picture import undrawn

from cablestudy.cli.files import NEXT

pytestmark = pytest.mark.usefixtures("folder")


def text_of(kind):
    return run("new", kind, "-").out


@pytest.mark.parametrize("kind", NEXT)
def test_a_file_is_written_validated_and_computed_without_notes(kind, folder):
    done = run("new", kind)
    assert done.out == ""
    assert done.lines[0] == f"written: {kind}.yaml; try"
    assert (folder / f"{kind}.yaml").read_text(encoding="utf-8") == text_of(kind)
    if kind == "study":
        run("new", "guy")
        assert run("sweep", "study.yaml", "--no-write").err == ""
    else:
        assert run("static", f"{kind}.yaml").err == ""
    assert table_of("validate", f"{kind}.yaml")[0]["status"] == "ok"
    for line in done.lines[1:]:
        words = line.replace("'sag = 0.5 m'", "sag=0.5m").replace("'clearance = 7 m'", "clearance=7m").split()
        assert words[:1] == ["cablestudy"]
        with undrawn():
            assert run(*words[1:]).out


@pytest.mark.parametrize("kind", NEXT)
def test_every_line_is_commented_and_says_where_to_read_on(kind):
    lines = text_of(kind).splitlines()
    assert [line for line in lines if "#" not in line] == []
    assert [line for line in lines if len(line) > 120] == []
    pages = [word.rstrip(".") for line in lines for word in line.split() if word.startswith("docs/")]
    assert pages
    assert [page for page in pages if not (ROOT / page).exists()] == []
    head = " ".join(lines[:4])
    assert f"`cablestudy new {kind}`" in head
    assert "`cablestudy keys " in head


def test_numbers_of_the_guy_follow_from_the_taut_string():
    """Sag m g cos(slope) l^2 / (8 T cos(slope)) of a chord l and the frequency sqrt(T / m) / (2 l), T the preload."""
    run("new", "guy")
    row = table_of("static", "guy.yaml", "--case", "everyday")[0]
    mass, tension, chord = row["mass_per_length_kg_per_m"], row["preload_N"], 100.0
    assert tension == pytest.approx(0.1 * row["breaking_force_N"], rel=1e-9)
    assert row["sag_m"] == pytest.approx(mass * 9.81 * chord**2 / (8 * tension), rel=2e-3)
    modes = table_of("modes", "guy.yaml", "--case", "everyday", "-n", "3")
    lowest = next(mode for mode in modes if mode["type"] == "out-of-plane")
    assert lowest["frequency_Hz"] == pytest.approx((tension / mass) ** 0.5 / (2 * chord), rel=2e-3)


def test_the_weight_of_the_camera_hangs_on_its_four_cables():
    run("new", "suspension")
    cables = table_of("static", "suspension.yaml", "--table", "cables")
    weight = 9.81 * (20 + sum(row["mass_kg"] for row in cables))
    assert sum(row["reaction_1_vertical_N"] for row in cables) == pytest.approx(weight, rel=1e-6)
    assert min(row["preload_N"] for row in cables) >= 20


def test_the_help_lists_all_kinds():
    *most, last = NEXT
    assert f"KIND is {', '.join(most)} or {last}." in " ".join(run("new", "--help").out.split())


def test_nothing_is_overwritten(folder):
    run("new", "guy", "mine.yaml")
    write(folder / "mine.yaml", "mine")
    assert refusal("new", "line", "mine.yaml") == "mine.yaml: is there already; give another name"
    assert (folder / "mine.yaml").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["guy", "nowhere/guy.yaml"], "nowhere/guy.yaml: cannot be written (No such file or directory)"),
        (["guy", "."], ".: is there already; give another name"),
        (["guy", ""], "cablestudy new: give the name of a file"),
        (["bridge"], "'bridge' is not one of"),
        ([], f"Missing argument 'KIND'. Choose from: {', '.join(NEXT)}"),
    ],
)
def test_wrong_words(words, message, folder):
    refused_in_one_line(folder, message, "new", *words)


def test_a_disk_that_is_full_leaves_no_file(folder):
    """A limit on the size of files stands for the disk; compiled modules would be cut short by it, and stay so."""
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    full = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (100, 100))
    done = process("new", "guy", preexec_fn=full, env=environment)
    assert (done.code, len(done.lines)) == (2, 1)
    assert done.err.startswith("guy.yaml: cannot be written")
    assert list(folder.iterdir()) == []


def test_quiet_says_nothing_and_names_with_blanks_are_quoted():
    assert run("new", "guy", "--quiet").err == ""
    assert "cablestudy modes 'my guy.yaml' -n 6" in run("new", "guy", "my guy.yaml").err


def test_what_pip_installs_has_the_templates():
    """`package-data` of pyproject.toml."""
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["cablestudy"]
    names = [f"templates/{entry.name}" for entry in (files("cablestudy") / "templates").iterdir()]
    assert sorted(names) == sorted(f"templates/{kind}.yaml" for kind in NEXT)
    assert all(any(fnmatch(name, pattern) for pattern in patterns) for name in names)
