"""The static form of a scene, or its forms in several load cases, in a view or in space; the path of a moving load."""

from functools import cached_property, partial
from itertools import cycle, pairwise

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

import cablestudy.plots.marks as marks
import cablestudy.plots.style as style
from cablestudy.cable.geometry import points_along
from cablestudy.plots.deflection import deflections
from cablestudy.plots.drawing import FLAT, VIEWS, direction, drawing_of, ground_in, upright_plane, view_from_end_1
from cablestudy.plots.words import force_text, force_unit, length_text, shortened

SIDEWAYS = 1e-6  # share of the size from which on a cable is drawn out of the vertical plane too
HIDDEN_SAG = 0.06  # share of the height of the picture below which a sag is hidden by the slope of its chord
SMALL_SAG = 0.03  # share of the height of the picture below which a sag has no dimension
MOST_SAGS = 6  # cables up to which sags have dimensions
LONG_SCENE = 0.25  # second largest extent over the largest below which a scene is long
ENLARGED_RATIO = 0.3  # height over width of a view with an enlarged vertical scale
SPACE_BELOW = 0.05  # between views of a scene in space, share of their height
PANEL_WIDTH = style.WIDTH - 0.8  # width of a panel without its numbers [in]
BAR_WIDTH = 0.8  # width of a scale of colours with its numbers [in]
LENGTH_LABEL = "length along the unstretched cable [m]"
DRAWN_FORMS = 5  # of the cable that are drawn
MOST_DOTS = 50  # positions up to which each is marked
FORM_POINTS = np.linspace(0.0, 1.0, 201)


@style.styled
def static_form(case):
    """Figure of the static form of one case in a stable equilibrium, its cables in colours of their tension.

    Where all cables end in one vertical plane the side view, below it what that hides: sags of steep cables, movement
    out of the plane, and the deflection by point loads on the only cable, as in the paper's Fig. 4. Else in perspective
    and from three sides, where the scene is long or flat from these alone.
    """
    return _Picture([drawing_of(case)], case).figure()


@style.styled
def case_forms(cases):
    """Figure of the static forms in load cases that have an answer, name -> case: one colour and dashes each."""
    return _Picture([drawing_of(case) for case in cases.values()]).figure()


class _Picture:
    """Figure of the static form of a scene, with those panels that show something: a `Drawing` for each load case.

    `case` is the only load case, for the deflections by its point loads.
    """

    def __init__(self, drawings, case=None):
        self.drawings, self.first, self.alone, self.case = drawings, drawings[0], len(drawings) == 1, case
        self.positions = np.concatenate(
            [drawing.positions for drawing in drawings]
        )  # all that are drawn, shape (n, 3) [m]
        self.plane = upright_plane(drawings)
        extent = np.ptp(self.positions, axis=0)
        self.seen, (least, middle, most) = extent > FLAT * extent.max(), np.sort(extent)  # axes along which it extends
        # drawn in perspective and from three sides
        self.in_space = self.alone and self.plane is None and least > FLAT * most and middle >= LONG_SCENE * most
        held = np.concatenate([drawing.held for drawing in drawings])
        # the only cable hangs between ends above each other
        self.upright = self.first.single and np.ptp(held[:, :2], axis=0).max() < FLAT * most
        has_loads = case is not None and self.first.single and len(self.first.loads) and self.first.ground is None
        # the deflection of the only cable by its point loads is drawn
        self.loaded = has_loads and np.ravel(self.first.form.span.vertical)[2] == 1
        self.looks, self.scale = _looks(drawings, self.upright)

    @property
    def width(self):
        """Width of a panel on paper. [in]"""
        return 2.5 if self.in_space else PANEL_WIDTH - (BAR_WIDTH if self.scale is not None else 0.0)

    def figure(self):
        """Draw all panels, one legend below them, a title, and a colour bar of the tension if colours show that."""
        columns, heights = 1 + self.in_space, [height for height, _ in self.panels][:: 1 + self.in_space]
        title_of_several = f"Load cases: {max(self.drawings, key=lambda drawing: len(drawing.cables)).contents}"
        title = self.first.title(not self.upright) if self.alone else title_of_several
        figure = style.new_figure(sum(heights) + 0.8, title)
        if self.in_space:
            figure.get_layout_engine().set(hspace=SPACE_BELOW)
        grid = figure.add_gridspec(len(heights), columns, height_ratios=heights)
        for cell, (_, paint) in zip(grid, self.panels, strict=True):
            paint(figure, cell)
        marked = [axes for axes in figure.axes if axes.get_legend() is None]
        entries = {label: artist for axes in marked for artist, label in style.entries_of(axes)}
        cables_first = sorted(entries.items(), key=lambda entry: entry[0] in ("chord", "ground", "link", "winch"))
        style.legend_below(figure, [(artist, label) for label, artist in cables_first])
        full_width = [axes for axes in figure.axes if axes.get_subplotspec().get_gridspec() is grid]
        if self.scale is not None:
            style.colour_bar(figure, figure.axes, *self.scale, shrink=0.8, aspect=30)
        if columns == 1:  # of panels with one horizontal axis only the lowest has its label
            for axes, below in pairwise(full_width):
                if (axes.get_xlim(), axes.get_xlabel()) == (below.get_xlim(), below.get_xlabel()):
                    axes.set_xlabel("")
            figure.align_ylabels(full_width)
        return figure

    @cached_property
    def panels(self):
        """List of (height [in], function that draws the panel: figure, cell of its grid -> None)."""
        plane, panels = self.plane, [(4.2, self._draw_against_length)] if self.upright else self._views()
        drawings = self.drawings if plane else ()
        aside = [np.abs(self._out_of_plane(drawing)).max(initial=0.0) / drawing.size for drawing in drawings]
        if max(aside, default=0.0) > SIDEWAYS and not self.loaded:
            panels.append((2.6, self._draw_along_span))
        if self.loaded:
            cable, first = self.case.hanging(next(iter(self.case.scene.cables))), self.first
            of_plane = (plane(first.cables[0])[:, 0], plane.labels[0])
            x, label = (first.lengths[0], LENGTH_LABEL) if self.upright else of_plane
            panels += deflections(cable, lambda shares: np.interp(shares, first.shares[0], x), label)
        return panels

    def _views(self):
        """Panels of views from the sides or in space, as in `panels`; of steep cables the distance from the chord."""
        views = self._chosen_views()
        grounds = [ground_in(view, self.first.ground, view(self.positions)[:, 0]) for view in views]
        windows = self._windows(views, grounds)
        above_chord = np.concatenate([drawing.above_chord.ravel() for drawing in self.drawings])
        height, sag = windows[0].ratio * windows[0].width, np.abs(above_chord).max(initial=0.0) * windows[0].factor
        hidden = self.plane is not None and 0 < sag < HIDDEN_SAG * height
        heights = [3.1 if self.in_space else 0.7 + window.ratio * self.width for window in windows]
        marked = next((number for number, ground in enumerate(grounds) if ground is not None), None)  # with clearance
        abouts = enumerate(zip(views, windows, grounds, strict=True))
        paints = [partial(self._view, *about, number == marked, hidden) for number, about in abouts]
        panels = list(zip(heights, paints, strict=True))
        if hidden:
            panels = panels if self.alone or grounds[0] is not None else []
            window = style.Window(self.plane(self.positions)[:, 0], np.append(above_chord, 0.0), 0.26)
            panels.append((2.6, partial(self._draw_from_chord, window)))
        return panels

    def _chosen_views(self):
        """The plane of the scene, or space and three sides; of a long or flat scene the sides that show something."""
        front, side, above = VIEWS
        if self.plane is not None:
            return [self.plane]
        if self.in_space:
            return [self.first.perspective, above, front, side]
        return [view for view in VIEWS if self.seen[view.axes.any(axis=-1)].all()] or [front]

    def _windows(self, views, grounds):
        """`Window` of each view, with its ground; of a scene in space all to one scale."""
        outlines = [with_ground(view(self.positions), ground) for view, ground in zip(views, grounds, strict=True)]
        if self.in_space:
            half = max(np.ptp(outline, axis=0).max() for outline in outlines) / 2 * np.array([[-1], [1]])
            outlines = [(outline.min(axis=0) + outline.max(axis=0)) / 2 + half for outline in outlines]
        tallest = 1.0 if self.in_space else style.TALLEST_PANEL
        return [style.Window(*outline.T, ENLARGED_RATIO, tallest) for outline in outlines]

    def _view(self, view, window, ground, with_clearance, hidden, figure, cell):
        """Draw one view of the scene, with its ground from `ground_in`, in a cell of a figure's grid.

        Sags have no dimensions if they are `hidden` by the slopes of the chords.
        """
        axes = figure.add_subplot(cell)
        for drawing, look in zip(self.drawings, self.looks, strict=True):
            marks.draw_parts(axes, drawing, view, **look)
        if self.first.single:
            marks.draw_chords(axes, view(self.first.ends))
        finish_view(axes, view, window, ground, 5 if self.in_space else 8)
        if self.alone:
            self._annotate(axes, view, window, ground if with_clearance else None, view is self.plane and not hidden)

    def _annotate(self, axes, view, window, ground, with_sags):
        """Write names, loads, dimensions of sags, and the clearance above a ground that is not None, into a view."""
        first, chords = self.first, view(self.first.ends)
        along = np.linspace(chords[:, 0], chords[:, 1], 99).reshape(-1, 2)
        room = room_in(axes, window, np.concatenate([view(first.cables).reshape(-1, 2), along]), self.width)
        if not view.labels[0]:
            corner = np.array([window.x[1], window.y[0]])
            room.reserve(corner, corner + np.array([-0.3, 0.1]) * window.width)  # for the bar of the scale
        cable_and_clearance = None if ground is None else first.least_clearance()
        if cable_and_clearance is not None and abs(cable_and_clearance[1]) > FLAT * first.size:
            cable, clearance = cable_and_clearance
            marks.mark_clearance(axes, room, view(first.cables[cable]), ground, clearance)
        marks.mark_loads(axes, room, [(view(position), force) for position, force, _ in first.loads], view.axes)
        if with_sags:
            self._mark_sags(axes, room, chords, window)
        marks.name_all(room, first, view)

    def _mark_sags(self, axes, room, chords, window):
        """Dimensions of the sags of a few cables from chords on the paper, shape (c, 2, 2), where they can be seen."""
        first = self.first
        large = first.sag > SMALL_SAG * (window.y[1] - window.y[0])
        large &= large.sum() <= MOST_SAGS
        if not first.single and large.any():
            marks.draw_chords(axes, chords[large])
        for middle, sag in zip(chords[large].mean(axis=1), first.sag[large].tolist(), strict=True):
            marks.mark_sag(axes, room, middle, sag)

    def _draw(self, axes, lines_of, **look):
        """Draw lines of each drawing in its colour and dashes; the lines of the last one on the paper, shape (c, j, 2).

        `lines_of`: function of a drawing, to x and y on the paper, which are broadcast to the shape (c, j).
        """
        for drawing, its_look in zip(self.drawings, self.looks, strict=True):
            lines = np.stack(np.broadcast_arrays(*lines_of(drawing)), axis=-1)
            options = {"colours": its_look["colours"], "label": its_look["label"], **look}
            marks.draw_lines(axes, lines, linestyles=[its_look["dashes"]], linewidths=1.4, **options)
        axes.autoscale_view()
        return lines

    def _draw_from_chord(self, window, figure, cell):
        """Draw the height of each cable above its chord over the horizontal distance, in a cell of a figure's grid."""
        axes, plane = figure.add_subplot(cell), self.plane
        lines = self._draw(axes, lambda drawing: (plane(drawing.cables)[..., 0], drawing.above_chord))
        window.apply(axes)
        chords = plane(self.first.ends) * np.array([1.0, 0.0])
        marks.draw_chords(axes, chords, "o")
        if self.alone:
            room = room_in(axes, window, np.concatenate([lines.reshape(-1, 2), *chords]), self.width)
            self._mark_sags(axes, room, chords, window)
        axes.set(xlabel=plane.labels[0], ylabel="height above\nthe chord [m]")
        axes.set_title(f"Vertical distance from the chord, {window.note()}", loc="left", color=style.GREY)

    def _out_of_plane(self, drawing):
        """Distances from the chord of each cable of a drawing out of the plane, shape (c, j). [m]"""
        return drawing.from_chord @ np.cross(self.plane.axes[:, 1], self.plane.axes[:, 0])

    def _draw_along_span(self, figure, cell):
        """Draw the cables as seen along the span, from their chords: each is a line at its angle of swing."""
        axes = figure.add_subplot(cell)
        self._draw(axes, lambda drawing: (self._out_of_plane(drawing), drawing.above_chord), label="")
        for drawing, look in zip(self.drawings, self.looks, strict=True):
            aside, above = self._out_of_plane(drawing), drawing.above_chord
            farthest = np.arange(len(above)), np.hypot(aside, above).argmax(axis=-1)
            axes.scatter(aside[farthest], above[farthest], s=16, c=look["colours"], zorder=3)
        axes.plot(0, 0, "o", color=style.GREY, ms=4)
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.12)
        axes.set(xlabel="sideways [m]", ylabel="from the chord [m]")
        axes.set_title("Seen along the span, true to scale", loc="left", color=style.GREY)
        style.plain(axes, 8, 5)

    def _draw_against_length(self, figure, cell):
        """Draw cables too steep for a horizontal distance: height against length, and beside it against tension."""
        left, right = cell.subgridspec(1, 2, width_ratios=(3, 2)).subplots(sharey=True)
        plane, green = self.plane, {"colours": style.GREEN} if self.alone and self.first.single else {}
        lines = self._draw(left, lambda drawing: (drawing.lengths, plane(drawing.cables)[..., 1]))
        unit, factor = force_unit(max(drawing.tensions.max() for drawing in self.drawings))
        self._draw(right, lambda drawing: (factor * drawing.tensions, plane(drawing.cables)[..., 1]), label="", **green)
        marks.draw_chords(left, lines[:, [0, -1]], "o")
        left.set(xlabel=LENGTH_LABEL, ylabel=plane.labels[1])
        right.set(xlabel=f"tension [{unit}]")
        style.plain(left, 7, 7)
        style.plain(right, 4, 7)
        if self.alone:
            per_inch = np.array([np.ptp(left.get_xlim()), np.ptp(left.get_ylim())]) / 3.5
            loads = [((length, plane(position)[1]), force) for position, force, length in self.first.loads]
            marks.mark_loads(left, marks.Room(left, per_inch, lines.reshape(-1, 2)), loads, plane.axes)


def _looks(drawings, unnamed):
    """Looks of load cases, a dict of arguments of `marks.draw_parts` for each, and a scale of the colours or None.

    Of a single load case, each cable has the colour of its mean tension, if these differ; the scale is then a
    ScalarMappable and its label. Of several load cases, each has one colour for all its cables. If `unnamed`, a single
    load case of one cable is labelled by its name alone, without sag or distance of a load.
    """
    largest = max(abs(drawing.measure) for drawing in drawings)
    if len(drawings) > 1:
        pairs = zip(cycle(style.DASHES), cycle(style.SERIES), strict=False)
        looks = [{"dashes": dashes, "colours": colour, "own": colour, "label": drawing.label(largest),
                  "lost": f"lost in {drawing.name}"}
                 for drawing, (dashes, colour) in zip(drawings, pairs, strict=False)]  # fmt: skip
        return looks, None
    (drawing,) = drawings
    label = (drawing.name if unnamed else drawing.label(largest)) if drawing.single else ""
    colours, scale = style.BLUE, None
    if not drawing.equally_tense:
        unit, factor = force_unit(drawing.tension.max())
        tension = factor * drawing.tension
        colour = ScalarMappable(Normalize(tension.min(), tension.max()), style.SHADES)
        colours, scale = colour.to_rgba(tension), (colour, f"mean tension of the cable [{unit}]")
    return [{"dashes": "-", "colours": colours, "own": None, "label": label, "lost": "lost"}], scale


def with_ground(flat, ground):
    """Places on the paper, shape (n, 2), with those of the ground below them, two arrays or None."""
    if ground is None:
        return flat
    x = np.unique(np.clip([-np.inf, *ground[0], np.inf], flat[:, 0].min(), flat[:, 0].max()))
    return np.concatenate([flat, np.stack([x, np.interp(x, *ground)], axis=-1)])


def room_in(axes, window, lines, width):
    """`Room` for texts beside lines on the paper, shape (n, 2), in axes of a width on paper. [in]"""
    return marks.Room(axes, window.width / width / np.array([1.0, window.factor]), lines)


def finish_view(axes, view, window, ground, ticks=8):
    """Limits, scale, names of the axes and ground of a view; in perspective a bar for its scale instead of axes."""
    window.apply(axes, ticks)
    marks.draw_ground(axes, ground)
    axes.set(xlabel=view.labels[0], ylabel=view.labels[1])
    scale = window.note("vertical scale" if view.axes[2, 1] else "scale across")  # seen from above
    axes.set_title(f"{view.title}, {scale}" if view.labels[0] else view.title, loc="left", color=style.GREY)
    if not view.labels[0]:
        axes.set_axis_off()
        marks.scale_bar(axes, 0.75 * window.width)


# -------------------------------------------------------------------------------------- the path of a load that travels


@style.styled
def load_path(path):
    """Figure of a load that travels along a cable: its path in a side view, and below it the largest tension.

    The side view shows the cable in some of the positions of a `LoadPath`.
    """
    first, positions = path.cables[0], np.stack([_numbers(path, name) for name in ("x_m", "y_m", "z_m")], axis=-1)
    clearance, tension = _numbers(path, "clearance_m"), _numbers(path, "max_tension_N")
    span = first.form.span
    view = view_from_end_1(first.end_1, direction(span.frame[0, :2] * span.chord, span.chord), first.scene.ground)
    forms, line = [view(form) for form in _forms(path.cables)], view(positions)
    all_points = np.concatenate([*forms, line[np.isfinite(line[:, 0])]])  # on the paper, shape (n, 2)
    ground = ground_in(view, first.scene.ground, all_points[:, 0])
    window = style.Window(*with_ground(all_points, ground).T, ENLARGED_RATIO)
    tall = 0.7 + window.ratio * PANEL_WIDTH
    largest, clearances = float(np.nanmax(tension)), clearance[np.isfinite(clearance)].tolist()
    title = f"{shortened(path.name)} from end to end: largest tension {force_text(largest)}"
    if ground is not None:
        title += f", least clearance {length_text(min(clearances, default=np.nan))}"
    figure = style.new_figure(tall + 2.6, title)
    side, below = figure.subplots(2, 1, height_ratios=(tall, 1.9))
    marks.draw_lines(side, forms, style.GREY, linewidths=0.7, alpha=0.7, label="the cable in some of the places")
    look = {"ls": "-", "marker": "." if len(line) <= MOST_DOTS else ""}
    side.plot(*line.T, **look, color=style.BLUE, lw=1.8, label=f"path of {shortened(path.name)}")
    finish_view(side, view, window, ground)
    if ground is not None and clearances:
        room = room_in(side, window, all_points, PANEL_WIDTH)
        marks.mark_clearance(side, room, line[np.isfinite(clearance)], ground, min(clearances))
    unit, factor = force_unit(largest)
    below.plot(line[:, 0], factor * tension, **look, color=style.RED)
    below.set(xlim=side.get_xlim(), xlabel="place of the load, horizontal distance from end 1 [m]")
    below.set_ylabel(f"largest\ntension [{unit}]")
    style.plain(below, 8, 5)
    style.legend_below(figure, style.entries_of(side))
    return figure


def _numbers(path, name):
    """A column of a `LoadPath`, NaN where it has none."""
    return np.array([np.nan if row.get(name) is None else row[name] for row in path.table.rows])


def _forms(cables):
    """Some cables that are drawn: list of positions, shape (j, 3). [m]"""
    chosen = np.unique(np.linspace(0, len(cables) - 1, DRAWN_FORMS + 2).round().astype(int))[1:-1]
    return [
        points_along(one.form, FORM_POINTS) + one.end_1 for one in [cables[number] for number in chosen] or cables[:1]
    ]
