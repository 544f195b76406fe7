"""Shell completion: the scripts that docs/commands.md speaks of, and what they offer."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(sys.executable).parent / "cablestudy"


def program(**environment):
    """What the program prints in an environment of the shell's."""
    environment = {**os.environ, **environment}
    done = subprocess.run([PROGRAM], env=environment, capture_output=True, text=True, check=True, timeout=900)
    assert done.stderr == ""
    return done.stdout


def complete(*words):
    """What the program offers bash for the last word of a command line."""
    words = {"COMP_WORDS": " ".join(("cablestudy", *words)), "COMP_CWORD": str(len(words))}
    return [tuple(line.split(",", 1)) for line in program(_CABLESTUDY_COMPLETE="bash_complete", **words).splitlines()]


@pytest.mark.parametrize(
    ("shell", "telling"), [("bash", "complete -o nosort"), ("zsh", "#compdef cablestudy"), ("fish", "complete ")]
)
def test_a_script_for_each_shell(shell, telling):
    script = program(_CABLESTUDY_COMPLETE=f"{shell}_source")
    assert telling in script
    assert f"_CABLESTUDY_COMPLETE={shell}_complete" in script


def test_commands_and_options():
    assert {("plain", "sweep"), ("plain", "static")} <= set(complete("s"))
    assert ("plain", "--sensitivity") in complete("sweep", "--sens")
    assert complete("static", "--format", "j") == [("plain", "json"), ("plain", "jsonl")]


@pytest.mark.parametrize("command", ["static", "modes", "windrms", "ssm", "find", "sweep", "validate"])
def test_files_where_a_scene_or_study_is_read(command):
    assert [kind for kind, _ in complete(command, "conf")] == ["file"]


def test_columns_to_find_a_value_of_and_to_sort_by():
    for words in (("find", "scene.yaml"), ("sweep", "study.yaml", "--sort")):
        assert complete(*words, "sag") == [("plain", "sag_m"), ("plain", "sag_ratio")]
    assert complete("sweep", "study.yaml", "--sort", "max_u") == [("plain", "max_utilisation")]
