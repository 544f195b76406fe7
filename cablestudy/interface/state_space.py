"""Command ssm on one cable or a suspension: an `Answer`."""

from contextlib import suppress
from dataclasses import replace

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.interface.answer import Answer
from cablestudy.interface.kinds import File, Frequencies


def _bode(plots, curves, numbers, attached):
    """The picture of responses; SceneError where they have several units."""
    units = dict.fromkeys(curve.unit or "-" for curve in curves)
    if len(units) > 1:
        raise SceneError(f"--plot: draws responses of one unit, these have {', '.join(units)}")
    title = {"title": "gondola position over winch movement"} if attached == "gondola" else {}
    return plots.bode(curves, *numbers, **title)


def ssm(scene, out: File | None = None, response: Frequencies | None = None, **options):
    """`out`: file for the state space; `response`: range and number of frequencies; others: `ssm.StateSpaceOptions`."""
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
    asked, span = StateSpaceOptions(**options), read_span(response) if response else None
    if asked.attached in scene.absent:
        raise SceneError(scene.absent[asked.attached])
    scene.check_state_space(asked, bool(span), out)
    choice = scene.kept_modes(asked, span and span[1])
    lines = [*reference_without_loads(scene.model), *choice.warnings]
    if out:
        system = exported(choice.system(), asked)
        write(system, out)
        notes = [*improper_note(system), *viscous_note([cable.damping for cable in scene.model.cables.values()])]
        lines += [size_line(choice, system), *notes, f"written: {out}"]
    elif not span:
        lines.append(size_line(choice, choice.system()))
    answer = Answer(explain=lambda: tuple(choice.notes), warnings=tuple(lines), case=choice)
    if span:
        curves = choice.curves()
        with suppress(NoSolutionError):  # a state space that overflows: then its poles are not known
            span = with_resonances(span, choice.poles)
        return replace(
            answer,
            table=response_table(span, curves),
            draw=lambda plots: _bode(plots, curves, drawn(span, curves), asked.attached),
        )
    loop = (lambda plots: plots.loop_margins(choice.whole)) if asked.attached == "loop" else None
    return replace(answer, table=None if out else choice.mode_table(), draw=loop)
