"""When does a chain of bars hang with one of them slack? Decided by geometry, without solving anything.

A slack bar carries nothing, so the forces on the nodes beyond it fix the tension vector of every other bar, each bar's
tension its length, and the chain has a gap where the slack bar is. It is an equilibrium if the bar spans that gap
without being stretched; and then, the energy being convex, it is the equilibrium.
"""

import numpy as np


def slack_margin(sizes, nodal_forces, stiffness, end):
    """Least of (gap - length)/length over the bars: negative where that bar can be slack.

    sizes (n,): unstretched lengths [m]; nodal_forces (n - 1, 3): on the interior nodes [N]; stiffness: EA [N]; end:
    end 2 from end 1 [m].
    """
    n = len(sizes)
    passed = np.vstack([np.zeros(3), np.cumsum(nodal_forces, axis=0)])  # forces on nodes before each bar
    margins = []
    for slack in range(n):
        vectors = passed[slack] - passed  # F_i = F_slack + forces between
        tensions = np.linalg.norm(vectors, axis=1)
        others = np.arange(n) != slack
        if not tensions[others].all():
            continue
        bars = sizes[others, None] * vectors[others] * (1 / stiffness + 1 / tensions[others])[:, None]
        gap = np.linalg.norm(end - bars.sum(axis=0))
        margins.append(gap / sizes[slack] - 1)
    return min(margins, default=np.inf)


def span_margin(span, mesh):
    """`slack_margin` of the bars of a mesh of order 1 along a `Span`."""
    length = float(span.unstretched_length)
    sizes = mesh.sizes * length
    weight = float(span.weight_per_length)
    forces = -weight * (sizes[1:, None] + sizes[:-1, None]) / 2 * np.asarray(span.up)
    for position, force in zip(span.load_positions, span.load_forces, strict=True):
        forces[np.argmin(np.abs(mesh.edges[1:-1] * length - position))] += force
    return slack_margin(sizes, forces, float(span.axial_stiffness), np.array([span.chord, 0, 0]))
