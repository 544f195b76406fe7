"""The loop gain from the dynamic stiffness of the cables, against dense bars of an assembly of their own."""

from dataclasses import replace

import numpy as np
import pytest
from campaign import campaign
from command import CONFIGS
from random_twins import random_scene
from references import dense
from references.bar_loop import BarLoop
from references.bars_in_wind import BarsInWind
from references.loop_matrix import notch
from references.straight_suspension import Straight
from straight_scenes import case_of
from test_suspension_loop_bars import lossy, scene_of

from cablestudy.control.curves import at_frequencies, by_parts
from cablestudy.control.law import Law
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.loop_gain_poles import narrow_poles, poles_of_modes
from cablestudy.motion import driven_cables
from cablestudy.motion.driven_cables import DrivenCables
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.scene import CableScene, load_scene
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.system import analysis_of
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.system import pole_windows
from cablestudy.system.coupling_damping import CouplingDamping, compute_pole_sums
from cablestudy.system.linear import LinearSystem
from cablestudy.system.pole_windows import Resolvent
from cablestudy.system.tolerances import SYSTEM

BARS, TURN = 6, 2 * np.pi
ON_BARS = {"model": {"elements": BARS, "order": 1, "mass": "lumped"}}
FINE = (2, 14), (4, 8)  # elements of a cable and their order
ROUNDING = 1e-12  # of forces at the ends of cables, which are differences of larger ones
WIND = {"speed": 12.0, "direction": 0.4, "turbulence_intensity": 0.1, "length_scale": 50.0, "mean": False,
        "on": "cables", "cable_drag_coefficient": 1.2, "air_density": 1.2}  # fmt: skip


def both(seed, **changes):
    """`LoopGain` of a scene with all modes of its bars, and the dense bars."""
    data = scene_of(seed) | changes
    closed_loop = case_of(data | ON_BARS).analysis.closed_loop_of(250)
    bars = BarLoop(data, case_of(data).equilibrium, BARS)
    return DrivenCables(closed_loop, closed_loop.loop.gain).loop_gain, bars


def dense_gain(bars, s):
    """P (s^2 M + s C + K)^-1 F(s) A N(s)/s."""
    forces = sum(s**order * part for order, part in enumerate(bars.forces))
    moved = bars.measured @ np.linalg.solve(s**2 * bars.bars.M + s * bars.C + bars.bars.K, forces) @ bars.allocation
    own = bars.scene["control"]["notch"]
    if own == "none":
        return moved / s
    omega, rolloff = TURN * own["frequency"], TURN * own["rolloff_frequency"]
    return moved * notch(s, omega, own["damping_ratio"], rolloff, own["rolloff_damping_ratio"]) / s


@pytest.mark.parametrize("seed", [0, 2, 14, 23, 58])  # modal, viscous and Kelvin-Voigt damping, with and without notch
def test_it_is_that_of_dense_bars_from_below_the_first_mode_to_the_highest(seed):
    found, bars = both(seed)
    highest = max(element.omega.max() for element in found.elements)  # above it both are differences that cancel
    omega = np.geomspace(0.1, highest, 41)
    value = found(1j * omega)
    for place, one in enumerate(omega):
        expected = dense_gain(bars, 1j * one)
        assert value[place] == pytest.approx(expected, rel=1e-6, abs=1e-7 * np.abs(expected).max())


def highest_poles(loop_gain):
    """`poles_of_modes` of the three highest modes of the first cable: their poles, and the shifts of these."""
    none = [np.zeros(0, dtype=int)] * (len(loop_gain.elements) - 1)
    return poles_of_modes([loop_gain], [[np.arange(len(loop_gain.elements[0].omega))[-3:], *none]])[0]


@pytest.mark.parametrize("seed", [2, 58])
def test_the_pole_of_a_mode_of_one_cable_with_the_bodies_free(seed):
    """Close to an eigenvalue of the dense bars, much closer than the frequency between fixed ends."""
    found, bars = both(seed)
    poles = dense.poles(bars.bars.M, bars.C, bars.bars.K)
    for pole in highest_poles(found)[0]:
        assert np.abs(poles - pole).min() < 1e-3 * abs(pole)


@pytest.mark.parametrize("seed", [0, 2])
def test_the_poles_of_modes_that_nothing_damps_between_fixed_ends(seed):
    """Eigenvalues of the dense bars: of all modes of all cables, whose strain hardly damps those across them."""
    damping = {"model": "hysteretic", "loss_factor": 1e-5}
    found, bars = both(seed, cable={**scene_of(seed)["cable"], "damping": damping})
    assert min((element.decay / element.omega).min() for element in found.elements) < 1e-12
    poles = dense.poles(bars.bars.M, bars.C, bars.bars.K)
    estimated, _ = poles_of_modes([found], [[np.arange(len(element.omega)) for element in found.elements]])[0]
    assert (np.abs(poles - estimated[:, None]).min(axis=1) < 1e-5 * np.abs(estimated)).all()


@pytest.mark.parametrize("seed", [2, 58])
def test_the_shift_of_a_pole_by_the_gain(seed):
    """That of the nearest eigenvalue of the dense bars with a small gain."""
    found, bars = both(seed)
    fixed, scaled = bars.matrices()
    before, vectors = np.linalg.eig(fixed)
    change = np.diagonal(np.linalg.solve(vectors, scaled @ vectors))
    for pole, shift in zip(*highest_poles(found), strict=True):
        assert change[np.argmin(np.abs(before - pole))] == pytest.approx(shift, rel=0.05)


@pytest.mark.parametrize("seed", [0, 2, 14])
def test_the_air_damps_what_winches_move_of_the_cables(seed):
    """Dense bars with the drag of each node on its own velocity, whatever moves it."""
    found, bars = both(seed, wind=WIND)
    still, _ = both(seed)
    state = case_of(scene_of(seed)).equilibrium
    diameter = np.sqrt(4 * bars.scene["cable"]["area"] / np.pi)
    spectrum = {"density": 1.2, "turbulence": (1.0, 1.0, 1.0), "coherence_decay": 10.0, "length_scale": 50.0}
    moving = BarsInWind(state, BARS, WIND | spectrum, np.full(len(found.elements), 1.2 * diameter))
    bars.C = bars.C + np.einsum("kin,kij,kjm->nm", moving.moves, moving.drags, moving.moves)
    lowest = min(element.omega.min() for element in found.elements)
    for omega in lowest * np.array([0.05, 0.3, 0.7, 1.5]):
        value, without = (one(np.array([1j * omega]))[0] for one in (found, still))
        expected = dense_gain(bars, 1j * omega)
        change = np.abs(expected - without).max()
        assert change > 1e-5 * np.abs(expected).max()
        assert np.abs(value - expected).max() < 0.01 * change


def condensed(element, s):
    """Forces at the six ends per displacement of these, by elimination of all modes, shape (6, 6)."""
    mass, damping, stiffness = element.matrices()
    whole = s**2 * mass + s * damping + stiffness
    return dense.condensed(whole, np.arange(len(whole) - 6, len(whole)))


def condensed_bodies(found, s):
    """Dynamic stiffness of the bodies on their cables and force by lengths that are reeled in, at one s."""
    ends = [condensed(element, s) for element in found.elements]
    bodies = found.bodies.dynamic_stiffness(np.array([s]))[0]
    bodies = bodies + sum(g.T @ one @ g for g, one in zip(found.connection, ends, strict=True))
    pushed = found.winch_loads - sum(
        g.T @ one @ h for g, one, h in zip(found.connection, ends, found.reeling, strict=True)
    )
    return bodies, pushed, max(np.abs(ends).max(), np.abs(bodies).max())


def check_bodies(found, s):
    """Dynamic stiffness and forces over frequency are those by elimination of all modes."""
    bodies, pulled = LoopGain.stiffness_and_forces([found], np.zeros(len(s), dtype=int), s)
    for place, one in enumerate(s):
        expected, pushed, size = condensed_bodies(found, one)
        assert np.abs(bodies[place] - expected).max() < ROUNDING * size
        assert np.abs(pulled[place] - pushed).max() < ROUNDING * size


def condensed_gain(found, s):
    """P Z^-1 F A C1 N, all modes of the cables eliminated."""
    bodies, pushed, _ = condensed_bodies(found, s)
    return found.measured @ np.linalg.solve(bodies, pushed @ found.allocation) * found.controller(np.array([s]))


@pytest.mark.parametrize("seed", [0, 2, 14])
def test_cables_in_the_air_are_summed_together(seed):
    """Against the matrices of each cable, its modes eliminated."""
    found, _ = both(seed, wind=WIND)
    check_bodies(found, 1j * np.geomspace(0.1, 2 * max(element.omega.max() for element in found.elements), 31))


@pytest.mark.crossed
@pytest.mark.parametrize("damped", [0.02, 0.999, 1.0, 1.3])  # over critical damping of the lowest mode
@pytest.mark.parametrize("law", ["hysteretic", "kelvin_voigt"])
def test_stiffness_of_cables_of_any_viscous_damping(law, damped):
    """Against the matrices of each cable, its modes eliminated, up to critical damping and beyond."""
    found, _ = both(14)  # all cables with Kelvin-Voigt damping
    elements = [
        replace(
            element,
            viscous=2 * damped * element.omega.min(),
            strain=replace(element.strain, law=law, amount=0.02 if law == "hysteretic" else 1e-4),
        )
        for element in found.elements
    ]
    found = replace(found, elements=elements)
    check_bodies(found, 1j * np.geomspace(0.1, 2 * max(element.omega.max() for element in elements), 31))
    if law == "hysteretic" or damped != 1.0:  # else poles of a real matrix coincide, and equations are solved
        assert not found._divided[1]


@pytest.mark.parametrize("seed", campaign([0, 2, 14, 58], [0, 58]))
def test_poles_of_cables_that_are_found_together_are_those_of_each_alone(seed):
    """Digit for digit; the cables are also those of another scene."""
    dampings = [[one for number in (seed, 2) for one in both(number, wind=WIND)[0].coupling_damping] for _ in range(2)]
    compute_pole_sums(dampings[0])
    for together, alone in zip(*dampings, strict=True):
        assert CouplingDamping._pole_sum_and_resolvent.known(together) is not None
        assert np.array_equal(together.pole_sum.poles, alone.pole_sum.poles)
        assert np.array_equal(together.pole_sum.residues, alone.pole_sum.residues)


@pytest.mark.parametrize("seed", [2, 14])
def test_loop_gains_of_many_rows_are_those_of_each_alone(seed):
    """Digit for digit: other cables, other bodies and another law do not matter to a row."""
    found, _ = both(seed, wind=WIND)
    lighter = replace(found, bodies=replace(found.bodies, mass=found.bodies.mass / 2))
    lagging = replace(found, controller=replace(found.controller, law=Law(bandwidth=7.0, delay=0.01)))
    viscous = replace(found, elements=[replace(one, viscous=one.viscous + 0.01) for one in found.elements])
    rows, counts = [found, lighter, lagging, viscous], [600, 1, 40, 300]
    omega = [np.geomspace(0.1, 100 + count, count) for count in counts]
    for order in ([0, 1, 2, 3], [3, 0, 2, 1]):
        row = np.repeat(np.arange(4), [counts[number] for number in order])
        together = at_frequencies([rows[number] for number in order], row, np.concatenate([omega[k] for k in order]))
        for place, number in enumerate(order):
            assert np.array_equal(together[row == place], by_parts(rows[number], 1j * omega[number]))
    assert found(np.zeros(0, dtype=complex)).shape == (0, *found.measured.shape[:1] * 2)


@pytest.mark.parametrize("seed", [0, 2, 14])
def test_poles_in_windows_give_the_loop_gain(seed, monkeypatch):
    """Against the matrices of each cable, its modes eliminated; the whole problem is solved where poles are lost."""
    monkeypatch.setattr(type(SYSTEM), "windows_from", 5)
    found, lost = (both(seed, wind=WIND)[0] for _ in range(2))
    s = 1j * np.geomspace(0.1, 2 * max(element.omega.max() for element in found.elements), 31)
    expected = np.array([condensed_gain(found, one) for one in s])
    assert found(s) == pytest.approx(expected, rel=1e-7, abs=1e-9 * np.abs(expected).max())
    for name, value in {"window": 4, "window_margin": 0, "lowest_window": 1}.items():
        monkeypatch.setattr(type(SYSTEM), name, value)
    monkeypatch.setattr(pole_windows, "_gap_near", lambda size, near: near / 2)
    assert lost(s) == pytest.approx(expected, rel=1e-9, abs=1e-11 * np.abs(expected).max())


@pytest.mark.crossed
@pytest.mark.parametrize("change", [1e-3, 1e-6])
@pytest.mark.parametrize("seed", [0, 2, 14])
def test_the_effect_of_other_frequencies_of_the_cables_follows_from_their_poles(seed, change):
    """To a tenth, for stated errors, against the poles of the changed cables themselves."""
    found, _ = both(seed, wind=WIND)
    s = 1j * np.geomspace(0.3, 3.0, 17) * min(element.omega.min() for element in found.elements)
    elements = [
        replace(one, omega=one.omega * (1 - change), participation=one.participation * (1 - change) ** 2)
        for one in found.elements
    ]
    whole, first = (replace(found, elements=elements, near=near)(s) for near in (None, found))
    assert np.abs(first - whole).max() < 0.1 * np.abs(whole - found(s)).max()


def test_poles_of_overdamped_modes_stay_real_to_first_order():
    """Also where their vectors are complex, by any factor: sums over poles tell them by an imaginary part of zero."""
    found, _ = both(14)  # all cables with Kelvin-Voigt damping
    element = found.elements[0]
    overdamped = replace(element, strain=replace(element.strain, amount=4 / element.omega.max()))
    known = overdamped.coupling_damping
    _, resolvent = known._pole_sum_and_resolvent
    poles = resolvent.poles
    factor = np.exp(1j * np.arange(len(poles)))
    turned = Resolvent(poles, resolvent.left * factor, resolvent.right / factor[:, None])
    other = replace(overdamped, omega=overdamped.omega * (1 - 1e-3)).coupling_damping
    changed = other._to_first_order(known.matrices, turned).poles
    assert 0 < np.count_nonzero(poles.imag == 0) < len(poles)
    assert np.array_equal(changed.imag == 0, poles.imag == 0)


@pytest.mark.parametrize("seed", [0, 2, 14])
def test_the_largest_gain_to_first_order_is_that_of_little_damped_modes(seed):
    text = scene_of(seed) | ON_BARS
    text["cable"] = text["cable"] | {"damping": {"model": "modal", "ratio": 1e-6}}
    closed_loop = case_of(text).analysis.closed_loop_of(250)
    assert closed_loop.untuned_loop.limit_by_modes == pytest.approx(closed_loop.stability.largest_gain, rel=1e-3)


@pytest.mark.parametrize("seed", campaign([18, 22, 79], [18]))
def test_vectors_for_the_highest_modes_change_the_largest_gain_and_the_margins_by_less_than_stated(seed, monkeypatch):
    """One cable with damped strain, to 1e-4: with six vectors at most for modes far above, and with
    all modes in one eigenvalue problem. No steady wind, whose drag has an error of its own."""
    data = random_scene(seed, model={"accuracy": 1e-4})
    for case in data.get("cases", {}).values():
        case.pop("wind", None)
    scene = CableScene.model_validate(data)
    names, winds = ("sensitivity_peak", "phase_margin", "disk_margin"), []
    for all_from, many in ((MOTION.all_modes_from, SYSTEM.windows_from), (1.0, 10_000)):
        monkeypatch.setattr(type(MOTION), "all_modes_from", all_from)
        monkeypatch.setattr(type(SYSTEM), "windows_from", many)
        wind = analysis_of(CableCase(scene))
        winds.append((wind.loop_for_margins.stability.driven, wind.largest_gain, [wind.margin(name) for name in names]))
    (few, (gain, error), margins), (every, (truth, _), true_margins) = winds
    assert few.errors.simplification > 0 == every.errors.simplification
    assert len(few.loop_gain.elements[0].omega) < 0.7 * len(every.loop_gain.elements[0].omega)
    assert abs(gain / truth - 1) <= error <= 1e-5
    for (found, stated), (exact, _) in zip(margins, true_margins, strict=True):
        assert found == exact or abs(found / exact - 1) <= stated <= 1e-5


def test_an_error_of_the_poles_of_cables_counts_where_resonances_are_narrow():
    """Poles of cables moved by 1e-9, against the same loop gain with right poles: as a random cable of 1185 modes has
    at a mode that decays by 5e-10 of its frequency, whose phase margin was 5.4e-5 off at a stated 2.8e-5."""
    data = lossy(1)
    data["cable"]["damping"].pop("viscous")
    closed_loop = case_of(data | ON_BARS).analysis.closed_loop_of(250)
    right, moved = (DrivenCables(closed_loop, closed_loop.loop.gain) for _ in range(2))
    for cable in moved.coupling_damping:
        poles = cable.pole_sum.poles
        poles *= 1 + 1e-9
    poles = right.poles
    (narrowest,) = poles[[np.argmin(np.abs(poles.real / poles))]].imag
    at_pole = np.array([narrowest])
    right.loop_gain.find_pole_sums()
    true, found = (one.loop_gain(1j * at_pole) for one in (right, moved))
    difference = np.abs(found - true).max() / np.abs(true).max()
    assert difference > 1e-5
    assert right.errors.of_pole_sums(at_pole) < 1e-9
    assert moved.errors.of_pole_sums(at_pole) == pytest.approx(difference, rel=1e-3)
    assert moved.errors.of_pole_sums(at_pole * (1 + 1e-3)) == 0.0


@pytest.mark.parametrize(("seed", "per_mass"), campaign([(25, 0.08), (39, 0.06)], [(39, 0.06)]))
def test_what_the_air_does_to_high_modes_changes_the_largest_gain_by_less_than_stated(seed, per_mass, monkeypatch):
    """Against one eigenvalue problem of every mode: a hundred modes of each were 5e-4 and 1e-3 off."""
    text = scene_of(seed) | {"wind": WIND, "model": {"accuracy": 1e-4}}
    viscous = per_mass * text["cable"]["density"] * text["cable"]["area"]
    text["cable"] = text["cable"] | {"damping": {"model": "modal", "ratio": 0.0, "viscous": viscous}}
    found, error = case_of(text).analysis.largest_gain
    monkeypatch.setattr(type(SYSTEM), "windows_from", 10_000)
    truth, _ = case_of(text).analysis.largest_gain
    assert abs(found / truth - 1) <= error <= 1e-4


def test_the_stated_error_of_the_largest_gain_is_true_and_within_the_accuracy():
    """Six winches in the wind, against two elements of order 14 a cable, and four of order 8 against these."""
    path, found = CONFIGS / "suspensions" / "carlina-net-wind.yaml", []
    for model in ("{accuracy: 1e-4}", *(f"{{elements: {n}, order: {p}, mass: consistent}}" for n, p in FINE)):
        found.append(SuspensionCase(load_scene(path, [f"model={model}"])[1]).analysis)
    (gain, error), (truth, _), (finer, _) = (analysis.largest_gain for analysis in found)
    assert abs(gain / truth - 1) <= error <= 1e-4
    assert finer == pytest.approx(truth, rel=1e-7)


@pytest.mark.parametrize("data", [scene_of(1005), lossy(1047)])
def test_a_crossing_near_that_of_coarser_elements_is_the_first_of_all_frequencies(data):
    """Waves along the cables decide; those across them are resolved beyond their frequency by finer elements."""
    loop = case_of(data).analysis.loop_for_margins
    driven, finer = loop.stability.driven, loop.stability.driven.resolving
    assert finer is not driven
    assert driven.resolved_to < driven.limit.omega <= finer.resolved_to
    assert "gains" not in vars(finer)
    every = finer.gains.limits[0]
    assert driven.limit.factor == pytest.approx(every.factor, rel=1e-6)
    assert driven.limit.omega == pytest.approx(every.omega, rel=1e-6)


def single_limits(seed, model, gain=None):
    """Stability of a scene with 0.3 times the largest gain at accuracy 1e-3, and its gain [rad/s]."""
    text = scene_of(seed)
    if gain is None:
        gain = 0.3 * case_of({**text, "model": {"accuracy": 1e-3}}).analysis.largest_gain[0]
    text["control"]["gain"] = gain
    return case_of({**text, "model": model}).analysis.loop_for_margins.stability, gain


@pytest.mark.parametrize("seed", campaign((23, 70, 75), (70, 75)))
def test_the_limit_of_the_only_coordinate_is_that_of_the_loop(seed):
    """Waves across the cables decide, beyond what the first meshes resolve: they were 5 to 24 % off."""
    stability, gain = single_limits(seed, {"accuracy": 1e-3})
    limit = stability.largest_gain
    (factor,) = stability.single_limits.values()
    assert factor == pytest.approx(limit / gain, rel=1e-9)


def test_the_limit_of_one_coordinate_is_that_of_fine_elements():
    """0.8 % more than on the first meshes, which do not resolve the waves that decide; stated to 4e-5."""
    stability, gain = single_limits(48, {"accuracy": 1e-3})
    fine, _ = single_limits(48, {"elements": 5, "order": 20, "mass": "consistent"}, gain)
    error, _ = stability.errors_of_single_limits
    assert 0 < error < 1e-4
    assert stability.single_limits["y"] == pytest.approx(fine.single_limits["y"], rel=error)
    assert stability.single_limits["z"] == pytest.approx(fine.single_limits["z"], rel=1e-6)


def test_ends_that_winches_move_on_board_push_the_body_as_in_the_modes_of_the_whole():
    """Their moment on a body that turns, which the static gain of a state space has by neighbouring equilibria.

    The drag of the mean wind turns with the modes of the cables; at their ends alone it would leave 4e-7.
    """
    sets = ["winches.u1.end=to", "winches.u1.direction=[0.6, 0, 0.8]"]
    path = CONFIGS / "suspensions" / "carlina-net-wind.yaml"
    loop = SuspensionCase(load_scene(path, sets)[1]).analysis.closed_loop_of(64)
    s = TURN * 1j * np.array([0.02, 0.05, 0.1])
    expected = loop.loop.unit_gain(s)
    assert loop.stability.driven.loop_gain(s) == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("error", [3e-7, -3e-7])
def test_poles_of_the_model_with_errors_above_their_decay_hide_no_crossing(monkeypatch, error):
    """Strain damps waves across a cable by 1e-8 of their frequency: the resonance that decides is as narrow."""
    changes = "cable.damping={model: hysteretic, loss_factor: 1e-4, ratio: null}", "control.gain=1e-5 rad/s"
    scene = load_scene(CONFIGS / "suspensions" / "carlina-net-wind.yaml", ["model.accuracy=1e-3", *changes])[1]
    scene, poles_of = scene.model_copy(update={"wind": None}), driven_cables.open_poles
    own, _ = SuspensionCase(scene).analysis.largest_gain
    monkeypatch.setattr(driven_cables, "open_poles", lambda closed_loop: poles_of(closed_loop) * (1 + error))
    assert SuspensionCase(scene).analysis.largest_gain[0] == pytest.approx(own, rel=1e-9)


def six_cables(cut):
    """A body on six cables, two of them with winches; one of these in two parts at a junction without mass if `cut`."""
    anchors = np.array([
        [-57.6, -109.5, 44.4], [54.7, -111.2, -68.7], [113.2, 0.6, 81.7],
        [50.4, 74.7, -50.0], [-51.9, 85.9, 44.1], [-120.8, 3.6, -57.3],
    ])  # fmt: skip
    ends = np.array([
        [-0.64, -0.92, 0.39], [0.23, -0.95, -0.24], [0.88, -0.40, 0.46],
        [0.14, 0.93, -0.32], [-0.24, 0.96, 0.85], [-0.83, -0.35, -0.71],
    ])  # fmt: skip
    lengths = np.linalg.norm(anchors - ends, axis=1) * [0.9926, 0.9906, 0.9940, 0.9860, 0.9936, 0.9934]
    cables = {
        f"c{k}": {"from": anchor.tolist(), "to": f"b.e{k}", "unstretched_length": length}
        for k, (anchor, length) in enumerate(zip(anchors, lengths.tolist(), strict=True))
    }
    scene = {
        "bodies": {"b": {
            "at": [0, 0, 0], "mass": 115, "inertia": [56, 71, 66], "center_of_mass": [0, 0, -0.1],
            "attachments": {f"e{k}": end for k, end in enumerate(ends.tolist())},
        }},
        "cable": {"axial_stiffness": 1.85e5, "mass_per_length": 1.46e-3, "diameter": 7e-3,
                  "damping": {"loss_factor": 0.132}},
        "cables": cables,
        "winches": {"c1": {}, "c4": {}},
        "control": {"body": "b", "measured": ["x", "y", "z"], "gain": 0.02, "notch": {
            "frequency": 0.3, "damping_ratio": 0.05, "rolloff_frequency": 10.0, "rolloff_damping_ratio": 0.8,
        }},
        "model": {"accuracy": 1e-3},
    }  # fmt: skip
    if cut:
        first, second = 0.22 * lengths[1], 0.78 * lengths[1]
        scene["points"] = {"junction": {"at": (0.78 * anchors[1] + 0.22 * ends[1]).tolist(), "free": True}}
        cables["c1"] |= {"to": "junction", "unstretched_length": first}
        cables["second"] = {"from": "junction", "to": "b.e1", "unstretched_length": second}
    return scene


def lowest_wave(name):
    """Angular frequency of a taut string, pi/l (T/m)^(1/2), for a cable of `six_cables`. [rad/s]

    The tension T is that of massless springs, with half of the weight of each cable on the body.
    """
    scene = six_cables(cut=False)
    body, EA, per_length = scene["bodies"]["b"], scene["cable"]["axial_stiffness"], scene["cable"]["mass_per_length"]
    masses = [body["mass"], *(per_length * cable["unstretched_length"] / 2 for cable in scene["cables"].values())]
    places = np.array([body["center_of_mass"], *body["attachments"].values()])
    loaded = body | {"mass": sum(masses), "center_of_mass": np.average(places, axis=0, weights=masses)}
    straight = Straight({"cable": {"elastic_modulus": EA, "area": 1.0}, "bodies": {"b": loaded},
                         "cables": scene["cables"]})  # fmt: skip
    *_, tension, length, unstretched = list(straight.pulls(straight.pose))[list(scene["cables"]).index(name)]
    return np.pi / length * np.sqrt(tension / (per_length * unstretched / length))


def test_waves_across_a_junction_without_mass_are_seen_as_narrow_as_those_of_the_whole_cable():
    """Their poles are far from those of the parts between fixed ends, by which they are estimated."""
    loops = (case_of(six_cables(cut)).analysis.loop_for_notes.stability.driven for cut in (False, True))
    whole, cut = ([(limit.factor, limit.omega) for limit in loop.gains.limits[:3]] for loop in loops)
    assert np.array(cut) == pytest.approx(np.array(whole), rel=1e-4)
    # the eighth wave of the cut cable, which the body, moving with it, and the sag raise by some 1e-5
    assert cut[2][1] == pytest.approx(8 * lowest_wave("c1"), rel=3e-5)


def test_narrow_poles_are_those_of_the_equations():
    """Two coupled masses on springs, without cables: eigenvalues of their state matrix."""
    mass, damping = np.diag([2.0, 3.0]), 1e-7 * np.array([[2.0, -1.0], [-1.0, 4.0]])
    stiffness = np.array([[50.0, -20.0], [-20.0, 90.0]])
    poles = dense.poles(mass, damping, stiffness)
    poles = np.sort_complex(poles[poles.imag > 0])
    none = [np.zeros(shape) for shape in ((0, 6, 2), (0, 6, 0), (2, 0), (0, 2), (0, 0))]
    loop_gain = LoopGain(LinearSystem(mass, damping, stiffness), [], *none, controller=None)
    near = [poles + 1j * 1e-5]
    found = np.sort_complex(narrow_poles([loop_gain], near, near, [np.full(2, 1e-4)])[0])
    np.testing.assert_allclose(found, poles, rtol=1e-14)
    np.testing.assert_allclose(found.real, poles.real, rtol=1e-6)
    for estimated, error in (poles, 1e-4), (poles + 1j * 1e-5, 1e-9):  # right already; broader than their error
        assert not len(narrow_poles([loop_gain], [estimated], [estimated], [np.full(2, error)])[0])
