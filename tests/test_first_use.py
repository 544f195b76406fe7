"""What a first-time user meets: rows with their names, and messages that say what to write instead."""

import math

import pytest
from command import CARLINA, CONFIGS, refusal, rows_of, run, study_file, table_of, with_sets, write

import cablestudy as cs

GUY = CONFIGS / "guy.yaml"
pytestmark = pytest.mark.usefixtures("folder")

CASES = ["everyday", "cold", "hot", "ice", "storm", "ice-and-wind"]


@pytest.mark.parametrize("style", ["csv", "json", "jsonl"])
def test_chosen_columns_keep_what_names_the_rows(style):
    def names(*arguments):
        return [next(iter(row.items())) for row in rows_of(run(*arguments, "--format", style).out, style)]

    assert names("static", GUY, "--case", "all", "--columns", "sag") == [("case", case) for case in CASES]
    modes = names("modes", GUY, "--case", "all", "-n", 2, "--columns", "frequency")
    assert modes == [("case", case) for case in CASES for _ in range(2)]
    net = "static", CONFIGS / "suspensions" / "cable-robot.yaml", "--table", "bodies"
    assert names(*net, "--columns", "x") == [("name", "platform")]
    assert list(rows_of(run(*net, "--columns", "x,name", "--format", style).out, style)[0]) == ["x_m", "name"]


def test_markdown_of_chosen_columns_names_the_cases():
    heading = run("static", GUY, "--case", "all", "--columns", "sag", "--quiet").out.splitlines()[0]
    assert [word.strip() for word in heading.strip("|").split("|")] == ["quantity", *CASES, "unit"]


def guy(*changes):
    """The guy with parts of its text replaced, written to a file; its name."""
    text = GUY.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return write("guy.yaml", text)


def study(text):
    """A study upon the guy, written to a file; its name."""
    return study_file(".", text, GUY)


THICK = ["guy.yaml:5:13: cable.diameter: warning: 16 without a unit is 16 m",
         "guy.yaml:13:48: cases.ice.ice.thickness: warning: 20 without a unit is 20 m",
         "guy.yaml:15:57: cases.ice-and-wind.ice.thickness: warning: 20 without a unit is 20 m"]  # fmt: skip


def test_large_lengths_without_a_unit_are_told():
    scene = guy(("diameter: 16 mm", "diameter: 16"), ("thickness: 20 mm", "thickness: 20"))
    assert run("static", scene).lines == THICK
    assert run("static", scene, "--case", "all", "--columns", "mass").lines == THICK
    assert run("validate", scene).lines == THICK
    assert run("static", scene, "--quiet").err == ""
    found = run("find", scene, "mass = 100 t", "--by", "cable.diameter", "--between", "1 mm:10 m").lines
    assert found == THICK
    study("vary: [{cable.diameter: [16, 18]}]\ncolumns: [mass]\n")
    places = {"2:26": 16, "2:30": 18}
    told = "cable.diameter: warning: {0} without a unit is {0} m"
    lines = [f"study.yaml:{at}: {told.format(thick)}" for at, thick in places.items()]
    assert run("sweep", "study.yaml", "--no-write").lines == run("validate", "study.yaml").lines == lines
    study("columns: [mass]\n")
    with_comma = run("sweep", "study.yaml", "--dry-run", "--vary", "cable.diameter=1,85 mm").lines  # two values
    assert with_comma == ["--vary cable.diameter: warning: 1 without a unit is 1 m"]


def test_what_may_be_why_a_suspension_hangs_nowhere_is_told(folder):
    run("new", "suspension", "camera.yaml")
    path = folder / "camera.yaml"
    write(path, path.read_text().replace("diameter: 4 mm", "diameter: 4"))
    told = "camera.yaml:7:13: cable.diameter: warning: 4 without a unit is 4 m"
    for command in ("static", "modes"):
        lines = run(command, path.name, code=3).lines
        assert lines[0] == told
        assert "no tensions in" in lines[-1]
        assert run(command, path.name, "--quiet", code=3).lines == lines[-1:]
    scene = cs.load(path.name)
    for _ in range(2):
        with pytest.raises(cs.NoSolutionError) as refused:
            scene.static()
        assert refused.value.__notes__.count(told) == 1


def test_only_the_first_likely_mistakes_of_a_study_are_told():
    lines = run("validate", study(f"vary: [{{cable.diameter: {[*range(16, 24)]}}}]\ncolumns: [mass]\n")).lines
    assert len(lines) == 4
    assert lines[-1] == "and 5 more like these"


def test_an_intensity_of_turbulence_without_a_percent_sign_is_told():
    told = "--set wind.turbulence_intensity: warning: 15 without a unit is 1500 %"
    assert told in run("static", CARLINA, "--set", "wind.turbulence_intensity=15").lines
    assert run("static", CARLINA, "--set", "wind.turbulence_intensity=15 %").err == ""


def test_temperatures_near_absolute_zero_are_told():
    told = "--set cases.cold.temperature: warning: 75 without a unit is 75 K, -198.15 degC"
    for temperature, lines in (("75", [told]), ("275", []), ("-60 degC", [])):
        change = f"cases.cold.temperature={temperature}"
        assert run("static", GUY, "--case", "cold", "--set", change).lines == lines


def test_a_limit_of_a_utilisation_without_a_percent_sign_is_told():
    limits = "--limits", "--set"
    for that in ("utilisation <= 60", "{that: 60 >= utilisation}"):
        (told,) = run("static", GUY, *limits, f"limits={{a: {that}}}").lines
        assert told.endswith(": warning: 60 without a unit is 6000 %")
    for that in ("utilisation <= 60 %", "utilisation <= 0.6", "utilisation <= 1.2", "sag <= 60"):
        assert run("static", GUY, *limits, f"limits={{a: {that}}}").err == ""


ROPES = """
a-14: {axial_stiffness: 9 MN, mass_per_length: 0.9 kg/m, breaking_force: 120 kN, area: 90 mm^2, diameter: 14 mm}
a-16: {axial_stiffness: 12 MN, mass_per_length: 1.2 kg/m, breaking_force: 160 kN, area: 118 mm^2, diameter: 16 mm}
"""


def test_a_rope_at_another_size_than_its_own_is_told(folder):
    write(folder / "ropes.yaml", ROPES)
    line = "cable: {chord: 100 m, diameter: 16 mm, preload: 5 kN, material: a-16}\nmaterials: ropes.yaml\n"
    write(folder / "line.yaml", line)

    def masses(more):
        """Per length, and what is said."""
        vary = f"vary: [{{cable.material: [a-14, a-16]{more}}}]\n"
        name = study_file(".", f"{vary}columns: [mass, unstretched_length]\n", "line.yaml")
        outcome = run("sweep", name, "--no-write", "--format", "csv")
        rows = rows_of(outcome.out, "csv")
        return [float(row["mass_kg"]) / float(row["unstretched_length_m"]) for row in rows], outcome.lines

    scaled = "warning: a-14 has 14 mm, and is scaled to another size here (diameter: null takes its own)"
    thick = 0.9 * (math.pi * 16**2 / 4 * (90 / (math.pi * 14**2 / 4))) / 90  # as much of the circle is metal
    assert masses("") == (pytest.approx([thick, 1.2]), [f"line.yaml:1:33: cable.diameter: {scaled}"])
    assert masses(", cable.diameter: [null, null]") == (pytest.approx([0.9, 1.2]), [])


def test_a_rope_at_the_size_of_the_other_cables_is_told_once(folder):
    cables = "a: {from: [0, 0, 0], to: [9 m, 0, 0]}\n  b: {from: [0, 0, 5 m], to: [9 m, 0, 5 m], material: a-14}\n"
    more = "  c: {from: [0, 0, 7 m], to: [9 m, 0, 7 m], material: a-14}\n"
    shared = "cable: {material: a-16, diameter: 16 mm, preload: 5 kN}\n"
    ropes = ROPES.strip().replace("a-", "  a-")
    write(folder / "ropes.yaml", f"materials:\n{ropes}\n{shared}cables:\n  {cables}{more}")
    told = "ropes.yaml:7:55: cables.b.material: warning: a-14 has 14 mm, and is scaled to another size here"
    columns = "--columns", "mass,unstretched_length"
    outcome = run("static", "ropes.yaml", "--table", "cables", *columns, "--format", "csv")
    assert outcome.lines == [f"{told} (the diameter of the table cable, as for c; give it a diameter of its own)"]
    masses = [float(row["mass_kg"]) / float(row["unstretched_length_m"]) for row in rows_of(outcome.out, "csv")]
    assert masses == pytest.approx([1.2, 0.9 * (16 / 14) ** 2, 0.9 * (16 / 14) ** 2])
    assert run("static", "ropes.yaml", "--set", "cables.b.diameter=14 mm", "--set", "cables.c.diameter=14 mm").err == ""


def test_a_thick_cable_of_solid_wire_is_told():
    solid = "warning: a solid bar of steel; a rope has a fill_factor below 1 ('cablestudy materials' lists ropes)"

    def said(*changes, **more):
        return run("static", GUY, *with_sets(*changes), "--columns", "mass", **more).err

    assert said("cable.material=steel") == f"{GUY}:5:13: cable.diameter: {solid}\n"
    assert said("cable.material=steel", "cable.fill_factor=0.6") == ""
    assert said("cable.material=steel", "cable.diameter=4 mm") == ""
    ropes = "did you mean steel?; ropes: spiral-strand, guy-strand, locked-coil, 6x36-iwrc"
    assert ropes in said("cable.material=steel rope", code=2)


def test_find_in_each_load_case_is_told():
    find = "find: {column: sag, value: 1 m, by: cable.preload}\n"
    study(f"vary: [{{case: [cold, ice]}}]\n{find}columns: [mass]\n")
    told = "study.yaml:3:37: cable.preload is solved for in each load case alone, so that each row is another cable;"
    assert [line.startswith(told) for line in run("sweep", "study.yaml", "--no-write").lines] == [True]


def test_a_load_case_that_varies_and_no_row_is_in_is_told():
    vary = "vary: [{cases.cold.temperature: [-10 degC, 15 degC]}]\ncolumns: [sag]\n"
    told = "cases.cold.temperature varies, and no row is in the load case cold: set: {case: cold} chooses it"
    assert run("sweep", study(vary), "--no-write").lines == run("validate", "study.yaml").lines == [told]
    assert run("sweep", study(f"set: {{case: cold}}\n{vary}"), "--no-write").lines == []


def test_the_response_that_is_shown_may_be_named():
    asked = ["ssm", CONFIGS / "carlina.yaml", "--response", "0.1Hz:1Hz:3", "--output", "gondola_position"]
    for attached, shown in (("gondola", "winch"), ("loop", "force_gondola")):
        plain = run(*asked[:4], "--with", attached).out
        assert run(*asked, "--with", attached, "--input", shown).out == plain
        other = run(*asked, "--with", attached, "--input", "end_1_x", code=2).err
        assert other.startswith("--input end_1_x: unknown (")
        assert shown in other


def test_a_search_without_a_solution_says_how_to_search_elsewhere():
    asked = ["find", CONFIGS / "slack.yaml", "max_tension = 30 N", "--by", "cable.unstretched_length"]
    shortest = 0.2 * 185.8  # the shortest cable that is allowed, a fifth of the distance of its ends
    assert run(*asked, code=3).err.endswith(f" N (at {shortest:.4g} m); --between LOW:HIGH searches elsewhere\n")
    assert "searches elsewhere" not in run(*asked, "--between", "190 m:200 m", code=3).err


def test_a_condition_without_a_unit_that_divides_nothing_is_told():
    study("vary: [{cable.diameter: [14 mm, 18 mm]}]\ncolumns: [mass]\n")
    told = ["--where: without a unit 16 is 16 m"]
    for condition, notes, rows in (("< 16", told, 2), ("> 16", told, 0), ("< 0.016", [], 1), ("< 99 mm", [], 2)):
        lines = run("sweep", "study.yaml", "--no-write", "--where", f"cable.diameter {condition}").lines
        assert lines == [*notes, f"selected: {rows} of 2 rows"]


def test_lengths_with_a_unit_and_small_ones_are_not_told():
    assert run("validate", GUY).err == ""
    scene = guy(("diameter: 16 mm", "diameter: 0.016"), ("thickness: 20 mm", "thickness: 2.5 m"))
    assert run("validate", scene).err == ""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("cases.hot.temperature=-30", "must be from 60 K to 5000 K (a bare number is K: write 15 degC), got -30"),
        ("cases.hot.temperature=15", "must be from 60 K to 5000 K (a bare number is K: write 15 degC), got 15"),
        ("cases.hot.temperature=-30 C", 'got "-30 C" (did you mean degC?)'),
        ("cases.hot.temperature=80 F", 'got "80 F" (did you mean degF?)'),
    ],
)
def test_temperatures_say_what_to_write(change, message):
    assert message in run("static", GUY, "--set", change, code=2).err


@pytest.mark.parametrize("command", ["static", "modes"])
@pytest.mark.parametrize(("preload", "share"), [("10", "10 %"), ("0.1", "10 %"), ("12.5", "12.5 %")])
def test_a_preload_that_looks_like_a_share(command, preload, share):
    err = run(command, GUY, "--set", f"cable.preload={preload}", code=3).err
    assert err.endswith(f' m ({share} of the breaking force: write "{share}")\n')


@pytest.mark.parametrize("preload", ["10 N", "101"])
def test_a_small_preload_that_is_meant_has_no_hint(preload):
    err = run("static", GUY, "--set", f"cable.preload={preload}", code=3).err
    assert "below the least" in err
    assert "breaking force" not in err


def test_a_key_that_is_a_number():
    expected = 'guy.yaml:11:3: a key must be text, got -20 (write "-20", in quotes)'
    assert refusal("static", guy(("  cold:", "  -20:"))) == expected


def test_validate_counts_load_cases_and_mistakes():
    assert table_of("validate", GUY)[0]["cases"] == len(CASES)
    for changes, status in ((["cable.preload=0"], "1 mistake"), (["cable.preload=0", "gravity=-1"], "2 mistakes")):
        assert table_of("validate", GUY, *with_sets(*changes), code=2)[0]["status"] == status


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["find", GUY, "load_sag <= 8 m", "--by", "cable.preload"],
         'find takes =, not <=: write "load_sag = 8 m"'),
        (["find", GUY, "sag==8 m", "--by", "cable.preload"], 'find takes =, not ==: write "sag = 8 m"'),
        (["find", GUY, "sag = 1 m = 2 m", "--by", "cable.preload"],
         "expected COLUMN = VALUE, for example 'sag = 2 m', got \"sag = 1 m = 2 m\""),
        (["find", GUY, "sag = 1 m", "--by", "preload"], "--by preload: unknown key (did you mean cable.preload?)"),
        (["static", CONFIGS / "suspensions" / "mast-levels.yaml", "--set", "cables.west-low.from=esat"],
         '--set cables.west-low.from: unknown end "esat" (did you mean east?)'),
        (["static", GUY, "--set", "preload=8 %"], "--set preload: unknown key (did you mean cable.preload?)"),
        (["static", CONFIGS / "suspensions" / "cable-robot.yaml", "--set", "diameter=8 mm"],
         "--set diameter: unknown key (did you mean cable.diameter?)"),
        (["static", GUY, "--case", "winter"],
         '--case winter: unknown case "winter" (allowed: everyday, cold, hot, ice, storm, ice-and-wind)'),
        (["find", GUY, "sag = 1 m", "--by", "cable.preload", "--case", "col"],
         '--case col: unknown case "col" (did you mean cold?)'),
        (["static", GUY, "--case", "ice", "--set", "case=hot"], "--case ice: given twice, also as --set case"),
        (["static", GUY, "--set", "vary=[]"],
         "--set vary: unknown key of a scene: it is one of a study, of which set and --set change the scene"),
        (["sweep", CONFIGS / "preload.yaml", "--no-write", "--set", "vary=[]"],
         "--set vary: unknown key of a scene: it is one of a study, of which set and --set change the scene"),
        (["static", GUY, "--columns", "cable_frequency"],
         "--columns: the table has no column 'cable_frequency' "
         "(it is a column of another command, or of a study; 'cablestudy columns' lists all)"),
    ],
)  # fmt: skip
def test_wrong_words_say_what_to_write(words, message):
    assert refusal(*words) == message


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("--by", ["find", GUY, "sag = 1 m", "--by", "cable.preload", "--by", "cable.diameter"]),
        ("--where", ["show", CONFIGS / "preload.yaml", "--where", "sag < 1", "--where", "sag > 0"]),
        ("-n", ["modes", GUY, "-n", "2", "--format", "csv", "-n", "3"]),
        ("--top", ["keys", "scene", "--top", "2", "--top=3"]),
    ],
)
def test_an_option_with_one_value_is_not_given_twice(option, words):
    assert f"{option} is given twice, and takes one value" in refusal(*words)


def test_flags_and_repeatable_options_may_be_given_twice():
    words = "static", GUY, "--explain", "--explain", "--set", "cable.preload=2 kN", "--set", "gravity=9.8"
    assert run(*words).code == 0


def test_a_goal_as_headings_write_it():
    by = "--by", "cable.preload", "--between", "0.9 kN:5 kN", "--format", "json", "--quiet"
    assert run("find", GUY, "end stiffness yy = 8 N/m", *by).out == run("find", GUY, "end_stiffness_yy=8 N/m", *by).out


@pytest.mark.parametrize("scene", [GUY, CONFIGS / "suspensions" / "trifilar.yaml"])
def test_a_scene_in_place_of_a_study_says_how_to_make_one(scene):
    line = refusal("sweep", scene)
    assert "this is a scene (it has the key cable" in line
    assert line.endswith(
        f"a study of it is a file with the line base: {scene.name} ('cablestudy new study' writes one)"
    )


def test_wrong_commands_and_numbers():
    assert "No such command 'statik': did you mean static? ('" in run("statik", GUY, code=2).err
    assert "No such command 'xyz' ('" in run("xyz", GUY, code=2).err
    assert "'five' is not a whole number" in run("modes", GUY, "-n", "five", code=2).err
