"""The notebooks of the documentation run from top to bottom, show what their pages show, agree with the commands."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from command import CARLINA, ROOT, stored_table, table_of, with_sets
from PIL import Image

DOCS = ROOT / "docs"
FOLDERS = ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR")  # of the user otherwise
NUMBER = re.compile(r"((?<![\w.])[-+]?\d+\.?\d*(?:e[-+]?\d+)?)")


def page(name, folder):
    """Run a notebook, in processes of its own, and compare its page with the stored one; its text."""
    environment = {**os.environ, **{variable: str(folder / variable) for variable in FOLDERS}}
    command = [sys.executable, str(DOCS / "notebook_pages.py"), "--to", str(folder), name]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    text = (folder / f"notebook-{name}.md").read_text(encoding="utf-8")
    stored = (DOCS / f"notebook-{name}.md").read_text(encoding="utf-8")
    now, before = NUMBER.split(text), NUMBER.split(stored)
    assert now[::2] == before[::2], "stale: 'make docs' runs it again"
    numbers = [[float(part) for part in parts[1::2]] for parts in (now, before)]
    assert numbers[0] == pytest.approx(numbers[1], rel=2e-3, abs=1e-9), "stale: 'make docs' runs it again"
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


def test_one_cable(folder):
    preload = printed(page("one-cable", folder), r"least preload: (\d+) N")
    assert 400 < preload < 700  # "about half a kilonewton"
    sets = with_sets("cable.diameter=3.7mm", "wind.aerodynamic_damping=true", f"cable.preload={preload} N")
    (row,) = table_of("windrms", CARLINA, *sets)
    assert row["peak_mm"] == pytest.approx(12, rel=0.01)


def test_a_suspension(folder):
    text = page("suspension", folder)
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
