"""The numbers of a whole suspension, from its description alone and an approximate pose.

Statics: the pose in which 50-digit catenaries balance all loads, by Newton steps in double precision on residuals in
50 digits, each of which adds about ten digits. Motion: every cable as equal bars with lumped masses, in an equilibrium
of its own; the frequencies on three meshes, extrapolated (their error falls with the square of the bars).
"""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import scipy.sparse
from mpmath import mp
from scipy.sparse.linalg import LinearOperator, eigsh, splu
from scipy.spatial.transform import Rotation

from . import catenary_mp
from .dense import cross

DIGITS = 50
STEPS = 12  # of Newton's method in 50 digits
SETTLED = 1e-22  # relative correction at which it ends
BARS = (16, 32, 64)


class Unknown(Exception):  # noqa: N818
    """The reference has no answer."""


@dataclass(frozen=True)
class Cable:
    """Ends as (number of the holder or None, place in its axes or on the ground); EA [N], mass per length [kg/m]."""

    ends: tuple
    EA: float
    mass: float


@dataclass(frozen=True)
class Holder:
    """A body, or a free point without inertia; `free` has six entries."""

    mass: float
    free: tuple
    center: tuple = (0.0, 0.0, 0.0)
    inertia: tuple = (0.0, 0.0, 0.0)
    force: tuple = (0.0, 0.0, 0.0)
    moment: tuple = (0.0, 0.0, 0.0)


def rotated(angles):
    """R = Rz(yaw) Ry(pitch) Rx(roll) in 50 digits."""
    (cr, cp, cy), (sr, sp, sy) = ([f(mp.mpf(a)) for a in angles] for f in (mp.cos, mp.sin))
    Rz = mp.matrix([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    Ry = mp.matrix([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return Rz * Ry * mp.matrix([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])


def exact_cross(v):
    """[v x] in 50 digits."""
    return mp.matrix([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def turned(vector):
    """The rotation of a rotation vector."""
    angle = mp.norm(vector)
    if angle == 0:
        return mp.eye(3)
    one = exact_cross(vector / angle)
    return mp.eye(3) + mp.sin(angle) * one + (1 - mp.cos(angle)) * one * one


def orthogonal(matrix):
    """The rotation next to a matrix of double precision, by Newton's iteration."""
    found = mp.matrix(matrix.tolist())
    for _ in range(4):
        found = (found + (found.T) ** -1) / 2
    return found


def double(matrix):
    """mp.matrix as ndarray."""
    return np.array(matrix.tolist(), dtype=float)


@dataclass
class Statics:
    """Equilibrium of holders and cables near a pose.

    Attributes
    ----------
    positions, rotations : list of mp.matrix
    forces : list of mp.matrix
        Tension vector of each cable at end 1. [N]
    stiffness : ndarray, shape (6 b, 6 b)
        Of all displacements (x y z rx ry rz of each holder), all loads counted, those of dead moments too.
    """

    gravity: float
    holders: list
    cables: list
    lengths: np.ndarray
    positions: list
    rotations: list
    forces: list = field(default_factory=list)
    stiffness: np.ndarray = None

    @classmethod
    @mp.workdps(DIGITS)
    def near(cls, gravity, holders, cables, lengths, positions, rotations):
        """The equilibrium for given lengths, from a pose in double precision.

        Raises
        ------
        Unknown
            Newton's method finds none, or a cable hangs folded.
        """
        rotations = [orthogonal(np.asarray(R, dtype=float)) for R in rotations]
        found = cls(gravity, holders, cables, lengths, [mp.matrix(list(map(float, p))) for p in positions], rotations)
        free = np.concatenate([holder.free for holder in holders]).astype(bool)
        size = max(float(mp.norm(found.chord(cable))) for cable in cables)
        for _ in range(STEPS):
            net = found.balance()
            step = np.zeros(len(free))
            try:
                step[free] = np.linalg.solve(found.stiffness[np.ix_(free, free)], net[free])
            except np.linalg.LinAlgError as why:
                raise Unknown(f"the reference: {why}") from None
            found.move(step)
            relative = np.abs(step.reshape(-1, 6) / np.repeat([size, 1.0], 3)).max()
            if not relative < 1e3:
                raise Unknown("the reference does not converge")
            if relative < SETTLED:
                found.balance()
                return found
        raise Unknown("the reference does not converge")

    def place(self, end):
        """Of a cable end, global axes."""
        owner, place = end
        place = mp.matrix(list(map(mp.mpf, place)))
        return place if owner is None else self.positions[owner] + self.rotations[owner] * place

    def chord(self, cable):
        """From end 1 to end 2."""
        return self.place(cable.ends[1]) - self.place(cable.ends[0])

    def move(self, step):
        """By small displacements and rotations."""
        for holder, part in enumerate(step.reshape(-1, 6)):
            self.positions[holder] = self.positions[holder] + mp.matrix(part[:3].tolist())
            self.rotations[holder] = turned(mp.matrix(part[3:].tolist())) * self.rotations[holder]

    def balance(self):
        """Net forces and moments, shape (6 b,); renews the tension vectors and the stiffness."""
        count, started = len(self.holders), bool(self.forces)
        net, K = mp.zeros(6 * count, 1), np.zeros((6 * count, 6 * count))

        def add(holder, force, arm, loaded=True):
            net[6 * holder : 6 * holder + 3, 0] += force
            net[6 * holder + 3 : 6 * holder + 6, 0] += exact_cross(arm) * force
            if loaded:
                inside = slice(6 * holder + 3, 6 * holder + 6)
                K[inside, inside] -= cross(double(force).ravel()) @ cross(double(arm).ravel())

        for number, holder in enumerate(self.holders):
            weight = mp.matrix([0, 0, -mp.mpf(holder.mass) * mp.mpf(self.gravity)])
            add(number, weight, self.rotations[number] * mp.matrix(list(map(mp.mpf, holder.center))))
            add(number, mp.matrix(list(map(mp.mpf, holder.force))), mp.zeros(3, 1))
            net[6 * number + 3 : 6 * number + 6, 0] += mp.matrix(list(map(mp.mpf, holder.moment)))
        for index, cable in enumerate(self.cables):
            w, L = mp.mpf(cable.mass) * mp.mpf(self.gravity), mp.mpf(float(self.lengths[index]))
            d = self.chord(cable)
            try:
                start = tuple(self.forces[index]) if started else None
                force = catenary_mp.solve_loaded(tuple(d), L, cable.EA, w, (), start)
                own = double(catenary_mp.end_stiffness_loaded(force, L, cable.EA, w))
            except (ValueError, ZeroDivisionError, ArithmeticError) as why:
                raise Unknown(f"the reference: {why}") from None
            force = mp.matrix(list(force))
            self.forces[index : index + 1] = [force]
            far = force + mp.matrix([0, 0, w * L])
            moved = np.zeros((3, 6 * count))
            for (holder, place), pull, sign in zip(cable.ends, (force, -far), (-1, 1), strict=True):
                if holder is None:
                    continue
                arm = self.rotations[holder] * mp.matrix(list(map(mp.mpf, place)))
                add(holder, pull, arm)
                small = np.concatenate([np.eye(3), -cross(double(arm).ravel())], axis=1)
                moved[:, 6 * holder : 6 * holder + 6] += sign * small
            K += moved.T @ own @ moved
        self.stiffness = K
        return double(net).ravel()

    @mp.workdps(DIGITS)
    def tensions(self):
        """Mean tension, tension at end 1, at end 2 and the largest of each cable, shape (4, c). [N]"""
        found = []
        for cable, L, force in zip(self.cables, self.lengths, self.forces, strict=True):
            w = mp.mpf(cable.mass) * mp.mpf(self.gravity)
            one, two = mp.norm(force), mp.norm(force + mp.matrix([0, 0, w * mp.mpf(float(L))]))
            mean = catenary_mp.mean_tension_loaded(tuple(force), mp.mpf(float(L)), w)
            found.append([float(value) for value in (mean, one, two, max(one, two))])
        return np.array(found).T

    def sag(self, index):
        """Of one cable, below its chord at half of its span; Unknown where that is not one place. [m]"""
        cable, (x, y, z) = self.cables[index], self.forces[index]
        with mp.workdps(DIGITS):
            w = mp.mpf(cable.mass) * mp.mpf(self.gravity)
            return float(catenary_mp.sag_loaded((mp.hypot(x, y), 0, z), float(self.lengths[index]), cable.EA, w))

    def body_stiffness(self, body, points):
        """6x6 of a body, the free points following, the other bodies at rest."""
        own = np.arange(6 * body, 6 * body + 6)
        rest = np.array([6 * point + axis for point in points for axis in range(3)], dtype=int)
        K = self.stiffness
        if not len(rest):
            return K[np.ix_(own, own)]
        follow = np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, own)])
        return K[np.ix_(own, own)] - K[np.ix_(own, rest)] @ follow

    def frequencies(self, count):
        """Lowest frequencies and their relative errors, each of shape (count,). [Hz]

        Raises
        ------
        Unknown
            The bars find no equilibrium, or there are too few modes.
        """
        bend = [float(mp.hypot(x, y)) for x, y, _ in self.forces]  # over the weight per length: radius of the bend
        weights = [cable.mass * self.gravity * L for cable, L in zip(self.cables, self.lengths, strict=True)]
        if any(force * BARS[0] < weight for force, weight in zip(bend, weights, strict=True)):
            raise Unknown("a cable bends too sharply for bars")
        levels = np.array([Bars(self, bars).frequencies(count + 1) for bars in BARS])  # one more: it may come before
        one, two = ((4 * fine - coarse) / 3 for coarse, fine in pairwise(levels))
        doubt = np.abs(one / two - 1) + 1e-9  # rounding: the stiffest cables leave some ten digits of a tension
        change = np.ptp(levels, axis=0) / two
        for k in range(count):  # modes that change places from mesh to mesh: no extrapolation holds for either
            if two[k + 1] - two[k] < (change[k] + change[k + 1]) * two[k]:
                doubt[k : k + 2] = np.maximum(doubt[k : k + 2], change[k : k + 2])
        return two[:count], doubt[:count]


class Bars:
    """A suspension whose cables are so many equal bars each; displacements of holders first, then of inner nodes.

    The tensions of the bars are unknowns beside the displacements, which keeps digits however stiff the bars are:
    [A, E^T; E, -l/EA], with A the geometric stiffness and E the elongations by displacements.
    """

    def __init__(self, statics, bars):
        self.truth, self.bars = statics, bars
        self.holders, self.cables = statics.holders, statics.cables
        self.L = np.asarray(statics.lengths, dtype=float)
        self.EA, self.m = (np.array([getattr(cable, name) for cable in self.cables]) for name in ("EA", "mass"))
        self.positions = np.array([double(p).ravel() for p in statics.positions])
        self.rotations = np.array([double(R) for R in statics.rotations])
        self.inner, self.tension = self._catenaries(np.array([double(f).ravel() for f in statics.forces]))
        free = np.concatenate([holder.free for holder in self.holders]).astype(bool)
        self.active = np.flatnonzero(np.concatenate([free, np.ones(self.inner.size, dtype=bool)]))
        self.solve()

    def _catenaries(self, force):
        """Inner nodes on the catenaries, and the tension of each bar there, by four points of Gauss in each bar."""
        x, weights = np.polynomial.legendre.leggauss(4)
        own = (self.L / self.bars)[:, None, None]
        inside = own * (np.arange(self.bars)[:, None] + (x + 1) / 2)
        tension = np.broadcast_to(force[:, None, None, :], (*inside.shape, 3)).copy()
        tension[..., 2] += (self.m * self.truth.gravity)[:, None, None] * inside
        size = np.linalg.norm(tension, axis=-1, keepdims=True)
        slope = tension / size + tension / self.EA[:, None, None, None]
        steps = own * (slope * weights[:, None]).sum(axis=2) / 2
        return self._ends()[:, :1] + np.cumsum(steps, axis=1)[:, :-1], (size[..., 0] * weights).sum(axis=2) / 2

    def _ends(self):
        """Shape (c, 2, 3)."""
        places = np.zeros((len(self.cables), 2, 3))
        for index, cable in enumerate(self.cables):
            for end, (holder, place) in enumerate(cable.ends):
                place = np.asarray(place, dtype=float)
                held = holder is None
                places[index, end] = place if held else self.positions[holder] + self.rotations[holder] @ place
        return places

    def _linearised(self):
        """The matrix of displacements and tensions, and what is left of forces and of lengths."""
        ends, n, c = self._ends(), self.bars, len(self.cables)
        nodes = np.concatenate([ends[:, :1], self.inner, ends[:, 1:]], axis=1)
        d = np.diff(nodes, axis=1)
        size = np.linalg.norm(d, axis=-1)
        own = (self.L / n)[:, None]
        t = d / size[..., None]
        pull = self.tension[..., None] * t
        net = np.zeros(nodes.shape)
        net[:, :-1] += pull
        net[:, 1:] -= pull
        weight = self.m * self.truth.gravity * self.L / n
        net[:, 1:-1, 2] -= weight[:, None]
        net[:, [0, -1], 2] -= weight[:, None] / 2
        across = (self.tension / size)[..., None, None] * (np.eye(3) - t[..., :, None] * t[..., None, :])
        place = 3 * (np.arange(c)[:, None] * (n + 1) + np.arange(n))[..., None] + np.arange(3)
        number = np.broadcast_to(np.arange(c * n).reshape(c, n, 1), t.shape)
        size_of = 3 * c * (n + 1)
        A = sum(
            _sparse(sign * across, (place + one)[..., None], (place + two)[..., None, :], (size_of, size_of))
            for one, two, sign in ((0, 0, 1), (0, 3, -1), (3, 0, -1), (3, 3, 1))
        )
        E = _sparse(t, number, place + 3, (c * n, size_of)) - _sparse(t, number, place, (c * n, size_of))
        J = self._map(ends)
        force, A = J.T @ net.ravel(), J.T @ A @ J
        blocks = [np.zeros((6, 6)) for _ in self.holders]
        for number, holder in enumerate(self.holders):
            arm = self.rotations[number] @ np.asarray(holder.center)
            heavy = np.array([0, 0, -holder.mass * self.truth.gravity])
            force[6 * number : 6 * number + 3] += heavy + holder.force
            force[6 * number + 3 : 6 * number + 6] += np.cross(arm, heavy) + holder.moment
            blocks[number][3:, 3:] -= cross(heavy) @ cross(arm)
        for index, cable in enumerate(self.cables):
            for end, (holder, _) in enumerate(cable.ends):
                if holder is not None:
                    arm = ends[index, end] - self.positions[holder]
                    blocks[holder][3:, 3:] -= cross(net[index, -end]) @ cross(arm)
        A = (A + self._beside(blocks)).tocsc()[self.active][:, self.active]
        E = (E @ J).tocsc()[:, self.active]
        give = np.repeat(self.L / n / self.EA, n)
        matrix = scipy.sparse.block_array([[A, E.T], [E, -scipy.sparse.diags_array(give)]]).tocsc()
        return matrix, force[self.active], (own * (1 + self.tension / self.EA[:, None]) - size).ravel()

    def _beside(self, blocks):
        """Block diagonal: of the holders, and nothing of the inner nodes."""
        return scipy.sparse.block_diag([*blocks, scipy.sparse.csr_array((self.inner.size, self.inner.size))])

    def _map(self, ends):
        """Sparse matrix: displacements -> those of all nodes."""
        n, c, b = self.bars, len(self.cables), len(self.holders)
        node = 3 * (np.arange(c)[:, None] * (n + 1) + np.arange(1, n))[..., None] + np.arange(3)
        shape = 3 * c * (n + 1), 6 * b + self.inner.size
        whole = _sparse(1.0, node, 6 * b + np.arange(self.inner.size).reshape(node.shape), shape)
        for index, cable in enumerate(self.cables):
            for end, (holder, _) in enumerate(cable.ends):
                if holder is not None:
                    small = np.concatenate([np.eye(3), -cross(ends[index, end] - self.positions[holder])], axis=1)
                    row, column = np.indices(small.shape)
                    whole = whole + _sparse(small, 3 * (index * (n + 1) + n * end) + row, 6 * holder + column, shape)
        return whole.tocsr()

    def solve(self, steps=60):
        """Equilibrium of the bars, by Newton's method on displacements and tensions."""
        length = self.L.max()
        for _ in range(steps):
            matrix, force, gap = self._linearised()
            try:
                found = splu(matrix).solve(np.concatenate([force, gap]))
            except RuntimeError as why:
                raise Unknown(f"the bars of the reference: {why}") from None
            step = np.zeros(6 * len(self.holders) + self.inner.size)
            step[self.active] = found[: len(self.active)]
            worst = np.abs(step).max() / length
            if not np.isfinite(worst):
                raise Unknown("the bars of the reference: no step")
            share = min(1.0, 0.1 / max(worst, 1e-300))
            self._move(share * step)
            change = share * found[len(self.active) :].reshape(self.tension.shape)
            self.tension = np.maximum(self.tension + change, self.tension / 10)
            if worst < 1e-8:
                self.matrix = self._linearised()[0]
                return
        raise Unknown("the bars of the reference do not converge")

    def _move(self, step):
        b = len(self.holders)
        parts = step[: 6 * b].reshape(b, 6)
        self.positions = self.positions + parts[:, :3]
        self.rotations = Rotation.from_rotvec(parts[:, 3:]).as_matrix() @ self.rotations
        self.inner = self.inner + step[6 * b :].reshape(self.inner.shape)

    def frequencies(self, count):
        """The lowest, sorted. [Hz]"""
        share = np.ones(self.bars + 1)
        share[[0, -1]] = 0.5
        node = (self.m * self.L / self.bars)[:, None] * share
        J = self._map(self._ends())
        blocks = []
        for holder, R in zip(self.holders, self.rotations, strict=True):
            r = R @ np.asarray(holder.center)
            coupled = holder.mass * np.block([[np.eye(3), -cross(r)], [cross(r), -cross(r) @ cross(r)]])
            coupled[3:, 3:] += R @ np.diag(holder.inertia) @ R.T
            blocks.append(coupled)
        M = J.T @ scipy.sparse.diags_array(np.repeat(node.ravel(), 3)) @ J + self._beside(blocks)
        M = M.tocsc()[self.active][:, self.active]
        size = len(self.active)
        if size <= count:
            raise Unknown("too few modes")
        factors, zero = splu((self.matrix + self.matrix.T) / 2), np.zeros(self.matrix.shape[0] - size)
        inverse = LinearOperator((size, size), lambda f: factors.solve(np.concatenate([f.ravel(), zero]))[:size])
        try:
            values = eigsh(M, count, M, sigma=0.0, which="LM", OPinv=inverse, return_eigenvectors=False,
                           v0=np.random.default_rng(1).normal(size=size))  # fmt: skip
        except (RuntimeError, ArithmeticError) as why:
            raise Unknown(f"the bars of the reference: {why}") from None
        values = np.sort(values)
        if values[0] <= 0:
            raise Unknown("the bars of the reference are not stable")
        return np.sqrt(values) / (2 * np.pi)


def _sparse(values, rows, columns, shape):
    """Entries at places that are broadcast together."""
    values, rows, columns = np.broadcast_arrays(values, rows, columns)
    return scipy.sparse.coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape).tocsr()
