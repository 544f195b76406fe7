"""State space of the closed loop of several winches and of actuators: against dense bars, and the command."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from command import CONFIGS, run, table_of, written
from references.loop_matrix import notch
from suspension_scenes import platform
from test_suspension_ssm import MARKERS, WINCHES, agree, by_bars, model
from test_suspension_ssm_command import read, response, same_files

from cablestudy import load
from cablestudy.cable.damping import Damping
from cablestudy.cable.records import stack
from cablestudy.control.loop import Loop, allocate, moved_by_winches
from cablestudy.control.motion import Actuator, motion_of_rows, with_actuators
from cablestudy.control.notch import Notch
from cablestudy.control.statespace import state_space_of
from cablestudy.control.suspension import labels, suspension_system
from cablestudy.motion.dynamic_analysis import DynamicAnalysis
from cablestudy.scene.scene import load_scene
from cablestudy.study.ssm import StateSpaceOptions
from cablestudy.study.suspension import ssm, ssm_control
from cablestudy.study.suspension.case import SuspensionCase

VISCOUS = 0.02  # [kg/(m s)] of cables of 0.3 kg/m
GAIN = 0.8  # [rad/s]
NOTCHES = (Notch(7.0, 0.05, 40.0, 1.0), None, Notch(12.0, 0.1, 30.0, 0.7))
MASS, WHEEL_INERTIA = 3.0, 0.4
ACTUATORS = (
    Actuator("mass", False, 0, np.array([0.2, -0.1, 0.3]), np.array([0.6, 0.8, 0.0]), MASS, 2.0, 0.4, 90.0, 15.0, 0.5),
    Actuator("wheel", True, 0, np.zeros(3), np.array([0.0, 0.6, 0.8]), WHEEL_INERTIA, velocity_gain=3.0),
)
FREQUENCIES = [1e-3, 0.15, 0.7, 1.0698, 2.0, 8.0, 15.0]
NET = str(CONFIGS / "suspensions" / "carlina-net.yaml")


# -------------------------------------------------------------------------------------- matrices against dense bars


def whole_motion(state, actuators=()):
    """Motion of all modes of eight bars for each cable."""
    layout, kept = model(state, Damping("modal", viscous=VISCOUS))
    whole = suspension_system(layout, kept, WINCHES, MARKERS)
    compliance, shapes = whole.strain_modes
    omega = 1 / np.sqrt(compliance)
    reduced = motion_of_rows(stack([whole]), omega[None], (shapes * omega)[None], len(WINCHES), 0.0)
    return layout, with_actuators(layout, reduced.take(0), actuators)


def built(state, closed, actuators=()):
    layout, moving = whole_motion(state, actuators)
    count = moving.shapes.shape[1]
    measured = np.zeros((3, len(moving)))
    measured[:, :count] = layout.bodies(moving.shapes)[:3]
    forces = np.zeros((len(moving), 6))
    forces[:count] = layout.bodies(moving.shapes).T
    loop = None
    if closed:
        _, gain = moved_by_winches(moving, measured, np.ones(3))
        allocation = allocate(measured, np.ones(3), gain, np.array([1.0, 2.0, 5.0]))
        loop = Loop(moving, allocation, GAIN, NOTCHES)
    inputs, outputs = labels(layout, WINCHES, MARKERS)
    strokes = [(f"{one.name}.stroke", "m") for one in actuators if not one.wheel]
    coordinates = (*((f"mode_{k}", "sqrt(kg) m") for k in range(count)), *strokes)
    driven = replace(moving, coordinates=coordinates, inputs=inputs[:3], outputs=outputs)
    measured = (("x", "m"), ("y", "m"), ("z", "m"))
    driven, measured = driven.with_forces(forces, inputs[3:]), measured if closed else ()
    return loop, state_space_of(driven, None, loop and loop.linear, measured, actuators)


def closed_by_bars(state, frequency):
    """Outputs, then winches, by references and forces."""
    whole, s = by_bars(state, frequency, VISCOUS, 0.0), 2j * np.pi * frequency
    static = by_bars(state, 1e-9, VISCOUS, 0.0)[:3, :3].real
    # least sum of w_k v_k^2 with G v = y: W^-1 G^T (G W^-1 G^T)^-1; of three winches and x, y, z that is G^-1
    filtered = [1.0 if one is None else notch(s, *vars(one).values()) for one in NOTCHES]
    controller = -GAIN / s * np.linalg.inv(static) @ np.diag(filtered)
    # v = controller (y - r), y = H v + G f
    inverse = np.linalg.inv(np.eye(3) - controller @ whole[:3, :3])
    wound = np.concatenate([-inverse @ controller, inverse @ controller @ whole[:3, 3:]], axis=1)
    shown = whole[:, :3] @ wound
    shown[:, 3:] += whole[:, 3:]
    return np.concatenate([shown, wound])


@pytest.fixture(scope="module")
def hung_platform():
    return platform()


def test_the_closed_loop_is_that_of_dense_bars(hung_platform):
    loop, system = built(hung_platform, True)
    poles, found = (np.sort_complex(one) for one in (loop.poles, np.linalg.eigvals(system.a)))
    assert poles == pytest.approx(found, rel=1e-9, abs=1e-9)
    assert [name for name, _ in system.inputs[:4]] == ["reference.x", "reference.y", "reference.z", "gondola.force_x"]
    assert [name for name, _ in system.outputs[-3:]] == ["winch.c1", "winch.c6", "winch.c7"]
    found = system.response(2j * np.pi * np.array(FREQUENCIES), derivatives=True)
    for value, frequency in zip(found, FREQUENCIES, strict=True):
        agree(value, closed_by_bars(hung_platform, frequency), 1e-7)
    # only tensions need a derivative, and only that of a reference
    first, second = system.derivatives
    assert not np.any(second)
    assert not np.any(first[:9])
    assert not np.any(first[-3:])
    assert not np.any(first[:, 3:])
    assert np.any(first[9:-3, :3])


def test_actuators_on_dense_bars(hung_platform):
    """A mass on its spring and a wheel in front of the gondola's six rows, winches as inputs."""
    _, system = built(hung_platform, False, ACTUATORS)
    assert [name for name, _ in system.inputs[:3]] == ["winch.c1", "winch.c6", "winch.c7"]
    assert [name for name, _ in system.outputs[-4:]] == ["mass.stroke", "mass.force", "wheel.momentum", "wheel.torque"]
    reaction, wheel = ACTUATORS
    rotation = hung_platform.rotation[0]
    axis, place, spin = rotation @ reaction.axis, rotation @ reaction.position, rotation @ wheel.axis
    along = np.concatenate([axis, np.cross(place, axis)])  # of the place of the mass along its axis
    about = np.concatenate([np.zeros(3), spin])
    weight = np.concatenate([np.zeros(3), MASS * 9.81 * np.cross(axis, [0, 0, 1.0])])
    found = system.response(2j * np.pi * np.array(FREQUENCIES), derivatives=True)
    for value, frequency in zip(found, FREQUENCIES, strict=True):
        s, bare = 2j * np.pi * frequency, by_bars(hung_platform, frequency, VISCOUS, 0.0)
        gain = (90.0 * s + 15.0) * s / (s + 0.5)
        compliance = bare[:6, 3:]
        # q: m (s^2 + 2 z w s + w^2) q + (m s^2 a + weight) x = gain a x; on the body -(m s^2 a + weight) q
        own = MASS * (s**2 + 2 * 0.4 * 2.0 * s + 4.0)
        by_body = (gain - MASS * s**2) * along - weight
        on_body = -(MASS * s**2 * along + weight)
        # load of the actuators on the body = R x; the wheel takes J s^2 of the inertia about it and turns back
        load = np.outer(on_body, by_body) / own + (WHEEL_INERTIA * s**2 - 3.0 * s) * np.outer(about, about)
        moved = np.linalg.solve(np.eye(6) - compliance @ load, bare[:6])
        expected = bare + bare[:, 3:] @ load @ moved
        stroke, turned = by_body @ moved / own, about @ moved
        expected = np.concatenate([expected, [stroke, gain * along @ moved, 3.0 * turned, 3.0 * s * turned]])
        agree(value, expected, 1e-7)


# ---------------------------------------------------------------------------------------------------------- command

CONTROLLED = """
base: {net}
bodies: {{gondola: {{wind: {{area: 0.6 m^2, drag_coefficient: 1.2}}}}}}
wind: {{speed: 6 m/s, direction: 30 deg, turbulence_intensity: 0.15, length_scale: 25 m}}
control: {{gain: 0.3 rad/s, measured: [x, y, z, pitch]}}
actuators:
  damper: {{axis: [1, 0, 0], mass: 1 kg, frequency: 0.1 Hz, velocity_gain: 50 N s/m, high_pass: 0.02 Hz,
           stroke: 1 m, force: 100 N}}
"""


@pytest.fixture
def scene(folder):
    return written(CONTROLLED.format(net=NET))


def test_files_hold_the_closed_loop(scene):
    found, lines = same_files(scene, "--with", "loop", "--modes", 9)
    assert re.match(r"state space: \d+ states, 10 inputs, 29 outputs; 9 of \d+ modes", lines[0])
    assert "Mass" not in found
    assert found["InputName"][:4] == ["reference.x", "reference.y", "reference.z", "reference.pitch"]
    assert found["InputUnit"][3] == "rad"
    assert found["OutputName"][-8:] == [f"winch.{k}" for k in ("u1", "u2", "u3", "d1", "d2", "d3")] + [
        "damper.stroke",
        "damper.force",
    ]
    assert found["StateName"][-4:] == [f"winches_{k}" for k in (1, 2, 3, 4)]
    assert "damper.low_pass" in found["StateName"]
    # what is measured follows its reference at rest, the others what the winches then do
    static = response(found, 0.0)
    assert static[[0, 1, 2, 4], :4] == pytest.approx(np.eye(4), abs=1e-9)
    assert static[[0, 1, 2, 4], 4:] == pytest.approx(np.zeros((4, 6)), abs=1e-12)


def test_the_response_is_that_of_the_loop_and_of_the_file(scene):
    options = ("--with", "loop", "--modes", 9, "--input", "gondola.force_y", "--output", "gondola.focus.y")
    rows = table_of("ssm", scene, *options, "--response", "0.01Hz:3Hz:5")
    run("ssm", scene, "--with", "loop", "--modes", 9, "--out", "m.npz")
    found = read("m.npz")
    place = found["OutputName"].index("gondola.focus.y"), found["InputName"].index("gondola.force_y")
    document, described = load_scene(scene, [])
    choice = ssm.choose(document, described, StateSpaceOptions(attached="loop", count=9))
    moving, closed_loop = choice.loop.motion, choice.closed_loop
    for row in rows:
        value = row["magnitude_m_per_N"] * np.exp(1j * np.radians(row["phase_deg"]))
        assert value == pytest.approx(response(found, row["frequency_Hz"])[place], rel=1e-9)
        stiffness = choice.loop.dynamic_stiffness(np.array([2j * np.pi * row["frequency_Hz"]]))[0]
        force = np.append(closed_loop.layout.bodies(moving.shapes)[1], 0.0)  # none on the stroke
        seen = moving.c[0][closed_loop.outputs["gondola.focus.y"]]
        assert value == pytest.approx(seen @ np.linalg.solve(stiffness, force), rel=1e-9)


def test_fewer_modes_do_not_change_the_controller(scene):
    document, described = load_scene(scene, [])
    few, many = (ssm.choose(document, described, StateSpaceOptions(attached="loop", count=count)) for count in (3, 48))
    assert few.loop.gain == many.loop.gain
    for one, other in zip(few.loop.notches, many.loop.notches, strict=True):
        assert one.omega == pytest.approx(other.omega, rel=1e-12)
    assert few.loop.allocation.matrix == pytest.approx(many.loop.allocation.matrix, rel=1e-12)


def test_which_modes_are_kept(scene):
    def kept(*options):
        return [row["number"] for row in table_of("ssm", scene, "--with", "loop", *options)]

    assert kept("--modes", 3) == [1, 2, 3]
    assert kept("--upto", "1.5Hz") == [1, 2, 3]
    assert len(kept()) >= 40
    done = run("ssm", scene, "--with", "loop", "--upto", "0.1Hz", code=3)
    assert re.fullmatch(r"scene.yaml: no mode is below 0.1 Hz; the lowest is at 0.58\d+ Hz", done.lines[0])


@pytest.mark.parametrize(("options", "kept"), [
    ({"count": 6, "kinds": "axial"}, None),
    ({"count": 6, "kinds": "inplane", "residual": False}, None),
    ({"upto": "3 Hz", "kinds": "outofplane", "wind": True}, None),
    ({"error": 0.02, "input": "reference.y", "output": "winch.u2"}, [1]),
    ({"error": 0.02, "input": "gondola.force_z", "output": "u1.tension_to", "residual": False, "wind": True}, [0]),
])  # fmt: skip
def test_some_modes_with_the_loop_are_those_of_the_whole_model(options, kept):
    """M, C, K and inputs in modes found here, and the static responses to the inputs, with the loop closed here."""
    changes = {"model": {"elements": 3, "order": 3}, "cable.damping": {"model": "kelvin_voigt", "time": 0.003}}
    changes |= {"control": {"gain": GAIN, "measured": ["x", "y", "z"], "notch": "none"}}
    document, model = load_scene(NET, [f"{key}={json.dumps(value)}" for key, value in changes.items()])
    choice = ssm.choose(document, model, StateSpaceOptions(attached="loop", **options))
    case = SuspensionCase(model)
    whole = ssm.linear_model(case, case.modes(400), StateSpaceOptions(wind=options.get("wind", False)))
    square, shapes = scipy.linalg.eigh(whole.stiffness, whole.mass)
    assert choice.found.omega == pytest.approx(np.sqrt(square[: len(choice.found)]), rel=1e-9)
    if kept:
        assert choice.chosen.tolist() == kept

    def plant(space, s):
        d, b, c = (sum(s**k * part for k, part in enumerate(parts)) for parts in (whole.d, whole.b, whole.c))
        balance = space.T @ (s**2 * whole.mass + s * whole.damping + whole.stiffness) @ space
        return d + c @ space @ np.linalg.solve(balance, space.T @ b)

    space, lower = shapes[:, choice.chosen] * np.sqrt(1 / square[choice.chosen]), np.linalg.cholesky(whole.stiffness)
    if options.get("residual", True):  # static responses that do not move as the modes, of unit strain energy
        static = lower.T @ np.linalg.solve(whole.stiffness, whole.b[0][:, :12])  # not to forces on nodes
        static = static / np.linalg.norm(static, axis=0)
        others, size, _ = np.linalg.svd(static - lower.T @ space @ (lower.T @ space).T @ static, full_matrices=False)
        space = np.hstack([space, np.linalg.solve(lower.T, others[:, size > 1e-7])])
    allocation = np.linalg.pinv(plant(np.eye(len(square)), 0.0)[:3, :6].real)
    points = 2j * np.pi * np.array([0.01, 0.3, 2.0, 9.0])
    for found, s in zip(choice.system().response(points, derivatives=True), points, strict=True):
        open_loop, controller = plant(space, s), -GAIN / s * allocation
        inverse = np.linalg.inv(np.eye(6) - controller @ open_loop[:3, :6])
        winches = inverse @ np.hstack([-controller, controller @ open_loop[:3, 6:]])
        expected = open_loop[:, :6] @ winches
        expected[:, 3:] += open_loop[:, 6:]
        expected = np.vstack([expected, winches])
        size = np.abs(expected).max(axis=1, keepdims=True).clip(1e-6)  # a mode may move nothing along an axis
        assert np.abs(found - expected) / size == pytest.approx(np.zeros(expected.shape), abs=1e-6)


def test_the_inertia_of_actuators_is_not_known(scene):
    done = run("ssm", scene, "--with", "loop", "--error", 0.1, "--output", "damper.stroke", code=2)
    assert done.lines[0].startswith("--error: no share of the inertia is known for --output damper.stroke")
    done = run("ssm", scene, "--with", "loop", "--kinds", "axial", "--upto", "0.1Hz", code=3)
    assert done.lines[0].startswith("scene.yaml: no axial mode is below 0.1 Hz; the lowest is at 0.58")


def test_an_unstable_loop_is_written_with_a_warning(scene):
    done = run("ssm", scene, "--with", "loop", "--set", "control.gain=300 rad/s", "--modes", 20, "--out", "m.json")
    assert done.lines[0].startswith("warning: the loop is unstable at 300 rad/s: ")
    poles = np.linalg.eigvals(read("m.json")["A"])
    assert poles.real.max() > 0.01


def test_the_loop_over_frequency_has_the_actuators(folder, scene):
    """Singular values of the loop gain from the matrices of the suspension with its actuators, and their poles."""
    damping = "cable.damping={model: kelvin_voigt, time: 3 ms, viscous: 0.02}"
    sets = ("--set", "control={gain: 0.1, measured: [x, y, z], notch: none}", "--set", damping)
    run("ssm", scene, *sets, "--with", "actuators", "--modes", 60, "--out", "open.npz")
    found = read("open.npz")
    rows = [found["OutputName"].index(f"gondola.{axis}") for axis in "xyz"]
    columns = [found["InputName"].index(f"winch.{cable}") for cable in ("u1", "u2", "u3", "d1", "d2", "d3")]

    def plant(frequency):
        return response(found, frequency)[np.ix_(rows, columns)]

    allocation = np.linalg.pinv(plant(0.0).real)
    table = table_of("loop", scene, *sets, "--response", "0.05Hz:2Hz:30", "--plot", "loop.svg")
    for row in table:
        law = 0.1 / (2j * np.pi * row["frequency_Hz"])
        values = np.linalg.svd(law * plant(row["frequency_Hz"]) @ allocation, compute_uv=False)
        expected = 20 * np.log10(values)
        found_values = row["open_loop_largest_dB"], row["open_loop_smallest_dB"]
        assert found_values == pytest.approx((expected[0], expected[-1]), abs=1e-3)
    assert len(table) > 30  # others beside the resonances
    assert (folder / "loop.svg").exists()


def test_what_is_modelled_is_said(scene):
    done = run("ssm", scene, "--with", "loop", "--modes", 3, "--explain")
    assert "kept: the 3 lowest modes, and 6 shapes (residual) for the static part of the others" in done.lines
    assert "about: the equilibrium in the mean wind" in done.lines
    assert any(line.startswith("loop: gain 0.3 rad/s; notches: x 1.1") for line in done.lines)
    done = run("ssm", scene, "--with", "actuators", "--modes", 3, "--explain")
    assert any("(D1 and D2 of the file)" in line for line in done.lines)
    assert re.match(r"state space: 21 states, 12 inputs, 23 outputs; 3 of \d+ modes", done.lines[-1])
    without_winches = ("--set", "control=null", "--set", "winches={}", "--explain")
    done = run("ssm", scene, "--with", "actuators", "--modes", 3, *without_winches)
    assert not any("(D1 and D2 of the file)" in line for line in done.lines)


@pytest.mark.parametrize("attached", ["loop", "actuators"])
@pytest.mark.parametrize("sets", [[], ["control.measured=null"]])
def test_unknown_channels_are_told_before_the_modes_that_are_kept(scene, monkeypatch, attached, sets):
    """Before any where it is known what the loop measures; with the names that the state space has."""
    document, model = load_scene(scene, sets)
    system = ssm.choose(document, model, StateSpaceOptions(attached=attached, count=3)).system()
    monkeypatch.setattr(ssm_control, "_with_modes", None)
    if attached == "actuators" or not sets:
        monkeypatch.setattr(DynamicAnalysis, "closed_loop_of", None)
    told = []
    monkeypatch.setattr(ssm_control, "named_channels", lambda options, *names: told.append(names) or named(*told))
    with pytest.raises(NamesKnownError):
        ssm.choose(document, model, StateSpaceOptions(attached=attached, count=3))
    assert told == [(list(system.input_names), list(system.output_names))]


class NamesKnownError(Exception):
    """The names of channels are known, and nothing else shall be computed."""


def named(*_):
    raise NamesKnownError


def test_inputs_and_outputs_of_the_loop_are_named(scene):
    done = run("ssm", scene, "--with", "loop", "--response", "1:2:3", "--input", "winch.u1", code=2)
    assert done.err.startswith("--input winch.u1: unknown (allowed: reference.x, reference.y")
    done = run("ssm", CONFIGS / "carlina.yaml", "--with", "actuators", code=2)
    assert done.lines == ["--with actuators: no effect: the scene has one cable"]


def test_a_load_on_a_free_point_moves_what_equilibria_with_it_say():
    """Modes left out keep their static part of loads on free points too: by the differences of two equilibria."""
    cables = {"mast": {"from": [0.0, 8.0, 9.0], "to": "knot"}, "stay": {"from": [0.0, 14.0, 2.0], "to": "knot"}}
    cables |= {"drop": {"from": "knot", "to": "gondola.a"}, "low": {"from": [0.0, -9.0, -8.0], "to": "gondola.a"}}
    sides = {"left": [-12.0, -5.0, 7.0], "right": [12.0, -5.0, 7.0]}
    cables |= {name: {"from": place, "to": "gondola.a"} for name, place in sides.items()}
    gondola = {"at": [0.0, 0.0, 0.0], "mass": 40.0, "inertia": [2.0, 2.0, 3.0], "attachments": {"a": [0.0, 0.0, 0.2]}}
    free = {
        "cable": {"elastic_modulus": 70e9, "density": 1440.0, "area": 2e-5, "preload": 500.0},
        "points": {"knot": {"at": [0.0, 5.0, 4.0], "free": True, "mass": 1.0}},
        "bodies": {"gondola": {**gondola, "free": ["x", "y", "z"]}},
        "cables": cables,
        "winches": {"drop": {}, "left": {}, "right": {}},
        "control": {"gain": 0.1, "measured": ["x", "y", "z"]},
        "actuators": {"damper": {"axis": [1.0, 0.0, 0.0], "mass": 0.5, "frequency": 0.3, "stroke": 1.0, "force": 10.0}},
    }  # fmt: skip
    lengths = load(free).static()["cables"]["unstretched_length_m"]
    for name, length in zip(cables, lengths, strict=True):
        cables[name] = {**cables[name], "unstretched_length": float(length)}
    del free["cable"]["preload"]

    def places(force):
        knot = {**free["points"]["knot"], "force": force}
        tables = load({**free, "points": {"knot": knot}}).static()
        return np.array([tables[name].loc[0, ["x_m", "y_m", "z_m"]] for name in ("points", "bodies")], dtype=float)

    found = load(free).state_space(with_="actuators", modes=6)
    inputs, outputs = found.input_names, found.output_names
    rows = [[outputs.index(f"{name}.{axis}") for axis in "xyz"] for name in ("knot", "gondola")]
    static = found.response(np.zeros(1))[0].real
    step = 0.02  # [N]
    for axis, force in zip("xyz", step * np.eye(3), strict=True):
        expected = (places(force.tolist()) - places((-force).tolist())) / (2 * step)
        by_force = static[rows, inputs.index(f"knot.force_{axis}")]
        assert by_force == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("feedback", [{"position_gain": 100.0}, {"position_gain": 100.0, "high_pass": 0.05}])
def test_errors_are_allocated_by_the_static_gain_with_reaction_masses_free(feedback):
    """The pseudo-inverse of the response at rest of the state space without loop, whose masses are on their springs."""
    place = {"axis": [1, 0, 0], "at": [0, 0, -0.1], "mass": 0.5, "frequency": 0.3, "stroke": 1.0, "force": 100.0}
    changes = {"actuators": {"m": place | feedback}, "control.measured": ["x", "y", "z"]}
    scene = load(CONFIGS / "suspensions" / "carlina-net-wind.yaml", set=changes)
    space = scene.state_space(with_="actuators")
    rows = [space.output_names.index(f"gondola.{axis}") for axis in "xyz"]
    winches = [number for number, name in enumerate(space.input_names) if name.startswith("winch.")]
    at_rest = space.response(np.zeros(1))[0].real[np.ix_(rows, winches)]
    found = SuspensionCase(scene.model).analysis.closed_loop.body.allocation.matrix
    assert found == pytest.approx(np.linalg.pinv(at_rest), rel=1e-6, abs=1e-9)
