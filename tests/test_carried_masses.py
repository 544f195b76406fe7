"""Masses on a cable: the string with a bead, dense bars with a mass on a node, random cables, damping, wind."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from cables import (
    along_x,
    batch,
    chord_span,
    full_mass,
    matrices_of_all_nodes,
    pole_of_mass,
    poles_between_fixed_ends,
    state_of,
)
from campaign import campaign
from one_loop import OneLoop
from references import bars
from references.dense import condensed
from scenes import G, cells, scene
from scipy.linalg import eigh
from scipy.optimize import brentq
from test_cable_motion import TEXT, spectra_of
from test_cable_motion import dense as dense_cable
from test_wind_cable import dense as dense_gondola
from test_wind_cable import spectrum_of

from cablestudy.cable import catenary, equilibrium
from cablestudy.cable.damping import Damping
from cablestudy.cable.dynamics import Dynamics
from cablestudy.cable.meshes import mesh_pieces, mesh_segments, pieces
from cablestudy.cable.stiffness import tangent_stiffness
from cablestudy.cable.tolerances import CABLE
from cablestudy.control.one_cable import state_space
from cablestudy.scene.scene import load_scene
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.case_modes import modes
from cablestudy.study.one_cable.elements import solve_elements
from cablestudy.study.one_cable.results import Results
from cablestudy.study.one_cable.ssm import nodal_shapes
from cablestudy.study.stated_numbers import StatedNumbers
from cablestudy.system.cables import Models
from cablestudy.system.ends import Ends
from cablestudy.system.hanging_cables import Cables, FixedModel, fixed_meshes


def carrying(span, *masses):
    """The `Span` with these masses at its loads. [kg]"""
    return replace(span, load_masses=np.array(masses, dtype=float))


def spectral(span, order):
    """`Dynamics` of one element for each smooth piece, about the closed form."""
    start = catenary.solve(span)
    edges = pieces(start.segments.fraction, start.singularities)
    mesh = mesh_pieces(edges, (1,) * (len(edges) - 1), order, point_masses=span.point_masses)
    return Dynamics(equilibrium.from_catenary(start, mesh))


# ---- the string with a bead -----------------------------------------------------------------------------------------


@pytest.mark.crossed
@pytest.mark.parametrize("share", [0.5, 0.3, 0.01])
@pytest.mark.parametrize("ratio", [1e-3, 0.1, 1.0, 30.0, 1e4])
def test_a_string_with_one_mass_in_closed_form(ratio, share):
    """The mass M at x = a of a string of tension T and mass m per length, its ends held.

    On both sides y'' = -k^2 y with k = w sqrt(m/T), so that y = sin(k x)/sin(k a) and sin(k (L - x))/sin(k (L - a)).
    The slopes at the mass differ by k (cot(k a) + cot(k (L - a))), and T times that is its inertia force M w^2. The
    difference falls from one pole of the cotangents to the next, so that one root lies between them; where two poles
    coincide the string has a mode with a node at the mass.
    """
    strain, stiffness = 1e-3, 1e6
    span = chord_span(100.0, 20.0, strain, stiffness, gravity=0.0, loads=[(share, (0.0, 0.0, 0.0))])
    length = span.unstretched_length
    found = spectral(carrying(span, ratio * span.mass * length), 30)

    def balance(k):  # lengths in unstretched lengths
        return 1 / np.tan(k * share) + 1 / np.tan(k * (1 - share)) - ratio * k

    many = np.pi * np.arange(1, 8)
    edges = [1e-9, *np.sort(np.concatenate([many / share, many / (1 - share)]))]
    pairs = [(low * (1 + 1e-12), high * (1 - 1e-12)) for low, high in itertools.pairwise(edges)]
    roots = [brentq(balance, *pair, xtol=1e-15, rtol=1e-15) if pair[0] < pair[1] else pair[0] for pair in pairs]
    roots = np.array(roots[:5])
    # per unstretched length: mass m and the stiffness T/(1 + strain)
    wave_speed = math.sqrt(strain * stiffness / (1 + strain) / span.mass)
    expected = roots * wave_speed / length / (2 * math.pi)
    for kind in ("in-plane", "out-of-plane"):
        frequency, error, _ = found.frequencies(tuple((k, kind, None) for k in range(1, 6)), errors=True)
        assert frequency == pytest.approx(expected, rel=1e-12)
        assert max(error) < 1e-11
    first = found.lowest(8)
    symmetry = [first.symmetry[k] for k in first.select("in-plane")]
    assert share != 0.5 or symmetry[:2] == ["symmetric", "antisymmetric"]


def test_a_mass_that_slides_along_a_weightless_cable_is_an_axial_mode():
    # two springs EA/a and EA/(L - a) hold it along the cable, two strings T/a and T/(L - a) across
    span = chord_span(100.0, 0.0, 1e-3, 1e6, mass=1e-6, gravity=0.0, loads=[(0.25, (0.0, 0.0, 0.0))])
    found = spectral(carrying(span, 20.0), 12).lowest(3)
    springs = (1 / 25 + 1 / 75) * np.array([1e3 / 1.001, 1e3 / 1.001, 1e6]) * 1.001
    assert found.kind == ("out-of-plane", "in-plane", "axial")
    assert found.frequency == pytest.approx(np.sqrt(springs / 20.0) / (2 * np.pi), rel=1e-5)


# ---- dense bars -----------------------------------------------------------------------------------------------------

CHAINS = {  # a, b, unstretched length, (node of 40, mass [kg], force beside the weight [N])
    "taut": (185.8, 0.0, 184.4883, ((20, 2.0, (0, 0)),)),
    "inclined, sagging": (175.68, 60.49, 187.0, ((13, 5.0, (0, 0)),)),
    "two, in space": (100.0, -20.0, 103.0, ((10, 0.03, (0, 30.0)), (25, 80.0, (5.0, -60.0)))),
}


@pytest.mark.parametrize("name", CHAINS)
def test_40_bars_equal_the_dense_chain(name):
    a, b, length, loads = CHAINS[name]
    chord = math.hypot(a, b)
    forces = [(node, (along, across, -mass * G)) for node, mass, (along, across) in loads]
    EA, mass = 70.3e9 * 2.69e-6, 1440 * 2.69e-6
    span = chord_span(
        chord, math.degrees(math.atan2(b, a)), (chord - length) / length, EA, mass,
        loads=[(node / 40, force) for node, force in forces],
    )  # fmt: skip
    chain = bars.solve_spatial((a, 0, b), length, EA, mass * G, 40, forces)
    K, M = bars.matrices(chain, length, EA, mass)
    for node, carried, _ in loads:
        M[3 * node : 3 * node + 3] += carried
    inner = np.s_[3:-3]
    root = np.sqrt(M[inner])
    value, vector = np.linalg.eigh(K[inner, inner] / np.outer(root, root))
    start = catenary.solve(span)
    carried = carrying(span, *(carried for _, carried, _ in loads))
    mesh = mesh_segments(start.segments.fraction, 40, point_masses=carried.point_masses)
    model = Dynamics(equilibrium.solve(start, mesh)[0])
    found = model.lowest(model.dof)
    assert found.frequency == pytest.approx(np.sqrt(value) / (2 * np.pi), rel=1e-9)
    participation = np.abs(vector.T / root @ K[inner, -3:])
    ours = found.participation @ span.frame
    edges = np.flatnonzero(np.diff(value[:6]) > 1e-6 * value[1:6]) + 1
    for group in np.split(np.arange(6), edges):  # of equal frequency
        one, other = (np.sqrt((values[group] ** 2).sum(axis=0)) for values in (ours, participation))
        assert one == pytest.approx(other, rel=1e-5, abs=1e-9 * participation.max())


@pytest.mark.parametrize(("order", "mass"), [(1, "consistent"), (1, "blended"), (3, "consistent"), (4, "lumped")])
def test_every_element_and_mass_is_the_dense_eigenproblem(order, mass):
    span = chord_span(100.0, 20.0, -0.05, 1e5, loads=[(0.3, (0, 50, -100)), (0.8, (0, 0, -10))])
    model = Dynamics(state_of(span, 12, order, mass))
    own = full_mass(model.systems[0]).toarray() * span.mass * span.unstretched_length
    edges = np.cumsum(catenary.solve(span).segments.fraction)[:2]
    state = state_of(carrying(span, 10.0, 1.0), 12, order, mass)
    state = replace(state, mesh=replace(state.mesh, point_masses=carrying(span, 10.0, 1.0).point_masses))
    for share, carried in zip(edges, (10.0, 1.0), strict=True):
        node = int(np.argmin(np.abs(state.mesh.node_positions - share)))
        own[3 * node : 3 * node + 3, 3 * node : 3 * node + 3] += carried * np.eye(3)
    K = sum(tangent_stiffness(state)).toarray()
    value = eigh(K[3:-3, 3:-3], own[3:-3, 3:-3], eigvals_only=True)
    found = Dynamics(state)
    assert found.lowest(12).frequency == pytest.approx(np.sqrt(value[:12]) / (2 * np.pi), rel=1e-9)


# ---- errors that are stated ------------------------------------------------------------------------------------------


def random_cable(rng):
    """A cable of unit mass per length, 100 m from end to end, with one to three masses on it; it may hang folded."""
    count = rng.integers(1, 4)
    places = np.sort(rng.uniform(0.02, 0.98, count))
    if rng.random() < 0.3:
        places[0] = 10 ** rng.uniform(-6, -1.8)
    strain = rng.choice([10 ** rng.uniform(-6, -2.3), -(10 ** rng.uniform(-3, -0.3))])
    masses = 10 ** rng.uniform(-4, 3, count) * 100 / (1 + strain)
    aside = rng.normal(size=count) * (rng.random() < 0.3)
    loads = [(place, (0.0, 20 * mass * way, -G * mass)) for place, mass, way in zip(places, masses, aside, strict=True)]
    degrees = rng.choice([0.0, 90.0, rng.uniform(-85, 85)])
    return carrying(chord_span(100.0, degrees, strain, 10 ** rng.uniform(4.5, 8), loads=loads), *masses)


@pytest.mark.parametrize("seed", campaign(range(50), range(0, 50, 5)))
def test_the_error_that_a_model_states_is_true(seed):
    """Of modes whose waves are resolved, against a model of a high order."""
    rng = np.random.default_rng(seed)
    span = next(span for span in iter(lambda: random_cable(rng), None) if not catenary.solve(span).folded)
    fine = spectral(span, 44).modes(24).frequency
    for order in (6, 8, 11, 14, 17, 20):
        model = spectral(span, order)
        state, found = model.state, model.modes(24)
        slowness = np.sqrt(span.mass * state.stretch / (state.tension * state.force))
        time = (state.mesh.point_weights * slowness).sum(axis=-1).max() * span.unstretched_length
        count = min(int((CABLE.orders_per_half_wave * 2 * found.frequency * time + 3 <= order).sum()), 24)
        true = np.abs(found.frequency[:count] / fine[:count] - 1)
        assert np.all(true <= np.maximum(found.errors[:count], 1e-11)), order


def test_large_models_have_the_masses_too():
    """Lanczos iteration and a full eigen-solution."""
    span = carrying(chord_span(100.0, 30.0, -0.02, 1e6, loads=[(0.4, (0, 0, -50 * G))]), 50.0)
    start = catenary.solve(span)
    mesh = mesh_segments(start.segments.fraction, 100, point_masses=span.point_masses)
    model = Dynamics(equilibrium.from_catenary(start, mesh))
    every = model.lowest(model.dof).frequency
    assert model.lowest(5).frequency == pytest.approx(every[:5], rel=1e-9)


# ---- scenes ----------------------------------------------------------------------------------------------------------

LAWS = ("ratio: 0.0", "ratio: 0.02", "loss_factor: 0.02", "time: 1 ms")
SAGGING = "cable.ends=[[0, 0, 0], [175.68, 0, 60.49]]", "cable.unstretched_length=187 m"
CARRIED = ((13, 2.0), (30, 0.3))  # node of 40, mass [kg]
VISCOUS = 0.016


def hung(*pairs):
    """Masses on a cable as a key of the scene, (share of its length, kg)."""
    return f"cable.loads=[{', '.join(f'{{fraction: {share!r}, mass: {mass!r} kg}}' for share, mass in pairs)}]"


def weighing(*pairs):
    """The weight of these masses alone."""
    texts = (f"{{fraction: {share!r}, force: [0, 0, {-mass * G!r}]}}" for share, mass in pairs)
    return f"cable.loads=[{', '.join(texts)}]"


ON_SAGGING = [(node / 40, mass) for node, mass in CARRIED]


def loaded(*sets):
    """The case of a sagging cable with masses, and of the same cable with their weight alone."""
    return (CableCase(scene(*SAGGING, *sets, loads(*ON_SAGGING))) for loads in (hung, weighing))


def damped(law):
    return f"cable.damping={{{law}, viscous: {VISCOUS} N s/m^2}}"


def dense(bare, law, s=0.0):
    """s^2 M + s C + K of all nodes, global axes, of a case without masses; M has them, and C of the air has not."""
    turn = np.kron(np.eye(bare.state.mesh.nodes), bare.span.frame)
    K, E, own = (turn.T @ matrix @ turn for matrix in matrices_of_all_nodes(bare))
    M, inner = own.copy(), np.s_[3:-3]
    for node, mass in CARRIED:
        M[3 * node : 3 * node + 3, 3 * node : 3 * node + 3] += mass * np.eye(3)
    C = VISCOUS / (1440 * 2.69e-6) * own
    name, amount = law.split(": ")
    if name == "ratio":
        root = np.sqrt(np.diagonal(M)[inner])
        square, vector = np.linalg.eigh(K[inner, inner] / np.outer(root, root))
        modal = root[:, None] * vector
        C[inner, inner] += modal * (2 * float(amount) * np.sqrt(square)) @ modal.T
    loss = {"loss_factor": 0.02j, "time": 1e-3 * s}.get(name, 0.0)
    return s**2 * M + s * C + K + loss * E


@pytest.mark.parametrize("law", LAWS)
def test_the_dynamic_stiffness_of_the_ends_is_that_of_dense_bars(law):
    case, bare = loaded(damped(law))
    model, ends = case.end_model, np.r_[0:3, 120:123]
    assert model.uneven
    for s in (0.3j, 2j, -0.5 + 7j, 400j):
        expected = condensed(dense(bare, law, s), ends)
        found = model.dynamic_stiffness(np.array([s]))[0]
        assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()
        assert model.dynamic_stiffness(np.array([np.conj(s)]))[0] == pytest.approx(found.conj(), rel=1e-12)
    # poles with fixed ends: where the matrix of the nodes inside is singular
    poles = poles_between_fixed_ends(model)
    for pole in poles[np.argsort(np.abs(poles))][:6]:
        singular = np.linalg.svd(dense(bare, law, pole)[3:-3, 3:-3], compute_uv=False)
        assert singular[-1] < 1e-6 * singular[-2]


@pytest.mark.parametrize("law", LAWS)
def test_the_gondola_is_that_of_dense_bars(law):
    """Its undamped frequency, and its pole as that of the loop at rest and in the state space."""
    case, bare = loaded(damped(law), "winch.controller.gain=0")
    along = [*range(3, 120), 120]
    K = dense(bare, "ratio: 0.0")
    M = (dense(bare, "ratio: 0.0", 1j) + dense(bare, "ratio: 0.0", -1j)).real / -2 + K
    M[120, 120] += 50.0
    value = eigh(K[np.ix_(along, along)], M[np.ix_(along, along)], eigvals_only=True)
    expected = np.sqrt(value) / (2 * np.pi)
    assert np.abs(expected / case.gondola_mode.frequency[0] - 1).min() < 1e-9
    omega = 2 * np.pi * case.gondola_mode.frequency[0]
    pole = pole_of_mass(along_x(case), 50.0, 0.0, omega)
    whole = dense(bare, law, pole)
    whole[120, 120] += 50.0 * pole**2
    assert abs(condensed(whole[np.ix_(along, along)], [117])[0, 0]) < 1e-6 * abs(50.0 * pole**2)
    assert case.gondola_mode.damping_ratio[0] == pytest.approx(-pole.real / abs(pole), rel=1e-6)
    if law != "loss_factor: 0.02":
        poles = np.linalg.eigvals(state_space(case.end_model, gondola=(50.0, 0.0)).a)
        assert np.abs(poles - pole).min() < 1e-8 * abs(pole)


@pytest.mark.parametrize("law", ["ratio: 0.0", "ratio: 0.02", "time: 1 ms"])
def test_the_state_space_answers_as_dense_bars(law):
    """At the ends, and the gondola by forces on the nodes; hysteretic damping has no exact state space."""
    case, bare = loaded(damped(law))
    s = 1j * np.array([0.5, 3.0, 20.0])
    system = state_space(case.end_model)
    assert system.response(s, derivatives=True) == pytest.approx(
        np.stack([condensed(dense(bare, law, at), np.r_[0:3, 120:123]) for at in s]), rel=1e-6, abs=1e-3
    )
    pushed = state_space(case.end_model, nodes=nodal_shapes(case), gondola=(50.0, 0.0)).response(s)[:, 0, 2:]
    for row, at in zip(pushed, s, strict=True):
        whole = dense(bare, law, at)[3:121, 3:121]
        whole[-1, -1] += 50.0 * at**2
        expected = np.linalg.inv(whole)[-1, :-1]
        assert row == pytest.approx(expected, rel=1e-5, abs=1e-8 * np.abs(expected).max())


def test_a_selection_of_modes_keeps_masses_and_damping():
    model = next(loaded(damped("time: 1 ms"))).end_model
    mass, damping, stiffness = model.matrices()
    chosen = np.arange(10)
    kept = np.r_[chosen, np.arange(len(model.omega), len(model.omega) + 6)]
    for one, other in zip(model.select(chosen).matrices(), (mass, damping, stiffness), strict=True):
        assert one == pytest.approx(other[np.ix_(kept, kept)], rel=1e-12)
    turned = np.linalg.qr(np.random.default_rng(1).normal(size=(10, 3)))[0]
    turned = turned @ np.linalg.eigh(turned.T @ (model.omega[:10, None] ** 2 * turned))[1]
    whole = np.eye(16)[:, 7:]
    whole[:10, :3], whole[10:, 3:] = turned, np.eye(6)
    for one, other in zip(model.select(chosen).combine(turned).matrices(), (mass, damping, stiffness), strict=True):
        expected = whole.T @ other[np.ix_(kept, kept)] @ whole
        assert one == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_no_mass_changes_no_digit():
    span = chord_span(100.0, 20.0, -0.01, 1e6, loads=[(0.3, (0.0, 0.0, -30.0))])
    bare, none = (spectral(one, 20) for one in (span, carrying(span, 0.0)))
    for name in ("frequency", "shapes", "participation", "errors"):
        assert np.array_equal(getattr(bare.modes(20), name), getattr(none.modes(20), name))
    one, other = (Ends(model, span.frame, model.dof).superelement(Damping(viscous=0.1)) for model in (bare, none))
    assert not other.uneven
    s = np.array([0.3j, 4j])
    assert np.array_equal(one.dynamic_stiffness(s), other.dynamic_stiffness(s))


def test_cases_of_a_batch_are_as_if_they_were_alone():
    """With unlike masses, and to an accuracy."""
    pairs = [(1.0, 2.0), (1.0, 2.0), (0.1, 30.0)]
    sets = (hung((0.325, one), (0.75, other)) for one, other in pairs)
    scenes = [scene(*SAGGING, "model={accuracy: 1e-7}", one) for one in sets]
    results = Results(StatedNumbers(scenes))
    cases = [CableCase(one, results, i).refined(1, 20) for i, one in enumerate(scenes)]
    solve_elements(cases)
    assert cases[0].elements[0] is cases[1].elements[0]
    for case in cases:
        found = case.dynamics.modes(8).frequency
        assert np.array_equal(found, CableCase(case.scene).refined(1, 20).dynamics.modes(8).frequency)
        exact = modes(CableCase(case.scene), 8)[1]
        assert exact.frequency == pytest.approx(found, rel=3e-7)
        assert exact.errors.max() <= 1e-7


# ---- control and wind ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("law", "model"), [("ratio: 0.02", "elements: 20"), ("loss_factor: 0.02", "accuracy: 1e-4")])
def test_the_loop_is_judged_as_all_modes_judge_it(law, model):
    """The gain that brings a pole of all modes together to the imaginary axis, of a loop gain by dense matrices."""
    case, _ = loaded(f"model={{{model}}}", damped(law), "winch.controller.gain=0.05")
    loop = OneLoop(case.scene)
    case = case if "elements" in model else case.refined(1, 20)
    mass, damping, stiffness = case.end_model.matrices()
    n = len(case.end_model.omega)
    place, (w1, w2) = n + 3, (loop.notch.omega, loop.notch.rolloff_omega)

    def determinant(s, gain):
        passed = (s**2 + 2 * loop.notch.damping_ratio * w1 * s + w1**2) / w1**2
        passed *= w2**2 / (s**2 + 2 * loop.notch.rolloff_damping_ratio * w2 * s + w2**2)
        whole = s**2 * mass + s * damping + stiffness
        kept = [*range(n), place]
        closed = whole[np.ix_(kept, kept)].copy()
        closed[-1, -1] += s**2 * 50.0
        closed[:, -1] -= gain / s * passed * whole[kept, n]
        return np.linalg.slogdet(closed)

    limit, omega = loop.largest_gain, loop.closed_loop.stability.limit.omega
    circle = 1j * omega + 0.05 * omega * np.exp(2j * np.pi * np.arange(100) / 100)

    def poles_inside(gain):
        """On the right of the axis, by the argument along a half circle."""
        half = np.concatenate([circle[np.real(circle) >= 0], 1j * omega * np.linspace(1.05, 0.95, 60)])
        half = half[np.argsort(np.angle(half - omega * (1j + 0.01)))]
        sign = np.array([determinant(s, gain)[0] for s in np.append(half, half[:1])])
        return round(np.angle(sign[1:] / sign[:-1]).sum() / (2 * np.pi))

    assert [poles_inside(part * limit) for part in (0.97, 1.03)] == [0, 1]
    assert loop.with_gain(0.97 * limit).stable
    assert not loop.with_gain(1.03 * limit).stable


def test_uneven_damping_that_couples_all_modes_goes_with_accuracy():
    """Of cable modes that are damped more than critically, none may be left out."""
    sets = (
        "cable.ends=[[0, 0, 0], [185.8, 0, -2.2]]", "cable.unstretched_length=185.775 m", "cable.diameter=4 mm",
        "cable.damping={loss_factor: 0.02, viscous: 0.05}", "winch.controller.gain=0", hung((0.5, 9.8), (0.85, 0.9)),
    )  # fmt: skip
    names = "gondola_rms", "gondola_damping_ratio"
    coarse, fine = (cells(scene(*sets, f"model.accuracy={accuracy}"), *names) for accuracy in (1e-4, 1e-8))
    assert coarse == pytest.approx(fine, rel=1e-7)


@pytest.mark.parametrize("order", [24, 40])
def test_heavy_masses_leave_the_gondola_its_digits(order):
    """Masses far heavier than cable and gondola, whose slow modes have nearly all of the inertia; dense matrices."""
    on_cable = (0.357, 265.0), (0.612, 160.0)
    form = (
        "cable.ends=[[0, 0, 0], [185.6, 0, -8.7]]", "cable.unstretched_length=185.158 m", "cable.diameter=10.75 mm",
        "model={accuracy: 1e-4}",
    )  # fmt: skip
    case, bare = (CableCase(scene(*form, loads(*on_cable))).refined(1, order) for loads in (hung, weighing))
    nodes, places = bare.state.mesh.nodes, bare.state.mesh.node_positions
    turn = np.kron(np.eye(nodes), bare.span.frame)
    K, _, M = (turn.T @ matrix @ turn for matrix in matrices_of_all_nodes(bare))
    for share, mass in on_cable:
        node = int(np.argmin(np.abs(places - share)))
        M[3 * node : 3 * node + 3, 3 * node : 3 * node + 3] += mass * np.eye(3)
    M[3 * nodes - 3, 3 * nodes - 3] += 50.0
    free = [index for index in range(3, 3 * nodes - 2) if index % 3 != 1]  # the plane of the cable
    value = eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)
    expected = np.sqrt(value) / (2 * np.pi)
    assert np.abs(expected / case.gondola_mode.frequency[0] - 1).min() < 1e-8


@pytest.fixture(scope="module")
def windy(tmp_path_factory):
    path = tmp_path_factory.mktemp("windy") / "windy.yaml"
    path.write_text(TEXT)
    return str(path)


ON_CABLE = (14, 2.0), (30, 0.3)  # node of 40, mass [kg]


def blown(path, elements, *sets):
    """Cases of a bare cable in the wind, with masses, and with their weight alone."""
    more = "wind.coherence_length=1e12 m", f"model.elements={elements}", *sets
    shares = [(node / 40, mass) for node, mass in ON_CABLE]
    return (CableCase(load_scene(path, (*more, loads(*shares)))[1]) for loads in (hung, weighing))


@pytest.mark.crossed
@pytest.mark.parametrize("direction", ["across", "along"])
@pytest.mark.parametrize("law", ["ratio: 0.01", *(f"{law}, viscous: 0.01" for law in LAWS[1:])])
def test_a_bare_cable_in_the_wind_is_that_of_dense_matrices(windy, law, direction):
    case, bare = blown(windy, 40, f"cable.damping={{{law}}}")
    frequency = np.array([0.01, 0.3, 1.0, 1.58, 3.2, 9.0])
    expected = dense_cable(bare, frequency, direction, ON_CABLE)
    found = spectra_of(case, frequency, direction)
    most = np.repeat([expected[:3].max(), expected[3:].max()], [3, 2])[:, None]
    np.testing.assert_array_less(np.abs(found - expected), 2e-7 * expected + 1e-12 * most)


@pytest.mark.crossed
@pytest.mark.parametrize("direction", ["across", "along"])
@pytest.mark.parametrize("law", ["ratio: 0.01", "loss_factor: 0.02", "time: 1 ms"])
def test_a_gondola_in_the_wind_on_the_cable_is_that_of_dense_matrices(law, direction):
    """The air damps the cable, and not what it carries."""
    case, bare = loaded(
        "winch.controller.gain=0", "wind.coherence_length=1e12 m", "wind.aerodynamic_damping=true",
        "wind.cable_drag_coefficient=1.2", f"cable.damping={{{law}}}",
    )  # fmt: skip
    frequency = np.array([0.01, 0.3, 0.7, 1.6, 3.18, 9.0])
    expected = dense_gondola(bare, frequency, direction, CARRIED)
    assert spectrum_of(case, frequency, direction) == pytest.approx(expected, rel=1e-6)


# ---- cables of suspensions -------------------------------------------------------------------------------------------


def cables_of(*spans):
    """`Cables` of a batch, damped by the air alone."""
    return Cables(catenary.solve(batch(spans)), Damping(viscous=0.05))


def test_the_superelements_of_many_cables_have_their_masses():
    """In groups of equal meshes, against one element for each piece of one cable alone; and with few of its modes."""
    loads, masses = [(0.3, (0, 0, -30 * G)), (0.8, (0, 0, -2 * G))], [(30.0, 2.0), (30.0, 2.0), (0.0, 5.0)]
    spans = [carrying(chord_span(100.0, 20.0, -0.01, 1e6, loads=loads), *pair) for pair in masses]
    cables = cables_of(*spans)
    own = spans[0].unstretched_length
    assert cables.mass == pytest.approx([own + sum(pair) for pair in masses], rel=1e-12)
    models = Models(cables, cables.meshes(np.full(3, 24)))
    assert sorted(len(group.cable_indices) for group in models.groups) == [1, 2]
    s = np.array([0.2j, 3j])
    for span, element in zip(spans, models.elements, strict=True):
        alone = Dynamics(spectral(span, 24).state)
        expected = Ends(alone, span.frame, alone.dof).superelement(Damping(viscous=0.05))
        assert element.inertia == pytest.approx(expected.inertia, rel=1e-9, abs=1e-9)
        assert element.dynamic_stiffness(s) == pytest.approx(expected.dynamic_stiffness(s), rel=1e-6, abs=1e-3)
    kinetic = models.moving_mass(
        [np.zeros((len(group.cable_indices), len(group.ends.omega[0]), 1)) for group in models.groups],
        np.broadcast_to(np.tile([[0.0], [1.0], [0.0]], (2, 1)), (3, 6, 1)),
    )
    assert kinetic[:, 1, 0] == pytest.approx(cables.mass, rel=1e-12)  # all moves out of the plane


def test_a_cable_whose_modes_are_not_all_computed_has_its_masses():
    """Two hundred bars, of whose modes 20 are kept with six vectors for the others; against all modes of an element."""
    span = carrying(chord_span(100.0, 20.0, -0.01, 1e6, loads=[(0.3, (0, 0, -30 * G))]), 30.0)
    cables, slow = cables_of(span), np.array([0.2j])
    exact = Models(cables, cables.meshes(np.full(1, 30))).elements[0].dynamic_stiffness(slow)
    mesh = mesh_segments(cables.catenary.segments.fraction[0], 200, point_masses=span.point_masses)
    models = Models(cables, [mesh], most_modes=20)
    assert not models.complete
    found = models.elements[0].dynamic_stiffness(slow)
    assert found == pytest.approx(exact, rel=1e-3, abs=1e-3 * np.abs(exact).max())


def test_cables_of_suspensions_with_fixed_elements_have_their_masses():
    span = carrying(chord_span(100.0, 20.0, -0.01, 1e6, loads=[(0.25, (0, 0, -30 * G))]), 30.0)
    cables = cables_of(span, span)
    found = Models(cables, fixed_meshes(cables, FixedModel(40)), fixed=True).elements[1]
    start = catenary.solve(span)
    mesh = mesh_segments(start.segments.fraction, 40, point_masses=span.point_masses)
    expected = Dynamics(equilibrium.solve(start, mesh)[0]).lowest(117).frequency
    assert found.omega == pytest.approx(2 * np.pi * expected, rel=1e-9)
