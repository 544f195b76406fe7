"""Section of docs/benchmarks.md: a body on six cables beside MoorPy and OpenSeesPy, and a net of 10,000 cables."""

import importlib
import json
import math
import os
import resource
import subprocess
import sys
import time
from itertools import pairwise

from cables import HERE, least, median, seconds, verdict
from peers import NoAnswerError, found
from scaling import exponent
from wind_rows import in_wind

ROWS, ROUNDS, PEER_ROWS = 400, 5, 20  # of the sweep; rounds; rows of another program in each round
TOLERANCES = 0.05, 1e-6  # of MoorPy [m]
MASSES = 20e3, 40e3  # of the cabin over the sweep [kg]
MODES, ACCURACY, TOGETHER, ROUNDS_OF_MODES = 20, 1e-6, 64, 30  # cases whose modes are computed together; rounds alone
BARS = 40  # of OpenSees, a cable
ARMS, ROUND = 1e3, 100.0  # EA of the rigid arms of OpenSees' body over that of a cable; their EI over EA [m^2]
NETS = {22: 1012, 45: 4140, 70: 9940}  # nodes along a side, and the cables of such a net
AIM_SECONDS, AIM_BYTES, AIM_EXPONENT = 20.0, 2e9, 1.3
COLUMNS = "cabin.x_m", "cabin.z_m", "cabin.pitch_deg", "min_tension_N", "max_tension_N"


def telescope():
    """Scene of configs/suspensions/fast.yaml whose lengths are found and stated (pose), and its equilibrium."""
    from cablestudy.scene.scene import load_scene
    from cablestudy.scene.suspension import SuspensionScene
    from cablestudy.study.suspension.case import SuspensionCase

    path = os.path.join(HERE, os.pardir, "configs", "suspensions", "fast.yaml")
    scene = load_scene(path)[1]
    (body,) = scene.bodies.values()
    cables = {
        name: {
            "from": list(scene.points[cable.ends[0]].at), "to": cable.ends[1], "unstretched_length": float(length),
            "elastic_modulus": cable.elastic_modulus, "area": cable.area, "density": cable.density,
        }
        for (name, cable), length in zip(scene.cables.items(), SuspensionCase(scene).equilibrium.lengths, strict=True)
    }  # fmt: skip
    kept = {key: getattr(body, key) for key in ("at", "mass", "center_of_mass", "inertia", "attachments")}
    bodies, model = {"cabin": kept}, {"accuracy": ACCURACY}
    return SuspensionScene.model_validate(
        {"gravity": scene.gravity, "bodies": bodies, "cables": cables, "model": model}
    )


def with_mass(scene, mass):
    """The same scene with another mass of the cabin [kg]."""
    return scene.with_value(("bodies", "cabin", "mass"), mass)


class MoorPyBody:
    """The cabin in MoorPy, made once; each case sets its mass and begins where the cabin is at 30 t."""

    setup = (
        "one `System` with a free body, its mass changed from row to row, `solveEquilibrium` with its default "
        "tolerance (0.05 m) and with one of 1e-6 m, from the place at 30 t; lines of no diameter and the seabed a "
        "thousand kilometres below"
    )

    def __init__(self, scene):
        moorpy, np = importlib.import_module("moorpy"), importlib.import_module("numpy")
        (body,) = scene.bodies.values()
        self.system = system = moorpy.System(depth=1e6, g=scene.gravity)
        self.begin = np.array([*body.at, 0.0, 0.0, 0.0])
        system.addBody(0, self.begin, m=body.mass, v=0, rCG=np.array(body.center_of_mass))
        for name, cable in scene.cables.items():
            weight = cable.section_mass * scene.gravity
            line = {
                "name": name,
                "m": cable.section_mass,
                "d_vol": 1e-9,
                "w": weight,
                "EA": cable.section_axial_stiffness,
            }
            system.lineTypes[name] = {**line, "d_nom": 1e-9, "material": "", "input_d": 1e-9, "input_type": ""}
            system.addPoint(1, np.array(cable.ends[0]))
            system.addPoint(1, np.zeros(3))
            system.bodyList[0].attachPoint(len(system.pointList), np.array(scene.attachment(cable.ends[1])[1]))
            points = {"pointA": len(system.pointList) - 1, "pointB": len(system.pointList)}
            system.addLine(cable.unstretched_length, name, **points, cb=-1e6)
        system.initialize()

    def solve(self, mass, tolerance):
        """Place of the cabin [m]; tolerance of places [m]."""
        (body,) = self.system.bodyList
        body.m = mass
        body.setPosition(self.begin)
        try:
            self.system.solveEquilibrium(tol=tolerance)
        except Exception as error:  # whatever it raises is its way of saying no
            raise NoAnswerError(str(error)) from None
        return body.r6[:3].copy()


class OpenSeesBody:
    """The cabin in OpenSees: bars as of one cable (`peers`), from nodes on our catenaries."""

    setup = (
        f"{BARS} `corotTruss` bars for each cable with `InitStrainMaterial`, lumped masses, from nodes on our "
        "catenaries; the cabin as one node with its mass and inertia, and stiff corotational beams from it to the "
        "attachments; one static step by `Newton` to 1e-8 m, `BandGeneral`, and `eigen`"
    )

    def __init__(self, ops, scene, equilibrium):
        import numpy as np

        self.ops, self.scene, (self.body,) = ops, scene, scene.bodies.values()
        share = np.arange(BARS + 1) / BARS
        moved, _ = equilibrium.catenary.at(np.broadcast_to(share, (len(scene.cables), BARS + 1)))
        span = equilibrium.catenary.span
        length = span.unstretched_length[:, None]
        local = moved * length[..., None]
        local[..., 0] += (1 + span.chord_strain)[:, None] * share * length
        ends = equilibrium.suspension.ends(equilibrium.position, equilibrium.rotation)
        self.nodes = (local[..., None] * span.frame[:, None]).sum(axis=-2) + ends[:, None, 0]
        R = equilibrium.rotation[0]
        self.center = equilibrium.position[0] + R @ np.array(self.body.center_of_mass)
        self.inertia = np.diag(R @ np.diag(self.body.inertia) @ R.T)

    def modes(self):
        """The lowest frequencies. [Hz]"""
        ops, g = self.ops, self.scene.gravity
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", 6)
        ops.node(1, *map(float, self.center))
        ops.mass(1, *[self.body.mass] * 3, *map(float, self.inertia))
        ops.geomTransf("Corotational", 1, 0.3, 0.5, 0.8)
        numbers, loads, elements = {}, [(1, self.body.mass)], 0  # place or attachment -> node; (node, its mass)
        stiff = ARMS * max(cable.section_axial_stiffness for cable in self.scene.cables.values())
        for places, cable in zip(self.nodes, self.scene.cables.values(), strict=True):
            own = cable.unstretched_length / BARS
            chain = [*map(tuple, places[:-1]), cable.ends[1]]
            for k, (key, place) in enumerate(zip(chain, places, strict=True)):
                if key not in numbers:
                    numbers[key] = node = len(numbers) + 2
                    ops.node(node, *map(float, place))
                    if k == BARS:  # a stiff beam to the cabin's center of mass
                        elements += 1
                        ops.element("elasticBeamColumn", elements, 1, node, 1.0, stiff, stiff, ROUND, ROUND, ROUND, 1)
                    else:
                        ops.fix(node, *[int(k == 0)] * 3, 1, 1, 1)
                loads.append((numbers[key], cable.section_mass * own / (2 if k in (0, BARS) else 1)))
            for k in range(BARS):
                elements += 1
                size = math.dist(places[k], places[k + 1])
                ops.uniaxialMaterial("Elastic", 2 * elements, cable.section_axial_stiffness * size / own)
                ops.uniaxialMaterial("InitStrainMaterial", 2 * elements + 1, 2 * elements, 1 - own / size)
                ends = numbers[chain[k]], numbers[chain[k + 1]]
                ops.element("corotTruss", elements, *ends, 1.0, 2 * elements + 1)
        ops.timeSeries("Linear", 1)
        ops.pattern("Plain", 1, 1)
        masses = {}
        for where, mass in loads:
            ops.load(where, 0.0, 0.0, -mass * g, 0.0, 0.0, 0.0)
            masses[where] = masses.get(where, 0.0) + mass
        for where, mass in masses.items():
            if where != 1:
                ops.mass(where, mass, mass, mass, 0.0, 0.0, 0.0)
        ops.constraints("Plain")
        ops.numberer("RCM")
        ops.system("BandGeneral")
        ops.test("NormDispIncr", 1e-8, 50)
        ops.algorithm("Newton")
        ops.integrator("LoadControl", 1.0)
        ops.analysis("Static")
        if ops.analyze(1):
            raise NoAnswerError("not converged")
        try:
            return [math.sqrt(max(value, 0.0)) / (2 * math.pi) for value in ops.eigen(MODES)]
        except Exception as error:  # as above
            raise NoAnswerError(str(error)) from None


def statics(peers):
    """Lines: a sweep of the cabin's mass."""
    import numpy as np

    from cablestudy.study.columns import find
    from cablestudy.study.suspension.rows import evaluate_suspensions

    scene, wanted = telescope(), [find(name) for name in COLUMNS]
    masses = np.linspace(*MASSES, ROWS)
    scenes = [with_mass(scene, mass) for mass in masses]
    moorpy = MoorPyBody(scene) if "MoorPy" in peers else None
    rows = evaluate_suspensions(scenes, wanted)
    own, theirs, errors = [], {tolerance: [] for tolerance in TOLERANCES}, {tolerance: [] for tolerance in TOLERANCES}

    def solve(part, tolerance):
        for index in part:
            try:
                place = moorpy.solve(masses[index], tolerance)
                errors[tolerance].append(abs(place[2] - rows[index].cells["cabin.z_m"]))
            except NoAnswerError:
                errors[tolerance].append(None)

    for turn in range(ROUNDS):
        own.append(ROWS / seconds(lambda: evaluate_suspensions(scenes, wanted)))
        for tolerance in TOLERANCES if moorpy else ():
            part = range(turn, ROWS, ROWS // PEER_ROWS)
            spent = seconds(lambda part=part, tolerance=tolerance: solve(part, tolerance))
            theirs[tolerance].append(len(part) / spent)
    yield "| program | rows/s | ours over it | largest difference of height, m | said no |"
    yield "|---|---:|---:|---:|---:|"
    yield f"| cablestudy | {median(own):.0f} | | | {sum(row.failed for row in rows)} |"
    ratios = []
    for tolerance in TOLERANCES if moorpy else ():
        ratios.append(median([mine / other for mine, other in zip(own, theirs[tolerance], strict=True)]))
        known = [error for error in errors[tolerance] if error is not None]
        yield (
            f"| MoorPy, {tolerance:g} m | {median(theirs[tolerance]):.0f} | {ratios[-1]:.0f} |"
            f" {max(known, default=math.nan):.1e} | {len(errors[tolerance]) - len(known)} |"
        )
    if ratios:
        yield ""
        yield f"Aim: at least 20 times MoorPy: {', '.join(verdict(ratio >= 20) for ratio in ratios)}."


def motion(peers):
    """Lines: the lowest coupled modes of one pose, and of many that are computed together."""
    import numpy as np

    from cablestudy.statics import equilibria
    from cablestudy.study.suspension.case import SuspensionCase
    from cablestudy.study.suspension.rows import cases_of

    scene = telescope()
    fine = SuspensionCase(scene.model_copy(update={"model": scene.model.model_copy(update={"accuracy": 1e-9})}))
    truth = fine.modes(MODES).frequency[:MODES]
    scenes = [with_mass(scene, mass) for mass in np.linspace(*MASSES, TOGETHER)]

    def modes_of(scenes):
        """Frequencies of the last case; seconds for statics and for modes of each case."""
        equilibria.forget()
        times, cases = [time.process_time()], cases_of(scenes)
        for case in cases:
            case.equilibrium  # noqa: B018
        times.append(time.process_time())
        found = [case.modes(MODES).frequency[:MODES] for case in cases]
        times.append(time.process_time())
        return found[-1], (np.diff(times) / len(scenes)).tolist()

    error = np.abs(modes_of([scene])[0] / truth - 1).max()
    alone = [modes_of([scene])[1] for _ in range(ROUNDS_OF_MODES)]
    sweep = [modes_of(scenes)[1] for _ in range(ROUNDS)]
    theirs, wrong = opensees_modes(peers, scene, truth)
    yield f"| program | statics, ms | {MODES} modes, ms | OpenSeesPy over these modes | largest error |"
    yield "|---|---:|---:|---:|---:|"
    ratios = []
    for name, times in ("alone", alone), (f"{TOGETHER} masses", sweep):
        static, modes = (min(column) for column in zip(*times, strict=True))
        ratios.append(theirs / modes)
        yield (
            f"| cablestudy, accuracy {ACCURACY:g}, {name} | {1e3 * static:.1f} | {1e3 * modes:.1f} |"
            f" {'' if math.isnan(theirs) else format(ratios[-1], '.1f')} | {error:.1e} |"
        )
    if math.isnan(theirs):
        return
    yield f"| OpenSeesPy, {BARS} bars a cable, statics and modes | | {1e3 * theirs:.0f} | | {wrong:.1e} |"
    yield ""
    yield f"Aim: at least 10 times OpenSeesPy: {', '.join(verdict(ratio >= 10) for ratio in ratios)}."


def opensees_modes(peers, scene, truth):
    """Seconds of OpenSeesPy for statics and modes, and its largest error; not a number without it."""
    import numpy as np

    from cablestudy.study.suspension.case import SuspensionCase

    if "OpenSeesPy" not in peers:
        return math.nan, math.nan
    body = OpenSeesBody(peers["OpenSeesPy"].ops, scene, SuspensionCase(scene).equilibrium)
    try:
        return least(body.modes), np.abs(np.array(body.modes()) / truth - 1).max()
    except NoAnswerError:
        return math.nan, math.nan


def net(side):
    """A square net of side x side nodes of 1 kg, 1 m apart, that sags under its weight between fixed edges."""
    inside = range(1, side + 1)

    def name(row, column):
        return f"n{row}-{column}" if row in inside and column in inside else [float(column), float(row), 0.0]

    points = {
        f"n{row}-{column}": {"at": [column, row, 0], "free": True, "mass": 1} for row in inside for column in inside
    }
    cables = {}
    for line in inside:
        for place in range(side + 1):
            cables[f"x{line}-{place}"] = {"from": name(line, place), "to": name(line, place + 1)}
            cables[f"y{line}-{place}"] = {"from": name(place, line), "to": name(place + 1, line)}
    shared = {"elastic_modulus": 1e11, "area": 1e-5, "density": 7850.0, "unstretched_length": 0.9999}
    return {"cable": shared, "points": points, "cables": cables, "model": {"accuracy": 1e-4}}


def measure(side):
    """CPU seconds and peak memory [bytes] for one net."""
    from cablestudy.scene.suspension import SuspensionScene
    from cablestudy.study.suspension.case import SuspensionCase

    times = [time.process_time()]
    case = SuspensionCase(SuspensionScene.model_validate(net(side)))
    times.append(time.process_time())
    case.equilibrium  # noqa: B018
    times.append(time.process_time())
    case.modes(MODES)
    times.append(time.process_time())
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    read, static, modes = (end - begin for begin, end in pairwise(times))
    return {"read": read, "static": static, "modes": modes, "memory": peak}


def nets():
    """Lines: effort against size."""
    yield f"| cables | scene s | statics s | {MODES} modes s | peak memory MB | aims |"
    yield "|---:|---:|---:|---:|---:|---|"
    rows = {}
    for side, count in NETS.items():
        command = [sys.executable, __file__, str(side)]
        rows[count] = row = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        total, aims = row["static"] + row["modes"], ""
        if side == max(NETS):
            aims = (
                f"at most {AIM_SECONDS:g} s: {verdict(total <= AIM_SECONDS)}; "
                f"at most {AIM_BYTES / 1e9:g} GB: {verdict(row['memory'] <= AIM_BYTES)}"
            )
        yield (
            f"| {count} | {row['read']:.1f} | {row['static']:.1f} | {row['modes']:.1f} | {row['memory'] / 1e6:.0f} |"
            f" {aims} |"
        )
    powers = [exponent(list(rows), [row[key] for row in rows.values()]) for key in ("static", "modes")]
    met = verdict(max(powers) <= AIM_EXPONENT)
    yield f"| exponent | | {powers[0]:.2f} | {powers[1]:.2f} | | at most {AIM_EXPONENT:g}: {met} |"


def section():
    """Lines of the section."""
    sizes = list(nets())  # first: their processes would inherit the peak memory of what other programs load
    known, missing = found()
    peers = {peer.name: peer for peer in known}
    yield (
        "The cabin of configs/suspensions/fast.yaml (six cables, six degrees of freedom), its lengths stated, and flat "
        "square nets that sag under the weight of their nodes; by CPU time, on one thread."
    )
    yield ""
    yield from (f"* {line}" for line in missing)
    yield f"* MoorPy: {MoorPyBody.setup}."
    yield f"* OpenSeesPy: {OpenSeesBody.setup}."
    yield ""
    yield f"Statics in a sweep of {ROWS} masses from {MASSES[0] / 1e3:g} to {MASSES[1] / 1e3:g} t:"
    yield ""
    yield from statics(peers)
    yield ""
    yield f"Statics, and the {MODES} lowest coupled modes, of each case; errors against the accuracy 1e-9:"
    yield ""
    yield from motion(peers)
    yield ""
    yield "configs/suspensions/carlina-net-wind.yaml: RMS, peaks, tensions and margins to 1e-4, with the loop closed:"
    yield ""
    yield from in_wind()
    yield ""
    yield "Nets, each in a process of its own; the exponents p of time ~ cables^p:"
    yield ""
    yield from sizes


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))  # noqa: T201
