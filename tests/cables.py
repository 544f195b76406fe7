"""Builders that the tests of the core share: a `Span`, and the same cable for the 50-digit reference."""

import itertools
import math
from dataclasses import replace

import numpy as np
from mpmath import mp
from references import catenary_mp, dense

from cablestudy.cable import catenary, equilibrium, initial_length
from cablestudy.cable.assembly import masses
from cablestudy.cable.element import basis
from cablestudy.cable.meshes import mesh_segments
from cablestudy.cable.span import CORES, Span
from cablestudy.cable.stiffness import tangent_stiffness
from cablestudy.scene.scene import CableScene
from cablestudy.study.one_cable.case import CableCase

G = 9.81
AREA, MODULUS, DENSITY = 2.69e-6, 70.3e9, 1440.0  # the paper's Table 1
EA, MASS = MODULUS * AREA, DENSITY * AREA
PAPER_CHORD, PAPER_LENGTH = 185.8, 184.4883  # Table 6, row 2


def chord_span(chord, degrees, chord_strain, stiffness, mass=1.0, gravity=G, loads=(), azimuth=0.0):
    """A `Span` from its inclination; loads are (share of the unstretched length, global force)."""
    cosine, sine = _exact(degrees)
    span = Span(
        chord=float(chord),
        cosine=cosine,
        sine=sine,
        chord_strain=float(chord_strain),
        axial_stiffness=float(stiffness),
        mass=float(mass),
        gravity=float(gravity),
        horizontal=np.array([math.cos(azimuth), math.sin(azimuth), 0.0]),
    )
    if not loads:
        return span
    loads = sorted(loads, key=lambda load: load[0])
    positions = np.array([share for share, _ in loads]) * span.unstretched_length
    forces = np.array([force for _, force in loads], dtype=float) @ span.frame.T
    return replace(span, load_positions=positions, load_forces=forces)


def _exact(degrees):
    """Cosine and sine, exact at the multiples of 90 degrees."""
    if degrees in (-90, 0, 90):
        return float(degrees == 0), float(np.sign(degrees))
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def paper_span(length=PAPER_LENGTH, degrees=0.0, **other):
    """The paper's cable: EA = 70.3 GPa 2.69 mm^2, 1440 kg/m^3, between points 185.8 m apart."""
    return chord_span(PAPER_CHORD, degrees, (PAPER_CHORD - length) / length, EA, MASS, **other)


def batch(spans):
    """Many cables with equally many loads as one `Span` of arrays."""
    there = [name for name in CORES if getattr(spans[0], name) is not None]
    return Span(**{name: np.array([getattr(span, name) for span in spans]) for name in there})


def span_between(end_1, end_2, unstretched_length, axial_stiffness, mass, gravity=G, loads=()):
    """The `Span` that the package makes of a cable between two places; loads are (arc length, global force)."""
    cable = {
        "ends": [end_1, end_2], "unstretched_length": unstretched_length, "axial_stiffness": axial_stiffness,
        "mass_per_length": mass, "loads": [{"at": at, "force": np.array(force).tolist()} for at, force in loads],
    }  # fmt: skip
    return CableCase(CableScene.model_validate({"gravity": gravity, "cable": cable})).span


def chord_strain_for_tension(span, tension):
    """Chord strain of one cable with a mean tension: of a batch of one, or by the closer look that a row has."""
    strain = float(initial_length.strains_for_tension(batch([span]), np.array([tension]))[0])
    return strain if np.isfinite(strain) else initial_length.shorter_strain_for_tension(span, tension)


def chord_strain_for_sag(span, sag):
    """Chord strain of one cable with a sag."""
    strain = float(initial_length.strains_for_sag(batch([span]), np.array([sag]))[0])
    return strain if np.isfinite(strain) else initial_length.no_strain_for_sag(span, sag)


class Exact:
    """The 50-digit solution of the very numbers that a `Span` holds, in its chord frame and in doubles."""

    @mp.workdps(90)
    def __init__(self, span, start=None):
        chord, c, s = mp.mpf(span.chord), mp.mpf(float(span.cosine)), mp.mpf(float(span.sine))
        size = mp.hypot(c, s)  # a pair of doubles is a unit vector to rounding only
        c, s = c / size, s / size
        self.chord, self.c, self.s, self.span = chord, c, s, span
        self.L = chord / (1 + mp.mpf(span.chord_strain))
        self.EA = mp.mpf(span.axial_stiffness)
        self.w = mp.mpf(span.mass) * mp.mpf(span.gravity)
        self.loads = tuple(
            (min(mp.mpf(place), self.L), self.to_global(force))
            for place, force in zip(span.load_positions, span.load_forces, strict=True)
        )
        self.force0 = catenary_mp.solve_loaded((chord * c, 0, chord * s), self.L, self.EA, self.w, self.loads, start)

    def to_global(self, vector):
        q, n, y = (mp.mpf(float(v)) for v in vector)
        return (q * self.c - n * self.s, y, q * self.s + n * self.c)

    def to_chord(self, vector):
        x, y, z = vector
        return (x * self.c + z * self.s, z * self.c - x * self.s, y)

    def _tensions_at_corners(self):
        """Tension vectors at both sides of every end and load, global."""
        pieces = catenary_mp._pieces(self.force0, self.L, self.w, self.loads)
        return [(force, (*force[:2], force[2] + self.w * length)) for _, force, length in pieces]

    @mp.workdps(90)
    def mean_tension(self):
        return float(catenary_mp.mean_tension_loaded(self.force0, self.L, self.w, self.loads))

    @mp.workdps(90)
    def max_tension(self):
        ends = itertools.chain.from_iterable(self._tensions_at_corners())
        return float(max(mp.norm(mp.matrix(force)) for force in ends))

    @mp.workdps(90)
    def min_tension(self):
        lowest = []
        for first, last in self._tensions_at_corners():
            level = mp.hypot(first[0], first[1])
            inside = first[2] < 0 < last[2]
            lowest.append(level if inside else min(mp.norm(mp.matrix(f)) for f in (first, last)))
        return float(min(lowest))

    @mp.workdps(90)
    def stretched_length(self):
        return float(catenary_mp.stretched_length_loaded(self.force0, self.L, self.EA, self.w, self.loads))

    @mp.workdps(90)
    def sag(self):
        return float(catenary_mp.sag_loaded(self.force0, self.L, self.EA, self.w, self.loads))

    @mp.workdps(90)
    def at(self, share):
        """Displacement from the straight chord in unstretched lengths, and the tension vector; chord frame."""
        s = mp.mpf(share) * self.L
        place = self.to_chord(catenary_mp.shape_loaded(self.force0, s, self.L, self.EA, self.w, self.loads))
        force = self.to_chord(catenary_mp.tension_vector(self.force0, s, self.L, self.w, self.loads))
        displacement = (place[0] / self.L - self.chord / self.L * mp.mpf(share), place[1] / self.L, place[2] / self.L)
        return np.array(displacement, dtype=float), np.array(force, dtype=float)

    @mp.workdps(90)
    def end_stiffness(self):
        K = catenary_mp.end_stiffness_loaded(self.force0, self.L, self.EA, self.w, self.loads)
        R = mp.matrix([[self.c, 0, self.s], [-self.s, 0, self.c], [0, 1, 0]])
        return np.array((R * K * R.T).tolist(), dtype=float)


def graded_error(K, reference):
    """Largest entry of a difference of stiffnesses, each relative to sqrt(K_ii K_jj)."""
    d = np.sqrt(np.abs(np.diag(reference)))
    return float(np.max(np.abs(K - reference) / np.outer(d, d)))


CABLES = {
    "taut": paper_span(),
    "sagging, 19 degrees": paper_span(186.0, degrees=19),
    "slack, loads in space": chord_span(100, -30, -0.3, 1e5, loads=[(0.3, (10, 40, -300)), (0.7, (0, -80, 90))]),
}


def solved(span, elements, order=1, mass="lumped"):
    """Closed form of one cable, and its elements in equilibrium."""
    start = catenary.solve(span)
    return start, equilibrium.solve(start, mesh_segments(start.segments.fraction, elements, order, mass))[0]


def state_of(span, elements=6, order=1, mass="lumped"):
    """Elements of one cable in equilibrium."""
    return solved(span, elements, order, mass)[1]


def gradient(mesh):
    """Derivatives at the Gauss points of what the nodes of a mesh have, shape (points, nodes). [-]"""
    found, order = np.zeros((mesh.elements * mesh.order, mesh.nodes)), mesh.order
    for e in range(mesh.elements):
        begin = e * order
        found[begin : begin + order, begin : begin + order + 1] = basis(order).derivative / mesh.sizes[e]
    return found


def matrices_of_all_nodes(case):
    """Stiffness, its elastic part and mass of all nodes of the cable of a case, chord frame, dense."""
    nodes, length = case.state.mesh.nodes, float(case.span.unstretched_length)
    K, E, M = (np.zeros((3 * nodes, 3 * nodes)) for _ in range(3))
    for system in case.dynamics.systems:
        index = (3 * np.arange(nodes)[:, None] + np.array(system.axes)).ravel()
        shapes = np.eye(len(index)).reshape(nodes, len(system.axes), -1)
        K[np.ix_(index, index)] = full_stiffness(system) * case.state.force / length
        root = system.elastic_root(shapes)
        E[np.ix_(index, index)] = root.T @ root * case.state.force / length
        M[np.ix_(index, index)] = full_mass(system).toarray() * float(case.span.mass) * length
    return K, E, M


def full_mass(system):
    """Sparse mass matrix of all nodes of a `System`, of a cable of unit mass, shape (nodes d, nodes d). [-]"""
    return masses(system.state.mesh, len(system.axes))[0]


def full_stiffness(system):
    """K_E + K_G of all nodes of one cable, dense, in units of force over length, shape (nodes d, nodes d). [-]"""
    state = system.state
    K = sum(tangent_stiffness(state)).toarray() * state.span.unstretched_length / state.force
    chosen = (3 * np.arange(state.mesh.nodes)[:, None] + np.array(system.axes)).ravel()
    return K[np.ix_(chosen, chosen)]


def condensed_stiffness(model, s, c=0.0):
    """(1 + c) K_E + K_G + s^2 M of all nodes of a `Dynamics`, condensed to both ends; chord axes, (6, 6). [N/m]"""
    found = np.zeros((6, 6), dtype=complex)
    for system in model.systems:
        d, nodes = len(system.axes), system.state.mesh.nodes
        chosen = (3 * np.arange(nodes)[:, None] + np.array(system.axes)).ravel()
        elastic, geometric = (part.toarray()[np.ix_(chosen, chosen)] for part in tangent_stiffness(system.state))
        inertia = full_mass(system).toarray() * float(model.mass * model.length)
        whole = (1 + c) * elastic + geometric + s**2 * inertia
        places = [*system.axes, *(axis + 3 for axis in system.axes)]
        found[np.ix_(places, places)] = dense.condensed(whole, np.r_[0:d, len(whole) - d : len(whole)])
    return found


def poles_between_fixed_ends(element):
    """Poles of the modes of a `Superelement`, upper half plane and real axis; none if rounding spoils them. [rad/s]"""
    omega, viscous = element.omega, element.viscous
    if element.coupled and len(omega):
        found = element.coupling_damping.pole_sum
        poles = np.zeros(0, dtype=complex) if found is None else found.poles
        if len(element.coupling_damping.matrices) == 2:  # of the square s^2 + s viscous
            poles = np.sqrt(viscous**2 / 4 + poles + 0j)
            poles = np.where(poles.imag < 0, -poles, poles) - viscous / 2
    else:
        ratio = (element.damping_ratio + viscous / (2 * omega)).astype(complex)
        root = np.sqrt(ratio**2 - 1)
        poles = np.concatenate([omega * (root - ratio), -omega * (root + ratio)])
    return poles[poles.imag >= 0]


def excited(case):
    """The free vibration of a `CableCase` that moving end 2 along x excites: `Dynamics`."""
    return case.dynamics if case.results.across_x[case.index] else case.in_plane


def along_x(case):
    """`Superelement` of a `CableCase` with the motion that moving its ends along x excites, and all modes of that."""
    elements, row = case.elements
    return elements.ends(excited(case).planes).superelement(case.scene.cable.damping, row)


def pole_of_mass(element, mass, damping, omega):
    """Pole of a mass, damped by itself, that is free along x on end 2 of a `Superelement`, near an undamped one.

    The secant method on the balance of its forces. [rad/s]
    """
    from scipy.optimize import newton

    def balance(s):
        own = element.dynamic_stiffness(np.array([s]), [3], [3])[0, 0, 0]
        return complex(mass * s**2 + damping * s + own)

    return newton(balance, 1j * omega, x1=(0.001 + 1j) * omega, tol=1e-12 * omega, maxiter=100)


def check_damping_ratio(case, rel):
    """The gondola's damping ratio is that of the pole of a mass, damped by the air, on end 2 of the cable of a case."""
    omega = 2 * np.pi * case.gondola_mode.frequency[0]
    pole = pole_of_mass(along_x(case), case.scene.gondola.mass, case.gondola_air_damping, omega)
    assert abs(-pole.real / abs(pole) / case.gondola_mode.damping_ratio[0] - 1) < rel
