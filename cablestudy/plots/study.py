"""Pictures of a study: columns over the keys that it varies, beside printed numbers; Sobol's indices of its columns."""

import numpy as np
from matplotlib.lines import Line2D

import cablestudy.plots.style as style
from cablestudy.plots.colour_map import colour_map
from cablestudy.plots.quantity import DrawnQuantity, quantities_varied, quantity_named
from cablestudy.plots.series import give_looks, series_of
from cablestudy.plots.words import column_words, key_words, panels_left_out, value_text
from cablestudy.study.cable_columns import TEXTS
from cablestudy.study.columns import find, find_header
from cablestudy.study.prepare import SHOWN_BY, reference_header
from cablestudy.study.table_rows import OK, has_answer

ROW = "row of the table"
NUMBER_OF_ROW = DrawnQuantity(ROW, "row of the table", "")
OTHER_COLUMNS = 4  # columns drawn of a study without `plot:`
# texts over rows, from which a picture has the texts along x: the few rows of the same text are drawn at one place
SELDOM_REPEATED = 0.5
PANEL_HEIGHT = 1.75  # of a panel [in]
OWN_TICKS = 8  # up to so many values along a logarithmic x axis, each value has a tick
MARGINS = {"x": 0.08, "y": 0.15}  # margin about the values along an axis, as a share of their range
ROUND_TICKS, DECADE_TICKS = {"x": 7, "y": 5}, {"x": 8, "y": 6}  # at most, on a linear and on a logarithmic axis
ROUNDING_RANGE = 1e-9  # range over the largest value, up to which values differ by rounding
NARROWEST_RANGE = 2e-3  # range of a linear y axis over the largest value at least: its ticks differ in four digits
PRINTED = {"marker": "o", "ms": 9, "mfc": "none", "mec": style.RED, "mew": 1.3, "ls": "none"}
MOST_PANELS = 12  # in one picture
INDICES = {
    "first_order": {"color": style.BLUE, "marker": "o", "label": "first order: of the key alone"},
    "total": {"color": style.ORANGE, "marker": "s", "mfc": "white", "label": "total: with all that it interacts in"},
}
SHARE_LIMITS = (-0.05, 1.05)  # of the shares, always shown


@style.styled
def study_plot(study, table, chosen=()):
    """Figure of the results of a study: a panel for each column, over a varied key, with printed values beside them.

    `plot:` of the study file states what is drawn; with `plot.color` it is a map of colours. Without `plot:` the first
    computed columns are drawn over the key that varies first. The table has all rows of the study, or some. `chosen`
    are names of columns and varied keys that are drawn along y instead, except in a map of colours.
    """
    every = [row | {ROW: number} for number, row in enumerate(table.rows, 1)]
    rows = [row for row in every if has_answer(row.get("status", OK))]
    if not rows:
        return _nothing(study, "no case has an answer")
    if study.plot and study.plot.color:
        return colour_map(study, every, rows)
    return _line_figure(study, every, rows, chosen)


def not_drawn(study):
    """Names of the computed columns for which the picture of a study without `plot:` has no room: list of str."""
    return [] if study.plot else [find(header).name for header in _computed(study)[OTHER_COLUMNS:]]


def _line_figure(study, every, rows, chosen):
    """Figure with one panel for each drawn column of a study, all over one x; arguments are those of `colour_map`.

    `chosen`: columns and varied keys that are drawn along y in place of those that the study states.
    """
    x, columns, *logarithmic = _drawn(study, every, chosen)
    if not columns:
        return _nothing(study, "no column is a number")
    series, factors = series_of(study, every, rows, x)
    joined = x.categories is None and x.name != ROW and study.sample is None
    entries, bar = give_looks(series, factors, joined)
    side = 1 if len(columns) <= OTHER_COLUMNS else 2
    height = PANEL_HEIGHT * -(-len(columns) // side) + 0.9 + 0.2 * -(-len(entries) // 3)
    figure = style.new_figure(height, study.title)
    grid = style.panels(figure, len(columns), side)
    printed = [_panel(axes, x, column, series, joined) for axes, column in zip(grid, columns, strict=True)]
    _scale_panels(grid, x, columns, logarithmic, _by_ratio(x, factors))
    for axes, column in zip(grid, columns, strict=True):
        axes.set_ylabel(style.wrapped(column.label, 0.9 * PANEL_HEIGHT, 9))
    for axes in grid[-side:]:
        axes.set_xlabel(style.wrapped(x.label, 0.8 * style.WIDTH / side, 9))
    if any(printed):
        entries = [*entries, (Line2D([], [], **PRINTED), "printed")]
    if len(entries) > 1 or (entries and series[0].label and len(series) > 1):
        style.legend_below(figure, entries)
    if bar:
        style.colour_bar(figure, grid, *bar, aspect=40)
    figure.align_ylabels()
    return figure


def _nothing(study, reason):
    """Figure of a study of which there is nothing to draw, with the reason."""
    return style.new_figure(1.2, f"{study.title}: {reason}".lstrip(": "))


def _scale_panels(grid, x, columns, logarithmic, by_ratio):
    """Set scales and ticks of the panels of a study, each with a column along y and its lines.

    `logarithmic` says whether x and y are logarithmic, as the study states it. If it does not (None), x is logarithmic
    if its values are spaced logarithmically; a y, if its values span decades and x is logarithmic or `by_ratio`.
    """
    logx, logy = logarithmic
    lines = [line for axes in grid for line in axes.lines]
    if logx is None:
        logx = x.name != ROW and style.spaced_logarithmically(_values(lines, "x"))
    for axes, column in zip(grid, columns, strict=True):
        _scale(axes, "x", x, logx, lines)
        decides = logy is None and (logx or by_ratio)
        _scale(axes, "y", column, style.spans_decades(_values(axes.lines, "y")) if decides else logy, axes.lines)


def _drawn(study, rows, chosen):
    """The quantity along x, those along y, and whether x and y are logarithmic; None: decided by the values."""
    plot = study.plot
    if plot:
        x = quantity_named(study, plot.x, rows)
        return x, _chosen(study, chosen, x, rows) or _quantities(study, plot.y, rows), plot.logx, plot.logy
    x, names = _first_varied(study, rows), _computed(study)
    if x is None and names:
        x, names = quantity_named(study, names[0], rows), names[1:] or names
    elif x is None:
        x = NUMBER_OF_ROW
    else:
        x = _with_printed_values(study, x, rows, [find(name).header for name in study.columns])
    return x, _chosen(study, chosen, x, rows) or _quantities(study, names[:OTHER_COLUMNS], rows), None, None


def _chosen(study, names, x, rows):
    """The quantities of names, without the one along x, text, and printed values, which are drawn with their column."""
    computed = [name for name in names if "_printed" not in name and "_difference" not in name]
    return [quantity for quantity in _quantities(study, computed, rows) if quantity.name not in {x.name, *TEXTS}]


def _computed(study):
    """Headers of the columns that are results and do not show what varies; of all where there are none."""
    columns = [column for column in map(find, study.columns) if not column.text]
    shown = {find(name).header for key in study.varied for name in SHOWN_BY.get(key, ())}
    others = [column for column in columns if column.header not in shown] or columns
    computed = [c for c in others if c.needs not in ("scene", "run") and c.name != "iterations"]
    return [column.header for column in computed or others]


def _quantities(study, names, rows):
    return [quantity_named(study, name, rows) for name in names]


def _first_varied(study, rows):
    """The first varied number that tells the steps of its entry apart, else the first such key.

    Where no key tells the steps apart, rows are numbered. None: nothing varies.
    """
    entries = list(filter(None, quantities_varied(study, rows)))
    if not entries:
        return None
    apart = [quantity for entry in entries for quantity in _telling_apart(study, entry, rows)]
    numbers = [q for q in apart if q.categories is None and len({q.value(row) for row in rows}) > 1]
    repeated = [q for q in entries[0] if q.categories and len(q.categories) >= SELDOM_REPEATED * len(rows)]
    return (numbers or apart or repeated or [NUMBER_OF_ROW])[0]


def _with_printed_values(study, quantity, rows, headers):
    """The column that shows a varied key, where it has printed values; else the key itself."""
    for name in SHOWN_BY.get(quantity.key, ()):
        header = find(name).header
        if header in headers and rows[0].get(reference_header(header, "printed")):
            return quantity_named(study, header, rows)
    return quantity


def _panel(axes, x, column, series, joined):
    """Draw one column of a study over x: its computed values in the looks of the series, rings for the printed values.

    Lines join the points if these are `joined`. True if there are printed values.
    """
    any_printed = False
    for k, line in enumerate(series):
        offset = 0.0
        if x.categories is not None:  # side by side, so that equal values do not cover each other
            offset = 0.24 * (k - (len(series) - 1) / 2) / max(1, len(series) / 3)
        points = _points(x, column, line.rows, printed=False)
        if joined and x.key:
            points.sort(key=lambda point: point[0])
        x_values, y_values = zip(*points, strict=True) if points else ((), ())
        look = line.look if joined else line.look | {"ls": "none"}
        axes.plot(np.add(x_values, offset), y_values, **look, label=line.label or "computed",
                  rasterized=len(points) > style.MANY_POINTS)  # fmt: skip
        with_printed = [row for row in line.rows if column.printed and row.get(column.printed) is not None]
        if printed := _points(x, column, with_printed, printed=True):
            x_values, y_values = zip(*printed, strict=True)
            axes.plot(np.add(x_values, offset), y_values, **PRINTED, label="printed")
            any_printed = True
    return any_printed


def _points(x, column, rows, printed):
    """Computed or printed values of two quantities, of the rows that have both: list of (x, y)."""
    points = [(x.value(row, printed), column.value(row, printed)) for row in rows]
    return [point for point in points if None not in point]


def _telling_apart(study, entry, rows):
    """The quantities of an entry each of which tells its steps apart; of a sample all.

    Points of a sample may share coordinates, as in a Saltelli design.
    """
    if study.sample is not None:
        return entry
    steps = len({tuple(quantity.value(row) for quantity in entry) for row in rows})
    return [quantity for quantity in entry if len({quantity.value(row) for row in rows}) == steps]


def _by_ratio(x, factors):
    """True if columns that span decades are drawn so over any x: over names, over rows, of series spaced by ratios."""
    numbers = (factor.numbers for factor in factors if factor.numbers is not None)
    spaced = any(style.spaced_logarithmically(np.unique(levels)) for levels in numbers)
    return spaced or x.name == ROW or x.categories is not None


def _scale(axes, which, quantity, logarithmic, lines):
    """Set scale and ticks of an axis for some lines; few values on a logarithmic x axis are themselves the ticks."""
    axis = getattr(axes, f"{which}axis")
    if quantity.categories is not None:
        style.name_axis(axes, which, quantity.names, style.WIDTH - 1.0)
        return
    values = _values(lines, which)
    axes.margins(**{which: MARGINS[which]})
    if logarithmic and len(values) and values[0] > 0:
        computed = _values([line for line in lines if line.get_label() != "printed"], which)
        ticks = style.own_ticks(computed, OWN_TICKS, 0.08 * np.log10(values[-1] / values[0])) if which == "x" else ()
        style.log_axis(axis, values[0], values[-1], DECADE_TICKS[which], ticks)
        return
    if len(values):
        _widen(axes, which, values)
    style.plain_axis(axis, ROUND_TICKS[which])


def _widen(axes, which, values):
    """Set limits about values that are equal, or along y nearly so: else rounding and noise look like a result."""
    middle, largest = (values[0] + values[-1]) / 2, np.abs(values).max()
    if np.ptp(values) <= ROUNDING_RANGE * largest:
        around = 0.1 * abs(middle) or 1.0
    elif which == "y" and np.ptp(values) < NARROWEST_RANGE * largest:
        around = NARROWEST_RANGE * largest / 2
    else:
        return
    getattr(axes, f"set_{which}lim")(middle - around, middle + around)


def _values(lines, which):
    """Distinct values of lines along one axis, ascending."""
    return np.unique([value for line in lines for value in line.get_data()["xy".index(which)]])


# ------------------------------------------------------------------------------------------------------ Sobol's indices


@style.styled
def sensitivity_plot(study, table):
    """Figure of Sobol's indices: which share of the variance of each result column comes from each sampled key.

    There is a panel for each column, and for each combination of values of keys that vary in the study but are not
    sampled. It shows the first-order index and the total index of each sampled key, with their confidence intervals,
    from the table of `Sensitivity.table`.
    """
    fixed = ("column", "parameter", *(f"{kind}{end}" for kind in INDICES for end in ("", "_low", "_high")))
    others = [field for field in table.fields if field.name not in fixed]  # keys that vary besides the sample
    groups = _groups(table.rows, others)
    count = min(len(groups), MOST_PANELS)
    columns = 1 if count == 1 else 2
    keys = max((len(rows) for rows in groups.values()), default=1)
    panel_rows = -(-count // columns)
    title = f"{study.title or 'Sensitivity'}: Sobol's indices{panels_left_out(count, len(groups))}"
    figure = style.new_figure(panel_rows * (0.75 + 0.36 * keys) + 0.9, title)
    grid = style.panels(figure, count, columns, sharey=True)
    for number, (axes, (group, rows)) in enumerate(zip(grid, groups.items(), strict=False)):
        _index_panel(axes, rows)
        title, room = _title(others, group), (0.38 if columns == 2 else 0.7) * style.WIDTH
        axes.set_title(style.wrapped(title, room, 9), loc="left", **style.bold(title))
        axes.tick_params(labelleft=number % columns == 0)
    for axes in grid[-columns:]:
        axes.set_xlabel("share of the variance")
    drawn = [row[name] for row in table.rows for name in fixed[2:] if row.get(name) is not None]
    grid[0].set_xlim(min([SHARE_LIMITS[0], *drawn]) - 0.02, max([SHARE_LIMITS[1], *drawn]) + 0.02)
    style.legend_below(figure, [(Line2D([], [], ls="none", **look), look["label"]) for look in INDICES.values()])
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


def _index_panel(axes, rows):
    """Draw the indices of one column, or a note if it has none."""
    names = [key_words(row["parameter"]) for row in rows]
    heights = np.arange(len(rows))
    for (kind, look), aside in zip(INDICES.items(), (-0.13, 0.13), strict=True):
        for height, row in zip(heights, rows, strict=True):
            if row[kind] is None:
                continue
            low, high = row.get(f"{kind}_low"), row.get(f"{kind}_high")
            if low is not None and high is not None:
                axes.plot([low, high], [height + aside] * 2, color=look["color"], lw=1.6)
            axes.plot(row[kind], height + aside, ms=5, ls="none", **look)
    if all(row[kind] is None for row in rows for kind in INDICES):
        axes.text(0.5, 0.5, "no indices", transform=axes.transAxes, ha="center", va="center", color="#555555")
    axes.set_yticks(heights, [style.wrapped(name, 1.5, 8.5) for name in names], fontsize=8.5)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
