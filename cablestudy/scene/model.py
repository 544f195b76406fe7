"""The table `model` of a scene: how finely cables are computed."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from cablestudy.scene.fields import Count, KeyTable, Quantity

DEFAULT_ACCURACY = 1e-4
MAX_ELEMENTS = 1_000_000
MAX_ORDER = 64


class ModelTable(KeyTable):
    """How finely the cable is computed: to an accuracy (`elements` is None), or with exactly these elements."""

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
        """Blended mass is defined for bars."""
        message = f"blended needs order 1, and the order is {self.order} (use lumped or consistent)"
        yield [(("mass",), self.mass != "blended" or self.order == 1, lambda: message)]
