"""Damping ratios of the modes of bodies: of the poles with all modes of the cables, those of many rows at once."""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from cablestudy.errors import ConvergenceError, NoSolutionError, outcome_of
from cablestudy.motion.model_sizes import MODAL
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.damped_pole import energies, poles_near
from cablestudy.system.damping import damped_poles
from cablestudy.system.tolerances import SYSTEM


def damping_ratios(modes):
    """Compute the damping ratio of one mode of a body in each of many rows, each to the accuracy of its row.

    A pole s has the damping ratio -Re s/|s|. This is 1 if the mode does not oscillate, and set to 0 if no more than
    rounding. The poles are those of models with all modes of the cables. Finer and finer models are tried until the
    estimated error is within the accuracy, or until meshes have as many unknowns as are allowed. If the scene states
    the elements of the cables, only the model with these is used, and the error is unknown. No digit of a row depends
    on the other rows.

    Parameters
    ----------
    modes : list of RefinedMode
        The mode of each row, with its ever finer models and its accuracy.

    Returns
    -------
    list of (DampingRatio or Exception)
        For each row the ratio, or the error that says why there is none. NoSolutionError, ConvergenceError: there is no
        model; cables have modal damping, and their elements are not stated; or the pole is not found.
    """
    models = [mode.damped_models() for mode in modes]
    found, pending = [None] * len(modes), list(range(len(modes)))
    while pending:
        tried = []
        for row in pending:
            attempt = outcome_of(partial(_next_damped, models[row]))
            if isinstance(attempt, Exception):
                found[row] = attempt
            elif attempt is not None:
                tried.append((row, *attempt))
        pending = []
        for members in _solved_together(tried):
            rows, body_modes, airflows = zip(*members, strict=True)
            for row, ratio in zip(rows, _ratios_of_trial(body_modes, airflows), strict=True):
                found[row] = ratio
                if not (isinstance(ratio, Exception) or ratio.finest or ratio.within(modes[row].accuracy)):
                    pending.append(row)
    return found


def _solved_together(tried):
    """Group rows whose poles can be found in the same calls: tuples of row, model tried for it, and air that damps it.

    Rows of a group belong to one `Trial`, which holds the undamped modes of several suspensions, by whose numbers they
    are sorted. They also agree in the laws of damping of their cables, in whether their models have all modes of the
    cables, and in whether the air damps cables and loads them. Rows with the same suspension of a trial, such as load
    cases in equal equilibrium, are in different groups.
    """
    groups, uses = {}, Counter()
    for row, mode, airflow in tried:
        model, cables_in_air = mode.damped[0].model, airflow and (airflow.damps_cables, airflow.turns_with_cables)
        use = id(model.trial), model.row
        key = id(model.trial), uses[use], model.complete, model.laws, cables_in_air
        uses[use] += 1
        groups.setdefault(key, []).append((row, mode, airflow))
    return [sorted(group, key=lambda member: member[1].damped[0].model.row) for group in groups.values()]


def _next_damped(models):
    """The next `BodyMode` of finer models, whose modes for damping are computed, and airflow; None after the last."""
    mode, airflow = next(models, (None, None))
    if mode is None:
        return None
    if mode.modes.model.modal and not mode.exact:
        raise NoSolutionError(MODAL)
    return mode.damped and (mode, airflow)


@dataclass(frozen=True)
class DampingRatio:
    """Damping ratio of the pole of a mode.

    Attributes
    ----------
    value, error : float
        The ratio, and its relative error, which is NaN where it is not known. [-]
    finest : bool
        True if no model has a finer mesh.
    """

    value: float
    error: float
    finest: bool

    def within(self, accuracy):
        """True if the error is not above an accuracy, or not known."""
        return bool(np.isnan(self.error)) or self.error <= accuracy


def _ratios_of_trial(modes, airflows):
    """Damping ratios of the modes of bodies in n suspensions of one `Trial`, with estimates of their errors.

    The relative error is `SYSTEM.coarser_mesh_safety` times the relative change of the ratio by coarser meshes of the
    cables. It is NaN where the ratio is 1 (no oscillation) and for stated elements, which all of the scenes of
    `modes` have or none; for a ratio of 0 it is `MOTION.rounding`. Where no pole is found, on either mesh, the
    ConvergenceError is in place of the `DampingRatio`.
    """
    search, exact = _PoleSearch(modes, airflows), modes[0].exact
    models = search.trial.coordinates.models
    all_modes = exact or modes[0].damped[0].model.complete
    fine = models if all_modes else models.with_all_displacements()
    poles, near = search.poles(fine)
    differs = np.array([mesh != other for mesh, other in zip(models.meshes, fine.meshes, strict=True)], dtype=bool)
    ratio, finest = _ratios(poles), search.any_cable(differs)
    estimated = (ratio != 0) & (ratio < 1) & (not exact)
    coarse_poles = near = np.where(estimated, poles, near)
    if estimated.any():
        coarse = models.with_all_displacements(coarser=SYSTEM.finer_orders)
        coarse_poles = search.poles_near(coarse, np.where(estimated, poles, np.nan), SYSTEM.known_pole_distance)
    change = np.abs((_ratios(coarse_poles) - ratio) / np.where(estimated, ratio, 1.0))
    error = np.where(estimated, np.maximum(SYSTEM.coarser_mesh_safety * change, MOTION.rounding), np.nan)
    error = np.where((ratio == 0) & (not exact), MOTION.rounding, error)
    lost, outcomes = np.isnan(poles) | (estimated & np.isnan(coarse_poles)), []
    for row in range(len(modes)):
        if lost[row]:
            frequency = abs(near[row]) / (2 * np.pi)
            text = f"no damped mode is found for certain near {frequency:.4g} Hz: the damping there is too strong"
            outcomes.append(ConvergenceError(text))
        else:
            outcomes.append(DampingRatio(float(ratio[row]), float(error[row]), bool(finest[row])))
    return outcomes


def _ratios(poles):
    """Damping ratios of poles, shape (n,). [-]"""
    ratio = -poles.real / np.abs(poles)
    return np.where(np.abs(ratio) <= MOTION.undamped_rounding, 0.0, ratio)


class _PoleSearch:
    """Search for the damped poles of one mode of a body in each of n suspensions, called rows, of one `Trial`.

    Parameters
    ----------
    modes : list of BodyMode
        n modes. Their undamped shapes are of different suspensions of the trial, in ascending order.
    airflows : list of (Airflow or None)
        Air whose damping is added in each row.
    """

    def __init__(self, modes, airflows):
        found = [mode.damped for mode in modes]  # modes of each row, and the number of the one that is meant
        self._modes, self._numbers = [modes_of_row for modes_of_row, _ in found], [number for _, number in found]
        self._airflows, self.trial = airflows, self._modes[0].model.trial
        self._rows = np.array([modes_of_row.model.row for modes_of_row in self._modes])
        layout = self.trial.layout
        self._layout = layout if len(self._rows) == self.trial.rows else layout.take(self._rows)
        self._cable_count = self.trial.coordinates.models.cables.count // self.trial.rows
        self._cables = (self._cable_count * self._rows[:, None] + np.arange(self._cable_count)).ravel()
        self._omega = np.array([modes_of_row.omega[number] for modes_of_row, number in found])
        self._shapes = [modes_of_row.shapes[:, number] for modes_of_row, number in found]
        self._displacements = np.stack([shape[len(shape) - len(layout.free) :] for shape in self._shapes])
        self._condensed = {}

    def any_cable(self, values):
        """True for rows of which any cable is True in an array of all cables of the trial."""
        return values[self._cables].reshape(len(self._rows), -1).any(axis=1)

    def poles(self, models):
        """Find the pole s of the damped mode of each of n rows with all modes of the cables.

        The search begins at an estimate. This is the pole of the undamped shape alone, the root of

            s^2 + c s + w^2 + i h = 0

        with its frequency w, and its mass-normalised viscous and hysteretic damping c and h, to which loads that turn
        add -i times their stiffness. Where no pole is found so near to it that it is surely that of the mode, the
        estimate is the pole of the model of the coupled modes.

        Returns
        -------
        poles, near : ndarray, complex, shape (n,)
            Poles, and the estimates at which the search began. A pole is -w where the mode does not oscillate, and NaN
            where it is not found. [rad/s]
        """
        viscous, hysteretic = self._damping_of_shapes()
        near = 1j * np.sqrt(self._omega**2 + 1j * hysteretic - viscous**2 / 4) - viscous / 2
        ratio = -near.real / np.abs(near)
        light, strong = MOTION.pole_distance * ratio, MOTION.strongly_damped_pole_distance
        far = np.where(ratio < MOTION.light_damping, light, strong)
        poles = self.poles_near(models, np.where(ratio != 0, near, np.nan), far)
        poles = np.where(ratio == 0, 1j * self._omega, poles)
        others = np.full(len(poles), complex(np.nan, np.nan))
        for row in np.flatnonzero(np.isnan(poles)).tolist():  # another mode may be near
            near[row] = others[row] = self._pole_of_coupled_modes(row)
            if np.isnan(others[row]):
                poles[row] = -self._omega[row]
        if not np.isnan(others).all():
            poles = np.where(np.isnan(others), poles, self.poles_near(models, others, SYSTEM.known_pole_distance))
        return poles, near

    def poles_near(self, models, near, far):
        """Poles within relative distances `far` of others, `near`, shape (n,): `damped_pole.poles_near`. [rad/s]"""
        far, (damping, loads) = np.broadcast_to(far, near.shape), self._air_on_bodies
        return poles_near(self._layout, self._cables_in_air(models), near, self._displacements, damping, far, loads)

    def _cables_in_air(self, models):
        """`CondensedCables` of all rows, with the aerodynamic damping and load stiffness of each cable: list."""
        if models not in self._condensed:
            condensed, count, damping, stiffness = models.condensed(self._cables), self._cable_count, {}, {}
            for row, airflow in enumerate(self._airflows):
                if airflow is not None and (airflow.damps_cables or airflow.turns_with_cables):
                    cables, modes = slice(count * row, count * (row + 1)), self._modes[row]
                    about = models.take(self._cables[cables], modes.models.cables), None, modes.layout.equilibrium
                    damping |= {count * row + cable: matrix for cable, matrix in airflow.damping_of_cables(*about)}
                    stiffness |= {count * row + cable: matrix for cable, matrix in airflow.stiffness_of_cables(*about)}
            damped = [cables.with_matrices("added_damping", damping) for cables in condensed]
            self._condensed[models] = [cables.with_matrices("loads", stiffness) for cables in damped]
        return self._condensed[models]

    @cached_property
    def _air_on_bodies(self):
        """Damping and load stiffness of the free displacements, see `poles_near`, by links, drag and dead moments."""
        layout, by_drag = self._layout, (0.0, 0.0)
        if any(airflow is not None and airflow.damps for airflow in self._airflows):
            free = np.eye(len(layout.free))
            by_drag = np.zeros((2, len(self._rows), *free.shape))
            for row, airflow in enumerate(self._airflows):
                if airflow is not None:
                    of_row = self._modes[row].layout
                    by_drag[0, row] = airflow.damping_of_bodies(of_row, free)
                    by_drag[1, row] = airflow.stiffness_of_bodies(of_row, free)
            by_drag = by_drag[:, 0] if layout.large else by_drag
        return by_drag[0] + layout.damping, by_drag[1] + layout.moment_stiffness

    def _damping_of_shapes(self):
        """c and h of `poles` for the undamped shapes, both of shape (n,). [1/s], [1/s^2]"""
        models, amplitudes = self.trial.coordinates.models, self.trial.amplitudes(self._rows, self._shapes)
        by_group = zip(amplitudes, (group.find(self._cables) for group in models.groups), strict=True)
        amplitudes = [of_group[rows] for of_group, (rows, positions) in by_group if len(positions)]
        ends = self._layout.ends(self._displacements.reshape(*self._layout.shape, -1, 1)).reshape(-1, 6, 1)
        condensed, motions = self._cables_in_air(models), []
        for index, cables in enumerate(condensed):
            modes = amplitudes[index] if index < len(amplitudes) else np.zeros((len(cables.cables), 0, 1))
            motions.append(np.concatenate([modes, ends[cables.cables]], axis=1).astype(complex))
        motions = list(zip(condensed, motions, strict=True))
        _, viscous, hysteretic = energies(self._layout, motions, self._displacements, *self._air_on_bodies)
        return viscous.real, hysteretic

    def _pole_of_coupled_modes(self, row):
        """Pole of the model of the coupled modes of a row; NaN where the mode does not oscillate. [rad/s]"""
        modes, airflow, lowest = self._modes[row], self._airflows[row], slice(self._numbers[row] + 1)
        system, loads = (modes.system, None) if airflow is None else airflow.damped_system(modes)
        return damped_poles(system, modes.omega[lowest], modes.shapes[:, lowest], loads)[0][-1]
