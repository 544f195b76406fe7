"""RMS in the wind where a wave along a cable lies above the modes of the model: rods in closed form, and more modes.

A cable with next to no weight moves its gondola along x as a rod does, with EA u'' = m u_tt + c u_t and EA (1 + s time)
in place of EA; its waves across are the modes that the model has.
"""

import numpy as np
import pytest
from command import CONFIGS

from cablestudy.motion.gust_response import GustResponse
from cablestudy.motion.peaks import winch_speeds
from cablestudy.scene.scene import CableScene, load_scene
from cablestudy.study.one_cable.case import Case
from cablestudy.study.suspension.case import SuspensionCase

LENGTH, EA, LINE, PRELOAD, TIME, VISCOUS = 100.0, 5e5, 0.2, 100.0, 5e-5, 2e-3
BANDWIDTH, FILTER, SPEED, SIGMA, SCALE, DENSITY, TURN = 30.0, 40.0, 10.0, 1.5, 25.0, 1.2, 2 * np.pi
LAW = {"gain": 0.05, "proportional_gain": 0.02, "derivative_gain": 0.005}


def scene(mass, factor, accuracy):
    """A gondola on the cable in the wind; with a factor of the gains of `LAW`, or 0 for no winch."""
    area = 1e-5
    damping = {"model": "kelvin_voigt", "time": TIME, "viscous": VISCOUS}
    law = {name: factor * gain for name, gain in LAW.items()} | {"derivative_filter": FILTER, "notch": "none"}
    cable = {"chord": LENGTH, "area": area, "elastic_modulus": EA / area, "density": LINE / area, "preload": PRELOAD}
    winch = {"winch": {"location": "ground", "bandwidth": BANDWIDTH, "controller": law}} if factor else {}
    wind = {"speed": SPEED, "turbulence_rms": SIGMA, "length_scale": SCALE, "air_density": DENSITY}
    wind |= {"spectrum": "von_karman", "admittance": "none", "aerodynamic_damping": False}
    gondola = {"mass": mass, "area": 1.0, "drag_coefficient": 1.0}
    own = {"gravity": 1e-5, "cable": cable | {"damping": damping}, "gondola": gondola, "wind": wind}
    return CableScene.model_validate({**own, **winch, "model": {"accuracy": accuracy}})


def truth(mass, factor):
    """RMS of displacement and velocity of the gondola, and of the speed of the winch [m, m/s, m/s]."""

    def spectra(frequency):
        s = 1j * TURN * frequency
        stiffness = EA * (1 + s * TIME)
        wave, length = np.sqrt(-(LINE * s**2 + VISCOUS * s) / stiffness), LENGTH / (1 + PRELOAD / EA)
        own, across = stiffness * wave / np.tan(wave * length), -stiffness * wave / np.sin(wave * length)
        integral, proportional, derivative = (factor * gain for gain in LAW.values())
        law = integral / s + proportional + derivative * s / (1 + s / (TURN * FILTER))
        law = law / (1 + s / (TURN * BANDWIDTH))
        moved = 1 / (mass * s**2 + own - across * law)
        x = frequency * SCALE / SPEED
        gusts = SIGMA**2 * SCALE / SPEED * 4 / (1 + 70.7 * x**2) ** (5 / 6) * (DENSITY * SPEED) ** 2
        return np.abs(moved * np.stack([np.ones_like(s), s, s * law])) ** 2 * gusts

    scan = np.geomspace(0.1, 3000, 400_001)
    height = spectra(scan)[1]
    peaks = scan[1:-1][(height[1:-1] > height[:-2]) & (height[1:-1] > height[2:])]
    aside = np.geomspace(1e-6, 0.02, 40)
    beside = peaks[:, None] * (1 + np.concatenate([-aside, [0.0], aside]))
    edges = np.union1d(np.geomspace(1e-8, 3000, 400), beside)
    node, weight = np.polynomial.legendre.leggauss(12)
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:, None] + edges[:-1, None]) / 2
    return np.sqrt((spectra((middle + half * node).ravel()) * (half * weight).ravel()).sum(axis=1))


@pytest.mark.crossed
@pytest.mark.parametrize("accuracy", [1e-4, 1e-6])
@pytest.mark.parametrize(("mass", "factor"), [(30.0, 0.047), (100.0, 0.136), (200.0, 0.298), (30.0, 0.0), (45.0, 0.0)])
def test_waves_along_the_cable_above_the_modes_are_in_the_stated_error(mass, factor, accuracy):
    """With PID gains of 0.4 of the largest, a wave of 8.4 Hz above 32 modes up to 3.5 Hz is next to undamped."""
    analysis = Case(scene(mass, factor, accuracy)).in_wind
    found = [analysis.rms(["gondola.x"], name, open_loop=False) for name in ("value", "rate")]
    found.append(winch_speeds(analysis)[0])
    for (value, error), expected in zip(found, truth(mass, factor), strict=True):
        assert abs(value - expected) <= error * expected
        assert error < 3e-3


def test_waves_along_three_bridles_above_the_modes_are_in_the_stated_error():
    """A telescope on nine cables: 100 modes up to 5.1 Hz, which show a third of what they leave out, against 200."""
    scene = load_scene(CONFIGS / "suspensions" / "carlina-balloon-wind.yaml")[1]
    own, true = (GustResponse(SuspensionCase(scene).in_wind.closed_loop_of(count), scene, least=5e-7).variances
                 for count in (100, 200))  # fmt: skip
    for axis in "xy":
        row = own.rows[f"gondola.focus.{axis}"]
        change, error = abs(own.weighted["rate"][row] - true.weighted["rate"][row]), own.error["rate"][row]
        assert 5e-4 * true.weighted["rate"][row] < change < error < 5 * change
