"""Compares many random scenes of one cable with the same scenes written as suspensions, and prints what differs.

    python benchmarks/twins.py --scenes 200 [--parts statics,modes,gondola,space,rest,loop,straight,cable,bare]

`tests/test_twins.py` compares some of them. Loops to an accuracy take long.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))

from random_twins import random_scene, straight_scene
from twin_comparison import (
    compare_cable_wind,
    compare_gondola,
    compare_loop,
    compare_modes,
    compare_open_wind,
    compare_state_space,
    compare_statics,
)
from twins import without


def exact(scenes):
    """Those that state their elements, without a load case."""
    return {name: one for name, one in scenes.items() if "elements" in one["model"] and "case" not in one}


def bare(scenes):
    """The same without their gondolas."""
    return {name: without(one, "gondola") for name, one in scenes.items()}


PARTS = {
    "statics": compare_statics,
    "modes": compare_modes,
    "gondola": compare_gondola,
    "space": lambda scenes: compare_state_space(exact(scenes)),
    "rest": compare_open_wind,
    "loop": compare_loop,
    "straight": lambda scenes: compare_loop({f"straight {seed}": straight_scene(seed) for seed in range(len(scenes))}),
    "cable": lambda scenes: compare_cable_wind(exact(scenes)),
    "bare": lambda scenes: compare_cable_wind(bare(exact(scenes))),
}


def largest(differences):
    """Column -> the largest of some differences: dict."""
    found = {}
    for one in differences:
        if one.column not in found or found[one.column].size < one.size:
            found[one.column] = one
    return found


def say(line):
    """Print a line."""
    sys.stdout.write(f"{line}\n")


def main(arguments=None):
    """Compare, and print the largest difference of each column."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--parts", default=",".join(PARTS))
    asked = parser.parse_args(arguments)
    scenes = {f"random {seed}": random_scene(seed) for seed in range(asked.scenes)}
    for part in asked.parts.split(","):
        begin = time.process_time()
        found = largest(PARTS[part](scenes))
        say(f"{part}: {len(found)} differences, {time.process_time() - begin:.1f} s of CPU")
        for column, one in sorted(found.items()):
            say(f"  {column} | {one.scene} | {one.one} | {one.twin} | {one.size:.3g} | stated {one.stated:.1e}")


if __name__ == "__main__":
    main()
