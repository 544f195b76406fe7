"""The command `report`: a scene or a study as one page of HTML that needs nothing else."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

from cablestudy.errors import Mistakes, SceneError, check_writable
from cablestudy.interface import checked_scene, scene_of
from cablestudy.interface.arguments import checked
from cablestudy.interface.kinds import Changes, Columns, File, Processes, Source, Text, Variations, case_text, names_in
from cablestudy.pages import user_input
from cablestudy.pages.markup import element, paragraph, text
from cablestudy.pages.page import Page
from cablestudy.pages.results import check_columns, limits, sections
from cablestudy.pages.tables import columns_of, grid_html
from cablestudy.scene.document import MAPPING, STDIN, apply_sets, read_base, read_file, resolve_base
from cablestudy.scene.scene import is_study
from cablestudy.scene.study import study_of
from cablestudy.scene.words import counted
from cablestudy.study.table import TableFiles, write_whole
from cablestudy.sweeps.fingerprint import provenance, versions

ENDINGS = (".html", ".htm")
STATEMENT = (
    "Beside each number is its estimated error, relative to the number and against the continuous cable: 1e-12 stands "
    "for rounding, exact for what the file itself states, and nothing for an error that is not known."
)


@dataclass(frozen=True)
class Report:
    """A page that was written."""

    path: str  # of its file
    failures: tuple[str, ...]  # what has no answer, and why
    warnings: tuple[str, ...]


@checked
def report(
    path: Source,
    out: File | None = None,
    set: Changes = (),
    vary: Variations = (),
    case: Text | None = None,
    title: Text | None = None,
    jobs: Processes | None = 1,
    quiet: bool = True,
    columns: Columns | None = None,
    where: Text | None = None,
) -> Report:
    """Compute a scene or a study and write tables, pictures and errors as one page of HTML: `Report`.

    The page needs no other file. It names the results that could not be computed, and has all others.

    Parameters
    ----------
    path : str, path-like or mapping
        File of the scene or study; `-` is standard input. Or the contents of the file as a mapping.
    out : str or path-like, optional
        File of the page; by default NAME.html in the working directory.
    set : mapping or list of str, optional
        Changes of the scene: dotted key -> value, or texts "KEY=VALUE".
    vary : mapping or list of str, optional
        Further keys that a study varies, see `sweep`.
    case : str, optional
        Load case of a scene; by default, or with "all", the page has all load cases.
    title : str, optional
        Title of the page; by default that of the study, or the name of the file.
    jobs : int or None
        Number of processes that compute a study, see `sweep`.
    quiet : bool
        Whether a study shows no progress on standard error.
    columns : str or list of str, optional
        Columns of the tables of results; in text separated by commas. Default: all. Key figures stay.
    where : str, optional
        Condition on the rows of a study that are shown, as `sweep --where` takes it.

    Raises
    ------
    SceneError
        All mistakes in the file or an option; nothing is written.

    Examples
    --------
    >>> import cablestudy as cs
    >>> page = cs.report("configs/guy.yaml", out="guy.html")
    """
    with Mistakes() as mistakes, mistakes.at("--columns"):
        names = () if columns is None else names_in(columns)
    return write_report(path, out, set, vary, case, title, jobs, (), quiet, names, where)


def write_report(path, out, set, vary, case, title, jobs, words, quiet, columns, where) -> Report:
    """Compute a scene or a study and write its page, for the function `report` and for the command of this name.

    Parameters are those of `report`, but `set` and `vary` are sequences of texts "KEY=VALUE", `columns` a sequence of
    names, and `words` (sequence of str) the arguments of the command line, which the page shows; empty in Python.
    Messages name the options of the command.
    """
    begun = shlex.join(["cablestudy", *words]) if words else "cablestudy.report", datetime.now(UTC)
    file = checked_file(out, path)
    sets, varied = tuple(set), tuple(vary)
    source = read_file(path)
    if is_study(source):
        if case is not None:
            raise SceneError(f"--case {case}: no effect: {source.name} is a study: give --set case={case}")
        page = _study_page(source, sets, varied, title, begun, jobs, quiet, columns, where)
    else:
        of_study = [f"--vary {text.partition('=')[0]}" for text in varied]
        of_study += [f"--jobs {jobs}"] if jobs not in (None, 1) else []
        of_study += [f"--where {where}"] if where is not None else []
        if of_study:
            raise SceneError(*(f"{option}: no effect: {source.name} is a scene, not a study" for option in of_study))
        check_columns(columns)
        page = _scene_page(source, sets, None if case == "all" else case, title, begun, columns)
    page.check_columns()  # those that exist, but not in the tables of this page
    write_whole(file, page.html())
    return Report(file, tuple(page.failures), tuple(page.warnings))


def checked_file(out, path):
    """The file of the page, from the option --out and the scene or study; SceneError where it cannot be written."""
    name = MAPPING if isinstance(path, Mapping) else STDIN if path == "-" else str(path)
    file = f"{_stem(name)}.html" if out is None else str(out)
    if not file.lower().endswith(ENDINGS):
        raise SceneError(f"--out {file}: a page is HTML (allowed: {', '.join(ENDINGS)})")
    check_writable("--out", file)
    return file


def _stem(name):
    """Name of a file without its folder and ending."""
    return TableFiles("", name).stem


def _scene_page(source, sets, case, title, begun, columns):
    """Compute all results of a scene and put them on a new `Page`; `source` is the `Document` with its base unread.

    `case` is None for all load cases; `begun` are the command and the time when it began, for the record of the run.
    """
    unchanged = resolve_base(source)
    document = apply_sets(unchanged, sets, case)
    model = checked_scene(document)
    scene = scene_of(source.name, sets + case_text(case), document, model)
    in_case = f" in the load case {model.case}" if model.case is not None else ""
    page = Page(title or _stem(source.name), f"{scene.heading}{in_case}. Scene {source.name}.", columns)
    if model.limits:
        with page.section("Limits"):
            limits(page, scene)
    page.heading("Scene")
    page.add(user_input.numbers_table(document))
    page.add(user_input.cases_table(document))
    page.add(user_input.cables_table(model, document))
    _add_file(page, unchanged, document)
    sections(page, scene)
    page.models_and_errors(STATEMENT)
    _add_provenance(page, begun, {"versions": versions(), "scene": document.value}, [document])
    return page


def _add_file(page, unchanged, document):
    """Append the changes that options made to a Document, and the file with them."""
    page.add(user_input.changes_table(unchanged, document))
    page.heading("Resolved file", 3)
    page.add(user_input.resolved_file(document))


def _study_page(source, sets, vary, title, begun, jobs, quiet, columns, where):
    """Compute all rows of a study and put them on a new `Page`; see `_scene_page` and, for the options, `report`."""
    from cablestudy.interface.study import sweep_words
    from cablestudy.pages.study import open_run, study_sections
    from cablestudy.study.prepare import prepare
    from cablestudy.sweeps.select import read_selection
    from cablestudy.sweeps.variable import ask_columns

    study = study_of(source, sets, vary, further_check=prepare)
    with Mistakes() as mistakes:
        with mistakes.at():
            ask_columns(study, columns)
        with mistakes.at():
            selection = read_selection(study, where)
    with open_run(study, TableFiles("results", study.name), jobs, quiet) as run:
        run.compute()
        page = Page(
            title or study.title or _stem(source.name),
            f"Study of {counted(study.count, 'case')}. {source.name}.",
            columns,
        )
        page.heading("Study")
        page.add(user_input.varied_list(study))
        for note in study.notes:
            page.add(paragraph(note))
        _add_file(page, read_base(source), study.document)
        name = source.name if source.name != STDIN else "-"
        study_sections(page, run, sweep_words(name, sets, vary), selection)
        page.models_and_errors(STATEMENT)
        _add_provenance(page, begun, run.identity, [source, study.document])
        return page


def _add_provenance(page, begun, identity, documents):
    """Append the record of the run that computed the numbers of a page, with the files of some documents."""
    page.heading("Provenance")
    command, started = begun
    record = provenance(command, identity, started)
    entries = {
        "command": command,
        "files": ", ".join(dict.fromkeys(name for document in documents for name in document.files)),
        "fingerprint": record["fingerprint"],
        "started": record["started"],
        "duration": f"{record['duration_s']:.1f} s",
        "versions": ", ".join(f"{name} {version}" for name, version in record["versions"].items()),
        "platform": record["platform"],
    }
    rows = [[text(name), element("code", text(value))] for name, value in entries.items()]
    page.add(grid_html(columns_of(["what", "value"], rows), "Where the numbers come from"))
