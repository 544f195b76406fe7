"""Table of the command validate."""

from cablestudy.errors import SceneError
from cablestudy.scene.document import apply_sets, read_file, resolve_base
from cablestudy.scene.likely_mistakes import likely_mistakes
from cablestudy.scene.sampling import FEWEST
from cablestudy.scene.scene import is_study, read_scene
from cablestudy.scene.study import study_of
from cablestudy.scene.words import counted
from cablestudy.study.limits import limits_of
from cablestudy.study.prepare import prepare
from cablestudy.study.table import Field, Table


def validate_table(files, sets=()):
    """Read and check files, with `--set` options.

    Returns
    -------
    table : Table
        File, kind, number of cases (of a scene its load cases, or 1), status.
    mistakes : list of Mistake
    notes : list of str
        Warnings about files without a mistake.
    """
    rows, mistakes, notes = [], [], []
    for file in files:
        try:
            kind, cases, known = _validate(file, sets)
            notes += known
            rows.append({"file": file, "kind": kind, "cases": cases, "status": "ok"})
        except SceneError as error:
            mistakes += error.mistakes
            rows.append({"file": file, "status": counted(len(error.mistakes), "mistake")})
    return Table(tuple(Field(name, name) for name in ("file", "kind", "cases", "status")), rows), mistakes, notes


def _validate(file, sets):
    document = read_file(file)
    if is_study(document):
        study = study_of(document, sets)
        prepare(study)
        notes, sample = [], study.sample
        if sample and sample.method == "saltelli" and sample.count < FEWEST:
            few = f"sample: {sample.count} points; --sensitivity needs at least {FEWEST}"
            notes = [f"{study.where(('sample', 'count'))}: {few}"]
        return "study", study.count, [*study.likely_mistakes(), *study.notes, *notes]
    document = apply_sets(resolve_base(document), sets)
    scene = read_scene(document)
    limits_of(scene, document)
    return "scene", len(scene.cases) or 1, likely_mistakes(document)
