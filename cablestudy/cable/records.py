"""Records: dataclasses of arrays, or of floats, of which parts, copies and stacks are made of all arrays at once.

Arrays may also stand in lists, tuples and records that are fields of a record. Whatever else is a field, such as names,
or None in place of an array, stays as it is.
"""

from dataclasses import fields, is_dataclass
from functools import cache
from operator import attrgetter

import numpy as np


def with_arrays(record, change):
    """Copy of a record with each of its arrays replaced by `change` of it, a function."""
    return _made_of([record], lambda values: change(values[0]))


def take_rows(record, index):
    """The cases at `index` of a record, the first axes of whose arrays are the cases."""
    return _made_of([record], lambda values: values[0][index])


def copy_record(record):
    """Copy of a record, whose arrays can be written to."""
    return with_arrays(record, np.array)


def stack(records):
    """Record of n rows from those of each, with arrays of equal sizes; what is no array is that of the first."""
    return _made_of(records, np.array)  # several times faster than `numpy.stack`, and the same


def concatenate(records):
    """Record of the rows of several, one after the other; what is no array is that of the first."""
    return _made_of(records, np.concatenate)


def assign_rows(record, index, cases):
    """Write the record `cases` into the rows at `index` of `record`."""
    for array, rows in zip(_arrays(record), _arrays(cases), strict=True):
        array[index] = rows


def with_computed(record, **values):
    """The record itself, with values that its cached properties have from elsewhere: they are not computed again."""
    vars(record).update(values)
    return record


def is_computed(record, name):
    """True if a cached property of a record has its value."""
    return name in vars(record)


def _arrays(value):
    """Yield the arrays of a record, or of a list or tuple."""
    if hasattr(value, "ndim"):
        yield value
    elif fields_of := _fields(type(value)):
        yield from _arrays(fields_of(value))
    elif isinstance(value, list | tuple):
        for part in value:
            yield from _arrays(part)


def _made_of(values, make):
    """A record, list or tuple with `make` of the equal arrays, a sequence, in place of each array of some records."""
    first = values[0]
    if isinstance(first, float):
        return make([np.asarray(value) for value in values])
    if hasattr(first, "ndim"):  # an array, sparse perhaps
        return make(values)
    if fields_of := _fields(type(first)):
        return type(first)(*_each_made_of(map(fields_of, values), make))
    if isinstance(first, list | tuple) and not _are_names(first):
        return type(first)(_each_made_of(values, make))
    return first


def _each_made_of(rows, make):
    """`_made_of` of the first parts of some sequences, of the second ones, and so on: list."""
    parts = zip(*rows, strict=True)
    return [
        make(of_all) if type(of_all[0]) is np.ndarray else of_all[0] if of_all[0] is None else _made_of(of_all, make)
        for of_all in parts
    ]


@cache
def _fields(kind):
    """Function that returns the fields of a record of some class as a tuple; None of a class of no records."""
    if not is_dataclass(kind):
        return None
    names = [field.name for field in fields(kind)]
    return attrgetter(*names) if len(names) > 1 else lambda record: tuple(getattr(record, name) for name in names)


def _are_names(value):
    """True for a text, and for a list or tuple that begins with one, such as names with their units."""
    while isinstance(value, list | tuple) and value:
        value = value[0]
    return isinstance(value, str)
