"""sweep --dry-run: the cases of a study as a table, line by line, nothing computed and nothing kept."""

import csv
import io
import json

from cablestudy.study.table import exact, short
from cablestudy.sweep.rows import written

CASE = "case"
PADDING = 2  # beside a heading, as tabulate has it


def lines(study, style):
    """The table of the cases as pieces of text, of which only the last piece is in memory.

    Parameters
    ----------
    study : Study
    style : {"md", "csv", "json", "jsonl"}
        As `Table.render` has them.

    Yields
    ------
    str
    """
    rows = ({CASE: number, **written(study.overrides(number - 1))} for number in range(1, study.count + 1))
    names = (CASE, *study.varied)
    if style == "csv":
        yield _csv(names)
        yield from (_csv([exact(cell) for cell in row.values()]) for row in rows)
    elif style == "jsonl":
        yield from (json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n" for row in rows)
    elif style == "json":
        yield from _json(names, rows)
    else:
        yield from _markdown(study, names, rows)


def _csv(cells):
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerow(cells)
    return out.getvalue()


def _json(names, rows):
    begin = json.dumps({"columns": dict.fromkeys(names, "")}, ensure_ascii=False, indent=1)
    yield begin.removesuffix("\n}") + ',\n "rows": ['
    for place, row in enumerate(rows):
        text = json.dumps(row, ensure_ascii=False, allow_nan=False, indent=1)
        yield ("," if place else "") + "\n  " + text.replace("\n", "\n  ")
    yield "\n ]\n}\n"


def _markdown(study, names, rows):
    """As wide as the widest value of each key: its values are counted once, not in every case."""
    widths, texts = [max(len(CASE) + PADDING, len(str(study.count)))], [False]
    for entry in study.entries:
        for key, values, _ in entry.columns:
            width, text = len(key) + PADDING, False
            for value in values:
                cell = written({key: value})[key]
                width, text = max(width, len(_cell(cell))), text or isinstance(cell, str)
            widths.append(width)
            texts.append(text)
    shape = list(zip(widths, texts, strict=True))

    def line(cells):
        both = zip(cells, shape, strict=True)
        padded = [cell.ljust(width) if text else cell.rjust(width) for cell, (width, text) in both]
        return f"| {' | '.join(padded)} |\n"

    yield line(names)
    yield f"|{'|'.join(':' + '-' * (width + 1) if text else '-' * (width + 1) + ':' for width, text in shape)}|\n"
    yield from (line([_cell(cell) for cell in row.values()]) for row in rows)


def _cell(value):
    return short(value).replace("|", "\\|")
