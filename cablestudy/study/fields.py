"""Fields of tables from columns: names, titles, units, printed values."""

from cablestudy.study.columns import Column, find
from cablestudy.study.table import Field

# key -> columns any of which makes a column of its own for the varied key superfluous
SHOWN_BY = {
    "cable.area": ("area", "diameter"),
    "cable.diameter": ("diameter", "area"),
    "cable.unstretched_length": ("unstretched_length",),
    "cable.preload": ("preload",),
    "cable.sag": ("sag",),
    "cable.elastic_modulus": ("elastic_modulus",),
    "cable.density": ("density",),
    "cable.chord": ("chord",),
}
STATUS = Field("status", "status")


def fields_of(study, columns, referenced):
    """The fields of a study's table.

    Parameters
    ----------
    study : Study
    columns : list of Column
    referenced : collection of str
        Headers of the columns that have printed values.

    Returns
    -------
    tuple of Field
    """
    shown = {column.name for column in columns}
    fields = [Field(key, key) for key in study.varied if not shown.intersection(SHOWN_BY.get(key, ()))]
    for column in columns:
        if column.name == "status":
            continue
        fields.append(field_of(column))
        if column.header in referenced:
            printed, difference = beside(column.header, "printed"), beside(column.header, "difference")
            fields.append(Field(printed, "printed", column.unit, hidden=True))
            fields.append(Field(difference, "printed (Δ)", "", beside=printed))
    return (*fields, STATUS)


def field_of(column: Column):
    """The field of a column."""
    return Field(column.header, column.name.replace("_", " "), column.unit)


def beside(header, word):
    """Name with a word before the unit: `sag_m` -> `sag_printed_m`."""
    column = find(header)
    return f"{column.name}_{word}{column.header[len(column.name) :]}"
