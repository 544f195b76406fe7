"""Models that `trade` compares of one cable and of suspensions alike: error control, bars, elements of high order."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from cablestudy.errors import CablestudyError, NoSolutionError
from cablestudy.study.column import DISCRETE, least_work_first, value_and_error
from cablestudy.study.refinement import with_accuracy
from cablestudy.study.table_rows import Row

LEVELS = ((1, 16), (1, 24), (1, 32), (1, 48), (2, 48), (4, 48), (8, 48), (16, 48))  # elements a segment, order
BARS = (5, 10, 20, 40, 80, 160, 320, 640)
MASSES = ("lumped", "consistent", "blended")
ORDERS = (8, 12, 16, 24, 32)  # of one element a segment
SEVERAL = ((2, 8), (4, 8), (2, 16), (4, 16))  # elements a segment, order
ACCURACIES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)


@dataclass(frozen=True)
class ComparedModel:
    """Numerical model that a user can choose for a scene, and whose error and time the command `trade` measures.

    Models of one `family`, such as bars with lumped masses, differ in one number only, such as the number of bars.
    """

    family: str
    name: str
    build: Callable  # scene, columns -> CableCase or SuspensionCase, with nothing cached
    needs: tuple = ("statics", "stiffness", *DISCRETE)  # kinds of columns whose values depend on the model
    # column, case -> number, and the relative error that the model states of it: None or NaN without one
    compute: Callable = value_and_error
    count_dof: Callable = lambda case: case.size  # case -> number of free displacements

    def solve(self, scene, columns):
        """`Row` of the columns of a scene by this model; its case is None where the model cannot be built.

        Parameters
        ----------
        scene : CableScene or SuspensionScene
        columns : sequence of Column
        """
        row = Row(None)
        try:
            row.case = self.build(scene, columns)
        except CablestudyError as failure:
            row.fail(columns, failure)
        for column in least_work_first(columns):
            row.compute(column, self.compute)
        return row


def static_value(column, case):
    """A number of the statics, and its error; NoSolutionError for other columns."""
    if column.needs in DISCRETE:
        raise NoSolutionError("statics alone")
    return value_and_error(column, case)


def controlled_models(case_of, needs):
    """Models whose elements are refined until an accuracy is reached, one for each of ACCURACIES.

    Parameters
    ----------
    case_of : callable
        Scene, columns -> CableCase or SuspensionCase.
    needs : tuple of str
        Kinds of columns whose values depend on the accuracy.

    Returns
    -------
    list of ComparedModel
    """

    def build(accuracy, scene, columns):
        return case_of(with_accuracy(scene, accuracy), columns)

    return [ComparedModel("error control", f"accuracy {power(accuracy)}", partial(build, accuracy), needs)
            for accuracy in ACCURACIES]  # fmt: skip


def element_models(build, fits=lambda segments: True, **options):
    """Models with fixed elements, bars and of high order, as far as `fits` has room for elements times order: list.

    `build` makes a case of elements (of high order those of each segment), order, mass, scene and columns; `options`
    are further attributes of each `ComparedModel`.
    """
    kinds = [(f"{mass} bars", f"{n} {mass} bars", n, 1, mass) for mass in MASSES for n in BARS]
    for n, order in [(1, order) for order in ORDERS] + list(SEVERAL):
        family = "high order" if n == 1 else "several of high order"
        kinds.append((family, f"{n} x order {order}", n, order, "lumped"))
    return [ComparedModel(family, name, partial(build, n, order, mass), **options)
            for family, name, n, order, mass in kinds if fits(n * order)]  # fmt: skip


def power(number):
    """A power of ten as in `1e-4`."""
    return f"{number:.0e}".replace("e-0", "e-")
