"""The picture of the packages in ARCHITECTURE.md shows the imports as they are, all of them downwards."""

import sys

from command import ROOT

sys.path.insert(0, str(ROOT / "docs"))
import layers


def test_the_picture_is_that_of_the_imports():
    assert layers.PICTURE.read_text(encoding="utf-8") == layers.picture(), "python docs/layers.py draws it anew"
    assert "pictures/layers.svg" in (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")


def test_all_arrows_lead_down():
    graph = layers.imported()
    assert graph["cli"]
    assert graph["statics"] == {"cable", "errors"}
    for place, name in enumerate(layers.ORDER):
        assert graph[name] <= set(layers.ORDER[place + 1 :]), name


def test_a_package_is_drawn_with_its_purpose():
    assert all(len(layers.purpose(name)) > 15 for name in layers.ORDER)
