"""One case: its closed form, and its motion at one level of refinement; each result is computed when asked for."""

from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE, SPATIAL
from cablestudy.cable.dynamics import PLANAR
from cablestudy.cable.geometry import midspan
from cablestudy.errors import NoSolutionError
from cablestudy.study.cache import Cache, frozen, shared
from cablestudy.study.columns import attribute
from cablestudy.study.models import model_of, numbers_of
from cablestudy.study.results import Results
from cablestudy.study.scene_values import SceneValues
from cablestudy.study.statics import ClosedStatics, ElementStatics
from cablestudy.study.tolerances import STUDY
from cablestudy.wind.drag import body_damping, cable_damping

MOTIONS = ("dynamics", "in_plane", "out_of_plane")
# what the statics and undamped motion of the cable depend on, beside gravity and model
CABLE = ("ends", "chord", "inclination", "section_axial_stiffness", "section_mass", "section_diameter",
         "unstretched_length", "stated_preload", "stated_tension", "tension", "sag", "reference", "expansion",
         "loads")  # fmt: skip


class Case:
    """One case of `Results`, at one level of refinement.

    Parameters
    ----------
    scene : CableScene
    results : Results, optional
        Of a batch to which the case belongs; without it, of this scene alone.
    index : int
        Of the case in the batch.
    level : tuple of int, optional
        (elements along the piece with most waves, order) of the motion about the closed form; without it the scene's
        own `model.elements`.
    cache : Cache, optional
        Shared with other cases.

    Attributes
    ----------
    known : dict
        Name -> result, of what is computed from the model and shared with equal cases.
    """

    def __init__(self, scene, results=None, index=0, level=None, cache=None):
        self.scene, self.index, self.level = scene, index, level
        self.results = results or Results(SceneValues([scene]))
        self.cache, self.known = cache or Cache(), {}

    @cached_property
    def _closed(self):
        return _ClosedForm(self.scene, self.results, self.index)

    def refined(self, elements, order):
        """Copy of the case with spectral elements about the closed form, so many along the piece with most waves."""
        finer = Case(self.scene, self.results, self.index, (elements, order), self.cache)
        finer._closed = self._closed
        return finer

    def given(self, path):
        """A number that the scene states; see `SceneValues.given`."""
        return self.results.given(path)[self.index]

    # --------------------------------------------------------------------------------------------------------- keys

    def key_of(self, name, keys=()):
        """(cable, key) of a result in the cache, which depends on some keys of the scene, with dots."""
        return self._closed.key, (name, self.level, *(frozen(attribute(self.scene, key)) for key in keys))

    @property
    def size(self):
        """Estimated count of the numbers in all modes of the model. [-]"""
        if self.level is None:
            return numbers_of(self.scene.model)
        nodes = self.level[0] * self.level[1]
        return nodes * min(3 * nodes, STUDY.modes_at_ends)

    # ------------------------------------------------------------------------------------------------------ statics

    @property
    def exact_statics(self):
        """True if statics and end stiffness are those of the closed form, not of a fixed number of elements."""
        return self.scene.model.elements is None

    @property
    def span(self):
        """The cable, with its unstretched length: `Span`.

        Raises
        ------
        NoSolutionError
            No such cable exists, or it has no equilibrium.
        """
        return self._closed.span

    @property
    def frame(self):
        """Rows: the chord frame in global coordinates, shape (3, 3). [-]"""
        self.results.check(self.index)
        return self.results.span.frame[self.index]

    @property
    def catenary(self):
        """The closed-form equilibrium: `Catenary`.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is none.
        """
        return self._closed.catenary

    @cached_property
    def statics(self):
        """Statics of the model: `ClosedStatics` or `ElementStatics`."""
        if self.exact_statics:
            return self._closed.statics
        return ElementStatics(self.state, self.model.convergence, self.catenary.middle)

    @property
    def form(self):
        """The cable of the model where it hangs: what `cable.geometry` takes."""
        return self.catenary if self.exact_statics else self.state

    @property
    def middle(self):
        """Arc length at mid-span over unstretched length. [-]"""
        return self.catenary.middle if self.exact_statics else midspan(self.state)

    @property
    def reference_length(self):
        """Unstretched length in the reference state. [m]"""
        return self.results.reference_length[self.index]

    @property
    def limp(self):
        """True if the cable is longer than its chord without any load, see `Results.limp`."""
        return bool(self.results.limp[self.index])

    @property
    def end_1(self):
        """Place of end 1, shape (3,). [m]"""
        return self.results.end_1[self.index]

    @property
    def chord(self):
        """Distance of the ends. [m]"""
        return self.results.chord[self.index]

    @property
    def pushed(self):
        """Displacement of end 2 along x by the force of the load case [m], and its relative error."""
        shift, error = self.results.pushed
        return shift[self.index], error[self.index]

    @property
    def pressure_on_gondola(self):
        """Dynamic pressure of the steady wind at end 2 over the stated one. [-]"""
        return self.results.pressure_on_gondola[self.index]

    @property
    def planar(self):
        """True if no load leaves the cable's plane: in-plane and out-of-plane motion decouple."""
        return bool(self.results.planar[self.index])

    def waves(self, frequency):
        """Transverse half-waves along the longest smooth piece at a frequency [Hz]; how far the cable turns [rad]."""
        return 2 * frequency * self.model.wave_time, self.model.turn

    # ------------------------------------------------------------------------------------------------------- motion

    @shared()
    def model(self):
        """The elements: `models.CableElements`.

        Raises
        ------
        ConvergenceError, NoSolutionError
            No equilibrium of the elements, or a cable that hangs folded.
        """
        return model_of(self)

    @property
    def state(self):
        """The elements in equilibrium: `State`."""
        return self.model.state

    @shared()
    def dynamics(self):
        """The free vibration in all directions: `Dynamics`."""
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
    def dof(self):
        """Free displacements of all motion that was computed or taken from the cache. [-]"""
        used = [self.known[name] for name in MOTIONS if name in self.known]
        return sum(part.dof for part in {id(part): part for part in used}.values())

    @cached_property
    def end_stiffness(self):
        """Static stiffness of end 2, end 1 fixed, along x, y, z, shape (3, 3). [N/m]"""
        local = self.catenary.end_stiffness if self.exact_statics else self.dynamics.end_stiffness
        stiffness = self.frame.T @ local @ self.frame
        return np.where(np.abs(stiffness) > 1e-15 * np.abs(stiffness).max(), stiffness, 0.0)

    @property
    def end_stiffness_chord(self):
        """Static stiffness of end 2 along the chord, end 1 fixed. [N/m]"""
        return float(self.frame[0] @ self.end_stiffness @ self.frame[0])

    def end_stiffness_along(self, axis, moved=None):
        """Static stiffness of end 2 along x, y or z (0, 1, 2), end 1 fixed, by a movement along it or another. [N/m]"""
        if self.exact_statics:
            self.results.check(self.index)
            return float(self.results.end_stiffness_along(axis, moved)[self.index])
        if moved is not None:
            return float(self.end_stiffness[axis, moved])
        turn = self.frame[:, axis]
        part = self.in_plane if not turn[2] else self.dynamics if turn[:2].any() else self.out_of_plane
        return self.model.end_stiffness_along(part.planes, axis)

    def frequency(self, number, kind, symmetry=None):
        """Frequency of mode `number` (from 1) of a kind and symmetry; see `Dynamics.frequencies`. [Hz]"""
        part = self.out_of_plane if kind == "out-of-plane" else self.in_plane
        below = self._below(number if kind == "axial" else 0)
        return part.frequencies(((number, kind, symmetry),), estimated_count=below)[0][0]

    def _below(self, axial):
        """Estimated number of modes below an axial one in the same system; 0 without an axial one. [-]"""
        waves = float(self.results.axial_waves[self.index])
        return STUDY.spare_modes * axial * waves * (1 if self.planar else 2) if axial else 0

    def frequencies(self, modes):
        """Frequencies of some modes [Hz], and their estimated relative errors; see `Dynamics.frequencies`.

        Parameters
        ----------
        modes : tuple of tuple
            (number, kind, symmetry) of those in the plane together, and of those out of plane.
        """
        inside, outside = modes
        axial = max((number for number, kind, _ in inside if kind == "axial"), default=0)
        searched = self._closed.searched
        about = max(self._below(axial), *searched)
        found, errors, count = self.in_plane.frequencies(inside, True, about) if inside else ([], [], 0)
        if axial and not self.in_plane.small:
            searched.append(count)
        if outside:
            more, wrong, _ = self.out_of_plane.frequencies(outside, True)
            return found + more, errors + wrong
        return found, errors

    def participation(self, modes):
        """How a movement of end 2 along x drives each mode, shape (k,); see `Modes.participation`. [N/(m sqrt(kg))]"""
        return modes.participation @ self.frame[:, 0]

    # ---------------------------------------------------------------------------------------- ends, gondola and loop

    @shared("cable.damping")
    def end_model(self):
        """The cable at its two ends, with every mode that the model has: `Superelement`."""
        return self.model.end_model(self.dynamics.planes, self.scene.cable.damping)

    @shared("cable.damping")
    def cable_models(self):
        """`Cables` by their viscous damping, for `in_wind`."""
        return {}

    @shared("cable.damping", "gondola.mass")
    def coupled_models(self):
        """`CoupledModes` of gondola and cable by their number, by the viscous damping of the cable."""
        return {}

    @shared("cable.damping", "gondola", "wind")
    def linear_models(self):
        """Linear models about the equilibrium, by what they are of: what cases share that differ in the loop alone."""
        return {}

    @cached_property
    def equilibrium(self):
        """`Equilibrium` of the cable, whose end 2 a body that is free along x holds, or that is fixed.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is none.
        """
        from cablestudy.study.one_cable_system import equilibria_of

        self.results.check(self.index)
        return equilibria_of([self]).take(0)

    @cached_property
    def in_wind(self):
        """The gondola with its winch loop, and in the wind: `DynamicAnalysis`.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is no equilibrium.
        """
        from cablestudy.study.one_cable_system import in_wind_of

        return in_wind_of(self)

    @cached_property
    def in_wind_that_damps(self):
        """`in_wind` in a wind that damps the cable too."""
        from cablestudy.study.one_cable_system import in_wind_of

        return in_wind_of(self, self.cable_air_damping) if self.cable_air_damping else self.in_wind

    @cached_property
    def in_cable_wind(self):
        """The gondola with its winch loop, or the bare cable, in the wind on the cable: `InCableWind`.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is no equilibrium.
        """
        from cablestudy.study.one_cable_system import in_cable_wind_of

        return in_cable_wind_of(self)

    def winds_on(self, what, open_loop=False):
        """Winds that are independent of each other, so that variances add: list of DynamicAnalysis; raises as `rms`.

        Parameters
        ----------
        what : {"gondola", "cable", "both"}
            What they act on. With both the wind on the gondola blows where the air damps the cable too.
        open_loop : bool
            Whether that on the cable is the one that moves the gondola more with the winch at rest.
        """
        on_gondola = {"gondola": "in_wind", "both": "in_wind_that_damps"}
        found = [getattr(self, on_gondola[what])] if what in on_gondola else []
        return found if what == "gondola" else [*found, self.in_cable_wind.side(open_loop)]

    @property
    def solved_winds(self):
        """Of the above those in which the motion was computed: list of DynamicAnalysis."""
        found = [self.__dict__[name] for name in ("in_wind", "in_wind_that_damps") if name in self.__dict__]
        found += self.in_cable_wind.sides if "in_cable_wind" in self.__dict__ else []
        return [one for one in found if one.solved]

    @property
    def moves_in_wind(self):
        """True if the motion of gondola or bare cable was computed, in wind."""
        return self.scene.wind is not None and self.moves

    @property
    def moves(self):
        """True if the motion of gondola or bare cable was computed."""
        return bool(self.solved_winds)

    @property
    def system_size(self):
        """Coordinates of the largest linear system of gondola and cable; 0 where none was made. [-]"""
        of_modes = (found for known in self.coupled_models.values() for found in known.values())
        sizes = [len(found.shapes) for found in of_modes if not isinstance(found, Exception)]
        return max([*sizes, *(len(one.described.motion) for one in self.solved_winds)], default=0)

    @cached_property
    def gondola_air_damping(self):
        """Viscous damping of the gondola by the air; 0 without wind or drag. [N s/m]"""
        gondola, wind = self.scene.gondola, self.scene.wind
        if wind is None or gondola.area is None or gondola.drag_coefficient is None:
            return 0.0
        return body_damping(wind, gondola.area, gondola.drag_coefficient)

    @property
    def cable_air_damping(self):
        """Viscous damping of the cable by the air, per length; 0 where its diameter is not known. [N s/m^2]"""
        return 0.0 if self.scene.wind_diameter is None else cable_damping(self.scene.wind, self.scene.wind_diameter)

    @cached_property
    def gondola_mode(self):
        """`GondolaMode`."""
        from cablestudy.study.gondola import GondolaMode

        return GondolaMode(self)

    # --------------------------------------------------------------------------------------------------------- wind

    def check_winch_speed(self):
        """Refuse numbers of the loop in the wind that its winch is too slow for.

        Raises
        ------
        NoSolutionError
        """
        winch = self.scene.winch
        if winch is None or winch.controller is None or winch.max_speed is None:
            return
        peak = self.in_wind.winch_speeds[1]
        if peak > winch.max_speed:
            raise NoSolutionError(
                f"the winch would reach {1e3 * peak:.4g} mm/s in the wind, above its max_speed of "
                f"{1e3 * winch.max_speed:.4g} mm/s: the linear numbers do not hold"
            )


class _ClosedForm:
    """Closed-form results of one case, which all levels of its refinement share."""

    def __init__(self, scene, results, index):
        self._scene, self._results, self._index = scene, results, index
        self.searched = [0]  # modes among which an axial one was found

    @cached_property
    def key(self):
        cable = self._scene.cable
        scene = self._scene
        stated = (getattr(cable, key) for key in CABLE)
        stretched = cable.stress_strain and (cable.stress_strain, cable.state, *scene.cases.items())
        ground = scene.ground if scene.load_case.grows_with_height else None
        parts = frozen(stretched), frozen(scene.load_case), frozen(scene.model), frozen(ground)
        return (scene.gravity, *map(frozen, stated), *parts)

    @cached_property
    def span(self):
        self._results.check(self._index)
        return self._results.span.take(self._index)

    @cached_property
    def catenary(self):
        self._results.check(self._index)
        return self._results.catenary.take(self._index)

    @cached_property
    def statics(self):
        return ClosedStatics(self.catenary)
