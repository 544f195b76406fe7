"""Only what a scene requires: solutions, systems and masses are counted while rows are computed."""

import gc
import pickle

import numpy as np
import pytest
from campaign import campaign
from command import CARLINA, CONFIGS, SLACK, study_file
from random_scenes import scene_data
from scenes import scene
from solved import rows_as_alone, solve_all

import cablestudy as cs
from cablestudy.cable import assembly, catenary, dynamics, equilibrium
from cablestudy.cable.tolerances import CABLE
from cablestudy.motion import body_damping, in_wind
from cablestudy.motion.dynamic_analysis import DynamicAnalysis
from cablestudy.motion.gust_response import GustResponse
from cablestudy.motion.tension_waves import change_by_waves
from cablestudy.scene.scene import CableScene
from cablestudy.scene.study import read_study
from cablestudy.study.cable_columns import COLUMNS
from cablestudy.study.case_table import tables_of
from cablestudy.study.column import lacking_key
from cablestudy.study.columns import find
from cablestudy.study.one_cable import results
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.one_cable.rows import evaluate, evaluate_cases
from cablestudy.study.refinement import with_accuracy
from cablestudy.study.study_rows import evaluate_tables
from cablestudy.study.suspension.rows import evaluate_suspensions
from cablestudy.study.table_rows import has_answer
from cablestudy.study.tolerances import STUDY
from cablestudy.sweeps.chunks import Chunk, _freeze, compute
from cablestudy.sweeps.fingerprint import versions
from cablestudy.sweeps.tolerances import SWEEPS
from cablestudy.system import state_spaces
from cablestudy.system.residues import eigen_of_rows
from cablestudy.wind.tolerances import WindTolerances

STATIC = [column for column in COLUMNS if column.needs in ("scene", "statics", "stiffness")]
WIND = [find(name) for name in ("preload", "end_stiffness", "gondola_frequency", "gondola_rms", "gain_margin")]


# with modal damping no error is stated
KNOWN_ERRORS = "cable.damping={model: hysteretic, loss_factor: 0.02}", "control.gain=0.05 rad/s"


@pytest.fixture
def counts(monkeypatch):
    """Calls of what costs something, by name; and the axes of every system that is set up."""
    found = {"axes": []}

    def count(module, name, size=lambda *_: 1):
        function = getattr(module, name)

        def call(*arguments, **options):
            found[name] = found.get(name, 0) + size(*arguments)
            return function(*arguments, **options)

        monkeypatch.setattr(module, name, call)

    count(results, "solve")
    count(equilibrium, "solve_many")
    count(dynamics.Dynamics, "_solve")
    count(assembly, "masses")
    begin = assembly.System.__init__

    def system(self, state, axes):
        found["axes"].append(axes)
        begin(self, state, axes)

    monkeypatch.setattr(assembly.System, "__init__", system)
    return found


def vary(path, key, values, *sets):
    return [scene(*sets, f"{key}={value}", base=path) for value in values]


def test_a_cable_that_goes_slack_is_told_without_the_errors_of_tensions(monkeypatch):
    """Errors of tensions by waves along cables cost as much as their RMS: they are for columns of tensions alone."""
    wind, calls = scene(*KNOWN_ERRORS, base=CONFIGS / "suspensions" / "fast-wind.yaml"), []
    monkeypatch.setattr(
        in_wind, "change_by_waves", lambda *arguments: calls.append(arguments) or change_by_waves(*arguments)
    )
    body, tension = (find(name) for name in ("cabin.rms", "c1.rms_tension"))
    evaluate_suspensions([wind], [body])
    assert not calls
    evaluate_suspensions([wind], [body, tension])
    assert len(calls) == 1


def test_errors_of_rates_above_the_integrals_are_for_columns_of_rates_alone(monkeypatch):
    wind = scene(*KNOWN_ERRORS, base=CONFIGS / "suspensions" / "fast-wind.yaml")
    calls, rates_beyond = [], GustResponse._rates_beyond
    monkeypatch.setattr(GustResponse, "_rates_beyond", lambda response: calls.append(1) or rates_beyond(response))
    names = [f"cabin.{name}_open_loop" for name in ("rms_x", "rms", "rms_velocity")]
    evaluate_suspensions([wind], [find(name) for name in (*names[:2], "c1.rms_tension")])
    assert not calls
    evaluate_suspensions([wind], [find(name) for name in names])
    assert len(calls) == 1


def test_the_pole_of_a_strongly_damped_mode_costs_no_model_of_coupled_modes(monkeypatch):
    monkeypatch.setattr(body_damping, "damped_poles", None)
    sets = "cable.diameter=3.5 mm", "cable.damping={model: kelvin_voigt, time: 5 ms}", "model={accuracy: 1e-4}"
    assert evaluate(scene(*sets), [find("gondola_damping_ratio")]).cells["gondola_damping_ratio"] > 0.02


def test_errors_of_stated_elements_are_estimated_only_where_they_are_shown(counts):
    """They need finer elements with a solution of their own; the state space has one in the plane and one across it."""
    answer = cs.load(CARLINA).compute("ssm")
    assert counts["_solve"] == 2
    (table,) = answer.tables.values()
    assert next(iter(table.errors()))["frequency_Hz"] < 1e-2
    assert counts["_solve"] > 2


@pytest.mark.parametrize("path", [CARLINA, SLACK])
def test_static_columns_cost_no_modes_and_no_mass(counts, path):
    model = scene("model={accuracy: 1e-6}", base=path)
    columns = [column for column in STATIC if not lacking_key(model, column)]
    assert len(columns) > 10
    assert not evaluate(model, columns).failed
    assert counts == {"solve": 1, "axes": []}  # one closed form for all columns, no elements at all


def test_fixed_elements_cost_one_solution_and_no_mass(counts):
    columns = [find(name) for name in ("preload", "sag", "max_tension", "end_stiffness", "gondola_frequency_static")]
    assert not evaluate(scene("model.elements=40"), columns).failed
    assert (counts["solve"], counts["solve_many"]) == (1, 1)  # the closed form to begin with, and the elements
    assert "masses" not in counts
    assert "_solve" not in counts


@pytest.mark.parametrize("model", ["model={elements: 40}", "model={accuracy: 1e-6}"])
def test_a_gondola_along_x_moves_nothing_across_the_plane(counts, model):
    sets = (model, "cable.damping={loss_factor: 0.02, viscous: 1e-4 N s/m^2}", "winch.controller.gain=0.01")
    calm = scene(*sets)
    row = evaluate(calm, [*WIND, find("cable_frequency"), find("dof")])
    assert not row.failed, row.cells["status"]
    assert set(counts["axes"]) == {assembly.IN_PLANE}
    # the out-of-plane frequency is what brings the other plane in
    evaluate(calm, [find("outofplane_frequency_1")])
    assert set(counts["axes"]) == {assembly.IN_PLANE, assembly.OUT_OF_PLANE}


def test_a_sweep_over_wind_speed_solves_the_cable_once(counts):
    rows = evaluate_cases(vary(CARLINA, "wind.speed", [3, 6, 9, 12, 20]), WIND)
    assert not any(row.failed for row in rows)
    assert len({row.cells["gondola_rms_mm"] for row in rows}) == 5
    assert counts["_solve"] == 1  # modes of the cable
    # the closed form of all cables in one call, the elements alone and with the gondola
    assert (counts["solve"], counts["solve_many"]) == (1, 2)


def test_winds_that_do_not_damp_share_the_loop(monkeypatch):
    """Only their gusts differ: the poles of the loop, of the model with fewer modes too, are those of one row."""
    sizes = []
    monkeypatch.setattr(state_spaces, "eigen_of_rows", lambda rates: sizes.append(len(rates)) or eigen_of_rows(rates))
    rows = rows_as_alone(
        vary(CARLINA, "wind.speed", [3, 6, 9]), ["gondola_rms", "gondola_rms_open_loop", "gain_margin"]
    )
    assert len({row.values["gondola_rms"] for row in rows}) == 3
    assert set(sizes) == {1}


def test_a_sweep_over_the_gondola_solves_the_cable_once(counts):
    rows = evaluate_cases(vary(CARLINA, "gondola.mass", [10, 50, 100]), WIND)
    assert len({row.cells["gondola_rms_mm"] for row in rows}) == 3
    assert counts["_solve"] == 1  # the modes of the cables of all rows, in one call


@pytest.mark.crossed
@pytest.mark.parametrize(("key", "values"), [
    ("cable.ends", ["[[0, 0, 0], [185.8, 0, 0]]", "[[0, 0, 0], [185.7, 0, 3]]", "[[0, 0, 0], [0, 185.8, 0]]"]),
    ("cable.unstretched_length", [184.0, 184.4883, 185.8, 186.5]),
    ("cable.preload", [60, 1000, 1344.75, 3000]),
    ("cable.sag", [0.1, 0.12, 4.0, 9.0]),
    ("gondola.mass", [10, 50, 100]),
    ("winch.controller.gain", [0.1, 0.2, 0.3]),
    ("cable.damping.ratio", [0.01, 0.02]),
    ("cable.damping", ["{ratio: 0.01}", "{loss_factor: 0.02}", "{model: kelvin_voigt, time: 1e-3}"]),
    ("cable.diameter", ["1.85 mm", "3.7 mm", "7.4 mm"]),
    ("model.elements", [10, 40]),
    ("model", ["{elements: 8, mass: consistent}", "{elements: 2, order: 5}"]),
    ("gravity", [1.6, 9.81]),
    ("cable.loads", ["[]", "[{at: 100, force: [0, 0, -3]}]", "[{at: 90, force: [1, 2, -3]}]"]),
])  # fmt: skip
@pytest.mark.parametrize("closed", [False, True], ids=["elements", "closed form"])
def test_rows_are_those_of_each_scene_alone_to_the_last_digit(key, values, closed):
    """Whatever cases share, and however many are solved at once."""
    sets = ("model={accuracy: 1e-4}",) if closed and not key.startswith("model") else ()
    columns = [column for column in STATIC if not column.key] if closed else [*WIND, find("cable_frequency")]
    rows = rows_as_alone(vary(CARLINA, key, values * 2, *sets), [column.name for column in columns])
    assert any(row.status == "ok" for row in rows)


def test_modes_of_a_large_model_do_not_depend_on_how_many_another_row_wants():
    """Bodies from light to heavy want few modes or many of the same cable."""
    sets = ("model={elements: 150}", "cable.unstretched_length=400", "cable.loads=[{at: 90, force: [0, 0, -3]}]")
    scenes = vary(CARLINA, "gondola.mass", [0.05, 0.5, 50, 5000], *sets)
    rows = rows_as_alone(scenes, ("gondola_frequency", "inplane_frequency_3"))
    assert {row.status for row in rows} == {"ok"}
    assert CableCase(scenes[0]).in_plane.dof > CABLE.cheap_freedoms


def test_a_mixture_of_random_scenes_gives_each_row_as_it_is_alone():
    """Accuracies, fixed models, loads out of plane, cables that fold or break, and equal cables with other bodies."""
    models = [{"accuracy": 1e-2}, {"elements": 40}, {"elements": 12}, {"elements": 2, "order": 8},
              {"elements": 5, "mass": "blended"}, {"elements": 1}]  # fmt: skip
    scenes = []
    for seed in range(campaign(8, 6)):
        data = {"gondola": {"mass": 1.0}, **scene_data(seed), "model": models[seed % len(models)]}
        data["cable"]["strength"] = data["cable"]["elastic_modulus"] * (0.2, 1e-3)[seed % 5 == 0]
        heavier = {**data, "gondola": {"mass": 3 * data["gondola"]["mass"]}}
        scenes += [CableScene.model_validate(one) for one in (data, heavier)]
    scenes = scenes[::2] + scenes[1::2]
    for names in (("preload", "sag", "end_stiffness"), ("cable_frequency", "outofplane_frequency_2", "error_estimate"),
                  ("gondola_frequency", "inplane_frequency_3", "dof")):  # fmt: skip
        rows = rows_as_alone(scenes, names)
        assert {has_answer(row.status) for row in rows} == {True, False}


def test_digits_of_fixed_elements_do_not_depend_on_other_rows(tmp_path):
    """Level and inclined cables, taut and slack, with loads in the plane and out of it; in the reverse order too."""
    text = """
set: {cable: {chord: 185.8 m, inclination: 0 deg, elastic_modulus: 70.3 GPa, density: 1440, area: 2.69 mm^2,
      unstretched_length: 184 m}}
vary:
  - {cable.inclination: [0 deg, 60 deg]}
  - {cable.unstretched_length: [183 m, 200 m]}
  - {model: [{elements: 40, order: 1}, {elements: 2, order: 8}, {elements: 1, order: 1}]}
  - {cable.loads: [[], [{at: 50 m, force: [0, 3 N, -10 N]}], [{fraction: 0.3, mass: 2 kg}]]}
columns: [sag]
"""
    scenes = [scene for _, scene in read_study(study_file(tmp_path, text)).cases()]
    names = [*(column.name for column in STATIC if not column.key and not column.each), "iterations"]
    rows = rows_as_alone(scenes, names)
    assert {row.status == "ok" for row in rows} == {True, False}  # one element bears no load
    assert solve_all(scenes[::-1], names) == rows[::-1]


@pytest.mark.parametrize(("model", "keys"), [
    ("{accuracy: 1e-4}", "{cable.preload: [1 N, 60 N, 1000 N, 40 kN], cable.area: [2e-6, 2.69e-6, 3e-6, 4e-6]}"),
    ("{accuracy: 1e-4}", "{cable.sag: [0.1, 4, 300], gravity: [1.6, 9.81, 0]}"),
    ("{accuracy: 1e-4}", "{cable.chord: [185, 186, 100], cable.inclination: [0, 1, 1.5]}"),
    ("{accuracy: 1e-4}", "{cable.diameter: [1 mm, 2 mm], wind.speed: [3, 6], gondola.mass: [10, 50]}"),
    ("{elements: 40}", "{cable.unstretched_length: {from: 183 m, to: 300 m, count: 9}}"),
])  # fmt: skip
def test_a_table_of_cases_gives_the_rows_of_each_scene_alone_to_the_last_digit(tmp_path, model, keys):
    """Closed forms by arrays, where all columns are; and tables whose columns are not."""
    study = read_study(study_file(tmp_path, f"set: {{model: {model}}}\ncolumns: [sag]\nvary: [{keys}]\n"))
    closed = [*(column for column in STATIC if not column.each), find("iterations")]
    tables, refused = tables_of(study, range(study.count))
    assert not refused
    for columns in (closed, [one for one in closed if not one.key], [find("sag"), find("error_estimate")]):
        found = evaluate_tables(tables, columns)
        for case in range(study.count):
            row = evaluate(study.case(case)[1], columns)
            numbers, status, errors, notes = found[case]
            assert [*numbers, status] == [row.cells[column.header] for column in columns] + [row.cells["status"]]
            assert errors == {name: error for name, error in row.errors.items() if error > STUDY.rounding}
            assert notes == ()


def test_a_case_without_an_answer_fails_alone():
    scenes = vary(CARLINA, "cable.preload", [1, 1345, 600], "model={accuracy: 1e-4}")
    rows = evaluate_cases(scenes, [find("preload"), find("sag")])
    assert [row.failed for row in rows] == [True, False, False]
    assert rows[0].cells["status"].startswith("a mean tension of 1 N")
    assert catenary.solve(rows[1].case.span).mean_tension == rows[1].cells["preload_N"]


def test_modes_end_where_the_quadrature_makes_most_of_the_error(monkeypatch):
    """What quadrature lacks no mode adds: of a bare cable in the wind the fewest modes are tried, and no others."""
    monkeypatch.setattr(WindTolerances, "fine_coherence", (*WindTolerances.fine_coherence[:2], 1e-3))
    sets = "gondola=null", "winch=null", "cable.damping={model: kelvin_voigt, time: 1 ms}"
    row = evaluate(with_accuracy(scene(*sets), 1e-6), [find("midspan_rms"), find("tension_rms")])
    for side in row.case.in_cable_wind.analyses:
        assert len(side.closed_loop.modes) == side.sizes.tried[0] < side.sizes.tried[-1]
        assert "finer" not in vars(side)


def test_a_chunk_of_a_sweep_lets_go_of_the_models_of_its_rows(tmp_path, monkeypatch):
    """They refer to each other in circles: rows of loop and wind took a megabyte each until such were looked for."""
    vary = "vary: [{winch.controller.gain: {from: 0.01 rad/s, to: 0.04 rad/s, count: 4}}]\n"
    study, held = read_study(study_file(tmp_path, f"{vary}columns: [gondola_rms]\n")), []
    gc.collect()
    _freeze()  # what tests before this one left counts no more
    before = sum(isinstance(one, DynamicAnalysis) for one in gc.get_objects())
    gc.disable()
    try:
        for after, cases in ((np.inf, (0, 1)), (0.0, (2,)), (0.0, (3,))):
            monkeypatch.setattr(type(SWEEPS), "collected_time", after)
            compute(Chunk(pickle.dumps(study), versions(), ("gondola_rms",), cases))
            held.append(sum(isinstance(one, DynamicAnalysis) for one in gc.get_objects()) - before)
    finally:
        gc.enable()
        gc.unfreeze()
    assert held[0] > 0 == held[1] == held[2]
