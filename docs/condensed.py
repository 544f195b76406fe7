"""Frequencies of a body by its static stiffness and a lumped mass, beside the coupled modes: python condensed.py SCENE [KEY=VALUE].

The lumped model has six degrees of freedom: the 6x6 static stiffness K of the first body, and its mass matrix with a
third of the mass of each cable at its attachment, as a straight bar that turns about its far end has it.
"""

import sys

import numpy as np
from scipy.linalg import eigh

from cablestudy.scene.scene import load_scene
from cablestudy.study.suspension.case import SuspensionCase
from cablestudy.system.rigid import cross_matrix


def condensed_frequencies(equilibrium, share):
    """Frequencies of the first body by its static stiffness.

    Parameters
    ----------
    equilibrium : Equilibrium
    share : float
        Of the mass of each cable, at the attachment.

    Returns
    -------
    ndarray, shape (6,)
        [Hz]
    """
    suspension, span = equilibrium.suspension, equilibrium.catenary.span
    rotation = equilibrium.rotation[0]
    mass = _at(rotation @ suspension.center[0], suspension.mass[0])
    mass[3:, 3:] += rotation @ suspension.inertia[0] @ rotation.T
    for cable, end in np.argwhere(suspension.owner == 0):
        mass += _at(equilibrium.arms[cable, end], share * span.mass[cable] * span.unstretched_length[cable])
    stiffness = equilibrium.body_stiffness[0]
    return np.sqrt(eigh((stiffness + stiffness.T) / 2, mass, eigvals_only=True)) / (2 * np.pi)


def _at(arm, mass):
    """Mass matrix of a point mass, for the motion of the reference point, shape (6, 6)."""
    moved = np.hstack([np.eye(3), -cross_matrix(arm)])
    return mass * moved.T @ moved


def main(path, *sets):
    """Print the table."""
    case = SuspensionCase(load_scene(path, sets, suspensions=True)[1])
    modes = case.modes(6)
    third, none = (condensed_frequencies(case.equilibrium, share) for share in (1 / 3, 0))
    rows = zip(range(1, 7), modes.frequency[:6], third, none, modes.body_share[:6], strict=True)
    write = sys.stdout.write
    write("| number | coupled [Hz] | 6x6 + 1/3 of cables [Hz] | 6x6 [Hz] | body share of the coupled mode |\n")
    write("|-------:|-------------:|-------------------------:|---------:|-------------------------------:|\n")
    for number, coupled, lumped, bare, share in rows:
        write(f"| {number:6} | {coupled:12.4f} | {lumped:24.4f} | {bare:8.4f} | {share:30.3f} |\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
