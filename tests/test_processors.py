"""The core types of OpenBLAS that this machine can run (`benchmarks/processors.py`), for `make processors`."""

import os
import subprocess
import sys

import pytest
from command import ROOT

WITH_NAME = "import numpy; numpy.ones((2, 2)) @ numpy.ones((2, 2))"


def test_each_core_type_is_taken_by_its_name_and_none_twice():
    script = [sys.executable, str(ROOT / "benchmarks" / "processors.py")]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(done.stderr.strip())
    names, cores = done.stdout.split(), []
    assert names
    for name in names:
        told = os.environ | {"OPENBLAS_CORETYPE": name, "OPENBLAS_VERBOSE": "2"}
        one = subprocess.run([sys.executable, "-c", WITH_NAME], env=told, capture_output=True, text=True, check=True)
        cores.append(next(line for line in (one.stdout + one.stderr).splitlines() if line.startswith("Core: ")))
    assert len(set(cores)) == len(names)
