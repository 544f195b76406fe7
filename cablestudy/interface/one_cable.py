"""Commands static, modes, windrms and loop of a scene of one cable, and limits of any scene: an `Answer` each."""

from dataclasses import replace

from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.interface.answer import Answer
from cablestudy.interface.kinds import Duration, Frequencies, Frequency, Modes, Size, Text, WindOn

DEFAULT_MODES = 12
WIND_ON = {"gondola": "gondola", "cable": "the cable of the gondola", "both": "gondola and cable"}  # in titles


def static(scene, estimate: bool = False):
    """`estimate`: whether the errors of deflections by fixed elements are to be estimated."""
    from cablestudy.study.report import static_table

    return _of_row(scene, *static_table(scene.model, estimate), lambda case, plots: plots.static_form(case))


def shape(scene, estimate: bool = False):
    """The static shape, point by point."""
    from cablestudy.study.report import shape_table

    answer = static(scene, estimate)
    return replace(answer, table=None if answer.failures else shape_table(answer.case))


def loads(scene, estimate: bool = False):
    """Place, slopes and tensions at each point load."""
    return with_loads(scene, static(scene, estimate))


def with_loads(scene, answer):
    """The `Answer` of static of a scene, with the table of its point loads instead."""
    from cablestudy.study.point_loads import loads_table
    from cablestudy.study.scene_kind import kind_of

    if refused := _without_loads(scene, "static --table loads"):
        return refused
    failures = []
    try:
        table = loads_table(kind_of(scene.model).loaded_cables(answer.case), failures)
    except (NoSolutionError, ConvergenceError) as error:
        table, failures = None, [str(error)]
    return replace(answer, table=table, failures=tuple(failures))


def locus(scene, load: Text):
    """The path of a `load` that travels along its cable, of one cable and of suspensions; see `Scene.locus`."""
    from cablestudy.study.load_path import load_path
    from cablestudy.study.scene_kind import kind_of

    if refused := _without_loads(scene, "static --locus"):
        return refused
    path = load_path(scene.document, scene.model, load)
    return Answer(
        table=path.table,
        warnings=kind_of(scene.model).notes_on_stated(scene.model),
        failures=tuple(path.failures),
        draw=(lambda plots: plots.load_path(path)) if path.cables else None,
    )


def _without_loads(scene, command):
    """The `Answer` of a load case without loads, None of one with some; SceneError where no case has any."""
    from cablestudy.scene.scene import missing

    model = scene.model
    if model.load_paths:
        return None
    if not any(case.loads for case in model.cases.values()):
        raise missing(scene.document, scene.loads_key, command)
    return Answer(failures=("no cable carries a point load",))


def modes(scene, count: Modes | None = None, upto: Frequency | None = None, estimate: bool = False):
    """The modes with fixed ends: `count` of them, or all up to a frequency."""
    from cablestudy.study import case_modes
    from cablestudy.study.case import Case
    from cablestudy.study.notes import fixed_gondola, long_cable, reference_without_loads
    from cablestudy.study.report import mode_table
    from cablestudy.study.vibration import diameters_of_modes, galloping_notes, tension_notes, with_lock_in

    limit = frequency_limit(count, upto)
    asked = count or DEFAULT_MODES
    case, found, notes, warnings = case_modes.modes(Case(scene.model), asked, limit, estimate=estimate)
    table = mode_table(case, found)
    return Answer(
        table=with_lock_in(table, diameters_of_modes(table, scene.model.wind_diameter)),
        explain=lambda: (*notes, *tension_notes(scene.model, case.results)),
        warnings=(
            *fixed_gondola(scene.model),
            *reference_without_loads(scene.model),
            *long_cable(case),
            *warnings,
            *galloping_notes(scene.model.load_case),
            *fewer_modes(found, asked, limit),
        ),
        draw=lambda plots, share=None: plots.mode_shapes(case, found, share),
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

    def draw(case, plots):
        if scene.model.gondola is None:
            return plots.wind_response(case.winds_on("cable"), on="the cable")
        winds = (case.winds_on(on or "gondola", open_loop) for open_loop in (False, True))
        return plots.wind_response(*winds, WIND_ON[on or "gondola"])

    return _of_row(scene, table, row, draw, remarks)


def loop(
    scene,
    response: Frequencies | None = None,
    time: Duration | None = None,
    table: Text | None = None,
    input: Text | None = None,
    size: Size | None = None,
    length: Duration | None = None,
    output: Text | None = None,
    estimate: bool = False,
):
    """The loop, or its `response` over a range of frequencies, or what it does in `time`; see `Scene.loop_in_time`."""
    from cablestudy.study.loop_in_time import TimeOptions
    from cablestudy.study.ssm import read_span

    span = read_span(response) if response else None
    asked = TimeOptions(time, input=input, size=size, length=length, output=output) if time else None
    return scene.solve_loop(scene, span, asked, table, estimate)


def solve_loop(scene, span, asked, _, estimate):
    """`Answer` of the loop.

    Parameters
    ----------
    scene : Scene
    span : (float, float, int) or None
        From `ssm.read_span`, of its response over frequency.
    asked : TimeOptions or None
        For its response in time.
    table : str or None
        Of a suspension, the only one that is asked for.
    estimate : bool
    """
    from cablestudy.scene.one_cable import NAMES, WIND_KEYS
    from cablestudy.study import loop_report

    if asked and asked.output is not None:
        raise SceneError("--output: no effect: the scene has one cable")
    answer = _of_row(scene, *loop_report.loop_table(scene.document, scene.model, estimate), None)
    if (asked and answer.failures) or not loop_report.has_loop(answer.case):
        return replace(answer, table=None) if asked or span else answer
    return with_loop(answer, scene, answer.case.in_wind, span, asked, names=NAMES, wind_keys=WIND_KEYS)


def with_loop(answer, scene, in_wind, span, asked, **named):
    """An `Answer` with the picture of a loop, or with its table over a range of frequencies, or with what it does.

    Parameters
    ----------
    answer : Answer
    scene : Scene
    in_wind : InWind
    span, asked
        As of `solve_loop`.
    **named
        Of `loop_in_time.time_case`.
    """
    from cablestudy.study.loop_in_time import time_case, time_table
    from cablestudy.study.loop_report import response_table

    if asked:
        solved = time_case(scene.document, scene.model, in_wind.movement, asked, **named)
        lines, draw = (*answer.warnings, *solved.notes), lambda plots: plots.loop_in_time(solved)
        return replace(answer, table=time_table(solved), tables=None, warnings=lines, draw=draw)
    movement = in_wind.controlled
    answer = replace(answer, draw=lambda plots: plots.loop_margins(movement, span))
    # an unstable loop too has a response over frequency
    return replace(answer, table=response_table(movement, span), tables=None) if span else answer


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


def limits(scene):
    """Every limit of a scene, of one cable or a suspension, where its margin is least."""
    from cablestudy.scene.scene import missing
    from cablestudy.study.limits import NOT_MET, limits_table, unanswered
    from cablestudy.study.study_rows import checks_of

    if not scene.model.limits:
        raise missing(scene.document, "limits", "static --limits")
    (checks,) = checks_of([scene.model])
    broken, reason = [check for check in checks if check.status == NOT_MET], unanswered(checks)
    lines = tuple(f"not met: {check.governing}: {check.limit.that}" for check in broken)
    return Answer(table=limits_table(checks), warnings=lines, failures=(reason,) if reason else ())


ANSWERS = {
    "static": static,
    "shape": shape,
    "loads": loads,
    "locus": locus,
    "modes": modes,
    "windrms": windrms,
    "loop": loop,
    "limits": limits,
}
