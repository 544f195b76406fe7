"""Stages that columns need, and the columns of statics of many cases at once: in closed form, and by elements."""

from dataclasses import dataclass, field

import numpy as np

from cablestudy.errors import CablestudyError
from cablestudy.study.columns import DAMPING_RATIO, is_own, not_finite, over_strength, shapeless
from cablestudy.study.element_results import element_results
from cablestudy.study.results import Results
from cablestudy.study.status import OK, OVER_STRENGTH, status_of
from cablestudy.study.tolerances import STUDY

CLOSED = ("scene", "statics", "stiffness")
SYSTEM = ("gondola", "loop", "wind")  # of gondola and cable as one linear system, which states its own errors
DISCRETE = ("modes", *SYSTEM)


class ColumnRequirements:
    """Columns by what they need, found once for all rows of a table.

    Attributes
    ----------
    physical, closed, single, system, modes : list of Column
        All but those that describe the computation; of these the closed forms of many cases at once, the closed forms
        computed case by case, those of gondola and cable as one system, and the frequencies of the cable's own modes.
    """

    def __init__(self, columns):
        self.physical = [column for column in columns if column.needs != "run"]
        closed = _needing(self.physical, *CLOSED)
        self.closed = [column for column in closed if not column.each]
        self.single = [column for column in closed if column.each]
        self.system = _needing(self.physical, *SYSTEM)
        self.modes = _needing(self.physical, "modes")
        # headers of the physical ones that need more than the scene; whether there are none
        self.of_equilibrium = [column.header for column in self.physical if column.needs != "scene"]
        self.scene_only = not self.of_equilibrium
        # whether any is of the gondola's mode, and its damping ratio; of the loop or the wind; of the wind
        self.gondola = bool(_needing(self.system, "gondola"))
        self.damped = any(column.name == DAMPING_RATIO for column in self.system)
        self.in_wind = bool(_needing(self.system, "wind"))
        self.driven = self.in_wind or bool(_needing(self.system, "loop"))
        # header -> relative error of a closed form, by rounding; header of every column -> None
        self.least_errors = {c.header: c.least_error for c in self.physical if c.least_error is not None}
        self.empty = {column.header: None for column in columns}
        # whether errors, the time, or anything else that describes the computation are columns
        names = {column.name for column in columns if column.needs == "run"}
        self.estimate, self.clock, self.run = "error_estimate" in names, "solve_time" in names, bool(names - {"status"})
        # most half-waves that the modes have along a taut cable, and those in the plane of a sagging one, where a mode
        # has up to two more; largest number of an axial mode; 0 without modes
        self._planes = _by_plane(self.modes)
        self.waves = max(map(_half_waves, self.modes), default=0)
        self.sagging_waves = max((_half_waves(c) + (2 if c.mode[2] else 1) for c in self._planes[0]), default=0)
        self.axial = max((column.mode[0] for column in self.modes if column.mode[1] == "axial"), default=0)

    @property
    def of_models(self):
        """True if there is any that a closed form of many cases does not give."""
        return bool(self.modes or self.single or self.system)

    def sample(self, case, refused=()):
        """Frequencies of modes at one level of refinement, without those of `refused` headers.

        Returns
        -------
        values, errors, failures : dict
            Header -> number [Hz]; header -> estimated relative error, which a single model gives; header ->
            CablestudyError of a column without a value.
        """
        return _frequencies(case, _by_plane([column for column in self.modes if column.header not in refused]))


def _frequencies(case, planes):
    """As `ColumnRequirements.sample`, of columns of modes by plane: in one call, or one by one where one is missing."""
    columns = planes[0] + planes[1]
    if not columns:
        return {}, {}, {}
    try:
        found, errors = case.frequencies(tuple(tuple([column.mode for column in plane]) for plane in planes))
    except CablestudyError as error:
        if len(columns) == 1:
            return {}, {}, {columns[0].header: error}
        parts = [_frequencies(case, _by_plane([column])) for column in columns]
        return tuple({header: entry for part in parts for header, entry in part[k].items()} for k in range(3))
    headers = [column.header for column in columns]
    return dict(zip(headers, found, strict=True)), dict(zip(headers, errors, strict=True)), {}


def _by_plane(columns):
    """Columns of modes in the plane, and of those out of plane: two lists."""
    across = [column for column in columns if column.mode[1] == "out-of-plane"]
    return [column for column in columns if column not in across], across


def _half_waves(column):
    """Half-waves of a mode along a taut cable. [-]"""
    number, _, symmetry = column.mode
    return 2 * number - 1 if symmetry else number


def _needing(columns, *needs):
    return [column for column in columns if column.needs in needs]


@dataclass(frozen=True)
class ClosedForm:
    """Values of closed-form columns with an axis of cases."""

    count: int  # of cases, n
    numbers: dict  # header -> ndarray of shape (n,)
    failures: dict = field(default_factory=dict)  # case -> {header: CablestudyError} of a column without a value
    over_strength: frozenset = frozenset()  # cases whose stress is above the strength
    errors: dict = field(default_factory=dict)  # case -> {header: relative error}, where it exceeds `rounding`
    least_errors: dict = field(default_factory=dict)  # header -> estimated relative error of all other cases

    def cells(self):
        """List of dict: header -> number of each case, None where there is none."""
        if not self.numbers:
            return [{} for _ in range(self.count)]
        rows = zip(*(numbers.tolist() for numbers in self.numbers.values()), strict=True)
        cells = [dict(zip(self.numbers, row, strict=True)) for row in rows]
        for case, failed in self.failures.items():
            cells[case].update((header, None) for header in failed if header in cells[case])
        return cells

    def errors_of(self, case):
        """Header -> estimated relative error, of one case."""
        return self.errors.get(case, self.least_errors)

    def status(self, case):
        """Status of one case."""
        if case not in self.failures and case not in self.over_strength:
            return OK
        return status_of(self.failures.get(case, {}), OVER_STRENGTH if case in self.over_strength else "")


def closed_form(results, required):
    """`ClosedForm` of the cases of `Results`."""
    numbers, failures, over = {}, _refused(results, required), frozenset()
    if not required.scene_only:
        over = frozenset(np.flatnonzero(over_strength(results)).tolist()) - results.failures.keys()
    for column in required.closed:
        numbers[column.header] = _compute(column, results)
        if column.determined_by:
            for case in np.flatnonzero(results.catenary.slack).tolist():
                _fail(failures, case, column.header, shapeless(column, results.limp[case]))
        _refuse_infinite(failures, column, numbers[column.header], results.failures if column.name == "chord" else {})
    errors = {} if required.scene_only else _coarse_errors(results, required)
    return ClosedForm(len(results.values), numbers, failures, over, errors, required.least_errors)


def by_elements(results, required, closed):
    """Statics of the elements of each case in the place of a `ClosedForm`, which states their errors.

    Returns
    -------
    ClosedForm
    list of (ndarray of int, ElementResults)
        Cases on equal meshes, and their elements.
    """
    columns = [column for column in required.closed if column.needs != "scene"]
    numbers = {name: np.array(number) for name, number in closed.numbers.items()}
    failures, over = _refused(results, required), set()
    for column in required.closed:
        for case, error in _of_column(closed.failures, column).items() if column.needs == "scene" else ():
            _fail(failures, case, column.header, error)
    found, without = element_results(results)
    for case, error in without.items():
        for header in required.of_equilibrium:
            _fail(failures, case, header, error)
    for places, elements in found:
        over.update(places[over_strength(elements)].tolist())
        for column in columns:
            own = _compute(column, elements)
            numbers[column.header][places] = own
            _refuse_infinite(failures, column, own, {}, places)
    errors = _against_closed_form(columns, numbers, failures, closed)
    scene = {column.header: 0.0 for column in required.physical if column.needs == "scene"}
    errors = {case: scene | {name: errors[name][case] for name in errors} for case in range(closed.count)}
    return ClosedForm(closed.count, numbers, failures, frozenset(over), errors, scene), found


def _against_closed_form(columns, numbers, failures, closed):
    """Header -> relative errors of the cases against the closed form, None where this has no number: dict of list."""
    found = {}
    for column in columns:
        if column.least_error is None:
            continue
        name = column.header
        value, truth = (np.asarray(part, dtype=float) for part in (numbers[name], closed.numbers[name]))
        size = np.abs(truth)
        with np.errstate(invalid="ignore"):  # of cases without a number
            error = np.where(size > 0, np.abs(value - truth) / np.where(size > 0, size, 1.0), 1.0 * (value != truth))
        found[name] = error.tolist()
        for case in _of_column(closed.failures, column):
            found[name][case] = None
    return found


def _refused(results, required):
    """Case -> {header: CablestudyError} of cases without an equilibrium, or without a key that a column needs."""
    failures = {}
    if not required.scene_only:
        for case, error in results.failures.items():
            for header in required.of_equilibrium:
                _fail(failures, case, header, error)
    for column in required.physical:
        for case, error in results.values.lacking(column).items():
            _fail(failures, case, column.header, error)
    return failures


def _compute(column, results):
    """Numbers of a column, shape (n,); no minus before a zero."""
    number = np.asarray(column.compute(results))
    return number + 0.0 if number.dtype.kind == "f" else number


def _refuse_infinite(failures, column, number, unsolved, places=None):
    """Let the cases fail whose number is not finite; `unsolved` has other reasons for some, `places` their indices."""
    for place in np.flatnonzero(~np.isfinite(number)).tolist():
        case = place if places is None else int(places[place])
        _fail(failures, case, column.header, unsolved.get(case) or not_finite(column))


def _fail(failures, case, header, error):
    failures.setdefault(case, {}).setdefault(header, error)


def _of_column(failures, column):
    """Case -> CablestudyError of a column."""
    return {case: own[column.header] for case, own in failures.items() if column.header in own}


def _coarse_errors(results, required):
    """Case -> {header: estimated relative error}, where rounding exceeds `rounding`."""
    statics = np.maximum(results.statics_rounding, results.model_error)
    sags = [column.header for column in required.closed if column.determined_by == "sag"]
    sag = np.maximum(results.sag_rounding, results.sag_drag_error) if sags else np.zeros(len(statics))
    pushed = [column.header for column in required.closed if column.name == "force_displacement"]
    push = results.pushed[1] if pushed else np.zeros(len(statics))
    errors = {}
    for case in np.flatnonzero(np.maximum(np.maximum(statics, sag), push) > STUDY.rounding).tolist():
        own = {
            name: max(least, float(statics[case]) if least else 0.0) for name, least in required.least_errors.items()
        }
        own.update((name, max(own[name], float(sag[case]))) for name in sags)
        own.update((name, max(own[name], float(push[case]))) for name in pushed)
        errors[case] = own
    return errors


def evaluate_table(table, columns):
    """Columns of statics of the cases of a `CaseTable`, without an object for each case.

    Returns
    -------
    list of tuple, or None
        Of each case: list of numbers in the order of the columns but `status`, None where there is none; status;
        dict of header -> estimated relative error where it exceeds `rounding` or, None, is not known. None where a
        column is computed case by case.
    """
    if not all(map(is_own, columns)) or table.scene.cable.stress_strain is not None:
        return None
    required = ColumnRequirements(columns)
    if required.run or len(required.closed) < len(required.physical):
        return None
    results = Results(table)
    closed = closed_form(results, required)
    if table.scene.model.elements is not None and not required.scene_only:
        closed, _ = by_elements(results, required, closed)
    numbers = list(map(list, zip(*(closed.numbers[column.header].tolist() for column in required.closed), strict=True)))
    rows = [(cells, OK, {}) for cells in numbers] or [([], OK, {}) for _ in table.cases]
    for case, errors in closed.errors.items():
        unsure = {name: error for name, error in errors.items() if error is None or error > STUDY.rounding}
        rows[case] = rows[case][0], OK, unsure
    for case in closed.over_strength:
        rows[case] = rows[case][0], OVER_STRENGTH, rows[case][2]
    for case, failures in closed.failures.items():
        rows[case] = _without(failures, required.closed, rows[case], closed.status(case))
    return rows


def _without(failures, columns, row, status):
    """A row of `evaluate_table` without the numbers of the columns that failed, with its status."""
    cells, _, errors = row
    cells = [None if column.header in failures else cell for column, cell in zip(columns, cells, strict=True)]
    return cells, status, {name: error for name, error in errors.items() if name not in failures}
