"""The page docs/gallery.md: each picture of docs/pictures with the command that draws it, from the console blocks.

`make docs` writes the page; tests/test_docs.py compares it.
"""

import re
from pathlib import Path

import layers
from navigation import in_order

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
PICTURES = DOCS / "pictures"
PAGE = DOCS / "gallery.md"
NO_EXPLANATION = ("index.md", PAGE.name)  # pages that show pictures of others
NOTEBOOK = "notebook-"  # beginning of a page, and of its pictures, which are drawn by the code above them
HEAD = """# Gallery

Each picture with the command that draws it and the page that explains it. Commands with `configs/` run at the top of
the project, the others where `cablestudy new` has written their files; `--plot` takes .svg, .png and .pdf.
"""
# `--plot FILE` of a command; the tutorial draws into its own folder
DRAWN = re.compile(r"--plot (?:docs/pictures/)?([\w.-]+\.svg)")
SHOWN = re.compile(r"!\[([^\]]*)\]\([\w/]*pictures/([\w.-]+)\)")


def pages():
    """The pages that show pictures, in reading order."""
    left_out = (*NO_EXPLANATION, *(page for page in in_order() if page.startswith(NOTEBOOK) or "/" in page))
    return [DOCS / page for page in in_order() if page not in left_out]


def drawn_by_commands():
    """Names of the pictures that are drawn neither by a notebook nor, of the program itself, by `layers`."""
    names = {path.name for path in PICTURES.iterdir() if not path.name.startswith(NOTEBOOK)}
    return names - {layers.PICTURE.name}


def commands():
    """Name of a picture -> the command that draws it, up to what filters the table that it prints."""
    found = {}
    for page in (*pages(), ROOT / "README.md"):
        for line in page.read_text(encoding="utf-8").splitlines():
            drawn = DRAWN.search(line) if line.startswith("$ cablestudy ") else None
            if drawn:
                command = re.split(r" (?:2>&1 )?(?:\||>) ", line.removeprefix("$ "))[0]
                found.setdefault(drawn[1], command.replace("docs/pictures/", "").replace(" --quiet", ""))
    for table in (ROOT / "results").glob("trade-*.md"):  # `make trade` draws them; the heading is the command
        words = table.read_text(encoding="utf-8").splitlines()[0].removeprefix("# Error against time: ")
        found[f"{table.stem}.svg"] = f"cablestudy trade {words} --plot {table.stem}.svg"
    return found


def captions():
    """Name of a picture -> its caption and the page that shows it."""
    found = {}
    for page in pages():
        for caption, name in SHOWN.findall(page.read_text(encoding="utf-8")):
            found.setdefault(name, (caption, page))
    return found


def title(page):
    """Heading of a page."""
    return page.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")


def text():
    """The page as it should be.

    Raises
    ------
    KeyError
        A picture that no page draws, or that no page shows.
    """
    drawn, shown = commands(), captions()
    parts = [HEAD]
    for page in pages():
        names = [name for name in shown if shown[name][1] == page and (PICTURES / name).exists()]
        for name in names:
            parts.append(
                f"\n## {shown[name][0]}\n\n![{shown[name][0]}](pictures/{name})\n\n"
                f"```bash\n{drawn[name]}\n```\n\nExplained in [{title(page)}]({page.name}).\n"
            )
    left = drawn_by_commands() - shown.keys()
    if left:
        raise KeyError(f"no page shows {', '.join(sorted(left))}")
    return "".join(parts)


def write():
    """Write the page."""
    PAGE.write_text(text(), encoding="utf-8")


if __name__ == "__main__":
    write()
