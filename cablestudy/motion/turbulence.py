"""Variances of the motion in turbulence, with the loop of the winches closed or with the winches at rest.

Variances of displacements, rates and tensions hold for all exposures and mirrors, and with the winches at rest for all
loops. Their errors due to modes are estimated from the change to a model with fewer modes, `Plant.coarse_space`.
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from cablestudy.cable.records import is_computed, take_rows, with_computed
from cablestudy.control.loop_state_space import ExactResponse
from cablestudy.control.margins import largest, sensitivity
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.state_spaces import StateSpaces
from cablestudy.system.together import batches, computed_together
from cablestudy.wind.integrals import Integrals, variances_of_rows
from cablestudy.wind.tolerances import WIND
from cablestudy.wind.variance import smooth_on, with_turns

# weights over frequency [Hz] of the spectra of displacements, for the variances of these and of their rates
VALUE_AND_RATE = {"value": np.ones_like, "rate": lambda frequency: (2 * np.pi * frequency) ** 2}


@dataclass(frozen=True)
class ModelVariances:
    """Variances of o outputs of one model, with w weights over frequency, and their errors by the model.

    Attributes
    ----------
    value : ndarray, shape (w, o)
    by_modes : ndarray, shape (w, o)
        Errors due to modes; NaN where they are not computed.
    by_delay : ndarray, shape (w, o)
        Errors by an approximated delay.
    """

    value: np.ndarray
    by_modes: np.ndarray
    by_delay: np.ndarray

    def of_outputs(self, rows):
        """Those of some of the outputs, a slice."""
        return ModelVariances(self.value[:, rows], self.by_modes[:, rows], self.by_delay[:, rows])


class Turbulence:
    """Variances of one plant in turbulence, with a loop or without.

    Those of outputs and of speeds of winches are computed together, since they have the same poles.

    Parameters
    ----------
    in_wind : PlantInWind
    loop : Loop, optional
        Of the motion of its plant, with a gain.
    """

    def __init__(self, in_wind, loop=None):
        self.in_wind, self.plant, self.loop = in_wind, in_wind.plant, loop

    @property
    def has_delay(self):
        """True if the response is not one of poles alone."""
        return self.loop is not None and self.loop.law.delay > 0

    @computed_together
    def space(turbulences):
        """`StateSpaces` of rows with arrays of equal sizes, and the index of this one; none with a delay.

        Equations and poles are kept in the loops too.
        """
        without_delay = [one for one in turbulences if not one.has_delay]
        for members in batches(without_delay, lambda one: one._signature, lambda one: 2 * len(one.plant.motion)):
            systems = {id(one.system): one.system for one in members}  # many winds may share one
            rows = {identity: row for row, identity in enumerate(systems)}
            motions = {id(one.system): one.plant.motion for one in members}
            loops = list(systems.values()) if members[0].loop else None
            space = StateSpaces.of(list(motions.values()), loops, members[0].plant.actuators)
            if all(is_computed(system, "eigen") for system in systems.values()):
                space.eigen = [system.eigen for system in systems.values()]
            for row, (system, eigen) in enumerate(zip(systems.values(), space.eigen, strict=True)):
                if not is_computed(system, "equations"):
                    with_computed(system, equations=take_rows(space.rows.equations, row))
                with_computed(system, eigen=eigen)
            yield from ((one, (space, rows[id(one.system)])) for one in members)

    @property
    def system(self):
        """`Loop`, or the `LinearSystem` with the winches at rest."""
        return self.loop or self.plant.motion

    @property
    def _signature(self):
        """Sizes of all arrays, by which rows are found that are one `StateSpaces`: tuple."""
        return StateSpaces.signature(self.plant.motion, self.loop), *(one.wheel for one in self.plant.actuators)

    @computed_together
    def all_residues(turbulences):
        """`Residues` from gusts to outputs and, with a loop, speeds of winches; `DelayedResponse` with a delay."""
        return zip(turbulences, _residues_of_rows(turbulences), strict=True)

    @property
    def outputs(self):
        """Rows of `all_residues` and `all_variances` that are outputs: slice."""
        return slice(len(self.plant.outputs) + 2 * len(self.plant.actuators))

    @property
    def speeds(self):
        """Rows of `all_residues` and `all_variances` that are speeds of winches: slice."""
        return slice(self.outputs.stop, None)

    @property
    def residues(self):
        """`all_residues` of the outputs."""
        return self.all_residues.of_outputs(self.outputs)

    def response_to_forces(self, forces, rows):
        """Response of some of all rows to forces on the coordinates, the columns of `forces`, shape (m, j).

        A function of s, shape (f,) -> shape (f, r, j).
        """
        plant = self.plant
        if self.has_delay:
            exact = ExactResponse(plant.motion, forces, self.loop, plant.actuators)
            return lambda s: exact(s)[:, rows]
        space, row = self.space
        return space.take([row]).residues(forces[None])[0].of_outputs(rows).response

    @cached_property
    def range(self):
        """Lowest and highest frequency of the integrals. [Hz]"""
        wind, modes = self.in_wind.airflow.scene.wind, self.plant.modes
        corner, lowest = wind.speed / wind.length_scale, modes.frequency[0]
        slow = [corner, lowest] + ([] if self.loop is None else [self.loop.gain / (2 * np.pi)])
        corners = [[actuator.omega, actuator.corner] for actuator in self.plant.actuators]
        corners = np.concatenate([*corners, [] if self.loop is None else self.loop.corners])
        highest = MOTION.highest_frequency * max(corner, lowest)
        highest = max(highest, MOTION.beyond_corners * corners.max(initial=0.0) / (2 * np.pi))
        beyond = MOTION.beyond_bodies * modes.frequency
        if (beyond > highest).any():  # the shares of bodies take longer than all else here
            highest = beyond[modes.body_share > MOTION.moved_bodies].max(initial=highest)
        return MOTION.lowest_frequency * min(slow), highest

    def _integrals_of(self, weights, jumps=()):
        """`Integrals` over frequency with weights: dict of functions of frequency [Hz] with `jumps` at some [Hz]."""
        gusts, (low, high) = self.in_wind.gusts, self.range
        edges = with_turns(gusts.edges(low, high), self.loop.law.delay if self.loop else 0.0)
        edges = np.union1d(edges, [jump for jump in jumps if low < jump < high])
        if weights is not VALUE_AND_RATE:  # panels resolve any power of frequency
            edges = smooth_on(edges, weights.values())
        return Integrals.on(edges, gusts, weights, self.least)

    @property
    def least(self):
        """Damping ratio up to which a motion counts as not damped. [-]"""
        return WIND.undamped_along_cables if self.in_wind.gusts.strips else WIND.undamped

    @cached_property
    def _integrals(self):
        """`Integrals` of displacements and rates."""
        return self._integrals_of(VALUE_AND_RATE)

    @computed_together
    def coarse(turbulences):
        """`all_residues` with fewer modes."""
        return zip(turbulences, _residues_of_rows(turbulences, coarse=True), strict=True)

    @computed_together
    def all_variances(turbulences):
        """`ModelVariances` of the outputs and, with a loop, the speeds of winches, and of the rates of all."""
        integrals = [turbulence._integrals for turbulence in turbulences]
        return zip(turbulences, _variances_of_rows(turbulences, integrals), strict=True)

    @property
    def variances(self):
        """`all_variances` of the outputs."""
        return self.all_variances.of_outputs(self.outputs)

    def weighted_variances(self, weights):
        """`ModelVariances` of the outputs with weights: dict of functions of frequency [Hz]."""
        return _variances_of_rows([self], [self._integrals_of(weights)])[0].of_outputs(self.outputs)

    def variances_of(self, residues, weights):
        """Variances of the outputs of other `Residues` by the same gusts, shape (w, o), with weights."""
        return self._integrals_of(weights).variances(residues)

    def below(self, limits):
        """Variances of the outputs by frequencies below some limits [Hz], shape (l, o)."""
        weights = {limit: partial(np.greater, limit) for limit in limits}
        return self._integrals_of(weights, limits).variances(self.residues)

    @property
    def estimates(self):
        """True if errors due to modes are computed: all modes of stated elements state no error."""
        return self.plant.model is None or self.plant.responses

    def delay_error(self, integrals):
        """Error of `all_variances` by frequencies where the delay is approximated badly: above `delay_accurate_up_to`.

        Shape (w, o), or 0 of shape (w, 1) without a delay. Of outputs it follows from the winches at rest.
        """
        if self.loop is None or not self.loop.law.delay:
            return np.zeros((len(integrals.weights), 1))
        beyond = 2 * np.pi * integrals.panels.frequency > self.loop.delay_accurate_up_to
        weights = {name: weight * beyond for name, weight in integrals.weights.items()}
        responses = self.in_wind.at_rest.residues, self.all_residues.of_outputs(self.speeds)
        beyond = [replace(integrals, weights=weights).variances(response) for response in responses]
        return MOTION.delayed_error * self.loop.gain_beyond * np.concatenate(beyond, axis=1)

    @property
    def left_out_delay_error(self):
        """Relative error of variances by a slight delay T that is left out, which resonances of the loop amplify. [-]

        The change of (I + L)^-1 by that of L is at most w T |L (I + L)^-1|, largest near a pole of the loop.
        """
        if self.loop is None or not self.loop.slight_delay:
            return 0.0
        omega, loop = np.abs(self.loop.poles), self.loop
        omega = omega[(omega > 0) & (omega < loop.delay_accurate_up_to)]
        loop_gain = loop.gain * loop.gains.loop_gain(1j * omega)
        size = largest(np.eye(loop_gain.shape[-1]) - sensitivity(loop_gain))
        return 2 * loop.law.delay * float((omega * size).max(initial=0.0))

    @property
    def winch_speeds(self):
        """Variances of speed and acceleration of the i winches, and what their errors follow from.

        Returns
        -------
        value, by_modes, by_delay : ndarray, shape (2, i)
            Variances, and their errors due to modes and to an approximated delay.
        undamped : ndarray, shape (i,)
            Pole that nothing damps of each winch, see `Integrals.undamped`.
        """
        variances, residues = self.all_variances.of_outputs(self.speeds), self.all_residues.of_outputs(self.speeds)
        undamped = self._integrals.undamped(residues, variances.value[0], np.ones(variances.value.shape[1]))
        return variances.value, variances.by_modes, variances.by_delay, undamped

    def undamped(self, stiffness):
        """Poles of the displacements that nothing damps, see `Integrals.undamped`."""
        return self._integrals.undamped(self.residues, self.variances.value[0], stiffness)


def _variances_of_rows(turbulences, integrals):
    """`ModelVariances` of `all_residues` of each row, with the weights of its `Integrals`: list."""
    Turbulence.all_residues.compute(turbulences)
    Turbulence.coarse.compute([row for row in turbulences if row.estimates])
    values = variances_of_rows(integrals, [row.all_residues for row in turbulences])
    by_modes = [np.full(value.shape, np.nan) for value in values]
    estimated = [index for index, row in enumerate(turbulences) if row.estimates]
    coarse_residues = [turbulences[index].coarse for index in estimated]
    coarse_values = variances_of_rows([integrals[index] for index in estimated], coarse_residues)
    for index, coarse in zip(estimated, coarse_values, strict=True):
        by_modes[index] = np.abs(values[index] - coarse)
    by_delay = (
        np.broadcast_to(row.delay_error(integral), value.shape) + row.left_out_delay_error * value
        for row, integral, value in zip(turbulences, integrals, values, strict=True)
    )
    return list(map(ModelVariances, values, by_modes, by_delay))


def _residues_of_rows(turbulences, coarse=False):
    """`all_residues` of each `Turbulence` of a list, as sums over poles: list of `Residues`.

    They are D + sum over j of c_j b_j/(s - l_j). l_j are the poles of the plant, with its loop closed if it has one,
    c_j and b_j belong to outputs and inputs. A loop with a delay adds a remainder to this sum (`DelayedResponse`).
    `coarse` leaves out the highest modes, by `Plant.coarse_space`: the change shows the error due to modes.
    """
    Turbulence.space.compute(turbulences)
    found, groups = [None] * len(turbulences), {}  # groups: rows of one state space with arrays of equal sizes
    for index, turbulence in enumerate(turbulences):
        in_wind = turbulence.in_wind
        if turbulence.has_delay:
            found[index] = in_wind.delayed_response(turbulence.loop, coarse)
            continue
        space, _ = turbulence.space
        basis_shape = turbulence.plant.coarse_space.shape if coarse else None
        groups.setdefault((id(space), in_wind.gust_forces.shape, basis_shape, in_wind.direct.shape), []).append(index)
    for indices in groups.values():
        members = [turbulences[index] for index in indices]
        spaces, rows = zip(*(turbulence.space for turbulence in members), strict=True)
        distinct, first, of_member = np.unique(rows, return_index=True, return_inverse=True)
        space = spaces[0].take(distinct.tolist())
        forces = np.array([turbulence.in_wind.gust_forces for turbulence in members])
        direct = np.array([turbulence.in_wind.direct for turbulence in members])
        if coarse:
            basis = np.array([members[index].plant.coarse_space for index in first.tolist()])
            motions = [members[index].plant.coarse_motion for index in first.tolist()]
            space, forces = space.within(basis, motions), np.swapaxes(basis, -1, -2)[of_member] @ forces
        space = space.take(of_member.tolist())
        for index, residues in zip(indices, space.residues(forces, direct), strict=True):
            found[index] = residues
    return found
