"""Numbers that bound errors, searches and sizes in `cable`, each with its reason."""


class CableTolerances:
    """Tolerances of one cable: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # -------------------------------------------------------------------------------------------- catenary

    horizontal_tension_points: int = 40  # on each segment, for the mean horizontal tension of a cable in a steady wind
    folded: float = 1e-12  # share of the largest tension below which a cable counts as folded
    # the same for the end stiffness of a vertical cable, which falls only as 1/log of the least tension
    folded_vertical: float = 1e-50
    # relative size of the last step up to which a tension counts as found: the error is about its square
    last_tension_step: float = 1e-8

    # ------------------------------------------------------------------------ drag that varies along a cable

    # a relative error that says no more than that nothing is known; no number larger is stated
    unknown_error: float = 1e30
    second_order: float = 1.2  # safety factor on an error that is computed to first order, or by a short search
    slack: float = 1e-60  # share of the largest tension below which a cable is slack: no quotient by it overflows
    drag_turns: int = 16  # at most, of the search for the drag on some number of parts of a cable
    # those of cables that these do not settle, and the share of the change of drag that each of them takes: the drag on
    # a slack cable swings to and fro, the less the smaller this share
    further_drag_turns: tuple = ((40, 0.7), (120, 0.3))
    settled_turn: float = 1e-11  # of tension and form, relative: what is left to change where that search ends
    fastest_turns: float = 0.01  # factors by which the change falls from turn to turn: no less is believed,
    slowest_turns: float = 0.9  # and with more than this what is left has no bound
    # error over the change against half as many parts: a polynomial of six points has an error of the sixth power
    finer_parts: float = 2.0**-6
    settled_form: float = 1e-8  # share of the change by actual drag that the last step of the search changes
    # of a change by actual drag: what the last step of a search for it changes, and what is left out of balance
    settled_drag: float = 0.01
    known_drag: float = 0.05  # of the change of a cable after all turns: where more is left nothing is known
    no_drag: float = 1e-8  # of the tension, and of the length: a change due to drag that is as small need not settle

    # ---------------------------------------------------------------------------------- modes of one cable

    dense_freedoms: int = 150  # degrees of freedom up to which a full eigen-solution is cheaper than Lanczos
    all_modes_freedoms: int = 3000  # degrees of freedom up to which all modes can be computed
    first_modes: int = 16  # modes computed first where the number needed is unknown
    lanczos_numbers: int = 10_000_000  # numbers in the basis of a Lanczos iteration: 80 MB, and some 20 s for 600 modes
    cheap_freedoms: int = 200  # degrees of freedom up to which all modes cost little more than a few
    orders_per_half_wave: float = 1.7  # order of an element from which its error falls exponentially: above pi/2
    shortest_piece: float = 1e-9  # share of the length: shorter pieces are not divided
    merged_loads: float = 1e-11  # share of the length: loads closer than this to each other, or to an end, share a node
    # overlap with the mirrored shape from which a mode counts as symmetric: nine tenths of its energy
    symmetric_overlap: float = 0.8
    # relative distance of frequencies below which the shapes of an eigen-solution are arbitrary
    coincident_modes: float = 1e-12
    lowest_frequency: float = 4e-16  # relative rounding error of the lowest frequency; it grows with the frequency
    cached_basis_freedoms: int = 200  # free displacements up to which bases are cached

    # ------------------------------------------------------------------ equilibrium and unstretched length

    tiny: float = 1e-300  # in place of zero in a denominator
    uneven_load_steps: int = 60  # largest number of equilibria until a load that depends on them agrees with them
    uneven_load_change: float = 1e-13  # change of such a load, over the largest tension, below which it agrees
    distance_rounding: float = 1e-13  # relative to the chord: shorter distances are rounding
    upright_chord: float = 1e-9  # horizontal distance of the ends over the chord, up to which a chord is upright
    level_chord: float = 1e-12  # component of the direction of a chord: what is less is zero except for rounding
    coincident_loads: float = 1e-9  # share of the length within which point loads coincide
    # search for the chord strain with which a cable has a tension or a sag
    length_steps: int = 120  # within a bracket
    near_guess_steps: int = 100  # first steps of a search on either side of the guess: beyond, all strains are searched
    length_brackets: int = 16  # halvings of the distance to a limit in the search for a bracket
    length_secants: int = 6  # steps of the secant method,
    length_first_secant: float = 1e-6  # the first one over the guess,
    length_last_step: float = 4e-16  # and the last one over the strain
    length_zero: float = 4e-16  # value of the function that is as good as zero
    mean_tension_rounding: float = 1e-12  # relative error of a mean tension due to rounding
    loosest_strain: float = 1 / 1000 - 1  # chord strain of a cable a thousand chords long,
    tautest_strain: float = 1e3  # and of one that is stretched to a thousand times its length
    linear_difference: float = 0.05  # relative difference of the restoring force from its linear part
    least_movement: float = 1e-7  # least movement that is looked at, over the shortest chord,
    largest_movement: float = 0.9  # and the largest one
    # movements that are looked at first in drag that follows the cables; without, twice as many
    movements_at_once: int = 40
    # the least and the largest of them, over the range in drag that is a dead load
    near_range: tuple = (2.0**-8, 4.0)
    # of the movement: what is found as near to it counts for its error, also that beyond it nothing is found
    beyond_limit: float = 1e-6
    last_interval: float = 2e-12  # where the force ceases to be linear, over the movement
    movement_rounding: float = 4e-14  # of a change of force over the tension, and of moved ends over the chord
    midspan_steps: int = 80  # bisection alone needs 53
    newton_steps: int = 60  # corrections of a catenary
    newton_halvings: int = 40  # of one of them
    still_moving: float = 0.5  # share of the cables that a step moves, below which the others are left out of the next,
    many_cables: int = 100  # of so many at least
    whole_correction: float = 1e-12  # corrections below it are taken whole: the slope along them is rounding
    # beta below which the series, above it the closed forms: both are exact to rounding there
    series_below: float = 0.15
    least_divisor: float = 1e-290  # in place of zero in a denominator

    # ----------------------------------------------------------------------- drag and stress-strain curves

    pressure_step: float = 1e-3  # by which points move for the gradient of the pressure of a wind [m]
    drag_points: int = 9  # along a cable, of the mean pressure of a wind that grows with the height
    # between two loads, and on each side of mid-length, at which the drag there is compared with the uniform one
    drag_points_of_piece: int = 6
    curve_steps: int = 100  # of the search for a tension on a curve
    curve_tension: float = 1e-12  # relative error of that tension
    curve_rounding: float = 4e-16  # rounding of one number

    # ------------------------------------------------------------------------------ matrices

    loss_rounding: float = 1e-13  # asymmetry, or negative eigenvalue, of a damping matrix over its largest entry
    massless: float = 1e-28  # compliance over the largest, below which a motion has no mass


CABLE = CableTolerances()
