"""`cable/initial_length.py`: the unstretched length from a preload or a sag, there and back, and refusals."""

import re

import numpy as np
import pytest
from cables import Exact, chord_span, chord_strain_for_sag, chord_strain_for_tension, paper_span
from campaign import campaign
from command import run, table_of
from references import catenary_mp

from cablestudy.cable import initial_length
from cablestudy.cable.catenary import solve
from cablestudy.errors import NoSolutionError


def random_cables(count, seed, loads):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        near = 90 - 10 ** rng.uniform(-9, 0)
        degrees = rng.choice([0, rng.uniform(-90, 90), 90, -near])
        strain = rng.choice([10 ** rng.uniform(-12, -0.5), -(10 ** rng.uniform(-12, -1)), 1 / rng.uniform(1, 100) - 1])
        chord, stiffness = 10 ** rng.uniform(-3, 6), 10 ** rng.uniform(2, 10)
        weight = stiffness * 10 ** rng.uniform(-12, 0)
        forces = [(rng.uniform(0, 0.5), rng.normal(size=3) * weight * 10 ** rng.uniform(-2, 1))] if loads else ()
        yield chord_span(chord, degrees, strain, stiffness, weight / chord, 1.0, forces)


@pytest.mark.parametrize("loads", [False, True], ids=["plain", "point load"])
def test_the_tension_comes_back(loads):
    """Whatever cable the tension was taken from: one with this tension is found, and none shorter has it."""
    for span in random_cables(campaign(25, 8), 11 + loads, loads):
        tension = float(solve(span).mean_tension)
        strain = chord_strain_for_tension(span, tension)
        assert solve(span.with_chord_strain(strain)).mean_tension == pytest.approx(tension, rel=2e-12)
        if not loads:
            # near the least tension the length is as uncertain as the square root of the tension's last digit
            assert strain >= span.chord_strain - max(1e-6 * abs(span.chord_strain), 1e-7)


def test_the_sag_comes_back():
    for span in random_cables(campaign(25, 8), 13, False):
        sag = float(solve(span).sag)
        if sag <= 0:  # nothing hangs below a taut vertical chord
            continue
        strain = chord_strain_for_sag(span, sag)
        # a sag is a difference of heights, known to rounding of the length
        rounding = 4e-16 * span.unstretched_length
        assert solve(span.with_chord_strain(strain)).sag == pytest.approx(sag, rel=1e-11, abs=rounding)


@pytest.mark.crossed
@pytest.mark.parametrize("degrees", [0, 19, -75])
@pytest.mark.parametrize(("search", "name", "value", "tolerance"), [
    *((chord_strain_for_tension, "mean_tension", tension, 1e-12) for tension in (40.0, 361.0, 1344.75, 24200.0)),
    *((chord_strain_for_sag, "sag", sag, 1e-11) for sag in (1e-3, 0.12, 4.088, 60.0, 500.0)),
])  # fmt: skip
def test_a_tension_or_sag_is_that_of_50_digits(search, name, value, tolerance, degrees):
    span = paper_span(degrees=degrees)
    found = span.with_chord_strain(search(span, value))
    assert getattr(Exact(found), name)() == pytest.approx(value, rel=tolerance)


def test_a_weightless_cable():
    """T = EA strain; and no sag whatever its length."""
    span = chord_span(10, 30, 0.0, 1e6, gravity=0.0)
    assert chord_strain_for_tension(span, 5.0) == pytest.approx(5e-6, rel=1e-13)
    with pytest.raises(NoSolutionError, match="sag"):
        chord_strain_for_sag(span, 0.1)


def test_the_shorter_of_two_cables():
    """A steep cable has its tension twice: just taut (T = EA strain), and hanging far below its ends."""
    span = chord_span(1, 89.9999, 0.0, 1e6, mass=10.0)
    tension = float(solve(span.with_chord_strain(-0.5)).mean_tension)
    assert chord_strain_for_tension(span, tension) == pytest.approx(tension / 1e6, rel=1e-3)


def test_the_least_tension_of_a_short_cable_that_carries_a_large_load():
    """The longer it is the less its mean tension, up to many chords: found by trying lengths, the load at its place."""
    span = chord_span(1.0, 30, 0.0, 1e6, 1e-3, 9.81, [(0.4, np.array([0.0, 0.0, -50.0]))])
    lengths = np.geomspace(1.0, 1000.0, 2000)
    tensions = solve(span.with_chord_strain(1 / lengths - 1)).mean_tension
    assert lengths[np.argmin(tensions)] > 20
    with pytest.raises(NoSolutionError, match="below the least") as refused:
        chord_strain_for_tension(span, 0.99 * min(tensions))
    stated, at = (
        float(word) for word in re.findall(r"([\d.]+) N, at an unstretched length of ([\d.]+) m", str(refused.value))[0]
    )
    assert stated == pytest.approx(min(tensions), rel=1e-4)
    assert at == pytest.approx(lengths[np.argmin(tensions)], rel=0.02)


@pytest.mark.parametrize("degrees", [0, 40, 90])
def test_a_tension_below_the_least(degrees):
    """The least tension over all lengths, found here by trying many, and a little less than it."""
    span = paper_span(degrees=degrees)
    strain = np.concatenate([np.linspace(-0.8, 0, 4000), np.linspace(0, 1e-4, 1000)])
    least = solve(span.with_chord_strain(strain)).mean_tension.min()
    with pytest.raises(NoSolutionError, match="below the least"):
        chord_strain_for_tension(span, 0.999 * least)
    found = chord_strain_for_tension(span, 1.001 * least)
    assert solve(span.with_chord_strain(found)).mean_tension == pytest.approx(1.001 * least, rel=1e-12)


def test_no_cable_ends_before_its_load():
    """A tension that a taut cable would have, were it not for a load 300 m along: a longer one, or a refusal."""
    span = paper_span(length=400.0, loads=[(0.75, (0.0, 0.0, -10.0))])
    found = span.with_chord_strain(chord_strain_for_tension(span, 20.0))
    assert found.unstretched_length > 300
    assert solve(found).mean_tension == pytest.approx(20, rel=1e-12)
    with pytest.raises(NoSolutionError, match=r"last load, at 300 m"):
        chord_strain_for_tension(span, 1e6)


def test_a_preload_of_a_strain_of_1e_12():
    span = chord_span(100, 0, 0, 1e12, mass=1e-12)
    strain = chord_strain_for_tension(span, 1.0)
    H, V0 = catenary_mp.solve(100, 0, Exact(span.with_chord_strain(strain)).L, 1e12, 1e-12 * 9.81)
    assert strain == pytest.approx(1e-12, rel=1e-9)
    assert float(H) == pytest.approx(1.0, rel=1e-9)
    assert float(V0) == pytest.approx(-1e-10 * 9.81 / 2, rel=1e-9)


@pytest.fixture
def solutions(monkeypatch):
    """Whether each closed form that is asked for was found, and in how many steps."""
    found = []

    def counted(span):
        answer = solve(span)
        found.append((bool(answer.record.converged.all()), int(answer.record.steps.max())))
        return answer

    monkeypatch.setattr(initial_length, "solve", counted)
    return found


@pytest.mark.parametrize("force", [1.8e7, -1.8e7])
def test_a_weightless_upright_cable_is_not_searched_where_it_folds(solutions, force):
    """Its two parts: T = EA strain, and a jump by the load; slack ones have no form, and cost a hundred times more."""
    stiffness, mean, share = 1.6e11, 2.86e7, 0.4
    span = chord_span(1716.0, -90, 0.0, stiffness, gravity=0.0, loads=[(share, (0, 0, force))])
    strain = chord_strain_for_tension(span, mean)
    assert strain == pytest.approx(mean / stiffness, rel=1e-12)
    assert all(answered for answered, _ in solutions)
    assert len(solutions) < 40


def test_a_search_by_sag_ends_at_rounding(solutions):
    span = paper_span()
    assert solve(span.with_chord_strain(chord_strain_for_sag(span, 0.57))).sag == pytest.approx(0.57, rel=1e-12)
    assert len(solutions) < 30


def test_a_refusal_is_cheap(solutions):
    with pytest.raises(NoSolutionError, match="below the least"):
        chord_strain_for_tension(paper_span(), 1.0)
    assert len(solutions) < 100


def test_a_weightless_cable_slack_below_its_loads():
    """115 N hang on its upper part, and 0.015 N of mean tension leave none for the lower one: refused, not a crash."""
    loads = [(0.66, (92.2, -0.0086, 0)), (0.72, (22.7, -0.0021, 0))]
    span = chord_span(479.6, -89.99, 0.0, 9.5e6, gravity=0.0, loads=loads)
    # rounding decides whether the least that it can have is found
    with pytest.raises(NoSolutionError, match=r"definite form|below the least that this cable can have"):
        chord_strain_for_tension(span, 0.015)


def test_a_sag_or_tension_that_only_a_long_cable_has_is_told(tmp_path):
    """By its length over the distance of the ends, beyond five; not where the length is stated."""
    text = "cable: {chord: 100 m, material: aramid, diameter: 4 mm, STATED}\n"
    path = tmp_path / "long.yaml"

    def notes(stated, *arguments):
        path.write_text(text.replace("STATED", stated), encoding="utf-8")
        return [line for line in run(*(arguments or ("static", path))).lines if line.startswith("note: the stated")]

    (line,) = notes("sag: 4 km")
    (row,) = table_of("static", path)
    times = row["unstretched_length_m"] / 100
    assert line == (
        f"note: the stated sag is that of a cable of {row['unstretched_length_m']:.4g} m, "
        f"{times:.3g} times the distance of its ends"
    )
    assert times == pytest.approx(2 * 4000 / 100, rel=0.02)  # nearly straight down and up again
    assert notes("sag: 4 km", "modes", path, "-n", "1") == [line]
    assert notes("sag: 200 m") == []
    assert notes("unstretched_length: 8 km") == []
    path.write_text("cable: {material: aramid, diameter: 4 mm}\npoints: {a: [0, 0, 0], b: [100, 0, 0]}\n"
                    "cables: {n: {from: a, to: b, sag: 4 km}}\n", encoding="utf-8")  # fmt: skip
    (many,) = run("static", path, "--table", "cables").lines
    assert many == line.replace("note: ", "note: n: ")
