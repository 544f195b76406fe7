"""A body of a suspension in the wind: spectra of its displacements and rotations, cumulative variance, ellipses."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.plots.spectra import frequencies_near, share_below
from cablestudy.study.plots.style import BLUE, GREEN, GREY, LIGHT, ORANGE, RED, WIDTH, heading, plain, styled
from cablestudy.study.plots.words import quantity_text, shortened
from cablestudy.study.suspension.response import AT_ONCE, CLOSED

TURN = 2 * np.pi
POINTS = 1200
NARROW = 0.3  # damping ratio below which a pole gets frequencies of its own
BESIDE = np.array([0.0, 0.25, 0.5, 1.0, 1.7, 3.0, 6.0])  # their distances from it, in half-widths
DECADES = 10  # of the largest spectrum that are shown
PLACES, TURNS = ("x", "y", "z"), ("rx", "ry", "rz")
PAIRS = ((0, 1), (0, 2), (1, 2))
COLOURS, WIDTHS = (BLUE, GREEN, ORANGE), (1.8, 1.2, 0.7)
MM, URAD = 1e3, 1e6


@dataclass(frozen=True)
class DrawnState:
    """What is drawn of one state of control.

    Attributes
    ----------
    label, colour, dashes : str
    spectra : dict
        Output -> spectrum, shape (f,). [m^2/Hz], [rad^2/Hz]
    rms : dict
        Output -> RMS. [m], [rad]
    covariance : ndarray, shape (3, 3)
        Of the displacements of the place whose ellipse is drawn. [m^2]
    """

    label: str
    colour: str
    dashes: str
    spectra: dict
    rms: dict
    covariance: np.ndarray

    def together(self, names):
        """Sum of the spectra, and root of the sum of variances, of some outputs."""
        return sum(self.spectra[name] for name in names), np.sqrt(sum(self.rms[name] ** 2 for name in names))


@styled
def suspension_wind(case):
    """Figure of the spectra of a body, their cumulative variance, and ellipses of the motion of its marker.

    The body is that of the loop, or the first one. Where it has actuators they are drawn with and without.

    Parameters
    ----------
    case : SuspensionCase
        With wind, and stable.

    Raises
    ------
    NoSolutionError, ConvergenceError
        It has no response, or there is nothing that moves.
    """
    movement, response = case.in_wind.movement, case.in_wind.response
    body, place = _drawn(movement)
    names = [f"{body}.{axis}" for axis in (*PLACES, *TURNS) if f"{body}.{axis}" in movement.outputs]
    frequency = _grid(movement)
    states = _states(case, response, names, place, frequency)
    moved = [name for name in names if states[0].rms[name] > 0]
    if not moved:
        raise NoSolutionError(f"the wind does not move {body}: there is nothing to draw")
    kinds = [
        (found, *look)
        for axes, *look in ((PLACES, MM, "displacement", "mm"), (TURNS, URAD, "rotation", "µrad"))
        if (found := [name for name in moved if name.rpartition(".")[2] in axes])
    ]
    figure = Figure(figsize=(WIDTH, 8.8), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=(2.4, 1.6, 2.8))
    shared, high = None, _highest(frequency, states, kinds)
    for column, (found, scale, what, unit) in enumerate(kinds):
        columns = column if len(kinds) > 1 else slice(None)
        upper = figure.add_subplot(grid[0, columns], sharex=shared)
        shared = upper
        lower = figure.add_subplot(grid[1, columns], sharex=shared)
        _spectra(upper, frequency, states, found, scale, high)
        upper.set_ylabel(f"spectrum of\n{what}s [{unit}²/Hz]")
        _variance(lower, frequency, states, found, unit, scale)
        figure.align_ylabels([upper, lower])
    _ellipses(figure, grid, states, movement, place)
    wind = movement.scene.wind
    heading(figure, f"Wind at {quantity_text(wind.speed, 'm/s')} on {body}")
    return figure


def _drawn(movement):
    """Name of the body that is drawn, and of the place whose ellipse is: its marker, or itself."""
    scene, outputs = movement.scene, movement.outputs
    owners = [name.rpartition(".")[0] for name in outputs if ".tension_" not in name]
    if scene.control:
        body = movement.equilibrium.suspension.body_names[movement.body]
    elif owners:
        body = owners[0].partition(".")[0]
    else:
        raise NoSolutionError("nothing is free to move: there is nothing to draw")
    markers = [f"{body}.{name}" for name in (scene.bodies[body].markers if body in scene.bodies else ())]
    corrected = scene.correction.marker if scene.correction else None
    return body, corrected if corrected in markers else markers[0] if markers else body


def _grid(movement):
    """Frequencies with equal ratios, and closer ones near narrow poles. [Hz]"""
    loop = movement.loop
    poles = np.concatenate([movement.open_poles, loop.poles if loop else movement.open_poles[:0]])
    poles = poles[(poles.imag > 0) & (np.abs(poles.real) < NARROW * np.abs(poles))]
    return frequencies_near(poles, np.concatenate([-BESIDE[:0:-1], BESIDE]), POINTS)


def _states(case, response, names, place, frequency):
    """The `DrawnState` of each state of control: winches at rest, loop, actuators."""
    movement = response.movement
    rest, closed = "winches at rest" if movement.winches else "without control", "winch loop closed"
    if not movement.actuators:
        found = _of(response, names, place, frequency)
        labels = (closed, rest) if len(found) > 1 else (rest,)
        looks = ((RED, "-"), (GREY, "--")) if len(found) > 1 else ((RED, "-"),)
        return [DrawnState(label, *look, *part) for label, look, part in zip(labels, looks, found, strict=True)][::-1]
    both = "loop and actuators" if response.loop else "with actuators"
    states = [DrawnState(both, RED, "-", *_of(response, names, place, frequency)[CLOSED])]
    with suppress(NoSolutionError, ConvergenceError):  # unstable without them, for example
        alone = type(case)(movement.scene.model_copy(update={"actuators": {}})).in_wind
        found = _of(alone.response, names, place, frequency)
        looks = (("loop, no actuators", "#000000", "--"), ("winches at rest, no actuators", GREY, ":"))
        if len(found) == 1:
            looks = (("without actuators", GREY, "--"),)
        states += [DrawnState(*look, *part) for look, part in zip(looks, found, strict=True)]
    return states[::-1]


def _of(response, names, place, frequency):
    """Spectra, RMS and covariance of the place, with the loop and with the winches at rest; only these without one."""
    places = [f"{place}.{axis}" for axis in PLACES]
    known = list(dict.fromkeys([*names, *(name for name in places if name in response.names)]))
    rows = [response.names.index(name) for name in known]
    sums = np.zeros((len(known), 3 + len(PAIRS)))  # x, y, z of the place, and the sums of two of them
    for axis, name in enumerate(places):
        if name in known:
            sums[known.index(name), axis] = 1.0
            sums[known.index(name), [3 + k for k, pair in enumerate(PAIRS) if axis in pair]] = 1.0
    at_once, found = max(1, AT_ONCE // len(response.movement.motion) ** 2), []
    for begin in range(0, len(frequency), at_once):
        part = frequency[begin : begin + at_once]
        moved = response.responses(part)[..., rows]
        moved = np.concatenate([moved, moved @ sums], axis=-1)
        found.append([response.movement.gusts.input_spectra(part, one).T for one in moved])
    drawn = []
    for state, spectra in enumerate(np.concatenate(found, axis=-1)):
        variance = np.trapezoid(spectra[len(known) :], frequency)
        covariance = np.diag(variance[:3])
        for (one, other), total in zip(PAIRS, variance[3:], strict=True):
            covariance[one, other] = covariance[other, one] = (total - variance[one] - variance[other]) / 2
        every = response.variances
        response.check_damped(known, state)
        rms = {name: np.sqrt(every.weighted["value"][state, every.rows[name]]) for name in known}
        # what is not in the range of the picture counts too
        exact = np.array([rms.get(name, 0.0) for name in places])
        scale = exact / np.where(variance[:3] > 0, np.sqrt(variance[:3]), 1.0)
        covariance *= np.outer(scale, scale)
        drawn.append((dict(zip(known, spectra, strict=False)), rms, covariance))
    return drawn


def _highest(frequency, states, kinds):
    """Power of ten that is above all frequencies at which a spectrum is DECADES below the largest of its kind. [Hz]"""
    last = frequency[1]
    for names, *_ in kinds:
        spectra = np.array([state.spectra[name] for state in states for name in names])
        last = max(last, frequency[(spectra > 10.0**-DECADES * spectra.max()).any(axis=0)].max())
    return min(10.0 ** np.ceil(np.log10(last)), frequency[-1])


def _spectra(axes, frequency, states, names, scale, high):
    for state in states:
        for name in names:
            axis = name.rpartition(".")[2]
            look = {"color": COLOURS["xyz".index(axis[-1])], "lw": WIDTHS["xyz".index(axis[-1])], "ls": state.dashes}
            label = axis if state is states[-1] else None
            axes.loglog(frequency, scale**2 * state.spectra[name], **look, label=label)
    largest = max(scale**2 * state.spectra[name].max() for state in states for name in names)
    axes.set_ylim(10.0 ** (np.ceil(np.log10(largest)) - DECADES), 10 * largest)
    axes.set_xlim(frequency[0], high)
    axes.tick_params(labelbottom=False)
    axes.legend(loc="lower left")


def _variance(axes, frequency, states, names, unit, scale):
    for state in states:
        spectrum, rms = state.together(names)
        below = share_below(frequency, spectrum)
        label = f"{state.label}: {quantity_text(scale * rms, unit)} RMS"
        axes.semilogx(frequency, below, color=state.colour, ls=state.dashes, label=label)
    axes.set_ylabel("share of the\nvariance below")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylim(0, 1.1 + 0.17 * len(states))
    axes.set_yticks(np.linspace(0, 1, 6))
    axes.legend(loc="upper left", fontsize=7)


def _ellipses(figure, grid, states, movement, place):
    """From above, and in the vertical plane of the mean wind: the extent in any direction is the RMS in it."""
    velocity = movement.drag.velocity
    along = velocity / np.sqrt((velocity**2).sum())
    place = shortened(place, 32)
    planes = (
        (np.eye(3)[:2], ("x [mm]", "y [mm]"), f"{place} from above"),
        (
            np.stack([along, [0.0, 0.0, 1.0]]),
            ("along the wind [mm]", "z [mm]"),
            f"{place} from the side",
        ),
    )
    half = 1.25 * MM * np.sqrt(max(np.linalg.eigvalsh(state.covariance)[-1] for state in states))
    half = half or 1.0  # a place that only turns
    for column, (plane, labels, title) in enumerate(planes):
        axes = figure.add_subplot(grid[2, column])
        axes.axhline(0, color=LIGHT, lw=0.9)
        axes.axvline(0, color=LIGHT, lw=0.9)
        for state in states:
            x, y = MM * ellipse(plane @ state.covariance @ plane.T)
            axes.plot(x, y, color=state.colour, ls=state.dashes, label=state.label)
        if column == 0:
            _wind_arrow(axes, along[:2])
            axes.text(0.02, 0.02, "the extent in a direction is the RMS in it", transform=axes.transAxes, fontsize=7.5)
        axes.set(xlim=(-half, half), ylim=(-half, half), xlabel=labels[0], ylabel=labels[1])
        axes.set_title(title, loc="left")
        axes.set_aspect("equal", adjustable="box")
        plain(axes, 6, 6)


def _wind_arrow(axes, along):
    """An arrow in the upper left corner that points where the wind blows."""
    centre, half = np.array([0.11, 0.89]), 0.07 * along
    arrow = {"arrowstyle": "->", "color": BLUE, "lw": 1.4}
    frame = axes.transAxes
    axes.annotate("", centre + half, centre - half, xycoords=frame, textcoords=frame, arrowprops=arrow)
    axes.text(*(centre - [0.0, 0.13]), "wind", transform=frame, color=BLUE, fontsize=8, ha="center")


def ellipse(covariance):
    """Points of the ellipse whose extent in any direction is the RMS in it, shape (2, n), of a covariance (2, 2)."""
    value, axes = np.linalg.eigh(covariance)
    turned = np.linspace(0.0, TURN, 241)
    return axes @ (np.sqrt(np.maximum(value, 0.0))[:, None] * np.stack([np.cos(turned), np.sin(turned)]))
