"""The chain of n equal bars: the paper's model, solved by means that no finite-element program uses.

Statics: the tension vector of the first bar fixes all others (each node adds its weight), each bar's extension follows,
and the first vector is found so that the chain ends where it must. The residual is the gradient of the strictly convex
complementary energy sum l0 (T^2/(2 EA) + T), so the equilibrium is unique (see catenary_mp). Dynamics: dense textbook
bars.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from mpmath import mp

from . import catenary_mp

_WORK = 80
ENDS = np.array([[1, -1], [-1, 1]])  # forces on both ends of a bar by their displacements


def _chain(force0, weights, length, inverse_EA):
    """End position, flexibility, complementary energy, and the bars' (tension vector, bar vector)."""
    force, end, energy = [mp.mpf(f) for f in force0], [mp.mpf(0)] * 3, mp.mpf(0)
    diagonal, outer, bars = mp.mpf(0), [mp.mpf(0)] * 6, []
    pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
    for weight in [(0, 0, 0), *weights]:
        force = [f - p for f, p in zip(force, weight, strict=True)]
        T2 = sum(f * f for f in force)
        T = mp.sqrt(T2)
        stretch = length * (inverse_EA + 1 / T)
        bar = [stretch * f for f in force]
        bars.append((force, bar, T))
        end = [e + d for e, d in zip(end, bar, strict=True)]
        energy += length * (T2 * inverse_EA / 2 + T)
        diagonal += stretch
        factor = length / (T2 * T)
        outer = [o + factor * force[i] * force[j] for o, (i, j) in zip(outer, pairs, strict=True)]
    flexibility = diagonal * mp.eye(3)
    for o, (i, j) in zip(outer, pairs, strict=True):
        flexibility[i, j] -= o
        if i != j:
            flexibility[j, i] -= o
    return end, flexibility, energy, bars


@dataclass(frozen=True)
class Chain:
    """Equilibrium of n bars.

    tensions (n,) [N]; nodes (n + 1, 3) [m]; vectors (n, 3): from each bar's first to its second node, rounded from 50
    digits, not a difference of `nodes` [m]; end_stiffness (3, 3): static, of end 2 with end 1 fixed, the inverse of
    the summed bar flexibilities [N/m].
    """

    tensions: np.ndarray
    nodes: np.ndarray
    vectors: np.ndarray
    end_stiffness: np.ndarray


@mp.workdps(_WORK)
def solve_spatial(span, L, EA, w, n, loads=()):
    """Equilibrium of n equal bars in space as a `Chain`.

    `span`: end 2 from end 1 [m]. Each bar has unstretched length L/n and half its weight on either node; `loads` are
    dead forces on interior nodes, (node from 1 to n - 1, (fx, fy, fz)) [N].
    """
    span, L, EA, w = [mp.mpf(x) for x in span], mp.mpf(L), mp.mpf(EA), mp.mpf(w)
    weights = [[mp.mpf(0), mp.mpf(0), -w * L / n] for _ in range(n - 1)]
    for node, force in loads:
        weights[node - 1] = [p + mp.mpf(f) for p, f in zip(weights[node - 1], force, strict=True)]
    start = list(catenary_mp.solve_loaded(span, L, EA, w, [(node * L / n, f) for node, f in loads]))
    start[2] += w * L / (2 * n)
    force0 = catenary_mp.minimise(lambda f: _chain(f, weights, L / n, 1 / EA), start, span, L)
    _, flexibility, _, bars = _chain(force0, weights, L / n, 1 / EA)
    nodes = [[mp.mpf(0)] * 3]
    for _, bar, _ in bars:
        nodes.append([x + d for x, d in zip(nodes[-1], bar, strict=True)])
    return Chain(
        tensions=np.array([float(T) for _, _, T in bars]),
        nodes=np.array(nodes, dtype=float),
        vectors=np.array([bar for _, bar, _ in bars], dtype=float),
        end_stiffness=np.array((flexibility**-1).tolist(), dtype=float),
    )


def matrices(chain, L, EA, m):
    """Dense K (3 n + 3, 3 n + 3) [N/m] and the diagonal of the lumped M [kg], ordered (x, y, z) node by node.

    K_e = EA/L0e n n^T + F/|r| (I - n n^T) with +- signs to the two nodes; mass m L0e/2 on each (the paper's section
    2).
    """
    n, K = len(chain.tensions), elastic_matrix(chain, L, EA)
    M = np.repeat(m * L / n * np.array([0.5, *np.ones(n - 1), 0.5]), 3)
    for i, (r, tension) in enumerate(zip(chain.vectors, chain.tensions, strict=True)):
        length, place = np.sqrt(r @ r), np.s_[3 * i : 3 * i + 6]
        K[place, place] += np.kron(ENDS, tension / length * (np.eye(3) - np.outer(r, r) / length**2))
    return K, M


@dataclass(frozen=True)
class Modes:
    """Modes of the 3 (n - 1) movements of the interior nodes, both ends fixed.

    frequencies, ascending [Hz]; vectors: columns, mass-normalised [1/sqrt(kg)]; participation (.., 3): |psi^T K21 e_j|
    for x, y, z motions of end 2 [N/(m sqrt(kg))]; axial: share of the modal mass that moves along the chord [-].
    """

    frequencies: np.ndarray
    vectors: np.ndarray
    participation: np.ndarray
    axial: np.ndarray


def modes(chain, L, EA, m):
    """All `Modes` of the chain between fixed ends by dense scipy.linalg.eigh."""
    K, M = matrices(chain, L, EA, m)
    inner, end = slice(3, -3), slice(-3, None)
    root = np.sqrt(M[inner])
    values, columns = scipy.linalg.eigh(K[inner, inner] / np.outer(root, root))
    psi = columns / root[:, None]
    chord = chain.nodes[-1] / np.linalg.norm(chain.nodes[-1])
    along = np.tensordot(columns.reshape(-1, 3, columns.shape[1]), chord, axes=(1, 0))
    return Modes(np.sqrt(values) / (2 * np.pi), psi, np.abs(psi.T @ K[inner, end]), (along**2).sum(axis=0))


def _product(*factors):
    """Product of 3 x 3 matrices as lists of rows."""
    first, *rest = factors
    for other in rest:
        columns = list(zip(*other, strict=True))
        first = [[x * u + y * v + z * w for u, v, w in columns] for x, y, z in first]
    return first


def _sum(one, other, sign=1):
    return [[a + sign * b for a, b in zip(*rows, strict=True)] for rows in zip(one, other, strict=True)]


def end_blocks(chain, L, EA, m, s, c):
    """Blocks (near, between, far) of the stiffness of the ends at s [rad/s], each 3 x 3 [N/m].

    The elastic part is taken (1 + c) times; node after node is eliminated in the working precision and 30 digits more.
    """
    with mp.extradps(30):
        first = mp.mpf(L) / len(chain.tensions)
        half = mp.mpf(m) * first / 2 * s**2
        half = [[half * (i == j) for j in range(3)] for i in range(3)]
        elastic = (1 + c) * mp.mpf(EA) / first

        def bar(k):
            vector = [mp.mpf(float(part)) for part in chain.vectors[k]]
            length = mp.sqrt(sum(part**2 for part in vector))
            turned = mp.mpf(float(chain.tensions[k])) / length
            t = [part / length for part in vector]
            return [[(elastic - turned) * (t[i] * t[j]) + turned * (i == j) for j in range(3)] for i in range(3)]

        near = far = _sum(bar(0), half)
        between = [[-part for part in row] for row in bar(0)]
        for k in range(1, len(chain.tensions)):
            following = bar(k)
            inner = catenary_mp.inverse(_sum(_sum(far, following), half))
            across = list(zip(*between, strict=True))
            near = _sum(near, _product(between, inner, across), -1)
            between = _product(between, inner, following)
            far = _sum(_sum(following, half), _product(following, inner, following), -1)
        return tuple(map(mp.matrix, (near, between, far)))


def eliminated(chain, L, EA, m, s, c, digits=60):
    """`end_blocks` in long arithmetic, in doubles, shape (6, 6). [N/m]"""
    with mp.workdps(digits):
        near, between, far = end_blocks(chain, L, EA, m, mp.mpc(s), mp.mpc(c))
        found = np.empty((6, 6), dtype=complex)
        for i, j in np.ndindex(3, 3):
            found[i, j], found[i, 3 + j] = complex(near[i, j]), complex(between[i, j])
            found[3 + j, i], found[3 + i, 3 + j] = complex(between[i, j]), complex(far[i, j])
    return found


def damped_pole(chain, L, EA, m, mass, begin, loss, digits=40):
    """Pole [rad/s] of a mass [kg] on end 2, free along x, by the secant method in long arithmetic.

    `begin` is near the pole; `loss`: s -> what damping adds to the elastic stiffness.
    """
    with mp.workdps(digits):
        return mp.findroot(
            lambda s: mass * s**2 + end_blocks(chain, L, EA, m, s, loss(s))[2][0, 0],
            (mp.mpc(begin), mp.mpc(begin) * (1 + mp.mpf("1e-9") * 1j)), tol=mp.mpf(10) ** -50, maxsteps=60,
        )  # fmt: skip


def elastic_matrix(chain, L, EA):
    """The elastic part of the stiffness of `matrices`: EA/l0 n n^T of each bar."""
    n = len(chain.vectors)
    elastic = np.zeros((3 * n + 3, 3 * n + 3))
    for bar, along in enumerate(chain.vectors / np.linalg.norm(chain.vectors, axis=1)[:, None]):
        place = np.s_[3 * bar : 3 * bar + 6]
        elastic[place, place] += np.kron(ENDS, EA / (L / n) * np.outer(along, along))
    return elastic
