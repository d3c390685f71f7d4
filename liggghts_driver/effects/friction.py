"""Tangential contact forces."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from liggghts_driver.effects import costs
from liggghts_driver.effects.base import Effect, Slot, Weight
from liggghts_driver.effects.contacts import pairwise
from liggghts_driver.effects.scales import PILED_UP

if TYPE_CHECKING:
    from collections.abc import Mapping

    from liggghts_driver.case import Case
    from liggghts_driver.scene.model import Scene


class Friction(Effect):
    """Tangential forces: a spring with history that slips at Coulomb's limit."""

    name: ClassVar[str] = "friction"
    title: ClassVar[str] = "tangential friction"
    slot: ClassVar[Slot] = "materials"
    order: ClassVar[int] = 1
    without: ClassVar[Mapping[str, Any]] = {
        "contact.friction": 0.0,
        "contact.rolling_friction": 0.0,
    }
    contact_words: ClassVar[tuple[str, ...]] = ("tangential", "history")

    def decide(self, scene: Scene) -> tuple[bool, str]:
        """In when the friction coefficient is above zero."""
        mu = scene.contact.friction
        if mu > 0:
            return True, f"friction coefficient {mu:g}"
        return False, "friction = 0: no tangential force, so no contact history"

    def weigh(self, case: Case) -> Weight:
        """The friction angle; the share is larger than the coefficient.

        Where particles pile up friction builds arches: see ``scales.PILED_UP``.
        """
        mu = case.scene.contact.friction
        angle = math.degrees(math.atan(mu))
        meaning = "arctan of the coefficient, degrees"
        return Weight("friction angle", meaning, angle, min(1.0, PILED_UP * mu))

    def cost(self, case: Case) -> float:  # noqa: ARG002
        """Tangential springs and their history."""
        return costs.FRICTION

    def values(self, case: Case) -> dict[str, object]:
        """The coefficient for every pair of materials."""
        return {"coefficient": pairwise(case, case.scene.contact.friction)}
