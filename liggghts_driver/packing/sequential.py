"""Random sequential addition of spheres into a hard-walled box with fixed spheres in it.

Each sphere is tried at uniformly random places until it overlaps nothing placed before. The tries
are made for all waiting spheres at once: one k-d tree finds the overlaps of a whole batch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from liggghts_driver.errors import PackingError
from liggghts_driver.packing.overlap import Spheres, sphere_box_volume, total_volume

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

SEQUENTIAL_SATURATION = 0.38
"""Solid fraction at which random sequential addition of equal spheres saturates (0.384)."""

_SMALLEST_BATCH = 4096  # tries per batch: large enough for the cost per batch not to matter
_TRIES_PER_SPHERE = 300
_LEAST_TRIES = 200_000


@dataclass(frozen=True, eq=False)
class Room:
    """The space that spheres are placed in: a box with hard walls and fixed spheres.

    Parameters
    ----------
    low_m, high_m
        Opposite corners of the box, shape (3,), in metres.
    obstacles
        Fixed spheres, which may stick out of the box but do not overlap each other.
    """

    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    obstacles: Spheres

    def free_volume_m3(self) -> float:
        """Return the volume of the box less what the fixed spheres take, in cubic metres."""
        taken = sphere_box_volume(self.obstacles, self.low_m, self.high_m).sum()
        return float(np.prod(self.high_m - self.low_m) - taken)


def room_with_clearance(
    low_m: ArrayLike, high_m: ArrayLike, obstacles: Spheres | None, clearance_m: float
) -> Room:
    """Return the room in which spheres grown by half the clearance need no gap any more.

    A gap between any two surfaces is then the same as no overlap between surfaces that have all
    moved outwards by half of it, the walls inwards.

    Raises
    ------
    PackingError
        If the corners are in the wrong order or the clearance is negative.
    """
    if not (np.isfinite(clearance_m) and clearance_m >= 0.0):
        raise PackingError(f"the clearance cannot be {clearance_m:g} m")
    half = 0.5 * clearance_m
    low, high = np.asarray(low_m, dtype=np.float64), np.asarray(high_m, dtype=np.float64)
    if low.shape != (3,) or high.shape != (3,) or not np.all(low < high):
        raise PackingError(f"{low.tolist()} and {high.tolist()} are not two corners of a box")
    fixed = Spheres(np.empty((0, 3)), np.empty(0)) if obstacles is None else obstacles
    return Room(low + half, high - half, Spheres(fixed.centres_m, fixed.radii_m + half))


def require_spheres(radii_m: NDArray[np.float64]) -> None:
    """Refuse an empty set of spheres and radii that are not positive.

    Raises
    ------
    PackingError
        In either case.
    """
    if len(radii_m) == 0:
        raise PackingError("there is no sphere to place")
    if not np.all(radii_m > 0.0):
        raise PackingError("the radii of spheres to place are not all positive")


def asked_fraction(radii_m: NDArray[np.float64], room: Room) -> float:
    """Return the solid fraction that the spheres would have in the free volume of the room.

    Raises
    ------
    PackingError
        If the largest sphere does not fit between two opposite walls.
    """
    width = float(np.min(room.high_m - room.low_m))
    if 2.0 * float(np.max(radii_m)) > width:
        raise PackingError(
            f"a sphere of diameter {2.0 * float(np.max(radii_m)):.8g} m (any clearance included) "
            f"does not fit in a box {width:.8g} m wide"
        )
    free = room.free_volume_m3()
    return total_volume(radii_m) / free if free > 0.0 else np.inf


def place_sequentially(
    radii_m: NDArray[np.float64],
    low_m: ArrayLike,
    high_m: ArrayLike,
    rng: np.random.Generator,
    *,
    obstacles: Spheres | None = None,
    clearance_m: float = 0.0,
) -> Spheres:
    """Place spheres one after another at random in a box with hard walls.

    The order of ``radii_m`` is kept, and every sphere is tried until it is placed, so that index
    and size are as uncorrelated as they are in ``radii_m``.

    Parameters
    ----------
    radii_m
        Radii, shape (n,), in metres.
    low_m, high_m
        Opposite corners of the box, shape (3,), in metres; the spheres stay wholly inside.
    rng
        Source of randomness.
    obstacles
        Fixed spheres that must not be overlapped.
    clearance_m
        Smallest gap to any other sphere, obstacle or wall, in metres.

    Returns
    -------
    Spheres
        The placed spheres.

    Raises
    ------
    PackingError
        At once if the solid fraction is above ``SEQUENTIAL_SATURATION`` (Widom 1966; Torquato,
        Uche and Stillinger 2006), or once the tries are used up.
    """
    require_spheres(radii_m)
    room = room_with_clearance(low_m, high_m, obstacles, clearance_m)
    grown = radii_m + 0.5 * clearance_m
    fraction = asked_fraction(grown, room)
    if fraction > SEQUENTIAL_SATURATION:
        raise PackingError(
            f"{len(grown)} spheres would fill {fraction:.3f} of the free volume; random sequential "
            f"addition saturates near {SEQUENTIAL_SATURATION}: ask for fewer or smaller spheres"
        )
    return Spheres(add_until_full(grown, room, rng), radii_m)


def add_until_full(
    radii_m: NDArray[np.float64], room: Room, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return centres, shape (n, 3), in metres, of spheres added at random to the room.

    Raises
    ------
    PackingError
        If the tries are used up first.
    """
    count = len(radii_m)
    centres = np.full((count, 3), np.nan)
    waiting = np.arange(count)
    tries_left = max(_LEAST_TRIES, _TRIES_PER_SPHERE * count)
    while len(waiting) > 0:
        if tries_left <= 0:
            raise PackingError(
                f"asked for {count} spheres, placed {count - len(waiting)}: random sequential "
                "addition found no place for the rest; ask for fewer or smaller spheres"
            )
        owners = np.tile(waiting, -(-_SMALLEST_BATCH // len(waiting)))
        tries_left -= len(owners)
        placed = np.setdiff1d(np.arange(count), waiting, assume_unique=True)
        owners, points = _successful_tries(
            radii_m, owners, room, Spheres(centres[placed], radii_m[placed]), rng
        )
        centres[owners] = points
        waiting = np.setdiff1d(waiting, owners, assume_unique=True)
    return centres


def _successful_tries(
    radii_m: NDArray[np.float64],
    owners: NDArray[np.intp],
    room: Room,
    placed: Spheres,
    rng: np.random.Generator,
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Try one random point per entry of ``owners``; return who found a place, and where."""
    radii = radii_m[owners, np.newaxis]
    low, high = room.low_m + radii, room.high_m - radii
    tries = Spheres(low + (high - low) * rng.random((len(owners), 3)), radii_m[owners])
    free = ~(_hits(tries, room.obstacles) | _hits(tries, placed))
    # Of the tries of one sphere the first free one counts.
    owners, first = np.unique(owners[free], return_index=True)
    points = tries.centres_m[free][first]
    keep = _first_come(Spheres(points, radii_m[owners]))
    return owners[keep], points[keep]


def _hits(tries: Spheres, others: Spheres) -> NDArray[np.bool_]:
    """Tell which spheres of ``tries`` overlap any of ``others``; shape (n,)."""
    hit = np.zeros(len(tries), dtype=np.bool_)
    if len(others) == 0:
        return hit
    reach = float(np.max(tries.radii_m) + np.max(others.radii_m))
    near = cKDTree(tries.centres_m).sparse_distance_matrix(
        cKDTree(others.centres_m), reach, output_type="ndarray"
    )
    touching = near["v"] < tries.radii_m[near["i"]] + others.radii_m[near["j"]]
    hit[near["i"][touching]] = True
    return hit


def _first_come(spheres: Spheres) -> NDArray[np.bool_]:
    """Tell which spheres stay if each goes that overlaps an earlier one that stays; shape (n,)."""
    reach = 2.0 * float(np.max(spheres.radii_m, initial=0.0))
    pairs = cKDTree(spheres.centres_m).query_pairs(reach, output_type="ndarray")
    gaps = np.linalg.norm(spheres.centres_m[pairs[:, 0]] - spheres.centres_m[pairs[:, 1]], axis=1)
    pairs = pairs[gaps < spheres.radii_m[pairs].sum(axis=1)]
    stays = np.ones(len(spheres), dtype=np.bool_)
    # Sorted by the earlier sphere, so that its own fate is settled when its pairs come up.
    for earlier, later in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].tolist():
        if stays[earlier]:
            stays[later] = False
    return stays
