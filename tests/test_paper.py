"""The paper's tables, cell by cell: every printed number within one unit of its last significant digit.

The printed numbers are typed in from the paper, as text, because their digits count: trailing zeros of a whole number
are not significant, those after a point are. What the model does not reproduce stands in EXCEPTIONS with its reason
(DESIGN.md, section 9), and there the model's own value is held.
"""

import math

import numpy as np
import pytest
from cables import span_between
from command import CARLINA, CONFIGS, table_of
from printed import TABLE_2
from references import taut_string

from cablestudy.cable import taut

EA, MASS, CHORD, LENGTH, TENSION = 70.3e9 * 2.69e-6, 1440 * 2.69e-6, 185.8, 184.4883, 1344.75  # Table 1

TABLE_3 = {25: "18.8", 62: "37.6", 81: "56.4", 82: "75.2", 83: "94.0"}  # from the speed of sound
TABLE_4 = {2: ("1.5913", "1.5860"), 6: ("4.7634", "4.7572"), 10: ("7.9064", "7.9286")}  # finite elements, Irvine

STATICS = ("preload_N", "sag_m", "cable_frequency_Hz", "end_stiffness_N_per_m", "gondola_frequency_static_Hz")
# study -> columns, printed rows
TABLES = {
    "emodulus": (  # Table 5, without its wind column
        ("elastic_modulus_GPa", "symmetric_frequency_1_Hz", "symmetric_frequency_2_Hz", "symmetric_frequency_3_Hz",
         "axial_frequency_1_Hz", "axial_frequency_2_Hz", "end_stiffness_N_per_m", "sag_m",
         "gondola_frequency_static_Hz"),
        ["70    1.59 4.76 7.90 18.9 37.8 1024 0.121 0.72",
         "23.4  1.60 4.80 7.96 11.1 22.2 346  0.119 0.42",
         "7     1.64 4.91 8.15 6.37 12.7 109  0.114 0.24"],
    ),
    "preload": (  # Table 6; the text prints the first sag as 0.601, which lost a zero (DESIGN.md, section 9)
        ("preload_N", "unstretched_length_m", "sag_m", "end_stiffness_N_per_m", "cable_frequency_Hz",
         "gondola_frequency_static_Hz"),
        ["24200 183.195 0.0601 9287 2.26 2.17",
         "12100 184.488 0.121  9219 1.59 2.16",
         "6056  185.142 0.243  9166 1.13 2.15",
         "1363  185.668 1.081  7480 0.59 1.95",
         "933   185.734 1.580  5380 0.57 1.65",
         "361   186.000 4.088  698  0.55 0.59"],
    ),
    "density-high": (  # Table 7
        ("density_kg_per_m3", *STATICS),
        ["1440 673 0.243 1.13 1019 0.72",
         "7800 614 1.271 0.51 956  0.71"],
    ),
    "density-low": (  # Table 8
        ("density_kg_per_m3", *STATICS),
        ["1440 40  0.851 0.55 77.6 0.49",
         "7800 174 5.09  0.49 191  0.31"],
    ),
    "diameter": (  # Table 10, without its wind columns
        ("diameter_mm", "mass_kg", "preload_N", "end_stiffness_N_per_m"),
        ["1.85 0.72 1340  1020",
         "3.70 2.88 5380  4100",
         "5.55 6.47 12100 9200",
         "7.40 11.5 21508 16400"],
    ),
}  # fmt: skip

# the wind columns of Tables 5 and 10; the paper prints no drag, turbulence or gain: two fitted numbers stand in
WIND = {
    "emodulus": (("gondola_rms_mm",), ["18", "63", "196"]),
    "diameter": (
        ("gondola_rms_velocity_mm_per_s", "gondola_rms_mm"),
        ["87.5 19.6", "22.3 2.60", "9.4 0.73", "5.3 0.31"],
    ),
}

# (study, row from 1, column) -> what the model gives, and why the paper differs (DESIGN.md, section 9)
EXCEPTIONS = {
    ("density-high", 2, "preload_N"): ("696", "the printed sag of 1.271 m needs 696 N"),
    ("density-high", 2, "gondola_frequency_static_Hz"): ("0.70", "sqrt(k/M) of the printed stiffness, 956 N/m"),
    ("density-low", 1, "sag_m"): ("4.09", "the printed preload of 40 N needs 4.09 m"),
    ("density-low", 1, "gondola_frequency_static_Hz"): ("0.20", "sqrt(k/M) of the printed stiffness, 77.6 N/m"),
    ("diameter", 2, "mass_kg"): ("2.856", "printed: density x area x chord; the cable is 0.7 % shorter unstretched"),
    ("diameter", 3, "mass_kg"): ("6.427", "printed: density x area x chord; the cable is 0.7 % shorter unstretched"),
    ("diameter", 4, "preload_N"): ("21500", "rounding of the area: pi d^2/4 gives 21500 N, 16 x 2.69 mm^2 21516 N"),
}


def unit(text):
    """One unit of the last significant digit of a printed number."""
    _, point, decimals = text.partition(".")
    if point:
        return 10.0 ** -len(decimals)
    return 10.0 ** (len(text) - len(text.rstrip("0"))) if float(text) else 1.0


def agrees(value, printed, allowance=0.0):
    """Whether a number is within one unit of the last printed digit."""
    return abs(value - float(printed)) <= unit(printed) + allowance


@pytest.fixture(scope="module")
def sweeps():
    """The computed rows of every study, each computed once."""
    return {study: table_of("sweep", CONFIGS / f"{study}.yaml", "--no-write") for study in TABLES}


@pytest.fixture(scope="module")
def modes():
    """Number -> mode of the paper's cable, all of them."""
    return {row["number"]: row for row in table_of("modes", CARLINA, "-n", 117)}


def _printed():
    for study, (columns, lines) in TABLES.items():
        for row, line in enumerate(lines, 1):
            for column, text in zip(columns, line.split(), strict=True):
                yield study, row, column, text


def _allowance(study, column, cells):
    """What half a millimetre of unstretched length is worth in a cell.

    Table 6 prints lengths to 1 mm, and those of Tables 7 and 8 are known to 1 mm only. The preload T changes by the end
    stiffness times the length, and the sag w l^2/(8 T) of a taut cable as 1/T.
    """
    if study not in ("preload", "density-high", "density-low"):
        return 0.0
    change = cells["end_stiffness_N_per_m"] * 0.5e-3
    return {"preload_N": change, "sag_m": cells["sag_m"] * change / cells["preload_N"]}.get(column, 0.0)


@pytest.mark.parametrize(("study", "row", "column", "printed"), list(_printed()))
def test_tables_5_to_10(sweeps, study, row, column, printed):
    cells = sweeps[study][row - 1]
    if (study, row, column) in EXCEPTIONS:
        instead, _ = EXCEPTIONS[study, row, column]
        assert not agrees(cells[column], printed), "no longer an exception"
        # "21500" is meant to the newton
        assert abs(cells[column] - float(instead)) <= (1.0 if instead == "21500" else unit(instead))
    else:
        assert agrees(cells[column], printed, _allowance(study, column, cells))


def test_the_sweep_shows_the_printed_values_and_the_differences(sweeps):
    ends = ("_N_per_m", "_kg_per_m3", "_GPa", "_Hz", "_mm", "_kg", "_N", "_m")
    for study, row, column, printed in _printed():
        cells = sweeps[study][row - 1]
        unit = next(end for end in ends if column.endswith(end))
        name = column.removesuffix(unit)
        assert cells[f"{name}_printed{unit}"] == float(printed)
        difference = cells[column] - float(printed)
        assert cells[f"{name}_difference{unit}"] == pytest.approx(difference, rel=1e-12, abs=1e-12 * float(printed))


def test_what_section_9_says_of_the_coupled_gondola_frequency(sweeps):
    assert agrees(sweeps["density-high"][1]["gondola_frequency_Hz"], "0.73")
    assert agrees(sweeps["density-low"][0]["gondola_frequency_Hz"], "0.16")


def test_the_eleven_printed_rms_values(sweeps):
    ratios = {
        (study, column, text): row[column] / float(text)
        for study, (columns, lines) in WIND.items()
        for line, row in zip(lines, sweeps[study], strict=True)
        for column, text in zip(columns, line.split(), strict=True)
    }
    assert len(ratios) == 11
    for what, ratio in ratios.items():
        assert abs(ratio - 1) < 0.13, what
    assert np.sqrt(np.mean(np.log(list(ratios.values())) ** 2)) < 0.05
    # DESIGN.md, section 7, gives the fit's own values
    fitted = {"19.6": 18.7, "2.60": 2.50, "0.73": 0.778, "0.31": 0.346, "18": 18.7, "63": 62.4, "196": 194.8}
    for (_, column, text), ratio in ratios.items():
        if column == "gondola_rms_mm":
            assert ratio * float(text) == pytest.approx(fitted[text], rel=0.02)


def test_the_fitted_numbers_are_the_same_in_every_study():
    text = {study: (CONFIGS / f"{study}.yaml").read_text(encoding="utf-8") for study in WIND}
    for study in text.values():
        assert "base: carlina.yaml" in study
        assert not any(word in study for word in ("gain", "drag", "turbulence", "controller", "damping"))


def test_two_cells_only_need_the_allowance(sweeps):
    outside = [
        (study, row, column)
        for study, row, column, printed in _printed()
        if not agrees(sweeps[study][row - 1][column], printed)
    ]
    assert set(outside) - set(EXCEPTIONS) == {("preload", 3, "preload_N"), ("density-high", 2, "sag_m")}


def test_table_2_and_the_finite_elements_of_table_3(modes):
    for line in TABLE_2.split("\n")[1:-1]:
        number, kind, symmetry, frequency, participation = line.split()
        mode = modes[int(number)]
        assert (mode["type"], mode["symmetry"]) == (kind, symmetry), line
        assert agrees(mode["frequency_Hz"], frequency), line
        if participation == "0":
            assert mode["participation"] < 0.005, line
        else:
            assert agrees(mode["participation"], participation), line


def test_table_3_from_the_speed_of_sound():
    unstretched = span_between((0, 0, 0), (CHORD, 0, 0), CHORD, EA, MASS)
    computed = taut.axial_frequencies(5, unstretched)
    assert all(agrees(value, printed) for value, printed in zip(computed, TABLE_3.values(), strict=True))
    assert np.allclose(computed, taut_string.axial_frequencies(5, CHORD, EA, MASS), rtol=1e-14)
    # section 9: the text's 4.03e3 m/s is a slip, its own table needs 6.99e3
    assert 2 * CHORD * computed[0] == pytest.approx(math.sqrt(70.3e9 / 1440), rel=1e-14)
    assert agrees(2 * CHORD * computed[0] / 1e3, "6.99")


def test_table_4(modes):
    for number, (finite_elements, _) in TABLE_4.items():  # the paper's iteration stopped early
        assert modes[number]["frequency_Hz"] == pytest.approx(float(finite_elements), rel=2e-4)
    span = span_between((0, 0, 0), (CHORD, 0, 0), LENGTH, EA, MASS)
    # section 9: printed with the rounded preload of 1345.0 N, and without the stretch of the cable
    unstretched = span_between((0, 0, 0), (CHORD, 0, 0), CHORD, EA, MASS)
    as_printed = taut.symmetric_frequencies(3, unstretched, 1345.0)
    assert all(agrees(value, printed) for value, (_, printed) in zip(as_printed, TABLE_4.values(), strict=True))
    assert as_printed == pytest.approx(taut_string.irvine_frequencies(3, CHORD, 1345.0, MASS, EA), rel=1e-12)
    assert agrees(taut.symmetric_frequencies(1, unstretched, TENSION)[0], "1.5858")
    first, second = taut.symmetric_frequencies(2, span, TENSION)
    assert agrees(first, "1.59146")
    assert second == pytest.approx(4.77364, rel=5e-6)


def test_the_printed_mass_of_table_10_is_that_of_the_chord(sweeps):
    columns, lines = TABLES["diameter"]
    for line, row in zip(lines, sweeps["diameter"], strict=True):
        area = math.pi * float(line.split()[0]) ** 2 / 4 * 1e-6
        assert agrees(1440 * area * CHORD, line.split()[columns.index("mass_kg")])
        assert row["mass_kg"] == pytest.approx(1440 * area * LENGTH, rel=1e-12)


def test_the_reference_tables_are_the_printed_ones():
    for number, study in ((5, "emodulus"), (6, "preload"), (7, "density-high"), (8, "density-low"), (10, "diameter")):
        text = (CONFIGS / "paper" / f"table{number}.csv").read_text(encoding="utf-8")
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        columns, printed = TABLES[study]
        more, wind = WIND.get(study, ((), [""] * len(printed)))
        assert lines[0].split(",") == [*columns, *more]
        expected = [(line + " " + tail).split() for line, tail in zip(printed, wind, strict=True)]
        assert [line.split(",") for line in lines[1:]] == expected
