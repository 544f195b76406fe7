"""Pictures of mode shapes on the static form, at rest or in motion: of one cable between fixed ends or a suspension."""

import base64
import io
import os
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from matplotlib.colors import to_rgb

import cablestudy.plots.style as style
from cablestudy.plots.deflection import interpolate_elements
from cablestudy.plots.drawing import FLAT, View, drawing_of, upright_plane
from cablestudy.plots.marks import draw_body, draw_lines, draw_points, scale_bar
from cablestudy.plots.words import length_text, quantity_text, shortened
from cablestudy.scene.determinacy import ROTATIONS
from cablestudy.scene.words import counted
from cablestudy.statics.suspension import GROUND
from cablestudy.study.table import write_whole

# of one cable: kind of mode -> colour, words for what is drawn upwards, its axis (1: across the chord, 2: sideways)
KINDS = {
    "in-plane": (style.BLUE, "distance above the chord", 1),
    "out-of-plane": (style.RED, "sideways", 2),
    "axial": (style.GREEN, "movement along the cable", 1),
}
COLOURS = {"bodies": style.RED, "points": style.GREEN, "cables": style.BLUE}
STILL = "#b0b0b0"
PAPER_PEAK = 0.1  # largest displacement of one cable that is drawn, as in the paper's Fig. 5 [m]
PEAK_OVER_SIZE = 0.08  # largest displacement of a suspension that is drawn, over the size of the scene
LARGEST_TURN = 0.6  # largest rotation drawn [rad]
FULL_COLOUR = 0.25  # share of the largest displacement from which a part has its full colour
MOST_MODES = 48  # mode shapes in one picture, at most
PANEL_RATIOS = {1: 0.6, 2: 0.45, 3: 0.5}  # columns: height over width of a panel
CABLE_POINTS = 80  # that are drawn along each cable of a suspension, about
SMALL_BODY = 0.08  # size of a body over that of the scene, below which its rotation is drawn enlarged
MANY_CABLES = 100  # cables from which lines are thin
TALLEST_PANEL = 1.8  # height over width of the tallest panel in perspective
INSET_WIDTH = 0.27  # side of the picture of the enlarged body over the width of its panel
TRIED_SCALES = 6  # vertical scales that are tried until displacements are enlarged alike in both directions
NOT_ENLARGED = 1e-3  # height over width of a picture that is not enlarged
ENDINGS = (".gif", ".html")
FRAMES, PAUSE = 20, 60  # of one period; time between them [ms]
RESOLUTION = 100  # of the frames [dots/in]
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Modes in motion</title></head>
<body style="margin:0"><img alt="Modes in motion" style="max-width:100%" src="data:image/gif;base64,{}"></body></html>
"""


@dataclass(frozen=True)
class ModeDrawing:
    """Positions and displacements of all that is drawn of one mode, without scale."""

    view: object  # places, shape (..., 3) -> coordinates on the paper, shape (..., 2)
    colour: str  # of the parts that move
    words: str  # for the part that moves most
    upwards: str  # words for the coordinate that a picture in a plane shows upwards
    cables: list  # places along each cable and link and their displacements, shape (j, 3)
    bodies: dict = field(default_factory=dict)  # name -> places of attachments and reference point, and displacements
    points: tuple = (np.zeros((0, 3)),) * 2  # places of the free points and their displacements, shape (p, 3)
    turn: float = 0.0  # largest rotation of a body
    body: str | None = None  # that moves most, where it turns
    across: float = 1.0  # enlargement of displacements across the paper, over that of those upwards [-]

    @property
    def parts(self):
        """Places and displacements of all that moves: list."""
        return [*self.cables, *self.bodies.values(), self.points]

    @cached_property
    def largest(self):
        """Largest displacement."""
        return max(float(np.linalg.norm(moved, axis=-1).max(initial=0.0)) for _, moved in self.parts)

    def outline(self, factor):
        """Places that are displaced so far, on the paper, shape (n, 2)."""
        return np.concatenate([self.displaced(*part, factor).reshape(-1, 2) for part in self.parts])

    def displaced(self, places, moved, factor):
        """Places, shape (..., 3), with `factor` times their displacements, on the paper, shape (..., 2)."""
        still = self.view(places)
        return still + (self.view(places + factor * moved) - still) * [self.across, 1.0]

    def turns_in_a_small_body(self, size):
        """True if a body turns that is small compared with the size of the scene. [m]"""
        return self.body is not None and np.ptp(self.bodies[self.body][0], axis=0).max() < SMALL_BODY * size

    def factor(self, peak):
        """Factor to a largest displacement [m], or to a smaller one where a body would turn too far."""
        return min(peak / self.largest, LARGEST_TURN / self.turn if self.turn else np.inf)

    def colour_of(self, moved):
        """Colour of a part with displacements, shape (k, 3): of what moves, grey where it hardly moves."""
        share = min(float(np.linalg.norm(moved, axis=-1).max()) / self.largest / FULL_COLOUR, 1.0)
        return tuple(share * np.array(to_rgb(self.colour)) + (1 - share) * np.array(to_rgb(STILL)))


@style.styled
def mode_shapes(case, modes, share=None):
    """Figure of mode shapes of a cable between fixed ends, on its static form, one panel each, as the paper's Fig. 5.

    The `CableCase` has the finite elements by which the modes were computed, of which at most MOST_MODES are shown.
    `share` is a factor on the displacements, from -1 to 1, for one picture of an animation; by default 1.
    """
    shown = _of_cable(case, modes, min(len(modes), MOST_MODES))
    chord = float(case.span.chord)
    depth = float(np.abs(case.form.at(np.linspace(0.0, 1.0, 401))[0][:, 1]).max() * case.span.unstretched_length)
    # of a sag as it is too large for the paper's 0.1 m, of a chord too small
    if depth * 0.2 > PAPER_PEAK:
        peak = style.nice(0.3 * depth)
    else:
        peak = PAPER_PEAK if chord >= 100 * PAPER_PEAK else style.nice(chord / 100)
    return _figure(shown, modes.frequency, len(modes), peak, share, None, "distance along the chord [m]")


def _of_cable(case, modes, count):
    """`ModeDrawing` of each of the first modes of a cable, in directions along, across and sideways of its chord."""
    positions, shapes = interpolate_elements(case.state.mesh, modes.shapes[..., :count])
    places = case.form.at(positions)[0] * float(case.span.unstretched_length)
    places[:, 0] += positions * float(case.span.chord)
    tangent = np.gradient(places, positions, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    shown = []
    for kind, symmetry, shape in zip(modes.kind[:count], modes.symmetry, np.moveaxis(shapes, -1, 0), strict=False):
        colour, upwards, up = KINDS[kind]
        still, moved = places, shape * (np.arange(3) == 2 if up == 2 else np.arange(3) < 2)
        if kind == "axial":
            still, moved = np.outer(positions * float(case.span.chord), [1.0, 0.0, 0.0]), np.zeros(shape.shape)
            moved[:, 1] = (shape * tangent).sum(axis=1)
        view = View("", np.eye(3)[:, [0, up]], (), np.zeros(3))
        shown.append(ModeDrawing(view, colour, f"{kind}, {symmetry}", upwards, [(still, moved)]))
    return shown


@style.styled
def coupled_mode_shapes(case, modes, listed=None, share=None):
    """Figure of the first coupled modes of a suspension, one panel each: the displaced scene over the scene at rest.

    If all cables end in one vertical plane, the panels show that plane from the side; movement out of it is drawn
    upwards. Scenes that do not lie in one plane, or have no width in it, are drawn in perspective. At most MOST_MODES
    of the `listed` modes that are asked for, by default all, are shown; `share` is as in `mode_shapes`.
    """
    listed, drawing = len(modes) if listed is None else listed, drawing_of(case)
    plane, peak = upright_plane([drawing]), style.nice(PEAK_OVER_SIZE * drawing.size)  # largest displacement drawn [m]
    if plane is not None and np.ptp(plane(drawing.positions)[:, 0]) < FLAT * drawing.size:
        plane = None
    shown = [_drawing_of_coupled_mode(case, modes, drawing, plane, number) for number in range(min(listed, MOST_MODES))]
    if len({mode.upwards for mode in shown}) > 1:  # the axis names both: each panel says which of them it shows
        shown = [replace(mode, words=f"{mode.words}, {mode.upwards}") for mode in shown]
    if plane is not None and shown:
        at_rest = style.Window(*plane(drawing.positions).T, _ratio(shown))
        shown, peak = _alike_in_both_directions(shown, drawing, at_rest.factor)
    return _figure(shown, modes.frequency, listed, peak, share, drawing, plane and plane.labels[0])


def _ratio(shown):
    """Height over width of the panel of each of the modes that are drawn."""
    return PANEL_RATIOS[columns_of(len(shown))]


def _alike_in_both_directions(shown, drawing, enlargement):
    """Modes in a plane drawn with equal enlargement across and upwards, and the largest displacement drawn. [m]

    `enlargement` is that of the vertical scale without displacements: with them it may be less, which is looked for.
    """
    for _ in range(TRIED_SCALES):
        peak = style.nice(PEAK_OVER_SIZE * drawing.size / enlargement)
        shown = [replace(mode, across=enlargement) for mode in shown]
        window, _ = _window(shown, [mode.factor(peak) for mode in shown], None, False, _ratio(shown))
        if window.factor >= enlargement:
            break
        enlargement = window.factor
    return shown, peak


def _drawing_of_coupled_mode(case, modes, drawing, plane, number):
    """`ModeDrawing` of one of the `CoupledModes` of a case, `number` from 0, whose scene at rest is `drawing`.

    `plane` is the side view of the vertical plane in which all cables end; None draws in perspective.
    """
    equilibrium = case.rest
    suspension = equilibrium.suspension
    motion = np.zeros(6 * len(suspension.body_names))
    motion[modes.layout.free] = modes.layout.bodies(modes.shapes[:, number])
    motion, body_count = motion.reshape(-1, 6), suspension.bodies  # three displacements and three rotations of each
    cables = [*_moving_cables(equilibrium, modes, number), *_moving_links(equilibrium, motion)]
    bodies = {}
    for (name, points), of_body, origin in zip(drawing.bodies.items(), motion, equilibrium.position, strict=False):
        bodies[name] = points, of_body[:3] + np.cross(of_body[3:], points - origin)
    # the words name first the part that moves most, and last a direction or rotation: they decide the colour
    words = modes.moves[number].split(" ")
    mover, manner = words[0], words[-1]
    kind = "cables"
    if mover in suspension.body_names or mover == "points":
        kind = "bodies" if mover in drawing.bodies else "points"
    view, upwards = (drawing.perspective, "") if plane is None else _view_of_motion(plane, cables)
    return ModeDrawing(
        view, COLOURS[kind], shortened(modes.moves[number], 24), upwards, cables, bodies,
        points=(equilibrium.position[body_count:], motion[body_count:, :3]),
        turn=float(np.linalg.norm(motion[:body_count, 3:], axis=-1).max(initial=0.0)),
        body=mover if kind == "bodies" and manner in ROTATIONS else None,
    )  # fmt: skip


def _moving_cables(equilibrium, modes, number):
    """About CABLE_POINTS places along each cable, and their displacements in a mode, both (j, 3): list of pairs."""
    starts, cables = equilibrium.ends[equilibrium.suspension.of_cables, 0], []
    for start, mesh, nodal in zip(starts, modes.models.meshes, modes.nodes(number), strict=True):
        places_and_moves = np.stack(nodal)
        if mesh is not None:
            _, between = interpolate_elements(mesh, np.moveaxis(places_and_moves, 0, 1))
            between = np.moveaxis(between, 1, 0)
            step = max(1, (between.shape[1] - 1) // CABLE_POINTS)
            places_and_moves = np.concatenate([between[:, :-1:step], between[:, -1:]], axis=1)
        cables.append((start + places_and_moves[0], places_and_moves[1]))
    return cables


def _moving_links(equilibrium, motion):
    """Ends of each link, and their displacements by the motion of the bodies, shape (2, 3): list of pairs."""
    suspension = equilibrium.suspension
    links = slice(len(suspension.cable_names), None)
    owner = suspension.owner[links]
    of_owner = motion[owner]
    moved = of_owner[..., :3] + np.cross(of_owner[..., 3:], equilibrium.arms[links])
    moved = np.where((owner == GROUND)[..., None], 0.0, moved)
    return list(zip(equilibrium.ends[links], moved, strict=True))


def _view_of_motion(plane, cables):
    """View of cables that move in a plane, or out of it: then upwards on the paper; and what is upwards, in words."""
    normal = np.cross(plane.axes[:, 1], plane.axes[:, 0])
    out_of_plane = sum(((moved @ normal) ** 2).sum() for _, moved in cables)
    whole = sum((moved**2).sum() for _, moved in cables)
    if out_of_plane <= whole / 2:
        return plane, plane.labels[1].removesuffix(" [m]")
    along_and_normal = np.stack([plane.axes[:, 0], normal], axis=-1)
    level = cables[0][0][0] * [0, 0, 1]
    return View("", along_and_normal, (), level + plane.origin), "sideways"


def columns_of(count):
    """How many of `count` panels stand side by side."""
    return 1 if count == 1 else 2 if count < 5 else 3


def _figure(shown, frequency, listed, peak, share, drawing, distance):
    """Draw a `ModeDrawing` in each panel of a figure, all to one scale, with their frequencies. [Hz]

    `listed` modes are asked for. The largest displacement that is drawn is `peak` [m], times `share` in one picture of
    an animation. `drawing` is the static form of a suspension. `distance` is the label of the distance along the plane
    of the panels, None in perspective.
    """
    if not shown:
        return style.new_figure(1.2, "There is no mode to show")
    count, columns, factors = len(shown), columns_of(len(shown)), [mode.factor(peak) for mode in shown]
    with_inset = distance is None and any(mode.turns_in_a_small_body(drawing.size) for mode in shown)
    window, inset = _window(shown, factors, share, with_inset, PANEL_RATIOS[columns] if distance else None)
    width, rows = style.WIDTH / columns, -(-count // columns)
    figure = style.new_figure(rows * (window.ratio * (width - 0.45) + 0.55) + 0.6)
    # displacements are enlarged to the peak, or to less where a body would turn too far
    peaks = [float(f"{factor * mode.largest:.2g}") for mode, factor in zip(shown, factors, strict=True)]
    equal, anchors = len(set(peaks)) == 1, [] if drawing is None else [place for _, place in drawing.anchors]
    all_panels = style.panels(figure, count, columns, sharey=True)
    window.apply(all_panels[0], 4, 5)  # all have its limits and ticks
    for number, (axes, mode, factor) in enumerate(zip(all_panels, shown, factors, strict=True)):
        factor *= 1.0 if share is None else share
        axes.set_aspect(window.factor, adjustable="box")
        _draw(axes, mode, factor, anchors)
        title = f"{number + 1}   {quantity_text(frequency[number], 'Hz')}"
        words = mode.words if equal else f"{mode.words}, up to {length_text(peaks[number])}"
        _head(axes, title, words, mode.colour)
        if distance is None:
            _finish_in_perspective(axes, mode, factor, drawing.size, inset)
    if distance is not None:
        _label_plane(figure, shown, distance)
    _write_heading(figure, shown, listed, window, peaks[0] if equal else None, distance)
    return figure


def _head(axes, title, words, colour):
    """Write the title of a panel, and below it in a colour what moves."""
    axes.set_title(title, loc="left", pad=13, **style.bold(title))
    axes.annotate(words, (0, 1), (0, 3), "axes fraction", "offset points", fontsize=7.5, color=colour)


def _finish_in_perspective(axes, mode, factor, size, side):
    """Draw a scale for a scene of a size in place of axes, and a small body that turns in a square of a side. [m]"""
    axes.set_axis_off()
    scale_bar(axes, size)
    if mode.turns_in_a_small_body(size):
        _enlarge(axes, mode, factor, side)


def _write_heading(figure, shown, listed, window, peak, distance):
    """Write how many modes a figure shows of those `listed`, and their scale; `peak` is None where peaks differ. [m]"""
    count = len(shown)
    scaled = "displacements enlarged" if peak is None else f"scaled to a peak of {length_text(peak)}"
    modes_in_words = f"First {count} of {listed} modes" if count < listed else counted(count, "mode")
    scale = _scale_in_words(window, shown[0].across) if distance else ""
    style.heading(figure, f"{modes_in_words}, {scaled}, on the static form (grey){scale}")


def _scale_in_words(window, across):
    """End of a heading: the vertical scale of a `Window`, and how displacements across the paper are enlarged."""
    if across == 1.0:
        return f"; {window.note()}"
    times = "" if across == window.factor else f" {across:g} times"
    return f"; {window.note()}, displacements along the horizontal axis too{times}"


def _window(shown, factors, share, with_inset, ratio):
    """`Window` around all displaced modes, and the side of the square below for the picture of an enlarged body. [m]

    `ratio`: height over width of a panel in a plane, None in perspective; `factors`: that of the displacements of each
    mode; `with_inset`: whether to leave room for the square; other arguments are those of `_figure`.
    """
    displaced = (0.0, 1.0) if share is None else (-1.0, 1.0)
    outlines = [mode.outline(part * factor) for part in displaced for mode, factor in zip(shown, factors, strict=True)]
    outline = np.concatenate(outlines)
    inset = INSET_WIDTH * float(np.ptp(outline[:, 0]))
    if with_inset:
        outline = np.concatenate([outline, [outline.min(axis=0) - [0.0, inset]]])
    return style.Window(*outline.T, *((NOT_ENLARGED, TALLEST_PANEL) if ratio is None else (ratio,))), inset


def _label_plane(figure, shown, distance):
    """Label the axes that all panels in a plane share: the distance along it, and what modes show upwards."""
    figure.supxlabel(distance, fontsize=9)
    upwards = ", or ".join(sorted({mode.upwards for mode in shown})) + " [m]"
    figure.supylabel(style.wrapped(upwards, figure.get_figheight() - 1.0, 9), fontsize=9)


def _draw(axes, mode, factor, anchors):
    """Draw the static form, and over it the displaced scene in the colour of what moves, where it does."""
    width, view = 1.4 if len(mode.cables) < MANY_CABLES else 0.5, mode.view
    draw_lines(axes, [view(places) for places, _ in mode.cables], STILL, linewidths=0.7 * width, label="static form")
    colours = [mode.colour_of(moved) for _, moved in mode.cables]
    lines = [mode.displaced(places, moved, factor) for places, moved in mode.cables]
    draw_lines(axes, lines, colours, linewidths=width, zorder=3, label="mode")
    draw_points(axes, view, anchors, "^", color=style.GREY, ms=4, zorder=4)
    places, moved = mode.points
    draw_points(axes, view, places, "o", color=STILL, ms=3, zorder=2)
    draw_points(axes, lambda at: mode.displaced(at, moved, factor), places, "o", color=mode.colour, ms=3, zorder=5)
    for places, moved in mode.bodies.values():
        for colour, reach, zorder in ((STILL, 0.0, 2), (mode.colour_of(moved), factor, 6)):
            draw_body(axes, mode.displaced(places, moved, reach), colour, colour, 4, zorder, lw=1.6)


def _enlarge(axes, mode, factor, side):
    """Draw the body that turns enlarged, in a square of a side [m] below the scene, with the ends of its cables."""
    places, moved = mode.bodies[mode.body]
    radius = float(np.linalg.norm(places - places[-1], axis=-1).max())
    largest_factor = radius / float(np.linalg.norm(moved, axis=-1).max())
    factor = np.sign(factor) * min(abs(factor), largest_factor)
    inset = axes.inset_axes((axes.get_xlim()[0], axes.get_ylim()[0], side, side), transform=axes.transData)
    low, high = (mode.view(places[-1]) + 1.7 * radius * sign for sign in (-1, 1))
    inset.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[])
    inset.spines[:].set(visible=True, color=STILL, linewidth=0.6)
    for reach, colour, zorder in ((0.0, STILL, 2), (factor, mode.colour, 3)):
        lines = [mode.view(line + reach * shift) for line, shift in mode.cables]
        draw_lines(inset, lines, colour, linewidths=0.7, zorder=zorder)
        draw_body(inset, mode.view(places + reach * moved), colour, colour, 4, zorder, lw=1.6)
    inset.set_title(shortened(mode.body, 16), fontsize=7, color=mode.colour, pad=2)


# ------------------------------------------------------------------------------------------------------ modes in motion


def save_animation(draw, path):
    """Write one period of the vibration of modes as a moving picture, whole or not at all: a .gif, or a page, .html.

    `draw` makes the figure of all modes of the displacement over the amplitude, from -1 to 1.
    """
    from PIL import Image  # which matplotlib has with it

    displacements = np.round(np.cos(2 * np.pi * np.arange(FRAMES) / FRAMES), 9).tolist()
    pictures = {}  # displacement -> picture, which occurs on the way there and on the way back
    for displacement in displacements:
        if displacement not in pictures:
            picture = Image.open(io.BytesIO(style.rendered(draw(displacement), "png", RESOLUTION)))
            pictures[displacement] = picture.convert("RGB").quantize(64, dither=Image.Dither.NONE)
    first, *others = (pictures[displacement] for displacement in displacements)
    data = io.BytesIO()
    first.save(data, format="GIF", save_all=True, append_images=others, duration=PAUSE, loop=0)
    is_page = os.path.splitext(path)[1].lower() == ".html"
    contents = PAGE.format(base64.b64encode(data.getvalue()).decode()).encode() if is_page else data.getvalue()
    write_whole(path, contents)
