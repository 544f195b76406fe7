"""Every example of README, ARCHITECTURE and docs/ prints what the page says it prints."""

import os
import re
import subprocess
import sys
from pathlib import Path

import gallery
import pytest
import refresh
from command import CONFIGS, ROOT, run, write
from command_server import served

from cablestudy.sweeps import progress

FENCED = re.compile(r"```.*?```", re.DOTALL)
NUMBER = re.compile(r"((?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?)")


@pytest.fixture(scope="module")
def folder():
    with refresh.workplace() as path:
        yield path


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """Where the shell finds a `cablestudy` that does not start anew each time."""
    own = tmp_path_factory.getbasetemp()
    rows = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "rows"
    rows.mkdir(exist_ok=True)
    with served(rows) as path:
        yield path


@pytest.mark.parametrize("page", refresh.PAGES, ids=lambda page: page.name)
def test_examples_print_what_the_page_shows(page, folder, programs):
    now, stored = NUMBER.split(refresh.refreshed(page, folder, programs)), NUMBER.split(page.read_text())
    assert now[::2] == stored[::2], "stale: 'make docs' regenerates it"
    # the last digits of a number may differ on another processor
    numbers = [[float(text) for text in page[1::2]] for page in (now, stored)]
    assert numbers[0] == pytest.approx(numbers[1], rel=2e-3, abs=1e-12), "stale: 'make docs' regenerates it"


def test_no_example_shows_progress_which_depends_on_how_fast_a_machine_is(folder):
    assert refresh.run(f"echo ${progress.OFF}", folder) == "off\n"


def test_commands_of_the_server_leave_the_files_of_their_pictures_empty(folder, programs):
    shell = "cablestudy static configs/carlina.yaml --plot empty.svg --quiet >table && wc -c <empty.svg"
    assert refresh.run(shell, folder, programs).strip() == "0"


def test_the_pages_have_examples():
    commands = [line for page in refresh.PAGES for line in page.read_text().splitlines() if line.startswith("$ cable")]
    assert (len(commands) >= 15, len(TOUR)) == (True, 15)
    used = " ".join(commands)
    for command in ("static", "modes", "find", "sweep", "trade", "validate", "schema", "columns", "materials"):
        assert f"cablestudy {command}" in used


def headings(page):
    """Anchors of the headings of a page, as GitHub and MyST make them."""
    lines = re.findall(r"^#+ (.*)$", FENCED.sub("", page.read_text(encoding="utf-8")), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", line.lower().replace("`", "")).strip().replace(" ", "-") for line in lines}


@pytest.mark.parametrize("page", refresh.PAGES, ids=lambda page: page.name)
def test_every_link_within_the_repository_leads_to_a_file_and_a_heading(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", FENCED.sub("", page.read_text(encoding="utf-8"))):
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert link.startswith("https://") or target.exists(), link
        assert not anchor or target.suffix != ".md" or anchor in headings(target), link


def test_the_gallery_has_every_picture_with_its_command():
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.text(), "stale: 'make docs' regenerates it"
    shown = {name for _, name in gallery.SHOWN.findall(gallery.text())}
    assert shown == gallery.drawn_by_commands()
    assert len(shown) > 20


@pytest.mark.parametrize("page", ["files.md", "power-line.md", "suspensions.md"])
def test_yaml_examples_are_valid_and_scenes_have_an_answer(page, folder):
    blocks = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs" / page).read_text(), re.DOTALL)
    assert blocks
    for number, block in enumerate(blocks):
        file = Path(folder) / "configs" / f"example-{number}.yaml"
        write(file, block)
        run("validate", file)
        if "vary:" not in block and "over:" not in block:
            run("static", file)


# those that take long are checked by `make test` after the tests
SHORT = sorted(set(ROOT.glob("results/*.csv")) - {*ROOT.glob("results/trade-*"), *ROOT.glob("results/carlina-*")})


@pytest.mark.parametrize("table", SHORT, ids=lambda table: table.stem)
def test_short_studies_have_their_stored_tables(table, folder, programs):
    """As `make tables` has it; the rows of most of them are examples too, and are computed once."""
    (study,) = Path(folder, "configs").rglob(table.with_suffix(".yaml").name)
    shell = f"cablestudy sweep {study} --out {ROOT / 'results'} --check --jobs 1"
    assert refresh.run(shell, folder, programs).splitlines()[-1] == f"{table}: agrees"


TOUR = [
    line.split("   #")[0].split("  #")[0].strip()
    for page in refresh.PAGES
    for block in re.findall(r"```sh\n(.*?)```", page.read_text(), re.DOTALL)
    for line in block.splitlines()
    if line.startswith("cablestudy ")
]


@pytest.mark.parametrize("command", TOUR)
def test_commands_of_the_tour_do_their_work(command, folder, programs):
    places = (programs, Path(sys.executable).parent, os.environ["PATH"])
    environment = {**os.environ, "PATH": os.pathsep.join(map(str, places))}
    shell = ["bash", "-o", "pipefail", "-c", command]
    done = subprocess.run(shell, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert bool(done.stdout) == (not any(word in command for word in ("--check", "--out", " new ")))


@pytest.mark.parametrize("scene", ["carlina", "carlina-inclined", "slack", "point-load", "guy", "line", "zipline"])
@pytest.mark.parametrize("command", ["static", "modes"])
def test_every_scene_of_configs_has_an_answer(command, scene):
    said = run(command, CONFIGS / f"{scene}.yaml").err
    assert said == "" or (command == "modes" and said.startswith("note: these are modes between fixed ends"))
