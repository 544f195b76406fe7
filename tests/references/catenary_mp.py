"""The elastic catenary at 50 digits, with or without point loads.

First principles: equilibrium dF/ds = (0, 0, w) gives F = F0 + (0, 0, w s), less every point load already passed;
Hooke's law gives r' = (1 + |F|/EA) F/|F|. Every quantity is an integral of F, 1/|F|, ... over s, and each has a
closed form.

The unknown is the tension vector F0 at end 1. The end position r(L; F0) is the gradient of the complementary energy
sum of integral(|F|^2/(2 EA) + |F|) ds, which is strictly convex in F0: the equilibrium is unique and a Newton method
with line search finds it from any start. The Hessian is the flexibility of end 2. (Irvine, Cable Structures, 1981,
ch. 1, for the catenary; the variational form is derived here.)
"""

from mpmath import mp

DIGITS = 50
_WORK = 90  # digits carried: the closed forms below cancel when w L/T or H/T is tiny


def _integrals(force, length, w, inverse_EA):
    """Integrals over one smooth piece that starts with tension vector `force`.

    Returns the change of position [m]; its derivative with respect to `force`, the integral of I/EA + (I - t t^T)/T
    [m/N]; and the integrals of T^2/(2 EA) + T, and of T [N m].
    """
    Hx, Hy, V0 = force
    h2 = Hx**2 + Hy**2
    V1 = V0 + w * length
    T0, T1 = mp.sqrt(h2 + V0**2), mp.sqrt(h2 + V1**2)
    if w == 0 and T0 == 0:  # slack: anywhere within its length, and it gives without force
        return [mp.mpf(0)] * 3, mp.inf * mp.ones(3), mp.mpf(0), mp.mpf(0)
    if w == 0:
        one, direction = length / T0, V0 * length / T0  # integrals of 1/T and V/T
        c0, c1, c2 = (V0**k * length / T0**3 for k in range(3))  # integrals of V^k/T^3
        tension, square = T0 * length, T0**2 * length
    else:
        h = mp.sqrt(h2)
        one = (mp.asinh(V1 / h) - mp.asinh(V0 / h)) / w
        direction = (T1 - T0) / w
        turn = (V1 / T1 - V0 / T0) / w
        c0, c1, c2 = turn / h2, (1 / T0 - 1 / T1) / w, one - turn
        tension = ((V1 * T1 - V0 * T0) / w + h2 * one) / 2
        square = h2 * length + (V1**3 - V0**3) / (3 * w)
    e = length * inverse_EA
    end = [Hx * (e + one), Hy * (e + one), (V0 + w * length / 2) * e + direction]
    d = e + one
    flexibility = mp.matrix(
        [
            [d - Hx * Hx * c0, -Hx * Hy * c0, -Hx * c1],
            [-Hx * Hy * c0, d - Hy * Hy * c0, -Hy * c1],
            [-Hx * c1, -Hy * c1, d - c2],
        ]
    )
    return end, flexibility, square * inverse_EA / 2 + tension, tension


def _pieces(force0, L, w, loads):
    """(start s, tension vector, length) of each smooth piece of the cable."""
    force, start, pieces = [mp.mpf(f) for f in force0], mp.mpf(0), []
    for s, load in [*sorted(((mp.mpf(s), f) for s, f in loads), key=lambda item: item[0]), (mp.mpf(L), None)]:
        if s < start or s > L:
            raise ValueError(f"load position {s} outside [0, {L}]")
        if s > start:
            pieces.append((start, list(force), s - start))
            force[2] += w * (s - start)
            start = s
        if load is not None:
            force = [f - mp.mpf(p) for f, p in zip(force, load, strict=True)]
    return pieces


def _totals(force0, L, EA, w, loads):
    """End position, flexibility, complementary energy and integral of T of the whole cable."""
    end, flexibility, energy, tension = [mp.mpf(0)] * 3, mp.zeros(3), mp.mpf(0), mp.mpf(0)
    for _, force, length in _pieces(force0, L, w, loads):
        e, f, c, t = _integrals(force, length, w, 1 / EA)
        end = [x + y for x, y in zip(end, e, strict=True)]
        flexibility, energy, tension = flexibility + f, energy + c, tension + t
    return end, flexibility, energy, tension


def _start(span, L, EA, w):
    """A rough tension vector at end 1: inextensible catenary when slack, else the elastic parabola."""
    x, y, z = span
    a, chord = mp.hypot(x, y), mp.sqrt(x * x + y * y + z * z)
    if L / chord > mp.mpf("1.2"):
        ratio = mp.sqrt(L * L - z * z) / a
        low, high = mp.mpf(0), 2 * mp.log(ratio) + 10
        for _ in range(60):
            q = (low + high) / 2
            low, high = (q, high) if mp.sinh(q) < ratio * q else (low, q)
        H, V0 = w * a / (2 * q), w / 2 * (z * mp.coth(q) - L)
    else:
        load = chord * (w * a) ** 2 / 24
        if mp.isinf(EA):
            T = mp.sqrt(load / (L - chord))
        else:
            k = L / EA
            T = max(chord - L, 0) / k + mp.cbrt(load / k)  # above the root, where the cubic is convex
            for _ in range(100):
                step = (k * T**3 + (L - chord) * T**2 - load) / (3 * k * T**2 + 2 * (L - chord) * T)
                T -= step
                if abs(step) < T * mp.mpf(10) ** -25:
                    break
        H, V0 = T * a / chord, T * z / chord - w * L / 2
    return [H * x / a, H * y / a, V0]


def _loaded_start(span, L, EA, w, loads):
    """A rough tension vector at end 1, the loads taken as weight and then each where it is."""
    magnitude = sum((mp.norm(mp.matrix(f)) for _, f in loads), mp.mpf(0))
    force = _start(span, L, EA, w + magnitude / L)
    force[2] += magnitude / 2
    for s, f in loads:
        force = [t + (1 - mp.mpf(s) / L) * mp.mpf(p) for t, p in zip(force, f, strict=True)]
    return force


def _size(vector):
    return mp.sqrt(sum(part * part for part in vector))


def inverse(matrix):
    """Inverse of a 3 x 3 matrix, lists of rows, by its cofactors: it costs twice the digits of the condition number."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    first = e * i - f * h, f * g - d * i, d * h - e * g
    whole = a * first[0] + b * first[1] + c * first[2]
    cofactors = (
        (first[0], c * h - b * i, b * f - c * e),
        (first[1], a * i - c * g, c * d - a * f),
        (first[2], b * g - a * h, a * e - b * d),
    )
    return [[part / whole for part in row] for row in cofactors]


def minimise(totals, force, target, length):
    """Tension vector at end 1 whose end position is `target`, by damped Newton from `force`.

    `totals`: force -> (end [m], flexibility [m/N], complementary energy [N m], ...), the first two the gradient and
    Hessian; `length` is the scale of the residual. ArithmeticError: no convergence in 300 steps.
    """
    end, flexibility, energy, *_ = totals(force)
    for _ in range(300):
        gradient = [e - t for e, t in zip(end, target, strict=True)]
        value = energy - mp.fdot(force, target)
        step = [-mp.fdot(row, gradient) for row in inverse(flexibility.tolist())]
        slope = mp.fdot(step, gradient)
        small = _size(step) < mp.mpf(10) ** -20 * _size(force)
        factor = mp.mpf(1)
        while True:
            trial = [f + factor * d for f, d in zip(force, step, strict=True)]
            end, flexibility, energy, *_ = totals(trial)
            lower = energy - mp.fdot(trial, target) <= value + factor * slope / 1000
            if small or lower or factor < mp.mpf(2) ** -200:
                break
            factor /= 2
        force = trial
        if _size(step) < mp.mpf(10) ** -(DIGITS + 3) * _size(force):
            return tuple(force)
    raise ArithmeticError(f"no convergence: residual {mp.nstr(_size(gradient) / length, 5)} of the length")


def with_a_slack_piece(span, L, EA, loads):
    """Tension vector at end 1 of a weightless cable of which a piece hangs slack; None where all pieces are taut.

    A piece without tension need only be as long as the way between its ends, which the others leave.
    """
    dust = mp.mpf(10) ** (10 - _WORK) * sum(mp.norm(mp.matrix(f)) for _, f in loads)
    for _, passed, _ in _pieces([0, 0, 0], L, 0, loads):
        force0 = tuple(-f for f in passed)
        away, slack = list(span), mp.mpf(0)
        for _, force, length in _pieces(force0, L, 0, loads):
            size = mp.norm(mp.matrix(force))
            if size > dust:
                away = [a - length * (1 / EA + 1 / size) * f for a, f in zip(away, force, strict=True)]
            else:
                slack += length
        if mp.norm(mp.matrix(away)) <= slack:
            return force0
    return None


@mp.workdps(_WORK)
def solve_loaded(span, L, EA, w, loads=(), start=None):
    """Tension vector (Hx, Hy, V0) at end 1 of a cable under its weight and point loads. [N]

    `span`: end 2 from end 1, horizontal distance > 0 [m]; EA may be mp.inf if L > chord. The search begins at `start`
    [N]: there is one answer only, but it can be long in coming near a kink of the energy. ArithmeticError: no
    convergence (no equilibrium, e.g. weightless and slack).
    """
    span, L, EA, w = [mp.mpf(x) for x in span], mp.mpf(L), mp.mpf(EA), mp.mpf(w)
    if not (span[0] or span[1]) or not (L > 0 and EA > 0 and w >= 0):
        raise ValueError("allowed are a horizontal distance > 0, L > 0, EA > 0 and w >= 0")
    if w == 0 and loads:
        force0 = with_a_slack_piece(span, L, EA, loads)
        if force0:
            return force0
    force = _loaded_start(span, L, EA, w, loads) if start is None else [mp.mpf(t) for t in start]
    return minimise(lambda f: _totals(f, L, EA, w, loads), force, span, L)


def solve(a, b, L, EA, w):
    """(H, V0) [N] of the plain cable, whose tension vector is (H, V0 + w s)."""
    H, _, V0 = solve_loaded((a, 0, b), L, EA, w)
    return H, V0


@mp.workdps(_WORK)
def shape_loaded(force0, s, L, EA, w, loads=()):
    """Position (x, y, z) at s, from end 1 [m], of the cable with tension vector `force0` at end 1."""
    s, w, position = mp.mpf(s), mp.mpf(w), [mp.mpf(0)] * 3
    for start, force, length in _pieces(force0, mp.mpf(L), w, loads):
        if s <= start:
            break
        end, *_ = _integrals(force, min(length, s - start), w, 1 / mp.mpf(EA))
        position = [p + e for p, e in zip(position, end, strict=True)]
    return tuple(position)


@mp.workdps(_WORK)
def tension_vector(force0, s, L, w, loads=()):
    """Tension vector (Hx, Hy, V) [N] at s, just after a load at s."""
    s, w = mp.mpf(s), mp.mpf(w)
    start, force, _ = [p for p in _pieces(force0, mp.mpf(L), w, loads) if p[0] <= s][-1]
    return force[0], force[1], force[2] + w * (s - start)


@mp.workdps(_WORK)
def mean_tension_loaded(force0, L, w, loads=()):
    """Mean of T over the unstretched length, the paper's preload. [N]"""
    L, w = mp.mpf(L), mp.mpf(w)
    return _totals(force0, L, mp.inf, w, loads)[3] / L


@mp.workdps(_WORK)
def stretched_length_loaded(force0, L, EA, w, loads=()):
    """Length under load, integral of 1 + T/EA. [m]"""
    return mp.mpf(L) * (1 + mean_tension_loaded(force0, L, w, loads) / mp.mpf(EA))


@mp.workdps(_WORK)
def end_stiffness_loaded(force0, L, EA, w, loads=()):
    """Static stiffness of end 2 in (x, y, z), end 1 fixed: mp.matrix (3, 3). [N/m]

    The tension vector at end 2 differs from the one at end 1 by a constant, so the stiffness is the inverse of the
    flexibility dr(L)/dF0 = integral of I/EA + (I - t t^T)/T ds.
    """
    return _totals(force0, mp.mpf(L), mp.mpf(EA), mp.mpf(w), loads)[1] ** -1


@mp.workdps(_WORK)
def sag_loaded(force0, L, EA, w, loads=()):
    """Vertical distance [m] from the chord down to the cable at half the horizontal span; plane cables with Hx > 0."""
    L = mp.mpf(L)
    a, _, b = shape_loaded(force0, L, L, EA, w, loads)
    low, high = mp.mpf(0), L
    s = L / 2
    for _ in range(400):
        x, _, z = shape_loaded(force0, s, L, EA, w, loads)
        low, high = (s, high) if x < a / 2 else (low, s)
        F = tension_vector(force0, s, L, w, loads)
        T = mp.norm(mp.matrix(F))
        new = s - (x - a / 2) / ((1 / mp.mpf(EA) + 1 / T) * F[0])
        new = new if low <= new <= high else (low + high) / 2  # at the root itself it stays
        if abs(new - s) < mp.mpf(10) ** -(DIGITS + 5) * L:
            break
        s = new
    return b / 2 - z


def shape(H, V0, s, EA, w):
    """Position (x, z) at s of the plain cable. [m]"""
    x, _, z = shape_loaded((H, 0, V0), s, s, EA, w) if s > 0 else (mp.mpf(0),) * 3
    return x, z


def mean_tension(H, V0, L, w):
    """`mean_tension_loaded` of the plain cable."""
    return mean_tension_loaded((H, 0, V0), L, w)


def stretched_length(H, V0, L, EA, w):
    """`stretched_length_loaded` of the plain cable."""
    return stretched_length_loaded((H, 0, V0), L, EA, w)


def sag(H, V0, L, EA, w):
    """`sag_loaded` of the plain cable."""
    return sag_loaded((H, 0, V0), L, EA, w)


def end_stiffness(H, V0, L, EA, w):
    """`end_stiffness_loaded` of the plain cable."""
    return end_stiffness_loaded((H, 0, V0), L, EA, w)
