"""The path of a load that travels along its cable, above the ground, and the largest tension of the cable."""

import numpy as np
from matplotlib.figure import Figure

from cablestudy.cable.geometry import places
from cablestudy.study.plots.drawing import direction, ground_in, view_from_end_1
from cablestudy.study.plots.form import RATIO, finish_view, room_in, with_ground
from cablestudy.study.plots.marks import draw_lines, mark_clearance
from cablestudy.study.plots.style import BLUE, GREY, RED, WIDTH, Window, heading, legend_below, plain, styled
from cablestudy.study.plots.words import quantity_text, shortened

FORMS = 5  # of the cable that are drawn
COLUMNS = "x_m", "y_m", "z_m", "clearance_m", "max_tension_N"
DOTS = 50  # places up to which each is marked
POINTS = np.linspace(0.0, 1.0, 201)


@styled
def load_path(path):
    """Figure of a load that travels along a cable: its path in a side view, and below it the largest tension.

    The side view has the cable for some positions of the load. `path` is a `LoadPath`.
    """
    first, (*positions, clearance, tension) = path.cables[0], (_numbers(path, name) for name in COLUMNS)
    span = first.form.span
    view = view_from_end_1(first.end_1, direction(span.frame[0, :2] * span.chord, span.chord), first.ground)
    forms, line = [view(form) for form in _forms(path.cables)], view(np.stack(positions, axis=-1))
    all_points = np.concatenate([*forms, line[np.isfinite(line[:, 0])]])  # on the paper, shape (n, 2)
    ground = ground_in(view, first.ground, all_points[:, 0])
    window = Window(*with_ground(all_points, ground).T, RATIO)
    tall = 0.7 + window.ratio * (WIDTH - 0.8)
    figure = Figure(figsize=(WIDTH, tall + 2.6), layout="constrained")
    side, below = figure.subplots(2, 1, height_ratios=(tall, 1.9))
    draw_lines(side, forms, GREY, linewidths=0.7, alpha=0.7, label="the cable in some of the places")
    dots = "." if len(line) <= DOTS else ""
    side.plot(*line.T, dots, ls="-", color=BLUE, lw=1.8, label=f"path of {shortened(path.name)}")
    finish_view(side, view, window, ground)
    known = np.isfinite(clearance)
    if ground is not None and known.any():
        mark_clearance(side, room_in(side, window, all_points), line[known], ground, float(clearance[known].min()))
    below.plot(line[:, 0], tension / 1e3, dots, ls="-", color=RED)
    below.set(xlim=side.get_xlim(), xlabel="place of the load, horizontal distance from end 1 [m]")
    below.set_ylabel("largest\ntension [kN]")
    plain(below, 8, 5)
    legend_below(figure, list(zip(*side.get_legend_handles_labels(), strict=True)))
    least = f", least clearance {quantity_text(float(np.nanmin(clearance)), 'm')}" if ground is not None else ""
    heading(figure, f"{shortened(path.name)} from end to end: largest tension "
                    f"{quantity_text(float(np.nanmax(tension)), 'N')}{least}")  # fmt: skip
    return figure


def _numbers(path, name):
    """A column of a `LoadPath`, not a number where it has none."""
    return np.array([np.nan if row.get(name) is None else row[name] for row in path.table.rows])


def _forms(cables):
    """Some cables that are drawn: list of places, shape (j, 3). [m]"""
    chosen = np.unique(np.linspace(0, len(cables) - 1, FORMS + 2).round().astype(int))[1:-1]
    return [places(one.form, POINTS) + one.end_1 for one in [cables[number] for number in chosen] or cables[:1]]
