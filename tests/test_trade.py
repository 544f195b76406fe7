"""`trade`: the errors it states, against truth that it did not make; its Pareto front; its tables; never its times."""

import re
import shlex
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from campaign import campaign
from command import CARLINA, CONFIGS, SLACK, refusal, rows_of, run, stored_table
from references import bars, continuous_cable, taut_string
from references.bars_in_wind import von_karman
from scenes import GONDOLA, INCLINED, PAPER, SAGGING, Twin, scene
from scipy.integrate import trapezoid
from scipy.optimize import brentq

from cablestudy import plots
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.scene.scene import load_scene
from cablestudy.study import trade
from cablestudy.study.columns import find
from cablestudy.study.compared_models import ComparedModel
from cablestudy.study.markdown import fitted
from cablestudy.study.one_cable import case as case_module
from cablestudy.study.one_cable import results
from cablestudy.study.one_cable import trade as trade_models
from cablestudy.study.one_cable.trade import DEFAULT
from cablestudy.study.tolerances import STUDY
from cablestudy.system.comparison import relative

RESULTS = Path(__file__).parents[1] / "results"
ETA = 0.02
HYSTERETIC = f"cable.damping={{model: hysteretic, loss_factor: {ETA}}}"
MOTION = ("end_stiffness", "cable_frequency", "inplane_frequency_8")
LOADED = Twin(PAPER.a, PAPER.b, PAPER.length, loads=((40.0, (0.0, 0.0, -30.0)), (120.0, (5.0, 0.0, -10.0))))
TWINS = {"paper": PAPER, "sagging": SAGGING, "inclined": INCLINED}
each_twin = pytest.mark.parametrize("twin", TWINS.values(), ids=TWINS)
loaded_too = pytest.mark.parametrize("twin", [*TWINS.values(), LOADED], ids=[*TWINS, "loaded"])


def columns(*names):
    return [find(name) for name in names]


def named(*patterns):
    """Models of one cable by name."""
    every = trade.models_of(scene(), columns("end_stiffness", "cable_frequency", "gondola_rms_open_loop"))
    return matching(every, *patterns)


def matching(models, *patterns):
    return [model for model in models if any(re.fullmatch(pattern, model.name) for pattern in patterns)]


def errors(scene, names, *patterns):
    """Model -> column -> error, without any timing."""
    found = trade.compare(scene, columns(*names), 0, named(*patterns))
    return {entry.name: entry.errors for entry in found.entries}


def in_plane(twin):
    """Transverse in-plane frequencies of a dense chain of 40 bars. [Hz]"""
    found = bars.modes(twin.chain(), *twin.bar)
    sideways = (found.vectors[1::3] ** 2).sum(axis=0) / (found.vectors**2).sum(axis=0)
    return found.frequencies[(sideways < 0.5) & (found.axial < 0.5)]


@loaded_too
def test_the_reference_is_the_continuous_cable(twin):
    reference = trade.reference_of(twin.scene(), columns(*MOTION))
    modes = continuous_cable.modes(*twin.cable, 8, loads=twin.loads)
    exact, own = modes.frequencies, modes.error
    stiffness = continuous_cable.static_end_stiffness(*twin.cable, loads=twin.loads)[0, 0]
    for name, value in zip(MOTION, (stiffness, exact[0], exact[7]), strict=True):
        assert reference.values[name] == pytest.approx(value, rel=reference.errors[name] + own + 1e-12), name
        assert reference.errors[name] < 1e-10


@loaded_too
def test_the_reference_of_the_gondola_balances_the_continuous_cable(twin):
    reference = trade.reference_of(twin.scene(), columns("gondola_frequency"))
    found = reference.values["gondola_frequency"]

    def balance(frequency):
        return twin.dynamic_stiffness(frequency) - GONDOLA * (2 * np.pi * frequency) ** 2

    exact = brentq(balance, found * (1 - 1e-5), found * (1 + 1e-5), xtol=1e-14, rtol=1e-14)
    assert found == pytest.approx(exact, rel=reference.errors["gondola_frequency"] + 1e-11)


def test_modal_damping_has_no_truth():
    found = trade.reference_of(scene(), columns("gondola_rms_open_loop", "largest_gain", "cable_frequency"))
    assert set(found.failures) == {"gondola_rms_open_loop", "largest_gain"}
    assert all("modal damping grows with the number of modes" in reason for reason in found.failures.values())
    assert set(found.values) == {"cable_frequency"}


def test_an_unstable_loop_leaves_the_open_loop_its_reference():
    windy = PAPER.scene(HYSTERETIC)
    alone = trade.reference_of(windy, columns("gondola_rms_open_loop"))
    both = trade.reference_of(windy, columns("gondola_rms", "gondola_rms_open_loop"))
    assert "the loop is unstable" in both.failures.pop("gondola_rms")
    assert both == alone


def test_the_reference_of_the_wind_is_the_integral_over_the_continuous_cable():
    """By a rule of its own, but for the cable's own resonances, which the gondola hardly feels."""
    reference = trade.reference_of(PAPER.scene(HYSTERETIC), columns("gondola_rms_open_loop", "gondola_frequency"))
    main = reference.values["gondola_frequency"]
    half = ETA / 2 * main
    node, weight = np.polynomial.legendre.leggauss(40)
    variance = 0.0
    for low, high in ((1e-6, 1e-3), (1e-3, 0.05), (0.05, 0.5 * main), (2 * main, 1.55), (1.62, 12)):  # in log f
        frequency = np.exp(np.log(low) + np.log(high / low) * (node + 1) / 2)
        variance += (weight * np.log(high / low) / 2 * frequency) @ response(frequency)
    low, high = np.arctan(-0.5 * main / half), np.arctan(main / half)  # about the resonance f = main + half tan(t)
    t = low + (high - low) * (node + 1) / 2
    variance += (weight * (high - low) / 2 * half / np.cos(t) ** 2) @ response(main + half * np.tan(t))
    assert reference.values["gondola_rms_open_loop"] == pytest.approx(1e3 * np.sqrt(variance), rel=1e-4)


def response(frequency):
    """Spectrum of the gondola of carlina.yaml on the continuous cable, the strain damped. [m^2/Hz]"""
    omega = 2 * np.pi * frequency
    stiffness = np.array([continuous_cable.dynamic_end_stiffness(*PAPER.cable, w, n=24, eta=ETA)[0, 0] for w in omega])
    speed, turbulence, length, area = 6.0, 0.15 * 6.0, 25.0, 0.6
    felt = 1 / (1 + (frequency * 2 * np.sqrt(area) / speed) ** (4 / 3))
    force = (1.2 * 1.17 * area * speed) ** 2 * felt * von_karman(frequency, speed, turbulence, length)
    return force / np.abs(stiffness - GONDOLA * omega**2) ** 2


@each_twin
def test_error_of_forty_bars_is_that_of_the_dense_chain(twin):
    stated = errors(twin.scene(), MOTION, "40 lumped bars")["40 lumped bars"]
    exact, discrete = continuous_cable.frequencies(*twin.cable, 8), in_plane(twin)
    stiffness = continuous_cable.static_end_stiffness(*twin.cable)[0, 0]
    assert stated["cable_frequency"] == pytest.approx(abs(discrete[0] / exact[0] - 1), rel=1e-5)
    assert stated["inplane_frequency_8"] == pytest.approx(abs(discrete[7] / exact[7] - 1), rel=1e-5)
    assert stated["end_stiffness"] == pytest.approx(abs(twin.chain().end_stiffness[0, 0] / stiffness - 1), rel=1e-3)


def test_the_catenary_is_exact_and_static():
    (entry,) = trade.compare(SAGGING.scene(), columns("sag", *MOTION), 0, named("catenary")).entries
    assert entry.errors == {"sag": STUDY.rounding, "end_stiffness": STUDY.rounding}
    assert entry.status == "cable_frequency, inplane_frequency_8: statics alone"
    assert entry.dof == 0


def test_irvine_is_his_formula():
    """Roots of his transcendental equation; strings for all others."""
    ratio = PAPER.chord / PAPER.length
    tension = float(np.mean(PAPER.chain(40).tensions))
    mass, stiffness = PAPER.mass / ratio, PAPER.stiffness * ratio  # of the stretched cable
    third = taut_string.irvine_frequencies(3, PAPER.chord, tension, mass, stiffness)[2]
    string = taut_string.string_frequencies(6, PAPER.chord, tension, mass)
    wanted = {
        "symmetric_frequency_3": third,
        "inplane_frequency_5": third,
        "inplane_frequency_6": string[5],
        "outofplane_frequency_3": string[2],
        "axial_frequency_2": taut_string.axial_frequencies(2, PAPER.length, PAPER.stiffness, PAPER.mass)[1],
    }
    row = named("Irvine")[0].solve(PAPER.scene(), columns(*wanted))
    assert row.failures == {}
    for name, value in wanted.items():
        assert row.cells[find(name).header] == pytest.approx(value, rel=1e-6), name  # the tension is that of 40 bars
    loaded = scene("cable.loads=[{at: 50 m, force: [0, 0, -1]}]")
    row = named("Irvine")[0].solve(loaded, columns("cable_frequency", "end_stiffness"))
    assert row.cells == {}
    assert "no point loads" in str(row.failures["cable_frequency_Hz"])


def test_modes_alone_have_the_stiffness_of_the_papers_truncation():
    found = errors(PAPER.scene(HYSTERETIC), ["end_stiffness", "gondola_frequency"], "(10|30|90) modes alone")
    exact = continuous_cable.static_end_stiffness(*PAPER.cable)[0, 0]
    K, _ = bars.matrices(PAPER.chain(), *PAPER.bar)
    modes = bars.modes(PAPER.chain(), *PAPER.bar)
    softening = modes.participation[:, 0] ** 2 / (2 * np.pi * modes.frequencies) ** 2
    for count in (10, 30, 90):
        stiffness = K[-3, -3] - softening[:count].sum()
        stated = found[f"{count} modes alone"]["end_stiffness"]
        assert stated == pytest.approx(abs(stiffness / exact - 1), rel=1e-6), count
        assert stated > 1


def test_residual_stiffness_pays():
    found = errors(PAPER.scene(HYSTERETIC), ["end_stiffness", "gondola_frequency"], r"(1|30|90) modes \+ residual")
    size = [found[f"{n} modes + residual"]["gondola_frequency"] for n in (1, 30, 90)]
    assert size[0] > 10 * size[1] > 100 * size[2]
    assert all(entry["end_stiffness"] < 1e-11 for entry in found.values())


def test_reduced_modes_say_nothing_of_the_loop_gain():
    damped = "cable.damping={model: kelvin_voigt, time: 1e-3, viscous: 0.02}"
    wanted, chosen = columns("largest_gain", "gondola_frequency"), named(r"3 modes \+ residual")
    found = trade.compare(scene(damped), wanted, 0, chosen)
    assert found.reference.errors["largest_gain"] < 1e-8
    assert [entry.status for entry in found.entries] == ["largest_gain: not by reduced modes"]


def test_trapezoids_are_trapezoids():
    """On the continuous cable, point by point."""
    case = case_module.CableCase(trade_models.with_accuracy(PAPER.scene(HYSTERETIC), 1e-10))
    frequency = np.geomspace(0.05, 5, 25)
    found, _ = trade_models.by_trapezoids(case, frequency).analysis.rms(["gondola.x"], "value", open_loop=True)
    assert found == pytest.approx(np.sqrt(trapezoid(response(frequency), frequency)), rel=1e-8)


def test_grids_converge_to_the_reference_and_a_sum_over_poles_needs_none():
    found = errors(PAPER.scene(HYSTERETIC), ["gondola_rms_open_loop"], "log .*", "uniform .*", "sum over poles")
    size = {name: value["gondola_rms_open_loop"] for name, value in found.items()}
    for kind in ("log", "uniform"):
        assert size[f"{kind} 100 points"] > 0.1
        assert size[f"{kind} 100 points"] > size[f"{kind} 1000 points"] > size[f"{kind} 10000 points"]
        assert size[f"{kind} 10000 points"] < 1e-4
    assert size["sum over poles"] < 1e-6


def test_error_control_holds_what_it_says():
    found = trade.compare(SAGGING.scene(), columns(*MOTION), 0, named("accuracy .*", "40 lumped bars")).entries
    assert len(found) == 6
    for entry in found[:-1]:
        assert max(entry.errors.values()) <= float(entry.name.split()[1])
        assert entry.errors.keys() == entry.stated.keys()
        assert all(error <= 10 * entry.stated[name] for name, error in entry.errors.items())
        assert entry.largest_stated == max(entry.stated.values()) <= float(entry.name.split()[1])
    assert (found[-1].stated, found[-1].largest_stated) == ({}, None)


@pytest.mark.parametrize(
    ("value", "truth", "error"),
    [(1.1, 1.0, 0.1), (-1.0, 1.0, 2.0), (0.0, 0.0, 0.0), (1e-9, 0.0, 1.0), (None, None, 0.0), (None, 1.0, 1.0)],
)
def test_errors_are_relative_and_a_zero_is_right_or_wrong(value, truth, error):
    assert relative(value, truth) == pytest.approx(error)


def test_front_by_brute_force():
    random = np.random.default_rng(3)
    for size in (0, 1, 2, 5, 40):
        for _ in range(40):
            points = list(map(tuple, random.integers(1, 9, (size, 2)).astype(float)))  # with ties
            best = {
                str(i) for i, p in enumerate(points)
                if not any(q[0] <= p[0] and q[1] <= p[1] and q != p for q in points)
            }  # fmt: skip
            entries = [Mock(time=time, largest=error) for time, error in points]
            for place, entry in enumerate(entries):
                entry.name = str(place)
            assert trade.Trade([], None, entries).front == best


def test_only_models_with_every_column_are_on_the_front():
    def stating(**values):
        def compute(column, _):
            if column.name not in values:
                raise NoSolutionError("no")
            return values[column.name], None

        return ComparedModel("", f"{sorted(values.items())}", lambda *_: 0, compute=compute, count_dof=int)

    models = [stating(sag=1.0), stating(sag=0.121, end_stiffness=1000.0)]
    found = trade.compare(PAPER.scene(), columns("sag", "end_stiffness"), 1, models)
    assert found.front == {models[1].name}
    assert [entry.largest is None for entry in found.entries] == [True, False]
    assert [entry.name for entry in found.front_of(find("end_stiffness"))] == [models[1].name]


def test_every_timing_solves_the_statics_anew(monkeypatch):
    calls = []
    solve = results.solve
    reference = trade.reference_of(PAPER.scene(), columns(*MOTION[:2]))
    monkeypatch.setattr(trade, "reference_of", lambda *_: reference)
    for name in ("timing_budget", "brief_run"):
        monkeypatch.setattr(type(STUDY), name, 60.0)
    monkeypatch.setattr(results, "solve", lambda span: calls.append(1) or solve(span))
    trade.compare(PAPER.scene(), columns(*MOTION[:2]), 3, named("1 x order 8"))
    # once for the answer; then three times: once untimed, both columns together, and each alone
    assert len(calls) == 1 + 3 * 4


def test_a_slow_model_is_not_repeated():
    solve = Mock()
    model = ComparedModel("", "slow", solve, compute=lambda *_: (1.0, None))
    (entry,) = trade.compare(PAPER.scene(), columns("sag"), 50, [model]).entries
    assert solve.call_count == 1
    assert entry.time > 0


def test_the_times_of_all_columns_count_together(monkeypatch):
    clock, solve = iter(0.2 * np.arange(1000)), Mock()  # each run takes 0.2 s
    monkeypatch.setattr(trade.time, "process_time", lambda: next(clock))
    monkeypatch.setattr(type(STUDY), "timing_budget", 0.5)
    model = ComparedModel("", "slow", solve, compute=lambda *_: (1.0, None))
    trade.compare(PAPER.scene(), columns("sag", "end_stiffness"), 50, [model])
    assert solve.call_count == 4  # for the answer, both columns together, and each alone: 0.6 s


def test_a_model_that_fails_is_a_row():
    wanted = columns("cable_frequency", "inplane_frequency_8")
    found = trade.compare(scene(), wanted, 1, named("5 .* bars", "10 .* bars"))
    rows = {row["model"]: row for row in trade.table_of(found).rows}
    row = rows["5 lumped bars"]
    assert row["status"] == "inplane_frequency_8: the model has 4 in-plane modes, not 8"
    assert row["cable_frequency_error"] > 0
    assert (row.get("inplane_frequency_8_error"), row["largest_error"], row["pareto"]) == (None, None, "no")
    assert rows["10 lumped bars"]["status"] == "ok"
    loads = ", ".join(f"{{at: {10 * k} m, force: [0, 0, -1]}}" for k in range(1, 8))
    loaded = trade.compare(scene(f"cable.loads=[{loads}]"), columns("sag"), 1, named("5 lumped bars", "1 x order 8"))
    assert "7 point loads need at least 8 elements, got 5" in loaded.entries[0].status
    assert (loaded.entries[0].time, loaded.entries[0].dof) == (None, None)
    assert loaded.entries[1].status == "ok"


def test_a_sharp_bend_fails_bar_by_bar_at_most():
    """The cable hangs almost folded: some models have no answer, the others stand."""
    sharp = scene("cable.ends=[[0, 0, 0], [0.06 m, 0, 0]]", "cable.unstretched_length=10 m", "model={accuracy: 1e-4}")
    found = trade.compare(sharp, columns("end_stiffness"), 0)
    assert found.entries[0].errors == {"end_stiffness": STUDY.rounding}
    assert len(found.entries) == len(trade.models_of(scene(), columns("end_stiffness")))
    for entry in found.entries:
        assert (entry.status == "ok") == ("end_stiffness" in entry.errors)


def test_no_answer_at_all():
    with pytest.raises(NoSolutionError, match="below the least that this cable can have"):
        trade.compare(scene("cable.preload=1 N"), columns("sag"))
    with pytest.raises(ConvergenceError, match="modal damping"):
        trade.compare(scene(), columns("gondola_rms"))


def test_a_stress_above_the_strength_is_told():
    """EA (185.8/170 - 1) over the area; the errors of the models are there."""
    options = ("--columns", "sag", "--repeats", 1, "--set", "cable.unstretched_length=170 m")
    outcome = run("trade", CARLINA, *options, "--format", "json")
    stress = 70.3e3 * (185.8 / 170 - 1)  # MPa
    assert outcome.lines == [f"warning: the stress of {stress:.4g} MPa is above the strength of 3000 MPa"]
    assert all(row["sag_error"] is not None for row in rows_of(outcome.out, "json"))


def test_a_narrow_terminal_shows_time_and_largest_error_of_each_model():
    models = named("catenary", "40 lumped bars", "20 lumped bars", "accuracy 1e-[246]")
    found = trade.compare(scene(), columns("end_stiffness", "cable_frequency"), 1, models)
    text, left_out = fitted(trade.table_of(found, for_markdown=True), 80)
    heads = [" ".join(name.split()[:1]) for name in text.partition("\n")[0].split("|")]
    assert {"family", "model", "time", "largest"} <= set(heads)
    assert {"end_stiffness_error", "cable_frequency_error"} <= set(left_out)


def test_small_errors_drown_in_the_reference():
    found = trade.compare(scene(), columns("end_stiffness"), 1, named("catenary", "40 lumped bars"))
    plain, shown = trade.table_of(found), trade.table_of(found, for_markdown=True)
    assert [row["end_stiffness_error"] for row in plain.rows[:2]] == [1e-12, 1e-12]
    assert [row["end_stiffness_error"] for row in shown.rows[:2]] == ["< 1e-12", "< 1e-12"]
    assert re.fullmatch(r"\d\.\de-07", shown.rows[2]["end_stiffness_error"])
    assert [row["family"] for row in plain.rows] == ["reference", "closed form", "lumped bars"]


def test_rows_in_json():
    outcome = run("trade", CARLINA, "--columns", "sag,end_stiffness_N_per_m", "--repeats", 1, "--format", "json")
    rows = rows_of(outcome.out, "json")
    assert outcome.err == ""
    assert rows[0]["model"] == "continuous cable"
    assert {row["family"] for row in rows[1:]} == {model.family for model in trade.models_of(scene(), columns("sag"))}
    assert all(row["time_ms"] > 0 and row["pareto"] in ("yes", "no") for row in rows[1:])
    assert {"model", "dof", "time_ms", "sag_error", "sag_time_ms", "largest_error", "pareto", "status"} < set(rows[0])


def test_defaults_are_what_the_scene_has_keys_for():
    for sets, count, note in (
        ([HYSTERETIC], None, None),
        ([], 4, "gondola_rms_open_loop: modal damping"),
        (["gondola=null"], 3, "left out: gondola_frequency: needs the key gondola.mass"),
    ):
        found, notes = trade.columns_to_compare(*load_scene(CARLINA, sets))
        assert [column.name for column in found] == list(DEFAULT[:count])
        assert note in notes[0] if note else notes == []


@pytest.mark.parametrize(
    ("names", "message", "sets"),
    [
        ("sagg", "--columns: unknown column 'sagg' (did you mean sag?)", []),
        ("sag,", "--columns: names separated by commas, e.g. end_stiffness,cable_frequency", []),
        ("sag,sag_m", "--columns: sag is listed twice", []),
        ("dof", "--columns: dof does not depend on the model", []),
        ("chord", "--columns: chord does not depend on the model", []),
        ("deflection", f"{CARLINA}:3:3: cable.loads: missing key: 'cablestudy trade' needs it", []),
        ("gondola_rms_open_loop", "--set gondola.area: missing key: 'cablestudy trade' needs it",
         ["--set", "gondola.area=null"]),
    ],
)  # fmt: skip
def test_mistakes_in_columns_are_told_and_nothing_is_written(folder, names, message, sets):
    assert refusal("trade", CARLINA, "--out", "tables", "--columns", names, *sets) == message
    assert not list(folder.iterdir())


def test_a_column_without_truth_leaves_the_others():
    outcome = run("trade", CARLINA, "--columns", "sag,gondola_rms", "--repeats", 1, "--format", "csv", code=3)
    reason = "modal damping grows with the number of modes: take hysteretic or kelvin_voigt"
    assert outcome.lines == [f"{CARLINA}: gondola_rms: {reason}"]
    assert "sag_error" in outcome.out
    assert "gondola_rms" not in outcome.out


def test_files_and_picture(tmp_path):
    place, picture = tmp_path / "tables", tmp_path / "trade.svg"
    outcome = run("trade", SLACK, "--columns", "sag", "--repeats", 1, "--out", place, "--plot", picture, "--explain",
                  "--set", "cable.area=20 mm^2", "--format", "csv")  # fmt: skip
    assert sorted(path.name for path in place.iterdir()) == ["trade-slack.csv", "trade-slack.md"]
    assert (place / "trade-slack.csv").read_text(encoding="utf-8") == outcome.out
    text = (place / "trade-slack.md").read_text(encoding="utf-8")
    assert text.startswith(f"# Error against time: {SLACK} --set 'cable.area=20 mm^2'\n")
    assert "## The fastest model below an error" in text
    assert picture.read_bytes().startswith(b"<?xml")
    assert "reference: sag " in outcome.err
    assert "one thread" in outcome.err
    assert "fastest below 1e-10: sag: " in outcome.err
    assert trade.file_name("configs/slack.yaml") == "trade-slack.yaml"
    assert trade.file_name("-") == "trade-stdin"
    assert run("trade", SLACK, "--columns", "sag", "--out", picture, code=2).lines[0].startswith("--out")
    assert run("trade", "-", "--columns", "sag", "--repeats", 1, "--quiet", stdin=Path(CARLINA).read_text()).err == ""


def test_picture_shows_every_model_and_the_front():
    wanted = columns("end_stiffness", "cable_frequency", "gondola_frequency")
    models = named("(5|10) .* bars", "1 x order (8|16)", "[13] modes .*", "Irvine", "catenary", "accuracy 1e-4")
    found = trade.compare(scene(), wanted, 1, models)
    figure = plots.trade_plot(found, "title")
    figure.draw_without_rendering()

    def points(entries, column):
        return [(1e3 * e.times[column.name], e.errors[column.name]) for e in entries]

    for axes, column in zip(figure.axes, wanted, strict=False):
        assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
        lines = {line.get_label(): line for line in axes.lines}
        drawn = np.concatenate([lines[e].get_xydata() for e in lines if e in plots.trade.LOOK])
        known = points([e for e in found.entries if column.name in e.times], column)
        np.testing.assert_allclose(sorted(map(tuple, drawn)), sorted(known))
        front = points(found.front_of(column), column)
        np.testing.assert_allclose(lines["Pareto front"].get_xydata()[1:-1], front)
    families = {entry.family for entry in found.entries if entry.times}
    (legend,) = figure.legends
    assert len(families) > 3
    assert len(legend.get_texts()) == len(families)


def test_a_picture_of_a_single_model_has_more_than_one_time_along_its_axis():
    found = trade.compare(scene(), columns("end_stiffness"), 1, named("catenary"))
    axes = plots.trade_plot(found, "title").axes[0]
    low, high = axes.get_xlim()
    assert sum(low <= tick <= high for tick in axes.get_xticks()) > 1


STORED = [("carlina", 25), ("fast", 19), ("slack", 25)]


@pytest.mark.parametrize(("name", "count"), campaign(STORED, STORED[:2]))
def test_stored_errors_are_the_computed_ones(name, count):
    stored = {row["model"]: row for row in stored_table(RESULTS / f"trade-{name}.csv")}
    title = (RESULTS / f"trade-{name}.md").read_text(encoding="utf-8").splitlines()[0]
    path, *sets = shlex.split(title.removeprefix("# Error against time: "))
    document, model = load_scene(CONFIGS.parent / path, [word for word in sets if word != "--set"])
    wanted, _ = trade.columns_to_compare(document, model)
    true = [key for key in stored["catenary"] if key.endswith("_error") and not key.endswith("_stated_error")]
    assert true == [*(f"{column.name}_error" for column in wanted), "largest_error"]
    models = trade.models_of(model, wanted)
    assert list(stored) == [trade.CONTINUOUS, *(one.name for one in models)]
    cheap = matching(models, "catenary", "Irvine", "static .*", "(5|10|20|40) .* bars", "1 x order.*", "(1|10) modes.*",
                     ".* 1000 points")  # fmt: skip
    assert len(cheap) == count
    found = trade.compare(model, wanted, 0, cheap)
    for column in wanted:
        assert stored[trade.CONTINUOUS][f"{column.name}_error"] < 1e-9
    for entry in found.entries:
        row = stored[entry.name]
        assert row["status"] == entry.status
        for column in wanted:
            now, then = entry.errors.get(column.name), row[f"{column.name}_error"]
            assert (now is None) == (then is None)
            # the error of the reference, below 1e-9, is in each: the change between two models, which is next to
            # rounding and differs from one processor to another
            assert now is None or now == pytest.approx(then, rel=0.01, abs=1e-9), (entry.name, column.name)
