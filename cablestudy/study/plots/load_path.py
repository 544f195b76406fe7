"""The path of a load that travels along its cable, above the ground, and the tension that it makes."""

import numpy as np
from matplotlib.figure import Figure

from cablestudy.cable.geometry import places
from cablestudy.study.plots.cases import along_the_chord, finish_side, ground_under, mark_clearance
from cablestudy.study.plots.style import BLUE, GREY, RED, WIDTH, Window, heading, legend_below, plain, styled
from cablestudy.study.plots.words import quantity_text, shortened

FORMS = 5  # of the cable that are drawn
COLUMNS = "x_m", "y_m", "z_m", "clearance_m", "max_tension_N"
DOTS = 50  # places up to which each is marked
POINTS = np.linspace(0.0, 1.0, 201)


@styled
def load_path(path):
    """Figure of a `LoadPath`: side view with the cable in some places of the load; largest tension over the way."""
    cables, start = path.cables, path.cables[0].end_1
    x, y, z, clearance, tension = (_numbers(path, name) for name in COLUMNS)
    run, _, level = along_the_chord(cables[0].form.span)
    distance, forms = (x - start[0]) * level[0] + (y - start[1]) * level[1], _forms(cables, start, level)
    ground = ground_under(cables[0].ground, run, start, level)
    heights = [z[np.isfinite(z)], *(form[1] for form in forms), *(() if ground is None else [ground[1]])]
    window = Window(np.concatenate([form[0] for form in forms]), np.concatenate(heights), 0.30)
    tall = 0.7 + window.ratio * (WIDTH - 0.8)
    figure = Figure(figsize=(WIDTH, tall + 2.6), layout="constrained")
    side, below = figure.subplots(2, 1, height_ratios=(tall, 1.9))
    for number, form in enumerate(forms):
        side.plot(*form, color=GREY, lw=0.7, alpha=0.7, label=None if number else "the cable in some of the places")
    dots = "." if len(x) <= DOTS else ""
    side.plot(distance, z, dots, ls="-", color=BLUE, lw=1.8, label=f"path of {shortened(path.name)}")
    finish_side(side, ground, window)
    known = np.isfinite(clearance)
    if ground is not None and known.any():
        mark_clearance(side, distance[known], z[known], ground, float(clearance[known].min()))
    below.plot(distance, tension / 1e3, dots, ls="-", color=RED)
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


def _forms(cables, start, level):
    """Some cables that are drawn, each as horizontal distance from the start along a direction, and level. [m]"""
    chosen = np.unique(np.linspace(0, len(cables) - 1, FORMS + 2).round().astype(int))[1:-1]
    drawn = [cables[place] for place in chosen] or cables[:1]
    forms = [places(cable.form, POINTS) + cable.end_1 for cable in drawn]
    return [((form - start)[:, :2] @ level, form[:, 2]) for form in forms]
