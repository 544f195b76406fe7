"""The results of a study, as sections of a page: rows, their range, pictures, sensitivities, rows without an answer."""

from functools import partial

from cablestudy.pages.markup import listed, paragraph, text, unit_text
from cablestudy.pages.tables import TableGrid
from cablestudy.scene.words import counted
from cablestudy.study.columns import TEXTS
from cablestudy.study.prepare import prepare
from cablestudy.study.table import short
from cablestudy.study.varied_keys import varied_keys
from cablestudy.sweeps.fingerprint import identity
from cablestudy.sweeps.run import NUMBER, Run, SweepOptions, has_fixed_elements
from cablestudy.sweeps.sensitivity import Sensitivity
from cablestudy.sweeps.stored import has_all_rows

KINDS = 20  # of notes on rows that are listed


def open_run(study, files, jobs, quiet):
    """The `Run` of a study: on the rows of a sweep that has stored them all with their errors, else without storing.

    A sweep estimates the errors of the motion of fixed elements only where they are asked for.
    """
    columns, _ = prepare(study)
    kept = not has_fixed_elements(study) and has_all_rows(files.rows, identity(study, columns), study.count)
    return Run(study, files, SweepOptions(keep=kept, jobs=jobs, quiet=quiet, explain=not kept, estimate=not kept))


def _notes(work):
    """Notes on what was modelled; stored rows have none, for them those of the first case."""
    if not work.options.keep:
        yield from work.notes()
        return
    with Run(work.study, work.files, SweepOptions(row=1, quiet=True, explain=True)) as first:
        first.compute()
        yield from first.notes()


def study_sections(page, work, words, selection=None):
    """Append the results of a complete `Run` to a page.

    Parameters
    ----------
    page : Page
    work : Run
        With its notes.
    words : list of str
        The command that computes the study alone.
    selection : Selection, optional
        Which rows are shown.
    """
    table, study = work.table(), work.study
    shown, notes = selection.table(table) if selection else (table, ())
    page.warn(work.warnings())
    with page.section("Results"):
        if work.options.keep:
            page.add(paragraph(f"The rows are those that a sweep has stored in {work.path}."))
        for note in notes:
            page.add(paragraph(f"{note[0].upper()}{note[1:]}."))
        page.results(shown, "One row for each case", "cablestudy sweep writes them all")
        if len(shown.rows):
            page.draw(partial(_picture, page, study, shown), "Columns of the table against what varies")
    failures = work.failures(words)
    if failures:
        page.heading("Rows without an answer")
        page.fail("Rows", f"{work.failed} of {work.done} rows have no answer")
        page.add(listed(failures))
    if extremes := _range(study, table, shown, page.chosen(shown) or shown.fields):
        page.heading("Smallest and largest")
        page.add(extremes)
    if study.sample is not None and study.sample.method == "saltelli":
        with page.section("Sensitivity"):
            indices, notes = Sensitivity(study).table(table)
            page.table(indices, "Sobol's indices: the share of each column's variance that a key explains")
            page.note("Sensitivity", notes)
            page.draw(lambda plots: plots.sensitivity_plot(study, indices), "Sobol's indices with their 95 % intervals")
    page.note("Rows", kinds_of(_notes(work)))


def _picture(page, study, table, plots):
    """The picture of a study, and a note on the columns that it leaves out."""
    columns = [field.name for field in page.chosen(table)]
    if not columns and (left_out := plots.not_drawn(study)):
        page.note("Picture", [f"not drawn: {', '.join(left_out)} (plot: {{x: ..., y: [...]}} of the study chooses)"])
    return plots.study_plot(study, table, columns)


def _range(study, table, shown, fields):
    """HTML table of the smallest and largest number of each column that varies, and the case of each.

    Parameters
    ----------
    study : StudyFile
    table, shown : Table
        All rows, and those that are shown.
    fields : sequence of Field
    """
    frame, lines = table.rows.frame(), []
    if shown is not table:
        frame = frame.loc[shown.rows.places]
    left_out = {*TEXTS, *(key.header for key in varied_keys(study))}
    for field in fields:
        if field.hidden or field.printed or field.name not in frame or field.name in left_out:
            continue
        numbers = frame[field.name].dropna()
        if numbers.nunique() < 2:
            continue
        line = [f"{text(field.title)} [{unit_text(field.shown_unit)}]" if field.unit else text(field.title)]
        for place in (numbers.idxmin(), numbers.idxmax()):
            line += [text(short(field.shown({field.name: float(numbers[place])}))), text(_case(study, table, place))]
        lines.append(line)
    head = ["column", "smallest", "in the case", "largest", "in the case"]
    return TableGrid(head, lines, {1, 3}).html("Smallest and largest of each column") if lines else ""


def _case(study, table, place):
    """Number of a row of a table, and what varies in it."""
    row = table.rows[place]
    varied = ", ".join(f"{varying.key} {varying.label(row[varying.header])}" for varying in varied_keys(study))
    return f"{place + 1}: {varied}"


def kinds_of(notes):
    """Notes on rows, those that differ in numbers only as one: list of str."""
    kinds = {}
    for note in notes:
        row, _, line = note.partition(": ")
        kinds.setdefault(NUMBER.sub("…", line), []).append((row, line))
    lines = []
    for alike in list(kinds.values())[:KINDS]:
        row, line = alike[0]
        others = f" ({row}; alike in {counted(len(alike) - 1, 'other row')})" if len(alike) > 1 else f" ({row})"
        lines.append(line + others)
    return lines + ([f"and {len(kinds) - KINDS} more kinds of notes"] if len(kinds) > KINDS else [])
