"""Text with a unit -> SI, correctly rounded or refused in one line; ranges of values."""

import math
import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablestudy.scene import units
from cablestudy.scene.ranges import Range, read_range
from cablestudy.scene.units import DIMENSIONS, to_si

POUND, FOOT = Fraction("0.45359237") * Fraction("9.80665"), Fraction("0.3048")  # [N], [m]: exact by definition


# Each expected value is the literal of the same number in SI, which Python rounds correctly by itself.
@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("1.85 mm", "m", 0.00185), ("3.7mm", "m", 0.0037), ("2.69 mm^2", "m^2", 2.69e-06),
        ("24.2 mm**2", "m^2", 24.2e-06), ("70.3 GPa", "Pa", 70300000000.0), ("3000 MPa", "Pa", 3e9),
        ("1440 kg/m^3", "kg/m^3", 1440.0), ("1.44 g/cm^3", "kg/m^3", 1440.0), ("1e3 N", "N", 1000.0),
        ("-1 N", "N", -1.0), ("3.5", "m", 3.5), (" .5 ", "m", 0.5), ("1 µm", "m", 1e-6), ("1 μm", "m", 1e-6),
        ("1 inch", "m", 0.0254), ("2 ft", "m", 0.6096),  # by definition
        ("5 %", "", 0.05), ("50 kg*m/s^2", "N", 50.0), ("1 1/s", "Hz", 1.0), ("0.6 m m", "m^2", 0.6),
        ("0.6 m*m", "m^2", 0.6), ("0.3 s m/s", "m", 0.3), ("0.325 rad/s", "rad/s", 0.325), ("6 dB", "dB", 6.0),
        ("36 km/h", "m/s", 10.0), ("180 deg", "rad", math.pi), ("90°", "rad", math.pi / 2),
        ("60 rpm", "rad/s", 2 * math.pi),
        ("1 Nm", "N m", 1.0), ("2.5 kNm", "N m", 2500.0), ("2.5 kN m", "N m", 2500.0), ("2.5 kN*m", "N m", 2500.0),
        ("3 MNm", "N m", 3e6), ("7 mNm", "N m", 0.007), ("5 Nms", "N m s", 5.0), ("20 Nms/rad", "N m s/rad", 20.0),
        # as the pages of `report` write them
        ("2.69 mm²", "m^2", 2.69e-06), ("1440 kg/m³", "kg/m^3", 1440.0), ("3 N s/m²", "N s/m^2", 3.0),
        ("80 celsius", "K", 353.15), ("77 fahrenheit", "K", 298.15), ("80 °C", "K", 353.15),
        # lb = 0.45359237 kg, ft = 0.3048 m, standard gravity 9.80665 m/s^2: all exact by definition
        ("3.16 lbf/ft", "N/m",
         float(Fraction("3.16") * Fraction("0.45359237") * Fraction("9.80665") / Fraction("0.3048"))),
        ("500 lbf", "N", float(500 * POUND)), ("2 kip", "N", float(2000 * POUND)), ("-1 lbf", "N", float(-POUND)),
        ("20 psf", "Pa", float(20 * POUND / FOOT**2)), ("0.5 ksf", "Pa", float(500 * POUND / FOOT**2)),
        ("30 ksi", "Pa", float(30000 * POUND / (FOOT / 12) ** 2)), ("80 plf", "N/m", float(80 * POUND / FOOT)),
        ("1.2 klf", "N/m", float(1200 * POUND / FOOT)), ("490 lbf/ft^2", "Pa", float(490 * POUND / FOOT**2)),
        ("490 pcf", "kg/m^3", float(490 * Fraction("0.45359237") / FOOT**3)),
        ("1/3", "", 1 / 3), ("2/7", "", 2 / 7), ("-1/3 m", "m", -1 / 3), ("5/8 inch", "m", 0.0254 * 5 / 8),
        ("1/2 1/s", "Hz", 0.5), ("2.5/10 m", "m", 0.25), ("1/4 %", "", 0.0025),
        *((number, "kg", number) for number in (3, 3.5, math.inf)),  # in SI already
    ],
)  # fmt: skip
def test_text_with_a_unit_is_correctly_rounded(text, unit, value):
    assert to_si(text, unit) == value


_COMPOUND = ["kg/m", "g/m", "kg/m^3", "g/cm^3", "N/mm^2", "kN/m", "km/h", "deg/s", "mrad / s", "1/K", "1 / min", "°/s",
             "kg m^2", "N m s/rad", "N*s/m**2", "Pa·s", "m^-1", "% / K", "mm^2"]  # fmt: skip


@pytest.mark.parametrize("name", [*units._METRIC, *_COMPOUND, *(unit for unit in DIMENSIONS if unit not in ("", "dB"))])
def test_units_that_need_no_pint_are_those_of_pint(name):
    factor, powers = units._metric_root(name)
    base = " ".join(f"{unit}^{power}" for unit, power in zip(("m", "kg", "s", "K", "rad"), powers, strict=True))
    (ratio, dimension), (scale, expected) = units._root(name), units._root(base)
    assert dimension == expected
    assert float(ratio / scale / factor - 1) == pytest.approx(0, abs=1e-26)


@pytest.mark.parametrize(
    "name", ["inch", "m/s/s", "m//s", "/s", "1", "m * * s", "kg/m s", "(N m)/s", "m^", "mm^2.5", "1 m"]
)
def test_other_units_are_left_to_pint(name):
    assert units._metric_root(name) is None


@given(number=st.floats(allow_nan=False, allow_infinity=False, min_value=-1e290, max_value=1e290))
def test_any_number_survives_text_and_units(number):
    assert to_si(number, "m") == to_si(repr(number), "m") == to_si(f"{number!r} m", "m") == number
    assert to_si(f"{number!r} km", "m") == float(Fraction(repr(number)) * 1000)


@pytest.mark.parametrize(
    ("text", "unit", "hint"),
    [
        ("500 lb", "N", "(mass; did you mean lbf?)"),
        ("80 kg", "N", "(mass; did you mean kgf?)"),
        ("2 lb/ft", "N/m", "(mass per length; did you mean lbf/ft?)"),
        ("2 lbf/ft", "kg/m", "(stiffness; did you mean lb/ft?)"),
        ("2 lbf", "kg", "(force; did you mean lb?)"),
        ("2 lb", "m", "(mass)"),
        ("4 kn", "N", "(speed; did you mean kN?)"),
    ],
)
def test_pounds_of_the_other_kind_are_told(text, unit, hint):
    with pytest.raises(ValueError, match="got") as caught:
        to_si(text, unit)
    assert str(caught.value).endswith(hint)


@pytest.mark.parametrize(
    ("text", "unit", "meant"),
    [
        ("16 mn", "m", "m"),
        ("16 mn", "N", "mN"),
        ("2 Knm", "N m", "kNm"),
        ("2 mmm", "Pa", "mm"),
        ("2 m2", "m^2", "m^2"),
        ("2 kg/m3", "kg/m^3", "kg/m^3"),
        ("2 mm2", "m^2", "mm^2"),
        ("1 kg m2", "kg m^2", "kg m^2"),
    ],
)
def test_an_unknown_unit_is_likely_one_of_the_expected_kind(text, unit, meant):
    with pytest.raises(ValueError, match=re.escape(f"did you mean {meant}?)")):
        to_si(text, unit)


WRITTEN = "a number, then a unit such as mm, kN, kg/m^3"


@pytest.mark.parametrize(
    ("value", "got"),
    [
        ("3 kg", '"3 kg" (mass)'),
        ("3 m^2", '"3 m^2" (area)'),
        ("3 mmm", '"3 mmm" (unknown unit "mmm"; did you mean mm?)'),
        ("3 m2", '"3 m2" (unknown unit "m2"; did you mean m?)'),  # not m^2, which is no length
        ("3 KM", '"3 KM" (unknown unit "KM"; did you mean km?)'),
        ("5 degC", '"5 degC" (temperature)'),
        *((text, f'"{text}"') for text in ("abc", "", "m", "nan", "__import__('os')")),
        *((text, f'"{text}" (out of range)') for text in ("1e999 m", "1e300 Gm", "1e999999999 m")),
        *((text, f'"{text}" ({WRITTEN})') for text in ("9**9**9 m", "1 m**9**9", "1 m * 2", "1 m;import os")),
        ("10 %%", f'"10 %%" ({WRITTEN})'),
        ("1 m)", '"1 m)" (unknown unit "m)"; did you mean m?)'),
        ("1" * 500, '"' + "1" * 57 + '..."'),
        (True, "true"),
        (None, "null"),
        ([1], "a list"),
        ({}, "a mapping"),
        (10**400, "a number out of range"),
        ("1/0 m", '"1/0 m" (division by zero)'),
        ("1/3/4 m", f'"1/3/4 m" ({WRITTEN})'),
        ("1/-3 m", f'"1/-3 m" ({WRITTEN})'),
        ("3 psf", '"3 psf" (stress)'),
        ("10,5 mm", '"10,5 mm" (a number has a decimal point and no commas)'),
        ("7,850", '"7,850" (a number has a decimal point and no commas)'),
        ("\u22123 m", '"\u22123 m" (its minus sign is not "-")'),
        (" \u20133 m", '" \u20133 m" (its minus sign is not "-")'),
    ],
)
def test_what_is_not_a_length_is_refused(value, got):
    with pytest.raises(ValueError, match="expected") as caught:
        to_si(value, "m")
    assert str(caught.value) == f'expected a length in m (a number, or text such as "1.85 mm"), got {got}'


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("10 rad/s", "Hz"), ("10 Hz", "rad/s"), ("3 deg", ""), ("1 m", "dB"), ("3 dB", "m"),
        ("6 dB", ""), ("6 decibel", ""), ("1 Np", ""),  # factors of 2.0, 2.0 and e of an amplitude, not 6, 6 and 1
    ],
)  # fmt: skip
def test_units_that_only_look_alike_are_refused(text, unit):
    with pytest.raises(ValueError, match="got"):
        to_si(text, unit)


_QUANTITY_LIKE = st.from_regex(r"[0-9.]{1,4}[eE]?[0-9]{0,4} ?[a-zµ°%*/^()0-9 +-]{0,12}", fullmatch=True)


@given(text=_QUANTITY_LIKE | st.text(max_size=30))
def test_any_text_gives_a_finite_number_or_a_value_error(text):
    try:
        assert math.isfinite(to_si(text, "m"))
    except ValueError as error:
        assert "\n" not in str(error)  # noqa: PT017


def test_every_dimension_has_an_example_that_reads():
    assert all(to_si(example, unit) > 0 for unit, (_, example) in DIMENSIONS.items())


@pytest.mark.parametrize(
    ("arguments", "values"),
    [
        ((1, 4, 4), [1, 2, 3, 4]),
        ((0.1, 0.5, 5), [0.1, 0.2, 0.3, 0.4, 0.5]),
        ((0, 1, 5), [0, 0.25, 0.5, 0.75, 1]),
        (("10 kg", "100 kg", 4), ["10 kg", "40 kg", "70 kg", "100 kg"]),
        (("1.5 m", "300 cm", 2), ["1.5 m", "3 m"]),
        (("0.1 mm", "0.3 mm", 3), ["0.1 mm", "0.2 mm", "0.3 mm"]),
        ((1, 64, 7, "log"), [1, 2, 4, 8, 16, 32, 64]),
        ((1e-3, 10, 5, "log"), [0.001, 0.01, 0.1, 1.0, 10]),
        (("-1 N", "-100 N", 3, "log"), ["-1 N", "-10 N", "-100 N"]),
        ((5, 5, 1), [5]),
        ((3, 1, 3), [3, 2, 1]),
        # 212 degF is 100 degC, 263.15 K is -10 degC, 68 degF is 293.15 K: by definition of the scales
        (("0 degC", "212 degF", 3), ["0 degC", "50 degC", "100 degC"]),
        (("-20 °C", "263.15 K", 3), ["-20 °C", "-15 °C", "-10 °C"]),
        (("273.15 K", "68 °F", 3), ["273.15 K", "283.15 K", "293.15 K"]),
    ],
)
def test_ranges_hit_round_values_and_both_ends(arguments, values):
    expanded = list(Range(*arguments))
    assert expanded == values
    assert [type(value) for value in expanded[:1]] == [type(values[0])]


_END = st.floats(1e-6, 1e6)


@given(low=_END, high=_END, count=st.integers(2, 40), spacing=st.sampled_from(["linear", "log"]))
def test_a_range_runs_evenly_from_end_to_end(low, high, count, spacing):
    values = list(Range(low, high, count, spacing))
    assert (len(values), values[0], values[-1]) == (count, low, high)
    part = [i / (count - 1) for i in range(count)]
    even = [low * (high / low) ** p for p in part] if spacing == "log" else [low + (high - low) * p for p in part]
    assert values == pytest.approx(even, rel=1e-12, abs=1e-15 * max(low, high))


def test_a_range_over_hundreds_of_powers_of_ten():
    for first, last in (("1e-99 N", "1e99 N"), ("1e99 N", "1e-99 N")):
        values = list(Range(first, last, 5, "log"))
        exponents = [math.log10(float(value.split()[0])) for value in values]
        assert exponents == pytest.approx(sorted([-99, -49.5, 0, 49.5, 99], reverse=first == "1e99 N"), abs=1e-9)


def test_a_long_range_is_not_stored():
    values = Range(0, 1, 10_000_000)
    assert len(values) == 10_000_000
    assert values[-1] == 1
    assert [values[4], values[5]] == [4 / 9_999_999, 5 / 9_999_999]


COUNT = "count: expected a whole number from 1 to 10000000, got {}"
NUMBER = '{}: expected a number, or text such as "10 kg", got {}'


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"count": None}, "a range needs the key count (from, to, count, spacing)"),
        ({"count": None, "step": 1}, "unknown key step of a range (from, to, count, spacing)"),
        ({"count": 1}, "count: a range of one value needs equal ends"),
        ({"count": 0}, COUNT.format(0)),
        ({"count": 2.5}, COUNT.format(2.5)),
        ({"count": 10**8}, COUNT.format(100000000)),
        ({"count": True}, COUNT.format("true")),
        ({"spacing": "cubic"}, 'spacing: expected linear or log, got "cubic"'),
        ({"from": 0, "spacing": "log"}, "spacing: log needs ends of one sign, not zero, got 0 and 2"),
        ({"from": "x"}, NUMBER.format("from", '"x"')),
        ({"to": "1e101 m"}, NUMBER.format("to", '"1e101 m"')),
        ({"from": 1e-101}, NUMBER.format("from", "1e-101")),
        ({"to": math.inf}, NUMBER.format("to", "inf")),
        ({"to": "2 m"}, 'from and to: give both with a unit or both without, got 1 and "2 m"'),
        ({"from": "1 kg", "to": "2 m"}, '"m" (length) and "kg" (mass) do not fit each other'),
        ({"from": "1 kgg", "to": "2 m"}, 'not a unit: "m" or "kgg" (unknown unit "kgg"; did you mean kg?)'),
    ],
)
def test_a_wrong_range_is_refused(change, message):
    mapping = {"from": 1, "to": 2, "count": 3} | change
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        read_range({key: value for key, value in mapping.items() if value is not None})
