"""The static forms of one cable over the ground, in all of its load cases or in one."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from cablestudy.cable.geometry import clearance, load_sag, places
from cablestudy.errors import NoSolutionError
from cablestudy.study.plots.style import (
    DASHES,
    GREY,
    ORANGE,
    RED,
    SERIES,
    WIDTH,
    Window,
    heading,
    legend_below,
    plain,
    styled,
)
from cablestudy.study.plots.words import quantity_text, shortened
from cablestudy.study.report import shape_positions

SIDEWAYS = 1e-6  # share of the chord from which on a cable is drawn out of the vertical plane too
UPRIGHT = 1e-3  # run over rise below which there is no horizontal distance to draw against
HIDDEN = 0.06  # share of the height of the picture below which a sag is hidden by the slope of its chord
GROUND = "#8c7355"
NEAR_AN_END = 0.15  # share of the span from an end within which a text stands beside its place
CLEAR = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.8}  # behind a text over lines
NAMED_LOADS = 6  # the labels of more would overlap
RIGHT_ROOM = 0.85  # share of the width up to which a text has room at the right of its place
STATED = 5e-4  # relative difference from which a number is another one than the scene states, in four digits
DISTANCE = "horizontal distance from end 1 [m]"


@styled
def case_forms(cases):
    """Figure of the static forms of one cable, one line for each case.

    Panels: side view with the ground; distance from the chord, where the chord is steep and hides the sag; view along
    the span, where the cable leaves the vertical plane. A single case has its point loads and its clearance too.

    Parameters
    ----------
    cases : dict
        Name -> `Case` of a load case that has an answer; None -> that of a scene without load cases.
    """
    views = {name: _View(case) for name, case in cases.items()}
    first, case = next(iter(views.values())), next(iter(cases.values()))
    panels = _panels(views, ground_under(case.scene.ground, first.run, first.start, first.level))
    tall = [height for height, _ in panels]
    figure = Figure(figsize=(WIDTH, sum(tall) + 0.8), layout="constrained")
    grid = figure.subplots(len(tall), 1, height_ratios=tall, squeeze=False)[:, 0]
    looks = looks_of(views)
    for axes, (_, paint) in zip(grid, panels, strict=True):
        paint(axes, views, looks)
    legend_below(figure, list(zip(*grid[0].get_legend_handles_labels(), strict=True)))
    several = len(cases) > 1
    heading(figure, f"Load cases: chord {quantity_text(first.chord, 'm')}" if several else form_title(case))
    return figure


def looks_of(names):
    """Dashes and colour of each of some load cases: dict."""
    return {name: (DASHES[k % len(DASHES)], SERIES[k % len(SERIES)]) for k, name in enumerate(names)}


def form_title(case, with_sag=True):
    """Title of the picture of one case, with the main numbers of the cable.

    Of preload and sag also what the scene states, where that holds for the reference state and not for this one.
    """
    numbers, cable = [f"chord {quantity_text(float(case.span.chord), 'm')}"], case.scene.cable
    shown = [("preload", case.statics.mean_tension, "N", cable.stated_preload)]
    shown += [("sag", case.statics.sag, "m", cable.sag)] if with_sag else []
    for name, value, unit, stated in shown:
        other = stated is not None and abs(float(value) - stated) > STATED * stated
        reference = f" ({quantity_text(stated, unit)} in the reference state)" if other else ""
        numbers.append(f"{name} {quantity_text(float(value), unit)}{reference}")
    named = f"Load case {shortened(case.scene.case)}" if case.scene.case else "Static form"
    return f"{named}: {', '.join(numbers)}"


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
        self.chord, (self.run, self.rise, level) = float(form.span.chord), along_the_chord(form.span)
        upright = self.run < UPRIGHT * self.chord
        positions = shape_positions(case)
        where = places(form, positions)
        self.distance, self.aside = where[:, :2] @ level, where[:, :2] @ np.array([-level[1], level[0]])
        self.height = where[:, 2] + end_1[2]
        self.below = where[:, 2] - (positions if upright else self.distance / self.run) * self.rise
        self.case, self.start, self.level, self.sag = case, end_1, level, float(case.statics.sag)
        loads = form.span.load_positions / form.span.unstretched_length
        self.loads = np.interp(loads, positions, self.distance), np.interp(loads, positions, self.height)


def along_the_chord(span):
    """Horizontal and vertical distance of the ends of a `Span` [m], and the horizontal direction of end 2."""
    chord = span.frame[0] * float(span.chord)
    run = float(np.hypot(*chord[:2]))
    return run, float(chord[2]), np.array([1.0, 0.0]) if run < UPRIGHT * float(span.chord) else chord[:2] / run


def ground_under(ground, run, start, level):
    """Horizontal distance from end 1 and level of the ground under a span; None where they are not known.

    Parameters
    ----------
    ground : float, sequence of (float, float) or None
        As the scene states it.
    run : float
        Horizontal distance of the ends. [m]
    start : ndarray, shape (3,)
        Place of end 1. [m]
    level : ndarray, shape (2,)
        Horizontal direction of end 2, unit vector. [-]
    """
    if ground is None:
        return None
    if isinstance(ground, float):
        return np.array([0.0, run]), np.array([ground, ground])
    x, z = np.array(ground, dtype=float).T
    if abs(level[0]) < UPRIGHT:
        return None
    return (x - start[0]) / level[0], z


def _draw(axes, views, looks, height):
    """Draws one line for each case: an attribute of its view against the distance."""
    for name, view in views.items():
        line, colour = looks[name]
        axes.plot(view.distance, getattr(view, height), ls=line, color=colour, lw=1.3, label=_label(name, view))


def _label(name, view):
    sag = f"sag {quantity_text(view.sag, 'm')}"
    if len(view.loads[0]):  # a rider, for example, whose place differs from case to case
        sag = f"load {quantity_text(float(load_sag(view.case.form)), 'm')} below the chord"
    return f"{shortened(name) if name else 'cable'}: {sag}"


def _side(axes, views, looks, ground, window):
    _draw(axes, views, looks, "height")
    view = next(iter(views.values()))
    if len(views) == 1:
        _mark(axes, view, ground)
    else:
        for name, one in views.items():
            axes.plot(*one.loads, "o", color=looks[name][1], ms=4)
    ends = [0.0, view.run], [view.start[2], view.start[2] + view.rise]
    axes.plot(*ends, "--", color=GREY, lw=0.8, label="chord")
    axes.plot(*ends, "o", color=GREY, ms=4)
    finish_side(axes, ground, window)


def finish_side(axes, ground, window, title="Side view", labels=(DISTANCE, "level [m]")):
    """The ground in a view from the side, if it is known, and scales and names of its axes."""
    if ground is not None:
        axes.plot(*ground, color=GROUND, lw=1.5, label="ground")
        axes.fill_between(*ground, window.y[0], color=GROUND, alpha=0.15, lw=0)
    window.apply(axes)
    axes.set(xlabel=labels[0], ylabel=labels[1])
    axes.set_title(f"{title}, {window.note}", loc="left", color=GREY)


def _mark(axes, view, ground):
    """Point loads with their forces, and the clearance over the ground where it is least."""
    form = view.case.form
    forces = np.asarray(form.span.load_forces) @ form.span.frame
    for place, force in zip(np.transpose(view.loads), forces, strict=True):
        text = quantity_text(float(np.linalg.norm(force)), "N") if len(forces) <= NAMED_LOADS else ""
        along, up = force[:2] @ view.level, force[2]
        if np.hypot(along, up) < 0.5 * np.linalg.norm(force):
            load_ring(axes, place, text, "x", above=True)
        else:
            load_arrow(axes, place, text, along, up, onto=True)
    if ground is None:
        return
    try:
        least = clearance(form, view.case.end_1, view.case.scene.ground)
    except NoSolutionError:  # the cable leaves the range where the ground is known
        return
    mark_clearance(axes, view.distance, view.height, ground, least)


def mark_clearance(axes, distance, height, ground, least):
    """An arrow with the clearance where a line is nearest above the ground.

    Parameters
    ----------
    distance, height : ndarray, shape (j,)
        Of the line. [m]
    ground : tuple of 2 ndarrays
        Distance and level of the ground. [m]
    least : float
        The clearance. [m]
    """
    order = np.argsort(ground[0])
    level = np.interp(distance, ground[0][order], ground[1][order])
    place = int(np.argmin(height - level))
    arrow = {"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0, "color": RED, "lw": 1}
    x, low, high = distance[place], level[place], height[place]
    axes.annotate("", (x, low), (x, high), arrowprops=arrow)
    # in the ground below the arrow, where the cable is not in its way
    share = (x - np.min(distance)) / (np.ptp(distance) or 1.0)
    side = "left" if share < NEAR_AN_END else "right" if share > 1 - NEAR_AN_END else "center"
    text = f"clearance {quantity_text(least, 'm')}"
    axes.annotate(text, (x, low), (0, -7), textcoords="offset points", ha=side, va="top", color=RED)


def load_ring(axes, place, text, mark, above=False):
    """A load out of the plane of a picture: a ring with a mark, its force below or above."""
    axes.plot(*place, "o", ms=9, mfc="white", mec=ORANGE, mew=1.5, zorder=4)
    axes.plot(*place, mark, ms=5, color=ORANGE, zorder=5)
    up, side = (9, "bottom") if above else (-9, "top")
    axes.annotate(text, place, (0, up), textcoords="offset points", ha="center", va=side, bbox=CLEAR)


def load_arrow(axes, place, text, level, up, onto=False):
    """A load in the plane of a picture: an arrow along its horizontal and vertical component, with its force.

    It begins at its place, or ends there (`onto`), where there is something below.
    """
    x, y = 26 * np.array([level, up]) / np.hypot(level, up) * (-1 if onto else 1)
    look = {"arrowstyle": "-|>" if onto else "<|-", "shrinkA": 0, "shrinkB": 0, "color": ORANGE, "lw": 1.6}
    axes.annotate("", place, (x, y), textcoords="offset points", arrowprops=look)
    start, end = axes.get_xlim()
    gap, side = (6, "left") if x >= 0 and place[0] < start + RIGHT_ROOM * (end - start) else (-6, "right")
    axes.annotate(text, place, (x + gap, y), textcoords="offset points", ha=side, va="center", bbox=CLEAR)


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
