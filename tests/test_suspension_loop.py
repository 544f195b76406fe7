"""The loop of several winches, reaction masses and wheels against dense matrices made here, and closed forms."""

from copy import deepcopy
from functools import cache

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from campaign import campaign
from command import CONFIGS
from references.bar_loop import AXES, BarLoop
from references.modal_loop import gains_of_modes
from references.straight_suspension import Straight
from scipy.optimize import brentq
from solved import solve
from straight_scenes import ACTUATORS, LOOP, NOTCH, closed_loop_of, everything, one_axis, platform, two_bodies
from suspension_cases import case_at, case_of, scene_at, value

from cablestudy.control.margins_grid import frequencies, highest
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.motion.loop_stability import LoopStability
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.scene import load_scene
from cablestudy.study.columns import find
from cablestudy.study.motion_columns import SENSITIVITY
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.suspension.rows import evaluate_suspensions
from cablestudy.system.tolerances import SYSTEM

TURN = 2 * np.pi
FAST = 1e4  # poles above are those of cables without mass to speak of [rad/s]
EA = 1e5


def slow(poles):
    """Those below FAST, in order; the integrals of winches beyond what is measured are left out."""
    poles = poles[np.abs(poles) < FAST]
    return poles[np.lexsort((poles.imag.round(6), poles.real.round(6)))]


def agree(found, expected, tolerance):
    """Whether two sets of poles are the same, each to a tolerance of its size."""
    found, expected = slow(found), slow(expected)
    assert len(found) == len(expected)
    apart = np.abs(found[:, None] - expected[None]) / np.maximum(np.abs(expected), 1e-3)
    rows, columns = scipy.optimize.linear_sum_assignment(apart)
    assert apart[rows, columns].max() < tolerance


def springs(z):
    """Cables along x from both sides to attachments `up` and `down`, a distance above and below; a dict of them."""
    return {
        f"{side}{end}": {"from": [sign * 10.0, 0.0, at], "to": f"gondola.{end}", "unstretched_length": 9.9}
        for side, sign in (("w", -1), ("e", 1)) for end, at in (("up", z), ("down", -z))
    }  # fmt: skip


# ------------------------------------------------------------------------------------------------------- the poles

SIX_WINCHES = {f"f{i}": {"end": "to"} if i == 2 else {} for i in range(6)}
TWO = two_bodies(winches=SIX_WINCHES | {"s1": {}}, control=LOOP | {"body": "first", "allocation": None},
                 actuators={"spin": ACTUATORS["wheel"] | {"body": "second"},
                            "damp": ACTUATORS["mass_x"] | {"body": "second"}})  # fmt: skip
CASES = {
    "all": everything(),
    "no notch": everything(control__notch="none"),
    "no actuators": everything(actuators={}),
    "position only": everything(control=LOOP | {"measured": ["x", "z"], "notch": "none", "gain": 1.5}),
    "pose of six": two_bodies(winches=SIX_WINCHES, control={"body": "first", "gain": 0.3, "notch": NOTCH}),
    "two bodies": TWO,
    "hardly damped": platform(
        time=2e-5, winches={"c4": {}, "c6": {}}, control={"measured": ["z"], "gain": 0.005, "notch": NOTCH}
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_closed_loop_poles_are_the_eigenvalues_of_a_dense_model(name):
    text = CASES[name]
    closed_loop, own = closed_loop_of(text), Straight(text)
    agree(closed_loop.loop.poles, np.linalg.eigvals(own.closed()), 2e-7)
    assert closed_loop.body.allocation.matrix == pytest.approx(own.shares, abs=2e-7 * np.abs(own.shares).max())
    s = np.array([0.3j, 5j, 1 + 20j])
    expected = own.unit_gain(s)
    for unit_gain in (closed_loop.loop.unit_gain, closed_loop.stability.gains.loop_gain):
        assert np.abs(unit_gain(s) - expected).max() < 2e-7 * np.abs(expected).max()


def test_rotations_and_displacements_are_corrected_without_error_at_rest():
    """Six winches, six measured coordinates: L tends to gain/s times the unit matrix."""
    closed_loop, s = closed_loop_of(CASES["pose of six"]), np.array([1e-7j])
    for unit_gain in (closed_loop.loop.unit_gain, closed_loop.stability.gains.loop_gain):
        assert np.abs(s[0] * unit_gain(s)[0] - np.eye(6)).max() < 1e-6


# --------------------------------------------------------------------------------------------------------- margins


def limit_of(own, start=0.5, gains=None, place=None):
    """The least gain, or factor of the gain of one coordinate, with growth: by steps of 2 % and bisection."""
    fixed, scaled = (own.closed(gain) for gain in (0.0, 1.0))
    if gains is not None:
        fixed = own.closed(gains=gains * (np.arange(len(gains)) != place))
        scaled = own.closed(gains=gains) - fixed
    else:
        scaled = scaled - fixed

    def growth(factor):
        return np.linalg.eigvals(fixed + np.asarray(factor)[..., None, None] * scaled).real.max(axis=-1)

    for first in range(-150, 400, 50):
        factors = start * 1.02 ** np.arange(first - 1, first + 50)
        grows = growth(factors) > 1e-9
        if grows.any():
            place = np.argmax(grows)
            return brentq(growth, factors[place - 1], factors[place], xtol=1e-12 * start, rtol=1e-12)
    raise ValueError("nothing grows")


@cache
def limit_of_case(name):
    """The least gain with growth of one of CASES."""
    return limit_of(Straight(CASES[name]))


@pytest.mark.parametrize("name", ["all", "no notch", "pose of six", "hardly damped"])
def test_the_largest_gain_is_where_the_first_pole_crosses(name):
    text, limit = CASES[name], limit_of_case(name)
    closed_loop = closed_loop_of(text)
    assert closed_loop.stability.largest_gain == pytest.approx(limit, rel=1e-6)
    gain = text["control"]["gain"]
    assert value(case_of(text), "gain_margin") == pytest.approx(20 * np.log10(limit / gain), abs=1e-5)


@pytest.mark.parametrize("name", ["all", "two bodies"])
def test_the_limit_of_one_loop_alone(name):
    text, own = CASES[name], Straight(CASES[name])
    gain, k = text["control"]["gain"], len(own.measured)
    found = closed_loop_of(text).stability.single_limits
    expected = [limit_of(own, 2.0, np.full(k, gain), place) for place in range(k)]
    assert list(found.values()) == pytest.approx(expected, rel=1e-6)


def test_one_winch_along_two_strongly_damped_cables_has_no_limit_in_any_of_three_coordinates():
    """L is of rank one, l(s) n n^T with n along the cables: what rounding leaves of its other eigenvalues is no limit.

    With a factor f on the gain of coordinate j no pole crosses, since 1 + l (1 + (f - 1) n_j^2) is nowhere zero.
    """
    text, n = one_axis(("x", "y", "z"), time=1.0, winches={"west": {}}), np.array([0.7, 0.5, 0.3])
    text["control"] = {"measured": ["x", "y", "z"], "gain": 0.05, "notch": NOTCH}
    for name, side in (("west", -10), ("east", 10)):
        text["cables"][name]["from"] = (side * n / np.linalg.norm(n)).tolist()
    s, k, zeros, poles = 1j * np.geomspace(1e-4, 1e8, 200_001), EA / 9.9, TURN * 1.1, TURN * 10
    notch = (s**2 + 0.1 * zeros * s + zeros**2) / (s**2 + 2 * poles * s + poles**2) * (poles / zeros) ** 2
    size = notch / s * 2 * k * (1 + s) / (20 * s**2 + 2 * k * (1 + s))
    turned = size[:-1].imag * size[1:].imag <= 0
    assert not (turned & (size[1:].real < 0)).any()
    assert set(closed_loop_of(text).stability.single_limits.values()) == {np.inf}


def test_the_peak_of_the_sensitivity_where_another_one_is_nearly_as_high():
    """A broad peak, and a slightly higher and narrower one that lies between two frequencies of the grid."""
    omega = frequencies(np.array([-0.5 + 1j, -0.6 + 1.1j]))
    middle = np.sqrt(omega[40] * omega[41])

    def size(omega):
        place = np.log(omega)
        broad, narrow = place - np.log(omega70), (place - np.log(middle)) / np.log(omega41 / omega40)
        return 1 + np.exp(-(broad**2)) + 1.03 * np.exp(-((1.5 * narrow) ** 2))

    omega40, omega41, omega70 = omega[[40, 41, 70]]
    peak = size(middle * np.linspace(0.97, 1.03, 400_001)).max()
    assert size(omega).argmax() == 70
    ((height, _),) = highest(lambda omega, _: size(omega), [(omega, size(omega))])
    assert height == pytest.approx(peak, rel=1e-9)


@pytest.mark.crossed
@pytest.mark.parametrize("name", ["all", "no notch", "pose of six", "two bodies", "hardly damped"])
@pytest.mark.parametrize("peak", [1.2, 2.0, 1e6])
def test_an_automatic_gain_is_the_largest_that_bounds_the_sensitivity_and_has_the_margin(name, peak):
    text = deepcopy(CASES[name])
    text["control"]["gain"] = {"auto": {"gain_margin": 6.0, "sensitivity": peak}}
    own = Straight(CASES[name])
    case, most = case_of(text), limit_of_case(name) / 10 ** (6 / 20)
    gain, stated = value(case, "gain"), value(case, "sensitivity_peak")
    poles = np.concatenate([np.linalg.eigvals(own.closed(one)) for one in (0.0, gain)])
    beside = [abs(p.imag) + step * abs(p.real) for p in poles for step in np.linspace(-4, 4, 41)]
    grid = np.unique(np.concatenate([np.geomspace(1e-3, 1e3, 2000), np.clip(beside, 1e-3, 1e3)]))
    unit = own.unit_gain(1j * grid)

    def sizes(gain, unit=unit):
        return 1 / np.linalg.svd(np.eye(len(own.measured)) + gain * unit, compute_uv=False)[:, -1]

    found = sizes(gain)
    assert found.max() <= peak * (1 + 1e-6)
    assert stated <= peak * (1 + 1e-5)
    assert gain <= most * (1 + 1e-6)
    assert gain == pytest.approx(most, rel=1e-6) or found.max() == pytest.approx(peak, rel=1e-3)
    above = np.linspace(gain, most, 40)[1:] if gain < most * (1 - 1e-4) else []
    near = unit[np.argsort(found)[-200:]]  # the bound is passed there first, if not there then elsewhere
    assert all(sizes(one, near).max() > peak or sizes(one).max() > peak for one in above)


# ------------------------------------------------------------------------------------------------------ what grows


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"control__gain": 50.0}, "the loop is unstable at 50 rad/s: mode"),
        ({"actuators__mass_z__velocity_gain": -400.0}, "unstable without winches (actuators): "),
        ({"actuators__wheel__rate_gain": -80.0}, "unstable without winches (actuators): "),
    ],
)
def test_what_grows_is_refused_by_name(changes, words):
    text = everything(**changes)
    del text["wind"], text["bodies"]["gondola"]["wind"]
    own = Straight(text)
    A = own.closed(0.0) if "actuators" in words else own.closed()
    values = np.linalg.eigvals(A)
    place = np.argmax(values.real)
    assert values[place].real > 0
    with pytest.raises(NoSolutionError) as caught:
        case_of(text).analysis.closed_loop  # noqa: B018
    message = str(caught.value)
    assert message.startswith(words)
    assert f"grows by {values[place].real:.3g}/s at {abs(values[place].imag) / TURN:.4g} Hz" in message
    if "actuators" not in words:
        limit = limit_of(own)
        assert f"stable below {limit:.4g} rad/s" in message


def test_a_loop_that_is_stable_for_every_gain_has_no_limit(monkeypatch):
    """One winch, one coordinate, much damping: the dense model is stable up to 1e6 rad/s.

    The first trial gain is lower than that, and no limit is stated from it alone.
    """
    changes = {"cable__density": 1e-7, "cable__damping__time": 0.5, "winches": {"west": {}}}
    text = one_axis(control={"gain": 0.01, "notch": "none"}, **changes)
    own = Straight(text)
    poles = [np.linalg.eigvals(own.closed(gain)).real.max() for gain in np.geomspace(1e-3, 1e6, 60)]
    assert max(poles) < 1e-9
    assert closed_loop_of(text).stability.largest_gain is None
    assert value(case_of(text), "gain_margin") is None
    monkeypatch.setattr(type(MOTION), "gain_trials", 1)
    for name in ("largest_gain", "gain_margin", "phase_crossover"):
        with pytest.raises(ConvergenceError, match="stable up to a larger one: the largest gain is not known"):
            value(case_of(text), name)
    text["control"]["gain"] = {"auto": {"gain_margin": 12.0}}
    with pytest.raises(ConvergenceError, match="the largest gain is not known"):
        value(case_of(text), "gain")


def test_a_loop_without_gain_drives_nothing(monkeypatch):
    """It is the suspension with its winches at rest, and no modes are sought that a gain could drive."""
    monkeypatch.setattr(LoopStability, "_search_driven_cables", lambda self: pytest.fail("modes are sought"))
    text = everything(control__gain=0.0)
    case, at_rest = case_of(text), case_of({key: text[key] for key in text if key != "control"})
    assert case.analysis.closed_loop.stability.stable
    found, expected = (one.analysis.rms(["gondola.x"], "value", open_loop=False)[0] for one in (case, at_rest))
    assert found == pytest.approx(expected, rel=1e-9)


# ------------------------------------------------------------------------------------------------------- actuators

K = 2 * EA / 9.9  # of `one_axis` along x
FREE = {"damping_ratio": 0.0, "stroke": 1.0, "force": 1.0}  # keys of a mass that nothing damps


def test_a_reaction_mass_on_one_coordinate_is_a_pair_of_masses():
    """(M - m) x'' + K x = k q + c q' - F, m (x'' + q'') = -k q - c q' + F, F = g x' + p x."""
    M, m, f, ratio, g, p = 20.0, 3.0, 4.0, 0.2, 35.0, 600.0
    own = FREE | {"axis": [2, 0, 0], "mass": m, "frequency": f, "damping_ratio": ratio, "velocity_gain": g,
                  "position_gain": p}  # fmt: skip
    k, c = m * (TURN * f) ** 2, 2 * ratio * m * TURN * f
    # body: x, mass: y = x + q
    balance = np.array([
        [M - m, c + g, K + k + p], [0.0, -c, -k],
        [0.0, -c - g, -k - p], [m, c, k],
    ])  # fmt: skip
    determinant = np.polysub(np.polymul(balance[0], balance[3]), np.polymul(balance[1], balance[2]))
    agree(closed_loop_of(one_axis(actuators={"mass": own})).open_poles, np.roots(determinant), 1e-8)


def test_the_best_passive_mass_after_den_hartog():
    """m/(M - m) = mu, tuned to 1/(1 + mu): both fixed points of |x| are equally high, sqrt(1 + 2/mu) static ones."""
    M, mu = 20.0, 0.1
    m = M * mu / (1 + mu)
    main = np.sqrt(K / (M - m))
    own = FREE | {"axis": [1, 0, 0], "mass": m, "frequency": main / (1 + mu) / TURN}
    fixed = np.sqrt((1 + np.array([-1, 1]) * np.sqrt(mu / (2 + mu))) / (1 + mu)) * main
    heights = []
    for ratio in (0.05, 0.3, 2.0):
        motion = closed_loop_of(one_axis(actuators={"mass": own | {"damping_ratio": ratio}})).motion
        row = motion.c[0][0]
        dynamic = motion.dynamic_stiffness(1j * fixed)
        heights.append([abs(row @ np.linalg.solve(one, row)) * K for one in dynamic])
    assert np.array(heights) == pytest.approx(np.sqrt(1 + 2 / mu), rel=1e-7)


def test_a_mass_with_a_high_pass_filter():
    """With a soft spring and F = g h x' the body alone has M' x'' + g h x' + K x = 0, h = s/(s + w)."""
    M, m, g, corner = 20.0, 2.0, 40.0, 3.0
    own = FREE | {"axis": [1, 0, 0], "mass": m, "frequency": 1e-6, "velocity_gain": g, "high_pass": corner / TURN}
    body = np.roots(np.polyadd(np.polymul([M - m, 0.0, K], [1.0, corner]), [g, 0.0, 0.0]))
    found = closed_loop_of(one_axis(actuators={"mass": own})).open_poles
    found = found[(np.abs(found) < FAST) & (np.abs(found) > 1e-3)]
    agree(found, body, 1e-8)


def test_a_reaction_wheel():
    """A body that may only turn about y, (I - J) r'' + g h r' + k r = 0: J turns freely."""
    inertia, J, g, corner, radius = 5.0, 0.8, 2.5, 0.7, 0.5  # of `one_axis` about y
    text = one_axis(free=["pitch"])
    text["bodies"]["gondola"]["attachments"] = {"up": [0, 0, radius], "down": [0, 0, -radius]}
    text["cables"] = springs(radius)
    limits = {"momentum": 1.0, "torque": 1.0}
    wheel = {"axis": [0, -3, 0], "inertia": J, "rate_gain": g, "high_pass": corner / TURN} | limits
    stiffness = 4 * EA / 9.9 * radius**2  # two pairs; the pull of each pair cancels
    found = closed_loop_of(text | {"actuators": {"wheel": wheel}}).open_poles
    agree(found, np.roots([inertia - J, (inertia - J) * corner + g, stiffness, stiffness * corner]), 1e-8)


def test_the_weight_of_a_mass_turns_the_body_that_tilts():
    """A mass at x = q cos + h sin, z = h cos - q sin of the pitch: kinetic m (q' + h p')^2/2, potential -m g q p."""
    m, h, f, g, pitch_inertia, radius = 2.0, 0.6, 1.3, 9.81, 5.0, 0.5
    text = one_axis(gravity=g, free=["pitch"])
    text["bodies"]["gondola"]["attachments"] = {"up": [0, 0, radius], "down": [0, 0, -radius]}
    text["cables"] = springs(radius)
    own = FREE | {"at": [0, 0, h], "axis": [1, 0, 0], "mass": m, "frequency": f}
    K2 = np.array([[4 * EA / 9.9 * radius**2, -m * g], [-m * g, m * (TURN * f) ** 2]])
    M2 = np.array([[pitch_inertia, m * h], [m * h, m]])
    omega = np.sqrt(scipy.linalg.eigvalsh(K2, M2))
    found = slow(closed_loop_of(text | {"actuators": {"mass": own}}).open_poles)
    assert np.sort(found.imag)[2:] == pytest.approx(omega, rel=1e-8)
    wrong = np.sqrt(scipy.linalg.eigvalsh(np.abs(K2), M2))
    assert np.abs(wrong / omega - 1).max() > 1e-3  # the sign of the weight shows


ON_BOARD = [f"winches.{name}.end=to" for name in ("u1", "u2", "u3", "d1", "d2", "d3")]


def test_the_loop_is_judged_with_the_modes_that_it_drives():
    """With winches on board modes near 19 Hz decide, above the 64 of the model; a model of 250 has them all."""
    found = case_at("carlina-net-wind", *ON_BOARD).analysis
    limit = found.closed_loop.stability.limit
    assert limit.omega / TURN > 18 > found.closed_loop.modes.frequency[-1]
    assert found.largest_gain[1] < 0.03
    assert_limit_of_modes(found.closed_loop_of(250), limit)


def test_the_damping_of_modes_by_the_air_counts_once():
    """Half of the diagonal of the damping matrix of each cable in the wind, which the loop gain has."""
    closed_loop = case_at("carlina-net-wind").analysis.loop_for_margins
    for cable, element in enumerate(closed_loop.stability.driven.loop_gain.elements):
        _, damping, _ = element.matrices()
        modes = np.arange(len(element.omega))
        decay = np.diagonal(damping)[modes] / 2 + element.damping_ratio * element.omega  # by the air, and by the strain
        assert closed_loop.stability.effects._decay(cable, element) == pytest.approx(decay)


def assert_limit_of_modes(closed_loop, limit):
    """Near that of a model with many coupled modes, which lacks those of the cables not far above it."""
    truth = gains_of_modes(closed_loop).limits[0]
    assert limit.factor == pytest.approx(truth.factor, rel=3e-3)
    assert limit.omega == pytest.approx(truth.omega, rel=1e-4)


def test_waves_along_the_cables_far_above_the_roll_off_are_found():
    """Thin cables with little tension: the second wave along them, near 38 Hz, decides; a model of 450 modes has it."""
    found = case_at("carlina-net-wind", "cable.diameter=3 mm", "tensions.min=1345 N").analysis
    limit = found.closed_loop.stability.limit
    assert 37 < limit.omega / TURN < 39
    assert found.largest_gain[1] < 0.1
    assert_limit_of_modes(found.closed_loop_of(450), limit)


EXACT = "control.notch={frequency: coupled, damping_ratio: 0.05, rolloff_frequency: 10, rolloff_damping_ratio: 1}"


@pytest.mark.parametrize("elements", campaign([8, 14], [14]))
def test_exact_elements_are_judged_with_all_of_their_modes(elements):
    """The mode that decides is the second wave along the cables, near 38 Hz, above the 64 lowest modes of 14 bars."""
    sets = ["cable.diameter=1.85 mm", "cable.damping={model: modal, ratio: 0.01}", "wind=null", "actuators=null",
            "control.measured=[x, y, z]", EXACT, f"model={{elements: {elements}, order: 1}}"]  # fmt: skip
    case = case_at("carlina-net-wind", *sets)
    closed_loop = case.analysis.closed_loop
    notch = {"frequency": "coupled", "damping_ratio": 0.05, "rolloff_frequency": 10.0, "rolloff_damping_ratio": 1.0}
    own = BarLoop({
        "gravity": 9.81, "cable": {"damping": {"model": "modal", "ratio": 0.01}}, "bodies": {"b": {"free": list(AXES)}},
        "winches": {name: {} for name in case.scene.winches}, "control": {"measured": ["x", "y", "z"], "notch": notch},
    }, closed_loop.equilibrium, elements)  # fmt: skip
    assert closed_loop.body.allocation.matrix == pytest.approx(own.allocation, abs=1e-6 * np.abs(own.allocation).max())
    limit = closed_loop.stability.largest_gain
    for factor in (0.3, 0.6, 0.9, 0.995, 1 - 1e-6, 1 + 1e-6, 1.005):
        assert (own.poles(factor * limit).real.max() > 1e-9 * limit) == (factor > 1), factor


def test_each_column_of_the_loop_states_its_own_error():
    """A gain that is given has none; the others are held against the loop gain of 450 coupled modes.

    No mean wind: its drag would be an error of its own.
    """
    limits = "gain", "largest_gain", "gain_margin", "phase_crossover"
    margins = "phase_margin", "gain_crossover", "delay_margin", *SENSITIVITY
    names = *limits, *margins
    case = case_at("carlina-net-wind", *ON_BOARD, "control.gain=2", "wind.mean=false")
    found = {name: find(name).compute(case) for name in names}
    truth = _numbers(gains_of_modes(case.analysis.closed_loop_of(450)), margins)
    assert found["gain"] == (2.0, 0.0)
    for name in names[1:]:
        own, error = found[name]
        assert abs(own / truth[name] - 1) <= max(error, 1e-8), name  # 1e-8: of the 450 modes
    errors = {name: error for name, (_, error) in found.items()}
    assert errors["phase_margin"] < 0.1 * errors["largest_gain"]
    limit, margin = errors["largest_gain"], found["gain_margin"][0]
    assert errors["gain_margin"] == pytest.approx(20 * np.log10(1 + limit) / margin, rel=1e-9)


def _numbers(gains, names):
    """Margins of a gain of 2 rad/s by their names, and the numbers of the limit: dict."""
    margins, limit = gains.margins(2.0), gains.limits[0]
    found = {name: getattr(margins, name) for name in names} | {"largest_gain": limit.factor}
    return found | {"gain_margin": 20 * np.log10(limit.factor / 2), "phase_crossover": limit.omega / TURN}


def test_the_error_of_an_automatic_gain_is_that_of_what_it_follows_from():
    text = everything(control__gain={"auto": 6.0})
    _, error = find("gain").compute(case_of(text))
    assert 0 < error < 0.1
    assert find("gain").compute(case_of(everything())) == (0.4, 0.0)


def test_waves_that_damped_strain_couples_are_all_in_the_loop_gain(monkeypatch):
    """A slack cable of 586 modes, against one eigenvalue problem of them all; a hundred give 5.58 rad/s."""
    damping = "cable.damping={model: hysteretic, loss_factor: 0.02, viscous: 0.02}"
    _, scene = load_scene(
        str(CONFIGS / "slack.yaml"), [damping, "winch.controller.gain=0.05", "model={accuracy: 1e-4}"]
    )
    found, error = CableCase(scene).analysis.largest_gain
    monkeypatch.setattr(type(SYSTEM), "windows_from", 10_000)
    every, _ = CableCase(scene).analysis.largest_gain
    assert error < 1e-5
    assert found == pytest.approx(every, rel=error)


def test_the_largest_gain_is_that_of_cables_in_their_own_drag():
    """Elements have equilibria of their own in it; in drag that is uniform along each cable the gain is 1.7 % less.

    With `wind` the drag turns with what moves: a pole of all modes of some elements crosses where their loop gain says.
    If it turned with the ends of the cables alone, the gain would be 1.1e-3 off.
    """
    anchors = {"east": (30, 0, 12), "west": (-22, 15, 9), "north": (-14, -25, 14), "down": (6, 2, -24)}
    damping = {"model": "modal", "ratio": 0.0, "viscous": 0.4}
    notch = {"frequency": 1.0, "damping_ratio": 0.7, "rolloff_frequency": 2.0, "rolloff_damping_ratio": 0.7}
    scene = {
        "cable": {"axial_stiffness": 4e6, "mass_per_length": 0.09, "diameter": 0.01, "damping": damping},
        "bodies": {"b": {"at": [0, 0, 0], "mass": 8.0, "free": ["x", "y", "z"], "attachments": {"a": [0, 0, 0]}}},
        "cables": {
            name: {"from": list(anchor), "to": "b.a", "unstretched_length": 1.001 * float(np.linalg.norm(anchor))}
            for name, anchor in anchors.items()
        },
        "winches": {"east": {}, "west": {}, "north": {}},
        "control": {"measured": ["x", "y"], "gain": 0.2, "notch": notch},
        "cases": {"storm": {"wind": {"speed": 10.0, "direction": 0.7}}},
        "case": "storm",
    }
    found = solve(scene, "largest_gain")
    by_elements = solve({**scene, "model": {"elements": 8, "order": 12}}, "largest_gain").values["largest_gain"]
    assert found.values["largest_gain"] == pytest.approx(by_elements, rel=found.errors["largest_gain"])
    assert found.errors["largest_gain"] < 1e-3
    turning = {key: part for key, part in scene.items() if "case" not in key}
    turning["wind"] = {"speed": 30.0, "direction": 0.7, "turbulence_intensity": 0.1, "length_scale": 50.0, "on": "both"}
    assert solve(turning, "largest_gain").errors["largest_gain"] < 2e-3
    case = case_of({**turning, "model": {"elements": 3, "order": 8}})
    loop, limit = case.analysis.closed_loop_of(10_000).untuned_loop, case.analysis.largest_gain[0]
    growth = [loop.poles_with(limit * ratio).real.max() for ratio in (1 - 1e-6, 1 + 1e-6)]
    assert growth[0] < 0 < growth[1]


def test_a_row_whose_gain_is_refused_keeps_its_other_cells_and_has_notes():
    """Strain damps the waves that decide by 1e-10 of their frequency; the gain follows from a margin."""
    sets = "model.accuracy=1e-3", "cable.damping={loss_factor: 1e-6, ratio: null}", "control.gain=auto: 6 dB"
    scene = scene_at("carlina-net-wind", *sets).model_copy(update={"wind": None})
    columns = [find(name) for name in ("gondola.z", "largest_gain")]
    (row,) = evaluate_suspensions([scene], columns, estimate=True)
    assert row.cells["status"].startswith("no largest gain")
    assert row.cells["gondola.z_m"] is not None
    assert any(note.startswith("motion: ") for note in row.notes)
