"""The winch loop against the eigenvalues of its dense matrix, against fine scans, and against algebra."""

import re
from functools import cache

import numpy as np
import pytest
from cables import EA, MASS, PAPER_CHORD, PAPER_LENGTH, G, check_damping_ratio, poles_between_fixed_ends
from campaign import campaign
from one_loop import OneLoop, spring_loop
from random_scenes import scene_data, scene_of
from references import bars, loop_matrix
from scenes import scene
from scipy.optimize import brentq

from cablestudy.errors import NoSolutionError
from cablestudy.study.one_cable.case import CableCase

CABLES = {
    "carlina": (),
    "slack": ("cable.area=24.2 mm^2", "cable.unstretched_length=186.000 m"),  # the last row of Table 6
    "thick": ("cable.diameter=7.4 mm",),
}
LOOPS = [
    (name, where, notch) for name in CABLES for where in ("ground", "gondola") for notch in ("static", "coupled", "")
]
SOME = campaign(LOOPS, [LOOPS[place] for place in (0, 5, 7, 10, 14, 15)])
each_loop = pytest.mark.parametrize("which", SOME, ids=["-".join(filter(None, which)) for which in SOME])


@cache
def loop_of(name, where="ground", notch="static", *more):
    """A loop of 40 bars."""
    filtered = f"winch.controller.notch.frequency={notch}" if notch else "winch.controller.notch=none"
    return OneLoop(scene(*CABLES[name], f"winch.location={where}", filtered, *more))


@each_loop
def test_poles_to_the_right_are_counted_right(which):
    loop = loop_of(*which)
    for gain in loop.largest_gain * np.geomspace(0.01, 10, 12):
        assert loop.unstable(gain) == loop_matrix.unstable(loop, gain), gain


REFUSED = re.compile(r"the loop is unstable at (\S+) rad/s: .* grows by (\S+)/s at (\S+) Hz; stable below (\S+) rad/s")


@each_loop
def test_a_gain_is_refused_exactly_where_a_pole_is_to_the_right(which):
    """The largest gain is that of the dense eigenvalues, from both sides."""
    loop = loop_of(*which)
    limit = loop.largest_gain
    for part in (1e-3, 0.01, 0.3, 0.5, 0.7, 1 - 1e-6, 1 + 1e-6, 1.1, 2.0, 7.0, 30.0):
        tried = loop.with_gain(float(part * limit))
        poles = np.linalg.eigvals(loop_matrix.matrices(loop, tried.gain)[0])
        stable = poles.real.max() <= 0
        assert stable == (part < 1) or part > 1.1
        if stable:
            tried.check_stable()
            continue
        with pytest.raises(NoSolutionError) as caught:
            tried.check_stable()
        found = REFUSED.fullmatch(str(caught.value))
        assert found, str(caught.value)
        said_gain, growth, frequency, said_limit = map(float, found.groups())
        assert (said_gain, said_limit) == pytest.approx((tried.gain, limit), rel=1e-3)
        pole = complex(growth, 2 * np.pi * frequency)
        near = 2e-3 if part < 5 else 1e-2  # where poles of an unstable loop nearly coincide they are known less well
        assert np.abs(poles - pole).min() < near * np.abs(pole), "not a pole of this loop"


def test_a_gain_that_is_stable_again_is_accepted():
    # slack, winch on the ground, notch at the mode in which the gondola moves most: one mode goes out and comes back
    loop = loop_of("slack", "ground", "2.3309 Hz")
    limit = loop.largest_gain
    assert loop_matrix.unstable(loop, 1.05 * limit) == 2
    assert loop_matrix.unstable(loop, 10 * limit) == 0
    loop.with_gain(10 * limit).check_stable()
    with pytest.raises(NoSolutionError, match="the loop is unstable"):
        loop.with_gain(1.05 * limit).check_stable()


def test_the_notch_at_the_coupled_frequency_bears_more_on_the_thick_cable():
    # DESIGN.md, section 7
    assert loop_of("thick", "ground", "coupled").largest_gain > 5 * loop_of("thick", "ground", "static").largest_gain


# damped strain: hardly any of it reaches a mode across the axis


@cache
def paper_bars():
    """Static stiffness of end 2 of the paper's 40 bars along x, and their matrices K, M and that of their strain."""
    chain = bars.solve_spatial((PAPER_CHORD, 0, 0), PAPER_LENGTH, EA, MASS * G, 40)
    matrices = bars.matrices(chain, PAPER_LENGTH, EA, MASS)
    return chain.end_stiffness[0, 0], *matrices, bars.elastic_matrix(chain, PAPER_LENGTH, EA)


def dense_pole(gain, law, amount, number, viscous=0.0):
    """Pole of the paper's 40 bars as dense textbook matrices with gondola and loop, that of mode `number` across."""
    end_stiffness, K, M, elastic = paper_bars()
    free = np.array([3 * node + axis for node in range(1, 40) for axis in (0, 2)] + [120])
    mass = M[free] + 50.0 * (free == 120)
    notch = np.sqrt(end_stiffness / 50.0), 0.05, 2 * np.pi * 10, 1.0

    def matrix(s):
        stiff = K + (s if law == "kelvin_voigt" else 1j) * amount * elastic
        own = mass - 50.0 * (free == 120)
        whole = stiff[np.ix_(free, free)] + np.diag(mass * s**2 + viscous / MASS * own * s)
        winch = gain / s * loop_matrix.notch(s, *notch)
        whole[:, -1] -= winch * stiff[free, 0]
        return whole

    left = right = np.append(np.kron(np.sin(number * np.pi * np.arange(1, 40) / 40), [0, 1]), 0).astype(complex)
    s = 1j * number * 2 * np.pi * 1.59
    for _ in range(10):  # inverse iteration on both sides, Newton on the quotient
        whole, slope = matrix(s), (matrix(s * (1 + 1e-5)) - matrix(s * (1 - 1e-5))) / (2e-5 * s)
        right, left = np.linalg.solve(whole, slope @ right), np.linalg.solve(whole.T, slope.T @ left)
        right, left = right / np.linalg.norm(right), left / np.linalg.norm(left)
        step = (left @ whole @ right) / (left @ slope @ right)
        s = s - step
    assert abs(step) < 1e-11
    return s


STRAINED = pytest.mark.parametrize(
    ("law", "key", "amount"), [("kelvin_voigt", "time", 1e-3), ("hysteretic", "loss_factor", 0.02)]
)


@STRAINED
def test_a_mode_that_damped_strain_hardly_reaches_is_refused_by_name(law, key, amount):
    loop = loop_of("carlina", "ground", "static", f"cable.damping={{model: {law}, {key}: {amount}}}")
    expected = dense_pole(0.325, law, amount, 2)
    assert 1e-9 * expected.imag < expected.real < 1e-8 * expected.imag
    with pytest.raises(
        NoSolutionError, match=r"the loop is unstable.*as good as undamped.*cable\.damping\.viscous"
    ) as caught:
        loop.with_gain(0.325).check_stable()
    found = re.search(r"a motion of (\S+) Hz grows; |grows by (\S+)/s at (\S+) Hz", str(caught.value))
    assert float(found[1] or found[3]) == pytest.approx(expected.imag / (2 * np.pi), rel=1e-3)
    if found[2]:  # by more than rounding of the poles
        assert float(found[2]) == pytest.approx(expected.real, rel=0.1)
    frequency = f"{expected.imag / (2 * np.pi):.4g} Hz"
    with pytest.raises(NoSolutionError, match=rf"no largest gain.* mode of {frequency}.*cable\.damping\.viscous"):
        _ = loop.largest_gain
    # at a gain that drives it by less than a billionth of its frequency nothing is said
    assert 0 < dense_pole(0.2, law, amount, 2).real < 1e-9 * expected.imag
    loop.with_gain(0.2).check_stable()


def test_no_peak_is_stated_for_a_mode_as_good_as_undamped():
    """Its pole lies to the right by less than what is called instability, and the peak is none of the loop."""
    loop = loop_of("carlina", "ground", "static", "cable.damping={model: kelvin_voigt, time: 1e-3}")
    frequency = f"{dense_pole(0.2, 'kelvin_voigt', 1e-3, 2).imag / (2 * np.pi):.4g} Hz"
    with pytest.raises(NoSolutionError, match=rf"no peak of the sensitivity.*{frequency}.*cable\.damping\.viscous"):
        _ = loop.with_gain(0.2).margins.sensitivity_peak


@STRAINED
def test_viscous_damping_decides_about_such_a_mode_as_dense_bars_do(law, key, amount):
    viscous = 4e-9
    damping = f"cable.damping={{model: {law}, {key}: {amount}, viscous: {viscous} N s/m^2}}"
    loop = loop_of("carlina", "ground", "static", damping)
    limit = brentq(lambda gain: dense_pole(gain, law, amount, 2, viscous).real, 0.1, 30, rtol=1e-9)
    others = [dense_pole(limit, law, amount, number, viscous).real for number in (1, 3, 4)]
    assert max(others) < 0
    assert loop.largest_gain == pytest.approx(limit, rel=1e-5)
    loop.with_gain(limit * (1 - 1e-4)).check_stable()
    with pytest.raises(NoSolutionError, match="the loop is unstable"):
        loop.with_gain(limit * (1 + 1e-4)).check_stable()


GONDOLA, SPRING, TIME = 50.0, 1025.0, 0.002  # [kg], [N/m], of Kelvin and Voigt's law [s]


@pytest.mark.parametrize("location", ["ground", "gondola"])
def test_an_integrator_on_a_damped_spring_by_algebra(location):
    # M s^3 + k t s^2 + (k + g k t) s + g k: Routh gives t (k + g k t) > M g, so g < t k/(M - k t^2)
    gains = spring_loop(GONDOLA, SPRING, location, time=TIME)
    limit = gains.limits[0].factor
    assert limit == pytest.approx(TIME * SPRING / (GONDOLA - SPRING * TIME**2), rel=1e-9)
    assert [gains.unstable(limit * (1 + sign * 1e-6)) for sign in (-1, 1)] == [0, 2]


@pytest.mark.parametrize("seed", [110040, 501006, 501046, 501048])
def test_the_gondola_s_pole_among_others_that_it_passes_while_it_is_damped(seed):
    """With a loss factor of one its pole lies beyond undamped ones of the cable; followed there without any modes."""
    check_damping_ratio(CableCase(scene_of(scene_data(seed), 1e-6)).refined(1, 16), 1e-8)


@pytest.mark.crossed
@pytest.mark.parametrize("damping", ["model: hysteretic, loss_factor: 0.01", "model: kelvin_voigt, time: 1 ms"])
@pytest.mark.parametrize("where", ["ground", "gondola"])
def test_modes_across_the_plane_that_nothing_damps_lie_upon_the_axis(damping, where):
    """A gondola that is moved at an angle to the cable's plane feels them; any warning of numpy fails."""
    ends = ("cable.ends=[[0, 0, 0], [70, 70, 20]]", "cable.unstretched_length=99 m", "cable.strength=null")
    winch = (f"winch.location={where}", "winch.controller.gain=1e-3", "winch.controller.notch=none")
    bare, loop = (
        OneLoop(scene(*ends, *winch, f"cable.damping={{{damping}{more}}}", "model.elements=10"))
        for more in ("", ", viscous: 1e-5 N s/m^2")
    )
    poles = poles_between_fixed_ends(bare.cable)
    assert (np.abs(poles.real) < 1e-12 * np.abs(poles)).any()
    bare.check_stable()
    if where == "ground" and "hysteretic" in damping:
        with pytest.raises(NoSolutionError, match=r"as good as undamped.*cable\.damping\.viscous"):
            _ = bare.largest_gain
    # a scan that is fine beside the narrow resonances, and its passages refined one by one
    beside = np.concatenate([-np.geomspace(1e-14, 1e-2, 300), np.geomspace(1e-14, 1e-2, 300)])
    narrow = np.outer(loop.open_poles.imag[loop.open_poles.imag > 0.01], 1 + beside).ravel()
    omega = np.unique(np.concatenate([np.geomspace(0.01, 3e3, 100_001), narrow]))
    value = np.concatenate([loop.unit_gain(1j * part) for part in np.array_split(omega, 50)])
    depth = []
    for i in np.flatnonzero(value.imag[:-1] * value.imag[1:] < 0):
        at = brentq(lambda w: loop.unit_gain(1j * np.array([w])).imag[0], omega[i], omega[i + 1], xtol=1e-15 * omega[i])
        here = loop.unit_gain(1j * np.array([at]))[0]
        if abs(here.imag) < 1e-3 * abs(here.real):  # and no pole
            depth.append(-here.real)
    # from stability, the first gain that puts a pole on the axis is the limit
    assert loop.largest_gain == pytest.approx(1 / max(depth), rel=1e-3)
    assert all(number is None or number > 0 for number in (loop.margins.bandwidth, loop.margins.phase_margin))
