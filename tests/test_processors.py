"""The core types of OpenBLAS that this machine can run (`benchmarks/processors.py`), for `make processors`."""

import os
import subprocess
import sys

import pytest
from campaign import campaign
from command import ROOT

sys.path.append(str(ROOT / "benchmarks"))  # after the tests: some names are in both
import processors

WITH_NAME = "import numpy; numpy.ones((2, 2)) @ numpy.ones((2, 2))"


def test_each_core_type_is_taken_by_its_name_and_none_twice(monkeypatch, capsys):
    monkeypatch.setattr(processors, "X86", campaign(processors.X86, ("Nehalem", "Haswell", "SkylakeX", "Zen")))
    if reason := processors.main():
        pytest.skip(reason)
    names, cores = capsys.readouterr().out.split(), []
    assert names
    for name in names:
        told = os.environ | {"OPENBLAS_CORETYPE": name, "OPENBLAS_VERBOSE": "2"}
        one = subprocess.run([sys.executable, "-c", WITH_NAME], env=told, capture_output=True, text=True, check=True)
        cores.append(next(line for line in (one.stdout + one.stderr).splitlines() if line.startswith("Core: ")))
    assert len(set(cores)) == len(names)
