"""The section of `cablestudy new section`, against a computation of its own: spans and strings as elastic catenaries.

Unknown are the tension vector at the upper end of each cable and the places of the clamps; the equations are those of
each catenary between its ends, and the balance of each clamp, solved together by scipy.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scenes import G, tables_of_new
from scipy.optimize import root

pytestmark = pytest.mark.usefixtures("folder")
# acsr-drake (materials.yaml): EA [N], mass [kg/m], breaking force [N], expansion [1/K]
EA, MASS, BREAKING, EXPANSION = 77e9 * 468.6e-6, 1.628, 140.1e3, 18.9e-6
STRING_EA, STRING_MASS, STRING, CLAMP = 50e6, 29.0, 2.6, 8.0
TOWERS = np.array([[310.0, 30.0], [730.0, 37.0], [910.0, 33.0]])
DEAD_ENDS = np.array([[0.0, 27.0], [1260.0, 32.0]])
PLUMB = TOWERS - [0.0, STRING]


def reach(force, length, stiffness, weight):
    """End 2 from end 1, shape (2,), of an elastic catenary whose tension vector is (H, V + w s): Irvine (1981), 1.3."""
    h, v = force
    ends = np.array([v, v + weight * length])
    tension = np.hypot(h, ends)
    x = h * length / stiffness + h / weight * np.diff(np.arcsinh(ends / abs(h)))[0]
    z = np.diff(ends**2)[0] / (2 * stiffness * weight) + np.diff(tension)[0] / weight
    return np.array([x, z])


@dataclass(frozen=True)
class Line:
    """The section on a day."""

    lengths: np.ndarray  # of the spans [m]
    weight: float  # of a length of the conductor [N/m]

    def residual(self, unknown):
        """Gaps of the catenaries [m] and imbalance of the clamps, over 1 kN."""
        forces, clamps = unknown[:14].reshape(7, 2) * 1e3, unknown[14:].reshape(3, 2)
        places = np.vstack([DEAD_ENDS[:1], clamps, DEAD_ENDS[1:]])
        gaps, ends = [], []
        for k, length in enumerate(self.lengths):
            gaps.append(reach(forces[k], length, EA, self.weight) - (places[k + 1] - places[k]))
            ends.append(forces[k] + [0.0, self.weight * length])
        balance = []
        for k in range(3):  # a string is given upwards, from its clamp to its tower
            string = forces[4 + k]
            gaps.append(reach(string, STRING, STRING_EA, STRING_MASS * G) - (TOWERS[k] - clamps[k]))
            balance.append((forces[k + 1] - ends[k] + string - [0.0, CLAMP * G]) / 1e3)
        return np.concatenate([*gaps, *balance])

    def solve(self, unknown):
        """Tension vectors [N] and places of the clamps [m], from some values nearby."""
        found = root(self.residual, unknown, tol=1e-13).x
        assert np.abs(self.residual(found)).max() < 1e-10
        return found[:14].reshape(7, 2) * 1e3, found[14:].reshape(3, 2)


def span_with(horizontal, gap, weight):
    """Tension vector at end 1 and unstretched length of a span with a stated horizontal tension."""
    start = [-weight * gap[0] / 2 / 1e3, gap[0]]
    found = root(lambda x: reach((horizontal, 1e3 * x[0]), x[1], EA, weight) - gap, start, tol=1e-14)
    return 1e3 * found.x[0], found.x[1]


def stated():
    """Lengths of the spans as they were clipped, and the unknowns there: the strings stretch by what they carry."""
    weight, horizontal, clamps = MASS * G, 0.2 * BREAKING, PLUMB
    for _ in range(6):
        gaps = np.diff(np.vstack([DEAD_ENDS[:1], clamps, DEAD_ENDS[1:]]), axis=0)
        vertical, lengths = np.array([span_with(horizontal, gap, weight) for gap in gaps]).T
        carried = vertical[:3] + weight * lengths[:3] - vertical[1:] + CLAMP * G
        stretch = STRING * (carried + STRING_MASS * G * STRING / 2) / STRING_EA
        clamps = PLUMB - np.stack([0 * stretch, stretch], axis=-1)
    spans = np.stack([np.full(4, horizontal), vertical], axis=-1)
    strings = np.stack([np.full(3, 1.0), carried], axis=-1)
    return lengths, np.concatenate([np.vstack([spans, strings]).ravel() / 1e3, clamps.ravel()])


def section(*options):
    return tables_of_new("section", ("points", "cables"), *options)


def test_the_conductor_is_the_one_of_this_file():
    _, cables = section()
    span = cables["span1"]
    assert span["axial_stiffness_N"] == pytest.approx(EA, rel=1e-12)
    assert (span["mass_per_length_kg_per_m"], span["breaking_force_N"]) == pytest.approx((MASS, BREAKING), rel=1e-12)


def test_strings_hang_plumb_where_the_tension_of_the_section_is_stated():
    points, cables = section()
    lengths, unknown = stated()
    for k, length in enumerate(lengths, 1):
        assert cables[f"span{k}"]["horizontal_tension_N"] == pytest.approx(0.2 * BREAKING, rel=1e-9)
        assert cables[f"span{k}"]["unstretched_length_m"] == pytest.approx(length, rel=1e-9)
    for k, (x, z) in enumerate(unknown[14:].reshape(3, 2), 1):
        assert points[f"clamp{k}"]["x_m"] == pytest.approx(x, abs=1e-6)
        assert points[f"clamp{k}"]["z_m"] == pytest.approx(z, abs=1e-7)
        assert cables[f"string{k}"]["inclination_from_plumb_deg"] == pytest.approx(0, abs=1e-4)


@pytest.mark.parametrize(("case", "warmer"), [("hot", 65.0), ("cold", -45.0)])
def test_spans_and_strings_are_those_of_all_catenaries_together(case, warmer):
    points, cables = section("--case", case)
    lengths, start = stated()
    forces, clamps = Line(lengths * (1 + EXPANSION * warmer), MASS * G / (1 + EXPANSION * warmer)).solve(start)
    for k in range(4):
        assert cables[f"span{k + 1}"]["horizontal_tension_N"] == pytest.approx(forces[k, 0], rel=1e-9)
    for k in range(3):
        angle = np.degrees(np.arctan2(abs(TOWERS[k, 0] - clamps[k, 0]), TOWERS[k, 1] - clamps[k, 1]))
        assert cables[f"string{k + 1}"]["inclination_from_plumb_deg"] == pytest.approx(angle, abs=1e-5)
        assert points[f"clamp{k + 1}"]["x_m"] == pytest.approx(clamps[k, 0], abs=1e-6)
        assert points[f"clamp{k + 1}"]["z_m"] == pytest.approx(clamps[k, 1], abs=1e-6)
