"""Volume of a sphere."""

from __future__ import annotations

import math


def sphere_volume_m3(radius_m: float) -> float:
    """Volume of a sphere."""
    return 4.0 / 3.0 * math.pi * radius_m**3
