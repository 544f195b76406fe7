"""One scene's results, each computed the first time that a column asks for it."""

from functools import cached_property

import numpy as np

from cablestudy.cable import datum, equilibrium
from cablestudy.cable.catenary import solve, split
from cablestudy.cable.element import basis, mesh_graded, mesh_segments
from cablestudy.cable.modes import Dynamics
from cablestudy.cable.span import Span, with_loads
from cablestudy.control import ends, gondola
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study import windrms

FIRST_MODES = 16
ALL_MODES_DOF = 200  # up to here all modes cost little more than some
GONDOLA_MODES = 20  # cable modes up to so many times the gondola's frequency are summed one by one
MAX_MODES = 600  # of a large model, for its dynamics
SLIGHT = 1e-9  # damping ratio up to which its first order is exact to as much
FOLDED = 1e-12  # share of the largest tension below which a cable counts as folded
# (elements per smooth piece, order) that the accuracy loop goes through
LADDER = (
    (1, 3), (1, 4), (1, 6), (1, 8), (1, 10), (1, 13), (1, 17), (1, 22), (1, 29), (1, 38), (1, 48),
    (2, 36), (2, 48), (3, 44), (4, 44), (6, 44), (8, 48),
)  # fmt: skip
FINEST = 200  # half-waves along a smooth piece that the finest of them resolves


def span_of(scene):
    """The cable of a scene for the core, its unstretched length still to be solved where tension or sag is given.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    Span

    Raises
    ------
    NoSolutionError
        No unstretched length gives the wanted tension or sag, or a load lies beyond the cable's end.
    """
    cable = scene.cable
    delta = np.subtract(cable.end_2, cable.end_1)
    chord, horizontal = cable.chord_length, np.hypot(delta[0], delta[1])
    span = Span(
        chord=chord,
        cosine=horizontal / chord,
        sine=delta[2] / chord,
        chord_strain=0.0,
        axial_stiffness=cable.axial_stiffness,
        mass=cable.mass_per_length,
        gravity=scene.gravity,
        azimuth=delta[:2] / horizontal if horizontal > 0 else np.array([1.0, 0.0]),
    )
    span = with_loads(span, [(load.at, load.force) for load in cable.loads])
    if cable.unstretched_length is not None:
        strain = (chord - cable.unstretched_length) / cable.unstretched_length
    elif cable.preload is not None:
        strain = datum.chord_strain_for_tension(span, cable.preload)
    else:
        strain = datum.chord_strain_for_sag(span, cable.sag)
    span = span.with_chord_strain(strain)
    if len(span.load_positions) and span.load_positions[-1] >= span.unstretched_length:
        raise NoSolutionError(
            f"the load at {span.load_positions[-1]:.6g} m is beyond the cable's end, at {span.unstretched_length:.6g} m"
        )
    return span


class Case:
    """A scene and what follows from it.

    Parameters
    ----------
    scene : Scene
    mesh : Mesh, optional
        The discretisation of the motion about the closed-form statics; without it the scene's own model.
    """

    def __init__(self, scene, mesh=None):
        self.scene, self._mesh, self._per_piece = scene, mesh, 1
        self._modes = None

    @property
    def exact_statics(self):
        """Whether statics and end stiffness are the closed form's, and not those of a fixed number of elements."""
        return self.scene.model.elements is None

    @cached_property
    def span(self):
        """The cable, its unstretched length known."""
        return span_of(self.scene)

    @cached_property
    def catenary(self):
        """The closed-form equilibrium.

        Raises
        ------
        NoSolutionError
            A weightless slack cable, or one that would break.
        ConvergenceError
            No equilibrium was found.
        """
        catenary = solve(self.span)
        if not catenary.record.converged:
            if not self.span.weight and not self.span.load_forces.any():
                raise NoSolutionError("a slack cable without weight has no definite form")
            raise ConvergenceError(f"catenary: no convergence in {int(catenary.record.steps)} steps", catenary.record)
        return catenary

    @cached_property
    def discrete(self):
        """(state, convergence) of the elements.

        Raises
        ------
        ConvergenceError, NoSolutionError
            No equilibrium of the elements, or a cable that hangs folded.
        """
        if self.catenary.min_tension <= FOLDED * self.catenary.max_tension:
            raise NoSolutionError("the cable hangs folded: somewhere it has no tension, and no stiffness about it")
        if self._mesh is not None:
            return equilibrium.from_catenary(self.catenary, self._mesh), None
        model = self.scene.model
        try:
            mesh = mesh_segments(split(self.span).fraction, model.elements, model.order, model.mass)
        except ValueError as error:
            raise NoSolutionError(str(error)) from None
        return equilibrium.solve(self.catenary, mesh)

    def refined(self, elements, order):
        """The same case with spectral elements on the closed-form statics: so many for each smooth piece."""
        fractions = self.catenary.segments.fraction
        other = Case(self.scene, mesh_graded(fractions, self.catenary.bends, elements, order))
        other._per_piece = elements
        other.__dict__.update({name: self.__dict__[name] for name in ("span", "catenary") if name in self.__dict__})
        return other

    def waves(self, frequency):
        """Transverse half-waves along the longest smooth piece at a frequency [Hz], and how far the cable turns [rad].

        By the speed of waves across the cable, sqrt(T/(m stretch)).
        """
        state, span = self.discrete[0], self.span
        slow = np.sqrt(span.mass * state.stretch / (state.tension * state.force))
        time = (state.mesh.sizes[:, None] * basis(state.mesh.order).weights * slow).sum(axis=1)
        # elements of one piece follow each other and are alike
        longest = 2 * frequency * span.unstretched_length * time.max() * self._per_piece
        turn = np.sqrt(((state.direction - state.direction[0, 0]) ** 2).sum(axis=-1)).max()
        return float(longest), float(turn)

    @cached_property
    def statics(self):
        """What the equilibrium looks like: `Statics`."""
        if self.exact_statics:
            return ClosedStatics(self.catenary)
        return DiscreteStatics(self.catenary, *self.discrete)

    @cached_property
    def dynamics(self):
        """The free vibration of the elements."""
        span = self.span
        return Dynamics(self.discrete[0], span.unstretched_length, span.mass, span.planar)

    @cached_property
    def end_stiffness(self):
        """Static stiffness of end 2, end 1 fixed, along x, y, z, shape (3, 3). [N/m]"""
        local = self.catenary.end_stiffness if self.exact_statics else self.dynamics.end_stiffness
        frame = self.span.frame
        stiffness = frame.T @ local @ frame
        return np.where(np.abs(stiffness) > 1e-15 * np.abs(stiffness).max(), stiffness, 0.0)

    def modes(self, count):
        """At least the `count` lowest modes, or all there are."""
        if self._modes is None or (len(self._modes) < count and not self._modes.complete):
            everything = self.dynamics.dof <= ALL_MODES_DOF
            self._modes = self.dynamics.all() if everything else self.dynamics.lowest(count)
        return self._modes

    def modes_up_to(self, frequency):
        """All modes up to a frequency [Hz], and at least one beyond it where there is one."""
        count = FIRST_MODES
        while True:
            modes = self.modes(count)
            if modes.complete or modes.frequency[-1] > frequency:
                return modes
            count *= 2

    def frequency(self, number, kind, symmetry=None):
        """Frequency of mode `number` (from 1) of a kind and symmetry. [Hz]

        Raises
        ------
        NoSolutionError
            The model has no such mode.
        """
        count = FIRST_MODES
        while True:
            modes = self.modes(count)
            found = modes.select(kind, symmetry)
            if len(found) >= number:
                return float(modes.frequency[found[number - 1]])
            if modes.complete:
                words = " ".join(word for word in (symmetry, kind) if word)
                raise NoSolutionError(f"the model has {len(found)} {words} modes, not {number}")
            count *= 2

    def participation(self, modes):
        """psi^T K21 e_x of end 2 for each mode, shape (k,). [N/(m sqrt(kg))]"""
        return modes.participation @ self.span.frame[:, 0]

    @cached_property
    def end_inertia(self):
        """How the cable's mass weighs on end 2 moving along x: s_0 [kg], s_1 [kg s^2], s_2 [kg s^4].

        With u the static shape of that movement and g = M u inside: s_0 = u^T M u, s_1 = g^T K^-1 g,
        s_2 = g^T K^-1 M K^-1 g. The mode k has the share p^2/W^(4 + 2 j) of s_j.
        """
        dynamics, along = self.dynamics, self.span.frame[:, 0]
        moments = np.zeros(3)
        for system in dynamics.systems:
            axes = len(system.axes)
            shape = (system.end_shapes @ along[list(system.axes)]).ravel()
            weighted = system.full_mass() @ shape
            inner = weighted[axes:-axes]
            moved, _ = system.solve(inner)
            moments += shape @ weighted, inner @ moved, moved @ (system.mass @ moved)
        mass = dynamics.mass * dynamics.length
        return moments * mass * (mass * dynamics.length / dynamics.state.force) ** np.arange(3)

    @cached_property
    def end_model(self):
        """The cable as its ends feel it, with every mode that the model in use can give."""
        count = min(self.dynamics.dof, MAX_MODES)
        return ends.of_cable(self.dynamics, self.modes(count), self.span.frame, self.scene.cable.damping)

    @cached_property
    def loop(self):
        """The winch loop: `control.winch.Loop`."""
        return windrms.loop_of(self)

    @cached_property
    def response(self):
        """What the wind does to the gondola: `windrms.Response`."""
        return windrms.response_of(self, self.loop)

    @cached_property
    def open_response(self):
        """The same with the winch at rest: all there is without a controller, and where the loop is unstable."""
        loop = self.loop
        stable = not loop.gain or not loop.passages.unstable_poles(loop.gain)
        return self.response if stable else windrms.response_of(self, loop.at_rest)

    @cached_property
    def gondola_damping_ratio(self):
        """Of the coupled mode in which the gondola moves most. [-]

        Newton on k_xx(s) + M s^2 from the undamped frequency: what little the damping moves the pole is not lost in
        the rounding of an eigenvalue.

        Raises
        ------
        NoSolutionError
            So much damping that no oscillation is left of that mode.
        """
        loop, here = self.loop, 2j * np.pi * self.gondola_frequency
        mass, start = self.scene.gondola.mass, abs(here)
        if loop.cable.strain is not None:
            little = gondola.slight_damping(loop.cable, mass, start)
            if little < SLIGHT:
                return little

        def balance(s):
            return complex(loop.stiffness(np.array([s]))[0][0]) + mass * s * s

        for _ in range(60):
            step = 1e-4 * abs(here)
            slope = (balance(here + 1j * step) - balance(here - 1j * step)) / (2j * step)
            change = -balance(here) / slope
            change *= min(1.0, 0.2 * abs(here) / abs(change)) if change else 1.0
            here += change
            if abs(change) <= 1e-12 * min(abs(here.real), abs(here)):
                break
        if here.real < 0 and abs(here.imag) < 1e-6 * abs(here):
            return 1.0  # it creeps back
        if not (0.3 * start < abs(here) < 3 * start and here.imag > 0 and here.real < 0):
            raise NoSolutionError("the gondola's mode is damped so much that it is no oscillation")
        return float(-here.real / abs(here))

    @cached_property
    def gondola_frequency_static(self):
        """sqrt(k/M)/(2 pi). [Hz]"""
        return gondola.static_frequency(self.scene.gondola.mass, self.end_stiffness[0, 0])

    @cached_property
    def gondola_frequency(self):
        """Frequency of the coupled mode in which the gondola moves most. [Hz]"""
        found = self.gondola_frequency_static
        while True:
            limit = GONDOLA_MODES * found
            modes = self.modes_up_to(limit)
            frequency, share = gondola.coupled_modes(
                self.scene.gondola.mass,
                self.end_stiffness[0, 0],
                modes.frequency,
                self.participation(modes),
                self.end_inertia,
            )
            found = float(frequency[np.argmax(share)])
            if modes.complete or GONDOLA_MODES * found <= 1.5 * limit:
                return found


class ClosedStatics:
    """Statics of the closed form."""

    def __init__(self, catenary):
        self.mean_tension = float(catenary.mean_tension)
        self.max_tension = float(catenary.max_tension)
        # a folded cable is computed with next to no tension at its fold, and shown with none
        self.min_tension, self.horizontal_tension = (
            float(tension) if tension > FOLDED * catenary.max_tension else 0.0
            for tension in (catenary.min_tension, catenary.horizontal_tension)
        )
        self.stretched_length = float(catenary.stretched_length)
        self.iterations = int(catenary.record.steps)
        self._catenary = catenary

    @property
    def sag(self):
        """[m]"""
        return float(self._catenary.sag)

    def shape(self, positions):
        """Displacement from the chord (in unstretched lengths, chord frame) and tension [N] at arc lengths."""
        displacement, tension = self._catenary.at(positions)
        return displacement, np.sqrt((tension**2).sum(axis=-1))


class DiscreteStatics:
    """Statics of a fixed number of elements."""

    def __init__(self, catenary, state, convergence):
        weights = state.mesh.sizes[:, None] * basis(state.mesh.order).weights
        self._span, self._state, self._middle = catenary.span, state, float(catenary.middle)
        self.mean_tension = float((weights * state.tension).sum()) * state.force
        forces = state.tension[..., None] * state.direction * state.force
        up = np.asarray(self._span.up)
        level = forces - (forces @ up)[..., None] * up
        self.horizontal_tension = float((weights * np.sqrt((level**2).sum(axis=-1))).sum())
        self.max_tension = float(state.tension.max()) * state.force
        self.min_tension = float(state.tension.min()) * state.force
        stiffness = float(self._span.axial_stiffness)
        self.stretched_length = float(self._span.unstretched_length * (1 + self.mean_tension / stiffness))
        self.iterations = len(convergence.steps)

    @property
    def sag(self):
        """[m]"""
        return equilibrium.sag(self._span, self._state, self._middle)

    def shape(self, positions):
        """As `ClosedStatics.shape`."""
        return equilibrium.interpolate(self._state, positions)
