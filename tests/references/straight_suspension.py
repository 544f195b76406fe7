"""Rigid bodies on straight massless cables, in the wind and under control, as small dense matrices.

A suspension is the plain mapping that its file would hold, all numbers in SI: `gravity`, `cable` (elastic_modulus,
area, damping), `bodies`, `cables` (from, to, unstretched_length), `winches`, `control` (measured, gain, notch with a
frequency, or "none"; in `unit_gain` PID gains, delay and bandwidth too), `actuators`, `wind`. The cables are springs
along their chords, with Kelvin-Voigt damping.
"""

from functools import cached_property

import numpy as np
import scipy.linalg
import scipy.optimize
from scipy.spatial.transform import Rotation

from .dense import cross

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
TURN = 2 * np.pi


class Straight:
    """A suspension about its equilibrium in the mean wind.

    Coordinates: the free displacements of the bodies (x y z and rotations about global axes), then the strokes of
    reaction masses. Inputs: lengths that winches reel in, and the turbulence along x y z at each body.
    """

    def __init__(self, text):
        self.text, self.gravity = text, text.get("gravity", 9.81)
        self.names, self.bodies = list(text["bodies"]), list(text["bodies"].values())
        shared = text["cable"]
        self.EA = shared["elastic_modulus"] * shared["area"]
        self.time = shared.get("damping", {}).get("time", 0.0)
        self.cables, self.wind = text["cables"], text.get("wind")
        free = [[axis in body.get("free", AXES) for axis in AXES] for body in self.bodies]
        self.free = np.flatnonzero(np.ravel(free))
        self.strokes = [one for one in text.get("actuators", {}).values() if "mass" in one]
        self.pose = np.zeros(6 * len(self.bodies))
        if self.wind is None or self.wind.get("mean", True) or not self._balanced():
            self._settle()

    # ------------------------------------------------------------------------------------------------------ statics

    def place(self, body, pose):
        """Reference point and rotation."""
        turned = Rotation.from_rotvec(pose[6 * body + 3 : 6 * body + 6]) * Rotation.from_euler(
            "ZYX", self.bodies[body].get("attitude", (0, 0, 0))[::-1]
        )
        return np.array(self.bodies[body]["at"], dtype=float) + pose[6 * body : 6 * body + 3], turned.as_matrix()

    def ends(self, cable, pose):
        """Number of the body or None, arm from its reference point and place of both ends."""
        found = []
        for end in (cable["from"], cable["to"]):
            if isinstance(end, str):
                owner, attachment = end.split(".")
                body = self.names.index(owner)
                at, turned = self.place(body, pose)
                arm = turned @ self.bodies[body]["attachments"][attachment]
                found.append((body, arm, at + arm))
            else:
                found.append((None, np.zeros(3), np.array(end, dtype=float)))
        return found

    def pulls(self, pose):
        """Of each cable both ends, the unit vector from end 1 to end 2, its tension and its lengths."""
        for cable in self.cables.values():
            one, two = self.ends(cable, pose)
            chord = two[2] - one[2]
            length, own = np.linalg.norm(chord), cable["unstretched_length"]
            yield one, two, chord / length, self.EA * (length - own) / own, length, own

    @property
    def blowing(self):
        """Mean wind."""
        angle = self.wind.get("direction", 0.0)
        return self.wind["speed"] * np.array([np.cos(angle), np.sin(angle), 0.0])

    def drag_areas(self, body):
        """C_d A along the body's axes, and the center of pressure."""
        own = self.bodies[body].get("wind")
        if own is None or self.wind is None:
            return np.zeros(3), np.zeros(3)
        return own["drag_coefficient"] * np.ones(3) * own["area"], np.array(own.get("center_of_pressure", (0, 0, 0)))

    def blown(self, body, pose, wind):
        """Drag on a body and its arm."""
        _, turned = self.place(body, pose)
        areas, center = self.drag_areas(body)
        density = self.wind.get("air_density", 1.2)
        return turned @ (density / 2 * areas * np.linalg.norm(wind) * (turned.T @ wind)), turned @ center

    def net(self, pose, wind):
        """Forces and moments on all bodies."""
        total = np.zeros((len(self.bodies), 6))
        for one, two, along, tension, *_ in self.pulls(pose):
            for (body, arm, _), force in ((one, tension * along), (two, -tension * along)):
                if body is not None:
                    total[body] += [*force, *np.cross(arm, force)]
        for number, body in enumerate(self.bodies):
            _, turned = self.place(number, pose)
            weight = np.array([0, 0, -body["mass"] * self.gravity])
            arm = turned @ np.array(body.get("center_of_mass", (0.0, 0, 0)), dtype=float)
            total[number] += [*weight, *np.cross(arm, weight)]
            if wind is not None:
                force, arm = self.blown(number, pose, wind)
                total[number] += [*force, *np.cross(arm, force)]
        return total.ravel()

    def _balanced(self):
        return np.abs(self.net(self.pose, None)[self.free]).max() < 1e-9

    def _settle(self):
        wind = self.blowing if self.wind is not None and self.wind.get("mean", True) else None

        def residual(free):
            pose = np.zeros_like(self.pose)
            pose[self.free] = free
            return self.net(pose, wind)[self.free]

        found = scipy.optimize.root(residual, np.zeros(len(self.free)), method="hybr", options={"xtol": 1e-14})
        self.pose[self.free] = found.x
        assert np.abs(found.fun).max() < 1e-7 * max(1.0, max(body["mass"] for body in self.bodies)), found.message

    @property
    def tensions(self):
        """Of each cable. [N]"""
        return np.array([pull[3] for pull in self.pulls(self.pose)])

    # ----------------------------------------------------------------------------------------------- linear model

    @cached_property
    def matrices(self):
        """M, C and K of the coordinates, and B: force per length reeled in by each winch, B' per its rate."""
        size = 6 * len(self.bodies)
        M, C, K = np.zeros((3, size, size))
        pulled = {}
        for name, (one, two, along, tension, length, own) in zip(self.cables, self.pulls(self.pose), strict=True):
            moved = np.zeros((3, size))
            for (body, arm, _), sign in ((one, -1), (two, 1)):
                if body is not None:
                    moved[:, 6 * body : 6 * body + 6] += sign * np.concatenate([np.eye(3), -cross(arm)], axis=1)
                    force, place = -sign * tension * along, slice(6 * body + 3, 6 * body + 6)
                    K[place, place] -= cross(force) @ cross(arm)
            axial = np.outer(along, along)
            K += moved.T @ (self.EA / own * axial + tension / length * (np.eye(3) - axial)) @ moved
            C += moved.T @ (self.time * self.EA / own * axial) @ moved
            pulled[name] = -moved.T @ along * (self.EA / own) * (1 + tension / self.EA)
        for number, body in enumerate(self.bodies):
            place, turn = slice(6 * number, 6 * number + 6), slice(6 * number + 3, 6 * number + 6)
            _, turned = self.place(number, self.pose)
            arm = cross(turned @ np.array(body.get("center_of_mass", (0.0, 0, 0)), dtype=float))
            entries = (*body.get("inertia", (0, 0, 0)), 0, 0, 0)[:6]
            xx, yy, zz, xy, xz, yz = entries
            inertia = turned @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turned.T
            m = body["mass"]
            M[place, place] += np.block([[m * np.eye(3), -m * arm], [m * arm, inertia - m * arm @ arm]])
            K[turn, turn] -= cross(np.array([0, 0, -m * self.gravity])) @ arm
            if self.wind is not None and self.wind.get("mean", True):
                drag, at = self.blown(number, self.pose, self.blowing)
                K[turn, turn] -= cross(drag) @ cross(at)
            K[turn, turn] = (K[turn, turn] + K[turn, turn].T) / 2
        if self.wind is not None and self.wind.get("aerodynamic_damping", True):
            C += self.drag_rate @ self.moved_by_wind
            if self.wind.get("mean", True):
                K -= self._turning_drag()
        square = np.ix_(self.free, self.free)
        M, C, K = (part[square] for part in (M, C, K))
        B = np.array([pulled[name][self.free] for name in self.text.get("winches", {})]).reshape(-1, len(self.free)).T
        for one in self.strokes:
            row, weight = (
                np.append(part, np.zeros(len(M) - len(part))) for part in (self._along(one), self._weight(one))
            )
            M = np.block([[M, one["mass"] * row[:, None]], [one["mass"] * row, np.array([[one["mass"]]])]])
            omega = TURN * one["frequency"]
            K = np.block([[K, weight[:, None]], [weight, np.array([[one["mass"] * omega**2]])]])
            C = scipy.linalg.block_diag(C, 2 * one.get("damping_ratio", 0.5) * one["mass"] * omega)
            B = np.concatenate([B, np.zeros((1, B.shape[1]))])
        for one in self.text.get("actuators", {}).values():
            if "inertia" in one:
                about = self._about(one)
                M = M - one["inertia"] * np.outer(about, about)
        return M, C, K, B, self.time * B

    def _turning_drag(self):
        """Change of the drag on bodies that turn, by differences, shape (6 b, 6 b)."""
        rate, step = np.zeros((3 * len(self.bodies), 6 * len(self.bodies))), 1e-6
        for number in range(len(self.bodies)):
            _, turned = self.place(number, self.pose)
            areas = 0.5 * self.wind.get("air_density", 1.2) * self.wind["speed"] * self.drag_areas(number)[0]
            for axis in range(3):
                turns = [Rotation.from_rotvec(sign * step * np.eye(3)[axis]).as_matrix() @ turned for sign in (1, -1)]
                one, other = (turn @ (areas * (turn.T @ self.blowing)) for turn in turns)
                rate[3 * number : 3 * number + 3, 6 * number + 3 + axis] = (one - other) / (2 * step)
        return self.moved_by_wind.T @ rate

    @cached_property
    def moved_by_wind(self):
        """Displacements of the centers of pressure, shape (3 b, 6 b)."""
        rows = []
        for number in range(len(self.bodies)):
            _, turned = self.place(number, self.pose)
            arm = turned @ self.drag_areas(number)[1]
            rows.append(np.concatenate([np.eye(3), -cross(arm)], axis=1))
        return scipy.linalg.block_diag(*rows)

    @cached_property
    def drag_rate(self):
        """Forces and moments per change of the wind at each body, by differences, shape (6 b, 3 b)."""
        rate = np.zeros((6 * len(self.bodies), 3 * len(self.bodies)))
        for number in range(len(self.bodies)):
            for axis in range(3):
                step = 1e-4 * self.wind["speed"] * np.eye(3)[axis]
                force = [self.blown(number, self.pose, self.blowing + sign * step)[0] for sign in (1, -1)]
                change = (force[0] - force[1]) / (2 * step[axis])
                arm = self.blown(number, self.pose, self.blowing)[1]
                rate[6 * number : 6 * number + 6, 3 * number + axis] = [*change, *np.cross(arm, change)]
        return rate

    @property
    def gust_forces(self):
        """Forces on the coordinates per turbulence x y z at each body."""
        return np.concatenate([self.drag_rate[self.free], np.zeros((len(self.strokes), 3 * len(self.bodies)))])

    def _body(self, one):
        return self.names.index(one.get("body") or self.names[0])

    def _axis(self, one):
        axis = np.array(one["axis"], dtype=float)
        return self.place(self._body(one), self.pose)[1] @ (axis / np.linalg.norm(axis))

    def _row(self, body, six):
        row = np.zeros(6 * len(self.bodies))
        row[6 * body : 6 * body + 6] = six
        return row[self.free]

    def _along(self, one):
        body, axis = self._body(one), self._axis(one)
        arm = self.place(body, self.pose)[1] @ np.array(one.get("at", (0, 0, 0)), dtype=float)
        return self._row(body, [*axis, *np.cross(arm, axis)])

    def _about(self, one):
        return np.append(self._row(self._body(one), [0, 0, 0, *self._axis(one)]), np.zeros(len(self.strokes)))

    def _weight(self, one):
        """Of the potential m g q (theta x a)_z."""
        axis = self._axis(one)
        return one["mass"] * self.gravity * self._row(self._body(one), [0, 0, 0, axis[1], -axis[0], 0])

    @property
    def feedback(self):
        """Of each actuator: what it measures, where it acts, gains of velocity and place, corner."""
        n, stroke, found = len(self.matrices[0]), len(self.free), []
        for one in self.text.get("actuators", {}).values():
            corner = TURN * (one.get("high_pass") or 0.0)
            if "inertia" in one:
                about = self._about(one)
                found.append((about, -about, one.get("rate_gain", 0.0), 0.0, corner))
            else:
                row = np.append(self._along(one), np.zeros(len(self.strokes)))
                gains = one.get("velocity_gain", 0.0), one.get("position_gain", 0.0)
                found.append((row, np.eye(n)[stroke], *gains, corner))
                stroke += 1
        return found

    def dynamic_stiffness(self, s):
        """With the winches at rest; s of any shape (...), found of shape (..., n, n)."""
        M, C, K, *_ = self.matrices
        s = np.asarray(s)[..., None, None]
        value = s * s * M + s * C + K
        for measured, acts, rate, place, corner in self.feedback:
            passed = s / (s + corner) if corner else 1.0
            value = value - (rate * s + place) * passed * np.outer(acts, measured)
        return value

    # ---------------------------------------------------------------------------------------------------- the loop

    @cached_property
    def measured(self):
        """P: what is measured of the coordinates."""
        control = self.text["control"]
        body = self._body(control)
        names = control.get("measured") or [axis for axis in AXES if axis in self.bodies[body].get("free", AXES)]
        rows = [self._row(body, np.eye(6)[AXES.index(name)]) for name in names]
        return np.concatenate([rows, np.zeros((len(rows), len(self.strokes)))], axis=1)

    @cached_property
    def shares(self):
        """A = W^-1 G^T (G W^-1 G^T)^-1 of as many or more winches than measured coordinates."""
        control = self.text["control"]
        weights = (control.get("allocation") or {}).get("weights", {})
        W = np.diag([1 / weights.get(name, 1.0) for name in self.text["winches"]])
        G = self.measured @ np.linalg.solve(self.dynamic_stiffness(0.0), self.matrices[3])
        return W @ G.T @ np.linalg.inv(G @ W @ G.T)

    def notch(self, s):
        """N(s)."""
        table = self.text["control"].get("notch", "none")
        if table == "none":
            return 1.0
        w1, w2 = TURN * table["frequency"], TURN * table["rolloff_frequency"]
        top = (s * s + 2 * table["damping_ratio"] * w1 * s + w1**2) / w1**2
        return top * w2**2 / (s * s + 2 * table["rolloff_damping_ratio"] * w2 * s + w2**2)

    def unit_gain(self, s):
        """L over the gain at the measured coordinates, shape (..., k, k)."""
        *_, B, rate = self.matrices
        wide = np.asarray(s)[..., None, None]
        moved = np.linalg.solve(self.dynamic_stiffness(s), (B + wide * rate) @ self.shares)
        return self.measured @ moved * (self.notch(wide) * self.law(wide))

    def law(self, s):
        """PID, delay and lag over the integral gain."""
        own = self.text["control"]
        corner = TURN * own.get("derivative_filter", 1.0)
        value = own["gain"] / s + own.get("proportional_gain", 0.0)
        value = (value + own.get("derivative_gain", 0.0) * s * corner / (s + corner)) / own["gain"]
        if "bandwidth" in own:
            value = value * TURN * own["bandwidth"] / (s + TURN * own["bandwidth"])
        return value * np.exp(-own.get("delay", 0.0) * s)

    def closed(self, gain=None, gains=None):
        """A of x' = A x; see `states`."""
        return self.states(gain, gains)["A"]

    def states(self, gain=None, gains=None):
        """The closed loop x' = A x of coordinates, rates, low-passed movements, notches and the integrals behind them.

        `gains` are those of each measured coordinate, instead of one `gain`.

        Returns a dict: `A`; rows of states for the coordinates `z` and their `rate`, for the lengths `v` that winches
        reel in and their `v_rate`, and for what each actuator exerts, `effort`, and its integral, `momentum`.
        """
        M, C, K, B, rate = self.matrices
        n, filtered = len(M), [one for one in self.feedback if one[4]]
        control = self.text.get("control")
        if control is not None and gains is None:
            gains = np.full(len(self.measured), control["gain"] if gain is None else gain)
        table = control.get("notch", "none") if control else "none"
        loops = len(self.measured) if control else 0
        own = 0 if table == "none" else 2 * loops
        size = 2 * n + len(filtered) + own + loops
        unit, A = np.eye(size), np.zeros((size, size))
        z, speed = unit[:n], unit[n : 2 * n]
        A[:n] = speed
        force = -K @ z - C @ speed
        begin, effort, momentum = 2 * n, [], []
        for measured, acts, per_rate, per_place, corner in self.feedback:
            moved, moving = measured @ z, measured @ speed
            if corner:
                low = unit[begin]
                A[begin] = corner * (moved - low)
                moved, moving = moved - low, moving - corner * (moved - low)
                begin += 1
            effort.append(per_rate * moving + per_place * moved)
            momentum.append(per_rate * moved)
            force += np.outer(acts, effort[-1])
        v = v_rate = np.zeros((B.shape[1], size))
        if loops:
            passed = self.measured @ z
            if own:
                w1, w2 = TURN * table["frequency"], TURN * table["rolloff_frequency"]
                n0, n1 = unit[begin : begin + loops], unit[begin + loops : begin + 2 * loops]
                bend = passed - 2 * table["rolloff_damping_ratio"] * w2 * n1 - w2**2 * n0
                A[begin : begin + loops], A[begin + loops : begin + 2 * loops] = n1, bend
                passed = (w2 / w1) ** 2 * (bend + 2 * table["damping_ratio"] * w1 * n1 + w1**2 * n0)
                begin += own
            A[begin:] = passed
            scaled = self.shares * gains
            v, v_rate = -scaled @ unit[begin:], -scaled @ passed
            force += B @ v + rate @ v_rate
        A[n : 2 * n] = np.linalg.solve(M, force)
        return {"A": A, "z": z, "rate": speed, "v": v, "v_rate": v_rate, "effort": effort, "momentum": momentum}

    def outputs(self, states):
        """Name -> row of states, for all that the program shows."""
        found = {}
        full = np.zeros((6 * len(self.bodies), len(states["A"])))
        moved, moving = full.copy(), full.copy()
        count = len(self.free)
        moved[self.free], moving[self.free] = states["z"][:count], states["rate"][:count]
        short = ("x", "y", "z", "rx", "ry", "rz")
        for number, (name, body) in enumerate(zip(self.names, self.bodies, strict=True)):
            six, (_, turned) = moved[6 * number : 6 * number + 6], self.place(number, self.pose)
            free = body.get("free", AXES)
            found |= {f"{name}.{a}": row for a, long, row in zip(short, AXES, six, strict=True) if long in free}
            for marker, place in body.get("markers", {}).items():
                arm = turned @ np.array(place, dtype=float)
                rows = six[:3] - cross(arm) @ six[3:]
                found |= {f"{name}.{marker}.{axis}": row for axis, row in zip("xyz", rows, strict=True)}
        winches = list(self.text.get("winches", {}))
        for name, (one, two, along, tension, _, own) in zip(self.cables, self.pulls(self.pose), strict=True):
            longer, rate = 0.0, 0.0
            for (body, arm, _), sign in ((one, -1), (two, 1)):
                if body is not None:
                    to_end = np.concatenate([along, np.cross(arm, along)])
                    place = slice(6 * body, 6 * body + 6)
                    longer, rate = longer + sign * to_end @ moved[place], rate + sign * to_end @ moving[place]
            if name in winches:
                reeled = 1 + tension / self.EA
                longer = longer + reeled * states["v"][winches.index(name)]
                rate = rate + reeled * states["v_rate"][winches.index(name)]
            row = self.EA / own * (longer + self.time * rate) + np.zeros(len(states["A"]))
            found[f"{name}.tension_from"] = found[f"{name}.tension_to"] = row
        stroke = count
        for place, (name, one) in enumerate(self.text.get("actuators", {}).items()):
            if "inertia" in one:
                found[f"{name}.momentum"], found[f"{name}.torque"] = states["momentum"][place], states["effort"][place]
            else:
                found[f"{name}.stroke"], found[f"{name}.force"] = states["z"][stroke], states["effort"][place]
                stroke += 1
        return found

    def gusts_into(self, A):
        """Input matrix of the turbulence along, across and vertical at each body, shape (states, 3 b)."""
        M, along = self.matrices[0], self.blowing / np.linalg.norm(self.blowing)
        directions = np.stack([along, np.cross([0, 0, 1.0], along), [0, 0, 1.0]])
        given = self.gust_forces @ np.kron(np.eye(len(self.bodies)), directions.T)
        found = np.zeros((len(A), given.shape[1]))
        found[len(M) : 2 * len(M)] = np.linalg.solve(M, given)
        return found

    @property
    def turbulence(self):
        """RMS of the three components of the speed. [m/s]"""
        given = self.wind["turbulence_intensity"]
        return self.wind["speed"] * np.array(given if isinstance(given, list) else [given, 0.0, 0.0])
