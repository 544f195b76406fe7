"""Values of many scenes as arrays with an axis of cases."""

import numpy as np

from cablestudy.cable.span import merged_loads
from cablestudy.study.columns import lacks, without


class SceneValues:
    """Values of scenes whose cables carry loads at equally many places.

    Parameters
    ----------
    scenes : sequence of Scene
    """

    def __init__(self, scenes):
        self.scenes, self._known = scenes, {}

    def __len__(self):
        return len(self.scenes)

    def given(self, path):
        """A number of each scene.

        Parameters
        ----------
        path : str
            Attribute of `Scene` with dots, for example `cable.section_area`.

        Returns
        -------
        ndarray of float, shape (n,)
            In SI; not a number where a scene has none.
        """
        if path not in self._known:
            names = path.split(".")
            self._known[path] = np.array([_value(scene, names) for scene in self.scenes], dtype=float)
        return self._known[path]

    def lacking(self, column):
        """Case -> NoSolutionError, of the cases that lack a key which a column needs."""
        if not column.keys:
            return {}
        return {case: without(scene, column) for case, scene in enumerate(self.scenes) if lacks(scene, column)}

    @property
    def ends(self):
        """Places of end 1 and end 2, each of shape (n, 3). [m]"""
        cables = [scene.cable for scene in self.scenes]
        return np.array([cable.end_1 for cable in cables]), np.array([cable.end_2 for cable in cables])

    @property
    def loads(self):
        """Arc lengths, shape (n, k) [m], and global forces, shape (n, k, 3) [N], of the point loads."""
        cables = [scene.cable for scene in self.scenes]
        if not cables[0].loads:
            return np.zeros((len(cables), 0)), np.zeros((len(cables), 0, 3))
        merged = [merged_loads((load.at, load.force) for load in cable.loads) for cable in cables]
        positions, forces = ([[load[part] for load in loads] for loads in merged] for part in (0, 1))
        return np.array(positions), np.array(forces)


class TableValues:
    """Values of many scenes that differ in numbers only; attributes as of `SceneValues`.

    Parameters
    ----------
    scene : Scene
        Each number that varies is an array of shape (n,), in SI; so are the properties that follow from it.
    count : int
        n.
    """

    def __init__(self, scene, count):
        self.scene, self._count = scene, count

    def __len__(self):
        return self._count

    def given(self, path):
        """See `SceneValues.given`."""
        return self._array(_value(self.scene, path.split(".")))

    def lacking(self, column):
        """See `SceneValues.lacking`."""
        return dict.fromkeys(range(len(self)), without(self.scene, column)) if lacks(self.scene, column) else {}

    @property
    def ends(self):
        """See `SceneValues.ends`."""
        cable = self.scene.cable
        return tuple(np.stack([self._array(place) for place in end], axis=-1) for end in (cable.end_1, cable.end_2))

    @property
    def loads(self):
        """See `SceneValues.loads`."""
        return tuple(np.repeat(part, len(self), axis=0) for part in SceneValues([self.scene]).loads)

    def _array(self, value):
        return np.broadcast_to(np.array(np.nan if value is None else value, dtype=float), (len(self),))


def _value(scene, names):
    for name in names:
        scene = getattr(scene, name, None)
    return scene


def load_count(scene):
    """At how many places the cable of a scene carries loads. [-]"""
    return len({load.at for load in scene.cable.loads})
