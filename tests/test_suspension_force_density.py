"""Form finding by force densities (`statics/force_density.py`)."""

import numpy as np
import pytest
from suspensions import body, cable, point, suspension, with_values

from cablestudy.errors import NoSolutionError
from cablestudy.statics import force_density, rest

CORNERS = [(0, 0, 0.0), (10, 0, 3.0), (10, 10, 0.0), (0, 10, 3.0)]


def net(gravity=0.0, mass=0.0, densities=(1.0, 1.0, 1.0, 1.0)):
    """Four corners, one free point."""
    lines = [cable(c, "p", 1e9, given=None, density=q) for c, q in zip(CORNERS, densities, strict=True)]
    return suspension([], lines, [point("p", (1, 2, 9), mass, force=(0, 0, 6.0))], gravity=gravity)


def test_one_point_is_the_weighted_mean_of_its_neighbours():
    """x = (sum q x_k + p)/sum q; weight and dead force both count."""
    densities = np.array([1.0, 2.0, 3.0, 4.0])
    found, tension = force_density.find_form(net(9.81, 0.5, densities))
    load = np.array([0, 0, 6.0 - 0.5 * 9.81])
    expected = (densities @ np.array(CORNERS) + load) / 10
    np.testing.assert_allclose(found.position[0], expected, rtol=1e-14)
    lengths = np.linalg.norm(np.array(CORNERS) - expected, axis=-1)
    np.testing.assert_allclose(tension, densities * lengths, rtol=1e-13)


def test_the_form_is_in_equilibrium():
    """With the tensions that belong to it each point of the exact model stays where it is; bodies stand."""
    rng = np.random.default_rng(2)
    names = ["p", "q", "r"]
    anchors = rng.normal(size=(5, 3)) * 10
    pairs = [(tuple(anchors[i]), names[i % 3]) for i in range(5)] + [("p", "q"), ("q", "r"), ("r", ("b", (0, 0, 1.0)))]
    lines = [cable(*pair, 1e6, given=None, density=rng.uniform(50, 200)) for pair in pairs]
    held = body("b", (0, 0, 20.0), 1.0, free=(False,) * 6)
    scene = suspension([held], lines, [point(n, (0, 0, 0), 2.0) for n in names])
    found, tension = force_density.find_form(scene)
    exact = rest.pose(with_values(found, "preload", tension))
    assert exact.record.converged
    np.testing.assert_allclose(exact.position, found.position, atol=1e-9)
    np.testing.assert_array_equal(found.position[0], scene.position[0])


def test_cases_of_a_batch():
    densities = np.array([[1.0, 1, 1, 1], [1, 2, 3, 4]])
    from dataclasses import replace

    found, _ = force_density.find_form(replace(net(), force_density=densities))
    for i in range(2):
        alone, _ = force_density.find_form(net(densities=densities[i]))
        np.testing.assert_array_equal(found.position[i], alone.position)


def test_refusals():
    with pytest.raises(NoSolutionError, match="no force density of c2"):
        force_density.find_form(net(densities=(1, 1, np.nan, 1)))
    with pytest.raises(NoSolutionError, match="do not hold p"):
        force_density.find_form(net(densities=(1, -1, 1, -1)))
