"""The varied values of a study as lists that are not stored: {from: 10 kg, to: 100 kg, count: 4, spacing: log}."""

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache

from cablestudy.scene.units import common_factor, show, split

MAX_COUNT = 10_000_000
SPACINGS = ("linear", "log")
_KEYS = ("from", "to", "count", "spacing")
# Rounding to this many digits undoes the rounding of the powers in a logarithmic range: 2 stays 2.
_DIGITS = 15


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
        if spacing not in SPACINGS:
            raise ValueError(f"spacing: expected linear or log, got {show(spacing)}")
        (self._low, self._unit), (high, unit) = _end(first, "from"), _end(last, "to")
        if (self._unit == "") != (unit == ""):
            raise ValueError(f"from and to: give both with a unit or both without, got {show(first)} and {show(last)}")
        self._high = high * common_factor(unit, self._unit)
        if count == 1 and self._low != self._high:
            raise ValueError("count: a range of one value needs equal ends")
        if spacing == "log" and self._low * self._high <= 0:
            raise ValueError(f"spacing: log needs ends of one sign, not zero, got {show(first)} and {show(last)}")
        self._whole = isinstance(first, int) and isinstance(last, int)
        self._count, self._log = count, spacing == "log"
        self.written = {"from": first, "to": last, "count": count, "spacing": spacing}

    def __len__(self):
        return self._count

    def __getitem__(self, index):
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(self._count))]
        if not -self._count <= index < self._count:
            raise IndexError(index)
        return self._item(index % self._count)

    @lru_cache(maxsize=8192)  # noqa: B019 - a study asks for the same few values over and over
    def _item(self, index):
        return self._written(self._value(index))

    def _value(self, index):
        """One value as an exact fraction of the unit; each is rounded on its own, so that no error adds up."""
        if index == 0:
            return self._low
        if index == self._count - 1:
            return self._high
        part = Fraction(index, self._count - 1)
        if not self._log:
            return self._low + (self._high - self._low) * part
        low = float(self._low)
        value = low * math.exp(float(part) * math.log(self._high / self._low))
        return Fraction(f"{value:.{_DIGITS}g}")

    def _written(self, value):
        """A value as the user would write it."""
        if self._whole and value.denominator == 1:
            return int(value)
        if not self._unit:
            return float(value)
        return f"{value.numerator if _is_short(value) else float(value)!r} {self._unit}"


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
    for key in mapping:
        if key not in _KEYS:
            raise ValueError(f"unknown key {key} of a range (from, to, count, spacing)")
    for key in _KEYS[:3]:
        if key not in mapping:
            raise ValueError(f"a range needs the key {key} (from, to, count, spacing)")
    return Range(mapping["from"], mapping["to"], mapping["count"], mapping.get("spacing", "linear"))
