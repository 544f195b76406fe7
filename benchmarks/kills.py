"""A sweep that is killed at random moments, each time resumed: is its table that of an uninterrupted one?

    python benchmarks/kills.py [COUNT]      # `make kills`: 100

SIGKILL, and between two of them SIGTERM or SIGINT, reach the sweep anywhere: while it starts, computes, writes a row,
or writes the table. Exit code 1 if a byte of the table differs, rows that were done are lost or damaged, a process or
temporary file is left, or a sweep that was asked to end says anything but how to go on.
"""

import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing, suppress
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STUDY = f"""base: {ROOT}/configs/slack.yaml
vary:
  - {{cable.unstretched_length: {{from: 186 m, to: 190 m, count: 40}}}}
  - {{cable.area: [20 mm^2, 24 mm^2, 28 mm^2]}}
columns: [preload, sag, cable_frequency]
"""
SIGNALS = (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
INTERRUPTED = 130
LAST_SECONDS = 600.0  # until the processes of a sweep must have ended
SWEEP = [sys.executable, "-m", "cablestudy", "sweep", "study.yaml", "--format", "csv", "--quiet"]


def main(count):
    """Kill so many sweeps; say what became of them."""
    generator = random.Random(1)
    with tempfile.TemporaryDirectory(prefix="cablestudy-kills-") as name:
        folder = Path(name)
        (folder / "study.yaml").write_text(STUDY)
        begin = time.monotonic()
        whole = subprocess.run([*SWEEP, "--jobs", "1"], cwd=folder, capture_output=True, check=True).stdout
        seconds = time.monotonic() - begin
        kills, stops, ends, table = 0, 0, 0, folder / "results" / "study.csv"
        assert table.read_bytes() == whole
        rows, done = folder / "results" / "study.rows.sqlite", 0
        rows.unlink()
        while kills < count:
            jobs, ended_by = str(generator.choice((1, 2))), generator.choice(SIGNALS)
            sweep = subprocess.Popen(
                [*SWEEP, "--resume", "--jobs", jobs], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
            )
            time.sleep(generator.uniform(0, 1.2 * seconds))
            sweep.send_signal(ended_by)
            said = sweep.communicate()[1].decode()
            if sweep.returncode == -signal.SIGKILL:
                kills += 1
            elif sweep.returncode == INTERRUPTED:
                stops += 1
                assert said == "interrupted\n" or said.startswith("interrupted: "), said
            elif sweep.returncode == -ended_by or "<frozen site>" in said:  # python itself was still starting
                stops += 1
            elif sweep.returncode == 0:  # it was faster: its table must be right, and another begins
                ends += 1
                assert table.read_bytes() == whole, "the table differs"
                rows.unlink()
            else:
                raise AssertionError(f"exit code {sweep.returncode} after {ended_by.name}: {said}")
            before, done = done, rows_in(rows)
            assert done >= before or sweep.returncode == 0, "rows are lost"
            sys.stdout.write(f"\r{kills} kills, {stops} stops, {ends} tables between them ")
            sys.stdout.flush()
        last = subprocess.run([*SWEEP, "--resume"], cwd=folder, capture_output=True, check=True).stdout
        assert last == whole, "the table differs"
        assert table.read_bytes() == whole, "the written table differs"
        left = sorted(path.name for path in (folder / "results").iterdir())
        assert left == ["study.csv", "study.md", "study.rows.sqlite", "study.run.yaml"], left
        latest = time.monotonic() + LAST_SECONDS
        while processes_in(folder):
            assert time.monotonic() < latest, "processes are left"
            time.sleep(0.1)
        sys.stdout.write(f"\r{kills} kills, {stops} stops, and {ends + 1} tables, each the same byte for byte\n")


def processes_in(folder):
    """Processes that work in a folder, where the system tells."""
    found = []
    for link in Path("/proc").glob("[0-9]*/cwd"):
        with suppress(OSError):
            if link.readlink() == folder.resolve():
                found.append(link.parent.name)
    return found


def rows_in(path):
    """How many rows the file of a sweep holds, and the log that a kill left; in a copy, which must be intact."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, "copy")
        for end in ("", "-wal"):
            with suppress(FileNotFoundError):
                shutil.copy(f"{path}{end}", f"{copy}{end}")
        with closing(sqlite3.connect(copy)) as database:
            assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",), "the rows on disk are damaged"
            tables = database.execute("SELECT count(*) FROM sqlite_master WHERE name = 'rows'").fetchone()[0]
            return database.execute("SELECT count(*) FROM rows").fetchone()[0] if tables else 0


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
