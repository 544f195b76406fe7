"""Bode plot of frequency responses, with a gondola as the paper's Fig. 8."""

from itertools import cycle

from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from cablestudy.study.plots.style import DASHES, SERIES, WIDTH, heading, panels, styled
from cablestudy.study.plots.words import axis_label


@styled
def bode(curves, frequency, *numbers, title="frequency responses"):
    """Figure of frequency responses: a panel of their magnitudes against frequency, and below it one of their phases.

    Parameters
    ----------
    curves : list of Curve
        Names and unit of the responses; all have one unit.
    frequency : ndarray, shape (m,)
        Ascending. [Hz]
    numbers : ndarray, shape (m,)
        Magnitude [unit] and phase [deg] of the first curve, then of the second, and so on.
    title : str
        Title of a figure of several curves; one curve has its label as the title.
    """
    figure = Figure(figsize=(WIDTH, 5.2), layout="constrained")
    magnitude, phase = panels(figure, 2, 1, height_ratios=(3, 2))
    for k, (colour, dashes, curve) in enumerate(zip(cycle(SERIES), cycle(DASHES), curves, strict=False)):
        look = {"color": colour, "ls": dashes, "lw": 1.1, "label": curve.label}  # dashed, since curves may coincide
        magnitude.loglog(frequency, numbers[2 * k], **look)
        phase.semilogx(frequency, numbers[2 * k + 1], **look)
    magnitude.set_ylabel(axis_label("magnitude", curves[0].unit or "-"))
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [Hz]")
    low, high = phase.get_ylim()
    if high - low < 2000:  # else ticks at multiples of 180 degrees would be too dense
        phase.yaxis.set_major_locator(MultipleLocator(90 if high - low < 800 else 180))
    magnitude.set_xlim(frequency[0], frequency[-1])
    if len(curves) > 1:
        magnitude.legend(loc="lower left")
    title = curves[0].label if len(curves) == 1 else title
    heading(figure, title[0].upper() + title[1:])
    figure.align_ylabels()
    return figure
