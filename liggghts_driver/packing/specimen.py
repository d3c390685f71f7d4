"""The porous solid: a cuboid specimen of fixed grains.

The cuboid is ``[0, lx] x [-ly/2, ly/2] x [-lz/2, lz/2]``: the flow enters at x = 0 and the axis of
the channel is the x axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from liggghts_driver.errors import PackingError
from liggghts_driver.packing.overlap import (
    Spheres,
    meets_box,
    sphere_box_volume,
    total_volume,
)
from liggghts_driver.packing.radii import largest_radius, mean_sphere_volume, sample_radii
from liggghts_driver.packing.relaxation import (
    PERIODIC_LIMIT,
    WALLED_LIMIT,
    pack_periodic,
    place_spheres,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

Cut = Literal["bulk", "inside"]


@dataclass(frozen=True, eq=False)
class Specimen:
    """Grains of a cuboid specimen.

    Parameters
    ----------
    spheres
        Every grain, whole.
    low_m, high_m
        Opposite corners of the cuboid, shape (3,), in metres.
    solid_fraction
        Measured part of the cuboid's volume that lies inside grains.
    """

    spheres: Spheres
    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    solid_fraction: float


def cut_specimen(
    solid_fraction: float,
    mean_m: float,
    deviation_m: float,
    truncation: float,
    size_m: tuple[float, float, float],
    rng: np.random.Generator,
    *,
    cut: Cut = "bulk",
) -> Specimen:
    """Make a specimen of grains whose radii follow a truncated Gaussian.

    Parameters
    ----------
    solid_fraction
        Wanted solid fraction v1.
    mean_m, deviation_m, truncation
        The distribution of the radii: mean and deviation in metres, truncation in deviations.
    size_m
        Edges (lx, ly, lz) of the cuboid, in metres.
    rng
        Source of randomness.
    cut
        ``"bulk"`` cuts the cuboid out of a periodic packing of exactly the wanted fraction and
        keeps whole every grain that meets it, so that grains stick out; the fraction inside the
        cuboid fluctuates about the wanted one from seed to seed. ``"inside"`` places whole grains
        inside the cuboid, as many as come closest to the wanted fraction.

    Returns
    -------
    Specimen
        The grains and their measured solid fraction.

    Raises
    ------
    PackingError
        If an argument makes no sense or the fraction cannot be reached; grains placed inside a
        cuboid ten radii wide end near 0.53, and the message says what was reached.
    """
    size = np.asarray(size_m, dtype=np.float64)
    if size.shape != (3,) or not (np.all(np.isfinite(size)) and np.all(size > 0.0)):
        raise PackingError(f"the size of a specimen is three positive lengths, not {size_m}")
    if cut not in get_args(Cut):
        raise PackingError(f"a specimen is cut as one of {get_args(Cut)}, not {cut!r}")
    limit = PERIODIC_LIMIT if cut == "bulk" else WALLED_LIMIT
    if not 0.0 < solid_fraction <= limit:
        raise PackingError(
            f"a solid fraction of {solid_fraction:g} is outside (0, {limit}]: random packings end "
            "at 0.64 (random close packing), and earlier between walls"
        )
    grains = _Grains(mean_m, deviation_m, truncation)
    low = np.array([0.0, -0.5 * size[1], -0.5 * size[2]])
    make = _from_bulk if cut == "bulk" else _wholly_inside
    spheres = make(solid_fraction, grains, low, low + size, rng)
    filled = float(np.sum(sphere_box_volume(spheres, low, low + size)))
    return Specimen(spheres, low, low + size, filled / float(np.prod(size)))


@dataclass(frozen=True)
class _Grains:
    """The distribution of the grains' radii, in metres."""

    mean_m: float
    deviation_m: float
    truncation: float

    @property
    def largest_m(self) -> float:
        return largest_radius(self.mean_m, self.deviation_m, self.truncation)

    def sample(self, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
        return sample_radii(self.mean_m, self.deviation_m, count, rng, self.truncation)

    def filling(self, volume_m3: float, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw radii until the grains fill the volume, in cubic metres, or just more."""
        mean_volume = mean_sphere_volume(self.mean_m, self.deviation_m, self.truncation)
        radii = self.sample(int(np.ceil(volume_m3 / mean_volume)), rng)
        while total_volume(radii) < volume_m3:
            radii = np.append(radii, self.sample(1, rng))
        filled = np.cumsum(4.0 / 3.0 * np.pi * radii**3)
        return radii[: np.searchsorted(filled, volume_m3) + 1]


def _from_bulk(
    solid_fraction: float,
    grains: _Grains,
    low_m: NDArray[np.float64],
    high_m: NDArray[np.float64],
    rng: np.random.Generator,
) -> Spheres:
    """Keep the grains of a periodic packing that meet the cuboid."""
    # One largest diameter beyond the cuboid on each side: no grain meets it twice, and a grain on
    # one side of the cuboid is no neighbour of a grain on the other.
    edges = high_m - low_m + 4.0 * grains.largest_m
    radii = grains.filling(solid_fraction * float(np.prod(edges)), rng)
    edges *= (total_volume(radii) / (solid_fraction * float(np.prod(edges)))) ** (1.0 / 3.0)
    packing = pack_periodic(radii, edges, rng)
    centres = packing.centres_m + 0.5 * (low_m + high_m - edges)
    kept = meets_box(Spheres(centres, radii), low_m, high_m)
    return Spheres(centres[kept], radii[kept])


def _wholly_inside(
    solid_fraction: float,
    grains: _Grains,
    low_m: NDArray[np.float64],
    high_m: NDArray[np.float64],
    rng: np.random.Generator,
) -> Spheres:
    """Place grains between hard walls at the faces of the cuboid."""
    if 2.0 * grains.largest_m > np.min(high_m - low_m):
        raise PackingError(
            f"a grain of radius {grains.largest_m:g} m does not fit inside a specimen "
            f"{np.min(high_m - low_m):g} m wide"
        )
    volume = float(np.prod(high_m - low_m))
    radii = grains.filling(solid_fraction * volume, rng)
    without_last = total_volume(radii[:-1])
    nearer_without = 2.0 * solid_fraction * volume < without_last + total_volume(radii)
    if nearer_without and len(radii) > 1:
        radii = radii[:-1]
    try:
        return place_spheres(radii, low_m, high_m, rng)
    except PackingError as stalled:
        most = _most_that_fit(radii, low_m, high_m, rng)
        reached = total_volume(radii[:most]) / volume
        raise PackingError(
            f"asked for {len(radii)} whole grains inside the specimen, at a solid fraction of "
            f"{solid_fraction:.3f}; reached {most} at {reached:.3f}, because walls loosen the "
            "layer next to them: lower the fraction, or cut the specimen from a bulk packing"
        ) from stalled


def _most_that_fit(
    radii_m: NDArray[np.float64],
    low_m: NDArray[np.float64],
    high_m: NDArray[np.float64],
    rng: np.random.Generator,
) -> int:
    """Return how many of the first grains can be placed, to within about two per cent."""
    count = len(radii_m)
    while count > 1:
        count -= max(1, count // 50)
        try:
            place_spheres(radii_m[:count], low_m, high_m, rng)
        except PackingError:
            continue
        return count
    return 0
