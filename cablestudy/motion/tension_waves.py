"""Changes of the variances of tensions by waves along and across cables that are faster than the modes of a model.

A part of the gusts' force on a cable is taken up by none of a model's modes: the model transfers this share to the ends
immediately. In truth waves carry it there, most of it the first ones above the highest mode, and each wave responds to
its part as a mass on a spring does. The estimate lets the whole share act by way of the first wave along the cable, or
of the first one across it: the variance grows by the resonance of that wave, and loses all that is faster. The ends are
taken to be held, and the winches at rest.
"""

from dataclasses import replace

import numpy as np

from cablestudy.motion.tolerances import MOTION
from cablestudy.motion.turbulence import VALUE_AND_RATE
from cablestudy.system.condensed_cables import laws_of
from cablestudy.wind.integrals import Integrals


def change_by_waves(in_wind):
    """Estimate how much waves on cables above the modes of the model change the variances of tensions in the wind.

    The model transfers a share D of the gusts' force to the ends of cables immediately. Here a wave carries it, of
    frequency w and damping ratio zeta (`_first_waves`),

        D w^2/(s^2 + 2 zeta w s + w^2)

    and the variances are computed again. The changes by waves along the cable and by those across it are added, each
    with its safety factor, `MOTION.waves_along` or `MOTION.waves_across`.

    Parameters
    ----------
    in_wind : PlantInWind

    Returns
    -------
    ndarray, shape (2, o)
        Changes, 0 or more, of the variances of the o outputs of the plant, and of their rates. They are 0 for all but
        tensions, and for stated elements. For rates of tensions they are up to five times too small: nearly all of such
        a change is the resonance of the first wave along a cable that sags, which is excited more than D implies. No
        result shows the rate of a tension; the largest tension depends on its logarithm, see `MOTION.crossings`.
    """
    gusts, turbulence, variances = in_wind.gusts, in_wind.at_rest, in_wind.at_rest.variances.value
    change, residues = np.zeros(variances.shape), turbulence.residues
    tension_rows, along, across = _first_waves(in_wind.plant, in_wind.airflow)
    driven = residues.direct[tension_rows].any(axis=1)  # tensions of cables whose ends some force reaches immediately
    if in_wind.plant.model is not None or not driven.any():
        return change
    poles = np.concatenate([along[driven], across[driven]])
    factor = np.repeat([MOTION.waves_along, MOTION.waves_across], np.count_nonzero(driven))  # of safety
    tension_rows = np.tile(tension_rows[driven], 2)
    # a wave is an oscillator w^2/(s^2 + 2 zeta w s + w^2), 1 at s = 0: its two poles replace the direct share
    outputs, inputs = np.diag(np.abs(poles) ** 2 / (2j * poles.imag)), residues.direct[tension_rows]
    with_waves = replace(
        residues,
        poles=np.concatenate([residues.poles, poles, poles.conj()]),
        inputs=np.concatenate([residues.inputs, inputs, inputs]),
        outputs=np.concatenate([residues.outputs[tension_rows], outputs, -outputs], axis=1),
        direct=np.zeros_like(inputs),
    )
    low, high = turbulence.range
    edges = gusts.edges(low, max(high, MOTION.wave_range * np.abs(poles).max() / (2 * np.pi)))
    integrals = Integrals.on(edges, gusts, VALUE_AND_RATE, turbulence.least)
    changes = factor * np.abs(integrals.variances(with_waves) - variances[:, tension_rows])
    np.add.at(change.T, tension_rows, changes.T)  # those by both waves of each tension are added
    return change


def _first_waves(plant, airflow):
    """Poles of the first standing waves along and across each cable with mass that are above the modes of a plant.

    The cables are taken as straight bars and strings with fixed ends, of length l and mass per length m. With n
    half-waves

        w = n pi/l sqrt(F/m),   zeta = ratio + e (loss + time w)/2 + c/(2 m w),   s = w (-zeta + i sqrt(1 - zeta^2))

    F is EA along and the mean tension T across. n is the least one for which w is above the modes of the plant. ratio,
    loss and time are the damping ratio, loss factor and Kelvin-Voigt time of the cable; e is the share of strain in the
    energy of the wave, 1 along and `MOTION.strained_share` across. c is the viscous damping per length, across with
    that by the air. zeta is kept between `MOTION.least_wave_damping` and `most_wave_damping`.

    The results, all of shape (r,), are the outputs of the plant that are the tensions at the ends of these cables, two
    of each, and s of the wave along, and across, the cable of each [rad/s].
    """
    catenary, cables = plant.equilibrium.catenary, list(plant.scene.cables.values())
    span, dampings = catenary.span, [cable.damping for cable in cables]
    heavy = np.flatnonzero((np.asarray(span.mass) > 0) & (catenary.mean_tension > 0))
    values = span.axial_stiffness, span.mass, span.unstretched_length, catenary.mean_tension
    stiffness, mass, length, tension = (np.broadcast_to(value, len(cables))[heavy] for value in values)

    ratio, loss, time = (values[heavy] for values in laws_of(dampings).values())

    def pole(force, strain_share, viscous):
        """Pole of the first wave by a force F on each cable, a share e of strain and a viscous damping c."""
        lowest = np.pi / length * np.sqrt(force / mass)
        omega = lowest * np.maximum(np.ceil(plant.modes.omega[-1] / lowest), 1.0)  # above those of the model
        damping = ratio + strain_share * (loss + time * omega) / 2 + viscous / (2 * mass * omega)
        damping = np.clip(damping, MOTION.least_wave_damping, MOTION.most_wave_damping)
        return np.repeat(omega * (-damping + 1j * np.sqrt(1 - damping**2)), 2)  # for the tensions at both ends

    viscous = np.array([damping.viscous for damping in dampings])[heavy]
    air = airflow.damping_per_length[heavy] / 2  # across wind and cable
    rows = plant.tension_rows.reshape(-1, 2)[heavy].ravel()
    return rows, pole(stiffness, 1.0, viscous), pole(tension, MOTION.strained_share, viscous + air)
