"""Numbers that bound errors, searches and sizes in `study`, each with its reason."""


class StudyTolerances:
    """Tolerances of studies: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # -------------------------------------------- rows that are solved together

    rows_at_once: int = 200  # rows whose models are solved at once: bounds the memory
    low_mode_rows_at_once: int = 1000  # of them where low modes alone are asked for, whose models are small:
    low_mode_waves: int = 10  # those of up to so many half-waves along the cable
    coupled_rows_at_once: int = 50  # rows whose coupled modes of gondola and cable are computed at once
    suspensions_at_once: int = 200  # cases whose equilibria are solved together,
    suspended_cables_at_once: int = 6000  # and more of them up to so many cables: bounds the memory
    cables_at_once: int = 200  # cables, of several cases, whose modes are computed in one call
    numbers_at_once: int = 300_000  # in models of single cables solved together: 2.4 MB, about a processor's cache
    nodes_at_once: int = 100_000  # of all cables that are solved together: bounds the memory
    parquet_rows: int = 50_000  # written at once: bounds the memory
    pareto_points: int = 64  # points that are compared each with each
    pareto_numbers: int = 2_000_000  # compared at once: bounds the memory

    # --------------------------------------------------------------------------------------------- statics

    rounding: float = 1e-12  # relative error of closed forms and modes due to rounding; tests compare it with 50 digits
    upright: float = 1e-50  # share of a tension below which the horizontal part of that of an upright cable is zero
    first_conductor_strain: float = 1e-3  # strain of a conductor, to begin with
    # of its tension, relative: the tangent cable has an error of the order of its square
    conductor_tension: float = 1e-8
    conductor_points: int = 9  # along a cable, at which its tension differs from the mean one
    # safety factor on movements of bodies by that, which are found to first order: 1.4 times as much was seen where
    # permanent sets that vary along a cable meet the knee of its curve
    conductor_movement: float = 2.0
    spectral_order: int = 16  # of one element between neighbouring loads, where the cable is smooth
    dust: float = 1e-15  # of a coordinate over the longest chord: what rounding leaves of zero
    # size of a number that a limit may have, in the unit of its column: a margin is relative to it
    least_limit: float = 1e-30
    least_length: float = 0.1  # at the temperature of a case over that of the reference state
    rounded_direction: float = 1e-15  # cosine or sine of a direction: what is less is not zero for rounding only
    # share of its part of a cable at which an entry without a load is put: no load is likely there
    unloaded_fraction: float = 0.6180339887
    # parts of each smooth piece of a cable on which its drag is a polynomial: half as many show the error, which is
    # 1e-12 for common cables, and 1e-6 where a storm changes the tension by a half
    drag_parts: int = 4
    pushed_drag_steps: int = 6  # of the end of a cable that is pushed
    # of the bodies of a suspension in that search, from the stiffness alone and at most; where that finds nothing, such
    # as beside a stiff short cable, a second search combines none before they have become small
    drag_movements: tuple = ((3, 30), (30, 60))
    rough_movements: int = 2  # the first ones with drag on one part of each piece,
    combined_movements: int = 5  # others are combined from so many,
    drag_movement: float = 0.05  # and none is longer than this share of the longest cable
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
    # degrees of freedom up to which the change of a stiffness by actual drag is that of the whole matrix
    dense_stiffness: int = 300
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

    # ------------------------------------------------------- modes of single cables, by elements refined level by level
    # those that scale errors are tested with random scenes in tests/test_extremes.py

    lowest_order: int = 3  # of an element: the least with a symmetric and an antisymmetric shape inside;
    highest_order: int = 48  # beyond it two elements cost less, since an eigenvalue problem grows with its cube
    finest_orders: int = 380  # sum of the orders along a piece: an eigenvalue problem of a second
    most_unknowns: int = 12000  # beyond which the search ends,
    most_dense_unknowns: int = 2000  # and where a large share of the modes is needed, a dense eigenvalue problem:
    many_waves: float = 100  # for more half-waves; the size is then checked before the first model already
    order_growth: float = 1.3  # of the sum of orders to the next three levels: the error falls by a power of ten
    orders_without_waves: float = 3  # besides those for each half-wave, from which the error falls exponentially
    orders_per_digit: float = 1.0  # of the first level, for each further digit,
    orders_without_digits: float = 0.75  # and without any
    levels_without_value: int = 6  # in a row, after which a column is refused
    levels_without_gain: int = 2  # in a row whose error does not fall, after which the search ends where
    rounding_limit: float = 1e-5  # errors are below this, so that rounding is what remains
    # relative error of a frequency over the largest angle between the tangents at end 1 and elsewhere [1/rad], where
    # the elements do not resolve the transverse waves at this frequency
    unresolved_turn: float = 10

    counted_modes: int = 40  # modes of each plane up to which they are computed and not estimated

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
    delay_accurate_up_to: int = 20  # times the gondola's frequency: up to there a delay is accurate at least
    resonant: float = 0.5**0.5  # damping ratio from which a motion has no peak over frequency
    equal_values: float = 1e-9  # relative distance of equal values of cables, of which the first is named
    equal_frequencies: float = 1e-9  # relative distance of equal frequencies
    drawn_groups: int = 5000  # groups of neighbouring frequencies in a picture
    response_modes: int = 96  # beyond which a response does not ask for more by itself
    loop_response_modes: int = 160  # the same with the loop

    # --------------------------------------------------------------------- searches for the value of a key

    # values over the range of a key that the scene does not state, until one gives a valid scene
    tried_values: int = 25
    # relative error of the statics of suspensions, and of a model of fixed elements: rounding of its search
    found_value: float = 1e-9
    # factor up to which a column that is no closed form of one cable is searched about the start
    costly_reach: float = 1e3
    shown_values: int = 10  # values that a message lists
    range_factors: tuple = (2.0, 10.0, 1e3, 1e6, float("inf"))  # of the ranges about a start, one after the other
    many_decades: int = 2  # times as many points as usual in a range of many decades
    least_positive: float = 1e-9  # of a range that begins at zero: its smallest positive point, as a share
    edge: float = 1e-6  # width to which the end of what has a value is found, relative
    constant_spread: float = 1e-12  # of values that are equal except for rounding, relative
    abrupt: float = 0.5  # of the change over a bracket: a costly function that changes by so much within `edge` jumps
    jump: float = 1e-6  # of the change over a bracket: what is left at a zero of a continuous function is less
    bends: float = 4.0  # times its last change a costly function may change where its values end
    bracket_rounds: int = 6  # of refinement: each ends where a value was missing within a bracket
    path_positions: int = 39  # by default every fortieth of the length; on a support a load has no path
    most_path_positions: int = 1000  # at most
    listed_positions: int = 4  # places that are named

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
    rare: float = 1e-6  # probability that no decision tells from none: not named however large its relative error
    listed_reasons: int = 3  # in a status
    noted_force: float = 1e-11  # net force over the forces: what is less is rounding
    listed_parts: int = 12  # cables, bodies, or runs of modes, that are named one by one
    noted_change: float = 5e-5  # of a tension, relative, that is told
    noted_movement: float = 1e-11  # over the longest chord, that is told: less is rounding
    standing_turn: float = 30.0  # of what stands: rotation of a body [deg],
    standing_movement: float = 0.1  # and movement over the longest chord [-]; what moves more has fallen

    # -------------------------------------------------------------------------------- comparison of models

    # a model whose timings, of all columns together and of each alone, add up to this is not repeated [s]
    timing_budget: float = 0.5
    # the first run of a model, if it is shorter, is repeated and the second timed: other models have displaced the
    # processor's caches [s]
    brief_run: float = 0.1
    equal_times: float = 1.15  # times whose ratio is below are not told apart
    rounded_difference: float = 1e-8  # a difference that grows again from below this is rounding
    no_reference: float = 1e-3  # smallest relative difference of two levels above which there is no reference
    agreed_levels: float = 1e-12  # relative difference of two levels at which a value is not refined further


STUDY = StudyTolerances()
