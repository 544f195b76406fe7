"""Modes in motion: each frame is the shape times the cosine of its phase, in a picture of the same size and scale."""

import base64
import io
import re

import numpy as np
import pytest
from command import CONFIGS, refusal, run
from picture import curves
from PIL import Image, ImageSequence

import cablestudy as cs
from cablestudy import plots

SCENES = {"one cable": CONFIGS / "guy.yaml", "suspension": CONFIGS / "suspensions" / "fast.yaml"}
GIF = ("modes", CONFIGS / "guy.yaml", "-n", "1", "--animate")


def answer_of(kind):
    return cs.load(SCENES[kind]).compute("modes", count=3)


@pytest.mark.parametrize("kind", SCENES)
def test_frames_have_one_scale(kind):
    answer = answer_of(kind)
    frames = [answer.draw(plots, share=share).axes for share in (1.0, 0.3, -1.0)]
    full, *others = [[(*axes.get_xlim(), *axes.get_ylim()) for axes in frame] for frame in frames]
    assert others == [full, full]


def test_a_frame_is_the_shape_times_its_share():
    """Of the lines of one cable the first is the static form, the second the mode on it."""
    answer = answer_of("one cable")
    panels = [answer.draw(plots, share=share).axes[:3] for share in (1.0, 0.25, -1.0)]
    for axes in zip(*panels, strict=True):
        still, full, quarter, negative = (
            one.get_xydata() for one in (curves(axes[0])["static form"], *(curves(each)["mode"] for each in axes))
        )
        assert quarter - still == pytest.approx(0.25 * (full - still), abs=1e-12)
        assert negative - still == pytest.approx(still - full, abs=1e-12)
        moved = np.linalg.norm(full - still, axis=1)
        assert moved.max() == pytest.approx(0.1, rel=1e-3)  # the peak that the title states


def frames_of(data):
    with Image.open(io.BytesIO(data)) as picture:
        return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(picture)]


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    """Bytes of the file that the command writes."""
    path = tmp_path_factory.mktemp("animation") / "modes.gif"
    assert run(*GIF, path).lines == [f"written: {path}"]
    return path.read_bytes()


def test_the_file_has_one_period(picture):
    frames = frames_of(picture)
    assert len(frames) == 20
    for number in range(1, 10):
        assert (frames[number] == frames[20 - number]).all()
        assert (frames[number] != frames[number - 1]).any()


def test_a_page_has_the_same_picture_in_it(picture, tmp_path):
    run(*GIF, tmp_path / "modes.html")
    page = (tmp_path / "modes.html").read_text(encoding="utf-8")
    assert base64.b64decode(re.search('src="data:image/gif;base64,([^"]+)"', page)[1]) == picture
    assert "http" not in page


def test_what_cannot_be_drawn_is_refused(tmp_path):
    assert refusal(*GIF, "x.mp4") == "--animate x.mp4: unknown kind of picture (allowed: .gif, .html)"
    absent = tmp_path / "absent" / "x.gif"
    assert refusal(*GIF, absent) == f"--animate {absent}: no such folder"
    assert refusal(*GIF, "x.gif", "--case", "all") == "--animate: no effect: --case all has the modes of each case"
