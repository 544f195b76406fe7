"""Coupled modes of a suspension beside its static form, in perspective."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from cablestudy.scene.determinacy import ROTATIONS
from cablestudy.study.plots.deflection import between_nodes
from cablestudy.study.plots.modes import PANELS, columns_of, how_many, no_mode
from cablestudy.study.plots.style import BLUE, GREEN, GREY, RED, WIDTH, bold, heading, nice, styled
from cablestudy.study.plots.suspension import draw_body, drawing_of, scale_bar
from cablestudy.study.plots.words import quantity_text, shortened
from cablestudy.system.suspension import GROUND

COLOURS = {"bodies": RED, "points": GREEN, "cables": BLUE}
STILL = "#b4b4b4"
PEAK = 0.08  # largest displacement drawn over the size of the suspension
TURN = 0.6  # largest rotation drawn [rad]
FULL = 0.25  # share of the largest displacement from which a place has its full colour
POINTS = 80  # along a cable, about
SMALL = 0.08  # size of a body over that of the suspension, below which its rotation is drawn enlarged
MANY = 100  # cables from which lines are thin
TALL = 1.8  # height over width of the tallest panel
ENLARGED = 0.27  # side of the picture of the enlarged body over the width of its panel
NAME = 0.07  # room for its name above that over the width of its panel


@dataclass(frozen=True)
class Displaced:
    """One mode: all that is drawn of it, without scale.

    Attributes
    ----------
    cables : list of (ndarray, ndarray)
        Places along each cable and link and their displacements, shape (j, 3).
    bodies : dict
        Name -> places of attachments and reference point, and their displacements, shape (k, 3).
    points : tuple of ndarray
        Places of the free points and their displacements, shape (p, 3).
    turn : float
        Largest rotation of a body.
    kind : {"bodies", "points", "cables"}
        What has the largest share of the kinetic energy.
    body : str or None
        The body of which that is, where it turns.
    """

    cables: list
    bodies: dict
    points: tuple
    turn: float
    kind: str
    body: str | None

    @cached_property
    def largest(self):
        """Largest displacement."""
        parts = [*self.cables, *self.bodies.values(), self.points]
        return max(float(np.linalg.norm(moved, axis=-1).max(initial=0.0)) for _, moved in parts)

    def factor(self, peak):
        """Factor to a largest displacement [m], or to a smaller one where a body would turn too far."""
        return min(peak / self.largest, TURN / self.turn if self.turn else np.inf)

    def colours(self, *moved):
        """Colours of places that are displaced so far: of what moves, grey where they hardly move."""
        share = np.clip(np.linalg.norm(moved, axis=-1).mean(axis=0) / self.largest / FULL, 0, 1)[..., None]
        return share * to_rgb(COLOURS[self.kind]) + (1 - share) * to_rgb(STILL)


def displaced(case, modes, drawing, number):
    """`Displaced` of a mode (from 0) of `CoupledModes`."""
    equilibrium = case.equilibrium
    suspension = equilibrium.suspension
    starts = equilibrium.ends[suspension.of_cables, 0]
    cables = []
    for start, mesh, nodal in zip(starts, modes.solution.models.meshes, modes.nodes(number), strict=True):
        both = np.stack(nodal)
        if mesh is not None:
            both = np.moveaxis(between_nodes(mesh, np.moveaxis(both, 0, 1))[1], 1, 0)
            step = max(1, (both.shape[1] - 1) // POINTS)
            both = np.concatenate([both[:, :-1:step], both[:, -1:]], axis=1)
        cables.append((start + both[0], both[1]))
    motion = np.zeros(6 * len(suspension.body_names))
    motion[modes.layout.free] = modes.layout.bodies(modes.shapes[:, number])
    motion, count = motion.reshape(-1, 6), suspension.bodies
    own = slice(len(cables), None)
    still, arms = (suspension.owner[own] == GROUND)[..., None], equilibrium.arms[own]
    moved = motion[suspension.owner[own]]
    moved = np.where(still, 0.0, moved[..., :3] + np.cross(moved[..., 3:], arms))
    cables += zip(equilibrium.ends[own], moved, strict=True)
    bodies = {}
    for (name, places), moved, at in zip(drawing.bodies.items(), motion, equilibrium.position, strict=False):
        bodies[name] = places, moved[:3] + np.cross(moved[3:], places - at)
    what = modes.moves[number].split(" ")
    kind = "cables"
    if what[0] in suspension.body_names or what[0] == "points":
        kind = "bodies" if what[0] in drawing.bodies else "points"
    turns = np.linalg.norm(motion[:count, 3:], axis=-1)
    body = what[0] if kind == "bodies" and what[-1] in ROTATIONS else None
    points = equilibrium.position[count:], motion[count:, :3]
    return Displaced(cables, bodies, points, float(turns.max(initial=0.0)), kind, body)


@styled
def suspension_modes(case, modes, listed=None, share=None):
    """Draws the first modes of a suspension, each displaced beside the static form, in perspective.

    Parameters
    ----------
    case : SuspensionCase
        With a stable equilibrium.
    modes : CoupledModes
    listed : int, optional
        How many of them are asked for. Default: all.
    share : float, optional
        Displacement over the largest one, from -1 to 1, of a picture in a row of them that are of equal size.

    Returns
    -------
    matplotlib.figure.Figure
    """
    listed = len(modes) if listed is None else listed
    count = min(listed, PANELS)
    if not count:
        return no_mode()
    drawing = drawing_of(case)
    view, peak = drawing.perspective, nice(PEAK * drawing.size)
    shown = [displaced(case, modes, drawing, k) for k in range(count)]
    flat = [_outline(view, one, one.factor(peak)) for one in shown]
    if share is not None:
        flat += [_outline(view, one, -one.factor(peak)) for one in shown]
    small = [one.body and np.ptp(drawing.bodies[one.body], axis=0).max() < SMALL * drawing.size for one in shown]
    (middle, half), side = _limits(np.concatenate([view(drawing.places), *flat]), any(small))
    columns = columns_of(count)
    tall, rows = half[1] / half[0], -(-count // columns)
    width = WIDTH / columns
    figure = Figure(figsize=(columns * width, rows * (width * tall + 0.35) + 0.4), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.1)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid:
        axes.set_axis_off()
    for k, (axes, one, enlarged) in enumerate(zip(grid, shown, small, strict=False)):
        axes.set(xlim=middle[0] + half[0] * np.array([-1, 1]), ylim=middle[1] + half[1] * np.array([-1, 1]))
        axes.set_aspect("equal", adjustable="box")
        factor, reached = one.factor(peak), 1.0 if share is None else share
        _draw(axes, drawing, view, one, reached * factor)
        _name(axes, modes, k, one, factor)
        scale_bar(axes, drawing.size)
        if enlarged:
            _enlarge(axes, view, one, factor, side, reached)
    heading(figure, f"{how_many(count, listed)} beside the static form (grey), displacements enlarged")
    return figure


def _limits(flat, enlarged):
    """Middle and half the size of a panel of places on the paper, shape (n, 2), and the side of an `enlarged` body."""
    low, high = flat.min(axis=0), flat.max(axis=0)
    across, up = high - low
    side = ENLARGED * max(across, up / TALL)
    below = side * (1 + NAME / ENLARGED) if enlarged else 0.0  # room for enlarged bodies, and for the scale
    low[1] -= max(below, 0.16 * max(up, 0.3 * across))
    middle, half = (low + high) / 2, 0.53 * (high - low)
    return (middle, np.maximum(half, [half[1] / TALL, 0.4 * half[0]])), side


def _outline(view, one, factor):
    """Displaced places on the paper, shape (n, 2)."""
    parts = [*one.cables, *one.bodies.values(), one.points]
    return view(np.concatenate([places + factor * moved for places, moved in parts]))


def _name(axes, modes, k, one, factor):
    """Number, frequency, what moves, and the largest displacement drawn."""
    title = f"{k + 1}   {quantity_text(modes.frequency[k], 'Hz')}"
    axes.set_title(title, loc="left", **bold(title))
    axes.set_title(shortened(modes.moves[k], 24), loc="right", fontsize=7.5, color=COLOURS[one.kind])
    peak = f"largest displacement {quantity_text(float(f'{factor * one.largest:.2g}'), 'm')}"
    axes.text(0.99, -0.02, peak, transform=axes.transAxes, ha="right", va="top", fontsize=7, color=GREY)


def _draw(axes, drawing, view, one, factor):
    """The static form, and the displaced suspension over it in the colour of what moves, where it does."""
    width = 1.3 if len(one.cables) < MANY else 0.5
    still = [view(places) for places, _ in one.cables]
    axes.add_collection(LineCollection(still, colors=STILL, linewidths=0.6 * width))
    for places, moved in one.cables:
        line = view(places + factor * moved)
        ends = np.minimum(np.arange(2, len(line) + 1), len(line) - 1)  # overlapping pieces have no gaps
        pieces = np.stack([line[:-1], line[1:], line[ends]], axis=1)
        colours = one.colours(moved[:-1], moved[1:])
        axes.add_collection(LineCollection(pieces, colors=colours, linewidths=width, zorder=3))
    if drawing.anchors:
        mark = 4 if len(one.cables) < MANY else 2
        axes.plot(*view(np.array(list(drawing.anchors.values()))).T, "^", color=GREY, ms=mark, zorder=4)
    places, moved = one.points
    if len(places):
        mark = 3 if len(one.cables) < MANY else 0.8
        axes.plot(*view(places).T, "o", color=STILL, ms=mark, zorder=2)
        axes.scatter(*view(places + factor * moved).T, s=mark**2, c=one.colours(moved), zorder=5)
    for places, moved in one.bodies.values():
        _draw_body(axes, view(places), STILL, 2)
        colour = one.colours(moved[np.linalg.norm(moved, axis=-1).argmax()])
        _draw_body(axes, view(places + factor * moved), colour, 6)


def _draw_body(axes, flat, colour, zorder):
    """Draw a body in one colour; parameters as of `draw_body`."""
    arms = {"colors": colour, "linewidths": 1.6, "zorder": zorder}
    draw_body(axes, flat, arms, {"color": colour, "ms": 4, "zorder": zorder})


def _enlarge(axes, view, one, factor, side, share):
    """A body that turns, enlarged in a square below the suspension, with the ends of its cables.

    Parameters
    ----------
    side : float
        Of the square. [m]
    share : float
        Displacement over the largest one, which `factor` enlarges.
    """
    places, moved = one.bodies[one.body]
    radius = float(np.linalg.norm(places - places[-1], axis=-1).max())
    factor = share * min(factor, radius / float(np.linalg.norm(moved, axis=-1).max()))
    inset = axes.inset_axes((axes.get_xlim()[0], axes.get_ylim()[0], side, side), transform=axes.transData)
    centre = view(places[-1])
    inset.set(xlim=centre[0] + 1.7 * radius * np.array([-1, 1]), ylim=centre[1] + 1.7 * radius * np.array([-1, 1]))
    inset.set(xticks=[], yticks=[])
    inset.spines[:].set(visible=True, color=STILL, linewidth=0.6)
    colour = COLOURS[one.kind]
    for scale, look, zorder in ((0.0, STILL, 2), (factor, colour, 3)):
        lines = [view(line + scale * shift) for line, shift in one.cables]
        inset.add_collection(LineCollection(lines, colors=look, linewidths=0.7, zorder=zorder))
        _draw_body(inset, view(places + scale * moved), look, zorder)
    inset.set_title(shortened(one.body, 16), fontsize=7, color=colour, pad=2)
