"""The stiffness of end 2 at one complex s, of a cable whose strain is damped, and the damped mode of what hangs on it.

No modes and no stiffness that is factorised: about a state the cable gives, per length, to a force at a Gauss point

    A = |r'|/T (I - t t^T) + t t^T/(EA (1 + c))

so that the damping c(s) is one number in it, and EA enters as its inverse only. N being the force along the cable, u
the displacement, m the mass matrix of an element of size h and J the integral from its first node, elements say

    u = u_0 + h J A N,    N = N_1 - s^2 h S m u,    S = J^T/w,

S being the force at a Gauss point (weight w) per force on a node, N_1 the force at the last one. In each element u is
eliminated, all elements at once; what is left are displacement and force where elements meet, one band for the whole
cable; a mass that is carried there adds its inertia to the force. Both are counted along each axis by the root of what
the cable gives along it: all entries are of order one.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from cablestudy.cable.element import basis, mass_matrix
from cablestudy.errors import NoSolutionError

FOLLOWED = 200  # steps at most in which a mode is followed from no damping to all of it
REFINED = 12  # steps of Newton at most, each of them
CLOSER = 0.3  # of the one before
CLOSE = 1e-2  # of its distance from zero that the pole of nearly the same cable is away at most
FARTHEST = 0.3  # of its distance from zero that a pole goes in one step
NEAR = 1e-7  # of that distance: taken for the same pole
SETTLED = 1e-8  # relative step of Newton after which nothing is left but rounding
HALF = 0.5  # share in the static compliance above which no other pole has more
GUESSES = 6  # of where else the mass may move
SHARES = (0.05, 0.2, 0.5, 1.0)  # of the damping
NEARLY_REAL = 0.03  # imaginary part of a pole, over its size, below which it may meet its conjugate
TRUSTED = 1e-10  # difference between a damping ratio by the place of the pole and by its energies
NO_OSCILLATION = "the gondola's mode is damped so much that it is no oscillation"
NO_STRAIN = 1e-26  # share of the energy that is in the strain, below which it is rounding: squares of 1e-16, tenfold


@lru_cache(maxsize=64)
def _integration(order, mass):
    """J (p + 1, p), S m J (p, p), S m 1 (p,) and 1^T m J (p,) of a reference element."""
    element = basis(order)
    legendre = np.polynomial.legendre
    count = np.arange(order)
    values = (2 * count[:, None] + 1) * legendre.legvander(2 * element.points - 1, order - 1).T * element.weights
    nodal = legendre.legvander(2 * element.nodes - 1, order)
    primitive = np.empty((order + 1, order))
    primitive[:, 0] = element.nodes
    primitive[:, 1:] = (nodal[:, 2:] - nodal[:, : order - 1]) / (2 * (2 * count[1:] + 1))
    integral = primitive @ values
    integral[0], integral[-1] = 0.0, element.weights
    weighted = integral.T / element.weights[:, None] @ mass_matrix(order, mass)
    return integral, weighted @ integral, weighted.sum(axis=1), element.shares @ integral


@lru_cache(maxsize=64)
def _band(n, d):
    """Which entries of the blocks of n elements of d axes are in the band of `_Plane._between`: rows, columns there."""
    rows = np.broadcast_to(np.arange(2 * d * n).reshape(n, 2 * d, 1), (n, 2 * d, 4 * d))
    columns = np.broadcast_to(2 * d * np.arange(n)[:, None, None] + np.arange(4 * d) - d, rows.shape).copy()
    columns[-1, :, 3 * d :] -= d
    keep = np.ones(rows.shape, dtype=bool)
    keep[0, :, :d] = keep[-1, :, 2 * d : 3 * d] = False  # u at the ends is given
    rows, columns = rows[keep], columns[keep]
    return keep, 3 * d - 1 + rows - columns, columns


@dataclass(frozen=True)
class Moved:
    """The cable while end 2 moves by one unit, end 1 held.

    Attributes
    ----------
    stiffness : complex
        Force on end 2 along its movement. [N/m]
    elastic : complex
        Derivative of it with respect to c. [N/m]
    inertia, carried_inertia : complex
        Derivatives of it with respect to g = s^2 + viscous s of the cable, and to s^2 of what it carries, at constant
        c. [kg]
    strain, bend, moving_mass, carried_mass : float
        Of the shape u: strain energy without damping and energy of the tension [N/m], mass of the cable and of what it
        carries [kg], with |u|^2: where M s^2 + `stiffness` is zero,
        (M + carried_mass) s^2 + moving_mass g + bend + (1 + c) strain is zero too, a sum of positive numbers.
    """

    stiffness: complex
    elastic: complex
    inertia: complex
    carried_inertia: complex
    strain: float
    bend: float
    moving_mass: float
    carried_mass: float


class ComplexStiffness:
    """Stiffness of end 2 along one direction.

    Parameters
    ----------
    dynamics : Dynamics
        The motion that a movement of end 2 in that direction stirs.
    direction : ndarray, shape (3,)
        Unit vector in the chord frame. [-]
    viscous : float
        Viscous damping per length over mass per length. [1/s]
    """

    def __init__(self, dynamics, direction, viscous=0.0):
        self.viscous, state = viscous, dynamics.state
        self._unit, self._mass = state.force / dynamics.length, dynamics.mass * dynamics.length
        self._planes = [
            _Plane(state, system.axes, direction[list(system.axes)])
            for system in dynamics.systems
            if direction[list(system.axes)].any()
        ]

    def __call__(self, s, loss):
        """Of the cable at s, EA being EA (1 + loss).

        Parameters
        ----------
        s, loss : complex
            [rad/s], [-]

        Returns
        -------
        Moved
        """
        unit, mass = self._unit, self._mass
        squares = s * (s + self.viscous) * mass / unit, s**2 * mass / unit
        moved = [plane.moved(*squares, loss) for plane in self._planes]
        units = (unit, unit, mass, mass, unit, unit, mass, mass)
        return Moved(*(of * sum(part) for of, part in zip(units, zip(*moved, strict=True), strict=True)))


class _Plane:
    """The axes that move together; lengths in unstretched lengths, forces in that of the state, unit mass."""

    def __init__(self, state, axes, direction):
        mesh = state.mesh
        element = basis(mesh.order)
        self._h, self._order, self._d = mesh.sizes, mesh.order, len(axes)
        self._integral, self._inner, self._first, self._last = _integration(mesh.order, mesh.mass)
        self._nodal = mass_matrix(mesh.order, mesh.mass)
        self._weights = mesh.sizes[:, None] * element.weights
        self._carried = mesh.carried[:: mesh.order]  # where elements meet
        self._t, self._compliance = state.direction[..., axes], state.compliance
        self._across = state.stretch / state.tension
        # I - t t^T, its diagonal without cancellation
        square = state.direction**2
        self._normal = -self._t[..., :, None] * self._t[..., None, :]
        for place, axis in enumerate(axes):
            self._normal[..., place, place] = np.delete(square, axis, axis=-1).sum(axis=-1)
        self._normal *= self._across[..., None, None]
        self._along = self._t[..., :, None] * self._t[..., None, :] * state.compliance
        diagonal = np.einsum("eq,eqjj->j", self._weights, self._normal + self._along)
        self._scale = np.sqrt(diagonal)
        unit = self._scale[:, None] * self._scale
        self._normal /= unit
        self._along /= unit
        self._direction = direction / self._scale

    def moved(self, square, carried_square, loss):
        """The numbers of `Moved`, in units, where g and s^2 are these."""
        give = self._normal + self._along / (1 + loss)
        force, gradient, step = self._elements(square, give)
        begin, pull = self._between(step, carried_square)
        force, gradient = (np.einsum("eqjk,ek->eqj", part, begin) for part in (force, gradient))
        d = self._d
        shape = begin[:, None, :d] + self._h[:, None, None] * np.einsum("ig,egj->eij", self._integral, gradient)
        shape = shape * self._scale
        force = force / self._scale
        tension = np.einsum("eqj,eqj->eq", self._t, force)
        aside = force - self._t * tension[..., None]
        weights, share = self._weights * self._compliance, 1 / (1 + loss)
        weighted = self._h[:, None, None] * np.einsum("ik,ekj->eij", self._nodal, shape)
        at_masses = np.concatenate([shape[:, 0], [self._direction * self._scale]])  # where elements meet
        return (
            complex(self._direction @ pull),
            complex((weights * tension**2).sum() * share**2),
            complex((shape * weighted).sum()),
            complex(self._carried @ (at_masses**2).sum(axis=1)),
            float((weights * np.abs(tension) ** 2).sum() * abs(share) ** 2),
            float(((self._weights * self._across)[..., None] * np.abs(aside) ** 2).sum()),
            float((shape.conj() * weighted).real.sum()),
            float(self._carried @ (np.abs(at_masses) ** 2).sum(axis=1)),
        )

    def _elements(self, square, give):
        """Each element by u at its near end and N at its far end: no wave grows from what is given there.

        Returns
        -------
        force, gradient : ndarray, shape (n, q, d, 2 d)
            At the Gauss points.
        across : ndarray, shape (n, 2 d, 2 d)
            u at the far end and N at the near end.
        """
        n, p, d = len(self._h), self._order, self._d
        heavy, h, axes = square * self._scale**2, self._h, np.arange(d)
        system = np.einsum("e,gk,j,ekjl->egjkl", h**2, self._inner, heavy, give).reshape(n, p * d, p * d)
        system[:, np.arange(p * d), np.arange(p * d)] += 1
        right = np.zeros((n, p, d, 2 * d), dtype=complex)
        right[:, :, axes, axes] = -h[:, None, None] * self._first[:, None] * heavy
        right[:, :, axes, d + axes] = 1
        force = np.linalg.solve(system, right.reshape(n, p * d, 2 * d)).reshape(n, p, d, 2 * d)
        gradient = give @ force
        across = np.empty((n, 2 * d, 2 * d), dtype=complex)
        across[:, :d] = np.einsum("eq,eqjk->ejk", self._weights, gradient)
        across[:, d:] = -(h**2)[:, None, None] * heavy[:, None] * np.einsum("q,eqjk->ejk", self._last, gradient)
        across[:, axes, axes] += 1
        across[:, d + axes, d + axes] += 1
        across[:, d + axes, axes] -= h[:, None] * heavy
        return force, gradient, across

    def _between(self, across, square):
        """u at the near end and N at the far end of each element, shape (n, 2 d), and N at end 2, which is moved.

        N jumps by s^2 m u at a carried mass m; the `square` is s^2.
        """
        from scipy.linalg import solve_banded

        n, d = len(across), self._d
        # the unknowns are N at end 1, u and N where elements meet, N at end 2
        size, width = 2 * d * n, 3 * d - 1
        blocks = np.zeros((n, 2 * d, 4 * d), dtype=complex)
        blocks[..., :d], blocks[..., 3 * d :] = across[..., :d], across[..., d:]
        blocks[:, d:, d : 2 * d] = blocks[:, :d, 2 * d : 3 * d] = -np.eye(d)
        inertia = square * np.multiply.outer(self._carried, self._scale**2)
        blocks[:, d + np.arange(d), np.arange(d)] -= inertia[:-1]
        keep, rows, columns = _band(n, d)
        band = np.zeros((2 * width + 1, size), dtype=complex)
        band[rows, columns] = blocks[keep]
        right = np.zeros(size, dtype=complex)
        right[size - 2 * d : size - d] = self._direction
        answer = solve_banded((width, width), band, right, overwrite_ab=True, overwrite_b=True, check_finite=False)
        met, pull = answer[d : size - d].reshape(n - 1, 2, d), answer[size - d :] + inertia[-1] * self._direction
        near = np.concatenate([np.zeros((1, d)), met[:, 0]])
        far = np.concatenate([met[:, 1], pull[None]])
        return np.concatenate([near, far], axis=1), pull


def damped_mode(stiffness, mass, omega, law, amount, viscous=0.0, near=None):
    """Damping ratio and pole of the mode of a mass on the cable's end 2 that oscillates at `omega` without damping.

    Parameters
    ----------
    stiffness : ComplexStiffness
        Along the direction in which the mass is free.
    mass : float
        [kg]
    omega : float
        [rad/s]
    law : {"hysteretic", "kelvin_voigt"}
    amount : float
        Loss factor [-], or time [s].
    viscous : float
        Damping of the mass by the air. [N s/m]
    near : complex, optional
        Its pole on nearly the same cable. [rad/s]

    Returns
    -------
    ratio : float
        1 where it does not oscillate. [-]
    pole : complex
        [rad/s]

    Raises
    ------
    NoSolutionError
        The mode cannot be followed from no damping to all of it.

    Notes
    -----
    The pole is followed while the damping grows, Newton on stiffness + viscous s + M s^2. At a pole the energies of its
    shape make the damping ratio a sum of positive numbers, so that a ratio of 1e-12 has as many digits as one of 0.1.
    """
    path = _Path(stiffness, mass, law, amount, viscous)
    try:
        with np.errstate(all="ignore"):  # what is not finite is not settled
            here = near and path.settled(near, 1.0, CLOSE * abs(near))
            if here is None:
                here = path.directly(1j * omega) or path.follow(1j * omega)
                here = path.largest_share(here, omega)
            moved = path.at(here, 1.0)[0]
    except (np.linalg.LinAlgError, ZeroDivisionError, OverflowError):
        raise NoSolutionError(NO_OSCILLATION) from None
    whole, strain, drag = moved.bend + moved.strain, moved.strain, stiffness.viscous * moved.moving_mass + viscous
    if strain <= NO_STRAIN * whole:
        strain = 0.0
    if not strain and not drag:
        return 0.0, here
    if not here.imag:
        return 1.0, here
    total = mass + moved.moving_mass + moved.carried_mass
    if law == "hysteretic":
        # the root of total s^2 + drag s + whole + i loss strain, its real part a sum of positive numbers
        root = np.sqrt(complex(4 * total * whole - drag**2, 4 * total * amount * strain))
        ratio = (drag + root.imag) / abs(complex(drag + root.imag, root.real))
    else:
        ratio = (amount * strain + drag) / (2 * np.sqrt(total * whole))
    if not abs(ratio + here.real / abs(here)) < TRUSTED:
        raise NoSolutionError(f"the gondola's damping ratio, about {ratio:.3g}, is spoilt by rounding")
    return float(ratio), here


class _Path:
    """A pole of a mass on a cable, while a share of the damping grows from none to all."""

    def __init__(self, stiffness, mass, law, amount, viscous):
        self._stiffness, self._mass, self._amount, self._rate = stiffness, mass, amount, law == "kelvin_voigt"
        self._viscous, self._last = viscous, (None, None)

    @cached_property
    def _static(self):
        return abs(self._stiffness(0j, 0.0).stiffness)

    def at(self, s, share):
        """The cable, what is left of the balance, and its slopes with respect to s and to the share."""
        if self._last[0] != (s, share):
            self._last = (s, share), self._at(s, share)
        return self._last[1]

    def _at(self, s, share):
        rate = self._amount * (s if self._rate else 1j)
        moved = self._stiffness(s, share * rate)
        slope = 2 * s * (self._mass + moved.inertia + moved.carried_inertia)
        slope += self._stiffness.viscous * moved.inertia
        slope += share * self._viscous
        if self._rate:
            slope += moved.elastic * share * self._amount
        rest = (self._mass * s + share * self._viscous) * s + moved.stiffness
        return moved, rest, slope, moved.elastic * rate + self._viscous * s

    def settled(self, s, share, radius):
        """The pole by Newton from s, or None; the first step is within `radius`, each a fraction of the one before."""
        last = radius
        for _ in range(REFINED):
            _, rest, slope, _ = self.at(s, share)
            change = -rest / slope
            size = abs(change)
            if not size <= max(last, SETTLED * abs(s)):
                return None
            s += change
            if size <= SETTLED * abs(s):
                return s
            last = CLOSER * size
        return None

    def share(self, s):
        """Share of a pole with all of the damping in the static compliance of the mass. [-]"""
        return abs(2 * self._static / (s * self.at(s, 1.0)[2]))

    def largest_share(self, s, omega):
        """The followed pole, or where it has passed its share on to another one on the way, that one."""
        if not s.imag or self.share(s) >= HALF:
            return s
        found = [s]
        for first in (s, 1j * omega):
            here = first
            for _ in range(GUESSES):  # the mass on the cable as it answers here
                here = np.sqrt(-self.at(here, 1.0)[0].stiffness / self._mass + 0j)
                here *= 1 if here.imag >= 0 else -1
            found.append(self.settled(here, 1.0, CLOSER * abs(here)))
        here = 1j * omega
        for share in SHARES:  # in steps that are long against what the motions share
            here = here and self.settled(here, share, abs(here))
        found.append(here)
        return max((one for one in found if one is not None and one.imag > 0), key=self.share, default=s)

    def directly(self, s):
        """The pole at all of the damping, which moves it little; None where it moves it far, s as for `follow`."""
        _, rest, slope, push = self.at(s, 0.0)
        change = -(rest + push) / slope
        size = abs(change)
        found = self.settled(s + change, 1.0, CLOSER * size + NEAR * abs(s)) if size < CLOSE * abs(s) else None
        return found if found is not None and found.imag > 0 else None

    def follow(self, s):
        """The pole at all of the damping, from a place near the one without any.

        Raises
        ------
        NoSolutionError
        """
        share, step = 0.0, 1.0
        s = self.settled(s, share, CLOSER * abs(s))
        for _ in range(FOLLOWED):
            if share == 1.0 or s is None:
                break
            _, _, slope, push = self.at(s, share)
            rate = -push / slope
            step = min(step, FARTHEST * abs(s) / abs(rate)) if rate else 1.0
            ahead = min(share + step, 1.0)
            step = ahead - share
            found = self.settled(s + rate * step, ahead, CLOSER * abs(rate * step) + NEAR * abs(s))
            if found is not None and (found.imag > 0 or not s.imag):
                s, share, step = found, ahead, 3 * step
                continue
            step /= 4
            beyond = share - s.imag / rate.imag if rate.imag < 0 else 1.0
            if (found := self._beyond_conjugate(s, beyond)) is not None:
                s, share, step = found, beyond, beyond
        if share < 1.0 or s is None:
            raise NoSolutionError(NO_OSCILLATION)
        return s

    def _beyond_conjugate(self, s, beyond):
        """The pole on the real axis where it has met its conjugate, at a share of the damping; None where it has not.

        The square of the imaginary part falls evenly through zero.
        """
        if beyond >= 1.0 or not 0 < s.imag < NEARLY_REAL * abs(s):
            return None
        found = self.settled(complex(s.real + s.imag), beyond, s.imag)
        return None if found is None or found.imag else found


def excited(case):
    """The free vibration of a `Case` that moving end 2 along x excites: `Dynamics`."""
    return case.dynamics if case.results.across_x[case.index] else case.in_plane
