"""Build the site: pages of docs/, what they link outside, and references generated from the code; see `make site`.

Pages go to build/source as they are, with links that leave docs/ rewritten, and Sphinx makes build/site of them with
warnings as errors. Nothing is fetched: external links are listed in build/site-links.txt, and a page that would load a
font or script from elsewhere is an error.
"""

import re
import shutil
import sys
from pathlib import Path

import navigation
import reference
from sphinx.cmd.build import build_main

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
BUILD = ROOT / "build"
SOURCE, SITE, LISTED = BUILD / "source", BUILD / "site", BUILD / "site-links.txt"
COPIED = ("pictures", "notebooks", "_static")  # folders of docs/
SHORT = {"tutorial": "Tutorial <tutorial>"}  # page -> its entry in the navigation, shorter than its heading
LINK = re.compile(r"\]\(([^)\s]+)\)")
LOADED = re.compile(r"<(?:script|link|img|iframe)\b[^>]*?(?:src|href)=\"((?:https?:)?//[^\"]+)\"")
ADDRESS = re.compile(r"<a\b[^>]*?href=\"(https?://[^\"]+)\"")


def write_source():
    """Write all pages to an empty folder SOURCE."""
    shutil.rmtree(SOURCE, ignore_errors=True)
    SOURCE.mkdir(parents=True)
    for name in COPIED:
        if (DOCS / name).exists():
            shutil.copytree(DOCS / name, SOURCE / name)
    below = navigation.tree()
    generated = reference.pages()
    below["reference.md"] += list(generated)
    for page in DOCS.glob("*.md"):
        text = page.read_text(encoding="utf-8")
        if page.name == "reference.md":
            text += "\nGenerated from the code:\n\n" + "".join(f"* [](<{name}>)\n" for name in generated)
        (SOURCE / page.name).write_text(within_site(text) + toctree(below.get(page.name, ())), encoding="utf-8")
    for outside, name in navigation.OUTSIDE.items():
        text = (DOCS / outside).read_text(encoding="utf-8")
        (SOURCE / name).write_text(within_site(text.replace("](docs/", "](")), encoding="utf-8")
    for table in (ROOT / "results").glob("trade-*.md"):
        target = SOURCE / "results" / table.name
        target.parent.mkdir(exist_ok=True)
        target.write_text("---\norphan: true\n---\n" + table.read_text(encoding="utf-8"), encoding="utf-8")
    for name, text in generated.items():
        (SOURCE / name).write_text(text, encoding="utf-8")


def within_site(text):
    """A page whose links to files outside docs/ lead to their pages of the site."""

    def moved(match):
        file, mark, anchor = match[1].partition("#")
        file = navigation.OUTSIDE.get(file, file)
        return f"]({file.replace('../results/', 'results/')}{mark}{anchor})"

    return LINK.sub(moved, text)


def toctree(pages):
    """The pages below a page, for the navigation; hidden, since the page links them itself."""
    names = [navigation.OUTSIDE.get(page, page).rsplit(".", 1)[0] for page in pages]
    names = [SHORT.get(name, name) for name in names]
    return "\n```{toctree}\n:hidden:\n\n" + "\n".join(names) + "\n```\n" if names else ""


def check_html():
    """List external links in LISTED; the pages that would load something from elsewhere."""
    found, links = [], set()
    for page in sorted(SITE.rglob("*.html")):
        text = page.read_text(encoding="utf-8")
        found += [f"{page.relative_to(SITE)}: loads {address}" for address in LOADED.findall(text)]
        links.update(ADDRESS.findall(text))
    for sheet in sorted(SITE.rglob("*.css")):
        if re.search(r"(?:url\(|@import )[\"']?(?:https?:)?//", sheet.read_text(encoding="utf-8")):
            found.append(f"{sheet.relative_to(SITE)}: loads something from elsewhere")
    LISTED.write_text("".join(f"{link}\n" for link in sorted(links)), encoding="utf-8")
    return found, len(links)


def main():
    """Build the site; the exit code."""
    write_source()
    shutil.rmtree(SITE, ignore_errors=True)
    options = ["-W", "--keep-going", "-q", "-b", "html", "-d", str(BUILD / "site-doctrees"), "-c", str(DOCS)]
    code = build_main([*options, str(SOURCE), str(SITE)])
    found, number = check_html()
    for line in found:
        print(line, file=sys.stderr)  # noqa: T201
    print(f"{SITE.relative_to(ROOT)}/index.html; {number} external links: {LISTED.relative_to(ROOT)}")  # noqa: T201
    return code or bool(found)


if __name__ == "__main__":
    sys.exit(main())
