"""What the core knows of a cable between two fixed ends, and its chord frame.

The chord frame (e, n, y): e from end 1 to end 2, n at right angles to it in the vertical plane (upwards), y horizontal.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

# dimensions that each field of a span has for one cable
CORES = dict.fromkeys(("chord", "cosine", "sine", "chord_strain", "axial_stiffness", "mass", "gravity"), 0) | {
    "load_positions": 1,
    "load_forces": 2,
    "azimuth": 1,
}


@dataclass(frozen=True)
class Span:
    """A cable between two fixed ends, or a batch of cables.

    The unstretched length is carried as `chord_strain`, so that a cable pre-strained by 1e-12 keeps all its digits.

    Attributes
    ----------
    chord : float or ndarray, shape (...)
        Distance between the ends. [m]
    cosine, sine : float or ndarray, shape (...)
        Of the inclination of the chord, end 2 above end 1 when the sine is positive. [-]
    chord_strain : float or ndarray, shape (...)
        chord / unstretched length - 1: positive for a taut cable, negative for a slack one. [-]
    axial_stiffness : float or ndarray, shape (...)
        EA. [N]
    mass : float or ndarray, shape (...)
        Per unstretched length. [kg/m]
    gravity : float or ndarray, shape (...)
        [m/s^2]
    load_positions : ndarray, shape (..., k)
        Arc length of the point loads from end 1 along the unstretched cable, ascending. [m]
    load_forces : ndarray, shape (..., k, 3)
        Point loads in the chord frame. [N]
    azimuth : ndarray, shape (..., 2)
        Horizontal unit vector (x, y) of the vertical plane through the chord. [-]
    """

    chord: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray
    chord_strain: np.ndarray
    axial_stiffness: np.ndarray
    mass: np.ndarray
    gravity: np.ndarray = 9.81
    load_positions: np.ndarray = field(default_factory=lambda: np.zeros(0))
    load_forces: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    azimuth: np.ndarray = field(default_factory=lambda: np.array([1.0, 0.0]))

    @property
    def unstretched_length(self):
        """Length without tension. [m]"""
        return self.chord / (1.0 + self.chord_strain)

    @property
    def weight_per_length(self):
        """Per unstretched length. [N/m]"""
        return self.mass * self.gravity

    @property
    def weight(self):
        """Weight of the whole cable. [N]"""
        return self.weight_per_length * self.unstretched_length

    @property
    def sideways(self):
        """Weight and loads across the chord, shape (...). [N]"""
        return np.abs(self.weight * self.cosine) + np.abs(self.load_forces[..., 1:]).sum(axis=(-1, -2))

    @property
    def planar(self):
        """True when no load leaves the vertical plane: in-plane and out-of-plane motion decouple."""
        return not np.any(self.load_forces[..., 2])

    @property
    def mirror_symmetric(self):
        """Where neither a load nor weight along the chord tells one end from the other, shape (...)."""
        return (np.asarray(self.sine * self.gravity) == 0) & (self.load_positions.shape[-1] == 0)

    @property
    def up(self):
        """The vertical in the chord frame, shape (..., 3). [-]"""
        return np.stack([self.sine, self.cosine, np.zeros_like(self.cosine)], axis=-1)

    @cached_property
    def frame(self):
        """Rows e, n, y in global coordinates, shape (..., 3, 3). [-]"""
        cosine, sine = np.asarray(self.cosine)[..., None], np.asarray(self.sine)[..., None]
        ux, uy = self.azimuth[..., :1], self.azimuth[..., 1:]
        zero = np.zeros_like(cosine * ux)
        return np.stack(
            [
                np.concatenate([cosine * ux, cosine * uy, sine + zero], axis=-1),
                np.concatenate([-sine * ux, -sine * uy, cosine + zero], axis=-1),
                np.concatenate([-uy + zero, ux + zero, zero], axis=-1),
            ],
            axis=-2,
        )

    def take(self, index):
        """Some cables of a batch of shape (n,), or one of them.

        Parameters
        ----------
        index : int or ndarray of int
        """
        return replace(self, **{name: getattr(self, name)[index] for name in CORES})

    def broadcast(self):
        """The same batch with the fields that do not vary repeated, so that all have its shape."""
        arrays = {name: np.asarray(getattr(self, name)) for name in CORES}
        shape = np.broadcast_shapes(*(arrays[name].shape[: arrays[name].ndim - CORES[name]] for name in CORES))
        if not shape:
            return self
        return replace(
            self,
            **{
                name: np.broadcast_to(array, shape + array.shape[array.ndim - CORES[name] :])
                for name, array in arrays.items()
            },
        )

    def with_chord_strain(self, chord_strain):
        """The same cable with another unstretched length."""
        return replace(self, chord_strain=chord_strain)

    def without_loads(self):
        """The same cable without its point loads."""
        return replace(self, load_positions=np.zeros(0), load_forces=np.zeros((0, 3)))


def merged_loads(loads):
    """Point loads from end 1 on, those at one place added up.

    Parameters
    ----------
    loads : iterable of (position, force)
        Arc length along the unstretched cable [m] and global force vector [N].

    Returns
    -------
    list of (float, ndarray of shape (3,))
    """
    forces = {}
    for position, force in loads:
        forces[position] = forces.get(position, 0.0) + np.asarray(force, dtype=float)
    return sorted(forces.items())
