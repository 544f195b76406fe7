"""Turbulence on one cable or on a body at its end as inputs of a linear system: covariance of forces over frequency.

The spectral matrix of the forces of the wind on shapes of a cable depends on frequency by the spectrum of the speed and
by the cable's length over the coherence length: it is computed for some of these ratios and interpolated.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil

import numpy as np

from cablestudy.wind.coherence import Rod
from cablestudy.wind.spline import CardinalSplines
from cablestudy.wind.variance import Noise

PER_DECADE, DEGREE = 24, 7  # ratios at which the covariance is computed, and of the spline
INTERPOLATED = 1e-8  # error of a variance by it


@dataclass(frozen=True)
class BodyGusts:
    """A force on the last coordinate of a system.

    Attributes
    ----------
    spectrum : callable
        Frequencies, shape (f,) [Hz] -> one-sided, smooth, shape (f,). [N^2/Hz]
    """

    spectrum: Callable

    def within(self, shapes):
        """The same for coordinates in a space, of which the last is the last."""
        return self

    def inputs(self, count):
        """Forces on so many coordinates by the inputs, shape (count, 1)."""
        return np.eye(count)[:, -1:]

    def noise(self, frequency):
        """`Noise` at frequencies [Hz]."""
        return Noise(np.ones((1, 1, 1)), [slice(None)], [[self.spectrum(frequency)[None]]])

    def matrix_times(self, frequency, columns):
        """Spectral matrix of the inputs at frequencies, shape (f,), times columns, shape (f, 1, o)."""
        return self.spectrum(frequency)[:, None, None] * columns


@dataclass(frozen=True)
class CableGusts:
    """Forces on coordinates by the wind along a cable, as `BodyGusts`.

    Attributes
    ----------
    rod : Rod
    loads : ndarray, shape (c, n, r)
        Of c uncorrelated components on n coordinates, in the functions of the rod.
    ratio : callable
        Frequencies [Hz] -> the cable's length over the coherence length. [-]
    spectrum : callable
        Frequencies [Hz] -> spectrum of the speed.
    span : tuple of float
        The last is the highest frequency. [Hz]
    """

    rod: Rod
    loads: np.ndarray
    ratio: Callable
    spectrum: Callable
    span: tuple

    def within(self, shapes):
        """The same for coordinates in a space, shape (n, r)."""
        return replace(self, loads=np.einsum("nk,cnr->ckr", shapes, self.loads))

    def inputs(self, count):
        """One force on each coordinate: shape (count, count)."""
        return np.eye(count)

    def noise(self, frequency):
        """`Noise` at frequencies [Hz]."""
        functions = self.spectrum(frequency) * self._shares(frequency)
        return Noise(self._known[1], [slice(None)], [[functions]])

    def matrix_times(self, frequency, columns):
        """Spectral matrix of the inputs at frequencies, shape (f,), times columns, shape (f, n, o)."""
        matrices = np.tensordot(self._shares(frequency), self._known[1], axes=(0, 0))
        return self.spectrum(frequency)[:, None, None] * (matrices @ columns)

    def own(self, frequency):
        """Spectrum of the force on each coordinate at a frequency of its own [Hz], shape (n,)."""
        return self.spectrum(frequency) * self.rod.variance(self.loads, self.ratio(frequency))

    @cached_property
    def _known(self):
        """Logarithms of ratios, and the covariances for them; None and only one where there is one ratio."""
        low, high = self.ratio(np.array([0.0, self.span[-1]])).tolist()
        count = ceil(PER_DECADE * np.log10(high / low))
        if not count:
            return None, self.rod.covariance(self.loads, np.array([low]))
        ratios = np.geomspace(low, high, 1 + max(count, DEGREE))
        return np.log(ratios), self.rod.covariance(self.loads, ratios)

    def _shares(self, frequency):
        """Share of each known covariance in that at frequencies, shape (k, f)."""
        known = self._known[0]
        if known is None:
            return np.ones((1, len(frequency)))
        place = np.clip(np.log(self.ratio(frequency)), known[0], known[-1])
        return CardinalSplines(known, DEGREE)(place).T
