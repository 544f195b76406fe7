"""One scene's results, each computed the first time that a column asks for it."""

from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE, SPATIAL
from cablestudy.cable.dynamics import PLANAR
from cablestudy.cable.state import interpolate, sag
from cablestudy.control import complex_stiffness, gondola
from cablestudy.errors import NoSolutionError
from cablestudy.study import loops, windrms
from cablestudy.study.batch import Batch, ClosedStatics
from cablestudy.study.models import MAX_MODES, model_of
from cablestudy.study.shelf import Shelf, frozen, part_key, shared

CLOSED = ("cable_key", "span", "catenary")  # parts of a case that its model does not change
MOTIONS = ("dynamics", "in_plane", "out_of_plane")
RESPONSES = ("response", "open_response", "cable_response", "open_cable_response")
FELT = ("coupled", "end_inertia", "end_model_along_x", "loop")  # made of what a moved end stirs
GONDOLA_MODES, OMITTED = 20, 1.5  # least of `gondola_modes`; what is omitted counts as (OMITTED over it)^6
SPARE = 1.2  # times as many modes as an axial one is expected to have below are found at first
UNDAMPED = 1e-12  # damping ratio that cannot be told from none
# what the cable's statics and undamped motion depend on, beside gravity and model
CABLE = ("ends", "chord", "inclination", "elastic_modulus", "density", "area", "diameter", "unstretched_length",
         "preload", "sag", "loads")  # fmt: skip


class Case:
    """A scene and what follows from it.

    Parameters
    ----------
    scene : Scene
    batch : Batch, optional
        In which the scene's cable is solved with others.
    place : int
        Of the scene in it.
    rung : tuple of int, optional
        (elements for each smooth piece, order) of the motion about the closed-form statics; without it the scene's own
        model.
    shelf : Shelf, optional
        Shared with other cases.
    """

    def __init__(self, scene, batch=None, place=0, rung=None, shelf=None):
        self.scene, self.rung, self.shelf = scene, rung, shelf or Shelf()
        self._batch, self.place = batch, place
        self._searched = [0]  # modes among which an axial one was found, in models of one case

    @cached_property
    def cable_key(self):
        """What the cable and its model are made of."""
        cable = self.scene.cable
        return (self.scene.gravity, *(frozen(getattr(cable, key)) for key in CABLE), frozen(self.scene.model))

    @property
    def damping_key(self):
        """What the cable's damping is made of."""
        return frozen(self.scene.cable.damping)

    @property
    def mass_key(self):
        """The gondola's mass."""
        return self.scene.gondola.mass

    @property
    def winch_key(self):
        """What the winch is made of."""
        return frozen(self.scene.winch)

    @property
    def size(self):
        """About how many numbers all modes of the model are. [-]"""
        model = self.scene.model
        nodes = self.rung[0] * self.rung[1] if self.rung else (model.elements or 1) * model.order
        return nodes * min(3 * nodes, MAX_MODES)

    @property
    def exact_statics(self):
        """Whether statics and end stiffness are the closed form's, and not those of a fixed number of elements."""
        return self.scene.model.elements is None

    @cached_property
    def batch(self):
        """The closed form, of this cable alone where it came with no others."""
        return self._batch or Batch([self.scene])

    @cached_property
    def span(self):
        """The cable, its unstretched length known; see `Batch.span_of`."""
        return self.batch.span_of(self.place)

    @property
    def frame(self):
        """Rows: the chord frame in global coordinates, shape (3, 3). [-]"""
        return self.batch.frame_of(self.place)

    @cached_property
    def catenary(self):
        """The closed-form equilibrium; see `Batch.catenary_of`."""
        return self.batch.catenary_of(self.place)

    @shared()
    def model(self):
        """The elements: `models.Model`, solved together with other cases where these were prepared.

        Raises
        ------
        ConvergenceError, NoSolutionError
            No equilibrium of the elements, or a cable that hangs folded.
        """
        return model_of(self)

    @property
    def has_model(self):
        """Whether the elements are there."""
        return "model" in self.__dict__ or part_key(self, "model") in self.shelf

    def keep(self, model):
        """Take elements that were made together with those of others."""
        self.shelf.put(*part_key(self, "model"), self.size, model)
        self.__dict__["model"] = model

    @property
    def state(self):
        """The elements in equilibrium: `State`."""
        return self.model.state

    def refined(self, elements, order):
        """The same case with spectral elements on the closed-form statics: so many for the piece with most waves."""
        finer = Case(self.scene, self.batch, self.place, (elements, order), self.shelf)
        finer._searched = self._searched
        finer.__dict__.update({name: self.__dict__[name] for name in CLOSED if name in self.__dict__})
        return finer

    def waves(self, frequency):
        """Transverse half-waves along the longest smooth piece at a frequency [Hz]; how far the cable turns [rad]."""
        model = self.model
        return 2 * frequency * model.wave_time, model.turn

    @property
    def travel_time(self):
        """About how long a transverse wave takes from end to end, by the mean tension. [s]"""
        return self.batch.travel_of(self.place)[0]

    @property
    def axial_waves(self):
        """About how many transverse half-waves there are at the first axial frequency. [-]"""
        return self.batch.travel_of(self.place)[1]

    @cached_property
    def statics(self):
        """What the equilibrium looks like: `Statics`."""
        if self.exact_statics:
            return ClosedStatics(self.catenary)
        return DiscreteStatics(self)

    @property
    def planar(self):
        """Whether no load leaves the cable's plane, so that motion in it and across it decouple."""
        return self.batch.planar_of(self.place)

    @shared()
    def dynamics(self):
        """The free vibration in all directions."""
        return self.model.dynamics(PLANAR if self.planar else (SPATIAL,))

    @shared()
    def in_plane(self):
        """The free vibration in the cable's plane; in all directions where the two do not decouple."""
        return self.model.dynamics((IN_PLANE,)) if self.planar else self.dynamics

    @shared()
    def out_of_plane(self):
        """The free vibration across the cable's plane; in all directions where the two do not decouple."""
        return self.model.dynamics((OUT_OF_PLANE,)) if self.planar else self.dynamics

    @property
    def felt(self):
        """The free vibration that a movement of end 2 along x stirs."""
        return self.dynamics if self.batch.aside_of(self.place) else self.in_plane

    @property
    def dof(self):
        """Free displacements of all motion that was computed or taken over. [-]"""
        used = [self.__dict__[name] for name in MOTIONS if name in self.__dict__]
        if any(name in self.__dict__ for name in FELT):
            used.append(self.felt)
        return sum(part.dof for part in {id(part): part for part in used}.values())

    @cached_property
    def end_stiffness(self):
        """Static stiffness of end 2, end 1 fixed, along x, y, z, shape (3, 3). [N/m]"""
        local = self.catenary.end_stiffness if self.exact_statics else self.dynamics.end_stiffness
        frame = self.frame
        stiffness = frame.T @ local @ frame
        return np.where(np.abs(stiffness) > 1e-15 * np.abs(stiffness).max(), stiffness, 0.0)

    def end_stiffness_along(self, axis):
        """Static stiffness of end 2 along x, y or z (0, 1, 2), end 1 fixed. [N/m]"""
        if self.exact_statics:
            return self.batch.end_stiffness_of(self.place, axis)
        turn = self.frame[:, axis]
        part = self.in_plane if not turn[2] else self.dynamics if turn[:2].any() else self.out_of_plane
        return self.model.end_stiffness_along(part.planes, axis)

    def frequency(self, number, kind, symmetry=None):
        """Frequency of mode `number` (from 1) of a kind and symmetry; see `Dynamics.frequencies`. [Hz]"""
        part = self.out_of_plane if kind == "out-of-plane" else self.in_plane
        return part.frequencies(((number, kind, symmetry),), about=self._below(number if kind == "axial" else 0))[0][0]

    def _below(self, axial):
        """About how many modes of the same system lie below an axial one; at least none. [-]"""
        return SPARE * axial * self.axial_waves * (1 if self.planar else 2) if axial else 0

    def frequencies(self, modes):
        """Frequencies of some modes [Hz], and their estimated relative errors; see `Dynamics.frequencies`.

        Parameters
        ----------
        modes : tuple of tuple
            Those of one plane together: the others, and those out of plane.
        """
        inside, outside = modes
        axial = max((number for number, kind, _ in inside if kind == "axial"), default=0)
        about = max(self._below(axial), *self._searched)
        found, errors, count = self.in_plane.frequencies(inside, True, about) if inside else ([], [], 0)
        if axial and not self.in_plane.small:
            self._searched.append(count)
        if outside:
            more, wrong, _ = self.out_of_plane.frequencies(outside, True)
            return found + more, errors + wrong
        return found, errors

    def participation(self, modes):
        """How a movement of end 2 along x drives each mode, shape (k,); see `Modes.driven`. [N/(m sqrt(kg))]"""
        return modes.driven @ self.frame[:, 0]

    @shared()
    def end_inertia(self):
        """How the cable's mass weighs on end 2 moving along x, shape (3,): see `Ends.moments`."""
        return self.model.end_moments(self.felt.planes)

    @shared("damping_key")
    def end_model(self):
        """The cable as its ends feel it, with every mode that the model in use can give."""
        return self.model.end_model(self.dynamics.planes, self.scene.cable.damping)

    @shared("damping_key")
    def end_model_along_x(self):
        """The same with only the motion that a movement of the ends along x stirs."""
        return self.model.end_model(self.felt.planes, self.scene.cable.damping)

    @shared("damping_key", "mass_key", "winch_key")
    def loop(self):
        """The winch loop: `control.winch.Loop`."""
        return loops.loop_of(self)

    @cached_property
    def response(self):
        """What the wind does to the gondola: `windrms.Response`."""
        return windrms.response_of(self, self.loop)

    @cached_property
    def open_response(self):
        """The same with the winch at rest: all there is without a controller, and where the loop is unstable."""
        return self.response if self.loop.stable else windrms.response_of(self, self.loop.at_rest)

    @cached_property
    def cable_response(self):
        """What the wind on the cable does to the gondola: `windrms.Response`."""
        return windrms.cable_response_of(self, self.loop)

    @cached_property
    def open_cable_response(self):
        """The same with the winch at rest."""
        return self.cable_response if self.loop.stable else windrms.cable_response_of(self, self.loop.at_rest)

    @property
    def integration_error(self):
        """Largest estimated relative error of the RMS values that were computed, by integration. [-]"""
        found = [self.__dict__[name].error for name in RESPONSES if name in self.__dict__]
        return max(found, default=0.0) / 2  # of the root of a variance

    @cached_property
    def gondola_damping_ratio(self):
        """Of the coupled mode in which the gondola moves most. [-]

        Raises
        ------
        NoSolutionError
            So much damping that no oscillation is left of that mode.
        """
        damping, omega, mass = self.scene.cable.damping, 2 * np.pi * self.gondola_frequency, self.scene.gondola.mass
        if damping.model == "modal":
            return self._modal_damping_ratio(omega)
        amount = damping.loss_factor if damping.model == "hysteretic" else damping.time
        stiffness = complex_stiffness.ComplexStiffness(self.felt, self.frame[:, 0])
        return complex_stiffness.damping_ratio(stiffness, mass, omega, damping.model, amount)

    def _modal_damping_ratio(self, omega):
        """The same by the damping of the modes: Newton on k_xx(s) + M s^2 from the undamped frequency [rad/s]."""
        loop, mass, here = self.loop, self.scene.gondola.mass, 1j * omega

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
        if abs(here.real) < UNDAMPED * abs(here):
            return 0.0
        if here.real < 0 and abs(here.imag) < 1e-6 * abs(here):
            return 1.0  # it creeps back
        if not (0.3 * omega < abs(here) < 3 * omega and here.imag > 0 and here.real < 0):
            raise NoSolutionError("the gondola's mode is damped so much that it is no oscillation")
        return float(-here.real / abs(here))

    @cached_property
    def gondola_frequency_static(self):
        """sqrt(k/M)/(2 pi). [Hz]"""
        return gondola.static_frequency(self.scene.gondola.mass, self.end_stiffness_along(0))

    @cached_property
    def gondola_modes(self):
        """Cable modes up to so many times the gondola's frequency are summed one by one in a large model. [-]"""
        accuracy = self.scene.model.accuracy if self.exact_statics else 1.0
        return max(GONDOLA_MODES, 2 * accuracy ** (-1 / 6))

    @property
    def omitted(self):
        """Relative error of the gondola's motion by the modes that are not summed one by one. [-]"""
        return 0.0 if self.felt.small else (OMITTED / self.gondola_modes) ** 6

    @shared("mass_key")
    def coupled(self):
        """Undamped frequencies of gondola and cable together [Hz], and the gondola's share in them."""
        found = loops.coupled_of([self])[0]
        if isinstance(found, Exception):
            raise found
        return found

    @property
    def gondola_frequency(self):
        """Frequency of the coupled mode in which the gondola moves most. [Hz]"""
        frequency, share = self.coupled
        return float(frequency[np.argmax(share)])


class DiscreteStatics:
    """Statics of a fixed number of elements."""

    def __init__(self, case):
        self._case = case
        (
            self.mean_tension,
            self.horizontal_tension,
            self.max_tension,
            self.min_tension,
            self.stretched_length,
            self.iterations,
        ) = case.model.statics

    @property
    def sag(self):
        """[m]"""
        case = self._case
        return sag(case.state, case.batch.middle_of(case.place))

    def shape(self, positions):
        """As `ClosedStatics.shape`."""
        return interpolate(self._case.state, positions)
