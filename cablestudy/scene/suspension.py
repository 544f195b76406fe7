"""A scene of several cables, bodies and points. Every value is in SI after reading."""

import math
from collections import Counter
from functools import partial
from typing import ClassVar, Literal

from pydantic import Field, PrivateAttr, ValidationError, model_validator

from cablestudy.scene.actuator_tables import LIMITS, Actuator, ReactionWheel, actuator_relations, is_wheel
from cablestudy.scene.cable_table import NO_CURVES, beyond_the_end, length_ratio_message
from cablestudy.scene.common_tables import (
    Exposure,
    Ground,
    Limits,
    MarkerCorrection,
    ModelTable,
    SceneTable,
    case_mistakes_in_file,
    case_relations,
    ground_relations,
)
from cablestudy.scene.connections import connection_mistakes, unsupported, written_connections
from cablestudy.scene.control_tables import Control, Drive
from cablestudy.scene.determinacy import MOTIONS, determinacy_mistakes
from cablestudy.scene.fields import CaseName, KeyTable, Name, suggestion, tables_of
from cablestudy.scene.layers import mapping_at, merge, prune
from cablestudy.scene.load_tables import SuspensionLoadCase, paths_of_loads
from cablestudy.scene.materials import Materials, loaded_by_a_case
from cablestudy.scene.mistakes import as_meant, empty_keys, findings, located
from cablestudy.scene.references import case_mistakes, reference_mistakes
from cablestudy.scene.section import limited, within
from cablestudy.scene.suspension_tables import (
    Body,
    CableWinch,
    Link,
    PointOrPosition,
    SharedCable,
    SuspendedCable,
    Tensions,
)
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.wind_tables import SuspensionWind

# Keys of a scene of one cable -> what a suspension has instead.
INSTEAD = {
    ("gondola",): "bodies are under bodies",
    ("winch",): "winches are under winches",
    ("ends",): "each cable has from and to",
    ("chord",): "each cable has from and to",
    ("inclination",): "each cable has from and to",
    **{(key,): "that of all winches is under control" for key in ("controller", *Drive.model_fields)},
}
OF_CABLES = ("cable",), ("cables",), ("cases",), ("winches",)  # tables with keys of one cable


class SuspensionScene(SceneTable):
    """All that the file of a suspension says. Each cable holds its own keys and those of `cable` that it lacks."""

    no_case: ClassVar[KeyTable] = SuspensionLoadCase.model_construct()

    cable: SharedCable = Field(SharedCable.model_construct(), description="What all cables share")
    points: dict[Name, PointOrPosition] = Field({}, description="Name -> place, or a mapping for a free point")
    bodies: dict[Name, Body] = Field({}, description="Name -> rigid body")
    cables: dict[Name, SuspendedCable] = Field(description="Name -> cable, over the table cable")
    links: dict[Name, Link] = Field({}, description="Name -> spring and dashpot between two places")
    winches: dict[Name, CableWinch] = Field({}, description="Name of a cable -> the winch that reels it")
    solve_for: Literal["pose", "lengths"] = Field(
        "pose", description="pose: where the bodies are; lengths: those of the cables that state nothing"
    )
    tensions: Tensions | None = Field(None, description="How tensions are chosen, with solve_for: lengths")
    control: Control | None = Field(None, description="The loop of the winches")
    actuators: dict[Name, Actuator] = Field({}, description="Name -> reaction mass (mass) or reaction wheel (inertia)")
    wind: SuspensionWind | None = Field(None, description="The wind on bodies and cables")
    ground: Ground | None = Field(None, description="Level of the ground, or [x, z] of points under the cables")
    cases: dict[CaseName, SuspensionLoadCase] = Field(
        {}, description="Name -> temperature, ice, wind, loads, forces, moves and lost cables of a load case"
    )
    case: Name | None = Field(None, description="Load case to compute; default: the reference state")
    limits: Limits = Field({}, description="Name -> what must hold in load cases: a comparison, or {that, cases}")
    exposure: Exposure | None = Field(None, description="Time of one exposure, within which motion blurs the image")
    correction: MarkerCorrection | None = Field(None, description="The mirror that corrects the image")
    materials: Materials = Field({}, description="Name -> material or rope, over the built-in ones; or their file")
    model: ModelTable = Field(ModelTable(), description="How finely the cables are computed")
    _written: dict = PrivateAttr({})  # the plain values of the file

    @model_validator(mode="before")
    @classmethod
    def _share(cls, data):
        """Add to each cable the keys of the table `cable` that it does not give itself."""
        return _with_shared(data)

    def with_value(self, path, value):
        """Copy with another value at a path; a key of `cable` is set in the cables that have it from there too."""
        scene = super().with_value(path, value)
        if path[0] != "cable":
            return scene
        path_in_cable = path[1:]
        sharing = [name for name in self.cables if self._is_shared(name, path_in_cable)]
        changed = {name: self.cables[name].with_value(path_in_cable, value) for name in sharing}
        return scene.model_copy(update={"cables": {**self.cables, **changed}})

    def _is_shared(self, cable, path):
        """True if a cable, by its name, has its value at a path from the table `cable`."""
        own, shared = self._written["cables"][cable], self._written.get("cable", {})
        return not _is_written(own, path) and _is_written(_merge_shared(shared, own), path)

    @property
    def lines(self):
        """Cables and links, which have two ends each, in the order of `SuspendedSystem`: name -> table, a dict."""
        return {**self.cables, **self.links}

    def without_lost(self):
        """Copy without the cables that its load case has lost, and without their winches; itself where none is lost."""
        lost = self.load_case.lost
        if not lost:
            return self
        cables = {name: cable for name, cable in self.cables.items() if name not in lost}
        winches = {name: winch for name, winch in self.winches.items() if name not in lost}
        return self.model_copy(update={"cables": cables, "winches": winches})

    def loads_on(self, cable):
        """All point loads on the cable of a name: its own, then those of the case."""
        return self.cables[cable].loads + self.load_case.loads.get(cable, ())

    @property
    def load_paths(self):
        """Name of each point load on a cable -> its path: dict."""
        paths, loads_of_case = {}, self.load_case.loads
        for name, cable in self.cables.items():
            own = ("cables", name, "loads"), cable.loads
            of_case = ("cases", self.case, "loads", name), loads_of_case.get(name, ())
            paths |= paths_of_loads(name, own, of_case)
        return paths

    def attachment(self, end):
        """Name of the body or free point that holds an end of `SuspendedCable.ends`, None for the ground; its place.

        The place is from the reference point of a body, body axes; (0, 0, 0) of a free point; global where it is fixed.
        [m]
        """
        if not isinstance(end, str):
            return None, end
        if end in self.points:
            point = self.points[end]
            return (end, (0.0, 0.0, 0.0)) if point.free else (None, point.at)
        body, _, attachment = end.partition(".")
        return body, self.bodies[body].attachments[attachment]

    def start(self, end):
        """Position (x, y, z) of an end where the search for equilibrium begins, global. [m]"""
        owner, position = self.attachment(end)
        if owner is None:
            return position
        if owner in self.points:
            return self.points[owner].at
        body = self.bodies[owner]
        rotated = _rotate(body.start_angles, position)
        return tuple(origin + component for origin, component in zip(body.at, rotated, strict=True))

    def relations(self):
        """Names that exist, everything held by a cable, as much stated as is needed, cables of some length."""
        ends = {name: cable.ends for name, cable in self.cables.items()}
        bodies = {name: body.attachments for name, body in self.bodies.items()}
        links = {name: link.ends for name, link in self.links.items()}
        yield [(("cables",), bool(self.cables or self.links), "expected at least 1 item, got 0")]
        mistakes = connection_mistakes(self.points, bodies, ends, self.winches, self.actuators, links)
        of_names = _unmet(mistakes + self._unknown_references() + reference_mistakes(self))
        of_cases = case_relations(self.case, self.limits, self.cases)
        yield [*of_names, *of_cases, *ground_relations(self.ground)]
        yield _unmet(self._unsupported() + determinacy_mistakes(self))
        yield [relation for name, link in self.links.items() for relation in self._link_relations(name, link)]
        for relation in actuator_relations(self):
            yield [relation]
        yield _unmet(self._unknown_diameters())
        yield from self._case_relations()
        yield from self._chord_relations()
        yield [relation for name, case in self.cases.items() for relation in self._move_relations(name, case.moves)]

    def _case_relations(self):
        """Relations: all cables have what the cases need, and their loads act on something."""
        yield [loaded_by_a_case(("cables", name), table, self.cases) for name, table in self.cables.items()]
        with_state = [name for name, table in self.cables.items() if table.state]
        has_curves = not with_state or any(table.stress_strain for table in self.cables.values())
        yield [(("cables", name, "state"), has_curves, NO_CURVES) for name in with_state[:1]]
        yield [
            relation
            for name, case in self.cases.items()
            for cable, table in self.cables.items()
            if cable not in case.lost
            for relation in case.of_cable(cable).needs_of(table, ("cables", cable), name)
        ]
        yield from self._load_relations()
        yield _unmet(case_mistakes(self))

    def _load_relations(self):
        """Relations: the point loads of load cases are on cables that exist, and not beyond their ends."""
        loads_at = {  # path in the scene -> point loads of one case on one cable
            ("cases", name, "loads", cable): case.loads[cable]
            for name, case in self.cases.items()
            for cable in case.loads
        }
        yield [
            (path, path[-1] in self.cables, lambda name=path[-1]: f"unknown cable ({suggestion(name, self.cables)})")
            for path in loads_at
        ]
        for path, loads in loads_at.items():
            yield beyond_the_end(path, loads, self.cables[path[-1]].unstretched_length)

    def _chord_relations(self):
        """The ends of each cable are apart where the search begins, and its unstretched length fits their distance."""
        ends = {name: tuple(map(self.start, cable.ends)) for name, cable in self.cables.items()}
        chords = {name: _distance(*positions) for name, positions in ends.items()}
        text = "its two ends are at one place, [{:g}, {:g}, {:g}]".format
        yield [(("cables", name), chord > 0, partial(text, *ends[name][1])) for name, chord in chords.items()]
        yield [relation for name, chord in chords.items() for relation in self._length_relations(name, chord)]

    def body_of(self, table):
        """Name of the body that `control` or one of the actuators names, or of the only one."""
        return next(iter(self.bodies)) if table.body is None else table.body

    def _unknown_references(self):
        """Path and message of the cables in `tensions.reference` that do not exist."""
        names = self.tensions.reference if self.tensions and isinstance(self.tensions.reference, dict) else ()
        return [
            (("tensions", "reference", name), f"unknown cable ({suggestion(name, self.cables)})")
            for name in names
            if name not in self.cables
        ]

    def _unknown_diameters(self):
        """Path and message of the cables that lack the diameter which a wind on cables needs."""
        in_wind = self.wind is not None and self.wind.on != "bodies"
        names = [name for name, cable in self.cables.items() if in_wind and cable.section_diameter is None]
        message = "missing key: one of diameter, area (the wind acts on cables; or wind.on: bodies)"
        return [(("cables", name), message) for name in names]

    def _unsupported(self):
        """Path and message of the bodies and free points that nothing holds."""
        table_of = {name: "points" for name, point in self.points.items() if point.free}
        table_of |= {name: "bodies" for name, body in self.bodies.items() if body.free}
        partly_held = [name for name, body in self.bodies.items() if len(body.free) < len(MOTIONS)]
        holding = [*self.cables.values(), *(link for link in self.links.values() if link.may_carry_force)]
        owners = [tuple(self.attachment(end)[0] for end in line.ends) for line in holding]
        hint = " (a link without stiffness or length carries nothing in the reference state)" if self.links else ""
        messages = unsupported(table_of, partly_held, owners)
        return [((table_of[name], name), message + hint) for name, message in messages]

    def _link_relations(self, name, link):
        """Relations of a link: its ends can move relative to each other, and are apart where it has a length."""
        path, (owner, other) = ("links", name), (self.attachment(end)[0] for end in link.ends)
        where = f"on {owner}" if owner else "fixed"
        yield path, owner != other, f"both of its places are {where}: it does nothing"
        apart = link.length is None or (link.length == 0) | (_distance(*map(self.start, link.ends)) > 0)
        yield (*path, "length"), apart, "both of its places are one where the search begins (length: 0 m?)"

    def _move_relations(self, case, moves):
        """Relations of the distance of the ends of cables between fixed points that a load case moves. [m]"""
        text = "moved, the two ends of {} are {:g} m apart".format
        for name, cable in self.cables.items() if moves else ():
            if any(self.attachment(end)[0] for end in cable.ends) or not any(end in moves for end in cable.ends):
                continue
            moved_ends = []
            for end in cable.ends:
                shift = moves.get(end, (0.0, 0.0, 0.0))
                moved_ends.append([x + dx for x, dx in zip(self.start(end), shift, strict=True)])
            yield limited(("cases", case, "moves"), _distance(*moved_ends), SCENE.chord_range, "m", partial(text, name))

    def _length_relations(self, name, chord):
        """Relations of a cable whose ends have this distance where the search begins. [m]"""
        cable, path = self.cables[name], ("cables", name)
        yield limited(path, chord, SCENE.chord_range, "m", "its two ends are {:g} m apart".format)
        length = cable.unstretched_length
        if length is not None and not (self.solve_for == "pose" and any(self.attachment(end)[0] for end in cable.ends)):
            fits = within(length, (SCENE.length_ratio[0] * chord, SCENE.length_ratio[1] * chord))
            yield (*path, "unstretched_length"), fits, partial(length_ratio_message, length, chord)


def _distance(position, other):
    """Distance of two positions, also where their coordinates are arrays. [m]"""
    return sum((a - b) ** 2 for a, b in zip(position, other, strict=True)) ** 0.5


def _unmet(mistakes):
    """Mistakes, (path, message) each, as relations that do not hold: a list as in `KeyTable.relations`."""
    return [(path, False, message) for path, message in mistakes]


def _rotate(angles, vector):
    """A vector v in body axes as one in global axes: R v, R = Rz(yaw) Ry(pitch) Rx(roll)."""
    (x, y, z), (roll, pitch, yaw) = vector, angles
    y, z = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
    x, z = x * math.cos(pitch) + z * math.sin(pitch), z * math.cos(pitch) - x * math.sin(pitch)
    x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    return x, y, z


SUSPENSION_TABLES = tables_of(SuspensionScene)


def read_suspension(document):
    """Check a document that describes several cables, and convert it to a `SuspensionScene`: as `read_scene`."""
    wheels = [name for name, value in mapping_at(document.value, ("actuators",)).items() if is_wheel(value)]
    # the first table that fits a path describes it: for names of reaction wheels not that of reaction masses
    tables = [(("actuators", name), ReactionWheel) for name in wheels] + SUSPENSION_TABLES
    mistakes = [(path, _explain(path, message)) for path, message in empty_keys(document, tables)]
    try:
        context = {"materials": document.value.get("materials")}
        scene = SuspensionScene.model_validate(document.value, context=context)
    except ValidationError as error:
        found = [(path, _explain(path, text)) for path, text in findings(error, _with_shared(document.value), tables)]
        # pydantic checks neither connections nor names of load cases where a single key is wrong
        as_written = as_meant(document.value, found)
        found += [*connection_mistakes(*written_connections(as_written)), *case_mistakes_in_file(as_written)]
        raise located([*mistakes, *_move_to_shared(dict.fromkeys(found), document.value)], document) from None
    if mistakes:
        raise located(mistakes, document)
    scene._written = document.value
    return scene


def _explain(path, message):
    """A message; on keys of a scene of one cable with what a suspension has instead, on limits with what they are."""
    instead = INSTEAD.get(path if len(path) == 1 else path[-1:] if path[:1] in OF_CABLES else None)
    if instead and message.startswith("unknown key"):
        return f"unknown key in a suspension: {instead}"
    is_limit = path[:1] == ("actuators",) and message.removeprefix("missing key: ") in LIMITS
    return f"{message} (an actuator without limits)" if is_limit else message


def _move_to_shared(mistakes, value):
    """Yield mistakes, (path, message) each: those of cables that are written in the table `cable` with its path.

    `value` are the plain values of the file. A key that all of several cables lack is missing in the table `cable`.
    """
    cables = mapping_at(value, ("cables",))
    how_often = Counter((path[2:], message) for path, message in mistakes if path[:1] == ("cables",))
    for path, message in mistakes:
        table, name, path_in_cable = path[:1], path[1:2], path[2:]
        is_own = table != ("cables",) or not name or _is_written(cables.get(name[0]), path_in_cable)
        all_lack_it = message.startswith("missing key") and how_often[path_in_cable, message] == len(cables) > 1
        is_shared = not is_own and (_is_written(value.get("cable"), path_in_cable) or all_lack_it)
        yield (("cable", *path_in_cable) if is_shared else path), message


def _with_shared(data):
    """Plain values of a suspension, to whose cables the keys of the table `cable` are added that they do not give."""
    if not isinstance(data, dict) or not isinstance(cables := data.get("cables"), dict):
        return data
    known = {key: value for key, value in mapping_at(data, ("cable",)).items() if key in SharedCable.model_fields}
    return {**data, "cables": {name: _merge_shared(known, own) for name, own in cables.items()}}


def _merge_shared(shared, own):
    """Plain keys of one cable, merged upon those that all cables share, without alternatives to its own and nulls."""
    return prune(merge({"cable": shared}, {"cable": own})["cable"])


def _is_written(table, path):
    """True if something is written at a path, which is not empty; a list is written whole."""
    for name in path:
        if isinstance(table, list):
            return True
        if not isinstance(table, dict) or name not in table:
            return False
        table = table[name]
    return bool(path)
