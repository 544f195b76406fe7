"""A dask scheduler with worker processes, for tests."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from command import LONGEST


class Cluster:
    """A scheduler and its workers, each a process of its own; its file and what workers write are in a folder."""

    def __init__(self, folder):
        self._folder, self.file = Path(folder), Path(folder) / "scheduler.json"
        self._environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        self.scheduler = self._start("scheduler", "--port", "0", "--scheduler-file", self.file, "--no-dashboard")
        self.workers = []
        self.address = self._wait_for_address()

    def add(self):
        """One more worker."""
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", self._folder)
        self.workers.append(self._start("worker", self.address, *options))

    def _start(self, kind, *options):
        command = [sys.executable, "-m", "dask", kind, *map(str, options)]
        log = open(self._folder / f"{kind}-{time.monotonic_ns()}.log", "wb")  # noqa: SIM115
        with log:
            return subprocess.Popen(command, env=self._environment, stdout=log, stderr=log)

    def _wait_for_address(self):
        """Of the scheduler, which writes it into its file."""
        end = time.monotonic() + LONGEST
        while True:
            try:
                return json.loads(self.file.read_text())["address"]
            except (OSError, ValueError):
                if time.monotonic() > end or self.scheduler.poll() is not None:
                    raise
                time.sleep(0.1)


@contextmanager
def cluster(folder, workers):
    """A cluster while a test runs."""
    made = Cluster(folder)
    try:
        for _ in range(workers):
            made.add()
        yield made
    finally:
        for process in (*made.workers, made.scheduler):
            process.kill()
            process.wait()
