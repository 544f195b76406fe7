"""Deflection of a cable by point loads, non-linear and linear."""

from functools import partial

import numpy as np

from cablestudy.cable.element import basis, lagrange
from cablestudy.plots.style import BLUE, GREEN, GREY, ORANGE, RED, padded, plain
from cablestudy.study.deflection import nodal_deflections

WORDS = {"vertical": "upwards", "sideways": "sideways", "horizontal": "horizontally"}
FULL = {"color": BLUE, "label": "full, non-linear"}
LINEAR = {"color": RED, "ls": "--", "lw": 1.3, "label": "linear, about the unloaded form"}
DIFFERENCES = {
    "vertical": {"color": BLUE, "label": "vertical"},
    "sideways": {"color": RED, "ls": "--", "label": "sideways"},
    "horizontal": {"color": GREEN, "ls": "-.", "label": "horizontal"},
}
SHARE = 0.1  # of the largest component of a deflection, above which another has a panel
ROUNDING = 1e-10  # of a difference over the largest movement, both of which are differences of positions
PANEL_HEIGHT = 1.9  # of a panel [in]


def deflections(case, abscissa, label):
    """Panels with the deflection of a cable by its point loads: non-linear and linear curves, and their difference.

    There is a panel for each component, vertical, sideways and horizontal, that is larger than a tenth of the largest
    or in which most of a load acts. One more panel shows the difference, linear minus non-linear, of all these, unless
    it is nothing but rounding.

    Parameters
    ----------
    case : CableCase or HangingCable
        One cable in equilibrium, with point loads.
    abscissa : callable
        Arc length over the unstretched length, shape (j,) [-] -> position along the horizontal axis of the panel [m].
    label : str
        Label of this axis.

    Returns
    -------
    list of (float, callable)
        Height of a panel [in], and the function that draws it in a cell of the grid of a figure.
    """
    span, (mesh, *nodal) = case.span, nodal_deflections(case)
    positions, deflection = interpolate_elements(mesh, np.stack(nodal, axis=-1))  # (j, 3, 2), last axis: full, linear
    movement, names = _components(span, deflection), _components_to_show(span, deflection[:, :, 0])
    panel = partial(_paint, abscissa(positions), label, abscissa(span.load_positions / span.unstretched_length))
    painted = [
        partial(panel, "Deflection from the unloaded form", f"movement\n{WORDS[name]} ",
                list(zip(movement[name].T, (FULL, LINEAR), strict=True)))
        for name in names
    ]  # fmt: skip
    differences = [(movement[name][:, 1] - movement[name][:, 0], DIFFERENCES[name]) for name in names]
    largest, difference = (
        max(np.abs(values).max() for values in arrays)
        for arrays in ([movement[name] for name in names], [values for values, _ in differences])
    )
    if not difference <= ROUNDING * largest:  # a cable that hangs folded has no linear movement: NaN
        painted.append(partial(panel, "Difference of the two", "linear − full\n", differences))
    return [(PANEL_HEIGHT, paint) for paint in painted]


def _components(span, vectors):
    """Components of vectors in the chord frame, shape (j, 3, ...): name -> array of shape (j, ...)."""
    along, across, sideways = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    level, up = span.cosine * along - span.sine * across, span.sine * along + span.cosine * across
    return {"vertical": up, "sideways": sideways, "horizontal": level}


def _components_to_show(span, deflection):
    """Names of the components of deflections, shape (j, 3), that have a panel; see `deflections`."""
    largest = {name: np.abs(values).max() for name, values in _components(span, deflection).items()}
    forces = _components(span, span.load_forces)
    of_loads = {max(forces, key=lambda name: abs(forces[name][load])) for load in range(len(span.load_forces))}
    return [name for name in largest if largest[name] > SHARE * max(largest.values()) or name in of_loads]


def interpolate_elements(mesh, nodal):
    """Interpolate values at the nodes of finite elements by the polynomials of the elements, to draw smooth curves.

    Parameters
    ----------
    mesh : Mesh
    nodal : ndarray, shape (nodes, ...)
        Values at the nodes.

    Returns
    -------
    positions : ndarray, shape (j,)
        Arc lengths of j points over the unstretched length: the nodes if elements are straight, else 401 points or
        more. [-]
    values : ndarray, shape (j, ...)
        Values there.
    """
    element = basis(mesh.order)
    fine = np.linspace(0.0, 1.0, 1 + (1 if mesh.order == 1 else max(8, -(-400 // mesh.elements))))
    index = mesh.element_nodes
    values = np.einsum("ji,ni...->nj...", lagrange(element.nodes, fine), nodal[index])
    positions = mesh.edges[:-1, None] + mesh.sizes[:, None] * fine
    keep = np.ones(positions.shape, dtype=bool)
    keep[:-1, -1] = False  # it is also the first point of the next element
    return positions[keep], values[keep]


def _paint(x, x_label, loads, title, y_words, lines, figure, place):
    """Draw a panel of lines over x, each with its look, and a dotted line at each load."""
    axes = figure.add_subplot(place)
    scale, unit = _length_unit([values for values, _ in lines])
    for values, look in lines:
        axes.plot(x, values * scale, **(look if len(lines) > 1 else look | {"label": ""}))
    for load in loads:
        axes.axvline(load, color=ORANGE, lw=1.2, ls=":", zorder=0.5)
    axes.set(ylabel=f"{y_words}[{unit}]", xlabel=x_label, xlim=padded(x.min(), x.max(), 0.03, 0.03))
    axes.set_title(title, loc="left", color=GREY)
    axes.margins(y=0.12)
    plain(axes, 8, 5)
    if len(lines) > 1:  # above the axes, so that it covers no line
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=len(lines), borderaxespad=0.1)


def _length_unit(arrays):
    """Factor and unit that make lengths in metres readable."""
    largest = np.abs(arrays).max()
    if largest >= 1:
        return 1.0, "m"
    return next(((scale, unit) for scale, unit in ((1e9, "nm"), (1e6, "µm")) if largest * scale < 100), (1e3, "mm"))
