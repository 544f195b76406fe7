"""Common look of all pictures: colours, sizes, scales, ticks; and their files."""

import io
import os
from functools import wraps

import matplotlib.style
import numpy as np
from matplotlib.ticker import Formatter, MaxNLocator

from cablestudy.study.table import write_whole

BLUE, RED, GREEN, ORANGE, PINK, SKY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9"  # Okabe and Ito
GREY, LIGHT = "#555555", "#e4e4e4"
SERIES = (BLUE, GREEN, ORANGE, PINK, SKY, "#000000")
STYLE = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelcolor": "#222222",
    "axes.edgecolor": "#888888",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": LIGHT,
    "grid.linewidth": 0.6,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "svg.hashsalt": "cablestudy",  # default: random, so that equal pictures are different files
}
UNDATED = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
WIDTH = 7.5  # of a picture [in]
TALL = 0.75  # height over width of the tallest panel
DEEP = 0.1  # sag over chord from which a cable is drawn true to scale


def styled(draw):
    """Decorator: draw with STYLE on matplotlib's defaults, without the user's configuration."""

    @wraps(draw)
    def run(*arguments):
        with matplotlib.style.context(["default", STYLE]):
            return draw(*arguments)

    return run


@styled
def save(figure, path):
    """Write a figure to a .png, .svg or .pdf file, completely or not at all; equal figures give equal files."""
    kind = os.path.splitext(path)[1].lower()
    data = io.BytesIO()
    figure.savefig(data, format=kind[1:], dpi=150, metadata=UNDATED[kind])
    write_whole(path, data.getvalue())


class Window:
    """Limits of the axes for a cable, and the enlargement of the vertical scale: 1, 2 or 5 times 10^k.

    Parameters
    ----------
    x, y : ndarray
        Points that must be visible. [m]
    ratio : float
        Height over width of an enlarged picture; a picture true to scale may be taller. [-]
    """

    def __init__(self, x, y, ratio):
        low, high = np.min(y), np.max(y)
        self.x = padded(np.min(x), np.max(x), 0.03, 0.03)
        self.width = self.x[1] - self.x[0]
        margin = 0.18 if high - low < DEEP * self.width else 0.10
        self.y = padded(low, high, 1.6 * margin, margin)
        tall = self.y[1] - self.y[0]
        factor = nice(ratio * self.width / max(tall, 1e-12 * self.width))
        self.factor = 1.0 if factor < 2 else factor
        spare = max(ratio * self.width / self.factor - tall, 0.0)
        self.y = (self.y[0] - spare / 2, self.y[1] + spare / 2)
        self.ratio = self.factor * (self.y[1] - self.y[0]) / self.width
        if self.ratio > TALL:
            spare = self.width * (self.ratio / TALL - 1)
            self.x = (self.x[0] - spare / 2, self.x[1] + spare / 2)
            self.width, self.ratio = self.width + spare, TALL

    @property
    def note(self):
        """Text that states the scale."""
        return "true to scale" if self.factor == 1 else f"vertical scale enlarged {self.factor:,.0f} times"

    def apply(self, axes, along_x=8, along_y=6):
        """Sets these limits and this scale on axes, with at most so many ticks."""
        axes.set(xlim=self.x, ylim=self.y)
        axes.set_aspect(self.factor, adjustable="box")
        plain(axes, along_x, along_y)


def padded(low, high, below, above):
    """An interval extended at both ends by shares of its length."""
    size = high - low
    return low - below * size, high + above * size


def nice(value):
    """The largest of 1, 2, 5 times a power of ten that does not exceed a number."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(m * power for m in (1, 2, 5) if m * power <= value * (1 + 1e-9)))


class _Plain(Formatter):
    """Tick labels without offsets, and without exponents where possible."""

    def __call__(self, value, _=None):
        low, high = self.axis.get_view_interval()
        size, largest = abs(high - low) or 1.0, max(abs(low), abs(high), 1e-300)
        if abs(value) < 1e-9 * size:
            return "0"
        digits = int(np.floor(np.log10(largest)) - np.floor(np.log10(size))) + 4
        text = f"{value:.{digits}g}"
        if "e" in text and 1e-6 < abs(value) < 1e8:
            text = f"{value:.10f}".rstrip("0").rstrip(".")
        return text.replace("-", "−")


def plain(axes, along_x, along_y):
    """Sets at most so many ticks at round numbers, with plain labels, on both axes."""
    plain_axis(axes.xaxis, along_x)
    plain_axis(axes.yaxis, along_y)


def plain_axis(axis, count):
    """Sets at most so many ticks at round numbers, with plain labels, on one axis."""
    axis.set_major_locator(round_ticks(count))
    axis.set_major_formatter(_Plain())


def round_ticks(count):
    """Locator of at most so many ticks at round numbers."""
    return MaxNLocator(count, steps=(1, 2, 2.5, 5, 10))


def panels(figure, count, columns, **options):
    """List of axes, row by row, with a common scale along x, labelled at the lowest axes of each column."""
    grid = figure.subplots(-(-count // columns), columns, sharex=True, squeeze=False, **options).ravel()
    for k, axes in enumerate(grid):
        if k < count:
            axes.tick_params(labelbottom=k + columns >= count)
        else:
            axes.set_axis_off()
    return list(grid[:count])
