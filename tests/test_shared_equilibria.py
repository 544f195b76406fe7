"""Equilibria that load cases share: found once, with the digits that each case has alone."""

from dataclasses import replace

import numpy as np
import pytest
from suspension_scenes import platform

from cablestudy.scene.scene import load_scene
from cablestudy.statics import equilibria, rest
from cablestudy.statics.tolerances import STATICS
from cablestudy.study.suspension.case import SuspensionCase

BODY = platform().suspension


@pytest.fixture
def searched(monkeypatch):
    """Shapes of the searches of `rest.pose`, from an empty cache on."""
    equilibria.forget()
    found, pose = [], rest.pose
    monkeypatch.setattr(rest, "pose", lambda suspension: found.append(suspension.shape) or pose(suspension))
    return found


def masses(*values):
    """A platform of each mass, as rows of one axis."""
    mass = np.broadcast_to(BODY.mass, (len(values), len(BODY.body_names))).copy()
    mass[:, 0] = values
    return replace(BODY, mass=mass)


def test_equal_rows_are_searched_once(searched):
    first = equilibria.pose(masses(50.0, 60.0, 50.0, 70.0))
    again = equilibria.pose(masses(70.0, 60.0))
    other = equilibria.pose(masses(70.0, 65.0))
    assert searched == [(3,), (2,)]  # before those of the lines that follow
    for found, values in ((first, (50.0, 60.0, 50.0, 70.0)), (again, (70.0, 60.0)), (other, (70.0, 65.0))):
        for row, value in enumerate(values):
            alone = rest.pose(masses(value))
            assert np.array_equal(found.position[row], alone.position[0])
            assert np.array_equal(found.catenary.mean_tension[row], alone.catenary.mean_tension[0])


def test_other_connections_are_other_rows(searched):
    one = masses(50.0)
    held = one.free.copy()
    held[0, 2] = False
    equilibria.pose(one)
    found = equilibria.pose(replace(one, free=held))
    assert searched == [(1,), (1,)]
    assert found.position[0, 0, 2] == one.position[..., 0, 2]


def test_no_more_is_kept_than_there_is_room_for(searched, monkeypatch):
    monkeypatch.setattr(type(STATICS), "remembered_cables", 20)  # of eight cables: two rows
    for value in (50.0, 60.0, 70.0, 70.0, 60.0, 50.0):
        equilibria.pose(masses(value))
    assert len(searched) == 4


@pytest.mark.parametrize("shape", [(), (1, 2)])
def test_axes_of_other_numbers_are_searched_as_they_are(shape):
    suspension = BODY.broadcast(shape) if not shape else masses(50.0, 60.0).broadcast(shape)
    assert equilibria.pose(suspension).record.converged.shape == shape


SPANS = """\
cable: {material: acsr-drake, state: after_creep, tension: {at: horizontal, value: 20 %}}
materials: {string: {mass_per_length: 29 kg/m, axial_stiffness: 50 MN, diameter: 250 mm, expansion: 0 1/K}}
points: {arm: [300 m, 0, 30 m], clamp: {at: [300 m, 0, 27.4 m], free: true, mass: 8 kg}}
cables:
  left: {from: [0, 0, 27 m], to: clamp}
  right: {from: clamp, to: [500 m, 0, 29 m]}
  string: {from: arm, to: clamp, material: string, unstretched_length: 2.6 m}
cases: {cold: {temperature: -20 degC}, hot: {temperature: 75 degC}}
"""


def test_load_cases_share_the_reference_state_and_creep(searched, tmp_path):
    """Two spans of a conductor after creep: of another load case only the search in it is a new one."""
    (tmp_path / "spans.yaml").write_text(SPANS, encoding="utf-8")
    counts, tensions = [], []
    for name in ("cold", "hot", "cold"):
        before = len(searched)
        case = SuspensionCase(load_scene(tmp_path / "spans.yaml", case=name)[1])
        tensions.append(case.equilibrium.catenary.mean_tension[0])
        counts.append(len(searched) - before)
    assert tensions[1] < tensions[0] == tensions[2]
    assert 1 <= counts[1] <= counts[0] / 2
    assert counts[2] == 0
