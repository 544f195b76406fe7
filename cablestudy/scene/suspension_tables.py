"""Points, bodies, cables, tensions and winches of a suspension: the tables of the file as typed models, in SI."""

from functools import partial
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, StrictBool

from cablestudy.scene.cable_table import CableProperties, Length, Position, TensionAt, beyond_the_end
from cablestudy.scene.connections import wrong_name
from cablestudy.scene.determinacy import MOTIONS, ROTATIONS, STATED
from cablestudy.scene.fields import TEXT, TRIPLE, Either, KeyTable, Name, Quantity, each_once, reader_of, wrong
from cablestudy.scene.load_tables import Angle, ForceVector, Load, Moment, ReferenceTable
from cablestudy.scene.section import Tension as StatedTension
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.units import show
from cablestudy.scene.wind_tables import BodyWind

# Where a tension is stated -> what of `statics.suspension.STATED` that is.
TENSION_KINDS = {
    "mean": "preload", "end_1": "tension_from", "end_2": "tension_to", "horizontal": "horizontal_tension",
    "max": "max_tension",
}  # fmt: skip
NO_DIRECTION = "the direction has no length: all zero"
NO_MASS = "no mass has this tensor: its principal moments must be positive, and none above the sum of the other two"

Angles = tuple[Angle, Angle, Angle]
_Component = Annotated[float, Quantity("", -1e6, 1e6)]
Direction = tuple[_Component, _Component, _Component]
Inertia = Annotated[float, Quantity("kg m^2", -1e24, 1e24)]
_tension = Quantity("N", 1e-24, 1e24)
Tension = Annotated[float, _tension]
ForceDensity = Annotated[float, Quantity("N/m", 1e-24, 1e24)]

_position = reader_of(Position)


def _check_free(value):
    """The word `free` itself; any other is refused."""
    if value != "free":
        raise wrong(f"expected [roll, pitch, yaw], or free, got {show(value)}")
    return value


def _check_entries(value):
    """The entries of a tensor of inertia themselves; refused where they are neither 3 nor 6."""
    if len(value) not in (3, 6):
        raise wrong(f"expected 3 entries (xx yy zz) or 6 (xx yy zz xy xz yz), got {len(value)}")
    return value


class PointTable(KeyTable):
    """A place that a cable may end at, fixed or free to move; a bare place in the file is a fixed one."""

    bare: ClassVar[str] = "at"

    at: Position = Field(description="Position; of a free point where the search begins")
    free: StrictBool = Field(
        False, description="True for a junction of cables, whose position follows from equilibrium"
    )
    mass: Annotated[float, Quantity("kg", 0, 1e15)] = Field(0.0, description="Mass of a free point")
    force: ForceVector = Field((0.0, 0.0, 0.0), description="Dead load on a free point")

    def relations(self):
        """Relations: mass and force belong to a free point."""
        message = "belongs to a free point: this one is fixed (free: true lets it move)"
        given = [name for name in ("mass", "force") if name in self.model_fields_set]
        yield [((name,), self.free, message) for name in given]


PointOrPosition = Annotated[
    PointTable | Position,
    Either("a place [x, y, z], or a mapping with the keys at, free, mass, force", (
        ((list, tuple), lambda position: PointTable(at=_position(position)), TRIPLE), Either.of_table(PointTable),
    )),
]  # fmt: skip


_angles_schema = {**TRIPLE, "items": Quantity("rad", -6.2831853, 6.2831853).schema()}
Attitude = Annotated[
    str | Angles,
    Either("[roll, pitch, yaw], or free", (
        ((list, tuple), reader_of(Angles), _angles_schema), (str, _check_free, {"const": "free"}),
    )),
]  # fmt: skip


class Body(KeyTable):
    """A rigid body. Vectors that begin at its reference point are in body axes, but loads are in global ones."""

    at: Position = Field(description="Position of its reference point: the required one, or where the search begins")
    attitude: Attitude = Field(
        (0.0, 0.0, 0.0), description="Roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll); or free: to be found"
    )
    mass: Annotated[float, Quantity("kg", 1e-9, 1e15)] = Field(
        description="Mass; mass, center of mass and inertia are those with all actuators"
    )
    center_of_mass: Position = Field((0.0, 0.0, 0.0), description="From the reference point, body axes")
    inertia: Annotated[tuple[Inertia, ...], AfterValidator(_check_entries)] | None = Field(
        None, description="Entries of the tensor about the center of mass, body axes: xx yy zz, or xx yy zz xy xz yz"
    )
    attachments: dict[Name, Position] = Field({}, description="Name -> place where a cable may end, body axes")
    markers: dict[Name, Position] = Field({}, description="Name -> place whose motion is an output too, body axes")
    free: Annotated[tuple[Literal[MOTIONS], ...], AfterValidator(each_once)] = Field(
        MOTIONS, description="Components that are free, along and about global axes; the others are held"
    )
    wind: BodyWind | None = Field(None, description="Areas and drag that it has in the wind")
    force: ForceVector = Field((0.0, 0.0, 0.0), description="Dead load at the reference point, global axes")
    moment: tuple[Moment, Moment, Moment] = Field((0.0, 0.0, 0.0), description="Dead moment, global axes")

    @property
    def turning(self):
        """Tuple of the rotations that are free."""
        return tuple(name for name in self.free if name in ROTATIONS)

    @property
    def inertia_tensor(self):
        """Entries xx, yy, zz, xy, xz, yz about the center of mass; zero where none is given. [kg m^2]"""
        return (*(self.inertia or (0.0,) * 3), 0.0, 0.0, 0.0)[:6]

    @property
    def start_angles(self):
        """Roll, pitch, yaw, given or where the search begins. [rad]"""
        return (0.0, 0.0, 0.0) if self.attitude == "free" else self.attitude

    def relations(self):
        """Relations: names; a body that can turn has inertia, and its tensor is that of some mass."""
        yield [
            ((table, name), False, message)
            for table in ("attachments", "markers")
            for name in getattr(self, table)
            for message in wrong_name(name)
        ]
        if self.inertia is None:
            message = f"missing key: inertia (the body is free to turn: {', '.join(self.turning)})"
            yield [((), not self.turning, message)]
            return
        tensor, text = self.inertia_tensor, "{} must be positive, got {:g}".format
        yield [
            (("inertia", index), moment > 0, partial(text, name, moment))
            for index, (name, moment) in enumerate(zip(("xx", "yy", "zz"), tensor[:3], strict=True))
        ]
        yield [(("inertia",), _is_of_a_mass(*tensor), NO_MASS)]


def _is_of_a_mass(xx, yy, zz, xy, xz, yz):
    """True if a tensor of inertia I has positive principal moments, none of them above the sum of the other two.

    Equivalent to second moments of the mass S = tr(I)/2 - I that are positive semidefinite: no principal minor of S is
    negative. Wensing, Kim and Slotine (2018), IEEE Robotics and Automation Letters 3, 60, section III. Entries may be
    numbers, or arrays of many bodies.
    """
    trace = xx + yy + zz
    rounding = SCENE.inertia_rounding * trace
    s_xx, s_yy, s_zz = trace / 2 - xx, trace / 2 - yy, trace / 2 - zz
    is_positive = _determinant(xx, yy, zz, xy, xz, yz) > rounding * trace**2
    holds = is_positive & (_determinant(s_xx, s_yy, s_zz, -xy, -xz, -yz) >= -rounding * trace**2)
    for moment, other, mixed in ((s_xx, s_yy, xy), (s_xx, s_zz, xz), (s_yy, s_zz, yz)):
        minor = moment * other - mixed * mixed
        holds &= (moment >= -rounding) & (other >= -rounding) & (minor >= -rounding * trace)
    return holds


def _determinant(xx, yy, zz, xy, xz, yz):
    """Determinant of a symmetric 3 x 3 matrix."""
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)


class _CableOfSuspension(CableProperties):
    """Keys of a cable of a suspension, shared or its own; its length is stated in one of several ways."""

    table: ClassVar[str] = "cables"
    optional_groups: ClassVar[bool] = True

    unstretched_length: Length | None = Field(None, description="Length without tension")
    preload: StatedTension | None = Field(
        None, description="Mean tension, or its share of the breaking force (instead of unstretched_length)"
    )
    sag: Annotated[float, Quantity("m", 1e-18, 1e9)] | None = Field(
        None, description="Vertical distance from chord to cable at mid-span (instead of unstretched_length)"
    )
    tension_to: StatedTension | None = Field(
        None, description="Tension at the end `to`, or its share of the breaking force (instead of unstretched_length)"
    )
    tension: TensionAt | None = Field(None, description="Tension at a named place (instead of unstretched_length)")
    force_density: ForceDensity | None = Field(None, description="Tension over length, for form finding")
    reference: ReferenceTable = Field(
        ReferenceTable.model_construct(), description="The state in which lengths, tensions and sags hold"
    )
    loads: tuple[Load, ...] = Field((), max_length=SCENE.point_loads, description="Point loads on the cable")


class SharedCable(_CableOfSuspension):
    """The table `cable` of a suspension: what its cables have where they do not say otherwise."""

    complete: ClassVar[bool] = False


End = Annotated[
    str | Position,
    Either("a point, BODY.ATTACHMENT, or a place [x, y, z]", ((str, str, TEXT), ((list, tuple), _position, TRIPLE))),
]


class SuspendedCable(_CableOfSuspension):
    """One of the cables, with what it shares."""

    from_: End = Field(alias="from", description="End 1, that of the winch: a point, BODY.ATTACHMENT, or a fixed place")
    to: End = Field(description="End 2: a point, BODY.ATTACHMENT, or a fixed place")

    @property
    def stated(self):
        """Kind of what the cable states: one of `statics.suspension.STATED`, or None."""
        key = next((key for key in STATED if getattr(self, key) is not None), None)
        return TENSION_KINDS[self.tension.at] if key == "tension" else key

    @property
    def stated_value(self):
        """Value of what the cable states, shares of the breaking force in newtons; or None. [m] or [N]"""
        if self.tension is not None:
            return self.force_of(self.tension.value)
        return self.force_of(getattr(self, self.stated)) if self.stated else None

    @property
    def ends(self):
        """The two ends as written: tuple of str or place."""
        return self.from_, self.to

    def relations(self):
        """Relations of its cross-section, see `section_relations`."""
        tensions = {("preload",): self.preload, ("tension_to",): self.tension_to}
        tensions["tension", "value"] = self.tension and self.tension.value
        yield [*self.section_relations(), *self.tension_relations(tensions)]
        yield beyond_the_end(("loads",), self.loads, self.unstretched_length)


class Link(KeyTable):
    """A spring and dashpot between two places, without mass."""

    from_: End = Field(alias="from", description="First place: a point, BODY.ATTACHMENT, or a fixed place")
    to: End = Field(description="Second place: a point, BODY.ATTACHMENT, or a fixed place")
    stiffness: Annotated[float, Quantity("N/m", 0, 1e24)] = Field(
        0.0, description="Of the spring: force along the link per change of the distance of both places; it pushes too"
    )
    damping: Annotated[float, Quantity("N s/m", 0, 1e24)] = Field(
        0.0, description="Of the dashpot: force along the link per rate of that change"
    )
    length: Annotated[float, Quantity("m", 0, 1e9)] | None = Field(
        None,
        description="Distance at which the spring carries nothing (0: a mount, which resists all movements alike); "
        "default: that in the reference state, in which it then carries nothing",
    )

    ends = SuspendedCable.ends

    @property
    def may_carry_force(self):
        """True if its spring may carry a force in the reference state: its stiffness and length are stated."""
        return self.length is not None and "stiffness" in self.model_fields_set

    def relations(self):
        """Relations: a link does something."""
        given = {"stiffness", "damping"} & self.model_fields_set
        yield [((), bool(given), "missing key: one of stiffness, damping")]


_forces_schema = {"type": "object", "additionalProperties": _tension.schema()}
ForceOrForces = Annotated[
    Tension | dict[str, float],
    Either("a force, or a mapping of cable -> force", (
        Either.of_number(_tension), (dict, reader_of(dict[Name, Tension]), _forces_schema),
    )),
]  # fmt: skip


class Tensions(KeyTable):
    """Which tensions are chosen where more cables than necessary hold the bodies."""

    method: Literal["balanced", "least", "closest"] = Field(
        "balanced", description="Mean tensions of least variance, of least sum of squares, or closest to reference"
    )
    min: Annotated[float, Quantity("N", 0, 1e24)] = Field(0.0, description="Least mean tension allowed")
    max: Tension | None = Field(None, description="Largest mean tension allowed")
    reference: ForceOrForces | None = Field(None, description="With closest: of all cables, or cable -> force")

    def relations(self):
        """Relations: bounds in order; a reference goes with `closest`."""
        if self.max is not None:
            yield [(("max",), self.min <= self.max, lambda: f"{self.max:g} N is below min, {self.min:g} N")]
        is_closest, has_reference = self.method == "closest", self.reference is not None
        message = f"belongs to the method closest; the method is {self.method}"
        yield [((), has_reference or not is_closest, "missing key: reference (the method is closest)")]
        yield [(("reference",), is_closest or not has_reference, message)]


class CableWinch(KeyTable):
    """A winch that reels one of the cables, or moves its end."""

    end: Literal["from", "to"] = Field("from", description="from (on the ground) or to (on board)")
    direction: Direction | None = Field(
        None, description="Along which it moves the end instead of reeling, global axes, of any length but zero"
    )

    def relations(self):
        """Relations: a direction is one."""
        yield [(("direction",), self.direction is None or any(self.direction), NO_DIRECTION)]
