"""Links between the pages lead somewhere, headings included, as code hosts and the site make them."""

import re
import sys
from pathlib import Path

import pytest
from command import ROOT

sys.path.insert(0, str(ROOT / "docs"))
import navigation

DOCS = ROOT / "docs"
PAGES = sorted([*ROOT.glob("*.md"), *DOCS.rglob("*.md")])
LINK = re.compile(r"\]\(([^)\s]+)\)")


def text_of(page):
    """A page without its fenced blocks, in which a link is none."""
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def anchors(page):
    """Names of the headings of a page: lower case, no punctuation, blanks as hyphens; numbered where they repeat."""
    found = []
    for heading in re.findall(r"^#+ (.*)$", text_of(page), re.MULTILINE):
        name = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        repeated = found.count(name)
        found.append(f"{name}-{repeated}" if repeated else name)
    return found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for link in LINK.findall(text_of(page)):
        if re.match(r"[a-z]+:", link):
            assert link.startswith("https://"), link
            continue
        file, _, anchor = link.partition("#")
        target = (page.parent / file).resolve() if file else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_there_are_links_and_anchors_to_check():
    links = [link for page in PAGES for link in LINK.findall(text_of(page))]
    assert len(links) > 100
    assert sum("#" in link for link in links) > 15
    assert {"README.md", "ARCHITECTURE.md", "CHANGELOG.md", "tutorial.md"} <= {page.name for page in PAGES}


@pytest.mark.parametrize("name", ["a guy of a mast", "Extremes: `sag` and C_d (2)"])
def test_names_of_headings(name, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"# {name}\n\n```sh\n# no heading\n```\n## {name}\n", encoding="utf-8")
    first = {"a": "a-guy-of-a-mast", "E": "extremes-sag-and-c_d-2"}[name[0]]
    assert anchors(page) == [first, f"{first}-1"]


def test_every_page_is_in_the_navigation_of_the_site():
    """A section page, or the index, links it; `navigation` reads the order of the pages from there."""
    written = list(DOCS.glob("*.md"))
    pages = {str(page.relative_to(DOCS)) for page in written} | set(navigation.OUTSIDE)
    assert set(navigation.in_order()) == pages
    assert len(navigation.in_order()) == len(pages)
    assert navigation.tree()["index.md"] == [
        "tutorial.md", "how-to.md", "reference.md", "explanation.md", "gallery.md",
    ]  # fmt: skip


def test_templates_and_scenes_name_pages_that_exist():
    files = [*ROOT.glob("configs/**/*.yaml"), *ROOT.glob("cablestudy/templates/*.yaml")]
    named = [Path(name) for file in files for name in re.findall(r"docs/[\w.-]+\.md", file.read_text(encoding="utf-8"))]
    assert len(named) > 5
    assert [name for name in named if not (ROOT / name).exists()] == []
