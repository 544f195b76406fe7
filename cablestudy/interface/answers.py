"""Functions behind the commands of one cable and of suspensions alike, each of which returns an `Answer`.

They are loads, locus and limits (of static), loop, ssm, trade and find. The argument `scene` is an `interface.Scene`.
"""

import shlex
from contextlib import suppress
from dataclasses import replace

from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError
from cablestudy.interface.answer import Answer, only

DEFAULT_MODES = 12


def loads(scene, estimate=False):
    """Answer of static --table loads: position, slopes and tensions at each point load; all else as for static."""
    from cablestudy.study.point_loads import loaded_cables, loads_table

    answer, failures = scene.answers["static"](scene, estimate=estimate), []
    if failed := _failure_without_loads(scene, "static --table loads"):
        return failed
    try:
        table = loads_table(loaded_cables(answer.case), failures)
    except (NoSolutionError, ConvergenceError) as error:
        table, failures = None, [str(error)]
    return replace(answer, tables=only(table), failures=tuple(failures))


def locus(scene, load):
    """Answer of static --locus: the path of the point load `load` that travels along its cable; see `Scene.locus`."""
    from cablestudy.study.load_path import load_path
    from cablestudy.study.scene_kind import kind_of

    if failed := _failure_without_loads(scene, "static --locus"):
        return failed
    path, kind = load_path(scene.document, scene.model, load), kind_of(scene.model)
    return Answer(
        tables=only(path.table),
        warnings=kind.notes_on_stated(kind.case(scene.model)),
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
    """Answer of static --limits: every limit of a scene, where its margin is least."""
    from cablestudy.scene.scene import missing
    from cablestudy.study.limits import limits_table, unanswered
    from cablestudy.study.study_rows import checks_of

    if not scene.model.limits:
        raise missing(scene.document, "limits", "static --limits")
    (checks,) = checks_of([scene.model])
    warnings = tuple(line for check in checks for line in check.warnings)
    reason = unanswered(checks)
    return Answer(tables=only(limits_table(checks)), warnings=warnings, failures=(reason,) if reason else ())


def check_cable(name, cables):
    """Refuse the name of a cable that is none of the `cables` of a scene: SceneError; None is no name."""
    from cablestudy.scene.fields import suggestion

    if name is not None and name not in cables:
        raise SceneError(f"--cable {name}: no such cable ({suggestion(name, cables)})")


def frequency_limit(count, upto):
    """The frequency up to which modes are asked for [Hz], or None; SceneError where a number of them is given too."""
    from cablestudy.scene.units import read_positive

    if count is not None and upto is not None:
        raise SceneError("count and upto exclude each other")
    return read_positive("--upto", str(upto), "Hz") if upto is not None else None


def fewer_modes(modes, asked, limit):
    """Warning, in a tuple, where a model has fewer modes than asked for, and not all up to a frequency limit [Hz]."""
    from cablestudy.scene.words import counted

    is_short = limit is None and len(modes) < asked
    return (f"the model has {counted(len(modes), 'mode')}, not {asked}",) if is_short else ()


def coupled_modes(case, count, upto):
    """Answer of the command modes with the coupled modes of a `SuspensionCase`: those of cables and bodies together.

    Arguments are those of `suspension.modes`. It has the notes and warnings on the modes, and lacks those on the case
    itself.
    """
    from cablestudy.study.suspension.notes import unknown_damping_ratios
    from cablestudy.study.suspension.report import mode_notes, mode_table
    from cablestudy.study.vibration import diameters_of_coupled_modes, with_lock_in

    limit, size = frequency_limit(count, upto), count or DEFAULT_MODES
    modes = case.modes(size) if limit is None else case.modes_up_to(limit)
    asked = range(len(modes)) if limit is None else modes.up_to(limit)  # indices of those to show
    table = mode_table(case, modes, asked)
    return Answer(
        tables=only(with_lock_in(table, diameters_of_coupled_modes(table, case.scene))),
        explain=lambda: mode_notes(case, modes, len(asked)),
        warnings=(*fewer_modes(modes, size, limit), *unknown_damping_ratios(modes)),
        draw=lambda plots, share=None: plots.coupled_mode_shapes(case, modes, len(asked), share),
        case=case,
    )


def loop(scene, response=None, time=None, table=None, estimate=False, **time_options):
    """Answer of the command loop: margins of the winch control loop, or its response over frequency or in time.

    Arguments are those of `Scene.loop_response` and `Scene.loop_in_time`; with one of them table and picture are of the
    response. `table` is the name of the only table of a suspension that is asked for; with `estimate` errors are
    estimated too.
    """
    frequency_range = timing = None
    if response:
        from cablestudy.study.ssm import read_response_range

        frequency_range = read_response_range(response)
    if time:
        from cablestudy.study.loop_in_time import TimeOptions

        timing = TimeOptions(time, **time_options)
    answer, analysis = scene.solve_loop(scene, frequency_range, timing, table, estimate)
    if analysis is None:
        return answer
    if timing:
        from cablestudy.study.loop_in_time import time_case, time_table

        timed = time_case(scene.document, scene.model, analysis, timing)
        warnings, draw = (*answer.warnings, *timed.notes), lambda plots: plots.loop_in_time(timed)
        return replace(answer, tables=only(time_table(timed)), warnings=warnings, draw=draw)
    closed_loop = analysis.loop_for_margins
    if frequency_range:
        from cablestudy.study.loop_report import response_table

        answer = replace(answer, tables=only(response_table(closed_loop, frequency_range)))  # of an unstable loop too
    return replace(answer, draw=lambda plots: plots.loop_margins(closed_loop, frequency_range))


def ssm(scene, out=None, response=None, **options):
    """Answer of the command ssm: a state-space model of a scene, reduced to some of its modes, which the table lists.

    With `response`, as in `Scene.loop_response`, the table is the frequency response of the model; where only the file
    `out` is written there is none. The other options are fields of `ssm.StateSpaceOptions`.
    """
    from cablestudy.study import ssm as state_spaces
    from cablestudy.study.scene_kind import kind_of
    from cablestudy.study.ssm_tables import drawn_points, response_table, with_resonances

    state_spaces.check_file(out)
    state_space_options = state_spaces.StateSpaceOptions(**options)
    frequency_range = state_spaces.read_response_range(response) if response else None
    attached = state_space_options.attached
    if attached in scene.absent:
        raise SceneError(scene.absent[attached])
    kind = kind_of(scene.model)
    kind.ssm.check_options(state_space_options, bool(frequency_range), out)
    choice = kind.ssm.choose(scene.document, scene.model, state_space_options, frequency_range and frequency_range[1])
    warnings = [*kind.notes_on_stated(choice.case), *choice.warnings]
    if out:
        system = state_spaces.exported(choice.system(), choice.options)
        dampings = [cable.damping for cable in scene.model.cables.values()]
        notes = [*state_spaces.improper_note(system), *state_spaces.viscous_note(dampings)]
        warnings += [state_spaces.size_line(choice, system), *notes]
    elif not frequency_range:
        warnings.append(state_spaces.size_line(choice, choice.system()))
    answer = Answer(explain=lambda: tuple(choice.notes), warnings=tuple(warnings), case=choice)
    if out:
        answer = replace(answer, write=lambda: state_spaces.write(system, out))
    if frequency_range:
        curves = choice.curves()
        with suppress(NoSolutionError):  # a state space that overflows: then its poles are not known
            frequency_range = with_resonances(frequency_range, choice.poles)
        return replace(
            answer,
            tables=only(response_table(frequency_range, curves)),
            draw=lambda plots: _bode_plot(plots, curves, drawn_points(frequency_range, curves), choice.title),
        )
    draw = (lambda plots: plots.loop_margins(choice.whole)) if attached == "loop" else None
    return replace(answer, tables=only(None if out else choice.mode_table()), draw=draw)


def _bode_plot(plots, curves, numbers, title):
    """The picture of frequency responses, of numbers from `ssm_tables.drawn_points`; SceneError for several units."""
    units = dict.fromkeys(curve.unit or "-" for curve in curves)
    if len(units) > 1:
        raise SceneError(f"--plot: draws responses of one unit, these have {', '.join(units)}")
    return plots.bode(curves, *numbers, **({"title": title} if title else {}))


def compare_models(scene, columns=None, repeats=5, out=None, shown=False):
    """Answer of the command trade: errors and computing times of all models of a scene that a user can choose.

    They are closed forms, elements of several kinds and numbers, and models refined to an accuracy; errors are relative
    to the continuous cable. Arguments are those of `Scene.trade`; the tables are written to the folder `out`, and with
    `shown` the table is for Markdown.
    """
    from cablestudy.scene.strict_yaml import refuse
    from cablestudy.study import trade
    from cablestudy.study.table import TableFiles

    if not scene.model.cables:
        message = "'cablestudy trade' compares models of cables: there is none"
        raise refuse(scene.document.place(("cables",)), message, "cables")
    compared, notes = trade.columns_to_compare(scene.document, scene.model, columns)
    files = None if out is None else TableFiles(out, trade.file_name(scene.path))
    if files:
        files.check_writable()
    comparison = trade.compare(scene.model, compared, repeats)
    title = shlex.join([scene.path, *(word for change in scene.changes for word in ("--set", change))])
    reference = comparison.reference
    return Answer(
        tables=only(trade.table_of(comparison, for_markdown=shown)),
        explain=lambda: tuple(trade.notes_of(comparison)),
        warnings=(*notes, *reference.warnings),
        failures=tuple(f"{name}: {reason}" for name, reason in reference.failures.items()),
        draw=lambda plots: plots.trade_plot(comparison, f"Error against time: {title}"),
        write=(lambda: trade.write(comparison, files, title)) if files else tuple,
    )


def find(scene, goal, by, between=None, columns=None):
    """Answer of the command find: the values of a key for which a result takes a wanted value; see `Scene.find`."""
    return find_value(scene.document, goal, by, between, columns)


def find_value(document, goal, by, between=None, columns=None):
    """Answer of the command find for the `Document` of a scene, which may lack the key; see `Scene.find`."""
    from cablestudy.study import find, find_limits
    from cablestudy.study.goal import LIMITS, read_find, read_goal
    from cablestudy.study.scene_kind import kind_of

    search = read_goal(*read_find(goal, by, between), document)
    shown_columns = find.shown_columns(search, document, columns)
    if goal.strip() == LIMITS:
        solutions, table, rows = find_limits.ranges(search, document, shown_columns)
        several_values = ()
    else:
        solutions = find.solve(search, document)
        table, rows = find.find_table(search, solutions, shown_columns)
        several_values = (f"{len(solutions.values)} values of {by}",) if len(solutions.values) > 1 else ()
    notes = kind_of(solutions.scenes[0]).notes_on_stated(rows[0].case)
    warnings = dict.fromkeys((*solutions.notes, *(warning for row in rows for warning in row.warnings), *notes))
    return Answer(
        tables=only(table),
        warnings=(*warnings, *several_values),
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
