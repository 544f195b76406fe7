"""Positions of all that pictures of a case show: cables, points, bodies, loads, ground; and views of these."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from cablestudy.cable.geometry import clearance, load_sag, points_along
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.plots.words import case_words, force_text, length_text, shortened
from cablestudy.scene.words import counted
from cablestudy.statics.suspension import GROUND
from cablestudy.study.scene_kind import kind_of

FINE_POINTS, COARSE_POINTS, FEW_CABLES = 401, 61, 12  # points along a cable of a few, and of more cables than these
FLAT = 1e-3  # extent over that of the scene below which it is none
STATED = 5e-4  # relative difference from which a number and the one that the scene states differ in four digits
AZIMUTH, ELEVATION, DISTANCE = np.radians(-58), np.radians(18), 3.0  # of the eye; distance over the size of the scene
TOWARDS = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), np.tan(ELEVATION)]) * np.cos(ELEVATION)  # direction of the eye
RIGHT = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])  # on the paper


@dataclass(frozen=True)
class View:
    """Parallel projection."""

    title: str
    axes: np.ndarray  # shape (3, 2): directions to the right and upwards on the paper, unit vectors
    labels: tuple  # of the axes on the paper
    origin: np.ndarray  # shape (3,): position at the origin of the paper [m]

    def __call__(self, positions):
        """Coordinates on the paper for positions, shape (..., 3) -> (..., 2)."""
        return (positions - self.origin) @ self.axes


def view_along(title, across, up):
    """View of the coordinates across and up, 0 to 2: x, y, z."""
    return View(title, np.eye(3)[:, [across, up]], (f"{'xyz'[across]} [m]", f"{'xyz'[up]} [m]"), np.zeros(3))


VIEWS = view_along("From the front", 0, 2), view_along("From the side", 1, 2), view_along("From above", 0, 1)


@dataclass(frozen=True)
class Perspective:
    """Central projection on a plane through the centre of a scene of a size. [m]"""

    centre: np.ndarray
    size: float
    title: ClassVar = "Perspective"
    labels: ClassVar = ("", "")
    axes: ClassVar = np.stack([RIGHT, np.cross(TOWARDS, RIGHT)], axis=-1)  # to the right and upwards, shape (3, 2)

    def __call__(self, positions):
        """Coordinates on the paper for positions, shape (..., 3) -> (..., 2)."""
        apart, distance = positions - self.centre, DISTANCE * self.size
        return apart @ self.axes * (distance / (distance - apart @ TOWARDS))[..., None]


@dataclass(frozen=True)
class Drawing:
    """Places of all that is drawn of one case. [m]"""

    case: str | None  # name of the load case
    cables: np.ndarray  # shape (c, j, 3): points along each cable
    shares: np.ndarray  # shape (c, j): arc length at these points over the unstretched length [-]
    ends: np.ndarray  # shape (c, 2, 3): ends 1 and 2 of each cable
    form: object  # Catenary of shape (c,), or State of the only cable
    statics: object  # ClosedStatics or ElementStatics of the same cables
    stated: tuple  # preload [N] and sag [m] that the scene states of its only cable
    links: np.ndarray  # shape (l, 2, 3): ends of each link
    anchors: list  # (name, position) of each fixed end
    junctions: dict  # free point -> position, shape (3,)
    bodies: dict  # body -> positions of its attachments and its reference point, shape (k, 3)
    markers: np.ndarray  # shape (k, 3)
    winches: np.ndarray  # shape (k, 3): ends of cables that winches reel or move
    loads: list  # of each point load its position and force [N], shape (3,), and arc length along the unstretched cable
    ground: object  # as the scene states it: float, sequence of (x, level), or None
    lost: np.ndarray  # shape (k, j, 3): points along each cable that the load case lacks, where it would be with all

    @cached_property
    def held(self):
        """Places of ends, points, bodies and markers, shape (n, 3). [m]"""
        parts = (self.ends, self.links, *self.junctions.values(), *self.bodies.values(), self.markers)
        return np.concatenate([part.reshape(-1, 3) for part in parts])

    @cached_property
    def positions(self):
        """Places of `held`, and those along cables and lost cables, shape (n, 3). [m]"""
        return np.concatenate([*(part.reshape(-1, 3) for part in (self.cables, self.lost)), self.held])

    @cached_property
    def size(self):
        """Diagonal of the box that holds all `positions`. [m]"""
        return float(np.linalg.norm(np.ptp(self.positions, axis=0)))

    @property
    def perspective(self):
        """`Perspective` about the centre of that box."""
        return Perspective((self.positions.min(axis=0) + self.positions.max(axis=0)) / 2, self.size)

    @property
    def single(self):
        """True if there is one cable and nothing else that has two ends."""
        return len(self.cables) == 1 and not len(self.links)

    @cached_property
    def tension(self):
        """Mean tension of each cable, shape (c,). [N]"""
        return np.atleast_1d(self.statics.mean_tension)

    @cached_property
    def sag(self):
        """Vertical distance from chord to cable at mid-span, shape (c,). [m]"""
        return np.atleast_1d(self.statics.sag)

    @property
    def lengths(self):
        """Arc length along each unstretched cable, shape (c, j). [m]"""
        return np.atleast_1d(self.form.span.unstretched_length)[:, None] * self.shares

    @property
    def tensions(self):
        """Tension along each cable, shape (c, j). [N]"""
        tension = self.form.at(self.shares if np.ndim(self.form.span.chord) else self.shares[0])[1]
        return np.linalg.norm(tension.reshape(*self.shares.shape, -1), axis=-1)

    @cached_property
    def from_chord(self):
        """Places of points along each cable from its chord, shape (c, j, 3). [m]

        That of the chord is at the same horizontal distance, for an upright cable at the same share of the length.
        """
        apart, chord = self.cables - self.ends[:, :1], self.ends[:, 1] - self.ends[:, 0]
        run = (chord[:, :2] ** 2).sum(axis=-1)
        upright = run < (FLAT * np.linalg.norm(chord, axis=-1)) ** 2
        along = (apart[..., :2] * chord[:, None, :2]).sum(axis=-1) / np.where(upright, 1.0, run)[:, None]
        return apart - np.where(upright[:, None], self.shares, along)[..., None] * chord[:, None]

    @property
    def above_chord(self):
        """Heights of each cable above its chord, negative where it sags, shape (c, j), as of `from_chord`. [m]"""
        return self.from_chord[..., 2]

    def form_of(self, cable):
        """`Catenary` or `State` of one cable by its number."""
        return self.form.take(cable) if np.ndim(self.form.span.chord) else self.form

    def least_clearance(self):
        """The cable that is nearest above the ground, where that is known, and its clearance [m]; or None."""
        least = {}
        for cable in range(len(self.cables)) if self.ground is not None else ():
            try:
                least[cable] = clearance(self.form_of(cable), self.ends[cable, 0], self.ground)
            except NoSolutionError:  # it leaves the range where the ground is known
                continue
        nearest = min(least, key=least.get, default=None)
        return None if nearest is None else (nearest, least[nearest])

    @property
    def name(self):
        """Name of its load case, or what is drawn."""
        return shortened(self.case) if self.case else "cable"

    @cached_property
    def measure(self):
        """Distance of the only cable, or of a load on it, below its chord; of several cables the tension.

        The label shows it: the largest one of all cables. [m] or [N]
        """
        if not self.single:
            return float(np.max(self.statics.max_tension, initial=0.0))
        return load_sag(self.form_of(0)) if self.loads else float(self.sag[0])

    def label(self, largest):
        """Its name with its `measure`, in the unit of the largest one of all that are drawn."""
        if not self.single:
            return f"{self.name}: tension up to {force_text(self.measure, largest)}"
        if self.loads:  # a rider, for example, whose position differs from case to case
            side = "below" if self.measure >= 0 else "above"
            return f"{self.name}: load {length_text(abs(self.measure), largest)} {side} the chord"
        return f"{self.name}: sag {length_text(self.measure, largest)}"

    @property
    def contents(self):
        """Its cables in a title: the chord of the only one, or their number."""
        if not self.single:
            return counted(len(self.cables), "cable")
        return f"chord {length_text(float(np.ravel(self.form.span.chord)[0]))}"

    def title(self, with_sag=True):
        """Title with the main numbers: of the only cable also what the scene states, where it holds for another state.

        `with_sag`: whether the sag is defined.
        """
        parts = [f"{case_words(self.case) if self.case else 'Static form: '}{self.contents}"]
        if self.single:
            texts, values = (force_text, length_text), (float(self.tension[0]), float(self.sag[0]))
            numbers = zip(("preload", "sag"), texts, values, self.stated, strict=True)
            for name, text, value, stated in list(numbers)[: 1 + with_sag]:
                other = stated is not None and abs(value - stated) > STATED * stated
                parts.append(f"{name} {text(value)}{f' ({text(stated)} in the reference state)' if other else ''}")
        elif len(self.cables) and self.equally_tense:
            each = " each" if len(self.cables) > 1 else ""
            parts.append(f"mean tension {force_text(float(self.tension.max()))}{each}")
        return ", ".join(parts)

    @property
    def equally_tense(self):
        """True if all cables have the same mean tension."""
        return not len(self.tension) or self.tension.max() <= self.tension.min() * (1 + 1e-3)


def drawing_of(case):
    """`Drawing` of a `CableCase` or `SuspensionCase` in equilibrium: one cable as a suspension of a single cable."""
    scene, equilibrium = kind_of(case.scene).as_suspension(case.scene), case.rest
    suspension = equilibrium.suspension
    body_count, cable_rows = suspension.bodies, suspension.of_cables
    winches = [equilibrium.ends[suspension.cable_names.index(name), int(winch.end == "to")]
               for name, winch in scene.winches.items()]  # fmt: skip
    attachments, markers = _positions_of_bodies(scene, equilibrium)
    along_cables, shares = _curves(case)
    first_cable = next(iter(case.scene.cables.values()), None)  # if it is the only one, stated values are shown
    return Drawing(
        case=case.scene.case,
        cables=along_cables,
        shares=shares,
        ends=equilibrium.ends[cable_rows],
        form=case.form,
        statics=case.statics,
        stated=(None, None) if first_cable is None else (first_cable.force_of(first_cable.preload), first_cable.sag),
        links=equilibrium.ends[len(suspension.cable_names) :],
        anchors=_anchors(scene, equilibrium),
        junctions=dict(zip(suspension.body_names[body_count:], equilibrium.position[body_count:], strict=True)),
        bodies=attachments,
        markers=markers,
        winches=np.array(winches).reshape(-1, 3),
        loads=_loads(case.form, equilibrium.ends[cable_rows, :1]),
        ground=case.scene.ground,
        lost=_lost(case),
    )


def _anchors(scene, equilibrium):
    """Name and position of each end of a cable or link that is fixed: list of (str, ndarray)."""
    owners, anchors = equilibrium.suspension.owner.tolist(), []
    for (name, line), owner, ends in zip(scene.lines.items(), owners, equilibrium.ends, strict=True):
        for number, stated in enumerate(line.ends or (None, None)):
            if owner[number] == GROUND:
                unnamed = f"end {number + 1}" if len(owners) == 1 else name
                anchors.append((stated if isinstance(stated, str) else unnamed, ends[number]))
    return anchors


def _positions_of_bodies(scene, equilibrium):
    """Places of attachments and reference point of each body, dict of (k, 3), and of all markers, shape (m, 3). [m]"""
    positions, markers = {}, [np.zeros((0, 3))]
    names = equilibrium.suspension.body_names[: equilibrium.suspension.bodies]
    for name, position, rotation in zip(names, equilibrium.position, equilibrium.rotation, strict=False):
        body = scene.bodies[name]
        positions[name] = position + np.array([*body.attachments.values(), (0.0, 0.0, 0.0)]) @ rotation.T
        markers.append(position + np.array(list(body.markers.values())).reshape(-1, 3) @ rotation.T)
    return positions, np.concatenate(markers)


def _loads(form, starts):
    """Point loads on cables that begin at points of shape (c, 1, 3): list of position, force and arc length of each."""
    span = form.span
    forces = span.in_frame(span.load_forces, "global")
    at = points_along(form, _shares(span)).reshape(len(starts), forces.shape[-2], 3) + starts
    loads = zip(at.reshape(-1, 3), forces.reshape(-1, 3), span.load_positions.ravel(), strict=True)
    return [(position, force, length) for position, force, length in loads if force.any()]


def _shares(span):
    """Places of the point loads over the unstretched length, shape (..., k). [-]"""
    return span.load_positions / np.asarray(span.unstretched_length)[..., None]


def _curves(case):
    """Points along each cable [m], shape (c, j, 3), and their shares of the unstretched length, shape (c, j)."""
    ends, form = case.rest.ends[case.rest.suspension.of_cables], case.form
    even, loads = np.linspace(0.0, 1.0, FINE_POINTS if len(ends) <= FEW_CABLES else COARSE_POINTS), _shares(form.span)
    shares = np.sort(np.concatenate([np.broadcast_to(even, (*loads.shape[:-1], len(even))), loads], axis=-1))
    count = len(ends), shares.shape[-1]
    return points_along(form, shares).reshape(*count, 3) + ends[:, :1], shares.reshape(count)


def _lost(case):
    """Points along the cables that a case has lost where it stands with all of them, shape (k, j, 3). [m]"""
    lost, curves = getattr(case.scene.load_case, "lost", ()), np.zeros((0, 1, 3))
    if lost:
        try:
            names = case.unbroken.equilibrium.suspension.cable_names
            curves = _curves(case.unbroken)[0][[names.index(name) for name in lost]]
        except (NoSolutionError, ConvergenceError):  # nowhere to draw them
            pass
    return curves


def upright_plane(drawings):
    """Side view of a scene whose cable ends, points, bodies and markers all lie in one vertical plane; None of others.

    The horizontal axis of the view is the distance from end 1 for a scene of one cable. For other scenes it is x or y
    in a plane along one of these, else the horizontal distance from the point with the smallest x. `drawings` are those
    of one scene in several load cases.
    """
    first, size = drawings[0], max(drawing.size for drawing in drawings)
    held = np.concatenate([drawing.held for drawing in drawings])
    offsets = held[:, :2] - held[0, :2]
    farthest = offsets[np.argmax(np.hypot(*offsets.T))]
    level = direction(farthest, size)
    if np.abs(offsets @ [-level[1], level[0]]).max() > FLAT * size:  # some position is out of the plane
        return None
    if first.single:
        return view_from_end_1(held[0], level, first.ground)
    axis = next((k for k in (0, 1) if abs(level[1 - k]) < FLAT), None)
    if axis is not None:
        return VIEWS[axis]
    level = level * np.sign(level[0])
    start = held[np.argmin(offsets @ level)]
    start_name = next((name for name, position in first.anchors if np.allclose(position, start)), "the first end")
    return _side_view(np.array([*start[:2], 0.0]), level, f"horizontal distance from {start_name} [m]", "z [m]")


def direction(far, size):
    """Horizontal direction of a vector of shape (2,); x where it is negligible compared with a size. [-]"""
    length = float(np.hypot(*far))
    return far / length if length > FLAT * size else np.array([1.0, 0.0])


def view_from_end_1(start, level, ground):
    """View of a cable from a position along a horizontal direction, with levels where there is ground."""
    height, base = ("height above end 1 [m]", start[2]) if ground is None else ("level [m]", 0.0)
    return _side_view(np.array([*start[:2], base]), level, "horizontal distance from end 1 [m]", height)


def _side_view(origin, level, distance, height):
    """`View` along the horizontal, its axis to the right along `level`, (x, y), with labels of both axes."""
    return View("Side view", np.array([[*level, 0.0], [0.0, 0.0, 1.0]]).T, (distance, height), origin)


def ground_in(view, ground, x):
    """Line of the ground of a scene in a `View`: ascending distances to the right and levels, two arrays. [m]

    None if there is no ground, if the view is not from the side, or if it is along x and the levels depend on x. A
    ground of one level extends over the distances `x`.
    """
    right, up = view.axes.T
    if ground is None or up[2] != 1:  # no view from the side
        return None
    if isinstance(ground, float):
        return np.array([x.min(), x.max()]), np.full(2, ground - view.origin[2])
    along, level = np.array(ground, dtype=float).T
    if abs(right[0]) < FLAT:  # seen along x, over which the levels are stated
        return None
    distance = (along - view.origin[0]) / right[0]
    order = np.argsort(distance)
    return distance[order], level[order] - view.origin[2]
