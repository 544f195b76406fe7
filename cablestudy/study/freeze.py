"""A scene with the unstretched lengths of its cables instead of the preloads, sags and tensions that give them."""

import numpy as np

from cablestudy.scene.determinacy import STATED
from cablestudy.statics.rigid import to_angles
from cablestudy.study.one_cable.case import CableCase
from cablestudy.study.tolerances import STUDY

OF_LENGTHS = ("solve_for", "tensions")  # keys of a suspension whose lengths are found where its bodies stand


def freeze_cable(document, scene):
    """File contents of a scene of one cable that states the unstretched length in place of preload, tension or sag.

    The cable then keeps its length when other values of the scene are varied; values of base files are included. The
    contents are plain values, the length with as many digits as a double has. NoSolutionError or ConvergenceError if
    there is no equilibrium in the reference state.
    """
    contents, case, length = document.stated_keys, CableCase(scene.in_case(None)), scene.cable.unstretched_length
    case.results.check(case.index)
    return {**contents, "cable": _with_length(contents["cable"], case.reference_length if length is None else length)}


def freeze_suspension(document, scene):
    """Contents of the file of a `SuspensionScene` with the lengths of all its cables; parameters as for `freeze_cable`.

    Free points and bodies have the positions of the reference state, from which the search for an equilibrium starts.
    """
    from cablestudy.study.suspension.case import SuspensionCase

    contents, group = document.stated_keys, SuspensionCase(scene.in_case(None)).group
    equilibrium, lengths = group.reference, group.cables.reference_length[0].tolist()
    lengths = dict(zip(scene.cables, lengths, strict=True))
    lengths |= {name: cable.unstretched_length for name, cable in scene.cables.items() if cable.unstretched_length}
    changed = {"cables": {name: _with_length(cable, lengths[name]) for name, cable in contents["cables"].items()}}
    if scene.links:
        distances = zip(contents["links"].items(), equilibrium.suspension.link_length[0].tolist(), strict=True)
        changed["links"] = {name: {"length": f"{length!r} m", **link} for (name, link), length in distances}
    if "cable" in contents:
        changed["cable"] = _without_lengths(contents["cable"])
    unchanged = {key: entry for key, entry in contents.items() if key not in OF_LENGTHS}
    return unchanged | changed | _tables_of_bodies(contents, scene, equilibrium)


def _without_lengths(cable):
    """A table of a cable, or of all cables, without the keys of lengths, tensions and sags."""
    return {key: entry for key, entry in cable.items() if key not in STATED}


def _with_length(cable, length):
    """A table of a cable with its unstretched length instead. [m]"""
    return {**_without_lengths(cable), "unstretched_length": f"{float(length)!r} m"}


def _tables_of_bodies(contents, scene, equilibrium):
    """Tables `points` and `bodies` of a scene file in plain values, where there are any, with those of an equilibrium.

    Free points and bodies have the new position `at` [m]; bodies that are free to turn also the new `attitude`: roll,
    pitch and yaw [rad]. The first axis of the arrays of the equilibrium has one entry.
    """
    position = equilibrium.position[0]
    position = np.where(np.abs(position) > STUDY.dust * equilibrium.longest[0], position, 0.0)
    positions = dict(zip(equilibrium.suspension.body_names, position.tolist(), strict=True))
    angles = to_angles(equilibrium.rotation[0])
    angles = np.where(np.abs(angles) > STUDY.dust, angles, 0.0)
    attitudes = dict(zip(equilibrium.suspension.body_names, angles.tolist(), strict=True))
    points, bodies = dict(contents.get("points", {})), dict(contents.get("bodies", {}))
    for name, point in scene.points.items():
        if point.free:
            points[name] = {**points[name], "at": positions[name]}
    for name, body in scene.bodies.items():
        if body.free:
            # beside two free rotations the third is held from the attitude that the scene states
            stays = not body.turning or (len(body.turning) == 2 and body.attitude != "free")
            attitude = {} if stays else {"attitude": attitudes[name]}
            bodies[name] = {**bodies[name], "at": positions[name], **attitude}
    return ({"points": points} if points else {}) | ({"bodies": bodies} if bodies else {})
