"""`wind/spectrum.py`: variances and slopes by closed form, the paper's Fig. 6, scaling laws, the ends of the scale."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import quad

from cablestudy.scene.schema import scene_schema
from cablestudy.wind.spectrum import VON_KARMAN_EXACT, admittance, force_spectrum, speed_spectrum

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


def of_wind(**changes):
    values = {"speed": 6.0, "turbulence": 0.9, "length_scale": 25.0, "air_density": 1.2}
    return SimpleNamespace(**{**values, "spectrum": "von_karman", "admittance": "vickery", **changes})


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


def test_units_of_the_force():
    # [kg/m^3 m^2 m/s]^2 [m^2/s^2/Hz] = N^2/Hz: slow gusts act as the derivative of the mean drag rho C A v^2/2
    wind, small = of_wind(admittance="none"), np.array([1e-9])
    speed = 6.0
    drag = [1.2 * 1.17 * 0.6 * (speed + step) ** 2 / 2 for step in (-1e-4, 1e-4)]
    derivative = (drag[1] - drag[0]) / 2e-4
    expected = derivative**2 * speed_spectrum(small, speed, 0.9, 25.0)
    assert force_spectrum(small, wind, 0.6, 1.17) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "area", "drag", "factor"),
    [
        ({"turbulence": 1.8}, 0.6, 1.17, 4),
        ({"air_density": 0.6}, 0.6, 1.17, 1 / 4),
        ({}, 0.6, 2.34, 4),
        # a wind twice as fast past lengths twice as large: the same times, area 4, (rho C A v)^2 64, S_v sigma^2 alone
        ({"speed": 12.0, "length_scale": 50.0}, 2.4, 1.17, 64),
    ],
)
def test_scaling_of_the_force(changes, area, drag, factor):
    frequency = np.geomspace(1e-3, 1e3, 7)
    base = force_spectrum(frequency, of_wind(), 0.6, 1.17)
    assert force_spectrum(frequency, of_wind(**changes), area, drag) == pytest.approx(factor * base, rel=1e-14)
    free = of_wind(admittance="none")
    twice, once = (force_spectrum(frequency, free, area, 1.17) for area in (1.2, 0.6))
    assert twice == pytest.approx(4 * once, rel=1e-14)


@pytest.mark.parametrize("kind", SPECTRA)
@pytest.mark.parametrize("share", ADMITTANCES)
@pytest.mark.parametrize(("speed", "scale", "area"), [(6.0, 25.0, 0.6), (1e-3, 1e4, 1e6), (300.0, 1e-2, 1e-8)])
def test_nothing_overflows(kind, share, speed, scale, area):
    frequency = np.geomspace(1e-12, 1e12, 97)
    wind = of_wind(spectrum=kind, admittance=share, speed=speed, length_scale=scale)
    found = force_spectrum(frequency, wind, area, 1.17)  # a warning of numpy is an error here
    assert np.isfinite(found).all()
    assert (found > 0).all()
