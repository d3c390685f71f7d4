"""Whether what drives a scene goes to and fro."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from liggghts_driver.scene.model import Scene


def swing_period_s(scene: Scene) -> float | None:
    """Period of the pressure gradient [s]; None where it is constant, or there is none."""
    pressure = scene.pressure
    return None if pressure is None or pressure.gradient == 0.0 else pressure.period
