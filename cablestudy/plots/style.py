"""Common look of all pictures (colours, sizes, scales, ticks), and the writing of their files."""

import io
import logging
import os
import re
import warnings
from contextlib import contextmanager
from functools import lru_cache, wraps

import matplotlib.style
import numpy as np
from matplotlib import colormaps
from matplotlib.axis import Axis
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, fontManager
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.ticker import FixedLocator, Formatter, FuncFormatter, LogLocator, MaxNLocator, NullLocator

from cablestudy.plots.words import case_words, number, power_text
from cablestudy.study.table import write_whole

BLUE, RED, GREEN, ORANGE, PINK, SKY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9"  # Okabe and Ito
GREY, LIGHT = "#555555", "#e4e4e4"
SERIES = (BLUE, GREEN, ORANGE, PINK, SKY, "#000000")
DASHES = ("-", "--", "-.", ":", (0, (6, 1.5, 1, 1.5, 1, 1.5)))  # one fewer than SERIES: 30 pairs of the two
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
# with letters that matplotlib's own font lacks; of Linux, Windows and macOS
OTHER_LETTERS = (
    "Noto Sans CJK SC", "Noto Sans CJK JP", "Noto Sans CJK KR", "Noto Sans", "WenQuanYi Micro Hei",
    "Droid Sans Fallback", "Microsoft YaHei", "Yu Gothic", "Malgun Gothic", "Nirmala UI", "Segoe UI", "PingFang SC",
    "Hiragino Sans GB", "Apple SD Gothic Neo", "Arial Unicode MS", "Noto Sans Devanagari", "Noto Sans Thai",
    "Last Resort High-Efficiency",  # part of matplotlib: it has a sign for every character
)  # fmt: skip
BOX = {"frameon": True, "edgecolor": "none", "framealpha": 0.85}  # of a legend that stands on curves
UNDATED = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
CLIP_PATH = re.compile(rb'(id="|url\(#)(p[0-9a-f]{10})\b')  # its name in an SVG file, where it is defined or used
WIDTH = 7.5  # of a picture [in]
MOST_NAMES = 30  # along an axis
MANY_POINTS = 3000  # cells or points above which a vector file has them as an image, which is far smaller
UPRIGHT_NAMES = 2.8  # names per inch from which they stand upright
TICK_DIGITS, EQUAL_TICKS = 2, 1e-9  # of values that may be ticks themselves, and relative rounding of these
TALLEST_PANEL = 0.75  # height over width of the tallest panel
SHADES = ListedColormap(colormaps["viridis"](np.linspace(0.0, 0.88, 256)), "shades")  # of numbers
RATIO_OF_LOGARITHMIC = 9.9  # ratio from which values that are spaced by ratios are drawn so
DEEP_SAG = 0.1  # sag over chord from which a cable is drawn true to scale


def styled(draw):
    """Decorator: draw with STYLE on matplotlib's defaults, without the user's configuration.

    Letters that no font here has are drawn as the box that stands for them, and other fonts stand for those that
    matplotlib does not find, without a warning.
    """

    @wraps(draw)
    def run(*arguments, **options):
        with matplotlib.style.context(["default", STYLE | {"font.family": families()}]), _without_font_warnings():
            drawn = draw(*arguments, **options)
            if isinstance(drawn, Figure):
                _without_mathematics(drawn)
            return drawn

    return run


@contextmanager
def _without_font_warnings():
    """Keep matplotlib silent about letters and fonts: its list of fonts may be older than its files."""
    fonts = logging.getLogger("matplotlib.font_manager")
    level = fonts.level
    fonts.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", r"Glyph \d+ .*missing", UserWarning)
            yield
    finally:
        fonts.setLevel(level)


def _without_mathematics(artist):
    """Let a $ in names and titles of a figure be a $; the numbers at ticks of logarithmic scales are mathematics."""
    if isinstance(artist, Text):
        artist.set_parse_math(False)
    # an axis would make all of its ticks to name them
    for child in (artist.label, artist.offsetText) if isinstance(artist, Axis) else artist.get_children():
        _without_mathematics(child)


@lru_cache(maxsize=1)
def families():
    """The families of fonts for all text: matplotlib's own, and those of OTHER_LETTERS that are installed; list."""
    installed = fontManager.get_font_names()
    return ["DejaVu Sans", *(name for name in OTHER_LETTERS if name in installed)]


def save(figure, path):
    """Write a figure to a .png, .svg or .pdf file, completely or not at all; equal figures give equal files."""
    kind = os.path.splitext(path)[1].lower().removeprefix(".")
    data = rendered(figure, kind, 150)
    write_whole(path, with_numbered_clip_paths(data) if kind == "svg" else data)


@styled
def rendered(figure, kind, resolution):
    """A figure as a file of "png", "svg" or "pdf", as bytes; `resolution` in pixels per inch."""
    data = io.BytesIO()
    figure.savefig(data, format=kind, dpi=resolution, metadata=UNDATED[kind])
    return data.getvalue()


def with_numbered_clip_paths(svg):
    """An SVG file, bytes, with its clip paths numbered in the order in which they are used.

    matplotlib names them by all digits of their edges, the last of which depend on the order in which it happens to
    solve the layout: equal pictures would be different files.
    """
    numbers = {}
    return CLIP_PATH.sub(lambda name: name[1] + b"clip%d" % numbers.setdefault(name[2], len(numbers) + 1), svg)


class Window:
    """Limits of the axes for a cable, and the enlargement of the vertical scale: 1, 2 or 5 times 10^k.

    Points x, y [m] are visible. `ratio` is the height over width of an enlarged picture; one that is true to scale may
    be taller, up to `tallest`.
    """

    def __init__(self, x, y, ratio, tallest=TALLEST_PANEL):
        low, high = np.min(y), np.max(y)
        self.x = padded(np.min(x), np.max(x), 0.03, 0.03)
        self.width = max(self.x[1] - self.x[0], 1e-3 * (high - low))
        margin = 0.18 if high - low < DEEP_SAG * self.width else 0.10
        self.y = padded(low, high, 1.6 * margin, margin)
        height = self.y[1] - self.y[0]
        factor = nice(ratio * self.width / max(height, 1e-12 * self.width))
        self.factor = 1.0 if factor < 2 else factor
        spare = max(ratio * self.width / self.factor - height, 0.0)
        self.y = (self.y[0] - spare / 2, self.y[1] + spare / 2)
        self.ratio = self.factor * (self.y[1] - self.y[0]) / self.width
        if self.ratio > tallest:
            spare = self.width * (self.ratio / tallest - 1)
            self.x = (self.x[0] - spare / 2, self.x[1] + spare / 2)
            self.width, self.ratio = self.width + spare, tallest

    def note(self, scale="vertical scale"):
        """Text that states the scale; `scale` is what the one upwards on the paper is called."""
        return "true to scale" if self.factor == 1 else f"{scale} enlarged {number(self.factor)} times"

    def apply(self, axes, along_x=8, along_y=6):
        """Set these limits and this scale on axes, with at most `along_x` and `along_y` ticks."""
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


class _PlainTicks(Formatter):
    """Tick labels of at most four digits, without exponents where possible.

    Numbers that need more digits are differences from an offset, which stands at the end of the axis, as `+ 1345`.
    """

    _offset = 0.0

    def __call__(self, value, _=None):
        low, high = self.axis.get_view_interval()
        if abs(value - self._offset) < 1e-9 * (abs(high - low) or 1.0):
            return "0"
        return number(value - self._offset)

    def format_ticks(self, values):
        """Labels of all ticks."""
        values = np.asarray(values, dtype=float)
        self._offset = 0.0
        distinct = np.unique(values)
        if len(distinct) > 1:
            error = np.abs([float(f"{value:.4g}") - value for value in distinct]).max()
            if error > 0.01 * np.diff(distinct).min():
                self._offset = float(f"{distinct[len(distinct) // 2]:.4g}")
        return [self(value) for value in values]

    def get_offset(self):
        """The offset from which the labels are differences; empty for none."""
        return f"{'+' if self._offset > 0 else '−'} {number(abs(self._offset))}" if self._offset else ""


def plain(axes, along_x, along_y):
    """Set at most `along_x` and `along_y` ticks at round numbers, with plain labels, on both axes."""
    plain_axis(axes.xaxis, along_x)
    plain_axis(axes.yaxis, along_y)


def plain_axis(axis, count):
    """Set at most `count` ticks at round numbers, with plain labels, on one axis."""
    axis.set_major_locator(round_ticks(count))
    axis.set_major_formatter(_PlainTicks())


def round_ticks(count):
    """Locator of at most `count` ticks at round numbers."""
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


def log_axis(axis, low, high, count=8, own=()):
    """Make an axis logarithmic, with round ticks for values from low to high, or with ticks at its own values."""
    getattr(axis.axes, f"set_{axis.axis_name}scale")("log")
    log_ticks(axis, low, high, count, own)


def log_ticks(axis, low, high, count=8, own=()):
    """Set at most about `count` round ticks with plain labels on a logarithmic axis."""
    decades = np.log10(high / low)
    if len(own):
        axis.set_major_locator(FixedLocator(own))
    elif decades < 0.6:
        axis.set_major_locator(round_ticks(4))
    else:
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if 3 * decades <= count else (1,), numticks=count))
    text = number if len(own) or decades < 0.6 else power_text
    axis.set_major_formatter(FuncFormatter(lambda value, _: text(value)))
    axis.set_minor_locator(NullLocator())


def own_ticks(values, most, apart):
    """The ticks of a logarithmic axis that are its ascending values themselves, if these are few, round and not close.

    At most `most` values, of `TICK_DIGITS` digits; neighbours have a ratio of at least 10^apart.
    """
    if not 1 < len(values) <= most or np.diff(np.log10(values)).min() < apart:
        return []
    rounded = [float(f"{value:.{TICK_DIGITS}g}") for value in values]
    return values if np.allclose(values, rounded, rtol=EQUAL_TICKS, atol=0.0) else []


def colours_over(values, logarithmic=None):
    """Colours for values, as a ScalarMappable: dark to light, none so light that it is lost on white.

    Without `logarithmic` that is decided by the values.
    """
    values = np.asarray(values, dtype=float)
    low, high = float(values.min()), float(values.max())
    if logarithmic is None:
        logarithmic = spans_decades((low, high))
    if low == high:
        low, high = low - (0.1 * abs(low) or 1.0), high + (0.1 * abs(high) or 1.0)
    return ScalarMappable(LogNorm(low, high) if logarithmic else Normalize(low, high), SHADES)


def colours_of_names(count):
    """Colours for names at 0, 1, 2, ..., as a ScalarMappable: those of as many numbers, in steps."""
    return ScalarMappable(Normalize(-0.5, count - 0.5), SHADES.resampled(count))


def spans_decades(values):
    """True if ascending values are better drawn on a logarithmic scale, if that is one for them."""
    return len(values) > 0 and bool(0 < 30 * values[0] < values[-1])


def spaced_logarithmically(values):
    """True if distinct, ascending values are spaced by ratios rather than by differences.

    Their median is then nearer to the geometric mean of the smallest and the largest than to the arithmetic one; that
    holds of ranges, of lists as 1, 2, 5, 10, and of samples.
    """
    if len(values) < 3 or not 0 < RATIO_OF_LOGARITHMIC * values[0] <= values[-1]:
        return False
    geometric, arithmetic = np.sqrt(values[0]) * np.sqrt(values[-1]), values[0] / 2 + values[-1] / 2
    return bool(np.median(values) < np.sqrt(geometric) * np.sqrt(arithmetic))


def colour_bar(figure, axes, mappable, label, ticks=(), names=(), **options):
    """Add a colour bar with round ticks, or with names at some ticks, beside axes."""
    bar = figure.colorbar(mappable, ax=axes, **options)
    bar.outline.set_visible(False)
    low, high = mappable.get_clim()
    if len(names):
        bar.ax.yaxis.set_minor_locator(NullLocator())
        bar.set_ticks(ticks, labels=names, fontsize=7)
    elif isinstance(mappable.norm, LogNorm):
        log_ticks(bar.ax.yaxis, low, high)
    else:
        plain_axis(bar.ax.yaxis, 7)
    bar.set_label(wrapped(label, 0.8 * figure.get_figheight(), 9))
    return bar


def legend_below(figure, entries, size=8.5):
    """One legend of a whole figure below it, in as many columns as fit; `entries` are pairs (artist, str)."""
    if not entries:
        return None
    room = figure.get_figwidth() - 0.2
    entries = [(artist, wrapped(label, room - 0.7, size)) for artist, label in entries]
    widest = max(text_width(line, size) for _, label in entries for line in label.splitlines()) + 0.65
    columns = max(1, min(len(entries), 4, int(room / widest)))
    return figure.legend(*zip(*entries, strict=True), loc="outside lower center", ncols=columns, fontsize=size)


def entries_of(axes):
    """Entries of a legend for all that has a label in axes: list of (artist, str)."""
    return list(zip(*axes.get_legend_handles_labels(), strict=True))


def zero_lines(axes):
    """Draw the lines x = 0 and y = 0."""
    axes.axhline(0, color=LIGHT, lw=0.9)
    axes.axvline(0, color=LIGHT, lw=0.9)


def new_figure(height, title=""):
    """Figure of the common width and of a height [in], with a title."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    heading(figure, title)
    return figure


def heading(figure, text):
    """Write the title of a figure, at its left, in lines that fit; none for an empty text."""
    if text:
        figure.suptitle(wrapped(text, figure.get_figwidth() - 0.2, 10), x=0.01, ha="left", fontsize=10)


@styled
def name_case(figure, case):
    """A figure whose title begins with the name of its load case."""
    title, words = (" ".join(text.split()) for text in (figure.get_suptitle(), case_words(case)))
    if not title.startswith(words):
        heading(figure, f"{words} {title[:1].lower()}{title[1:]}")
    return figure


def bold(text):
    """The look of a heading in bold type; in plain type where it has names in other scripts, whose fonts lack it."""
    return {"weight": "bold", "family": "DejaVu Sans"} if text.isascii() else {}


@lru_cache(10_000)
def text_width(text, size):
    """Width of a line of text. [in]"""
    return text_to_path.get_text_width_height_descent(text, FontProperties(size=size), ismath=False)[0] / 72


def wrapped(text, room, size):
    """A text in lines of at most `room` inches, words broken only where they are longer than that."""
    lines = []
    for word in text.split():
        while text_width(word, size) > room and len(word) > 1:
            fitting = next(k for k in range(len(word) - 1, 0, -1) if k == 1 or text_width(word[:k], size) <= room)
            lines.append(word[:fitting])
            word = word[fitting:]
        if lines and text_width(f"{lines[-1]} {word}", size) <= room:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return "\n".join(lines)


def name_axis(axes, which, names, room):
    """Write names instead of numbers at the positions 0, 1, 2, ... along an axis, MOST_NAMES at most.

    Names along x stand in lines below their positions where they fit, else at an angle or, of many, upright. `which` is
    "x" or "y", `room` the length of the axis, about. [in]
    """
    step = -(-len(names) // MOST_NAMES)
    positions, shown = range(0, len(names), step), names[::step]
    axes.set(**{f"{which}lim": (-0.5, len(names) - 0.5)})
    if which == "y":
        axes.set_yticks(positions, [wrapped(name, 1.5, 7.5) for name in shown], fontsize=7.5)
        return
    axes.tick_params(axis="x", length=0)
    width = 0.8 * room / len(shown)
    if all(text_width(word, 8) <= width for name in shown for word in name.split()):
        axes.set_xticks(positions, [wrapped(name, width, 8) for name in shown], fontsize=8)
    else:
        steep = len(shown) > UPRIGHT_NAMES * room
        angle = {"rotation": 90, "va": "center"} if steep else {"rotation": 30}
        axes.set_xticks(positions, shown, fontsize=8, ha="right", rotation_mode="anchor", **angle)
