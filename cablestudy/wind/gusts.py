"""Turbulence on the bodies and cables of a suspension: forces on its coordinates and their covariance over frequency.

Three components of the turbulence, along the mean wind, across it and vertical, are uncorrelated. The cross-spectrum of
one of them at two places is sqrt(S_i S_j) exp(-C f d/U) at their distance d (Davenport, Quarterly Journal of the Royal
Meteorological Society 87, 1961). So the spectral matrix of the forces depends on frequency by the spectrum of the
speed, by the admittance of each body, and by kappa = C f/U: it is computed for some kappa and interpolated. Another
`Coherence` is another function kappa of the frequency.
"""

from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np

from cablestudy.system.rigid import cross_matrix, size
from cablestudy.wind.coherence import Coherence
from cablestudy.wind.mean import body_forces
from cablestudy.wind.spectrum import admittance, speed_spectrum
from cablestudy.wind.spline import CardinalSplines
from cablestudy.wind.tolerances import WIND
from cablestudy.wind.variance import Noise


@dataclass(frozen=True)
class Gusts:
    """Forces of the turbulence on m coordinates.

    Attributes
    ----------
    wind : SuspensionWind
        Has speed, turbulence, length_scale, spectrum and admittance.
    directions : ndarray, shape (3, 3)
        Rows: along the mean wind, across it, vertical. [-]
    strips : list of Strip
    amplitudes : list of ndarray, shape (k, m + 2 c)
        Of the coordinates of each of these c cables, see `strips.amplitudes`.
    forces : ndarray, shape (b, 3, m)
        Force on each coordinate by a unit speed along x, y, z at each body that the wind acts on.
    places : ndarray, shape (b, 3)
        Centres of pressure of these bodies. [m]
    areas : ndarray, shape (b,)
        For the admittance of these bodies. [m^2]
    coherence : Coherence
    """

    wind: object
    directions: np.ndarray
    strips: list
    amplitudes: list
    forces: np.ndarray
    places: np.ndarray
    areas: np.ndarray
    coherence: Coherence

    def variance_spectra(self, frequency, response):
        """One-sided spectra of some outputs.

        Parameters
        ----------
        frequency : ndarray, shape (f,)
            [Hz]
        response : ndarray, complex, shape (f, m, o)
            Of each output to a force on each coordinate.

        Returns
        -------
        ndarray, shape (f, o)
        """
        return self.input_spectra(frequency, np.swapaxes(self.into, -1, -2) @ response)

    def input_spectra(self, frequency, response):
        """Spectra by the response to each of the inputs of `into`, shape (f, m + t + 3 b, o)."""
        pushed = self.matrix_times(frequency, response)
        return (pushed.real * response.real + pushed.imag * response.imag).sum(axis=1)

    def matrix_times(self, frequency, columns):
        """The one-sided spectral matrix of the inputs of `into` at frequencies, times columns (f, i, o)."""
        speed, shares = self._functions(frequency)
        root = np.ones((len(frequency), columns.shape[1], 1))
        for part, share in zip(self.parts, shares, strict=True):
            root[:, part, 0] = (np.sqrt(speed) * share)[:, None]
        covariance = self._covariance(self.coherence.kappa(frequency))
        columns, found = root * columns, np.empty(columns.shape, dtype=complex)
        found.real, found.imag = covariance @ columns.real, covariance @ columns.imag
        return root * found

    @cached_property
    def into(self):
        """Forces on the coordinates by the i inputs, shape (m, i).

        These are the forces of the cables on each coordinate; two of each cable, by `Strip.pulled`, which move nothing;
        and the three components of the speed at each body.
        """
        count = self.forces.shape[-1]
        of_bodies = (self.directions @ self.forces).reshape(-1, count).T
        return np.concatenate([np.eye(count, self._work), of_bodies], axis=1)

    @property
    def _work(self):
        """How many inputs are works of the gusts on cables: one for each coordinate, and two of each cable, if any."""
        return self.forces.shape[-1] + 2 * len(self.strips) if self.strips else 0

    @property
    def parts(self):
        """Those of the cables among these inputs, if any, then the three of each body: list of slice."""
        count = self._work
        of_bodies = [slice(count + 3 * k, count + 3 * k + 3) for k in range(len(self.areas))]
        return [slice(count), *of_bodies] if count else of_bodies

    def noise(self, frequency):
        """Forces of the cables on the coordinates and speeds at the bodies as `Noise`, at frequencies [Hz]."""
        speed, shares = self._functions(frequency)
        cables, bodies = self._shares(self.coherence.kappa(frequency))
        first = 1 if self._work else 0  # of the bodies
        functions = [
            [
                speed * one * other * (cables if min(row, column) < first else bodies)
                for column, other in enumerate(shares)
            ]
            for row, one in enumerate(shares)
        ]
        return Noise(self._known[1], self.parts, functions)

    @property
    def force_on_cables(self):
        """Bound of their force on all cables together, RMS. [N]"""
        return max(self.wind.turbulence) * sum(strip.most for strip in self.strips)

    def edges(self, low, high):
        """Boundaries between frequencies at which `noise` is smooth, from low to high, ascending. [Hz]"""
        count = ceil(WIND.panels_per_decade * np.log10(high / low) - WIND.panel_boundary)
        inner = low * 10 ** (np.arange(1, count) / WIND.panels_per_decade)
        return np.concatenate([[low], inner, [high]])

    def _functions(self, frequency):
        """Spectrum of the speed over the variance of a component, and the root of the admittance of each part."""
        wind = self.wind
        speed = speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)
        shares = [np.sqrt(admittance(frequency, wind.speed, area, wind.admittance)) for area in self.areas.tolist()]
        return speed, [np.ones_like(frequency), *shares] if self._work else shares

    def _covariance(self, kappa):
        """Covariance of the forces of the cables on the coordinates and of the components of speed at the bodies.

        Parameters
        ----------
        kappa : ndarray, shape (f,)
            [1/m]

        Returns
        -------
        ndarray, shape (f, i, i)
        """
        (cables, bodies), matrices, of_bodies = self._shares(kappa), self._known[1], slice(self._work, None)
        found = np.tensordot(cables, matrices, axes=(0, 0))
        found[:, of_bodies, of_bodies] = np.tensordot(bodies, matrices[:, of_bodies, of_bodies], axes=(0, 0))
        return found

    def _shares(self, kappa):
        """Share of each known covariance in that for other kappa, of what cables take part in, and between bodies.

        Parameters
        ----------
        kappa : ndarray, shape (f,)
            [1/m]

        Returns
        -------
        cables, bodies : ndarray, shape (k, f)
        """
        known = self._known[0]
        if known is None:
            return (np.ones((1, len(kappa))),) * 2
        linear, kappa = WIND.linear_covariance / self._across, kappa[:, None]
        splines = CardinalSplines(np.log(known + linear), WIND.coherence_degree)
        bodies = splines(np.log(np.minimum(kappa, known[-1]) + linear)[:, 0])
        # all that cables take part in falls with 1/kappa at last, and the speeds at the bodies remain as they are
        return (np.minimum(known[-1] / np.maximum(kappa, known[-1]), 1.0) * bodies).T, bodies.T

    @cached_property
    def _across(self):
        """Size of the suspension that the wind acts on. [m]"""
        everywhere = np.concatenate([*(strip.places for strip in self.strips), self.places])
        return size(np.ptp(everywhere, axis=0)) if len(everywhere) else 0.0

    @cached_property
    def _known(self):
        """Some kappa, shape (k,), and `_covariance` for them; None and only one where all is coherent."""
        least, across = self.coherence.least, self._across
        if self.coherence.constant or not across:
            return None, self._at(np.array([least]))
        linear, high = (
            WIND.linear_covariance / across,
            max(WIND.falling_covariance / across, WIND.far_above_least * least),
        )
        count = round(self.coherence.per_decade * np.log10((high + linear) / (least + linear)))
        kappa = np.maximum(np.geomspace(least + linear, high + linear, 1 + count) - linear, least)
        return kappa, self._at(kappa)

    @property
    def error(self):
        """Of a variance, relative: by covariances between known ones. [-]"""
        return self.coherence.error if self._known[0] is not None else 0.0

    @property
    def uniform(self):
        """Forces on the coordinates by a unit speed along x, y, z that is the same everywhere, shape (3, m)."""
        count, along = self.forces.shape[-1], zip(self.strips, self.amplitudes, strict=True)
        return self.forces.sum(axis=0) + sum(strip.forces.sum(axis=1) @ own[:, :count] for strip, own in along)

    def _at(self, kappa):
        """`_covariance` computed directly: of works on the coordinates of each cable, and then of the inputs."""
        points, forces, given, alone = self._blown(kappa)
        half = np.zeros((len(kappa), self.into.shape[1], self.into.shape[1]))
        for place, own in enumerate(alone):
            before = zip(points[:place], forces[:place], strict=True)
            row = [_between(kappa, points[place], forces[place], *other) for other in before]
            row = np.concatenate([*row, own / 2], axis=-1)
            half += given[place].T @ (row @ np.concatenate(given[: place + 1]))
        return half + np.swapaxes(half, -1, -2)

    def _blown(self, kappa):
        """What the gusts act on: each cable, then all bodies together, if any.

        Parameters
        ----------
        kappa : ndarray, shape (f,)
            [1/m]

        Returns
        -------
        points : list of ndarray, shape (q, 3)
            [m]
        forces : list of ndarray, shape (c, q, k)
            Works on k coordinates by c components of the turbulence at each point; of bodies the speeds themselves.
        given : list of ndarray, shape (k, i)
            These coordinates in terms of the inputs of `into`.
        alone : list of ndarray, shape (f, k, k)
            Covariances of these works.
        """
        rms, count, bodies = np.array(self.wind.turbulence), self._work, np.arange(len(self.areas))
        blown, inputs = np.flatnonzero(rms), np.eye(count + 3 * len(bodies))
        components = (rms[:, None] * self.directions)[blown]
        points, given = [strip.points for strip in self.strips], [own @ inputs[:count] for own in self.amplitudes]
        forces = [np.tensordot(components, strip.point_forces, axes=1) for strip in self.strips]
        alone = [strip.coherent(components, kappa) for strip in self.strips]
        if len(bodies):
            speeds = np.zeros((len(blown), len(bodies), 3 * len(bodies)))
            speeds[np.arange(len(blown))[:, None], bodies, 3 * bodies + blown[:, None]] = rms[blown, None]
            points, forces, given = [*points, self.places], [*forces, speeds], [*given, inputs[count:]]
            alone.append(_between(kappa, self.places, speeds, self.places, speeds))
        return points, forces, given, alone


def _between(kappa, points, forces, others, other_forces):
    """Covariance of works of the gusts at some points with works at others.

    Parameters
    ----------
    kappa : ndarray, shape (f,)
        [1/m]
    points : ndarray, shape (q, 3)
        [m]
    forces : ndarray, shape (c, q, k)
        By each component of the turbulence at each point.
    others, other_forces : ndarray, shapes (p, 3) and (c, p, l)

    Returns
    -------
    ndarray, shape (f, k, l)
    """
    distance, count = size(points[:, None] - others), forces.shape[-1]
    forces = forces.transpose(2, 0, 1).reshape(-1, len(points))
    other_forces = other_forces.reshape(-1, other_forces.shape[-1])
    found = np.zeros((len(kappa), count, other_forces.shape[-1]))
    at_once = max(1, WIND.coherence_entries // max(1, distance.size))
    for begin in range(0, len(kappa), at_once):
        part = slice(begin, begin + at_once)
        coherence = np.exp(-kappa[part, None, None] * distance)
        found[part] = (forces @ coherence).reshape(len(coherence), count, len(other_forces)) @ other_forces
    return found


def gusts(wind, drag, layout, shapes, strips, amplitudes, areas, coherence):
    """The `Gusts` on a suspension.

    Parameters
    ----------
    wind : SuspensionWind
    drag : Drag
        Of one case.
    layout : Layout
    shapes : ndarray, shape (n, m)
        Combinations of its coordinates.
    strips : list of Strip
    amplitudes : list of ndarray
        Of these in these combinations.
    areas : ndarray, shape (b,)
        Of all bodies and junctions, for their admittance. [m^2]
    coherence : Coherence

    Notes
    -----
    Drag on a body rho/2 C_d A_k |u| u_k changes with the turbulence u' by rho/2 C_d A_k (|U| u'_k + U_k (U.u')/|U|).
    """
    speed = float(size(drag.velocity))
    blown, places, linear, moved = _on_bodies(drag, layout, shapes)
    forces = np.swapaxes(linear, -1, -2) @ moved
    along = drag.velocity / speed
    up = np.array([0.0, 0.0, 1.0])
    directions = np.stack([along, np.cross(up, along), up])
    return Gusts(wind, directions, strips, amplitudes, forces, places, areas[blown], coherence)


def damping_of_bodies(drag, layout, shapes):
    """Aerodynamic damping of coordinates by the drag on bodies and junctions, see `gusts`, shape (m, m)."""
    _, _, linear, moved = _on_bodies(drag, layout, shapes)
    return (np.swapaxes(moved, -1, -2) @ linear @ moved).sum(axis=0)


def _on_bodies(drag, layout, shapes):
    """Bodies on which the wind acts, b of them.

    Returns
    -------
    blown : ndarray of int, shape (b,)
        Their numbers.
    places : ndarray, shape (b, 3)
        Of the drag. [m]
    linear : ndarray, shape (b, 3, 3)
        Force per speed. [N s/m]
    moved : ndarray, shape (b, 3, m)
        Displacements of these places per coordinate.
    """
    rotation = layout.equilibrium.rotation
    speed = float(size(drag.velocity))
    own = (np.swapaxes(rotation, -1, -2) @ drag.velocity[:, None])[..., 0]
    linear = speed * np.eye(3) + own[:, :, None] * own[:, None, :] / speed
    linear = rotation @ (float(drag.density) / 2 * drag.bodies[..., None] * linear) @ np.swapaxes(rotation, -1, -2)
    _, arm = body_forces(drag, rotation)
    moved = layout.displaced(layout.bodies(shapes))
    moved = moved[:, :3] - cross_matrix(arm) @ moved[:, 3:]
    blown = np.flatnonzero((drag.bodies > 0).any(axis=-1))
    return blown, (layout.equilibrium.position + arm)[blown], linear[blown], moved[blown]
