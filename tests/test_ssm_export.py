"""A proper state space, without D1 and D2; other programs, and what they lack of an improper one. Files: test_ssm."""

import numpy as np
import pytest
from command import CARLINA, CONFIGS, run

import cablestudy
from cablestudy.control.one_cable import channel_names
from cablestudy.scene.scene import load_scene
from cablestudy.study.one_cable import ssm
from cablestudy.study.ssm import StateSpaceOptions

NET = str(CONFIGS / "suspensions" / "carlina-net-wind.yaml")
MODELS = {
    "cable": (CARLINA, {"modes": 6}),
    "gondola": (CARLINA, {"with_": "gondola", "modes": 6}),
    "loop": (CARLINA, {"with_": "loop", "modes": 6}),
    "suspension": (NET, {"modes": 6}),
    "suspension, loop": (NET, {"with_": "loop", "modes": 6}),
}
S = 2j * np.pi * np.array([0.003, 0.11, 0.72, 1.5, 9.0, 40.0])
each_model = pytest.mark.parametrize("name", MODELS)


def built(name, **more):
    path, options = MODELS[name]
    return cablestudy.load(path).state_space(**options, **more)


def powers(before, after):
    """s^k for each input: how often it is differentiated in the proper system, by its unit."""
    times = {"": 0, "/s": 1, "/s^2": 2}
    return np.array([times[new[1].removeprefix(old[1])] for old, new in zip(before.inputs, after.inputs, strict=True)])


@each_model
def test_a_proper_system_has_the_response_of_the_improper_one(name):
    whole, system = built(name), built(name, proper=True)
    assert not np.concatenate(system.derivatives).any()
    assert not system.improper
    expected = whole.response(S, derivatives=True)
    found = system.response(S) * S[:, None, None] ** powers(whole, system)
    size = np.abs(expected).max(axis=0)
    assert np.abs(found - expected).max(axis=0) == pytest.approx(0 * size, abs=1e-12 * np.abs(expected).max())
    assert (np.abs(found - expected) <= 1e-9 * size + 1e-13 * np.abs(expected).max()).all()
    if name in ("cable", "gondola", "suspension"):
        assert powers(whole, system).max() == 2
    if name == "loop":
        assert dict(zip(whole.input_names, powers(whole, system), strict=True)) == {"reference": 1, "force_gondola": 0}


def test_it_is_the_same_in_python_control_and_scipy():
    whole, system = (built("cable", input="end_2_x", output="end_2_x", proper=proper) for proper in (False, True))
    assert (whole.input_names, whole.output_names) == (["end_2_x"], ["force_end_2_x"])
    assert system.input_names == ["end_2_x_acceleration"]
    assert system.state_names[-2:] == ["end_2_x", "end_2_x_velocity"]
    expected = whole.response(S, derivatives=True)[:, 0, 0]
    found = system.to_control()
    assert found.input_labels == ["end_2_x_acceleration"]
    assert np.array([found(s) for s in S]) * S**2 == pytest.approx(expected, rel=1e-9)
    other = system.to_scipy()
    value = [(other.C @ np.linalg.solve(s * np.eye(len(other.A)) - other.A, other.B) + other.D)[0, 0] for s in S]
    assert np.array(value) * S**2 == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("method", ["to_control", "to_scipy"])
def test_a_program_that_takes_four_matrices_is_told_what_it_lacks(method):
    with pytest.warns(UserWarning, match=rf"{method}: A, B, C, D lack D1 and D2.*end_1_x and 5 more.*proper=True"):
        getattr(built("cable"), method)()
    with pytest.warns(UserWarning, match=rf"{method}: A, B, C, D lack D1 and D2.*the derivatives of reference on"):
        getattr(built("loop"), method)()
    getattr(built("loop", output="gondola_position"), method)()  # none: any warning fails
    getattr(built("gondola", input="winch", output="gondola_position"), method)()


def test_a_file_that_is_improper_says_so_and_a_proper_one_does_not(tmp_path):
    done = run("ssm", CARLINA, "--modes", 4, "--out", tmp_path / "a.mat")
    assert "ss(A, B, C, D) lacks the direct effect of the derivatives of end_1_x and 5 more" in done.err
    assert "note" not in run("ssm", CARLINA, "--modes", 4, "--proper", "--out", tmp_path / "a.mat").err
    assert "--proper" in run("ssm", CARLINA, "--modes", 4, "--explain").err


@pytest.mark.parametrize("scene", [CARLINA, NET])
@pytest.mark.parametrize(("model", "told"), [("{model: hysteretic, loss_factor: 0.02}", True),
                                             ("{model: hysteretic, loss_factor: 0}", False),
                                             ("{model: kelvin_voigt, time: 1 ms}", False)])  # fmt: skip
def test_hysteretic_damping_that_becomes_viscous_is_told(tmp_path, scene, model, told):
    damping = model if scene == CARLINA else model[:-1] + ", ratio: null}"
    done = run("ssm", scene, "--set", f"cable.damping={damping}", "--modes", 4, "--out", tmp_path / "a.npz")
    assert ("note: hysteretic damping is viscous in A, B, C, D" in done.err) == told


@pytest.mark.parametrize("attached", ["gondola", "loop"])
def test_unknown_channels_are_told_before_any_modes_are_computed(attached, monkeypatch):
    """With the names that the state space has."""
    document, scene = load_scene(CARLINA)
    system = ssm.choose(document, scene, StateSpaceOptions(attached=attached, count=4)).system()
    assert channel_names(attached == "loop") == (list(system.input_names), list(system.output_names))
    monkeypatch.setattr(ssm, "modes", None)
    for option in ("--input", "--output"):
        done = run("ssm", CARLINA, "--with", attached, "--out", "x.mat", option, "nothing", code=2)
        assert done.err.startswith(f"{option} nothing: unknown (allowed: ")
