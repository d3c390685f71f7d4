"""The weight of the particles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.scales import scales_of, share

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


def uniform_force(case: Case, factor: float) -> dict[str, object]:
    """Gravity times a factor, as the engine's ``fix gravity`` wants it."""
    assert case.scene.gravity is not None
    x, y, z = (factor * a for a in case.scene.gravity.acceleration)
    return {"magnitude": math.hypot(x, y, z), "x": x, "y": y, "z": z}


class Gravity(Effect):
    """The weight of the particles."""

    name: ClassVar[str] = "gravity"
    title: ClassVar[str] = "gravity"
    slot: ClassVar[Slot] = "forces"
    order: ClassVar[int] = 2
    without: ClassVar[Mapping[str, Any]] = {"gravity": None}

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the scene has an acceleration of gravity."""
        if scene.gravity is None or not any(scene.gravity.acceleration):
            return False, "the scene has no [gravity]"
        return True, f"{math.hypot(*scene.gravity.acceleration):g} m/s2"

    def weigh(self, case: Case) -> Weight:
        """Weight, less what the fluid carries, over the largest of the other forces."""
        scales, scene = scales_of(case), case.scene
        others = max(scales.pressure_n, scales.carried_n, scales.inertia_n)
        weight = scales.weight_n * abs(1.0 - scene.buoyed_share)
        meaning = "weight (less buoyancy) over the largest other force"
        number = weight / others if others else math.inf
        return Weight("gravity number", meaning, number, share(weight, others))

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """The engine's own uniform force."""
        return costs.UNIFORM_FORCE

    def values(self, case: Case) -> dict[str, object]:
        """Magnitude and direction."""
        return uniform_force(case, 1.0)
