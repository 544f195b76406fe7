"""Check that actuators can be a part of their body: what remains of it without them has mass and inertia."""

from cablestudy.scene.actuator_tables import ReactionMass


def actuator_relations(scene):
    """The mass and the inertia of each body are above those of its actuators.

    Parameters
    ----------
    scene : SuspensionScene
        Each actuator on a body that exists.

    Yields
    ------
    tuple
        An item of a list of `Table.relations`.
    """
    rest = {name: _Rest(body) for name, body in scene.bodies.items()}
    for name, actuator in scene.actuators.items():
        owner = scene.body_of(actuator)
        left, inertia, path = rest[owner], scene.bodies[owner].inertia, ("actuators", name)
        if isinstance(actuator, ReactionMass):
            left.remove_mass(actuator)
            text = f"the reaction masses of {owner} together have its mass or more, of which they are a part"
            yield (*path, "mass"), left.mass > 0, lambda text=text: text
        else:
            left.remove_wheel(actuator)
            text = f"missing key: inertia (that of the wheel {name} is a part of it)"
            yield ("bodies", owner), inertia is not None, lambda text=text: text
        if inertia is not None:
            text = f"with it the actuators of {owner} have more inertia than {owner} itself, of which they are a part"
            yield path, left.has_inertia(), lambda text=text: text


class _Rest:
    """Mass, first moment and tensor of inertia of a body without its actuators, about the body's center of mass."""

    def __init__(self, body):
        self.center, self.mass, self.tensor = body.center_of_mass, body.mass, body.inertia_tensor
        self.moment = (0.0, 0.0, 0.0)

    def remove_mass(self, actuator):
        """Take away a reaction mass, a point mass."""
        arm = tuple(at - center for at, center in zip(actuator.at, self.center, strict=True))
        self.mass = self.mass - actuator.mass
        self.moment = tuple(moment - actuator.mass * part for moment, part in zip(self.moment, arm, strict=True))
        self.tensor = _less(self.tensor, actuator.mass, _about_origin(*arm))

    def remove_wheel(self, actuator):
        """Take away the inertia of a wheel about its axis, J a a^T."""
        x, y, z = actuator.axis
        square = x * x + y * y + z * z
        square = square + (square == 0)  # an axis without direction is refused elsewhere
        self.tensor = _less(self.tensor, actuator.inertia / square, (x * x, y * y, z * z, x * y, x * z, y * z))

    def has_inertia(self):
        """True if the tensor about the rest's own center of mass, times its mass, is positive definite."""
        entries = tuple(self.mass * entry for entry in self.tensor)
        xx, yy, zz, xy, xz, yz = _less(entries, 1.0, _about_origin(*self.moment))
        minor = xx * yy - xy * xy
        return (xx > 0) & (minor > 0) & (zz * minor - xx * yz * yz - yy * xz * xz + 2 * xy * xz * yz > 0)


def _about_origin(x, y, z):
    """Entries xx, yy, zz, xy, xz, yz of the tensor of a unit mass at a place."""
    return y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z


def _less(entries, factor, others):
    return tuple(entry - factor * other for entry, other in zip(entries, others, strict=True))
