"""Picture of a body, or of a cable at mid-span, in the wind: spectra, cumulative variance, ellipses of its motion."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

import cablestudy.plots.style as style
from cablestudy.errors import ConvergenceError, NoSolutionError, NothingToDrawError
from cablestudy.plots.words import quantity_text, shortened
from cablestudy.study.ssm_tables import near_poles
from cablestudy.study.suspension.wind_columns import DISPLACEMENTS, TURNS
from cablestudy.wind.spectrum import admittance, speed_spectrum

FREQUENCIES, CURVE_POINTS = (1e-3, 1e2), 1200  # frequencies of a picture [Hz], and how many of equal ratios
NARROW_POLE = 0.3  # damping ratio below which a pole gets frequencies of its own
HALF_WIDTHS = np.sinh(np.linspace(-3.6, 3.6, 57))  # distances of these frequencies from the pole, in its half-widths
SHOWN_DECADES = 10  # that are shown below the largest value of a spectrum
PAIRS = ((0, 1), (0, 2), (1, 2))
COLOURS, WIDTHS = (style.BLUE, style.GREEN, style.ORANGE), (1.8, 1.2, 0.7)
MM = 1e3
MIDSPAN = ".midspan"  # of a cable, along the axes of its chord frame
CHORD_FRAME = {"x": "along the chord", "y": "in the cable's plane", "z": "across it"}
KINDS = (DISPLACEMENTS, MM, "displacement", "mm"), (TURNS, 1e6, "rotation", "µrad")  # axes, scale, name and unit


@dataclass(frozen=True)
class DrawnState:
    """Curves that are drawn of one state of control, such as "winches at rest"."""

    label: str
    colour: str
    dashes: str
    spectra: dict  # output -> spectrum, shape (f,) [m^2/Hz], [rad^2/Hz]
    rms: dict  # output -> RMS [m], [rad]
    covariance: np.ndarray  # shape (3, 3): of the displacements of the point whose ellipses are drawn [m^2]
    spectra_of_last: dict  # `spectra` by the last of several winds alone

    def together(self, names):
        """Sum of the spectra, and root of the sum of variances, of some outputs."""
        return sum(self.spectra[name] for name in names), np.sqrt(sum(self.rms[name] ** 2 for name in names))


@style.styled
def wind_response(winds, at_rest=None, on=None):
    """Figure of the motion of a body in turbulent wind: spectra, cumulative variance, and ellipses of the RMS.

    The body is that of the control loop, or the first one; without any free body it is the first cable at mid-span. The
    motion is drawn with the winches at rest, with the loop and, if there are actuators, with the loop but without them.
    Above is the spectrum of the wind speed.

    `winds` are a stable `DynamicAnalysis` for each wind; several winds are uncorrelated: their spectra add. `at_rest`
    are those with the winches at rest, by default from `winds`. `on` is the name of the part that the wind blows on,
    for the title; by default the body. NothingToDrawError if nothing moves; NoSolutionError or ConvergenceError if
    there is no response, or it is outside the range of a picture.
    """
    closed_loop = winds[0].closed_loop
    body, point = _drawn(closed_loop)
    names = [f"{body}.{axis}" for axis in (*DISPLACEMENTS, *TURNS) if f"{body}.{axis}" in closed_loop.outputs]
    states_of_control = _states_of_control(winds, at_rest or winds, point)
    frequency = _grid(states_of_control, names)
    states = _drawn_states(names, point, frequency, states_of_control)
    kinds = _kinds(states, names)  # displacements, rotations, or both
    if not kinds:
        raise NothingToDrawError(f"the wind does not move {body.removesuffix(MIDSPAN)}: there is nothing to draw")
    _check_range(states, kinds)
    extended = np.linalg.matrix_rank(states[0].covariance) > 1  # the point moves in a plane, or in space
    heights = (1.3, 2.4, 1.6, 2.8) if extended else (2, 2, 2)
    drawn = on or f"{body.removesuffix(MIDSPAN)}{_one_of_several(closed_loop, body)}"
    title = f"Wind at {quantity_text(winds[0].scene.wind.speed, 'm/s')} on {drawn}"
    figure = style.new_figure(0.8 + 1.2 * sum(heights), title)
    grid = figure.add_gridspec(len(heights), 2, height_ratios=heights)
    shared, high = figure.add_subplot(grid[0, :]), _highest(frequency, states, kinds)
    _speed(shared, winds, frequency[frequency <= high], body)
    shared.tick_params(labelbottom=len(kinds) > 1)  # wider than the axes below it
    for column, kind in enumerate(kinds):
        columns = column if len(kinds) > 1 else slice(None)
        upper, lower = (figure.add_subplot(grid[row, columns], sharex=shared) for row in (1, 2))
        _spectra(upper, frequency, states, kind, several=len(winds) > 1)
        _variance(lower, frequency, states, kind)
        figure.align_ylabels([shared, upper, lower] if not column else [upper, lower])
    shared.set_xlim(frequency[0], high)
    if extended:
        _draw_rms_ellipses(figure, grid, states, winds[0], point)
    return figure


def _one_of_several(closed_loop, body):
    """End of a heading where the body that is drawn is not the only one that moves, else an empty text."""
    moving = {name.partition(".")[0] for name in closed_loop.outputs} & set(closed_loop.scene.bodies)
    return f" (1 of {len(moving)} bodies)" if body in moving and len(moving) > 1 else ""


def _kinds(states, names):
    """KINDS of motion that there are: list of (names of its outputs that move, scale, name, unit)."""
    moving = [name for name in names if states[0].rms[name] > 0]
    kinds = [([name for name in moving if name.rpartition(".")[2] in axes], *look) for axes, *look in KINDS]
    return [(outputs, *look) for outputs, *look in kinds if outputs]


def _check_range(states, kinds):
    """Refuse spectra that a picture cannot have."""
    spectra = [scale**2 * state.spectra[name] for state in states for names, scale, *_ in kinds for name in names]
    if not (np.isfinite(spectra).all() and all((spectrum > 0).any() for spectrum in spectra)):
        raise NoSolutionError("the response spectrum is too large or too small for a picture")


def _speed(axes, winds, frequency, body):
    """Draw the spectrum of the longitudinal wind speed, and of its average over the body."""
    wind, airflow, equilibrium = winds[0].scene.wind, winds[0].airflow, winds[0].equilibrium
    bodies = equilibrium.suspension.body_names
    on_bodies = body in bodies and any(not one.airflow.direction_name for one in winds)
    of_speed = speed_spectrum(frequency, wind.speed, wind.turbulence[0], wind.length_scale, wind.spectrum)
    axes.loglog(frequency, of_speed, color=style.BLUE, label="wind speed")
    area = airflow.areas(equilibrium)[bodies.index(body)] if on_bodies else 0.0
    if area and wind.admittance != "none":
        averaged = of_speed * admittance(frequency, wind.speed, area, wind.admittance)
        axes.loglog(frequency, averaged, color=style.BLUE, ls="--", label=f"averaged over {body}")
    axes.set_ylabel("spectrum of the\nwind speed [(m/s)²/Hz]")
    axes.legend(loc="lower left")


def _drawn(closed_loop):
    """Names of the body or mid-span whose spectra are drawn, and of the point (it, or its marker) with the ellipses."""
    scene, outputs = closed_loop.scene, closed_loop.outputs
    owners = [name.rpartition(".")[0] for name in outputs if ".tension_" not in name]
    if scene.control:
        body = closed_loop.body.name
    elif owners:
        body = owners[0] if owners[0].endswith(MIDSPAN) else owners[0].partition(".")[0]
    else:
        raise NothingToDrawError("nothing is free to move: there is nothing to draw")
    markers = [f"{body}.{name}" for name in (scene.bodies[body].markers if body in scene.bodies else ())]
    corrected = scene.correction.marker if scene.correction else None
    return body, corrected if corrected in markers else markers[0] if markers else body


def _grid(states_of_control, names):
    """Frequencies of FREQUENCIES with equal ratios, and closer ones near the narrow poles of some outputs. [Hz]"""
    poles = [np.zeros(0)]
    for *_, winds, open_loop in states_of_control:
        with suppress(NoSolutionError, ConvergenceError):  # which is not drawn then
            poles += [wind.response_of(open_loop).resonances(names) for wind in winds]
    poles = np.concatenate(poles)
    poles = poles[np.abs(poles.real) < NARROW_POLE * np.abs(poles)]
    on_peaks = near_poles(poles, HALF_WIDTHS, *FREQUENCIES)
    return np.unique(np.concatenate([np.geomspace(*FREQUENCIES, CURVE_POINTS), on_peaks]))


def _share_below(frequency, spectrum):
    """Share of the variance below each frequency, by trapezoids, shape (f,). [-]"""
    variance = np.diff(frequency) * (spectrum[1:] + spectrum[:-1]) / 2  # between two frequencies
    return np.concatenate([[0.0], np.cumsum(variance)]) / variance.sum()


def _states_of_control(winds, at_rest, point):
    """States of control that are drawn, that of `winds` last: list of (label, colour, dashes, analyses, open loop).

    With the winches at rest, and with the loop, are the RMS of the tables `open_loop` and `motion`, with actuators.
    """
    closed_loop = winds[0].closed_loop
    rest = "at mid-span" if point.endswith(MIDSPAN) else "without control"
    rest = f"winch{'es' * (len(closed_loop.winches) != 1)} at rest" if closed_loop.winches else rest
    controlled, without = winds[0].response.loop, [winds[0].without_actuators] if closed_loop.actuators else []
    if not controlled and not without:
        return [(rest, style.RED, "-", at_rest, True)]
    if not controlled:
        return [
            ("without actuators", style.GREY, "--", without, True),
            ("with actuators", style.RED, "-", winds, False),
        ]
    if not without:
        return [(rest, style.GREY, "--", at_rest, True), ("winch loop closed", style.RED, "-", winds, False)]
    return [
        (f"actuators, {rest}", style.GREY, ":", at_rest, True),
        ("loop, no actuators", "#000000", "--", without, False),
        ("loop and actuators", style.RED, "-", winds, False),
    ]


def _drawn_states(names, point, frequency, states_of_control):
    """The `DrawnState` of each state of control, except those without a response, such as unstable ones."""
    *others, last = states_of_control
    drawn = []
    for state in others:
        with suppress(NoSolutionError, ConvergenceError):
            drawn.append(_drawn_state(names, point, frequency, *state))
    return [*drawn, _drawn_state(names, point, frequency, *last)]


def _drawn_state(names, point, frequency, label, colour, dashes, winds, open_loop):
    """Compute the `DrawnState` of the outputs `names`, such as `camera.x`, and of the ellipses of a point.

    The point is a body, a marker, or a cable at mid-span. Spectra and covariances of the winds, which are uncorrelated,
    add; `open_loop` says whether the winches are at rest.
    """
    of_point = [f"{point}.{axis}" for axis in DISPLACEMENTS]  # outputs, of which some may be held
    spectra, variances, covariance = {}, {}, np.zeros((3, 3))
    for wind in winds:
        response = wind.response_of(open_loop)
        outputs = list(dict.fromkeys([*names, *(name for name in of_point if name in response.names)]))
        response.check_damped(outputs)
        # two displacements of the point are summed, since covariances follow from the variances of such sums
        pairs = [[of_point[axis] for axis in pair if of_point[axis] in outputs] for pair in PAIRS]
        computed = response.spectra(frequency, _combinations(response.names, [*([name] for name in outputs), *pairs]))
        of_outputs, of_sums = computed[: len(outputs)], computed[len(outputs) :]
        spectra_of_wind = dict(zip(outputs, of_outputs, strict=True))
        table = response.variances
        variances_of_wind = {name: table.weighted["value"][table.rows[name]] for name in outputs}
        covariance += _covariance(frequency, spectra_of_wind, of_sums, variances_of_wind, of_point)
        spectra = {name: spectra.get(name, 0.0) + spectrum for name, spectrum in spectra_of_wind.items()}
        variances = {name: variances.get(name, 0.0) + variance for name, variance in variances_of_wind.items()}
    rms = {name: np.sqrt(value) for name, value in variances.items()}
    return DrawnState(label, colour, dashes, spectra, rms, covariance, spectra_of_last=spectra_of_wind)


def _combinations(names, sums):
    """Matrix of sums of outputs, shape (all outputs, sums): each column has a 1 for each name in one of the sums."""
    combinations = np.zeros((len(names), len(sums)))
    for column, summed in enumerate(sums):
        combinations[[names.index(name) for name in summed], column] = 1.0
    return combinations


def _covariance(frequency, spectra, spectra_of_sums, variances, names):
    """Covariance of the three displacements of a point, shape (3, 3): cov(a, b) = (var(a + b) - var(a) - var(b))/2.

    From their spectra and those of the sums of PAIRS, scaled to their variances, which have all frequencies.
    """
    in_range = np.array([np.trapezoid(spectra[name], frequency) if name in spectra else 0.0 for name in names])
    covariance = np.diag(in_range)
    for (a, b), of_sum in zip(PAIRS, np.trapezoid(spectra_of_sums, frequency), strict=True):
        covariance[a, b] = covariance[b, a] = (of_sum - in_range[a] - in_range[b]) / 2
    exact = np.array([variances.get(name, 0.0) for name in names])
    scale = np.sqrt(exact / np.where(in_range > 0, in_range, 1.0))
    return covariance * np.outer(scale, scale)


def _highest(frequency, states, kinds):
    """Power of ten above all frequencies at which a spectrum is SHOWN_DECADES below the largest of its kind. [Hz]"""
    last = frequency[1]
    for names, *_ in kinds:
        spectra = np.array([state.spectra[name] for state in states for name in names])
        last = max(last, frequency[(spectra > 10.0**-SHOWN_DECADES * spectra.max()).any(axis=0)].max())
    return min(10.0 ** np.ceil(np.log10(last)), frequency[-1])


def _spectra(axes, frequency, states, kind, several):
    """Draw the spectra of displacements, or of rotations, of a body or a mid-span in all states of control.

    A single output has the colour of its state, several outputs have the colours of their axes. If there are `several`
    winds, the last of them on the cable, its share of the spectrum of the first output is drawn too.
    """
    names, scale, motion, unit = kind
    for state in states:
        for name in names:
            axis = name.rpartition(".")[2]
            look = {"color": COLOURS["xyz".index(axis[-1])], "lw": WIDTHS["xyz".index(axis[-1])], "ls": state.dashes}
            words = CHORD_FRAME[axis] if f"{MIDSPAN}." in name else axis
            look["label"] = words if state is states[-1] else None
            if len(names) == 1:
                look = {"color": state.colour, "lw": 1.3, "ls": state.dashes, "label": state.label}
            axes.loglog(frequency, scale**2 * state.spectra[name], **look)
    largest = max(scale**2 * state.spectra[name].max() for state in states for name in names)
    axes.set_ylim(10.0 ** (np.ceil(np.log10(largest)) - SHOWN_DECADES), 10 * largest)
    axes.tick_params(labelbottom=False)
    if several:
        by_cable = scale**2 * states[-1].spectra_of_last[names[0]]
        axes.loglog(frequency, by_cable, color=style.BLUE, ls="--", label="by the wind on the cable")
    above = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.97), "ncols": 3, "borderaxespad": 0.1}
    axes.legend(**(above if several else {"loc": "lower left", **style.BOX}))  # the third curve would be behind the box
    axes.set_ylabel(f"spectrum of\n{motion}s [{unit}²/Hz]")


def _variance(axes, frequency, states, kind):
    """Draw the share of the variance of a kind of motion below each frequency, and state its RMS."""
    names, scale, _, unit = kind
    for state in states:
        spectrum, rms = state.together(names)
        below = _share_below(frequency, spectrum)
        label = f"{state.label}: {quantity_text(scale * rms, unit)} RMS"
        axes.semilogx(frequency, below, color=state.colour, ls=state.dashes, label=label)
    axes.set_ylabel("share of the\nvariance below")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylim(0, 1.1 + 0.17 * len(states))
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.legend(loc="upper left", fontsize=7)


def _draw_rms_ellipses(figure, grid, states, analysis, point):
    """Draw the RMS displacement of a point by direction, as ellipses in two planes, in the last row of a grid.

    The planes are the horizontal one, and the vertical one along the mean wind. The extent of an ellipse along a unit
    vector n is the RMS in this direction, sqrt(n^T C n), with the covariance C of the displacements.
    """
    velocity = analysis.airflow.drag.velocity
    wind_direction = velocity / np.linalg.norm(velocity)
    frame, title = np.eye(3), point  # the covariance of a body is along the global axes,
    if point.endswith(MIDSPAN):  # that of a cable along those of its chord
        cable, equilibrium = point.removesuffix(MIDSPAN), analysis.equilibrium
        frame = equilibrium.catenary.span.frame[equilibrium.suspension.cable_names.index(cable)]
        title = f"mid-span of {cable}"
    title = shortened(title, 32)
    planes = (
        (np.eye(3)[:2], ("x [mm]", "y [mm]"), f"{title} from above"),
        (np.stack([wind_direction, [0.0, 0.0, 1.0]]), ("along the wind [mm]", "z [mm]"), f"{title} from the side"),
    )
    half = 1.25 * MM * np.sqrt(max(np.linalg.eigvalsh(state.covariance)[-1] for state in states))
    for column, (plane, labels, heading_text) in enumerate(planes):
        axes = figure.add_subplot(grid[3, column])
        style.zero_lines(axes)
        for state in states:
            x, y = MM * ellipse(plane @ frame.T @ state.covariance @ frame @ plane.T)
            axes.plot(x, y, color=state.colour, ls=state.dashes, label=state.label)
        if column == 0:
            _wind_arrow(axes, wind_direction[:2])
            axes.text(0.02, 0.02, "the extent in a direction is the RMS in it", transform=axes.transAxes, fontsize=7.5)
        axes.set(xlim=(-half, half), ylim=(-half, half), xlabel=labels[0], ylabel=labels[1])
        axes.set_title(heading_text, loc="left")
        axes.set_aspect("equal", adjustable="box")
        style.plain(axes, 6, 6)


def _wind_arrow(axes, along):
    """Draw an arrow in the upper left corner that points where the wind blows."""
    centre, half = np.array([0.11, 0.89]), 0.07 * along
    arrow = {"arrowstyle": "->", "color": style.BLUE, "lw": 1.4}
    frame = axes.transAxes
    axes.annotate("", centre + half, centre - half, xycoords=frame, textcoords=frame, arrowprops=arrow)
    axes.text(*(centre - [0.0, 0.13]), "wind", transform=frame, color=style.BLUE, fontsize=8, ha="center")


def ellipse(covariance):
    """Points of the ellipse whose extent in any direction is the RMS in it, shape (2, n), of a covariance (2, 2)."""
    variance, axes = np.linalg.eigh(covariance)
    angle = np.linspace(0.0, 2 * np.pi, 241)
    return axes @ (np.sqrt(np.maximum(variance, 0.0))[:, None] * np.stack([np.cos(angle), np.sin(angle)]))
