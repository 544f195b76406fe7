"""Campaigns: many scenes of one kind against a reference. `make test` runs a part of each, `make campaigns` all of it.

The part shows each kind of scene and each branch, and has every scene that once was wrong.
"""

import os

WHOLE = os.environ.get("CABLESTUDY_CAMPAIGNS") == "whole"


def campaign(whole, part):
    """Seeds or cases of a campaign, or how many examples are drawn of them.

    Parameters
    ----------
    whole, part : int or iterable
        For `make campaigns`, and for `make test`: fewer of them, and of cases some of the whole.

    Returns
    -------
    int or list
    """
    if isinstance(whole, int):
        assert 0 < part < whole
        return whole if WHOLE else part
    whole, part = list(whole), list(part)
    assert part
    assert len(part) < len(whole)
    assert all(case in whole for case in part)
    return whole if WHOLE else part
