"""Section of docs/benchmarks.md: one scene with much in a row, and sweeps of such rows."""

from cables import HERE, changed, least, paper, verdict
from others import columns, relative

ROWS = 100
# law; its key [-] or [s], and value; rows a second to reach. The modal damping is that of the paper, with its 40 bars
DAMPED = (
    ("hysteretic", {"loss_factor": 0.02}, 300),
    ("kelvin_voigt", {"time": 0.001}, 400),
    ("kelvin_voigt", {"time": 0.005}, 400),
    ("modal", {}, 1000),
)
EIGHT = [f"{plane}_frequency_{k}" for plane in ("inplane", "outofplane") for k in range(1, 5)]
ACCURACIES = {1e-6: 0.5, 1e-10: 2.0}  # and the aim, in times of 40 bars


def wind_rows():
    """Lines: rows of Table 10."""
    import os

    from cablestudy.scene.study import read_study
    from cablestudy.study.one_cable.rows import evaluate, evaluate_cases

    study = read_study(os.path.join(HERE, os.pardir, "configs", "diameter.yaml"))
    wanted = columns(*study.columns)
    scenes = [scene for _, scene in study.cases()]
    single = max(least(lambda scene=scene: evaluate(scene, wanted)) for scene in scenes)
    share = [k / (ROWS - 1) for k in range(ROWS)]
    distinct = [changed(scenes[0], diameter=1.85e-3 * 4**part) for part in share]
    windy = [changed(scenes[0], wind=2 + 18 * part) for part in share]
    rates = [ROWS / least(lambda rows=rows: evaluate_cases(rows, wanted), 3) for rows in (distinct, windy)]
    yield "| a full row of Table 10 | measured | aim |"
    yield "|---|---:|---|"
    met = verdict(single <= 0.01)
    yield f"| one at a time, the slowest of the four | {1e3 * single:.1f} ms | at most 10 ms: {met} |"
    for name, rate in zip(("no two of one cable", "one cable, wind from 2 to 20 m/s"), rates, strict=True):
        yield f"| sweep of {ROWS}, {name} | {rate:.0f} rows/s | at least 500: {verdict(rate >= 500)} |"


def damped_rows():
    """Lines: rows of loop and wind with damped strain, to an accuracy, and with modal damping; no two of one cable."""
    import os

    from cablestudy.scene.study import read_study
    from cablestudy.study.one_cable.rows import evaluate_cases

    study = read_study(os.path.join(HERE, os.pardir, "configs", "diameter.yaml"))
    wanted = columns("preload", "gondola_frequency", "gondola_damping_ratio", "gondola_rms", "gain_margin")
    base = next(scene for _, scene in study.cases())
    controller = base.winch.controller.model_copy(update={"gain": 0.01})
    base = base.model_copy(update={"winch": base.winch.model_copy(update={"controller": controller})})
    yield "| a row of loop and wind | rows/s | aim |"
    yield "|---|---:|---|"
    diameters = [1.5e-3 + 4.5e-3 * k / (ROWS - 1) for k in range(ROWS)]
    for law, amount, aim in DAMPED:
        damping = base.cable.damping.model_copy(update={"ratio": None, "model": law, **amount} if amount else {})
        changes = {"accuracy": 1e-4, "damping": damping} if amount else {}
        rows = [changed(base, diameter=diameter, **changes) for diameter in diameters]
        rate = ROWS / least(lambda rows=rows: evaluate_cases(rows, wanted), 3)
        words = ", ".join([law, *(f"{key} {value:g}" for key, value in amount.items())])
        yield f"| {words}, sweep of {ROWS} diameters | {rate:.0f} | at least {aim}: {verdict(rate >= aim)} |"


def accuracy_rows():
    """Lines: accuracy against forty bars, one case alone and each of a sweep in which no two are of one cable."""
    from cablestudy.study.one_cable.rows import evaluate, evaluate_cases

    wanted, truth = columns("end_stiffness", *EIGHT), _truth()
    bars = paper()
    scenes = {"40 bars": bars} | {f"accuracy {a:g}": changed(bars, a) for a in ACCURACIES}
    aims = dict(zip(scenes, (None, *ACCURACIES.values()), strict=True))
    alone, swept = {}, {}
    for _ in range(3):  # in turns, so that a busy machine does not fall on one of them
        for name, scene in scenes.items():
            many = [changed(scene, diameter=1.85e-3 * (1 + k / 1000)) for k in range(ROWS)]
            for found, rows, runs in ((alone, [scene], 5), (swept, many, 2)):
                spent = least(lambda rows=rows: evaluate_cases(rows, wanted), runs) / len(rows)
                found[name] = min(spent, found.get(name, spent))
    swept_too = f"in a sweep of {ROWS}, ms | over 40 bars"
    yield f"| first 8 frequencies and end stiffness | alone, ms | over 40 bars | {swept_too} | aim | error |"
    yield "|---|---:|---:|---:|---:|---|---:|"
    for name, scene in scenes.items():
        cells = evaluate(scene, wanted).cells
        error = max(relative(cells[column.header], truth[column.header]) for column in wanted)
        ratios, aim = [found[name] / found["40 bars"] for found in (alone, swept)], aims[name]
        met = f"at most {aim:g}: {verdict(ratios[0] <= aim)}, {verdict(ratios[1] <= aim)}" if aim else ""
        yield (
            f"| {name} | {1e3 * alone[name]:.2f} | {ratios[0]:.2f} | {1e3 * swept[name]:.2f} | {ratios[1]:.2f} |"
            f" {met} | {error:.1e} |"
        )


def _truth():
    """Header -> value for the paper's cable, by the tests' references."""
    from cables import CHORD, EA, GRAVITY, MASS, Cable, _references, continuous

    cable = Cable(0.0, paper().cable.unstretched_length)
    values = [f for plane in ("in", "out") for f in continuous(cable, 4, plane)]
    reference = _references("continuous_cable")
    stiffness = reference.static_end_stiffness(CHORD, 0.0, cable.length, EA, MASS, GRAVITY)[0, 0]
    headers = [column.header for column in columns("end_stiffness", *EIGHT)]
    return dict(zip(headers, (stiffness, *values), strict=True))


def section():
    """Lines of the section."""
    yield (
        "The paper's cable with 40 bars, gondola, winch and wind (configs/diameter.yaml), RMS to 1e-6: statics, modes, "
        "loop and integral in every row. Least CPU time of a few runs."
    )
    yield ""
    yield from wind_rows()
    yield ""
    yield (
        "Five columns (preload, frequency, damping ratio and RMS of the gondola, gain margin) at a gain of 0.01 rad/s, "
        "diameters from 1.5 to 6 mm; damped strain to an accuracy of 1e-4, modal damping with 40 bars:"
    )
    yield ""
    yield from damped_rows()
    yield ""
    yield "And how accuracy compares with forty bars; errors against the continuous cable:"
    yield ""
    yield from accuracy_rows()
