"""What tests ask of a solved scene: numbers by the names of columns, modes, and frequency responses.

A scene is the name of a file or what it would say, as a mapping; of one cable or of several. Tests that go through this
module know nothing of the classes behind it, so that only this module changes with them.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import cablestudy as cs
from cablestudy.scene.study import read_study
from cablestudy.study.column import lacking_key
from cablestudy.study.columns import find
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.study_rows import evaluate

TURN = 2 * np.pi


@dataclass(frozen=True)
class Solved:
    """A row of a table: the numbers of one scene.

    Attributes
    ----------
    values : dict
        Name of a column, as it was asked for -> number; None where there is none.
    errors : dict
        Name -> relative error that the program states; None where it states none.
    status : str
        "ok", "over strength", or why there are numbers missing.
    """

    values: dict
    errors: dict
    status: str


def contents(path, *sets, case=None):
    """The mapping of a scene file with its base files and changes "KEY=VALUE" merged."""
    return dict(cs.load(str(path), set=sets, case=case).document.value)


def rows_of_study(path, most):
    """The mapping of the scene of each of the first rows of a study file: list."""
    study = read_study(str(path))
    return [dict(study.document_of(index).value) for index in range(min(study.count, most))]


def solve_all(scenes, names, estimate=False):
    """Columns of many scenes of one kind, solved together as the rows of a study: list of `Solved`.

    Parameters
    ----------
    scenes : sequence of (str, mapping, or loaded model)
    names : sequence of str
    estimate : bool
        Whether errors of fixed elements are to be stated, which costs a second, finer model.
    """
    models = [cs.load(scene).model if isinstance(scene, str | Mapping) else scene for scene in scenes]
    columns = [find(name) for name in names]
    rows = evaluate(models, columns, estimate)
    headers = dict(zip(names, (column.header for column in columns), strict=True))
    return [
        Solved(
            {name: row.cells[header] for name, header in headers.items()},
            {name: row.errors.get(header) for name, header in headers.items()},
            row.cells["status"],
        )
        for row in rows
    ]


def columns_with_keys(scene, columns):
    """Those columns of which a scene of one cable has the keys: list of str. It is read once."""
    model = cs.load(scene).model
    return [column for column in columns if not lacking_key(model, find(column))]


def solve(scene, *names, estimate=False):
    """Columns of one scene: `Solved`."""
    return solve_all([scene], names, estimate)[0]


def rows_as_alone(scenes, names):
    """Rows of scenes that are solved together, of which each has the digits that it has alone: list of `Solved`."""
    rows = solve_all(scenes, names)
    assert rows == [solve(scene, *names) for scene in scenes]
    return rows


def response(scene, pair, frequency, with_=None, modes=None):
    """Frequency response of the state space of a scene, derivatives of its inputs included, shape (f,).

    Parameters
    ----------
    scene : str or mapping
    pair : tuple of str
        Name of the input, and of the output.
    frequency : ndarray, shape (f,)
        [Hz]
    with_, modes
        See `cablestudy.Scene.state_space`.
    """
    system = cs.load(scene).state_space(with_=with_, modes=modes)
    input_, output = system.input_names.index(pair[0]), system.output_names.index(pair[1])
    return system.response(1j * TURN * np.asarray(frequency), derivatives=True)[:, output, input_]


def end_force(scene, end=2):
    """Force of the cable of a scene of one cable on what holds an end, along x, y, z, by the closed form. [N]

    Raises
    ------
    NoSolutionError, ConvergenceError
        The cable has no equilibrium.
    """
    return np.array(CableCase(cs.load({**scene, "model": {}}).model).form.end_forces("global")[end - 1])
