"""The static forms of one cable in all of its load cases."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from cablestudy.cable.geometry import places
from cablestudy.study.plots.style import DASHES, GREY, SERIES, WIDTH, Window, heading, legend_below, plain, styled
from cablestudy.study.plots.words import quantity_text, shortened
from cablestudy.study.report import shape_positions

SIDEWAYS = 1e-6  # share of the chord from which on a cable is drawn out of the vertical plane too
UPRIGHT = 1e-3  # run over rise below which there is no horizontal distance to draw against
HIDDEN = 0.06  # share of the height of the picture below which a sag is hidden by the slope of its chord
GROUND = "#8c7355"
DISTANCE = "horizontal distance from end 1 [m]"


@styled
def case_forms(cases):
    """Figure of the forms of one cable: side view with the ground, distance from a steep chord, view along the span.

    Parameters
    ----------
    cases : dict
        Name -> `Case` of a load case that has an answer.
    """
    views = {name: _View(case) for name, case in cases.items()}
    first = next(iter(views.values()))
    panels = _panels(views, _ground(next(iter(cases.values())), first))
    tall = [height for height, _ in panels]
    figure = Figure(figsize=(WIDTH, sum(tall) + 0.8), layout="constrained")
    grid = figure.subplots(len(tall), 1, height_ratios=tall, squeeze=False)[:, 0]
    looks = {name: (DASHES[k % len(DASHES)], SERIES[k % len(SERIES)]) for k, name in enumerate(views)}
    for axes, (_, paint) in zip(grid, panels, strict=True):
        paint(axes, views, looks)
    legend_below(figure, list(zip(*grid[0].get_legend_handles_labels(), strict=True)))
    named = "Load cases" if len(cases) > 1 else f"Load case {shortened(next(iter(cases)))}"
    heading(figure, f"{named}: chord {quantity_text(first.chord, 'm')}")
    return figure


def _panels(views, ground):
    """The panels that show what there is to see.

    Parameters
    ----------
    views : dict
        Name -> _View.
    ground : tuple or None
        From `_ground`.

    Returns
    -------
    list of (float, callable)
        Height [in], and what draws: axes, views, looks -> None.
    """
    heights = np.concatenate([*(view.height for view in views.values()), *(() if ground is None else [ground[1]])])
    distances = np.concatenate([view.distance for view in views.values()])
    window = Window(distances, heights, 0.30)
    below = np.concatenate([view.below for view in views.values()])
    hidden = np.abs(below).max() * window.factor < HIDDEN * window.ratio * window.width
    panels = []
    if ground is not None or not hidden:
        panels.append((0.7 + window.ratio * (WIDTH - 0.8), partial(_side, ground=ground, window=window)))
    if hidden:
        panels.append((2.6, partial(_from_the_chord, window=Window(distances, [*below, 0.0], 0.26))))
    chord = next(iter(views.values())).chord
    if any(np.abs(view.aside).max() > SIDEWAYS * chord for view in views.values()):
        panels.append((2.6, _along_the_span))
    return panels


class _View:
    """One cable in the vertical plane of its chord and out of it. [m]"""

    def __init__(self, case):
        form, end_1 = case.form, np.asarray(case.end_1, dtype=float)
        self.chord = float(form.span.chord)
        chord = form.span.frame[0] * self.chord
        self.run, self.rise = float(np.hypot(*chord[:2])), float(chord[2])
        upright = self.run < UPRIGHT * self.chord
        level = np.array([1.0, 0.0]) if upright else chord[:2] / self.run
        positions = shape_positions(case)
        where = places(form, positions)
        self.distance, self.aside = where[:, :2] @ level, where[:, :2] @ np.array([-level[1], level[0]])
        self.height = where[:, 2] + end_1[2]
        self.below = where[:, 2] - (positions if upright else self.distance / self.run) * self.rise
        self.start, self.level, self.sag = end_1, level, float(case.statics.sag)
        loads = form.span.load_positions / form.span.unstretched_length
        self.loads = np.interp(loads, positions, self.distance), np.interp(loads, positions, self.height)


def _ground(case, view):
    """Horizontal distance from end 1 and level of the ground under the span; None where they are not known."""
    ground = case.scene.ground
    if ground is None:
        return None
    if isinstance(ground, float):
        return np.array([0.0, view.run]), np.array([ground, ground])
    x, z = np.array(ground, dtype=float).T
    if abs(view.level[0]) < UPRIGHT:
        return None
    return (x - view.start[0]) / view.level[0], z


def _draw(axes, views, looks, height):
    """Draws one line for each case: an attribute of its view against the distance."""
    for name, view in views.items():
        line, colour = looks[name]
        axes.plot(view.distance, getattr(view, height), ls=line, color=colour, lw=1.3, label=_label(name, view))


def _label(name, view):
    return f"{shortened(name)}: sag {quantity_text(view.sag, 'm')}"


def _side(axes, views, looks, ground, window):
    _draw(axes, views, looks, "height")
    for name, view in views.items():
        axes.plot(*view.loads, "o", color=looks[name][1], ms=4)
    view = next(iter(views.values()))
    ends = [0.0, view.run], [view.start[2], view.start[2] + view.rise]
    axes.plot(*ends, "--", color=GREY, lw=0.8, label="chord")
    axes.plot(*ends, "o", color=GREY, ms=4)
    if ground is not None:
        axes.plot(*ground, color=GROUND, lw=1.5, label="ground")
        axes.fill_between(*ground, window.y[0], color=GROUND, alpha=0.15, lw=0)
    window.apply(axes)
    axes.set(xlabel=DISTANCE, ylabel="level [m]")
    axes.set_title(f"Side view, {window.note}", loc="left", color=GREY)


def _from_the_chord(axes, views, looks, window):
    _draw(axes, views, looks, "below")
    view = next(iter(views.values()))
    axes.plot([0.0, view.run], [0.0, 0.0], "--o", color=GREY, lw=0.8, ms=4)
    window.apply(axes)
    axes.set(xlabel=DISTANCE, ylabel="height above\nthe chord [m]")
    axes.set_title(f"Vertical distance from the chord, {window.note}", loc="left", color=GREY)


def _along_the_span(axes, views, looks):
    """Sideways against height from the chord: a cable is a line at its angle of swing."""
    for name, view in views.items():
        line, colour = looks[name]
        axes.plot(view.aside, view.below, ls=line, color=colour, lw=1.3)
        lowest = int(np.argmax(np.hypot(view.aside, view.below)))
        axes.plot(view.aside[lowest], view.below[lowest], "o", color=colour, ms=4)
    axes.plot(0, 0, "o", color=GREY, ms=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.set(xlabel="sideways [m]", ylabel="from the chord [m]")
    axes.set_title("Seen along the span, true to scale", loc="left", color=GREY)
    plain(axes, 8, 5)
