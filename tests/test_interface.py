"""The Python interface: the numbers, names and errors of the commands, with one thread."""

import json
import re
import shutil
from functools import wraps

import numpy as np
import pytest
from command import CARLINA, CONFIGS, run, stored_table, table_of, with_sets, write
from scenes import GUY
from threadpoolctl import ThreadpoolController, threadpool_info

import cablestudy
from cablestudy.interface.scene import Scene
from cablestudy.study import trade
from cablestudy.threads import VARIABLES, keep_one_thread, one_thread

NET = CONFIGS / "suspensions" / "carlina-net.yaml"


def test_every_public_name_is_there():
    assert {name for name in cablestudy.__all__ if callable(getattr(cablestudy, name))} == set(cablestudy.__all__)
    assert set(cablestudy.__all__) < set(dir(cablestudy))
    with pytest.raises(AttributeError, match="no attribute 'swep'"):
        cablestudy.swep  # noqa: B018


def test_a_scene_gives_what_the_commands_print():
    changes = {"cable.diameter": "3.7 mm", "gondola.mass": 60}
    sets = with_sets("cable.diameter=3.7 mm", "gondola.mass=60")
    scene = cablestudy.load(CARLINA, set=changes)
    static = scene.static()
    assert dict(static) == table_of("static", CARLINA, *sets)[0]
    assert static.units["sag_m"] == "m"
    assert 0 < static.errors["sag_m"] < 1e-3
    assert scene.windrms() == table_of("windrms", CARLINA, *sets)[0]
    modes = scene.modes(5)
    assert modes.to_dict("records") == table_of("modes", CARLINA, "-n", "5", *sets)
    assert modes.attrs["units"]["frequency_Hz"] == "Hz"
    assert len(scene.modes(upto=3.0)) == (scene.modes(20)["frequency_Hz"] <= 3.0).sum()
    assert scene.shape().to_dict("records") == table_of("static", CARLINA, "--shape", *sets)


def test_a_state_space_is_a_system_of_scipy():
    scene = cablestudy.load(CARLINA)
    model = scene.state_space(with_="loop", input="force_gondola")
    system = model.to_scipy()
    s = 2j * np.pi * np.array([0.3, 1.0])
    expected = [model.c @ np.linalg.solve(value * np.eye(len(model.a)) - model.a, model.b) + model.d for value in s]
    poles = np.sort_complex(np.linalg.eigvals(system.A))
    assert poles == pytest.approx(np.sort_complex(np.linalg.eigvals(model.a)))
    assert model.response(s) == pytest.approx(np.array(expected), rel=1e-9)
    assert [name for name, _ in model.inputs] == model.input_names


@pytest.mark.parametrize("kept", [{}, {"modes": 1}, {"modes": 12}, {"upto": "25 Hz"}])
def test_a_model_of_few_modes_has_the_damping_of_those_left_out(kept):
    scene = cablestudy.load(CARLINA)  # modal damping
    model = scene.state_space(with_="gondola", **kept)
    motion = scene.windrms()
    ratio = motion["gondola_damping_ratio"]  # from the coupled modes
    pole = min(np.linalg.eigvals(model.a), key=lambda p: abs(p - 2j * np.pi * motion["gondola_frequency_Hz"]))
    assert -pole.real / abs(pole) == pytest.approx(ratio, rel=1e-2)


def test_find_and_cases(tmp_path):
    path = tmp_path / "s.yaml"
    write(
        path,
        "cable: {chord: 100 m, axial_stiffness: 1 MN, mass_per_length: 1, preload: 5 kN, expansion: 12e-6 1/K}\n"
        "cases: {cold: {temperature: -20 degC}, hot: {temperature: 40 degC}}\n",
    )
    found = cablestudy.find(path, "sag = 2 m", by="cable.preload")
    again = cablestudy.load(path, set={"cable.preload": float(found["cable.preload_N"][0])})
    assert again.static()["sag_m"] == pytest.approx(2.0, rel=1e-9)
    cases = cablestudy.load(path).cases
    assert list(cases) == ["cold", "hot"]
    assert cases["cold"].static()["sag_m"] < cases["hot"].static()["sag_m"]
    assert cases["hot"].static() == cablestudy.load(path, case="hot").static()


def test_a_sweep_is_a_data_frame_of_the_stored_table():
    frame = cablestudy.sweep(CONFIGS / "preload.yaml", jobs=1)
    stored = stored_table(CONFIGS.parent / "results" / "preload.csv")
    known = [row["gondola_frequency_Hz"] for row in stored]
    assert frame["gondola_frequency_Hz"].tolist() == pytest.approx(known, rel=1e-9)
    assert frame.attrs["units"]["end_stiffness_N_per_m"] == "N/m"
    ends = {"_N_per_m": "N/m", "_m": "m", "_Hz": "Hz", "_N": "N"}  # of names -> the unit that they state
    stated = {name: next((unit for end, unit in ends.items() if name.endswith(end)), "") for name in frame}
    assert frame.attrs["units"] == stated
    assert list(frame) == list(stored[0])
    assert {str(kind) for name, kind in frame.dtypes.items() if name != "status"} == {"float64"}
    assert frame["unstretched_length_m"].tolist() == [183.195, 184.488, 185.142, 185.668, 185.734, 186.0]
    assert frame["sag_printed_m"].tolist() == [row["sag_printed_m"] for row in stored]
    assert frame["sag_difference_m"].tolist() == pytest.approx([row["sag_difference_m"] for row in stored], rel=1e-6)
    again = cablestudy.sweep(CONFIGS / "preload.yaml", set={"cable.density": 2000}, vary={"gondola.mass": "10kg,50kg"})
    assert len(again) == 2 * len(frame)
    assert again["gondola.mass_kg"].unique().tolist() == [10.0, 50.0]


def test_a_sweep_writes_only_where_it_is_told_to(folder):
    cablestudy.sweep(CONFIGS / "preload.yaml")
    assert list(folder.iterdir()) == []
    cablestudy.sweep(CONFIGS / "preload.yaml", out=folder / "here")
    run("sweep", CONFIGS / "preload.yaml", "--out", folder / "there")
    for name in ("preload.csv", "preload.md"):
        assert (folder / "here" / name).read_bytes() == (folder / "there" / name).read_bytes()


def test_a_suspension_gives_its_tables():
    net = cablestudy.load(NET)
    assert isinstance(net, cablestudy.Suspension)
    tables = net.static()
    assert list(tables) == ["bodies", "points", "cables", "stiffness"]
    printed = table_of("static", NET, "--table", "cables")
    assert tables["cables"]["max_tension_N"].tolist() == [row["max_tension_N"] for row in printed]
    net.modes(12)  # no digit depends on what was asked for before
    assert net.modes(3)["frequency_Hz"].tolist() == [row["frequency_Hz"] for row in table_of("modes", NET, "-n", "3")]
    assert net.shape()["cable"].unique().tolist() == tables["cables"]["name"].tolist()


@pytest.mark.parametrize("kind", ["static", "modes", "windrms", "loop"])
def test_pictures_are_figures(kind):
    from matplotlib.figure import Figure

    assert isinstance(cablestudy.load(CARLINA).plot(kind), Figure)


@pytest.mark.parametrize("ask", [lambda s: s.loop_response("0.1Hz:10Hz:5"), lambda s: s.loop_in_time("1 s")])
def test_what_has_no_answer_at_all_is_raised_as_the_command_tells_it(ask):
    """A loop whose damping has no limit as modes are added."""
    told = run("loop", CONFIGS / "slack.yaml", "--response", "0.1Hz:10Hz:5", code=3).lines[-1].partition(": ")[2]
    with pytest.raises(cablestudy.NoSolutionError, match="modal damping grows") as raised:
        ask(cablestudy.load(CONFIGS / "slack.yaml"))
    assert str(raised.value) == told


def test_the_command_and_the_function_agree_on_a_trade():
    frame = cablestudy.trade(CARLINA, columns="sag", repeats=1)
    printed = table_of("trade", CARLINA, "--columns", "sag", "--repeats", "1")
    for name in ("model", "sag_error", "status"):
        assert frame[name].tolist() == [row[name] for row in printed], name


def test_the_page_runs_as_it_is_written(monkeypatch, capsys, folder):
    shutil.copytree(CONFIGS, folder / "configs")
    monkeypatch.setattr(trade, "models_of", lambda *given, every=trade.models_of: every(*given)[:8])
    text = (CONFIGS.parent / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = text.split("```python\n")[1:]
    assert len(blocks) == 12
    exec("\n".join(block.partition("```")[0] for block in blocks), {})
    printed = capsys.readouterr().out
    assert "max_tension_N" in printed
    assert text.partition("print(error)  # ")[2].partition("\n")[0] in printed


def test_a_mapping_is_what_a_file_would_say(tmp_path):
    path = write(tmp_path / "guy.yaml", json.dumps(GUY))
    changes, case = {"cable.diameter": np.float64(0.02)}, "cold"
    assert cablestudy.load(GUY, changes, case).static() == cablestudy.load(path, changes, case).static()
    over = {"base": GUY, "cable": {"preload": None, "sag": "1 m"}}
    assert cablestudy.load(over).static()["sag_m"] == pytest.approx(1, rel=1e-12)
    found, expected = (cablestudy.find(source, "sag = 1 m", by="cable.preload") for source in (GUY, path))
    assert found.equals(expected)


def test_a_study_needs_no_file(folder):
    write("guy.yaml", json.dumps(GUY))
    study = {"vary": [{"cable.diameter": ["12 mm", 0.014]}, {"case": "all"}], "columns": ["sag", "mass"]}
    tables = [cablestudy.sweep({"base": base, **study}) for base in (GUY, "guy.yaml")]
    assert tables[0].equals(tables[1])
    assert tables[0]["case"].tolist() == ["cold", "hot"] * 2
    assert sorted(path.name for path in folder.iterdir()) == ["guy.yaml"]
    cablestudy.sweep({"base": GUY, **study}, out="there")
    assert len(stored_table("there/mapping.csv")) == 4


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ({}, "<mapping>: missing key: cable"),
        ({"cable": {**GUY["cable"], "densty": 3}}, "<mapping>: cable.densty: unknown key (did you mean density?)"),
        ({"cable": {**GUY["cable"], "preload": float("nan")}}, "<mapping>: cable.preload: expected a force in N"),
        ({"base": GUY, "gondola": {"mass": "3 m"}}, "<mapping>: gondola.mass: expected a mass in kg"),
        (
            {"base": {"cable": {"sagg": 1, **GUY["cable"]}}},
            "<mapping> base: cable.sagg: unknown key (did you mean sag?)",
        ),
        ({"base": "nothing.yaml"}, "<mapping>: base: nothing.yaml: no such file"),
        ({"cable": np.zeros(3)}, "<mapping>: cable: expected a mapping with the keys axial"),
        ({"cable": object()}, "load: path: cable: expected mappings with text as keys, lists"),
        ({"base": GUY, "vary": [], "columns": ["sag"]}, "<mapping>: this is a study (it has the key vary)"),
    ],
)
def test_mistakes_in_a_mapping_name_the_key(source, message):
    with pytest.raises(cablestudy.SceneError) as raised:
        cablestudy.load(source)
    assert str(raised.value).startswith(message)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("study", "message"),
    [
        ({"base": GUY, "vary": [{"cable.diamter": [1]}], "columns": ["sagg"]}, "cable.diamter: unknown key"),
        ({"base": GUY, "vary": [], "columns": ["sagg"]}, "columns.0: unknown column 'sagg'"),
        (GUY, "this is a scene (it has the key cable)"),
    ],
)
def test_mistakes_in_a_study_that_is_a_mapping_name_the_key(study, message):
    with pytest.raises(cablestudy.SceneError, match=f"^<mapping>: {re.escape(message)}"):
        cablestudy.sweep(study)


def test_scenes_and_models_are_shown_in_one_line():
    scene = cablestudy.load(CARLINA, set={"cable.diameter": "3 mm"})
    assert repr(scene) == f'Scene({CARLINA}, cable.diameter="3 mm": cable, gondola, winch, wind)'
    assert repr(cablestudy.load(GUY)) == "Scene(<mapping>: cable, cases)"
    assert repr(cablestudy.load(NET)).endswith("carlina-net.yaml: cables: 6, bodies: 1, points: 6)")
    assert len(repr(cablestudy.load(CARLINA, set={"cable.loads": [{"at": 1, "mass": 1}] * 99}))) < 200
    model = scene.state_space("gondola", modes=3)
    assert repr(model) == (
        f"StateSpace(states: {len(model.a)}, inputs: 2 (winch, force_gondola), "
        "outputs: 8 (gondola_position and 7 more))"
    )


@pytest.mark.parametrize(("path", "attached"), [(CARLINA, None), (CARLINA, "gondola"), (CARLINA, "loop"), (NET, None)])
def test_the_state_of_an_amplitude_is_its_frequency_times_it(path, attached):
    """d(W y)/dt = W dy/dt: both states of a mode have the unit sqrt(kg) m/s, y itself sqrt(kg) m."""
    scene = cablestudy.load(path, set={} if path == CARLINA else {"cable.damping": {"model": "modal", "ratio": 0}})
    model = scene.state_space(attached, modes=3)
    omega = 2 * np.pi * scene.modes(3)["frequency_Hz"]
    for number in range(3):
        row = model.state_names.index(f"mode_{number + 1}_amplitude")
        rate = model.state_names.index(f"mode_{number + 1}_velocity")
        assert model.a[row, rate] == pytest.approx(omega[number], rel=1e-9 if path == CARLINA else 1e-4)
        assert np.count_nonzero(model.a[row]) == 1
        assert model.states[row][1] == model.states[rate][1] == "sqrt(kg) m/s"


# -------------------------------------------------------------------------------------------- threads of linear algebra


def threads():
    """Numbers of threads of the libraries for linear algebra: set of int."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.fixture
def two_threads(monkeypatch):
    """No variable names a number of threads, and linear algebra takes two."""
    import scipy.linalg  # noqa: F401 loads the library of scipy

    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    with ThreadpoolController().limit(limits=2, user_api="blas"):
        assert threads() == {2}
        yield


def test_a_call_takes_one_thread_and_gives_the_others_back(two_threads, monkeypatch):
    found, static = [], Scene.answers["static"]

    @wraps(static)
    def observed(*args, **options):
        found.append(threads())
        return static(*args, **options)

    monkeypatch.setattr(Scene, "answers", {**Scene.answers, "static": observed})
    cablestudy.load(CONFIGS / "guy.yaml").static()
    assert found == [{1}]
    assert threads() == {2}


def test_an_error_gives_the_threads_back(two_threads):
    with pytest.raises(cablestudy.SceneError):
        cablestudy.find(CONFIGS / "guy.yaml", "sag = 2 m", "no.key")
    assert threads() == {2}


def test_blocks_of_two_threads_that_overlap_give_the_threads_back_together(two_threads):
    first, second = one_thread(), one_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert threads() == {1}
    second.__exit__(None, None, None)
    assert threads() == {2}


def test_a_worker_keeps_one_thread(two_threads):
    keep_one_thread()
    assert threads() == {1}


def test_a_number_that_the_user_has_chosen_stays(two_threads, monkeypatch):
    monkeypatch.setenv(VARIABLES[0], "2")
    keep_one_thread()
    with one_thread():
        assert threads() == {2}
