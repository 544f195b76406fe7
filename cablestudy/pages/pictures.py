"""Figures as SVG within a page: several in one page share no name, and none loads anything."""

import io
import re
from html import escape

from cablestudy.study.plots.style import UNDATED, styled

BEFORE = re.compile(r"\A.*?(?=<svg )", re.DOTALL)  # the declarations of a file of its own
LEFT_OUT = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->|<style.*?</style>|<title>.*?</title>", re.DOTALL)
SIZE = re.compile(r'\A<svg [^>]*?width="([\d.]+)pt"[^>]*?viewBox="([^"]+)"[^>]*>', re.DOTALL)
PATH = re.compile(r' d="[^"]*"')
DIGITS = re.compile(r"(\.\d\d)\d+")  # beyond hundredths of a point
NAMES = re.compile(r'(\bid="|url\(#|href="#)')


@styled
def _svg(figure):
    file = io.BytesIO()
    figure.savefig(file, format="svg", metadata=UNDATED[".svg"])
    return file.getvalue().decode()


def inline_svg(figure, prefix, label):
    """A matplotlib figure as an element of HTML.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    prefix : str
        Of all names in it, which are to differ from those of other pictures of the page.
    label : str
        What it shows, for readers who do not see it.
    """
    written = LEFT_OUT.sub("", BEFORE.sub("", _svg(figure)))
    written = PATH.sub(lambda match: DIGITS.sub(r"\1", match[0]), NAMES.sub(rf"\g<1>{prefix}-", written))
    width, box = SIZE.match(written).groups()
    begin = f'<svg viewBox="{box}" width="{float(width):.0f}pt" role="img" aria-label="{escape(label)}">'
    return begin + re.sub(r"\n\s*", " ", SIZE.sub("", written)).strip()
