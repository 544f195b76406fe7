"""Sobol's indices of the columns of a study: a picture of `sweep --sensitivity`."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cablestudy.study.all_columns import find_header
from cablestudy.study.plots.style import BLUE, ORANGE, WIDTH, bold, heading, legend_below, panels, styled, wrapped
from cablestudy.study.plots.words import column_words, key_words, panels_left_out, value_text

PANELS = 12  # in one picture
KINDS = {
    "first_order": {"color": BLUE, "marker": "o", "label": "first order: of the key alone"},
    "total": {"color": ORANGE, "marker": "s", "mfc": "white", "label": "total: with all that it interacts in"},
}
LIMITS = (-0.05, 1.05)  # of the shares, always shown


@styled
def sensitivity_plot(study, table):
    """Figure of Sobol's indices: the shares that the varied keys have in the variance of each column of a study.

    Each column has a panel, with the indices of first order and in total and their confidence intervals.

    Parameters
    ----------
    study : StudyFile
    table : Table
        From `Sensitivity.table`: rows with `column`, `parameter` (the varied key), values of keys that vary beside the
        sample, the indices, and the ends of their confidence intervals.
    """
    fixed = ("column", "parameter", *(f"{kind}{end}" for kind in KINDS for end in ("", "_low", "_high")))
    others = [field for field in table.fields if field.name not in fixed]  # keys that vary beside the sample
    groups = _groups(table.rows, others)
    count = min(len(groups), PANELS)
    columns = 1 if count == 1 else 2
    keys = max((len(rows) for rows in groups.values()), default=1)
    panel_rows = -(-count // columns)
    figure = Figure(figsize=(WIDTH, panel_rows * (0.75 + 0.36 * keys) + 0.9), layout="constrained")
    grid = panels(figure, count, columns, sharey=True)
    for number, (axes, (group, rows)) in enumerate(zip(grid, groups.items(), strict=False)):
        _panel(axes, rows)
        title = _title(others, group)
        axes.set_title(wrapped(title, 0.38 * WIDTH if columns == 2 else 0.7 * WIDTH, 9), loc="left", **bold(title))
        axes.tick_params(labelleft=number % columns == 0)
    for axes in grid[-columns:]:
        axes.set_xlabel("share of the variance")
    drawn = [row[name] for row in table.rows for name in fixed[2:] if row.get(name) is not None]
    grid[0].set_xlim(min([LIMITS[0], *drawn]) - 0.02, max([LIMITS[1], *drawn]) + 0.02)
    legend_below(figure, [(Line2D([], [], ls="none", **look), look["label"]) for look in KINDS.values()])
    heading(figure, f"{study.title or 'Sensitivity'}: Sobol's indices{panels_left_out(count, len(groups))}")
    return figure


def _groups(rows, others):
    """Rows by their values of other keys and by their column: dict."""
    groups = {}
    for row in rows:
        groups.setdefault((*(row[field.name] for field in others), row["column"]), []).append(row)
    return groups


def _title(others, group):
    """The column of a group, and the values of other keys, in words."""
    varied = [f"{key_words(field.title)} {value_text(value)}" for field, value in zip(others, group, strict=False)]
    return ", ".join([column_words(find_header(group[-1]).name), *varied])


def _panel(axes, rows):
    """Draw the indices of one column, or a note if it has none."""
    names = [key_words(row["parameter"]) for row in rows]
    heights = np.arange(len(rows))
    for (kind, look), aside in zip(KINDS.items(), (-0.13, 0.13), strict=True):
        for height, row in zip(heights, rows, strict=True):
            if row[kind] is None:
                continue
            low, high = row.get(f"{kind}_low"), row.get(f"{kind}_high")
            if low is not None and high is not None:
                axes.plot([low, high], [height + aside] * 2, color=look["color"], lw=1.6)
            axes.plot(row[kind], height + aside, ms=5, ls="none", **look)
    if all(row[kind] is None for row in rows for kind in KINDS):
        axes.text(0.5, 0.5, "no indices", transform=axes.transAxes, ha="center", va="center", color="#555555")
    axes.set_yticks(heights, [wrapped(name, 1.5, 8.5) for name in names], fontsize=8.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
