"""A scene of several cables, bodies and points: the file format as typed models. Every value is in SI after reading."""

import math
from collections import Counter
from functools import partial
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, PrivateAttr, StrictBool, TypeAdapter, ValidationError, model_validator

from cablestudy.scene.cable_table import (
    CHORD_RANGE,
    LENGTH_RATIO,
    CableProperties,
    Damping,
    Force,
    Length,
    Stress,
    length_ratio,
    limited,
    within,
)
from cablestudy.scene.cable_table import Point as Place
from cablestudy.scene.connections import attachment_of, connection_mistakes, unheld, written_connections
from cablestudy.scene.determinacy import ROTATIONS, STATED, determinacy_mistakes
from cablestudy.scene.fields import Either, Name, Quantity, Table, suggestion, wrong
from cablestudy.scene.layers import merge
from cablestudy.scene.mistakes import findings, located
from cablestudy.scene.model import Model
from cablestudy.scene.units import show

MOTIONS = ("x", "y", "z", *ROTATIONS)
# What is no mass by more than rounding: relative to the largest moment of inertia.
INERTIA_ROUNDING = 1e-9
# Keys of a scene of one cable -> what a suspension has instead.
INSTEAD = {
    ("gondola",): "bodies are under bodies",
    ("winch",): "winches are under winches",
    ("wind",): "wind on a suspension is not computed",
    ("ends",): "each cable has from and to",
    ("chord",): "each cable has from and to",
    ("inclination",): "each cable has from and to",
    ("loads",): "end two cables at a free point that carries the force",
}

Angle = Annotated[
    float, Quantity("rad", -2 * math.pi, 2 * math.pi, limits="from -360 deg to 360 deg (a bare number is rad)")
]
Angles = tuple[Angle, Angle, Angle]
ForceVector = tuple[Force, Force, Force]
Moment = Annotated[float, Quantity("N m", -1e24, 1e24)]
Inertia = Annotated[float, Quantity("kg m^2", -1e24, 1e24)]
Tension = Annotated[float, Quantity("N", 1e-24, 1e24)]
ForceDensity = Annotated[float, Quantity("N/m", 1e-24, 1e24)]

_place = TypeAdapter(Place).validate_python
_angles = TypeAdapter(Angles).validate_python
_TRIPLE = {"type": "array", "minItems": 3, "maxItems": 3}


def _free_word(value):
    if value != "free":
        raise wrong(f"expected [roll, pitch, yaw], or free, got {show(value)}")
    return value


def _three_or_six(value):
    if len(value) not in (3, 6):
        raise wrong(f"expected 3 entries (xx yy zz) or 6 (xx yy zz xy xz yz), got {len(value)}")
    return value


def _each_once(value):
    repeated = next((name for place, name in enumerate(value) if name in value[:place]), None)
    if repeated:
        raise wrong(f"{repeated} is given twice")
    return value


class Point(Table):
    """A place that a cable may end at, fixed or free to move; a bare place in the file is a fixed one."""

    at: Place = Field(description="Where it is; of a free point where the search begins")
    free: StrictBool = Field(False, description="Whether it finds its place: a junction of cables")
    mass: Annotated[float, Quantity("kg", 0, 1e15)] = Field(0.0, description="Of a free point")
    force: ForceVector = Field((0.0, 0.0, 0.0), description="Of a free point: dead load")

    def value_at(self, path):
        """See `Table.value_at`; a component alone is one of the place, as where the file has a bare place."""
        return super().value_at(("at", *path) if path[0].isdigit() else path)

    def with_value(self, path, value):
        """See `Table.with_value`, and `value_at`."""
        return super().with_value(("at", *path) if path[0].isdigit() else path, value)

    def relations(self):
        """Mass and force belong to a free point."""
        message = "belongs to a free point: this one is fixed (free: true lets it move)"
        given = [(name,) for name in ("mass", "force") if name in self.model_fields_set]
        yield [(path, self.free, lambda: message) for path in given]


class Body(Table):
    """A rigid body. Vectors that begin at its reference point are in body axes, but loads are in global ones."""

    at: Place = Field(description="Its reference point: where it shall be, or where the search begins")
    attitude: Annotated[
        str | Angles,
        Either(
            ((list, _angles), (tuple, _angles), (str, _free_word)),
            "[roll, pitch, yaw], or free",
            ({**_TRIPLE, "items": Quantity("rad", -6.2831853, 6.2831853).schema()}, {"const": "free"}),
        ),
    ] = Field((0.0, 0.0, 0.0), description="Roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll); or free: to be found")
    mass: Annotated[float, Quantity("kg", 1e-9, 1e15)] = Field(description="Mass")
    center_of_mass: Place = Field((0.0, 0.0, 0.0), description="From the reference point, body axes")
    inertia: Annotated[tuple[Inertia, ...], AfterValidator(_three_or_six)] | None = Field(
        None, description="Entries of the tensor about the center of mass, body axes: xx yy zz, or xx yy zz xy xz yz"
    )
    attachments: dict[Name, Place] = Field({}, description="Name -> place where a cable may end, body axes")
    markers: dict[Name, Place] = Field({}, description="Name -> place whose motion is wanted too, body axes")
    free: Annotated[tuple[Literal[MOTIONS], ...], AfterValidator(_each_once)] = Field(
        MOTIONS, description="What may move, about global axes; the rest is held"
    )
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
        """A body that can turn has inertia, and its tensor is that of some mass."""
        if self.inertia is None:
            message = f"missing key: inertia (the body is free to turn: {', '.join(self.turning)})"
            yield [((), not self.turning, lambda: message)]
            return
        names, entries = ("xx", "yy", "zz"), self.inertia_tensor
        yield [
            (("inertia", place), entry > 0, lambda name=name, entry=entry: f"{name} must be positive, got {entry:g}")
            for place, (name, entry) in enumerate(zip(names, entries, strict=False))
        ]
        trace = entries[0] + entries[1] + entries[2]
        tiny = INERTIA_ROUNDING * trace
        yield [
            (
                ("inertia",),
                lowest >= -tiny * size,
                lambda: (
                    "no mass has this tensor: its moments about the principal "
                    "axes must be positive, each at most the sum of the other two"
                ),
            )
            for lowest, size in _minors(entries, trace)
        ]


def _minors(entries, trace):
    """Minors that must not be negative, each with the size of its terms: those of the tensor's second moments.

    The second moments of a mass, S = tr(I)/2 - I, are positive semidefinite where the principal moments of inertia
    satisfy the triangle inequality. Wittenburg (1977), Dynamics of Systems of Rigid Bodies, section 3.1.
    """
    xx, yy, zz = (trace / 2 - entry for entry in entries[:3])
    xy, xz, yz = (-entry for entry in entries[3:])
    for one in (xx, yy, zz):
        yield one, 1.0
    for one, other, mixed in ((xx, yy, xy), (xx, zz, xz), (yy, zz, yz)):
        yield one * other - mixed * mixed, trace
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    yield determinant, trace * trace


class _Stated(CableProperties):
    """Keys of a cable of a suspension, shared or its own; the lengths are stated in one of several ways."""

    table: ClassVar[str] = "cables"
    optional_groups: ClassVar[bool] = True

    unstretched_length: Length | None = Field(None, description="Length without tension")
    preload: Tension | None = Field(None, description="Mean tension (instead of unstretched_length)")
    sag: Annotated[float, Quantity("m", 1e-18, 1e9)] | None = Field(
        None, description="Vertical distance from chord to cable at mid-span (instead of unstretched_length)"
    )
    tension_to: Tension | None = Field(None, description="Tension at the end `to` (instead of unstretched_length)")
    force_density: ForceDensity | None = Field(None, description="Tension over length, for form finding")


class SharedCable(_Stated):
    """The table `cable` of a suspension: what its cables have where they do not say otherwise."""

    elastic_modulus: Stress | None = Field(None, description="Elastic modulus of the cross-section")
    density: Annotated[float, Quantity("kg/m^3", 1e-9, 1e15)] | None = Field(None, description="Mass per volume")


End = Annotated[
    str | Place,
    Either(
        ((list, _place), (tuple, _place), (str, str)),
        "a point, BODY.ATTACHMENT, or a place [x, y, z]",
        ({"type": "string", "minLength": 1}, _TRIPLE),
    ),
]


class SuspendedCable(_Stated):
    """One of the cables, with what it shares."""

    from_: End = Field(alias="from", description="End 1, that of the winch: a point, BODY.ATTACHMENT, or a fixed place")
    to: End = Field(description="End 2")

    @property
    def stated(self):
        """Which of STATED the cable gives, or None."""
        return next((key for key in STATED if getattr(self, key) is not None), None)

    @property
    def ends(self):
        """The two ends as written: tuple of str or place."""
        return self.from_, self.to

    def relations(self):
        """A section, and products within what the solvers can hold."""
        given = self.area is not None or self.diameter is not None
        yield [((), given, lambda: "missing key: one of area, diameter")]
        tensions = [key for key in ("preload", "tension_to") if getattr(self, key) is not None]
        yield [*self.product_relations(), *map(self.tension_relation, tensions)]


_force = Quantity("N", 1e-24, 1e24).read
_forces = TypeAdapter(dict[Name, Tension]).validate_python


class Tensions(Table):
    """Which tensions are chosen where more cables than necessary hold the bodies."""

    method: Literal["balanced", "least", "closest"] = Field(
        "balanced", description="Least variance, least sum of squares, or closest to reference, of the mean tensions"
    )
    min: Annotated[float, Quantity("N", 0, 1e24)] = Field(0.0, description="Least mean tension allowed")
    max: Tension | None = Field(None, description="Largest mean tension allowed")
    reference: (
        Annotated[
            float | dict[str, float],
            Either(
                ((dict, _forces), ((int, float, str), _force)),
                "a force, or a mapping of cable -> force",
                (
                    *Quantity("N", 1e-24, 1e24).schema()["anyOf"],
                    {"type": "object", "additionalProperties": Quantity("N", 1e-24, 1e24).schema()},
                ),
            ),
        ]
        | None
    ) = Field(None, description="With closest: of all cables, or cable -> force")

    def relations(self):
        """Bounds in order; a reference goes with `closest`."""
        if self.max is not None:
            message = f"{self.max:g} N is below min, {self.min:g} N"
            yield [(("max",), self.min <= self.max, lambda: message)]
        closest, given = self.method == "closest", self.reference is not None
        message = f"belongs to the method closest; the method is {self.method}"
        yield [((), given or not closest, lambda: "missing key: reference (the method is closest)")]
        yield [(("reference",), closest or not given, lambda: message)]


class CableWinch(Table):
    """A winch that reels one of the cables."""

    end: Literal["from", "to"] = Field("from", description="from (on the ground) or to (on board)")


def _point(value):
    return Point(at=_place(value))


class SuspensionScene(Table):
    """All that the file of a suspension says. Each cable holds its own keys and those of `cable` that it lacks."""

    gravity: Annotated[float, Quantity("m/s^2", 0, 1e6)] = Field(9.81, description="Acceleration of gravity, along -z")
    cable: SharedCable = Field(SharedCable(), description="What all cables share")
    points: dict[
        Name,
        Annotated[
            Point | Place,
            Either(
                ((list, _point), (tuple, _point), ((dict, Point), Point.model_validate)),
                "a place [x, y, z], or a mapping with the keys at, free, mass, force",
                (_TRIPLE, {"$ref": "#/$defs/Point"}),
            ),
        ],
    ] = Field({}, description="Name -> place, or a mapping for a free point")
    bodies: dict[Name, Body] = Field({}, description="Name -> rigid body")
    cables: dict[Name, SuspendedCable] = Field(min_length=1, description="Name -> cable, over the table cable")
    winches: dict[Name, CableWinch] = Field({}, description="Name of a cable -> the winch that reels it")
    solve_for: Literal["pose", "lengths"] = Field(
        "pose", description="pose: where the bodies are; lengths: those of the cables that state nothing"
    )
    tensions: Tensions | None = Field(None, description="With solve_for: lengths")
    model: Model = Field(Model(), description="How finely the cables are computed")
    _written: dict = PrivateAttr({})  # the plain values of the file

    @model_validator(mode="before")
    @classmethod
    def _share(cls, data):
        """What all cables share is below what each of them says."""
        cables, shared = (data.get(key) if isinstance(data, dict) else None for key in ("cables", "cable"))
        if not (isinstance(cables, dict) and isinstance(shared, dict)):
            return data
        known = {key: value for key, value in shared.items() if key in SharedCable.model_fields}
        return {**data, "cables": {name: _over(known, own) for name, own in cables.items()}}

    def with_value(self, path, value):
        """See `Table.with_value`; a key of `cable` is set in the cables that have it from there too."""
        scene = super().with_value(path, value)
        if path[0] != "cable":
            return scene
        inside = path[1:]
        sharing = [name for name in self.cables if self._is_shared(name, inside)]
        cables = {name: self.cables[name].with_value(inside, value) for name in sharing}
        return scene.model_copy(update={"cables": {**self.cables, **cables}})

    def _is_shared(self, cable, path):
        """Whether a cable has what is written at a path in the table `cable`."""
        own, shared = self._written["cables"][cable], self._written.get("cable", {})
        return not _is_written(own, path) and _is_written(_over(shared, own), path)

    def attachment(self, end):
        """Name of the body or free point that holds an end, None for the ground, and its place.

        Parameters
        ----------
        end : str or tuple
            As `SuspendedCable.ends` has it.

        Returns
        -------
        owner : str or None
        place : tuple
            From the reference point of a body, body axes; (0, 0, 0) of a free point; global where it is fixed. [m]
        """
        return attachment_of(self.points, self.bodies, end)

    def start(self, end):
        """Where an end is when the search begins, (x, y, z), global. [m]"""
        owner, place = self.attachment(end)
        if owner is None:
            return place
        if owner in self.points:
            return self.points[owner].at
        body = self.bodies[owner]
        return tuple(at + turned for at, turned in zip(body.at, _turned(body.start_angles, place), strict=True))

    def relations(self):
        """Ends that exist, everything held by a cable, as much stated as is needed, cables of some length."""
        ends = {name: cable.ends for name, cable in self.cables.items()}
        bodies = {name: body.attachments for name, body in self.bodies.items()}
        yield _broken(connection_mistakes(self.points, bodies, ends, self.winches) + self._unknown_references())
        yield _broken(self._unheld() + determinacy_mistakes(self))
        ends = {name: tuple(map(self.start, cable.ends)) for name, cable in self.cables.items()}
        chords = {name: _distance(*places) for name, places in ends.items()}
        yield [
            (
                ("cables", name),
                chord > 0,
                partial("its two ends are at one place, [{:g}, {:g}, {:g}]".format, *ends[name][1]),
            )
            for name, chord in chords.items()
        ]
        yield [relation for name, chord in chords.items() for relation in self._lengths(name, chord)]

    def _unknown_references(self):
        """Path and message of the cables in `tensions.reference` that do not exist."""
        names = self.tensions.reference if self.tensions and isinstance(self.tensions.reference, dict) else ()
        return [
            (("tensions", "reference", name), f"unknown cable ({suggestion(name, self.cables)})")
            for name in names
            if name not in self.cables
        ]

    def _unheld(self):
        """Path and message of the bodies and free points that nothing holds."""
        tables = {name: "points" for name, point in self.points.items() if point.free}
        tables |= {name: "bodies" for name, body in self.bodies.items() if body.free}
        stands = [name for name, body in self.bodies.items() if len(body.free) < len(MOTIONS)]
        owners = [tuple(self.attachment(end)[0] for end in cable.ends) for cable in self.cables.values()]
        return [((tables[name], name), message) for name, message in unheld(tables, stands, owners)]

    def _lengths(self, name, chord):
        """Relations of the distance of a cable's ends where the search begins. [m]"""
        cable, path = self.cables[name], ("cables", name)
        yield path, *limited(name, chord, CHORD_RANGE, "m", "its two ends are {:g} m apart".format)[1:]
        length = cable.unstretched_length
        if length is not None and not (self.solve_for == "pose" and any(self.attachment(end)[0] for end in cable.ends)):
            fits = within(length, (LENGTH_RATIO[0] * chord, LENGTH_RATIO[1] * chord))
            yield (*path, "unstretched_length"), fits, partial(length_ratio, length, chord)


def _distance(first, last):
    """Of two places, also where their coordinates are arrays. [m]"""
    return sum((one - other) ** 2 for one, other in zip(first, last, strict=True)) ** 0.5


def _broken(found):
    """Relations that do not hold, from paths and messages."""
    return [(path, False, lambda message=message: message) for path, message in found]


def _turned(angles, place):
    """A vector in body axes as one in global axes: R v, R = Rz(yaw) Ry(pitch) Rx(roll)."""
    (x, y, z), (roll, pitch, yaw) = place, angles
    y, z = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
    x, z = x * math.cos(pitch) + z * math.sin(pitch), z * math.cos(pitch) - x * math.sin(pitch)
    x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    return x, y, z


# Where each mapping of the file lies ("*": any name) and which model reads it.
SUSPENSION_TABLES = {
    (): SuspensionScene,
    ("cable",): SharedCable,
    ("cable", "damping"): Damping,
    ("points", "*"): Point,
    ("bodies", "*"): Body,
    ("cables", "*"): SuspendedCable,
    ("cables", "*", "damping"): Damping,
    ("winches", "*"): CableWinch,
    ("tensions",): Tensions,
    ("model",): Model,
}


def is_suspension(document):
    """Whether a scene describes several cables."""
    return any(key in document.given for key in ("cables", "bodies", "points"))


def read_suspension(document):
    """Scene of a document that describes several cables.

    Parameters
    ----------
    document : Document
        With its base files merged.

    Returns
    -------
    SuspensionScene

    Raises
    ------
    SceneError
        All that is wrong with it, sorted by place.
    """
    try:
        scene = SuspensionScene.model_validate(document.value)
    except ValidationError as error:
        found = findings(error, document.value, SUSPENSION_TABLES)
        found += connection_mistakes(*written_connections(document.value))
        raise located(_at_shared(_explained(found), document.value), document) from None
    scene._written = document.value
    return scene


def _explained(found):
    """Findings in which keys of a scene of one cable are told what a suspension has instead."""
    for path, message in found:
        instead = INSTEAD.get(path if len(path) == 1 else path[-1:] if path[:1] in (("cable",), ("cables",)) else None)
        unknown = instead and message.startswith("unknown key")
        yield path, f"unknown key in a suspension: {instead}" if unknown else message


def _at_shared(found, value):
    """Findings in keys that cables share, at the place where they are shared."""
    found = list(dict.fromkeys(found))
    cables = value.get("cables")
    cables = cables if isinstance(cables, dict) else {}
    alike = Counter((path[2:], message) for path, message in found if path[:1] == ("cables",))
    for path, message in found:
        table, name, inside = path[:1], path[1:2], path[2:]
        own = table != ("cables",) or not name or _is_written(cables.get(name[0]), inside)
        shared = not own and (_is_written(value.get("cable"), inside) or alike[inside, message] == len(cables) > 1)
        yield (("cable", *inside) if shared else path), message


def _over(shared, own):
    """What a cable says, over what all cables share; both plain."""
    return merge({"cable": shared}, {"cable": own})["cable"]


def _is_written(table, path):
    """Whether something is written at a path, which is not empty."""
    for name in path:
        if not isinstance(table, dict) or name not in table:
            return False
        table = table[name]
    return bool(path)
