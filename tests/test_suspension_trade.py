"""`trade` of suspensions: its reference and its errors against truth that it did not make, and what it prints."""

import re

import numpy as np
import pytest
import scipy.linalg
from command import CONFIGS, rows_of, run
from references import bar_suspension, continuous_suspension
from references.dense import condensed
from suspension_cases import SUSPENSIONS, scene_at

from cablestudy import plots
from cablestudy.scene.scene import load_scene
from cablestudy.study import trade
from cablestudy.study.columns import find
from cablestudy.study.refinement import with_elements
from cablestudy.study.suspension import trade as suspension_trade
from cablestudy.study.suspension.case import SuspensionCase

ASIDE = "bodies.cabin.at=[54.72 m, 0, 149.65 m]"  # no two modes coincide
PENDULUM = """\
cable: {elastic_modulus: 1 GPa, area: 100 mm^2, density: 1 kg/m^3, unstretched_length: 4 m}
bodies: {bob: {at: [0, 0, 1], mass: 30 kg, free: [x, y, z], attachments: {eye: [0, 0, 0]}}}
cables: {rod: {from: [0, 0, 5], to: bob.eye}}
"""


@pytest.fixture
def pendulum(tmp_path, monkeypatch):
    """A scene of few models: its path."""
    monkeypatch.setitem(suspension_trade.LARGEST, False, 150)
    path = tmp_path / "pendulum.yaml"
    path.write_text(PENDULUM, encoding="utf-8")
    return path


def columns(*names):
    return [suspension_trade.comparable(None, find(name)) for name in names]


def compared(scene, names, *patterns, repeats=0):
    """Name -> Measurement, of the models whose names match."""
    wanted = columns(*names)
    models = [model for model in trade.models_of(scene, wanted) if any(re.fullmatch(p, model.name) for p in patterns)]
    return {entry.name: entry for entry in trade.compare(scene, wanted, repeats, models).entries}


@pytest.mark.parametrize(("name", "sets"), [("fast", [ASIDE]), ("carlina-balloon", []), ("mast-guys", [])])
def test_the_reference_is_the_suspension_of_continuous_cables(name, sets):
    """Modes below a frequency are counted without elements."""
    model, numbers = scene_at(name, *sets), (1, 2, 8)
    reference = trade.reference_of(model, columns(*(f"frequency_{k}" for k in numbers)))
    assert reference.failures == {}
    counted = continuous_suspension.Suspension(SuspensionCase(model).equilibrium)
    for k in numbers:
        found, error = reference.values[f"frequency_{k}"], reference.errors[f"frequency_{k}"]
        assert error < 1e-10
        assert counted.below(found * (1 - 1e-9)) < k <= counted.below(found * (1 + 1e-9))


def test_errors_of_bars_are_those_of_dense_bars():
    model, names = scene_at("fast", ASIDE), ("frequency_1", "frequency_2", "frequency_8")
    state = SuspensionCase(model).equilibrium
    exact = trade.reference_of(model, columns(*names)).values
    found = compared(model, names, "(5|10) lumped bars")
    for count in (5, 10):
        bars = bar_suspension.dense(state, count).modes()[0]
        for name in names:
            expected = abs(bars[int(name.split("_")[1]) - 1] / exact[name] - 1)
            assert found[f"{count} lumped bars"].errors[name] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("name", ["fast", "carlina-net", "mast-guys"])
def test_accuracies_hold_and_so_do_the_errors_they_state(name):
    found = compared(scene_at(name), ("max_tension", "frequency_1", "frequency_8"), "accuracy .*")
    assert len(found) == 5
    for model, entry in found.items():
        asked = float(model.split()[1])
        assert entry.status == "ok"
        assert max(entry.errors.values()) <= asked
        assert entry.largest_stated <= asked
        assert all(error <= 10 * entry.stated[column] for column, error in entry.errors.items())


def test_an_exact_choice_states_the_error_of_its_statics_alone():
    found = compared(scene_at("mast-guys"), ("max_tension", "frequency_1"), "10 blended bars", "1 x order 12")
    for entry in found.values():
        assert entry.stated.keys() == {"max_tension"}
        assert entry.largest_stated is None
        assert entry.errors["max_tension"] <= 1e-10
    assert found["10 blended bars"].errors["frequency_1"] > 1e3 * found["1 x order 12"].errors["frequency_1"]


def static_error_of_bars(scene):
    """Relative error of the lowest frequency of one body on its static stiffness with a third of the cables' mass."""
    equilibrium = SuspensionCase(scene).equilibrium
    bars, mass = bar_suspension.dense(equilibrium, 16), bar_suspension.body_matrices(equilibrium, 0)[0]
    for (_, of_nodes, _), moved in zip(bars.cables, bars.maps, strict=True):
        mass = mass + of_nodes[::3, ::3].sum() / 3 * moved[-3:, -6:].T @ moved[-3:, -6:]
    stiffness = condensed(bars.K, np.arange(len(bars.K) - 6, len(bars.K)))
    return np.sqrt(scipy.linalg.eigh(stiffness, mass, eigvals_only=True)[0]) / (2 * np.pi * bars.modes()[0][0]) - 1


def test_closed_forms_give_statics_or_frequencies_on_the_static_stiffness():
    names = ("max_tension", "cabin.stiffness_zz", "cabin.frequency_static_1", "frequency_1", "frequency_8")
    found = compared(scene_at("fast"), names, "catenary", "static stiffness")
    catenary, static = found.values()
    assert catenary.errors.keys() == set(names[:3])
    assert max(catenary.errors.values()) <= 1e-10
    assert catenary.status == "frequency_1, frequency_8: statics alone"
    # cables as heavy as half the cabin, and as slow: wrong by two thirds
    assert static.errors.keys() == {"frequency_1"}
    assert static.errors["frequency_1"] == pytest.approx(static_error_of_bars(scene_at("fast")), abs=0.01)
    assert "6 free displacements have no mode 8" in static.status


def test_the_static_stiffness_of_a_pendulum_is_that_of_textbooks(pendulum):
    model = load_scene(pendulum)[1]
    (found,) = (one for one in trade.models_of(model, columns("frequency_1")) if one.name == "static stiffness")
    row = found.solve(model, columns("frequency_1", "frequency_3", "bob.frequency_3"))
    assert row.failures == {}
    rod, length = 1e-4 * 4.0, 4.0 * (1 + 30 * 9.81 / 1e5)
    sway = np.sqrt((30 + rod / 2) * 9.81 / length / (30 + rod / 3)) / (2 * np.pi)
    heave = np.sqrt(1e5 / 4.0 / (30 + rod / 3)) / (2 * np.pi)
    assert row.cells["frequency_1_Hz"] == pytest.approx(sway, rel=1e-5)
    assert row.cells["frequency_3_Hz"] == pytest.approx(heave, rel=1e-9)
    assert row.cells["bob.frequency_3_Hz"] == pytest.approx(heave, rel=1e-9)


def test_the_reference_of_the_motion_in_the_wind_is_as_exact_as_it_states(pendulum):
    """Held against elements of high order, each of which is solved by itself."""
    wind = "wind: {speed: 5 m/s, turbulence_intensity: 0.15, length_scale: 20 m}\n"
    heavy = PENDULUM.replace("density: 1 kg", "damping: {model: kelvin_voigt, time: 1 ms}, density: 1e5 kg")
    heavy = heavy.replace("mass: 30 kg", "mass: 30 kg, wind: {area: 0.1 m^2, drag_coefficient: 1}")
    pendulum.write_text(heavy + wind, encoding="utf-8")
    model, (column,) = load_scene(pendulum)[1], columns("bob.rms_x")
    reference = trade.reference_of(model, [column])
    value, error = reference.values["bob.rms_x"], reference.errors["bob.rms_x"]
    assert error < 1e-4
    for order, expected in ((16, 1e-10), (24, 1e-11), (32, 1e-11)):  # the search for the form in the wind leaves 7e-12
        number = column.compute(SuspensionCase(with_elements(model, 1, order, "lumped")))[0]
        assert number == pytest.approx(value, rel=expected)
        assert abs(number / value - 1) <= error


def test_models_too_large_to_compare_are_left_out():
    """Of 6 cables with 160 bars 2,862 displacements, with 320 more than 3,000; of a sparse net many more."""
    wanted = columns("frequency_1")
    names = {model.name for model in trade.models_of(scene_at("fast"), wanted)}
    assert "160 lumped bars" in names
    assert not {"320 lumped bars", "640 lumped bars"} & names
    assert "20 lumped bars" in {model.name for model in trade.models_of(scene_at("net-30x30"), wanted)}
    assert [model.name for model in trade.models_of(scene_at("fast"), columns("max_tension"))] == ["catenary"]


def test_the_columns_by_default():
    document, model = load_scene(SUSPENSIONS / "fast.yaml")
    found, notes = trade.columns_to_compare(document, model)
    expected = ["max_tension", "cabin.stiffness_zz", "frequency_1", "frequency_2", "frequency_8"]
    assert ([column.name for column in found], notes) == (expected, [])
    found, _ = trade.columns_to_compare(*load_scene(SUSPENSIONS / "mast-guys.yaml"))
    assert [column.name for column in found] == ["max_tension", *expected[2:]]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("cabin.stifness_zz", "unknown column 'cabin.stifness_zz' (did you mean cabin.stiffness_zz?)"),
        ("cabn.z", "no body, free point, cable or link cabn (did you mean cabin?)"),
        ("preload", "preload is a column of a single cable; here it is CABLE.preload"),
        ("end_stiffness", "end_stiffness is a column of a single cable; here it is cabin.stiffness_xx"),
        ("cabin.mass", "cabin.mass does not depend on the model"),
        ("cabin.z,cabin.z_m", "cabin.z is listed twice"),
    ],
)
def test_mistakes_in_columns(name, message):
    sets = ("--set", "cable.strength=null")
    assert run("trade", SUSPENSIONS / "fast.yaml", *sets, "--columns", name, code=2).lines == [f"--columns: {message}"]


def test_a_key_that_a_column_lacks_is_told_with_its_place():
    path = SUSPENSIONS / "fast.yaml"
    (line,) = run("trade", path, "--set", "cable.strength=null", "--columns", "c1.utilisation", code=2).lines
    assert line == f"{path}:32:7: cables.c1.breaking_force: missing key: 'cablestudy trade' needs it"


def test_columns_of_a_gondola_as_a_suspension_are_not_compared():
    outcome = run("trade", CONFIGS / "carlina.yaml", "--columns", "gondola.x", code=2)
    assert outcome.lines == ["--columns: gondola.x: the models of one cable that are compared do not have it"]


def test_table_files_and_picture(pendulum, tmp_path):
    folder, picture = tmp_path / "tables", tmp_path / "trade.svg"
    outcome = run("trade", pendulum, "--columns", "max_tension,frequency_1", "--repeats", 1, "--format", "csv",
                  "--out", folder, "--plot", picture, "--explain")  # fmt: skip
    rows = {row["model"]: row for row in rows_of(outcome.out, "csv")}
    assert (folder / "trade-pendulum.csv").read_text(encoding="utf-8") == outcome.out
    assert "## The fastest model below an error" in (folder / "trade-pendulum.md").read_text(encoding="utf-8")
    assert picture.read_bytes().startswith(b"<?xml")
    assert "fastest below 1e-02: frequency_1: " in outcome.err
    controlled, bars = rows["accuracy 1e-4"], rows["10 lumped bars"]
    assert controlled["frequency_1_error"] <= 10 * controlled["frequency_1_stated_error"] <= 1e-4
    assert controlled["largest_stated_error"] >= controlled["frequency_1_stated_error"]
    assert (bars["frequency_1_stated_error"], bars["largest_stated_error"]) == (None, None)
    assert all(row["time_ms"] > 0 for row in rows.values() if row["family"] != "reference")
    assert all(row["frequency_1_time_ms"] > 0 for row in (controlled, bars))
    assert {row["dof"] for row in (rows["catenary"], rows["static stiffness"])} == {0, 3}


def test_a_suspension_without_equilibrium_has_nothing_to_compare(pendulum):
    """It may turn about its only cable."""
    body = "free: [x, y, z, yaw], inertia: [1, 1, 1]"
    pendulum.write_text(PENDULUM.replace("free: [x, y, z]", body), encoding="utf-8")
    outcome = run("trade", pendulum, code=3)
    assert (outcome.lines, outcome.out) == ([f"{pendulum}: nothing holds bob yaw"], "")


def test_a_column_without_value_leaves_the_others(pendulum):
    outcome = run("trade", pendulum, "--columns", "bob.z,bob.frequency_4", "--repeats", 1,
                  "--format", "csv", code=3)  # fmt: skip
    (line,) = outcome.lines
    assert "bob.frequency_4: no reference: " in line
    assert "have more than half of their kinetic energy in bob, not 4" in line
    assert "bob.z_error" in outcome.out


def test_the_picture_has_a_panel_for_each_column(pendulum):
    wanted = columns("max_tension", "frequency_1")
    model = load_scene(pendulum)[1]
    models = [one for one in trade.models_of(model, wanted) if re.fullmatch("catenary|1 x.*|5 .*|static.*", one.name)]
    figure = plots.trade_plot(trade.compare(model, wanted, 1, models), "title")
    titles = [axes.get_title(loc="left").partition(":")[0] for axes in figure.axes]
    assert titles == ["max tension", "frequency 1"]
