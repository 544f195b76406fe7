"""State space of suspensions against dense bars, the statics of neighbouring scenes and one cable."""

from dataclasses import replace

import numpy as np
import pytest
from campaign import campaign
from references import bar_suspension
from suspension_scenes import hung, platform, suspension

from cablestudy.cable.damping import Damping
from cablestudy.control import export, statespace
from cablestudy.control.suspension import Marker, suspension_system
from cablestudy.control.winches import FROM, TO, EndMovement, Winch
from cablestudy.errors import NoSolutionError
from cablestudy.statics.suspension import GROUND, outward_tangents
from cablestudy.system.cables import Models
from cablestudy.system.coupled import Layout
from cablestudy.system.hanging_cables import UNDAMPED, Cables, FixedModel, fixed_meshes

EIGHT = FixedModel(8)
WINCHES = (Winch(0), Winch(5), Winch(6, TO))
MARKERS = (Marker("focus", 0, (0.1, 0.2, -0.5)),)


def state_space(layout, kept, winches=(), markers=()):
    """`StateSpace` with all coordinates."""
    system = suspension_system(layout, kept, winches, markers).viscous()
    return statespace.state_space_of(system, system)


def model(state, damping=UNDAMPED, limit=np.inf, mesh=EIGHT):
    """Layout and coordinates of all cables."""
    cables = Cables(state.catenary, damping)
    models = Models(cables, fixed_meshes(cables, mesh), fixed=True)
    return Layout(state), models.coordinates(np.full(cables.count, limit)).kept


KEPT = []


def eight_bars(state):
    """Eight dense bars for each cable of an equilibrium: those of the last one are kept for its next frequency."""
    if not KEPT or KEPT[0][0] is not state:
        KEPT[:] = [(state, bar_suspension.dense(state, 8))]
    return KEPT[0][1]


def names(pairs):
    return [name for name, _ in pairs]


def by_bars(state, frequency, viscous, time, modes=slice(None)):
    """Outputs per input at a frequency [Hz] by dense bars: inputs WINCHES and the six loads.

    All nodes move as a sum of some of the `modes`, of all of them by default.
    """
    reference, s = eight_bars(state), 2j * np.pi * frequency
    rate = viscous / 0.3
    direction, tension = outward_tangents(state)
    balance = reference.K + s**2 * reference.M + time * s * reference.elastic
    n = len(balance)
    right = np.zeros((n, len(WINCHES) + 6), dtype=complex)
    right[-6:, -6:] = np.eye(6)
    wound = []
    for cable, ((K, M, E), move) in enumerate(zip(reference.cables, reference.maps, strict=True)):
        balance = balance + rate * s * move.T @ M @ move
        dynamic = K + (s**2 + rate * s) * M + time * s * E
        imposed = np.zeros((len(K), right.shape[1]), dtype=complex)
        for place, winch in enumerate(WINCHES):
            if winch.cable == cable:
                stretch = 1 + tension[cable, winch.end] / 4e5
                rows = slice(0, 3) if winch.end == FROM else slice(-3, None)
                imposed[rows, place] = direction[cable, winch.end] * stretch
                right[:, place] += move[rows].T @ [0, 0, 0.3 * 9.81]
        right = right - move.T @ dynamic @ imposed
        wound.append((dynamic, imposed))
    shapes = reference.modes()[1][:, modes]
    x = shapes @ np.linalg.solve(shapes.T @ balance @ shapes, shapes.T @ right)
    arm = state.rotation[0] @ MARKERS[0].position
    found = [x[-6:], x[-6:-3] + np.cross(x[-3:], arm, axis=0)]
    for cable, ((dynamic, imposed), move) in enumerate(zip(wound, reference.maps, strict=True)):
        force = dynamic @ (move @ x + imposed)
        change = np.array([direction[cable, 0] @ force[:3], direction[cable, 1] @ force[-3:]])
        for place, winch in enumerate(WINCHES):
            if winch.cable == cable:  # the weight of what was reeled in hangs no more
                change[winch.end, place] -= 0.3 * 9.81 * direction[cable, winch.end, 2]
        found.append(change)
    return np.concatenate(found)


def agree(found, expected, tolerance):
    """Entries of each row, relative to the largest of the row."""
    size = np.abs(expected).max(axis=1)
    assert np.abs(found - expected).max(axis=1) / size == pytest.approx(0 * size, abs=tolerance)


@pytest.mark.parametrize("time", [0.0, 3e-4])
def test_the_response_is_that_of_dense_bars(time):
    state = platform()
    damping = Damping("kelvin_voigt" if time else "modal", time=time, viscous=0.02)
    system = state_space(*model(state, damping), WINCHES, MARKERS)
    frequency = np.array([1e-3, 0.7, 1.0698, 2.0, 8.0, 15.0])
    found = system.response(2j * np.pi * frequency, derivatives=True)
    for value, at in zip(found, frequency.tolist(), strict=True):
        agree(value, by_bars(state, at, 0.02, time), 1e-8)


def test_the_static_gain_is_that_of_neighbouring_equilibria():
    """Lengths, forces and moments changed a little: displacements and tensions by central differences."""
    state = platform()
    layout, kept = model(state, mesh=FixedModel(2, 16))
    system = state_space(layout, kept, WINCHES, MARKERS)
    found = system.response(np.zeros(1))[0].real

    def outputs(lengths, force, moment):
        return outputs_about(state, hung(replace_loads(state.suspension, force, moment), lengths))

    for place, winch in enumerate(WINCHES):
        step = 1e-4 * np.eye(8)[winch.cable]
        difference = outputs(state.lengths - step, 0, 0) - outputs(state.lengths + step, 0, 0)
        expected = difference / 2e-4
        assert found[:9, place] == pytest.approx(expected[:9], abs=1e-8)
        assert found[9:, place] == pytest.approx(expected[9:], abs=1e-6 * np.abs(expected[9:]).max())
    for axis in range(3):
        force, moment = 0.1 * np.eye(3)[axis], 0.01 * np.eye(3)[axis]
        for place, (loads, size) in {3 + axis: ((force, 0), 0.1), 6 + axis: ((0, moment), 0.01)}.items():
            both = [outputs(state.lengths, sign * loads[0], sign * loads[1]) for sign in (1, -1)]
            expected = (both[0] - both[1]) / (2 * size)
            assert found[:, place] == pytest.approx(expected, abs=3e-6 * np.abs(expected).max())


@pytest.mark.parametrize(("cable", "end"), campaign([(0, TO), (2, TO), (5, FROM), (6, TO)], [(2, TO), (5, FROM)]))
def test_the_static_gain_of_a_carriage_is_that_of_equilibria_with_the_end_elsewhere(cable, end):
    """On board too, where the cable's force on a body that may turn has another arm once the end is moved."""
    state, step = platform(), 1e-4
    along = np.array([0.36, 0.48, 0.8])
    layout, kept = model(state, mesh=FixedModel(2, 16))
    found = state_space(layout, kept, (Winch(cable, end, along),), MARKERS).response(np.zeros(1))[0, :, 0].real
    suspension = state.suspension
    on_board = suspension.owner[cable, end] != GROUND
    move = step * (state.rotation[0].T @ along if on_board else along)
    places = [suspension.attachment.copy(), suspension.attachment.copy()]
    places[0][cable, end] += move
    places[1][cable, end] -= move
    forward, back = (outputs_about(state, hung(replace(suspension, attachment=own), state.lengths)) for own in places)
    expected = (forward - back) / (2 * step)
    assert found[:9] == pytest.approx(expected[:9], abs=1e-7)
    assert found[9:] == pytest.approx(expected[9:], abs=1e-6 * np.abs(expected[9:]).max())


@pytest.mark.parametrize("time", [0.0, 3e-4])
def test_forces_on_moved_ends_are_those_of_dense_bars(time):
    """Fixed ends of two cables moved along x, y and z: what holds them, what the body does, and the tensions."""
    state, frequency = platform(), [1e-3, 1.0698, 8.0]
    damping = Damping("kelvin_voigt" if time else "modal", time=time, viscous=0.02)
    fixed = [place for place in [(0, FROM), (3, FROM)] if state.suspension.owner[place] == GROUND]
    assert len(fixed) == 2
    system = state_space(*model(state, damping), [EndMovement(*place, axis) for place in fixed for axis in np.eye(3)])
    ends = [f"{state.suspension.cable_names[cable]}.end_1_{axis}" for cable, _ in fixed for axis in "xyz"]
    assert names(system.inputs)[:6] == ends
    assert names(system.outputs)[6:12] == [end.replace("end", "force_end") for end in ends]
    found = system.response(2j * np.pi * np.array(frequency), derivatives=True)[:, :, :6]
    reference, tangent = eight_bars(state), outward_tangents(state)[0]
    for value, s in zip(found, 2j * np.pi * np.array(frequency), strict=True):
        balance, right = reference.K + s**2 * reference.M + time * s * reference.elastic, 0
        dynamic = []
        for (K, M, E), move in zip(reference.cables, reference.maps, strict=True):
            balance = balance + 0.02 / 0.3 * s * move.T @ M @ move
            dynamic.append(K + (s**2 + 0.02 / 0.3 * s) * M + time * s * E)
        imposed = [np.zeros((len(one), 6)) for one in dynamic]
        for column, (cable, _) in enumerate(fixed):
            imposed[cable][:3, 3 * column : 3 * column + 3] = np.eye(3)
            right = right - reference.maps[cable].T @ dynamic[cable] @ imposed[cable]
        x = np.linalg.solve(balance, right)
        forces = [D @ (move @ x + u) for D, move, u in zip(dynamic, reference.maps, imposed, strict=True)]
        tensions = [[t[0] @ force[:3], t[1] @ force[-3:]] for t, force in zip(tangent, forces, strict=True)]
        expected = [x[-6:], *(forces[cable][:3] for cable, _ in fixed), *tensions]
        agree(value, np.concatenate(expected), 1e-8)


def outputs_about(state, other):
    """Place and small rotation of the body beside an equilibrium, place of the marker, tensions at all ends."""
    turned = other.rotation[0] @ state.rotation[0].T
    angles = np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]) / 2
    focus = other.position[0] + other.rotation[0] @ MARKERS[0].position
    tension = np.linalg.norm(other.end_forces, axis=-1).ravel()
    return np.concatenate([other.position[0], angles, focus, tension])


def replace_loads(model, force, moment):
    return replace(model, force=model.force + force, moment=model.moment + moment)


def test_fewer_coordinates_keep_the_response_up_to_their_frequency():
    state = platform()
    damping = Damping(viscous=0.02)
    layout, every = model(state, damping)
    fewer = model(state, damping, limit=2 * np.pi * 5.0)[1]
    whole, small = (state_space(layout, kept, WINCHES) for kept in (every, fewer))
    assert len(small.a) < 0.75 * len(whole.a)
    s = 2j * np.pi * np.array([0.3, 1.2, 2.5])
    one, two = whole.response(s, derivatives=True)[:, :6], small.response(s, derivatives=True)[:, :6]
    assert (np.abs(two - one).max(axis=(1, 2)) <= [1e-9, 1e-8, 1e-4] * np.abs(one).max(axis=(1, 2))).all()


def test_hysteretic_damping_is_replaced_by_viscous_damping_of_equal_loss():
    state = platform()
    layout, kept = model(state, Damping("hysteretic", loss_factor=1e-3))
    system = state_space(layout, kept)
    poles = np.linalg.eigvals(system.a)
    poles = poles[poles.imag > 0]
    poles = poles[np.argsort(np.abs(poles))]
    elastic = bar_suspension.dense(state, 8)
    omega, shapes = elastic.modes()
    ratio = 1e-3 * (shapes * (elastic.elastic @ shapes)).sum(axis=0) / (2 * (2 * np.pi * omega) ** 2)
    assert -poles.real[:20] / np.abs(poles[:20]) == pytest.approx(ratio[:20], rel=1e-6)


ANCHORS = [(10.0, 0.0, 3.0), (-4.0, 9.0, 2.0), (-5.0, -8.0, 4.0)]


def knot(line, **more):
    """A junction in equilibrium on three cables of so much mass per length [kg/m]."""
    cables = [(anchor, ("knot", (0.0, 0.0, 0.0)), 2e5, line) for anchor in ANCHORS]
    return hung(suspension({"knot": {"junction": True} | more}, cables), [10.3, 10.0, 10.1])


def test_names_and_export():
    layout, kept = model(knot(0.4, mass=2.0), Damping(ratio=0.01), mesh=FixedModel(2, 4))
    system = state_space(layout, kept, [Winch(1)])
    assert names(system.inputs) == ["winch.c2", "knot.force_x", "knot.force_y", "knot.force_z"]
    tensions = [f"c{i}.tension_{end}" for i in (1, 2, 3) for end in ("from", "to")]
    assert names(system.outputs) == ["knot.x", "knot.y", "knot.z", *tensions]
    assert system.states[0] == ("c1.mode_1_amplitude", "sqrt(kg) m/s")
    assert len(system.states) == len(system.a)
    for kind in export.KINDS.values():
        assert len(kind(system)) > 1000


@pytest.mark.parametrize("damping", [Damping(), Damping("hysteretic", loss_factor=0.01)], ids=["modal", "hysteretic"])
def test_without_mass_there_is_no_state_space(damping):
    state = knot(0.0, force=(0, 0, -10.0))
    kept = Models(Cables(state.catenary, damping), [None] * 3).coordinates(np.zeros(3)).kept
    with pytest.raises(NoSolutionError, match="needs a mass"):
        state_space(Layout(state), kept)
