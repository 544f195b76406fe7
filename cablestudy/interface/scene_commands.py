"""A scene as the commands take it: `compute` and what it needs; `scene.Scene` adds the methods that users call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError, one_line
from cablestudy.interface.answer import Answer
from cablestudy.interface.one_cable import ANSWERS, ONE_CABLE, solve_loop
from cablestudy.interface.plain import shown
from cablestudy.scene.document import Document
from cablestudy.scene.fields import KeyTable
from cablestudy.scene.likely_mistakes import likely_mistakes
from cablestudy.threads import one_thread

if TYPE_CHECKING:
    from cablestudy.study.table import Table


class SceneCommands:
    """A scene of one cable, with what the commands compute of it; `Suspension` overrides what differs.

    Its attributes are those of `Scene`; `document` is what was written, with its places in the file.
    """

    path: str
    changes: tuple[str, ...]
    document: Document
    model: KeyTable
    cases: Mapping[str, SceneCommands]
    loop_key: ClassVar[str] = "winch.controller"
    loads_key: ClassVar[str] = "cable.loads"
    attachable: ClassVar[tuple[str, ...]] = ("gondola", "loop")
    # option, command or attachment that such a scene does not have -> why
    absent: ClassVar[Mapping[str, str]] = {
        "table": f"--table: {ONE_CABLE}",
        "form": f"--form-finding: {ONE_CABLE}",
        "actuators": f"--with actuators: {ONE_CABLE}",
    }
    # name of a command -> function of a `Scene` and options that computes its `Answer`
    answers: ClassVar[Mapping[str, Callable[..., Answer]]] = ANSWERS
    solve_loop = staticmethod(solve_loop)

    @property
    def heading(self) -> str:
        """Heading that says what the scene is of."""
        return "One cable" + (" with a gondola" if self.model.gondola is not None else "")

    def table_names(self, what: str) -> list[str]:
        """Names of the tables that the answer of a command has, without options, where it has several: list of str."""
        return []

    def table_without_rows(self, what: str, name: str, in_all_cases: bool = False) -> Table | None:
        """A table of a command, or that of all load cases, before it is computed: Table; None if not known."""
        from cablestudy.study.table import Table, join_tables
        from cablestudy.study.table_rows import OK, with_status

        table = Table(self._known_fields(what, name), [])
        if not table.fields:
            return None
        return join_tables({"": {name: with_status(table, OK)}})[name] if in_all_cases else table

    def _known_fields(self, what, table):
        """Fields of a table of a command that are known before it is computed: tuple of Field, perhaps empty."""
        return ()

    def compute(self, what: str, **options: Any) -> Answer:
        """Answer of a command, with notes, warnings and its picture: `Answer`.

        `what` is a key of `answers`: "static" or another command, or "shape", "loads", "locus" or "limits" of static;
        of a suspension "form" too, for its form. The options are those of the function there.
        """
        try:
            answer = self._compute(what, **options)
        except (NoSolutionError, ConvergenceError) as error:
            known = getattr(error, "__notes__", ())  # of one that is raised again
            for line in likely_mistakes(self.document):  # perhaps they are why there is no answer
                if line not in known:
                    error.add_note(line)
            raise
        return with_likely_mistakes(answer, self.document)

    @one_thread()
    def _compute(self, what, **options):
        """`Answer` of a command, see `compute`, without warnings about likely mistakes in the file."""
        if not isinstance(what, str) or what not in self.answers:
            unknown = f"compute: what: unknown {shown(what)} (allowed: {', '.join(self.answers)})"
            raise SceneError(self.absent.get(what, unknown) if isinstance(what, str) else unknown)
        if refused := [name for name, value in options.items() if value and name in self.absent]:
            raise SceneError(self.absent[refused[0]])
        options = {name: value for name, value in options.items() if name not in self.absent}
        try:
            answer = self.answers[what](self, **options)
        except NoSolutionError as error:
            if hint := self._hint(str(error)):
                raise NoSolutionError(f"{error}{hint}") from None
            raise
        failures = tuple(f"{failure}{self._hint(failure)}" for failure in answer.failures)
        above_accuracy = () if what == "limits" else self._above_accuracy(answer)  # limits are reported as undecided
        warnings = (*answer.warnings, *above_accuracy)
        return replace(answer, failures=failures, warnings=warnings, draw=self._with_case_in_title(answer.draw))

    def _with_case_in_title(self, draw):
        """The function that draws a picture, or None, with the load case of the scene, if any, in the title."""
        case = self.model.case
        if draw is None or case is None:
            return draw
        return lambda plots, **options: plots.name_case(draw(plots, **options), case)

    def _above_accuracy(self, answer):
        """A note on errors of an `Answer` that are above the accuracy, at most one; tuple of str.

        Scenes that state their elements have none: their errors are estimated when they are shown, not for this.
        """
        accuracy = self.model.model.accuracy
        if answer.failures or accuracy is None:
            return ()
        from cablestudy.study.notes import above_accuracy

        def named(name, row):
            return {f"{key} of {name}" if name else key: number for key, number in row.items()}

        return above_accuracy(
            (named(name, errors), named(name, row), accuracy)
            for name, table in answer.tables.items()
            if table.errors
            for row, errors in zip(table.rows, table.errors(), strict=False)
        )

    def _compute_case(self, what, **options):
        """`Answer` of one of several load cases, see `_compute`; a failed one instead of an error: others go on."""
        try:
            return self._compute(what, **options)
        except (NoSolutionError, ConvergenceError) as error:
            return Answer(failures=(one_line(error),))

    def _doubts(self, what, case):
        """Doubts about an answer to a command, for the status of its rows: tuple of str."""
        return ()

    def _tables_of_cases(self, what, answers):
        """Load case -> the tables of its `Answer`, a dict of dicts; of a case without answer a row with its status.

        The rows of the others have a status then too.
        """
        tables = {case: answer.tables for case, answer in answers.items()}
        if all(tables.values()):
            return tables
        from cablestudy.study.table_rows import OK, with_status

        names = list(dict.fromkeys(name for tables_of_case in tables.values() for name in tables_of_case)) or [""]
        for case, answer in answers.items():
            doubts = self._doubts(what, answer.case) if answer.tables else ()
            status = "; ".join((*answer.failures, *doubts)) or OK
            shown = tables[case] or dict.fromkeys(names)
            tables[case] = {name: with_status(table, status) for name, table in shown.items()}
        return tables

    def _hint(self, failure):
        """Text to be added to the reason of a failure; empty for most."""
        from cablestudy.study.notes import share_hint

        return share_hint(self.document, self.model, failure)

    def compute_cases(self, what: str, **options: Any) -> Answer:
        """Answer of a command for all load cases of the scene together; arguments are those of `compute`.

        Its tables have the rows of all cases, each with the name of its case in front. A case without an answer has a
        row with empty cells, whose status says why. SceneError for a scene without load cases.
        """
        from cablestudy.study.table import join_tables

        cases = self.cases
        if not cases:
            raise SceneError(f"--case all: {self.path} has no cases")
        answers = {name: scene._compute_case(what, **options) for name, scene in cases.items()}
        solved = {name: answer.case for name, answer in answers.items() if not answer.failures}
        answer = Answer(
            tables=join_tables(self._tables_of_cases(what, answers)),
            explain=lambda: lines_with_cases({name: answer.explain() for name, answer in answers.items()}),
            warnings=lines_with_cases({name: answer.warnings for name, answer in answers.items()}),
            failures=lines_with_cases({name: answer.failures for name, answer in answers.items()}),
            draw=(lambda plots: plots.case_forms(solved)) if what == "static" and solved else None,
        )
        return with_likely_mistakes(answer, self.document)


def lines_with_cases(lines_of_case: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Each line once, after the names of the load cases that have it: `cases cold, ice: LINE`."""
    cases_of_line: dict[str, list[str]] = {}
    for name, lines in lines_of_case.items():
        for line in lines:
            cases_of_line.setdefault(line, []).append(name)
    return tuple(f"case{'s' * (len(names) > 1)} {', '.join(names)}: {line}" for line, names in cases_of_line.items())


def with_likely_mistakes(answer, document):
    """An `Answer` with the warnings about likely mistakes in a document, for example a length that lacks a unit."""
    return replace(answer, warnings=(*likely_mistakes(document), *answer.warnings))
