"""The varied values of a study that are computed and not listed: {from: 10 kg, to: 100 kg, count: 4, spacing: log}."""

import re
from collections.abc import Sequence
from decimal import Decimal, InvalidOperation

from cablestudy.scene.document import read_option
from cablestudy.scene.strict_yaml import Place, compose, refuse, resolve
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import converted, show, split

SPACINGS = ("linear", "log")
MEANINGS = {
    "from": "First value, e.g. 10 kg",
    "to": "Last value",
    "count": "How many values",
    "spacing": "Equal steps or equal ratios",
}
_END_RANGE = (Decimal("1e-100"), Decimal("1e100"))  # of an end in any unit: ratios of two are floats
_COUNT = re.compile(r"\s*([0-9]{1,12})\s*(log|linear)?\s*")
_BRACKET = re.compile(r"""["'\[{]""")
_VARY = "expected KEY=FROM:TO:COUNT, KEY=FROM:TO:COUNTlog or KEY=A,B,C, for example cable.preload=100N:2kN:20log"


class Interval:
    """Two ends as written, text with a unit, and the values between; spacing is `linear`, or `log` for equal ratios.

    ValueError for ends that do not fit each other or the spacing.
    """

    def __init__(self, first, last, spacing="linear"):
        if spacing not in SPACINGS:
            raise ValueError(f"spacing: expected linear or log, got {show(spacing)}")
        (self.low, self._unit), (high, unit) = _end(first, "from"), _end(last, "to")
        if (self._unit == "") != (unit == ""):
            raise ValueError(f"from and to: give both with a unit or both without, got {show(first)} and {show(last)}")
        self.high = converted(high, unit, self._unit)
        self._ratio = None  # of the ends, in a logarithmic range
        if spacing == "log":
            if self.low * self.high <= 0:
                raise ValueError(f"spacing: log needs ends of one sign, not zero, got {show(first)} and {show(last)}")
            self._ratio = float(self.high / self.low)
        self._floats = float(self.low), float(self.high)

    def between(self, fraction):
        """The value at a fraction of the way, from 0 to 1: float, or str with the unit."""
        low, high = self._floats
        value = low + (high - low) * fraction if self._ratio is None else low * self._ratio**fraction
        value = min(max(value, min(low, high)), max(low, high))
        return f"{value!r} {self._unit}" if self._unit else value


class Range(Interval, Sequence):
    """Values at equal steps or ratios, computed one by one; both ends, as written, are values exactly.

    Parameters and errors are those of `Interval`, and how many values, ends included; `written` is the range as a study
    file says it.
    """

    def __init__(self, first, last, count, spacing="linear"):
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= SCENE.cases:
            raise ValueError(f"count: expected a whole number from 1 to {SCENE.cases}, got {show(count)}")
        super().__init__(first, last, spacing)
        self._count, self._is_whole = count, isinstance(first, int) and isinstance(last, int)
        self.written = {"from": first, "to": last, "count": count, "spacing": spacing}
        if count == 1 and self.low != self.high:
            raise ValueError("count: a range of one value needs equal ends")

    def __len__(self):
        return self._count

    def __getitem__(self, index):
        """Int, float or str as the user would write it; linear values correctly rounded, others to 15 digits."""
        if not -self._count <= index < self._count:
            raise IndexError(index)
        step, last = index % self._count, self._count - 1
        if step in (0, last):
            value = self.high if step else self.low
        elif self._ratio is None:
            value = self.low + (self.high - self.low) * step / last
        else:
            value = Decimal(f"{float(self.low) * self._ratio ** (step / last):.{SCENE.range_digits}g}")
        is_integer = value == value.to_integral_value()
        if not self._unit:
            return int(value) if self._is_whole and is_integer else float(value)
        return f"{int(value) if is_integer and abs(value) < 10**SCENE.range_digits else float(value)!r} {self._unit}"

    def worth_checking(self, steps):
        """Set of evenly spread indices, first and last among them; if these are allowed, so are all between them."""
        last = self._count - 1
        return {round(i * last / steps) for i in range(steps + 1)}


def _end(value, key):
    """Number (Decimal) and unit of an end as written; ValueError, which names the key, where it is none."""
    try:
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise ValueError
        number, unit = split(value) if isinstance(value, str) else (Decimal(repr(value)), "")
        if number and not _END_RANGE[0] <= abs(number) <= _END_RANGE[1]:
            raise ValueError
    except (ValueError, InvalidOperation):
        raise ValueError(f'{key}: expected a number, or text such as "10 kg", got {show(value)}') from None
    return number, unit


def read_range(mapping):
    """Range from its YAML mapping of `from`, `to`, `count` and optionally `spacing`; ValueError when it is wrong."""
    return Range(*_values(mapping, "a range", ("from", "to", "count")))


def read_interval(mapping):
    """Interval of a sampled key from its YAML mapping of `from`, `to` and perhaps `spacing`; ValueError when wrong."""
    if not isinstance(mapping, dict):
        raise ValueError(f"expected {{from, to, spacing}}, got {show(mapping)}")
    interval = Interval(*_values(mapping, "a sampled key", ("from", "to")))
    if interval.low == interval.high:
        raise ValueError("from and to are equal: nothing to sample")
    return interval


def _values(mapping, noun, needed):
    """List of the values of the keys that are needed, and of the spacing; `noun` names the mapping in messages."""
    allowed = (*needed, "spacing")
    for key in mapping:
        if key not in allowed:
            raise ValueError(f"unknown key {key:.60} of {noun} ({', '.join(allowed)})")
    for key in needed:
        if key not in mapping:
            raise ValueError(f"{noun} needs the key {key} ({', '.join(allowed)})")
    return [mapping.get(key, "linear") for key in allowed]


def read_vary(text):
    """Key and values of `--vary`: `key=from:to:count`, `log` or `linear` after the count, or `key=a,b,c`."""
    key, _, written = text.partition("=")
    if not (key.strip() and written.strip()):
        raise refuse(Place(f"--vary {text}"), _VARY)
    return read_option("--vary", text, _VARY, _read_values)


def _read_values(written):
    """The values of `--vary` behind the `=`: a Range, or a list."""
    if ":" not in written or _BRACKET.search(written):
        values, _ = compose(f"[{written}]", "")  # a list as in the files
        if not isinstance(values, list) or not values:
            raise ValueError(_VARY)
        return values
    parts = written.split(":")
    if len(parts) != 3:
        raise ValueError(_VARY)
    first, last, number = parts
    count = _COUNT.fullmatch(number)
    if count is None:
        shown = show(number.strip())
        raise ValueError(f"count: expected a whole number, with log behind it for equal ratios, got {shown}")
    return Range(resolve(first.strip()), resolve(last.strip()), int(count[1]), count[2] or "linear")
