"""A scene of several cables, bodies and points: its class, and the functions behind its commands, an `Answer` each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from cablestudy.interface.answer import Answer, Tables, only
from cablestudy.interface.answers import DEFAULT_MODES, SHARED, check_cable, coupled_modes, fewer_modes, frequency_limit
from cablestudy.interface.arguments import checked
from cablestudy.interface.kinds import Frequency, Modes, Text, WindOn
from cablestudy.interface.scene import Scene
from cablestudy.scene.words import counted

if TYPE_CHECKING:
    import pandas


def static(scene, table=None, estimate=False):
    """Statics of the suspension: an `Answer` with several tables, or the `table` of a name; errors are always known."""
    from cablestudy.study.suspension.report import static_tables

    case, failures = scene.case, []
    tables = static_tables(case, table, failures)
    return _answer_of_case(case, failures, tables=_of_name(table, tables), draw=lambda plots: plots.static_form(case))


def shape(scene, estimate=False):
    """The static shapes of all cables, point by point; `estimate` changes nothing."""
    from cablestudy.study.suspension.report import shape_table

    case, failures = scene.case, []
    table = shape_table(case, failures)
    return _answer_of_case(case, failures, tables=only(table), draw=lambda plots: plots.static_form(case))


def form(scene, table=None):
    """The form of a net by force densities."""
    from cablestudy.study.suspension.report import chosen_tables, form_tables

    return Answer(tables=_of_name(table, chosen_tables(form_tables(scene.document, scene.model), table)))


def modes(scene, count=None, upto=None, cable=None, estimate=False):
    """Answer of the command modes: coupled modes of the suspension, or modes of one cable; see `Suspension.modes`.

    `estimate` changes nothing: errors are always known.
    """
    from cablestudy.study.vibration import galloping_notes, tension_notes

    case = scene.case
    if cable is not None:
        return _modes_of_cable(case, cable, count or DEFAULT_MODES, frequency_limit(count, upto))
    case = case.without_modes()  # so that no digit depends on what was asked for before
    answer, group = coupled_modes(case, count, upto), case.group
    return _answer_of_case(
        case,
        warnings=(*galloping_notes(case.scene.load_case), *answer.warnings),
        notes=lambda: (*answer.explain(), *tension_notes(case.scene, group.cables)),
        tables=answer.tables,
        draw=answer.draw,
    )


def _modes_of_cable(case, name, size, limit):
    """The modes of one cable between its ends where they are, both held."""
    from cablestudy.motion.airflow import wind_diameters
    from cablestudy.study.one_cable.case_modes import solved_modes
    from cablestudy.study.one_cable.report import modes_as_rows
    from cablestudy.study.vibration import diameters_of_modes, with_lock_in

    case.refuse_lost(name)
    check_cable(name, case.scene.cables)
    cable, found, _ = solved_modes(case.cable_modes.cases[name], None if limit else size, limit)
    table = modes_as_rows(cable, found, range(len(found)), {})
    diameter = wind_diameters(case.scene)[case.cable(name)]
    return _answer_of_case(
        case,
        warnings=fewer_modes(found, size, limit),
        tables=only(with_lock_in(table, diameters_of_modes(table, diameter))),
        draw=lambda plots, share=None: plots.mode_shapes(cable, found, share),
    )


def windrms(scene, table=None, estimate=False):
    """Motion of the suspension in the wind: an `Answer`; `estimate`: also the errors of fixed elements."""
    from cablestudy.study.suspension.wind_report import remarks_of, wind_tables

    case = scene.estimated if estimate else scene.case
    tables, failures = wind_tables(scene.document, case, table)
    draw = None if failures else lambda plots: plots.wind_response([case.analysis])
    remarks = () if failures else remarks_of(case, tables)
    return _answer_of_case(case, failures, remarks, tables=_of_name(table, tables), draw=draw)


def solve_loop(scene, frequency_range, time_options, table, estimate):
    """`Answer` of the loop and its `DynamicAnalysis`, see `one_cable.solve_loop`."""
    from cablestudy.study.column import require
    from cablestudy.study.loop_in_time import input_and_output
    from cablestudy.study.loop_report import unstable
    from cablestudy.study.suspension.wind_report import loop_tables, remarks_on_coordinates

    require(scene.document, scene.model, ["control"], "loop")
    if time_options:
        input_and_output(scene.document, scene.model, time_options)
    case = scene.estimated if estimate else scene.case
    tables, failures = ({}, ()) if frequency_range or time_options else loop_tables(case, table)
    failures = unstable(case.analysis.loop_for_margins) if frequency_range else failures
    remarks = remarks_on_coordinates(case, tables)
    return _answer_of_case(case, failures, remarks, tables=_of_name(table, tables)), case.analysis


def _of_name(name, tables):
    """All of some tables; or, if a name is given, the one of this name alone."""
    return only(tables[name]) if name else tables


def _answer_of_case(case, failures=(), warnings=(), notes=tuple, **parts):
    """The `Answer` of a `SuspensionCase`, with remarks on it besides `notes`, a function, and `warnings`."""
    from cablestudy.study.suspension.notes import notes_of, warnings_of

    return Answer(
        explain=lambda: (*notes_of(case), *notes()),
        warnings=(*warnings_of(case), *warnings),
        failures=tuple(dict.fromkeys(failures)),
        case=case,
        **parts,
    )


class Suspension(Scene):
    """A scene of several cables, bodies and points; its tables are mappings of name -> pandas.DataFrame."""

    absent: ClassVar[Mapping[str, str]] = {
        "on": "--on: no effect: the scene is a suspension, whose key wind.on says so",
        "gondola": "--with gondola: no effect: the bodies of a suspension are always attached",
        "coupled": "--coupled: no effect: without --cable the modes of a suspension are coupled",
    }
    loop_key: ClassVar[str] = "control"
    loads_key: ClassVar[str] = "cables.CABLE.loads"
    attachable: ClassVar[tuple[str, ...]] = ("loop", "actuators")
    hidden: ClassVar[Set[str]] = Scene.hidden | {"case", "estimated"}
    answers: ClassVar[Mapping[str, Callable[..., Answer]]] = {
        "static": static,
        "form": form,
        "shape": shape,
        "modes": modes,
        "windrms": windrms,
        **SHARED,
    }
    solve_loop = staticmethod(solve_loop)

    @property
    def heading(self) -> str:
        """Heading that says how many cables the suspension has."""
        return f"Suspension of {counted(len(self.model.cables), 'cable')}"

    @property
    def _contents(self) -> str:
        numbers = {name: len(getattr(self.model, name)) for name in ("cables", "bodies", "points", "cases")}
        return ", ".join(f"{name}: {number}" for name, number in numbers.items() if number)

    @cached_property
    def case(self) -> Any:
        """Its equilibrium and motion, each computed when it is first asked for: `SuspensionCase`."""
        from cablestudy.study.suspension.case import SuspensionCase

        return SuspensionCase(self.model)

    @cached_property
    def estimated(self) -> Any:
        """`case` with the errors of fixed elements estimated."""
        from cablestudy.study.suspension.case import SuspensionCase

        return self.case if self.model.model.elements is None else SuspensionCase(self.model, estimate=True)

    def _doubts(self, what, case):
        """Doubts about an answer to a command; see `Scene._doubts`."""
        from cablestudy.study.suspension.rows import doubts_of

        return doubts_of(case, what == "windrms") if case is not None else ()

    def table_names(self, what: str) -> list[str]:
        """Names of the tables that the answer of a command has; see `Scene.table_names`."""
        if what == "windrms":
            from cablestudy.study.suspension.wind_report import names_of_tables

            return names_of_tables(self.model)
        links = ["links"] if self.model.links else []
        tables = {"static": ["bodies", "points", "cables", "stiffness", *links], "loop": ["loop", "coordinates"]}
        return tables.get(what, [])

    def _known_fields(self, what, table):
        """Fields of a table that are known before it is computed; see `Scene._known_fields`."""
        from cablestudy.study.suspension.wind_report import fields_in_wind, fields_of_loop

        if what == "windrms":
            return fields_in_wind(self.document, self.model, table)
        return fields_of_loop(table) if what == "loop" and self.model.control else ()

    @checked
    def static(self) -> Tables:  # type: ignore[override]
        """The tables bodies, points, cables and stiffness: `Tables`, a dict of name -> pandas.DataFrame."""
        return self.compute("static").frames()

    @checked
    def modes(  # type: ignore[override]
        self, count: Modes | None = None, upto: Frequency | None = None, cable: Text | None = None
    ) -> pandas.DataFrame:
        """The coupled modes: pandas.DataFrame.

        Parameters
        ----------
        count, upto
            As of one cable.
        cable : str, optional
            The name of a cable, whose modes between fixed ends are given instead, by type and symmetry.
        """
        return self.compute("modes", count=count, upto=upto, cable=cable).frame()

    @checked
    def windrms(self, on: WindOn | None = None) -> Tables:  # type: ignore[override]
        """Its tables, motion, cables, loop and others: `Tables`, a dict of name -> pandas.DataFrame."""
        return self.compute("windrms", on=on).frames()

    @checked
    def loop(self) -> Tables:  # type: ignore[override]
        """The tables loop and coordinates: `Tables`, a dict of name -> pandas.DataFrame."""
        return self.compute("loop").frames()
