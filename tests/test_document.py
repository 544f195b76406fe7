"""The strict YAML reader: values, places, base files, overrides, and one line for everything that is wrong."""

import contextlib
import io
import json
import math
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cablestudy.errors import SceneError
from cablestudy.scene import document as document_module
from cablestudy.scene.document import apply_sets, parse_set, read_document, read_file
from cablestudy.scene.strict_yaml import compose, resolve
from cablestudy.scene.tolerances import SCENE


def write(name, content):
    Path(name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return name


def value_of(text):
    return compose(text, "x")[0]


def message_of(call, *arguments):
    with pytest.raises(SceneError) as caught:
        call(*arguments)
    assert caught.value.exit_code == 2
    assert all("\n" not in str(mistake) for mistake in caught.value.mistakes)
    return str(caught.value)


# The value of each scalar is that of the YAML 1.2.2 specification, section 10.3.2 (core schema).
SCALARS = [
    ("1e8", 1e8), ("210e9", 210e9), ("1.5e-3", 0.0015), (".5", 0.5), ("5.", 5.0), ("-0.0", -0.0),
    ("+12", 12), ("0777", 777), ("0o17", 15), ("0x1F", 31), (".inf", math.inf), ("-.INF", -math.inf),
    ("true", True), ("False", False), ("null", None), ("~", None), ("", None), (".nan", math.nan),
]  # fmt: skip


@pytest.mark.parametrize(("text", "value"), SCALARS)
def test_plain_scalars_follow_yaml_1_2(text, value):
    result = resolve(text)
    assert (repr(result), type(result)) == (repr(value), type(value))  # of which nan is equal too


@pytest.mark.parametrize(
    "text",
    ["no", "yes", "on", "off", "y", "1:30", "2024-01-01", "1_000", "0b1", "1e", ".", "e5", "tRue", "None", "=", "<<"],
)
def test_what_yaml_1_1_would_convert_is_text(text):
    assert value_of(f"a: {text}") == {"a": text}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: '1e8'\nb: \"true\"\nc: |-\n  5\n", {"a": "1e8", "b": "true", "c": "5"}),  # quoted and block scalars
        ("a: !!str 5\nb: !!float 5\nc: !!map {d: !!seq [1]}\ne: ! 5", {"a": "5", "b": 5.0, "c": {"d": [1]}, "e": "5"}),
        ("a: &x {b: 1}\nc: *x", {"a": {"b": 1}, "c": {"b": 1}}),
    ],
)
def test_quotes_tags_and_aliases(text, value):
    assert value_of(text) == value


def test_tags_that_are_not_of_yaml_are_refused():
    assert message_of(compose, "a: !!python/name:os.system x", "f").endswith("!!python/name:os.system is not allowed")
    assert message_of(compose, "a: !mine [1]", "f") == "f:1:4: tag !mine is not allowed"
    assert message_of(compose, "a: !!int x", "f") == "f:1:4: 'x' is not of the type !!int"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "f.yaml: empty file"),
        ("# only a comment\n", "f.yaml: empty file"),
        ("---\n", "f.yaml: empty file"),
        ("- 1\n- 2\n", "f.yaml:1:1: expected a mapping (key: value), got a list"),
        ("# x\njust text\n", "f.yaml:2:1: expected a mapping (key: value), got 'just text'"),
        ("cable:\n\tends: 1\n", "f.yaml:2:1: a tab: YAML indents with spaces"),
        ("cable:\n  area: 1\n\tsag: 1\n", "f.yaml:3:1: a tab: YAML indents with spaces"),
        ("a: 1\nb: 2\na: 3\n", "f.yaml:3:1: key 'a' is given twice (first on line 1)"),
        ("c: {a: 1, b: 2, a: 3}\n", "f.yaml:1:17: key 'a' is given twice (first on line 1)"),
        ("1: x\n", 'f.yaml:1:1: a key must be text, got 1 (write "1", in quotes)'),
        ("[1, 2]: x\n", "f.yaml:1:1: a key must be text, got a list or a mapping"),
        ('"a\\nb": x\n', "f.yaml:1:1: a key is text on one line, got 'a\\nb'"),
        ("a: 1\n---\nb: 2\n", "f.yaml:2:1: a second document ('---'): one file holds one document"),
        ("a: *x\n", "f.yaml:1:4: alias *x has no anchor &x above it"),
        ("a: &x [1, *x]\n", "f.yaml:1:4: an alias inside of what it repeats"),
        ("a: [1, 2\n", "f.yaml:1:4: list: expected ',' or ']' (is a bracket not closed?)"),
        ("a: {b: 1\n", "f.yaml:1:4: mapping: expected ',' or '}' (is a brace not closed?)"),
        ("a: 'x\n", "f.yaml:1:4: quoted text is not closed"),
        ("a: b: c\n", "f.yaml:1:5: ': ' is not allowed here (indentation? quotes around text with ': '?)"),
        ("a: 1\n b: 2\n", "f.yaml:2:3: ': ' is not allowed here (indentation? quotes around text with ': '?)"),
        ("  a: 1\nb: 2\n", "f.yaml:2:1: does not fit the lines above (check the indentation)"),
        ("a:\n  b: 1\n  c 2 kN\n  d: 3\n", "f.yaml:3:3: expected 'key: value'"),
        ("a: 1\nb:2\nc: 3\n", "f.yaml:2:1: expected 'key: value'"),
        ("a: @x\n", "f.yaml:1:4: text that begins with this character must be quoted"),
        ("a: 1\nb: \x00\n", "f.yaml:2:4: character U+0000 is not text (is this a YAML file?)"),
        ('a: "\\0"\n', "f.yaml:1:4: character U+0000 is not text"),
        (b"a: 1\nb: \xff\xfe\n", "f.yaml:2:4: byte 0xff is not UTF-8 text (is this a YAML file?)"),
        ("a: " + "9" * 500, "f.yaml:1:4: a number of 500 characters (at most 400)"),
    ],
)
def test_what_is_not_strict_yaml_is_refused_in_one_line(folder, content, message):
    assert message_of(read_document, write("f.yaml", content)) == message


def test_depth_and_size_are_bounded_also_through_aliases():
    chain = "a0: &a0 [1]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 2000))
    for text in ("a: " + "[" * 100_000, chain):
        assert f"nested more than {SCENE.nesting} deep" in message_of(compose, text, "f")
    lines = ["a: &a [x,x,x,x,x,x,x,x,x,x]"]
    lines += [f"{k}: &{k} [{','.join(['*' + j] * 10)}]" for j, k in zip("abcdefgh", "bcdefghi", strict=True)]
    assert "aliases repeat more than 100000 values" in message_of(compose, "\n".join(lines), "f")


def test_byte_order_mark_and_windows_line_ends_do_not_move_places(folder):
    document = read_document(write("f.yaml", b"\xef\xbb\xbfa: 1\r\nb:\r\n  c: 2\r\n"))
    assert document.value == {"a": 1, "b": {"c": 2}}
    assert document.where(("a",)) == "f.yaml:1:4"
    assert document.where(("b", "c")) == "f.yaml:3:6"
    assert document.where(("b", "c"), of_key=True) == "f.yaml:3:3"


def test_a_place_is_that_of_the_nearest_known_ancestor(folder):
    document = read_document(write("f.yaml", "é: [µ, {b: 2}]\n"))
    assert document.where(("é", 1, "b")) == "f.yaml:1:12"
    assert document.where(("é", 1, "missing", "deeper")) == "f.yaml:1:8"
    assert document.where(()) == document.where(("absent",)) == "f.yaml:1:1"


def test_what_cannot_be_opened_is_refused(folder, monkeypatch):
    assert message_of(read_document, "absent.yaml") == "absent.yaml: no such file"
    assert message_of(read_document, ".") == ".: a directory, not a file"
    in_words = r"a\\x00b: cannot be read \((stat: )?embedded null (byte|character in path)\)"  # as Python says it
    assert re.fullmatch(in_words, message_of(read_document, "a\0b"))
    assert message_of(read_document, write("f.yaml", b"a: " + b"x" * 10_000_000)) == "f.yaml: larger than 10 MB"
    monkeypatch.setattr(sys, "stdin", None)
    assert message_of(read_document, "-") == "<stdin>: cannot be read (closed)"


def test_dash_is_standard_input_with_bases_beside_the_working_directory(folder, monkeypatch):
    write("base.yaml", "a: 1\nb: 2\n")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"base: base.yaml\nb: 3\n")))
    document = read_document("-")
    assert (document.name, document.value) == ("<stdin>", {"a": 1, "b": 3})
    assert document.where(("b",)) == "<stdin>:2:4"
    assert document.where(("a",)) == "base.yaml:1:4"


def test_base_files_merge_deeply_in_a_chain_relative_to_each_file(folder):
    (folder / "sub").mkdir()
    write("sub/root.yaml", "cable: {sag: 1, loads: [1, 2]}\ngravity: 9.81\n")
    write("sub/middle.yaml", "base: root.yaml\ncable: {chord: 5, loads: [3]}\n")
    document = read_document(write("top.yaml", "base: sub/middle.yaml\ncable: {chord: 7}\ngravity: null\n"))
    assert document.value == {"cable": {"sag": 1, "loads": [3], "chord": 7}}
    assert document.where(("cable", "sag")) == "sub/root.yaml:1:14"
    assert document.where(("cable", "loads", 0)) == "sub/middle.yaml:2:27"
    assert document.where(("cable", "chord")) == "top.yaml:2:16"


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"f.yaml": "base: absent.yaml\n"}, "f.yaml:1:7: base: absent.yaml: no such file"),
        ({"f.yaml": "base: .\n"}, "f.yaml:1:7: base: .: a directory, not a file"),
        ({"f.yaml": "base: [1]\n"}, "f.yaml:1:7: base: expected the name of a file"),
        ({"f.yaml": "base: {gravity: 1}\n"},
         "f.yaml:1:7: base: expected the name of a file, got a mapping (write what it "
         "says into this file, or one of its own)"),
        ({"f.yaml": "base: /dev/null\n"},
         "f.yaml:1:7: base: /dev/null: cannot be read (a device or socket, not a file)"),
        ({"f.yaml": "base: f.yaml\n"}, "f.yaml:1:7: base: base files in a circle: f.yaml -> f.yaml"),
        ({"f.yaml": "a: 1\nbase: g.yaml\n", "g.yaml": "base: ./f.yaml\n"},
         "g.yaml:1:7: base: base files in a circle: f.yaml -> g.yaml -> ./f.yaml"),
        ({"f.yaml": "base: g.yaml\n", "g.yaml": "- 1\n"}, "g.yaml:1:1: expected a mapping (key: value), got a list"),
    ],
)  # fmt: skip
def test_a_wrong_base_is_refused_where_it_is_named(folder, files, message):
    for name, content in files.items():
        write(name, content)
    assert message_of(read_document, "f.yaml") == message


@pytest.mark.parametrize(
    ("lower", "upper", "merged"),
    [
        ({"area": 1}, {"diameter": 2}, {"diameter": 2}),
        ({"ends": 1}, {"chord": 2}, {"chord": 2}),
        ({"chord": 1, "inclination": 1}, {"chord": 2}, {"chord": 2, "inclination": 1}),
        ({"chord": 1, "inclination": 1}, {"ends": 2}, {"ends": 2}),
        ({"sag": 1}, {"preload": 2}, {"preload": 2}),
        ({"elastic_modulus": 1, "density": 1, "strength": 1}, {"material": "steel"}, {"material": "steel"}),
        ({"material": "steel"}, {"density": 1}, {"material": "steel", "density": 1}),
        ({"area": 1}, {"area": 2, "diameter": 3}, {"area": 2, "diameter": 3}),
        ({"area": 1}, {"diameter": None}, {"area": 1}),
    ],
)
def test_an_upper_layer_replaces_the_alternatives_of_a_lower_one(folder, lower, upper, merged):
    # JSON is YAML, and Python's own writer of it is independent of the reader under test.
    write("lower.yaml", json.dumps({"cable": lower}))
    on_file = read_document(write("upper.yaml", json.dumps({"base": "lower.yaml", "cable": upper})))
    by_set = read_document("lower.yaml").with_sets([(f"cable.{key}", value, "x") for key, value in upper.items()])
    assert on_file.value == by_set.value == {"cable": merged}


@pytest.mark.parametrize(
    ("lower", "key", "result"),
    [
        ("model: {elements: 4, order: 2, mass: lumped}", "model.accuracy", {"model": {"accuracy": 1}}),
        ("model: {accuracy: 4}", "model.order", {"model": {"order": 1}}),
        ("wind: {turbulence_rms: 4}", "wind.turbulence_intensity", {"wind": {"turbulence_intensity": 1}}),
        ("cable: {damping: {ratio: 4}}", "cable.damping.time", {"cable": {"damping": {"time": 1}}}),
        ("cable: {damping: {model: modal}}", "cable.damping.time", {"cable": {"damping": {"time": 1}}}),
        ("cable: {damping: {ratio: 4}}", "cable.damping.model", {"cable": {"damping": {"model": 1}}}),
        ("cable: {damping: {ratio: 4}}", "cable.damping", {"cable": {"damping": 1}}),
        ("a: 1", "gondola.mass", {"a": 1, "gondola": {"mass": 1}}),
        ("loads: [{at: 3}, {at: 4}]", "loads.1.at", {"loads": [{"at": 3}, {"at": 1}]}),
    ],
)
def test_set_replaces_alternatives_and_makes_mappings(folder, lower, key, result):
    document = read_document(write("f.yaml", lower))
    before = repr(document.value)
    changed = document.with_sets([(key, 1, "here")])
    assert changed.value == result
    assert changed.where(tuple(key.split("."))) == "here"
    assert repr(document.value) == before


def test_places_after_a_set(folder):
    document = read_document(write("f.yaml", "a: {b: 1, c: 2}\n")).with_sets([("d.e", {"f": 1}, lambda of_key: "late")])
    assert document.where(("d", "e", "f")) == document.where(("d",)) == "late"
    assert document.where(("d", "e"), of_key=True) == "late"
    assert document.where(("a", "c")) == "f.yaml:1:14"


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("a.b", "x: a.b: a is 1, which has no key b"),
        ("c.x", "x: c.x: c is a list: its items are c.0, c.1, ..."),
        ("c.2", "x: c.2: c has 2 items, counted from 0: there is no item 2"),
        ("a..b", "x: a..b: a key is written as names joined by dots, for example cable.area"),
        ("", "x: a key is written as names joined by dots, for example cable.area"),
    ],
)
def test_a_key_that_cannot_be_set_is_refused(folder, key, message):
    document = read_document(write("f.yaml", "a: 1\nc: [1, 2]\n"))
    assert message_of(document.with_sets, [(key, 5, "x")]) == message


@pytest.mark.parametrize(
    ("text", "key", "value"),
    [
        ("cable.diameter=3.7mm", "cable.diameter", "3.7mm"),
        ("a=3", "a", 3),
        ("a = 1e8", "a", 1e8),
        ("a=[1, 2, 3]", "a", [1, 2, 3]),
        ("a={auto: {gain_margin: 6 dB}}", "a", {"auto": {"gain_margin": "6 dB"}}),
        ("a=null", "a", None),
        ("a=b=c", "a", "b=c"),
    ],
)
def test_set_options_follow_the_rules_of_the_files(text, key, value):
    assert parse_set(text) == (key, value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("cable.area", "--set cable.area: expected key=value, for example cable.area=3 mm^2"),
        ("cable.area=", "--set cable.area: no value: expected key=value"),
        ("=3", "--set : a key is written as names joined by dots, for example cable.area"),
        ("a=[1", "--set a: list: expected ',' or ']' (is a bracket not closed?)"),
        ("a=\udcff", "--set a: character U+DCFF is not text (is this a YAML file?)"),
    ],
)
def test_a_wrong_set_option_is_refused(text, message):
    assert message_of(parse_set, text) == message


def test_a_key_of_very_many_names_is_refused():
    assert message_of(parse_set, ".".join("a" * 20_000) + "=1").endswith(": a key of 20000 names (at most 50)")


def test_set_options_are_one_layer_and_wrong_ones_are_reported_together(folder):
    document = read_document(write("f.yaml", "cable: {area: 1}\n"))
    assert apply_sets(document, ["cable.area=2", "cable.diameter=3"]).value == {"cable": {"area": 2, "diameter": 3}}
    assert message_of(apply_sets, document, ["a", "b=1", "b=2"]).count("\n") == 1
    assert apply_sets(document, ()).value == document.value


_YAML_LIKE = st.lists(
    st.sampled_from(["a", "b", ": ", ":\n", "\n", "  ", "- ", "[", "]", "{", "}", ", ", "&x ", "*x", "'", '"', "!!int"])
    | st.sampled_from(["\t", "#", "|", ">", "---", "...", "%", "? ", "<<", "\\", "\r\n", "é", "~", "!", "@", "\u2028"])
    | st.text(max_size=3),
    max_size=40,
).map("".join)


@pytest.mark.parametrize(
    "contents", [st.binary(max_size=200), _YAML_LIKE.map(lambda text: text.encode("utf-8", "surrogatepass"))]
)
def test_any_file_gives_a_document_or_a_scene_error(tmp_path, contents):
    @given(content=contents)
    def read(content):
        (tmp_path / "any.yaml").write_bytes(content)
        mistakes = [None]
        try:
            read_file(tmp_path / "any.yaml")
        except SceneError as error:  # any other exception fails the test
            mistakes = error.mistakes
        assert mistakes
        assert all("\n" not in str(mistake) for mistake in mistakes)

    read()


@given(text=st.text(max_size=40) | _YAML_LIKE)
def test_any_set_option_gives_a_value_or_a_scene_error(text):
    for option in (text, "a=" + text):
        with contextlib.suppress(SceneError):
            parse_set(option)


def test_a_fifo_is_read_as_a_file_once_a_program_writes_to_it(folder):
    os.mkfifo("scene.yaml")
    with subprocess.Popen(["sh", "-c", "echo 'gravity: 9.81' > scene.yaml"]):
        assert read_file("scene.yaml").value == {"gravity": 9.81}


@pytest.mark.skipif(not os.path.exists("/dev/fd"), reason="no such folder here")
def test_a_stream_names_files_of_the_working_directory(folder):
    """As standard input does: a shell passes `<(...)` as /dev/fd/N."""
    (folder / "base.yaml").write_text("gravity: 9.81\n", encoding="utf-8")
    reader, writer = os.pipe()
    os.write(writer, b"base: base.yaml\n")
    os.close(writer)
    try:
        assert read_document(f"/dev/fd/{reader}").value == {"gravity": 9.81}
    finally:
        os.close(reader)


def test_a_fifo_with_a_silent_writer_is_waited_for(folder, monkeypatch):
    """It writes only when nothing was there to be read, and the reader waits for more."""
    os.mkfifo("scene.yaml")
    waits, set_blocking = threading.Event(), os.set_blocking

    def write_later(writer):
        assert waits.wait(60)
        os.write(writer, b"gravity: 9.81\n")
        os.close(writer)

    def nothing_yet(*_):
        threading.Thread(target=write_later, args=[os.open("scene.yaml", os.O_WRONLY)]).start()
        return [], [], []

    monkeypatch.setattr(document_module.select, "select", nothing_yet)
    monkeypatch.setattr(os, "set_blocking", lambda *arguments: (set_blocking(*arguments), waits.set()))
    assert read_file("scene.yaml").value == {"gravity": 9.81}


def test_a_fifo_that_no_program_writes_to_is_refused(folder, monkeypatch):
    monkeypatch.setattr(type(SCENE), "fifo_wait", 0.0)
    os.mkfifo("scene.yaml")
    message = "scene.yaml: cannot be read (a FIFO that no program writes to; waited 0 s)"
    assert message_of(read_file, "scene.yaml") == message


def test_a_device_is_no_file():
    assert message_of(read_file, "/dev/zero") == "/dev/zero: cannot be read (a device or socket, not a file)"
