"""Spheres, and the exact volume that a sphere shares with a box.

The box is cut at the sphere's centre into eight boxes with one corner there, so that only one
shape has to be solved: a ball at the origin met by the box ``[0, a] x [0, b] x [0, c]``. Where the
far corner lies outside the ball, the divergence theorem applied to the position vector turns that
volume into a third of (radius times spherical surface, plus each far face's distance times its
area inside the ball), and both kinds of area have elementary forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Spheres:
    """A set of spheres.

    Parameters
    ----------
    centres_m
        Centres, shape (n, 3), in metres.
    radii_m
        Radii, shape (n,), in metres.

    Raises
    ------
    ValueError
        If the two shapes do not belong together.
    """

    centres_m: NDArray[np.float64]
    radii_m: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.radii_m.ndim != 1 or self.centres_m.shape != (len(self.radii_m), 3):
            raise ValueError(
                f"{self.centres_m.shape} centres and {self.radii_m.shape} radii are not (n, 3) "
                "and (n,)"
            )

    def __len__(self) -> int:
        return len(self.radii_m)

    @property
    def volume_m3(self) -> float:
        """Sum of the volumes of the spheres, in cubic metres."""
        return total_volume(self.radii_m)


def total_volume(radii_m: NDArray[np.float64]) -> float:
    """Return the sum of the volumes, in cubic metres, of spheres of ``radii_m`` (metres)."""
    return float(4.0 / 3.0 * np.pi * np.sum(radii_m**3))


def meets_box(spheres: Spheres, low_m: ArrayLike, high_m: ArrayLike) -> NDArray[np.bool_]:
    """Tell which spheres share volume with the box ``[low_m, high_m]``; shape (n,)."""
    nearest = np.clip(spheres.centres_m, low_m, high_m)
    squared = np.sum((spheres.centres_m - nearest) ** 2, axis=1)
    return np.asarray(squared < spheres.radii_m**2)


def sphere_box_volume(spheres: Spheres, low_m: ArrayLike, high_m: ArrayLike) -> NDArray[np.float64]:
    """Return the volume that each sphere shares with the box ``[low_m, high_m]``.

    Closed form; the error is a few rounding errors of the sphere's own volume.

    Parameters
    ----------
    spheres
        The spheres.
    low_m, high_m
        Opposite corners of the box, shape (3,), in metres.

    Returns
    -------
    NDArray[np.float64]
        Shared volumes, shape (n,), in cubic metres.
    """
    radii = spheres.radii_m
    low, high = np.asarray(low_m, dtype=np.float64), np.asarray(high_m, dtype=np.float64)
    # Corners in units of the radius, seen from the centre; a ball ends at 1.
    ends = np.stack([low - spheres.centres_m, high - spheres.centres_m]) / radii[:, np.newaxis]
    ends = np.clip(ends, -1.0, 1.0)
    total = np.zeros(len(spheres))
    for corner in product((0, 1), repeat=3):
        a, b, c = (ends[corner[axis], :, axis] for axis in range(3))
        sign = (-1.0) ** (3 - sum(corner)) * np.sign(a) * np.sign(b) * np.sign(c)
        total += sign * _octant_volume(np.abs(a), np.abs(b), np.abs(c))
    shared: NDArray[np.float64] = np.maximum(total, 0.0) * radii**3
    return shared


def _octant_volume(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Volume of the unit ball within ``[0, a] x [0, b] x [0, c]``, each side from 0 to 1."""
    faces = (
        a * _quarter_disc_area(a, b, c)
        + b * _quarter_disc_area(b, c, a)
        + c * _quarter_disc_area(c, a, b)
    )
    caps = 0.5 * np.pi * ((1.0 - a) + (1.0 - b) + (1.0 - c))
    surface = 0.5 * np.pi - caps + _lens_area(a, b) + _lens_area(b, c) + _lens_area(c, a)
    corner_inside = a**2 + b**2 + c**2 <= 1.0
    return np.where(corner_inside, a * b * c, (surface + faces) / 3.0)


def _quarter_disc_area(
    height: NDArray[np.float64], p: NDArray[np.float64], q: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Area of ``[0, p] x [0, q]`` inside the circle that a plane at ``height`` cuts."""
    squared = 1.0 - height**2
    radius = np.sqrt(squared)
    p, q = np.minimum(p, radius), np.minimum(q, radius)
    # The circle at p has height s, at q width t: the arc runs from (t, q) to (p, s).
    # Rounding can put a side clipped to the radius just beyond it, hence the two maxima.
    s = np.sqrt(np.maximum(squared - p**2, 0.0))
    t = np.sqrt(np.maximum(squared - q**2, 0.0))
    cut = 0.5 * (p * s + q * t + squared * (np.arctan2(p, s) - np.arctan2(t, q)))
    return np.where(p**2 + q**2 <= squared, p * q, cut)


def _lens_area(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area of the unit sphere with x > p, y > q, z > 0: half the overlap of two caps.

    It is the integral of arccos(q / sqrt(1 - x^2)) over x from p to sqrt(1 - q^2). Where the caps
    do not overlap, w is zero and the terms cancel to zero.
    """
    w = np.sqrt(np.maximum(1.0 - p**2 - q**2, 0.0))
    area: NDArray[np.float64] = (
        0.5 * np.pi - p * np.arctan2(w, q) - q * np.arctan2(w, p) - np.arctan2(p * q, w)
    )
    return area
