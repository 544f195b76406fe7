"""Check the names by which control, actuators, correction, wind and load cases of a suspension refer to its parts."""

from cablestudy.scene.fields import suggestion
from cablestudy.scene.units import show


def reference_mistakes(scene):
    """Path and message of names in control, actuators, correction and wind of a suspension that refer to nothing.

    Control and actuators name bodies. The allocation of the control names cables with a winch. The correction (a mirror
    that follows the motion) names a marker, a point on a body. Further mistakes are: no body named where there are
    several, control without a winch, a measured motion that is held, and wind on bodies none of which has the key
    `wind`.
    """
    mistakes = _control_mistakes(scene) if scene.control else []
    for name, actuator in scene.actuators.items():
        mistakes += _body_mistakes(scene, ("actuators", name), actuator.body)
    if scene.correction:
        mistakes += _marker_mistakes(scene.bodies, scene.correction.marker)
    wind = scene.wind
    if wind and wind.on == "bodies" and not any(body.wind for body in scene.bodies.values()):
        message = "bodies: no body has the key wind (area, drag_coefficient), so that there is nothing to act on"
        mistakes.append((("wind", "on"), message))
    return mistakes


def _body_mistakes(scene, path, name):
    """Path and message where a table does not say to which body it belongs: an unknown name, or None of several."""
    bodies = scene.bodies
    if name is not None and name not in bodies:
        return [((*path, "body"), f"unknown body ({suggestion(name, bodies)})")]
    if name is None and len(bodies) != 1:
        listed = f": {', '.join(bodies)}" if bodies else ""
        return [(path, f"missing key: body (the suspension has {len(bodies) or 'no'} bodies{listed})")]
    return []


def _control_mistakes(scene):
    """Path and message where control needs winches, names other cables, or measures what cannot move."""
    control, path = scene.control, ("control",)
    mistakes = [] if scene.winches else [(path, "needs a winch: the cables that are reeled are listed under winches")]
    weights = control.allocation.weights if control.allocation and scene.winches else {}
    for name in (name for name in weights if name not in scene.winches):
        hint = suggestion(name, scene.winches)
        message = f"no winch reels this cable ({hint})" if name in scene.cables else f"unknown cable ({hint})"
        mistakes.append(((*path, "allocation", "weights", name), message))
    wrong_body = _body_mistakes(scene, path, control.body)
    return mistakes + (wrong_body or _measured_mistakes(control.measured, scene.body_of(control), scene.bodies))


def _measured_mistakes(measured, name, bodies):
    """Path and message of measured motions of a body that are held; `measured` is None for all that are free."""
    free = bodies[name].free
    if not free and measured is None:
        return [(("control",), f"{name} is held, so that there is nothing to measure")]
    hint = f"free: {', '.join(free)}" if free else "nothing of it is free"
    return [
        (("control", "measured", index), f"{motion} of {name} is held ({hint})")
        for index, motion in enumerate(measured or ())
        if motion not in free
    ]


def _marker_mistakes(bodies, marker):
    """Path and message where the corrected marker does not exist."""
    known = _marker_names(bodies)
    if marker in known:
        return []
    hint = suggestion(marker, known) if known else "no body has markers"
    return [(("correction", "marker"), f"unknown marker {show(marker)} ({hint})")]


def _marker_names(bodies):
    """List of all markers as BODY.MARKER."""
    return [f"{name}.{marker}" for name, body in bodies.items() for marker in body.markers]


def case_mistakes(scene):
    """Path and message of wrong names in the load cases of a suspension, of what loads act on and of lost cables.

    A force must act on a point or body that is free to move. A move (a prescribed displacement) must be of a held
    point, or of a body in directions in which it is held. Ice and wind must act on cables or bodies that exist. A lost
    cable can carry no load.
    """
    mistakes = []
    for name, case in scene.cases.items():
        path = ("cases", name)
        for target, load in case.forces.items():
            mistakes += [((*path, "forces", target), text) for text in _force_mistakes(scene, target, load)]
        for target, move in case.moves.items():
            mistakes += [((*path, "moves", target), text) for text in _move_mistakes(scene, target, move)]
        mistakes += [((*path, *path_in_case), text) for path_in_case, text in _list_mistakes(scene, case)]
    return mistakes


def _list_mistakes(scene, case):
    """Yield path inside a load case and message on names of cables that are lost, and of what ice and wind are on.

    A name must exist and be named once. A lost cable can carry neither ice, wind nor point loads; a body in the wind
    needs its key `wind`; one cable must be left.
    """
    cables, wind_of_bodies = scene.cables, {name: body.wind for name, body in scene.bodies.items()}
    known = {"lost": cables, "ice": cables, "wind": {**cables, **wind_of_bodies}}  # names that each list may have
    for key, names in {"lost": case.lost, **case.listed}.items():
        for index, name in enumerate(names):
            path = (key, index) if key == "lost" else (key, "on", index)
            if name not in known[key]:
                kind = "cable or body" if key == "wind" else "cable"
                yield path, f"unknown {kind} {show(name)} ({suggestion(name, known[key])})"
            elif name in names[:index]:
                yield path, f"{name} is named twice"
            elif key != "lost" and name in case.lost:
                yield path, f"{name} is lost in this load case"
            elif known[key][name] is None:
                yield path, f"{name} has no key wind (area, drag_coefficient): there is nothing to act on"
    if case.lost and not set(cables) - set(case.lost):
        yield ("lost",), "no cable is left"
    for name in set(case.lost).intersection(case.loads):
        yield ("loads", name), f"{name} is lost in this load case"


def _force_mistakes(scene, target, load):
    """Message on a load of a load case on a target, POINT, BODY or BODY.MARKER: a list, empty where it is right."""
    points, bodies = scene.points, scene.bodies
    body, _, marker = target.partition(".")
    if body in bodies and marker in ("", *bodies[body].markers):
        if not bodies[body].free:
            return [f"{body} is held in all its motions: a force on it changes nothing (moves shifts it)"]
        return [f"moment belongs to the body: write it for {body}"] if marker and any(load.moment) else []
    if target in points:
        if not points[target].free:
            return [f"{target} is fixed: a force on it changes nothing (moves shifts it)"]
        return ["moment belongs to a body: a point does not turn"] if any(load.moment) else []
    free_points = [name for name, point in points.items() if point.free]
    known = [*free_points, *bodies, *_marker_names(bodies)]
    return [f"unknown point, body or marker ({suggestion(target, known)})"]


def _move_mistakes(scene, target, move):
    """Message on a displacement of a load case of a target, POINT or BODY: a list, empty where it is right."""
    points, bodies = scene.points, scene.bodies
    if target in points:
        return [f"{target} is free, it finds its place itself: forces push it"] if points[target].free else []
    if target in bodies:
        free = [axis for axis, shift in zip("xyz", move, strict=True) if shift and axis in bodies[target].free]
        message = f"{target} is free along {', '.join(free)}, where it finds its place itself: forces push it"
        return [message] if free else []
    fixed_points = [name for name, point in points.items() if not point.free]
    known = fixed_points + [name for name, body in bodies.items() if not {"x", "y", "z"} <= set(body.free)]
    hint = suggestion(target, known) if known else "a place in brackets has no name: give it one under points"
    return [f"unknown fixed point or held body ({hint})"]
