"""The references against closed forms and other methods; the program is held against them elsewhere."""

import itertools
import math

import numpy as np
import pytest
from cables import EA, MASS, G, graded_error
from mpmath import mp
from references import bars, catenary_mp, continuous_cable, taut_string
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import jv, yv

PAPER = (185.8, 0.0, 184.4883, EA, MASS, G)
SAGGING = (185.8, 0.0, 186.0, EA, MASS, G)  # sag 4.1 m, about 1:45
COS80, SIN80 = math.cos(math.radians(80)), math.sin(math.radians(80))
CABLES = {  # a, b, L, EA, m, g
    "paper": PAPER,
    "sagging": SAGGING,
    "inclined 19 degrees": (175.68, 60.49, 184.4883, EA, MASS, G),
    "steep 80 degrees": (185.8 * COS80, 185.8 * SIN80, 185.9, EA, MASS, G),
    "slack 1.5": (100.0, 10.0, 150.0, EA, MASS, G),
    "slack 3": (100.0, -20.0, 300.0, EA, MASS, G),
    "stiff, EA/T 3e9": (100.0, 30.0, 104.4031, 1e13, 0.01, G),
    "ultra-taut, strain 1e-9": (100.0, 30.0, math.hypot(100.0, 30.0) * (1 - 1e-9), 1e12, 1e-3, G),
}
each_cable = pytest.mark.parametrize("cable", CABLES.values(), ids=CABLES.keys())


def as_array(matrix):
    return np.array(matrix.tolist(), dtype=float)


# ---- catenary_mp ----------------------------------------------------------------------------------------------------


@each_cable
def test_catenary_closes_by_quadrature_of_hookes_law(cable):
    a, b, L, stiffness, m, g = cable
    w = mp.mpf(m * g)
    with mp.workdps(40):
        H, V0 = catenary_mp.solve(a, b, L, stiffness, m * g)
        low = min(max(-V0 / w, 0), L)  # the lowest point, where the integrand bends
        grid = sorted({mp.mpf(0), *(x for k in range(-3, 8) for x in (low - 4**k, low + 4**k) if 0 < x < L), mp.mpf(L)})
        x = mp.quad(lambda s: H * (1 / mp.hypot(H, V0 + w * s) + 1 / mp.mpf(stiffness)), grid)
        z = mp.quad(lambda s: (V0 + w * s) * (1 / mp.hypot(H, V0 + w * s) + 1 / mp.mpf(stiffness)), grid)
        assert abs(x - a) < mp.mpf("1e-25") * L
        assert abs(z - b) < mp.mpf("1e-25") * L


def test_weightless_cable_is_a_straight_bar():
    """T = EA (c/L - 1), K = EA/L n n^T + T/c (I - n n^T): Hooke's law."""
    a, b, L = 3.0, 4.0, 4.99
    H, V0 = catenary_mp.solve(a, b, L, 1e6, 0)
    T, n = 1e6 * (5 / L - 1), np.array([0.6, 0, 0.8])
    assert float(mp.hypot(H, V0)) == pytest.approx(T, rel=1e-13)
    K = 1e6 / L * np.outer(n, n) + T / 5 * (np.eye(3) - np.outer(n, n))
    assert as_array(catenary_mp.end_stiffness(H, V0, L, 1e6, 0)) == pytest.approx(K, rel=1e-12, abs=1e-6)
    assert float(catenary_mp.stretched_length(H, V0, L, 1e6, 0)) == pytest.approx(5, rel=1e-14)


def test_nearly_vertical_taut_cable():
    """a -> 0, taut: T(s) = EA (b/L - 1) + w (s - L/2), from Hooke's law along a vertical line; K_yy = H/a exactly."""
    a, b, L, stiffness, w = 1e-9, 50.0, 49.9, 1e6, 7.0
    H, V0 = catenary_mp.solve(a, b, L, stiffness, w)
    assert float(V0) == pytest.approx(stiffness * (b / L - 1) - w * L / 2, rel=1e-12)
    K = catenary_mp.end_stiffness(H, V0, L, stiffness, w)
    assert float(K[2, 2]) == pytest.approx(stiffness / L, rel=1e-12)
    assert float(K[1, 1]) == pytest.approx(float(H) / a, rel=1e-12)


def test_nearly_vertical_hanging_loop():
    """a -> 0, slack: two hanging strands p, q with p + q = L and (q - p)(1 + w L/(2 EA)) = b."""
    a, b, L, stiffness, w = 1e-12, 20.0, 100.0, 1e5, 7.0
    H, V0 = catenary_mp.solve(a, b, L, stiffness, w)
    p = (L - b / (1 + w * L / (2 * stiffness))) / 2
    assert float(V0) == pytest.approx(-w * p, rel=1e-10)
    depth = p + w * p**2 / (2 * stiffness)
    assert float(catenary_mp.shape(H, V0, -V0 / w, stiffness, w)[1]) == pytest.approx(-depth, rel=1e-10)


def test_loaded_weightless_cable_is_the_chain_of_bars():
    """Half a bar's weight at each node of a weightless cable: the two programs share no formula for the shape."""
    n, w = 12, MASS * G
    loads = [(mp.mpf(150) * k / n, (0, 0, -mp.mpf(w) * 150 / n)) for k in range(1, n)]
    force0 = catenary_mp.solve_loaded((100, 0, 10), 150, EA, 0, loads)
    chain = bars.solve_spatial((100, 0, 10), 150, EA, w, n)
    position = catenary_mp.shape_loaded(force0, mp.mpf(150) * 5 / n, 150, EA, 0, loads)
    assert np.array(position, dtype=float) == pytest.approx(chain.nodes[5], rel=1e-13, abs=1e-13)
    K = as_array(catenary_mp.end_stiffness_loaded(force0, 150, EA, 0, loads))
    assert graded_error(K, chain.end_stiffness) < 1e-13
    mean = catenary_mp.mean_tension_loaded(force0, 150, 0, loads)
    assert float(mean) == pytest.approx(chain.tensions.mean(), rel=1e-13)


def test_spatial_loads_end_stiffness_by_differences():
    loads, span, h = [(40, (3, 5, -20)), (110, (-1, -2, 30))], (100, 20, 10), mp.mpf("1e-15")
    with mp.workdps(60):
        force0 = catenary_mp.solve_loaded(span, 130, 1e5, 0.5, loads)
        K = catenary_mp.end_stiffness_loaded(force0, 130, 1e5, 0.5, loads)
        end = catenary_mp.shape_loaded(force0, 130, 130, 1e5, 0.5, loads)
        assert max(abs(e - s) for e, s in zip(end, span, strict=True)) < mp.mpf("1e-48")
        for j in range(3):
            moved = [x + (h if i == j else 0) for i, x in enumerate(span)]
            force = catenary_mp.solve_loaded(moved, 130, 1e5, 0.5, loads)
            for i in range(3):
                assert abs((force[i] - force0[i]) / h - K[i, j]) < 1e-11 * mp.sqrt(K[i, i] * K[j, j])


# ---- continuous_cable -----------------------------------------------------------------------------------------------


def test_weightless_taut_cable_is_a_string_and_a_rod():
    """Exact for g = 0: sqrt(D/m)/(2 L) with D = T/(1 + T/EA) across and EA along, per unstretched length."""
    a, b, L, m = 60.0, 80.0, 99.0, 0.2
    T = 1e5 * (100 / L - 1)
    string = taut_string.string_frequencies(6, L, T / (1 + T / 1e5), m)
    rod = taut_string.axial_frequencies(2, L, 1e5, m)
    f = continuous_cable.frequencies(a, b, L, 1e5, m, 0.0, 14)
    expected = np.sort(np.r_[taut_string.string_frequencies(30, L, T / (1 + T / 1e5), m), rod])[:14]
    assert f == pytest.approx(expected, rel=1e-12)
    assert continuous_cable.frequencies(a, b, L, 1e5, m, 0.0, 6, "out") == pytest.approx(string, rel=1e-13)


def test_weightless_dynamic_stiffness_is_the_cotangent():
    """Forced string or rod: D k cot(k L) on the moved end, -D k/sin(k L) on the other, k = omega sqrt(m/D)."""
    L, m, omega = 99.0, 0.2, 55.0
    T = 1e5 * (100 / L - 1)
    chord_axes = np.kron(np.eye(2), np.array([[0.6, 0, -0.8], [0, 1, 0], [0.8, 0, 0.6]]))  # along, y, across
    K = continuous_cable.dynamic_stiffness_both_ends(60.0, 80.0, L, 1e5, m, 0.0, omega)
    K = chord_axes.T @ K @ chord_axes
    for j, D in ((0, 1e5), (1, T / (1 + T / 1e5)), (2, T / (1 + T / 1e5))):
        k = omega * math.sqrt(m / D)
        assert K[3 + j, 3 + j] == pytest.approx(D * k / math.tan(k * L), rel=1e-10)
        assert K[j, 3 + j] == pytest.approx(-D * k / math.sin(k * L), rel=1e-10)


def test_hanging_cable_is_bessel():
    """Vertical, T = V0 + w s, inextensible: u = Z0(2 omega sqrt(tau/g)), tau = s + V0/w (Bernoulli's chain)."""
    a, b, L, stiffness, m = 1e-4, 100.00000001, 100.0, 1e14, 1.0
    V0 = catenary_mp.solve(a, b, L, stiffness, m * G)[1]
    tau = np.array([float(V0) / (m * G), float(V0) / (m * G) + L])

    def determinant(f):
        p, q = 2 * (2 * np.pi * f) * np.sqrt(tau / G)
        return jv(0, p) * yv(0, q) - jv(0, q) * yv(0, p)

    f = continuous_cable.frequencies(a, b, L, stiffness, m, G, 5, "out")
    exact = [brentq(determinant, x * 0.99, x * 1.01, xtol=1e-14) for x in f]
    assert f == pytest.approx(exact, rel=1e-9)  # neglected: T/EA = 1e-10, (a/L)^2 = 1e-12


@pytest.mark.parametrize(
    ("cable", "loads", "omega"),
    [
        (SAGGING, [], 6.0),
        (CABLES["steep 80 degrees"], [], 6.0),
        (CABLES["slack 1.5"], [(60.0, (0.3, 0, -2.0))], 1.2),
        (CABLES["inclined 19 degrees"], [(50.0, (0, 0, -40.0)), (120.0, (20.0, 0, 30.0))], 40.0),
    ],
)
def test_dynamic_stiffness_by_initial_value_integration(cable, loads, omega):
    """The same equations integrated by a Runge-Kutta method in stiffness form, in global axes."""
    a, b, L, stiffness, m, g = cable
    force0 = catenary_mp.solve_loaded((a, 0, b), L, stiffness, m * g, loads)
    state = np.eye(6)  # columns: unit u(0), then unit N(0)
    edges = [0.0, *(s for s, _ in loads), L]
    for low, high in itertools.pairwise(edges):
        F = np.array(catenary_mp.tension_vector(force0, (low + high) / 2, L, m * g, loads), dtype=float)

        def rate(s, y, F=F, middle=(low + high) / 2):
            vector = F + np.array([0, 0, m * g * (s - middle)])
            T = np.linalg.norm(vector)
            t = vector / T
            D = stiffness * np.outer(t, t) + T / (1 + T / stiffness) * (np.eye(3) - np.outer(t, t))
            u, N = y.reshape(2, 3, 6)
            return np.concatenate([np.linalg.solve(D, N), -m * omega**2 * u]).ravel()

        state = solve_ivp(rate, (low, high), state.ravel(), "DOP853", rtol=1e-11, atol=1e-11).y[:, -1].reshape(6, 6)
    c = np.linalg.inv(state[:3, 3:])
    K = np.block([[c @ state[:3, :3], -c], [state[3:, :3] - state[3:, 3:] @ c @ state[:3, :3], state[3:, 3:] @ c]])
    ours = continuous_cable.dynamic_stiffness_both_ends(*cable, omega, loads=loads)
    assert np.max(np.abs(ours - K)) < 1e-7 * np.max(np.abs(K))
    assert np.max(np.abs(ours - ours.T)) < 1e-11 * np.max(np.abs(ours))
