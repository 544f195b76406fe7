"""Limits of a scene: which columns they compare in which load cases, their margins, and the one that governs.

The margin of a limit is relative to its number b: (b - x)/|b| where x may be at most b, (x - b)/|b| where it must be at
least b; not negative where the limit holds. The governing limit is the one with the least margin.
"""

from contextlib import suppress
from dataclasses import dataclass

from pydantic_core import PydanticCustomError

from cablestudy.errors import Mistakes, SceneError
from cablestudy.scene.common_tables import REFERENCE, comparison, written_limits
from cablestudy.scene.mistakes import in_order
from cablestudy.scene.scene import read_scene
from cablestudy.study.columns import find
from cablestudy.study.goal import number_in_unit
from cablestudy.study.scene_kind import kind_of, why_not
from cablestudy.study.table import Field, Table
from cablestudy.study.table_rows import FALLEN
from cablestudy.study.tolerances import STUDY

OK, NOT_MET = "ok", "not met"


@dataclass(frozen=True)
class SceneLimit:
    """A limit of one scene."""

    name: str
    that: str  # the comparison as written
    sign: str  # one of < <= > >=
    bound: float  # in the unit of its columns
    terms: tuple  # of (str, str, Column): load case, cable or "", and the column that is compared there

    def margin(self, value):
        """Margin of a value, relative to the limit. [-]"""
        return (self.bound - value if "<" in self.sign else value - self.bound) / abs(self.bound)


@dataclass(frozen=True)
class Check:
    """Check of a limit in the load case, and at the cable, where its margin is least."""

    limit: SceneLimit
    case: str = ""  # the load case that governs
    cable: str = ""  # of a column of several cables
    value: float | None = None  # of the column there
    error: float | None = None  # estimated, relative
    failures: dict | None = None  # load case -> why there is no value in it
    undecided: tuple = ()  # of (str, str): load cases and cables where the limit lies within the value's stated error

    @property
    def margin(self):
        """Margin relative to the limit; None without a value. [-]"""
        return None if self.value is None else self.limit.margin(self.value)

    @property
    def margin_error(self):
        """Estimated error of the margin, relative to the margin; None where it is not known. [-]"""
        return self.error * abs(self.value / self.limit.bound / self.margin) if self.error and self.margin else None

    @property
    def governing(self):
        """Limit, load case and cable in words."""
        return self._at(self.case, self.cable)

    @property
    def warnings(self):
        """Tuple of lines: that the limit is not met, or that errors decide whether it is."""
        not_met = (f"{NOT_MET}: {self.governing}: {self.limit.that}",) if self.status == NOT_MET else ()
        return (*not_met, *self.doubts)

    @property
    def doubts(self):
        """Tuple of lines: that errors decide whether the limit is met."""
        reason = f"the stated error is larger than the margin: {self.limit.that}"
        return tuple(f"undecided: {self._at(*term)}: {reason}" for term in self.undecided)

    def _at(self, case, cable):
        """Limit, load case and cable in words."""
        return f"{self.limit.name} ({', '.join(filter(None, (case, cable)))})"

    @property
    def status(self):
        """OK, NOT_MET, or the load cases without an answer, and why."""
        holds = self.value is not None and (self.margin > 0 or ("=" in self.limit.sign and self.margin == 0))
        return unanswered([self]) or (OK if holds else NOT_MET)


# ------------------------------------------------------------------------------------------------- as the scene says


def limits_of(scene, document=None):
    """List of the `SceneLimit` of a scene.

    Raises
    ------
    SceneError
        All that it cannot have, at their places in its document where this is given.
    """
    limits, paths = [], {path[1]: path for path, _ in written_limits(document.value)} if document else {}
    with Mistakes() as mistakes:
        for name, table in scene.limits.items():
            path = paths.get(name, ("limits", name))
            with mistakes.at(document.where(path) if document else "", ".".join(path)):
                limits.append(_limit(scene, name, table))
    return limits


def scene_with_limits(document):
    """Read the scene of a `Document`, and check that it can have its limits: CableScene or SuspensionScene.

    Raises
    ------
    SceneError
        All that is wrong with it; where the scene itself is wrong, of its limits that their columns are unknown.
    """
    try:
        scene = read_scene(document)
    except SceneError as error:
        raise SceneError(*in_order((*error.mistakes, *_unknown_columns(document)))) from None
    limits_of(scene, document)
    return scene


def _unknown_columns(document):
    """Mistakes about limits as written whose column there is not: `Mistakes`."""
    mistakes = Mistakes()
    for path, text in written_limits(document.value):
        with suppress(PydanticCustomError):  # no comparison, which is reported with the scene
            column = comparison(text).column if isinstance(text, str) else ""
            with mistakes.at(document.where(path), ".".join(path)):
                if column:
                    find(column)
    return mistakes


def _limit(scene, name, table):
    """Read an entry of the table `limits` of a scene: `SceneLimit`.

    Its terms are the load cases that the entry names, by default all and the reference state, each with every cable
    that has the column. A term is left out if the scene cannot have the column in this case, or if the case has lost
    the cable.

    Parameters
    ----------
    scene : CableScene or SuspensionScene
    name : str
        Name of the limit.
    table : LimitTable
        The entry as read.

    Raises
    ------
    ValueError
        The column is no result; its number is zero or has another unit; or the scene cannot have the column in a load
        case that the entry names or, if it names none, in any load case.
    """
    stated = comparison(table.that)
    # (cable, column of this cable); of a column that belongs to no cable one pair, with "" for the cable
    pairs = kind_of(scene).of_each_cable(scene, stated.column) or [("", find(stated.column))]
    column = pairs[0][1]
    if column.text or column.needs in ("run", "limits") or column.name == "iterations":
        raise ValueError(f"{column.name} is no result that a limit could hold for")
    bound = number_in_unit(stated.number, column, lambda: scene)
    if abs(bound) < STUDY.least_limit:
        raise ValueError(f"a margin is relative to the limit, which must not be 0: {table.that}")
    terms, refusals = [], []
    for case in table.cases or (*scene.cases, *({REFERENCE} - scene.cases.keys())):
        of_case, refusal = _terms_in(case, scene, pairs)
        terms += of_case
        if refusal:
            refusals.append(f"{refusal} (load case {case})" if table.cases else refusal)
    if refusals and (table.cases or not terms):
        raise ValueError(refusals[0])
    return SceneLimit(name, table.that, stated.sign, bound, tuple(terms))


def _terms_in(case, scene, pairs):
    """Terms of a `SceneLimit` in one load case, and why none of its columns can be had there, empty if one can.

    `pairs` has each cable, or "", and its column.
    """
    scene_in_case = scene.in_case(case)
    reasons = [why_not(scene_in_case, column) for _, column in pairs]
    lost = getattr(scene_in_case.load_case, "lost", ())  # cables without values that limits could bound
    terms = [
        (case, cable, column)
        for (cable, column), reason in zip(pairs, reasons, strict=True)
        if not reason and cable not in lost
    ]
    return terms, reasons[0] if all(reasons) else ""


# ------------------------------------------------------------------------------------------------------- the answers


def columns_by_case(limits, is_cheap):
    """Load case -> header -> `Column`, of all that some `SceneLimit` compare: dict of dict.

    Columns that cost almost nothing (`is_cheap`) are in all load cases alike, so that these are solved together.
    """
    terms, columns = [term for limit in limits for term in limit.terms], {}
    everywhere = {c.header: c for _, _, c in terms if is_cheap(c) and "load_case" not in c.key}
    for case, _, column in terms:
        columns.setdefault(case, dict(everywhere))[column.header] = column
    return columns


def least_margin(limit, rows):
    """The `Check` of a `SceneLimit`, from a dict of load case -> `Row` with its columns."""
    least, failures, values = None, {}, []
    for case, cable, column in limit.terms:
        row, name = rows[case], column.header
        value, status = row.cells[name], row.cells["status"]
        if value is None or FALLEN in status:
            failures.setdefault(case, status if row.failed or FALLEN in status else f"{column.name} has no value")
            continue
        values.append((case, cable, value, row.errors.get(name)))
        if least is None or limit.margin(value) < limit.margin(least[2]):
            least = values[-1]
    return Check(limit, *(least or ()), failures=failures, undecided=_undecided(limit, values))


def _undecided(limit, values):
    """Load cases and cables where the stated error decides whether a `SceneLimit` holds: tuple of (str, str).

    `values` has tuples of load case, cable, value and relative error, which may be None. None is undecided where the
    limit is exceeded somewhere by more than the error.
    """
    margins = [(limit.margin(x), (error or 0) * abs(x / limit.bound)) for _, _, x, error in values]
    if any(margin < -error for margin, error in margins):
        return ()
    decided = [abs(margin) >= error for margin, error in margins]
    return tuple(value[:2] for value, is_decided in zip(values, decided, strict=True) if not is_decided)


def unanswered(checks):
    """Text on load cases without an answer, and why, in one line; empty where all have one."""
    reasons = {case: reason for check in checks for case, reason in check.failures.items()}
    return "; ".join(f"no answer in {case}: {reason}" for case, reason in reasons.items())


def limits_table(checks):
    """`Table` of checks, a row for each limit."""
    names = ("name", "that", "case", "cable", "value", "limit", "unit", "margin", "status")
    rows, errors = [], []
    for check in checks:
        limit, unit = check.limit, check.limit.terms[0][2].unit
        cells = limit.name, limit.that, check.case, check.cable
        rows.append(dict(zip(names, (*cells, check.value, limit.bound, unit, check.margin, check.status), strict=True)))
        known_errors = {"value": check.error, "margin": check.margin_error}
        errors.append({name: error for name, error in known_errors.items() if error is not None})
    shown_names = [name for name in names if name not in ("cable", "unit") or any(row[name] for row in rows)]
    fields = tuple(Field(name, name, label=name == "name") for name in shown_names)
    return Table(fields, rows, errors=lambda: iter(errors))
