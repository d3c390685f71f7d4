"""Dense packings by overlap removal, and the front door that chooses between the two methods.

Spheres start at random. Each pair that is closer than a small target gap repels like a linear
spring, and the spheres move with momentum and friction (Polyak's heavy-ball descent of the elastic
energy) until nothing overlaps. Because the springs aim at a small positive gap, the end comes
after finitely many steps, with the radii as asked and without any overlap at all.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from liggghts_driver.errors import PackingError
from liggghts_driver.packing.overlap import Spheres, total_volume
from liggghts_driver.packing.sequential import (
    add_until_full,
    asked_fraction,
    require_spheres,
    room_with_clearance,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

PERIODIC_LIMIT = 0.62
"""Solid fraction above which a periodic packing is refused (random close packing: 0.64)."""
WALLED_LIMIT = 0.60
"""Solid fraction above which a packing between walls is refused (walls loosen their layer)."""
SEQUENTIAL_LIMIT = 0.25
"""Solid fraction above which relaxation is faster than random sequential addition."""

_START_FRACTION = 0.15  # spheres in a room start shrunk to this fraction, clear of the obstacles
_LEAST_GAP = 1e-6  # of the smallest radius: far above rounding, far below anything that matters
# In mean radii:
_TARGET_GAP = 4e-3
_SKIN = 0.3
_LONGEST_STEP = 0.1
# With springs of stiffness 1 the stiffest mode is 5 to 6.6 once the random start has spread, and
# heavy-ball descent is stable while push times stiffness stays below 2 (1 + momentum) = 3.9; the
# first few steps, of stiffness up to 10, are held by the longest step.
_PUSH = 0.5
_MOMENTUM = 0.95
_MOST_STEPS = 6000
_CHECK_EVERY = 500
_STALLED = 0.9  # gives up when this part of the elastic energy outlives one check


@dataclass(frozen=True, eq=False)
class _Cell:
    """What confines the moving spheres: a period, or walls and fixed spheres."""

    obstacles: Spheres
    period_m: NDArray[np.float64] | None = None
    low_m: ArrayLike = -np.inf
    high_m: ArrayLike = np.inf

    def nearest_image(self, offsets_m: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.period_m is None:
            return offsets_m
        return offsets_m - self.period_m * np.round(offsets_m / self.period_m)

    def home_image(self, centres_m: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.period_m is None:
            return centres_m
        wrapped = centres_m % self.period_m
        # A tiny negative number wraps to the period itself, which is outside.
        return np.where(wrapped < self.period_m, wrapped, 0.0)


class _Neighbours:
    """The pairs that can touch before a sphere has moved by half of a skin (a Verlet list).

    Pairs are indices into the moving spheres followed by the fixed ones.
    """

    def __init__(self, moving: Spheres, cell: _Cell, skin_m: float) -> None:
        self._built_at = moving.centres_m
        self._half_skin = 0.5 * skin_m
        self._cell = cell
        radii = np.concatenate([moving.radii_m, cell.obstacles.radii_m])
        first, second = _close_pairs(moving, cell, skin_m)
        distances = np.linalg.norm(self._offsets(moving.centres_m, first, second), axis=1)
        close = distances < radii[first] + radii[second] + skin_m
        self.first, self.second = first[close], second[close]
        self.contact_m = radii[self.first] + radii[self.second]
        self.fixed_part_m = np.where(self.second < len(moving), 0.0, radii[self.second])

    def _offsets(
        self, centres_m: NDArray[np.float64], first: NDArray[np.intp], second: NDArray[np.intp]
    ) -> NDArray[np.float64]:
        everyone = np.concatenate([centres_m, self._cell.obstacles.centres_m])
        return self._cell.nearest_image(everyone[first] - everyone[second])

    def cover(self, centres_m: NDArray[np.float64]) -> bool:
        """Tell whether no pair can have come into contact unlisted."""
        squared = np.sum((centres_m - self._built_at) ** 2, axis=1)
        return bool(np.max(squared) < self._half_skin**2)

    def separations(
        self, centres_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the offsets from second to first, shape (m, 3), and their lengths, (m,)."""
        offsets = self._offsets(centres_m, self.first, self.second)
        return offsets, np.sqrt(np.einsum("ij,ij->i", offsets, offsets))

    def net_push(self, pushes_m: NDArray[np.float64], count: int) -> NDArray[np.float64]:
        """Sum pair pushes, shape (m, 3), over the moving spheres; shape (count, 3)."""
        total = [
            np.bincount(self.first, push, count) - np.bincount(self.second, push, count)[:count]
            for push in pushes_m.T
        ]
        return np.stack(total, axis=1)


def _close_pairs(
    moving: Spheres, cell: _Cell, skin_m: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the two indices of each pair within the longest contact distance plus the skin."""
    longest = float(np.max(moving.radii_m))
    tree = cKDTree(cell.home_image(moving.centres_m), boxsize=cell.period_m)
    pairs = tree.query_pairs(2.0 * longest + skin_m, output_type="ndarray")
    if len(cell.obstacles) == 0:
        return pairs[:, 0], pairs[:, 1]
    reach = longest + float(np.max(cell.obstacles.radii_m)) + skin_m
    fixed = tree.sparse_distance_matrix(
        cKDTree(cell.obstacles.centres_m), reach, output_type="ndarray"
    )
    second = np.concatenate([pairs[:, 1], fixed["j"] + len(moving)])
    return np.concatenate([pairs[:, 0], fixed["i"]]), second


def _remove_overlaps(start: Spheres, cell: _Cell) -> tuple[NDArray[np.float64], float]:
    """Push spheres apart until none overlap or no progress is made.

    Returns
    -------
    tuple[NDArray[np.float64], float]
        Centres, shape (n, 3), in metres, and the factor by which the radii of the moving spheres
        must be multiplied for no overlap to be left: at least one after success.
    """
    centres, radii = start.centres_m, start.radii_m
    mean = float(np.mean(radii))
    velocity = np.zeros_like(centres)
    neighbours = _Neighbours(start, cell, _SKIN * mean)
    energy_at_check = np.inf
    for step in range(1, _MOST_STEPS + 1):
        if not neighbours.cover(centres):
            neighbours = _Neighbours(Spheres(centres, radii), cell, _SKIN * mean)
        offsets, distances = neighbours.separations(centres)
        squeeze = neighbours.contact_m - distances
        if not np.any(squeeze > 0.0):
            break
        squeeze = np.maximum(squeeze + _TARGET_GAP * mean, 0.0)
        if step % _CHECK_EVERY == 0:
            energy = float(np.sum(squeeze**2))
            if energy > _STALLED * energy_at_check:
                break
            energy_at_check = energy
        push = neighbours.net_push(offsets * (squeeze / distances)[:, np.newaxis], len(radii))
        velocity = _MOMENTUM * velocity + _PUSH * push
        fastest = float(np.sqrt(np.max(np.sum(velocity**2, axis=1))))
        if fastest > _LONGEST_STEP * mean:
            velocity *= _LONGEST_STEP * mean / fastest
        centres = np.clip(centres + velocity, cell.low_m, cell.high_m)
    fixed = neighbours.fixed_part_m
    fits = (distances - fixed) / (neighbours.contact_m - fixed)
    return cell.home_image(centres), float(np.min(fits, initial=np.inf))


def pack_periodic(
    radii_m: NDArray[np.float64], edges_m: ArrayLike, rng: np.random.Generator
) -> Spheres:
    """Pack spheres at random in a box that repeats in every direction.

    Parameters
    ----------
    radii_m
        Radii, shape (n,), in metres; their order is kept.
    edges_m
        Edges of the box, shape (3,), in metres; it starts at the origin.
    rng
        Source of randomness.

    Returns
    -------
    Spheres
        Spheres with centres inside the box; none overlaps another or an image of one.

    Raises
    ------
    PackingError
        At once if the solid fraction is above ``PERIODIC_LIMIT`` or the box is so narrow that a
        sphere could meet two images of another; or when overlap removal stalls.
    """
    require_spheres(radii_m)
    edges = np.asarray(edges_m, dtype=np.float64)
    grown = radii_m + 0.5 * _LEAST_GAP * np.min(radii_m)
    narrowest = 2.0 * (2.0 * float(np.max(grown)) + _SKIN * float(np.mean(grown)))
    if not np.min(edges) >= narrowest:
        raise PackingError(
            f"a periodic box {np.min(edges):g} m wide is too narrow for spheres of radius "
            f"{np.max(radii_m):g} m: it has to be {narrowest:g} m at least"
        )
    fraction = total_volume(radii_m) / float(np.prod(edges))
    # A box made for exactly the limit comes out beyond it by rounding.
    if fraction > PERIODIC_LIMIT * (1.0 + 1e-9):
        raise PackingError(
            f"{len(radii_m)} spheres would fill {fraction:.3f} of the periodic box; random "
            f"packings end at 0.64 (random close packing), those made here at {PERIODIC_LIMIT}"
        )
    nothing = Spheres(np.empty((0, 3)), np.empty(0))
    start = Spheres(edges * rng.random((len(grown), 3)), grown)
    centres = _relaxed(start, _Cell(nothing, period_m=edges), fraction)
    return Spheres(centres, radii_m)


def place_spheres(
    radii_m: NDArray[np.float64],
    low_m: ArrayLike,
    high_m: ArrayLike,
    rng: np.random.Generator,
    *,
    obstacles: Spheres | None = None,
    clearance_m: float = 0.0,
) -> Spheres:
    """Place spheres at random in a box with hard walls, by the method that suits their fraction.

    Random sequential addition up to ``SEQUENTIAL_LIMIT`` of the free volume; overlap removal above
    that, and where the walls leave sequential addition no place.

    Parameters
    ----------
    radii_m
        Radii, shape (n,), in metres; their order is kept.
    low_m, high_m
        Opposite corners of the box, shape (3,), in metres; the spheres stay wholly inside.
    rng
        Source of randomness.
    obstacles
        Fixed spheres that must not be overlapped; they may stick out of the box.
    clearance_m
        Smallest gap to any other sphere, obstacle or wall, in metres.

    Returns
    -------
    Spheres
        The placed spheres.

    Raises
    ------
    PackingError
        At once if the solid fraction is above ``WALLED_LIMIT``; or when overlap removal stalls.
    """
    require_spheres(radii_m)
    clearance = clearance_m + _LEAST_GAP * float(np.min(radii_m))
    room = room_with_clearance(low_m, high_m, obstacles, clearance)
    grown = radii_m + 0.5 * clearance
    fraction = asked_fraction(grown, room)
    if fraction > WALLED_LIMIT:
        raise PackingError(
            f"{len(radii_m)} spheres would fill {fraction:.3f} of the free volume; random packings "
            "end at 0.64 (random close packing), walls loosen the layer next to them, and above "
            f"{WALLED_LIMIT} nothing is tried: ask for fewer or smaller spheres"
        )
    if fraction <= SEQUENTIAL_LIMIT:
        with suppress(PackingError):
            return Spheres(add_until_full(grown, room, rng), radii_m)
    shrunk = grown * min(1.0, _START_FRACTION / fraction) ** (1.0 / 3.0)
    own = grown[:, np.newaxis]
    cell = _Cell(room.obstacles, low_m=room.low_m + own, high_m=room.high_m - own)
    start = np.clip(add_until_full(shrunk, room, rng), cell.low_m, cell.high_m)
    return Spheres(_relaxed(Spheres(start, grown), cell, fraction), radii_m)


def _relaxed(start: Spheres, cell: _Cell, fraction: float) -> NDArray[np.float64]:
    """Return centres without overlap, or raise with what was asked and what was reached."""
    centres, fits = _remove_overlaps(start, cell)
    if fits < 1.0:
        raise PackingError(
            f"asked for {len(start)} spheres at a solid fraction of {fraction:.3f}; overlap "
            "removal stalled, and the same spheres fit only when shrunk until they fill "
            f"{fraction * max(fits, 0.0) ** 3:.3f}"
        )
    return centres
