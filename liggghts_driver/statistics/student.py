"""Student's t: the mean of a few independent values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import t as student

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_CONFIDENCE = 0.95


def students_half_width(values: Sequence[float] | NDArray[np.float64]) -> float | None:
    """Half width of the 95 % interval of a mean; None for fewer than two values."""
    count = len(values)
    if count < 2:
        return None
    error = float(np.std(values, ddof=1)) / math.sqrt(count)
    return float(student.ppf((1.0 + _CONFIDENCE) / 2.0, count - 1)) * error
