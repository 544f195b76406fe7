"""The gondola in the wind: spectra of wind speed (the paper's Fig. 6) and displacement, and cumulative variance."""

import numpy as np
from matplotlib.figure import Figure

from cablestudy.errors import NoSolutionError
from cablestudy.study.columns import GONDOLA_X
from cablestudy.study.plots.spectra import RANGE, frequencies_near, share_below
from cablestudy.study.plots.style import BLUE, GREY, RED, WIDTH, heading, styled
from cablestudy.study.plots.words import quantity_text
from cablestudy.study.suspension.response import CLOSED, OPEN
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
    closed, at_rest = (case.winds_on(on, open_loop) for open_loop in (False, True))
    movement = closed[0].movement
    frequency, controlled = _grid(movement), movement.loop is not None and movement.loop.gain
    with np.errstate(all="ignore"):
        parts = [_spectrum(wind, frequency, CLOSED) for wind in closed]
        held, alone = sum(parts), sum(_spectrum(wind, frequency, OPEN) for wind in at_rest)
    if not _rms(at_rest, open_loop=True):
        raise NoSolutionError("the wind on the cable exerts no force on the gondola: there is nothing to draw")
    if not (np.isfinite(1e6 * held) & np.isfinite(1e6 * alone) & (alone > 0)).all():
        raise NoSolutionError("the response spectrum is too large or too small for a picture")
    figure = Figure(figsize=(WIDTH, 8.0), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    _speed(axes[0], case, frequency, on)
    _displacement(axes[1], frequency, alone, held if controlled else None)
    if on == "both":
        axes[1].loglog(frequency, 1e6 * parts[1], color=BLUE, ls="--", label="by the wind on the cable")
    axes[1].legend(loc="lower left")
    lines = [(alone, GREY, _rms(at_rest, open_loop=True), "winch at rest")]
    if controlled:
        lines.append((held, RED, _rms(closed, open_loop=False), "winch loop closed"))
    _variance(axes[2], frequency, lines)
    axes[2].set_xlabel("frequency [Hz]")
    axes[2].set_xlim(*RANGE)
    figure.align_ylabels(axes)
    wind = case.scene.wind
    what = WHAT[on].format(mass=quantity_text(case.scene.gondola.mass, "kg"))
    heading(figure, f"Wind at {quantity_text(wind.speed, 'm/s')} on {what}")
    return figure


def _grid(movement):
    """Frequencies with equal ratios, and closer ones near the poles."""
    poles = [movement.open_poles, *([movement.loop.eigen.poles] if movement.loop else [])]
    return frequencies_near(np.concatenate(poles), np.linspace(-5, 5, 41), POINTS)


def _spectrum(wind, frequency, state):
    """Of the displacement of the gondola, with the loop (CLOSED) or the winch at rest (OPEN), shape (f,). [m^2/Hz]"""
    response = wind.response
    found = response.spectra(frequency)
    return found[state if len(found) > 1 else 0, response.names.index(GONDOLA_X)]


def _rms(winds, open_loop):
    """Of the displacement in winds that have nothing to do with each other. [m]"""
    return float(np.sqrt(sum(wind.rms([GONDOLA_X], "value", open_loop)[0] ** 2 for wind in winds)))


def _speed(axes, case, frequency, on):
    wind = case.scene.wind
    bare = speed_spectrum(frequency, wind.speed, wind.turbulence, wind.length_scale, wind.spectrum)
    axes.loglog(frequency, bare, color=BLUE, label="wind speed")
    if wind.admittance != "none" and on != "cable":
        share = admittance(frequency, wind.speed, case.scene.gondola.area, wind.admittance)
        axes.loglog(frequency, bare * share, color=BLUE, ls="--", label="averaged over the gondola")
    axes.set_ylabel("spectrum of the\nwind speed [(m/s)²/Hz]")
    axes.legend(loc="lower left")


def _displacement(axes, frequency, alone, held):
    axes.loglog(frequency, 1e6 * alone, color=GREY, label="winch at rest")
    if held is not None:
        axes.loglog(frequency, 1e6 * held, color=RED, label="winch loop closed")
    axes.set_ylabel("spectrum of the gondola's\ndisplacement [mm²/Hz]")


def _variance(axes, frequency, lines):
    for spectrum, colour, total, label in lines:
        label = f"{label}: {quantity_text(1e3 * total, 'mm')} RMS"
        axes.semilogx(frequency, share_below(frequency, spectrum), color=colour, label=label)
    axes.set_ylabel("share of the\nvariance below")
    axes.set_ylim(0, 1.02)
    axes.legend(loc="upper left")
