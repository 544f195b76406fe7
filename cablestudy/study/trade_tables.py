"""Tables, notes and files of the command `trade`."""

import os
import platform
from importlib.metadata import version

from cablestudy.study.fields import STATUS
from cablestudy.study.table import Field, Table, short

TARGETS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
CONTINUOUS = "continuous cable"


def table_of(trade, shown=False):
    """One row for each model, the reference first.

    Parameters
    ----------
    trade : Trade
    shown : bool
        For Markdown: errors as texts, those that drown in the reference's own as `< 1e-12`.

    Returns
    -------
    Table
    """
    own = trade.reference.errors
    fields = [Field("family", "family"), Field("model", "model"), Field("dof", "dof"), Field("time_ms", "time", "ms")]
    for column in trade.columns:
        fields.append(Field(f"{column.name}_error", f"{column.name.replace('_', ' ')} error"))
        fields.append(Field(f"{column.name}_time_ms", f"{column.name} time", "ms", hidden=True))
    fields += [Field("largest_error", "largest error"), Field("pareto", "pareto"), STATUS]
    first = {"family": "reference", "model": CONTINUOUS, "status": "ok"}
    first |= {f"{column.name}_error": own[column.name] for column in trade.columns}
    first["largest_error"] = max(own[column.name] for column in trade.columns)
    rows = [first]
    for entry in trade.entries:
        row = {"family": entry.family, "model": entry.name, "dof": entry.dof, "status": entry.status}
        row["time_ms"] = None if entry.time is None else 1e3 * entry.time
        row |= {f"{name}_error": error for name, error in entry.errors.items()}
        row |= {f"{name}_time_ms": 1e3 * seconds for name, seconds in entry.times.items()}
        row |= {"largest_error": entry.largest, "pareto": "yes" if entry.name in trade.front else "no"}
        rows.append(row)
    if shown:
        limits = {f"{column.name}_error": own[column.name] for column in trade.columns}
        limits["largest_error"] = max(own[column.name] for column in trade.columns)
        rows = [_texts(row, limits) for row in rows]
    return Table(tuple(fields), rows)


def _texts(row, limits):
    """A row for readers."""
    texts = dict(row)
    for name, limit in limits.items():
        error = row.get(name)
        if error is not None:
            texts[name] = f"< {limit:.0e}" if error <= limit else f"{error:.1e}"
    if row.get("time_ms") is not None:
        texts["time_ms"] = short(float(f"{row['time_ms']:.2g}"))
    texts["pareto"] = "yes" if row.get("pareto") == "yes" else None
    return texts


def fastest_table(trade):
    """For each column and error the fastest model, asked for this column alone.

    Parameters
    ----------
    trade : Trade

    Returns
    -------
    Table
    """
    fields = [Field("column", "column"), *(Field(f"{t:.0e}", f"error below {t:.0e}") for t in TARGETS)]
    rows = []
    for column in trade.columns:
        row = {"column": column.name}
        for target in TARGETS:
            entry = trade.fastest(column, target)
            row[f"{target:.0e}"] = f"{entry.name} ({1e3 * entry.times[column.name]:.2g} ms)" if entry else "none"
        rows.append(row)
    return Table(tuple(fields), rows)


def notes_of(trade):
    """What the reference is, and which model is the fastest below an error.

    Returns
    -------
    list of str
    """
    reference = trade.reference
    lines = [
        f"reference: {c.name} {reference.values[c.name]!r} {c.unit}, {reference.notes[c.name]}; "
        f"estimated error {reference.errors[c.name]:.1e}"
        for c in trade.columns
    ]
    lines.append(
        "time: processor time from the scene to the numbers, statics included, one thread, imports and constants warm"
    )
    for column in trade.columns:
        for target in TARGETS:
            entry = trade.fastest(column, target)
            found = f"{entry.name}, {1e3 * entry.times[column.name]:.2g} ms" if entry else "none"
            lines.append(f"fastest below {target:.0e}: {column.name}: {found}")
    return lines


def file_name(scene):
    """Name of a scene's tables: `trade-carlina` of configs/carlina.yaml."""
    return f"trade-{'stdin' if scene == '-' else os.path.basename(scene)}"


def write(trade, place, title):
    """Write NAME.csv and NAME.md to a folder.

    Parameters
    ----------
    trade : Trade
    place : Place
    title : str
        What was computed: the scene and its changes.
    """
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy"))
    text = (
        f"# Error against time: {title}\n\n{table_of(trade, shown=True).render('md')}\n"
        f"Times: Python {platform.python_version()}, {libraries}, {platform.machine()}, one thread; "
        f"processor time. Read the ratios: another machine has other milliseconds.\n\n"
        f"## The fastest model below an error\n\n{fastest_table(trade).render('md')}"
    )
    place.write_texts(table_of(trade).render("csv"), text)
