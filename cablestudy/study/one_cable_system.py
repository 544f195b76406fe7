"""One cable with a gondola as a suspension about its equilibrium, for what its winch and the wind do to it.

The wind on the gondola blows along x. That on the cable has, as a horizontal mean, the speed that the gondola meets;
each component of its turbulence has the spectrum of the longitudinal one, and two components are uncorrelated. What the
paper leaves open is where it comes from: each number is the larger one of wind across and along the vertical plane of
the cable, between which those of a straight cable lie. The air damps the gondola by its drag along x, and the cable by
one viscous rate for motion in any direction.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from cablestudy.cable.assembly import IN_PLANE
from cablestudy.errors import outcome_of
from cablestudy.scene.one_cable import CABLE, GONDOLA, as_suspension
from cablestudy.study.columns import GONDOLA_X
from cablestudy.study.suspension.airflow import Airflow
from cablestudy.study.suspension.in_wind import InWind, solve_modes
from cablestudy.study.suspension.linear_motion import drag_of
from cablestudy.system.cables import Cables, FixedModel
from cablestudy.system.suspension import GROUND, Equilibrium, Suspension
from cablestudy.wind.coherence import along_cable
from cablestudy.wind.gusts import Gusts
from cablestudy.wind.strips import on_cables

ALONG_X = np.array([[True, False, False, False, False, False]])


@dataclass(frozen=True)
class Held:
    """Record of poses that are not searched: end 2 stays where it is.

    Attributes
    ----------
    converged : ndarray of bool, shape (...)
    """

    converged: np.ndarray


class CableAirflow(Airflow):
    """The wind on the cable of a scene of one cable.

    Parameters
    ----------
    scene : SuspensionScene
    drag : Drag
        Of the gondola along x, which damps it.
    wind : Wind
        Of the scene of one cable.
    on_cable : Drag
        Of the cable, in the direction of the mean wind.
    side : str
        Names it.
    """

    on_cables = True

    def __init__(self, scene, drag, wind, on_cable, side):
        super().__init__(scene, drag)
        self._wind, self._on_cable, self.side = wind, on_cable, side

    def gusts(self, solution, layout, shapes):
        """`Gusts` on the coordinates, see `Airflow.gusts`: the turbulence is the same in all directions."""
        rms, none = self._wind.turbulence, np.zeros((0, 3, shapes.shape[1]))
        wind = self.scene.wind.model_copy(update={"turbulence_intensity": None, "turbulence_rms": (rms,) * 3})
        along = on_cables(solution, layout, shapes, self._on_cable)
        return Gusts(wind, np.eye(3), *along, none, np.zeros((0, 3)), np.zeros(0), along_cable(self._wind))


class InCableWind:
    """The gondola in the wind on its cable, across or along its vertical plane: whichever moves it more.

    Parameters
    ----------
    sides : list of InWind
    """

    def __init__(self, sides):
        self.sides = sides

    def rms(self, names, variance, open_loop):
        """`InWind.rms`, of the side where it is larger."""
        return max((side.rms(names, variance, open_loop) for side in self.sides), key=lambda found: found[0])

    def side(self, open_loop=False):
        """The `InWind` that displaces the gondola more; raises as `InWind.rms`."""
        return max(self.sides, key=lambda side: side.rms([GONDOLA_X], "value", open_loop)[0])


def in_wind_of(case, damping=0.0, kind=InWind):
    """`InWind` of a case: its gondola with the winch loop, and in the wind on it.

    Parameters
    ----------
    case : Case
        With a gondola.
    damping : float
        Viscous damping of the cable by the air, per length. [N s/m^2]
    kind : callable
        `InWind`, or what takes its arguments.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium.
    """
    scene = as_suspension(case.scene, damping)
    airflow = scene.wind and Airflow(scene, _on_gondola(scene))
    return _in_airflow(case, scene, airflow, case.linear_models.setdefault(damping, {}), kind)


def in_cable_wind_of(case, kind=InWind):
    """`InCableWind` of a case, whose cable the wind damps too.

    Parameters
    ----------
    case : Case
        With a gondola, wind, and a diameter of the cable.
    kind : callable
        As for `in_wind_of`.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium.
    """
    known = case.linear_models.setdefault(case.cable_air_damping, {})
    sides = {"across": case.span.frame[2], "along": case.span.level}
    return InCableWind([in_wind_from(case, direction, side, known, kind) for side, direction in sides.items()])


def in_wind_from(case, direction, side, known, kind=InWind):
    """`InWind` of a case in the wind on its cable, as a horizontal unit vector has it, shape (3,).

    Parameters
    ----------
    case, kind
        As for `in_cable_wind_of`.
    direction : ndarray
    side : str
        Names it.
    known : dict
        What winds from other directions share with it.
    """
    wind, scene = case.scene.wind, as_suspension(case.scene, case.cable_air_damping)
    drag, offered = _on_gondola(scene), np.array([wind.cable_drag_coefficient * case.scene.wind_diameter])
    on_cable = replace(drag, velocity=wind.speed * direction, cables=offered, bodies=0 * drag.bodies)
    return _in_airflow(case, scene, CableAirflow(scene, drag, wind, on_cable, side), known, kind)


def _on_gondola(scene):
    """`Drag` of the gondola along x."""
    return drag_of([scene], (GONDOLA,), (CABLE,)).take(0)


def _in_airflow(case, scene, airflow, known, kind):
    equilibrium, model, damping = equilibrium_of(case), _exact_model(case), scene.cables[CABLE].damping
    cables, modes = (found.setdefault(damping.viscous, {}) for found in (case.cable_models, case.coupled_models))
    if not cables:
        cables[CABLE] = Cables(equilibrium.catenary, damping, drag=model and model.drag, planes=_planes(case))
    return kind(scene, equilibrium, equilibrium, airflow, model, known, cables[CABLE], modes)


def _planes(case):
    """The plane of a cable, where a movement along x does not leave it; else None, for all directions."""
    return None if case.results.across_x[case.index] or not case.planar else (IN_PLANE,)


def prepare(cases):
    """Compute the coupled modes of gondola and cable that loop and wind need first, of many cases together.

    What one cannot have it says when asked.

    Parameters
    ----------
    cases : sequence of Case
        Of one batch.
    """
    found = [(case, outcome_of(partial(getattr, case, "in_wind"))) for case in cases]
    found = [(case, wind) for case, wind in found if not isinstance(wind, Exception)]
    if found:
        cases, winds = (list(part) for part in zip(*found, strict=True))
        solve_modes(winds, equilibria_of(cases))


def equilibrium_of(case):
    """`Equilibrium` of a case whose end 2 is held by a body that is free along x.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is none.
    """
    case.results.check(case.index)
    return equilibria_of([case]).take(0)


def equilibria_of(cases):
    """The same of n cases of one batch that have one: `Equilibrium` of shape (n,)."""
    catenary = cases[0].results.catenary.take(np.array([[case.index] for case in cases]))
    span, end_1 = catenary.span, np.stack([case.end_1 for case in cases])[:, None]
    none, turned = np.zeros(end_1.shape), np.broadcast_to(np.eye(3), (len(cases), 1, 3, 3))
    place = end_1 + span.chord[..., None] * span.frame[..., 0, :]
    suspension = Suspension(
        gravity=np.array([case.scene.gravity for case in cases]),
        body_names=(GONDOLA,),
        position=place,
        rotation=turned,
        mass=np.array([[case.scene.gondola.mass] for case in cases]),
        center=none,
        inertia=np.zeros((len(cases), 1, 3, 3)),
        force=none,
        moment=none,
        free=ALONG_X,
        junctions=0,
        cable_names=(CABLE,),
        owner=np.array([[GROUND, 0]]),
        place=np.stack([end_1, none], axis=2),
        axial_stiffness=span.axial_stiffness,
        cable_mass=span.mass,
        given=("unstretched_length",),
        value=span.unstretched_length,
    )
    return Equilibrium(suspension, place, turned, catenary, Held(np.ones(len(cases), dtype=bool)))


def _exact_model(case):
    """`FixedModel` of the scene, or None where it states an accuracy."""
    model, drag = case.scene.model, tuple(part[[case.index]] for part in case.results.pressed)
    return FixedModel(model.elements, model.order, model.mass, drag) if model.elements else None
