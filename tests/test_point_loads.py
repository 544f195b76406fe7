"""Loads on cables, `static --table loads`, and the path of a load that travels, `static --locus`."""

import math

import pytest
import yaml
from command import CARLINA, CONFIGS, refused_in_one_line, run, table_of
from mpmath import mp
from references import catenary_mp
from scenes import G

from cablestudy.interface import load

ZIPLINE = CONFIGS / "zipline.yaml"
EA, MASS, LENGTH, END = 8e6, 1.1, 208.0, (200.0, 10.0, 15.0)
# in the order of the file, which is not that along the cable: place [m], force [N]
EIGHT = [(190.0, (0, 0, -400)), (20.0, (0, 0, -785)), (40.0, (30, 60, -785)), (60.0, (0, 0, -785)),
         (85.0, (0, 0, -785)), (104.0, (0, 0, 500)), (130.0, (0, 0, -785)), (150.0, (-40, 0, -785))]  # fmt: skip
ROPE = {"cable": {"ends": [[0, 0, 30], [END[0], END[1], 30 + END[2]]], "axial_stiffness": EA, "mass_per_length": MASS,
                  "unstretched_length": LENGTH, "loads": [{"at": at, "force": list(force)} for at, force in EIGHT]},
        "ground": [[-10, 2], [100, 12], [250, 0]]}  # fmt: skip
STRING = {"gravity": 0, "cable": {"ends": [[0, 0, 0], [100, 0, 0]], "axial_stiffness": 1e15, "mass_per_length": 1e-6,
                                  "unstretched_length": 110,
                                  "loads": [{"fraction": 0.5, "force": [0, 0, -1000]}]}}  # fmt: skip


def at_50_digits(loads, numbers, length=LENGTH):
    """Rows of the table of some of the loads, by the reference; each beginning at end 1."""
    force = catenary_mp.solve_loaded(END, length, EA, MASS * LENGTH / length * G, loads)
    weight = MASS * LENGTH / length * G
    for number in numbers:
        at, _ = loads[number]
        own = [sum(force[axis] for place, force in loads if place == at) for axis in range(3)]
        x, y, z = map(float, catenary_mp.shape_loaded(force, at, length, EA, weight, loads))
        after = [float(f) for f in catenary_mp.tension_vector(force, at, length, weight, loads)]
        before = [f + p for f, p in zip(after, own, strict=True)]
        share = (x * END[0] + y * END[1]) / (END[0] ** 2 + END[1] ** 2)
        found = {"x_m": x, "y_m": y, "z_m": z + 30, "sag_m": share * END[2] - z}
        for side, (fx, fy, fz) in enumerate((before, after), 1):
            found[f"slope_{side}_deg"] = math.degrees(math.atan2(fz, math.hypot(fx, fy)))
            found[f"tension_{side}_N"] = math.sqrt(fx**2 + fy**2 + fz**2)
        yield found


def agrees(found, expected, rel=1e-10):
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=rel, abs=rel), name


def test_a_rope_with_eight_loads_is_the_50_digit_catenary():
    table = load(ROPE).loads()
    assert list(table["load"]) == [f"load{k}" for k in range(1, 9)]
    for (_, row), expected in zip(table.iterrows(), at_50_digits(EIGHT, range(8)), strict=True):
        agrees(row, expected)
        ground = 2 + (row["x_m"] + 10) * 10 / 110 if row["x_m"] < 100 else 12 - (row["x_m"] - 100) * 12 / 150
        assert row["clearance_m"] == pytest.approx(row["z_m"] - ground, abs=1e-9)


def test_with_exact_elements_it_is_theirs():
    fine = load({**ROPE, "model": {"elements": 16, "order": 6}}).loads()
    for (_, row), expected in zip(fine.iterrows(), at_50_digits(EIGHT, range(8)), strict=True):
        agrees(row, expected, rel=1e-7)


def test_loads_move_with_the_length_that_a_temperature_gives():
    warm = {**ROPE, "cable": {**ROPE["cable"], "expansion": 2e-5}, "cases": {"hot": {"temperature": 388.15}}}
    table, factor = load(warm, case="hot").loads(), 1.002
    moved = [(at * factor, force) for at, force in EIGHT]
    for (_, row), expected in zip(table.iterrows(), at_50_digits(moved, range(8), LENGTH * factor), strict=True):
        agrees(row, expected)


def test_loads_at_one_place_have_one_row_each_between_the_same_sides():
    twice = {"loads": [{"at": 104.0, "force": [0, 0, -500]}, {"fraction": 0.5, "mass": 50}, {"at": 104.0, "mass": 20}]}
    rows = load({**ROPE, "cable": {**ROPE["cable"], **twice}}).loads().drop(columns="load")
    assert rows.iloc[0].to_list() == rows.iloc[2].to_list()
    assert rows.iloc[0].to_list() == pytest.approx(rows.iloc[1].to_list(), rel=1e-12)
    (expected,) = at_50_digits([(104.0, (0, 0, -500 - 70 * G))], [0])
    agrees(rows.iloc[0], expected)


@pytest.mark.parametrize("count", [4, 9])
def test_a_rider_on_a_string_without_weight_and_stretch_runs_on_an_ellipse(count):
    """Foci at the ends: both pieces are straight, and as long as the rider's place on the string makes them."""
    table = load(STRING).locus(f"load1:{count}")
    assert table["fraction"].to_list() == pytest.approx([k / (count + 1) for k in range(1, count + 1)], rel=1e-14)
    for _, row in table.iterrows():
        first, last = 110 * row["fraction"], 110 * (1 - row["fraction"])
        x = (first**2 - last**2 + 100**2) / 200
        if not 0 < x < 100:
            continue
        z = -math.sqrt(first**2 - x**2)
        slopes = math.atan2(z, x), math.atan2(-z, 100 - x)
        tension = 1000 / math.sin(slopes[1] - slopes[0])  # of the other side over its cosine
        agrees(row, {"x_m": x, "z_m": z, "sag_m": -z, "slope_1_deg": math.degrees(slopes[0]),
                     "slope_2_deg": math.degrees(slopes[1]), "angle_1_deg": -math.degrees(slopes[0]),
                     "max_tension_N": tension * max(map(math.cos, slopes))}, rel=1e-9)  # fmt: skip


def test_a_travelling_load_meets_the_others():
    """In the middle load 5 comes to load 6, at 104 m."""
    scene = {**ROPE, "cable": {**ROPE["cable"], "loads": [{"fraction": at / LENGTH, "force": list(force)}
                                                          for at, force in EIGHT]}}  # fmt: skip
    table = load(scene).locus("load5:25")
    for number in (3, 12, 20):  # 12: at 104 m
        moved = [*EIGHT[:4], (LENGTH * (number + 1) / 26, EIGHT[4][1]), *EIGHT[5:]]
        (expected,) = at_50_digits(moved, [4])
        row = table.iloc[number]
        agrees(row, {name: value for name, value in expected.items() if not name.startswith("tension")})
        force = catenary_mp.solve_loaded(END, LENGTH, EA, MASS * G, moved)
        assert row["angle_1_deg"] == pytest.approx(
            -math.degrees(math.atan2(force[2], math.hypot(*force[:2]))), rel=1e-10
        )


def test_the_length_of_the_reference_state_is_kept():
    """With the load on it in the reference state the length depends on where it is there; then no longer."""
    state = {"cable.reference.loads": True, "cable.loads": [{"fraction": 0.3, "mass": "80 kg"}]}
    scene = load(ZIPLINE, set=state)
    length = scene.static()["unstretched_length_m"]
    pinned = {"cable.preload": None, "cable.unstretched_length": length, "cable.loads.0.fraction": 0.5}
    middle = load(ZIPLINE, set=state | pinned)
    row = scene.locus("load1:9").iloc[4]
    assert row["sag_m"] == pytest.approx(middle.loads()["sag_m"][0], rel=1e-11)
    assert row["max_tension_N"] == pytest.approx(middle.static()["max_tension_N"], rel=1e-11)
    elsewhere = load(ZIPLINE, set=state | {"cable.loads.0.fraction": 0.5}).static()["unstretched_length_m"]
    assert abs(elsewhere - length) > 1e-3


def test_a_rope_cut_at_a_junction_without_mass_carries_loads_as_the_whole_one(tmp_path):
    shared = {"axial_stiffness": EA, "mass_per_length": MASS}
    cut = {
        "cable": shared,
        "points": {"knot": {"at": [130, 6.5, 20], "free": True}},
        "cables": {
            "a": {"from": [0, 0, 30], "to": "knot", "unstretched_length": 130.0, "loads": []},
            "b": {"from": "knot", "to": [END[0], END[1], 30 + END[2]], "unstretched_length": LENGTH - 130},
        },
    }
    for at, force in EIGHT:
        if at < 130:
            cut["cables"]["a"]["loads"].append({"at": at, "force": list(force)})
    cut["cases"] = {
        "more": {"loads": {"b": [{"at": at - 130, "force": list(force)} for at, force in EIGHT if at > 130]}}
    }
    cut["points"]["knot"]["force"] = [0, 0, -785]  # load 7 of EIGHT
    suspension, whole = load(cut, case="more"), load({**ROPE, "ground": None}).loads().set_index("load")
    table, whole = suspension.loads().set_index("load"), whole.drop(columns="sag_m")  # below another chord
    twins = {"a.load1": "load2", "a.load2": "load3", "a.load5": "load6", "b.load1": "load1", "b.load2": "load8"}
    for name, twin in twins.items():
        assert table.drop(columns="sag_m").loc[name].to_list() == pytest.approx(
            whole.loc[twin].to_list(), rel=1e-8, abs=1e-7
        )
    path = suspension.locus("a.load1:12")  # steps of 10 m
    moved = [EIGHT[0], (70.0, EIGHT[1][1]), *EIGHT[2:]]
    (expected,) = at_50_digits(moved, [1])
    agrees(
        path.iloc[6], {name: expected[name] for name in ("x_m", "y_m", "z_m", "slope_1_deg", "slope_2_deg")}, rel=1e-8
    )


def test_where_the_ground_is_not_known_only_the_clearance_is_missing():
    ground = "ground=[[0, 0], [120 m, 0]]"
    done = run("static", ZIPLINE, "--locus", "load1:3", "--set", ground, code=3)
    assert "load1 at 0.75 of the length: no clearance: the ground is not known there" in done.err
    rows = table_of("static", ZIPLINE, "--locus", "load1:3", "--set", ground, code=3)
    assert [row["clearance_m"] is None for row in rows] == [False, False, True]
    assert [row["status"] == "ok" for row in rows] == [True, True, False]
    assert all(row["sag_m"] for row in rows)
    assert table_of("static", ZIPLINE, "--table", "loads", "--set", "ground=[[0,0],[9,0]]", code=3)[0]["x_m"] > 99


def test_each_load_case_has_its_loads(tmp_path):
    cases = "cases={start: {loads: [{fraction: 0.2, mass: 80 kg}]}, none: {}}"
    rows = table_of(
        "static", ZIPLINE, "--set", "cable.loads=[]", "--set", cases, "--table", "loads", "--case", "all", code=3
    )
    assert [(row["case"], row["load"], row["status"]) for row in rows] == [
        ("start", "load1", "ok"), ("none", None, "no cable carries a point load")]  # fmt: skip


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--locus", "load2"], "--locus load2: no such load (did you mean load1?)"),
        (["--locus", "guy.load1"], "no such load"),
        (["--locus", "load1:0"], "expected a whole number from 1 to 1000"),
        (["--locus", "load1:1001"], "expected a whole number from 1 to 1000"),
        (["--locus", "load1:"], "expected a whole number"),
        (["--locus", "load1:²"], "expected a whole number"),
        (["--locus", ""], "--locus is empty"),
        (["--locus", "load1", "--table", "loads"], "--table: no effect"),
        (["--locus", "load1", "--shape"], "--locus: no effect"),
        (["--locus", "load1", "--explain"], "--explain: no effect"),
        (["--locus", "load1", "--case", "all", "--set", "cases={a: {}}"], "--locus: no effect"),
        (["--table", "cables"], "--table: no effect: the scene has one cable"),
        (["--locus", "load1", "--set", "cable.loads=[]"], "cable.loads: missing key: 'cablestudy static --locus'"),
        (["--table", "loads", "--set", "cable.loads=[]"], "cable.loads: missing key"),
    ],
)  # fmt: skip
def test_a_wrong_use_is_one_line(options, words, folder):
    refused_in_one_line(folder, words, "static", ZIPLINE, *options)


def test_the_picture_has_the_path_the_ground_and_the_least_clearance():
    answer = load(ZIPLINE).compute("locus", load="load1:19")
    figure = answer.figure()
    side, below = figure.axes
    least = min(row["clearance_m"] for row in answer.table.rows)
    assert f"clearance {least:.4g} m" in [text.get_text() for text in side.texts]
    path = next(line for line in side.lines if "path of load1" in line.get_label())
    assert path.get_ydata().tolist() == [row["z_m"] for row in answer.table.rows]
    assert max(below.lines[0].get_ydata()) == pytest.approx(21.38, abs=0.02)  # kN, docs/zipline.md


def test_a_load_on_a_vertical_cable_stretches_what_is_above_it():
    """T = T0 + w s, and the load from its place on; 50 m between the ends: Hooke's law along a line."""
    stiffness, length, weight, load_weight = 1e6, 49.9, G, 30 * G
    cable = {"ends": [[0, 0, 0], [0, 0, 50]], "axial_stiffness": stiffness, "mass_per_length": 1,
             "unstretched_length": length, "loads": [{"fraction": 0.5, "mass": 30}]}  # fmt: skip
    for _, row in load({"cable": cable}).locus("load1:3").iterrows():
        place = length * row["fraction"]
        stretch = (50 - length) * stiffness - weight * length**2 / 2 - load_weight * (length - place)
        lowest = stretch / length
        height = place + (lowest * place + weight * place**2 / 2) / stiffness
        sag = place * 50 / length - height
        agrees(row, {"x_m": 0.0, "z_m": height, "slope_1_deg": 90.0, "slope_2_deg": 90.0, "sag_m": sag,
                     "max_tension_N": lowest + weight * length + load_weight})  # fmt: skip


@pytest.mark.parametrize(("run_of_ends", "force"), [(1e-6, 100.0), (0.5, 100.0), (0.5, -100.0), (2.0, 100.0)])
def test_a_sag_of_a_cable_that_is_pushed_beyond_its_ends_is_doubted(run_of_ends, force):
    """A steep cable with a horizontal load at its middle, the place of which is that of the 50-digit catenary."""
    area, length = 2.69e-6, 100.05
    loads = f"cable.loads=[{{fraction: 0.5, force: [{force}, 0, 0]}}]"
    done = run("static", CARLINA, "--set", f"cable.ends=[[0, 0, 0], [{run_of_ends}, 0, 100]]", "--set", loads,
               "--set", f"cable.unstretched_length={length} m", "--set", "model={accuracy: 1e-4}")  # fmt: skip
    with mp.workdps(50):
        cable = mp.mpf(length), mp.mpf("70.3e9") * mp.mpf(area), 1440 * mp.mpf(area) * mp.mpf("9.81")
        at = [(cable[0] / 2, [force, 0, 0])]
        force0 = catenary_mp.solve_loaded((run_of_ends, 0, 100), *cable, at)
        place = float(catenary_mp.shape_loaded(force0, cable[0] / 2, *cable, at)[0])
    reach = max(place - run_of_ends, -place)
    told = [line for line in done.lines if "beyond its ends" in line]
    assert told == [
        f"warning: the cable reaches {reach:.4g} m beyond its ends, so that sag, below its chord, says little"
    ]


def test_the_sag_of_a_load_between_the_ends_is_not_doubted():
    loads = "cable.loads=[{fraction: 0.5, force: [100, 0, 0]}]"
    assert "beyond" not in run("static", CARLINA, "--set", loads, "--set", "model={accuracy: 1e-4}").err


@pytest.mark.parametrize("count", [9, 60])
def test_a_path_of_few_and_of_many_places_is_drawn_without_warnings(tmp_path, count):
    done = run("static", ZIPLINE, "--locus", f"load1:{count}", "--plot", tmp_path / "path.svg", "--top", "1")
    assert done.err.splitlines()[-1] == f"written: {tmp_path / 'path.svg'}"


@pytest.mark.parametrize(("force", "across"), [("[100 N, 0, 0]", 100.0), ("[0, 0, -100 N]", 0.0)])
def test_an_upright_cable_has_the_horizontal_tension_of_its_loads(force, across):
    """The supports hold the load together; the halves of the cable have the two forces of the supports."""
    cable = f"{{from: [0, 0, 0], to: [0, 0, 10 m], preload: 5 kN, loads: [{{fraction: 0.5, force: {force}}}]}}"
    scene = yaml.safe_load(f"{{cable: {{material: steel, diameter: 10 mm}}, cables: {{c: {cable}}}}}")
    (row,) = load(scene).static()["cables"].to_dict("records")
    reactions = [row[f"reaction_{end}_horizontal_N"] for end in (1, 2)]
    assert sum(reactions) == pytest.approx(across, rel=1e-12)
    assert row["horizontal_tension_N"] == pytest.approx(across / 2, rel=1e-4)
