"""Pictures: what is drawn is what was computed, and files are whole, valid and always the same."""

import logging
import re

import matplotlib
import numpy as np
import pytest
from campaign import campaign
from command import CONFIGS, run, study_file, table_of, write
from matplotlib.collections import LineCollection, QuadMesh
from matplotlib.text import Text
from picture import curves, faults
from scenes import SAGGING, computed
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import brentq

from cablestudy import plots
from cablestudy.cable.geometry import lowest_point, points_along
from cablestudy.errors import SceneError
from cablestudy.plots import style
from cablestudy.plots.words import column_words, force_text, key_words, length_text, number, unit_text, value_text
from cablestudy.scene.scene import load_scene
from cablestudy.scene.study import read_study
from cablestudy.study.columns import find
from cablestudy.study.deflection import nodal_deflections
from cablestudy.study.one_cable import case_modes
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.columns import suspension_of
from cablestudy.study.one_cable.rows import evaluate
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.sweeps.sensitivity import Sensitivity

MAGIC = {".png": b"\x89PNG\r\n\x1a\n", ".svg": b"<?xml", ".pdf": b"%PDF-"}
LENGTH = "cable.unstretched_length"


def case_of(name, *sets):
    return CableCase(load_scene(str(CONFIGS / f"{name}.yaml"), sets)[1])


def draw(figure):
    """Everything that only goes wrong when it is drawn."""
    figure.draw_without_rendering()
    return figure


def words(figure):
    return " ".join(text.get_text() for text in figure.findobj(match=lambda artist: hasattr(artist, "get_text")))


@pytest.fixture(scope="module")
def carlina():
    return case_of("carlina")


@pytest.fixture(scope="module")
def preload():
    study = read_study(str(CONFIGS / "preload.yaml"))
    return study, computed(study)


# ----------------------------------------------------------------------------------------------------- load cases


def test_load_cases_are_drawn_in_one_figure_with_the_ground():
    cases = {name: case_of("line", f"case={name}") for name in ("everyday", "cold", "hot", "ice", "storm")}
    figure = draw(plots.case_forms(cases))
    side, along = figure.axes
    drawn = {label.split(":")[0]: line for label, line in curves(side).items()}
    assert {*cases, "chord", "ground"} <= set(drawn)
    for name, case in cases.items():
        assert drawn[name].get_ydata().min() == pytest.approx(lowest(case), abs=1e-3), name
        assert f"{name}: sag {case.statics.sag:.4g} m" in words(figure)
    np.testing.assert_allclose(drawn["ground"].get_xydata()[1], (90, 3))
    swung = [one for one in along.collections if isinstance(one, LineCollection)][-1].get_segments()[0]  # of the storm
    angle = np.degrees(np.arctan2(np.abs(swung[1:-1, 0]), -swung[1:-1, 1]))
    (row,) = table_of("static", CONFIGS / "line.yaml", "--case", "storm")
    np.testing.assert_allclose(angle, row["swing_deg"], rtol=1e-3)


def lowest(case):
    return case.end_1[2] + lowest_point(case.form)


def test_a_steep_cable_is_drawn_from_its_chord():
    cases = {name: case_of("guy", f"case={name}") for name in ("hot", "cold")}
    (axes,) = draw(plots.case_forms(cases)).axes
    assert axes.get_ylabel() == "height above\nthe chord [m]"
    for name in cases:
        assert curves(axes)[name].get_ydata().min() == pytest.approx(-cases[name].statics.sag, rel=1e-3)


def test_a_rider_over_the_ground_is_drawn_with_the_clearance_and_what_the_scene_states():
    """The state without the rider is another one: a preload or sag stated for it is told from that of the day."""
    case = case_of("zipline", "cable.preload=null", "cable.sag=3 m")
    figure = draw(plots.static_form(case))
    (side,) = figure.axes
    assert "ground" in curves(side)
    texts = {text.get_text(): text for text in side.texts}
    assert f"{80 * 9.81:.1f} N" in texts
    least = evaluate(case.scene, [find("clearance")]).cells["clearance_m"]
    assert f"clearance {least:.4g} m" in texts
    arrows = [text for text in side.texts if text.arrow_patch is not None and text.get_text() == ""]
    dimension = next(text for text in arrows if text.anncoords == "data")
    assert dimension.xyann[1] - dimension.xy[1] == pytest.approx(least, abs=1e-3)
    assert f"sag {float(case.statics.sag):.4g} m (3 m in the reference state)" in figure.get_suptitle()
    assert "reference" not in draw(plots.static_form(case_of("zipline", "cable.loads=[]"))).get_suptitle()


def test_a_case_in_a_wind_alone_is_drawn_where_it_hangs():
    """Its chord frame stands along weight and wind; the picture is upright."""
    case = case_of("line", "case=storm")
    line = curves(draw(plots.static_form(case)).axes[0])["storm"]
    assert line.get_ydata()[-1] == pytest.approx(28, rel=1e-12)
    assert line.get_ydata().min() == pytest.approx(lowest(case), abs=1e-3)


def test_the_command_draws_all_cases_that_have_an_answer(tmp_path):
    picture = tmp_path / "cases.svg"
    frozen = "cases.frozen={temperature: 60 K, wind: {pressure: 1e18 Pa}}"
    run("static", CONFIGS / "line.yaml", "--case", "all", "--set", frozen, "--plot", picture, "--quiet", code=None)
    assert picture.read_bytes().startswith(MAGIC[".svg"])


# ---------------------------------------------------------------------------------------------------- static form


def test_static_form_draws_the_shape_the_chord_and_the_sag(carlina):
    figure = draw(plots.static_form(carlina))
    (axes,) = figure.axes
    places = points_along(carlina.form, np.linspace(0.0, 1.0, 401)) + carlina.end_1
    np.testing.assert_allclose(curves(axes)["cable"].get_xydata(), places[:, [0, 2]], atol=1e-9)
    np.testing.assert_allclose(curves(axes)["chord"].get_xydata(), [[0, 0], [185.8, 0]], atol=1e-12)
    assert curves(axes)["cable"].get_ydata().min() == pytest.approx(-carlina.statics.sag, rel=1e-12)
    arrow = next(text for text in axes.texts if not text.get_text() and text.arrow_patch)
    assert arrow.xyann == pytest.approx((92.9, 0.0), abs=1e-12)
    assert arrow.xy == pytest.approx((92.9, -carlina.statics.sag))
    assert [label[-3:] for label in (axes.get_xlabel(), axes.get_ylabel())] == ["[m]", "[m]"]
    for fact in ("185.8 m", "1345 N", "sag 0.1211 m", "enlarged 200 times"):
        assert fact in words(figure)
    box = axes.get_window_extent()
    per_metre = box.width / np.ptp(axes.get_xlim()), box.height / np.ptp(axes.get_ylim())
    assert per_metre[1] / per_metre[0] == pytest.approx(200, rel=1e-9)


def test_an_inclined_cable_is_true_to_scale_and_its_sag_drawn_apart():
    case = case_of("carlina-inclined")
    whole, apart = draw(plots.static_form(case)).axes
    places = points_along(case.form, np.linspace(0.0, 1.0, 401)) + case.end_1
    np.testing.assert_allclose(curves(whole)["cable"].get_ydata(), places[:, 2], atol=1e-9)
    assert whole.get_aspect() == 1
    x, z = places[:, 0], places[:, 2]
    np.testing.assert_allclose(curves(apart)["cable"].get_ydata(), z - x * 60.49 / 175.68, atol=1e-9)
    assert np.interp(175.68 / 2, x, -curves(apart)["cable"].get_ydata()) == pytest.approx(case.statics.sag, rel=1e-3)


# ----------------------------------------------------------------------------------------------------- deflection


def test_point_load_shows_both_deflections_and_their_difference():
    case = case_of("point-load")
    _, deflection, difference = draw(plots.static_form(case)).axes
    _, full, linear = nodal_deflections(case)
    drawn = curves(deflection)
    np.testing.assert_allclose(drawn["full, non-linear"].get_ydata(), 1e3 * full[:, 1], rtol=1e-9)
    np.testing.assert_allclose(drawn["linear, about the unloaded form"].get_ydata(), 1e3 * linear[:, 1], rtol=1e-9)
    np.testing.assert_allclose(difference.lines[0].get_ydata(), 1e6 * (linear - full)[:, 1], atol=1e-6)
    assert "[mm]" in deflection.get_ylabel()
    assert "[µm]" in difference.get_ylabel()
    # a string under a load F at a: F a (l - a)/(l T); DESIGN 4, the cable is taut to 0.1 %
    assert drawn["full, non-linear"].get_ydata().min() == pytest.approx(
        -1e3 * 139.35 * 46.45 / 185.8 / 1344.75, rel=5e-3
    )
    assert np.argmin(drawn["full, non-linear"].get_ydata()) == 30  # three quarters of 40 bars


def test_a_load_that_pulls_up_is_above_the_chord(made):
    """Two straight halves of a cable without weight."""
    loads = "loads: [{fraction: 0.5, force: [0, 0, 500 N]}]"
    cable = f"cable: {{chord: 100 m, axial_stiffness: 1 MN, mass_per_length: 0.1, preload: 1 kN, {loads}}}"
    scene = made(f"gravity: 0\n{cable}\n")
    length = 100 / (1 + 1e3 / 1e6)

    def net_force(height):
        stretched = 2 * np.hypot(50, height)
        return 2 * 1e6 * (stretched / length - 1) * height / (stretched / 2) - 500

    height = brentq(net_force, 0, 50)
    figure = draw(plots.static_form(CableCase(scene)))
    texts = [text.get_text() for text in figure.findobj(Text)]
    assert f"cable: load {height:.4g} m above the chord" in texts


def test_a_load_out_of_the_plane_gets_a_panel_of_its_own():
    case = case_of("carlina", "cable.loads=[{at: 60 m, force: [0, 2, -1]}]")
    labels = " ".join(axes.get_ylabel() for axes in draw(plots.static_form(case)).axes)
    assert "sideways [mm]" in labels
    assert "upwards [mm]" in labels


def test_of_two_loads_close_together_both_have_their_size_where_there_is_room():
    loads = "cable.loads=[{fraction: 0.1, mass: 20 kg}, {fraction: 0.12, mass: 30 kg}]"
    span = ("cable.ends=[[0, 0, 0], [1200 m, 0, 3 m]]", "cable.tension.value=25 %", "ground=-60 m")
    figure = plots.static_form(case_of("line", *span, loads))
    texts = {text.get_text() for text in figure.axes[0].texts}
    assert {"196.2 N", "294.3 N"} <= texts  # 20 and 30 kg times 9.81 m/s^2
    assert faults(figure) == []


def test_sizes_of_loads_close_together_do_not_overlap():
    loads = ", ".join(f"{{fraction: {at}, mass: 5 kg}}" for at in (0.1, 0.12, 0.14, 0.5, 0.52, 0.9))
    figure = plots.static_form(case_of("carlina", f"cable.loads=[{loads}]"))
    assert faults(figure) == []
    assert sum("49.05 N" in text.get_text() for text in figure.findobj(Text)) >= 4


@pytest.mark.parametrize(
    ("force", "shown"),
    [
        ("[0, 0, -5]", ["upwards"]),
        ("[300, 0, -5]", ["upwards", "horizontally"]),  # the column deflection is that along the force
        ("[0, 500, -1]", ["sideways"]),  # 8 m, beside 40 mm upwards and 0.4 m horizontally
    ],
)
def test_panels_show_how_a_load_moves_the_cable_where_that_is_much_or_along_its_force(force, shown):
    case = case_of("carlina", f"cable.loads=[{{fraction: 0.3, force: {force}}}]")
    _, *panels, difference = draw(plots.static_form(case)).axes
    assert [axes.get_ylabel().split()[1] for axes in panels] == shown
    assert len(difference.lines) == len(shown) + 1  # and the place of the load


VERTICAL = "cable.ends=[[0, 0, 0], [0, 0, 50]]", "cable.preload=2 kN", "gondola=null", "winch=null", "wind=null"


def test_the_picture_of_a_vertical_cable_states_no_sag():
    """It is a straight line in it; the sag of the table is the limit of those of inclined cables."""
    figure = draw(plots.static_form(case_of("carlina", *VERTICAL)))
    assert not [text.get_text() for text in figure.findobj(Text) if "sag" in text.get_text()]


def test_a_difference_of_rounding_alone_has_no_panel():
    """Loads along a vertical cable stretch it: the tangent has no error."""
    case = case_of("carlina", *VERTICAL, "cable.loads=[{fraction: 0.4, mass: 5 kg}]")
    titles = [axes.get_title(loc="left") for axes in draw(plots.static_form(case)).axes]
    assert titles[-1] == "Deflection from the unloaded form"


# ---------------------------------------------------------------------------------------------------- mode shapes


def test_a_mode_along_the_cable_moves_as_far_on_the_paper_as_one_across_it(carlina):
    """Each mode has the same peak; z is enlarged 200 times, and the gondola's 5 cm along x were not: no movement."""
    case = suspension_of(carlina)
    found = case.modes(4)
    assert found.moves[:2] == ("gondola x", "cable out-of-plane")
    figure = draw(plots.coupled_mode_shapes(case, found))
    assert "vertical scale enlarged 200 times, displacements along the horizontal axis too" in " ".join(
        figure.get_suptitle().split()
    )
    along, across = figure.axes[:2]
    still, moved = (along.transData.transform(line.get_xydata()[0]) for line in along.lines if line.get_marker() == "s")
    assert moved[1] == pytest.approx(still[1], abs=0.1)  # pixels
    sideways = across.transData.transform(curves(across)["mode"].get_xydata())[:, 1]
    assert abs(moved[0] - still[0]) == pytest.approx(np.ptp(sideways), rel=1e-3)
    assert np.ptp(sideways) > 0.02 * along.bbox.width


def test_mode_shapes_are_the_modes_on_the_static_form(carlina):
    case, found, *_ = case_modes.modes(carlina, 12)
    figure = draw(plots.mode_shapes(case, found))
    assert len(figure.axes) == 12
    state = case.state
    static = state.displacement[:, 1] * case.span.unstretched_length
    for k, axes in enumerate(figure.axes):
        shape = found.shapes[..., k]
        drawn = curves(axes)["mode"].get_ydata()
        if found.kind[k] == "in-plane":
            np.testing.assert_allclose(
                drawn - static, 0.1 * shape[:, 1] / np.linalg.norm(shape[:, :2], axis=1).max(), atol=1e-9
            )
        else:
            np.testing.assert_allclose(drawn, 0.1 * shape[:, 2] / np.abs(shape[:, 2]).max(), atol=1e-9)
        assert axes.texts[0].get_text() == f"{found.kind[k]}, {found.symmetry[k]}"
        assert axes.get_title("left").split()[0] == str(k + 1)
        assert axes.get_title("left").endswith("Hz")
    assert "0.1 m" in words(figure)
    assert "[m]" in figure.get_supylabel()


def test_titles_say_what_is_drawn():
    tension, sag = SAGGING.tension_and_sag
    title = f"Static form: chord 185.8 m, preload {tension:.4g} N, sag {sag:.4g} m"
    assert plots.static_form(case_of("slack")).get_suptitle() == title
    case, found, *_ = case_modes.modes(case_of("carlina"), 50)
    figure = plots.mode_shapes(case, found)
    assert sum(axes.get_title(loc="left") != "" for axes in figure.axes) == 48
    assert "First 48 of 50 modes" in figure.get_suptitle()
    assert plots.mode_shapes(case, found.first(2)).get_suptitle().startswith("2 modes, ")
    case, found, *_ = case_modes.modes(case_of("slack"), 1)
    assert "peak of 1 m" in plots.mode_shapes(case, found).get_suptitle()  # of a larger sag


@pytest.mark.parametrize(
    ("name", "sets", "count"),
    [
        ("slack", [], 5),
        ("slack", [f"{LENGTH}=557.4 m"], 3),  # three chords
        ("carlina", ["model.elements=3"], 6),  # axial ones too
        ("carlina", ["cable.ends=[[0, 0, 0], [0, 0, 100]]", f"{LENGTH}=99.9 m"], 2),
        ("carlina", ["cable.loads=[{at: 60 m, force: [0, 2, -1]}]"], 1),  # out of the plane
    ],
)
def test_any_modes_are_drawn(name, sets, count):
    case, found, *_ = case_modes.modes(case_of(name, *sets), count)
    drawn = [curves(axes)["mode"] for axes in draw(plots.mode_shapes(case, found)).axes if axes.collections]
    assert len(drawn) == count
    assert all(np.isfinite(line.get_xydata()).all() for line in drawn)


def test_no_modes_make_no_traceback(carlina):
    _, found, *_ = case_modes.modes(carlina, upto=0.01)
    assert "no mode" in draw(plots.mode_shapes(carlina, found)).get_suptitle()


# ---------------------------------------------------------------------------------------------------------- study


def test_study_shows_computed_and_printed_values(preload):
    study, table = preload
    figure = draw(plots.study_plot(study, table))
    headers = ["end_stiffness_N_per_m", "cable_frequency_Hz", "gondola_frequency_static_Hz"]
    assert len(figure.axes) == len(headers)
    for axes, header in zip(figure.axes, headers, strict=True):
        unit = "N_per_m" if header.endswith("N_per_m") else "Hz"
        name = header.removesuffix(f"_{unit}")
        computed, printed = curves(axes)["computed"], curves(axes)["printed"]
        assert list(computed.get_xdata()) == [row["preload_N"] for row in table.rows]
        assert list(computed.get_ydata()) == [row[header] for row in table.rows]
        assert list(printed.get_xdata()) == [row["preload_printed_N"] for row in table.rows]
        assert list(printed.get_ydata()) == [row[f"{name}_printed_{unit}"] for row in table.rows]
        assert printed.get_markerfacecolor() == "none"
        assert axes.get_xscale() == "log"
    assert "[N/m]" in figure.axes[0].get_ylabel()
    assert figure.axes[-1].get_xlabel() == "preload [N]"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["computed", "printed"]


def drawn_study(folder, text, base="carlina"):
    """The table of a study and its figure, drawn."""
    study = read_study(study_file(folder, text, CONFIGS / f"{base}.yaml"))
    table = computed(study)
    return table, draw(plots.study_plot(study, table))


@pytest.mark.parametrize(
    ("varied", "joined"),
    [
        ("vary: [{gondola.mass: {from: 10 kg, to: 20 kg, count: 5}}]", True),
        ("sample: {method: sobol, count: 8, over: {gondola.mass: {from: 10 kg, to: 20 kg}}}", False),
    ],
)
def test_samples_are_scattered_and_not_joined(tmp_path, varied, joined):
    _, figure = drawn_study(tmp_path, f"{varied}\ncolumns: [gondola_frequency_static]\n")
    (line,) = figure.axes[0].lines
    assert (line.get_linestyle() != "None") == joined
    assert line.get_marker() == "o"


def test_materials_are_categories_and_what_has_no_answer_is_left_out(tmp_path):
    """Polypropylene is over strength, which is an answer; steel of 1 N is too slack for its weight."""
    text = (
        "set: {cable.area: 2.69 mm^2}\ncolumns: [sag, end_stiffness]\nvary:\n"
        "- {cable.material: [paper/polypropylene, steel, aramid], cable.preload: [1344.75 N, 1 N, 1344.75 N]}\n"
    )
    table, figure = drawn_study(tmp_path, text, "slack")
    assert [row["status"].split(" ")[0] for row in table.rows] == ["over", "a", "ok"]
    labels = [label.get_text() for label in figure.axes[-1].get_xticklabels()]
    assert labels == ["paper/polypropylene", "steel", "aramid"]
    assert list(figure.axes[0].lines[0].get_xdata()) == [0, 2]
    assert list(figure.axes[0].lines[0].get_ydata()) == [row["sag_m"] for row in table.rows[::2]]


PLANE = "vary: [{cable.preload: [500 N, 1 kN]}, {gondola.mass: [20 kg, 50 kg, 80 kg]}]\ncolumns: [end_stiffness, sag]\n"


@pytest.mark.parametrize("varied", ["[{cable.tension.value: [15 %, 20 %]}]", "[{case: all}]", "[]"])
def test_a_study_of_texts_alone_says_that_there_is_nothing_to_draw(tmp_path, varied):
    _, figure = drawn_study(tmp_path, f"vary: {varied}\ncolumns: [governing]\n", "line-limits")
    assert figure.axes == []
    assert "no column is a number" in [text.get_text() for text in figure.findobj(Text)]


def test_rows_of_one_name_have_a_legend_that_tells_them_apart(tmp_path):
    """Two rows of each damping, whose series have no mass and no gain in common."""
    one, other = "{ratio: 0.01}", "{ratio: 0.02}"
    varied = (
        f"{{gondola.mass: [1, 2, 3, 4], winch.controller.gain: [0.1, 0.2, 0.3, 0.4], cable.damping: [{one}, {one}, "
    )
    plot = "plot: {x: cable.damping, y: end_stiffness}"
    _, figure = drawn_study(tmp_path, f"vary: [{varied}{other}, {other}]}}]\ncolumns: [end_stiffness]\n{plot}\n")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["row 1 of each cable damping", "row 2 of each cable damping"]


@pytest.mark.parametrize("name", ["gondola.mass", "gondola.mass_kg"])
def test_varied_keys_are_drawn_along_both_axes(tmp_path, name):
    _, figure = drawn_study(tmp_path, f"{PLANE}plot: {{x: {name}, y: [cable.preload, sag]}}\n")
    preload, _ = figure.axes
    assert preload.get_ylabel() == "cable preload [N]"
    assert figure.axes[-1].get_xlabel() == "gondola mass [kg]"
    assert [list(line.get_xdata()) for line in preload.lines] == [[20, 50, 80]] * 2
    assert [list(line.get_ydata()) for line in preload.lines] == [[500] * 3, [1000] * 3]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["cable preload 500 N", "cable preload 1000 N"]


def test_a_varied_key_is_drawn_in_the_unit_in_which_it_is_written(tmp_path):
    text = "vary: [{cable.diameter: [1.85 mm, 0.37 cm]}]\ncolumns: [sag]\nplot: {x: cable.diameter, y: sag}\n"
    _, figure = drawn_study(tmp_path, f"set: {{cable.preload: 1 kN}}\n{text}")
    (line,) = figure.axes[0].lines
    assert list(line.get_xdata()) == [1.85, 3.7]
    assert figure.axes[0].get_xlabel() == "cable diameter [mm]"


def test_two_varied_numbers_are_a_heat_map_of_the_third(tmp_path):
    table, figure = drawn_study(tmp_path, f"{PLANE}plot: {{x: gondola.mass, y: cable.preload, color: sag}}\n")
    axes, bar = figure.axes
    (mesh,) = axes.collections
    sags = [row["sag_m"] for row in table.rows]  # the mass runs fastest
    np.testing.assert_allclose(mesh.get_array().ravel(), sags)
    np.testing.assert_allclose(mesh.get_coordinates()[0, :, 0], [5, 35, 65, 95])
    np.testing.assert_allclose(mesh.get_coordinates()[:, 0, 1], [250, 750, 1250])
    assert {float(text.get_text()) for text in axes.texts} == {float(f"{sag:.3g}") for sag in sags}
    assert bar.get_ylabel() == "sag [m]"
    assert figure.legends == []  # every cell has an answer


def test_cells_of_a_heat_map_without_an_answer_are_named(tmp_path):
    """No cable has less mean tension than its own weight gives it."""
    text = "vary: [{cable.diameter: [2 mm, 40 mm]}, {cable.preload: [250 N, 500 N]}]\ncolumns: [stress]\n"
    table, figure = drawn_study(tmp_path, f"{text}plot: {{x: cable.diameter, y: cable.preload, color: stress}}\n")
    assert [row["stress_MPa"] is None for row in table.rows] == [False, False, True, True]
    assert faults(figure) == []
    assert [entry.get_text() for entry in figure.legends[0].get_texts()] == ["no answer"]
    np.testing.assert_allclose(figure.axes[0].collections[0].get_coordinates()[0, :, 0], [-17, 21, 59])
    assert {text.get_text() for text in figure.axes[0].texts} == {"79.6", "159"}  # force / (pi / 4 (2 mm)^2) [MPa]


def test_numbers_that_do_not_fit_into_the_cells_of_a_heat_map_are_lines_of_equal_values(tmp_path):
    ropes = "vary: [{cable.diameter: {from: 1 mm, to: 8 mm, count: 9, spacing: log}}, {cable.preload: [%s]}]"
    text = f"{ropes % '1 kN, 2 kN, 3 kN, 4 kN'}\ncolumns: [stress]\n"
    _, figure = drawn_study(tmp_path, f"{text}plot: {{x: cable.diameter, y: cable.preload, color: stress}}\n")
    assert faults(figure) == []
    assert len(figure.axes[0].collections) == 2  # cells and lines


@pytest.mark.parametrize(("masses", "collections"), [("10, 20, 30", 1), ("10, 20, 30, 40, 50, 60, 70, 80, 90", 2)])
def test_small_heat_maps_side_by_side_have_numbers_where_these_fit_and_lines_where_not(tmp_path, masses, collections):
    """Two panels, each half as wide as a single one, with cells and perhaps lines as collections."""
    diameters = "vary: [{cable.diameter: [2 mm, 3 mm]}, {cable.preload: [1 kN, 2 kN, 3 kN, 4 kN]}"
    text = f"{diameters}, {{gondola.mass: [{masses}]}}]\ncolumns: [gondola_frequency_static]\n"
    drawn = "plot: {x: gondola.mass, y: cable.preload, color: gondola_frequency_static}\n"
    table, figure = drawn_study(tmp_path, text + drawn)
    assert faults(figure) == []
    *panels, _ = figure.axes
    assert [len(axes.collections) for axes in panels] == [collections] * 2
    for diameter, axes in zip((2, 3), panels, strict=True):
        rows = [row for row in table.rows if row["cable.diameter_m"] == pytest.approx(diameter * 1e-3)]
        values = {float(f"{row['gondola_frequency_static_Hz']:.3g}") for row in rows}
        if collections == 1:
            assert {float(text.get_text()) for text in axes.texts} == values
        else:
            assert axes.collections[1].levels.size


def test_a_fine_heat_map_has_lines_of_equal_values(tmp_path):
    """At round values, where the numbers of the table, interpolated between neighbours, have them."""
    vary = "[{cable.preload: {from: 1 kN, to: 2 kN, count: 12}}, {gondola.mass: {from: 10, to: 60, count: 5}}]"
    drawn = "{x: cable.preload, y: gondola.mass, color: gondola_frequency_static}"
    text = f"vary: {vary}\ncolumns: [gondola_frequency_static]\nplot: {drawn}\n"
    table, figure = drawn_study(tmp_path, text)
    axes = figure.axes[0]
    mesh, lines = axes.collections
    cells = np.array([row["gondola_frequency_static_Hz"] for row in table.rows]).reshape(12, 5)
    np.testing.assert_allclose(mesh.get_array(), cells.T)
    value = RegularGridInterpolator((np.linspace(1, 2, 12), np.linspace(10, 60, 5)), cells)
    assert len(lines.levels) >= 4
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        assert float(f"{level:.3g}") == pytest.approx(level, rel=1e-12)
        np.testing.assert_allclose(value(path.vertices), level, rtol=1e-6)
    assert {text.get_text() for text in axes.texts} <= {f"{level:.3g}" for level in lines.levels}


@pytest.mark.parametrize(
    ("preloads", "ticks"),
    [("[1 kN, 3 kN, 9 kN]", [1, 3, 9]), ("{from: 1 kN, to: 8.1 kN, count: 4, spacing: log}", [0.5, 1, 2, 5, 10])],
)
def test_round_values_along_a_logarithmic_axis_are_its_ticks(tmp_path, preloads, ticks):
    text = f"vary: [{{cable.preload: {preloads}}}]\ncolumns: [sag]\nplot: {{x: cable.preload, y: sag, logx: true}}\n"
    _, figure = drawn_study(tmp_path, text)
    low, high = figure.axes[0].get_xlim()
    assert [float(f"{tick:.3g}") for tick in figure.axes[0].get_xticks() if low < tick < high] == [
        tick for tick in ticks if low < tick < high
    ]


def test_samples_are_coloured_points(tmp_path):
    sample = "sample: {method: sobol, count: 8, over: {gondola.mass: {from: 10 kg, to: 20 kg}}}\n"
    text = f"{sample}columns: [gondola_frequency_static]\nplot: {{x: gondola_frequency_static, y: gondola.mass, %s}}\n"
    table, figure = drawn_study(tmp_path, text % "color: gondola.mass")
    (points,) = figure.axes[0].collections
    cells = [(row["gondola_frequency_static_Hz"], row["gondola.mass_kg"]) for row in table.rows]
    np.testing.assert_allclose(points.get_offsets(), cells)
    assert len({tuple(colour) for colour in points.get_facecolors()}) == 8


def test_more_series_than_colours_have_a_colour_bar(tmp_path):
    masses = "{gondola.mass: {from: 10 kg, to: 300 kg, count: 7}}"
    text = f"vary: [{masses}, {{cable.preload: [500 N, 1 kN]}}]\ncolumns: [end_stiffness]\n"
    _, figure = drawn_study(tmp_path, f"{text}plot: {{x: cable.preload, y: end_stiffness}}\n")
    axes, bar = figure.axes
    assert not figure.legends
    assert bar.get_ylabel() == "gondola mass [kg]"
    assert bar.get_ylim() == pytest.approx((10, 300))
    assert len({tuple(line.get_color()) for line in axes.lines}) == 7


def test_two_factors_are_told_apart_by_colours_and_marks(tmp_path):
    materials = "{cable.material: [paper/aramid, paper/nylon, paper/polyester]}"
    masses, preloads = "{gondola.mass: [10 kg, 20 kg, 30 kg, 40 kg]}", "{cable.preload: [500 N, 1 kN]}"
    text = f"vary: [{materials}, {masses}, {preloads}]\ncolumns: [end_stiffness]\n"
    _, figure = drawn_study(tmp_path, f"{text}plot: {{x: cable.preload, y: end_stiffness}}\n")
    looks = [(line.get_color(), line.get_marker()) for line in figure.axes[0].lines]
    assert len(set(looks)) == len(looks) == 12
    assert [len({look[k] for look in looks}) for k in (0, 1)] == [4, 3]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[0] == "gondola mass 10 kg"
    assert labels[-1] == "cable material paper/polyester"
    assert len(labels) == 7


@pytest.mark.parametrize(
    ("text", "x", "y"),
    [
        ("vary: [{gondola.mass: [10 kg, 20 kg]}]\ncolumns: [gondola_frequency_static, end_stiffness, density]",
         "gondola mass [kg]", ["gondola frequency static\n[Hz]", "end stiffness [N/m]"]),
        # of a grid the first number; what shows it, what the scene states and how it was computed are left out
        ("vary: [{cable.material: [paper/aramid, paper/nylon]}, {cable.preload: [500 N, 1 kN]}]\n"
         "columns: [preload, density, iterations, sag, end_stiffness, dof]", "cable preload [N]",
         ["sag [m]", "end stiffness [N/m]"]),
        # of keys that go together one that tells the steps apart
        ("vary: [{gondola.mass: [1 kg, 1 kg, 2 kg], cable.preload: [100 N, 200 N, 300 N]}]\ncolumns: [sag]",
         "cable preload [N]", ["sag [m]"]),
        ("vary: [{gondola.mass: [1 kg, 1 kg, 2 kg], cable.preload: [100 N, 200 N, 100 N]}]\ncolumns: [sag]",
         "row of the table", ["sag [m]"]),
        ("vary: []\ncolumns: [preload, sag]", "preload [N]", ["sag [m]"]),
        # points of a Saltelli design share coordinates
        ("sample: {method: saltelli, count: 4, over: {cable.preload: {from: 1 kN, to: 2 kN}, "
         "gondola.mass: {from: 1 kg, to: 2 kg}}}\ncolumns: [sag]", "cable preload [kN]", ["sag [m]"]),
    ],
)  # fmt: skip
def test_what_a_study_draws_by_itself(tmp_path, text, x, y):
    _, figure = drawn_study(tmp_path, text + "\n")
    assert figure.axes[-1].get_xlabel() == x
    assert [axes.get_ylabel() for axes in figure.axes] == y


def test_the_colour_bar_of_names_has_one_step_for_each(tmp_path):
    materials = "vary: [{cable.material: [paper/aramid, paper/nylon, paper/polyester]}]\n"
    materials += "columns: [sag, end_stiffness]\n"
    plot = "plot: {x: end_stiffness, y: sag, color: cable.material, logx: true, logy: true}\n"
    _, figure = drawn_study(tmp_path, materials + plot)
    panel, bar = figure.axes
    assert bar.get_ylim() == (-0.5, 2.5)
    assert bar.get_yticks().tolist() == [0, 1, 2]
    colours = [tuple(colour) for collection in panel.collections for colour in collection.get_facecolor()]
    (steps,) = (collection.get_facecolor() for collection in bar.collections if isinstance(collection, QuadMesh))
    assert [tuple(step) for step in steps] == colours
    assert panel.get_xscale() == panel.get_yscale() == "log"
    # of columns, unlike of varied keys, no own values but round numbers are ticks
    assert {float(f"{tick:.1g}") for tick in panel.get_xticks()} == set(panel.get_xticks().round(12))


def test_indices_are_drawn_with_their_intervals(tmp_path):
    over = "{gondola.mass: {from: 10 kg, to: 20 kg}, cable.preload: {from: 1 kN, to: 2 kN}}"
    text = f"sample: {{method: saltelli, count: 16, over: {over}}}\ncolumns: [gondola_frequency_static, mass]\n"
    study = read_study(study_file(tmp_path, text, CONFIGS / "carlina.yaml"))
    indices, _ = Sensitivity(study).table(computed(study))
    figure = draw(plots.sensitivity_plot(study, indices))
    assert [axes.get_title("left") for axes in figure.axes] == ["gondola frequency static", "mass"]
    for axes, rows in zip(figure.axes, (indices.rows[:2], indices.rows[2:]), strict=True):
        places = sorted(line.get_xdata()[0] for line in axes.lines if line.get_marker() != "None")
        assert places == sorted(row[kind] for row in rows for kind in ("first_order", "total"))
        spans = sorted(tuple(line.get_xdata()) for line in axes.lines if line.get_marker() == "None")
        assert spans == sorted((row[f"{k}_low"], row[f"{k}_high"]) for row in rows for k in ("first_order", "total"))
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert names == ["gondola mass", "cable preload"]


def test_numbers_and_names_of_pictures():
    numbers = {4.087089075910004: "4.087", -0.12111: "−0.1211", 154496.3: "154500", 1.9e-5: "1.9·10⁻⁵", 1e12: "10¹²"}
    assert {value: number(value) for value in numbers} == numbers
    units = {"kg/m^3": "kg/m³", "um": "µm", "N s/m^2": "N s/m²", "urad": "µrad", "um/s": "µm/s", "lumen": "lumen"}
    assert {unit: unit_text(unit) for unit in units} == units
    forces = {784.8: "784.8 N", -9999.0: "−9999 N", 1e4: "10 kN", 154496.3: "154.5 kN"}
    assert {force: force_text(force) for force in forces} == forces
    lengths = {0.0: "0 m", -9.9e-3: "−9.9 mm", 1.182e-4: "0.1182 mm", 0.01: "0.01 m", 12345.6: "12350 m"}
    assert {length: length_text(length) for length in lengths} == lengths
    assert [force_text(784.8, 1.2e4), length_text(5e-3, -0.1)] == ["0.7848 kN", "0.005 m"]  # in the unit of the largest
    columns = {
        "outofplane_frequency_1": "out-of-plane frequency 1", "n1.inplane_frequency_2": "n1 in-plane frequency 2",
        "gondola_rms": "gondola RMS",
    }  # fmt: skip
    assert {name: column_words(name) for name in columns} == columns
    keys = {
        "wind.speed": "wind speed", "cable.loads.0.fraction": "load 1 fraction", "points.up1.2": "up1 z",
        "winch.controller.notch.frequency": "notch frequency", "case": "load case", "gravity": "gravity",
        "bodies.gondola.wind.area": "gondola wind area", "cables.u4": "cables u4", "bodies.cabin.at.0": "cabin at x",
    }  # fmt: skip
    assert {key: key_words(key) for key in keys} == keys
    values = {
        "1344.7512 N": "1345 N", "6x36-iwrc": "6x36-iwrc", "5 %": "5 %", "null": "none", 0.123456: "0.1235",
        '{"model": "modal", "loss_factor": 0.01}': "model modal, loss factor 0.01",
        '["24.061 m", 0, "142.4312 m"]': "(24.06, 0, 142.4) m",
    }  # fmt: skip
    assert {value: value_text(value) for value in values} == values


# ---------------------------------------------------------------------------------------------------------- files


@pytest.mark.parametrize("kind", list(MAGIC))
def test_files_are_what_they_are_called_and_the_same_every_time(carlina, tmp_path, kind):
    paths = [tmp_path / (name + kind) for name in ("first", "second")]
    for path in paths:
        plots.save(plots.static_form(carlina), str(path))
    first, second = (path.read_bytes() for path in paths)
    assert first.startswith(MAGIC[kind])
    assert first == second
    assert b"Date" not in first


def test_clip_paths_are_numbered_whatever_the_last_digits_of_the_layout(carlina, tmp_path):
    written = []
    for shift in (0.0, 1e-15):  # of the order of rounding: no coordinate of the file shows it
        figure = plots.static_form(carlina)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        for axes in figure.axes:
            low = axes.get_position(original=True)
            axes.set_position((low.x0 * (1 + shift), low.y0, low.width, low.height))
        path = tmp_path / "form.svg"
        plots.save(figure, str(path))
        written.append(path.read_text(encoding="utf-8"))
    assert written[0] == written[1]
    defined = re.findall(r'clipPath id="(\w+)"', written[0])
    assert set(re.findall(r"url\(#(\w+)\)", written[0])) == set(defined)
    assert sorted(defined) == [f"clip{number}" for number in range(1, len(defined) + 1)]


def test_a_picture_that_fails_leaves_the_old_one(carlina, tmp_path, monkeypatch):
    path = tmp_path / "old.png"
    path.write_bytes(b"old")
    figure = plots.static_form(carlina)

    def fail(*_, **__):
        raise RuntimeError("half drawn")

    monkeypatch.setattr(figure, "savefig", fail)
    with pytest.raises(RuntimeError, match="half drawn"):
        plots.save(figure, str(path))
    assert path.read_bytes() == b"old"
    with pytest.raises(SceneError, match="cannot be written"):
        plots.save(plots.static_form(carlina), str(tmp_path / "missing" / "new.png"))
    assert [entry.name for entry in tmp_path.iterdir()] == ["old.png"]


def test_the_user_s_own_style_does_not_matter(carlina, tmp_path):
    plain, odd = tmp_path / "plain.png", tmp_path / "odd.png"
    plots.save(plots.static_form(carlina), str(plain))
    with matplotlib.rc_context({"font.size": 20, "lines.linewidth": 9, "savefig.dpi": 30, "axes.grid": False}):
        plots.save(plots.static_form(carlina), str(odd))
    assert plain.read_bytes() == odd.read_bytes()


def test_command_line_draws_beside_the_table(tmp_path):
    path = tmp_path / "form.SVG"
    assert "sag" in run("static", CONFIGS / "carlina.yaml", "--plot", path).out
    assert path.read_bytes().startswith(MAGIC[".svg"])


# ---------------------------------------------------------------------------------------------------- suspensions


@pytest.mark.parametrize(("at", "equal"), [("[0, 0, 140 m]", True), ("[54.72 m, 0, 149.65 m]", False)])
def test_equal_tensions_have_one_colour_and_no_scale(at, equal):
    scene = load_scene(str(CONFIGS / "suspensions" / "fast.yaml"), [f"bodies.cabin.at={at}"])[1]
    case = SuspensionCase(scene)
    figure = draw(plots.static_form(case))
    tension = case.equilibrium.catenary.mean_tension
    assert len(figure.axes) == (4 if equal else 5)
    if equal:
        assert figure.get_suptitle() == f"Static form: 6 cables, mean tension {tension[0] / 1e3:.1f} kN each"
    else:
        assert figure.axes[-1].get_ylim() == pytest.approx((tension.min() / 1e3, tension.max() / 1e3))
        assert figure.axes[-1].get_ylabel() == "mean tension of the cable [kN]"


def test_names_and_titles_may_have_any_letters(folder):
    """Letters that no font has, and what matplotlib would read as mathematics; warnings are errors here."""
    names = {"top": "顶点", "guy1": "缆一"}
    text = (CONFIGS / "suspensions" / "mast-guys.yaml").read_text(encoding="utf-8")
    for old, new in names.items():
        text = text.replace(old, new)
    write("mast.yaml", text)
    title = r"研究 😀 $preload {a_b^ $x$ and $\frac{"
    vary = "vary: [{cable.preload: [10 kN, 20 kN]}]\ncolumns: [缆一.max_tension]\n"
    write("study.yaml", f"title: '{title}'\nbase: mast.yaml\n{vary}")
    commands = {"modes": ("modes", "mast.yaml", "-n", "1"), "study": ("sweep", "study.yaml", "--no-write")}
    pictures = [f"{name}.{kind}" for kind in ("png", "svg", "pdf") for name in commands]
    for picture in campaign(pictures, ("modes.png", "study.svg", "modes.pdf")):
        assert run(*commands[picture[:5]], "--plot", picture).lines[-1] == f"written: {picture}"
    run("report", "study.yaml", "--out", "study.html")


def test_a_font_that_is_installed_draws_letters_that_the_first_one_lacks(monkeypatch):
    style.families.cache_clear()
    assert style.families()[0] == "DejaVu Sans"
    monkeypatch.setattr(style, "OTHER_LETTERS", ("Nowhere Installed", "cmr10", "STIXGeneral"))
    style.families.cache_clear()
    assert style.families() == ["DejaVu Sans", "cmr10", "STIXGeneral"]
    style.families.cache_clear()


def test_fonts_that_are_not_found_are_no_warning(caplog):
    """Matplotlib keeps a list of fonts, which another installation may have written."""
    fonts = logging.getLogger("matplotlib.font_manager")

    @style.styled
    def draw():
        fonts.warning("findfont: not found")
        return 1

    assert draw() == 1
    assert not caplog.records
    fonts.warning("findfont: not found")
    assert len(caplog.records) == 1


def test_in_the_legend_a_rider_hangs_below_the_chord():
    """Where the load is, and not at mid-span: the cable at its place, with the chord between the ends."""
    rides = "cases={start: {loads: [{fraction: 0.2, mass: 80 kg}]}, arrival: {loads: [{fraction: 0.9, mass: 80 kg}]}}"
    cases = {name: case_of("zipline", "cable.loads=[]", rides, f"case={name}") for name in ("start", "arrival")}
    figure = draw(plots.case_forms(cases))
    for name, case in cases.items():
        cable = next(one for one in figure.axes[0].collections if one.get_label().startswith(f"{name}: "))
        x, z = np.unique(cable.get_segments()[0], axis=0).T  # a load may be at one of the even places
        kink = int(np.argmax(np.abs(np.diff(np.diff(z) / np.diff(x))))) + 1  # where the slope jumps
        below = np.interp(x[kink], [x[0], x[-1]], [z[0], z[-1]]) - z[kink]
        assert cable.get_label() == f"{name}: load {below:.4g} m below the chord", case
