"""The table of the command materials: what a cable may be made of, and where the numbers are from."""

from pydantic import TypeAdapter, ValidationError

from cablestudy.errors import Mistakes
from cablestudy.scene.document import read_file, resolve_base
from cablestudy.scene.fields import tables_of
from cablestudy.scene.materials import Material, Materials, materials
from cablestudy.scene.mistakes import findings, located
from cablestudy.scene.scene import is_study
from cablestudy.scene.study import study_of
from cablestudy.study.table import Field, Table

# Of a file with one of these keys the materials are those that it names, of any other file its contents.
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


def materials_table(files=()):
    """Table of the materials of some files, then of the built-in ones that they do not replace.

    Parameters
    ----------
    files : sequence of str
        Files of materials, scenes or studies; `-` is standard input.

    Raises
    ------
    SceneError
        All that is wrong with the materials of all files.
    """
    found = {}
    with Mistakes() as mistakes:
        for file in files:
            with mistakes.at():
                found |= _materials_of(read_file(file))
    found |= {name: (material, "") for name, material in materials().items() if name not in found}
    return Table(FIELDS, [_row(name, *entry) for name, entry in found.items()])


def _materials_of(document):
    """Name -> (Material, where it is written) of one file."""
    path = ()
    if is_study(document):
        document, path = study_of(document).document, ("materials",)
    elif any(key in document.given for key in OF_SCENE):
        document, path = resolve_base(document), ("materials",)
    value = document.value.get("materials", {}) if path else document.value
    try:
        read = TypeAdapter(Materials).validate_python(value)
    except ValidationError as error:
        mistakes = findings(error, value, tables_of(Material, ("*",)))
        raise located([((*path, *inside), message) for inside, message in mistakes], document) from None
    return {name: (material, document.where((*path, name), of_key=True)) for name, material in read.items()}


def _row(name, material, where):
    """One row; the source of an entry that states none is its place in its file."""
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
