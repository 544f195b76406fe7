"""The language of --where: against Python's own evaluation, with empty cells, with units, and what it refuses."""

import itertools
from types import SimpleNamespace

import pandas
import pytest
from campaign import campaign
from hypothesis import given, settings
from hypothesis import strategies as st

from cablestudy.errors import SceneError
from cablestudy.scene.entries import Entry
from cablestudy.sweeps.condition import parse

VARIED = {"cable.preload": [1500], "cable.material": ["stainless-steel"], "gondola.mass": [50],
          "winch.controller.notch.frequency": ["coupled", "1 Hz"]}  # fmt: skip
STUDY = SimpleNamespace(
    find=None,
    columns=("sag", "mass", "gondola_rms", "status"),
    varied=tuple(VARIED),
    entries=[Entry(((key, values, None),)) for key, values in VARIED.items()],
    ask=lambda *_: None,
    case=lambda _: ({}, None),
)
ROW = {
    "sag_m": 0.3,
    "mass_kg": 2.0,
    "gondola_rms_mm": 0.5,
    "stress_MPa": 300.0,
    "sag_ratio": 0.04,
    "phase_margin_deg": 60.0,
    "gain_margin_dB": None,
    "status": "ok",
    "cable.preload_N": 1500.0,
    "cable.material": "stainless-steel",
    "gondola.mass_kg": 50.0,
    "winch.controller.notch.frequency": "coupled",
}


def holds(text, *rows):
    """True, False or None (unknown) of each row; of ROW alone without any."""
    found = parse(text, STUDY)[0](pandas.DataFrame(rows or [ROW]))
    truths = [None if truth is pandas.NA else bool(truth) for truth in found]
    return truths if rows else truths[0]


COLUMNS = ("sag", "mass", "stress")
HEADERS = {"sag": "sag_m", "mass": "mass_kg", "stress": "stress_MPa"}
VALUES = (-1, 0, 0.5, 2)
OPERANDS = st.sampled_from([*COLUMNS, *map(str, VALUES)])


@st.composite
def comparisons(draw):
    signs = draw(st.lists(st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), min_size=1, max_size=2))
    operands = [draw(st.sampled_from(COLUMNS)), *(draw(OPERANDS) for _ in signs)]
    # columns of three dimensions are not compared with each other
    operands[1:] = [operand if operand not in COLUMNS else operands[0] for operand in operands[1:]]
    return operands[0] + "".join(f" {sign} {operand}" for sign, operand in zip(signs, operands[1:], strict=True))


CONDITIONS = st.recursive(
    comparisons(),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["and", "or"]), inner).map(" ".join),
        inner.map("({})".format),
        inner.map("not ({})".format),
        inner.map("not {}".format),
    ),
    max_leaves=6,
)


@settings(max_examples=campaign(100, 30))
@given(text=CONDITIONS)
def test_a_condition_means_what_it_means_in_python(text):
    grid = list(itertools.product(VALUES, repeat=len(COLUMNS)))
    expected = [eval(text, {"__builtins__": {}}, dict(zip(COLUMNS, cells, strict=True))) for cells in grid]
    assert holds(text, *(dict(zip(HEADERS.values(), cells, strict=True)) for cells in grid)) == expected


@settings(max_examples=campaign(50, 15))
@given(text=CONDITIONS, empty=st.sets(st.sampled_from(COLUMNS), min_size=1))
def test_an_empty_cell_decides_nothing(text, empty):
    """What is true or false with empty cells is so whatever they might hold."""
    row = dict.fromkeys(HEADERS.values(), 0.5)
    rows = [row | {HEADERS[name]: None for name in empty}]
    for filled in itertools.product(VALUES, repeat=len(empty)):
        rows.append(row | {HEADERS[name]: value for name, value in zip(sorted(empty), filled, strict=True)})
    found, *others = holds(text, *rows)
    assert found is None or set(others) == {found}


@pytest.mark.parametrize("sign", ["<", "<=", ">", ">=", "==", "!="])
def test_a_comparison_with_an_empty_cell_is_never_true(sign):
    for text in ("gain_margin {} 5", "5 {} gain_margin", "not gain_margin {} 5", "1 < 2 {} gain_margin"):
        assert holds(text.format(sign)) is None
    assert holds(f"gain_margin {sign} 5 or sag < 1") is True
    assert holds(f"gain_margin {sign} 5 and sag > 1") is False


TRUE = [
    "sag < 0.5", "sag_m < 0.5", "-1<sag", "+.25e0 < sag", "0.1 < sag <= 0.3 < 1", "((sag)) < (0.5)",
    # units: 1 ft is 0.3048 m, 60 deg 1.047 rad
    "sag <= 300mm", "sag == 300 mm", "sag < 1 ft", "stress >= 0.3 GPa", "sag_ratio < 5 %", "phase_margin > 1 rad",
    "gondola_rms == 0.0005 m", "gondola_rms < sag", "sag > gondola_rms",
    # fractions, as in files
    "sag < 1/3", "1/4 < sag < 1/3 m", "cable.preload == 3/2 kN",
    # texts
    "status == ok", "status == 'ok'", "ok == status", 'status != "broken cable: stress"',
    # varied keys: numbers, numbers with a unit, texts, and both
    "cable.preload < 2000", "cable.preload == 1500", "cable.preload > 1.4 kN", "1 kN < cable.preload < 2 kN",
    "gondola.mass == 50 kg", "gondola.mass > mass", "cable.material == stainless-steel", "cable.material != 'steel'",
    "winch.controller.notch.frequency == 'coupled'", "winch.controller.notch.frequency != 5 Hz",
    # not before and, and before or
    "not sag < 0.5 or mass == 2", "sag > 1 and mass == 1 or mass == 2", "0.1<sag<5and not(mass>5)",
    "(" * 60 + "sag < 1" + ")" * 60,
]  # fmt: skip
FALSE = [
    "sag < 300 mm", "0.1 < sag < 0.3", "sag < gondola_rms", "stress > 300 N/mm^2", "stress > 300 N/mm²",
    "sag < 2/7m", "sag_ratio < 3%", "phase_margin > 1.1 rad", "status != ok", "cable.material == steel",
    "gondola.mass < 40", "not (sag < 0.5 or mass == 2)", "sag > 1 and (mass == 1 or mass == 2)",
]  # fmt: skip


UNKNOWN = ["winch.controller.notch.frequency < 5 Hz"]  # a text, which is not compared with a number
TRUTHS = {True: TRUE, False: FALSE, None: UNKNOWN}


@pytest.mark.parametrize(("text", "truth"), [(text, truth) for truth, texts in TRUTHS.items() for text in texts])
def test_units_texts_and_varied_keys(text, truth):
    assert holds(text) is truth


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "1: expected a column, a number or a text, got nothing"),
        ("sag", "4: expected < <= > >= == or != after 'sag'"),
        ("sag < and", "7: expected a column, a number or a text, got 'and'"),
        ("sag = 5", "5: unexpected '=' (use ==)"),
        ("sag <> 5", "5: unexpected '<>' (use !=)"),
        ("sag < 5 && mass > 1", "9: unexpected '&&' (use and)"),
        ("! sag < 5", "1: unexpected '!' (use not)"),
        ("(sag < 5", "1: '(' is never closed"),
        ("sag < 5)", "8: expected and, or, or the end, got ')'"),
        ("sag < 5 'mm' < 1", "9: expected and, or, or the end, got \"'mm'\""),
        ("sag < sag/4", "10: unexpected '/'"),
        ("sag < 1/2.5", "8: unexpected '/'"),
        ("sag < 1/0", '7: not a number: "1/0"'),
        ("safety_factor > 2", "1: unknown column 'safety_factor' (did you mean utilisation? it is 1 over the safety"),
        ("sagg < 5", "1: unknown column 'sagg' (did you mean sag?)"),
        ("sag < masss", "7: unknown column 'masss' (did you mean mass?)"),
        ("status < ok", "10: unknown column 'ok'"),
        ("status < 'ok'", "8: texts compare by == and != only"),
        ("status == 5", "11: 5 is a number, and status is text"),
        ("status == sag", "11: sag is a number, and status is text"),
        ("sag < 'five'", "7: sag is a number, and 'five' is text"),
        ("sag < 5 Hz", '7: "Hz" (frequency) and "m" (length) do not fit each other'),
        ("sag < mass", '7: "kg" (mass) and "m" (length) do not fit each other'),
        ("sag_ratio < 5 mm", '13: "mm" (length) and no unit (pure number) do not fit each other'),
        ("gain_margin > 50 %", '15: "%" (pure number) and "dB" (level) do not fit each other'),  # 3.5 dB, not 0.5
        ("sag_ratio < 6 dB", '13: "dB" (level) and no unit (pure number) do not fit each other'),
        ("sag < 5 parsecz", "7: not a unit: "),
        ("gondola.mass < 5 m", '16: "m" (length) and "kg" (mass) do not fit each other'),
        ("cable.preload < sag", '1: "N" (force) and "m" (length) do not fit each other'),
        ("cable.sagg < 5", "1: the study does not vary 'cable.sagg' (did you mean "),
        ("wind.speed < 5", "1: the study does not vary 'wind.speed' ("),
        ("1 < 2", "1: compares no column"),
        ("'a' == 'a'", "1: compares no column"),
        ("sag < 1e999", '7: not a number: "1e999"'),
        ("sag < 1; import os", "8: unexpected ';'"),
        ("sag\u0000 < 5", "4: unexpected '\\x00'"),
        ("sag.__class__ == 5", "1: the study does not vary 'sag.__class__'"),
        ("__import__('os') == 5", "11: expected < <= > >= == or !=, got '('"),
        ("sag < 'open", '7: unexpected "\'"'),
        ("sag < 5 and or mass < 1", "13: expected a column, a number or a text, got 'or'"),
        ("sag < ()", "7: expected a column, a number or a text, got empty brackets"),
        ("(sag < 1) == ok", "2: expected a column, a number or a text, got a condition"),
        ("sag < mass is True", "12: expected and, or, or the end, got 'is'"),
        ("sag if sag < 1 else mass", "5: expected"),
        ("sag + 1 < 2", "5: unexpected '+'"),
        ("sag < 1 and (" * 60 + "sag < 1" + ")" * 60, "638: nested more than 50 deep"),
        ("(sag < 1) (mass < 1)", "11: expected and, or, or the end, got '('"),
        ("sag < 1 not (mass < 1)", "9: expected and, or, or the end, got 'not'"),
        ("sag > 1 not", "9: expected and, or, or the end, got 'not'"),
        ("(sag mass > 1)", "6: expected < <= > >= == or !=, got 'mass'"),
        ("not " * 60 + "sag < 1", "201: nested more than 50 deep"),
    ],
)
def test_what_is_refused(text, message):
    told = outcome(text)
    assert told.startswith(f"--where:{message}")
    assert "\n" not in told


def outcome(text):
    """What a condition says of the row, or why it is none."""
    try:
        return holds(text)
    except SceneError as error:
        return str(error)


WORDS = st.sampled_from(["sag", "<", "==", "1", "1 mm", "and", "or", "not", "(", ")", "'a'", "status", "."])


@settings(max_examples=200)
@given(st.text(max_size=40) | st.lists(WORDS).map(" ".join))
def test_no_text_is_a_traceback(text):
    found = outcome(text)
    assert found in (True, False, None) or (found.startswith("--where:") and "\n" not in found)


def test_a_long_condition_is_read_or_refused():
    text = " and ".join(["sag < 1"] * 700)
    assert holds(text) is True
    with pytest.raises(SceneError, match="at most 10000"):
        holds(" and ".join(["sag < 1"] * 2000))
    for nested in ("(" * 300 + "sag < 1" + ")" * 300, "(" * 5000, "not " * 2490 + "sag < 1", "(not " * 150 + "sag < 1"):
        with pytest.raises(SceneError, match=r"^--where:.*(nested more than 50 deep|never closed)$"):
            holds(nested)
    with pytest.raises(SceneError):  # and no search goes back over it time and again
        holds("9" * 9000 + " a" + "." * 400)
