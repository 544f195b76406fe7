"""What the commands static, modes, windrms and loop compute of a scene of one cable: an `Answer` each."""

from dataclasses import replace

from cablestudy.errors import SceneError
from cablestudy.interface.answer import Answer
from cablestudy.interface.kinds import Duration, Frequencies, Frequency, Modes, Size, Text, WindOn

DEFAULT_MODES = 12


def static(scene, estimate: bool = False):
    """`estimate`: whether the errors of deflections by fixed elements are to be estimated."""
    from cablestudy.study.report import static_table

    return _of_row(scene, *static_table(scene.model, estimate), lambda case, plots: plots.static_form(case))


def shape(scene, estimate: bool = False):
    """The static shape, point by point."""
    from cablestudy.study.report import shape_table

    answer = static(scene, estimate)
    return replace(answer, table=None if answer.failures else shape_table(answer.case))


def modes(scene, count: Modes | None = None, upto: Frequency | None = None, estimate: bool = False):
    """The modes with fixed ends: `count` of them, or all up to a frequency."""
    from cablestudy.study import case_modes
    from cablestudy.study.case import Case
    from cablestudy.study.notes import fixed_gondola, long_cable, reference_without_loads
    from cablestudy.study.report import mode_table

    limit = frequency_limit(count, upto)
    asked = count or DEFAULT_MODES
    case, found, notes, warnings = case_modes.modes(Case(scene.model), asked, limit, estimate=estimate)
    return Answer(
        table=mode_table(case, found),
        explain=lambda: tuple(notes),
        warnings=(
            *fixed_gondola(scene.model),
            *reference_without_loads(scene.model),
            *long_cable(case),
            *warnings,
            *fewer_modes(found, asked, limit),
        ),
        draw=lambda plots: plots.mode_shapes(case, found),
        case=case,
    )


def frequency_limit(count, upto):
    """The frequency up to which modes are asked for [Hz], or None; SceneError where a number of them is given too."""
    from cablestudy.scene.units import read_frequency

    if count is not None and upto is not None:
        raise SceneError("count and upto exclude each other")
    return read_frequency("--upto", str(upto)) if upto is not None else None


def fewer_modes(found, asked, limit):
    """A line where a model has fewer modes than were asked for; at most one."""
    short = limit is None and len(found) < asked
    return (f"the model has {len(found)} modes, not {asked}",) if short else ()


def windrms(scene, on: WindOn | None = None, estimate: bool = False):
    """`on`: what the wind acts on, see `Scene.windrms`."""
    from cablestudy.study.wind_report import wind_table

    table, row, remarks = wind_table(scene.document, scene.model, on, estimate)
    draw = (lambda case, plots: plots.wind_response(case, on or "gondola")) if scene.model.gondola else None
    return _of_row(scene, table, row, draw, remarks)


def loop(
    scene,
    response: Frequencies | None = None,
    time: Duration | None = None,
    input: Text | None = None,
    size: Size | None = None,
    length: Duration | None = None,
    output: Text | None = None,
    estimate: bool = False,
):
    """The loop, or its `response` over a range of frequencies, or what it does in `time`; see `Scene.loop_in_time`."""
    from cablestudy.study import loop_report
    from cablestudy.study.loop_in_time import time_case

    span, asked = loop_options(response, time, input=input, size=size, length=length, output=output)
    answer = _of_row(scene, *loop_report.loop_table(scene.document, scene.model, estimate), None)
    if asked and not answer.failures:
        return in_time(answer, time_case(scene.document, answer.case, asked))
    if asked or not loop_report.has_loop(answer.case):
        return replace(answer, table=None) if asked or span else answer
    # an unstable loop too has a response over frequency
    table = loop_report.response_table(answer.case.in_wind.controlled, span) if span else answer.table
    return replace(answer, table=table, draw=lambda plots: plots.loop_margins(answer.case, span))


def loop_options(response, time, **timed):
    """The range of frequencies and the `TimeOptions` of the command `loop`, None each where it is not asked for."""
    from cablestudy.study.loop_in_time import TimeOptions
    from cablestudy.study.ssm import read_span

    return read_span(response) if response else None, TimeOptions(time, **timed) if time else None


def in_time(answer, solved):
    """The `Answer` with the table, notes and picture of a `TimeCase`."""
    from cablestudy.study.loop_in_time import time_table

    return replace(
        answer,
        table=time_table(solved),
        warnings=(*answer.warnings, *solved.notes),
        draw=lambda plots: plots.loop_in_time(solved),
    )


def _of_row(scene, table, row, draw, remarks=()):
    """The `Answer` of a table of one row."""
    from cablestudy.study.notes import long_cable, reference_without_loads

    return Answer(
        table=table,
        explain=lambda: row.notes,
        warnings=(*reference_without_loads(scene.model), *long_cable(row.case), *row.warnings, *remarks),
        failures=(row.cells["status"],) if row.failed else (),
        draw=None if draw is None or row.failed else lambda plots: draw(row.case, plots),
        case=row.case,
    )


ANSWERS = {"static": static, "shape": shape, "modes": modes, "windrms": windrms, "loop": loop}
