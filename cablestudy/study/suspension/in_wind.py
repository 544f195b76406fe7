"""A suspension in the wind and under control: with as many modes as its numbers need."""

from functools import cached_property

import numpy as np

from cablestudy.control.pose_margins import largest_gain
from cablestudy.study.suspension.movement import Movement
from cablestudy.study.suspension.response import FEWER, Response

COUNTS = (40, 64, 100, 160)  # modes of the models that are tried
ACCURACY = 1e-4  # where the scene has a fixed model


class InWind:
    """One case.

    Parameters
    ----------
    scene : SuspensionScene
    calm : Equilibrium
        Without wind.
    equilibrium : Equilibrium
        In the mean wind.
    drag : Drag or None
    model : FixedModel or None
    """

    def __init__(self, scene, calm, equilibrium, drag, model):
        self.scene, self._calm, self._equilibrium, self._drag, self._model = scene, calm, equilibrium, drag, model
        self._accuracy = scene.model.accuracy or ACCURACY

    def _movement(self, count):
        return Movement(self.scene, self._equilibrium, self._drag, count, self._accuracy, self._model)

    @cached_property
    def _found(self):
        """Movement, response to the wind, and estimated error of the largest gain.

        Raises
        ------
        NoSolutionError
            What moves is unstable.
        ConvergenceError
        """
        for count in COUNTS:
            movement = self._movement(count)
            movement.check_stable()
            response = Response(movement) if self._drag is not None else None
            error = self._gain_error(movement)
            if response is not None:
                found = response.closed
                moving = found.largest > 0
                error = np.append((found.error[moving] / found.largest[moving]) / 2, error)
            if np.nan_to_num(error).max(initial=0.0) <= self._accuracy or len(movement.modes) < count:
                break
        return movement, response

    @property
    def movement(self):
        """`Movement`; raises as `response`."""
        return self._found[0]

    @property
    def response(self):
        """`Response` to the wind.

        Raises
        ------
        NoSolutionError, ConvergenceError
            What moves is unstable, or the variances cannot be had.
        """
        return self._found[1]

    @staticmethod
    def _gain_error(movement):
        """Relative change of the largest gain by the highest coordinates; not a number where there is no limit. [-]"""
        loop = movement.loop
        if loop is None or movement.largest_gain is None:
            return np.nan
        fewer = largest_gain(loop.some(int(FEWER * movement.motion.shapes.shape[1])), movement.largest_gain)
        return np.nan if fewer is None else abs(fewer / movement.largest_gain - 1)

    @cached_property
    def loop_error(self):
        """Estimated relative error of the numbers of the loop. [-]"""
        return self._gain_error(self.movement)

    def rms(self, names, variance, open_loop):
        """Root of the sum of variances of some outputs, and its estimated relative error; 0 of what is held."""
        found = self.response.open if open_loop else self.response.closed
        rows = [self.response.rows[name] for name in names if name in self.response.rows]
        total, value = getattr(found, variance)[rows].sum(), found.value[rows].sum()
        return np.sqrt(total), found.error[rows].sum() / (2 * value) if value > 0 else 0.0

    def mean_displacement(self, name):
        """Of a body, or of a marker BODY.MARKER, by the mean wind, the winches at rest, shape (3,). [m]"""
        owner, _, marker = name.partition(".")
        if not self.scene.wind.mean:
            return np.zeros(3)
        body = self._calm.suspension.body_names.index(owner)
        place = np.array(self.scene.bodies[owner].markers[marker] if marker else (0.0, 0.0, 0.0))
        before, after = self._calm, self._equilibrium
        turned = (after.rotation[body] - before.rotation[body]) @ place
        return after.position[body] - before.position[body] + turned

    def mean_tensions(self, name):
        """Tension at both ends of a cable in the mean wind, shape (2,). [N]"""
        cable = self._equilibrium.suspension.cable_names.index(name)
        return np.linalg.norm(self._equilibrium.end_forces[cable], axis=-1)
