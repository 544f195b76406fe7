"""Drag of the bodies and cables of suspensions: the numbers that scenes state of it, as arrays."""

import numpy as np

from cablestudy.wind.mean import Drag


def drag_of(scenes, body_names, cable_names):
    """Collect the mean wind and the drag areas of scenes in one `Drag`, with a leading axis of cases.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        With wind, and with equal names of bodies and cables.
    body_names, cable_names : sequence of str
        Bodies and junctions, and cables, in the order of the `SuspendedSystem`.

    Returns
    -------
    Drag
        Its arrays have the axis of cases. Drag is 0 where a scene has no wind on the cables, or none on the bodies.
    """
    winds = [scene.wind for scene in scenes]
    angle = np.array([wind.direction for wind in winds])
    speed = np.array([wind.speed for wind in winds])
    direction = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    areas, centers = np.zeros((2, len(scenes), len(body_names), 3))
    widths = np.zeros((len(scenes), len(cable_names)))
    for case, scene in enumerate(scenes):
        if scene.wind.on != "bodies":
            widths[case] = scene.wind.cable_drag_coefficient * wind_diameters(scene)
        if scene.wind.on != "cables":
            areas[case], centers[case] = drag_areas_of_bodies(scene, body_names)
    density = np.array([wind.air_density for wind in winds])
    return Drag(speed[:, None] * direction, density, widths, areas, centers)


def wind_diameters(scene):
    """Diameter of each cable that the wind sees, ice included, shape (c,). [m]"""
    return np.array([scene.load_case.of_cable(name).wind_diameter(cable) for name, cable in scene.cables.items()])


def drag_areas_of_bodies(scene, body_names):
    """Areas of bodies and junctions in the wind, and their centres of pressure.

    Returns
    -------
    areas : ndarray, shape (b, 3)
        Drag coefficient times area along each body axis. [m^2]
    centers : ndarray, shape (b, 3)
        Centres of pressure from the reference points, body axes. [m]
    """
    areas, centers = np.zeros((2, len(body_names), 3))
    for body, name in enumerate(body_names):
        table = scene.bodies[name].wind if name in scene.bodies else None
        if table:
            areas[body] = table.drag_coefficient * np.array(table.areas)
            centers[body] = table.center_of_pressure
    return areas, centers
