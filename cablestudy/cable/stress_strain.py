"""Stress-strain behaviour of power-line conductors of two parts: initial and creep curves, permanent set, and the knee.

Both parts, outer strands and core, are as long as the cable, whose strain is e. A part that would be longer by
a_p = alpha_p (T - T_c) without tension, with the temperature T_c of its curves, has the strain
e_p = (1 + e)/(1 + a_p) - 1 of its own, and carries the tension

    N_p = max(0, min(I_p(e_p), F_p (e_p - z_p))),

with the initial curve I_p and, once it was stretched, the line of the final modulus F_p that rises from its permanent
set z_p. A part that would be pushed is slack: the knee of the conductor is where the outer strands become slack. After
years under the everyday tension a part is on its creep curve C_p instead, which leaves it a set of e_p - C_p(e_p)/F_p.

A curve is a polynomial as far as it is measured, and goes on along its tangent; so it does below zero.

References
----------
Aluminum Association 1974, A method of stress-strain testing of aluminum conductor and ACSR; and: Thrash and others, Sag
and tension of conductor, in Grigsby (ed.), Electric Power Generation, Transmission, and Distribution, chapter 14.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cablestudy.cable.tolerances import CABLE

NO_SET = -np.inf  # of a part that was not yet stretched
TERMS = 5  # coefficients of a curve


@dataclass(frozen=True)
class Curves:
    """Stress-strain curves of conductors, of the parts outer and core; a conductor without a core has zeros for it.

    Attributes
    ----------
    initial, creep : ndarray, shape (..., 2, TERMS)
        Coefficients of tension by strain, the constant first. [N]
    ends : ndarray, shape (..., 2, 2)
        Strains up to which the curves are measured: of each part (rows) the initial one and the one after creep. [-]
    final : ndarray, shape (..., 2)
        EA of each part along the line of the final modulus. [N]
    expansion : ndarray, shape (..., 2)
        [1/K]
    temperature : ndarray, shape (...)
        Temperature for which the curves hold. [K]
    """

    initial: np.ndarray
    creep: np.ndarray
    ends: np.ndarray
    final: np.ndarray
    expansion: np.ndarray
    temperature: np.ndarray

    @cached_property
    def unset(self):
        """Permanent sets of conductors that were not yet stretched, shape (..., 2). [-]"""
        return np.full(self.final.shape, NO_SET)


@dataclass(frozen=True)
class Condition:
    """Conductors at a temperature, with what earlier loads left in them.

    Attributes
    ----------
    curves : Curves
    temperature : ndarray, shape (...)
        [K]
    sets : ndarray, shape (..., 2)
        Permanent set of each part, NO_SET where there is none. [-]
    creeping : ndarray of bool, shape (...)
        Whether the parts are on their creep curves.
    """

    curves: Curves
    temperature: np.ndarray
    sets: np.ndarray
    creeping: np.ndarray

    @cached_property
    def _curve(self):
        """Coefficients of the curves that the parts are on, shape (..., 2, TERMS), and their ends, shape (..., 2)."""
        creeping, (initial, creep) = self.creeping[..., None], np.moveaxis(self.curves.ends, -2, 0)
        chosen = np.where(creeping[..., None], self.curves.creep, self.curves.initial)
        return chosen, np.where(creeping, creep, initial)

    @property
    def _thermal_strain(self):
        """a_p of each part, shape (..., 2). [-]"""
        warmer = self.temperature - self.curves.temperature
        return self.curves.expansion * warmer[..., None]

    def _part_strain(self, strain):
        """e_p of each part, shape (..., 2), for strains e of the conductors. [-]"""
        return (strain[..., None] - self._thermal_strain) / (1.0 + self._thermal_strain)

    def parts(self, strain):
        """Tension N_p of each part [N], and its slope with the strain e [N], each of shape (..., 2)."""
        part_strain, final = self._part_strain(strain), self.curves.final
        tension, slope = curve(*self._curve, part_strain)
        final_line = final * (part_strain - np.where(np.isfinite(self.sets), self.sets, 0.0))
        on_line = np.isfinite(self.sets) & (final_line < tension)
        tension, slope = np.where(on_line, final_line, tension), np.where(on_line, final, slope)
        return np.where(tension > 0, tension, 0.0), np.where(tension > 0, slope / (1.0 + self._thermal_strain), 0.0)

    def tension_and_slope(self, strain):
        """Tension [N] and its slope with the strain [N] of each conductor at a strain, each of shape (...)."""
        return tuple(of_parts[..., 0] + of_parts[..., 1] for of_parts in self.parts(strain))

    def beyond(self, strain):
        """True of each part that is stretched beyond the end of its curve, shape (..., 2)."""
        return (self._part_strain(strain) > self._curve[1]) & (self.parts(strain)[0] > 0)

    def elastic(self, strain):
        """Slope of the tension where it falls, by the final moduli of the parts that are tight, shape (...). [N]"""
        tight = self.parts(strain)[0] > 0
        slopes = np.where(tight, self.curves.final / (1.0 + self._thermal_strain), 0.0)
        return slopes[..., 0] + slopes[..., 1]

    def sets_after(self, strain):
        """Permanent sets z_p, once the conductors were stretched to a strain, shape (..., 2). [-]"""
        part_strain = self._part_strain(strain)
        tension, final = curve(*self._curve, part_strain)[0], self.curves.final
        stretched = (tension > 0) & (final > 0)
        new_sets = part_strain - tension / np.where(stretched, final, 1.0)
        return np.where(stretched, np.maximum(self.sets, new_sets), self.sets)

    def set_slopes(self, strain):
        """Slopes dz_p/de of the permanent sets with the strain that leaves them, 0 without tension; (..., 2). [-]"""
        (tension, slope), final = self.parts(strain), self.curves.final
        stretched = (tension > 0) & (final > 0)
        return np.where(stretched, 1 / (1.0 + self._thermal_strain) - slope / np.where(stretched, final, 1.0), 0.0)

    @cached_property
    def slack_strain(self):
        """Largest strain without tension, shape (...). [-]"""
        part_strain, thermal_strain = np.maximum(_beginning(*self._curve), self.sets), self._thermal_strain
        return (part_strain * (1.0 + thermal_strain) + thermal_strain).min(axis=-1)

    def strain_at(self, tension):
        """Strains at which the conductors have tensions > 0, shape (...). [-]"""
        start = self.slack_strain + tension / self.curves.final.sum(axis=-1)
        return self.settle(lambda strain, value, slope: tension, start)

    def settle(self, tension_at, start, alone=True, accuracy=CABLE.curve_tension):
        """Find the strains of conductors in equilibrium: where stress-strain curve and equilibrium give equal tensions.

        Newton's method; the tension by the curve rises with the strain, that of equilibrium falls or stays.

        Parameters
        ----------
        tension_at : callable
            Strain [-], tension by the curves [N] and its slope with the strain [N], each of shape (...) -> tension in
            equilibrium at that strain [N], NaN where there is none.
        start : ndarray, shape (...)
            Strain of each conductor at which the iteration begins. [-]
        alone : bool
            True if `tension_at` of a conductor depends on its own strain only: each step then narrows a bracket.
        accuracy : float
            Largest relative difference of the two tensions. [-]

        Returns
        -------
        ndarray, shape (...)
            Strains. [-]
        """
        low = self.slack_strain
        strain, high = np.maximum(start, low + CABLE.curve_rounding), np.full(np.shape(low), np.inf)
        done = np.zeros(np.shape(low), dtype=bool)
        for _ in range(CABLE.curve_steps):
            tension_by_curves, slope = self.tension_and_slope(strain)
            tension = tension_at(strain, tension_by_curves, slope)
            gap = tension - tension_by_curves
            done = done | ~(np.abs(gap) > accuracy * tension + CABLE.curve_rounding * np.abs(strain) * slope)
            if done.all():
                break
            if alone:
                low, high = np.where(gap > 0, strain, low), np.where(gap < 0, strain, high)
            strain = np.where(done, strain, next_strain(strain, gap, slope, low, high))
        return strain


def next_strain(strain, gap, slope, low, high):
    """Next strain of Newton's method, or the middle of the bracket where that would be outside; shape (...). [-]

    Parameters
    ----------
    strain : ndarray
        [-]
    gap, slope : ndarray
        Tension that is missing, and slope of the tension that is there. [N]
    low, high : ndarray
        Bracket; `high` may be infinite. [-]
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        trial = strain + gap / slope
        middle = (low + np.where(np.isfinite(high), high, strain)) / 2
    return np.where((trial > low) & (trial < high), trial, middle)


def curve(coefficients, end, strain):
    """Values and slopes of polynomials from zero to their ends, and along their tangents beyond; each of shape (...).

    Parameters
    ----------
    coefficients : ndarray, shape (..., TERMS)
        [N]
    end, strain : ndarray, shape (...)
        [-]
    """
    inside = np.clip(strain, 0.0, end)
    value, slope = np.zeros(strain.shape), np.zeros(strain.shape)
    for term in range(coefficients.shape[-1] - 1, -1, -1):
        slope = slope * inside + value
        value = value * inside + coefficients[..., term]
    return value + slope * (strain - inside), slope


def _beginning(coefficients, end):
    """Strains from which curves are above zero, shape (...); infinite where a curve is zero throughout. [-]"""
    constant, initial_slope = coefficients[..., 0], coefficients[..., 1]
    zero_throughout = ~(curve(coefficients, end, end)[0] > 0)
    low, high = np.zeros(constant.shape), end
    for _ in range(60):
        middle = (low + high) / 2
        above = curve(coefficients, end, middle)[0] > 0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    on_tangent = -constant / np.where(initial_slope > 0, initial_slope, 1.0)  # below the strain zero
    return np.where(zero_throughout, np.inf, np.where(constant >= 0, on_tangent, low))


def linear_cable(strain, tension, slope):
    """EA [N] and unstretched length [-] of the linear cable that is tangent to a conductor at a strain, (...) each.

    It has the tension T, the slope K and the length of the conductor at the strain e. Its unstretched length, over that
    of the conductor, is L_e/L = 1 + e - T/K, and EA = K L_e/L.
    """
    ratio = 1.0 + strain - tension / slope
    return slope * ratio, ratio


def uneven_strain(condition, strain, tensions, weights):
    """Error in mean strain of the linear cable that replaces a conductor, as the tension varies along the conductor.

    The stress-strain curve e(T) of a conductor is not straight. The linear cable follows its tangent, of slope
    K = dT/de, at the mean tension T0. What has to be added to its mean strain is

        sum over points k of w_k (e(T_k) - e(T0) - (T_k - T0)/K)

    Tensions T_k below the fraction `CABLE.curve_rounding` of T0 are raised to it.

    Parameters
    ----------
    condition : Condition
        Stress-strain curves of the conductors in their present condition.
    strain : ndarray, shape (...)
        e(T0), at the mean tension. [-]
    tensions : ndarray, shape (..., k)
        T_k at k points along the cables. [N]
    weights : ndarray, shape (k,)
        w_k, whose sum is 1. [-]

    Returns
    -------
    ndarray, shape (...)
        The error. [-]
    """
    mean_tension, slope = condition.tension_and_slope(strain)
    error = np.zeros(strain.shape)
    for tension, weight in zip(np.moveaxis(tensions, -1, 0), weights.tolist(), strict=True):
        tension = np.maximum(tension, CABLE.curve_rounding * mean_tension)
        along_tangent = (tension - mean_tension) / slope
        error = error + weight * (condition.strain_at(tension) - strain - along_tangent)
    return error
