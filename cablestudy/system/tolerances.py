"""Numbers that bound errors, searches and sizes in `system`, each with its reason."""


class SystemTolerances:
    """Tolerances of suspensions in motion: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    # ------------------------------------------------ rows that are computed together

    entries_at_once: int = 1_000_000  # of the square matrices of all rows of one call

    # ------------------------------------------------------------- meshes and coordinates of coupled modes

    modes_of_cable: int = 600  # at most
    highest_order: int = 44  # of an element of a suspension's cable
    dependent_residual: float = 1e-12  # size of a residual vector over the largest, below which rounding determines it
    left_by_modes: float = 1e-11  # size of what the modes leave of a vector, over its own, below which it is rounding
    dependent_unit: float = 1e-8  # mass of a combination of unit vectors, below which rounding determines it
    massless_amplitude: float = 1e150  # of a coordinate without mass, in place of an infinite one
    uncoupled_entry: float = 1e-12  # of the size of two coordinates, up to which what couples them is rounding
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
    frequency_rounding: float = 1e-12  # error of a frequency due to rounding, at least
    stiffness_rounding: float = 2e-15  # error of the stiffness of a cable's ends by rounding, over its entries
    # modes that the other model needs beyond those asked for: the partner of the highest may be among them
    modes_beyond: int = 8

    # -------------------------------------------------------------------- linear system, poles and damping

    dense_coordinates: int = 300  # up to which a full eigen-solution costs less than Lanczos iteration
    response_entries: int = 4_000_000  # of the matrices that are solved at once for a frequency response: 64 MB
    # momentum of a mode of unit mass over the root of a body's mass, up to which it is rounding
    uncoupled_momentum: float = 1e-12
    pole_steps: int = 30  # iterations
    dense_numbers: int = 60_000  # in the matrices of cables that are solved at once: a processor's cache holds them
    pole_change: float = 1e-12  # relative change of a pole, of the size of its rounding
    known_pole_distance: float = 0.1  # relative distance from a known pole, from which on it is another one
    # relative distance from a pole of the model of the modes, from which on it may belong to another mode
    paired_pole_distance: float = 0.02
    damping_rounding: float = 1e-14  # error of a damping ratio due to rounding of the motion that loses energy
    # displacements of a cable all of whose modes are computed for a damped pole: half a second
    damped_pole_freedoms: int = 1200
    coarser_mesh_safety: float = 3.0  # on the change of a damping ratio from coarser meshes, where it falls slowly
    dependent_ritz: float = 1e-10  # size of a vector over the largest, below which rounding determines it
    # product of two modes above which they are not orthogonal: of some that coincide not all were asked for
    not_orthogonal: float = 1e-6
    coupled_modes: int = 40  # modes above those asked for that damping may couple to them
    # share of a mode in the motion of a pole, below which a mode damped above critical does not oscillate
    oscillating_share: float = 0.5
    uncorrected: float = 1e-3  # singular value of the static gain over the largest, below which a pose is not corrected
    dependent_shares: float = 1e5  # sum of the sizes of the shares of all states in a pole,
    singular_inverse: float = 1e12  # and entry of V^-1, above which A has almost no eigenvectors
    # states of a closed loop from which on its poles are found from those with the winches at rest,
    closed_loop_states: int = 60
    # in so many steps: usual loops take three, those of gains up to the largest one seven, some near it ten,
    closed_pole_steps: int = 12
    # unless a step moves a pole by more than this share of its size: some gains above the largest one do,
    closed_pole_shift: float = 0.3
    closed_pole_change: float = 1e-8  # and relative change of a pole in a step after which it has all digits
    secant_slope: float = 0.3  # slope, about 1, up to which a step of the secant method is not sure of itself
    # residual of an eigenvector over the largest entries of it and of the matrix: rounding leaves 1e-14
    closed_pole_residual: float = 1e-12
    sharp: float = 0.35  # damping ratio below which a pole makes a response sharp over frequency
    # highest frequency above which other poles are taken, over that up to which the first ones are good: approximants
    # of a delay, whose phase is accurate to 1e-7 there, are so to 4e-5 at 1.4 times it
    gap: float = 1.4
    moved_apart: float = 1e-9  # change of poles that coincide then, over their size
    coincident_poles: float = 1e-3  # relative distance of poles up to which they may be one: four of them, by rounding
    # least singular value of the unit eigenvectors of these, below which they are next to parallel
    parallel_vectors: float = 1e-3
    circle_radius: float = 0.3  # of a circle about these, over the distance of the next pole
    many_modes: int = 100  # single modes among combinations from which on they are looked for
    # frequencies for which the modes are summed in one call: arrays that stay in the processor's cache
    frequency_block: int = 128

    # ----------------------------------------------------------- damping that couples the modes of a cable

    # difference between the sum over poles and the forces it represents, up to which the sum is used
    trusted: float = 1e-11
    # the same of poles found in windows: nine cables of a balloon leave up to 6e-7; a cable whose damping couples
    # modes over more than windows are wide leaves 2e-6, and 1.5e-4 of its largest gain
    trusted_windows: float = 7e-7
    windows_from: int = 150  # modes from which on windows are faster than one eigenvalue problem
    # loss factor at the lowest mode from which rounding spoils what damped strain leaves
    ill_conditioned_loss: float = 1e6
    solvent_steps: int = 20  # of the iteration for half of the poles of a cable, which takes seven of a usual one
    solved_frequencies: int = 16  # frequencies up to which solving at each is cheaper than finding the poles
    systems_at_once: int = 64  # systems of equations that are solved in one call
    window: int = 60  # poles of a window,
    window_margin: int = 20  # and those on each side of it of which the modes are in its eigenvalue problem
    lowest_window: int = 3  # the lowest window is so many times as wide: there coupling is strongest
    window_edge: int = 6  # poles on each side of the edge of a window among which its widest gap is sought


SYSTEM = SystemTolerances()
