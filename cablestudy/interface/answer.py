"""Answer of a command: its tables, warnings and notes on them, and a picture."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any, Literal, overload

from cablestudy.errors import NoSolutionError, SceneError
from cablestudy.threads import one_thread

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from cablestudy.study.table import Table

LONGEST_TABLE = 120  # rows that a notebook shows all


class Values(dict[str, Any]):
    """Name with unit -> number, as one row of a table: `values["sag_m"]`; a table in a notebook.

    `values["status"]` is text. A scene without an answer has None for what there is no number of.

    Attributes
    ----------
    units : dict
        Name -> unit.
    errors : dict
        Name -> estimated relative error, where it is known.
    warnings : tuple of str
    """

    units: dict[str, str]
    errors: dict[str, float]
    warnings: tuple[str, ...]

    def __init__(self, table: Table, warnings: tuple[str, ...] = ()) -> None:
        (row,) = table.rows
        super().__init__((field.name, row.get(field.name)) for field in table.fields)
        self.units = {field.name: field.unit for field in table.fields}
        self.errors = next(iter(table.errors()), {}) if table.errors else {}
        self.warnings = tuple(warnings)

    if TYPE_CHECKING:

        @overload
        def __getitem__(self, name: Literal["status"]) -> str: ...  # type: ignore[overload-overlap]
        @overload
        def __getitem__(self, name: str) -> float: ...
        def __getitem__(self, name: str) -> Any: ...

    def __missing__(self, name: object) -> object:
        from cablestudy.interface.plain import shown
        from cablestudy.scene.fields import suggestion

        raise KeyError(f"no {shown(name)} ({suggestion(name, list(self))})")

    def _repr_html_(self) -> str:
        import pandas

        columns = {"value": (self, ".6g"), "unit": (self.units, ""), "estimated relative error": (self.errors, ".1g")}
        cells = {head: [_cell(values.get(name), form) for name in self] for head, (values, form) in columns.items()}
        return _html(pandas.DataFrame(cells, index=list(self), dtype=object))


def _cell(value: object, number_format: str) -> str:
    """Text of a cell of a table in a notebook; None as empty text."""
    return "" if value is None else f"{value:{number_format}}" if isinstance(value, float) else str(value)


def _html(frame: pandas.DataFrame) -> str:
    """A data frame as a notebook shows it."""
    return str(frame.to_html(notebook=True, max_rows=LONGEST_TABLE))


class Tables(dict[str, "pandas.DataFrame"]):
    """The tables of a suspension, name -> pandas.DataFrame; in a notebook one below the other, empty ones left out."""

    def _repr_html_(self) -> str:
        shown = {name: frame for name, frame in self.items() if len(frame) or not name}
        return "".join((f"<h4>{escape(name)}</h4>" if name else "") + _html(frame) for name, frame in shown.items())


@dataclass(frozen=True)
class Answer:
    """Answer of a command."""

    tables: dict[str, Table] = field(default_factory=dict)  # of the only one "" -> Table; empty without any answer
    explain: Callable[[], tuple[str, ...]] = tuple  # makes the lines on what was modelled and what was left out
    warnings: tuple[str, ...] = ()
    failures: tuple[str, ...] = ()  # why there is no answer
    draw: Callable[..., Figure] | None = None  # makes the picture by the module `plots`
    # writes the files of the command, once all its options are known to be right, and returns their names
    write: Callable[[], tuple[str, ...]] = tuple
    case: object = None  # what was solved

    @property
    def table(self) -> Table | None:
        """The only table; None of several, and where there is no answer."""
        return self.tables.get("")

    def values(self) -> Values:
        """The only row of the table: `Values`."""
        return Values(self.table, self.warnings)

    def frame(self) -> pandas.DataFrame:
        """The table as a pandas.DataFrame, see `frame_of`; NoSolutionError where there is no answer at all."""
        if not self.tables:
            raise NoSolutionError("; ".join(self.failures))
        return frame_of(self.table)

    def frames(self) -> Tables:
        """The tables of a suspension: `Tables`."""
        return Tables((name, frame_of(table)) for name, table in self.tables.items())

    def _repr_html_(self) -> str:
        lines = "".join(f"<p>{escape(line)}</p>" for line in (*self.warnings, *self.failures))
        return lines + self.frames()._repr_html_()

    @one_thread()
    def figure(self) -> Figure:
        """The picture; SceneError where there is none, NoSolutionError where nothing was solved that it could show."""
        import cablestudy.plots as plots

        if self.draw is not None:
            return self.draw(plots)
        if self.failures:
            raise NoSolutionError("; ".join(self.failures))
        raise SceneError("there is no picture of this")

    def save_figure(self, path: str) -> None:
        """Write the picture as .png, .svg or .pdf, whole or not at all."""
        import cablestudy.plots as plots

        plots.save(self.figure(), path)

    def save_animation(self, path: str) -> None:
        """Write the picture of modes in motion as .gif or .html, whole or not at all."""
        import cablestudy.plots as plots

        if self.draw is None:
            self.figure()  # raises why there is none
        plots.save_animation(lambda share: self.draw(plots, share=share), path)

    def render(self, style: str) -> str:
        """All tables as one text: "md" with headings, without empty tables; or "json", one object of all by names."""
        if style == "md":
            sections = (f"## {name}\n\n{table.render(style)}" for name, table in self.tables.items() if table.rows)
            return "\n".join(sections)
        objects = {name: json.loads(table.render(style)) for name, table in self.tables.items()}
        return json.dumps(objects, indent=1) + "\n"


def only(table: Table | None) -> dict[str, Table]:
    """Tables of an `Answer` with one table, or none."""
    return {} if table is None else {"": table}


def frame_of(table: Table) -> pandas.DataFrame:
    """A `Table` as a pandas.DataFrame; `attrs["units"]` has the unit of each column."""
    import pandas

    names = [field.name for field in table.fields]
    frame = pandas.DataFrame([[row.get(name) for name in names] for row in table.rows], columns=names)
    frame.attrs["units"] = {field.name: field.unit for field in table.fields}
    return frame
