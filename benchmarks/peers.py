"""Other programs on the same cables: OpenSeesPy (corotational bars) and MoorPy (catenary)."""

import ctypes
import importlib
import importlib.metadata
import math
import pathlib
import sysconfig

from cables import CHORD, EA, MASS, WEIGHT

BARS = 40
TOLERANCE = 1e-10  # of OpenSees' displacement increment [m]
STEPS = 50


class NoAnswerError(Exception):
    """The program says that it has no answer."""


class OpenSees:
    """Corotational trusses; `setup` says how."""

    name, package = "OpenSeesPy", "openseespy"
    setup = (
        f"{BARS} `corotTruss` bars with `InitStrainMaterial`, so that each has exactly its unstretched length, from "
        "nodes on the parabola of the tension that the taut-cable cubic estimates; weight as loads on the nodes, in "
        f"one step; `Newton` to a displacement increment of {TOLERANCE:g} m in at most {STEPS} steps, "
        "`BandGeneral` (the fastest here of its solvers that fail on none); in the plane for statics alone, in space "
        "with lumped masses and `eigen` (its default solver) for the modes"
    )

    def __init__(self):
        try:
            self.ops = importlib.import_module("openseespy.opensees")
        except RuntimeError:  # its own libraries are beside it, and it does not find all of them
            for module in ("openseespylinux.opensees", "openseespylinux", "openseespy.opensees", "openseespy"):
                importlib.sys.modules.pop(module, None)
            beside = pathlib.Path(sysconfig.get_path("platlib"), "openseespylinux", "lib")
            for library in ("quadmath.so.0", "gfortran.so.4", "gomp.so.1", "blas.so.3", "lapack.so.3"):
                ctypes.CDLL(str(beside / f"lib{library}"), mode=ctypes.RTLD_GLOBAL)
            self.ops = importlib.import_module("openseespy.opensees")

    def _start(self, cable):
        """Nodes along and above end 1 on a parabola, two lists. [m]"""
        strain, load = CHORD / cable.length - 1, WEIGHT * cable.length * math.cos(cable.inclination)
        tension = max(strain, 0.0) * EA + (EA * load**2 / 24) ** (1 / 3)
        for _ in range(60):  # T^3/EA - strain T^2 = load^2/24
            value = tension**2 * (tension / EA - strain) - load**2 / 24
            tension -= value / max(tension * (3 * tension / EA - 2 * strain), 1e-300)
            tension = max(tension, 1e-6)
        sag, across, rise = load * CHORD / (8 * tension), cable.across, cable.rise
        shares = [k / BARS for k in range(BARS + 1)]
        return [across * s for s in shares], [rise * s - 4 * sag * s * (1 - s) for s in shares]

    def _solve(self, cable, dimensions, mass):
        """Build and solve; the axial forces. [N]"""
        ops, x, z = self.ops, *self._start(cable)
        own = cable.length / BARS
        ops.wipe()
        ops.model("basic", "-ndm", dimensions, "-ndf", dimensions)
        level, free = [0.0] * (dimensions - 1), [1] * dimensions
        for k in range(BARS + 1):
            ops.node(k + 1, x[k], *level[1:], z[k])
        for end in (1, BARS + 1):
            ops.fix(end, *free)
        for k in range(BARS):
            size = math.hypot(x[k + 1] - x[k], z[k + 1] - z[k])
            ops.uniaxialMaterial("Elastic", 2 * k + 1, EA * size / own)
            ops.uniaxialMaterial("InitStrainMaterial", 2 * k + 2, 2 * k + 1, 1 - own / size)
            ops.element("corotTruss", k + 1, k + 1, k + 2, 1.0, 2 * k + 2)
        ops.timeSeries("Linear", 1)
        ops.pattern("Plain", 1, 1)
        for node in range(2, BARS + 1):
            ops.load(node, *level, -WEIGHT * own)
            if mass:
                ops.mass(node, *[MASS * own] * dimensions)
        ops.constraints("Plain")
        ops.numberer("Plain")
        ops.system("BandGeneral")
        ops.test("NormDispIncr", TOLERANCE, STEPS)
        ops.algorithm("Newton")
        ops.integrator("LoadControl", 1.0)
        ops.analysis("Static")
        if ops.analyze(1):
            raise NoAnswerError("not converged")
        return [ops.eleResponse(k + 1, "axialForce")[0] for k in range(BARS)]

    def static(self, cable):
        """Mean and least tension of the bars. [N]"""
        forces = self._solve(cable, 2, False)
        return sum(forces) / BARS, min(forces)

    def modes(self, cable, count):
        """Statics, and the lowest frequencies. [Hz]"""
        self._solve(cable, 3, True)
        try:
            return [math.sqrt(max(value, 0.0)) / (2 * math.pi) for value in self.ops.eigen(count)]
        except Exception as error:  # whatever it raises is its way of saying no
            raise NoAnswerError(str(error)) from None


class MoorPy:
    """The catenary of a mooring line; `setup` says how."""

    name, package = "MoorPy", "MoorPy"
    setup = (
        "`moorpy.Catenary.catenary` with its default tolerance (1e-6 m at the end) and the seabed a thousand "
        "kilometres below (`CB=-1e6`), so that nothing lies on it; its answer includes the end stiffness"
    )

    def __init__(self):
        self.catenary = importlib.import_module("moorpy.Catenary").catenary

    def static(self, cable):
        """Mean of the tensions at the ends, and the horizontal one, which is the least or below it. [N]"""
        try:
            H1, V1, H2, V2, _ = self.catenary(cable.across, cable.rise, cable.length, EA, WEIGHT, CB=-1e6)
        except Exception as error:  # as above
            raise NoAnswerError(str(error)) from None
        return (math.hypot(H1, V1) + math.hypot(H2, V2)) / 2, abs(float(H1))


def found():
    """The programs that are installed, and why the others are not.

    Returns
    -------
    peers : list
    missing : list of str
        One line each.
    """
    peers, missing = [], []
    for kind in (OpenSees, MoorPy):
        try:
            peer = kind()
        except (ImportError, OSError, RuntimeError) as error:
            missing.append(f"{kind.name} is not here ({' '.join(str(error).split())}): its columns are empty.")
            continue
        peer.version = importlib.metadata.version(kind.package)
        peers.append(peer)
    return peers, missing
