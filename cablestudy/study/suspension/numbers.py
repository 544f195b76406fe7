"""Numeric description of scenes of suspensions for the solvers, with an axis of cases: `SuspendedSystem`."""

from functools import cached_property

import numpy as np

from cablestudy.scene.determinacy import MOTIONS, found_rotations
from cablestudy.scene.scene import CableScene
from cablestudy.scene.suspension_tables import Tensions
from cablestudy.statics import rigid
from cablestudy.statics.suspension import GROUND, SuspendedSystem
from cablestudy.study.load_arrays import load_arrays, position_count
from cablestudy.study.stated_numbers import StatedNumbers

ORIGIN = (0.0, 0.0, 0.0)
OF_JUNCTION = (True, True, True, False, False, False)  # its free displacements and rotations
OF_LINKS = ("link_stiffness", "link_damping", "link_length")
# index of each entry of the tensor among the six in a scene, xx yy zz xy xz yz
TENSOR = [[0, 3, 4], [3, 1, 5], [4, 5, 2]]


class SingleCable:
    """A cable of a suspension with the attributes of a scene of one cable, `CableScene`."""

    gondola = winch = None
    elongation, wind_diameter = CableScene.elongation, CableScene.wind_diameter

    def __init__(self, scene, name):
        self._scene, self._name, self.cable = scene, name, scene.cables[name]

    @property
    def load_case(self):
        """Its load case, with the ice, wind and point loads that are on it."""
        case = self._scene.load_case.of_cable(self._name)
        return case.model_copy(update={"loads": case.loads.get(self._name, ())}) if case.loads else case

    @property
    def loads(self):
        """All point loads on it."""
        return self._scene.loads_on(self._name)

    def __getattr__(self, name):
        """All else is that of the suspension."""
        return getattr(self._scene, name)


class CableNumbers:
    """Numbers that scenes state of their cables, as `StatedNumbers` with a second axis of c cables.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        n of them, with the same cables.
    """

    def __init__(self, scenes):
        self._scenes = scenes

    @cached_property
    def _of_cables(self):
        """`StatedNumbers` of all cables, scene by scene."""
        return StatedNumbers([SingleCable(scene, name) for scene in self._scenes for name in scene.cables])

    def number(self, path):
        """A number of each cable of each scene, shape (n, c); see `StatedNumbers.number`."""
        return self._of_cables.number(path).reshape(len(self._scenes), len(self._scenes[0].cables))

    @property
    def grounds(self):
        """Ground of each scene: list of n."""
        return [scene.ground for scene in self._scenes]

    @property
    def moves(self):
        """Displacements of the fixed ends of cables and links by the load cases, shape (n, c + l, 2, 3). [m]"""
        return np.array([
            [[scene.load_case.moves.get(end, ORIGIN) if isinstance(end, str) else ORIGIN for end in line.ends]
             for line in scene.lines.values()]
            for scene in self._scenes
        ])  # fmt: skip

    def loads(self, of_case):
        """Point loads in the reference state, or `of_case`; see `load_arrays`, but of shape (n, c, k)."""
        arrays = load_arrays([loads for scene in self._scenes for loads in loads_of(scene, of_case)])
        return tuple(array.reshape(len(self._scenes), -1, *array.shape[1:]) for array in arrays)


def loads_of(scene, of_case):
    """Point loads that each cable of a scene carries in the reference state, or `of_case`: list of tuple of Load."""
    if of_case:
        return [scene.loads_on(name) for name in scene.cables]
    return [cable.loads if cable.reference.loads else () for cable in scene.cables.values()]


def kind_of_case(scene):
    """Kind of a load case, which cases solved together share: wind or none, numbers of loads, lost cables. Tuple."""
    of_case = scene.load_case.loads and [position_count(loads) for loads in loads_of(scene, True)]
    return scene.load_case.wind is None, *of_case, scene.load_case.lost


def topology_of(scene):
    """Describe what is connected to what in a suspension, to find scenes that can be solved together.

    Those are the scenes for which the result is equal: they differ in numbers only.

    Parameters
    ----------
    scene : SuspensionScene

    Returns
    -------
    dict
        The fields of `SuspendedSystem` that are no arrays of numbers: names of bodies and free points, of cables and
        links, which of them holds each end, which motions are free, and what each cable states (its length, a tension
        or a sag). All values are tuples or int, so that they can be compared and hashed.
    """
    junctions = [name for name, point in scene.points.items() if point.free]
    names = (*scene.bodies, *junctions)
    index = {name: number for number, name in enumerate(names)}
    cables, lines = scene.cables.values(), scene.lines.values()
    free = (tuple([motion in body.free for motion in MOTIONS]) for body in scene.bodies.values())
    return {
        "body_names": names,
        "free": (*free, *[OF_JUNCTION] * len(junctions)),
        "junctions": len(junctions),
        "cable_names": tuple(scene.cables),
        "owner": tuple([tuple([index.get(scene.attachment(end)[0], GROUND) for end in line.ends]) for line in lines]),
        "link_names": tuple(scene.links),
        "stated": tuple([cable.stated for cable in cables]),
    }


def equal_connections(scene, other):
    """True if two scenes share the same objects for all connections, as rows do that vary other numbers."""
    shared = scene.cables is other.cables and scene.points is other.points and scene.links is other.links
    return (
        shared
        and len(scene.bodies) == len(other.bodies)
        and all(
            name == other_name and body.free is other_body.free and body.attachments is other_body.attachments
            for (name, body), (other_name, other_body) in zip(scene.bodies.items(), other.bodies.items(), strict=True)
        )
    )


def distinct_connections(scenes):
    """The first of each run of neighbours that share their connections, and the number of the run of each scene.

    Returns
    -------
    first_scenes : list of SuspensionScene
    runs : list of int
    """
    first_scenes, runs = [], []
    for number, scene in enumerate(scenes):
        if not number or not equal_connections(scene, scenes[number - 1]):
            first_scenes.append(scene)
        runs.append(len(first_scenes) - 1)
    return first_scenes, runs


def numbers_of(scenes):
    """The numeric description of one or more scenes.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        Of equal topology; n of them.

    Returns
    -------
    SuspendedSystem
        With one axis of cases, shape (n,).

    Raises
    ------
    ValueError
        The scenes differ in more than numbers.
    """
    first_scenes, runs = distinct_connections(scenes)
    topology, *other_topologies = map(topology_of, first_scenes)
    if any(other != topology for other in other_topologies):
        raise ValueError("the scenes differ in their names, connections, free motions, or in what their cables state")
    b, lines = len(topology["body_names"]), len(topology["owner"])
    arrays = {
        "free": np.array(topology["free"], dtype=bool).reshape(b, 6),
        "owner": np.array(topology["owner"], dtype=int).reshape(lines, 2),
    }
    of_scenes = [_numbers_of_lines(scene) for scene in first_scenes]
    of_lines = {name: np.array([numbers[name] for numbers in of_scenes])[runs] for name in of_scenes[0]}
    if np.isnan(of_lines["force_density"]).all():
        of_lines["force_density"] = None
    of_bodies = _arrays_of_bodies(scenes)
    if rigid.about_two_axes(arrays["free"]).any():
        of_bodies["attitude"] = of_bodies["rotation"]
    return SuspendedSystem(
        gravity=np.array([scene.gravity for scene in scenes], dtype=float),
        **of_bodies,
        **of_lines,
        **topology | arrays,
    )


def _arrays_of_bodies(scenes):
    """Fields of `SuspendedSystem` of the b bodies and free points of n scenes: dict, arrays of shape (n, b, ...)."""
    bodies = list(zip(*(scene.bodies.values() for scene in scenes), strict=True))  # each in all scenes
    free_points = ([point for point in scene.points.values() if point.free] for scene in scenes)
    points = list(zip(*free_points, strict=True))

    def array(name, *shape, of_points=True):
        """Numbers of bodies and free points, or zero in place of those of points."""
        numbers = np.zeros((len(scenes), len(bodies) + len(points), *shape))
        for index, in_scenes in enumerate((*bodies, *(points if of_points else ()))):
            values = [getattr(owner, name) for owner in in_scenes]
            numbers[:, index] = values[0] if len(set(map(id, values))) == 1 else values  # often one object in all
        return numbers

    return {
        "position": array("at", 3),
        "rotation": rigid.from_angles(array("start_angles", 3, of_points=False)),
        "mass": array("mass"),
        "center": array("center_of_mass", 3, of_points=False),
        "inertia": array("inertia_tensor", 6, of_points=False)[..., TENSOR],
        "force": array("force", 3),
        "moment": array("moment", 3, of_points=False),
    }


def distribution_of(scenes):
    """Settings of the search for cable lengths with which n suspensions rest in given places (`solve_for: lengths`).

    Where there are more cables than equations of equilibrium, they say how tensions are distributed among the cables.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        n scenes with equal parts and connections.

    Returns
    -------
    dict
        Keyword arguments of `statics.lengths.solve`:

        * `method`, a str: `balanced`, `least` or `closest`;
        * `low`, `high`: bounds of the mean tensions, and `reference`: the tensions that `closest` approaches, ndarrays
          of shape (n, c) for c cables [N];
        * `moving`: ndarray of bool, shape (b, 6), for b bodies and free points; True for the displacements and
          rotations that are found together with the lengths, and are not given.
    """
    settings = [scene.tensions or Tensions() for scene in scenes]
    names = list(scenes[0].cables)
    junctions = sum(point.free for point in scenes[0].points.values())
    rotations = found_rotations(scenes[0])
    free_rotations = [[motion in rotations.get(name, ()) for motion in MOTIONS] for name in scenes[0].bodies]
    high = [np.inf if tensions.max is None else tensions.max for tensions in settings]
    return {
        "method": settings[0].method,
        "low": np.array([[tensions.min] * len(names) for tensions in settings]),
        "high": np.array([[limit] * len(names) for limit in high]),
        "reference": np.array([[_reference(tensions, name) for name in names] for tensions in settings]),
        "moving": np.array([*free_rotations, *[OF_JUNCTION] * junctions], dtype=bool).reshape(-1, len(MOTIONS)),
    }


def _reference(tensions, cable):
    """Tension of a cable to which the solution is to be close; zero where the file states none. [N]"""
    reference = tensions.reference
    return reference.get(cable, 0.0) if isinstance(reference, dict) else reference or 0.0


def _numbers_of_lines(scene):
    """Fields of `SuspendedSystem` of the c cables and l links of a scene: dict, arrays of shape (c,) or (l,)."""
    cables, links = scene.cables.values(), scene.links.values()
    numbers = {
        "axial_stiffness": [cable.section_axial_stiffness for cable in cables],
        "cable_mass": [cable.section_mass for cable in cables],
        "value": [cable.stated_value for cable in cables],
        "force_density": [cable.force_density for cable in cables],
    }
    if links:
        numbers |= {name: [getattr(link, name.removeprefix("link_")) for link in links] for name in OF_LINKS}
    attachments = [[scene.attachment(end)[1] for end in line.ends] for line in scene.lines.values()]
    arrays = {name: np.array(of_lines, dtype=float) for name, of_lines in numbers.items()}
    return {"attachment": np.array(attachments, dtype=float).reshape(-1, 2, 3), **arrays}
