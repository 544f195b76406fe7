"""The files that a sweep writes."""

import os
from pathlib import Path

import pytest
from command import study_file
from scenes import computed

from cablestudy.errors import SceneError
from cablestudy.scene.study import read_study
from cablestudy.study.table import TableFiles
from cablestudy.sweeps.check import Tolerance, compare

pytestmark = pytest.mark.usefixtures("folder")


@pytest.mark.parametrize(
    ("study", "stem"),
    [("configs/preload.yaml", "preload"), ("a.b.yml", "a.b"), ("<stdin>", "stdin"), ("/x/ünï.yaml", "ünï")],
)
def test_files_are_named_after_the_study(study, stem):
    files = TableFiles("out", study)
    assert (files.csv, files.md) == (os.path.join("out", f"{stem}.csv"), os.path.join("out", f"{stem}.md"))


def test_asking_makes_nothing_and_writing_makes_the_folder(folder):
    study = read_study(study_file(folder, 'title: "Two | three"\ncolumns: [sag]\n'))
    files = TableFiles("deep/out", study.name)
    files.check_writable()
    assert not (folder / "deep").exists()
    table = computed(study)
    files.write(study, table, "a: 1\n")
    names = sorted(path.name for path in (folder / "deep" / "out").iterdir())
    assert names == ["study.csv", "study.md", "study.run.yaml"]
    assert Path(files.csv).read_text(encoding="utf-8") == table.render("csv")
    assert Path(files.md).read_text(encoding="utf-8") == f"# Two | three\n\n{table.render('md')}"
    assert list(compare(table, files.csv, Tolerance(0.0))) == []
    assert Path(files.run).read_text(encoding="utf-8") == "a: 1\n"
    files.check_stored()


def test_a_study_without_title_is_headed_by_its_name(folder):
    study = read_study(study_file(folder, "columns: [sag]\n"))
    TableFiles(".", study.name).write(study, computed(study), "a: 1\n")
    assert Path("study.md").read_text(encoding="utf-8").startswith("# study\n\n| ")


def test_a_file_in_the_way(folder):
    (folder / "out").write_text("x", encoding="utf-8")
    for name in ("out", "out/deeper"):
        with pytest.raises(SceneError, match=f"--out {name}: out is a file, not a folder"):
            TableFiles(name, "a.yaml").check_writable()
    with pytest.raises(SceneError, match="no such file to compare with"):
        TableFiles("out", "a.yaml").check_stored()
    (folder / "there" / "study.csv").mkdir(parents=True)  # a folder where the file should go
    study = read_study(study_file(folder, "columns: [sag]\n"))
    with pytest.raises(SceneError, match="cannot be written"):
        TableFiles("there", study.name).write(study, computed(study), "a: 1\n")
    assert [path.name for path in (folder / "there").iterdir()] == ["study.csv"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is closed to root")
def test_a_folder_that_is_closed(folder):
    (folder / "closed").mkdir(mode=0o500)
    with pytest.raises(SceneError, match="cannot be written to"):
        TableFiles("closed", "a.yaml").check_writable()


@pytest.mark.parametrize("end", [".csv", ".md", ".run.yaml", ".rows.sqlite"])
def test_a_folder_in_the_way_of_a_file(folder, end):
    (folder / f"a{end}").mkdir()
    with pytest.raises(SceneError) as caught:
        TableFiles(str(folder), "a.yaml").check_writable()
    assert str(caught.value) == f"{folder}/a{end}: cannot be written (a folder is there)"
