"""Margins of loops of k coordinates against closed forms, python-control, fine scans and perturbations of the disk."""

import warnings

import control
import numpy as np
import pytest
from campaign import campaign
from scipy.optimize import minimize_scalar
from test_loop import spring_loop

from cablestudy.control.curves import sample_curves
from cablestudy.control.law import INTEGRATOR
from cablestudy.control.margins import Margins
from cablestudy.control.margins_crossings import crossings, refined_crossings
from cablestudy.control.margins_grid import frequencies
from cablestudy.control.stable_gains import StableGains
from cablestudy.errors import NoSolutionError

NAMES = ("phase_margin", "gain_crossover", "delay_margin", "sensitivity_peak", "bandwidth", "disk_margin")
TURN = 2 * np.pi


def bisected(function, low, high):
    sign = function(low) > 0
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if (function(middle) > 0) == sign else (low, middle)
    return low


class Chain:
    """An integrator in front of k coordinates with lightly damped modes: L = gain G(s)/s, G(0) about I.

    Its closed loop is stable, by eigenvalues, with half of the gain at which the first pole grows.
    """

    def __init__(self, seed, k):
        draw = np.random.default_rng(seed)
        self.k = k
        while True:  # until it corrects displacements at rest
            self._draw(draw, 6)
            if np.linalg.eigvals(np.eye(k) + self.left.T @ self.right).real.min() > 0.2:
                break
        gains = np.geomspace(1e-5, 1e3, 2000)
        grows = self.poles(gains).real.max(axis=-1) > 1e-12
        first = int(np.argmax(grows))
        self.limit = None
        if grows.any():
            self.limit = bisected(lambda gain: self.poles(gain).real.max(), gains[first - 1], gains[first])
        self.gain = self.limit / 2 if self.limit else 1.0

    def _draw(self, draw, count):
        self.omega = np.sort(10 ** draw.uniform(-0.3, 1.5, count))
        self.ratio = 10 ** draw.uniform(-5, -1.5, count)
        shapes, sign = draw.normal(size=(2, count, self.k)), draw.choice([-1.0, 1.0], count)
        scale = draw.uniform(0.02, 0.6, count) ** 2
        self.right = shapes[0]
        same = draw.uniform(size=(count, 1)) < 0.7
        self.left = np.where(same, sign[:, None] * shapes[0], shapes[1]) * scale[:, None]

    def matrices(self):
        """A, B, C of the unit loop gain."""
        count, k = len(self.omega), self.k
        A = np.zeros((2 * count + k, 2 * count + k))
        A[:count, count : 2 * count] = np.diag(self.omega)
        A[count : 2 * count, :count] = -np.diag(self.omega)
        A[count : 2 * count, count : 2 * count] = -np.diag(2 * self.ratio * self.omega)
        A[count : 2 * count, 2 * count :] = self.omega[:, None] * self.right
        B = np.zeros((len(A), k))
        B[2 * count :] = np.eye(k)
        C = np.concatenate([self.left.T, np.zeros((k, count)), np.eye(k)], axis=1)
        return A, B, C

    def poles(self, gain):
        """Eigenvalues of the closed loop, shape (2 * 6 + k,) or, of gains of shape (n,), (n, 2 * 6 + k)."""
        A, B, C = self.matrices()
        return np.linalg.eigvals(A - np.asarray(gain)[..., None, None] * (B @ C))

    def unit_gain(self, s):
        own = self.omega**2 / (s[:, None] ** 2 + 2 * self.ratio * self.omega * s[:, None] + self.omega**2)
        response = np.einsum("fm,mi,mj->fij", own, self.left, self.right) + np.eye(self.k)
        return response / s[:, None, None]

    def __call__(self, s):
        return self.gain * self.unit_gain(s)

    @property
    def margins(self):
        every = self.poles(0.0), self.poles(self.gain), [-self.gain]
        every = np.concatenate(every)
        return Margins(self, frequencies(every[np.abs(every) > 1e-9]))


def scan(loop, count=400):
    """Frequencies of a fine scan: all decades, and within 30 half-widths of each pole."""
    poles = np.concatenate([loop.poles(0.0), loop.poles(loop.gain)])
    poles = poles[(poles.imag > 0)]
    near = np.concatenate([-np.geomspace(1e-2, 30, count), np.geomspace(1e-2, 30, count)])
    close = np.abs(poles)[:, None] + np.abs(poles.real)[:, None] * near
    low = 1e-3 * min(loop.gain, np.abs(poles).min())
    omega = np.unique(np.concatenate([np.geomspace(low, 1e3 * np.abs(poles).max(), 6000), close.ravel()]))
    return omega[omega > low]


def refined_maximum(function, omega):
    """Largest value of a function over a fine scan, each of its highest tops by Brent's method; and where."""
    value = function(omega)
    top = 1 + np.flatnonzero((value[1:-1] >= value[:-2]) & (value[1:-1] >= value[2:]))
    top = top[np.argsort(value[top])[-8:]]
    best = (value.max(), omega[value.argmax()])
    for place in top:
        low, high = omega[place - 1], omega[place + 1]
        bounds = {"bounds": (0, 1), "method": "bounded", "options": {"xatol": 1e-10}}
        found = minimize_scalar(lambda t, a=low, b=high: -function(np.array([a + t * (b - a)]))[0], **bounds)
        best = max(best, (-found.fun, low + found.x * (high - low)))
    return best


def scanned(loop):
    """The NAMES and the frequency of the largest sensitivity by a fine scan."""
    omega, eye = scan(loop), np.eye(loop.k)

    def size(shift):
        return lambda w: np.linalg.norm(np.linalg.inv(eye + loop(1j * w)) - shift * eye, ord=2, axis=(-2, -1))

    def complementary(w):
        return np.linalg.norm(eye - np.linalg.inv(eye + loop(1j * w)), ord=2, axis=(-2, -1))

    def values(w):
        found = np.linalg.eigvals(loop(1j * w))
        return np.take_along_axis(found, np.argsort(np.abs(found), axis=1), axis=1)

    level, crossovers = np.abs(values(omega)) - 1, []
    for place, which in np.argwhere(level[:-1] * level[1:] < 0):
        at = bisected(lambda w, j=which: np.abs(values(np.array([w])))[0, j] - 1, *omega[place : place + 2])
        crossovers.append((at, np.degrees(np.angle(-values(np.array([at]))[0, which]))))
    at, phase = np.array(crossovers).T
    below = np.flatnonzero(complementary(omega) < np.sqrt(0.5))[0]
    width = bisected(lambda w: complementary(np.array([w]))[0] - np.sqrt(0.5), *omega[below - 1 : below + 1])
    peak, place = refined_maximum(size(0.0), omega)
    disk = 1 / refined_maximum(size(0.5), omega)[0]
    least = np.argmin(np.abs(phase))
    numbers = np.abs(phase[least]), at[least] / TURN, (np.radians(phase % 360) / at).min(), peak, width / TURN, disk
    return dict(zip(NAMES, numbers, strict=True)), place


@pytest.mark.crossed
@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("seed", campaign(range(6), range(2)))
def test_every_number_is_that_of_a_fine_scan(seed, k):
    loop = Chain(seed, k)
    expected, place = scanned(loop)
    found = loop.margins
    assert {name: getattr(found, name) for name in NAMES} == pytest.approx(expected, rel=1e-9)
    poles = loop.poles(loop.gain)
    width = np.abs(poles.real[np.argmin(np.abs(poles - 1j * place))])
    assert found.sensitivity_frequency * TURN == pytest.approx(place, abs=1e-4 * width)  # the scan by values alone


@pytest.mark.crossed
@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("seed", campaign(range(6), range(2)))
def test_crossings_are_the_gains_at_which_eigenvalues_cross(seed, k):
    """Each at the gain, to the side and at the frequency at which an eigenvalue of the closed loop does."""
    loop = Chain(seed, k)
    poles = loop.poles(0.0)
    omega = frequencies(poles[np.abs(poles) > 1e-9])
    curve = sample_curves([loop.unit_gain], np.zeros(len(omega), dtype=int), omega)
    found = refined_crossings([loop.unit_gain], crossings(curve.row, curve.omega, curve.values))
    if loop.limit:
        assert found.factor[found.destabilising].min() == pytest.approx(loop.limit, rel=1e-9)
    for gain, place, destabilising in zip(found.factor, found.frequency, found.destabilising, strict=True):
        sides = [loop.poles(gain * (1 + step)) for step in (-1e-6, 0.0, 1e-6)]
        before, at, after = (one[np.argmin(np.abs(one - 1j * place))] for one in sides)
        assert abs(at - 1j * place) < 1e-9 * place
        assert (after.real > before.real) == destabilising


@pytest.mark.parametrize("k", [1, 3])
def test_limits_of_many_loops_are_those_that_eigenvalues_give_and_those_of_each_alone(k):
    """At once, in another order and alone they have the same digits."""

    def gains_of(loop):
        poles = loop.poles(0.0)
        poles = poles[(np.abs(poles) > 1e-9) & (poles.imag >= 0)]
        return StableGains(loop.unit_gain, poles, (None,) * k, INTEGRATOR)

    def limits_of(loops):
        gains = [gains_of(loop) for loop in loops]
        StableGains.limits.compute(gains)
        return [of_loop.limits for of_loop in gains]

    loops = [Chain(seed, k) for seed in range(4)]
    together, backwards = (limits_of(order) for order in (loops, loops[::-1]))
    assert together == backwards[::-1] == [gains_of(loop).limits for loop in loops]
    assert any(loop.limit for loop in loops)
    for loop, limits in zip(loops, together, strict=True):
        assert (limits[0].factor if limits else None) == (loop.limit and pytest.approx(loop.limit, rel=1e-9))


def test_an_integrator_in_closed_form():
    gain, k = 0.3, 3
    found = Margins(lambda s: gain / s[:, None, None] * np.eye(k), frequencies(np.array([-gain])))
    assert found.phase_margin == pytest.approx(90, abs=1e-12)
    assert found.gain_crossover == pytest.approx(gain / TURN, rel=1e-12)
    assert found.delay_margin == pytest.approx(np.pi / (2 * gain), rel=1e-12)
    assert found.bandwidth == pytest.approx(gain / TURN, rel=1e-12)  # |gain/(s + gain)| = 1/sqrt(2)
    assert (found.sensitivity_peak, found.sensitivity_frequency) == (1.0, None)
    assert (found.disk_margin, found.disk_gain_margin, found.disk_frequency) == (2.0, None, None)
    assert found.disk_phase_margin == pytest.approx(90)


def test_an_integrator_with_a_lag_in_closed_form():
    """L = 1/(s (s + 1)), with x = w^2: |S|^2 = (x^2 + x)/(x^2 - x + 1), |S - 1/2|^2 = ((x + 1)^2 + x)/(4 ...)."""
    found = Margins(lambda s: (1 / (s * (s + 1)))[:, None, None], frequencies(np.array([-1.0, -0.5 + 0.75**0.5 * 1j])))
    x = (1 + 3**0.5) / 2  # where the derivative of |S|^2 is zero: 2 x^2 - 2 x - 1 = 0
    assert found.sensitivity_frequency * TURN == pytest.approx(x**0.5, rel=1e-9)
    assert found.sensitivity_peak == pytest.approx(((x**2 + x) / (x**2 - x + 1)) ** 0.5, rel=1e-12)
    # (x^2 + 3 x + 1)/(x^2 - x + 1) is largest at x = 1, where it is 5
    assert found.disk_margin == pytest.approx(2 / 5**0.5, rel=1e-12)
    assert found.disk_frequency * TURN == pytest.approx(1.0, rel=1e-7)
    half = 1 / 5**0.5
    assert found.disk_gain_margin == pytest.approx(20 * np.log10((1 + half) / (1 - half)), rel=1e-12)
    assert found.disk_phase_margin == pytest.approx(np.degrees(2 * np.arctan(half)), rel=1e-12)


@pytest.mark.parametrize("raised", [0.0, 1e-8, -1e-8])
def test_of_equal_peaks_the_lowest_is_named(raised):
    """L = 1/(s (s + 1)) in three coordinates at 1, 2 and 4 times the frequency, the highest with another gain too."""
    scales = np.array([4.0, 1.0, 2.0])

    def loop_gain(s):
        scaled = s[:, None] / scales
        return ((1 + raised * (scales == 4.0)) / (scaled * (scaled + 1)))[:, :, None] * np.eye(3)

    poles = np.concatenate([scale * np.array([-1.0, -0.5 + 0.75**0.5 * 1j]) for scale in scales])
    found = Margins(loop_gain, frequencies(poles))
    x = (1 + 3**0.5) / 2  # as above
    assert found.sensitivity_frequency * TURN == pytest.approx(x**0.5, rel=1e-7)
    assert found.disk_frequency * TURN == pytest.approx(1.0, rel=1e-7)
    assert found.sensitivity_peak == pytest.approx(((x**2 + x) / (x**2 - x + 1)) ** 0.5, rel=2e-8)


@pytest.mark.parametrize("ratio", [1e-2, 1e-6])
def test_poles_that_nearly_coincide_have_the_frequencies_of_one(ratio):
    """Twelve within a hundredth of their width have seven: the pole, and three on each side. Two that are apart, 14."""
    others, pole = np.array([-1e-3 + 1e-2j, -1e3 + 1e4j]), 1j - ratio
    together = pole + ratio * 5e-3 * np.exp(1j * np.arange(12))
    counts = [len(frequencies(np.append(others, near))) for near in ([], pole, together, [pole, pole + 1j * ratio])]
    assert np.diff(counts).tolist() == [7, 0, 7]


def test_a_delay_turns_a_leading_eigenvalue_all_the_way_to_minus_one():
    """L = s^2/2/(s^2 + s/10 + 1) has the size 1 where 3 x^2/4 - 1.99 x + 1 = 0, x = w^2.

    At the lower crossing it lags -1 by 14 degrees on the far side: a delay has to turn it by 346, not by 14, and the
    upper one, where its phase is 8 degrees, decides with 188.
    """
    found = Margins(lambda s: (s**2 / 2 / (s**2 + s / 10 + 1))[:, None, None], frequencies(np.roots([1, 0.1, 1])))
    lower, upper = ((1.99 + sign * (1.99**2 - 3) ** 0.5) / 1.5 for sign in (-1, 1))
    lag = np.arctan(lower**0.5 / 10 / (1 - lower))
    assert found.phase_margin == pytest.approx(np.degrees(lag), rel=1e-10)
    assert found.gain_crossover == pytest.approx(lower**0.5 / TURN, rel=1e-10)
    delay = (np.pi + np.arctan(upper**0.5 / 10 / (upper - 1))) / upper**0.5
    assert lag / lower**0.5 < delay / 7
    s = 1j * upper**0.5  # with this delay a pole is on the axis
    assert abs(1 + s**2 / 2 / (s**2 + s / 10 + 1) * np.exp(-s * delay)) < 1e-12
    assert found.delay_margin == pytest.approx(delay, rel=1e-10)


@pytest.mark.parametrize("gain", [0.02, 0.05])
def test_disk_margins_are_those_of_python_control(gain):
    loop, rational = spring_loop(gain)
    found = loop.loop_for_margins.stability.margins
    near = found.disk_frequency * TURN * np.linspace(0.99, 1.01, 20_001)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        alpha, db, phase = control.disk_margins(rational, near, skew=0.0)
    assert found.disk_margin == pytest.approx(float(alpha), rel=1e-7)
    assert found.disk_gain_margin == pytest.approx(float(db), rel=1e-6)
    assert found.disk_phase_margin == pytest.approx(float(phase), rel=1e-6)


@pytest.mark.crossed
@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("seed", campaign(range(4), range(2)))
def test_no_perturbation_within_the_disk_makes_the_loop_unstable_and_one_on_it_does(seed, k):
    """Constant complex factors (I + D/2)(I - D/2)^-1 of the loop gain, by eigenvalues of the closed loop."""
    loop, draw = Chain(seed, k), np.random.default_rng(seed)
    alpha, omega = loop.margins.disk_margin, loop.margins.disk_frequency * TURN
    A, B, C = loop.matrices()
    eye = np.eye(k)

    def growth(D):
        factor = (eye + D / 2) @ np.linalg.inv(eye - D / 2)
        poles = np.linalg.eigvals(A - loop.gain * B @ factor @ C)
        return poles[np.argmax(poles.real)]

    for _ in range(300):
        D = draw.normal(size=(k, k)) + 1j * draw.normal(size=(k, k))
        diagonal = np.exp(2j * np.pi * draw.uniform(size=k)) * np.eye(k)
        for one in (D / np.linalg.norm(D, 2), diagonal):
            assert growth(0.999 * alpha * one).real < 0
    shifted = np.linalg.inv(eye + loop(np.array([1j * omega])))[0] - eye / 2
    left, size, right = np.linalg.svd(shifted)
    worst = np.outer(right[0].conj(), left[:, 0].conj()) / size[0]
    assert np.linalg.norm(worst, 2) == pytest.approx(alpha, rel=1e-9)
    factor = (eye + worst / 2) @ np.linalg.inv(eye - worst / 2)
    poles = np.linalg.eigvals(A - loop.gain * B @ factor @ C)
    assert np.abs(poles - 1j * omega).min() < 1e-6 * omega
    assert growth(1.01 * worst).real > 0


@pytest.mark.parametrize("gain", [1e-6, 0.3, 40.0])
def test_what_two_coordinates_with_one_winch_leave_at_rest_is_in_the_margins(gain):
    """L = gain P/s with P = [[1, 2], [0, 0]], not orthogonal: S goes from I - P at rest to I, whatever the gain."""
    P = np.array([[1.0, 2.0], [0.0, 0.0]])

    def loop_gain(s):
        return P / s[:, None, None] + 1e-10 * np.eye(2) / (s[:, None, None] + 1)  # hardly anything: no eigenvalue is 0

    gains = StableGains(loop_gain, np.array([-0.1 + 5j]), (None, None), INTEGRATOR)
    found = gains.margins(gain)
    assert found.sensitivity_peak == pytest.approx(5**0.5, rel=1e-7)  # columns (0, 0) and (-2, 1) of I - P
    assert found.disk_margin == pytest.approx(1 / np.linalg.norm(P - np.eye(2) / 2, 2), rel=1e-7)
    assert gains.gain_of_peak(2.3, gain) == gain
    with pytest.raises(NoSolutionError, match=r"no gain has a sensitivity of at most 2.2: .* is 2\.236$"):
        gains.gain_of_peak(2.2, gain)


@pytest.mark.parametrize("phase", range(8))
def test_a_crossing_beside_a_narrow_pole_is_found_where_rounding_blurs_the_loop_gain(phase):
    """Truth: -r s/(s^2 + 2 z w s + w^2) is -r/(2 z w) at s = i w."""
    natural, ratio, strength = 7.3, 4e-7, 0.02

    def blurred(s):
        noise = 1 + 1e-5j * np.sin(1e13 * s.imag + phase)
        return (-strength * s / (s**2 + 2 * ratio * natural * s + natural**2) * noise)[:, None, None]

    omega = natural * (1 + ratio * np.array([-6, -2, -0.6, 0.1, 0.6, 2, 6]))
    found = crossings(np.zeros(len(omega), dtype=int), omega, blurred(1j * omega)[:, :, 0])
    found = refined_crossings([blurred], found)
    assert len(found) == 1
    assert found.factor[0] == pytest.approx(2 * ratio * natural / strength, rel=1e-4)


def test_a_loop_gain_of_exactly_minus_one_at_a_frequency_leaves_the_margins_of_others():
    """I + L is singular at one frequency of one loop: S there is infinite, and the other loop's margins are its own."""
    omega = np.geomspace(1e-3, 1e3, 200)
    singular = int(np.argmin(np.abs(omega - 1)))

    def of_two(s):
        return (1 / s)[:, None, None] * np.eye(2)

    def singular_once(s):
        matrices = of_two(s)
        matrices[s.imag == omega[singular]] = -np.eye(2)
        return matrices

    own, other, alone = Margins(singular_once, omega), Margins(of_two, omega), Margins(of_two, omega)
    Margins.peaks.compute([own, other])
    assert np.isfinite(own.peaks).all()
    assert other.peaks == alone.peaks
    assert other.peaks[1][0] == pytest.approx(0.5, rel=1e-9)  # |S - 1/2| of an integrator
