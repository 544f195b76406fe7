"""The wind on one cable and on a suspension, and what bodies offer to it: the tables of the file, in SI."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field, StrictBool

from cablestudy.scene.cable_table import Position
from cablestudy.scene.fields import TRIPLE, Either, KeyTable, Quantity, reader_of, wrong
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show

Coefficient = Annotated[float, Quantity("", 1e-6, 1e6)]


def one_or_three(quantity, components):
    """The type of a `Quantity` that is one number, or three `components`; after reading a float or a tuple of three."""
    three = tuple[(Annotated[float, quantity],) * 3]
    options = Either.of_number(quantity), ((list, tuple), reader_of(three), {**TRIPLE, "items": quantity.schema()})
    return Annotated[Annotated[float, quantity] | three, Either(f"one number, or {components}", options)]


class WindTable(KeyTable):
    """Keys that the wind on one cable and that on a suspension have in common."""

    table: ClassVar[str] = "wind"

    speed: Annotated[float, Quantity("m/s", 1e-6, 1e6)] = Field(description="Mean speed")
    length_scale: Annotated[float, Quantity("m", 1e-9, 1e9)] = Field(description="Length scale of the turbulence")
    air_density: Annotated[float, Quantity("kg/m^3", 1e-12, 1e6)] = Field(1.2, description="Density of the air")
    spectrum: Literal["von_karman", "von_karman_exact", "davenport", "kaimal"] = Field(
        "von_karman", description="Spectrum of the speed"
    )
    admittance: Literal["vickery", "vickery_squared", "none"] = Field(
        "vickery", description="How much of the turbulence acts on the whole area simultaneously"
    )
    cable_drag_coefficient: Coefficient = Field(1.2, description="Drag coefficient of the cable, across the wind")
    duration: Annotated[float, Quantity("s", 1e-6, 1e12)] = Field(
        600.0, description="Time within which a peak is expected"
    )
    mean: StrictBool = Field(True, description="Whether the static displacement by the mean wind is taken into account")
    aerodynamic_damping: StrictBool = Field(True, description="Whether the drag damps the motion of what it acts on")


class Wind(WindTable):
    """The wind on the gondola and on the cable."""

    turbulence_intensity: Annotated[float, Quantity("", 1e-12, 1e6)] | None = Field(
        None, description="RMS over mean speed (instead of turbulence_rms)"
    )
    turbulence_rms: Annotated[float, Quantity("m/s", 1e-12, 1e6)] | None = Field(
        None, description="RMS of the speed (instead of turbulence_intensity)"
    )
    coherence_length: Annotated[float, Quantity("m", 1e-9, 1e12)] | None = Field(
        None, description="Coherence length of the turbulence along the cable (default: by frequency, IEC 61400-1)"
    )

    @property
    def turbulence(self):
        """RMS of the speed, given or from the intensity. [m/s]"""
        return self.turbulence_rms if self.turbulence_rms is not None else self.turbulence_intensity * self.speed

    @property
    def turbulence_along(self):
        """RMS of the speed along the mean wind; the name that `SuspensionWind` has for it too. [m/s]"""
        return self.turbulence


class _Direction(Quantity):
    """An angle in the horizontal plane."""

    def read(self, value):
        """Value -> float [rad]."""
        if isinstance(value, (list, tuple)):
            blows_up = len(value) == 3 and isinstance(value[2], (int, float)) and value[2] > 0
            reason = "a wind from below ground" if blows_up else f"got {show(value)}"
            raise wrong(f"{reason}: the mean wind is horizontal, and its direction an angle from x towards y")
        return super().read(value)


_ALONG_ACROSS = "[along, across, vertical]"
Intensity = one_or_three(Quantity("", 0, 1e6), _ALONG_ACROSS)
TurbulenceRms = one_or_three(Quantity("m/s", 0, 1e6), _ALONG_ACROSS)


class SuspensionWind(WindTable):
    """The wind on all bodies and cables of a suspension. Its mean is horizontal."""

    direction: Annotated[float, _Direction("rad", -2 * math.pi, 2 * math.pi, limits="from -360 deg to 360 deg")] = (
        Field(0.0, description="Where the mean wind blows to: angle from x towards y; a bare number is rad")
    )
    turbulence_intensity: Intensity | None = Field(
        None, description="RMS over mean speed, along the mean wind; or along, across, vertical"
    )
    turbulence_rms: TurbulenceRms | None = Field(
        None, description="RMS of the speed, along the mean wind; or along, across, vertical"
    )
    coherence_decay: Annotated[float, Quantity("", 0, 1e6, SCENE.least_positive)] = Field(
        10.0, description="C of the coherence exp(-C f d/U) at the distance d (Davenport)"
    )
    on: Literal["both", "bodies", "cables"] = Field("both", description="What the wind acts on")

    @property
    def turbulence(self):
        """Tuple of the RMS of the speed along the mean wind, across it and vertical. [m/s]"""
        written, factor = self.turbulence_rms, 1.0
        if written is None:
            written, factor = self.turbulence_intensity, self.speed
        components = written if isinstance(written, tuple) else (written, 0.0, 0.0)
        return tuple(factor * component for component in components)

    @property
    def turbulence_along(self):
        """RMS of the speed along the mean wind. [m/s]"""
        return self.turbulence[0]


Area = one_or_three(Quantity("m^2", 0, 1e12), "[along x, along y, along z]")


class BodyWind(KeyTable):
    """Areas and drag of a body in the wind."""

    area: Area = Field(description="Areas seen along the body axes x, y, z; one number is the area from all sides")
    drag_coefficient: Coefficient = Field(description="Drag coefficient of these areas")
    center_of_pressure: Position = Field((0.0, 0.0, 0.0), description="From the reference point, body axes")

    @property
    def areas(self):
        """Tuple of the areas seen along the body axes x, y, z. [m^2]"""
        return self.area if isinstance(self.area, tuple) else (self.area,) * 3
