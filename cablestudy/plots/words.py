"""Texts in pictures: numbers of at most four significant digits, units, names of columns and keys."""

import json
import math
import re

from cablestudy.scene.layers import split_key
from cablestudy.scene.units import split
from cablestudy.study.table import short

LONGEST = 40  # characters of a name or value in a picture
# tables of the scene whose entries have names that the user gives: the name says more than the table
NAMED_TABLES = ("bodies", "cables", "points", "actuators", "winches", "cases", "anchors")
LISTED_TABLES = {"loads": "load", "ends": "end"}  # tables without names: counted from 1
WORDS_OF_KEYS = {"case": "load case", "model.elements": "number of elements", "model.order": "order of the elements"}
AXES = ("x", "y", "z")
SMALL_LENGTH = 0.01  # length below which it is given in mm [m]
KILO_FORCE = 1e4  # size of a force from which it is given in kN [N]
SPELLED = {"rms": "RMS", "inplane": "in-plane", "outofplane": "out-of-plane"}  # words in names of columns
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value):
    """A number of at most four significant digits as text: `−0.1211`, `1.9·10⁻⁵`, `10⁶`."""
    text = short(float(value))
    size, _, power = text.partition("e")
    if power:
        text = f"{size}·10{_raised(int(power))}"
        text = re.sub(r"^(-?)1·", r"\1", text)
    return with_minus(text)


def with_minus(text):
    """A text with the sign for minus instead of hyphens."""
    return text.replace("-", "−")


def power_text(value):
    """A number of one digit as text, with a power of ten where it is large or small."""
    if 1e-3 <= abs(value) < 1e5:
        return number(value)
    power = math.floor(math.log10(value) + 1e-9)
    size = number(value / 10.0**power)
    return f"{'' if size == '1' else f'{size}·'}10{_raised(power)}"


def _raised(power):
    return str(power).translate(RAISED)


def unit_text(unit):
    """A unit with raised powers: `kg/m²`."""
    raised = re.sub(r"\^(-?\d)", lambda power: _raised(power[1]), unit)
    return re.sub(r"\bu(?=m\b|rad\b)", "µ", raised)


def panels_left_out(count, total):
    """Words in the heading of a picture on panels that are not in it."""
    return f" (first {count} of {total} panels)" if count < total else ""


def axis_label(name, unit=""):
    """Label of an axis: what it shows and its unit in brackets."""
    return f"{name} [{unit_text(unit)}]" if unit else name


def quantity_text(value, unit=""):
    """A number with its unit."""
    return f"{number(value)} {unit_text(unit)}".rstrip()


def length_text(length, largest=None):
    """A length [m] with its unit, in that of the largest of several if that is given."""
    is_small = 0 < abs(length if largest is None else largest) < SMALL_LENGTH
    return quantity_text(1e3 * length, "mm") if is_small else quantity_text(length, "m")


def force_unit(largest):
    """Unit of forces the largest of which has a size [N], and the factor to it: kN from KILO_FORCE on, else N."""
    return ("kN", 1e-3) if largest >= KILO_FORCE else ("N", 1.0)


def force_text(force, largest=None):
    """A force [N] with its unit, in that of the largest of several if that is given."""
    unit, factor = force_unit(abs(force if largest is None else largest))
    return quantity_text(factor * force, unit)


def shortened(text, most=LONGEST):
    """A text of at most `most` characters, with an ellipsis in the middle where it is longer."""
    if len(text) <= most:
        return text
    return f"{text[: most - most // 3 - 1].rstrip()}…{text[-(most // 3) :].lstrip()}"


def case_words(case):
    """Words that begin the title of a picture of a load case."""
    return f"Load case {shortened(case)}: "


def column_words(name):
    """Words for a column: its owner in a suspension, and its name with spaces."""
    owner, _, own = name.rpartition(".")
    own = " ".join(SPELLED.get(word, word) for word in own.split("_"))
    return shortened(f"{owner.replace('.', ' ')} {own}".strip(), 2 * LONGEST)


def key_words(key):
    """Words for a dotted key of a scene, with the table that it belongs to: `wind.speed` is "wind speed"."""
    if key in WORDS_OF_KEYS:
        return WORDS_OF_KEYS[key]
    parts, words = list(split_key(key)), []
    owner = parts.pop(1) if parts[0] in NAMED_TABLES and len(parts) > 2 else ""
    for before, part in zip(["", *parts], parts, strict=False):
        if part.isdigit() and before in LISTED_TABLES:
            words[-1] = f"{LISTED_TABLES[before]} {int(part) + 1}"
        elif part.isdigit() and int(part) < len(AXES):
            words.append(AXES[int(part)])
        else:
            words.append(part.replace("_", " "))
    last = words[-3:] if words[-1] in AXES else words[-2:]
    if owner:
        last = [owner, *(last[1:] if last[0] in NAMED_TABLES else last)]
    return shortened(" ".join(last), 2 * LONGEST)


def value_text(value):
    """Short text, for labels in pictures, of a value that a study gives to a key.

    It is a number, a text such as `20 kN`, or a table or list, also as JSON text. Numbers are rounded, tables are
    written without brackets and quotes, long texts are shortened.
    """
    if isinstance(value, str) and (value[:1] in ("{", "[") or value in ("null", "true", "false")):
        try:
            value = json.loads(value)
        except ValueError:
            return shortened(value)
    if isinstance(value, dict):
        return shortened(", ".join(f"{str(key).replace('_', ' ')} {value_text(part)}" for key, part in value.items()))
    if isinstance(value, list):
        return shortened(_list_text(value))
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "none"}[value]
    if isinstance(value, (int, float)):
        return number(value)
    try:
        size, unit = split(value)
    except ValueError:
        return shortened(value)
    if unit and not re.search(r"\d\s|%", value):  # a name that begins with a digit
        return shortened(value)
    return quantity_text(float(size), unit)


def _list_text(values):
    """Values in brackets, behind them the unit that all have."""
    texts = [value_text(value) for value in values]
    units = {text.partition(" ")[2] for text in texts if text != "0"}
    if len(units) == 1 and all(isinstance(value, (int, float, str)) for value in values):
        texts = [text.partition(" ")[0] for text in texts]
        return f"({', '.join(texts)}) {units.pop()}".rstrip()
    return f"({', '.join(texts)})"
