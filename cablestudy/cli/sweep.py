"""The commands sweep, show and merge."""

import itertools

import click

from cablestudy.cli.error_handling import FAILED_CHECK, NO_ANSWER, echo_notes, interruptible
from cablestudy.cli.options import EXPLAIN, JOBS, SELECTION, exclude, selection_options, study_command
from cablestudy.cli.tables import show as print_table
from cablestudy.errors import SceneError, refuse_options

MOST_DIFFERENCES = 1000  # that a check shows one by one
WRITES_NOTHING = ("--check", "--no-write", "--row")
WITHOUT_ROWS = ("--dry-run", "--check", "--shard", "--sensitivity")  # print something else than the rows
# No option of the first group goes with one of the second.
EXCLUSIVE = (
    (("--resume",), ("--restart",)),
    (("--resume", "--restart"), WRITES_NOTHING),
    (("--shard",), (*WRITES_NOTHING, "--plot")),
    (("--jobs",), ("--scheduler",)),
    (WITHOUT_ROWS, ("--row",)),
    (("--dry-run",), ("--plot",)),
    (("--check", "--shard"), ("--columns", "--top")),
    (WITHOUT_ROWS, SELECTION),
    *(((option,), (other,)) for option, other in itertools.combinations(WITHOUT_ROWS, 2)),
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
@JOBS
@click.option("--scheduler", metavar="ADDRESS", help="Compute on a dask cluster: tcp://host:port, or FILE.json.")
@click.option("--shard", metavar="K/N", help="Only every Nth case from the Kth, kept for 'cablestudy merge'.")
@click.option("--row", type=click.IntRange(min=1), help="Only this row of the table; write nothing.")
@click.option("--fail-fast", is_flag=True, help="Stop at the first case without an answer.")
@EXPLAIN
def sweep(study, sets, vary, dry_run, where, sort, best, pareto, sensitivity, out, no_write, check, rtols, style, plot,
          shard, quiet, **run_options):  # fmt: skip
    """Compute a study: one row for each case, written to DIR/NAME.csv and DIR/NAME.md, and printed.

    Rows are kept as they are done: whatever ends a run, --resume goes on with it.
    """
    context = click.get_current_context()
    exclude(context.params, EXCLUSIVE)
    refuse_options({"--rtol": rtols and not check}, "for --check only")
    keep, words, run = not (check or no_write or run_options["row"]), context.obj["words"], None

    def lines_when_interrupted():
        return run.interrupted(words) if run else ["interrupted: nothing is computed yet"]

    with interruptible(lines_when_interrupted):
        from cablestudy.interface.study import Study, command_text, differing_columns

        study = Study(study, sets, vary)
        echo_notes(study.notes, quiet)
        if dry_run:
            print_table(study.cases(), style)
            return 0
        select = study.selection(style.columns, sensitivity, where=where, sort=sort, best=best, pareto=pareto)
        if study.request.asked and keep:  # columns that options name and the study does not list
            keep = False
            echo_notes([f"not written: the study does not list {', '.join(study.request.asked)}"], quiet)
        tolerances = None
        if check:
            study.files(out).check_stored()
            tolerances = study.tolerances(rtols)
        options = {"quiet": quiet, "estimate": style == "json", **run_options}
        with study.run(out, keep, shard, **options) as run:
            columns = print_differences(differing_columns(run.table(), run.files.csv), run) if check else 0
            compute(run, study.words)
            if not shard:
                return write_and_print(
                    study, run, style, plot, command_text(words), select, sensitivity, tolerances, columns
                )
            echo_notes([f"written: {run.finish_shard(command_text(words))}"], quiet)
            return NO_ANSWER if run.failed else 0


def compute(run, words):
    """Compute all rows of a `Run`, and print notes on them; `words` are the command that computes the study alone."""
    options = run.options
    echo_notes(run.reused(), options.quiet)
    run.compute()
    if options.explain:
        echo_notes(run.notes(), options.quiet)
    echo_notes([*run.failures(words), *run.warnings()], options.quiet)
    run.check_complete()


def write_and_print(study, run, style, plot, command, select, indices=False, tolerances=None, differing=0):
    """Write and print the table of a complete `Run`, or compare it with the stored table; return the exit code.

    Parameters
    ----------
    study : StudyFile
    run : Run
    style : Style
        How the table is printed.
    plot : str or None
        File of a picture.
    command : str
        The command as typed, for the record next to the written table.
    select : callable
        Table -> the table that is drawn and printed, and notes; see `Study.selection`.
    indices : bool
        True if `select` returns Sobol's indices in place of rows of the study.
    tolerances : dict, optional
        Of `Study.tolerances`: the table is compared with the stored one within them, and not printed.
    differing : int
        Number of differences printed before: columns that only one of these tables has, or that are renamed.
    """
    from cablestudy.interface.study import differences

    table, files, quiet = run.table(), run.files, run.options.quiet
    if run.options.keep:
        run.write(table, command)
        echo_notes([f"written: {files.csv}, {files.md}"], quiet)
    shown, notes = select(table)
    draw(study, shown, plot, indices, style, quiet)
    if tolerances is not None:
        number = print_differences(differences(table, files.csv, tolerances), run, differing)
        if number > MOST_DIFFERENCES:
            click.echo(f"{files.csv}: {number} differences in all", err=True)
        echo_notes([] if number else [f"{files.csv}: agrees"], quiet)
        return FAILED_CHECK if number else 0
    echo_notes(notes, quiet)
    print_table(shown, style)
    return NO_ANSWER if run.failed else 0


def draw(study, table, plot, indices, style, quiet):
    """Write the picture of a table of a study, or of sensitivity `indices`, to the file `plot`, if one is given."""
    if plot:
        left_out = study.save_figure(plot, table, indices, style.columns)
        echo_notes([f"written: {plot}", *left_out], quiet)


def print_differences(differences, run, before=0):
    """Print what differs from the stored table of a run; return the number of lines with those `before` them."""
    number = before
    for number, difference in enumerate(differences, before + 1):
        if number <= MOST_DIFFERENCES:
            click.echo(f"{run.files.csv}: {difference}", err=True)
    return number


@study_command
@selection_options
def show(study, sets, vary, out, style, plot, quiet, sensitivity, **selection):
    """Show what is stored of a study, and compute nothing: its rows as a sweep keeps them, else its CSV.

    Of a sweep that was interrupted, the rows that are done.
    """
    exclude(click.get_current_context().params, ((("--sensitivity",), SELECTION),))
    from cablestudy.interface.study import Study

    study = Study(study, sets, vary)
    with study.stored(out) as stored:
        select = study.selection(style.columns, sensitivity, **selection)
        if study.request.asked:  # columns that options name and the study does not list
            names, similar = ", ".join(study.request.asked), study.varied_with_same_name
            hint = f"did you mean {' or '.join(similar)}? else " if similar else ""
            how = "'cablestudy sweep' with these options computes it"
            raise SceneError(f"{stored.path}: no column {names}: {hint}{how}")
        if sensitivity and not stored.complete:
            raise SceneError(*stored.notes, "--sensitivity needs all rows")
        number = len(stored.table.rows)
        echo_notes([*stored.notes, f"{stored.path}: {number} row{'s' * (number != 1)}"], quiet)
        table, notes = select(stored.table)
        draw(study, table, plot, sensitivity, style, quiet)
        echo_notes(notes, quiet)
        print_table(table, style)
    return 0


@study_command
def merge(study, sets, vary, out, style, plot, quiet):
    """Join the shards of a study into its table, as one run would have written it."""
    with interruptible(lambda: ["interrupted: the shards are as they were"]):
        from cablestudy.interface.study import Study, command_text

        study, words = Study(study, sets, vary), click.get_current_context().obj["words"]
        echo_notes(study.notes, quiet)
        with study.merged(out, quiet) as run:
            echo_notes([*run.failures(study.words), *run.warnings()], quiet)
            return write_and_print(study, run, style, plot, command_text(words), study.selection())
