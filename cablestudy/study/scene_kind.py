"""Differences between scenes of one cable and suspensions: the one place of studies that knows both."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module

from cablestudy.scene.scene import CableScene
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.study.column import CLOSED


@dataclass(frozen=True)
class SceneKind:
    """Functions and modules by which scenes of one kind (one cable, or a suspension) are computed."""

    # scenes, columns, whether to estimate the errors of models with a stated number of elements -> list of Row
    evaluate: Callable
    # `CaseTable`, columns -> rows of all its cases at once, see `one_cable.static_columns`; None where each case takes
    # its own scene; None in place of the function where that is always so
    evaluate_table: Callable | None
    why_not: Callable  # scene, column -> reason for which the scene cannot have it, empty where it can
    # scene, name of a column -> list of cable and its column of that name, where the name stands for those of several
    # cables; else empty
    of_each_cable: Callable
    usual_columns: tuple  # names of the columns that `find` shows besides the column of its goal
    # case -> notes on the meaning of the tensions and sags that its scene states; raises NoSolutionError and
    # ConvergenceError where a suspension has no stable equilibrium
    notes_on_stated: Callable
    freeze: Callable  # document, scene -> contents of its file with unstretched lengths, see `freeze.freeze_cable`
    case: Callable  # scene -> `CableCase` or `SuspensionCase`
    as_suspension: Callable  # scene -> `SuspensionScene` of the same points, bodies, cables and winches
    # name in the loop -> name for the user, of winches, references and outputs whose names differ
    names_in_loop: dict
    wind_keys: tuple  # keys of the scene without which no wind acts on what the loop moves
    package: str  # name of the package with modules of equal names for each kind

    def is_cheap(self, column):
        """True if a column costs so little that `find` may try many values: a closed form of many cases at once."""
        return self.evaluate_table is not None and column.needs in CLOSED and not column.each

    @property
    def trade(self):
        """The module with the models that `trade` compares: imported when first used."""
        return import_module(f"{self.package}.trade")

    @property
    def ssm(self):
        """The module that chooses the modes of state spaces: imported when first used."""
        return import_module(f"{self.package}.ssm")


@cache
def _one_cable():
    """`SceneKind` of scenes of one cable. Its modules are imported here, so only once such a scene is read."""
    from cablestudy.scene.one_cable import NAMES, WIND_KEYS, as_suspension
    from cablestudy.study.freeze import freeze_cable
    from cablestudy.study.notes import reference_without_loads
    from cablestudy.study.one_cable import columns
    from cablestudy.study.one_cable.case import CableCase
    from cablestudy.study.one_cable.static_columns import evaluate_table

    return SceneKind(
        evaluate=columns.evaluate,
        evaluate_table=evaluate_table,
        why_not=columns.why_not,
        of_each_cable=lambda scene, name: [],
        usual_columns=("preload", "max_tension", "sag", "unstretched_length", "utilisation"),
        notes_on_stated=lambda case: reference_without_loads(case.scene),
        freeze=freeze_cable,
        case=CableCase,
        as_suspension=as_suspension,
        names_in_loop=NAMES,
        wind_keys=WIND_KEYS,
        package="cablestudy.study.one_cable",
    )


@cache
def _suspension():
    """`SceneKind` of suspensions. Its modules are imported here, so only once a suspension is read."""
    from cablestudy.study.freeze import freeze_suspension
    from cablestudy.study.suspension import columns
    from cablestudy.study.suspension.case import SuspensionCase
    from cablestudy.study.suspension.notes import notes_on_stated
    from cablestudy.study.suspension.rows import evaluate_suspensions

    return SceneKind(
        evaluate=evaluate_suspensions,
        evaluate_table=None,
        why_not=columns.why_not,
        of_each_cable=columns.of_each_cable,
        usual_columns=("min_tension", "max_tension", "max_utilisation"),
        notes_on_stated=notes_on_stated,
        freeze=freeze_suspension,
        case=SuspensionCase,
        as_suspension=lambda scene: scene,
        names_in_loop={},
        wind_keys=("wind",),
        package="cablestudy.study.suspension",
    )


KINDS = {CableScene: _one_cable, SuspensionScene: _suspension}


def kind_of(scene):
    """The `SceneKind` of a scene."""
    return KINDS[type(scene)]()


def why_not(scene, column):
    """Reason for which a scene cannot have a column; empty where it can."""
    return kind_of(scene).why_not(scene, column)
