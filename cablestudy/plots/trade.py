"""Picture of the command `trade`: error of models against their time, one panel for each column."""

import re

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

import cablestudy.plots.style as style
from cablestudy.plots.words import column_words, number, quantity_text

BLACK = "#000000"
# family: colour, marker, line
LOOK = {
    "closed form": (BLACK, "P", "none"),
    "error control": (style.RED, "*", "-"),
    "lumped bars": (style.BLUE, "o", "-"),
    "consistent bars": (style.SKY, "s", "-"),
    "blended bars": (style.GREEN, "D", "-"),
    "high order": (style.ORANGE, "^", "-"),
    "several of high order": (style.ORANGE, "2", "none"),
    "modes + residual": (style.PINK, "v", "--"),
    "modes alone": (style.GREY, "v", "--"),
    "sum over poles": (BLACK, "x", ":"),
    "uniform grid": (style.SKY, "+", ":"),
    "log grid": (style.GREEN, "+", ":"),
}
MARKED = {"fontsize": 7, "path_effects": [withStroke(linewidth=2, foreground="white")]}  # text over lines
WORDS = {"error control": "accuracy", "high order": "1 element of order"}
BAND_HEIGHT = 0.09  # height of the band below the reference's own error, share of a panel's height
CAPTION = (
    "Each mark is one model, asked for this column alone. Grey line: the Pareto front, than which nothing is both "
    "faster and more accurate. Grey area: below the reference's own error."
)


@style.styled
def trade_plot(trade, title):
    """Figure of the models of a scene, a `Trade`: error against computing time, logarithmic, a panel for each column.

    The models on the grey line, the Pareto front, are the fastest for their accuracy.
    """
    count = len(trade.columns)
    side = 1 if count == 1 else 2
    rows = -(-count // side)
    entries = _legend(trade)
    tall = (2.9 if side == 1 else 2.3) * rows
    figure = style.new_figure(tall + 1.1 + 0.08 * len(entries), title)
    grid = figure.subplots(rows, side, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.set_axis_off()
    for axes, column in zip(grid, trade.columns, strict=False):
        _panel(axes, trade, column)
    for axes in grid[max(0, count - side) : count]:
        axes.set_xlabel("time [ms]")
    for axes in grid[::side]:
        axes.set_ylabel("relative error")
    legend = style.legend_below(figure, entries, 8)
    if legend:
        legend.set_title(style.wrapped(CAPTION, style.WIDTH - 0.5, 7.5), {"size": 7.5})
        legend.get_title().set_color(style.GREY)
    return figure


def _legend(trade):
    """Entries of the legend: families of models, with the numbers of their first and last: list of (artist, str)."""
    families, entries = {}, []
    for entry in trade.entries:
        if set(entry.times) & {column.name for column in trade.columns}:
            families.setdefault(entry.family, []).append(entry.name)
    for family, names in families.items():
        words = WORDS.get(family, family)
        numbers = [re.findall(r"\d+(?:e-\d+)?", name)[-1:] for name in names]
        if family == "several of high order":
            words = "2 or 4 elements of high order"
        elif family != "closed form" and all(numbers):
            first, last = (number(float(digits[0])) for digits in (numbers[0], numbers[-1]))
            words += f"{'' if family in WORDS else ','} {first}{f' … {last}' if len(names) > 1 else ''}"
        entries.append((Line2D([], [], **_look(family), lw=1.1), words))
    return entries


def _look(family):
    """Colour, mark and line of a family."""
    colour, marker, line = LOOK[family]
    size = {"*": 8, "P": 7, "2": 8, "+": 6, "x": 5.5}.get(marker, 4.5)
    return {"color": colour, "marker": marker, "ms": size, "linestyle": line}


def _panel(axes, trade, column):
    """Draw error against time of all models for one column, their Pareto front, and the error of the reference."""
    name, reference_error = column.name, trade.reference.errors[column.name]
    value = quantity_text(trade.reference.values[name], column.unit)
    axes.set_title(style.wrapped(f"{column_words(name)}: {value}", 0.4 * style.WIDTH, 9), loc="left")
    curves = {}  # family -> entries of its models, in the order of the table
    for entry in trade.entries:
        if name in entry.times:
            curves.setdefault(entry.family, []).append(entry)
    if not curves:
        axes.text(0.5, 0.5, "no model has it", transform=axes.transAxes, ha="center", color=style.GREY)
        return
    times, errors = np.transpose([_point(entry, name) for entries in curves.values() for entry in entries])
    top = 8 * max(errors.max(), 1e3 * reference_error)
    # errors below the reference's own are meaningless: a grey band of the height BAND_HEIGHT at the bottom of the panel
    bottom = reference_error * (reference_error / top) ** (BAND_HEIGHT / (1 - BAND_HEIGHT))
    right = 1.4 * times.max()
    axes.set(xscale="log", yscale="log", xlim=(times.min() / 1.4, right), ylim=(bottom, top))
    axes.axhspan(bottom, reference_error, color=style.LIGHT, lw=0, zorder=0)
    time, error = np.transpose([_point(entry, name) for entry in trade.front_of(column)])
    axes.plot(
        [time[0], *time, right], [top, *error, error[-1]], color="#c4c4c4", lw=5, solid_capstyle="butt",
        drawstyle="steps-post", label="Pareto front", zorder=1,
    )  # fmt: skip
    for family, entries in curves.items():
        time, error = np.transpose([_point(entry, name) for entry in entries])
        axes.plot(time, error, **_look(family), lw=1.1, label=family, zorder=2)
        if family == "closed form":
            for entry in entries:
                axes.annotate(entry.name, _point(entry, name), (6, 5), textcoords="offset points", zorder=4, **MARKED)
    decades = np.log10(times.max() / times.min())
    locator = LogLocator(subs=(1, 2, 5) if decades < 1.5 else (1,), numticks=20)
    axes.xaxis.set_major_locator(style.round_ticks(4) if decades < 0.3 else locator)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: number(value)))
    axes.yaxis.set_major_locator(LogLocator(numticks=9))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())


def _point(entry, name):
    """Time [ms] and error of a model in a column."""
    return 1e3 * entry.times[name], entry.errors[name]
