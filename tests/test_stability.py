"""One verdict on a loop: dense eigenvalues on two meshes, whatever columns and accuracy are asked for."""

import re
from dataclasses import replace

import numpy as np
import pytest
from references.continuous_cable import dynamic_end_stiffness
from scenes import cells, scene
from scipy.optimize import brentq

from cablestudy.control.stability import NEGLIGIBLE, UNDAMPED, driven_up_to
from cablestudy.control.winch import Loop
from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.scene.scene import Scene
from cablestudy.study.case import Case
from cablestudy.study.columns import find
from cablestudy.study.loops import _waves
from cablestudy.study.row import evaluate
from cablestudy.study.status import SLACK

HYSTERETIC = "cable.damping={loss_factor: 0.02}"
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
    return Scene.model_validate(data)


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
    return Scene.model_validate({
        "cable": cable, "gondola": {"mass": mass, "area": 0.2, "drag_coefficient": 1.5},
        "winch": {"location": where, "controller": {"gain": 1.0, "notch": notch}}, "model": {"accuracy": 1e-4},
    })  # fmt: skip


def dense_growth(case, gain, order):
    """Largest growth over frequency among the resolved poles of the closed loop with every mode of one element."""
    finer = case.refined(2, order)
    modes = finer.excited.modes(finer.excited.dof)
    resolved = 2 * np.pi * modes.frequency[np.maximum.accumulate(modes.errors) < 1e-6].max(initial=0.0)
    fixed, scaled = case.plant.closed_of(finer.end_model_along_x)
    poles = np.linalg.eigvals(fixed + gain * scaled)
    poles = poles[(poles.imag > 0) & (np.abs(poles) < resolved)]
    return (poles.real / np.abs(poles)).max(initial=-1.0)


@pytest.mark.parametrize("seed", [1, 2, 3, 6, 9, 11, 13, 14])
def test_no_loop_is_called_stable_that_dense_matrices_on_two_meshes_call_unstable(seed):
    case = Case(random_scene(seed)).refined(1, 16)
    plant = case.plant
    try:
        plant.check_damped()
        limit = plant.largest_gain
    except NoSolutionError as error:
        limit = re.search(r" at (\S+) rad/s", str(error))
        limit = float(limit[1]) if limit else None
    begin = limit or plant.main
    for gain in begin * np.array([0.1, 0.3, 0.98, 1.02, 3.0, 10.0]):
        try:
            Loop.of(plant, float(gain)).check_stable()
            refused = ""
        except CablestudyError as error:
            refused = str(error)
        growth = [dense_growth(case, gain, order) for order in (30, 38)]
        if min(growth) > 1.2 * NEGLIGIBLE:
            assert refused, (gain / begin, growth)
        if max(growth) < 0:
            assert "unstable" not in refused, (gain / begin, growth, refused)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-7])
def test_the_verdict_does_not_depend_on_columns_or_accuracy(accuracy):
    for names in (("gondola_rms",), ("gondola_rms", "error_estimate"), ("gondola_rms_velocity", "phase_margin")):
        columns = [find(name) for name in names]
        assert evaluate(short(0.3, accuracy), columns).cells["status"] == SLACK  # stable, but in a strong wind
        for gain in (0.6, 11):
            status = evaluate(short(gain, accuracy), columns).cells["status"]
            assert status.startswith(f"unstable loop at a gain of {gain} rad/s: a motion of 130.9 Hz grows")
            assert "cable.damping.viscous" in status


def test_a_gain_of_eleven_has_a_growing_pole_on_two_meshes():
    case = Case(short(11)).refined(1, 16)
    growth = [dense_growth(case, 11.0, order) for order in (38, 46)]
    assert growth == pytest.approx([growth[0]] * 2, rel=1e-3)
    assert growth[0] > 10 * NEGLIGIBLE
    # and at 0.3 it would take a billion oscillations to see it
    assert dense_growth(case, 0.3, 46) < NEGLIGIBLE


@pytest.mark.parametrize("viscous", [2e-7, 2e-5])
def test_with_viscous_damping_the_limit_is_that_of_dense_matrices(viscous):
    case = Case(short(1.0, viscous=viscous)).refined(1, 16)
    limit = case.plant.largest_gain
    for order in (38, 46):
        assert dense_growth(case, limit * (1 - 1e-3), order) < 0 < dense_growth(case, limit * (1 + 1e-3), order)


def test_the_largest_gain_has_the_error_that_it_states():
    columns = [find("largest_gain"), find("error_estimate")]
    exact = evaluate(short(1.0, 1e-8, viscous=2e-5), columns).cells["largest_gain_rad_per_s"]
    for accuracy in (1e-3, 1e-5, 1e-7):
        cells = evaluate(short(1.0, accuracy, viscous=2e-5), columns).cells
        assert cells["status"] == "ok"
        assert cells["error_estimate"] <= accuracy
        assert cells["largest_gain_rad_per_s"] == pytest.approx(exact, rel=3 * accuracy)


def test_a_gain_from_a_margin_is_refused_where_undamped_modes_decide_and_has_the_margin_otherwise():
    auto = {"auto": {"gain_margin": 6, "sensitivity": 1e6}}
    column = [find("gain_margin"), find("gondola_rms")]
    assert "cable.damping.viscous" in evaluate(short(auto), column).cells["status"]
    cells = evaluate(short(auto, viscous=2e-6), column).cells
    assert cells["gain_margin_dB"] == pytest.approx(6, abs=1e-9)
    assert cells["gondola_rms_mm"] > 0


@pytest.mark.parametrize("viscous", [2e-6, 2e-5])
def test_an_automatic_gain_bounds_the_sensitivity_of_the_continuous_cable(viscous):
    """L from the dynamic stiffness of the continuous cable; a mode near 90 Hz decides, far above those of the RMS."""
    scene = short({"auto": 6.0}, viscous=viscous)
    names = "gain", "largest_gain", "sensitivity_peak", "sensitivity_frequency"
    gain, limit, stated, place = (evaluate(scene, [find(name)]).cells[find(name).header] for name in names)
    w1, w2, turn = Case(scene).refined(1, 16).plant.notch.omega, 90.9 * 2 * np.pi, 2 * np.pi
    span, mass = (1.009 * np.cos(0.392), 1.009 * np.sin(0.392)), 825 * 1.54e-6

    def sensitivity(omega):
        lossy = omega * np.sqrt(1 - 1j * viscous / (mass * omega))  # m s^2 + c s
        stiffness = dynamic_end_stiffness(*span, 1.009, 2.36e9 * 1.54e-6, mass, 9.81, lossy, n=80, eta=omega * 3.81e-4)[
            0, 0
        ]
        passed = (w1**2 - omega**2 + 2j * 0.158 * w1 * omega) / w1**2
        passed *= w2**2 / (w2**2 - omega**2 + 2j * 0.766 * w2 * omega)
        return 1 / abs(1 + gain / (1j * omega) * passed * stiffness / (stiffness - 4.96 * omega**2))

    near = turn * place * np.linspace(1 - 1e-3, 1 + 1e-3, 9)
    everywhere = turn * np.geomspace(0.3, 200, 40)
    peak = max(sensitivity(omega) for omega in [*near, *everywhere])
    assert peak <= 2 * (1 + 1e-3)
    assert peak == pytest.approx(2, rel=1e-3)
    assert stated == pytest.approx(2, rel=1e-4)
    assert 20 * np.log10(limit / gain) >= 6


def test_the_bound_on_what_can_be_driven_holds_for_every_mode_above_it():
    """Of a taut inclined cable: the first-order drive of each mode beyond the bound is below what is allowed."""
    case = Case(short(11)).refined(4, 40)
    plant, gain = case.plant, 11.0
    bound = driven_up_to(plant, _waves(case), gain)
    cable, modes = plant.cable, case.excited.modes(case.excited.dof)
    known = (cable.omega > bound) & (2 * np.pi * modes.frequency < 4 * bound) & (modes.errors < 1e-6)
    assert known.sum() >= 3
    force = np.abs(cable.participation[known, 3])
    drive = gain * np.abs(plant.controller(1j * cable.omega[known])) * force**2
    drive /= 2 * plant.mass * cable.omega[known] ** 3
    assert (drive < cable.decay[known] + NEGLIGIBLE * cable.omega[known]).all()


def test_too_many_modes_are_refused_with_their_number():
    slack = scene(HYSTERETIC, "model.accuracy=1e-3", "gondola.mass=0.05 kg", "winch.controller.gain=3",
                  "cable.unstretched_length=186 m")  # fmt: skip
    with pytest.raises(NoSolutionError, match=r"could drive about \d+ modes of the cable.*cable\.damping\.viscous"):
        Loop.of(Case(slack).refined(1, 30).plant, 3.0).check_stable()


def test_a_damped_gondola_on_an_undamped_cable_is_not_called_undamped():
    loop = Case(scene(HYSTERETIC)).loop
    assert -loop.gondola_pole.real > UNDAMPED * abs(loop.gondola_pole)
    loop.at_rest.check_stable()
    replace(loop, gain=0.1).check_stable()


def test_the_largest_gain_followed_from_another_level_is_that_of_a_search():
    accuracy = 1e-4
    scene = short(1.0, accuracy, viscous=2e-5)
    case = Case(scene)
    coarse = case.refined(1, 12).plant
    assert coarse.largest_gain
    finer = case.refined(1, 16).plant
    assert finer.known is coarse.known
    searched = Case(scene).refined(1, 16).plant
    assert not searched.known
    assert finer.largest_gain == pytest.approx(searched.largest_gain, rel=0.1 * accuracy)


def dense_loop(cable, plant, gain):
    """Poles of gondola, all modes of a cable with damped strain, notch and winch on the ground, assembled here."""
    n, strain = len(cable.omega), cable.strain
    mass, stiff, damped = (
        np.eye(n + 1),
        np.diag(np.append(cable.omega**2, cable.stiffness[3, 3])),
        np.zeros((n + 1,) * 2),
    )
    mass[n, :n] = mass[:n, n] = cable.coupling[:, 3]
    mass[n, n] = plant.mass + cable.inertia[3, 3]
    damped[:n, :n], damped[n, :n], damped[:n, n] = strain.modes, strain.coupling[:, 3], strain.coupling[:, 3]
    damped[n, n] = strain.ends[3, 3]
    reeled = [np.append(np.zeros(n), cable.stiffness[3, 0]), np.append(strain.coupling[:, 0], strain.ends[3, 0]),
              np.append(cable.coupling[:, 0], cable.inertia[3, 0])]  # fmt: skip
    if strain.law == "hysteretic":
        stiff, lossy = stiff + 1j * strain.amount * damped, 0 * damped
        by = [reeled[0] + 1j * strain.amount * reeled[1], 0 * reeled[1], reeled[2]]
    else:
        lossy, by = strain.amount * damped, [reeled[0], strain.amount * reeled[1], reeled[2]]
    w1, z1, w2, z2 = (getattr(plant.notch, name) for name in
                      ("omega", "damping_ratio", "rolloff_omega", "rolloff_damping_ratio"))  # fmt: skip
    z, speed, (first, slope, y) = np.split(np.eye(2 * n + 5), [n + 1, 2 * n + 2])
    bend = z[n] - 2 * z2 * w2 * slope - w2**2 * first
    jerk = speed[n] - 2 * z2 * w2 * bend - w2**2 * slope
    passed, rate = ((w2 / w1) ** 2 * (a + 2 * z1 * w1 * b + w1**2 * c)
                    for a, b, c in ((bend, slope, first), (jerk, bend, slope)))  # fmt: skip
    force = stiff @ z + lossy @ speed - gain * sum(np.outer(b, u) for b, u in zip(by, (y, passed, rate), strict=True))
    return np.linalg.eigvals(np.concatenate([speed, -np.linalg.solve(mass, force), [slope, bend, passed]]))


@pytest.mark.parametrize("diameter", np.linspace(1.5, 6.0, 23).tolist())
@pytest.mark.parametrize("damping", ["{model: hysteretic, loss_factor: 0.02}", "{model: kelvin_voigt, time: 1 ms}"])
def test_the_largest_gain_is_the_smallest_at_which_any_pole_crosses(diameter, damping):
    """Of a thick cable the pole that grows fastest crosses at twice the gain at which another one does."""
    sets = "model.accuracy=1e-4", f"cable.diameter={diameter} mm", f"cable.damping={damping}"
    case = Case(scene(*sets)).refined(1, 20)
    try:
        limit = case.plant.largest_gain
    except NoSolutionError as error:
        limit = float(re.search(r"no largest gain: at (\S+) rad/s", str(error))[1])
        with pytest.raises(NoSolutionError, match="good as undamped"):
            Loop.of(case.plant, limit).check_stable()
        return
    cable, crossing = case.refined(2, 32).end_model_along_x, 2j * np.pi * case.plant.limit_frequency
    for factor in (0.3, 0.6, 0.9, 0.995, 1.005):
        poles = dense_loop(cable, case.plant, factor * limit)
        poles = poles[poles.imag > 0]
        stable = (poles.real / np.abs(poles)).max() < NEGLIGIBLE
        nearest = poles[np.argmin(np.abs(poles - crossing))]
        assert stable if factor < 1 else nearest.real > 0, factor
        assert case.plant.stable(factor * limit) == (factor < 1)


@pytest.mark.parametrize(("elements", "order"), [(2, 6), (4, 4), (10, 1)])
def test_fixed_elements_are_judged_by_the_cable_beyond_their_modes(elements, order):
    """The mode that decides, at 131 Hz, is above those of the elements, which alone bear 50 times the gain."""
    exact = short(1.0, viscous=2e-7)
    fixed = exact.model_copy(
        update={"model": exact.model.model_copy(update={"elements": elements, "order": order, "accuracy": None})}
    )
    limit = evaluate(fixed, [find("largest_gain")]).cells["largest_gain_rad_per_s"]
    case = Case(exact).refined(1, 16)
    for number in (38, 46):
        assert dense_growth(case, 0.99 * limit, number) < 0 < dense_growth(case, 1.01 * limit, number)
    column = [find("gondola_rms")]
    for gain, status in ((0.9 * limit, SLACK), (1.1 * limit, "unstable loop")):
        winch = fixed.winch.model_copy(
            update={"controller": fixed.winch.controller.model_copy(update={"gain": float(gain)})}
        )
        row = evaluate(fixed.model_copy(update={"winch": winch}), column)
        assert row.cells["status"].startswith(status)
        assert any("every mode of the cable that the gain could drive" in line for line in row.notes)


def test_of_modal_damping_fixed_elements_say_that_the_verdict_is_theirs():
    row = evaluate(scene(), [find("largest_gain")])
    assert "loop: judged by the modes of these elements, and not by those of the cable above" in row.notes


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
    row = evaluate(Scene.model_validate(data), [find("largest_gain"), find("phase_crossover"), find("axial_stiffness")])
    area = np.pi / 4 * 0.012276**2
    omega = 2 * np.pi * row.cells["phase_crossover_Hz"]
    right = rod_limit(0.02, 188.49, area * 7.9368e10, area * 4564.86, 230.37, omega)
    stated = row.errors["largest_gain_rad_per_s"]
    assert stated <= accuracy
    assert row.cells["largest_gain_rad_per_s"] == pytest.approx(right, rel=stated)
