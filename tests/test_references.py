"""The reference solutions check one another and closed forms, before any test leans on them."""

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

MODULUS, DENSITY = 70.3e9, 1440.0  # the paper's Table 1
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


def chord_axes(a, b):
    """Rotation from (along, y, across) to (x, y, z)."""
    c, s = a / math.hypot(a, b), b / math.hypot(a, b)
    return np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])


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


@each_cable
def test_design_section_5_formulas(cable):
    """a, b and the flexibility in the form of DESIGN section 5, evaluated at 60 digits."""
    a, b, L, stiffness, m, g = cable
    with mp.workdps(60):
        H, V0 = catenary_mp.solve(a, b, L, stiffness, m * g)
        w, L, stiffness = mp.mpf(m * g), mp.mpf(L), mp.mpf(stiffness)
        V1, Vm = V0 + w * L, V0 + w * L / 2
        T0, T1 = mp.hypot(H, V0), mp.hypot(H, V1)
        S = T0 + T1
        beta = w * L / S
        small = mp.mpf("1e-45") * L
        assert abs(H * L * (1 / stiffness + 2 * mp.atanh(beta) / (beta * S)) - a) < small
        assert abs(Vm * L * (1 / stiffness + 2 / S) - b) < small
        Np, Nm = (T1 + V1) + (T0 - V0), (T1 - V1) + (T0 + V0)
        assert abs(mp.log(Np / Nm) / 2 / mp.atanh(beta) - 1) < mp.mpf("1e-35")
        c = 2 * L * H**2 * S / (T0 * T1 * Np * Nm)
        xx, xz = L / stiffness + 2 * L / S * mp.atanh(beta) / beta - c, -2 * H * L * Vm / (S * T0 * T1)
        flexibility = mp.matrix([[xx, 0, xz], [0, a / H, 0], [xz, 0, L / stiffness + c]])
        unity = flexibility * catenary_mp.end_stiffness(H, V0, L, stiffness, w)
        assert mp.norm(unity - mp.eye(3)) < mp.mpf("1e-30")
        if beta < 0.02:
            d = -sum(mp.mpf(2 * k) / (2 * k + 1) * beta ** (2 * k) for k in range(1, 5))
            q = (H**2 * (V0**2 + V1**2) + V0**2 * V1**2) / ((T0 * T1 + H**2) * T0 * T1)
            series = L / stiffness + 2 * L / S * (d + q / (1 - beta**2))
            # the first term left out of the series is 10/11 beta^10
            assert abs(series - xx) < 2 * L / S * beta**10 + mp.mpf("1e-40") * xx


@each_cable
def test_end_stiffness_is_the_derivative_of_the_end_force(cable):
    a, b, L, stiffness, m, g = cable
    w, h = m * g, mp.mpf("1e-18")
    with mp.workdps(60):
        K = catenary_mp.end_stiffness_loaded(catenary_mp.solve_loaded((a, 0, b), L, stiffness, w), L, stiffness, w)
        for j in range(3):
            step = [h if i == j else mp.mpf(0) for i in range(3)]
            plus, minus = (
                catenary_mp.solve_loaded([p + k * d for p, d in zip((a, 0, b), step, strict=True)], L, stiffness, w)
                for k in (1, -1)
            )
            for i in range(3):
                difference = (plus[i] - minus[i]) / (2 * h)
                assert abs(difference - K[i, j]) < mp.mpf("1e-9") * mp.sqrt(K[i, i] * K[j, j])


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


def test_taut_limit_of_the_sag():
    """Parabola: sag = w l^2/(8 T) with w per deformed length. Irvine (1981), ch. 1."""
    a, b, L, stiffness, m, g = PAPER
    H, V0 = catenary_mp.solve(a, b, L, stiffness, m * g)
    assert float(catenary_mp.sag(H, V0, L, stiffness, m * g)) == pytest.approx(
        m * g * L / a * a**2 / (8 * float(H)), rel=1e-6
    )


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


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (((0, 0, 5), 4, 1e6, 1), "allowed"),
        (((5, 0, 0), -4, 1e6, 1), "allowed"),
        (((5, 0, 0), 4, 1e6, -1), "allowed"),
        (((5, 0, 0), 6, 1e6, 1, [(7, (0, 0, -1))]), "outside"),
    ],
)
def test_nonsense_is_refused(bad, reason):
    with pytest.raises(ValueError, match=reason):
        catenary_mp.solve_loaded(*bad)


# ---- continuous_cable -----------------------------------------------------------------------------------------------


@each_cable
def test_static_limit_is_the_catenary(cable):
    a, b, L, stiffness, m, g = cable
    H, V0 = catenary_mp.solve(a, b, L, stiffness, m * g)
    exact = as_array(catenary_mp.end_stiffness(H, V0, L, stiffness, m * g))
    K, error = continuous_cable.static_end_stiffness(*cable, full_output=True)
    assert error < 1e-13
    assert graded_error(K, exact) < 2e-14


def test_static_limit_in_chord_axes_keeps_the_transverse_digits():
    a, b, L, stiffness, m, g = cable = CABLES["stiff, EA/T 3e9"]
    with mp.workdps(50):
        H, V0 = catenary_mp.solve(a, b, L, stiffness, m * g)
        chord = mp.hypot(a, b)
        R = mp.matrix([[a / chord, 0, -b / chord], [0, 1, 0], [b / chord, 0, a / chord]])
        exact = as_array(R.T * catenary_mp.end_stiffness(H, V0, L, stiffness, m * g) * R)
    assert graded_error(continuous_cable.static_end_stiffness(*cable, axes="chord"), exact) < 1e-13


@each_cable
def test_frequencies_converge_in_both_planes(cable):
    for plane in ("in", "out"):
        f, error = continuous_cable.frequencies(*cable, 10, plane, full_output=True)
        assert error < 1e-12
        assert np.all(np.diff(f) > 0)


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
    K = continuous_cable.dynamic_stiffness_both_ends(60.0, 80.0, L, 1e5, m, 0.0, omega, axes="chord")
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
    ours, error = continuous_cable.dynamic_stiffness_both_ends(*cable, omega, loads=loads, full_output=True)
    assert error < 1e-10
    assert np.max(np.abs(ours - K)) < 1e-7 * np.max(np.abs(K))
    assert np.max(np.abs(ours - ours.T)) < 1e-11 * np.max(np.abs(ours))


@pytest.mark.parametrize("loads", [None, [(70.0, (5.0, 0, -30.0))]], ids=["plain", "loaded"])
def test_end_forces_are_the_residues_of_the_dynamic_stiffness(loads):
    """Near a mode K(omega) -> -p p^T/(Omega^2 - omega^2), which ties participation to an independent computation."""
    result = continuous_cable.modes(*SAGGING, 3, loads=loads)
    for f, p in zip(result.frequencies, result.end_forces.reshape(3, 6), strict=True):
        near, step = 2 * np.pi * f, 1e-6
        sides = (near * (1 - step), near * (1 + step))
        K = [continuous_cable.dynamic_stiffness_both_ends(*SAGGING, omega, loads=loads) for omega in sides]
        residue = (K[1] - K[0]) * near**2 * step  # the regular part drops out
        assert residue == pytest.approx(np.outer(p, p), rel=1e-4, abs=1e-5 * np.max(p**2))


def test_shapes_are_orthonormal():
    result = continuous_cable.modes(*CABLES["slack 3"], 4)
    f, error = continuous_cable.frequencies(*CABLES["slack 3"], 4, n=10, full_output=True)
    assert f == pytest.approx(result.frequencies, rel=10 * error)
    weights = np.polynomial.legendre.leggauss(result.points)[1]
    pieces = result.s.reshape(-1, result.points)
    x = np.polynomial.legendre.leggauss(result.points)[0]
    sizes = (pieces[:, -1] - pieces[:, 0]) / (x[-1] - x[0])
    gram = np.einsum("s,psi,qsi->pq", MASS * np.outer(sizes, weights).ravel(), result.shapes, result.shapes)
    assert gram == pytest.approx(np.eye(4), abs=1e-12)


def test_irvine_symmetric_modes_of_a_nearly_inextensible_cable():
    """EA/T = 3e9 with lambda^2 of order 100: Irvine's theory is then exact to the order (sag/l)^2 = 1e-7."""
    a, b, L, stiffness, m, g = cable = CABLES["stiff, EA/T 3e9"]
    H, V0 = catenary_mp.solve(a, b, L, stiffness, m * g)
    chord, tension = math.hypot(a, b), float(catenary_mp.mean_tension(H, V0, L, m * g))
    lambda_squared = taut_string.irvine_parameter(m * g * a / chord, chord, stiffness, tension)
    symmetric = taut_string.irvine_symmetric(3, lambda_squared) / (2 * np.pi * chord) * math.sqrt(tension / m)
    f = continuous_cable.frequencies(*cable, 6)
    for expected in symmetric:
        assert np.min(np.abs(f / expected - 1)) < 1e-5


def test_hysteretic_stiffness_is_complex_and_symmetric():
    K = continuous_cable.dynamic_end_stiffness(*PAPER, 4.0, eta=0.02)
    assert np.iscomplexobj(K)
    assert K[0, 0].imag / K[0, 0].real == pytest.approx(0.02, rel=0.02)  # nearly all of k_xx is elastic at 0.6 Hz
    with pytest.raises(ValueError, match="plane"):
        continuous_cable.frequencies(*PAPER, 2, plane="diagonal")
    with pytest.raises(ValueError, match="fy = 0"):
        continuous_cable.frequencies(*PAPER, 2, loads=[(50.0, (0, 1.0, 0))])


# ---- bars -----------------------------------------------------------------------------------------------------------


@each_cable
def test_bars_converge_to_the_catenary_at_second_order(cable):
    a, b, L, stiffness, m, g = cable
    H, V0 = catenary_mp.solve(a, b, L, stiffness, m * g)
    mean = catenary_mp.mean_tension(H, V0, L, m * g)
    K = as_array(catenary_mp.end_stiffness(H, V0, L, stiffness, m * g))
    R = chord_axes(a, b)
    errors = []
    for n in (40, 80):
        chain = bars.solve_spatial((a, 0, b), L, stiffness, m * g, n)
        across = (R.T @ (chain.end_stiffness - K) @ R)[1, 1] / K[1, 1]
        errors.append([chain.tensions.mean() / float(mean) - 1, across])
    order = np.log2(np.divide(*errors))
    assert order == pytest.approx([2, 2], abs=0.12)


@pytest.mark.parametrize("name", ["paper", "sagging", "inclined 19 degrees", "slack 1.5"])
def test_bars_frequencies_converge_to_the_continuous_cable(name):
    a, b, L, stiffness, m, g = cable = CABLES[name]
    exact = np.sort(np.r_[continuous_cable.frequencies(*cable, 6), continuous_cable.frequencies(*cable, 6, "out")])[:6]
    errors = []
    for n in (40, 80):
        chain = bars.solve_spatial((a, 0, b), L, stiffness, m * g, n)
        errors.append(bars.modes(chain, L, stiffness, m).frequencies[:6] / exact - 1)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.1)


def test_bars_dynamics_converge_to_the_continuous_cable():
    exact = continuous_cable.dynamic_end_stiffness(*SAGGING, 4.0)
    a, b, L, stiffness, m, g = SAGGING
    errors = []
    for n in (60, 120):
        chain = bars.solve_spatial((a, 0, b), L, stiffness, m * g, n)
        K = bars.dynamic_end_stiffness(chain, L, stiffness, m, 4.0)
        K -= 16.0 * m * L / (2 * n) * np.eye(3)  # the mass lumped on end 2, which the continuous cable carries
        errors.append(np.max(np.abs(K - exact)) / np.max(np.abs(exact)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.15)


@pytest.mark.parametrize("name", ["paper", "sagging", "steep 80 degrees", "slack 3"])
def test_condensed_stiffness_is_the_inverse_flexibility(name):
    a, b, L, stiffness, m, g = CABLES[name]
    chain = bars.solve_spatial((a, 0, b), L, stiffness, m * g, 40)
    K = bars.dynamic_end_stiffness(chain, L, stiffness, m)
    assert np.max(np.abs(K - chain.end_stiffness)) < 1e-11 * stiffness / L


def test_bars_are_in_equilibrium_with_spatial_loads():
    """Forces of the bars, from their lengths alone, balance weight and loads at each node."""
    span, L, stiffness, w, n, loads = (100.0, 20.0, 10.0), 130.0, 1e5, 0.5, 10, [(3, (3.0, 5.0, -20.0))]
    chain = bars.solve_spatial(span, L, stiffness, w, n, loads)
    length = np.linalg.norm(chain.vectors, axis=1)
    force = (stiffness * (length / (L / n) - 1) / length)[:, None] * chain.vectors
    unbalance = np.diff(force, axis=0) + np.array([0, 0, -w * L / n])
    unbalance[2] += loads[0][1]
    assert np.max(np.abs(unbalance)) < 1e-9
    assert chain.nodes[-1] == pytest.approx(span, rel=1e-14)
    tensions, nodes = bars.solve(100.0, 10.0, L, stiffness, w, n)
    assert tensions.shape == (n,)
    assert nodes.shape == (n + 1, 2)


def test_participation_and_static_stiffness_are_one_sum():
    """K11 - sum p p^T/Omega^2 over all modes = condensed stiffness; with 5 axial modes 30 923 N/m (DESIGN 6)."""
    a, b, L, stiffness, m, g = PAPER
    chain = bars.solve_spatial((a, 0, b), L, stiffness, m * g, 40)
    result = bars.modes(chain, L, stiffness, m)
    direct = bars.matrices(chain, L, stiffness, m)[0][-3, -3]
    share = (result.participation[:, 0] / (2 * np.pi * result.frequencies)) ** 2
    assert direct - share.sum() == pytest.approx(chain.end_stiffness[0, 0], rel=1e-10)
    axial = np.flatnonzero(result.axial > 0.5)
    assert len(axial) == 39
    assert direct - share[axial[:5]].sum() == pytest.approx(30923, abs=0.5)


def test_design_section_4_figures():
    """Errors of 40 and 160 bars against the continuous cable: first 8 frequencies, k_xx; one printed digit."""
    for cable, n, f_error, K_error in [(PAPER, 40, 4e-3, 2e-7), (SAGGING, 40, 4e-3, 2e-4), (PAPER, 160, 3e-4, 1e-8)]:
        a, b, L, stiffness, m, g = cable
        exact = np.sort([continuous_cable.frequencies(*cable, 8, plane) for plane in ("in", "out")], axis=None)[:8]
        chain = bars.solve_spatial((a, 0, b), L, stiffness, m * g, n)
        f = bars.modes(chain, L, stiffness, m).frequencies[:8]
        assert float(f"{np.max(np.abs(f / exact - 1)):.0e}") == f_error
        K = continuous_cable.static_end_stiffness(*cable)
        assert float(f"{abs(chain.end_stiffness[0, 0] / K[0, 0] - 1):.0e}") == K_error


# ---- taut_string ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lambda_squared", [1e-6, 0.03, 1.0, 4 * math.pi**2, 300.0, 1e8])
def test_irvine_tangent_form_solves_the_pole_free_form(lambda_squared):
    """DESIGN section 8; lambda^2 = 4 pi^2 is the crossover, where Omega_1 = 2 pi; lambda -> inf gives 2.86 pi."""
    roots = taut_string.irvine_symmetric(5, lambda_squared)
    y, x = roots / 2, lambda_squared / roots**2
    assert np.max(np.abs(np.cos(y) * (1 - x) + x * np.sin(y) / y)) < 1e-13 * max(1, lambda_squared)
    if lambda_squared == 4 * math.pi**2:
        assert roots[0] == pytest.approx(2 * math.pi, rel=1e-15)
    if lambda_squared == 1e8:
        assert roots[0] / math.pi == pytest.approx(2.86, abs=0.001)  # Irvine (1981), section 3.2
    if lambda_squared < 1e-5:
        assert roots == pytest.approx(taut_string.irvine_symmetric(5, 0), rel=1e-6)


def test_irvine_with_stretch_is_the_exact_taut_cable():
    """DESIGN section 8: mass and stiffness per deformed length."""
    a, b, L, stiffness, m, g = PAPER
    H = float(catenary_mp.solve(a, b, L, stiffness, m * g)[0])
    irvine = taut_string.irvine_frequencies(3, a, H, m * L / a, stiffness * a / L)
    exact = continuous_cable.frequencies(*PAPER, 5)[[0, 2, 4]]
    assert irvine == pytest.approx(exact, rel=1e-6)
    assert exact[:2] == pytest.approx([1.59146, 4.77363], abs=6e-6)


def test_an_axial_frequency_is_that_of_a_rod():
    """k/(2 L0) sqrt(EA/m), hardly coupled to the transverse modes."""
    exact = taut_string.axial_frequencies(1, PAPER[2], MODULUS, DENSITY)[0]
    assert continuous_cable.frequencies(*PAPER, 12)[11] == pytest.approx(exact, rel=1e-4)
