"""The notebooks of the documentation run from top to bottom, and what they say agrees with the commands."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest
from command import CARLINA, CONFIGS, ROOT, table_of

NOTEBOOKS = ROOT / "docs" / "notebooks"
FOLDERS = ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR")  # of the user otherwise


def outputs(name, folder):
    """Run a notebook in a copy of its folder, in processes of its own; what its cells show: list of kind -> content."""
    shutil.copytree(NOTEBOOKS, folder / "docs" / "notebooks")
    shutil.copytree(CONFIGS, folder / "configs")
    environment = {**os.environ, **{name: str(folder / name) for name in FOLDERS}}
    path = folder / "docs" / "notebooks" / name
    command = [sys.executable, str(ROOT / "docs" / "run_notebook.py"), str(path), "out.ipynb"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    cells = json.loads((folder / "out.ipynb").read_text(encoding="utf-8"))["cells"]
    shown = [output for cell in cells for output in cell.get("outputs", ())]
    return [{"text": output["text"]} if output["output_type"] == "stream" else output["data"] for output in shown]


def counted(shown, kind):
    """How many outputs have a kind of content."""
    return sum(kind in one for one in shown)


def printed(shown, pattern):
    """The number that a pattern finds in the printed text."""
    return float(re.search(pattern, "".join("".join(one.get("text", "")) for one in shown))[1])


def test_one_cable(folder):
    shown = outputs("one-cable.ipynb", folder)
    assert (counted(shown, "image/png"), counted(shown, "text/html")) == (3, 4)
    preload = printed(shown, r"least preload: (\d+) N")
    assert 400 < preload < 700  # "about half a kilonewton"
    sets = ("cable.diameter=3.7mm", "wind.aerodynamic_damping=true", f"cable.preload={preload} N")
    (row,) = table_of("windrms", CARLINA, *(part for one in sets for part in ("--set", one)))
    assert row["peak_mm"] == pytest.approx(12, rel=0.01)


def test_a_suspension(folder):
    shown = outputs("suspension.ipynb", folder)
    assert (counted(shown, "image/png"), counted(shown, "text/html")) == (3, 6)
    largest = 9.154  # rad/s, results/carlina-winches.csv
    assert printed(shown, r"gain ([\d.]+) rad/s") == pytest.approx(largest * 10**-0.5, rel=3e-3)
    thin, thick = (printed(shown, rf"{cable}RMS of the focus ([\d.]+)") for cable in (r"[\d.]+, ", r"mm\^2: "))
    assert thick == pytest.approx(thin / 2, rel=0.1)  # with twice the section


@pytest.mark.parametrize("path", sorted(NOTEBOOKS.glob("*.ipynb")), ids=lambda path: path.name)
def test_notebooks_are_stored_without_outputs_and_machine_paths(path):
    text = path.read_text(encoding="utf-8")
    cells = json.loads(text)["cells"]
    assert len({cell["id"] for cell in cells}) == len(cells) > 10
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in cells)
    assert not re.search(r"/(home|root|tmp|Users)/", text)
