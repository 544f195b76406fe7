"""Many suspensions: those of equal names and connections are solved together, and those that rest alike once."""

from functools import partial

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError, outcome_of
from cablestudy.study.scene_values import places_of
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.study.suspension.group import Group
from cablestudy.study.suspension.numbers import distinct_connections, kind_of_case, loads_of, topology_of

IN_MOTION = {"winches", "actuators", "control", "exposure", "correction"}  # keys that change nothing at rest


def cases_of(scenes):
    """List of `SuspensionCase` of many scenes, those of equal names and connections solved together.

    Parameters
    ----------
    scenes : sequence of SuspensionScene
    """
    groups = {}
    first_scenes, runs = distinct_connections(scenes)
    connections = [_connections(scene) for scene in first_scenes]
    for index, (scene, run) in enumerate(zip(scenes, runs, strict=True)):
        method = scene.tensions and scene.tensions.method
        kinds = scene.case is None, scene.wind and scene.wind.mean, *kind_of_case(scene)
        groups.setdefault((connections[run], scene.solve_for, method, *kinds), []).append(index)
    cases = [None] * len(scenes)
    for indices in groups.values():
        groups_at_rest = _different_at_rest(scenes, indices)
        solved_groups = _solved_groups([scenes[members[0]] for members in groups_at_rest])
        for group_index, (members, group) in enumerate(zip(groups_at_rest, solved_groups, strict=True)):
            single = isinstance(group, Group) and len(group.problems) == 1  # solved alone, or the only one
            for index in members:
                cases[index] = SuspensionCase(scenes[index], group, 0 if single else group_index)
    return cases


def _different_at_rest(scenes, indices):
    """Lists of those of the `indices` of scenes that differ in the keys IN_MOTION alone, so that they rest alike.

    Where all scenes share the objects at these keys, they differ in other keys: each scene makes a list of its own.
    """
    first_scene, by_contents = scenes[indices[0]], {}
    if all(getattr(scenes[index], key) is getattr(first_scene, key) for index in indices for key in IN_MOTION):
        return [[index] for index in indices]
    for index in indices:
        by_contents.setdefault(scenes[index].model_dump_json(exclude=IN_MOTION), []).append(index)
    return list(by_contents.values())


def _connections(scene):
    """Connections, and counts of loaded positions on cables, which all cases of one `Group` must share: tuple."""
    load_counts = [places_of(cable.loads) for cable in scene.cables.values()]
    return (*topology_of(scene).values(), *load_counts, *[places_of(loads) for loads in loads_of(scene, False)])


def prepare(cases):
    """Compute the coupled modes with which the analyses of loop and wind begin (`solve_modes`), of many cases together.

    A case without an equilibrium, or without such modes, raises its error when it is asked for its numbers.

    Parameters
    ----------
    cases : sequence of SuspensionCase
    """
    from cablestudy.study.suspension.dynamic_analysis import solve_modes

    groups = {}
    for case in cases:
        if not isinstance(wind := outcome_of(partial(getattr, case, "in_wind")), Exception):
            groups.setdefault(id(case.group), (case.group, []))[1].append((case.index, wind))
    for group, members in groups.values():
        indices, winds = (list(values) for values in zip(*members, strict=True))
        solve_modes(winds, group.in_mean_wind[0].take(np.array(indices)))


def _solved_groups(scenes):
    """For each of some scenes of equal topology its `Group`, or error: scenes that fail together are solved alone."""
    try:
        return [Group(scenes)] * len(scenes)
    except (NoSolutionError, ConvergenceError) as error:
        return [error] if len(scenes) == 1 else [result for scene in scenes for result in _solved_groups([scene])]
