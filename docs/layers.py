"""Draw docs/pictures/layers.svg: the packages of the program in their order, and which imports which.

A row for each package, from the commands down to the cable; a dot where its modules import those of the package above
the column. All dots lie on one side: imports point one way.
"""

import ast
from functools import cache
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "cablestudy"
PICTURE = ROOT / "docs" / "pictures" / "layers.svg"
ORDER = (
    "cli", "pages", "interface", "sweeps", "plots", "study", "motion", "control", "wind", "system", "statics", "cable",
    "scene", "errors",
)  # fmt: skip
ROW, LEFT, STEP, TOP = 30, 890, 38, 70  # height of a row, where the dots begin, their distance, head of the table
STYLE = "font-family='sans-serif' font-size='13' fill='#222'"


@cache
def imported():
    """Package -> the packages that its modules import, itself left out."""
    found = {name: set() for name in ORDER}
    for path in PACKAGE.rglob("*.py"):
        own = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        tree = ast.parse(path.read_text(encoding="utf-8"))
        tree.body = [node for node in tree.body if not isinstance(node, ast.If)]  # imports for type checkers alone
        for node in ast.walk(tree):
            module = (node.module or "") if isinstance(node, ast.ImportFrom) else ""
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [module]
            if module == "cablestudy":
                names = [f"cablestudy.{alias.name}" for alias in node.names]
            others = {name.split(".")[1] for name in names if name.startswith("cablestudy.")}
            found.get(own, set()).update(others & set(ORDER) - {own})
    return found


def purpose(name):
    """What a package is for: the first line of its docstring."""
    path = PACKAGE / name / "__init__.py"
    text = ast.get_docstring(ast.parse((path if path.exists() else PACKAGE / f"{name}.py").read_text("utf-8")))
    return text.partition("\n")[0].rstrip(".")


def picture():
    """The picture as SVG text."""
    graph, last = imported(), len(ORDER) - 1
    width, height = LEFT + STEP * last + 30, TOP + ROW * len(ORDER) + 10
    parts = [f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' {STYLE}>",
             f"<rect width='{width}' height='{height}' fill='white'/>"]  # fmt: skip
    for place, name in enumerate(ORDER[1:]):
        x = LEFT + STEP * place
        parts.append(f"<text x='{x}' y='{TOP - 10}' transform='rotate(-35 {x} {TOP - 10})'>{name}</text>")
    for row, name in enumerate(ORDER):
        y = TOP + ROW * row
        parts.append(f"<rect x='10' y='{y}' width='90' height='{ROW - 6}' rx='4' fill='#dbe7f3' stroke='#5b7fa6'/>")
        parts.append(f"<text x='20' y='{y + 17}' font-weight='bold'>{name}</text>")
        parts.append(f"<text x='112' y='{y + 17}'>{escape(purpose(name))}</text>")
        for place, other in enumerate(ORDER[1:]):
            dot = other in graph[name]
            size, colour = (6, "#1f5f99") if dot else (1.5, "#bbb")
            parts.append(f"<circle cx='{LEFT + STEP * place}' cy='{y + 12}' r='{size}' fill='{colour}'/>")
    return "\n".join([*parts, "</svg>"]) + "\n"


def write():
    """Draw it anew."""
    PICTURE.write_text(picture(), encoding="utf-8")


if __name__ == "__main__":
    write()
