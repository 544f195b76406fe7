"""Other units change no digit: random cables, scaled by powers of two, warnings as errors."""

from dataclasses import replace

import numpy as np
import pytest
from campaign import campaign
from random_scenes import scene_data, scene_of

from cablestudy.cable import catenary, equilibrium
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.meshes import mesh_pieces, mesh_segments, pieces
from cablestudy.errors import CablestudyError, ConvergenceError
from cablestudy.scene.cable_table import DampingTable
from cablestudy.study.one_cable.case import CableCase
from cablestudy.system.ends import Ends

SEEDS = campaign(range(24), range(0, 24, 4))
SCALES = [(2.0**-20, 1, 1), (2.0**20, 1, 1), (1, 2.0**-20, 1), (1, 2.0**20, 1), (1, 1, 2.0**-20), (1, 1, 2.0**20)]
DAMPINGS = (DampingTable(model="modal", ratio=0.01), DampingTable(model="hysteretic", loss_factor=0.02))


def scaled(span, length, mass, force):
    """The same cable with lengths, masses and forces in other units."""
    return replace(
        span, chord=span.chord * length, axial_stiffness=span.axial_stiffness * force, mass=span.mass * mass / length,
        gravity=span.gravity * force / mass, load_positions=span.load_positions * length,
        load_forces=span.load_forces * force,
    )  # fmt: skip


def models(found, span):
    """States of the spectral elements on the closed form, and of a dozen bars, where there are any."""
    if found.min_tension > 1e-12 * found.max_tension:
        edges = pieces(found.segments.fraction, found.singularities)
        if len(edges) < 9:
            yield equilibrium.from_catenary(found, mesh_pieces(edges, (1,) * (len(edges) - 1), 9))
    try:
        yield equilibrium.solve(found, mesh_segments(found.segments.fraction, 12))[0]
    except ConvergenceError as error:
        assert "slack" in str(error)  # noqa: PT017


def numbers(span, length, mass, force):
    """Results of a cable in the first units."""
    found = catenary.solve(span)
    if not found.record.converged:
        return []
    tensions = found.mean_tension, found.max_tension, found.min_tension, found.horizontal_tension
    results = [tension / force for tension in tensions]
    results += [found.sag / length, found.middle, found.end_stiffness * length / force]
    results += [found.end_forces("global") / force]
    rate = np.sqrt(force / mass / length)
    for state in models(found, span):
        dynamics = Dynamics(state)
        modes = dynamics.modes(dynamics.dof)
        results += [state.max_tension / force, state.min_tension / force, dynamics.end_stiffness * length / force]
        results += [
            modes.frequency / rate,
            modes.errors,
            modes.symmetries,
            modes.participation * length * np.sqrt(mass) / force,
        ]
        ends = Ends(dynamics, span.frame, dynamics.dof)
        for damping in DAMPINGS:
            omega = 2 * np.pi * modes.frequency[0] * np.array([0.3, 1.1, 3.1])
            results.append(ends.superelement(damping).dynamic_stiffness(1j * omega) * length / force)
    return results


@pytest.mark.parametrize("seed", SEEDS)
def test_no_digit_depends_on_the_units(seed):
    data = scene_data(seed)
    data.pop("gondola", None)
    data["cable"].pop("damping", None)
    try:
        span = CableCase(scene_of(data, 1e-4)).span
    except CablestudyError:
        return
    first = numbers(span, 1, 1, 1)
    for scale in SCALES:
        for one, other in zip(first, numbers(scaled(span, *scale), *scale), strict=True):
            assert np.array_equal(one, other, equal_nan=True)
