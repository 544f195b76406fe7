"""What a study that grew can use of the rows of its earlier run."""

import json

from cablestudy.errors import SceneError
from cablestudy.study.columns import find
from cablestudy.sweep.chunk import key_of, line_of, summed
from cablestudy.sweep.journal import LINE
from cablestudy.sweep.opening import batched

# a closed form: its digits do not depend on which other columns are computed
ALONE = ("scene", "statics", "stiffness")


def usable(old, new):
    """Columns whose stored values are those that the new run would compute.

    The model of the motion is refined until all columns that need it agree: their values belong together. What a row
    says about its own computing (dof, error estimate) belongs to all of its columns.

    Parameters
    ----------
    old, new : sequence of str
        Headers.

    Returns
    -------
    frozenset of str
        Without `status`; empty when a row is to be computed as a whole.
    """
    before, wanted = ({name: find(name).needs for name in names if name != "status"} for names in (old, new))
    if before == wanted:
        return frozenset(wanted)
    if "run" in wanted.values():
        return frozenset()
    moving = [{name for name, needs in columns.items() if needs not in ALONE} for columns in (before, wanted)]
    common = before.keys() & wanted.keys()
    return frozenset(name for name in common if wanted[name] in ALONE or moving[0] == moving[1])


def take_over(study, cases):
    """The function that fills the journal of a grown study from its earlier one.

    Parameters
    ----------
    study : Study
    cases : sequence of int
        Those of this run.

    Returns
    -------
    callable
        (old journal, new journal) -> None.
    """

    def take(old, new):
        for lines in batched(_lines(study, cases, old, new.identity["columns"])):
            new.extend(b"".join(lines))

    return take


def _lines(study, cases, old, wanted):
    """Yield what an earlier run has for the cases: whole rows, or parts of them."""
    before = old.identity["columns"]
    names = usable(before, wanted)
    same = set(before) - {"status"} == set(wanted) - {"status"}
    complete = names >= set(wanted) - {"status"}
    known = old.keys() if names else {}
    for case in cases if known else ():
        line = _line_of(study, case, known, old)
        if line is not None and same:
            yield summed("row", case, LINE.match(line)[5])
        elif line is not None:
            yield from _shortened(case, line, names, complete)


def _line_of(study, case, known, old):
    """The line that an earlier run has for a case, or None."""
    try:
        key = key_of(study.case(case)[1]).encode()
    except SceneError:
        return None
    if key not in known:
        return None
    return old.line_at(known[key])


def _shortened(case, line, names, complete):
    """List of the line with some of its columns; empty of a row without an answer, which another column may lack."""
    content = json.loads(line)
    if content["cells"]["status"] != "ok":
        return []
    cells = {name: content["cells"][name] for name in names}
    if complete:
        cells["status"] = "ok"
    return [
        line_of(
            case,
            content["key"],
            cells,
            content.get("notes", ()),
            "row" if complete else "part",
            content.get("errors", {}),
        )
    ]
