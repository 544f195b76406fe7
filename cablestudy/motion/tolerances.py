"""Numbers that bound errors, searches and sizes in `motion`, each with its reason."""


class MotionTolerances:
    """Tolerances of motion in the wind and under control: each is named by what it bounds."""

    __slots__ = ()  # nothing can be set on its object

    rounding: float = 1e-12  # least relative error of a share or a damping ratio due to rounding
    tiny: float = 1e-300  # in place of zero in a logarithm

    undamped_motion: float = 1e-12  # its damping ratio

    # --------------------------------------------------------------------------- modes of a body and their damping

    first_body_modes: int = 12  # modes that are computed at first for the mode of a body,
    most_body_modes: int = 400  # and at most
    light_damping: float = 0.02  # damping ratio up to which a pole is looked for from that without damping on,
    pole_distance: float = 0.5  # no farther than this times the damping ratio, since another mode may be near;
    # with stronger damping up to this relative distance: of 175 random poles none up to 1e-3 was that of another mode
    strongly_damped_pole_distance: float = 1e-4
    undamped_rounding: float = 1e-24  # damping ratio up to which it is rounding of a mode that nothing damps
    accuracy_factors: tuple = (1.0, 1e-2, 1e-4)  # accuracies of modes that are tried for a number, over that asked for
    next_mode: float = 1.1  # least frequency of modes above those computed, over that of a body's mode
    # share of a mode in a compliance over the largest one, from which on errors might make it the largest
    contending_share: float = 0.25
    equal_shares: float = 1e-6  # relative difference of two shares that are one: the lower mode is taken

    # -------------------------------------------------------- motion in the wind, with the loop or without

    model_modes: tuple = (64, 100, 160)  # modes of the models that are tried,
    plane_model_modes: tuple = (32, 64, 100)  # of a cable that moves in its plane only
    fewest_modes: tuple = (8, 4)  # before them, of few cables, so many and so many of each cable,
    few_modes: tuple = (16, 8)  # and then so many
    lacked_compliance: float = 1e-3  # share in the static compliance of bodies that these may lack,
    lacked_motion: float = 0.1  # and that any model may lack without responses to the inertia of the bodies
    # damping ratio of the first mode of a cable by air and viscous damping, from which on models have such responses:
    # below it RMS of a body between two strings were right to 1e-8 without them
    damped_cable: float = 0.3
    # share of the strain energy of a static response above which the mean drag that turns with it has responses, too
    turning_drag: float = 1e-3
    # where notches are at frequencies that those have not; the first one where those do not suffice for the accuracy,
    # unless damping is modal, and for tensions of a bare cable
    more_modes: tuple = (300, 600)
    # of a model with stated elements, where fewer change the RMS by more than the share
    element_modes: int = 250
    element_modes_change: float = 1e-9  # that share
    margin_safety: float = 2.0  # on the change of a margin by fewer modes, or of its loop gain by poles of cables
    # on the error of an RMS that one model shows, as far as the accuracy allows, and least
    one_model_safety: float = 4.0
    # share of the accuracy: of 220 numbers of random scenes ten were more wrong than shown, up to 2.3 times, or by
    # less than half of this share; one behind a PID law by 5.3e-3
    resolved: float = 1e-2
    # the same share where a model has the fewest modes: of 66 such models one was more wrong than 5e-3
    resolved_by_fewest: float = 0.2
    # of a displacement by the mean wind over the longest chord: what is less is shown as zero
    mean_wind_rounding: float = 1e-14
    fewer_modes: float = 0.7  # of the modes, with which the error by those left out is estimated
    dependent_response: float = 1e-10  # size of a static response over the largest, below which it is rounding
    # share of the kinetic energy of a mode in what outputs depend on, up to which it is rounding
    unseen_energy: float = 1e-16
    # frequency over the highest of a model, from which on its response is compared with that of all modes of the
    # cables,
    left_out_from: float = 0.9
    left_out_points: int = 100  # at so many frequencies besides those near resonances,
    # and at more where a logarithm of a response changes by more,
    left_out_change: float = 0.5
    left_out_rounds: int = 14  # up to so many times,
    left_out_step: float = 1e-7  # or down to this relative distance
    # change of a variance at most, over what a model has of it at high frequencies: where that is less than what is
    # stated at least, nothing is looked for. Of 114 random scenes three changes were 110, 74 and 16 times as large,
    # others 2 times at most
    left_out_change_at_most: float = 2e2
    # the same of one free displacement, over the shares of the modes of the cables in its mass, and over these times
    # shares over damping ratios (pi/8 where one mode resonates): of 1,124 changes in 320 random scenes none was above a
    # thirtieth of it, one of them 2,900
    left_out_change_of_one: tuple = (50.0, 4.0)
    # what a mode adds to a variance over the largest such number, below which it is left out
    left_out_share: float = 1e-6
    left_out_resonances: float = 1e-2  # and below which frequencies near it are not looked at to begin with
    left_out_small: float = 1e-6  # energy of an output over the largest, below which it counts as that much
    left_out_flank: float = 100.0  # what a peak may add over what its flank shows between two frequencies
    left_out_safety: float = 2.0  # on the changes that are found
    fixed_model_accuracy: float = 1e-4  # where the scene has a fixed model
    # on what the highest modes add to the variance of a tension, with gusts on cables, where what is left out falls
    # slowly, and without; and with them behind a law that does more than integrate. Of 400 tensions of random rods and
    # suspensions five were more wrong than without the second, of 18 suspensions with the last a fifth of it was enough
    tension_safety: tuple = (10.0, 3.0, 0.5)
    # error of variances of speed and acceleration of winches due to modes left out, which the highest do not show
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
    highest_frequency: float = 1e3  # and over the fastest of wind and lowest mode,
    moved_bodies: float = 0.1  # share of bodies in the energy of a mode in which they resonate:
    beyond_bodies: float = 10.0  # over the highest of these, of whose resonance 1e-8 lacks then,
    # and over the highest corner of loop and actuators: of an acceleration of a winch 1e-4 lacks
    beyond_corners: float = 30.0
    # largest relative error of a variance by a pole that lacks the right delay, over the loop gain there
    delayed_error: float = 4.0
    # least relative error of the rate at which a tension, or the speed of a winch behind a notch that passes high
    # frequencies hundreds of times larger, crosses its mean: motions above the model's modes count. Of tensions in
    # 90 random scenes with almost no damping five were more wrong, up to 0.38; then the rate states more itself
    crossings: float = 0.2

    # ------------------------------------------------------------- modes of cables that a loop could drive

    little_gain: float = 1e-6  # gain over the lowest frequency, of a loop whose gain follows from a margin
    unlimited_gain: float = 1e3  # up to which a loop that seems to have no limit is examined, over its lowest frequency
    gain_trials: int = 4  # of the gain that decides which modes of cables are looked at
    first_gain_safety: float = 3.0  # of the first one, over the largest gain to first order,
    element_gain_safety: float = 200.0  # or, of stated elements, all modes there, so far above it,
    # where that could drive at most so many half-waves along a cable: more cost more than a second trial
    first_gain_waves: int = 40
    single_mode_errors: float = 1.5  # multiples of frequencies up to which errors of the mesh are those of single modes
    all_modes_from: float = 1e-5  # accuracy from which on all modes are kept,
    vectors: int = 6  # vectors that represent others,
    worth: float = 0.7  # and share of the modes from which on these spare nothing
    # accuracy of the meshes that the gain needs, over that asked for: the stated errors of limits add up those of many
    # modes of the cables
    mesh_of_driven: float = 0.1
    resolved_waves: int = 300  # half-waves along a cable that are resolved,
    driven_modes_of_cable: int = 1600  # and its modes that are computed
    resolution_trials: int = 5  # of the frequency up to which waves across the cables are resolved,
    resolved_beyond: float = 1.2  # over that of the pole,
    # and ratio of gains up to which finer elements may change which of two poles crosses first
    limit_of_finer: float = 1.25
    largest_gain_safety: float = 2.0  # on the change of the largest gain
    # error of a response in time over its change by twice as many approximants of a delay: 2.1 at a corner. N of them,
    # of order [8/8], are right up to a frequency as N^(16/17), and a corner is wrong by its inverse
    more_approximants: float = 2.5
    # relative distance of frequencies about one that decides a margin, by which it changes with the model
    margin_window: float = 0.2
    # frequency of a mode over the highest resolved one, from which its pole may lie above that
    may_be_above: float = 0.5
    hardly_damped_gain: float = 0.9  # gain over the largest from which the pole that would grow first may decide
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
    least_drag_points: int = 33  # along a cable, of the least wind on it: a sag of a tenth between them is 1e-4 of it
    # frequency up to which modes of a cable are kept that damping couples, over the highest one that the gain could
    # drive and over that up to which waves are resolved;
    kept_multiples: tuple = (4.0, 2.0)
    coarser_share: float = 0.5  # share of it with which the error by the others is estimated,
    # which is this at least (3e-7 in 100 random scenes; poles in windows change a largest gain by 5e-7 at most in 45)
    by_other_modes: float = 1e-6
    narrow_resonance: float = 1e-5  # distance to a pole over the frequency, below which errors of sums over poles count


MOTION = MotionTolerances()
