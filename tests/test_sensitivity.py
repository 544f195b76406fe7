"""Sensitivity indices: functions whose indices are known, scipy's formulas, intervals, studies of the command line."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from command import rows_of, run, study_file
from scipy.stats import sobol_indices

from cablestudy.scene.sampling import Sample
from cablestudy.sweeps.sensitivity import indices

pytestmark = pytest.mark.usefixtures("folder")


def design(count, keys, seed=1):
    """Points of a design as a study has them: shape (count, keys + 2, keys)."""
    sample = Sample(method="saltelli", count=count, seed=seed, over={f"k.{i}": {} for i in range(keys)})
    flat = [[sample.coordinate(case, key) for key in range(keys)] for case in range(sample.cases)]
    return np.array(flat).reshape(count, keys + 2, keys)


def of(values, seed=0):
    """Indices from values of shape (count, keys + 2)."""
    return indices(values[:, 0], values[:, -1], values[:, 1:-1].T, seed)


def ishigami(points, a=7.0, b=0.1):
    x = np.pi * (2 * points - 1)
    return np.sin(x[..., 0]) + a * np.sin(x[..., 1]) ** 2 + b * x[..., 2] ** 4 * np.sin(x[..., 0])


def test_the_function_of_ishigami():
    a, b = 7.0, 0.1
    alone = np.array([0.5 * (1 + b * math.pi**4 / 5) ** 2, a**2 / 8, 0])
    pair = 8 * b**2 * math.pi**8 / 225  # of the first with the third
    variance = alone.sum() + pair
    values = ishigami(design(8192, 3))
    found = of(values)
    # what independent points would have as standard error, from the exact variance
    f_a, f_b, f_ab = values[:, :1] - a / 2, values[:, -1:] - a / 2, values[:, 1:-1] - a / 2  # the mean is a/2
    error_of_first = (f_b * (f_ab - f_a)).std(axis=0) / variance / 8192**0.5
    error_of_total = ((f_ab - f_a) ** 2).std(axis=0) / (2 * variance) / 8192**0.5
    first, total = alone / variance, (alone + np.array([pair, 0, pair])) / variance
    assert np.all(np.abs(found.first[:, 0] - first) < 3 * error_of_first)
    assert np.all(np.abs(found.total[:, 0] - total) < 3 * error_of_total)
    assert max(error_of_first.max(), error_of_total.max()) < 0.02
    for ends, truth in ((found.first, first), (found.total, total)):
        assert np.all(ends[:, 1] <= ends[:, 0])
        assert np.all(ends[:, 0] <= ends[:, 2])
        assert np.all((ends[:, 1] <= truth) & (truth <= ends[:, 2]))


@pytest.mark.parametrize(("count", "shift"), [(64, 0), (1024, 5), (4096, 1e4)])
def test_the_estimates_are_those_of_scipy(count, shift):
    values = ishigami(design(count, 3)) + shift
    a, b, ab = values[:, 0], values[:, -1], values[:, 1:-1].T
    theirs = sobol_indices(func={"f_A": a[None], "f_B": b[None], "f_AB": ab[:, None]}, n=count)
    found = of(values)
    assert found.first[:, 0] == pytest.approx(theirs.first_order.ravel(), abs=1e-9)
    assert found.total[:, 0] == pytest.approx(theirs.total_order.ravel(), abs=1e-9)


def test_the_estimates_where_blocks_are_unequal():
    values = ishigami(design(1500, 3))
    values -= values[:, [0, -1]].mean()
    a, b, ab = values[:, :1], values[:, -1:], values[:, 1:-1]
    variance = np.var([a, b])
    assert of(values).first[:, 0] == pytest.approx(np.mean(b * (ab - a), axis=0) / variance, abs=1e-12)
    assert of(values).total[:, 0] == pytest.approx(np.mean((ab - a) ** 2, axis=0) / (2 * variance), abs=1e-12)


def test_the_intervals_are_those_of_a_bootstrap_point_by_point():
    values = ishigami(design(400, 3))
    generator = np.random.default_rng(99)
    draws = []
    for _ in range(3000):
        drawn = values[generator.integers(0, 400, 400)]
        a, b, ab = drawn[:, 0], drawn[:, -1], drawn[:, 1:-1].T
        mean = (a.mean() + b.mean()) / 2
        variance = ((a - mean) ** 2 + (b - mean) ** 2).mean() / 2
        first = ((b - values[:, [0, -1]].mean()) * (ab - a)).mean(axis=1) / variance
        draws.append([*first, *((ab - a) ** 2).mean(axis=1) / (2 * variance)])
    low, high = np.percentile(draws, [2.5, 97.5], axis=0)
    found = np.vstack([of(values).first, of(values).total])
    width = high - low
    assert np.all(np.abs(found[:, 1] - low) < 0.1 * width)
    assert np.all(np.abs(found[:, 2] - high) < 0.1 * width)


def test_an_interval_holds_the_truth_nineteen_times_of_twenty():
    generator = np.random.default_rng(5)
    weights = np.array([1.0, 2.0, 0.5])
    truth = weights**2 / (weights**2).sum()
    held = []
    for _ in range(150):
        a, b = generator.random((2, 300, 3))
        ab = [np.where(np.arange(3) == key, b, a) @ weights for key in range(3)]
        found = indices(a @ weights, b @ weights, ab)
        held += [(ends[:, 1] <= truth) & (truth <= ends[:, 2]) for ends in (found.first, found.total)]
    assert 0.91 < np.mean(held) < 0.98


def test_blocks_of_many_points_give_the_same_intervals():
    generator = np.random.default_rng(6)
    a, b = generator.random((2, 20_000, 2))
    ab = [np.where(np.arange(2) == key, b, a).prod(axis=1) for key in range(2)]
    found = indices(a.prod(axis=1), b.prod(axis=1), ab)
    parts = [indices(a[i::4].prod(axis=1), b[i::4].prod(axis=1), [f[i::4] for f in ab]) for i in range(4)]
    width = found.first[:, 2] - found.first[:, 1]
    parts_width = np.mean([part.first[:, 2] - part.first[:, 1] for part in parts], axis=0)
    assert width == pytest.approx(parts_width / 2, rel=0.15)  # four times the points, half the width


def test_what_does_not_vary_has_no_indices():
    ones = np.full(32, 3.7)
    assert indices(ones, ones, [ones, ones]) is None
    dust = ones * (1 + 1e-14 * np.arange(32))
    assert indices(dust, ones, [ones, dust]) is None
    assert indices(0 * ones, 0 * ones, [0 * ones]) is None


def test_huge_and_tiny_values_have_the_same_indices():
    values = ishigami(design(64, 3))
    for scale in (1e-300, 1e300 / np.abs(values).max()):
        assert of(values * scale).first == pytest.approx(of(values).first, rel=1e-9, abs=1e-11)


UNIFORM = "cable.area: {from: 2 mm^2, to: 6 mm^2}, cable.density: {from: 1000, to: 1500}"
LOG = "cable.area: {from: 1 mm^2, to: 9 mm^2, spacing: log}, cable.density: {from: 1000, to: 1500}"
SLACK = "set: {cable.unstretched_length: 186 m, model: null}\n"


def moments(low, high, log=False):
    """Mean and variance of a value spread evenly between two ends, or evenly in its logarithm."""
    if not log:
        return (low + high) / 2, (high - low) ** 2 / 12
    mean = (high - low) / math.log(high / low)
    return mean, (high**2 - low**2) / (2 * math.log(high / low)) - mean**2


def product_indices(one, other):
    """First-order and total indices of x in x y, from mean and variance of both."""
    (m, v), (n, w) = one, other
    variance = v * w + v * n**2 + w * m**2
    return v * n**2 / variance, (v * n**2 + v * w) / variance


def sensitivity(folder, text, *arguments, code=0):
    command = ("sweep", study_file(folder, text), "--sensitivity", "--no-write", "--format", "json")
    outcome = run(*command, *arguments, code=code)
    return {(row["column"], row["parameter"]): row for row in rows_of(outcome.out, "json")}, outcome


@pytest.mark.parametrize(("over", "log"), [(UNIFORM, False), (LOG, True)])
def test_the_mass_of_a_cable_is_a_product(folder, over, log):
    text = f"columns: [mass]\nsample: {{method: saltelli, count: 512, over: {{{over}}}}}\n{SLACK}"
    found, _ = sensitivity(folder, text)
    area, density = moments(1 if log else 2, 9 if log else 6, log), moments(1000, 1500)
    for key, (first, total) in {
        "cable.area": product_indices(area, density),
        "cable.density": product_indices(density, area),
    }.items():
        row = found["mass_kg", key]
        assert row["first_order"] == pytest.approx(first, abs=0.02)
        assert row["total"] == pytest.approx(total, abs=0.02)
        assert row["first_order_low"] <= first <= row["first_order_high"]
        assert row["total_low"] <= total <= row["total_high"]


def test_the_form_of_a_cable_depends_on_weight_over_stiffness_only(folder):
    # with E fixed the area scales weight and EA alike: the sag does not know it
    text = f"columns: [sag, elastic_modulus]\nsample: {{method: saltelli, count: 64, over: {{{UNIFORM}}}}}\n{SLACK}"
    found, outcome = sensitivity(folder, text)
    area, density = found["sag_m", "cable.area"], found["sag_m", "cable.density"]
    assert (area["first_order"], area["total"], area["total_high"]) == (0, 0, 0)
    assert density["total"] == pytest.approx(1, abs=0.02)
    modulus = found["elastic_modulus_GPa", "cable.area"]
    assert {modulus[name] for name in modulus if name not in ("column", "parameter")} == {None}
    assert outcome.lines == ["elastic_modulus_GPa: no indices, the column does not vary"]


def test_other_entries_have_indices_of_their_own(folder):
    text = (f"columns: [mass]\nvary: [{{cable.unstretched_length: [186 m, 187 m]}}]\nset: {{model: null}}\n"
            f"sample: {{method: saltelli, count: 16, seed: 2, over: {{{UNIFORM}}}}}\n")  # fmt: skip
    rows = rows_of(sensitivity(folder, text, "--vary", "gravity=5,9.81")[1].out, "json")
    expected = [(length, gravity) for length in (186.0, 187.0) for gravity in (5.0, 9.81)]
    assert [(row["cable.unstretched_length_m"], row["gravity_m_per_s2"]) for row in rows[::2]] == expected
    assert {row["parameter"] for row in rows} == {"cable.area", "cable.density"}
    # the mass is the unstretched length times a product: its indices are the same for all four
    alone, _ = sensitivity(folder, text.replace("[186 m, 187 m]", "[186 m]"))
    for row in rows:
        twin = alone["mass_kg", row["parameter"]]
        for name in ("first_order", "first_order_high", "total", "total_low"):
            assert row[name] == pytest.approx(twin[name], rel=1e-9)


def test_a_failed_case_leaves_its_column_without_indices(folder):
    over = "cable.preload: {from: 0.1 N, to: 20 N}, cable.density: {from: 1000, to: 1500}"
    text = f"columns: [mass, sag]\nset: {{model: null}}\nsample: {{method: saltelli, count: 8, over: {{{over}}}}}\n"
    found, outcome = sensitivity(folder, text, code=3)
    failed = int(re.search(r"(\d+) of 32 rows have no answer: \1 x a mean tension", outcome.err)[1])
    assert 0 < failed < 32
    for column in ("mass_kg", "sag_m"):
        assert found[column, "cable.density"]["total"] is None
        assert f"{column}: no indices, {failed} of 32 cases have no value" in outcome.lines


def test_the_rows_are_stored_and_the_indices_shown(folder):
    text = f"columns: [mass]\nsample: {{method: saltelli, count: 8, over: {{{UNIFORM}}}}}\n{SLACK}"
    outcome = run("sweep", study_file(folder, text), "--sensitivity")
    assert outcome.out.startswith("| column   | parameter     |   first order |")
    assert len(Path("results/study.csv").read_text(encoding="utf-8").splitlines()) == 1 + 8 * 4
    again = run("sweep", "study.yaml", "--sensitivity")
    assert again.out == outcome.out


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        ("", "study.yaml:1:1: --sensitivity needs a sample of the method saltelli"),
        ("sample: {method: sobol, count: 64, over: {gravity: {from: 1, to: 2}}}\n",
         "study.yaml:3:18: --sensitivity needs a sample of the method saltelli"),
        ("sample: {method: saltelli, count: 4, over: {gravity: {from: 1, to: 2}}}\n",
         "study.yaml:3:35: --sensitivity needs at least 8 points, got 4"),
        ("sample: {method: saltelli, count: 8, over: {cable.sag: {from: 1, to: 2}}}\n#",
         "study.yaml:2:10: --sensitivity: none of the columns depends on the scene alone"),
    ],
)  # fmt: skip
def test_sensitivity_of_what_has_none(folder, sample, message):
    study_file(folder, f"columns: [{'solve_time, status' if sample.endswith('#') else 'mass'}]\n{sample}")
    assert run("sweep", "study.yaml", "--sensitivity", code=2).lines[0].startswith(message)
