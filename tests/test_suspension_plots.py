"""Pictures of a suspension in the wind and of the loop of its winches: what they show."""

from pathlib import Path

import numpy as np
import pytest
from command import run, with_sets, written
from picture import faults
from scenes import scene_of
from suspension_cases import SUSPENSIONS, case_at

from cablestudy import plots
from cablestudy.errors import NoSolutionError
from cablestudy.interface import load
from cablestudy.plots.wind import ellipse
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.wind_report import wind_tables

pytestmark = pytest.mark.usefixtures("folder")

CONTROLLED = (  # changes of carlina-net
    "bodies.gondola.wind={area: 0.6 m^2, drag_coefficient: 1.2}",
    "wind={speed: 6 m/s, direction: 30 deg, turbulence_intensity: [0.15, 0.12, 0.08], length_scale: 25 m}",
    "control={gain: 0.3 rad/s, measured: [x, y, z]}",
)
DAMPER = "{axis: [1, 0, 0], mass: 1 kg, frequency: 0.1 Hz, velocity_gain: 50 N s/m, stroke: 1 m, force: 100 N}"
# A mass free along x only, without winches.
SLIDER = """
gravity: 0
cable: {elastic_modulus: 100 GPa, area: 1 mm^2, density: 1440 kg/m^3, preload: 500 N}
bodies:
  mass: {at: [2, 0, 0], mass: 3 kg, inertia: [1, 1, 1], attachments: {a: [0, 0, 0]}, free: [x],
         wind: {area: 0.6 m^2, drag_coefficient: 1.17}}
cables: {left: {from: [0, 0, 0], to: mass.a}, right: {from: [6, 0, 0], to: mass.a}}
wind: {speed: 6 m/s, turbulence_intensity: 0.15, length_scale: 25 m}
"""


def case_of(text, *sets):
    return SuspensionCase(scene_of(text, *sets))


def whole(figure):
    """A figure that is drawn and has no faults."""
    assert faults(figure) == []
    return figure


def test_long_names_of_anchors_do_not_overlap_beside_a_bar_of_colours():
    """Four views with long names between two anchors, and tensions that differ."""
    name = "a-very-long-name-of-an-anchor-at-the-north-of-the-valley"
    lines = {"one": (name, 51), "two": ("another-quite-long-name-of-an-anchor", 51), "three": ("third", 78)}
    cables = ", ".join(f"{k}: {{from: {a}, to: k, unstretched_length: {length} m}}" for k, (a, length) in lines.items())
    text = f"""
cable: {{material: steel, diameter: 20 mm}}
points: {{{name}: [0, 0, 0], another-quite-long-name-of-an-anchor: [100, 0, 5], third: [50, 80, 10],
         k: {{at: [50, 3, -4], free: true, mass: 40 kg}}}}
cables: {{{cables}}}
"""
    whole(plots.static_form(case_of(text)))


def test_every_view_names_all_anchors_that_have_room():
    """In the view from the side one anchor has room above or below its place alone, not beside it."""
    figure = whole(plots.static_form(case_at("carlina-net")))
    for axes in figure.axes[:4]:
        names = ", ".join(text.get_text() for text in axes.texts).split(", ")
        assert {"gondola", *(f"{way}{number}" for way in ("up", "down") for number in (1, 2, 3))} <= set(names)


def loaded_net(seed):
    """A chain of two or three points between anchors, over the ground, with loads on its first cable."""
    rng = np.random.default_rng(seed)
    across = rng.uniform(0, 60) if rng.random() < 0.6 else 0.0
    points, cables = {}, {}
    for k in range(int(rng.integers(2, 4))):
        knot = rng.uniform([-20, -across / 3, -5], [20, across / 3, 0])
        points[f"knot{k}"] = {"at": knot.tolist(), "free": True, "mass": rng.uniform(1, 50)}
        for i in range(int(rng.integers(2, 4))):
            anchor = rng.uniform([-60, -across, 0], [60, across, 20])
            name = ("north", "support-at-the-river", "p")[i] + str(k)
            points[name], length = anchor.tolist(), np.linalg.norm(anchor - knot) * rng.uniform(0.99, 1.1)
            cables[f"c{k}{i}"] = {"from": name, "to": f"knot{k}", "unstretched_length": length}
    cables["c00"]["loads"] = [{"fraction": at, "mass": rng.uniform(1, 20)} for at in (0.3, 0.4, 0.6)]
    cable = {"material": "steel", "diameter": 0.004}
    return {"cable": cable, "points": points, "cables": cables, "ground": -rng.uniform(5, 30)}


@pytest.mark.parametrize("seed", [28, 43, 50])  # sags, or the clearance and a load, close together
def test_texts_of_random_nets_stand_apart(seed):
    whole(load(loaded_net(seed)).plot("static"))


def test_views_below_each_other_have_their_texts_apart():
    """The label below an upper view and the title above a lower one, by at least half a line, when first drawn."""
    figure = plots.static_form(case_at("cable-robot"))
    figure.draw_without_rendering()
    _, above, _, below = figure.axes[:4]
    label, title = above.xaxis.label.get_window_extent(), below._left_title.get_window_extent()
    assert label.y0 - title.y1 > 0.5 * title.height


def words(figure):
    """Entries of the legend of a figure."""
    return [text.get_text() for text in figure.legends[0].get_texts()]


def lines(axes):
    return {line.get_label(): line for line in axes.lines}


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


@pytest.fixture(scope="module")
def controlled():
    return case_at("carlina-net", *CONTROLLED)


# ---------------------------------------------------------------------------------------------------- in the wind


def test_spectra_and_variances_are_those_computed(controlled):
    figure = whole(plots.wind_response([controlled.analysis]))
    speed, places, below, turns, below_turns, above, side = figure.axes
    assert any(tick.label1.get_visible() for tick in speed.xaxis.get_major_ticks())
    responses = [controlled.analysis.response_of(open_loop) for open_loop in (False, True)]
    response = responses[0]
    drawn = lines(places)
    assert legend(places) == ["x", "y", "z"]
    assert legend(turns) == ["rx", "ry", "rz"]
    frequency = drawn["z"].get_xdata()
    rows = [response.names.index("gondola.z"), response.names.index("gondola.ry")]
    some = np.searchsorted(frequency, [0.01, 0.5857, 3.0])
    closed, at_rest = (response.spectra(frequency[some])[rows] for response in responses)
    assert drawn["z"].get_ydata()[some] == pytest.approx(1e6 * closed[0], rel=1e-9)
    assert lines(turns)["ry"].get_ydata()[some] == pytest.approx(1e12 * closed[1], rel=1e-9)
    dashed = [line for line in places.lines if line.get_linestyle() == "--"]
    assert len(dashed) == 3
    assert dashed[2].get_ydata()[some] == pytest.approx(1e6 * at_rest[0], rel=1e-9)
    for axes, names, unit in ((below, "xyz", "mm"), (below_turns, ("rx", "ry", "rz"), "µrad")):
        scale = 1e3 if unit == "mm" else 1e6
        texts = []
        for label, open_loop in (("winches at rest", True), ("winch loop closed", False)):
            rms = controlled.analysis.rms([f"gondola.{axis}" for axis in names], "value", open_loop)[0]
            texts.append(f"{label}: {scale * rms:.4g} {unit} RMS")
        assert legend(axes) == texts
        for line in axes.lines:
            share = line.get_ydata()
            assert (share[0], share[-1]) == pytest.approx((0, 1))
            assert (np.diff(share) >= 0).all()
    for axes in (places, turns):
        assert axes.get_ylabel() in ("spectrum of\ndisplacements [mm²/Hz]", "spectrum of\nrotations [µrad²/Hz]")
    assert [axes.get_xlabel() for axes in (below, above, side)] == ["frequency [Hz]", "x [mm]", "along the wind [mm]"]
    assert figure.get_suptitle() == "Wind at 6 m/s on gondola"


def test_the_ellipse_reaches_the_rms_in_each_direction(controlled):
    *_, above, side = plots.wind_response([controlled.analysis]).axes
    in_wind = controlled.analysis
    for state, open_loop in (("winches at rest", True), ("winch loop closed", False)):
        x, y, z = (1e3 * in_wind.rms([f"gondola.focus.{axis}"], "value", open_loop)[0] for axis in "xyz")
        points = lines(above)[state].get_xydata()
        assert points.max(axis=0) == pytest.approx([x, y], rel=1e-3)
        assert lines(side)[state].get_xydata()[:, 1].max() == pytest.approx(z, rel=1e-3)
        # along the wind at 30 degrees the two pictures agree
        turned = points @ [np.cos(np.pi / 6), np.sin(np.pi / 6)]
        assert turned.max() == pytest.approx(lines(side)[state].get_xydata()[:, 0].max(), rel=1e-3)
    assert above.get_title(loc="left") == "gondola.focus from above"
    # the drag along the wind changes twice as much with the speed as that across it
    assert (points @ [0.5, -np.sqrt(3) / 2]).max() < 0.7 * turned.max()


def test_an_ellipse_is_that_of_its_covariance():
    covariance = np.array([[4.0, 1.5], [1.5, 1.0]])
    points = ellipse(covariance)
    for angle in (0.0, 0.7, 2.1):
        direction = np.array([np.cos(angle), np.sin(angle)])
        assert (direction @ points).max() == pytest.approx(np.sqrt(direction @ covariance @ direction), rel=1e-3)


def test_actuators_are_drawn_with_winches_at_rest_and_with_the_loop_as_the_tables_have_them(controlled):
    case = case_at("carlina-net", *CONTROLLED, f"actuators.damper={DAMPER}")
    figure = whole(plots.wind_response([case.analysis]))
    names = [f"gondola.{axis}" for axis in "xyz"]
    tables, _ = wind_tables(None, case)
    motion, open_loop = (tables[name].rows[0]["rms_mm"] for name in ("motion", "open_loop"))

    def rms(one, open_loop):
        return f"{1e3 * one.analysis.rms(names, 'value', open_loop)[0]:.4g} mm RMS"

    assert legend(figure.axes[2]) == [
        f"actuators, winches at rest: {open_loop:.4g} mm RMS",
        f"loop, no actuators: {rms(controlled, False)}",
        f"loop and actuators: {motion:.4g} mm RMS",
    ]


def test_a_body_with_one_motion_has_one_panel():
    figure = whole(plots.wind_response([case_of(SLIDER).analysis]))
    speed, spectra, below = figure.axes
    assert not any(tick.label1.get_visible() for tick in speed.xaxis.get_major_ticks())
    assert legend(speed)[0] == "wind speed"
    assert legend(spectra) == ["without control"]
    assert legend(below)[0].startswith("without control: ")


def test_what_the_wind_does_not_move_is_not_drawn():
    case = case_of(SLIDER, "bodies.mass.free=[]")
    with pytest.raises(NoSolutionError, match="nothing"):
        plots.wind_response([case.analysis])


# ------------------------------------------------------------------------------------------------------- the loop


def test_the_loop_over_frequency_with_its_margins(controlled):
    closed_loop = controlled.analysis.closed_loop
    loop = closed_loop.loop
    figure = whole(plots.loop_margins(closed_loop))
    gains, sensitivity, eigenvalues, numbers = figure.axes
    frequency = lines(gains)["largest singular value of L"].get_xdata()
    some = np.searchsorted(frequency, [0.01, 0.5857, 3.0])
    s = 2j * np.pi * frequency[some]
    transfer = loop.gain * closed_loop.stability.gains.loop_gain(s)
    largest = [20 * np.log10(np.linalg.svd(one)[1][0]) for one in transfer]
    assert lines(gains)["largest singular value of L"].get_ydata()[some] == pytest.approx(largest, rel=1e-9)
    closed = [np.linalg.inv(np.eye(3) + one) for one in transfer]
    for name, matrices in {"|S|": closed, "|T|": [np.eye(3) - one for one in closed]}.items():
        seen = [20 * np.log10(np.linalg.svd(one)[1][0]) for one in matrices]
        assert lines(sensitivity)[name].get_ydata()[some] == pytest.approx(seen, abs=1e-7)
    highest = 10 ** (lines(sensitivity)["|S|"].get_ydata().max() / 20)
    assert highest == pytest.approx(closed_loop.stability.margins.sensitivity_peak, rel=1e-3)
    # an eigenvalue of the loop gain passes where the gain margin is marked, and none within the circle about -1
    marked = next(line for name, line in lines(eigenvalues).items() if name.startswith("gain margin"))
    place = marked.get_xdata()[0]
    assert place == pytest.approx(-loop.gain / closed_loop.stability.largest_gain, rel=1e-9)
    passing = np.concatenate([line.get_xydata() for line in eigenvalues.lines if len(line.get_xydata()) > 1000])
    assert np.nanmin(np.hypot(*(passing - [place, 0]).T)) < 0.02 * abs(place)
    assert np.nanmin(np.hypot(*(passing - [-1, 0]).T)) > 0.999 / closed_loop.stability.margins.sensitivity_peak
    margin = f"{20 * np.log10(-1 / place):.4g} dB"
    assert f"gain margin {margin}" in legend(numbers)
    assert margin in [text.get_text() for text in numbers.texts]
    assert figure.get_suptitle().startswith("Loop that holds gondola (x, y, z) by 6 winches")


def test_the_loop_of_an_unstable_gain_is_drawn_too():
    case = case_at("carlina-net", *CONTROLLED, "control.gain=300 rad/s", "control.notch=none")
    closed_loop = case.analysis.closed_loop_of(20)
    figure = whole(plots.loop_margins(closed_loop))
    assert any("gain margin −" in text for text in legend(figure.axes[-1]))


def test_the_command_draws_a_response():
    """What `ssm --with loop --plot` prints and draws without one is on the page of suspensions."""
    sets = with_sets(*CONTROLLED)
    response = ("--response", "0.1Hz:1Hz:9", "--plot", "bode.png")
    run("ssm", SUSPENSIONS / "carlina-net.yaml", *sets, "--with", "loop", *response, "--quiet")
    assert Path("bode.png").read_bytes().startswith(b"\x89PNG")


# A section of three spans of a line, whose strings hang from fixed points.
SECTION = """
cable: {diameter: 28 mm, elastic_modulus: 70 GPa, density: 3400 kg/m^3, expansion: 19e-6}
points:
  {a: [0, 0, 30], b: {at: [350, 0, 25], free: true, mass: 60}, top1: [350, 0, 28],
   c: {at: [700, 0, 26], free: true, mass: 60}, top2: [700, 0, 29], d: [1050, 0, 30]}
cables:
  s1: {from: a, to: b, unstretched_length: 351}
  s2: {from: b, to: c, unstretched_length: 351}
  s3: {from: c, to: d, unstretched_length: 351}
  i1: {from: top1, to: b, unstretched_length: 3}
  i2: {from: top2, to: c, unstretched_length: 3}
ground: [[-10, 2], [500, 5], [1100, 0]]
cases: {everyday: {temperature: 15 degC}, hot: {temperature: 70 degC}}
"""


def cases_of(text, *names):
    return {name: case_of(text, f"case={name}") for name in names}


def test_load_cases_are_drawn_together_over_the_ground():
    cases = cases_of(SECTION, "everyday", "hot")
    figure = whole(plots.case_forms(cases))
    (axes,) = figure.axes  # all in one plane
    assert axes.get_aspect() == 5.0
    assert axes.get_title(loc="left") == "From the front, vertical scale enlarged 5 times"
    largest = [np.linalg.norm(case.equilibrium.end_forces, axis=-1).max() for case in cases.values()]
    assert words(figure) == [
        *(f"{name}: tension up to {most / 1e3:.2f} kN" for name, most in zip(cases, largest, strict=True)),
        "ground",
    ]
    assert lines(axes)["ground"].get_xydata().tolist() == [[-10, 2], [500, 5], [1100, 0]]
    for case, drawn in zip(cases.values(), axes.collections, strict=False):
        cable = drawn.get_segments()[1]  # from b to c
        assert cable[[0, -1]] == pytest.approx(case.equilibrium.position[:, [0, 2]], rel=1e-12)
        slope = np.gradient(cable[:, 1], cable[:, 0])
        # a parabola of weight per horizontal length over horizontal tension, nearly
        force = abs(case.equilibrium.end_forces[1, 0])
        weight = 3400 * 9.81 * np.pi * 0.014**2 * 351 / 350
        assert np.gradient(slope, cable[:, 0])[30] == pytest.approx(weight / force[0], rel=0.01)


def test_forms_in_wind_are_drawn_from_their_chords():
    """The clamps move aside too, by less than a thousandth of the section."""
    blown = "cases.blown={temperature: 15 degC, wind: {pressure: 12 Pa, direction: 90 deg}}"
    cases = {name: case_of(SECTION, blown, f"case={name}") for name in ("blown", "everyday")}
    figure = whole(plots.case_forms(cases))
    *_, axes = figure.axes
    assert axes.get_title(loc="left") == "Seen along the span, true to scale"
    aside = cases["blown"].rest.position[:, 1]
    assert np.abs(aside).min() > 0.05
    segments = axes.collections[0].get_segments()
    assert len(segments) == 5
    for segment in segments:
        assert segment[[0, -1]] == pytest.approx(np.zeros((2, 2)), abs=1e-9)


def test_one_case_of_a_long_scene_is_drawn_over_the_ground_in_the_colours_of_its_tensions():
    """The clearance is that of its table, and where it is marked a cable and the ground are so far apart."""
    case = case_of(SECTION, "case=hot")
    figure = whole(plots.static_form(case))
    axes, bar = figure.axes
    assert (axes.get_aspect(), bar.get_ylabel()) == (5.0, "mean tension of the cable [kN]")
    assert figure.get_suptitle() == "Load case hot: 5 cables"
    tensions = case.equilibrium.catenary.mean_tension / 1e3
    assert bar.get_ylim() == pytest.approx((tensions.min(), tensions.max()))
    rows = load("s.yaml", case="hot").static()["cables"]
    least = rows["clearance_m"].min()
    assert f"clearance {least:.4g} m" in [text.get_text() for text in axes.texts]
    arrows = [(text.xy, text.xyann) for text in axes.texts if text.arrow_patch]
    ((_, low), (_, high)) = next(
        ((x, low), end) for (x, low), end in arrows if low == pytest.approx(np.interp(x, [-10, 500, 1100], [2, 5, 0]))
    )
    assert high - low == pytest.approx(least, rel=1e-3)
    sags = dict(zip(rows["name"], rows["sag_m"], strict=True))  # those of the spans have dimensions from their chords
    assert sorted(
        end[1] - low for (_, low), end in arrows if end[1] - low != pytest.approx(least, rel=1e-3)
    ) == pytest.approx(sorted(sags[name] for name in ("s1", "s2", "s3")), rel=1e-6)


def test_bodies_of_load_cases_are_drawn_by_their_attachments():
    """Lines from each beam's middle to its four hangers, in the colour of the case."""
    text = f"base: {SUSPENSIONS / 'cable-robot.yaml'}\n"
    text += "cases: {empty: {}, loaded: {forces: {platform: [0, 0, -50 N]}}}\n"
    figure = plots.case_forms(cases := cases_of(text, "empty", "loaded"))
    case = cases["loaded"]
    body = case.scene.bodies["platform"]
    arms = np.array(list(body.attachments.values())) @ case.equilibrium.rotation[0].T
    drawn = [one.get_segments() for one in figure.axes[0].collections]
    expected = [
        [case.equilibrium.position[0, [0, 2]] + arm[[0, 2]], case.equilibrium.position[0, [0, 2]]] for arm in arms
    ]
    assert any(np.shape(lines) == np.shape(expected) and np.allclose(lines, expected, rtol=1e-12) for lines in drawn)


def test_load_cases_in_space_are_drawn_from_three_sides():
    text = f"base: {SUSPENSIONS / 'mast-guys.yaml'}\nground: 0\n"
    text += "cases: {lean: {forces: {top: [10 kN, 0, 0]}}, settled: {moves: {ground1: [0, 0, -0.1]}}}\n"
    figure = whole(plots.case_forms(cases_of(text, "lean", "settled")))
    assert [axes.get_title(loc="left").partition(",")[0] for axes in figure.axes] == [
        "From the front", "From the side", "From above"]  # fmt: skip
    assert ["ground" in lines(axes) for axes in figure.axes] == [True, True, False]


def test_links_have_an_entry_in_the_legend_and_of_several_load_cases_the_colour_of_each():
    text = """
cable: {axial_stiffness: 10 MN, mass_per_length: 1 kg/m, diameter: 20 mm}
points: {knot: {at: [50, 0, 8], free: true, mass: 60}}
cables:
  west: {from: [0, 0, 10], to: knot, unstretched_length: 51}
  east: {from: knot, to: [100, 0, 10], unstretched_length: 51}
links: {hanger: {from: [50, 0, 12], to: knot, stiffness: 1 MN/m, length: 3 m}}
cases:
  calm: {forces: {knot: [0, 0, -1 kN]}}
  storm: {wind: {speed: 30 m/s, direction: 90 deg}}
"""
    one = whole(plots.static_form(case_of(text)))
    assert "link" in words(one)
    both = whole(plots.case_forms(cases_of(text, "calm", "storm")))
    assert both.axes[-1].get_title(loc="left").startswith("From above, scale across enlarged ")
    lines = [line for line in both.axes[-1].collections if line.get_linestyle()[0][1] == [3.7 * 1.4, 1.6 * 1.4]]
    calm, storm = (line.get_colors()[0] for line in lines if len(line.get_segments()[0]) == 2)
    labels = {line.get_label().partition(":")[0]: line.get_colors()[0] for line in both.axes[-1].collections}
    assert (tuple(calm), tuple(storm)) == (tuple(labels["calm"]), tuple(labels["storm"]))
    assert "link" not in words(both)


def test_the_command_draws_all_load_cases():
    done = run("static", written(SECTION), "--case", "all", "--table", "points", "--plot", "cases.svg")
    assert done.lines == ["written: cases.svg"]
    assert "vertical scale enlarged" in Path("cases.svg").read_text(encoding="utf-8")


def dashed(axes):
    """Curves of the dashed lines of a view."""
    return [curve for one in axes.collections if one.get_linestyle()[0][1] for curve in one.get_segments()]


def test_a_lost_cable_is_drawn_pale_and_dashed_where_it_would_be():
    """Its curve runs between the ends that it has with all cables."""
    text = f"base: {SUSPENSIONS / 'mast-levels.yaml'}\ncases: {{broken: {{lost: [north-high]}}}}\n"
    case, everyday = case_of(text, "case=broken"), case_of(text)
    ends = everyday.equilibrium.ends[everyday.equilibrium.suspension.cable_names.index("north-high")]
    figure = whole(plots.static_form(case))
    assert words(figure) == ["lost", "ground"]
    for axes, (x, y) in zip(figure.axes[1:4], ((0, 1), (0, 2), (1, 2)), strict=True):
        (curve,) = dashed(axes)
        assert curve[[0, -1]] == pytest.approx(ends[:, [x, y]], abs=1e-9)
    assert words(whole(plots.static_form(everyday))) == ["ground"]


def test_load_cases_name_what_they_lose():
    text = SECTION.replace("hot: {temperature: 70 degC}", "broken: {lost: [s2, i2]}")
    cases = cases_of(text, "everyday", "broken")
    axes, _ = whole(figure := plots.case_forms(cases)).axes  # below it the sags, small beside the cable that fell
    assert words(figure)[2:] == ["lost in broken", "ground", "chord"]
    lost = next(one for one in axes.collections if one.get_label() == "lost in broken").get_segments()
    at = cases["everyday"].equilibrium.ends[:, :, [0, 2]]  # s2 and i2, at the temperature of the reference state
    assert np.array([curve[[0, -1]] for curve in lost]) == pytest.approx(at[[1, 4]], rel=1e-3)


def test_a_picture_of_modes_names_its_load_case_and_what_each_panel_shows():
    scene = load(written(SECTION), case="hot")
    figure = whole(scene.plot("modes"))
    assert figure.get_suptitle().startswith("Load case hot: 12 modes,")
    shown = {text.get_text().partition(" ")[2] for axes in figure.axes for text in axes.texts}
    assert {"in-plane, z", "out-of-plane, sideways"} <= shown
    assert scene.plot("static").get_suptitle().startswith("Load case hot: 5 cables")
