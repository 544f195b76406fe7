"""Mean displacement and peak of a gondola, and its motion within exposures and behind a mirror, in the wind."""

import numpy as np
import pytest
from command import CARLINA, run, study_file, table_of
from mpmath import mp
from references import loop_matrix
from scenes import PAPER, cells, scene
from scipy.integrate import quad
from solved import rows_as_alone
from test_windrms import PUSHED, brute, case_of, case_with, force, loop_of, rms_of

from cablestudy.errors import NoSolutionError
from cablestudy.study.one_cable.case import CableCase
from cablestudy.wind.imaging import correction_weight, exposure_weight
from cablestudy.wind.peak import peak_factor, probability_beyond

EXPOSURE, MIRROR = "exposure=10 ms", "correction={bandwidth: 20 Hz, delay: 1 ms}"
STEADY = 1.2 / 2 * 1.17 * 0.6 * 6.0**2  # drag of the mean wind in configs/carlina.yaml [N]


def exposed(frequency, exposure=0.01):
    return 1 - np.sinc(frequency * exposure) ** 2


def corrected(frequency, bandwidth=20.0, delay=1e-3):
    s = 2j * np.pi * frequency
    return np.abs(1 / (1 + 2 * np.pi * bandwidth / s * np.exp(-s * delay))) ** 2


# factors by themselves


def expected_largest(crossings):
    """Mean of the largest value where up-crossings of a level eta are independent, n exp(-eta^2/2) of them."""
    return quad(lambda eta: -np.expm1(-crossings * np.exp(-(eta**2) / 2)), 0, 40, limit=400, epsabs=1e-12)[0]


@pytest.mark.parametrize("crossings", [30.0, 300.0, 1e4, 1e8])
def test_mean_of_largest_value(crossings):
    mode = np.sqrt(2 * np.log(crossings))
    # of the expansion in 1/mode the formula has two terms; the third is -(gamma^2 + pi^2/6)/(2 mode^3)
    third = (np.euler_gamma**2 + np.pi**2 / 6) / (2 * mode**3)
    assert 0 < peak_factor(crossings / 600, 600.0) - expected_largest(crossings) < third


def test_a_peak_factor_by_hand():
    # n = e^8: sqrt(16) + 0.57722/4
    assert peak_factor(1.0, np.exp(8)) == pytest.approx(4.144304, abs=1e-6)


def test_few_crossings():
    fewest = np.sqrt(2) + 0.5772157 / np.sqrt(2)
    assert np.allclose(peak_factor(np.array([0.0, 1e-300, 1e-3, np.e / 600]), 600.0), fewest, rtol=1e-7)
    assert (np.diff(peak_factor(np.geomspace(1e-3, 1e3, 100), 600.0)) >= 0).all()


def test_a_peak_factor_without_overflow():
    assert peak_factor(1e300, 1e12) == pytest.approx(np.sqrt(2 * np.log(10) * 312), rel=1e-3)


@pytest.mark.parametrize("frequency", [0.3, 1.0, 7.7, 40.0, 159.0, 159.2, 500.0, 1234.5])
def test_sinusoid_within_exposures(frequency):
    exposure = 1e-3
    points, weights = np.polynomial.legendre.leggauss(200)
    within = exposure * (1 + points) / 2
    phase = np.arange(16)[:, None] * 2 * np.pi / 16  # exposures that begin anywhere in a period
    # about the value at mid-exposure, so that nothing cancels
    motion = np.sin(2 * np.pi * frequency * within + phase) - np.sin(np.pi * frequency * exposure + phase)
    mean = motion @ weights / 2
    variance = (motion**2 @ weights / 2 - mean**2).mean()
    assert exposure_weight(np.array([frequency]), exposure)[0] == pytest.approx(variance / 0.5, rel=1e-9)


def test_limits_of_the_weight_within_exposures():
    assert exposure_weight(np.array([0.0, 1e9]), 1.0) == pytest.approx([0.0, 1.0])
    # slow motion is a straight line: the variance of an interval, t^2/12, times (2 pi f)^2
    slow = np.array([1e-150, 1e-9])
    assert exposure_weight(slow, 2.0) == pytest.approx((2 * np.pi * slow) ** 2 * 4 / 12, rel=1e-12)


@pytest.mark.parametrize("delay", [0.0, 1e-3, 12e-3])
def test_weight_behind_a_mirror(delay):
    frequency = np.geomspace(1e-3, 1e4, 50)
    assert correction_weight(frequency, 20.0, delay) == pytest.approx(corrected(frequency, 20.0, delay), rel=1e-9)


def test_mirror_in_time():
    bandwidth, delay, frequency, steps = 5.0, 0.02, 4.0, 20_000
    step = 1 / frequency / steps  # the mirror follows what was left before the delay
    late, count = round(delay / step), 20 * steps
    motion = np.sin(2 * np.pi * frequency * step * np.arange(count))
    left, mirror = motion.tolist(), 0.0
    for now in range(count):
        left[now] -= mirror
        if now >= late:
            mirror += 2 * np.pi * bandwidth * step * left[now - late]
    rms = np.sqrt(2 * np.mean(np.square(left[-steps:])))
    assert rms**2 == pytest.approx(correction_weight(np.array([frequency]), bandwidth, delay)[0], rel=2e-3)


def test_limits_of_the_weight_behind_a_mirror():
    assert np.array_equal(correction_weight(np.array([0.0, 1e-300, 1e300]), 20.0, 1e-3), [0.0, 0.0, 1.0])


def test_unstable_mirror():
    with pytest.raises(NoSolutionError, match=r"20 Hz is unstable with a delay of 0.0125 s.*= 20 Hz"):
        correction_weight(np.ones(1), 20.0, 0.0125)
    assert np.isfinite(correction_weight(np.ones(1), 20.0, 0.0124999)).all()


# the gondola


@pytest.mark.parametrize("model", ["{elements: 40}", "{accuracy: 1e-8}"])
def test_mean_displacement_is_the_drag_over_the_stiffness(model):
    found = cells(scene(f"model={model}"), "mean_displacement", "end_stiffness")
    assert found["mean_displacement"] == pytest.approx(1e3 * STEADY / found["end_stiffness"], rel=1e-12)
    of_bars = 1e3 * STEADY / PAPER.chain().end_stiffness[0, 0]
    assert found["mean_displacement"] == pytest.approx(of_bars, rel=1e-3)
    assert cells(scene("wind.mean=false"), "mean_displacement")["mean_displacement"] == 0.0


def test_mean_displacement_of_many_cases_is_that_of_each():
    sets = [("wind.speed=3 m/s",), ("wind.mean=false",), ("gondola.area=1 m^2", "cable.preload=2 kN")]
    scenes = [scene("model={accuracy: 1e-8}", *one) for one in sets]
    assert len({row.values["mean_displacement"] for row in rows_as_alone(scenes, ["mean_displacement"])}) == 3


@pytest.mark.parametrize("sets", [(), ("winch.controller.gain=0",), ("winch=null",), ("wind.duration=60 s",)])
def test_peak_is_the_mean_and_davenport_s_factor(sets):
    row = cells(scene(*sets), "peak", "mean_displacement", "gondola_rms_open_loop", "gondola_rms_velocity_open_loop")
    rms, velocity = row["gondola_rms_open_loop"], row["gondola_rms_velocity_open_loop"]
    if not sets or "duration" in sets[0]:
        closed = cells(scene(*sets), "gondola_rms", "gondola_rms_velocity")
        rms, velocity = closed["gondola_rms"], closed["gondola_rms_velocity"]
    duration = 60.0 if sets and "duration" in sets[0] else 600.0
    mode = np.sqrt(2 * np.log(velocity / rms / (2 * np.pi) * duration))
    expected = row["mean_displacement"] + (mode + 0.5772156649 / mode) * rms
    assert row["peak"] == pytest.approx(expected, rel=1e-8)
    without = cells(scene(*sets, "wind.mean=false"), "peak")["peak"]
    assert without == pytest.approx(expected - row["mean_displacement"], rel=1e-8)


def compliance(case, frequency):
    """Size of the gondola's response to a force, the winch at rest, by all modes of the cable. [m/N]"""
    A, B = loop_matrix.matrices(loop_of(case), 0.0)
    poles, vectors = np.linalg.eig(A)
    shares = vectors[loop_matrix.place(A)] * np.linalg.solve(vectors, B)
    return np.abs((shares / (2j * np.pi * frequency[:, None] - poles)).sum(axis=1))


@pytest.mark.parametrize(("damping", "clusters"), [(200.0, 0.1), (0.0, 0.8)])
def test_peak_of_records_in_time(damping, clusters):
    """Records made of the spectrum of the gondola: their largest values in units of the RMS."""
    drag = 1.17 * damping / PUSHED if damping else 1.17
    air = ("wind.aerodynamic_damping=true", f"gondola.drag_coefficient={drag!r}") if damping else ()
    case = case_with(0.01, 0.0, *air)
    displacement, velocity = rms_of(case)[2:]
    step, count, records = 0.1, 2**13, 400
    frequency = np.fft.rfftfreq(count, step)[1:]
    spectrum = force(frequency) * (drag / 1.17) ** 2 * compliance(case, frequency) ** 2
    draw = np.random.default_rng(5).standard_normal((2, records, len(frequency)))
    amplitude = (draw[0] + 1j * draw[1]) * np.sqrt(spectrum * count / (4 * step))
    record = np.fft.irfft(np.concatenate([np.zeros((records, 1)), amplitude], axis=1), count)
    assert record.std() == pytest.approx(displacement, rel=0.03)
    rate = velocity / displacement / (2 * np.pi)
    factor = peak_factor(rate, step * count)
    # up-crossings of a lightly damped motion come in clusters, and its largest values are smaller
    assert 0 < factor - (record.max(axis=1) / record.std()).mean() < clusters


@pytest.mark.crossed
@pytest.mark.parametrize("ratio", [1e-4, 1e-2, 0.3])
@pytest.mark.parametrize("gain", [0.0, 0.3])
def test_what_is_seen_is_a_fine_integration(ratio, gain):
    case = case_with(ratio, gain, EXPOSURE, MIRROR)
    loop = loop_of(case)
    factors = {"exposure": exposed, "corrected": corrected,
               "corrected_exposure": lambda f: exposed(f) * corrected(f)}  # fmt: skip
    for name, factor in factors.items():
        expected = brute(loop, loop.gain, lambda f, factor=factor: force(f) * factor(f))[0]
        assert rms_of(case, name)[0] == pytest.approx(expected, rel=2e-5), name
    assert rms_of(case)[0] == pytest.approx(brute(loop, loop.gain, force)[0], rel=1e-5)


def test_limits_of_exposure_and_mirror():
    row = cells(scene(), "gondola_rms", "gondola_rms_velocity")
    rms, velocity = row["gondola_rms"] * 1e3, row["gondola_rms_velocity"] * 1e3  # um, um/s
    seen = cells(
        scene("exposure=1e6 s", "correction={bandwidth: 1e-6 Hz}"), "exposure", "corrected", "corrected_exposure"
    )
    assert list(seen.values()) == pytest.approx([rms] * 3, rel=1e-4)
    seen = cells(scene("exposure=1 us", "correction={bandwidth: 1e6 Hz}"), "exposure", "corrected")
    # a straight path of v t has the RMS v t/sqrt(12); the mirror lags by v/(2 pi b)
    assert seen["exposure"] == pytest.approx(velocity * 1e-6 / np.sqrt(12), rel=1e-4)
    assert seen["corrected"] == pytest.approx(velocity / (2 * np.pi * 1e6), rel=1e-4)


@pytest.mark.parametrize("mirror", ["{bandwidth: 20 Hz, delay: 12.49 ms}", "{bandwidth: 0.7 Hz, delay: 0.3 s}"])
def test_a_mirror_that_is_hardly_stable(mirror):
    case = case_with(0.01, 0.0, f"correction={mirror}")
    one = case.scene.correction
    frequency = np.unique(
        np.concatenate([np.geomspace(1e-4, 300, 60_000), one.bandwidth * np.linspace(0.9, 1.1, 30_001)])
    )
    value = compliance(case, frequency) ** 2 * force(frequency) * corrected(frequency, one.bandwidth, one.delay)
    assert rms_of(case, "corrected")[0] == pytest.approx(np.sqrt(np.trapezoid(value, frequency)), rel=1e-4)


def test_other_columns_do_not_notice_the_telescope():
    names = "gondola_rms", "gondola_rms_velocity", "gondola_rms_open_loop", "peak", "gain_margin"
    bare, seen = cells(scene(), *names), cells(scene(EXPOSURE, MIRROR), *names)
    for name in names:
        assert seen[name] == pytest.approx(bare[name], rel=1e-6)


def test_windrms_shows_them():
    row = table_of("windrms", CARLINA, "--quiet")[0]
    assert row["mean_displacement_mm"] == pytest.approx(1e3 * STEADY / PAPER.chain().end_stiffness[0, 0], rel=1e-9)
    assert {"peak_mm"} < set(row)
    assert not {"exposure_um", "corrected_um", "corrected_exposure_um"} & set(row)
    seen = table_of("windrms", CARLINA, "--quiet", "--set", EXPOSURE, "--set", MIRROR)[0]
    assert {"exposure_um", "corrected_um", "corrected_exposure_um"} < set(seen)
    assert seen["corrected_exposure_um"] < min(seen["exposure_um"], seen["corrected_um"])
    assert "exposure_um" in table_of("windrms", CARLINA, "--quiet", "--set", EXPOSURE)[0]
    assert "mean_displacement_mm" not in table_of("windrms", CARLINA, "--quiet", "--set", "wind.mean=false")[0]
    assert "peak_mm" not in table_of("windrms", CARLINA, "--quiet", "--on", "cable")[0]


def test_an_unstable_mirror_is_refused_in_one_line(tmp_path):
    (line,) = run("windrms", CARLINA, "--set", "correction={bandwidth: 20 Hz, delay: 20 ms}", code=2).lines
    assert line.endswith(
        "correction.bandwidth: an unstable mirror: with this delay it must be below 1/(4 delay) = 12.5 Hz"
    )
    study = study_file(
        tmp_path,
        "set: {correction: {bandwidth: 10 Hz, delay: 1 ms}}\n"
        "vary: [{correction.bandwidth: [10 Hz, 300 Hz]}]\ncolumns: [corrected]\n",
    )
    assert "an unstable mirror" in run("sweep", study, "--no-write", code=None).err


def test_columns_need_their_keys(tmp_path):
    study = study_file(tmp_path, "columns: [exposure, corrected, corrected_exposure]\n")
    lines = run("sweep", study, "--no-write", code=2).lines
    assert [line.rpartition("needs the key ")[2] for line in lines] == [
        "exposure, which the scene does not have",
        "correction, which the scene does not have",
        "exposure, which the scene does not have",
    ]


def test_a_case_of_the_trapezoidal_rule_has_them_too():
    from cablestudy.study.one_cable.trade import by_trapezoids

    sets = EXPOSURE, MIRROR, "winch.controller.gain=0"
    frequency = np.unique(np.concatenate([np.geomspace(1e-4, 200, 40_000), np.linspace(0.6, 0.84, 20_000)]))
    found, expected = by_trapezoids(CableCase(scene(*sets)), frequency), case_of(*sets)
    names = "exposure", "corrected", "corrected_exposure"
    assert rms_of(found, *names) == pytest.approx(rms_of(expected, *names), rel=1e-3)


def probability_of_a_level(level, crossings):
    """Of a random motion to pass a level, over its RMS, by Poisson's law for the up-crossings of its mean."""
    with mp.workdps(100):
        return float(1 - mp.ncdf(level) * mp.exp(-crossings * mp.exp(-(mp.mpf(level) ** 2) / 2)))


def test_the_probability_to_go_beyond_a_level_by_many_digits():
    for level, rate, duration in ((2.5, 0.6, 20.0), (20.0, 1.5, 600.0), (-1.0, 0.2, 3.0), (0.0, 1.0, 0.0)):
        expected = probability_of_a_level(level, rate * duration)
        assert probability_beyond(level, rate, duration) == pytest.approx(expected, rel=1e-12)
    assert probability_beyond(np.inf, 1.0, 600.0) == 0


def test_the_probability_to_go_beyond_a_level_by_random_motions():
    """Motions with a flat spectrum up to 1 Hz: sums of cosines of random phases and amplitudes, for 20 s."""
    random, frequency, time = np.random.default_rng(5), (np.arange(200) + 0.5) / 200, np.arange(0, 20.0, 0.02)
    waves = np.exp(2j * np.pi * frequency[:, None] * time)
    amplitudes = random.normal(size=(3000, 200, 2)) / np.sqrt(200)
    motions = (amplitudes[..., 0] - 1j * amplitudes[..., 1]) @ waves
    rate = np.sqrt((frequency**2).mean())
    for level in (2.0, 2.5, 3.0):
        share = (motions.real.max(axis=1) > level).mean()
        assert probability_beyond(level, rate, 20.0) == pytest.approx(share, abs=0.03)
