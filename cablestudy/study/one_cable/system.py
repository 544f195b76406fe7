"""One cable, with a gondola or without, as a suspension about its equilibrium: its motion by winch and wind.

The wind on the gondola blows along x. That on the cable has, as a horizontal mean, the speed that the gondola meets;
each component of its turbulence has the spectrum of the longitudinal one, and two components are uncorrelated. The
paper leaves the direction of the wind open: each number is the larger one of wind across and along the vertical plane
of the cable, between which those of a straight cable lie. The air damps the gondola by its drag along x, and the cable
by one viscous rate for motion in any direction; without a gondola by its drag, see `wind.drag`. The steady wind of a
load case damps both by its drag on them.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from cablestudy.cable.assembly import IN_PLANE
from cablestudy.errors import outcome_of
from cablestudy.motion.airflow import Airflow, drag_of
from cablestudy.motion.body_mode import BodyMode, RefinedMode
from cablestudy.motion.dynamic_analysis import DynamicAnalysis
from cablestudy.motion.model_search import solve_modes
from cablestudy.scene.one_cable import CABLE, GONDOLA, as_suspension
from cablestudy.statics.descent import SearchRecord
from cablestudy.statics.suspension import GROUND, Equilibrium, SuspendedSystem
from cablestudy.study.load_cases import density_and_speed
from cablestudy.study.motion_columns import GONDOLA_X, MIDSPAN
from cablestudy.study.refinement import fixed_model
from cablestudy.study.tolerances import STUDY
from cablestudy.system.cable_coordinates import MeshGroup, ReducedCable
from cablestudy.system.cables import Models
from cablestudy.system.coupled_modes import coupled_modes
from cablestudy.system.hanging_cables import Cables
from cablestudy.wind.coherence import along_cable
from cablestudy.wind.gusts import Gusts
from cablestudy.wind.strips import on_cables

ALONG_X = np.array([[True, False, False, False, False, False]])


class CableAirflow(Airflow):
    """The wind on the cable of a scene of one cable.

    Parameters
    ----------
    scene : SuspensionScene
    drag : Drag
        Drag by which the air damps the motion, without a steady wind: of the gondola along x, or of the bare cable.
    mean_drag : Drag or None
        Of the steady wind of the load case.
    wind : Wind
        Wind of the scene of one cable.
    on_cable : Drag
        Drag of the cable, in the direction of the mean wind.
    direction_name : str
        Name of the direction of the wind: "across" or "along".
    """

    on_cables = True

    def __init__(self, scene, drag, mean_drag, wind, on_cable, direction_name):
        super().__init__(scene, drag, mean_drag)
        self._wind, self._on_cable, self.direction_name = wind, on_cable, direction_name

    def gusts(self, modes, layout, shapes):
        """`Gusts` on the coordinates, see `Airflow.gusts`: the turbulence is the same in all directions."""
        rms, no_bodies = self._wind.turbulence, np.zeros((0, 3, shapes.shape[1]))
        wind = self.scene.wind.model_copy(update={"turbulence_intensity": None, "turbulence_rms": (rms,) * 3})
        strips_and_amplitudes, coherence = on_cables(modes, layout, shapes, self._on_cable), along_cable(self._wind)
        return Gusts(wind, np.eye(3), *strips_and_amplitudes, no_bodies, np.zeros((0, 3)), np.zeros(0), coherence)


class InCableWind:
    """RMS of the gondola, or of the bare cable: the larger one in winds across and along the cable's vertical plane.

    Parameters
    ----------
    analyses : list of DynamicAnalysis
        One for each direction of the wind.
    outputs : list of str
        Outputs by whose largest RMS `decisive` chooses one of them.
    """

    def __init__(self, analyses, outputs):
        self.analyses, self._outputs = analyses, outputs

    def rms(self, names, variance, open_loop):
        """Largest `DynamicAnalysis.rms` of some outputs in both winds, and its error; raises as that method."""
        return self._largest(self.analyses, names, variance, open_loop)[0]

    @property
    def each(self):
        """Each wind by itself: list of InCableWind."""
        return [InCableWind([analysis], self._outputs) for analysis in self.analyses]

    def to_accuracy(self, accuracy, names):
        """Largest RMS of displacements or tensions of a bare cable, with more modes until its error is an accuracy.

        Returns the RMS and its error, a pair, and the `DynamicAnalysis` of it.
        No modes are added where the quadrature makes half of the error, which they would not reduce.
        """
        (rms, error), analysis = self._largest(self.analyses, names, "value", open_loop=True)
        while error > max(accuracy, analysis.response.integration_error) and analysis.finer is not None:
            (rms, error), analysis = self._largest([analysis.finer], names, "value", open_loop=True)
        return (rms, error), analysis

    @staticmethod
    def _largest(analyses, names, variance, open_loop):
        """The largest RMS of single outputs in some winds and its error, a pair; and the `DynamicAnalysis` of it."""
        largest = [(analysis.largest_rms(names, variance, open_loop), analysis) for analysis in analyses]
        return max(largest, key=lambda rms_and_analysis: rms_and_analysis[0][0])

    def decisive(self, open_loop=False):
        """`DynamicAnalysis` in the wind that displaces gondola or bare cable more; raises as `DynamicAnalysis.rms`."""
        return self._largest(self.analyses, self._outputs, "value", open_loop)[1]


def analysis_of(case, damping=0.0, make_analysis=DynamicAnalysis):
    """Analysis of the motion of gondola and cable in wind on the gondola alone: `DynamicAnalysis`.

    The gondola is a body at end 2 of the cable, free along x; a winch with a control loop may move the cable.

    Parameters
    ----------
    case : CableCase
        A case with a gondola.
    damping : float
        Viscous damping of the cable by the air, per length, added to the cable's own. [N s/m^2]
    make_analysis : callable
        Returns the analysis: the class `DynamicAnalysis`, or a function with its arguments.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium.
    """
    scene = as_suspension(case.scene, damping)
    airflow = scene.wind and Airflow(scene, _on_bodies(scene), _of_steady_wind(case, scene))
    return _in_airflow(case, scene, airflow, case.linear_models.setdefault(damping, {}), make_analysis)


def in_cable_wind_of(case, make_analysis=DynamicAnalysis):
    """Response of a gondola, or of a cable without one, to turbulent wind on the cable: `InCableWind`, with RMS values.

    The scene states no direction of the wind: it blows once across the vertical plane of the cable and once along it,
    and the larger RMS counts. The drag of the cable also damps the motion.

    Parameters
    ----------
    case : CableCase
        A case with wind, and a diameter of its cable.
    make_analysis : callable
        Returns the analysis of one direction: the class `DynamicAnalysis`, or a function with its arguments.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium.
    """
    directions = _level_directions(case.span).items()
    analyses = [analysis_in_wind(case, direction, name, make_analysis) for name, direction in directions]
    if case.scene.gondola is None:
        return InCableWind([analysis.with_midspans for analysis in analyses], MIDSPAN)
    return InCableWind(analyses, [GONDOLA_X])


def _level_directions(span):
    """Horizontal unit vectors across the vertical plane of the chord of a cable and along it: dict. [-]"""
    run = np.array([*span.frame[0, :2], 0.0])
    size = np.hypot(*run[:2])
    along = run / size if size > STUDY.rounding else np.array([1.0, 0.0, 0.0])
    return {"across": np.array([-along[1], along[0], 0.0]), "along": along}


def analysis_in_wind(case, direction, name, make_analysis=DynamicAnalysis):
    """Analysis of the motion of a cable, with its gondola if any, in a wind of given direction: `DynamicAnalysis`.

    Parameters
    ----------
    case : CableCase
        A case with wind, and a diameter of its cable.
    direction : ndarray, shape (3,)
        Direction of the mean wind, a horizontal unit vector. [-]
    name : str
        Name of the direction: "across" or "along".
    make_analysis : callable
        Returns the analysis: the class `DynamicAnalysis`, or a function with its arguments.
    """
    wind, bare = case.scene.wind, case.scene.gondola is None
    scene = as_suspension(case.scene, 0.0 if bare else case.cable_air_damping)
    on_gondola, drag_width = _on_bodies(scene), np.array([wind.cable_drag_coefficient * case.scene.wind_diameter])
    on_cable = replace(on_gondola, velocity=wind.speed * direction, cables=drag_width, bodies=0 * on_gondola.bodies)
    drags = on_cable if bare else on_gondola, _of_steady_wind(case, scene)
    airflow = CableAirflow(scene, *drags, wind, on_cable, name)
    damping = name if bare else case.cable_air_damping  # winds that damp alike share linear models
    return _in_airflow(case, scene, airflow, case.linear_models.setdefault(damping, {}), make_analysis)


def analyses_of_winds(case, on, open_loop=False):
    """Analyses in independent winds on the gondola and on the cable, whose variances add: list of DynamicAnalysis.

    Parameters
    ----------
    case : CableCase
    on : {"gondola", "cable", "both"}
        Loaded by the wind. With both the wind on the gondola blows where the air damps the cable too.
    open_loop : bool
        Of the directions of the wind on the cable, take the one that moves the gondola more with the winch at rest,
        not with its loop.
    """
    if on == "gondola":
        return [case.analysis]
    on_gondola = [] if on == "cable" else [case.in_wind_that_damps]
    return [*on_gondola, case.in_cable_wind.decisive(open_loop)]


def _on_bodies(scene):
    """`Drag` of the gondola along x; without a gondola one without bodies."""
    return drag_of([scene], tuple(scene.bodies), (CABLE,)).take(0)


def _of_steady_wind(case, scene):
    """`Drag` of the steady wind of a load case on cable and gondola, with a profile of shape (1,); None without."""
    steady = case.scene.load_case.wind
    if steady is None:
        return None
    drag = case.results.drag.take([case.index])
    density, speed = density_and_speed(case.scene)
    width = drag.normal_drag / max(steady.dynamic_pressure, STUDY.tiny)
    of_wind = {"velocity": speed * drag.direction[0], "density": np.array(density), "cables": width}
    return replace(_on_bodies(scene), **of_wind, profile=drag.profile)


def _in_airflow(case, scene, airflow, plants_and_loops, make_analysis):
    """`DynamicAnalysis` of a scene of a case, which shares `plants_and_loops`; see `analysis_of`."""
    equilibrium, damping = case.equilibrium, scene.cables[CABLE].damping
    modes, drag = case.coupled_models.setdefault(damping.viscous, {}), case.results.drag.take([case.index])
    shared = fixed_model(case.scene, drag), plants_and_loops, cables_of(case, damping), modes
    return make_analysis(scene, equilibrium, equilibrium, airflow, *shared)


def end_model_in_wind(case):
    """The cable of a case with a gondola at its ends, in the air that damps their motion: `Superelement`."""
    airflow, model, (elements, row) = case.analysis.airflow, case.end_model, case.elements
    if airflow is None:
        return model
    models, count = Models(cables_of(case, case.scene.cable.damping), [elements.state.mesh]), len(model.omega)
    models.groups = [MeshGroup(np.zeros(1, dtype=int), elements.ends(case.dynamics.planes).take(np.array([row])))]
    return airflow.damped(models, [ReducedCable(model, count, np.eye(count))], case.equilibrium)[0].element


def gondola_mode_of(case):
    """The coupled mode of a case in which the gondola moves most along x: `RefinedMode`, first of loop and wind."""
    search = partial(BodyMode.search, name=GONDOLA, body=0, axis=0)

    def with_accuracy(factor):
        accuracy, cables = factor * case.scene.model.accuracy, cables_of(case, case.scene.cable.damping)
        return search(partial(coupled_modes, case.equilibrium, accuracy=accuracy, cables=cables))

    return RefinedMode(
        first=lambda: search(case.analysis.lowest_modes),
        with_accuracy=with_accuracy,
        accuracy=case.scene.model.accuracy,
        airflow=lambda: case.analysis.airflow,
        together=lambda: [other.gondola_mode for other in case.together or [case] if other.scene.gondola is not None],
        rounding=max(STUDY.rounding, float(case.results.motion_rounding[case.index])),
    )


def cables_of(case, damping):
    """`Cables` of a case, which has an equilibrium: its one cable, with the damping of its scene or another one."""
    cables = case.cable_models  # by viscous damping
    if damping.viscous not in cables:
        drag = None if case.exact_statics else case.results.drag.take([case.index])
        cables[damping.viscous] = Cables(case.equilibrium.catenary, damping, drag=drag, planes=_planes(case))
    return cables[damping.viscous]


def _planes(case):
    """The plane of a cable if a gondola's movement along x does not leave it: a tuple of one; else None."""
    leaves_plane = case.results.across_x[case.index] or not case.planar
    return None if leaves_plane or case.scene.gondola is None else (IN_PLANE,)


def solve_lowest_modes(cases):
    """Compute equilibria and lowest coupled modes of many cables with their gondolas in one call, which saves time.

    Columns of gondola, control loop and wind need them: the equilibrium of cable and gondola as a suspension, and its
    lowest modes. Both are stored in the cases. A case with an error raises it when the result is asked for.

    Parameters
    ----------
    cases : sequence of CableCase
        Cases of one batch, all with a gondola or all without.
    """
    cases = [case for case in cases if case.index not in case.results.failures]
    if not cases:
        return
    equilibrium, analyses = equilibria_of(cases), []
    equilibrium.blocks  # noqa: B018 computed for all cases at once: `take` then gives each case its own
    for index, case in enumerate(cases):
        case.equilibrium = equilibrium.take(index)
        analyses.append(outcome_of(partial(_first_analysis, case)))
    solvable = [index for index, analysis in enumerate(analyses) if not isinstance(analysis, Exception)]
    if solvable:
        solve_modes([analyses[index] for index in solvable], equilibrium.take(np.array(solvable)))


def _first_analysis(case):
    """`DynamicAnalysis` whose modes a case needs first: with its gondola, or of a bare cable in wind across it."""
    return case.analysis if case.scene.gondola is not None else case.in_cable_wind.analyses[0]


def equilibria_of(cases):
    """Describe n cables in equilibrium as suspensions of one cable, so that the same code computes their motion.

    The cable hangs from a fixed point to a gondola, a body that is free along x; without a gondola, to a second fixed
    point. Nothing is solved: the cable is that of `Results.form`.

    Parameters
    ----------
    cases : sequence of CableCase
        n cases of one batch, each with an equilibrium, all with a gondola or all without.

    Returns
    -------
    Equilibrium
        Arrays have a first axis of n cases.
    """
    form = cases[0].results.form.take(np.array([[case.index] for case in cases]))
    span, end_1 = form.span, np.stack([case.end_1 for case in cases])[:, None]
    end_2 = end_1 + span.chord[..., None] * span.frame[..., 0, :]
    gondolas = [[case.scene.gondola] if case.scene.gondola else [] for case in cases]
    bodies = len(gondolas[0])
    position, rotation = end_2[:, :bodies], np.broadcast_to(np.eye(3), (len(cases), bodies, 3, 3))
    zeros = np.zeros(position.shape)
    suspension = SuspendedSystem(
        gravity=np.array([case.scene.gravity for case in cases]),
        body_names=(GONDOLA,) * bodies,
        position=position,
        rotation=rotation,
        mass=np.array([[gondola.mass for gondola in of_case] for of_case in gondolas]),
        center=zeros,
        inertia=np.zeros(rotation.shape),
        force=zeros,
        moment=zeros,
        free=ALONG_X[:bodies],
        junctions=0,
        cable_names=(CABLE,),
        owner=np.array([[GROUND, 0 if bodies else GROUND]]),
        attachment=np.stack([end_1, zeros if bodies else end_2], axis=2),
        axial_stiffness=span.axial_stiffness,
        cable_mass=span.mass,
        stated=("unstretched_length",),
        value=span.unstretched_length,
    )
    record = SearchRecord(*np.zeros((4, len(cases)), dtype=int))  # converged, without a step
    return Equilibrium(suspension, position, rotation, form, record)
