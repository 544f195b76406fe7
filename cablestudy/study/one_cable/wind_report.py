"""Table of the command `windrms`: of a gondola on its cable, or of a cable with fixed ends."""

from dataclasses import replace
from math import ceil, floor

import numpy as np

from cablestudy.errors import CablestudyError
from cablestudy.study.columns import find
from cablestudy.study.motion_columns import GONDOLA_X
from cablestudy.study.notes import beyond_linear, gondola_notes, growing_damping, larger_by_loop, slack_warning
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.case_modes import modes
from cablestudy.study.one_cable.rows import evaluate_named
from cablestudy.study.one_cable.system import analyses_of_winds
from cablestudy.study.refinement import with_accuracy
from cablestudy.study.table import Field
from cablestudy.study.tolerances import STUDY
from cablestudy.system.hanging_cables import UNDAMPED, Cables
from cablestudy.wind.drag import shedding_frequencies
from cablestudy.wind.imaging import image_weights

PARTS = {"gondola": ("",), "cable": ("_cable_wind",), "both": ("", "_cable_wind", "_all_wind")}
CLOSED = ("gondola_rms", "gondola_rms_velocity")
OPEN = tuple(f"{name}_open_loop" for name in CLOSED)
LOOP = ("gain_margin", "phase_margin", "bandwidth", "largest_gain")
GONDOLA = ("gondola_frequency", "gondola_frequency_static", "gondola_damping_ratio")
CABLE = ("midspan_rms", "tension_rms", "cable_frequency")
TENSION = ("least_tension", "slack_probability")
BELOW = (0.1, 1.0, 10.0)  # frequencies up to which the share of the variance is given [Hz]
CABLE_NOTE = (
    "wind on the cable: linear drag of turbulence that has the same spectrum in all directions, across or along the "
    "cable's vertical plane, whichever moves "
)
OF_GONDOLA = "the gondola more; uncorrelated with the force on the gondola"
OF_BARE_CABLE = "it more; about the equilibrium without wind"


def wind_table(document, scene, on=None, estimate=False):
    """Table of the motion in turbulent wind, of the gondola or of a cable without one, for the command `windrms`.

    The gondola moves with the winch loop closed if the scene has a controller.

    Parameters
    ----------
    document : Document
        File of the scene, for the positions of mistakes.
    scene : CableScene
    on : {"gondola", "cable", "both"}, optional
        On which the wind acts; by default the gondola where there is one.
    estimate : bool
        Whether to estimate the errors of a fixed number of elements.

    Returns
    -------
    table : Table
        One row: RMS, peaks, stability margins and shares of the variance.
    row : Row
        The same results with their errors and notes.
    remarks : tuple of str
        Notes and warnings that belong to no column.

    Raises
    ------
    SceneError
        The scene has no wind, or no gondola on which it is to act.
    """
    bare = scene.gondola is None and on in (None, "cable")
    on = on or "gondola"
    names = (*CABLE, *_tensions(scene)) if bare else _names(scene, PARTS[on])
    columns, row = evaluate_named(document, scene, names, "windrms", estimate)
    further_cells, remarks = [], ()
    if not row.failed:
        further_cells = [] if bare else _variance_cells(row.case, on)
        remarks = (*_vortices(row.case), *slack_warning(row)) if bare else _remarks(scene, row, on)
    if bare or on != "gondola":
        row = replace(row, notes=(*row.notes, CABLE_NOTE + (OF_BARE_CABLE if bare else OF_GONDOLA)))
    return row.table(columns, further_cells), row, remarks


def _variance_cells(case, on):
    """Cells on the variance of the gondola's displacement, which are no columns: list of (Field, float)."""
    winds = analyses_of_winds(case, on)
    variances = np.array([wind.rms([GONDOLA_X], "value", open_loop=False)[0] ** 2 for wind in winds])
    shares = np.array([wind.response.shares_below(GONDOLA_X, BELOW) for wind in winds])
    total = variances.sum()
    weights = variances / total if total else variances
    cells = [
        (Field(f"variance_share_below_{limit:g}_Hz", f"variance share below {limit:g} Hz"), share)
        for limit, share in zip(BELOW, (weights @ shares).tolist(), strict=True)
    ]
    error = max(wind.response.integration_error for wind in winds)
    return [*cells, (Field("integration_error", "integration error"), error)]


def _remarks(scene, row, on):
    """Notes and warnings on the motion of a gondola in the wind, `row` with its results: tuple of str."""
    cells = row.cells
    remarks = (*(f"note: {line}" for line in gondola_notes(row.case)), *_vortices(row.case))
    remarks += growing_damping(scene)
    if (peak := cells.get("peak_mm")) is not None:
        remarks += beyond_linear([("gondola", peak, find("linear_range").compute(row.case)[0])])
    closed, rest = (f"gondola_rms{state}{PARTS[on][-1]}_mm" for state in ("", "_open_loop"))
    if closed in cells:
        remarks += larger_by_loop([("gondola", cells[closed], cells[rest])])
    return remarks + slack_warning(row)


def _names(scene, parts):
    """Names of the columns of `wind_table`; `parts` are the name parts of the winds, from PARTS."""
    names = [name + part for part in parts for name in OPEN] + list(GONDOLA)
    if scene.winch is not None and scene.winch.controller is not None:
        names = [name + part for part in parts for name in CLOSED] + list(LOOP) + names
        names += ["winch_rms_speed", "winch_peak_speed"] if scene.winch.max_speed is not None else []
    if "" in parts:
        names += ["mean_displacement"] if scene.wind is not None and scene.wind.mean else []
        names += ["peak", *image_weights(scene.exposure, scene.correction)]
    return [*names, *_tensions(scene, "" in parts)]


def _tensions(scene, in_wind=True):
    """Names of the columns of tensions, `in_wind` or at rest alone, and over the strength, if that is known."""
    strong = scene.cable.section_breaking_force is not None
    at_rest = ["utilisation"] if strong else []
    return [*at_rest, *(["peak_utilisation"] if strong else []), *TENSION] if in_wind else at_rest


def _vortices(case):
    """Yield a note, at most one, on modes of the cable among the frequencies at which it sheds vortices."""
    if case.scene.wind_diameter is None:
        return
    low, _, high = shedding_frequencies(case.scene.wind, case.scene.wind_diameter)
    beginning = f"note: the cable sheds vortices at {low:.3g} to {high:.3g} Hz"
    try:
        count, spacing = modes_between(case, low, high)
    except CablestudyError as error:
        yield f"{beginning}; which modes it has there is not known: {error}"
        return
    if count and spacing is None:
        yield f"{beginning}, where it has {count} mode{'s' if count > 1 else ''} across its axis"
    elif count:
        yield (
            f"{beginning}, where it has about {count} modes across its axis, every {spacing:.3g} Hz in each plane "
            f"(an estimate from the travel time of transverse waves)"
        )


def modes_between(case, low, high):
    """Number of modes of a case in a range of frequencies [Hz], of both planes, axial ones not counted; and a spacing.

    The spacing is the distance of neighbours in one plane [Hz] where the count is an estimate from the travel time of
    waves, else None. NoSolutionError or ConvergenceError where the modes cannot be computed.
    """
    time = transverse_travel_time(case)
    if 2 * high * time > STUDY.counted_modes:
        return 2 * max(floor(2 * high * time) - ceil(max(2 * low * time, 1)) + 1, 0), 1 / (2 * time)
    computed = modes(CableCase(with_accuracy(case.scene, 1e-3)), upto=high)[1]
    kinds = [kind for kind, frequency in zip(computed.kind, computed.frequency, strict=True) if frequency >= low]
    return sum(kind != "axial" for kind in kinds), None


def transverse_travel_time(case):
    """Travel time of a transverse wave from end to end, see `Cables.travel_time`. [s]"""
    return float(Cables(case.results.catenary.take(np.array([case.index])), UNDAMPED).travel_time[0])
