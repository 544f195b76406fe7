"""Tables of the commands that compute nothing: validate, keys, materials."""

import os
from dataclasses import asdict, fields

from pydantic import TypeAdapter, ValidationError

from cablestudy.errors import Mistakes, SceneError
from cablestudy.scene.document import apply_sets, read_file, resolve_base
from cablestudy.scene.fields import suggestion, tables_of
from cablestudy.scene.likely_mistakes import likely_mistakes
from cablestudy.scene.materials import Material, Materials, materials
from cablestudy.scene.mistakes import findings, located
from cablestudy.scene.scene import is_study
from cablestudy.scene.schema import ANY, Key, keys_of
from cablestudy.scene.study import study_of
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.words import counted
from cablestudy.study.limits import scene_with_limits
from cablestudy.study.prepare import prepare
from cablestudy.study.table import Field, Table

# a file with one of these keys has its materials in the table `materials`; any other file is such a table
OF_SCENE = ("base", "cable", "cables", "materials")
FIELDS = (
    Field("material", "material"),
    Field("elastic_modulus_GPa", "elastic modulus", "GPa"),
    Field("density_kg_per_m3", "density", "kg/m^3"),
    Field("strength_MPa", "strength", "MPa"),
    Field("fill_factor", "fill factor"),
    Field("expansion_per_K", "expansion", "1/K"),
    Field("diameter_mm", "diameter", "mm"),
    Field("source", "source"),
)


def validate_table(files, sets=()):
    """Check scene and study files, changed by texts KEY=VALUE, without computing anything, for the command `validate`.

    Returns
    -------
    table : Table
        A row for each file: its name, kind, number of cases (of a scene its load cases, or 1), and status.
    mistakes : list of Mistake
        All mistakes of all files.
    notes : list of str
        Warnings about files without a mistake.
    """
    rows, mistakes, notes = [], [], []
    for file in files:
        try:
            kind, cases, notes_of_file = _check_file(file, sets)
            notes += notes_of_file
            rows.append({"file": file, "kind": kind, "cases": cases, "status": "ok"})
        except SceneError as error:
            mistakes += error.mistakes
            rows.append({"file": file, "status": counted(len(error.mistakes), "mistake")})
    return Table(tuple(Field(name, name) for name in ("file", "kind", "cases", "status")), rows), mistakes, notes


def _check_file(file, sets):
    """Kind of a file, number of its cases, and notes on likely mistakes; SceneError of one that is not valid."""
    document = read_file(file)
    if is_study(document):
        study = study_of(document, sets, further_check=prepare)
        prepare(study)
        notes, sample = [], study.sample
        if sample and sample.method == "saltelli" and sample.count < SCENE.sensitivity_points:
            warning = f"sample: {sample.count} points; --sensitivity needs at least {SCENE.sensitivity_points}"
            notes = [f"{study.where(('sample', 'count'))}: {warning}"]
        return "study", study.count, [*study.likely_mistakes(), *study.notes, *notes]
    document = apply_sets(resolve_base(document), sets)
    scene = scene_with_limits(document)
    return "scene", len(scene.cases) or 1, likely_mistakes(document)


def key_table(kind, beginning=""):
    """Table of the keys of a "scene", "suspension" or "study", or only of the key `beginning` and those below it.

    SceneError where no key begins so.
    """
    all_keys = keys_of(kind)
    keys = [key for key in all_keys if not beginning or _is_below(key.key, beginning)]
    if not keys:
        raise SceneError(f"{beginning}: unknown key ({suggestion(beginning, [key.key for key in all_keys])})")
    return Table(tuple(Field(field.name, field.name) for field in fields(Key)), [asdict(key) for key in keys])


def _is_below(key, beginning):
    """True if a key is the one asked for or below it; `bodies.camera.mass` is `bodies.NAME.mass`."""
    names, asked_names = key.split("."), beginning.split(".")
    equal = all(name in (word, *ANY) for name, word in zip(names, asked_names, strict=False))
    return equal and len(asked_names) <= len(names)


def materials_table(files=()):
    """Table of the materials that files define, and of the built-in materials that they do not replace.

    The files are of materials, scenes or studies; `-` is standard input. SceneError: all mistakes in their materials.
    """
    entries = {}
    with Mistakes() as mistakes:
        for file in files:
            with mistakes.at():
                if file in materials() and not os.path.exists(file):
                    raise SceneError(f"{file}: a material, not a file: 'cablestudy materials' lists it among all")
                entries |= _materials_of(read_file(file))
    entries |= {name: (material, "") for name, material in materials().items() if name not in entries}
    return Table(FIELDS, [_material_row(name, *entry) for name, entry in entries.items()])


def _materials_of(document):
    """Name -> (Material, where it is written) of one file."""
    path = ()
    if is_study(document):
        document, path = study_of(document).document, ("materials",)
    elif any(key in document.stated_keys for key in OF_SCENE):
        document, path = resolve_base(document), ("materials",)
    value = document.value.get("materials", {}) if path else document.value
    try:
        materials_read = TypeAdapter(Materials).validate_python(value)
    except ValidationError as error:
        mistakes = findings(error, value, tables_of(Material, ("*",)))
        raise located([((*path, *path_in_value), message) for path_in_value, message in mistakes], document) from None
    return {name: (material, document.where((*path, name), of_key=True)) for name, material in materials_read.items()}


def _material_row(name, material, where):
    """One row of the table of materials; the source of an entry that states none is its position in its file."""
    modulus, strength = material.section_elastic_modulus, material.section_strength
    return {
        "material": name,
        "elastic_modulus_GPa": modulus and modulus / 1e9,
        "density_kg_per_m3": material.section_density,
        "strength_MPa": strength and strength / 1e6,
        "fill_factor": material.section_fill_factor,
        "expansion_per_K": material.expansion,
        "diameter_mm": material.diameter and material.diameter * 1e3,
        "source": material.source or where,
    }
