"""The command ssm for suspensions, modes that are left out, and pictures of coupled modes."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from command import CARLINA, refused_in_one_line, rows_of, run, table_of, written
from references import bar_suspension
from scipy.io import loadmat
from solved import contents
from suspension_cases import SUSPENSIONS, case_at
from suspension_scenes import platform
from test_suspension_ssm import MARKERS, WINCHES, agree, by_bars, model
from twins import held, without

import cablestudy as cs
from cablestudy import plots
from cablestudy.cable.damping import Damping
from cablestudy.control.statespace import state_space_of
from cablestudy.control.suspension import suspension_system
from cablestudy.statics.suspension import outward_tangents
from cablestudy.study.scene_kind import kind_of
from cablestudy.study.ssm import StateSpaceOptions
from cablestudy.study.suspension.node_forces import with_node_forces
from cablestudy.system.cables import Models
from cablestudy.system.coupled import Layout
from cablestudy.system.hanging_cables import Cables, FixedModel, fixed_meshes
from cablestudy.system.linear import LinearSystem
from cablestudy.system.modal_reduction import inertia_shares, keep_modes, truncate_modes

BALLOON, NET = (str(SUSPENSIONS / f"{name}.yaml") for name in ("carlina-balloon", "carlina-net"))
GONDOLA = ["x", "y", "z", "rx", "ry", "rz"]
LOADS = ["force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z"]

# A mass of 3 kg free along x between two cables of almost no mass, 2 m and 4 m long, EA 1e5 N, drawn to 500 N: each is
# a spring EA/L at a unit movement along it.
BETWEEN = """
gravity: 0
cable: {elastic_modulus: 100 GPa, area: 1 mm^2, density: 1e-6 kg/m^3}
bodies:
  mass: {at: [2, 0, 0], mass: 3 kg, inertia: [1, 1, 1], attachments: {a: [0, 0, 0]}, free: [x]}
cables:
  left: {from: [0, 0, 0], to: mass.a, unstretched_length: 1.9900497512437811}
  right: {from: [6, 0, 0], to: mass.a, unstretched_length: 3.9800995024875623}
winches: {left: {}, right: {end: to}}
"""
LEFT, RIGHT = 1e5 / 1.9900497512437811, 1e5 / 3.9800995024875623  # [N/m]


pytestmark = pytest.mark.usefixtures("folder")


def read(path):
    """Content of a file of a state space, matrices as arrays and names as lists."""
    path = Path(path)
    if path.suffix == ".json":
        found = json.loads(path.read_text(encoding="utf-8"))
    elif path.suffix == ".npz":
        with np.load(path) as file:
            found = dict(file)
    else:
        found = {name: value for name, value in loadmat(path, spmatrix=False).items() if not name.startswith("__")}
        found |= {
            name: [str(row[0][0]) for row in value] for name, value in found.items() if name.endswith(("Name", "Unit"))
        }
        # sparse in the MATLAB file
        found |= {name: found[name].toarray() for name in ("Mass", "Damping", "Stiffness") if name in found}
    return {name: list(map(str, v)) if name.endswith(("Name", "Unit")) else np.array(v) for name, v in found.items()}


def response(found, frequency):
    """Of a file, C (s I - A)^-1 B + D + s D1 + s^2 D2, for each frequency [Hz]."""
    s = 2j * np.pi * frequency
    direct = found["D"] + s * found["D1"] + s**2 * found["D2"]
    return found["C"] @ np.linalg.solve(s * np.eye(len(found["A"])) - found["A"], found["B"]) + direct


def same_files(*arguments):
    """What `ssm` writes, the same in files of all kinds; and the lines of the last command."""
    for kind in ("npz", "mat", "json"):
        done = run("ssm", *arguments, "--out", f"m.{kind}")
        assert (done.out, done.lines[-1]) == ("", f"written: m.{kind}")
    first, *others = (read(f"m.{kind}") for kind in ("npz", "mat", "json"))
    for other in others:
        assert set(other) == set(first)
        for name, value in first.items():
            if isinstance(value, list):
                assert other[name] == value
            else:
                assert np.array_equal(np.squeeze(other[name]), np.squeeze(value))
    return first, done.lines


def table(*arguments):
    return rows_of(run("ssm", *arguments, "--format", "csv").out, "csv")


# ---------------------------------------------------------------------------------------- modes that are left out


def test_all_modes_are_the_whole_system():
    state = platform()
    damping = Damping("modal", viscous=0.02)
    whole = suspension_system(*model(state, damping), WINCHES, MARKERS)
    every = keep_modes(whole, np.arange(len(whole.mass)))
    for frequency in (0.7, 2.0, 15.0):
        expected = by_bars(state, frequency, 0.02, 0.0)
        found = state_space_of(every).response(2j * np.pi * np.array([frequency]), derivatives=True)[0]
        one = np.array([[every.response(o, i, np.array([frequency]))[0] for i in range(9)] for o in range(25)])
        agree(found, expected, 1e-7)
        agree(one, expected, 1e-7)


def test_modes_left_out_keep_their_static_part():
    state = platform()
    whole = suspension_system(*model(state, Damping("modal", viscous=0.02)), WINCHES, MARKERS)
    few = state_space_of(keep_modes(whole, np.array([0, 2, 5, 9])))
    assert len(few.a) == 8
    agree(few.response(np.zeros(1))[0], by_bars(state, 1e-9, 0.02, 0.0), 1e-8)


@pytest.mark.parametrize("time", [0.0, 3e-4])
def test_without_the_static_part_all_nodes_move_as_the_modes_that_are_kept(time):
    """Not at ends at the body: there the bars' last node has a mass, whose inertia moves the modes left out too."""
    state, kept, inputs = platform(), [0, 1, 4, 7, 12], np.delete(np.arange(9), 2)
    outputs = [*range(9), *range(9, 25, 2)]
    damping = Damping("kelvin_voigt" if time else "modal", time=time, viscous=0.02)
    whole = suspension_system(*model(state, damping), WINCHES, MARKERS)
    few = state_space_of(truncate_modes(whole, np.array(kept)), whole)
    frequencies = (1e-3, 0.7, 2.0, 15.0)
    expected = np.array([by_bars(state, one, 0.02, time, kept) for one in frequencies])[:, outputs][:, :, inputs]
    found = few.response(2j * np.pi * np.array(frequencies), derivatives=True)[:, outputs][:, :, inputs]
    size = np.abs(expected).max(axis=(0, 2))
    assert np.abs(found - expected).max(axis=(0, 2)) / size == pytest.approx(0 * size, abs=1e-9)


def test_without_the_static_part_only_the_dynamics_of_other_modes_are_missing():
    """Each c g/(W^2 + s^2) by an own sum over the modes of dense matrices; of all inputs."""
    state = platform()
    whole = suspension_system(*model(state), WINCHES, MARKERS)
    square, shapes = scipy.linalg.eigh(whole.stiffness, whole.mass)
    for frequency in (1e-3, 0.7, 15.0):
        s = 2j * np.pi * frequency
        left, right = whole.c[0] @ shapes - square * (whole.c[2] @ shapes), shapes.T @ whole.b[0]
        right = right - square[:, None] * (shapes.T @ whole.b[2])
        missing = (left[:, 5:] / (square[5:] + s**2)) @ right[5:]
        exact, few = (
            np.array([[one.response(o, i, np.array([frequency]))[0] for i in range(9)] for o in range(25)])
            for one in (whole, truncate_modes(whole, np.arange(5)))
        )
        agree(missing + few, exact, 1e-8)


@pytest.mark.parametrize("residual", [True, False])
def test_forces_on_nodes_of_cables_are_those_on_the_nodes_of_bars(residual):
    """Displacements of the body and tensions, by forces on all inner nodes of two cables."""
    state, viscous = platform(), 0.02
    cables = Cables(state.catenary, Damping("modal", viscous=viscous))
    models = Models(cables, fixed_meshes(cables, FixedModel(8)), fixed=True)
    layout, coordinates = Layout(state), models.coordinates(np.full(cables.count, np.inf))
    whole = with_node_forces(suspension_system(layout, coordinates.kept), layout, coordinates)
    names = [name for name, _ in whole.inputs]
    chosen = [names.index(f"c{cable}.force_node_1_x") + np.arange(21) for cable in (2, 7)]
    chosen = np.concatenate(chosen)
    few = state_space_of(whole if residual else truncate_modes(whole, np.arange(9)), whole)
    reference, rate = bar_suspension.dense(state, 8), viscous / 0.3
    shapes = reference.modes()[1][:, slice(None) if residual else slice(9)]
    direction = outward_tangents(state)[0]
    places = np.concatenate([21 * cable + np.arange(21) for cable in (1, 6)])
    for frequency in (1e-3, 0.7, 15.0):
        s = 2j * np.pi * frequency
        balance = reference.K + s**2 * reference.M
        for move, (_, M, _) in zip(reference.maps, reference.cables, strict=True):
            balance = balance + rate * s * move.T @ M @ move
        force = np.eye(len(balance))[:, places]
        x = shapes @ np.linalg.solve(shapes.T @ balance @ shapes, shapes.T @ force)
        expected = [x[-6:]]
        for cable, ((K, M, _), move) in enumerate(zip(reference.cables, reference.maps, strict=True)):
            held = (K + (s**2 + rate * s) * M) @ (move @ x)
            expected.append(np.stack([direction[cable, 0] @ held[:3], direction[cable, 1] @ held[-3:]]))
        expected = np.concatenate(expected)
        found = few.response(np.array([s]), derivatives=True)[0][:, chosen]
        if not residual:  # the last nodes at the body have a mass: see above
            found, expected = (np.delete(part, np.s_[7::2], axis=0) for part in (found, expected))
        agree(found, expected, 1e-7)


@pytest.mark.parametrize("damping", [Damping("modal", ratio=0.02), Damping("kelvin_voigt", time=3e-3)])
def test_few_modes_are_reciprocal(damping):
    """A load moves another place as much as a load there moves this one (Maxwell, Betti), where damping couples modes
    that are kept with others too.
    """
    whole = suspension_system(*model(platform(), damping))
    assert [name for name, _ in whole.inputs] == [f"gondola.{load}" for load in LOADS]
    assert [name for name, _ in whole.outputs[:6]] == [f"gondola.{axis}" for axis in GONDOLA]
    few = state_space_of(keep_modes(whole, np.arange(12))).response(2j * np.pi * np.array([0.7, 15.0]))[:, :6]
    size = np.sqrt(np.abs(np.einsum("fii->fi", few)))
    asymmetry = (few - few.swapaxes(1, 2)) / (size[:, :, None] * size[:, None])
    assert np.abs(asymmetry).max() < 1e-10


def test_fewer_modes_err_by_the_square_of_the_frequency():
    state = platform()
    whole = suspension_system(*model(state, Damping()), WINCHES, MARKERS)
    omega = 1 / np.sqrt(whole.strain_modes[0])
    kept = keep_modes(whole, np.arange(30))
    for output, input_ in ((0, 0), (8, 4), (20, 4)):
        low = np.array([0.02, 0.04]) * omega[30] / (2 * np.pi)
        error = np.abs(kept.response(output, input_, low) - whole.response(output, input_, low))
        assert error[1] / error[0] == pytest.approx(4, rel=0.02)


@pytest.mark.parametrize(("viscous", "time", "least"), [(0.0, 0.0, 15.5), (0.02, 0.0, 15.5), (0.02, 3e-3, 11.5)])
def test_tensions_by_winches_err_by_the_fourth_power_of_the_frequency(viscous, time, least):
    """With all of the inertia and damping of the modes left out, against dense bars; by damped strain a cubic part."""
    state = platform()
    damping = Damping("kelvin_voigt" if time else "modal", time=time, viscous=viscous)
    whole = suspension_system(*model(state, damping), WINCHES, MARKERS)
    few = state_space_of(keep_modes(whole, np.arange(12)))
    errors = []
    for frequency in (0.05, 0.1):
        found = few.response(np.array([2j * np.pi * frequency]), derivatives=True)[0]
        errors.append(np.abs(found - by_bars(state, frequency, viscous, time))[9:, :3])
    assert (errors[1] / errors[0]).min() > least


@pytest.mark.parametrize(("output", "input_"), [(0, 0), (2, 5), (5, 8), (7, 2)])
def test_the_share_of_a_mode_in_the_inertia_is_what_leaving_it_out_changes(output, input_):
    """At low frequencies the response without a mode misses w^2 times a number that is in proportion to its share."""
    whole = suspension_system(*model(platform(), Damping(ratio=0.0)), WINCHES, MARKERS)
    share = inertia_shares(whole, output, input_)
    assert share.sum() == pytest.approx(1, abs=1e-12)
    omega = 1 / np.sqrt(whole.strain_modes[0])
    low = np.array([1e-2 * omega[0] / (2 * np.pi)])
    exact = whole.response(output, input_, low)
    largest = np.argsort(share)[-4:]
    missed = [
        abs((keep_modes(whole, np.delete(np.arange(len(share)), k)).response(output, input_, low) - exact)[0])
        for k in largest
    ]
    assert np.array(missed) / missed[-1] == pytest.approx(share[largest] / share[largest[-1]], rel=1e-3)


def test_a_response_at_an_undamped_pole_is_no_number():
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    stiffness = np.array([[np.pi * np.pi]])  # resonance at 0.5 Hz
    parts = one, none, none
    system = LinearSystem(one, none, stiffness, parts, c=parts, d=(none,) * 3)
    found = system.response(0, 0, np.array([0.25, 0.5, 1.0]))
    assert np.isfinite(found).tolist() == [True, False, True]
    assert found[[0, 2]].real == pytest.approx([1 / (0.75 * np.pi**2), -1 / (3 * np.pi**2)], rel=1e-14)


# ---------------------------------------------------------------------------------------------------- closed forms


def test_a_mass_between_two_springs():
    run("ssm", written(BETWEEN), "--set", "cable.damping.ratio=0", "--out", "between.json")
    found = read("between.json")
    assert found["InputName"] == ["winch.left", "winch.right", "mass.force_x"]
    assert found["OutputName"] == ["mass.x", *(f"{c}.tension_{e}" for c in ("left", "right") for e in ("from", "to"))]
    assert found["OutputUnit"] == ["m", "N", "N", "N", "N"]
    wound = 1.005  # 1 + T/EA
    for frequency in (0.0, 10.0, 40.0):
        stiffness = LEFT + RIGHT - 3 * (2 * np.pi * frequency) ** 2
        x = np.array([-LEFT * wound, RIGHT * wound, 1.0]) / stiffness
        left, right = LEFT * (x + np.array([wound, 0, 0])), RIGHT * (np.array([0, wound, 0]) - x)
        expected = np.array([x, left, left, right, right])
        assert response(found, frequency) == pytest.approx(expected, rel=1e-6, abs=1e-9 * np.abs(expected).max())


# ---------------------------------------------------------------------------------------------------- the command


def test_files_of_all_kinds_hold_the_same():
    first, lines = same_files(BALLOON, "--modes", 5)
    assert re.fullmatch(r"state space: 10 states, 12 inputs, 30 outputs; 5 of \d+ modes", lines[0])
    assert first["InputName"] == [
        *(f"winch.lower{k}" for k in (1, 2, 3)),
        *(f"gondola.{load}" for load in LOADS),
        *(f"knot.{load}" for load in LOADS[:3]),
    ]
    cables = [f"{group}{k}" for group in ("upper", "bridle", "lower") for k in (1, 2, 3)]
    assert first["OutputName"] == [
        *(f"gondola.{axis}" for axis in GONDOLA),
        *(f"knot.{axis}" for axis in "xyz"),
        *(f"gondola.focus.{axis}" for axis in "xyz"),
        *(f"{cable}.tension_{end}" for cable in cables for end in ("from", "to")),
    ]
    assert first["StateName"] == [f"mode_{k}_{what}" for what in ("amplitude", "velocity") for k in range(1, 6)]
    assert first["A"].shape == (10, 10)
    assert not np.any(first["D1"][:12])  # displacements need no derivatives of inputs
    assert not np.any(first["D2"][:12])
    assert first["Mass"].shape == (len(first["CoordinateName"]),) * 2


def test_the_poles_are_the_modes_with_their_damping():
    run("ssm", NET, "--modes", 6, "--out", "net.npz")
    poles = np.linalg.eigvals(read("net.npz")["A"])
    poles = poles[poles.imag > 0]
    poles = poles[np.argsort(np.abs(poles))]
    rows = table_of("modes", NET, "-n", 6)
    assert np.abs(poles) / (2 * np.pi) == pytest.approx([row["frequency_Hz"] for row in rows], rel=1e-4)
    assert -poles.real / np.abs(poles) == pytest.approx([row["damping_ratio"] for row in rows], rel=0.02)


def test_which_modes_are_kept():
    rows = table_of("modes", NET)
    assert table(NET) == [{name: row[name] for name in row if name != "lock_in_speed_m_per_s"} for row in rows]
    assert [row["number"] for row in table(NET, "--modes", 3)] == [1, 2, 3]
    assert [row["number"] for row in table(NET, "--upto", "1.2Hz")] == [1, 2, 3]
    some = table(NET, "--error", 0.05, "--input", "gondola.force_z", "--output", "gondola.z")
    assert [row["moves"] for row in some] == ["gondola z"]
    done = run("ssm", NET, "--error", 0.05, "--input", "gondola.force_z", "--output", "gondola.z", "--explain")
    left = re.search(
        r"left out: \d+ modes, which carry (\S+) of the inertia between gondola.force_z and gondola.z", done.err
    )
    assert 0 < float(left[1]) <= 0.05
    assert "no error of a response is stated" in done.err


def test_responses_of_few_modes_are_as_wrong_as_the_documentation_says():
    """docs/control.md: with 12 modes, against all; relative errors at a tenth and at half of the highest one kept."""
    pairs = ("winch.u1", "gondola.x"), ("gondola.moment_y", "gondola.ry")
    few, every = (cs.load(NET).state_space(modes=modes) for modes in (12, 66))
    s = 1j * np.abs(np.linalg.eigvals(few.a)).max() * np.array([0.1, 0.5])
    found, exact = (
        [[(one.c[one.output_names.index(output)] @ np.linalg.solve(at * np.eye(len(one.a)) - one.a, one.b)
           + one.d[one.output_names.index(output)])[one.input_names.index(input_)] for at in s]
         for input_, output in pairs]
        for one in (few, every)
    )  # fmt: skip
    assert np.abs(np.divide(found, exact) - 1) == pytest.approx(np.array([[6e-4, 8e-3], [2e-3, 4e-2]]), rel=0.25)


@pytest.mark.parametrize("style", ["csv", "json", "jsonl"])
def test_a_response_is_that_of_the_file(style):
    options = ("--response", "0.05Hz:0.8Hz:4", "--input", "winch.lower2", "--output", "lower1.tension_to", "--modes", 9)
    rows = rows_of(run("ssm", BALLOON, *options, "--format", style).out, style)
    run("ssm", BALLOON, "--modes", 9, "--out", "m.npz")
    found = read("m.npz")
    place = found["OutputName"].index("lower1.tension_to"), found["InputName"].index("winch.lower2")
    assert list(rows[0]) == ["frequency_Hz", "magnitude_N_per_m", "phase_deg"]
    for row in rows:
        value = row["magnitude_N_per_m"] * np.exp(1j * np.radians(row["phase_deg"]))
        assert value == pytest.approx(response(found, row["frequency_Hz"])[place], rel=1e-9)


def test_units_of_a_response():
    options = ("--response", "0.1:1:2", "--modes", 3)
    for signal, column in (
        (("gondola.moment_z", "gondola.rz"), "magnitude_rad_per_Nm"),
        (("gondola.force_x", "gondola.x"), "magnitude_m_per_N"),
        (("gondola.force_x", "u1.tension_to"), "magnitude"),
    ):
        assert column in table(NET, *options, "--input", signal[0], "--output", signal[1])[0]


def test_a_response_has_the_modes_up_to_its_end():
    done = run("ssm", NET, "--response", "0.1:4:2", "--explain")
    assert "warning" not in done.err
    assert int(re.search(r"modes: (\d+) of a linear model", done.err)[1]) > 12
    done = run("ssm", NET, "--response", "0.1:4:2", "--modes", 3)
    kept = f"{table(NET, '--modes', 3)[-1]['frequency_Hz']:.4g} Hz"
    assert done.lines == [
        f"warning: the highest mode kept is at {kept}: of those above only the static part is in the response;"
        " see --modes and --upto"
    ]
    assert run("ssm", NET, "--response", "0.1:4:2", "--modes", 3, "--quiet").err == ""


def test_plain_truncation_warns_with_both_static_responses():
    """That of all modes is the compliance of the two springs, of the lowest mode less by what the others carry."""
    written(BETWEEN, "between.yaml")
    pair = "--input", "mass.force_x", "--output", "left.tension_to"
    done = run("ssm", "between.yaml", "--modes", 1, "--no-residual", *pair, "--error", 0.5, code=2)
    assert done.err == "--modes, --upto and --error exclude each other\n"
    done = run("ssm", "between.yaml", "--modes", 1, "--no-residual", *pair, "--response", "0.1:1:2", "--explain")
    (line,) = [line for line in done.lines if line.startswith("warning")]
    words = "warning: --no-residual leaves out the static part of the omitted modes: static response of left.tension_to"
    found = re.fullmatch(rf"{words} to mass.force_x (\S+) instead of (\S+)", line)
    assert float(found[2]) == pytest.approx(LEFT / (LEFT + RIGHT), rel=1e-4)
    assert any(line.endswith("their static part is left out too") for line in done.lines)
    assert "warning" not in run("ssm", "between.yaml", "--modes", 1, *pair, "--response", "0.1:1:2").err
    (low, *_) = table("between.yaml", "--modes", 1, "--no-residual", *pair, "--response", "0.1:1:2")
    assert low["magnitude"] == pytest.approx(float(found[1]), rel=1e-4)


def test_forces_on_nodes_of_a_file_are_numbered_from_the_end_from():
    net, cables = (NET, "--set", "model.elements=4"), ("u1", "u2", "u3", "d1", "d2", "d3")
    run("ssm", *net, "--modes", 3, "--wind", "--out", "m.npz")
    assert read("m.npz")["InputName"][12:] == [
        f"{cable}.force_node_{node}_{axis}" for cable in cables for node in (1, 2, 3) for axis in "xyz"
    ]
    one = "--response", "0.1:1:2", "--input", "u2.force_node_3_z", "--output", "gondola.z"
    assert list(table(*net, "--wind", *one)[0]) == ["frequency_Hz", "magnitude_m_per_N", "phase_deg"]
    assert "--input u2.force_node_3_z: unknown" in run("ssm", *net, *one, code=2).err


def test_what_is_assumed_is_said():
    nothing = "--set", "cable.damping=null", "--set", "winches={}"
    done = run("ssm", NET, *nothing, "--modes", 3, "--explain")
    assert "damping: none is given for the scene; modal, with a ratio of 1 %, is assumed" in done.lines
    assert "winches: the scene names none, and no cable is reeled in" in done.lines


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--response 1:2:3 --input winch.lower", "--input winch.lower: unknown (did you mean winch.lower"),
        ("--error 0.1 --output gondola.yaw", "--output gondola.yaw: unknown"),
        ("--error 0.1 --output 1", "allowed: gondola.x, gondola.y,"),
        ("--input winch.lower1", "--input: no effect: for --response, --error and --out only"),
        ("--with gondola", "--with gondola: no effect: the bodies of a suspension are always attached"),
        ("--kinds axial,sideways", "--kinds: unknown kind 'sideways'"),
        ("--kinds axial --modes 500", "--modes 500: the model has "),
        ("--with loop", "control: missing key: 'cablestudy ssm --with loop' needs it"),
        ("--with actuators", "actuators: missing key: 'cablestudy ssm --with actuators' needs it"),
        ("--with actuators --plot a.png", "--plot: needs --response, which it draws"),
        ("--modes 3 --upto 2Hz", "exclude each other"),
        ("--plot bode.png", "--response"),
        ("--out m.txt", ".npz, .mat, .json"),
    ],
)
def test_mistakes_are_one_line(folder, options, words):
    refused_in_one_line(folder, words, "ssm", BALLOON, *shlex.split(options))


def test_more_modes_than_there_are():
    written(BETWEEN, "between.yaml")
    exact = ("--set", "model.elements=2", "--set", "model.order=1")
    # one inner node of each cable, and the mass
    assert len(table("between.yaml", *exact)) == 7
    assert run("ssm", "between.yaml", *exact, "--modes", 8, code=2).lines == ["--modes 8: the model has 7 modes"]
    done = run("ssm", SUSPENSIONS / "net-30x30.yaml", code=3)
    assert done.lines[0].endswith("the linear model has 2700 coordinates, and a state space is made of at most 2000")


def test_a_cable_between_fixed_ends():
    """The winch and the tension at its end: the modes that one cable alone keeps for a movement along it."""
    cable = "{elastic_modulus: 200 GPa, density: 7850 kg/m^3, diameter: 4 mm}"
    held = f"cable: {cable}\ncables: {{c: {{from: [0, 0, 0], to: [8, 0, 0], preload: 5 kN}}}}\n"
    written(held, "held.yaml")
    written(held + "winches: {c: {}}\n", "wound.yaml")
    alone = cable[:-1] + ", ends: [[0, 0, 0], [8, 0, 0]], preload: 5 kN}"
    written(f"cable: {alone}\nmodel: {{elements: 8, order: 4}}\n", "alone.yaml")
    exact = ("--set", "model.elements=8", "--set", "model.order=4")
    found = table("wound.yaml", *exact, "--error", 0.1, "--output", "c.tension_from")
    single = table("alone.yaml", "--error", 0.1, "--input", "end_1_x", "--output", "end_1_x")
    assert 2 < len(single) < 40
    assert [row["frequency_Hz"] for row in found] == pytest.approx([row["frequency_Hz"] for row in single], rel=1e-9)
    # nothing to keep
    run("ssm", "wound.yaml", "--upto", "0.1Hz", "--out", "none.json")
    assert read("none.json")["D"].shape == (2, 1)
    assert len(table("wound.yaml", "--upto", "0.1Hz", "--response", "1:2:3")) == 3
    # without a winch its ends are the inputs, as of one cable
    for name in ("held", "alone"):
        run("ssm", f"{name}.yaml", *exact, "--modes", 7, "--wind", "--out", f"{name}.json")
    twin, one = read("held.json"), read("alone.json")
    assert twin["InputName"] == [f"c.{name}" for name in one["InputName"]]
    assert twin["OutputName"] == [*(f"c.{name}" for name in one["OutputName"]), "c.tension_from", "c.tension_to"]
    for frequency in (1.0, 20.0, 500.0):
        found, expected = (response(file, frequency)[:6, :6] for file in (twin, one))
        agree(found, expected, 1e-9)
        agree(response(twin, frequency)[[6, 7], :6], [[-1], [1]] * expected[[0, 3]], 1e-3)  # but for the sag
    agree(response(twin, 0.0)[:6, 6:], response(one, 0.0)[:, 6:], 1e-9)  # forces on nodes
    (low, *_) = table("held.yaml", *exact, "--response", "1:2:2", "--input", "c.end_1_x", "--output", "c.end_2_x")
    assert low["magnitude_N_per_m"] == pytest.approx(abs(response(twin, 1.0)[3, 0]), rel=1e-4)


@pytest.mark.parametrize("options", [
    {"kinds": "axial", "count": 3}, {"kinds": "inplane", "upto": "5 Hz", "residual": False},
    {"kinds": "outofplane", "error": 0.1, "input": "cable.end_2_y", "output": "cable.end_2_y"},
])  # fmt: skip
@pytest.mark.parametrize("sets", [(), ("gravity=0",)])
def test_modes_of_kinds_are_those_of_one_cable(options, sets):
    """Without gravity modes in the plane and out of it have equal frequencies."""
    scene = contents(CARLINA, "model={elements: 6, order: 3}", *sets)
    scene = without(scene, "gondola", "winch", "wind", "correction", "exposure")
    choices = []
    for data in (scene, held(scene)):
        read = cs.load(data)
        chosen = kind_of(read.model).ssm.choose(read.document, read.model, StateSpaceOptions(**options))
        choices.append((chosen.mode_table().rows, chosen.system().response([2j * np.pi, 50j], derivatives=True)))
    (own, expected), (of_twin, found) = choices
    assert [row["frequency_Hz"] for row in of_twin] == pytest.approx([row["frequency_Hz"] for row in own], rel=1e-9)
    assert [row["moves"] for row in of_twin] == [f"cable {row['type']}" for row in own]
    assert np.abs(found[:, :6] - expected).max() < 1e-9 * np.abs(expected).max()


def test_modes_of_bodies_are_kept_with_those_of_kinds():
    moves = [row["moves"] for row in table(BALLOON, "--kinds", "outofplane", "--upto", "0.9Hz")]
    assert {name.split()[-1] for name in moves} == {"x", "y", "z", "cables", "out-of-plane"}


def test_an_end_beside_winches_is_an_input_where_it_is_named():
    """Of a mass between two springs, with ground and mass at the ends of the left one."""
    command = ("ssm", written(BETWEEN), "--set", "cable.damping.ratio=0", "--out", "few.json")
    run(*command, "--input", "left.end_1_x,winch.right", "--output", "mass.x,left.end_1_x")
    found = read("few.json")
    assert (found["InputName"], found["OutputName"]) == (
        ["left.end_1_x", "winch.right"],
        ["mass.x", "left.force_end_1_x"],
    )
    stiffness = LEFT + RIGHT - 3 * (2 * np.pi * 10.0) ** 2
    x = np.array([LEFT, 1.005 * RIGHT]) / stiffness
    agree(response(found, 10.0), np.array([x, LEFT * (np.array([1, 0]) - x)]), 1e-6)
    assert "--input left.end_2_x: unknown" in run(*command, "--input", "left.end_2_x", code=2).err


# ---------------------------------------------------------------------------------------------- pictures of modes


def test_the_picture_of_modes_shows_the_displaced_suspension():
    case = case_at("trifilar")
    found = case.modes(8)
    figure = plots.coupled_mode_shapes(case, found)
    panels = [axes for axes in figure.axes if axes.get_title(loc="left")]
    assert len(panels) == 8
    for number, axes in enumerate(panels):
        assert axes.get_title(loc="left").startswith(f"{number + 1}   ")
        assert axes.texts[0].get_text() == found.moves[number]
    assert figure.get_suptitle() == "8 modes, scaled to a peak of 0.2 m, on the static form (grey)"
    # the swinging disc: drawn 0.2 m beside itself in space, the projection of which is near to true scale
    grey, moved = [line.get_xydata()[0] for line in panels[0].lines if line.get_marker() == "s"]
    assert 0.02 < np.linalg.norm(moved - grey) < 0.22


def test_the_body_that_turns_is_enlarged():
    case = case_at("carlina-net", "bodies.gondola.mass=500 kg", "bodies.gondola.inertia=[800, 800, 1000]")
    found = case.modes(6)
    figure = plots.coupled_mode_shapes(case, found)
    enlarged = [[child.get_title() for child in axes.child_axes] for axes in figure.axes]
    turning = [moves.split(" ")[1] in ("roll", "pitch", "yaw") for moves in found.moves]
    assert [titles == ["gondola"] for titles in enlarged] == turning
    assert sum(turning) == 3


def test_the_command_draws_modes():
    run("modes", NET, "-n", 2, "--plot", "modes.svg")
    drawn = Path("modes.svg").read_text(encoding="utf-8")
    assert drawn.startswith("<?xml")
    assert len(drawn) > 10_000
    assert run("modes", NET, "--upto", "0.1Hz", "--plot", "none.png").code == 0
    case = case_at("carlina-net")
    figure = plots.coupled_mode_shapes(case, case.modes(3), 0)
    assert figure.get_suptitle() == "There is no mode to show"


def test_what_stated_tensions_mean_is_said_by_every_command():
    """With 500 N in the left cable the mass is 2 m along; the load on the right one may belong to the state or not."""
    stated = BETWEEN.replace("unstretched_length: 1.9900497512437811", "preload: 500")
    stated = stated.replace("at: [2, 0, 0]", "at: [1.5, 0, 0]")
    scene = written(stated.replace("right: {from", "right: {loads: [{at: 1, mass: 1}], from"))
    study = f"base: {scene}\nvary: [{{gravity: [0]}}]\ncolumns: [max_tension]\n"
    notes = [line for line in run("static", scene).err.splitlines() if line.startswith("note: ")]
    assert len(notes) == 2
    for result in (run("ssm", scene), run("sweep", "-", "--no-write", stdin=study)):
        assert all(note in result.err for note in notes)
