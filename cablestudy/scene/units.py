"""Text with a unit -> SI numbers, correctly rounded: "1.85 mm" is the double 0.00185.

The units are those of pint, which is imported when the first unit is read that is not made of the SI units of
`_METRIC`, since that takes a third of a second.
Number and factor are decimal, so that their product is rounded once.
"""

import math
import re
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from functools import cache, lru_cache

from cablestudy.errors import SceneError, printable
from cablestudy.scene.tolerances import SCENE

_BEYOND = Decimal("1e400")

# Unit of the program -> (what it measures, an example for messages).
DIMENSIONS = {
    "m": ("length", "1.85 mm"),
    "m^2": ("area", "2.69 mm^2"),
    "kg": ("mass", "50 kg"),
    "kg/m": ("mass per length", "3.9 g/m"),
    "kg/m^3": ("density", "1440 kg/m^3"),
    "Pa": ("stress", "70.3 GPa"),
    "N": ("force", "1.3 kN"),
    "N m": ("moment", "10 N m"),
    "kg m^2": ("moment of inertia", "4 kg m^2"),
    "rad": ("angle", "19 deg"),
    "Hz": ("frequency", "10 Hz"),
    "rad/s": ("angular rate", "0.325 rad/s"),
    "K": ("temperature", "15 degC"),
    "s": ("time", "5 ms"),
    "m/s": ("speed", "6 m/s"),
    "m/s^2": ("acceleration", "9.81 m/s^2"),
    "N/m": ("stiffness", "1 kN/m"),
    "1/K": ("coefficient of expansion", "12e-6 1/K"),
    "N s/m": ("viscous damping", "300 N s/m"),
    "N m s": ("angular momentum", "5 N m s"),
    "N m s/rad": ("rotational damping", "20 N m s/rad"),
    "N s/m^2": ("viscous damping per length", "0.02 N s/m^2"),
    "dB": ("level", "6 dB"),
    "": ("pure number", "5 %"),
}
# What a misspelt unit is likely to mean.
_KNOWN = (
    *("m", "mm", "cm", "km", "um", "µm", "inch", "foot", "ft", "yard", "mile", "deg", "rad", "percent", "dB"),
    *("K", "degC", "degF"),
    *("kg", "g", "tonne", "lb", "N", "mN", "kN", "MN", "lbf", "kgf", "Nm", "kNm"),
    *("Pa", "kPa", "MPa", "GPa", "psi", "ksi", "bar"),
    *("kip", "psf", "ksf", "plf", "klf", "pcf"),
    *("s", "ms", "min", "hour", "Hz", "kHz", "m/s", "km/h", "mph", "knot"),
)

_FURTHER = {
    "Nm": "newton * meter", "Nms": "newton * meter * second",
    "psf": "pound_force / foot ** 2", "ksf": "1000 * pound_force / foot ** 2",
    "plf": "pound_force / foot", "klf": "1000 * pound_force / foot", "pcf": "pound / foot ** 3",
    "kn": "knot",  # which pint has since 0.25
}  # fmt: skip

# Temperature scales -> what is added to a number on them, and the size of a degree. [K]
_SCALES = {"C": (Decimal("273.15"), Decimal(1)), "F": (Decimal("459.67"), Decimal(5) / 9)}
_DEGREES = {
    **dict.fromkeys(("degC", "degreeC", "celsius", "degree_Celsius"), _SCALES["C"]),
    **dict.fromkeys(("degF", "degreeF", "fahrenheit", "degree_Fahrenheit"), _SCALES["F"]),
}

# Logarithms of ratios, which are no pure numbers, as they are for pint: in dB.
_LEVELS = dict.fromkeys(("dB", "decibel"), Decimal(1)) | dict.fromkeys(("Np", "neper"), 20 / Decimal(10).ln())

# Units that need no pint: factor, and powers of m, kg, s, K and rad.
_NO_DIMENSION = (0, 0, 0, 0, 0)
_PI = Decimal("3.14159265358979323846264338327950288")
_METRIC = {
    "m": (Decimal(1), (1, 0, 0, 0, 0)), "g": (Decimal("0.001"), (0, 1, 0, 0, 0)), "s": (Decimal(1), (0, 0, 1, 0, 0)),
    "N": (Decimal(1), (1, 1, -2, 0, 0)), "Pa": (Decimal(1), (-1, 1, -2, 0, 0)), "Hz": (Decimal(1), (0, 0, -1, 0, 0)),
    "rad": (Decimal(1), (0, 0, 0, 0, 1)), "Nm": (Decimal(1), (2, 1, -2, 0, 0)), "Nms": (Decimal(1), (2, 1, -1, 0, 0)),
}  # fmt: skip
_PREFIXES = {"k": 3, "M": 6, "G": 9, "c": -2, "m": -3, "u": -6, "µ": -6}
_METRIC |= {
    prefix + symbol: (factor.scaleb(power), dimension)
    for symbol, (factor, dimension) in _METRIC.items()
    for prefix, power in _PREFIXES.items()
}
_METRIC |= {
    "t": (Decimal(1000), (0, 1, 0, 0, 0)), "tonne": (Decimal(1000), (0, 1, 0, 0, 0)),
    "min": (Decimal(60), (0, 0, 1, 0, 0)), "h": (Decimal(3600), (0, 0, 1, 0, 0)), "K": (Decimal(1), (0, 0, 0, 1, 0)),
    "deg": (_PI / 180, (0, 0, 0, 0, 1)), "%": (Decimal("0.01"), _NO_DIMENSION),
    "percent": (Decimal("0.01"), _NO_DIMENSION),
}  # fmt: skip

_QUANTITY = re.compile(
    r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)(?:/([0-9]{1,9}))?\s*(.*?)\s*", re.DOTALL
)
# Names with small powers, joined by * / and brackets: nothing in it can grow, and nothing is ever evaluated.
_NAME = r"[A-Za-zµμΩ°%][A-Za-z0-9_]*"
_DASHES = ("\u2010", "\u2011", "\u2012", "\u2013", "\u2014", "\u2212")  # hyphens, dashes and the minus of other texts
_POWER = re.compile(rf"({_NAME})(?:\^([-+]?[0-9]{{1,2}}))?")
_RAISED = str.maketrans({"²": "^2", "³": "^3"})
_UNIT = re.compile(rf"(?!.*%%)(?:{_NAME}(?:\s*(?:\^|\*\*)\s*[-+]?[0-9]{{1,2}})?|1(?=\s*/)|[*/()· ])+")


def article(noun):
    """A noun with its article."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


def expected(unit):
    """Description of a value in a unit of DIMENSIONS, for messages."""
    noun, example = DIMENSIONS[unit]
    return f'{article(noun)}{f" in {unit}" if unit else ""} (a number, or text such as "{example}")'


def to_si(value, unit):
    """Convert a number, or text with a unit, to a float in `unit`, a key of DIMENSIONS, in which a number is already.

    Correctly rounded; infinite or not a number only when the number `value` is. ValueError if it is not a number, of an
    unknown unit, or of one of another dimension.
    """
    if type(value) is float:
        return value
    if type(value) is str:
        return _text_to_si(value, unit)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"expected {expected(unit)}, got {show(value)}")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"expected {expected(unit)}, got a number out of range") from None


def si_or(otherwise, value, unit):
    """`to_si` of a value; `otherwise` where it is no such quantity."""
    try:
        return to_si(value, unit)
    except ValueError:
        return otherwise


def read_positive(option, text, unit):
    """The quantity in a unit of DIMENSIONS that an option of the command line gives; SceneError if not positive."""
    try:
        value = to_si(text, unit)
    except ValueError as error:
        raise SceneError(f"{option}: {error}") from None
    if not 0 < value < float("inf"):
        raise SceneError(f"{option}: {article(DIMENSIONS[unit][0])} must be positive, got {text:.60}")
    return value


def show(value):
    """A value as a message shows it: short, on one line."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, (list, tuple)):
        return "a list"
    if isinstance(value, str):
        return f'"{printable(value if len(value) <= 60 else f"{value[:57]}...")}"'
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return f"{value!r:.60}"


@lru_cache(maxsize=65536)
def _text_to_si(text, unit):
    """`to_si` of text."""
    try:
        number, name = split(text)
        shift, degree = _scale(name) if unit == "K" else (0, None)
        value = float((number + shift) * (degree or _factor(name, unit)))
    except _NotAQuantityError as error:
        raise ValueError(f"expected {expected(unit)}, got {show(text)}{error}") from None
    if math.isinf(value):
        raise ValueError(f"expected {expected(unit)}, got {show(text)} (out of range)")
    return value


def _scale(name):
    """Shift and size of a degree of a temperature in degC, °C, celsius, degF ... [K]; (0, None) of another unit."""
    return _DEGREES.get(name.replace("°", "deg"), (0, None))


class _NotAQuantityError(ValueError):
    """The end of a message of `to_si`: empty, or a reason in brackets."""


def split(text):
    """Split a text such as "1.85 mm" or "5/8 inch" into a number and the name of a unit, which may be empty.

    The number is a Decimal, exactly as written; a fraction to 28 digits. ValueError if the text is too long, does not
    begin with a decimal number, or the number is out of range or divided by zero.
    """
    match = _QUANTITY.fullmatch(text) if len(text) <= SCENE.quantity_characters else None
    if match is None:
        raise _NotAQuantityError(' (its minus sign is not "-")' if text.lstrip()[:1] in _DASHES else "")
    try:
        number = Decimal(match[1])
    except InvalidOperation:  # an exponent that not even a decimal number can have
        number = _BEYOND
    if number.copy_abs() >= _BEYOND:
        raise _NotAQuantityError(" (out of range)")
    if match[2] is not None:
        if not int(match[2]):
            raise _NotAQuantityError(" (division by zero)")
        number /= int(match[2])
    return number, match[3].translate(_RAISED)


@lru_cache(maxsize=4096)
def _factor(name, unit):
    """Ratio of a unit as written ("" for the program's own) to one of DIMENSIONS, to 28 digits, as Decimal."""
    if name in ("", unit):
        return Decimal(1)
    if unit == "dB":  # a level is not a multiple of anything, so that its unit is all that is checked
        raise _NotAQuantityError("")
    metric = _metric_ratio(name, unit)
    if metric is not None:
        return metric
    scale, expected = _root(unit)
    ratio, dimension = _root(name, expected)
    if dimension != expected:
        is_degree = unit == "K" and name in _SCALES
        meant = f"deg{name}" if is_degree else _of_force_or_mass(name, expected) or _in_other_letters(name, expected)
        noun = "" if is_degree else _dimension_name(dimension)
        raise _NotAQuantityError(f" ({'; '.join(filter(None, (noun, meant and f'did you mean {meant}?')))})")
    return ratio / scale


def _metric_ratio(name, other):
    """Ratio of two units as written that are made of those of `_METRIC`; None of others, or where they do not fit."""
    root, other_root = _metric_root(name), _metric_root(other)
    if root is None or other_root is None:
        return None
    (factor, dimension), (other_factor, other_dimension) = root, other_root
    return factor / other_factor if dimension == other_dimension else None


def _metric_root(name):
    """Factor and dimension (powers of m, kg, s, K and rad) of a unit, without pint.

    None where it is no product of units of `_METRIC` and their powers, perhaps divided by one of them.
    """
    numerator, *denominators = name.strip().replace("**", "^").replace("°", "deg").split("/")
    if len(denominators) > 1:
        return None
    is_empty = numerator.strip() == ("1" if denominators else "")
    words = [] if is_empty else re.split(r"\s*[*·]\s*|\s+", numerator.strip())
    factor, dimension = Decimal(1), _NO_DIMENSION
    for sign, word in (*((1, word) for word in words), *((-1, word.strip()) for word in denominators)):
        match = _POWER.fullmatch(word)
        if match is None or match[1] not in _METRIC:
            return None
        exponent, (size, powers) = sign * int(match[2] or 1), _METRIC[match[1]]
        factor *= size**exponent
        dimension = tuple(total + exponent * power for total, power in zip(dimension, powers, strict=True))
    return factor, dimension


def _of_force_or_mass(name, expected):
    """A unit with lb or kg exchanged for lbf or kgf, or the reverse, where that has the expected base units; or ""."""
    for mass, force in (("lb", "lbf"), ("kg", "kgf")):
        for written, meant in ((mass, force), (force, mass)):
            swapped = re.sub(rf"(?<![A-Za-z]){written}(?![A-Za-z0-9])", meant, name)
            if swapped != name and _root(swapped)[1] == expected:
                return swapped
    return ""


def _in_other_letters(name, expected):
    """A unit that differs in capital letters alone, as kN from kn, and has the expected base units; or ""."""
    alike = (unit for unit in _KNOWN if unit.lower() == name.lower() and unit != name)
    return next((unit for unit in alike if _root(unit)[1] == expected), "")


def common_factor(name, other):
    """Ratio of one unit to another, both as written, as Decimal; ValueError when they do not fit each other."""
    if name == other:
        return Decimal(1)
    metric = _metric_ratio(name, other)
    if metric is not None:
        return metric
    try:
        (ratio, dimension), (scale, expected) = _root(name), _root(other)
    except _NotAQuantityError as error:
        raise ValueError(f'not a unit: "{name}" or "{other}"{error}') from None
    if dimension != expected:
        nouns = _dimension_name(dimension), _dimension_name(expected)
        raise ValueError(f'"{name}" ({nouns[0]}) and "{other}" ({nouns[1]}) do not fit each other')
    return ratio / scale


def converted(number, name, other):
    """A number (Decimal) of one unit in another, both as written; ValueError when they do not fit each other.

    A temperature stays the same one: 0 degC is 273.15 K and 32 degF.
    """
    ratio, (shift, degree), (other_shift, other_degree) = common_factor(name, other), _scale(name), _scale(other)
    if name == other or degree is other_degree is None:
        return number * ratio
    kelvin = (number + shift) * (degree or common_factor(name, "K"))
    return kelvin / (other_degree or common_factor(other, "K")) - other_shift


@cache
def _registry():
    """pint's units, with decimal factors, and some that it lacks: torques without a blank, and pounds on structures."""
    import pint

    registry = pint.UnitRegistry(non_int_type=Decimal)
    for name, meaning in _FURTHER.items():
        registry.define(f"{name} = {meaning}")
    return registry


@lru_cache(maxsize=4096)
def _root(name, expected=None):
    """Factor (Decimal) and base units of pint of a unit as written: "mm" is 0.001 "meter", "" a pure number.

    Two units fit each other if their base units are equal. Dimensions are not compared, since those of rad/s and Hz are
    equal. The message on an unknown unit, _NotAQuantityError, suggests one that has the `expected` base units.
    """
    if name == "":
        return Decimal(1), ""
    if name in _LEVELS:
        return _LEVELS[name], DIMENSIONS["dB"][0]
    if re.match(r",\d", name):
        raise _NotAQuantityError(" (a number has a decimal point and no commas)")
    if not _UNIT.fullmatch(name):
        raise _NotAQuantityError(" (a number, then a unit such as mm, kN, kg/m^3)")
    registry, spelt = _registry(), re.sub("°([CF])", r" deg\1 ", name).replace("°", " deg ")
    try:
        parsed = registry.parse_units(spelt.replace("%", " percent ").replace("·", "*").strip())
        ratio, units = registry.get_root_units(parsed)
    except Exception:  # pint raises a dozen kinds, and the tokenizer under it more
        raise _NotAQuantityError(_unknown(name, expected)) from None
    # The ratio is an int where only base units are multiplied: "m m" is 1 meter ** 2. pint's base of mass is the gram;
    # the text of the units is what compares equal across its versions.
    return Decimal(ratio), "" if units.dimensionless and not units._units else str(units)


@cache
def _dimension_name(dimension):
    """The word for some base units, or the base units."""
    for unit, (noun, _) in DIMENSIONS.items():
        if unit and _root(unit)[1] == dimension:
            return noun
    return dimension or "pure number"


def _unknown(name, expected):
    """The end of a message about an unknown unit, with the nearest known one, if possible of the `expected` base units.

    `expected` is None where any unit would do.
    """
    from difflib import get_close_matches

    raised = re.sub(r"(?<=[A-Za-z])(?=[2-9])", "^", name)  # as in m2, kg/m3
    with suppress(_NotAQuantityError):
        if raised != name and expected in (None, _root(raised)[1]):
            return f' (unknown unit "{name}"; did you mean {raised}?)'
    fitting = [] if expected is None else [known for known in _KNOWN if _root(known)[1] == expected]
    for units in (fitting, _KNOWN):
        similar = [known for known in units if known.lower() == name.lower()]
        similar = similar or get_close_matches(name, units, n=1, cutoff=0.6)
        if similar:
            return f' (unknown unit "{name}"; did you mean {similar[0]}?)'
    return f' (unknown unit "{name}")'
