"""The gondola on its cable: limits, the continuous cable, and modes that were left out."""

import math

import numpy as np
import pytest
from campaign import campaign
from mpmath import mp
from references import bars
from scenes import CHORD, INCLINED, PAPER, SAGGING, cells, scene
from scipy.optimize import brentq

from cablestudy.cable import dynamics
from cablestudy.motion.body_mode import largest_share
from cablestudy.motion.tolerances import MOTION
from cablestudy.scene.scene import CableScene
from cablestudy.study.columns import find
from cablestudy.study.notes import gondola_notes
from cablestudy.study.one_cable import system as one_cable_system
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.rows import evaluate, evaluate_cases
from cablestudy.system.cables import Models
from cablestudy.system.mode_search import Search


def frequency_on(mass, stiffness):
    return math.sqrt(stiffness / mass) / (2 * math.pi)


def test_a_heavy_gondola_feels_the_static_stiffness_and_a_third_of_the_cable():
    for mass in (50.0, 5000.0, 5e8):
        found = cells(
            scene("model.accuracy=1e-8", f"gondola.mass={mass}"), "gondola_frequency", "end_stiffness", "mass"
        )
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
    found = {
        digits: cells(
            scene(*SLACK, "gondola.mass=6 kg", f"model.accuracy=1e-{digits}"), "gondola_frequency", "gondola_share"
        )
        for digits in range(3, 11)
    }
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
    monkeypatch.setattr(type(MOTION), "damped_pole_freedoms", 24)
    monkeypatch.setattr(one_cable_system, "coupled_modes", never)
    strained = scene("model={accuracy: 1e-6}", "cable.damping={model: hysteretic, loss_factor: 0.02}")
    row = evaluate(strained, [find("gondola_damping_ratio")])
    assert row.cells["gondola_damping_ratio"] is None
    assert row.cells["status"].startswith("gondola_damping_ratio: estimated error ")
    assert row.cells["status"].endswith("of which no mesh has more than 24")


def test_a_damping_ratio_does_not_depend_on_the_size_of_the_mesh_of_another_row(monkeypatch):
    """Of three rows one has more modes than are computed: all motion of its mesh takes their place, in it alone."""
    sets = "model={accuracy: 1e-6}", "cable.damping={model: hysteretic, loss_factor: 0.02}"
    scenes = [scene(*sets, f"gondola.mass={mass}") for mass in (50, 60, 70)]
    columns = [find("gondola_damping_ratio")]
    alone = [evaluate(one, columns).cells for one in scenes]
    monkeypatch.setattr(Models, "large", np.array([False, True, False]))
    together = [row.cells for row in evaluate_cases(scenes, columns)]
    assert together[::2] == alone[::2]
    assert together[1]["gondola_damping_ratio"] == pytest.approx(alone[1]["gondola_damping_ratio"], rel=1e-9)


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
    one = CableScene.model_validate(NARROW)
    frequency, stiffness = (evaluate(one, [find(name)]).cells for name in ("gondola_frequency", "end_stiffness"))
    # some 40 kg of cable under 35,000 t
    expected = frequency_on(NARROW["gondola"]["mass"], stiffness["end_stiffness_N_per_m"])
    assert frequency["gondola_frequency_Hz"] == pytest.approx(expected, rel=2e-6)
    assert counts == ([148] if estimate is None else [estimate, 600])
