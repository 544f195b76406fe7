"""One cable with a gondola as a suspension about its equilibrium, for what its winch and the wind do to it."""

from types import SimpleNamespace

import numpy as np

from cablestudy.cable.assembly import IN_PLANE
from cablestudy.scene.one_cable import CABLE, GONDOLA, as_suspension
from cablestudy.study.suspension.in_wind import InWind
from cablestudy.study.suspension.linear_motion import drag_of
from cablestudy.system.cables import Cables, FixedModel
from cablestudy.system.suspension import GROUND, Equilibrium, Suspension

ALONG_X = np.array([[True, False, False, False, False, False]])
FOUND = SimpleNamespace(converged=np.array(True))  # record of a pose that was not searched: end 2 stays where it is


def in_wind_of(case, damping=0.0):
    """`InWind` of a case: its gondola with the winch loop, and in the wind.

    Parameters
    ----------
    case : Case
        With a gondola.
    damping : float
        Viscous damping of the cable by the air, per length. [N s/m^2]

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no equilibrium.
    """
    scene, equilibrium, model = as_suspension(case.scene, damping), equilibrium_of(case), _exact_model(case)
    drag = None if scene.wind is None else drag_of([scene], (GONDOLA,), (CABLE,)).take(0)
    cables, modes = case.cable_models.setdefault(damping, {}), case.coupled_models.setdefault(damping, {})
    if not cables:
        cables[CABLE] = Cables(
            equilibrium.catenary, [scene.cables[CABLE].damping], drag=model and model.drag, planes=_planes(case)
        )
    known = case.linear_models.setdefault(damping, {})
    return InWind(scene, equilibrium, equilibrium, drag, model, known, cables[CABLE], modes)


def _planes(case):
    """The plane of a cable, where a movement along x does not leave it; else None, for all directions."""
    return None if case.results.across_x[case.index] or not case.planar else (IN_PLANE,)


def equilibrium_of(case):
    """`Equilibrium` of a case whose end 2 is held by a body that is free along x.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is none.
    """
    case.results.check(case.index)
    catenary = case.results.catenary.take(np.array([case.index]))
    span, end_1, none = catenary.span, case.end_1, np.zeros((1, 3))
    place, turned = (end_1 + float(span.chord[0]) * span.frame[0, 0])[None], np.eye(3)[None]
    suspension = Suspension(
        gravity=np.array(case.scene.gravity),
        body_names=(GONDOLA,),
        position=place,
        rotation=turned,
        mass=np.array([case.scene.gondola.mass]),
        center=none,
        inertia=np.zeros((1, 3, 3)),
        force=none,
        moment=none,
        free=ALONG_X,
        junctions=0,
        cable_names=(CABLE,),
        owner=np.array([[GROUND, 0]]),
        place=np.array([[end_1, none[0]]]),
        axial_stiffness=span.axial_stiffness,
        cable_mass=span.mass,
        given=("unstretched_length",),
        value=span.unstretched_length,
    )
    return Equilibrium(suspension, place, turned, catenary, FOUND)


def _exact_model(case):
    """`FixedModel` of the scene, or None where it states an accuracy."""
    model, drag = case.scene.model, tuple(part[[case.index]] for part in case.results.pressed)
    return FixedModel(model.elements, model.order, model.mass, drag) if model.elements else None
