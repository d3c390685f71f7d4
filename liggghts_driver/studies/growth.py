"""Energy that nothing has given: how far what should only fall has risen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: Growth is asked for in windows of this part of a run.
WINDOWS = 10


def growth_in_windows(free: Array, held: Array, work: Array) -> float:
    """The largest rise above the lowest before, over the energy or the work of that time.

    Of the whole run, and of each tenth of it: what a bed at rest gains is nothing beside what once
    fell into it, and much beside what it holds.

    Parameters
    ----------
    free
        ``(frames,)``, energy less all that was given: it should only fall [J].
    held
        ``(frames,)``, energy of the bodies [J].
    work
        ``(frames,)``, done on them since the start [J].
    """
    shares = [0.0]
    for width in (max(2, len(free) // WINDOWS), len(free)):
        for last in range(1, len(free)):
            part = slice(max(0, last - width), last + 1)
            rise = free[last] - free[part].min()
            shares.append(_share(rise, held[part], work[part]))
    return float(np.max(shares))  # keeps what is nan


def growth_from_start(free: Array, held: Array, work: Array, beside: float) -> float:
    """The largest rise above the start, over the largest energy or the work of the whole run.

    For bodies that turn: spins and the springs of friction are in no frame. They may give back
    what they took, so that the rest rises above what it was in between, but never above the sum at
    the start, in which spins had ``beside`` [J].
    """
    return _share(float((free - free[0])[1:].max(initial=0.0)) - beside, held, work)


def _share(rise: float, held: Array, work: Array) -> float:
    if rise <= 0.0:
        return 0.0
    scale = float(np.max([held.max(), np.abs(np.diff(work)).sum()]))
    return rise / scale if scale else math.inf
