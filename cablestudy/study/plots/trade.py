"""Error against time, one panel for each column."""

import re
import textwrap

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, NullLocator

from cablestudy.study.plots.style import BLUE, GREEN, GREY, LIGHT, ORANGE, PINK, RED, SKY, styled
from cablestudy.study.table import short

BLACK = "#000000"
# family: colour, marker, line
LOOK = {
    "closed form": (BLACK, "P", "none"),
    "error control": (RED, "*", "-"),
    "lumped bars": (BLUE, "o", "-"),
    "consistent bars": (SKY, "s", "-"),
    "blended bars": (GREEN, "D", "-"),
    "high order": (ORANGE, "^", "-"),
    "several of high order": (ORANGE, "2", "none"),
    "modes + residual": (PINK, "v", "--"),
    "modes alone": (GREY, "v", "--"),
    "adaptive": (BLACK, "x", ":"),
    "uniform grid": (SKY, "+", ":"),
    "log grid": (GREEN, "+", ":"),
}
APART = 0.06  # distance of labels, share of a panel's height
WORDS = {"error control": "accuracy", "high order": "1 element, order"}
BAND = 0.09  # height of the band below the reference's own error, share of a panel's height
CAPTION = (
    "Each mark is one model, asked for this column alone. Grey line: the Pareto front, than which nothing is both "
    "faster and more accurate. Grey area: below the reference's own error."
)


@styled
def trade_plot(trade, title):
    """Figure of error against time, both logarithmic, one panel for each column, with the Pareto front in grey."""
    count = len(trade.columns)
    side = 1 if count == 1 else 2
    rows = -(-count // side)
    figure = Figure(figsize=(5.6 * side, 3.2 * rows + 0.8), layout="constrained")
    grid = figure.subplots(rows, side, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.set_axis_off()
    for axes, column in zip(grid, trade.columns, strict=False):
        _panel(axes, trade, column)
    for axes in grid[max(0, count - side) : count]:
        axes.set_xlabel("time [ms]")
    for axes in grid[::side]:
        axes.set_ylabel("relative error")
    figure.supxlabel(textwrap.fill(CAPTION, int(15 * figure.get_figwidth())), x=0.01, ha="left", fontsize=8, color=GREY)
    figure.suptitle(textwrap.fill(title, int(13 * figure.get_figwidth())), x=0.01, ha="left", fontsize=10)
    return figure


def _panel(axes, trade, column):
    """Draws the models of one column."""
    name, own = column.name, trade.reference.errors[column.name]
    axes.set_title(f"{name.replace('_', ' ')}: {short(trade.reference.values[name])} {column.unit}", loc="left")
    curves = {}  # family -> its models, in the order of the table
    for entry in trade.entries:
        if name in entry.times:
            curves.setdefault(entry.family, []).append(entry)
    if not curves:
        axes.text(0.5, 0.5, "no model has it", transform=axes.transAxes, ha="center", color=GREY)
        return
    times, errors = np.transpose([_point(entry, name) for entries in curves.values() for entry in entries])
    top = 8 * max(errors.max(), 1e3 * own)
    bottom = own * (own / top) ** (BAND / (1 - BAND))
    right = 1.4 * times.max()
    axes.set(xscale="log", yscale="log", xlim=(times.min() / 1.4, right), ylim=(bottom, top))
    axes.axhspan(bottom, own, color=LIGHT, lw=0, zorder=0)
    time, error = np.transpose([_point(entry, name) for entry in trade.front_of(column)])
    axes.plot(
        [time[0], *time, right], [top, *error, error[-1]], color="#c4c4c4", lw=5, solid_capstyle="butt",
        drawstyle="steps-post", label="Pareto front", zorder=1,
    )  # fmt: skip
    for family, entries in curves.items():
        time, error = np.transpose([_point(entry, name) for entry in entries])
        colour, marker, line = LOOK[family]
        size = {"*": 8, "P": 7, "2": 8, "+": 6, "x": 5.5}.get(marker, 4.5)
        axes.plot(time, error, color=colour, marker=marker, ms=size, linestyle=line, lw=1.1, label=family, zorder=2)
    _name_curves(axes, curves, name)
    spread = np.log10(times.max() / times.min())
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if spread < 2.2 else (1,), numticks=20))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_major_locator(LogLocator(numticks=9))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())


def _point(entry, name):
    """Time [ms] and error of a model in a column."""
    return 1e3 * entry.times[name], entry.errors[name]


def _name_curves(axes, curves, name):
    """Labels each curve on the right, at the height of its last point where there is room; closed forms at their marks.

    The label of a curve of several models has the numbers of the first and the last.
    """
    places = []
    for family, entries in curves.items():
        if family == "closed form":
            for entry in entries:
                axes.annotate(
                    entry.name, _point(entry, name), (6, 5), textcoords="offset points", fontsize=7.5, zorder=4,
                    path_effects=[withStroke(linewidth=2, foreground="white")],
                )  # fmt: skip
            continue
        first, last = (re.findall(r"\d+(?:e-\d+)?", entries[k].name)[-1] for k in (0, -1))
        if family == "several of high order":
            words = "2 or 4 elements of high order"
        else:
            words = f"{WORDS.get(family, family)}, {first} … {last}" if len(entries) > 1 else entries[0].name
        height = axes.transLimits.transform(np.log10(_point(entries[-1], name)))[1]
        places.append((height, words, LOOK[family]))
    places.sort(key=lambda place: -place[0])
    for height, (_, words, (colour, marker, _)) in zip(_spread([place[0] for place in places]), places, strict=True):
        axes.plot(1.03, height, color=colour, marker=marker, ms=5, transform=axes.transAxes, clip_on=False)
        axes.text(1.06, height, words, color=colour, fontsize=7.5, va="center", transform=axes.transAxes)


def _spread(heights):
    """Descending heights, moved as little as possible to be APART and within the panel."""
    found = []
    for k, height in enumerate(heights):
        below = (len(heights) - 1 - k) * APART  # room for the labels that follow
        found.append(min(max(height, below + 0.02), found[-1] - APART if found else 0.98))
    return found
