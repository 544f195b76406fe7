"""Study of many cases as a Python function, `sweep`, and as a class that the commands sweep, merge and show use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

from cablestudy.interface.arguments import checked
from cablestudy.interface.kinds import Changes, File, Processes, Source, Variations
from cablestudy.threads import one_thread

if TYPE_CHECKING:
    import pandas

    from cablestudy.study.table import Table, TableFiles
    from cablestudy.sweeps.run import Run
    from cablestudy.sweeps.stored import Stored


@checked
def sweep(
    study: Source,
    set: Changes = (),
    vary: Variations = (),
    jobs: Processes | None = 1,
    out: File | None = None,
) -> pandas.DataFrame:
    """Compute all cases of a study: a base scene in which keys are varied.

    Parameters
    ----------
    study : str, path-like or mapping
        Name of its file, `-` for standard input; or the contents of the file as a mapping, whose `base` may be one too.
    set : mapping or list of str, optional
        Dotted key -> value that changes the base; or texts "KEY=VALUE".
    vary : mapping or list of str, optional
        Dotted key -> its values: a list or array; a range {"from": ..., "to": ..., "count": ...}; or text as of the
        option `--vary`, such as "100N:2kN:20log" or "10kg,50kg". Or a list of texts "KEY=VALUES".
    jobs : int or None
        Processes; None for as many as the work is worth. A script that asks for several must call this function below
        `if __name__ == "__main__":`, since each process imports it.
    out : str or path-like, optional
        Folder in which the rows are kept, and the files of the study written, as `cablestudy sweep --out` does; by
        default nothing is written.

    Returns
    -------
    pandas.DataFrame
        One row for each case, with the names and numbers of the CSV. `attrs["units"]` has the unit of each column.

    Raises
    ------
    SceneError
        All that is wrong with the study.
    """
    folder, keep = ("results", False) if out is None else (out, True)
    with Study(study, set, vary).run(folder, keep, jobs=jobs, quiet=True) as run:
        with one_thread():
            run.compute()
        run.check_complete()
        table = run.table()
        if keep:
            run.write(table, "cablestudy.sweep")
        frame = table.rows.frame()[[field.name for field in table.fields]]
    frame.attrs["units"] = {field.name: field.unit for field in table.fields}
    return frame


class Study:
    """A study, step by step as the commands take it; `sweep` is the whole of it.

    Attributes
    ----------
    request : scene.study.StudyFile
        What was written, with what is changed.
    words : list of str
        The part of a command that determines the cases.

    Raises
    ------
    SceneError
        All that is wrong with it.
    """

    def __init__(self, path: Any, set: Sequence[str] = (), vary: Sequence[str] = ()) -> None:
        from cablestudy.scene.study import read_study
        from cablestudy.study.prepare import prepare

        self.request = read_study(path, tuple(set), tuple(vary), further_check=prepare)
        name = self.request.name if isinstance(path, Mapping) else str(path)
        self.words = sweep_words(name, set, vary)

    @property
    def notes(self) -> Iterable[str]:
        """Warnings about what was written."""
        return (*self.request.likely_mistakes(), *self.request.notes)

    @property
    def asked(self) -> Iterable[str]:
        """Columns that options ask for and the study does not list."""
        return self.request.asked

    @property
    def varied_with_same_name(self) -> list[str]:
        """Varied keys that end with the name of such a column: `cable.diameter` for `diameter`."""
        return [key for key in self.request.varied if key.rpartition(".")[2] in self.request.asked]

    def cases(self) -> Table:
        """The cases, and nothing computed."""
        from cablestudy.study.prepare import prepare
        from cablestudy.sweeps.rows import cases_table

        prepare(self.request)
        return cases_table(self.request)

    def selection(
        self, columns: Sequence[str] = (), sensitivity: bool = False, **options: str | None
    ) -> Callable[[Table], tuple[Table, list[str]]] | None:
        """Function that selects the rows to show of the table of a study, by the options of a command.

        Columns that the options name and the study does not list are added to the study.

        Parameters
        ----------
        columns : sequence of str
            Columns that are shown.
        sensitivity : bool
            True if Sobol's sensitivity indices are shown instead of the rows.
        **options
            `where`: a condition on the rows, such as "sag < 0.5"; `sort`: COLUMN, or -COLUMN for falling numbers;
            `best`: "min COLUMN" or "max COLUMN", for one row only; `pareto`: several of these, separated by commas.

        Returns
        -------
        callable or None
            Table -> (Table, notes); None where all rows are shown.
        """
        if sensitivity:
            from cablestudy.sweeps.sensitivity import Sensitivity

            return Sensitivity(self.request).table
        if columns:
            from cablestudy.sweeps.variable import ask_columns

            ask_columns(self.request, columns)
        if not any(option is not None for option in options.values()):
            return None
        from cablestudy.sweeps.select import read_selection

        return read_selection(self.request, **options).table

    def tolerances(self, texts: Sequence[str]) -> Any:
        """Tolerances of a comparison with the stored table: of texts "[COLUMN=]TOL", else of the study, else 1e-6."""
        from cablestudy.sweeps.check import read_tolerances

        return read_tolerances(texts, self.request)

    def files(self, folder: str) -> TableFiles:
        """The files of the study in a folder."""
        from cablestudy.study.table import TableFiles

        return TableFiles(folder, self.request.name)

    def run(self, folder: str = "results", keep: bool = False, shard: str | None = None, **options: Any) -> Run:
        """Set up the computation of the study: `Run`, a context manager, whose method `compute` does the work.

        Parameters
        ----------
        folder : str
            Folder of the files of the study.
        keep : bool
            True if rows are kept there as they are done.
        shard : str, optional
            "K/N": only every Nth case from the Kth.
        **options
            Other fields of `sweeps.run.SweepOptions`, such as `jobs` (number of processes), `resume` or `quiet`.
        """
        from cablestudy.sweeps.run import Run, SweepOptions, read_shard

        files = self.files(folder)
        if keep:
            files.check_writable()
        return Run(self.request, files, SweepOptions(keep=keep, shard=read_shard(shard), **options))

    def merged(self, folder: str = "results", quiet: bool = False) -> Run:
        """The shards of the study as one run, a context manager."""
        from cablestudy.sweeps.merge import MergedRun

        files = self.files(folder)
        files.check_writable()
        return MergedRun(self.request, files, self.words, quiet)

    def stored(self, folder: str = "results") -> AbstractContextManager[Stored]:
        """Rows that are stored of the study, nothing computed: a context manager.

        Raises
        ------
        SceneError
            Nothing is stored, or it belongs to another study.
        """
        from cablestudy.sweeps.stored import stored_table

        folders = () if folder == "results" else ("--out", folder)
        return stored_table(self.request, self.files(folder), command_text(self.words, *folders))

    def save_figure(self, path: str, table: Table, indices: bool = False, columns: Sequence[str] = ()) -> list[str]:
        """Write the picture of the table of the study to a file.

        Parameters
        ----------
        path : str
            A .png, .svg or .pdf file.
        table : Table
            Rows of the study, or sensitivity indices.
        indices : bool
            True if the table has sensitivity indices.
        columns : sequence of str
            Columns that are drawn; if empty, those that the key `plot` of the study states, else the first ones.

        Returns
        -------
        list of str
            Notes on columns that the picture leaves out.
        """
        from cablestudy.study import plots

        if indices:
            plots.save(plots.sensitivity_plot(self.request, table), path)
            return []
        plots.save(plots.study_plot(self.request, table, columns), path)
        if columns and self.request.plot and self.request.plot.color:
            return ["--plot draws the map of colours that plot: states, whatever --columns chooses"]
        left_out = [] if columns else plots.not_drawn(self.request)
        names = ", ".join(left_out)
        return [f"not drawn: {names} (--columns A,B,... or plot: {{x: ..., y: [...]}} chooses)"] if names else []


def sweep_words(name: str, set: Sequence[str], vary: Sequence[str]) -> list[str]:
    """The part of a command that determines the cases of a study."""
    options = [(option, text) for option, texts in (("--set", set), ("--vary", vary)) for text in texts]
    return ["sweep", name, *(word for pair in options for word in pair)]


def differing_columns(table: Table, path: str) -> Iterable[str]:
    """Yield lines on the columns that only one of a table and a stored one has, before its rows are computed."""
    from cablestudy.sweeps.check import compare_columns

    return compare_columns(table, path)


def differences(table: Table, path: str, tolerance: Any) -> Iterable[str]:
    """Yield the cells of a table that differ from a stored one by more than `Study.tolerances` allows, as lines."""
    from cablestudy.sweeps.check import compare

    return compare(table, path, tolerance)


def command_text(words: Sequence[str], *more: str) -> str:
    """A command as it is typed."""
    from cablestudy.sweeps.run import command

    return command(words, *more)
