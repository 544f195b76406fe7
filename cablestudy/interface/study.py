"""A study, as the commands sweep and merge take it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from cablestudy.interface.scene import Changes, texts_of

if TYPE_CHECKING:
    import pandas


def sweep(
    study: str | os.PathLike[str],
    set: Changes = (),
    vary: Mapping[str, str] | None = None,
    jobs: int | None = None,
    out: str | os.PathLike[str] | None = None,
) -> pandas.DataFrame:
    """Compute a study.

    Parameters
    ----------
    study : str or path-like
    set : dict, optional
        Dotted key -> value that changes the base.
    vary : dict, optional
        Dotted key -> text of values, as of the option `--vary`: "100N:2kN:20log", "10kg,50kg".
    jobs : int, optional
        Processes; by default as many as the work is worth.
    out : str, optional
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
    from cablestudy.scene.study import read_study
    from cablestudy.study.table import TableFiles
    from cablestudy.sweeps.run import Options, Run

    texts = tuple(f"{key}={text}" for key, text in (vary or {}).items())
    asked = read_study(study, texts_of(set), texts)
    files = TableFiles("results" if out is None else str(out), asked.name)
    keep = out is not None
    if keep:
        files.check_writable()
    with Run(asked, files, Options(keep=keep, jobs=jobs, quiet=True, resume=False)) as work:
        work.compute()
        work.check_complete()
        table = work.table()
        if keep:
            work.write(table, "cablestudy.sweep")
        frame = table.rows.frame()[[field.name for field in table.fields]]
    frame.attrs["units"] = {field.name: field.unit for field in table.fields}
    return frame
