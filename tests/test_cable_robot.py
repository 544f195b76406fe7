"""configs/suspensions/cable-robot.yaml against straight massless cables, computed by hand with numpy."""

import numpy as np
import pytest
import yaml
from command import ROOT, run, study_file, table_of
from references.dense import cross
from scipy.linalg import eigh
from scipy.optimize import lsq_linear

ROBOT = ROOT / "configs" / "suspensions" / "cable-robot.yaml"
MASSLESS = ("--set", "cable.mass_per_length=1e-12 kg/m")
EA, MASS, GRAVITY, REFERENCE, LEAST, LARGEST = 300e3, 12.0, 9.81, 300.0, 50.0, 1000.0
CENTER, INERTIA = np.array([0.01, 0.0, -0.05]), np.diag([0.25, 0.3, 0.4])
NAMES = [f"c{k}" for k in range(1, 9)]
AXES = ("x", "y", "z", "rx", "ry", "rz")


def meters(values):
    return np.array([float(str(value).removesuffix(" m")) for value in values])


class Straight:
    """The platform at a place, its attitude zero, on straight cables."""

    def __init__(self, place):
        scene = yaml.safe_load(ROBOT.read_text(encoding="utf-8"))
        attachments = scene["bodies"]["platform"]["attachments"]
        ends = [(cable["from"], cable["to"].partition(".")[2]) for cable in scene["cables"].values()]
        self.arms = np.array([meters(attachments[to]) for _, to in ends])
        lines = np.array([meters(scene["points"][start]) for start, _ in ends]) - self.arms - place
        self.chords = np.linalg.norm(lines, axis=1)
        self.directions = lines / self.chords[:, None]
        # forces and moments about the reference point by unit tensions, shape (6, 8)
        self.wrenches = np.vstack([self.directions.T, np.cross(self.arms, self.directions).T])
        weight = np.array([0.0, 0.0, -MASS * GRAVITY])
        self.load = np.concatenate([weight, np.cross(CENTER, weight)])

    def tensions(self):
        """Closest to the reference within the limits: particular solution and a bounded problem in the null space."""
        particular = np.linalg.lstsq(self.wrenches, -self.load, rcond=None)[0]
        null = np.linalg.svd(self.wrenches)[2][6:].T
        found = lsq_linear(null, REFERENCE - particular)
        tensions = particular + null @ found.x
        assert LEAST < tensions.min() < tensions.max() < LARGEST  # so that the limits do not matter
        return tensions

    def stiffness(self, tensions):
        """Sum over straight cables of EA/L0 u u^T + T/L (1 - u u^T), and of the moments of tensions and weight."""
        whole = np.zeros((6, 6))
        for arm, u, chord, tension in zip(self.arms, self.directions, self.chords, tensions, strict=True):
            length = chord / (1 + tension / EA)
            along = np.outer(u, u)
            moved = np.hstack([np.eye(3), -cross(arm)])
            whole += moved.T @ (EA / length * along + tension / chord * (np.eye(3) - along)) @ moved
            whole[3:, 3:] -= cross(tension * u) @ cross(arm)
        whole[3:, 3:] -= cross(self.load[:3]) @ cross(CENTER)
        return whole

    def frequencies(self, tensions):
        mass = np.zeros((6, 6))
        mass[:3, :3] = MASS * np.eye(3)
        mass[:3, 3:] = -MASS * cross(CENTER)
        mass[3:, :3] = mass[:3, 3:].T
        mass[3:, 3:] = INERTIA - MASS * cross(CENTER) @ cross(CENTER)
        stiffness = self.stiffness(tensions)
        assert np.abs(stiffness - stiffness.T).max() < 1e-9 * np.abs(stiffness).max()  # it is in equilibrium
        return np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)


def printed_stiffness(*options):
    rows = table_of("static", ROBOT, "--table", "stiffness", *options)
    return np.array([[row[next(name for name in row if name.split("_")[0] == axis)] for axis in AXES] for row in rows])


@pytest.mark.parametrize("place", [(0.0, 0.0, 1.5), (0.8, -0.4, 1.9)])
def test_tensions_stiffness_and_frequencies_of_straight_cables(place):
    at = ("--set", f"bodies.platform.at={[float(x) for x in place]}")
    straight = Straight(np.array(place))
    tensions = straight.tensions()
    cables = table_of("static", ROBOT, "--table", "cables", *MASSLESS, *at)
    assert [row["name"] for row in cables] == NAMES
    found = np.array([row["preload_N"] for row in cables])
    assert found == pytest.approx(tensions, rel=1e-6)
    assert straight.wrenches @ found == pytest.approx(-straight.load, abs=1e-6)
    lengths = [row["unstretched_length_m"] for row in cables]
    assert lengths == pytest.approx(straight.chords / (1 + tensions / EA), rel=1e-9)
    expected = straight.stiffness(found)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert printed_stiffness(*MASSLESS, *at) / scale == pytest.approx(expected / scale, abs=1e-9)
    modes = table_of("modes", ROBOT, *MASSLESS, *at, "-n", "6")
    found = [row["frequency_Hz"] for row in modes]
    assert found == pytest.approx(straight.frequencies(tensions), rel=1e-6)


def test_the_weight_of_the_ropes_hardly_changes_the_stiffness():
    expected = Straight(np.array([0.0, 0.0, 1.5]))
    diagonal = np.diag(expected.stiffness(expected.tensions()))
    assert np.diag(printed_stiffness()) == pytest.approx(diagonal, rel=1e-2)


def test_a_reference_of_the_tensions_varies_as_a_number(tmp_path):
    text = "vary: [{tensions.reference: [200 N, 0.3 kN]}]\ncolumns: [min_tension]\n"
    study = study_file(tmp_path, text, ROBOT)
    rows = table_of("sweep", study, "--no-write", "--where", "tensions.reference > 250 N")
    assert [row["tensions.reference_N"] for row in rows] == [300.0]


def test_a_pose_that_pulling_cables_cannot_hold_is_refused():
    """At x = 2 m, z = 0.75 m no tensions of at least 50 N balance the weight, by linear programming."""
    from scipy.optimize import linprog

    straight = Straight(np.array([2.0, 0.0, 0.75]))
    bounds = [(LEAST, LARGEST)] * 8
    assert linprog(np.ones(8), A_eq=straight.wrenches, b_eq=-straight.load, bounds=bounds).status == 2
    done = run("static", ROBOT, "--set", "bodies.platform.at=[2, 0, 0.75]", code=3)
    assert done.lines[0].startswith(f"{ROBOT}: no tensions in [50, 1000] N hold platform here; nearest: c2 at ")
