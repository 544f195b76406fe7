"""A study of many cases as the commands sweep, merge and show take it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

from cablestudy.scene.study import read_study
from cablestudy.study.prepare import prepare
from cablestudy.study.table import Table, TableFiles
from cablestudy.sweeps.check import compare as differences
from cablestudy.sweeps.check import compare_columns as differing_columns
from cablestudy.sweeps.check import read_tolerances
from cablestudy.sweeps.merge import MergedRun
from cablestudy.sweeps.rows import cases_table
from cablestudy.sweeps.run import Run, SweepOptions, read_shard
from cablestudy.sweeps.run import command as command_text
from cablestudy.sweeps.sensitivity import Sensitivity
from cablestudy.sweeps.stored import Stored, stored_table

__all__ = ["Study", "command_text", "differences", "differing_columns", "sweep_words"]


class Study:
    """A study, step by step; `cablestudy.sweep` is the whole of it. SceneError: all that is wrong with it.

    Attributes
    ----------
    request : scene.study.StudyFile
        What was written, with what is changed.
    words : list of str
        The part of a command that determines the cases.
    """

    def __init__(self, path: Any, set: Sequence[str] = (), vary: Sequence[str] = ()) -> None:
        self.request = read_study(path, tuple(set), tuple(vary), further_check=prepare)
        name = self.request.name if isinstance(path, Mapping) else str(path)
        self.words = sweep_words(name, set, vary)

    @property
    def notes(self) -> Iterable[str]:
        """Warnings about what was written."""
        return (*self.request.likely_mistakes(), *self.request.notes)

    @property
    def varied_with_same_name(self) -> list[str]:
        """Varied keys that end with the name of a column that is asked for: `cable.diameter` for `diameter`."""
        return [key for key in self.request.varied if key.rpartition(".")[2] in self.request.asked]

    def cases(self) -> Table:
        """The cases, and nothing computed."""
        prepare(self.request)
        return cases_table(self.request)

    def selection(
        self, columns: Sequence[str] = (), sensitivity: bool = False, **options: str | None
    ) -> Callable[[Table], tuple[Table, list[str]]]:
        """Function of the table of the study that makes the one to be shown, with notes; without options the whole.

        Columns that are named and the study does not list are added to the study; `columns` are those that are shown.
        With `sensitivity` Sobol's sensitivity indices are shown instead of the rows. The options are `where`: a
        condition on the rows, such as "sag < 0.5"; `sort`: COLUMN, or -COLUMN for falling numbers; `best`: "min COLUMN"
        or "max COLUMN", for one row only; `pareto`: several of these, separated by commas.
        """
        if sensitivity:
            return Sensitivity(self.request).table
        if columns:
            from cablestudy.sweeps.variable import ask_columns  # imports pandas

            ask_columns(self.request, columns)
        if not any(option is not None for option in options.values()):
            return lambda table: (table, [])
        from cablestudy.sweeps.select import read_selection  # imports pandas

        return read_selection(self.request, **options).table

    def tolerances(self, texts: Sequence[str]) -> dict[str, float]:
        """Tolerances of a comparison with the stored table: of texts "[COLUMN=]TOL", else of the study, else 1e-6."""
        return read_tolerances(texts, self.request)

    def files(self, folder: str) -> TableFiles:
        """The files of the study in a folder."""
        return TableFiles(folder, self.request.name)

    def run(self, folder: str = "results", keep: bool = False, shard: str | None = None, **options: Any) -> Run:
        """Set up the computation of the study: `Run`, a context manager, whose method `compute` does the work.

        Rows are kept in the folder of the files of the study as they are done if `keep`; the shard "K/N" is only every
        Nth case from the Kth. The options are other fields of `sweeps.run.SweepOptions`, such as `jobs` (number of
        processes), `resume` or `quiet`.
        """
        files = self.files(folder)
        if keep:
            files.check_writable()
        return Run(self.request, files, SweepOptions(keep=keep, shard=read_shard(shard), **options))

    def merged(self, folder: str = "results", quiet: bool = False) -> Run:
        """The shards of the study as one run, a context manager."""
        files = self.files(folder)
        files.check_writable()
        return MergedRun(self.request, files, self.words, quiet)

    def stored(self, folder: str = "results") -> AbstractContextManager[Stored]:
        """Rows that are stored of the study, nothing computed: a context manager.

        SceneError where nothing is stored, or where it belongs to another study.
        """
        folders = () if folder == "results" else ("--out", folder)
        return stored_table(self.request, self.files(folder), command_text(self.words, *folders))

    def save_figure(self, path: str, table: Table, indices: bool = False, columns: Sequence[str] = ()) -> list[str]:
        """Write a picture of the table of the study, or of sensitivity `indices`, to a .png, .svg or .pdf file.

        Drawn are the `columns`; if empty, those that the key `plot` of the study states, else the first ones. Returns
        notes on columns that the picture leaves out, a list of str.
        """
        import cablestudy.plots as plots

        if indices:
            plots.save(plots.sensitivity_plot(self.request, table), path)
            return []
        plots.save(plots.study_plot(self.request, table, columns), path)
        if columns and self.request.plot and self.request.plot.color:
            return ["--plot draws the map of colours that plot: states, whatever --columns chooses"]
        names = ", ".join([] if columns else plots.not_drawn(self.request))
        return [f"not drawn: {names} (--columns A,B,... or plot: {{x: ..., y: [...]}} chooses)"] if names else []


def sweep_words(name: str, set: Sequence[str], vary: Sequence[str]) -> list[str]:
    """The part of a command that determines the cases of a study."""
    options = [(option, text) for option, texts in (("--set", set), ("--vary", vary)) for text in texts]
    return ["sweep", name, *(word for pair in options for word in pair)]
