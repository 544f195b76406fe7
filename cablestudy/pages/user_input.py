"""Input of the user, as a section of a page: main numbers, what options changed, the resolved file."""

import json

from cablestudy.pages.markup import element, listed, paragraph, preformatted, text
from cablestudy.pages.tables import columns_of, grid_html, table_html
from cablestudy.pages.tolerances import PAGES
from cablestudy.scene.layers import leaves
from cablestudy.scene.scene import field_of, quantity_of
from cablestudy.scene.strict_yaml import write_yaml
from cablestudy.scene.units import to_si
from cablestudy.scene.words import counted
from cablestudy.study.table import Field, Table, short

BY_NAME = ("points", "cables", "links", "winches", "cases", "materials")  # tables that are not among the main numbers
ATTACHED = ("attachments", "markers")  # of a body: places, which the file below has


def written(value):
    """A value as it may be written in a file, on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {written(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def flat(mapping):
    """Dotted key -> value of nested mappings: dict; lists stay whole."""
    return {".".join(path): value for path, value in leaves(mapping)}


def changes_table(before, document):
    """Table of the keys whose values differ from one Document to another, and what changed them, as HTML; or empty."""
    old, new = flat(before.value), flat(document.value)
    changed = [key for key in dict.fromkeys((*old, *new)) if old.get(key) != new.get(key)]
    rows = [
        [
            element("code", text(key)),
            text(written(old[key])) if key in old else "not given",
            element("strong", text(written(new[key])) if key in new else "removed"),
            element("code", text(_origin(document, key))),
        ]
        for key in changed
    ]
    return grid_html(columns_of(["key", "in the file", "here", "by"], rows), "Changed") if rows else ""


def _origin(document, key):
    """The option, or the place in a file, that set a dotted key of a document."""
    where = document.place(tuple(key.split(".")))
    return where.name if where.name.startswith("--") else str(where)


def numbers_table(document):
    """The keys of a scene with their meaning and value, without points, cables and links of a suspension, as HTML."""
    rows = []
    for key, value in flat(document.value).items():
        table, *names = key.split(".")
        if table in BY_NAME or (table == "bodies" and len(names) > 1 and names[1] in ATTACHED):
            continue
        field = field_of(key)
        meaning = field.description or "" if field else ""
        rows.append({"key": key, "meaning": meaning, "value": written(value), "si": _in_si(key, value)})
    fields = [Field("key", "key"), Field("meaning", "meaning"), Field("value", "as written")]
    if any(row["si"] for row in rows):
        fields.append(Field("si", "in SI"))
    return table_html(Table(tuple(fields), rows), "Main numbers", "the file has them all")


def _in_si(key, value):
    """Text of the value of a dotted key in SI with its unit; empty where it is written so, or is no quantity."""
    quantity = quantity_of(key)
    components = value if isinstance(value, list) else [value]
    if quantity is None or not any(isinstance(component, str) for component in components):
        return ""
    try:
        in_si = [short(float(to_si(component, quantity.unit))) for component in components]
    except (ValueError, TypeError, OverflowError):  # a word, a share of something, a list of lists
        return ""
    as_written = [str(component).removesuffix(f" {quantity.unit}") for component in components]
    return "" if as_written == in_si else f"{', '.join(in_si)}\N{NO-BREAK SPACE}{quantity.unit}".strip()


def cases_table(document):
    """The load cases as written, as HTML; nothing without them."""
    rows = [{"case": name, "own": _on_one_line(case)} for name, case in document.value.get("cases", {}).items()]
    return table_html(Table((Field("case", "case"), Field("own", "as written")), rows), "Load cases")


def _on_one_line(mapping):
    """The keys and values of a mapping as text without braces."""
    return written(mapping)[1:-1]


def cables_table(scene, document):
    """Table of the cables and links of a suspension with ends and own keys, as HTML; empty for a scene of one cable."""
    if "cables" not in document.value:
        return ""
    rows = []
    for name, connection in {**document.value["cables"], **document.value.get("links", {})}.items():
        own = {key: value for key, value in connection.items() if key not in ("from", "to")}
        row = {"name": name, "from": written(connection["from"]), "to": written(connection["to"])}
        rows.append({**row, "own": _on_one_line(own)})
    fields = [Field(name, name) for name in ("name", "from", "to")]
    if any(row["own"] for row in rows):
        fields.append(Field("own", "of its own"))
    table = table_html(Table(tuple(fields), rows), "Connections", "the file has them all")
    return paragraph(f"{_contents(scene)}.") + table


def _contents(scene):
    """Numbers of the bodies, cables, links, winches and points of a suspension: `1 body, 6 cables, 3 winches`."""
    fixed = sum(not point.free for point in scene.points.values())
    numbers = {"cable": len(scene.cables), "link": len(scene.links), "winch": len(scene.winches), "fixed point": fixed}
    numbers["free point"] = len(scene.points) - fixed
    bodies = ["1 body" if len(scene.bodies) == 1 else f"{len(scene.bodies)} bodies"] if scene.bodies else []
    others = [counted(number, noun).replace("chs", "ches") for noun, number in numbers.items() if number]
    return ", ".join([*bodies, *others])


def resolved_file(document):
    """A document as YAML, its base files merged and its changes made, as HTML; cut where it is very long."""
    lines = write_yaml(document.value).splitlines()
    left_out = len(lines) - PAGES.file_lines
    if left_out > 0:
        lines[PAGES.file_lines :] = [f"# ... and {left_out} more lines"]
    return preformatted("\n".join(lines) + "\n", "Resolved file")


def varied_list(study):
    """List of what varies in a study, key by key, as HTML."""
    lines = []
    for entry in study.entries:
        lines += [f"{key}: {_values(study, key, values)}" for key, values, _ in entry.columns]
        for name, settings in entry.alternatives.items():
            changed = ", ".join(f"{key}: {written(value)}" for key, value, _ in settings)
            lines.append(f"alternative {name}: {changed or 'nothing is changed'}")
    return listed(lines)


def _values(study, key, values):
    """Text of the values of a varied key: those of a list, or the ends of a range or sample."""
    if isinstance(values, list):
        if len(values) <= PAGES.varied_values:
            return ", ".join(map(written, values))
        listed_values = [*values[: PAGES.varied_values - 1], "…", values[-1]]
        return ", ".join(map(written, listed_values)) + f" ({len(values)} values)"
    if study.sample is not None and key in study.sample.over:
        interval = study.sample.over[key]
        how = f"{len(values)} cases of the sample ({study.sample.method})"
    else:
        interval = values.written
        how = f"{len(values)} values, spacing {interval['spacing']}"
    return f"from {written(interval['from'])} to {written(interval['to'])}, {how}"
