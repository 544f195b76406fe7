"""A suspension in gusts as bars: spectra of its bodies and of the tensions by dense matrices of all nodes.

The wind pushes each bar at the two points of Gauss's rule, and each body at its centre of pressure; it and
their own motion enter as the speed of the air that passes. Two places a distance r apart have the coherence
exp(-C f r/U). Displacements follow from (s^2 M + s C + K)^-1 and from nothing else; a tension is the force that holds
the end node of a cable, along the tangent there: its row of M, C and K times all displacements, less the drag on it.
"""

import numpy as np

from . import bar_suspension
from .dense import cross, state_matrix

POINTS = 0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)  # of Gauss's rule, shares of a bar


def von_karman(frequency, speed, rms, length):
    """The paper's spectrum, one-sided."""
    x = frequency * length / speed
    return 4 * rms**2 * length / speed / (1 + 70.7 * x**2) ** (5 / 6)


def _cross(vector):
    """[v x] of a complex vector."""
    x, y, z = vector
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _drag(vector, along):
    """Drag on a bar by its vector over the pressure, for wind of the direction `along`."""
    length = np.sqrt(vector @ vector)
    normal = along - vector * (vector @ along) / length**2
    return length * np.sqrt(normal @ normal) * normal


def _steps(of, vector):
    """Derivative of a function of a vector by complex steps, shape (3, 3)."""
    return np.array([of(vector + 1e-30j * step).imag / 1e-30 for step in np.eye(3)]).T


def slow_spectrum(frequency, speed, rms, length, *_):
    """Spectrum that falls with the fourth power of the frequency: no turbulence moves what can move.

    By its square resonances are left: 4e-7 of the largest variance, but 5 % of that of a tension where motions cancel.
    """
    corner = speed / length
    return 4 / np.pi * rms**2 * corner**3 / (frequency**2 + corner**2) ** 2


class BarsInWind:
    """The bars of an equilibrium, in gusts about it.

    Parameters
    ----------
    equilibrium : Equilibrium
    n : int
        Bars for each cable.
    wind : dict
        speed [m/s], direction [rad], turbulence (along, across, vertical) [m/s], length_scale [m], coherence_decay [-],
        density [kg/m^3].
    cables : sequence of float
        Drag coefficient times diameter of each. [m]
    bodies : dict
        Body -> drag areas C_d A along its axes, areas without C_d, and centre of pressure, body axes.
    damping : mapping
        Of the cables, as in a scene. [-], [s], [kg/(m s)]
    admitted : bool
        With Vickery's admittance of the bodies.
    midspans : bool
        Whether the mid-spans of the cables are outputs, along the axes of their chord frames.
    mean : bool
        Whether the mean wind acts at rest: its drag then turns with bars and bodies, by complex steps.
    """

    def __init__(
        self, equilibrium, n, wind, cables=None, bodies=None, damping=None, admitted=True, midspans=False, mean=False
    ):
        self.wind, state = wind, equilibrium
        along = np.array([np.cos(wind["direction"]), np.sin(wind["direction"]), 0.0])

        def blown(cable, vector):
            return wind["density"] / 2 * cables[cable] * wind["speed"] ** 2 * _drag(vector, along)

        cables = np.zeros(len(state.suspension.cable_names)) if cables is None else cables
        dense = bar_suspension.dense(state, n, blown if mean else None)
        loss = (damping or {}).get("loss_factor", 0.0)
        self.M, self.K, size = dense.M, dense.K + 1j * loss * dense.elastic, len(dense.K)
        self.dead = (dense.K + dense.K.T) / 2  # with the drag as a dead load, and without dead moments
        self.directions = np.array([along, [-along[1], along[0], 0.0], [0, 0, 1.0]])
        damped, self.C = dense.damping(damping or {}, state.catenary.span.mass)
        places, moves, drags, areas = [], [], [], []  # of the nodes, then of the bodies
        self.turned = {}  # cable and bar -> change of the mean drag on each of its nodes by all displacements
        ends = state.suspension.ends(state.position, state.rotation)
        for cable, (chain, move) in enumerate(zip(dense.chains, dense.maps, strict=True)):
            unit = chain.vectors / np.linalg.norm(chain.vectors, axis=1)[:, None]
            for bar, tangent in enumerate(unit):
                of_ends = [move[3 * node : 3 * node + 3] for node in (bar, bar + 1)]
                if mean:
                    rate = _steps(lambda vector, cable=cable: blown(cable, vector), chain.vectors[bar])
                    self.turned[cable, bar] = rate @ (of_ends[1] - of_ends[0]) / 2
                    self.K = self.K - sum(node.T @ self.turned[cable, bar] for node in of_ends)
                normal = along - tangent * (tangent @ along)
                across = np.linalg.norm(normal)
                matrix = across * (np.eye(3) - np.outer(tangent, tangent)) + np.outer(normal, normal) / across
                width = np.linalg.norm(chain.vectors[bar]) / 2
                for share in POINTS:
                    places.append(ends[cable, 0] + (1 - share) * chain.nodes[bar] + share * chain.nodes[bar + 1])
                    drags.append(wind["density"] / 2 * cables[cable] * wind["speed"] * width * matrix)
                    moves.append((1 - share) * move[3 * bar : 3 * bar + 3] + share * move[3 * bar + 3 : 3 * bar + 6])
        names = list(state.suspension.body_names)
        free = np.flatnonzero(state.suspension.free.ravel())
        for name, (offered, bare, center) in (bodies or {}).items():
            body, R = names.index(name), state.rotation[names.index(name)]
            arm, own = R @ np.array(center), R.T @ along
            moved = np.zeros((3, 6 * len(names)))
            moved[:, 6 * body : 6 * body + 6] = np.concatenate([np.eye(3), -cross(arm)], axis=1)
            whole = np.zeros((3, size))
            whole[:, size - len(free) :] = moved[:, free]
            places.append(state.position[body] + arm)
            moves.append(whole)
            linear = np.array(offered)[:, None] * (np.eye(3) + np.outer(own, own))
            drags.append(wind["density"] / 2 * wind["speed"] * R @ linear @ R.T)
            areas.append(np.array(bare) @ own**2)
            if mean:
                own_drag = wind["density"] / 2 * wind["speed"] ** 2 * R @ np.diag(offered) @ R.T

                def turned(w, own_drag=own_drag):
                    return (np.eye(3) + _cross(w)) @ own_drag @ (along - _cross(w) @ along)

                turns = np.zeros((3, 6 * len(names)))
                turns[:, 6 * body + 3 : 6 * body + 6] = _steps(turned, np.zeros(3))
                by_all = np.zeros((3, size))
                by_all[:, size - len(free) :] = turns[:, free]
                self.K = self.K - whole.T @ by_all
        self.places, self.moves, self.drags = np.array(places), np.array(moves), np.array(drags)
        self.areas = areas if admitted else [0.0] * len(areas)
        drag = np.einsum("kin,kij,kjm->nm", self.moves, self.drags, self.moves)
        self.C += drag
        self._rows(dense, state, n, damped, loss, midspans)

    def _rows(self, dense, state, n, of_cables, loss, midspans):
        """Outputs by z, z', z'' and by the force on each place: displacements of bodies, tensions at both ends."""
        size, sites = len(self.K), len(self.places)
        suspension = state.suspension
        free = np.flatnonzero(suspension.free.ravel())
        names = [f"{suspension.body_names[i // 6]}.{('x', 'y', 'z', 'rx', 'ry', 'rz')[i % 6]}" for i in free]
        still, unmoved, places = np.zeros(size), np.zeros((sites, 3)), np.eye(size)[size - len(free) :]
        outputs = {name: (row, still, still, unmoved) for name, row in zip(names, places, strict=True)}
        for cable, move in enumerate(dense.maps if midspans else ()):
            shares = [np.interp(n * state.catenary.middle[cable], np.arange(n + 1), one) for one in np.eye(n + 1)]
            middle = state.catenary.span.frame[cable] @ np.kron(shares, np.eye(3)) @ move
            for axis, row in zip("xyz", middle, strict=True):
                outputs[f"{suspension.cable_names[cable]}.midspan.{axis}"] = (row, still, still, unmoved)
        forces = state.end_forces
        for cable, ((k, m, elastic), move) in enumerate(zip(dense.cables, dense.maps, strict=True)):
            k = k + 1j * loss * elastic
            for end, node, rows in (("from", 0, slice(0, 3)), ("to", n, slice(-3, None))):
                tangent = -forces[cable, 0 if end == "from" else 1]
                tangent = tangent / np.linalg.norm(tangent)
                direct, damped = np.zeros((sites, 3)), tangent @ of_cables[cable][rows] @ move
                bar = 2 * (cable * n + max(node - 1, 0))
                for site, share in zip((bar, bar + 1), POINTS, strict=True):  # of the bar at that end
                    direct[site] = -tangent * (share if node else 1 - share)
                    damped = damped - direct[site] @ self.drags[site] @ self.moves[site]
                placed = tangent @ k[rows] @ move
                if self.turned:
                    placed = placed - tangent @ self.turned[cable, max(node - 1, 0)]
                name = f"{suspension.cable_names[cable]}.tension_{end}"
                outputs[name] = (placed, damped, tangent @ m[rows] @ move, direct)
        self.names = list(outputs)
        self.rows = [np.array(part) for part in zip(*outputs.values(), strict=True)]

    def spectra(self, frequency):
        """Name of each output -> one-sided spectrum at frequencies [Hz]."""
        n, wind = len(self.K), self.wind
        A = state_matrix(self.M, self.C, self.K)
        eigenvalues, vectors = np.linalg.eig(A)
        place, speed, acceleration, direct = self.rows
        inverse = np.linalg.inv(self.M)
        B = np.concatenate([np.zeros((n, n)), inverse])
        shown = np.hstack([place, speed]) + acceleration @ A[n:]
        given, shown = np.linalg.solve(vectors, B), shown @ vectors
        pushes = np.einsum("kij,kin->kjn", self.drags, self.moves)  # on z by speeds at each place
        straight = np.einsum("oki,kij->okj", direct, self.drags)
        apart = np.linalg.norm(self.places[:, None] - self.places[None], axis=-1)
        admitted = np.ones(len(self.places))
        found = np.zeros((len(self.names), len(frequency)))
        for step, f in enumerate(frequency):
            response = (shown / (2j * np.pi * f - eigenvalues)) @ given + acceleration @ inverse
            by_speeds = np.einsum("on,kjn->okj", response, pushes) + straight
            for place_, area in enumerate(self.areas):
                admitted[len(self.places) - len(self.areas) + place_] = 1 / np.sqrt(
                    1 + (f * 2 * np.sqrt(area) / wind["speed"]) ** (4 / 3)
                )
            coherence = np.exp(-wind["coherence_decay"] * f * apart / wind["speed"])
            for direction, rms in zip(self.directions, wind["turbulence"], strict=True):
                pushed = (by_speeds @ direction) * admitted
                found[:, step] += rms**2 * ((pushed @ coherence) * pushed.conj()).real.sum(axis=1)
        found *= von_karman(frequency, wind["speed"], 1.0, wind["length_scale"])
        return dict(zip(self.names, found, strict=True))

    def variances(self, frequency):
        """Name of each output -> its variance and that of its rate, by the trapezoid rule, flat below the lowest."""
        found = {}
        for name, spectrum in self.spectra(frequency).items():
            both = [spectrum, (2 * np.pi * frequency) ** 2 * spectrum]
            whole = [np.trapezoid(part * frequency, np.log(frequency)) for part in both]
            found[name] = whole[0] + spectrum[0] * frequency[0], whole[1]
        return found

    def slow(self):
        """Name of each output -> its RMS in gusts that are slow, the same everywhere and along the mean wind."""
        place, *_, direct = self.rows
        push = np.einsum("kij,kin,j->n", self.drags, self.moves, self.directions[0])
        straight = np.einsum("oki,kij,j->o", direct, self.drags, self.directions[0])
        changed = place @ np.linalg.solve(self.K, push) + straight
        return dict(zip(self.names, self.wind["turbulence"][0] * np.abs(changed), strict=True))
