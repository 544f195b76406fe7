"""Commands of one cable and of suspensions alike: loads, locus, limits, loop, ssm, trade, find: an `Answer` each."""

import shlex
from contextlib import suppress
from dataclasses import replace

from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.interface.answer import Answer, only
from cablestudy.interface.kinds import Between, Columns, Duration, File, Frequencies, Goal, Runs, Size, Text

DEFAULT_MODES = 12


def loads(scene, estimate: bool = False):
    """Position, slopes and tensions at each point load; notes, warnings and picture of the `Answer` are of static."""
    from cablestudy.study.point_loads import loads_table
    from cablestudy.study.scene_kind import kind_of

    answer, failures = scene.answers["static"](scene, estimate=estimate), []
    if failed := _failure_without_loads(scene, "static --table loads"):
        return failed
    try:
        table = loads_table(kind_of(scene.model).loaded_cables(answer.case), failures)
    except (NoSolutionError, ConvergenceError) as error:
        table, failures = None, [str(error)]
    return replace(answer, tables=only(table), failures=tuple(failures))


def locus(scene, load: Text):
    """The path of a `load` that travels along its cable, of one cable and of suspensions; see `Scene.locus`."""
    from cablestudy.study.load_path import load_path
    from cablestudy.study.scene_kind import kind_of

    if failed := _failure_without_loads(scene, "static --locus"):
        return failed
    path = load_path(scene.document, scene.model, load)
    return Answer(
        tables=only(path.table),
        warnings=kind_of(scene.model).notes_on_stated(scene.model),
        failures=tuple(path.failures),
        draw=(lambda plots: plots.load_path(path)) if path.cables else None,
    )


def _failure_without_loads(scene, command):
    """The failed `Answer` of a load case without point loads, None of one with some; SceneError if no case has any."""
    from cablestudy.scene.scene import missing

    model = scene.model
    if model.load_paths:
        return None
    if not any(case.loads for case in model.cases.values()):
        raise missing(scene.document, scene.loads_key, command)
    return Answer(failures=("no cable carries a point load",))


def limits(scene):
    """Every limit of a scene, of one cable or a suspension, where its margin is least."""
    from cablestudy.scene.scene import missing
    from cablestudy.study.limits import NOT_MET, limits_table, unanswered
    from cablestudy.study.study_rows import checks_of

    if not scene.model.limits:
        raise missing(scene.document, "limits", "static --limits")
    (checks,) = checks_of([scene.model])
    not_met = [check for check in checks if check.status == NOT_MET]
    warnings = tuple(f"not met: {check.governing}: {check.limit.that}" for check in not_met)
    reason = unanswered(checks)
    return Answer(tables=only(limits_table(checks)), warnings=warnings, failures=(reason,) if reason else ())


def frequency_limit(count, upto):
    """The frequency up to which modes are asked for [Hz], or None; SceneError where a number of them is given too."""
    from cablestudy.scene.units import read_frequency

    if count is not None and upto is not None:
        raise SceneError("count and upto exclude each other")
    return read_frequency("--upto", str(upto)) if upto is not None else None


def fewer_modes(modes, asked, limit):
    """Warning, in a tuple, where a model has fewer modes than asked for, and not all up to a frequency limit [Hz]."""
    is_short = limit is None and len(modes) < asked
    return (f"the model has {len(modes)} modes, not {asked}",) if is_short else ()


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
    time_options = TimeOptions(time, input=input, size=size, length=length, output=output) if time else None
    return scene.solve_loop(scene, span, time_options, table, estimate)


def with_loop(answer, scene, in_wind, span, time_options, **named):
    """An `Answer` on a loop with its picture; with its table over frequency, or with table and picture in time instead.

    Parameters
    ----------
    answer : Answer
    scene : Scene
    in_wind : DynamicAnalysis
    span, time_options
        As of `solve_loop`.
    **named
        Of `loop_in_time.time_case`.
    """
    from cablestudy.study.loop_in_time import time_case, time_table
    from cablestudy.study.loop_report import response_table

    if time_options:
        solved = time_case(scene.document, scene.model, in_wind.closed_loop, time_options, **named)
        lines, draw = (*answer.warnings, *solved.notes), lambda plots: plots.loop_in_time(solved)
        return replace(answer, tables=only(time_table(solved)), warnings=lines, draw=draw)
    closed_loop = in_wind.controlled
    answer = replace(answer, draw=lambda plots: plots.loop_margins(closed_loop, span))
    # an unstable loop too has a response over frequency
    return replace(answer, tables=only(response_table(closed_loop, span))) if span else answer


def ssm(scene, out: File | None = None, response: Frequencies | None = None, **options):
    """State space of a scene: its kept modes, or its `response` at a range and number of frequencies; its file `out`.

    Other options are those of `ssm.StateSpaceOptions`.
    """
    from cablestudy.study.notes import reference_without_loads
    from cablestudy.study.ssm import (
        StateSpaceOptions,
        check_file,
        exported,
        improper_note,
        read_span,
        size_line,
        viscous_note,
        write,
    )
    from cablestudy.study.ssm_tables import drawn, response_table, with_resonances

    check_file(out)
    state_space_options, span = StateSpaceOptions(**options), read_span(response) if response else None
    attached = state_space_options.attached
    if attached in scene.absent:
        raise SceneError(scene.absent[attached])
    scene.check_state_space(state_space_options, bool(span), out)
    choice = scene.kept_modes(state_space_options, span and span[1])
    warnings = [*reference_without_loads(scene.model), *choice.warnings]
    if out:
        system = exported(choice.system(), state_space_options)
        write(system, out)
        notes = [*improper_note(system), *viscous_note([cable.damping for cable in scene.model.cables.values()])]
        warnings += [size_line(choice, system), *notes, f"written: {out}"]
    elif not span:
        warnings.append(size_line(choice, choice.system()))
    answer = Answer(explain=lambda: tuple(choice.notes), warnings=tuple(warnings), case=choice)
    if span:
        curves = choice.curves()
        with suppress(NoSolutionError):  # a state space that overflows: then its poles are not known
            span = with_resonances(span, choice.poles)
        return replace(
            answer,
            tables=only(response_table(span, curves)),
            draw=lambda plots: _bode_plot(plots, curves, drawn(span, curves), attached),
        )
    draw = (lambda plots: plots.loop_margins(choice.whole)) if attached == "loop" else None
    return replace(answer, tables=only(None if out else choice.mode_table()), draw=draw)


def _bode_plot(plots, curves, numbers, attached):
    """The picture of frequency responses, of numbers from `ssm_tables.drawn`; SceneError for several units."""
    units = dict.fromkeys(curve.unit or "-" for curve in curves)
    if len(units) > 1:
        raise SceneError(f"--plot: draws responses of one unit, these have {', '.join(units)}")
    title = {"title": "gondola position over winch movement"} if attached == "gondola" else {}
    return plots.bode(curves, *numbers, **title)


def compare_models(
    scene,
    columns: Columns | None = None,
    repeats: Runs = 5,
    out: File | None = None,
    shown: bool = False,
):
    """Error against time of every model, see `Scene.trade`; `out`: a folder for its tables; `shown`: for Markdown."""
    from cablestudy.study import trade
    from cablestudy.study.table import TableFiles

    compared, notes = trade.columns_to_compare(scene.document, scene.model, columns)
    files = None if out is None else TableFiles(out, trade.file_name(scene.path))
    if files:
        files.check_writable()
    comparison = trade.compare(scene.model, compared, repeats)
    title = shlex.join([scene.path, *(word for change in scene.changes for word in ("--set", change))])
    if files:
        trade.write(comparison, files, title)
        notes = [*notes, f"written: {files.csv}, {files.md}"]
    reference = comparison.reference
    return Answer(
        tables=only(trade.table_of(comparison, for_markdown=shown)),
        explain=lambda: tuple(trade.notes_of(comparison)),
        warnings=(*notes, *reference.warnings),
        failures=tuple(f"{name}: {reason}" for name, reason in reference.failures.items()),
        draw=lambda plots: plots.trade_plot(comparison, f"Error against time: {title}"),
    )


def find(scene, goal: Goal, by: Text, between: Between | None = None, columns: Columns | None = None):
    """The values of a key of a `Scene`; see `Scene.find`."""
    return find_value(scene.document, goal, by, between, columns)


def find_value(document, goal, by, between=None, columns=None):
    """`Answer` of the values of a key for which a column takes a value.

    Parameters
    ----------
    document : Document
    goal, by, between, columns : str
        See `Scene.find`.
    """
    from cablestudy.study import find, find_limits
    from cablestudy.study.goal import LIMITS, read_find, read_goal
    from cablestudy.study.scene_kind import kind_of

    search = read_goal(*read_find(goal, by, between), document)
    shown_columns = find.shown_columns(search, document, columns)
    if goal.strip() == LIMITS:
        solutions, table, rows = find_limits.ranges(search, document, shown_columns)
        several = ()
    else:
        solutions = find.solve(search, document)
        table, rows = find.find_table(search, solutions, shown_columns)
        several = (f"{len(solutions.values)} values of {by}",) if len(solutions.values) > 1 else ()
    notes = kind_of(solutions.scenes[0]).notes_on_found(rows[0].case)
    warnings = dict.fromkeys((*solutions.notes, *(warning for row in rows for warning in row.warnings), *notes))
    return Answer(
        tables=only(table),
        warnings=(*warnings, *several),
        failures=tuple(dict.fromkeys(row.cells["status"] for row in rows if row.failed)),
    )


SHARED = {
    "loads": loads,
    "locus": locus,
    "limits": limits,
    "loop": loop,
    "ssm": ssm,
    "trade": compare_models,
    "find": find,
}
