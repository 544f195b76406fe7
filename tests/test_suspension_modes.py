"""Coupled modes of suspensions against closed forms, dense bars and continuous cables."""

import math
import tracemalloc

import counted_modes
import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from campaign import campaign
from command import rows_of, run, table_of, written
from references import bar_suspension, continuous_suspension, dense
from suspension_cases import SUSPENSIONS, case_at, case_of
from suspension_scenes import G, hung, platform, suspension, with_lengths
from suspensions import sagging, trifilar

from cablestudy.cable.damping import Damping
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.tolerances import CABLE
from cablestudy.errors import NoSolutionError
from cablestudy.statics import rest
from cablestudy.system.cables import Models
from cablestudy.system.coupled import Layout
from cablestudy.system.coupled_modes import coupled_modes, coupled_modes_of_cases
from cablestudy.system.coupled_trial import Trial
from cablestudy.system.damping import damped_poles
from cablestudy.system.hanging_cables import Cables, FixedModel
from cablestudy.system.tolerances import SYSTEM


@pytest.mark.parametrize("lines", [3, 4, 7])
def test_the_trifilar_pendulum(lines):
    mass, radius, depth, inertia, stiffness = 50.0, 0.5, 0.1, (4.0, 4.0, 6.0), 1e6
    state = rest.pose(trifilar(lines, radius, 2.0, mass, depth, stiffness, line=0.0, inertia=inertia))
    length = float(state.lengths[0])
    height = 2.0 - state.position[0, 2]
    found = coupled_modes(state, 6)
    spring = stiffness / length
    # sway and tilt: displacement of the attachments and rotation, which lifts the center of mass
    K = np.diag([mass * G / height, lines / 2 * spring * radius**2 + mass * G * depth])
    M = np.array([[mass, -mass * depth], [-mass * depth, inertia[0] + mass * depth**2]])
    sway, tilt = np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True))
    yaw = np.sqrt(mass * G * radius**2 / (inertia[2] * height))
    heave = np.sqrt(lines * spring / mass)
    expected = np.array([sway, sway, yaw, heave, tilt, tilt])
    assert 2 * np.pi * found.frequency == pytest.approx(expected, rel=1e-10)
    assert found.moves == ("disk x", "disk y", "disk yaw", "disk z", "disk roll", "disk pitch")
    assert found.coincident == ((1, 2), (5, 6))
    assert found.body_share == pytest.approx(np.ones(6), rel=1e-12)


def net(n, spacing=1.5, tension=900.0, node=2.0, stiffness=1e6, mass=0.0):
    """A flat square net of n x n junctions without gravity."""
    names = {(i, j): f"p{i}_{j}" for i in range(1, n + 1) for j in range(1, n + 1)}

    def end(i, j):
        return (names[i, j], (0.0, 0.0, 0.0)) if (i, j) in names else (spacing * i, spacing * j, 0.0)

    cables = []
    for i in range(n + 1):
        for j in range(1, n + 1):
            cables += [(end(i, j), end(i + 1, j), stiffness, mass), (end(j, i), end(j, i + 1), stiffness, mass)]
    points = {
        name: {"at": (spacing * i, spacing * j, 0.0), "mass": node, "junction": True} for (i, j), name in names.items()
    }
    model = suspension(points, cables, gravity=0.0)
    return with_lengths(model, np.full(len(cables), spacing / (1 + tension / stiffness)))


@pytest.mark.parametrize("n", [1, 2, 5, 16])
def test_the_flat_square_net(n):
    """n = 16 is solved sparse."""
    spacing, tension, node, count = 1.5, 900.0, 2.0, min(n * n, 12)
    state = net(n)
    assert Layout(state).large == (n == 16)
    p = np.arange(1, n + 1)
    half = np.sin(p * np.pi / (2 * (n + 1))) ** 2
    expected = np.sort(np.sqrt(4 * tension / (node * spacing) * (half[:, None] + half)).ravel())[:count]
    found = coupled_modes(state, count)
    assert 2 * np.pi * found.frequency == pytest.approx(expected, rel=1e-11)
    assert found.moves[0] == ("p1_1 z" if n == 1 else "points")
    runs = np.flatnonzero(np.diff(expected) < 1e-9 * expected[1:])
    told = {mode for first, last in found.coincident for mode in range(first, last)}
    assert told == {int(place) + 1 for place in runs}


def test_sparse_and_dense_matrices_have_the_same_modes(monkeypatch):
    state, damping = net(4, mass=0.3), Damping("kelvin_voigt", time=1e-4)
    dense = coupled_modes(state, 12, damping=damping)
    monkeypatch.setattr(type(SYSTEM), "large_connection", 0)
    monkeypatch.setattr(type(SYSTEM), "dense_coordinates", 0)
    sparse = coupled_modes(state, 12, damping=damping)
    assert isinstance(dense.system.mass, np.ndarray)
    assert not isinstance(sparse.system.mass, np.ndarray)
    for name in ("mass", "damping", "stiffness"):
        one, two = getattr(dense.system, name), getattr(sparse.system, name).toarray()
        assert np.abs(two - one).max() <= 1e-12 * np.abs(one).max()
    assert sparse.frequency == pytest.approx(dense.frequency, rel=1e-10)
    assert sparse.damping_ratio == pytest.approx(dense.damping_ratio, rel=1e-6)
    assert sparse.moves == dense.moves


@pytest.mark.parametrize("strain", [3e-3, -3e-3])
def test_dense_bars_of_the_whole_suspension(strain):
    state = platform(strain=strain)
    reference = bar_suspension.dense(state, 10)
    expected, shapes = reference.modes()
    found = coupled_modes(state, 40, model=FixedModel(10))
    assert found.frequency == pytest.approx(expected[:40], rel=1e-9)
    assert np.isnan(found.error).all()
    # shares of the kinetic energy, by the masses of the reference
    body = np.arange(len(shapes))[-6:]
    R = state.rotation[0]
    center = shapes[body[:3]] + np.cross(shapes[body[3:]], R @ state.suspension.center[0], axis=0)
    turned = R.T @ shapes[body[3:]]
    energy = np.concatenate([50.0 * center**2, turned * (state.suspension.inertia[0] @ turned)])
    assert found.body_energy[0] == pytest.approx(energy[:, :40], abs=1e-7)
    assert found.body_energy.sum(axis=(0, 1)) + found.cable_energy.sum(axis=(0, 1)) == pytest.approx(np.ones(40))
    # shares of the static compliance, where no other mode has the frequency of one
    alone = (np.diff(expected[:41], prepend=0.0) > 1e-6) & (np.diff(expected[:41], append=np.inf) > 1e-6)
    for axis, motion in enumerate(body):
        compliance = np.linalg.inv(reference.K)[motion, motion]
        right = (shapes[motion, :40] / (2 * np.pi * expected[:40])) ** 2 / compliance
        assert found.compliance_shares(0, axis)[alone[:40]] == pytest.approx(right[alone[:40]], rel=1e-6, abs=1e-9)


@pytest.mark.crossed
@pytest.mark.parametrize("strain", [3e-3, -3e-3])
@pytest.mark.parametrize("damping", [Damping(), Damping("hysteretic", loss_factor=0.02)])
def test_six_vectors_stand_for_the_modes_of_cables_that_are_not_computed(monkeypatch, strain, damping):
    """Dense bars, with the modes of many elements left out."""
    state = platform(strain=strain)
    every = coupled_modes(state, 12, damping=damping, model=FixedModel(24))
    monkeypatch.setattr(type(CABLE), "cheap_freedoms", 20)
    found = coupled_modes(state, 12, damping=damping, model=FixedModel(24))
    assert {record.modes for record in every.cables} == {69}
    assert max(record.modes for record in found.cables) < 55
    assert all("vectors" in record.reason for record in found.cables)
    assert found.frequency == pytest.approx(bar_suspension.dense(state, 24).modes()[0][:12], rel=1e-9)
    assert found.damping_ratio == pytest.approx(every.damping_ratio, rel=1e-5)


def test_long_cables_of_several_cases_are_as_those_of_one(monkeypatch):
    """Of a long cable some modes are computed, and six vectors stand for the others, also where cases share models."""
    monkeypatch.setattr(type(CABLE), "cheap_freedoms", 9)
    monkeypatch.setattr(type(SYSTEM), "modes_of_cable", 9)
    state = platform()
    twice = state.take(np.newaxis).take(np.array([0, 0]))
    alone = coupled_modes(state, 8)
    for found in coupled_modes_of_cases(twice, 8, 1e-4, [Damping()] * twice.lengths.size):
        assert any("vectors" in record.reason for record in found.cables)
        assert found.frequency == pytest.approx(alone.frequency, rel=1e-9)
        assert found.body_energy == pytest.approx(alone.body_energy, abs=1e-6)


@pytest.mark.parametrize(
    ("options", "accuracy"),
    [
        ({}, 1e-4),
        ({"strain": -0.003, "mass": 1.0, "body": 20.0}, 1e-2),
        ({"strain": -0.003, "mass": 1.0, "body": 20.0}, 1e-8),
        ({"strain": 0.01, "mass": 0.01, "body": 5000.0}, 1e-6),
        ({"mass": 2.0, "body": 1e-3}, 1e-5),
    ],
)
def test_the_stated_error_holds_against_continuous_cables(options, accuracy):
    """The number of modes below a frequency less and plus its stated error is counted without elements."""
    state = platform(**options)
    found = coupled_modes(state, 12, accuracy)
    assert found.error.max() <= accuracy
    reference = continuous_suspension.Suspension(state, 5)
    for mode in (0, 1, 6, 11):
        off = 2 * found.error[mode] + 1e-10
        first, last = next(((a, b) for a, b in found.coincident if a <= mode + 1 <= b), (mode + 1, mode + 1))
        assert reference.below(found.frequency[mode] * (1 - off)) == first - 1
        assert reference.below(found.frequency[mode] * (1 + off)) == last


def test_cables_between_bodies_and_junctions():
    """Two bodies and two junctions, one of them without mass: dense bars, and continuous cables."""
    state = rest.pose(sagging())
    found = coupled_modes(state, 40, model=FixedModel(8))
    assert found.frequency == pytest.approx(bar_suspension.dense(state, 8).modes()[0][:40], rel=1e-9)
    found = coupled_modes(state, 12)
    reference = continuous_suspension.Suspension(state, 4)
    for mode in (0, 3, 7, 11):
        off = 2 * found.error[mode] + 1e-10
        assert reference.below(found.frequency[mode] * (1 - off)) == mode
        assert reference.below(found.frequency[mode] * (1 + off)) == mode + 1


def test_the_stated_error_of_modes_that_coincide_reaches_all_of_them():
    """Roll and pitch of a gondola, 9e-7 apart: which of both a mode is another model may see the other way round."""
    case = case_at("carlina-net-wind")
    modes, reference = case.modes(48), continuous_suspension.Suspension(case.equilibrium, 8)
    runs = [(first, last) for first, last in modes.coincident if modes.error[first - 1] > 1e-6]
    assert runs
    for first, last in runs:
        for mode in range(first - 1, last):
            off = 1.02 * modes.error[mode]
            assert reference.below(modes.frequency[mode] * (1 - off)) < first
            assert reference.below(modes.frequency[mode] * (1 + off)) >= last


def single(end_1, end_2, length, stiffness, mass):
    """One cable whose second end a held body holds."""
    wall = {"wall": {"at": end_2, "free": ()}}
    return with_lengths(suspension(wall, [(end_1, ("wall", (0.0, 0.0, 0.0)), stiffness, mass)]), [length])


def test_a_body_that_is_held_leaves_each_cable_as_if_alone():
    held = platform(free=())
    together = coupled_modes(held, 15, 1e-8)
    model, alone = held.suspension, []
    places = model.ends(held.position, held.rotation)
    for cable in range(8):
        one = single(*places[cable], held.lengths[cable], 4e5, 0.3)
        alone.append(coupled_modes(one, 6, 1e-8).frequency)
    assert together.frequency == pytest.approx(np.sort(np.concatenate(alone))[:15], rel=1e-8)
    assert together.body_share == pytest.approx(np.zeros(15), abs=1e-12)
    assert set(together.moves) <= {f"c{i + 1} {kind}" for i in range(8) for kind in ("in-plane", "out-of-plane")}


@pytest.mark.parametrize(
    "damping",
    [Damping("hysteretic", loss_factor=0.02), Damping("kelvin_voigt", time=2e-4), Damping("kelvin_voigt", time=0.02)],
)
def test_damping_ratios_are_those_of_the_poles(damping):
    """Dense bars with the same damping; all poles of the pencil."""
    state = platform()
    found = coupled_modes(state, 30, damping=damping, model=FixedModel(6))
    reference = bar_suspension.dense(state, 6)
    stiffness = reference.K + 1j * (damping.loss_factor or 0.0) * reference.elastic
    poles = dense.poles(reference.M, (damping.time or 0.0) * reference.elastic, stiffness)
    poles = poles[poles.imag > 0]
    poles = poles[np.argsort(np.abs(poles))][:30]
    expected = -poles.real / np.abs(poles)
    assert np.sort(found.damping_ratio) == pytest.approx(np.sort(expected), rel=1e-3, abs=1e-7)


def test_few_modes_with_hysteretic_and_viscous_damping():
    """Both forces span the space of the solution: the lowest modes of dense bars, at half of critical damping."""
    state, loss, per_length = platform(), 0.2, 3.0
    found = coupled_modes(state, 3, damping=Damping("hysteretic", loss_factor=loss, viscous=per_length),
                          model=FixedModel(6))  # fmt: skip
    reference = bar_suspension.dense(state, 6)
    _, viscous = reference.damping({"viscous": per_length}, [0.3] * 8)
    poles = dense.poles(reference.M, viscous, reference.K + 1j * loss * reference.elastic)
    poles = poles[poles.imag > 0]
    lowest = poles[np.argsort(np.abs(poles))][:3]
    assert np.sort(found.damping_ratio) == pytest.approx(np.sort(-lowest.real / np.abs(lowest)), rel=1e-6)


def test_the_error_of_the_damping_ratio_is_stated():
    state, damping = platform(), Damping("kelvin_voigt", time=1e-3)
    found, exact = (coupled_modes(state, 12, accuracy, damping) for accuracy in (1e-4, 1e-9))
    assert found.damping_error.max() < 1e-3
    difference = np.abs(found.damping_ratio / exact.damping_ratio - 1)
    assert (difference <= 2 * (found.damping_error + exact.damping_error) + 1e-9).all()
    assert np.isnan(coupled_modes(state, 12, damping=Damping(ratio=0.01)).damping_error).all()


@pytest.mark.parametrize("stiffness", [1e6, 1e10, 1e13])
def test_the_error_of_a_soft_mode_counts_the_rounding_of_stiff_cables(stiffness):
    """A point on two lines swings about the axis through their anchors: w^2 = g_n/d across it, at a distance d."""
    upper = np.array([[0.0, 0.0, 0.0], [3.0, 2.0, 1.0]])
    cables = [(tuple(end), ("bob", (0.0, 0.0, 0.0)), stiffness, 0.0) for end in upper]
    bob = {"at": (1.2, 0.9, -4.0), "mass": 2.0, "junction": True, "free": ("x", "y", "z")}
    state = hung(suspension({"bob": bob}, cables), [4.5, 4.6])
    axis = (upper[1] - upper[0]) / np.linalg.norm(upper[1] - upper[0])
    weight, arm = np.array([0.0, 0.0, -G]), state.position[0] - upper[0]
    across, distance = (np.linalg.norm(vector - (vector @ axis) * axis) for vector in (weight, arm))
    found = coupled_modes(state, 1)
    off = abs(found.frequency[0] / (math.sqrt(across / distance) / (2 * math.pi)) - 1)
    assert off <= found.error[0]
    assert found.error[0] <= 1e-12 + 1e-14 * stiffness / (2.0 * across)


@pytest.mark.parametrize("accuracy", [0.1, 1e-2, 1e-4, 1e-6])
def test_the_stated_error_counts_modes_of_cables_that_are_left_out(accuracy):
    """A body between two strings of tension T, length L and mass m per length moves across them; viscous damping c.

    With x = w L sqrt(m/T): cot x = M x/(2 m L), and c/(2 m w) times the strings' share of the kinetic energy.
    """
    mass, line, span, tension, per_length, stiffness = 5.0, 0.2, 10.0, 1e6, 0.02, 1e8
    stretch = 1 + tension / stiffness
    ends = [(-span, 0.0, 0.0), (span, 0.0, 0.0)]
    cables = [(end, ("bob", (0.0, 0.0, 0.0)), stiffness, line) for end in ends]
    state = with_lengths(suspension({"bob": {"at": (0, 0, 0), "mass": mass, "free": ("y",)}}, cables),
                         [span / stretch] * 2)  # fmt: skip
    found = coupled_modes(state, 1, accuracy, damping=Damping("modal", viscous=per_length))
    line, per_length = line / stretch, per_length / stretch
    x = scipy.optimize.brentq(lambda x: 2 * line * span * math.cos(x) - mass * x * math.sin(x), 0.1, 1.5)
    of_strings = line * (span - span / (2 * x) * math.sin(2 * x))
    share = of_strings / (of_strings + mass * math.sin(x) ** 2)
    expected = per_length / (2 * line * x / span * math.sqrt(tension / line)) * share
    assert abs(found.damping_ratio[0] / expected - 1) < found.damping_error[0] + 1e-9
    assert found.damping_error[0] < 2 * accuracy


def test_modes_that_damping_couples_share_it():
    """Two equal strings of different damping side by side, joined by a light body: neither keeps its own ratio."""
    anchors = [(0.0, 0.0, 10.0), (1.0, 0.0, 10.0)]
    names = ("left", "right")
    bodies = {
        name: {"at": (x, 0.0, 0.0), "mass": 20.0, "junction": True, "free": ("x",)}
        for name, x in zip(names, (0, 1), strict=True)
    }
    origin = (0.0, 0.0, 0.0)
    cables = [(anchor, (name, origin), 1e6, 0.0) for anchor, name in zip(anchors, names, strict=True)]
    cables.append(((names[0], origin), (names[1], origin), 1e4, 0.0))
    state = with_lengths(suspension(bodies, cables), [9.9998, 9.9998, 0.99999])
    k = [float(state.end_stiffness[i, 0, 0]) for i in range(3)]
    time = 3e-7
    damping = [Damping(), Damping("kelvin_voigt", time=0.5), Damping("kelvin_voigt", time=time)]
    found = coupled_modes(state, 2, damping=damping)
    span = state.catenary.span
    elastic = time * 1e4 / float(span.unstretched_length[2])
    K = np.array([[k[0] + k[2], -k[2]], [-k[2], k[1] + k[2]]])
    C = elastic * np.array([[1.0, -1.0], [-1.0, 1.0]])
    poles = dense.poles(20.0 * np.eye(2), C, K)
    poles = poles[poles.imag > 0]
    poles = poles[np.argsort(np.abs(poles))]
    assert found.damping_ratio == pytest.approx(-poles.real / np.abs(poles), rel=1e-6)


def test_modal_damping_of_a_held_body_is_that_of_each_cable():
    found = coupled_modes(platform(free=()), 10, damping=Damping(ratio=0.013))
    assert found.damping_ratio == pytest.approx(np.full(10, 0.013), rel=1e-6)


def test_viscous_damping_acts_on_all_motion_of_the_cables():
    """A force c per length on a cable of mass m per length, nothing on the body: c/(2 m w) times the cables' share."""
    found = coupled_modes(platform(), 20, 1e-6, damping=Damping(viscous=0.02))
    expected = 0.02 / 0.3 / (2 * 2 * np.pi * found.frequency) * (1 - found.body_share)
    assert found.damping_ratio == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("bars", [5, 20, 80, 320])
def test_the_damping_of_a_pendulum_grows_with_the_number_of_modes_of_its_string(bars):
    """A string of tension T, mass m per length and speed c = sqrt(T/m) whose end moves sideways, by N lumped bars.

    Each of its N - 1 modes has the frequency 2 c N/L sin a and the coupling m L/(2 N^2) cot^2 a, a = n pi/(2 N): they
    damp the movement by 2 zeta c m/N sum cos^2 a/sin a, about 4 zeta c m/pi (1 + 1/2 + 1/3 + ...).
    """
    mass, line, length = 50.0, 1e-3, 10.0
    model = suspension({"bob": {"at": (0, 0, 0), "mass": mass, "free": ("x",)}},
                       [((0.0, 0.0, length), ("bob", (0.0, 0.0, 0.0)), 1e7, line)])  # fmt: skip
    found = coupled_modes(hung(model, [length / (1 + mass * G / 1e7)]), 1, damping=Damping(ratio=0.01),
                          model=FixedModel(bars))  # fmt: skip
    angle = np.arange(1, bars) * np.pi / (2 * bars)
    speed = np.sqrt(mass * G / line)
    force = 2 * 0.01 * speed * line / bars * (np.cos(angle) ** 2 / np.sin(angle)).sum()  # per velocity of the bob
    assert found.damping_ratio[0] == pytest.approx(force / (2 * mass * np.sqrt(G / length)), rel=1e-3)


@pytest.mark.parametrize("share", [0.0, 2.0, 6.0])
def test_modes_that_are_left_out_leave_their_damping(share):
    """Of one mesh some modes or none are kept, up to a multiple of the highest frequency."""
    state = platform(mass=1e-6)
    layout, cables = Layout(state), Cables(state.catenary, Damping(ratio=0.01))
    models = Models(cables, cables.meshes(np.full(cables.count, 24.0)))

    def ratios(limit):
        system = layout.system([one.element for one in models.coordinates(np.full(cables.count, limit)).kept])
        omega, shapes = system.lowest(6)
        return omega, damped_poles(system, omega, shapes)[1]

    omega, expected = ratios(np.inf)
    first = min(element.omega[0] for element in models.elements)
    assert omega[-1] < 0.3 * first  # those of the body alone
    _, found = ratios(share * first)
    assert found == pytest.approx(expected, rel=1e-6 if share else 0.05)


def test_damping_ratios_that_grow_with_the_number_of_modes_are_told_to_be_unknown():
    """Heave of a disc of mass M on three wires of mass m and length l along which waves travel with the speed c.

    The modes of a wire, w_k = k pi c/l, take the share m_k = sqrt(2 m)/(k pi) of a movement of its end. With the
    damping ratio r each they damp it by the sum of 2 r w_k m_k^2 = (4 r c m/(pi l))/k, which grows as the logarithm of
    their number.
    """
    scene, density, ratio, length = SUSPENSIONS / "trifilar.yaml", 7850.0, 0.01, 4.0
    speed, wire = math.sqrt(200e9 / density), density * math.pi / 4 * 0.001**2 * length

    def heave(elements):
        return table_of("modes", scene, "-n", 4, "--set", f"model.elements={elements}")[3]

    coarse, fine = heave(20), heave(80)
    rate = 3 * 4 * ratio * speed * wire / (math.pi * length)
    mass = 30.0 + wire  # a third of each wire
    change = rate * math.log(4) / (2 * mass * 2 * math.pi * fine["frequency_Hz"])
    assert fine["damping_ratio"] - coarse["damping_ratio"] == pytest.approx(change, rel=1e-3)
    told = [line for line in run("modes", scene, "--set", "model.elements=9").lines if "damping" in line]
    beginning = "note: damping ratios of modes that move ends of cables are not known: modal damping grows"
    assert [line.partition(" with")[0] for line in told] == [beginning]
    assert "here 24 of each cable" in told[0]
    for damping in ("{model: hysteretic, loss_factor: 0.02}", "{model: modal, ratio: 0, viscous: 0.01}"):
        assert beginning not in run("modes", scene, "--set", f"cable.damping={damping}").err


def test_damping_ratios_of_cables_with_fixed_ends_are_known(folder):
    wire = "{from: [0, 0, 0], to: [9, 0, 0], preload: 1 kN, elastic_modulus: 200 GPa, density: 7850, diameter: 1 mm}"
    told = run("modes", written(f"cables: {{wire: {wire}}}\n"), "-n", 2, "--format", "csv")
    assert "not known" not in told.err
    assert [row["damping_ratio"] for row in rows_of(told.out, "csv")] == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize("law", [("hysteretic", "loss_factor", 0.02), ("kelvin_voigt", "time", 1e-3)])
def test_damped_strain_of_a_cable_with_fixed_ends_damps_as_that_of_bars_and_of_one_cable(folder, law):
    """Energy lost in each mode of bars, of 60 and 120 extrapolated; one cable has its ratios in the table of ssm."""
    law = {"model": law[0], law[1]: law[2]}
    wire = {"preload": 100, "axial_stiffness": 2.5e6, "mass_per_length": 0.1, "damping": law}
    ends, of_bars = ([0, 0, 0], [99, 0, 7]), []
    case = case_of({"cables": {"wire": wire | dict(zip(("from", "to"), ends, strict=True))}})
    for bars in (60, 120):
        dense_bars = bar_suspension.dense(case.equilibrium, bars)
        frequency, shapes = dense_bars.modes()
        omega, shapes = 2 * np.pi * frequency[:6], shapes[:, :6]
        loss_factor = law.get("loss_factor", 0.0) + law.get("time", 0.0) * omega
        of_bars.append(loss_factor * (shapes * (dense_bars.elastic @ shapes)).sum(axis=0) / (2 * omega**2))
    found = case.modes(6).damping_ratio
    assert found == pytest.approx((4 * of_bars[1] - of_bars[0]) / 3, rel=1e-3, abs=1e-12)
    alone = table_of("ssm", written(str({"cable": wire | {"ends": list(ends)}})), "--modes", 6)
    assert found == pytest.approx([row["damping_ratio"] for row in alone], rel=1e-3, abs=1e-12)


def test_an_unstable_equilibrium_is_refused_with_the_motion_that_runs_away():
    """A mast on its foot, held by nothing but a cable below."""
    model = suspension(
        {"mast": {"at": (0, 0, 0), "mass": 10.0, "center": (0, 0, 2.0), "inertia": np.eye(3), "free": ("rx", "ry")}},
        [((0.0, 0.0, -3.0), ("mast", (0.0, 0.0, -1.0)), 1e5, 0.0)],
    )
    with pytest.raises(NoSolutionError, match="mast"):
        coupled_modes(with_lengths(model, [1.999]), 2)


def test_what_each_cable_was_given_is_recorded():
    """Short cables far above the body's modes get none; asked for more, each keeps those up to a multiple."""
    state = platform(body=1e4, strain=0.05, stiffness=4e6, mass=0.05)
    found = coupled_modes(state, 3)
    assert all(record.modes + record.residuals == 0 for record in found.cables)
    assert all("no modes" in record.reason and record.error < 1e-4 for record in found.cables)
    assert found.body_share.min() > 0.99
    more = coupled_modes(state, 30)
    assert all(record.modes > 0 for record in more.cables)
    assert all(record.limit > more.frequency[-1] for record in more.cables)


def test_the_nodes_of_a_mode_meet_the_body():
    """The last node of each cable is where it is attached, and moves with the body."""
    found = coupled_modes(platform(), 4)
    state = found.layout.equilibrium
    model = state.suspension
    places = model.ends(state.position, state.rotation)
    x = found.layout.bodies(found.shapes)[:, 1]
    for cable, (place, moved) in enumerate(found.nodes(1)):
        assert place[0] == pytest.approx(np.zeros(3), abs=1e-12)
        assert places[cable, 0] + place[-1] == pytest.approx(places[cable, 1], abs=1e-10)
        arm = places[cable, 1] - state.position[0]
        assert moved[-1] == pytest.approx(x[:3] + np.cross(x[3:], arm), abs=1e-12)
        assert moved[0] == pytest.approx(np.zeros(3), abs=1e-14)


@pytest.mark.parametrize("seed", campaign([0, 3, 10, 20, 24, 34], [0, 34]))
def test_stated_errors_hold_on_random_suspensions(seed):
    assert counted_modes.wrong_modes(seed) == []


def test_the_coordinates_without_damping_are_those_of_the_whole_system():
    """Both ways to the same matrices: one factorises the stiffness of the bodies alone."""
    found = coupled_modes(platform(strain=-3e-3), 12)
    omega, shapes = found.model.reduced.lowest(12)
    expected, others = found.system.lowest(12)
    assert omega == pytest.approx(expected, rel=1e-12)
    assert shapes.T @ (found.system.mass @ shapes) == pytest.approx(np.eye(12), abs=1e-11)
    assert found.model.reduced.mass_times(others) == pytest.approx(found.system.mass @ others, abs=1e-12)


@pytest.mark.parametrize("order", [4, 6, 8])
def test_the_error_by_the_mesh_is_estimated_from_one_model(order):
    """All modes of coarse meshes against the converged ones: the estimate is above the error, and not far."""
    state = platform(strain=-3e-3)
    own = Cables(state.catenary, Damping())
    models = Models(own, own.meshes(np.full(8, float(order))))
    coarse = Trial(Layout(state), models.coordinates(np.full(8, np.inf)), 12)
    exact = coupled_modes(state, 12, 1e-9)
    error = np.abs(coarse.omega[0] / (2 * np.pi) / exact.frequency - 1)
    estimate = coarse.mesh_error[0].sum(axis=0) / 2
    assert (error <= estimate).all()
    assert estimate.max() <= 500 * error.max()


def test_a_large_model_keeps_its_modes_and_not_what_their_computation_leaves():
    """The eigen-solution takes ten times the memory of the modes."""
    own = Cables(platform(strain=-3e-3).catenary, Damping())
    models = Models(own, own.meshes(np.full(8, 200.0)), most_modes=300)
    tracemalloc.start()
    try:
        assert (models.lowest_omega > 0).all()
        kept, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    modes = [
        group.ends.nodal_displacements(np.eye(len(group.ends.omega[0]))[None], np.zeros((1, 6, 1)))
        for group in models.groups
    ]
    assert len(modes) == 8
    assert kept < 2 * sum(one.nbytes for one in modes)


def test_modes_whose_order_is_not_certain_have_the_larger_error():
    """Modes 6 and 7 of this suspension change places at a coarse accuracy."""
    state = rest.pose(counted_modes.scene(93))
    found, exact = coupled_modes(state, 12, 1e-2), coupled_modes(state, 12, 1e-8)
    assert (np.abs(found.frequency / exact.frequency - 1) <= 2 * found.error).all()


def test_one_model_serves_a_case(monkeypatch):
    """No mesh is computed twice, and a state space is made only where it is needed."""
    made, lowest = [], Dynamics.lowest
    monkeypatch.setattr(Dynamics, "lowest", lambda self, count: made.append(self) or lowest(self, count))
    found = coupled_modes(platform(), 12, 1e-6)
    assert len(made) == 1
    assert "system" not in vars(found.model)
