"""Part of docs/benchmarks.md: rows of a suspension in the wind with the loop of its winches closed, all columns."""

import os

from cables import HERE, median, seconds, verdict

ROUNDS, AIM_ALONE = 5, 150.0  # rounds; CPU time [ms]
AIMS = {"control.gain": 15.0, "exposure": 15.0, "wind.speed": 40.0, "cable.diameter": 40.0}  # of a row of a sweep [ms]
FREQUENCIES = 1500  # at which the same model is solved directly
STUDIES = {  # what varies in a sweep, and its values
    "control.gain": [f"{gain:g} rad/s" for gain in (0.05, 0.1, 0.2, 0.325, 0.5, 0.7, 1, 1.4, 2, 3, 4, 5)],
    "exposure": [f"{time:g} ms" for time in (0.3, 0.5, 1, 2, 3, 5, 10, 20, 30, 50, 100, 200)],
    "wind.speed": [f"{speed:g} m/s" for speed in range(3, 15)],
    "cable.diameter": [f"{diameter / 10:g} mm" for diameter in range(15, 27)],
}
SCENE = os.path.join(HERE, os.pardir, "configs", "suspensions", "carlina-net-wind.yaml")


def scene(*sets):
    """configs/suspensions/carlina-net-wind.yaml with some keys changed."""
    from cablestudy.scene.scene import load_scene

    return load_scene(SCENE, list(sets))[1]


def columns(one):
    """All that a scene without exposure and mirror has in the wind."""
    from cablestudy.study.column import lacking_key
    from cablestudy.study.suspension.wind_columns import LOOP, displacement_columns, rotation_columns, tension_columns

    found = [
        *displacement_columns("gondola"),
        *displacement_columns("gondola.focus"),
        *rotation_columns("gondola"),
        *LOOP,
    ]
    found += [column for name in one.cables for column in tension_columns(name)]
    return [column for column in found if not lacking_key(one, column)]


def direct(closed_loop):
    """RMS of the outputs by the dynamic stiffness at FREQUENCIES, with the loop, by the trapezoid rule."""
    import numpy as np

    frequency = np.geomspace(1e-4, 50.0, FREQUENCIES)
    s = 2j * np.pi * frequency
    moved = closed_loop.motion.c
    shown = moved[0] + s[:, None, None] * moved[1] + s[:, None, None] ** 2 * moved[2]
    dynamic = np.swapaxes(closed_loop.loop.dynamic_stiffness(s), 1, 2)
    to_forces, gusts = np.linalg.solve(dynamic, np.swapaxes(shown, 1, 2)), closed_loop.gusts
    spectra = gusts.input_spectra(frequency, gusts.input_matrix.T @ to_forces)
    return np.sqrt(np.trapezoid(spectra, frequency, axis=0))


def in_wind():
    """Lines: one row, rows of sweeps, and beside them the frequencies solved one by one."""
    import numpy as np

    from cablestudy.study.suspension.case import SuspensionCase
    from cablestudy.study.suspension.rows import evaluate_suspensions

    one = scene()
    wanted, case = columns(one), SuspensionCase(one)
    variances, closed_loop = case.analysis.response.variances, case.analysis.closed_loop
    places = [variances.rows[f"gondola.{axis}"] for axis in "xyz"]
    own = np.sqrt(variances.weighted["value"][places])
    apart = np.abs(direct(closed_loop)[places] / own - 1).max()
    alone = median([seconds(lambda: evaluate_suspensions([one], wanted)) for _ in range(ROUNDS)])
    solved = median([seconds(lambda: direct(closed_loop)) for _ in range(ROUNDS)])
    yield "| what | ms a row | over a row alone | aim |"
    yield "|---|---:|---:|---|"
    met = f"at most {AIM_ALONE:g}: {verdict(1e3 * alone <= AIM_ALONE)}"
    yield f"| one row alone, {len(wanted)} columns | {1e3 * alone:.0f} | 1.0 | {met} |"
    for key, values in STUDIES.items():
        scenes = [scene(f"{key}={value}") for value in values]
        spent = median([seconds(lambda scenes=scenes: evaluate_suspensions(scenes, wanted)) for _ in range(ROUNDS)])
        row = spent / len(scenes)
        met = f"at most {AIMS[key]:g}: {verdict(1e3 * row <= AIMS[key])}"
        yield f"| sweep of {len(scenes)} over {key} | {1e3 * row:.0f} | {row / alone:.2f} | {met} |"
    yield (
        f"| {FREQUENCIES} frequencies of its model solved one by one | {1e3 * solved:.0f} | {solved / alone:.1f} | "
        f"RMS of the gondola differ by {apart:.0e} |"
    )
