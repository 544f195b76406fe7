"""Turbulence on one cable as inputs of a linear system: covariance of forces over frequency.

The spectral matrix of the forces of the wind on shapes of a cable depends on frequency by the spectrum of the speed and
by the cable's length over the coherence length: it is computed for some of these ratios and interpolated.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil

import numpy as np

from cablestudy.wind.coherence import DEGREE, FINE, Rod
from cablestudy.wind.spline import CardinalSplines
from cablestudy.wind.variance import Noise

PER_DECADE, INTERPOLATED = FINE


@dataclass(frozen=True)
class CableGusts:
    """Forces on coordinates by the wind along a cable.

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

    def noise(self, frequency):
        """`Noise` at frequencies [Hz]."""
        functions = self.spectrum(frequency) * self._shares(frequency)
        return Noise(self._known[1], [slice(None)], [[functions]])

    def matrix_times(self, frequency, columns):
        """Spectral matrix of the inputs at frequencies, shape (f,), times columns, shape (f, n, o)."""
        matrices = np.tensordot(self._shares(frequency), self._known[1], axes=(0, 0))
        return self.spectrum(frequency)[:, None, None] * (matrices @ columns)

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
