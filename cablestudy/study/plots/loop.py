"""The winch loop of one cable: Bode and Nyquist plots with their margins, sensitivity, and the response in time."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from cablestudy.control.gondola import gondola_mode
from cablestudy.control.response import Phase
from cablestudy.control.step_response import BAND
from cablestudy.errors import NoSolutionError
from cablestudy.study.loop_in_time import MILLI
from cablestudy.study.loop_report import curves, decibels, drawn_frequencies, loop_gain
from cablestudy.study.plots.style import BLUE, GREEN, GREY, LIGHT, RED, SERIES, WIDTH, plain, plain_axis, styled
from cablestudy.study.plots.words import with_minus

BELOW, ABOVE = 0.02, 3.0  # of the range without another one: of the lowest and the highest frequency that is marked
POINTS = 1500  # of a curve, without those near resonances
LEAST = -100.0  # magnitude that is drawn [dB]
LINE = 0.052  # height of a line of text beside the Nyquist plot, over that of the plot
NEAR = 2.2  # half width of the Nyquist plot [-]
PHASES = 540.0  # range of phases from which marks are 180 degrees apart [deg]
STYLES = ("-", "--", ":")
NO_LOOP = "the gain of the loop is zero: there is nothing to draw"


@styled
def loop_margins(case, span=None):
    """Figure of loop gain, phase and sensitivity over frequency, and of the loop gain near -1.

    Parameters
    ----------
    case : Case
        With a winch loop.
    span : (float, float, int), optional
        From `ssm.read_span`. Default: about bandwidth, gondola and largest gain.

    Raises
    ------
    NoSolutionError
        The gain is zero.
    """
    found = case.in_wind
    movement = found.controlled
    if not movement.loop.gain:
        raise NoSolutionError(NO_LOOP)
    frequency = drawn_frequencies(movement, span or _span(found))
    value, sensitivity, complementary = curves(movement, frequency)
    figure = Figure(figsize=(WIDTH, 9.6), layout="constrained")
    grid = figure.add_gridspec(4, 2, height_ratios=(2.2, 1.6, 1.8, 3.2), width_ratios=(1.35, 1))
    upper = figure.add_subplot(grid[0, :])
    middle, lower = (figure.add_subplot(grid[row, :], sharex=upper) for row in (1, 2))
    _magnitude(upper, found, frequency, value)
    _phase(middle, movement, frequency, value)
    _sensitivity(lower, movement, frequency, sensitivity, complementary)
    upper.set_xlim(frequency[0], frequency[-1])
    for axes in (upper, middle):
        axes.tick_params(labelbottom=False)
    nyquist, beside = figure.add_subplot(grid[3, 0]), figure.add_subplot(grid[3, 1])
    _nyquist(nyquist, found, value)
    _numbers(beside, found)
    beside.legend(*nyquist.get_legend_handles_labels(), loc="lower left", fontsize=8)
    figure.align_ylabels([upper, middle, lower])
    winch = case.scene.winch.location
    figure.suptitle(f"Winch loop, winch on the {winch}: open loop L, sensitivity S = 1/(1 + L), T = L/(1 + L)",
                    x=0.01, ha="left", fontsize=10)  # fmt: skip
    return figure


def _span(found):
    """Range of frequencies in which something happens. [Hz]"""
    movement = found.controlled
    marked = [
        movement.modes.frequency[gondola_mode(movement.modes.compliance_shares(0, 0))],
        movement.loop.gain / (2 * np.pi),
        found.phase_crossover[0] if _has_limit(movement) else None,
        *(notch.rolloff_omega / (2 * np.pi) for notch in movement.notches if notch),
    ]
    marked = [one for one in marked if one]
    return min(0.2 * max(marked), BELOW / ABOVE * 10 * min(marked)), ABOVE * max(marked), POINTS


def _has_limit(movement):
    """Whether the loop has a largest gain, and it can be had."""
    try:
        return movement.largest_gain is not None
    except NoSolutionError:
        return False


def _magnitude(axes, found, frequency, value):
    axes.semilogx(frequency, np.maximum(decibels(value), 2 * LEAST), color=BLUE, lw=1.3, label="|L|")
    axes.axhline(0.0, color=GREY, lw=0.8)
    size = decibels(value)
    axes.set_ylim(max(LEAST, size.min() - 5), size.max() + 10)
    axes.set_ylabel("loop gain |L| [dB]")
    movement = found.controlled
    if _has_limit(movement):
        margin, place = found.gain_margin[0], found.phase_crossover[0]
        axes.annotate("", (place, 0), (place, -margin), arrowprops={"arrowstyle": "<->", "color": RED, "lw": 1.2,
                                                                   "shrinkA": 0, "shrinkB": 0})  # fmt: skip
        axes.plot(place, -margin, "o", color=RED, ms=4, zorder=5,
                  label=with_minus(f"gain margin {margin:.4g} dB at {place:.4g} Hz"))  # fmt: skip
    if crossover := movement.margins.gain_crossover:
        axes.plot(crossover, 0, "s", color=GREEN, ms=4, zorder=5, label=f"|L| = 1 at {crossover:.4g} Hz")
    axes.legend(loc="lower left", **BOX)


def _phase_label(margins):
    return f"phase margin {margins.phase_margin:.4g}°"


BOX = {"fontsize": 8, "frameon": True, "edgecolor": "none", "framealpha": 0.85}


def _phase(axes, movement, frequency, value):
    phase = Phase()(value)
    axes.semilogx(frequency, phase, color=BLUE, lw=1.3)
    low, high = np.nanmin(phase), np.nanmax(phase)
    axes.yaxis.set_major_locator(MultipleLocator(90 if high - low < PHASES else 180))
    for turn in np.arange(np.floor((low - 180) / 360), np.ceil((high + 180) / 360) + 1):
        axes.axhline(-180 + 360 * turn, color=GREY, lw=0.8, ls="--")
    axes.set_ylim(min(low, -180) - 20, max(high, low + 90) + 20)
    axes.set_ylabel("phase of L [deg]")
    place = movement.margins.gain_crossover
    if movement.stable and place and frequency[0] < place < frequency[-1]:
        # the phase there without a turn, and the nearest -180 degrees
        found = np.interp(np.log(place), np.log(frequency), phase)
        nearest = 360 * np.round((found + 180) / 360) - 180
        axes.annotate("", (place, nearest), (place, found), arrowprops={"arrowstyle": "<->", "color": GREEN, "lw": 1.2,
                                                                        "shrinkA": 0, "shrinkB": 0})  # fmt: skip
        axes.plot(place, found, "s", color=GREEN, ms=4, zorder=5, label=_phase_label(movement.margins))
        axes.legend(loc="lower left", **BOX)


def _sensitivity(axes, movement, frequency, sensitivity, complementary):
    axes.semilogx(frequency, decibels(complementary), color=GREEN, lw=1.0, ls="--", label="|T|")
    axes.semilogx(frequency, decibels(sensitivity), color=BLUE, lw=1.3, label="|S|")
    axes.axhline(0.0, color=GREY, lw=0.8)
    top = decibels(sensitivity).max()
    if movement.stable:
        peak, place = movement.margins.sensitivity_peak, movement.margins.sensitivity_frequency
        top = max(top, float(decibels(peak)))
        axes.plot(place, decibels(peak), "o", color=RED, ms=4, zorder=5,
                  label=with_minus(f"peak {peak:.4g} = {decibels(peak):.4g} dB at {place:.4g} Hz"))  # fmt: skip
    axes.set_ylim(-40, top + 6)
    axes.set_ylabel("|S|, |T| [dB]")
    axes.set_xlabel("frequency [Hz]")
    axes.legend(loc="lower left", ncols=3, **BOX)


def _nyquist(axes, found, value):
    axes.axhline(0, color=LIGHT, lw=0.9)
    axes.axvline(0, color=LIGHT, lw=0.9)
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 361))
    axes.plot(circle.real, circle.imag, color=GREY, lw=0.8, ls="--", label="unit circle")
    # far outside nothing is drawn, so that no line crosses the picture between two points far away
    shown = np.where(np.abs(value) < 20 * NEAR, value, np.nan)
    axes.plot(shown.real, shown.imag, color=BLUE, lw=1.3, zorder=3, label="L")
    axes.plot(shown.real, -shown.imag, color=BLUE, lw=0.6, alpha=0.5, zorder=3)
    axes.plot(-1, 0, "+", color=RED, ms=10, mew=2, zorder=6, label="−1")
    movement = found.controlled
    margins = movement.margins if movement.stable else None
    if margins:
        near = 1 / margins.sensitivity_peak
        around = -1 + near * circle
        axes.plot(around.real, around.imag, color=RED, lw=0.8, ls=":", label=f"nearest to −1: {near:.4g}")
    if margins and margins.gain_crossover:
        (here,) = loop_gain(movement, np.array([margins.gain_crossover]))
        axes.plot(here.real, here.imag, "s", color=GREEN, ms=4, zorder=5, label=_phase_label(margins))
    if _has_limit(movement):
        axes.plot(-movement.loop.gain / movement.largest_gain, 0, "o", color=RED, ms=4, zorder=5,
                  label=with_minus(f"gain margin {found.gain_margin[0]:.4g} dB"))  # fmt: skip
    axes.set(xlim=(-0.6 - NEAR, -0.6 + NEAR), ylim=(-NEAR, NEAR), xlabel="real part of L", ylabel="imaginary part of L")
    axes.set_aspect("equal", adjustable="box")
    plain(axes, 6, 6)


def _numbers(axes, found):
    """The margins as text."""
    axes.set_axis_off()
    movement = found.controlled
    limit, loop, law = _has_limit(movement), movement.loop, movement.loop.law
    largest = movement.largest_gain if limit else None
    lines = [("gain", f"{loop.gain:.4g} rad/s")]
    lines += [("proportional gain", f"{loop.gain * law.proportional:.4g}")] if law.proportional else []
    lines += [("derivative gain", f"{loop.gain * law.derivative:.4g} s")] if law.derivative else []
    lines += [("delay", f"{law.delay:.4g} s")] if law.delay else []
    lines += [("largest gain", f"{largest:.4g} rad/s" if largest else "none")]
    lines += [("gain margin", f"{found.gain_margin[0]:.4g} dB")] if limit else []
    lines += _of_stable(movement.margins) if movement.stable else [("loop", "unstable")]
    for place, (name, number) in enumerate(lines):
        height = 0.97 - LINE * place
        axes.text(0.02, height, name, transform=axes.transAxes, fontsize=8)
        axes.text(0.98, height, with_minus(number), transform=axes.transAxes, ha="right", fontsize=8)


def _of_stable(margins):
    """Names and texts of the margins of a stable loop: list of (str, str)."""
    lines = []
    if margins.phase_margin is not None:
        lines += [("phase margin", f"{margins.phase_margin:.4g}°"), ("delay margin", f"{margins.delay_margin:.4g} s")]
    lines += [("peak of S", f"{margins.sensitivity_peak:.4g}")]
    return lines + ([("bandwidth", f"{margins.bandwidth:.4g} Hz")] if margins.bandwidth else [])


@styled
def loop_in_time(solved):
    """Figure of displacement with and without the loop, and movement of the winches over time; of a gust its speed too.

    Parameters
    ----------
    solved : TimeCase
    """
    time = solved.time
    varies = np.ptp(solved.input.shown) > 0
    heights = (1, 2, 1.5) if varies else (2, 1.5)
    figure = Figure(figsize=(WIDTH, 1.3 + 1.1 * sum(heights)), layout="constrained")
    *first, second, third = grid = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    for axes in first:
        axes.plot(time, solved.input.shown, color=GREY)
        axes.set_ylabel(f"{'wind' if solved.input.unit == 'm/s' else 'input'} [{solved.input.unit}]")
    _displacement(second, solved)
    several = len(solved.winches) > 1
    for winch, (name, value) in enumerate(zip(solved.winches, MILLI * solved.found.winch.T, strict=True)):
        third.plot(time, value, color=SERIES[(winch + 1) % len(SERIES)], lw=1.1, ls=STYLES[winch // len(SERIES) % 3],
                   label=name.removeprefix("winch."))  # fmt: skip
    third.set_ylabel("winches [mm]" if several else "winch [mm]")
    third.set_xlabel("time [s]")
    if several:
        _room_above(third)
        third.legend(loc="upper right", ncols=6, **BOX)
    third.set_xlim(time[0], time[-1])
    plain_axis(third.xaxis, 8)
    for axes in grid:
        plain_axis(axes.yaxis, 5)
    figure.align_ylabels(grid)
    figure.suptitle(f"Loop, gain {solved.gain:.4g} rad/s: {solved.input.what}", x=0.01, ha="left", fontsize=10)
    return figure


def _displacement(axes, solved):
    """What is measured, with and without the loop: its largest value, and of a step where it settles."""
    time, found, unit, step = solved.time, solved.found, solved.unit, solved.step
    if found.open_loop is not None:
        axes.plot(time, MILLI * found.open_loop, color=GREY, lw=1.0, ls="--", label="without the loop")
    moved = MILLI * found.measured
    axes.plot(time, moved, color=BLUE, label="loop closed")
    place = int(np.argmax(np.abs(moved)))
    if step is None or step.taken_back or step.overshoot > BAND:
        over = "" if step is None or step.taken_back else f" ({100 * step.overshoot:.3g} % over)"
        axes.plot(time[place], moved[place], "o", color=RED, ms=4,
                  label=with_minus(f"{moved[place]:.4g} {unit} at {time[place]:.4g} s{over}"))  # fmt: skip
    if step is not None:
        around = BAND * step.size * np.array([-1, 1])
        axes.axhspan(*(MILLI * (step.final + around)), color=RED, alpha=0.15, lw=0)
    if step is not None and step.settling_time is not None and step.resolved:
        settled = f"settled to 2 % at {step.settling_time:.4g} s"
        axes.axvline(step.settling_time, color=RED, lw=0.9, ls=":", label=settled)
    axes.set_ylabel(f"{solved.name} [{unit}]")
    _room_above(axes)
    axes.legend(loc="upper right", ncols=4, **BOX)


def _room_above(axes):
    """Widen the axes so that a legend of one line is above the curves."""
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.2 * (high - low))
