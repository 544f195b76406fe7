"""Numbers that bound errors, searches and sizes in `control`, each with its reason."""


class ControlTolerances:
    """Tolerances of loops of winches: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # -------------------------------------------------------------------------- stability and largest gain

    undamped: float = 1e-8  # damping ratio below which a mode counts as undamped
    # growth over frequency, of such a mode, that is not called instability: twofold in 1e8 oscillations
    negligible_growth: float = 1e-9
    refined_together: float = 2.0  # factors up to so many times the least one are refined at once
    one_crossing: float = 0.1  # relative distance of two frequencies up to which they belong to one crossing
    # relative distance of an eigenvalue from -1 over a gain up to which it may cross near that gain
    may_cross_within: float = 0.5
    # relative distance of gains and of frequencies up to which a pole that crosses in a similar loop may be the same
    same_pole: float = 0.02
    # relative, of the search for a crossing near another one, where the known slope gives none
    first_crossing_step: float = 1e-6
    crossing_step: float = 1e-6  # last step of that search over the width of the pole, from which it is extrapolated;
    crossing_frequency: float = 1e-12  # at least this, relative
    # gain up to which the sensitivity of a loop without limit is looked at, over its highest pole
    highest_sensitive_gain: float = 1e3
    # gain up to which stability is judged, over the lowest pole: beyond it rounding decides
    highest_judged_gain: float = 1e9
    driven_modes: int = 600  # of cables, that a gain could drive; more are refused: so many take three seconds
    peak_at_pole: float = 1e-5  # relative distance of a peak from a pole up to which it is that of its mode
    above_undamped_limit: float = 0.03  # a gain this much above that at which a mode as good as undamped grows is named
    closed_poles_gain: float = 3.0  # gains between which poles of the closed loop follow from a crossing, over its gain
    modes_at_once: int = 200  # so that matrices stay in the processor's cache
    # distance from the frequency of a mode, in its half-widths, at which Z is computed for its pole
    half_widths_aside: float = 5.0
    least_half_width: float = 1e-9  # that is taken, over the frequency
    narrow_pole_steps: int = 3  # of Newton's method to poles that decay less than their estimates are accurate

    # damping of ends and modes over the sum of its terms' sizes, up to which it is rounding: they cancel to some eps
    cancelled_damping: float = 1e-14
    # what the velocity of an input adds to an output directly, likewise: of displacements it is nothing
    cancelled_velocity: float = 1e-13

    # -------------------------------------------------------------------------- delay and its approximants

    pade_order: int = 8  # of an approximant of a delay,
    # and the phase up to which one is used [rad]: 8e-9 off there, at most 2 phase^17 (8!)^2/(16! 17!)
    pade_phase: float = 4.0
    pade_number: int = 15  # approximants of one delay
    # frequencies up to which a loop gain is followed, over those up to which its delay is approximated
    followed_beyond: float = 1.5
    # loop gain from which down a delay and its approximant cannot encircle -1: less than a third
    harmless_delayed_gain: float = 0.3
    # of exp(-s T) beyond which it is not followed to the left: no pole is there that matters
    followed_growth: float = 300.0

    # -------------------------------------------------------------------------------------------- the loop

    unmoved: float = 1e-3  # static gain of a coordinate over the largest, below which winches do not move it
    unstable_growth: float = 1e-9  # growth over frequency that is called instability
    pole_rounding: float = 1e-12  # of a pole over the largest one
    faint_gain: float = 1e-3  # loop gain down to which a delay is accurate in a response,
    delay_accurate_up_to: int = 20  # up to so many times the lowest frequency
    # turn by a delay that is left out of poles and state space [rad]: of less the approximant's poles, 1e7 times as
    # fast as those that matter, would spoil these; one of 1e-3 may change the damping of a resonance by 3 %
    slight_delay: float = 1e-6

    # --------------------------------------------------------------------------------------------- margins

    # size of the loop gain up to which bounds tell where the sensitivity has no peak that counts
    small_gain: float = 0.3
    # logarithm of a size that is far from 1: no resonance between two frequencies brings it there
    far_from_one: float = 1.5
    gain_steps: int = 60  # of the search for a gain
    peak_reached: float = 1e-9  # relative, of a peak of the sensitivity that rounding leaves where it is reached
    # imaginary part over size of an eigenvalue that rounding may have moved off the real axis
    real_eigenvalue: float = 1e-7
    passive: float = 1e-12  # of alpha below 2, which rounding may be: the real part of L is negative nowhere
    crossing_steps: int = 60  # of the search for one crossing
    zero_eigenvalue: float = 1e-11  # size of an eigenvalue over that of the largest, below which it is rounding of zero
    crossing_points: int = 15  # by which crossings between two frequencies are told apart,
    crossing_zooms: int = 2  # and how often
    secant_steps: int = 12  # of the secant method,
    secant_last_step: float = 1e-9  # and the one that ends it over the distance of frequencies
    secant_rounding: float = 1e-14  # least such step, over the frequency
    # imaginary part over size of an eigenvalue that crosses: others were taken for one that does
    crossing_real: float = 1e-6
    same_crossing: float = 1e-9  # relative distance of crossings that are one

    # ----------------------------------------------------- frequencies at which the loop gain is looked at

    grid_per_decade: int = 20  # frequencies
    grid_range: tuple = (1e-4, 1e3)  # frequencies that are evaluated, over the least and largest of the poles
    gain_at_rest: float = 1e5  # gain over the frequency at which the loop is as good as at rest
    same_frequency: float = 1e-13  # relative distance of frequencies that are one
    # largest distance from a pole, relative to its frequency: beyond it the decades are as close
    broad_pole: float = 0.12
    # distance of poles over their half-widths, and ratio of these, up to which one of them stands for all
    poles_together: float = 0.1
    infinite_at_pole: float = 1e-9  # damping ratio below which the loop gain at the pole itself is as good as infinite
    delay_turn: float = 0.1  # of a delay from one frequency to the next [rad]
    frequencies_at_once: int = 250  # of one call
    # frequencies of one loop up to which those of many are computed together: of more the calls cost little
    frequencies_together: int = 40
    terms_together: int = 2000  # coefficients of a sum over poles up to which copies of these cost less than calls
    eigenvalue_turn: float = 0.5  # of an eigenvalue between two frequencies, from which on more are taken; the same
    # of one so near the negative real axis where it changes so much that it may cross and come back:
    near_axis: float = 0.8
    angle_change: float = 0.5  # by its angle over that to the axis,
    size_change: float = 0.3  # by the logarithm of its size
    # gain up to which crossings are looked for so closely, over the one up to which none may be missed
    closely_looked_above: float = 4.0
    followed_distance: float = 3.0  # of an eigenvalue from -1 up to which its change, relative to it, is followed,
    followed_change: float = 0.5  # and that change
    close_frequencies: float = 1e-5  # relative distance of two frequencies that are close enough;
    interval_parts: int = 3  # parts of a larger one,
    interval_rounds: int = 4  # and how often it is divided
    # a peak between frequencies is at most so many times its visible height above the highest of them
    peak_reach: float = 2.0
    flat_peak: float = 0.02  # peaks so much, relative, below the highest are refined too
    # of two peaks of a sensitivity, relative, up to which they are equal: as little as is stated for them
    equal_peaks: float = 1e-6
    extremum_offset: float = 1e-4  # of an extremum: its offset over the distance of frequencies,
    extremum_value: float = 1e-14  # its relative value
    # distance of the values by which the highest one is found to rounding, over that of frequencies
    stencil: float = 1e-3
    # relative change of eigenvalues, and shift of a crossing over the width of its pole, up to which margins and the
    # largest gain of a loop gain are sought near those of another one
    nearby_change: float = 0.05
    nearby_bend: float = 0.2  # terms of second order over those of first order, up to which these suffice,
    nearby_rounding: float = 1e-9  # and the relative size below which they do not matter
    nearby_step: float = 1e-6  # relative step of frequency by which slopes are found for that,
    nearby_peak: float = 0.01  # and that at peaks, over the distance of frequencies there

    # -------------------------------------------------------------------------- responses and state spaces

    frequency_block: int = 4096  # frequencies computed at once, to bound the memory of a long response
    listed_names: int = 4  # names that a representation lists all
    settling_band: float = 0.02  # about the final value, of the settling time
    rise: tuple = (0.1, 0.9)  # shares of the final value between which a response rises
    ends_near_zero: float = 0.1  # final value over the largest one, below which a response ends near zero
    # relative difference between all points of time and every second one, up to which they are enough
    enough_points: float = 0.01
    fewest_points: int = 8  # of time
    spline_rounding: float = 1e-30  # of a coefficient over the largest of its order: far below rounding
    state_space_coordinates: int = 2000  # matrices of 128 MB
    component_begin: float = 1e-9  # of a time step, by which a component may begin before a point of time


CONTROL = ControlTolerances()
