"""A suspension in space: from above, from two sides, and in perspective."""

from dataclasses import dataclass

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from cablestudy.study.plots.style import GREY, ORANGE, RED, nice, styled
from cablestudy.study.table import short
from cablestudy.system.suspension import GROUND

POINTS = 61  # along a cable
AZIMUTH, ELEVATION, DISTANCE = np.radians(-58), np.radians(18), 3.0  # of the eye; distance over the size of the scene
COLOURS = "viridis"
SIZE = (9.5, 8.4)  # of a picture [in]
NAMED = 12  # anchors up to which each is named


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


@dataclass(frozen=True)
class Drawing:
    """Places of all that is drawn.

    Attributes
    ----------
    cables : ndarray, shape (c, j, 3)
        Points along each cable. [m]
    tension : ndarray, shape (c,)
        Mean tension. [N]
    anchors : dict
        Name -> place of a fixed end, shape (3,). [m]
    junctions, bodies : dict
        Name -> place; name -> places of its attachments and its reference point, shape (k, 3). [m]
    markers : ndarray, shape (m, 3)
        [m]
    """

    cables: np.ndarray
    tension: np.ndarray
    anchors: dict
    junctions: dict
    bodies: dict
    markers: np.ndarray

    @property
    def places(self):
        """All of them, shape (n, 3)."""
        return np.concatenate([self.cables.reshape(-1, 3), *self.bodies.values(), self.markers])


def drawing_of(case):
    """`Drawing` of a case in equilibrium."""
    scene, found = case.scene, case.equilibrium
    suspension, span = found.suspension, found.catenary.span
    ends = suspension.ends(found.position, found.rotation)
    share = np.linspace(0.0, 1.0, POINTS)
    displacement, _ = found.catenary.at(np.broadcast_to(share, (len(ends), POINTS)))
    straight = np.outer(1 + span.chord_strain, share)[..., None] * np.array([1.0, 0.0, 0.0])
    local = (displacement + straight) * span.unstretched_length[:, None, None]
    cables = ends[:, None, 0] + (local[..., None] * span.frame[:, None]).sum(axis=-2)
    anchors = {}
    for name, cable, owner, pair in zip(scene.cables, scene.cables.values(), suspension.owner, ends, strict=True):
        for word, own, place in zip(cable.ends, owner, pair, strict=True):
            if own == GROUND:
                anchors[word if isinstance(word, str) else name] = place
    count, markers, bodies = suspension.bodies, [], {}
    for place, name in enumerate(suspension.body_names[:count]):
        body = scene.bodies[name]
        turned = np.array([*body.attachments.values(), (0.0, 0.0, 0.0)]) @ found.rotation[place].T
        bodies[name] = found.position[place] + turned
        if body.markers:
            markers.append(found.position[place] + np.array(list(body.markers.values())) @ found.rotation[place].T)
    junctions = dict(zip(suspension.body_names[count:], found.position[count:], strict=True))
    whole = np.concatenate(markers) if markers else np.zeros((0, 3))
    return Drawing(cables, np.asarray(found.catenary.mean_tension), anchors, junctions, bodies, whole)


@styled
def suspension_views(case):
    """Draws a suspension from above, from the front, from the side and in perspective, all to one scale.

    Parameters
    ----------
    case : SuspensionCase
        With a stable equilibrium.

    Returns
    -------
    matplotlib.figure.Figure
    """
    drawing = drawing_of(case)
    low, high = drawing.places.min(axis=0), drawing.places.max(axis=0)
    size = float(np.linalg.norm(high - low))
    figure = Figure(figsize=SIZE, layout="constrained")
    grid = figure.subplots(2, 2).ravel()
    colour = ScalarMappable(Normalize(*_range(drawing.tension)), COLOURS)
    views = (
        ("perspective", Perspective((low + high) / 2, size), ("", "")),
        ("from above", from_above, ("x [m]", "y [m]")),
        ("from the front", from_front, ("x [m]", "z [m]")),
        ("from the side", from_side, ("y [m]", "z [m]")),
    )
    limits = [_limits(view(drawing.places)) for _, view, _ in views]
    half = 0.58 * max((high - low).max() for low, high in limits)
    for axes, (title, view, labels), (low, high) in zip(grid, views, limits, strict=True):
        _draw(axes, drawing, view, colour)
        x, y = (low + high) / 2
        axes.set(xlim=(x - half, x + half), ylim=(y - half, y + half))
        axes.set_title(title, loc="left", weight="bold")
        axes.set(xlabel=labels[0], ylabel=labels[1])
        axes.set_aspect("equal", adjustable="box")
        if not labels[0]:
            axes.set_axis_off()
        scale_bar(axes, size)
    figure.colorbar(colour, ax=grid.tolist(), shrink=0.6, aspect=35, label="mean tension of the cable [N]")
    return figure


def _limits(flat):
    """Least and largest coordinates of places on the paper, shape (n, 2)."""
    return flat.min(axis=0), flat.max(axis=0)


def _range(tension):
    """Least and largest tension; from zero where they are equal but for a thousandth."""
    low, high = float(tension.min()), float(tension.max())
    return (low, high) if high > low * (1 + 1e-3) else (0.0, high or 1.0)


def _draw(axes, drawing, view, colour):
    lines = LineCollection(view(drawing.cables), colors=colour.to_rgba(drawing.tension), linewidths=1.4, zorder=2)
    axes.add_collection(lines)
    if drawing.anchors:
        x, y = view(np.array(list(drawing.anchors.values()))).T
        axes.plot(x, y, "^", color=GREY, ms=5, zorder=3)
    if 0 < len(drawing.anchors) <= NAMED:
        for name, place in drawing.anchors.items():
            axes.annotate(name, view(place), (4, 3), textcoords="offset points", fontsize=7, color=GREY)
    if drawing.junctions:
        x, y = view(np.array(list(drawing.junctions.values()))).T
        axes.plot(x, y, "o", color="#333333", ms=3 if len(x) < 50 else 1.2, zorder=4)
    for name, places in drawing.bodies.items():
        flat = view(places)
        arms = np.stack([flat[:-1], np.broadcast_to(flat[-1], flat[:-1].shape)], axis=1)
        axes.add_collection(LineCollection(arms, colors="#222222", linewidths=1.2, zorder=4))
        axes.plot(*flat[-1], "s", color=RED, ms=5, zorder=5)
        axes.annotate(name, flat[-1], (6, -9), textcoords="offset points", fontsize=8, color=RED)
    if len(drawing.markers):
        x, y = view(drawing.markers).T
        axes.plot(x, y, "x", color=ORANGE, ms=5, zorder=5)


def scale_bar(axes, size):
    """A bar of a round length at the lower right, with that length."""
    from matplotlib.transforms import blended_transform_factory

    length = nice(size / 5)
    place = blended_transform_factory(axes.transData, axes.transAxes)
    right = axes.get_xlim()[1]
    axes.plot([right - length, right], [0.03, 0.03], color="#222222", lw=2.2, transform=place, solid_capstyle="butt")
    axes.text(right - length / 2, 0.05, f"{short(length)} m", transform=place, ha="center", fontsize=7.5)
