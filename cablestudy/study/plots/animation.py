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
    """Write one period of the vibration of modes as a moving picture: a .gif, or an .html page that contains it.

    The file is written completely or not at all.

    Parameters
    ----------
    draw : callable
        Displacement over the amplitude, from -1 to 1 -> matplotlib.figure.Figure of all modes.
    path : str
        File name, whose ending is one of ENDINGS.
    """
    from PIL import Image  # which matplotlib has with it

    displacements = np.round(np.cos(2 * np.pi * np.arange(FRAMES) / FRAMES), 9).tolist()
    pictures = {}  # displacement -> picture, which occurs on the way there and on the way back
    for displacement in displacements:
        if displacement not in pictures:
            data = io.BytesIO()
            draw(displacement).savefig(data, format="png", dpi=RESOLUTION)
            pictures[displacement] = Image.open(data).convert("RGB").quantize(64, dither=Image.Dither.NONE)
    first, *others = (pictures[displacement] for displacement in displacements)
    data = io.BytesIO()
    first.save(data, format="GIF", save_all=True, append_images=others, duration=PAUSE, loop=0)
    is_page = os.path.splitext(path)[1].lower() == ".html"
    contents = PAGE.format(base64.b64encode(data.getvalue()).decode()).encode() if is_page else data.getvalue()
    write_whole(path, contents)
