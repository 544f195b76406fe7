"""The status of a row: `ok`, `over strength` and other doubts about an answer, or why cells are empty."""

from cablestudy.study.table import Field
from cablestudy.study.tolerances import STUDY

OK, OVER_STRENGTH, SLACK, FALLEN = "ok", "over strength", "a cable goes slack in the wind", "fallen"
DOUBTS = OVER_STRENGTH, SLACK, FALLEN  # of rows that have an answer
STATUS = Field("status", "status", unless="ok", text=True)  # in tables
# reason for which there is no number to an accuracy
MODAL = "modal damping grows with the number of modes: take hysteretic or kelvin_voigt, or fixed elements"


def status_of(failures, *doubts):
    """The text of a status.

    Parameters
    ----------
    failures : dict
        Header -> CablestudyError of a column without a value. Each reason is told once, and not by itself where
        another one contains it.
    *doubts : str
        Any of DOUBTS, followed by names where there are several cables or bodies; an empty one does not count. They
        come last, so that a status that begins with one has no other reason.
    """
    if not failures:
        return "; ".join(filter(None, doubts)) or OK
    reasons = list(dict.fromkeys(" ".join(str(error).split()) for error in failures.values()))
    reasons = [reason for reason in reasons if not any(reason in other for other in reasons if other != reason)]
    omitted = len(reasons) - STUDY.listed_reasons
    reasons[STUDY.listed_reasons :] = [f"and {omitted} more reasons"] if omitted > 0 else []
    return "; ".join([*reasons, *filter(None, doubts)])


def has_answer(status):
    """True if a row of this status is an answer: one with DOUBTS is."""
    return status == OK or status.startswith(DOUBTS)
