"""Numbers without a unit that are likely to be meant in another one than SI."""

from fnmatch import fnmatchcase

from cablestudy.scene.strict_yaml import mistake
from cablestudy.scene.units import split

LARGEST = 1.0  # of a likely diameter of a cable and a likely thickness of ice [m]
LENGTHS = ("cable.diameter", "cables.*.diameter", "materials.*.diameter", "cases.*.ice.thickness")


def bare_number(value):
    """The number that a value of a file is, or a text without a unit; None of anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number, unit = split(value) if isinstance(value, str) else (value, "")
        return None if unit else float(number)
    except (ValueError, OverflowError):
        return None


def large_lengths(document):
    """Warnings about diameters of cables and thicknesses of ice above 1 m without a unit: tuple of str."""
    found = []
    for path, value in _leaves(document.value):
        key = ".".join(path)
        if any(fnmatchcase(key, pattern) for pattern in LENGTHS) and (bare_number(value) or 0.0) > LARGEST:
            found.append(str(mistake(document.place(path), key, f"{value} without a unit is {value} m")))
    return tuple(found)


def _leaves(value, path=()):
    """Yield path and value of what is no mapping."""
    for key, inside in value.items():
        if isinstance(inside, dict):
            yield from _leaves(inside, (*path, key))
        else:
            yield (*path, key), inside
