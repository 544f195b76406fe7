"""What `--help` says: groups, one line for each command, examples that work; what shells complete."""

import os
import shlex
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import click
import pytest
from command import python, run
from picture import undrawn

import cablestudy.cli
from cablestudy.cli import main
from cablestudy.cli.files import NEXT
from cablestudy.cli.help import COMMANDS, GROUPS, examples


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with all files that `cablestudy new` writes."""
    folder = tmp_path_factory.mktemp("examples")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for kind in NEXT:
            run("new", kind)
    return folder


def test_each_command_has_its_group_and_each_entry_is_a_command():
    assert main.list_commands(None) == list(COMMANDS)
    assert all(main.get_command(None, name).name == name for name in COMMANDS)
    names = {path.stem for path in Path(cablestudy.cli.__file__).parent.glob("*.py")}
    values = [value for name in names for value in vars(import_module(f"cablestudy.cli.{name}")).values()]
    written = {value.name for value in values if isinstance(value, click.Command)}
    assert written - {"cablestudy", "main"} == set(COMMANDS)


def test_the_list_fits_the_terminal_and_says_all():
    lines = run("--help").out.splitlines()
    assert [line for line in lines if len(line) > 80] == []
    for title, commands in GROUPS.items():
        assert f"{title}:" in lines
        for name, (_, summary, _) in commands.items():
            assert any(line.split() == [name, *summary.split()] for line in lines), name


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_examples_as_they_are_typed(name):
    text = run(name, "--help").out
    assert examples(name)
    assert any(line.split()[1] == name for line in examples(name))
    for line in examples(name):
        assert f"\n    {line}\n" in text
        assert len(line) <= 76


@pytest.mark.parametrize("name", COMMANDS)
def test_examples_do_their_work_on_the_files_of_new(name, folder, monkeypatch):
    monkeypatch.chdir(folder)
    for line in examples(name):
        words, _, file = line.partition(" > ")
        words = shlex.split(words)[1:]
        if name == "new" and "-" not in words:
            words.append("another.yaml") if len(words) == 2 else None
        with undrawn():
            done = run(*words)
        assert done.out or done.err or file
    assert name != "ssm" or (folder / "gondola.mat").exists()


def test_help_imports_no_command():
    """So that it takes at most 1.5 times as long as importing click, however many commands there are."""
    code = "import sys, cablestudy.cli as c; c.main(['--help'], standalone_mode=False); print(*sys.modules)"
    loaded = set(python(code).splitlines()[-1].split())
    assert {"click", "cablestudy.cli.help"} <= loaded
    assert not loaded & {f"cablestudy.cli.{module}" for module, _, _ in COMMANDS.values()}


# ------------------------------------------------------------------------------------------------- completion in shells

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
