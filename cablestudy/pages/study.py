"""The results of a study, as sections of a page: rows, their range, pictures, sensitivities, rows without an answer."""

from functools import partial

from cablestudy.pages.markup import listed, paragraph, text, unit_text
from cablestudy.pages.tables import columns_of, grid_html
from cablestudy.pages.tolerances import PAGES
from cablestudy.scene.words import counted
from cablestudy.study.cable_columns import TEXTS
from cablestudy.study.prepare import prepare
from cablestudy.study.table import short
from cablestudy.study.varied_keys import varied_keys
from cablestudy.sweeps.fingerprint import identity
from cablestudy.sweeps.run import NUMBER, Run, SweepOptions, has_fixed_elements
from cablestudy.sweeps.sensitivity import Sensitivity
from cablestudy.sweeps.stored import has_all_rows


def open_run(study, files, jobs, quiet):
    """The `Run` of a study: on the rows of a sweep that has stored them all with their errors, else without storing.

    A sweep estimates the errors of the motion of fixed elements only where they are asked for.
    """
    columns, _ = prepare(study)
    is_stored = not has_fixed_elements(study) and has_all_rows(files.rows, identity(study, columns), study.count)
    compute = {"explain": not is_stored, "estimate": not is_stored}
    return Run(study, files, SweepOptions(keep=is_stored, jobs=jobs, quiet=quiet, **compute))


def _notes(run):
    """Yield notes on what was modelled in each row; stored rows have none, for them those of the first row."""
    if not run.options.keep:
        yield from run.notes()
        return
    with Run(run.study, run.files, SweepOptions(row=1, quiet=True, explain=True)) as first_row:
        first_row.compute()
        yield from first_row.notes()


def study_sections(page, run, words, selection=None):
    """Append the results of a study to a page: rows, pictures, rows without an answer, extremes, Sobol's indices.

    `run` is complete, from `open_run`. The `words` of the command that computes the study are for the hint how to
    compute a failed row alone. A `Selection` chooses the rows that are shown.
    """
    table, study = run.table(), run.study
    shown, notes = selection.table(table) if selection else (table, ())
    page.warn("Rows", run.warnings())
    with page.section("Results"):
        if run.options.keep:
            page.add(paragraph(f"The rows are those that a sweep has stored in {run.path}."))
        for note in notes:
            page.add(paragraph(f"{note[0].upper()}{note[1:]}."))
        page.results(shown, "One row for each case", "cablestudy sweep writes them all")
        if len(shown.rows):
            page.draw(partial(_draw_table, page, study, shown), "Columns of the table against what varies")
    failures = run.failures(words)
    if failures:
        page.heading("Rows without an answer")
        page.fail("Rows", f"{run.failed} of {run.done} rows have no answer")
        page.add(listed(failures))
    if extremes := _extremes(study, table, shown, page.chosen(shown) or shown.fields):
        page.heading("Smallest and largest")
        page.add(extremes)
    if study.sample is not None and study.sample.method == "saltelli":
        with page.section("Sensitivity"):
            indices, notes = Sensitivity(study).table(table)
            page.table(indices, "Sobol's indices: the share of each column's variance that a key explains")
            page.note("Sensitivity", notes)
            page.draw(lambda plots: plots.sensitivity_plot(study, indices), "Sobol's indices with their 95 % intervals")
    page.note("Rows", kinds_of(_notes(run)))


def _draw_table(page, study, table, plots):
    """The picture of the table of a study, by the module `plots`; notes the columns that it leaves out."""
    columns = [field.name for field in page.chosen(table)]
    if not columns and (left_out := plots.not_drawn(study)):
        page.note("Picture", [f"not drawn: {', '.join(left_out)} (plot: {{x: ..., y: [...]}} of the study chooses)"])
    return plots.study_plot(study, table, columns)


def _extremes(study, table, shown, fields):
    """HTML table of the smallest and largest number of each column, and of the cases in which they occur: str.

    Left out are text, varied keys, hidden columns, differences from printed values (those of a publication), and
    columns in which all numbers are equal. Empty if no column is left.

    `shown` is the `Table` of the rows that the page shows, `table` that of all rows of the study; `fields` are the
    columns to take (sequence of Field).
    """
    frame, lines = table.rows.frame(), []
    if shown is not table:
        frame = frame.loc[shown.rows.indices]
    left_out = {*TEXTS, *(key.header for key in varied_keys(study))}
    for field in fields:
        if field.hidden or field.printed or field.name not in frame or field.name in left_out:
            continue
        numbers = frame[field.name].dropna()
        if numbers.nunique() < 2:
            continue
        line = [f"{text(field.title)} [{unit_text(field.shown_unit)}]" if field.unit else text(field.title)]
        for row in (numbers.idxmin(), numbers.idxmax()):
            line += [text(short(field.shown({field.name: float(numbers[row])}))), text(_row_label(study, table, row))]
        lines.append(line)
    head = ["column", "smallest", "in the case", "largest", "in the case"]
    return grid_html(columns_of(head, lines, right=(1, 3)), "Smallest and largest of each column") if lines else ""


def _row_label(study, table, row):
    """Number, from 1, and varied values of a row of a table, by its index: text."""
    cells = table.rows[row]
    varied = ", ".join(f"{varying.key} {varying.label(cells[varying.header])}" for varying in varied_keys(study))
    return f"{row + 1}: {varied}"


def kinds_of(notes):
    """Notes on rows, `row N: TEXT` each, those that differ in numbers only as one: list of str."""
    notes_of_kind = {}  # text without its numbers -> (row, text) of each note
    for note in notes:
        row, _, line = note.partition(": ")
        notes_of_kind.setdefault(NUMBER.sub("…", line), []).append((row, line))
    lines = []
    for of_kind in list(notes_of_kind.values())[: PAGES.note_kinds]:
        row, line = of_kind[0]
        others = f"; alike in {counted(len(of_kind) - 1, 'other row')}" if len(of_kind) > 1 else ""
        lines.append(f"{line} ({row}{others})")
    left_out = len(notes_of_kind) - PAGES.note_kinds
    return lines + ([f"and {left_out} more kinds of notes"] if left_out > 0 else [])
