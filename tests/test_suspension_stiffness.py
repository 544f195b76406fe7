"""Tangent stiffness of suspensions (`statics/tangent.py`): against differences of forces, closed forms, dense bars."""

from dataclasses import replace

import numpy as np
import pytest
from suspensions import body, cable, point, sagging, suspension, trifilar

from cablestudy.statics import force_density, pose_state, rest, stability, tangent
from cablestudy.statics.rigid import cross_matrix
from cablestudy.statics.tolerances import STATICS


@pytest.fixture(scope="module")
def at_rest():
    """Two bodies and two junctions at rest."""
    found = rest.pose(sagging())
    assert found.record.converged
    assert found.stability.stable
    return found


def differences(found, step=1e-6):
    """-d(net forces)/d(displacements and rotations) of all degrees of freedom, by central differences."""
    flat = found.suspension.broadcast((1,))
    own = replace(flat, position=found.position[None], rotation=found.rotation[None], value=found.lengths[None])
    state, count = rest.start(replace(own, stated=("unstretched_length",) * len(own.stated))), own.position.shape[1]
    columns = []
    for i in range(6 * count):
        move = np.zeros(6 * count)
        move[i] = step
        forces = [
            pose_state.evaluate(own, pose_state.displaced(own, state, sign * move.reshape(1, count, 6))).net.ravel()
            for sign in (1, -1)
        ]
        columns.append((forces[1] - forces[0]) / (2 * step))
    return np.stack(columns, axis=-1)


def test_differences_of_forces(at_rest):
    """Held degrees of freedom too; junctions have no moments."""
    count = len(at_rest.suspension.body_names)
    whole = tangent.full(at_rest.blocks, count)
    expected = differences(at_rest)
    np.testing.assert_allclose(whole, expected, atol=2e-8 * np.abs(expected).max())


def test_the_energy_and_its_slope():
    """Along any step from any pose the energy changes as the net forces tell, dead moments included."""
    flat = sagging().broadcast((1,))
    flat = replace(flat, moment=flat.moment + np.array([4.0, -3, 5]))
    state = rest.start(flat)
    step = np.random.default_rng(8).normal(size=(1, 4, 6)) * flat.free
    along = np.polynomial.legendre.leggauss(12)
    size, slope = 2e-3, 0.0  # without a cable that becomes taut on the way
    for place, weight in zip(*along, strict=True):
        there = pose_state.evaluate(flat, pose_state.displaced(flat, state, step * size * (1 + place) / 2))
        slope += weight / 2 * size * (there.net * step).sum()
    first, last = (pose_state.evaluate(flat, pose_state.displaced(flat, state, step * x)) for x in (0, size))
    change = last.energy - first.energy - pose_state.displaced_with_work(flat, state, step * size)[1]
    assert change[0] == pytest.approx(-slope, rel=1e-7)


def test_symmetric_under_all_loads_only(at_rest):
    """K_tt - K_tt^T = [M x], M the moment of the loads that are counted: zero for all of them."""
    whole = tangent.full(at_rest.blocks, len(at_rest.suspension.body_names))
    np.testing.assert_allclose(whole, whole.T, atol=1e-9 * np.abs(whole).max())
    center, weight = tangent.weights(at_rest.suspension, at_rest.rotation)
    ends, arms = at_rest.end_forces, at_rest.arms
    own = at_rest.suspension.owner == 0
    moment = np.cross(arms[own], ends[own]).sum(axis=0)  # of the cables alone on the first body
    np.testing.assert_allclose(moment, -np.cross(center[0], weight[0]), atol=1e-9)
    cables_only = whole[3:6, 3:6] + cross_matrix(weight[0]) @ cross_matrix(center[0])
    np.testing.assert_allclose(cables_only - cables_only.T, cross_matrix(moment), atol=1e-7 * np.abs(moment).max())
    assert np.abs(moment).max() > 1


def test_a_dead_moment_makes_it_unsymmetric():
    """A moment that keeps its axis has no potential: the difference of the halves is its cross matrix."""
    loaded = trifilar(moment=(3.0, -2.0, 4.0), line=0.2)
    found = rest.pose(loaded)
    assert found.record.converged
    block = found.body_stiffness[0, 3:, 3:]
    np.testing.assert_allclose(block.T - block, cross_matrix(loaded.moment[0]), atol=1e-6)
    np.testing.assert_allclose(differences(found)[3:, 3:], block, atol=2e-6 * np.abs(block).max())


def test_junctions_follow(at_rest):
    """The inverse of a body's part of the compliance of the body and the junctions, the other body held."""
    for which in range(2):
        own = at_rest.suspension
        held = own.free.copy()
        held[1 - which] = False
        held[which] = True
        blocks = at_rest.blocks
        dense = tangent.dense(blocks, replace(own, free=held))
        compliance = np.linalg.inv(dense)[:6, :6]
        np.testing.assert_allclose(at_rest.body_stiffness[which], np.linalg.inv(compliance), rtol=1e-9, atol=1e-6)


def test_dense_and_sparse_agree(at_rest):
    sparse = tangent.sparse(at_rest.blocks, at_rest.suspension).toarray()
    np.testing.assert_allclose(sparse, at_rest.stiffness, atol=1e-10)


def test_trifilar_pendulum():
    """Sway m g/h, yaw m g r^2/h, heave N EA/L0; tilt (N/2)(EA/L0) r^2 less what the weight below takes."""
    count, r, h, m, zg, ea = 3, 0.8, 20.0, 50.0, 0.4, 1e7
    found = rest.pose(trifilar(count, r, h, m, zg, ea, line=0.0))
    k, weight, length = found.body_stiffness[0], m * 9.81, found.lengths[0]
    # a cable's tangent stiffness: EA/L0 along, T/h across
    assert k[0, 0] == pytest.approx(weight / h, rel=1e-8)
    assert k[1, 1] == pytest.approx(weight / h, rel=1e-8)
    assert k[2, 2] == pytest.approx(count * ea / length, rel=1e-9)
    assert k[5, 5] == pytest.approx(weight * r**2 / h, rel=1e-8)
    # about the reference point in the plane of the attachments: springs EA/L0 - T/h and pull T on arms r, weight below
    assert k[3, 3] == pytest.approx(count / 2 * ea / length * r**2 + weight * zg, rel=1e-8)
    np.testing.assert_allclose(k - np.diag(np.diagonal(k)), 0, atol=1e-5)


def test_batch_and_single_agree():
    """Of several cases, each one's stiffness to the last digit as if it were alone."""
    one = sagging()
    heavier = np.array([1.0, 1.2, 0.8])[:, None] * one.mass
    together = rest.pose(replace(one, mass=heavier))
    assert together.body_stiffness.shape == (3, 2, 6, 6)
    for i, mass in enumerate(heavier):
        alone = rest.pose(replace(one, mass=mass))
        np.testing.assert_array_equal(alone.position, together.position[i])
        np.testing.assert_array_equal(alone.lengths, together.lengths[i])
        np.testing.assert_allclose(alone.stiffness, together.stiffness[i], rtol=1e-13, atol=1e-13)


def test_flat_net_of_massless_cables():
    """Out of plane a square net of tension T and spacing a is T/a times the five-point difference matrix."""
    n, a, tension, ea = 3, 2.0, 500.0, 1e6
    places = {(i, j): (a * i, a * j, 0.0) for i in range(n + 2) for j in range(n + 2)}
    inside = [(i, j) for i in range(1, n + 1) for j in range(1, n + 1)]

    def end(key):
        return f"p{key}" if key in inside else places[key]

    lines = [
        cable(end((i, j)), end((i + di, j + dj)), ea, value=a / (1 + tension / ea))
        for (i, j) in places
        for di, dj in ((1, 0), (0, 1))
        if (i, j) in inside or (i + di, j + dj) in inside
    ]
    found = rest.pose(suspension([], lines, [point(f"p{key}", places[key]) for key in inside], gravity=0.0))
    assert found.record.converged
    vertical = found.stiffness[2::3, 2::3]
    values = np.sort(np.linalg.eigvalsh(vertical))
    angles = np.sin(np.pi * np.arange(1, n + 1) / (2 * (n + 1))) ** 2
    expected = np.sort((4 * tension / a * (angles[:, None] + angles)).ravel())
    np.testing.assert_allclose(values, expected, rtol=1e-9)


def test_least_eigenvalue_dense_and_sparse():
    """The same stability from the dense matrix and from the sparse one."""
    found = rest.pose(sagging())
    own = found.suspension
    scales = np.sqrt(tangent.magnitudes(found.blocks, own))
    value, vector = stability._least_eigenvalue(tangent.scaled_sparse(found.blocks, own, scales))
    assert value == pytest.approx(found.stability.least, rel=1e-9)
    assert np.linalg.norm(vector) == pytest.approx(1)


def test_bodies_without_free_degrees_have_a_stiffness():
    """Held degrees of freedom are moved too: two springs of a held body."""
    held = suspension(
        [body("b", (0, 0, 0), 1.0, free=(False,) * 6)],
        [
            cable((0, 0, 5.0), ("b", (0, 0, 1.0)), 1e4, value=3.9),
            cable((0, 0, -5.0), ("b", (0, 0, -1.0)), 1e4, value=3.9),
        ],
    )
    found = rest.pose(held)
    k = found.body_stiffness[0]
    tension = 1e4 * (4 / 3.9 - 1)
    assert k[2, 2] == pytest.approx(2 * 1e4 / 3.9, rel=1e-12)
    assert k[0, 0] == pytest.approx(2 * tension / 4, rel=1e-12)
    assert k[5, 5] == pytest.approx(0, abs=1e-12)
    assert found.stability.stable  # nothing is free


@pytest.mark.parametrize("dense_freedoms", [100, 0], ids=["dense", "sparse"])
def test_displacements_and_condensed_stiffness_are_those_of_the_whole_matrix(at_rest, monkeypatch, dense_freedoms):
    """Few equations are dense, many are sparse: both hold against K u = f and K_bb - K_bj K_jj^-1 K_jb, written out."""
    monkeypatch.setattr(type(STATICS), "dense_freedoms", dense_freedoms)
    suspension, blocks, bodies = at_rest.suspension, at_rest.blocks, 6 * at_rest.suspension.bodies
    whole = tangent.full(blocks, len(suspension.body_names))
    free = suspension.free.ravel()
    forces = np.random.default_rng(3).normal(size=(free.sum(), 2))
    found = tangent.displacements(blocks.of(None), suspension, forces[None])
    assert whole[np.ix_(free, free)] @ found[0] == pytest.approx(forces, abs=1e-9)
    junctions = np.flatnonzero(free & (np.arange(len(free)) >= bodies))
    following = np.linalg.inv(whole[np.ix_(junctions, junctions)]) @ whole[junctions, :bodies]
    condensed = whole[:bodies, :bodies] - whole[:bodies, junctions] @ following
    for body_number, of_body in enumerate(tangent.body_stiffness(blocks, suspension)):
        rows = slice(6 * body_number, 6 * body_number + 6)
        assert of_body == pytest.approx(condensed[rows, rows], abs=1e-9 * np.abs(condensed).max())


def test_one_point_of_many_has_the_form_of_one_of_few(monkeypatch):
    """The sparse equations of force densities have the weighted mean of the neighbours too."""
    monkeypatch.setattr(type(STATICS), "dense_freedoms", 0)
    corners, densities = np.array([(0, 0, 0.0), (10, 0, 3.0), (10, 10, 0.0)]), np.array([1.0, 2.0, 3.0])
    lines = [cable(tuple(c), "p", 1e9, given=None, density=q) for c, q in zip(corners, densities, strict=True)]
    found, _ = force_density.find_form(suspension([], lines, [point("p", (1, 2, 9), 0.0)], gravity=0.0))
    assert found.position[0] == pytest.approx(densities @ corners / 6, rel=1e-14)
