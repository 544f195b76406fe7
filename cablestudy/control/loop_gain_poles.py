"""Poles, without gain, of the equations of many loop gains: of modes of single cables, and of narrow resonances.

In the notation of `control.loop_gain`, Z(s) is singular at a pole. A mode of one cable between fixed ends, of frequency
W, has its pole with the bodies free near that of

    s^2 + c s + W^2 = s^4 w^T Z_r^-1 w,    w = G^T m,

Z_r being Z without this mode, c twice its decay rate between fixed ends and m its coupling to the displacements of the
ends. A gain g moves the pole by -g X/(2 s) to first order, with

    X = s^4 (w^T Z_r^-1 F + m^T H) A C1 N P Z_r^-1 w.
"""

import numpy as np

from cablestudy.cable.matrices import solved
from cablestudy.control.curves import eigenvalues
from cablestudy.control.loop_gain import LoopGain
from cablestudy.control.notch import NotchedLaw
from cablestudy.control.tolerances import CONTROL
from cablestudy.system.together import batches


def poles_of_modes(loop_gains, modes):
    """Estimate the poles that modes of single cables have with the bodies free, and the shift of each pole per gain.

    The poles show which modes a gain could make unstable, and where the loop gain has peaks.

    Parameters
    ----------
    loop_gains : list of LoopGain
        One for each suspension; the same object may appear several times.
    modes : list of (list of ndarray of int)
        For each loop gain and each of its cables, indices of modes with fixed ends, from 0.

    Returns
    -------
    list of (poles, shifts), complex ndarrays of shape (n,)
        For each loop gain and its n modes, one cable after the other: the poles s without gain [rad/s], and the change
        of s per gain to first order, -X/(2 s) [-]. NaN where Z_r is singular.

    Notes
    -----
    A mode with the frequency W and the decay rate c/2 between fixed ends has a pole at the solution s of

        s^2 + c s + W^2 = W^4 w^T Z_r^-1 w.

    Z_r is the dynamic stiffness of the bodies and all cables without this mode, w the coupling of the mode to the
    bodies; the module's docstring defines X. Z_r and X are computed once, at an s near i W: at i W the resonance of
    the mode dominates, and subtracting it would leave little of Z_r but rounding.
    """
    found = [None] * len(loop_gains)
    for indices, members in _batches(loop_gains, range(len(loop_gains))):
        by_row = [_arrays_of_modes(loop_gain, modes[index]) for index, loop_gain in zip(indices, members, strict=True)]
        counts = [len(arrays[0]) for arrays in by_row]
        omega, decay, w, by_winches = (np.concatenate(arrays) for arrays in zip(*by_row, strict=True))
        row, blocks = np.repeat(np.arange(len(members)), counts), [np.zeros((2, 0))]
        for begin in range(0, len(omega), CONTROL.modes_at_once):  # whose matrices stay in the processor's cache
            part = slice(begin, begin + CONTROL.modes_at_once)
            blocks.append(_terms_of_poles(members, row[part], omega[part], decay[part], w[part], by_winches[part]))
        without_gain, per_gain = np.concatenate(blocks, axis=1) * omega**4  # W^4 w^T Z_r^-1 w, and X
        # s^2 + c s + W^2 = W^4 w^T Z_r^-1 w, c = 2 decay
        poles = -decay + 1j * np.sqrt(omega**2 - without_gain - decay**2)
        edges = np.cumsum(counts)[:-1]
        of_rows = zip(np.split(poles, edges), np.split(-per_gain / (2 * poles), edges), strict=True)
        for index, of_row in zip(indices, of_rows, strict=True):
            found[index] = of_row
    return found


def _batches(loop_gains, rows):
    """Those of some rows whose poles are found together: pairs of lists, their numbers and loop gains (generator)."""
    of_batches = batches(rows, lambda row: loop_gains[row].signature, lambda row: len(loop_gains[row].bodies))
    for indices in of_batches:
        members = [loop_gains[index] for index in indices]
        for loop_gain in members:  # whoever asks for poles asks for the loop gain near them next
            loop_gain.find_pole_sums()
        yield indices, members


def _arrays_of_modes(loop_gain, modes):
    """Frequency and decay of chosen modes of each cable, shape (n,), w and H^T m, shapes (n, d) and (n, i): four."""
    of_cables, by_cable = zip(loop_gain.elements, loop_gain.connection, loop_gain.reeling, modes, strict=True), []
    for element, connection, reeling, chosen in of_cables:  # G, H
        coupling = element.coupling[chosen]  # m
        by_cable.append((element.omega[chosen], element.decay[chosen], coupling @ connection, coupling @ reeling))
    return tuple(np.concatenate(arrays) for arrays in zip(*by_cable, strict=True))


def _terms_of_poles(loop_gains, row, omega, decay, w, by_winches):
    """Terms w^T Z_r^-1 w and X/W^4 of n modes of single cables, see the module's docstring: shape (2, n).

    The arrays have n rows, one per mode: `row` is the number of its loop gain, ascending; the others are from
    `_arrays_of_modes`.
    """
    aside = CONTROL.half_widths_aside * np.maximum(decay, CONTROL.least_half_width * omega)
    s, rate = 1j * (omega + aside), 2 * decay  # near i W, and c
    stiffness, winch_forces = LoopGain.stiffness_and_forces(loop_gains, row, s)  # Z and F
    of_mode_alone = s**4 / (omega**2 + s * (s + rate))
    without_mode = stiffness + of_mode_alone[:, None, None] * w[:, :, None] * w[:, None, :]  # Z_r
    displacements = solved(without_mode, w[..., None] + 0j)  # Z_r^-1 w
    excitation = (np.swapaxes(displacements, 1, 2) @ winch_forces)[:, 0] + by_winches
    measured = np.array([loop_gain.measured for loop_gain in loop_gains])[row]  # P
    allocation = np.array([loop_gain.allocation for loop_gain in loop_gains])[row]  # A
    controller = NotchedLaw.of_rows([one.controller for one in loop_gains], row, s)
    winch_movement = (allocation @ (controller[..., None] * (measured @ displacements)))[..., 0]
    return np.stack([(w * displacements[..., 0]).sum(axis=-1), (excitation * winch_movement).sum(axis=-1)])


def narrow_poles(loop_gains, estimates, starts, errors):
    """Find poles, without gain, whose resonances are narrower than the errors of their estimates.

    A loop gain has a resonance about as wide as the decay of its pole. Frequencies near an estimate of the pole miss
    it if the estimate is off by more than this width.

    Parameters
    ----------
    loop_gains : list of LoopGain
    estimates : list of ndarray, complex, shape (n,)
        Estimated poles of each loop gain. [rad/s]
    starts : list of ndarray, complex, shape (m,)
        Points from which the search for poles of each starts: the estimates, and others. [rad/s]
    errors : list of ndarray, shape (m,)
        Relative error of each start. A start s is used only if |Re s|/|s| is smaller. [-]

    Returns
    -------
    list of ndarray, complex, shape (k,)
        New poles of each loop gain. A pole s is new if its distance from all estimates and from all poles found before
        exceeds |Re s|, half the width of its resonance. [rad/s]

    Notes
    -----
    With the dynamic stiffness Z(s) of the bodies and cables, the steps d from s to near poles are eigenvalues of
    Z x = -d Z' x to first order. Newton's method follows.
    """
    found, searches = [poles[:0] for poles in estimates], {}  # index of a loop gain -> starts, and their errors
    for index, (loop_gain, s, error) in enumerate(zip(loop_gains, starts, errors, strict=True)):
        narrow = (np.abs(s.real) < error * np.abs(s)) & (s.imag > 0)
        if narrow.any() and len(loop_gain.bodies):
            searches[index] = s[narrow], error[narrow]
    for indices, members in _batches(loop_gains, searches):
        for _ in range(2):  # from a pole that is known others that nearly coincide with it are seen apart
            s = np.concatenate([searches[index][0] for index in indices])
            error = np.concatenate([searches[index][1] for index in indices])
            row = np.repeat(np.arange(len(members)), [len(searches[index][0]) for index in indices])
            if not len(row):
                break
            row, s, error = _narrow_poles(members, row, s, error)
            for number, index in enumerate(indices):
                poles, errors_of_poles = s[row == number], error[row == number]
                new = _apart(np.append(estimates[index], found[index]), poles)
                found[index] = np.append(found[index], poles[new])
                searches[index] = poles[new], errors_of_poles[new]
    return found


def _apart(known, poles):
    """Which of some poles are farther from those known, and from those before, than half a resonance's width: list."""
    apart = []
    for number, pole in enumerate(poles.tolist()):
        if np.abs(known - pole).min() > abs(pole.real):
            known = np.append(known, pole)
            apart.append(number)
    return apart


def _narrow_poles(loop_gains, row, s, error):
    """Poles, decaying, that are closer to s of some loop gains than relative errors of these.

    `row`, `s` and `error` have shape (n,), `row` ascending; these three are returned for the poles.
    """
    known, step = _steps_to_poles(loop_gains, row, s)
    row, s, error = row[known], s[known], error[known]
    index, which = np.nonzero(np.abs(step) < (error * np.abs(s))[:, None])
    row, s, error = row[index], s[index] + step[index, which], error[index]
    for _ in range(CONTROL.narrow_pole_steps):
        known, step = _steps_to_poles(loop_gains, row, s)
        row, s, error = row[known], s[known], error[known]
        step = np.take_along_axis(step, np.abs(step).argmin(axis=1)[:, None], axis=1)[:, 0]
        s = s + step
    narrow = (np.abs(step) < np.abs(s.real) / 2) & (s.real < 0)
    return row[narrow], s[narrow], error[narrow]


@np.errstate(all="ignore")  # what is not finite is left out
def _steps_to_poles(loop_gains, row, s):
    """At which of some s, shape (n,), Z is known; steps from these to poles, to first order, shape (m, d)."""
    apart = np.abs(s.real) + CONTROL.least_half_width * np.abs(s)
    both = LoopGain.stiffness_and_forces(loop_gains, np.repeat(row, 2), np.stack([s, s + apart], axis=1).ravel())[0]
    stiffness, shifted = both[::2], both[1::2]
    step = solved((shifted - stiffness) / apart[:, None, None], -stiffness)
    known = np.isfinite(step).all(axis=(1, 2))
    return known, eigenvalues(step[known])
