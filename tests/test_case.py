"""A case computes what is asked for, once."""

from collections import Counter

import pytest
from command import SLACK
from scenes import CHORD, LENGTH, scene

from cablestudy.errors import NoSolutionError
from cablestudy.study.columns import find
from cablestudy.study.one_cable import models, results
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.results import Results
from cablestudy.study.scene_values import SceneValues


def test_the_span_of_a_scene():
    span = CableCase(scene()).span
    assert (span.chord, float(span.cosine), float(span.sine)) == (CHORD, 1.0, 0.0)
    assert span.unstretched_length == pytest.approx(LENGTH, rel=1e-15)
    upright = CableCase(scene("cable.chord=10", "cable.inclination=-90 deg", "cable.preload=1 kN")).span
    assert (float(upright.cosine), float(upright.sine)) == (0.0, -1.0)
    turned = CableCase(scene("cable.ends=[[1, 2, 3], [1, 102, 3]]", "cable.preload=1 kN")).span
    assert turned.level == pytest.approx([0, 1, 0])
    assert turned.chord == 100


@pytest.mark.parametrize(("wanted", "column"), [("cable.preload=500 N", "mean_tension"), ("cable.sag=2 m", "sag")])
@pytest.mark.parametrize("model", ["model=null", "model.elements=40"])
def test_a_wanted_tension_or_sag_is_had(wanted, column, model):
    number = float(wanted.partition("=")[2].split()[0])
    found = getattr(CableCase(scene(wanted, model)).statics, column)
    # solved for the continuous cable; 40 bars are 1e-4 beside it
    assert found == pytest.approx(number, rel=1e-10 if model == "model=null" else 2e-4)


def test_loads_beyond_the_end_are_refused_once_the_length_is_known():
    load = "cable.loads=[{at: 185 m, force: [0, 0, -1]}]"
    with pytest.raises(NoSolutionError, match="ends before its last load, at 185 m"):
        _ = CableCase(scene("cable.preload=10 kN", load, "cable.reference.loads=true")).span
    with pytest.raises(NoSolutionError, match="the load at 185 m is beyond the cable's end, at 176"):
        _ = CableCase(scene("cable.preload=10 kN", load)).span


def test_results_are_computed_once(monkeypatch):
    counts = Counter()

    def counted(module, name):
        function = getattr(module, name)

        def call(*arguments, **options):
            counts[name] += 1
            return function(*arguments, **options)

        monkeypatch.setattr(module, name, call)

    counted(results, "solve")
    counted(models, "Dynamics")
    case = CableCase(scene())
    for _ in range(3):
        _ = case.statics.sag, case.end_stiffness_along(0), case.frequency(1, "in-plane"), case.frequency(2, "axial")
        _ = case.gondola_mode.frequency[0], find("gondola_frequency_static").compute(case)
    assert counts == {"solve": 1, "Dynamics": 1}


def test_a_case_without_an_equilibrium_says_why_and_leaves_the_others():
    cables = ("cable.preload=1 kN", "cable.preload=1 N", "cable.preload=2 kN")
    found = Results(SceneValues([scene(cable, "model=null") for cable in cables]))
    assert found.statics.mean_tension[[0, 2]] == pytest.approx([1000, 2000], rel=1e-12)
    assert list(found.failures) == [1]
    with pytest.raises(NoSolutionError, match="below the least that this cable can have"):
        found.check(1)


def test_a_hundred_thousand_bars_are_static_in_a_moment():
    fine, exact = CableCase(scene("model.elements=100000", base=SLACK)), CableCase(scene(base=SLACK))
    assert fine.statics.mean_tension == pytest.approx(exact.statics.mean_tension, rel=1e-9)
    assert fine.statics.sag == pytest.approx(exact.statics.sag, rel=1e-9)
