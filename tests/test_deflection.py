"""Deflection under point loads (the paper's Fig. 4): against bars, against closed forms, and small against large."""

import numpy as np
import pytest
from command import CONFIGS, table_of
from mpmath import mp
from references import bars, catenary_mp
from scenes import CHORD, LENGTH, PAPER, SAGGING, G, Twin, cells, scene
from solved import solve

from cablestudy.errors import NoSolutionError
from cablestudy.study.deflection import load_deflections, nodal_deflections
from cablestudy.study.one_cable.case import CableCase

FIG_4 = str(CONFIGS / "point-load.yaml")


def at_node(twin, node, force, elements=40):
    """The same cable with a force [N] on a node of its bars."""
    place = node * twin.length / elements
    return Twin(twin.a, twin.b, twin.length, twin.area, ((place, force),))


def by_bars(twin, elements=40):
    """Full and linear movement of the loaded node along the load, by chains at 80 digits and dense matrices."""
    ((place, force),) = twin.loads
    node = round(place / twin.length * elements)
    before = Twin(twin.a, twin.b, twin.length, twin.area).chain(elements)
    after = twin.chain(elements)
    K, _ = bars.matrices(before, twin.length, twin.stiffness, twin.mass)
    pull = np.zeros(len(K))
    pull[3 * node : 3 * node + 3] = force
    inner = slice(3, -3)
    linear = np.linalg.solve(K[inner, inner], pull[inner])[3 * node - 3 : 3 * node]
    along = np.array(force) / np.linalg.norm(force)
    return (after.nodes[node] - before.nodes[node]) @ along, linear @ along


@pytest.mark.parametrize(
    "twin",
    [
        at_node(PAPER, 30, (0.0, 0.0, -1.0)),
        at_node(PAPER, 30, (0.0, 0.0, -300.0)),
        at_node(PAPER, 10, (5.0, 0.0, 40.0)),
        at_node(SAGGING, 20, (0.0, 0.0, -20.0)),
        at_node(Twin(175.68, 60.49, LENGTH), 4, (0.0, 0.0, -10.0)),
        at_node(SAGGING, 13, (100.0, 0.0, 0.0)),
    ],
    ids=["Fig. 4", "heavy", "upwards", "sagging", "inclined", "sideways"],
)
def test_bars_move_as_the_reference(twin):
    full, linear = by_bars(twin)
    found = cells(twin.scene(), "deflection", "linear_deflection", "nonlinearity")
    assert found["deflection"] == pytest.approx(full, rel=1e-8)
    assert found["linear_deflection"] == pytest.approx(linear, rel=1e-8)
    assert found["nonlinearity"] == pytest.approx(linear / full - 1, abs=1e-7)


def test_figure_4_is_the_taut_string():
    """F x (l - x)/(T l), the string of constant tension; the stretch that it leaves out is 1e-4 of it here."""
    found = table_of("static", FIG_4)[0]
    place = 0.75 * CHORD
    expected = place * (CHORD - place) / (1344.75 * CHORD)  # of 1 N
    assert found["linear_deflection_m"] == pytest.approx(expected, rel=2e-3)
    assert found["deflection_m"] == pytest.approx(expected, rel=2e-3)
    assert 0 < found["nonlinearity"] < 1e-3  # a taut cable stiffens as it is pulled
    assert found["sag_m"] - cells(scene(), "sag")["sag"] == pytest.approx(
        (CHORD - place) * CHORD / 2 / (1344.75 * CHORD), rel=2e-3
    )


def test_a_weightless_string_moves_by_the_closed_form():
    # no weight and a tiny load: T stays EA (l - L)/L, and the string's formula is exact but for the load's own tension
    force, share = 1e-3, 0.3
    still = scene("gravity=0", "model=null", f"cable.loads=[{{at: {share * LENGTH!r}, force: [0, 0, -{force}]}}]")
    tension = PAPER.stiffness * (CHORD - LENGTH) / LENGTH
    found = cells(still, "deflection", "linear_deflection")
    expected = force * share * (1 - share) * CHORD / tension
    assert found["linear_deflection"] == pytest.approx(expected, rel=1e-10)
    assert found["deflection"] == pytest.approx(expected, rel=1e-9)


def test_closed_form_statics_move_as_the_continuous_cable():
    place, force = 0.25 * 186.0, 1e-3
    twin = Twin(CHORD, 0.0, 186.0, 24.2e-6, ((place, (0.0, 0.0, -force)),))
    found = cells(twin.scene("model=null"), "deflection", "linear_deflection")
    cable = twin.length, twin.stiffness, twin.mass * G
    heights = []
    for loads in ((), twin.loads):
        force0 = catenary_mp.solve_loaded((twin.a, 0, twin.b), *cable, loads)
        heights.append(catenary_mp.shape_loaded(force0, place, *cable, loads)[2])
    assert found["deflection"] == pytest.approx(float(heights[0] - heights[1]), rel=1e-6)
    assert found["linear_deflection"] == pytest.approx(found["deflection"], rel=1e-4)


@pytest.mark.parametrize("rise", [0.0, 60.0])
@pytest.mark.parametrize(("length", "force"), [
    (400.0, (0.0, 0.0, -0.1)), (1800.0, (0.3, 0.0, -1.0)), (1.0005 * CHORD, (0.0, 0.0, -1e-6)),
    (0.999 * CHORD, (0.0, 0.0, -1e-5)),
], ids=["slack", "nine times its chord", "almost no load", "taut"])  # fmt: skip
def test_deflections_of_the_closed_form_are_within_their_stated_errors(rise, length, force):
    twin = Twin(CHORD, rise, length, 24.2e-6, ((0.37 * length, force),))
    cable = mp.mpf(twin.length), twin.stiffness, twin.mass * G
    direction = mp.matrix(force) / mp.norm(mp.matrix(force))

    def place(share):
        """Place of the load under a share of it, along its force, at 50 digits."""
        loads = [(place, [share * mp.mpf(part) for part in parts]) for place, parts in twin.loads]
        force0 = catenary_mp.solve_loaded((twin.a, 0, twin.b), *cable, loads)
        return mp.fdot(direction, catenary_mp.shape_loaded(force0, twin.loads[0][0], *cable, loads))

    with mp.workdps(50):
        small = mp.mpf(10) ** -12
        full, linear = place(1) - place(0), (place(small) - place(-small)) / (2 * small)
        expected = {"deflection": full, "linear_deflection": linear, "nonlinearity": linear / full - 1}
    row = solve(twin.scene("model=null"), *expected)
    for name, found in row.values.items():
        assert abs(found - expected[name]) <= row.errors[name] * abs(found), name
        assert row.errors[name] < 1e-5 or name == "nonlinearity"


def test_a_folded_cable_has_no_linear_deflection():
    folded = scene("model=null", "cable.ends=[[0, 0, 0], [0, 0, 10]]", "cable.unstretched_length=12",
                   "cable.loads=[{at: 5, force: [3, 0, -10]}]")  # fmt: skip
    found = solve(folded, "deflection", "linear_deflection").values
    assert found["deflection"] > 0
    assert found["linear_deflection"] is None


def test_shape_shows_the_deflection_of_every_point():
    rows, (summary,) = table_of("static", FIG_4, "--shape"), table_of("static", FIG_4)
    assert [row["deflection_z_m"] for row in (rows[0], rows[-1])] == [0, 0]
    lowest = min(rows, key=lambda row: row["deflection_z_m"])
    assert lowest["s_m"] == pytest.approx(138.366225, rel=1e-12)
    for name in ("deflection", "linear_deflection"):
        assert -lowest[f"{name}_z_m"] == pytest.approx(summary[f"{name}_m"], rel=1e-12)
    assert "deflection_z_m" not in table_of("static", FIG_4, "--shape", "--set", "cable.loads=null")[0]


def test_the_larger_the_load_the_less_it_is_linear():
    # a taut cable stiffens with the square of the load while that is little; its own weight adds an odd part
    found = [
        np.mean([cells(at_node(PAPER, 20, (0.0, 0.0, f)).scene(), "nonlinearity")["nonlinearity"] for f in (up, -up)])
        for up in (1.0, 10.0, 100.0)
    ]
    assert found == sorted(found)
    assert found[1] / found[0] == pytest.approx(100, rel=0.05)
    assert found[2] / found[1] < 100


def test_of_several_loads_each_has_its_own_movement():
    sideways = "{at: 40 m, force: [0, 2 N, 0]}"
    case = CableCase(scene(f"cable.loads=[{sideways}, {{at: 120 m, force: [0, 0, -1 N]}}]"))
    full, linear = load_deflections(case)
    tension = case.statics.mean_tension
    string = np.array([2 * 40 * (LENGTH - 40), 120 * (LENGTH - 120)]) / LENGTH / tension * CHORD / LENGTH
    assert full == pytest.approx(string, rel=5e-3)
    assert linear == pytest.approx(string, rel=5e-3)
    mesh, moved, _ = nodal_deflections(case)
    assert moved.shape == (mesh.nodes, 3)


@pytest.mark.parametrize("model", ["accuracy: 1e-4", "elements: 8"])
@pytest.mark.parametrize(("height", "at", "force"), [(100, 50, -100), (100, 30, -70), (60, 10, 300), (-80, 33, -1)])
def test_a_load_along_a_vertical_cable_moves_it_linearly(model, height, at, force):
    """F a (1 - a/L)/EA, L being the unstretched length: pieces of a straight cable are springs in a row."""
    vertical = f"cable.ends=[[0, 0, 0], [0, 0, {height}]]", f"cable.unstretched_length={0.999 * abs(height)!r}"
    found = cells(
        scene(*vertical, f"cable.loads=[{{at: {at}, force: [0, 0, {force}]}}]", f"model={{{model}}}"),
        "deflection", "nonlinearity", "axial_stiffness", "unstretched_length",
    )  # fmt: skip
    spring = at * (1 - at / found["unstretched_length"]) / found["axial_stiffness"]
    assert found["deflection"] == pytest.approx(abs(force) * spring, rel=1e-9)
    assert found["nonlinearity"] == 0


def test_a_load_along_a_cable_without_weight_moves_it_linearly():
    loads = "cable.loads=[{at: 60 m, force: [8, 0, 6]}]"
    found = cells(scene("gravity=0", "cable.ends=[[0, 0, 0], [80, 0, 60]]", "cable.unstretched_length=99.9", loads),
                  "deflection", "nonlinearity", "axial_stiffness")  # fmt: skip
    assert found["deflection"] == pytest.approx(10 * 60 * (1 - 60 / 99.9) / found["axial_stiffness"], rel=1e-6)
    assert found["nonlinearity"] == 0


def test_a_force_of_nothing_moves_nothing():
    still = scene("cable.loads=[{at: 40 m, force: [0, 0, 0]}]")
    assert set(cells(still, "deflection", "linear_deflection", "nonlinearity").values()) == {0.0}


def test_without_loads_there_is_nothing_to_ask():
    with pytest.raises(NoSolutionError, match="carries no point load"):
        load_deflections(CableCase(scene()))
