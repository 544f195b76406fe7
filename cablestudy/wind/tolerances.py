"""Numbers that bound errors, searches and sizes in `wind`, each with its reason."""


class WindTolerances:
    """Tolerances of the wind: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # --------------------------------------------------------------------- coherence of gusts along cables

    coherence_functions: int = 800  # of a cable with more nodes the smoothest ones
    # of a combination of these functions over the largest, up to which it vanishes at all nodes except for rounding
    dependent_functions: float = 1e-9
    # points and panels in a decade of `Coherence`, and its error: of 40 random scenes the panels added 1e-7 at most
    # where twice as many do not move the variance by more,
    coarse_coherence: tuple = (7, 4, 6e-6)
    fine_coherence: tuple = (24, 8, 3e-8)  # and those of a finer one
    coherence_degree: int = 7  # of the splines between them
    least_length_ratio: float = 1e-200  # cable's length over coherence length, whose square must not be zero
    # exponent of the decay of a coherence up to which it counts: less than 1e-217 makes products of denormal numbers,
    # which take a processor a hundred times as long
    largest_decay: float = 500.0
    load_points: int = 4  # Gauss points of the loads on an element beyond its order
    # distance of two elements over the mean one of these points, below which their coherence is integrated
    close_cables: float = 3.0
    # points for that, at least: an error of 3e-8 of an RMS on cables that meet at 1.5 degrees, of 1e-6 of an RMS
    # velocity on cables 0.4 m apart over 300 m
    peak_points: int = 28
    chord_points: int = 2  # times as many points as for the loads for the coherence by chords in place of arcs
    narrow_peak: float = 1e-3  # width of a peak in the coherence over the element along which it is: at least,
    broad_peak: float = 10.0  # and at most
    parallel_cables: float = 1e-3  # angle of two cables at least [rad]
    # order of the rod along a cable in one element, over the root of their number in several: gusts that are coherent
    # over little of a cable have a short layer at its ends, with order 16 an error of 2e-4 of the RMS rate of a
    # rotation
    rod_orders: int = 64

    # ---------------------------------------------------- covariance of the forces of gusts over frequency

    panels_per_decade: int = 8  # of frequency, where no covariance is interpolated
    # kappa times the size of the suspension up to which a covariance is about linear in kappa,
    linear_covariance: float = 0.1
    falling_covariance: float = 1e4  # and kappa times the length of a cable from which on it falls with 1/kappa;
    independent_bodies: float = 30.0  # kappa times the distance of two bodies from which on they have none,
    far_above_least: float = 100.0  # and kappa over the least one up to which a covariance is computed in any case
    panel_boundary: float = 1e-6  # rounding of a boundary of panels in numbers of panels
    coherence_entries: int = 1_000_000  # of a coherence matrix that are computed at once

    # ------------------------------------------------------------------------------------------------ drag

    # standard deviations of the speed, on either side of its mean, in a range of shedding frequencies
    shedding_deviations: float = 3.0
    mean_wind_equilibria: int = 40  # largest number of equilibria until forces and attitude agree
    combined_equilibria: int = 6  # so many of the last ones are combined, once there are as many
    mean_wind_load: float = 1e-7  # change of the load of a cable, relative, up to which it is that of where it hangs
    # change of the cable ends over the smallest change so far, from which on the equilibria come no closer
    mean_wind_progress: float = 0.9
    largest_power_base: float = 1e150  # of a ratio whose powers must not overflow
    series_phase: float = 0.5  # pi f t below which a series takes the place of a difference
    series_terms: int = 8  # of the series, whose next one is below 1e-16 there

    # ---------------------------------------------------------------------------------- variances by poles

    undamped: float = 1e-9  # damping ratio below which a resonance is not bounded,
    # and that where the wind acts along cables: strain damps waves across them almost nothing
    undamped_along_cables: float = 1e-10
    undamped_share: float = 1e-6  # share of a variance by an undamped motion, from which on the variance is refused
    # of the largest pole that oscillates: decay that rounding may make. Real poles that are far faster, of strain that
    # is damped strongly in a light cable, stand apart: rounding of others does not grow with them
    decay_rounding: float = 1e-15
    quadrature: float = 1e-10  # error of the variances by the rule on the panels: that of Davenport's spectrum is 4e-11
    still: float = 1e-16  # energy of an output over the largest of all, below which it does not move
    delay_in_panel: float = 2.0  # turn by a delay in a panel [rad],
    delay_panels: int = 40  # and how many panels are made for it
    panel_edges: float = 1e-3  # least relative distance of their edges from others
    panel_points: int = 8  # of each panel
    # distance of a pole from the middle of a panel, in its half-widths, up to which the rule is corrected
    near_pole: float = 4.0
    frequencies_at_once: int = 100  # of which responses are computed in one call
    variance_rounding: float = 1e-13  # of a variance over the sum of the sizes of its terms: what is less is zero
    resolvent_entries: int = 100_000  # of poles times points of panels that are computed at once
    # of the input vectors of poles times matrices of the spectra that are computed at once: 8 MB
    product_entries: int = 1_000_000
    panel_halvings: int = 12  # of panels,
    unresolved_panel: float = 1e-5  # and share of the two highest polynomials in a function that is resolved
    highest_level: float = 40.0  # over an RMS: to go beyond a higher one has a probability of zero in double precision


WIND = WindTolerances()
