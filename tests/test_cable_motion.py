"""A cable with fixed ends in the wind: dense matrices, closed forms of the taut string, statics of its neighbours."""

from functools import cache

import numpy as np
import pytest
from command import CONFIGS, refusal, rows_of, run, study_file, table_of
from references.cable_of_bars_in_wind import CableOfBars
from scenes import cells, scene
from scipy.integrate import quad
from solved import rows_as_alone, solve
from test_wind_cable import ASIDE, HYSTERETIC, INCLINED, SAGGING, VERTICAL

from cablestudy import plots
from cablestudy.errors import NoSolutionError
from cablestudy.scene.scene import load_scene
from cablestudy.study.columns import find
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.system import analyses_of_winds

TEXT = """
cable:
  ends: [[0, 0, 0], [185.8 m, 0, 0]]
  elastic_modulus: 70.3 GPa
  density: 1440 kg/m^3
  area: 2.69 mm^2
  unstretched_length: 184.4883 m
  damping: {model: modal, ratio: 0.01}
wind: {speed: 6 m/s, turbulence_intensity: 0.15, length_scale: 25 m, spectrum: von_karman_exact}
model: {elements: 40}
"""
DRAG, SIGMA = 1.2 * 1.2 * np.sqrt(4 * 2.69e-6 / np.pi) * 6.0, 0.9  # rho C_d d v [N s/m^2], RMS of the speed [m/s]
WHOLE, SLOW = "wind.coherence_length=1e12 m", "wind.length_scale=1e6 m"
ACCURATE = "model={accuracy: 1e-6}"
VISCOUS = "cable.damping={model: kelvin_voigt, time: 4.4 ms, viscous: 1e-3}"


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    path = tmp_path_factory.mktemp("bare") / "bare.yaml"
    path.write_text(TEXT)
    return str(path)


@cache
def loaded(path, *sets):
    return load_scene(path, sets)[1]


def motion(path, *sets):
    row = cells(loaded(path, *sets), "midspan_rms", "tension_rms")
    return row["midspan_rms"] / 1e3, row["tension_rms"]


# dense matrices


def dense(case, frequency, direction, carried=()):
    """Spectra of mid-span along the chord frame and of the tensions at both ends, by `CableOfBars`: shape (5, f)."""
    cable = CableOfBars(case, direction, carried)
    if case.scene.wind.aerodynamic_damping:
        cable.damping += cable.air
    ends = case.continuous.at(np.array([0.0, 1.0]))[1]
    ends = ends @ case.span.frame / np.linalg.norm(ends, axis=1)[:, None]
    pulls, inner = np.zeros((2, 3 * cable.nodes)), np.s_[3:-3]
    pulls[0, :3], pulls[1, -3:] = ends
    at, nodes = float(case.results.catenary.middle[case.index]), case.state.mesh.node_positions
    middle = np.kron([np.interp(at, nodes, one) for one in np.eye(cable.nodes)], case.span.frame)

    def shown(dynamic):
        moved = np.zeros(cable.drags.shape, dtype=complex)
        moved[inner] = np.linalg.solve(dynamic[inner, inner], cable.drags[inner])
        # the cable pulls the ends with what the drag leaves there and what holds them back
        return np.concatenate([middle @ moved, pulls @ (cable.drags - dynamic @ moved)])

    return cable.spectra(frequency, shown)


def spectra_of(case, frequency, direction):
    """What `dense` gives, by the program."""
    return wind_of(case, direction).response_of(open_loop=True).spectra(frequency)


def wind_of(case, direction):
    """The `DynamicAnalysis` across or along the plane of the cable of a case."""
    return case.in_cable_wind.analyses[("across", "along").index(direction)]


@pytest.mark.crossed
@pytest.mark.parametrize("direction", ["across", "along"])
@pytest.mark.parametrize("damping", [None, HYSTERETIC, VISCOUS, "wind.aerodynamic_damping=false"])
@pytest.mark.parametrize("form", [None, INCLINED, VERTICAL, SAGGING, ASIDE])
def test_spectra_are_those_of_the_dense_matrices(bare, form, damping, direction):
    case = CableCase(loaded(bare, WHOLE, *filter(None, (form, damping))))
    frequency = np.array([0.01, 0.3, 1.0, 1.58, 3.2, 9.0])
    expected = dense(case, frequency, direction)
    # drag of less than 1e-9 of the largest is left out, and a floor of as much added
    most = np.repeat([expected[:3].max(), (DRAG * SIGMA * 185.8) ** 2], [3, 2])[:, None]
    error = np.abs(spectra_of(case, frequency, direction) - expected)
    np.testing.assert_array_less(error, 2e-7 * expected + 1e-15 * most)


@pytest.mark.parametrize("form", [None, INCLINED, SAGGING])
def test_spectra_under_partial_coherence(bare, form):
    case = CableCase(loaded(bare, "wind.coherence_length=60 m", *filter(None, (form,))))
    frequency = np.array([0.01, 0.3, 1.0, 1.58, 3.2, 4.7])
    expected = dense(case, frequency, "across")
    # two points to a bar see the corner of exp(-r/l) with an error (h/l)^2/6 of the sum
    assert spectra_of(case, frequency, "across") == pytest.approx(expected, rel=0.02, abs=1e-9 * expected.max())


# closed forms


def test_a_slow_wind_moves_a_taut_string_as_a_steady_one(bare):
    # of uniform load q: q L^2/(8 T) at the middle, and the tension does not change
    sets = ("gravity=0", WHOLE, SLOW, ACCURATE)
    row = cells(loaded(bare, *sets), "midspan_rms", "tension_rms", "preload", "stretched_length")
    expected = DRAG * SIGMA * row["stretched_length"] ** 2 / (8 * row["preload"])
    assert row["midspan_rms"] / 1e3 == pytest.approx(expected, rel=2e-4)
    assert row["tension_rms"] == 0.0


def test_one_mode_of_a_taut_string_in_a_fast_wind(bare):
    """Modes of a string, typed in; the drag across the wind is uniform, so that no two modes are joined."""
    row = cells(loaded(bare, "gravity=0"), "preload", "stretched_length", "unstretched_length")
    T, L, mass = row["preload"], row["stretched_length"], 1440 * 2.69e-6 * row["unstretched_length"]
    odd = np.arange(1, 200, 2)
    omega = odd * np.pi * np.sqrt(T / (mass * L))
    # q'' + (2 zeta W + c/m) q' + W^2 q = (phi, drag); phi = sqrt(2/M) sin(k pi s/L)
    load, middle = np.sqrt(2 / mass) * 2 * L / (odd * np.pi), np.sqrt(2 / mass) * np.sin(odd * np.pi / 2)

    def spectrum(f):
        s = 2j * np.pi * f
        moved = (middle * load / (s**2 + (0.02 * omega + DRAG * L / mass) * s + omega**2)).sum()
        turbulence = SIGMA**2 * 4 * 25 / 6 / (1 + 70.78012763381717 * (f * 25 / 6) ** 2) ** (5 / 6)
        return abs(moved * DRAG) ** 2 * turbulence

    marks = [0.1, 1.0, 1.5, 1.59, 1.7, 2.5, 4.5, 4.77, 5.0, 8.0, 20.0]
    variance = sum(quad(spectrum, a, b, limit=200)[0] for a, b in zip([0, *marks], [*marks, 200.0], strict=True))
    found, _ = motion(bare, "gravity=0", WHOLE, ACCURATE)
    assert found == pytest.approx(np.sqrt(variance), rel=1e-4)


def test_a_slow_wind_changes_the_tension_as_statics_do(bare):
    """Wind across: vertical turbulence is a load of half rho C_d d v u', of which what is normal counts."""
    row = cells(loaded(bare, ACCURATE), "preload", "stretched_length", "unstretched_length")
    count, step = 40, 1e-3
    place = (np.arange(count) + 0.5) / count
    slope = 1440 * 2.69e-6 * 9.81 * row["unstretched_length"] * (place - 0.5) / row["preload"]
    normal = np.array([-slope, np.zeros(count), np.ones(count)]).T / (1 + slope**2)[:, None]
    tension = []
    for sign in (-1, 1):
        force = sign * step / count * normal
        loads = ", ".join(
            f"{{at: {s}, force: {list(map(float, one))}}}"
            for s, one in zip(place * row["unstretched_length"], force, strict=True)
        )
        tension.append(cells(loaded(bare, ACCURATE, f"cable.loads=[{loads}]"), "max_tension")["max_tension"])
    rate = abs(tension[1] - tension[0]) / (2 * step)
    expected = rate * DRAG / 2 * SIGMA * row["stretched_length"]
    assert motion(bare, WHOLE, SLOW, ACCURATE)[1] == pytest.approx(expected, rel=1e-3)


def test_a_vertical_cable_moves_alike_in_any_wind(bare):
    case = CableCase(loaded(bare, VERTICAL))
    across, along = (wind_of(case, one).response.variances.weighted["value"] for one in ("across", "along"))
    assert across[[1, 2]] == pytest.approx(along[[2, 1]], rel=1e-6)
    assert across[2] > 0


# what it depends on


def test_proportional_to_turbulence_and_without_overflow(bare):
    expected = np.array(motion(bare))
    assert motion(bare, "wind.turbulence_rms=0.09 m/s") == pytest.approx(0.1 * expected, rel=1e-6)
    assert motion(bare, "wind.turbulence_intensity=1e-12") == pytest.approx(expected * 1e-12 / 0.15, rel=1e-6)


def test_an_undamped_cable_without_air_is_refused(bare):
    scene = loaded(bare, "cable.damping={model: modal, ratio: 0}", "wind.aerodynamic_damping=false")
    with pytest.raises(NoSolutionError, match=r"^undamped: mode 2 \(cable in-plane, 1\.59"):
        find("tension_rms").compute(CableCase(scene))


def test_a_cable_with_a_gondola_is_refused(tmp_path):
    study = study_file(tmp_path, "columns: [midspan_rms, tension_rms]\n")
    outcome = run("sweep", study, "--no-write", code=2)
    assert len(outcome.lines) == 2
    assert all("is of a cable with fixed ends: the scene must not have the key gondola" in one for one in outcome.lines)


# the command


def test_windrms_of_a_bare_cable(bare):
    coarse = "model={accuracy: 1e-2}"
    (row,) = table_of("windrms", bare, "--quiet", "--set", coarse)
    found = motion(bare, coarse)
    assert row["midspan_rms_mm"] == pytest.approx(1e3 * found[0], rel=1e-12)
    assert row["tension_rms_N"] == pytest.approx(found[1], rel=1e-12)
    as_csv = run("windrms", bare, "--quiet", "--on", "cable", "--format", "csv", "--set", coarse).out
    assert rows_of(as_csv, "csv") == [row]
    explained = run("windrms", bare, "--explain", "--set", coarse).err
    assert "aerodynamic damping: the drag of the cable damps its motion" in explained
    assert "the cable sheds vortices" in explained
    assert "gondola.mass: missing key" in refusal("windrms", bare, "--on", "gondola")


def test_the_picture_shows_mid_span_in_the_worse_wind(bare):
    case = CableCase(loaded(bare, SAGGING))
    figure = plots.wind_response(analyses_of_winds(case, "cable"), on="the cable")
    speed, spectra, below, above, side = figure.axes
    legend = [text.get_text() for text in spectra.get_legend().get_texts()]
    assert legend == ["along the chord", "in the cable's plane", "across it"]
    names = [f"cable.midspan.{axis}" for axis in "xyz"]
    total = case.in_cable_wind.analyses[0].rms(names, "value", open_loop=True)[0]
    told = below.get_legend().get_texts()[0].get_text().split(": ")[1].split()[0]
    assert float(told) == pytest.approx(1e3 * total, rel=1e-3)
    (ellipse,) = (line for line in above.lines if len(line.get_xdata()) > 9)
    across = wind_of(case, "across").rms(["cable.midspan.z"], "value", open_loop=True)[0]
    assert max(ellipse.get_ydata()) == pytest.approx(1e3 * across, rel=1e-3)  # the cable lies along x
    assert (speed.get_legend() is not None, side.get_xlabel()) == (True, "along the wind [mm]")


def test_a_row_without_wind_lacks_it_and_leaves_the_others(bare):
    windy, calm = loaded(bare, ACCURATE), loaded(bare, ACCURATE, "wind=null")
    rows = rows_as_alone([windy, calm], ["tension_rms"])
    assert rows[1].values["tension_rms"] is None
    assert "needs the key wind" in rows[1].status


def test_in_a_steady_wind_motion_is_about_the_form_in_drag_along_the_cable():
    """Truth: elements that follow the drag; in uniform drag it would be 1e-3 wrong."""
    names = "midspan_rms", "tension_rms"
    sets = "case=storm", "wind={speed: 20 m/s, turbulence_intensity: 0.15, length_scale: 80 m}"
    row = solve(scene(*sets, base=CONFIGS / "guy.yaml"), *names)
    true = cells(scene(*sets, "model={elements: 4, order: 8}", base=CONFIGS / "guy.yaml"), *names)
    assert row.status == "ok"
    for name in names:
        assert abs(row.values[name] / true[name] - 1) < row.errors[name] < 1e-4
