"""References of control, actuators, correction and wind of a suspension: to what exists, and what they need of it."""

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
        listed = f": {', '.join(bodies)}" if bodies else ""
        return [(path, f"missing key: body (the suspension has {len(bodies) or 'no'} bodies{listed})")]
    return []


def _control_mistakes(scene):
    control, path = scene.control, ("control",)
    found = [] if scene.winches else [(path, "needs a winch: the cables that are reeled are listed under winches")]
    for name in control.allocation.weights if control.allocation and scene.winches else ():
        hint = suggestion(name, scene.winches)
        message = f"no winch reels this cable ({hint})" if name in scene.cables else f"unknown cable ({hint})"
        found += [] if name in scene.winches else [((*path, "allocation", "weights", name), message)]
    wrong_body = _body_mistakes(scene, path, control.body)
    return found + (wrong_body or _measured_mistakes(control.measured, scene.body_of(control), scene.bodies))


def _measured_mistakes(measured, name, bodies):
    """What is measured of a body that exists is free; `measured` is None for all that is."""
    free = bodies[name].free
    if not free and measured is None:
        return [(("control",), f"{name} is held, so that there is nothing to measure")]
    held = f"free: {', '.join(free)}" if free else "nothing of it is free"
    return [
        (("control", "measured", place), f"{motion} of {name} is held ({held})")
        for place, motion in enumerate(measured or ())
        if motion not in free
    ]


def _marker_mistakes(bodies, marker):
    known = [f"{name}.{inside}" for name, body in bodies.items() for inside in body.markers]
    if marker in known:
        return []
    hint = suggestion(marker, known) if known else "no body has markers"
    return [(("correction", "marker"), f"unknown marker {show(marker)} ({hint})")]


def case_mistakes(scene):
    """Forces, moves, ice and wind of load cases on what does not exist, move, stand or carry them; lost cables.

    Parameters
    ----------
    scene : SuspensionScene

    Returns
    -------
    list of (tuple, str)
        Path and message.
    """
    found = []
    for name, case in scene.cases.items():
        path = ("cases", name)
        for place, load in case.forces.items():
            found += [((*path, "forces", place), text) for text in _force_mistakes(scene, place, load)]
        for place, move in case.moves.items():
            found += [((*path, "moves", place), text) for text in _move_mistakes(scene, place, move)]
        found += [((*path, *inside), text) for inside, text in _list_mistakes(scene, case)]
    return found


def _list_mistakes(scene, case):
    """Yield path in a load case and message of wrong names in its lists of cables and bodies."""
    cables, blown = scene.cables, {name: body.wind for name, body in scene.bodies.items()}
    known = {"lost": cables, "ice": cables, "wind": {**cables, **blown}}
    for key, names in {"lost": case.lost, **case.listed}.items():
        for place, name in enumerate(names):
            path = (key, place) if key == "lost" else (key, "on", place)
            if name not in known[key]:
                kind = "cable or body" if key == "wind" else "cable"
                yield path, f"unknown {kind} {show(name)} ({suggestion(name, known[key])})"
            elif name in names[:place]:
                yield path, f"{name} is named twice"
            elif key != "lost" and name in case.lost:
                yield path, f"{name} is lost in this load case"
            elif known[key][name] is None:
                yield (
                    path,
                    f"{name} has no key wind (area, drag_coefficient): there is nothing to act on",
                )
    if case.lost and not set(cables) - set(case.lost):
        yield ("lost",), "no cable is left"
    for name in set(case.lost).intersection(case.loads):
        yield ("loads", name), f"{name} is lost in this load case"


def _force_mistakes(scene, place, load):
    """What is wrong with a force or moment of a load case, a list of at most one message."""
    points, bodies = scene.points, scene.bodies
    body, _, marker = place.partition(".")
    if body in bodies and marker in ("", *bodies[body].markers):
        if not bodies[body].free:
            return [f"{body} is held in all its motions: a force on it changes nothing (moves shifts it)"]
        return [f"moment belongs to the body: write it for {body}"] if marker and any(load.moment) else []
    if place in points:
        if not points[place].free:
            return [f"{place} is fixed: a force on it changes nothing (moves shifts it)"]
        return ["moment belongs to a body: a point does not turn"] if any(load.moment) else []
    markers = [f"{name}.{inside}" for name, one in bodies.items() for inside in one.markers]
    known = [*(name for name, point in points.items() if point.free), *bodies, *markers]
    return [f"unknown point, body or marker ({suggestion(place, known)})"]


def _move_mistakes(scene, place, move):
    """What is wrong with a displacement of a load case, a list of at most one message."""
    points, bodies = scene.points, scene.bodies
    if place in points:
        return [f"{place} is free, it finds its place itself: forces push it"] if points[place].free else []
    if place in bodies:
        free = [axis for axis, shift in zip("xyz", move, strict=True) if shift and axis in bodies[place].free]
        return (
            [f"{place} is free along {', '.join(free)}, where it finds its place itself: forces push it"]
            if free
            else []
        )
    known = [*(name for name, point in points.items() if not point.free),
             *(name for name, body in bodies.items() if not {"x", "y", "z"} <= set(body.free))]  # fmt: skip
    hint = suggestion(place, known) if known else "a place in brackets has no name: give it one under points"
    return [f"unknown fixed point or held body ({hint})"]
