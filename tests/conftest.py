"""Before numpy is imported: one thread, as the command line has it; the matrices are too small for more."""

import os

import pytest

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")
os.environ["CABLESTUDY_PROGRESS"] = "off"  # it depends on how busy the machine is


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working directory of a test."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
