"""Winches on the ends of cables: how they move these ends, and what they change of the loads on bodies.

Reeling in dL at an end of a cable moves that end out along its tangent by (1 + T/EA) dL, T being the tension there.
That is exact for the rest of the cable; the force at the winch itself is that of the place where the cable now ends,
which differs by the weight w dL of what was reeled in. As in the statics of a shorter cable, that piece is there no
more: its mass is not added to a body on which the winch stands.
"""

from dataclasses import dataclass

import numpy as np

from cablestudy.statics.suspension import GROUND, tangents
from cablestudy.system.superelement import NAMES

ENDS = ("from", "to")
FROM, TO = 0, 1


@dataclass(frozen=True)
class Winch:
    """A winch that reels in a cable, or moves its end."""

    cable: int
    end: int = FROM  # FROM or TO
    direction: np.ndarray | None = None  # unit vector along which it moves the end, global axes; None reels in [-]

    def name(self, cables):
        """Name of its input of a linear system, from the names of all cables."""
        return f"winch.{cables[self.cable]}"


class EndMovement(Winch):
    """Movement of a fixed end of a cable along x, y or z."""

    def name(self, cables):
        """Name of the movement as an input of a linear system, from the names of all cables."""
        return f"{cables[self.cable]}.{self._name_of_end}"

    def force(self, cables):
        """Name of the force that holds the end along the same axis."""
        return f"{cables[self.cable]}.force_{self._name_of_end}"

    @property
    def _name_of_end(self):
        """Name of end and axis, such as end_1_x, as of one cable."""
        return NAMES[3 * self.end + int(np.argmax(self.direction))]


class WinchedEnds:
    """Effect of winches on the ends of the c cables, of n suspensions ("rows") with equal names and connections.

    A winch that reels in v moves the end of its cable along the tangent t by (1 + T/EA) v, T being the tension there,
    and takes the weight of the length v off it. A winch that moves an end in a direction d displaces it by v d.

    Parameters
    ----------
    layouts : list of Layout
        Bodies and cables of each row.
    winches : list of (list of Winch)
        The i winches of each row. Those of equal index are on the same end of the same cable in all rows, and of the
        same kind.

    Attributes
    ----------
    direction : ndarray, shape (n, c, 2, 3)
        Unit tangents at both ends, which point out of the cables. [-]
    movements : ndarray, shape (n, 6 c, i)
        H: displacements of the six ends of all cables per movement of each winch. [-]
    lifted : ndarray, shape (n, 6 c, i)
        Forces on the ends of all cables per movement of each winch. A length that is reeled in no longer loads its end
        with its weight: a force upwards. [N/m]
    moments : ndarray, shape (n, 6 b, i)
        Loads on the b bodies and points per movement of each winch: moments d x F of the force F of the cable on the
        body, where a winch moves its end in a direction d. One that reels moves the end along F, without a moment. [N]
    """

    def __init__(self, layouts, winches):
        equilibria = [at.equilibrium for at in layouts]
        suspension = equilibria[0].suspension
        self._catenaries = [equilibrium.catenary for equilibrium in equilibria]
        forces = np.array([equilibrium.end_forces[suspension.of_cables] for equilibrium in equilibria])  # on bodies
        self.direction, self._tension = tangents(forces)
        (rows, cables, *_), bodies, count = forces.shape, len(suspension.body_names), len(winches[0])
        movements, lifted = np.zeros((2, rows, cables, 2, 3, count))  # by cable, end and axis
        moments = np.zeros((rows, bodies, 6, count))
        for column, of_rows in enumerate(zip(*winches, strict=True)):
            cable, end, direction = of_rows[0].cable, of_rows[0].end, of_rows[0].direction
            if direction is None:
                movements[:, cable, end, :, column] = self._movement_by_reeling(cable, end)
                lifted[:, cable, end, :, column] = [-at.end_loads[cable, end] for at in self._catenaries]
                continue
            directions = np.array([winch.direction for winch in of_rows])
            movements[:, cable, end, :, column] = directions
            body = suspension.owner[cable, end]
            if body != GROUND:
                moments[:, body, 3:, column] = np.cross(directions, forces[:, cable, end])
        self.movements = movements.reshape(rows, 6 * cables, count)
        self.lifted = lifted.reshape(rows, 6 * cables, count)
        self.moments = moments.reshape(rows, 6 * bodies, count)

    def _movement_by_reeling(self, cable, end):
        """Displacement of an end of a cable per length reeled in there, (1 + T/EA) t, shape (n, 3). [-]"""
        axial_stiffness = np.array([at.span.axial_stiffness[cable] for at in self._catenaries])
        stretch = 1 + self._tension[:, cable, end] / axial_stiffness
        return stretch[:, None] * self.direction[:, cable, end]

    def loads(self, connection, free):
        """Loads on bodies and points per movement of each winch, bodies and cables at rest, shape (n, d, i).

        By the weight that a winch takes off its own end, and by `moments`; G is `connection`, shape (n, 6 c, d).
        [N/m], [N]
        """
        return np.swapaxes(connection, -1, -2) @ self.lifted + self.moments[:, free]
