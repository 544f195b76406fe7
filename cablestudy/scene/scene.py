"""A scene: the file format as typed models. Every value is in SI after reading."""

from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationError, model_validator

from cablestudy.scene.cable_table import Cable, Damping, Load
from cablestudy.scene.document import apply_sets, read_document
from cablestudy.scene.fields import Count, Quantity, Word
from cablestudy.scene.mistakes import collect
from cablestudy.scene.strict_yaml import refuse
from cablestudy.scene.tables import Table

STUDY_KEYS = ("vary", "columns")
DEFAULT_ACCURACY = 1e-4
MAX_ELEMENTS = 1_000_000
MAX_ORDER = 64
MAX_GRAVITY = 1e9

Positive = Annotated[float, Quantity("", positive=True)]
Frequency = Annotated[float, Quantity("Hz", positive=True)]


class Gondola(Table):
    """The body on end 2, free along x.

    Attributes
    ----------
    mass : float
        [kg]
    area, drag_coefficient : float or None
        Seen by the wind: [m^2], [-].
    """

    mass: Annotated[float, Quantity("kg", positive=True)] = Field(description="Mass")
    area: Annotated[float, Quantity("m^2", positive=True)] | None = Field(None, description="Area that the wind sees")
    drag_coefficient: Positive | None = Field(None, description="Drag coefficient of that area")


class Margin(Table):
    """What an automatic gain aims at.

    Attributes
    ----------
    gain_margin : float
        [dB]
    """

    gain_margin: Annotated[float, Quantity("dB", positive=True)] = Field(description="Choose the gain for this margin")


class AutoGain(Table):
    """`gain: {auto: {gain_margin: 6 dB}}`: the gain follows from a margin."""

    auto: Margin = Field(description="What the gain is chosen for")


class Notch(Table):
    """The filter beside the integrator.

    Attributes
    ----------
    frequency : float or str
        `coupled`, `static`, or a frequency. [Hz]
    damping_ratio, rolloff_damping_ratio : float
        Of the notch and of the roll-off. [-]
    rolloff_frequency : float
        [Hz]
    """

    frequency: Annotated[float | str, Quantity("Hz", positive=True, words=("coupled", "static"))] = Field(
        "coupled", description="The gondola frequency that the notch removes: coupled, static, or a frequency"
    )
    damping_ratio: Annotated[float, Quantity("", low=0)] = Field(0.05, description="Damping ratio of the notch")
    rolloff_frequency: Frequency = Field(10.0, description="Frequency of the roll-off")
    rolloff_damping_ratio: Positive = Field(1.0, description="Damping ratio of the roll-off")


def _is_mapping(value):
    """Tag of a gain. pydantic puts it into the path of an error, from where the brackets tell it apart."""
    return "<mapping>" if isinstance(value, (dict, AutoGain)) else "<number>"


def _none_word(value):
    """`none` says that there is no notch; null would say that the key is absent, which gives the default one."""
    return None if value == "none" else value


class Controller(Table):
    """Integrator with notch.

    Attributes
    ----------
    gain : float or AutoGain
        [rad/s]
    notch : Notch or None
        None when the file says `none`.
    """

    gain: Annotated[
        Annotated[Annotated[float, Quantity("rad/s", low=0)], Tag("<number>")] | Annotated[AutoGain, Tag("<mapping>")],
        Discriminator(_is_mapping),
    ] = Field(description="Integral gain, or {auto: {gain_margin: 6 dB}}")
    notch: Annotated[Notch | None, BeforeValidator(_none_word)] = Field(Notch(), description="Notch filter, or none")


class Winch(Table):
    """The winch that moves the cable.

    Attributes
    ----------
    location : str
        `ground` (end 1) or `gondola` (end 2).
    controller : Controller or None
    """

    location: Annotated[str, Word(("ground", "gondola"))] = Field("ground", description="ground (end 1) or gondola")
    controller: Controller | None = Field(None, description="What drives the winch")


class Wind(Table):
    """The wind on the gondola and on the cable.

    Attributes
    ----------
    speed : float
        Mean. [m/s]
    turbulence_intensity, turbulence_rms : float or None
        Exactly one: relative to the mean [-], absolute [m/s].
    length_scale : float
        Of the turbulence. [m]
    air_density : float
        [kg/m^3]
    spectrum, admittance : str
    cable_drag_coefficient : float
        Of the cable across the wind. [-]
    coherence_length : float or None
        Of the turbulence along the cable; None when it follows from frequency, speed and length scale. [m]
    """

    table: ClassVar[str] = "wind"

    speed: Annotated[float, Quantity("m/s", positive=True)] = Field(description="Mean speed")
    turbulence_intensity: Positive | None = Field(None, description="RMS over mean speed (instead of turbulence_rms)")
    turbulence_rms: Annotated[float, Quantity("m/s", positive=True)] | None = Field(
        None, description="RMS of the speed (instead of turbulence_intensity)"
    )
    length_scale: Annotated[float, Quantity("m", positive=True)] = Field(description="Length scale of the turbulence")
    air_density: Annotated[float, Quantity("kg/m^3", positive=True)] = Field(1.2, description="Density of the air")
    spectrum: Annotated[str, Word(("von_karman", "von_karman_exact", "davenport", "kaimal"))] = Field(
        "von_karman", description="Spectrum of the speed"
    )
    admittance: Annotated[str, Word(("vickery", "vickery_squared", "none"))] = Field(
        "vickery", description="How much of the turbulence acts on the whole area at once"
    )
    cable_drag_coefficient: Positive = Field(1.2, description="Drag coefficient of the cable, across the wind")
    coherence_length: Annotated[float, Quantity("m", positive=True)] | None = Field(
        None, description="Coherence length of the turbulence along the cable (default: by frequency, IEC 61400-1)"
    )

    @property
    def turbulence(self):
        """RMS of the speed, given or from the intensity. [m/s]"""
        return self.turbulence_rms if self.turbulence_rms is not None else self.turbulence_intensity * self.speed


class Model(Table):
    """How finely the cable is computed: to an accuracy, or with exactly these elements.

    Attributes
    ----------
    accuracy : float or None
        Largest relative error; 1e-4 when nothing is given. [-]
    elements : int or None
        None when the accuracy decides.
    order : int
        Polynomial order of an element.
    mass : str
        `lumped`, `consistent` or `blended`.
    """

    table: ClassVar[str] = "model"
    optional_groups: ClassVar[bool] = True

    accuracy: Annotated[float, Quantity("", positive=True, high=0.1)] | None = Field(
        None, description="Largest relative error: the cheapest model below it is used (default 1e-4)"
    )
    elements: Annotated[int, Count(1, MAX_ELEMENTS)] | None = Field(
        None, description="Exactly so many elements, without error control (instead of accuracy)"
    )
    order: Annotated[int, Count(1, MAX_ORDER)] = Field(1, description="Polynomial order of each element")
    mass: Annotated[str, Word(("lumped", "consistent", "blended"))] = Field("lumped", description="Mass of an element")

    @model_validator(mode="before")
    @classmethod
    def _default(cls, data):
        return {"accuracy": DEFAULT_ACCURACY} if data == {} else data

    def together(self):
        """Blended mass is a matter of bars."""
        if self.mass == "blended" and self.order != 1:
            yield ("mass",), f"blended needs order 1, and the order is {self.order} (use lumped or consistent)"


class Scene(Table):
    """All that a scene file says.

    Attributes
    ----------
    gravity : float
        [m/s^2]
    cable : Cable
    gondola : Gondola or None
    winch : Winch or None
    wind : Wind or None
    model : Model
    """

    gravity: Annotated[float, Quantity("m/s^2", low=0)] = Field(9.81, description="Acceleration of gravity, along -z")
    cable: Cable = Field(description="The cable")
    gondola: Gondola | None = Field(None, description="The body on end 2, free along x")
    winch: Winch | None = Field(None, description="The winch that moves the cable")
    wind: Wind | None = Field(None, description="The wind on the gondola")
    model: Model = Field(Model(), description="How finely the cable is computed")

    def together(self):
        """A gravity that squares of forces can bear."""
        if self.gravity > MAX_GRAVITY:
            yield ("gravity",), f"must be at most {MAX_GRAVITY:g}, got {self.gravity:g}"


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


def is_study(document):
    """Whether a file is a study rather than a scene."""
    return any(key in document.given for key in STUDY_KEYS)


def read_scene(document):
    """Scene of a document.

    Parameters
    ----------
    document : Document
        With its base files merged.

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        All that is wrong with it, sorted by place.
    """
    for key in STUDY_KEYS:
        if key in document.value:
            place = document.key_place((key,))
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
    document : Document
        What was written, with places.
    scene : Scene

    Raises
    ------
    SceneError
        All that is wrong.
    """
    document = apply_sets(read_document(path), sets)
    return document, read_scene(document)


def missing(document, key, command):
    """The error for a key that a scene may lack and a command may not.

    Parameters
    ----------
    document : Document
        Of the scene.
    key : str
        Dotted, for example `gondola.mass`.
    command : str
        What needs it, for example `windrms`.

    Returns
    -------
    SceneError
    """
    return refuse(document.place(tuple(key.split("."))), f"missing key: 'cablestudy {command}' needs it", key)
