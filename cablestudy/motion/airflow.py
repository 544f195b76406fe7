"""The wind on a suspension as its linear model needs it: aerodynamic damping, and the forces of gusts."""

from dataclasses import replace
from functools import cached_property, partial

import numpy as np

from cablestudy.cable.matrices import dense
from cablestudy.cable.vectors import size
from cablestudy.system.superelement import combined_loads
from cablestudy.wind.coherence import davenport
from cablestudy.wind.gusts import damping_of_bodies, gusts, stiffness_of_bodies
from cablestudy.wind.mean import Drag
from cablestudy.wind.strips import on_cables, strips


def drag_of(scenes, body_names, cable_names):
    """Collect the mean wind and the drag areas of n scenes in one `Drag`.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        n scenes with wind, whose names of bodies and cables are equal.
    body_names : sequence of str
        b bodies and junctions, in the order of the `SuspendedSystem`. Junctions have no drag.
    cable_names : sequence of str
        c cables, likewise.

    Returns
    -------
    Drag
        Its arrays have a leading axis of n scenes: horizontal mean wind [m/s]; density of the air [kg/m^3]; of cables,
        drag coefficient times diameter with ice [m]; of bodies, drag coefficient times area [m^2] and centre of
        pressure [m]. What the wind does not act on, bodies or cables by `wind.on`, has zeros.
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


def load_stiffness_of_bodies(layout, airflow):
    """Stiffness of the d free displacements by dead moments and, in an airflow, the drag on bodies, shape (d, d)."""
    by_moments = dense(layout.moment_stiffness)
    return by_moments if airflow is None else by_moments + airflow.stiffness_of_bodies(layout, np.eye(len(by_moments)))


class Airflow:
    """The wind on the bodies and cables of one case.

    Parameters
    ----------
    scene : SuspensionScene
        With wind.
    drag : Drag
        Of this case.
    mean_drag : Drag, optional
        Of the wind about whose equilibrium it moves, which damps what it acts on, and turns with it; None without one.

    Attributes
    ----------
    direction_name : str
        Name that differs for winds that damp a suspension alike and differ in their gusts.
    """

    direction_name = ""

    def __init__(self, scene, drag, mean_drag=None):
        self.scene, self.drag = scene, drag
        self.mean_drag = mean_drag if mean_drag is not None and mean_drag.velocity.any() else None  # a calm has none

    @property
    def on_cables(self):
        """True if gusts act on cables."""
        return bool(self.drag.cables.any())

    @property
    def damps(self):
        """True if the air damps motions."""
        return self.scene.wind.aerodynamic_damping

    @cached_property
    def damping_drags(self):
        """`Drag` of each wind by which the air damps what it acts on: list, empty without damping.

        That of the wind about whose equilibrium it moves; where this does not act, that of the gusts.
        """
        if not self.damps:
            return []
        if self.mean_drag is None or self.mean_drag is self.drag:
            return [self.drag]
        cables = np.where(self.mean_drag.cables > 0, 0.0, self.drag.cables)
        bodies = np.where(self.mean_drag.bodies.any(axis=-1, keepdims=True), 0.0, self.drag.bodies)
        return [self.mean_drag, replace(self.drag, cables=cables, bodies=bodies)]

    @property
    def damps_cables(self):
        """True if the air damps motions of cables."""
        return any(drag.cables.any() for drag in self.damping_drags)

    @property
    def damping_per_length(self):
        """Damping of each cable along a wind across it, rho C_d d U; across both it is half of that. [N s/m^2]"""
        return sum(
            (drag.density * drag.cables * size(drag.velocity) for drag in self.damping_drags), 0 * self.drag.cables
        )

    @property
    def turns_with_cables(self):
        """True if mean drag on cables changes with their motions, see `stiffness_of_cables`."""
        return self.damps and self.mean_drag is not None and bool(self.mean_drag.cables.any())

    def damping_of_cables(self, models, kept, equilibrium):
        """Yield index and aerodynamic damping of each of the cables of some `Models` that the air damps.

        Of its coordinates `kept` (a `ReducedCable` of each cable), or with None of all modes and ends, shape
        (n + 6, n + 6).
        """
        for drag in self.damping_drags:
            for group in strips(models, kept, equilibrium, drag):
                yield from zip(group.cables.tolist(), group.damping, strict=True)

    def stiffness_of_cables(self, models, kept, equilibrium):
        """Yield index and load stiffness of each of the cables whose mean drag turns; see `damping_of_cables`."""
        for group in strips(models, kept, equilibrium, self.mean_drag) if self.turns_with_cables else []:
            for cable, stiffness in zip(group.cables.tolist(), group.stiffness, strict=True):
                if models.meshes[cable] is not None:  # no wind acts at rest on cables without mass
                    yield cable, stiffness

    def damped(self, models, kept, equilibrium):
        """Superelements of the cables of some `Models` with aerodynamic damping and stiffness: list of ReducedCable."""
        if not self.damps:
            return kept
        damped = list(kept)

        def add(cable, **matrix):
            damped[cable] = replace(damped[cable], element=replace(damped[cable].element, **matrix))

        for cable, damping in self.damping_of_cables(models, kept, equilibrium):
            add(cable, air=damping)
        for cable, loads in self.stiffness_of_cables(models, None, equilibrium):
            loads = combined_loads(loads, models.elements[cable].omega, kept[cable].shapes)
            add(cable, load_stiffness=loads)
        return damped

    def damping_of_bodies(self, layout, shapes):
        """Damping of coordinates by the drag on bodies, see `gusts.damping_of_bodies`; 0 without damping."""
        return sum((damping_of_bodies(drag, layout, shapes) for drag in self.damping_drags), 0.0)

    def stiffness_of_bodies(self, layout, shapes):
        """Stiffness of coordinates by the mean drag on bodies, see `gusts.stiffness_of_bodies`; 0 without damping."""
        return stiffness_of_bodies(self.mean_drag, layout, shapes) if self.damps and self.mean_drag else 0.0

    def damped_system(self, modes):
        """The `LinearSystem` of some `CoupledModes` with aerodynamic damping, and its `Layout.holding_loads`.

        The latter is a function of shapes.
        """
        layout, system = modes.layout, modes.system
        elements = [cable.element for cable in self.damped(modes.models, modes.kept, layout.equilibrium)]
        if self.damps:
            system = layout.system(elements)
            system = system.with_damped_bodies(self.damping_of_bodies(layout, np.eye(system.bodies)))
        return system, partial(layout.holding_loads, elements, load_stiffness_of_bodies(layout, self))

    def gusts(self, modes, layout, shapes):
        """`Gusts` on the coordinates.

        Parameters
        ----------
        modes : CoupledModes
            Models and coordinates of the cables.
        layout : Layout
        shapes : ndarray, shape (n, m)
            Combinations of its coordinates.
        """
        wind, areas = self.scene.wind, self.areas(layout.equilibrium)
        strips_and_amplitudes = on_cables(modes, layout, shapes, self.drag)
        return gusts(wind, self.drag, layout, shapes, *strips_and_amplitudes, areas, davenport(wind))

    def areas(self, equilibrium):
        """Area of each body and junction across the mean wind, for its admittance, shape (b,). [m^2]"""
        direction = self.drag.velocity / np.sqrt((self.drag.velocity**2).sum())
        direction = (np.swapaxes(equilibrium.rotation, -1, -2) @ direction[:, None])[..., 0]  # in the axes of each body
        areas = np.zeros(len(direction))
        for body, name in enumerate(equilibrium.suspension.body_names):
            table = self.scene.bodies[name].wind if name in self.scene.bodies else None
            areas[body] = (np.array(table.areas) * direction[body] ** 2).sum() if table else 0.0
        return areas
