"""The gondola on its cable: limits, bars in long arithmetic, modes left out; damping by the strain of the cable."""

import math

import numpy as np
import pytest
from campaign import campaign
from mpmath import mp
from random_scenes import expected, scene_data, scene_of, truth_of
from references import bars
from scenes import CHORD, GONDOLA, INCLINED, PAPER, SAGGING, Twin, cells, scene
from scipy.optimize import brentq
from solved import rows_as_alone, solve, solve_all
from test_ends import damped

from cablestudy.cable import dynamics
from cablestudy.motion.body_mode import largest_share
from cablestudy.study.notes import gondola_notes
from cablestudy.study.one_cable import system as one_cable_system
from cablestudy.study.one_cable.case import CableCase
from cablestudy.system.cables import Models
from cablestudy.system.mode_search import Search
from cablestudy.system.tolerances import SYSTEM


def frequency_on(mass, stiffness):
    return math.sqrt(stiffness / mass) / (2 * math.pi)


def test_a_heavy_gondola_feels_the_static_stiffness_and_a_third_of_the_cable():
    for mass in (50.0, 5000.0, 5e8):
        heavy = scene("model.accuracy=1e-8", f"gondola.mass={mass}")
        found = cells(heavy, "gondola_frequency", "end_stiffness", "mass")
        # Rayleigh: the static shape is a straight line along the taut cable, which moves a third of its mass
        expected = frequency_on(mass + found["mass"] / 3, found["end_stiffness"])
        assert found["gondola_frequency"] == pytest.approx(expected, rel=1e-4 * 50 / mass + 1e-9)


@pytest.mark.crossed
@pytest.mark.parametrize("mass", [1e-6, 1e-3, 1.0, 1e3, 1e9, 1e15])
@pytest.mark.parametrize("twin", [PAPER, INCLINED, SAGGING])
def test_extreme_gondolas_on_bars_in_long_arithmetic(twin, mass):
    """All modes of dense bars with the gondola on their end, free along x: the largest share, and its frequency."""
    stiffness, inertia = bars.matrices(twin.chain(6), *twin.bar)
    free = slice(3, -2)  # of the nodes inside, and x of end 2
    inertia[-3] += mass
    with mp.workdps(80):
        root = [mp.sqrt(value) for value in inertia[free].tolist()]
        matrix = mp.matrix(stiffness[free, free].tolist())
        count = len(root)
        compliance = (matrix**-1)[count - 1, count - 1]
        for row in range(count):
            for column in range(count):
                matrix[row, column] /= root[row] * root[column]
        value, shape = mp.eigsy(matrix)
        share = [(shape[count - 1, k] / root[-1]) ** 2 / value[k] / compliance for k in range(count)]
        best = max(range(count), key=lambda k: share[k])
        frequency, expected = float(mp.sqrt(value[best]) / (2 * mp.pi)), float(share[best])
    found = cells(twin.scene("model.elements=6", f"gondola.mass={mass!r}"), "gondola_frequency", "gondola_share")
    assert found["gondola_frequency"] == pytest.approx(frequency, rel=1e-9)
    assert found["gondola_share"] == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("elements", [40, 100, 400])
def test_more_bars_do_not_lose_the_modes_that_are_not_computed(elements):
    # above some size only some of the modes are computed: that must not show
    found = cells(SAGGING.scene(f"model.elements={elements}"), "gondola_frequency")["gondola_frequency"]
    exact = cells(SAGGING.scene("model.accuracy=1e-8"), "gondola_frequency")["gondola_frequency"]
    assert abs(found / exact - 1) < 12 / elements**2  # second order; 6 / n^2 at 40 bars


def test_moving_along_y_or_turned_around_the_vertical():
    # the gondola moves along x: across a cable along y it swings sideways on the tension
    across = cells(scene(f"cable.ends=[[0, 0, 0], [0, {CHORD}, 0]]"), "gondola_frequency_static", "preload")
    expected = frequency_on(50.0, across["preload"] / CHORD)
    assert across["gondola_frequency_static"] == pytest.approx(expected, rel=1e-3)
    here, there = (
        cells(scene(f"cable.ends=[[0, 0, 0], [{end}, 0, 0]]"), "gondola_frequency")["gondola_frequency"]
        for end in (CHORD, -CHORD)
    )
    assert here == pytest.approx(there, rel=1e-12)


SLACK = ("cable.ends=[[0, 0, 0], [60, 0, 10]]", "cable.unstretched_length=80 m", "cable.area=2.5 cm^2",
         "cable.strength=null")  # fmt: skip


def test_the_gondola_frequency_of_a_light_gondola_on_a_slack_cable_does_not_depend_on_the_accuracy():
    """A gondola of 6 kg on a cable of 29 kg: its mass is spread over many modes, its compliance is not."""
    sets, names = (*SLACK, "gondola.mass=6 kg"), ("gondola_frequency", "gondola_share")
    found = {digits: cells(scene(*sets, f"model.accuracy=1e-{digits}"), *names) for digits in range(3, 11)}
    for digits, row in found.items():
        assert row["gondola_frequency"] == pytest.approx(found[10]["gondola_frequency"], rel=10.0**-digits)
    assert found[3]["gondola_share"] == pytest.approx(found[10]["gondola_share"], rel=1e-3)


def test_modes_that_share_the_gondola_are_named():
    """Tuned to the first mode of its cable, a gondola moves as much in either of two modes."""

    def tuned(mass):
        return CableCase(scene(f"gondola.mass={mass!r}", "model.accuracy=1e-6"))

    def difference(mass):
        share = tuned(mass).gondola_mode.mode.shares
        return share[0] - share[1]

    case = tuned(brentq(difference, 9.9, 10.1, xtol=1e-10))
    frequency, share = case.gondola_mode.mode.modes.frequency, case.gondola_mode.mode.shares
    assert 1 - 1e-3 < share.sum() < 1  # of the lowest modes: those above share the rest
    assert share[:2] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert case.gondola_mode.mode.number == 0  # of two equal shares the lower one
    note, tie = gondola_notes(case)
    assert f"{frequency[0]:.4g} Hz has only {share[0]:.3g} of its static compliance" in note
    assert f"{frequency[1]:.4g} Hz ({share[1]:.3g})" in note
    assert tie == f"gondola: a tie, within the error the mode of {frequency[1]:.4g} Hz has as large a share"
    assert list(gondola_notes(CableCase(scene()))) == []  # a taut cable: one mode has nearly all


def test_of_two_equal_shares_the_lower_mode_is_the_gondola_s():
    assert largest_share(np.array([0.1, 0.4, 0.1, 0.4 * (1 + 1e-9)])) == 1
    assert largest_share(np.array([0.1, 0.4, 0.1, 0.4 * (1 + 1e-3)])) == 3


def test_a_mesh_with_all_the_unknowns_there_may_be_is_not_tried_again(monkeypatch):
    """Sharper modes would have a mesh with no more of them: they are not computed, and the reason is told."""

    def never(*_, **__):
        raise AssertionError

    monkeypatch.setattr(Models, "large", np.array([True]))
    monkeypatch.setattr(type(SYSTEM), "damped_pole_freedoms", 24)
    monkeypatch.setattr(one_cable_system, "coupled_modes", never)
    strained = scene("model={accuracy: 1e-6}", "cable.damping={model: hysteretic, loss_factor: 0.02}")
    row = solve(strained, "gondola_damping_ratio")
    assert row.values["gondola_damping_ratio"] is None
    assert row.status.startswith("gondola_damping_ratio: estimated error ")
    assert row.status.endswith("of which no mesh has more than 24")


def test_a_damping_ratio_does_not_depend_on_the_size_of_the_mesh_of_another_row(monkeypatch):
    """Of three rows one has more modes than are computed: all motion of its mesh takes their place, in it alone."""
    sets = "model={accuracy: 1e-6}", "cable.damping={model: hysteretic, loss_factor: 0.02}"
    scenes = [scene(*sets, f"gondola.mass={mass}") for mass in (50, 60, 70)]
    alone = rows_as_alone(scenes, ["gondola_damping_ratio"])
    monkeypatch.setattr(Models, "large", np.array([False, True, False]))
    together = solve_all(scenes, ["gondola_damping_ratio"])
    assert together[::2] == alone[::2]
    assert together[1].values == pytest.approx(alone[1].values, rel=1e-9)


# nearly vertical and slack, with a load: a narrow loop, whose mesh has 2,494 unknowns
NARROW = {
    "gravity": 9.739707481965484,
    "cable": {
        "chord": 54940.79473084152, "inclination": 1.5707953156646726, "unstretched_length": 55945.299649482826,
        "area": 0.00013369354535583002, "elastic_modulus": 390287295794.633, "density": 5.157553840189807,
        "loads": [{"at": 38017.20258524358, "force": [0.0, 0.0, -4136.043005267464]}],
    },
    "gondola": {"mass": 35504077.588596724},
}  # fmt: skip


@pytest.mark.parametrize("estimate", campaign([None, 10], [None]))
def test_of_a_large_mesh_the_modes_are_computed_that_the_gondola_needs(estimate, monkeypatch):
    """Of 600 modes that may be computed 73 are below the limit; where too few are expected, 600 are computed."""
    counts, lanczos = [], dynamics._lanczos

    def counted(system, count):
        counts.append(count)
        return lanczos(system, count)

    monkeypatch.setattr(dynamics, "_lanczos", counted)
    if estimate:
        monkeypatch.setattr(Search, "_modes_up_to", lambda *_: np.array([estimate]))
    frequency, stiffness = (solve(NARROW, name).values[name] for name in ("gondola_frequency", "end_stiffness"))
    # some 40 kg of cable under 35,000 t
    assert frequency == pytest.approx(frequency_on(NARROW["gondola"]["mass"], stiffness), rel=2e-6)
    assert counts == ([148] if estimate is None else [estimate, 600])


# damping ratio by the strain of the cable

LOADED = Twin(175.68, 60.49, 186.0, loads=((46.5, (3.0, 0.0, -20.0)), (93.0, (0.0, 0.0, 5.0))))
STEEP = Twin(0.5, 185.8, 184.6)
CABLES = {"taut": PAPER, "sagging": SAGGING, "inclined": INCLINED, "loaded": LOADED, "steep": STEEP}


def ratio_of(scene):
    """Damping ratio of the gondola. [-]"""
    return CableCase(scene).gondola_mode.damping_ratio[0]


@pytest.mark.parametrize("amount", [0.0, 1e-14, 1e-3, 0.5, 2.0])
def test_one_bar_is_a_spring_with_a_dashpot(amount):
    bar, mass = ("model.elements=1", "gravity=0"), GONDOLA + PAPER.mass * PAPER.length / 2
    omega = float(np.sqrt(PAPER.stiffness / PAPER.length / mass))
    assert 2 * np.pi * CableCase(PAPER.scene(*bar)).gondola_mode.frequency[0] == pytest.approx(omega, rel=1e-12)
    found = ratio_of(PAPER.scene(*bar, damped("hysteretic", amount)))
    assert found == pytest.approx(np.sin(np.arctan(amount) / 2), rel=1e-12)
    found = ratio_of(PAPER.scene(*bar, damped("kelvin_voigt", amount)))
    assert found == pytest.approx(min(1.0, amount * omega / 2), rel=1e-12)


@pytest.mark.crossed
@pytest.mark.parametrize("name", CABLES)
@pytest.mark.parametrize("law", ["hysteretic", "kelvin_voigt"])
@pytest.mark.parametrize("amount", [1e-9, 1e-3, 0.3])
def test_bars_with_a_mass_in_long_arithmetic(name, law, amount):
    """Each digit of a ratio of 1e-13 too: a steep cable, whose end hardly strains it along x."""
    twin = CABLES[name]
    omega = 2 * np.pi * CableCase(twin.scene("model.elements=4")).gondola_mode.frequency[0]
    amount = amount if law == "hysteretic" else amount / omega
    pole, chain = 1j * omega, twin.chain(4)
    for share in (0.2, 0.6, 1.0)[0 if amount * omega > 0.1 else 2 :]:
        rate = share * mp.mpf(amount)
        loss = (lambda s, rate=rate: rate * s) if law == "kelvin_voigt" else (lambda s, rate=rate: 1j * rate)
        pole = bars.damped_pole(chain, *twin.bar, GONDOLA, pole, loss)
    found = ratio_of(twin.scene("model.elements=4", damped(law, amount)))
    assert found == pytest.approx(float(-pole.real / abs(pole)), rel=1e-9)


# almost inextensible, steep, slack, with loads, hardly and heavily damped: rounding spoilt the modes of all of them
@pytest.mark.parametrize("seed", [110003, 110006, 110040, 110041, 120020, 500045, 500077, 500104, 500136, 1004558])
def test_random_scenes(seed):
    data = scene_data(seed)
    value, doubt = expected(truth_of(data, CableCase(scene_of(data, 1e-4)).span), data, "gondola_damping_ratio")
    row = solve(scene_of(data, 1e-8), "gondola_damping_ratio", "error_estimate")
    assert row.status == "ok"
    assert row.values["gondola_damping_ratio"] == pytest.approx(value, rel=1e-8 + 3 * doubt)


def test_a_mode_that_moves_across_its_cable_is_not_damped():
    for sets in (("cable.ends=[[0, 0, 0], [0, 0, 185.8]]",), ("cable.ends=[[0, 0, 0], [0, 185.8, 0]]",)):
        assert ratio_of(scene("cable.damping={model: hysteretic, loss_factor: 2}", *sets)) == 0.0


def test_a_mode_that_meets_its_conjugate_creeps():
    """Up to the damping at which the two meet it oscillates; beyond, one of both returns slowly. Taut: a spring's."""
    fine = "model.accuracy=1e-8"
    critical = 1 / (np.pi * CableCase(PAPER.scene(fine)).gondola_mode.frequency[0])
    below, above = (ratio_of(PAPER.scene(fine, damped("kelvin_voigt", share * critical))) for share in (0.99, 1.02))
    assert 0.98 < below < 1.0
    assert above == 1.0
