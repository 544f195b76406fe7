"""Likely mistakes, which a file may say and hardly means: numbers without a unit, ropes of another size."""

import math
from contextlib import suppress
from fnmatch import fnmatchcase

from cablestudy.scene.common_tables import comparison, written_limits
from cablestudy.scene.layers import leaves, mapping_at, merge
from cablestudy.scene.materials import known_materials
from cablestudy.scene.strict_yaml import mistake
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import si_or, split

LENGTHS = ("cable.diameter", "cables.*.diameter", "materials.*.diameter", "cases.*.ice.thickness")
TEMPERATURES = ("cable.reference.temperature", "cables.*.reference.temperature", "cases.*.temperature")
INTENSITY = "wind.turbulence_intensity"
SHARE = "utilisation"  # at the end of the columns that are shares of the breaking force
SIZES = "diameter", "area"
RESIZED = "and is scaled to another size here"
PAPER = "paper/"  # begins the names of the materials of the paper, whose cables are solid


def bare_number(value):
    """The number that a value of a file is, or a text without a unit; None of anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number, unit = split(value) if isinstance(value, str) else (value, "")
        return None if unit else float(number)
    except (ValueError, OverflowError):
        return None


def likely_mistakes(document):
    """Warnings about values of a document, with their places: tuple of str."""
    return (*_bare_numbers(document), *_bare_shares(document), *_doubtful_sections(document))


def _warning(document, path, text):
    """The warning about the value at a path of a document, with its place."""
    return str(mistake(document.place(path), ".".join(path), f"warning: {text}"))


def _bare_numbers(document):
    """Yield lengths from 1 m, intensities of turbulence above 100 % and temperatures below 200 K, without a unit."""
    for path, value in leaves(document.value):
        key, number = ".".join(path), bare_number(value)
        if number is None:
            continue
        if number >= SCENE.unlikely_thickness and any(fnmatchcase(key, pattern) for pattern in LENGTHS):
            yield _warning(document, path, f"{value} without a unit is {value} m")
        if number > SCENE.strongest_turbulence and key == INTENSITY:
            yield _warning(document, path, f"{value} without a unit is {100 * number:g} %")
        if number < SCENE.coldest and any(fnmatchcase(key, pattern) for pattern in TEMPERATURES):
            yield _warning(document, path, f"{value} without a unit is {value} K, {number - 273.15:.6g} degC")


def _bare_shares(document):
    """Yield limits of a utilisation of 200 % and more without a unit, as `utilisation <= 60`."""
    for path, text in written_limits(document.value):
        with suppress(ValueError, TypeError):  # what is no limit is reported elsewhere
            stated = comparison(text)
            number = bare_number(stated.number)
            if stated.column.endswith(SHARE) and number is not None and number >= SCENE.unlikely_utilisation:
                yield _warning(document, path, f"{number:g} without a unit is {100 * number:g} %")


def _doubtful_sections(document):
    """Yield a warning for each cable with a rope at another size than its own, or thick and of a solid material.

    Cables with the same warning because of a size that they share are reported once, at the first of them.
    """
    shared, tables = mapping_at(document.value, ("cable",)), _tables_with_material(document)
    known = known_materials(document.value.get("materials")) if tables else {}
    of_shared_size = {}
    for path, (own, table) in tables.items():
        name = table["material"]
        material = known.get(name) if isinstance(name, str) else None
        likely = material and (_check_resized_rope(name, material, table) or _check_solid_bar(name, material, table))
        if likely and own.get(likely[0]) is None:
            of_shared_size.setdefault(likely, []).append(path)
        elif likely:
            key, text = likely
            has_own = RESIZED in text and (own is shared or shared.get(key) is None)
            remedy = f" ({key}: null takes its own)" if has_own else ""
            yield _warning(document, (*path, key), f"{text}{remedy}")
    for (key, text), paths in of_shared_size.items():
        others = f", as for {', '.join(name for _, name in paths[1:])}" if paths[1:] else ""
        shared_size = f" (the {key} of the table cable{others}; give it a {key} of its own)"
        yield _warning(document, (*paths[0], "material"), f"{text}{shared_size}")


def _tables_with_material(document):
    """Path of the table of each cable with a material -> the table itself, and with what all cables share: dict."""
    shared = mapping_at(document.value, ("cable",))
    tables = {("cable",): (shared, shared)}
    for name, own in mapping_at(document.value, ("cables",)).items():
        if isinstance(own, dict) and any(own.get(key) is not None for key in ("material", *SIZES)):
            tables["cables", name] = own, merge({"cable": shared}, {"cable": own})["cable"]
    return {path: both for path, both in tables.items() if both[1].get("material")}


def _check_resized_rope(name, material, table):
    """Key and message where a cable has another size than the rope that is its material; None elsewhere."""
    if material.section_area is None:  # a material without a size
        return None
    for key, unit, rope_size in (("diameter", "m", material.section_diameter), ("area", "m^2", material.section_area)):
        cable_size = _number(table.get(key), unit)
        if cable_size is not None and abs(cable_size / rope_size - 1) > SCENE.equal_sizes:
            size = f"{rope_size * 1e3:.4g} mm" if key == "diameter" else f"{rope_size * 1e6:.4g} mm^2"
            return key, f"{name} has {size}, {RESIZED}"
    return None


def _check_solid_bar(name, material, table):
    """Key and message where a thick cable is a solid bar of its material, which is likely to be a rope; else None."""
    section_keys = ("area", "fill_factor", "axial_stiffness", "mass_per_length")
    is_solid = material.fill_factor == 1 and material.section_area is None and not name.startswith(PAPER)
    is_solid &= all(table.get(key) is None for key in section_keys)
    diameter = _number(table.get("diameter"), "m") if is_solid else None
    if diameter is None or diameter <= SCENE.thickest_wire:
        return None
    return "diameter", f"a solid bar of {name}; a rope has a fill_factor below 1 ('cablestudy materials' lists ropes)"


def _number(value, unit):
    """A value of the file as a positive number in a unit of SI, or None where it is none."""
    number = si_or(0.0, value, unit)
    return number if 0 < number < math.inf else None
