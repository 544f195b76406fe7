"""Modes in motion: pictures of some phases of their vibration, as one file."""

import base64
import io
import os

import numpy as np

from cablestudy.study.plots.style import styled
from cablestudy.study.table import write_whole

ENDINGS = (".gif", ".html")
FRAMES, PAUSE = 20, 60  # of one period; time between them [ms]
RESOLUTION = 100  # of the frames [dots/in]
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Modes in motion</title></head>
<body style="margin:0"><img alt="Modes in motion" style="max-width:100%" src="data:image/gif;base64,{}"></body></html>
"""


@styled
def save_animation(draw, path):
    """Write a period of all modes as a .gif, or as a page of .html that needs nothing else, whole or not at all.

    Parameters
    ----------
    draw : callable
        Displacement over the largest one, from -1 to 1 -> matplotlib.figure.Figure.
    path : str
    """
    from PIL import Image  # which matplotlib has with it

    shares = np.round(np.cos(2 * np.pi * np.arange(FRAMES) / FRAMES), 9).tolist()
    pictures = {}
    for share in shares:
        if share not in pictures:
            data = io.BytesIO()
            draw(share).savefig(data, format="png", dpi=RESOLUTION)
            pictures[share] = Image.open(data).convert("RGB").quantize(64, dither=Image.Dither.NONE)
    first, *others = (pictures[share] for share in shares)
    data = io.BytesIO()
    first.save(data, format="GIF", save_all=True, append_images=others, duration=PAUSE, loop=0)
    page = os.path.splitext(path)[1].lower() == ".html"
    whole = PAGE.format(base64.b64encode(data.getvalue()).decode()).encode() if page else data.getvalue()
    write_whole(path, whole)
