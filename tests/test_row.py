"""One row: what is modelled, how far the order is raised, and what is told about it."""

import json
import re
from functools import cache

import numpy as np
import pytest
from campaign import campaign
from command import CARLINA, SLACK, run
from random_twins import random_scene
from references import catenary_mp, scene_truth
from scenes import CHORD, GONDOLA, PAPER, SAGGING, G, Twin, cells, scene
from solved import rows_as_alone, solve, solve_all

from cablestudy.errors import ConvergenceError
from cablestudy.motion.tolerances import MOTION
from cablestudy.study.columns import find
from cablestudy.study.notes import statics_error
from cablestudy.study.one_cable.asked_modes import AskedModes
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.case_modes import modes
from cablestudy.study.one_cable.rows import evaluate
from cablestudy.system.residues import eigen_of_rows

DEEP = Twin(CHORD, 0.0, 371.6)  # twice the chord
ORDER_AND_MODELS = r"of order (\d+)", r"compared: (\d+) model"


def row_of(scene, *names):
    return evaluate(scene, [find(name) for name in names])


def test_a_tighter_accuracy_costs_more_unknowns_and_errs_less():
    exact, unknowns = SAGGING.frequencies(12)[11], []
    for accuracy in (1e-2, 1e-4, 1e-6, 1e-9):
        sharp = scene(f"model.accuracy={accuracy}", base=SLACK)
        found = cells(sharp, "inplane_frequency_12", "dof", "error_estimate")
        assert abs(found["inplane_frequency_12"] / exact - 1) <= accuracy
        assert found["error_estimate"] <= accuracy
        unknowns.append(found["dof"])
    assert unknowns == sorted(unknowns)


def test_high_modes_are_reached_by_raising_the_order():
    # a taut string to 1e-4: mode 60 is 60 times the first
    found = cells(scene("model.accuracy=1e-4", "gravity=0"), "outofplane_frequency_1", "outofplane_frequency_60")
    assert found["outofplane_frequency_60"] == pytest.approx(60 * found["outofplane_frequency_1"], rel=1e-4)
    too_many = row_of(scene("model.elements=40"), "outofplane_frequency_60")
    assert too_many.cells["status"] == "the model has 39 out-of-plane modes, not 60"


@pytest.mark.parametrize("accuracy", [1e-1, 1e-3, 1e-6])
def test_the_twentieth_symmetric_mode_has_39_half_waves(accuracy):
    """A taut string again; models that have no such mode are not where the search begins, nor where it ends."""
    found = cells(scene(f"model={{accuracy: {accuracy}}}", "gravity=0"), "symmetric_frequency_20", "cable_frequency")
    assert found["symmetric_frequency_20"] == pytest.approx(39 * found["cable_frequency"], rel=2 * accuracy)


def test_a_cable_without_a_gondola_has_its_frequencies():
    """And none of a gondola is asked for on the way."""
    plain = scene("gondola=null", "winch=null", "wind=null", "model={accuracy: 1e-6}")
    found = cells(plain, "cable_frequency", "axial_frequency_1")
    assert found["cable_frequency"] == pytest.approx(PAPER.frequencies(1)[0], rel=1e-4)
    assert found["axial_frequency_1"] == pytest.approx((70.3e9 / 1440) ** 0.5 / (2 * 184.4883), rel=1e-3)


def test_an_axial_mode_among_too_many_transverse_ones_is_refused_at_once():
    """EA/T near 1e8 and a sag: ten thousand half-waves, of which no model is made."""
    stiff = scene("model={accuracy: 1e-2}", "cable.elastic_modulus=7e17 Pa", base=SLACK)
    row = row_of(stiff, "axial_frequency_1", "dof")
    assert row.failed
    assert "waves" in row.cells["status"]


def test_an_axial_mode_of_a_straight_cable_needs_no_transverse_waves():
    """c/(2 L) with nothing that bends the cable, however many half-waves there are beside it."""
    upright = scene("model={accuracy: 1e-8}", "gravity=0", "cable.elastic_modulus=7e17 Pa", "cable.preload=100 N")
    found = cells(upright, "axial_frequency_1", "dof", "unstretched_length")
    speed = np.sqrt(7e17 / upright.cable.density)
    assert found["axial_frequency_1"] == pytest.approx(speed / 2 / found["unstretched_length"], rel=1e-8)
    assert found["dof"] < 100


@cache
def models(base):
    """One scene by models of rising order."""
    return {order: CableCase(scene("model.accuracy=1e-3", base=base)).refined(1, order) for order in range(4, 48)}


@pytest.mark.crossed
@pytest.mark.parametrize("base", [CARLINA, SLACK], ids=["taut", "sagging"])
@pytest.mark.parametrize("name", ["inplane_frequency", "outofplane_frequency", "symmetric_frequency"])
def test_the_first_model_suffices_and_hardly_a_coarser_one(base, name):
    """Over accuracies and waves: the refinement begins where the estimated error first is below the accuracy."""
    tried, spare = [], []
    for number in (1, 2, 5, 10):
        column = find(f"{name}_{number}")
        stated = {  # a model may be too coarse to have such a mode
            order: AskedModes([column.mode]).frequencies(case)[1].get(column.mode, np.inf)
            for order, case in models(base).items()
        }
        for accuracy in (1e-3, 1e-6, 1e-10):
            row = row_of(scene(f"model={{accuracy: {accuracy}}}", base=base), column.name)
            used, count = (int(re.search(pattern, " ".join(row.notes))[1]) for pattern in ORDER_AND_MODELS)
            tried.append(count)
            spare.append(used - min(order for order in stated if stated[order] <= accuracy))
    assert np.mean(tried) < 1.2
    assert np.median(spare) <= 2
    assert max(spare) <= 5


def test_modes_of_a_fixed_model_and_of_an_accuracy():
    _, found, notes, _ = modes(CableCase(scene()), 500)
    assert len(found) == 117
    assert "40 elements of order 1" in notes[0]
    _, found, notes, _ = modes(CableCase(scene(base=SLACK)), 40)
    inside = [found.frequency[i] for i in range(40) if found.kind[i] != "out-of-plane"]
    assert inside == pytest.approx(SAGGING.frequencies(len(inside)), rel=1e-4)
    with pytest.raises(ConvergenceError, match="5000 modes are too many"):
        modes(CableCase(scene(base=SLACK)), 5000)


def test_modes_up_to_a_frequency_miss_none():
    _, found, *_ = modes(CableCase(scene(base=SLACK)), upto=20.0)
    inside, out = SAGGING.frequencies(80), SAGGING.frequencies(80, "out")
    assert len(found) == (inside <= 20).sum() + (out <= 20).sum()
    assert np.all(found.frequency <= 20)


def test_notes_say_what_was_left_out():
    assert "left out: inertia and modes" in " ".join(row_of(scene(base=SLACK), "sag").notes)
    assert "elements" in row_of(scene(), "sag").notes[0]
    assert "asked for 0.0001" in " ".join(row_of(scene(base=SLACK), "cable_frequency").notes)


@pytest.mark.parametrize("gravity", [1e-20, 1e-30])
def test_a_cable_with_hardly_any_weight_troubles_no_other(gravity):
    """In the least gravity that a scene may have."""
    cable = "{chord: 10, area: 1e-4, elastic_modulus: 1e9, density: 1e3, unstretched_length: 11}"
    settings = [f"cable={cable}", "model={accuracy: 1e-3}"]
    scenes = [scene(f"gravity={value}", *settings) for value in (gravity, 9.81)]
    _, heavy = rows_as_alone(scenes, ("inplane_frequency_2", "lambda_squared"))
    assert heavy.status == "ok"


# what cannot be had leaves the rest of its row standing

OPEN_LOOP = ("preload", "cable_frequency", "gondola_frequency", "gondola_rms_open_loop")
HYSTERETIC = "cable.damping={model: hysteretic, loss_factor: 0.02}"


UNSTABLE = (["winch.controller.gain=100"], "the loop is unstable at 100 rad/s")


@pytest.mark.crossed
@pytest.mark.parametrize("model", ["model={elements: 40}", "model={accuracy: 1e-4}"])
@pytest.mark.parametrize(("sets", "reason", "gone"), [
    *((*UNSTABLE, name) for name in ("gondola_rms", "phase_margin", "bandwidth")),
    (["winch=null"], "largest_gain needs the key winch.controller, which this case does not have", "largest_gain"),
    ([], "modes, not 900", "inplane_frequency_900"),
])  # fmt: skip
def test_a_column_that_cannot_be_had_leaves_the_others(model, sets, reason, gone):
    whole = cells(scene(model, HYSTERETIC), *OPEN_LOOP)
    row = solve(scene(model, HYSTERETIC, *sets), *OPEN_LOOP, gone)
    assert reason in row.status
    assert row.values.pop(gone) is row.errors[gone] is None
    assert row.values == pytest.approx(whole, rel=1e-6)


def test_a_gain_that_no_margin_gives_leaves_the_open_loop(monkeypatch):
    monkeypatch.setattr("cablestudy.control.stable_gains.StableGains.gain_of_peak", lambda self, peak, most: None)
    row = row_of(scene("winch.controller.gain={auto: {gain_margin: 6 dB}}"), *OPEN_LOOP, "gondola_rms", "gain_margin")
    assert row.cells["status"].startswith("no gain follows from a gain margin")
    assert [row.cells[name] for name in ("gondola_rms_mm", "gain_margin_dB")] == [None, None]
    usual = cells(scene(), "gondola_rms_open_loop")["gondola_rms_open_loop"]
    assert row.cells["gondola_rms_open_loop_mm"] == pytest.approx(usual, rel=1e-6)


def test_a_loop_that_cannot_be_had_in_a_storm_leaves_the_others(monkeypatch):
    """The steady wind adds to the errors of what there is, and of that alone."""
    monkeypatch.setattr(type(MOTION), "resolved_waves", 60)
    data = random_scene(46)
    data["winch"]["controller"]["notch"]["rolloff_frequency"] = 20.0  # so that the loop drives waves up to there
    row = solve(data, "gain", "gondola_rms", "sag")
    assert row.values["gain"] is row.values["gondola_rms"] is None
    assert row.values["sag"] > 0
    assert "which could drive about" in row.status
    assert "more than are resolved (60)" in row.status  # half-waves along the cable


LOSSES = [("{model: hysteretic, loss_factor: 0.02}", "{accuracy: 1e-4}"),
          ("{model: modal, ratio: 0.01}", "{elements: 12, order: 1}"),
          ("{model: kelvin_voigt, time: 1 ms}", "{accuracy: 1e-4}")]  # fmt: skip


CHANGED = (
    {"cable.ends": "[[0, 0, 0], [185.8, 0, 0]]"},
    {"cable.area": "6 mm^2"},
    {"gondola.mass": 2},
    {"winch.controller.gain": 0.02},
    {"cable.ends": "[[0, 0, 0], [180, 0, 40]]"},
    {"cable.unstretched_length": 150},
    {"winch.controller.gain": 300},
    {"model": "{accuracy: 1e-5}"},
    {"winch.controller.gain": 0},
    {"winch.location": "gondola"},
    {"wind.speed": 3},
    {"wind.air_density": 0.6},
    {"gondola.drag_coefficient": 2},
)
OF_MOTION = (
    "gondola_damping_ratio", "gondola_rms", "gondola_rms_velocity_open_loop", "gondola_rms_all_wind", "gain_margin",
    "winch_rms_speed", "exposure", "peak",
)  # fmt: skip


@pytest.mark.parametrize(("damping", "model"), campaign(LOSSES, LOSSES[:2]))
def test_rows_of_loop_and_wind_have_the_digits_that_they_have_alone(damping, model, monkeypatch):
    """Coupled modes and what damps that of the gondola are computed together, of meshes that rows share.

    Of level and inclined cables, heavy and light bodies, two places of the winch, several winds, and one that fails.
    """
    common = {"cable.damping": damping, "winch.controller.gain": 0.01, "model": model, "exposure": "10 ms",
              "wind.aerodynamic_damping": "true"}  # fmt: skip
    changes = campaign(CHANGED, [CHANGED[place] for place in (0, 2, 4, 6, 8, 9, 10, 12)])
    sets = [[f"{key}={value}" for key, value in (common | change).items()] for change in changes]
    scenes, sizes = [scene(*one) for one in sets], []
    alone = [solve(one, *OF_MOTION) for one in scenes]

    def counted(matrices):
        sizes.append(len(matrices))
        return eigen_of_rows(matrices)

    monkeypatch.setattr("cablestudy.system.state_spaces.eigen_of_rows", counted)
    together = solve_all(scenes, OF_MOTION)
    assert together == alone
    assert max(sizes) > 1  # of the eigenvalue problems that are solved together
    assert together[::-2] == solve_all(scenes[::-2], OF_MOTION)
    assert {row.status == "ok" for row in together} == {True, False}
    assert len({row.values["gondola_damping_ratio"] for row in together}) > 4


DIFFERENT = [
    (True, "cable.diameter", "4 mm"),  # EA and mass are stated, so that only the wind tells the cables apart
    (True, "cable.damping.loss_factor", "0.1"),
    (False, "wind.speed", "9 m/s"),
    (False, "model.accuracy", "1e-6"),
    (True, "wind.speed", "9 m/s"),
    (False, "cable.diameter", "4 mm"),
]


@pytest.mark.parametrize(("gondola", "key", "value"), campaign(DIFFERENT, DIFFERENT[:4]))
def test_cables_that_hang_alike_share_no_more_than_they_have_in_common(gondola, key, value):
    sets = {
        "cable.axial_stiffness": "200 kN", "cable.mass_per_length": "4 g/m", "cable.diameter": "2 mm",
        "cable.damping.model": "hysteretic", "cable.damping.loss_factor": "0.02", "model.accuracy": "1e-3",
        "cable.damping.viscous": "0.01 N s/m^2",
    }  # fmt: skip
    plain, other = (scene(*map("=".join, of.items())) for of in (sets, sets | {key: value}))
    names = "gondola_rms_open_loop_all_wind", "gondola_damping_ratio"
    if not gondola:
        plain, other = (one.model_copy(update={"gondola": None, "winch": None}) for one in (plain, other))
        names = "midspan_rms", "tension_rms", "cable_frequency"
    first, second, third = rows_as_alone([plain, other, plain], names)
    assert first == third != second


def test_modal_damping_with_an_accuracy_leaves_what_has_no_damping():
    row = row_of(scene("model={accuracy: 1e-4}"), "sag", "gondola_frequency", "gondola_damping_ratio")
    assert row.cells["status"].startswith("modal damping grows with the number of modes")
    assert row.cells["gondola_damping_ratio"] is None
    assert row.cells["sag_m"] > 0
    cable = scene_truth.Cable(PAPER.chord, 0.0, PAPER.length, PAPER.stiffness, PAPER.mass, G, gondola=GONDOLA)
    expected, _ = scene_truth.Truth(cable).gondola_frequency()
    assert row.cells["gondola_frequency_Hz"] == pytest.approx(expected, rel=1e-4)


def test_without_an_equilibrium_what_the_scene_says_stands():
    impossible = scene("cable.preload=1 N")
    row = row_of(impossible, "chord", "sag", "cable_frequency")
    assert "below the least that this cable can have" in row.cells["status"]
    assert [row.cells[name] for name in ("chord_m", "sag_m", "cable_frequency_Hz")] == [185.8, None, None]
    assert row_of(impossible, "chord").cells == {"chord_m": 185.8, "status": "ok"}  # nobody asks for its form
    assert row_of(impossible, "status").cells == {"status": "ok"}


# fixed elements say how far they are off


def bars_off(twin, elements):
    """Relative error of the mean tension of bars against the catenary of 50 digits."""
    chain = twin.chain(elements)
    H, V0 = catenary_mp.solve(twin.a, twin.b, twin.length, twin.stiffness, twin.mass * G)
    exact = float(catenary_mp.mean_tension(H, V0, twin.length, twin.mass * G))
    return abs(chain.tensions.mean() / exact - 1)


@pytest.mark.parametrize(("twin", "elements", "warns"), [(PAPER, 40, False), (DEEP, 10, True), (DEEP, 200, False)])
def test_the_statics_of_fixed_elements_state_their_error(twin, elements, warns):
    row = row_of(twin.scene(f"model.elements={elements}"), "preload", "sag", "chord")
    assert row.errors["preload_N"] == pytest.approx(bars_off(twin, elements), rel=1e-3, abs=1e-12)
    assert row.errors["chord_m"] == 0
    assert bool(row.warnings) == warns
    if warns:
        assert re.search(r"tensions or sag of 10 elements of order 1 are [\d.]+ % off", row.warnings[0])
        assert f"tensions and sag within {statics_error(row.case):.1e}" in " ".join(row.notes)


def test_the_motion_of_fixed_elements_states_its_error_when_asked():
    columns = [find("cable_frequency"), find("sag")]
    silent, asked = (evaluate(scene("model.elements=40"), columns, estimate=estimate) for estimate in (False, True))
    assert silent.errors["cable_frequency_Hz"] is None
    assert silent.errors["sag_m"] < 1e-3
    # a taut string of bars with lumped mass: sin(x)/x of x = pi/80 below
    assert asked.errors["cable_frequency_Hz"] == pytest.approx((np.pi / 80) ** 2 / 6, rel=0.01)
    note = "motion: estimated error 2.6e-04, of cable_frequency_Hz, against a model to an accuracy of 1e-06"
    assert note in asked.notes
    assert asked.cells == silent.cells


def near(stated, true):
    return true / 1.2 < stated < 1.2 * true


@pytest.mark.parametrize("elements", [10, 40])
def test_the_stated_errors_of_bars_are_those_against_independent_references(elements):
    """Of a sagging cable: frequencies of the continuous cable, mean tension and sag of 50 digits."""
    twin = SAGGING
    truth = dict(zip([f"inplane_frequency_{k}" for k in (1, 2, 3)], twin.frequencies(3), strict=True))
    truth |= dict(zip([f"outofplane_frequency_{k}" for k in (1, 2, 3)], twin.frequencies(3, "out"), strict=True))
    H, V0 = catenary_mp.solve(twin.a, twin.b, twin.length, twin.stiffness, twin.mass * G)
    weight = twin.mass * G
    truth["preload"] = float(catenary_mp.mean_tension(H, V0, twin.length, weight))
    truth["sag"] = float(catenary_mp.sag(H, V0, twin.length, twin.stiffness, weight))
    truth["max_tension"] = float(np.hypot(float(H), max(abs(float(V0)), abs(weight * twin.length + float(V0)))))
    row = solve(twin.scene(f"model={{elements: {elements}}}"), *truth, estimate=True)
    for name, exact in truth.items():
        assert near(row.errors[name], abs(row.values[name] / exact - 1)), (name, row.errors[name])


def test_the_stated_errors_of_bars_are_those_against_a_model_of_eight_digits():
    names = ("gondola_frequency", "gondola_damping_ratio", "gondola_rms_open_loop", "axial_frequency_1")
    fine = cells(scene("model={accuracy: 1e-8}", HYSTERETIC, base=SLACK), *names)
    bars = [scene(f"model={{elements: {elements}}}", HYSTERETIC, base=SLACK) for elements in (10, 40)]
    for row in solve_all(bars, [*names, "error_estimate"]):
        true = {name: abs(row.values[name] / fine[name] - 1) for name in names}
        for name, error in true.items():
            assert near(row.errors[name], error), (name, row.errors[name], error)
        assert near(row.values["error_estimate"], max(true.values()))


@pytest.mark.parametrize("elements", [10, 40])
def test_json_of_modes_and_ssm_states_the_error_of_each_frequency(elements):
    """A taut string of lumped bars: sin(x)/x of x = k pi/(2 n); a stiff one along itself likewise."""
    for command in (("modes", "-n", 8), ("ssm", "--modes", 8)):
        sets = ("--set", f"model={{elements: {elements}}}", "--format", "json")
        answer = json.loads(run(command[0], CARLINA, *command[1:], *sets).out)
        seen = {}
        for row, stated in zip(answer["rows"], answer["errors"], strict=True):
            number = seen[row["type"]] = seen.get(row["type"], 0) + 1
            x = number * np.pi / (2 * elements)
            assert near(stated["frequency_Hz"], 1 - np.sin(x) / x), row
    exact = json.loads(run("modes", SLACK, "-n", 3, "--format", "json").out)["errors"]
    assert all(1e-12 <= stated["frequency_Hz"] < 1e-4 for stated in exact)


def test_what_has_no_error_is_named():
    """Modal damping grows with the number of modes: there is no continuous cable to compare with."""
    notes = run("windrms", CARLINA, "--explain").err
    assert "motion: estimated error 6.5e-07, of gondola_frequency_Hz" in notes
    assert re.search(r"motion: the error of gondola_rms_mm, .* and \d more is not known: modal damping grows", notes)


def test_a_poor_model_is_said_on_the_command_line():
    sets = ("--set", "model={elements: 6}", "--set", "cable.unstretched_length=300", "--format", "json")
    for command in ("static", "modes", "windrms"):
        assert "warning: tensions or sag of 6 elements of order 1 are" in run(command, CARLINA, *sets, code=None).err
        assert "warning" not in run(command, CARLINA).err
    assert "motion: estimated error 2.6e-04, of mode" in run("modes", CARLINA, "-n", 1, "--explain").err
    (errors,) = json.loads(run("windrms", CARLINA, "--format", "json").out)["errors"]
    assert errors["gondola_frequency_Hz"] < 1e-3


def test_no_computed_number_of_a_loop_states_less_than_rounding():
    """A straight cable, whose modes have no error: numbers of its loop differ by rounding; the stated gain has none."""
    straight = {
        "gravity": 0.0,
        "cable": {"chord": 79.14, "unstretched_length": 78.98, "axial_stiffness": 3e6, "mass_per_length": 0.133,
                  "damping": {"viscous": 0.0066}},
        "gondola": {"mass": 694.0}, "winch": {"controller": {"gain": 1e-3, "notch": "none"}, "delay": 5e-3},
        "model": {"accuracy": 1e-5},
    }  # fmt: skip
    errors = solve(straight, "largest_gain", "gain_margin", "phase_crossover", "gain").errors
    assert errors.pop("gain") == 0
    assert min(errors.values()) >= 1e-12
