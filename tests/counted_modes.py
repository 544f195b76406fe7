"""Random suspensions whose modes are counted: one or two bodies, junctions, 3 to 22 cables, taut to sagging."""

from dataclasses import replace

import numpy as np
from references import continuous_suspension
from suspension_scenes import chords, suspension

from cablestudy.statics import rest
from cablestudy.system.coupled_modes import coupled_modes


def scene(seed):
    """A suspension whose cables state their unstretched lengths, not yet in equilibrium."""
    rng = np.random.default_rng(seed)
    size, bodies, cables = 10 ** rng.uniform(0.5, 2.5), {}, []
    for number in range(rng.integers(1, 3)):
        mass, axes = 10 ** rng.uniform(-3, 5), np.linalg.qr(rng.normal(size=(3, 3)))[0]
        inertia = axes @ np.diag(mass * (0.03 * size) ** 2 * rng.uniform(0.05, 0.12, 3)) @ axes.T
        bodies[f"body_{number}"] = {
            "at": 0.15 * size * rng.normal(size=3), "mass": mass, "center": 0.005 * size * rng.normal(size=3),
            "inertia": inertia,
        }  # fmt: skip
    firm = list(bodies)
    for number in range(rng.integers(0, 3)):
        mass = 10 ** rng.uniform(-3, 2) * rng.integers(0, 2)
        bodies[f"point_{number}"] = {"at": 0.2 * size * rng.normal(size=3), "mass": mass, "junction": True}
    stiffness, mass, many = 10 ** rng.uniform(4, 8), 10 ** rng.uniform(-2, 0.5), rng.integers(3, 8)

    def place(name):
        return tuple(0.03 * size * rng.normal(size=3)) if name in firm else (0.0, 0.0, 0.0)

    for name in bodies:
        for _ in range(many if name in firm else 3):
            anchor = rng.normal(size=3)
            anchor *= size * rng.uniform(0.6, 1.2) / np.linalg.norm(anchor)
            anchor[2] = abs(anchor[2]) * (1 if rng.random() < 0.7 else -1)
            cables.append((tuple(anchor), (name, place(name)), stiffness, mass))
    for name in list(bodies)[len(firm) :]:
        cables.append(((name, place(name)), (firm[0], place(firm[0])), stiffness, mass))
    model = suspension(bodies, cables)
    short = 10 ** rng.uniform(-5, -2) * rng.choice([1, 1, -3]) * rng.uniform(0.5, 1, len(cables))
    return replace(model, value=chords(model) * (1 - short))


def wrong_modes(seed, count=12, accuracy=1e-4, allowed=10):
    """Modes that are off by more than `allowed` times their stated error; None without a stable equilibrium.

    The number of modes below a frequency is counted for continuous cables.
    """
    state = rest.pose(scene(seed))
    if not state.record.converged or not state.stability.stable:
        return None
    found, wrong = coupled_modes(state, count, accuracy), []
    assert found.error.max() <= accuracy
    reference = continuous_suspension.Suspension(state, count)
    for mode in {1, count // 3, 2 * count // 3, count}:
        off = max(allowed * found.error[mode - 1], 1e-9)
        first, last = next(((a, b) for a, b in found.coincident if a <= mode <= b), (mode, mode))
        frequency = found.frequency[mode - 1]
        if reference.below(frequency * (1 - off)) > first - 1 or reference.below(frequency * (1 + off)) < last:
            wrong.append((mode, frequency, found.error[mode - 1]))
    return wrong
