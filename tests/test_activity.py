"""What is shown of a command that takes long: when, what, and that it can be silenced; no test depends on the clock."""

import io
import threading

import pytest
from command import CARLINA, CONFIGS, Terminal, run

import cablestudy
from cablestudy import activity
from cablestudy.cli import error_handling
from cablestudy.interface import scene
from cablestudy.study import find


def shown(stream, *texts):
    """What is written to a stream while a command that takes long is at what these texts say, line by line."""
    texts, waited = iter(texts), []

    def wait(seconds):
        waited.append(seconds)
        text = next(texts, None)
        activity.doing(text or "")
        return text is None

    activity.ActivityDisplay("find", stream=stream, wait=wait).write()
    return stream.getvalue(), waited


def test_lines_are_written_ever_more_seldom():
    text, waited = shown(io.StringIO(), "", "17 values tried", "40 values tried")
    assert text.splitlines() == ["find: 2 s", "find: 4 s, 17 values tried", "find: 8 s, 40 values tried"]
    assert waited == [2, 2, 4, 8]


def test_a_terminal_has_one_line_that_is_erased():
    text, waited = shown(Terminal(), "", "17 values tried")
    assert text == "\rfind: 2 s\x1b[K\rfind: 3 s, 17 values tried\x1b[K\r\x1b[K"
    assert waited == [2, 1, 1]


def test_what_is_fast_shows_nothing():
    for stream in (io.StringIO(), Terminal()):
        assert shown(stream)[0] == ""


SEARCH = ("find", CARLINA, "sag = 0.2 m", "--by", "cable.preload", "--columns", "mass")


@pytest.fixture
def written(monkeypatch):
    """The first line is written at once, and no search goes on before it is."""
    seen, search = threading.Event(), find.column_values

    class AtOnce(activity.ActivityDisplay):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            end, waits = self._wait, iter((False,))
            self._wait = lambda _: next(waits, None) is None and (seen.set() or end())

    def numbers(goal, document, values):
        assert seen.wait(60)
        return search(goal, document, values)

    monkeypatch.setenv(activity.OFF, "on")
    monkeypatch.setattr(error_handling, "ActivityDisplay", AtOnce)
    monkeypatch.setattr(find, "column_values", numbers)
    return seen


def test_a_search_says_what_it_has_tried(written):
    lines = run(*SEARCH).lines
    assert lines[0] in ("find: 2 s", "find: 2 s, 0 values of cable.preload tried for sag = 0.2 m")
    assert lines[1].startswith("searched: cable.preload from")
    assert activity._activity.endswith("values of cable.preload tried for sag = 0.2 m")
    assert not [thread for thread in threading.enumerate() if "write" in thread.name]


def test_quiet_silences_it_and_so_does_the_variable(written, monkeypatch):
    written.set()
    assert run(*SEARCH, "--quiet").err == ""
    monkeypatch.setenv(activity.OFF, "off")
    assert run(*SEARCH).lines[0].startswith("searched: cable.preload from")


def displays(monkeypatch, module):
    """Arguments of each display that a module shows, as it shows them: list of tuple."""
    seen, display = [], activity.ActivityDisplay
    monkeypatch.setattr(module, "ActivityDisplay", lambda *given: seen.append(given) or display(*given))
    return seen


@pytest.mark.parametrize("command", ["static", "modes", "windrms", "ssm", "loop"])
def test_each_command_of_a_scene_shows_that_it_is_at_work(command, monkeypatch):
    seen = displays(monkeypatch, error_handling)
    run(command, CARLINA)
    run(command, CONFIGS / "suspensions" / "trifilar.yaml", "--quiet", code=None)
    assert seen == [(command, False), (command, True)]


def test_a_comparison_of_models_says_how_far_it_is_in_python_too(monkeypatch):
    seen = displays(monkeypatch, scene)
    cablestudy.load(CARLINA).trade(columns="sag", repeats=1)
    assert seen == [("trade",)]
    assert activity._activity.startswith("run ")
