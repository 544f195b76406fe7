"""A scene of one cable: a method for each command, and `compute`, which the commands call."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Set
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

from cablestudy.activity import ActivityDisplay
from cablestudy.errors import ConvergenceError, NoSolutionError, SceneError, one_line, shorten
from cablestudy.interface.answer import Answer
from cablestudy.interface.arguments import call, checked
from cablestudy.interface.kinds import (
    Between,
    Columns,
    Duration,
    Frequencies,
    Frequency,
    Goal,
    Modes,
    Number,
    Picture,
    Runs,
    Size,
    Text,
    Texts,
    WindOn,
)
from cablestudy.interface.one_cable import ANSWERS, ONE_CABLE, solve_loop
from cablestudy.interface.plain import shown
from cablestudy.scene.document import Document
from cablestudy.scene.fields import KeyTable
from cablestudy.scene.likely_mistakes import likely_mistakes
from cablestudy.scene.scene import each_case
from cablestudy.threads import one_thread

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from cablestudy.control.statespace import StateSpace
    from cablestudy.interface.answer import Values


TABLES = ("cable", "gondola", "winch", "wind", "cases")
NAMED = 120  # characters of path and changes in a representation
OF_COMMANDS = {
    "absent", "answers", "attachable", "check_state_space", "compute", "compute_cases", "document", "heading",
    "kept_modes", "loads_key", "loop_key", "solve_loop", "table_names",
}  # fmt: skip


class Scene:
    """A scene of one cable, as `load` returns it.

    Attributes
    ----------
    path : str
        Of its file.
    changes : tuple of str
        What was changed in it, as KEY=VALUE.
    model : scene.CableScene
        What was written, in SI.
    """

    loop_key: ClassVar[str] = "winch.controller"
    loads_key: ClassVar[str] = "cable.loads"
    attachable: ClassVar[tuple[str, ...]] = ("gondola", "loop")
    # option, command or attachment that such a scene does not have -> why
    absent: ClassVar[Mapping[str, str]] = {
        "table": f"--table: {ONE_CABLE}",
        "cable": f"--cable: {ONE_CABLE}",
        "form": f"--form-finding: {ONE_CABLE}",
        "actuators": f"--with actuators: {ONE_CABLE}",
    }
    hidden: ClassVar[Set[str]] = OF_COMMANDS | {"hidden"}  # public names that no user needs
    # name of a command -> function of a `Scene` and options that computes its `Answer`
    answers: ClassVar[Mapping[str, Callable[..., Answer]]] = ANSWERS
    solve_loop = staticmethod(solve_loop)

    @checked
    def __init__(self, path: Text, changes: Texts, document: Document, model: KeyTable) -> None:
        self.path, self.changes, self.document, self.model = path, changes, document, model

    def __dir__(self) -> list[str]:
        """Names that a user calls and reads: list of str."""
        names = {*vars(self), *(name for kind in type(self).__mro__[:-1] for name in vars(kind))}
        return sorted(name for name in names - self.hidden if not name.startswith("_"))

    def __repr__(self) -> str:
        listed = ", ".join((self.path, *self.changes))
        return f"{type(self).__name__}({shorten(listed, NAMED)}: {self._contents})"

    @property
    def heading(self) -> str:
        """Heading that says what the scene is of."""
        return "One cable" + (" with a gondola" if self.model.gondola is not None else "")

    @property
    def _contents(self) -> str:
        """The tables of the scene, for its representation."""
        return ", ".join(name for name in TABLES if getattr(self.model, name))

    def kept_modes(self, options, highest=None):
        """The modes of a state space, their table and curves: a `study.ssm.Choice`.

        Parameters
        ----------
        options : study.ssm.StateSpaceOptions
        highest : float, optional
            Frequency up to which a response is shown. [Hz]
        """
        from cablestudy.study.one_cable.ssm import choose

        return choose(self.document, self.model, options)

    @staticmethod
    def check_state_space(options, responds, out):
        """Refuse options of a state space that have no effect: SceneError.

        Parameters
        ----------
        options : study.ssm.StateSpaceOptions
        responds : bool
            Whether its response is shown.
        out : str or None
            The file that it is written to.
        """
        from cablestudy.study.ssm import check_channel

        if not out and options.error is None and (options.attached or not responds):
            check_channel(options, responds)

    def table_names(self, what: str) -> list[str]:
        """Names of the tables that the answer of a command has, without options, where it has several: list of str."""
        return []

    @property
    def cases(self) -> dict[str, Self]:
        """The scene in each of its load cases: dict of name -> Scene."""
        cases = each_case(self.document, self.model)
        return {name: type(self)(self.path, self.changes, document, model) for name, document, model in cases}

    def compute(self, what: str, **options: Any) -> Answer:
        """Answer of a command, with notes, warnings and its picture: `Answer`.

        Parameters
        ----------
        what : {"static", "shape", "loads", "locus", "limits", "modes", "windrms", "loop", "ssm", "trade", "find"}
            The command, or "shape", "loads", "locus" or "limits" of static; of a suspension "form" too, for its form.
        **options
            Those of the function in `answers`.
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
            reason = self.absent.get(what) if isinstance(what, str) else None
            raise SceneError(reason or f"compute: what: unknown {shown(what)} (allowed: {', '.join(self.answers)})")
        if refused := [name for name, value in options.items() if value is not None and name in self.absent]:
            raise SceneError(self.absent[refused[0]])
        options = {name: value for name, value in options.items() if name not in self.absent}
        try:
            answer = call(self.answers[what], self, **options)
        except NoSolutionError as error:
            if hint := self._hint(str(error)):
                raise NoSolutionError(f"{error}{hint}") from None
            raise
        failures = tuple(f"{failure}{self._hint(failure)}" for failure in answer.failures)
        return replace(answer, failures=failures, warnings=(*answer.warnings, *self._above_accuracy(what, answer)))

    def _above_accuracy(self, what, answer):
        """A note on errors of an `Answer` about motion that are above the accuracy, at most one; tuple of str."""
        if answer.failures or what not in ("windrms", "loop"):
            return ()
        from cablestudy.study.notes import above_accuracy

        accuracy = self.model.model.accuracy
        return above_accuracy(
            ({f"{key} of {name}" if name else key: error for key, error in row.items()}, accuracy)
            for name, table in answer.tables.items()
            if table.errors
            for row in table.errors()
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
        """Answer of a command for all load cases of the scene together.

        Parameters
        ----------
        what, **options
            As for `compute`.

        Returns
        -------
        Answer
            Its tables have the rows of all cases, each with the name of its case in front. A case without an answer
            has a row with empty cells, whose status says why.

        Raises
        ------
        SceneError
            The scene has no load cases.
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

    @checked
    def static(self) -> Values:
        """Tension, sag, end stiffness and more: `Values`."""
        return self.compute("static", estimate=True).values()

    @checked
    def shape(self) -> pandas.DataFrame:
        """The static shape, point by point: pandas.DataFrame."""
        return self.compute("shape").frame()

    @checked
    def limits(self) -> pandas.DataFrame:
        """Each limit of the scene where its margin is least, in all of its load cases: pandas.DataFrame."""
        return self.compute("limits").frame()

    @checked
    def loads(self) -> pandas.DataFrame:
        """Place, sag, clearance, slopes and tensions at each point load: pandas.DataFrame."""
        return self.compute("loads").frame()

    @checked
    def locus(self, load: Text) -> pandas.DataFrame:
        """The path of a point load that travels from end to end, unstretched lengths fixed: pandas.DataFrame.

        Parameters
        ----------
        load : str
            Its name, "load1", of a suspension "CABLE.load1", and after a colon how many places: "load1:99".
        """
        return self.compute("locus", load=load).frame()

    @checked
    def modes(
        self, count: Modes | None = None, upto: Frequency | None = None, coupled: bool = False
    ) -> pandas.DataFrame:
        """The modes with fixed ends: pandas.DataFrame.

        Parameters
        ----------
        count : int, optional
            How many, from the lowest; 12 where nothing is given.
        upto : float or str, optional
            All up to this frequency instead, in Hz or with a unit.
        coupled : bool
            Those of gondola and cable together instead, as of a suspension.
        """
        return self.compute("modes", count=count, upto=upto, coupled=coupled).frame()

    @checked
    def windrms(self, on: WindOn | None = None) -> Values:
        """The gondola in the wind, or a bare cable: `Values`.

        Parameters
        ----------
        on : {"gondola", "cable", "both"}, optional
            What the wind acts on; by default the gondola where there is one.
        """
        return self.compute("windrms", on=on, estimate=True).values()

    @checked
    def loop(self) -> Values:
        """Margins, sensitivity and bandwidth of the winch loop: `Values`."""
        return self.compute("loop", estimate=True).values()

    @checked
    def loop_response(self, response: Frequencies) -> pandas.DataFrame:
        """The loop over frequency: pandas.DataFrame.

        Parameters
        ----------
        response : str or sequence of 3
            Range and number of frequencies, for example "0.01Hz:100Hz:200" or (0.01, 100, 200).
        """
        return self.compute("loop", response=response).frame()

    @checked
    def loop_in_time(
        self,
        time: Duration,
        input: Text | None = None,
        size: Size | None = None,
        length: Duration | None = None,
        output: Text | None = None,
    ) -> pandas.DataFrame:
        """Response of the winch control loop in time to a step or gust: pandas.DataFrame.

        Parameters
        ----------
        time : float or str
            Duration, and number of rows: 60, "60 s", "60 s:2001".
        input : str, optional
            A step of the winch (the default) or of the reference, a 1-cosine gust, a step of the wind speed: "winch",
            "reference", "gust" or "wind"; of a suspension "winch.CABLE" and "reference.x".
        size : float or str, optional
            Size of the input, in SI or with a unit; by default 1 mm, or 3 standard deviations of the turbulence.
        length : float or str, optional
            Time of a gust, in s or with a unit; by default length scale over wind speed.
        output : str, optional
            Of a suspension, the coordinate of a body that is shown, for example "gondola.x".
        """
        timed = {"input": input, "size": size, "length": length, "output": output}
        return self.compute("loop", time=time, **timed).frame()

    @checked
    def state_space(
        self,
        with_: Text | None = None,
        modes: Modes | None = None,
        upto: Frequency | None = None,
        error: Number | None = None,
        wind: bool = False,
        proper: bool = False,
        input: Text | None = None,
        output: Text | None = None,
    ) -> StateSpace:
        """The cable as a linear system of first order: `control.statespace.StateSpace`.

        Parameters
        ----------
        with_ : {"gondola", "loop"}, optional
            What is on end 2; of a suspension "loop" or "actuators".
        modes : int, optional
            How many to keep, from the lowest.
        upto : float or str, optional
            Keep all up to a frequency instead, in Hz or with a unit: 20, "20 Hz".
        error : float, optional
            Keep the fewest that leave out this share of the inertia. [-]
        wind : bool
            Whether forces on the nodes of the cable are inputs too.
        proper : bool
            Whether accelerations are inputs where they act on outputs at once, with positions and velocities as
            states, so that D1 and D2 are zero.
        input, output : str, optional
            The only input, the only output; several separated by commas.
        """
        from cablestudy.study.ssm import StateSpaceOptions, exported

        if with_ not in (None, *self.attachable):
            raise SceneError(f"with_: unknown {with_!r} (allowed: {', '.join(self.attachable)})")
        names = {"input": input, "output": output, "proper": proper}
        options = StateSpaceOptions(count=modes, upto=upto, error=error, attached=with_, wind=wind, **names)
        choice = self.kept_modes(options)
        caller = 4  # of the method, past the check of its arguments
        for line in choice.warnings:
            warnings.warn(line.removeprefix("warning: "), stacklevel=caller)
        return exported(choice.system(), options)

    @checked
    def find(
        self, goal: Goal, by: Text, between: Between | None = None, columns: Columns | None = None
    ) -> pandas.DataFrame:
        """The values of a key for which a column takes a value: pandas.DataFrame, one row for each.

        Parameters
        ----------
        goal : str
            For example "sag = 2 m"; "limits": the ends of the range in which all limits of the scene hold.
        by : str
            The key, for example "cable.preload".
        between : str or sequence of 2, optional
            Its range, for example "100 N:10 kN" or (100, 1e4).
        columns : str or list of str, optional
            Columns beside it; in text separated by commas.
        """
        return self.compute("find", goal=goal, by=by, between=between, columns=columns).frame()

    @checked
    def trade(self, columns: Columns | None = None, repeats: Runs = 5) -> pandas.DataFrame:
        """Error against time of every model: pandas.DataFrame.

        Parameters
        ----------
        columns : str or list of str, optional
            What to compare; in text separated by commas.
        repeats : int
            Of each timing.

        Notes
        -----
        Where it takes long standard error says how far it is, unless CABLESTUDY_PROGRESS is `off`.
        """
        with ActivityDisplay("trade"):
            return self.compute("trade", columns=columns, repeats=repeats).frame()

    @checked
    def freeze(self) -> str:
        """The scene as a YAML file with its unstretched lengths in full, those of the reference state: str.

        They take the place of preloads, tensions and sags; `base` and changes are resolved, and comments lost.
        """
        from cablestudy.scene.strict_yaml import write_yaml
        from cablestudy.study.scene_kind import kind_of

        return write_yaml(kind_of(self.model).freeze(self.document, self.model))

    @checked
    def plot(self, kind: Picture = "static") -> Figure:
        """A picture: matplotlib.figure.Figure.

        Parameters
        ----------
        kind : {"static", "modes", "windrms", "loop"}
        """
        return self.compute(kind).figure()


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
