"""Shell completion: the scripts that docs/commands.md speaks of, and what they offer."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(sys.executable).parent / "cablestudy"


def complete(shell, *words):
    """What the program offers for the last word of a command line."""
    environment = {**os.environ, "_CABLESTUDY_COMPLETE": f"{shell}_complete",
                   "COMP_WORDS": " ".join(("cablestudy", *words)), "COMP_CWORD": str(len(words))}  # fmt: skip
    done = subprocess.run([PROGRAM], env=environment, capture_output=True, text=True, check=True, timeout=60)
    assert done.stderr == ""
    return [tuple(line.split(",", 1)) for line in done.stdout.splitlines()]


@pytest.mark.parametrize(
    ("shell", "telling"), [("bash", "complete -o nosort"), ("zsh", "#compdef cablestudy"), ("fish", "complete ")]
)
def test_a_script_for_each_shell(shell, telling):
    environment = {**os.environ, "_CABLESTUDY_COMPLETE": f"{shell}_source"}
    done = subprocess.run([PROGRAM], env=environment, capture_output=True, text=True, check=True, timeout=60)
    assert telling in done.stdout
    assert f"_CABLESTUDY_COMPLETE={shell}_complete" in done.stdout


def test_commands_and_options():
    assert {("plain", "sweep"), ("plain", "static")} <= set(complete("bash", "s"))
    assert ("plain", "--sensitivity") in complete("bash", "sweep", "--sens")
    assert complete("bash", "static", "--format", "j") == [("plain", "json"), ("plain", "jsonl")]


@pytest.mark.parametrize("command", ["static", "modes", "windrms", "ssm", "sweep", "validate"])
def test_files_where_a_scene_or_study_is_read(command):
    assert [kind for kind, _ in complete("bash", command, "conf")] == ["file"]


def test_columns_to_sort_by():
    assert complete("bash", "sweep", "study.yaml", "--sort", "sag") == [("plain", "sag_m"), ("plain", "sag_ratio")]
