"""A scene with the unstretched lengths of its cables instead of the preloads, sags and tensions that give them."""

import numpy as np

from cablestudy.scene.determinacy import STATED
from cablestudy.study.case import Case
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.tolerances import STUDY
from cablestudy.system.rigid import to_angles

OF_LENGTHS = ("solve_for", "tensions")  # keys of a suspension whose lengths are found where its bodies stand


def freeze_cable(document, scene):
    """Contents of the file of a scene of one cable with its length in the reference state, all of it resolved.

    Parameters
    ----------
    document : Document
    scene : CableScene
        The same in SI.

    Returns
    -------
    dict
        Plain values; lengths with as many digits as a double has.

    Raises
    ------
    NoSolutionError, ConvergenceError
        There is no reference state.
    """
    value, case, stated = document.given, Case(_without_case(scene)), scene.cable.unstretched_length
    case.results.check(case.index)
    return {**value, "cable": _with_length(value["cable"], case.reference_length if stated is None else stated)}


def freeze_suspension(document, scene):
    """Contents of the file of a `SuspensionScene` with the lengths of all its cables.

    Free points, and bodies as far as they move, stand where the reference state has them: there a search begins.
    """
    value, group = document.given, SuspensionCase(_without_case(scene)).group
    found, lengths = group.reference, dict(zip(scene.cables, group.cables.reference_length[0].tolist(), strict=True))
    lengths |= {name: cable.unstretched_length for name, cable in scene.cables.items() if cable.unstretched_length}
    changed = {"cables": {name: _with_length(cable, lengths[name]) for name, cable in value["cables"].items()}}
    if scene.links:
        distances = zip(value["links"].items(), found.suspension.link_length[0].tolist(), strict=True)
        changed["links"] = {name: {"length": f"{length!r} m", **link} for (name, link), length in distances}
    if "cable" in value:
        changed["cable"] = _unstated(value["cable"])
    kept = {key: own for key, own in value.items() if key not in OF_LENGTHS}
    return kept | changed | _places(value, scene, found)


def _without_case(scene):
    """A scene in its reference state with its loads, in none of its load cases."""
    return scene.model_copy(update={"case": None})


def _unstated(cable):
    """A table of a cable, or of all, without what it states of lengths, tensions and sags."""
    return {key: own for key, own in cable.items() if key not in STATED}


def _with_length(cable, length):
    """A table of a cable with its unstretched length instead. [m]"""
    return {**_unstated(cable), "unstretched_length": f"{float(length)!r} m"}


def _places(value, scene, found):
    """The tables of points and bodies with what was found of places and attitudes."""
    position = np.where(np.abs(found.position[0]) > STUDY.dust * found.longest[0], found.position[0], 0.0)
    places = dict(zip(found.suspension.body_names, position.tolist(), strict=True))
    turned = dict(zip(found.suspension.body_names, to_angles(found.rotation[0]).tolist(), strict=True))
    points, bodies = dict(value.get("points", {})), dict(value.get("bodies", {}))
    for name, point in scene.points.items():
        if point.free:
            points[name] = {**points[name], "at": places[name]}
    for name, body in scene.bodies.items():
        if not body.free:
            continue
        own = {**bodies[name], "at": places[name]}
        if {"roll", "pitch", "yaw"} & set(body.free):
            own["attitude"] = turned[name]
        bodies[name] = own
    return ({"points": points} if points else {}) | ({"bodies": bodies} if bodies else {})
