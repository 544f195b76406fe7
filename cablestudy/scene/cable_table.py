"""The table `cable` of a scene: where it hangs, what it is made of, how long or tight, how damped, how loaded."""

import math
import os
from functools import cache
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from cablestudy.scene.document import read_file
from cablestudy.scene.fields import Quantity, Word, suggestion, wrong
from cablestudy.scene.tables import Table
from cablestudy.scene.units import show

MAX_LOADS = 1000
# Unstretched length over chord: outside of this it is a slip, not a cable.
LENGTH_RATIO = (0.2, 200.0)
_LIKELY_RATIO = (0.5, 5.0)
# Beyond any cable by many powers of ten; outside of this squares of forces and frequencies leave the range of a double.
STIFFNESS_RANGE = (1e-12, 1e24)
MASS_RANGE = (1e-18, 1e12)
CHORD_RANGE = (1e-9, 1e12)
PRESTRAIN_RANGE = (1e-18, 10.0)
MAX_FORCE = 1e30
MAX_VISCOUS = 1e6

Coordinate = Annotated[float, Quantity("m")]
Length = Annotated[float, Quantity("m", positive=True)]
Area = Annotated[float, Quantity("m^2", positive=True)]
Stress = Annotated[float, Quantity("Pa", positive=True)]
Density = Annotated[float, Quantity("kg/m^3", positive=True)]
Tension = Annotated[float, Quantity("N", positive=True)]
Force = Annotated[float, Quantity("N")]
Inclination = Annotated[
    float, Quantity("rad", low=-math.pi / 2, high=math.pi / 2, bounds="from -90 deg to 90 deg (a bare number is rad)")
]
Point = tuple[Coordinate, Coordinate, Coordinate]


@cache
def materials():
    """The table of materials: name -> {elastic_modulus [Pa], density [kg/m^3], strength [Pa]}."""
    return read_file(os.path.join(os.path.dirname(__file__), "materials.yaml")).value


def _written(limits):
    return f"{limits[0]:g} to {limits[1]:g}"


class _Material(Word):
    """The name of a material; the table is read when the first one is met."""

    def __init__(self):
        super().__init__(())

    def read(self, value):
        """Value -> the same name."""
        if not isinstance(value, str) or value not in materials():
            raise wrong(f"unknown material {show(value)} ({suggestion(value, materials())})")
        return value

    def schema(self):
        """JSON Schema."""
        return {"enum": list(materials())}


class Damping(Table):
    """How the cable loses energy.

    Attributes
    ----------
    model : str
        `modal`, `hysteretic` or `kelvin_voigt`; by default that of the parameter given, else `modal`.
    ratio : float or None
        Modal damping ratio; by default 0.01, or 0 when nothing but `viscous` is given. [-]
    loss_factor : float or None
        Hysteretic: EA (1 + i loss_factor). [-]
    time : float or None
        Kelvin-Voigt: EA (1 + i omega time). [s]
    viscous : float
        Force per length and velocity against all motion of the cable, in addition to the model. [N s/m^2]
    """

    table: ClassVar[str] = "cable.damping"
    optional_groups: ClassVar[bool] = True
    parameters: ClassVar[dict[str, str]] = {"modal": "ratio", "hysteretic": "loss_factor", "kelvin_voigt": "time"}

    model: Annotated[str, Word(("modal", "hysteretic", "kelvin_voigt"))] = Field(
        "modal", description="How the cable loses energy; follows from the parameter when it is not given"
    )
    ratio: Annotated[float, Quantity("", low=0, high=2)] | None = Field(
        None, description="Modal: damping ratio of every mode"
    )
    loss_factor: Annotated[float, Quantity("", low=0, high=2)] | None = Field(
        None, description="Hysteretic: axial stiffness EA (1 + i loss_factor)"
    )
    time: Annotated[float, Quantity("s", low=0)] | None = Field(
        None, description="Kelvin-Voigt: axial stiffness EA (1 + i omega time)"
    )
    viscous: Annotated[float, Quantity("N s/m^2", low=0, high=MAX_VISCOUS)] = Field(
        0.0, description="Force per length and velocity against all motion, with any model; alone: no other damping"
    )

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, data):
        if not isinstance(data, dict):
            return data
        if "model" not in data:
            named = [model for model, parameter in cls.parameters.items() if parameter in data]
            viscous_alone = not named and "viscous" in data
            data = {"model": named[0] if named else "modal", **({"ratio": 0.0} if viscous_alone else {}), **data}
        return {"ratio": 0.01, **data} if data["model"] == "modal" and not cls._has_parameter(data) else data

    @classmethod
    def _has_parameter(cls, data):
        return any(parameter in data for parameter in cls.parameters.values())

    def together(self):
        """The parameter is that of the model."""
        wanted = self.parameters[self.model]
        for model, parameter in self.parameters.items():
            if parameter != wanted and getattr(self, parameter) is not None:
                yield (parameter,), f"belongs to the model {model}; the model is {self.model}, with {wanted}"
                return
        if getattr(self, wanted) is None:
            yield (), f"missing key: {wanted} (the model is {self.model})"


class Load(Table):
    """A point load.

    Attributes
    ----------
    at : float
        Arc length from end 1 along the unstretched cable. [m]
    force : tuple of 3 float
        Along x, y, z (z up). [N]
    """

    at: Length = Field(description="Arc length from end 1 along the unstretched cable")
    force: tuple[Force, Force, Force] = Field(description="Force along x, y, z (z up)")


class Cable(Table):
    """The cable. Of each group of alternatives the others are None; everything in SI.

    Attributes
    ----------
    ends : tuple of two points or None
        | chord. End 1 and end 2. [m]
    chord, inclination : float or None
        | ends. Distance of the ends [m] and angle above the horizontal, end 2 higher when positive [rad].
    material : str or None
        Name in materials.yaml; gives what follows unless that is given too.
    elastic_modulus, density : float
        [Pa], [kg/m^3]
    strength : float or None
        [Pa]
    area, diameter : float or None
        Exactly one. [m^2], [m]
    unstretched_length, preload, sag : float or None
        Exactly one; preload is the mean tension. [m], [N], [m]
    damping : Damping
    loads : tuple of Load
    """

    table: ClassVar[str] = "cable"

    ends: tuple[Point, Point] | None = Field(None, description="End 1 and end 2, z up (instead of chord)")
    chord: Length | None = Field(None, description="Distance of the ends (instead of ends)")
    inclination: Inclination | None = Field(
        None, description="With chord: angle above the horizontal, end 2 higher when positive; a bare number is rad"
    )
    material: Annotated[str, _Material()] | None = Field(
        None, description="Name in the table of materials: for elastic_modulus, density, strength not given here"
    )
    elastic_modulus: Stress = Field(description="Elastic modulus of the cross-section")
    density: Density = Field(description="Mass per volume")
    strength: Stress | None = Field(None, description="Stress at which the cable breaks, for utilisation")
    area: Area | None = Field(None, description="Area of the cross-section (instead of diameter)")
    diameter: Length | None = Field(None, description="Diameter of a round solid cross-section (instead of area)")
    unstretched_length: Length | None = Field(None, description="Length without tension (instead of preload or sag)")
    preload: Tension | None = Field(None, description="Mean tension (instead of unstretched_length or sag)")
    sag: Length | None = Field(
        None, description="Vertical distance from chord to cable at mid-span (instead of unstretched_length or preload)"
    )
    damping: Damping = Field(Damping(), description="How the cable loses energy")
    loads: tuple[Load, ...] = Field((), max_length=MAX_LOADS, description="Point loads on the cable")

    @model_validator(mode="before")
    @classmethod
    def _of_material(cls, data):
        """What the material gives and the file does not."""
        name = data.get("material") if isinstance(data, dict) else None
        return {**materials()[name], **data} if isinstance(name, str) and name in materials() else data

    @property
    def end_1(self):
        """Tuple of x, y, z of end 1; the origin when the chord is given. [m]"""
        return self.ends[0] if self.ends else (0.0, 0.0, 0.0)

    @property
    def end_2(self):
        """Tuple of x, y, z of end 2; in the plane y = 0 when the chord is given. [m]"""
        if self.ends:
            return self.ends[1]
        angle = self.inclination or 0.0
        # The cosine of the double nearest to 90 degrees is 6e-17: a vertical cable shall be vertical.
        cosine = 0.0 if abs(angle) == math.pi / 2 else math.cos(angle)
        return (self.chord * cosine, 0.0, self.chord * math.sin(angle))

    @property
    def chord_length(self):
        """Distance of the ends, exactly as given when it is given. [m]"""
        return self.chord if self.chord is not None else math.dist(*self.ends)

    @property
    def rise(self):
        """Height of end 2 above end 1. [m]"""
        return self.end_2[2] - self.end_1[2]

    @property
    def section_area(self):
        """Area of the cross-section, given or pi d^2 / 4. [m^2]"""
        return self.area if self.area is not None else math.pi * self.diameter**2 / 4

    @property
    def section_diameter(self):
        """Diameter, given or that of the circle of equal area. [m]"""
        return self.diameter if self.diameter is not None else math.sqrt(4 * self.area / math.pi)

    @property
    def axial_stiffness(self):
        """Elastic modulus times area, EA. [N]"""
        return self.elastic_modulus * self.section_area

    @property
    def mass_per_length(self):
        """Mass per unstretched length, rho A. [kg/m]"""
        return self.density * self.section_area

    def together(self):
        """Ends apart, a length that fits them, loads on the cable, products that a number can hold."""
        chord = self.chord_length
        if chord == 0:
            yield ("ends",), "the two ends coincide"
        elif not CHORD_RANGE[0] <= chord <= CHORD_RANGE[1]:
            key = "ends" if self.ends else "chord"
            yield (key,), f"the two ends are {chord:g} m apart: out of range ({_written(CHORD_RANGE)} m)"
        elif self.unstretched_length is not None:
            yield from self._length_mistakes(chord)
        for name, value, limits, unit in (
            ("elastic_modulus", self.axial_stiffness, STIFFNESS_RANGE, "N"),
            ("density", self.mass_per_length, MASS_RANGE, "kg/m"),
        ):
            if not limits[0] <= value <= limits[1]:
                message = f"times the area of the cross-section is {value:g} {unit}: out of range"
                yield (name,), f"{message} ({_written(limits)} {unit})"
        strain = self.preload / self.axial_stiffness if self.preload and self.axial_stiffness else 1.0
        if not PRESTRAIN_RANGE[0] <= strain <= PRESTRAIN_RANGE[1]:
            message = f"{self.preload:g} N is {strain:.3g} times the elastic modulus times the area: out of range"
            yield ("preload",), f"{message} ({_written(PRESTRAIN_RANGE)} times)"
        for index, load in enumerate(self.loads):
            if max(map(abs, load.force)) > MAX_FORCE:
                yield ("loads", index, "force"), f"out of range (at most {MAX_FORCE:g} N)"

    def _length_mistakes(self, chord):
        """An unstretched length far from the chord, loads beyond it."""
        length, (low, high) = self.unstretched_length, LENGTH_RATIO
        if not low <= length / chord <= high:
            guesses = [g for g in (length * 1000, length / 1000) if _LIKELY_RATIO[0] <= g / chord <= _LIKELY_RATIO[1]]
            hint = f"; did you mean {guesses[0]:.10g} m?" if guesses else ""
            yield (
                ("unstretched_length",),
                f"{length:.10g} m is {length / chord:.3g} times the distance of the ends, {chord:.10g} m "
                f"(allowed: {low:g} to {high:g} times{hint})",
            )
            return
        for index, load in enumerate(self.loads):
            if load.at >= length:
                yield ("loads", index, "at"), f"{load.at:.10g} m is not on the cable, which is {length:.10g} m long"
