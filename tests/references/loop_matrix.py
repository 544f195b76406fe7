"""The winch loop as one dense matrix: modes, gondola, notch and integrator as states, stability by eigenvalues.

From the second-order form of the cable with modal damping, its ends moved by e:

    q'' + 2 zeta W q' + W^2 q = -p e,    f = D e + R e'' + p^T q

with the notch n'' + 2 z2 w2 n' + w2^2 n = x, y' = z = N x = (w2/w1)^2 (n'' + 2 z1 w1 n' + w1^2 n), u = sign gain y. The
residual inertia R needs u'' = sign gain z', which is a combination of the states; nothing is differentiated.
"""

from types import SimpleNamespace

import numpy as np

from . import bars

START, END = 0, 3  # x of end 1, x of end 2


def cable_of_bars(chain, L, EA, m, ratio):
    """What `matrices` needs of a cable of bars: all modes between fixed ends that x of an end excites, with one ratio.

    The chain is a `bars.Chain`; M and C of fixed ends act on absolute motion, so that R is the mass of the end nodes.
    """
    K, M = bars.matrices(chain, L, EA, m)
    inner, ends = np.s_[3:-3], np.r_[0:3, -3:0]
    root = np.sqrt(M[inner])
    square, vectors = np.linalg.eigh(K[inner, inner] / np.outer(root, root))
    participation = (vectors / root[:, None]).T @ K[inner][:, ends]
    excited = np.abs(participation[:, [START, END]]).max(axis=1) > 1e-9 * np.abs(participation).max()
    omega, participation = np.sqrt(square[excited]), participation[excited]
    scaled = participation / omega[:, None]
    return SimpleNamespace(
        omega=omega, participation=participation, damping_ratio=np.full(len(omega), ratio),
        stiffness=K[np.ix_(ends, ends)] - scaled.T @ scaled, residual_inertia=np.diag(M[ends]),
    )  # fmt: skip


def feedthrough(cable):
    """D: static stiffness plus what the modes take off it, shape (6, 6). [N/m]"""
    scaled = cable.participation / cable.omega[:, None]
    return cable.stiffness + scaled.T @ scaled


def notch(s, omega, ratio, rolloff_omega, rolloff_ratio):
    """N(s)."""
    zero, pole = s / omega, s / rolloff_omega
    return (zero**2 + 2 * ratio * zero + 1) / (pole**2 + 2 * rolloff_ratio * pole + 1)


def matrices(loop, gain):
    """A of the closed loop of modal damping, and the column of a force on the gondola; gain in rad/s.

    States: q, q', x, x', n, n', y; the gondola's place is state `place(A)`, its velocity the next one.
    """
    cable, n = loop.cable, len(loop.cable.omega)
    D, R = feedthrough(cable), cable.residual_inertia
    ground = loop.location == "ground"
    winch, sign = (START, -1.0) if ground else (END, 1.0)
    size = 2 * n + 5
    unit = np.eye(size)
    q, rate = unit[:n], unit[n : 2 * n]
    x, v, filtered, slope, y = unit[2 * n :]
    if loop.notch is None:
        z, change = x, v
        bend = np.zeros(size)
        filtered, slope = -slope, np.zeros(size)  # two idle states, stable
        idle = True
    else:
        w1, z1 = loop.notch.omega, loop.notch.damping_ratio
        w2, z2 = loop.notch.rolloff_omega, loop.notch.rolloff_damping_ratio
        bend = x - 2 * z2 * w2 * slope - w2**2 * filtered
        factor = (w2 / w1) ** 2
        z = factor * (bend + 2 * z1 * w1 * slope + w1**2 * filtered)
        jerk = v - 2 * z2 * w2 * bend - w2**2 * slope
        change = factor * (jerk + 2 * z1 * w1 * bend + w1**2 * slope)
        idle = False
    u, u_acceleration = sign * gain * y, sign * gain * change
    force = D[END, END] * x + D[END, winch] * u + R[END, winch] * u_acceleration + cable.participation[:, END] @ q
    mass = loop.mass + R[END, END]
    A = np.zeros((size, size))
    A[:n] = rate
    A[n : 2 * n] = -(cable.omega**2)[:, None] * q - (2 * cable.damping_ratio * cable.omega)[:, None] * rate
    A[n : 2 * n] -= np.outer(cable.participation[:, END], x) + np.outer(cable.participation[:, winch], u)
    A[2 * n] = v
    A[2 * n + 1] = -(force + loop.damping * v) / mass
    A[2 * n + 2], A[2 * n + 3] = (-unit[2 * n + 2], -unit[2 * n + 3]) if idle else (slope, bend)
    A[2 * n + 4] = z
    return A, unit[2 * n + 1] / mass


def gain_of_bars(loop, s):
    """N(s) times the movement of the gondola that a winch on the ground corrects over that of the winch, shape (f,)."""
    cable, s, ends = loop.cable, s[:, None], [START, END]
    receptance = 1 / (s**2 + 2 * cable.damping_ratio * cable.omega * s + cable.omega**2)
    of_modes = receptance @ (cable.participation[:, ends] * cable.participation[:, [END]])
    ground, own = (feedthrough(cable)[END, ends] - of_modes + s**2 * cable.residual_inertia[END, ends]).T
    parts = (getattr(loop.notch, name) for name in ("omega", "damping_ratio", "rolloff_omega", "rolloff_damping_ratio"))
    return notch(s[:, 0], *parts) * -ground / (loop.mass * s[:, 0] ** 2 + own)


def place(A):
    """Number of the state that is the gondola's place."""
    return len(A) - 5


def unstable(loop, gain):
    """How many eigenvalues lie to the right."""
    return int((np.linalg.eigvals(matrices(loop, gain)[0]).real > 0).sum())
