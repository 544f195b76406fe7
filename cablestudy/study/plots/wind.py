"""The gondola in the wind: spectra of wind speed (the paper's Fig. 6) and displacement, and cumulative variance."""

from functools import reduce

import numpy as np
from matplotlib.figure import Figure

from cablestudy.errors import NoSolutionError
from cablestudy.study.plots.spectra import RANGE, frequencies_near, share_below
from cablestudy.study.plots.style import BLUE, GREY, RED, WIDTH, heading, styled
from cablestudy.study.plots.words import quantity_text
from cablestudy.study.windrms import cable_force_of, combine, force_of, spectra_of
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
    frequency = _grid(case)
    forces = {"gondola": [force_of], "cable": [cable_force_of], "both": [force_of, cable_force_of]}[on]
    with np.errstate(all="ignore"):
        loop = case.loop if on == "gondola" else case.loop_in_air
        parts = [spectra_of(loop, force(case))(frequency) for force in forces]
        held, _, alone, _ = sum(parts)
    if not alone.any():
        raise NoSolutionError("the wind on the cable exerts no force on the gondola: there is nothing to draw")
    if not (np.isfinite(1e6 * held) & np.isfinite(1e6 * alone) & (alone > 0)).all():
        raise NoSolutionError("the response spectrum is too large or too small for a picture")
    figure = Figure(figsize=(WIDTH, 8.0), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    _speed(axes[0], case, frequency, on)
    _displacement(axes[1], case, frequency, alone, held)
    if on == "both":
        axes[1].loglog(frequency, 1e6 * parts[1][0], color=BLUE, ls="--", label="by the wind on the cable")
    axes[1].legend(loc="lower left")
    lines = [(alone, GREY, _response(case, on, "open_").open_displacement, "winch at rest")]
    if case.loop.gain:
        lines.append((held, RED, _response(case, on).displacement, "winch loop closed"))
    _variance(axes[2], frequency, lines)
    axes[2].set_xlabel("frequency [Hz]")
    axes[2].set_xlim(*RANGE)
    figure.align_ylabels(axes)
    wind = case.scene.wind
    what = WHAT[on].format(mass=quantity_text(case.scene.gondola.mass, "kg"))
    heading(figure, f"Wind at {quantity_text(wind.speed, 'm/s')} on {what}")
    return figure


def _grid(case):
    """Frequencies with equal ratios, and closer ones near the poles."""
    poles = np.concatenate([case.loop.open_poles, case.loop.closed_poles if case.loop.gain else case.loop.open_poles])
    return frequencies_near(poles, np.linspace(-5, 5, 41), POINTS)


def _response(case, on, which=""):
    """The response that is drawn."""
    names = {"gondola": ["response"], "cable": ["cable_response"], "both": ["response_in_air", "cable_response"]}[on]
    return reduce(combine, [getattr(case, which + name) for name in names])


def _speed(axes, case, frequency, on):
    wind = case.scene.wind
    bare = speed_spectrum(frequency, wind.speed, wind.turbulence, wind.length_scale, wind.spectrum)
    axes.loglog(frequency, bare, color=BLUE, label="wind speed")
    if wind.admittance != "none" and on != "cable":
        share = admittance(frequency, wind.speed, case.scene.gondola.area, wind.admittance)
        axes.loglog(frequency, bare * share, color=BLUE, ls="--", label="averaged over the gondola")
    axes.set_ylabel("spectrum of the\nwind speed [(m/s)²/Hz]")
    axes.legend(loc="lower left")


def _displacement(axes, case, frequency, alone, held):
    axes.loglog(frequency, 1e6 * alone, color=GREY, label="winch at rest")
    if case.loop.gain:
        axes.loglog(frequency, 1e6 * held, color=RED, label="winch loop closed")
    axes.set_ylabel("spectrum of the gondola's\ndisplacement [mm²/Hz]")


def _variance(axes, frequency, lines):
    for spectrum, colour, total, label in lines:
        label = f"{label}: {quantity_text(1e3 * total, 'mm')} RMS"
        axes.semilogx(frequency, share_below(frequency, spectrum), color=colour, label=label)
    axes.set_ylabel("share of the\nvariance below")
    axes.set_ylim(0, 1.02)
    axes.legend(loc="upper left")
