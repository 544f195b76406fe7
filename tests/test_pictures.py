"""Every kind of picture: nothing is clipped, no text stands over another, every number is rounded."""

from functools import partial

import numpy as np
import pytest
from campaign import campaign
from command import CONFIGS, run, study_file, write
from matplotlib.figure import Figure
from picture import curves, faults
from scenes import computed

from cablestudy import plots
from cablestudy.interface import load
from cablestudy.plots.colour_map import keep_apart
from cablestudy.scene.scene import load_scene
from cablestudy.scene.study import read_study
from cablestudy.study.one_cable import case_modes
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.prepare import fields_of, prepare
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.table import Table
from cablestudy.sweeps.rows import cases_table
from cablestudy.sweeps.sensitivity import Sensitivity

SUSPENSIONS = CONFIGS / "suspensions"


def case_of(name, *sets, kind=CableCase):
    return kind(load_scene(CONFIGS / f"{name}.yaml", sets)[1])


# ------------------------------------------------------------------------------------------------------ the check


def broken(draw):
    figure = Figure(figsize=(5, 3), layout="none")
    axes = figure.add_axes((0.3, 0.3, 0.6, 0.6))
    axes.plot([0, 1], [0, 1], label="one")
    draw(figure, axes)
    return faults(figure)


@pytest.mark.parametrize(
    ("draw", "fault"),
    [
        (lambda figure, axes: figure.legend([*axes.lines] * 2, ["a name, far too long for it " * 5] * 2), "outside"),
        (lambda figure, axes: axes.set_ylabel("a label that is far too long for this axis"), "outside"),
        (lambda figure, axes: axes.text(0.5, 0.5, "sag 4.087089 m"), "not rounded"),
        (lambda figure, axes: [axes.text(0.5, 0.5, name) for name in ("first", "second")], "over"),
        (lambda figure, axes: figure.legend([*axes.lines] * 2, ["one"] * 2), "equal entries"),
        (lambda figure, axes: [axes.legend(loc="center"), axes.text(0.5, 0.5, "hidden")], "behind a legend"),
    ],
)  # fmt: skip
def test_faults_are_found(draw, fault):
    assert any(fault in found for found in broken(draw))


def test_a_good_picture_has_no_faults():
    assert broken(lambda figure, axes: axes.set_title("12 names: up4, 154500 N, −0.1234")) == []


# ------------------------------------------------------------------------------------------------------- one cable

LOADS = "[{at: 40 m, force: [3, 0, 0]}, {at: 90 m, force: [0, 2, -1]}, {at: 100 m, force: [0, 0, -1234.5678]}]"
VERTICAL, DEEP = "cable.ends=[[0, 0, 0], [0, 0, 100]]", "cable.unstretched_length=557.4 m"
STATIC = {
    "taut": ("carlina", []),
    "slack": ("slack", []),
    "inclined": ("carlina-inclined", []),
    "loaded": ("zipline", []),
    "three loads": ("carlina", [f"cable.loads={LOADS}"]),
    "vertical": ("carlina", [VERTICAL, "cable.unstretched_length=99.9 m"]),
    "downwards": ("carlina", ["cable.ends=[[0, 0, 0], [0, 0, -100]]", "cable.unstretched_length=99.9 m"]),
    "vertical, loaded": (
        "point-load", [VERTICAL, "cable.unstretched_length=99 m", "cable.loads=[{at: 40 m, force: [3, 0, 0]}]"],
    ),
    "folded": ("slack", [VERTICAL, "cable.unstretched_length=300 m"]),
    "deep": ("slack", [DEEP]),
    "deep, loaded": ("slack", [DEEP, "cable.loads=[{at: 99 m, force: [2, 5, 0]}, {at: 300 m, force: [0, 0, 9]}]"]),
    "high above the sea": ("guy", ["cable.ends=[[0, 0, 4321.5], [60, 0, 4400]]"]),
    "steep": ("slack", ["cable.ends=[[0, 0, 0], [1, 0, 100]]", "cable.unstretched_length=110 m"]),
    "floating": ("carlina", ["gravity=0"]),
}  # fmt: skip


@pytest.mark.parametrize("kind", STATIC)
def test_static_forms(kind):
    name, sets = STATIC[kind]
    figure = plots.static_form(case_of(name, *sets))
    assert faults(figure) == []
    assert np.isfinite(curves(figure.axes[0])["cable"].get_xydata()).all()


@pytest.mark.parametrize(
    ("name", "sets"),
    [
        ("zipline", ["cable.loads=[{fraction: 0.97, mass: 80 kg}]"]),
        ("zipline", ["cable.loads=[{fraction: 0.2, mass: 80 kg}, {fraction: 0.5, force: [0, 300, -1]}]"]),
        ("zipline", ["cable.preload=null", "cable.sag=8 m", "ground=-1 m"]),
        ("line", ["case=storm"]),
        ("line", ["ground=[[0, 0], [200 m, 0]]"]),  # which the cable leaves
    ],
)
def test_forms_over_ground(name, sets):
    assert faults(plots.static_form(case_of(name, *sets))) == []


def test_forms_of_load_cases():
    names = ("everyday", "cold", "hot", "ice", "storm")
    assert faults(plots.case_forms({name: case_of("line", f"case={name}") for name in names})) == []
    case = case_of("guy", "case=ice")
    many = {f"Über-{name} of the long winter of 2026, {place}": case for place, name in enumerate("abcdefghijkl")}
    assert faults(plots.case_forms(many)) == []


@pytest.mark.parametrize("count", campaign([1, 3, 12, 20], [3, 20]))
def test_mode_shapes(count):
    case, found, *_ = case_modes.modes(case_of("slack"), count)
    assert faults(plots.mode_shapes(case, found)) == []


def test_wind_response():
    case = case_of("carlina", "gondola.mass=54.321987 kg", "wind.speed=6.54321 m/s")
    assert faults(plots.wind_response([case.analysis])) == []


# ----------------------------------------------------------------------------------------------------- suspensions

VIEWS = [
    *((name, []) for name in ("fast", "carlina-net", "mast-guys", "net-2x2")),
    ("fast", ["bodies.cabin.at=[54.72 m, 0, 149.65 m]"]),
    *((name, []) for name in ("carlina-balloon", "cogiro")),
]


@pytest.mark.parametrize(("name", "sets"), campaign(VIEWS, VIEWS[:5]))
def test_views_of_suspensions(name, sets):
    assert faults(plots.static_form(case_of(f"suspensions/{name}", *sets, kind=SuspensionCase))) == []


NAMES = """
gravity: 9.81
cable: {elastic_modulus: 100 GPa, area: 1 mm^2, density: 1440 kg/m^3}
bodies:
  Gondel-mit-Übergewicht-und-langem-Namen:
    {at: [2, 0, 1], mass: 3 kg, inertia: [1, 1, 1], attachments: {ö: [0, 0, 0.1]}, free: [x, y, z]}
points: {Stütze-im-Süden-des-Tales: [0, 0, 3], башня: [6, 0, 3], башня-2: [6, 0.01, 3], x: [2, 3, 3]}
cables:
  линия-1: {from: Stütze-im-Süden-des-Tales, to: Gondel-mit-Übergewicht-und-langem-Namen.ö, preload: 100 N}
  линия-2: {from: башня, to: Gondel-mit-Übergewicht-und-langem-Namen.ö, preload: 100 N}
  линия-3: {from: башня-2, to: Gondel-mit-Übergewicht-und-langem-Namen.ö, preload: 100 N}
  линия-4: {from: x, to: Gondel-mit-Übergewicht-und-langem-Namen.ö, preload: 100 N}
"""


def test_long_names_in_other_alphabets(tmp_path):
    scene = load(write(tmp_path / "scene.yaml", NAMES))
    assert [faults(scene.plot(kind)) for kind in ("static", "modes")] == [[], []]


@pytest.mark.parametrize("name", ["carlina-balloon", "mast-guys", "net-2x2"])
def test_modes_of_suspensions(name):
    assert faults(load(SUSPENSIONS / f"{name}.yaml").plot("modes")) == []


def test_an_enlarged_body_stands_clear_of_the_suspension():
    figure = load(SUSPENSIONS / "cable-robot.yaml").plot("modes")
    assert faults(figure) == []
    (panel,) = [axes for axes in figure.axes if axes.child_axes]
    (inset,) = panel.child_axes
    box = inset.get_window_extent()
    flat = [line.get_xydata() for line in panel.lines if line.get_transform() == panel.transData]
    flat += [path.vertices for drawn in panel.collections for path in drawn.get_paths() if len(path.vertices) > 1]
    places = panel.transData.transform(np.concatenate(flat))
    assert len(places) > 100
    assert not any(box.contains(*place) for place in places)
    assert box.width == pytest.approx(box.height, rel=1e-3)


# ---------------------------------------------------------------------------------------------------------- studies


def made_up(study, *functions):
    """A table of a study with cells that functions of the number of the row make up, one for each column."""
    columns, _ = prepare(study)
    rows = []
    for place, row in enumerate(cases_table(study).rows):
        values = [function(place) for function in functions]
        cells = {column.header: value for column, value in zip(columns, values, strict=True)}
        rows.append({**row, **cells, "status": "ok" if None not in values else "it has no answer"})
    return Table(fields_of(study, columns, []), rows)


def drawn(folder, text, *functions, base="carlina"):
    """The figure of a study whose cells are made up."""
    study = read_study(study_file(folder, text, CONFIGS / f"{base}.yaml"))
    return plots.study_plot(study, made_up(study, *functions))


MASSES = "{gondola.mass: {from: 10 kg, to: 300 kg, count: %d}}"
PRELOADS = "{cable.preload: {from: 100 N, to: 2 kN, count: 4, spacing: log}}"
MATERIALS = ("aramid", "nylon", "polyester", "polypropylene", "steel", "aramid-high", "steel-high")
NAMED = f"{{cable.material: [{', '.join(f'paper/{name}' for name in MATERIALS)}]}}"
TITLE = (
    "title: " + "A study with a heading that takes far more than the one line which there is for it in a picture " * 2
)

STUDIES = {
    "30 series of a number": (f"vary: [{MASSES % 30}, {PRELOADS}]", [lambda k: 1.0 + k // 4 + k % 4]),
    "200 series of a number": (f"vary: [{MASSES % 200}, {PRELOADS}]", [lambda k: 1.0 + k % 7]),
    "7 materials": (f"vary: [{NAMED}, {PRELOADS}]", [lambda k: 1e3 * (k % 4) + k]),
    "3 x 7 series": (
        f"vary: [{NAMED}, {{wind.speed: [3 m/s, 6 m/s, 9.87654321 m/s]}}, {PRELOADS}]",
        [lambda k: float(k % 4) + k / 17],
    ),
    "5 x 7 x 3 series": (
        f"vary: [{NAMED}, {{wind.speed: [3 m/s, 6 m/s, 9 m/s]}}, {MASSES % 5}, {PRELOADS}]",
        [lambda k: float(k % 4) + k / 17],
    ),
    "categories": (f"vary: [{NAMED}]", [lambda k: k + 0.123456789]),
    "one row": ("vary: [{gondola.mass: [12.3456789 kg]}]", [lambda k: 4.087089075910004]),
    "failed rows": (f"vary: [{MASSES % 9}]", [lambda k: None if k % 3 else 1.0 + k]),
    "no answer": (f"vary: [{MASSES % 9}]", [lambda k: None]),
    "equal values": (f"vary: [{MASSES % 9}]", [lambda k: 1344.7654321]),
    "nearly equal values": (f"vary: [{MASSES % 9}]", [lambda k: 1344.7654321 + 1e-4 * k]),
    "zeros": (f"vary: [{MASSES % 9}]", [lambda k: 0.0]),
    "tiny differences": (f"vary: [{MASSES % 9}]", [lambda k: 0.71875 + 1e-6 * k]),
    "12 decades": (f"vary: [{MASSES % 13}]", [lambda k: 10.0 ** (k - 6)]),
    "25 decades": (f"vary: [{MASSES % 26}]", [lambda k: 3 * 10.0 ** (k - 13)]),
    "negative": (f"vary: [{MASSES % 9}]", [lambda k: -123456.789 * k]),
    "crowded numbers along x": ("vary: [{gondola.mass: [1 kg, 100 kg, 100.5 kg, 101 kg]}]", [lambda k: 1.0 + k]),
    "temperatures": (
        "set: {case: hot, cable.expansion: 1e-5 1/K}\n"
        "vary: [{cases.hot.temperature: [-30 degC, 15 degC, 80 degC]}]",
        [lambda k: 1.0 + k],
    ),
    "samples": (
        "sample: {method: sobol, count: 64, over: {gondola.mass: {from: 10 kg, to: 20 kg}}}",
        [lambda k: 1.0 + k % 7],
    ),
    "positions": (
        "vary: [{cable.loads: [[], [{at: 40.123456 m, force: [0, 0, -1.23456789]}], [{at: 50 m, mass: 12 kg}]]}]",
        [lambda k: 1.0 + k],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", campaign(STUDIES, [name for k, name in enumerate(STUDIES) if k % 4 < 2]))
def test_awkward_studies(tmp_path, name):
    """Every other one with a long title and a second panel."""
    (vary, functions), two = STUDIES[name], list(STUDIES).index(name) % 2
    columns = "[end_stiffness, gondola_rms_velocity_open_loop]" if two else "[end_stiffness]"
    figure = drawn(tmp_path, f"{TITLE if two else ''}\n{vary}\ncolumns: {columns}\n", *functions * (1 + two))
    assert faults(figure) == []
    assert figure.get_figwidth() == 7.5


OF_CONFIGS = ["preload", "zipline-ropes", "guy-preload", "material", "extremes"]


@pytest.mark.parametrize("name", campaign(OF_CONFIGS, OF_CONFIGS[:4]))
def test_studies_of_the_configs(name):
    study = read_study(str(CONFIGS / f"{name}.yaml"))
    assert faults(plots.study_plot(study, computed(study))) == []


MAP = "vary: [{cable.preload: {from: 100 N, to: 3.2 kN, count: %d, spacing: log}}, {gondola.mass: %s}%s]\n"
PLOTTED = "columns: [end_stiffness]\nplot: {x: cable.preload, y: gondola.mass, color: end_stiffness, logx: true}\n"
MAPS = {
    "few cells": (MAP % (6, "[20 kg, 50.123456 kg, 100 kg]", ""), lambda k: 1234.5678 * k),
    "many cells": (MAP % (40, "{from: 1 kg, to: 300 kg, count: 50}", ""), lambda k: 10.0 ** (k % 13)),
    "four panels": (MAP % (6, "[20 kg, 50 kg]", ", {wind.speed: [3 m/s, 6 m/s, 7 m/s, 9 m/s]}"), lambda k: 1.0 + k),
    "nine panels": (
        MAP % (6, "[20 kg, 50 kg]", ", {wind.speed: {from: 3 m/s, to: 11 m/s, count: 9}}"),
        lambda k: 1.0 + k,
    ),
    "gaps": (MAP % (6, "[20 kg, 50 kg]", ""), lambda k: None if k == 3 else 1.0 + k),
    "equal": (MAP % (6, "[20 kg, 50 kg]", ""), lambda k: 7.0),
    "one row": (MAP % (2, "[20 kg]", ""), lambda k: 1.0),
    "no answer": (MAP % (2, "[20 kg]", ""), lambda k: None),
}


@pytest.mark.parametrize("name", campaign(MAPS, list(MAPS)[::2]))
def test_maps_of_colours(tmp_path, name):
    vary, function = MAPS[name]
    assert faults(drawn(tmp_path, vary + PLOTTED, function)) == []


def test_values_on_lines_that_crowd_stand_apart():
    """Of 300 numbers at random places and angles only those stay that cover neither each other nor an edge."""
    figure, random = Figure(figsize=(7.5, 5.0)), np.random.default_rng(1)
    axes = figure.subplots()
    axes.set(xlim=(1e-3, 1.0), xscale="log", ylim=(-1.0, 1.0), xticks=[], yticks=[])
    places = zip(10.0 ** random.uniform(-3, 0, 300), random.uniform(-1, 1, 300), strict=True)
    angles = random.uniform(-90, 90, 300)
    texts = [axes.text(*place, "10.5", fontsize=7.5, ha="center", va="center", rotation=angle, rotation_mode="anchor")
             for place, angle in zip(places, angles, strict=True)]  # fmt: skip
    assert len(faults(figure)) > 100
    keep_apart(axes, texts)
    assert faults(figure) == []
    assert len(axes.texts) > 30


@pytest.mark.parametrize(
    "plot",
    [
        "{x: cable.material, y: gondola.mass, color: end_stiffness}",
        "{x: end_stiffness, y: gondola.mass, color: cable.material}",
        "{x: end_stiffness, y: [gondola.mass, gondola.mass_kg], color: gondola.mass}",
        "{x: gondola.mass, y: cable.material}",
    ],
)
def test_maps_and_points_of_names(tmp_path, plot):
    text = f"vary: [{NAMED}, {MASSES % 5}]\ncolumns: [end_stiffness]\nplot: {plot}\n"
    assert faults(drawn(tmp_path, text, lambda k: 1000.0 + k)) == []


def test_indices_of_sensitivity(tmp_path):
    text = (
        "sample: {method: saltelli, count: 16, over: {cable.preload: {from: 1 kN, to: 5 kN},"
        " cable.elastic_modulus: {from: 60 GPa, to: 130 GPa}}}\n"
        "vary: [{gondola.mass: [20 kg, 30.123456 kg, 40 kg]}]\ncolumns: [mass, sag, end_stiffness]\n"
    )
    study = read_study(study_file(tmp_path, text))
    table, _ = Sensitivity(study).table(computed(study))
    assert faults(plots.sensitivity_plot(study, table)) == []


LOSSY = "{loss_factor: 0.02, viscous: 0.02}"
COMMANDS = {
    "gondola": ["ssm", "carlina.yaml", "--with", "gondola", "--response", "0.01Hz:100Hz:200"],
    "closed loop": ["ssm", "carlina.yaml", "--with", "loop", "--response", "0.01Hz:100Hz:200"],
    "margins": ["loop", "carlina-pid.yaml"],
    "wind on both": ["windrms", "carlina.yaml", "--on", "both", "--set", f"cable.damping={LOSSY}"],
    "time": ["trade", "carlina.yaml", "--columns", "sag,end_stiffness", "--repeats", "1"],
    "indices": ["sweep", "sensitivity.yaml", "--sensitivity", "--no-write", "--jobs", "1"],
}


def figure_of(monkeypatch, *arguments):
    """The picture that a command draws, without faults, and what it says."""
    figures = []
    monkeypatch.setattr(plots, "save", lambda figure, path: figures.append(figure))
    said = run(*arguments, "--plot", "picture.png").lines
    assert [faults(figure) for figure in figures] == [[]]
    return figures[0], said


@pytest.mark.parametrize("arguments", COMMANDS.values(), ids=COMMANDS)
def test_pictures_of_commands(monkeypatch, arguments):
    command, name, *options = arguments
    figure_of(monkeypatch, command, CONFIGS / name, *options, "--quiet")


# -------------------------------------------------------------------------------------- what a picture of a study shows

FIVE = "columns: [sag, horizontal_tension, end_stiffness, mass, gondola_frequency_static, cable_frequency]\n"
VARIED = "vary: [{cable.preload: {from: 500 N, to: 3 kN, count: 3}}]\n"


def labels_of(monkeypatch, path, *options):
    """Labels along y of the picture that `sweep` draws, and what it says."""
    figure, said = figure_of(monkeypatch, "sweep", path, "--no-write", *options)
    return [axes.get_ylabel().replace("\n", " ") for axes in figure.axes], said


def test_columns_that_are_not_drawn_are_named(tmp_path, monkeypatch):
    labels, said = labels_of(monkeypatch, study_file(tmp_path, VARIED + FIVE))
    assert labels == ["sag [m]", "horizontal tension [N]", "end stiffness [N/m]", "mass [kg]"]
    (line,) = [line for line in said if line.startswith("not drawn")]
    assert line.startswith("not drawn: gondola_frequency_static, cable_frequency (")


def test_chosen_columns_are_drawn(tmp_path, monkeypatch):
    """Those of the study and others, with and without units; not the status, and not what is along x."""
    asked = "mass_kg,status,cable.preload,gondola_frequency_static,cable_frequency,sag,end_stiffness,utilisation"
    for text in ("", "plot: {x: cable.preload, y: [sag], logx: true}\n"):
        labels, said = labels_of(monkeypatch, study_file(tmp_path, VARIED + FIVE + text), "--columns", asked)
        assert labels == ["mass [kg]", "gondola frequency static [Hz]", "cable frequency [Hz]", "sag [m]",
                          "end stiffness [N/m]", "utilisation"]  # fmt: skip
        assert not any("not drawn" in line for line in said)
        labels, _ = labels_of(monkeypatch, study_file(tmp_path, VARIED + FIVE + text), "--columns", "status")
        assert labels[0] == "sag [m]"


def test_a_map_of_colours_says_that_it_does_not_draw_chosen_columns(tmp_path, monkeypatch):
    plot = "plot: {x: cable.preload, y: gondola.mass, color: sag}\n"
    path = study_file(tmp_path, VARIED.replace("}]", "}, {gondola.mass: [20 kg, 50 kg]}]") + FIVE + plot)
    labels, said = labels_of(monkeypatch, path, "--columns", "mass")
    assert labels[0] == "gondola mass [kg]"
    assert any("map of colours" in line for line in said)


# ------------------------------------------------------------------------------------------------------ scales of axes


def scales(folder, vary, *functions, text="columns: [end_stiffness]"):
    """Scales of x and of each y of a study with made up cells."""
    figure = drawn(folder, f"vary: [{vary}]\n{text}\n", *functions)
    return figure.axes[0].get_xscale(), *(axes.get_yscale() for axes in figure.axes)


SPACED = {
    "from 1 kg to 1000 kg": ("{gondola.mass: {from: 1 kg, to: 1000 kg, count: 7}}", "linear"),
    "log range": ("{gondola.mass: {from: 1 kg, to: 1000 kg, count: 7, spacing: log}}", "log"),
    "a decade of a log range": ("{gondola.mass: {from: 1 kg, to: 10 kg, count: 7, spacing: log}}", "log"),
    "less than a decade": ("{gondola.mass: {from: 1 kg, to: 8 kg, count: 7, spacing: log}}", "linear"),
    "1, 2, 5": ("{gondola.mass: [1 kg, 2 kg, 5 kg, 10 kg, 20 kg, 50 kg, 100 kg]}", "log"),
    "one far away": ("{gondola.mass: [0.001 kg, 100 kg, 150 kg, 200 kg]}", "linear"),
    "two": ("{gondola.mass: [1 kg, 1000 kg]}", "linear"),
}


@pytest.mark.parametrize(("vary", "scale"), SPACED.values(), ids=SPACED)
def test_an_axis_is_logarithmic_where_the_varied_values_are_spaced_so(tmp_path, vary, scale):
    """Of y too, over such an x alone: a column that spans decades over a linear axis is drawn as it is."""
    assert scales(tmp_path, vary, lambda k: 10.0**k) == (scale, scale)
    assert scales(tmp_path, vary, lambda k: 1.0 + k) == (scale, "linear")


def test_the_study_decides_on_its_axes(tmp_path):
    for logx in (True, False):
        for logy in (True, False):
            plot = f"{{x: gondola.mass, y: end_stiffness, logx: {str(logx).lower()}, logy: {str(logy).lower()}}}"
            found = scales(
                tmp_path, SPACED["log range"][0], lambda k: 10.0**k, text=f"columns: [end_stiffness]\nplot: {plot}"
            )
            assert found == ("log" if logx else "linear", "log" if logy else "linear")


def test_names_and_series_spaced_by_ratios_keep_decades_apart(tmp_path):
    assert scales(tmp_path, NAMED, lambda k: 10.0**k)[1] == "log"
    series = "{cable.preload: {from: 1 kN, to: 2 kN, count: 3}}, {gondola.mass: [1 kg, 10 kg, 100 kg]}"
    assert scales(tmp_path, series, lambda k: 10.0 ** (k % 3)) == ("linear", "log")
    series = series.replace("10 kg, 100 kg", "50 kg, 100 kg")
    assert scales(tmp_path, series, lambda k: 10.0 ** (k % 3)) == ("linear", "linear")


@pytest.mark.parametrize("size", [0.2, 1344.7654321, -3e7])
def test_a_column_that_is_constant_to_four_digits_is_drawn_flat(tmp_path, size):
    """Differences of 1e-4 take at most a tenth of the height; those of 1 % most of it."""
    shares = []
    for spread in (1e-4, 1e-2):
        text = f"vary: [{MASSES % 9}]\ncolumns: [end_stiffness]\n"
        figure = drawn(tmp_path, text, partial(lambda spread, k: size * (1 + spread * k / 8), spread))
        figure.draw_without_rendering()
        low, high = figure.axes[0].get_ylim()
        assert figure.axes[0].yaxis.get_offset_text().get_text() == ""
        shares.append(abs(size) * spread / (high - low))
    assert shares[0] < 0.1
    assert shares[1] > 0.5


# --------------------------------------------------------------------------------------------------------- temperatures


@pytest.mark.parametrize("written", ["[253 K, 283.15 K]", "[-20.15 degC, 50 degF]", "[253, 283.15]"])
def test_temperatures_are_in_degrees_celsius_for_people_and_in_kelvin_for_programs(tmp_path, written):
    text = f"set: {{case: hot}}\nvary: [{{cases.hot.temperature: {written}}}]\ncolumns: [sag]\n"
    path = study_file(tmp_path, text, CONFIGS / "line.yaml")
    shown = [line.split("|")[1].strip() for line in run("sweep", path, "--no-write").out.splitlines()]
    assert shown == ["cases.hot.temperature [degC]", shown[1], "-20.15", "10"]
    table = run("sweep", path, "--no-write", "--format", "csv").out.splitlines()
    assert [row.split(",")[0] for row in table] == ["cases.hot.temperature_K", "253.0", "283.15"]
    axes = plots.study_plot(study := read_study(path), computed(study)).axes[0]
    assert axes.get_xlabel() == "hot temperature [degC]"
    assert list(axes.lines[0].get_xdata()) == pytest.approx([-20.15, 10.0], abs=1e-12)


def test_a_temperature_that_is_found_is_in_degrees_celsius():
    asked = ("find", CONFIGS / "line.yaml", "clearance = 7 m", "--by", "cases.hot.temperature", "--case", "hot")
    kelvin = float(run(*asked, "--format", "csv").out.splitlines()[1].split(",")[0])
    head, _, row = run(*asked).out.splitlines()
    assert "[degC]" in head
    assert float(row.split("|")[1]) == pytest.approx(kelvin - 273.15, abs=5e-3)
