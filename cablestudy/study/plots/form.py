"""The static form in the vertical plane of its chord."""

from functools import partial
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from matplotlib.transforms import ScaledTranslation

from cablestudy.study.plots.cases import CLEAR, NAMED_LOADS, case_forms, form_title, load_arrow, load_ring
from cablestudy.study.plots.deflection import deflections
from cablestudy.study.plots.style import BLUE, GREEN, GREY, RED, WIDTH, Window, heading, plain, styled
from cablestudy.study.plots.words import quantity_text
from cablestudy.study.report import shape_positions

LOW = 0.35  # depth of a cable in the picture below which there is no room for a text [in]


@styled
def static_form(case):
    """Figure of the static form with chord and sag, and below it the deflection by point loads, as in Fig. 4.

    Of a cable over ground, or in a steady wind, which leaves the vertical plane of its chord, the figure of
    `case_forms`.
    """
    if case.scene.ground is not None or tuple(np.ravel(case.span.vertical)) != (0.0, 0.0, 1.0):
        return case_forms({case.scene.case: case})
    form = Form(case)
    panels = [(4.2, partial(_paint_upright, form))] if form.upright else _inclined(form)
    if form.loaded:
        panels += deflections(form)
    heights = [height for height, _ in panels]
    figure = Figure(figsize=(WIDTH, sum(heights) + 0.35), layout="constrained")
    grid = figure.add_gridspec(len(panels), 1, height_ratios=heights)
    for place, (_, paint) in zip(grid, panels, strict=True):
        paint(figure, place)
    heading(figure, form_title(case, not (form.upright and form.loaded)))  # the sag of such a cable is not defined
    full_width = [axes for axes in figure.axes if axes.get_subplotspec().get_gridspec() is grid]
    for axes, below in pairwise(full_width):
        if axes.get_xlim() == below.get_xlim():
            axes.set_xlabel("")
    figure.align_ylabels(full_width)
    return figure


class Form:
    """The static form of a case in the vertical plane of the chord, with end 1 at the origin."""

    def __init__(self, case):
        span = case.span
        self.case, self.length, self.chord = case, float(span.unstretched_length), float(span.chord)  # lengths [m]
        self.cosine, self.sine = float(span.cosine), float(span.sine)
        self.positions = shape_positions(case)  # over the unstretched length [-], shape (j,)
        along, self.across, _, self.tension = self.in_frame(self.positions)  # distance from the chord [m]; [N]
        self.distance, self.height = self.plane(along, self.across)  # horizontally and vertically from end 1 [m]
        self.run, self.rise = self.plane(self.chord, 0.0)  # the same of end 2 [m]
        self.sag = float(case.statics.sag)
        # too steep to be drawn against horizontal distance
        self.upright = np.ptp(self.distance) < 1e-3 * np.ptp(self.height)
        # positions over the unstretched length [-], shape (k,), and forces in the chord frame [N], shape (k, 3)
        self.load_shares, self.load_forces = span.load_positions / self.length, span.load_forces
        self.loaded = len(self.load_shares) > 0

    def in_frame(self, positions):
        """Coordinates in the chord frame [m] and tension [N] at shares of the unstretched length."""
        displacement, tension = self.case.statics.shape(positions)
        local = displacement * self.length
        return local[:, 0] + positions * self.chord, local[:, 1], local[:, 2], tension

    def plane(self, along, across):
        """Horizontal and vertical components of points or displacements given in the chord frame."""
        return self.cosine * along - self.sine * across, self.sine * along + self.cosine * across

    def abscissa(self, positions):
        """Abscissa at shares of the unstretched length. [m]"""
        if self.upright:
            return positions * self.length
        along, across, _, _ = self.in_frame(positions)
        return self.plane(along, across)[0]

    @property
    def abscissa_label(self):
        """Label of the abscissa."""
        return "length along the unstretched cable [m]" if self.upright else "horizontal distance from end 1 [m]"


def _inclined(form):
    """Panels of a cable that is not vertical: its form, and the sag apart where the slope hides it."""
    window = Window(form.distance, np.append(form.height, [0.0, form.rise]), 0.30)
    hidden = abs(form.sag) * window.factor < 0.12 * window.ratio * form.run
    whole = (0.7 + window.ratio * (WIDTH - 0.8), partial(_paint_whole, form, window, hidden))
    return [whole, (2.35, partial(_paint_sag, form))] if hidden else [whole]


def _paint_whole(form, window, hidden, figure, place):
    axes = figure.add_subplot(place)
    window.apply(axes)
    _draw(axes, (form.run, form.rise), form.distance, form.height)
    axes.annotate(
        "chord and cable" if hidden else "chord", (form.run / 5, form.rise / 5), (0, 3), textcoords="offset points",
        ha="center", va="bottom", color=GREY, rotation=np.degrees(np.arctan2(form.rise, form.run)),
        rotation_mode="anchor", transform_rotates_text=True,
    )  # fmt: skip
    if not hidden:
        # where the cable is narrower than the text, the text stands beside it; where it is flat, above it
        aside = form.distance.max() if form.run < 0.4 * window.width else None
        flat = form.sag * window.factor * (WIDTH - 0.8) < LOW * window.width
        _dimension(axes, form.run / 2, form.rise / 2, form.sag, aside, np.sign(form.rise) if flat else 0)
    _mark_loads(axes, form)
    axes.set(xlabel=form.abscissa_label, ylabel="height above end 1 [m]")
    axes.set_title(window.note.capitalize(), loc="left", color=GREY)


def _paint_sag(form, figure, place):
    axes = figure.add_subplot(place)
    height = form.across / form.cosine
    window = Window(form.distance, np.append(height, 0.0), 0.24)
    window.apply(axes)
    _draw(axes, (form.run, 0.0), form.distance, height)
    _dimension(axes, form.run / 2, 0.0, form.sag)
    axes.set(xlabel=form.abscissa_label, ylabel="height above\nthe chord [m]")
    axes.set_title(f"Vertical distance from the chord, {window.note}", loc="left", color=GREY)


def _paint_upright(form, figure, place):
    """Height against length, and beside it height against tension."""
    left, right = place.subgridspec(1, 2, width_ratios=(3, 2)).subplots(sharey=True)
    _draw(left, (form.length, form.rise), form.positions * form.length, form.height)
    _mark_loads(left, form)
    left.set(xlabel=form.abscissa_label, ylabel="height above end 1 [m]")
    left.legend(loc="upper left" if form.rise >= 0 else "upper right")  # above the chord, where no cable hangs
    right.plot(form.tension, form.height, color=GREEN, label="tension")
    right.set(xlabel="tension [N]")
    plain(left, 7, 7)
    plain(right, 4, 7)


def _draw(axes, end, x, y):
    """Draws the chord from the origin to its other end, and the cable."""
    chord = [[0, value] for value in end]
    axes.plot(*chord, "--", color=GREY, lw=1, label="chord")
    axes.plot(x, y, color=BLUE, label="cable")
    axes.plot(*chord, "o", color=GREY, ms=4)


def _dimension(axes, x, top, sag, aside=None, slope=0):
    """Dimensions the sag as in an engineering drawing, with its value at the arrow or, with a leader, at x = aside.

    With the sign of a slope it stands above the chord that rises or falls so.
    """
    arrow = {"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0, "color": RED, "lw": 1}
    axes.annotate("", (x, top - sag), (x, top), arrowprops=arrow)
    middle, text, look = top - sag / 2, f"sag {quantity_text(sag, 'm')}", {"va": "center", "color": RED, "bbox": CLEAR}
    if slope:
        look |= {"ha": "right" if slope > 0 else "left", "va": "bottom"}
        axes.annotate(text, (x, top), (-4 * slope, 3), textcoords="offset points", **look)
        return
    if aside is None:
        axes.annotate(text, (x, middle), (5, 0), textcoords="offset points", **look)
        return
    leader = {"arrowstyle": "-", "shrinkA": 2, "shrinkB": 0, "color": RED, "lw": 0.7}
    gap = axes.transData + ScaledTranslation(0.2, 0.0, axes.figure.dpi_scale_trans)  # [in]
    axes.annotate(text, (x, middle), (aside, middle), textcoords=gap, arrowprops=leader, **look)


def _mark_loads(axes, form):
    """Draws an arrow for each load in the plane of the picture, a ring for one out of it."""
    for share, force in zip(form.load_shares, form.load_forces, strict=True):
        size = float(np.linalg.norm(force))
        place = (form.abscissa(np.array([share]))[0], np.interp(share, form.positions, form.height))
        text = quantity_text(size, "N") if len(form.load_shares) <= NAMED_LOADS else ""
        level, up = form.plane(force[0], force[1])
        if form.upright:
            level, up = (level, 0.0) if abs(level) > abs(up) else (0.0, up)
        if np.hypot(level, up) < 0.5 * size:
            load_ring(axes, place, text, "." if force[2] < 0 else "x")
        else:
            load_arrow(axes, place, text, level, up)
