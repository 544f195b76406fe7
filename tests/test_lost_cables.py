"""Load cases with lost cables, and ice and wind on some: against the same scenes written without these cables.

The scenes without state the unstretched lengths of the reference state with all cables; or the equilibrium is a closed
form: a weight that swings below the one rope that is left, a chain of forces on ropes that weigh nothing.
"""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from command import CONFIGS, run, study_file, table_of
from scenes import mistakes_of, scene_of
from suspension_cases import SUSPENSIONS, row, scene_at

from cablestudy.errors import NoSolutionError
from cablestudy.pages.page import Page
from cablestudy.study.columns import find
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.notes import notes_on_lost_cables
from cablestudy.study.suspension.rows import evaluate_suspensions
from cablestudy.study.table_rows import FALLEN

pytestmark = pytest.mark.usefixtures("folder")

MAST = SUSPENSIONS / "mast-levels.yaml"
CABLES = ("north-low", "east-low", "west-low", "north-high", "east-high", "west-high")
DAY = "temperature: -20 degC, ice: {thickness: 8 mm}, wind: {speed: 12 m/s, direction: 30 deg}"
OF_ONE = ("preload", "max_tension", "unstretched_length", "sag", "tension_to", "swing", "mass", "utilisation")


def mast(*sets):
    return scene_at("mast-levels", *sets)


def without(*lost):
    """The mast on the cables that are left, whose lengths are those of the reference state."""
    lengths, _ = row(mast(), *(f"{name}.unstretched_length" for name in CABLES))
    left = {
        name: f"{{from: {name.partition('-')[0]}, to: mast.{'top' if name.endswith('high') else 'middle'}, "
        f"unstretched_length: {lengths[f'{name}.unstretched_length']!r}}}"
        for name in CABLES
        if name not in lost
    }
    text = MAST.read_text(encoding="utf-8").replace(", preload: 10 %", "")
    listed = "".join(f"  {name}: {table}\n" for name, table in left.items())
    return text[: text.index("cables:")] + f"cables:\n{listed}ground: 0 m\n"


@pytest.mark.parametrize(
    ("lost", "day"), [(("north-high",), ""), (("east-low",), DAY), (("north-high", "west-low"), DAY)]
)
def test_a_case_without_cables_is_the_scene_without_them(lost, day):
    """In statics and modes, with the mass, ice and wind of the cables that are left."""
    broken = mast(f"cases={{day: {{lost: [{', '.join(lost)}]{', ' if day else ''}{day}}}}}", "case=day")
    other = scene_of(without(*lost), f"cases={{day: {{{day or 'temperature: 15 degC'}}}}}", "case=day")
    names = [f"{name}.{column}" for name in CABLES if name not in lost for column in OF_ONE]
    names += ["mast.roll", "mast.pitch", "max_tension", "min_tension", "max_utilisation", "cable_mass"]
    names += ["mast.stiffness_rxrx", "frequency_1", "frequency_9"]
    (found, status), (expected, _) = row(broken, *names), row(other, *names)
    assert status == "ok"
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=2e-9, abs=1e-9), name


def test_the_lengths_of_the_others_are_those_with_all_cables():
    """With tensions that are found too: the reference state has all cables, and stands."""
    names = "u1.unstretched_length", "d2.unstretched_length"
    lengths, _ = row(scene_at("carlina-net"), *names)
    broken = scene_at("carlina-net", "cases={b: {lost: [d1]}}", "case=b")
    found, _ = row(broken, *names, "d1.max_tension", "d1.unstretched_length")
    assert found == lengths | {"d1.max_tension": None, "d1.unstretched_length": None}


SWING = """\
gravity: 9.81
cable: {axial_stiffness: 2 MN, mass_per_length: 1e-9 kg/m, diameter: 8 mm}
points:
  a: [-4, 0, 0]
  b: [4, 0, 0]
  load: {at: [0, 0, -3], free: true, mass: 250 kg}
cables:
  left: {from: a, to: load, unstretched_length: 5 m}
  right: {from: b, to: load, unstretched_length: 5 m}
cases:
  torn: {lost: [right]}
  torn-and-pushed: {lost: [right], forces: {load: [500 N, 0, 0]}}
"""


def test_a_weight_on_two_ropes_swings_below_the_one_that_is_left():
    weight, names = 250 * 9.81, ("left.max_tension", "load.x", "load.z", "max_tension")
    found, status = row(scene_of(SWING, "case=torn"), *names)
    assert status == f"{FALLEN}: load"  # four metres to the side, and down
    assert found["left.max_tension"] == found["max_tension"] == pytest.approx(weight, rel=1e-9)
    assert found["load.x"] == pytest.approx(-4, abs=1e-6)
    assert found["load.z"] == pytest.approx(-5 * (1 + weight / 2e6), rel=1e-9)
    pull = math.hypot(weight, 500)
    found, _ = row(scene_of(SWING, "case=torn-and-pushed"), *names, "load.force_displacement_x")
    assert found["left.max_tension"] == pytest.approx(pull, rel=1e-9)
    assert found["load.x"] == pytest.approx(-4 + 5 * (1 + pull / 2e6) * 500 / pull, rel=1e-8)
    assert found["load.force_displacement_x"] == pytest.approx(1e3 * 5 * (1 + pull / 2e6) * 500 / pull, rel=1e-6)


def test_a_lost_cable_takes_its_point_loads_with_it():
    """Also those that it has in the reference state, where no other cable has any."""
    loads = "[{fraction: 0.5, mass: 30 kg}, {at: 2 m, force: [0, 0, -50 N]}]"
    loaded = f"cables.right.loads={loads}", "cables.right.reference.loads=true"
    found, status = row(scene_of(SWING, *loaded, "case=torn"), "left.max_tension", "load.x")
    assert status == f"{FALLEN}: load"
    assert found["left.max_tension"] == pytest.approx(250 * 9.81, rel=1e-9)
    assert found["load.x"] == pytest.approx(-4, abs=1e-6)


def test_what_nothing_holds_is_refused():
    """A point or body that lost all of its cables, alone among the cases of a scene."""
    text = SWING.replace("torn: {lost: [right]}", "torn: {lost: [right]}\n  free: {lost: [third]}").replace(
        "cables:\n", "  drop: {at: [0, 5, -3], free: true, mass: 3 kg}\ncables:\n  third: {from: [0, 5, 0], to: drop, "
        "unstretched_length: 3 m}\n"
    )  # fmt: skip
    with pytest.raises(NoSolutionError, match="without third: nothing holds drop: no cables lead from it"):
        SuspensionCase(scene_of(text, "case=free")).group  # noqa: B018
    status = [row(scene_of(text, f"case={name}"), "max_tension")[1] for name in ("torn", "free")]
    assert status == [f"{FALLEN}: load", "without third: nothing holds drop: no cables lead from it to the ground"]


def test_rows_with_other_cables_lost_are_as_alone():
    lists = ("[]", "[north-high]", "[east-high]", "[north-low, east-high]", "[north-high]")
    scenes = [mast(f"cases={{b: {{lost: {lost}}}}}", "case=b") for lost in lists]
    columns = [find(name) for name in ("max_tension", "cable_mass", "mast.roll", "frequency_1", "west-low.sag")]
    together = [row.cells for row in evaluate_suspensions(scenes, columns)]
    assert together == [evaluate_suspensions([scene], columns)[0].cells for scene in scenes]
    mass = [cells["cable_mass_kg"] for cells in together]
    assert mass[1] < mass[0]
    assert mass[4] == mass[1] == pytest.approx(mass[2], rel=1e-5)  # the guys of one level are alike


def test_what_static_says(monkeypatch):
    done = run("static", MAST, "--case", "broken", "--format", "json", "--table", "cables")
    rows = {one["name"]: one for one in json.loads(done.out)["rows"]}
    assert list(rows) == list(CABLES)
    assert {key: value for key, value in rows["north-high"].items() if value is not None} == {
        "name": "north-high", "state": "lost"
    }  # fmt: skip
    assert {one["state"] for name, one in rows.items() if name != "north-high"} == {"taut"}
    before = {one["name"]: one for one in table_of("static", MAST, "--table", "cables")}
    share = 100 * (rows["north-low"]["max_tension_N"] / before["north-low"]["max_tension_N"] - 1)
    text = " ".join(done.lines)
    assert "without north-high it stands" in text
    assert "no cable is slack" in text
    assert "the snap itself, which pulls more for a moment, is not computed" in text
    told = re.search(r"more in north-low \(([\d.e+]+) N, \+([\d.]+) %\)", text)
    assert float(told[1]) == pytest.approx(rows["north-low"]["max_tension_N"], rel=1e-3)
    assert float(told[2]) == pytest.approx(share, rel=1e-2)
    assert re.search("less in .*east-high .*west-low", text)
    fallen = run("static", MAST, "--case", "both", "--table", "bodies")
    assert "warning: without north-high, north-low it falls to where it hangs now: mast turns by 17" in fallen.err
    monkeypatch.setattr(Page, "draw", lambda *_: None)  # the words of the page alone
    run("report", MAST, "--out", "report.html", "--quiet")
    assert "north-high it stands" in Path("report.html").read_text(encoding="utf-8")
    whole = run("static", MAST, "--case", "all", "--plot", "all.svg", "--table", "cables")
    assert "case broken: note: without north-high it stands" in whole.err
    assert "6 cables" in Path("all.svg").read_text(encoding="utf-8")


def test_slack_cables_are_named():
    """The rope beside the one that takes the load hangs by its own weight."""
    text = SWING.replace("1e-9 kg/m", "0.2 kg/m").replace("  right:", "  spare: {from: a, to: load, "
                         "unstretched_length: 5.5 m}\n  right:")  # fmt: skip
    assert "; slack: spare; this is" in notes_on_lost_cables(SuspensionCase(scene_of(text, "case=torn")))[0]


def test_small_movements_of_small_suspensions_are_told():
    """One of two ropes side by side, of 1 mm: what is left stretches by m g L/EA more than half of that."""
    text = (
        "points: {a: [0, 0, 0], load: {at: [0, 0, -1 mm], free: true, mass: 2 g}}\n"
        "cable: {axial_stiffness: 98.1 kN, mass_per_length: 1e-9 kg/m, unstretched_length: 1 mm}\n"
        "cables: {left: {from: a, to: load}, right: {from: a, to: load}}\ncases: {torn: {lost: [right]}}\n"
    )
    assert "load moves by 1e-10 m" in notes_on_lost_cables(SuspensionCase(scene_of(text, "case=torn")))[0]


@pytest.mark.parametrize("command", ["loop", "windrms", "ssm"])
def test_a_loop_needs_the_cables_of_its_winches(command):
    scene = SUSPENSIONS / "carlina-balloon-wind.yaml"
    attached = ("--with", "loop") if command == "ssm" else ()
    done = run(command, scene, "--case", "b", "--set", "cases={b: {lost: [lower1]}}", "--quiet", *attached, code=3)
    assert len(done.lines) == 1
    assert "the loop needs the winch of lower1, which is lost in the load case b" in done.err


def test_a_state_space_and_modes_are_without_the_lost_cable():
    scene = SUSPENSIONS / "carlina-balloon.yaml"
    case = ("--case", "b", "--set", "cases={b: {lost: [lower1]}}")
    refused = run("ssm", scene, *case, "--input", "winch.lower1", "--response", "0.1:1:3", code=2)
    assert "winch.lower1" in refused.err
    assert "lower1 is lost in the load case b" in run("modes", scene, *case, "--cable", "lower1", code=3).err
    one = table_of("modes", scene, *case, "-n", 2)
    assert one[0]["frequency_Hz"] < table_of("modes", scene, "-n", 2)[0]["frequency_Hz"]


# ------------------------------------------------------------------------------------------------ ice and wind on some

SPANS = """\
cable: {axial_stiffness: 12 MN, diameter: 16 mm}
points:
  a: [0, 0, 20]
  b: {at: [100, 0, 18], free: true, mass: 30 kg}
  c: [210, 10, 24]
bodies:
  box: {at: [100, 0, 10], mass: 80 kg, free: [x, y, z], attachments: {eye: [0, 0, 0]},
        wind: {area: [1 m^2, 1 m^2, 1 m^2], drag_coefficient: 1.1}}
cables:
  one: {from: a, to: b, unstretched_length: 101 m, mass_per_length: MASS kg/m}
  two: {from: b, to: c, unstretched_length: 111 m, mass_per_length: 1.2 kg/m}
  three: {from: b, to: box.eye, unstretched_length: 8 m, mass_per_length: 0.5 kg/m}
cases:
"""
SEEN = ("one.max_tension", "two.max_tension", "three.sag", "one.sag", "b.x", "b.y", "b.z", "box.y")


def test_ice_on_one_span_is_a_heavier_span():
    """The lengths are stated, so that a cable with the mass of the ice is the cable with ice."""
    ice = 900 * math.pi * 0.012 * (0.016 + 0.012)
    for case in ("ice: {thickness: 12 mm, on: [one]}", f"ice: {{weight: {ice * 9.81!r} N/m, on: [one]}}"):
        found, _ = row(scene_of(SPANS.replace("MASS", "1.2") + f"  day: {{{case}}}\n", "case=day"), *SEEN)
        expected, _ = row(scene_of(SPANS.replace("MASS", repr(1.2 + ice)) + "  day: {}\n", "case=day"), *SEEN)
        for name, value in expected.items():
            assert found[name] == pytest.approx(value, rel=1e-9, abs=1e-9), name


def test_wind_on_some_is_drag_on_these_alone():
    text, wind = SPANS.replace("MASS", "1.2"), "speed: 25 m/s, direction: 70 deg"

    def seen(more):
        return row(scene_of(text + f"  day: {{wind: {{{wind}{more}}}}}\n", "case=day"), *SEEN)[0]

    everything = seen("")
    assert seen(", on: [two, box, one, three]") == everything
    assert seen(", on: [box]") == seen(", cable_drag_coefficient: 0")
    bare = text.replace(
        "eye: [0, 0, 0]},\n        wind: {area: [1 m^2, 1 m^2, 1 m^2], drag_coefficient: 1.1}}", "eye: [0, 0, 0]}}"
    )
    cables, _ = row(scene_of(bare + f"  day: {{wind: {{{wind}}}}}\n", "case=day"), *SEEN)
    assert seen(", on: [one, two, three]") == cables
    assert seen(", on: [one]")["b.y"] < seen(", on: [one, two]")["b.y"] < everything["b.y"]


def test_ice_around_one_cable_is_seen_by_the_wind_there_alone():
    """Two spans that share nothing: one with the ice of all, one without."""
    text = SPANS[: SPANS.index("bodies:")] + "cables:\n  one: {from: a, to: c, unstretched_length: 212 m, " \
        "mass_per_length: 1.2 kg/m}\n  two: {from: [0, 9, 20], to: [90, 9, 25], unstretched_length: 91 m, " \
        "mass_per_length: 1.2 kg/m}\ncases:\n"  # fmt: skip
    text = text.replace("  b: {at: [100, 0, 18], free: true, mass: 30 kg}\n", "")
    names, wind = (
        ("one.max_tension", "one.swing", "two.max_tension", "two.swing"),
        "wind: {speed: 20 m/s, direction: 1.5}",
    )

    def seen(ice):
        return list(row(scene_of(text + f"  day: {{{ice}{wind}}}\n", "case=day"), *names)[0].values())

    assert seen("ice: {thickness: 9 mm, on: [two]}, ") == seen("")[:2] + seen("ice: {thickness: 9 mm}, ")[2:]


# ------------------------------------------------------------------------------------------------------- mistakes


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("lost: [nort-high]", 'cases.b.lost.0: unknown cable "nort-high" (did you mean north-high?)'),
        ("lost: [mast]", 'cases.b.lost.0: unknown cable "mast" (allowed: north-low'),
        ("lost: [north]", 'cases.b.lost.0: unknown cable "north" (did you mean north-'),
        ("lost: north-high", "cases.b.lost: expected a list"),
        ("lost: {north-high: 1}", "cases.b.lost: expected a list"),
        ("lost: [3]", "cases.b.lost.0: expected text, got 3"),
        ("lost: [north-low, north-low]", "cases.b.lost.1: north-low is named twice"),
        (f"lost: [{', '.join(CABLES)}]", "cases.b.lost: no cable is left"),
        ("ice: {weight: 3 N/m, on: []}", "cases.b.ice.on: expected at least 1 item, got 0"),
        ("ice: {weight: 3 N/m, on: [mast]}", 'cases.b.ice.on.0: unknown cable "mast"'),
        ("ice: {weight: 3 N/m, on: east-low}", "cases.b.ice.on: expected a list"),
        ("ice: {weight: 3 N/m, on: [east-low, east-low]}", "cases.b.ice.on.1: east-low is named twice"),
        ("ice: {on: [east-low]}", "cases.b.ice: missing key: one of thickness, weight"),
        ("wind: {speed: 3, on: [tower]}", 'cases.b.wind.on.0: unknown cable or body "tower"'),
        ("wind: {speed: 3, on: [mast, mast]}", "cases.b.wind.on.1: mast is named twice"),
        (
            "lost: [east-low], loads: {east-low: [{fraction: 0.5, mass: 3 kg}]}",
            "cases.b.loads.east-low: east-low is lost",
        ),
        (
            "lost: [east-low], ice: {weight: 3 N/m, on: [east-low]}",
            "cases.b.ice.on.0: east-low is lost in this load case",
        ),
        (
            "lost: [east-low], wind: {speed: 3, on: [mast, east-low]}",
            "cases.b.wind.on.1: east-low is lost in this load",
        ),
    ],
)
def test_mistakes_are_one_line_each(case, words):
    (line,) = mistakes_of(f"base: {MAST}\n", f"cases={{b: {{{case}}}}}", "case=b")
    assert words in line


def test_wind_on_a_body_needs_its_area():
    text = SPANS.replace("MASS", "1").replace("        wind: {area: [1 m^2, 1 m^2, 1 m^2], drag_coefficient: 1.1}}",
                                              "}").replace("[0, 0, 0]},\n}", "[0, 0, 0]}}")  # fmt: skip
    (line,) = mistakes_of(text + "  b: {wind: {speed: 3, on: [box]}}\n", "case=b")
    assert "cases.b.wind.on.0: box has no key wind (area, drag_coefficient)" in line


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("{lost: [cable]}", "cases.x.lost: unknown key for one cable: without it nothing is left"),
        (
            "{ice: {weight: 3 N/m, on: [cable]}}",
            "cases.x.ice.on: unknown key for one cable: ice and steady wind act on it",
        ),
        (
            "{wind: {speed: 3 m/s, on: [cable]}}",
            "cases.x.wind.on: unknown key for one cable: ice and steady wind act on",
        ),
    ],
)
def test_one_cable_has_none_of_these(case, words):
    done = run("static", CONFIGS / "guy.yaml", "--case", "x", "--set", f"cases.x={case}", code=2)
    assert len(done.lines) == 1
    assert words in done.err


def test_a_study_varies_what_is_lost():
    text = "set: {case: broken}\nvary: [{cases.broken.lost: [[], [north-high], [north-low, north-high]]}]\n"
    study = study_file(".", f"{text}columns: [north-high.max_tension, max_tension, mast.roll]\n", base=MAST)
    rows = table_of("sweep", study, "--no-write", code=3)
    assert [one["status"] for one in rows] == [
        "ok", "north-high is lost in the load case broken",
        f"north-high is lost in the load case broken; {FALLEN}: mast",
    ]  # fmt: skip
    assert rows[1]["max_tension_N"] > 1.5 * rows[0]["max_tension_N"]
    assert np.sign(rows[1]["mast.roll_deg"]) == 1  # southwards, away from what is lost
