"""A scene written in another unit of time has the same numbers: nothing is anchored to one second or to 1 rad/s.

All times are multiplied by a factor: lengths and masses stay, speeds and frequencies are divided by it, forces, moduli
and accelerations by its square. Numbers and stated errors of the loop then differ by rounding alone.
"""

import typing

import pytest
from command import CONFIGS
from solved import solve_all

from cablestudy.scene.fields import KeyTable
from cablestudy.scene.scene import load_scene
from cablestudy.study.columns import find

FACTOR = 7.3
# power of time in each unit that has one
POWERS = {
    "s": 1, "ms": 1, "Hz": -1, "rad/s": -1, "m/s": -1, "mm/s": -1, "m/s^2": -2, "Pa": -2, "N": -2, "N m": -2, "N/m": -2,
    "N s/m": -1, "N m s": -1, "N m s/rad": -1, "N s/m^2": -1,
}  # fmt: skip
LOOP = ("gain", "largest_gain", "gain_margin", "phase_margin", "gain_crossover", "delay_margin", "sensitivity_peak",
        "sensitivity_frequency", "disk_margin", "bandwidth")  # fmt: skip
SUSPENSION = ("gondola.rms_x", "gondola.damping_ratio_y", "winch_rms_speed", "d2.rms_tension", *LOOP)
ONE_CABLE = ("gondola_rms", "gondola_damping_ratio", "winch_rms_speed", *LOOP)


def unit_of(field):
    """Unit of a key, in SI; None where it has none. `field` is that of pydantic, or a part of its annotation."""
    pending = [*field.metadata, field.annotation]
    while pending:
        part = pending.pop(0)
        if hasattr(part, "unit"):
            return part.unit
        pending += [*getattr(part, "__metadata__", ()), *typing.get_args(part)]
    return None


def slower(value, factor, unit=None):
    """A scene, or one of its values in a unit, with all times multiplied by a factor."""
    if isinstance(value, KeyTable):
        fields = type(value).model_fields
        return value.model_copy(
            update={name: slower(getattr(value, name), factor, unit_of(field)) for name, field in fields.items()}
        )
    if isinstance(value, dict):
        return {name: slower(own, factor, unit) for name, own in value.items()}
    if isinstance(value, tuple):
        return tuple(slower(own, factor, unit) for own in value)
    return value * factor ** POWERS.get(unit, 0) if isinstance(value, float) else value


@pytest.mark.parametrize(("file", "changes", "names"), [
    ("suspensions/carlina-net-wind.yaml", [], SUSPENSION),
    ("suspensions/carlina-net-wind.yaml", ["control.gain=0"], ("largest_gain",)),
    ("suspensions/carlina-net-wind.yaml", ["control.gain={auto: 12 dB}"], SUSPENSION),
    ("carlina-pid.yaml", [], ONE_CABLE),
    ("carlina-pid.yaml", ["winch.controller.gain=0", "winch.controller.derivative_gain=0"], ("largest_gain",)),
], ids=["six winches", "without gain", "gain by margins", "PID with a delay", "delay without gain"])  # fmt: skip
def test_no_number_of_a_loop_depends_on_the_unit_of_time(file, changes, names):
    scene = load_scene(CONFIGS / file, changes)[1]
    own, other = solve_all([scene, slower(scene, FACTOR)], names)
    assert own.status == other.status == "ok"
    for name in names:
        scaled = own.values[name] * FACTOR ** POWERS.get(find(name).unit, 0)
        assert other.values[name] == pytest.approx(scaled, rel=1e-9), name
        assert other.errors[name] == pytest.approx(own.errors[name], rel=1e-3), name
