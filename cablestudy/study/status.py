"""The status of a row: `ok`, `over strength`, or why cells are empty."""

OK, OVER_STRENGTH = "ok", "over strength"
MAX_REASONS = 3  # in a status


def status_of(failures, over_strength=""):
    """The text of a status.

    Parameters
    ----------
    failures : dict
        Header -> CablestudyError of a column that cannot be had. Each reason is told once.
    over_strength : str
        OVER_STRENGTH, followed by names where there are several cables; empty where no stress is above the strength. It
        comes last, so that a status that begins with it has no other reason.
    """
    reasons = list(dict.fromkeys(" ".join(str(error).split()) for error in failures.values()))
    more = len(reasons) - MAX_REASONS
    reasons[MAX_REASONS:] = [f"and {more} more reasons"] if more > 0 else []
    return "; ".join([*reasons, over_strength] if over_strength else reasons) or OK


def has_answer(status):
    """Whether a row of this status is an answer: a stress above the strength is one."""
    return status == OK or status.startswith(OVER_STRENGTH)
