"""The reference of keys: complete, described, with units."""

import pytest
import reference
from command import refusal, table_of

from cablestudy.cli.help import COMMANDS
from cablestudy.scene.schema import KINDS, NO_UNIT, REQUIRED, keys_of, scene_schema, study_schema, suspension_schema
from cablestudy.scene.units import DIMENSIONS
from cablestudy.study.columns import columns_table

SCHEMAS = {"scene": scene_schema, "suspension": suspension_schema, "study": study_schema}


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_has_a_meaning_and_every_number_a_unit(kind):
    keys = keys_of(kind)
    assert len({key.key for key in keys}) == len(keys) > 20
    for key in keys:
        assert len(key.meaning) > 7, key.key
        assert key.unit in {*DIMENSIONS, NO_UNIT}, key.key
        number = key.default.replace(".", "").replace("-", "").isdigit() or " to " in key.allowed
        assert not number or key.unit, key.key


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_of_the_schema_is_listed(kind):
    """The schema is walked on its own; names of its properties are the last parts of the keys."""
    schema = SCHEMAS[kind]()
    listed = {key.key.rpartition(".")[2] for key in keys_of(kind)}
    tables = [schema, *schema["$defs"].values()]
    names = {name for table in tables for name in table.get("properties", {})}
    assert len(names) > 15
    assert names <= listed
    assert listed <= names | {"KEY", "NAME"}  # which stand for any key and any name


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("scene", ("gravity", "m/s^2", "9.81", "0 to 1e+06")),
        ("scene", ("cable.diameter", "m", "", "1e-09 to 100000")),
        ("scene", ("cable.loads.N.fraction", "-", "", "between 0 and 1")),
        ("scene", ("cable.tension.at", "", REQUIRED, "end_1, end_2, horizontal, mean, max")),
        ("scene", ("winch.controller.notch.frequency", "Hz", "coupled", "1e-09 to 1e+09, coupled, static")),
        ("scene", ("ground", "m", "", "-1e+09 to 1e+09")),
        ("suspension", ("bodies.NAME.attitude", "rad", "[0, 0, 0]", "-360 deg to 360 deg (a bare number is rad)")),
        ("suspension", ("bodies.NAME.attachments", "m", "", "-1e+09 to 1e+09")),
        ("suspension", ("cables.NAME.from", "m", REQUIRED, "-1e+09 to 1e+09")),
        ("suspension", ("tensions.reference", "N", "", "1e-24 to 1e+24")),
        ("suspension", ("actuators.NAME.momentum", "N m s", REQUIRED, "1e-24 to 1e+24")),
        ("study", ("sample.seed", "-", "0", "0 to 9223372036854775807")),
        ("study", ("vary.N.KEY.spacing", "", "linear", "linear, log")),
    ],
)
def test_some_keys(kind, expected):
    found = {key.key: (key.key, key.unit, key.default, key.allowed) for key in keys_of(kind)}
    assert found[expected[0]] == expected


def test_curves_of_a_material_stand_beside_its_modulus():
    """Of a cable they take its place; a cable of a material without `state` is linear, with the material's modulus."""
    meanings = {key.key: key.meaning for key in keys_of("scene")}
    assert "instead of elastic_modulus" in meanings["cable.stress_strain"]
    assert "instead of" not in meanings["materials.NAME.stress_strain"]


def test_keys_that_cables_share_are_listed_once():
    keys = {key.key for key in keys_of("suspension")}
    assert {"cable.diameter", "cable.damping.viscous", "cables.NAME.from", "cables.NAME.to"} <= keys
    assert {key for key in keys if key.startswith("cables.NAME.")} == {"cables.NAME.from", "cables.NAME.to"}


def test_the_command_shows_a_key_and_those_below():
    for (kind, key), shown in {
        ("scene", "cable.tension"): ["cable.tension", "cable.tension.at", "cable.tension.value"],
        ("scene", "cable.loads.0.at"): ["cable.loads.N.at"],
        ("suspension", "bodies.camera.mass"): ["bodies.NAME.mass"],
    }.items():
        assert [row["key"] for row in table_of("keys", kind, key)] == shown
    rows = table_of("keys", "scene")
    assert len(rows) == len(keys_of("scene"))
    assert list(rows[0]) == ["key", "unit", "default", "meaning", "allowed"]


def test_the_command_columns_shows_those_with_a_text_in_their_names():
    everything = table_of("columns")
    for text in ("sag", "end stiffness", "_rms_mm"):
        asked = text.replace(" ", "_")
        expected = [row for row in everything if asked in row["column"]]
        assert 1 < len(expected) < len(everything)
        assert table_of("columns", text) == expected
    assert [row["column"] for row in table_of("columns", "inplane_frequency_3")] == ["inplane_frequency_3_Hz"]
    hints = {"sagg": "did you mean sag?", "safety factor": "did you mean utilisation?", "xyzzy": "lists"}
    for text, hint in hints.items():
        assert hint in refusal("columns", text)


def test_an_unknown_key():
    message = "cable.diametre: unknown key (did you mean cable.diameter?)"
    assert refusal("keys", "scene", "cable.diametre") == message
    assert "'bridge' is not one of" in refusal("keys", "bridge")


def test_the_pages_of_the_reference_have_all_keys_columns_and_commands():
    pages = reference.pages()
    for kind in KINDS:
        page = pages[f"keys-{kind}.md"]
        for key in keys_of(kind):
            assert f"`{key.key.rpartition('.')[2]}`" in page
            assert reference.plain(key.meaning) in page
    for row in columns_table().rows:
        assert f"| `{row['column']}` | " in pages["columns.md"]
        assert row["meaning"]
    for name in COMMANDS:
        assert f"\n   :prog: cablestudy {name}\n" in pages["options.rst"]
    assert ":members:" in pages["interface.rst"]


def test_the_meaning_of_a_column_is_understood_alone():
    """It says what it is before it says of what, and points to no other line of the table."""
    for row in columns_table().rows:
        first = row["meaning"].split()[0]
        assert first not in ("of", "at", "by", "in", "on", "with", "where", "that", "the", "its", "it"), row["column"]
        assert " of it " not in row["meaning"], row["column"]


def test_tables_of_the_reference_keep_what_is_written():
    table = reference.table_of(("a", "b"), [["`x|y`", "K_E <1> [m] | 2*3"]])
    assert table.splitlines()[-1] == r"| `x|y` | K\_E \<1\> \[m\] \| 2\*3 |"
    assert reference.name_of("cases", {"cases.NAME": []}) == "[`cases`](#casesname)"
    assert reference.name_of("cable.sag", {"cable": []}) == "`sag`"
