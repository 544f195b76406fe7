"""Columns of suspensions in scenes of one cable; `test_twins` holds their numbers against suspensions."""

import numpy as np
import pytest
from command import CONFIGS, rows_of, run, study_file
from solved import contents, solve
from twins import (
    BARE_CABLE,
    COUPLED,
    GROUND,
    LINEAR,
    LOADED,
    OPEN_WIND,
    PEAK,
    SECTION,
    STATICS,
    STIFFNESS,
    STRENGTH,
    VORTICES,
    WIND,
    without,
)

from cablestudy.scene.scene import load_scene
from cablestudy.study.columns import find
from cablestudy.study.scene_kind import why_not
from cablestudy.study.study_rows import evaluate

CARLINA = contents(
    CONFIGS / "carlina.yaml", "cable.damping={loss_factor: 0.02, viscous: 0.01}", "model={accuracy: 1e-4}"
)
NUMBERS = STATICS | STIFFNESS | LINEAR | SECTION | STRENGTH | COUPLED | OPEN_WIND | WIND | PEAK


def test_both_names_have_one_number():
    found = solve(CARLINA, *NUMBERS, *NUMBERS.values())
    assert found.status == "ok"
    for own, other in NUMBERS.items():
        assert found.values[own] == found.values[other], own
        assert found.errors[own] == found.errors[other], own


@pytest.mark.parametrize(("file", "names"), [("point-load", LOADED), ("line", GROUND), ("carlina", VORTICES)])
def test_both_names_have_one_number_of_a_cable_with_fixed_ends(file, names):
    found = solve(contents(CONFIGS / f"{file}.yaml"), *names, *names.values())
    assert [found.values[own] for own in names] == [found.values[other] for other in names.values()]
    assert None not in found.values.values()


def test_the_wind_on_a_bare_cable():
    scene = without(CARLINA, "gondola", "winch")
    found = solve(scene, *BARE_CABLE, *BARE_CABLE.values())
    assert found.status == "ok"
    assert [found.values[own] for own in BARE_CABLE] == [found.values[other] for other in BARE_CABLE.values()]


def test_rows_do_not_depend_on_their_neighbours():
    columns = [find(name) for name in ("frequency_3", "cable.least_tension", "gondola.rms", "cable.sag")]
    scenes = [load_scene(str(CONFIGS / "carlina.yaml"), (f"cable.diameter={d} mm",))[1] for d in (2, 3, 4)]
    together = evaluate(scenes, columns)
    for scene, row in zip(scenes, together, strict=True):
        assert evaluate([scene], columns)[0].cells == row.cells


def test_the_tension_at_a_gondola_is_that_of_its_stiffness_where_all_is_slow():
    """A gondola so heavy that waves along the cable are fast: tension at end 2 over displacement is its stiffness."""
    scene = without(CARLINA, "winch")
    scene = scene | {"gondola": scene["gondola"] | {"mass": 1e6}}
    found = solve(scene, "cable.rms_tension", "gondola.rms_x", "end_stiffness").values
    expected = found["end_stiffness"] * found["gondola.rms_x"] / 1e3
    assert found["cable.rms_tension"] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("gondola.rms_x", "gondola.rms_x needs the key wind, which the scene does not have"),
        ("cable.least_tension", "cable.least_tension needs the key wind, which the scene does not have"),
        ("knot.x", "no body, free point, cable or link knot (allowed: gondola, cable)"),
        ("gondola.end_stiffness_along", "gondola has no column end_stiffness_along"),
        ("cable.frequency_2", "cable has no column frequency_2"),
    ],
)
def test_what_a_scene_cannot_have(name, reason):
    _, scene = load_scene(str(CONFIGS / "carlina.yaml"), ("wind=null",))
    assert why_not(scene, find(name)).startswith(reason)


def test_a_winch_that_is_too_slow_refuses_tensions_too():
    scene = CARLINA | {"winch": CARLINA["winch"] | {"max_speed": 1e-9}}
    found = solve(scene, "cable.rms_tension", "gondola.rms_x_open_loop")
    assert found.values["cable.rms_tension"] is None
    assert "max_speed" in found.status
    assert np.isfinite(found.values["gondola.rms_x_open_loop"])


def test_a_table_has_the_names_that_were_asked_for(folder):
    text = "vary: [{cable.diameter: [3 mm, 4 mm]}]\ncolumns: [sag, cable.sag, gondola.x, frequency_2]\n"
    outcome = run("sweep", study_file(folder, text), "--format", "csv")
    rows = rows_of(outcome.out, "csv")
    assert list(rows[0])[1:] == ["sag_m", "cable.sag_m", "gondola.x_m", "frequency_2_Hz", "status"]
    assert all(row["sag_m"] == row["cable.sag_m"] for row in rows)
