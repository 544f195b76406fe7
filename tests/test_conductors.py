"""Conductors that stretch for good, held against published sag-tension tables and an independent computation.

The tables are those of `test_sag_tension`: 700 ft (creep is a factor) and 1000 ft with 1.5 in of ice before (it is
not), here with initial and final sags [ft] and tensions [lbf] of every row, also beyond the knee. The independent
computation is two springs side by side that only pull, on a catenary, by scipy's brentq, in units of the curves.
"""

import itertools

import numpy as np
import pytest
from campaign import campaign
from command import CONFIGS, run, table_of, written
from numpy.polynomial import Polynomial
from scenes import mistakes_of, scene_of
from scipy.optimize import brentq, fsolve
from solved import solve
from test_sag_tension import FOOT, POUND, TABLE_700, TABLE_1000, WEIGHT

from cablestudy.cable.stress_strain import Condition, Curves
from cablestudy.statics import equilibria, rest
from cablestudy.study.one_cable.results import Results
from cablestudy.study.stated_numbers import StatedNumbers

pytestmark = pytest.mark.usefixtures("folder")

# Alcoa's curves of 26/7 ACSR, psi over the whole area by percent, as in the public code that materials.yaml names
OUTER = {"initial": [-1213, 44308.1, -14004.4, -37618, 30676], "creep": [-544.8, 21426.8, -18842.2, 5495, 0]}
CORE = {"initial": [-69.3, 38629, 3998.1, -45713, 27892], "creep": [47.1, 36211.3, 12201.4, -72392, 46338]}
DRAKE = {"outer": OUTER | {"final": 64000, "expansion": 12.8e-6}, "core": CORE | {"final": 37000, "expansion": 6.4e-6}}
# as the public files that materials.yaml names have them, in Pa, the curves at 75 degF
PASCALS = {
    "outer": {"initial": [-6087381.214138346, 4.053262338478644e8, -4.163543981382871e8, 4.521581832859811e7,
                          1.1515623631049797e8],
              "creep": [-2241485.5960090347, 1.7226344254262358e8, -2.521833322306553e8, 2.6225588316024497e8,
                        -9.839508133080569e7], "final": [4.722908745820328e8]},
    "core": {"initial": [-163405.74784809016, 2.796782453643521e8, -3.0368647973489366e7, -1.0707558076290466e8,
                         4.809782687714249e7],
             "creep": [959060.7394797191, 2.5048239560643068e8, 8.911473801420107e7, -4.6314842641129154e8,
                       3.048792727466118e8], "final": [2.728600198771379e8]},
}  # fmt: skip
PSI = 6894.757293168361
HAWK = {
    name: {curve: [number / PSI for number in numbers] for curve, numbers in part.items()}
    | {"final": part["final"][0] / PSI, "expansion": expansion, "measured_at": 75}
    for (name, part), expansion in zip(PASCALS.items(), (12.8e-6, 6.4e-6), strict=True)
}
# one part, an initial and a final modulus
STRAND = {"outer": {"initial": [0, 210000], "creep": [0, 210000], "final": 157e7 / PSI, "expansion": 12.5e-6 / 1.8}}
SPRINGS = {"acsr-drake": DRAKE, "acsr-hawk": HAWK, "guy-strand": STRAND}
AREA, MEASURED_AT, EVERYDAY = 0.7264, 70, 60  # [in^2], [degF]

LINE = """
cable:
  chord: {span} ft
  {conductor}
  mass_per_length: 1.094 lb/ft
  area: 0.7264 in^2
  diameter: 1.108 in
  tension: {{at: horizontal, value: {tension} lbf}}
  reference: {{temperature: 60 degF}}
gravity: 9.80665
"""


def line(span, tension, rows, conductor="material: acsr-drake"):
    """Text of the scene of a table: its rows are the load cases."""
    cases = [f"  c{place}: {{temperature: {temperature} degF, ice: {{weight: {weight - WEIGHT} lbf/ft}}}}\n"
             for place, (temperature, weight) in enumerate(rows)]  # fmt: skip
    return LINE.format(span=span, tension=tension, conductor=conductor) + "cases:\n" + "".join(cases)


def solved(text, state, *sets):
    """`Results` of all cases of a scene in a state of its conductor."""
    whole = scene_of(text, *(f"cable.state={state}",) * bool(state), *sets)
    return Results(StatedNumbers([whole.model_copy(update={"case": name}) for name in whole.cases]))


def halfway(results):
    """Tension halfway between the horizontal one and that at the supports, as printed. [lbf]"""
    return (results.statics.horizontal_tension + results.statics.max_tension) / 2 / POUND


# ------------------------------------------------------------------------------------------------ published tables


@pytest.mark.parametrize(
    ("span", "table", "states", "tension"),
    # everyday tension at 60 degF, initial: that of the row less half of the rise of the tension to the supports
    [(700, TABLE_700, ("final", "initial"), 6300 - WEIGHT * 10.65 / 2),
     (1000, TABLE_1000, ("after_load", "initial"), 4721 - WEIGHT * 29.09 / 2)],
)  # fmt: skip
def test_published_tables_hold_to_half_a_percent_beyond_the_knee_and_under_heavy_ice(span, table, states, tension):
    text = line(span, tension, table)
    for state, (sag, pull) in zip(states, ((0, 1), (2, 3)), strict=True):
        results = solved(text, state)
        printed = np.array(list(table.values()))
        np.testing.assert_allclose(results.statics.sag / FOOT, printed[:, sag], rtol=5e-3)
        np.testing.assert_allclose(halfway(results), printed[:, pull], rtol=5e-3)
    assert "outer slack" in solved(text, states[0]).state[-1]


def test_a_published_table_that_states_the_tension_under_ice_and_wind():
    """1000 ft, creep is no factor, and the largest tension, as printed beneath that of 700 ft; three rows are legible.

    issuhub.com/view/index/4960?pageIndex=191, its Table 14.5: degF, lbf/ft: final sag and tension, initial ones.
    """
    rows = {(0, 2.509): (25.98, 12116, 25.98, 12116), (32, 2.094): (26.30, 9990, 25.53, 10290),
            (-20, WEIGHT): (18.72, 7318, 17.25, None)}  # fmt: skip

    def too_much(tension):
        """Of the tension in the first row, the horizontal one of the everyday state given. [lbf]"""
        return halfway(solved(line(1000, tension, rows), "initial"))[0] - 12116

    text = line(1000, brentq(too_much, 5000, 8000, xtol=1e-2), rows)
    for place, state in enumerate(("after_load", "initial")):
        found = solved(text, state)
        for row, printed in enumerate(rows.values()):
            sag, pull = printed[2 * place :][:2]
            assert found.statics.sag[row] / FOOT == pytest.approx(sag, rel=3e-3)
            assert pull is None or halfway(found)[row] == pytest.approx(pull, rel=3e-3)


def test_a_published_stringing_chart_of_aluminium_alone():
    """477 kcmil, 19 wires, 200 ft, new: 1672 lb at 70 degF, 1090 lb and 2.05 ft at 100 degF.

    Caribbean Utilities Company, Distribution standards, sheet 12-1 (2015). The curves are those of another conductor of
    19 wires, stress over area, so that the tension at 100 degF follows to the accuracy of curves between makers, 3 %.
    """
    text = (
        "cable: {chord: 200 ft, material: aac-dahlia, state: initial, area: 0.3746 in^2, mass_per_length: 0.4477 lb/ft,"
        " preload: 1672 lbf, reference: {temperature: 70 degF}}\ngravity: 9.80665\n"
        "cases: {warm: {temperature: 100 degF}}\n"
    )
    results = solved(text, "initial")
    assert halfway(results)[0] == pytest.approx(1090, rel=0.03)
    assert results.statics.sag[0] / FOOT == pytest.approx(2.05, rel=0.03)


# ------------------------------------------------------------------------------------------ independent computation


def polynomial(coefficients, strain):
    """As far as curves are measured, 0.5 %, then along the tangent."""
    inside = min(max(strain, 0.0), 0.5)
    value = sum(factor * inside**power for power, factor in enumerate(coefficients))
    slope = sum(power * factor * inside ** (power - 1) for power, factor in enumerate(coefficients) if power)
    return value + slope * (strain - inside)


def spring(part, strain, left, curve="initial"):
    """Stress of one part [psi] at its own strain [%], never pushed; `left` is its permanent set [%]."""
    return max(min(polynomial(part[curve], strain), part["final"] * (strain - left)), 0.0)


def own_strain(part, strain, temperature):
    longer = 1 + part["expansion"] * (temperature - part.get("measured_at", MEASURED_AT))
    return 100 * ((1 + strain / 100) / longer - 1)


def tension_of(parts, strain, temperature, sets, curve="initial"):
    """Of both springs side by side. [lbf]"""
    found = [spring(part, own_strain(part, strain, temperature), left, curve)
             for part, left in zip(parts, sets, strict=True)]  # fmt: skip
    return AREA * sum(found)


def span_at(span, horizontal, weight):
    """Length [ft], mean tension over it [lbf] and sag [ft] of a catenary with a weight per stretched length."""
    c = horizontal / weight
    length = 2 * c * np.sinh(span / 2 / c)
    mean = horizontal * (span / 2 + c / 2 * np.sinh(span / c)) / length
    return length, mean, c * (np.cosh(span / 2 / c) - 1)


def slack(parts, temperature, sets, curve="initial"):
    """Largest strain without tension. [%]"""
    low, high = -0.5, 0.5
    for _ in range(60):
        middle = (low + high) / 2
        pulled = tension_of(parts, middle, temperature, sets, curve) > 0
        low, high = (low, middle) if pulled else (middle, high)
    return low


def per_stretched(parts, strain, ice=0.0, without=0.0):
    """Weight per stretched length: its own is per length of the new conductor, ice is per length `without` tension."""
    new = slack(parts, EVERYDAY, [-np.inf] * len(parts))
    return (WEIGHT * (1 + new / 100) + ice * (1 + without / 100)) / (1 + strain / 100)


def hangs(parts, span, weight, temperature, unstretched, sets, curve="initial"):
    """Strain [%] and sag [ft] at which springs and catenary have one length."""

    without = slack(parts, temperature, sets, curve)

    def at(horizontal):
        strain = 0.0
        for _ in range(4):  # the weight per stretched length follows the strain
            length, mean, sag = span_at(span, horizontal, per_stretched(parts, strain, weight - WEIGHT, without))
            strain = 100 * (length / unstretched - 1)
        return strain, mean, sag

    def gap(horizontal):
        strain, mean, _ = at(horizontal)
        return tension_of(parts, strain, temperature, sets, curve) - mean

    found = brentq(gap, 0.3 * weight * span, 31500, xtol=1e-10)
    return at(found)[0], at(found)[2]


def left_by(parts, strain, temperature, before, curve="initial"):
    """Permanent sets of all parts after a strain. [%]"""
    found = []
    for part, left in zip(parts, before, strict=True):
        own = own_strain(part, strain, temperature)
        stress = spring(part, own, -np.inf, curve)
        found.append(max(left, own - stress / part["final"]) if stress > 0 else left)
    return found


def by_hand(parts, span, tension, rows, state):
    """Sags of all rows in a state [ft], the conductor strung with a horizontal tension at 60 degF."""
    new, first = [-np.inf] * len(parts), 0.1
    for _ in range(8):
        length, mean, _ = span_at(span, tension, per_stretched(parts, first))
        first = brentq(lambda strain, mean=mean: tension_of(parts, strain, EVERYDAY, new) - mean, -0.2, 0.5, xtol=1e-15)
    unstretched, sets = length / (1 + first / 100), new
    if state in ("after_creep", "final"):
        crept = hangs(parts, span, WEIGHT, EVERYDAY, unstretched, sets, "creep")[0]
        sets = left_by(parts, crept, EVERYDAY, sets, "creep")
    if state in ("after_load", "final"):
        strains = {row: hangs(parts, span, row[1], row[0], unstretched, sets)[0] for row in rows}
        row = max(strains, key=lambda row: tension_of(parts, strains[row], row[0], sets))
        sets = left_by(parts, strains[row], row[0], sets)
    return [hangs(parts, span, weight, temperature, unstretched, sets)[1] for temperature, weight in rows]


@pytest.mark.crossed
@pytest.mark.parametrize("material", SPRINGS)
@pytest.mark.parametrize("state", ["initial", "after_load", "after_creep", "final"])
def test_springs_that_only_pull_give_the_same_sags(material, state):
    """Both take the curves at the mean tension, here over the stretched length and there over the unstretched one.

    All with the area and the weight of one conductor.
    """
    rows = list(TABLE_700)[::2]
    text = line(700, 6294.17, rows, f"material: {material}")
    expected = by_hand(list(SPRINGS[material].values()), 700, 6294.17, rows, state)
    np.testing.assert_allclose(solved(text, state).statics.sag / FOOT, expected, rtol=3e-5)


@pytest.mark.parametrize(("ice", "told"), [(8, ""), (10, " beyond its curve")])
def test_a_part_that_is_stretched_beyond_its_curve_is_told(ice, told):
    """That of the outer strands of acsr-26/7 is flat from 0.45 %: by ice, which leaves it so for the other cases."""
    text = line(700, 6300, {(60, WEIGHT): 0, (60, ice + WEIGHT): 0}, "material: acsr-26/7")
    initial, loaded = (solved(text, state).equivalent_cables.linear for state in ("initial", "after_load"))
    strain = own_strain({"expansion": 12.8e-6}, 100 * initial.strain[1], 60)
    assert (strain > 0.45) == bool(told)
    assert initial.labels.tolist() == ["initial", "initial" + (", outer" + told if told else "")]
    assert loaded.labels[0].startswith(f"after_load (c1{told})")


@pytest.mark.parametrize("strain", [1e-3, 2.5e-3, 4.5e-3])
def test_each_curve_goes_on_along_its_tangent_from_its_own_end(strain):
    """New or creeping: the initial curves are measured to 0.2 and 0.4 %, those after creep to 0.3 and 0.1 %."""
    initial = Polynomial([0, 5e6, -4e8, 9e9]), Polynomial([0, 3e6, 2e8, -7e9])  # tension by strain [N]
    creep = Polynomial([0, 2e6, 3e8, 4e10]), Polynomial([0, 1e6, 5e8, 1e10])
    ends = np.array([[2e-3, 4e-3], [3e-3, 1e-3]])
    coefficients = ([[*one.coef, 0.0] for one in both] for both in (initial, creep))
    curves = Curves(*map(np.array, coefficients), ends, np.array([9e6, 9e6]), np.zeros(2), np.array(290.0))
    for parts, own_ends, creeping in ((initial, ends[0], False), (creep, ends[1], True)):
        inside = np.minimum(strain, own_ends)
        slopes = [one.deriv()(place) for one, place in zip(parts, inside, strict=True)]
        values = [one(place) for one, place in zip(parts, inside, strict=True)] + slopes * (strain - inside)
        condition = Condition(curves, np.array(290.0), curves.unset, np.array(creeping))
        np.testing.assert_allclose(condition.parts(np.array(strain)), (values, slopes), rtol=1e-14)
        np.testing.assert_array_equal(condition.beyond(np.array(strain)), strain > own_ends)
        sets = condition.sets_after(np.array(strain))
        np.testing.assert_allclose(sets, strain - values / np.array([9e6, 9e6]), rtol=1e-14)


# ---------------------------------------------------------------------------------------------------- special cases

STRAIGHT = (
    "stress_strain: {{unit: Pa, measured_at: 60 degF, "
    "outer: {{initial: [0, {one}], final: {many}, expansion: 2e-5 1/K}}, "
    "core: {{initial: [0, {one}], final: {many}, expansion: 2e-5 1/K}}}}"
)


def test_straight_curves_are_the_linear_cable():
    """Parts alike, each with half of the modulus: in every state the linear cable, to rounding."""
    half = 3.5e10
    rows = list(TABLE_700)
    bent = line(700, 6000, rows, STRAIGHT.format(one=half / 100, many=half))
    linear = "elastic_modulus: 70 GPa\n  expansion: 2e-5 1/K"
    expected = solved(line(700, 6000, rows, linear), "").statics
    for state in ("initial", "after_load", "after_creep", "final"):
        found = solved(bent, state)
        np.testing.assert_allclose(found.statics.sag, expected.sag, rtol=2e-12)
        np.testing.assert_allclose(found.statics.max_tension, expected.max_tension, rtol=2e-12)
        assert found.model_error.max() < 1e-12


def test_a_material_with_curves_is_linear_without_a_state():
    linear = table_of("static", CONFIGS / "line.yaml", "--case", "all")
    named = table_of("static", CONFIGS / "line.yaml", "--case", "all", "--set", "cable.stress_strain=null")
    assert linear == named
    assert "state" not in linear[0]


def test_rows_do_not_depend_on_their_neighbours():
    text = line(700, 6294.17, list(TABLE_700)[::3])
    together = solved(text, "final")
    whole = scene_of(text, "cable.state=final")
    for place, name in enumerate(whole.cases):
        alone = Results(StatedNumbers([whole.model_copy(update={"case": name})]))
        assert alone.statics.sag[0] == together.statics.sag[place]
        assert alone.state[0] == together.state[place]


def test_the_stated_tension_is_that_of_the_new_conductor():
    text = line(700, 6294.17, {(60, WEIGHT): None})
    new = solved(text, "initial")
    assert new.statics.horizontal_tension[0] / POUND == pytest.approx(6294.17, rel=float(new.model_error[0]))
    assert new.model_error[0] < 2e-6
    assert solved(text, "final").statics.horizontal_tension[0] / POUND < 5600


def test_a_length_that_is_stated_is_that_of_the_new_conductor_without_tension():
    text = line(700, 6294.17, TABLE_700)
    length = solved(text, "final").reference_length[0]
    again = solved(text, "final", f"cable.unstretched_length={float(length)!r}", "cable.tension=null")
    np.testing.assert_allclose(again.statics.sag, solved(text, "final").statics.sag, rtol=1e-9)


TWO_SPANS = """\
points: {{clamp: {{at: [300 m, 0, 0], free: true}}}}
cables:
  left: {{from: [0, 0, 0], to: clamp}}
  right: {{from: clamp, to: [{end} m, 0, 0]}}
  arm: {{from: [300 m, 0, 2 m], to: clamp, axial_stiffness: 1 GN, mass_per_length: 1, diameter: 1 mm, expansion: 0,
        unstretched_length: 2 m}}
"""


def test_conductors_of_suspensions_are_those_of_one_cable():
    """A span with fixed ends, in wind too; and two equal spans, whose clamp between them stays where it is."""
    shared = "material: acsr-drake, tension: {at: horizontal, value: 20 %}, reference: {temperature: 15 degC}"
    still = "cases: {hot: {temperature: 100 degC}, ice: {temperature: -5 degC, ice: {thickness: 15 mm}}"
    cases = {"one": ", storm: {temperature: 5 degC, wind: {speed: 30 m/s, direction: 90 deg}}}\n", "two": "}\n"}
    texts = {"one": "cables: {left: {from: [0, 0, 0], to: [300 m, 0, 0]}}\n", "two": TWO_SPANS.format(end=600)}
    for name, text in texts.items():
        path = written(f"cable: {{{shared}}}\n{text}{still}{cases[name]}")
        alone = f"cable: {{ends: [[0, 0, 0], [300 m, 0, 0]], {shared}}}\n{still}{cases[name]}"
        alone = written(alone, "alone.yaml")
        for state in ("initial", "final")[name == "two" :]:
            given = "--case", "all", "--set", f"cable.state={state}"
            expected = {row["case"]: row for row in table_of("static", alone, *given)}
            for row in table_of("static", path, *given, "--table", "cables"):
                if row["name"] != "arm":
                    close = 1e-9 if name == "one" else 1e-4
                    for column in ("preload_N", "sag_m", "unstretched_length_m"):
                        assert row[column] == pytest.approx(expected[row["case"]][column], rel=close)
                    assert row["state"] == expected[row["case"]]["state"]


def test_cases_of_a_suspension_together_are_as_each_alone(monkeypatch):
    """With no more searches than one of them needs: what creep and the heaviest load leave is computed once for all."""
    path = written(
        "cable: {material: acsr-drake, tension: {at: horizontal, value: 20 %}, state: final}\n"
        f"{TWO_SPANS.format(end=500)}"
        "cases:\n  hot: {temperature: 100 degC}\n  ice: {temperature: -5 degC, ice: {thickness: 25 mm}}\n"
    )
    searches, search = [], rest.pose
    monkeypatch.setattr(rest, "pose", lambda suspension: searches.append(1) or search(suspension))
    equilibria.forget()
    together = table_of("static", path, "--case", "all", "--table", "cables")
    alone, number, cases = [], len(searches), list(dict.fromkeys(row["case"] for row in together))
    cases = campaign(cases, ["hot"])  # what the heaviest load leaves decides its state too
    for case in cases:
        equilibria.forget()
        searches.clear()
        given = ("--case", case) if case in ("hot", "ice") else ()
        alone += [{"case": case} | row for row in table_of("static", path, *given, "--table", "cables")]
        assert number <= len(searches) + 2  # its own equilibrium, and that without its loads
    assert {row["state"] for row in together} > {"after_load (ice)"}
    assert alone == [row for row in together if row["case"] in cases]


def test_stiffness_is_that_of_the_final_moduli_of_the_parts_that_are_tight():
    """New at 60 degF both parts, at 212 degF after creep the core alone: a linear cable with that EA and tension."""
    for state, case, modulus in (("initial", "60 degF", 101000), ("final", "212 degF", 37000)):
        text = line(700, 6294.17, {(60, WEIGHT): None})
        found = solved(text, state, f"cases={{c0: {{temperature: {case}}}}}")
        tension = found.statics.mean_tension[0] / POUND
        linear = f"axial_stiffness: {modulus * 100 * AREA} lbf\n  expansion: 0"
        alike = line(700, tension, {(60, WEIGHT): None}, linear)
        expected = solved(alike, "", f"cable.preload={tension} lbf", "cable.tension=null")
        np.testing.assert_allclose(found.end_stiffness_along(0), expected.end_stiffness_along(0), rtol=3e-3)


def test_modes_and_elements_have_an_answer():
    given = written(line(700, 6294.17, {(212, WEIGHT): None})), "--case", "c0", "--set", "cable.state=final"
    exact, fixed = (table_of("modes", *given, *more) for more in ((), ("--set", "model={elements: 8, order: 4}")))
    for one, other in zip(exact, fixed, strict=False):
        assert one["frequency_Hz"] == pytest.approx(other["frequency_Hz"], rel=1e-3)


# ------------------------------------------------------------------------------------------------------- malformed

PART = "{initial: [0, 5e4], final: 50 GPa, expansion: 2e-5}"
WRONG = {
    "cable.state=old": 'got "old" (allowed: initial, after_load, after_creep, final)',
    "cable.state=final&cable.material=steel&cable.diameter=20 mm": "no effect: give stress_strain, or a material that",
    "cable.state=final&cable.elastic_modulus=70 GPa": "no effect: give stress_strain, or a material that",
    "cable.stress_strain={core: " + PART + "}": "missing key: outer",
    "cable.stress_strain={outer: {initial: [0, 5e4], final: 50 GPa}}": "missing key: expansion",
    "cable.stress_strain={outer: {initial: [5e4], final: 50 GPa, expansion: 0}}": "initial: ",
    "cable.stress_strain={outer: {initial: [0, 1, 2, 3, 4, 5], final: 50 GPa, expansion: 0}}": "initial: ",
    "cable.stress_strain={outer: {initial: [0, 5e4], final: 50 m, expansion: 0}}": "final: expected",
    "cable.stress_strain={outer: {initial: [0, 5e4], final: -5, expansion: 0}}": "final: must be positive",
    "cable.stress_strain={outer: {initial: [0, 5e4], final: 50 GPa, expansion: 0, area_share: 1.2}}":
        "area_share: must be above 0 and at most 1",
    "cable.stress_strain={outer: {initial: [0, 5e4], final: 50 GPa, expansion: 0, area_share: 0.5}}":
        "without a core the outer strands are all of the area",
    "cable.stress_strain={outer: {initial: [0, 5e4, -2e5], final: 50 GPa, expansion: 0}}":
        "the curve must rise to a strain of 0.2 % at least; it does not at 0.11 %",
    "cable.stress_strain={outer: {initial: [-1e6, 5e4], final: 50 GPa, expansion: 0}}":
        "the curve has no tension up to a strain of 0.5 %",
    "cable.stress_strain={outer: {initial: [0, 300], final: 50 GPa, expansion: 0}}":
        "the curve begins at 0.207 GPa, 0.0041 times the final modulus",
    "cable.stress_strain={unit: kg, outer: " + PART + "}": 'unit: got "kg" (allowed: psi, MPa, Pa)',
    "cable.stress_strain={outer: {initial: [0, 5e4], final: 50 GPa, expansion: 0, area_share: 0.5}, core: {initial: "
    "[0, 5e4], final: 50 GPa, expansion: 0, area_share: 0.4}}": "the two shares of the area add up to 0.9",
}  # fmt: skip


@pytest.mark.parametrize("sets", WRONG)
def test_what_is_wrong_is_told_in_one_line(sets):
    (line,) = mistakes_of(f"base: {CONFIGS / 'line.yaml'}\n", *sets.split("&"))
    assert WRONG[sets] in line


def test_a_state_of_load_without_a_case_is_refused():
    (line,) = mistakes_of("cable: {chord: 300 m, material: acsr-drake, state: after_load, preload: 20 kN}\n")
    assert "after_load: missing key: cases" in line


def test_extremes_have_an_answer_or_a_reason():
    """From slack to far beyond strength, hot and cold, steep and level: a number, or one line; never a warning."""
    text = line(700, 6000, TABLE_700)
    extremes = list(itertools.product(("30 lbf", "60 klbf"), ("-200 degC", "900 degC"), (0, 1e5)))
    for tension, temperature, ice in campaign(extremes, [extremes[place] for place in (0, 3, 5, 6)]):  # two of each
        sets = [f"cable.tension.value={tension.replace('klbf', '000 lbf').replace('60 000', '60000')}"]
        sets += [f"cases={{c0: {{temperature: {temperature}, ice: {{weight: {ice}}}}}}}"]
        results = solved(text, "final", *sets)
        assert results.failures or (np.isfinite(results.statics.sag).all() and results.statics.max_tension[0] > 0)


def test_the_materials_are_shown_with_their_curves_sources():
    listed = run("materials")
    for name in ("acsr-26/7", "acsr-6/1", "acsr-drake", "acsr-hawk", "aac-dahlia", "guy-strand"):
        (row,) = (row for row in listed.out.splitlines() if row.startswith(f"| {name} "))
        assert "curves" in row or "all numbers" in row


# ---------------------------------------------------------------------------------- conductors of uneven tension

UNEVEN = """
cable:
  mass_per_length: 1.6 kg/m
  area: 468.6 mm^2
  reference: {temperature: 70 degF}
  stress_strain:
    outer: {initial: [0, 58000, -20000], creep: [0, 21000], final: 76.5 GPa, expansion: 23e-6 1/K, area_share: 0.86}
    core: {initial: [0, 37000], final: 190 GPa, expansion: 11.5e-6 1/K}
gravity: 9.81
cases: {light: {ice: {weight: 2 N/m}}, heavy: {ice: {weight: 8 N/m}}}
"""
UNEVEN_CURVES = (([0, 58000, -20000], [0, 21000], 0.86 * 76.5e9), ([0, 37000], [0, 37000], 0.14 * 190e9))  # final in Pa


class Uneven:
    """The conductor of UNEVEN at the temperature of its curves: strain and sets of each piece by its own tension."""

    def __init__(self, across, up, preload):
        self.end, self.preload = (across, up), preload
        nodes, weights = np.polynomial.legendre.leggauss(100)
        self.places = np.concatenate([nodes + 1, nodes + 3]) / 4  # of both halves, over the length
        self.weights = np.tile(weights / 4, 2)
        chord = np.hypot(across, up)
        new = (-np.inf, -np.inf)
        ends = 0.996 * chord, 1.003 * chord
        self.length = brentq(lambda length: self.rest(length, 0, new)[0]["preload"] - preload, *ends, xtol=1e-12)

    def parts(self, strain, sets, curve=0):
        """Tension of both parts. [N]"""
        for of_part, permanent in zip(UNEVEN_CURVES, sets, strict=True):
            pull = PSI * np.polynomial.Polynomial(of_part[curve])(100 * strain)
            yield 468.6e-6 * np.maximum(0, np.minimum(pull, of_part[2] * (strain - permanent)))

    def strain_at(self, tension, sets, curve):
        """Strain of each piece, by bisection."""
        low, high = np.zeros(len(tension)), np.full(len(tension), 2e-2)
        for _ in range(55):
            middle = (low + high) / 2
            less = sum(self.parts(middle, sets, curve)) < tension
            low, high = np.where(less, middle, low), np.where(less, high, middle)
        return low

    def rest(self, length, ice, sets, curve=0):
        """Tensions and sag of a level span, and the strain of each piece."""
        weights, (across, up) = length * self.weights, self.end
        without_tension = np.maximum(np.minimum(*sets), 0.0).mean()  # strain by which ice is on a longer conductor
        weight = 1.6 * 9.81 + ice * (1 + without_tension)

        def hung(force):
            upward = force[1] + weight * length * self.places
            tension = np.hypot(force[0], upward)
            return upward, tension, self.strain_at(tension, sets, curve)

        def missing(force):
            upward, tension, strain = hung(force)
            pieces = weights * (1 + strain) / tension
            return [(force[0] * pieces).sum() - across, (upward * pieces).sum() - up]

        half = weight * length / 2
        along_chord = self.preload * np.array(self.end) / np.hypot(across, up)
        force = fsolve(missing, along_chord - [0, half], xtol=1e-12)
        upward, tension, strain = hung(force)
        fall = (weights * (1 + strain) * upward / tension)[: len(weights) // 2].sum()
        found = {"horizontal_tension": force[0], "preload": (weights * tension).sum() / length, "sag": -fall}
        return found, strain

    def sets(self, strain, curve, before=(-np.inf, -np.inf)):
        """Permanent sets of both parts of each piece, stretched to a strain on their curves."""
        pulls = (PSI * np.polynomial.Polynomial(part[curve])(100 * strain) for part in UNEVEN_CURVES)
        own = [strain - pull / part[2] for pull, part in zip(pulls, UNEVEN_CURVES, strict=True)]
        return [np.maximum(new, old) for new, old in zip(own, before, strict=True)]


@pytest.mark.parametrize("span", [(800.0, 500.0, 45e3), (300.0, 0.0, 30e3), (60.0, 0.0, 10e3)])
def test_stated_errors_count_what_length_and_permanent_sets_lack(span):
    """Creep and load leave sets by the mean tension alone: where tensions vary along a span, 1e-8 to 2e-5 off."""
    truth, new = Uneven(*span), (-np.inf, -np.inf)
    by_creep = truth.sets(truth.rest(truth.length, 0, new, curve=1)[1], 1)
    by_load = truth.sets(truth.rest(truth.length, 8, new)[1], 0)
    both = truth.sets(truth.rest(truth.length, 8, by_creep)[1], 0, by_creep)
    of_state = {"initial": new, "after_creep": by_creep, "after_load": by_load, "final": both}
    columns = ["horizontal_tension", "preload"] + ["sag"] * (span[1] == 0)
    sets_of_span = f"cable.ends=[[0, 0, 0], [{span[0]}, 0, {span[1]}]]", f"cable.preload={span[2]}"
    for state, sets in of_state.items():
        shares = []
        for case, ice in (("light", 2), ("heavy", 8)):
            row = solve(scene_of(UNEVEN, *sets_of_span, f"cable.state={state}", f"case={case}"), *columns)
            numbers = truth.rest(truth.length, ice, sets)[0]
            shares += [abs(row.values[name] / numbers[name] - 1) / row.errors[name] for name in columns]
        assert 0.05 < max(shares) < 1, (state, shares)


def test_places_count_what_linear_conductors_lack():
    """Two spans over a clamp on a roller, which moves to where both pull alike."""
    spans, new = [Uneven(300.0, 40.0, 26e3), Uneven(450.0, -60.0, 27e3)], (-np.inf, -np.inf)

    def rolled(sets, curve=0):
        """Movement of the clamp, and strains of both spans."""

        def at(moved):
            spans[0].end, spans[1].end = (300.0 + moved, 40.0), (450.0 - moved, -60.0)
            return [span.rest(span.length, 0, of_span, curve) for span, of_span in zip(spans, sets, strict=True)]

        def pull(moved):
            one, two = at(moved)
            return two[0]["horizontal_tension"] - one[0]["horizontal_tension"]

        moved = brentq(pull, -0.2, 0.2, xtol=1e-12)
        return moved, [strain for _, strain in at(moved)]

    by_creep = [span.sets(strain, 1) for span, strain in zip(spans, rolled([new, new], 1)[1], strict=True)]
    lengths = [f"unstretched_length: {span.length!r}" for span in spans]
    section = f"""{UNEVEN.partition("gravity")[0]}
gravity: 9.81
bodies: {{clamp: {{at: [300, 0, 40], mass: 8, free: [x], attachments: {{eye: [0, 0, 0]}}}}}}
cables:
  one: {{from: [0, 0, 0], to: clamp.eye, {lengths[0]}}}
  two: {{from: clamp.eye, to: [750, 0, -20], {lengths[1]}}}
"""
    for state, sets in (("initial", [new, new]), ("after_creep", by_creep)):
        row = solve(scene_of(section, f"cable.state={state}"), "clamp.x")
        wrong = abs(row.values["clamp.x"] - 300.0 - rolled(sets)[0])
        assert 0.02 < wrong / (row.errors["clamp.x"] * 300) < 1, state
