"""Mode shapes on the static form."""

import numpy as np
from matplotlib.figure import Figure

from cablestudy.scene.words import counted
from cablestudy.study.plots.deflection import between_nodes
from cablestudy.study.plots.form import Form
from cablestudy.study.plots.style import (
    BLUE,
    GREEN,
    GREY,
    RED,
    WIDTH,
    Window,
    bold,
    heading,
    nice,
    panels,
    styled,
    wrapped,
)
from cablestudy.study.plots.words import quantity_text

COLOUR = {"in-plane": BLUE, "out-of-plane": RED, "axial": GREEN}
WORDS = {"in-plane": "distance above the chord", "out-of-plane": "sideways", "axial": "movement along the cable"}
PEAK = 0.1  # of a drawn mode shape, as in the paper's Fig. 5 [m]
PANELS = 48  # mode shapes in one picture, at most
LAYOUT = {1: 0.6, 2: 0.45, 3: 0.5}  # columns: height over width of a panel


@styled
def mode_shapes(case, modes, share=None):
    """Figure of mode shapes on the static form, one panel each, as the paper's Fig. 5.

    Parameters
    ----------
    case : Case
        With the discretisation of the modes.
    modes : Modes
    share : float, optional
        Displacement over the largest one, from -1 to 1, of a picture in a row of them that are of equal size.
    """
    count = min(len(modes), PANELS)
    if not count:
        return no_mode()
    form = Form(case)
    peak = _peak(form)
    drawn = _lines(form, modes, count, peak)
    columns = columns_of(count)
    width, ratio = WIDTH / columns, LAYOUT[columns]
    reached = [drawn] if share is None else [_at(drawn, 1.0), _at(drawn, -1.0)]
    x, y = (np.concatenate([line for all_ in reached for lines in all_ for line in lines[axis::2]]) for axis in (0, 1))
    drawn = drawn if share is None else _at(drawn, share)
    window = Window(x, y, ratio)
    rows = -(-count // columns)
    size = (columns * width, rows * (window.ratio * (width - 0.45) + 0.55) + 0.6)
    figure = Figure(figsize=size, layout="constrained")
    for k, axes in enumerate(panels(figure, count, columns, sharey=True)):
        x_form, y_form, x_mode, y_mode = drawn[k]
        window.apply(axes, 4, 5)
        axes.plot(x_form, y_form, color="#9a9a9a", lw=1.1, label="static form")
        axes.plot(x_mode, y_mode, color=COLOUR[modes.kind[k]], lw=1.5, label="mode")
        title = f"{k + 1}   {quantity_text(modes.frequency[k], 'Hz')}"
        axes.set_title(title, loc="left", pad=13, **bold(title))
        kind = f"{modes.kind[k]}, {modes.symmetry[k]}"
        axes.annotate(kind, (0, 1), (0, 3), "axes fraction", "offset points", fontsize=7.5, color=GREY, va="bottom")
    scaled = f"scaled to a peak of {quantity_text(peak, 'm')}"
    heading(figure, f"{how_many(count, len(modes))}, {scaled}, on the static form (grey); {window.note}")
    figure.supxlabel("distance along the chord [m]", fontsize=9)
    upwards = ", or ".join(word for kind, word in WORDS.items() if kind in modes.kind[:count]) + " [m]"
    figure.supylabel(wrapped(upwards, figure.get_figheight() - 1.0, 9), fontsize=9)
    return figure


def no_mode():
    """Figure that says that there is no mode."""
    figure = Figure(figsize=(WIDTH, 1.2), layout="constrained")
    figure.suptitle("There is no mode to show")
    return figure


def columns_of(count):
    """How many of so many panels stand side by side."""
    return 1 if count == 1 else 2 if count < 5 else 3


def how_many(count, listed):
    """Words on how many modes are drawn, of those that are asked for."""
    return f"First {count} of {listed} modes" if count < listed else counted(count, "mode")


def _lines(form, modes, count, peak):
    """For each mode: x and y of the static form, then x and y of the mode. [m]"""
    positions, shapes = between_nodes(form.case.state.mesh, modes.shapes[..., :count])
    along, across, sideways, _ = form.in_frame(positions)
    tangent = np.gradient(np.stack([along, across, sideways], axis=1), positions, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    lines = []
    for k in range(count):
        shape, kind = shapes[..., k], modes.kind[k]
        if kind == "axial":
            flat, movement = positions * form.chord, (shape * tangent).sum(axis=1)
            lines.append((flat, 0 * positions, flat, _peaked(movement, peak)))
        elif kind == "in-plane":
            moved = _peaked(shape[:, :2], peak)
            lines.append((along, across, along + moved[:, 0], across + moved[:, 1]))
        else:
            lines.append((along, sideways, along, sideways + _peaked(shape[:, 2], peak)))
    return lines


def _at(drawn, share):
    """What `_lines` has found, with the displacements times a share."""
    return [(x, y, x + share * (x_mode - x), y + share * (y_mode - y)) for x, y, x_mode, y_mode in drawn]


def _peaked(movement, peak):
    """The displacement scaled to a given largest value."""
    size = np.abs(movement) if movement.ndim == 1 else np.linalg.norm(movement, axis=1)
    return movement * (peak / size.max())


def _peak(form):
    """Peak of the drawn shapes: the paper's 0.1 m unless too small for the sag or too large for the chord. [m]"""
    depth = float(np.abs(form.across).max())
    if depth * 0.2 > PEAK:
        return nice(0.3 * depth)
    return PEAK if form.chord >= 100 * PEAK else nice(form.chord / 100)
