"""Tables of cross-sections, materials and curves of conductors, in SI; the materials, built-in and of the user."""

import math
import os
from functools import cache
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, ValidationError

from cablestudy.scene.document import read_file
from cablestudy.scene.fields import KeyTable, MaterialName, Quantity, wrong
from cablestudy.scene.layers import OF_SECTION
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show

PERCENT = 0.01
TERMS = 5  # coefficients of a curve
UNITS = {"psi": 6894.757293168361, "MPa": 1e6, "Pa": 1.0}  # [Pa]
STATES = ("initial", "after_load", "after_creep", "final")
State = Literal[STATES]

Expansion = Annotated[float, Quantity("1/K", -1e-2, 1e-2)]
Coefficients = Annotated[tuple[Annotated[float, Quantity("", -1e15, 1e15)], ...], Field(min_length=2, max_length=TERMS)]


class PartTable(KeyTable):
    """Curves of one part of a conductor: its outer strands or its core."""

    initial: Coefficients = Field(
        description="Curve of a new conductor, stress over the whole area by strain in percent: coefficients, in "
        "`unit`, the constant first"
    )
    creep: Coefficients | None = Field(
        None, description="The same after 10 years under a constant tension (default: that of initial)"
    )
    final: Annotated[float, Quantity("Pa", 1e-12, 1e30)] = Field(
        description="Final modulus: over the area of the part with area_share, else over the whole area"
    )
    expansion: Expansion = Field(description="Coefficient of thermal expansion of the part")
    area_share: Annotated[float, Quantity("", 1e-6, 1, limits="above 0 and at most 1")] | None = Field(
        None, description="Area of the part over the metallic area (of the other part: what remains)"
    )

    def relations(self):
        """Relations: its curves rise as far as they are used, and are above zero there."""
        for key in ("initial", "creep"):
            if (curve := getattr(self, key)) is not None:
                end = end_of(curve)
                least = SCENE.least_curve_strain
                flat = f"the curve must rise to a strain of {least:g} % at least; it does not at {end:.2g} %"
                slack = f"the curve has no tension up to a strain of {end:.2g} %"
                yield [((key,), end >= least, flat)]
                yield [((key,), _stress_and_slope(curve, end)[0] > 0, slack)]


def end_of(curve):
    """Strain from which a curve goes on along its tangent: `SCENE.curve_strain`, or before it gets flat. [%]"""
    strains = [SCENE.curve_strain * step / SCENE.curve_steps for step in range(SCENE.curve_steps + 1)]
    least_slope = SCENE.flat_curve * abs(curve[1])
    flat = (index for index, strain in enumerate(strains) if not _stress_and_slope(curve, strain)[1] > least_slope)
    first_flat = next(flat, len(strains))
    return strains[max(first_flat - 1, 0)]


def _stress_and_slope(curve, strain):
    """Value and slope of the polynomial sum_k c_k strain^k of the coefficients of a curve, at a strain in percent."""
    stress = sum(factor * strain**power for power, factor in enumerate(curve))
    return stress, sum(power * factor * strain ** (power - 1) for power, factor in enumerate(curve) if power)


class StressStrainTable(KeyTable):
    """Stress by strain of a conductor, by part, over its whole metallic area."""

    table: ClassVar[str] = "stress_strain"

    outer: PartTable = Field(description="The outer strands; of a conductor of one metal the whole")
    core: PartTable | None = Field(None, description="The core")
    unit: Literal[tuple(UNITS)] = Field("psi", description="Of the coefficients: psi, MPa or Pa, per percent^k")
    measured_at: Annotated[float, Quantity("K", 60, 5000, limits="from 60 K to 5000 K (a bare number is K)")] = Field(
        294.2611111111111, description="Temperature of the curves (default: 70 degF)"
    )

    @property
    def parts(self):
        """Name -> PartTable of each part, the outer strands first."""
        return {"outer": self.outer} | ({"core": self.core} if self.core else {})

    def final_modulus(self, name):
        """Final modulus of a part over the whole area. [Pa]"""
        shares = {part: table.area_share for part, table in self.parts.items()}
        share, others = shares.pop(name), [other for other in shares.values() if other is not None]
        if share is None:
            share = 1.0 - others[0] if others else 1.0
        return share * self.parts[name].final

    @property
    def modulus(self):
        """Final modulus of the conductor, both parts together. [Pa]"""
        return sum(map(self.final_modulus, self.parts))

    def coefficients(self, name, curve):
        """Coefficients c_k of a curve, "initial" or "creep", of a part: stress = sum_k c_k strain^k.

        TERMS of them, zeros of a part that is not there [Pa]; and the strain to which they hold [-].
        """
        part = self.parts.get(name)
        written = (getattr(part, curve) or part.initial) if part else (0.0, 0.0)
        in_si = [factor * UNITS[self.unit] / PERCENT**power for power, factor in enumerate(written)]
        return in_si + [0.0] * (TERMS - len(in_si)), PERCENT * end_of(written)

    def relations(self):
        """Relations: the areas of the parts are the whole; each curve begins about as steep as its final modulus."""
        shares = [part.area_share for part in self.parts.values() if part.area_share is not None]
        complete = len(shares) < 2 or abs(sum(shares) - 1) < 1e-3
        text = "the two shares of the area add up to {:g}, not to 1".format
        yield [(("core", "area_share"), complete, lambda: text(sum(shares)))]
        core_or_all = self.core is not None or not shares or shares[0] == 1
        yield [(("outer", "area_share"), core_or_all, "without a core the outer strands are all of the area")]
        for name in self.parts:
            initial_modulus = self.coefficients(name, "initial")[0][1]
            ratio = initial_modulus / self.final_modulus(name)
            low, high = SCENE.likely_start
            message = (
                f"the curve begins at {initial_modulus / 1e9:.3g} GPa, {ratio:.2g} times the final modulus over the "
                f"whole area (allowed: {low:g} to {high:g}; coefficients are in {self.unit} per percent^k: see unit)"
            )
            yield [((name, "initial"), low <= ratio <= high, message)]


def loaded_by_a_case(path, cable, cases):
    """The relation that a conductor after load has load cases, of which the heaviest has stretched it."""
    has_cases = bool(cases) or cable.conductor_state != "after_load"
    return (*path, "state"), has_cases, "after_load: missing key: cases, of which the heaviest stretches it"


Stress = Annotated[float, Quantity("Pa", 1e-12, 1e30)]


def _root(value):
    """Square root of a number, or of each of an array, to the last digit alike."""
    return math.sqrt(value) if isinstance(value, float) else value**0.5


class Properties(KeyTable):
    """Properties of a cross-section. Of alternatives that are not given the values are None."""

    axial_stiffness: Annotated[float, Quantity("N", *SCENE.stiffness_range)] | None = Field(
        None, description="Force per strain, EA (instead of elastic_modulus)"
    )
    elastic_modulus: Stress | None = Field(None, description="Effective elastic modulus, of the metallic area")
    mass_per_length: Annotated[float, Quantity("kg/m", *SCENE.mass_range)] | None = Field(
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
    expansion: Expansion | None = Field(None, description="Coefficient of thermal expansion, along the cable")
    stress_strain: StressStrainTable | None = Field(
        None, description="Curves of a conductor that stretches permanently, by part (instead of elastic_modulus)"
    )

    @classmethod
    def key_mistakes(cls, given):
        """Mistakes of the keys, see `KeyTable.key_mistakes`: also a size that is stated twice."""
        mistakes = super().key_mistakes(given)
        if {"area", "diameter", "fill_factor"} <= set(given):
            mistakes.append((("fill_factor",), "has no effect: area and diameter are given"))
        return mistakes

    def size_relations(self):
        """Relation that a circle of the diameter holds the area: a list as in `relations`."""
        if self.area is None or self.diameter is None:
            return []
        circle = math.pi * (self.diameter * self.diameter) / 4
        message = "a circle of it has {:g} m^2, less than {:g} m^2".format
        return [(("diameter",), self.area <= SCENE.rounded_area * circle, lambda: message(circle, self.area))]

    # ------------------------------------------------------------------ quantities, whichever of the keys are given

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
    def section_fill_factor(self):
        """Metallic area over that of the circle of the diameter, also where both are given, rounded: at most 1. [-]"""
        if self.area is None or self.diameter is None:
            return self.fill_factor
        return min(1.0, self.area / (math.pi * (self.diameter * self.diameter) / 4))

    @property
    def section_axial_stiffness(self):
        """EA, given or elastic modulus times area; or None. [N]"""
        return self._or_times_area(self.axial_stiffness, self._modulus)

    @property
    def section_mass(self):
        """Mass per unstretched length, given or density times area; or None. [kg/m]"""
        return self._or_times_area(self.mass_per_length, self.density)

    @property
    def section_breaking_force(self):
        """Breaking force, given or strength times area; or None. [N]"""
        return self._or_times_area(self.breaking_force, self.strength)

    @property
    def section_elastic_modulus(self):
        """Elastic modulus, given or EA over area; or None. [Pa]"""
        return self._or_over_area(self._modulus, self.axial_stiffness)

    @property
    def section_density(self):
        """Density, given or mass per length over area; or None. [kg/m^3]"""
        return self._or_over_area(self.density, self.mass_per_length)

    @property
    def section_strength(self):
        """Strength, given or breaking force over area; or None. [Pa]"""
        return self._or_over_area(self.strength, self.breaking_force)

    @property
    def _modulus(self):
        """Elastic modulus, given or the final one of the curves; or None. [Pa]"""
        curves = self.stress_strain
        return curves.modulus if self.elastic_modulus is None and curves else self.elastic_modulus

    def _or_times_area(self, of_section, per_area):
        """Quantity of the whole section: as given, else that per area times the area; or None."""
        area = None if of_section is not None or per_area is None else self.section_area
        return of_section if area is None else per_area * area

    def _or_over_area(self, per_area, of_section):
        """Quantity per area: as given, else that of the whole section over the area; or None."""
        area = None if per_area is not None or of_section is None else self.section_area
        return per_area if area is None else of_section / area


class Material(Properties):
    """An entry of the table of materials: a material, or a rope, which may have a size of its own."""

    table: ClassVar[str] = "material"

    source: Annotated[str, Field(strict=True)] = Field("", description="Where the numbers are from")
    stress_strain: StressStrainTable | None = Field(
        None, description="Curves of a conductor that stretches for good, by part: of a cable with the key state"
    )

    @classmethod
    def key_mistakes(cls, given):
        """Mistakes of the keys, see `KeyTable.key_mistakes`: also a stiffness or mass that is missing."""
        mistakes, given = super().key_mistakes(given), set(given)
        for (of_section,), (per_area,) in OF_SECTION[:2]:
            if given.isdisjoint((of_section, per_area)):
                mistakes.append(((), f"missing key: one of {of_section}, {per_area}"))
        return mistakes

    def relations(self):
        """Relations of its sizes, see `size_relations`."""
        yield self.size_relations()

    def missing_properties(self, given):
        """Properties that a cable takes from this material because its own table, with the keys `given`, lacks them.

        A cable that gives its area or diameter has another size than the material. Then neither area nor diameter is
        taken, and stiffness, mass and breaking force are taken per area, or of the whole section if the material has no
        area. Else they are taken as the material gives them. A cable with the key `state` and no stiffness of its own
        is a conductor: it takes stress-strain curves, if the material has them, in place of the stiffness.

        Returns key of the table of a cable -> value in SI. The fill factor, metallic area over the area of the circle
        of the diameter, is there only if area or diameter is still missing.
        """
        resized, properties = not given.isdisjoint(("area", "diameter")), {}
        for (of_section,), (per_area,) in OF_SECTION:
            if given.isdisjoint((of_section, per_area)):
                value = getattr(self, f"section_{per_area}") if resized else getattr(self, per_area)
                properties |= {per_area: value} if value is not None else {of_section: getattr(self, of_section)}
        if not resized:
            properties |= {"area": self.area, "diameter": self.diameter}
        if not {"area", "diameter"} <= given | {key for key, value in properties.items() if value is not None}:
            properties["fill_factor"] = self.section_fill_factor
        properties["expansion"] = self.expansion
        stiffness_keys = {key for group in OF_SECTION[0] for key in group}
        if "state" in given and self.stress_strain and given.isdisjoint(stiffness_keys):  # else the cable is linear
            properties = {key: value for key, value in properties.items() if key not in stiffness_keys}
            properties["stress_strain"] = self.stress_strain
        return {key: value for key, value in properties.items() if value is not None and key not in given}


def _refuse_file_name(value):
    """The table of materials itself; the name of a file, which only a scene may have in its place, is refused."""
    if isinstance(value, str):
        raise wrong(f"expected a mapping of names, got {show(value)} (a file is named in the scene itself)")
    return value


Materials = Annotated[dict[MaterialName, Material], BeforeValidator(_refuse_file_name)]


@cache
def materials():
    """The built-in materials and ropes: name -> Material."""
    document = read_file(os.path.join(os.path.dirname(__file__), "materials.yaml"))
    return {name: Material.model_validate(entry) for name, entry in document.value.items()}


def known_materials(table):
    """Name -> Material of all that a scene may name: those of its own table over the built-in ones.

    An entry that is wrong is None, so that only its own mistakes are reported. `table` has the plain values of the key
    `materials` of the scene, or is anything else, which is ignored.
    """
    if not isinstance(table, dict):
        return materials()
    known = dict(materials())
    for name, entry in table.items():
        try:
            known[name] = Material.model_validate(entry)
        except ValidationError:
            known[name] = None
    return known
