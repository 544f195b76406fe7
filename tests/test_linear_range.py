"""How far motion is linear, and what is told where it goes beyond: closed forms, statics at moved ends, commands."""

from types import SimpleNamespace

import numpy as np
import pytest
from command import CARLINA, run, study_file
from mpmath import mp
from references import catenary_mp
from scenes import case_of as case_of_one_cable
from scenes import cells, scene
from scipy.optimize import brentq
from solved import solve, solve_all
from straight_scenes import one_axis, with_changes
from suspension_cases import case_of, value
from test_seen_motion import probability_of_a_level
from test_suspension_wind import hung

from cablestudy.cable import catenary
from cablestudy.cable.linear_range import linear_range
from cablestudy.cable.span import Span
from cablestudy.motion import peaks
from cablestudy.study.table_rows import has_answer, status_of


def test_a_body_between_two_straight_cables_across_them():
    """F = 2 EA (l/l0 - 1) y/l of two cables of 20 m that are strained by one nineteenth."""

    def restoring(y):
        length = np.hypot(20.0, y)
        return 2 * 1e5 * (length / 19.0 - 1) * y / length

    stiffness = 2 * 1e5 * (20.0 / 19.0 - 1) / 20.0
    expected = brentq(lambda y: restoring(y) / (stiffness * y) - 1.05, 1e-3, 10.0)
    span = Span.between(np.zeros((2, 3)), np.array([[20.0, 0, 0], [-20.0, 0, 0]]), 1e5, 1e-9, 0.0, np.array([19.0, 19]))
    moves = np.array([[[0.0, 0, 0], [0, 0, 1]]] * 2)
    assert linear_range(catenary.solve(span), moves)[0] == pytest.approx(expected, rel=1e-6)
    text = one_axis(("x", "y", "z"))
    for side, cable in zip((-20.0, 20.0), text["cables"].values(), strict=True):
        cable |= {"from": [side, 0.0, 0.0], "unstretched_length": 19.0}
    case = case_of(text)
    for axis in "yz":
        assert value(case, f"gondola.linear_range_{axis}") == pytest.approx(1e3 * expected, rel=1e-4)
    # along the cables it is linear until one is slack, at 1 m
    assert value(case, "gondola.linear_range_x") == pytest.approx(1e3, rel=0.06)


def test_a_place_that_no_cable_moves_has_no_limit():
    span = Span.between(np.zeros((1, 3)), np.array([[20.0, 0, 0]]), 1e5, 0.1, 9.81, np.array([19.9]))
    assert linear_range(catenary.solve(span), np.zeros((1, 2, 3)))[0] is None


@pytest.mark.parametrize(("end", "length"), [((185.8, 0.0), 184.488), ((180.0, 40.0), 184.9)])
def test_the_linear_range_of_a_gondola_is_that_of_reactions_at_moved_ends(end, length):
    """The horizontal reaction of the same cable at the moved end has changed by 5 % more or less than linearly."""

    def found(moved, *names):
        own = [f"cable.ends=[[0, 0, 0], [{end[0] + moved!r}, 0, {end[1]}]]", f"cable.unstretched_length={length}"]
        return cells(scene(*own, "model={accuracy: 1e-6}"), *names)

    rest = found(0.0, "reaction_2_horizontal", "end_stiffness", "linear_range")
    reach, shares = rest["linear_range"] / 1e3, []
    for moved in (-reach, reach):
        there = found(moved, "reaction_2_horizontal")["reaction_2_horizontal"]
        shares.append((there - rest["reaction_2_horizontal"]) / (moved * rest["end_stiffness"]))
    assert max(abs(share - 1) for share in shares) == pytest.approx(0.05, rel=1e-4), (reach, shares)


@pytest.mark.parametrize(("rise", "length", "section"), [
    (0.0, 184.4883, 2.69e-6), (0.0, 186.0, 24.2e-6), (30.0, 200.0, 24.2e-6), (0.0, 185.8 * (1 - 5.4e-6), 2.69e-6),
])  # fmt: skip
def test_the_linear_range_is_within_its_stated_error(rise, length, section):
    """At the movement that is found, and at those that its error allows, by the 50-digit catenary."""
    own = {"ends": f"[[0, 0, 0], [185.8, 0, {rise}]]", "unstretched_length": repr(length), "area": section}
    row = solve(scene(*(f"cable.{key}={value}" for key, value in own.items()), "model=null"), "linear_range")
    found, error = row.values["linear_range"] / 1e3, row.errors["linear_range"]
    cable = 70.3e9 * section, 1440 * section * mp.mpf("9.81")

    def pull(movement):
        return catenary_mp.solve_loaded((mp.mpf("185.8") + movement, 0, mp.mpf(rise)), mp.mpf(length), *cable, ())[0]

    with mp.workdps(50):
        small = mp.mpf(10) ** -15
        rest, stiffness = pull(0), (pull(small) - pull(-small)) / (2 * small)

        def beyond(movement):
            return max(abs((pull(x) - rest) / (stiffness * x) - 1) - mp.mpf("0.05") for x in (movement, -movement))

        assert beyond(mp.mpf(found) * (1 - mp.mpf(error))) < 0 < beyond(mp.mpf(found) * (1 + mp.mpf(error)))


def test_the_linear_range_with_elements_in_a_steady_wind_is_that_of_the_cable():
    wind = "cases.storm={wind: {speed: 30, direction: 90 deg}}"
    own, of_elements = (cells(scene(wind, "case=storm", model), "linear_range")
                        for model in ("model={accuracy: 1e-6}", "model={elements: 10}"))  # fmt: skip
    assert own["linear_range"] == of_elements["linear_range"] > 0


def test_a_gondola_in_a_storm_slackens_its_cable_and_the_row_says_so():
    """The mean wind moves it by rho/2 C_d A v^2/k; the tension changes with the displacement by the end stiffness."""
    names = ("gondola_rms_open_loop", "peak", "peak_utilisation", "utilisation", "end_stiffness", "max_tension")
    calm, stormy = (solve(scene(f"wind.speed={speed} m/s"), *names) for speed in (6, 80))
    assert calm.status == "ok"
    assert stormy.status == "a cable goes slack in the wind"
    for found in (calm.values, stormy.values):
        breaking = found["max_tension"] / found["utilisation"]
        more = found["end_stiffness"] * found["peak"] / 1e3  # the cable lies nearly along x
        assert found["peak_utilisation"] == pytest.approx((found["max_tension"] + more) / breaking, rel=1e-3)
        assert (more < found["max_tension"]) == (found is calm.values)


@pytest.mark.parametrize(("end", "length", "loads"), [
    ((48.1, 179.5), 371.6, ()), ((175.68, 60.49), 186.0, ((60.0, 0.0, 400.0), (120.0, 0.0, -30.0))),
])  # fmt: skip
def test_the_largest_tension_at_the_peak_is_that_of_one_place(end, length, loads):
    """Sums of tension and its change at each end and on both sides of each load, by the 50-digit catenary."""
    sets = [f"cable.ends=[[0, 0, 0], [{end[0]}, 0, {end[1]}]]", f"cable.unstretched_length={length}", "model=null",
            "cable.loads=" + str([{"at": at, "force": [x, 0, z]} for at, x, z in loads]), "wind.speed=20",
            "cable.damping={model: hysteretic, loss_factor: 0.02, viscous: 0.02}", "winch=null"]  # fmt: skip
    row = solve(scene(*sets), "peak", "peak_utilisation")
    area, peak = mp.mpf("2.69e-6"), row.values["peak"] / 1e3
    weight, small = 1440 * area * mp.mpf("9.81"), mp.mpf(10) ** -15
    points = [(mp.mpf(at), (mp.mpf(x), 0, mp.mpf(z))) for at, x, z in loads]

    def at_end_1(moved):
        place = (mp.mpf(str(end[0])) + moved, 0, mp.mpf(str(end[1])))
        return mp.matrix(catenary_mp.solve_loaded(place, mp.mpf(str(length)), mp.mpf("70.3e9") * area, weight, points))

    with mp.workdps(50):
        force, change = at_end_1(0), (at_end_1(small) - at_end_1(-small)) / (2 * small)
        places, reached = [force], mp.mpf(0)
        for at, load in [*points, (mp.mpf(str(length)), (0, 0, 0))]:
            force = force + mp.matrix([0, 0, weight * (at - reached)])
            places += [force, force - mp.matrix(load)]
            force, reached = places[-1], at
        tensions = [mp.norm(one) for one in places]
        changes = [abs((one.T * change)[0]) / mp.norm(one) * peak for one in places]
        sums = [tension + more for tension, more in zip(tensions, changes, strict=True)]
    expected = float(max(sums) / (3e9 * area))
    assert row.values["peak_utilisation"] == pytest.approx(expected, rel=1e-11)
    apart = float((max(tensions) + max(changes)) / max(sums))
    assert apart > 1 + 1e-6  # largest tension and largest change are at different places


def test_the_error_of_a_peak_utilisation_is_that_of_the_peak_by_its_share():
    sets = "model.accuracy=1e-2", "cable.damping={loss_factor: 0.01, viscous: 0.01}", "winch.controller.gain=0.03"
    row = solve(scene(*sets), "peak", "peak_utilisation", "utilisation")
    share = 1 - row.values["utilisation"] / row.values["peak_utilisation"]
    assert row.errors["peak_utilisation"] == pytest.approx(share * row.errors["peak"], rel=1e-6)
    assert row.errors["peak"] > 1e-6


@pytest.mark.parametrize("speed", [14, 18, 22])
def test_the_probability_that_a_cable_goes_slack_at_its_gondola(speed):
    """Tensions at the ends and their rates with the gondola's place, by the 50-digit catenary."""
    sets = [f"wind.speed={speed}", "cable.damping={model: kelvin_voigt, time: 1e-3}", "winch.controller.gain=0.01"]
    names = "gondola_rms", "gondola_rms_velocity", "mean_displacement", "slack_probability", "unstretched_length"
    base = scene(*sets, "model.accuracy=1e-4")
    row = solve(base, *names)
    found = row.values
    (x, _, z), length = base.cable.end_2, mp.mpf(found["unstretched_length"])
    area, small = mp.mpf("2.69e-6"), mp.mpf(10) ** -15
    stiffness, weight = mp.mpf("70.3e9") * area, 1440 * area * mp.mpf("9.81")

    def forces(moved):
        at_1 = mp.matrix(catenary_mp.solve_loaded((x + moved, 0, mp.mpf(z)), length, stiffness, weight, []))
        return at_1, at_1 + mp.matrix([0, 0, weight * length])

    with mp.workdps(50):
        ends, others = forces(0), list(zip(forces(small), forces(-small), strict=True))
        rates = [(mp.norm(plus) - mp.norm(minus)) / (2 * small) for plus, minus in others]
        distance = min(mp.norm(end) / abs(rate) for end, rate in zip(ends, rates, strict=True))
        rms, velocity = found["gondola_rms"] / 1e3, found["gondola_rms_velocity"] / 1e3
        level = (distance - found["mean_displacement"] / 1e3) / rms
        expected = probability_of_a_level(level, velocity / (2 * np.pi * rms) * base.wind.duration)
    assert found["slack_probability"] == pytest.approx(expected, rel=1e-7)
    assert 1e-16 < expected < 1
    # an error of the RMS counts times the square of the level
    assert row.errors["slack_probability"] > float(level) ** 2 * row.errors["gondola_rms"] * (1 - expected)


@pytest.mark.parametrize("speed", [10, 11, 12])
def test_the_tension_of_a_cable_with_fixed_ends_in_gusts(speed):
    """Mean tensions by the 50-digit catenary; RMS of tension and its rate at each end, in both winds; Davenport."""
    bare = "gondola=null", "winch=null", f"wind.speed={speed}", "cable.damping={loss_factor: 0.02, viscous: 0.01}"
    case = case_of_one_cable(*bare, "cable.unstretched_length=185.9 m", "model={accuracy: 1e-4}")
    (x, _, z), length = case.scene.cable.end_2, mp.mpf("185.9")
    stiffness, weight = mp.mpf("70.3e9") * mp.mpf("2.69e-6"), 1440 * mp.mpf("2.69e-6") * mp.mpf("9.81")
    with mp.workdps(50):
        horizontal, vertical = catenary_mp.solve(x, z, length, stiffness, weight)
        ends = [float(mp.sqrt(horizontal**2 + part**2)) for part in (vertical, vertical + weight * length)]
    probabilities, least, largest = [], [], []
    for wind in case.in_cable_wind.analyses:
        for mean, end in zip(ends, ("cable.tension_from", "cable.tension_to"), strict=True):
            rms, rate = (wind.rms([end], kind, open_loop=True)[0] for kind in ("value", "rate"))
            crossings = rate / (2 * np.pi * rms) * case.scene.wind.duration
            probabilities.append(probability_of_a_level(mean / rms, crossings))
            mode = np.sqrt(2 * np.log(crossings))
            change = (mode + np.euler_gamma / mode) * rms
            least.append(mean - change)
            largest.append(mean + change)
    names = "least_tension", "peak_utilisation"
    twins = [f"cable.{name}" for name in names]
    row = solve(case.scene, "slack_probability", "cable.slack_probability", *names, *twins, "max_peak_utilisation")
    found = row.values["slack_probability"]
    assert [row.values[name] for name in names] == [row.values[name] for name in twins]
    assert row.values["least_tension"] == pytest.approx(min(least), abs=3e-3 * (max(ends) - min(least)))
    assert row.values["peak_utilisation"] * 3e9 * 2.69e-6 == pytest.approx(max(largest), rel=1e-3)
    assert row.values["max_peak_utilisation"] == row.values["peak_utilisation"]
    assert (row.status == "ok") == (row.values["least_tension"] > 0)
    assert found == row.values["cable.slack_probability"]
    # the program takes more modes, until the RMS is as accurate as asked for, and the rate is larger by these
    assert found == pytest.approx(max(probabilities), rel=min(1e-2, row.errors["slack_probability"]))
    assert 1e-16 < max(probabilities) < 1


def test_the_probability_to_go_slack_names_a_key_that_the_gondola_lacks():
    row = solve(scene("gondola.area=null"), "slack_probability", "sag")
    assert row.status == "slack_probability needs the key gondola.area, which this case does not have"


def test_rows_without_the_wind_or_the_strength_that_others_have():
    """Of a cable with fixed ends made of bars, and of a suspension."""
    bare = scene("gondola=null", "winch=null", "model={elements: 9}")
    rows = solve_all([bare, bare.model_copy(update={"wind": None})], ["tension_rms", "sag"])
    assert [row.status for row in rows] == ["ok", "tension_rms needs the key wind, which this case does not have"]
    assert all(row.values["sag"] > 0 for row in rows)
    text = hung(1) | {"wind": hung(1)["wind"] | {"length_scale": 25.0, "turbulence_intensity": 0.15}}
    strong = text | {"cable": text["cable"] | {"strength": 1.5e9}}
    rows = solve_all([strong, text], ["max_peak_utilisation"])
    assert rows[0].status == "ok"
    assert rows[1].status.startswith("max_peak_utilisation needs the strength or breaking_force of a cable")


def test_windrms_warns_of_a_slack_cable_and_of_motion_beyond_the_linear_range():
    stormy = run("windrms", CARLINA, "--set", "wind.speed=80 m/s")
    assert "warning: a cable goes slack in the wind" in stormy.err
    assert "beyond the range of linear motion: gondola (peak" in stormy.err
    calm = run("windrms", CARLINA)
    assert "slack" not in calm.err
    assert "linear motion" not in calm.err


def test_a_suspension_names_the_cables_that_go_slack():
    text = hung(1)
    text["wind"] |= {"length_scale": 25.0, "turbulence_intensity": 0.15, "coherence_decay": 10.0}
    text["cable"]["strength"] = 1.5e9
    stormy = with_changes(text, wind__speed=60.0)
    cases = [case_of(one) for one in (text, stormy)]
    names = "c0.peak_utilisation", "c0.utilisation", "max_peak_utilisation", "b.rms"
    rows = solve_all([case.scene for case in cases], names)
    for case, row in zip(cases, rows, strict=True):
        slack = [name for name in text["cables"] if value(case, f"{name}.least_tension") < 0]
        words = f"a cable goes slack in the wind: {', '.join(slack)}" if slack else "ok"
        assert row.status == words
        each = [value(case, f"{name}.peak_utilisation") for name in text["cables"]]
        assert row.values["max_peak_utilisation"] == max(each)
        means = case.analysis.mean_tensions("c0")
        drop = min(means) - value(case, "c0.least_tension")
        assert each[0] * 1.5e9 * 1.5e-5 == pytest.approx(max(means) + drop, rel=0.02)
    assert rows[0].status == "ok" != rows[1].status


def test_the_probability_that_a_cable_of_a_suspension_goes_slack():
    text = hung(1)
    text["wind"] |= {"length_scale": 25.0, "turbulence_intensity": 0.15, "coherence_decay": 10.0}
    case = case_of(with_changes(text, wind__speed=45.0))
    for name in text["cables"]:
        ends = []
        for mean, end in zip(case.analysis.mean_tensions(name), ("tension_from", "tension_to"), strict=True):
            rms, rate = (case.analysis.rms([f"{name}.{end}"], kind, open_loop=False)[0] for kind in ("value", "rate"))
            crossings = rate / (2 * np.pi * rms) * case.scene.wind.duration
            ends.append(probability_of_a_level(mean / rms, crossings))
        assert value(case, f"{name}.slack_probability") == pytest.approx(max(ends), rel=1e-9)
        assert max(ends) > 0


def test_a_doubt_is_an_answer_and_comes_last():
    slack = "a cable goes slack in the wind: u3"
    assert status_of({}, "", slack) == slack
    assert status_of({}, "over strength: u1", slack) == f"over strength: u1; {slack}"
    assert has_answer(slack)
    assert has_answer(f"over strength; {slack}")
    assert not has_answer(f"no equilibrium; {slack}")


def test_a_sweep_keeps_rows_with_slack_cables(tmp_path):
    study = study_file(tmp_path, "vary: [{wind.speed: [6 m/s, 80 m/s]}]\ncolumns: [gondola_rms_open_loop]\n")
    assert "a cable goes slack in the wind in 1 of 2 rows: 2" in run("sweep", study, "--out", tmp_path).err


def test_a_cable_with_fixed_ends_goes_slack_in_a_storm():
    """As soon as its least tension is below zero, and that less than Davenport's factor for a second and an hour."""
    names = "tension_rms", "tension_1", "tension_2", "least_tension"
    for speed in (5, 60):
        sets = [
            "gondola=null", "winch=null", f"wind.speed={speed} m/s", "wind.duration=600 s", "model={accuracy: 1e-4}",
            "cable.damping={model: kelvin_voigt, time: 0.1 ms, viscous: 0.01}", "cable.unstretched_length=186.5 m",
        ]  # fmt: skip
        row = solve(scene(*sets), *names)
        drop = min(row.values["tension_1"], row.values["tension_2"]) - row.values["least_tension"]
        assert 2.2 < drop / row.values["tension_rms"] < 5.0
        assert row.status == ("a cable goes slack in the wind" if row.values["least_tension"] < 0 else "ok")
        assert (row.status != "ok") == (speed == 60), (drop, row)


def test_the_error_of_a_probability_near_one_counts_that_it_may_be_smaller(monkeypatch):
    """An RMS known to 2 % and a rate known to a tenth, by the formula for both bounds."""
    monkeypatch.setattr(peaks, "_rms_and_crossings", lambda *_: (1.0, 0.02, 0.2, 0.1))
    analysis = SimpleNamespace(scene=SimpleNamespace(wind=SimpleNamespace(duration=50.0)))
    found, error = peaks.probability_of_change(analysis, ["x"], 0.5)
    likely, most, least = (
        float(probability_of_a_level(0.5 * level, 10.0 * rate))
        for level, rate in ((1, 1), (0.98, 1.1), (1.02, 1 / 1.1))
    )
    assert found == pytest.approx(likely, rel=1e-12)
    assert error == pytest.approx((likely - least) / likely, rel=1e-9)
    assert likely - least > 1.5 * (most - likely) > 0
