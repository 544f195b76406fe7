"""Suspensions in the wind against closed forms, dense matrices made here, Lyapunov's equation and a time record."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.linalg
import scipy.signal
import suspensions
from references.straight_suspension import Straight
from scenes import PAPER, cells
from scipy.spatial.transform import Rotation
from straight_scenes import (
    ACTUATORS,
    BODY_WIND,
    LOOP,
    NOTCH,
    WIND,
    case_of,
    everything,
    movement_of,
    one_axis,
    two_bodies,
    with_changes,
)

from cablestudy.control.pose_loop import first_order
from cablestudy.control.suspension import TO, Winch
from cablestudy.errors import NoSolutionError
from cablestudy.study.suspension import response
from cablestudy.study.suspension.columns import find
from cablestudy.study.suspension.rows import evaluate_suspensions
from cablestudy.system import statics
from cablestudy.system.coupled import Layout
from cablestudy.wind import gusts
from cablestudy.wind.mean import Drag, cable_loads, equilibrium_in_wind
from cablestudy.wind.peak import peak_factor
from cablestudy.wind.spectrum import speed_spectrum

TURN = 2 * np.pi
EA, G = 1e5, 9.81
RHO = 1.2
STRONG = WIND | {"mean": True, "direction": 0.7, "speed": 30.0}


def value(case, column):
    """The number in a column."""
    found = find(column).compute(case)
    return found[0] if isinstance(found, tuple) else found


# ------------------------------------------------------------------------------------------------------- mean wind


def test_a_body_on_straight_cables_in_the_mean_wind():
    """Forces that turn with the body and act at its center of pressure, against an equilibrium found here."""
    text = everything(wind=STRONG, bodies__gondola__attitude=[0.1, -0.2, 0.3])
    own, case = Straight(text), case_of(text)
    still = Straight({key: part for key, part in text.items() if key != "wind"})
    (at, turned), (before, unturned) = own.place(0, own.pose), still.place(0, still.pose)
    shift = at - before
    assert np.linalg.norm(shift) > 5e-3
    focus = shift + (turned - unturned) @ text["bodies"]["gondola"]["markers"]["focus"]
    for name, expected in (("gondola", shift), ("gondola.focus", focus)):
        found = [value(case, f"{name}.mean_{axis}") for axis in "xyz"]
        assert found == pytest.approx(1e3 * expected, abs=1e-6 * 1e3 * np.linalg.norm(shift))
    tensions = [case.in_wind.mean_tensions(name)[1] for name in text["cables"]]
    assert tensions == pytest.approx(own.tensions, rel=1e-6)


def test_a_pendulum_in_the_mean_wind():
    """The cable points along the sum of weight and drag."""
    mass, area, speed, length = 3.0, 0.7, 12.0, 5.0
    body = {"at": [0.0, 0.0, -length], "mass": mass, "free": ["x", "y", "z"], "attachments": {"a": [0.0, 0.0, 0.0]},
            "wind": {"area": area, "drag_coefficient": 1.1}}  # fmt: skip
    text = one_axis(wind=WIND | {"mean": True, "speed": speed, "direction": np.pi / 2})
    text |= {"gravity": G, "bodies": {"bob": body}}
    text["cables"] = {"c": {"from": [0.0, 0.0, 0.0], "to": "bob.a", "unstretched_length": length}}
    case = case_of(text)
    drag = RHO / 2 * 1.1 * area * speed**2
    pull = np.hypot(drag, mass * G)
    hangs = length * (1 + pull / EA)
    aside, below = hangs * drag / pull, hangs * mass * G / pull - length * (1 + mass * G / EA)
    found = [value(case, f"bob.mean_{axis}") for axis in "xyz"]
    assert found == pytest.approx([0, 1e3 * aside, -1e3 * below], abs=1e-4)
    assert case.in_wind.mean_tensions("c") == pytest.approx([pull, pull], rel=1e-8)


def test_the_mean_wind_can_be_left_out():
    text = everything(wind=STRONG | {"mean": False})
    case = case_of(text)
    assert [value(case, f"gondola.mean_{axis}") for axis in "xyz"] == [0, 0, 0]
    assert case.in_wind._equilibrium.position == pytest.approx(case.equilibrium.position, abs=1e-12)
    # the gusts keep the mean speed: the same damping as Straight, whose equilibrium is the calm one
    own, motion = Straight({k: v for k, v in text.items() if k != "control"}), case.in_wind._movement(40).motion
    found = np.linalg.eigvals(first_order(motion)[0])
    expected = np.linalg.eigvals(own.closed())
    assert np.sort(found.real[np.abs(found) < 1e4]).sum() == pytest.approx(expected.real.sum(), rel=1e-6)


def test_a_uniform_load_aslant_is_that_of_a_turned_scene():
    """Sagging cables in gravity and wind: turn the sum of both to the vertical, and nothing else changes."""
    load = np.array([4.0, -3.0, -9.0])  # per mass
    size = np.linalg.norm(load)
    turn = Rotation.align_vectors([[0, 0, -1.0]], [load / size])[0].as_matrix()
    anchors = np.array([[9.0, 1, 8], [-8, 5, 9], [-1, -9, 7], [0, 2, -9]])
    mass = np.array([0.3, 0.2, 0.5, 0.1])

    def knot(places, gravity, wind):
        cables = [suspensions.cable(tuple(place), "knot", 2e5, m, value=14.0) for place, m in zip(places, mass)]
        model = suspensions.suspension([], cables, [suspensions.point("knot", (0, 0, 0), 0.0)], gravity=gravity)
        return statics.pose(model if wind is None else replace(model, cable_wind=wind))

    aslant = knot(anchors, 9.0, mass[:, None] * (load + [0, 0, 9.0]))
    upright = knot(anchors @ turn.T, size, None)
    assert aslant.record.converged
    assert aslant.position @ turn.T == pytest.approx(upright.position, abs=1e-10)
    assert aslant.end_forces @ turn.T == pytest.approx(upright.end_forces, rel=1e-9, abs=1e-9)
    assert turn @ aslant.stiffness @ turn.T == pytest.approx(upright.stiffness, rel=1e-8, abs=1e-6)
    # energy decides where a search from afar ends: from a bad start too
    far = replace(aslant.suspension, position=aslant.position + [[3.0, -4.0, 2.0]])
    assert statics.pose(far).position == pytest.approx(aslant.position, abs=1e-9)


def heavy(free=("x", "y", "z"), to=(30.0, 0.0, 5.0), **changes):
    """A body on two cables of some mass, in one line at first."""
    to = np.array(to)
    text = one_axis(free, gravity=G, cable__density=1500.0, cable__area=1e-4, cable__elastic_modulus=1e9)
    length = float(np.linalg.norm(to)) * 0.99
    text["cables"] = {
        "west": {"from": (-to).tolist(), "to": "gondola.a", "unstretched_length": length},
        "east": {"from": to.tolist(), "to": "gondola.a", "unstretched_length": length},
    }
    return with_changes(text, wind=WIND | {"on": "cables", "mean": True, "speed": 25.0}, **changes)


def test_the_drag_of_a_cable_by_hand():
    """rho/2 C d |U_n| U_n per stretched length, U_n across the chord; both ends together carry it and the weight."""
    text = heavy(wind__direction=0.4, free=["z"])
    case = case_of(text)
    found = case.in_wind._equilibrium
    ends = found.suspension.ends(found.position, found.rotation)
    wind = 25.0 * np.array([np.cos(0.4), np.sin(0.4), 0.0])
    diameter = np.sqrt(4 * 1e-4 / np.pi)
    for cable in (0, 1):
        along = ends[cable, 1] - ends[cable, 0]
        along /= np.linalg.norm(along)
        across = wind - along * (along @ wind)
        forces, length = found.end_forces[cable], found.lengths[cable]
        mean = np.linalg.norm(forces, axis=1).mean()
        stretched = length * (1 + mean / 1e5)
        drag = RHO / 2 * 1.2 * diameter * np.linalg.norm(across) * across * stretched
        # the mean tension is not exactly that of both ends
        assert forces.sum(axis=0) == pytest.approx(drag - [0, 0, 0.15 * G * length], rel=1e-4)
    # and exactly with the mean tension that the solver states
    drag = Drag(wind, np.array(RHO), np.full(2, 1.2 * diameter), np.zeros((1, 3)), np.zeros((1, 3)))
    weight = np.array([0, 0, -0.15 * G])
    load = cable_loads(drag, found.catenary) + weight
    assert found.end_forces.sum(axis=1) == pytest.approx(load * found.lengths[:, None], rel=1e-9)


def test_a_winch_on_board_in_the_mean_wind_reels_in_weight_and_drag():
    """The static response to a winch, against the equilibria on cables a little longer and shorter in the same loads."""
    text = heavy(wind__direction=0.9, wind__speed=40.0, wind__air_density=4.0, winches={"east": {"end": "to"}})
    movement = movement_of(text)
    found = movement.equilibrium
    motion, step = movement.motion, 1e-3
    moved = np.linalg.solve(motion.stiffness, motion.driven[0])
    shown = motion.moved[0] @ moved + motion.follow[0]
    places, pulls = [], []
    for sign in (1, -1):
        lengths = found.lengths - sign * step * np.array([0, 1.0])
        state = statics.pose(replace(found.suspension, value=lengths, position=found.position))
        places.append(state.position[0])
        pulls.append(np.linalg.norm(state.end_forces, axis=-1))
    rates = np.concatenate([places[0] - places[1], (pulls[0] - pulls[1]).ravel()]) / (2 * step)
    rows = [movement.outputs[name] for name in ("gondola.x", "gondola.y", "gondola.z", "west.tension_from", "west.tension_to",
            "east.tension_from", "east.tension_to")]  # fmt: skip
    assert shown[rows, 0] == pytest.approx(rates, rel=1e-5, abs=1e-5 * np.abs(rates[:3]).max())


# ---------------------------------------------------------------------------------------------- aerodynamic damping


def damped(text):
    """2 zeta w of each mode by its pole, in order of frequency, and the modes."""
    movement = movement_of(text)
    poles = np.linalg.eigvals(first_order(movement.motion)[0])
    poles = poles[poles.imag > 0]
    return -2 * poles.real[np.argsort(np.abs(poles))], movement


def test_a_body_on_one_cable_is_damped_by_its_drag():
    """rho U C A along the wind, half of it across; a pendulum on a cable without mass swings so in both directions."""
    body = {"at": [0.0, 0.0, -5.0], "mass": 3.0, "free": ["x", "y"], "attachments": {"a": [0.0, 0.0, 0.0]},
            "wind": {"area": [0.7, 0.7, 0.2], "drag_coefficient": 1.1}}  # fmt: skip
    text = one_axis(wind=WIND | {"speed": 8.0}) | {"gravity": G, "bodies": {"bob": body}}
    text["cables"] = {"c": {"from": [0.0, 0.0, 0.0], "to": "bob.a", "unstretched_length": 4.99}}
    rates = np.sort(damped(text)[0][:2])
    along = RHO * 8.0 * 1.1 * 0.7 / 3.0
    assert rates == pytest.approx([along / 2, along], rel=1e-7)
    off = damped(with_changes(text, wind__aerodynamic_damping=False))[0][:2]
    assert off == pytest.approx([0, 0], abs=1e-9)


@pytest.mark.parametrize(("direction", "shares"), [(np.pi / 2, (1.0, 0.5)), (np.pi / 6, (0.5, 0.25)), (0.0, (0.0, 0.0))])
def test_a_taut_cable_is_damped_by_its_drag(direction, shares):
    """rho C d U_n over its mass per stretched length: whole in the direction of the wind across it, half in the other."""
    text = heavy(free=[], gravity=0.0, to=(30.0, 0.0, 0.0), cable__damping={"ratio": 0.0}, wind__mean=False,
                 wind__direction=direction)  # fmt: skip
    rates, _ = damped(text)
    strain = 1 / 0.99 - 1
    whole = RHO * 1.2 * np.sqrt(4e-4 / np.pi) * 25.0 / (0.15 / (1 + strain))
    # four modes of the lowest frequency: two planes of two cables
    assert np.sort(rates[:4]) == pytest.approx(whole * np.sort([*shares, *shares]), rel=1e-6, abs=1e-9)


# ------------------------------------------------------------------------------------ covariance of the gusts


def gusts_of(text, count=12):
    return case_of(text).in_wind._movement(count)


def exponential(kappa, shape, other, ends, others, points=400):
    """Double integral of shape(s) other(t) exp(-kappa distance), s and t along two straight cables of given ends."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    nodes, weights = (nodes + 1) / 2, weights / 2
    lengths = [np.linalg.norm(np.subtract(*pair)) for pair in (ends, others)]
    places = [np.array(pair[0]) + nodes[:, None] * np.subtract(pair[1], pair[0]) for pair in (ends, others)]
    apart = np.linalg.norm(places[0][:, None] - places[1][None], axis=-1)
    return lengths[0] * lengths[1] * (weights * shape(nodes)) @ np.exp(-kappa * apart) @ (weights * other(nodes))


def sine_alone(kappa, length):
    """Double integral of the first shape of a string with itself: exact, from the solution of the rod's equation."""
    k = np.pi / length
    return kappa * length / (k**2 + kappa**2) + 2 * k**2 * (1 + np.exp(-kappa * length)) / (k**2 + kappa**2) ** 2


@pytest.mark.parametrize("kappa_length", [1e-3, 0.3, 3.0, 30.0])
def test_the_force_of_gusts_on_the_first_shape_of_a_cable(kappa_length):
    """(rho C d U)^2 S times the double integral of the shape with exp(-kappa r), of one taut cable."""
    text = heavy(free=[], gravity=0.0, to=(30.0, 0.0, 0.0), cable__damping={"ratio": 0.01}, wind__mean=False,
                 wind__direction=np.pi / 2, wind__turbulence_intensity=[0.2, 0.0, 0.0])  # fmt: skip
    movement = gusts_of(text)
    decay, speed, length = text["wind"].get("coherence_decay", 10.0), 25.0, 30.0
    frequency = np.array([kappa_length / length * speed / decay])
    # the variance of the force on all coordinates that are half waves along y of one cable
    response_ = first_shapes(movement)
    found = movement.gusts.variance_spectra(frequency, response_[None].astype(complex))[0]
    drag = RHO * 1.2 * np.sqrt(4e-4 / np.pi) * speed
    spectrum = speed_spectrum(frequency, speed, 0.2 * speed, 25.0)[0]
    own = sine_alone(kappa_length / length, length)
    ends = [(-30.0, 0, 0), (0.0, 0, 0)], [(30.0, 0, 0), (0.0, 0, 0)]
    half = lambda s: np.sin(np.pi * s)
    both = exponential(kappa_length / length, half, half, *ends)
    assert exponential(1e-3, half, half, ends[0], ends[0]) == pytest.approx(sine_alone(1e-3, 30.0), rel=1e-6)
    # west, east, and their sum
    expected = drag**2 * spectrum * np.array([own, own, 2 * own + 2 * both])
    assert found == pytest.approx(expected, rel=2e-4)


def first_shapes(movement):
    """Combinations of coordinates: a half wave of amplitude 1 along y of the first cable, of the second, of both."""
    strips = movement.gusts.strips
    wanted = []
    for chosen in ((1, 0), (0, 1), (1, 1)):
        rows, values = [], []
        for strip, on in zip(strips, chosen, strict=True):
            along = np.linalg.norm(strip.places - strip.places[0], axis=1) / 30.0
            rows.append(strip.shapes[:, 1])
            values.append(on * np.sin(np.pi * along))
        rows, values = np.concatenate(rows), np.concatenate(values)
        found, *_ = np.linalg.lstsq(rows, values, rcond=None)
        assert np.abs(rows @ found - values).max() < 1e-5
        wanted.append(found)
    return np.array(wanted).T
