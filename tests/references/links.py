"""Links between bodies, points and the ground: forces of exact rigid motions, and their derivatives by complex steps.

The distance of two places is an analytic function of the displacements q of the bodies (x y z, then a rotation vector
about global axes), so that Im f(q + i h)/h is its derivative to the last digit.
"""

import numpy as np
from scipy.linalg import expm

from .dense import cross

STEP = 1e-30


def distances_and_wrenches(equilibrium, q):
    """Distance of the places of each link, and force and moment of all springs on each body, shapes (l,), (b, 6)."""
    model, cables = equilibrium.suspension, len(equilibrium.suspension.cable_names)
    q = np.asarray(q).reshape(-1, 6)
    found, wrench = [], np.zeros(q.shape, dtype=complex)
    for link in range(len(model.link_names)):
        arms, places = [], []
        for owner, place in zip(model.owner[cables + link], model.attachment[cables + link], strict=True):
            if owner < 0:
                arms.append(None)
                places.append(place.astype(complex))
                continue
            arms.append(expm(cross(q[owner, 3:])) @ equilibrium.rotation[owner] @ place)
            places.append(equilibrium.position[owner] + q[owner, :3] + arms[-1])
        vector = places[1] - places[0]
        distance = np.sqrt((vector**2).sum())
        pull = model.link_stiffness[link] * (distance - model.link_length[link]) * vector / distance
        for owner, arm, force in zip(model.owner[cables + link], arms, (pull, -pull), strict=True):
            if owner >= 0:
                wrench[owner] += [*force, *np.cross(arm, force)]
        found.append(distance)
    return np.array(found), wrench


def matrices(equilibrium):
    """Symmetric part of the stiffness, and damping of the links for all displacements of bodies, (6 b, 6 b) both."""
    size, damping = 6 * len(equilibrium.suspension.body_names), equilibrium.suspension.link_damping
    stiffness, rates = np.zeros((size, size)), np.zeros((len(damping), size))
    for k, step in enumerate(1j * STEP * np.eye(size)):
        distance, wrench = distances_and_wrenches(equilibrium, step)
        stiffness[:, k], rates[:, k] = -wrench.ravel().imag / STEP, distance.imag / STEP
    return (stiffness + stiffness.T) / 2, (rates.T * damping) @ rates
