"""The forms of a suspension in one or all of its load cases: from the front, the side and above, over the ground."""

from contextlib import suppress

import numpy as np
from matplotlib.figure import Figure

from cablestudy.cable.geometry import clearance
from cablestudy.errors import NoSolutionError
from cablestudy.scene.words import counted
from cablestudy.study.plots.cases import finish_side, looks_of, mark_clearance
from cablestudy.study.plots.style import WIDTH, Window, legend_below, styled
from cablestudy.study.plots.suspension import (
    draw_parts,
    drawing_with_lost,
    entitle,
    from_above,
    from_front,
    from_side,
    name_all,
    tension_colours,
    views_in_space,
)
from cablestudy.study.plots.words import quantity_text, shortened

# title, what it shows of places, its axes, and the coordinates that these are
VIEWS = (
    ("From the front", from_front, ("x [m]", "z [m]"), (0, 2)),
    ("From the side", from_side, ("y [m]", "z [m]"), (1, 2)),
    ("From above", from_above, ("x [m]", "y [m]"), (0, 1)),
)
FLAT = 1e-3  # extent over that of the scene below which a view shows a line
LONG = 0.25  # second largest extent over the largest below which a scene is long
RATIO = 0.3  # height over width of a view with an enlarged vertical scale


@styled
def suspension_views(case):
    """Figure of a suspension in one case, its cables in colours of their tension.

    In perspective and from three sides; where it is long, or in one plane, as `suspension_case_views`.

    Parameters
    ----------
    case : SuspensionCase
        With a stable equilibrium.
    """
    drawing = drawing_with_lost(case)
    extent = np.sort(np.ptp(drawing.places, axis=0))
    if extent[0] <= FLAT * extent[2] or extent[1] < LONG * extent[2]:
        return _views({case.scene.case: case}, {case.scene.case: drawing})
    return views_in_space(drawing, case.scene.case)


@styled
def suspension_case_views(cases):
    """Figure of the cables in each load case, one colour each; long and flat scenes have an enlarged vertical scale.

    Parameters
    ----------
    cases : dict
        Name -> `SuspensionCase` of a load case that has an answer.
    """
    return _views(cases, {name: drawing_with_lost(case) for name, case in cases.items()})


def _views(cases, drawings):
    """Figure of `Drawing` of each of some cases, from the sides from which there is something to see.

    Of one case it has the tension of the cables, names, and the clearance.
    """
    ground = next(iter(cases.values())).scene.ground
    places = np.concatenate([drawing.places for drawing in drawings.values()])
    extent = np.ptp(places, axis=0)
    wide = extent > FLAT * extent.max()
    shown = [view for view in VIEWS if wide[list(view[3])].all()] or [VIEWS[0]]
    grounds = [_ground(ground, coordinates, places) for *_, coordinates in shown]
    windows = [_window(view(places), level) for (_, view, *_), level in zip(shown, grounds, strict=True)]
    heights = [0.7 + window.ratio * (WIDTH - 0.8) for window in windows]
    figure = Figure(figsize=(WIDTH, sum(heights) + 0.8), layout="constrained")
    grid = figure.subplots(len(shown), 1, height_ratios=heights, squeeze=False)[:, 0]
    draw = _draw_one if len(cases) == 1 else _draw_several
    heading_of_all, scale = draw(grid, [view for _, view, *_ in shown], cases, drawings, windows, grounds)
    for axes, (title, _, labels, _), window, level in zip(grid, shown, windows, grounds, strict=True):
        finish_side(axes, level, window, title, labels)
    entries = {label: artist for axes in grid for artist, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    legend_below(figure, [(artist, label) for label, artist in entries.items()])
    entitle(figure, heading_of_all, scale)
    return figure


def _draw_several(grid, views, cases, drawings, *_):
    """Each case in its colour and dashes. Returns a heading, and no scale."""
    looks = looks_of(drawings)
    for axes, view in zip(grid, views, strict=True):
        for name, drawing in drawings.items():
            dashes, colour = looks[name]
            axes.plot([], [], ls=dashes, color=colour, lw=1.3, label=_label(name, cases[name]))
            draw_parts(axes, drawing, view, colour, f"lost in {shortened(name)}", dashes, colour)
    most = max(len(drawing.cables) for drawing in drawings.values())
    return f"Load cases: {counted(most, 'cable')}", None


def _draw_one(grid, views, cases, drawings, windows, grounds):
    """The only case with names, and its clearance where it is least. Returns a heading, and the scale of colours."""
    ((name, case),), (drawing,) = cases.items(), drawings.values()
    colours, title, scale = tension_colours(drawing, name)
    for axes, view, window in zip(grid, views, windows, strict=True):
        draw_parts(axes, drawing, view, colours, "lost")
        axes.set(xlim=window.x, ylim=window.y)
        name_all(axes, drawing, view, window.width / (WIDTH - 1.8) / np.array([1.0, window.factor]))
    seen = [row for row in zip(grid, views, grounds, strict=True) if row[2] is not None]
    for axes, view, level in seen[:1]:
        _mark_clearance(axes, view, level, case, drawing)
    return title, scale


def _mark_clearance(axes, view, level, case, drawing):
    """The clearance of the cable that is nearest above the ground, where that is known and no cable ends on it."""
    found, least = case.equilibrium, {}
    for cable in range(len(drawing.cables)):
        with suppress(NoSolutionError):  # it leaves the range where the ground is known
            least[cable] = clearance(found.catenary.take(cable), found.ends[cable, 0], case.scene.ground)
    nearest = min(least, key=least.get, default=None)
    if nearest is not None and abs(least[nearest]) > FLAT * drawing.size:
        mark_clearance(axes, *view(drawing.cables[nearest]).T, level, least[nearest])


def _ground(ground, coordinates, places):
    """The ground in a view, two arrays: a level seen from the front and from the side, a profile from the front.

    None where it is not known, or not seen.
    """
    across, up = coordinates
    if ground is None or up != 2:
        return None
    if isinstance(ground, float):
        return np.array([places[:, across].min(), places[:, across].max()]), np.array([ground, ground])
    return tuple(np.array(ground, dtype=float).T) if across == 0 else None


def _window(flat, level):
    """`Window` of places on the paper, shape (n, 2), and of the ground, or None."""
    x, y = flat.T
    if level is None:
        return Window(x, y, RATIO)
    under = np.interp([x.min(), x.max()], *level)
    return Window(x, np.concatenate([y, level[1][(level[0] >= x.min()) & (level[0] <= x.max())], under]), RATIO)


def _label(name, case):
    largest = float(np.linalg.norm(case.equilibrium.catenary.end_forces(), axis=-1).max())
    return f"{shortened(name)}: up to {quantity_text(largest, 'N')}"
