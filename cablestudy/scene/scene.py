"""A scene: the file format as typed models. Every value is in SI after reading."""

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from cablestudy.scene.cable_table import Cable, Damping, Load
from cablestudy.scene.document import apply_sets, read_document
from cablestudy.scene.fields import Count, Quantity, QuantityOrTable, Table
from cablestudy.scene.mistakes import collect
from cablestudy.scene.strict_yaml import refuse

STUDY_KEYS = ("vary", "columns")
DEFAULT_ACCURACY = 1e-4
MAX_ELEMENTS = 1_000_000
MAX_ORDER = 64

Coefficient = Annotated[float, Quantity("", 1e-6, 1e6)]


class Gondola(Table):
    """The body on end 2, free along x."""

    mass: Annotated[float, Quantity("kg", 1e-9, 1e15)] = Field(description="Mass")
    area: Annotated[float, Quantity("m^2", 1e-12, 1e12)] | None = Field(None, description="Area that the wind sees")
    drag_coefficient: Coefficient | None = Field(None, description="Drag coefficient of that area")


class Margin(Table):
    """What an automatic gain is chosen for."""

    gain_margin: Annotated[float, Quantity("dB", 1e-6, 300)] = Field(description="Choose the gain for this margin")


class AutoGain(Table):
    """`gain: {auto: {gain_margin: 6 dB}}`: the gain follows from a margin."""

    auto: Margin = Field(description="What the gain is chosen for")


class Notch(Table):
    """The filter in series with the integrator."""

    frequency: Annotated[float | str, Quantity("Hz", 1e-9, 1e9, words=("coupled", "static"))] = Field(
        "coupled", description="The gondola frequency that the notch removes: coupled, static, or a frequency"
    )
    damping_ratio: Annotated[float, Quantity("", 0, 1e6)] = Field(0.05, description="Damping ratio of the notch")
    rolloff_frequency: Annotated[float, Quantity("Hz", 1e-9, 1e9)] = Field(
        10.0, description="Frequency of the roll-off"
    )
    rolloff_damping_ratio: Annotated[float, Quantity("", 1e-9, 1e6)] = Field(
        1.0, description="Damping ratio of the roll-off"
    )


def _none_word(value):
    """None for the word `none`, which switches the notch off; null means an absent key, and the default notch."""
    return None if value == "none" else value


class Controller(Table):
    """Integrator with notch. `notch` is None when the file says `none`."""

    gain: Annotated[float | AutoGain, QuantityOrTable("rad/s", 0, 1e12, table=AutoGain)] = Field(
        description="Integral gain, or {auto: {gain_margin: 6 dB}}"
    )
    notch: Annotated[Notch | None, BeforeValidator(_none_word)] = Field(Notch(), description="Notch filter, or none")


class Winch(Table):
    """The winch that moves the cable."""

    location: Literal["ground", "gondola"] = Field("ground", description="ground (end 1) or gondola (end 2)")
    controller: Controller | None = Field(None, description="What drives the winch")


class Wind(Table):
    """The wind on the gondola and on the cable."""

    table: ClassVar[str] = "wind"

    speed: Annotated[float, Quantity("m/s", 1e-6, 1e6)] = Field(description="Mean speed")
    turbulence_intensity: Annotated[float, Quantity("", 1e-12, 1e6)] | None = Field(
        None, description="RMS over mean speed (instead of turbulence_rms)"
    )
    turbulence_rms: Annotated[float, Quantity("m/s", 1e-12, 1e6)] | None = Field(
        None, description="RMS of the speed (instead of turbulence_intensity)"
    )
    length_scale: Annotated[float, Quantity("m", 1e-9, 1e9)] = Field(description="Length scale of the turbulence")
    air_density: Annotated[float, Quantity("kg/m^3", 1e-12, 1e6)] = Field(1.2, description="Density of the air")
    spectrum: Literal["von_karman", "von_karman_exact", "davenport", "kaimal"] = Field(
        "von_karman", description="Spectrum of the speed"
    )
    admittance: Literal["vickery", "vickery_squared", "none"] = Field(
        "vickery", description="How much of the turbulence acts on the whole area at once"
    )
    cable_drag_coefficient: Coefficient = Field(1.2, description="Drag coefficient of the cable, across the wind")
    coherence_length: Annotated[float, Quantity("m", 1e-9, 1e12)] | None = Field(
        None, description="Coherence length of the turbulence along the cable (default: by frequency, IEC 61400-1)"
    )

    @property
    def turbulence(self):
        """RMS of the speed, given or from the intensity. [m/s]"""
        return self.turbulence_rms if self.turbulence_rms is not None else self.turbulence_intensity * self.speed


class Model(Table):
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


class Scene(Table):
    """The contents of a scene file."""

    gravity: Annotated[float, Quantity("m/s^2", 0, 1e6)] = Field(9.81, description="Acceleration of gravity, along -z")
    cable: Cable = Field(description="The cable")
    gondola: Gondola | None = Field(None, description="The body on end 2, free along x")
    winch: Winch | None = Field(None, description="The winch that moves the cable")
    wind: Wind | None = Field(None, description="The wind on the gondola")
    model: Model = Field(Model(), description="How finely the cable is computed")


# Where each mapping of the file lies ("*": any index) and which model reads it.
TABLES = {
    (): Scene,
    ("cable",): Cable,
    ("cable", "damping"): Damping,
    ("cable", "loads", "*"): Load,
    ("gondola",): Gondola,
    ("winch",): Winch,
    ("winch", "controller"): Controller,
    ("winch", "controller", "gain"): AutoGain,
    ("winch", "controller", "gain", "auto"): Margin,
    ("winch", "controller", "notch"): Notch,
    ("wind",): Wind,
    ("model",): Model,
}


def quantity_of(key):
    """The Quantity that reads a dotted key of a scene (a point or a vector by its components); None when none does."""
    *path, name = ("*" if part.isdigit() else part for part in key.split("."))
    model = TABLES.get(tuple(path))
    field = model and model.model_fields.get(name)
    kinds = [field.annotation, *field.metadata] if field else []
    while kinds:
        kind = kinds.pop()
        if isinstance(kind, Quantity):
            return kind
        kinds += [*getattr(kind, "__metadata__", ()), *get_args(kind)]
    return None


def is_study(document):
    """Whether a file is a study rather than a scene."""
    return any(key in document.given for key in STUDY_KEYS)


def read_scene(document):
    """Scene of a Document with its base files merged.

    Raises
    ------
    SceneError
        All that is wrong with it, sorted by place.
    """
    for key in STUDY_KEYS:
        if key in document.value:
            place = document.place((key,), of_key=True)
            raise refuse(place, f"this is a study (it has the key {key}): use 'cablestudy sweep'")
    try:
        return Scene.model_validate(document.value)
    except ValidationError as error:
        raise collect(error, document, TABLES) from None


def load_scene(path, sets=()):
    """Read a scene file with its base files and `--set` options.

    Parameters
    ----------
    path : str or path-like
        `-` is standard input.
    sets : sequence of str
        `key=value` each.

    Returns
    -------
    tuple of (Document, Scene)
        What was written, with places; the same in SI.

    Raises
    ------
    SceneError
        All that is wrong.
    """
    document = apply_sets(read_document(path), sets)
    return document, read_scene(document)


def missing(document, key, command):
    """The SceneError for a dotted key that a scene may lack and a command (for example `windrms`) may not."""
    return refuse(document.place(tuple(key.split("."))), f"missing key: 'cablestudy {command}' needs it", key)
