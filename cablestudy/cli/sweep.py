"""The commands sweep and merge."""

import itertools

import click

from cablestudy.cli.error_handling import FAILED_CHECK, NO_ANSWER, echo_notes, interruptible, show
from cablestudy.cli.options import (
    EXPLAIN,
    SELECTION,
    exclude,
    refuse,
    save_plot,
    selection_options,
    study_command,
)

MOST_DIFFERENCES = 1000  # that a check shows one by one
WRITES_NOTHING = ("--check", "--no-write", "--row")
INSTEAD = ("--dry-run", "--check", "--shard", "--sensitivity")  # of the table, all of it
# No option of the first group goes with one of the second.
EXCLUSIVE = (
    (("--resume",), ("--restart",)),
    (("--resume", "--restart"), WRITES_NOTHING),
    (("--shard",), (*WRITES_NOTHING, "--plot")),
    (("--jobs",), ("--scheduler",)),
    (("--check",), ("--row",)),
    (("--dry-run",), ("--plot", "--row")),
    (("--check", "--shard"), ("--columns", "--top")),
    (INSTEAD, SELECTION),
    *(((one,), (other,)) for one, other in itertools.combinations(INSTEAD, 2)),
)


@study_command
@click.option("--dry-run", is_flag=True, help="Print the cases; compute and write nothing.")
@selection_options
@click.option("--no-write", is_flag=True, help="Print only.")
@click.option("--check", is_flag=True, help="Compare with the stored NAME.csv instead of writing it.")
@click.option(
    "--rtol",
    "rtols",
    multiple=True,
    metavar="[COLUMN=]TOL",
    help="With --check. Default: the study's, else 1e-6. Repeatable.",
)
@click.option("--resume", is_flag=True, help="Go on with the rows of an earlier run.")
@click.option("--restart", is_flag=True, help="Begin anew, whatever an unfinished run has left.")
@click.option("--jobs", type=click.IntRange(1, 1024), help="Processes. Default: as many as the work is worth.")
@click.option("--scheduler", metavar="ADDRESS", help="Compute on a dask cluster: tcp://host:port, or FILE.json.")
@click.option("--shard", metavar="K/N", help="Only every Nth case from the Kth, kept for 'cablestudy merge'.")
@click.option("--row", type=click.IntRange(min=1), help="Only this row of the table; write nothing.")
@click.option("--fail-fast", is_flag=True, help="Stop at the first case without an answer.")
@EXPLAIN
def sweep(study, sets, vary, dry_run, where, sort, best, pareto, sensitivity, out, no_write, check, rtols, style, plot,
          shard, quiet, **how):  # fmt: skip
    """Compute a study: one row for each case, written to DIR/NAME.csv and DIR/NAME.md, and printed.

    Rows are kept as they are done: whatever ends a run, --resume goes on with it.
    """
    context = click.get_current_context()
    exclude(context.params, EXCLUSIVE)
    refuse({"--rtol": rtols and not check}, "for --check only")
    keep, typed, work = not (check or no_write or how["row"]), context.obj["words"], None

    def interrupted():
        return work.interrupted(typed) if work else ["interrupted: nothing is computed yet"]

    with interruptible(interrupted):
        from cablestudy.scene.study import read_study
        from cablestudy.study.table import TableFiles
        from cablestudy.sweeps import run
        from cablestudy.sweeps.check import read_tolerances

        parts = run.read_shard(shard)
        requested = read_study(study, sets, vary)
        echo_notes(requested.notes, quiet)
        if dry_run:
            return print_cases(requested, style)
        select = selection_of(requested, style, sensitivity, where=where, sort=sort, best=best, pareto=pareto)
        if requested.asked and keep:
            keep = False
            echo_notes([f"not written: the study does not list {', '.join(requested.asked)}"], quiet)
        files, tolerance = TableFiles(out, requested.name), None
        if keep:
            files.check_writable()
        if check:
            files.check_stored()
            tolerance = read_tolerances(rtols, requested)
        options = run.Options(keep=keep, shard=parts, quiet=quiet, estimate=style == "json", **how)
        with run.Run(requested, files, options) as work:
            compute(work, words_of(study, sets, vary))
            if not parts:
                return finish(work, style, plot, tolerance, run.command(typed), select, sensitivity)
            echo_notes([f"written: {work.finish_shard(run.command(typed))}"], quiet)
            return NO_ANSWER if work.failed else 0


def print_cases(study, style):
    """The cases of a study, and nothing computed."""
    from cablestudy.study.prepare import prepare
    from cablestudy.sweeps.rows import cases_table

    prepare(study)
    show(cases_table(study), style)


def selection_of(study, style, sensitivity, **options):
    """What is shown of a study's table: Table -> Table and notes; None for all of it.

    Columns that the options name and the study does not have are added to it.
    """
    if sensitivity:
        from cablestudy.sweeps.sensitivity import Sensitivity

        return Sensitivity(study).table
    if style.columns:
        from cablestudy.sweeps.variable import ask_columns

        ask_columns(study, style.columns)
    if set(options.values()) == {None}:
        return None
    from cablestudy.sweeps.select import read_selection

    return read_selection(study, **options).table


def words_of(study, sets, vary):
    """The part of a command that determines the cases."""
    options = [(name, text) for name, texts in (("--set", sets), ("--vary", vary)) for text in texts]
    return ["sweep", study, *itertools.chain(*options)]


def compute(work, words):
    """Compute all rows of a run, and print notes on them."""
    options = work.options
    echo_notes(work.reused(), options.quiet)
    work.compute()
    if options.explain:
        echo_notes(work.notes(), options.quiet)
    echo_notes([*work.failures(words), *work.warnings()], options.quiet)
    work.check_complete()


def finish(work, style, plot, tolerance, command, select=None, indices=False):
    """The table of a complete run, compared, or written and printed; the exit code."""
    table, files, quiet = work.table(), work.files, work.options.quiet
    shown, notes = select(table) if select else (table, [])
    if indices:
        save_plot(plot, lambda plots: plots.sensitivity_plot(work.study, shown))
    else:
        save_plot(plot, lambda plots: plots.study_plot(work.study, table))
    if tolerance is not None:
        return print_differences(table, files.csv, tolerance, quiet)
    if work.options.keep:
        work.write(table, command)
        echo_notes([f"written: {files.csv}, {files.md}"], quiet)
    echo_notes(notes, quiet)
    show(shown, style)
    return NO_ANSWER if work.failed else 0


def print_differences(table, path, tolerance, quiet):
    """The cells of a table that differ from the stored one; the exit code."""
    from cablestudy.sweeps.check import compare

    number = 0
    for number, difference in enumerate(compare(table, path, tolerance), 1):
        if number <= MOST_DIFFERENCES:
            click.echo(f"{path}: {difference}", err=True)
    if number > MOST_DIFFERENCES:
        click.echo(f"{path}: {number} differences in all", err=True)
    echo_notes([] if number else [f"{path}: agrees"], quiet)
    return FAILED_CHECK if number else 0


@study_command
def merge(study, sets, vary, out, style, plot, quiet):
    """Join the shards of a study into its table, as one run would have written it."""
    with interruptible(lambda: ["interrupted: the shards are as they were"]):
        from cablestudy.scene.study import read_study
        from cablestudy.study.table import TableFiles
        from cablestudy.sweeps import run
        from cablestudy.sweeps.merge import MergedRun

        requested = read_study(study, sets, vary)
        echo_notes(requested.notes, quiet)
        files = TableFiles(out, requested.name)
        files.check_writable()
        words = words_of(study, sets, vary)
        with MergedRun(requested, files, words, quiet) as work:
            echo_notes([*work.failures(words), *work.warnings()], quiet)
            return finish(work, style, plot, None, run.command(click.get_current_context().obj["words"]))
