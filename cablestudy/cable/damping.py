"""Damping of a cable: its law and numbers, and whether its effect on bodies has a limit as modes are added."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Damping:
    """Damping of a cable, by default none.

    Attributes
    ----------
    model : {"modal", "hysteretic", "kelvin_voigt"}
    ratio, loss_factor, time : float
        Of the model: damping ratio [-], loss factor [-] or time [s].
    viscous : float
        Force per length and velocity, with any model. [N s/m^2]
    """

    model: str = "modal"
    ratio: float = 0.0
    loss_factor: float = 0.0
    time: float = 0.0
    viscous: float = 0.0


def grows_with_modes(damping):
    """True for modal damping: that of the motion of bodies then grows with the number of modes, without limit.

    Parameters
    ----------
    damping : Damping
        Or that of a scene, which has the same names.
    """
    return damping.model == "modal" and bool(damping.ratio)


def any_grows_with_modes(cables):
    """True if the damping of any of some cables, by their attribute `damping`, grows with the number of modes."""
    return any(grows_with_modes(cable.damping) for cable in cables)
