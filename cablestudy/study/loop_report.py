"""The loop of winches over frequency; for one cable the table of stability margins too. For the command `loop`."""

from dataclasses import replace

import numpy as np

from cablestudy.control.curves import by_parts
from cablestudy.control.margins import sensitivity
from cablestudy.control.response import Phase
from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.study.column import require
from cablestudy.study.motion_columns import WINCH, loop_columns
from cablestudy.study.one_cable.rows import evaluate_named
from cablestudy.study.ssm_tables import near_poles
from cablestudy.study.table import Field, Table
from cablestudy.study.tolerances import STUDY
from cablestudy.system.state_spaces import StateSpaces

COLUMNS = [column.name for column in loop_columns(WINCH)]
LOOP_KEYS = ("gondola", "winch", "winch.controller")
CURVES = ("open_loop", "sensitivity", "complementary_sensitivity")  # names of columns: L, S, T
# frequencies about a resonance that a table has too, in its half-widths
BESIDE_PEAKS = np.array([-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0])


def loop_table(document, scene, estimate=False):
    """Gain, stability margins and sensitivity of the winch loop of one cable: a `Table` of COLUMNS, and its `Row`.

    With `estimate` also the errors of a fixed number of elements, which cost a second solution. SceneError where the
    `CableScene` has no gondola or controller, at its place in the `Document`.
    """
    require(document, scene, LOOP_KEYS, "loop")
    columns, row = evaluate_named(document, scene, COLUMNS, "loop", estimate)
    return row.table(columns), row


def has_loop(case):
    """True if a case has a loop gain over frequency, which an unstable loop has too."""
    if not case.moves:  # refused before anything was computed
        return False
    try:
        _ = case.analysis.loop_for_margins.stability.gains
    except CablestudyError:
        return False
    return True


def unstable(motion):
    """Reason why a `ClosedLoop` or `DynamicAnalysis` is unstable: tuple of str, empty where it is stable."""
    try:
        motion.check_stable()
    except NoSolutionError as error:
        return (str(error),)
    return ()


def resonances(closed_loop):
    """Poles that make peaks in the response of the measured coordinates to forces, without the loop and with it.

    Tables and pictures over frequency have closer steps near them. A pole p makes a peak if, for some coordinate,

        |r| > c |Re p| |H(i |p|)|;    else a zero close to it cancels it.

    H is the response of the coordinate to a unit force along itself, r the residue of H at p, c `STUDY.cancelled_pole`.

    Returns
    -------
    ndarray, shape (p,)
        p poles in the upper half plane, complex. [rad/s]
    """
    measured, resonant = [closed_loop.outputs[name] for name in closed_loop.body.measured_outputs], []
    motion, actuators = closed_loop.motion, closed_loop.actuators
    forces = motion.c[0][measured].real.T  # unit forces along the measured coordinates
    for loop in (None, closed_loop.loop):
        (system,) = StateSpaces.of_one(motion, loop, actuators).residues(forces[None])
        system = replace(system, outputs=system.outputs[measured], direct=system.direct[measured])
        poles, residue = system.poles, np.abs(system.outputs.T * system.inputs)
        upper = poles.imag > 0
        with np.errstate(divide="ignore", invalid="ignore"):  # on an undamped pole
            response = np.abs(np.diagonal(system.response(1j * np.abs(poles[upper])), axis1=1, axis2=2))
            makes_peak = residue[upper] > STUDY.cancelled_pole * np.abs(poles[upper].real)[:, None] * response
        resonant.append(poles[upper][makes_peak.any(axis=1)])
    return np.concatenate(resonant)


def frequencies_of(closed_loop, frequency_range):
    """Frequencies of a table: those of a range at equal ratios, and others near the resonances. [Hz]

    The range is from `ssm.read_response_range`: lowest and highest frequency [Hz], and how many.
    """
    low, high, count = frequency_range
    on_peaks = near_poles(resonances(closed_loop), BESIDE_PEAKS, low, high)
    return np.unique(np.concatenate([np.geomspace(low, high, count), on_peaks]))


def drawn_frequencies(closed_loop, frequency_range):
    """Frequencies of a picture: those at which margins are searched, and even steps around the circles of L. [Hz]

    Parameters are those of `frequencies_of`; L describes a circle near each pole.
    """
    low, high, _ = frequency_range
    poles, half_angle = resonances(closed_loop)[:, None], np.linspace(-1.5, 1.5, STUDY.circle_points)
    on_circles = (np.abs(poles) - poles.real * np.tan(half_angle)).ravel()
    dense = np.concatenate([closed_loop.stability.gains.frequencies(closed_loop.loop.gain), on_circles]) / (2 * np.pi)
    dense = dense[(dense > low) & (dense < high)]
    return np.unique(np.concatenate([frequencies_of(closed_loop, frequency_range), dense]))


def loop_gain(closed_loop, frequency):
    """L of a `ClosedLoop` that measures k coordinates at frequencies [Hz], complex, shape (m, k, k)."""
    return closed_loop.loop.gain * by_parts(closed_loop.stability.gains.loop_gain, 2j * np.pi * frequency)


def curves(closed_loop, frequency):
    """Loop gain L, sensitivity S = (I + L)^-1 and complementary sensitivity T = S L, complex, shape (3, m, k, k)."""
    loop_gains = loop_gain(closed_loop, frequency)
    with np.errstate(divide="ignore", invalid="ignore"):  # on the pole of an undamped mode L is infinite
        of_loops = sensitivity(loop_gains)
        return np.stack([loop_gains, of_loops, of_loops @ loop_gains])


def singular_values(value):
    """Singular values of matrices, descending, shape (m, k); NaN where an entry is not finite."""
    finite = np.isfinite(value).all(axis=(-2, -1))
    values = np.full(value.shape[:-1], np.nan)
    values[finite] = np.linalg.svd(value[finite], compute_uv=False)
    return values


def decibels(value):
    """20 log10 of the magnitude; minus infinity for zero. [dB]"""
    with np.errstate(divide="ignore"):
        return 20 * np.log10(np.abs(value))


def unwrapped_phase(frequency, value, delay):
    """Phase of a response, unwrapped; that of a delay, by which it turns, is known between frequencies too. [deg]

    `value` is complex, of the response at frequencies [Hz], with a delay [s] as a factor; shape (m,) as the phase.
    """
    turns = delay * frequency
    return Phase()(value * np.exp(2j * np.pi * turns)) - 360 * turns


def response_table(closed_loop, frequency_range):
    """Table over frequency of the loop gain L, the sensitivity S and the complementary sensitivity T of a loop.

    L is a matrix over the measured coordinates, S = (I + L)^-1 and T = S L. Of one coordinate the table has magnitude
    [dB] and phase [deg] of each; of several coordinates the largest and smallest singular value [dB]. It has a row for
    each of `frequencies_of`; cells of values that are not finite are empty.
    """
    frequency = frequencies_of(closed_loop, frequency_range)
    columns = {Field("frequency_Hz", "frequency", "Hz"): frequency}
    for name, value in zip(CURVES, curves(closed_loop, frequency), strict=True):
        title = name.replace("_", " ")
        magnitudes = decibels(singular_values(value)).T
        if len(magnitudes) == 1:
            columns[Field(f"{name}_dB", title, "dB")] = magnitudes[0]
            delay = 0.0 if name == "sensitivity" else closed_loop.loop.law.delay  # the two others have it as a factor
            phase = unwrapped_phase(frequency, value[:, 0, 0], delay)
            columns[Field(f"{name}_phase_deg", f"{title} phase", "deg")] = phase
        else:
            columns[Field(f"{name}_largest_dB", f"{title} largest", "dB")] = magnitudes[0]
            columns[Field(f"{name}_smallest_dB", f"{title} smallest", "dB")] = magnitudes[-1]
    lines = np.stack(list(columns.values()), axis=1).tolist()
    return Table.of(columns, ([cell if np.isfinite(cell) else None for cell in line] for line in lines))
