"""The cross-section of a cable, its own properties over those of a material, and shares of its breaking force."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated, ClassVar

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from cablestudy.scene.fields import Quantity, suggestion, wrong
from cablestudy.scene.materials import Properties, State, known_materials, materials
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show, si_or

ROPES = ("rope", "cable", "strand")  # words of a name that ask for one
PER_AREA = ("elastic_modulus", "density", "stress_strain")  # keys that need an area
NO_SIZE = "missing key: one of area, diameter (or give axial_stiffness and mass_per_length)"


def _known_materials(info):
    """Name -> Material of what a scene may name; without the scene's context the built-in ones.

    The built-in ones are read from their file when a cable first names one.
    """
    if not info.context:
        return materials()
    if "known" not in info.context:
        info.context["known"] = known_materials(info.context["materials"])
    return info.context["known"]


def _check_material(name, info: ValidationInfo):
    """The name of a material itself; an unknown one is refused."""
    known = _known_materials(info)
    if name not in known:
        hint = suggestion(name, known)
        ropes = [rope for rope, material in known.items() if material and material.section_fill_factor < 1]
        if any(word in name.lower() for word in ROPES) and not any(rope in hint for rope in ropes):
            hint = f"{hint}; ropes: {', '.join(ropes)}"
        raise wrong(f"unknown material {show(name)} ({hint})")
    return name


def of_each(function, *numbers):
    """Value of a function of floats; where some are arrays, shape (n,), that of each of their entries, as if alone."""
    arrays = [number for number in numbers if not isinstance(number, float)]
    if not arrays:
        return function(*numbers)
    values = arrays[0] + 0.0  # a copy
    entries = [[number] * len(values) if isinstance(number, float) else number.tolist() for number in numbers]
    values[:] = list(map(function, *entries))
    return values


def within(value, limits):
    """True if a number, or each of an array, is between two limits, both allowed."""
    return (limits[0] <= value) & (value <= limits[1])


def limited(path, value, limits, unit, text):
    """The relation that a value is between two limits; `text` is a function: value -> beginning of the message."""
    allowed = f"out of range ({limits[0]:g} to {limits[1]:g} {unit})"
    return path, within(value, limits), lambda: f"{text(value)}: {allowed}"


@dataclass(frozen=True)
class Share:
    """A share of the breaking force. [-]"""

    value: float


class ForceOrShare(Quantity):
    """A force, or a share of the breaking force: text that ends in %."""

    def read(self, value):
        """Value -> float [N], or `Share`."""
        if not (isinstance(value, str) and value.rstrip().endswith("%")):
            return super().read(value)
        share = si_or(0.0, value, "")
        if not 0 < share <= 1:
            raise wrong(f"a share of the breaking force must be above 0 % and at most 100 %, got {show(value)}")
        return Share(share)


Tension = Annotated[float | Share, ForceOrShare("N", 1e-24, 1e24)]


class Section(Properties):
    """The cross-section of a cable, of a material or not."""

    complete: ClassVar[bool] = True  # whether stiffness, mass and size must be known

    material: Annotated[str, Field(strict=True), AfterValidator(_check_material)] | None = Field(
        None, description="Name in the table of materials, for what is not given here"
    )
    state: State | None = Field(
        None,
        description="Of a conductor with curves, its stress_strain or those of its material: initial (new), after_load "
        "(stretched by the heaviest case), after_creep (10 years on), final (both; the default with stress_strain)",
    )

    @model_validator(mode="before")
    @classmethod
    def _of_material(cls, data, info: ValidationInfo):
        """Add the properties of the material that the file does not give."""
        name = data.get("material") if isinstance(data, dict) else None
        material = _known_materials(info).get(name) if isinstance(name, str) else None
        if material is None:
            return data
        given = {key for key, value in data.items() if value is not None}
        return {**material.missing_properties(given), **data}

    @classmethod
    def key_mistakes(cls, given):
        """Mistakes of the keys, see `KeyTable.key_mistakes`: also what is missing of a complete section."""
        mistakes, given = super().key_mistakes(given), set(given)
        if not cls.complete:
            return mistakes
        for keys in (("axial_stiffness", "elastic_modulus", "stress_strain"), ("mass_per_length", "density")):
            if given.isdisjoint((*keys, "material")):
                mistakes.append(((), f"missing key: one of {', '.join(keys[:2])} (or give material)"))
        has_size = not given.isdisjoint(("area", "diameter", "material"))  # of a material: see `section_relations`
        if not (has_size or given.isdisjoint(PER_AREA)):
            mistakes.append(((), NO_SIZE))
        return mistakes

    def force_of(self, stated):
        """A force stated in newtons or as a share of the breaking force; None stays None. [N]"""
        return stated.value * self.section_breaking_force if isinstance(stated, Share) else stated

    @property
    def conductor_state(self):
        """The state of a conductor with curves, by default final; None of a linear cable."""
        return (self.state or "final") if self.stress_strain else None

    # ---------------------------------------------------------------------------------------------- relations

    def section_relations(self):
        """An area that its circle holds, products within what the solvers can hold: a list as in `relations`."""
        product = "times the area of the cross-section is {:g} "
        stiffness, mass = self.section_axial_stiffness, self.section_mass
        has_size = self.section_area is not None or all(getattr(self, key) is None for key in PER_AREA)
        relations = [((), has_size, NO_SIZE), *self.size_relations()]
        if stiffness is not None:  # else it is of a material that is wrong itself
            relations.append(limited(("elastic_modulus",), stiffness, SCENE.stiffness_range, "N", f"{product}N".format))
        if mass is not None:
            relations.append(limited(("density",), mass, SCENE.mass_range, "kg/m", f"{product}kg/m".format))
        return relations

    def tension_relations(self, tensions):
        """Relations that stated tensions are not far beyond what the cable can take: a list as in `relations`.

        `tensions` are path inside the table -> what is there: a force [N], `Share`, or None.
        """
        tensions = {path: tension for path, tension in tensions.items() if tension is not None}
        if self.section_axial_stiffness is None:
            return []
        if self.section_breaking_force is None:
            message = "a share needs the breaking force: give breaking_force, or strength with area or diameter"
            shares = [(path, False, message) for path, tension in tensions.items() if isinstance(tension, Share)]
            if shares:
                return shares
        return [self._tension_relation(path, self.force_of(tension)) for path, tension in tensions.items()]

    def _tension_relation(self, path, tension):
        """The relation that a tension [N] is within `SCENE.prestrain_range` times the axial stiffness."""
        text = partial("{:g} N is {:.3g} times the axial stiffness".format, tension)
        return limited(path, tension / self.section_axial_stiffness, SCENE.prestrain_range, "times", text)
