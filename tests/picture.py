"""What is wrong with a picture: texts outside of it, texts over each other, numbers that are not rounded."""

import re
from contextlib import contextmanager
from html import escape
from itertools import combinations
from pathlib import Path
from unittest.mock import patch

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.transforms import Affine2D

DPI = 100
MOST_DIGITS = 4
TOLERANCE = 1.0  # [pixel]
MARKS = ("draw_path", "draw_markers", "draw_path_collection", "draw_quad_mesh", "draw_image", "draw_gouraud_triangles")
NUMBER = re.compile(r"(?<![\w./−-])\d[\d.,]*")  # not within a name


def faults(figure):
    """What is wrong with a figure, one line each; an empty list where nothing is."""
    figure.set_dpi(DPI)
    renderer, texts = FigureCanvasAgg(figure).get_renderer(), []

    def recorded(gc, x, y, words, prop, angle, ismath=False, mtext=None):
        if mtext is not None and mtext not in texts:
            texts.append(mtext)

    renderer.draw_text = recorded
    for name in MARKS:  # where texts stand follows from the fonts: nothing need be drawn
        setattr(renderer, name, lambda *_, **__: None)
    figure.draw(renderer)  # the layout first, which draws nothing
    boxes = [(text.get_text(), _corners(text, renderer)) for text in texts]
    found = [f"outside: {words!r}" for words, corners in boxes if _outside(corners, figure)]
    for legend in figure.findobj(Legend):
        box = legend.get_window_extent(renderer)
        if _outside(box.corners(), figure):
            found.append(f"legend outside: {box}")
        entries = [text.get_text() for text in legend.get_texts()]
        found += [f"equal entries: {entries}"] if len(set(entries)) < len(entries) else []
        own = {*entries, legend.get_title().get_text()}
        found += [f"behind a legend: {words!r}" for words, corners in boxes
                  if words not in own and _overlap(corners, box.corners()[[0, 1, 3, 2]])]  # fmt: skip
    for (one, corners), (other, corners_of_other) in _near(boxes):
        if _overlap(corners, corners_of_other):
            found.append(f"{one!r} over {other!r}")
    found += [f"not rounded: {words!r}" for words, _ in boxes if any(_digits(n) > MOST_DIGITS for n in numbers(words))]
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            ticks = [text.get_text() for text in axis.get_ticklabels() if text in texts]
            if len(set(ticks)) < len(ticks):
                found.append(f"equal ticks: {ticks}")
    return found


@contextmanager
def undrawn():
    """Pictures are composed, but not drawn: their files stay empty, and a page shows an empty svg for each."""
    empty = '<svg role="img" aria-label="{}"></svg>'.format
    with (
        patch("cablestudy.plots.save", lambda figure, path: Path(path).touch()),
        patch("cablestudy.plots.save_animation", lambda draw, path: Path(path).touch()),
        patch("cablestudy.pages.page.inline_picture", lambda figure, prefix, label: empty(escape(label))),
    ):
        yield


def curves(axes):
    """Label, up to a colon -> the first of the lines that have it: dict of Line2D."""
    collections = [one for one in axes.collections if isinstance(one, LineCollection) and one.get_segments()]
    found = {one.get_label().partition(":")[0]: Line2D(*one.get_segments()[0].T) for one in reversed(collections)}
    return {line.get_label(): line for line in axes.lines} | found


def numbers(words):
    """The numbers in a text."""
    return [found.rstrip(".,") for found in NUMBER.findall(words)]


def _digits(number):
    digits = number.replace(",", "")
    digits = digits.replace(".", "").lstrip("0") if "." in digits else digits.strip("0")
    return len(digits)


def _corners(text, renderer):
    """Corners of the box of a text, in order, shape (4, 2); of one that is turned about its anchor, turned with it."""
    angle = text.get_rotation()
    if angle % 90 == 0 or text.get_rotation_mode() != "anchor":
        return text.get_window_extent(renderer).corners()[[0, 1, 3, 2]]
    text.set_rotation(0)
    corners = text.get_window_extent(renderer).corners()[[0, 1, 3, 2]]
    text.set_rotation(angle)
    anchor = text.get_transform().transform(text.get_unitless_position())
    return Affine2D().rotate_deg_around(*anchor, angle).transform(corners)


def _outside(corners, figure):
    size = np.array([figure.bbox.width, figure.bbox.height])
    return bool((corners < -TOLERANCE).any() or (corners > size + TOLERANCE).any())


def _near(boxes):
    """Pairs of boxes that no line along x or y separates: the few of a picture that may overlap."""
    if not boxes:
        return []
    corners = np.array([corners for _, corners in boxes])
    low, high = corners.min(axis=1), corners.max(axis=1)
    apart = (low[:, None] > high).any(axis=-1)
    return [(boxes[i], boxes[j]) for i, j in combinations(range(len(boxes)), 2) if not (apart[i, j] or apart[j, i])]


def _overlap(one, other):
    """Whether two rectangles overlap by more than the tolerance: no side of either separates them."""
    for corners in (one, other):
        for side in (corners[1] - corners[0], corners[2] - corners[1]):
            length = np.hypot(*side)
            if length == 0:
                return False
            shadow, shadow_of_other = one @ side / length, other @ side / length
            if min(shadow.max(), shadow_of_other.max()) - max(shadow.min(), shadow_of_other.min()) <= TOLERANCE:
                return False
    return True
