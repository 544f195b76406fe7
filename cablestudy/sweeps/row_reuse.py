"""Rows of an earlier run that an edited study uses again: with more cases, fewer, in another order, other columns."""

from cablestudy.study.all_columns import find_header
from cablestudy.study.scene_values import tables_of
from cablestudy.study.status import OK
from cablestudy.sweeps.chunks import MAX_CASES, keys_of
from cablestudy.sweeps.record import pack, unpack

# columns in closed form: their digits do not depend on which other columns are computed
CLOSED_FORM = ("scene", "statics", "stiffness")


def usable(old, new):
    """Columns whose stored values a run with other columns can use again, since it would compute the same digits.

    Closed forms do not depend on the other columns. The model of the motion is refined until all columns that need it
    are accurate, so their values are used again only if both runs have the same such columns. A column on the
    computation itself (dof, error estimate) depends on all columns of the row: where the new run has such a column, and
    not exactly the stored columns, no value is used again.

    Parameters
    ----------
    old, new : sequence of str
        Headers of the columns that are stored, and of those that the run is to have.

    Returns
    -------
    frozenset of str
        Headers, without `status`; empty if whole rows must be computed.
    """
    stored, asked = ({name: find_header(name).needs for name in names if name != "status"} for names in (old, new))
    if stored == asked:
        return frozenset(asked)
    if "run" in asked.values():
        return frozenset()
    same_motion = _columns_of_motion(stored) == _columns_of_motion(asked)
    common = stored.keys() & asked.keys()
    return frozenset(name for name in common if asked[name] in CLOSED_FORM or same_motion)


def _columns_of_motion(needs_of):
    """Set of the columns, from a mapping of name -> what it needs, that need a model of the motion."""
    return {name for name, needs in needs_of.items() if needs not in CLOSED_FORM}


def reuse_rows(store, study, cases, identity):
    """Give a store with the rows of an earlier run those cases (from 0) of the edited study that are the same."""
    headers = [header for header in identity["columns"] if header != "status"]
    reusable = usable(store.headers, headers)
    partial = [header for header in headers if header in reusable] if not reusable.issuperset(headers) else []
    records = _reusable_records(store, study, cases, headers, reusable) if reusable else ()
    store.replace(identity, partial, records)


def _reusable_records(store, study, cases, headers, reusable):
    """Yield records, from `record.pack`, of the cases of a study whose scenes the store of an earlier run has.

    They have cells of the headers; those that are not reusable stay empty, and the record is partial.
    """
    old_headers = store.headers
    same_columns, complete = set(old_headers) == set(headers), reusable.issuperset(headers)
    for case, stored in _stored_rows_of(store, study, cases):
        row = unpack(stored, old_headers)
        if row.status != OK and not same_columns:  # another column may be the reason of its status
            continue
        cell_of = {header: cell for header, cell in zip(old_headers, row.cells, strict=True) if header in reusable}
        cells = [cell_of.get(header) for header in headers]
        yield pack(case, row.key, row.status if complete else None, cells, row.errors, row.notes)


def _stored_rows_of(store, study, cases):
    """Yield (case, stored row) where a complete row has the key of the scene of a case."""
    store.database.execute("CREATE TEMP TABLE cases (row INTEGER PRIMARY KEY, key TEXT)")
    store.database.execute_many("INSERT INTO cases VALUES (?, ?)", _keys(study, cases))
    joined = store.database.execute(
        "SELECT cases.row, rows.row, rows.key, status, cells, errors, notes, sum FROM cases JOIN rows USING (key)"
        " WHERE status IS NOT NULL"
    )
    for row, *stored in joined:
        yield row - 1, stored
    store.database.execute("DROP TABLE cases")


def _keys(study, cases):
    """Yield row, from 1, and key of each case with a valid scene."""
    for first in range(0, len(cases), MAX_CASES):
        tables, _ = tables_of(study, cases[first : first + MAX_CASES])
        for table in tables:
            yield from zip((table.cases + 1).tolist(), keys_of(table, study.find), strict=True)
