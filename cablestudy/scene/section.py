"""What a cable is made of: material, stiffness, mass, strength and size of its cross-section, in SI."""

import math
import os
from dataclasses import dataclass
from functools import cache
from typing import Annotated, ClassVar

from pydantic import AfterValidator, Field, model_validator

from cablestudy.scene.document import read_file
from cablestudy.scene.fields import Quantity, Table, suggestion, wrong
from cablestudy.scene.units import show, to_si

# Products of keys, beyond any cable by many powers of ten: their squares and those of frequencies stay finite.
STIFFNESS_RANGE = (1e-12, 1e24)  # elastic modulus times area [N]
MASS_RANGE = (1e-18, 1e12)  # density times area [kg/m]
PRESTRAIN_RANGE = (1e-18, 10.0)  # tension over axial stiffness [-]
ROUNDED = 1.02  # area over that of the circle of the diameter, where both are written with two or three digits

Stress = Annotated[float, Quantity("Pa", 1e-12, 1e30)]


@cache
def materials():
    """The table of materials: name -> {elastic_modulus [Pa], density [kg/m^3], strength [Pa]}."""
    return read_file(os.path.join(os.path.dirname(__file__), "materials.yaml")).value


def _known_material(name):
    if name not in materials():
        raise wrong(f"unknown material {show(name)} ({suggestion(name, materials())})")
    return name


def within(value, limits):
    """Whether a number, or each of an array, is between two limits, both allowed."""
    return (limits[0] <= value) & (value <= limits[1])


def limited(key, value, limits, unit, text):
    """The relation that a value is between two limits; `text` says what the value is."""
    allowed = f"out of range ({limits[0]:g} to {limits[1]:g} {unit})"
    return (key,), within(value, limits), lambda: f"{text(value)}: {allowed}"


def _root(value):
    """Square root of a number, or of each of an array, to the last digit alike."""
    return math.sqrt(value) if isinstance(value, float) else value**0.5


@dataclass(frozen=True)
class Share:
    """A share of the breaking force. [-]"""

    value: float


class ForceOrShare(Quantity):
    """A force, or a share of the breaking force: text that ends in %."""

    def read(self, value):
        """Value -> float [N], or `Share`."""
        if isinstance(value, Share):
            return value
        if not (isinstance(value, str) and value.rstrip().endswith("%")):
            return super().read(value)
        try:
            share = to_si(value, "")
        except ValueError:
            share = 0.0
        if not 0 < share <= 1:
            raise wrong(f"a share of the breaking force must be above 0 % and at most 100 %, got {show(value)}")
        return Share(share)


Tension = Annotated[float | Share, ForceOrShare("N", 1e-24, 1e24)]


class Section(Table):
    """The cross-section of a cable. Of alternatives that are not given the values are None."""

    complete: ClassVar[bool] = True  # whether stiffness, mass and size must be known

    material: Annotated[str, Field(strict=True), AfterValidator(_known_material)] | None = Field(
        None, description="Name in the table of materials: for what is not given here"
    )
    axial_stiffness: Annotated[float, Quantity("N", *STIFFNESS_RANGE)] | None = Field(
        None, description="Force per strain, EA (instead of elastic_modulus)"
    )
    elastic_modulus: Stress | None = Field(None, description="Effective elastic modulus, of the metallic area")
    mass_per_length: Annotated[float, Quantity("kg/m", *MASS_RANGE)] | None = Field(
        None, description="Mass per unstretched length (instead of density)"
    )
    density: Annotated[float, Quantity("kg/m^3", 1e-9, 1e15)] | None = Field(
        None, description="Mass per unstretched length over metallic area"
    )
    breaking_force: Annotated[float, Quantity("N", 1e-24, 1e24)] | None = Field(
        None, description="Tension at which the cable breaks, for utilisation (instead of strength)"
    )
    strength: Stress | None = Field(None, description="Breaking force over metallic area, for utilisation")
    area: Annotated[float, Quantity("m^2", 1e-18, 1e9)] | None = Field(
        None, description="Metallic area (default: that of the circle of the diameter, times the fill factor)"
    )
    diameter: Annotated[float, Quantity("m", 1e-9, 1e5)] | None = Field(
        None, description="Outer diameter (default: that of the circle which the area fills, by the fill factor)"
    )
    fill_factor: Annotated[float, Quantity("", 1e-3, 1)] = Field(
        1.0, description="Metallic area over that of the circle of the outer diameter, where only one of them is given"
    )
    expansion: Annotated[float, Quantity("1/K", -1, 1)] | None = Field(
        None, description="Coefficient of thermal expansion, along the cable"
    )

    @model_validator(mode="before")
    @classmethod
    def _of_material(cls, data):
        """What the material gives and the file does not."""
        name = data.get("material") if isinstance(data, dict) else None
        if not (isinstance(name, str) and name in materials()):
            return data
        given = {key for key, value in data.items() if value is not None}
        stands = {"axial_stiffness": "elastic_modulus", "mass_per_length": "density", "breaking_force": "strength"}
        given |= {of_material for own, of_material in stands.items() if own in given}
        if {"area", "diameter"} <= given:
            given.add("fill_factor")
        return {**{key: value for key, value in materials()[name].items() if key not in given}, **data}

    @classmethod
    def key_mistakes(cls, given):
        """See `Table.key_mistakes`: also a size that is missing, or stated twice."""
        found, given = super().key_mistakes(given), set(given)
        if {"area", "diameter", "fill_factor"} <= given:
            found.append((("fill_factor",), "has no effect: area and diameter are given"))
        if not cls.complete:
            return found
        for keys in (("axial_stiffness", "elastic_modulus"), ("mass_per_length", "density")):
            if given.isdisjoint((*keys, "material")):
                found.append(((), f"missing key: one of {', '.join(keys)} (or give material)"))
        if given.isdisjoint(("area", "diameter")) and not {"axial_stiffness", "mass_per_length"} <= given:
            found.append(((), "missing key: one of area, diameter (or give axial_stiffness and mass_per_length)"))
        return found

    # ------------------------------------------------------------------ the same, whichever of the keys are given

    @property
    def section_area(self):
        """Metallic area, given or that of the circle of the diameter times the fill factor; or None. [m^2]"""
        if self.area is not None or self.diameter is None:
            return self.area
        return self.fill_factor * (math.pi * (self.diameter * self.diameter) / 4)

    @property
    def section_diameter(self):
        """Outer diameter, given or that of the circle which the area fills; or None. [m]"""
        if self.diameter is not None or self.area is None:
            return self.diameter
        return _root(4 * self.area / (math.pi * self.fill_factor))

    @property
    def section_axial_stiffness(self):
        """EA, given or elastic modulus times area. [N]"""
        return self._or_times_area(self.axial_stiffness, self.elastic_modulus)

    @property
    def section_mass(self):
        """Mass per unstretched length, given or density times area. [kg/m]"""
        return self._or_times_area(self.mass_per_length, self.density)

    @property
    def section_breaking_force(self):
        """Breaking force, given or strength times area; or None. [N]"""
        return self._or_times_area(self.breaking_force, self.strength)

    @property
    def section_elastic_modulus(self):
        """Elastic modulus, given or EA over area; or None. [Pa]"""
        return self._or_over_area(self.elastic_modulus, self.axial_stiffness)

    @property
    def section_density(self):
        """Density, given or mass per length over area; or None. [kg/m^3]"""
        return self._or_over_area(self.density, self.mass_per_length)

    def _or_times_area(self, whole, per_area):
        if whole is not None or per_area is None or self.section_area is None:
            return whole
        return per_area * self.section_area

    def _or_over_area(self, per_area, whole):
        if per_area is not None or whole is None or self.section_area is None:
            return per_area
        return whole / self.section_area

    def force_of(self, stated):
        """A force stated in newtons or as a share of the breaking force; None stays None. [N]"""
        return stated.value * self.section_breaking_force if isinstance(stated, Share) else stated

    # ---------------------------------------------------------------------------------------------- relations

    def section_relations(self):
        """An area that its circle holds, products within what the solvers can hold: a list as of `relations`."""
        product = "times the area of the cross-section is {:g} "
        stiffness, mass = self.section_axial_stiffness, self.section_mass
        found = [
            limited("elastic_modulus", stiffness, STIFFNESS_RANGE, "N", f"{product}N".format),
            limited("density", mass, MASS_RANGE, "kg/m", f"{product}kg/m".format),
        ]
        if self.area is not None and self.diameter is not None:
            circle = math.pi * (self.diameter * self.diameter) / 4
            holds = self.area <= ROUNDED * circle
            found.append(
                (("diameter",), holds, lambda: f"a circle of it has {circle:g} m^2, less than {self.area:g} m^2")
            )
        return found

    def tension_relations(self, stated):
        """The tensions that keys state are not far beyond what the cable can take: a list as of `relations`.

        Parameters
        ----------
        stated : dict
            Path inside the table -> what is there: a force [N], `Share`, or None.
        """
        stated = {path: tension for path, tension in stated.items() if tension is not None}
        if self.section_breaking_force is None:
            shares = [path for path, tension in stated.items() if isinstance(tension, Share)]
            if shares:
                message = "a share needs the breaking force: give breaking_force, or strength with area or diameter"
                return [(path, False, lambda: message) for path in shares]
        return [self._tension_relation(path, self.force_of(tension)) for path, tension in stated.items()]

    def _tension_relation(self, path, tension):
        def text(ratio):
            return f"{tension:g} N is {ratio:.3g} times the axial stiffness"

        _, holds, message = limited(path[-1], tension / self.section_axial_stiffness, PRESTRAIN_RANGE, "times", text)
        return path, holds, message
