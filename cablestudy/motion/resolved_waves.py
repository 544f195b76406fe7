"""Elements of the cables that resolve the waves which a gain could drive, and which of their modes enter the loop gain.

`driven_waves` bounds the frequencies up to which a gain could drive waves, `driven_cables` makes the loop gain.
"""

from functools import cached_property

import numpy as np

from cablestudy.activity import doing
from cablestudy.control.gain_limits import too_many
from cablestudy.motion.driven_waves import ACROSS
from cablestudy.motion.tolerances import MOTION
from cablestudy.system.cables import Models
from cablestudy.system.mode_search import Search


class ResolvedWaves:
    """Waves along and across the cables of a suspension that a gain could drive, and elements that resolve them.

    Parameters
    ----------
    closed_loop, gain, resolved_to
        As of `DrivenCables`.

    Attributes
    ----------
    resolved_to : float
        Frequency up to which waves across all cables are resolved. [rad/s]
    fixed_elements : bool
        True if the scene states the elements.
    """

    def __init__(self, closed_loop, gain, resolved_to=0.0):
        self.closed_loop, self.gain, self._effects = closed_loop, gain, closed_loop.stability.effects
        self._base, self.fixed_elements = closed_loop.modes, closed_loop.plant.model is not None
        self.resolved_to = max(self._highest_resolved, resolved_to)

    def resolves(self, omega):
        """True if waves across the cables are resolved at a frequency [rad/s]; true of stated elements at any."""
        return self.fixed_elements or omega <= self.resolved_to

    @cached_property
    def all_modes_up_to(self):
        """Frequency up to which all modes are needed for a law that is no integrator; 0 of an integrator. [rad/s]"""
        return 0.0 if self.closed_loop.untuned_loop.law.integrates_only else self._effects.loop_up_to(self.gain)

    @cached_property
    def _highest_driven(self):
        """Frequencies up to which waves across and along each cable are driven or needed, shape (2, c). [rad/s]"""
        highest = np.maximum(self._effects.driven_up_to(self.gain), self.all_modes_up_to)
        if highest.max(initial=0.0) > self._highest_resolved:
            hertz = highest.max() / (2 * np.pi)
            doing(f"modes of the cables that {self._gain_in_words} could drive are sought up to {hertz:.4g} Hz")
        return highest

    @property
    def _highest_resolved(self):
        """Highest frequency that the models of the modes resolve, those beyond the modes of the model too. [rad/s]"""
        return self._base.with_all_modes.omega[-1]

    @property
    def _gain_in_words(self):
        """Gains of the law's parts with the trial gain, in words."""
        return self.closed_loop.untuned_loop.law.described(self.gain, 4)

    @property
    def _highest_resolvable(self):
        """Frequency up to which waves across all cables can be resolved. [rad/s]"""
        return max(
            self._highest_resolved,
            np.pi * MOTION.resolved_waves / self._effects.travel_time[ACROSS].max(initial=1e-300),
        )

    def resolving_models(self):
        """Elements of the cables that resolve all waves which the gain could drive: `Models`.

        Waves across the cables are also resolved up to the frequency `resolved_to`. The elements of the coupled modes
        are taken if they are fine enough and all their modes are computed, or if the scene states them
        (`model.elements`). Else the mesh of each cable follows from the number of half-waves along it,

            n = w tau/pi

        with the highest frequency w that is needed and the travel time tau of a wave from end to end: the larger n of
        transverse and longitudinal waves.

        Raises
        ------
        NoSolutionError
            n exceeds `MOTION.resolved_waves` and the half-waves of transverse waves at `resolved_to`.
        """
        base, highest, travel_time = self._base, self._highest_driven, self._effects.travel_time
        resolved_to = self.resolved_to
        resolved = max(highest.max(initial=0.0), resolved_to) <= self._highest_resolved
        if (resolved and base.models.complete) or self.fixed_elements:
            return base.models if base.models.complete else Models(base.models.cables, base.models.meshes, fixed=True)
        # of transverse (first row) and longitudinal waves at the highest frequency that is needed, shape (2, c)
        half_waves = np.maximum(highest, [[resolved_to], [0.0]]) * travel_time / np.pi
        direction, cable = np.unravel_index(np.argmax(half_waves), half_waves.shape)
        largest = half_waves[direction, cable]
        most = max(MOTION.resolved_waves, resolved_to * travel_time[ACROSS].max() / np.pi)
        if largest > most * (1 + 1e-9):
            raise too_many(self._gain_in_words, int(min(largest, 1e9)), int(most), highest[direction, cable])
        plant, cables = self.closed_loop.plant, base.models.cables
        search = Search(plant.equilibrium, len(base.omega), MOTION.mesh_of_driven * plant.accuracy, cables=cables)
        meshes = cables.meshes(search.orders_of(half_waves.max(axis=0)))
        return Models(cables, meshes, most_modes=MOTION.driven_modes_of_cable)

    def modes_in_loop(self, models, share=1.0):
        """Which modes of each cable are in the loop gain by themselves: list of ndarray of bool, shape (n,).

        All where damping couples none of them, where few could be left out, and for a high accuracy; else those up to
        multiples of the driven and resolved frequencies, or up to a `share` of these multiples.
        """
        plant, in_loop = self.closed_loop.plant, [np.ones(len(part.omega), dtype=bool) for part in models.elements]
        if self.fixed_elements or plant.accuracy <= MOTION.all_modes_from:
            return in_loop
        multiples = [share * multiple for multiple in MOTION.kept_multiples]
        for cable, element in enumerate(models.elements):
            low = self.modes_below(cable, element, *multiples)
            coupled = plant.has_air_damping or element.strain is not None or element.uneven
            if coupled and np.count_nonzero(low) + MOTION.vectors < MOTION.worth * len(low):
                in_loop[cable] = low
        return in_loop

    def modes_below(self, cable, element, driven, resolved):
        """Mask of the modes of a cable that are below a limit of frequency, array of bool, shape (n,).

        The limit is the larger one of `driven` times the highest frequency at which the gain could drive waves across
        the cable, and `resolved` times `resolved_to`. Modes along the cable count also if they are below `driven` times
        the highest frequency at which it could drive waves along the cable.
        """
        across, along = driven * self._highest_driven[:, cable]
        below = element.omega < max(across, resolved * self.resolved_to)
        return below | (self._effects.along(cable, element) & (element.omega < along))
