"""Samples of a study: the points, the cases they give, and every mistake at its place."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from command import python, run, study_file

from cablestudy.errors import SceneError
from cablestudy.scene.sampling import Sample
from cablestudy.scene.study import read_study
from cablestudy.study.prepare import check_cases

OVER = "{cable.preload: {from: 100 N, to: 2 kN, spacing: log}, gondola.mass: {from: 10 kg, to: 50 kg}}"
COLUMNS = "columns: [mass, sag]\n"


pytestmark = pytest.mark.usefixtures("folder")


METHODS = ["sobol", "latin_hypercube", "saltelli"]


def sample(method, count, seed=0, keys=3):
    return Sample(method=method, count=count, seed=seed, over={f"k.{i}": {} for i in range(keys)})


def study_of(text, vary=()):
    return read_study(study_file(".", text), vary=vary)


def sampled(method="sobol", count=8, more=""):
    return study_of(f"{COLUMNS}sample: {{method: {method}, count: {count}{more}, over: {OVER}}}\n")


def number(text):
    return float(text.split()[0])


@pytest.mark.parametrize("method", METHODS)
def test_every_stratum_of_every_coordinate_has_one_point(method):
    points = sample(method, 64).points()
    assert points.shape == (64, 6 if method == "saltelli" else 3)
    for column in points.T:
        assert sorted(np.floor(64 * column)) == list(range(64))


def test_sobol_points_fill_the_plane_evenly():
    points = sample("sobol", 64, keys=2).points()
    for columns in range(7):  # boxes of 1/2^i by 2^i/64 hold one point each: a (0, 6, 2)-net
        boxes = np.floor(points * [2**columns, 64 / 2**columns])
        assert len({tuple(box) for box in boxes}) == 64


def test_a_seed_tells_the_points():
    """Also in another process."""
    script = f"""
from cablestudy.scene.sampling import Sample
for method in {METHODS}:
    print(*Sample(method=method, count=32, seed=3, over=dict.fromkeys("abc", {{}})).points().ravel().tolist())
"""
    for method, line in zip(METHODS, python(script).splitlines(), strict=True):
        first = sample(method, 32, seed=3).points().copy()
        assert [float(text) for text in line.split()] == first.ravel().tolist()
        assert not np.array_equal(sample(method, 32, seed=4).points(), first)


@pytest.mark.parametrize("method", ["sobol", "saltelli"])
def test_a_larger_count_keeps_the_cases_there_are(method):
    small, large = sampled(method, 8), sampled(method, 32)
    assert [large.overrides(i) for i in range(small.count)] == [small.overrides(i) for i in range(small.count)]


def test_a_case_does_not_depend_on_the_order_in_which_it_is_asked_for():
    study = sampled("latin_hypercube", 20, ", seed: 3")
    backwards = [study.overrides(i) for i in reversed(range(20))]
    assert backwards[::-1] == [overrides for overrides, _ in study.cases()]
    written = study.entries[0].columns[0][1].written  # what the values follow from
    assert json.loads(json.dumps(written)) == written
    assert (written["sample"]["method"], written["sample"]["seed"]) == ("latin_hypercube", 3)


def test_values_lie_in_their_interval_as_it_is_spaced():
    cases = [overrides for overrides, _ in sampled("sobol", 1024).cases()]
    preload = np.array([number(case["cable.preload"]) for case in cases])
    mass = np.array([number(case["gondola.mass"]) for case in cases])
    assert all(case["cable.preload"].endswith(" N") for case in cases)
    assert preload.min() >= 100
    assert preload.max() <= 2000
    # of an even sample: a quantile is where the interval says, to the width of a stratum
    for part in (0.25, 0.5, 0.75):
        assert np.mean(preload <= 100 * 20**part) == pytest.approx(part, abs=1 / 1024)
        assert np.mean(mass <= 10 + 40 * part) == pytest.approx(part, abs=1 / 1024)


def test_the_design_of_saltelli_exchanges_one_key_at_a_time():
    study = sampled("saltelli", 16)
    assert study.count == 16 * 4
    cases = [tuple(study.overrides(i).values()) for i in range(study.count)]
    for a, with_first, with_second, b in zip(cases[::4], cases[1::4], cases[2::4], cases[3::4], strict=True):
        assert with_first == (b[0], a[1])
        assert with_second == (a[0], b[1])
        assert a[0] != b[0]
        assert a[1] != b[1]


def test_a_sample_multiplies_with_vary_and_with_options():
    text = f"{COLUMNS}vary: [{{cable.area: [1 mm^2, 2 mm^2]}}]\nsample: {{method: sobol, count: 4, over: {OVER}}}\n"
    study = study_of(text, vary=["gravity=1,2,3"])
    assert study.count == 2 * 4 * 3
    assert study.varied == ("cable.area", "cable.preload", "gondola.mass", "gravity")
    cases = [study.overrides(i) for i in range(24)]
    assert [case["gravity"] for case in cases[:4]] == [1, 2, 3, 1]
    assert [case["cable.area"] for case in cases[::12]] == ["1 mm^2", "2 mm^2"]
    assert [case["cable.preload"] for case in cases[:12]] == [case["cable.preload"] for case in cases[12:]]
    assert len({case["cable.preload"] for case in cases}) == 4


def test_the_check_of_a_large_sample_looks_at_its_ends():
    text = "sample: {method: sobol, count: 4096, over: {cable.area: {from: 2 mm^2, to: -0.001 mm^2}}}\n"
    with pytest.raises(SceneError, match=r"cable\.area: must be positive"):
        check_cases(study_of(COLUMNS + text))
    check_cases(sampled("saltelli", 1024))


def test_reading_a_study_imports_no_numpy():
    # without units, since pint itself imports numpy
    study_of(COLUMNS + "sample: {method: sobol, count: 2048, over: {gondola.mass: {from: 1, to: 2}}}\n")
    script = """
import sys
from cablestudy.scene.study import read_study
study = read_study("study.yaml")
assert study.count == 2048
assert not {"numpy", "scipy"} & set(sys.modules)
"""
    python(script)


def test_a_note_where_sobol_points_are_out_of_balance():
    note = "sample: 1000 points; Sobol points are balanced for powers of two (512 or 1024)"
    placed = re.compile(rf"study.yaml:[0-9]+:[0-9]+: {re.escape(note)}")
    assert all(placed.fullmatch(*sampled(method, 1000).notes) for method in ("sobol", "saltelli"))
    assert sampled("sobol", 1024).notes == sampled("latin_hypercube", 1000).notes == sampled("sobol", 1).notes == ()
    sampled("sobol", 3)
    assert run("sweep", "study.yaml", "--dry-run").lines[0].split(": ", 1)[1].startswith("sample: 3 points")
    assert run("sweep", "study.yaml", "--dry-run", "--quiet").err == ""


def test_validate_says_what_a_sweep_will_say_of_a_sample():
    sobol = "sample: 3 points; Sobol points are balanced for powers of two (2 or 4)"
    saltelli = [sobol, "sample: 3 points; --sensitivity needs at least 8"]
    for method, count, notes in (("sobol", 3, [sobol]), ("saltelli", 3, saltelli), ("saltelli", 8, [])):
        sampled(method, count)
        lines = run("validate", "study.yaml").lines
        assert [line.split(": ", 1)[1] for line in lines] == notes
        for line in lines:
            assert Path("study.yaml").read_text().splitlines()[int(line.split(":")[1]) - 1].count("count: 3") == 1
        assert run("validate", "study.yaml", "--quiet").err == ""


GOOD = "over: {gravity: {from: 1, to: 2}}"


def over(keys, count=4):
    return f"sample: {{method: sobol, count: {count}, over: {keys}}}"


WHOLE = "sample.{}: expected a whole number from {}, got "


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sample: 5", "3:9: sample: expected a mapping with the keys method, count, seed, over, got 5"),
        (f"sample: {{count: 4, {GOOD}}}", "3:9: sample: missing key: method"),
        (f"sample: {{method: sobol, {GOOD}}}", "3:9: sample: missing key: count"),
        ("sample: {method: sobol, count: 4}", "3:9: sample: missing key: over"),
        (f"sample: {{method: sobl, count: 4, {GOOD}}}", '3:18: sample.method: got "sobl" (did you mean sobol?)'),
        (f"sample: {{method: sobol, count: 0, {GOOD}}}", "3:32: " + WHOLE.format("count", "1 to 10000000") + "0"),
        (f"sample: {{method: sobol, count: 20000000, {GOOD}}}",
         "3:32: " + WHOLE.format("count", "1 to 10000000") + "20000000"),
        (f"sample: {{method: sobol, count: 4, seed: 1.5, {GOOD}}}",
         "3:41: " + WHOLE.format("seed", "0 to 9223372036854775807") + "1.5"),
        (f"sample: {{method: sobol, count: 4, seed: -1, {GOOD}}}",
         "3:41: " + WHOLE.format("seed", "0 to 9223372036854775807") + "-1"),
        (f"sample: {{method: sobol, count: 4, sed: 1, {GOOD}}}", "3:35: sample.sed: unknown key (did you mean seed?)"),
        (over("{}"), "3:41: sample.over: expected at least 1 item, got 0"),
        (over("{gravity: [1, 2]}"), "3:51: sample.over.gravity: expected {from, to, spacing}, got a list"),
        (over("{gravity: {from: 1}}"), "3:51: sample.over.gravity: a sampled key needs the key to (from, to, spacing)"),
        (over("{gravity: {from: 1, to: 2, count: 3}}"),
         "3:42: sample.over.gravity: unknown key count of a sampled key (from, to, spacing)"),
        (over("{gravity: {from: 2, to: 2}}"), "3:51: sample.over.gravity: from and to are equal: nothing to sample"),
        (over("{gravity: {from: 0, to: 2, spacing: log}}"),
         "3:51: sample.over.gravity: spacing: log needs ends of one sign, not zero, got 0 and 2"),
        (over("{cable.sag: {from: 1 m, to: 2 N}}"),
         '3:53: sample.over.cable.sag: "N" (force) and "m" (length) do not fit each other'),
        (over("{cable..sag: {from: 1 m, to: 2 m}}"),
         "3:54: sample.over.cable..sag: a key is written as names joined by dots, for example cable.area"),
        (over("{model.elements: {from: 1, to: 20}}"),
         "3:58: model.elements: expected a whole number from 1 to 1000000, got "),
        (f"vary: [{{gravity: [1, 2]}}]\nsample: {{method: sobol, count: 4, {GOOD}}}",
         "4:51: sample.over.gravity: varies in an entry above already"),
        (f"set: {{gravity: 3}}\nsample: {{method: sobol, count: 4, {GOOD}}}",
         "3:16: gravity: has no effect: the study varies this key, or one that replaces it"),
        ("vary: [{cable.preload: [1 kN]}]\n" + over("{cable.sag: {from: 1 m, to: 2 m}}"),
         "4:42: cable.sag: given together with preload: give exactly one of unstretched_length, preload, sag, tension"),
        ("sample: {method: saltelli, count: 9000000, over: {gravity: {from: 1, to: 2}, a.a: {from: 1, to: 2}}}",
         "3:9: sample: 36000000 cases (at most 10000000)"),
        (over("{" + ", ".join(f"{key}: {{from: 1, to: 2}}" for key in ("gravity", *"abcde")) + "}", 9000000),
         "3:32: sample.count: 9000000 points of 6 numbers (at most 50000000 numbers)"),
        ("vary: [{cable.area: {from: 1, to: 2, count: 10000}}]\n" + over("{gravity: {from: 1, to: 2}}", 10000),
         "3:7: vary: 100000000 cases (at most 10000000)"),
    ],
)  # fmt: skip
def test_a_mistake_is_reported_at_its_place(text, message):
    with pytest.raises(SceneError, match=f"^study.yaml:{re.escape(message)}"):
        check_cases(study_of(f"{COLUMNS}{text}\n"))
    outcome = run("sweep", "study.yaml", "--dry-run", code=2)
    assert outcome.out == ""
    assert any(line.startswith(f"study.yaml:{message}") for line in outcome.lines)  # and perhaps an unknown key
