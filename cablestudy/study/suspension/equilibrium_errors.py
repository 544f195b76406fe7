"""Estimated errors of the equilibria of suspensions: by rounding, and by drag and conductors taken as uniform."""

from functools import cached_property

import numpy as np

from cablestudy.cable.uneven_drag import errors_of_modes
from cablestudy.study.suspension.drag_change import drag_change
from cablestudy.study.tolerances import STUDY


class EquilibriumErrors:
    """Estimated errors of n equilibria, and of what follows from them; relative ones unless a unit is given.

    Parameters
    ----------
    reference, equilibrium : Equilibrium
        In the reference state, from which the unstretched lengths follow, and in the load cases; shape (n,).
    drag : Drag or None
        Steady wind of the load cases.
    conductors : SuspendedConductors or None
    rounding : ndarray, shape (n,), optional
        Errors due to rounding, of equilibria whose positions and attitudes have none; computed by default.
    """

    def __init__(self, reference, equilibrium, drag, conductors, rounding=None):
        self._reference, self._equilibrium, self._drag = reference, equilibrium, drag
        self._conductors, self._rounding = conductors, rounding

    @cached_property
    def drag_change(self):
        """`drag_change` of the steady wind of the load cases."""
        return drag_change(self._equilibrium, self._drag)

    @cached_property
    def modes(self):
        """Errors of all frequencies due to drag and conductors, shape (n,). [-]"""
        change = self.drag_change
        return errors_of_modes(change.error, change.form_error, change.stiffness_error) + self.conductor

    @cached_property
    def statics(self):
        """Errors of tensions, lengths and stiffness by rounding, the search, and conductors, shape (n,). [-]"""
        return np.maximum(self.rounding, self.conductor)

    @cached_property
    def rounding(self):
        """Errors of tensions, positions and attitudes by rounding and the search, shape (n,). [-]"""
        if self._rounding is not None:
            return self._rounding
        errors = [self._reference.record.correction] if None in self._reference.suspension.stated else []
        for state in {id(state): state for state in (self._reference, self._equilibrium)}.values():
            uncertainty = state.uncertainty
            errors.append(uncertainty.tension.max(axis=-1, initial=0.0))
            errors.append(uncertainty.relative.max(axis=(-1, -2), initial=0.0))
        return np.maximum(STUDY.rounding, np.max(errors, axis=0))

    @cached_property
    def rounding_movement(self):
        """Errors of positions [m] and attitudes [rad] of bodies and points by rounding, shape (n, b, 6)."""
        if self._rounding is not None:
            return np.zeros((*self._equilibrium.position.shape[:-1], 6))
        return np.maximum(self._reference.uncertainty.pose, self._equilibrium.uncertainty.pose)

    @cached_property
    def conductor_movement(self):
        """Errors of positions [m] and attitudes [rad] of bodies and points by conductors, shape (n, b, 6)."""
        none = np.zeros((*self._equilibrium.position.shape[:-1], 6))
        return none if self._conductors is None else self._conductors.movements(self._equilibrium)

    @cached_property
    def conductor(self):
        """Errors by conductors that are taken as linear along each cable, shape (n,). [-]"""
        none = np.zeros(len(self._equilibrium.lengths))
        return none if self._conductors is None else self._conductors.uneven_errors(self._equilibrium)
