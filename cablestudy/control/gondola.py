"""The gondola on end 2 of its cable, free along x: undamped frequencies, and which of them is the gondola's."""

import numpy as np

from cablestudy.system.linear import LinearSystem, assemble
from cablestudy.system.superelement import GONDOLA

NEGLIGIBLE = 1e-10  # p/W^2, relative to the largest, below which a mode and the gondola do not move each other
ROUNDING = 2e-14  # of a moment of inertia: what is left of it below is rounding
CLOSE = 1e-8  # relative change of a squared frequency that is a correction of rounding
EXCITED = 1e-9  # m, relative to the largest, below which a mode does not move with the gondola
LARGE = 0.3  # of the largest share in the gondola's static compliance
SECANT_STEPS = 30
NEAR = 0.05  # rate of decay over frequency up to which a pole near the undamped one is that of the gondola
TIE = 1e-6  # relative difference of two shares that are one: the lower mode is the gondola's


def static_frequency(mass, stiffness):
    """Frequency of a mass on the static end stiffness.

    Parameters
    ----------
    mass : float or ndarray
        [kg]
    stiffness : float or ndarray
        Static end stiffness along x, >= 0. [N/m]

    Returns
    -------
    float or ndarray
        sqrt(k/M)/(2 pi): what the paper's tables call the gondola frequency. [Hz]
    """
    return np.sqrt(stiffness / mass) / (2 * np.pi)


def coupled_modes(mass, stiffness, frequency, participation, moments):
    """Undamped modes of a gondola and its cable together.

    Parameters
    ----------
    mass : float
        Of the gondola. [kg]
    stiffness : float
        Static end stiffness along x. [N/m]
    frequency, participation : ndarray, shape (n,)
        Of the cable with fixed ends [Hz]; psi^T K21 e_x [N/(m sqrt(kg))].
    moments : ndarray, shape (3,)
        s_0 [kg], s_1 [kg s^2], s_2 [kg s^4] of the whole cable moving with its end, of which mode k is the share
        p^2/W^(4 + 2 j). See `Ends.moments`.

    Returns
    -------
    frequency, share : ndarray, shape (m,)
        Ascending, m <= n + 2: modes that do not move with the gondola are left out [Hz]; the share of each in the
        static compliance of the gondola, phi^2/w^2 over 1/k: their sum is 1 [-].

    Notes
    -----
    The modes that are not given enter as one mode that has what they leave of s_1 and s_2, and as mass: exact up to a
    share of the order of (w/W)^8 of their mass.
    """
    omega = 2 * np.pi * np.asarray(frequency)
    coupling = np.abs(participation) / omega**2  # p itself grows with the stiffness, and would hide all but axial modes
    chosen = coupling > NEGLIGIBLE * coupling.max(initial=0.0)
    omega, coupling = omega[chosen], coupling[chosen]
    left = [total - (coupling**2 / omega ** (2 * j)).sum() for j, total in enumerate(moments)]
    if all(rest > ROUNDING * total for rest, total in zip(left, moments, strict=True)):
        omega = np.append(omega, np.sqrt(left[1] / left[2]))
        coupling = np.append(coupling, left[1] / np.sqrt(left[2]))
    n = len(omega)
    inertia, rigidity = np.eye(n + 1), np.diag(np.append(omega**2, stiffness))
    inertia[:n, n] = inertia[n, :n] = coupling
    own = moments[0] - (coupling**2).sum()
    own = mass + (own if own > ROUNDING * moments[0] else 0.0)
    inertia[n, n] = own + (coupling**2).sum()
    natural, shares = LinearSystem(inertia, np.zeros_like(inertia), rigidity).modes
    return _polished(natural, own, stiffness, omega, coupling) / (2 * np.pi), shares[0]


def _polished(natural, own, stiffness, omega, coupling):
    """Modes by a Newton step on k - w^2 (M + sum of m^2 W^2/(W^2 - w^2)), in which a light gondola does not cancel."""
    square = natural**2
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        near = 1 / (1 - square[:, None] / omega**2)
        rest = stiffness - square * (own + near @ coupling**2)
        change = rest / (own + near**2 @ coupling**2) / square
    return natural * np.sqrt(1 + np.where(np.abs(change) < CLOSE, change, 0.0))


def damped_pole(cable, mass, damping, omega, distinct=False):
    """The pole of the gondola on a damped cable, the winch at rest.

    Of the poles with a large share in the gondola's static compliance the one nearest to its undamped frequency.

    Parameters
    ----------
    cable : Superelement
    mass : float
        Of the gondola. [kg]
    damping : float
        Viscous, on the gondola. [N s/m]
    omega : float
        [rad/s]
    distinct : bool
        Whether hardly another mode moves the gondola: its pole is then near i omega, unless it is damped much.

    Returns
    -------
    complex
        [rad/s]

    Raises
    ------
    NoSolutionError
        So much damped strain that rounding spoils the response.
    """

    def balance(s):
        return complex((mass * s**2 + damping * s + cable.dynamic_stiffness(s, [GONDOLA], [GONDOLA])[:, 0, 0])[0])

    if distinct:
        pole = _refined(balance, 1j * omega)
        if 0 < -pole.real < NEAR * omega:
            return pole
    cable, system = _moved(cable, mass)
    system.damping[-1, -1] += damping
    poles, shares = system.pole_shares
    poles = poles[shares[0] >= LARGE * shares[0].max()]
    return _refined(balance, complex(poles[np.argmin(np.abs(np.abs(poles) - omega))]))


def undamped_modes(cable, mass):
    """Frequencies of a gondola on a cable [Hz], and their shares in its static compliance [-]: two of shape (m,)."""
    omega, shares = _moved(cable, mass)[1].modes
    return omega / (2 * np.pi), shares[0]


def _moved(cable, mass):
    """A `Superelement` with the modes that move with the gondola, and the `LinearSystem` of both."""
    size = np.abs(cable.coupling[:, GONDOLA])
    chosen = np.flatnonzero(size > EXCITED * size.max(initial=0.0))
    cable = cable if len(chosen) == len(size) else cable.select(chosen)
    return cable, assemble([cable], np.eye(6)[:, [GONDOLA]], np.array([[mass]]))


def _refined(balance, pole):
    """A root near a place by the secant method, where rounding is that of the function; else the place itself."""
    begin, before = pole, pole * (1 + 1e-6)
    last = balance(np.array([before]))
    for _ in range(SECANT_STEPS):
        value = balance(np.array([pole]))
        if value == last:
            return pole
        change = value * (pole - before) / (value - last)
        before, last, pole = pole, value, pole - change
        if not abs(pole - begin) < 0.1 * abs(begin):
            return begin
        if abs(change) <= 1e-13 * abs(pole):
            return pole
    return begin


def gondola_mode(share):
    """Number of the gondola's mode: that with the largest share of its static compliance, the lowest of equal ones.

    Parameters
    ----------
    share : ndarray, shape (m,)
        See `coupled_modes`.

    Returns
    -------
    int
    """
    return int(np.argmax(share >= share.max() * (1 - TIE)))
