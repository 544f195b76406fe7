"""Numbers that bound errors, searches and sizes in `statics`, each with its reason."""


class StaticsTolerances:
    """Tolerances of suspensions at rest: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

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
    # rotation of a body about the dead moment on it in one search [rad]: what has turned round twice is not held
    most_turned: float = 12.6
    # change of a tension over its size, up to which the stiffness foretells it well enough to begin a search from there
    predicted_change: float = 0.3
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
    held_rotation: float = 1e-13  # about an axis about which a body is held, that is none [rad],
    held_searches: int = 40  # searches until there is none,
    # and rotation of a body [rad] up to which they end: each leaves the share tan^2(a/2) of a rotation a, 0.3 here
    held_turn: float = 1.0
    softened: tuple = (0.3, 0.03, 1e-3, 1e-5, 1e-8)  # strains of cables that a search goes by
    little_weight: float = 1e-6  # weight of a cable over the tensions, which a search goes by
    error_in_step: float = 10.0  # relative error that a step shall take away at most
    # distance that a failed search with softer cables has gone, over the suspension's extent, up to which the next one
    # begins where it ended
    farthest_softened: float = 100.0
    length_change: float = 0.3  # change of an unstretched length in one step, over the length
    # steps off a saddle: rotation [rad], or share of the extent of the suspension
    off_saddle: tuple = (0.1, -0.1, 0.3, -0.3)
    coincident_link_ends: float = 1e-9  # distance of the ends of a link, over the longest of any two ends, that is none
    added_stiffness: float = 1e-14  # added to the diagonal of the scaled stiffness
    nearest_link_ends: float = 1e-9  # of the length: ends closer than this are taken as this far apart in F/d
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
    # relative change up to which balanced tensions are an answer: the best ones except for its stated error
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
    # weight of the tensions themselves over that of their deviations from the mean: the smaller of equals
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
    stayed: float = 1e-9  # movement from the described position, over the longest cable, that is none
    unknown: float = 1e30  # in place of what is not finite


STATICS = StaticsTolerances()
