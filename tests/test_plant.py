"""The plant of the winch loop: the sum over its modes, many plants at once, and the curve that is cut short."""

from dataclasses import replace
from functools import cache

import mpmath
import numpy as np
import pytest
from references import loop_matrix
from scenes import scene

from cablestudy.control import nyquist, plant, roots, winch
from cablestudy.control.ends import EndModel
from cablestudy.control.gondola import coupled_modes_of
from cablestudy.control.together import Notch, Together
from cablestudy.control.transfer import Several, Transfer
from cablestudy.errors import CablestudyError
from cablestudy.study import loops, windrms
from cablestudy.study.cache import Cache
from cablestudy.study.case import Case


def model(ratio, count=60, seed=1):
    """Any cable with modal damping."""
    draw = np.random.default_rng(seed)
    omega = np.sort(draw.uniform(5, 3000, count))
    participation = draw.normal(size=(count, 6)) * omega[:, None]
    return EndModel(omega, participation, np.full(count, ratio), 3 * np.eye(6), 100 * np.eye(6))


# the sum over the modes


@pytest.mark.parametrize("ratio", [0.0, 1e-5, 0.01, 0.5, 1.0, 1.7])
def test_the_sum_over_the_modes_is_that_of_forty_digits(ratio):
    """On the imaginary axis and anywhere, with modes far above and far below."""
    cable = model(ratio)
    square, count = [mpmath.mpf(float(w)) ** 2 for w in cable.omega], len(cable.omega)
    omega = np.concatenate([np.geomspace(1e-3, 30, 400), np.geomspace(30, 1e5, 60), cable.omega * (1 + 1e-3)])
    found = Transfer(cable, [3], [3, 0])(1j * omega)[:, 0]
    several = Several([Transfer(cable, [3], [3, 0])]).values(np.zeros(len(omega), dtype=int), 1j * omega).T
    residual = cable.residual_inertia[3, [3, 0]]
    with mpmath.workdps(40):
        for index in range(0, len(omega), 7):
            s = mpmath.mpc(0, float(omega[index]))
            rates = [s * (s + 2 * mpmath.mpf(ratio) * mpmath.mpf(float(w))) for w in cable.omega]
            shares = [rate / (w * (rate + w)) for rate, w in zip(rates, square, strict=True)]
            for place, column in enumerate((3, 0)):
                strength = [mpmath.mpf(float(p[3])) * mpmath.mpf(float(p[column])) for p in cable.participation]
                parts = [strength[k] * shares[k] for k in range(count)]
                exact = sum(parts) + float(cable.stiffness[3, column]) + float(residual[place]) * s**2
                size = float(sum(abs(part) for part in parts) + abs(exact))
                # beside a resonance a frequency has no more digits than rounding leaves it
                known = 2e-13 + 1e-15 / max(ratio, 2.5e-4)
                assert abs(found[index, place] - complex(exact)) < known * size
                assert abs(several[index, place] - complex(exact)) < known * size


def test_order_and_number_of_frequencies_do_not_matter():
    transfer, draw = Transfer(model(0.01), [3], [3, 0]), np.random.default_rng(2)
    omega = np.geomspace(1e-2, 1e4, 700)
    shuffled = draw.permutation(len(omega))
    assert transfer(1j * omega[shuffled]) == pytest.approx(transfer(1j * omega)[shuffled], rel=1e-13)
    few = np.concatenate([transfer(1j * part) for part in np.array_split(omega, 140)])
    assert transfer(1j * omega) == pytest.approx(few, rel=1e-12)
    assert transfer(np.zeros(0)).shape == (0, 1, 2)


# many at once are each alone, to the last digit


@cache
def plants():
    names = ("", "cable.diameter=5.55 mm", "cable.damping.ratio=1e-4", "winch.location=gondola",
             "winch.controller.notch=none", "model.elements=7", "cable.damping={model: hysteretic, loss_factor: 0.02}",
             "gondola.mass=5 kg", "cable.damping.ratio=1.5")  # fmt: skip
    return [Case(scene(*filter(None, [name]))).loop.plant for name in names]


def test_values_of_several_plants_are_those_of_each_alone():
    draw = np.random.default_rng(3)
    which = np.repeat(np.arange(len(plants())), [1, 5, 2, 3, 17, 1, 4, 2, 9])
    s = 1j * draw.uniform(1, 300, len(which)) - draw.uniform(0, 3, len(which))
    gain = draw.uniform(0, 1, len(which))
    together = Together(plants())
    for number, one in enumerate(plants()):
        own = np.flatnonzero(which == number)
        alone, none = Together([one]), np.zeros(len(own), dtype=int)
        assert (together.unit_gain(which, s)[own] == alone.unit_gain(none, s[own])).all()
        assert (together.balance(which, s, gain)[own] == alone.balance(none, s[own], gain[own])).all()
        assert one.unit_gain(s[own]) == pytest.approx(alone.unit_gain(none, s[own]), rel=1e-12)


def test_poles_and_passages_of_several_plants_are_those_of_each_alone():
    fresh = [plant.Plant(one.cable, one.mass, one.location, one.notch) for one in plants()]
    lone = [plant.Plant(one.cable, one.mass, one.location, one.notch) for one in plants()]
    plant.prepare(fresh)
    for one, other in zip(fresh, lone, strict=True):
        assert "passages" in one.__dict__
        assert one.gondola_pole == other.gondola_pole
        for name in ("seen_poles", "faint_poles"):
            assert (getattr(one, name) == getattr(other, name)).all()
        for name in ("omega", "depth", "turn"):
            assert (getattr(one.passages, name) == getattr(other.passages, name)).all()


def test_coupled_modes_of_many_are_those_of_each_alone():
    problems = []
    for name in ("", "cable.diameter=5.55 mm", "model.elements=7", "cable.unstretched_length=185.8 m"):
        case = Case(scene(*filter(None, [name])))
        modes = case.excited.up_to(1e9)
        stiffness, participation = case.end_stiffness_along(0), case.participation(modes)
        problems.append((50.0, stiffness, modes.frequency, participation, case.end_inertia))
    for problem, (frequency, share) in zip(problems, coupled_modes_of(problems), strict=True):
        (alone,) = coupled_modes_of([problem])
        assert (frequency == alone[0]).all()
        assert (share == alone[1]).all()


def response_or_error(case):
    try:
        return case.response
    except CablestudyError as error:
        return error


def test_responses_of_many_cases_are_those_of_each_alone():
    sets = [(), ("cable.diameter=7.4 mm",), ("winch.controller.gain={auto: {gain_margin: 6}}",),
            ("cable.damping.ratio=0",), ("winch.controller.gain=1000",), ("wind.speed=12 m/s",),
            ("cable.damping={model: kelvin_voigt, time: 1e6 s}",), ("winch.controller.gain=0",)]  # fmt: skip
    cases = [Case(scene(*one)) for one in sets]
    loops.prepare(cases)
    together = [response_or_error(case) for case in cases]
    for one, found in zip(sets, together, strict=True):
        alone = response_or_error(Case(scene(*one)))
        assert type(found) is type(alone)
        assert str(found) == str(alone)
    texts = [str(found) for found in together]
    assert texts[3].startswith("undamped")
    assert texts[4].startswith("unstable loop")
    assert "rounding spoils" in texts[6]
    assert sum(isinstance(found, windrms.Response) for found in together) == 5


def test_cases_that_share_a_loop_are_prepared_with_one():
    cache = Cache()
    cases = [Case(scene(f"wind.speed={speed}"), cache=cache) for speed in (4, 8, 16)]
    loops.prepare(cases)
    assert cases[0].loop is cases[1].loop is cases[2].loop
    later = Case(scene("wind.speed=5"), cache=cache)
    loops.prepare([later])
    assert later.loop is cases[0].loop


# the wind sweeps over what is known of the loop


def test_winds_on_one_loop_share_its_response(monkeypatch):
    evaluated = []
    inner = Transfer.rows
    monkeypatch.setattr(Transfer, "rows", lambda self, s: evaluated.append(len(s)) or inner(self, s))
    loop = Case(scene()).loop
    windrms.response_of(Case(scene("wind.speed=4 m/s")), loop)
    first = sum(evaluated)
    for speed in (5, 6, 7, 9, 11):
        windrms.response_of(Case(scene(f"wind.speed={speed}")), loop)
    assert sum(evaluated) - first < 1.5 * first
    # and each is what it is alone
    alone = windrms.response_of(Case(scene("wind.speed=11")), replace(loop, gain=loop.gain))
    assert alone == windrms.response_of(Case(scene("wind.speed=11")), loop)


def test_a_changed_gain_shares_the_plant_and_a_changed_cable_does_not():
    loop = Case(scene()).loop
    assert replace(loop, gain=0.1).plant is loop.plant
    assert loop.at_rest.plant is loop.plant
    assert replace(loop, cable=loop.cable.select(np.arange(5))).plant is not loop.plant
    assert replace(loop, mass=20.0).plant is not loop.plant
    assert replace(loop, notch=None).plant is not loop.plant


# the curve that is cut short against the whole one, and against eigenvalues


def random_plant(seed):
    """Modes in clusters or in equal steps, damped alike or not, with or without notch."""
    draw = np.random.default_rng(seed)
    count = int(draw.integers(1, 40))
    steps = np.cumsum(draw.uniform(0.3, 1.7, count)) * 10 ** draw.uniform(0, 2)
    omega = steps if draw.random() < 0.5 else np.sort(10 ** draw.uniform(0, 3.5, count))
    ratio = 10 ** (draw.uniform(-4, -0.6, count) if draw.random() < 0.5 else np.full(count, draw.uniform(-4, -0.6)))
    # what moves in a mode: the sum of its squares stays below the mass of the cable
    moved = draw.normal(size=(count, 6)) * 10 ** draw.uniform(-2, 0, (count, 1))
    total = 10 ** draw.uniform(-1, 1)
    moved *= np.sqrt(total / (moved**2).sum(axis=0).max())
    inertia = moved.T @ moved + np.diag(10 ** draw.uniform(-3, -1, 6))
    spring = 10 ** draw.uniform(1, 4) * np.kron([[1, -1], [-1, 1]], np.eye(3))
    mass = 10 ** draw.uniform(0, 2.5) + 2 * total
    slow = np.sqrt(spring[0, 0] / mass)
    notch = Notch(slow * 10 ** draw.uniform(-0.2, 0.5), 10 ** draw.uniform(-2, 0),
                  slow * 10 ** draw.uniform(0.3, 2.5), 10 ** draw.uniform(-1.5, 0.3))  # fmt: skip
    cable = EndModel(omega, moved * (omega**2)[:, None], ratio, spring, inertia)
    location = "ground" if draw.random() < 0.6 else "gondola"
    return plant.Plant(cable, mass, location, notch if draw.random() < 0.7 else None)


RANDOM = range(30)


@pytest.mark.parametrize("seed", RANDOM)
def test_a_random_loop_has_as_many_poles_to_the_right_as_eigenvalues(seed):
    own = random_plant(seed)
    loop = winch.Loop(own.felt, own.mass, own.location, notch=own.notch)
    limit = loop.largest_gain or 1 / max(loop.passages.depth, default=1.0)
    for gain in limit * np.array([0.01, 0.3, 0.9, 1 - 1e-6, 1 + 1e-6, 1.1, 2, 5, 20, 100, 1000]):
        assert loop.passages.unstable_poles(gain) == loop_matrix.unstable(loop, gain), gain


def test_curves_of_many_plants_are_those_of_each_alone():
    several = [*map(random_plant, RANDOM), *plants()]
    several += [plant.Plant(one.cable, 1.5 * one.mass, one.location, one.notch) for one in several]
    curves = nyquist.curves_of(several)
    assert sum(curve.circle > 0 for curve in curves) > len(curves) / 2
    for one, curve in zip(several, curves, strict=True):
        (alone,) = nyquist.curves_of([one])
        assert curve.circle == alone.circle
        assert np.array_equal(curve.omega, alone.omega)
        assert np.array_equal(curve.value, alone.value)


@pytest.mark.parametrize("ratio", [1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.25])
@pytest.mark.parametrize("sets", [(), ("cable.diameter=7.4 mm",), ("gondola.mass=5 kg",), ("gondola.mass=500 kg",),
                                  ("winch.location=gondola",), ("winch.controller.notch=none",),
                                  ("cable.unstretched_length=186 m", "cable.strength=null")],
                         ids=lambda sets: ",".join(sets) or "carlina")  # fmt: skip
def test_the_short_curve_decides_as_the_whole_one(sets, ratio):
    own = Case(scene(*sets, f"cable.damping.ratio={ratio}")).loop.plant
    whole = nyquist.passages_of([own], [own.whole_curve])[0]
    assert own.passages.largest_gain == pytest.approx(whole.largest_gain, rel=1e-9)
    for gain in whole.largest_gain * np.geomspace(1e-2, 1e6, 60):
        assert own.passages.unstable_poles(gain) == whole.unstable_poles(gain)


def test_beyond_its_end_the_curve_stays_in_the_circle():
    for own in [*plants(), *map(random_plant, RANDOM)]:
        curve = own.curve
        if not curve.circle:
            continue
        beside = (own.felt.omega[:, None] * np.linspace(0.9, 1.1, 201)).ravel()
        smooth = np.geomspace(curve.omega[-1], 100 * own.felt.omega.max(), 20000)
        beyond = np.unique(np.concatenate([smooth, beside]))
        beyond = beyond[beyond > curve.omega[-1]]
        assert np.abs(own.unit_gain(1j * beyond)).max() <= curve.circle
    assert sum(own.curve.circle > 0 for own in plants()) >= 4  # and it is short for most that are lightly damped
    assert sum(random_plant(seed).curve.circle > 0 for seed in RANDOM) >= 20


# zeros


def test_zeros_are_found_together_as_alone():
    def function(which, s):
        return (s - (which + 1) * 1j) * (s + 3 + which)

    begin = np.array([0.9j, 1.8j + 0.1, 3.3j, 100 + 1j])
    found = roots.secant(function, begin)
    assert found[:3] == pytest.approx(np.array([1j, 2j, 3j]), rel=1e-12)
    for k, place in enumerate(begin):
        alone = roots.secant(lambda which, s, k=k: function(which + k, s), np.array([place]))
        assert alone[0] == found[k] or (np.isnan(alone[0]) and np.isnan(found[k]))


def test_brackets_are_closed_together_as_alone():
    def function(which, x):
        return x**3 - (which + 1)

    low, high = np.zeros(5), np.array([2.0, 3.0, 2.0, 20.0, 2.0])
    found = roots.between(function, low, high)
    assert found == pytest.approx(np.cbrt(np.arange(1, 6)), rel=1e-12)
    for k in range(5):
        alone = roots.between(lambda which, x, k=k: function(which + k, x), low[k : k + 1], high[k : k + 1])
        assert alone[0] == found[k]
    assert len(roots.between(function, np.zeros(0), np.zeros(0))) == 0


def test_closed_poles_of_several_loops_are_those_of_each_alone():
    several = [Case(scene(f"winch.controller.gain={gain}")).loop for gain in (0.1, 0.325, 3.0)]
    found = winch.find_closed_poles(several)
    for loop, poles in zip(several, found, strict=True):
        assert (poles == replace(loop).closed_poles).all()
        assert len(poles)
