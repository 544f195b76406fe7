"""What control, actuators, correction and wind of a suspension refer to, and what they need of it."""

from functools import partial

from cablestudy.scene.actuator_tables import ReactionMass
from cablestudy.scene.fields import suggestion
from cablestudy.scene.units import show


def reference_mistakes(scene):
    """Bodies, winches, motions and markers that do not exist or are held.

    Parameters
    ----------
    scene : SuspensionScene

    Returns
    -------
    list of (tuple, str)
        Path and message.
    """
    found = _control_mistakes(scene) if scene.control else []
    for name, actuator in scene.actuators.items():
        found += _body_mistakes(scene, ("actuators", name), actuator.body)
    if scene.correction:
        found += _marker_mistakes(scene.bodies, scene.correction.marker)
    wind = scene.wind
    if wind and wind.on == "bodies" and not any(body.wind for body in scene.bodies.values()):
        message = "bodies: no body has the key wind (area, drag_coefficient), so that there is nothing to act on"
        found.append((("wind", "on"), message))
    return found


def _body_mistakes(scene, path, name):
    """Of a table at a path that belongs to the body of this name, or where it is None to the only one."""
    bodies = scene.bodies
    if name is not None and name not in bodies:
        return [((*path, "body"), f"unknown body ({suggestion(name, bodies)})")]
    if name is None and len(bodies) != 1:
        listed = f" ({', '.join(bodies)})" if bodies else ""
        return [(path, f"missing key: body (the suspension has {len(bodies) or 'no'} bodies{listed})")]
    return []


def _control_mistakes(scene):
    control, path = scene.control, ("control",)
    found = _body_mistakes(scene, path, control.body)
    if not scene.winches:
        found.append((path, "needs a winch: the cables that are reeled are listed under winches"))
    for name in control.allocation.weights if control.allocation and scene.winches else ():
        message = "has no winch" if name in scene.cables else f"unknown cable ({suggestion(name, scene.winches)})"
        if name not in scene.winches:
            found.append(((*path, "allocation", "weights", name), message))
    if any(place == (*path, "body") or message.startswith("missing key: body") for place, message in found):
        return found
    name = scene.body_of(control)
    free = scene.bodies[name].free
    for place, motion in enumerate(control.measured or ()):
        if motion not in free:
            held = f"free: {', '.join(free)}" if free else "nothing of it is free"
            found.append(((*path, "measured", place), f"{motion} of {name} is held ({held})"))
    if not free and control.measured is None:
        found.append((path, f"{name} is held, so that there is nothing to measure"))
    return found


def _marker_mistakes(bodies, marker):
    known = [f"{name}.{inside}" for name, body in bodies.items() for inside in body.markers]
    if marker in known:
        return []
    hint = suggestion(marker, known) if known else "no body has markers"
    return [(("correction", "marker"), f"unknown marker {show(marker)} ({hint})")]


def actuator_relations(scene):
    """What moves on a body is a part of it: relations as of `Table.relations`.

    The mass of a body is above that of its reaction masses together, and its moment of inertia about the axis of a
    wheel above that of the wheel.
    """
    carried = dict.fromkeys(scene.bodies, 0.0)
    for name, actuator in scene.actuators.items():
        owner = scene.body_of(actuator)
        body = scene.bodies[owner]
        if isinstance(actuator, ReactionMass):
            carried[owner] = carried[owner] + actuator.mass
            key, moving, whole = "mass", carried[owner], body.mass
            text = f"{{:g}} kg of reaction masses is not below the mass of {owner}, {{:g}} kg, of which it is a part"
        else:
            key, moving, whole = "inertia", actuator.inertia, body.inertia_about(actuator.axis)
            text = f"not below the inertia of {owner} about this axis, {{1:g}} kg m^2, of which it is a part"
        yield ("actuators", name, key), moving < whole, partial(text.format, moving, whole)
