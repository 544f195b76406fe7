"""Run every example of the documentation and put in what it prints.

A fenced block marked `console` holds commands, each after `$ `, and below each what it prints. `make docs` writes the
outputs and the pictures, and docs/gallery.md; tests/test_docs.py compares them. Commands run in a copy of configs/, so
that nothing here changes by being documented.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import gallery
import layers

ROOT = Path(__file__).resolve().parent.parent
PROGRAMS = Path(sys.executable).parent
PAGES = sorted([ROOT / "README.md", ROOT / "ARCHITECTURE.md", *(ROOT / "docs").glob("*.md")])
BLOCK = re.compile(r"(```console\n)(.*?)(```\n)", re.DOTALL)
PICTURES = "docs/pictures"


def outputs(block, folder, programs=PROGRAMS):
    """The same block with what its commands print now; `programs` is as of `run`."""
    lines = []
    for line in block.splitlines():
        if line.startswith("$ "):
            lines += [line, *run(line[2:], folder, programs).splitlines()]
    return "".join(line + "\n" for line in lines)


def run(command, folder, programs=PROGRAMS):
    """What a user of a shell sees of a command: standard error and standard output; RuntimeError for a traceback.

    `programs` is the folder in which the shell finds `cablestudy`.
    """
    path = os.pathsep.join(map(str, (programs, PROGRAMS, os.environ["PATH"])))
    environment = {**os.environ, "PATH": path, "CABLESTUDY_PROGRESS": "off"}  # it depends on how fast a machine is
    done = subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, check=False,
    )  # fmt: skip
    if "Traceback (most recent call last)" in done.stdout:
        raise RuntimeError(f"{command}\n{done.stdout}")
    return done.stdout


def workplace():
    """A temporary folder with a copy of what the examples read."""
    folder = tempfile.TemporaryDirectory(prefix="cablestudy-docs-")
    shutil.copytree(ROOT / "configs", Path(folder.name) / "configs")
    shutil.copytree(ROOT / "results", Path(folder.name) / "results")
    (Path(folder.name) / PICTURES).mkdir(parents=True)
    return folder


def refreshed(page, folder, programs=PROGRAMS):
    """Text of a page with fresh outputs; `programs` is as of `run`."""
    return BLOCK.sub(lambda match: match[1] + outputs(match[2], folder, programs) + match[3], page.read_text())


def main(*names):
    """Rewrite every page, or those named, and the pictures that their commands draw."""
    pages = [page for page in PAGES if not names or page.name in names]
    with workplace() as folder:
        for page in pages:
            page.write_text(refreshed(page, folder))
        shutil.copytree(Path(folder) / PICTURES, ROOT / PICTURES, dirs_exist_ok=True)
        for picture in Path(folder).glob("*.svg"):  # drawn where the command was typed
            shutil.copy(picture, ROOT / PICTURES)
    gallery.write()
    layers.write()


if __name__ == "__main__":
    main(*sys.argv[1:])
