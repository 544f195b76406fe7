"""A scene of one cable as a suspension: a cable between fixed points, or from one to a gondola that is free along x.

Its winch moves an end along x. The wind on the gondola blows along x, about the equilibrium without wind.
"""

from functools import cache

from cablestudy.scene.control_tables import Control, Controller, Drive
from cablestudy.scene.suspension import SuspensionScene
from cablestudy.scene.suspension_tables import Body, CableWinch
from cablestudy.scene.wind_tables import BodyWind, SuspensionWind, WindTable

CABLE, GONDOLA = "cable", "gondola"  # names of the cable and of the body
NAMES = {f"winch.{CABLE}": "winch", "reference.x": "reference", f"{GONDOLA}.x": GONDOLA}  # in the loop -> of the user
WIND_KEYS = ("gondola.area", "gondola.drag_coefficient", "wind")  # without which no wind acts on the gondola


def as_suspension(scene, damping=0.0):
    """The suspension of a scene of one cable.

    Parameters
    ----------
    scene : CableScene
        Already checked, so that nothing is checked again.
    damping : float
        Viscous damping of the cable by the air, per length. [N s/m^2]

    Returns
    -------
    SuspensionScene
        Its equilibrium is known: places, and what the cable states, are not filled in.
    """
    winch = scene.winch if scene.gondola is not None else None  # that of a bare cable moves nothing
    return _made(
        SuspensionScene,
        gravity=scene.gravity,
        bodies={} if scene.gondola is None else {GONDOLA: _body(scene.gondola)},
        cables={CABLE: _damped(scene.cable, damping)},
        winches={} if winch is None else {CABLE: _winch(winch)},
        control=None if winch is None or winch.controller is None else _control(winch),
        wind=None if scene.wind is None else _wind(scene.wind),
        exposure=scene.exposure,
        correction=scene.correction,
        model=scene.model,
    )


@cache
def _blank(kind):
    """An object of a model with its defaults alone."""
    return kind.model_construct()


def _made(kind, **given):
    """An object of a model with some values, which are not checked: the defaults are not made anew for each."""
    return _blank(kind).model_copy(update=given)


def _damped(cable, damping):
    own = cable.damping
    return cable.model_copy(update={"damping": own.model_copy(update={"viscous": own.viscous + damping})})


def _body(gondola):
    blown = gondola.area is not None and gondola.drag_coefficient is not None
    wind = {"area": gondola.area, "drag_coefficient": gondola.drag_coefficient}
    return _made(Body, mass=gondola.mass, free=("x",), wind=_made(BodyWind, **wind) if blown else None)


def _winch(winch):
    return _made(CableWinch, end="to" if winch.location == "gondola" else "from", direction=(1.0, 0.0, 0.0))


def _control(winch):
    law = {name: getattr(winch.controller, name) for name in Controller.model_fields}
    return _made(Control, **law, **{name: getattr(winch, name) for name in Drive.model_fields})


def _wind(wind):
    given = {name: getattr(wind, name) for name in WindTable.model_fields}
    spread = {"turbulence_intensity": wind.turbulence_intensity, "turbulence_rms": wind.turbulence_rms}
    return _made(SuspensionWind, **given | spread | {"mean": False, "on": "bodies"})
