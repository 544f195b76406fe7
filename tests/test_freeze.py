"""The command freeze: the scene with its lengths in full has the tables of the scene."""

import os
import subprocess
import sys

import numpy as np
import pytest
from command import CONFIGS, LONGEST, refusal, refused_in_one_line, run, table_of, with_sets, write

import cablestudy as cs
from cablestudy.scene.strict_yaml import compose, write_yaml
from cablestudy.study.scene_kind import kind_of

ROUNDING = 1e-12  # of the largest number of a column
SCENES = {
    "a preload in percent": ("guy.yaml", ()),
    "a horizontal tension": ("line.yaml", ()),
    "loads": ("zipline.yaml", ()),
    "loads in the reference state": ("zipline.yaml", ("cable.reference.loads=true",)),
    "a sag": ("carlina.yaml", ("cable.sag=2 m",)),
    "fixed elements": ("carlina.yaml", ("cable.preload=800 N", "model.elements=10")),
    "a free point": ("suspensions/mast-guys.yaml", ()),
    "lengths for a pose": ("suspensions/carlina-net.yaml", ()),
    "an attitude that is found": ("suspensions/fast.yaml", ()),
    "force densities": ("suspensions/net-2x2.yaml", ()),
    "a body": ("suspensions/cogiro.yaml", ()),
}


def columns_of(tables):
    """Table and column -> its numbers."""
    found = {}
    for table, rows in tables.items():
        for row in rows:
            for name, value in row.items():
                if isinstance(value, float):
                    found.setdefault((table, name), []).append(value)
    return found


def tables(scene):
    """The tables of static, each a list of rows."""
    answer = scene.compute("static")
    assert not answer.failures
    return {name: table.rows for name, table in (answer.tables or {"": answer.table}).items()}


@pytest.mark.parametrize("name", SCENES)
def test_the_frozen_scene_has_the_tables_of_the_scene(tmp_path, name):
    file, sets = SCENES[name]
    path = tmp_path / "frozen.yaml"
    run("freeze", CONFIGS / file, *with_sets(*sets), "--out", path)
    text = path.read_text(encoding="utf-8")
    assert not {"preload:", "sag:", "tension:", "base:", "solve_for:"} & set(text.split())
    given, again = columns_of(tables(cs.load(CONFIGS / file, set=sets))), columns_of(tables(cs.load(path)))
    assert given.keys() == again.keys()
    for column, values in given.items():
        scale = max(map(abs, values))
        if column[0] in ("stiffness", "bodies", "points"):  # of which the smallest are what others leave
            scale = max(max(map(abs, other)) for key, other in given.items() if key[0] == column[0])
        rounding = 1e-9 if "linear_range" in column[1] else 10 * ROUNDING  # of a change of force: 7e-10 is stated
        assert again[column] == pytest.approx(values, rel=0, abs=rounding * scale), column


def test_lengths_are_those_of_the_reference_state_in_full(tmp_path):
    """Whatever case the scene is in, and with as many digits as a double has: another load case acts on them."""
    path = tmp_path / "built.yaml"
    told = run("freeze", CONFIGS / "guy.yaml", "--set", "case=storm", "--out", path)
    assert told.lines == [f"written: {path}; comments of the file are lost, base and changes are resolved"]
    (row,) = table_of("static", CONFIGS / "guy.yaml", "--case", "everyday")
    assert f"unstretched_length: {row['unstretched_length_m']!r} m" in path.read_text(encoding="utf-8")
    for case in ("storm", "ice-and-wind"):
        (given,), (again,) = (table_of("static", file, "--case", case) for file in (CONFIGS / "guy.yaml", path))
        for name, value in given.items():
            assert again[name] == (pytest.approx(value, rel=ROUNDING) if isinstance(value, float) else value), name


def test_what_is_stated_stays_and_places_are_those_found():
    scene = cs.load(CONFIGS / "suspensions" / "mast-guys.yaml", set={"cables.guy2.unstretched_length": "70.5 m"})
    value = kind_of(scene.model).freeze(scene.document, scene.model)
    assert value["cables"]["guy2"]["unstretched_length"] == "70.5 m"
    damping = {"model": "modal", "ratio": 0.005}
    assert value["cable"] == {"material": "paper/steel", "area": "150 mm^2", "damping": damping}
    found = scene.static()["points"].iloc[0]
    assert value["points"]["top"]["at"] == [found["x_m"], found["y_m"], found["z_m"]]
    assert value["points"]["top"]["force"] == [0, 0, "46.6 kN"]
    stated = cs.load(CONFIGS / "carlina.yaml")
    assert kind_of(stated.model).freeze(stated.document, stated.model)["cable"]["unstretched_length"] == "184.4883 m"


def test_angles_that_are_rounding_are_zero():
    robot = cs.load(CONFIGS / "suspensions" / "cable-robot.yaml")
    assert "attitude: [0.0, 0.0, 0.0]" in robot.freeze()
    net = cs.load(CONFIGS / "suspensions" / "carlina-net.yaml")
    roll, pitch, yaw = kind_of(net.model).freeze(net.document, net.model)["bodies"]["gondola"]["attitude"]
    assert (roll, yaw) == (0.0, 0.0)
    assert np.degrees(pitch) == pytest.approx(net.static()["bodies"].iloc[0]["pitch_deg"], rel=1e-12)


def test_standard_output_and_python_have_the_same_text():
    scene = CONFIGS / "zipline.yaml"
    printed = run("freeze", scene, "--quiet")
    assert printed.err == ""
    heading, _, text = printed.out.partition("\n")
    assert heading.startswith("#")
    assert text == cs.load(scene).freeze()
    assert run("static", "-", stdin=printed.out).out == run("static", scene, "--quiet").out


def test_standard_output_by_name_is_written_into(folder):
    """A file that the shell has opened for it keeps what it has (>>)."""
    scene, log = CONFIGS / "zipline.yaml", folder / "log"
    text = run("freeze", scene, "--quiet").out
    assert run("freeze", scene, "--quiet", "--out", "-").out == text
    assert list(folder.iterdir()) == []
    if os.path.exists("/dev/stdout"):
        write(log, "before\n")
        with log.open("a") as stream:
            command = [sys.executable, "-m", "cablestudy", "freeze", scene, "--out", "/dev/stdout", "--quiet"]
            subprocess.run(command, stdout=stream, check=True, timeout=LONGEST)
        assert log.read_text(encoding="utf-8") == f"before\n{text}"


@pytest.mark.parametrize(
    "value",
    ["1e8", "no", "null", "~", "0x1F", "10 %", "-3", "1:30", ".5", "3.16 lbf/ft", "µm °C", "# not", "a: b", "", "'",
     '"', "true", "[", "- x", "4_000", "2026-01-01", "line\nbreak", "=", "<<", "!tag", "&a", "*a", 1e-300, 1e22, 0.1,
     -0.0, 3, True, [], [[1, 2.5], ["x"]], {"on": {"1": 2}}],
)  # fmt: skip
def test_what_is_written_reads_back(value):
    whole = {"key": value, "again": [value], "null": {"deep": {"deeper": value}}}
    assert compose(write_yaml(whole), "")[0] == whole


def test_lengths_have_their_digits_whatever_they_are():
    values = np.random.default_rng(3).uniform(1, 10, 200) * 10.0 ** np.arange(-100, 100)
    whole = {"lengths": values.tolist()}
    assert compose(write_yaml(whole), "")[0] == whole


def test_what_is_refused(tmp_path):
    scene = tmp_path / "guy.yaml"
    scene.write_bytes((CONFIGS / "guy.yaml").read_bytes())
    line = refusal("freeze", scene, "--out", scene)
    assert line == f"--out {scene}: is the scene itself, whose comments would be lost; give another name"
    assert scene.read_bytes() == (CONFIGS / "guy.yaml").read_bytes()
    built = tmp_path / "built.yaml"
    built.write_text("base: guy.yaml\n")
    line = refusal("freeze", built, "--out", scene)
    assert line == f"--out {scene}: is a file that the scene reads, whose comments would be lost; give another name"
    assert scene.read_bytes() == (CONFIGS / "guy.yaml").read_bytes()
    assert "below the least" in refusal("freeze", scene, "--set", "cable.preload=1 mN", code=3)
    folder = tmp_path / "empty"
    folder.mkdir()
    refused_in_one_line(folder, "this is a study", "freeze", CONFIGS / "preload.yaml", "--out", folder / "x.yaml")
    refused_in_one_line(folder, "cannot be written", "freeze", scene, "--out", folder / "none" / "x.yaml")


def test_a_stated_number_is_printed_as_stated():
    """Not as what the search for the length leaves of it; of a case, and of fixed elements, it is another number."""
    cables = table_of("static", CONFIGS / "suspensions" / "mast-guys.yaml", "--table", "cables")
    assert [cable["preload_N"] for cable in cables] == [20000.0] * 3
    for sag in (0.3, 0.7, 1.1):
        model = "--set", f"cable.sag={sag} m", "--set", "model={accuracy: 1e-4}"
        assert table_of("static", CONFIGS / "carlina.yaml", *model)[0]["sag_m"] == sag
