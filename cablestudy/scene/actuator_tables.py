"""Reaction masses and reaction wheels on the bodies of a suspension: tables of the file as typed models, in SI.

They are a part of their body: what remains of the body without them must have mass and inertia.
"""

from typing import Annotated

from pydantic import Field

from cablestudy.scene.cable_table import Position
from cablestudy.scene.fields import Either, Frequency, KeyTable, Name, Quantity, wrong
from cablestudy.scene.suspension_tables import Direction

LIMITS = ("stroke", "force", "momentum", "torque")


class _Actuator(KeyTable):
    """Keys of both kinds."""

    body: Name | None = Field(None, description="Which body it is on; needed where there are several bodies")
    axis: Direction = Field(description="Its direction, body axes, of any length but zero")
    high_pass: Frequency | None = Field(None, description="Corner frequency below which its feedback does not act")

    def relations(self):
        """Relations: an axis has a direction."""
        yield [(("axis",), sum(part * part for part in self.axis) > 0, "the axis has no direction: all zero")]


class ReactionMass(_Actuator):
    """A mass on a spring along an axis, driven by a force between it and the body."""

    at: Position = Field((0.0, 0.0, 0.0), description="From the reference point, body axes")
    mass: Annotated[float, Quantity("kg", 1e-9, 1e15)] = Field(
        description="Reaction mass: its mass, a part of that of the body, whose mass and inertia include its actuators"
    )
    frequency: Frequency = Field(description="Reaction mass: frequency of the mass on its spring")
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


def _read_actuator(value):
    """ReactionMass or ReactionWheel of a mapping of the file."""
    if "mass" in value and "inertia" in value:
        raise wrong("mass is given together with inertia: a reaction mass has mass, a reaction wheel inertia")
    if "mass" not in value and "inertia" not in value:
        raise wrong("missing key: one of mass (a reaction mass), inertia (a reaction wheel)")
    return (ReactionWheel if is_wheel(value) else ReactionMass).model_validate(value)


Actuator = Annotated[
    ReactionMass | ReactionWheel,
    Either("a mapping with the key mass or inertia", (
        (dict, _read_actuator, {"$ref": "#/$defs/ReactionMass"}, {"$ref": "#/$defs/ReactionWheel"}),
    )),
]  # fmt: skip


def actuator_relations(scene):
    """Yield the relations, see `KeyTable.relations`, that bodies have more mass and inertia than the actuators on them.

    Mass and inertia of a body include those of its reaction masses and reaction wheels. Here the actuators are taken
    away one by one, with these conditions:

    - after a reaction mass: the mass that is left is positive;
    - after a reaction wheel: the body states its inertia;
    - after either, on a body that states its inertia: the tensor of inertia that is left is positive definite. Its
      reference point is the center of mass of what is left.

    Each actuator of the `SuspensionScene` is on a body that exists.
    """
    bare_bodies = {name: _BodyWithoutActuators(body) for name, body in scene.bodies.items()}
    for name, actuator in scene.actuators.items():
        owner = scene.body_of(actuator)
        bare_body, inertia, path = bare_bodies[owner], scene.bodies[owner].inertia, ("actuators", name)
        if isinstance(actuator, ReactionMass):
            bare_body.remove_mass(actuator)
            text = f"the reaction masses of {owner} together have its mass or more, of which they are a part"
            yield (*path, "mass"), bare_body.mass > 0, text
        else:
            bare_body.remove_wheel(actuator)
            text = f"missing key: inertia (that of the wheel {name} is a part of it)"
            yield ("bodies", owner), inertia is not None, text
        if inertia is not None:
            text = f"with it the actuators of {owner} have more inertia than {owner} itself, of which they are a part"
            yield path, bare_body.has_inertia(), text


class _BodyWithoutActuators:
    """Mass, first moment and tensor of inertia of a body less those of its actuators, about its center of mass."""

    def __init__(self, body):
        self.center, self.mass, self.tensor = body.center_of_mass, body.mass, body.inertia_tensor
        self.moment = (0.0, 0.0, 0.0)

    def remove_mass(self, actuator):
        """Take away a reaction mass, a point mass."""
        arm = tuple(at - center for at, center in zip(actuator.at, self.center, strict=True))
        self.mass = self.mass - actuator.mass
        self.moment = _subtract(self.moment, actuator.mass, arm)
        self.tensor = _subtract(self.tensor, actuator.mass, _point_mass_tensor(*arm))

    def remove_wheel(self, actuator):
        """Take away the inertia of a wheel about its axis, J a a^T."""
        x, y, z = actuator.axis
        square = x * x + y * y + z * z
        square = square + (square == 0)  # an axis without direction is refused elsewhere
        self.tensor = _subtract(self.tensor, actuator.inertia / square, (x * x, y * y, z * z, x * y, x * z, y * z))

    def has_inertia(self):
        """True if the tensor about the center of mass without actuators is positive definite.

        It is tested times the mass m, as m I - (tensor of a unit mass at the first moment), which needs no division.
        """
        scaled_tensor = tuple(self.mass * entry for entry in self.tensor)
        xx, yy, zz, xy, xz, yz = _subtract(scaled_tensor, 1.0, _point_mass_tensor(*self.moment))
        minor = xx * yy - xy * xy
        return (xx > 0) & (minor > 0) & (zz * minor - xx * yz * yz - yy * xz * xz + 2 * xy * xz * yz > 0)


def _point_mass_tensor(x, y, z):
    """Entries xx, yy, zz, xy, xz, yz of the tensor of inertia about the origin of a unit mass at (x, y, z)."""
    return y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z


def _subtract(entries, factor, others):
    """Entries minus a factor times others, one by one: tuple."""
    return tuple(entry - factor * other for entry, other in zip(entries, others, strict=True))
