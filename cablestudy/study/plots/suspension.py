"""A suspension in space: from above, from two sides, and in perspective."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.transforms import blended_transform_factory

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.scene.words import counted
from cablestudy.study.plots.style import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    SHADES,
    WIDTH,
    bold,
    colour_bar,
    heading,
    legend_below,
    nice,
    plain,
    text_width,
)
from cablestudy.study.plots.words import quantity_text, shortened
from cablestudy.system.suspension import GROUND

POINTS = 61  # along a cable
AZIMUTH, ELEVATION, DISTANCE = np.radians(-58), np.radians(18), 3.0  # of the eye; distance over the size of the scene
SIZE = (WIDTH, 7.0)  # of a picture [in]
LOW = 4.0  # height of a picture below which its scale is as high as that [in]
PANEL = 2.5  # width of a view, about [in]
MANY = 50  # anchors or junctions from which they are small
NAMED = 12  # anchors up to which each is named
CORNERS = ((1, -1), (1, 1), (-1, 1), (-1, -1))  # of a place where its name may stand, along x and y
PALE = 0.5  # opacity of lost cables
KILO = 1e4  # tension from which a scale is in kN [N]
NAME_GAP = np.array([0.07, 0.05])  # distance of a name from its place along x and y [in]
CLEAR = {"boxstyle": "square,pad=0.05", "fc": "white", "ec": "none", "alpha": 0.7}  # behind a name over cables
BAR_ROOM = 0.12  # height of the corner with the scale over that of the view; it is twice as wide


def from_above(places):
    """Horizontal and vertical coordinate of the paper for places, shape (..., 3) -> (..., 2)."""
    return places[..., :2]


def from_front(places):
    return places[..., [0, 2]]


def from_side(places):
    return places[..., [1, 2]]


@dataclass(frozen=True)
class Perspective:
    """Central projection on a plane through the centre of the scene.

    Attributes
    ----------
    centre : ndarray, shape (3,)
        [m]
    size : float
        Of the scene. [m]
    """

    centre: np.ndarray
    size: float

    def __call__(self, places):
        right = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
        towards = np.array(
            [np.cos(AZIMUTH) * np.cos(ELEVATION), np.sin(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION)]
        )
        axes = np.stack([right, np.cross(towards, right)], axis=-1)
        apart = places - self.centre
        distance = DISTANCE * self.size
        return apart @ axes * (distance / (distance - apart @ towards))[..., None]


NO_CABLES = np.zeros((0, POINTS, 3))


@dataclass(frozen=True)
class Drawing:
    """Places of all that is drawn.

    Attributes
    ----------
    cables : ndarray, shape (c, j, 3)
        Points along each cable. [m]
    links : ndarray, shape (l, 2, 3)
        Ends of each link. [m]
    tension : ndarray, shape (c,)
        Mean tension. [N]
    anchors : dict
        Name -> place of a fixed end, shape (3,). [m]
    junctions, bodies : dict
        Name -> place; name -> places of its attachments and its reference point, shape (k, 3). [m]
    markers : ndarray, shape (m, 3)
        [m]
    lost : ndarray, shape (k, j, 3)
        Points along each cable that the load case lacks, where it would be with all cables. [m]
    """

    cables: np.ndarray
    links: np.ndarray
    tension: np.ndarray
    anchors: dict
    junctions: dict
    bodies: dict
    markers: np.ndarray
    lost: np.ndarray = field(default_factory=lambda: NO_CABLES)

    @property
    def places(self):
        """All of them, shape (n, 3)."""
        lines = (part.reshape(-1, 3) for part in (self.cables, self.lost, self.links))
        return np.concatenate([*lines, *self.bodies.values(), self.markers])

    @cached_property
    def size(self):
        """Diagonal of the box that holds them. [m]"""
        return float(np.linalg.norm(np.ptp(self.places, axis=0)))

    @property
    def perspective(self):
        """`Perspective` about the centre of that box."""
        return Perspective((self.places.min(axis=0) + self.places.max(axis=0)) / 2, self.size)


def drawing_of(case):
    """`Drawing` of a case in equilibrium."""
    scene, found = case.scene, case.equilibrium
    suspension, links = found.suspension, found.ends[len(found.suspension.cable_names) :]
    anchors = {}
    for (name, one), owner, pair in zip(scene.lines.items(), suspension.owner, found.ends, strict=True):
        for word, own, place in zip(one.ends, owner, pair, strict=True):
            if own == GROUND:
                anchors[word if isinstance(word, str) else name] = place
    count, markers, bodies = suspension.bodies, [], {}
    for place, name in enumerate(suspension.body_names[:count]):
        body = scene.bodies[name]
        bodies[name] = found.position[place] + _places_of_body(body) @ found.rotation[place].T
        if body.markers:
            markers.append(found.position[place] + np.array(list(body.markers.values())) @ found.rotation[place].T)
    junctions = dict(zip(suspension.body_names[count:], found.position[count:], strict=True))
    whole = np.concatenate(markers) if markers else np.zeros((0, 3))
    return Drawing(_curves(found), links, np.asarray(found.catenary.mean_tension), anchors, junctions, bodies, whole)


def _places_of_body(body):
    """Places that show where a `Body` is, body axes, shape (k, 3): its attachments, its reference point last. [m]"""
    return np.array([*body.attachments.values(), (0.0, 0.0, 0.0)])


def _curves(found):
    """Points along each cable of an `Equilibrium` of one case, shape (c, POINTS, 3). [m]"""
    span, ends, share = found.catenary.span, found.ends[found.suspension.of_cables], np.linspace(0.0, 1.0, POINTS)
    displacement, _ = found.catenary.at(np.broadcast_to(share, (len(ends), POINTS)))
    straight = np.outer(1 + span.chord_strain, share)[..., None] * np.array([1.0, 0.0, 0.0])
    local = (displacement + straight) * span.unstretched_length[:, None, None]
    return ends[:, None, 0] + (local[..., None] * span.frame[:, None]).sum(axis=-2)


def drawing_with_lost(case):
    """`Drawing` of a case in equilibrium, with the cables that it has lost where it stands with all cables."""
    drawing, lost = drawing_of(case), case.scene.load_case.lost
    if not lost:
        return drawing
    try:
        found = case.unbroken.equilibrium
    except (NoSolutionError, ConvergenceError):  # nowhere to draw them
        return drawing
    return replace(drawing, lost=_curves(found)[[found.suspension.cable_names.index(name) for name in lost]])


def tension_colours(drawing, case):
    """The colours of the cables by their mean tension, whose scale a figure has where they differ.

    Parameters
    ----------
    drawing : Drawing
    case : str or None
        Name of the load case.

    Returns
    -------
    colours : list
        Of each cable.
    title : str
        Load case, number of cables, and their tension where it is equal in all.
    scale : tuple of (ScalarMappable, str) or None
        And what it shows.
    """
    count, title = len(drawing.cables), f"Load case {shortened(case)}" if case else "Static form"
    if not count:
        return [], title, None
    title = f"{title}: {counted(count, 'cable')}"
    least, most = float(drawing.tension.min()), float(drawing.tension.max())
    if most <= least * (1 + 1e-3):
        return [BLUE] * count, f"{title}, mean tension {quantity_text(most, 'N')}{' each' * (count != 1)}", None
    unit, size = ("kN", 1e-3) if most >= KILO else ("N", 1.0)
    colour = ScalarMappable(Normalize(size * least, size * most), SHADES)
    return colour.to_rgba(size * drawing.tension), title, (colour, f"mean tension of the cable [{unit}]")


def entitle(figure, title, scale):
    """Write the heading of a picture, and draw the scale that `tension_colours` gives, or none."""
    heading(figure, title)
    if scale is not None:
        low = figure.get_figheight() < LOW
        colour_bar(figure, *scale, figure.axes, shrink=1.0 if low else 0.6, aspect=20 if low else 35)


def views_in_space(drawing, case):
    """Figure of a suspension in perspective, from above, from the front and from the side, all to one scale.

    Parameters
    ----------
    drawing : Drawing
    case : str or None
        Name of the load case.
    """
    figure = Figure(figsize=SIZE, layout="constrained")
    grid = figure.subplots(2, 2).ravel()
    colours, heading_of_all, scale = tension_colours(drawing, case)
    views = (
        ("perspective", drawing.perspective, ("", "")),
        ("from above", from_above, ("x [m]", "y [m]")),
        ("from the front", from_front, ("x [m]", "z [m]")),
        ("from the side", from_side, ("y [m]", "z [m]")),
    )
    limits = [_limits(view(drawing.places)) for _, view, _ in views]
    half = 0.64 * max((high - low).max() for low, high in limits)
    for axes, (title, view, labels), (low, high) in zip(grid, views, limits, strict=True):
        x, y = (low + high) / 2
        axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half))
        draw_parts(axes, drawing, view, colours)
        name_all(axes, drawing, view, np.full(2, 2 * half / PANEL))
        axes.set_title(title.capitalize(), loc="left", **bold(title))
        axes.set(xlabel=labels[0], ylabel=labels[1])
        axes.set_aspect("equal", adjustable="box")
        plain(axes, 5, 5)
        if not labels[0]:
            axes.set_axis_off()
        scale_bar(axes, drawing.size)
    if len(drawing.lost):
        legend_below(figure, [(draw_lost(axes, NO_CABLES[..., :2], GREY), "lost")])
    entitle(figure, heading_of_all, scale)
    return figure


def _limits(flat):
    """Least and largest coordinates of places on the paper, shape (n, 2)."""
    return flat.min(axis=0), flat.max(axis=0)


def draw_parts(axes, drawing, view, colours, lost="", dashes="-", own=None):
    """Draw a view of a suspension: its cables in their colours, anchors, points, bodies, markers.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    drawing : Drawing
    view : callable
        Places, shape (..., 3) -> coordinates on the paper, shape (..., 2).
    colours : color or list of color
        Of the cables.
    lost : str
        Label of the cables that are lost.
    dashes : str or tuple
        Of the cables.
    own : color, optional
        Of points and bodies too, where several load cases are in one picture.
    """
    axes.add_collection(
        LineCollection(view(drawing.cables), colors=colours, linestyles=[dashes], linewidths=1.4, zorder=2)
    )
    draw_links(axes, view(drawing.links))
    if len(drawing.lost):
        draw_lost(axes, view(drawing.lost), own or GREY).set_label(lost)
    if drawing.anchors:
        x, y = view(np.array(list(drawing.anchors.values()))).T
        axes.plot(x, y, "^", color=GREY, ms=5 if len(x) < MANY else 2, zorder=3)
    if drawing.junctions:
        x, y = view(np.array(list(drawing.junctions.values()))).T
        axes.plot(x, y, "o", color=own or "#333333", ms=3 if len(x) < MANY else 1.2, zorder=4)
    for places in drawing.bodies.values():
        arms = {"colors": own or "#222222", "linewidths": 1.2, "zorder": 4}
        draw_body(axes, view(places), arms, {"color": own or RED, "ms": 5 if own is None else 3, "zorder": 5})
    if len(drawing.markers) and own is None:
        x, y = view(drawing.markers).T
        axes.plot(x, y, "x", color=ORANGE, ms=5, zorder=5)


def draw_links(axes, flat):
    """Dashed lines between the ends of links on the paper, shape (l, 2, 2)."""
    if len(flat):
        axes.add_collection(LineCollection(flat, colors=ORANGE, linestyles="--", linewidths=1.4, zorder=2))


def draw_lost(axes, flat, colour):
    """Pale dashed lines of cables that are lost on the paper, shape (k, j, 2): LineCollection."""
    look = {"colors": [(*to_rgb(colour), PALE)], "linestyles": "--", "linewidths": 1.1, "zorder": 1.5}
    return axes.add_collection(LineCollection(flat, **look))


def draw_body(axes, flat, arms, mark):
    """Draw a body at rest or displaced: a square at its reference point, and arms from there to its attachments.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    flat : ndarray, shape (k, 2)
        Its places of a `Drawing` on the paper, the reference point last.
    arms, mark : dict
        Properties of the lines, a LineCollection, and of the square, a Line2D.
    """
    lines = np.stack([flat[:-1], np.broadcast_to(flat[-1], flat[:-1].shape)], axis=1)
    axes.add_collection(LineCollection(lines, **arms))
    axes.plot(*flat[-1], "s", **mark)


def name_all(axes, drawing, view, per_inch):
    """Names bodies, and anchors if they are few, where there is room beside cables; names at one place share a text.

    Parameters
    ----------
    per_inch : ndarray, shape (2,)
        Length in the view along x and y over that on paper, about. [m/in]
    """
    bodies = {name: view(places[-1]) for name, places in drawing.bodies.items()}
    anchors = {name: view(place) for name, place in drawing.anchors.items()} if len(drawing.anchors) <= NAMED else {}
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    scale = right - (right - left) * 2 * BAR_ROOM, right, low, low + (high - low) * BAR_ROOM
    room = _Room((left, right, low, high), [scale], view(drawing.cables).reshape(-1, 2), per_inch)
    for places, size, colour in ((bodies, 8, RED), (anchors, 7, GREY)):
        for names, place in _at_one_place(places, 0.05 * per_inch):
            text = shortened(", ".join(names), 32)
            corner = room.corner_for(place, text, size)
            if corner is None:
                continue
            side, up = corner
            look = {"ha": "left" if side > 0 else "right", "va": "bottom" if up > 0 else "top"}
            axes.annotate(text, place, (5 * side, 3.6 * up), textcoords="offset points", fontsize=size,
                          color=colour, zorder=6, bbox=CLEAR, **look)  # fmt: skip


@dataclass
class _Room:
    """What room a view has for names. Boxes are (left, right, low, high). [m]

    Attributes
    ----------
    limits : tuple of float
        Box of the view.
    taken : list of (tuple of float)
        Boxes of what stands there: the scale, and names.
    cables : ndarray, shape (n, 2)
        Points along the cables, which a name had better not cover.
    per_inch : ndarray, shape (2,)
        Length in the view along x and y over that on paper, about. [m/in]
    """

    limits: tuple
    taken: list
    cables: np.ndarray
    per_inch: np.ndarray

    def corner_for(self, place, text, size):
        """The corner of a place where a text covers least of the cables, +-1 along x and y, which is then taken.

        None if there is no room.
        """
        extent = np.array([text_width(text, size) + 0.03, size / 60]) * self.per_inch
        free = [(corner, box) for corner in CORNERS if self._is_free(box := self._box(place, corner, extent))]
        if not free:
            return None
        corner, box = min(free, key=lambda one: _inside(one[1], self.cables))
        self.taken.append(box)
        return corner

    def _box(self, place, corner, extent):
        """Box of a text at a corner of a place."""
        (side, up), (width, height) = corner, extent
        x, y = place + corner * NAME_GAP * self.per_inch
        left, low = x - (width if side < 0 else 0), y - (height if up < 0 else 0)
        return left, left + width, low, low + height

    def _is_free(self, box):
        left, right, low, high = self.limits
        outside = box[0] < left or box[1] > right or box[2] < low or box[3] > high
        return not (outside or any(_overlap(box, other) for other in self.taken))


def _at_one_place(places, near):
    """Names of places in a view that are not told apart there: list of (names, place)."""
    found = []
    for name, place in places.items():
        same = next((names for names, other in found if (np.abs(other - place) < near).all()), None)
        if same is None:
            found.append(([name], place))
        else:
            same.append(name)
    return found


def _inside(box, places):
    """How many places, shape (n, 2), are in a box (left, right, low, high)."""
    x, y = places.T
    return int(((box[0] < x) & (x < box[1]) & (box[2] < y) & (y < box[3])).sum())


def _overlap(box, other):
    """Whether two boxes (left, right, low, high) overlap."""
    return box[0] < other[1] and other[0] < box[1] and box[2] < other[3] and other[2] < box[3]


def scale_bar(axes, size):
    """A bar of a round length at the lower right, with that length."""
    length = nice(size / 5)
    place = blended_transform_factory(axes.transData, axes.transAxes)
    right = axes.get_xlim()[1]
    axes.plot([right - length, right], [0.03, 0.03], color="#222222", lw=2.2, transform=place, solid_capstyle="butt")
    axes.annotate(quantity_text(length, "m"), (right - length / 2, 0.03), (0, 2.5), place, "offset points",
                  ha="center", fontsize=7.5)  # fmt: skip
