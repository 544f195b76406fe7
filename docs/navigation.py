"""Order of the pages of docs/: `index.md` links the sections, and each section the pages that belong to it."""

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parent
SECTIONS = ("how-to", "reference", "explanation")
LINK = re.compile(r"\]\(([^)#:\s]+\.md)(?:#[^)]*)?\)")
OUTSIDE = {"../ARCHITECTURE.md": "architecture.md", "../CHANGELOG.md": "changelog.md"}  # what the site calls them


def links(page):
    """Pages that a page of docs/ links, in order, each once, as paths from docs/."""
    return list(dict.fromkeys(LINK.findall((DOCS / page).read_text(encoding="utf-8"))))


def tree():
    """Page -> the pages below it: of the index and of the sections."""
    sections = [f"{name}.md" for name in SECTIONS]
    found = {"index.md": [page for page in links("index.md") if page in {"tutorial.md", *sections, "gallery.md"}]}
    seen = {"index.md", *found["index.md"]}
    for section in sections:
        found[section] = [page for page in links(section) if page not in seen]
        seen.update(found[section])
    return found


def in_order():
    """All pages in reading order, as paths from docs/."""
    below = tree()
    return ["index.md", *(page for top in below["index.md"] for page in (top, *below.get(top, ())))]
