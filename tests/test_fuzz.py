"""A fixed slice of tests/fuzz.py, and that it finds what it looks for."""

import subprocess
import sys
from pathlib import Path

import fuzz
import pytest
from campaign import campaign

FIRST, COUNT = 100, campaign(18, 4)


def test_mutated_files_end_with_an_answer_or_with_messages():
    command = [sys.executable, Path(fuzz.__file__), "--first", str(FIRST), "--count", str(COUNT)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{COUNT} files, 0 findings" in done.stdout
    # the slice reaches refusals, answers and cases without an answer
    for line in ("validate: ", "static: ", "modes: ", "windrms: ", "ssm: ", "sweep: "):
        assert line in done.stdout
    for code in (0, 2, 3):
        assert f"times exit code {code}\n" in done.stdout


def test_a_number_is_always_the_same_file():
    files = [fuzz.mutated(number)[0] for number in range(100)]
    assert files == [fuzz.mutated(number)[0] for number in range(100)]
    assert len(set(files)) > 95


def test_scenes_suspensions_studies_and_options_are_mutated():
    assert {fuzz.mutated(number)[1] for number in range(60)} == {"scene", "suspension", "study"}
    options = [fuzz.mutated_sets(number) for number in range(200)]
    assert options == [fuzz.mutated_sets(number) for number in range(200)]
    given = [option for option in options if option]
    assert 10 < len(given) < 60
    assert all(set(option[::2]) == {"--set"} and all("=" in text for text in option[1::2]) for option in given)


def test_a_name_is_changed_wherever_it_stands():
    top = fuzz.tree({"points": {"p": "[0, 0, 0]"}, "cables": {"c": {"from": "p", "to": "b.a"}}})
    for seed in range(40):
        changed = fuzz.copy.deepcopy(top)
        fuzz.rename_everywhere(fuzz.random.Random(seed), changed)
        assert changed != top
        (_, points), (_, cables) = changed
        assert cables[0][1][0][1] == points[0][0]


FINE = {"arguments": ["static"], "code": 0, "out": "| sag | 1 |\n", "err": "", "seconds": 1.0, "memory": 1 << 27}


@pytest.mark.parametrize(
    ("changes", "finding"),
    [
        ({"code": 1, "err": "Traceback (most recent call last):\n  ...\nKeyError: 'a'\n"}, "traceback: KeyError: 'a'"),
        ({"code": -9}, "exit code -9"),
        ({"err": "x.py:3: RuntimeWarning: overflow\n"}, "warning: x.py:3: RuntimeWarning: overflow"),
        ({"seconds": 31.0}, "31 s"),
        ({"seconds": 32.0, "err": "4 of 9 rows, 0.111 rows/s, 45 s left\n"}, None),
        ({"code": -24, "seconds": 60.0, "err": "31 of 99999 rows, 5 rows/s, 5.5 h left\n"}, None),
        ({"seconds": 40.0, "err": "loop: 8 s\nloop: 16 s, motion with 64 modes\n"}, None),
        ({"seconds": 40.0, "err": "loop: 16 s\nloop: 32 s\n"}, "40 s"),
        ({"memory": 3 << 29}, "1.5 GB"),
        ({"code": 3}, "exit code 3 without a message"),
        ({"err": "x" * 1001}, "a message of 1001 characters"),
        ({"err": "cable.\x1b[31m: unknown key\n"}, "a control character in a message"),
        ({"code": 2, "err": "x.yaml:1:1: wrong\n"}, "a table beside a refusal"),
        ({"out": "| sag | nan |\n"}, "a number that is not finite"),
    ],
)
def test_what_is_a_finding(changes, finding):
    assert list(fuzz.faults(fuzz.Run(**FINE))) == []
    assert list(fuzz.faults(fuzz.Run(**(FINE | changes)))) == [finding] * (finding is not None)
