"""The gondola in the wind: spectrum of the speed (the paper's Fig. 6), of the response, and where its variance lies."""

import numpy as np
from matplotlib.figure import Figure

from cablestudy.errors import NoSolutionError
from cablestudy.study.plots.style import BLUE, GREY, RED, WIDTH, styled
from cablestudy.study.windrms import force_of, spectra_of
from cablestudy.wind.spectrum import admittance, speed_spectrum

POINTS = 4000
RANGE = (1e-3, 1e2)  # of the pictures [Hz]


@styled
def wind_response(case):
    """Three panels over frequency: wind speed with and without admittance, displacement, cumulative variance.

    Parameters
    ----------
    case : Case
        With gondola and wind, its loop stable.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    NoSolutionError
        Numbers that no picture can show.
    """
    frequency = _grid(case)
    with np.errstate(all="ignore"):
        held, _, alone, _ = spectra_of(case.loop, force_of(case))(frequency)
    if not (np.isfinite(1e6 * held) & np.isfinite(1e6 * alone) & (alone > 0)).all():
        raise NoSolutionError("the response spectrum is too large or too small for a picture")
    figure = Figure(figsize=(WIDTH, 8.0), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    _speed(axes[0], case, frequency)
    _displacement(axes[1], case, frequency, alone, held)
    _variance(axes[2], case, frequency, alone, held)
    axes[2].set_xlabel("frequency [Hz]")
    axes[2].set_xlim(*RANGE)
    figure.align_ylabels(axes)
    wind = case.scene.wind
    figure.suptitle(f"Wind at {wind.speed:.4g} m/s on a gondola of {case.scene.gondola.mass:.4g} kg", fontsize=10)
    return figure


def _grid(case):
    """Frequencies dense everywhere, and denser at the poles."""
    poles = np.concatenate([case.loop.open_poles, case.loop.closed_poles if case.loop.gain else case.loop.open_poles])
    centre, width = np.abs(poles) / (2 * np.pi), np.abs(poles.real) / (2 * np.pi)
    near = (centre[:, None] + width[:, None] * np.linspace(-5, 5, 41)).ravel()
    points = np.concatenate([np.geomspace(*RANGE, POINTS), near])
    return np.unique(points[(points >= RANGE[0]) & (points <= RANGE[1])])


def _speed(axes, case, frequency):
    wind = case.scene.wind
    bare = speed_spectrum(frequency, wind.speed, wind.turbulence, wind.length_scale, wind.spectrum)
    axes.loglog(frequency, bare, color=BLUE, label="wind speed")
    if wind.admittance != "none":
        share = admittance(frequency, wind.speed, case.scene.gondola.area, wind.admittance)
        axes.loglog(frequency, bare * share, color=BLUE, ls="--", label="felt by the whole gondola")
    axes.set_ylabel("wind speed\n[(m/s)²/Hz]")
    axes.legend()


def _displacement(axes, case, frequency, alone, held):
    axes.loglog(frequency, 1e6 * alone, color=GREY, label="winch at rest")
    if case.loop.gain:
        axes.loglog(frequency, 1e6 * held, color=RED, label="winch loop closed")
    axes.set_ylabel("gondola\n[mm²/Hz]")
    axes.legend()


def _variance(axes, case, frequency, alone, held):
    lines = [(alone, GREY, case.open_response.open_displacement, "winch at rest")]
    if case.loop.gain:
        lines.append((held, RED, case.response.displacement, "winch loop closed"))
    for spectrum, colour, total, label in lines:
        step = np.diff(frequency) * (spectrum[1:] + spectrum[:-1]) / 2
        below = np.concatenate([[0.0], np.cumsum(step)]) / step.sum()
        axes.semilogx(frequency, below, color=colour, label=f"{label}: {1e3 * total:.3g} mm RMS")
    axes.set_ylabel("share of the\nvariance below")
    axes.set_ylim(0, 1.02)
    axes.legend()
