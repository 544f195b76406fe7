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
        For Markdown: errors and times rounded, errors below the reference's own as `< 1e-12`.

    Returns
    -------
    Table
    """
    fields = [Field("family", "family"), Field("model", "model"), Field("dof", "dof"), Field("time_ms", "time", "ms")]
    for column in trade.columns:
        fields.append(Field(f"{column.name}_error", f"{column.name.replace('_', ' ')} error"))
        fields.append(Field(f"{column.name}_time_ms", f"{column.name} time", "ms", hidden=True))
    fields += [Field("largest_error", "largest error"), Field("pareto", "pareto"), STATUS]
    limits = {f"{column.name}_error": trade.reference.errors[column.name] for column in trade.columns}
    limits["largest_error"] = max(limits.values())
    rows = [{"family": "reference", "model": CONTINUOUS, **limits, "status": "ok"}]
    rows += [_row(entry, trade.front) for entry in trade.entries]
    return Table(tuple(fields), [_rounded(row, limits) for row in rows] if shown else rows)


def _row(entry, front):
    """Cells of one model."""
    return {
        "family": entry.family,
        "model": entry.name,
        "dof": entry.dof,
        "time_ms": None if entry.time is None else 1e3 * entry.time,
        **{f"{name}_error": error for name, error in entry.errors.items()},
        **{f"{name}_time_ms": 1e3 * seconds for name, seconds in entry.times.items()},
        "largest_error": entry.largest,
        "pareto": "yes" if entry.name in front else "no",
        "status": entry.status,
    }


def _rounded(row, limits):
    """A row for Markdown; limits: error column -> the reference's own error."""
    texts = dict(row)
    for name, limit in limits.items():
        error = row.get(name)
        if error is not None:
            texts[name] = f"< {limit:.0e}" if error <= limit else f"{error:.1e}"
    if row.get("time_ms") is not None:
        texts["time_ms"] = short(float(f"{row['time_ms']:.2g}"))
    texts["pareto"] = "yes" if row.get("pareto") == "yes" else None
    return texts


def _fastest_table(trade):
    """The fastest model below each error, for each column alone."""
    fields = [Field("column", "column"), *(Field(f"{t:.0e}", f"error below {t:.0e}") for t in TARGETS)]
    rows = [
        {"column": column.name, **{f"{target:.0e}": _fastest(trade, column, target) for target in TARGETS}}
        for column in trade.columns
    ]
    return Table(tuple(fields), rows)


def _fastest(trade, column, target):
    entry = trade.fastest(column, target)
    return f"{entry.name} ({1e3 * entry.times[column.name]:.2g} ms)" if entry else "none"


def notes_of(trade):
    """How the reference was computed, and which model is the fastest below an error.

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
        "time: processor time from the scene to the numbers, statics included, one thread, imports and constants cached"
    )
    for column in trade.columns:
        lines += [f"fastest below {target:.0e}: {column.name}: {_fastest(trade, column, target)}" for target in TARGETS]
    return lines


def file_name(scene):
    """File name of a scene's tables, for example `trade-carlina.yaml` for configs/carlina.yaml."""
    return f"trade-{'stdin' if scene == '-' else os.path.basename(scene)}"


def write(trade, place, title):
    """Write NAME.csv and NAME.md to a folder.

    Parameters
    ----------
    trade : Trade
    place : Place
    title : str
        The scene and its changes.
    """
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy"))
    text = (
        f"# Error against time: {title}\n\n{table_of(trade, shown=True).render('md')}\n"
        f"Times: Python {platform.python_version()}, {libraries}, {platform.machine()}, one thread; "
        f"processor time. Read the ratios: another machine has other milliseconds.\n\n"
        f"## The fastest model below an error\n\n{_fastest_table(trade).render('md')}"
    )
    place.write_texts(table_of(trade).render("csv"), text)
