"""The numbers of a whole scene, each with the error that the reference itself may have.

Statics and end stiffness from the 50-digit catenary; motion from the spectral solver of the continuous cable. The
gondola's modes: end 2 freed along x and loaded with the gondola's mass, as one compliance

    [ G + f f^T/k   f/k ]        G: of the cable with fixed ends, f: static shape of a unit movement of end 2 along x,
    [     f^T/k     1/k ]        k: static end stiffness along x,

whose eigenvalues are those of all coupled modes; then the one in question is polished as a zero of the dynamic
stiffness k_xx(w) - M w^2, complex where the strain is damped.

Every number is computed on two meshes; their difference is the reference's own error.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.linalg
from mpmath import mp

from . import catenary_mp, continuous_cable

UPRIGHT = mp.mpf(10) ** -30  # horizontal span of a vertical cable, in chords: the limit to 60 digits
FOLDED = 1e-12  # of the largest tension: below it a cable counts as folded
MAX_POINTS = 700  # of a mesh; a dense eigen-solution of three times as many unknowns
WEAK = 0.01  # loss factor up to which a damped mode is found from the undamped one at once
ROUNDING = 2e-13  # of the double precision parts of the reference


class Unknown(Exception):  # noqa: N818
    """The reference has no answer: too fine a structure, or a number that is not well defined."""


@dataclass(frozen=True)
class Cable:
    """A cable in the vertical plane through x, in SI. `length` may be an mpf.

    `angle` is the inclination [rad]; loads are (s, (fx, fy, fz)).
    """

    chord: float
    angle: float
    length: object
    EA: float
    mass: float
    gravity: float
    loads: tuple = ()
    gondola: float = 0.0
    loss_factor: float = 0.0
    time: float = 0.0


@dataclass
class Truth:
    """All numbers of a cable; each property is (value, error of the reference relative to it)."""

    cable: Cable
    spare: dict = field(default_factory=dict)

    @cached_property
    @mp.workdps(90)
    def ends(self):
        """Horizontal and vertical distance of the ends."""
        cable = self.cable
        chord, angle = mp.mpf(cable.chord), mp.mpf(cable.angle)
        if abs(cable.angle) == np.pi / 2:
            return chord * UPRIGHT, chord * (1 if angle > 0 else -1)
        return chord * mp.cos(angle), chord * mp.sin(angle)

    @cached_property
    @mp.workdps(90)
    def force0(self):
        """Tension vector at end 1."""
        cable = self.cable
        a, b = self.ends
        weight = mp.mpf(cable.mass * cable.gravity)
        return catenary_mp.solve_loaded((a, 0, b), self.length, mp.mpf(cable.EA), weight, self.loads)

    @property
    def length(self):
        """Unstretched."""
        return mp.mpf(self.cable.length)

    @property
    def loads(self):
        """Those that are not zero, at exact places."""
        return tuple((mp.mpf(s), tuple(map(mp.mpf, f))) for s, f in self.cable.loads if any(f))

    @property
    def weight(self):
        """Per unstretched length, the product that any program in double precision has."""
        return mp.mpf(self.cable.mass * self.cable.gravity)

    @property
    def planar(self):
        """No load out of the plane."""
        return not any(f[1] for _, f in self.loads)

    @cached_property
    @mp.workdps(90)
    def statics(self):
        """Dict of the static columns."""
        EA, L, w = mp.mpf(self.cable.EA), self.length, self.weight
        corners, lowest, level = [], [], mp.mpf(0)
        for _, force, length in catenary_mp._pieces(self.force0, L, w, self.loads):
            last = (*force[:2], force[2] + w * length)
            horizontal = mp.hypot(force[0], force[1])
            sizes = [mp.norm(mp.matrix(f)) for f in (force, last)]
            corners += sizes
            lowest.append(horizontal if force[2] < 0 < last[2] else min(sizes))
            level += horizontal * length / L
        found = {
            "preload": catenary_mp.mean_tension_loaded(self.force0, L, w, self.loads),
            "max_tension": max(corners),
            "min_tension": min(lowest),
            "horizontal_tension": level,
            "stretched_length": catenary_mp.stretched_length_loaded(self.force0, L, EA, w, self.loads),
            "unstretched_length": L,
        }
        if self._advances:
            found["sag"] = catenary_mp.sag_loaded(self.force0, L, EA, w, self.loads)
        return found

    @property
    def _advances(self):
        """Whether the cable goes one way along the horizontal, so that mid-span is one place."""
        pieces = catenary_mp._pieces(self.force0, self.length, self.weight, self.loads)
        return all(force[0] > 0 for _, force, _ in pieces)

    @property
    def folded(self):
        """Somewhere the tension is nothing."""
        return self.statics["min_tension"] <= FOLDED * self.statics["max_tension"]

    @cached_property
    @mp.workdps(90)
    def end_stiffness(self):
        """mp.matrix (3, 3)."""
        if self.weight == 0 and self.folded:
            return mp.zeros(3)  # end 2 moves about, and a slack part gives way
        EA, L = mp.mpf(self.cable.EA), self.length
        return catenary_mp.end_stiffness_loaded(self.force0, L, EA, self.weight, self.loads)

    @cached_property
    def _data(self):
        """What `continuous_cable._mesh` wants."""
        if self.folded:
            raise Unknown("folded")
        a, b = self.ends
        cable = self.cable
        return self.force0, a, b, self.length, mp.mpf(cable.EA), cable.mass, self.weight, self.loads

    @cached_property
    def _pieces(self):
        _, _, _, L, _, _, w, loads = self._data
        return len(continuous_cable._breaks(self.force0, L, w, loads)) - 1

    def _sizes(self, waves):
        """Points per piece of a coarse and a fine mesh for so many half-waves."""
        coarse = 16 + int(np.ceil(2.2 * waves / self._pieces))
        fine = coarse + 8
        if fine * self._pieces > MAX_POINTS:
            raise Unknown("needs too fine a mesh")
        return coarse, fine

    def _described(self, plane, points, count):
        """(frequency, kind, doubt) of the lowest modes of a plane; doubt: distance of its shares from the limits."""
        mesh = continuous_cable._mesh(self._data, plane, points)
        frequencies, ends, shapes = continuous_cable._fixed_modes(mesh, count)
        tangent = continuous_cable._points(self._data, points)[4] @ self._frame  # global
        along = (np.einsum("kna,na->kn", shapes, tangent) ** 2) @ mesh.weights
        total = (shapes**2).sum(axis=2) @ mesh.weights
        out = (shapes[:, :, 1] ** 2) @ mesh.weights / total
        along = along / total
        square = (2 * np.pi * frequencies) ** 2
        force = -ends[:, None, 0] - (mesh.mass * mesh.length * square)[:, None, None] * np.einsum(
            "nm,kma->kna", mesh.J, shapes
        )
        pull = np.einsum("kna,na->kn", force, tangent)
        elastic = (pull**2) @ mesh.weights * mesh.length / float(self.cable.EA) / square  # share of the energy
        kinds, doubts = [], []
        for k in range(len(frequencies)):
            doubt = abs(out[k] - 0.5)
            if out[k] > 0.5:
                kinds.append("out-of-plane")
            else:
                axial = along[k] > 0.5 and elastic[k] > 0.5
                kinds.append("axial" if axial else "in-plane")
                first, second = along[k] - 0.5, elastic[k] - 0.5
                doubt = min(doubt, min(first, second) if axial else max(-first, -second))
            doubts.append(doubt)
        return frequencies, kinds, np.array(doubts)

    @property
    def _frame(self):
        """Rows along the chord, across it and out of the plane, in global axes."""
        a, b = self.ends
        c, s = float(a / self.cable.chord), float(b / self.cable.chord)
        return np.array([[c, 0, s], [-s, 0, c], [0, 1, 0]])

    @cached_property
    def _known_modes(self):
        """Plane -> what `_lowest` gives of 24 modes, where it was asked for: dict."""
        return {}

    def _modes(self):
        """Yield what `_lowest` gives of 24 modes of each plane; no plane is solved before it is asked for."""
        for plane in ("in", "out") if self.planar else ("all",):
            if plane not in self._known_modes:
                self._known_modes[plane] = self._lowest(plane, 24)
            yield self._known_modes[plane]

    def lowest(self, count):
        """So many modes of the vertical plane, or of all directions, for `frequency`."""
        return [self._lowest("in" if self.planar else "all", count)]

    def _lowest(self, plane, count):
        """The lowest modes of a plane by a coarse and a fine mesh: pair."""
        return [self._described(plane, n, count) for n in self._sizes(count)]

    def frequency(self, kind, number, modes=None):
        """Mode `number` (from 1) of a kind: in-plane, out-of-plane or axial."""
        for coarse, fine in modes or self._modes():
            found = [[k for k, name in enumerate(part[1]) if name == kind] for part in (coarse, fine)]
            if min(map(len, found)) < number:
                continue
            one, two = (part[0][index[number - 1]] for part, index in zip((coarse, fine), found, strict=True))
            if fine[2][: found[1][number - 1] + 1].min() < 0.02:
                raise Unknown("a mode between two kinds")
            return two, abs(two / one - 1) + ROUNDING * float(max(fine[0][: found[1][number - 1] + 1]) / fine[0][0])
        raise Unknown("not among the lowest modes")

    @property
    def straight(self):
        """Nothing bends the cable: no weight or load across the chord."""
        upright = abs(self.cable.angle) == np.pi / 2
        lateral = any(f[0] or f[1] for _, f in self.loads)
        return (upright or not self.cable.gravity) and not lateral and (upright or not self.loads)

    @property
    def axial_waves(self):
        """About how many transverse half-waves the first axial mode has beside it."""
        return float(mp.sqrt(self.cable.EA / self.statics["preload"]))

    def axial(self, number):
        """Axial mode: k c/(2 L) where nothing bends the cable."""
        if self.straight:
            if self.folded:
                raise Unknown("folded")
            return number / (2 * float(self.length)) * np.sqrt(self.cable.EA / self.cable.mass), ROUNDING
        count = int(12 + 1.5 * number * self.axial_waves)
        return self.frequency("axial", number, self.lowest(count))

    @cached_property
    def _gondola_plane(self):
        return "in" if self.planar else "all"

    def _coupled(self, points):
        """Frequencies of all coupled modes, ascending, shares in the static compliance, in modal mass."""
        mesh = continuous_cable._mesh(self._data, self._gondola_plane, points)
        count, d = len(mesh.s), len(mesh.scale)
        G, _, total = continuous_cable._compliance(mesh)
        move = mesh.axes[0] / mesh.scale  # unit movement of end 2 along x
        pull = np.linalg.solve(total, move)
        k = float(move @ pull)
        shape = (mesh.J @ np.einsum("njk,k->nj", mesh.C, pull)).T
        half = np.outer(mesh.scale, np.sqrt(mesh.weights)).ravel()
        inner = np.outer(mesh.scale, 1 / np.sqrt(mesh.weights)).ravel()
        compliance = np.empty((d * count + 1,) * 2)
        f = half * shape.ravel()
        mu = np.sqrt(self.cable.gondola / (mesh.mass * mesh.length))
        compliance[:-1, :-1] = inner[:, None] * G * inner + np.outer(f, f) / k
        compliance[-1, :-1] = compliance[:-1, -1] = mu * f / k
        compliance[-1, -1] = mu**2 / k
        values, vectors = scipy.linalg.eigh((compliance + compliance.T) / 2)
        values, vectors = np.maximum(values[::-1], 1e-300), vectors[:, ::-1]
        unit = np.sqrt(mesh.tension / mesh.mass) / mesh.length / (2 * np.pi)
        return unit / np.sqrt(values), values * vectors[-1] ** 2 / compliance[-1, -1], vectors[-1] ** 2

    def balance(self, omega, points, eta=0.0):
        """k_xx(w) - M w^2, of a mesh with so many points to a piece and a loss factor of the strain. [N/m]"""
        mesh = continuous_cable._mesh.__wrapped__(self._data, self._gondola_plane, points, eta)
        K = continuous_cable._ends(mesh, omega)
        d = len(mesh.scale)
        along = mesh.axes[0]
        return along @ K[d:, d:] @ along - self.cable.gondola * omega**2

    def _secant(self, omega, points, eta_of, near=1e-14):
        """Zero of the balance near omega, complex where eta is; `near`: a relative step that is the last one."""
        last, here = omega * (1 + 1e-5), omega
        before = self.balance(last, points, eta_of(last))
        for _ in range(40):
            value = self.balance(here, points, eta_of(here))
            if value == before:
                return here
            step = -value * (here - last) / (value - before)
            last, before, here = here, value, here + step
            if abs(step) < near * abs(here):
                return here
        if abs(step) < 1e-9 * abs(here):
            return here
        raise Unknown("the zero of the dynamic stiffness was not found")

    @cached_property
    def _gondola(self):
        """(omega coarse, omega fine, points of both)."""
        points = self._sizes(30)
        frequency, share, mass = self._coupled(points[1])
        if share.max() < 0.1:  # many modes have a part in it, and the highest that a mesh has are not the cable's
            points = self._sizes(60)
            frequency, share, mass = self._coupled(points[1])
        order = np.argsort(-share)
        place = order[0]
        if share[order[1]] > 0.97 * share[place]:
            raise Unknown("two modes in which the gondola moves alike")
        if place > 30 + 0.5 * points[1] * self._pieces or frequency[place] > 300 * frequency[0]:
            raise Unknown("a gondola mode far above those of the cable")
        points = self._sizes(30 + place)
        found = [self._secant(2 * np.pi * frequency[place], n, lambda omega: 0.0) for n in points]
        if abs(found[1] / (2 * np.pi * frequency[place]) - 1) > 1e-3:
            raise Unknown("the zero of the dynamic stiffness was not found")
        self.spare["share"] = mass[place]
        return (*found, points)

    def gondola_frequency(self):
        """Of the coupled mode with the largest share in the static compliance of the gondola."""
        coarse, fine, _ = self._gondola
        return fine / (2 * np.pi), abs(fine / coarse - 1) + ROUNDING

    def gondola_damping_ratio(self):
        """Of that mode, the strain damped: followed from no damping to all of it.

        A pair of poles that becomes real is followed no further: one of the two may meet a third real pole and with it
        oscillate again, as in scene 604 (a gondola on k (1 + time s) in series with the spring of the sag: a cubic).
        """
        if self.straight and self.cable.gravity and not self.loads:
            return 0.0, 0.0  # upright: the gondola moves across
        _, omega, points = self._gondola
        cable, here = self.cable, complex(omega)

        def eta(w, share=1.0):
            return share * (cable.loss_factor + cable.time * w)

        if eta(omega) > WEAK and self.spare["share"] < 0.1:
            raise Unknown("heavily damped, and no mode is the gondola's: steps so long may lead to a neighbour")
        for share in (0.05, 0.2, 0.5) if eta(omega) > WEAK else ():
            here = self._secant(here, points[0], lambda w, share=share: eta(w, share), 1e-6)
        found = []
        for n in points:
            here = self._secant(here, n, eta)
            found.append(here.imag / abs(here))
        value, error = found[1], abs(found[1] - found[0])
        if abs(value) < 1e-9:
            raise Unknown("damping lost in the rounding of the reference")
        if value <= 0:
            raise Unknown("the damped mode was lost")
        if value >= 1 - ROUNDING:
            raise Unknown("the damped mode does not oscillate: which pole continues it is not decided")
        return value, error / value + ROUNDING / min(1.0, value)
