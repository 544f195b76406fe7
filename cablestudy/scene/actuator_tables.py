"""Reaction masses and reaction wheels on the bodies of a suspension: tables of the file as typed models, in SI."""

from typing import Annotated

from pydantic import Field

from cablestudy.scene.cable_table import Point as Place
from cablestudy.scene.fields import Either, KeyTable, Name, Quantity, wrong
from cablestudy.scene.suspension_tables import Direction

_HighPass = Annotated[float, Quantity("Hz", 1e-9, 1e9)]
LIMITS = ("stroke", "force", "momentum", "torque")


class _Actuator(KeyTable):
    """Keys of both kinds."""

    body: Name | None = Field(None, description="Which body it is on; needed where there are several bodies")
    axis: Direction = Field(description="Its direction, body axes, of any length but zero")
    high_pass: _HighPass | None = Field(None, description="Corner frequency below which its feedback does not act")

    def relations(self):
        """An axis has a direction."""
        yield [(("axis",), sum(part * part for part in self.axis) > 0, lambda: "the axis has no direction: all zero")]


class ReactionMass(_Actuator):
    """A mass on a spring along an axis, driven by a force between it and the body."""

    at: Place = Field((0.0, 0.0, 0.0), description="From the reference point, body axes")
    mass: Annotated[float, Quantity("kg", 1e-9, 1e15)] = Field(
        description="Reaction mass: its mass, a part of that of the body, whose mass and inertia include its actuators"
    )
    frequency: Annotated[float, Quantity("Hz", 1e-9, 1e9)] = Field(
        description="Reaction mass: frequency of the mass on its spring"
    )
    damping_ratio: Annotated[float, Quantity("", 0, 1e6)] = Field(
        0.5, description="Reaction mass: damping ratio of the mass on its spring"
    )
    velocity_gain: Annotated[float, Quantity("N s/m", -1e24, 1e24)] = Field(
        0.0, description="Reaction mass: force per velocity of the body along the axis"
    )
    position_gain: Annotated[float, Quantity("N/m", -1e24, 1e24)] = Field(
        0.0, description="Reaction mass: force per displacement of the body along the axis"
    )
    stroke: Annotated[float, Quantity("m", 1e-12, 1e9)] = Field(
        description="Reaction mass: largest displacement to either side"
    )
    force: Annotated[float, Quantity("N", 1e-24, 1e24)] = Field(description="Reaction mass: largest force")


class ReactionWheel(_Actuator):
    """A wheel on an axis, driven by a torque between it and the body."""

    inertia: Annotated[float, Quantity("kg m^2", 1e-24, 1e24)] = Field(
        description="Reaction wheel: inertia about its axis, a part of that of the body, which includes its wheels"
    )
    rate_gain: Annotated[float, Quantity("N m s/rad", -1e24, 1e24)] = Field(
        0.0, description="Reaction wheel: torque per angular velocity of the body about the axis"
    )
    momentum: Annotated[float, Quantity("N m s", 1e-24, 1e24)] = Field(
        description="Reaction wheel: largest angular momentum"
    )
    torque: Annotated[float, Quantity("N m", 1e-24, 1e24)] = Field(description="Reaction wheel: largest torque")


def is_wheel(value):
    """True if a mapping of the file is to be read as a reaction wheel."""
    return isinstance(value, dict) and "inertia" in value


def _read(value):
    if "mass" in value and "inertia" in value:
        raise wrong("mass is given together with inertia: a reaction mass has mass, a reaction wheel inertia")
    if "mass" not in value and "inertia" not in value:
        raise wrong("missing key: one of mass (a reaction mass), inertia (a reaction wheel)")
    return (ReactionWheel if is_wheel(value) else ReactionMass).model_validate(value)


Actuator = Annotated[
    ReactionMass | ReactionWheel,
    Either(
        ((dict, _read), ((ReactionMass, ReactionWheel), lambda value: value)),
        "a mapping with the key mass or inertia",
        ({"$ref": "#/$defs/ReactionMass"}, {"$ref": "#/$defs/ReactionWheel"}),
    ),
]
