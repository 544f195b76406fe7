"""Tables of the file, in SI: the curves of a conductor that stretches for good, by part."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from cablestudy.scene.fields import KeyTable, Quantity

PERCENT = 0.01
TERMS = 5  # coefficients of a curve
MEASURED, LEAST = 0.5, 0.2  # strain to which curves are measured, and to which they must rise at least [%]
CHECKED = 50  # steps up to it
FLAT = 0.05  # slope over that at zero strain: a curve that gets flatter goes on along its tangent
UNITS = {"psi": 6894.757293168361, "MPa": 1e6, "Pa": 1.0}  # [Pa]
# modulus at zero strain over the final one, both over the whole area: beyond, something is in another unit
LIKELY_START = (0.25, 4.0)
STATES = ("initial", "after_load", "after_creep", "final")
State = Literal[STATES]

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
    expansion: Annotated[float, Quantity("1/K", -1e-2, 1e-2)] = Field(
        description="Coefficient of thermal expansion of the part"
    )
    area_share: Annotated[float, Quantity("", 1e-6, 1, limits="above 0 and at most 1")] | None = Field(
        None, description="Area of the part over the metallic area (of the other part: what remains)"
    )

    def relations(self):
        """Relations: its curves rise as far as they are used, and are above zero there."""
        for key in ("initial", "creep"):
            if (curve := getattr(self, key)) is not None:
                end = end_of(curve)
                flat = f"the curve must rise to a strain of {LEAST:g} % at least; it does not at {end:.2g} %"
                slack = f"the curve has no tension up to a strain of {end:.2g} %"
                yield [((key,), end >= LEAST, lambda flat=flat: flat)]
                yield [((key,), _stress_and_slope(curve, end)[0] > 0, lambda slack=slack: slack)]


def end_of(curve):
    """Strain from which a curve goes on along its tangent: MEASURED, or before it gets flat. [%]"""
    strains = [MEASURED * step / CHECKED for step in range(CHECKED + 1)]
    least_slope = FLAT * abs(curve[1])
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
        yield [(("outer", "area_share"), core_or_all, lambda: "without a core the outer strands are all of the area")]
        for name in self.parts:
            initial_modulus = self.coefficients(name, "initial")[0][1]
            ratio = initial_modulus / self.final_modulus(name)
            low, high = LIKELY_START
            message = (
                f"the curve begins at {initial_modulus / 1e9:.3g} GPa, {ratio:.2g} times the final modulus over the "
                f"whole area (allowed: {low:g} to {high:g}; coefficients are in {self.unit} per percent^k: see unit)"
            )
            yield [((name, "initial"), low <= ratio <= high, lambda message=message: message)]


def loaded_by_a_case(path, cable, cases):
    """The relation that a conductor after load has load cases, of which the heaviest has stretched it."""
    has_cases = bool(cases) or cable.conductor_state != "after_load"
    return (*path, "state"), has_cases, lambda: "after_load: missing key: cases, of which the heaviest stretches it"
