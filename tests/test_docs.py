"""Every example of README, ARCHITECTURE and docs/ prints what the page says, and notebooks show what theirs show."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import gallery
import numpy as np
import pytest
import refresh
from command import CARLINA, CONFIGS, ROOT, run, stored_table, table_of, with_sets, write
from command_server import served
from PIL import Image

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
    assert_stored(refresh.refreshed(page, folder, programs), page)


def assert_stored(text, page, smallest=1e-12):
    """A page has the words of a text, and its numbers but for the last digits, which differ between processors."""
    now, stored = NUMBER.split(text), NUMBER.split(page.read_text(encoding="utf-8"))
    assert now[::2] == stored[::2], "stale: 'make docs' makes it again"
    numbers = [[float(part) for part in parts[1::2]] for parts in (now, stored)]
    assert numbers[0] == pytest.approx(numbers[1], rel=2e-3, abs=smallest), "stale: 'make docs' makes it again"


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


# ------------------------------------------------------------------------------------------------------------ notebooks

DOCS = ROOT / "docs"
FOLDERS = ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR")  # of the user otherwise


def notebook_page(name, folder):
    """Run a notebook, in processes of its own, and compare its page with the stored one; its text."""
    environment = {**os.environ, **{variable: str(folder / variable) for variable in FOLDERS}}
    command = [sys.executable, str(DOCS / "notebook_pages.py"), "--to", str(folder), name]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    text = (folder / f"notebook-{name}.md").read_text(encoding="utf-8")
    assert_stored(text, DOCS / f"notebook-{name}.md", 1e-9)
    pictures = re.findall(r"!\[[^\]]*\]\((.*?)\)", text)
    assert len(pictures) == 3
    assert all((folder / picture).stat().st_size > 5000 for picture in pictures)
    assert [picture for picture in pictures if differ(folder / picture, DOCS / picture)] == [], "stale: 'make docs'"
    return text


def differ(*paths):
    """True if two pictures are not of one size, or differ in more than a hundredth of their area."""
    now, before = (np.asarray(Image.open(path).convert("L"), dtype=float) for path in paths)
    return now.shape != before.shape or (np.abs(now - before) > 32).mean() > 0.01


def printed(text, pattern):
    """The number that a pattern finds in a page."""
    return float(re.search(pattern, text)[1])


def test_the_notebook_of_one_cable(tmp_path):
    preload = printed(notebook_page("one-cable", tmp_path), r"least preload: (\d+) N")
    assert 400 < preload < 700  # "about half a kilonewton"
    sets = with_sets("cable.diameter=3.7mm", "wind.aerodynamic_damping=true", f"cable.preload={preload} N")
    (row,) = table_of("windrms", CARLINA, *sets)
    assert row["peak_mm"] == pytest.approx(12, rel=0.01)


def test_the_notebook_of_a_suspension(tmp_path):
    text = notebook_page("suspension", tmp_path)
    largest = stored_table(ROOT / "results" / "carlina-winches.csv")[0]["largest_gain_rad_per_s"]
    assert printed(text, r"\ngain ([\d.]+) rad/s") == pytest.approx(largest * 10**-0.5, rel=3e-3)
    thin, thick = (printed(text, rf"{cable}RMS of the focus ([\d.]+) mm") for cable in (r"\d, ", r"mm\^2: "))
    assert thick == pytest.approx(thin / 2, rel=0.1)  # with twice the section


@pytest.mark.parametrize("path", sorted((DOCS / "notebooks").glob("*.ipynb")), ids=lambda path: path.name)
def test_notebooks_are_stored_without_outputs_and_machine_paths(path):
    text = path.read_text(encoding="utf-8")
    cells = json.loads(text)["cells"]
    assert len({cell["id"] for cell in cells}) == len(cells) > 10
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)
    assert not re.search(r"/(home|root|tmp|Users)/", text)
