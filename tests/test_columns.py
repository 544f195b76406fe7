"""Each column against a formula or a reference of its own, and the error that a row states against the true one."""

import math

import numpy as np
import pytest
import twins
from command import CARLINA, CONFIGS, SLACK, run, study_file, table_of, with_sets
from references import bars, catenary_mp, taut_string
from scenes import AREA, CHORD, DENSITY, GONDOLA, INCLINED, LENGTH, MODULUS, PAPER, SAGGING, G, Twin, cells, scene
from scipy.linalg import eigh
from scipy.optimize import brentq
from solved import contents, solve

from cablestudy.scene.scene import load_scene
from cablestudy.study import study_rows
from cablestudy.study.cable_columns import COLUMNS, FAMILIES
from cablestudy.study.columns import find
from cablestudy.study.one_cable.rows import evaluate
from cablestudy.study.scene_kind import why_not

# INTERFACE.md, section Columns, without the wind columns of the next issue
NAMES = [
    "preload_N", "horizontal_tension_N", "max_tension_N", "min_tension_N", "unstretched_length_m",
    "stretched_length_m", "chord_m", "sag_m", "sag_ratio", "mass_kg", "diameter_mm", "area_mm2",
    "elastic_modulus_GPa", "density_kg_per_m3", "strain", "stress_MPa", "utilisation", "lambda_squared",
    "end_stiffness_N_per_m", "end_stiffness_zz_N_per_m", "end_stiffness_yy_N_per_m", "cable_frequency_Hz",
    "inplane_frequency_3_Hz", "outofplane_frequency_2_Hz", "symmetric_frequency_2_Hz", "axial_frequency_1_Hz",
    "gondola_frequency_Hz", "gondola_frequency_static_Hz", "status", "iterations", "dof", "solve_time_ms",
    "error_estimate",
]  # fmt: skip
STATICS = [
    column.name
    for column in COLUMNS
    if column.needs in ("scene", "statics") and not column.key.startswith(("cable.loads", "wind", "ground", "gondola"))
]


@pytest.mark.parametrize("name", NAMES)
def test_every_column_of_the_interface_exists_with_and_without_its_unit(name):
    column = find(name)
    assert column.header == name
    assert find(column.name).header == name
    assert column.meaning


def test_the_table_of_columns_lists_them_all():
    rows = table_of("columns")
    assert [row["column"] for row in rows if row["of"] == "cable"] == [c.header for c in COLUMNS + FAMILIES]
    assert len({(row["of"], row["column"]) for row in rows}) == len(rows)
    assert all(row["meaning"] and row["needs"] for row in rows)


def test_every_column_listed_for_suspensions_is_one():
    listed = [row["column"] for row in table_of("columns") if row["of"] == "suspension"]
    wheel = "{rate_gain: 1, axis: [0, 0, 1], inertia: 1e-3 kg m^2, momentum: 1 N m s, torque: 1 N m}"
    mass = "{axis: [1, 0, 0], mass: 1 kg, frequency: 1 Hz, stroke: 1 m, force: 1 N}"
    sets = (
        f"actuators={{m: {mass}, w: {wheel}}}", "exposure=1 ms", "ground=-100", "limits={a: x <= 1}", "case=push",
        "correction={marker: gondola.focus, bandwidth: 10 Hz}", "cables.u1.loads=[{fraction: 0.5, mass: 1 kg}]",
        "links={s: {from: [0, 0, -99], to: gondola.u1, stiffness: 1 N/m}}",
        "cases={push: {forces: {gondola: [1, 0, 0]}}}",
    )  # fmt: skip
    _, scene = load_scene(CONFIGS / "suspensions" / "carlina-net-wind.yaml", sets)
    words = {"BODY": "gondola", "POINT": "gondola", "CABLE": "u1", "_K_": "_1_", "MARKER": "focus", "LINK": "s"}
    for name in listed:
        for word, value in words.items():
            name = name.replace(word, value)
        of_wheel = "momentum" in name or "torque" in name
        name = name.replace("ACTUATOR", "w" if of_wheel else "m")
        assert why_not(scene, find(name)) == "", name
    # the names that docs/suspensions.md promises
    expected = {
        "BODY.x_m", "BODY.roll_deg", "CABLE.max_tension_N", "BODY.stiffness_xx_N_per_m", "frequency_K_Hz",
        "BODY.stiffness_rxrx_Nm_per_rad", "BODY.frequency_K_Hz", "BODY.frequency_static_K_Hz", "min_tension_N",
        "max_tension_N", "max_utilisation", "cable_mass_kg", "CABLE.tension_from_N", "POINT.z_m",
    }  # fmt: skip
    assert expected <= set(listed)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("prelaod", "did you mean preload?"),
        ("axial_frequency_0", "K is a whole number from 1 to 1000"),
        ("axial_frequency_K", "K is a whole number from 1 to 1000"),
        ("axial_frequency_1001_Hz", "K is a whole number from 1 to 1000"),
        ("axial_freqency_2", "did you mean axial_frequency_K?"),
        ("xyz", "'cablestudy columns' lists them"),
    ],
)
def test_an_unknown_column_gives_a_hint(name, hint):
    with pytest.raises(ValueError, match=name) as caught:
        find(name)
    assert hint in str(caught.value)


of_bars = pytest.mark.parametrize("twin", [PAPER, INCLINED, SAGGING], ids=["taut", "inclined", "sagging"])


@of_bars
def test_statics_of_bars(twin):
    found, chain = cells(twin.scene(), *STATICS), twin.chain()
    tensions, vectors = chain.tensions, chain.vectors
    lengths = np.linalg.norm(vectors, axis=1)
    weight = twin.mass * G
    # each bar's tension vector, with half of its weight more or less at its ends
    middle = (tensions / lengths)[:, None] * vectors
    half = np.array([0, 0, weight * twin.length / len(tensions) / 2])
    edges = np.linalg.norm([middle - half, middle + half], axis=-1)
    turns = np.abs(middle[:, 2]) < half[2]  # bars with the lowest point inside
    least = np.where(turns, np.hypot(middle[:, 0], middle[:, 1]), edges.min(axis=0)).min()
    mean, most = tensions.mean(), edges.max()
    # each bar's level part is the same; the chord is cut at half the span by the bar that crosses it
    x, z = chain.nodes[:, 0], chain.nodes[:, 2]
    sag = twin.b / 2 - np.interp(twin.a / 2, x, z)
    pulls = middle[0] - half, -(middle[-1] + half)  # of the cable on what holds its ends
    ends = {"swing": 0.0, "lowest_point": z.min()}
    ends["inclination_from_plumb"] = math.degrees(math.atan2(twin.a, abs(twin.b)))
    for end, pull in enumerate(pulls, start=1):
        ends[f"tension_{end}"] = np.linalg.norm(pull)
        ends[f"reaction_{end}_horizontal"], ends[f"reaction_{end}_vertical"] = abs(pull[0]), -pull[2]
        ends[f"angle_{end}"] = math.degrees(math.atan2(-pull[2], abs(pull[0])))
    expected = ends | {
        "preload": mean,
        "horizontal_tension": (tensions * vectors[:, 0] / lengths).mean(),
        "catenary_constant": (tensions * vectors[:, 0] / lengths).mean() / weight,
        "max_tension": most,
        "min_tension": least,
        "unstretched_length": twin.length,
        "stretched_length": lengths.sum(),
        "chord": twin.chord,
        "sag": sag,
        "sag_ratio": sag / twin.chord,
        "mass": twin.mass * twin.length,
        "diameter": 1e3 * 2 * math.sqrt(twin.area / math.pi),
        "area": 1e6 * twin.area,
        "elastic_modulus": 70.3,
        "density": 1440,
        "axial_stiffness": twin.stiffness,
        "mass_per_length": twin.mass,
        "breaking_force": 3000e6 * twin.area,
        "strain": mean / twin.stiffness,
        "stress": most / twin.area / 1e6,
        "utilisation": most / twin.area / 3000e6,
        "lambda_squared": taut_string.irvine_parameter(
            weight, twin.chord, twin.stiffness, mean, math.atan2(twin.b, twin.a)
        ),
    }
    for name, value in expected.items():
        # the polygon is cut where the smooth cable has its middle: for an inclined one a little beside
        tolerance = 1e-5 if name in ("sag", "sag_ratio") and twin.b else 1e-9
        assert found[name] == pytest.approx(value, rel=tolerance, abs=1e-9), name
    assert set(expected) | {"iterations"} == set(STATICS)
    assert 1 <= found["iterations"] <= 15


def test_columns_that_a_slack_cable_without_weight_leaves_open():
    """Pulled along by 3 kN, the first half carries it all, and the second may lie anywhere between load and end 2.

    So nothing says where its middle is, its lowest point, or how it leaves its ends; forces and lengths are known.
    """
    load = "cable.loads=[{at: 92 m, force: [3000, 0, 0]}]"
    pulled = scene("gravity=0", "model={accuracy: 1e-6}", load, "ground=-9 m")
    columns = [column for column in COLUMNS if column.needs == "statics" and not why_not(pulled, column)]
    row = evaluate(pulled, columns)
    refused = {column.name for column in columns if row.cells[column.header] is None}
    assert refused == {"sag", "sag_ratio", "swing", "lowest_point", "angle_1", "angle_2", "clearance"}
    assert "no definite form" in row.cells["status"]


@of_bars
def test_stiffness_and_modes_of_bars(twin):
    chain = twin.chain()
    stiffness = chain.end_stiffness
    modes = bars.modes(chain, *twin.bar)
    # the chain is plane: a mode moves out of its plane, or in it
    shapes = modes.vectors.reshape(-1, 3, len(modes.frequencies))
    out = np.abs(shapes[:, 1]).max(axis=0) > 1e-6 * np.abs(shapes).max(axis=(0, 1))
    found = cells(
        twin.scene(), "end_stiffness", "end_stiffness_yy", "end_stiffness_zz", "cable_frequency",
        "outofplane_frequency_5", "gondola_frequency_static", "inplane_frequency_1", "axial_frequency_1", "dof",
    )  # fmt: skip
    for place, name in enumerate(("end_stiffness", "end_stiffness_yy", "end_stiffness_zz")):
        assert found[name] == pytest.approx(stiffness[place, place], rel=1e-8)
    assert found["cable_frequency"] == found["inplane_frequency_1"]
    assert found["cable_frequency"] == pytest.approx(modes.frequencies[~out][0], rel=1e-9)
    assert found["outofplane_frequency_5"] == pytest.approx(modes.frequencies[out][4], rel=1e-9)
    assert found["axial_frequency_1"] == pytest.approx(modes.frequencies[modes.axial > 0.8][0], rel=1e-9)
    held = math.sqrt(stiffness[0, 0] / GONDOLA) / 2 / math.pi
    assert found["gondola_frequency_static"] == pytest.approx(held, rel=1e-8)
    assert found["dof"] == 3 * 39


def test_the_taut_cable_follows_the_textbook():
    found = cells(scene(), "sag", "preload", "symmetric_frequency_1", "outofplane_frequency_1", "axial_frequency_1")
    weight = DENSITY * AREA * G
    # parabola with weight per deformed length: corrections of order (sag/chord)^2 = 4e-7
    assert found["sag"] == pytest.approx(weight * (LENGTH / CHORD) * CHORD**2 / (8 * found["preload"]), rel=5e-6)
    mass = DENSITY * AREA * LENGTH / CHORD
    string = taut_string.string_frequencies(1, CHORD, found["preload"], mass)[0]
    # 40 bars with lumped mass: sin(x)/x of x = pi/80 below the string, 2.6e-4
    assert found["outofplane_frequency_1"] == pytest.approx(string * math.sin(math.pi / 80) / (math.pi / 80), rel=1e-6)
    axial = taut_string.axial_frequencies(1, LENGTH, MODULUS * AREA, DENSITY * AREA)[0]
    assert found["axial_frequency_1"] == pytest.approx(axial * math.sin(math.pi / 80) / (math.pi / 80), rel=1e-4)


# taut to slack, flat to steep, with and without loads
ZOO = {
    "paper": PAPER,
    "inclined": INCLINED,
    "downhill": Twin(175.68, -60.49, LENGTH),
    "sagging": SAGGING,
    "sagging uphill": Twin(175.68, 60.49, 186.2, 24.2e-6),
    "steep": Twin(30.0, 183.0, 186.0, 24.2e-6),
    "almost vertical": Twin(1.0, 185.0, 184.0),
    "ultra-taut": Twin(CHORD, 0.0, 180.5),
    "barely taut": Twin(CHORD, 0.0, 185.75),
    "slack": Twin(CHORD, 0.0, 190.0, 24.2e-6),
    "very slack": Twin(CHORD, 20.0, 240.0, 24.2e-6),
    "load": Twin(CHORD, 0.0, LENGTH, loads=((138.366225, (0.0, 0.0, -1.0)),)),
    "heavy load": Twin(CHORD, 0.0, LENGTH, loads=((LENGTH / 4, (0.0, 0.0, -200.0)),)),
    "two loads": Twin(CHORD, 30.0, 188.3, 24.2e-6, loads=((37.66, (0.0, 0.0, -50.0)), (141.225, (20.0, 0.0, -100.0)))),
    "lifted": Twin(CHORD, 0.0, 186.0, 24.2e-6, loads=((93.0, (0.0, 0.0, 20.0)),)),
}
ESTIMATED = ("inplane_frequency_1", "inplane_frequency_2", "inplane_frequency_3", "outofplane_frequency_3",
             "gondola_frequency")  # fmt: skip


def true_error(twin, found):
    """Largest relative error of the estimated columns of a cable alone against the continuous cable."""
    exact = dict(zip(ESTIMATED, [*twin.frequencies(3), twin.frequencies(3, "out")[2]], strict=False))
    return max(abs(found[name] / value - 1) for name, value in exact.items())


def gondola_error(twin, frequency):
    """Relative error of a coupled frequency: distance to the nearest root of k_xx(w) = M w^2."""

    def balance(value):
        return twin.dynamic_stiffness(value) - GONDOLA * (2 * math.pi * value) ** 2

    for width in (1e-10, 1e-8, 1e-6, 1e-4, 1e-3, 1e-2):
        low, high = frequency * (1 - width), frequency * (1 + width)
        if balance(low) * balance(high) < 0:
            return abs(frequency / brentq(balance, low, high, xtol=1e-13 * frequency) - 1)
    return math.inf


@pytest.mark.crossed
@pytest.mark.parametrize("name", ZOO)
@pytest.mark.parametrize("accuracy", [1e-4, 1e-7])
def test_the_stated_accuracy_is_kept(name, accuracy):
    twin = ZOO[name]
    found = cells(twin.scene(f"model.accuracy={accuracy}"), *ESTIMATED, "error_estimate")
    assert true_error(twin, found) <= accuracy
    assert gondola_error(twin, found["gondola_frequency"]) <= accuracy
    assert found["error_estimate"] <= accuracy


@pytest.mark.parametrize("name", ["paper", "inclined", "sagging", "steep", "slack", "very slack"])
def test_the_error_of_a_fixed_model_is_known(name):
    twin = ZOO[name]
    found = cells(twin.scene(), *ESTIMATED[:4], "error_estimate")
    assert 0.5 <= found["error_estimate"] / true_error(twin, found) <= 2


@pytest.mark.parametrize("name", ["paper", "inclined", "sagging", "steep", "very slack"])
def test_the_coupled_frequency_is_that_of_the_whole_eigenproblem(name):
    """By dense matrices of the bars with the gondola's mass on end 2, free along x."""
    twin, x = ZOO[name], 3 * 40
    K, M = bars.matrices(twin.chain(), *twin.bar)
    M[x] += GONDOLA
    free = np.r_[3 : x + 1]
    values, shapes = eigh(K[np.ix_(free, free)], np.diag(M[free]))
    coupled = math.sqrt(values[np.argmax(shapes[-1] ** 2 / values)]) / (2 * math.pi)
    assert cells(twin.scene(), "gondola_frequency")["gondola_frequency"] == pytest.approx(coupled, rel=1e-9)


def test_a_study_of_one_scene_agrees_with_static():
    study = f"base: {CARLINA}\ncolumns: [sag, preload, end_stiffness]\n"
    (row,) = table_of("sweep", "-", "--no-write", stdin=study)
    assert row.items() <= table_of("static", CARLINA)[0].items()


def test_the_meaning_says_why_more_wind_can_move_a_gondola_less():
    for name in ("gondola_rms_all_wind", "gondola_rms_open_loop_all_wind"):
        assert "damps the cable too, so that it can be less" in find(name).meaning


# ------------------------------------------------------------ columns of suspensions in scenes of one cable

# test_twins.py holds their numbers against suspensions
MOVING = contents(CONFIGS / "carlina.yaml", "cable.damping={loss_factor: 0.02, viscous: 0.01}", "model.accuracy=1e-4")
TABLES = (twins.STATICS, twins.STIFFNESS, twins.LINEAR, twins.SECTION, twins.STRENGTH, twins.COUPLED, twins.OPEN_WIND,
          twins.WIND, twins.PEAK)  # fmt: skip
TWO_NAMES = {
    "gondola in the wind": (MOVING, {own: other for table in TABLES for own, other in table.items()}),
    "bare cable in the wind": (twins.without(MOVING, "gondola", "winch"), twins.BARE_CABLE),
    "load": (contents(CONFIGS / "point-load.yaml"), twins.LOADED),
    "ground": (contents(CONFIGS / "line.yaml"), twins.GROUND),
    "vortices": (contents(CONFIGS / "carlina.yaml"), twins.VORTICES),
}


@pytest.mark.parametrize("what", TWO_NAMES)
def test_both_names_have_one_number(what):
    scene, names = TWO_NAMES[what]
    found = solve(scene, *names, *names.values())
    assert found.status == "ok"
    for own, other in names.items():
        assert found.values[own] is not None, own
        assert (found.values[own], found.errors.get(own)) == (found.values[other], found.errors.get(other)), own


def test_rows_do_not_depend_on_their_neighbours():
    columns = [find(name) for name in ("frequency_3", "cable.least_tension", "gondola.rms", "cable.sag")]
    scenes = [scene(f"cable.diameter={d} mm") for d in (2, 3, 4)]
    for one, row in zip(scenes, study_rows.evaluate(scenes, columns), strict=True):
        assert study_rows.evaluate([one], columns)[0].cells == row.cells


def test_the_tension_at_a_gondola_is_that_of_its_stiffness_where_all_is_slow():
    """A gondola so heavy that waves along the cable are fast: tension at end 2 over displacement is its stiffness."""
    heavy = twins.without(MOVING, "winch") | {"gondola": MOVING["gondola"] | {"mass": 1e6}}
    found = solve(heavy, "cable.rms_tension", "gondola.rms_x", "end_stiffness").values
    expected = found["end_stiffness"] * found["gondola.rms_x"] / 1e3
    assert found["cable.rms_tension"] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("gondola.rms_x", "gondola.rms_x needs the key wind, which the scene does not have"),
        ("cable.least_tension", "cable.least_tension needs the key wind, which the scene does not have"),
        ("knot.x", "no body, free point, cable or link knot (allowed: gondola, cable)"),
        ("gondola.end_stiffness_along", "gondola has no column end_stiffness_along"),
        ("cable.frequency_2", "cable has no column frequency_2"),
    ],
)
def test_what_a_scene_cannot_have(name, reason):
    assert why_not(scene("wind=null"), find(name)).startswith(reason)


def test_a_winch_that_is_too_slow_refuses_tensions_too():
    slow = MOVING | {"winch": MOVING["winch"] | {"max_speed": 1e-9}}
    found = solve(slow, "cable.rms_tension", "gondola.rms_x_open_loop")
    assert found.values["cable.rms_tension"] is None
    assert "max_speed" in found.status
    assert np.isfinite(found.values["gondola.rms_x_open_loop"])


def test_a_table_has_the_names_that_were_asked_for(folder):
    text = "vary: [{cable.diameter: [3 mm, 4 mm]}]\ncolumns: [sag, cable.sag, gondola.x, frequency_2]\n"
    rows = table_of("sweep", study_file(folder, text), "--no-write")
    assert list(rows[0])[1:] == ["sag_m", "cable.sag_m", "gondola.x_m", "frequency_2_Hz", "status"]
    assert all(row["sag_m"] == row["cable.sag_m"] for row in rows)


# ---------------------------------------------------------------------------- tables of commands that look at one scene


def test_static_shows_every_column_that_the_scene_has_a_value_for():
    every = {c.header for c in COLUMNS if c.needs in ("scene", "statics", "stiffness")}
    every -= {"clearance_m", "force_displacement_mm"}  # neither has a ground, or a load case with a force
    loads = {c.header for c in COLUMNS if c.key.startswith("cable.loads")}
    assert set(table_of("static", CONFIGS / "point-load.yaml")[0]) == every | {"status"}
    assert set(table_of("static", CARLINA)[0]) == every - loads | {"status"}
    bare = table_of("static", CARLINA, "--set", "gondola=null", "--set", "cable.strength=null")[0]
    of_gondola = {"gondola_frequency_static_Hz", "mean_displacement_mm", "linear_range_mm"}
    assert set(table_of("static", CARLINA)[0]) - set(bare) == {"breaking_force_N", "utilisation", *of_gondola}


@of_bars
def test_the_shape_of_bars_is_that_of_the_reference(twin):
    ends = f"cable.ends=[[0, 0, 0], [{twin.a}, 0, {twin.b}]]"
    sets = with_sets(ends, f"cable.unstretched_length={twin.length}", f"cable.area={twin.area}")
    rows = table_of("static", CARLINA, "--shape", *sets)
    assert [row["s_m"] for row in rows] == pytest.approx(np.arange(41) * twin.length / 40, rel=1e-12)
    found = np.array([[row["x_m"], row["y_m"], row["z_m"]] for row in rows])
    assert found == pytest.approx(twin.chain().nodes, rel=0, abs=1e-10 * twin.chord)


def test_the_shape_in_closed_form_is_that_of_50_digits():
    rows = table_of("static", SLACK, "--shape")
    EA, weight = SAGGING.stiffness, SAGGING.mass * G
    force = catenary_mp.solve_loaded((SAGGING.a, 0, SAGGING.b), SAGGING.length, EA, weight)
    for row in rows[::8]:
        place = catenary_mp.shape_loaded(force, row["s_m"], SAGGING.length, EA, weight)
        assert [row["x_m"], row["y_m"], row["z_m"]] == pytest.approx([float(p) for p in place], abs=1e-9)
        tension = catenary_mp.tension_vector(force, row["s_m"], SAGGING.length, weight)
        assert row["tension_N"] == pytest.approx(float(sum(t * t for t in tension) ** 0.5), rel=1e-10)


def test_the_shape_of_turned_and_shifted_ends():
    sets = ("--set", "cable.ends=[[1, 2, 3], [1, -183.8, 3]]")
    rows, plain = table_of("static", CARLINA, "--shape", *sets), table_of("static", CARLINA, "--shape")
    for row, other in zip(rows, plain, strict=True):
        assert [row["x_m"], 2 - row["y_m"], row["z_m"] - 3] == pytest.approx([1, other["x_m"], other["z_m"]], abs=1e-9)


def test_a_failed_scene_has_an_empty_row_and_no_shape():
    outcome = run("static", CARLINA, "--set", "cable.preload=1 N", "--format", "csv", code=3)
    assert outcome.out.count("\n") == 2
    assert run("static", CARLINA, "--set", "cable.preload=1 N", "--shape", code=3).out == ""


def test_mode_table():
    rows = table_of("modes", CARLINA, "-n", 6)
    assert list(rows[0]) == ["number", "type", "symmetry", "frequency_Hz", "participation", "lock_in_speed_m_per_s"]
    assert [row["type"] for row in rows].count("out-of-plane") == 3
    assert all(row["participation"] == 0 for row in rows if row["type"] == "out-of-plane")
    assert all(row["participation"] > 0 for row in rows if row["type"] != "out-of-plane")


def test_validate_counts_cases_and_goes_on_after_a_bad_file():
    outcome = run("validate", CONFIGS / "preload.yaml", "absent.yaml", CARLINA, "--format", "csv", code=2)
    header, *lines = outcome.out.splitlines()
    assert header == "file,kind,cases,status"
    ends = ("preload.yaml,study,6,ok", "absent.yaml,,,1 mistake", "carlina.yaml,scene,1,ok")
    assert all(line.endswith(end) for line, end in zip(lines, ends, strict=True))
    assert outcome.lines == ["absent.yaml: no such file"]
