"""Results of many cases in closed form, as arrays with an axis of cases."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from cablestudy.cable.catenary import solve
from cablestudy.cable.catenary_in_drag import errors_by_parts, form_of_one, in_drag
from cablestudy.cable.geometry import reach_beyond_ends
from cablestudy.cable.meshes import edges_of_pieces
from cablestudy.cable.moved_in_drag import changes_of_tension
from cablestudy.cable.newton import UNDETERMINED
from cablestudy.cable.span import CORES
from cablestudy.cable.taut import lambda_squared
from cablestudy.cable.tolerances import CABLE
from cablestudy.cable.vectors import row_keys
from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.column import LIMP, of_part
from cablestudy.study.conductors import uneven_errors
from cablestudy.study.load_cases import holding_force, wind_direction
from cablestudy.study.one_cable.conductors import equivalent_cables
from cablestudy.study.one_cable.loaded_cables import loaded_cables
from cablestudy.study.statics import ClosedStatics, tensions_by_end_2
from cablestudy.study.tolerances import STUDY

NO_FORM = "no equilibrium in the steady wind: the drag on the cable and its form do not agree"
ALONG_X = np.eye(2, 3, -1)  # movement of end 2, and none of end 1
NO_MOTION = "the cable hangs folded: somewhere it has no tension, and no stiffness about it"


class Results:
    """Closed-form results of a batch of n cases, each computed when it is first needed.

    A single case is a batch of one. Numbers of a case in `failures` mean nothing.

    Parameters
    ----------
    values : StatedNumbers or CaseTable
        Values of the n scenes; all load cases have a steady wind, or none has.
    drag_parts : int
        Equal parts of each smooth piece of a cable, on which the drag of a steady wind varies as a polynomial.
    """

    def __init__(self, values, drag_parts=STUDY.drag_parts):
        self.values, self._drag_parts, self._along = values, drag_parts, {}

    def number(self, path):
        """A number that each scene states, shape (n,); see `StatedNumbers.number`."""
        return self.values.number(path)

    @cached_property
    def loaded(self):
        """`LoadedCables`: the n cables in their load cases."""
        loaded = loaded_cables(self.values, self.equivalent_cables)
        if loaded.at is None or not self.in_steady_wind:
            return loaded
        # the forces on end 2 against the drag that varies along the cable, by Newton's method
        push = self.values.push
        shift, step = np.where(push == 0, 0.0, loaded.shift), 0.0
        target = holding_force(self._in_drag(*loaded.at(0 * shift)))[0] + push
        for _ in range(STUDY.pushed_drag_steps):
            force, stiffness, *_ = holding_force(self._in_drag(*loaded.at(shift)))
            step = np.divide(target - force, stiffness, out=np.zeros_like(force), where=(stiffness > 0) & (push != 0))
            shift = shift + step
        error = loaded.shift_error + np.divide(np.abs(step), np.abs(shift), out=np.zeros_like(shift), where=shift != 0)
        span, drag = loaded.at(shift)
        return replace(loaded, span=span, drag=drag, shift=shift, shift_error=error)

    @cached_property
    def in_steady_wind(self):
        """True if the load cases have a steady wind."""
        return bool(np.isfinite(self.number("load_case.wind.dynamic_pressure")).any())

    def _in_drag(self, span, drag):
        """Equilibrium of cables in drag that varies along each: `CatenaryInDrag`."""
        return in_drag(drag, solve(span), self._drag_parts)

    @cached_property
    def coarser(self):
        """These results with drag that varies on half as many parts; they have none, nor have those without wind."""
        if not self.in_steady_wind or self._drag_parts < STUDY.drag_parts:
            return None
        coarser = Results(self.values, self._drag_parts // 2)
        coarser.equivalent_cables, coarser.failures = self.equivalent_cables, self.failures
        if self.loaded.at is None:
            coarser.loaded, coarser.catenary, coarser.form = self.loaded, self.catenary, self.form.coarser
        return coarser

    @cached_property
    def equivalent_cables(self):
        """`EquivalentCables` of conductors with permanent elongation; None where there is none."""
        return equivalent_cables(self.values)

    @cached_property
    def state(self):
        """State of each conductor, see `LinearCables.labels`; empty of linear cables: ndarray, shape (n,)."""
        cables = self.equivalent_cables
        return np.full(len(self.values), "") if cables is None else cables.linear.labels

    @property
    def span(self):
        """The cables under the loads of their cases, fields of shape (n,), their unstretched lengths found."""
        return self.loaded.span

    @property
    def reference_length(self):
        """Unstretched lengths in the reference state, shape (n,). [m]"""
        return self.loaded.reference_length

    @cached_property
    def catenary(self):
        """The equilibria of the elastic catenary, in a steady wind with drag that is uniform along each cable."""
        return solve(self.span)

    @cached_property
    def form(self):
        """The cables where they hang: `Catenary`, in a steady wind `CatenaryInDrag`; `cable.geometry` takes both."""
        return in_drag(self.drag, self.catenary, self._drag_parts) if self.in_steady_wind else self.catenary

    @cached_property
    def failures(self):
        """Case -> NoSolutionError or ConvergenceError of a case without an equilibrium."""
        reasons, record = self.loaded.reasons, self.catenary.record
        failures = {}
        for case in np.flatnonzero(~record.converged & ~self.limp).tolist():
            steps = int(record.steps[case])
            failures[case] = ConvergenceError(f"catenary: no convergence in {steps} steps", record)
        if self.in_steady_wind:
            for case in np.flatnonzero(~self.form.found & ~self.limp).tolist():
                failures.setdefault(case, ConvergenceError(NO_FORM))
        return failures | {case: NoSolutionError(reason) for case, reason in reasons.items()}

    @property
    def limp(self):
        """True of cables longer than their chord without any load: no tension, and no definite form, shape (n,)."""
        return self.catenary.record.reason == UNDETERMINED

    def form_of(self, span, index):
        """One cable by its `Span` with other loads than its own, in its steady wind: `form` of this one."""
        return form_of_one(span, self.drag.take([index]) if self.in_steady_wind else None, self._drag_parts)

    @property
    def middle(self):
        """Arc length at mid-span over unstretched length, shape (n,). [-]"""
        return self.form.middle

    @cached_property
    def reach_beyond_ends(self):
        """Distances by which loads or wind push cables beyond their ends, `geometry.reach_beyond_ends`, (n,). [m]"""
        pushed = (self.span.vertical[..., 2] != 1) | (self.span.load_positions.shape[-1] > 0)
        return np.where(pushed, reach_beyond_ends(self.form), 0.0) if pushed.any() else np.zeros(pushed.shape)

    @property
    def end_1(self):
        """Positions of end 1, shape (n, 3). [m]"""
        return self.values.ends[0] + self.values.moves[:, 0]

    @cached_property
    def chord(self):
        """Distances of the ends, shape (n,), exactly as stated where nothing moves them. [m]"""
        stated = self.number("cable.chord_length")
        if not (self.values.moves.any() or self.values.push.any()):
            return stated
        chord = np.array(self.span.chord)
        chord[list(self.failures)] = np.nan
        return chord

    @property
    def force_displacement(self):
        """Displacement of end 2 along x by the forces of the load cases, shape (n,) [m], and its relative error."""
        return self.loaded.shift, self.loaded.shift_error

    def check(self, case):
        """Raise the NoSolutionError or ConvergenceError of a case that has no equilibrium."""
        if case in self.failures:
            raise self.failures[case]

    @cached_property
    def statics(self):
        """Tensions, sag and stretched length: `ClosedStatics`."""
        return ClosedStatics(self.form)

    def end_stiffness_along(self, axis, moved=None):
        """Static stiffness of end 2, end 1 fixed, shape (n,); see `CableCase.end_stiffness_along`. [N/m]"""
        key = axis, axis if moved is None else moved
        if key not in self._along:
            self._along[key] = self.span.stiffness_along(self.form.end_stiffness, *key)
        return self._along[key]

    @cached_property
    def tension_change(self):
        """Change of the tension vector per slow displacement of end 2 along x, to which the drag follows, end 1 fixed.

        Function of positions, shape (..., e), shares of the unstretched length: shape (n, e, 3), along x, y, z. [N/m]
        """
        if self.in_steady_wind:
            return changes_of_tension(self.form, self.drag, ALONG_X)
        stiffness = np.stack([self.end_stiffness_along(axis, 0) for axis in range(3)], axis=-1)[:, None]
        return lambda positions: np.broadcast_to(stiffness, (len(stiffness), np.shape(positions)[-1], 3))

    @property
    def slow_stiffness(self):
        """Force on end 2 along x per slow displacement along x, as of `tension_change`, shape (n,). [N/m]"""
        return self.tension_change(np.ones(1))[:, 0, 0] if self.in_steady_wind else self.end_stiffness_along(0)

    @cached_property
    def tensions_by_end_2(self):
        """Tensions at both ends of each piece [N], and sizes of their changes with end 2 [N/m], (n, k, 2) each."""
        return tensions_by_end_2(self.form, self.tension_change(self.form.edges))

    @property
    def end_stiffness_chord(self):
        """Static stiffness of end 2 along the chord, end 1 fixed, shape (n,). [N/m]"""
        return self.form.end_stiffness[..., 0, 0]

    # ---------------------------------------------------------------------------------------- what motion depends on

    @cached_property
    def first_equal(self):
        """Index of the first case with an equal cable on equal elements, shape (n,): both move alike.

        Compared are the numbers of the loaded cables, to the last digit, with those by which a turbulent wind acts on
        them. A case without an equilibrium, and one in a wind that grows with the height, equals none.
        """
        count, profile = len(self.values), self.drag.profile
        alone = np.zeros(count, dtype=bool) if profile is None else profile.exponent > 0
        alone[list(self.failures)] = True
        mass = np.unique(self.values.words("model.mass"), return_inverse=True)[1]
        keys = "model.elements", "model.order", "model.accuracy", "gravity", "cable.section_diameter", "wind_diameter"
        number_alone = np.where(alone, np.arange(1, count + 1), 0)
        of_span = [array for name in CORES if (array := getattr(self.span, name)) is not None]
        of_cable = self.end_1, self.drag.normal_drag, self.drag.direction, *of_span
        first = {}  # key of a case -> its index
        cases = row_keys([number_alone, mass, *map(self.number, keys), *of_cable])
        return np.array([first.setdefault(key, index) for index, key in enumerate(cases)])

    @cached_property
    def planar(self):
        """True where no load leaves the cable's plane: in-plane and out-of-plane motion decouple, shape (n,)."""
        return ~self.span.load_forces[..., 2].any(axis=-1) & ~self._uneven

    @cached_property
    def across_x(self):
        """True where a movement along x leaves the cable's plane, shape (n,)."""
        return self.span.frame[:, 2, 0] != 0

    @cached_property
    def mirror_symmetric(self):
        """True where a cable is its own mirror image at mid-length, shape (n,)."""
        return self.span.mirror_symmetric & ~self._uneven

    @property
    def _uneven(self):
        """True where the drag of a steady wind changes along a cable, shape (n,)."""
        return self.drag.normal_drag > 0

    @cached_property
    def drag(self):
        """`SteadyDrag` on the cables, shape (n,)."""
        return self.loaded.drag

    @cached_property
    def force_on_gondola(self):
        """Force of the mean wind on a gondola along x, rho/2 C_d A v^2, or of the load case's steady wind, (n,). [N]

        Zero where `wind.mean` leaves it out, and no steady wind acts.
        """
        wind, gondola = (lambda key: self.number(f"wind.{key}")), (lambda key: self.number(f"gondola.{key}"))
        steady = self.number("load_case.wind.dynamic_pressure")
        by_wind = np.where(wind("mean"), wind("air_density") / 2 * wind("speed") ** 2, 0.0)
        along_x = wind_direction(self.number("load_case.wind.direction"))[..., 0]
        pressure = np.where(np.isnan(steady), by_wind, steady * along_x * self.pressure_at_end_2)
        return pressure * gondola("drag_coefficient") * gondola("area")

    @cached_property
    def pressure_at_end_2(self):
        """Dynamic pressure of the steady wind at end 2 over the stated one, shape (n,). [-]"""
        profile, span = self.drag.profile, self.span
        end_2 = self.end_1 + span.chord[:, None] * span.frame[:, 0]
        return np.ones(len(end_2)) if profile is None else profile.pressure(end_2[:, None])[:, 0]

    @cached_property
    def length_rounding(self):
        """Relative error of the tensions by the rounding of the unstretched length, shape (n,). [-]

        Loads may hold a slack cable in straight pieces, which give way by stretching only.
        """
        span = self.span
        if not span.load_positions.shape[-1]:
            return np.zeros(len(span.chord))
        stiffness = self.catenary.end_stiffness[..., 0, 0] * span.unstretched_length
        return STUDY.epsilon * np.abs(span.chord_strain) * stiffness / np.maximum(self.statics.mean_tension, STUDY.tiny)

    @cached_property
    def statics_rounding(self):
        """Relative error of the statics due to rounding, shape (n,). [-]

        The least tension has the rounding of the largest, from which it is what remains.
        """
        least = self.statics.min_tension
        balanced = STUDY.epsilon * self.statics.max_tension / np.where(least > 0, least, np.inf)
        return np.maximum(balanced, self.length_rounding)

    @property
    def grounds(self):
        """Ground of each case, see `StatedNumbers.grounds`."""
        return self.values.grounds

    @cached_property
    def model_error(self):
        """Relative error of all results by conductors that are no linear cables, shape (n,). [-]"""
        cables = self.equivalent_cables
        return np.zeros(len(self.values)) if cables is None else uneven_errors(cables.linear, self.catenary)

    def errors_by_drag(self, column, numbers):
        """Relative errors of the numbers of a column by the drag of a steady wind, shape (n,): `errors_by_parts`."""
        least = 0.0 if column.needs == "scene" else self.form.least_errors
        if column.whole is not None:
            least = of_part(least, column.whole(self), numbers)
        return errors_by_parts(numbers, np.asarray(column.compute(self.coarser)), least)

    @cached_property
    def mode_error(self):
        """Relative error of all frequencies, shape (n,): that of the model, and by drag. [-]"""
        if not self.in_steady_wind:
            return self.model_error
        return self.form.mode_errors + self.model_error

    @cached_property
    def sag_rounding(self):
        """Relative error of the sag of exactly vertical cables by the rounding of the chord, shape (n,). [-]"""
        span = self.span
        if span.cosine.all():
            return np.zeros(len(span.chord))
        sag = np.abs(self.statics.sag)
        return np.where((span.cosine == 0) & (sag > 0), STUDY.epsilon * span.chord / np.where(sag > 0, sag, 1.0), 0.0)

    @cached_property
    def motion_rounding(self):
        """Relative error of frequencies and responses by the rounding of the least tension, shape (n,). [-]

        Its rounding acts over the short piece that has this tension.
        """
        largest = self.statics.max_tension
        least = np.maximum(self.form.min_tension, CABLE.folded * largest)
        steep = np.divide(largest, least, out=np.ones_like(largest), where=least > 0)  # not without tension
        return np.maximum(np.maximum(STUDY.rounding, self.length_rounding), STUDY.epsilon * steep**0.75)

    @cached_property
    def longest_segment(self):
        """Share of the longest segment between loads of the unstretched length, shape (n,). [-]"""
        return self.catenary.segments.fraction.max(axis=-1)

    @cached_property
    def travel_time(self):
        """Estimated time of a transverse wave from end to end, by the mean tension, shape (n,). [s]"""
        span, tension = self.span, self.statics.mean_tension
        return span.unstretched_length * np.sqrt(span.mass * (1 / tension + 1 / span.axial_stiffness))

    @cached_property
    def axial_waves(self):
        """Estimated number of transverse half-waves along the cable at its first axial frequency, shape (n,). [-]"""
        return np.sqrt(self.span.axial_stiffness / self.statics.mean_tension)

    @cached_property
    def sag_waves(self):
        """Half-waves of the highest symmetric in-plane modes that stretching by the sag lifts, shape (n,). [-]

        By Irvine's parameter: it lifts each of these modes by two half-waves at most.
        """
        return np.sqrt(lambda_squared(self.span, self.statics.mean_tension)) / np.pi

    @cached_property
    def folded(self):
        """True where a cable has almost no tension somewhere, shape (n,)."""
        return self.form.folded

    def pieces(self, case):
        """Edges of the pieces along which one cable bends little, shares of its length; see `meshes.pieces`.

        NoSolutionError or ConvergenceError where it has no equilibrium, or hangs folded and has no motion.
        """
        self.check(case)
        if self.folded[case]:
            raise NoSolutionError(LIMP if self.limp[case] else NO_MOTION)
        return self._edges[case]

    @cached_property
    def _edges(self):
        """`pieces` of all cables that have motion, others whole: list."""
        return edges_of_pieces(self.catenary, ~self.folded & self.catenary.record.converged)
