"""Tables of the file, in SI: loads on a cable besides its weight, and the state in which its length is stated."""

import math
from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field, StrictBool

from cablestudy.scene.fields import TRIPLE, Either, KeyTable, Name, Quantity, reader_of, wrong
from cablestudy.scene.tolerances import SCENE

ICE_DENSITY = 900.0  # [kg/m^3]

Angle = Annotated[
    float, Quantity("rad", -2 * math.pi, 2 * math.pi, limits="from -360 deg to 360 deg (a bare number is rad)")
]
Force = Annotated[float, Quantity("N", -1e24, 1e24)]
ForceVector = tuple[Force, Force, Force]
Moment = Annotated[float, Quantity("N m", -1e24, 1e24)]
Shift = Annotated[float, Quantity("m", -1e9, 1e9)]
ShiftVector = tuple[Shift, Shift, Shift]
NONE = (0.0, 0.0, 0.0)
# a bare number below the lowest is one in degrees Celsius by mistake
Temperature = Annotated[
    float, Quantity("K", 60, 5000, limits="from 60 K to 5000 K (a bare number is K: write 15 degC)")
]


class Load(KeyTable):
    """A point load: a force, a mass that hangs there and moves along, or both."""

    table: ClassVar[str] = "load"

    at: Annotated[float, Quantity("m", 1e-9, 1e9)] | None = Field(
        None, description="Arc length from end 1 along the unstretched cable (instead of fraction)"
    )
    fraction: Annotated[float, Quantity("", 1e-12, 1 - 1e-12, limits="between 0 and 1")] | None = Field(
        None, description="Share of the unstretched length from end 1 (instead of at)"
    )
    force: ForceVector | None = Field(None, description="Force along x, y, z (z up)")
    mass: Annotated[float, Quantity("kg", 1e-12, 1e15)] | None = Field(
        None, description="Mass: its weight is a load, its inertia takes part in all motion"
    )

    def relations(self):
        """Relations: a force, a mass, or both."""
        has_load = self.force is not None or self.mass is not None
        yield [((), has_load, "missing key: force, mass, or both")]


def load_name(cable, number):
    """Name of a point load by its number on its cable, from 1 in the order of the file: load1, or CABLE.load1.

    `cable`: the name of a cable of a suspension, or an empty text.
    """
    return f"{cable}.load{number}".lstrip(".")


def paths_of_loads(cable, *tables):
    """Name of each point load on a cable -> its path in the scene, a dict; `cable` is as in `load_name`.

    `tables` are the lists of loads on it, each the path of the list and the list.
    """
    paths = [(*path, str(index)) for path, loads in tables for index in range(len(loads))]
    return {load_name(cable, number): path for number, path in enumerate(paths, 1)}


class Ice(KeyTable):
    """Ice, or any other load per length that hangs on the cable."""

    table: ClassVar[str] = "ice"

    thickness: Annotated[float, Quantity("m", 0, 1e3)] | None = Field(
        None, description="Thickness of a layer all around, which widens the cable in the wind (instead of weight)"
    )
    density: Annotated[float, Quantity("kg/m^3", 1e-9, 1e6)] = Field(ICE_DENSITY, description="Density of that layer")
    weight: Annotated[float, Quantity("N/m", 0, 1e18)] | None = Field(
        None, description="Weight per unstretched length (instead of thickness)"
    )
    lift_slope: Annotated[float, Quantity("", -1e6, 1e6)] | None = Field(
        None, description="Slope dC_L/dalpha of the lift of the iced cable over the angle of attack in rad: galloping"
    )
    drag_coefficient: Annotated[float, Quantity("", 0, 1e6)] = Field(
        1.2, description="With lift_slope: drag coefficient of the iced cable, on the same width"
    )


class SteadyWind(KeyTable):
    """A horizontal wind that does not change in time."""

    table: ClassVar[str] = "steady_wind"

    speed: Annotated[float, Quantity("m/s", 0, 1e6)] | None = Field(
        None, description="Wind speed (instead of pressure)"
    )
    pressure: Annotated[float, Quantity("Pa", 0, 1e18)] | None = Field(
        None, description="Dynamic pressure, rho/2 v^2 (instead of speed)"
    )
    direction: Angle = Field(0.0, description="Where it blows to: angle from x towards y; a bare number is rad")
    air_density: Annotated[float, Quantity("kg/m^3", 1e-12, 1e6)] = Field(
        1.2, description="With speed: density of the air"
    )
    cable_drag_coefficient: Annotated[float, Quantity("", 0, 1e6)] = Field(
        1.2, description="Drag coefficient of the cable, across the wind"
    )
    at: Annotated[float, Quantity("m", 1e-3, 1e9)] | None = Field(
        None, description="Height above the ground at which it has this speed or pressure; default: at all heights"
    )
    exponent: Annotated[float, Quantity("", 0, 1)] | None = Field(
        None, description="With at: the speed is that at this height times (height/at)^exponent, none below the ground"
    )
    gust_factor: Annotated[float, Quantity("", 1e-3, 1e3)] = Field(
        1.0, description="Factor of the speed; of the pressure its square"
    )

    @property
    def dynamic_pressure(self):
        """Pressure given, or rho/2 v^2, times the square of the gust factor; at the height that is stated. [Pa]"""
        without_gust = self.pressure if self.pressure is not None else self.air_density / 2 * self.speed**2
        return without_gust * self.gust_factor**2

    def relations(self):
        """Relations: the height of a speed and the exponent go together."""
        given, missing = ("at", "exponent") if self.exponent is None else ("exponent", "at")
        both_or_none = (self.at is None) == (self.exponent is None)
        yield [((), both_or_none, f"missing key: {missing} ({given} goes with it)")]


class CommonLoadCase(KeyTable):
    """Effects of a load case on every cable; unstretched lengths are those of the reference state."""

    temperature: Temperature | None = Field(
        None, description="Temperature of the cable; by default that of the reference state"
    )
    ice: Ice | None = Field(None, description="Ice, or any other load per length")
    wind: SteadyWind | None = Field(None, description="Steady wind on cables, and on the gondola or the bodies")

    def elongation(self, cable):
        """Relative change of the unstretched length of a cable by the temperature. [-]"""
        if self.temperature is None or cable.expansion is None:
            return 0.0
        return cable.expansion * (self.temperature - cable.reference.temperature)

    def wind_diameter(self, cable):
        """Diameter of a cable with the ice around it, which the wind sees; None where it is unknown. [m]"""
        diameter, ice = cable.section_diameter, self.ice
        if diameter is None or ice is None or ice.thickness is None:
            return diameter
        return diameter + 2 * ice.thickness

    def needs_of(self, cable, path, name):
        """Relations, as in `KeyTable.relations`, that a cable at a path has what this load case, of this name, needs.

        Wind, and ice of a thickness, need the diameter; a temperature needs the coefficient of expansion, or the
        stress-strain curves of a conductor.
        """
        needs_diameter = self.wind is not None or (self.ice is not None and self.ice.thickness is not None)
        has_diameter = cable.section_diameter is not None
        has_expansion = cable.expansion is not None or cable.stress_strain is not None
        no_diameter = f"missing key: diameter (case {name} has wind or ice around the cable)"
        no_expansion = f"missing key: expansion (case {name} has a temperature)"
        return [
            (path, not needs_diameter or has_diameter, no_diameter),
            (path, self.temperature is None or has_expansion, no_expansion),
        ]


class EndForces(KeyTable):
    """Forces on the ends of one cable, as far as these are free to move."""

    end_2: ForceVector = Field(NONE, description="On the gondola, along x, in which it is free to move")

    def relations(self):
        """Relations: the gondola is held along y and z."""
        held = not any(self.end_2[1:])
        yield [(("end_2",), held, "end 2 is free along x only: the forces along y and z must be 0")]


class EndMoves(KeyTable):
    """Displacements of the ends of one cable."""

    end_1: ShiftVector = Field(NONE, description="Displacement of end 1 along x, y, z")
    end_2: ShiftVector = Field(NONE, description="Displacement of end 2 along x, y, z")


class LoadCase(CommonLoadCase):
    """A load case of a scene of one cable."""

    forces: EndForces = Field(
        EndForces.model_construct(), description="Forces on the gondola, with the lengths of the reference state"
    )
    moves: EndMoves = Field(EndMoves.model_construct(), description="Displacements of the ends, with the same lengths")

    loads: tuple[Load, ...] = Field(
        (), max_length=SCENE.point_loads, description="Point loads in addition to those of the cable"
    )


def _refuse_list(value):
    """The loads of a case, by cable; a bare list, right for one cable, is refused."""
    if isinstance(value, list):
        raise wrong("expected a mapping of cable -> list of loads, got a list")
    return value


class DeadLoad(KeyTable):
    """A force, and a moment on a body, in global axes; a bare vector in the file is a force."""

    bare: ClassVar[str] = "force"

    force: ForceVector = Field(NONE, description="Force along x, y, z (z up)")
    moment: tuple[Moment, Moment, Moment] = Field(NONE, description="Moment about x, y, z; of a body only")


_force = reader_of(ForceVector)
ForceOrLoad = Annotated[
    DeadLoad | ForceVector,
    Either("a force [x, y, z], or a mapping with the keys force, moment", (
        ((list, tuple), lambda value: DeadLoad(force=_force(value)), TRIPLE), Either.of_table(DeadLoad),
    )),
]  # fmt: skip
Names = Annotated[tuple[Name, ...], Field(min_length=1)]


class IceOnCables(Ice):
    """Ice on the cables of a suspension, or on some of them."""

    on: Names | None = Field(None, description="Names of the cables that carry it; default: all")


class SteadyWindOn(SteadyWind):
    """A steady wind on the cables and bodies of a suspension, or on some of them."""

    on: Names | None = Field(None, description="Names of the cables and bodies on which it acts; default: all")


class SuspensionLoadCase(CommonLoadCase):
    """A load case of a suspension."""

    ice: IceOnCables | None = Field(None, description="Ice, or any other load per length")
    wind: SteadyWindOn | None = Field(None, description="Steady wind on cables and bodies")
    lost: tuple[Name, ...] = Field(
        (), description="Names of cables that are absent (broken), with their mass and wind load"
    )

    forces: dict[Name, ForceOrLoad] = Field(
        {}, description="Name of a free point, a body or BODY.MARKER -> force [x, y, z], or {force, moment} of a body"
    )
    moves: dict[Name, ShiftVector] = Field(
        {}, description="Name of a fixed point, or of a body as far as it is held -> displacement [x, y, z]"
    )

    loads: Annotated[
        dict[Name, Annotated[tuple[Load, ...], Field(max_length=SCENE.point_loads)]], BeforeValidator(_refuse_list)
    ] = Field({}, description="Name of a cable -> point loads in addition to those of the cable")

    @property
    def listed(self):
        """`ice`, `wind` -> names of the cables and bodies that it is on; a key only where names are listed: dict."""
        tables = {"ice": self.ice, "wind": self.wind}
        return {key: table.on for key, table in tables.items() if table is not None and table.on is not None}

    def of_cable(self, name):
        """Copy of the case for one cable, by its name: without ice and wind that are on other ones."""
        absent = [key for key, names in self.listed.items() if name not in names]
        return self.model_copy(update=dict.fromkeys(absent)) if absent else self


class ReferenceTable(KeyTable):
    """The state in which preload, tension and sag of a cable hold."""

    temperature: Temperature = Field(288.15, description="Temperature of the cable, also where a case gives none")
    loads: StrictBool = Field(False, description="Whether the point loads of the cable act in it")
