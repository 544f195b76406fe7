"""What a command computes: tables, what is to be said about them, and a picture."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cablestudy.errors import NoSolutionError, SceneError

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from cablestudy.study.table import Table


class Values(dict[str, Any]):
    """Name with unit -> number, as one row of a table: `values["sag_m"]`.

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

    def __missing__(self, name: str) -> object:
        from cablestudy.scene.fields import suggestion

        raise KeyError(f"no {name!r} ({suggestion(name, list(self))})")


@dataclass(frozen=True)
class Answer:
    """What a command computes.

    Attributes
    ----------
    table : Table or None
        None too where there is no answer at all.
    tables : dict or None
        Of a suspension: name -> Table, where there are several.
    explain : callable
        Makes the lines on what was modelled and what was left out: tuple of str.
    warnings : tuple of str
    failures : tuple of str
        Why there is no answer.
    draw : callable or None
        Makes the picture: the module `study.plots` -> matplotlib.figure.Figure.
    case : object
        What was solved.
    """

    table: Table | None = None
    tables: dict[str, Table] | None = None
    explain: Callable[[], tuple[str, ...]] = tuple
    warnings: tuple[str, ...] = ()
    failures: tuple[str, ...] = ()
    draw: Callable[..., Figure] | None = None
    case: object = None

    def values(self) -> Values:
        """The only row of the table: `Values`."""
        return Values(self.table, self.warnings)

    def frame(self) -> pandas.DataFrame:
        """The table as a pandas.DataFrame; `attrs["units"]` has the unit of each column."""
        return frame_of(self.table)

    def frames(self) -> dict[str, pandas.DataFrame]:
        """The tables of a suspension: name -> pandas.DataFrame."""
        return {name: frame_of(table) for name, table in self.tables.items()}

    def figure(self) -> Figure:
        """The picture: matplotlib.figure.Figure.

        Raises
        ------
        SceneError
            There is none.
        NoSolutionError
            Nothing was solved that it could show.
        """
        from cablestudy.study import plots

        if self.draw is not None:
            return self.draw(plots)
        if self.failures:
            raise NoSolutionError("; ".join(self.failures))
        raise SceneError("there is no picture of this")

    def save_figure(self, path: str) -> None:
        """Write the picture as .png, .svg or .pdf, whole or not at all."""
        from cablestudy.study import plots

        plots.save(self.figure(), path)

    def render(self, style: str) -> str:
        """All tables of a suspension as one text.

        Parameters
        ----------
        style : {"md", "json"}
            Markdown with headings, without empty tables; or one object of the tables by their names.
        """
        if style == "md":
            parts = (f"## {name}\n\n{table.render(style)}" for name, table in self.tables.items() if table.rows)
            return "\n".join(parts)
        return (
            json.dumps({name: json.loads(table.render(style)) for name, table in self.tables.items()}, indent=1) + "\n"
        )


def frame_of(table: Table) -> pandas.DataFrame:
    """A `Table` as a pandas.DataFrame; `attrs["units"]` has the unit of each column."""
    import pandas

    names = [field.name for field in table.fields]
    frame = pandas.DataFrame([[row.get(name) for name in names] for row in table.rows], columns=names)
    frame.attrs["units"] = {field.name: field.unit for field in table.fields}
    return frame
