"""Core types of OpenBLAS that this machine can run: one name on each line, that of the machine itself first.

OpenBLAS has kernels for many processors, takes those of the machine, and others where OPENBLAS_CORETYPE names them.
They add in another order, so that last digits differ; a core type whose instructions the processor lacks falls back to
another one or is killed. So each is tried in a process of its own, which says what it has taken.
"""

import os
import platform
import re
import subprocess
import sys

X86 = (
    "Prescott", "Core2", "Penryn", "Nehalem", "Sandybridge", "Haswell", "SkylakeX", "Cooperlake", "SapphireRapids",
    "Barcelona", "Bulldozer", "Piledriver", "Steamroller", "Excavator", "Zen",
)  # fmt: skip
OTHERS = (
    "ARMV8", "ARMV8SVE", "CortexA57", "CortexA72", "NeoverseN1", "NeoverseN2", "NeoverseV1", "VORTEX",
    "POWER8", "POWER9", "POWER10", "Z13", "Z14",
)  # fmt: skip
WORK = """\
import numpy, scipy.linalg
matrix = numpy.random.default_rng(1).normal(size=(100, 100))
matrix = matrix @ matrix.T
values = scipy.linalg.eigh(matrix, eigvals_only=True)
numpy.testing.assert_allclose(numpy.linalg.eigvalsh(matrix), values, atol=1e-9 * values[-1])
"""


def taken(name):
    """What OpenBLAS takes where a core type is named, or without a name; None where that does not run."""
    variables = os.environ | {"OPENBLAS_CORETYPE": name, "OPENBLAS_VERBOSE": "2"}
    done = subprocess.run([sys.executable, "-c", WORK], env=variables, capture_output=True, text=True, check=False)
    found = re.search(r"^Core: (\w+)", done.stdout + done.stderr, re.MULTILINE)
    return found[1] if found and done.returncode == 0 else None


def main():
    """Print the names; the exit code, or why there are none."""
    own = taken("")
    if own is None:
        return "numpy has no OpenBLAS here that says which core type it takes"
    found = {own: own}
    for name in X86 if platform.machine() in ("x86_64", "AMD64") else OTHERS:
        found.setdefault(taken(name), name)
    sys.stdout.writelines(f"{name}\n" for core, name in found.items() if core)
    return 0


if __name__ == "__main__":
    sys.exit(main())
