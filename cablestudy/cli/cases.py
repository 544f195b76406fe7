"""The option `--case`: one of the load cases of a scene, or all of them in one table."""

import json

import click

from cablestudy.cli.error_handling import show
from cablestudy.errors import SceneError

ALL = "all"
CASE = click.option("--case", metavar="NAME", help="One of the load cases of the scene, or all.")


def with_case(sets, name, why_not_all=""):
    """The options `--set` of a command, and one more for a case; None changes nothing.

    `why_not_all`: why the command does not take all cases.
    """
    if name == ALL and why_not_all:
        raise SceneError(f"--case {ALL}: {why_not_all}")
    return sets if name is None else (*sets, f"case={json.dumps(name, ensure_ascii=False)}")


def every_case(scene, sets, style, compute):
    """Print the rows of all load cases of a scene, each beginning with the name of its case.

    Parameters
    ----------
    scene : str
        Its file.
    sets : tuple of str
        Of the options `--set`.
    style : str
        Of the table.
    compute : callable
        (document, scene of one cable, what messages call it) -> Table and exit code of one case.

    Returns
    -------
    int
        The largest exit code.
    """
    from cablestudy.scene.scene import each_case, load_scene
    from cablestudy.scene.suspension import SuspensionScene
    from cablestudy.study.case_tables import joined

    document, model = load_scene(scene, sets, suspensions=True)
    if isinstance(model, SuspensionScene):
        raise SceneError(f"--case {ALL}: the scene is a suspension, which has several tables: give --case NAME")
    if not model.cases:
        raise SceneError(f"--case {ALL}: {scene} has no cases")
    tables, codes = {}, []
    for name, *of_case in each_case(document, model):
        tables[name], code = compute(*of_case, f"{scene}: case {name}")
        codes.append(code)
    show(joined(tables), style)
    return max(codes)
