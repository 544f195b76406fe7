"""The Python interface: what the commands do, as functions that return mappings, data frames, models and figures.

    import cablestudy as cs
    scene = cs.load("carlina.yaml", set={"cable.diameter": "3.7 mm"})
    scene.static()["sag_m"]

The commands call it too, and nothing else of the program. A mistake of the user raises `SceneError`; a case without an
answer has empty cells and says why in `status`, or raises `NoSolutionError` or `ConvergenceError` where nothing can be
had.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cablestudy.interface.answers import find_value
from cablestudy.interface.arguments import checked
from cablestudy.interface.kinds import (
    Between,
    Changes,
    Columns,
    File,
    Goal,
    Processes,
    Runs,
    Source,
    Text,
    Variations,
    case_text,
)
from cablestudy.interface.scene import Scene
from cablestudy.interface.scene_commands import with_likely_mistakes
from cablestudy.interface.suspension import Suspension
from cablestudy.scene.document import Document, apply_sets, read_document
from cablestudy.scene.scene import CableScene, load_scene, read_scene
from cablestudy.threads import one_thread

if TYPE_CHECKING:
    import pandas

    from cablestudy.interface.answer import Answer
    from cablestudy.scene.suspension import SuspensionScene

INTERFACES = {CableScene: Scene}  # of any other model `Suspension`, so that one cable imports no tables of those
__all__ = ["Scene", "Suspension", "find", "load", "sweep", "trade"]


@checked
def load(path: Source, set: Changes = (), case: Text | None = None) -> Scene:
    """Read a scene, of one cable or of a suspension, from a file or a mapping, and check it.

    Parameters
    ----------
    path : str, path-like or mapping
        Path of the file, `-` for standard input; or the contents of a scene file as a mapping.
    set : mapping or list of str, optional
        Changes to the file: dotted key -> number in SI, or text with a unit; or texts "KEY=VALUE".
    case : str, optional
        Name of the load case in which the scene is computed.

    Returns
    -------
    Scene or Suspension

    Raises
    ------
    SceneError
        With all mistakes of the file and of the changes.

    Examples
    --------
    >>> import cablestudy as cs
    >>> guy = cs.load("configs/guy.yaml", set={"cable.preload": "8 %"})
    """
    return read(path, set, case)


def read(path: Any, set: Sequence[str] = (), case: str | None = None) -> Scene:
    """The scene as `load`, of changes as texts; errors name the options of the commands, which call it."""
    changes = tuple(set)
    document, model = load_scene(path, changes, case, checked_scene)
    name = document.name if isinstance(path, Mapping) else str(path)
    return scene_of(name, changes + case_text(case), document, model)


def checked_scene(document: Document) -> CableScene | SuspensionScene:
    """Read the scene of a document; SceneError of all that is wrong with it, limits that it cannot have too."""
    if not document.value.get("limits"):
        return read_scene(document)
    from cablestudy.study.limits import scene_with_limits

    return scene_with_limits(document)


def scene_of(name: str, changes: tuple[str, ...], document: Document, model: CableScene | SuspensionScene) -> Scene:
    """The `Scene` or `Suspension` of what was read from a file or mapping, see `checked_scene`."""
    return INTERFACES.get(type(model), Suspension)(name, changes, document, model)


@checked
def sweep(
    study: Source, set: Changes = (), vary: Variations = (), jobs: Processes | None = 1, out: File | None = None
) -> pandas.DataFrame:
    """Compute all cases of a study: a base scene in which keys are varied.

    Parameters
    ----------
    study : str, path-like or mapping
        Name of its file, `-` for standard input; or the contents of the file as a mapping, whose `base` may be one too.
    set : mapping or list of str, optional
        Dotted key -> value that changes the base; or texts "KEY=VALUE".
    vary : mapping or list of str, optional
        Dotted key -> its values: a list or array; a range {"from": ..., "to": ..., "count": ...}; or text as for the
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
    from cablestudy.interface.study import Study

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


@checked
def trade(path: Source, columns: Columns | None = None, repeats: Runs = 5, set: Changes = ()) -> pandas.DataFrame:
    """Error against time of every model for a scene: pandas.DataFrame; see `Scene.trade`."""
    return load(path, set).trade(columns, repeats)


@checked
def find(
    path: Source,
    goal: Goal,
    by: Text,
    between: Between | None = None,
    columns: Columns | None = None,
    set: Changes = (),
    case: Text | None = None,
) -> pandas.DataFrame:
    """The values of a key for which a column of a scene takes a value: pandas.DataFrame; see `Scene.find`.

    The scene may lack the key.
    """
    return compute_find(path, set, case, goal=goal, by=by, between=between, columns=columns).frame()


@one_thread()
def compute_find(path: Any, set: Sequence[str] = (), case: str | None = None, **asked: str | None) -> Answer:
    """`Answer` of `find`, of changes as texts, with warnings and failures; its other parameters are `asked`."""
    document = apply_sets(read_document(path), tuple(set), case)
    return with_likely_mistakes(find_value(document, **asked), document)
