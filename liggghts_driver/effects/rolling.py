"""Torques that resist rolling."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.contacts import pairwise
from liggghts_driver.effects.scales import PILED_UP

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class RollingResistance(Effect):
    """Rolling resistance: a torsional spring that yields at the torque mu_R r N (epsd2)."""

    name: ClassVar[str] = "rolling"
    title: ClassVar[str] = "rolling resistance"
    slot: ClassVar[Slot] = "materials"
    order: ClassVar[int] = 2
    needs: ClassVar[tuple[str, ...]] = ("friction",)
    without: ClassVar[Mapping[str, Any]] = {"contact.rolling_friction": 0.0}
    contact_words: ClassVar[tuple[str, ...]] = ("rolling_friction", "epsd2")

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the rolling resistance coefficient is above zero."""
        mu = scene.contact.rolling_friction
        if mu > 0:
            return True, f"rolling resistance coefficient {mu:g}"
        return False, "rolling_friction = 0: no resisting torque"

    def weigh(self, case: Case) -> Weight:
        """The largest torque over normal force times radius; the share is larger in a pile."""
        mu = case.scene.contact.rolling_friction
        meaning = "largest torque over normal force x radius"
        return Weight("rolling resistance", meaning, mu, min(1.0, PILED_UP * mu))

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """Rolling springs and their history."""
        return costs.ROLLING

    def values(self, case: Case) -> dict[str, object]:
        """The coefficient for every pair of materials."""
        return {"coefficient": pairwise(case, case.scene.contact.rolling_friction)}
