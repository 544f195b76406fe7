"""Tables of several load cases as one."""

from itertools import chain

from cablestudy.study.table import Field, Table


def joined_by_name(tables):
    """Tables by their names, each joined as by `joined`, from those of cases: name of a case -> name -> Table."""
    names = dict.fromkeys(name for of_case in tables.values() for name in of_case)
    return {
        name: joined({case: of_case[name] for case, of_case in tables.items() if name in of_case}) for name in names
    }


def joined(tables):
    """The rows of several tables in one, each with its case in front.

    Parameters
    ----------
    tables : dict
        Name of a case -> Table.

    Returns
    -------
    Table
        Tables of one row each become columns side by side in Markdown.
    """
    fields = dict.fromkeys(field for table in tables.values() for field in table.fields if field.name != "status")
    last = dict.fromkeys(field for table in tables.values() for field in table.fields if field.name == "status")
    rows = [{"case": name, **row} for name, table in tables.items() for row in table.rows]

    def errors():
        return chain.from_iterable(table.errors() if table.errors else ({},) for table in tables.values())

    single = all(table.single for table in tables.values())
    return Table(
        (Field("case", "case", label=True), *fields, *last), rows, errors=errors, across="case" if single else ""
    )
