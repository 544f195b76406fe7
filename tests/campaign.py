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


def deselected(items):
    """Tests that are left out of `make test`: those of the marker `crossed`, but for a diagonal of their parameters.

    Case number i of the diagonal has value number i of each parameter, counted around: each value is in one at least.

    Parameters
    ----------
    items : sequence of pytest.Function

    Returns
    -------
    list of pytest.Function
    """
    if WHOLE:
        return []
    crossed = {}
    for item in items:
        if item.get_closest_marker("crossed"):
            crossed.setdefault((item.module, item.originalname), []).append(item)
    return [item for cases in crossed.values() for item in _off_the_diagonal(cases)]


def _off_the_diagonal(items):
    """Those of the cases of one test that are not on the diagonal."""
    names = [mark.args[0] for mark in items[0].iter_markers("parametrize")]
    names = [name.split(",") if isinstance(name, str) else name for name in names]
    # values of one `parametrize` are the same objects in all cases
    cases = [[tuple(id(item.callspec.params[name.strip()]) for name in own) for own in names] for item in items]
    axes = [list(dict.fromkeys(axis)) for axis in zip(*cases, strict=True)]
    diagonal = [[axis[row % len(axis)] for axis in axes] for row in range(max(map(len, axes)))]
    return [item for item, case in zip(items, cases, strict=True) if case not in diagonal]
