"""The command `windrms` on suspensions: tables, messages, columns in sweeps; the physics is in test_suspension_wind."""

import json
import math
import re

import numpy as np
import pytest
from command import rows_of, run, study_file, table_of, with_sets, written
from scenes import scene_of
from suspension_cases import SUSPENSIONS, case_at, numbers, row, variances_of

import cablestudy as cs
from cablestudy.errors import ConvergenceError
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.scene import load_scene
from cablestudy.study.columns import find
from cablestudy.study.suspension import rows
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.system.comparison import error_of_root

pytestmark = pytest.mark.usefixtures("folder")

# A body of 50 kg on six light, stiff wires along x, y and z: each axis is an oscillator of its own.
MASS, STIFFNESS, AREA, DRAG, SPEED, RHO = 50.0, 2e5, 0.5, 1.2, 8.0, 1.2
SCENE = f"""\
gravity: 0
cable: {{elastic_modulus: 1 GPa, area: 10 mm^2, density: 1e-3, preload: 1 kN,
        damping: {{model: kelvin_voigt, time: 2 ms}}}}
bodies:
  box:
    at: [0, 0, 0]
    mass: {MASS}
    inertia: [4, 4, 4]
    attachments: {{px: [1, 0, 0], nx: [-1, 0, 0], py: [0, 1, 0], ny: [0, -1, 0], pz: [0, 0, 1], nz: [0, 0, -1]}}
    markers: {{eye: [0, 0, 0.5]}}
    wind: {{area: {AREA}, drag_coefficient: {DRAG}}}
cables:
  px: {{from: [101, 0, 0], to: box.px}}
  nx: {{from: [-101, 0, 0], to: box.nx}}
  py: {{from: [0, 101, 0], to: box.py}}
  ny: {{from: [0, -101, 0], to: box.ny}}
  pz: {{from: [0, 0, 101], to: box.pz}}
  nz: {{from: [0, 0, -101], to: box.nz}}
wind: {{speed: {SPEED}, turbulence_intensity: 0.2, length_scale: 50, on: bodies}}
"""
WINCHES = "winches: {px: {}, nx: {}, py: {}, ny: {}, pz: {}, nz: {}}\ncontrol: {gain: 0.5, measured: [x, y, z]}\n"
GENTLE = WINCHES.replace("0.5", "0.005")  # below the largest gain with the mass, 0.0077 rad/s
MASS_X = "mass_x: {axis: [1, 0, 0], mass: 1, frequency: 1 Hz, velocity_gain: 50, stroke: 1 um, force: 100}"


def without(wires):
    """The scene without some of its wires, in which the body moves along x and z alone."""
    return re.sub(f"  {wires}: .*\n", "", SCENE).replace("    mass:", "    free: [x, z]\n    mass:")


@pytest.fixture
def scene(folder):
    """The file of the scene with winches and a loop."""
    return written(SCENE + WINCHES)


def test_mean_displacement_by_drag_over_stiffness(scene):
    """The wires along x stretch by EA/L each; those across it stiffen by T/L."""
    found = table_of("windrms", scene, "--table", "motion")[0]
    wire = 1e9 * 10e-6
    unstretched = 100 / (1 + 1000 / wire)
    stiffness = 2 * wire / unstretched + 4 * 1000 / 100
    assert found["mean_x_mm"] == pytest.approx(1e3 * RHO / 2 * DRAG * AREA * SPEED**2 / stiffness, rel=2e-4)
    assert found["mean_y_mm"] == 0
    # turbulence along the mean wind only
    assert found["rms_y_mm"] == pytest.approx(0, abs=1e-9 * found["rms_x_mm"])
    assert found["rms_mm"] == pytest.approx(found["rms_x_mm"])


def test_the_utilisation_is_that_at_rest_where_the_strength_is_known(scene):
    rows = table_of("windrms", scene, "--table", "cables", "--set", "cables.px.breaking_force=4 kN")
    assert {row["name"]: row.get("utilisation") for row in rows} == {
        "px": pytest.approx(1000 / 4000, rel=1e-9), **dict.fromkeys(("nx", "py", "ny", "pz", "nz"))
    }  # fmt: skip
    assert "utilisation" not in table_of("windrms", scene, "--table", "cables")[0]


def test_a_loop_that_makes_the_motion_larger_is_told(scene):
    loud = [*("--set", "control.notch=none", "--set", "cable.density=1"),  # at 1e-6 rounding spoils the sums over poles
            *("--set", "control.gain={auto: {gain_margin: 0.2 dB, sensitivity: 1000}}")]  # fmt: skip
    done = run("windrms", scene, *loud, "--format", "json")
    closed, at_rest = (json.loads(done.out)[table]["rows"][0] for table in ("motion", "open_loop"))
    assert closed["rms_mm"] > 1.2 * at_rest["rms_mm"]
    both = f"{closed['rms_mm']:.3g} mm, not {at_rest['rms_mm']:.3g} mm"
    note = f"note: with the loop the RMS is larger than with the winch at rest: box {both}, box.eye {both}"
    assert [line for line in done.lines if "the loop" in line] == [note]
    assert run("windrms", scene, *loud, "--table", "motion").err == ""  # it would be computed for the note alone
    assert "the loop" not in run("windrms", scene).err


def test_tables_of_a_scene_with_loop(scene):
    tables = json.loads(run("windrms", scene, "--format", "json").out)
    assert list(tables) == ["motion", "rotations", "open_loop", "cables", "loop", "coordinates"]
    assert [row["name"] for row in tables["motion"]["rows"]] == ["box", "box.eye"]
    assert [row["coordinate"] for row in tables["coordinates"]["rows"]] == ["box.x", "box.y", "box.z"]
    assert tables["loop"]["rows"][0]["gain_rad_per_s"] == 0.5
    text = run("windrms", scene).out
    assert all(f"## {name}\n" in text for name in tables)


@pytest.mark.parametrize("axis", "xyz")
def test_the_gain_margin_of_the_only_coordinate_is_that_of_the_loop(axis):
    """Across the wind rounding alone lets the loop drive a rotation that nothing damps: no limit of either."""
    tables = cs.load(written(SCENE + WINCHES.replace("[x, y, z]", f"[{axis}]"))).compute("windrms").tables
    alone, loop = tables["coordinates"].rows[0], tables["loop"].rows[0]
    assert alone["gain_margin_dB"] == pytest.approx(loop["gain_margin_dB"], abs=1e-6)


def test_what_grows_is_counted_beside_a_mode_that_never_does():
    """Far above the largest gain the undamped rotation crosses back: as many poles grow as of the model itself."""
    closed_loop = SuspensionCase(scene_of(SCENE + WINCHES.replace("[x, y, z]", "[y]"))).analysis.loop_for_margins
    for gain in 100.0, 200.0, 3e5:
        growing = np.count_nonzero(closed_loop.loop.poles_with(gain).real > 1e-6)
        assert closed_loop.stability.gains.unstable(gain) == growing == (0 if gain < 150 else 2)


def test_an_unstable_loop_has_its_limits_and_the_motion_with_the_winches_at_rest(scene):
    """The limits are those of a gain below them; the motion is that of the scene without winches."""
    known = cs.load(scene).compute("windrms").tables["loop"].rows[0]
    limit = known["largest_gain_rad_per_s"]
    found = cs.load(scene, set=[f"control.gain={2 * limit!r}", "control.max_speed=1 m/s"]).compute("windrms")
    row = found.tables["loop"].rows[0]
    assert row["gain_rad_per_s"] == 2 * limit
    assert row["gain_margin_dB"] == pytest.approx(20 * math.log10(0.5), rel=1e-9)
    for name in ("largest_gain_rad_per_s", "phase_crossover_Hz"):
        assert row[name] == pytest.approx(known[name], rel=1e-9)
    numbers = [name for name, cell in row.items() if cell is not None]
    assert numbers == ["gain_rad_per_s", "largest_gain_rad_per_s", "gain_margin_dB", "phase_crossover_Hz"]
    at_rest = cs.load(written(SCENE, "rest.yaml")).compute("windrms").tables
    for table in ("motion", "rotations"):
        for open_, closed, alone in zip(found.tables["open_loop"].rows, found.tables[table].rows,
                                        at_rest[table].rows, strict=False):  # fmt: skip
            moved = [name for name in alone if name.startswith("rms")]
            assert [open_[name] for name in moved] == pytest.approx([alone[name] for name in moved], rel=1e-6, abs=1e-9)
            assert [closed[name] for name in moved] == [None] * len(moved)
    assert [list(one.values())[2] for one in found.tables["coordinates"].rows] == [None] * 3
    assert len(found.failures) == 1
    assert found.failures[0].startswith("the loop is unstable at ")


@pytest.mark.parametrize("columns", [
    ("largest_gain", "gain_margin"), ("box.rms_x_open_loop",), ("gain", "box.rms", "phase_margin"), ("winch_rms_speed",)
])  # fmt: skip
def test_the_row_of_an_unstable_loop_says_so_whatever_it_shows(scene, columns):
    columns = [find(name) for name in columns]
    model = load_scene(scene, ["control.gain=5000"])[1]
    row = rows.evaluate_suspensions([model], columns)[0]
    refused = {"box.rms_mm", "phase_margin_deg", "winch_rms_speed_mm_per_s"}
    assert {column.header for column in columns if row.cells[column.header] is None} <= refused
    assert row.cells["status"].startswith("the loop is unstable at 5000 rad/s: ")
    assert row.cells["status"].count("unstable") == 1


def test_what_nothing_damps_refuses_the_motion_that_it_is_and_no_other():
    """No strain of straight wires is damped here but that of two: along x alone a motion is bounded."""
    wind = "wind.aerodynamic_damping=false", "wind.turbulence_intensity=[0.2, 0.2, 0.2]"
    own = [f"cables.{name}.damping={{model: kelvin_voigt, time: 2 ms}}" for name in ("px", "nx")]
    sets, columns = (*wind, "cable.damping.time=0", *own), ("box.rms_x", "box.rms_y", "box.rms_z")
    (found, status), (whole, _) = (row(scene_of(SCENE, *some), *columns) for some in (sets, wind))
    assert found == {"box.rms_x": pytest.approx(whole["box.rms_x"], rel=1e-4), "box.rms_y": None, "box.rms_z": None}
    assert status.startswith("undamped: mode ")


def test_a_load_case_without_an_answer_has_a_row_that_says_why(scene):
    written(SCENE + GENTLE + "cases: {calm: {}, lost: {lost: [px]}, pushed: {forces: {box: [1.2 kN, 0, 0]}}}\n")
    sets = "--set", "cable.breaking_force=1.5 kN"
    done = run("windrms", scene, *sets, "--case", "all", "--table", "motion", "--format", "csv", code=3)
    rows = rows_of(done.out, "csv")
    reason = "the loop needs the winch of px, which is lost in the load case lost"
    assert [(row["case"], row["name"]) for row in rows] == [
        ("calm", "box"), ("calm", "box.eye"), ("lost", None), ("pushed", "box"), ("pushed", "box.eye")]  # fmt: skip
    assert {name for name, cell in rows[2].items() if cell is not None} == {"case", "status"}
    assert [row["status"] for row in rows] == ["ok", "ok", reason, *["over strength: nx"] * 2]
    assert f"{scene}: case lost: {reason}" in done.err
    alone = table_of("windrms", scene, *sets, "--case", "calm", "--table", "motion")
    assert [{**row, "case": "calm", "status": "ok"} for row in alone] == rows[:2]
    none = table_of("windrms", scene, "--set", "cases={lost: {lost: [px]}}", "--case", "all", code=3)
    chosen = "--table", "motion", "--columns", "rms_x"
    again = table_of("windrms", scene, "--set", "cases={lost: {lost: [px]}}", "--case", "all", *chosen, code=3)
    assert none == again == [{"case": "lost", "status": reason}]


@pytest.mark.parametrize(
    ("text", "words", "options"),
    [
        (SCENE.replace("wind: {speed", "winds: {speed"), "winds", ()),
        (SCENE.split("wind: {speed")[0], "wind: missing key: 'cablestudy windrms' needs it", ()),
        (SCENE, "--table actuators: the scene has no actuators", ("--table", "actuators")),
        (SCENE, "--table loop: the scene has no control", ("--table", "loop")),
        (SCENE + WINCHES, "--format csv: one table at a time", ("--format", "csv")),
        (SCENE + WINCHES, "--on", ("--on", "both")),
        (SCENE + WINCHES.replace("[x, y, z]", "[x, z, yaw]"), "no winch moves yaw of box", ()),
    ],
)  # fmt: skip
def test_what_is_refused(text, words, options):
    result = run("windrms", written(text), *options, code=None)
    assert result.code in (2, 3)
    assert words in result.err
    assert len(result.err.strip().splitlines()) == 1


def test_limits_and_strengths_that_are_passed_are_told_and_are_the_status_of_a_row():
    """Wires of 10 mm^2 under 1 kN: 100 MPa. How large a stroke may be: `test_suspension_wind`."""
    strong = SCENE.replace("preload: 1 kN", "preload: 1 kN, strength: 99 MPa")
    scene = written(strong + GENTLE + f"actuators: {{{MASS_X}}}\n")
    result = run("windrms", scene, "--table", "actuators")
    assert "warning: mass_x: its stroke reaches" in result.err
    assert "above its limit of 0.001" in result.err
    assert "warning: the stress is above the strength: px (utilisation 1.01), nx (utilisation 1.01)" in result.err
    study = study_file(".", "columns: [mass_x.peak_stroke]\n", scene)
    (row,) = table_of("sweep", study, "--no-write", code=3)
    assert row["mass_x.peak_stroke_mm"] > 0.001
    reason, _, last = row["status"].rpartition("; ")
    assert reason.startswith("mass_x: its stroke reaches")
    assert last == "over strength: px, nx, py, ny, pz, nz"


def test_cable_that_would_go_slack_is_told():
    result = run("windrms", written(SCENE), "--set", "cable.preload=20 N", "--table", "cables")
    assert "warning: a cable goes slack in the wind: " in result.err
    assert result.err.splitlines()[0].endswith(": the linear numbers do not hold")


def test_limits_that_cannot_be_known_fail_their_own_row(monkeypatch):
    text = SCENE + GENTLE + f"actuators: {{{MASS_X}}}\n"
    scenes = [scene_of(text), scene_of(text, "wind.speed=5 m/s")]
    limits = rows.exceeded_limits

    def once(case):
        if case.scene is scenes[0]:
            raise ConvergenceError("no spectrum of the stroke")
        return limits(case)

    monkeypatch.setattr(rows, "exceeded_limits", once)
    one, other = rows.evaluate_suspensions(scenes, [find("mass_x.peak_stroke")])
    assert one.cells["status"] == "no spectrum of the stroke"
    assert "no spectrum" not in other.cells["status"]


def test_columns_that_a_scene_cannot_have():
    for column, words in (
        ("box.exposure", "needs the key exposure"),
        ("gain_margin", "needs the key control"),
        ("box.rms_speed", "did you mean"),
        ("box.ear.rms", "no column"),
    ):
        study = study_file(".", f"columns: [{column}]\nvary: [{{wind.speed: [8 m/s]}}]\n", written(SCENE))
        done = run("sweep", study, code=2)
        assert len(done.lines) == 1
        assert words in done.err


def test_stated_errors_of_bars_in_the_wind():
    """Wires with a mass of their own, two bars each, against the same to five digits."""
    path = written(without("[np]z").replace("density: 1e-3", "density: 1400") + "model: {elements: 2}\n")
    motion = ("windrms", path, "--table", "motion")
    done = run(*motion, "--format", "json", "--explain")
    found = json.loads(done.out)
    (fine, *_) = table_of(*motion, "--set", "model={accuracy: 1e-5}")
    row, stated = found["rows"][0], found["errors"][0]
    for name in ("rms_x_mm", "rms_mm", "rms_velocity_mm_per_s", "peak_mm"):
        true = abs(row[name] / fine[name] - 1)
        assert true > 1e-4
        assert true / 1.2 < stated[name] < 1.2 * true
    said = r"motion: estimated error \d.\de-0\d, of box.*_mm.*, against a model to an accuracy of 1e-06"
    assert re.search(said, done.err)
    said = "motion: the error of box.mean_x_mm, .* is not known: modal damping grows"
    assert re.search(said, run(*motion, "--explain", "--set", "cable.damping={model: modal, ratio: 0.01}").err)
    study = study_file(".", "columns: [box.rms, error_estimate]\n", path)
    (row,) = table_of("sweep", study, "--no-write")
    assert row["error_estimate"] == pytest.approx(stated["rms_mm"], rel=1e-6)


def test_with_modal_damping_the_rms_has_no_error_that_could_be_stated():
    """It falls with each mode that is added: by 2 % from 64 to 160 modes of the six cables."""
    sets = ("bodies.gondola.wind={area: 0.6 m^2, drag_coefficient: 1.2}",
            "wind={speed: 6 m/s, turbulence_intensity: 0.15, length_scale: 25 m}")  # fmt: skip
    in_wind = case_at("carlina-net", *sets).analysis
    few, many = (variances_of(in_wind, count) for count in (64, 160))
    rows = [few.rows[f"gondola.{axis}"] for axis in "xyz"]
    sizes = [math.sqrt(one.weighted["value"][rows].sum()) for one in (few, many)]
    assert sizes[1] < 0.985 * sizes[0]
    assert math.isnan(in_wind.rms(["gondola.x"], "value", False)[1])
    done = run("windrms", SUSPENSIONS / "carlina-net.yaml", *with_sets(*sets), "--format", "json")
    found = json.loads(done.out)["motion"]
    assert "rms_x_mm" in found["rows"][0]
    assert "rms_x_mm" not in found["errors"][0]
    assert "note: the error of the RMS is not known: modal damping grows with the number of modes" in done.err


def test_explain_says_what_was_modelled(scene):
    notes = run("windrms", scene, "--explain").err
    assert "coupled modes up to" in notes
    assert "wind on bodies: about the equilibrium in the mean wind, with aerodynamic damping" in notes
    assert "loop of 6 cables for x, y, z" in notes


def test_errors_above_the_accuracy_are_told_once(monkeypatch):
    """A body of a gram on heavy cables moves as they do: each of their modes counts, of which 100 are tried at most."""
    monkeypatch.setattr(type(MOTION), "model_modes", (64,))
    monkeypatch.setattr(type(MOTION), "more_modes", (100,))
    text = without("[np][yz]").replace(f"mass: {MASS}", "mass: 1 g").replace("[4, 4, 4]", "[1e-6, 1e-6, 1e-6]")
    text = text.replace("density: 1e-3", "density: 8000").replace("on: bodies", "on: both")
    written(text.replace("gravity: 0", "gravity: 9.81"), "gram.yaml")
    done = run("windrms", "gram.yaml", "--table", "motion", "--format", "json")
    errors, (note,) = json.loads(done.out)["errors"], done.lines
    above = {name: [row[name] for row in errors if row[name] > 1e-4] for name in errors[0]}
    expected = [
        f"{name} (up to {max(above[name]):.1e}, {len(above[name])} row{'s' * (len(above[name]) > 1)})"
        for name in sorted(above, key=lambda name: -max(above[name], default=0.0)) if above[name]
    ]  # fmt: skip
    assert expected
    said = ", ".join(expected[:6]) + (f" and {len(expected) - 6} more" if expected[6:] else "")
    assert note == f"note: estimated errors above model.accuracy, 0.0001: {said}"
    assert run("windrms", "gram.yaml", "--set", "model.accuracy=0.1").err == ""


def test_a_sweep_tells_errors_above_the_accuracy_of_each_row():
    """Tensions of heavy wires have larger errors than the motion; each row is held against its own accuracy."""
    text = "columns: [nx.rms_tension, nx.slack_probability, box.rms]\nvary: [{model.accuracy: [1e-2, 1e-5, 1e-6]}]\n"
    study = study_file(".", text, written(without("[pn][yz]").replace("density: 1e-3", "density: 3e4")))
    done = run("sweep", study, "--no-write", "--format", "json")
    found = json.loads(done.out)
    errors = [row["nx.rms_tension_N"] for row in found["errors"]]
    assert errors[0] < 1e-2
    assert min(errors[1:]) > 1e-5
    assert [row["status"] for row in found["rows"]] == ["ok"] * 3
    assert all(row["nx.slack_probability"] < 1e-9 for row in found["rows"])  # of which no note tells the error
    said = f"nx.rms_tension_N (up to {max(errors[1:]):.1e}, 2 rows)"
    assert done.lines == [f"note: estimated errors above model.accuracy, 1e-06 to 1e-05: {said}"]
    one = run("sweep", study, "--no-write", "--row", "2")
    assert one.lines == [
        f"note: estimated errors above model.accuracy, 1e-05: nx.rms_tension_N (up to {errors[1]:.1e}, 1 row)"
    ]


def test_a_coherence_that_hardly_decays_is_refused():
    slow = ("--set", "wind.coherence_decay=5e-324")
    done = run("windrms", SUSPENSIONS / "carlina-net-wind.yaml", *slow, code=2)
    assert done.lines == ["--set wind.coherence_decay: must be 0, or from 1e-30 to 1e+06, got 5e-324"]


LINK = "links: {damper: {from: box.nz, to: [0, 0, -9], stiffness: 1 kN/m, damping: 10 N s/m}}\n"


def test_columns_of_every_table_are_known_before_anything_is_computed(monkeypatch):
    scene = cs.load(written(SCENE + GENTLE + f"actuators: {{{MASS_X}}}\n" + LINK))
    tables = {command: scene.compute(command).tables for command in ("windrms", "loop")}
    assert [len(of_command) for of_command in tables.values()] == [8, 2]
    for command, of_command in tables.items():
        for name, table in of_command.items():
            assert scene.table_without_rows(command, name).fields == table.fields
    monkeypatch.setattr(SuspensionCase, "group", None)
    chosen = "--set", "cases={calm: {}, storm: {}}", "--table", "links", "--columns", "case,status,rms"
    told = [run("windrms", scene.path, *case, *chosen, code=2).lines for case in ((), ("--case", "all"))]
    assert [len(lines) for lines in told] == [3, 1]  # the table of all cases has their names, and perhaps a status
    assert [lines[-1] for lines in told] == [
        f"--columns: the table has no column 'rms' (it has {names})"
        for names in ("name, rms_force", "case, name, rms_force, status")
    ]


@pytest.mark.parametrize("error", [1e-6, 0.1, 0.9, 1.0, 2.0])
def test_the_error_of_an_rms_covers_the_roots_of_all_variances(error):
    """A variance of 1, right to `error`: its root lies between those of 1 - error, at least 0, and of 1 + error."""
    bound = error_of_root(error)
    assert 1 - bound <= math.sqrt(max(1 - error, 0)) + 1e-15
    assert 1 + bound >= math.sqrt(1 + error)
    assert bound <= 0.5 * error * (1 + error)


SWING = """\
cable: {elastic_modulus: 100 GPa, density: 7850 kg/m^3, diameter: 0.87 mm, damping: {model: kelvin_voigt, time: 1 ms}}
points: {n0: [0, 47, 140], s0: [0, -47, 140]}
bodies:
  b:
    at: [0, 0, 0]
    mass: 2.9
    inertia: [0.0013, 0.0013, 0.0013]
    wind: {area: 0.01, drag_coefficient: 1.1}
    attachments: {n: [0, 0.01, 0.01], s: [0, -0.01, 0.01]}
cables:
  cn: {from: n0, to: b.n, unstretched_length: 147.7}
  cs: {from: s0, to: b.s, unstretched_length: 147.7}
wind: {speed: 17, turbulence_intensity: [0.15, 0, 0.08], length_scale: 25, on: bodies}
"""


TENSIONS = "cn.rms_tension", "cs.rms_tension"


def test_motion_out_of_a_plane_of_symmetry_is_zero():
    """A body in the plane of symmetry of two long cables, in gusts along that plane.

    Waves along the cables come in pairs, symmetric and antisymmetric, whose frequencies agree within their errors.
    """
    found = numbers(scene_of(SWING), *(f"b.rms_{axis}" for axis in ("x", "y", "z", "rx", "ry", "rz")), *TENSIONS)
    assert [found[name] for name in ("b.rms_y", "b.rms_rx", "b.rms_rz")] == [0, 0, 0]
    assert min(found["b.rms_x"], found["b.rms_z"], found["b.rms_ry"]) > 100
    # waves of frequencies that differ by 1.2e-7 are mixed by 2e-9 by rounding, otherwise on each processor
    assert found[TENSIONS[0]] == pytest.approx(found[TENSIONS[1]], rel=1e-8)
