"""The loop of winches: loop gain, sensitivity, Nyquist plot and response in time; Bode plot of frequency responses."""

from itertools import cycle

import numpy as np
from matplotlib.ticker import MultipleLocator

import cablestudy.plots.style as style
from cablestudy.control.tolerances import CONTROL
from cablestudy.errors import ConvergenceError, NoSolutionError, NothingToDrawError
from cablestudy.plots.words import axis_label, with_minus
from cablestudy.study.loop_in_time import MILLI
from cablestudy.study.loop_report import (
    curves,
    decibels,
    drawn_frequencies,
    loop_gain,
    singular_values,
    unwrapped_phase,
)

SPAN_BELOW, SPAN_ABOVE = 0.02, 3.0  # ends of the default range over the lowest and highest frequency marked
CURVE_POINTS = 1500  # of a curve, without those near resonances
LEAST_MAGNITUDE = -100.0  # magnitude that is drawn [dB]
LINE_HEIGHT = 0.052  # height of a line of text beside the Nyquist plot, over that of the plot
NYQUIST_HALF = 2.2  # half width of the Nyquist plot [-]
WIDE_PHASES, WIDEST_PHASES = 540.0, 1440.0  # range of phases from which marks are 180, 360 degrees apart or more [deg]
LEGEND = {"fontsize": 8, **style.BOX}
ARROW = {"arrowstyle": "<->", "lw": 1.2, "shrinkA": 0, "shrinkB": 0}  # of a margin
NO_LOOP = "the gain of the loop is zero: there is nothing to draw"


@style.styled
def loop_margins(closed_loop, frequency_range=None):
    """Figure of a control loop for the choice of its gain: loop gain L and sensitivity, Nyquist plot and margins.

    A loop of one coordinate has magnitude and phase of L over frequency. A loop of several coordinates has the singular
    values of L over frequency, and its eigenvalues in the Nyquist plot.

    `frequency_range` is the lowest and highest frequency [Hz] and number of those at equal ratios. Default: about those
    of the controlled motions and of the stability limit, the gain over 2 pi, and the roll-off of notches.
    NothingToDrawError if the gain is zero.
    """
    if not closed_loop.loop.gain:
        raise NothingToDrawError(NO_LOOP)
    frequency = drawn_frequencies(closed_loop, frequency_range or _frequency_range(closed_loop))
    value, sensitivity, complementary = curves(closed_loop, frequency)
    alone = len(closed_loop.body.measured) == 1
    heights = (2.2, 1.6, 1.8, 3.2) if alone else (2.2, 1.8, 3.2)
    figure = style.new_figure(0.8 + sum(heights), _title(closed_loop))
    grid = figure.add_gridspec(len(heights), 2, height_ratios=heights, width_ratios=(1.35, 1))
    upper = figure.add_subplot(grid[0, :])
    lower = [figure.add_subplot(grid[row, :], sharex=upper) for row in range(1, len(heights) - 1)]
    _magnitude(upper, closed_loop, frequency, value)
    if alone:
        _phase(lower[0], closed_loop, frequency, value[:, 0, 0])
    _sensitivity(lower[-1], closed_loop, frequency, sensitivity, complementary)
    upper.set_xlim(frequency[0], frequency[-1])
    for axes in (upper, *lower[:-1]):
        axes.tick_params(labelbottom=False)
    nyquist, margins_as_text = figure.add_subplot(grid[-1, 0]), figure.add_subplot(grid[-1, 1])
    _nyquist(nyquist, closed_loop, value)
    _write_margins(margins_as_text, closed_loop)
    margins_as_text.legend(*nyquist.get_legend_handles_labels(), loc="lower left", fontsize=8)
    figure.align_ylabels([upper, *lower])
    return figure


def _title(closed_loop):
    """Title of the figure: the coordinates that the loop holds, by how many winches, and the letters of the picture."""
    count, held = len(closed_loop.winches), ", ".join(closed_loop.body.measured)
    letters = "loop gain L, S = 1/(1 + L), T = S L" if len(closed_loop.body.measured) == 1 else "S = (I + L)⁻¹, T = S L"
    return f"Loop that holds {closed_loop.body.name} ({held}) by {count} winch{'es' * (count != 1)}: {letters}"


def _frequency_range(closed_loop):
    """Default range of frequencies, about those that are marked, and number of points: (low [Hz], high [Hz], int)."""
    marked = [*closed_loop.body.coupled_frequencies, closed_loop.loop.gain / (2 * np.pi)]
    limit, _ = _limit_of(closed_loop)
    marked += [limit.omega / (2 * np.pi)] if limit else []
    marked += [notch.rolloff_omega / (2 * np.pi) for notch in closed_loop.body.notches if notch]
    return min(0.2 * max(marked), SPAN_BELOW / SPAN_ABOVE * 10 * min(marked)), SPAN_ABOVE * max(marked), CURVE_POINTS


def _limit_of(closed_loop):
    """`Limit` of the gain, None where there is none; and whether it is known: a pair."""
    try:
        return closed_loop.stability.limit, True
    except (NoSolutionError, ConvergenceError):
        return None, False


def _margin(closed_loop, limit):
    """Gain margin of a loop by the `Limit` of its gain. [dB]"""
    return float(decibels(limit.factor / closed_loop.loop.gain))


def _magnitude(axes, closed_loop, frequency, value):
    """Draw the singular values of the loop gain over frequency, with gain margin and gain crossover."""
    sizes = decibels(singular_values(value)).T
    labels = ["|L|"] if len(sizes) == 1 else ["largest singular value of L", "others", *[None] * len(sizes)]
    for number, (size, label) in enumerate(zip(sizes, labels, strict=False)):
        size = np.maximum(size, 2 * LEAST_MAGNITUDE)
        axes.semilogx(frequency, size, color=style.BLUE, lw=0.7 if number else 1.3, label=label)
    axes.axhline(0.0, color=style.GREY, lw=0.8)
    axes.set_ylim(max(LEAST_MAGNITUDE, np.nanmin(sizes) - 5), np.nanmax(sizes) + 10)
    axes.set_ylabel("loop gain [dB]")
    if limit := _limit_of(closed_loop)[0]:
        margin, crossing = _margin(closed_loop, limit), limit.omega / (2 * np.pi)
        axes.annotate("", (crossing, 0), (crossing, -margin), arrowprops={"color": style.RED, **ARROW})
        axes.plot(crossing, -margin, "o", color=style.RED, ms=4, zorder=5,
                  label=with_minus(f"gain margin {margin:.4g} dB at {crossing:.4g} Hz"))  # fmt: skip
    if crossover := closed_loop.stability.margins.gain_crossover:
        name = "|L| = 1" if len(sizes) == 1 else "gain crossover"
        axes.plot(crossover, 0, "s", color=style.GREEN, ms=4, zorder=5, label=f"{name} at {crossover:.4g} Hz")
    axes.legend(loc="lower left", **LEGEND)


def _phase_label(margins):
    """Phase margin in words, for legends."""
    return f"phase margin {margins.phase_margin:.4g}°"


def _phase(axes, closed_loop, frequency, value):
    """Draw the phase of the loop gain of one coordinate, lines at odd multiples of 180 degrees, and its margin.

    Where the phase falls over many turns, as by a delay, only some of these lines are drawn, and marked.
    """
    phase = unwrapped_phase(frequency, value, closed_loop.loop.law.delay)
    axes.semilogx(frequency, phase, color=style.BLUE, lw=1.3)
    low, high = np.nanmin(phase), np.nanmax(phase)
    turns = max(1, int(np.ceil((high - low) / WIDEST_PHASES)))  # between two lines, so that these are few
    if turns > 1:
        marks = MultipleLocator(360 * turns, offset=-180)
    else:
        marks = MultipleLocator(90 if high - low < WIDE_PHASES else 180)
    axes.yaxis.set_major_locator(marks)
    for turn in np.arange(np.floor((low - 180) / 360), np.ceil((high + 180) / 360) + 1):
        if turn % turns == 0:
            axes.axhline(-180 + 360 * turn, color=style.GREY, lw=0.8, ls="--")
    axes.set_ylim(min(low, -180) - 20, max(high, low + 90) + 20)
    axes.set_ylabel("phase of L [deg]")
    stability, crossover = closed_loop.stability, closed_loop.stability.margins.gain_crossover
    if stability.stable and crossover and frequency[0] < crossover < frequency[-1]:
        phase_there = np.interp(np.log(crossover), np.log(frequency), phase)
        half_turn = 360 * np.round((phase_there + 180) / 360) - 180  # the odd multiple of 180 degrees next to it
        axes.annotate("", (crossover, half_turn), (crossover, phase_there), arrowprops={"color": style.GREEN, **ARROW})
        axes.plot(crossover, phase_there, "s", color=style.GREEN, ms=4, zorder=5, label=_phase_label(stability.margins))
        axes.legend(loc="lower left", **LEGEND)


def _sensitivity(axes, closed_loop, frequency, sensitivity, complementary):
    """Draw the largest singular values of T and S over frequency, and the peak of S."""
    size_of_s, size_of_t = (decibels(singular_values(matrices)[:, 0]) for matrices in (sensitivity, complementary))
    axes.semilogx(frequency, size_of_t, color=style.GREEN, lw=1.0, ls="--", label="|T|")
    axes.semilogx(frequency, size_of_s, color=style.BLUE, lw=1.3, label="|S|")
    axes.axhline(0.0, color=style.GREY, lw=0.8)
    top = np.nanmax(size_of_s)
    if closed_loop.stability.stable:
        margins = closed_loop.stability.margins
        peak, peak_at = margins.sensitivity_peak, margins.sensitivity_frequency or frequency[-1]
        top = max(top, float(decibels(peak)))
        axes.plot(peak_at, decibels(peak), "o", color=style.RED, ms=4, zorder=5,
                  label=with_minus(f"peak {peak:.4g} = {decibels(peak):.4g} dB at {peak_at:.4g} Hz"))  # fmt: skip
    axes.set_ylim(-40, top + 6)
    several = sensitivity.shape[-1] > 1
    axes.set_ylabel("largest singular value\nof S, T [dB]" if several else "|S|, |T| [dB]")
    axes.set_xlabel("frequency [Hz]")
    axes.legend(loc="lower left", ncols=3, **LEGEND)


def _nyquist(axes, closed_loop, value):
    """Draw the Nyquist plot: eigenvalues of the loop gain in the complex plane, their distance from -1, and margins.

    `value` is the loop gain of k coordinates at f frequencies, shape (f, k, k). The distance is 1 / (peak of the
    sensitivity), drawn if the loop is stable; so is the phase margin of one coordinate. The gain margin is drawn if
    the loop has a largest gain, stable or not.
    """
    style.zero_lines(axes)
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 361))
    axes.plot(circle.real, circle.imag, color=style.GREY, lw=0.8, ls="--", label="unit circle")
    several = value.shape[-1] > 1
    colours = (*style.SERIES, style.GREY) * value.shape[-1] if several else (style.BLUE,)
    label = "eigenvalues of L" if several else "L"
    for eigenvalue, colour in zip(_eigenvalues(value).T, colours, strict=False):
        # far outside nothing is drawn, so that no line crosses the picture between two points far away
        locus = np.where(np.abs(eigenvalue) < 20 * NYQUIST_HALF, eigenvalue, np.nan)
        axes.plot(locus.real, locus.imag, color=colour, lw=1.3, zorder=3, label=label)
        axes.plot(locus.real, -locus.imag, color=colour, lw=0.6, alpha=0.5, zorder=3)
        label = None
    axes.plot(-1, 0, "+", color=style.RED, ms=10, mew=2, zorder=6, label="−1")
    margins = closed_loop.stability.margins if closed_loop.stability.stable else None
    if margins:
        distance = 1 / margins.sensitivity_peak  # no eigenvalue is nearer than the least singular value of I + L
        free_circle = -1 + distance * circle
        words = "1 over the peak of S" if several else "nearest to −1"
        axes.plot(free_circle.real, free_circle.imag, color=style.RED, lw=0.8, ls=":", label=f"{words}: {distance:.4g}")
    if margins and margins.gain_crossover and not several:
        (at_crossover,) = loop_gain(closed_loop, np.array([margins.gain_crossover]))[:, 0, 0]
        at = at_crossover.real, at_crossover.imag
        axes.plot(*at, "s", color=style.GREEN, ms=4, zorder=5, label=_phase_label(margins))
    if limit := _limit_of(closed_loop)[0]:
        axes.plot(-closed_loop.loop.gain / limit.factor, 0, "o", color=style.RED, ms=4, zorder=5,
                  label=with_minus(f"gain margin {_margin(closed_loop, limit):.4g} dB"))  # fmt: skip
    name = "the eigenvalues of L" if several else "L"
    axes.set(xlim=(-0.6 - NYQUIST_HALF, -0.6 + NYQUIST_HALF), ylim=(-NYQUIST_HALF, NYQUIST_HALF))
    axes.set(xlabel=f"real part of {name}", ylabel=f"imaginary part of {name}")
    axes.set_aspect("equal", adjustable="box")
    style.plain(axes, 6, 6)


def _eigenvalues(value):
    """Eigenvalues of matrices over frequency, shape (f, k): each column follows one from frequency to frequency."""
    if value.shape[-1] == 1:
        return value[:, 0]
    from scipy.optimize import linear_sum_assignment

    eigenvalues = np.linalg.eigvals(value[np.isfinite(value).all(axis=(-2, -1))])
    for row in range(1, len(eigenvalues)):
        distance = np.abs(eigenvalues[row - 1][:, None] - eigenvalues[row][None])
        eigenvalues[row] = eigenvalues[row][linear_sum_assignment(distance)[1]]
    return eigenvalues


def _write_margins(axes, closed_loop):
    """Write gains and margins of a loop beside its Nyquist plot, a line for each: its name, and the number."""
    axes.set_axis_off()
    (limit, known), loop, law = _limit_of(closed_loop), closed_loop.loop, closed_loop.loop.law
    lines = [("gain", f"{loop.gain:.4g} rad/s")]
    lines += [("proportional gain", f"{loop.gain * law.proportional:.4g}")] if law.proportional else []
    lines += [("derivative gain", f"{loop.gain * law.derivative:.4g} s")] if law.derivative else []
    lines += [("delay", f"{law.delay:.4g} s")] if law.delay else []
    lines += [("largest gain", f"{limit.factor:.4g} rad/s" if limit else "none" if known else "not known")]
    lines += [("gain margin", f"{_margin(closed_loop, limit):.4g} dB")] if limit else []
    stability = closed_loop.stability
    lines += _margins_in_words(stability.margins) if stability.stable else [("loop", "unstable")]
    for row, (name, number) in enumerate(lines):
        height = 0.97 - LINE_HEIGHT * row
        axes.text(0.02, height, name, transform=axes.transAxes, fontsize=8)
        axes.text(0.98, height, with_minus(number), transform=axes.transAxes, ha="right", fontsize=8)


def _margins_in_words(margins):
    """Names and texts of the margins of a stable loop: list of (str, str)."""
    lines = []
    if margins.phase_margin is not None:
        lines += [("phase margin", f"{margins.phase_margin:.4g}°"), ("delay margin", f"{margins.delay_margin:.4g} s")]
    lines += [("peak of S", f"{margins.sensitivity_peak:.4g}")]
    return lines + ([("bandwidth", f"{margins.bandwidth:.4g} Hz")] if margins.bandwidth else [])


@style.styled
def loop_in_time(solved):
    """Figure of a `TimeCase`, a loop over time: displacement with and without the loop, and positions of the winches.

    Above them is the input, such as the speed of a gust, unless it is constant.
    """
    time = solved.time
    varies = np.ptp(solved.input.values_in_unit) > 0
    heights = (1, 2, 1.5) if varies else (2, 1.5)
    title = f"Loop, gain {solved.gain:.4g} rad/s: {solved.input.what}"
    figure = style.new_figure(1.3 + 1.1 * sum(heights), title)
    *input_axes, body_axes, winch_axes = grid = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    for axes in input_axes:
        axes.plot(time, solved.input.values_in_unit, color=style.GREY)
        axes.set_ylabel(f"{'wind' if solved.input.unit == 'm/s' else 'input'} [{solved.input.unit}]")
    _displacement(body_axes, solved)
    several = len(solved.winches) > 1
    # winches that reel alike, as in symmetric suspensions, are seen below each other
    widths = np.linspace(2.8, 1.1, len(solved.winches)) if several else [1.1]
    for winch, (name, value) in enumerate(zip(solved.winches, MILLI * solved.response.winch.T, strict=True)):
        winch_axes.plot(time, value, color=style.SERIES[(winch + 1) % len(style.SERIES)], lw=widths[winch],
                        ls=style.DASHES[winch % len(style.DASHES)], label=name.removeprefix("winch."))  # fmt: skip
    winch_axes.set_ylabel("winches [mm]" if several else "winch [mm]")
    winch_axes.set_xlabel("time [s]")
    if several:
        style.legend_below(figure, style.entries_of(winch_axes))
    winch_axes.set_xlim(time[0], time[-1])
    style.plain_axis(winch_axes.xaxis, 8)
    for axes in grid:
        style.plain_axis(axes.yaxis, 5)
    figure.align_ylabels(grid)
    return figure


def _displacement(axes, solved):
    """Draw the measured displacement over time, with and without the loop, its largest value and its settling time.

    For the response to a step, the settling time is drawn, and the band about the final value that defines it. The
    largest value is not marked if a step ends away from zero and its overshoot is at most `CONTROL.settling_band`.
    """
    time, response, unit, step = solved.time, solved.response, solved.unit, solved.step
    if response.open_loop is not None:
        axes.plot(time, MILLI * response.open_loop, color=style.GREY, lw=1.0, ls="--", label="without the loop")
    displacement = MILLI * response.measured
    axes.plot(time, displacement, color=style.BLUE, label="loop closed")
    largest = int(np.argmax(np.abs(displacement)))
    if step is None or step.ends_near_zero or step.overshoot > CONTROL.settling_band:
        excess = "" if step is None or step.ends_near_zero else f" ({100 * step.overshoot:.3g} % over)"
        axes.plot(time[largest], displacement[largest], "o", color=style.RED, ms=4,
                  label=with_minus(f"{displacement[largest]:.4g} {unit} at {time[largest]:.4g} s{excess}"))  # fmt: skip
    if step is not None:
        band = CONTROL.settling_band * step.size * np.array([-1, 1])
        axes.axhspan(*(MILLI * (step.final + band)), color=style.RED, alpha=0.15, lw=0)
    if step is not None and step.settling_time is not None and step.resolved:
        settled = f"settled to 2 % at {step.settling_time:.4g} s"
        axes.axvline(step.settling_time, color=style.RED, lw=0.9, ls=":", label=settled)
    axes.set_ylabel(f"{solved.name} [{unit}]")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.2 * (high - low))  # so that the legend is above the curves
    axes.legend(loc="upper right", ncols=4, **LEGEND)


# ---------------------------------------------------------------------------------- frequency responses of state spaces


@style.styled
def bode(curves, frequency, *numbers, title="frequency responses"):
    """Figure of frequency responses: a panel of their magnitudes against frequency, and below it one of their phases.

    Parameters
    ----------
    curves : list of Curve
        Names and unit of the responses; all have one unit.
    frequency : ndarray, shape (m,)
        Ascending. [Hz]
    numbers : ndarray, shape (m,)
        Magnitude [unit] and phase [deg] of the first curve, then of the second, and so on.
    title : str
        Title of a figure of several curves; one curve has its label as the title.
    """
    title = curves[0].label if len(curves) == 1 else title
    figure = style.new_figure(5.2 + 0.09 * (len(curves) - 1), title[0].upper() + title[1:])
    magnitude, phase = style.panels(figure, 2, 1, height_ratios=(3, 2))
    for k, (colour, dashes, curve) in enumerate(zip(cycle(style.SERIES), cycle(style.DASHES), curves, strict=False)):
        look = {"color": colour, "ls": dashes, "lw": 1.1, "label": curve.label}  # dashed, since curves may coincide
        magnitude.loglog(frequency, numbers[2 * k], **look)
        phase.semilogx(frequency, numbers[2 * k + 1], **look)
    magnitude.set_ylabel(axis_label("magnitude", curves[0].unit or "-"))
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [Hz]")
    low, high = phase.get_ylim()
    if high - low < 180:  # fewer than two multiples of 90 degrees might be in it
        style.plain_axis(phase.yaxis, 5)
    elif high - low < 2000:  # else ticks at multiples of 180 degrees would be too dense
        phase.yaxis.set_major_locator(MultipleLocator(90 if high - low < 800 else 180))
    low, high = magnitude.get_ylim()
    if high < 4 * low:
        style.log_axis(magnitude.yaxis, low, high)
    magnitude.set_xlim(frequency[0], frequency[-1])
    if len(curves) > 1:
        style.legend_below(figure, style.entries_of(magnitude))
    figure.align_ylabels()
    return figure
