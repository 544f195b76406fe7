"""The loop of several winches over frequency: singular values, sensitivity, Nyquist curves with margins."""

import numpy as np
from matplotlib.figure import Figure

from cablestudy.control.margins_grid import by_parts
from cablestudy.study.loop_report import around_poles
from cablestudy.study.plots.style import BLUE, GREY, LIGHT, RED, SERIES, WIDTH, heading, plain, styled
from cablestudy.study.plots.words import number, quantity_text

TURN = 2 * np.pi
POINTS = 1200  # of a curve, without those near poles
CIRCLE = 31  # points near each pole
SHOWN = 1e-4, 30.0  # largest singular value of the loop gain: least that is drawn; at the lowest frequency
NEAR = 2.5  # half width of the Nyquist pictures [-]


@styled
def suspension_loop(movement):
    """Figure of singular values of the loop gain, the largest one of the sensitivity, and Nyquist curves with margins.

    Parameters
    ----------
    movement : Movement
        With a loop.

    Raises
    ------
    NoSolutionError
        There is no such loop.
    """
    loop = movement.loop
    omega, gain = _gains(movement.gains, loop.gain)
    figure = Figure(figsize=(WIDTH, 8.6), layout="constrained")
    grid_ = figure.add_gridspec(3, 2, height_ratios=(2, 1.7, 3.2))
    upper = figure.add_subplot(grid_[0, :])
    middle = figure.add_subplot(grid_[1, :], sharex=upper)
    _singular_values(upper, omega / TURN, gain, loop.gain)
    _sensitivity(middle, omega / TURN, gain, movement.margins)
    _determinant(figure.add_subplot(grid_[2, 0]), gain)
    _characteristic(figure.add_subplot(grid_[2, 1]), gain, movement)
    figure.align_ylabels([upper, middle])
    body = movement.equilibrium.suspension.body_names[movement.body]
    count, held = len(movement.winches), ", ".join(movement.measured)
    winches = f"{count} winch{'es' * (count != 1)}"
    heading(figure, f"Loop that holds {body} ({held}) by {winches}")
    return figure


def _gains(gains, own):
    """Frequencies, closer near the poles, shape (f,) [rad/s], and the loop gain there, shape (f, k, k).

    From where its integrators alone make it SHOWN[1] to where it falls below SHOWN[0]. `gains` are `StableGains`, `own`
    is the gain of the loop. [rad/s]
    """
    known, low = gains.frequencies(own), own / SHOWN[1]
    decades = np.geomspace(low, max(known[-1], 10 * low), POINTS)
    omega = np.unique(np.concatenate([decades, known, around_poles(gains.poles, CIRCLE)]))
    omega = omega[(omega >= low) & (omega <= decades[-1])]
    gain = own * by_parts(gains.loop_gain, omega)
    large = np.flatnonzero(np.linalg.norm(gain, ord=2, axis=(-2, -1)) > SHOWN[0])
    return omega[: large[-1] + 1], gain[: large[-1] + 1]


def _singular_values(axes, frequency, gain, slope):
    values = np.linalg.svd(gain, compute_uv=False)
    for place, row in enumerate(values.T[values.max(axis=0) > SHOWN[0]]):
        axes.loglog(frequency, row, color=BLUE, lw=1.5 if place == 0 else 0.8, alpha=1 if place == 0 else 0.6,
                    label=("largest", "others")[place] if place < 2 else None)  # fmt: skip
    axes.loglog(frequency, slope / TURN / frequency, color=GREY, lw=0.9, ls=":", label="without dynamics")
    axes.axhline(1.0, color=GREY, lw=0.8)
    crossed = np.flatnonzero(values[:, 0] > 1)
    if len(crossed) and crossed[-1] + 1 < len(frequency):
        place = crossed[-1]
        axes.plot(frequency[place], 1.0, "o", color=RED, ms=5, zorder=5)
        text, look = f"below 1 from {quantity_text(frequency[place], 'Hz')}", {"color": RED, "fontsize": 8}
        axes.annotate(text, (frequency[place], 1.0), (6, 5), textcoords="offset points", **look)
    axes.set_xlim(frequency[0], frequency[-1])
    axes.set_ylim(SHOWN[0], 2 * SHOWN[1])
    axes.set_ylabel("singular values of\nthe loop gain [-]")
    axes.legend(loc="lower left")
    axes.tick_params(labelbottom=False)


def _sensitivity(axes, frequency, gain, margins):
    sensitivity = np.linalg.norm(np.linalg.inv(np.eye(gain.shape[-1]) + gain), ord=2, axis=(-2, -1))
    axes.loglog(frequency, sensitivity, color=BLUE, label="largest singular value")
    axes.axhline(1.0, color=GREY, lw=0.8)
    peak, place = margins.sensitivity_peak, margins.sensitivity_frequency or frequency[-1]
    text = f"peak {number(peak)} at {quantity_text(place, 'Hz')}"
    axes.plot(place, peak, "o", color=RED, ms=5, zorder=5, label=text)
    axes.set_ylim(min(0.1, sensitivity.min() / 1.5), 2 * peak)
    axes.set_ylabel("sensitivity [-]")
    axes.set_xlabel("frequency [Hz]")
    axes.legend(loc="lower right")


def _determinant(axes, gain):
    curve = np.linalg.det(np.eye(gain.shape[-1]) + gain)
    place = int(np.argmin(np.abs(curve)))
    radius = abs(curve[place])
    _curve(axes, curve, BLUE, None)
    axes.plot(0, 0, "+", color=RED, ms=10, mew=2, zorder=5, label="critical point 0")
    turned = radius * np.exp(1j * np.linspace(0, TURN, 181))
    axes.plot(turned.real, turned.imag, color=RED, lw=0.9, ls="--", label=f"nearest, at {number(radius)}")
    _near(axes, 0.8, "det(I + L)")


def _characteristic(axes, gain, movement):
    """Eigenvalues of the loop gain, each joined to the nearest at the next frequency."""
    values = _joined(np.linalg.eigvals(gain))
    for row, colour in zip(values.T, (*SERIES, GREY) * len(values), strict=False):
        _curve(axes, row, colour, None)
    axes.plot(-1, 0, "+", color=RED, ms=10, mew=2, zorder=5, label="critical point −1")
    limit = movement.largest_gain
    if limit:
        factor = limit / movement.loop.gain
        margin = 20 * np.log10(factor)
        text = f"gain margin {quantity_text(margin, 'dB')}\n(unstable from {quantity_text(limit, 'rad/s')})"
        axes.plot(-1 / factor, 0, "o", color=RED, ms=5, zorder=5, label=text)
    _near(axes, -0.9, "eigenvalues of L")


def _joined(values):
    """The same eigenvalues, shape (f, k), in the order in which each is near its neighbour."""
    from scipy.optimize import linear_sum_assignment

    found = values.copy()
    for place in range(1, len(found)):
        apart = np.abs(found[place - 1][:, None] - values[place][None])
        found[place] = values[place][linear_sum_assignment(apart)[1]]
    return found


def _curve(axes, values, colour, label):
    """A curve over positive frequencies, and thin that over negative ones."""
    axes.plot(values.real, values.imag, color=colour, lw=1.3, label=label, zorder=3)
    axes.plot(values.real, -values.imag, color=colour, lw=0.6, alpha=0.5, zorder=3)


def _near(axes, centre, label):
    axes.axhline(0, color=LIGHT, lw=0.9)
    axes.axvline(0, color=LIGHT, lw=0.9)
    axes.set(xlim=(centre - NEAR, centre + NEAR), ylim=(-NEAR, NEAR))
    axes.set_aspect("equal", adjustable="box")
    axes.set(
        xlabel=f"real part of {label}" if label[0] == "d" else f"real part of the {label}", ylabel="imaginary part"
    )
    plain(axes, 6, 6)
    axes.legend(loc="lower left", fontsize=7.5, frameon=True, edgecolor="none", framealpha=0.85)
