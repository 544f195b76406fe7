"""Turbulence on the bodies and cables of a suspension: forces on its coordinates and their covariance over frequency.

Three components of the turbulence, along the mean wind, across it and vertical, are uncorrelated. The cross-spectrum of
one component at two places i and j is sqrt(S_i S_j) exp(-C f d/U), d being the distance of the places (Davenport,
Quarterly Journal of the Royal Meteorological Society 87, 1961). So the spectral matrix of the forces depends on
frequency by the spectrum of the speed, by the admittance of each body, and by kappa = C f/U: the covariance is computed
for some kappa and interpolated between them. A `Coherence` states kappa as a function of frequency, this or another.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from math import ceil
from operator import attrgetter

import numpy as np

from cablestudy.cable.vectors import size
from cablestudy.statics.rigid import cross_matrix
from cablestudy.wind.cable_pairs import Arcs, coherence_of_cables, coherence_of_chords, coherence_with_points
from cablestudy.wind.coherence import Coherence, decayed
from cablestudy.wind.mean import body_forces
from cablestudy.wind.spectrum import admittance, speed_spectrum
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
        Unit vectors (rows) along the mean wind, across it, and vertical. [-]
    strips : list of Strips
        The c cables that the wind acts on, in groups.
    amplitudes : list of ndarray, shape (g, k, m + 2 c)
        Amplitudes of the coordinates of the cables of each group, see `strips.coordinate_amplitudes`.
    forces : ndarray, shape (b, 3, m)
        Force on each coordinate by a unit speed along x, y, z at each of the b bodies that the wind acts on.
    places : ndarray, shape (b, 3)
        Centres of pressure of these bodies. [m]
    areas : ndarray, shape (b,)
        Areas of these bodies, for their admittance. [m^2]
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

    def input_spectra(self, frequency, response):
        """One-sided spectra of o outputs, shape (f, o), by their response to the i inputs, shape (f, i, o)."""
        times_spectra = self.noise(frequency).times(response)
        return (times_spectra.real * response.real + times_spectra.imag * response.imag).sum(axis=1)

    @cached_property
    def input_matrix(self):
        """Forces on the coordinates by the i inputs, shape (m, i).

        Inputs are, if the wind acts on cables, the work of the gusts on them for each coordinate, and for the two end
        movements of each cable that `strips.coordinate_amplitudes` adds, which exert no force; then the three
        components of the speed at each body.
        """
        count = self.forces.shape[-1]
        of_bodies = (self.directions @ self.forces).reshape(-1, count).T
        return np.concatenate([np.eye(count, self._cable_inputs), of_bodies], axis=1)

    @property
    def _cable_inputs(self):
        """Number of inputs that are work of the gusts on cables: one for each coordinate, two for each cable."""
        return self.amplitudes[0].shape[-1] if self.strips else 0

    @property
    def input_groups(self):
        """Inputs with one function of frequency: those of the cables, if any, then the three of each body; slices."""
        count = self._cable_inputs
        of_bodies = [slice(count + 3 * k, count + 3 * k + 3) for k in range(len(self.areas))]
        return [slice(count), *of_bodies] if count else of_bodies

    def noise(self, frequency):
        """The inputs, see `input_matrix`, as `Noise` at frequencies [Hz]."""
        speed, factors = self._frequency_functions(frequency)
        for_cables, for_bodies = self._table_weights(self.coherence.kappa(frequency))
        first_body = 1 if self._cable_inputs else 0  # group

        def function(row, column):
            weights = for_cables if min(row, column) < first_body else for_bodies
            return speed * factors[row] * factors[column] * weights

        groups = range(len(factors))
        functions = [[function(row, column) for column in groups] for row in groups]
        return Noise(self._table, self.input_groups, functions)

    @property
    def force_on_cables(self):
        """Upper bound of the root mean square force of the gusts on all cables together. [N]"""
        return max(self.wind.turbulence) * sum(group.largest_force for group in self.strips)

    def edges(self, low, high):
        """Edges from low to high, ascending, of panels of frequency on each of which `noise` is smooth. [Hz]"""
        per_decade = WIND.panels_per_decade if self._table_kappa is None else self.coherence.panels_per_decade
        count = ceil(per_decade * np.log10(high / low) - WIND.panel_boundary)
        inner = low * 10 ** (np.arange(1, count) / per_decade)
        return np.concatenate([[low], inner, [high]])

    def _frequency_functions(self, frequency):
        """Spectrum of the speed over its variance, shape (f,), and root of the admittance of each of `input_groups`."""
        wind = self.wind
        speed = speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)
        roots = [np.sqrt(admittance(frequency, wind.speed, area, wind.admittance)) for area in self.areas.tolist()]
        return speed, [np.ones_like(frequency), *roots] if self._cable_inputs else roots

    def _table_weights(self, kappa):
        """Weights by which covariances at f values of kappa are interpolated from those at the k values of `_table`.

        The first, shape (k, f), are for the entries of the covariance with a cable, the second for those between
        bodies. They are splines over log(kappa + const). Above the highest kappa of the table, covariances with cables
        fall with 1/kappa, and those between bodies stay constant. Where no covariance depends on kappa, k is 1 and all
        weights are 1.
        """
        table_kappa = self._table_kappa
        if table_kappa is None:
            return (np.ones((1, len(kappa))),) * 2
        linear, highest, kappa = WIND.linear_covariance / self._extent, table_kappa[-1], kappa[:, None]
        for_bodies = self._splines(np.log(np.minimum(kappa, highest) + linear)[:, 0])
        # covariances with cables fall with 1/kappa at last, and those of speeds at bodies remain as they are
        falling = np.minimum(highest / np.maximum(kappa, highest), 1.0)
        return (falling * for_bodies).T, for_bodies.T

    @cached_property
    def _splines(self):
        """`CardinalSplines` over log(kappa + const) between the values of `_table_kappa`."""
        return CardinalSplines(np.log(self._table_kappa + WIND.linear_covariance / self._extent), WIND.coherence_degree)

    @cached_property
    def _extent(self):
        """Size of the suspension that the wind acts on. [m]"""
        points = np.concatenate([*(group.places.reshape(-1, 3) for group in self.strips), self.places])
        return size(np.ptp(points, axis=0)) if len(points) else 0.0

    @property
    def _highest_kappa(self):
        """Kappa above which covariances with cables fall with 1/kappa, and bodies have nothing in common. [1/m]

        By the shortest cable, and by the two bodies that are closest to each other.
        """
        of_cables = [WIND.falling_covariance / group.length for group in self.strips]
        distances = size(self.places[:, None] - self.places)
        of_bodies = WIND.independent_bodies / distances[distances > 0]
        far_above_least = WIND.far_above_least * self.coherence.least_kappa
        return float(np.concatenate([[far_above_least], *of_cables, of_bodies]).max())

    @cached_property
    def _table_kappa(self):
        """Values of kappa, ascending, of which `_table` has the covariance; None where it does not depend on kappa."""
        least, extent = self.coherence.least_kappa, self._extent
        if self.coherence.constant or not extent:
            return None
        linear = WIND.linear_covariance / extent
        highest = self._highest_kappa
        count = round(self.coherence.per_decade * np.log10((highest + linear) / (least + linear)))
        return np.maximum(np.geomspace(least + linear, highest + linear, 1 + count) - linear, least)

    @cached_property
    def _table(self):
        """Covariances of the inputs for k values of kappa, between which others are interpolated, shape (k, i, i)."""
        kappa = self._table_kappa
        return self._computed_covariance(np.array([self.coherence.least_kappa]) if kappa is None else kappa)

    @property
    def error(self):
        """Relative error of a variance by interpolation between covariances, see `Coherence`. [-]"""
        return self.coherence.error if self._table_kappa is not None else 0.0

    @property
    def uniform(self):
        """Forces on the coordinates by a unit speed along x, y, z that is the same everywhere, shape (3, m)."""
        count, cables = self.forces.shape[-1], zip(self.strips, self.amplitudes, strict=True)
        on_cables = (group.forces.sum(axis=2) @ amplitudes[..., :count] for group, amplitudes in cables)
        return self.forces.sum(axis=0) + sum(of_group.sum(axis=0) for of_group in on_cables)

    def _computed_covariance(self, kappa):
        """Covariance of the inputs, see `input_matrix`, for kappa [1/m], shape (f,): shape (f, i, i)."""
        inputs, cables, work = self.input_matrix.shape[1], [], []
        half = np.zeros((len(kappa), inputs, inputs))
        for places, own_work, coordinates, own_covariance in self._loads(kappa):
            row = own_covariance @ coordinates / 2  # half of its own covariance, and that with earlier loads
            if cables:
                row += _cross_covariance(kappa, places, own_work, cables, np.concatenate(work))
            cables.append(places)
            work.append(own_work @ coordinates)
            half += coordinates.T @ row
        return half + np.swapaxes(half, -1, -2)

    def _loads(self, kappa):
        """Yield the loads by the gusts: one for each cable, then one for all b bodies together, if there are any.

        The gusts on a cable are expanded in q functions along it. Each function does work on the k coordinates of the
        cable. In place of functions, bodies have q = b places, and in place of work the speeds themselves: their
        coordinates are the three components of the speed at each body, k = 3 b. The coherence at a distance r is
        exp(-kappa r), at f frequencies.

        Yields
        ------
        places : Arcs, or ndarray, shape (q, 3)
            Elements of the cable, which have q functions in all; or places of the bodies. [m]
        work : ndarray, shape (q, t, k)
            Work on each coordinate by a speed along each of the t components of the turbulence with an RMS above 0. The
            speed has the form of one of the q functions, and this RMS.
        coordinates : ndarray, shape (k, i)
            Amplitudes of the k coordinates in the movement of each of the i inputs, see `input_matrix`.
        own_covariance : ndarray, shape (f, k, k)
            Covariance of the work on these coordinates.
        """
        rms, count, bodies = np.array(self.wind.turbulence), self._cable_inputs, np.arange(len(self.areas))
        nonzero, inputs = np.flatnonzero(rms), np.eye(count + 3 * len(bodies))
        components = (rms[:, None] * self.directions)[nonzero]
        for group, amplitudes in zip(self.strips, self.amplitudes, strict=True):
            work = components @ np.moveaxis(group.point_forces, 1, 2)
            along_cables = group.gust_covariance(components, kappa)
            for arcs, of_cable, coordinates, along in zip(group.arcs, work, amplitudes, along_cables, strict=True):
                by_chords = _covariance(coherence_of_chords(kappa, arcs), of_cable, of_cable)
                yield arcs, of_cable, coordinates @ inputs[:count], along + by_chords
        if len(bodies):
            speeds = np.zeros((len(bodies), len(nonzero), 3 * len(bodies)))
            speeds[bodies[:, None], np.arange(len(nonzero)), 3 * bodies[:, None] + nonzero] = rms[nonzero]
            coherence = decayed(kappa[:, None, None] * size(self.places[:, None] - self.places))
            own_covariance = _covariance(coherence, speeds, speeds)
            yield self.places, speeds, inputs[count:], own_covariance


def _cross_covariance(kappa, places, work, cables, other_work):
    """Covariance of the work of the gusts on one load with that on several cables, shape (f, k, l).

    Loads are those of `Gusts._loads`. The covariance of the work on coordinates k and l, at each frequency, is

        sum over q, p and t of work[q, t, k] C[q, p] other_work[p, t, l]

    C is the mean coherence of functions, or places, q and p; the t components of the turbulence are uncorrelated.
    `cables` has the `Arcs` of each of the other cables, and p numbers their functions.
    """
    mean = coherence_of_cables if isinstance(places, Arcs) else coherence_with_points
    # elements of one order together
    cables = [Arcs(np.concatenate([cable.nodes for cable in run])) for _, run in groupby(cables, attrgetter("order"))]
    covariance = np.zeros((len(kappa), work.shape[-1], other_work.shape[-1]))
    at_once = max(1, WIND.coherence_entries // (len(work) * max(len(other_work), other_work[0].size)))
    for begin in range(0, len(kappa), at_once):
        batch = slice(begin, begin + at_once)
        coherence = np.concatenate([mean(kappa[batch], places, cable) for cable in cables], axis=-1)
        covariance[batch] = _covariance(coherence, work, other_work)
    return covariance


def _covariance(coherence, work, other_work):
    """Covariance of the work by q and by p functions, shapes (q, t, k), (p, t, l), coherence (f, q, p): (f, k, l).

    It is the sum over both functions, and over the t components of the turbulence, of work times coherence times work.
    """
    (count, components, inputs), functions = other_work.shape, len(work)
    by_function = coherence.reshape(-1, count) @ other_work.reshape(count, -1)
    work = work.reshape(functions * components, work.shape[-1])
    return work.T @ by_function.reshape(len(coherence), len(work), inputs)


def gusts(wind, drag, layout, shapes, strips, amplitudes, areas, coherence):
    """Collect the forces of the turbulence on m coordinates of a suspension: `Gusts`.

    The drag on a body along each of its axes k is rho/2 C_d A_k |u| u_k. The turbulence u' changes it by

        rho/2 C_d A_k (|U| u'_k + U_k (U.u')/|U|)

    with the mean wind U, the density rho of the air, and the drag coefficient times area C_d A_k.

    Parameters
    ----------
    wind : SuspensionWind
        Mean speed, turbulence and its spectrum.
    drag : Drag
        Mean wind, and drag coefficients times areas, of one case.
    layout : Layout
        Matrices and connections of the bodies.
    shapes : ndarray, shape (n, m)
        Column j: displacements of the n coordinates of the suspension by the j-th of the m coordinates.
    strips : list of Strips
        Wind forces on the cables, in groups, from `strips.on_cables`.
    amplitudes : list of ndarray, shape (g, k, m + 2 c)
        For each group: amplitudes of the k coordinates of each of its g cables by the m coordinates, and by two end
        movements of each of the c cables, see `strips.coordinate_amplitudes`.
    areas : ndarray, shape (b,)
        Areas of all bodies and junctions across the wind, for their admittance. [m^2]
    coherence : Coherence
        Of the turbulence at two places.
    """
    speed = float(size(drag.velocity))
    bodies, centers, drag_matrix, displacements = _wind_on_bodies(drag, layout, shapes)
    forces = np.swapaxes(drag_matrix, -1, -2) @ displacements
    along = drag.velocity / speed  # horizontal
    directions = np.array([along, [-along[1], along[0], 0.0], [0.0, 0.0, 1.0]])
    return Gusts(wind, directions, strips, amplitudes, forces, centers, areas[bodies], coherence)


def damping_of_bodies(drag, layout, shapes):
    """Aerodynamic damping matrix of m coordinates by the drag on bodies and junctions; arguments as for `gusts`."""
    _, _, drag_matrix, displacements = _wind_on_bodies(drag, layout, shapes)
    return (np.swapaxes(displacements, -1, -2) @ drag_matrix @ displacements).sum(axis=0)


def stiffness_of_bodies(drag, layout, shapes):
    """Stiffness of m coordinates by the mean drag on bodies, which turns with them, shape (m, m); not symmetric.

    Its force f at a centre of pressure changes with the attitude of the body, and where its pressure changes with the
    place; what the same force does at a centre that turns is in the stiffness of the `layout`.
    """
    rotation = layout.equilibrium.rotation
    force, arm = body_forces(drag, rotation)
    motion = layout.displaced(layout.bodies(shapes))
    displacements = motion[:, :3] - cross_matrix(arm) @ motion[:, 3:]
    speed = float(size(drag.velocity))
    by_wind = rotation @ (float(drag.density) / 2 * speed * drag.bodies[..., None] * np.swapaxes(rotation, -1, -2))
    # a body that turns by a small vector w turns its force with it, w x f, and meets a wind that turns by -w
    change = (by_wind @ cross_matrix(drag.velocity) - cross_matrix(force)) @ motion[:, 3:]
    if drag.profile is not None:
        profile, centers = drag.profile.of_each(len(force)), (layout.equilibrium.position + arm)[:, None]
        gradient = profile.gradient(centers)[:, 0, None, :]
        change = profile.pressure(centers)[..., None] * change + force[..., None] * gradient @ displacements
    return -(np.swapaxes(displacements, -1, -2) @ change).sum(axis=0)


def _wind_on_bodies(drag, layout, shapes):
    """Drag of the b bodies and junctions that have a drag area, linearised as in `gusts`, of one case.

    Returns
    -------
    bodies : ndarray of int, shape (b,)
        Indices of these bodies and junctions.
    centers : ndarray, shape (b, 3)
        Centres of pressure, global axes. [m]
    drag_matrix : ndarray, shape (b, 3, 3)
        Change of the drag by a change of the wind, global axes. [N s/m]
    displacements : ndarray, shape (b, 3, m)
        Displacements of the centres of pressure by each of the m coordinates, global axes.
    """
    rotation = layout.equilibrium.rotation
    speed = float(size(drag.velocity))
    in_body_axes = (np.swapaxes(rotation, -1, -2) @ drag.velocity[:, None])[..., 0]
    linear = speed * np.eye(3) + in_body_axes[:, :, None] * in_body_axes[:, None, :] / speed
    linear = float(drag.density) / 2 * drag.bodies[..., None] * linear
    drag_matrix = rotation @ linear @ np.swapaxes(rotation, -1, -2)
    _, arm = body_forces(drag, rotation)
    centers = layout.equilibrium.position + arm
    if drag.profile is not None:
        drag_matrix = drag_matrix * np.sqrt(drag.profile.of_each(len(arm)).pressure(centers[:, None]))[..., None]
    motion = layout.displaced(layout.bodies(shapes))  # translations and rotations, shape (b, 6, m)
    displacements = motion[:, :3] - cross_matrix(arm) @ motion[:, 3:]
    bodies = np.flatnonzero((drag.bodies > 0).any(axis=-1))
    return bodies, centers[bodies], drag_matrix[bodies], displacements[bodies]


class CardinalSplines:
    """Splines of odd degree k, of which the j-th is 1 at the j-th of n > k ascending points, and 0 at the others.

    As of `scipy.interpolate.make_interp_spline`, whose module takes a fifth of a second to import: with knots that
    leave out the first and last points (de Boor 2001, A Practical Guide to Splines, chapters IX, X and XIII).

    Parameters
    ----------
    points : ndarray, shape (n,)
    degree : int
    """

    def __init__(self, points, degree):
        inner = points[(degree + 1) // 2 : -((degree + 1) // 2)]
        self._degree = degree
        self._knots = np.concatenate([[points[0]] * (degree + 1), inner, [points[-1]] * (degree + 1)])
        first, values = self._basis(points)
        collocation = np.zeros((len(points), len(points)))
        np.put_along_axis(collocation, first[:, None] + np.arange(degree + 1), values, axis=1)
        self._coefficients = np.linalg.inv(collocation)

    def __call__(self, x):
        """Values of the splines between the first and the last point, shape (f,) -> (f, n)."""
        first, values = self._basis(x)
        return sum(values[:, j, None] * self._coefficients[first + j] for j in range(self._degree + 1))

    def _basis(self, x):
        """Index of the first B-spline that is not zero at each x, shape (f,), and values of it and the k next ones."""
        degree, knots = self._degree, self._knots
        interval = np.clip(np.searchsorted(knots, x, side="right") - 1, degree, len(knots) - degree - 2)
        values = np.ones((len(x), 1))
        for order in range(1, degree + 1):
            low = knots[interval[:, None] + np.arange(1 - order, 1)]
            high = knots[interval[:, None] + np.arange(1, order + 1)]
            scaled = values / (high - low)
            values = np.zeros((len(x), order + 1))
            values[:, :-1] = (high - x[:, None]) * scaled
            values[:, 1:] += (x[:, None] - low) * scaled
        return interval - degree, values
