"""Reference values of the command `trade`: those of the continuous cable.

Statics and end stiffness have a closed form. For everything that moves, elements of high order about that closed form
are refined until the values of two successive levels agree.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

from cablestudy.errors import CablestudyError, ConvergenceError
from cablestudy.study import windrms
from cablestudy.study.case import Case
from cablestudy.study.column_requirements import DISCRETE
from cablestudy.study.columns import ROUNDING
from cablestudy.study.row import MODAL
from cablestudy.study.trade_models import OPEN, integrate_by, read, with_accuracy

LEVELS = ((1, 16), (1, 24), (1, 32), (1, 48), (2, 48), (4, 48), (8, 48), (16, 48))  # elements a segment, order
AGREED = 1e-12  # relative difference of two levels at which a value is not refined further
ROUNDED = 1e-8  # a difference that grows again from below this is rounding
NO_REFERENCE = 1e-3  # smallest relative difference of two levels above which there is no reference
INTEGRATION_TOLERANCES = (1e-10, 1e-9, 1e-8, 1e-7, 1e-6)  # of the RMS integrals: the first that converges is taken


@dataclass(frozen=True)
class Reference:
    """Values of the continuous cable; each dict has the names of columns as keys.

    Attributes
    ----------
    values : dict
        Number.
    errors : dict
        Its estimated relative error. [-]
    notes : dict
        How it was computed.
    failures : dict
        Why there is none.
    """

    values: dict = field(default_factory=dict)
    errors: dict = field(default_factory=dict)
    notes: dict = field(default_factory=dict)
    failures: dict = field(default_factory=dict)

    def add(self, name, value, error, note):
        """Store the value of a column."""
        self.values[name], self.errors[name], self.notes[name] = value, error, note


class _Step(NamedTuple):
    """A value on one level of refinement: its relative difference from the level before, and its estimated error."""

    difference: float
    value: float
    error: float
    note: str


def reference_of(scene, columns):
    """Reference values of some columns.

    Parameters
    ----------
    scene : Scene
    columns : sequence of Column

    Returns
    -------
    Reference
    """
    case = Case(with_accuracy(scene, AGREED))
    reasons = {column.name: why_no_reference(scene, column) for column in columns}
    reference = Reference(failures={name: reason for name, reason in reasons.items() if reason})
    columns = [column for column in columns if not reasons[column.name]]
    values, failures = read(case, [column for column in columns if column.needs not in DISCRETE])
    reference.failures.update(failures)
    for name, value in values.items():
        reference.add(name, value, ROUNDING, "closed form")
    columns = [column for column in columns if column.needs in DISCRETE]
    steps, failures = _refine(case, columns)
    for name, found in steps.items():
        best = min(found, default=None)
        if best and best.difference <= NO_REFERENCE:
            reference.add(name, best.value, best.error, best.note)
        else:
            reason = f"the finest models differ by {best.difference:.1e}" if best else failures.get(name, "none")
            reference.failures[name] = f"no reference: {reason}"
    return reference


def why_no_reference(scene, column):
    """Why a column has no value for the continuous cable, or an empty text."""
    modal = column.needs in ("loop", "wind") and scene.cable.damping.model == "modal"
    return MODAL.partition(", or fixed")[0] if modal else ""


def _refine(case, columns):
    """Refine the model until each column has converged: name -> list of _Step, and the failures of the last level."""
    steps, before, failures = {column.name: [] for column in columns}, {}, {}
    for level in LEVELS:
        active = [column for column in columns if not _converged(steps[column.name])]
        if not active:
            break
        values, failures, integration_error = _on_level(case, level, active)
        for column in active:
            name = column.name
            if name in values and name in before:
                difference = max(relative_error(values[name], before[name]), ROUNDING)
                error = max(difference, integration_error if column.needs == "wind" else 0.0)
                note = f"{level[0]} x order {level[1]} about the closed form"
                steps[name].append(_Step(difference, values[name], error, note))
        before = values
    return steps, failures


def _converged(steps):
    """Whether two levels agree, or finer levels would only add rounding."""
    if not steps:
        return False
    last, least = steps[-1].difference, min(steps).difference
    return last <= AGREED or least < min(last, ROUNDED)


def _on_level(case, level, columns):
    """Values and failures of one refinement, and the relative error of its RMS integrals."""
    finer = case.refined(*level)
    tolerance = windrms.TOLERANCE
    if any(column.needs == "wind" for column in columns):
        tolerance = _integrate(finer, columns)
    return *read(finer, columns), tolerance / 2  # an RMS is the square root of an integral


def _integrate(case, columns):
    """Integrate the response as accurately as converges; the tolerance that was reached."""
    for tolerance in INTEGRATION_TOLERANCES:
        try:
            integrate_by(case, columns, lambda c, loop, t=tolerance: windrms.response_of(c, loop, t))
        except ConvergenceError:
            continue
        except CablestudyError:  # an unstable loop, which `read` will report
            at_rest = [column for column in columns if OPEN in column.name]
            return _integrate(case, at_rest) if len(at_rest) < len(columns) else windrms.TOLERANCE
        return tolerance
    return windrms.TOLERANCE


def relative_error(value, truth):
    """Error relative to the truth; where that is zero or None, 0 for the same value and 1 for any other. [-]"""
    if value is None or truth is None or truth == 0:
        return float(value != truth)
    return abs(value - truth) / abs(truth)
