"""Convergence orders, declared per element, checked by one body: errors fall as n^-rate with n elements."""

import functools
import itertools

import numpy as np
import pytest
from cables import EA, MASS, Exact, chord_span, state_of
from references import continuous_cable

from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.element import MASSES, basis

# (order, mass): rate of the frequencies, rate of the end stiffness. Bars with the mean of both masses cancel the
# leading term where the cable is taut.
RATES = {**{(order, mass): (2 * order, 2 * order) for order in (1, 2, 3, 4) for mass in MASSES}, (1, "blended"): (4, 2)}
TAUT = chord_span(185.8, 19, 0.007, EA, MASS, 1.0)
SAGGING = chord_span(100, 10, -0.02, EA, MASS)
SIZES = {1: (16, 32, 64), 2: (8, 16, 32), 3: (4, 8, 16, 32), 4: (4, 8, 16, 32)}
REFERENCE = (1e-11, 1e-11, 2e-13)  # what the references are good for: frequencies in and out of the plane, stiffness


@functools.cache
def exact(taut):
    span = TAUT if taut else SAGGING
    solution = Exact(span)
    a, b = float(solution.chord * solution.c), float(solution.chord * solution.s)
    args = (a, b, float(solution.L), EA, MASS, span.gravity, 5)
    return continuous_cable.frequencies(*args), continuous_cable.frequencies(*args, "out"), solution.end_stiffness()


@functools.cache
def errors(taut, elements, order, mass):
    """Relative errors of five frequencies in and out of the plane, and of the end stiffness."""
    span = TAUT if taut else SAGGING
    model = Dynamics(state_of(span, elements, order, mass))
    found = model.lowest(min(30, model.dof))
    out = np.array([kind == "out-of-plane" for kind in found.kind])
    inside, outside, stiffness = exact(taut)
    d = np.sqrt(np.diag(stiffness))
    return (
        np.abs(found.frequency[~out][:5] / inside - 1).max(),
        np.abs(found.frequency[out][:5] / outside - 1).max(),
        np.abs((model.end_stiffness - stiffness) / np.outer(d, d)).max(),
    )


def rates(fault, smallest):
    """Observed rates between successive sizes, as long as the error is above that of the reference."""
    return [np.log2(coarse / fine) for coarse, fine in itertools.pairwise(fault) if fine > smallest]


@pytest.mark.crossed
@pytest.mark.parametrize("taut", [True, False], ids=["taut", "sagging"])
@pytest.mark.parametrize("element", RATES, ids=lambda element: f"p={element[0]} {element[1]}")
def test_rate(element, taut):
    order, mass = element
    frequency, stiffness = RATES[element]
    if element == (1, "blended") and not taut:
        frequency = 2  # the sag's share of the stiffness is second order, whatever the mass
    table = np.array([errors(taut, size, order, mass) for size in SIZES[order]])
    seen = 0
    for column, declared, smallest in zip(table.T, (frequency, frequency, stiffness), REFERENCE, strict=True):
        observed = rates(column, smallest)
        seen += len(observed)
        if observed:
            assert observed[-1] > declared - 0.35
    assert seen >= 4


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_mean_tension(order):
    """Of the statics: order 2p too."""
    expected, fault = Exact(SAGGING).mean_tension(), []
    for size in SIZES[order]:
        state = state_of(SAGGING, size, order)
        mean = (state.mesh.sizes[:, None] * basis(order).weights * state.tension).sum() * state.force
        fault.append(abs(mean / expected - 1))
    assert rates(fault, 1e-13)[-1] > 2 * order - 0.35


def test_one_element_of_rising_order_converges_exponentially():
    """Each four orders gain at least two digits, until rounding."""
    fault = []
    for order in (4, 8, 12, 16):
        found = Dynamics(state_of(TAUT, 1, order)).lowest(4)
        reference = np.sort(np.concatenate([part[:2] for part in exact(True)[:2]]))
        fault.append(np.abs(found.frequency / reference - 1).max())
    for coarse, fine in itertools.pairwise(fault):
        assert fine < coarse / 100 or fine < 1e-11
