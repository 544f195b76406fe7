"""One verdict on a loop: dense eigenvalues on two meshes, whatever columns and accuracy are asked for."""

import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from cables import along_x, excited
from campaign import campaign
from command import CONFIGS
from one_loop import OneLoop
from references import continuous_cable, dense, loop_matrix, scene_truth
from references.continuous_cable import dynamic_end_stiffness
from scenes import cells, scene
from scipy.optimize import brentq
from solved import solve

from cablestudy.control.motion import ActuatorFeedback
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.motion.loop_stability import LoopStability
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.scene import CableScene, load_scene
from cablestudy.study.columns import find
from cablestudy.study.one_cable.rows import evaluate
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.table_rows import SLACK
from cablestudy.system.linear import LinearSystem
from cablestudy.system.tolerances import SYSTEM

HYSTERETIC = "cable.damping={loss_factor: 0.02}"
DIAMETERS = np.linspace(1.5, 6.0, 23).tolist()  # mm
SHORT = {  # a cable of one metre whose 19th mode the gain drives
    "cable": {"chord": 1.009, "inclination": 0.392, "elastic_modulus": 2.36e9, "density": 825, "area": 1.54e-6,
              "unstretched_length": 1.009, "damping": {"time": 3.81e-4}},
    "gondola": {"mass": 4.96, "area": 0.139, "drag_coefficient": 1.53},
    "winch": {"location": "gondola", "controller": {"gain": 11, "notch": {
        "frequency": "coupled", "damping_ratio": 0.158, "rolloff_frequency": 90.9, "rolloff_damping_ratio": 0.766}}},
    "wind": {"speed": 6.26, "turbulence_intensity": 0.214, "length_scale": 8.64, "admittance": "none",
             "aerodynamic_damping": False},
}  # fmt: skip


def short(gain, accuracy=1e-4, **damping):
    data = {**SHORT, "model": {"accuracy": accuracy}}
    data["winch"] = {**SHORT["winch"], "controller": {**SHORT["winch"]["controller"], "gain": gain}}
    data["cable"] = {**SHORT["cable"], "damping": {**SHORT["cable"]["damping"], **damping}}
    return CableScene.model_validate(data)


def most_driven_modes(count):
    """Frequencies of the modes of the cable of `SHORT`, continuous, whose poles grow most with the gain, as printed.

    A mode of frequency w between fixed ends that pulls end 2 by p q has the dynamic stiffness -p^2/(s^2 + w^2) there,
    near w. With a heavy gondola M and the winch on it, s^2 + w^2 = p^2 (1 + gain N/s)/(M s^2) for its pole, which grows
    with the gain by p^2 Re N/(2 M w^4).
    """
    span, (EA, mass) = (1.009 * np.cos(0.392), 1.009 * np.sin(0.392)), (2.36e9 * 1.54e-6, 825 * 1.54e-6)
    modes = continuous_cable.modes(*span, 1.009, EA, mass, 9.81, 24)
    cable = scene_truth.Cable(1.009, 0.392, 1.009, EA, mass, 9.81, gondola=4.96)
    coupled, turn = scene_truth.Truth(cable).gondola_frequency()[0], 2 * np.pi
    omega, pull = turn * modes.frequencies, modes.end_forces[:, 1, 0]
    growth = pull**2 * loop_matrix.notch(1j * omega, turn * coupled, 0.158, turn * 90.9, 0.766).real / omega**4
    return {f"{frequency:.1f}" for frequency in modes.frequencies[np.argsort(-growth)[:count]]}


def random_scene(seed):
    """Winch on either side, inclined or level, taut or slack, Kelvin-Voigt or hysteretic."""
    draw = np.random.default_rng(seed)

    def spread(low, high):
        return float(10 ** draw.uniform(np.log10(low), np.log10(high)))

    chord, slack = spread(1, 300), float(draw.choice([-0.1, 1.0, 1.0])) * spread(1e-6, 5e-2)
    cable = {
        "chord": chord, "inclination": float(draw.choice([0.0, draw.uniform(-1.2, 1.2)])),
        "elastic_modulus": spread(1e9, 2e11), "density": spread(800, 8000), "area": spread(1e-7, 1e-4),
        "unstretched_length": chord * (1 + slack),
        "damping": {"time": spread(1e-5, 1e-2)} if draw.random() < 0.5 else {"loss_factor": spread(1e-3, 0.1)},
    }  # fmt: skip
    notch = "none"
    if draw.random() > 0.2:
        notch = {"frequency": "coupled", "damping_ratio": float(draw.uniform(0.03, 0.3)),
                 "rolloff_frequency": spread(1, 100),
                 "rolloff_damping_ratio": float(draw.uniform(0.3, 1.2))}  # fmt: skip
    mass = cable["density"] * cable["area"] * chord * spread(1, 300)
    where = str(draw.choice(["ground", "gondola"]))
    return CableScene.model_validate({
        "cable": cable, "gondola": {"mass": mass, "area": 0.2, "drag_coefficient": 1.5},
        "winch": {"location": where, "controller": {"gain": 1.0, "notch": notch}}, "model": {"accuracy": 1e-4},
    })  # fmt: skip


def dense_growth(loop, gain, order):
    """Largest growth over frequency among the resolved poles of the closed loop with every mode of one element."""
    finer = loop.case.refined(2, order)
    modes = excited(finer).modes(excited(finer).dof)
    resolved = 2 * np.pi * modes.frequency[np.maximum.accumulate(modes.errors) < 1e-6].max(initial=0.0)
    poles = dense_loop(along_x(finer), loop, gain)
    poles = poles[(poles.imag > 0) & (np.abs(poles) < resolved)]
    return (poles.real / np.abs(poles)).max(initial=-1.0)


@pytest.mark.parametrize("seed", campaign([1, 2, 3, 6, 9, 11, 13, 14], [1, 9]))
def test_no_loop_is_called_stable_that_dense_matrices_on_two_meshes_call_unstable(seed):
    loop = OneLoop(random_scene(seed))
    try:
        limit = loop.largest_gain
    except NoSolutionError as error:
        limit = re.search(r" at (\S+) rad/s", str(error))
        limit = float(limit[1]) if limit else None
    begin = limit or loop.open_poles.imag.max()
    for gain in begin * np.array([0.1, 0.3, 0.98, 1.02, 3.0, 10.0]):
        try:
            loop.with_gain(float(gain)).check_stable()
            refused = ""
        except CablestudyError as error:
            refused = str(error)
        growth = [dense_growth(loop, gain, order) for order in (30, 38)]
        if min(growth) > 1.2 * CONTROL.negligible_growth:
            assert refused, (gain / begin, growth)
        if max(growth) < 0:
            assert "unstable" not in refused, (gain / begin, growth, refused)


@pytest.mark.parametrize("accuracy", campaign([1e-3, 1e-4, 1e-5], [1e-3]))
def test_the_verdict_does_not_depend_on_columns_or_accuracy(accuracy):
    chosen = ("gondola_rms", "error_estimate"), ("gondola_rms",), ("gondola_rms_velocity", "phase_margin")
    modes = most_driven_modes(2)
    tried = list(product(chosen if accuracy > 1e-4 else chosen[:1], (0.3, 0.6, 11)))
    for names, gain in campaign(tried, tried[::4] if accuracy > 1e-4 else tried[::2]):
        status = solve(short(gain, accuracy), *names).status
        if gain == 0.3:
            assert status == SLACK  # stable, but in a strong wind
        else:
            assert re.match(rf"the loop is unstable at {gain} rad/s: .* grows by .* at \d+\.\d Hz", status)
            assert set(re.findall(r"(\S+) Hz", status)) <= modes
            assert "cable.damping.viscous" in status


def test_a_gain_of_eleven_has_a_growing_pole_on_two_meshes():
    loop = OneLoop(short(11))
    growth = [dense_growth(loop, 11.0, order) for order in (38, 46)]
    assert growth == pytest.approx([growth[0]] * 2, rel=1e-3)
    assert growth[0] > 10 * CONTROL.negligible_growth
    # and at 0.3 it would take a billion oscillations to see it
    assert dense_growth(loop, 0.3, 46) < CONTROL.negligible_growth


@pytest.mark.parametrize("viscous", [2e-7, 2e-5])
def test_with_viscous_damping_the_limit_is_that_of_dense_matrices(viscous):
    loop = OneLoop(short(1.0, viscous=viscous))
    limit = loop.largest_gain
    for order in (38, 46):
        assert dense_growth(loop, limit * (1 - 1e-3), order) < 0 < dense_growth(loop, limit * (1 + 1e-3), order)


def test_a_gain_from_a_margin_is_refused_where_undamped_modes_decide_and_has_the_margin_otherwise():
    auto = {"auto": {"gain_margin": 6, "sensitivity": 1e6}}
    names = "gain_margin", "gondola_rms"
    assert "cable.damping.viscous" in solve(short(auto), *names).status
    found = solve(short(auto, 1e-2, viscous=2e-6), *names).values  # such an RMS is known to no more digits
    assert found["gain_margin"] == pytest.approx(6, abs=1e-9)
    assert found["gondola_rms"] > 0


def test_poles_in_windows_are_in_the_stated_errors_of_largest_gain_and_gain(monkeypatch):
    """Against the poles of all modes at once."""
    scene, most = short({"auto": 6.0}, viscous=2e-5), {"largest_gain": 2e-6, "gain": 1e-4}
    found = solve(scene, *most)
    monkeypatch.setattr(type(SYSTEM), "windows_from", 10_000)
    truth = solve(scene, *most)
    for name, error in found.errors.items():
        assert found.values[name] == pytest.approx(truth.values[name], rel=error)
        assert error <= most[name]


@pytest.mark.parametrize("viscous", campaign([2e-6, 2e-5], [2e-5]))
def test_an_automatic_gain_bounds_the_sensitivity_of_the_continuous_cable(viscous):
    """L from the dynamic stiffness of the continuous cable; a mode near 90 Hz decides, far above those of the RMS."""
    scene = short({"auto": 6.0}, viscous=viscous)
    answers = solve(scene, "gain", "largest_gain", "sensitivity_peak", "sensitivity_frequency").values
    gain, limit, stated, place = answers.values()
    turn = 2 * np.pi
    notch = OneLoop(scene).notch.omega, 0.158, 90.9 * turn, 0.766
    span, mass = (1.009 * np.cos(0.392), 1.009 * np.sin(0.392)), 825 * 1.54e-6

    def sensitivity(omega):
        lossy = omega * np.sqrt(1 - 1j * viscous / (mass * omega))  # m s^2 + c s
        ends = dynamic_end_stiffness(*span, 1.009, 2.36e9 * 1.54e-6, mass, 9.81, lossy, n=80, eta=omega * 3.81e-4)
        stiffness = ends[0, 0]
        passed = loop_matrix.notch(1j * omega, *notch)
        return 1 / abs(1 + gain / (1j * omega) * passed * stiffness / (stiffness - 4.96 * omega**2))

    near = turn * place * np.linspace(1 - 1e-3, 1 + 1e-3, 9)
    everywhere = turn * np.geomspace(0.3, 200, 40)
    peak = max(sensitivity(omega) for omega in [*near, *everywhere])
    assert peak <= 2 * (1 + 1e-3)
    assert peak == pytest.approx(2, rel=1e-3)
    assert stated == pytest.approx(2, rel=1e-4)
    assert 20 * np.log10(limit / gain) >= 6


def test_too_many_modes_are_refused_with_their_number():
    slack = scene(HYSTERETIC, "model.accuracy=1e-3", "gondola.mass=0.05 kg", "winch.controller.gain=3",
                  "cable.unstretched_length=186 m")  # fmt: skip
    with pytest.raises(NoSolutionError, match=r"could drive about \d+ modes of the cable.*cable\.damping\.viscous"):
        OneLoop(slack).check_stable()


def test_a_damped_gondola_on_an_undamped_cable_is_not_called_undamped():
    loop = OneLoop(scene(HYSTERETIC))
    loop.with_gain(0.0).check_stable()
    loop.with_gain(0.1).check_stable()


def dense_loop(cable, loop, gain):
    """Poles of gondola, all modes of a cable with damped strain, notch and winch, assembled here."""
    n, strain, viscous = len(cable.omega), cable.strain, cable.viscous
    winch, sign = (0, -1.0) if loop.location == "ground" else (3, 1.0)
    mass, stiff = np.eye(n + 1), np.diag(np.append(cable.omega**2, cable.stiffness[3, 3]))
    mass[n, :n] = mass[:n, n] = cable.coupling[:, 3]
    mass[n, n] = cable.inertia[3, 3]
    damped = np.block([[strain.modes, strain.coupling[:, [3]]], [strain.coupling[:, [3]].T, strain.ends[3:4, 3:4]]])
    by = [np.append(np.zeros(n), cable.stiffness[3, winch]),
          np.append(strain.coupling[:, winch], strain.ends[3, winch]),
          np.append(cable.coupling[:, winch], cable.inertia[3, winch])]  # fmt: skip
    lossy = viscous * mass
    if strain.law == "hysteretic":
        stiff = stiff + 1j * strain.amount * damped
        by = [by[0] + 1j * strain.amount * by[1], viscous * by[2], by[2]]
    else:
        lossy, by = lossy + strain.amount * damped, [by[0], strain.amount * by[1] + viscous * by[2], by[2]]
    mass[n, n] += loop.mass
    lossy[n, n] += loop.damping
    z, speed, (first, slope, y) = np.split(np.eye(2 * n + 5), [n + 1, 2 * n + 2])
    filtered, passed, rate = [-first, -slope], z[n], speed[n]
    if loop.notch is not None:
        w1, z1, w2, z2 = (getattr(loop.notch, name) for name in
                          ("omega", "damping_ratio", "rolloff_omega", "rolloff_damping_ratio"))  # fmt: skip
        bend = z[n] - 2 * z2 * w2 * slope - w2**2 * first
        jerk = speed[n] - 2 * z2 * w2 * bend - w2**2 * slope
        filtered = [slope, bend]
        passed, rate = ((w2 / w1) ** 2 * (a + 2 * z1 * w1 * b + w1**2 * c)
                        for a, b, c in ((bend, slope, first), (jerk, bend, slope)))  # fmt: skip
    pulled = sum(np.outer(b, u) for b, u in zip(by, (y, passed, rate), strict=True))
    force = stiff @ z + lossy @ speed + sign * gain * pulled
    return np.linalg.eigvals(np.concatenate([speed, -np.linalg.solve(mass, force), [*filtered, passed]]))


@pytest.mark.parametrize("diameter", campaign(DIAMETERS, DIAMETERS[1::7]))
@pytest.mark.parametrize("damping", ["{model: hysteretic, loss_factor: 0.02}", "{model: kelvin_voigt, time: 1 ms}"])
def test_the_largest_gain_is_the_smallest_at_which_any_pole_crosses(diameter, damping):
    """Of a thick cable the pole that grows fastest crosses at twice the gain at which another one does."""
    sets = "model.accuracy=1e-4", f"cable.diameter={diameter} mm", f"cable.damping={damping}"
    loop = OneLoop(scene(*sets))
    try:
        limit = loop.largest_gain
    except NoSolutionError as error:
        limit = float(re.search(r"no largest gain: at (\S+) rad/s", str(error))[1])
        with pytest.raises(NoSolutionError, match="good as undamped"):
            loop.with_gain(limit).check_stable()
        return
    cable, crossing = along_x(loop.case.refined(2, 32)), 1j * loop.closed_loop.stability.limit.omega
    for factor in (0.3, 0.6, 0.9, 0.995, 1.005):
        poles = dense_loop(cable, loop, factor * limit)
        poles = poles[poles.imag > 0]
        stable = (poles.real / np.abs(poles)).max() < CONTROL.negligible_growth
        nearest = poles[np.argmin(np.abs(poles - crossing))]
        assert stable if factor < 1 else nearest.real > 0, factor
        assert loop.with_gain(factor * limit).stable == (factor < 1)


@pytest.mark.parametrize("damping", ["{model: modal}", "{model: kelvin_voigt, time: 1 ms, viscous: 1.0e-4}"])
def test_the_poles_of_the_model_alone_decide_only_well_below_the_largest_gain(damping):
    """The largest gain is sought with all modes; half of it is where the model's poles no longer suffice."""
    loop = OneLoop(scene(f"cable.damping={damping}", "cable.diameter=4.5 mm"))
    largest = loop.closed_loop.stability.largest_gain
    shares = [share for share in (1e-3, 0.3, 0.49, 0.51, 0.9, 1.5)
              if loop.with_gain(share * largest).closed_loop.stability._far_from_unstable]  # fmt: skip
    assert 1e-3 in shares
    assert max(shares) < MOTION.nearly_largest_gain


@pytest.mark.parametrize("gain", [0.325, 20.0])
def test_modes_that_the_model_lacks_are_judged_without_the_largest_gain(gain, monkeypatch):
    """Waves along the lower cables could be driven; the largest gain is some 25 rad/s."""
    one = load_scene(CONFIGS / "suspensions" / "carlina-balloon-wind.yaml", [f"control.gain={gain} rad/s"])[1]
    loop = SuspensionCase(one).analysis.loop_for_margins.stability
    assert loop.stable
    far = loop._far_from_unstable
    assert not loop._poles_decay_up_to(2 * gain)
    assert (LoopStability.driven.known(loop) is None) == far
    assert far == (loop.largest_gain > 2 * gain)
    known = SuspensionCase(one).analysis.loop_for_margins.stability
    assert known.largest_gain == pytest.approx(loop.largest_gain, rel=1e-9)
    monkeypatch.setattr(LoopStability, "_far_from_unstable", None)  # not looked at where the largest gain is known
    assert known.stable


def random_system(seed):
    """A `LinearSystem` of five coordinates, two of them not damped."""
    rng = np.random.default_rng(seed)
    spring, dashpot, losses = (rng.normal(size=(5, columns)) for columns in (6, 3, 2))
    matrices = np.diag(rng.uniform(0.5, 2, 5)), dashpot @ dashpot.T, spring @ spring.T + 1j * (losses @ losses.T)
    return LinearSystem(*matrices)


@pytest.mark.parametrize("seed", range(20))
def test_what_only_loses_energy_has_no_growing_pole(seed):
    """Poles of s^2 M + s C + K, Im s > 0, from a companion matrix; with a dashpot that pushes one of them grows."""
    system = random_system(seed)
    assert system.dissipates
    assert dense_poles(system).real.max() < 1e-12
    real = replace(system, stiffness=system.stiffness.real)
    assert real.dissipates
    assert dense_poles(real).real.max() < 1e-12
    pushed = replace(real, damping=-real.damping)
    assert not pushed.dissipates
    assert dense_poles(pushed).real.max() > 0
    assert not replace(real, stiffness=real.stiffness - 100 * np.eye(5)).dissipates
    assert not replace(system, stiffness=system.stiffness.conj()).dissipates
    assert not replace(real, damping=real.damping + np.diag([1.0] * 4, 1)).dissipates
    feedback = ActuatorFeedback(np.ones(5), np.ones(5), 1.0, 0.0, 0.0)
    assert not replace(real, feedback=(feedback,)).dissipates


def dense_poles(system):
    """Poles in the upper half plane and on the real axis."""
    poles = dense.poles(system.mass, system.damping, system.stiffness)
    return poles[poles.imag >= 0]


@pytest.mark.parametrize(("elements", "order"), campaign([(2, 6), (4, 4), (10, 1)], [(2, 6), (10, 1)]))
def test_fixed_elements_are_judged_by_their_own_modes(elements, order):
    """The mode of the cable that decides, at 131 Hz, is above theirs."""
    exact = short(1.0, viscous=2e-7)
    fixed = exact.model_copy(
        update={"model": exact.model.model_copy(update={"elements": elements, "order": order, "accuracy": None})}
    )
    loop, row = OneLoop(fixed), evaluate(fixed, [find("largest_gain")])
    limit, cable = row.cells["largest_gain_rad_per_s"], along_x(loop.case)
    assert limit > 2 * OneLoop(exact).largest_gain
    for part, right in ((0.999, False), (1.001, True)):
        assert (dense_loop(cable, loop, part * limit).real.max() > 0) == right
    assert any("judged by the modes of these elements" in line for line in row.notes)


def test_a_notch_without_damping_has_the_largest_gain_that_little_damping_has():
    """L is zero at the frequency of the notch, which is no crossing."""
    notch = "winch.controller.notch={{frequency: static, damping_ratio: {}}}".format
    limits = [cells(scene(notch(ratio)), "largest_gain")["largest_gain"] for ratio in (0, 1e-9)]
    assert limits[0] == pytest.approx(limits[1], rel=1e-6)


def rod_limit(eta, mass, stiffness, density, length, omega):
    """Largest gain of an integrator that moves end 2 of a straight damped rod with a body, near a frequency [rad/s]."""

    def loop_gain(w):
        s, modulus = 1j * w, stiffness * (1 + 1j * eta)
        end = np.sqrt(modulus * density) * s / np.tanh(s * length * np.sqrt(density / modulus))
        return end / (mass * s**2 + end) / s

    crossing = brentq(lambda w: loop_gain(w).imag, 0.98 * omega, 1.02 * omega, xtol=1e-12 * omega)
    return -1 / loop_gain(crossing).real


@pytest.mark.parametrize("accuracy", [1e-3, 1e-4, 1e-6])
def test_the_stated_error_of_the_largest_gain_of_a_straight_rod_is_true(accuracy):
    """Its modes that matter, along it, lie among hundreds across it, which the winch does not drive."""
    data = {
        "gravity": 0.0,
        "cable": {"chord": 230.78, "diameter": 0.012276, "elastic_modulus": 7.9368e10, "density": 4564.86,
                  "unstretched_length": 230.37, "damping": {"loss_factor": 0.02}},
        "gondola": {"mass": 188.49}, "model": {"accuracy": accuracy},
        "winch": {"location": "gondola", "controller": {"gain": 0.1, "notch": "none"}},
    }  # fmt: skip
    row = solve(data, "largest_gain", "phase_crossover")
    area = np.pi / 4 * 0.012276**2
    omega = 2 * np.pi * row.values["phase_crossover"]
    right = rod_limit(0.02, 188.49, area * 7.9368e10, area * 4564.86, 230.37, omega)
    assert row.errors["largest_gain"] <= accuracy
    assert row.values["largest_gain"] == pytest.approx(right, rel=row.errors["largest_gain"])


def test_a_largest_gain_far_above_all_waves_that_are_resolved_is_refused():
    """A straight cable whose strain is damped: the crossing at 5.8 kHz is that of a mesh, which other units change."""
    scene = {
        "gravity": 0.0,
        "cable": {"chord": 136.62, "diameter": 7.3245e-3, "elastic_modulus": 40.74e9, "density": 2671.0,
                  "preload": 8553.7, "damping": {"loss_factor": 0.2}},
        "gondola": {"mass": 247.9}, "winch": {"location": "gondola", "controller": {"gain": 0.014345}},
        "model": {"accuracy": 1e-4},
    }  # fmt: skip
    row = solve(scene, "largest_gain", "gain_margin", "phase_crossover", "phase_margin")
    assert "the largest gain is not known" in row.status
    *unknown, phase_margin = row.values.values()
    assert unknown == [None] * 3
    assert phase_margin > 89
