"""The largest gain of random suspensions with several winches, against dense bars of an assembly of their own."""

import numpy as np
import pytest
from campaign import campaign
from references.bar_loop import AXES, BarLoop
from references.bars_in_wind import von_karman
from scipy.optimize import linear_sum_assignment
from solved import solve
from suspension_cases import case_of

BARS, TURN = 5, 2 * np.pi
MODEL = {"elements": BARS, "order": 1, "mass": "lumped"}


def scene_of(seed):
    """A body on 3 to 6 cables with 2 or more winches, any damping, with or without notch; SI numbers."""
    rng = np.random.default_rng([seed, 77])

    def power(low, high):
        return float(10 ** rng.uniform(low, high))

    size, count, diameter = power(0.5, 2.3), int(rng.integers(3, 7)), power(-3, -2.3)
    density, modulus = float(rng.choice([1440, 7850, 950])), float(rng.choice([70e9, 200e9, 110e9]))
    area, mass, half = np.pi * diameter**2 / 4, power(0.5, 2.5), size * power(-1.6, -0.9)
    above = int(rng.integers(3, count + 1))
    stiffness, line = modulus * area, density * area
    tension = max(mass * 9.81 * power(-0.2, 0.6), line * 9.81 * size * power(-0.3, 1.2))
    tension = min(tension, 4e-3 * stiffness)
    cables, attachments = {}, {}
    for k in range(count):
        up, angle = (1 if k < above else -1), TURN * k / above + rng.uniform(-0.3, 0.3)
        anchor = size * np.array([np.cos(angle), np.sin(angle), up * rng.uniform(0.3, 1)])
        at = np.array([np.cos(angle), np.sin(angle), up * rng.uniform(0.1, 0.5)])
        at = half * (at + rng.uniform(-0.2, 0.2, 3))
        attachments[f"a{k}"] = at.tolist()
        length = np.linalg.norm(anchor - at) * (1 - tension * rng.uniform(0.5, 1.5) / stiffness)
        cables[f"c{k}"] = {"from": anchor.tolist(), "to": f"b.a{k}", "unstretched_length": float(length)}
    free = list(AXES[: rng.choice([3, 6])])
    wave = np.pi / size * np.sqrt(tension / line)
    damping = [
        {"model": "modal", "ratio": power(-2.5, -1.3)},
        {"model": "modal", "ratio": 0.0, "viscous": float(line * wave * power(-2, -0.7))},
        {"model": "kelvin_voigt", "time": power(-4, -2.5), "viscous": float(line * wave * power(-2.3, -1))},
    ][rng.integers(3)]
    winches = rng.choice(list(cables), int(rng.integers(2, count + 1)), replace=False).tolist()
    stretching = float(np.sqrt(stiffness / size / mass) / TURN)
    notch = {
        "frequency": stretching * power(-0.3, 0.3),
        "damping_ratio": power(-2, -0.3),
        "rolloff_frequency": stretching * power(0.3, 1.3),
        "rolloff_damping_ratio": float(rng.uniform(0.3, 1.2)),
    }
    measured = rng.choice(free[:3], int(rng.integers(1, min(len(winches), 3) + 1)), replace=False).tolist()
    body = {
        "at": [0.0] * 3,
        "mass": mass,
        "inertia": (mass * half**2 * rng.uniform(0.5, 0.9, 3)).tolist(),
        "center_of_mass": [0.0, 0.0, -half * float(rng.uniform(0, 0.3))],
        "attachments": attachments,
        "free": free,
    }
    return {
        "gravity": 9.81,
        "cable": {"elastic_modulus": modulus, "density": density, "area": float(area), "damping": damping},
        "bodies": {"b": body},
        "cables": cables,
        "winches": {name: {"end": "to"} if rng.random() < 0.25 else {} for name in winches},
        "control": {"body": "b", "measured": measured, "gain": 1e-5 * stretching,
                    "notch": "none" if rng.random() < 0.3 else notch},
    }  # fmt: skip


@pytest.mark.parametrize("seed", campaign(range(8), (0, 2, 3, 7)))
def test_closed_loop_poles_are_those_of_dense_bars(seed):
    """Winches that move ends with mass and damping, on the ground and on board: v' and v'' act too."""
    data = scene_of(seed)
    data["control"]["gain"] *= 1e5
    case = case_of({**data, "model": MODEL})
    found = case.analysis.closed_loop_of(250).loop.poles
    expected = BarLoop(data, case.equilibrium, BARS).poles(data["control"]["gain"])
    assert len(found) == len(expected)
    apart = np.abs(found[:, None] - expected) / np.maximum(np.abs(expected), 1e-9 * np.abs(expected).max())
    rows, columns = linear_sum_assignment(apart)
    assert apart[rows, columns].max() < 1e-10


def lossy(seed):
    """The same scene with a loss factor, and little viscous damping."""
    data = scene_of(seed)
    damping = {"model": "hysteretic", "loss_factor": float(0.05 + 0.05 * (seed % 4)), "viscous": 1e-3}
    return {**data, "cable": {**data["cable"], "damping": damping}}


def largest_gain_by_bars(data):
    """The largest gain, which is that of dense bars: stable at shares of it, and not beyond; and the bars."""
    bars = BarLoop(data, case_of(data).equilibrium, BARS)
    limit = solve({**data, "model": MODEL}, "largest_gain").values["largest_gain"]
    assert max(bars.growth(share * limit) for share in (1e-3, 0.03, 0.3, 0.6, 0.9, 0.99, 0.995)) <= 1e-9
    assert bars.growth(1.005 * limit) > 0
    return limit, bars


# of the last two one crossing lies between a pole and the notch
@pytest.mark.parametrize("seed", campaign([*range(8), 16, 51], (2, 3, 5, 16, 51)))
def test_the_largest_gain_is_the_smallest_at_which_a_pole_of_dense_bars_crosses(seed):
    """All modes of the elements are in the matrix."""
    largest_gain_by_bars(scene_of(seed))


@pytest.mark.parametrize("seed", campaign(range(4), (1, 2)))
def test_the_largest_gain_with_a_complex_stiffness(seed):
    """The same with poles of the upper half plane, of bars whose strain has a loss factor."""
    largest_gain_by_bars(lossy(seed))


@pytest.mark.parametrize("seed", [0, 2])
def test_the_loop_in_the_wind_with_a_complex_stiffness(seed):
    """RMS by frequency: bars whose strain has a loss factor, wind on the body alone."""
    data = lossy(seed)
    data["control"] = {**data["control"], "notch": "none"}
    data["bodies"]["b"]["wind"] = {"area": 0.5, "drag_coefficient": 1.1}
    data["wind"] = {"speed": 8.0, "turbulence_intensity": [0.2, 0.0, 0.0], "length_scale": 30.0, "on": "bodies",
                    "mean": False, "aerodynamic_damping": False, "admittance": "none"}  # fmt: skip
    data["model"] = MODEL
    limit = solve(data, "largest_gain").values["largest_gain"]
    data["control"]["gain"] = gain = 0.3 * limit
    case = case_of(data)
    bars, free = BarLoop(data, case.equilibrium, BARS), data["bodies"]["b"]["free"]
    body = len(bars.K) - len(free) + np.arange(3)
    frequency, weights = panels(bars, gain)
    push, parts = np.eye(len(bars.K))[body[0]], np.array_split(frequency, 200)
    moved = np.concatenate([bars.displacements(2j * np.pi * part, gain, push)[:, body] for part in parts])
    force = (1.2 * 1.1 * 0.5 * 8.0) ** 2 * von_karman(frequency, 8.0, 1.6, 30.0)
    found = solve(data, "b.rms_x", "b.rms_y", "b.rms_z").values
    expected = 1e3 * np.sqrt((weights * force) @ np.abs(moved) ** 2)
    assert [found[f"b.rms_{axis}"] for axis in "xyz"] == pytest.approx(expected.tolist(), rel=1e-5)


def panels(bars, gain):
    """Frequencies and weights of Gauss's rule, on panels that grow with the distance from the loop's poles. [Hz]"""
    poles = bars.poles(gain)
    steps = np.sinh(np.linspace(-8, 8, 17))
    edges = [np.abs(pole.imag + abs(pole.real) * steps) / TURN for pole in poles[poles.imag > 0]]
    edges = np.unique(np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 60), *edges]))
    nodes, weights = np.polynomial.legendre.leggauss(5)
    middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    return (middle[:, None] + half[:, None] * nodes).ravel(), (half[:, None] * weights).ravel()
