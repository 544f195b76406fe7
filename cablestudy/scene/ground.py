"""The ground under the cables, over which they have a clearance."""

from itertools import pairwise
from typing import Annotated

from pydantic import Field, TypeAdapter

from cablestudy.scene.cable_table import Coordinate
from cablestudy.scene.fields import Either, Quantity

_level = Quantity("m", -1e9, 1e9)
_profile = TypeAdapter(
    Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=2, max_length=10_000)]
).validate_python
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


def ground_relations(ground):
    """The relations that the x of the points of a `Ground` ascend; a list as of `Table.relations`."""
    if not isinstance(ground, tuple):
        return []
    rising = all(one[0] < other[0] for one, other in pairwise(ground))
    return [(("ground",), rising, lambda: "the x of its points must ascend")]
