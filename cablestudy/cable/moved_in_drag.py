"""Change of the tension along cables in a steady wind as their ends move: the drag follows them.

With the tension vector N, the compliance A = I/EA + (I - t t^T)/T of a point and its drag d times the unstretched
length L, a small movement m_1, m_2 of the ends changes form and tension by r' and N'. With the share s of the length,

    dr'/ds = L A N',    dN'/ds = -d',    d' = D A N' + E r',    r' = m_1 at s = 0, m_2 at s = 1.

D is the change of the drag with the slope of the form (`turning_matrices`), E that with its place where the wind grows
with the height. On each piece d' is a polynomial through Gauss's points, as the drag is in `drag_search`: one matrix
takes r' and N' from its begin to its end.
"""

import numpy as np

from cablestudy.cable.catenary_in_drag import integral
from cablestudy.cable.drag_search import gauss_weights, to_points_and_end
from cablestudy.cable.geometry import points_along
from cablestudy.cable.steady_drag import across, turning_matrices
from cablestudy.cable.vectors import size


@np.errstate(all="ignore")  # of cables without an equilibrium
def changes_of_tension(form, drag, moves):
    """Changes of the tension vectors of n cables by small movements of their ends, with drag that follows them.

    Parameters
    ----------
    form : CatenaryInDrag
        The cables where they hang, shape (n,).
    drag : SteadyDrag
        On them, shape (n,).
    moves : ndarray, shape (2, 3) or (n, 2, 3)
        m_1 and m_2, global axes. [-]

    Returns
    -------
    callable
        Positions, shape (..., e), shares of the unstretched length -> N' there, shape (n, e, 3), global axes. [N/m]
    """
    span, pieces = form.span, form.pieces
    moved = (span.frame[:, None] * np.asarray(moves)[..., None, :]).sum(axis=-1)
    at_end_1 = (form.end_stiffness * (moved[:, 1] - moved[:, 0])[:, None]).sum(axis=-1)  # if the drag were a dead load
    of_drag = np.zeros(form.difference.shape)
    points = None if drag.profile is None else points_along(form, pieces.points) + drag.end_1[:, None]
    for row in np.flatnonzero((drag.normal_drag > 0) & form.found & ~(form.slack | form.folded)).tolist():
        changes = _changes_of_drag(form, drag.take([row]), row, None if points is None else points[row : row + 1])
        at_end_1[row], of_drag[row] = _of_cable(form, row, moved[row], *changes)
    followed = integral(pieces, of_drag)
    return lambda positions: span.in_frame(at_end_1[:, None] - followed(positions), "global")


def _changes_of_drag(form, drag, row, points):
    """A, D A and E at the j points of one cable, shape (j, 3, 3) each, chord frame. [1/N], [-], [N/m]

    `points` are their places, shape (1, j, 3), where the wind grows with the height, else None. [m]
    """
    span = form.span
    frame, length, axial = span.frame[row], span.unstretched_length[row], span.axial_stiffness[row]
    vectors = form.uniform[row] + form.change[row]
    tension = size(vectors)[:, None]
    tangent, wind = vectors / tension, frame @ drag.direction[0]
    turned = np.cross(np.eye(3), tangent[:, None])
    compliance = np.eye(3) / axial + turned @ np.swapaxes(turned, -1, -2) / tension[..., None]
    whole = drag.normal_drag[0] * length
    by_slope = whole * turning_matrices(tangent, wind) @ compliance
    if points is None:
        return compliance, by_slope, np.zeros_like(by_slope)
    gradient = (drag.profile.gradient(points)[0] @ frame.T)[:, None]
    by_place = whole * ((1 + tension / axial) * across(wind, tangent))[..., None] * gradient
    return compliance, drag.profile.pressure(points)[0, :, None, None] * by_slope, by_place


def _of_cable(form, row, moved, compliance, by_slope, by_place):
    """N' at end 1, shape (3,), and d' at the j points, shape (j, 3), of one cable whose ends are `moved`, (2, 3)."""
    width, length, axes = form.pieces.width[row][:, None, None], form.span.unstretched_length[row], np.eye(3)
    count = len(gauss_weights())
    # of each piece: its points' matrices as blocks, integrals up to its points and over it, r' or N' at its points
    blocks = (part.reshape(-1, count, 3, 3) for part in (compliance, by_slope, by_place))
    a, da, e = (np.einsum("piab,ij->piajb", part, np.eye(count)).reshape(-1, *(3 * count,) * 2) for part in blocks)
    running, whole = (width * np.kron(rule, axes) for rule in (to_points_and_end()[:-1], gauss_weights()))
    ahead = np.kron(np.ones((count, 1)), axes)
    both = da + length * e @ running @ a
    forced = np.concatenate([e @ ahead, both @ ahead], axis=-1)
    drag = np.linalg.solve(np.eye(3 * count) + both @ running, forced)  # by r' and N' where the piece begins
    tension = np.hstack([0 * ahead, ahead]) - running @ drag
    across = np.eye(6) + np.concatenate([length * whole @ a @ tension, -whole @ drag], axis=1)
    begins = [np.eye(6)]
    for of_piece in across:
        begins.append(of_piece @ begins[-1])
    place, by_tension = np.split(begins.pop()[:3], 2, axis=1)
    # of a dead load the last is L times the integral of A, which `end_stiffness` has to all digits
    by_tension = by_tension - length * (form.pieces.weights[row][:, None, None] * compliance).sum(axis=0)
    stiffness = form.end_stiffness[row]
    at_end_1 = np.linalg.solve(axes + stiffness @ by_tension, stiffness @ (moved[1] - place @ moved[0]))
    of_drag = drag @ (np.array(begins) @ np.concatenate([moved[0], at_end_1])[:, None])
    return at_end_1, of_drag.reshape(-1, 3)
