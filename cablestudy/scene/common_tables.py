"""Tables that scenes of one cable and suspensions have alike: how finely cables are computed, the ground, imaging."""

from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from cablestudy.scene.cable_table import Coordinate
from cablestudy.scene.fields import LEAST, Count, Either, KeyTable, Name, Quantity, reader_of

DEFAULT_ACCURACY = 1e-4
MAX_ELEMENTS = 1_000_000
MAX_ORDER = 64

Exposure = Annotated[float, Quantity("s", 1e-12, 1e12)]
_level = Quantity("m", -1e9, 1e9)
_profile = reader_of(Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=2, max_length=10_000)])
Ground = Annotated[
    float | tuple,
    Either(
        (((int, float, str), _level.read), ((list, tuple), _profile)),
        "a level, or a list of [x, z]",
        (
            *_level.schema()["anyOf"],
            {"type": "array", "minItems": 2, "items": {"type": "array", "minItems": 2, "maxItems": 2}},
        ),
    ),
]


class SceneTable(KeyTable):
    """A scene of one cable or a suspension, with what follows alike from the keys of both."""

    no_case: ClassVar[KeyTable]  # load case of no temperature, ice, wind and loads

    gravity: Annotated[float, Quantity("m/s^2", 0, 1e6)] = Field(9.81, description="Acceleration of gravity, along -z")

    @property
    def load_case(self):
        """The chosen load case; without one `no_case`."""
        return self.no_case if self.case is None else self.cases[self.case]

    @property
    def nonzero_gravity(self):
        """Acceleration of gravity; None without any. [m/s^2]"""
        return None if isinstance(self.gravity, float) and self.gravity == 0 else self.gravity


class ModelTable(KeyTable):
    """Discretisation of cables: to an accuracy (`elements` is None), or with exactly these elements."""

    table: ClassVar[str] = "model"
    optional_groups: ClassVar[bool] = True

    accuracy: Annotated[float, Quantity("", 1e-20, 0.1)] | None = Field(
        None, description="Largest relative error: the cheapest model below it is used (default 1e-4)"
    )
    elements: Annotated[int, Count(1, MAX_ELEMENTS)] | None = Field(
        None, description="Exactly so many elements, without error control (instead of accuracy)"
    )
    order: Annotated[int, Count(1, MAX_ORDER)] = Field(1, description="Polynomial order of each element")
    mass: Literal["lumped", "consistent", "blended"] = Field("lumped", description="Mass of an element")

    @model_validator(mode="before")
    @classmethod
    def _default(cls, data):
        return {"accuracy": DEFAULT_ACCURACY} if data == {} else data

    def relations(self):
        """Relations: blended mass is defined for bars."""
        message = f"blended needs order 1, and the order is {self.order} (use lumped or consistent)"
        yield [(("mass",), self.mass != "blended" or self.order == 1, lambda: message)]


def ground_relations(ground):
    """The relation that the x of the points of a `Ground` ascend: a list as of `KeyTable.relations`."""
    if not isinstance(ground, tuple):
        return []
    ascends = all(point[0] < following[0] for point, following in pairwise(ground))
    return [(("ground",), ascends, lambda: "the x of its points must ascend")]


class Correction(KeyTable):
    """The tip/tilt/piston mirror that follows the motion."""

    bandwidth: Annotated[float, Quantity("Hz", 1e-9, 1e9)] = Field(description="Bandwidth of the correction")
    delay: Annotated[float, Quantity("s", 0, 1e6, LEAST)] = Field(
        0.0, description="Time between measurement and correction"
    )

    def relations(self):
        """Relations: the mirror's loop, an integrator with a delay, is stable."""
        highest = "an unstable mirror: with this delay it must be below 1/(4 delay) = {:.4g} Hz"
        yield [(("bandwidth",), 4 * self.bandwidth * self.delay < 1, lambda: highest.format(0.25 / self.delay))]


class MarkerCorrection(Correction):
    """The correction of a suspension, of the motion of one marker."""

    marker: Name = Field(description="Whose motion is corrected: BODY.MARKER")
