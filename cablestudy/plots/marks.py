"""Parts of pictures of cables and bodies: curves, marks, dimensions, loads, ground, names."""

from dataclasses import dataclass, field

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.transforms import blended_transform_factory

from cablestudy.plots.style import BLUE, GREY, ORANGE, RED, nice, text_width
from cablestudy.plots.words import force_text, length_text, shortened

GROUND_COLOUR = "#8c7355"
MANY_MARKS = 50  # anchors or junctions from which they are small
NAMED_ANCHORS = 12  # anchors up to which each is named
NAMED_LOADS = 6  # the labels of more would overlap
LOST_OPACITY = 0.5  # opacity of lost cables
TEXT_BOX = {"boxstyle": "square,pad=0.05", "fc": "white", "ec": "none", "alpha": 0.75}  # behind a text over lines
ACROSS, UPRIGHT = ("center", "left", "right"), ("center", "bottom", "top")  # alignment of a text at side 0, 1, -1
CORNERS = ((1, -1), (1, 1), (-1, 1), (-1, -1))  # of a position where its name may stand, along x and y
BETWEEN = 0.03  # least distance of two texts, of which positions and sizes are not known to more [in]
DIMENSION = {"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0, "color": RED, "lw": 1}  # of a dimension
ABOUT_RING = (((0, 9), (0, 1)), ((0, -9), (0, -1)), ((9, 0), (1, 0)), ((-9, 0), (-1, 0)))  # offsets [pt] and sides
LOAD_ARROW = 26  # length of the arrow of a load [pt]


@dataclass
class Room:
    """Free room of a picture, in which texts and arrows are put so that they do not overlap.

    Positions and boxes, (left, right, low, high), are in the lengths of the scene. [m]
    """

    axes: object  # matplotlib.axes.Axes with its limits
    per_inch: np.ndarray  # shape (2,): length in the view along x and y over that on paper, about [m/in]
    lines: np.ndarray  # shape (n, 2): points along lines, which a text had better not cover
    taken: list = field(default_factory=list)  # boxes of the texts and arrows that are there already

    def write(self, text, spots, needed=True, fontsize=9, **look):
        """Write a text at one of several possible spots, the free one where it covers least of the lines: True if so.

        A spot has a position in the picture [m], the offset of the text from it [pt], and on which side of this point
        the text stands, along x and y: -1 left or below, 0 centred, 1 right or above. If no spot is free, a `needed`
        text stands at the first one.
        """
        size = np.array([text_width(text, fontsize) + 0.06, fontsize / 60]) * self.per_inch
        boxes = [self._box(point + np.array(offset) / 72 * self.per_inch, side, size) for point, offset, side in spots]
        free = [k for k, box in enumerate(boxes) if self._is_free(box)]
        if not free and not needed:
            return False
        best = min(free, key=lambda k: self._covered(boxes[k])) if free else 0
        point, offset, (side_x, side_y) = spots[best]
        self.taken.append(tuple(boxes[best] + BETWEEN * np.repeat(self.per_inch, 2) * [-1, 1, -1, 1]))
        self.axes.annotate(text, point, offset, textcoords="offset points", fontsize=fontsize, zorder=6, bbox=TEXT_BOX,
                           ha=ACROSS[side_x], va=UPRIGHT[side_y], **look)  # fmt: skip
        return True

    def reserve(self, start, end):
        """Take the room of an arrow between two positions on the paper: True if it was free."""
        low, high = np.minimum(start, end) - 0.04 * self.per_inch, np.maximum(start, end) + 0.04 * self.per_inch
        box = low[0], high[0], low[1], high[1]
        free = self._is_free(box)
        self.taken.append(box)
        return free

    @staticmethod
    def _box(corner, side, size):
        """Box of a text of a size that stands on some side of a corner, see `write`."""
        low = corner + (np.array(side) - 1) / 2 * size
        return low[0], low[0] + size[0], low[1], low[1] + size[1]

    def _is_free(self, box):
        """True if a box is within the axes and overlaps none that is taken."""
        (left, right), (low, high) = self.axes.get_xlim(), self.axes.get_ylim()
        outside = box[0] < left or box[1] > right or box[2] < low or box[3] > high
        return not outside and not any(_overlap(box, other) for other in self.taken)

    def _covered(self, box):
        """How many points of the lines are in a box."""
        x, y = self.lines.T
        return int(((box[0] < x) & (x < box[1]) & (box[2] < y) & (y < box[3])).sum())


def _overlap(box, other):
    """True if two boxes (left, right, low, high) overlap."""
    return box[0] < other[1] and other[0] < box[1] and box[2] < other[3] and other[2] < box[3]


def draw_parts(axes, drawing, view, colours, label="", lost="", dashes="-", own=None):
    """Draw a view of a `Drawing`: its cables in their colours, links, anchors, winches, points, bodies, markers.

    Parameters
    ----------
    view : callable
        Positions, shape (..., 3) -> coordinates on the paper, shape (..., 2).
    colours : color or list of color
        Colour of all cables, or of each.
    label, lost : str
        Entries of the legend for the cables, and for the cables that the load case has lost.
    own : color, optional
        Colour of links, points, bodies and loads of this load case, in a picture of several load cases.
    """
    draw_lines(axes, view(drawing.cables), colours, linestyles=[dashes], linewidths=1.4, label=label)
    of_links = {"linestyles": "--", "linewidths": 1.4, "label": "link" if own is None else ""}
    draw_lines(axes, view(drawing.links), own or ORANGE, **of_links)
    pale = (*to_rgb(own or GREY), LOST_OPACITY)
    draw_lines(axes, view(drawing.lost), pale, linestyles="--", linewidths=1.1, zorder=1.5, label=lost)
    draw_points(axes, view, [position for _, position in drawing.anchors], "^", color=GREY, ms=5, zorder=3)
    draw_points(axes, view, drawing.junctions.values(), "o", color=own or "#333333", ms=3, zorder=4)
    for positions in drawing.bodies.values():
        draw_body(axes, view(positions), own or "#222222", own or RED, 5 if own is None else 3, zorder=4)
    if own is None:
        draw_points(axes, view, drawing.markers, "x", color=ORANGE, ms=5, zorder=5)
        draw_points(axes, view, drawing.winches, "o", color=BLUE, ms=9, mfc="none", zorder=3, label="winch")
    else:
        draw_points(axes, view, [position for position, *_ in drawing.loads], "o", color=own, ms=4)


def draw_lines(axes, lines, colours, **look):
    """Draw curves on the paper, a sequence of arrays of shape (j, 2), if there are some."""
    if len(lines):
        axes.add_collection(LineCollection(list(lines), **{"colors": colours, "zorder": 2, **look}))


def draw_chords(axes, chords, mark=""):
    """Draw the chords of cables on the paper, shape (c, 2, 2), with marks at their ends."""
    draw_lines(axes, chords, GREY, linestyles="--", linewidths=0.9, zorder=1.8, label="chord")
    if mark:
        axes.plot(*chords.reshape(-1, 2).T, mark, color=GREY, ms=4)


def draw_points(axes, view, positions, mark, ms, **look):
    """Draw marks at positions in a view, small ones where they are many."""
    positions = np.array(list(positions)).reshape(-1, 3)
    if len(positions):
        axes.plot(*view(positions).T, mark, ms=ms if len(positions) < MANY_MARKS else 0.4 * ms, **look)


def draw_body(axes, flat, colour, mark, ms, zorder, lw=1.2):
    """Draw a body: a square at its reference point, the last of some positions, and arms from the others there."""
    arms = np.stack([flat[:-1], np.broadcast_to(flat[-1], flat[:-1].shape)], axis=1)
    draw_lines(axes, arms, colour, linewidths=lw, zorder=zorder)
    axes.plot(*flat[-1], "s", color=mark, ms=ms, zorder=zorder + 1)


def draw_ground(axes, ground):
    """Draw the ground in a view from the side, two arrays, if it is known."""
    if ground is not None:
        axes.plot(*ground, color=GROUND_COLOUR, lw=1.5, label="ground")
        axes.fill_between(*ground, axes.get_ylim()[0], color=GROUND_COLOUR, alpha=0.15, lw=0)


def mark_clearance(axes, room, line, ground, least):
    """Draw an arrow with the clearance [m] where a line, shape (j, 2), is nearest above the ground, two arrays."""
    level = np.interp(line[:, 0], *ground)
    nearest = int(np.argmin(line[:, 1] - level))
    low = line[nearest, 0], level[nearest]
    axes.annotate("", low, line[nearest], arrowprops=DIMENSION)
    # in the ground below the arrow, where the cable is not in its way
    spots = [(low, (0, -7), (side, -1)) for side in (0, 1, -1)]
    room.write(f"clearance {length_text(least)}", spots, color=RED)


def mark_sag(axes, room, middle, sag):
    """Draw the dimension of a sag below the middle of a chord, as in an engineering drawing, where there is room.

    Equal sags at one position have one dimension; one that would stand on the arrow of a load has none.
    """
    down = np.array([0.0, sag])
    if not room.reserve(middle - down, middle):
        return
    spots = [(middle - down / 2, (5 * side, 0), (side, 0)) for side in (1, -1)]
    spots += [(middle, (-4 * side, 3), (-side, 1)) for side in (1, -1)]
    if room.write(f"sag {length_text(sag)}", spots, needed=False, color=RED):
        axes.annotate("", middle - down, middle, arrowprops=DIMENSION)


def mark_loads(axes, room, loads, paper):
    """Draw the point loads: an arrow along each force, a ring with a dot or cross for one nearly normal to the paper.

    A dot is the point of an arrow towards the viewer, a cross the tail of an arrow away from the viewer. The sizes of
    the forces are written beside them.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    room : Room
    loads : list of (ndarray, ndarray)
        Position on the paper, shape (2,), and force [N], shape (3,).
    paper : ndarray, shape (3, 2)
        Directions to the right and upwards on the paper.
    """
    for point, force in loads:
        size = float(np.linalg.norm(force))
        on_paper = force @ paper / size
        if np.hypot(*on_paper) < 0.5:
            axes.plot(*point, "o", ms=9, mfc="white", mec=ORANGE, mew=1.5, zorder=4)
            axes.plot(*point, "." if force @ np.cross(*paper.T) > 0 else "x", ms=5, color=ORANGE, zorder=5)
            spots = [(point, (x, y), side) for (x, y), side in ABOUT_RING]
        else:
            x, y = -LOAD_ARROW * on_paper / np.hypot(*on_paper)  # from the tip to the tail of the arrow
            look = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "color": ORANGE, "lw": 1.6}
            axes.annotate("", point, (x, y), textcoords="offset points", arrowprops=look)
            room.reserve(point, point + np.array([x, y]) / 72 * room.per_inch)
            spots = [(point, (x + 6 * side, y), (side, 0)) for side in (1, -1)]
            spots += [(point, (x, y + up + 3), (0, 1)) for up in (0, 11)] if y > 0 else []
            spots += [(point, (x / 2 + 6 * side, y / 2), (side, 0)) for side in (1, -1)]  # beside the middle
        if len(loads) <= NAMED_LOADS:
            room.write(force_text(size), spots, needed=False)


def name_all(room, drawing, view):
    """Name bodies, and few anchors, where there is room beside cables; names at one position share a text."""
    bodies = [(name, view(positions[-1])) for name, positions in drawing.bodies.items()]
    anchors = [(name, view(position)) for name, position in drawing.anchors]
    for positions, size, colour in ((bodies, 8, RED), (anchors if len(anchors) <= NAMED_ANCHORS else (), 7, GREY)):
        shared = []
        for name, position in positions:
            near = (names for names, other in shared if (np.abs(other - position) < 0.05 * room.per_inch).all())
            names = next(near, None)
            if names is None:
                shared.append(([name], position))
            elif name not in names:
                names.append(name)
        for names, position in shared:
            spots = [(position, (5 * side, 3.6 * up), (side, up)) for side, up in CORNERS]
            spots += [(position, (0, 7 * up), (0, up)) for up in (-1, 1)]
            room.write(shortened(", ".join(names), 32), spots, needed=False, fontsize=size, color=colour)


def scale_bar(axes, size):
    """Draw a bar of a round length at the lower right, with that length, for a scene of a size. [m]"""
    length = nice(size / 5)
    mixed = blended_transform_factory(axes.transData, axes.transAxes)
    right = axes.get_xlim()[1]
    axes.plot([right - length, right], [0.03, 0.03], color="#222222", lw=2.2, transform=mixed, solid_capstyle="butt")
    axes.annotate(length_text(length), (right - length / 2, 0.03), (0, 2.5), mixed, "offset points",
                  ha="center", fontsize=7.5)  # fmt: skip
