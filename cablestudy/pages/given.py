"""Input of the user, as a section of a page: main numbers, what options changed, the resolved file."""

import json
from dataclasses import dataclass

from cablestudy.pages.markup import element, listed, paragraph, preformatted, text
from cablestudy.pages.tables import TableGrid, table_html
from cablestudy.scene.scene import field_of, quantity_of
from cablestudy.scene.units import to_si
from cablestudy.scene.words import counted
from cablestudy.study.table import Field, Table, short

MOST_LINES = 200  # of a resolved file
MOST_VALUES = 8  # of what varies, that are listed
BY_NAME = ("points", "cables", "winches", "cases", "materials")  # tables that are not among the main numbers
ATTACHED = ("attachments", "markers")  # of a body: places, which the file below has


@dataclass(frozen=True)
class Change:
    """One key that is not as in the file.

    Attributes
    ----------
    key : str
        Dotted.
    before, now : str
        As written, empty where there is nothing.
    by : str
        The option or file that changed it.
    """

    key: str
    before: str
    now: str
    by: str


def written(value):
    """A value as it may be written in a file, on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {written(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def flat(value, path=()):
    """Dotted key -> value of a mapping; lists stay whole."""
    if not isinstance(value, dict) or (path and not value):
        return {".".join(path): value}
    return {key: leaf for name, item in value.items() for key, leaf in flat(item, (*path, str(name))).items()}


def changes(before, document):
    """List of `Change` of a Document upon what it was before: as `Change` has them, sorted as in the files."""
    old, new = flat(before.value), flat(document.value)
    keys = [key for key in dict.fromkeys((*old, *new)) if old.get(key) != new.get(key)]
    return [
        Change(
            key, written(old[key]) if key in old else "", written(new[key]) if key in new else "", _by(document, key)
        )
        for key in keys
    ]


def _by(document, key):
    """What set a key of a document."""
    where = document.place(tuple(key.split(".")))
    return where.name if where.name.startswith("--") else str(where)


def change_table(found):
    """The changes as HTML; nothing without one."""
    if not found:
        return ""
    rows = [
        [
            element("code", text(one.key)),
            text(one.before) or "not given",
            element("strong", text(one.now) or "removed"),
            element("code", text(one.by)),
        ]
        for one in found
    ]
    return TableGrid(["key", "in the file", "here", "by"], rows).html("Changed")


def numbers_table(document):
    """The keys of a scene with their meaning and value, without points and cables of a suspension, as HTML."""
    rows = []
    for key, value in flat(document.value).items():
        first, *others = key.split(".")
        if first in BY_NAME or (first == "bodies" and len(others) > 1 and others[1] in ATTACHED):
            continue
        field = field_of(key)
        meaning = field.description or "" if field else ""
        rows.append({"key": key, "meaning": meaning, "value": written(value), "si": _in_si(key, value)})
    fields = [Field("key", "key"), Field("meaning", "meaning"), Field("value", "as written")]
    if any(row["si"] for row in rows):
        fields.append(Field("si", "in SI"))
    return table_html(Table(tuple(fields), rows), "Main numbers", "the file has them all")


def _in_si(key, value):
    """A quantity in SI with its unit, empty where it is written so, or is none."""
    quantity = quantity_of(key)
    parts = value if isinstance(value, list) else [value]
    if quantity is None or not any(isinstance(part, str) for part in parts):
        return ""
    try:
        numbers = [short(float(to_si(part, quantity.unit))) for part in parts]
    except (ValueError, TypeError, OverflowError):  # a word, a share of something, a list of lists
        return ""
    plain = [str(part).removesuffix(f" {quantity.unit}") for part in parts]
    return "" if plain == numbers else f"{', '.join(numbers)}\N{NO-BREAK SPACE}{quantity.unit}".strip()


def cases_table(document):
    """The load cases as written, as HTML; nothing without them."""
    rows = [{"case": name, "own": _inside(case)} for name, case in document.value.get("cases", {}).items()]
    return table_html(Table((Field("case", "case"), Field("own", "as written")), rows), "Load cases")


def _inside(mapping):
    """The keys and values of a mapping on one line."""
    return written(mapping)[1:-1]


def cables_table(scene, document):
    """Where each cable of a suspension is and what it says itself, as HTML; nothing of a scene of one cable."""
    if "cables" not in document.value:
        return ""
    rows = []
    for name, cable in document.value["cables"].items():
        own = {key: value for key, value in cable.items() if key not in ("from", "to")}
        row = {"name": name, "from": written(cable["from"]), "to": written(cable["to"])}
        rows.append({**row, "own": _inside(own)})
    fields = [Field(name, name) for name in ("name", "from", "to")]
    if any(row["own"] for row in rows):
        fields.append(Field("own", "of its own"))
    fixed = sum(not point.free for point in scene.points.values())
    bodies = ["1 body" if len(scene.bodies) == 1 else f"{len(scene.bodies)} bodies"] if scene.bodies else []
    things = {"cable": len(scene.cables), "winch": len(scene.winches), "fixed point": fixed}
    things["free point"] = len(scene.points) - fixed
    named = [counted(number, noun).replace("chs", "ches") for noun, number in things.items() if number]
    line = ", ".join([*bodies, *named])
    return paragraph(f"{line}.") + table_html(Table(tuple(fields), rows), "Connections", "the file has them all")


def resolved_file(document):
    """A document as YAML, its base files merged and its changes made, as HTML; cut where it is very long."""
    import yaml

    lines = yaml.safe_dump(
        document.value, sort_keys=False, allow_unicode=True, width=100, default_flow_style=None
    ).splitlines()
    more = len(lines) - MOST_LINES
    if more > 0:
        lines[MOST_LINES:] = [f"# ... and {more} more lines"]
    return preformatted("\n".join(lines) + "\n", "Resolved file")


def varied_list(study):
    """List of what varies in a study, key by key, as HTML."""
    lines = []
    for entry in study.entries:
        lines += [f"{key}: {_values(study, key, values)}" for key, values, _ in entry.columns]
        for name, settings in entry.alternatives.items():
            made = ", ".join(f"{key}: {written(value)}" for key, value, _ in settings)
            lines.append(f"alternative {name}: {made or 'nothing is changed'}")
    return listed(lines)


def _values(study, key, values):
    """The values of a varied key: those of a list, or the ends of a range or sample."""
    if isinstance(values, list):
        shown = [*values[: MOST_VALUES - 1], "…", values[-1]] if len(values) > MOST_VALUES else values
        return ", ".join(map(written, shown)) + (f" ({len(values)} values)" if len(values) > MOST_VALUES else "")
    if study.sample is not None and key in study.sample.over:
        interval = study.sample.over[key]
        how = f"{len(values)} cases of the sample ({study.sample.method})"
    else:
        interval = values.written
        how = f"{len(values)} values, spacing {interval['spacing']}"
    return f"from {written(interval['from'])} to {written(interval['to'])}, {how}"
