"""Arguments of the Python interface: the ordinary are taken, all else is refused in a line that names the argument."""

import datetime
import inspect
import json
import math
import sys
import typing
import warnings
from fractions import Fraction
from pathlib import Path

import control
import numpy as np
import pandas as pd
import pytest
import python_calls
import scipy.signal
from campaign import campaign
from command import CARLINA, CONFIGS, ROOT, write
from html_page import Page
from picture import undrawn
from scenes import GUY

import cablestudy as cs
from cablestudy.control.statespace import StateSpace
from cablestudy.interface import arguments
from cablestudy.interface.answer import Tables, Values
from cablestudy.interface.arguments import readers
from cablestudy.interface.plain import shown, unwrapped

NET = CONFIGS / "suspensions" / "carlina-net.yaml"
STUDY = {"base": GUY, "vary": [{"cable.diameter": ["12 mm", "16 mm"]}], "columns": ["sag", "mass"]}
FUNCTIONS = {name: getattr(cs, name) for name in ("load", "sweep", "find", "trade", "report")}
METHODS = {
    f"{kind.__name__}.{name}": method
    for kind in (cs.Scene, cs.Suspension)
    for name, method in vars(kind).items()
    if inspect.isfunction(method) and not name.startswith("_") and name not in kind.hidden
}
STATE_SPACE = {f"StateSpace.{name}": getattr(StateSpace, name) for name in ("response", "to_scipy", "to_control")}
PUBLIC = FUNCTIONS | METHODS | STATE_SPACE
CHECKED = [
    (name, argument)
    for name, function in (FUNCTIONS | METHODS | {"Scene": cs.Scene.__init__}).items()
    for argument in inspect.signature(function).parameters
    if argument != "self"
]
NOWHERE = {  # what no argument takes
    "object": object(),
    "complex": 1 + 2j,
    "bytes": b"x",
    "set": {1, 2},
    "generator": (i for i in range(3)),
    "class": Path,
    "function": len,
    "datetime": datetime.datetime(2020, 1, 1),
    "datetime64": np.datetime64("2020-01-01"),
    "record": np.zeros(2, "i4,f8"),
    "DataFrame": pd.DataFrame({"a": [1]}),
    "NA": pd.NA,
    "nested": [[[["x"]]]],
    "objects": np.array([object()]),
    "blank": " ",
    "zero byte": "\0",
}
TEXT_THAT_IS_READ = {"blank", "zero byte"}  # by what reads the text: a unit, a key, a name
RIGHT = {"goal": "sag = 1 m", "by": "cable.preload", "response": "0.1Hz:1Hz:3", "time": "1 s", "path": GUY}


pytestmark = pytest.mark.usefixtures("rows_once")


def scene_of(name):
    return cs.load(NET if name.startswith("Suspension") else GUY)


def called(name, **given):
    """Call a public function or method, its other arguments right."""
    function = cs.Scene if name == "Scene" else FUNCTIONS.get(name) or getattr(scene_of(name), name.partition(".")[2])
    needed = {
        one.name: RIGHT.get(one.name, "x")
        for one in inspect.signature(function).parameters.values()
        if one.default is one.empty
    }
    return function(**{**needed, **given})


def test_every_public_argument_and_result_has_a_type():
    """Types that `typing` can read, none of them Any: what mypy --strict needs to know what a user's script holds."""
    names = {"pandas": pd, "Figure": object, "StateSpace": StateSpace, "Self": cs.Scene, "Values": Values}
    names |= {"ArrayLike": object, "NDArray": list, "control": control, "scipy": scipy}
    assert len(PUBLIC) > 20
    for name, function in PUBLIC.items():
        hints = typing.get_type_hints(function, localns=names)
        expected = {one for one in inspect.signature(function).parameters if one != "self"} | {"return"}
        assert hints.keys() == expected, name
        assert typing.Any not in hints.values(), name
    properties = [one for kind in (cs.Scene, StateSpace) for one in vars(kind).values() if isinstance(one, property)]
    assert len(properties) > 5
    assert all("return" in one.fget.__annotations__ for one in properties)
    assert "return" in cs.SceneError.__init__.__annotations__
    assert (Path(cs.__file__).parent / "py.typed").exists()


def test_every_argument_says_what_it_takes():
    """None is taken as it comes: its annotation names a kind, a choice of words, a class, or one of these or None."""
    assert len(CHECKED) > 50
    for name, argument in CHECKED:
        function = (FUNCTIONS | METHODS | {"Scene": cs.Scene.__init__})[name]
        assert readers(inspect.unwrap(function))[argument] is not arguments.unread, (name, argument)


@pytest.mark.parametrize(("name", "argument"), CHECKED, ids=lambda part: part)
def test_what_no_argument_takes_is_refused_by_its_name(name, argument, folder):
    for odd, value in NOWHERE.items():
        if odd in TEXT_THAT_IS_READ and argument != "out":
            continue
        with pytest.raises(cs.SceneError) as raised:
            called(name, **{argument: value})
        begin = f"{name.rpartition('.')[2]}: {argument}: "
        lines = [line for line in str(raised.value).splitlines() if line.startswith(begin)]
        assert len(lines) == 1, odd
        assert len(lines[0]) < 250, odd
    assert list(folder.iterdir()) == []


WRONG = {  # what is called -> what the line says
    "scene.modes(count='x')": "modes: count: expected a whole number from 1 to 100000, got 'x'",
    "scene.modes(count=0)": "modes: count: expected a whole number from 1 to 100000, got 0",
    "scene.modes(count=True)": "modes: count: expected a whole number from 1 to 100000, got True",
    "scene.modes(count=2.5)": "modes: count: expected a whole number from 1 to 100000, got 2.5",
    "scene.modes(count=10**400)": "got an integer of more than 400 digits",
    "scene.modes(upto=nan)": 'upto: expected a frequency in Hz (a number, or text such as "10 Hz"), got "nan"',
    "scene.modes(upto=-1)": "upto: a frequency must be positive, got -1.0",
    "scene.windrms(on='gond')": "windrms: on: unknown 'gond' (allowed: gondola, cable, both)",
    "scene.plot(kind=3)": "plot: kind: unknown 3 (allowed: static, modes, windrms, loop)",
    "scene.plot(kind=np.array(['static', 'modes']))": "plot: kind: unknown an array",
    "scene.state_space(wind=1)": "state_space: wind: expected True or False, got 1",
    "scene.state_space(error='x')": "state_space: error: expected a number, got 'x'",
    "scene.state_space(error=nan)": "error: must be between 0 and 1, got nan",
    "scene.state_space(modes=0)": "state_space: modes: expected a whole number from 1",
    "scene.find('sag', 'cable.preload')": "find: goal: expected COLUMN = VALUE, for example 'sag = 2 m', got 'sag'",
    "scene.find('sag = 1 m', 'cable.preload', between=(1,))": "between 1: expected LOW:HIGH",
    "scene.find('sag = 1 m', 'cable.preload', columns=[1])": "find: columns: item 0: expected text, got 1",
    "scene.loop_in_time(-1)": "time -1.0: a time must be positive",
    "scene.loop_response((1, 2))": "response 1:2: expected FROM:TO:COUNT",
    "scene.trade(repeats=0)": "trade: repeats: expected a whole number from 1 to 1000, got 0",
    "scene.compute(what=3)": "compute: what: unknown 3 (allowed: static, ",
    "scene.plot('bode')": "kind: unknown 'bode' (allowed: static, modes, windrms, loop)",
    "scene.compute('windrmss')": "unknown 'windrmss' (allowed: ",
    "scene.compute({'static'})": "compute: what: unknown a set (allowed: ",
    "scene.compute(pd.Series(['static', 'modes']))": "compute: what: unknown a Series (allowed: ",
    "scene.loop_response(())": "loop_response: response: expected first and last frequency and how many, ",
    "scene.state_space('gondole')": "unknown 'gondole' (allowed: gondola, loop)",
    "scene.modes(3, 4.0)": "count and upto exclude each other",
    "scene.state_space('gondola', input='wind')":
        "input wind: unknown (did you mean winch? allowed: winch, force_gondola)",
    "scene.state_space(modes=3, error=0.1)": "modes, upto and error exclude each other",
    "cs.load(NET).state_space(output='wind')": "output wind: unknown (",
    "cs.load(CARLINA, {'winch': None}).state_space('loop')": "'cablestudy ssm --with loop' needs it",
    "cs.load('nothing.yaml')": "nothing.yaml: no such file",
    "cs.load(CARLINA, set={'cable.diamter': 3})": "unknown key (did you mean diameter?)",
    "cs.load(CARLINA, case='ice')": 'unknown case "ice"',
    "cs.sweep(CARLINA)": "this is a scene (it has the key cable)",
    "cs.load('')": "load: path: expected the name of a file, or a mapping of what it would say, got ''",
    "cs.load(np.float64(3))": "got 3.0",
    "cs.load(GUY, set='cable.diameter=3 mm')": "load: set: expected a mapping of dotted key -> value, or a",
    "cs.load(GUY, set=['a=1', ''])": "load: set: item 1: expected text, got ''",
    "cs.load(GUY, set={(1, 2): 3})": "load: set: expected text as a key, got a tuple",
    "cs.load(GUY, set={'cable.diameter': object()})": "load: set: cable.diameter: expected mappings with text",
    "cs.load(GUY, set={'cable.diameter': np.ones(2)})": "set cable.diameter: expected a length in m",
    "cs.load(GUY, set={'cable.diameter': nan})": "set cable.diameter: expected a length in m",
    "cs.load(GUY, set={'cable.diameter': 10**5000})": "got an integer of more than 400 digits",
    "cs.load({'cable': recursive()})": "load: path: cable.0.0...: nested more than 60 deep",
    "cs.load({'cable': {1.5: 2}})": "load: path: cable: expected text as a key, got 1.5",
    "cs.sweep(STUDY, vary='x')": "sweep: vary: expected a mapping of dotted key -> values, or a list of",
    "cs.sweep(STUDY, vary={'gravity': None})": "sweep: vary: gravity: expected a list of values, a",
    "cs.sweep(STUDY, vary={'gravity': {'from': 1}})": "sweep: vary: gravity: expected a list of",
    "cs.sweep(STUDY, jobs=0)": "sweep: jobs: expected a whole number from 1 to 1024, got 0",
    "cs.sweep(STUDY, out=3)": "sweep: out: expected the name of a file or folder, got 3",
    r"cs.sweep(STUDY, out='\ud800')": r"sweep: out: expected the name of a file or folder, got '\ud800'",
    "cs.report(GUY, out=3)": "report: out: expected the name of a file or folder, got 3",
    "cs.report(GUY, out='page.txt')": "out page.txt: a page is HTML",
    "cs.Scene(1, 2, 3, 4)": "Scene: path: expected text, got 1\nScene: changes: expected a list of texts",
}  # fmt: skip


@pytest.mark.parametrize("call", WRONG)
def test_wrong_arguments(call):
    with pytest.raises(cs.SceneError) as raised:
        eval(call, {**globals(), "scene": cs.load(CARLINA), "nan": math.nan})
    assert WRONG[call] in str(raised.value)
    assert "--" not in str(raised.value).replace("cablestudy ssm --with loop", "")


def recursive():
    items = []
    items.append(items)
    return items


def test_an_argument_that_there_is_not_is_told_what_there_is():
    with pytest.raises(TypeError, match=r"^load: got an unexpected keyword .* 'sets' \(it takes path, set, case\)"):
        cs.load(GUY, sets={})
    with pytest.raises(
        TypeError, match=r"^modes: too many positional arguments \(it takes count, upto, coupled, cable\)"
    ):
        cs.load(GUY).modes(1, 2, True, "cable", 3)
    with pytest.raises(TypeError, match=r"^find: missing a required argument: 'goal'"):
        cs.find(GUY)


def test_all_wrong_arguments_are_told_at_once():
    with pytest.raises(cs.SceneError) as raised:
        cs.sweep(None, set=3, jobs=0)
    places = [one.where for one in raised.value.mistakes]
    assert places == ["sweep: study", "sweep: set", "sweep: jobs"]


@pytest.mark.parametrize(
    ("changes", "plain"),
    [
        ({"cable.diameter": np.float64(0.02)}, {"cable.diameter": 0.02}),
        ({"cable.diameter": np.float32(0.015625)}, {"cable.diameter": 0.015625}),
        ({"cable.diameter": Fraction(1, 64)}, {"cable.diameter": 0.015625}),
        ({"cable.diameter": np.array(0.02)}, {"cable.diameter": 0.02}),
        ({"gravity": np.int64(9)}, {"gravity": 9}),
        ({"cable.strength": np.ma.masked}, {"cable.strength": None}),  # not zero
        (pd.Series({"cable.diameter": "20 mm", "gravity": 9.0}), {"cable.diameter": "20 mm", "gravity": 9.0}),
        (pd.Series(["gravity=9"]), {"gravity": 9}),
        ({"cable.ends": np.array([[0, 0, 0], [60.0, 0, 80]])}, {}),
        ({"cable.ends": ((0, 0, 0), np.array([60.0, 0, 80]))}, {}),
        (("gravity=9", np.str_("cable.diameter=20 mm")), {"gravity": 9, "cable.diameter": "20 mm"}),
        ({"gravity=9": None}.keys(), {"gravity": 9}),
        (None, {}),
    ],
)
def test_changes_are_read_as_pythons_own_numbers_and_lists(changes, plain):
    assert cs.load(GUY, set=changes).static() == cs.load(GUY, set=plain).static()


def test_a_scene_may_hold_arrays_series_and_paths(tmp_path):
    table = write(tmp_path / "ropes.yaml", "own: {elastic_modulus: 100 GPa, density: 7850, strength: 1 GPa}\n")
    plain = {"ends": [[0, 0, 0], [60, 0, 80]], "material": "own", "diameter": 0.016, "sag": 1}
    cable = pd.Series({**plain, "ends": np.array(plain["ends"], dtype=float)})
    odd = cs.load({"cable": cable, "materials": Path(table)})
    assert odd.static() == cs.load({"cable": plain, "materials": table}).static()
    assert odd.static()["sag_m"] == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize(
    "values",
    [
        np.array([1000.0, 2000.0, 3000.0]),
        pd.Series([1000, 2000, 3000]),
        (1000, np.float64(2000), "3 kN"),
        ["1 kN", "2 kN", "3 kN"],
        {"from": 1000, "to": np.float64(3000), "count": np.int8(3)},
        {"from": "1 kN", "to": "3 kN", "count": 3, "spacing": "linear"},
        "1kN:3kN:3",
        "1kN,2kN,3kN",
        range(1000, 3001, 1000),
    ],
    ids=lambda values: type(values).__name__,
)
def test_values_that_vary_are_lists_arrays_ranges_or_text(values):
    frame = cs.sweep({**STUDY, "vary": []}, vary={"cable.preload": values})
    assert frame["cable.preload_N"].tolist() == pytest.approx([1000, 2000, 3000], rel=1e-15)


def test_one_number_that_varies_is_a_list_of_one():
    assert len(cs.sweep(STUDY, vary={"gravity": np.float32(9)})) == 2


@pytest.mark.parametrize("columns", ["sag,mass", ["sag", "mass"], ("sag", np.str_("mass")), pd.Series(["sag", "mass"]),
                                     pd.Index(["sag", "mass"]), {"sag": 1, "mass": 2}.keys(),
                                     np.array(["sag", "mass"])],
                         ids=lambda columns: type(columns).__name__)  # fmt: skip
def test_columns_are_a_list_of_names_or_text(columns):
    expected = cs.load(GUY).find("sag = 1 m", "cable.preload", columns="sag,mass")
    assert cs.load(GUY).find("sag = 1 m", np.str_("cable.preload"), columns=columns).equals(expected)


@pytest.mark.parametrize("between", [(5000, 2e4), [np.float64(5000), "20 kN"], "5 kN:20 kN", np.array([5000, 2e4])])
def test_a_range_is_two_values_or_text(between):
    expected = cs.load(GUY).find("sag = 1 m", "cable.preload", "5000:20000")
    found = cs.load(GUY).find("sag = 1 m", "cable.preload", between)
    assert found["cable.preload_N"].tolist() == pytest.approx(expected["cable.preload_N"].tolist(), rel=1e-12)


def test_numbers_of_numpy_where_numbers_are_taken():
    scene = cs.load(Path(CARLINA))
    assert len(scene.modes(np.int8(3))) == len(scene.modes(3.0)) == 3
    assert scene.modes(upto=np.float32(3)).equals(scene.modes(upto="3 Hz"))
    assert len(scene.state_space("gondola", modes=np.uint64(2), wind=np.False_).states) == 6
    assert scene.loop_in_time(np.int64(10), size=np.float64(1e-3)).equals(scene.loop_in_time("10 s", size="1 mm"))
    assert scene.loop_response((0.01, "10 Hz", np.int32(3))).equals(scene.loop_response("0.01Hz:10Hz:3"))


@undrawn()
def test_a_page_of_a_mapping(folder):
    assert cs.report(GUY, case="cold").path == "mapping.html"
    page = cs.report({**STUDY, "base": GUY}, out=Path("study.html"), vary={"gravity": np.array([9.0, 10.0])})
    assert page.path == "study.html"
    assert "4 cases" in (folder / "study.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("s", [None, "x", 1j, [[1j]], [math.nan], [1j, [2j]], object(), np.array(["1"]), [True, None],
                               [np.ma.masked], [np.longdouble("1e4000")]])  # fmt: skip
def test_a_state_space_takes_an_array_of_numbers(s):
    model = cs.load(CARLINA).state_space(modes=1)
    with pytest.raises(cs.SceneError, match=r"^response: s: expected a list or array of finite complex"):
        model.response(s)
    with pytest.raises(cs.SceneError, match=r"^response: derivatives: expected True or False, got a str"):
        model.response([1j], "yes")
    assert model.response([1j, 2]).shape == (2, 6, 6)


def test_a_response_at_a_pole_is_refused():
    system = cs.load(CARLINA).state_space(modes=1)
    zero = np.zeros_like(system.a)
    integrator = StateSpace(zero, system.b, system.c, system.d, system.states, system.inputs, system.outputs,
                            system.derivatives)  # fmt: skip
    with pytest.raises(cs.NoSolutionError, match="s: one of the values is a pole"):
        integrator.response([0.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(cs.NoSolutionError, match=r"the response to 1e\+300"):
            system.response([1e300], derivatives=True)


def test_a_warning_stands_at_the_line_that_called():
    scene = cs.load(CARLINA, set={"winch.controller.gain": 50})
    with pytest.warns(UserWarning, match="unstable") as caught:
        scene.state_space("loop", modes=2)
    assert {one.filename for one in caught} == {__file__}


def test_dir_shows_what_a_user_calls():
    names = {"cases", "changes", "find", "freeze", "limits", "loads", "locus", "loop", "loop_in_time", "loop_response",
             "model", "modes", "path", "plot", "shape", "state_space", "static", "trade", "windrms"}  # fmt: skip
    for scene in (cs.load(GUY), cs.load(NET)):
        assert set(dir(scene)) == names
        assert all(hasattr(scene, name) for name in names)
        described = inspect.getdoc(cs.Scene) + "".join(vars(cs.Scene))
        assert all(name in described for name in dir(scene))


def test_results_are_tables_in_a_notebook():
    values = cs.load(GUY).static()
    (table,) = Page(values._repr_html_()).tables.values()
    assert table[0] == ["", "value", "unit", "estimated relative error"]
    assert [row[0] for row in table[1:]] == list(values)
    row = next(row for row in table if row[0] == "sag_m")
    assert float(row[1]) == pytest.approx(values["sag_m"], rel=1e-5)
    assert row[2] == "m"
    assert float(row[3]) == pytest.approx(values.errors["sag_m"], rel=0.5)


def test_tables_of_a_suspension_in_a_notebook():
    net = cs.load(NET)
    tables = net.static()
    page = tables._repr_html_()
    assert isinstance(tables, Tables)
    headings = [part.partition("<")[0] for part in page.split("<h4>")[1:]]
    assert headings == [name for name, frame in tables.items() if len(frame)]
    assert page.count("<table") == len(headings)
    assert tables._repr_html_() in net.compute("static")._repr_html_()
    assert "<i>" not in Tables({"<i>": tables["cables"]})._repr_html_()


def test_a_name_of_no_value_is_told():
    values = cs.load(GUY).static()
    for name, message in (("sag", "no 'sag' .did you mean sag_m"), (3, "no 3 .allowed"), (None, "no None")):
        with pytest.raises(KeyError, match=message):
            values[name]


def test_an_error_of_anything_is_text():
    assert str(cs.SceneError(3)) == "3"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "None"), (True, "True"), (np.float64(3), "3.0"), (np.str_("x"), "'x'"), ("a\nb", r"'a\nb'"),
        ([1], "a list"), (np.zeros((2, 2)), "an array"), (pd.Series([1]), "a Series"), (Path, "the class Path"),
        (1j, "1j"), (np.longdouble("1e4000"), "inf"), (Fraction(10**400, 3), "a Fraction"),
        ("x" * 99, f"'{'x' * 57}'..."),
    ],
)  # fmt: skip
def test_a_value_in_a_message_is_short(value, text):
    assert shown(value) == text


@pytest.mark.parametrize("kind", ["float64", "float32", "float16", "int8", "uint64", "bool_", "longdouble"])
def test_a_number_of_numpy_is_one_of_python(kind):
    own = unwrapped(np.dtype(kind).type(1))
    assert own == 1
    assert type(own) in (int, float, bool)


CALLS = campaign(100, 30)


@pytest.fixture
def watched(monkeypatch):
    """The script of the campaign watches the tables of answers by a function that it puts there."""
    monkeypatch.setattr(python_calls.answer, "frame_of", python_calls.answer.frame_of)


def test_a_sample_of_the_campaign_finds_nothing(watched, monkeypatch, capsys, folder):
    monkeypatch.setattr(sys, "argv", ["python_calls.py", "--calls", str(CALLS)])
    code, out = python_calls.main(), capsys.readouterr().out
    assert code == 0, out
    assert f"{CALLS} calls, 0 findings" in out
    for ended in ("SceneError", "a result"):
        assert f" times {ended}\n" in out
    assert list(folder.iterdir()) == []


def test_the_campaign_finds_what_it_looks_for(watched, monkeypatch, capsys):
    """With arguments that are not checked any more."""
    monkeypatch.setattr(sys, "argv", ["python_calls.py", "--calls", "100", "--only", "Scene.modes"])
    monkeypatch.setattr(arguments, "readers", lambda function: {})
    assert python_calls.main() == 1
    lines = capsys.readouterr().out.splitlines()
    faults = [json.loads(line)["fault"] for line in lines if line.startswith("{")]
    assert len(faults) > 10
    assert any(fault.startswith("raised in ") for fault in faults)


OTHER_SCRIPTS = ("缆索", "Трос", "كابل", "ケーブル")


@pytest.mark.parametrize("kind", ["static", "modes"])
def test_pictures_of_names_in_other_scripts_have_no_warning(kind, tmp_path, caplog):
    """Warnings are errors in these tests; matplotlib logs, too, what it lacks."""
    first, *others = OTHER_SCRIPTS
    angles = dict(zip(others, 2 * np.pi / 3 * np.arange(3), strict=True))
    scene = {
        "cable": {"material": "aramid", "diameter": "2 mm", "preload": "1 kN"},
        "points": {first: {"at": [0, 0, 0], "free": True, "mass": 20}},
        "cables": {name: {"from": [10 * np.cos(a), 10 * np.sin(a), 5], "to": first} for name, a in angles.items()},
        "model": {"elements": 2},
    }
    figure = cs.load(scene).plot(kind)
    for ending in campaign(("png", "svg", "pdf"), {"static": ("png",), "modes": ("svg", "pdf")}[kind]):
        figure.savefig(tmp_path / f"x.{ending}")
    assert not caplog.records
    shown = " ".join(text.get_text() for text in figure.findobj(lambda one: hasattr(one, "get_text")))
    assert {"static": others[-1], "modes": first}[kind] in shown  # in characters that matplotlib's own font lacks


def test_legends_stand_at_fixed_places():
    """matplotlib's search for the best place warns where it takes more than a second."""
    for path in sorted((ROOT / "cablestudy" / "plots").glob("*.py")):
        text = path.read_text(encoding="utf-8")
        assert ".legend()" not in text, path.name
        assert 'loc="best"' not in text, path.name
