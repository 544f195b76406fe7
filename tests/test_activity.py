"""What is shown of a command that takes long: when, what, and that it can be silenced; no test depends on the clock."""

import io
import itertools
import threading
from types import SimpleNamespace

import pytest
from command import CARLINA, CONFIGS, Terminal, run, study_file

import cablestudy
from cablestudy import activity
from cablestudy.cli import error_handling
from cablestudy.interface import scene
from cablestudy.study import find
from cablestudy.sweeps import progress


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


# ------------------------------------------------------------------------------------------------ progress of a sweep


@pytest.fixture
def now(monkeypatch):
    """The clock of the progress reports, to be set."""
    time = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: time[0])
    monkeypatch.setenv(progress.OFF, "on")
    return time


def test_a_terminal_has_a_bar_and_anything_else_a_line_now_and_then(now):
    terminal, plain = Terminal(), io.StringIO()
    bars = [progress.Progress(1000, 100, stream=stream) for stream in (terminal, plain)]
    for second in range(1, 62):
        now[0] = second - 0.125
        for bar in bars:
            bar(100 + 10 * second, 1.0)
    for bar in bars:
        bar.close()
    assert plain.getvalue().splitlines() == [
        "140 of 1000 rows, 10 rows/s, 86 s left",  # early, since it will take more than a minute
        "440 of 1000 rows, 10 rows/s, 56 s left",
    ]
    drawn = terminal.getvalue()
    assert drawn.startswith("\r[##......................] 120 of 1000 rows, 10 rows/s, 88 s left\x1b[K\r[")
    assert drawn.endswith("\r\x1b[K")
    assert "\n" not in drawn


@pytest.mark.parametrize(
    ("total", "rate", "lines"),
    [
        (600, 10, []),  # less than a minute is left after 3 s
        (1000, 5, []),  # only 15 rows after 3 s, and then a line in any case after 30 s
        (128_991, 10, ["30 of 128991 rows, 10 rows/s, 3.6 h left"]),
    ],
)
def test_a_long_sweep_is_announced_early(now, total, rate, lines):
    stream = io.StringIO()
    report = progress.Progress(total, stream=stream)
    for second in (1, 2, 3, 4):
        now[0] = float(second)
        report(rate * second, 1.0)
    assert stream.getvalue().splitlines() == lines


def test_the_time_left_does_not_count_what_comes_once(now):
    """A row here and the start of two processes, whose first rows take long; then 100 rows/s."""
    bar, total, end = progress.Progress(1001, stream=Terminal()), 1001, 3.0 + 10.0
    reports = [(0.5, 1, 0.5), (2.7, 2, 0.6), (3.0, 3, 0.9)]
    reports += [(3.0 + 0.05 * step, 3 + 5 * step, 0.1) for step in range(1, 200)]
    shown = 0
    for seconds, done, took in reports:
        now[0] = seconds
        bar(done, took)
        if bar.rate is not None:
            shown += 1
            assert (total - done) / bar.rate == pytest.approx(end - seconds, rel=0.05, abs=0.1)
        assert ("left" in bar.line(done)) == (bar.rate is not None)
    assert shown > 0.7 * len(reports)


def test_rows_that_take_long_tell_the_time_left_at_once(now):
    bar = progress.Progress(10, stream=Terminal())
    for done in (1, 2, 3):
        now[0] = 60.0 * done
        bar(done, 60.0)
        assert bar.line(done) == f"{done} of 10 rows, 0.0167 rows/s, {10 - done} min left"


@pytest.mark.parametrize("stream", [Terminal, io.StringIO])
def test_an_environment_variable_silences_progress_alone(now, monkeypatch, stream):
    """What is compared with stored text then does not depend on the clock; notes stay, unlike with --quiet."""
    written = {}
    for value in ("on", "off"):
        monkeypatch.setenv(progress.OFF, value)
        bar = progress.Progress(1000, stream=stream())
        for second in range(1, 62):
            now[0] += 1.0
            bar(10 * second, 1.0)
        bar.close()
        written[value] = bar._stream.getvalue()
    assert written["on"] != ""
    assert written["off"] == ""


def test_a_sweep_that_takes_long_says_so_unless_it_is_silenced(folder, monkeypatch):
    """By the slowest of clocks: each look at it takes a minute."""
    study_file(folder, "vary: [{cable.area: [20 mm^2, 25 mm^2, 30 mm^2]}]\ncolumns: [mass, sag]\n")
    clock = itertools.count(0.0, 60.0)
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    monkeypatch.setenv(progress.OFF, "on")
    assert " of 3 rows" in run("sweep", "study.yaml", "--no-write").err
    monkeypatch.setenv(progress.OFF, "off")
    assert run("sweep", "study.yaml", "--no-write").err == ""


def test_what_takes_no_time_shows_no_progress():
    terminal = Terminal()
    bar = progress.Progress(10, stream=terminal)
    for done in range(1, 11):
        bar(done, 0.0)
    bar.close()
    assert terminal.getvalue() == ""


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.1, "1 s"), (60, "60 s"), (90, "2 min"), (5399, "90 min"), (9000, "2.5 h")]
)
def test_times_for_people(seconds, text):
    assert progress.rounded_duration(seconds) == text
