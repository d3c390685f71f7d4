"""What goes to and fro in time: cos(2 pi t / period) of its largest value.

A period of None stands for what is constant, so that callers need not ask.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def angular_rate_rad_s(period_s: float | None) -> float:
    """2 pi / period [rad/s]; zero for what is constant."""
    return 0.0 if period_s is None else 2.0 * math.pi / period_s


def swing(times_s: ArrayLike, period_s: float | None) -> NDArray[np.float64]:
    """The share of the largest value at some times, of their shape: -1 to 1."""
    return np.cos(angular_rate_rad_s(period_s) * np.asarray(times_s, dtype=float))


def pushes(duration_s: float, period_s: float | None) -> int:
    """Stretches of time without a change of sign, the first of which lasts a quarter of a period.

    In each of them a force that goes so does at most the work of its largest value over the way
    between the ends of what it moves in, however often that is thrown back: it rises to its largest
    value and falls again, so that by Bonnet's mean value theorem its integral over the way is its
    largest value times the distance of two places.
    """
    if period_s is None:
        return 1
    return 1 + math.floor(2.0 * duration_s / period_s + 0.5)
