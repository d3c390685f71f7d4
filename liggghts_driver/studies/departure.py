"""Whether a run departs from the sound one by more than its step explains."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from liggghts_driver.studies.invariants import MOST_CHANGE, Invariant

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from liggghts_driver.studies.energy import Ran

    Array = NDArray[np.float64]

#: A departure counts where it is so many times that of the run with half the step. In a bed every
#: collision multiplies both, until nothing more is to be seen; before that they are far apart.
TIMES_THE_STEP = 10.0


def departure(ran: Ran, sound: Ran, fine: Ran) -> Invariant:
    """How far the particles are from their way, as a share of that way, at the worst of the frames.

    All are root mean squares over the particles. Frames in which half the step makes a tenth as
    much of a difference say nothing.

    Parameters
    ----------
    ran
        The run in doubt.
    sound, fine
        The same without doubt, with the same and with half the step.
    """
    name = "departure from the sound run"
    until_s = min(float(each.times_s[-1]) for each in (ran, sound, fine))
    times = ran.times_s[(ran.times_s > 0.0) & (ran.times_s <= until_s)]
    places = sound.places_at(times)
    way = _rms(places - sound.positions_m[0])
    if not way.any():
        return Invariant(name, 0.0, MOST_CHANGE, "no particle moves")
    off, of_step = _rms(ran.places_at(times) - places), _rms(fine.places_at(times) - places)
    counts = (way > 0.0) & (off > TIMES_THE_STEP * of_step)
    return Invariant(name, float((off[counts] / way[counts]).max(initial=0.0)), MOST_CHANGE)


def _rms(vectors: Array) -> Array:
    """Of ``(frames, particles, 3)``, in each frame."""
    return np.asarray(np.sqrt((vectors**2).sum(axis=2).mean(axis=1)))
