"""`wind/spectrum.py`: variances and slopes by closed form, the paper's Fig. 6, scaling laws, the ends of the scale."""

import itertools

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import quad

from cablestudy.scene.schema import scene_schema
from cablestudy.wind import spectrum as wind_spectrum
from cablestudy.wind.spectrum import VON_KARMAN_EXACT, admittance, speed_spectrum

SPEED, RMS, SCALE, AREA = 3.0, 0.45, 25.0, 0.6  # speed, scale and area of the paper's Fig. 6
_KEYS = scene_schema()["$defs"]["Wind"]["properties"]
SPECTRA, ADMITTANCES = (_KEYS[key]["enum"] for key in ("spectrum", "admittance"))  # all that a scene may name


def variance(kind, speed=SPEED, rms=RMS, scale=SCALE):
    """Integral over f = e^y."""
    pieces = [-40, -10, -5, -2, 0, 2, 5, 10, 40, 120]

    def of_log(y):
        frequency = np.exp(y)
        return frequency * float(speed_spectrum(frequency, speed, rms, scale, kind))

    return sum(quad(of_log, low, high, epsabs=0, epsrel=1e-12)[0] for low, high in itertools.pairwise(pieces))


def test_each_spectrum_that_a_scene_may_name_has_its_formula():
    assert list(wind_spectrum.SPECTRA) == SPECTRA


@pytest.mark.parametrize("kind", SPECTRA)
@pytest.mark.parametrize(("speed", "rms", "scale"), [(SPEED, RMS, SCALE), (20.0, 3.0, 1200.0)])
def test_the_integral_is_the_variance(kind, speed, rms, scale):
    # 4/(1 + c x^2)^(5/6) integrates to 2 B(1/2, 1/3)/sqrt(c)
    expected = float(2 * mp.beta(mpf(1) / 2, mpf(1) / 3) / mp.sqrt(70.7)) if kind == "von_karman" else 1.0
    assert variance(kind, speed, rms, scale) == pytest.approx(expected * rms**2, rel=1e-10)


def test_the_constants_of_von_karman():
    assert float(4 * mp.beta(mpf(1) / 2, mpf(1) / 3) ** 2) == pytest.approx(VON_KARMAN_EXACT, rel=1e-15)
    assert variance("von_karman", rms=1.0) == pytest.approx(1.00057, abs=5e-6)


def test_what_the_spectra_are_at_one_point():
    # x = f L/v = 1: the formulas of the docstring by hand
    found = [float(speed_spectrum(np.array(2.0), 10.0, 3.0, 5.0, kind)) for kind in SPECTRA]
    expected = [4 / 71.7 ** (5 / 6), 4 / 71.78012763381717 ** (5 / 6), 2 / 3 / 2 ** (4 / 3), 4 / 7 ** (5 / 3)]
    assert found == pytest.approx([9 * 5 / 10 * value for value in expected], rel=1e-14)


@pytest.mark.parametrize("kind", SPECTRA)
def test_ends_of_the_spectra(kind):
    """The slope of Kolmogorov; S(0) = 4 sigma^2 L/v, the integral of the correlation, but for Davenport."""

    def slope(frequency):
        values = speed_spectrum(np.array([frequency, 2 * frequency]), SPEED, RMS, SCALE, kind)
        return float(np.diff(np.log2(values))[0])

    assert slope(1e6) == pytest.approx(-5 / 3, abs=1e-6)
    assert slope(1e-9) == pytest.approx(1.0 if kind == "davenport" else 0.0, abs=1e-6)
    if kind != "davenport":
        low = float(speed_spectrum(np.array(1e-12), SPEED, RMS, SCALE, kind))
        assert low == pytest.approx(4 * RMS**2 * SCALE / SPEED, rel=1e-9)


def test_admittance():
    corner = SPEED / (2 * np.sqrt(AREA))
    assert corner == pytest.approx(1.9365, abs=1e-4)  # Fig. 6: v = 3 m/s, A = 0.6 m^2
    frequency = np.array([0.0, corner, 1e8 * corner])
    once, twice, none = (admittance(frequency, SPEED, AREA, kind) for kind in ADMITTANCES)
    assert once == pytest.approx([1.0, 0.5, 1e8 ** (-4 / 3)], rel=1e-9)
    assert twice == pytest.approx(once**2, rel=1e-14)
    assert (none == 1).all()
    falling = admittance(np.geomspace(1e-6, 1e6, 200), SPEED, AREA)
    assert (np.diff(falling) < 0).all()
    assert ((falling > 0) & (falling < 1)).all()


@pytest.mark.crossed
@pytest.mark.parametrize("kind", SPECTRA)
@pytest.mark.parametrize("share", ADMITTANCES)
@pytest.mark.parametrize(("speed", "scale", "area"), [(6.0, 25.0, 0.6), (1e-3, 1e4, 1e6), (300.0, 1e-2, 1e-8)])
def test_nothing_overflows(kind, share, speed, scale, area):
    frequency = np.geomspace(1e-12, 1e12, 97)
    # a warning of numpy is an error here
    found = speed_spectrum(frequency, speed, 0.9, scale, kind) * admittance(frequency, speed, area, share)
    assert np.isfinite(found).all()
    assert (found > 0).all()
