"""Cases of suspensions, from mappings or from files of configs/suspensions, and numbers of their columns."""

from copy import deepcopy

from command import CONFIGS

from cablestudy.motion.gust_response import GustResponse
from cablestudy.scene.scene import load_scene
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.study.columns import find
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.rows import evaluate_suspensions

SUSPENSIONS = CONFIGS / "suspensions"


def scene_at(name, *sets):
    """A scene of configs/suspensions with changes."""
    return load_scene(SUSPENSIONS / f"{name}.yaml", sets)[1]


def case_at(name, *sets):
    """`SuspensionCase` of a scene of configs/suspensions with changes."""
    return SuspensionCase(scene_at(name, *sets))


def scene_from(text):
    """The scene that a mapping describes."""
    return SuspensionScene.model_validate(deepcopy(text))


def case_of(text):
    """`SuspensionCase` of the scene that a mapping describes."""
    return SuspensionCase(scene_from(text))


def value(case, column):
    """The number in a column of a case."""
    found = find(column).compute(case)
    return found[0] if isinstance(found, tuple) else found


def in_wind(analysis, count, responses=False):
    """`LoopInWind` of a `DynamicAnalysis` with so many modes, unstable or not."""
    return analysis.in_wind(analysis.closed_loop_of(count, responses))


def response_with(analysis, count, responses=False, **options):
    """`GustResponse` of a `DynamicAnalysis` with so many modes."""
    return GustResponse(in_wind(analysis, count, responses), analysis.scene, **options)


def variances_of(analysis, count):
    """`Variances` of all outputs in the wind with so many modes."""
    return response_with(analysis, count).variances


def row(scene, *names):
    """Cells of a row by the names of its columns, and its status."""
    columns = [find(name) for name in names]
    cells = evaluate_suspensions([scene], columns)[0].cells
    return {name: cells[column.header] for name, column in zip(names, columns, strict=True)}, cells["status"]


def numbers(scene, *names):
    """Cells of a row that has them all."""
    cells, status = row(scene, *names)
    assert status.startswith(("ok", "over strength")), status
    return cells
