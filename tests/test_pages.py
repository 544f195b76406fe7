"""The command report: one page of HTML with all tables, pictures, errors and reasons, that loads nothing."""

import json
import re
from contextlib import nullcontext

import pytest
from command import CARLINA, CONFIGS, edit_rows, refusal, refused_in_one_line, run, study_file, table_of, write
from html_page import Page
from matplotlib.figure import Figure
from picture import undrawn
from scenes import CHORD, PAPER, Twin

import cablestudy as cs
from cablestudy.errors import SceneError
from cablestudy.interface.files import is_column
from cablestudy.pages.page import inline_picture
from cablestudy.pages.results import ONLY_IN_TABLES, check_columns
from cablestudy.pages.tables import error_text, table_html
from cablestudy.pages.tolerances import PAGES
from cablestudy.pages.user_input import flat, written
from cablestudy.study.notes import above_accuracy
from cablestudy.study.table import Field, Table
from cablestudy.sweeps import run as sweeps_run

GUY, ZIPLINE = (str(CONFIGS / f"{name}.yaml") for name in ("guy", "zipline"))
TRIFILAR = str(CONFIGS / "suspensions" / "trifilar.yaml")


def report(folder, *arguments, code=0, out="page.html", drawn=False):
    """The page that the command writes, its pictures drawn or not, and what the command prints."""
    with nullcontext() if drawn else undrawn():
        outcome = run("report", *arguments, "--out", out, code=code)
    assert outcome.out == ""
    return Page((folder / out).read_text(encoding="utf-8")), outcome


def assert_in_order(page):
    """A page that is well-formed, accessible and loads nothing."""
    assert page.open == []
    assert len(page.names) == len(set(page.names))
    outside = [value for _, value in page.links if not value.startswith(("#", "data:image/png;base64,"))]
    assert outside == []
    assert {value[1:] for _, value in page.links if value.startswith("#")} <= set(page.names)
    assert not [tag for tag, _ in page.attributes if tag in ("script", "link", "img", "iframe", "object")]
    assert "http:" not in page.html
    assert "https:" not in page.html
    assert page.headings[0] == 1
    assert page.headings.count(1) == 1
    assert all(after <= before + 1 for before, after in zip(page.headings, page.headings[1:], strict=False))
    assert dict(page.attributes)["html"] == {"lang": "en"}
    assert len(page.texts["title"]) == 1
    for tag, known in page.attributes:
        assert tag != "th" or known["scope"] in ("row", "col")
        assert tag != "svg" or (known["role"] == "img" and known["aria-label"])
    for rows in page.tables.values():
        assert len({len(row) for row in rows}) == 1
        assert all(rows[0])


def assert_rounded(page):
    """No number has more than four digits that say something, but for those that the user wrote."""
    written_by_user = ("Main numbers", "Changed", "Connections", "Load cases", "Where the numbers come from")
    for caption, rows in page.tables.items():
        for cell in (cell for row in rows if caption not in written_by_user for cell in row):
            for number in re.findall(r"(?<![\w.])-?\d+\.\d+(?:e[-+]\d+)?", cell.partition("printed")[0]):
                digits = re.sub(r"e.*|[-.]", "", number).strip("0")
                assert len(digits) <= 4, f"{caption}: {cell}"


@pytest.mark.parametrize(
    ("scene", "captions", "pictures"),
    [
        (ZIPLINE, ("Statics", "The lowest modes"), 2),
        (GUY, ("Statics, reference state", "Statics in each load case", "Load cases"), 3),
        (TRIFILAR, ("Connections", "Cables", "The lowest modes"), 2),
    ],
)
def test_a_page_of_a_scene_has_its_tables_and_pictures(folder, scene, captions, pictures):
    page, outcome = report(folder, scene, drawn=scene == GUY)  # the others are drawn by test_pictures.py
    assert_in_order(page)
    assert_rounded(page)
    assert set(captions) <= page.tables.keys()
    assert len(page.texts["figcaption"]) == pictures == sum(tag == "svg" for tag, _ in page.attributes)
    assert page.texts["h2"][:2] == ["Scene", "Statics"]
    assert page.texts["h2"][-2:] == ["Models and errors", "Provenance"]
    assert outcome.lines[-1] == "written: page.html"


def test_the_numbers_are_those_of_the_commands_and_each_has_its_error(folder):
    page, _ = report(folder, ZIPLINE)
    (row,) = table_of("static", ZIPLINE)
    shown = page.quantities("Statics")
    assert shown.pop("quantity") == ["value", "unit", "estimated error"]
    assert len(shown) == len([name for name, value in row.items() if value is not None]) - 1  # no status ok
    errors = {error for title, (_, _, error) in shown.items() if title != "iterations"}
    assert "exact" in errors
    assert all(1e-12 <= float(error) < 1e-9 for error in errors - {"exact"})  # a vertical part of 8e-4 states 1.5e-10
    for title, name in (("sag", "sag_m"), ("max tension", "max_tension_N"), ("clearance", "clearance_m")):
        assert float(shown[title][0]) == pytest.approx(row[name], rel=5e-4)
        assert shown[title][1] == name.rpartition("_")[2]
    modes = table_of("modes", ZIPLINE)
    table = page.tables["The lowest modes"]
    place = table[0].index("frequency [Hz]")
    assert table[0][place + 1] == "estimated error"
    assert [float(line[place]) for line in table[1:]] == pytest.approx([m["frequency_Hz"] for m in modes], rel=5e-4)
    assert all(float(line[place + 1]) <= 1e-4 for line in table[1:])  # the accuracy that a scene has by default


def test_load_cases_stand_side_by_side_and_one_can_be_chosen(folder):
    page, _ = report(folder, GUY, "--case", "all")
    assert page.quantities("Statics in each load case")["quantity"][:3] == ["everyday", "cold", "hot"]
    assert "estimated error, at most" in page.quantities("Statics in each load case")
    one, _ = report(folder, GUY, "--case", "storm")
    assert "Load cases" not in one.texts["h2"]
    storm = page.quantities("Statics in each load case")["max tension"][4]
    assert one.quantities("Statics, load case storm")["max tension"][0] == storm


def test_a_suspension_has_its_load_cases_too(folder):
    text = f"base: {CONFIGS / 'suspensions' / 'mast-guys.yaml'}\ncable: {{expansion: 11.5e-6 1/K}}\n"
    write(folder / "mast.yaml", text + "cases: {warm: {temperature: 40 degC}, cold: {temperature: -20 degC}}\n")
    page, _ = report(folder, "mast.yaml")
    shown = page.quantities("Extremes of all cables")
    assert shown["quantity"][:2] == ["warm", "cold"]
    warm = table_of("static", "mast.yaml", "--case", "warm", "--table", "cables")
    assert float(shown["largest tension"][0]) == pytest.approx(max(row["max_tension_N"] for row in warm), rel=5e-4)
    assert float(shown["largest tension"][0]) < float(shown["largest tension"][1])


def test_notes_of_load_cases_are_with_the_models_and_warnings_at_the_head(folder):
    base = f"base: {CONFIGS / 'suspensions' / 'mast-guys.yaml'}\n"
    write(folder / "mast.yaml", f"{base}cases: {{broken: {{lost: [guy1]}}}}\n")
    page, _ = report(folder, "mast.yaml")
    (box,) = re.findall('<aside class="warnings".*?</aside>', page.html, re.DOTALL)
    assert "case broken: without guy1 it falls" in box
    note = "case broken: without guy1 the largest tension is more in guy2"
    assert note not in box
    assert note in page.html.partition("Models and errors</h2>")[2]
    assert "note: " not in page.html


def test_point_loads_have_a_table_and_one_of_the_load_cases(folder):
    """Their numbers are those of `static --table loads`; a load case without point loads is left out."""
    text = f"base: {ZIPLINE}\ncases: {{as-it-is: {{}}, two: {{loads: [{{at: 50 m, mass: 90 kg}}]}}}}\n"
    write(folder / "riders.yaml", text)
    page, _ = report(folder, "riders.yaml")
    ending = "; slope and tension on the sides of end 1 and end 2"
    alone = page.quantities(f"Point loads, reference state{ending}")
    assert alone["quantity"] == ["load1", "unit"]
    shown = page.quantities(f"Point loads in the load cases{ending}")
    assert shown["quantity"] == ["as-it-is", "two", "two", "unit"]
    assert shown["load"][:3] == ["load1", "load1", "load2"]
    rows = table_of("static", "riders.yaml", "--table", "loads", "--case", "all")
    for name, header in (("x", "x_m"), ("clearance", "clearance_m"), ("slope 2", "slope_2_deg")):
        assert [float(cell) for cell in shown[name][:3]] == pytest.approx([row[header] for row in rows], rel=5e-4)
        assert float(alone[name][0]) == float(shown[name][0])
    one, _ = report(folder, "riders.yaml", "--case", "two")
    assert one.quantities(f"Point loads, load case two{ending}")["quantity"] == ["load1", "load2", "unit"]
    of_one_case, _ = report(folder, GUY, "--set", "cases.cold.loads=[{fraction: 0.5, mass: 50 kg}]")
    assert of_one_case.quantities(f"Point loads in the load cases{ending}")["quantity"] == ["cold", "unit"]
    assert f"Point loads{ending}" not in of_one_case.tables


SPANS = """
cable: {diameter: 28 mm, elastic_modulus: 70 GPa, density: 3400 kg/m^3, expansion: 19e-6, breaking_force: 30 kN}
points: {a: [0, 0, 30], b: {at: [350, 0, 25], free: true, mass: 60}, top: [350, 0, 28], c: [700, 0, 30]}
cables:
  s1: {from: a, to: b, unstretched_length: 351}
  s2: {from: b, to: c, unstretched_length: 351}
  string: {from: top, to: b, unstretched_length: 3}
ground: 2
cases:
  {everyday: {temperature: 15 degC}, hot: {temperature: 70 degC}, ice: {temperature: 0 degC, ice: {thickness: 15 mm}}}
"""


def test_key_figures_are_of_the_load_case_that_governs_and_each_span_has_its_sag(folder):
    write(folder / "spans.yaml", SPANS)
    page, _ = report(folder, "spans.yaml")
    cases = {}
    for row in table_of("static", "spans.yaml", "--case", "all", "--table", "cables"):
        cases.setdefault(row["case"], {})[row["name"]] = row
    largest = {case: max(row["max_tension_N"] for row in rows.values()) for case, rows in cases.items()}
    lowest = {case: min(row["clearance_m"] for row in rows.values()) for case, rows in cases.items()}
    figures = dict(re.findall(r"<dt>([^<]*)</dt><dd>([0-9.]+)", page.html))
    assert max(largest, key=largest.get) == "ice"
    assert float(figures["largest tension, ice"]) == pytest.approx(largest["ice"], rel=5e-4)
    assert min(lowest, key=lowest.get) == "hot"
    assert float(figures["clearance, hot"]) == pytest.approx(lowest["hot"], rel=5e-4)
    for column, title in (("sag_m", "Sag of each cable [m]"), ("clearance_m", "Clearance of each cable [m]")):
        head, *lines = page.tables[title]
        assert head == ["cable", "everyday", "hot", "ice"]
        for name, *numbers in lines[:3]:
            assert list(map(float, numbers)) == pytest.approx([cases[case][name][column] for case in cases], rel=5e-4)


def test_what_options_change_is_told(folder):
    page, _ = report(folder, ZIPLINE, "--set", "cable.preload=12 kN", "--set", "ground=null", "--set", "gravity=9.8")
    preload, ground, gravity = page.tables["Changed"][1:]
    assert preload == ["cable.preload", "15 kN", "12 kN", "--set cable.preload"]
    assert ground[2] == "removed"
    assert gravity[:3] == ["gravity", "not given", "9.8"]
    assert "preload: 12 kN" in page.html


def test_two_pages_differ_in_the_date_and_the_duration_only(folder):
    for out in ("one.html", "two.html"):
        run("report", ZIPLINE, "--out", out, "--title", "same")
    one, two = ((folder / out).read_text().splitlines() for out in ("one.html", "two.html"))
    assert len(one) == len(two)
    differing = {
        re.search("(started|duration|command)", line)[0] for line, other in zip(one, two, strict=True) if line != other
    }
    assert "command" in differing
    assert differing <= {"started", "duration", "command"}


def test_tables_of_a_scene_have_the_columns_that_are_asked_for(folder):
    page, _ = report(folder, GUY, "--columns", "utilisation,sag_m,frequency")
    assert [row[0] for row in page.tables["Statics, reference state"]] == ["quantity", "utilisation", "sag"]
    assert page.tables["The lowest modes, reference state"][0] == ["row", "frequency [Hz]"]
    page, _ = report(folder, str(CONFIGS / "suspensions" / "mast-guys.yaml"), "--columns", "max_tension",
                     "--set", "cases={calm: {}, push: {forces: {top: [1 kN, 0, 0]}}}")  # fmt: skip
    assert page.tables["Cables, reference state"][0][:2] == ["name", "max tension [N]"]
    head, *_ = page.tables["Max tension of each cable [N]"]
    assert [cell for cell in head if cell != "estimated error"] == ["cable", "calm", "push"]
    assert not {"Free points: places, global axes", "Sag of each cable [m]"} & page.tables.keys()


@undrawn()
def test_the_rows_and_columns_of_a_study_are_those_that_are_asked_for(folder):
    """Rows keep their numbers: the guy at 5 and 8 % everyday, 1 and 3, hang by more than 0.8 m."""
    study = str(CONFIGS / "guy-preload.yaml")
    page, _ = report(folder, study, "--columns", "sag", "--where", "sag > 0.8 m")
    head, *rows = page.tables["One row for each case"]
    assert head[:3] == ["cable.preload [%]", "case", "sag [m]"]
    assert [row[:2] for row in rows] == [["5", "everyday"], ["8", "everyday"]]
    assert all(float(row[2]) > 0.8 for row in rows)
    assert "Selected: 2 of 10 rows." in page.texts["p"]
    (line,) = page.tables["Smallest and largest of each column"][1:]
    assert (line[0], line[2].partition(":")[0], line[4].partition(":")[0]) == ("sag [m]", "3", "1")
    told = run("report", study, "--columns", "foo,bar", "--where", "sagg > 1", code=2).err.splitlines()
    assert [line.split("'")[1] for line in told] == ["foo", "bar", "sagg"]
    page, _ = report(folder, study, "--where", "sag > 99 m")
    assert "Selected: 0 of 10 rows." in page.texts["p"]
    assert "figcaption" not in page.texts
    page, _ = report(folder, study, "--columns", "cable.preload")
    assert not {"Smallest and largest"} & set(page.texts["h2"])
    done = cs.report(study, out="same.html", columns=["sag"], where="sag > 0.8 m")
    assert Page((folder / done.path).read_text()).tables["One row for each case"] == [head, *rows]


def test_text_of_the_user_is_escaped(folder):
    write(
        folder / "a&b.yaml",
        "cable: {chord: 100 m, material: 'rope <a>&', diameter: 10 mm, preload: 10 kN}\n"
        "materials: {'rope <a>&': {elastic_modulus: 100 GPa, density: 5000, strength: 1 GPa}}\n"
        "cases: {'hot & <cold>': {temperature: 40 degC}}\n",
    )
    sets = ("--set", "materials.rope <a>&.expansion=1e-5 1/K")
    page, _ = report(folder, "a&b.yaml", "--title", '<script>alert("&")</script>', *sets)
    assert_in_order(page)
    assert page.texts["h1"] == page.texts["title"] == ['<script>alert("&")</script>']
    assert page.quantities("Main numbers")["cable.material"][1] == "rope <a>&"
    assert "hot & <cold>" in [row[0] for row in page.tables["Load cases"]]


def test_what_has_no_answer_is_told_and_the_rest_stands(folder):
    page, outcome = report(folder, CARLINA, "--set", "winch.controller.gain=50", code=3)
    assert_in_order(page)
    assert "the loop is unstable at 50 rad/s" in outcome.err
    assert any(line.startswith("No answer: the loop is unstable") for line in page.texts["p"])
    assert float(page.quantities("Statics")["sag"][0]) == pytest.approx(PAPER.tension_and_sag[1], rel=1e-3)
    assert float(page.quantities("Loop")["gain margin"][0]) < 0
    assert "gain margin" not in page.quantities("In the wind")


def test_a_scene_without_any_answer_has_a_page_that_says_why(folder):
    page, outcome = report(folder, CARLINA, "--set", "cable.preload=1 N", "--quiet", code=3)
    assert_in_order(page)
    assert "Provenance" in page.texts["h2"]
    assert sum(line.startswith("No answer: ") for line in page.texts["p"]) >= 2
    assert "No answer: as above" in page.texts["p"]
    assert not [tag for tag, _ in page.attributes if tag == "svg"]
    assert all(line.partition(": ")[2] in page.texts["li"] for line in outcome.lines)
    assert not any(line.startswith("written") for line in outcome.lines)


def test_a_loop_needs_no_wind(folder):
    """What `loop` says of a suspension without wind is in its page, with its picture."""
    name, sets = CONFIGS / "suspensions" / "fast-wind.yaml", ("--set", "wind=null")
    page, _ = report(folder, name, *sets)
    tables = json.loads(run("loop", name, *sets, "--format", "json").out)
    (row,), shown = tables["loop"]["rows"], page.quantities("Loop")
    assert float(shown["gain margin"][0]) == pytest.approx(row["gain_margin_dB"], rel=1e-3)
    coordinates = [row["coordinate"] for row in tables["coordinates"]["rows"]]
    assert [row[0] for row in page.tables["Measured coordinates of the loop"][1:]] == coordinates
    assert "Loop gain, sensitivity and margins" in page.texts["figcaption"]
    assert any(line.startswith("wind: the scene has none") for line in page.texts["li"])
    assert not any(line.startswith("No answer") for line in page.texts["p"])


@undrawn()
def test_a_study_is_computed_by_as_many_processes_as_asked(folder, monkeypatch):
    asked, compute = [], sweeps_run.compute_here
    monkeypatch.setattr(sweeps_run, "compute_here", lambda chunks, jobs: asked.append(jobs) or compute(chunks, 1))
    study = study_file(folder, "vary: [{gravity: [9, 10]}]\ncolumns: [sag]\n")
    report(folder, study, "--jobs", "2")
    report(folder, study)
    cs.report(study)
    cs.report(study, jobs=3)
    assert asked == [2, None, 1, 3]
    assert refusal("report", CARLINA, "--jobs", "2") == f"--jobs 2: no effect: {CARLINA} is a scene, not a study"


def test_a_study_has_its_rows_with_printed_values(folder):
    page, _ = report(folder, CONFIGS / "preload.yaml")
    assert_in_order(page)
    assert_rounded(page)
    head, *rows = page.tables["One row for each case"]
    assert len(rows) == 7  # six cases and the errors
    _, sag = Twin(CHORD, 0.0, 185.142, 24.2e-6).tension_and_sag
    assert rows[2][head.index("sag [m]")] == f"{sag:.4g}printed 0.243 ({sag - 0.243:.2g})"
    assert rows[-1][0] == "estimated error, at most"
    assert page.quantities("Smallest and largest of each column")["sag [m]"][1] == "1: cable.unstretched_length 183.2 m"
    assert len(page.texts["figcaption"]) == 1
    assert page.tables["Changed"][1][:3] == ["cable.area", "2.69 mm^2", "24.2 mm^2"]


def test_rows_without_an_answer_are_listed_with_their_reasons(folder):
    study = study_file(folder, "vary: [{cable.preload: [1 N, 1 kN]}]\ncolumns: [sag, status]\n")
    page, outcome = report(folder, study, code=3)
    assert "Rows without an answer" in page.texts["h2"]
    (reason,) = {row["status"] for row in table_of("sweep", study, "--no-write", code=3)} - {"ok"}
    assert any(reason in line for line in page.texts["li"])
    assert any(line.startswith("row 1 alone: cablestudy sweep") for line in page.texts["li"])
    assert any("1 of 2 rows" in line for line in outcome.lines)


def test_a_sampled_study_is_cut_and_has_its_sensitivities(folder):
    page, _ = report(folder, CONFIGS / "sensitivity.yaml")
    assert_in_order(page)
    (caption,) = (name for name in page.tables if name.startswith("One row for each case"))
    assert caption.endswith("50 of 320 rows, the first and the last; cablestudy sweep writes them all")
    assert "cable.preload: from 1 kN to 5 kN, 320 cases of the sample (saltelli)" in page.texts["li"]
    numbers = [row[0] for row in page.tables[caption]]
    assert numbers[1 : PAGES.end_rows + 1] == [str(number) for number in range(1, PAGES.end_rows + 1)]
    assert numbers[-2] == "320"
    assert len(page.texts["figcaption"]) == 2
    assert len(page.tables["Sobol's indices: the share of each column's variance that a key explains"]) == 10


def test_rows_that_a_sweep_has_stored_are_not_computed_again(folder):
    study = study_file(folder, "vary: [{cable.preload: [10 kN, 20 kN]}]\ncolumns: [sag, cable_frequency]\n", GUY)
    told = "The rows are those that a sweep has stored in results/study.rows.sqlite."
    before, _ = report(folder, study)
    assert told not in before.texts["p"]
    assert not (folder / "results").exists()
    run("sweep", study)
    edit_rows("results/study.rows.sqlite", "UPDATE about SET value = 0 WHERE name = 'finished'")
    after, _ = report(folder, study)
    assert told in after.texts["p"]
    assert after.tables["One row for each case"] == before.tables["One row for each case"]
    assert any("closed form" in line for line in after.texts["li"])
    changed, _ = report(folder, study, "--set", "cable.diameter=18 mm")
    assert told not in changed.texts["p"]
    write(folder / "results" / "study.rows.sqlite", "no database")
    assert told not in report(folder, study)[0].texts["p"]


@undrawn()
def test_one_more_dimension_and_standard_input(folder):
    text = f"base: {GUY}\nvary: [{{cable.preload: [8 %, 12 %]}}]\ncolumns: [sag]\n"
    run("report", "-", "--vary", "cable.diameter=14mm,16mm,18mm", stdin=text)
    page = Page((folder / "stdin.html").read_text())
    assert len(page.tables["One row for each case"]) == 7
    assert "cable.diameter: 14mm, 16mm, 18mm" in page.texts["li"]
    run("report", "-", "--vary", "gravity=9:10:11", "--out", "range.html", stdin=text)
    page = Page((folder / "range.html").read_text())
    assert "gravity: from 9 to 10, 11 values, spacing linear" in page.texts["li"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["absent.yaml"], "no such file"),
        ([GUY, "--columns", "gondola_rms"], "--columns: no table of the page has a column 'gondola_rms'"),
        ([GUY, "--columns", "sag,"], "expected names joined by commas"),
        ([GUY, "--where", "sag < 1 m"], "--where sag < 1 m: no effect: "),
        ([CONFIGS / "guy-preload.yaml", "--columns", "sagg"], "--columns: unknown column 'sagg'"),
        ([CONFIGS / "guy-preload.yaml", "--where", "sag <"], "--where"),
        ([GUY, "--out", "page.pdf"], "a page is HTML"),
        ([GUY, "--out", "absent/page.html"], "no such folder"),
        ([GUY, "--case", "snow"], "unknown case"),
        ([GUY, "--vary", "cable.preload=1kN,2kN"], "is a scene, not a study"),
        ([CONFIGS / "preload.yaml", "--case", "ice"], "is a study"),
        ([GUY, "--set", "cable.densty=1"], "unknown key"),
        ([GUY, "--set", "cable.preload"], "expected key=value"),
        ([CONFIGS / "preload.yaml", "--vary", "cable.unstretched_length=1m,2m"], "varies already"),
        ([GUY, ZIPLINE], "unexpected extra argument"),
        ([], "Missing argument"),
    ],
)
def test_wrong_use_is_one_line_and_writes_nothing(folder, arguments, words):
    with undrawn():
        refused_in_one_line(folder, words, "report", *arguments)


def test_unknown_columns_of_a_scene_are_refused_before_anything_is_computed(folder, monkeypatch):
    monkeypatch.setattr("cablestudy.pages.report.sections", None)
    lines = run("report", GUY, "--columns", "sagg,sag,frequncy,n1.sag,nonsense", code=2).lines
    assert lines == [
        "--columns: unknown column 'sagg' (did you mean sag?)",
        "--columns: unknown column 'frequncy' (did you mean frequency?)",
        "--columns: no table has a column 'n1.sag' (give sag: its table has a row for each part)",
        "--columns: unknown column 'nonsense' ('cablestudy columns' lists them)",
    ]


@undrawn()
def test_columns_of_tables_of_results_are_those_that_can_be_asked_for(folder, monkeypatch):
    """Each of a page can be named, and `ONLY_IN_TABLES` has those that are none of a study, and no others."""
    names = set()

    def collect(page, table, caption):
        names.update(name for field in table.fields for name in (field.name, field.plain))

    monkeypatch.setattr("cablestudy.pages.page.Page.results", collect)
    for scene in ("carlina", "line-limits", "zipline", "suspensions/carlina-net-wind"):
        run("report", CONFIGS / f"{scene}.yaml", "--set", "model={elements: 3}")
    check_columns(names)
    assert {name for name in names if not (is_column(name) or is_column(f"part.{name}"))} == set(ONLY_IN_TABLES)


def test_a_folder_in_the_way_is_refused_before_anything_is_computed(folder):
    (folder / "guy.html").mkdir()
    assert run("report", GUY, code=2).err == "--out guy.html: cannot be written (a folder is there)\n"


@undrawn()
def test_the_python_interface_writes_the_same_page(folder):
    done = cs.report(TRIFILAR, out=folder / "one.html", set={"gravity": 9.8}, title="same")
    assert (done.path, done.failures) == (str(folder / "one.html"), ())
    page = Page((folder / "one.html").read_text())
    assert page.texts["h1"] == ["same"]
    assert page.tables["Where the numbers come from"][1] == ["command", "cablestudy.report"]
    varied = cs.report(CONFIGS / "preload.yaml", vary={"gondola.mass": "10kg,50kg"})
    assert varied.path == "preload.html"
    with pytest.raises(cs.SceneError, match="a page is HTML"):
        cs.report(TRIFILAR, out="page.txt")


def test_pictures_of_one_page_share_no_name():
    figure = Figure()
    figure.subplots().plot([0, 1], [0, 1], label="5 < 6 & id=7")
    names = [set(re.findall(r'\bid="([^"]+)"', inline_picture(figure, prefix, "a < b"))) for prefix in ("p1", "p2")]
    assert len(names[0]) == len(names[1]) > 10
    assert not names[0] & names[1]
    svg = inline_picture(figure, "p1", "a < b")
    used = set(re.findall(r'(?:url\(#|href="#)([^")]+)', svg))
    assert used
    assert used <= names[0]
    assert 'aria-label="a &lt; b"' in svg


def test_a_picture_of_very_many_points_is_no_svg():
    figure = Figure()
    figure.subplots().plot(range(150_000))
    picture = inline_picture(figure, "p1", 'a "b"')
    assert picture.startswith('<img src="data:image/png;base64,')
    assert picture.endswith('alt="a &quot;b&quot;">')
    assert len(picture) < 1e6


def test_wide_tables_are_split_and_long_ones_cut():
    fields = tuple(Field(f"c{k}", f"c{k}") for k in range(30))
    rows = [{f"c{k}": float(k + row) for k in range(30)} for row in range(PAGES.table_rows + 1)]
    page = Page(table_html(Table(fields, rows), "wide"))
    assert len(page.tables) == 3
    assert {len(row) for rows in page.tables.values() for row in rows} == {11}
    assert all(rows[1][0] == "1" and rows[-1][0] == str(PAGES.table_rows + 1) for rows in page.tables.values())
    assert {row[k] for rows in page.tables.values() for row in rows for k in range(11)} >= {f"c{k}" for k in range(30)}


def test_short_words_are_not_broken_into_lines_and_longer_texts_are():
    fields = tuple(Field(name, name) for name in ("number", "type", "note"))
    table = Table(fields, [{"number": k, "type": "out-of-plane", "note": 5 * "a note "} for k in (1, 2)])
    cells = [known.get("class") for tag, known in Page(table_html(table, "modes")).attributes if tag == "td"]
    assert cells == 2 * ["word", None]


def test_a_reason_in_a_table_makes_it_no_wider_than_the_page():
    fields, reason = (
        (Field("case", "case"), Field("sag_m", "sag", "m"), Field("status", "status")),
        ("a reason, " * 9).strip(),
    )
    rows = [{"case": "ice", "sag_m": 1.0, "status": "ok"}, {"case": "hot", "sag_m": None, "status": reason}]
    assert f'<span class="text">{reason}</span>' in table_html(Table(fields, rows, across="case"), "load cases")
    assert "reason" not in table_html(Table(fields[1:], rows[1:], single=True), "told above it")


def test_values_are_shown_as_they_may_be_written():
    assert written([1, "2 m", {"a": [True, None]}]) == "[1, 2 m, {a: [true, null]}]"
    assert flat({"a": {"b": 1, "c": {}}, "d": [2]}) == {"a.b": 1, "a.c": {}, "d": [2]}


def test_an_error_of_which_no_digit_tells_anything_is_above_1():
    """A sag that drag may take to zero has 1e30."""
    assert [error_text(error) for error in (None, 0.0, 1e-15, 0.034, 1.0, 1e30)] == [
        "", "exact", "1e-12", "3e-2", "1e0", "above 1"
    ]  # fmt: skip
    (note,) = above_accuracy([({"n1.sag_m": 1e30, "n2.sag_m": 0.25}, {}, 1e-4), ({"n1.sag_m": 0.01}, {}, 1e-4)])
    assert note.endswith(": n1.sag_m (above 1, 2 rows), n2.sag_m (up to 2.5e-01, 1 row)")


def test_there_is_no_note_on_the_error_of_a_probability_that_is_next_to_none(folder):
    """Of 5e-132 it is a factor of millions; 1e-7 may be 1e-6 with an error of ten times."""
    name = "slack_probability of cables"
    assert not above_accuracy([({name: 2.7e6}, {name: 5e-132}, 1e-4), ({name: 8.9}, {name: 1e-7}, 1e-4)])
    assert above_accuracy([({name: 9.1}, {name: 1e-7}, 1e-4), ({name: 0.7}, {name: 0.3}, 1e-4)])


@undrawn()
def test_names_of_columns_in_python_stand_once_and_none_is_empty(folder):
    study = str(CONFIGS / "guy-preload.yaml")
    with pytest.raises(SceneError, match=r"^columns: expected names joined by commas"):
        cs.report(study, out="none.html", columns="sag,")
    assert not (folder / "none.html").exists()
    done = cs.report(study, out="twice.html", columns=["sag", "sag"])
    head, *_ = Page((folder / done.path).read_text(encoding="utf-8")).tables["One row for each case"]
    assert head.count("sag [m]") == 1
