"""The cheapest model whose error is below an accuracy: elements about the closed form, refined until little is left."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, inf, log10

from cablestudy.errors import ConvergenceError, NoSolutionError
from cablestudy.study.columns import ROUNDING

LOWEST, HIGHEST = 3, 48  # orders of an element
FINEST = 380  # orders of the elements of a smooth piece, all together
MOST = 12000  # unknowns beyond which the search ends
DENSE = 2000  # the same where a large share of the modes is needed: with damping, or with more than MANY waves
MANY = 100  # half-waves beyond which the search may end before its first model
IN_VAIN, LOST = 2, 1e-5  # models without gain after which the search ends, where errors are below the latter: rounding
GROWTH = 1.3
TRIALS = 6  # models without an answer, one after the other, until there is none
PER_WAVE, MARGIN = 1.7, 3  # orders for each half-wave, and besides, from which the error falls fast
# orders for each digit more, and besides: where models are compared, and where one tells its error
COMPARED, ALONE = (0.9, 1.0), (1.0, 0.75)
UNSEEN = 10  # error over the angle by which the cable turns, where its transverse waves are not resolved
NOISE = 1e-8  # difference below which rounding may hide how the error falls
# of the difference of two neighbours, both resolved, at least the error of the finer one is:
GRAIN = 1e-10  # rounding of what many modes make together, which neighbours may share
FLAT, NOISY = 1.0, 3.0  # above NOISE and below it
SAFETY, LEAST = 10, 0.03  # of the error that is left, held against random scenes by tests/test_extremes.py


def rungs(first):
    """Yield (elements for each smooth piece, order), finer and finer.

    Parameters
    ----------
    first : float
        About how many orders there should be in all to begin with.
    """
    total = min(max(ceil(first), LOWEST), FINEST)
    while True:
        elements = ceil(total / (HIGHEST - 4))
        order = ceil(total / elements)
        for more in (0, 2, 4):  # an odd step may leave the symmetric shapes as they are
            yield elements, order + more
        if total >= FINEST:
            return
        total = min(ceil(GROWTH * elements * (order + 4)), FINEST)


def resolving(waves):
    """Orders from which so many half-waves along a piece are resolved."""
    return PER_WAVE * waves + MARGIN


@dataclass(frozen=True)
class Feeling:
    """What numbers feel of a cable's motion.

    Attributes
    ----------
    waves : float
        About how many transverse half-waves along the cable, to begin with.
    highest : callable
        Case, values -> highest frequency. [Hz]
    surely : callable
        Case -> a frequency that is felt in any case, known before the numbers; 0 for none. [Hz]
    damped : bool
        Whether the damping matters: two models may share its rounding, so that three are compared.
    alone : bool
        Whether one model tells the errors of all numbers by itself.
    """

    waves: float
    highest: Callable
    surely: Callable = lambda case: 0.0
    damped: bool = False
    alone: bool = False


def felt_by(case, wanted):
    """What columns that need motion feel of a case.

    Parameters
    ----------
    case : Case
    wanted : Wanted
        With at least one such column.

    Returns
    -------
    Feeling
    """
    waves, axial, body = wanted.waves, wanted.axial, wanted.body
    if wanted.sagging > waves:
        waves = max(waves, min(wanted.sagging, case.batch.sagging_of(case.place)))
    if axial and UNSEEN * case.refined(1, LOWEST).waves(0.0)[1] > case.scene.model.accuracy:
        waves = max(waves, axial * case.axial_waves)  # a cable that turns moves across beside them
    if body:
        waves = max(waves, 2 * case.gondola_frequency_static * case.travel_time)

    def highest(other, values):
        found = max((values[name] for name in wanted.named), default=0.0)
        return max(found, other.gondola_frequency) if body else found

    def surely(other):
        # half of k c/(2 L): what lies beside an axial mode shifts it
        alone = axial * case.axial_waves / (4 * case.travel_time) if axial else 0.0
        return max(alone, other.gondola_frequency) if body else alone

    return Feeling(waves, highest, surely, wanted.damped, not body)


def climb(case, sample, feeling):
    """Refine a model until the error left is below the accuracy of its scene.

    A generator: yields each model before it is used, so that it can be solved together with those of other cases.

    Parameters
    ----------
    case : Case
    sample : callable
        Case -> dict of numbers, and dict of the relative errors of those whose errors one model tells by itself.
    feeling : Feeling

    Returns
    -------
    case : Case
        The finest that was needed.
    values, errors : dict
        The numbers and their estimated relative errors.
    tried : int
        How many models it took.

    Raises
    ------
    ConvergenceError
        The accuracy cannot be had; the message says which was reached.
    NoSolutionError
        There is no such number.

    Notes
    -----
    A frequency of the cable has an estimate of its own, by what the highest orders contribute to its shape. For other
    numbers several models are needed: of three neighbours the differences d1 and d2 tell how fast the error falls with
    the order, and so what is left:
    d2 (d2/d1)^(step/last step), times SAFETY, at least LEAST of d2. Two suffice where the waves are resolved, nothing
    is damped, and their difference, or a few times it, is little enough. A model that does not resolve the
    transverse waves at a frequency agrees with its neighbours on a number that ignores them: where the cable turns by
    an angle, they may be wrong by UNSEEN times as much.
    """
    accuracy = case.scene.model.accuracy
    history, failures, last, tried = [], [], 0.0, 0

    def waves_at(finer, frequency):
        """Error by transverse waves that are not resolved, 0 where they are; and how many half-waves there are."""
        if not frequency:
            return 0.0, 0.0
        waves, turn = finer.waves(frequency)
        return UNSEEN * turn if resolving(waves) > finer.rung[0] * finer.rung[1] else 0.0, waves

    needed, rounding = 0.0, case.batch.rounding_of(case.place)
    reached, best, in_vain = "the finest model is too coarse", inf, 0
    longest = case.batch.longest_of(case.place)
    per_digit, more = ALONE if feeling.alone else COMPARED
    orders, besides, several = PER_WAVE * feeling.waves * longest, per_digit * -log10(accuracy) + more, 1
    if feeling.alone:  # each element needs its digits; models that are compared may begin coarse
        several = max(1, ceil(orders / max(HIGHEST - 4 - besides, 1)))
    for rung in rungs(orders + several * besides):
        if rung[0] * rung[1] < needed:
            continue
        finer = case.refined(*rung)
        yield finer
        tried += 1
        many = feeling.waves > MANY
        if (history or many) and finer.felt.dof > (DENSE if many or feeling.damped else MOST):
            reached = f"about {feeling.waves:.3g} waves along the cable, and {finer.felt.dof} unknowns, are too many"
            break
        try:
            # where the waves are surely not resolved, nothing needs a further look
            unseen, waves = waves_at(finer, feeling.surely(finer))
            values, known_errors = sample(finer) if unseen <= accuracy else (None, None)
            if values is not None:
                unseen, waves = waves_at(finer, feeling.highest(finer, values))
        except (ConvergenceError, NoSolutionError) as problem:  # a finer one may have the mode that a coarse one lacks
            again = failures and str(failures[-1]) == str(problem)
            failures.append(problem)
            if again or len(failures) > TRIALS:
                break
            continue
        failures.clear()
        known, last = abs(waves - last) < 0.1 * last, waves
        if unseen > accuracy:  # no model that is much too coarse for these waves is looked at
            needed = min(resolving(waves), FINEST)
        if unseen > accuracy and known and resolving(waves) > FINEST:
            raise ConvergenceError(
                f"accuracy {accuracy:g} cannot be had: more waves along a piece of the cable "
                f"than the {(FINEST - MARGIN) / PER_WAVE:.0f} that the finest model resolves"
            )
        if unseen > accuracy or (history and history[-1][1].keys() != values.keys()):
            history = []  # it says nothing of how the error falls
        if unseen > accuracy:
            continue
        history.append((rung[0] * rung[1], values))
        rest = {name: known_errors.get(name) for name in values}
        left = left_of_three if len(history) > 2 else None
        if len(history) == 2 and not feeling.damped and not unseen:
            left = left_of_two
        if left:
            least = max(GRAIN, finer.omitted)
            rest.update({name: max(least, left(history[-3:], name)) for name, share in rest.items() if share is None})
        if None not in rest.values():
            errors = {name: max(rounding, unseen, share) for name, share in rest.items()}
            error = max(errors.values(), default=ROUNDING)
            if error <= accuracy:
                return finer, values, errors, tried
            reached = f"the error reached is about {min(error, best):.1e}"
            best, in_vain = min(error, best), in_vain + 1 if best <= error < LOST else 0
            if in_vain == IN_VAIN:
                break
    if failures and not history:
        raise failures[-1]
    raise ConvergenceError(f"accuracy {accuracy:g} cannot be had: {reached}")


def left_of_two(history, name):
    """Relative error that is left in the second of two values, where its waves are resolved."""
    (_, before), (_, last) = history
    difference = relative(last[name], before[name])
    return difference * (FLAT if difference > NOISE else NOISY)


def left_of_three(history, name):
    """Relative error that is left in the last of three values: by how their differences fall, where they do."""
    orders, values = zip(*((order, values[name]) for order, values in history), strict=True)
    last, before = relative(values[2], values[1]), relative(values[1], values[0])
    if last < ROUNDING or None in values or not last < before < 0.1:
        return last if last < ROUNDING or before > last else SAFETY * last
    rest = (last / before) ** ((orders[2] - orders[1]) / (orders[1] - orders[0]))
    return last * max(SAFETY * rest, LEAST if last > NOISE else 1.0)


def relative(value, reference):
    """Relative difference; 1 where only one of the two is there."""
    if value is None or reference is None:
        return float(value is not reference)
    return abs(value - reference) / abs(reference) if reference else float(value != reference)
