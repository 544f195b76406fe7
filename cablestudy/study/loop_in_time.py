"""Response in time of the winch loop of one cable, for the command `loop`: to a step of the winch, or to a gust."""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.control import loop_response, time_response
from cablestudy.errors import SceneError
from cablestudy.scene.scene import missing
from cablestudy.scene.units import read_positive
from cablestudy.study.table import Field, Table

INPUTS = ("winch", "reference", "gust", "wind")
DISPLACED = ("winch", "reference")  # inputs that are displacements; the others are speeds of the wind
STEP = 1e-3  # of winch or reference, without another size [m]
GUST = 3.0  # standard deviations of the turbulence in a gust or step of the wind without another size
COUNT, MOST = 101, 100_001  # points of time of a table
FINE = 2000  # steps of time at least, of which a table shows some
NOTHING = 1e-13  # over the largest value, below which a value is rounding
DRAG = ("gondola.area", "gondola.drag_coefficient", "wind")


@dataclass(frozen=True)
class TimeOptions:
    """Options of the command as numbers: SceneError for those that are wrong, or have no effect."""

    duration: str  # DURATION, or DURATION:COUNT
    input: str = "winch"  # one of INPUTS
    size: str | None = None
    length: str | None = None  # of a gust

    def __post_init__(self):
        if self.length is not None and self.input != "gust":
            raise SceneError(f"--length: no effect: --input {self.input} is a step")
        _ = self.times, self.stated_size, self.stated_length  # raise SceneError

    @cached_property
    def times(self):
        """Uniform times from zero, of which every `every`-th is in the table. [s]"""
        return np.linspace(0.0, self._end_and_count[0], (self._end_and_count[1] - 1) * self.every + 1)

    @cached_property
    def every(self):
        """Steps of time from one row of the table to the next."""
        return -(-FINE // (self._end_and_count[1] - 1))

    @cached_property
    def _end_and_count(self):
        text, colon, count = self.duration.partition(":")
        option = f"--time {self.duration}"
        end = read_positive(option, text, "s")
        if colon and not (re.fullmatch("[0-9]{1,9}", count.strip()) and 2 <= int(count) <= MOST):
            raise SceneError(f"{option}: COUNT must be a whole number from 2 to {MOST}")
        return end, int(count) if colon else COUNT

    @cached_property
    def stated_size(self):
        """[m] or [m/s], or None."""
        unit = "m" if self.input in DISPLACED else "m/s"
        return None if self.size is None else read_positive(f"--size {self.size}", self.size, unit)

    @cached_property
    def stated_length(self):
        """[s], or None."""
        return None if self.length is None else read_positive(f"--length {self.length}", self.length, "s")


@dataclass(frozen=True)
class TimeCase:
    """What the loop of a case does in time.

    Attributes
    ----------
    options : TimeOptions
    size : float
        Of the input. [m] or [m/s]
    length : float or None
        Of a gust. [s]
    driving : ndarray, shape (m,)
        The input. [m] or [m/s]
    found : TimeResponse
    """

    options: TimeOptions
    size: float
    length: float | None
    driving: np.ndarray
    found: object

    @property
    def time(self):
        """Shape (m,). [s]"""
        return self.options.times

    @property
    def what(self):
        """The input in words."""
        if self.options.input in DISPLACED:
            named = {"winch": "the winch moves", "reference": "the reference of the gondola moves"}
            return f"{named[self.options.input]} by {1e3 * self.size:.4g} mm at once"
        if self.options.input == "gust":
            return f"a 1-cosine gust of {self.size:.4g} m/s within {self.length:.4g} s"
        return f"the wind rises by {self.size:.4g} m/s at once"

    @property
    def notes(self):
        """What happens, and the error: list of str."""
        found, lines = self.found, [f"input: {self.what}"]
        moved = f"gondola: at most {_largest(found.gondola, self.time)}"
        if found.open_loop is not None:
            moved += f"; without the loop {_largest(found.open_loop, self.time)}"
        lines.append(moved)
        lines.append(
            f"winch: at most {_largest(found.winch, self.time)}, and {1e3 * np.abs(found.winch_speed).max():.4g} mm/s"
        )
        return [*lines, f"estimated error by modes left out: {found.error:.1e} of the largest displacement"]


def _largest(value, time):
    place = int(np.argmax(np.abs(value)))
    return f"{1e3 * value[place]:.4g} mm at {time[place]:.4g} s"


def time_case(document, case, options):
    """`TimeCase` of a case.

    Parameters
    ----------
    document : Document
        Of its scene, for the places of mistakes.
    case : Case
        With a winch loop.
    options : TimeOptions

    Raises
    ------
    SceneError
        The scene has no wind, or no size of a gust follows from it.
    NoSolutionError
        The loop is unstable.
    """
    size, length, factor, scene = options.stated_size, options.stated_length, 1.0, case.scene
    if options.input in DISPLACED:
        size = size or STEP
    else:
        for key in DRAG:
            table, _, name = key.rpartition(".")
            if getattr(getattr(scene, table) if table else scene, name) is None:
                raise missing(document, key, f"loop --input {options.input}")
        wind = scene.wind
        size = size or GUST * wind.turbulence
        length = length or wind.length_scale / wind.speed
        factor = wind.air_density * scene.gondola.drag_coefficient * scene.gondola.area * wind.speed  # dF/dv
    components, driving = time_response.step(size), np.full(len(options.times), size)
    if options.input == "gust":
        components, phase = time_response.gust(size, length), options.times / length
        driving = np.where(phase < 1, size / 2 * (1 - np.cos(2 * np.pi * phase)), 0.0)
    places = {"winch": loop_response.WINCH, "reference": loop_response.REFERENCE}
    place = places.get(options.input, loop_response.FORCE)
    found = loop_response.loop_response(case.loop, place, time_response.scaled(components, factor), options.times)
    return TimeCase(options, size, length if options.input == "gust" else None, driving, found)


def time_table(solved):
    """Table of a `TimeCase`: time, input, gondola with and without the loop, movement and speed of the winch."""
    found, displaced = solved.found, solved.options.input in DISPLACED
    mm = 1e3
    columns = {
        Field("time_s", "time", "s"): solved.time,
        Field("input_mm", "input", "mm") if displaced else Field("wind_m_per_s", "wind", "m/s"): solved.driving
        * (mm if displaced else 1.0),
        Field("gondola_mm", "gondola", "mm"): mm * found.gondola,
        Field("gondola_open_loop_mm", "open loop", "mm"): None if found.open_loop is None else mm * found.open_loop,
        Field("winch_mm", "winch", "mm"): mm * found.winch,
        Field("winch_speed_mm_per_s", "speed", "mm/s"): mm * found.winch_speed,
    }
    columns = {field: value for field, value in columns.items() if value is not None}
    shown = np.stack([_rounded(value)[:: solved.options.every] for value in columns.values()], axis=1)
    names = [field.name for field in columns]
    return Table(tuple(columns), [dict(zip(names, row, strict=True)) for row in shown.tolist()])


def _rounded(value):
    """The same without what is rounding of zero."""
    return np.where(np.abs(value) > NOTHING * np.abs(value).max(), value, 0.0)
