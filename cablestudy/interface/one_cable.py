"""Functions behind the commands static, modes, windrms and loop of a scene of one cable, which return an `Answer`."""

from dataclasses import replace

from cablestudy.errors import SceneError
from cablestudy.interface.answer import Answer, only
from cablestudy.interface.answers import (
    DEFAULT_MODES,
    SHARED,
    check_cable,
    coupled_modes,
    fewer_modes,
    frequency_limit,
)
from cablestudy.scene.scene import CABLE

ONE_CABLE = "no effect: the scene has one cable"
WIND_ON = {"gondola": "gondola", "cable": "the cable of the gondola", "both": "gondola and cable"}  # in titles


def static(scene, estimate=False):
    """Statics of the cable: an `Answer`; `estimate`: also the errors of deflections by fixed elements."""
    from cablestudy.study.one_cable.report import static_table

    return _answer_of_row(scene, *static_table(scene.model, estimate), lambda case, plots: plots.static_form(case))


def shape(scene, estimate=False):
    """The static shape, point by point."""
    from cablestudy.study.one_cable.report import shape_table

    answer = static(scene, estimate)
    return replace(answer, tables={} if answer.failures else only(shape_table(answer.case)))


def modes(scene, count=None, upto=None, cable=None, coupled=False, estimate=False):
    """Answer of the command modes: natural frequencies and types of the modes of the cable; see `Scene.modes`."""
    check_cable(cable, [CABLE])
    if coupled and cable:
        raise SceneError("--cable: no effect: --coupled has the modes of cable and gondola together")
    if coupled:
        return _coupled_modes(scene, count, upto)
    from cablestudy.study.notes import fixed_gondola, long_cable, reference_without_loads
    from cablestudy.study.one_cable import case_modes
    from cablestudy.study.one_cable.case import CableCase
    from cablestudy.study.one_cable.report import mode_table
    from cablestudy.study.vibration import diameters_of_modes, galloping_notes, tension_notes, with_lock_in

    limit = frequency_limit(count, upto)
    asked = count or DEFAULT_MODES
    case, cable_modes, notes, warnings = case_modes.modes(CableCase(scene.model), asked, limit, estimate=estimate)
    table = mode_table(case, cable_modes)
    return Answer(
        tables=only(with_lock_in(table, diameters_of_modes(table, scene.model.wind_diameter))),
        explain=lambda: (*notes, *tension_notes(scene.model, case.results)),
        warnings=(
            *(fixed_gondola(scene.model) if cable is None else ()),
            *reference_without_loads(scene.model),
            *long_cable(case),
            *warnings,
            *galloping_notes(scene.model.load_case),
            *fewer_modes(cable_modes, asked, limit),
        ),
        draw=lambda plots, share=None: plots.mode_shapes(case, cable_modes, share),
        case=case,
    )


def _coupled_modes(scene, count, upto):
    """The coupled modes of the cable and its gondola, if it has one, without winch and wind."""
    from cablestudy.study.notes import reference_without_loads
    from cablestudy.study.one_cable.case import CableCase
    from cablestudy.study.one_cable.columns import suspension_of
    from cablestudy.study.suspension.notes import mode_notes

    case = suspension_of(CableCase(scene.model))
    answer = coupled_modes(case, count, upto)
    lines = (line for modes in case.largest_modes for line in mode_notes(modes, case.mode_errors(modes)))
    return replace(
        answer,
        explain=lambda: (*lines, *answer.explain()),
        warnings=(*reference_without_loads(scene.model), *answer.warnings),
    )


def windrms(scene, on=None, estimate=False):
    """Motion of the gondola, or of a bare cable, in the wind: an `Answer`; see `Scene.windrms`."""
    from cablestudy.study.one_cable.system import analyses_of_winds
    from cablestudy.study.one_cable.wind_report import wind_table

    table, row, remarks = wind_table(scene.document, scene.model, on, estimate)

    def draw(case, plots):
        if scene.model.gondola is None:
            return plots.wind_response(analyses_of_winds(case, "cable"), on="the cable")
        winds = (analyses_of_winds(case, on or "gondola", open_loop) for open_loop in (False, True))
        return plots.wind_response(*winds, WIND_ON[on or "gondola"])

    return _answer_of_row(scene, table, row, draw, remarks)


def solve_loop(scene, frequency_range, time_options, table, estimate):
    """Compute the margins of the winch loop for the command `loop`, and the analysis from which it computes the rest.

    Parameters
    ----------
    scene : Scene
    frequency_range : tuple (float, float, int) or None
        Lowest and highest frequency [Hz] and number of frequencies of a response that is asked for.
    time_options : TimeOptions or None
        Options of a response in time that is asked for.
    table : str or None
        The only table that is asked for; of a suspension alone, see `suspension.solve_loop`.
    estimate : bool
        Whether to estimate errors.

    Returns
    -------
    answer : Answer
        With the table of margins; without a table if a response is asked for that cannot be computed.
    analysis : DynamicAnalysis or None
        For picture and responses; None if there is no loop to show.

    Raises
    ------
    SceneError
        The scene lacks a key of the loop, or an input or output of the options is wrong.
    """
    from cablestudy.study import loop_report

    if time_options:
        from cablestudy.study.column import require
        from cablestudy.study.loop_in_time import input_and_output

        require(scene.document, scene.model, loop_report.LOOP_KEYS, "loop")
        input_and_output(scene.document, scene.model, time_options)
    answer = _answer_of_row(scene, *loop_report.loop_table(scene.document, scene.model, estimate), draw=None)
    if (time_options and answer.failures) or not loop_report.has_loop(answer.case):
        return (replace(answer, tables={}) if time_options or frequency_range else answer), None
    return answer, answer.case.analysis


def _answer_of_row(scene, table, row, draw, remarks=()):
    """The `Answer` of a table of one row."""
    from cablestudy.study.notes import long_cable, reference_without_loads

    return Answer(
        tables=only(table),
        explain=lambda: row.notes,
        warnings=(*reference_without_loads(scene.model), *long_cable(row.case), *row.warnings, *remarks),
        failures=(row.cells["status"],) if row.failed else (),
        draw=None if draw is None or row.failed else lambda plots: draw(row.case, plots),
        case=row.case,
    )


ANSWERS = {"static": static, "shape": shape, "modes": modes, "windrms": windrms, **SHARED}
