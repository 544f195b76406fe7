"""The table `cable` of a scene: ends, material, section, length or tension, damping, loads."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from cablestudy.scene.fields import KeyTable, Quantity
from cablestudy.scene.load_tables import Load, ReferenceTable
from cablestudy.scene.section import Section, Tension, limited, of_each, within
from cablestudy.scene.tolerances import SCENE

NO_CURVES = "no effect: give stress_strain, or a material that has such curves and no stiffness besides"

Coordinate = Annotated[float, Quantity("m", -1e9, 1e9)]
Length = Annotated[float, Quantity("m", *SCENE.chord_range)]
Ratio = Annotated[float, Quantity("", 0, 2, SCENE.least_positive)]
Inclination = Annotated[
    float, Quantity("rad", -math.pi / 2, math.pi / 2, limits="from -90 deg to 90 deg (a bare number is rad)")
]
Position = tuple[Coordinate, Coordinate, Coordinate]


class DampingTable(KeyTable):
    """Damping of a cable. `model` follows from the parameter given; `viscous` alone means no other damping."""

    table: ClassVar[str] = "cable.damping"
    optional_groups: ClassVar[bool] = True
    parameters: ClassVar[dict[str, str]] = {"modal": "ratio", "hysteretic": "loss_factor", "kelvin_voigt": "time"}

    model: Literal["modal", "hysteretic", "kelvin_voigt"] = Field(
        "modal", description="By default that of the parameter given, else modal with a ratio of 0.01"
    )
    ratio: Ratio | None = Field(None, description="Modal: damping ratio of every mode")
    loss_factor: Ratio | None = Field(None, description="Hysteretic: axial stiffness EA (1 + i loss_factor)")
    time: Annotated[float, Quantity("s", 0, 1e12, SCENE.least_positive)] | None = Field(
        None, description="Kelvin-Voigt: axial stiffness EA (1 + i omega time)"
    )
    viscous: Annotated[float, Quantity("N s/m^2", 0, 1e6, SCENE.least_positive)] = Field(
        0.0, description="Force per length and velocity against all motion, with any model; alone: no other damping"
    )

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, data):
        """Add the model of the parameter given; without one, a modal ratio of 0.01, or 0 with `viscous` alone."""
        if not isinstance(data, dict):
            return data
        models = [model for model, parameter in cls.parameters.items() if parameter in data]
        if not models and data.get("model", "modal") == "modal":
            data = {**data, "ratio": 0.0 if "viscous" in data and "model" not in data else 0.01}
        return {"model": models[0] if models else "modal", **data}

    def relations(self):
        """Relations: the parameter is that of the model."""
        parameter = self.parameters[self.model]
        for model, name in self.parameters.items():
            message = f"belongs to the model {model}; the model is {self.model}, with {parameter}"
            yield [((name,), name == parameter or getattr(self, name) is None, message)]
        yield [((), getattr(self, parameter) is not None, f"missing key: {parameter} (the model is {self.model})")]


class CableProperties(Section):
    """Material, cross-section and damping of a cable, wherever it hangs."""

    damping: DampingTable = Field(DampingTable(), description="How the cable loses energy")

    @property
    def stated_preload(self):
        """The preload, given in newtons or as a share of the breaking force; or None. [N]"""
        return self.force_of(self.preload)


class TensionAt(KeyTable):
    """A tension at a named place of the cable."""

    at: Literal["end_1", "end_2", "horizontal", "mean", "max"] = Field(
        description="end_1, end_2, horizontal (its horizontal part), mean, or max (the largest)"
    )
    value: Tension = Field(description="The tension there, or its share of the breaking force")


class Cable(CableProperties):
    """The table `cable` of a scene of one cable."""

    table: ClassVar[str] = "cable"

    ends: tuple[Position, Position] | None = Field(None, description="End 1 and end 2, z up (instead of chord)")
    chord: Length | None = Field(None, description="Distance between the ends (instead of ends)")
    inclination: Inclination | None = Field(
        None, description="With chord: angle above the horizontal, end 2 higher when positive; a bare number is rad"
    )
    unstretched_length: Length | None = Field(None, description="Length without tension (instead of preload or sag)")
    preload: Tension | None = Field(
        None, description="Mean tension, or its share of the breaking force (instead of unstretched_length or sag)"
    )
    tension: TensionAt | None = Field(None, description="Tension at a named place (instead of preload)")
    reference: ReferenceTable = Field(
        ReferenceTable.model_construct(), description="The state in which preload, tension and sag hold"
    )
    sag: Annotated[float, Quantity("m", 1e-18, 1e9)] | None = Field(
        None, description="Vertical distance from chord to cable at mid-span (instead of unstretched_length or preload)"
    )
    loads: tuple[Load, ...] = Field((), max_length=SCENE.point_loads, description="Point loads on the cable")

    @property
    def stated_tension(self):
        """The value of `tension`, likewise; or None. [N]"""
        return None if self.tension is None else self.force_of(self.tension.value)

    @property
    def end_1(self):
        """Tuple of x, y, z of end 1; the origin when the chord is given. [m]"""
        return self.ends[0] if self.ends else (0.0, 0.0, 0.0)

    @property
    def end_2(self):
        """Tuple of x, y, z of end 2; in the plane y = 0 when the chord is given. [m]"""
        if self.ends:
            return self.ends[1]
        angle = 0.0 if self.inclination is None else self.inclination
        return (self.chord * of_each(_cosine, angle), 0.0, self.chord * of_each(math.sin, angle))

    @property
    def chord_length(self):
        """Distance of the ends, exactly as given when it is given. [m]"""
        if self.chord is not None:
            return self.chord
        return of_each(lambda *ends: math.dist(ends[:3], ends[3:]), *self.end_1, *self.end_2)

    @property
    def rise(self):
        """Height of end 2 above end 1. [m]"""
        return self.end_2[2] - self.end_1[2]

    def relations(self):
        """Ends apart, a length that fits them, loads on the cable, products within what the solvers can hold."""
        chord, length = self.chord_length, self.unstretched_length
        yield [(("ends",), chord > 0, "the two ends coincide")]
        yield [limited(("ends",), chord, SCENE.chord_range, "m", "the two ends are {:g} m apart".format)]
        state_has_curves = self.state is None or self.stress_strain is not None
        tensions = {("preload",): self.preload, ("tension", "value"): self.tension and self.tension.value}
        relations = [(("state",), state_has_curves, NO_CURVES)]
        relations += [*self.section_relations(), *self.tension_relations(tensions)]
        if length is not None:
            fits = within(length / chord, SCENE.length_ratio)
            relations.append((("unstretched_length",), fits, lambda: length_ratio_message(length, chord)))
        yield relations
        yield beyond_the_end(("loads",), self.loads, length)


def _cosine(angle):
    """Cosine of an angle [rad], 0 of the double nearest to a right angle, as a vertical cable shall be vertical."""
    return 0.0 if abs(angle) == math.pi / 2 else math.cos(angle)


def beyond_the_end(path, loads, length):
    """The relations that point loads are on a cable, if it states its unstretched length; a list as in `relations`."""
    message = "{:.10g} m is not on the cable, which is {:.10g} m long".format
    return [
        ((*path, index, "at"), load.at < length, lambda at=load.at: message(at, length))
        for index, load in enumerate(loads)
        if length is not None and load.at is not None
    ]


def length_ratio_message(length, chord):
    """Message: an unstretched length is far from the distance of the ends; with a guess, had it been in mm or km."""
    guesses = [g for g in (length * 1000, length / 1000) if within(g / chord, SCENE.likely_length_ratio)]
    hint = f"; did you mean {guesses[0]:.10g} m?" if guesses else ""
    ratio, allowed = f"{length / chord:.3g} times the distance of the ends, {chord:.10g} m", "{:g} to {:g} times"
    return f"{length:.10g} m is {ratio} (allowed: {allowed.format(*SCENE.length_ratio)}{hint})"
