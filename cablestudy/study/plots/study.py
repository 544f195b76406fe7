"""Columns of a study against what it varies, with the printed values."""

import textwrap
from collections import Counter

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

from cablestudy.study.all_columns import find
from cablestudy.study.find import column_named
from cablestudy.study.plots.style import GREY, RED, SERIES, panels, plain_axis, round_ticks, styled
from cablestudy.study.prepare import SHOWN_BY, beside
from cablestudy.study.status import has_answer
from cablestudy.study.table import short
from cablestudy.study.varied_keys import VariedKey, varied_key, varied_keys

OTHER_COLUMNS = 4  # columns drawn of a study without `plot:`


@styled
def study_plot(study, table):
    """Figure of the computed and the printed values of a study's table, one panel for each column along y.

    `plot:` of the study states what is drawn; without it the first other columns against the first varied key.
    """
    x, names, logx, logy = _columns_drawn(study, table)
    groups = _groups(study, table.rows, x)
    side = 1 if len(names) <= 4 else 2
    figure = Figure(figsize=(6.2 if side == 1 else 10, 2.1 * -(-len(names) // side) + 1.1), layout="constrained")
    grid = panels(figure, len(names), side)
    for axes, name in zip(grid, names, strict=True):
        column = varied_key(study, name) or column_named(study, name)
        _panel(axes, x, column, groups, joined=x.categories is None and study.sample is None)
        _scale(axes, "y", logy)
        if x.categories is None:
            _scale(axes, "x", logx)
    for axes in grid[-side:]:
        axes.set_xlabel(x.label)
    _legend(figure)
    if not any(rows for _, rows in groups):
        grid[0].set_title("no case has an answer", color=GREY)
    figure.align_ylabels()
    if study.title:
        figure.suptitle(textwrap.fill(study.title, int(14 * figure.get_figwidth())), fontsize=10)
    return figure


def _columns_drawn(study, table):
    """Abscissa, columns along y, and whether x and y are logarithmic; None: decided by the values."""
    if study.plot:
        return _Abscissa(study, study.plot.x, table), study.plot.y, study.plot.logx, study.plot.logy
    columns = [find(name) for name in study.columns if find(name).name != "status"]
    headers = [column.header for column in columns]
    varied = [_shown(known, headers) for known in varied_keys(study)] or headers[:1]
    x = _Abscissa(study, varied[0], table)
    given = [column.header for column in columns if column.header in varied or column.needs == "scene"]
    others = [name for name in headers if name not in given] or [name for name in headers if name != x.name] or headers
    return x, others[:OTHER_COLUMNS], None, None


def _shown(varied, headers):
    """Header of the column that has the value of a varied key, or its own."""
    known = (find(name).header for name in SHOWN_BY.get(varied.key, ()))
    return next((header for header in known if header in headers), varied.header)


class _Abscissa:
    """The quantity along x: a column or a varied key; values that are not all numbers are `categories`."""

    def __init__(self, study, name, table):
        column = varied_key(study, name) or column_named(study, name)
        self.name, self.label = column.header, _label(column)
        self.printed = None if isinstance(column, VariedKey) else beside(column.header, "printed")
        written = [row[self.name] for row in table.rows if row.get(self.name) is not None]
        texts = any(isinstance(value, str) for value in written)
        self.categories = list(dict.fromkeys(map(str, written))) if texts else None

    def values(self, rows, printed=False):
        """Abscissas of rows; of categories their positions."""
        if self.categories is not None:
            return [self.categories.index(str(row[self.name])) for row in rows]
        names = [self.printed if printed and row.get(self.printed) is not None else self.name for row in rows]
        return [row[name] for row, name in zip(rows, names, strict=True)]


def _label(column):
    unit = (column.unit or "").replace("^2", "²").replace("^3", "³")
    return f"{_words(column.name)} [{unit}]" if unit else _words(column.name)


def _words(name):
    return name.rpartition(".")[2].replace("_", " ")


def _groups(study, rows, x):
    """Rows with an answer grouped by what varies besides x, one group for each line: list of (label, rows)."""
    headers = [find(name).header for name in study.columns]
    known = {varied.key: varied for varied in varied_keys(study)}
    entries = [[known[key] for key in entry.keys] for entry in study.entries]
    along = [
        entry for entry in entries if any(x.name in (key.header, _shown(key, headers)) for key in entry)
    ] or entries[-1:]
    groups = _grouped(rows, [entry[0] for entry in entries if entry not in along], x)
    again = any(turn for _, turn in groups)
    companions = [key for entry in along for key in entry if again and key.header != x.name]
    return [
        (_series_label(label, members, companions), [row for row in members if has_answer(row["status"])])
        for (label, _), members in groups.items()
    ]


def _grouped(rows, keys, x):
    """(label, turn) -> rows that agree on some keys; a category that is repeated starts another turn."""
    groups, seen = {}, Counter()
    for row in rows:
        label = ", ".join(f"{_words(key.key)} {key.label(row.get(key.header))}" for key in keys)
        place = (label, row.get(x.name))
        turn = seen[place] if x.categories is not None else 0
        seen[place] += 1
        groups.setdefault((label, turn), []).append(row)
    return groups


def _series_label(label, rows, companions):
    """Label of a series: its group, and the values that its rows have in common."""
    parts = [label] if label else []
    for key in companions:
        values, words = {key.label(row.get(key.header)) for row in rows}, _words(key.key)
        parts.append(f"{words} {values.pop()}" if len(values) == 1 else f"each with its own {words}")
    return ", ".join(parts)


def _panel(axes, x, column, groups, joined):
    """Draws the computed values of a column, joined by lines or not, and rings for the printed ones."""
    printed_name = None if isinstance(column, VariedKey) else beside(column.header, "printed")
    for k, (label, rows) in enumerate(groups):
        aside = 0.0
        if x.categories is not None:  # side by side, so that equal values do not cover each other
            aside = 0.24 * (k - (len(groups) - 1) / 2) / max(1, len(groups) / 3)
        placed = [row for row in rows if row.get(x.name) is not None]
        computed = [row for row in placed if isinstance(row.get(column.header), float)]
        axes.plot(
            np.add(x.values(computed), aside), [row[column.header] for row in computed],
            linestyle="-" if joined else "none", marker="os^Dv"[k % 5], ms=4.5, color=SERIES[k % len(SERIES)],
            label=label or "computed",
        )  # fmt: skip
        printed = [row for row in placed if row.get(printed_name) is not None]
        if printed:
            axes.plot(
                np.add(x.values(printed, printed=True), aside), [row[printed_name] for row in printed],
                "o", ms=9, mfc="none", mec=RED, mew=1.3, label="printed",
            )  # fmt: skip
    axes.set_ylabel(textwrap.fill(_label(column), 22))
    if x.categories is not None:
        axes.set_xticks(range(len(x.categories)), x.categories, rotation=30, ha="right", rotation_mode="anchor")
        axes.set_xlim(-0.5, len(x.categories) - 0.5)


def _scale(axes, which, logarithmic):
    """Sets scale and ticks of an axis; few values on a logarithmic x axis are themselves the ticks."""
    axis = getattr(axes, f"{which}axis")
    values = _drawn(axes.lines, which)
    axes.margins(**{which: 0.08 if which == "x" else 0.15})
    positive = len(values) > 0 and values[0] > 0
    if logarithmic is None:
        logarithmic = positive and values[-1] > 30 * values[0]
    if not (logarithmic and positive):
        plain_axis(axis, 7 if which == "x" else 5)
        return
    axes.set(**{f"{which}scale": "log"})
    decades = np.log10(values[-1] / values[0])
    own = _drawn([line for line in axes.lines if line.get_label() != "printed"], which)
    if which == "x" and 1 < len(own) <= 8 and np.diff(np.log10(own)).min() > 0.07 * decades:
        axis.set_major_locator(FixedLocator(own))
    elif decades < 0.6:
        axis.set_major_locator(round_ticks(4))
    else:
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if decades < 2.5 else (1,), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: short(float(value))))
    axis.set_minor_locator(NullLocator())


def _drawn(lines, which):
    """Distinct values of lines along one axis, ascending."""
    return np.unique([value for line in lines for value in line.get_data()["xy".index(which)]])


def _legend(figure):
    """One legend for all panels."""
    seen = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            seen.setdefault(label, handle)
    if len(seen) > 1:
        figure.legend(seen.values(), seen.keys(), loc="outside lower center", ncols=min(len(seen), 4), fontsize=9)
