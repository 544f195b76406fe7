"""The varied values of a study as lists that are not stored: {from: 10 kg, to: 100 kg, count: 4, spacing: log}."""

import math
import re
from collections.abc import Sequence
from fractions import Fraction

from cablestudy.errors import SceneError
from cablestudy.scene.layers import split_key
from cablestudy.scene.strict_yaml import Place, compose, refuse, resolve
from cablestudy.scene.units import common_factor, show, split

MAX_COUNT = 10_000_000
SPACINGS = ("linear", "log")
# Rounding to this many digits undoes the rounding of the powers in a logarithmic range: 2 stays 2.
_DIGITS = 15
_KEPT = 10_000  # values of a range kept at most: in a grid each is met many times
_LARGEST_EXPONENT = 700  # exp of it is still a float
_COUNT = re.compile(r"\s*([0-9]{1,12})\s*(log|linear)?\s*")
_BRACKET = re.compile(r"""["'\[{]""")
_VARY = "expected KEY=FROM:TO:COUNT, KEY=FROM:TO:COUNTlog or KEY=A,B,C, for example cable.preload=100N:2kN:20log"


class Interval:
    """Two ends as written, and what lies between them.

    Parameters
    ----------
    first, last : int, float or str
        As written. Text carries a unit.
    spacing : str
        `linear`, or `log` for equal ratios.

    Raises
    ------
    ValueError
        Ends that do not fit each other or the spacing.
    """

    def __init__(self, first, last, spacing="linear"):
        if spacing not in SPACINGS:
            raise ValueError(f"spacing: expected linear or log, got {show(spacing)}")
        (self.low, self._unit), (high, unit) = _end(first, "from"), _end(last, "to")
        if (self._unit == "") != (unit == ""):
            raise ValueError(f"from and to: give both with a unit or both without, got {show(first)} and {show(last)}")
        self.high = high * common_factor(unit, self._unit)
        self._log = spacing == "log"
        if self._log and self.low * self.high <= 0:
            raise ValueError(f"spacing: log needs ends of one sign, not zero, got {show(first)} and {show(last)}")
        self._growth = _log(self.high / self.low) if self._log else 0.0
        self._whole = isinstance(first, int) and isinstance(last, int)

    def exact(self, part):
        """The value at a part of the way, from 0 to 1; each is rounded on its own, so that no error adds up.

        Parameters
        ----------
        part : Fraction

        Returns
        -------
        int, float or str
            As the user would write it.
        """
        if part in (0, 1):
            return self._written(self.high if part else self.low)
        if not self._log:
            return self._written(self.low + (self.high - self.low) * part)
        return self._written(Fraction(f"{self._geometric(float(part)):.{_DIGITS}g}"))

    def between(self, part):
        """The value at a part of the way, in double precision.

        Parameters
        ----------
        part : float

        Returns
        -------
        float or str
        """
        low, high = float(self.low), float(self.high)
        value = self._geometric(part) if self._log else low + (high - low) * part
        value = min(max(value, min(low, high)), max(low, high))
        return f"{value!r} {self._unit}" if self._unit else value

    def _geometric(self, part):
        """low (high/low)^part, by two factors where the ratio itself is beyond the largest float."""
        if abs(self._growth) < _LARGEST_EXPONENT:
            return float(self.low) * math.exp(part * self._growth)
        root = math.exp(0.5 * part * self._growth)
        return float(self.low) * root * root

    def _written(self, value):
        """A value as the user would write it."""
        if self._whole and value.denominator == 1:
            return int(value)
        if not self._unit:
            return float(value)
        return f"{value.numerator if _is_short(value) else float(value)!r} {self._unit}"


class Range(Sequence):
    """The values of a range, computed one by one.

    Parameters
    ----------
    first, last : int, float or str
        The ends as written; both are values of the range, exactly. Text carries a unit.
    count : int
        How many values, ends included. [-]
    spacing : str
        `linear`, or `log` for equal ratios.

    Attributes
    ----------
    written : dict
        The range as a study file says it.

    Raises
    ------
    ValueError
        Ends that do not fit each other or the spacing, or a count out of range.
    """

    def __init__(self, first, last, count, spacing="linear"):
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MAX_COUNT:
            raise ValueError(f"count: expected a whole number from 1 to {MAX_COUNT}, got {show(count)}")
        self._interval, self._count, self._known = Interval(first, last, spacing), count, {}
        self.written = {"from": first, "to": last, "count": count, "spacing": spacing}
        if count == 1 and self._interval.low != self._interval.high:
            raise ValueError("count: a range of one value needs equal ends")

    def __len__(self):
        return self._count

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(self._count))]
        if not -self._count <= index < self._count:
            raise IndexError(index)
        index %= self._count
        if index not in self._known:
            if len(self._known) >= _KEPT:
                self._known.clear()
            self._known[index] = self._interval.exact(Fraction(index, max(self._count - 1, 1)))
        return self._known[index]

    def worth_checking(self, few):
        """Some of the places in it, both ends among them: every limit of a quantity is an interval."""
        last = self._count - 1
        return {round(i * last / few) for i in range(few + 1)}


def _log(ratio):
    """Logarithm of a positive fraction, which may be beyond the largest float."""
    logarithm = math.log(ratio.numerator) - math.log(ratio.denominator)
    return logarithm if abs(logarithm) > _LARGEST_EXPONENT else math.log(ratio)


def _is_short(value):
    """Whether a fraction is a whole number that reads well without a point."""
    return value.denominator == 1 and abs(value) < 10**_DIGITS


def _end(value, key):
    """Number and unit of an end."""
    try:
        if isinstance(value, str):
            number, unit = split(value)
        elif isinstance(value, bool) or not math.isfinite(value):
            raise ValueError
        else:
            number, unit = Fraction(repr(value)), ""
        if abs(number) > Fraction(1e300) or 0 < abs(number) < Fraction(1e-300):
            raise ValueError
    except (ValueError, TypeError, OverflowError):
        raise ValueError(f'{key}: expected a number, or text such as "10 kg", got {show(value)}') from None
    return number, unit


def read_range(mapping):
    """Range from its YAML mapping.

    Parameters
    ----------
    mapping : dict
        Keys `from`, `to`, `count` and optionally `spacing`.

    Returns
    -------
    Range

    Raises
    ------
    ValueError
        A key is missing, unknown or wrong.
    """
    _check_keys(mapping, "a range", ("from", "to", "count"))
    return Range(mapping["from"], mapping["to"], mapping["count"], mapping.get("spacing", "linear"))


def read_interval(mapping):
    """What a sample draws a key from, from its YAML mapping.

    Parameters
    ----------
    mapping : dict
        Keys `from`, `to` and optionally `spacing`.

    Returns
    -------
    Interval

    Raises
    ------
    ValueError
        A key is missing, unknown or wrong, or the ends are equal.
    """
    if not isinstance(mapping, dict):
        raise ValueError(f"expected {{from, to, spacing}}, got {show(mapping)}")
    _check_keys(mapping, "a sampled key", ("from", "to"))
    interval = Interval(mapping["from"], mapping["to"], mapping.get("spacing", "linear"))
    if interval.low == interval.high:
        raise ValueError("from and to are equal: nothing to sample")
    return interval


def _check_keys(mapping, what, needed):
    listed = ", ".join((*needed, "spacing"))
    for key in mapping:
        if key not in (*needed, "spacing"):
            raise ValueError(f"unknown key {key} of {what} ({listed})")
    for key in needed:
        if key not in mapping:
            raise ValueError(f"{what} needs the key {key} ({listed})")


def read_vary(text):
    """Read the argument of `--vary`.

    Parameters
    ----------
    text : str
        `key=from:to:count`, with `log` or `linear` after the count, or `key=a,b,c`; values as in the files.

    Returns
    -------
    key : str
        Dotted.
    values : Sequence

    Raises
    ------
    SceneError
        Anything else.
    """
    key, sign, written = text.partition("=")
    key, written = key.strip(), written.strip()
    place = Place(f"--vary {key}")
    if not (sign and key and written):
        raise refuse(Place(f"--vary {text}"), _VARY)
    try:
        split_key(key)
        return key, _range(written) if ":" in written and not _BRACKET.search(written) else _list(written)
    except ValueError as error:
        raise refuse(place, str(error)) from None
    except SceneError as error:
        raise refuse(place, error.mistakes[0].message) from None


def _range(written):
    parts = written.split(":")
    if len(parts) != 3:
        raise ValueError(_VARY)
    first, last, number = parts
    count = _COUNT.fullmatch(number)
    if count is None:
        raise ValueError(f"count: expected a whole number, with log behind it for equal ratios, got {show(number)}")
    return Range(resolve(first.strip()), resolve(last.strip()), int(count[1]), count[2] or "linear")


def _list(written):
    """Values between commas, as in a list of YAML."""
    values, _ = compose(f"[{written}]", "")
    if not isinstance(values, list) or not values:
        raise ValueError(_VARY)
    return values
