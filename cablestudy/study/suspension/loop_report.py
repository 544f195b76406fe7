"""Tables of the command `loop` for a suspension: its margins, singular values over frequency, response in time."""

import numpy as np

from cablestudy.errors import NoSolutionError
from cablestudy.scene.scene import missing
from cablestudy.scene.suspension_tables import MOTIONS
from cablestudy.study.loop_in_time import OF_WIND, TimeCase, remarks_of
from cablestudy.study.loop_report import CURVES, decibels, over_frequency
from cablestudy.study.ssm import number_of
from cablestudy.study.suspension.loop_in_time import GUST, delayed_up_to, in_time, unit_of
from cablestudy.study.suspension.wind_report import coordinate_table, loop_table, made
from cablestudy.study.table import Field
from cablestudy.system.suspension import AXES

TABLES = {"loop": loop_table, "coordinates": coordinate_table}


def check_control(document, scene):
    """Refuse a suspension without a loop: SceneError."""
    if not scene.control:
        raise missing(document, "control", "loop")


def loop_tables(case, only=None):
    """The tables `loop`, and `coordinates` with the margin of each alone, of a `SuspensionCase`: dict; or one of them.

    And why cells of them are empty: tuple of str.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no loop.
    """
    return made(case, {name: make for name, make in TABLES.items() if only in (None, name)})


def unstable(movement):
    """Why a `Movement` is unstable: tuple of str, empty where it is stable."""
    try:
        movement.check_stable()
    except NoSolutionError as error:
        return (str(error),)
    return ()


def response_table(movement, span):
    """Table of the singular values [dB] of L, S = (I + L)^-1 and T = S L at what is measured, over frequency.

    Parameters
    ----------
    movement : Movement
    span : (float, float, int)
        From `ssm.read_span`. Poles of the closed loop in the range have rows of their own beside these.
    """
    (low, high, count), loop = span, movement.loop
    own = np.abs(loop.poles[loop.poles.imag > 0]) / (2 * np.pi)
    frequency = np.unique(np.concatenate([np.geomspace(low, high, count), own[(own > low) & (own < high)]]))
    gain = loop.gain * movement.gains.loop_gain(2j * np.pi * frequency)
    sensitivity = np.linalg.inv(np.eye(gain.shape[-1]) + gain)
    columns = {}
    for name, value in zip(CURVES, (gain, sensitivity, sensitivity @ gain), strict=True):
        title = name.replace("_", " ")
        values = decibels(np.linalg.svd(value, compute_uv=False))
        columns[Field(f"{name}_largest_dB", f"{title} largest", "dB")] = values[:, 0]
        columns[Field(f"{name}_smallest_dB", f"{title} smallest", "dB")] = values[:, -1]
    return over_frequency(frequency, columns)


def time_case(document, case, options):
    """`TimeCase` of a suspension: one coordinate of its pose after a step of a winch or a reference, or in a gust.

    Parameters
    ----------
    document : Document
        Of its scene, for the places of mistakes.
    case : SuspensionCase
        With a loop.
    options : TimeOptions

    Raises
    ------
    SceneError
        An unknown input or output, or the scene has no wind for it.
    NoSolutionError, ConvergenceError
        The loop is unstable, or there is none.
    """
    movement, scene = case.in_wind.movement, case.scene
    body = movement.equilibrium.suspension.body_names[movement.body]
    winches = [f"winch.{name}" for name in scene.winches]
    references = [f"reference.{name}" for name in movement.measured]
    outputs = [f"{body}.{name}" for name in movement.measured]
    kind = input_ = options.input or winches[0]
    number_of("--input", kind, [*winches, *references, *OF_WIND])
    shown = number_of("--output", options.output, outputs) if options.output else 0
    if kind in references and not options.output:
        shown = references.index(kind)
    if kind in OF_WIND:
        if scene.wind is None:
            raise missing(document, "wind", f"loop --input {kind}")
        asked, input_ = options.gust(scene.wind, scene.wind.turbulence[0]), GUST
    elif kind in references:
        unit = unit_of(movement.measured[references.index(kind)])
        asked = options.step(f"the {kind} moves", unit)
    else:
        winch = scene.winches[kind.removeprefix("winch.")]
        asked = options.step(f"{kind} reels in" if winch.direction is None else f"{kind} moves its end")
    moved = f"{body}.{AXES[MOTIONS.index(movement.measured[shown])]}"
    found = in_time(movement, moved, input_, asked.components, options.times).times(asked.size)
    unit = f"m{unit_of(movement.measured[shown])}"
    dampings = [cable.damping for cable in scene.cables.values()]
    remarks = remarks_of(scene.control, delayed_up_to(movement.loop), found, dampings)
    return TimeCase(options, asked, found, movement.loop.gain, outputs[shown], unit, tuple(winches), remarks)
