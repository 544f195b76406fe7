"""A scene of one cable, as the commands static, modes, windrms, ssm, find and trade take it."""

from __future__ import annotations

import json
import shlex
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.interface.answer import Answer
from cablestudy.scene.bare_numbers import large_lengths
from cablestudy.scene.scene import each_case

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from cablestudy.control.statespace import StateSpace
    from cablestudy.interface.answer import Values

Changes = Mapping[str, object] | Sequence[str]
DEFAULT_MODES = 12


def texts_of(changes: Changes | None) -> tuple[str, ...]:
    """Changes of a file as texts KEY=VALUE: of a dict of key -> value, or these texts themselves; a tuple of str."""
    if isinstance(changes, Mapping):
        return tuple(f"{key}={json.dumps(value, ensure_ascii=False)}" for key, value in changes.items())
    return tuple(changes or ())


def case_text(name: str | None) -> tuple[str, ...]:
    """The change of a scene that chooses a load case; none without a name."""
    return texts_of({} if name is None else {"case": name})


class Scene:
    """A scene of one cable.

    Attributes
    ----------
    path : str
        Of its file.
    changes : tuple of str
        What was changed in it, as KEY=VALUE.
    document : Document
        What was written, with places.
    model : scene.Scene
        The same in SI.
    """

    is_suspension: ClassVar[bool] = False
    attachable: ClassVar[tuple[str, ...]] = ("gondola", "loop")

    def __init__(self, path: str, changes: tuple[str, ...], document: Any, model: Any) -> None:
        self.path, self.changes, self.document, self.model = path, changes, document, model

    @property
    def cases(self) -> dict[str, Scene]:
        """The scene in each of its load cases: dict of name -> Scene."""
        of_each = each_case(self.document, self.model)
        return {name: type(self)(self.path, self.changes, *of_case) for name, *of_case in of_each}

    def compute(self, what: str, **options: Any) -> Answer:
        """What a command computes, with notes, warnings and its picture: `Answer`.

        Parameters
        ----------
        what : {"static", "shape", "modes", "windrms", "loop", "ssm", "trade", "find"}
            The command, or "shape" of static.
        **options
            Those of the method of this class that begins with its name and ends with `_answer`.
        """
        commands = [name[1:-7] for name in dir(self) if name.startswith("_") and name.endswith("_answer")]
        if what not in commands:
            raise SceneError(f"compute: unknown {what!r} (allowed: {', '.join(commands)})")
        return with_large_lengths(self._compute(what, **options), self.document)

    def _compute(self, what, **options):
        """As `compute`, without what is to be said about the file."""
        try:
            answer = getattr(self, f"_{what}_answer")(**options)
        except NoSolutionError as error:
            if hint := self._hint(str(error)):
                raise NoSolutionError(f"{error}{hint}") from None
            raise
        return replace(answer, failures=tuple(f"{failure}{self._hint(failure)}" for failure in answer.failures))

    def _compute_case(self, what, **options):
        """As `_compute`, of one of several cases."""
        return self._compute(what, **options)

    @staticmethod
    def _draw_cases(what, solved):
        """The picture of cases, those without an answer left out: what `Answer.draw` holds."""
        return (lambda plots: plots.case_forms(solved)) if what == "static" and solved else None

    def _hint(self, failure):
        from cablestudy.study.notes import share_hint

        return share_hint(self.document, self.model, failure)

    def compute_cases(self, what: str, **options: Any) -> Answer:
        """As `compute`, of every load case: one table, or one of each kind, whose rows begin with the name of the case.

        Raises
        ------
        SceneError
            The scene has no load cases.
        """
        from cablestudy.study.case_tables import joined, joined_by_name

        cases = self.cases
        if not cases:
            raise SceneError(f"--case all: {self.path} has no cases")
        answers = {name: scene._compute_case(what, **options) for name, scene in cases.items()}

        def lines(of: Callable[[Answer], tuple[str, ...]]) -> tuple[str, ...]:
            return tuple(f"case {name}: {line}" for name, answer in answers.items() for line in of(answer))

        solved = {name: answer.case for name, answer in answers.items() if not answer.failures}
        tables = {name: answer.table for name, answer in answers.items() if answer.table is not None}
        several = {name: answer.tables for name, answer in answers.items() if answer.tables is not None}
        answer = Answer(
            table=joined(tables) if tables else None,
            tables=joined_by_name(several) if several else None,
            explain=lambda: lines(lambda answer: answer.explain()),
            warnings=lines(lambda answer: answer.warnings),
            failures=lines(lambda answer: answer.failures),
            draw=self._draw_cases(what, solved),
        )
        return with_large_lengths(answer, self.document)

    # ------------------------------------------------------------------------------------------------------- static

    def static(self) -> Values:
        """Tension, sag, end stiffness and more: `Values`."""
        return self.compute("static", estimate=True).values()

    def shape(self) -> pandas.DataFrame:
        """The static shape, point by point: pandas.DataFrame."""
        return self.compute("shape").frame()

    def _static_answer(self, estimate=False):
        """`estimate`: whether the errors of deflections by fixed elements are to be estimated."""
        from cablestudy.study.report import static_table

        return self._of_row(*static_table(self.model, estimate), lambda case, plots: plots.static_form(case))

    def _of_row(self, table, row, draw, remarks=()):
        """The `Answer` of a table of one row."""
        from cablestudy.study.notes import reference_without_loads

        return Answer(
            table=table,
            explain=lambda: row.notes,
            warnings=(*reference_without_loads(self.model), *row.warnings, *remarks),
            failures=(row.cells["status"],) if row.failed else (),
            draw=None if draw is None or row.failed else lambda plots: draw(row.case, plots),
            case=row.case,
        )

    def _shape_answer(self, estimate=False):
        from cablestudy.study.report import shape_table

        answer = self._static_answer(estimate)
        return replace(answer, table=None if answer.failures else shape_table(answer.case))

    # -------------------------------------------------------------------------------------------------------- modes

    def modes(self, count: int | None = None, upto: float | str | None = None) -> pandas.DataFrame:
        """The modes with fixed ends: pandas.DataFrame.

        Parameters
        ----------
        count : int, optional
            How many, from the lowest; 12 where nothing is given.
        upto : float or str, optional
            All up to this frequency instead, in Hz or with a unit.
        """
        return self.compute("modes", count=count, upto=upto).frame()

    def _modes_answer(self, count=None, upto=None, estimate=False):
        from cablestudy.study import case_modes
        from cablestudy.study.case import Case
        from cablestudy.study.notes import reference_without_loads
        from cablestudy.study.report import mode_table

        limit = frequency_limit(count, upto)
        asked = count or DEFAULT_MODES
        case, found, notes, warnings = case_modes.modes(Case(self.model), asked, limit, estimate=estimate)
        return Answer(
            table=mode_table(case, found),
            explain=lambda: tuple(notes),
            warnings=(*reference_without_loads(self.model), *warnings, *fewer_modes(found, asked, limit)),
            draw=lambda plots: plots.mode_shapes(case, found),
            case=case,
        )

    # --------------------------------------------------------------------------------------------------------- wind

    def windrms(self, on: str | None = None) -> Values:
        """The gondola in the wind, or a bare cable: `Values`.

        Parameters
        ----------
        on : {"gondola", "cable", "both"}, optional
            What the wind acts on; by default the gondola where there is one.
        """
        return self.compute("windrms", on=on, estimate=True).values()

    def _windrms_answer(self, on=None, estimate=False):
        from cablestudy.study.wind_report import wind_table

        table, row, remarks = wind_table(self.document, self.model, on, estimate)
        draw = (lambda case, plots: plots.wind_response(case, on or "gondola")) if self.model.gondola else None
        return self._of_row(table, row, draw, remarks)

    # --------------------------------------------------------------------------------------------------------- loop

    def loop(self) -> Values:
        """Margins, sensitivity and bandwidth of the winch loop: `Values`."""
        return self.compute("loop", estimate=True).values()

    def loop_response(self, response: str) -> pandas.DataFrame:
        """The loop over frequency: pandas.DataFrame.

        Parameters
        ----------
        response : str
            Range and number of frequencies, for example "0.01Hz:100Hz:200".
        """
        return self.compute("loop", response=response).frame()

    def loop_in_time(
        self,
        time: str,
        input: str | None = None,
        size: str | None = None,
        length: str | None = None,
        output: str | None = None,
    ) -> pandas.DataFrame:
        """What the loop does in time: pandas.DataFrame.

        Parameters
        ----------
        time : str
            How long, and how many rows: "60 s", "60 s:2001".
        input : str, optional
            A step of the winch (the default) or of the reference, a 1-cosine gust, a step of the wind speed: "winch",
            "reference", "gust" or "wind"; of a suspension "winch.CABLE" and "reference.x".
        size : str, optional
            Of the input; by default 1 mm, or 3 standard deviations of the turbulence.
        length : str, optional
            Time of a gust; by default length scale over wind speed.
        output : str, optional
            Of a suspension, what of its pose, for example "gondola.x".
        """
        timed = {"input": input, "size": size, "length": length, "output": output}
        return self.compute("loop", time=time, **timed).frame()

    def _loop_answer(self, response=None, time=None, estimate=False, **timed):
        from cablestudy.study import loop_report
        from cablestudy.study.loop_in_time import time_case

        span, asked = loop_options(response, time, timed)
        answer = self._of_row(*loop_report.loop_table(self.document, self.model, estimate), None)
        if asked and not answer.failures:
            return in_time(answer, time_case(self.document, answer.case, asked))
        if asked or not loop_report.has_loop(answer.case):
            return replace(answer, table=None) if asked or span else answer
        # an unstable loop too has a response over frequency
        table = loop_report.response_table(answer.case.loop, span) if span else answer.table
        return replace(answer, table=table, draw=lambda plots: plots.loop_margins(answer.case, span))

    # -------------------------------------------------------------------------------------------------- state space

    def state_space(
        self,
        with_: str | None = None,
        modes: int | None = None,
        upto: str | None = None,
        error: float | None = None,
        wind: bool = False,
        proper: bool = False,
        input: str | None = None,
        output: str | None = None,
    ) -> StateSpace:
        """The cable as a linear system of first order: `control.statespace.StateSpace`.

        Parameters
        ----------
        with_ : {"gondola", "loop"}, optional
            What is on end 2; of a suspension "loop" or "actuators".
        modes : int, optional
            How many to keep, from the lowest.
        upto : str, optional
            Keep all up to a frequency instead, for example "20 Hz".
        error : float, optional
            Keep the fewest that leave out this share of the inertia. [-]
        wind : bool
            Whether forces on the nodes of the cable are inputs too.
        proper : bool
            Whether accelerations are inputs where they act on outputs at once, with positions and velocities as
            states, so that D1 and D2 are zero.
        input, output : str, optional
            The only input, the only output.
        """
        from cablestudy.study import ssm

        if with_ not in (None, *self.attachable):
            raise SceneError(f"with_: unknown {with_!r} (allowed: {', '.join(self.attachable)})")
        names = {"input": input, "output": output, "proper": proper}
        options = ssm.Options(count=modes, upto=upto, error=error, attached=with_, wind=wind, **names)
        choice = self._choose(options)
        for line in choice.warnings:
            warnings.warn(line.removeprefix("warning: "), stacklevel=2)
        return ssm.exported(choice.system(), options)

    def _choose(self, options, highest=None):
        """The modes to keep: `Choice`."""
        from cablestudy.study import ssm

        return ssm.choose(self.document, self.model, options)

    def _tables_of_choice(self):
        """The module with the tables and curves of such a choice."""
        from cablestudy.study import ssm_tables

        return ssm_tables

    def _ssm_answer(self, out=None, response=None, **options):
        """`out`: the file for the state space; `response`: range and number of frequencies; others as `ssm.Options`."""
        from cablestudy.study import ssm
        from cablestudy.study.notes import reference_without_loads
        from cablestudy.study.ssm_tables import drawn, response_table

        ssm.check_file(out)
        asked, span = ssm.Options(**options), ssm.read_span(response) if response else None
        choice, tables = self._choose(asked, span and span[1]), self._tables_of_choice()
        lines = [*reference_without_loads(self.model), *choice.warnings]
        if out:
            system = ssm.exported(choice.system(), asked)
            ssm.write(system, out)
            lines += [ssm.size_line(choice, system), *ssm.improper_note(system), f"written: {out}"]
        elif not span:
            lines.append(ssm.size_line(choice, choice.system()))
        answer = Answer(explain=lambda: tuple(choice.notes), warnings=tuple(lines), case=choice)
        if span:
            curves = tables.curves(choice)
            return replace(
                answer,
                table=response_table(span, curves),
                draw=lambda plots: plots.bode(curves, *drawn(span, curves)),
            )
        loop = (lambda plots: plots.suspension_loop(choice.whole)) if self.is_suspension else None
        return replace(answer, table=None if out else tables.mode_table(choice), draw=loop)

    # ------------------------------------------------------------------------------------------------ find and trade

    def find(self, goal: str, by: str, between: str | None = None, columns: str | None = None) -> pandas.DataFrame:
        """The values of a key for which a column takes a value: pandas.DataFrame, one row for each.

        Parameters
        ----------
        goal : str
            For example "sag = 2 m".
        by : str
            The key, for example "cable.preload".
        between : str, optional
            Its range, for example "100 N:10 kN".
        columns : str, optional
            Columns beside it, separated by commas.
        """
        return self.compute("find", goal=goal, by=by, between=between, columns=columns).frame()

    def _find_answer(self, **options):
        return find_answer(self.document, **options)

    def trade(self, columns: str | None = None, repeats: int = 5) -> pandas.DataFrame:
        """Error against time of every model: pandas.DataFrame.

        Parameters
        ----------
        columns : str, optional
            What to compare, separated by commas.
        repeats : int
            Of each timing.
        """
        return self.compute("trade", columns=columns, repeats=repeats).frame()

    def _trade_answer(self, columns=None, repeats=5, out=None, shown=False, progress=None):
        """`out`: a folder for its tables; `progress`: called with the number of runs done and of all."""
        from cablestudy.study import trade
        from cablestudy.study.table import TableFiles

        compared, notes = trade.columns_to_compare(self.document, self.model, columns)
        place = None if out is None else TableFiles(out, trade.file_name(self.path))
        if place:
            place.check_writable()
        total = (repeats + 1) * len(trade.models_of(self.model, compared))
        found = trade.compare(self.model, compared, repeats, progress=lambda done: progress and progress(done, total))
        title = shlex.join([self.path, *(word for change in self.changes for word in ("--set", change))])
        if place:
            trade.write(found, place, title)
            notes = [*notes, f"written: {place.csv}, {place.md}"]
        return Answer(
            table=trade.table_of(found, shown=shown),
            explain=lambda: tuple(trade.notes_of(found)),
            warnings=(*notes, *found.reference.warnings),
            failures=tuple(f"{name}: {reason}" for name, reason in found.reference.failures.items()),
            draw=lambda plots: plots.trade_plot(found, f"Error against time: {title}"),
        )

    # ----------------------------------------------------------------------------------------------------- pictures

    def plot(self, kind: str = "static") -> Figure:
        """A picture: matplotlib.figure.Figure.

        Parameters
        ----------
        kind : {"static", "modes", "windrms", "loop"}
        """
        kinds = ("static", "modes", "windrms", "loop")
        if kind not in kinds:
            raise SceneError(f"plot: unknown kind {kind!r} (allowed: {', '.join(kinds)})")
        return self.compute(kind).figure()


def frequency_limit(count, upto):
    """The frequency up to which modes are asked for [Hz], or None; SceneError where a number of them is given too."""
    from cablestudy.scene.units import read_frequency

    if count is not None and upto is not None:
        raise SceneError("count and upto exclude each other")
    return read_frequency("--upto", str(upto)) if upto is not None else None


def with_large_lengths(answer, document):
    """An `Answer` with the warnings about lengths in a document that lack a unit."""
    return replace(answer, warnings=(*large_lengths(document), *answer.warnings))


def fewer_modes(found, asked, limit):
    """A line where a model has fewer modes than were asked for; at most one."""
    short = limit is None and len(found) < asked
    return (f"the model has {len(found)} modes, not {asked}",) if short else ()


def find_answer(document, goal, by, between=None, columns=None):
    """What the command `find` computes of a document that may lack the key: `Answer`; parameters as of `Scene.find`."""
    from cablestudy.study import find
    from cablestudy.study.goal import read_find, read_goal

    asked = read_goal(*read_find(goal, by, between), document)
    shown = find.shown_columns(asked, document, columns)
    found = find.solve(asked, document)
    table, rows = find.find_table(asked, found, shown)
    several = (f"{len(found.values)} values of {by}",) if len(found.values) > 1 else ()
    warnings = dict.fromkeys((*found.notes, *(warning for row in rows for warning in row.warnings)))
    return Answer(
        table=table,
        warnings=(*warnings, *several),
        failures=tuple(dict.fromkeys(row.cells["status"] for row in rows if row.failed)),
    )


def loop_options(response, time, timed):
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
