"""The wind on the cable: dense matrices with the covariance of all nodes, closed forms, limits; vortices."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from campaign import campaign
from command import CARLINA, rows_of, run, table_of, with_sets
from references.cable_of_bars_in_wind import CableOfBars
from references.panels import panels
from scenes import case_of, cells, scene, scene_of
from scipy.integrate import trapezoid

from cablestudy import plots
from cablestudy.cable.element import Mesh, basis, lagrange
from cablestudy.scene.scene import quantity_of
from cablestudy.study.one_cable import system as one_cable_system
from cablestudy.study.one_cable import wind_report
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.tolerances import STUDY
from cablestudy.wind.coherence import along_cable, gauss, rods
from cablestudy.wind.drag import drag_matrices, shedding_frequencies
from cablestudy.wind.spectrum import speed_spectrum

SLOW_LOOP = "winch.controller.gain=0.05"
HYSTERETIC = "cable.damping={model: hysteretic, loss_factor: 0.02}"
VISCOUS = "cable.damping={model: kelvin_voigt, time: 4.4 ms}"
INCLINED = "cable.ends=[[0, 0, 0], [160 m, 0, 95 m]]"
AIR = "wind.aerodynamic_damping=true"
VERTICAL = "cable.ends=[[0, 0, 0], [0, 0, 185.8]]"
SAGGING = "cable.unstretched_length=186.5 m"
ASIDE = "cable.loads=[{at: 60 m, force: [0, 30 N, -10 N]}]"


def integral(load, ratio):
    """Double integral of load(a) conj(load(b)) exp(-ratio |a - b|) over [0, 1]^2, in panels about each a."""
    total = 0.0
    for node, share in zip(*np.polynomial.legendre.leggauss(100), strict=True):
        a = (1 + node) / 2
        b, weights = panels(a)
        total += share / 2 * (load(a) * (weights * np.exp(-ratio * np.abs(a - b)) @ np.conj(load(b)))).real
    return total


# the sum over the cable


def polynomial(mesh, function):
    """The rod of a mesh, and a load that is a function of the place, in the functions of the rod."""
    found = rods(mesh, np.ones((1, mesh.elements, mesh.order)))
    return found, expanded(mesh, found, function)


def expanded(mesh, found, function, stretch=lambda s: 1.0):
    """A load that is a function of the place, in the functions of the rod of a cable with a stretch of the mean 1."""
    points, weights = gauss(mesh.order)
    places = mesh.edges[:-1, None] + mesh.sizes[:, None] * points
    loads = function(places) * stretch(places) * mesh.sizes[:, None] * weights
    nodal = np.zeros(mesh.nodes, dtype=loads.dtype)
    np.add.at(nodal, mesh.element_nodes, loads @ lagrange(basis(mesh.order).nodes, points))
    return found.shapes[0].T @ nodal


def variances(found, load, *ratios):
    """The double integral of a complex load: that of its real and that of its imaginary part."""
    both = np.stack([load.real, load.imag])[None, None]
    return np.trace(found.covariance(both, np.array([ratios]))[0], axis1=1, axis2=2)


@pytest.mark.crossed
@pytest.mark.parametrize("ratio", [1e-250, 1e-9, 1e-3, 1.0, 30.0, 400.0])
@pytest.mark.parametrize(("elements", "order"), [(1, 16), (3, 10), (1, 48)])
def test_a_load_on_high_orders_against_a_fine_integration(ratio, elements, order):
    def load(s):
        return np.cos(5 * s + 0.3) + 1j * s**2

    found, collected = polynomial(Mesh(np.linspace(0, 1, elements + 1) ** 1.3, order), load)
    value = variances(found, collected, ratio)[0]
    # a layer at the ends that no node resolves has the share l/L of the sum
    assert value == pytest.approx(integral(load, ratio), rel=1e-5 if ratio < 100 else 1 / ratio)


def test_a_load_on_bars_converges_with_their_square():
    k, r = np.pi, 12.0  # closed form: 2 times the integral of sin against its decaying sum
    exact = r / (r**2 + k**2) + 2 * k**2 * (1 + np.exp(-r)) / (r**2 + k**2) ** 2
    errors = []
    for elements in (10, 20, 40):
        found, collected = polynomial(Mesh(np.linspace(0, 1, elements + 1), 1), lambda s: np.sin(np.pi * s))
        errors.append(abs(variances(found, collected, r)[0] / exact - 1))
    assert errors[0] < 0.03
    assert np.diff(np.log2(errors)).max() < -1.8


def test_whole_coherence_is_the_square_of_the_sum_and_none_is_the_sum_of_squares():
    found, collected = polynomial(Mesh(np.linspace(0, 1, 21), 2), lambda s: 1 + s**2)
    whole, none = variances(found, collected, 1e-300, 1e12)
    assert whole == pytest.approx((4 / 3) ** 2, rel=1e-10)
    assert none == pytest.approx(2e-12 * (1 + 2 / 3 + 1 / 5), rel=1e-4)


EQUAL = Mesh(np.linspace(0, 1, 2001), 1)
BEND = 2.0 ** -np.array([3, 3, 4, 4, 5, 6, 7, 8, 9, 10, 10, 9, 8, 7, 6, 5, 4, 4, 3, 3, 3])  # sizes in a narrow bend
UNEQUAL = Mesh(np.concatenate([[0.0], np.cumsum(BEND) / BEND.sum()]), 40)


@pytest.mark.parametrize(("mesh", "rel"), [(EQUAL, 2e-5), (UNEQUAL, 1e-5)], ids=["equal", "unequal"])
def test_many_nodes_are_thinned_without_loss(mesh, rel):
    """As many cosines as half of the nodes of unequal elements, of which these do not resolve all."""
    found, collected = polynomial(mesh, lambda s: np.cos(9 * s))
    assert mesh.nodes > 800
    assert mesh is UNEQUAL or found.square.shape == (1, 800)
    for ratio in (0.1, 12.0, 100.0)[: 3 if mesh is UNEQUAL else 2]:
        value = variances(found, collected, ratio)[0]
        assert value == pytest.approx(integral(lambda s: np.cos(9 * s), ratio), rel=rel)


def test_a_stretched_cable_counts_by_its_stretched_length():
    mesh = Mesh(np.linspace(0, 1, 9), 4)
    stretch = 1 + mesh.point_positions  # of the mean 1.5
    found = rods(mesh, stretch[None])
    assert found.length[0] == pytest.approx(1.5, rel=1e-12)
    load = expanded(mesh, found, np.ones_like, stretch=lambda s: (1 + s) / 1.5)
    value = variances(found, load, 2.0)[0]
    assert value == pytest.approx(2 * (2 - 1 + np.exp(-2)) / 4, rel=1e-8)  # of a constant


def test_covariances_of_loads_are_those_of_their_sums():
    mesh, ratios, weights = Mesh(np.linspace(0, 1, 9), 12), np.array([1e-9, 0.3, 12.0, 100.0]), np.array([0.7, -1.3])
    found, first = polynomial(mesh, lambda s: np.cos(3 * s))
    second = polynomial(mesh, lambda s: 1 + s**2)[1]
    loads = np.stack([np.stack([first, second])] * 2)  # by two components
    covariance = found.covariance(loads[None], ratios[None])[0]
    expected = [2 * integral(lambda s: 0.7 * np.cos(3 * s) - 1.3 * (1 + s**2), ratio) for ratio in ratios]
    assert weights @ covariance @ weights == pytest.approx(expected, rel=1e-6)


def test_covariances_between_known_ones_are_within_the_stated_error():
    """Of the gusts on the modes, by frequencies at which they are computed directly."""
    case = case_of(INCLINED)
    gusts = case.in_cable_wind.analyses[0].response.in_wind.gusts
    frequency = np.geomspace(1e-4, 20, 43)
    direct = gusts._computed_covariance(gusts.coherence.kappa(frequency))
    weights = np.random.default_rng(3).normal(size=direct.shape[1])
    wind, columns = gusts.wind, np.tile(weights[:, None] + 0j, (len(frequency), 1, 1))
    speed = speed_spectrum(frequency, wind.speed, 1.0, wind.length_scale, wind.spectrum)
    found = gusts.input_spectra(frequency, columns)[:, 0]
    assert found == pytest.approx(speed * (weights @ direct @ weights), rel=gusts.error)
    assert case_of(INCLINED, SMOOTH).in_cable_wind.analyses[0].response.in_wind.gusts.error == 0


def test_coherence_length():
    wind = SimpleNamespace(speed=6.0, length_scale=25.0, coherence_length=None)
    frequency, distance = np.array([0.0, 0.1, 3.0]), 7.0
    coherence = np.exp(-along_cable(wind).kappa(frequency) * distance)
    exact = np.exp(-12 * np.hypot(frequency * distance / 6.0, 0.12 * distance / 25.0))  # IEC 61400-1, typed in
    assert coherence == pytest.approx(exact, rel=1e-12)
    wind.coherence_length = 10.0
    assert along_cable(wind).kappa(frequency) == pytest.approx(0.1)


# drag


def drag(tangent, wind):
    """|u_n| u_n / 2."""
    normal = wind - tangent * (tangent @ wind)
    return np.linalg.norm(normal) * normal / 2


@pytest.mark.parametrize("blowing", [(0, 1, 0), (1, 0, 0), (0.6, 0.8, 0)])
@pytest.mark.parametrize("tangent", [(1, 0, 0), (0, 0, 1), (0.8, 0, 0.6), (0.36, 0.48, 0.8)])
def test_the_linear_drag_is_the_derivative_of_the_drag(blowing, tangent):
    tangent, blowing = np.array(tangent, dtype=float), np.array(blowing, dtype=float)
    found = drag_matrices(tangent, blowing)
    step = 1e-6
    for axis in np.eye(3):
        derivative = (drag(tangent, blowing + step * axis) - drag(tangent, blowing - step * axis)) / (2 * step)
        assert found @ axis == pytest.approx(derivative, abs=1e-6)


def test_wind_across_and_along_bound_any_other_on_a_straight_cable():
    """In between the spectrum is linear in the square of the sine."""
    case = case_of(INCLINED, "gravity=1e-3", "winch.controller.gain=0")
    frequency = np.array([0.01, 0.5, 2.0])
    along, across = (spectrum_of(case, frequency, direction) for direction in ("along", "across"))
    for angle, digits in ((0, 1e-12), (20, 1e-3), (45, 1e-3), (70, 1e-3), (90, 1e-12)):
        turned = np.radians(angle)
        direction = np.array([np.cos(turned), np.sin(turned), 0.0])
        found = spectrum_in(one_cable_system.analysis_in_wind(case, direction, f"{angle} deg"), frequency)
        assert found == pytest.approx(np.cos(turned) ** 2 * along + np.sin(turned) ** 2 * across, rel=digits)


# the whole way, by dense matrices


def dense(case, frequency, direction, carried=()):
    """Spectrum of the gondola's place without control by the wind on the cable, by `CableOfBars`: shape (f,).

    Ends held but for x of end 2.
    """
    cable = CableOfBars(case, direction, carried)
    cable.mass[-3, -3] += case.scene.gondola.mass
    if case.scene.wind.aerodynamic_damping:  # half of rho C_d d v on all of the cable
        cable.damping += 1.2 * 1.2 * case.scene.cable.section_diameter * 6.0 / 2 / float(case.span.mass) * cable.bare
        cable.damping[-3, -3] += 1.2 * 1.17 * 0.6 * 6.0
    free = np.arange(3, 3 * cable.nodes - 2)

    def shown(dynamic):
        row = np.zeros(3 * cable.nodes, dtype=complex)  # of the inverse, that of the gondola
        row[free] = np.linalg.solve(dynamic[np.ix_(free, free)].T, np.eye(len(free))[-1])
        return row @ cable.drags

    return cable.spectra(frequency, shown)[0]


SMOOTH = "wind.coherence_length=60 m"


def spectrum_of(case, frequency, direction):
    """What `dense` gives, by the program."""
    (found,) = (side for side in case.in_cable_wind.analyses if side.airflow.direction_name == direction)
    return spectrum_in(found, frequency)


def spectrum_in(wind, frequency):
    """Spectrum of the gondola's place without control, in an `DynamicAnalysis`."""
    response = wind.response_of(open_loop=True)
    return response.spectra(frequency)[response.names.index("gondola.x")]


@pytest.mark.crossed
@pytest.mark.parametrize("direction", ["across", "along"])
@pytest.mark.parametrize("damping", [None, HYSTERETIC, VISCOUS])
@pytest.mark.parametrize("form", [None, INCLINED, VERTICAL, SAGGING, ASIDE])
def test_the_spectrum_is_that_of_the_dense_matrices(direction, damping, form):
    case = case_of("winch.controller.gain=0", SMOOTH, *filter(None, (damping, form)))
    main = case.gondola_mode.frequency[0]
    frequency = np.array([0.01, 0.5 * main, 1.01 * main, 1.6, 3.18, 4.76, 9.0, 20.0])
    if form != VERTICAL:  # a pendulum strains nothing, and damped strain leaves its resonance without bound
        frequency = np.append(frequency, main)
    # two points to a bar see the corner of exp(-r/l) with an error (h/l)^2/6 of the sum: half a percent here
    expected = dense(case, frequency, direction)
    assert spectrum_of(case, frequency, direction) == pytest.approx(expected, rel=0.02)


@pytest.mark.crossed
@pytest.mark.parametrize("form", [None, INCLINED])
@pytest.mark.parametrize("more", [(), (AIR,), (AIR, VISCOUS), (AIR, HYSTERETIC)])
def test_whole_coherence_is_the_dense_matrices_to_rounding(form, more):
    case = case_of("winch.controller.gain=0", "wind.coherence_length=1e12 m", *more, *filter(None, (form,)))
    frequency = np.array([0.01, 0.3, 0.7, 1.6, 3.18, 9.0])
    expected = dense(case, frequency, "across")
    assert spectrum_of(case, frequency, "across") == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("sets", [(), (HYSTERETIC,), (INCLINED,)])
def test_the_rms_is_that_of_the_dense_matrices_over_many_frequencies(sets):
    case = case_of("winch.controller.gain=0", SMOOTH, "model.elements=16", *sets)
    grid = [np.geomspace(1e-5, 60, 400)]
    for pole in case.analysis.closed_loop.open_poles:
        c, w = abs(pole) / (2 * np.pi), abs(pole.real) / (2 * np.pi)
        if c < 5:
            grid.append(c + w * np.sinh(np.linspace(-np.arcsinh(0.2 * c / w), np.arcsinh(0.2 * c / w), 201)))
    frequency = np.unique(np.concatenate(grid))
    spectra = (dense(case, frequency, direction) for direction in ("across", "along"))
    largest = max(trapezoid(spectrum * frequency, np.log(frequency)) for spectrum in spectra)
    assert case.in_cable_wind.rms(["gondola.x"], "value", open_loop=True)[0] == pytest.approx(
        np.sqrt(largest), rel=0.02
    )


# what follows from linearity, and what converges


def test_the_force_is_proportional_to_drag_and_turbulence():
    names = ("gondola_rms_cable_wind", "gondola_rms_velocity_open_loop_cable_wind")
    plain = cells(scene(), *names)
    for sets, factor in (("wind.cable_drag_coefficient=2.4", 2), ("wind.turbulence_intensity=0.3", 2),
                         ("wind.air_density=0.6", 0.5)):  # fmt: skip
        changed = cells(scene(sets), *names)
        for name in names:
            assert changed[name] == pytest.approx(factor * plain[name], rel=2e-6)


def test_short_coherence_makes_the_variance_proportional_to_it():
    numbers = [cells(scene(f"wind.coherence_length={length}"), "gondola_rms_cable_wind")["gondola_rms_cable_wind"]
               for length in ("1 mm", "4 mm")]  # fmt: skip
    assert numbers[1] / numbers[0] == pytest.approx(2, rel=1e-3)


def test_gondola_and_cable_together():
    row = cells(scene(), *(f"gondola_rms{part}{name}" for part in ("", "_velocity", "_open_loop")
                           for name in ("", "_cable_wind", "_all_wind")))  # fmt: skip
    for part in ("", "_velocity", "_open_loop"):
        one, other, both = (row[f"gondola_rms{part}{name}"] for name in ("", "_cable_wind", "_all_wind"))
        assert both**2 == pytest.approx(one**2 + other**2, rel=1e-12)


def test_a_straight_weightless_cable_passes_nothing_on():
    assert cells(scene("gravity=0"), "gondola_rms_cable_wind") == {"gondola_rms_cable_wind": 0.0}
    assert table_of("windrms", CARLINA, "--on", "both", "--set", "gravity=0", "--quiet")[0]["gondola_rms_mm"] > 0


def test_accuracy_and_bars_agree():
    names = ("gondola_rms_cable_wind", "gondola_rms_open_loop_cable_wind")
    accurate = cells(scene(HYSTERETIC, SLOW_LOOP, "model.accuracy=1e-3"), *names)
    bars = [cells(scene(HYSTERETIC, SLOW_LOOP, f"model.elements={n}"), *names) for n in (40, 80)]
    for name in names:
        assert bars[1][name] == pytest.approx(accurate[name], rel=5e-3)
        assert abs(bars[1][name] - accurate[name]) < 0.5 * abs(bars[0][name] - accurate[name])


# the command


def test_what_the_wind_acts_on():
    both, cable, gondola = (
        table_of("windrms", CARLINA, "--quiet", "--on", on)[0] for on in ("both", "cable", "gondola")
    )
    assert both["gondola_rms_mm"] == gondola["gondola_rms_mm"]
    assert both["gondola_rms_cable_wind_mm"] == cable["gondola_rms_cable_wind_mm"]
    # the paper's sentence: the wind on the gondola dominates
    assert both["gondola_rms_cable_wind_mm"] < 0.01 * both["gondola_rms_mm"]
    assert "gondola_rms_mm" not in cable
    assert not [name for name in gondola if "cable_wind" in name or "all_wind" in name]
    bare = table_of("windrms", CARLINA, "--quiet", "--on", "cable", "--set", "gondola={mass: 50}")[0]
    assert bare["gondola_rms_cable_wind_mm"] == pytest.approx(cable["gondola_rms_cable_wind_mm"], rel=1e-9)
    outcome = run("windrms", CARLINA, "--on", "both", "--set", "gondola={mass: 50}", code=2)
    assert "gondola.area" in outcome.err
    assert "wind on the cable" in run("windrms", CARLINA, "--on", "cable", "--explain").err


@pytest.mark.crossed
@pytest.mark.parametrize("sets", [(), ("winch.controller.gain=0", "wind.admittance=none")], ids=["loop", "at rest"])
@pytest.mark.parametrize("on", ["gondola", "cable", "both"])
def test_a_picture_has_the_variance_that_is_printed(on, sets):
    case = CableCase(scene(*sets))
    winds = (one_cable_system.analyses_of_winds(case, on, open_loop) for open_loop in (False, True))
    _, gondola, share = plots.wind_response(*winds, on).axes
    curves = {line.get_label(): line.get_xydata().T for line in gondola.lines}
    part = {"gondola": "", "cable": "_cable_wind", "both": "_all_wind"}[on]
    shown = {"winch at rest": f"gondola_rms_open_loop{part}"}
    if not sets:
        shown["winch loop closed"] = f"gondola_rms{part}"
    printed = cells(case.scene, *shown.values())
    assert list(curves) == [*shown, *["by the wind on the cable"] * (on == "both")]
    if on == "both":  # the legend stands above the panel and covers no curve
        gondola.figure.draw_without_rendering()
        assert gondola.get_legend().get_window_extent().y0 > gondola.get_window_extent().y0 + 0.9 * gondola.bbox.height
    for line, (label, name) in zip(share.lines, shown.items(), strict=True):
        frequency, spectrum = curves[label]  # [mm^2/Hz], from 1e-3 to 1e2 Hz
        below = 1e-3 * spectrum[0]  # flat at low frequencies
        assert np.sqrt(trapezoid(spectrum, frequency) + below) == pytest.approx(printed[name], rel=2e-3)
        assert line.get_label() == f"{label}: {printed[name]:.4g} mm RMS"


def test_a_picture_of_wind_that_moves_nothing_is_refused_beside_the_numbers(tmp_path):
    picture = tmp_path / "x.svg"
    command = "windrms", CARLINA, "--set", "gravity=0", "--on", "cable"
    outcome = run(*command, "--plot", picture, code=3)
    assert "there is nothing to draw" in outcome.err
    assert not list(tmp_path.iterdir())
    assert outcome.out == run(*command).out


def test_a_page_leaves_out_a_picture_of_wind_that_moves_nothing(folder):
    scene_of(
        "cable: {material: steel, diameter: 4 mm}\n"
        "cables: {only: {from: [0, 0, 0], to: [50 m, 0, 0], sag: 1 m}}\n"
        "wind: {speed: 5 m/s, turbulence_intensity: 0.2, length_scale: 10 m}\n"
    )
    assert "written" in run("report", "s.yaml", "--out", "span.html").err
    page = (folder / "span.html").read_text(encoding="utf-8")
    assert "Left out: nothing is free to move: there is nothing to draw" in page
    assert "No answer" not in page


# vortices


def test_shedding_frequencies():
    """Strouhal number 0.2; they need no model: a cable that would break has them too."""
    for turbulence, expected in ((0.9, (330.0, 600.0, 870.0)), (3.0, (0.0, 600.0, 1500.0))):
        wind = SimpleNamespace(speed=6.0, turbulence=turbulence)
        assert shedding_frequencies(wind, 0.002) == pytest.approx(expected)
    names = ("shedding_frequency", "shedding_frequency_low", "shedding_frequency_high")
    diameter = np.sqrt(4 * 2.69e-6 / np.pi)
    for sets in ((), ("cable.strength=1 Pa",)):
        row = cells(scene(*sets), *names)
        assert list(row.values()) == pytest.approx([0.2 * v / diameter for v in (6.0, 3.3, 8.7)], rel=1e-12)


@pytest.mark.parametrize(("diameter", "speed", "frequency"), [(5.55, 3, 100), (1.85, 6, 600)])
def test_the_paper_s_hundred_to_six_hundred_hertz(diameter, speed, frequency):
    """Its winds, 3 m/s (Fig. 6) and 6 m/s (Tables), on its thin cable and on that of Table 6."""
    found = cells(scene(f"cable.diameter={diameter} mm", f"wind.speed={speed}"), "shedding_frequency")
    assert round(found["shedding_frequency"], -2) == frequency


@pytest.mark.parametrize("sets", [(), (INCLINED,), (SAGGING,), ("cable.diameter=7.4 mm",)])
def test_the_estimated_count_of_modes_is_the_computed_one(sets, monkeypatch):
    case = case_of(*sets)
    time = wind_report.transverse_travel_time(case)
    between = 20.4 / (2 * time), 60.4 / (2 * time)
    estimate, spacing = wind_report.modes_between(case, *between)
    assert spacing == pytest.approx(1 / (2 * time))
    monkeypatch.setattr(type(STUDY), "counted_modes", 1000)
    counted, none = wind_report.modes_between(case, *between)
    assert (estimate, none) == (80, None)
    assert abs(counted - estimate) <= 2


def test_travel_time_of_a_taut_cable():
    case = case_of("gravity=0")
    tension = case.statics.mean_tension
    # c over the stretched chord, with the mass that a stretched metre has
    speed = np.sqrt(tension / (1440 * 2.69e-6 * 184.4883 / 185.8))
    assert wind_report.transverse_travel_time(case) == pytest.approx(185.8 / speed, rel=1e-6)


@pytest.mark.parametrize(
    ("sets", "note"),
    [
        ((), "note: the cable sheds vortices at 357 to 940 Hz, where it has about 73"),
        # modes at 3.18, 4.77, 6.36 Hz and no other, in each plane
        (("wind.speed=0.05 m/s",),
         "note: the cable sheds vortices at 2.97 to 7.83 Hz, where it has 6 modes across its axis"),
        (("wind.speed=0.01 m/s", "wind.turbulence_rms=1 mm/s"), ""),
    ],
)  # fmt: skip
def test_a_note_says_which_modes_the_vortices_meet(sets, note):
    options = with_sets(*sets)
    lines = [line for line in run("windrms", CARLINA, *options).lines if "vortices" in line]
    assert len(lines) == bool(note)
    assert all(line.startswith(note) for line in lines)
    assert run("windrms", CARLINA, *options, "--quiet").err == ""


# extremes

# a finite number, or one line that says why not; numpy's warnings are errors here

ENDS = ("low", "high")


def end_of(key, end):
    """Option for the smallest or the largest value that a key may have."""
    return f"{key}={getattr(quantity_of(key), end)}"


KEYS = ["wind.speed", "wind.length_scale", "wind.air_density", "gondola.area"]
OTHERS = ["wind.turbulence_rms", "wind.coherence_length", "wind.cable_drag_coefficient"]
EXTREMES = [
    *([end_of(key, end)] for key in KEYS[:3] + OTHERS for end in ENDS),
    *([end_of(*one) for one in zip(KEYS, ends, strict=True)] for ends in product(ENDS, repeat=4)),
    *([f"wind.spectrum={spectrum}", f"wind.admittance={admittance}", end_of("gondola.area", end)]
      for spectrum in ("von_karman", "von_karman_exact", "davenport", "kaimal")
      for admittance in ("vickery", "vickery_squared", "none") for end in ENDS),
]  # fmt: skip


@pytest.mark.parametrize("sets", campaign(EXTREMES, EXTREMES[::5]), ids=" ".join)
def test_extreme_winds_have_a_number_or_a_refusal(sets):
    options = ["--on", "both"] if len(sets) == 1 else []
    outcome = run("windrms", CARLINA, *options, *with_sets(*sets), "--format", "json", code=None)
    (row,) = rows_of(outcome.out, "json")
    assert outcome.code in (0, 3)
    if outcome.code:
        assert row["status"] in outcome.err
    else:
        assert all(0 <= row[name] < np.inf for name in row if name.startswith("gondola_rms"))


@pytest.mark.crossed
@pytest.mark.parametrize(
    "key", campaign(["wind.turbulence_rms", "gondola.area", "wind.speed"], ["gondola.area", "wind.speed"])
)
@pytest.mark.parametrize("end", ENDS)
def test_a_picture_of_an_extreme_wind_is_drawn_or_refused_in_a_line(key, end, tmp_path):
    outcome = run("windrms", CARLINA, "--set", end_of(key, end), "--plot", tmp_path / "x.svg", "--quiet", code=None)
    pictures = [path.read_bytes()[:5] for path in tmp_path.iterdir()]
    assert (outcome.code, len(outcome.lines), pictures) in ((0, 0, [b"<?xml"]), (3, 1, []))


def test_balanced_extremes_are_scaled_and_not_lost():
    plain = cells(scene("wind.admittance=none"), "gondola_rms")["gondola_rms"]
    found = cells(scene("wind.admittance=none", "wind.air_density=1.2e5", "gondola.area=0.6e-5"), "gondola_rms")
    assert found["gondola_rms"] == pytest.approx(plain, rel=1e-9)
