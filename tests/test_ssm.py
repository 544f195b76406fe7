"""The command `ssm`: files that other programs read, tables, and mistakes of one line."""

import json
import re
import shlex
import tracemalloc
from itertools import product
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from command import CARLINA, SLACK, refused_in_one_line, rows_of, run, table_of
from picture import faults
from references import dense
from scenes import case_of, choice_of
from scipy.io import loadmat
from solved import contents
from test_statespace import end_stiffness_of_bars
from test_suspension_ssm_command import same_files
from twins import swinging, without

import cablestudy as cs
from cablestudy import plots
from cablestudy.control import export, one_cable
from cablestudy.study import ssm, ssm_tables
from cablestudy.system.linear import LinearSystem

AXIAL = ("--kinds", "axial", "--modes", "5")
WITH = {None: (), "gondola": ("--with", "gondola"), "loop": ("--with", "loop")}


pytestmark = pytest.mark.usefixtures("folder")


@pytest.mark.parametrize(("arguments", "options"), [
    *(((*words, "--wind"), {"attached": attached, "wind": True}) for attached, words in WITH.items()),
    (("--modes", 4, "--proper"), {"count": 4, "proper": True}),
    (("--modes", 4, "--proper", "--input", "end_2_x"), {"count": 4, "proper": True, "input": "end_2_x"}),
], ids=["cable", "gondola", "loop", "proper", "one input"])  # fmt: skip
def test_files_hold_what_was_computed(arguments, options):
    choice = choice_of(**options)
    system = ssm.exported(choice.system(), choice.options)
    found, _ = same_files(CARLINA, *arguments)
    # neither a closed loop nor a part of the inputs has a second-order model
    second_order = {"Mass", "Damping", "Stiffness", "CoordinateName", "CoordinateUnit"}
    has_none = options.get("attached") == "loop" or "proper" in options
    assert found.keys() & second_order == (set() if has_none else second_order)
    matrices = {"A": system.a, "B": system.b, "C": system.c, "D": system.d}
    matrices |= {"D1": system.derivatives[0], "D2": system.derivatives[1]}
    for name, matrix in matrices.items():
        assert np.array_equal(found[name].reshape(matrix.shape), matrix), name
    for word, labels in (("State", system.states), ("Input", system.inputs), ("Output", system.outputs)):
        for part, suffix in enumerate(("Name", "Unit")):
            assert found[word + suffix] == [label[part] for label in labels]
    assert found["Ts"] == 0


def test_second_order_model_with_free_ends_has_the_poles_of_the_state_space():
    system = choice_of(attached="gondola", count=20).system()
    found, _ = same_files(CARLINA, "--with", "gondola", "--modes", 20)
    order = system.second_order
    for name, matrix in (("Mass", order.mass), ("Stiffness", order.stiffness), ("Damping", order.damping)):
        assert np.array_equal(found[name], matrix)
    assert len(found["CoordinateName"]) == 26
    # end 1 and y, z of end 2 held: the modes of what is left are the poles
    free = [*range(20), 23]
    M, K, C = (found[name][np.ix_(free, free)] for name in ("Mass", "Stiffness", "Damping"))
    expected = np.linalg.eigvals(system.a)
    for pole in dense.poles(M, C, K):
        assert np.abs(expected - pole).min() < 1e-8 * np.abs(pole)


@pytest.mark.parametrize(
    ("damping", "attached"), [("{ratio: 0.01}", None), ("{loss_factor: 0.01}", "gondola"), ("{time: 1 ms}", "loop")]
)
@pytest.mark.parametrize("name", ["mass", "stiffness"])
def test_a_number_that_is_not_finite_is_never_exported(folder, monkeypatch, name, damping, attached):
    """A NaN put into the second-order model: one line, exit code 3, no file."""

    def spoilt(*arguments, **named):
        system = LinearSystem(*arguments, **named)
        getattr(system, name)[-3, -3] = np.nan
        return system

    monkeypatch.setattr(one_cable, "LinearSystem", spoilt)
    for kind in export.KINDS:
        done = run("ssm", CARLINA, *WITH[attached], "--set", f"cable.damping={damping}", "--out", f"x{kind}", code=3)
        assert done.out == ""
        assert done.lines[-1].startswith(f"{CARLINA}: the state space overflows: ")
        assert done.lines[-1].endswith(" would have entries that are not finite")
    assert list(folder.iterdir()) == []


def test_python_control_takes_the_file():
    import control  # of the test extra: without it this fails, and is not skipped

    run("ssm", CARLINA, "--out", "cable.mat")
    m = loadmat("cable.mat", spmatrix=False)  # the recipe of cablestudy.control.export
    system = control.ss(m["A"], m["B"], m["C"], m["D"])
    model = case_of().end_model
    np.testing.assert_allclose(system.dcgain(), model.stiffness, atol=1e-7)
    expected = one_cable.state_space(model).response([10j * np.pi])[0]
    np.testing.assert_allclose(system(10j * np.pi), expected, atol=1e-8)
    assert (np.real(system.poles()) < 0).all()


@pytest.mark.parametrize("kind", list(export.KINDS))
def test_equal_models_are_equal_files(folder, kind):
    for name in ("a", "b"):
        run("ssm", CARLINA, *AXIAL, "--out", name + kind)
    assert (folder / f"a{kind}").read_bytes() == (folder / f"b{kind}").read_bytes()


def test_an_existing_file_is_only_replaced_by_a_complete_one(folder, monkeypatch):
    (folder / "cable.npz").write_text("old")
    run("ssm", CARLINA, "--out", "cable.npz", "--set", "cable.preload=1 N", code=3)  # it would break
    assert (folder / "cable.npz").read_text() == "old"
    monkeypatch.setattr("os.replace", Mock(side_effect=OSError(28, "No space left on device")))
    done = run("ssm", CARLINA, *AXIAL, "--out", "cable.npz", code=2)
    assert "No space left" in done.lines[-1]
    assert (folder / "cable.npz").read_text() == "old"
    assert [file.name for file in folder.iterdir()] == ["cable.npz"]


def test_table_of_the_kept_modes():
    rows = table_of("ssm", CARLINA, *AXIAL)
    assert [row["type"] for row in rows] == ["axial"] * 5
    # the paper's Table 2: participation of the axial modes, k c/(2 l): 18.93 Hz
    assert rows[0]["frequency_Hz"] == pytest.approx(18.93, abs=0.01)
    assert rows[0]["participation_end_2"] == pytest.approx(rows[0]["participation_end_1"], rel=1e-6)
    assert [row["damping_ratio"] for row in rows] == [0.01] * 5
    everything = table_of("ssm", CARLINA)
    assert [row["number"] for row in everything] == list(range(1, 118))
    upto = table_of("ssm", CARLINA, "--upto", "5 Hz", "--kinds", "in-plane, axial")
    assert [row["number"] for row in upto] == [2, 3, 6]
    assert table_of("ssm", CARLINA, "--upto", "0.1 Hz") == []


def test_error_keeps_fewer_modes_for_larger_errors():
    counts = [len(table_of("ssm", CARLINA, "--error", error)) for error in (0.5, 0.1, 1e-2, 1e-3)]
    assert counts == sorted(counts)
    assert counts[0] == 1  # the first axial mode carries 6/pi^2 of the inertia of an end that slides
    kinds = {row["type"] for row in table_of("ssm", CARLINA, "--error", 1e-2)}
    assert "out-of-plane" not in kinds
    sideways = table_of("ssm", CARLINA, "--error", 0.1, "--input", "end_1_y", "--output", "end_2_y")
    assert {row["type"] for row in sideways} == {"out-of-plane"}


def test_size_and_notes_on_standard_error():
    done = run("ssm", CARLINA, "--modes", 5, "--explain")
    assert done.lines[-1] == "state space: 10 states, 6 inputs, 6 outputs; 5 of 117 modes"
    assert "40 elements" in done.err
    assert run("ssm", CARLINA, "--modes", 5, "--explain", "--quiet").err == ""
    hysteretic = run("ssm", CARLINA, "--explain", "--set", "cable.damping={loss_factor: 0.01}")
    assert "no state space" in hysteretic.err


def test_plain_truncation_warns_with_both_stiffnesses():
    done = run("ssm", CARLINA, *AXIAL, "--no-residual")
    truncated, exact = end_stiffness_of_bars()
    assert f"{truncated:.5g} N/m instead of {exact:.5g} N/m" in done.err
    assert "warning" not in run("ssm", CARLINA, *AXIAL).err


def test_an_unstable_loop_is_said():
    done = run("ssm", CARLINA, "--with", "loop", "--set", "winch.controller.gain=1000")
    assert "warning: the loop is unstable" in done.err
    (row,) = table_of("loop", CARLINA)
    assert f"stable below {row['largest_gain_rad_per_s']:.4g} rad/s" in done.err


@pytest.mark.parametrize("attached", WITH)
def test_a_model_to_an_accuracy(attached):
    done = run("ssm", SLACK, *WITH[attached], "--modes", 9, "--explain", "--format", "json")
    assert len(rows_of(done.out, "json")) == 9
    assert "estimated error" in done.err
    kept = table_of("ssm", SLACK, "--kinds", "inplane", "--modes", 9)
    assert {row["type"] for row in kept} == {"in-plane"}
    assert len(kept) == 9


def test_response_of_the_cable():
    rows = table_of("ssm", CARLINA, "--response", "0.01Hz:0.1kHz:5")
    frequency = np.array([row["frequency_Hz"] for row in rows])
    even = np.abs(np.log10(frequency) - np.rint(np.log10(frequency))) < 1e-12
    assert frequency[even] == pytest.approx([0.01, 0.1, 1, 10, 100], rel=1e-12)
    assert (np.diff(frequency) > 0).all()
    modes = table_of("modes", CARLINA, "--upto", "100Hz")
    moving = np.array([row["frequency_Hz"] for row in modes if row["type"] != "out-of-plane"])
    beside = moving[:, None] * (1 + 0.01 * np.array([-1, -0.5, 0, 0.5, 1]))  # damping ratio 0.01
    assert frequency[~even] == pytest.approx(np.sort(beside[beside < 100]), rel=1e-9)
    stiffness = end_stiffness_of_bars()[1]
    assert rows[0]["magnitude_N_per_m"] == pytest.approx(stiffness, rel=1e-4)
    other = table_of("ssm", CARLINA, "--response", "0.01:1:2", "--input", "end_1_x", "--output", "end_2_x")
    assert other[0]["magnitude_N_per_m"] == pytest.approx(stiffness, rel=1e-4)
    assert abs(other[0]["phase_deg"]) == pytest.approx(180, abs=0.1)


@pytest.mark.parametrize("attached", [(), ("--with", "gondola"), ("--with", "loop")])
def test_the_peaks_of_a_response_are_among_its_rows(attached):
    """Two frequencies about a narrow resonance, and in between the largest magnitude of 4,001, to 2 %."""
    narrow = ("--set", "cable.damping.ratio=2e-4", "--set", "winch.controller.gain=0.001")
    around = "0.6:0.9" if attached else "1.4:1.8"
    few, many = (table_of("ssm", CARLINA, *narrow, *attached, "--response", f"{around}:{n}") for n in (2, 4001))
    assert len(few) <= 2 + 5 * 2
    name = next(name for name in few[0] if "magnitude" in name)
    assert max(row[name] for row in few) == pytest.approx(max(row[name] for row in many), rel=0.02)
    assert max(row[name] for row in few) > 1.4 * max(few[0][name], few[-1][name])


def test_an_undamped_motion_has_no_row_at_its_resonance():
    rows = table_of("ssm", SLACK, "--set", "cable.damping={model: modal, ratio: 0}", "--response", "0.1:5:4")
    assert len(rows) == 4


def test_responses_between_several_ends_are_those_of_each_pair():
    several = ("--input", "end_1_x,end_2_x", "--output", "end_2_x", "--output", "end_2_z")
    rows = table_of("ssm", CARLINA, "--response", "0.3:0.7:3", *several)
    for output, given in product(("end_2_x", "end_2_z"), ("end_1_x", "end_2_x")):
        alone = table_of("ssm", CARLINA, "--response", "0.3:0.7:3", "--input", given, "--output", output)
        for part in ("magnitude_N_per_m", "phase_deg"):
            assert [row[f"{output}_over_{given}_{part}"] for row in rows] == [row[part] for row in alone]


@pytest.mark.parametrize(("attached", "own", "pair"), [
    ("gondola", None, ("winch.cable", "gondola.x")),
    ("gondola", None, ("gondola.force_x", "gondola.x")),
    ("loop", "loop", ("reference.x", "gondola.x")),
    ("loop", "loop", ("gondola.force_x", "winch.cable")),
])  # fmt: skip
def test_parts_have_the_names_that_suspensions_have_for_them(attached, own, pair):
    """Responses of one cable and of its twin, between inputs and outputs of equal names."""
    damping = "cable.damping={model: kelvin_voigt, time: 1 ms, viscous: 0.01 N s/m^2}"
    scene = without(contents(CARLINA, damping, "model={elements: 3, order: 3}"), "wind")
    frequency, (given, shown) = np.array([0.1, 0.7, 2.0]), pair
    both = {"input": given, "output": shown}
    mine, twin = cs.load(scene).state_space(attached, **both), cs.load(swinging(scene)).state_space(own, **both)
    found, expected = (one.response(2j * np.pi * frequency, derivatives=True)[:, 0, 0] for one in (mine, twin))
    assert found == pytest.approx(expected, rel=1e-6)
    row = cs.load(scene).compute("ssm", attached=attached, response="0.1:2:2", **both).table.rows[-1]
    phase = next(value for name, value in row.items() if "phase" in name)
    assert phase % 360 == pytest.approx(np.degrees(np.angle(found[-1])) % 360)


@pytest.mark.parametrize(("attached", "inputs", "outputs", "size"), [
    (None, {"end_2_x": "m", "end_1_x": "m"}, {"force_end_2_z": "N", "force_end_1_x": "N"}, "6 states, 2 inputs, 2"),
    ("gondola", {"force_gondola": "N"}, {"gondola_velocity": "m/s"}, "8 states, 1 input, 1"),
])  # fmt: skip
def test_a_file_has_the_inputs_and_outputs_that_are_named(folder, attached, inputs, outputs, size):
    """Columns and rows of the whole."""
    names = [word for name in outputs for word in ("--output", name.removeprefix("force_"))]
    command = ("ssm", CARLINA, *WITH[attached], "--modes", 3, "--out")
    told = run(*command, "few.json", "--input", ",".join(inputs), *names).err
    assert f"state space: {size} output" in told
    assert "; 3 of 117 modes" in told
    run(*command, "all.json")
    few, every = (json.loads((folder / name).read_text()) for name in ("few.json", "all.json"))
    for word, labels in (("Input", inputs), ("Output", outputs)):
        assert dict(zip(few[f"{word}Name"], few[f"{word}Unit"], strict=True)) == labels
    rows = [every["OutputName"].index(name) for name in few["OutputName"]]
    columns = [every["InputName"].index(name) for name in few["InputName"]]
    for matrix in ("D", "D1", "D2"):
        assert np.array_equal(few[matrix], np.array(every[matrix])[np.ix_(rows, columns)])
    assert np.array_equal(few["B"], np.array(every["B"])[:, columns])
    assert np.array_equal(few["C"], np.array(every["C"])[rows])


def test_several_curves_of_one_unit_are_drawn(folder):
    run("ssm", CARLINA, "--response", "0.1:2:30", "--input", "end_1_x,end_2_x", "--plot", "bode.svg")
    assert b"Frequency responses" in (folder / "bode.svg").read_bytes()
    one = run("ssm", CARLINA, "--error", "0.1", "--input", "end_1_x,end_2_x", code=2)
    assert one.lines == ["--error: refers to one --input and one --output"]


def test_response_with_a_gondola_has_both_curves():
    rows = table_of("ssm", CARLINA, "--with", "gondola", "--response", "0.001:1:3")
    curves = [f"{curve}_{part}" for curve in ("ground", "gondola") for part in ("magnitude", "phase_deg")]
    assert list(rows[0]) == ["frequency_Hz", *curves]
    assert (rows[0]["ground_magnitude"], rows[0]["gondola_magnitude"]) == pytest.approx((1, 1), rel=1e-4)


def test_a_response_without_a_number_is_an_empty_cell():
    curve = ssm_tables.Curve("", "", "N/m", lambda frequency: np.array([1.0, complex(np.inf, np.nan)]))
    table = ssm_tables.response_table((1.0, 2.0, 2), [curve])
    assert list(table.rows)[1] == {"frequency_Hz": 2.0, "magnitude_N_per_m": None, "phase_deg": None}
    assert "null" in table.render("json")


@pytest.mark.parametrize(
    ("attached", "labels"),
    [(None, 1), ("gondola", ["A, winch on the ground", "B, winch on the gondola"]), ("loop", 1)],
)
def test_bode_plot_draws_the_curves(attached, labels):
    span, shown = ssm.read_response_range("0.1:100:50"), choice_of(attached=attached).curves()
    frequency, *numbers = ssm_tables.drawn_points(span, shown)
    figure = plots.bode(shown, frequency, *numbers)
    magnitude, phase = figure.axes
    assert [text.get_text() for one in figure.legends for text in one.texts] == (labels if labels != 1 else [])
    assert magnitude.get_legend() is None
    drawn = [line.get_label() for line in magnitude.lines]
    assert labels in (drawn, len(drawn))
    for k, curve in enumerate(shown):
        assert np.array_equal(magnitude.lines[k].get_xdata(), np.geomspace(0.1, 100, 50))
        value = curve.value(frequency)
        assert np.array_equal(magnitude.lines[k].get_ydata(), np.abs(value))
        np.testing.assert_allclose(phase.lines[k].get_ydata(), np.degrees(np.unwrap(np.angle(value))), rtol=1e-12)


def test_a_bode_plot_of_little_change_has_plain_ticks():
    frequency = np.geomspace(0.1, 10, 50)
    curve = ssm_tables.Curve("", "force over displacement", "N/m", None)
    figure = plots.bode([curve], frequency, 3600 - 100 * frequency / 10, frequency / 5)
    assert faults(figure) == []
    for axes in figure.axes:
        low, high = axes.get_ylim()
        shown = {text.get_position()[1]: text.get_text() for text in axes.get_yticklabels()}
        numbers = {tick: float(label) for tick, label in shown.items() if low <= tick <= high}
        assert list(numbers.values()) == pytest.approx(list(numbers))
        assert len(numbers) >= 3


def test_a_bode_plot_of_many_responses_has_room_for_their_legend():
    inputs = ",".join(f"end_{end}_{axis}" for end in (1, 2) for axis in "xyz")
    span, shown = ssm.read_response_range("0.1:100:50"), choice_of(input=inputs, output=inputs).curves()
    figure = plots.bode(shown, *ssm_tables.drawn_points(span, shown))
    assert len(shown) == 36
    assert faults(figure) == []
    upper, lower = (axes.get_window_extent().height / figure.dpi for axes in figure.axes)
    assert upper > 2
    assert lower > 1.4


def comb(frequency):
    """A response with narrow resonances, one of them where blocks meet."""
    s = 2j * np.pi * frequency
    return sum(1 / (s**2 + 1e-5 * w * s + w**2) for w in 2 * np.pi * np.array([3.0, 3.01, np.sqrt(10), 7.77]))


def test_a_long_response_is_never_in_memory_as_a_whole():
    shown = [ssm_tables.Curve("", "", "m/N", comb)]
    peaks = []
    for count in (20_000, 1_000_000):
        tracemalloc.start()
        blocks = list(map(len, map(np.transpose, ssm_tables.response_blocks((1.0, 10.0, count), shown))))
        frequency, size, phase = ssm_tables.drawn_points((1.0, 10.0, count), shown)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert sum(blocks) == count
    # all 24 MB of the longer one are never there; of its peaks none is lost in the picture
    assert peaks[1] < peaks[0] + 2_000_000
    every = np.geomspace(1.0, 10.0, 1_000_000)
    value = comb(every)
    assert 5_000 <= len(frequency) <= 15_003
    assert (frequency[0], frequency[-1]) == (1.0, 10.0)
    assert (size.max(), size.min()) == (np.abs(value).max(), np.abs(value).min())
    # what is drawn is of the response, in its order
    places = np.searchsorted(every, frequency)
    assert (np.diff(places) > 0).all()
    assert np.array_equal(frequency, every[places])
    assert np.array_equal(size, np.abs(value)[places])
    np.testing.assert_allclose(phase, np.degrees(np.unwrap(np.angle(value)))[places], rtol=1e-12)


def test_both_ends_of_a_long_response_are_those_of_the_whole():
    table = ssm_tables.response_table((1.0, 10.0, 10_000), [ssm_tables.Curve("", "", "m/N", comb)])
    every = list(table.rows)
    assert len(every) == len(table.rows) == 10_000
    assert table.rows[4090:4100] == every[4090:4100]
    assert table.rows[-500:] == every[-500:]
    assert (table.rows[-1], table.rows[7], table.rows[5:20:3]) == (every[-1], every[7], every[5:20:3])
    phase = [row["phase_deg"] for row in every]
    np.testing.assert_allclose(phase, np.degrees(np.unwrap(np.angle(comb(np.geomspace(1, 10, 10_000))))), rtol=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--modes 118", "the model has 117 modes"),
        ("--modes 100000", "at most"),
        ("--modes 40 --kinds axial", "39 axial modes"),
        ("--modes 0", "0"),
        ("--modes 3 --upto 3Hz", "exclude"),
        ("--upto 3m", "--upto"),
        ("--upto -3", "positive"),
        ("--error 0", "between 0 and 1"),
        ("--error nan", "between 0 and 1"),
        ("--kinds axial,sideways", "'sideways'"),
        ("--kinds ''", "--kinds is empty"),
        ("--response 1:10", "FROM:TO:COUNT"),
        ("--response 10:1:5", "below"),
        ("--response 1:1:5", "below"),
        ("--response 0:1:5", "positive"),
        ("--response -1:1:5", "positive"),
        ("--response 1:nan:5", "--response"),
        ("--response 1:1e400:5", "--response"),
        ("--response '1 m:2:5'", "length"),
        ("--response 1e-320:1e308:10", "--response 1e-320:1e308:10: frequencies must be between"),
        ("--response 1:1.1e100:2", "frequencies must be between"),
        ("--response 0.9e-100:1:2", "frequencies must be between"),
        ("--response 1:10:1", "COUNT"),
        ("--response 1:10:10000001", "COUNT"),
        ("--response 1:10:2.5", "COUNT"),
        ("--response 1:10:²", "COUNT"),
        ("--out model.txt", ".npz, .mat, .json"),
        ("--out model", ".npz, .mat, .json"),
        ("--out missing/model.npz", "no such folder"),
        ("--plot bode.png", "--response"),
        ("--plot bode.gif --response 1:2:3", ".png"),
        ("--with winch", "winch"),
        ("--error 0.1 --input end_3_x", "--input end_3_x: unknown (did you mean end_2_x? allowed: end_1_x, end_1_y, "),
        ("--response 1:2:3 --output force", "--output force: unknown (allowed: end_1_x, end_1_y, end_1_z, end_2_x"),
        ("--input end_1_x", "--input: no effect: for --response, --error and --out only"),
        ("--output end_3_x --with loop --response 1:2:3", "--output end_3_x: unknown (did you mean force_end_"),
        ("--proper", "--proper: no effect"),
        ("--out x.mat --with gondola --input winsh", "--input winsh: unknown (did you mean winch? allowed: "),
        ("--out x.mat --output end_3_x", "--output end_3_x: unknown"),
        ("--out x.mat --with loop --input winch", "--input winch: unknown"),
        ("--out x.mat --columns frequency", "--columns: no effect: --out writes a file"),
        ("--out x.mat --top 3", "--top: no effect: --out writes a file"),
        ("--out x.mat --response 1:2:3 --columns fase", "--columns: the table has no column 'fase' (did you mean"),
    ],
)
def test_mistakes_are_one_line(folder, options, words):
    refused_in_one_line(folder, words, "ssm", CARLINA, *shlex.split(options))


def test_more_than_the_accuracy_can_give_is_said():
    done = run("ssm", SLACK, "--error", 1e-3, code=3)
    assert len(done.lines) == 1
    # what can be had is said, and can be had
    left = float(re.search(r"lowest modes leave out (\S+) of the inertia between end_2_x and end_2_x", done.err)[1])
    assert 1e-3 < left < 1
    assert run("ssm", SLACK, "--error", 1.1 * left).code == 0


def test_what_is_to_be_attached_must_be_there():
    lines = Path(CARLINA).read_text(encoding="utf-8").splitlines(keepends=True)
    bare = "".join(line for line in lines if not line.startswith("gondola"))
    winchless = "".join(lines[: lines.index("winch:\n")] + [line for line in lines if line.startswith("model")])
    for text, attached, message in (
        (bare, "gondola", "gondola: missing key"),
        (winchless, "loop", "winch: missing key"),
    ):
        done = run("ssm", "-", "--with", attached, stdin=text, code=2)
        assert len(done.lines) == 1
        assert message in done.err
    assert run("ssm", "-", "--with", "gondola", stdin=winchless).code == 0
    assert run("ssm", "-", "--modes", "3", stdin=bare).code == 0
