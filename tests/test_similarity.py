"""A scene in other units of length, time and mass has the same numbers: nothing is anchored to 1 m, 1 s or 1 rad/s.

All that the scene states is multiplied by powers of three factors, as its unit says: forces by length mass/time^2.
Numbers and stated errors of the loop then differ by rounding alone.
"""

import math
import typing

import pytest
from command import CONFIGS
from solved import solve_all

from cablestudy.scene.fields import KeyTable
from cablestudy.scene.scene import load_scene
from cablestudy.study.columns import find

# powers of length, time and mass in each unit that has one
POWERS = {
    "m": (1, 0, 0), "mm": (1, 0, 0), "m^2": (2, 0, 0), "kg": (0, 0, 1), "kg/m": (-1, 0, 1), "kg/m^3": (-3, 0, 1),
    "kg m^2": (2, 0, 1), "s": (0, 1, 0), "ms": (0, 1, 0), "Hz": (0, -1, 0), "rad/s": (0, -1, 0), "m/s": (1, -1, 0),
    "mm/s": (1, -1, 0), "m/s^2": (1, -2, 0), "Pa": (-1, -2, 1), "N": (1, -2, 1), "N m": (2, -2, 1), "N/m": (0, -2, 1),
    "N s/m": (0, -1, 1), "N m s": (2, -1, 1), "N m s/rad": (2, -1, 1), "N s/m^2": (-1, -1, 1),
    "kg/(m s)": (-1, -1, 1),
}  # fmt: skip
TIME, LARGE, SMALL = (1.0, 7.3, 1.0), (2.0**12, 2.0**8, 1.0), (2.0**-12, 1.0, 2.0**-24)
LOOP = ("gain", "largest_gain", "gain_margin", "phase_margin", "gain_crossover", "delay_margin")
SIZES = ("sensitivity_peak", "sensitivity_frequency", "disk_margin", "bandwidth")  # compare metres with radians
SUSPENSION = ("gondola.rms_x", "gondola.damping_ratio_y", "winch_rms_speed", "d2.rms_tension", "gondola.rms_rx",
              "gondola.peak", *LOOP)  # fmt: skip
ONE_CABLE = ("gondola_rms", "gondola_damping_ratio", "winch_rms_speed", *LOOP, *SIZES)


def unit_of(field):
    """Unit of a key, in SI; None where it has none. `field` is that of pydantic, or a part of its annotation."""
    pending = [*field.metadata, field.annotation]
    while pending:
        part = pending.pop(0)
        if hasattr(part, "unit"):
            return part.unit
        pending += [*getattr(part, "__metadata__", ()), *typing.get_args(part)]
    return None


def factor_of(unit, factors):
    """Number by which a value in a unit is multiplied if length, time and mass are by these factors."""
    return math.prod(factor**power for factor, power in zip(factors, POWERS.get(unit, (0, 0, 0)), strict=True))


def scaled(value, factors, unit=None):
    """A scene, or one of its values in a unit, with length, time and mass multiplied by factors."""
    if isinstance(value, KeyTable):
        fields = type(value).model_fields
        return value.model_copy(
            update={name: scaled(getattr(value, name), factors, unit_of(field)) for name, field in fields.items()}
        )
    if isinstance(value, dict):
        return {name: scaled(own, factors, unit) for name, own in value.items()}
    if isinstance(value, tuple):
        return tuple(scaled(own, factors, unit) for own in value)
    return value * factor_of(unit, factors) if isinstance(value, float) else value


@pytest.mark.parametrize(("file", "changes", "names", "units"), [
    ("suspensions/carlina-net-wind.yaml", [], (*SUSPENSION, *SIZES), (TIME,)),
    ("suspensions/carlina-net-wind.yaml", ["model.accuracy=1e-3"], SUSPENSION, (LARGE, SMALL)),
    ("suspensions/carlina-net-wind.yaml", ["control.gain=0"], ("largest_gain",), (TIME,)),
    ("suspensions/carlina-net-wind.yaml", ["control.gain={auto: 12 dB}"], (*SUSPENSION, *SIZES), (TIME,)),
    ("carlina-pid.yaml", [], ONE_CABLE, (TIME, LARGE, SMALL)),
    ("carlina-pid.yaml", ["winch.controller.gain=0", "winch.controller.derivative_gain=0"], ("largest_gain",), (TIME,)),
])  # fmt: skip
def test_no_number_of_a_loop_depends_on_the_units(file, changes, names, units):
    scene = load_scene(CONFIGS / file, changes)[1]
    own, *others = solve_all([scene, *(scaled(scene, factors) for factors in units)], names)
    for factors, other in zip(units, others, strict=True):
        assert own.status == other.status == "ok"
        for name in names:
            expected = own.values[name] * factor_of(find(name).unit, factors)
            assert other.values[name] == pytest.approx(expected, rel=1e-9), name
            close = 1e-3 if factors == TIME else 0.02  # estimates of some errors compare metres with radians too
            assert other.errors[name] == pytest.approx(own.errors[name], rel=close, abs=1e-9), name
