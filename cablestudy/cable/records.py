"""Dataclasses whose fields are arrays: parts and copies of all of their arrays at once."""

from dataclasses import fields, replace

import numpy as np


def with_arrays(record, change):
    """Copy of a dataclass of arrays with each of them replaced by `change` of it, a function."""
    return replace(record, **{field.name: change(getattr(record, field.name)) for field in fields(record)})


def take_rows(record, index):
    """The cases at `index` of a dataclass of arrays, whose first axes are the cases."""
    return with_arrays(record, lambda array: array[index])


def copy_record(record):
    """Copy of a dataclass of arrays, whose arrays can be written to."""
    return with_arrays(record, np.array)


def assign_rows(record, index, cases):
    """Write `cases` into the rows at `index` of `record`, both of them dataclasses of arrays."""
    for field in fields(record):
        getattr(record, field.name)[index] = getattr(cases, field.name)
