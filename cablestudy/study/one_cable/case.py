"""One case of one cable in motion: its elements at one level of refinement, its gondola, its loop and the wind."""

from functools import cached_property

import numpy as np

from cablestudy.cable.assembly import IN_PLANE, OUT_OF_PLANE, SPATIAL
from cablestudy.cable.damping import grows_with_modes
from cablestudy.cable.dynamics import PLANAR
from cablestudy.cable.records import is_computed
from cablestudy.errors import NoSolutionError
from cablestudy.motion.model_sizes import MODAL
from cablestudy.study.column import DISCRETE, SYSTEM, shapeless_error
from cablestudy.study.compared_case import ComparedCase
from cablestudy.study.load_cases import density_and_speed
from cablestudy.study.motion_columns import DAMPING_RATIO
from cablestudy.study.one_cable.asked_modes import AskedModes, found_frequencies
from cablestudy.study.one_cable.at_rest import OneCableAtRest, shared
from cablestudy.study.one_cable.elements import numbers_in_modes
from cablestudy.study.refinement import reference_scene
from cablestudy.study.tolerances import STUDY
from cablestudy.system.together import computed_together
from cablestudy.wind.drag import body_damping, cable_damping

MOTIONS = ("dynamics", "in_plane", "out_of_plane")
NO_MODES = AskedModes()


class CableCase(OneCableAtRest, ComparedCase):
    """One cable in one load case, and its numbers at rest and in motion, with a model at one level of refinement.

    Parameters
    ----------
    scene, results, index, level, cache_by_level
        As of `OneCableAtRest`.
    asked_modes : AskedModes, optional
        Modes whose frequencies are searched for together, to the accuracy of the scene; others are by themselves.

    Attributes
    ----------
    together : sequence of CableCase
        Cases, this one among them, whose frequencies and damping ratios are computed in one call; empty if it is alone.
    """

    def __init__(self, scene, results=None, index=0, level=None, cache_by_level=None, asked_modes=NO_MODES):
        super().__init__(scene, results, index, level, cache_by_level)
        self.asked_modes, self.together = asked_modes, ()
        self._modes_searched = [0]  # counts of modes among which an axial one was found

    def refined(self, elements, order):
        """Copy of the case with spectral `elements` of an order about the closed form, this many on its longest piece.

        NoSolutionError or ConvergenceError where there is no equilibrium.
        """
        self.results.check(self.index)
        finer = CableCase(self.scene, self.results, self.index, (elements, order), self._cache_by_level)
        finer._modes_searched = self._modes_searched
        return finer

    def check(self, column):
        """Raise the NoSolutionError of a column of a form that the cable lacks, or of damping without a limit."""
        if column.determined_by and self.exact_statics and self.continuous.slack:
            raise shapeless_error(column, self.limp)
        of_damping = column.needs in SYSTEM and (column.needs != "gondola" or column.name == DAMPING_RATIO)
        if of_damping and self.damped_by_modes and self.exact_statics and self.level is None:
            raise NoSolutionError(MODAL)

    @property
    def damped_by_modes(self):
        """True if the damping of a gondola grows with the number of modes."""
        return self.scene.gondola is not None and grows_with_modes(self.scene.cable.damping)

    def error_of(self, column, number, error):
        """Estimated relative error of a number in a column; None where none is stated, NaN where not known. [-]

        To the `error` of motion that of the equilibrium about which the cable moves is added: one that a finer model
        has too. All but a gain that the scene states have rounding. Numbers by stated elements are compared with those
        of a finer model, with `estimate`.
        """
        if not self.exact_statics and column.needs != "scene":
            return self.difference_from_finer(column, number) if self.estimate else np.nan
        if error is None:
            return None if column.needs in DISCRETE else self.closed_form_error(column, number)
        if column.needs in DISCRETE:
            error += self.equilibrium_error(column)
            return error if column.name == "gain" else max(error, STUDY.rounding)
        return error

    def equilibrium_error(self, column):
        """Relative error of a number of the motion by what the equilibrium leaves out: drag, conductors. [-]

        Zero where the function of the column counts it (`Column.follows_drag`).
        """
        if column.follows_drag:
            return 0.0
        error = self.mode_error
        if error and column.needs == "gondola" and column.name != "gondola_frequency":  # of the mode's shape
            return error + self.gondola_mode.error_by_mixing(error)
        return error

    @cached_property
    def mode_error(self):
        """Relative error of all frequencies by what the equilibrium leaves out, see `Results.mode_error`. [-]"""
        return float(self.results.mode_error[self.index])

    @cached_property
    def finer(self):
        """`CableCase` of the scene with a model to the accuracy `reference_accuracy`, for comparison."""
        return CableCase(reference_scene(self.scene))

    @property
    def model_numbers(self):
        """Estimated count of the numbers in all modes of the model. [-]"""
        if self.level is None:
            return numbers_in_modes(self.scene.model)
        nodes = self.level[0] * self.level[1]
        return nodes * min(3 * nodes, STUDY.modes_at_ends)

    # ------------------------------------------------------------------------------------------------------- motion

    def waves(self, frequency):
        """Transverse half-waves along the longest smooth piece at a frequency [Hz]; how far the cable turns [rad]."""
        elements, row = self.elements
        return 2 * frequency * elements.wave_time[row], elements.turn[row]

    def _dynamics(self, planes):
        """`Dynamics` of the elements in some planes, whose modes are computed with those of other cases."""
        elements, row = self.elements
        return elements.dynamics(planes).take(row)

    @shared
    def dynamics(self):
        """The free vibration in all directions: `Dynamics`."""
        return self._dynamics(PLANAR if self.planar else (SPATIAL,))

    @shared
    def in_plane(self):
        """The free vibration in the cable's plane; in all directions where the two do not decouple."""
        return self._dynamics((IN_PLANE,)) if self.planar else self.dynamics

    @shared
    def out_of_plane(self):
        """The free vibration across the cable's plane; in all directions where the two do not decouple."""
        return self._dynamics((OUT_OF_PLANE,)) if self.planar else self.dynamics

    @property
    def dof(self):
        """Free displacements of all motion that was asked for. [-]"""
        computed = {id(self.computed[name]): self.computed[name] for name in MOTIONS if name in self.computed}
        return sum(dynamics.dof for dynamics in computed.values())

    @property
    def end_stiffness_chord(self):
        """Static stiffness of end 2 along the chord, end 1 fixed. [N/m]"""
        return float((self.continuous if self.exact_statics else self.dynamics).end_stiffness[0, 0])

    @computed_together
    def frequencies_asked_for(cases):
        """Frequencies of `asked_modes`: `Refinement`, or the error of a case without motion."""
        return found_frequencies(cases).items()

    @property
    def known_frequencies(self):
        """The `Refinement` of `asked_modes`; None where none were searched for, or the case has no motion."""
        found = CableCase.frequencies_asked_for.known(self)
        return None if isinstance(found, Exception) else found

    def frequency(self, number, kind, symmetry=None):
        """Frequency of one mode of the cable between fixed ends [Hz], and its estimated relative error [-].

        Where the scene states an accuracy, finer and finer models are solved until the error is within it. A case of
        one of these models (a level of refinement), or with a fixed number of elements, gives the frequency of its own
        elements, and None in place of the error.

        Parameters
        ----------
        number : int
            Number of the mode among those of its kind and symmetry, from 1.
        kind : {"in-plane", "out-of-plane", "axial"}
        symmetry : {"symmetric", "antisymmetric"}, optional
            About mid-length; by default modes are counted whatever their symmetry.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is no equilibrium, no such mode, or not to the accuracy.
        """
        label = number, kind, symmetry
        if self.level is None and self.exact_statics:
            case = self if label in self.asked_modes.labels else self.asking_for(AskedModes([label]))
            return case.frequencies_asked_for.of(label)
        dynamics = self.out_of_plane if kind == "out-of-plane" else self.in_plane
        modes_below = self._modes_below_axial(number if kind == "axial" else 0)
        frequencies, *_ = dynamics.frequencies((label,), estimated_count=modes_below)
        return frequencies[0], None

    def asking_for(self, asked_modes):
        """Copy of the case with other `asked_modes`, which shares all that equal cases share."""
        return CableCase(self.scene, self.results, self.index, self.level, self._cache_by_level, asked_modes)

    def _modes_below_axial(self, number):
        """Estimated count of modes below axial mode `number` in the same system; 0 for number 0, no axial mode. [-]"""
        waves = float(self.results.axial_waves[self.index])
        return STUDY.spare_modes * number * waves * (1 if self.planar else 2) if number else 0

    def frequencies(self, modes):
        """Frequencies of some modes [Hz], and their estimated relative errors: two lists, as in `Dynamics.frequencies`.

        Parameters
        ----------
        modes : tuple of tuple
            (number, kind, symmetry) of the modes in the cable's plane, which come first, and of those out of plane.
        """
        inside, outside = modes
        highest_axial = max((number for number, kind, _ in inside if kind == "axial"), default=0)
        searched = self._modes_searched
        modes_below = max(self._modes_below_axial(highest_axial), *searched)
        frequencies, errors, count = self.in_plane.frequencies(inside, True, modes_below) if inside else ([], [], 0)
        if highest_axial and not self.in_plane.small:
            searched.append(count)
        if outside:
            outside_frequencies, outside_errors, _ = self.out_of_plane.frequencies(outside, True)
            return frequencies + outside_frequencies, errors + outside_errors
        return frequencies, errors

    def participation(self, modes):
        """Force on each mode by a movement of end 2 along x, shape (k,); see `Modes.participation`. [N/(m sqrt(kg))]"""
        return modes.participation @ self.span.frame[:, 0]

    # ---------------------------------------------------------------------------------------- ends, gondola and loop

    def _cache_of(self, name, *values):
        """Results of a name, shared by equal cases with equal values besides: dict, to be filled."""
        return self.cache.setdefault((name, *values), {})

    @cached_property
    def end_model(self):
        """The cable at its two ends, with every mode that the model has: `Superelement`."""
        elements, row = self.elements
        return elements.ends(self.dynamics.planes).superelement(self.scene.cable.damping, row)

    @cached_property
    def end_model_in_wind(self):
        """The cable at its two ends in the air that damps its motion with the gondola: `Superelement`."""
        from cablestudy.study.one_cable.system import end_model_in_wind

        return end_model_in_wind(self)

    @cached_property
    def cable_models(self):
        """Viscous damping -> `Cables`, filled by `analysis`."""
        return self._cache_of("cable_models", self.scene.cable.damping, self.scene.gondola is None)

    @cached_property
    def coupled_models(self):
        """Viscous damping of the cable -> number of modes -> `CoupledModes` of gondola and cable: dict of dict."""
        gondola = self.scene.gondola
        return self._cache_of("coupled_models", self.scene.cable.damping, gondola and gondola.mass)

    @cached_property
    def linear_models(self):
        """Linear models about the equilibrium by their keys, shared by cases that differ in the loop alone: dict.

        Those in winds that do not damp the motion share them, too.
        """
        wind, steady = self.scene.wind, self.scene.load_case.wind
        winds = (wind, steady) if wind and wind.aerodynamic_damping else None
        return self._cache_of("linear_models", self.scene.cable.damping, self.scene.gondola, winds)

    @cached_property
    def equilibrium(self):
        """`Equilibrium` of the cable, whose end 2 a body that is free along x holds, or that is fixed.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is none.
        """
        from cablestudy.study.one_cable.system import equilibria_of

        self.results.check(self.index)
        return equilibria_of([self]).take(0)

    @property
    def rest(self):
        """`equilibrium`, whose ends are those of the cable where it hangs."""
        return self.equilibrium

    @cached_property
    def analysis(self):
        """The gondola with its winch loop, and in the wind: `DynamicAnalysis`.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is no equilibrium.
        """
        from cablestudy.study.one_cable.system import analysis_of

        return analysis_of(self)

    @cached_property
    def in_wind_that_damps(self):
        """`analysis` in a wind that damps the cable too."""
        from cablestudy.study.one_cable.system import analysis_of

        return analysis_of(self, self.cable_air_damping) if self.cable_air_damping else self.analysis

    @cached_property
    def in_cable_wind(self):
        """The gondola with its winch loop, or the bare cable, in the wind on the cable: `InCableWind`.

        Raises
        ------
        NoSolutionError, ConvergenceError
            There is no equilibrium.
        """
        from cablestudy.study.one_cable.system import in_cable_wind_of

        return in_cable_wind_of(self)

    @property
    def solved_winds(self):
        """Analyses of winds in which the motion was computed: list of DynamicAnalysis."""
        # without making those that were not asked for
        names = [name for name in ("analysis", "in_wind_that_damps") if is_computed(self, name)]
        analyses = [getattr(self, name) for name in names]
        analyses += self.in_cable_wind.analyses if is_computed(self, "in_cable_wind") else []
        return [analysis for analysis in analyses if analysis.solved]

    @property
    def moves(self):
        """True if the motion of gondola or bare cable was computed."""
        return bool(self.solved_winds)

    @property
    def size(self):
        """Unknowns of the largest model of its motion that was solved to an accuracy; 0 where none was. [-]"""
        found = self.known_frequencies
        return max(self.system_size, found.used.dof if found else 0)

    @property
    def system_size(self):
        """Coordinates of the largest linear system of gondola and cable; 0 where none was made. [-]"""
        coupled_modes = (modes for by_count in self.coupled_models.values() for modes in by_count.values())
        sizes = [len(modes.shapes) for modes in coupled_modes if not isinstance(modes, Exception)]
        sizes += [self.computed["suspension"].size] if "suspension" in self.computed else []
        return max([*sizes, *(len(wind.loop_for_notes.motion) for wind in self.solved_winds)], default=0)

    @cached_property
    def gondola_air_damping(self):
        """Viscous damping of the gondola by the air along x; 0 without wind or drag. [N s/m]"""
        gondola, wind, steady = self.scene.gondola, self.scene.wind, self.scene.load_case.wind
        if wind is None or gondola.area is None or gondola.drag_coefficient is None:
            return 0.0
        if not wind.aerodynamic_damping or steady is None or not steady.dynamic_pressure:
            return body_damping(wind, gondola.area, gondola.drag_coefficient)
        density, speed = density_and_speed(self.scene)
        speed = speed * np.sqrt(self.results.pressure_at_end_2[self.index])
        along_x = (1 + np.cos(steady.direction) ** 2) / 2  # half across the wind
        return float(density * gondola.drag_coefficient * gondola.area * speed * along_x)

    @property
    def cable_air_damping(self):
        """Viscous damping of the cable by `wind`, per length; 0 where its diameter is not known. [N s/m^2]

        0 also in a steady wind on the cable, which damps all motion by its own drag (`Airflow.damping_drags`).
        """
        if self.scene.wind_diameter is None or self.in_steady_wind:
            return 0.0
        return cable_damping(self.scene.wind, self.scene.wind_diameter)

    @property
    def in_steady_wind(self):
        """True if the steady wind of its load case acts on the cable."""
        return bool(self.results.drag.normal_drag[self.index] > 0)

    @cached_property
    def gondola_mode(self):
        """The coupled mode in which the gondola moves most along x: `RefinedMode`."""
        from cablestudy.study.one_cable.system import gondola_mode_of

        return gondola_mode_of(self)
