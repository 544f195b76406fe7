"""The command line: parse, call, print, exit code. Everything heavy is imported by the command that needs it."""

import itertools
import os
import sys
from functools import wraps

import click

from cablestudy import __version__
from cablestudy.errors import CablestudyError, NoSolutionError, SceneError

FAILED_CHECK, WRONG_USE, NO_ANSWER, INTERRUPTED = 1, 2, 3, 130
THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
MOST_DIFFERENCES = 1000  # that a check shows one by one
PICTURES = (".png", ".svg", ".pdf")
ENDS = [f"end_{end}_{axis}" for end in (1, 2) for axis in "xyz"]


def complete_file(context, parameter, incomplete):
    """Shell completion: files."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(incomplete, type="file")]


def complete_column(context, parameter, incomplete):
    """Shell completion: names of columns."""
    from cablestudy.study.columns import COLUMNS

    return [column.header for column in COLUMNS if column.header.startswith(incomplete)]


SCENE = click.argument("scene", metavar="SCENE", shell_complete=complete_file)
SET = click.option(
    "--set", "sets", multiple=True, metavar="KEY=VALUE", help="Change one key, e.g. cable.diameter=3.7mm. Repeatable."
)
FORMAT = click.option(
    "--format", "style", type=click.Choice(["md", "csv", "json", "jsonl"]), default="md", help="Default: md."
)
QUIET = click.option("--quiet", is_flag=True, help="No notes and warnings on standard error.")
EXPLAIN = click.option("--explain", is_flag=True, help="Say on standard error what was modelled, and how well.")
PLOT = click.option("--plot", metavar="FILE", help="Draw a picture too: .png, .svg or .pdf.")


def edge(command):
    """Turn domain errors into lines on standard error and an exit code, here and nowhere else."""

    @wraps(command)
    def run(*arguments, **options):
        try:
            if sys.stdout is None:
                raise SceneError("standard output: closed")
            if hasattr(sys.stdout, "reconfigure"):  # a terminal may lack a letter of what is printed
                sys.stdout.reconfigure(errors="backslashreplace")
            command(*arguments, **options)
            sys.stdout.flush()
        except SceneError as error:
            for mistake in error.mistakes:
                click.echo(str(mistake), err=True)
            sys.exit(error.exit_code)
        except CablestudyError as error:
            where = f"{options['scene']}: " if "scene" in options else ""
            click.echo(where + " ".join(str(error).split()), err=True)
            sys.exit(error.exit_code)
        except BrokenPipeError:  # the reader has had enough, `| head` for example
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(0)
        except OSError as error:  # a full disk: what is still in the buffer must not fail again at exit
            click.echo(f"{error.filename or 'standard output'}: {error.strerror or error}", err=True)
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(WRONG_USE)

    return run


def say(lines, quiet=False):
    """Notes on standard error."""
    for line in () if quiet else lines:
        click.echo(line, err=True)


def show(table, style):
    """The table on standard output, and nothing else."""
    sys.stdout.writelines(table.pieces(style))


def check_picture(path):
    """Refuse a picture of unknown kind, or in a folder that does not exist, before anything is computed."""
    if path is None:
        return
    if not path.lower().endswith(PICTURES):
        raise SceneError(f"--plot {path}: unknown kind of picture (allowed: {', '.join(PICTURES)})")
    folder = os.path.dirname(path) or "."
    if not os.access(folder, os.W_OK) or os.path.isdir(path):
        raise SceneError(f"--plot {path}: cannot be written")


class OneLine(click.Group):
    """A group whose usage errors are one line each, as all other mistakes are."""

    def main(self, *arguments, standalone_mode=True, **options):
        words = arguments[0] if arguments else options.get("args")
        options["obj"] = {"words": list(sys.argv[1:] if words is None else words)}  # as typed, to be said again
        if not standalone_mode:
            return super().main(*arguments, standalone_mode=False, **options)
        try:
            code = super().main(*arguments, standalone_mode=False, **options)
        except click.exceptions.NoArgsIsHelpError as error:
            error.show()
            code = WRONG_USE
        except click.UsageError as error:
            command = error.ctx.command_path if error.ctx else "cablestudy"
            message = error.format_message().rstrip(".")
            click.echo(f"{command}: {message} ('{command} --help' shows how)", err=True)
            code = WRONG_USE
        except click.Abort:
            click.echo("interrupted", err=True)
            code = INTERRUPTED
        sys.exit(code if isinstance(code, int) else 0)


@click.group(cls=OneLine, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="cablestudy")
def main():
    """Parameter studies of actively controlled suspended cables.

    SCENE and STUDY are YAML files, or - for standard input. Tables go to standard output, everything else to standard
    error. Exit codes: 0 done, 1 a check failed, 2 wrong usage, file or value, 3 some case has no answer.
    """
    # many small matrices: threads inside of one only cost time, and digits may depend on them
    for name in THREADS:
        os.environ.setdefault(name, "1")


@main.command()
@SCENE
@SET
@click.option("--shape", is_flag=True, help="The coordinates along the cable instead.")
@FORMAT
@PLOT
@EXPLAIN
@QUIET
@edge
def static(scene, sets, shape, style, plot, explain, quiet):
    """Tension, sag, end stiffness and more of one scene."""
    check_picture(plot)
    from cablestudy.scene.scene import load_scene
    from cablestudy.study import report

    _, model = load_scene(scene, sets)
    row, columns = report.static_row(model)
    say(row.notes if explain else (), quiet)
    if row.failed:
        click.echo(f"{scene}: {row.cells['status']}", err=True)
        if not shape:
            show(report.static_table(row, columns), style)
        sys.exit(NO_ANSWER)
    if plot:
        from cablestudy.study import plots

        plots.save(plots.static_form(row.case), plot)
    show(report.shape_table(row.case) if shape else report.static_table(row, columns), style)


@main.command()
@SCENE
@SET
@click.option("-n", "count", type=click.IntRange(1, 100_000), help="How many, from the lowest. Default: 12.")
@click.option("--upto", metavar="FREQ", help="All up to a frequency instead, e.g. 20 Hz.")
@FORMAT
@PLOT
@EXPLAIN
@QUIET
@edge
def modes(scene, sets, count, upto, style, plot, explain, quiet):
    """Frequencies, kinds and participation factors of the cable with fixed ends."""
    if count is not None and upto is not None:
        raise SceneError("-n and --upto exclude each other")
    check_picture(plot)
    from cablestudy.scene.scene import load_scene
    from cablestudy.scene.units import read_frequency
    from cablestudy.study import report, row
    from cablestudy.study.case import Case

    limit = None if upto is None else read_frequency("--upto", upto)
    _, model = load_scene(scene, sets)
    case, found, notes = row.modes(Case(model), count or 12, limit)
    say(notes if explain else (), quiet)
    if limit is None and len(found) < (count or 12):
        say([f"the model has {len(found)} modes, not {count or 12}"], quiet)
    if plot:
        from cablestudy.study import plots

        plots.save(plots.mode_shapes(case, found), plot)
    show(report.mode_table(case, found), style)


@main.command()
@SCENE
@SET
@FORMAT
@PLOT
@click.option(
    "--on",
    type=click.Choice(["gondola", "cable", "both"]),
    default="gondola",
    show_default=True,
    help="What the wind acts on.",
)
@EXPLAIN
@QUIET
@edge
def windrms(scene, sets, style, plot, on, explain, quiet):
    """RMS of the gondola in the wind, with and without the winch loop; loop margins."""
    check_picture(plot)
    if plot and on != "gondola":
        raise click.UsageError("--plot shows the wind on the gondola: leave out --on")
    from cablestudy.scene.scene import load_scene
    from cablestudy.study.wind_report import wind_table

    document, model = load_scene(scene, sets)
    table, row, remarks = wind_table(document, model, on)
    say((*(row.notes if explain else ()), *remarks), quiet)
    if row.failed:
        click.echo(f"{scene}: {row.cells['status']}", err=True)
    elif plot:
        from cablestudy.study import plots

        plots.save(plots.wind_response(row.case), plot)
    show(table, style)
    if row.failed:
        sys.stdout.flush()
        sys.exit(NO_ANSWER)


STUDY = click.argument("study", metavar="STUDY", shell_complete=complete_file)
OUT = click.option("--out", default="results", metavar="DIR", help="Where the files of NAME go. Default: results.")


@main.command()
@STUDY
@SET
@click.option(
    "--vary",
    multiple=True,
    metavar="KEY=VALUES",
    help="One more dimension, e.g. cable.preload=100N:2kN:20log or gondola.mass=10kg,50kg. Repeatable.",
)
@click.option("--dry-run", is_flag=True, help="Print the cases; compute and write nothing.")
@click.option("--where", metavar="CONDITION", help="Show only such rows, e.g. 'gondola_rms < 1 mm and sag < 0.5'.")
@click.option(
    "--sort",
    metavar="COLUMN",
    shell_complete=complete_column,
    help="Show the rows in this order; -COLUMN: largest first.",
)
@click.option("--best", metavar="'min COLUMN'", help="Show the best row only: 'min COLUMN' or 'max COLUMN'.")
@click.option("--sensitivity", is_flag=True, help="Show Sobol's indices of the columns instead of the rows.")
@OUT
@click.option("--no-write", is_flag=True, help="Print only.")
@click.option("--check", is_flag=True, help="Compare with the stored NAME.csv instead of writing it.")
@click.option("--rtol", "rtols", multiple=True, metavar="[COLUMN=]TOL", help="With --check. Default: 1e-6. Repeatable.")
@click.option("--resume", is_flag=True, help="Go on with the rows of an earlier run.")
@click.option("--restart", is_flag=True, help="Begin anew, whatever an unfinished run has left.")
@click.option("--jobs", type=click.IntRange(1, 1024), help="Processes. Default: as many as the work is worth.")
@click.option("--scheduler", metavar="ADDRESS", help="Compute on a dask cluster: tcp://host:port, or FILE.json.")
@click.option("--shard", metavar="K/N", help="Only every Nth case from the Kth, kept for 'cablestudy merge'.")
@click.option("--row", type=click.IntRange(min=1), help="Only this row of the table; write nothing.")
@click.option("--fail-fast", is_flag=True, help="Stop at the first case without an answer.")
@FORMAT
@PLOT
@EXPLAIN
@QUIET
@click.pass_context
@edge
def sweep(context, study, sets, vary, dry_run, where, sort, best, sensitivity, out, no_write, check, rtols, resume,
          restart, jobs, scheduler, shard, row, fail_fast, style, plot, explain, quiet):  # fmt: skip
    """Compute a study: one row for each case, written to DIR/NAME.csv and DIR/NAME.md, and printed.

    Rows are kept as they are done: whatever ends a run, --resume goes on with it.
    """
    check_picture(plot)
    silent = {"--check": check, "--no-write": no_write, "--row": row}
    shown = {"--where": where is not None, "--sort": sort is not None, "--best": best is not None}
    alone = {"--dry-run": dry_run, "--check": check, "--shard": shard, "--sensitivity": sensitivity}
    exclude(
        ({"--resume": resume}, {"--restart": restart}),
        ({"--resume": resume, "--restart": restart}, silent),
        ({"--shard": shard}, {**silent, "--plot": plot}),
        ({"--jobs": jobs}, {"--scheduler": scheduler}),
        ({"--check": check}, {"--row": row}),
        ({"--dry-run": dry_run}, {"--plot": plot, "--row": row}),
        (alone, shown),
        *(({one: alone[one]}, {other: alone[other]}) for one, other in itertools.combinations(alone, 2)),
    )
    refuse({"--rtol": rtols and not check}, "for --check only")
    from cablestudy.study.interrupt import Interrupts

    keep, typed, work, failed = not any(silent.values()), context.obj["words"], None, 0
    try:
        with Interrupts():
            from cablestudy.scene.study import read_study
            from cablestudy.study import run, store
            from cablestudy.study.check import read_tolerances

            parts = run.read_shard(shard)
            wanted = read_study(study, sets, vary)
            say(wanted.notes, quiet)
            if dry_run:
                print_cases(wanted, style)
                return
            select = selection_of(wanted, where, sort, best, sensitivity)
            if wanted.asked and keep:
                keep = False
                say([f"not written: the study does not list {', '.join(wanted.asked)}"], quiet)
            place = store.Place(out, wanted.name)
            if keep:
                place.check_writable()
            if check:
                place.check_stored()
            tolerance = read_tolerances(rtols, wanted)
            wish = run.Wish(keep, resume, restart, jobs, scheduler, parts, row, fail_fast, explain, quiet)
            with run.Run(wanted, place, wish) as work:
                compute(work, [] if study == "-" else words_of(study, sets, vary))
                if parts:
                    say([f"written: {work.finish_shard(run.command(typed))}"], quiet)
                else:
                    finish(work, style, plot, tolerance if check else None, run.command(typed), select)
                failed = work.journal.failed
    except KeyboardInterrupt:
        say(work.interrupted(typed) if work else ["interrupted: nothing is computed yet"])
        exec("")  # python forgets that the signal came during an import: it would exit by it, and not with the code
        sys.exit(INTERRUPTED)
    if failed:
        sys.stdout.flush()
        sys.exit(NO_ANSWER)


def print_cases(study, style):
    """The cases of a study, and nothing computed."""
    from cablestudy.study.dry_run import lines
    from cablestudy.study.sweep import prepare

    prepare(study)
    sys.stdout.writelines(lines(study, style))


def selection_of(study, where, sort, best, sensitivity):
    """What is shown of a study's table: Table -> Table and notes; None for all of it."""
    if sensitivity:
        from cablestudy.study.sensitivity import Sensitivity

        indices = Sensitivity(study)
        return lambda table: indices.table(table.rows)
    if (where, sort, best) == (None, None, None):
        return None
    from cablestudy.study.select import read_selection

    selection = read_selection(study, where, sort, best)

    def chosen(table):
        found = selection.table(table)
        return found, [f"shown: {len(found.rows)} of {len(table.rows)} rows"]

    return chosen


def words_of(study, sets, vary=()):
    """What of a command says which cases there are."""
    options = [word for text in sets for word in ("--set", text)] + [word for text in vary for word in ("--vary", text)]
    return ["sweep", study, *options]


def exclude(*pairs):
    """Refuse options of the two groups of a pair that are given together."""
    wrong = {}
    for some, others in pairs:
        given = ([name for name in group if group[name]] for group in (some, others))
        for one, other in itertools.product(*given):
            wrong.setdefault(frozenset((one, other)), f"{one} and {other} exclude each other")
    if wrong:
        raise SceneError(*wrong.values())


def refuse(options, reason):
    """Refuse options that would have no effect."""
    given = [name for name, value in options.items() if value]
    if given:
        raise SceneError(f"{', '.join(given)}: no effect: {reason}")


def compute(work, words):
    """All rows of a run, and what is to be said about them."""
    wish = work.wish
    say(work.reused(), wish.quiet)
    work.compute()
    if wish.explain and work.complete:
        say(work.notes(), wish.quiet)
    say(work.failures(words), wish.quiet)
    if not work.complete:
        more = f"; --resume goes on: {work.done} rows are done" if wish.keep else ""
        raise NoSolutionError("stopped at the first case without an answer (--fail-fast)" + more)


def finish(work, style, plot, tolerance, command, select=None):
    """The table of a complete run: compared, or written and printed."""
    table, place, quiet = work.table(), work.place, work.wish.quiet
    if plot:
        from cablestudy.study import plots

        plots.save(plots.study_plot(work.study, table), plot)
    if tolerance is not None:
        from cablestudy.study.check import compare

        differences = 0
        for differences, difference in enumerate(compare(table, place.csv, tolerance), 1):
            if differences <= MOST_DIFFERENCES:
                click.echo(f"{place.csv}: {difference}", err=True)
        if differences > MOST_DIFFERENCES:
            click.echo(f"{place.csv}: {differences} differences in all", err=True)
        say([] if differences else [f"{place.csv}: agrees"], quiet)
        sys.exit(FAILED_CHECK if differences else 0)
    if work.wish.keep:
        work.write(table, command)
        say([f"written: {place.csv}, {place.md}"], quiet)
    if select:
        table, notes = select(table)
        say(notes, quiet)
    show(table, style)


@main.command()
@STUDY
@SET
@OUT
@FORMAT
@PLOT
@QUIET
@click.pass_context
@edge
def merge(context, study, sets, out, style, plot, quiet):
    """Join the shards of a study into its table, as one run would have written it."""
    check_picture(plot)
    from cablestudy.study.interrupt import Interrupts

    try:
        with Interrupts():
            from cablestudy.scene.study import read_study
            from cablestudy.study import run, store
            from cablestudy.study.merge import MergedRun

            wanted = read_study(study, sets)
            place = store.Place(out, wanted.name)
            place.check_writable()
            words = words_of(study, sets)
            with MergedRun(wanted, place, words, quiet) as work:
                say(work.failures([] if study == "-" else words), quiet)
                finish(work, style, plot, None, run.command(context.obj["words"]))
                failed = work.journal.failed
    except KeyboardInterrupt:
        say(["interrupted: the shards are as they were"])
        sys.exit(INTERRUPTED)
    if failed:
        sys.stdout.flush()
        sys.exit(NO_ANSWER)


@main.command()
@SCENE
@SET
@click.option("--columns", "names", metavar="A,B,...", help="What to compare. Default: stiffness, frequencies, wind.")
@click.option("--repeats", type=click.IntRange(1, 1000), default=5, help="Of each timing. Default: 5.")
@click.option("--out", metavar="DIR", help="Write trade-SCENE.csv and trade-SCENE.md there.")
@FORMAT
@PLOT
@EXPLAIN
@QUIET
@edge
def trade(scene, sets, names, repeats, out, style, plot, explain, quiet):
    """Error against time for every model that a user can choose, from closed form to high order."""
    check_picture(plot)
    import shlex

    from cablestudy.scene.scene import load_scene
    from cablestudy.study import store
    from cablestudy.study import trade as study
    from cablestudy.study import trade_tables as tables
    from cablestudy.study.trade_models import choices

    document, model = load_scene(scene, sets)
    columns, notes = study.wanted(document, model, names)
    place = None if out is None else store.Place(out, tables.file_name(scene))
    if place:
        place.check_writable()
    say(notes, quiet)
    if sys.stderr.isatty() and not quiet:
        with click.progressbar(length=(repeats + 1) * len(choices(columns)), label="models", file=sys.stderr) as bar:
            found = study.compare(model, columns, repeats, progress=bar.update)
    else:
        found = study.compare(model, columns, repeats)
    say(tables.notes_of(found) if explain else (), quiet)
    title = shlex.join([scene, *(word for change in sets for word in ("--set", change))])
    for name, reason in found.reference.failures.items():
        click.echo(f"{scene}: {name}: {reason}", err=True)
    if plot:
        from cablestudy.study import plots

        plots.save(plots.trade_plot(found, f"Error against time: {title}"), plot)
    if place:
        tables.write(found, place, title)
        say([f"written: {place.csv}, {place.md}"], quiet)
    show(tables.table_of(found, shown=style == "md"), style)
    if found.reference.failures:
        sys.stdout.flush()
        sys.exit(NO_ANSWER)


@main.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...", shell_complete=complete_file)
@SET
@FORMAT
@QUIET
@edge
def validate(files, sets, style, quiet):
    """Read and check scenes and studies; compute nothing."""
    from cablestudy.study import report

    table, mistakes, notes = report.validate_table(files, sets)
    say(notes, quiet)
    for mistake in mistakes:
        click.echo(str(mistake), err=True)
    show(table, style)
    if mistakes:
        sys.stdout.flush()
        sys.exit(WRONG_USE)


@main.command()
@click.argument("kind", type=click.Choice(["scene", "study"]))
@edge
def schema(kind):
    """JSON Schema of a file, for editors."""
    import json

    from cablestudy.scene.schema import scene_schema, study_schema

    click.echo(json.dumps(scene_schema() if kind == "scene" else study_schema(), indent=2, ensure_ascii=False))


@main.command()
@FORMAT
@edge
def columns(style):
    """Every column: name, unit, meaning, what it needs."""
    from cablestudy.study import report

    show(report.columns_table(), style)


@main.command()
@SCENE
@SET
@click.option("--out", metavar="FILE", help="Write the state space: .npz, .mat or .json.")
@click.option("--modes", "count", type=click.IntRange(min=1), metavar="N", help="Keep so many, from the lowest.")
@click.option("--upto", metavar="FREQ", help="Keep all up to a frequency instead, e.g. 20 Hz.")
@click.option("--error", type=float, metavar="E", help="Keep the fewest that leave out this share of the inertia.")
@click.option("--kinds", metavar="KINDS", help="Keep only these: inplane,axial,outofplane.")
@click.option("--no-residual", is_flag=True, help="Drop the static part of omitted modes too, as the paper does.")
@click.option("--with", "attached", type=click.Choice(["gondola", "loop"]), help="On end 2: gondola, or winch loop.")
@click.option("--wind", is_flag=True, help="Forces on the cable's nodes as inputs too.")
@click.option("--response", "span", metavar="FROM:TO:COUNT", help="Frequency response, e.g. 0.01Hz:100Hz:2000.")
@click.option("--input", "moved", type=click.Choice(ENDS), help="For --response and --error. Default: end_2_x.")
@click.option("--output", "felt", type=click.Choice(ENDS), help="The force there. Default: end_2_x.")
@FORMAT
@PLOT
@EXPLAIN
@QUIET
@edge
def ssm(scene, sets, out, count, upto, error, kinds, no_residual, attached, wind, span, moved, felt,
        style, plot, explain, quiet):  # fmt: skip
    """The cable as a state space: file, kept modes, frequency response."""
    check_picture(plot)
    if plot and not span:
        raise SceneError("--plot: needs --response, which it draws")
    if error is None and (attached or not span):
        use = "--with shows the response of the gondola" if span else "for --response and --error only"
        refuse({"--input": moved, "--output": felt}, use)
    from cablestudy.scene.scene import load_scene
    from cablestudy.study import ssm as study
    from cablestudy.study import ssm_tables as tables

    study.check_file(out)
    wish = study.Wish(count, upto, error, kinds, not no_residual, attached, wind, moved or "end_2_x", felt or "end_2_x")
    frequency = study.span_of_frequencies(span) if span else None
    document, model = load_scene(scene, sets)
    choice = study.choose(document, model, wish)
    say(choice.notes if explain else (), quiet)
    say(choice.warnings, quiet)
    if out or not span:
        system = choice.system()
        say([study.size_line(choice, system)], quiet)
    if out:
        study.write(system, out)
        say([f"written: {out}"], quiet)
    if span:
        curves = tables.curves(choice, frequency)
        if plot:
            from cablestudy.study import plots

            plots.save(plots.bode(frequency, curves), plot)
        show(tables.response_table(frequency, curves), style)
    elif not out:
        show(tables.mode_table(choice), style)


if __name__ == "__main__":
    main()
