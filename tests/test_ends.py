"""`control/ends.py`: the continuous cable, DESIGN section 6 on dense bars, symmetry, passivity, damping."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from cables import along_x, condensed_stiffness
from campaign import campaign
from mpmath import mp
from random_scenes import scene_data, scene_of, truth_of
from references import bars, continuous_cable, loop_matrix
from scenes import INCLINED, PAPER, SAGGING, Twin, scene

from cablestudy.errors import NoSolutionError
from cablestudy.study.one_cable.case import CableCase

ORDER = 24
CABLES = {"taut": PAPER, "sagging": SAGGING, "inclined": INCLINED, "downhill": Twin(175.68, -60.49, 184.4883)}
PARAMETER = {"modal": "ratio", "hysteretic": "loss_factor", "kelvin_voigt": "time"}
DAMPINGS = [
    ("modal", 0),
    *(("hysteretic", factor) for factor in (0, 1e-3, 2)),
    *(("kelvin_voigt", time) for time in (0, 1e-5, 1e-3, 2)),
]
SOME = [("modal", 0.01), ("modal", 2), *DAMPINGS[2:4], *DAMPINGS[5:]]


def damped(law, amount):
    return f"cable.damping={{model: {law}, {PARAMETER[law]}: {amount!r}}}"


@cache
def spectral(name, law, amount):
    """One element of high order."""
    return CableCase(CABLES[name].scene("model.accuracy=1e-8", damped(law, amount))).refined(1, ORDER).end_model


@cache
def of_bars(name, law, amount, elements=40):
    """The paper's model."""
    return CableCase(CABLES[name].scene(f"model.elements={elements}", damped(law, amount))).end_model


@cache
def condensed_of_bars(name):
    """Static stiffness between the ends of the paper's model."""
    case = CableCase(CABLES[name].scene("model.elements=40"))
    return case.span.frame.T @ case.dynamics.end_stiffness @ case.span.frame


@cache
def continuous(name, omega, eta):
    return continuous_cable.dynamic_stiffness_both_ends(*CABLES[name].cable, omega, n=40, eta=eta)


def loss(law, amount, omega):
    """Loss factor of EA (1 + i eta)."""
    return {"modal": 0.0, "hysteretic": amount, "kelvin_voigt": amount * omega}[law]


def difference(found, expected, name):
    """Largest, each entry against the static stiffness of its two directions or the largest entry there is."""
    static = np.diag(continuous(name, 0.0, 0.0))
    unit = np.sqrt(np.outer(static, static)) * max(1.0, np.abs(expected).max() / static.max())
    return (np.abs(found - expected) / unit).max()


# ---- the continuous cable -------------------------------------------------------------------------------------------


@pytest.mark.crossed
@pytest.mark.parametrize(("law", "amount"), DAMPINGS)
@pytest.mark.parametrize("name", CABLES)
def test_all_modes_together_are_the_continuous_cable(name, law, amount):
    """In global axes; the range of order p is p transverse modes, here p = 24."""
    model = spectral(name, law, amount)
    first = np.pi / CABLES[name].length * np.sqrt(1344.75 / CABLES["taut"].mass)
    first = first if name != "sagging" else model.omega[0]
    for share, tolerance in ((0.0, 1e-10), (0.01, 1e-10), (0.37, 1e-10), (2.6, 1e-9), (6.15, 1e-9), (8.4, 1e-6)):
        omega = share * first
        found = model.dynamic_stiffness(np.array([1j * omega]))[0]
        expected = continuous(name, omega, loss(law, amount, omega) if omega else 0.0)
        assert difference(found, expected, name) < tolerance, share


@pytest.mark.crossed
@pytest.mark.parametrize(("order", "mode"), [(32, 12), (40, 16), (48, 20)])
@pytest.mark.parametrize("name", ["taut", "sagging"])
def test_up_to_two_fifths_of_the_order(name, order, mode):
    """1e-6 at transverse mode 0.4 p of an element of order p; at 0.5 p it is 1e-2 to 1e-4 for p = 32 to 48."""
    case = CableCase(CABLES[name].scene("model.accuracy=1e-8", damped("hysteretic", 0.01))).refined(1, order)
    modes = case.dynamics.modes(1000)
    across = 2 * np.pi * modes.frequency[modes.select("out-of-plane")]
    omega = float(across[mode - 1] + 0.4 * (across[mode] - across[mode - 1]))
    expected = continuous_cable.dynamic_stiffness_both_ends(*CABLES[name].cable, omega, n=64, eta=0.01)
    found = case.end_model.dynamic_stiffness(np.array([1j * omega]))[0]
    assert difference(found, expected, name) < 1e-6


def test_some_modes_damped_by_their_ratio():
    """Modal damping of all modes has no continuous limit; of the ten lowest it has, beside the undamped others."""
    model = spectral("sagging", "modal", 0)
    lowest = np.arange(len(model.omega)) < 10
    omega, ratio = 1.37 * model.omega[0], 0.3
    within = continuous_cable.modes(*SAGGING.cable, 7), continuous_cable.modes(*SAGGING.cable, 7, "out")
    value = np.concatenate([2 * np.pi * modes.frequencies for modes in within])
    ends = np.concatenate([modes.end_forces.reshape(-1, 6) for modes in within])
    chosen = np.argsort(value)[:10]
    value, ends = value[chosen], ends[chosen]
    gain = 1 / (value**2 - omega**2) - 1 / (value**2 - omega**2 + 2j * ratio * value * omega)
    expected = continuous("sagging", omega, 0.0) + (ends.T * gain) @ ends
    found = replace(model, damping_ratio=np.where(lowest, ratio, 0.0)).dynamic_stiffness(np.array([1j * omega]))[0]
    assert difference(found, expected, "sagging") < 1e-8


# ---- the paper's bars and the formula of DESIGN section 6 -----------------------------------------------------------


@pytest.mark.crossed
@pytest.mark.parametrize("ratio", [0.0, 1e-3, 0.01, 0.5, 2.0])
@pytest.mark.parametrize("name", ["taut", "sagging", "inclined"])
def test_modal_damping_is_the_formula_on_dense_bars(name, ratio):
    twin = CABLES[name]
    K, M = bars.matrices(twin.chain(), twin.length, twin.stiffness, twin.mass)
    inner = bars.modes(twin.chain(), twin.length, twin.stiffness, twin.mass)
    ends = np.r_[0:3, len(M) - 3 : len(M)]
    omega, psi = 2 * np.pi * inner.frequencies, inner.vectors
    p = psi.T @ K[3:-3, ends]
    model = of_bars(name, "modal", ratio)
    D = K[np.ix_(ends, ends)]
    assert np.abs(loop_matrix.feedthrough(model) - D).max() < 1e-7 * np.abs(D).max()
    for w in (0.3, 5.1, 33.0, 700.0):
        resonance = omega**2 - w**2 + 2j * ratio * omega * w
        formula = D - (p.T / resonance) @ p
        # the mass lumped on the ends is not in the formula
        expected = formula - w**2 * np.diag(M[ends])
        found = model.dynamic_stiffness(np.array([1j * w]))[0]
        assert np.abs(found - expected).max() < 1e-7 * np.abs(expected).max()
        assert np.abs(found + w**2 * model.residual_inertia - formula).max() < 1e-7 * np.abs(formula).max()


@pytest.mark.parametrize("name", ["taut", "sagging", "inclined"])
def test_residual_inertia_is_the_ends_own_mass(name):
    """With fewer modes that of the omitted ones too, never negative; a rigid movement carries the whole mass."""
    model, twin = of_bars(name, "modal", 0.01), CABLES[name]
    own = twin.mass * twin.length / 40 / 2
    assert model.residual_inertia == pytest.approx(own * np.eye(6), abs=1e-9 * own)
    for count in (60, 20, 3, 0):
        fewer = model.select(np.arange(count)).residual_inertia
        assert np.linalg.eigvalsh(fewer).min() > own * (1 - 1e-9)
    rigid = np.tile(np.eye(3), (2, 1))
    assert rigid.T @ model.inertia @ rigid == pytest.approx(twin.mass * twin.length * np.eye(3), abs=1e-9)


def test_a_critically_damped_pair_of_poles():
    # two poles meet and have one vector between them; half the digits of their place are lost, none of the sum
    model = of_bars("taut", "kelvin_voigt", 1e-5)
    mode = int(np.argmax(np.diagonal(model.strain.modes) / model.omega**2))
    time, s = float(2 * model.omega[mode] / model.strain.modes[mode, mode]), 1j * np.array([1.0, 5.0, 60.0])
    here, near = (
        replace(model, strain=replace(model.strain, amount=factor * time)).dynamic_stiffness(s)
        for factor in (1.0, 1 + 1e-9)
    )
    assert np.abs(here - near).max() < 1e-8 * np.abs(here).max()


@pytest.mark.crossed
@pytest.mark.parametrize(
    ("law", "amounts"),
    [
        ("kelvin_voigt", campaign((1e-9, 1e-4, 1e-2, 1e0, 1e2, 1e3, 1e4, 1e6, 1e9), (1e-4, 1e2, 1e9))),
        ("hysteretic", campaign((1e-6, 1e-2, 2, 1e3, 1e5, 1e7, 1e9), (1e-2, 1e3, 1e9))),
    ],
)
@pytest.mark.parametrize("name", ["taut", "sagging", "inclined"])
def test_any_damping_of_the_strain_is_right_or_refused(name, law, amounts):
    refused, chain = [], CABLES[name].chain()
    for amount in map(float, amounts):
        model = of_bars(name, law, 1e-3)
        model = replace(model, strain=replace(model.strain, amount=amount))
        s = 1j * np.array([1e-2, 5.0, 60.0])
        try:
            found = model.dynamic_stiffness(s)
        except NoSolutionError:
            refused.append(amount)
            continue
        for one, value in zip(found, s, strict=True):
            c = value * amount if law == "kelvin_voigt" else 1j * amount
            expected = bars.eliminated(chain, *CABLES[name].bar, value, c)
            own = np.sqrt(np.abs(np.diag(expected)))
            assert (np.abs(one - expected) < 1e-8 * np.outer(own, own)).all(), amount
    assert all(amount >= 1e3 for amount in refused)  # no cable has such damping
    assert refused


# seeds of `random_scenes`: cables up to 1e9 times stiffer along than across, a folded point load, slack ones
STIFF = (110003, 110006, 110040, 110041, 120017, 500000, 500040, 500045, 500048, 500096, 500104, 500136, 500145)


@pytest.mark.parametrize("seed", STIFF)
def test_a_stiff_cable_is_not_refused_and_right(seed):
    """Against the continuous cable, about the frequency of the gondola, or of the cable's first mode if it is lower."""
    data = scene_data(seed)
    case = CableCase(scene_of(data, 1e-6)).refined(1, 24)
    model, truth, mass = along_x(case), truth_of(data, case.span), case.scene.gondola.mass
    omega = min(2 * np.pi * case.gondola_mode.frequency[0], model.omega[0])
    s = (0.03 + 1j) * omega * np.array([0.01, 0.3, 0.99, 3.0])
    found = model.dynamic_stiffness(s, [3], [3])[:, 0, 0]
    for one, value in zip(s, found, strict=True):
        balance = truth.balance(-1j * one, 52, -1j * complex(model.strain.factor(one)))
        assert abs(value + mass * one**2 - balance) < 1e-10 * (abs(value) + mass * abs(one) ** 2)


@pytest.mark.parametrize(
    ("seed", "amount"),
    campaign(
        itertools.product((110003, 110041, 500048, 500096, 500104), (1e-3, 1, 30)),
        [(110003, 1e-3), (110041, 30), (500048, 1), (500096, 1e-3), (500104, 30)],
    ),
)
def test_the_sum_over_damped_modes_in_long_arithmetic(seed, amount):
    """The very modes of the model, in 50 digits: up to frequencies at which the cable's mass is all that counts."""
    model = along_x(CableCase(scene_of(scene_data(seed), 1e-6)).refined(1, 12))
    model = replace(model, strain=replace(model.strain, amount=amount * model.strain.amount))
    s = (0.05 + 1j) * np.array([0.3 * model.omega[0], 4 * model.omega[0], np.median(model.omega)])
    found, n = model.dynamic_stiffness(s, [3], [3])[:, 0, 0], len(model.omega)
    with mp.workdps(50):
        rows = {name: mp.matrix(getattr(model.strain, name).tolist()) for name in ("modes", "coupling", "ends")}
        omega, amount = [mp.mpf(w) for w in model.omega.tolist()], mp.mpf(model.strain.amount)
        carried = mp.matrix([-p / w**2 for p, w in zip(model.participation[:, 3].tolist(), omega, strict=True)])
        own = mp.mpf(model.inertia[3, 3])
        for one, value in zip(s.tolist(), found, strict=True):
            one = mp.mpc(one)
            c = one * amount if model.strain.law == "kelvin_voigt" else 1j * amount
            force = c * rows["coupling"][:, 3] + one**2 * carried
            inside = c * rows["modes"]
            for i in range(n):
                inside[i, i] += one**2 + omega[i] ** 2
            expected = mp.mpf(model.stiffness[3, 3]) + c * rows["ends"][3, 3] + own * one**2
            expected -= (force.T * mp.lu_solve(inside, force))[0]
            # the inertia of the cable is a double, and so is what is left of it
            rounding = 1e-15 * float(abs(own * one**2))
            assert abs(value - complex(expected)) < 1e-10 * abs(value) + rounding


# ---- what every law must keep ---------------------------------------------------------------------------------------

MODELS = [(name, law, amount) for name in ("taut", "sagging", "inclined") for law, amount in SOME]


@pytest.mark.parametrize(("name", "law", "amount"), MODELS)
def test_symmetric_reciprocal_and_the_same_from_both_ends(name, law, amount):
    for model in (of_bars(name, law, amount), spectral(name, law, amount)):
        found = model.dynamic_stiffness(1j * np.array([0.3, 5.0, 40.0]))
        size = np.abs(found).max(axis=(1, 2), keepdims=True)
        assert (np.abs(found - found.transpose(0, 2, 1)) < 1e-9 * size).all()
        part = model.dynamic_stiffness(1j * np.array([0.3, 5.0, 40.0]), [3, 0], [2, 5])
        assert (np.abs(part - found[:, [3, 0]][:, :, [2, 5]]) < 1e-12 * size).all()
        if name != "inclined":  # a level cable looks the same from its other end, x reversed
            swap = np.kron([[0, 1], [1, 0]], np.diag([-1.0, 1.0, 1.0]))
            assert (np.abs(found - swap @ found @ swap) < 1e-7 * size).all()


@pytest.mark.crossed
@pytest.mark.parametrize(("name", "law", "amount"), MODELS)
@pytest.mark.parametrize("chosen", [[], [0], [7], [1, 4, 30], slice(0, 20), slice(60, None), slice(None)], ids=str)
def test_the_static_limit_is_the_condensed_stiffness_for_any_modes(name, law, amount, chosen):
    condensed = condensed_of_bars(name)
    both = np.block([[condensed, -condensed], [-condensed, condensed]])
    model = of_bars(name, law, amount).select(chosen)
    assert np.abs(model.dynamic_stiffness(np.array([0j]))[0] - both).max() < 1e-12 * np.abs(both).max()
    chain = CABLES[name].chain()
    assert np.abs(condensed - chain.end_stiffness).max() < 1e-9 * np.abs(condensed).max()
    # and nothing jumps on the way there, but for the loss of the hysteretic law
    near = model.dynamic_stiffness(np.array([1e-6j]))[0]
    assert np.abs(near.real - both).max() < (3 if law == "hysteretic" else 1e-6) * np.abs(both).max()


@pytest.mark.parametrize(("name", "law", "amount"), MODELS)
def test_passive(name, law, amount):
    """The ends take energy out of any motion: Im K is positive semidefinite, whatever modes are kept."""
    for model in (of_bars(name, law, amount), spectral(name, law, amount)):
        for chosen in (slice(None), [0, 3, 5], slice(10, 40), []):
            s = 1j * np.geomspace(1e-3, 1e4, 60)
            found = model.select(chosen).dynamic_stiffness(s)
            loss_part = (found.imag + found.imag.transpose(0, 2, 1)) / 2
            smallest = np.linalg.eigvalsh(loss_part)[:, 0]
            assert (smallest >= -1e-9 * np.abs(found).max(axis=(1, 2))).all()


@pytest.mark.parametrize(("name", "law", "amount"), MODELS)
def test_a_negative_frequency_is_the_conjugate(name, law, amount):
    model, s = of_bars(name, law, amount), np.array([0.5j, 5.0j, -0.1 + 40.0j, -0.2 + 900j])
    above, below = model.dynamic_stiffness(s), model.dynamic_stiffness(s.conj())
    mixed = model.dynamic_stiffness(np.array([s[1].conj(), s[2], 0.0]))
    size = np.abs(above).max(axis=(1, 2), keepdims=True)
    assert (np.abs(below - above.conj()) < 1e-9 * size).all()
    assert (np.abs(mixed[:2] - [below[1], above[2]]) < 1e-12 * size[1:3]).all()


@pytest.mark.crossed
@pytest.mark.parametrize(("law", "amount"), SOME)
@pytest.mark.parametrize("elements", [1, 2, 3])
def test_the_smallest_models(law, amount, elements):
    """One bar has no mode: a spring, half of the mass on either end, and the loss of EA alone."""
    model = of_bars("taut", law, amount, elements)
    assert len(model.omega) == 3 * (elements - 1)
    found = model.dynamic_stiffness(np.array([2j]))[0]
    assert found.shape == (6, 6)
    if elements == 1:
        own = PAPER.mass * PAPER.length / 2
        spring = model.stiffness[3, 3] + 1j * PAPER.stiffness / PAPER.length * loss(law, amount, 2.0)
        assert [found[3, 3], found[0, 3]] == pytest.approx([spring - 4 * own, -spring], rel=1e-12)


def test_repeated_frequencies():
    # without weight the two planes are alike: every transverse mode is double
    taut = "gravity=0", "cable.unstretched_length=184.4883", "model.elements=40"
    case = CableCase(scene(*taut, damped("hysteretic", 0.1)))
    model = case.end_model
    assert (np.abs(np.diff(model.omega[:20])[::2]) < 1e-9 * model.omega[0]).all()
    found = model.dynamic_stiffness(1j * np.array([2.0, 5.0]))
    assert found[:, 4, 4] == pytest.approx(found[:, 5, 5], rel=1e-10)
    assert np.abs(found[:, 3, 4:]).max() < 1e-9 * np.abs(found).max()


# mass that couples the ends to the inside


@pytest.mark.crossed
@pytest.mark.parametrize("twin", [PAPER, SAGGING, INCLINED], ids=["taut", "sagging", "inclined"])
@pytest.mark.parametrize(("mass", "order"), [("lumped", 3), ("consistent", 1), ("consistent", 3), ("blended", 1)])
def test_every_mass_is_the_dense_matrix_condensed(twin, mass, order):
    """And at the coupled frequency, undamped, the gondola and its end balance."""
    model = "model.elements=7", f"model.order={order}", f"model.mass={mass}"
    case = CableCase(twin.scene(*model, "cable.damping.ratio=0"))
    s = np.array([2.0 + 5j, -1 + 33j, 0.3 + 90j])
    turn = np.kron(np.eye(2), case.span.frame)
    expected = np.array([turn.T @ condensed_stiffness(case.dynamics, value) @ turn for value in s])
    scale = np.sqrt(np.abs(np.diagonal(expected, axis1=1, axis2=2)))
    error = np.abs(case.end_model.dynamic_stiffness(s) - expected) / (scale[:, :, None] * scale[:, None, :])
    assert error.max() < 1e-7
    omega = 2 * np.pi * case.gondola_mode.frequency[0]
    balance = case.end_model.dynamic_stiffness(np.array([1j * omega]), [3], [3])[0, 0, 0].real
    assert balance == pytest.approx(case.scene.gondola.mass * omega**2, rel=1e-7)
