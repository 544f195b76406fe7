"""Pages of the reference, generated from the code: keys of files, columns, commands, Python."""

import ast
import re
from pathlib import Path

import cablestudy
from cablestudy.cli import main as program
from cablestudy.cli.help import GROUPS
from cablestudy.scene.schema import keys_of
from cablestudy.study.columns import columns_table
from cablestudy.study.files import materials_table
from cablestudy.study.markdown import short

PACKAGE = Path(cablestudy.__file__).parent
FILES = {
    "scene": ("Keys of a scene", "a scene of one cable", "`ends` or `chord` under `cable`"),
    "suspension": ("Keys of a suspension", "a scene of several cables", "`cables`"),
    "study": ("Keys of a study", "a study", "`vary` and `columns`"),
}
HEADS = ("key", "unit", "default", "meaning", "allowed")
PYTHON = """Python interface
================

:doc:`python` shows how it is used.

.. automodule:: cablestudy.interface
   :members:

State spaces
------------

.. autoclass:: cablestudy.control.statespace.StateSpace
   :members:

Errors
------

.. automodule:: cablestudy.errors
   :members:
"""


def pages():
    """Name of a page -> its text."""
    found = {f"keys-{kind}.md": keys_page(kind) for kind in FILES}
    return found | {
        "columns.md": columns_page(),
        "materials.md": materials_page(),
        "options.rst": commands_page(),
        "interface.rst": PYTHON,
        "modules.md": modules_page(),
    }


def keys_page(kind):
    """Keys of a file, a table for each mapping in it."""
    title, what, telling = FILES[kind]
    parts = [
        f"# {title}\n\nEvery key of {what} (a file with {telling}), as `cablestudy keys {kind}` prints them. A value "
        "is a number in the unit given or text with any unit of the same kind; a dash is a pure number. NAME stands "
        "for a name that you choose, N for a place in a list, counted from 0, and KEY for a dotted key of the scene. "
        "An empty default: without the key there is no such thing.\n"
    ]
    rows = {}
    for key in keys_of(kind):
        rows.setdefault(key.key.rpartition(".")[0], []).append(key)
    for table, keys in rows.items():
        parts.append(f"\n## {f'`{table}`' if table else 'At the top'}\n\n")
        cells = [[name_of(key.key, rows), key.unit, key.default, key.meaning, key.allowed] for key in keys]
        parts.append(table_of(HEADS, cells))
    return "".join(parts)


def name_of(key, tables):
    """The last part of a dotted key, as a link to the table of the keys below it where there is one."""
    name = f"`{key.rpartition('.')[2]}`"
    below = next(
        (table for table in (key, f"{key}.NAME", f"{key}.N", f"{key}.N.KEY", f"{key}.KEY") if table in tables), ""
    )
    return f"[{name}](#{below.lower().replace('.', '')})" if below else name


def columns_page():
    """All columns: of one cable, and of a suspension."""
    parts = [
        "# Columns\n\nWhat a study can ask for, and what `static` and `windrms` print; `cablestudy columns` lists the "
        "same. A column is named with its unit or, in a study, without it. `needs`: what must be computed. `keys`: "
        "what the scene must have. K is a number from 1; BODY, CABLE and the like are names of the scene.\n"
    ]
    rows = columns_table().rows
    for kind, title in (("cable", "Of one cable"), ("suspension", "Of a suspension")):
        cells = [
            [f"`{row['column']}`", row["unit"], row["meaning"], row["needs"], row["key"]]
            for row in rows
            if row["of"] == kind
        ]
        parts.append(f"\n## {title}\n\n{table_of(('column', 'unit', 'meaning', 'needs', 'keys'), cells)}")
    return "".join(parts)


def materials_page():
    """The table of the command `materials`."""
    table = materials_table(())
    fields = [field for field in table.fields if field.name != "source"]
    heads = [field.title + (f" [{field.unit}]" if field.unit else "") for field in fields]
    cells = [[short(row.get(field.name)) for field in fields] for row in table.rows]
    sources = [[row["material"], row["source"]] for row in table.rows]
    return (
        "# Materials and ropes\n\nWhat `cable.material` may name, as `cablestudy materials` prints it; "
        "[Files](files.md#materials-and-ropes) says how to add your own.\n\n"
        f"{table_of(heads, cells)}\n## Sources\n\n{table_of(('material', 'source'), sources)}"
    )


def modules_page():
    """Every module of the program, by package, with the first line of its docstring."""
    parts = [
        "# Modules\n\nEvery file of the program with what is in it; [Architecture](architecture.md) is the overview.\n"
    ]
    packages = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        if text := ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))):
            folder = path.parent.relative_to(PACKAGE.parent).as_posix()
            packages.setdefault(folder, []).append((path.name, text.partition("\n\n")[0].replace("\n", " ")))
    for folder, files in packages.items():
        parts.append(
            f"\n## `{folder}/`\n\n{table_of(('file', 'what is in it'), [[f'`{name}`', text] for name, text in files])}"
        )
    return "".join(parts)


def commands_page():
    """Every command with its options, by sphinx-click."""
    parts = [heading("Options of the commands", "="), "\n:doc:`commands` shows what they print.\n"]
    for title, commands in GROUPS.items():
        parts.append("\n" + heading(title, "-"))
        for name, (module, _, _) in commands.items():
            program.get_command(None, name)  # gives it its examples
            parts.append(f"\n.. click:: cablestudy.cli.{module}:{name}\n   :prog: cablestudy {name}\n")
    return "".join(parts)


def heading(title, line):
    """A heading of reStructuredText."""
    return f"{title}\n{line * len(title)}\n"


def table_of(heads, rows):
    """A table of Markdown; characters that Markdown would take as its own are kept as they are."""
    lines = [heads, ["---"] * len(heads), *([plain(cell) for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def plain(cell):
    """A cell of a table without markup, except for what is between backquotes."""
    if cell.startswith(("`", "[`")):
        return cell
    return re.sub(r"([\\|<>*_\[\]{}$])", r"\\\1", cell)
