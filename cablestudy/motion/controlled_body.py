"""The body that a loop controls: what the loop measures of it, its notches, and how the winches move it."""

from functools import cached_property

import numpy as np

from cablestudy.control.loop import allocate, moved_by_winches
from cablestudy.control.notch import Notch
from cablestudy.errors import NoSolutionError
from cablestudy.scene.determinacy import MOTIONS
from cablestudy.statics.suspension import AXES


class ControlledBody:
    """The body that a control loop holds in place: what the loop measures of it, its notches, and how winches move it.

    Parameters
    ----------
    scene : SuspensionScene
        With control; `notch_frequencies_known` needs none.
    plant : Plant
        The suspension without its loop.

    Attributes
    ----------
    index : int
        Its number among all bodies and junctions.
    """

    def __init__(self, scene, plant):
        self._control, self._winches, self._plant = scene.control, scene.winches, plant
        self._suspension = plant.equilibrium.suspension
        name = scene.control and scene.control.body
        self.index = list(scene.bodies).index(name) if name else 0

    @property
    def _motion(self):
        """`LinearSystem` of the suspension with its winches at rest."""
        return self._plant.motion

    @property
    def name(self):
        """Name of the body."""
        return self._suspension.body_names[self.index]

    @property
    def free(self):
        """Names of its free motions, such as x and yaw: list of str."""
        is_free = self._suspension.free[self.index]
        return [name for name, free in zip(MOTIONS, is_free, strict=True) if free]

    @cached_property
    def _measurable(self):
        """Coordinates of the body that the loop measures: stated ones, else the free ones that a winch moves.

        Returns
        -------
        names : list of str
            Names of k displacements and rotations, such as x and yaw.
        rows : ndarray, shape (k, m)
            Each measured coordinate per unit of each of the m coordinates of the equations of motion. [m], [rad]
        lengths : ndarray, shape (k,)
            Length by which a rotation is multiplied to compare it with a displacement: the RMS distance of the ends of
            cables and links from the reference point of the body, or 1 m where this is zero [m]; 1 for displacements
            [-].
        gain : ndarray, shape (k, i)
            Static gain: change of each coordinate per length that each of i winches reels in. [-], [rad/m]

        Raises
        ------
        NoSolutionError
            No winch moves one of the stated coordinates; or, where none is stated, any free one.
        """
        control = self._control
        names = list(control.measured or self.free)
        of_body = self._displacements(self._motion.shapes)
        rows = np.zeros((6, len(self._motion)))
        rows[:, : of_body.shape[1]] = of_body  # strokes of actuators, the last ones, do not move the body
        motions = [MOTIONS.index(name) for name in names]
        rows, lengths = rows[motions], np.array([1.0 if motion < 3 else self._radius for motion in motions])
        is_moved, gain = moved_by_winches(self._motion, rows, lengths)
        if not is_moved.all():
            idle = [name for name, moved in zip(names, is_moved, strict=True) if not moved]
            if control.measured or not is_moved.any():
                raise NoSolutionError(f"control.measured: no winch moves {', '.join(idle)} of {self.name}")
        names = [name for name, moved in zip(names, is_moved, strict=True) if moved]
        return names, rows[is_moved], lengths[is_moved], gain[is_moved]

    @property
    def _radius(self):
        """RMS distance of the ends of cables and links from the reference point; 1 m where this is zero. [m]"""
        connection, end = np.nonzero(self._suspension.owner == self.index)
        arms = self._plant.equilibrium.arms[connection, end]
        radius = float(np.sqrt((arms**2).sum(axis=-1).mean())) if len(arms) else 1.0
        return radius if radius > 0 else 1.0

    def _displacements(self, shapes):
        """Displacements and rotations of the body in r shapes of the suspension, shape (6, r)."""
        layout = self._plant.layout
        return layout.displaced(layout.bodies(shapes))[self.index]

    @property
    def measured(self):
        """Names of the k measured coordinates, such as x and yaw: list of str."""
        return self._measurable[0]

    @property
    def measured_outputs(self):
        """Names of the measured coordinates among the `outputs`, such as gondola.x: list of str."""
        return [f"{self.name}.{AXES[MOTIONS.index(name)]}" for name in self.measured]

    @cached_property
    def notches(self):
        """Notch of each measured coordinate: tuple of (Notch or None), k of them."""
        table = self._control.notch
        if table is None:
            return (None,) * len(self.measured)
        if table.frequency == "coupled":
            frequencies = self.coupled_frequencies
        elif table.frequency == "static":
            frequencies = self._static_frequencies()
        else:
            frequencies = [table.frequency] * len(self.measured)
        rolloff = 2 * np.pi * table.rolloff_frequency, table.rolloff_damping_ratio
        return tuple(Notch(2 * np.pi * frequency, table.damping_ratio, *rolloff) for frequency in frequencies)

    @cached_property
    def _compliance_shares(self):
        """Share of each mode of the model in the static compliance of each measured coordinate, shape (k, m). [-]"""
        kept, modes = self._plant.kept, self._plant.modes
        amplitudes = self._measurable[1][:, : len(kept)] / modes.omega[kept]
        return amplitudes**2 / self._compliance[:, None]

    @cached_property
    def _compliance(self):
        """Static compliance of each measured coordinate, shape (k,). [m/N], [rad/(N m)]"""
        rows = self._measurable[1]
        return (rows * np.linalg.solve(self._motion.static_stiffness, rows.T).T).sum(axis=1)

    @property
    def notch_frequencies_known(self):
        """True unless a notch is `coupled` and a mode that the model lacks may be the one that it shall remove.

        It removes the mode with the largest share in the compliance: none is larger if all that is missing is not.
        """
        table = self._control and self._control.notch
        if not table or table.frequency != "coupled":
            return True
        largest, missing = self._shares_together.max(axis=1), 1 - self._compliance_shares.sum(axis=1)
        return bool((largest > missing).all())

    @property
    def _shares_together(self):
        """`_compliance_shares` with those of modes that coincide added up."""
        return self._plant.modes.over_coincident(self._compliance_shares, self._plant.kept)

    @property
    def coupled_frequencies(self):
        """Frequency of the mode with the largest share in the static compliance of each measured coordinate. [Hz]"""
        shares = self._shares_together / self._shares_together.max(axis=1, keepdims=True)
        decisive = np.argmax(np.round(shares, 9), axis=1)  # of equal ones the lowest mode, whatever rounding does
        return self._plant.modes.frequency[self._plant.kept[decisive]]

    def _static_frequencies(self):
        """Frequency of the body alone, on its static compliance, in each measured coordinate, shape (k,). [Hz]"""
        inertia = np.diagonal(self._plant.layout.mass[self.index])[[MOTIONS.index(name) for name in self.measured]]
        return 1 / np.sqrt(self._compliance * inertia) / (2 * np.pi)

    @cached_property
    def allocation(self):
        """`Allocation` of errors of the measured coordinates to the winches."""
        control = self._control
        stated = control.allocation.weights if control.allocation else {}
        weights = np.array([stated.get(name, 1.0) for name in self._winches])
        return allocate(*self._measurable[1:], weights)
