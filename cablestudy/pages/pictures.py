"""Figures within a page, as SVG: several in one page share no name, and none loads anything."""

import io
import re
from base64 import b64encode
from html import escape

from cablestudy.study.plots.style import UNDATED, styled

MOST_POINTS = 100_000  # of the lines of a picture, beyond which it is a few megabytes: then points of colour instead
RESOLUTION = 200  # of these [1/in]
BEFORE = re.compile(r"\A.*?(?=<svg )", re.DOTALL)  # the declarations of a file of its own
LEFT_OUT = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->|<style.*?</style>|<title>.*?</title>", re.DOTALL)
SIZE = re.compile(r'\A<svg [^>]*?width="([\d.]+)pt"[^>]*?viewBox="([^"]+)"[^>]*>', re.DOTALL)
PATH = re.compile(r' d="[^"]*"')
DIGITS = re.compile(r"(\.\d\d)\d+")  # beyond hundredths of a point
NAMES = re.compile(r'(\bid="|url\(#|href="#)')


def inline_picture(figure, prefix, label):
    """A matplotlib figure as an element of HTML: `svg`, or `img` where that would be very large.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    prefix : str
        Of all names in it, which are to differ from those of other pictures of the page.
    label : str
        What it shows, for readers who do not see it.
    """
    if _points(figure) > MOST_POINTS:
        data, width = b64encode(_saved(figure, "png")).decode(), f"{96 * figure.get_figwidth():.0f}"
        return f'<img src="data:image/png;base64,{data}" width="{width}" alt="{escape(label)}">'
    written = LEFT_OUT.sub("", BEFORE.sub("", _saved(figure, "svg").decode()))
    written = PATH.sub(lambda match: DIGITS.sub(r"\1", match[0]), NAMES.sub(rf"\g<1>{prefix}-", written))
    width, box = SIZE.match(written).groups()
    begin = f'<svg viewBox="{box}" width="{float(width):.0f}pt" role="img" aria-label="{escape(label)}">'
    return begin + re.sub(r"\n\s*", " ", SIZE.sub("", written)).strip()


@styled
def _saved(figure, kind):
    file = io.BytesIO()
    figure.savefig(file, format=kind, dpi=RESOLUTION, metadata=UNDATED[f".{kind}"])
    return file.getvalue()


def _points(figure):
    """Number of points of all lines in a figure."""
    total = 0
    for artist in figure.findobj():
        if hasattr(artist, "get_xydata"):
            total += len(artist.get_xydata())
        elif hasattr(artist, "get_paths"):
            total += sum(len(path.vertices) for path in artist.get_paths())
    return total
