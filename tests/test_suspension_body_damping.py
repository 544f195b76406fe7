"""Damping ratios of the mode of a body or free point along an axis, against dense bars, a continuous cable, statements.

The bars are the tests' own: the mode is that with the largest share phi^2/w^2 of the static compliance, and its pole
the eigenvalue of [0, 1; -K/M, -C/M] whose motion is most like it.
"""

from functools import cache

import numpy as np
import pytest
import scipy.linalg
from references.bars_in_wind import BarsInWind
from references.dense import state_matrix
from solved import solve
from suspension_cases import case_of

from cablestudy.system.tolerances import SYSTEM

BARS = 7
AXES = ("x", "y", "z", "rx", "ry", "rz")
LAWS = {
    "kelvin_voigt": {"model": "kelvin_voigt", "time": 2e-3, "viscous": 0.01},
    "hysteretic": {"model": "hysteretic", "loss_factor": 0.1},
    "viscous": {"model": "modal", "ratio": 0.0, "viscous": 0.2},
    "modal": {"model": "modal", "ratio": 0.02},
}
SPEED, COEFFICIENT, AREAS, CENTER = 14.0, 1.3, [0.5, 0.8, 0.3], [0.1, 0.0, -0.2]
WIND = {
    "speed": SPEED,
    "direction": 0.4,
    "turbulence_intensity": 0.1,
    "length_scale": 30.0,
    "cable_drag_coefficient": 1.2,
}


def scene(law, model, **wind):
    """A body of six degrees of freedom below a free point, on four sagging cables."""
    cable = {"diameter": 0.01, "elastic_modulus": 1e9, "density": 4000.0, "damping": LAWS[law]}
    body = {"at": [0.0, 0.0, 0.0], "mass": 40.0, "center_of_mass": [0.0, 0.05, -0.1], "inertia": [3.0, 4.0, 5.0],
            "attachments": {"a": [0.4, 0.1, 0.0], "b": [-0.3, 0.3, 0.1], "c": [0.0, -0.4, 0.2]}}  # fmt: skip
    found = {
        "cable": cable,
        "points": {"p": [12.0, 1.0, 8.0], "q": [-9.0, 6.0, 9.0], "r": [-1.0, -10.0, 7.0],
                   "knot": {"at": [0.5, -3.0, 4.0], "free": True, "mass": 5.0}},
        "bodies": {"gondola": body},
        "cables": {
            "n1": {"from": "p", "to": "gondola.a", "unstretched_length": 13.9},
            "n2": {"from": "q", "to": "gondola.b", "unstretched_length": 13.6},
            "n3": {"from": "r", "to": "knot", "unstretched_length": 7.6},
            "n4": {"from": "knot", "to": "gondola.c", "unstretched_length": 4.4},
        },
        "model": model,
    }  # fmt: skip
    if wind:
        body["wind"] = {"area": AREAS, "drag_coefficient": COEFFICIENT, "center_of_pressure": CENTER}
        found["wind"] = WIND | wind
    return found


def blown(on):
    """Drag coefficient times diameter of the cables, and what the bodies offer, of wind on these."""
    of_bodies = {"gondola": (np.array(AREAS) * COEFFICIENT, AREAS, CENTER)} if on != "cables" else {}
    return [0.01 * WIND["cable_drag_coefficient"] if on != "bodies" else 0.0] * 4, of_bodies


@cache
def dense(law, on=None):
    """M, C, K, complex, of all free displacements of the bars, of which the last nine are of gondola and knot."""
    bars = bars_of(case_of(scene(law, {"elements": BARS})).equilibrium, law, on)
    return bars.M, bars.C, bars.K


def bars_of(state, law, on, speed=SPEED, **options):
    """The `BarsInWind` of an equilibrium."""
    wind = {"speed": speed, "direction": WIND["direction"], "turbulence": (1.4,) * 3, "length_scale": 30.0,
            "coherence_decay": 10.0, "density": 1.2}  # fmt: skip
    offered = blown(on) if on else (None, None)
    return BarsInWind(state, BARS, wind, *offered, damping=LAWS[law], **options)


def truth(matrices, place, dead=None):
    """Frequency [Hz] and share of the mode of a displacement, by the stiffness `dead`; damping ratio of its pole."""
    mass, damping, stiffness = matrices
    dead = stiffness.real if dead is None else dead
    square, shapes = scipy.linalg.eigh(dead, mass)
    share = shapes[place] ** 2 / square
    mode = int(np.argmax(share))
    poles, vectors = np.linalg.eig(state_matrix(mass, damping, stiffness))
    upper = poles.imag > -1e-9 * np.abs(poles)  # real ones too
    poles, vectors = poles[upper], vectors[: len(mass), upper]
    parts = np.abs(shapes.T @ mass @ vectors) * np.sqrt(square)[:, None]
    own = int(np.argmax(parts[mode] / np.linalg.norm(parts, axis=0)))
    ratio = -poles[own].real / abs(poles[own])
    return np.sqrt(square[mode]) / (2 * np.pi), share[mode] / np.linalg.inv(dead)[place, place], ratio


def motions():
    """Name of each motion -> its place among all displacements."""
    found = {f"gondola.{{}}_{axis}": number - 9 for number, axis in enumerate(AXES)}
    return found | {f"knot.{{}}_{axis}": number - 3 for number, axis in enumerate(AXES[:3])}


def check(matrices, text, within=1e-7, dead=None):
    quantities, expected = ("frequency", "share", "damping_ratio"), {}
    for name, place in motions().items():
        expected |= dict(zip(map(name.format, quantities), truth(matrices, place, dead), strict=True))
    found = solve(text, *expected).values
    for name, number in expected.items():
        assert found[name] == pytest.approx(number, rel=within), name


@pytest.mark.parametrize("law", LAWS)
def test_body_and_free_point_on_bars(law):
    check(dense(law), scene(law, {"elements": BARS}))


@pytest.mark.parametrize(("law", "on", "within"), [("modal", "bodies", 1e-7), ("kelvin_voigt", "both", 1e-5),
                                                   ("hysteretic", "cables", 1e-5)])  # fmt: skip
def test_in_the_air_about_the_equilibrium_without_the_mean_wind(law, on, within):
    """The bars' drag is on the stretched length of each; the program's on that of the cable's mean strain, 2e-3."""
    text = scene(law, {"elements": BARS}, on=on)
    check(dense(law, on), text, within)
    still = solve(text | {"wind": text["wind"] | {"aerodynamic_damping": False}}, "gondola.damping_ratio_x").values
    assert still == solve(scene(law, {"elements": BARS}), "gondola.damping_ratio_x").values


def drag_of(bars):
    """Damping by the drag on `BarsInWind`."""
    return np.einsum("kin,kij,kjm->nm", bars.moves, bars.drags, bars.moves)


@pytest.mark.parametrize(("law", "gusts", "on", "elsewhere"), [
    ("modal", "bodies", "bodies", None), ("kelvin_voigt", "both", "both", None),
    ("hysteretic", "cables", "cables", None), ("kelvin_voigt", "bodies", "both", None),
    ("kelvin_voigt", "both", "bodies", "cables"), ("hysteretic", "bodies", "cables", "bodies"),
])  # fmt: skip
def test_the_steady_wind_of_a_load_case_damps_what_it_acts_on_and_turns_with_it(law, gusts, on, elsewhere):
    """With its own speed, whatever the gusts act on; `wind` damps what it does not act on. Dead moments do not turn."""
    text = scene(law, {"elements": BARS}, on=gusts)
    day = {"speed": 1.5 * SPEED, "direction": WIND["direction"]}
    if on != "both":
        day["on"] = ["gondola"] if on == "bodies" else list(text["cables"])
    day = {"wind": day, "forces": {"gondola": {"moment": [0.0, 30.0, 20.0]}}}
    text |= {"cases": {"storm": day}, "case": "storm"}
    rest = case_of(text).rest
    bars = bars_of(rest, law, on, 1.5 * SPEED, mean=True)
    check((bars.M, bars.C + drag_of(bars_of(rest, law, elsewhere)), bars.K), text, 1e-5, bars.dead)


def test_a_steady_wind_damps_by_its_density_and_its_speed_at_each_height():
    """A bob halfway up a taut vertical cable: c = rho C_d A V + rho C_d d times the integral of V (s/L)^2."""
    length, width = 10.0, 0.02
    cable = {"axial_stiffness": 1e8, "mass_per_length": 1e-4, "diameter": width, "preload": 2e6}
    day = {"pressure": 200.0, "gust_factor": 1.4, "at": 4.0, "exponent": 0.2, "direction": np.pi / 2}
    text = {
        "gravity": 0.0,
        "cable": cable | {"damping": {"loss_factor": 1e-9}},
        "bodies": {"bob": {"at": [0.0, 0.0, length], "mass": 50.0, "free": ["y"],
                           "wind": {"area": 0.5, "drag_coefficient": COEFFICIENT},
                           "attachments": {"eye": [0.0, 0.0, 0.0]}}},
        "cables": {"low": {"from": [0.0, 0.0, 0.0], "to": "bob.eye"},
                   "high": {"from": [0.0, 0.0, 2 * length], "to": "bob.eye"}},
        "wind": WIND | {"air_density": 0.9, "on": "bodies"},
        "cases": {"day": {"wind": day}},
        "case": "day",
    }  # fmt: skip

    def speed(height):
        return 1.4 * np.sqrt(2 * 200.0 / 0.9) * (height / 4.0) ** 0.2

    share = (np.arange(1000) + 0.5) / 1000
    integrals = [(speed(height) * share**2).mean() * length for height in (length * share, length * (2 - share))]
    damping = 0.9 * (COEFFICIENT * 0.5 * speed(length) + 1.2 * width * sum(integrals))
    found = solve(text, "bob.frequency_y", "bob.damping_ratio_y").values
    moved = 50.0 + 2 / 3 * 1e-4 * length
    ratio = damping / (2 * moved * 2 * np.pi * found["bob.frequency_y"])
    assert found["bob.damping_ratio_y"] == pytest.approx(ratio, rel=1e-5)


def test_a_steady_wind_of_no_speed_turns_nothing():
    names = "gondola.damping_ratio_x", "gondola.rms"
    text = scene("viscous", {"elements": BARS}, on="both", mean=False)
    calm = text | {"cases": {"calm": {"wind": {"speed": 0.0}}}, "case": "calm"}
    found, expected = solve(calm, *names).values, solve(text, *names).values
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.crossed
@pytest.mark.parametrize("law", ["kelvin_voigt", "hysteretic", "viscous"])
@pytest.mark.parametrize("wind", [{}, {"on": "both"}])
def test_to_an_accuracy_no_number_is_more_wrong_than_stated(law, wind):
    """Against elements of high order, whose numbers the tests above and those of frequencies hold against bars."""
    names = [name.format(quantity) for name in motions() for quantity in ("share", "damping_ratio")]
    fine = solve(scene(law, {"elements": 4, "order": 10}, **wind), *names).values
    for accuracy in (1e-3, 1e-5, 1e-7):
        found = solve(scene(law, {"accuracy": accuracy}, **wind), *names)
        for name in names:
            assert 0 < found.errors[name] < accuracy
            assert found.values[name] == pytest.approx(fine[name], rel=found.errors[name] + 1e-9), name


STRONG = (
    {"model": "kelvin_voigt", "time": 4e-3},
    {"model": "hysteretic", "loss_factor": 0.3},
    {"model": "modal", "ratio": 0.0, "viscous": 0.5},
)


@pytest.mark.parametrize("damping", STRONG)
def test_a_mass_on_a_straight_continuous_cable(damping):
    """s^2 M + EA' p coth(p L) = 0 with p = sqrt((s^2 m + s c)/EA'): Newton's iteration with a difference quotient."""
    mass, per_length, length, stiffness, strain = 3.0, 0.4, 20.0, 1e5, 1e-3
    text = {
        "gravity": 0.0,
        "bodies": {"bob": {"at": [length, 0.0, 0.0], "mass": mass, "free": ["x"], "force": [stiffness * strain, 0, 0],
                           "attachments": {"eye": [0.0, 0.0, 0.0]}}},
        "cables": {"c": {"from": [0.0, 0.0, 0.0], "to": "bob.eye", "unstretched_length": length, "damping": damping,
                         "axial_stiffness": stiffness, "mass_per_length": per_length}},
        "model": {"accuracy": 1e-6},
    }  # fmt: skip

    def force(s):
        factor = 1 + s * damping.get("time", 0.0) + 1j * damping.get("loss_factor", 0.0)
        wave = np.sqrt((s * s * per_length + s * damping.get("viscous", 0.0)) / (stiffness * factor))
        return s * s * mass + stiffness * factor * wave / np.tanh(wave * length)

    pole = 1j * np.sqrt(stiffness / length / (mass + per_length * length / 3))
    for _ in range(60):
        slope = (force(pole * (1 + 1e-6)) - force(pole * (1 - 1e-6))) / (2e-6 * pole)
        pole = pole - force(pole) / slope
    found = solve(text, "bob.damping_ratio_x")
    expected = -pole.real / abs(pole)
    assert found.errors["bob.damping_ratio_x"] < 1e-6
    assert found.values["bob.damping_ratio_x"] == pytest.approx(
        expected, rel=found.errors["bob.damping_ratio_x"] + 1e-11
    )


def test_a_mode_damped_above_critical_has_the_ratio_of_poles_that_do_not_oscillate(monkeypatch):
    """At 1000 N s/m^2 the pole most like it is real in the bars too."""
    monkeypatch.setitem(LAWS, "creeping", {"model": "modal", "ratio": 0.0, "viscous": 1000.0})
    name, place = "gondola.damping_ratio_y", motions()["gondola.{}_y"]
    assert truth(dense("creeping"), place)[2] == pytest.approx(1.0, rel=1e-9)
    assert solve(scene("creeping", {"accuracy": 1e-4}), name).values[name] == 1.0


def test_modal_damping_to_an_accuracy_is_refused_as_for_one_cable():
    found = solve(scene("modal", {"accuracy": 1e-4}), "gondola.damping_ratio_x", "gondola.frequency_x")
    assert found.values["gondola.damping_ratio_x"] is None
    assert found.values["gondola.frequency_x"] is not None
    assert found.status == (
        "modal damping grows with the number of modes: take hysteretic or kelvin_voigt, or fixed elements"
    )


def test_errors_of_fixed_elements_are_those_against_a_finer_model():
    name = "gondola.damping_ratio_x"
    found = solve(scene("kelvin_voigt", {"elements": 3}), name, estimate=True)
    fine = solve(scene("kelvin_voigt", {"accuracy": 1e-7}), name).values[name]
    assert found.errors[name] == pytest.approx(abs(found.values[name] / fine - 1), rel=1e-3)
    modal = solve(scene("modal", {"elements": 3}), name, estimate=True)
    assert modal.values[name] is not None
    assert modal.errors[name] is None


@pytest.mark.parametrize("law", ["hysteretic", "kelvin_voigt"])
def test_sparse_matrices_of_many_cables_have_the_same_numbers(law, monkeypatch):
    text, names = scene(law, {"accuracy": 1e-4}, on="both"), [name.format("damping_ratio") for name in motions()]
    expected = solve(text, *names).values
    monkeypatch.setattr(type(SYSTEM), "large_connection", 0)
    monkeypatch.setattr(type(SYSTEM), "dense_coordinates", 20)
    assert solve(text, *names).values == pytest.approx(expected, rel=1e-9)


def test_a_flat_net_that_swings_strains_no_cable():
    """To first order in the motion: no loss factor damps it, and rounding is shown as zero."""
    text = scene("hysteretic", {"accuracy": 1e-4}) | {"gravity": 0.0, "bodies": {}}
    text["points"] = {"p": [-1.0, 0.0, 0.0], "q": [1.0, 0.0, 0.0],
                      "knot": {"at": [0.0, 0.0, 0.0], "free": True, "mass": 1.0}}  # fmt: skip
    text["cables"] = {"n1": {"from": "p", "to": "knot", "tension": {"at": "mean", "value": 50.0}},
                      "n2": {"from": "knot", "to": "q", "unstretched_length": 0.999}}  # fmt: skip
    found = solve(text, "knot.damping_ratio_z", "knot.damping_ratio_x")
    assert found.values["knot.damping_ratio_z"] == 0.0
    assert found.values["knot.damping_ratio_x"] == pytest.approx(np.sin(np.arctan(0.1) / 2), rel=1e-6)


def test_a_motion_that_is_held_has_no_mode():
    text = scene("viscous", {"accuracy": 1e-4})
    text["bodies"]["gondola"]["free"] = ["x", "y", "z"]
    assert "gondola is held along rz" in solve(text, "gondola.damping_ratio_rz").status
