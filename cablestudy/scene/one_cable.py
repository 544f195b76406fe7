"""A scene of one cable as a suspension: a cable between fixed points, or from a fixed point to a gondola free along x.

The winch moves an end of the cable along x. The wind blows on the gondola along x, and the motion by it is computed
about the equilibrium without wind.
"""

from functools import cache

from cablestudy.scene.control_tables import Control, Controller, Drive
from cablestudy.scene.scene import CABLE
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.scene.suspension_tables import Body, CableWinch
from cablestudy.scene.wind_tables import BodyWind, SuspensionWind, WindTable

GONDOLA = "gondola"  # name of the body
NAMES = {f"winch.{CABLE}": "winch", "reference.x": "reference", f"{GONDOLA}.x": GONDOLA}  # in the loop -> of the user
WIND_KEYS = ("gondola.area", "gondola.drag_coefficient", "wind")  # without which no wind acts on the gondola


def as_suspension(scene, damping=0.0):
    """Describe a scene of one cable as a suspension, so that one code computes motion, loop and wind of both.

    It has one cable, and the gondola as a body that is free along x, but no points and no load cases: the equilibrium
    is computed from the scene of one cable. Nothing is checked again. `damping` is viscous damping by the air, per
    length of cable, that is added to the damping of the cable. [N s/m^2]
    """
    winch = scene.winch if scene.gondola is not None else None  # the winch of a cable without gondola moves nothing
    return _construct(
        SuspensionScene,
        gravity=scene.gravity,
        bodies={} if scene.gondola is None else {GONDOLA: _body(scene.gondola)},
        cables={CABLE: _with_damping(scene.cable, damping)},
        winches={} if winch is None else {CABLE: _winch(winch)},
        control=None if winch is None or winch.controller is None else _control(winch),
        wind=None if scene.wind is None else _wind(scene.wind),
        exposure=scene.exposure,
        correction=scene.correction,
        model=scene.model,
    )


@cache
def _with_defaults(model):
    """An instance of a pydantic model with its defaults alone."""
    return model.model_construct()


def _construct(model, /, **values):
    """An instance of a pydantic model with values that are not checked; copies share one set of defaults."""
    return _with_defaults(model).model_copy(update=values)


def _with_damping(cable, damping):
    """A cable with more viscous damping per length [N s/m^2]: a copy, or itself with none."""
    if not damping:
        return cable
    table = cable.damping
    return cable.model_copy(update={"damping": table.model_copy(update={"viscous": table.viscous + damping})})


def _body(gondola):
    """The gondola as a body that is free along x."""
    wind = None
    if gondola.area is not None and gondola.drag_coefficient is not None:
        wind = _construct(BodyWind, area=gondola.area, drag_coefficient=gondola.drag_coefficient)
    return _construct(Body, mass=gondola.mass, free=("x",), wind=wind)


def _winch(winch):
    """The winch as one that moves an end of the cable along x."""
    return _construct(CableWinch, end="to" if winch.location == "gondola" else "from", direction=(1.0, 0.0, 0.0))


def _control(winch):
    """Controller and drive of the winch as the loop of a suspension."""
    law = {name: getattr(winch.controller, name) for name in Controller.model_fields}
    drive = {name: getattr(winch, name) for name in Drive.model_fields}
    return _construct(Control, **law, **drive)


def _wind(wind):
    """The wind as one on the bodies of a suspension, about the equilibrium without wind."""
    common = {name: getattr(wind, name) for name in WindTable.model_fields}
    turbulence = {"turbulence_intensity": wind.turbulence_intensity, "turbulence_rms": wind.turbulence_rms}
    return _construct(SuspensionWind, **common | turbulence | {"mean": False, "on": "bodies"})
