"""A column as colour over two others: a heat map over two varied keys, else coloured points."""

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.ticker import LogLocator, MaxNLocator

import cablestudy.plots.style as style
from cablestudy.plots.quantity import quantity_named
from cablestudy.plots.series import series_of
from cablestudy.plots.words import number, panels_left_out, shortened, with_minus

MOST_PANELS = 6  # in one picture
MOST_CELLS_PER_ROW = 4  # cells of a grid over rows, above which the rows are drawn as points instead
NUMBERED_CELLS = 9  # along a side, up to which each cell has its number, if all of these fit
NUMBER_SIZE = 7.5  # of the numbers
OWN_TICKS, TICK_ROOM = 6, 0.45  # up to so many varied values are ticks of a logarithmic axis; room of their labels [in]
CONTOURED_CELLS, CONTOURS = 4, 7  # least cells along a side with lines of equal values; how many of these, about
EMPTY_CELL, EMPTY_EDGE, EMPTY_POINT = "#f0f0f0", "#b0b0b0", "#888888"  # what has no value
NO_ANSWER = "no answer"  # its name in the legend


def colour_map(study, every, rows):
    """Figure of one column of a study as colour (`plot.color`) over two others, `plot.x` and each of `plot.y`.

    There is a panel for each y and each series, a set of rows with equal values of the keys that are not drawn. If x
    and y are two varied keys with one row for each pair of their values, the panel is a heat map, in which a grey cell
    has no answer. Otherwise each row is a coloured point. `every` and `rows` are all rows of the study's table, and
    those with an answer: dicts, name of a column or key -> value.
    """
    plot = study.plot
    x, colour = quantity_named(study, plot.x, every), quantity_named(study, plot.color, every)
    along_y = [quantity_named(study, name, every) for name in plot.y]
    drawn = [(y, series) for y in along_y for series in series_of(study, every, rows, x, y, colour)[0]]  # of panels
    mappable = _colours(colour, rows)
    alone, count = len(drawn) == 1, min(len(drawn), MOST_PANELS)
    side = 1 if alone else 2
    title = f"{study.title}{panels_left_out(count, len(drawn))}"
    figure = style.new_figure(-(-count // side) * (4.4 if alone else 3.0) + 0.6, title)
    grid = style.panels(figure, count, side)
    for axes, (y, series) in zip(grid, drawn, strict=False):
        _panel(axes, (x, y, colour), every, series.rows, mappable, plot, (style.WIDTH - 2.0) / side)
        axes.set_ylabel(style.wrapped(y.label, 2.6, 9))
        room = (0.8 if alone else 0.38) * style.WIDTH
        axes.set_title(style.wrapped(series.label, room, 8.5), loc="left", fontsize=8.5)
    for axes in grid[-side:]:
        axes.set_xlabel(style.wrapped(x.label, 0.7 * style.WIDTH / side, 9))
    entries = {label: (artist, label) for axes in grid for artist, label in style.entries_of(axes)}
    style.legend_below(figure, list(entries.values()))
    names = [shortened(name, 24) for name in colour.names]
    style.colour_bar(figure, grid, mappable, colour.label, range(len(names)), names, aspect=30)
    return figure


def _colours(colour, rows):
    """Colours for the values that a quantity has in rows, as a ScalarMappable."""
    if colour.categories is not None:
        return style.colours_of_names(len(colour.categories))
    return style.colours_over([value for row in rows if (value := colour.value(row)) is not None] or [0.0])


def _panel(axes, quantities, every, rows, mappable, plot, room):
    """Draw the rows of one series with an answer in a panel, about `room` inches wide; `every` row has x and y."""
    points = [tuple(quantity.value(row) for quantity in quantities) for row in rows]
    points = [point for point in points if None not in point[:2]]
    x, y, c = (np.array([point[k] for point in points], dtype=float) for k in range(3))
    sides = [np.unique(x), np.unique(y)]
    gridded = all(quantity.key for quantity in quantities[:2]) and len({*zip(x, y, strict=True)}) == len(x)
    gridded = gridded and 1 < len(sides[0]) * len(sides[1]) <= MOST_CELLS_PER_ROW * len(x)
    if gridded:  # with values for which no row has an answer, where they are not those of other series
        whole = [np.unique([value for row in every if (value := quantity.value(row)) is not None])
                 for quantity in quantities[:2]]  # fmt: skip
        sides = whole if len(whole[0]) * len(whole[1]) <= MOST_CELLS_PER_ROW * len(x) else sides
    x_values, y_values = sides
    _axis(axes, "x", quantities[0], x_values, plot.logx, room)
    _axis(axes, "y", quantities[1], y_values, plot.logy, room)
    if gridded:
        contoured = all(quantity.categories is None for quantity in quantities)
        _heat(axes, sides, (x, y, c), mappable, contoured)
        return
    answered = np.isfinite(c)
    look = {"s": 22, "lw": 0.4, "ec": "white", "rasterized": len(x) > style.MANY_POINTS}
    axes.scatter(x[answered], y[answered], c=mappable.to_rgba(c[answered]), **look)
    if not answered.all():
        axes.plot(x[~answered], y[~answered], "x", color=EMPTY_POINT, ms=4, label=NO_ANSWER)


def _axis(axes, which, quantity, values, logarithmic, room):
    """Set scale and ticks of an axis, about `room` inches long, for the values of a quantity."""
    axis = getattr(axes, f"{which}axis")
    if quantity.categories is not None:
        style.name_axis(axes, which, quantity.names, room)
        return
    if logarithmic and len(values) and values[0] > 0:
        apart = TICK_ROOM / room * np.log10(values[-1] / values[0])
        ticks = style.own_ticks(values, OWN_TICKS, apart) if quantity.key else ()
        style.log_axis(axis, values[0], values[-1], 7, ticks)
    else:
        style.plain_axis(axis, 7)


def _heat(axes, sides, points, mappable, contoured):
    """Draw a heat map: a grid of coloured cells, one for each pair of the different values of x and y, the `sides`.

    `points` are x, y and value of the rows, arrays of equal length; a pair without a row or a value is an empty cell.
    Lines of equal values are drawn, if `contoured`, where the values have no room in the cells.
    """
    x_values, y_values = sides
    x, y, colour = points
    cells = np.full((len(y_values), len(x_values)), np.nan)
    cells[np.searchsorted(y_values, y), np.searchsorted(x_values, x)] = colour
    edges = [_edges(values, axes, which) for values, which in zip(sides, "xy", strict=True)]
    axes.set_facecolor(EMPTY_CELL)
    axes.grid(visible=False)
    look = {"norm": mappable.norm, "cmap": mappable.cmap, "rasterized": cells.size > style.MANY_POINTS}
    axes.pcolormesh(*edges, np.ma.masked_invalid(cells), **look)
    axes.set(xlim=edges[0][[0, -1]], ylim=edges[1][[0, -1]])
    if np.isnan(cells).any():
        axes.plot([], [], "s", color=EMPTY_CELL, mec=EMPTY_EDGE, ms=8, label=NO_ANSWER)
    written = np.argwhere(np.isfinite(cells)) if max(cells.shape) <= NUMBERED_CELLS else ()
    numbers = {(row, column): _three_digits(cells[row, column]) for row, column in written}
    if numbers and _fit(numbers, edges[0], axes):
        for (row, column), text in numbers.items():
            dark = np.dot(mappable.to_rgba(cells[row, column])[:3], (0.3, 0.6, 0.1)) < 0.5
            look = {"ha": "center", "va": "center", "fontsize": NUMBER_SIZE, "color": "white" if dark else "black"}
            axes.text(x_values[column], y_values[row], text, **look)
    elif contoured and min(cells.shape) >= CONTOURED_CELLS:
        _contours(axes, sides, np.ma.masked_invalid(cells), mappable)


def _three_digits(value):
    """A number of three significant digits as text, with its zeros at the end: `0.510` beside `0.511`."""
    rounded = float(f"{value:.3g}")
    return with_minus(f"{rounded:#.3g}".rstrip(".")) if 1e-3 <= abs(rounded) < 1e3 else number(rounded)


def _fit(numbers, edges, axes):
    """True if the numbers of cells, a dict of (row, column) -> text, are not wider than the cells, with their edges."""
    along = np.column_stack([edges, np.full(len(edges), axes.get_ylim()[0])])
    width = np.diff((axes.transScale + axes.transLimits).transform(along)[:, 0]) * axes.bbox.width / axes.figure.dpi
    return all(style.text_width(text, NUMBER_SIZE) < width[column] for (_row, column), text in numbers.items())


def _contours(axes, sides, cells, mappable):
    """Draw lines of equal values through the middles of the cells, at round values, with their numbers on them."""
    low, high = mappable.norm.vmin, mappable.norm.vmax
    logarithmic = isinstance(mappable.norm, LogNorm) and high > 10 * low
    levels = LogLocator(subs=(1, 2, 5)) if logarithmic else MaxNLocator(CONTOURS)
    levels = [level for level in levels.tick_values(low, high) if cells.min() < level < cells.max()]
    if levels:
        lines = axes.contour(*sides, cells, levels, colors="black", linewidths=0.8)
        look = {"fontsize": NUMBER_SIZE, "inline": False}
        numbers = axes.clabel(lines, fmt=lambda level: number(float(f"{level:.6g}")), **look)
        keep_apart(axes, numbers)


def keep_apart(axes, texts):
    """Set texts on white ground, and remove those that would stand over others, or over an edge of the axes."""
    size, kept = axes.bbox.size / axes.figure.dpi, np.zeros((0, 2))
    for text in texts:
        position = (axes.transScale + axes.transLimits).transform(text.get_position()) * size  # [in]
        distance = style.text_width(text.get_text(), NUMBER_SIZE) + 0.1  # enough whatever the angles of both
        over_edge = (np.minimum(position, size - position) < distance / 2).any()
        if over_edge or (np.hypot(*(kept - position).T) < distance).any():
            text.remove()
            continue
        text.set_bbox({"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.8})
        kept = np.append(kept, [position], axis=0)


def _edges(values, axes, which):
    """Edges of cells about values: half-way between them, on the scale of the axis."""
    logarithmic = getattr(axes, f"get_{which}scale")() == "log"
    scaled = np.log10(values) if logarithmic else values
    if len(values) == 1:
        half = 0.5 * abs(scaled[0]) or 0.5
        edges = np.array([scaled[0] - half, scaled[0] + half])
    else:
        middle = (scaled[1:] + scaled[:-1]) / 2
        edges = np.concatenate([[2 * scaled[0] - middle[0]], middle, [2 * scaled[-1] - middle[-1]]])
    return 10.0**edges if logarithmic else edges
