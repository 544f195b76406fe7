"""The forms of a suspension in all of its load cases: from the front, from the side and from above, over the ground."""

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from cablestudy.study.plots.cases import finish_side, looks_of
from cablestudy.study.plots.style import GREY, WIDTH, Window, heading, legend_below, styled
from cablestudy.study.plots.suspension import (
    draw_links,
    draw_lost,
    drawing_with_lost,
    from_above,
    from_front,
    from_side,
)
from cablestudy.study.plots.words import quantity_text, shortened

# title, what it shows of places, its axes, and the coordinates that these are
VIEWS = (
    ("From the front", from_front, ("x [m]", "z [m]"), (0, 2)),
    ("From the side", from_side, ("y [m]", "z [m]"), (1, 2)),
    ("From above", from_above, ("x [m]", "y [m]"), (0, 1)),
)
FLAT = 1e-3  # extent over that of the scene below which a view shows a line
RATIO = 0.3  # height over width of a view with an enlarged vertical scale


@styled
def suspension_case_views(cases):
    """Figure of the cables in each load case, one colour each; long and flat scenes have an enlarged vertical scale.

    Parameters
    ----------
    cases : dict
        Name -> `SuspensionCase` of a load case that has an answer.
    """
    drawings = {name: drawing_with_lost(case) for name, case in cases.items()}
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
    looks = looks_of(drawings)
    for axes, (title, view, labels, _), window, level in zip(grid, shown, windows, grounds, strict=True):
        for name, drawing in drawings.items():
            _draw(axes, drawing, view, *looks[name], _label(name, cases[name]))
            if len(drawing.lost):
                draw_lost(axes, view(drawing.lost), looks[name][1]).set_label(f"lost in {shortened(name)}")
        finish_side(axes, level, window, title, labels)
    entries = {label: artist for axes in grid for artist, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    legend_below(figure, [(artist, label) for label, artist in entries.items()])
    heading(figure, f"Load cases: {max(len(drawing.cables) for drawing in drawings.values())} cables")
    return figure


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


def _draw(axes, drawing, view, dashes, colour, label):
    """One case: its cables, and what stands at their ends."""
    axes.add_collection(LineCollection(view(drawing.cables), colors=colour, linestyles=[dashes], linewidths=1.3))
    draw_links(axes, view(drawing.links))
    axes.plot([], [], ls=dashes, color=colour, lw=1.3, label=label)
    for places, mark, paint in (
        (list(drawing.anchors.values()), "^", GREY),
        (list(drawing.junctions.values()), "o", colour),
        ([one[-1] for one in drawing.bodies.values()], "s", colour),
    ):
        if places:
            axes.plot(*view(np.array(places)).T, mark, color=paint, ms=4, zorder=3)


def _label(name, case):
    largest = float(np.linalg.norm(case.equilibrium.catenary.end_forces(), axis=-1).max())
    return f"{shortened(name)}: up to {quantity_text(largest, 'N')}"
