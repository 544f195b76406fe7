"""Numbers that bound errors, searches and sizes in `study`, each with its reason."""


class StudyTolerances:
    """Tolerances of studies: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # -------------------------------------------- rows that are solved together

    rows_at_once: int = 200  # rows whose models are solved at once: bounds the memory
    coupled_rows_at_once: int = 50  # rows whose coupled modes of gondola and cable are computed at once
    suspensions_at_once: int = 200  # cases whose equilibria are solved together,
    suspended_cables_at_once: int = 6000  # and more of them up to so many cables: bounds the memory
    cables_at_once: int = 200  # cables, of several cases, whose modes are computed in one call
    lines_at_once: int = 1000  # lines of a CSV that are written in one call
    numbers_at_once: int = 300_000  # in models of single cables solved together: 2.4 MB, about a processor's cache
    nodes_at_once: int = 100_000  # of all cables that are solved together: bounds the memory
    parquet_rows: int = 50_000  # written at once: bounds the memory
    pareto_points: int = 64  # points that are compared each with each
    pareto_numbers: int = 2_000_000  # compared at once: bounds the memory

    # --------------------------------------------------------------------------------------------- statics

    rounding: float = 1e-12  # relative error of closed forms and modes by rounding; tests hold it against 50 digits
    upright: float = 1e-50  # share of a tension below which the horizontal part of that of an upright cable is zero
    first_conductor_strain: float = 1e-3  # strain of a conductor, to begin with
    # of its tension, relative: the tangent cable has an error of the order of its square
    conductor_tension: float = 1e-8
    conductor_points: int = 9  # along a cable, at which its tension differs from the mean one
    spectral_order: int = 16  # of one element between neighbouring loads, where the cable is smooth
    dust: float = 1e-15  # of a coordinate over the longest chord: what rounding leaves of zero
    # size of a number that a limit may have, in the unit of its column: a margin is relative to it
    least_limit: float = 1e-30
    second_order: float = 1.2  # safety factor on an error that is computed to first order
    least_length: float = 0.1  # at the temperature of a case over that of the reference state
    rounded_direction: float = 1e-15  # cosine or sine of a direction: what is less is not zero for rounding only
    slack: float = 1e-60  # share of the largest tension below which a cable is slack: no quotient by it overflows
    # a relative error that says no more than that nothing is known; no number larger is stated
    unknown_error: float = 1e30
    # share of its part of a cable at which an entry without a load is put: no load is likely there
    place_without_load: float = 0.6180339887
    drag_steps: int = 3  # in which c and d settle; what is left in the last one is added to the error
    push_steps: int = 200  # of the search for the position of a pushed end
    epsilon: float = 4e-16  # rounding of one number
    form_rounding: float = 5e-14  # of a place on a cable in closed form, over the largest distance from the chord
    # of the larger one of force and tension: what may be left of the force where rounding ends the search
    balanced: float = 1e-9
    tiny: float = 1e-300  # divisor in the place of zero
    pressure_passes: int = 8  # in which mean pressure and form of a cable come together,
    pressure_change: float = 1e-7  # and what change of it is left
    # of a cable that does not exist: taut, so that arrays hold a solvable cable in its place
    stand_in_strain: float = 1e-3
    stiffness_rounding: float = 1e-12  # of an entry over the geometric mean of those on the diagonal

    # ----------------------------------------------------- modes, and models of a fixed number of elements

    spare_modes: float = 1.2  # times as many modes as are expected below an axial one are computed at first
    highest_mode_number: int = 1000  # of a column
    # of a model with more unknowns, at its ends: an eigenvalue problem that takes about a second
    modes_at_ends: int = 600
    fixed_nodes: int = 1_000_000  # of a fixed model: its statics take 2 s and 420 MB
    # accuracy of the model against which the motion of a fixed model is held: above it, errors are true
    reference_accuracy: float = 1e-6
    modes_beyond: int = 8  # those asked for that are computed at first, for modes of a body
    first_body_modes: int = 12  # modes that are computed at first for the mode of a body,
    most_body_modes: int = 400  # and at most
    light_damping: float = 0.02  # damping ratio up to which a pole is looked for from that without damping on,
    pole_distance: float = 0.5  # no farther than this times the damping ratio, since another mode may be near
    known_pole_distance: float = 0.1  # relative distance from a known pole, from which on it is another one
    undamped_rounding: float = 1e-24  # damping ratio up to which it is rounding of a mode that nothing damps
    # displacements of a cable all of whose modes are computed for a damped pole: half a second
    damped_pole_freedoms: int = 1200
    coarser_mesh_safety: float = 3.0  # on the change from coarser meshes, where it falls slowly
    sharper: tuple = (1.0, 1e-2, 1e-4)  # accuracies of the modes that are tried for a number, over that asked for
    next_mode: float = 1.1  # least frequency of modes above those computed, over that of a body's mode
    equal_shares: float = 1e-6  # relative difference of two shares that are one: the lower mode is taken

    # ------------------------------------------------------- modes of single cables, by elements refined level by level
    # those that scale errors are tested with random scenes in tests/test_extremes.py

    lowest_order: int = 3  # of an element: the least with a symmetric and an antisymmetric shape inside;
    highest_order: int = 48  # beyond it two elements cost less, since an eigenvalue problem grows with its cube
    finest_orders: int = 380  # sum of the orders along a piece: an eigenvalue problem of a second
    most_unknowns: int = 12000  # beyond which the search ends,
    most_dense_unknowns: int = 2000  # and where a large share of the modes is needed, a dense eigenvalue problem:
    many_waves: float = 100  # for more half-waves; the size is then checked before the first model already
    order_growth: float = 1.3  # of the sum of orders to the next three levels: the error falls by a power of ten
    orders_beside_waves: float = 3  # beside those for each half-wave, from which the error falls exponentially
    orders_per_digit: float = 1.0  # of the first level, for each further digit,
    orders_beside_digits: float = 0.75  # and besides
    levels_without_value: int = 6  # in a row, after which a column is refused
    levels_without_gain: int = 2  # in a row whose error does not fall, after which the search ends where
    rounding_limit: float = 1e-5  # errors are below this, so that rounding is what remains
    # relative error of a frequency over the largest angle between the tangents at end 1 and elsewhere [1/rad], where
    # the elements do not resolve the transverse waves at this frequency
    unresolved_turn: float = 10

    # -------------------------------------------------------- motion in the wind, with the loop or without

    model_modes: tuple = (64, 100, 160)  # modes of the models that are tried,
    plane_model_modes: tuple = (32, 64, 100)  # of a cable that moves in its plane only
    fewest_modes: tuple = (8, 4)  # before them, of few cables, so many and so many of each cable,
    few_modes: tuple = (16, 8)  # and then so many
    lacked_compliance: float = 1e-3  # share in the static compliance of bodies that these may lack,
    lacked_motion: float = 0.1  # and that any model may lack without responses to the inertia of the bodies
    # where notches are at frequencies that those have not; the first one where those do not suffice for the accuracy,
    # unless damping is modal, and for tensions of a bare cable
    more_modes: tuple = (300, 600)
    # of a model with an exact choice of elements, where fewer change the RMS by more than the share
    element_modes: int = 250
    element_modes_change: float = 1e-9  # that share
    margin_safety: float = 2.0  # on the change of a margin by fewer modes
    # on the error of an RMS that one model shows, as far as the accuracy allows, and least
    one_model_safety: float = 4.0
    # share of the accuracy: of 220 numbers of random scenes ten were more wrong than shown, up to 2.3 times, or by
    # less than this share
    resolved: float = 5e-3
    # the same share where a model has the fewest modes: of 66 such models one was more wrong than 5e-3
    resolved_by_fewest: float = 0.2
    # of a displacement by the mean wind over the longest chord: what is less is shown as zero
    mean_wind_rounding: float = 1e-14
    fewer_modes: float = 0.7  # of the modes, with which the error by those left out is estimated
    dependent_response: float = 1e-10  # size of a static response over the largest, below which it is rounding
    # share of the kinetic energy of a mode in what outputs depend on, up to which it is rounding
    unseen_energy: float = 1e-16
    # frequency over the highest of a model, from which on its response is held against that of all modes of the cables,
    left_out_from: float = 0.9
    left_out_points: int = 100  # at so many frequencies beside those near resonances,
    # and at more where a logarithm of a response changes by more,
    left_out_change: float = 0.5
    left_out_rounds: int = 14  # up to so many times,
    left_out_step: float = 1e-7  # or down to this relative distance
    # change of a variance at most, over what a model has of it at high frequencies: where that is less than what is
    # stated at least, nothing is looked for. Of 114 random scenes three changes were 110, 74 and 16 times as large,
    # others 2 times at most
    left_out_change_at_most: float = 2e2
    # what a mode adds to a variance over the largest such number, below which it is left out
    left_out_share: float = 1e-6
    left_out_resonances: float = 1e-2  # and below which frequencies near it are not looked at to begin with
    left_out_small: float = 1e-6  # variance over the largest, below which it counts as that much
    left_out_flank: float = 100.0  # what a peak may add over what its flank shows between two frequencies
    left_out_safety: float = 2.0  # on the changes that are found
    fixed_model_accuracy: float = 1e-4  # where the scene has a fixed model
    # on what the highest modes add to the variance of a tension: what is left out falls slowly
    tension_safety: float = 10.0
    # of the variance of a tension, in addition to what waves change, where the ends of cables move
    moving_ends: float = 1e-3
    # error of variances of speed and acceleration of winches by modes left out, which the highest do not show
    winch_speeds: float = 2e-6
    energy_rounding: float = 1e-15  # of the energy of an output over the largest of all: what is less is shown as zero
    response_entries: int = 500_000  # of the responses that are computed at once
    # height of a resonance over the largest one of an output, from which on it is seen there
    seen_resonance: float = 0.01
    # on the change of a variance from a model with fewer modes, whose errors may fall slowly
    change_safety: float = 10.0
    waves_along: float = 2.0  # on the changes by waves along the cables,
    # and across them: waves along a cable that sags are driven across it too. Chosen on random scenes; of 330
    # tensions of others that are held up to 12 were still more wrong, up to 2.3 times
    waves_across: float = 1.0
    wave_range: float = 30.0  # frequency up to which these waves are looked at, over that of the first one
    strained_share: float = 0.1  # of the energy of a wave across a cable that is one of its strain
    least_wave_damping: float = 1e-6  # damping ratio of a wave: at least,
    most_wave_damping: float = 0.9  # and at most
    lowest_frequency: float = 2e-5  # over the slowest of wind, loop and lowest mode,
    highest_frequency: float = 1e3  # and over the fastest,
    # and over the highest corner of loop and actuators: of an acceleration of a winch 1e-4 lacks
    beyond_corners: float = 30.0
    # largest relative error of a variance by a pole that lacks the right delay, over the loop gain there
    delayed_error: float = 4.0
    # least relative error of the rate at which a tension, or the speed of a winch behind a notch that passes high
    # frequencies hundreds of times larger, crosses its mean: motions above the model's modes count. Of tensions in
    # 90 random scenes with next to no damping five were more wrong, up to 0.38; then the rate states more itself
    crossings: float = 0.2
    counted_modes: int = 40  # modes of each plane up to which they are computed and not estimated

    # ------------------------------------------------------------- modes of cables that a loop could drive

    little_gain: float = 1e-6  # gain over the lowest frequency, of a loop whose gain follows from a margin
    unlimited_gain: float = 1e3  # up to which a loop that seems to have no limit is examined, over its lowest frequency
    gain_trials: int = 4  # of the gain that decides which modes of cables are looked at
    first_gain_safety: float = 3.0  # of the first one, over the largest gain to first order,
    element_gain_safety: float = 200.0  # or, of an exact choice of elements, all modes there, so far above it,
    # where that could drive at most so many half-waves along a cable: more cost more than a second trial
    first_gain_waves: int = 40
    single_mode_errors: float = 1.5  # multiples of frequencies up to which errors of the mesh are those of single modes
    all_modes_from: float = 1e-5  # accuracy from which on all modes are kept,
    vectors: int = 6  # vectors that stand for others,
    worth: float = 0.7  # and share of the modes from which on these spare nothing
    resolved_waves: int = 300  # half-waves along a cable that are resolved,
    driven_modes_of_cable: int = 1600  # and its modes that are computed
    resolution_trials: int = 5  # of the frequency up to which waves across the cables are resolved,
    resolved_beyond: float = 1.2  # over that of the pole,
    # and ratio of gains up to which finer elements may change which of two poles crosses first
    limit_of_finer: float = 1.25
    largest_gain_safety: float = 2.0  # on the change of the largest gain
    # relative distance of frequencies about one that decides a margin, by which it changes with the model
    margin_window: float = 0.2
    # frequency of a mode over the highest resolved one, from which its pole may lie above that
    may_be_above: float = 0.5
    nearly_largest_gain: float = 0.5  # gain over the largest,
    # and relative distance of modes from the one that would grow, from which on such modes are in the model of the
    # response
    critical_modes: float = 0.05
    # relative error of where such a pole is: the model may lack one that seems to be below its highest
    uncertain_pole: float = 2e-3
    # relative distance of an estimated pole from the frequency with fixed ends, from which it is sought on the way too
    far_from_fixed: float = 0.01
    zero_pole: float = 1e-3  # size of a pole over the lowest frequency, below which it is that of an integral, zero
    driven_decay: float = 0.05  # share of its decay by which the gain may move the pole of a mode that is left out
    driven_wave_safety: float = 2.0  # on the same for waves, by which the highest mode is found that is looked at
    # loop gain of waves that run away, above which a law that is no integrator needs all modes
    broad_loop_gain: float = 0.1
    axial_share: float = 0.1  # of the force of a wave along a cable from which a mode is one along it

    # ----------------------------------------------------------- loops in time, state spaces and responses

    winch_step: float = 1e-3  # of winch or reference, without another size [m] or [rad]
    # standard deviations of the turbulence in a gust or step of the wind without another size
    gust_deviations: float = 3.0
    time_points: int = 101  # points of time of a table: by default,
    most_time_points: int = 100_001  # and at most
    fine_time_steps: int = 2000  # steps of time at least, of which a table shows some
    durations: tuple = (1e-6, 1e9)  # least and largest [s],
    sizes: tuple = (1e-12, 1e9)  # and of sizes [m] or [rad] or [m/s]
    gust_lengths: tuple = (1e-4, 1e4)  # of a gust, over the duration
    time_rounding: float = 1e-13  # over the largest value, below which a value is rounding
    fast_winch: float = 10.0  # above the speed of all but the hoists of deep mines [m/s]
    # share of the response at the frequency of a pole that is its own, below which it is not seen
    cancelled_pole: float = 0.1
    circle_points: int = 61  # of a picture near each pole
    default_modes: int = 12  # of a model to an accuracy
    lowest_response: float = 1e-100  # response frequencies whose squares do not underflow,
    highest_response: float = 1e100  # or overflow [Hz]
    response_frequencies: int = 10_000_000  # at most
    listed_names: int = 12  # names that a message lists all, in addition to the nearest one
    cable_states: int = 1000  # of which the poles are found in a second or two
    delay_right_up_to: int = 20  # times the gondola's frequency: up to there a delay is right at least
    resonant: float = 0.5**0.5  # damping ratio from which a motion has no peak over frequency
    undamped_motion: float = 1e-12  # its damping ratio
    equal_values: float = 1e-9  # relative distance of equal values of cables, of which the first is named
    equal_frequencies: float = 1e-9  # relative distance of equal frequencies
    drawn_groups: int = 5000  # groups of neighbouring frequencies in a picture
    response_modes: int = 96  # beyond which a response does not ask for more by itself
    loop_response_modes: int = 160  # the same with the loop

    # --------------------------------------------------------------------- searches for the value of a key

    # places over the range of a key that the scene does not state, until one gives a valid scene
    valid_places: int = 25
    # relative error of the statics of suspensions, and of a model of fixed elements: rounding of its search
    found_value: float = 1e-9
    # factor up to which a column that is no closed form of one cable is searched about the start
    costly_reach: float = 1e3
    shown_values: int = 10  # values that a message lists
    range_factors: tuple = (2.0, 10.0, 1e3, 1e6, float("inf"))  # of the ranges about a start, one after the other
    many_decades: int = 2  # times as many points as usual in a range of many decades
    least_positive: float = 1e-9  # of a range that begins at zero: its smallest positive point, as a share
    edge: float = 1e-6  # width to which the end of what has a value is found, relative
    constant_spread: float = 1e-12  # of values that are equal but for rounding, relative
    abrupt: float = 0.5  # of the change over a bracket: a costly function that changes by so much within `edge` jumps
    jump: float = 1e-6  # of the change over a bracket: what is left at a zero of a continuous function is less
    bends: float = 4.0  # times its last change a costly function may change where its values end
    bracket_rounds: int = 6  # of refinement: each ends where a value was missing within a bracket
    load_places: int = 39  # by default every fortieth of the length; on a support a load has no path
    most_load_places: int = 1000  # at most
    listed_places: int = 4  # places that are named

    # --------------------------------------------------------------------------- notes, tables and reports

    table_digits: int = 4  # of a number
    most_digits: int = 17  # of a float
    table_rows: int = 1000  # of a table
    few_rows: int = 4  # which stand side by side where their columns do not
    narrowest_column: int = 24  # width to which a column of long texts is wrapped
    poor_statics: float = 0.01  # relative error of the statics of fixed elements above which a warning is given
    flat_cable: float = 1e-3  # sag over chord below which its error counts relative to the chord
    listed_columns: int = 6  # columns that are named
    shared_compliance: float = 0.5  # share of the gondola's compliance below which others are named,
    shown_compliance: float = 0.05  # and of those
    shape_points: int = 41  # along a cable in closed form
    listed_reasons: int = 3  # in a status
    noted_force: float = 1e-11  # net force over the forces: what is less is rounding
    listed_parts: int = 12  # cables, bodies, or runs of modes, that are named one by one
    noted_change: float = 5e-5  # of a tension, relative, that is told
    standing_turn: float = 30.0  # of what stands: rotation of a body [deg],
    standing_movement: float = 0.1  # and movement over the longest chord [-]; what moves more has fallen

    # -------------------------------------------------------------------------------- comparison of models

    timing_budget: float = 1.5  # a model whose timings add up to this is not repeated [s]
    # a shorter run is repeated and the second timed: other models have displaced the processor's caches [s]
    brief_run: float = 0.1
    equal_times: float = 1.15  # times whose ratio is below are not told apart
    rounded_difference: float = 1e-8  # a difference that grows again from below this is rounding
    no_reference: float = 1e-3  # smallest relative difference of two levels above which there is no reference
    agreed_levels: float = 1e-12  # relative difference of two levels at which a value is not refined further
    # frequency up to which modes of a cable are kept that damping couples, over the highest one that the gain could
    # drive and over that up to which waves are resolved;
    kept_multiples: tuple = (4.0, 2.0)
    coarser_share: float = 0.5  # share of it with which the error by the others is estimated,
    # which is this at least (3e-7 in 100 random scenes; poles in windows change a largest gain by 5e-7 at most in 45)
    by_other_modes: float = 1e-6
    narrow_resonance: float = 1e-5  # distance to a pole over the frequency, below which errors of sums over poles count


STUDY = StudyTolerances()
