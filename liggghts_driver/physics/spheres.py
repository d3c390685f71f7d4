"""Volume of a sphere, and its moment of inertia."""

from __future__ import annotations

import math

#: The moment of inertia of a sphere over m r^2.
INERTIA = 0.4


def sphere_volume_m3(radius_m: float) -> float:
    """Volume of a sphere."""
    return 4.0 / 3.0 * math.pi * radius_m**3
