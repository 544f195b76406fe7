"""No test depends on the clock: a busy machine is slow, and is not wrong."""

import os
import re
from pathlib import Path

import pytest
from command import LONGEST, calls
from hypothesis import HealthCheck, settings

TESTS = sorted(Path(__file__).parent.rglob("*.py"))
CLOCK = re.compile(r"^(?:import|from) time\b", re.MULTILINE)
TIMEOUT = re.compile(r"timeout=(\d+)")
# what gives up after a time without which a hang would never end; random scenes and fuzz say how long each took
HANGS = {"cluster.py", "test_resume.py", "random_scenes.py", "random_suspensions.py", "fuzz.py"}


def test_no_test_looks_at_the_clock():
    assert {path.name for path in TESTS if CLOCK.search(path.read_text(encoding="utf-8"))} <= HANGS


@pytest.mark.parametrize("path", TESTS, ids=lambda path: path.name)
def test_no_process_is_given_up_before_it_surely_hangs(path):
    given = [int(seconds) for seconds in TIMEOUT.findall(path.read_text(encoding="utf-8"))]
    assert [seconds for seconds in given if seconds < LONGEST / 3] == []


def test_examples_that_are_drawn_have_no_deadline_and_commands_show_no_progress():
    assert settings.default.deadline is None
    assert HealthCheck.too_slow in settings.default.suppress_health_check
    assert os.environ["CABLESTUDY_PROGRESS"] == "off"


def test_calls_are_counted():
    def twice():
        len("")
        return 7

    number, returned = calls(twice)
    assert (number > 1, returned) == (True, 7)
    assert calls(lambda: [twice() for _ in range(100)])[0] - calls(lambda: [twice() for _ in range(50)])[0] == 100
