"""Scenes of suspensions -> the numeric description that the solvers take, with an axis of cases."""

import numpy as np

from cablestudy.scene.determinacy import found_rotations
from cablestudy.scene.suspension_tables import MOTIONS, Tensions
from cablestudy.study.columns import attribute
from cablestudy.study.scene_values import load_arrays, places_of
from cablestudy.system import rigid
from cablestudy.system.suspension import GROUND, SuspendedSystem

ORIGIN = (0.0, 0.0, 0.0)
OF_JUNCTION = (True, True, True, False, False, False)  # what of it is free
OF_LINKS = ("link_stiffness", "link_damping", "link_length")
OF_CASE_AND_CABLE = ("elongation", "wind_diameter")  # numbers that a load case computes of a cable
# of the six entries in a scene, xx yy zz xy xz yz, that at each place of the tensor
TENSOR = [[0, 3, 4], [3, 1, 5], [4, 5, 2]]


class CableValues:
    """Numbers that scenes state of their cables, as `SceneValues` with a second axis of c cables.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        n of them, with the same cables.
    """

    def __init__(self, scenes):
        self._scenes = scenes

    def given(self, path):
        """A number that each cable states, or its scene, shape (n, c), not a number where there is none."""
        table, _, name = path.rpartition(".")
        if table == "cable":
            values = [[getattr(cable, name, None) for cable in scene.cables.values()] for scene in self._scenes]
        elif name in OF_CASE_AND_CABLE:
            values = [[getattr(scene.load_case.of_cable(own), name)(cable) for own, cable in scene.cables.items()]
                      for scene in self._scenes]  # fmt: skip
        elif table.startswith("load_case."):
            inside = path.partition(".")[2]
            values = [_of_case(scene, inside) for scene in self._scenes]
        else:
            values = [[attribute(scene, path)] * len(scene.cables) for scene in self._scenes]
        return np.array(values, dtype=float)

    @property
    def moves(self):
        """Displacements of the fixed ends of cables and links by the load cases, shape (n, c + l, 2, 3). [m]"""
        return np.array([
            [[s.load_case.moves.get(end, ORIGIN) if isinstance(end, str) else ORIGIN for end in one.ends]
             for one in s.lines.values()]
            for s in self._scenes
        ])  # fmt: skip

    def loads(self, of_case):
        """Point loads in the reference state, or `of_case`; see `load_arrays`, but of shape (n, c, k)."""
        parts = load_arrays([loads for scene in self._scenes for loads in loads_of(scene, of_case)])
        return tuple(part.reshape(len(self._scenes), -1, *part.shape[1:]) for part in parts)


def _of_case(scene, path):
    """A number of the load case of a scene as each of its cables has it: list."""
    case = scene.load_case
    if not case.listed:
        return [attribute(case, path)] * len(scene.cables)
    return [attribute(case.of_cable(name), path) for name in scene.cables]


def loads_of(scene, of_case):
    """Point loads that each cable of a scene carries in the reference state, or `of_case`: list of tuple of Load."""
    if of_case:
        return [scene.loads_on(name) for name in scene.cables]
    return [cable.loads if cable.reference.loads else () for cable in scene.cables.values()]


def kind_of_case(scene):
    """Kind of a load case, which cases solved together share: wind or none, loads at how many places, lost cables."""
    of_case = scene.load_case.loads and [places_of(loads) for loads in loads_of(scene, True)]
    return scene.load_case.wind is None, *of_case, scene.load_case.lost


def topology_of(scene):
    """Names, connections, what is free and what is stated: cases of one `SuspendedSystem` share them.

    Parameters
    ----------
    scene : SuspensionScene

    Returns
    -------
    dict
        The fields of `SuspendedSystem` that are no arrays of numbers, as tuples, which can be compared and hashed.
    """
    junctions = [name for name, point in scene.points.items() if point.free]
    names = (*scene.bodies, *junctions)
    index = {name: place for place, name in enumerate(names)}
    cables, lines = scene.cables.values(), scene.lines.values()
    free = (tuple([motion in body.free for motion in MOTIONS]) for body in scene.bodies.values())
    return {
        "body_names": names,
        "free": (*free, *[OF_JUNCTION] * len(junctions)),
        "junctions": len(junctions),
        "cable_names": tuple(scene.cables),
        "owner": tuple([tuple([index.get(scene.attachment(end)[0], GROUND) for end in one.ends]) for one in lines]),
        "link_names": tuple(scene.links),
        "given": tuple([cable.stated for cable in cables]),
    }


def connected_alike(scene, other):
    """True if two scenes share the very tables of what is connected with what, as rows do that vary other numbers."""
    shared = scene.cables is other.cables and scene.points is other.points and scene.links is other.links
    return (
        shared
        and len(scene.bodies) == len(other.bodies)
        and all(
            name == other_name and body.free is known.free and body.attachments is known.attachments
            for (name, body), (other_name, known) in zip(scene.bodies.items(), other.bodies.items(), strict=True)
        )
    )


def each_with(compute, scenes):
    """Results from the connections of each scene, computed once for neighbours that share them: list."""
    found = []
    for place, scene in enumerate(scenes):
        known = place and connected_alike(scene, scenes[place - 1])
        found.append(found[-1] if known else compute(scene))
    return found


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
    topology, *others = each_with(topology_of, scenes)
    if any(other is not topology and other != topology for other in others):
        raise ValueError("the scenes differ in their names, connections, free motions, or in what their cables state")
    of_cables = each_with(_cable_numbers, scenes)
    listed = [_numbers(scene) | numbers for scene, numbers in zip(scenes, of_cables, strict=True)]
    n, b, c = len(scenes), len(topology["body_names"]), len(topology["cable_names"])
    links = len(topology["link_names"])

    def array(name, *shape):
        return np.array([numbers[name] for numbers in listed], dtype=float).reshape(n, *shape)

    density = array("force_density", c)
    return SuspendedSystem(
        gravity=array("gravity"),
        position=array("position", b, 3),
        rotation=rigid.from_angles(array("angles", b, 3)),
        mass=array("mass", b),
        center=array("center", b, 3),
        inertia=array("inertia", b, 6)[..., TENSOR],
        force=array("force", b, 3),
        moment=array("moment", b, 3),
        place=array("place", c + links, 2, 3),
        axial_stiffness=array("axial_stiffness", c),
        cable_mass=array("cable_mass", c),
        value=array("value", c),
        force_density=None if np.isnan(density).all() else density,
        **({name: array(name, links) for name in OF_LINKS} if links else {}),
        **topology
        | {
            "free": np.array(topology["free"], dtype=bool).reshape(b, 6),
            "owner": np.array(topology["owner"], dtype=int).reshape(c + links, 2),
        },
    )


def distribution_of(scenes):
    """Keyword arguments that `system.lengths.solve` needs beside the numbers.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
        Of equal topology, with `solve_for: lengths`; n of them.

    Returns
    -------
    dict
        `method`; `low`, `high`, `reference`: ndarrays, shape (n, c) [N]; `moving`: ndarray of bool, shape (b, 6).
    """
    chosen = [scene.tensions or Tensions() for scene in scenes]
    names = list(scenes[0].cables)
    junctions = sum(point.free for point in scenes[0].points.values())
    turning = found_rotations(scenes[0])
    found = [[motion in turning.get(name, ()) for motion in MOTIONS] for name in scenes[0].bodies]
    high = [np.inf if tensions.max is None else tensions.max for tensions in chosen]
    return {
        "method": chosen[0].method,
        "low": np.array([[tensions.min] * len(names) for tensions in chosen]),
        "high": np.array([[limit] * len(names) for limit in high]),
        "reference": np.array([[_reference(tensions, name) for name in names] for tensions in chosen]),
        "moving": np.array([*found, *[OF_JUNCTION] * junctions], dtype=bool).reshape(-1, len(MOTIONS)),
    }


def _reference(tensions, cable):
    """What the tension of a cable shall be close to; zero where the file says nothing of it. [N]"""
    reference = tensions.reference
    return reference.get(cable, 0.0) if isinstance(reference, dict) else reference or 0.0


def _numbers(scene):
    """Name -> nested lists of the numbers of one scene but its cables, in the order of `topology_of`; None for none."""
    bodies = list(scene.bodies.values())
    points = [point for point in scene.points.values() if point.free]
    holders, still = [*bodies, *points], [ORIGIN] * len(points)
    return {
        "gravity": scene.gravity,
        "position": [holder.at for holder in holders],
        "angles": [*(body.start_angles for body in bodies), *still],
        "mass": [holder.mass for holder in holders],
        "center": [*(body.center_of_mass for body in bodies), *still],
        "inertia": [*(body.inertia_tensor for body in bodies), *[(0.0,) * 6] * len(points)],
        "force": [holder.force for holder in holders],
        "moment": [*(body.moment for body in bodies), *still],
    }


def _cable_numbers(scene):
    """The same of its cables and links, and where they end."""
    cables, links = scene.cables.values(), scene.links.values()
    return {
        "place": [number for one in scene.lines.values() for end in one.ends for number in scene.attachment(end)[1]],
        "axial_stiffness": [cable.section_axial_stiffness for cable in cables],
        "cable_mass": [cable.section_mass for cable in cables],
        "value": [cable.stated_value for cable in cables],
        "force_density": [cable.force_density for cable in cables],
        **{name: [getattr(link, name.removeprefix("link_")) for link in links] for name in OF_LINKS},
    }
