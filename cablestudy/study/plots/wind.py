"""The gondola in the wind: spectra of wind speed (the paper's Fig. 6) and displacement, and cumulative variance."""

import numpy as np
from matplotlib.figure import Figure

from cablestudy.errors import NoSolutionError
from cablestudy.study.columns import GONDOLA_X
from cablestudy.study.loop_report import resonances
from cablestudy.study.plots.spectra import RANGE, frequencies_near, share_below
from cablestudy.study.plots.style import BLUE, GREY, RED, WIDTH, heading, styled
from cablestudy.study.plots.words import quantity_text
from cablestudy.wind.spectrum import admittance, speed_spectrum

POINTS = 4000
WHAT = {"gondola": "a gondola of {mass}", "cable": "the cable of a gondola of {mass}",
        "both": "a gondola of {mass} and its cable"}  # fmt: skip


@styled
def wind_response(case, on="gondola"):
    """Figure of wind speed with and without admittance, displacement and cumulative variance against frequency.

    Parameters
    ----------
    case : Case
        With gondola and wind; its loop is stable.
    on : {"gondola", "cable", "both"}
        What the wind acts on. Forces on the two are taken as uncorrelated: their spectra add.

    Raises
    ------
    NoSolutionError
        The response is zero, or outside the range of a picture.
    """
    winds = _winds(case, on)
    frequency = _grid(winds)
    with np.errstate(all="ignore"):
        parts = [_spectra(drawn, frequency) for drawn, _ in winds]
    held, alone = sum(parts)
    looped = winds[0][0].response.loop is not None
    if not alone.any():
        raise NoSolutionError("the wind on the cable exerts no force on the gondola: there is nothing to draw")
    if not (np.isfinite(1e6 * held) & np.isfinite(1e6 * alone) & (alone > 0)).all():
        raise NoSolutionError("the response spectrum is too large or too small for a picture")
    figure = Figure(figsize=(WIDTH, 8.0), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    _speed(axes[0], case, frequency, on)
    _displacement(axes[1], looped, frequency, alone, held)
    if on == "both":
        axes[1].loglog(frequency, 1e6 * parts[1][0], color=BLUE, ls="--", label="by the wind on the cable")
    axes[1].legend(loc="lower left")
    lines = [(alone, GREY, _rms(winds, open_loop=True), "winch at rest")]
    if looped:
        lines.append((held, RED, _rms(winds, open_loop=False), "winch loop closed"))
    _variance(axes[2], frequency, lines)
    axes[2].set_xlabel("frequency [Hz]")
    axes[2].set_xlim(*RANGE)
    figure.align_ylabels(axes)
    wind = case.scene.wind
    what = WHAT[on].format(mass=quantity_text(case.scene.gondola.mass, "kg"))
    heading(figure, f"Wind at {quantity_text(wind.speed, 'm/s')} on {what}")
    return figure


def _winds(case, on):
    """What the wind acts on, each as an `InWind` whose spectra are drawn, and as what knows its RMS."""
    if on == "gondola":
        return [(case.in_wind, case.in_wind)]
    by_cable = case.in_cable_wind.side(), case.in_cable_wind
    return [by_cable] if on == "cable" else [(case.in_wind_that_damps, case.in_wind_that_damps), by_cable]


def _grid(winds):
    """Frequencies with equal ratios, and closer ones near the resonances of the gondola."""
    return frequencies_near(resonances(winds[0][0].movement), np.linspace(-5, 5, 41), POINTS)


def _spectra(found, frequency):
    """Spectra of the displacement of the gondola of an `InWind`, with the loop and with the winch at rest: (2, f)."""
    spectra = found.response.spectra(frequency)[:, found.response.names.index(GONDOLA_X)]
    return spectra[[0, -1]]


def _rms(winds, open_loop):
    """Of the displacement, all winds together. [m]"""
    return np.sqrt(sum(one.rms([GONDOLA_X], "value", open_loop)[0] ** 2 for _, one in winds))


def _speed(axes, case, frequency, on):
    wind = case.scene.wind
    bare = speed_spectrum(frequency, wind.speed, wind.turbulence, wind.length_scale, wind.spectrum)
    axes.loglog(frequency, bare, color=BLUE, label="wind speed")
    if wind.admittance != "none" and on != "cable":
        share = admittance(frequency, wind.speed, case.scene.gondola.area, wind.admittance)
        axes.loglog(frequency, bare * share, color=BLUE, ls="--", label="averaged over the gondola")
    axes.set_ylabel("spectrum of the\nwind speed [(m/s)²/Hz]")
    axes.legend(loc="lower left")


def _displacement(axes, looped, frequency, alone, held):
    axes.loglog(frequency, 1e6 * alone, color=GREY, label="winch at rest")
    if looped:
        axes.loglog(frequency, 1e6 * held, color=RED, label="winch loop closed")
    axes.set_ylabel("spectrum of the gondola's\ndisplacement [mm²/Hz]")


def _variance(axes, frequency, lines):
    for spectrum, colour, total, label in lines:
        label = f"{label}: {quantity_text(1e3 * total, 'mm')} RMS"
        axes.semilogx(frequency, share_below(frequency, spectrum), color=colour, label=label)
    axes.set_ylabel("share of the\nvariance below")
    axes.set_ylim(0, 1.02)
    axes.legend(loc="upper left")
