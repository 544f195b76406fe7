"""The status of a row: `ok`, `over strength` and other doubts about an answer, or why cells are empty."""

from cablestudy.study.tolerances import STUDY

OK, OVER_STRENGTH, SLACK, FALLEN = "ok", "over strength", "a cable goes slack in the wind", "fallen"
DOUBTS = OVER_STRENGTH, SLACK, FALLEN  # what a status says of an answer
# why there is no number to an accuracy
MODAL = "modal damping grows with the number of modes: take hysteretic or kelvin_voigt, or fixed elements"


def status_of(failures, *doubts):
    """The text of a status.

    Parameters
    ----------
    failures : dict
        Header -> CablestudyError of a column that cannot be had. Each reason is told once, and
        not by itself where another one contains it.
    *doubts : str
        Any of DOUBTS, followed by names where there are several cables or bodies; an empty one does not count. They
        come last, so that a status that begins with one has no other reason.
    """
    reasons = list(dict.fromkeys(" ".join(str(error).split()) for error in failures.values()))
    reasons = [one for one in reasons if not any(one in other for other in reasons if other != one)]
    more = len(reasons) - STUDY.listed_reasons
    reasons[STUDY.listed_reasons :] = [f"and {more} more reasons"] if more > 0 else []
    return "; ".join([*reasons, *filter(None, doubts)]) or OK


def has_answer(status):
    """True if a row of this status is an answer: one with DOUBTS is."""
    return status == OK or status.startswith(DOUBTS)
