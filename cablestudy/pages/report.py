"""The command `report`: a scene or a study as one page of HTML that needs nothing else."""

import shlex
from dataclasses import dataclass

from cablestudy.errors import CablestudyError, SceneError
from cablestudy.pages import given
from cablestudy.pages.markup import element, paragraph, text, unit_text
from cablestudy.pages.page import Page, one_line
from cablestudy.pages.provenance import Provenance
from cablestudy.pages.tables import error_text
from cablestudy.scene.document import apply_sets, read_base, read_file, resolve_base
from cablestudy.scene.scene import is_study, read_scene
from cablestudy.scene.study import study_of
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.scene.words import counted
from cablestudy.study.table import TableFiles, short
from cablestudy.sweeps.fingerprint import versions

STATEMENT = (
    "Beside each number is its estimated error, relative to the number and against the continuous cable: 1e-12 stands for "
    "rounding, exact for what the file itself states, and nothing for an error that is not known."
)


@dataclass(frozen=True)
class Report:
    """A finished page.

    Attributes
    ----------
    html : str
    failures : tuple of str
        What has no answer, and why.
    warnings : tuple of str
    """

    html: str
    failures: tuple
    warnings: tuple


def default_name(path):
    """The file of the report on a file: NAME.html in the working directory."""
    return TableFiles("", "<stdin>" if path == "-" else path).stem + ".html"


def report(path, sets=(), vary=(), title=None, command=None, quiet=True):
    """Compute a scene or a study, and write its page.

    Parameters
    ----------
    path : str or path-like
        `-` is standard input.
    sets, vary : sequence of str
        As of the options `--set` and `--vary`.
    title : str, optional
        Of the page; by default that of the study, or the name of the file.
    command : str, optional
        As typed, for the provenance.
    quiet : bool
        Whether a study shows no progress on standard error.

    Returns
    -------
    Report

    Raises
    ------
    SceneError
        All that is wrong with the file, or with an option.
    """
    provenance = Provenance(command or "cablestudy.report")
    source = read_file(path)
    if is_study(source):
        return _study_report(source, sets, vary, title, provenance, quiet)
    if vary:
        raise SceneError(f"--vary {vary[0].partition('=')[0]}: no effect: {source.name} is a scene, not a study")
    return _scene_report(source, sets, title, provenance)


def _finished(page):
    return Report(page.html(), tuple(page.failures), tuple(page.warnings))


def _stem(source):
    return TableFiles("", source.name).stem


def _scene_report(source, sets, title, provenance):
    plain = resolve_base(source)
    document = apply_sets(plain, sets)
    scene = read_scene(document)
    several = isinstance(scene, SuspensionScene)
    if several:
        from cablestudy.pages import suspension as results

        kind = f"Suspension of {counted(len(scene.cables), 'cable')}"
    else:
        from cablestudy.pages import cable as results

        kind = "One cable" + (" with a gondola" if scene.gondola is not None else "")
    case = f", load case {scene.case}" if scene.case is not None else ""
    page = Page(title or _stem(source), f"{kind}{case}. Scene {source.name}.")
    _at_a_glance(page, results, scene)
    page.heading("Scene")
    page.add(given.numbers_table(document))
    page.add(given.cases_table(document))
    if several:
        page.add(given.cables_table(scene, document))
    _file(page, plain, document)
    results.sections(page, document, scene)
    page.models_and_errors(STATEMENT)
    identity = {"versions": versions(), "scene": document.value}
    _provenance(page, provenance, identity, [document])
    return _finished(page)


def _at_a_glance(page, results, scene):
    """The numbers that a reader looks for first, above all else; what has no answer is told further down."""
    try:
        table = results.key_figures(page, scene)
    except CablestudyError:
        return
    (row,), errors = table.rows, next(iter(table.errors()), {})
    items = []
    for field in table.fields:
        value = row.get(field.name)
        if not isinstance(value, int | float):
            continue
        error = error_text(errors.get(field.name))
        number = f"{text(short(value))} {element('small', unit_text(field.unit))}"
        stated = element("dd", f"error {error}", class_="error") if error and error != "exact" else ""
        items.append(element("div", element("dt", text(field.title)) + element("dd", number) + stated))
    if items:
        page.add(element("dl", "".join(items)) + "\n")


def _file(page, plain, document, more=()):
    """What options changed, and the resolved file."""
    changed = [*given.changes(plain, document), *more]
    page.add(given.change_table(changed))
    page.heading("Resolved file", 3)
    page.add(given.resolved_file(document))


def _study_report(source, sets, vary, title, provenance, quiet):
    from cablestudy.pages import study as results
    from cablestudy.sweeps.run import Options, Run

    study = study_of(source, sets, vary)
    files = TableFiles("results", study.name)
    with Run(study, files, Options(quiet=quiet, explain=True, estimate=True)) as work:
        work.compute()
        page = Page(title or study.title or _stem(source), f"Study of {counted(study.count, 'case')}. {source.name}.")
        page.heading("Study")
        page.add(given.varied_list(study))
        for note in study.notes:
            page.add(paragraph(note))
        _file(page, read_base(source), study.document)
        words = ["sweep", source.name if source.name != "<stdin>" else "-"]
        words += [word for option, texts in (("--set", sets), ("--vary", vary)) for one in texts for word in (option, one)]
        results.sections(page, work, words)
        page.models_and_errors(STATEMENT)
        _provenance(page, provenance, work.identity, [source, study.document])
        return _finished(page)


def _provenance(page, provenance, identity, documents):
    page.heading("Provenance")
    files = dict.fromkeys(name for document in documents for name in document.files)
    page.add(provenance.html(identity, files))
