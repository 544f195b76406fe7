"""Properties of a cable between two fixed ends, and its chord frame.

The chord frame (e, n, y): e from end 1 to end 2, n at right angles to it in the vertical plane (upwards), y horizontal.
The vertical is the direction against which the uniform load of the cable acts: z, or another one where a uniform wind
adds to its weight.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cablestudy.cable.records import take_rows
from cablestudy.cable.vectors import cross

# number of dimensions that each field of a span has for one cable, behind those of the batch
CORES = dict.fromkeys(("chord", "cosine", "sine", "chord_strain", "axial_stiffness", "mass", "gravity"), 0) | {
    "load_positions": 1,
    "load_forces": 2,
    "load_masses": 1,
    "load_fractions": 1,
    "horizontal": 1,
    "vertical": 1,
}


@dataclass(frozen=True)
class Span:
    """A cable between two fixed ends, or a batch of cables.

    The unstretched length is stored as `chord_strain`, so that a cable pre-strained by 1e-12 keeps all its digits.

    Attributes
    ----------
    chord : float or ndarray, shape (...)
        Distance between the ends. [m]
    cosine, sine : float or ndarray, shape (...)
        Of the inclination of the chord to the plane normal to `vertical`; the sine is positive where end 2 is above
        end 1. [-]
    chord_strain : float or ndarray, shape (...)
        chord / unstretched length - 1: positive for a taut cable, negative for a slack one. [-]
    axial_stiffness : float or ndarray, shape (...)
        EA. [N]
    mass : float or ndarray, shape (...)
        Per unstretched length. [kg/m]
    gravity : float or ndarray, shape (...)
        Uniform load over mass, against `vertical`. [m/s^2]
    load_positions : ndarray, shape (..., k)
        Arc length of the point loads from end 1 along the unstretched cable, ascending. [m]
    load_forces : ndarray, shape (..., k, 3)
        Point loads in the chord frame, the weight of their masses included. [N]
    load_masses : ndarray, shape (..., k), or None
        What moves with the cable at each load; None where nothing does. [kg]
    load_fractions : ndarray, shape (..., k), or None
        Shares of the unstretched length at which loads stay when it changes; NaN for a load at an arc length. [-]
    horizontal : ndarray, shape (..., 3)
        Unit vector normal to `vertical`, in the plane of it and the chord. [-]
    vertical : ndarray, shape (..., 3)
        Unit vector against the uniform load, global axes. [-]
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
    load_masses: np.ndarray | None = None
    load_fractions: np.ndarray | None = None
    horizontal: np.ndarray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    vertical: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    @classmethod
    def between(
        cls, end_1, end_2, axial_stiffness, mass, gravity=9.81, unstretched_length=None, load_positions=(),
        load_forces=None, chord=None, vertical=None,
    ):  # fmt: skip
        """`Span` of a cable, or of a batch of cables, between points in global coordinates, z upwards.

        Parameters
        ----------
        end_1, end_2 : ndarray, shape (..., 3)
            Positions of the ends. [m]
        axial_stiffness, mass, gravity : float or ndarray, shape (...)
            EA [N], mass per unstretched length [kg/m], uniform load over mass [m/s^2].
        unstretched_length : float or ndarray, shape (...), optional
            By default the distance of the ends; `with_chord_strain` changes it. [m]
        load_positions : ndarray, shape (..., k), optional
            Arc length of point loads from end 1 along the unstretched cable, ascending. [m]
        load_forces : ndarray, shape (..., k, 3), optional
            Point loads along x, y, z. [N]
        chord : float or ndarray, shape (...), optional
            Distance of the ends where it is known to more digits than their positions. [m]
        vertical : ndarray, shape (..., 3), optional
            Unit vector against the uniform load, by default z. [-]

        Raises
        ------
        ValueError
            Two ends in one place.
        """
        delta = np.asarray(end_2, dtype=float) - np.asarray(end_1, dtype=float)
        rise, across, run = _rise_and_run(delta, vertical)
        vertical = np.array([0.0, 0.0, 1.0]) if vertical is None else vertical
        chord = np.hypot(run, rise) if chord is None else np.asarray(chord, dtype=float)[()]
        if not np.all(chord > 0):
            raise ValueError("the ends of a cable are in one place")
        size = np.where(run > 0, run, 1.0)[..., None]
        length = chord if unstretched_length is None else np.asarray(unstretched_length, dtype=float)
        span = cls(
            chord=chord,
            cosine=run / chord,
            sine=rise / chord,
            chord_strain=(chord - length) / length,
            axial_stiffness=np.asarray(axial_stiffness, dtype=float)[()],
            mass=np.asarray(mass, dtype=float)[()],
            gravity=np.asarray(gravity, dtype=float)[()],
            horizontal=np.where(run[..., None] > 0, across / size, normal_to(vertical)),
            vertical=vertical,
            load_positions=np.asarray(load_positions, dtype=float),
        ).broadcast()
        if load_forces is None:
            return span
        forces = (np.asarray(load_forces, dtype=float)[..., None, :] * span.frame[..., None, :, :]).sum(axis=-1)
        return replace(span, load_forces=forces).broadcast()

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
    def point_masses(self):
        """Point masses of one cable: (share of the unstretched length, mass over the cable's) of each, a tuple."""
        if self.load_masses is None:
            return ()
        length = float(self.unstretched_length)
        cable_mass = float(self.mass) * length
        loads = zip(self.load_positions.tolist(), self.load_masses.tolist(), strict=True)
        return tuple((position / length, mass / cable_mass) for position, mass in loads if mass)

    @property
    def transverse_load(self):
        """Sum of weight and loads across the chord, absolute values, shape (...). [N]"""
        return np.abs(self.weight * self.cosine) + np.abs(self.load_forces[..., 1:]).sum(axis=(-1, -2))

    @property
    def planar(self):
        """True when no load leaves the vertical plane: in-plane and out-of-plane motion decouple."""
        return not np.any(self.load_forces[..., 2])

    @property
    def mirror_symmetric(self):
        """True where it is its own mirror image at mid-length: no loads, no weight along the chord, shape (...)."""
        return (np.asarray(self.sine * self.gravity) == 0) & (self.load_positions.shape[-1] == 0)

    @property
    def up(self):
        """The vertical in the chord frame, shape (..., 3). [-]"""
        return np.stack([self.sine, self.cosine, np.zeros_like(self.cosine)], axis=-1)

    @cached_property
    def frame(self):
        """Rows e, n, y in global coordinates, shape (..., 3, 3). [-]"""
        cosine, sine = np.asarray(self.cosine)[..., None], np.asarray(self.sine)[..., None]
        along, across = cosine * self.horizontal + sine * self.vertical, cosine * self.vertical - sine * self.horizontal
        out = np.broadcast_to(cross(self.vertical, self.horizontal), along.shape)
        return np.stack([along, across, out], axis=-2)

    def in_frame(self, vectors, frame):
        """Convert vectors from the chord frame to the axes of a named frame.

        Parameters
        ----------
        vectors : ndarray, shape (..., k, 3)
            Components along the chord, across it in the vertical plane, and out of that plane.
        frame : {"chord", "global"}

        Returns
        -------
        ndarray, shape (..., k, 3)
            Components along the axes of `frame`.

        Raises
        ------
        ValueError
            Another frame.
        """
        if frame not in ("chord", "global"):
            raise ValueError(f"frame is {frame!r}, not 'chord' or 'global'")
        if frame == "chord":
            return vectors
        return np.ascontiguousarray(vectors) @ self.frame  # products round by the order of their entries in memory

    def stiffness_along(self, stiffness, axis, moved=None):
        """Stiffness along a global axis (0, 1, 2: x, y, z) from matrices in the chord frame, shape (..., 3, 3). [N/m]

        By a displacement along the same axis, or along axis `moved`. Without a matrix product, whose rounding would
        depend on the number of cables.
        """
        direction, displacement = self.frame[..., axis], self.frame[..., axis if moved is None else moved]
        return sum(direction[..., i] * stiffness[..., i, j] * displacement[..., j] for i in range(3) for j in range(3))

    def take(self, index):
        """`Span` of several cables of a batch of shape (n,), or of one.

        Parameters
        ----------
        index : int or ndarray of int
        """
        return take_rows(self, index)

    @cached_property
    def arrays(self):
        """Name -> array of each field that is not None."""
        fields = ((name, getattr(self, name)) for name in CORES)
        return {name: np.asarray(array) for name, array in fields if array is not None}

    def broadcast(self):
        """Copy of the batch with all fields in its full shape."""
        arrays = self.arrays
        shapes = {name: array.shape[: array.ndim - CORES[name]] for name, array in arrays.items()}
        different = set(shapes.values())
        if len(different) == 1:
            return self
        shape = np.broadcast_shapes(*different)
        full = {
            name: np.broadcast_to(array, shape + array.shape[len(shapes[name]) :])
            for name, array in arrays.items()
            if shapes[name] != shape
        }
        return replace(self, **full)

    def with_chord_strain(self, chord_strain):
        """Copy of the cable with another unstretched length, stated as chord strain: chord/(unstretched length) - 1.

        Point loads stay at their arc lengths; those whose position is stated as a share of the length stay at that
        share.

        Parameters
        ----------
        chord_strain : float or ndarray, shape (...)
            The new one. [-]
        """
        span = replace(self, chord_strain=chord_strain)
        if self.load_fractions is None:
            return span
        length = np.asarray(span.unstretched_length)[..., None]
        positions = np.where(np.isnan(self.load_fractions), self.load_positions, self.load_fractions * length)
        order = np.argsort(positions, axis=-1, kind="stable")  # loads of the two kinds may pass each other

        def ascending(values):
            return np.take_along_axis(np.broadcast_to(values, positions.shape), order, axis=-1)

        forces = np.broadcast_to(self.load_forces, (*positions.shape, 3))
        return replace(
            span,
            load_positions=ascending(positions),
            load_forces=np.take_along_axis(forces, order[..., None], axis=-2),
            load_fractions=ascending(self.load_fractions),
            load_masses=None if self.load_masses is None else ascending(self.load_masses),
        )

    def take_loads(self, chosen):
        """Copy of the cable with those of its point loads that are `chosen`, a mask of shape (k,) or a slice."""
        loads = {"load_positions": self.load_positions[..., chosen], "load_forces": self.load_forces[..., chosen, :]}
        for name in ("load_masses", "load_fractions"):
            loads[name] = None if getattr(self, name) is None else getattr(self, name)[..., chosen]
        return replace(self, **loads)

    def without_loads(self):
        """Copy of the cable without its point loads."""
        return self.take_loads(slice(0))


def normal_to(vertical):
    """Unit vectors at right angles to `vertical`, shape (..., 3), in the plane of it and the axis x if possible. [-]"""
    if np.ndim(vertical) == 1 and vertical[2] == 1:
        return np.array([1.0, 0.0, 0.0])
    # not one nearly along the vertical, whose part across it would be small
    axis = np.where(np.abs(vertical[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    normal = axis - (axis * vertical).sum(axis=-1, keepdims=True) * vertical
    return normal / np.sqrt((normal**2).sum(axis=-1, keepdims=True))


def _rise_and_run(delta, vertical):
    """Parts of vectors, shape (..., 3), along a unit vector and across it, and the size of the part across.

    Shapes (...), (..., 3) and (...). The unit vector `vertical` is z where it is None.
    """
    if vertical is None:
        return delta[..., 2], delta * np.array([1.0, 1.0, 0.0]), np.hypot(delta[..., 0], delta[..., 1])
    rise = (delta * vertical).sum(axis=-1)
    across = delta - rise[..., None] * vertical
    across = across - (across * vertical).sum(axis=-1)[..., None] * vertical  # what cancellation left of it
    return rise, across, np.sqrt((across**2).sum(axis=-1))
