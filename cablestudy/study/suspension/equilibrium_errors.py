"""Estimated errors of the equilibria of suspensions: by rounding, and by conductors taken as uniform."""

from functools import cached_property

import numpy as np

from cablestudy.study.tolerances import STUDY


class EquilibriumErrors:
    """Estimated errors of n equilibria, and of what follows from them; relative ones unless a unit is given.

    Parameters
    ----------
    reference, equilibrium : Equilibrium
        In the reference state, from which the unstretched lengths follow, and in the load cases; shape (n,).
    conductors : SuspendedConductors or None
    rounding : ndarray, shape (n,), optional
        Errors due to rounding, of equilibria whose positions and attitudes have none; computed by default.
    """

    def __init__(self, reference, equilibrium, conductors, rounding=None):
        self._reference, self._equilibrium = reference, equilibrium
        self._conductors, self._rounding = conductors, rounding

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
