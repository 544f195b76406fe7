"""Fragments of HTML: escaped text, headings, lists, boxes, pictures; and the page around them."""

from html import escape
from importlib.resources import files

from cablestudy.errors import one_line

# the browser itself then refuses whatever a page might load
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def text(value):
    """Text as HTML: escaped, on one line."""
    return escape(one_line(value))


def unit_text(unit):
    """A unit as HTML, with raised exponents."""
    return text(unit.replace("^2", "²").replace("^3", "³"))


def element(tag, content, **attributes):
    """One element of HTML, with HTML in it, and plain text as attributes; empty ones are left out.

    The attribute `class_` is `class`, `aria_label` is `aria-label`.
    """
    named = {name.rstrip("_").replace("_", "-"): str(value) for name, value in attributes.items() if value}
    in_tag = "".join(f' {name}="{escape(value)}"' for name, value in named.items())
    return f"<{tag}{in_tag}>{content}</{tag}>"


def paragraph(line, **attributes):
    """A paragraph of plain text."""
    return element("p", text(line), **attributes) + "\n"


def listed(lines, **attributes):
    """A list of lines of plain text; empty without lines."""
    items = "".join(element("li", text(line)) for line in lines)
    return element("ul", items, **attributes) + "\n" if items else ""


def boxed(content, label):
    """Content that may be wider than the page, in a box of its own that scrolls, also by the keyboard."""
    return element("div", content, class_="box", role="region", tabindex="0", aria_label=label) + "\n"


def preformatted(content, label):
    """Text as it is written."""
    return boxed(element("pre", element("code", escape(content))), label)


def picture(svg, caption):
    """A picture with its caption."""
    return element("figure", boxed(svg, caption) + element("figcaption", text(caption))) + "\n"


def document(title, body):
    """The page, complete HTML, of a title in plain text and a body in HTML."""
    style = files("cablestudy.pages").joinpath("page.css").read_text(encoding="utf-8")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{text(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        f"{body}</main>\n</body>\n</html>\n"
    )
