"""Numbers that bound errors, searches and sizes in `system`, each with its reason."""


class SystemTolerances:
    """Tolerances of suspensions: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # ------------------------------------------------ rows that are computed together

    entries_at_once: int = 1_000_000  # of the square matrices of all rows of one call

    # ------------------------------------------------ equilibrium of bodies by descent and Newton's method

    descent_steps: int = 100  # of a search,
    descent_halvings: int = 30  # and of one of its steps
    # net force after a whole step over that before it, up to which a search is about to end:
    descent_settling: float = 0.25
    straight_steps: int = 12  # of a search straight from the start: those that need more go by softer cables
    soft_steps: int = 60  # most steps with each of these,
    soft_net_force: float = 1e-6  # and net force over the sum of forces that is small enough there
    soft_tension: float = 10.0  # tension that a soft cable may have, over the loads on all bodies
    # a search can go no further where some steps leave more than this share of the net force:
    descent_progress: float = 0.5
    descent_patience: int = 4  # so many of them
    farthest_step: float = 0.5  # largest step: over the extent of the suspension,
    widest_turn: float = 0.7  # and in radians
    # change of a tension over its size, up to which the stiffness foretells it well enough to begin a search from there
    foretold_change: float = 0.3
    sufficient_descent: float = 1e-4  # share of the descent that the slope foretells (Armijo),
    # and by how much the slope must have changed where the descent is rounding (delta of Hager and Zhang)
    slope_change: float = 0.1
    flattest: float = 1e-13  # scaled eigenvalues below it count as this large in a step
    # of the unstretched length: ends closer than this are taken as this far apart, one above the other
    nearest_ends: float = 1e-9
    equilibrium_steps: int = 30  # of a search for lengths and equilibrium,
    equilibrium_tries: int = 7  # and of one of its steps
    # a search ends where some steps in a row leave more than this share of the errors:
    equilibrium_progress: float = 0.7
    equilibrium_patience: int = 4  # so many of them
    # singular value of the changes in a fixed-point iteration, over the largest, up to which rounding determines it
    dependent_steps: float = 1e-10
    next_equilibrium_steps: int = 25  # from an equilibrium to the next one
    softened: tuple = (0.3, 0.03, 1e-3, 1e-5, 1e-8)  # strains of cables that a search goes by
    error_in_step: float = 10.0  # relative error that a step shall take away at most
    # distance that a failed search with softer cables has gone, over the suspension's extent, up to which the next one
    # begins where it ended
    farthest_softened: float = 100.0
    length_change: float = 0.3  # change of an unstretched length in one step, over the length
    # steps off a saddle: rotation [rad], or share of the extent of the suspension
    off_saddle: tuple = (0.1, -0.1, 0.3, -0.3)
    link_places: float = 1e-9  # distance of the places of a link, over the longest distance of two ends, that is none
    added_stiffness: float = 1e-14  # added to the diagonal of the scaled stiffness
    nearest_link_places: float = 1e-9  # of the length: places closer than this are taken as this far apart in F/d
    tiny: float = 1e-300  # in place of zero in a denominator
    # degrees of freedom up to which dense matrices of all cases are faster than sparse ones of each
    dense_freedoms: int = 100
    remembered_cables: int = 6000  # of the equilibria that are kept, in all their cases
    # scaled eigenvalues of this size count as zero, and those of the size of the net forces
    zero_eigenvalue: float = 1e-13
    named_share: float = 0.5  # of the largest component of a motion: components from here on are named,
    named_components: int = 3  # so many at most
    wrong_value: float = 1e-8  # relative error of a stated value that counts as one,
    nearly_right_value: float = 1e-3  # and up to which its digits would not show it

    # ----------------------------------------------------- unstretched lengths that satisfy what is stated

    lengths_steps: int = 40  # of the search for all lengths together
    largest_turn: float = 0.3  # steps that turn more [rad]
    growing_step: float = 10.0  # or grow more are damped,
    shrinking_step: float = 0.7  # and those that go back and shrink less;
    slow_step: float = 0.3  # damping is eased where others shrink less
    damped_lengths: float = 0.05  # with weights from this
    most_damped_lengths: float = 1e3  # to this
    lengths_patience: int = 4  # a search can go no further where so many steps in a row leave more than some share
    lengths_progress: float = 0.9  # of the changes, or of the tensions beyond the bounds: this one
    # relative change up to which balanced tensions are an answer: the best ones but for its stated error
    rough_balance: float = 1e-3
    infeasible_steps: int = 6  # in a row that leave no tensions within the bounds, and come no closer
    least_tension_share: float = 0.1  # tension after a step over that before it, at least
    least_level_tension: float = 0.508  # of a level cable that does not stretch, over the weight of its chord
    stated_steps: int = 60  # of the search for the length of one cable
    stalled_error: float = 1e-9  # relative error at which rounding may stop the search
    falling_error: float = 0.9  # a cable whose error does not fall to this share in some steps has no such length:
    stalled_steps: int = 8  # so many of them
    sag_difference: float = 1e-5  # relative step for the derivatives of a sag, which are good to its square
    stated_length_change: float = 0.2  # change of an unstretched length in one step, over the length
    slackest: float = 2.0  # length over chord of the cable with the least tension: not more,
    slack_lengths: int = 17  # lengths on a grid
    least_tension_error: float = 1e-3  # largest relative error of that tension, found on a grid and a finer one
    steepest: float = 1e-6  # least cosine of the inclination of a cable whose horizontal tension is stated
    rank: float = 1e-10  # singular values below it, over the largest one, count as zero
    unbalanced: float = 1e-8  # force left over, over the loads, from which no tensions hold the loads
    # weight of the tensions themselves beside their deviations from the mean: the smaller of equals
    tensions_themselves: float = 1e-4
    farthest_bound: float = 1e6  # over the largest tension: bounds farther off count as at this distance
    outside_bounds: float = 1e-9  # share of the largest tension by which one may lie outside the bounds: rounding

    # --------------------------------------------------------- rounding, and what stated values leave open

    rounding: float = 2.0**-52  # of a number
    # rounding of a sum of some terms, over that of one: a residual that does not cancel further
    sum_rounding: float = 8.0
    samples: int = 16  # of the signs of rounding: the root mean square of as many is good to a fifth
    seed: int = 1  # of the generator of these signs
    curved: float = 2.0  # largest displacement by a residual over its linear estimate: what curvature makes of it
    # what rounding moves by more than this share of the longest cable, or turns by as many radians, is not determined
    # by what is stated: hardly two digits of it would be known
    undetermined: float = 5e-3
    stayed: float = 1e-9  # movement from the described place, over the longest cable, that is none
    unknown: float = 1e30  # in place of what is not finite

    # ------------------------------------------------------------- meshes and coordinates of coupled modes

    modes_of_cable: int = 600  # at most
    highest_order: int = 44  # of an element of a suspension's cable
    dependent_residual: float = 1e-12  # size of a residual vector over the largest, below which rounding determines it
    left_by_modes: float = 1e-11  # size of what the modes leave of a vector, over its own, below which it is rounding
    dependent_unit: float = 1e-8  # mass of a combination of unit vectors, below which rounding determines it
    massless_amplitude: float = 1e150  # of a coordinate without mass, in place of an infinite one
    uncoupled_entry: float = 1e-12  # of the size of two coordinates, up to which what couples them is rounding
    loss_rounding: float = 1e-13  # asymmetry, or negative eigenvalue, of a damping matrix over its largest entry
    # entry of A over the largest one of its row or column, whichever is less, up to which it is rounding
    entry_rounding: float = 1e-14
    large_connection: int = 300_000  # entries of G from which it is kept sparse
    orders_per_digit: float = 0.9  # orders of a cable's mesh for each digit of the accuracy
    finer_orders: int = 2  # orders that are added where a mesh is too coarse,
    finer_digits: float = 2.0  # and digits that they gain at least
    coordinates_share: float = 0.5  # of the accuracy that what is left out of the coordinates may take
    # of the highest frequency over the limit of the modes kept, to which the error by those left out grows
    left_out_power: int = 6
    least_mode_limit: float = 1.5  # over the highest frequency,
    mode_limit: float = 0.2  # and factor of accuracy^(-1/left_out_power)
    # multiple of the highest frequency up to which the first mode of a cable may be among those asked for
    near_highest: float = 1.5
    wider: float = 1.5  # growth of that multiple, and of limits, where it does not suffice
    least_growth: float = 1.15  # of a limit in one trial,
    most_growth: float = 3.0  # and the largest;
    growth_safety: float = 1.1  # factor on what its error calls for
    # least multiple of the highest frequency up to which the finer model for damping keeps modes
    damping_limit: float = 3.0
    # estimated error by cables without modes over the error allowed, up to which they are tried
    no_modes_error: float = 0.5
    mesh_trials: int = 8  # of meshes,
    limit_trials: int = 12  # and of limits with each
    # error of a frequency that modes of cables may leave where the choice of elements is exact
    exact_elements: float = 1e-10
    # modes of a cable of such elements whose modal damping counts: an eigenvalue problem of a second
    modally_damped_modes: int = 1800
    frequency_rounding: float = 1e-12  # error of a frequency by rounding
    # modes that the other model needs beyond those asked for: the partner of the highest may be among them
    modes_beyond: int = 8

    # -------------------------------------------------------------------- linear system, poles and damping

    dense_coordinates: int = 300  # up to which a full eigen-solution costs less than Lanczos iteration
    massless: float = 1e-28  # compliance over the largest, below which a motion has no mass
    response_entries: int = 4_000_000  # of the matrices that are solved at once for a frequency response: 64 MB
    # momentum of a mode of unit mass over the root of a body's mass, up to which it is rounding
    uncoupled_momentum: float = 1e-12
    pole_steps: int = 30  # iterations
    dense_numbers: int = 60_000  # in the matrices of cables that are solved at once: a processor's cache holds them
    pole_change: float = 1e-12  # relative change of a pole, of the size of its rounding
    dependent_ritz: float = 1e-10  # size of a vector over the largest, below which rounding determines it
    # product of two modes above which they are not orthogonal: of some that coincide not all were asked for
    not_orthogonal: float = 1e-6
    coupled_modes: int = 40  # modes above those asked for that damping may couple to them
    # share of a mode in the motion of a pole, below which a mode damped above critical does not oscillate
    oscillating_share: float = 0.5
    uncorrected: float = 1e-3  # singular value of the static gain over the largest, below which a pose is not corrected
    dependent_shares: float = 1e5  # sum of the sizes of the shares of all states in a pole,
    singular_inverse: float = 1e12  # and entry of V^-1, above which A has next to no eigenvectors
    sharp: float = 0.35  # damping ratio below which a pole makes a response sharp over frequency
    gap: float = 0.7  # least of the frequency above which other poles are taken
    moved_apart: float = 1e-9  # change of poles that coincide then, over their size
    coincident_poles: float = 1e-3  # relative distance of poles up to which they may be one: four of them, by rounding
    # least singular value of the unit eigenvectors of these, below which they are next to parallel
    parallel_vectors: float = 1e-3
    circle_radius: float = 0.3  # of a circle about these, over the distance of the next pole
    many_modes: int = 100  # single modes among combinations from which on they are looked for
    # frequencies for which the modes are summed in one call: arrays that stay in the processor's cache
    frequency_block: int = 128

    # ----------------------------------------------------------- damping that couples the modes of a cable

    # difference between the sum over poles and the forces it stands for, up to which the sum is used
    trusted: float = 1e-11
    # the same of poles found in windows: nine cables of a balloon leave up to 6e-7; a cable whose damping couples
    # modes over more than windows are wide leaves 2e-6, and 1.5e-4 of its largest gain
    trusted_windows: float = 7e-7
    windows_from: int = 150  # modes from which on windows are faster than one eigenvalue problem
    spoiling_loss: float = 1e6  # loss factor at the lowest mode from which rounding spoils what damped strain leaves
    solvent_steps: int = 20  # of the iteration for half of the poles of a cable, which takes seven of a usual one
    solved_places: int = 16  # places up to which solving is cheaper than finding the poles
    systems_at_once: int = 64  # systems of equations that are solved in one call
    window: int = 60  # poles of a window,
    window_margin: int = 20  # and those on each side of it of which the modes are in its eigenvalue problem
    lowest_window: int = 3  # the lowest window is so many times as wide: there coupling is strongest
    window_edge: int = 6  # poles on each side of the edge of a window among which its widest gap is sought


SYSTEM = SystemTolerances()
