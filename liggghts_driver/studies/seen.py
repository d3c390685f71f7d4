"""What can be seen to happen in a finished run: contacts, hits, retreats."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from liggghts_driver.contacts import Contacts
    from liggghts_driver.studies.energy import Ran

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]

#: A body was hit if its velocity changed by so much of itself from one frame to the next.
_HIT = 0.01


def touching(ran: Ran) -> Iterator[dict[str, Contacts]]:
    """The contacts of each frame, by their kind, those kinds alone of which there are any."""
    for contacts in ran.contacts():
        yield {some.kind: some for some in contacts if len(some.first)}


def share_touching(ran: Ran, *kinds: str, since: float = 0.0) -> float:
    """Share of the frames, from a share of the run on, in which there are contacts of all kinds."""
    flags = [all(kind in found for kind in kinds) for found in touching(ran)]
    return float(np.mean(flags[int(since * len(flags)) :]))


def share_in_contact(ran: Ran) -> float:
    """Share of particles times frames in which a particle touches anything."""
    bodies = 0
    for found in touching(ran):
        rows = {int(row) for some in found.values() for row in (*some.first, *some.second)}
        bodies += len(rows & set(range(ran.positions_m.shape[1])))
    return bodies / max(1, ran.positions_m[..., 0].size)


def hits(ran: Ran) -> Flags:
    """Who was hit between a frame and the next, ``(frames - 1, particles)``.

    It says something only where nothing else than collisions changes a velocity.
    """
    changes = np.linalg.norm(np.diff(ran.velocities_m_s, axis=0), axis=2)
    speeds = np.linalg.norm(ran.velocities_m_s, axis=2)
    return np.asarray(changes > _HIT * np.maximum(speeds[1:], speeds[:-1]))


def retreats_m(place: Array) -> Array:
    """How far something goes back each time, ``(times,)``."""
    steps = np.diff(place)
    steps = steps[steps != 0.0]
    turns = np.flatnonzero(np.diff(np.sign(steps))) + 1
    ways = np.array([way.sum() for way in np.split(steps, turns)])
    return np.asarray(-ways[ways < 0.0])


def piston_retreats(ran: Ran) -> Array:
    """How far the piston goes back each time, in radii of the smallest sphere."""
    radius = float(ran.case.population.radii_m.min())
    return retreats_m(ran.series["piston_x_m"].to_numpy()) / radius


def at_once(flags: Flags) -> float:
    """The most particles of which something is true in one frame, flags ``(frames, particles)``."""
    return float(flags.sum(axis=1).max(initial=0))
