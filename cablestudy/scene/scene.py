"""A scene: the file format as typed models. Every value is in SI after reading."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, ValidationError

from cablestudy.scene.cable_table import Cable, beyond_the_end
from cablestudy.scene.common_tables import (
    Correction,
    Exposure,
    Ground,
    Limits,
    ModelTable,
    SceneTable,
    case_mistakes_in_file,
    case_relations,
    ground_relations,
)
from cablestudy.scene.control_tables import Controller, Drive
from cablestudy.scene.document import apply_sets, read_document
from cablestudy.scene.fields import CaseName, KeyTable, Name, Quantity, parts_of, tables_of
from cablestudy.scene.layers import matches, split_key
from cablestudy.scene.load_tables import LoadCase, paths_of_loads
from cablestudy.scene.materials import Materials, loaded_by_a_case
from cablestudy.scene.mistakes import as_meant, empty_keys, findings, located
from cablestudy.scene.section import limited
from cablestudy.scene.strict_yaml import refuse
from cablestudy.scene.tolerances import SCENE
from cablestudy.scene.wind_tables import Coefficient, Wind

STUDY_KEYS = ("vary", "columns")
OF_STUDY = "unknown key of a scene: it is one of a study, of which set and --set change the scene"
CABLE = "cable"  # name of the only cable
# keys of load cases of suspensions -> why a scene of one cable has none
OF_SUSPENSIONS = {
    "lost": "without it nothing is left",
    "on": "ice and steady wind act on it, there is nothing to choose from",
}


class Gondola(KeyTable):
    """The body on end 2, free along x."""

    mass: Annotated[float, Quantity("kg", 1e-9, 1e15)] = Field(description="Mass of the gondola")
    area: Annotated[float, Quantity("m^2", 1e-12, 1e12)] | None = Field(None, description="Area that the wind sees")
    drag_coefficient: Coefficient | None = Field(None, description="Drag coefficient of that area")


class WinchTable(Drive):
    """The winch that moves the cable."""

    location: Literal["ground", "gondola"] = Field("ground", description="ground (end 1) or gondola (end 2)")
    controller: Controller | None = Field(None, description="What drives the winch")

    def relations(self):
        """Relations: a winch that follows without delay is driven by an integrator."""
        if self.controller is not None:
            yield from self.follows(self.controller)


class CableScene(SceneTable):
    """The contents of a scene file."""

    no_case: ClassVar[KeyTable] = LoadCase.model_construct()

    cable: Cable = Field(description="The cable")
    gondola: Gondola | None = Field(None, description="The body on end 2, free along x")
    winch: WinchTable | None = Field(None, description="The winch that moves the cable")
    wind: Wind | None = Field(None, description="The wind on the gondola")
    ground: Ground | None = Field(None, description="Level of the ground, or [x, z] of points under the cable")
    cases: dict[CaseName, LoadCase] = Field(
        {}, description="Name -> temperature, ice, wind, loads, forces and moves of a load case"
    )
    case: Name | None = Field(None, description="Load case to compute; default: the reference state with its loads")
    limits: Limits = Field({}, description="Name -> what must hold in load cases: a comparison, or {that, cases}")
    exposure: Exposure | None = Field(None, description="Time of one exposure, within which motion blurs the image")
    correction: Correction | None = Field(None, description="The mirror that corrects the image")
    materials: Materials = Field({}, description="Name -> material or rope, over the built-in ones; or their file")
    model: ModelTable = Field(ModelTable(), description="How finely the cable is computed")

    @property
    def cables(self):
        """The cable by its name, as those of a suspension: dict."""
        return {CABLE: self.cable}

    @property
    def loads(self):
        """All point loads: those of the cable, then those of the case."""
        return self.cable.loads + self.load_case.loads

    @property
    def load_paths(self):
        """Name of each point load -> its path in the scene: dict."""
        tables = (("cable", "loads"), self.cable.loads), (("cases", self.case, "loads"), self.load_case.loads)
        return paths_of_loads("", *tables)

    @property
    def forces_on_end_2(self):
        """The forces on end 2 of the cases that have one, a tuple. [N]"""
        return tuple(case.forces.end_2 for case in self.cases.values() if any(case.forces.end_2))

    @property
    def elongation(self):
        """Elongation of the cable by its load case, see `LoadCase.elongation`. [-]"""
        return self.load_case.elongation(self.cable)

    @property
    def wind_diameter(self):
        """Diameter of the cable that the wind sees, see `LoadCase.wind_diameter`. [m]"""
        return self.load_case.wind_diameter(self.cable)

    def relations(self):
        """The case is one of the cases, what it needs of the cable is there, and its loads are on the cable."""
        yield [*case_relations(self.case, self.limits, self.cases), *ground_relations(self.ground)]
        cable = self.cable
        yield [loaded_by_a_case(("cable",), cable, self.cases)]
        yield [relation for name, case in self.cases.items() for relation in case.needs_of(cable, ("cable",), name)]
        for name, case in self.cases.items():
            yield beyond_the_end(("cases", name, "loads"), case.loads, cable.unstretched_length)
            yield self._end_relations(name, case)

    def _end_relations(self, name, case):
        """A gondola takes the force of a case, and the moved ends of the cable are apart; a list as in `relations`."""
        useless_force = self.gondola is None and any(case.forces.end_2)
        message = "end 2 is fixed without a gondola: a force on it changes nothing (moves shifts it)"
        relations = [(("cases", name, "forces", "end_2"), not useless_force, message)]
        if any(case.moves.end_1 + case.moves.end_2):
            components = zip(self.cable.end_1, case.moves.end_1, self.cable.end_2, case.moves.end_2, strict=True)
            squares = ((end_2 + move_2 - end_1 - move_1) ** 2 for end_1, move_1, end_2, move_2 in components)
            text = "moved, the two ends are {:g} m apart".format
            relations.append(limited(("cases", name, "moves"), sum(squares) ** 0.5, SCENE.chord_range, "m", text))
        return relations


TABLES = tables_of(CableScene)


def quantity_of(key):
    """The Quantity that reads a dotted key of a scene (a vector or its components alike); None when none does."""
    return next(filter(None, map(_quantity_in, _fields_of(key))), None)


def field_of(key):
    """The field, of pydantic, that a dotted key of a scene or its beginning names; None when none does."""
    return next(iter(_fields_of(key)), None)


def _fields_of(key):
    """List of the fields, of pydantic, that a dotted key names, or its longest beginning that names one.

    Of the key itself only the first, for one cable before suspensions; of a beginning, as `force` of `force.0`, all.
    """
    from cablestudy.scene.suspension import SUSPENSION_TABLES

    path = split_key(key)
    for length in range(len(path), 0, -1):
        *table, name = path[:length]
        models = [model for pattern, model in TABLES + SUSPENSION_TABLES if matches(pattern, table)]
        fields = [model.model_fields[name] for model in models if name in model.model_fields]
        if fields:
            return fields if length < len(path) else fields[:1]
    return []


def _quantity_in(field):
    """The Quantity of a field of a model, or of the items of a field; None when there is none."""
    return next((part for part in parts_of(field) if isinstance(part, Quantity)), None)


def is_study(document):
    """True if a file is a study rather than a scene."""
    return any(key in document.stated_keys for key in STUDY_KEYS)


def is_suspension(document):
    """True if a scene describes several cables."""
    return any(key in document.stated_keys for key in ("cables", "bodies", "points"))


def refuse_study(document, is_base=False):
    """Refuse a document, or the base of a study, that has a key of studies: SceneError, at that key."""
    for key in STUDY_KEYS:
        if key in document.value:
            place = document.place((key,), of_key=True)
            is_base = is_base or place.name != document.name
            advice = "a base must be a scene" if is_base else "use 'cablestudy sweep'"
            raise refuse(place, f"this is a study (it has the key {key}): {advice}")


def read_scene(document):
    """Check a document with its base files merged, and convert it to a `CableScene` or `SuspensionScene` in SI.

    SceneError for all that is wrong with it, sorted by place.
    """
    for key in STUDY_KEYS:
        if document.is_override((key,)):
            raise refuse(document.place((key,), of_key=True), OF_STUDY, key)
    refuse_study(document)
    if is_suspension(document):
        from cablestudy.scene.suspension import read_suspension

        return read_suspension(document)
    mistakes = list(empty_keys(document, TABLES))
    try:
        scene = CableScene.model_validate(document.value, context={"materials": document.value.get("materials")})
    except ValidationError as error:
        found = findings(error, document.value, TABLES)
        mistakes += [(path, _explain(path, text)) for path, text in found]
        mistakes += case_mistakes_in_file(as_meant(document.value, found))
        raise located(mistakes, document) from None
    if mistakes:
        raise located(mistakes, document)
    return scene


def _explain(path, message):
    """A message; on a key of load cases of suspensions only, the reason why a scene of one cable has none."""
    if path[:1] == ("cases",) and path[-1] in OF_SUSPENSIONS and message.startswith("unknown key"):
        return f"unknown key for one cable: {OF_SUSPENSIONS[path[-1]]}"
    return message


def load_scene(path, sets=(), case=None, read=read_scene):
    """Read a scene file with its base files, change it by the options of a command, and check it: `Document` and scene.

    `path` is a name, or `-` for standard input; `sets` are arguments of `--set`, `key=value` each; `case` is the name
    of the load case that is chosen; `read` checks a `Document` and makes the scene of it. SceneError: all that is
    wrong.
    """
    document = apply_sets(read_document(path), sets, case)
    return document, read(document)


def each_case(document, scene):
    """Yield name, Document and scene of each load case of a scene."""
    for name in scene.cases:
        case_document = document.with_sets([("case", name, f"case {name}")])
        yield name, case_document, read_scene(case_document)


def missing(document, key, command):
    """The SceneError for a dotted key that a scene may lack and a command (for example `windrms`) may not."""
    return refuse(document.place(tuple(key.split("."))), f"missing key: 'cablestudy {command}' needs it", key)
