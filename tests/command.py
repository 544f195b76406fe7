"""The command line in tests: in this process, or as a process of its own where that matters."""

import cProfile
import csv
import io
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

from click.testing import CliRunner

from cablestudy.cli import main

ROOT = Path(__file__).parent.parent
CONFIGS = ROOT / "configs"
LONGEST = 900  # seconds until a process that hangs is given up: on a busy machine commands may take minutes
CARLINA, SLACK = str(CONFIGS / "carlina.yaml"), str(CONFIGS / "slack.yaml")


@dataclass(frozen=True)
class Outcome:
    """What a command left: exit code, standard output, standard error."""

    code: int
    out: str
    err: str

    @property
    def lines(self):
        """Lines of standard error."""
        return self.err.splitlines()


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self):
        return True


def run(*arguments, stdin=None, code=0):
    """A command in this process; its exit code must be the expected one, None for any."""
    result = CliRunner().invoke(main, [str(argument) for argument in arguments], input=stdin)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exc_info
    assert code is None or result.exit_code == code, result.stderr
    return Outcome(result.exit_code, result.stdout, result.stderr)


def refused_in_one_line(folder, words, *arguments):
    """A command that is refused with exit code 2 and one line that has these words, and that writes nothing."""
    assert words in refusal(*arguments)
    assert not list(folder.iterdir())


def refusal(*arguments, code=2):
    """The one line of a command that is refused, or has no answer, and prints no table."""
    done = run(*arguments, code=code)
    assert (done.out, len(done.lines)) == ("", 1), done.err
    return done.lines[0]


def with_sets(*changes):
    """Options `--set` of these changes."""
    return [word for change in changes for word in ("--set", change)]


def process(*arguments, **options):
    """A command in a process of its own."""
    command = [sys.executable, "-m", "cablestudy", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False, **options)
    return Outcome(done.returncode, done.stdout, done.stderr)


def python(code, **options):
    """What a program prints, in a process of its own that must end well."""
    command = [sys.executable, "-c", code]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=LONGEST, **options).stdout


def start(*arguments):
    """A sweep in a process of its own, the first of a group, left to run."""
    return _started("-m", "cablestudy", "sweep", *arguments)


def start_paused(rows, *arguments, where="after"):
    """A sweep as `start` has it, which stands still once so many rows are on disk, or `within` that transaction.

    `go_on` lets it run again.
    """
    sweep = _started(ROOT / "tests" / "paused_sweep.py", rows, where, "sweep", *arguments)
    _, status = os.waitpid(sweep.pid, os.WUNTRACED)
    assert os.WIFSTOPPED(status), sweep.stderr.read()
    return sweep


def go_on(sweep):
    """Let a sweep that `start_paused` began run again, to its end: its exit code and standard error."""
    sweep.send_signal(signal.SIGCONT)
    _, said = sweep.communicate(timeout=LONGEST)
    assert "Traceback" not in said
    return sweep.returncode, said


def _started(*words):
    streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen([sys.executable, *map(str, words)], **streams, text=True, start_new_session=True)


def stored_rows(path):
    """Numbers of the rows in the file of a sweep, also while it runs: a copy is read, since the file is locked."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "copy")
        for end in ("", "-wal"):
            with suppress(FileNotFoundError):
                shutil.copy(f"{path}{end}", f"{copy}{end}")
        try:
            with closing(sqlite3.connect(copy)) as database:
                return [row for (row,) in database.execute("SELECT row FROM rows WHERE status IS NOT NULL")]
        except sqlite3.DatabaseError:  # not begun yet, or written to while it was copied
            return []


def edit_rows(path, *statements):
    """Execute SQL statements in the file of a sweep that has ended."""
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        for statement in statements:
            database.execute(statement)


def interrupt(path, *statements):
    """Make a sweep that has ended one that was interrupted, after SQL statements in its file."""
    edit_rows(path, *statements, "UPDATE about SET value = '0' WHERE name = 'finished'")


def calls(function, *arguments):
    """How many Python functions are called meanwhile, which no machine changes as it does times; and what it returns.

    C functions count too.
    """
    before, profile = sys.getprofile(), cProfile.Profile()
    profile.enable()
    try:
        returned = function(*arguments)
    finally:
        profile.disable()
        sys.setprofile(before)
    return sum(entry.callcount for entry in profile.getstats()), returned


def rows_of(text, style):
    """Rows of a table in CSV, JSON or JSON lines; numbers as floats, empty cells as None."""
    if style == "csv":
        return [{name: _cell(cell) for name, cell in row.items()} for row in csv.DictReader(io.StringIO(text))]
    return json.loads(text)["rows"] if style == "json" else [json.loads(line) for line in text.splitlines()]


def table_of(*arguments, code=0, stdin=None):
    """Rows that a command prints as JSON."""
    return rows_of(run(*arguments, "--format", "json", code=code, stdin=stdin).out, "json")


def stored_table(path="results/study.csv"):
    """Rows of a table that a sweep has written."""
    return rows_of(Path(path).read_text(encoding="utf-8"), "csv")


def _cell(text):
    try:
        return float(text)
    except ValueError:
        return text or None


def write(path, text):
    """Write a text into a file; its name."""
    Path(path).write_text(text, encoding="utf-8")
    return str(path)


def written(text, name="scene.yaml"):
    """A file in the working directory; its name."""
    return write(name, text)


def study_file(folder, text, base=CARLINA):
    """A study upon a scene of configs/, written to a folder; its name."""
    return write(Path(folder) / "study.yaml", f"base: {base}\n{text}")
