"""The largest gain of random suspensions with several winches, against dense bars of an assembly of their own."""

import numpy as np
import pytest
from references.bar_loop import AXES, BarLoop
from solved import solve

from cablestudy.scene.suspension import SuspensionScene
from cablestudy.study.suspension.case import SuspensionCase

BARS, TURN = 5, 2 * np.pi


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


@pytest.mark.parametrize("seed", [*range(8), 16, 51])  # of the last two one crossing lies between a pole and the notch
def test_the_largest_gain_is_the_smallest_at_which_a_pole_of_dense_bars_crosses(seed):
    """Stable at shares of it, and not beyond it, all modes of the elements being in the matrix."""
    data = scene_of(seed)
    scene = {**data, "model": {"elements": BARS, "order": 1, "mass": "lumped"}}
    case = SuspensionCase(SuspensionScene.model_validate(data))
    bars = BarLoop(data, case.equilibrium, BARS)
    limit = solve(scene, "largest_gain").values["largest_gain"]
    growths = [bars.growth(share * limit) for share in (1e-3, 0.03, 0.3, 0.6, 0.9, 0.99)]
    assert max(growths) <= 1e-9
    assert bars.growth(1.01 * limit) > 0
