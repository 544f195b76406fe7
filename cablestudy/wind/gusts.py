"""Turbulence on the bodies and cables of a suspension: forces on its coordinates and their covariance over frequency.

Three components of the turbulence, along the mean wind, across it and vertical, are uncorrelated. The cross-spectrum of
one of them at two places is sqrt(S_i S_j) exp(-C f d/U) at their distance d (Davenport, Quarterly Journal of the Royal
Meteorological Society 87, 1961). So the spectral matrix of the forces depends on frequency by the spectrum of the
speed, by the admittance of each body, and by kappa = C f/U: it is computed for some kappa and interpolated.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.system.rigid import cross_matrix, size
from cablestudy.wind.mean import body_forces
from cablestudy.wind.spectrum import admittance, speed_spectrum

PER_DECADE, DEGREE = 8, 5  # kappa at which the covariance is computed, and of the spline: 6e-6 of a variance
COHERENT = 1e-7  # kappa times the size of the suspension that is taken for zero
NEARLY_COHERENT, INCOHERENT = 1e-4, 1e4  # kappa times the size of the suspension where its limits are reached


@dataclass(frozen=True)
class Gusts:
    """Forces of the turbulence on m coordinates.

    Attributes
    ----------
    wind : SuspensionWind
        Has speed, turbulence, length_scale, spectrum, admittance and coherence_decay.
    directions : ndarray, shape (3, 3)
        Rows: along the mean wind, across it, vertical. [-]
    strips : list of Strip
    forces : ndarray, shape (b, 3, m)
        Force on each coordinate by a unit speed along x, y, z at each body that the wind acts on.
    places : ndarray, shape (b, 3)
        Centres of pressure of these bodies. [m]
    areas : ndarray, shape (b,)
        For the admittance of these bodies. [m^2]
    """

    wind: object
    directions: np.ndarray
    strips: list
    forces: np.ndarray
    places: np.ndarray
    areas: np.ndarray

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
        wind = self.wind
        speed = speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)
        pushed = (self.directions @ self.forces).reshape(3 * len(self.areas), response.shape[1])
        shares = [np.sqrt(admittance(frequency, wind.speed, area, wind.admittance)) for area in self.areas.tolist()]
        shares = np.repeat(np.reshape(shares, (len(self.areas), len(frequency))), 3, axis=0).T
        response = np.concatenate([response, shares[..., None] * (pushed @ response)], axis=1)
        covariance = self._covariance(wind.coherence_decay * frequency / wind.speed)
        parts = response.real, response.imag
        return speed[:, None] * sum(((covariance @ part) * part).sum(axis=1) for part in parts)

    def own(self, frequency):
        """Spectrum of the force on each coordinate at a frequency of its own [Hz], shape (m,), without admittance."""
        wind, count, bodies = self.wind, self.forces.shape[-1], 3 * len(self.areas)
        covariance = self._covariance(wind.coherence_decay * frequency / wind.speed)
        onto = np.concatenate([np.eye(count), (self.directions @ self.forces).reshape(bodies, count)])
        speed = speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)
        return speed * ((covariance @ onto.T[:, :, None])[..., 0] * onto.T).sum(axis=1)

    def _covariance(self, kappa):
        """Covariance of the forces of the cables on the coordinates and of the components of speed at the bodies.

        Parameters
        ----------
        kappa : ndarray, shape (f,)
            [1/m]

        Returns
        -------
        ndarray, shape (f, m + 3 b, m + 3 b)
        """
        known, spline = self._computed
        if spline is None:
            return np.broadcast_to(known, (len(kappa), *known.shape))
        low, high = known
        place = np.log(np.maximum(kappa, 1e-300))
        found = spline(np.clip(place, low, high))
        if (place < low).any():  # nearly coherent: linear in kappa, d/d log kappa = kappa d/d kappa
            found = found - np.maximum(-np.expm1(place - low), 0.0)[:, None, None] * spline(low, 1)
        if (place > high).any():
            # all that cables take part in falls with 1/kappa, and the speeds at the bodies remain as they are
            of_bodies = np.arange(found.shape[-1]) >= self.forces.shape[-1]
            falling = np.where(place > high, np.exp(high - place), 1.0)[:, None, None]
            found = np.where(of_bodies[:, None] & of_bodies, found, falling * found)
        return found

    @cached_property
    def _computed(self):
        """Range of log kappa and spline of the covariance over it; a covariance and None where all is coherent."""
        from scipy.interpolate import make_interp_spline

        everywhere = np.concatenate([*(strip.places for strip in self.strips), self.places])
        across = size(np.ptp(everywhere, axis=0)) if len(everywhere) else 0.0
        if not (self.wind.coherence_decay and across):
            return self._at(np.array([COHERENT / (across or 1.0)]))[0], None
        span = np.log10([NEARLY_COHERENT, INCOHERENT])
        kappa = np.logspace(*span, 1 + int(PER_DECADE * np.ptp(span))) / across
        place = np.log(kappa)
        return place[[0, -1]], make_interp_spline(place, self._at(kappa), k=DEGREE)

    def _at(self, kappa):
        """`_covariance` computed directly."""
        count, bodies = self.forces.shape[-1], len(self.areas)
        size_ = count + 3 * bodies
        found = np.zeros((len(kappa), size_, size_))
        apart = size(self.places[:, None] - self.places[None])
        nodes = np.concatenate([strip.places for strip in self.strips]) if self.strips else np.zeros((0, 3))
        owner = np.repeat(np.arange(len(self.strips)), [len(strip.lengths) for strip in self.strips])
        between, towards = size(nodes[:, None] - nodes[None]), size(nodes[:, None] - self.places[None])
        others = owner[:, None] != owner[None]
        by_strip = [strip.forces for strip in self.strips]
        for component, rms in enumerate(self.wind.turbulence):
            if not rms:
                continue
            direction, variance = self.directions[component], rms * rms
            own = [np.tensordot(direction, forces, axes=1) for forces in by_strip]
            whole = np.concatenate(own) if own else np.zeros((0, count))
            place = count + component + 3 * np.arange(bodies)
            for strip, forces in zip(self.strips, own, strict=True):
                found[:, :count, :count] += variance * strip.coherent(forces, kappa)
            for number, value in enumerate(kappa.tolist()):
                cables = np.where(others, np.exp(-value * between), 0.0)
                found[number, :count, :count] += variance * (whole.T @ cables @ whole)
                mixed = variance * (whole.T @ np.exp(-value * towards))
                found[number, :count, place] += mixed.T
                found[number, place, :count] += mixed.T
                found[np.ix_([number], place, place)] += variance * np.exp(-value * apart)
        return found


def gusts(wind, drag, layout, shapes, strips, areas):
    """The `Gusts` on a suspension, and its aerodynamic damping.

    Parameters
    ----------
    wind : SuspensionWind
    drag : Drag
        Of one case.
    layout : Layout
    shapes : ndarray, shape (n, m)
        Combinations of its coordinates.
    strips : list of Strip
        With these shapes.
    areas : ndarray, shape (b,)
        Of all bodies and junctions, for their admittance. [m^2]

    Returns
    -------
    Gusts
    damping : ndarray, shape (m, m)

    Notes
    -----
    Drag on a body rho/2 C_d A_k |u| u_k changes with the turbulence u' by rho/2 C_d A_k (|U| u'_k + U_k (U.u')/|U|).
    """
    equilibrium = layout.equilibrium
    rotation = equilibrium.rotation
    speed = float(size(drag.velocity))
    own = (np.swapaxes(rotation, -1, -2) @ drag.velocity[:, None])[..., 0]
    linear = speed * np.eye(3) + own[:, :, None] * own[:, None, :] / speed
    linear = rotation @ (float(drag.density) / 2 * drag.bodies[..., None] * linear) @ np.swapaxes(rotation, -1, -2)
    _, arm = body_forces(drag, rotation)
    moved = layout.displaced(layout.bodies(shapes))
    moved = moved[:, :3] - cross_matrix(arm) @ moved[:, 3:]
    blown = np.flatnonzero((drag.bodies > 0).any(axis=-1))
    forces = np.swapaxes(linear, -1, -2)[blown] @ moved[blown]
    damping = sum(strip.damping for strip in strips) + np.zeros((shapes.shape[-1],) * 2)
    damping = damping + (np.swapaxes(moved[blown], -1, -2) @ linear[blown] @ moved[blown]).sum(axis=0)
    along = drag.velocity / speed
    up = np.array([0.0, 0.0, 1.0])
    directions = np.stack([along, np.cross(up, along), up])
    return Gusts(wind, directions, strips, forces, (equilibrium.position + arm)[blown], areas[blown]), damping
